//! Samplers: uniform and normal deviates from addressed random bits; Poisson counts are in [`super::poisson`].
//!
//! All of them use only integer arithmetic, the four operations, square roots and the `libm` crate, so that
//! every x86-64 machine draws the same numbers. The pixels of a frame are drawn chunk by chunk, so that bits and quantiles
//! are computed side by side, in the instructions of the machine ([`super::simd`]).

use super::random::{Address, CHUNK};
use super::simd::Path;

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

/// A standard normal deviate of `pixel` of its own block: for objects, not for the pixels of a frame.
#[inline]
pub fn normal(address: &Address, pixel: u64) -> f64 {
    normal_quantile(uniform(address.block(pixel, 0)[0]))
}

/// Where the series of [`quantiles`] ends: t = -ln(1 - x^2), x = 2 p - 1; 3.76 standard deviations, beyond which lies 1.7e-4.
const FARTHEST: f32 = 8.0;

/// Normal quantiles of the words of a chunk, in single precision: |error| < 4e-7 of the quantile, and true for those that lie
/// too far out for it (1.7e-4 of them).
///
/// z/x is a polynomial in t - 4, fitted to the quantile by least maximum error (9e-8).
#[inline(always)]
pub(super) fn quantiles(words: &[u32; CHUNK]) -> ([f32; CHUNK], [bool; CHUNK]) {
    #[rustfmt::skip]
    const SERIES: [f32; 11] = [
        5.538_620_8e-10, -6.931_89e-10, -4.949_061_3e-8, 2.966_969_7e-7, 7.115_694_3e-7, -2.223_718_4e-5, 1.679_916_2e-4,
        -2.876_69e-4, -1.021_186_6e-2, 0.322_941_7, 2.628_710_5,
    ];
    let mut z = [0.0; CHUNK];
    let mut far = [false; CHUNK];
    for i in 0..CHUNK {
        let word = words[i];
        let x = ((word ^ 0x8000_0000) as i32 as f32 + 0.5) * (1.0 / 2_147_483_648.0);
        let nearer = if word < !word { word } else { !word };
        let tail = (nearer as i32 as f32 + 0.5) * (1.0 / 2_147_483_648.0);
        let t = -ln(tail * (2.0 - tail));
        far[i] = t > FARTHEST;
        let t = if far[i] { FARTHEST } else { t } - 4.0;
        let mut series = SERIES[0];
        for c in &SERIES[1..] {
            series = series * t + c;
        }
        z[i] = x * series;
    }
    (z, far)
}

/// Natural logarithm of a normal positive number, relative error below 2e-7; without branches.
#[inline(always)]
fn ln(x: f32) -> f32 {
    const SERIES: [f32; 7] =
        [0.089_178_67, -0.143_502, 0.148_769_62, -0.165_656_35, 0.199_653_98, -0.250_017_47, 0.333_338_6];
    // x = m 2^e with m between the roots of 1/2 and 2
    let e = (x.to_bits() as i32 - 0x3f35_04f3) >> 23;
    let f = f32::from_bits((x.to_bits() as i32 - (e << 23)) as u32) - 1.0;
    let mut series = SERIES[0];
    for c in &SERIES[1..] {
        series = series * f + c;
    }
    let f2 = f * f;
    (f2 * f * series - 0.5 * f2) + f + e as f32 * std::f32::consts::LN_2
}

/// The reference twin: the normal quantile of a word of 64 bits, in both tails to full relative precision.
pub(super) fn normal_at(word: u64) -> f64 {
    let share = |word: u64| (word as f64 + 0.5) * (1.0 / 18_446_744_073_709_551_616.0);
    if word >> 63 == 0 { normal_quantile(share(word)) } else { -normal_quantile(share(!word)) }
}

