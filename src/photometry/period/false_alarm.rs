//! False-alarm probability of a periodogram's highest peak, on white noise of unknown strength.
//!
//! The power p of n harmonics (d = 2n functions) at one frequency is a Beta(n, N_K / 2) variate, N_K = N - 1 - d. Its maximum
//! over frequencies exceeds p with a probability of at most (Davies 1977; Baluev 2008, MNRAS 385, 1279, eqs 5, 6)
//!
//! ```text
//! FAP = 1 - (1 - P(p)) exp(-tau),   tau = W a_n G p^(n - 1/2) (1 - p)^((N_K - 1) / 2)
//! W = (f_max - f_min) (4 pi var t)^(1/2),   G = Gamma((N - 1) / 2) / Gamma((N - d) / 2)
//! a_n = 2^n / (2n - 1)!! sum_(k = 1..n) (-1)^(n - k) k^(2n + 1) / ((n + k)! (n - k)!)
//! ```
//!
//! with a_n of Baluev 2009, MNRAS 395, 1541; a_1 = 1 is the classical periodogram. G follows from a random direction in
//! N - 1 dimensions in place of a normal variate, and is Baluev's (2008) table 1 for n = 1.

use std::f64::consts::PI;

/// ln Gamma(x), x > 0: Stirling's series (DLMF 5.11.1) from 10 on, the recurrence below; relative error below 1e-13.
fn ln_gamma(mut x: f64) -> f64 {
    let mut below = 0.0;
    while x < 10.0 {
        below -= x.max(f64::MIN_POSITIVE).ln();
        x += 1.0;
    }
    let r = 1.0 / (x * x);
    let series = (1.0 / 12.0 - r * (1.0 / 360.0 - r * (1.0 / 1260.0 - r * (1.0 / 1680.0 - r / 1188.0)))) / x;
    below + (x - 0.5) * x.ln() - x + 0.5 * (2.0 * PI).ln() + series
}

/// Regularised incomplete beta function I_x(a, b), a and b > 0, 0 <= x <= 1, by its continued fraction
/// (DLMF 8.17.22, evaluated after Thompson & Barnett 1986, J. Comput. Phys. 64, 490).
pub fn beta_cdf(x: f64, a: f64, b: f64) -> f64 {
    if !(a > 0.0 && b > 0.0) || x <= 0.0 {
        return 0.0;
    }
    if x >= 1.0 {
        return 1.0;
    }
    // the fraction converges fast below the mean
    if x > (a + 1.0) / (a + b + 2.0) {
        return 1.0 - beta_cdf_low(1.0 - x, b, a);
    }
    beta_cdf_low(x, a, b)
}

/// I_x(a, b) for x below the mean of the distribution.
fn beta_cdf_low(x: f64, a: f64, b: f64) -> f64 {
    let front = a * x.ln() + b * (-x).ln_1p() + ln_gamma(a + b) - ln_gamma(a) - ln_gamma(b);
    let away = |v: f64| if v.abs() < 1e-300 { 1e-300 } else { v };
    let (mut c, mut d) = (1.0, 1.0 / away(1.0 - (a + b) * x / (a + 1.0)));
    let mut fraction = d;
    // the number of terms grows like max(a, b)^(1/2)
    for m in (1..2000).map(f64::from) {
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        d = 1.0 / away(1.0 + even * d);
        c = away(1.0 + even / c);
        fraction *= d * c;
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        d = 1.0 / away(1.0 + odd * d);
        c = away(1.0 + odd / c);
        fraction *= d * c;
        if (d * c - 1.0).abs() < 1e-14 {
            break;
        }
    }
    (front.exp() * fraction / a).clamp(0.0, 1.0)
}

