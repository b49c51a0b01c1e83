//! Every region of every function: what is the worst, where, and is it within bounds?

use fastrand::Rng;

use super::measures::Case;
use super::probe::CHUNK;
use super::regions::REGIONS;
use super::{Function, Measure, Probe, Region};
use crate::gpu::{Gpu, Result};
use crate::parallel;

/// Errors are kept by the angle of incidence, one bin a degree.
pub const ANGLES: usize = 90;

/// Evaluations that one thread generates or compares at a time. Each batch has a seed and a tally of its own, and tallies are merged
/// in order: results do not depend on how many threads there are.
const BATCH: usize = 1 << 13;

/// What one measure came to in one region.
#[derive(Clone, Debug)]
pub struct Finding {
    /// The function.
    pub function: &'static str,
    /// The region.
    pub region: &'static str,
    /// The measure.
    pub measure: String,
    /// What may come out; infinite: for comparison only.
    pub bound: f64,
    /// The bound is on the mean, which of decisions is the share of wrong ones, not on the worst.
    pub is_mean: bool,
    /// Evaluations.
    pub count: u64,
    /// The worst error; infinite where an output was not a number.
    pub worst: f64,
    /// The inputs that caused it, by the function's columns.
    pub cause: Vec<f32>,
    /// The mean error.
    pub mean: f64,
    /// The worst error by angle of incidence in degrees, where the function has one.
    pub by_angle: Option<Vec<f64>>,
}

impl Finding {
    /// What the bound is held against.
    pub fn found(&self) -> f64 {
        if self.is_mean { self.mean } else { self.worst }
    }

    /// Whether the bound holds.
    pub fn holds(&self) -> bool {
        self.found() <= self.bound
    }
}

/// What a region came to.
#[derive(Clone, Debug)]
pub struct RegionReport {
    /// The function.
    pub function: &'static str,
    /// The region.
    pub region: &'static str,
    /// Evaluations.
    pub count: u64,
    /// Outputs that were not finite.
    pub non_finite: u64,
    /// The inputs of one of them.
    pub non_finite_cause: Option<Vec<f32>>,
    /// One a measure.
    pub findings: Vec<Finding>,
}

/// How many regions `only`, or every function, has.
pub fn regions(only: Option<&str>) -> usize {
    selected(only).count()
}

fn selected(only: Option<&str>) -> impl Iterator<Item = &'static Region> {
    REGIONS.iter().filter(move |region| only.is_none_or(|name| region.function == name))
}

/// Tries `count` inputs in each region of the function called `only`, or of all. `progress` hears how many regions are done.
pub fn run(
    gpu: &Gpu,
    only: Option<&str>,
    count: u64,
    seed: u64,
    progress: &mut dyn FnMut(u64),
) -> Result<Vec<RegionReport>> {
    let mut reports = Vec::new();
    for (done, region) in (1..).zip(selected(only)) {
        if let Ok(function) = Function::named(region.function) {
            reports.push(try_region(gpu, function, region, count, seed)?);
        }
        progress(done);
    }
    Ok(reports)
}

fn try_region(gpu: &Gpu, function: &'static Function, region: &Region, count: u64, seed: u64) -> Result<RegionReport> {
    let mut probe = Probe::new(gpu, function)?;
    let threads = parallel::threads();
    let mut seeds = Rng::with_seed(seed);
    let mut all = Tally::new(region);
    let mut done = 0;
    while done < count {
        let now = (count - done).min(CHUNK as u64) as usize;
        let inputs = generate(function, region, now, &mut seeds, threads);
        let outputs = probe.evaluate(&inputs)?;
        all.merge(compare(function, region, &inputs, &outputs, threads));
        done += now as u64;
    }
    Ok(all.report(function, region))
}

fn generate(function: &Function, region: &Region, count: usize, seeds: &mut Rng, threads: usize) -> Vec<f32> {
    let columns = function.inputs.len();
    let mut inputs = vec![0.0; count * columns];
    let batches: Vec<_> = inputs.chunks_mut(BATCH * columns).map(|batch| (batch, seeds.u64(..))).collect();
    parallel::map(threads, batches, |(batch, seed)| {
        let mut rng = Rng::with_seed(seed);
        batch.chunks_mut(columns).for_each(|row| (region.generate)(&mut rng, row));
    });
    inputs
}

fn compare(function: &Function, region: &Region, inputs: &[f32], outputs: &[f32], threads: usize) -> Tally {
    let (columns, results) = (function.inputs.len(), function.outputs.len());
    let batches = inputs.chunks(BATCH * columns).zip(outputs.chunks(BATCH * results)).collect();
    let mut all = Tally::new(region);
    for part in parallel::map(threads, batches, |(inputs, outputs)| tally(function, region, inputs, outputs)) {
        all.merge(part);
    }
    all
}

fn tally(function: &Function, region: &Region, inputs: &[f32], outputs: &[f32]) -> Tally {
    let (columns, results) = (function.inputs.len(), function.outputs.len());
    let cosine = ["cos_i", "wi_z"].iter().find_map(|name| function.inputs.iter().position(|column| column == name));
    let mut tally = Tally::new(region);
    for (inputs, outputs) in inputs.chunks(columns).zip(outputs.chunks(results)) {
        tally.count += 1;
        let broken = outputs.iter().filter(|x| !x.is_finite()).count() as u64;
        if broken > 0 {
            tally.non_finite += broken;
            tally.non_finite_cause.get_or_insert_with(|| inputs.to_vec());
        }
        if region.bounds.is_empty() {
            continue;
        }
        let wide: Vec<f64> = inputs.iter().map(|&x| x.into()).collect();
        let expected = (function.reference)(&wide);
        let case = Case { inputs, outputs, expected: &expected };
        let bin = cosine.map(|column| {
            let degrees = wide[column].abs().min(1.0).acos().to_degrees();
            (degrees as usize).min(ANGLES - 1)
        });
        for ((measure, _), sum) in region.bounds.iter().zip(&mut tally.sums) {
            sum.add(measure.error(&case), inputs, bin);
        }
    }
    tally
}

