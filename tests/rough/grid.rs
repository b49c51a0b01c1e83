//! Samples of the device, and its densities, over a grid of interfaces and angles.
//!
//! Both sides of the comparison are in terms of directions of 32 bits: a sample counts for the facet that its rounded direction
//! stands for, and so does each point that the density is summed over. Next to index 1 it matters: at alpha 0.001 and index
//! 1.0003 the transmitted lobe is 3e-7 wide, ten directions across, and a bin may hold two of them, or one. Nor can the device be
//! asked for its density in between; there the 64-bit reference says by how much it differs from that at the next direction.

use std::num::NonZero;
use std::thread;

use fastrand::Rng;
use glam::DVec2;
use vitrum::gpu::Gpu;
use vitrum::numerics::{Function, Probe};

use crate::chi_square::{self, Outcome};
use crate::lobes::{Lobe, View, turns, wide};

/// Samples of a view.
pub const SAMPLES: usize = 1 << 17;

/// Bins along each coordinate of a lobe's facets.
const BINS: usize = 16;

/// Points that the density of a bin is summed over, a Fibonacci number, and the one before.
const POINTS: (usize, usize) = (144, 89);

/// The same for the bins of the steepest facets.
const STEEP_POINTS: (usize, usize) = (987, 610);

/// Views whose samples are held in memory at a time.
const BATCH: usize = 8;

/// Alpha, index and angle, from above and from below.
pub fn views() -> Vec<View> {
    let mut views = Vec::new();
    for alpha in [0.001, 0.01, 0.03, 0.1, 0.3, 1.0] {
        for eta in [1.0003, 1.33, 1.5, 2.42] {
            for leaving in [false, true] {
                for degrees in [0.0, 30.0, 60.0, 80.0, 89.0, 89.9] {
                    views.push(View { alpha, eta, leaving, degrees, turns: turns(views.len()) });
                }
            }
        }
    }
    views
}

/// What is made of the device's density before it is tested.
pub type Change = fn(&View, Lobe, DVec2, f64) -> f64;

/// What one view came to.
#[derive(Clone, Debug)]
pub struct Report {
    pub view: View,
    pub outcome: Outcome,
    /// The integral of the density over all directions.
    pub integral: f64,
    /// The share of samples that no light comes from.
    pub lost: f64,
    /// The largest weight in units of radiance's scale, and the mean of reflected and transmitted ones.
    pub largest_weight: f64,
    pub albedo: [f64; 2],
}

/// The device's functions.
pub struct Device {
    sample: Probe,
    eval: Probe,
}

impl Device {
    pub fn new(gpu: &Gpu) -> Self {
        let probe = |name| Probe::new(gpu, Function::named(name).expect("a function")).expect("a probe");
        Self { sample: probe("rough_sample"), eval: probe("rough_eval") }
    }

    /// Directions, weights and densities of [`sample_rows`].
    pub fn sample(&mut self, rows: &[f32]) -> Vec<f32> {
        self.sample.evaluate(rows).expect("the probe runs")
    }

    /// Values and densities of pairs of directions, alpha and index.
    pub fn eval(&mut self, rows: &[f32]) -> Vec<f32> {
        self.eval.evaluate(rows).expect("the probe runs")
    }

    /// Tests the samples of each view against the density, that of alpha times `factor`, changed.
    pub fn compare(&mut self, views: &[View], factor: f32, change: Change) -> Vec<Report> {
        let mut reports = Vec::new();
        for batch in views.chunks(BATCH) {
            let rows = in_parallel(batch, |view| (sample_rows(view, SAMPLES), Quadrature::new(view, factor)));
            let answer = |((rows, quadrature), view): ((Vec<f32>, Quadrature), _)| {
                let densities = self.eval(&quadrature.rows);
                (view, self.sample(&rows), quadrature, densities)
            };
            let answers: Vec<_> = rows.into_iter().zip(batch).map(answer).collect();
            reports.extend(in_parallel(&answers, |(view, samples, quadrature, densities)| {
                report(view, samples, quadrature, densities, change)
            }));
        }
        reports
    }
}

/// Calls `work` on all processors; results are in the order of the items.
pub fn in_parallel<T: Sync, R: Send>(items: &[T], work: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let threads = thread::available_parallelism().map_or(1, NonZero::get);
    let share = items.len().div_ceil(threads).max(1);
    let work = &work;
    thread::scope(|scope| {
        let handles: Vec<_> =
            items.chunks(share).map(|items| scope.spawn(move || items.iter().map(work).collect::<Vec<_>>())).collect();
        handles.into_iter().flat_map(|handle| handle.join().expect("no panic")).collect()
    })
}

/// Another for each view.
fn seed(view: &View) -> u64 {
    (view.turns * 1e12) as u64
}

