//! Least squares of a Fourier series with floating mean: the generalised Lomb-Scargle periodogram of Zechmeister & Kuerster
//! 2009, A&A 496, 577 (one harmonic) and of Palmer 2009, ApJ 695, 496 (more).
//!
//! With weights w of sum one and values y about their weighted mean, all that a fit at frequency f needs is
//!
//! ```text
//! C_h = sum w exp(2 pi i h f t), h = 0..2K        Y_h = sum w y exp(2 pi i h f t), h = 1..K
//! ```
//!
//! as products of sines and cosines are sums of such terms. With A the covariances of the functions cos 1, sin 1, cos 2, ... (the
//! mean taken out is the floating mean) and b those with y, A = L L^T and z = L^-1 b: chi-square falls by sum z^2.
//! The first 2k terms of that sum belong to k harmonics, so one factorisation tells the power of each number of harmonics:
//! p_k = sum_(i <= 2k) z_i^2 / sum w y^2 (Zechmeister & Kuerster eq. 5 for k = 1).

use super::peaks::vertex;
use super::sample::Sample;
use super::turn::{Complex, turn};
use std::f64::consts::TAU;

/// Added to the variances of the functions, which are 1/2 where the sampling covers the turn: it takes 2e-9 of a power, and bounds the
/// solution where functions depend on each other, at periods far longer than the nights.
const RIDGE: f64 = 1e-9;
/// A climb has arrived when a round gains less than this of chi-square, in units of its value per point.
const SETTLED: f64 = 1e-3;
/// Most rounds of a climb.
const ROUNDS: usize = 12;

/// Normal equations of a Fourier series, and their solution.
#[derive(Debug, Clone)]
pub struct Fit {
    /// C_h, h = 0..=2K.
    pub c: Vec<Complex>,
    /// Y_h, h = 0..=K.
    pub y: Vec<Complex>,
    /// Lower triangle L, 2K rows of 2K.
    l: Vec<f64>,
    /// L^-1 b.
    z: Vec<f64>,
}

impl Fit {
    /// For up to `harmonics`.
    pub fn new(harmonics: usize) -> Self {
        let n = 2 * harmonics;
        let zero = Complex::default();
        Self { c: vec![zero; n + 1], y: vec![zero; harmonics + 1], l: vec![0.0; n * n], z: vec![0.0; n] }
    }

    /// Number of harmonics K.
    pub fn harmonics(&self) -> usize {
        self.z.len() / 2
    }

    /// Fill the sums at `frequency_hz` by adding up all points: the reference of [`mod@super::scan`].
    pub fn sum(&mut self, sample: &Sample, frequency_hz: f64) {
        self.c.fill(Complex::default());
        self.y.fill(Complex::default());
        for ((t, y), w) in sample.t.iter().zip(&sample.y).zip(&sample.w) {
            let step = turn(frequency_hz * t);
            let mut z = Complex { re: *w, im: 0.0 };
            let (both, rest) = self.c.split_at_mut(self.y.len());
            for (c, v) in both.iter_mut().zip(&mut self.y) {
                *c += z;
                *v += z.scale(*y);
                z *= step;
            }
            for c in rest {
                *c += z;
                z *= step;
            }
        }
    }

    /// Solve for the sums at hand.
    pub fn solve(&mut self) {
        let n = self.z.len();
        for i in 0..n {
            let b = self.y[i / 2 + 1];
            let mut b = if i % 2 == 0 { b.re } else { b.im };
            for j in 0..=i {
                let (above, row) = self.l.split_at(i * n);
                let other = if j < i { &above[j * n..j * n + j] } else { &row[..j] };
                let known = row.iter().zip(other).map(|(p, q)| p * q).sum::<f64>();
                let a = self.covariance(i, j) - known;
                if j < i {
                    let factor = a / self.l[j * n + j];
                    self.l[i * n + j] = factor;
                    b -= factor * self.z[j];
                } else {
                    let diagonal = (a + RIDGE).max(RIDGE).sqrt();
                    self.l[i * n + i] = diagonal;
                    self.z[i] = b / diagonal;
                }
            }
        }
    }

    /// Covariance of functions i and j <= i: cos of harmonic i/2 + 1 for even i, sin for odd.
    fn covariance(&self, i: usize, j: usize) -> f64 {
        let (p, q) = (i / 2 + 1, j / 2 + 1);
        let (sum, difference, a, b) = (self.c[p + q], self.c[p - q], self.c[p], self.c[q]);
        match (i % 2, j % 2) {
            (0, 0) => 0.5 * (difference.re + sum.re) - a.re * b.re,
            (1, 1) => 0.5 * (difference.re - sum.re) - a.im * b.im,
            // sin p cos q
            (1, _) => 0.5 * (sum.im + difference.im) - a.im * b.re,
            // cos p sin q
            _ => 0.5 * (sum.im - difference.im) - a.re * b.im,
        }
    }

