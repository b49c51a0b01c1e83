//! How error and time of a model go with the number of its samples. In flow what a few pilots found, out flow the error of any number,
//! and the number that an error takes.

use crate::options::MOST_SAMPLES;

/// How many times the samples of a pilot errors may be thought to fall with its power. Beyond, they fall with the square root.
const REACH: f64 = 4.0;

/// The fewest samples that are asked for.
pub const FEW: u32 = 4;

/// How error and time of a model go with the number of samples.
#[derive(Clone, Copy, Debug)]
pub struct Law {
    /// What stays with any number of samples.
    pub floor: f64,
    /// What samples add to that, which were so many, and the power of their number that it falls with.
    spread: f64,
    tried: f64,
    power: f64,
    /// How much more precise than that samples should be.
    margin: f64,
    /// Milliseconds of a sample of the whole picture.
    pub ms: f64,
    /// How much the model leaves out or approximates.
    pub lacks: usize,
}

impl Law {
    /// The error of so many samples.
    pub fn error(&self, samples: u32) -> f64 {
        let ratio = f64::from(samples) / self.tried;
        let (near, far) = (ratio.min(REACH), ratio.max(REACH) / REACH);
        self.floor.hypot(self.spread * near.powf(-self.power) / far.sqrt())
    }

    /// How many samples it takes to err no more than that, if any number does; no fewer than were tried.
    pub fn samples(&self, error: f64) -> Option<u32> {
        let left = (error * error - self.floor * self.floor).sqrt();
        if left.is_nan() || left <= 0.0 {
            return None;
        }
        let ratio = self.margin * self.spread / left;
        let reached = REACH.powf(self.power);
        let times = match ratio > reached {
            true => REACH * (ratio / reached).powi(2),
            false => ratio.powf(1.0 / self.power),
        };
        let samples = (self.tried * times).ceil().max(f64::from(FEW));
        (samples <= f64::from(MOST_SAMPLES)).then_some(samples as u32)
    }
}

/// The error of a number of samples, and the power of their number that it falls with.
#[derive(Clone, Copy, Debug)]
pub struct Spread {
    pub error: f64,
    pub samples: u32,
    pub power: f64,
}

impl Spread {
    /// With what stays, how much more precise samples should be, and what they take.
    pub fn law(self, floor: f64, margin: f64, ms: f64, lacks: usize) -> Law {
        Law { floor, spread: self.error, tried: f64::from(self.samples), power: self.power, margin, ms, lacks }
    }
}
