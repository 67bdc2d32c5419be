//! Samplers: uniform, normal and Poisson deviates from addressed random bits.
//!
//! All of them use only integer arithmetic, the four operations, square roots and the `libm` crate, so that
//! every x86-64 machine draws the same numbers. `rand_distr` is the reference twin of the tests. Runs of pixels
//! are drawn block by block, so that bits, exponentials and quantiles are computed side by side.

use super::random::Address;

/// Pixels drawn side by side.
const BLOCK: usize = 64;

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

/// Below this mean the count is found by inversion, above it by transformed rejection.
const INVERSION_BELOW: f64 = 10.0;

/// A Poisson count of `mean` \[e-\] for `pixel`, exact for means up to 1e9; 0 for a mean that is not positive.
///
/// Small means: inversion of the cumulative probability. Large means: transformed rejection with squeeze
/// (Hoermann 1993, Insurance: Mathematics and Economics 12, 39, algorithm PTRS).
pub fn poisson(address: &Address, pixel: u64, mean: f64) -> f64 {
    if mean >= INVERSION_BELOW {
        poisson_rejection(address, pixel, mean)
    } else if mean > 0.0 {
        poisson_inversion(uniform(address.block(pixel, 0)[0]), mean, exp_minus(mean))
    } else {
        0.0
    }
}

/// Replace each of `means` by a count; their pixels are numbered from `first` on. The counts are those of [`poisson`].
pub fn draw_poisson(address: &Address, first: u64, means: &mut [f64]) {
    let mut u = [0.0; BLOCK];
    let mut none = [0.0; BLOCK];
    for (block, means) in means.chunks_mut(BLOCK).enumerate() {
        let first = first + (block * BLOCK) as u64;
        let (u, none) = (&mut u[..means.len()], &mut none[..means.len()]);
        uniforms(address, first, u);
        for (none, mean) in none.iter_mut().zip(&*means) {
            *none = exp_minus(mean.clamp(0.0, INVERSION_BELOW));
        }
        for (i, mean) in means.iter_mut().enumerate() {
            *mean = if *mean > 0.0 && *mean < INVERSION_BELOW {
                poisson_inversion(u[i], *mean, none[i])
            } else {
                poisson(address, first + i as u64, *mean)
            };
        }
    }
}

/// exp(-x) for 0 <= x <= 700, relative error below 4e-16: x = k ln 2 + r with |r| <= ln 2 / 2, Taylor's series of
/// exp(-r) to the 13th power, scaled by 2^-k.
#[inline(always)]
fn exp_minus(x: f64) -> f64 {
    const INVERSE_FACTORIALS: [f64; 14] = [
        1.0 / 6_227_020_800.0,
        1.0 / 479_001_600.0,
        1.0 / 39_916_800.0,
        1.0 / 3_628_800.0,
        1.0 / 362_880.0,
        1.0 / 40_320.0,
        1.0 / 5_040.0,
        1.0 / 720.0,
        1.0 / 120.0,
        1.0 / 24.0,
        1.0 / 6.0,
        0.5,
        1.0,
        1.0,
    ];
    // ln 2 in two parts, the first short enough that k times it is exact
    const LN_2: [f64; 2] = [0.693_147_180_369_123_8, 1.908_214_929_270_587_7e-10];
    // adding and taking off 1.5 * 2^52 rounds to an integer, which then stands in the low bits
    const ROUND: f64 = 6_755_399_441_055_744.0;
    let shifted = x * std::f64::consts::LOG2_E + ROUND;
    let k = shifted - ROUND;
    let r = -((x - k * LN_2[0]) - k * LN_2[1]);
    let series = INVERSE_FACTORIALS.iter().fold(0.0, |sum, c| sum * r + c);
    let exponent = (1023i64 - (shifted.to_bits() as i64 - ROUND.to_bits() as i64)) as u64;
    series * f64::from_bits(exponent << 52)
}

/// The smallest count whose cumulative probability exceeds `u`, for `mean` < 10 and `none` = exp(-mean); the sum ends
/// where the next term no longer changes it.
#[inline(always)]
fn poisson_inversion(u: f64, mean: f64, none: f64) -> f64 {
    let mut term = none;
    let mut sum = term;
    let mut count = 0.0;
    while u > sum {
        count += 1.0;
        term *= mean / count;
        if sum + term == sum {
            break;
        }
        sum += term;
    }
    count
}

