//! Where in a pixel its samples lie: low-discrepancy points under a box filter.

use glam::{DVec2, FloatExt as _};

use super::view;
use crate::gpu::SamplePush;
use crate::optics::spectrum::{self, WAVELENGTHS};
use crate::options::Model;
use crate::plan::{Budget, Plan};

/// 1 / golden ratio: its multiples fill an interval more evenly than those of any other number.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// 1 / g and 1 / g^2, where g^3 = g + 1: the same in two dimensions (M. Roberts, "The Unreasonable Effectiveness of
/// Quasirandom Sequences", 2018).
const PLASTIC: DVec2 = DVec2::new(0.754_877_666_246_692_8, 0.569_840_290_998_053_3);

/// Offsets from the pixel's centre in pixels, x to the right and y down, each within half a pixel. The same in every pixel: a frame is jittered as a whole.
///
/// With a known number of samples they form a lattice, else a sequence; a single sample lies at the centre. A seed
/// other than 0 moves them all, around the pixel's edges.
pub fn pixel_offsets(budget: Budget, seed: u64) -> Box<dyn Iterator<Item = DVec2> + Send> {
    let shift = shift(seed);
    let place = move |point: DVec2| (point + shift).fract_gl() - 0.5;
    match budget {
        Budget::Samples(count) => Box::new(
            (0..count)
                .map(move |i| place(DVec2::new((f64::from(i) + 0.5) / f64::from(count), 0.5 + f64::from(i) * GOLDEN))),
        ),
        Budget::Seconds { most, .. } => Box::new((0..most).map(move |i| place(0.5 + f64::from(i) * PLASTIC))),
    }
}

/// Samples that every pixel takes before the host hears of them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Round {
    /// What they tell the shaders.
    pub(super) push: SamplePush,
    /// How many they are.
    pub(super) samples: u32,
}

/// The rounds of a render, as many as it may have.
pub(super) fn rounds(plan: &Plan) -> Box<dyn Iterator<Item = Round> + Send> {
    let (budget, size, seed) = (plan.budget, plan.size, plan.seed);
    if plan.model == Model::Path {
        return Box::new(batches(budget));
    }
    let traces = plan.model.traces();
    let lit = move |push| if traces { footprint(spectrum(push, budget), budget) } else { push };
    let pushes = (0..).zip(pixel_offsets(budget, seed)).map(move |(i, offset)| view::sample_push(size, offset, i));
    Box::new(pushes.map(move |push| Round { push: lit(push), samples: 1 }))
}

/// Batches that the means of a pixel's samples should come from: what tells their standard error within a few per cent.
const BATCHES: u32 = 16;

/// Samples of a batch of `path` where it is not known how many there will be: it takes a multiple of them.
pub const OPEN_BATCH: u32 = 4;

/// Batches of samples that are as independent of each other as random ones: each pixel's samples fill its square and whatever else they
/// choose from evenly within a batch, so that the means of batches tell how far off theirs is. All of one size, a power of two.
fn batches(budget: Budget) -> impl Iterator<Item = Round> {
    let (count, most) = match budget {
        Budget::Samples(count) => (count, (count / BATCHES).max(1)),
        Budget::Seconds { most, .. } => (most, OPEN_BATCH),
    };
    let samples = (1 << most.ilog2()).min(1 << count.trailing_zeros());
    (0..count / samples).map(move |batch| {
        let push = SamplePush { sample_index: batch, samples_in_batch: samples, ..SamplePush::default() };
        Round { push, samples }
    })
}

/// How many batches the standard errors of a picture of `path` are from, with that many samples.
pub fn batches_of(plan: &Plan, samples: u32) -> u32 {
    batches(plan.budget).next().map_or(0, |round| samples / round.samples)
}

/// `push` with the wavelengths of its sample: those of all samples share the spectrum evenly.
fn spectrum(push: SamplePush, budget: Budget) -> SamplePush {
    let index = f64::from(push.sample_index);
    let shift = match budget {
        // Not in the order of the lattice's first axis, or wavelengths would go with places in the pixel.
        Budget::Samples(count) => {
            let count = f64::from(count);
            (((index * GOLDEN).fract_gl() * count).floor() + 0.5) / count
        }
        Budget::Seconds { .. } => (0.5 + index * GOLDEN).fract_gl(),
    };
    let spectrum = spectrum::lines(shift).map(|line| line.weight.extend(line.wavelength).as_vec4().to_array());
    SamplePush { wavelengths: WAVELENGTHS as u32, spectrum, ..push }
}

/// `push` with how wide its sample's share of the pixel is: the shares of all samples have the pixel's area, and where their number is
/// not known those of a sample and the ones before it.
fn footprint(push: SamplePush, budget: Budget) -> SamplePush {
    let count = match budget {
        Budget::Samples(count) => count,
        Budget::Seconds { .. } => push.sample_index + 1,
    };
    SamplePush { footprint: f64::from(count).sqrt().recip() as f32, ..push }
}

fn shift(seed: u64) -> DVec2 {
    if seed == 0 {
        return DVec2::ZERO;
    }
    DVec2::new(unit(scramble(seed)), unit(scramble(seed ^ 0x5851_f42d_4c95_7f2d)))
}

/// From 0 to below 1.
fn unit(bits: u64) -> f64 {
    (bits >> 11) as f64 / (1_u64 << 53) as f64
}

/// SplitMix64 (Steele, Lea & Flood 2014).
fn scramble(seed: u64) -> u64 {
    let mut bits = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ (bits >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lattice(count: u32, seed: u64) -> Vec<DVec2> {
        pixel_offsets(Budget::Samples(count), seed).collect()
    }

    #[test]
    fn one_sample_lies_at_the_centre() {
        assert_eq!(lattice(1, 0), [DVec2::ZERO]);
        let budget = Budget::Seconds { seconds: 1.0, most: 1 };
        assert_eq!(pixel_offsets(budget, 0).next(), Some(DVec2::ZERO));
    }

    #[test]
    fn samples_stay_in_the_pixel_and_balance() {
        for (count, seed) in [(1, 3), (4, 0), (16, 0), (64, 0), (1000, 7)] {
            let points = lattice(count, seed);
            assert!(points.iter().all(|p| p.abs().max_element() <= 0.5), "{count} {seed}");
            if seed == 0 {
                let mean = points.iter().sum::<DVec2>() / f64::from(count);
                assert!(mean.length() < 0.5 / f64::from(count), "{count}: mean {mean}");
            }
        }
    }

    /// The share of a pixel on one side of a random edge, against the truth: random points are several times worse.
    #[test]
    fn edges_are_antialiased_better_than_at_random() {
        let error = |points: &[DVec2]| {
            let edges = 1000;
            let sum: f64 = (0..edges)
                .map(|i| {
                    let angle = f64::from(i) * GOLDEN * std::f64::consts::TAU;
                    let normal = DVec2::from_angle(angle);
                    let inside = points.iter().filter(|p| p.dot(normal) < 0.0).count();
                    (inside as f64 / points.len() as f64 - 0.5).powi(2)
                })
                .sum();
            (sum / f64::from(edges)).sqrt()
        };
        // A random point falls on either side with probability 1/2: standard deviation 1 / (2 sqrt(n)).
        assert!(error(&lattice(16, 0)) < 0.5 * 0.125, "{}", error(&lattice(16, 0)));
        assert!(error(&lattice(64, 0)) < 0.4 * 0.0625, "{}", error(&lattice(64, 0)));
    }
}
