//! Whether a picture is that of its reference. In flow pixels, standard errors and limits, out flow numbers and what is above its limit.
//!
//! A picture that is computed is compared with metrics. One that is sampled at random has an error, and so has its reference: Welch's
//! t-test asks of each pixel and channel whether the difference is more than both explain (B. L. Welch 1947). Over all of them the level
//! is Sidak's, as in Mitsuba's tests: where nothing changed, hardly a pixel is rejected. A shift too small for that shows in the mean.

use statrs::distribution::{ContinuousCDF, StudentsT};

use crate::compare::{Comparison, Metric};
use crate::passes::DARK;

/// Something that a limit can be on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// One of those that `vitrum compare` knows.
    Metric(Metric),
    /// The share of pixels and channels that differ by more than their standard errors explain.
    Rejected,
    /// The difference of the means of the pictures in its standard errors, of the channel where it is the largest.
    MeanZ,
}

impl Measure {
    /// All that limits can be on: PSNR falls where errors grow.
    pub fn limited() -> impl Iterator<Item = Self> {
        let metrics = Metric::ALL.into_iter().filter(|&metric| metric != Metric::Psnr).map(Self::Metric);
        metrics.chain([Self::Rejected, Self::MeanZ])
    }

    /// Its name in suites and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Metric(metric) => metric.name(),
            Self::Rejected => "rejected",
            Self::MeanZ => "mean_z",
        }
    }

    /// The one of this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::limited().find(|measure| measure.name() == name)
    }
}

/// The most that measures may be.
#[derive(Clone, Debug, PartialEq)]
pub struct Limits(Vec<(Measure, f64)>);

impl Limits {
    /// These.
    pub fn new(limits: Vec<(Measure, f64)>) -> Self {
        Self(limits)
    }

    /// Those of a suite that says nothing: what rounding differs in from device to device, or what chance does.
    pub fn default_of(is_random: bool) -> Self {
        Self(match is_random {
            true => vec![(Measure::Rejected, 0.0025), (Measure::MeanZ, 4.0)],
            false => vec![(Measure::Metric(Metric::P99), 1e-4), (Measure::Metric(Metric::Relmse), 1e-4)],
        })
    }

    /// The limit of one.
    pub fn of(&self, measure: Measure) -> Option<f64> {
        self.0.iter().find(|(known, _)| *known == measure).map(|&(_, most)| most)
    }

    /// Whether any is on what standard errors tell.
    pub fn needs_errors(&self) -> bool {
        self.0.iter().any(|(measure, _)| matches!(measure, Measure::Rejected | Measure::MeanZ))
    }

    /// Those that are broken, in words; what is not known or not a number is above every limit.
    pub fn broken(&self, values: &[(Measure, f64)]) -> Vec<String> {
        let value = |measure| values.iter().find(|(known, _)| *known == measure).map_or(f64::NAN, |&(_, value)| value);
        let broken = |&(measure, most): &(Measure, f64)| {
            let (name, value) = (measure.name(), value(measure));
            let is_kept = value <= most;
            (!is_kept).then(|| match value.is_finite() {
                true => format!("{name} is {value:.3e}, limit {most}"),
                false => format!("{name} is not finite, limit {most}"),
            })
        };
        self.0.iter().filter_map(broken).collect()
    }
}

/// A mean of random samples.
#[derive(Clone, Copy, Debug)]
pub struct Sampled<'a> {
    /// Of each pixel.
    pub mean: &'a [[f32; 3]],
    /// Its standard error.
    pub stderr: &'a [[f32; 3]],
    /// How many batches those are from.
    pub batches: u32,
}

/// The level at which one rejection would be expected in a hundred pictures that are alike.
const LEVEL: f64 = 0.01;

/// What rounding may differ in, relative to the value and 0.1: pixels without noise have no other error.
const ROUNDING: f64 = 1e-5;

/// The share of values whose difference the standard errors do not explain, and the difference of the means in its standard errors.
pub fn chance(test: Sampled<'_>, reference: Sampled<'_>) -> [(Measure, f64); 2] {
    let values = 3 * test.mean.len();
    let level = 1.0 - (1.0 - LEVEL).powf(1.0 / values as f64);
    let most = Bounds::new(level, test.batches, reference.batches);
    let (mut rejected, mut sum, mut variance) = (0_usize, [0.0; 3], [0.0; 3]);
    for (pixel, (x, r)) in test.mean.iter().zip(reference.mean).enumerate() {
        for channel in 0..3 {
            let (x, r) = (f64::from(x[channel]), f64::from(r[channel]));
            let of = |sampled: Sampled<'_>| f64::from(sampled.stderr[pixel][channel]).powi(2);
            let rounding = (ROUNDING * (r.abs() + DARK)).powi(2);
            let (own, other) = (of(test), of(reference));
            let squared = (x - r).powi(2) / (own + other + rounding);
            let is_kept = squared.sqrt() <= most.of(own, other);
            rejected += usize::from(!is_kept);
            sum[channel] += x - r;
            variance[channel] += own + other + rounding;
        }
    }
    let mean_z = (0..3).map(|channel| (sum[channel] / variance[channel].sqrt()).abs()).fold(0.0, |a: f64, b| {
        // NaN stays.
        if b > a || b.is_nan() { b } else { a }
    });
    [(Measure::Rejected, rejected as f64 / values as f64), (Measure::MeanZ, mean_z)]
}

