//! The thread that renders what the window shows. In flow scenes and options, out flow pictures, the coarse ones first.
//!
//! While something moves it makes stand-ins, as large as a moment allows; at rest the whole picture grows until it has all of its
//! samples, and then the thread sleeps. Whatever is wanted next ends what grows, but not a stand-in: else a mouse that never rests would
//! see nothing. Another exposure or tone curve ends nothing.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::colors::{Legend, colors};
use super::desk::{self, Hand, Orders};
use super::state::{Shows, model_of};
use crate::gpu::{Gpu, GpuError, Image, PassTime};
use crate::options::{Model, RenderArgs, Size};
use crate::passes::{Refinement, Renderer, Step};
use crate::plan::{Budget, Plan};
use crate::report::DiscardedStats;
use crate::scene::Scene;
use crate::{Error, Result};

/// What a stand-in may take.
const STAND_IN: Duration = Duration::from_millis(22);

/// How coarse stand-ins can be: pixels of the picture in one of theirs, in each direction.
const COARSE: [f64; 14] = [1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 16.0, 20.0];

/// How much finer each further stand-in is, and how fine none is.
const FINER: f64 = 2.5;
const FINEST: f64 = 1.5;

/// Milliseconds of a pixel, where nothing is known.
const SLOW: f64 = 5e-3;

/// How often a picture is shown while it grows.
const PERIOD: Duration = Duration::from_millis(150);

/// How long a submission should take: whoever moves something waits for its end.
pub(super) const PATIENCE: Duration = Duration::from_millis(25);

/// A picture to be made.
pub(super) struct Shot {
    /// Tells it from others, but for how they are shown.
    pub(super) revision: [u64; 2],
    pub(super) scene: Scene,
    /// Model, size, samples and the rest.
    pub(super) args: RenderArgs,
    /// What of it is shown.
    pub(super) shows: Shows,
}

/// Pictures to be made.
pub(super) struct Wanted {
    pub(super) shots: Vec<Shot>,
    /// A pixel of the first whose value is to be known.
    pub(super) pixel: Option<[u32; 2]>,
    /// Whether more follows at once: stand-ins are enough.
    pub(super) moving: bool,
    /// When it was asked for.
    pub(super) asked: Instant,
}

/// A picture that was made.
pub(super) struct Picture {
    /// Which of those that were wanted.
    pub(super) number: usize,
    pub(super) image: Arc<Image>,
    pub(super) size: Size,
    /// The size of what it stands for.
    pub(super) whole: Size,
    pub(super) samples: u32,
    /// How many there will be; `None` where that is not known.
    pub(super) of: Option<u32>,
    /// Device time of each pass, of all samples.
    pub(super) passes: Vec<PassTime>,
    /// What the model does not simulate, or by something simpler, and what it cut off.
    pub(super) lacks: Vec<String>,
    /// What its colours stand for, where they are not those of light.
    pub(super) legend: Option<Legend>,
    /// The pixel that was asked for, and its radiance.
    pub(super) value: Option<([u32; 2], [f32; 3])>,
    pub(super) moving: bool,
    /// When it was asked for.
    pub(super) asked: Instant,
}

/// What there is to hear.
pub(super) enum News {
    Picture(Picture),
    /// The picture that was wanted cannot be made.
    Failed(String),
    /// The device is gone.
    Lost,
}

impl desk::News for News {
    fn replaces(&self, before: &Self) -> bool {
        matches!((self, before), (Self::Picture(new), Self::Picture(old)) if new.number == old.number)
    }
}

pub(super) type Worker = Hand<Wanted, News>;

/// Starts the thread; `wake` is called whenever there is news.
pub(super) fn start(gpu: Gpu, wake: impl Fn() + Send + Sync + 'static) -> Worker {
    Hand::new(wake, |orders| Work { orders, gpu, slots: Vec::new(), speed: HashMap::new() }.run())
}

/// What a sample takes: so much, and so much for each pixel. Both as the last pictures, a small and a large one, had it.
#[derive(Clone, Copy, Default)]
struct Speed {
    small: Option<(f64, f64)>,
    large: Option<(f64, f64)>,
}