    /// What `harmonics` of them take from sum w y^2.
    pub fn explained(&self, harmonics: usize) -> f64 {
        self.z.iter().take(2 * harmonics).map(|z| z * z).sum()
    }

    /// Power of `harmonics` of them, 0 to 1.
    pub fn power(&self, harmonics: usize, sample: &Sample) -> f64 {
        (self.explained(harmonics) / sample.yy).clamp(0.0, 1.0)
    }

    /// Coefficients of cos 1, sin 1, cos 2, ... of the fit by `harmonics` of them, in the sample's unit.
    pub fn coefficients(&self, harmonics: usize) -> Vec<f64> {
        let n = self.z.len();
        let used = (2 * harmonics).min(n);
        let mut x = self.z.iter().take(used).copied().collect::<Vec<_>>();
        for i in (0..used).rev() {
            let later = (i + 1..used).map(|j| self.l[j * n + i] * x[j]).sum::<f64>();
            x[i] = (x[i] - later) / self.l[i * n + i];
        }
        x
    }

    /// g^T A^-1 g for the functions' weights `g`: the variance of g^T coefficients in units of 1 / sum(1 / sigma^2).
    pub fn variance(&self, g: &[f64]) -> f64 {
        let n = self.z.len();
        let used = g.len().min(n);
        let mut v = vec![0.0; used];
        for i in 0..used {
            let earlier = (0..i).map(|j| self.l[i * n + j] * v[j]).sum::<f64>();
            v[i] = (g[i] - earlier) / self.l[i * n + i];
        }
        v.iter().map(|v| v * v).sum()
    }
}

/// The functions cos 1, sin 1, cos 2, ... of `harmonics` at `phase` \[turns\].
pub fn functions(phase: f64, harmonics: usize) -> Vec<f64> {
    (1..=harmonics)
        .flat_map(|h| {
            let (s, c) = (TAU * h as f64 * phase).sin_cos();
            [c, s]
        })
        .collect()
}

/// Power of `harmonics` at one frequency, by direct sums.
pub fn power_at(sample: &Sample, frequency_hz: f64, harmonics: usize) -> f64 {
    let mut fit = Fit::new(harmonics);
    fit.sum(sample, frequency_hz);
    fit.solve();
    fit.power(harmonics, sample)
}

/// Climb from `start_hz` to the next maximum of the power by parabolas through three points, `step_hz` apart at first and a
/// quarter of that in each round, until a round gains next to nothing; no further than 1.4
/// `step_hz`. Gives the frequency and its power.
pub fn climb(sample: &Sample, start_hz: f64, step_hz: f64, harmonics: usize) -> (f64, f64) {
    let power = |f: f64| if f > 0.0 { power_at(sample, f, harmonics) } else { 0.0 };
    let (mut f, mut step) = (start_hz, step_hz);
    let mut here = power(f);
    for _ in 0..ROUNDS {
        let (low, high) = (power(f - step), power(f + step));
        let before = here;
        let uphill = low > here || high > here;
        if uphill {
            (f, here) = if low > high { (f - step, low) } else { (f + step, high) };
        } else {
            let top = step.mul_add(vertex([low, here, high]), f);
            let best = power(top);
            if best > here {
                (f, here) = (top, best);
            }
        }
        if !uphill && (here - before) * sample.points() as f64 <= SETTLED * (1.0 - here) {
            break;
        }
        step *= 0.25;
    }
    (f, here)
}

/// Standard error of a frequency \[Hz\] at the optimum of a fit by `harmonics`, from the curvature of chi-square:
/// sigma^2 = 2 / (d^2 chi2 / df^2). For one harmonic on even, complete sampling it equals
/// (6/N)^(1/2) sigma / (pi T A) (Montgomery & O'Donoghue 1999, DSSN 13, 28). `noise` multiplies the variances of the points.
/// Infinite where chi-square has no minimum.
pub fn frequency_error(sample: &Sample, frequency_hz: f64, harmonics: usize, noise: f64) -> f64 {
    let step = 0.05 / (sample.span_s() * harmonics as f64);
    let [low, here, high] =
        [-1.0, 0.0, 1.0].map(|s: f64| power_at(sample, s.mul_add(step, frequency_hz), harmonics));
    let bend = (2.0 * here - low - high) / (step * step) * sample.yy * sample.chi2_unit;
    if bend > 0.0 { (2.0 * noise / bend).sqrt() } else { f64::INFINITY }
}
