//! Fixed patterns of a chip: the same in every frame, functions of (chip's seed, stage, pixel).

use crate::base::random::{Address, Stage};
use crate::base::sample::add_normal;

/// Number of a pixel in a chip's patterns: of its place alone, whatever is stored beside it.
pub fn number(x: usize, y: usize) -> u64 {
    (y as u64) << 17 | x as u64
}

/// Where a chip's pattern begins.
pub fn address(chip_seed: u64, stage: Stage) -> Address {
    Address { seed: chip_seed, frame: 0, stage }
}

/// 1 plus `rms` times a standard normal deviate of each pixel numbered from `first` on, never negative, written to `out`.
pub fn factors(chip_seed: u64, stage: Stage, first: u64, rms: f64, out: &mut [f64]) {
    out.fill(1.0);
    add_normal(&address(chip_seed, stage), first, rms, out);
    out.iter_mut().for_each(|factor| *factor = factor.max(0.0));
}