impl Speed {
    /// A sample of so many pixels took so many milliseconds.
    fn learn(&mut self, pixels: f64, ms: f64) {
        let is_small = self.large.is_none_or(|(large, _)| pixels < 0.7 * large);
        *(if is_small { &mut self.small } else { &mut self.large }) = Some((pixels, ms));
    }

    /// How many pixels a stand-in may have that takes so many milliseconds.
    fn pixels(&self, wanted: f64) -> f64 {
        match (self.small, self.large) {
            (Some((few, ms)), Some((many, more))) if more > ms && many > few => {
                let each = (more - ms) / (many - few);
                let fixed = (ms - each * few).max(0.0);
                // Where even nothing takes longer, a quarter of what there is.
                (wanted - fixed).max(0.25 * wanted) / each
            }
            (Some((pixels, ms)), _) | (None, Some((pixels, ms))) => pixels * wanted / ms.max(1e-3),
            (None, None) => wanted / SLOW,
        }
    }
}

/// What is to be seen of a picture.
struct Seen {
    image: Image,
    /// What its colours mean, where they are not those of light.
    legend: Option<Legend>,
    /// The pixel that was asked for, and its radiance.
    value: Option<([u32; 2], [f32; 3])>,
    /// What was cut off, of a picture that has all of its samples.
    discarded: Option<DiscardedStats>,
}

fn shown(renderer: &mut Renderer, picture: &mut Refinement, shot: &Shot, pixel: Option<[u32; 2]>) -> Result<Seen> {
    let value = match pixel {
        Some([x, y]) => {
            let radiance = renderer.radiance(picture)?;
            radiance.get((y * picture.size().width + x) as usize).map(|&radiance| ([x, y], radiance))
        }
        None => None,
    };
    let RenderArgs { exposure, tonemap, .. } = shot.args;
    picture.set_look(exposure.unwrap_or(0.0), tonemap.unwrap_or_default());
    let is_cut = picture.is_whole() && model_of(&shot.args) == Model::Tree;
    let counts = if is_cut { renderer.counts(picture)? } else { None };
    let discarded = counts.and_then(|counts| counts.discarded).map(|discarded| DiscardedStats::new(&discarded));
    if shot.shows != Shows::Light
        && let Some(counts) = renderer.counts(picture)?
        && let Some((pixels, legend)) = colors(shot.shows, &counts, &renderer.radiance(picture)?)
    {
        return Ok(Seen { image: renderer.image_of(picture.size(), &pixels)?, legend: Some(legend), value, discarded });
    }
    Ok(Seen { image: renderer.display(picture)?, legend: None, value, discarded })
}

/// One of the pictures.
#[derive(Default)]
struct Slot {
    renderer: Option<Renderer>,
    /// The revision that a stand-in was of last.
    stood_in: Option<[u64; 2]>,
    /// The whole one, as far as it is, and the revision that it is of.
    whole: Option<([u64; 2], Plan, Refinement)>,
}

/// The thread, seen from itself.
struct Work {
    orders: Orders<Wanted, News>,
    gpu: Gpu,
    slots: Vec<Slot>,
    /// What samples took, by model.
    speed: HashMap<&'static str, Speed>,
}

impl Work {
    fn run(mut self) {
        while let Some(mut wanted) = self.orders.next() {
            let news = match self.make(&mut wanted) {
                Ok(()) => continue,
                Err(Error::Gpu(GpuError::Lost)) => News::Lost,
                Err(error) => News::Failed(error.in_full()),
            };
            // What is half made is not trusted.
            self.slots.clear();
            self.orders.tell(news);
        }
    }

