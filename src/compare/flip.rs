//! FLIP, the error that a viewer sees who flips between two images: from 0, none, to 1 in each pixel. In flow linear
//! Rec. 709 pixels, out flows a map.
//!
//! Andersson et al. 2020, "FLIP: A Difference Evaluator for Alternating Images", for display values, and Andersson et
//! al. 2021, "Visualizing and Communicating Errors in Rendered Images", for radiance. Constants are the papers'.

use std::f64::consts::PI;
use std::sync::LazyLock;

use glam::{DMat3, DVec3, Vec3};

use super::{is_finite, magma};
use crate::parallel;

/// A monitor of 3840 pixels and 0.7 m across, seen from 0.7 m: the default of NVIDIA's tool.
pub const PIXELS_PER_DEGREE: f64 = 3840.0 * PI / 180.0;

/// CIE D65.
const WHITE: [f64; 2] = [0.312_71, 0.329_02];
const PRIMARIES: [[f64; 2]; 3] = [[0.64, 0.33], [0.3, 0.6], [0.15, 0.06]];

/// Contrast sensitivity as sums of Gaussians, pairs of (a, b), of achromatic, red-green and blue-yellow (table 1).
const CONTRAST: [&[[f64; 2]]; 3] = [&[[1.0, 0.0047]], &[[1.0, 0.0053]], &[[34.1, 0.04], [13.5, 0.025]]];

/// Width in degrees of the edges and points that are looked for.
const FEATURE_WIDTH: f64 = 0.082;

/// Exponent of colour differences, and where their scale has its knee: at 0.4 of the largest, which becomes 0.95.
const COLOR_EXPONENT: f32 = 0.7;
const KNEE: f32 = 0.4;
const KNEE_ERROR: f32 = 0.95;

/// What the tone curve makes of the brightest pixel at the first exposure, and of the median at the last.
const TARGET: f64 = 0.85;

/// Rows that are worked on at a time.
const BAND: usize = 64;

/// The FLIP of each pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Flip {
    /// Row by row, 0 to 1; 1 where a pixel is not finite.
    pub map: Vec<f32>,
    /// The mean; NaN where a pixel is not finite, and for no pixels.
    pub mean: f64,
    /// The exposures that the map is the largest of; `None` for display values.
    pub exposures: Option<Exposures>,
}

/// Exposures from `start` to `stop` at equal distances, in stops.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Exposures {
    /// The darkest: the brightest pixel of the reference is just short of white.
    pub start: f64,
    /// The brightest: the median pixel is.
    pub stop: f64,
    /// How many.
    pub count: u32,
}

impl Flip {
    /// The map in the colours of magma, as sRGB: black where there is no error, pale yellow where it is 1.
    pub fn colors(&self) -> Vec<[u8; 3]> {
        self.map.iter().map(|&error| magma::color(error)).collect()
    }
}

/// LDR-FLIP. Pixels are display values, decoded to linear; what is outside of 0 to 1 is clamped.
///
/// # Panics
///
/// Where the slices are not of the same length, a multiple of `width`.
pub fn ldr(width: usize, test: &[[f32; 3]], reference: &[[f32; 3]]) -> Flip {
    flip(width, test, reference, None)
}

/// HDR-FLIP: the largest of LDR-FLIP over exposures that show everything from the reference's median to its maximum.
/// Pixels are radiance; negative radiance is shown as black.
///
/// # Panics
///
/// Where the slices are not of the same length, a multiple of `width`.
pub fn hdr(width: usize, test: &[[f32; 3]], reference: &[[f32; 3]]) -> Flip {
    flip(width, test, reference, Some(Exposures::of(reference)))
}

