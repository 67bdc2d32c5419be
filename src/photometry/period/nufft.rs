//! Sums `F_k = sum_j c_j exp(2 pi i (f + k df) t_j)` for k = 0..M at once: every datum is spread over the neighbouring
//! points of an even grid, which one fast Fourier transform turns into frequencies (the extirpolation of Press &
//! Rybicki 1989, ApJ 338, 277), here with the Gaussian of Greengard & Lee 2004, SIAM Rev. 46, 443, eqs 8-12, in place of
//! Lagrange's weights.
//!
//! The grid has G = 2 M points. A Gaussian of width s (in grid steps) cut off at m steps leaves exp(-m^2 / 2 s^2), and
//! its images leave exp(-pi^2 s^2) at the worst frequency; both are exp(-pi m / 2^(1/2)) for s^2 = m / (2^(1/2) pi).
//! m = 12 leaves 3e-12 of sum |c_j|.

use super::turn::Complex;
use rustfft::{Fft, FftPlanner};
use std::f64::consts::{PI, SQRT_2};
use std::sync::Arc;

/// Grid steps to either side that a datum is spread over.
const REACH: usize = 12;
/// Grid points that a datum touches.
const TAPS: usize = 2 * REACH;
/// s^2 of the Gaussian \[grid steps^2\].
const WIDTH2: f64 = REACH as f64 / (SQRT_2 * PI);

/// Sums for a fixed number of frequencies.
#[derive(Clone)]
pub struct Nufft {
    fft: Arc<dyn Fft<f64>>,
    /// Inverse transform of the Gaussian by distance from the middle frequency.
    inverse: Vec<f64>,
    /// exp(-l^2 / 2 s^2) of the taps.
    taps: [f64; TAPS],
}

/// Weights of a datum on its grid points.
#[derive(Debug, Clone, Copy)]
pub struct Footprint {
    first: usize,
    weights: [f64; TAPS],
}

impl Nufft {
    /// For 2^`bits` frequencies, `bits` from 5 to 24 (clamped).
    pub fn new(bits: u32) -> Self {
        // the positive sign in the exponent
        let fft = FftPlanner::new().plan_fft_inverse(2 << bits.clamp(5, 24));
        let g = fft.len() as f64;
        let inverse = (0..=fft.len() / 4)
            .map(|k| (2.0 * WIDTH2 * (PI * k as f64 / g).powi(2)).exp() / (2.0 * PI * WIDTH2).sqrt())
            .collect();
        let taps = std::array::from_fn(|i| (-(i as f64 - REACH as f64 + 1.0).powi(2) / (2.0 * WIDTH2)).exp());
        Self { fft, inverse, taps }
    }

    /// Number of frequencies M.
    pub fn size(&self) -> usize {
        self.fft.len() / 2
    }

    /// Zeros for the grid.
    pub fn grid(&self) -> Vec<Complex> {
        vec![Complex::default(); self.fft.len()]
    }

    /// The footprint of a datum at `turns` = df t, finite.
    pub fn footprint(&self, turns: f64) -> Footprint {
        let g = self.fft.len();
        let place = (turns - turns.floor()) * g as f64;
        let base = place.floor();
        let d = place - base;
        // exp(-(d - l)^2 / 2 s^2) = exp(-d^2 / 2 s^2) exp(d / s^2)^l exp(-l^2 / 2 s^2)
        let ratio = (d / WIDTH2).exp();
        let mut factor = (-d * d / (2.0 * WIDTH2) - (REACH as f64 - 1.0) * d / WIDTH2).exp();
        let weights = std::array::from_fn(|i| {
            let weight = factor * self.taps[i];
            factor *= ratio;
            weight
        });
        Footprint { first: (base as usize + g + 1 - REACH) % g, weights }
    }

    /// Add `value` to `grid` at a footprint of this transform.
    pub fn spread(&self, grid: &mut [Complex], at: &Footprint, value: Complex) {
        let straight = at.first.checked_add(TAPS).and_then(|end| grid.get_mut(at.first..end));
        if let Some(points) = straight {
            points.iter_mut().zip(&at.weights).for_each(|(p, w)| *p += value.scale(*w));
        } else {
            let g = self.fft.len();
            for (i, w) in at.weights.iter().enumerate() {
                if let Some(p) = grid.get_mut((at.first + i) % g) {
                    *p += value.scale(*w);
                }
            }
        }
    }

    /// Transform a grid: frequency k = 0..M into `out`, where the data were turned by the frequency in the middle,
    /// k = M/2. The grid is left in disorder.
    pub fn finish(&self, grid: &mut [Complex], out: &mut Vec<Complex>) {
        if grid.len() == self.fft.len() {
            self.fft.process(grid);
        }
        let half = self.size() / 2;
        let negative = grid.iter().skip(3 * half).take(half).zip(self.inverse.iter().skip(1).rev());
        let positive = grid.iter().zip(&self.inverse).take(half);
        out.clear();
        out.extend(negative.chain(positive).map(|(z, inverse)| z.scale(*inverse)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::photometry::period::turn::turn;

    #[test]
    fn sums_agree_with_direct_ones() {
        let nufft = Nufft::new(7);
        let m = nufft.size();
        // from within the grid's interior, over its seam, to many times around it
        let turns = (0..50).map(|j| f64::from(j * j) * 0.007_31 - 0.01).collect::<Vec<_>>();
        let value = |j: usize| (j as f64 * 0.77).sin();
        let mut grid = nufft.grid();
        for (j, x) in turns.iter().enumerate() {
            let turned = turn(x * (m / 2) as f64).scale(value(j));
            nufft.spread(&mut grid, &nufft.footprint(*x), turned);
        }
        let mut out = Vec::new();
        nufft.finish(&mut grid, &mut out);
        assert_eq!(out.len(), m);
        let total = (0..turns.len()).map(|j| value(j).abs()).sum::<f64>();
        for (k, z) in out.iter().enumerate() {
            let direct = turns
                .iter()
                .enumerate()
                .fold(Complex::default(), |s, (j, x)| s + turn(x * k as f64).scale(value(j)));
            let error = (direct - *z).norm_sqr().sqrt() / total;
            // the estimate of the file's head, times the sum over many images and taps
            assert!(error < 2e-11, "k = {k}: {error:e}");
        }
    }
}
