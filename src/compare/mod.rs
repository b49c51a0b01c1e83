//! How far an image is from a reference. In flow pixels of both, out flow metrics and a map of FLIP.

pub mod flip;
mod limit;
pub(crate) mod magma;

pub use flip::{Exposures, Flip};
pub use limit::Limit;

use crate::image::{FloatImage, Stored};

/// Below its square root radiance counts as dark in relMSE: errors there weigh as absolute ones.
const DARK: f64 = 0.01;

/// A number that says how far two images are apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Metric {
    /// [`relmse`].
    Relmse,
    /// [`mse`].
    Mse,
    /// [`psnr`].
    Psnr,
    /// [`p99`].
    P99,
    /// The largest absolute difference of a channel.
    Max,
    /// The mean of FLIP.
    Flip,
}

impl Metric {
    /// All, in the order in which they are told.
    pub const ALL: [Self; 6] = [Self::Relmse, Self::Mse, Self::Psnr, Self::P99, Self::Max, Self::Flip];

    /// Its name on the command line and in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Relmse => "relmse",
            Self::Mse => "mse",
            Self::Psnr => "psnr",
            Self::P99 => "p99",
            Self::Max => "max",
            Self::Flip => "flip",
        }
    }
}

/// What [`compare`] found. Metrics are NaN or infinite where a pixel of either image is not finite; `psnr` is infinite
/// also for equal images.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// [`relmse`].
    pub relmse: f64,
    /// [`mse`].
    pub mse: f64,
    /// [`psnr`].
    pub psnr: f64,
    /// [`p99`].
    pub p99: f64,
    /// The largest absolute difference of a channel.
    pub max: f64,
    /// Column and row of the first pixel with that difference, or that is not finite.
    pub max_at: [u32; 2],
    /// FLIP, of display values where both images are stored as such, else of radiance.
    pub flip: Flip,
    /// Pixels with a value that is NaN or infinite.
    pub non_finite: NonFinite,
}

/// Pixels that are not finite.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct NonFinite {
    /// In the image under test.
    pub test: usize,
    /// In the reference.
    pub reference: usize,
}

impl Comparison {
    /// The value of `metric`.
    pub fn get(&self, metric: Metric) -> f64 {
        match metric {
            Metric::Relmse => self.relmse,
            Metric::Mse => self.mse,
            Metric::Psnr => self.psnr,
            Metric::P99 => self.p99,
            Metric::Max => self.max,
            Metric::Flip => self.flip.mean,
        }
    }

    /// FLIP in the colours of magma, as sRGB: black where there is no error, pale yellow where it is 1.
    pub fn error_map(&self) -> Vec<[u8; 3]> {
        self.flip.colors()
    }
}

/// Compares `test` with `reference`. Images that are not of one size have no metrics; both sizes come back in words.
pub fn compare(test: Stored, reference: Stored) -> Result<Comparison, String> {
    let display = matches!((&test, &reference), (Stored::Srgb { .. }, Stored::Srgb { .. }));
    let (test, reference) = (test.into_linear(), reference.into_linear());
    let size = |image: &FloatImage| format!("{}x{}", image.width, image.height);
    if size(&test) != size(&reference) {
        return Err(format!("{}, not {}", size(&test), size(&reference)));
    }
    let (width, height) = (reference.width, reference.height);
    let (test, reference) = (test.pixels, reference.pixels);
    let (max, at) = largest_difference(&test, &reference);
    let mse = mse(&test, &reference);
    let flip = if display { flip::ldr } else { flip::hdr };
    let non_finite = |pixels: &[[f32; 3]]| pixels.iter().filter(|pixel| !is_finite(pixel)).count();
    Ok(Comparison {
        width,
        height,
        relmse: relmse(&test, &reference),
        mse,
        psnr: psnr(mse),
        p99: p99(&test, &reference),
        max,
        max_at: [at as u32 % width, at as u32 / width],
        flip: flip(width as usize, &test, &reference),
        non_finite: NonFinite { test: non_finite(&test), reference: non_finite(&reference) },
    })
}

