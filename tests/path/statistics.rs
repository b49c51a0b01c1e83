//! Whether two estimates of a picture, each with an error of its own, are of the same picture.

use glam::DVec3;
use statrs::distribution::{ContinuousCDF, StudentsT};

use crate::device::Picture;

/// Values of a picture's pixels and channels, each with its variance, of so many degrees of freedom.
pub struct Estimate {
    values: Vec<f64>,
    variances: Vec<f64>,
    freedom: f64,
}

/// Batches of samples that a standard error comes from, and what it is scaled by for there being so few of them; as in src/passes.
const BATCHES: f64 = 16.0;
const SCALE: f64 = 1.0 + 1.25 / (BATCHES - 1.0) + 49.0 / 32.0 / ((BATCHES - 1.0) * (BATCHES - 1.0));

fn flat(pixels: &[DVec3]) -> impl Iterator<Item = f64> + '_ {
    pixels.iter().flat_map(|pixel| pixel.to_array())
}

impl Estimate {
    /// From pictures of different seeds, and the standard errors that they state.
    pub fn of_paths(pictures: &[Picture]) -> Self {
        let count = pictures.len() as f64;
        let size = 3 * pictures[0].radiance.len();
        let (mut values, mut variances) = (vec![0.0; size], vec![0.0; size]);
        for picture in pictures {
            values.iter_mut().zip(flat(&picture.radiance)).for_each(|(sum, value)| *sum += value / count);
            let squared = flat(&picture.stderr).map(|error| (error / SCALE / count).powi(2));
            variances.iter_mut().zip(squared).for_each(|(sum, squared)| *sum += squared);
        }
        Self { values, variances, freedom: count * (BATCHES - 1.0) }
    }

    /// From pictures of different seeds that state no error.
    pub fn of_seeds(pictures: &[Vec<DVec3>]) -> Self {
        let count = pictures.len() as f64;
        let flats: Vec<Vec<f64>> = pictures.iter().map(|picture| flat(picture).collect()).collect();
        let size = flats[0].len();
        let values: Vec<f64> = (0..size).map(|i| flats.iter().map(|flat| flat[i]).sum::<f64>() / count).collect();
        let squares = |i: usize| flats.iter().map(|flat| (flat[i] - values[i]).powi(2)).sum::<f64>();
        let variances = (0..size).map(|i| squares(i) / (count * (count - 1.0))).collect();
        Self { values, variances, freedom: count - 1.0 }
    }
}

/// How far two estimates are apart.
#[derive(Clone, Copy, Debug)]
pub struct Distance {
    /// The least probability among all values, that chance alone puts two so far apart.
    pub worst: f64,
    /// What `worst` has to reach so that all together are wrongly doubted in one of 100 cases: Sidak 1967.
    pub level: f64,
    /// The share of values that are more than two standard errors apart.
    pub beyond: f64,
    /// The difference of the mean over the picture, relative, and its standard error.
    pub means: (f64, f64),
}

/// B. L. Welch's test (1947) of every value.
pub fn distance(a: &Estimate, b: &Estimate) -> Distance {
    let count = a.values.len();
    let (mut worst, mut beyond) = (1.0_f64, 0);
    for i in 0..count {
        // Where nothing varies the rounding of some ten 32-bit operations is left.
        let rounding = (1e-6 * a.values[i]).powi(2);
        let (u, v) = (a.variances[i] + rounding, b.variances[i]);
        let z = (a.values[i] - b.values[i]).abs() / (u + v).sqrt();
        let freedom = (u + v).powi(2) / (u * u / a.freedom + v * v / b.freedom);
        let probability = if z == 0.0 || z.is_nan() {
            1.0
        } else {
            2.0 * StudentsT::new(0.0, 1.0, freedom).expect("a distribution").cdf(-z)
        };
        worst = worst.min(probability);
        beyond += usize::from(z > 2.0);
    }
    let mean = |estimate: &Estimate| estimate.values.iter().sum::<f64>() / count as f64;
    let variance: f64 = a.variances.iter().chain(&b.variances).sum();
    let means = ((mean(a) / mean(b) - 1.0).abs(), variance.sqrt() / count as f64 / mean(b));
    let level = 1.0 - 0.99_f64.powf(1.0 / count as f64);
    Distance { worst, level, beyond: beyond as f64 / count as f64, means }
}
