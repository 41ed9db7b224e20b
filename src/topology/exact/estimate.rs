//! A real number known up to a proven error: the floating point filter of the predicates.
//!
//! Running error analysis (Higham, Accuracy and Stability of Numerical Algorithms, 3.3): every
//! operation adds its rounding error, at most half a unit in the last place. A whole unit is
//! charged instead, and the sign test requires a little more, which covers the rounding of the
//! bounds themselves.

use std::cmp::Ordering;
use std::ops::{Add, Mul, Neg, Sub};

/// Twice the unit roundoff of f64.
const ROUNDING: f64 = f64::EPSILON;

/// Covers the rounding of error bounds over any chain of fewer than a thousand operations.
const BOUND_SLACK: f64 = 1.0 + 1e-12;

/// A number within `error` of `value`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Estimate {
    pub(super) value: f64,
    error: f64,
}

impl Estimate {
    /// An integer, rounded.
    pub(super) fn of(x: i128) -> Self {
        let value = x as f64;
        let error = if x.unsigned_abs() < 1 << 53 { 0.0 } else { value.abs() * ROUNDING };
        Estimate { value, error }
    }

    /// `a b - c d`: exact before one rounding wherever the products fit 128 bits.
    pub(super) fn minor(a: i128, b: i128, c: i128, d: i128) -> Self {
        let exact = a.checked_mul(b).zip(c.checked_mul(d)).and_then(|(x, y)| x.checked_sub(y));
        match exact {
            Some(x) => Estimate::of(x),
            None => Estimate::of(a) * Estimate::of(b) - Estimate::of(c) * Estimate::of(d),
        }
    }

    /// The sign of the number, or `None` where the error leaves it open.
    pub(super) fn sign(self) -> Option<Ordering> {
        if self.error == 0.0 || self.value.abs() > self.error * BOUND_SLACK {
            self.value.partial_cmp(&0.0)
        } else {
            None
        }
    }

    /// The square root of a number known to be positive.
    pub(super) fn sqrt(self) -> Self {
        let value = self.value.sqrt();
        // |sqrt(x) - sqrt(v)| = |x - v| / (sqrt(x) + sqrt(v)) <= |x - v| / sqrt(v).
        Estimate { value, error: self.error / value + value * ROUNDING }
    }
}

impl Add for Estimate {
    type Output = Estimate;
    fn add(self, other: Estimate) -> Estimate {
        let value = self.value + other.value;
        Estimate { value, error: self.error + other.error + value.abs() * ROUNDING }
    }
}

impl Sub for Estimate {
    type Output = Estimate;
    fn sub(self, other: Estimate) -> Estimate {
        self + -other
    }
}

impl Mul for Estimate {
    type Output = Estimate;
    fn mul(self, other: Estimate) -> Estimate {
        let value = self.value * other.value;
        let error = self.value.abs() * other.error
            + other.value.abs() * self.error
            + self.error * other.error
            + value.abs() * ROUNDING;
        Estimate { value, error }
    }
}

impl Neg for Estimate {
    type Output = Estimate;
    fn neg(self) -> Estimate {
        Estimate { value: -self.value, error: self.error }
    }
}