impl Exposures {
    /// Those for `reference`; pixels that are not finite are not looked at.
    pub fn of(reference: &[[f32; 3]]) -> Self {
        let luminance = |&[r, g, b]: &[f32; 3]| 0.2126 * f64::from(r) + 0.7152 * f64::from(g) + 0.0722 * f64::from(b);
        let mut luminances: Vec<f64> = reference.iter().filter(|pixel| is_finite(pixel)).map(luminance).collect();
        let middle = luminances.len() / 2;
        let (median, brightest) = if luminances.is_empty() {
            (0.0, 0.0)
        } else {
            let (_, &mut median, above) = luminances.select_nth_unstable_by(middle, f64::total_cmp);
            (median, above.iter().copied().fold(median, f64::max))
        };
        let white = aces_inverse(TARGET);
        // Black has no exposure at which it becomes bright; the floor is that of NVIDIA's tool.
        let stops = |luminance: f64| (white / luminance.max(f64::from(f32::EPSILON))).log2();
        let (start, stop) = (stops(brightest), stops(median));
        // One exposure is all where they would be equal.
        let count = if start < stop { (stop - start).ceil().max(2.0) as u32 } else { 1 };
        Self { start, stop, count }
    }

    fn factors(self) -> impl Iterator<Item = f32> {
        let step = (self.stop - self.start) / f64::from(self.count.max(2) - 1);
        (0..self.count).map(move |i| (self.start + f64::from(i) * step).exp2() as f32)
    }
}

/// The fit of the ACES tone curve by Narkowicz (2015), with the exposure of the original.
fn aces(radiance: f32) -> f32 {
    // White long before; prevents infinity over infinity.
    let x = (0.6 * radiance).clamp(0.0, 1e4);
    (x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14)).min(1.0)
}

/// The radiance that [`aces`] makes `value`, below 1, of.
fn aces_inverse(value: f64) -> f64 {
    let (a, b, c) = (2.51 - 2.43 * value, 0.03 - 0.59 * value, -0.14 * value);
    (-b + (b * b - 4.0 * a * c).sqrt()) / (2.0 * a) / 0.6
}

fn flip(width: usize, test: &[[f32; 3]], reference: &[[f32; 3]], exposures: Option<Exposures>) -> Flip {
    assert_eq!(test.len(), reference.len(), "images of one size");
    if test.is_empty() {
        return Flip { map: Vec::new(), mean: f64::NAN, exposures };
    }
    let height = test.len() / width;
    assert_eq!(test.len(), width * height, "whole rows");
    let views: Vec<View> = match exposures {
        Some(exposures) => exposures.factors().map(View::Exposed).collect(),
        None => vec![View::Display],
    };
    let bands: Vec<usize> = (0..height).step_by(BAND).collect();
    let images = [test, reference].map(|pixels| Image { width, height, pixels });
    let maps = parallel::map(parallel::threads(), bands, |top| {
        let rows = BAND.min(height - top);
        let mut worst = vec![0.0f32; rows * width];
        for view in &views {
            let [test, reference] = images.map(|image| Seen::new(image, *view, top, rows));
            for (i, worst) in worst.iter_mut().enumerate() {
                *worst = worst.max(test.difference(&reference, i));
            }
        }
        worst
    });
    let mut map = maps.concat();
    let mut mean = map.iter().map(|&error| f64::from(error)).sum::<f64>() / map.len() as f64;
    for (error, pixels) in map.iter_mut().zip(test.iter().zip(reference)) {
        if !is_finite(pixels.0) || !is_finite(pixels.1) {
            (*error, mean) = (1.0, f64::NAN);
        }
    }
    Flip { map, mean, exposures }
}

#[derive(Clone, Copy)]
struct Image<'a> {
    width: usize,
    height: usize,
    pixels: &'a [[f32; 3]],
}

/// How radiance becomes display values, linear ones.
#[derive(Clone, Copy)]
enum View {
    Display,
    /// Times a factor, under the tone curve.
    Exposed(f32),
}

impl View {
    fn show(self, pixel: &[f32; 3]) -> Vec3 {
        if !is_finite(pixel) {
            return Vec3::ZERO;
        }
        match self {
            Self::Display => Vec3::from_array(*pixel).clamp(Vec3::ZERO, Vec3::ONE),
            Self::Exposed(factor) => Vec3::from_array(pixel.map(|radiance| aces(factor * radiance))),
        }
    }
}

