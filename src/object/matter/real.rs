//! Numbers that may carry derivatives.
//!
//! A reflectance model is written once over [`Real`]. With `f64` it gives a value; with [`Dual<N>`] it also
//! gives the exact derivatives along N directions, by the rules
//!
//! ```text
//! (u + v)' = u' + v'      (u v)' = u' v + u v'      g(u)' = g'(u) u'
//! ```
//!
//! (forward mode: Griewank & Walther 2008, Evaluating Derivatives, ch. 3). Comparisons look at the value only,
//! so at a kink the derivative is that of the branch taken. Where a derivative is infinite (the square root and
//! a power at 0, the arc cosine at ±1) it is set to 0: no NaN enters a fit.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A real number, perhaps with derivatives. Transcendental functions go through `libm`: the same bits everywhere.
pub trait Real:
    Copy
    + From<f64>
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
{
    /// The number without its derivatives.
    fn value(self) -> f64;
    /// Square root; argument ≥ 0.
    fn sqrt(self) -> Self;
    /// e to this power.
    fn exp(self) -> Self;
    /// Natural logarithm; argument > 0.
    fn ln(self) -> Self;
    /// This number, ≥ 0, to a power ≥ 0; 0 to the power 0 is 1.
    fn powf(self, exponent: Self) -> Self;
    /// Arc cosine \[rad\]; arguments beyond ±1 count as ±1.
    fn acos(self) -> Self;

    /// The positive part.
    fn max0(self) -> Self {
        if self.value() > 0.0 { self } else { Self::from(0.0) }
    }

    /// The greater of two, by value.
    fn greater(self, other: Self) -> Self {
        if other.value() > self.value() { other } else { self }
    }

    /// The square.
    fn square(self) -> Self {
        self * self
    }

    /// The fifth power.
    fn fifth(self) -> Self {
        self.square().square() * self
    }
}

impl Real for f64 {
    fn value(self) -> f64 {
        self
    }
    fn sqrt(self) -> f64 {
        f64::sqrt(self)
    }
    fn exp(self) -> f64 {
        libm::exp(self)
    }
    fn ln(self) -> f64 {
        libm::log(self)
    }
    fn powf(self, exponent: f64) -> f64 {
        // e^(p ln x): cheaper than a power correctly rounded, and in error by no more than 1e-16 (1 + |p ln x|)
        match self > 0.0 {
            true => libm::exp(exponent * libm::log(self)),
            false if exponent == 0.0 => 1.0,
            false => 0.0,
        }
    }
    fn acos(self) -> f64 {
        libm::acos(self.clamp(-1.0, 1.0))
    }
}

/// A value and its derivatives along N directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dual<const N: usize> {
    /// The value.
    pub value: f64,
    /// The derivatives.
    pub derivative: [f64; N],
}

impl<const N: usize> Dual<N> {
    /// The i-th variable: derivative 1 along direction i, 0 along the others (all of them if i ≥ N).
    pub fn variable(value: f64, i: usize) -> Self {
        Dual { value, derivative: std::array::from_fn(|k| if k == i { 1.0 } else { 0.0 }) }
    }

    /// g(self) from the value g and the slope g'.
    fn chain(self, value: f64, slope: f64) -> Self {
        let slope = if slope.is_finite() { slope } else { 0.0 };
        Dual { value, derivative: self.derivative.map(|d| slope * d) }
    }

    /// g(self, other) from the value and the two partial slopes.
    fn chain2(self, other: Self, value: f64, slopes: (f64, f64)) -> Self {
        let (a, b) = (self.derivative, other.derivative);
        Dual { value, derivative: std::array::from_fn(|k| slopes.0 * a[k] + slopes.1 * b[k]) }
    }
}

impl<const N: usize> From<f64> for Dual<N> {
    fn from(value: f64) -> Self {
        Dual { value, derivative: [0.0; N] }
    }
}

impl<const N: usize> Neg for Dual<N> {
    type Output = Self;
    fn neg(self) -> Self {
        self.chain(-self.value, -1.0)
    }
}

/// One operator between duals, and between a dual and a constant.
macro_rules! operator {
    ($Op:ident, $op:ident, $value:expr, $slopes:expr) => {
        impl<const N: usize> $Op for Dual<N> {
            type Output = Self;
            fn $op(self, other: Self) -> Self {
                let (value, slopes): (fn(f64, f64) -> f64, fn(f64, f64) -> (f64, f64)) = ($value, $slopes);
                self.chain2(other, value(self.value, other.value), slopes(self.value, other.value))
            }
        }
        impl<const N: usize> $Op<f64> for Dual<N> {
            type Output = Self;
            fn $op(self, other: f64) -> Self {
                let (value, slopes): (fn(f64, f64) -> f64, fn(f64, f64) -> (f64, f64)) = ($value, $slopes);
                self.chain(value(self.value, other), slopes(self.value, other).0)
            }
        }
    };
}

operator!(Add, add, |a, b| a + b, |_, _| (1.0, 1.0));
operator!(Sub, sub, |a, b| a - b, |_, _| (1.0, -1.0));
operator!(Mul, mul, |a, b| a * b, |a, b| (b, a));
operator!(Div, div, |a, b| a / b, |a, b| (1.0 / b, -a / (b * b)));

impl<const N: usize> Real for Dual<N> {
    fn value(self) -> f64 {
        self.value
    }
    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.chain(root, 0.5 / root)
    }
    fn exp(self) -> Self {
        let value = libm::exp(self.value);
        self.chain(value, value)
    }
    fn ln(self) -> Self {
        self.chain(libm::log(self.value), 1.0 / self.value)
    }
    fn powf(self, exponent: Self) -> Self {
        let value = Real::powf(self.value, exponent.value);
        match self.value > 0.0 {
            true => {
                self.chain2(exponent, value, (exponent.value * value / self.value, value * libm::log(self.value)))
            }
            false => Self::from(value),
        }
    }
    fn acos(self) -> Self {
        self.chain(Real::acos(self.value), -1.0 / (1.0 - self.value * self.value).max(0.0).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn everything<T: Real>(x: T, y: T) -> T {
        let smooth = (x.exp() - y.ln()) / (x.square() + 1.5) * y.powf(x) + (x * 0.7).acos() * 2.0;
        -smooth + (y - 0.3).max0() / 3.0 + x.greater(y).fifth() + (x + y).sqrt() - 1.0
    }

    #[test]
    fn derivatives_are_those_of_central_differences() {
        for (x, y) in [(0.3, 0.8), (0.9, 0.2), (0.5, 1.7)] {
            let dual = everything(Dual::<2>::variable(x, 0), Dual::variable(y, 1));
            assert_eq!(dual.value, everything(x, y));
            let h = 1e-6;
            let dx = (everything(x + h, y) - everything(x - h, y)) / (2.0 * h);
            let dy = (everything(x, y + h) - everything(x, y - h)) / (2.0 * h);
            assert!((dual.derivative[0] - dx).abs() < 1e-8 && (dual.derivative[1] - dy).abs() < 1e-8);
        }
    }

    #[test]
    fn ends_of_the_domains_give_no_nan() {
        let zero = Dual::<1>::variable(0.0, 0);
        assert_eq!(zero.powf(Dual::from(0.0)).value, 1.0);
        for x in [zero.sqrt(), zero.powf(Dual::from(0.5)), (zero + 1.0).acos(), (zero - 1.0).acos()] {
            assert!(x.value.is_finite() && x.derivative[0].is_finite());
        }
    }
}
