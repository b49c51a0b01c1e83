//! What models count beside the light. In flow images as the device has them, out flows [`Counts`].

use bytemuck::allocation::pod_collect_to_vec;

/// Means over the samples of each pixel, row 0 at the top.
#[derive(Clone, Debug)]
pub struct Counts {
    /// Throughput that `tree` cut off.
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
        Self { stderr: Some(errors(spread)), ..Self::new(counts, samples) }
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

/// The mean over pixels and channels of standard error / (value + 0.1).
pub fn relative_error(radiance: &[[f32; 3]], stderr: &[[f32; 3]]) -> f64 {
    let pairs = radiance.iter().flatten().zip(stderr.iter().flatten());
    let errors: f64 = pairs.map(|(&value, &error)| f64::from(error) / (f64::from(value) + 0.1)).sum();
    errors / (3 * radiance.len()) as f64
}

/// The same of images as the device has them.
pub(super) fn relative_error_of(mean: &[u8], spread: &[u8]) -> f64 {
    let radiance: Vec<_> = texels(mean).into_iter().map(|[r, g, b, _]| [r, g, b]).collect();
    relative_error(&radiance, &errors(spread))
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
    fn the_standard_error_is_that_of_a_textbook() {
        // 1, 2, 3, 4: variance 5/3, of the mean of four 5/12; two of three degrees of freedom hold 95.45 % out to 3.31.
        let [r, g, b] = standard_error([5.0, 0.0, 20.0, 4.0]);
        let plain = (5.0_f64 / 12.0).sqrt();
        assert!((r / plain - 3.31 / 2.0).abs() < 0.25 && r > plain && g == 0.0 && (b - 2.0 * r).abs() < 1e-12);
        assert_eq!(standard_error([0.0, 0.0, 0.0, 1.0]), [f64::INFINITY; 3]);
    }
}
