//! Checks that render as users do: every model with every effect on and off, both tracers, layers, checkpoints, pictures that grow.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use clap::ValueEnum;

use super::session::{Session, Trouble, Verdict, hold};
use crate::gpu::{DeviceKind, Gpu, GpuError, Watch};
use crate::image::FloatImage;
use crate::options::{Aov, Model, RenderArgs, Size, Tonemap, Trace};
use crate::passes::{self, Rendered, Renderer, Step, batches_of};
use crate::plan::Plan;
use crate::regress::{Limits, Sampled, chance};
use crate::report::float_image;
use crate::scene::Scene;
use crate::{Error, Result};

/// What is rendered with which passes.
#[derive(Clone, Debug)]
pub struct Shot {
    pub model: Model,
    pub trace: Option<Trace>,
    /// A selection of effects.
    pub effects: String,
    /// The scene is of clear glass, else every effect is called for.
    pub plain: bool,
}

impl Shot {
    /// As the scene calls for.
    pub fn plain(model: Model, trace: Option<Trace>) -> Self {
        Self { model, trace, effects: "auto".into(), plain: true }
    }

    /// With every effect.
    pub fn rich(model: Model, trace: Option<Trace>) -> Self {
        Self { model, trace, effects: "all".into(), plain: false }
    }

    /// Small: what is looked for shows in a few pixels.
    pub fn args(&self) -> Result<RenderArgs> {
        Ok(RenderArgs {
            model: Some(self.model.into()),
            size: Some(Size { width: 48, height: 36 }),
            samples: Some(if self.model == Model::Path { 16 } else { 2 }),
            trace: self.trace,
            effects: Some(self.effects.parse().map_err(Error::Usage)?),
            ..RenderArgs::default()
        })
    }

    pub fn scene(&self) -> Result<Scene> {
        if self.plain { Scene::of_clear_glass() } else { Scene::of_every_effect() }
    }

    /// Whether the device can.
    pub fn is_for(&self, gpu: &Gpu) -> Verdict {
        let lacks = self.trace == Some(Trace::Hardware) && !gpu.ray_query();
        if lacks { Err(Trouble::Skipped("the device has no ray queries".into())) } else { Ok(()) }
    }
}

/// Renders, and holds that every value is a number and not all are black. Values may be negative: pure colours of a spectrum are.
fn picture(gpu: &Gpu, scene: &Scene, args: &RenderArgs) -> Result<(FloatImage, Rendered), Trouble> {
    let plan = Plan::new(scene, args)?;
    passes::check(gpu, &plan)?;
    let rendered = passes::render(gpu, scene, &plan, &mut |_| {})?;
    let image = float_image(&rendered, &plan);
    let values = || image.pixels.iter().flatten();
    let wrong = values().filter(|value| !value.is_finite()).count();
    hold(wrong == 0, || format!("{wrong} values are not finite"))?;
    hold(values().any(|&value| value > 0.0), || "the picture is black".into())?;
    Ok((image, rendered))
}

/// One picture.
pub fn render(session: &mut Session<'_>, shot: &Shot) -> Verdict {
    let gpu = session.open()?;
    shot.is_for(&gpu)?;
    let is_long = session.watch() == Watch::GpuAssisted && !shot.plain && shot.model.traces();
    if is_long && gpu.info().kind == DeviceKind::Cpu && !session.place.thorough {
        let why = "on a processor what the layer adds takes minutes to compile; --thorough tries it all the same";
        return Err(Trouble::Skipped(why.into()));
    }
    let (image, rendered) = picture(&gpu, &shot.scene()?, &shot.args()?)?;
    session.keep("", &image)?;
    if let Some(ms) = rendered.gpu_ms() {
        session.fact(format!("{ms:.1} ms on the device, {} bytes at most", gpu.peak_bytes()));
    }
    Ok(())
}

