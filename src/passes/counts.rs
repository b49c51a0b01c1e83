//! What models count beside the light. In flow images as the device has them, out flows [`Counts`].

use std::f64::consts::SQRT_2;

use bytemuck::allocation::pod_collect_to_vec;
use libm::erf;

/// Means over the samples of each pixel, row 0 at the top.
#[derive(Clone, Debug)]
pub struct Counts {
    /// Throughput that `tree` or `path` cut off.
    pub discarded: Option<Vec<f32>>,
    /// Standard error of the radiance that `path` or `double` found, of each channel; infinite with a single batch of samples.
    pub stderr: Option<Vec<[f32; 3]>>,
    /// Interfaces that scattered light.
    pub interfaces: Vec<f32>,
    /// Rays in all, of models that trace.
    pub rays: Option<u64>,
}

impl Counts {
    pub(super) fn of_trees(mean: &[u8], counts: &[u8], samples: u32) -> Self {
        let discarded = texels(mean).iter().map(|&[.., discarded]| discarded).collect();
        Self { discarded: Some(discarded), ..Self::new(counts, samples) }
    }

    pub(super) fn of_paths(counts: &[u8], spread: &[u8], samples: u32) -> Self {
        let discarded = texels(counts).iter().map(|&[.., discarded, _]| discarded).collect();
        Self { discarded: Some(discarded), stderr: Some(errors(spread)), ..Self::new(counts, samples) }
    }

    /// Of `double`: each sample is a batch, and `mean` holds interfaces beside radiance.
    pub(super) fn of_samples(mean: &[u8], spread: &[u8]) -> Self {
        Self {
            discarded: None,
            stderr: Some(errors(spread)),
            interfaces: texels(mean).iter().map(|&[.., interfaces]| interfaces).collect(),
            rays: None,
        }
    }

    fn new(counts: &[u8], samples: u32) -> Self {
        let counts = texels(counts);
        let rays: f64 = counts.iter().map(|&[_, rays, ..]| f64::from(rays)).sum();
        Self {
            discarded: None,
            stderr: None,
            interfaces: counts.iter().map(|&[interfaces, ..]| interfaces).collect(),
            rays: Some((rays * f64::from(samples)).round() as u64),
        }
    }
}

/// What an error is relative to: the value, and as much that dark pixels do not count for all.
pub const DARK: f64 = 0.1;

/// The share of the pixels whose error a tolerance holds for.
pub const MOST_PIXELS: f64 = 0.95;

/// The share that standard errors should say so, since they are too small where light is rare: with 0.95, of ten scenes at a tolerance
/// of 0.1 the worst had 94.3 % (`benches/estimates.rs`).
pub const PIXELS_BY_STDERR: f64 = 0.965;

/// The mean over pixels and channels of standard error / (value + 0.1).
pub fn relative_error(radiance: &[[f32; 3]], stderr: &[[f32; 3]]) -> f64 {
    let errors: f64 = relative_errors(radiance, stderr).sum();
    errors / (3 * radiance.len()) as f64
}

/// The error / (value + 0.1) that `share` of the pixels, each channel for itself, are expected to be within: their errors are as if
/// drawn from normal distributions of these standard errors.
pub fn error_of(share: f64, radiance: &[[f32; 3]], stderr: &[[f32; 3]]) -> f64 {
    let errors: Vec<_> = relative_errors(radiance, stderr).collect();
    if errors.iter().any(|error| !error.is_finite()) {
        return f64::INFINITY;
    }
    let most = errors.iter().copied().fold(0.0, f64::max);
    // Within four times the largest are more than enough.
    let (mut low, mut high) = (0.0, 4.0 * most);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if share_within(&errors, middle) < share { low = middle } else { high = middle }
    }
    high
}

/// Whether a picture keeps a tolerance: [`relative_error`] is below it, and the error of [`MOST_PIXELS`].
pub fn is_within(radiance: &[[f32; 3]], stderr: &[[f32; 3]], tolerance: f64) -> bool {
    let errors: Vec<_> = relative_errors(radiance, stderr).collect();
    relative_error(radiance, stderr) < tolerance && share_within(&errors, tolerance) >= PIXELS_BY_STDERR
}

