//! Pictures of one scene after the other. In flow scenes and plans, out flow whole renders, or a picture that grows, can be left and
//! taken up again.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use super::checkpoint::{self, Checkpoint};
use super::display::DISPLAY;
use super::resources::Resources;
use super::sampling::{self, Round};
use super::slices::Place;
use super::{Counts, Job, Passes, Rendered, Sampled, Targets, Times, check, is_precise, is_spent, radiance, trace_of};
use crate::gpu::{Commands, Gpu, Image, ImageDesc, PassTime, Result, SamplePush, Specialization, Use};
use crate::options::{Model, Size, Tonemap, Trace};
use crate::plan::{Budget, Plan};
use crate::scene::Scene;

/// A scene on a device and the passes of a model, ready to be rendered any number of times.
pub struct Renderer {
    commands: Commands,
    resources: Resources,
    passes: Passes,
    /// Those of other models and effects, the last ones last: what was compiled once need not be again.
    others: Vec<(Kind, Passes)>,
    kind: Kind,
    upload: Duration,
    set_up: Duration,
}

/// What passes are compiled for.
#[derive(Clone, PartialEq)]
struct Kind {
    model: Model,
    trace: Option<Trace>,
    specialization: Specialization,
    opaque: bool,
    aovs: bool,
}

impl Kind {
    fn new(plan: &Plan, trace: Option<Trace>, resources: &Resources) -> Self {
        Self {
            model: plan.model,
            trace,
            specialization: resources.specialization.clone(),
            opaque: resources.opaque,
            aovs: plan.aovs.iter().any(|aov| aov.is_of_surfaces()),
        }
    }
}

/// Passes that are kept beside those in use.
const MOST_OTHERS: usize = 12;

impl Renderer {
    /// Puts `scene` on the device and makes the passes that `plan` asks for.
    pub fn new(gpu: &Gpu, scene: &Scene, plan: &Plan) -> crate::Result<Self> {
        let start = Instant::now();
        check(gpu, plan)?;
        let mut commands = Commands::new(gpu)?;
        let trace = trace_of(gpu, plan)?;
        let resources = Resources::new(&mut commands, scene, plan, trace, None)?;
        let upload = start.elapsed();
        let passes = Passes::new(&mut commands, &resources, plan, trace)?;
        let kind = Kind::new(plan, trace, &resources);
        Ok(Self { commands, resources, passes, others: Vec::new(), kind, upload, set_up: start.elapsed() })
    }

    /// From now on nothing is submitted while `interrupt` is set; what is under way ends with
    /// [`GpuError::Interrupted`](crate::gpu::GpuError::Interrupted).
    pub fn interrupt_by(&mut self, interrupt: Arc<AtomicBool>) {
        self.commands.interrupt_by(interrupt);
    }

    /// Another scene or plan. Passes stay where they are the same.
    pub fn change(&mut self, scene: &Scene, plan: &Plan) -> crate::Result<()> {
        let gpu = self.commands.gpu().clone();
        check(&gpu, plan)?;
        let trace = trace_of(&gpu, plan)?;
        let resources = Resources::new(&mut self.commands, scene, plan, trace, Some(&self.resources))?;
        let kind = Kind::new(plan, trace, &resources);
        if kind != self.kind {
            let passes = match self.others.iter().position(|(other, _)| *other == kind) {
                Some(place) => self.others.remove(place).1,
                None => Passes::new(&mut self.commands, &resources, plan, trace)?,
            };
            let before = std::mem::replace(&mut self.kind, kind);
            self.others.push((before, std::mem::replace(&mut self.passes, passes)));
            if self.others.len() > MOST_OTHERS {
                self.others.remove(0);
            }
        }
        self.resources = resources;
        Ok(())
    }

    /// Begins a picture that grows round by round; the plan is that of the last change.
    pub fn begin(&self, plan: &Plan) -> crate::Result<Refinement> {
        Ok(Refinement {
            targets: Targets::new(self.commands.gpu(), plan, &self.resources)?,
            rounds: sampling::rounds(plan),
            under_way: None,
            start: Instant::now(),
            plan: plan.clone(),
            done: 0,
            samples: 0,
            is_enough: false,
            times: Times::default(),
        })
    }