    fn make(&mut self, wanted: &mut Wanted) -> Result<()> {
        self.slots.resize_with(wanted.shots.len(), Slot::default);
        // What is beside a picture must not keep it back.
        if let Err(error) =
            wanted.shots.iter().skip(1).try_for_each(|shot| Plan::new(&shot.scene, &shot.args).map(drop))
        {
            self.orders.tell(News::Failed(format!("beside: {}", error.in_full())));
            wanted.shots.truncate(1);
            self.slots.truncate(1);
        }
        let mut new = Vec::new();
        for (number, (slot, shot)) in self.slots.iter_mut().zip(&wanted.shots).enumerate() {
            if slot.whole.as_ref().is_none_or(|(revision, ..)| *revision != shot.revision) {
                slot.whole = None;
                new.push(number);
            }
        }
        for &number in &new {
            let coarse = self.coarse(wanted, number, new.len())?;
            let stood_in = self.slots[number].stood_in == Some(wanted.shots[number].revision);
            if wanted.moving || coarse > 1.0 && !stood_in {
                self.stand_in(wanted, number, coarse, /* leaves: */ false)?;
            }
        }
        for &number in &new {
            // Finer ones, where the first round of the whole picture lets wait: that of `path` has many samples.
            let paths = model_of(&wanted.shots[number].args) == Model::Path;
            let mut coarse = self.coarse(wanted, number, new.len())?;
            while !wanted.moving && coarse > 1.0 && !self.orders.is_late() {
                coarse = (coarse / FINER).max(1.0);
                if coarse > FINEST || paths {
                    self.stand_in(wanted, number, coarse, /* leaves: */ true)?;
                }
            }
        }
        // The quicker one first.
        let mut order: Vec<usize> = (0..wanted.shots.len()).collect();
        let pixels = |number: &usize| {
            let model = model_of(&wanted.shots[*number].args);
            self.speed.get(model.name()).copied().unwrap_or_default().pixels(1.0)
        };
        order.sort_by(|a, b| pixels(b).total_cmp(&pixels(a)));
        for number in order {
            if !wanted.moving && !self.grow(wanted, number)? {
                return Ok(());
            }
        }
        Ok(())
    }

    /// How coarse a stand-in has to be, one of `of`, for all to take no longer than one may.
    fn coarse(&self, wanted: &Wanted, number: usize, of: usize) -> Result<f64> {
        let whole = Plan::new(&wanted.shots[number].scene, &wanted.shots[number].args)?;
        let speed = self.speed.get(whole.model.name()).copied().unwrap_or_default();
        let pixels = speed.pixels(STAND_IN.as_secs_f64() * 1e3 / of as f64);
        let least = (whole.size.pixels() / pixels).sqrt();
        Ok(COARSE.into_iter().find(|&coarse| coarse >= least).unwrap_or(COARSE[COARSE.len() - 1]))
    }

    /// One sample of a coarser picture. `leaves`: whether it is left where something else is wanted.
    fn stand_in(&mut self, wanted: &Wanted, number: usize, coarse: f64, leaves: bool) -> Result<()> {
        let Shot { scene, args, .. } = &wanted.shots[number];
        let whole = Plan::new(scene, args)?.size;
        let side = |side: u32| (f64::from(side) / coarse).ceil() as u32;
        let size = Size { width: side(whole.width), height: side(whole.height) };
        let (tolerance, time_budget) = (None, None);
        let args = RenderArgs { size: Some(size), samples: Some(1), tolerance, time_budget, ..args.clone() };
        let plan = Plan::new(scene, &args)?;
        self.renderer(wanted, number, &plan)?;
        let orders = &self.orders;
        let Some(renderer) = &mut self.slots[number].renderer else { return Ok(()) };
        let mut picture = renderer.begin(&plan)?;
        let start = Instant::now();
        if renderer.advance(&mut picture, &mut || !(leaves && orders.is_late()))? == Step::Paused {
            return Ok(());
        }
        let seen = shown(renderer, &mut picture, &wanted.shots[number], None)?;
        let ms = start.elapsed().as_secs_f64() * 1e3;
        self.slots[number].stood_in = Some(wanted.shots[number].revision);
        self.speed.entry(plan.model.name()).or_default().learn(plan.size.pixels(), ms);
        self.show(wanted, number, &plan, whole, &picture, seen);
        Ok(())
    }

