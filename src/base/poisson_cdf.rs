//! The Poisson distribution's cumulative probability and its inverse, to the last digits: what decides where
//! [`super::poisson`] is in doubt.
//!
//! P(N <= k - 1) = Q(k, m), the regularised incomplete gamma function. From k = 12 on Temme's uniform expansion
//! (Temme 1979, SIAM J. Math. Anal. 10, 757; DLMF 8.12; the recursion is that of Gil, Segura & Temme 2012, SIAM J. Sci. Comput. 34,
//! A2965, eq. 2.21):
//!
//! ```text
//! Q(a, x) = erfc(eta (a/2)^(1/2)) / 2 + exp(-a eta^2 / 2) S(eta) / ((2 pi a)^(1/2) Gamma*(a))
//! eta^2 / 2 = mu - ln(1 + mu),   mu = x/a - 1,   sign eta = sign mu
//! S = sum beta_n eta^n,   beta_n = (n + 2)/a beta_(n+2) + d_(n+1),   eta/mu = sum d_n eta^n
//! ```

use std::f64::consts::{PI, SQRT_2};

/// The counts up to here are summed term by term.
const SUMMED_BELOW: f64 = 12.0;
/// Beyond this mean the distribution's steps are far below a rounding of its width.
const LARGEST: f64 = 1e12;

/// d_n of eta/mu, from the series of mu(eta): mu mu' = eta (1 + mu), worked in 60 digits.
#[rustfmt::skip]
const D: [f64; 27] = [
    1.0, -0.333_333_333_333_333_3, 0.083_333_333_333_333_33, -0.014_814_814_814_814_815, 0.001_157_407_407_407_407_3,
    0.000_352_733_686_067_019_4, -0.000_178_755_144_032_921_8, 3.919_263_178_522_438e-5, -2.185_448_510_679_992_4e-6,
    -1.854_062_210_715_16e-6, 8.296_711_340_953_087e-7, -1.766_595_273_682_607_8e-7, 6.707_853_543_401_498e-9,
    1.026_180_978_424_030_9e-8, -4.382_036_018_453_353e-9, 9.147_699_582_236_79e-10, -2.551_419_399_494_625e-11,
    -5.830_772_132_550_426e-11, 2.436_194_802_066_741_5e-11, -5.027_669_280_114_175_5e-12,
    1.100_439_203_195_613_5e-13, 3.371_763_262_400_985_6e-13, -1.392_388_722_418_162e-13, 2.853_489_380_704_744_5e-14,
    -5.139_111_834_242_572e-16, -1.975_228_829_434_944_2e-15, 8.099_521_156_704_561e-16,
];

/// mu - ln(1 + mu), relative error a few 1e-16 for small mu.
fn mu_minus_log1p(mu: f64) -> f64 {
    if mu.abs() > 0.3 {
        return mu - libm::log1p(mu);
    }
    // ln(1 + mu) = 2 atanh(s), s = mu / (2 + mu); mu - 2 s = mu s
    let s = mu / (2.0 + mu);
    let s2 = s * s;
    let series = (1..=14).rev().fold(0.0, |sum, k| (sum + 1.0 / f64::from(2 * k + 1)) * s2);
    mu * s - 2.0 * s * series
}

/// Probabilities of fewer than `count` and of at least `count`, for a whole `count` > 0 and a positive `mean`; each has
/// an absolute error below 1e-14, and a relative one below 1e-9 down to 1e-18.
pub fn below_and_from(count: f64, mean: f64) -> [f64; 2] {
    if count < SUMMED_BELOW {
        let (mut term, mut sum, mut k) = (1.0, 0.0, 0.0);
        while k < count {
            sum += term;
            k += 1.0;
            term *= mean / k;
        }
        let below = sum * libm::exp(-mean);
        return [below, 1.0 - below];
    }
    let half_eta2 = mu_minus_log1p((mean - count) / count);
    let eta = (2.0 * half_eta2).sqrt().copysign(mean - count);
    let (mut odd, mut even, mut series) = (0.0, 0.0, 0.0);
    for n in (0..D.len() - 1).rev() {
        let beta = (n + 2) as f64 / count * even + D[n + 1];
        (even, odd) = (odd, beta);
        series = series * eta + beta;
    }
    let c2 = 1.0 / (count * count);
    let stirling =
        (1.0 / 12.0 - c2 * (1.0 / 360.0 - c2 * (1.0 / 1260.0 - c2 * (1.0 / 1680.0 - c2 / 1188.0)))) / count;
    let rest = libm::exp(-count * half_eta2 - stirling) / (2.0 * PI * count).sqrt() * series;
    let argument = eta * count.sqrt() / SQRT_2;
    [0.5 * libm::erfc(argument) + rest, 0.5 * libm::erfc(-argument) - rest]
}

/// A uniform deviate of 64 bits: its value and that of 1 less it, each with full relative precision.
#[derive(Debug, Clone, Copy)]
pub struct Uniform {
    /// In (0, 1).
    pub low: f64,
    /// One less that.
    pub high: f64,
}

impl Uniform {
    /// The deviate of a word of 64 bits.
    pub fn of(word: u64) -> Self {
        let value = |word: u64| (word as f64 + 0.5) * (1.0 / 18_446_744_073_709_551_616.0);
        Self { low: value(word), high: value(!word) }
    }
}

