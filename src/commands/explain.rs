//! `vitrum explain`: which effects a scene calls for, which it does not, and what each model makes of them.

use std::path::PathBuf;

use clap::Args;

use super::{Changes, print};
use crate::Result;
use crate::effects::Selection;
use crate::options::RenderArgs;
use crate::report::Explanation;
use crate::scene::Scene;

/// Options of `vitrum explain`.
#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub(super) struct ExplainCommand {
    /// A .toml scene, or a bare .obj shown as clear glass; none: the built-in teapot and cups
    scene: Option<PathBuf>,

    /// JSON instead of text
    #[arg(long)]
    json: bool,

    /// Effects that are wanted, as for render [default: auto]
    #[arg(long, value_name = "LIST", allow_hyphen_values = true)]
    effects: Option<Selection>,

    #[command(flatten)]
    changes: Changes,
}

impl ExplainCommand {
    pub(super) fn run(self) -> Result<()> {
        let scene = Scene::load(self.scene.as_deref(), &self.changes.overrides())?;
        let options = RenderArgs { effects: self.effects, ..RenderArgs::default() }.or(scene.render.clone());
        let explanation = Explanation::new(&scene, &options)?;
        print(&if self.json { explanation.json() } else { explanation.to_string() })
    }
}
