//! The models and settings that are tried.

use crate::options::{Model, RenderArgs};

/// A model with what is asked of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    /// The model.
    pub model: Model,
    /// Samples per pixel.
    pub samples: u32,
    /// Longest chain of interfaces, where it is not the default.
    pub max_depth: Option<u32>,
    /// Throughput that a pixel of `tree` may lose, where it is not the default.
    pub tolerance: Option<f64>,
}

impl Setting {
    /// So many samples with the defaults of `model`.
    pub fn of(model: Model, samples: u32) -> Self {
        Self { model, samples, max_depth: None, tolerance: None }
    }

    /// `options` with this.
    pub fn on(&self, options: &RenderArgs) -> RenderArgs {
        RenderArgs {
            model: Some(self.model.into()),
            samples: Some(self.samples),
            max_depth: self.max_depth,
            tolerance: self.tolerance,
            ..options.clone()
        }
    }

    /// The options that ask for it.
    pub fn options(&self) -> String {
        let mut text = format!("--model {} --samples {}", self.model.name(), self.samples);
        if let Some(depth) = self.max_depth {
            text += &format!(" --max-depth {depth}");
        }
        if let Some(tolerance) = self.tolerance {
            text += &format!(" --tolerance {tolerance}");
        }
        text
    }

    /// The same for a person: `tree, 4 samples, depth 8`.
    pub fn label(&self) -> String {
        let many = if self.samples == 1 { "" } else { "s" };
        let mut text = format!("{}, {} sample{many}", self.model.name(), self.samples);
        if let Some(depth) = self.max_depth {
            text += &format!(", depth {depth}");
        }
        if let Some(tolerance) = self.tolerance {
            text += &format!(", tolerance {tolerance}");
        }
        text
    }
}

/// Those that are tried, the cheap ones of a model first, against a reference whose chains are of up to `depth` interfaces.
pub fn settings(depth: u32) -> Vec<Setting> {
    let rows: [(Model, &[u32]); 4] = [
        (Model::Single, &[1, 4, 16]),
        (Model::Double, &[1, 4, 16]),
        (Model::Tree, &[1, 4, 16, 64]),
        (Model::Path, &[1, 4, 16]),
    ];
    let mut all: Vec<_> =
        rows.iter().flat_map(|&(model, counts)| counts.iter().map(move |&n| Setting::of(model, n))).collect();
    // As long chains as the reference follows: more samples are all that it takes from there.
    let deep = |samples| Setting { max_depth: Some(depth), ..Setting::of(Model::Path, samples) };
    all.extend([4, 16, 64].map(deep));
    let tree = Setting::of(Model::Tree, 4);
    all.extend([4, 8].map(|depth| Setting { max_depth: Some(depth), ..tree.clone() }));
    let close = |tolerance| Setting { max_depth: Some(depth), tolerance: Some(tolerance), ..tree.clone() };
    all.extend([1e-1, 1e-2].map(close));
    all
}

/// Samples per pixel of the frames that tell what an effect costs.
pub fn samples_of_effects(model: Model) -> u32 {
    if model == Model::Path { 16 } else { 4 }
}