/// The count of `mean` at the uniform deviate of `word`: the smallest whose cumulative probability reaches it. `guess` is
/// near the answer. Zero for a mean that is not positive.
pub fn count_at(word: u64, mean: f64, guess: f64) -> f64 {
    if mean.is_nan() || mean <= 0.0 {
        return 0.0;
    }
    if mean > LARGEST {
        return guess;
    }
    let u = Uniform::of(word);
    if mean < SUMMED_BELOW {
        return small_count_at(u, mean);
    }
    // N >= k where the probability of fewer than k lies below u
    let reaches = |k: f64| {
        let [below, from] = below_and_from(k, mean);
        if word >> 63 == 0 { below < u.low } else { from > u.high }
    };
    let mut count = if guess.is_finite() { guess.max(0.0).floor() } else { mean.floor() };
    if count == 0.0 || reaches(count) {
        while reaches(count + 1.0) {
            count += 1.0;
        }
    } else {
        count -= 1.0;
        while count > 0.0 && !reaches(count) {
            count -= 1.0;
        }
    }
    count
}

/// Most terms of a mean below [`SUMMED_BELOW`] that exceed 1e-22 of their sum.
const TERMS: usize = 72;

fn small_count_at(u: Uniform, mean: f64) -> f64 {
    let mut terms = [0.0; TERMS];
    terms[0] = libm::exp(-mean);
    for k in 1..TERMS {
        terms[k] = terms[k - 1] * (mean / k as f64);
    }
    if u.low < 0.5 {
        let mut sum = 0.0;
        let reached = |term: &f64| {
            sum += term;
            sum >= u.low
        };
        return terms.iter().position(reached).unwrap_or(TERMS) as f64;
    }
    let mut sum = 0.0;
    for (k, term) in terms.iter().enumerate().rev() {
        sum += term;
        if sum > u.high {
            return k as f64;
        }
    }
    0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// scipy 1.17 special.gammaincc and gammainc.
    #[test]
    fn probabilities_agree_with_published_code() {
        for (count, mean, below, from) in [
            (12.0, 16.0, 0.126_992_670_066_344_38, 0.873_007_329_933_655_6),
            (20.0, 25.0, 0.133_574_834_085_650_4, 0.866_425_165_914_349_6),
            (60.0, 16.0, 1.0, 3.232_715_784_324_538_5e-17),
            (1000.0, 1100.0, 0.001_059_323_253_929_977_3, 0.998_940_676_746_070_1),
            (4200.0, 4000.0, 0.999_129_815_082_142_2, 0.000_870_184_917_857_760_7),
            (1e6, 1e6, 0.499_867_019_239_127_4, 0.500_132_980_760_872_5),
            (999_950_000.0, 1e9, 0.056_920_438_161_791_43, 0.943_079_561_838_208_6),
        ] {
            let [b, f] = below_and_from(count, mean);
            assert!((b - below).abs() < 1e-13 && (f - from).abs() < 1e-13, "{count} {mean}: {b} {f}");
            assert!((f / from - 1.0).abs() < 1e-8, "{count} {mean}: {f}");
        }
    }

    /// Differences of neighbouring cumulative probabilities are the probabilities.
    #[test]
    fn steps_are_the_probabilities() {
        for mean in [12.0, 16.7, 150.25, 4096.5, 1e6] {
            let spread = f64::sqrt(mean);
            for z in -6..=6 {
                let k = (mean + f64::from(z) * spread).floor();
                if k < 1.0 {
                    continue;
                }
                let exact = libm::exp(k * libm::log(mean) - mean - libm::lgamma(k + 1.0));
                let step = below_and_from(k + 1.0, mean)[0] - below_and_from(k, mean)[0];
                // the exponent's terms are larger than it by k ln k
                assert!(
                    (step - exact).abs() < 3e-14 + 1e-15 * k * libm::log(k + 1.0) * exact,
                    "{mean} {k}: {step} {exact}"
                );
            }
        }
    }

    /// The inverse is monotonous, and each count's share of the deviates is its probability.
    #[test]
    fn counts_invert_the_probabilities() {
        for mean in [1e-12, 0.3, 5.0, 11.9, 12.1, 40.0, 1500.0] {
            let mut last = 0.0;
            for j in 0..2000u64 {
                let word = j * (u64::MAX / 2000);
                let count = count_at(word, mean, mean);
                assert!(count >= last, "{mean}");
                last = count;
                let u = Uniform::of(word);
                if count > 0.0 {
                    assert!(below_and_from(count, mean)[0] < u.low + 1e-13, "{mean} {count}");
                }
                assert!(below_and_from(count + 1.0, mean)[0] > u.low - 1e-13, "{mean} {count}");
            }
        }
        // a photon in 1e12 draws: 64 bits tell
        let edge = (1e-12 * 18_446_744_073_709_551_616.0) as u64;
        assert_eq!([!(edge - 9), !(edge + 9)].map(|w| count_at(w, 1e-12, 0.0)), [1.0, 0.0]);
    }

    #[test]
    fn extremes_end() {
        for (mean, expected) in [(0.0, 0.0), (-1.0, 0.0), (f64::NAN, 0.0), (1e-300, 0.0)] {
            assert_eq!(count_at(u64::MAX / 3, mean, mean), expected);
        }
        for word in [0, 1, u64::MAX / 2, u64::MAX] {
            for mean in [5e-20, 1.0, 11.99, 12.0, 500.0, 1e9] {
                let count = count_at(word, mean, mean);
                assert!((count - mean).abs() < 10.0 * mean.sqrt() + 20.0, "{word} {mean}: {count}");
            }
        }
    }
}
