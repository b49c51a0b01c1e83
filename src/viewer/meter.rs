//! What the viewer did: how often pictures came while something moved, and how long after they were asked for.

use std::time::{Duration, Instant};

use serde::Serialize;

/// Longer than that apart, two pictures are not of one movement.
const PAUSE: Duration = Duration::from_secs(2);

/// As many of the last values as are kept.
const MOST: usize = 4096;

/// Counts and times so far.
#[derive(Default)]
pub(super) struct Meter {
    frames: u64,
    pictures: u64,
    stand_ins: u64,
    latencies: Vec<f64>,
    intervals: Vec<f64>,
    drawing: Vec<f64>,
    last: Option<Instant>,
}

/// Schema 1 of `vitrum view --stats`: docs/view.md describes the members.
#[derive(Serialize)]
pub(super) struct Report {
    schema: u32,
    frames: u64,
    pictures: u64,
    stand_ins: u64,
    latency_ms: Option<Spread>,
    interval_ms: Option<Spread>,
    drawing_ms: Option<Spread>,
}

/// The middle of some values, what 95 % of them are within, the largest.
#[derive(Serialize)]
struct Spread {
    count: usize,
    median: f64,
    p95: f64,
    max: f64,
}

impl Spread {
    fn of(values: &[f64]) -> Option<Self> {
        let mut values = values.to_vec();
        values.sort_by(f64::total_cmp);
        let at = |share: f64| values[((values.len() - 1) as f64 * share).round() as usize];
        (!values.is_empty()).then(|| Self { count: values.len(), median: at(0.5), p95: at(0.95), max: at(1.0) })
    }
}

fn keep(values: &mut Vec<f64>, value: Duration) {
    if values.len() == MOST {
        values.remove(0);
    }
    values.push(value.as_secs_f64() * 1e3);
}

impl Meter {
    /// How often the window was drawn.
    #[cfg(debug_assertions)]
    pub(super) fn frames(&self) -> u64 {
        self.frames
    }

    /// The window was drawn, which took so long.
    pub(super) fn drew(&mut self, time: Duration) {
        self.frames += 1;
        keep(&mut self.drawing, time);
    }

    /// A picture came to the screen just now that was asked for then, while something moved or not.
    pub(super) fn showed(&mut self, asked: Instant, moving: bool, stand_in: bool) {
        let now = Instant::now();
        self.pictures += 1;
        self.stand_ins += u64::from(stand_in);
        if !moving {
            self.last = None;
            return;
        }
        keep(&mut self.latencies, now.duration_since(asked));
        if let Some(last) = self.last.replace(now).filter(|last| now.duration_since(*last) < PAUSE) {
            keep(&mut self.intervals, now.duration_since(last));
        }
    }

    pub(super) fn report(&self) -> Report {
        Report {
            schema: 1,
            frames: self.frames,
            pictures: self.pictures,
            stand_ins: self.stand_ins,
            latency_ms: Spread::of(&self.latencies),
            interval_ms: Spread::of(&self.intervals),
            drawing_ms: Spread::of(&self.drawing),
        }
    }
}