/// a_n of the file's head, n = 1..8.
fn harmonics_factor(n: usize) -> f64 {
    let factorial = |k: usize| (1..=k).map(|k| k as f64).product::<f64>();
    let double = (1..=n).map(|k| (2 * k - 1) as f64).product::<f64>();
    let term = |k: usize| {
        let sign = if (n - k).is_multiple_of(2) { 1.0 } else { -1.0 };
        sign * (k as f64).powi(2 * n as i32 + 1) / (factorial(n + k) * factorial(n - k))
    };
    2f64.powi(n as i32) / double * (1..=n).map(term).sum::<f64>()
}

/// Probability that noise at `points` times reaches `power` somewhere in a band of width `band_hz` with `harmonics`;
/// `time_spread_s` is the weighted standard deviation of the times.
pub fn false_alarm(power: f64, points: usize, harmonics: usize, band_hz: f64, time_spread_s: f64) -> f64 {
    let (n, d) = (harmonics as f64, 2.0 * harmonics as f64);
    let rest = points as f64 - 1.0 - d;
    if rest < 1.0 {
        return 1.0;
    }
    if power >= 1.0 {
        return 0.0;
    }
    let one = beta_cdf(1.0 - power, 0.5 * rest, n);
    let width = band_hz * (4.0 * PI).sqrt() * time_spread_s;
    let gamma = ln_gamma(0.5 * (points as f64 - 1.0)) - ln_gamma(0.5 * (points as f64 - d));
    let shape = (n - 0.5) * power.max(f64::MIN_POSITIVE).ln() + 0.5 * (rest - 1.0) * (-power).ln_1p();
    let tau = width * harmonics_factor(harmonics) * (gamma + shape).exp();
    // 1 - (1 - one) exp(-tau), exact for small probabilities
    (one - (1.0 - one) * (-tau).exp_m1()).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gamma_has_its_closed_values() {
        assert!((ln_gamma(0.5) - 0.5 * PI.ln()).abs() < 1e-13);
        assert!((ln_gamma(11.0) - 3_628_800f64.ln()).abs() < 1e-12);
        assert!(ln_gamma(1.0).abs() < 1e-13);
    }

    #[test]
    fn beta_has_its_closed_forms_and_symmetry() {
        for x in [1e-9, 0.1, 0.37, 0.8, 0.999] {
            assert!((beta_cdf(x, 1.0, 4.5) - (1.0 - (1.0 - x).powf(4.5))).abs() < 1e-12);
            assert!((beta_cdf(x, 0.5, 0.5) - 2.0 / PI * x.sqrt().asin()).abs() < 1e-12);
            assert!((beta_cdf(x, 7.3, 2.1) + beta_cdf(1.0 - x, 2.1, 7.3) - 1.0).abs() < 1e-12);
        }
        // degrees of freedom of a hundred thousand points: half of the probability near the mean
        assert!((beta_cdf(0.5, 5e4, 5e4) - 0.5).abs() < 1e-9);
    }

    #[test]
    fn factor_of_two_harmonics_is_the_mean_over_directions() {
        // mean of (u + 4 v)^(1/2) over u + v = 1, both even: 14/9
        assert!((harmonics_factor(1) - 1.0).abs() < 1e-15);
        assert!((harmonics_factor(2) - 14.0 / 9.0).abs() < 1e-14);
        // eight harmonics: cancelling terms leave digits, and all lies between the extremes 1/7! and 8/7!
        let eight = harmonics_factor(8) * 5040.0;
        assert!(eight > 4.0 && eight < 6.0, "{eight}");
    }

    #[test]
    fn probability_falls_with_power_and_grows_with_the_band() {
        let at = |p: f64, band: f64| false_alarm(p, 100, 3, band, 1000.0);
        assert!(at(0.3, 1.0) > at(0.4, 1.0) && at(0.4, 2.0) > at(0.4, 1.0));
        assert_eq!(at(1.0, 1.0), 0.0);
        assert_eq!(false_alarm(0.9, 7, 3, 1.0, 1000.0), 1.0);
        assert!((at(0.0, 1.0) - 1.0).abs() < 1e-12);
    }
}