/// Rays that the hardware traces and those that the shader does see the same: in `tree` pixel by pixel, in `path`, whose ways part
/// with the last bit of a distance, as far as chance goes.
pub fn tracers(session: &mut Session<'_>, model: Model) -> Verdict {
    let gpu = session.open()?;
    Shot::rich(model, Some(Trace::Hardware)).is_for(&gpu)?;
    let mut found = Vec::new();
    for (number, trace) in (0..).zip([Trace::Software, Trace::Hardware]) {
        let shot = Shot::rich(model, Some(trace));
        // What is compared by chance has to be of different chances.
        let args = match model {
            Model::Path => RenderArgs { seed: Some(number), samples: Some(64), ..shot.args()? },
            _ => shot.args()?,
        };
        let scene = shot.scene()?;
        let (image, rendered) = picture(&gpu, &scene, &args)?;
        session.keep(&format!("-{}", trace.name()), &image)?;
        found.push((rendered, Plan::new(&scene, &args)?));
    }
    let [software, hardware] = &found[..] else { return Ok(()) };
    if model == Model::Path {
        differ_by_chance(session, software, hardware)
    } else {
        are_alike(session, software, hardware)
    }
}

fn are_alike(session: &mut Session<'_>, (a, _): &(Rendered, Plan), (b, _): &(Rendered, Plan)) -> Verdict {
    /// A ray that runs along an edge may miss on one side what it meets on the other.
    const MOST_DIFFERENT: f64 = 0.02;
    let differ =
        |(a, b): &(&[f32; 3], &[f32; 3])| a.iter().zip(*b).any(|(a, b)| (a - b).abs() > 1e-2 * (a.abs() + 0.1));
    let different = a.radiance.iter().zip(&b.radiance).filter(differ).count();
    let share = different as f64 / a.radiance.len() as f64;
    let told = format!("{:.2} % of the pixels differ by more than 1 %", 100.0 * share);
    session.fact(told.clone());
    hold(share <= MOST_DIFFERENT, || told)
}

fn differ_by_chance(session: &mut Session<'_>, a: &(Rendered, Plan), b: &(Rendered, Plan)) -> Verdict {
    let sampled = |(rendered, plan): &'_ (Rendered, Plan)| {
        let stderr = rendered.counts.as_ref().and_then(|counts| counts.stderr.clone()).unwrap_or_default();
        (rendered.radiance.clone(), stderr, batches_of(plan, rendered.samples))
    };
    let (a, b) = (sampled(a), sampled(b));
    let [a, b] = [&a, &b].map(|(mean, stderr, batches)| Sampled { mean, stderr, batches: *batches });
    let measures = chance(a, b);
    session.fact(measures.map(|(measure, value)| format!("{} {value:.2e}", measure.name())).join(", "));
    let broken = Limits::default_of(/* is_random: */ true).broken(&measures);
    hold(broken.is_empty(), || broken.join(", "))
}

/// Every layer that the model has.
pub fn layers(session: &mut Session<'_>, model: Model) -> Verdict {
    let gpu = session.open()?;
    let shot = Shot::rich(model, None);
    let scene = shot.scene()?;
    let has =
        |aov: &Aov| Plan::new(&scene, &RenderArgs { aov: Some(vec![*aov]), ..shot.args().unwrap_or_default() }).is_ok();
    let aovs: Vec<_> = Aov::value_variants().iter().copied().filter(has).collect();
    let names: Vec<_> = aovs.iter().map(|aov| aov.name()).collect();
    session.fact(names.join(", "));
    let (_, rendered) = picture(&gpu, &scene, &RenderArgs { aov: Some(aovs), ..shot.args()? })?;
    let Some(found) = rendered.aovs else { return Err(Trouble::Failed("there are no layers".into())) };
    let Size { width, height } = shot.args()?.size.unwrap_or(Plan::SIZE);
    let pixels = found.normal.iter().map(|normal| normal.map(f32::abs)).collect();
    let image = FloatImage { width, height, pixels, layers: Vec::new() };
    session.keep("-normal", &image)?;
    let wrong = found.depth.iter().filter(|depth| !depth.is_finite() || **depth < 0.0).count();
    hold(wrong == 0, || format!("{wrong} depths are negative or not finite"))?;
    hold(found.object.iter().any(|&object| object > 0.0), || "no pixel shows an object".into())
}

