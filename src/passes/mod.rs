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

use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::gpu::{
    Bind, BindGroup, Commands, Format, Gpu, GpuError, Image, ImageDesc, PassTime, Recorder, Result, SamplePush, Use,
};
use crate::options::Size;
use crate::plan::{Budget, Plan};
use crate::scene::Scene;

use accumulate::Accumulate;
use aov::AovPass;
use display::Display;
use environment::EnvironmentPass;
use resources::{Draw, Resources};
use single::Single;

pub use aov::Aovs;
pub use sampling::pixel_offsets;

/// Radiance in flight, and means of it.
const RADIANCE: Format = Format::Rgba32Float;

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

/// Whether `gpu` can do what `plan` says.
pub fn check(gpu: &Gpu, plan: &Plan) -> Result<()> {
    let limit = gpu.max_image_side();
    if plan.size.width.max(plan.size.height) > limit {
        return Err(GpuError::TooLarge {
            what: "--size".into(),
            size: plan.size.to_string(),
            limit: format!("{limit} a side"),
            advice: "use a smaller --size",
        });
    }
    Ok(())
}

/// Renders `scene` as `plan` says. `progress` hears how many samples are done.
pub fn render(gpu: &Gpu, scene: &Scene, plan: &Plan, progress: &mut dyn FnMut(u32)) -> Result<Rendered> {
    let start = Instant::now();
    check(gpu, plan)?;
    let mut commands = Commands::new(gpu)?;
    let resources = Resources::new(&mut commands, scene, plan)?;
    let upload = start.elapsed();

    let passes = Passes::new(&mut commands, &resources, plan)?;
    let set_up = start.elapsed();

    let targets = Targets::new(gpu, plan.size)?;
    let mut times = Times::default();
    let mut samples = 0;
    for offset in sampling::pixel_offsets(plan.budget, plan.seed) {
        let push = view::sample_push(plan.size, offset, samples);
        times.add(commands.run(|cmd| passes.sample(cmd, &resources, &targets, &resources.draws, push))?);
        samples += 1;
        progress(samples);
        if is_spent(plan.budget, set_up, start.elapsed(), samples) {
            break;
        }
    }

    let (display, time) = passes.display.run(&mut commands, &targets, plan)?;
    times.add(time);
    let radiance = radiance(&commands.read_image(&targets.mean)?)?;
    let mut aovs = None;
    if let Some(pass) = &passes.aov {
        let (values, time) = pass.run(&mut commands, &resources, &resources.draws, plan.size)?;
        times.add(time);
        aovs = Some(values);
    }
    Ok(Rendered { radiance, display, aovs, samples, passes: times.0, upload, pipelines: set_up - upload })
}

/// The passes of a sample, in their order, and those that end the frame.
struct Passes {
    single: Single,
    environment: EnvironmentPass,
    accumulate: Accumulate,
    display: Display,
    aov: Option<AovPass>,
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
            aov: if plan.aovs.is_empty() { None } else { Some(AovPass::new(&gpu, resources)?) },
        };
        let few: Vec<_> =
            resources.draws.iter().take(1).map(|draw| Draw { vertices: draw.vertices.min(3), ..*draw }).collect();
        commands.run(|cmd| passes.sample(cmd, resources, &targets, &few, SamplePush::default()))?;
        passes.display.run(commands, &targets, plan)?;
        if let Some(aov) = &passes.aov {
            aov.run(commands, resources, &few, small)?;
        }
        Ok(passes)
    }

    fn sample<'r>(
        &'r self,
        cmd: &mut Recorder<'_, 'r>,
        resources: &'r Resources,
        targets: &'r Targets,
        draws: &[Draw],
        push: SamplePush,
    ) {
        cmd.timed("single", |cmd| self.single.record(cmd, resources, targets, draws, push));
        cmd.timed("environment", |cmd| self.environment.record(cmd, resources, targets, push));
        cmd.timed("accumulate", |cmd| self.accumulate.record(cmd, targets, push.sample_index));
    }
}

/// Images of the picture's size, and the groups that hold them.
struct Targets {
    accumulation: BindGroup,
    display: BindGroup,
    radiance: Arc<Image>,
    mean: Arc<Image>,
    depth: Image,
}

impl Targets {
    fn new(gpu: &Gpu, Size { width, height }: Size) -> Result<Self> {
        let image = |name, format, uses| Image::new(gpu, &ImageDesc { name, width, height, format, uses });
        let radiance = Arc::new(image("radiance", RADIANCE, &[Use::ColorTarget, Use::Sampled])?);
        let mean = Arc::new(image("mean", RADIANCE, &[Use::Storage, Use::Sampled, Use::CopySource])?);
        let depth = image("depth", Format::Depth32, &[Use::DepthTarget])?;
        let accumulation = vec![Bind::Sampled(radiance.clone()), Bind::Storage(mean.clone())];
        Ok(Self {
            accumulation: BindGroup::new(gpu, "accumulation", accumulation)?,
            display: BindGroup::new(gpu, "display", vec![Bind::Sampled(mean.clone())])?,
            radiance,
            mean,
            depth,
        })
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
fn is_spent(budget: Budget, set_up: Duration, elapsed: Duration, samples: u32) -> bool {
    match budget {
        Budget::Samples(_) => false,
        Budget::Seconds { seconds, .. } => {
            let sampling = elapsed.saturating_sub(set_up);
            (elapsed + sampling / samples).as_secs_f64() > seconds
        }
    }
}

/// The colours of an image of [`RADIANCE`].
fn radiance(texels: &[u8]) -> Result<Vec<[f32; 3]>> {
    let mut radiance = Vec::new();
    radiance.try_reserve_exact(texels.len() / 16).map_err(|_| GpuError::OutOfMemory {
        what: "the image on the host".into(),
        state: "the system has no more".into(),
    })?;
    radiance.extend(texels.chunks_exact(16).map(|texel| {
        let [r, g, b, _]: [f32; 4] = bytemuck::pod_read_unaligned(texel);
        [r, g, b]
    }));
    Ok(radiance)
}