/// Relative mean squared error, mean((x - r)^2 / (r^2 + 0.01)) over pixels and channels, of linear values. NaN or
/// infinite where a pixel is not finite, NaN for no pixels.
///
/// # Panics
///
/// Where there are more pixels in one than in the other.
pub fn relmse(test: &[[f32; 3]], reference: &[[f32; 3]]) -> f64 {
    mean(test, reference, |x, r| (x - r) * (x - r) / (r * r + DARK))
}

/// Mean squared error over pixels and channels, of linear values. NaN or infinite where a pixel is not finite, NaN for
/// no pixels.
///
/// # Panics
///
/// Where there are more pixels in one than in the other.
pub fn mse(test: &[[f32; 3]], reference: &[[f32; 3]]) -> f64 {
    mean(test, reference, |x, r| (x - r) * (x - r))
}

/// Peak signal-to-noise ratio in dB, for a peak of 1; infinite where the error is 0.
pub fn psnr(mse: f64) -> f64 {
    -10.0 * mse.log10()
}

/// The |x - r| / (|r| + 0.1) that 99 % of the values keep, pixels and channels: blind to single pixels, such as those at edges that
/// rounding moves. NaN where a pixel is not finite and for no pixels.
///
/// # Panics
///
/// Where there are more pixels in one than in the other.
pub fn p99(test: &[[f32; 3]], reference: &[[f32; 3]]) -> f64 {
    assert_eq!(test.len(), reference.len(), "images of one size");
    let pairs = test.as_flattened().iter().zip(reference.as_flattened()).map(|(&x, &r)| (f64::from(x), f64::from(r)));
    let mut errors: Vec<f64> = pairs.map(|(x, r)| (x - r).abs() / (r.abs() + DARK.sqrt())).collect();
    if errors.iter().any(|error| !error.is_finite()) {
        return f64::NAN;
    }
    errors.sort_by(f64::total_cmp);
    let place = (0.99 * errors.len() as f64).ceil() as usize;
    errors.get(place.saturating_sub(1)).copied().unwrap_or(f64::NAN)
}

/// The largest absolute difference of a channel and the first pixel that has it; of pixels that are not finite the
/// first, and NaN.
fn largest_difference(test: &[[f32; 3]], reference: &[[f32; 3]]) -> (f64, usize) {
    let mut largest = (0.0, 0);
    for (i, (x, r)) in test.iter().zip(reference).enumerate() {
        if !is_finite(x) || !is_finite(r) {
            return (f64::NAN, i);
        }
        let difference = x.iter().zip(r).map(|(&x, &r)| (f64::from(x) - f64::from(r)).abs()).fold(0.0, f64::max);
        if difference > largest.0 {
            largest = (difference, i);
        }
    }
    largest
}

fn mean(test: &[[f32; 3]], reference: &[[f32; 3]], error: impl Fn(f64, f64) -> f64) -> f64 {
    assert_eq!(test.len(), reference.len(), "images of one size");
    let pairs = test.as_flattened().iter().zip(reference.as_flattened());
    pairs.map(|(&x, &r)| error(x.into(), r.into())).sum::<f64>() / (3 * test.len()) as f64
}