/// The share of normally distributed errors, of these standard deviations, that are expected to be within `bound`.
fn share_within(deviations: &[f64], bound: f64) -> f64 {
    let share = |&deviation: &f64| if deviation > 0.0 { erf(bound / (deviation * SQRT_2)) } else { 1.0 };
    deviations.iter().map(share).sum::<f64>() / deviations.len() as f64
}

fn relative_errors(radiance: &[[f32; 3]], stderr: &[[f32; 3]]) -> impl Iterator<Item = f64> {
    let pairs = radiance.iter().flatten().zip(stderr.iter().flatten());
    pairs.map(|(&value, &error)| f64::from(error) / (f64::from(value) + DARK))
}

/// [`is_within`] of images as the device has them.
pub(super) fn is_within_of(mean: &[u8], spread: &[u8], tolerance: f64) -> bool {
    let radiance: Vec<_> = texels(mean).into_iter().map(|[r, g, b, _]| [r, g, b]).collect();
    is_within(&radiance, &errors(spread), tolerance)
}

/// Standard errors of all pixels.
fn errors(spread: &[u8]) -> Vec<[f32; 3]> {
    texels(spread).into_iter().map(|texel| standard_error(texel).map(|error| error as f32)).collect()
}

/// Of the mean of independent batches, from the sum of their squared differences from it and their number. Scaled by what Student's t
/// is wider than a normal distribution: two standard errors hold as much, 95 %, of few batches as of many (E. A. Cornish & R. A. Fisher
/// 1937, the first terms of the quantile at 2 in the degrees of freedom).
fn standard_error([r, g, b, batches]: [f32; 4]) -> [f64; 3] {
    let batches = f64::from(batches);
    [r, g, b].map(|squares| match batches {
        1.0 => f64::INFINITY,
        _ => scale(batches - 1.0) * (f64::from(squares) / (batches * (batches - 1.0))).sqrt(),
    })
}

fn scale(freedom: f64) -> f64 {
    1.0 + 1.25 / freedom + 49.0 / 32.0 / (freedom * freedom)
}

fn texels(bytes: &[u8]) -> Vec<[f32; 4]> {
    pod_collect_to_vec(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tolerance_holds_for_most_pixels() {
        // Of one deviation 96.5 % are within 2.108 of it.
        let (ones, tenths) = (vec![[0.9; 3]; 100], vec![[0.1; 3]; 100]);
        assert!((error_of(0.965, &ones, &tenths) - 0.2108).abs() < 1e-4);
        assert!((relative_error(&ones, &tenths) - 0.1).abs() < 1e-6);
        assert!(is_within(&ones, &tenths, 0.212) && !is_within(&ones, &tenths, 0.210));
        // Few pixels may be as wrong as they like, but for the mean.
        let few = |error| (0..100).map(|i| [if i < 3 { error } else { 0.0 }; 3]).collect::<Vec<_>>();
        assert!(is_within(&ones, &few(1.0), 0.05) && !is_within(&ones, &few(1.0), 0.03));
        assert!(error_of(0.95, &ones, &few(f32::INFINITY)) == f64::INFINITY);
        assert!(!is_within(&ones, &few(f32::NAN), 0.1), "what is not known");
    }

    #[test]
    fn the_standard_error_is_that_of_a_textbook() {
        // 1, 2, 3, 4: variance 5/3, of the mean of four 5/12; two of three degrees of freedom hold 95.45 % out to 3.31.
        let [r, g, b] = standard_error([5.0, 0.0, 20.0, 4.0]);
        let plain = (5.0_f64 / 12.0).sqrt();
        assert!((r / plain - 3.31 / 2.0).abs() < 0.25 && r > plain && g == 0.0 && (b - 2.0 * r).abs() < 1e-12);
        assert_eq!(standard_error([0.0, 0.0, 0.0, 1.0]), [f64::INFINITY; 3]);
    }
}
