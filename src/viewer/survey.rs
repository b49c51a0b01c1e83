//! The thread that measures while nothing moves. In flow what is looked at and what is to be known of it, out flow errors, what the models
//! have to offer, and the light of a pixel.

use std::sync::Arc;

use super::desk::{Hand, News, Orders};
use super::inspect::{Inspection, Inspector};
use super::worker::PATIENCE;
use crate::choice::{Measurements, error_of_most, pilot_size};
use crate::gpu::{Gpu, GpuError};
use crate::options::{MOST_SAMPLES, Model, RenderArgs};
use crate::passes::{MOST_PIXELS, Refinement, Renderer, Step, error_of};
use crate::plan::{DEPTH_OF_TOLERANCE, Plan};
use crate::scene::Scene;
use crate::{Error, Result};

/// What is to be known.
pub(super) struct Query {
    /// Tells what is looked at from others.
    pub(super) revision: u64,
    /// Tells scenes apart, whatever the model.
    pub(super) scene_revision: u64,
    pub(super) scene: Scene,
    pub(super) args: RenderArgs,
    /// The error of the picture.
    pub(super) error: bool,
    /// What the models have to offer.
    pub(super) offers: bool,
    /// What light a pixel sees.
    pub(super) pixel: Option<[u32; 2]>,
}

/// The error of the picture that is shown, as of a small one of the same settings.
#[derive(Clone, Copy, Debug)]
pub(super) struct Measured {
    /// What 95 % of the pixels are within, each channel for itself, of the reference.
    pub(super) error: f64,
    /// The same of the reference itself.
    pub(super) noise: f64,
    /// Samples of the reference.
    pub(super) samples: u32,
    pub(super) model: Model,
}

/// What there is to hear.
pub(super) enum Finding {
    Error(u64, Measured),
    /// Nothing tells the error: why.
    NoError(u64, String),
    Offers(u64, Arc<Measurements>),
    Pixel(u64, Box<Inspection>),
    Failed(String),
    /// The device is gone.
    Lost,
}

impl News for Finding {
    fn replaces(&self, before: &Self) -> bool {
        matches!((self, before), (Self::Error(..), Self::Error(..)) | (Self::Pixel(..), Self::Pixel(..)))
    }
}

pub(super) type Survey = Hand<Query, Finding>;

/// Starts the thread; `wake` is called whenever there is news.
pub(super) fn start(gpu: Gpu, wake: impl Fn() + Send + Sync + 'static) -> Survey {
    Hand::new(wake, |orders| Work { orders, gpu, reference: None, inspector: None }.run())
}

/// The reference gets so much better at least before it is held against the picture again.
const NEXT: f64 = 1.3;

/// How much smaller than the error of the picture that of the reference has to be to let it rest, and how small is small enough.
const CLOSE: f64 = 0.1;
const FINE: f64 = 1e-3;

/// Samples of the reference where nothing tells how far off it is.
const SAMPLES_OF_TREE: u32 = 64;

/// A picture that converges, and a small one of what is shown.
struct Reference {
    revision: u64,
    renderer: Renderer,
    picture: Refinement,
    plan: Plan,
    shown: Vec<[f32; 3]>,
}

struct Work {
    orders: Orders<Query, Finding>,
    gpu: Gpu,
    reference: Option<Reference>,
    inspector: Option<(u64, Inspector)>,
}

impl Work {
    fn run(mut self) {
        while let Some(query) = self.orders.next() {
            let finding = match self.answer(&query) {
                Ok(()) | Err(Error::Gpu(GpuError::Interrupted)) => continue,
                Err(Error::Gpu(GpuError::Lost)) => Finding::Lost,
                Err(error) => Finding::Failed(error.in_full()),
            };
            (self.reference, self.inspector) = (None, None);
            self.orders.tell(finding);
        }
    }

