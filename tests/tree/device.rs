//! The model on a device: pictures under validation, and how tests compare them.

use std::io::Write;

use glam::DVec3;

use vitrum::options::{Model, RenderArgs, Size, Trace};
use vitrum::passes::render;
use vitrum::plan::Plan;
use vitrum::scene::Scene;

use crate::common::Validated;

/// How a picture is taken: by default one sample a pixel, and so deep that little is lost.
#[derive(Clone, Copy, Debug)]
pub struct Shot {
    pub size: Size,
    pub samples: u32,
    pub depth: u32,
    pub cutoff: f64,
    pub effects: &'static str,
    pub trace: Option<Trace>,
    /// Whether look-ups are as wide as the pixel.
    pub footprints: bool,
}

impl Default for Shot {
    fn default() -> Self {
        Self {
            size: Size { width: 96, height: 72 },
            samples: 1,
            depth: 32,
            cutoff: 1e-5,
            effects: "auto",
            trace: None,
            footprints: false,
        }
    }
}

/// Of each pixel, row by row from the top.
#[derive(Clone, Debug)]
pub struct Picture {
    pub radiance: Vec<DVec3>,
    pub discarded: Vec<f64>,
    pub interfaces: Vec<f64>,
}

/// A device under validation. [`Device::verdict`] ends every test.
pub struct Device(Validated);

impl Device {
    pub fn open() -> Option<Self> {
        Validated::open().map(Self)
    }

    pub fn verdict(self) {
        self.0.verdict();
    }

    /// The ways of tracing that it has; says so where it has no ray queries.
    pub fn tracers(&self) -> Vec<Trace> {
        let info = self.0.gpu.info();
        if info.ray_query {
            return vec![Trace::Software, Trace::Hardware];
        }
        // Past the test runner, which keeps the words of tests that pass to itself.
        let _ = writeln!(std::io::stderr(), "skipped: {} has no ray queries", info.name);
        vec![Trace::Software]
    }

    /// The picture of a shot. No value of it may be anything but finite and not negative.
    pub fn picture(&self, scene: &Scene, shot: Shot) -> Picture {
        let effects = Some(shot.effects.parse().expect("a selection"));
        let args = RenderArgs {
            samples: Some(shot.samples),
            max_depth: Some(shot.depth),
            trace: shot.trace,
            effects,
            ..sized(shot.size)
        };
        let plan = Plan::new(scene, &args).expect("a plan");
        self.planned(scene, &Plan { cutoff: shot.cutoff, footprints: shot.footprints, ..plan })
    }

    /// The picture with a tolerance, and whatever depth comes with that.
    pub fn within(&self, scene: &Scene, size: Size, tolerance: f64) -> Picture {
        let args = RenderArgs { tolerance: Some(tolerance), ..sized(size) };
        self.planned(scene, &Plan::new(scene, &args).expect("a plan"))
    }

    fn planned(&self, scene: &Scene, plan: &Plan) -> Picture {
        let rendered = render(&self.0.gpu, scene, plan, &mut |_| {}).expect("a picture");
        let counts = rendered.counts.expect("counts");
        let discarded = counts.discarded.expect("what was cut off");
        let all = rendered.radiance.iter().flatten().chain(&discarded).chain(&counts.interfaces);
        let bad = all.filter(|value| !(value.is_finite() && **value >= 0.0)).count();
        assert_eq!(bad, 0, "{}: values that are not finite or below 0", scene.name);
        let wide = |values: Vec<f32>| values.into_iter().map(f64::from).collect();
        Picture {
            radiance: rendered.radiance.into_iter().map(|pixel| DVec3::from_array(pixel.map(f64::from))).collect(),
            discarded: wide(discarded),
            interfaces: wide(counts.interfaces),
        }
    }
}

fn sized(size: Size) -> RenderArgs {
    RenderArgs { model: Some(Model::Tree.into()), size: Some(size), samples: Some(1), ..RenderArgs::default() }
}

impl Picture {
    /// The largest throughput that a pixel cut off.
    pub fn most_discarded(&self) -> f64 {
        self.discarded.iter().copied().fold(0.0, f64::max)
    }

    /// Of each pixel how far the farthest channel is from the same of another picture.
    pub fn differences<'a>(&'a self, other: &'a Self) -> impl Iterator<Item = f64> + 'a {
        self.radiance.iter().zip(&other.radiance).map(|(a, b)| (a - b).abs().max_element())
    }

    pub fn largest_difference(&self, other: &Self) -> f64 {
        self.differences(other).fold(0.0, f64::max)
    }

    /// Pixels that differ by more than `tolerance`.
    pub fn differing(&self, other: &Self, tolerance: f64) -> usize {
        self.differences(other).filter(|&difference| difference > tolerance).count()
    }

    /// The root of the mean squared difference.
    pub fn rmse(&self, other: &Self) -> f64 {
        let pairs = self.radiance.iter().zip(&other.radiance);
        let sum: f64 = pairs.map(|(a, b)| a.distance_squared(*b) / 3.0).sum();
        (sum / self.radiance.len() as f64).sqrt()
    }
}