fn poisson_rejection(address: &Address, pixel: u64, mean: f64) -> f64 {
    let b = 0.931 + 2.53 * mean.sqrt();
    let a = -0.059 + 0.024_83 * b;
    let v_r = 0.9277 - 3.6224 / (b - 2.0);
    let mut block = 0;
    loop {
        let [first, second] = address.block(pixel, block);
        let u = uniform(first) - 0.5;
        let v = uniform(second);
        let u_s = 0.5 - u.abs();
        let count = ((2.0 * a / u_s + b) * u + mean + 0.43).floor();
        if u_s >= 0.07 && v <= v_r {
            return count;
        }
        if count >= 0.0 && (u_s >= 0.013 || v <= u_s) {
            let inverse_alpha = 1.1239 + 1.1328 / (b - 3.4);
            let left = libm::log(v * inverse_alpha / (a / (u_s * u_s) + b));
            if left <= count * libm::log(mean) - mean - libm::lgamma(count + 1.0) {
                return count;
            }
        }
        // each trial is taken with probability above 0.7: 2^24 blocks never run out
        block += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::random::Stage;
    use rand_distr::Distribution;

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

    /// Mean and variance equal the mean, over both algorithms and their seam; 4.5 sigma at a fixed seed.
    #[test]
    fn poisson_counts_have_the_right_mean_and_variance() {
        for (stream, mean) in [1e-3, 0.3, 5.0, 9.99, 10.0, 10.01, 37.0, 1500.0, 1e5, 1e9].into_iter().enumerate() {
            let address = Address { frame: stream as u32, ..SHOT };
            let n = 200_000u64;
            let (mut sum, mut square) = (0.0, 0.0);
            for pixel in 0..n {
                let d = poisson(&address, pixel, mean) - mean;
                sum += d;
                square += d * d;
            }
            let (n, standard) = (n as f64, mean);
            let mean_error = 4.5 * (standard / n).sqrt();
            let variance_error = 4.5 * ((standard + 2.0 * standard * standard) / n).sqrt();
            assert!((sum / n).abs() < mean_error, "mean {mean}: off by {}", sum / n);
            assert!((square / n - mean).abs() < variance_error, "variance at {mean}: {}", square / n);
        }
    }

    /// Chi-square of 1e6 draws against the exact probabilities, 4.5 sigma of the chi-square distribution;
    /// the reference twin `rand_distr` on the same stream passes the same test.
    #[test]
    fn poisson_counts_follow_the_exact_probabilities() {
        for mean in [0.7, 4.0, 9.9, 10.1, 25.0, 400.0] {
            let n = 1_000_000u64;
            let own = (0..n).map(|pixel| poisson(&SHOT, pixel, mean)).collect::<Vec<_>>();
            let reference = rand_distr::Poisson::new(mean).expect("a positive mean");
            let twin = (0..n).map(|pixel| reference.sample(&mut SHOT.stream(pixel))).collect::<Vec<_>>();
            for (name, draws) in [("own", own), ("rand_distr", twin)] {
                let z = chi_square_sigma(&draws, mean);
                assert!(z.abs() < 4.5, "{name} at {mean}: chi-square off by {z} sigma");
            }
        }
    }

    /// (chi^2 - dof) / sqrt(2 dof) over the counts expected at least 20 times.
    fn chi_square_sigma(draws: &[f64], mean: f64) -> f64 {
        let n = draws.len() as f64;
        let top = (mean + 12.0 * mean.sqrt() + 20.0) as usize;
        let mut seen = vec![0.0; top + 1];
        for draw in draws {
            seen[(*draw as usize).min(top)] += 1.0;
        }
        let (mut chi2, mut cells) = (0.0, 0.0);
        let (mut rest_seen, mut rest_expected) = (n, n);
        for (count, seen) in seen.iter().enumerate() {
            let k = count as f64;
            let expected = n * (k * mean.ln() - mean - libm::lgamma(k + 1.0)).exp();
            if expected >= 20.0 {
                chi2 += (seen - expected).powi(2) / expected;
                cells += 1.0;
                rest_seen -= seen;
                rest_expected -= expected;
            }
        }
        if rest_expected >= 5.0 {
            chi2 += (rest_seen - rest_expected).powi(2) / rest_expected;
            cells += 1.0;
        }
        (chi2 - (cells - 1.0)) / (2.0 * (cells - 1.0)).sqrt()
    }

    #[test]
    fn extreme_means_end_and_stay_finite() {
        for mean in [0.0, -1.0, f64::NAN, 1e-300, 1e-12, f64::MIN_POSITIVE] {
            assert_eq!(poisson(&SHOT, 7, mean), 0.0);
        }
        assert!(poisson(&SHOT, 7, 1e9).is_finite());
        assert!(poisson_inversion(uniform(u64::MAX), 9.99, exp_minus(9.99)) < 60.0);
    }

    #[test]
    fn exponentials_agree_with_libm() {
        for i in 0..=100_000 {
            let x = f64::from(i) * 1e-4;
            let error = exp_minus(x) / libm::exp(-x) - 1.0;
            assert!(error.abs() < 6e-16, "exp(-{x}): {error:e}");
        }
        assert_eq!(exp_minus(0.0), 1.0);
        assert_eq!(exp_minus(1e-300), 1.0);
    }

    #[test]
    fn runs_of_pixels_draw_what_each_pixel_draws() {
        let means =
            (0..1000).map(|i| [0.0, 1e-3, 0.7, 5.0, 9.999, 10.0, 300.0, f64::NAN][i % 8]).collect::<Vec<_>>();
        let mut counts = means.clone();
        draw_poisson(&SHOT, 77, &mut counts);
        let mut noise = vec![3.0; 1000];
        add_normal(&SHOT, 77, 2.0, &mut noise);
        for (i, mean) in means.iter().enumerate() {
            assert_eq!(counts[i], poisson(&SHOT, 77 + i as u64, *mean));
            assert_eq!(noise[i], 3.0 + 2.0 * normal(&SHOT, 77 + i as u64));
        }
    }
}
