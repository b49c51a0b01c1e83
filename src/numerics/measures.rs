//! How far a device's outputs are from what they should be.

use super::Function;

/// One evaluation.
#[derive(Clone, Copy)]
pub struct Case<'a> {
    /// As the device was given them.
    pub inputs: &'a [f32],
    /// What the device made of them.
    pub outputs: &'a [f32],
    /// What the reference makes of them.
    pub expected: &'a [f64],
}

/// An error of one evaluation.
#[derive(Clone, Copy)]
pub enum Measure {
    /// Of an output, by its column.
    Absolute(usize),
    /// Of an output, in units of the last place of what it should be.
    Ulp(usize),
    /// Of an output, relative to what it should be, or to the floor where that is less.
    Relative(usize, f64),
    /// The same; bounded is the mean.
    MeanRelative(usize, f64),
    /// 1 where an output, a decision, is not what it should be. Bounded is the share.
    Wrong(usize),
    /// How far the length of the vector that starts at a column is from 1; a vector of zeros is none.
    Length(usize),
    /// Something else.
    Other {
        /// Its name.
        name: &'static str,
        /// Whether the bound is on the mean, not on the worst.
        on_mean: bool,
        /// The error.
        error: fn(&Case) -> f64,
    },
}

impl Measure {
    /// Its name in tables.
    pub fn name(&self, function: &Function) -> String {
        let output = |i: &usize| function.outputs[*i];
        match self {
            Self::Absolute(i) => format!("{}, absolute", output(i)),
            Self::Ulp(i) => format!("{}, ULP", output(i)),
            Self::Relative(i, _) => format!("{}, relative", output(i)),
            Self::MeanRelative(i, _) => format!("{}, relative, mean", output(i)),
            Self::Wrong(i) => format!("{}, share wrong", output(i)),
            Self::Length(i) => format!("length of {}", output(i).trim_end_matches("_x")),
            Self::Other { name, .. } => (*name).into(),
        }
    }

    /// Whether the bound is on the mean, which of decisions is the share of wrong ones, not on the worst.
    pub fn is_mean(&self) -> bool {
        matches!(self, Self::Wrong(_) | Self::MeanRelative(..) | Self::Other { on_mean: true, .. })
    }

    /// The error of one evaluation, from 0; not a number only where an output is none.
    pub fn error(&self, case: &Case) -> f64 {
        let found = |i: usize| f64::from(case.outputs[i]);
        let expected = |i: usize| case.expected[i];
        match *self {
            Self::Absolute(i) => (found(i) - expected(i)).abs(),
            Self::Ulp(i) => ulps(case.outputs[i], expected(i)),
            Self::Relative(i, floor) | Self::MeanRelative(i, floor) => {
                (found(i) - expected(i)).abs() / expected(i).abs().max(floor)
            }
            Self::Wrong(i) => f64::from(u8::from(found(i) != expected(i))),
            Self::Length(i) => {
                let length = (i..i + 3).map(|i| found(i).powi(2)).sum::<f64>().sqrt();
                if length == 0.0 { 0.0 } else { (length - 1.0).abs() }
            }
            Self::Other { error, .. } => error(case),
        }
    }
}

/// The distance of `found` from `expected` in units of the last place that a 32-bit float as large as `expected` has. Vulkan lets
/// devices take numbers below the least normal one for 0.
pub fn ulps(found: f32, expected: f64) -> f64 {
    let least = f64::from(f32::MIN_POSITIVE);
    let size = (expected.abs() as f32).max(f32::MIN_POSITIVE);
    let ulp = f64::from(f32::from_bits(size.to_bits() + 1)) - f64::from(size);
    let difference = (f64::from(found) - expected).abs();
    if expected.abs() < least && f64::from(found.abs()) <= least { 0.0 } else { difference / ulp }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ulps_are_those_of_the_expected_value() {
        assert_eq!(ulps(1.0 + f32::EPSILON, 1.0), 1.0);
        assert_eq!(ulps(1.0 - f32::EPSILON, 1.0), 1.0);
        assert_eq!(ulps(4.0, 4.0 + 2.0 * f64::from(f32::EPSILON)), 0.5);
        assert_eq!(ulps(0.0, 1e-40), 0.0);
        assert!(ulps(f32::NAN, 1.0).is_nan());
    }
}
