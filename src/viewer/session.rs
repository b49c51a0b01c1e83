//! What the panels share beside the state: what was measured, and what they ask for.

use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::Arc;

use super::Options;
use super::disk::Recent;
use super::inspect::Inspection;
use super::state::State;
use super::survey::{Measured, Query};
use super::worker::Picture;
use crate::Result;
use crate::choice::Measurements;
use crate::gpu::Placed;
use crate::options::ModelChoice;

/// Pictures whose times are plotted.
const HISTORY: usize = 120;

/// What is to be asked of the survey.
pub(super) enum Ask {
    Query(Box<Query>),
    /// It may rest.
    Nothing,
}

/// Something that a panel cannot do itself.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Action {
    Open(PathBuf),
    Reload,
    /// The scene as its file has it.
    Revert,
    /// Renders the picture into [`State::output`].
    Save,
    /// Puts the command that repeats the picture on the clipboard.
    Copy,
}

/// What is asked of the model's choice.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Target {
    /// The user chooses.
    #[default]
    None,
    Tolerance,
    FrameRate,
}

/// The Cost window.
pub(super) struct Cost {
    pub(super) is_open: bool,
    /// Whether it is unfolded at first.
    pub(super) opens: bool,
    /// Milliseconds of a sample of each pass, of the last pictures.
    pub(super) history: VecDeque<Vec<(&'static str, f64)>>,
    pub(super) error: Option<(u64, Measured)>,
    pub(super) no_error: Option<(u64, String)>,
    pub(super) offers: Option<(u64, Arc<Measurements>)>,
    pub(super) target: Target,
    pub(super) tolerance: f64,
    /// Pictures a second.
    pub(super) rate: f64,
    /// What was chosen by last: the offers' scene, the target and its numbers.
    pub(super) applied: Option<(u64, Target, f64, f64)>,
}

impl Default for Cost {
    fn default() -> Self {
        Self {
            is_open: false,
            opens: false,
            history: VecDeque::new(),
            error: None,
            no_error: None,
            offers: None,
            target: Target::None,
            tolerance: crate::choice::TOLERANCE,
            rate: 20.0,
            applied: None,
        }
    }
}

impl Cost {
    /// Has the model chosen, as `--model auto` does.
    fn choose(&mut self, tolerance: Option<f64>, seconds: Option<f64>) {
        self.opens = true;
        self.target = if seconds.is_some() && tolerance.is_none() { Target::FrameRate } else { Target::Tolerance };
        self.tolerance = tolerance.unwrap_or(self.tolerance);
        self.rate = seconds.map_or(self.rate, f64::recip);
    }

    pub(super) fn keep(&mut self, picture: &Picture) {
        let samples = f64::from(picture.samples);
        let times = picture.passes.iter().filter_map(|pass| pass.gpu_ms.map(|ms| (pass.name, ms / samples)));
        if self.history.len() == HISTORY {
            self.history.pop_front();
        }
        self.history.push_back(times.collect());
    }
}

/// The Pixel window.
#[derive(Default)]
pub(super) struct Pixel {
    pub(super) is_open: bool,
    pub(super) pixel: Option<[u32; 2]>,
    pub(super) inspection: Option<(u64, Box<Inspection>)>,
}

/// All that is open.
pub(super) struct Session {
    pub(super) state: State,
    pub(super) cost: Cost,
    pub(super) pixel: Pixel,
    pub(super) actions: Vec<Action>,
    /// Files that were open last.
    pub(super) recent: Recent,
    /// The pictures in their places, of this frame.
    pub(super) placed: Vec<Placed>,
    /// What the survey was asked last.
    asked: Option<(u64, bool, Option<[u32; 2]>)>,
}

impl Session {
    pub(super) fn new(options: Options) -> Result<Self> {
        let (path, args) = (options.scene.clone(), options.args.clone());
        let state = State::new(options)?;
        let args = args.or(state.scene.render.clone());
        let (mut cost, pixel, mut recent) = (Cost::default(), Pixel::default(), Recent::load());
        if args.model == Some(ModelChoice::Auto) {
            cost.choose(args.tolerance, args.time_budget);
        }
        if let Some(path) = &path {
            recent.add(path);
        }
        Ok(Self { state, cost, pixel, actions: Vec::new(), recent, placed: Vec::new(), asked: None })
    }

    /// What is to be measured of what is at rest, if that is not under way already.
    pub(super) fn query(&mut self) -> Option<Ask> {
        let pixel = self.pixel.pixel.filter(|_| self.pixel.is_open);
        let known = self.pixel.inspection.as_ref();
        let is_known = known.is_some_and(|(revision, of)| *revision == self.state.revision && Some(of.pixel) == pixel);
        let pixel = pixel.filter(|_| !is_known);
        let offers =
            self.cost.is_open && self.cost.offers.as_ref().is_none_or(|(of, _)| *of != self.state.scene_revision);
        let wish = (self.state.revision, self.cost.is_open, pixel);
        if !self.cost.is_open && pixel.is_none() {
            return self.asked.take().map(|_| Ask::Nothing);
        }
        // That a pixel is known now is no reason to begin again.
        let is_asked = |(revision, error, before): (u64, bool, Option<[u32; 2]>)| {
            (revision, error) == (wish.0, wish.1) && (pixel.is_none() || before == pixel)
        };
        if self.asked.is_some_and(is_asked) {
            return None;
        }
        self.asked = Some(wish);
        let shot = self.state.wanted(std::time::Instant::now(), false).shots.swap_remove(0);
        let (scene, args) = (shot.scene, shot.args);
        let State { revision, scene_revision, .. } = self.state;
        let error = self.cost.is_open;
        Some(Ask::Query(Box::new(Query { revision, scene_revision, scene, args, error, offers, pixel })))
    }

    /// Whatever was measured is of something else from now on.
    pub(super) fn forget(&mut self) {
        self.asked = None;
    }
}
