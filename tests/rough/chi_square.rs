//! Whether counts are those of a distribution: Pearson's test.

use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Bins with fewer are put together.
const LEAST_EXPECTED: f64 = 10.0;

/// A test's outcome.
#[derive(Clone, Copy, Debug)]
pub struct Outcome {
    pub statistic: f64,
    pub freedom: usize,
    /// The probability of such a statistic, or a larger one, if the counts are those of the distribution.
    pub p: f64,
}

/// Compares counts; both sum to the same.
pub fn test(observed: &[f64], expected: &[f64]) -> Outcome {
    let mut bins: Vec<(f64, f64)> = observed.iter().copied().zip(expected.iter().copied()).collect();
    bins.sort_by(|a, b| a.1.total_cmp(&b.1));
    let mut merged: Vec<(f64, f64)> = Vec::new();
    let (mut seen, mut wanted) = (0.0, 0.0);
    for (observed, expected) in bins {
        seen += observed;
        wanted += expected;
        if wanted >= LEAST_EXPECTED {
            merged.push((seen, wanted));
            (seen, wanted) = (0.0, 0.0);
        }
    }
    // The last bin is the largest: a rest of 0 at most.
    assert!(seen == 0.0 && wanted == 0.0, "{seen} seen, {wanted} expected");
    let statistic = merged.iter().map(|(seen, wanted)| (seen - wanted).powi(2) / wanted).sum();
    let freedom = merged.len() - 1;
    let p = match freedom {
        0 => 1.0,
        _ => ChiSquared::new(freedom as f64).expect("a distribution").sf(statistic),
    };
    Outcome { statistic, freedom, p }
}

/// The level of each of `count` tests such that the chance of any to fail, while all is well, is `level`: Sidak 1967.
pub fn sidak(level: f64, count: usize) -> f64 {
    1.0 - (1.0 - level).powf(1.0 / count as f64)
}