    fn answer(&mut self, query: &Query) -> Result<()> {
        if let Some(pixel) = query.pixel {
            let kept = self.inspector.take().filter(|(revision, _)| *revision == query.revision);
            let (_, inspector) = match kept {
                Some(kept) => self.inspector.insert(kept),
                None => {
                    let inspector = Inspector::new(&self.gpu, &query.scene)?;
                    self.inspector.insert((query.revision, inspector))
                }
            };
            let inspection = inspector.look(&query.scene, &query.args, pixel)?;
            self.orders.tell(Finding::Pixel(query.revision, Box::new(inspection)));
        }
        if query.error && !self.orders.is_late() {
            self.error(query, /* to the end: */ !query.offers)?;
        }
        if query.offers && !self.orders.is_late() {
            let measured = Measurements::new(&self.gpu, &query.scene, &query.args, self.orders.interrupt())?;
            self.orders.tell(Finding::Offers(query.scene_revision, Arc::new(measured)));
            if query.error && !self.orders.is_late() {
                self.error(query, true)?;
            }
        }
        Ok(())
    }

    /// Lets the reference converge, and tells how far off the picture is; once, or to the end.
    fn error(&mut self, query: &Query, to_the_end: bool) -> Result<()> {
        let kept = self.reference.take().filter(|reference| reference.revision == query.revision);
        let mut reference = match kept {
            Some(reference) => reference,
            None => match self.reference(query)? {
                Some(reference) => reference,
                None => {
                    let why = "no model sees all of the light, so nothing tells how far off this is";
                    self.orders.tell(Finding::NoError(query.revision, why.into()));
                    return Ok(());
                }
            },
        };
        let mut told = 0;
        let orders = &self.orders;
        loop {
            let step = reference.renderer.advance(&mut reference.picture, &mut || !orders.is_late())?;
            let (picture, samples) = (&reference.picture, reference.picture.samples());
            if step == Step::Paused || orders.is_late() {
                break;
            }
            if f64::from(samples) < NEXT * f64::from(told) && !picture.is_whole() {
                continue;
            }
            told = samples;
            let truth = reference.renderer.radiance(picture)?;
            let stderr = reference.renderer.counts(picture)?.and_then(|counts| counts.stderr);
            // What cannot tell its own error is as good as it gets when it is whole.
            let is_unknown = stderr.is_none() && !picture.is_whole();
            let noise = match stderr {
                Some(stderr) => error_of(MOST_PIXELS, &truth, &stderr),
                None if is_unknown => f64::INFINITY,
                None => 0.0,
            };
            let error = error_of_most(&reference.shown, &truth);
            let measured = Measured { error, noise, samples, model: reference.plan.model };
            if noise.is_finite() {
                self.orders.tell(Finding::Error(query.revision, measured));
            }
            if picture.is_whole() || noise < (CLOSE * error).max(FINE) || noise.is_finite() && !to_the_end {
                break;
            }
        }
        self.reference = Some(reference);
        Ok(())
    }

    fn reference(&self, query: &Query) -> Result<Option<Reference>> {
        let (scene, args) = (&query.scene, &query.args);
        let small = Some(pilot_size(&self.gpu, args.size.unwrap_or(Plan::SIZE)));
        let shown = RenderArgs { size: small, aov: None, time_budget: None, ..args.clone() };
        let other = |model: Model| RenderArgs {
            model: Some(model.into()),
            max_depth: Some(DEPTH_OF_TOLERANCE),
            samples: Some(MOST_SAMPLES),
            seed: Some(args.seed.unwrap_or(0) ^ 0x5eed_0005),
            tolerance: None,
            ..shown.clone()
        };
        // With a tolerance it takes small batches, as many as it needs.
        let path = RenderArgs { tolerance: Some(0.5 * FINE), ..other(Model::Path) };
        let path = Plan::new(scene, &path)?;
        let tree = RenderArgs { samples: Some(SAMPLES_OF_TREE), tolerance: Some(1e-4), ..other(Model::Tree) };
        let tree = Plan::new(scene, &tree)?;
        let plan = match () {
            () if path.unseen.is_empty() => path,
            () if tree.lacks() == 0 => tree,
            () => return Ok(None),
        };
        let interrupt = self.orders.interrupt();
        let of_shown = Plan::new(scene, &shown)?;
        let mut renderer = Renderer::new(&self.gpu, scene, &of_shown)?;
        renderer.interrupt_by(interrupt.clone());
        renderer.set_patience(PATIENCE);
        let shown = renderer.render(&of_shown, &mut |_| {})?.radiance;
        let mut renderer = Renderer::new(&self.gpu, scene, &plan)?;
        renderer.interrupt_by(interrupt);
        renderer.set_patience(PATIENCE);
        let picture = renderer.begin(&plan)?;
        Ok(Some(Reference { revision: query.revision, renderer, picture, plan, shown }))
    }
}