/// How large Student's t may be, by its degrees of freedom.
struct Bounds {
    batches: [f64; 2],
    /// Of 1, 2, ... degrees.
    most: Vec<f64>,
}

impl Bounds {
    fn new(level: f64, test: u32, reference: u32) -> Self {
        let batches = [test, reference].map(|batches| f64::from(batches.max(2)));
        let bound = |degrees: u32| {
            let students = StudentsT::new(0.0, 1.0, f64::from(degrees));
            students.map_or(f64::INFINITY, |students| students.inverse_cdf(1.0 - level / 2.0))
        };
        // More differ from the normal distribution by nothing that counts.
        let largest = (test + reference).clamp(4, 200);
        Self { batches, most: (1..=largest).map(bound).collect() }
    }

    /// That of a difference of means with these variances: the degrees of freedom are Welch and Satterthwaite's.
    fn of(&self, test: f64, reference: f64) -> f64 {
        let share = |variance: f64, batches: f64| variance * variance / (batches - 1.0);
        let [own, other] = self.batches;
        let degrees = (test + reference).powi(2) / (share(test, own) + share(reference, other));
        let last = self.most.len() - 1;
        let index = if degrees.is_finite() { (degrees.floor() as usize).saturating_sub(1) } else { last };
        self.most[index.min(last)]
    }
}

/// What `vitrum compare` knows of two pictures.
pub fn metrics(comparison: &Comparison) -> Vec<(Measure, f64)> {
    Metric::ALL.into_iter().map(|metric| (Measure::Metric(metric), comparison.get(metric))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const BATCHES: u32 = 16;

    /// Pictures of `pixels` pixels of exponentially distributed noise around 1, whose batches are of `samples` samples.
    fn noisy(pixels: usize, samples: u32, seed: u64, factor: f64) -> (Vec<[f32; 3]>, Vec<[f32; 3]>) {
        let mut random = fastrand::Rng::with_seed(seed);
        let mut value = || {
            let batch = |random: &mut fastrand::Rng| {
                let sum: f64 = (0..samples).map(|_| -factor * (1.0 - random.f64()).ln()).sum();
                sum / f64::from(samples)
            };
            let batches: Vec<f64> = (0..BATCHES).map(|_| batch(&mut random)).collect();
            let mean = batches.iter().sum::<f64>() / f64::from(BATCHES);
            let squares: f64 = batches.iter().map(|x| (x - mean).powi(2)).sum();
            let error = (squares / f64::from(BATCHES * (BATCHES - 1))).sqrt();
            (mean as f32, error as f32)
        };
        (0..pixels)
            .map(|_| {
                let [r, g, b] = [value(), value(), value()];
                ([r.0, g.0, b.0], [r.1, g.1, b.1])
            })
            .unzip()
    }

    fn judged(test: &(Vec<[f32; 3]>, Vec<[f32; 3]>), reference: &(Vec<[f32; 3]>, Vec<[f32; 3]>)) -> [f64; 2] {
        let sampled = |(mean, stderr): &'_ (Vec<[f32; 3]>, Vec<[f32; 3]>)| (mean.clone(), stderr.clone());
        let (test, reference) = (sampled(test), sampled(reference));
        let of = |(mean, stderr)| Sampled { mean, stderr, batches: BATCHES };
        chance(of((&test.0, &test.1)), of((&reference.0, &reference.1))).map(|(_, value)| value)
    }

    /// What is alike passes whatever the seed, and a shift of two hundredths does not.
    #[test]
    fn chance_is_told_from_change() {
        let reference = noisy(1500, 16, 0, 1.0);
        for seed in 1..=20 {
            let [rejected, mean] = judged(&noisy(1500, 16, seed, 1.0), &reference);
            assert!(rejected <= 0.0025 && mean <= 4.0, "{seed}: {rejected} {mean}");
        }
        let [_, mean] = judged(&noisy(1500, 16, 1, 1.02), &reference);
        assert!(mean > 4.0, "{mean}");
        let mut spotted = noisy(1500, 16, 1, 1.0);
        for pixel in &mut spotted.0[700..715] {
            *pixel = [2.0; 3];
        }
        let [rejected, _] = judged(&spotted, &reference);
        assert!((0.0099..0.0101).contains(&rejected), "a hundredth of the pixels: {rejected}");
    }

    #[test]
    fn pixels_without_noise_may_differ_by_rounding() {
        let plain = |value: f32| (vec![[value; 3]; 10], vec![[0.0; 3]; 10]);
        assert_eq!(judged(&plain(1.0), &plain(1.0)), [0.0, 0.0]);
        assert_eq!(judged(&plain(1.000_001), &plain(1.0))[0], 0.0);
        assert_eq!(judged(&plain(1.001), &plain(1.0))[0], 1.0);
        // What is not finite is rejected, and breaks the mean.
        let [rejected, mean] = judged(&plain(f32::NAN), &plain(1.0));
        assert!(rejected == 1.0 && mean.is_nan());
    }

    #[test]
    fn what_is_not_known_breaks_its_limit() {
        let limits = Limits::new(vec![(Measure::Rejected, 1.0), (Measure::Metric(Metric::Max), 0.5)]);
        assert_eq!(limits.broken(&[(Measure::Metric(Metric::Max), 0.5)]), ["rejected is not finite, limit 1"]);
        assert_eq!(
            limits.broken(&[(Measure::Metric(Metric::Max), 0.75), (Measure::Rejected, 0.0)]),
            ["max is 7.500e-1, limit 0.5"]
        );
    }
}