/// What the eye makes of rows of an image.
struct Seen {
    /// L*a*b* of the filtered image, after Hunt's adjustment.
    lab: Vec<Vec3>,
    /// How much of an edge and of a point there is.
    features: Vec<[f32; 2]>,
}

impl Seen {
    fn new(image: Image, view: View, top: usize, rows: usize) -> Self {
        let (filters, space) = (&*FILTERS, &*SPACE);
        let width = image.width;
        let reach = filters.reach;
        let mut planes = [(); 3].map(|()| Vec::with_capacity((rows + 2 * reach) * width));
        for row in 0..rows + 2 * reach {
            // The outermost pixels go on beyond the edges.
            let y = (top + row).saturating_sub(reach).min(image.height - 1);
            for pixel in &image.pixels[y * width..(y + 1) * width] {
                let opponent = space.opponent(view.show(pixel)).to_array();
                for (plane, value) in planes.iter_mut().zip(opponent) {
                    plane.push(value);
                }
            }
        }
        let filtered = [0, 1, 2].map(|channel: usize| {
            let mut sum = vec![0.0; rows * width];
            for (weight, kernel) in &filters.contrast[channel] {
                let across = kernel.across(&planes[channel], width);
                for (sum, value) in sum.iter_mut().zip(kernel.down(&across, width, reach)) {
                    *sum += weight * value;
                }
            }
            sum
        });
        let lab = (0..rows * width).map(|i| {
            let opponent = Vec3::from_array([0, 1, 2].map(|channel: usize| filtered[channel][i]));
            space.hunt_lab(space.linear(opponent).clamp(Vec3::ZERO, Vec3::ONE))
        });
        let lab = lab.collect();

        let gray: Vec<f32> = planes[0].iter().map(|achromatic| (achromatic + 16.0) / 116.0).collect();
        let smooth = filters.smooth.across(&gray, width);
        let feature = |kernel: &Kernel| {
            let x = filters.smooth.down(&kernel.across(&gray, width), width, reach);
            let y = kernel.down(&smooth, width, reach);
            x.into_iter().zip(y).map(|(x, y)| x.hypot(y)).collect::<Vec<f32>>()
        };
        let (edges, points) = (feature(&filters.edge), feature(&filters.point));
        let features = edges.into_iter().zip(points).map(|(edge, point)| [edge, point]).collect();
        Self { lab, features }
    }

    /// FLIP of pixel `i`: the colour difference, raised where features differ.
    fn difference(&self, reference: &Self, i: usize) -> f32 {
        let color = SPACE.error(hyab(self.lab[i], reference.lab[i]));
        if color == 0.0 {
            return 0.0;
        }
        let ([edge, point], [reference_edge, reference_point]) = (self.features[i], reference.features[i]);
        let feature = (edge - reference_edge).abs().max((point - reference_point).abs());
        // Up to 1: magnitudes reach the square root of 2.
        let feature = (feature * std::f32::consts::FRAC_1_SQRT_2).sqrt().min(1.0);
        color.powf(1.0 - feature)
    }
}

/// The colour difference of Abasi et al. 2020 for large ones: city-block in lightness, Euclidean in chroma.
fn hyab(a: Vec3, b: Vec3) -> f32 {
    let difference = a - b;
    difference.x.abs() + difference.y.hypot(difference.z)
}

/// Colour spaces: linear Rec. 709, YCxCz (opponent channels that filters act on), and L*a*b*.
struct Space {
    to_xyz: glam::Mat3,
    from_xyz: glam::Mat3,
    /// The largest colour difference, green to blue, to the power of [`COLOR_EXPONENT`].
    largest: f32,
}

static SPACE: LazyLock<Space> = LazyLock::new(Space::new);

