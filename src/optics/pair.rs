//! Sums and products of two numbers, exact, as a pair of what 64 bits hold and what rounding lost: twice the digits where
//! terms nearly cancel.

use std::ops::{Add, Mul, Neg, Sub};

/// A number as an unevaluated sum of two, the second below the rounding error of the first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pair {
    pub(super) high: f64,
    pub(super) low: f64,
}

impl Pair {
    /// Knuth, TAOCP 2, 4.2.2.
    fn sum(a: f64, b: f64) -> Self {
        let high = a + b;
        let second = high - a;
        Self { high, low: (a - (high - second)) + (b - second) }
    }

    pub(super) fn product(a: f64, b: f64) -> Self {
        let high = a * b;
        Self { high, low: a.mul_add(b, -high) }
    }

    pub(super) fn value(self) -> f64 {
        self.high + self.low
    }

    /// By one Newton step.
    pub(super) fn sqrt(self) -> Self {
        let root = self.high.sqrt();
        if root == 0.0 {
            return Self::from(0.0);
        }
        let rest = self - Self::product(root, root);
        Self::sum(root, rest.value() / (2.0 * root))
    }
}

impl From<f64> for Pair {
    fn from(high: f64) -> Self {
        Self { high, low: 0.0 }
    }
}

impl Add for Pair {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        let high = Self::sum(self.high, other.high);
        let low = Self::sum(self.low, other.low);
        let first = Self::sum(high.high, high.low + low.high);
        Self::sum(first.high, first.low + low.low)
    }
}

impl Neg for Pair {
    type Output = Self;

    fn neg(self) -> Self {
        Self { high: -self.high, low: -self.low }
    }
}

impl Sub for Pair {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Pair {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let product = Self::product(self.high, other.high);
        Self::sum(product.high, product.low + self.high.mul_add(other.low, self.low * other.high))
    }
}