    /// The whole picture, with all its samples, shown from time to time; false where something else was wanted before its end.
    fn grow(&mut self, wanted: &mut Wanted, number: usize) -> Result<bool> {
        let kept = self.slots[number].whole.take().filter(|(revision, ..)| *revision == wanted.shots[number].revision);
        let (plan, mut picture) = match kept {
            Some((_, plan, picture)) => (plan, picture),
            None => {
                let plan = Plan::new(&wanted.shots[number].scene, &wanted.shots[number].args)?;
                let picture = self.renderer(wanted, number, &plan)?.begin(&plan)?;
                (plan, picture)
            }
        };
        let mut shown: Option<Instant> = None;
        let mut left = false;
        loop {
            let orders = &self.orders;
            let Some(renderer) = &mut self.slots[number].renderer else { return Ok(true) };
            let start = Instant::now();
            let before = picture.samples();
            let step = renderer.advance(&mut picture, &mut || !orders.is_late())?;
            if before == 0 && step == Step::Round {
                let ms = start.elapsed().as_secs_f64() * 1e3 / f64::from(picture.samples());
                self.speed.entry(plan.model.name()).or_default().learn(plan.size.pixels(), ms);
            }
            // The same with another look goes on from here; what is beside would leave the first picture as it was.
            let revisions = |wanted: &Wanted| wanted.shots.iter().map(|shot| shot.revision).collect::<Vec<_>>();
            let these = revisions(wanted);
            let is_like = |next: &Wanted| number == 0 && revisions(next) == these && !next.moving;
            while let Some(next) = self.orders.next_if(is_like) {
                *wanted = next;
                shown = None;
            }
            left |= self.orders.is_late();
            // Another look is shown at once, also of a round that is under way.
            let is_due = shown.is_none_or(|shown| step != Step::Paused && shown.elapsed() > PERIOD);
            if picture.samples() > 0 && !left && (is_due || picture.is_whole()) {
                let asked = wanted.pixel.filter(|[x, y]| number == 0 && *x < plan.size.width && *y < plan.size.height);
                let seen = self::shown(renderer, &mut picture, &wanted.shots[number], asked)?;
                shown = Some(Instant::now());
                self.show(wanted, number, &plan, plan.size, &picture, seen);
            }
            if left || picture.is_whole() {
                self.slots[number].whole = Some((wanted.shots[number].revision, plan, picture));
                return Ok(!left);
            }
        }
    }

    /// The renderer of a picture, ready for `plan`.
    fn renderer(&mut self, wanted: &Wanted, number: usize, plan: &Plan) -> Result<&mut Renderer> {
        let slot = &mut self.slots[number];
        match &mut slot.renderer {
            Some(renderer) => {
                renderer.change(&wanted.shots[number].scene, plan)?;
                Ok(renderer)
            }
            none => {
                let mut renderer = Renderer::new(&self.gpu, &wanted.shots[number].scene, plan)?;
                renderer.set_patience(PATIENCE);
                Ok(none.insert(renderer))
            }
        }
    }

    fn show(
        &self,
        wanted: &Wanted,
        number: usize,
        plan: &Plan,
        whole: Size,
        picture: &Refinement,
        Seen { image, legend, value, discarded }: Seen,
    ) {
        let lacks = [(&plan.unsupported, "does not simulate"), (&plan.approximate, "approximates")];
        let lacks = lacks.into_iter().filter(|(effects, _)| **effects != Default::default());
        let lacks = lacks.map(|(effects, what)| format!("{what} {}", effects.names().join(", ")));
        let cut = discarded.filter(|discarded| discarded.max > 0.0).map(|DiscardedStats { max, mean }| {
            format!("cut off: up to {max:.1e} of a pixel's light, {mean:.1e} in the mean")
        });
        self.orders.tell(News::Picture(Picture {
            number,
            image: Arc::new(image),
            size: plan.size,
            whole,
            samples: picture.samples(),
            of: match plan.budget {
                Budget::Samples(samples) => Some(samples),
                Budget::Seconds { .. } => None,
            },
            passes: picture.passes().to_vec(),
            lacks: lacks.chain(cut).collect(),
            legend,
            value,
            moving: wanted.moving,
            asked: wanted.asked,
        }));
    }
}