    /// Goes on with the picture until all its pixels have as many samples, or, of models that trace, until `goes_on` is false.
    pub fn advance(&mut self, picture: &mut Refinement, goes_on: &mut dyn FnMut() -> bool) -> crate::Result<Step> {
        if picture.is_enough {
            return Ok(Step::Whole);
        }
        let next = |rounds: &mut dyn Iterator<Item = Round>| Some((rounds.next()?, Place::default()));
        let Some((round, begun)) = picture.under_way.take().or_else(|| next(&mut picture.rounds)) else {
            picture.is_enough = true;
            return Ok(Step::Whole);
        };
        let (commands, resources, targets) = (&mut self.commands, &self.resources, &picture.targets);
        let height = targets.mean.height();
        let mut place = if picture.plan.model.traces() { begun } else { Place { row: height, column: 0 } };
        let mut after = |_: &mut Commands, done: Place| {
            place = done;
            Ok(if done.row < height && !goes_on() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) })
        };
        let push = SamplePush { first_row: begun.row, first_column: begun.column, ..round.push };
        let times = self.passes.sample(commands, resources, targets, &resources.draws, push, &mut after)?;
        picture.times.add(times);
        if place.row < height {
            picture.under_way = Some((round, place));
            return Ok(Step::Paused);
        }
        picture.samples += round.samples;
        picture.done += 1;
        let (plan, done) = (&picture.plan, picture.done);
        let all = plan.budget == Budget::Samples(picture.samples);
        picture.is_enough = all
            || is_spent(plan.budget, Duration::ZERO, picture.start.elapsed(), done)
            || is_precise(commands, targets, plan, done)?;
        Ok(Step::Round)
    }

    /// From now on work is submitted in pieces of about that time, where it can be cut.
    pub fn set_patience(&mut self, patience: Duration) {
        self.commands.set_patience(patience);
    }

    /// What the model counted so far, if it does.
    pub fn counts(&mut self, picture: &Refinement) -> crate::Result<Option<Counts>> {
        let mean = self.commands.read_image(&picture.targets.mean)?;
        Ok(picture.targets.counts(&mut self.commands, &mean, picture.samples)?)
    }

    /// An image of these sRGB values, row 0 at the top, ready to be copied as that of [`display`](Self::display).
    pub fn image_of(&mut self, Size { width, height }: Size, pixels: &[[u8; 4]]) -> crate::Result<Image> {
        let uses = &[Use::CopyTarget, Use::CopySource];
        let desc = ImageDesc { name: "pixels", width, height, format: DISPLAY, uses };
        let texels: Vec<u8> = pixels.iter().flat_map(|&[r, g, b, a]| [b, g, r, a]).collect();
        let image = self.commands.upload_image(&desc, &texels)?;
        self.commands.run(|cmd| cmd.use_image(&image, Use::CopySource))?;
        Ok(image)
    }

    /// Mean radiance of each pixel, after a round at least.
    pub fn radiance(&mut self, picture: &Refinement) -> crate::Result<Vec<[f32; 3]>> {
        Ok(radiance(&self.commands.read_image(&picture.targets.mean)?)?)
    }

    /// What a screen shows of the picture, after a round at least: sRGB values, ready to be copied.
    pub fn display(&mut self, picture: &mut Refinement) -> crate::Result<Image> {
        let (image, times) = self.passes.display.run(&mut self.commands, &picture.targets, &picture.plan)?;
        picture.times.add(times);
        Ok(image)
    }

    /// The next render goes by `plan`, which differs from the one before in samples, seed, depth, cut-off and tolerance alone.
    pub fn set_limits(&mut self, plan: &Plan) -> Result<()> {
        self.resources.set_limits(&mut self.commands, plan)
    }

    /// Renders, as the plan says that this was made for, or that was set since. `progress` hears how many samples are done.
    pub fn render(&mut self, plan: &Plan, progress: &mut dyn FnMut(u32)) -> crate::Result<Rendered> {
        let start = Instant::now();
        let Self { commands, resources, passes, kind, .. } = self;
        let (trace, set_up) = (kind.trace, self.set_up);
        let gpu = commands.gpu().clone();
        let targets = Targets::new(&gpu, plan, resources)?;
        let checkpoint = match &plan.checkpoint {
            Some(path) => Some(Checkpoint::new(path, checkpoint::key(&gpu, plan, trace, resources.fingerprint))?),
            None => None,
        };
        let is_spent = |rounds| is_spent(plan.budget, set_up, set_up + start.elapsed(), rounds);
        let job = Job { plan, resources, targets: &targets, is_spent: &is_spent };
        let Sampled { mut times, samples, resumed, warnings } =
            passes.all_samples(commands, &job, checkpoint, progress)?;

        let (display, time) = passes.display.run(commands, &targets, plan)?;
        times.add(time);
        let mut display: Vec<[u8; 4]> = bytemuck::allocation::pod_collect_to_vec(&commands.read_image(&display)?);
        display.iter_mut().for_each(|pixel| pixel.swap(0, 2));
        let mean = commands.read_image(&targets.mean)?;
        let radiance = radiance(&mean)?;
        let counts = targets.counts(commands, &mean, samples)?;
        let mut aovs = None;
        if let Some(pass) = &passes.aov {
            let (values, time) = pass.run(commands, resources, &resources.draws, plan.size)?;
            times.add(time);
            aovs = Some(values);
        }
        Ok(Rendered {
            radiance,
            display,
            aovs,
            counts,
            trace,
            samples,
            passes: times.0,
            upload: self.upload,
            acceleration: self.resources.acceleration,
            pipelines: set_up - self.upload,
            resumed,
            warnings,
        })
    }
}

/// A picture that grows.
pub struct Refinement {
    plan: Plan,
    targets: Targets,
    rounds: Box<dyn Iterator<Item = Round> + Send>,
    /// The round that was left, and how far it is.
    under_way: Option<(Round, Place)>,
    start: Instant,
    /// Rounds so far.
    done: u32,
    samples: u32,
    is_enough: bool,
    times: Times,
}

/// How far [`Renderer::advance`] came.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// In the middle of a round.
    Paused,
    /// All pixels have as many samples.
    Round,
    /// There was nothing left to do.
    Whole,
}

impl Refinement {
    /// The share of its samples that are done, with those of the round under way; `None` where it is not known how many there will be.
    pub fn share(&self) -> Option<f64> {
        let Budget::Samples(all) = self.plan.budget else { return None };
        let under_way = self.under_way.as_ref().map_or(0.0, |(round, place)| {
            f64::from(round.samples) * f64::from(place.row) / f64::from(self.targets.mean.height())
        });
        Some((f64::from(self.samples) + under_way) / f64::from(all))
    }

    /// Samples per pixel so far.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// Pixels.
    pub fn size(&self) -> Size {
        self.plan.size
    }

    /// Whether it has all that its plan asks for.
    pub fn is_whole(&self) -> bool {
        self.is_enough
    }

    /// From now on it is shown with that exposure, in stops, and tone curve.
    pub fn set_look(&mut self, exposure: f64, tonemap: Tonemap) {
        (self.plan.exposure, self.plan.tonemap) = (exposure, tonemap);
    }

    /// Device time of each pass so far.
    pub fn passes(&self) -> &[PassTime] {
        &self.times.0
    }
}