/// Inputs of `rough_sample`.
pub fn sample_rows(view: &View, count: usize) -> Vec<f32> {
    let mut rng = Rng::with_seed(seed(view));
    let wi = view.wi();
    let row = |_| [wi[0], wi[1], wi[2], view.alpha, view.eta, rng.f32(), rng.f32(), rng.f32()];
    (0..count).flat_map(row).collect()
}

/// Points that the density is summed over, bin by bin, and inputs of `rough_eval` there.
struct Quadrature {
    rows: Vec<f32>,
    /// Of each row its bin, its lobe and facet, and the solid angle of directions that it stands for.
    points: Vec<(usize, Lobe, DVec2, f64)>,
}

fn bin(lobe: Lobe, facet: DVec2) -> usize {
    let place = |x: f64| ((x * BINS as f64) as usize).min(BINS - 1);
    (lobe as usize * BINS + place(facet.x)) * BINS + place(facet.y)
}

impl Quadrature {
    fn new(view: &View, factor: f32) -> Self {
        let interface = view.interface();
        let (device_wi, upright) = (view.wi(), view.upright_wi());
        let (length, wi) = (upright.length(), upright.normalize());
        let (mut rows, mut points) = (Vec::new(), Vec::new());
        for lobe in Lobe::BOTH {
            for (facet, area) in facets() {
                let Some((wo, spread)) = view.spread(wi, lobe, facet) else { continue };
                let rounded = (view.upright(wo) * length).as_vec3().to_array();
                let device_wo = view.upright(wide(&rounded));
                // A density changes within a rounding error if the lobe is as narrow as that. By how much, the reference says.
                let mut ratio = 1.0;
                if view.is_narrow() {
                    let (exact, near) = (interface.evaluate(wi, wo).pdf, interface.evaluate(upright, device_wo).pdf);
                    // None at the rounded direction: the device has none either.
                    ratio = if near > 0.0 { exact / near } else { 1.0 };
                }
                rows.extend(device_wi.iter().chain(&rounded));
                rows.extend([view.alpha * factor, view.eta]);
                let (_, seen) = view.facet(upright, device_wo);
                points.push((bin(lobe, seen), lobe, facet, spread * area * ratio));
            }
        }
        Self { rows, points }
    }
}

/// Facets, and the areas that they stand for: in each bin a Fibonacci lattice, which no edge runs along. In the last bins points
/// crowd where the first coordinate is close to 1: between facets that are steep and facets that stand upright lies all that
/// happens at grazing angles.
fn facets() -> impl Iterator<Item = (DVec2, f64)> {
    let bins = (0..BINS * BINS).map(|i| DVec2::new((i / BINS) as f64, (i % BINS) as f64));
    bins.flat_map(|corner| {
        let is_last = corner.x + 1.0 == BINS as f64;
        let (count, step) = if is_last { STEEP_POINTS } else { POINTS };
        (0..count).map(move |i| {
            let mut place =
                DVec2::new((i as f64 + 0.5) / count as f64, (((i * step) as f64 + 0.5) / count as f64).fract());
            let mut area = 1.0 / (BINS * BINS * count) as f64;
            if is_last {
                let left = 1.0 - place.x;
                place.x = 1.0 - left.powi(3);
                area *= 3.0 * left * left;
            }
            ((corner + place) / BINS as f64, area)
        })
    })
}

fn report(view: &View, samples: &[f32], quadrature: &Quadrature, densities: &[f32], change: Change) -> Report {
    let bins = 2 * BINS * BINS;
    // One more for what is lost.
    let (mut observed, mut expected) = (vec![0.0; bins + 1], vec![0.0; bins + 1]);
    for (found, &(bin, lobe, facet, angle)) in densities.chunks(2).zip(&quadrature.points) {
        expected[bin] += change(view, lobe, facet, found[1].into()) * angle;
    }
    let integral: f64 = expected.iter().sum();
    expected[bins] = (1.0 - integral).max(0.0);
    expected.iter_mut().for_each(|share| *share *= SAMPLES as f64);

    let wi = view.upright_wi();
    let scale = (view.interface().eta_i / view.interface().eta_t).powi(2);
    let (mut largest_weight, mut albedo) = (0.0_f64, [0.0; 2]);
    for found in samples.chunks(5) {
        if found[3] == 0.0 {
            observed[bins] += 1.0;
            continue;
        }
        let (lobe, facet) = view.facet(wi, view.upright(wide(found)));
        observed[bin(lobe, facet)] += 1.0;
        let weight = f64::from(found[3]) / if lobe == Lobe::Reflected { 1.0 } else { scale };
        largest_weight = largest_weight.max(weight);
        albedo[lobe as usize] += weight / SAMPLES as f64;
    }
    let outcome = chi_square::test(&observed, &expected);
    Report { view: *view, outcome, integral, lost: observed[bins] / SAMPLES as f64, largest_weight, albedo }
}
