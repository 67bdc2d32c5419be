//! Phase-dispersion minimisation (Stellingwerf 1978, ApJ 224, 953): the variance about the means of phase bins, over the
//! whole variance (his eqs 2 and 3, with weights),
//!
//! ```text
//! theta = [sum_c S_c / sum_c (N - M_c)] / [S / (N - 1)]
//! ```
//!
//! S_c being the squares about the means of cover c, of M_c bins with points in them; cover c is shifted by c over the number of
//! covers of a bin. Without a period, theta (N - M) / (N - 1) of one cover is a Beta((N - M) / 2, (M - 1) / 2) variate
//! (Schwarzenberg-Czerny 1997, ApJ 489, 941). Averaged over covers it scatters less, so the probability given is an upper bound.

use super::false_alarm::beta_cdf;
use super::sample::Sample;

/// How phases are binned.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pdm {
    /// Bins per turn.
    pub bins: usize,
    /// Shifted sets of bins.
    pub covers: usize,
}

/// The dispersion at one frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dispersion {
    /// Theta, near 1 without a period, near 0 for a clean one.
    pub theta: f64,
    /// Mean share of sum w y^2 left within the bins.
    pub left: f64,
    /// Mean number of bins with points in them.
    pub filled: f64,
}

impl Pdm {
    /// The dispersion of a sample that is not constant.
    pub fn at(&self, sample: &Sample, frequency_hz: f64, scratch: &mut Vec<[f64; 2]>) -> Dispersion {
        let cells = self.bins * self.covers;
        scratch.clear();
        scratch.resize(cells, [0.0; 2]);
        for ((t, y), w) in sample.t.iter().zip(&sample.y).zip(&sample.w) {
            let turns = frequency_hz * t;
            let cell = ((turns - turns.floor()) * cells as f64) as usize;
            if let Some([sum, first]) = scratch.get_mut(cell.min(cells - 1)) {
                *sum += w;
                *first += w * y;
            }
        }
        let (mut explained, mut filled) = (0.0, 0.0);
        for cover in 0..self.covers {
            for bin in 0..self.bins {
                let within = (0..self.covers).filter_map(|i| scratch.get((cover + bin * self.covers + i) % cells));
                let [sum, first] = within.fold([0.0; 2], |[a, b], [w, wy]| [a + w, b + wy]);
                if sum > 0.0 {
                    explained += first * first / sum;
                    filled += 1.0;
                }
            }
        }
        let covers = self.covers as f64;
        let (left, filled) = ((1.0 - explained / covers / sample.yy).clamp(0.0, 1.0), filled / covers);
        let n = sample.points() as f64;
        let free = (n - filled).max(1.0);
        Dispersion { theta: left * (n - 1.0) / free, left, filled }
    }

    /// Probability of so low a theta at one of the independent frequencies, of which there are
    /// `turns` = band times span, each as many times as there are bins.
    pub fn false_alarm(&self, found: &Dispersion, points: usize, turns: f64) -> f64 {
        let n = points as f64;
        let one = beta_cdf(found.left, 0.5 * (n - found.filled), 0.5 * (found.filled - 1.0));
        let trials = (turns * self.bins as f64).max(1.0);
        // 1 - (1 - one)^trials, exact for small probabilities
        -(trials * (-one).ln_1p()).exp_m1()
    }
}
