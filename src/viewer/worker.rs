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
use crate::options::{Model, RenderArgs, Size, Tonemap};
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

/// How often a picture is shown while it grows, and how often is told how far it is.
const PERIOD: Duration = Duration::from_millis(150);
const TELLING: Duration = Duration::from_millis(500);

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
    /// Whether a finer one or one with more samples is under way in its place.
    pub(super) stand_in: bool,
}

/// What there is to hear.
pub(super) enum News {
    Picture(Picture),
    /// The share of the first picture's samples that are done.
    Progress(f64),
    /// The picture that was wanted cannot be made.
    Failed(String),
    /// The device is gone.
    Lost,
}

impl desk::News for News {
    fn replaces(&self, before: &Self) -> bool {
        match (self, before) {
            (Self::Picture(new), Self::Picture(old)) => new.number == old.number,
            (Self::Progress(_), Self::Progress(_)) => true,
            _ => false,
        }
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

/// A stand-in that was shown.
struct StandIn {
    revision: [u64; 2],
    plan: Plan,
    picture: Refinement,
    look: Look,
}

/// How a picture is shown.
#[derive(Clone, Copy, PartialEq)]
struct Look {
    exposure: Option<f64>,
    tonemap: Option<Tonemap>,
    shows: Shows,
}

impl Shot {
    fn look(&self) -> Look {
        Look { exposure: self.args.exposure, tonemap: self.args.tonemap, shows: self.shows }
    }
}

/// One of the pictures.
#[derive(Default)]
struct Slot {
    renderer: Option<Renderer>,
    /// The last stand-in, which may be shown with another look.
    stand_in: Option<StandIn>,
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
            let before = self.slots[number].stand_in.as_ref();
            let stood_in = before.is_some_and(|before| before.revision == wanted.shots[number].revision);
            self.show_again(wanted, number)?;
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
                let is_worth_it = coarse > FINEST || paths;
                while is_worth_it && !self.stand_in(wanted, number, coarse, /* leaves: */ true)? {
                    if !self.takes_look(wanted)? {
                        return Ok(());
                    }
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

    /// One sample of a coarser picture. `leaves`: whether it is left where something else is wanted; false if it was.
    fn stand_in(&mut self, wanted: &Wanted, number: usize, coarse: f64, leaves: bool) -> Result<bool> {
        let Shot { scene, args, .. } = &wanted.shots[number];
        let whole = Plan::new(scene, args)?.size;
        let side = |side: u32| (f64::from(side) / coarse).ceil() as u32;
        let size = Size { width: side(whole.width), height: side(whole.height) };
        let (tolerance, time_budget) = (None, None);
        let args = RenderArgs { size: Some(size), samples: Some(1), tolerance, time_budget, ..args.clone() };
        let plan = Plan::new(scene, &args)?;
        self.renderer(wanted, number, &plan)?;
        let orders = &self.orders;
        let Some(renderer) = &mut self.slots[number].renderer else { return Ok(true) };
        let mut picture = renderer.begin(&plan)?;
        let start = Instant::now();
        if renderer.advance(&mut picture, &mut || !(leaves && orders.is_late()))? == Step::Paused {
            return Ok(false);
        }
        let seen = shown(renderer, &mut picture, &wanted.shots[number], None)?;
        let ms = start.elapsed().as_secs_f64() * 1e3;
        self.speed.entry(plan.model.name()).or_default().learn(plan.size.pixels(), ms);
        self.show(wanted, number, &plan, true, &picture, seen);
        let (revision, look) = (wanted.shots[number].revision, wanted.shots[number].look());
        self.slots[number].stand_in = Some(StandIn { revision, plan, picture, look });
        Ok(true)
    }

    /// Takes what is wanted next, where it is the same with another look, and shows stand-ins with it; false where nothing of the kind is
    /// wanted.
    fn takes_look(&mut self, wanted: &mut Wanted) -> Result<bool> {
        let revisions = |wanted: &Wanted| wanted.shots.iter().map(|shot| shot.revision).collect::<Vec<_>>();
        let these = revisions(wanted);
        let mut any = false;
        while let Some(next) = self.orders.next_if(|next| revisions(next) == these && !next.moving) {
            *wanted = next;
            any = true;
        }
        for number in 0..if any { wanted.shots.len() } else { 0 } {
            let is_whole = self.slots[number].whole.as_ref().is_some_and(|(.., picture)| picture.samples() > 0);
            if !is_whole {
                self.show_again(wanted, number)?;
            }
        }
        Ok(any)
    }

    /// The last stand-in once more, where it is to be shown in another way.
    fn show_again(&mut self, wanted: &Wanted, number: usize) -> Result<()> {
        let (slot, shot) = (&mut self.slots[number], &wanted.shots[number]);
        let (Some(renderer), Some(mut before)) = (&mut slot.renderer, slot.stand_in.take()) else { return Ok(()) };
        if before.revision == shot.revision && before.look != shot.look() {
            before.look = shot.look();
            let seen = shown(renderer, &mut before.picture, shot, None)?;
            self.show(wanted, number, &before.plan, true, &before.picture, seen);
        }
        self.slots[number].stand_in = Some(before);
        Ok(())
    }

    /// The whole picture, with all its samples, shown from time to time; false where something else was wanted before its end.
    fn grow(&mut self, wanted: &mut Wanted, number: usize) -> Result<bool> {
        let kept = self.slots[number].whole.take().filter(|(revision, ..)| *revision == wanted.shots[number].revision);
        // The time of the first round, where all of it is seen here: it pauses, to tell how far it is.
        let mut first = kept.is_none().then_some(Duration::ZERO);
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
            let step = renderer.advance(&mut picture, &mut || !orders.is_late() && start.elapsed() < TELLING)?;
            first = first.map(|time| time + start.elapsed());
            if let Some(time) = first.take_if(|_| step == Step::Round) {
                let ms = time.as_secs_f64() * 1e3 / f64::from(picture.samples());
                self.speed.entry(plan.model.name()).or_default().learn(plan.size.pixels(), ms);
            }
            if number == 0 && self.takes_look(wanted)? {
                // Also of a round that is under way.
                shown = None;
            }
            if let Some(share) = picture.share().filter(|_| number == 0 && step == Step::Paused) {
                self.orders.tell(News::Progress(share));
            }
            left |= self.orders.is_late();
            let is_due = shown.is_none_or(|shown| step != Step::Paused && shown.elapsed() > PERIOD);
            if picture.samples() > 0 && !left && (is_due || picture.is_whole()) {
                let asked = wanted.pixel.filter(|[x, y]| number == 0 && *x < plan.size.width && *y < plan.size.height);
                let Some(renderer) = &mut self.slots[number].renderer else { return Ok(true) };
                let seen = self::shown(renderer, &mut picture, &wanted.shots[number], asked)?;
                shown = Some(Instant::now());
                self.show(wanted, number, &plan, false, &picture, seen);
            }
            if left || picture.is_whole() {
                if picture.samples() > 0 {
                    self.slots[number].stand_in = None;
                }
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
        stand_in: bool,
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
            stand_in,
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
