//! The effects, as one table: what each is called, what in a scene calls for it, and which models honour it.
//!
//! An effect that is off is compiled out: its bit sets a specialization constant of the shaders.

use std::fmt;
use std::str::FromStr;

use crate::options::Model;
use crate::scene::{Dielectric, Material, Object, Scene, Surface};

/// A row of the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u32)]
pub enum Effect {
    /// Light mirrored by a surface
    Reflection,
    /// Light refracted through a surface
    Transmission,
    /// More than one interface on the way of the light
    Interior,
    /// Point lights
    DirectLight,
    /// Surfaces between a point light and what it lights
    Shadows,
    /// Light scattered by a rough dielectric
    Roughness,
    /// Light that a single bounce between microfacets loses
    EnergyCompensation,
    /// Light absorbed on its way through a body
    Absorption,
    /// An index of refraction that changes with the wavelength
    Dispersion,
    /// Dielectrics that overlap or hold one another
    Nesting,
    /// Panes without an inside
    ThinWalled,
    /// Surfaces that are no dielectrics
    Opaque,
    /// Images on surfaces
    Textures,
}

/// The highest roughness that still counts as smooth: the original's default.
pub const SMOOTH: f64 = 0.01;

struct Row {
    effect: Effect,
    name: &'static str,
    models: &'static [Model],
    /// Without this it changes nothing, and is not simulated.
    needs: Option<Effect>,
    called_for: fn(&Scene) -> bool,
}

/// THE table. Detection is conservative: an effect that might show is called for.
const TABLE: [Row; 13] = {
    use Effect::*;
    use Model::{Double, Path, Single, Tree};
    const TRACED: &[Model] = &[Tree, Path];
    const ALL: &[Model] = &[Single, Double, Tree, Path];
    const ROUGH: &[Model] = &[Single, Double, Path];
    const INSIDE: &[Model] = &[Double, Tree, Path];
    const fn row(effect: Effect, name: &'static str, models: &'static [Model], called_for: fn(&Scene) -> bool) -> Row {
        let needs = if matches!(effect, EnergyCompensation) { Some(Roughness) } else { None };
        Row { effect, name, models, needs, called_for }
    }
    [
        row(Reflection, "reflection", ALL, |s| any_dielectric(s, |_| true)),
        row(Transmission, "transmission", ALL, |s| any_dielectric(s, |_| true)),
        row(Interior, "interior", INSIDE, |s| any_dielectric(s, |_| true)),
        row(DirectLight, "direct-light", ALL, has_light),
        row(Shadows, "shadows", TRACED, has_light),
        row(Roughness, "roughness", ROUGH, |s| any_dielectric(s, |d| d.roughness > SMOOTH)),
        row(EnergyCompensation, "energy-compensation", ROUGH, |s| any_dielectric(s, |d| d.roughness > SMOOTH)),
        row(Absorption, "absorption", INSIDE, |s| any_dielectric(s, absorbs)),
        row(Dispersion, "dispersion", TRACED, |s| any_dielectric(s, disperses)),
        row(Nesting, "nesting", TRACED, nests),
        row(ThinWalled, "thin-walled", INSIDE, |s| any_dielectric(s, |d| d.thin_walled)),
        row(Opaque, "opaque", TRACED, |s| surfaces(s).any(|x| matches!(x, Surface::Opaque(_)))),
        row(Textures, "textures", TRACED, |s| {
            surfaces(s).any(|x| matches!(x, Surface::Opaque(opaque) if opaque.base_color_texture.is_some()))
        }),
    ]
};

/// The surfaces that objects wear; a material that no object wears calls for nothing.
fn surfaces(scene: &Scene) -> impl Iterator<Item = &Surface> {
    scene.objects.iter().map(|object| &scene.materials[object.material]).map(|Material { surface, .. }| surface)
}

fn any_dielectric(scene: &Scene, test: impl Fn(&Dielectric) -> bool) -> bool {
    surfaces(scene).any(|surface| matches!(surface, Surface::Dielectric(dielectric) if test(dielectric)))
}