/// Every tone curve; what a screen shows of white is white.
pub fn displays(session: &mut Session<'_>) -> Verdict {
    let gpu = session.open()?;
    let shot = Shot::plain(Model::Single, None);
    for &tonemap in Tonemap::value_variants() {
        let args = RenderArgs { tonemap: Some(tonemap), ..shot.args()? };
        let (_, rendered) = picture(&gpu, &shot.scene()?, &args)?;
        let dark = rendered.display.iter().all(|pixel| pixel[..3] == [0; 3]);
        hold(!dark, || format!("{} shows black", tonemap.name()))?;
    }
    Ok(())
}

/// A render that is left and taken up again comes to the same bits.
pub fn checkpoint(session: &mut Session<'_>) -> Verdict {
    let gpu = session.open()?;
    let shot = Shot::rich(Model::Path, Some(Trace::Software));
    let scene = shot.scene()?;
    let path = session.place.folder.join("checkpoint.part");
    let within = |seconds, checkpoint: Option<&Path>| -> Result<_> {
        let checkpoint = checkpoint.map(Path::to_path_buf);
        Ok(RenderArgs { samples: Some(64), time_budget: Some(seconds), checkpoint, ..shot.args()? })
    };
    // The first ends after a round, for want of time.
    picture(&gpu, &scene, &within(1e-6, Some(&path))?)?;
    let (resumed, rendered) = picture(&gpu, &scene, &within(1e6, Some(&path))?)?;
    std::fs::remove_file(&path).map_err(|source| Error::file(&path, "remove", source))?;
    let (at_once, _) = picture(&gpu, &scene, &within(1e6, None)?)?;
    session.fact(format!("went on from {} of {} samples", rendered.resumed, rendered.samples));
    let is_between = (1..rendered.samples).contains(&rendered.resumed);
    hold(is_between, || format!("it went on from {} of {} samples", rendered.resumed, rendered.samples))?;
    hold(resumed.pixels == at_once.pixels, || "it is another picture than the one made at once".into())
}

/// Pictures that grow, are paused, interrupted, and left for another scene, model or size, as in the viewer.
pub fn refine(session: &mut Session<'_>) -> Verdict {
    let gpu = session.open()?;
    let shots = [
        Shot::plain(Model::Path, Some(Trace::Software)),
        Shot::rich(Model::Tree, Some(Trace::Software)),
        Shot::plain(Model::Double, None),
        Shot::plain(Model::Path, Some(Trace::Software)),
    ];
    let mut kept: Option<Renderer> = None;
    let mut steps = 0;
    for (shot, (width, height)) in shots.iter().zip([(48, 36), (7, 33), (64, 64), (1, 1)]) {
        let scene = shot.scene()?;
        let plan = Plan::new(&scene, &RenderArgs { size: Some(Size { width, height }), ..shot.args()? })?;
        let renderer = match &mut kept {
            Some(renderer) => {
                renderer.change(&scene, &plan)?;
                renderer
            }
            none => none.insert(Renderer::new(&gpu, &scene, &plan)?),
        };
        let mut picture = renderer.begin(&plan)?;
        // Paused where it can be, and gone on with.
        while renderer.advance(&mut picture, &mut || false)? != Step::Whole {
            steps += 1;
        }
        let shown = renderer.display(&mut picture)?;
        let radiance = renderer.radiance(&picture)?;
        renderer.image_of(picture.size(), &vec![[255; 4]; radiance.len()])?;
        renderer.counts(&picture)?;
        hold(radiance.iter().flatten().all(|value| value.is_finite()), || "a value is not finite".into())?;
        hold((shown.width(), shown.height()) == (width, height), || "what is shown is of another size".into())?;
    }
    let interrupt = Arc::new(AtomicBool::new(false));
    if let Some(renderer) = &mut kept {
        renderer.interrupt_by(interrupt.clone());
        interrupt.store(true, Ordering::Relaxed);
        let shot = &shots[0];
        let (scene, args) = (shot.scene()?, shot.args()?);
        let plan = Plan::new(&scene, &args)?;
        let ended = renderer.change(&scene, &plan).and_then(|()| renderer.render(&plan, &mut |_| {}).map(|_| ()));
        hold(matches!(ended, Err(Error::Gpu(GpuError::Interrupted))), || "what is interrupted goes on".into())?;
    }
    session.fact(format!("{steps} steps"));
    Ok(())
}
