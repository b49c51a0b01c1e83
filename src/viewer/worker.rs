//! What renders while the window waits for nothing. In flow what is wanted, out flow pictures, the coarse ones first.
//!
//! One thread. While something moves it makes stand-ins, as large as a moment allows; at rest the whole picture grows until it has all
//! of its samples, and then the thread sleeps. Whatever is wanted next ends what grows, but not a stand-in: else a mouse that never
//! rests would see nothing.

use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crate::gpu::{Gpu, GpuError, Image, PassTime};
use crate::options::{RenderArgs, Size};
use crate::passes::Renderer;
use crate::plan::{Budget, Plan};
use crate::scene::Scene;
use crate::{Error, Result};

/// What a stand-in may take.
const STAND_IN: Duration = Duration::from_millis(50);

/// The coarsest stand-in: one pixel for so many in each direction.
const COARSEST: u32 = 16;

/// Milliseconds of a pixel, where nothing is known.
const SLOW: f64 = 5e-3;

/// How often a picture is shown while it grows.
const PERIOD: Duration = Duration::from_millis(150);

/// A picture to be made.
#[derive(Clone)]
pub(super) struct Wanted {
    pub(super) scene: Scene,
    /// Model, size, samples and the rest.
    pub(super) args: RenderArgs,
    /// Whether another follows at once: a stand-in is enough.
    pub(super) moving: bool,
}

/// A picture that was made.
pub(super) struct Picture {
    pub(super) size: Size,
    /// The size of what it stands for.
    pub(super) whole: Size,
    pub(super) image: Arc<Image>,
    pub(super) samples: u32,
    /// How many there will be; `None` where that is not known.
    pub(super) of: Option<u32>,
    /// Device time of each pass, of all samples.
    pub(super) passes: Vec<PassTime>,
    /// What the model does not simulate, or by something simpler.
    pub(super) lacks: Vec<String>,
}

/// What there is to hear.
pub(super) enum News {
    Picture(Picture),
    /// The picture that was wanted cannot be made.
    Failed(String),
    /// The device is gone.
    Lost,
}

#[derive(Default)]
struct Desk {
    wanted: Option<Wanted>,
    news: Option<News>,
    /// Whether what is under way may be left.
    growing: bool,
    closed: bool,
}

struct Shared {
    desk: Mutex<Desk>,
    arrived: Condvar,
    interrupt: Arc<AtomicBool>,
}

impl Shared {
    fn desk(&self) -> MutexGuard<'_, Desk> {
        self.desk.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The thread, seen from the window.
pub(super) struct Worker {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Worker {
    /// `wake` is called whenever there is news.
    pub(super) fn new(gpu: Gpu, wake: impl Fn() + Send + 'static) -> Self {
        let shared = Arc::new(Shared { desk: Mutex::default(), arrived: Condvar::new(), interrupt: Arc::default() });
        let desk = Arc::clone(&shared);
        let work =
            move || Work { shared: desk, gpu, renderer: None, speed: HashMap::new(), wake: Box::new(wake) }.run();
        Self { shared, thread: Some(std::thread::spawn(work)) }
    }

    /// Makes this picture next, in the place of any that waits.
    pub(super) fn want(&self, wanted: Wanted) {
        let mut desk = self.shared.desk();
        if desk.growing {
            self.shared.interrupt.store(true, Ordering::Relaxed);
        }
        desk.wanted = Some(wanted);
        self.shared.arrived.notify_all();
    }

    /// The last there is to hear.
    pub(super) fn news(&self) -> Option<News> {
        self.shared.desk().news.take()
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.shared.desk().closed = true;
        self.shared.interrupt.store(true, Ordering::Relaxed);
        self.shared.arrived.notify_all();
        if let Some(thread) = self.thread.take() {
            // One that panicked has said so.
            let _ = thread.join();
        }
    }
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

