//! The frame: what is drawn on the device, pass after pass.
//!
//! In flow a scene, a plan and a device; out flows [`Rendered`]: linear radiance, display values, extra layers, times.
//! Each file is one pass; [`render`] is the list of them.

mod accumulate;
mod aov;
mod display;
mod environment;
mod resources;
mod sampling;
mod single;
mod view;

use std::time::{Duration, Instant};

use crate::gpu::{Commands, Format, Gpu, GpuError, Image, ImageDesc, PassTime, Recorder, Result, SamplePush, Use};
use crate::options::Size;
use crate::plan::{Budget, Plan};
use crate::scene::Scene;

use accumulate::Accumulate;
use aov::AovPass;
use display::Display;
use environment::EnvironmentPass;
use resources::Resources;
use single::Single;

pub use aov::Aovs;

/// Radiance in flight, and sums of it.
const RADIANCE: Format = Format::R32G32B32A32_SFLOAT;

/// A finished picture and what it took.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// Mean radiance of each pixel, linear Rec. 709, row 0 at the top.
    pub radiance: Vec<[f32; 3]>,
    /// The same as a screen shows it: sRGB, 8 bits a channel.
    pub display: Vec<[u8; 4]>,
    /// What lies at the centres of the pixels, if it was asked for.
    pub aovs: Option<Aovs>,
    /// Samples per pixel.
    pub samples: u32,
    /// Device time of each pass, over all samples.
    pub passes: Vec<PassTime>,
    /// Host time until the scene was on the device.
    pub upload: Duration,
    /// Host time until every pipeline had run once: drivers compile at the first use.
    pub pipelines: Duration,
}

/// Renders `scene` as `plan` says. `progress` hears how many samples are done, of how many.
pub fn render(gpu: &Gpu, scene: &Scene, plan: &Plan, progress: &mut dyn FnMut(u32, u32)) -> Result<Rendered> {
    let start = Instant::now();
    let limit = gpu.max_image_side();
    if plan.size.width.max(plan.size.height) > limit {
        return Err(GpuError::TooLarge {
            what: "--size".into(),
            size: plan.size.to_string(),
            limit: format!("{limit} a side"),
            advice: "use a smaller --size",
        });
    }
    let mut commands = Commands::new(gpu)?;
    let resources = Resources::new(&mut commands, scene, plan)?;
    let upload = start.elapsed();

    let passes = Passes::new(&mut commands, &resources, plan)?;
    let pipelines = start.elapsed() - upload;

    let targets = Targets::new(gpu, plan.size)?;
    let mut times = Times::default();
    let mut samples = 0;
    for offset in sampling::pixel_offsets(plan.budget, plan.seed) {
        let push = view::sample_push(plan.size, offset);
        times.add(commands.run(|cmd| passes.sample(cmd, &resources, &targets, push, samples))?);
        samples += 1;
        progress(samples, plan.budget.most());
        if is_spent(plan.budget, start.elapsed(), samples) {
            break;
        }
    }

    let (display, time) = passes.display.run(&mut commands, &targets, plan, samples)?;
    times.add(time);
    let radiance = mean(&commands.read_image(&targets.total)?, samples);
    let aovs = match plan.aovs.is_empty() {
        true => None,
        false => {
            let (aovs, time) = AovPass::new(gpu, &resources)?.run(&mut commands, &resources, plan.size)?;
            times.add(time);
            Some(aovs)
        }
    };
    Ok(Rendered { radiance, display, aovs, samples, passes: times.0, upload, pipelines })
}

/// The passes of a sample, in their order, and the one that ends the frame.
struct Passes {
    single: Single,
    environment: EnvironmentPass,
    accumulate: Accumulate,
    display: Display,
}

impl Passes {
    /// Makes every pipeline and runs each once on a few pixels, so that no time of a pass holds its compilation.
    fn new(commands: &mut Commands, resources: &Resources, plan: &Plan) -> Result<Self> {
        let gpu = commands.gpu().clone();
        let small = Size { width: 16, height: 16 };
        let targets = Targets::new(&gpu, small)?;
        let passes = Self {
            single: Single::new(&gpu, resources)?,
            environment: EnvironmentPass::new(&gpu, resources)?,
            accumulate: Accumulate::new(&gpu, &targets)?,
            display: Display::new(&gpu, &targets)?,
        };
        commands.run(|cmd| passes.sample(cmd, &resources.few(), &targets, SamplePush::default(), 0))?;
        passes.display.run(commands, &targets, plan, 1)?;
        Ok(passes)
    }

    fn sample(&self, cmd: &mut Recorder<'_>, resources: &Resources, targets: &Targets, push: SamplePush, index: u32) {
        cmd.timed("single", |cmd| self.single.record(cmd, resources, targets, push));
        cmd.timed("environment", |cmd| self.environment.record(cmd, resources, targets, push));
        cmd.timed("accumulate", |cmd| self.accumulate.record(cmd, targets, index));
    }
}

/// Images of the picture's size.
struct Targets {
    radiance: Image,
    depth: Image,
    total: Image,
    accumulate: crate::gpu::BindGroup,
    display: crate::gpu::BindGroup,
}

impl Targets {
    fn new(gpu: &Gpu, Size { width, height }: Size) -> Result<Self> {
        let image = |name, format, uses| Image::new(gpu, &ImageDesc { name, width, height, format, uses });
        let radiance = image("radiance", RADIANCE, &[Use::ColorTarget, Use::Sampled])?;
        let depth = image("depth", Format::D32_SFLOAT, &[Use::DepthTarget])?;
        let total = image("total", RADIANCE, &[Use::Storage, Use::Sampled, Use::CopySource])?;
        let accumulate = accumulate::group(gpu, &radiance, &total)?;
        let display = display::group(gpu, &total)?;
        Ok(Self { radiance, depth, total, accumulate, display })
    }
}

/// Device times, summed by the name of the pass.
#[derive(Default)]
struct Times(Vec<PassTime>);

impl Times {
    fn add(&mut self, times: Vec<PassTime>) {
        for time in times {
            match self.0.iter_mut().find(|sum| sum.name == time.name) {
                Some(sum) => sum.gpu_ms = sum.gpu_ms.zip(time.gpu_ms).map(|(a, b)| a + b),
                None => self.0.push(time),
            }
        }
    }
}

/// Whether another sample like those before would end after the time.
fn is_spent(budget: Budget, elapsed: Duration, samples: u32) -> bool {
    match budget {
        Budget::Samples(_) => false,
        Budget::Seconds { seconds, .. } => elapsed.as_secs_f64() * (1.0 + 1.0 / f64::from(samples)) > seconds,
    }
}

fn mean(total: &[u8], samples: u32) -> Vec<[f32; 3]> {
    let scale = 1.0 / f64::from(samples);
    let value = |sum: f32| (f64::from(sum) * scale) as f32;
    total
        .chunks_exact(16)
        .map(|texel| {
            let [r, g, b, _]: [f32; 4] = bytemuck::pod_read_unaligned(texel);
            [value(r), value(g), value(b)]
        })
        .collect()
}