fn has_light(scene: &Scene) -> bool {
    !scene.objects.is_empty() && scene.lights.iter().any(|light| light.intensity.max_element() > 0.0)
}

/// A pane has no inside that could.
fn absorbs(dielectric: &Dielectric) -> bool {
    let colored = dielectric.attenuation_distance.is_finite() && dielectric.attenuation_color.min_element() < 1.0;
    colored && !dielectric.thin_walled
}

/// Light leaves a pane as it came, each colour in the same direction.
fn disperses(dielectric: &Dielectric) -> bool {
    dielectric.disperses() && !dielectric.thin_walled
}

/// Bounding boxes that meet may hold bodies that meet, and a camera in one may be inside the body.
fn nests(scene: &Scene) -> bool {
    let is_dielectric = |object: &&Object| matches!(scene.materials[object.material].surface, Surface::Dielectric(_));
    if scene.objects.iter().filter(is_dielectric).any(|object| scene.meshes[object.mesh].overlaps) {
        return true;
    }
    let boxes: Vec<_> = scene.objects.iter().filter(is_dielectric).map(|object| scene.bounds_of(object)).collect();
    boxes
        .iter()
        .enumerate()
        .any(|(i, a)| a.contains(scene.camera.position) || boxes[i + 1..].iter().any(|b| a.intersects(b)))
}

impl Effect {
    /// Every effect, in the order of the table.
    pub fn all() -> impl Iterator<Item = Self> {
        TABLE.iter().map(|row| row.effect)
    }

    fn row(self) -> &'static Row {
        &TABLE[self as usize]
    }

    /// The name on the command line, in stats and reports.
    pub fn name(self) -> &'static str {
        self.row().name
    }

    /// Whether `model` simulates this.
    pub fn honoured_by(self, model: Model) -> bool {
        self.row().models.contains(&model)
    }

    /// Whether `model` simulates this by something simpler: its page in docs says what.
    pub fn approximated_by(self, model: Model, scene: &Scene) -> bool {
        match (model, self) {
            (Model::Tree, Self::Opaque | Self::DirectLight | Self::Shadows) => true,
            (Model::Double, Self::Interior | Self::DirectLight) => true,
            (Model::Double, Self::Roughness) => any_dielectric(scene, |d| d.thin_walled && d.roughness > SMOOTH),
            _ => false,
        }
    }

    /// Whether something in `scene` may show this.
    pub fn called_for_by(self, scene: &Scene) -> bool {
        (self.row().called_for)(scene)
    }
}

impl FromStr for Effect {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        Self::all().find(|effect| effect.name() == name).ok_or_else(|| {
            let known: Vec<_> = Self::all().map(Self::name).collect();
            format!("unknown effect {name:?}; known: auto, all, {}", known.join(", "))
        })
    }
}

/// A set of effects.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Effects(u32);

impl Effects {
    /// Whether `effect` is in the set.
    pub fn contains(self, effect: Effect) -> bool {
        self.0 & (1 << effect as u32) != 0
    }

    /// The effects in the order of the table.
    pub fn iter(self) -> impl Iterator<Item = Effect> {
        Effect::all().filter(move |&effect| self.contains(effect))
    }

    /// The names in the order of the table.
    pub fn names(self) -> Vec<&'static str> {
        self.iter().map(Effect::name).collect()
    }
}