    /// How many pixels a stand-in may have.
    fn pixels(&self) -> f64 {
        let wanted = STAND_IN.as_secs_f64() * 1e3;
        match (self.small, self.large) {
            (Some((few, ms)), Some((many, more))) if more > ms && many > few => {
                let each = (more - ms) / (many - few);
                let fixed = (ms - each * few).max(0.0);
                // Where even nothing takes longer, half of what there is.
                ((wanted - fixed).max(0.25 * wanted)) / each
            }
            (Some((pixels, ms)), _) | (None, Some((pixels, ms))) => pixels * wanted / ms.max(1e-3),
            (None, None) => wanted / SLOW,
        }
    }
}

/// The thread, seen from itself.
struct Work {
    shared: Arc<Shared>,
    gpu: Gpu,
    renderer: Option<Renderer>,
    /// What samples took, by model.
    speed: HashMap<&'static str, Speed>,
    wake: Box<dyn Fn() + Send>,
}

impl Work {
    fn run(mut self) {
        while let Some(wanted) = self.next() {
            let news = match self.make(&wanted) {
                Ok(()) | Err(Error::Gpu(GpuError::Interrupted)) => continue,
                Err(Error::Gpu(GpuError::Lost)) => News::Lost,
                Err(error) => News::Failed(error.in_full()),
            };
            // What is half made is not trusted.
            self.renderer = None;
            self.tell(news);
        }
    }

    /// Waits for what is wanted; `None` at the end.
    fn next(&self) -> Option<Wanted> {
        let mut desk = self.shared.desk();
        desk.growing = false;
        loop {
            if desk.closed {
                return None;
            }
            if let Some(wanted) = desk.wanted.take() {
                self.shared.interrupt.store(false, Ordering::Relaxed);
                return Some(wanted);
            }
            desk = self.shared.arrived.wait(desk).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Whether something else is wanted already; from here on it would end the work.
    fn may_grow(&self) -> bool {
        let mut desk = self.shared.desk();
        desk.growing = true;
        desk.wanted.is_none() && !desk.closed
    }

    fn tell(&self, news: News) {
        self.shared.desk().news = Some(news);
        (self.wake)();
    }

    fn make(&mut self, wanted: &Wanted) -> Result<()> {
        let whole = Plan::new(&wanted.scene, &wanted.args)?;
        let speed = self.speed.get(whole.model.name()).copied().unwrap_or_default();
        let coarse = (whole.size.pixels() / speed.pixels()).sqrt().ceil().clamp(1.0, f64::from(COARSEST)) as u32;
        if coarse > 1 || wanted.moving {
            let side = |side: u32| side.div_ceil(coarse);
            let size = Size { width: side(whole.size.width), height: side(whole.size.height) };
            let args = RenderArgs { size: Some(size), samples: Some(1), ..wanted.args.clone() };
            self.grow(wanted, &Plan::new(&wanted.scene, &args)?, whole.size)?;
        }
        if !wanted.moving && self.may_grow() {
            self.grow(wanted, &whole, whole.size)?;
        }
        Ok(())
    }

    /// Makes a picture, and shows it from time to time.
    fn grow(&mut self, wanted: &Wanted, plan: &Plan, whole: Size) -> Result<()> {
        let renderer = match &mut self.renderer {
            Some(renderer) => {
                renderer.change(&wanted.scene, plan)?;
                renderer
            }
            none => {
                let mut renderer = Renderer::new(&self.gpu, &wanted.scene, plan)?;
                renderer.interrupt_by(Arc::clone(&self.shared.interrupt));
                none.insert(renderer)
            }
        };
        let of = match plan.budget {
            Budget::Samples(samples) => Some(samples),
            Budget::Seconds { .. } => None,
        };
        let mut picture = renderer.begin(plan)?;
        let start = Instant::now();
        let mut shown: Option<Instant> = None;
        loop {
            let more = renderer.advance(&mut picture)?;
            if picture.samples() == 0 || !more && shown.is_none() {
                return Ok(());
            }
            let is_due = shown.is_none_or(|shown| shown.elapsed() > PERIOD);
            if more && !is_due && of != Some(picture.samples()) {
                continue;
            }
            if !more && of == Some(picture.samples()) {
                return Ok(());
            }
            let image = Arc::new(renderer.display(&mut picture)?);
            if shown.is_none() {
                let ms = start.elapsed().as_secs_f64() * 1e3 / f64::from(picture.samples());
                self.speed.entry(plan.model.name()).or_default().learn(plan.size.pixels(), ms);
            }
            shown = Some(Instant::now());
            let lacks = [(&plan.unsupported, "does not simulate"), (&plan.approximate, "approximates")];
            let lacks = lacks.into_iter().filter(|(effects, _)| **effects != Default::default());
            let news = News::Picture(Picture {
                size: plan.size,
                whole,
                image,
                samples: picture.samples(),
                of,
                passes: picture.passes().to_vec(),
                lacks: lacks.map(|(effects, what)| format!("{what} {}", effects.names().join(", "))).collect(),
            });
            self.shared.desk().news = Some(news);
            (self.wake)();
            if !more {
                return Ok(());
            }
        }
    }
}