/// Hand the pixels numbered from `first` on to `work`, chunk by chunk: the chunk's number, the place in it of its first
/// pixel handed over, and the pixels.
#[inline(always)]
pub(super) fn by_chunks(first: u64, mut pixels: &mut [f64], mut work: impl FnMut(u64, usize, &mut [f64])) {
    let mut pixel = first;
    while !pixels.is_empty() {
        let offset = (pixel % CHUNK as u64) as usize;
        let (now, later) = pixels.split_at_mut((CHUNK - offset).min(pixels.len()));
        work(pixel / CHUNK as u64, offset, now);
        pixel += now.len() as u64;
        pixels = later;
    }
}

/// Add `sigma` times a standard normal deviate to each of `values`; their pixels are numbered from `first` on. A deviate
/// has 64 random bits, of which the centre uses 32, and a relative error below 4e-7.
pub fn add_normal(address: &Address, first: u64, sigma: f64, values: &mut [f64]) {
    add_normal_on(Path::best(), address, first, sigma, values);
}

pub(super) fn add_normal_on(path: Path, address: &Address, first: u64, sigma: f64, values: &mut [f64]) {
    path.run(
        #[inline(always)]
        || {
            by_chunks(
                first,
                values,
                #[inline(always)]
                |chunk, offset, values: &mut [f64]| {
                    let words = address.chunk(chunk);
                    let (mut z, far) = quantiles(&words);
                    each_true(
                        &far,
                        #[inline(always)]
                        |i| {
                            let pixel = chunk * CHUNK as u64 + i as u64;
                            z[i] = normal_at(address.extended(pixel, words[i])) as f32;
                        },
                    );
                    for (value, z) in values.iter_mut().zip(&z[offset..]) {
                        *value += sigma * f64::from(*z);
                    }
                },
            );
        },
    );
}

/// Call `work` with the places of the true ones.
#[inline(always)]
pub(super) fn each_true(flags: &[bool; CHUNK], mut work: impl FnMut(usize)) {
    for (eighth, flags) in flags.as_chunks::<8>().0.iter().enumerate() {
        // eight at once
        let mut set = u64::from_le_bytes(flags.map(u8::from));
        while set != 0 {
            work(eighth * 8 + set.trailing_zeros() as usize / 8);
            set &= set - 1;
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

    /// Each deviate by the series against Wichura's quantile of 64 bits: 4e-7 of it, and exact far out; the same on every
    /// path, wherever a run begins.
    #[test]
    fn deviates_of_pixels_are_the_quantiles_of_their_bits() {
        let n = 300_000;
        let mut all = vec![0.0; n];
        add_normal_on(Path::Baseline, &SHOT, 0, 1.0, &mut all);
        let (mut worst, mut farthest) = (0.0f64, 0.0f64);
        for (pixel, z) in (0u64..).zip(&all) {
            let word = SHOT.chunk(pixel / 64)[pixel as usize % 64];
            let exact = normal_at(SHOT.extended(pixel, word));
            worst = worst.max((z / exact - 1.0).abs().min((z - exact).abs() * 1e3));
            farthest = farthest.max(z.abs());
        }
        assert!(worst < 4e-7 && farthest > 4.2, "{worst:e} {farthest}");
        for path in Path::all() {
            for (first, length) in [(0, n), (1, 1), (63, 2), (77, 1000), (64, 64), (129, 63)] {
                let mut part = vec![0.0; length];
                add_normal_on(path, &SHOT, first as u64, 1.0, &mut part);
                assert!(
                    part.iter().zip(&all[first..]).all(|(a, b)| a.to_bits() == b.to_bits()),
                    "{path:?} {first}"
                );
            }
        }
    }

    #[test]
    fn extreme_words_stay_finite() {
        let words =
            std::array::from_fn(|i| [0, 1, u32::MAX, u32::MAX - 1, 1 << 31, (1 << 31) - 1, 1 << 20, 7][i % 8]);
        let (z, _) = quantiles(&words);
        assert!(z.iter().all(|z| z.abs() < 3.8));
        assert!(z[4].abs() < 1e-9 && z[5].abs() < 1e-9 && z[4] > 0.0 && z[5] < 0.0);
        for word in [0, u64::MAX] {
            assert!(normal_at(word).abs() > 9.0 && normal_at(word).is_finite());
        }
    }
}