impl Space {
    /// XYZ is relative to white: Rec. 709's (1, 1, 1) is (1, 1, 1).
    fn new() -> Self {
        let xyz = |[x, y]: [f64; 2]| DVec3::new(x / y, 1.0, (1.0 - x - y) / y);
        let white = xyz(WHITE);
        let [r, g, b] = PRIMARIES.map(|primary| xyz(primary) / white);
        let primaries = DMat3::from_cols(r, g, b);
        let to_xyz = primaries * DMat3::from_diagonal(primaries.inverse() * DVec3::ONE);
        let mut space = Self { to_xyz: to_xyz.as_mat3(), from_xyz: to_xyz.inverse().as_mat3(), largest: 1.0 };
        space.largest = hyab(space.hunt_lab(Vec3::Y), space.hunt_lab(Vec3::Z)).powf(COLOR_EXPONENT);
        space
    }

    fn opponent(&self, linear: Vec3) -> Vec3 {
        let Vec3 { x, y, z } = self.to_xyz * linear;
        Vec3::new(116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z))
    }

    fn linear(&self, opponent: Vec3) -> Vec3 {
        let y = (opponent.x + 16.0) / 116.0;
        self.from_xyz * Vec3::new(y + opponent.y / 500.0, y, y - opponent.z / 200.0)
    }

    /// L*a*b* with chroma in proportion to lightness (Hunt 1952: colours fade in the dark).
    fn hunt_lab(&self, linear: Vec3) -> Vec3 {
        const DELTA: f32 = 6.0 / 29.0;
        let root = |t: f32| {
            if t > DELTA * DELTA * DELTA { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
        };
        let [x, y, z] = (self.to_xyz * linear).to_array().map(root);
        let lightness = 116.0 * y - 16.0;
        Vec3::new(lightness, 5.0 * lightness * (x - y), 2.0 * lightness * (y - z))
    }

    /// A colour difference on the scale from 0 to 1: most of it for what is below the knee.
    fn error(&self, difference: f32) -> f32 {
        let (difference, knee) = (difference.powf(COLOR_EXPONENT), KNEE * self.largest);
        if difference < knee {
            KNEE_ERROR / knee * difference
        } else {
            (KNEE_ERROR + (difference - knee) / (self.largest - knee) * (1.0 - KNEE_ERROR)).min(1.0)
        }
    }
}

/// The filters, each a sum of products of one across and one down.
struct Filters {
    /// For each opponent channel kernels and their weights, which sum to 1.
    contrast: [Vec<(f32, Kernel)>; 3],
    /// A Gaussian.
    smooth: Kernel,
    /// Its first and its second derivative; what is positive in them sums to 1, what is negative to -1.
    edge: Kernel,
    point: Kernel,
    /// Pixels to each side that the widest one sees.
    reach: usize,
}

static FILTERS: LazyLock<Filters> = LazyLock::new(Filters::new);

