//! Pictures of the model `path`, and statistics of how far two are apart.

use glam::DVec3;

use vitrum::options::{Model, RenderArgs, Size, Trace};
use vitrum::passes::render;
use vitrum::plan::{Estimator, Plan};
use vitrum::scene::Scene;

use crate::common::Validated;

pub const SIZE: Size = Size { width: 48, height: 36 };

/// How a picture is taken.
#[derive(Clone, Copy, Debug)]
pub struct Shot {
    pub size: Size,
    pub samples: u32,
    pub depth: u32,
    pub seed: u64,
    pub estimator: Estimator,
    pub effects: &'static str,
    pub trace: Option<Trace>,
}

impl Default for Shot {
    fn default() -> Self {
        Self { size: SIZE, samples: 256, depth: 32, seed: 0, estimator: Estimator::Both, effects: "auto", trace: None }
    }
}

/// Of each pixel, row by row from the top.
#[derive(Clone, Debug)]
pub struct Picture {
    pub radiance: Vec<DVec3>,
    pub stderr: Vec<DVec3>,
    pub interfaces: Vec<f64>,
    pub discarded: Vec<f64>,
}

fn wide(pixels: &[[f32; 3]]) -> Vec<DVec3> {
    pixels.iter().map(|pixel| DVec3::from_array(pixel.map(f64::from))).collect()
}

pub fn picture(validated: &Validated, scene: &Scene, shot: Shot) -> Picture {
    let args = RenderArgs {
        model: Some(Model::Path.into()),
        size: Some(shot.size),
        samples: Some(shot.samples),
        max_depth: Some(shot.depth),
        seed: Some(shot.seed),
        effects: Some(shot.effects.parse().expect("a selection")),
        trace: shot.trace,
        ..RenderArgs::default()
    };
    let plan = Plan { estimator: shot.estimator, ..Plan::new(scene, &args).expect("a plan") };
    let rendered = render(&validated.gpu, scene, &plan, &mut |_| {}).expect("a picture");
    let counts = rendered.counts.expect("counts");
    let stderr = wide(&counts.stderr.expect("standard errors"));
    let radiance = wide(&rendered.radiance);
    assert!(
        radiance.iter().chain(&stderr).all(|value| value.is_finite()),
        "{}: values that are not finite",
        scene.name
    );
    let narrow = |values: Vec<f32>| values.into_iter().map(f64::from).collect();
    let discarded = counts.discarded.expect("what was cut off");
    Picture { radiance, stderr, interfaces: narrow(counts.interfaces), discarded: narrow(discarded) }
}

/// The same of the model `tree`, its throughput followed down to next to nothing.
pub fn tree(validated: &Validated, scene: &Scene, seed: u64, samples: u32, depth: u32) -> Vec<DVec3> {
    let args = RenderArgs {
        model: Some(Model::Tree.into()),
        size: Some(SIZE),
        samples: Some(samples),
        max_depth: Some(depth),
        seed: Some(seed),
        ..RenderArgs::default()
    };
    let plan = Plan { cutoff: 1e-4, footprints: false, ..Plan::new(scene, &args).expect("a plan") };
    wide(&render(&validated.gpu, scene, &plan, &mut |_| {}).expect("a picture").radiance)
}

impl Picture {
    pub fn mean(&self) -> DVec3 {
        self.radiance.iter().sum::<DVec3>() / self.radiance.len() as f64
    }

    /// The standard error of the mean of the whole picture.
    pub fn error_of_mean(&self) -> DVec3 {
        let sum: DVec3 = self.stderr.iter().map(|error| error * error).sum();
        sum.powf(0.5) / self.stderr.len() as f64
    }

    /// The mean over pixels and channels of the square of the standard error.
    pub fn variance(&self) -> f64 {
        self.stderr.iter().map(|error| error.length_squared()).sum::<f64>() / (3 * self.stderr.len()) as f64
    }
}
