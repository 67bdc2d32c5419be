//! Logarithms and exponentials without branches or tables, for loops that work on several numbers at once.
//!
//! A loop that calls them compiles to vector instructions where the machine has them; a call of the system's functions does
//! not. Only operations that IEEE 754 rounds exactly: the same bits on every path of [`super::simd`].

use std::f64::consts::{FRAC_1_SQRT_2, LOG2_E};

/// ln 2 in two parts, the first with 32 zero bits at its end.
const LN_2: [f64; 2] = [f64::from_bits(0x3fe6_2e42_fee0_0000), 1.908_214_929_270_587_7e-10];

/// Natural logarithm of a positive normal number, to 4e-16 of its value or 2e-16, whichever is larger.
#[inline(always)]
pub fn ln(x: f64) -> f64 {
    // x = m 2^e with m between the roots of 1/2 and 2; e + 1023 by way of a number 2^52 + it, as few machines convert integers
    const ONE: u64 = 1.0f64.to_bits();
    const TWO_52: f64 = 4_503_599_627_370_496.0;
    let shifted = x.to_bits().wrapping_add(ONE - FRAC_1_SQRT_2.to_bits()) >> 52;
    let e = f64::from_bits(TWO_52.to_bits() | shifted) - (TWO_52 + 1023.0);
    let m = f64::from_bits(x.to_bits().wrapping_sub(shifted << 52).wrapping_add(ONE));
    let f = (m - 1.0) / (m + 1.0);
    let s = f * f;
    let mut series = 1.0 / 19.0;
    for k in [17.0, 15.0, 13.0, 11.0, 9.0, 7.0, 5.0, 3.0] {
        series = series * s + 1.0 / k;
    }
    let tail = 2.0 * f * (s * series);
    e * LN_2[0] + (2.0 * f + (tail + e * LN_2[1]))
}

/// Exponential of x, to 4e-16 of its value; beyond -708 and 709 that of the bound, and NaN of NaN.
#[inline(always)]
pub fn exp(x: f64) -> f64 {
    // 1.5 x 2^52: adding it rounds to an integer, which stands in its last bits
    const ROUND: f64 = 6_755_399_441_055_744.0;
    let x = x.clamp(-708.0, 709.0);
    let shifted = x * LOG2_E + ROUND;
    let n = shifted - ROUND;
    let r = (x - n * LN_2[0]) - n * LN_2[1];
    let mut series = 1.0 / 6_227_020_800.0;
    for k in [479_001_600.0, 39_916_800.0, 3_628_800.0, 362_880.0, 40_320.0, 5040.0, 720.0, 120.0, 24.0, 6.0, 2.0]
    {
        series = series * r + 1.0 / k;
    }
    let power = f64::from_bits((shifted.to_bits() << 52).wrapping_add(1023 << 52));
    power * (1.0 + (r + r * r * series))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Places over the whole range, close ones about 1 included.
    fn places() -> impl Iterator<Item = f64> {
        (-20_000..20_000).map(|i| f64::from(i) * 0.035_37)
    }

    #[test]
    fn exponentials_are_those_of_libm() {
        for x in places() {
            let (found, exact) = (exp(x), libm::exp(x));
            assert!((found / exact - 1.0).abs() < 5e-16, "{x}: {found} against {exact}");
        }
        assert!(exp(f64::NAN).is_nan());
        assert_eq!(exp(0.0), 1.0);
        assert!(exp(f64::NEG_INFINITY) < 1e-300 && exp(f64::INFINITY) > 1e300);
    }

    #[test]
    fn logarithms_are_those_of_libm() {
        for x in places().map(libm::exp).chain((0..2000).map(|i| 0.5 + f64::from(i) * 0.000_91)) {
            let (found, exact) = (ln(x), libm::log(x));
            assert!((found - exact).abs() < 4e-16 * exact.abs() + 2e-16, "{x}: {found} against {exact}");
        }
        assert_eq!(ln(1.0), 0.0);
        assert_eq!(ln(f64::MIN_POSITIVE), libm::log(f64::MIN_POSITIVE));
    }
}
