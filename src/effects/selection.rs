//! Which effects are wanted: `--effects`.

use std::fmt;
use std::str::FromStr;

use super::{Effect, Effects};
use crate::scene::Scene;

/// Which effects a user wants: `auto`, `all` or names; `-name` takes one away. As given, for messages and metadata.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Selection {
    terms: Vec<Term>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Term {
    Auto,
    All,
    With(Effect),
    Without(Effect),
}

impl Default for Selection {
    fn default() -> Self {
        Self { terms: vec![Term::Auto] }
    }
}

impl Selection {
    /// The effects that this selects for `scene`; one that needs another which is not selected is not.
    pub fn resolve(&self, scene: &Scene) -> Effects {
        let selected = self.selected(scene);
        selected.iter().filter(|effect| effect.row().needs.is_none_or(|needed| selected.contains(needed))).collect()
    }

    /// Whether `effect` is selected or not whatever the scene calls for; `None`: that decides.
    pub fn wish(&self, effect: Effect) -> Option<bool> {
        let start = if matches!(self.terms.first(), Some(Term::Without(_))) { None } else { Some(false) };
        self.terms.iter().fold(start, |wish, &term| match term {
            Term::Auto => {
                if wish == Some(true) {
                    wish
                } else {
                    None
                }
            }
            Term::All => Some(true),
            Term::With(named) => {
                if named == effect {
                    Some(true)
                } else {
                    wish
                }
            }
            Term::Without(named) => {
                if named == effect {
                    Some(false)
                } else {
                    wish
                }
            }
        })
    }

    /// What the scene calls for, but for effects that are wished for or not.
    pub fn of_wishes(wishes: impl IntoIterator<Item = (Effect, Option<bool>)>) -> Self {
        let (mut terms, mut without) = (vec![Term::Auto], Vec::new());
        for (effect, wish) in wishes {
            match wish {
                Some(true) => terms.push(Term::With(effect)),
                Some(false) => without.push(Term::Without(effect)),
                None => {}
            }
        }
        terms.extend(without);
        Self { terms }
    }

    fn selected(&self, scene: &Scene) -> Effects {
        Effect::all()
            .filter(|&effect| {
                // Later terms win; a selection that only takes away starts from what the scene calls for.
                let start = matches!(self.terms.first(), Some(Term::Without(_))) && effect.called_for_by(scene);
                self.terms.iter().fold(start, |on, &term| match term {
                    Term::Auto => on || effect.called_for_by(scene),
                    Term::All => true,
                    Term::With(named) => on || named == effect,
                    Term::Without(named) => on && named != effect,
                })
            })
            .collect()
    }
}

impl FromStr for Selection {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let term = |term: &str| match term.trim() {
            "auto" => Ok(Term::Auto),
            "all" => Ok(Term::All),
            name => match name.strip_prefix('-') {
                Some(name) => name.parse().map(Term::Without),
                None => name.parse().map(Term::With),
            },
        };
        Ok(Self { terms: text.split(',').map(term).collect::<Result<_, _>>()? })
    }
}

impl fmt::Display for Selection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, term) in self.terms.iter().enumerate() {
            let comma = if i == 0 { "" } else { "," };
            match term {
                Term::Auto => write!(f, "{comma}auto"),
                Term::All => write!(f, "{comma}all"),
                Term::With(effect) => write!(f, "{comma}{}", effect.name()),
                Term::Without(effect) => write!(f, "{comma}-{}", effect.name()),
            }?;
        }
        Ok(())
    }
}