fn is_finite(pixel: &[f32; 3]) -> bool {
    pixel.iter().all(|value| value.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn linear(width: u32, height: u32, pixels: Vec<[f32; 3]>) -> Stored {
        Stored::Linear(FloatImage { width, height, pixels, layers: Vec::new() })
    }

    fn srgb(pixels: Vec<[u8; 3]>) -> Stored {
        Stored::Srgb { width: pixels.len() as u32, height: 1, pixels }
    }

    fn close(found: f64, expected: f64) {
        assert!((found - expected).abs() <= 1e-12 * expected.abs(), "{found}, not {expected}");
    }

    #[test]
    fn equal_images_have_no_error() {
        let image = || linear(2, 1, vec![[0.5, 2.0, 0.0], [1e6, 1e-6, 3.0]]);
        for found in
            [compare(image(), image()).unwrap(), compare(srgb(vec![[1, 2, 3]; 4]), srgb(vec![[1, 2, 3]; 4])).unwrap()]
        {
            for metric in [Metric::Relmse, Metric::Mse, Metric::P99, Metric::Max, Metric::Flip] {
                assert_eq!(found.get(metric), 0.0, "{}", metric.name());
            }
            assert_eq!((found.psnr, found.max_at), (f64::INFINITY, [0, 0]));
            assert_eq!(found.non_finite, NonFinite::default());
        }
    }

    #[test]
    fn metrics_are_those_by_hand() {
        let test = linear(2, 2, vec![[0.0; 3], [1.0, 0.5, 0.0], [0.0; 3], [2.0, 0.0, 0.0]]);
        let reference = linear(2, 2, vec![[0.0; 3], [0.5, 0.5, 0.0], [0.0; 3], [3.0, 0.25, 0.0]]);
        let found = compare(test, reference).unwrap();
        close(found.mse, (0.25 + 1.0 + 0.0625) / 12.0);
        close(found.relmse, (0.25 / 0.26 + 1.0 / 9.01 + 0.0625 / 0.0725) / 12.0);
        close(found.psnr, 10.0 * (12.0f64 / 1.3125).log10());
        assert_eq!((found.max, found.max_at), (1.0, [1, 1]));
        close(found.p99, 0.5 / 0.6);
        let (mut test, reference) = (vec![[1.01_f32; 3]; 100], vec![[1.0_f32; 3]; 100]);
        test[7] = [9.0; 3];
        assert!((p99(&test, &reference) - 0.01 / 1.1).abs() < 1e-6, "one pixel of a hundred counts for nothing");
        test[8][0] = 9.0;
        assert!(p99(&test, &reference) > 1.0);
    }

    #[test]
    fn the_reference_is_the_second() {
        let (dark, bright) = ([[1.0; 3]; 4], [[2.0; 3]; 4]);
        close(relmse(&dark, &bright), 1.0 / 4.01);
        close(relmse(&bright, &dark), 1.0 / 1.01);
    }

    #[test]
    fn display_values_are_decoded() {
        let found = compare(srgb(vec![[0; 3]]), srgb(vec![[188; 3]])).unwrap();
        assert!((found.max - 0.502_886_5).abs() < 1e-6 && found.flip.exposures.is_none());
        // One float is enough for radiance.
        let found = compare(srgb(vec![[0; 3]]), linear(1, 1, vec![[0.5; 3]])).unwrap();
        assert!(found.max == 0.5 && found.flip.exposures.is_some());
    }

    #[test]
    fn sizes_that_differ_are_named() {
        let image = |width, height| linear(width, height, vec![[0.0; 3]; 12]);
        assert_eq!(compare(image(3, 4), image(4, 3)).unwrap_err(), "3x4, not 4x3");
    }

    #[test]
    fn what_is_not_finite_leaves_no_metric_finite() {
        for wrong in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let good = vec![[0.5; 3], [1.0; 3], [0.25; 3]];
            let mut bad = good.clone();
            bad[1][2] = wrong;
            for (test, reference) in [(&bad, &good), (&good, &bad), (&bad, &bad)] {
                let found = compare(linear(3, 1, test.clone()), linear(3, 1, reference.clone())).unwrap();
                for metric in Metric::ALL {
                    assert!(!found.get(metric).is_finite(), "{} with {wrong}", metric.name());
                }
                assert_eq!(found.max_at, [1, 0]);
                let count = |pixels: &Vec<[f32; 3]>| usize::from(pixels == &bad || pixels[1][2].is_nan());
                assert_eq!(found.non_finite, NonFinite { test: count(test), reference: count(reference) });
                assert_eq!((found.flip.map[1], found.error_map()[1]), (1.0, magma::color(1.0)));
                for limit in ["relmse=1e300", "mse=1e300", "p99=1e300", "max=1e300", "flip=1"] {
                    assert!(limit.parse::<Limit>().unwrap().broken(&found).is_some(), "{limit} with {wrong}");
                }
            }
        }
    }

    #[test]
    fn numbers_at_the_ends_of_32_bits_overflow_nothing() {
        let found = compare(linear(2, 1, vec![[f32::MAX; 3]; 2]), linear(2, 1, vec![[-f32::MAX; 3]; 2])).unwrap();
        assert!(Metric::ALL.iter().all(|&metric| found.get(metric).is_finite()), "{found:?}");
        let black = compare(linear(1, 1, vec![[1e-30; 3]]), linear(1, 1, vec![[0.0; 3]])).unwrap();
        assert!(black.flip.mean < 1e-3, "{black:?}");
    }
}