impl Filters {
    fn new() -> Self {
        let widest = CONTRAST.concat().iter().map(|&[_, b]| b).fold(0.0, f64::max);
        let contrast_reach = (3.0 * (widest / (2.0 * PI * PI)).sqrt() * PIXELS_PER_DEGREE).ceil() as usize;
        let contrast = CONTRAST.map(|gaussians| {
            let parts = gaussians.iter().map(|&[a, b]| {
                let taps: Vec<f64> =
                    (0..=contrast_reach).map(|i| (-(PI * i as f64 / PIXELS_PER_DEGREE).powi(2) / b).exp()).collect();
                let sum = 2.0 * taps.iter().sum::<f64>() - taps[0];
                (a * (PI / b).sqrt() * sum * sum, Kernel::even(taps.iter().map(|tap| tap / sum)))
            });
            let parts: Vec<_> = parts.collect();
            let total: f64 = parts.iter().map(|(weight, _)| weight).sum();
            parts.into_iter().map(|(weight, kernel)| ((weight / total) as f32, kernel)).collect()
        });

        let deviation = 0.5 * FEATURE_WIDTH * PIXELS_PER_DEGREE;
        let feature_reach = (3.0 * deviation).ceil() as usize;
        let distances = || (0..=feature_reach).map(|i| i as f64 / deviation);
        let gaussian = |x: f64| (-0.5 * x * x).exp();
        let smooth: f64 = 2.0 * distances().map(gaussian).sum::<f64>() - 1.0;
        let slope = |x: f64| x * gaussian(x);
        let slopes: f64 = distances().map(slope).sum();
        let bend = |x: f64| (x * x - 1.0) * gaussian(x);
        // The middle is there once, every other distance on both sides.
        let both = |sign: f64| {
            let sum: f64 = distances().map(|x| if x > 0.0 { 2.0 } else { 1.0 } * (sign * bend(x)).max(0.0)).sum();
            move |x: f64| (sign * bend(x)).max(0.0) / sum
        };
        let (rising, falling) = (both(1.0), both(-1.0));
        Self {
            contrast,
            smooth: Kernel::even(distances().map(|x| gaussian(x) / smooth)),
            edge: Kernel::odd(distances().map(|x| slope(x) / slopes)),
            point: Kernel::even(distances().map(|x| rising(x) - falling(x))),
            reach: contrast_reach.max(feature_reach),
        }
    }
}

/// Taps of a filter in one dimension, from the middle outward.
struct Kernel {
    taps: Vec<f32>,
    /// 1 where the taps of both sides are equal, -1 where they are opposite.
    parity: f32,
}

impl Kernel {
    fn even(taps: impl Iterator<Item = f64>) -> Self {
        Self::new(taps, 1.0)
    }

    fn odd(taps: impl Iterator<Item = f64>) -> Self {
        Self::new(taps, -1.0)
    }

    /// Outer taps that no digit of 32 bits shows are left away.
    fn new(taps: impl Iterator<Item = f64>, parity: f32) -> Self {
        let mut taps: Vec<f32> = taps.map(|tap| tap as f32).collect();
        while taps.len() > 1 && taps.last().is_some_and(|tap| tap.abs() < 1e-9) {
            taps.pop();
        }
        Self { taps, parity }
    }

    /// Each row of `plane`, filtered; the outermost pixels go on beyond the edges.
    fn across(&self, plane: &[f32], width: usize) -> Vec<f32> {
        let reach = self.taps.len() - 1;
        let mut wide = vec![0.0; width + 2 * reach];
        let mut result = vec![0.0; plane.len()];
        for (row, result) in plane.chunks_exact(width).zip(result.chunks_exact_mut(width)) {
            wide[..reach].fill(row[0]);
            wide[reach..reach + width].copy_from_slice(row);
            wide[reach + width..].fill(row[width - 1]);
            self.add(result, |i| &wide[reach.wrapping_add_signed(i)..][..width]);
        }
        result
    }

    /// The columns of `plane`, filtered, without the first and last `margin` rows.
    fn down(&self, plane: &[f32], width: usize, margin: usize) -> Vec<f32> {
        let mut result = vec![0.0; plane.len() - 2 * margin * width];
        for (y, result) in result.chunks_exact_mut(width).enumerate() {
            self.add(result, |i| &plane[(y + margin).wrapping_add_signed(i) * width..][..width]);
        }
        result
    }

