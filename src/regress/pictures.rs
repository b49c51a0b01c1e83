//! Pictures for the report. In flows radiance, out flow PNG: what a screen shows, and where two differ.

use crate::compare::magma;
use crate::image::{FloatImage, encode_png};
use crate::passes::DARK;

/// The powers of ten between which an error map goes from black to pale yellow.
const ERRORS: [f64; 2] = [-6.0, 0.0];

/// How much brighter than white a picture may be where it is shown, all but the brightest hundredth of it.
fn white(image: &FloatImage) -> f32 {
    let mut values: Vec<f32> = image.pixels.iter().flatten().copied().filter(|value| value.is_finite()).collect();
    values.sort_by(f32::total_cmp);
    values.get(values.len() * 99 / 100).copied().unwrap_or(1.0).max(1.0)
}

/// `image` in the colours of a screen, as bright as `like` is shown.
pub fn shown(image: &FloatImage, like: &FloatImage) -> std::io::Result<Vec<u8>> {
    let white = white(like);
    let code = |value: f32| {
        let value = (value / white).clamp(0.0, 1.0);
        let value = if value <= 0.003_130_8 { 12.92 * value } else { 1.055 * value.powf(1.0 / 2.4) - 0.055 };
        (255.0 * value).round() as u8
    };
    let pixels: Vec<_> = image.pixels.iter().map(|pixel| pixel.map(code)).collect();
    encode_png(image.width, image.height, &pixels, &[])
}

/// Where `test` differs from `reference`: the largest |x - r| / (|r| + 0.1) of the channels, its logarithm from 1e-6 to 1.
pub fn error(test: &FloatImage, reference: &FloatImage) -> std::io::Result<Vec<u8>> {
    let error = |(x, r): (&[f32; 3], &[f32; 3])| {
        let of = |(x, r): (&f32, &f32)| f64::from((x - r).abs()) / (f64::from(r.abs()) + DARK);
        let largest = x.iter().zip(r).map(of).fold(0.0, |a, b| if b > a || b.is_nan() { b } else { a });
        let place = (largest.log10() - ERRORS[0]) / (ERRORS[1] - ERRORS[0]);
        magma::color(if largest.is_nan() { 1.0 } else { place.clamp(0.0, 1.0) as f32 })
    };
    let pixels: Vec<_> = test.pixels.iter().zip(&reference.pixels).map(error).collect();
    encode_png(test.width, test.height, &pixels, &[])
}