/// Errors on their way to a report.
struct Tally {
    count: u64,
    non_finite: u64,
    non_finite_cause: Option<Vec<f32>>,
    sums: Vec<Sum>,
}

#[derive(Clone)]
struct Sum {
    worst: f64,
    cause: Vec<f32>,
    total: f64,
    by_angle: Option<Vec<f64>>,
}

impl Sum {
    fn add(&mut self, error: f64, inputs: &[f32], bin: Option<usize>) {
        let error = if error.is_nan() { f64::INFINITY } else { error };
        self.total += error;
        if error > self.worst || self.cause.is_empty() {
            self.worst = error;
            self.cause.clear();
            self.cause.extend_from_slice(inputs);
        }
        if let Some(bin) = bin {
            let worst = &mut self.by_angle.get_or_insert_with(|| vec![0.0; ANGLES])[bin];
            *worst = worst.max(error);
        }
    }

    fn merge(&mut self, other: Self) {
        self.total += other.total;
        if other.worst > self.worst || self.cause.is_empty() {
            (self.worst, self.cause) = (other.worst, other.cause);
        }
        match (&mut self.by_angle, other.by_angle) {
            (Some(mine), Some(theirs)) => mine.iter_mut().zip(theirs).for_each(|(a, b)| *a = a.max(b)),
            (mine @ None, theirs) => *mine = theirs,
            _ => {}
        }
    }
}

impl Tally {
    fn new(region: &Region) -> Self {
        let sum = Sum { worst: 0.0, cause: Vec::new(), total: 0.0, by_angle: None };
        Self { count: 0, non_finite: 0, non_finite_cause: None, sums: vec![sum; region.bounds.len()] }
    }

    fn merge(&mut self, other: Self) {
        self.count += other.count;
        self.non_finite += other.non_finite;
        self.non_finite_cause = self.non_finite_cause.take().or(other.non_finite_cause);
        self.sums.iter_mut().zip(other.sums).for_each(|(mine, theirs)| mine.merge(theirs));
    }

    fn report(self, function: &Function, region: &Region) -> RegionReport {
        let finding = |((measure, bound), sum): (&(Measure, f64), Sum)| Finding {
            function: region.function,
            region: region.name,
            measure: measure.name(function),
            bound: *bound,
            is_mean: measure.is_mean(),
            count: self.count,
            worst: sum.worst,
            cause: sum.cause,
            mean: sum.total / self.count.max(1) as f64,
            by_angle: sum.by_angle,
        };
        RegionReport {
            function: region.function,
            region: region.name,
            count: self.count,
            non_finite: self.non_finite,
            non_finite_cause: self.non_finite_cause,
            findings: region.bounds.iter().zip(self.sums).map(finding).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn items_keep_their_order() {
        for threads in [1, 3, 8] {
            assert_eq!(parallel::map(threads, (0..100).collect(), |i| 2 * i), (0..200).step_by(2).collect::<Vec<_>>());
        }
    }

    /// A device that only rounds: what the reference says, in 32 bits.
    fn rounded(function: &Function, inputs: &[f32]) -> Vec<f32> {
        let wide = |row: &[f32]| (function.reference)(&row.iter().map(|&x| x.into()).collect::<Vec<_>>());
        inputs.chunks(function.inputs.len()).flat_map(wide).map(|x| x as f32).collect()
    }

    #[test]
    fn reports_do_not_depend_on_the_number_of_threads() {
        let region = selected(Some("fresnel")).next().expect("a region");
        let function = Function::named(region.function).expect("a function");
        let reports = [1, 2, 5].map(|threads| {
            let inputs = generate(function, region, 3 * BATCH + 1, &mut Rng::with_seed(7), threads);
            let outputs = rounded(function, &inputs);
            compare(function, region, &inputs, &outputs, threads).report(function, region)
        });
        let texts = reports.each_ref().map(|report| format!("{report:?}"));
        assert!(texts[0] == texts[1] && texts[0] == texts[2]);
        let worst: Vec<_> = reports[0].findings[..3].iter().map(|finding| finding.worst).collect();
        assert!(worst[0] > 0.4 && worst[0] <= 0.5 && worst[2] <= 0.5, "{worst:?}");
    }

    #[test]
    fn every_region_is_one_of_a_function() {
        assert!(REGIONS.iter().all(|region| Function::named(region.function).is_ok()));
    }

    #[test]
    fn what_is_not_a_number_is_the_worst_and_counted() {
        let region = selected(Some("fresnel")).next().expect("a region");
        let function = Function::named(region.function).expect("a function");
        let inputs = generate(function, region, 10, &mut Rng::with_seed(0), 1);
        let mut outputs = rounded(function, &inputs);
        outputs[3 * 4] = f32::NAN;
        let report = compare(function, region, &inputs, &outputs, 1).report(function, region);
        assert_eq!((report.count, report.non_finite), (10, 1));
        assert_eq!(report.non_finite_cause.as_deref(), Some(&inputs[2 * 4..2 * 5]));
        assert_eq!(
            (report.findings[0].worst, &report.findings[0].cause),
            (f64::INFINITY, &inputs[2 * 4..2 * 5].to_vec())
        );
        assert!(!report.findings[0].holds() && report.findings[2].holds());
    }
}
