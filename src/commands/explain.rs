//! `vitrum explain`: which effects a scene calls for, which it does not, and what each model makes of them.

use std::path::PathBuf;

use clap::Args;

use super::{Changes, print};
use crate::Result;
use crate::choice::choose;
use crate::effects::Selection;
use crate::gpu::{Gpu, Instance};
use crate::options::{ModelChoice, RenderArgs, Size, Trace, range};
use crate::plan::Plan;
use crate::report::Explanation;
use crate::scene::Scene;

/// The heading of the options of a plan.
const PLAN: &str = "What `render --model auto` would do";

/// Options of `vitrum explain`.
#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub(super) struct ExplainCommand {
    /// A .toml scene, a .glb or .gltf, or a bare .obj shown as clear glass; none: the built-in teapot and cups
    scene: Option<PathBuf>,

    /// JSON instead of text
    #[arg(long)]
    json: bool,

    /// Effects that are wanted, as for render [default: auto]
    #[arg(long, value_name = "LIST", allow_hyphen_values = true)]
    effects: Option<Selection>,

    #[command(flatten)]
    changes: Changes,

    /// Plans a render whose 95 % of the pixels are within X, on a device
    #[arg(long, value_name = "X", value_parser = range::positive, help_heading = PLAN)]
    tolerance: Option<f64>,

    /// Plans the best render within that time, on a device
    #[arg(long, value_name = "SECONDS", value_parser = range::positive, help_heading = PLAN)]
    time_budget: Option<f64>,

    /// Size of the render that is planned [default: 1024x768]
    #[arg(long, value_name = "WxH", help_heading = PLAN)]
    size: Option<Size>,

    /// Vulkan device that is planned for: part of its name, or its index [default: the best one]
    #[arg(long, value_name = "NAME|INDEX", env = "VITRUM_DEVICE", help_heading = PLAN)]
    device: Option<String>,

    /// How rays would be traced [default: hardware on a GPU with ray queries, else software]
    #[arg(long, value_name = "HOW", help_heading = PLAN)]
    trace: Option<Trace>,
}

impl ExplainCommand {
    pub(super) fn run(self) -> Result<()> {
        let mut scene = Scene::load(self.scene.as_deref(), &self.changes.overrides())?;
        let given = RenderArgs {
            effects: self.effects.clone(),
            size: self.size,
            tolerance: self.tolerance,
            time_budget: self.time_budget,
            device: self.device.clone(),
            trace: self.trace,
            ..RenderArgs::default()
        };
        let options = given.or(scene.render.clone());
        let mut explanation = Explanation::new(&scene, &options)?;
        let asked = self.tolerance.is_some() || self.time_budget.is_some();
        if asked || options.model == Some(ModelChoice::Auto) {
            let size = options.size.unwrap_or(Plan::SIZE);
            scene.frame(f64::from(size.width) / f64::from(size.height));
            let instance = Instance::new(/* validation: */ false)?;
            let gpu = Gpu::open(&instance, instance.choose(options.device.as_deref())?)?;
            let choice = choose(&gpu, &scene, &options)?;
            explanation = explanation.with_plan(&gpu.info().name, size, &choice);
        }
        print(&if self.json { explanation.json() } else { explanation.to_string() })
    }
}