impl FromIterator<Effect> for Effects {
    fn from_iter<I: IntoIterator<Item = Effect>>(effects: I) -> Self {
        Self(effects.into_iter().fold(0, |bits, effect| bits | 1 << effect as u32))
    }
}

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Dispersion, Glass, Opaque, Overrides};

    fn built_in() -> Scene {
        Scene::load(None, &Overrides::default()).expect("the built-in scene")
    }

    fn selected(text: &str) -> Vec<&'static str> {
        text.parse::<Selection>().expect("a selection").resolve(&built_in()).names()
    }

    #[test]
    fn the_table_is_in_the_order_of_the_effects() {
        assert!(TABLE.iter().enumerate().all(|(i, row)| row.effect as usize == i));
    }

    #[test]
    fn shaders_number_and_name_effects_as_the_table_does() {
        let text = include_str!("../shaders/effects.glsl");
        let mut found = 0;
        for line in text.lines().filter(|line| line.starts_with("layout(constant_id")) {
            let id: usize = line.split(['=', ')']).nth(1).and_then(|id| id.trim().parse().ok()).expect("an id");
            let name = line.split_whitespace().nth(5).expect("a name");
            assert_eq!(name, TABLE[id].name.to_uppercase().replace('-', "_"), "{line}");
            found += 1;
        }
        assert_eq!(found, TABLE.iter().filter(|row| !row.models.is_empty()).count());
    }

    #[test]
    fn selections_add_and_take_away() {
        let auto = ["reflection", "transmission", "interior", "nesting"];
        assert_eq!(selected("auto"), auto);
        assert_eq!(selected("all").len(), TABLE.len());
        assert_eq!(selected("reflection, shadows"), ["reflection", "shadows"]);
        assert_eq!(selected("auto,-nesting"), auto[..3]);
        assert_eq!(selected("-nesting"), auto[..3]);
        assert_eq!(selected("all,-opaque,opaque").len(), TABLE.len());
        assert_eq!(selected("energy-compensation,reflection"), ["reflection"]);
        assert_eq!(selected("energy-compensation,roughness"), ["roughness", "energy-compensation"]);
        assert!("auto,magic".parse::<Selection>().is_err());
        assert_eq!("all,-nesting".parse::<Selection>().map(|s| s.to_string()), Ok("all,-nesting".into()));
    }

    #[test]
    fn effects_are_called_for_by_what_objects_wear() {
        let mut scene = built_in();
        let calls = |scene: &Scene| Selection::default().resolve(scene).names();
        scene.objects.truncate(1);
        assert_eq!(calls(&scene), ["reflection", "transmission", "interior"]);
        let glass = |change: fn(&mut Dielectric)| {
            let mut glass = Dielectric::default();
            change(&mut glass);
            Surface::Dielectric(glass)
        };
        for (surface, expected) in [
            (glass(|g| g.roughness = 0.02), "roughness"),
            (glass(|g| g.roughness = 0.02), "energy-compensation"),
            (glass(|g| (g.attenuation_distance, g.attenuation_color.x) = (1.0, 0.5)), "absorption"),
            (glass(|g| g.dispersion = Dispersion::Khr(0.1)), "dispersion"),
            (glass(|g| g.dispersion = Glass::named("bk7").expect("a glass").dispersion), "dispersion"),
            (glass(|g| g.thin_walled = true), "thin-walled"),
            (Surface::Opaque(Opaque::default()), "opaque"),
            (Surface::Opaque(Opaque { base_color_texture: Some(0), ..Opaque::default() }), "textures"),
        ] {
            scene.materials[0].surface = surface;
            assert!(calls(&scene).contains(&expected), "{expected}");
        }
        // A pane has no inside, and an index of 1 nothing to disperse with.
        for (surface, unexpected) in [
            (glass(|g| (g.dispersion, g.thin_walled) = (Dispersion::Khr(0.1), true)), "dispersion"),
            (glass(|g| (g.dispersion, g.ior) = (Dispersion::Khr(0.1), 1.0)), "dispersion"),
            (
                glass(|g| (g.attenuation_distance, g.attenuation_color.x, g.thin_walled) = (1.0, 0.5, true)),
                "absorption",
            ),
        ] {
            scene.materials[0].surface = surface;
            assert!(!calls(&scene).contains(&unexpected), "{unexpected}");
        }
        scene.objects.clear();
        assert!(calls(&scene).is_empty());
    }
}
