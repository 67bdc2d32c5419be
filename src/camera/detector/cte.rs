//! Charge transfer: each transfer leaves a share `cti` of the charge behind, in the pixels read after it.
//!
//! After n transfers the share in the k-th pixel behind is the binomial C(n, k) cti^k (1 - cti)^(n - k) (Janesick 2001,
//! Scientific CCDs, sect. 5.1). Rows move towards row 0 and then along it towards column 0: a pixel of row y and column x
//! makes y + 1 and x + 1 transfers. What would lie further behind than the trail kept (1e-7) is put into its last pixel.

use crate::camera::region::Region;

/// Share beyond the last pixel of a trail.
const BEYOND: f64 = 1e-7;

/// Transfers of a chip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transfer {
    cti: f64,
    /// Transfers from one pixel to the next.
    step: f64,
    /// Pixels of a trail behind its own.
    trail: usize,
}

impl Transfer {
    /// Transfers that lose `cti` each; `step` of them from pixel to pixel, `most` pixels to the amplifier.
    pub fn new(cti: f64, step: usize, most: usize) -> Self {
        let mean = cti * (step * most) as f64;
        let (mut term, mut beyond, mut trail) = (libm::exp(-mean), 1.0, 0);
        while beyond > BEYOND && trail < most {
            beyond -= term;
            trail += 1;
            term *= mean / trail as f64;
        }
        Self { cti, step: step as f64, trail }
    }

    /// Pixels behind a packet that hold some of it.
    pub fn trail(&self) -> usize {
        self.trail
    }

    /// Shares of a packet that lies `place` pixels from the amplifier in its own pixel and those behind, `trail` + 1.
    pub fn shares(&self, place: usize, out: &mut Vec<f64>) {
        let n = (place + 1) as f64 * self.step;
        out.clear();
        let mut sum = 0.0;
        // logarithms: of many transfers that lose much the first shares are below the smallest number
        let (kept, lost) = (libm::log1p(-self.cti), libm::log(self.cti));
        let mut logarithm = n * kept;
        for k in 0..self.trail {
            let term = if logarithm > -745.0 { libm::exp(logarithm) } else { 0.0 };
            out.push(term);
            sum += term;
            let left = n - k as f64;
            logarithm = if left > 0.0 && self.cti < 1.0 {
                logarithm + libm::log(left / (k + 1) as f64) + lost - kept
            } else {
                f64::NEG_INFINITY
            };
        }
        out.push((1.0 - sum).max(0.0));
    }

    /// Move `width` columns of charge, numbered from `x0` on, along their rows into the columns of `region`.
    pub fn columns(&self, charge: &[f64], x0: usize, width: usize, region: &Region, out: &mut [f64]) {
        // the share of each column's packet that falls k pixels behind, column by column
        let mut one = Vec::new();
        let mut behind = vec![vec![0.0; width]; self.trail + 1];
        for x in 0..width {
            self.shares(x0 + x, &mut one);
            behind.iter_mut().zip(&one).for_each(|(shares, share)| shares[x] = *share);
        }
        for (row, out) in charge.chunks_exact(width).zip(out.chunks_exact_mut(region.width)) {
            for (k, shares) in behind.iter().enumerate() {
                // the first packet whose share lands in the region
                let from = region.x0.saturating_sub(x0 + k).min(width);
                let to = (x0 + from + k).saturating_sub(region.x0).min(out.len());
                let packets = row[from..].iter().zip(&shares[from..]);
                out[to..].iter_mut().zip(packets).for_each(|(value, (packet, share))| *value += packet * share);
            }
        }
    }

    /// Move rows of charge \[e-\] of width `width` down: `charge` holds `before` rows below the first of `out`'s, numbered
    /// from `first_row` - `before` on.
    pub fn rows(&self, charge: &[f64], width: usize, first_row: usize, before: usize, out: &mut [f64]) {
        let mut shares = Vec::new();
        out.fill(0.0);
        let count = out.len() / width;
        for (j, packet) in charge.chunks_exact(width).enumerate() {
            self.shares(first_row - before + j, &mut shares);
            for (k, share) in shares.iter().enumerate() {
                let Some(to) = (j + k).checked_sub(before).filter(|to| *to < count) else { continue };
                for (value, charge) in out[to * width..(to + 1) * width].iter_mut().zip(packet) {
                    *value += share * charge;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All of a packet is somewhere behind it, and its mean delay is the number of transfers times the loss.
    #[test]
    fn charge_is_conserved_and_delayed() {
        for (cti, step, most) in [(1e-5, 1, 4096), (1e-3, 2, 2048), (0.1, 1, 30), (0.5, 1, 3000), (1e-9, 1, 10)] {
            let transfer = Transfer::new(cti, step, most);
            let mut shares = Vec::new();
            for place in [0, 1, most / 2, most - 1] {
                transfer.shares(place, &mut shares);
                let sum: f64 = shares.iter().sum();
                assert!((sum - 1.0).abs() < 1e-12 && shares.len() == transfer.trail() + 1, "{cti} {place}: {sum}");
                let delay = shares.iter().enumerate().map(|(k, s)| k as f64 * s).sum::<f64>();
                let expected = (place + 1) as f64 * step as f64 * cti;
                assert!((delay - expected).abs() < 1e-5 * (1.0 + expected), "{cti} {place}: {delay} {expected}");
            }
        }
    }

    #[test]
    fn a_band_has_the_rows_of_the_whole() {
        let transfer = Transfer::new(1e-3, 1, 100);
        let charge = (0..300).map(|i| f64::from(i * 37 % 101)).collect::<Vec<_>>();
        let mut whole = vec![0.0; 300];
        transfer.rows(&charge, 3, 0, 0, &mut whole);
        let before = transfer.trail().min(40);
        let mut band = vec![0.0; 30];
        transfer.rows(&charge[(40 - before) * 3..150], 3, 40, before, &mut band);
        assert_eq!(band, whole[120..150]);
    }
}