    /// Adds to `result` what the taps make of the rows that `shifted` gives for each offset.
    fn add<'a>(&self, result: &mut [f32], shifted: impl Fn(isize) -> &'a [f32]) {
        if self.parity > 0.0 {
            for (result, middle) in result.iter_mut().zip(shifted(0)) {
                *result += self.taps[0] * middle;
            }
        }
        for (i, &tap) in self.taps.iter().enumerate().skip(1) {
            let (before, after) = (shifted(-(i as isize)), shifted(i as isize));
            for ((result, before), after) in result.iter_mut().zip(before).zip(after) {
                *result += tap * (after + self.parity * before);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tone_curve_is_inverted() {
        for value in [0.01, 0.5, TARGET] {
            let back = f64::from(aces(aces_inverse(value) as f32));
            assert!((back - value).abs() < 1e-6, "{back}, not {value}");
        }
        assert_eq!((aces(0.0), aces(-1.0), aces(f32::MAX)), (0.0, 0.0, 1.0));
    }

    #[test]
    fn exposures_reach_from_the_maximum_to_the_median() {
        let gray = |values: &[f32]| Exposures::of(&values.iter().map(|&value| [value; 3]).collect::<Vec<_>>());
        let white = aces_inverse(TARGET);
        let found = gray(&[1.0, 64.0, 2.0, f32::NAN, 0.5, 1.0]);
        assert!((found.start - (white / 64.0).log2()).abs() < 1e-6 && (found.stop - white.log2()).abs() < 1e-6);
        assert_eq!(found.count, 6);
        let factors: Vec<_> = found.factors().collect();
        assert_eq!(factors.len(), 6);
        assert!((f64::from(factors[0]) - white / 64.0).abs() < 1e-6 && (f64::from(factors[5]) - white).abs() < 1e-6);
        // Of an even number the upper one is the median; less than two exposures show no range.
        let found = gray(&[1.0, 1.5]);
        assert_eq!((found.start, found.stop, found.count), ((white / 1.5).log2(), (white / 1.5).log2(), 1));
        assert_eq!(gray(&[1.0, 1.0, 1.5]).count, 2);
        // Black and nothing at all have exposures too.
        assert_eq!((gray(&[0.0; 4]).count, gray(&[]).count, gray(&[f32::NAN]).count), (1, 1, 1));
        assert!(gray(&[0.0; 4]).start.is_finite());
    }

    #[test]
    fn white_is_white_and_colors_come_back() {
        let white = SPACE.opponent(Vec3::ONE);
        assert!((white - Vec3::new(100.0, 0.0, 0.0)).abs().max_element() < 1e-4, "{white}");
        let color = Vec3::new(0.1, 0.7, 0.3);
        let back = SPACE.linear(SPACE.opponent(color));
        assert!((back - color).abs().max_element() < 1e-6, "{back}");
        let lab = SPACE.hunt_lab(Vec3::ONE);
        assert!((lab - Vec3::new(100.0, 0.0, 0.0)).abs().max_element() < 1e-3, "{lab}");
    }

    #[test]
    fn uniform_colors_differ_by_their_color_alone() {
        let (green, blue) = ([[0.0, 1.0, 0.0]; 40], [[0.0, 0.0, 1.0]; 40]);
        // The largest colour difference of all.
        assert!((ldr(8, &green, &blue).mean - 1.0).abs() < 1e-5);
        let (black, white) = ([[0.0; 3]; 40], [[1.0; 3]; 40]);
        let expected = SPACE.error(100.0);
        assert!(ldr(8, &black, &white).map.iter().all(|error| (error - expected).abs() < 1e-4));
        // Outside of what a display shows there is nothing to see.
        assert_eq!(ldr(8, &[[-3.0; 3]; 40], &black).mean, 0.0);
        assert_eq!(ldr(8, &[[7.0; 3]; 40], &white).mean, 0.0);
    }

    #[test]
    fn bands_leave_no_seams() {
        let height = 3 * BAND + 5;
        let column = |y: usize| [((y * y) % 97) as f32 / 97.0; 3];
        let (test, reference): (Vec<_>, Vec<_>) = (0..height).map(|y| (column(y), column(y + 1))).unzip();
        let tall = ldr(1, &test, &reference).map;
        let wide = ldr(height, &test, &reference).map;
        let apart = tall.iter().zip(&wide).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(apart < 1e-5, "{apart}");
    }

    #[test]
    fn no_pixels_have_no_mean() {
        assert!(hdr(0, &[], &[]).mean.is_nan());
    }
}
