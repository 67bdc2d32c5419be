//! Samplers: uniform and normal deviates from addressed random bits; Poisson counts are in [`super::poisson`].
//!
//! All of them use only integer arithmetic, the four operations, square roots and the `libm` crate, so that
//! every x86-64 machine draws the same numbers. Runs of pixels are drawn block by block, so that bits and quantiles are
//! computed side by side.

use super::random::Address;

/// Pixels drawn side by side.
pub(super) const BLOCK: usize = 64;

/// A uniform deviate inside (0, 1), never 0 nor 1, with 52 random bits.
#[inline(always)]
pub fn uniform(word: u64) -> f64 {
    ((word >> 12) as f64 + 0.5) * (1.0 / (1u64 << 52) as f64)
}

/// The standard normal deviate whose cumulative probability is `p` in (0, 1).
///
/// Wichura 1988, Appl. Stat. 37, 477, algorithm AS 241 (PPND16): relative error about 1e-16.
#[inline]
pub fn normal_quantile(p: f64) -> f64 {
    let q = p - 0.5;
    if q.abs() <= 0.425 {
        let r = 0.180625 - q * q;
        return q * ratio(r, &CENTRE);
    }
    let tail = if q < 0.0 { p } else { 1.0 - p };
    let r = (-libm::log(tail)).sqrt();
    let z = if r <= 5.0 { ratio(r - 1.6, &MIDDLE) } else { ratio(r - 5.0, &FAR) };
    if q < 0.0 { -z } else { z }
}

/// Numerator and denominator coefficients, highest power first.
type Rational = [[f64; 8]; 2];

#[inline(always)]
fn ratio(x: f64, coefficients: &Rational) -> f64 {
    let horner = |c: &[f64; 8]| c.iter().fold(0.0, |sum, a| sum * x + a);
    horner(&coefficients[0]) / horner(&coefficients[1])
}

const CENTRE: Rational = [
    [
        2.509_080_928_730_122_7e3,
        3.343_057_558_358_813e4,
        6.726_577_092_700_87e4,
        4.592_195_393_154_987e4,
        1.373_169_376_550_946_2e4,
        1.971_590_950_306_551_3e3,
        1.331_416_678_917_843_8e2,
        3.387_132_872_796_366_5,
    ],
    [
        5.226_495_278_852_854e3,
        2.872_908_573_572_194_3e4,
        3.930_789_580_009_271e4,
        2.121_379_430_158_659_7e4,
        5.394_196_021_424_751e3,
        6.871_870_074_920_579e2,
        4.231_333_070_160_091e1,
        1.0,
    ],
];
const MIDDLE: Rational = [
    [
        7.745_450_142_783_414e-4,
        2.272_384_498_926_918_4e-2,
        2.417_807_251_774_506e-1,
        1.270_458_252_452_368_4,
        3.647_848_324_763_204_5,
        5.769_497_221_460_691,
        4.630_337_846_156_546,
        1.423_437_110_749_683_5,
    ],
    [
        1.050_750_071_644_416_9e-9,
        5.475_938_084_995_345e-4,
        1.519_866_656_361_645_7e-2,
        1.481_039_764_274_800_8e-1,
        6.897_673_349_851e-1,
        1.676_384_830_183_803_8,
        2.053_191_626_637_759,
        1.0,
    ],
];
const FAR: Rational = [
    [
        2.010_334_399_292_288_1e-7,
        2.711_555_568_743_487_6e-5,
        1.242_660_947_388_078_4e-3,
        2.653_218_952_657_612_4e-2,
        2.965_605_718_285_048_7e-1,
        1.784_826_539_917_291_3,
        5.463_784_911_164_114,
        6.657_904_643_501_103,
    ],
    [
        2.044_263_103_389_939_8e-15,
        1.421_511_758_316_446e-7,
        1.846_318_317_510_054_8e-5,
        7.868_691_311_456_133e-4,
        1.487_536_129_085_061_5e-2,
        1.369_298_809_227_358e-1,
        5.998_322_065_558_88e-1,
        1.0,
    ],
];

/// A standard normal deviate of `pixel`.
#[inline]
pub fn normal(address: &Address, pixel: u64) -> f64 {
    normal_quantile(uniform(address.block(pixel, 0)[0]))
}

/// One uniform deviate for each pixel from `first` on.
fn uniforms(address: &Address, first: u64, out: &mut [f64]) {
    for (pixel, u) in (first..).zip(out) {
        *u = uniform(address.block(pixel, 0)[0]);
    }
}

/// Add `sigma` times a standard normal deviate to each of `values`; their pixels are numbered from `first` on. The
/// deviates are those of [`normal`].
pub fn add_normal(address: &Address, first: u64, sigma: f64, values: &mut [f64]) {
    let mut u = [0.0; BLOCK];
    let mut z = [0.0; BLOCK];
    for (block, values) in values.chunks_mut(BLOCK).enumerate() {
        let (u, z) = (&mut u[..values.len()], &mut z[..values.len()]);
        uniforms(address, first + (block * BLOCK) as u64, u);
        for (z, u) in z.iter_mut().zip(&*u) {
            let q = u - 0.5;
            *z = q * ratio(0.180625 - q * q, &CENTRE);
        }
        for ((value, z), u) in values.iter_mut().zip(&*z).zip(&*u) {
            *value += sigma * if (u - 0.5).abs() <= 0.425 { *z } else { normal_quantile(*u) };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::random::Stage;

    const SHOT: Address = Address { seed: 42, frame: 0, stage: Stage::Shot };

    /// Hand-worked: the 97.5 % point of the normal distribution, and its mirror.
    #[test]
    fn normal_quantile_at_tabulated_points() {
        for (p, z) in [(0.5, 0.0), (0.975, 1.959_963_984_540_054), (1e-10, -6.361_340_902_404_056)] {
            assert!((normal_quantile(p) - z).abs() < 1e-12, "{p}: {}", normal_quantile(p));
        }
        assert!((normal_quantile(0.9) + normal_quantile(0.1)).abs() < 1e-15);
    }

    #[test]
    fn normal_deviates_have_the_moments_of_a_normal_distribution() {
        let n = 1_000_000u64;
        let mut moments = [0.0; 4];
        for pixel in 0..n {
            let z = normal(&SHOT, pixel);
            let mut power = 1.0;
            for moment in &mut moments {
                power *= z;
                *moment += power / n as f64;
            }
        }
        // standard errors of the moments: 1, sqrt 2, sqrt 15, sqrt 96 over sqrt n; 4.5 sigma
        for (moment, (expected, variance)) in
            moments.iter().zip([(0.0, 1.0), (1.0, 2.0), (0.0, 15.0), (3.0, 96.0f64)])
        {
            let allowed = 4.5 * (variance / n as f64).sqrt();
            assert!((moment - expected).abs() < allowed, "{moment} against {expected} +- {allowed}");
        }
    }

    #[test]
    fn runs_of_pixels_draw_what_each_pixel_draws() {
        let mut noise = vec![3.0; 1000];
        add_normal(&SHOT, 77, 2.0, &mut noise);
        for (i, value) in noise.iter().enumerate() {
            assert_eq!(*value, 3.0 + 2.0 * normal(&SHOT, 77 + i as u64));
        }
    }
}
