//! Read-out noise: Gaussian, independent from pixel to pixel; of active pixels each with its own width.

use super::pattern;
use crate::base::random::CHUNK;
use crate::base::random::{Address, Stage};
use crate::base::sample::{add_normal, normal_of};

/// Add noise of standard deviation `sigma_e` \[e-\]; `first` is the first pixel's number in the whole frame.
pub fn apply(row: &mut [f64], first: u64, address: &Address, sigma_e: f64) {
    if sigma_e > 0.0 {
        add_normal(address, first, sigma_e, row);
    }
}

/// The same with a width of each pixel's own: log-normal about the median `sigma_e`, of relative width `spread`.
pub fn apply_uneven(
    row: &mut [f64],
    first: u64,
    address: &Address,
    sigma_e: f64,
    spread: f64,
    chip_seed: u64,
    scratch: &mut [f64],
) {
    scratch.fill(0.0);
    add_normal(address, first, sigma_e, scratch);
    let widths = pattern::address(chip_seed, Stage::ReadSpread);
    let mut words = (u64::MAX, [0; CHUNK]);
    for ((pixel, value), noise) in (first..).zip(row).zip(scratch) {
        if words.0 != pixel / CHUNK as u64 {
            words = (pixel / CHUNK as u64, widths.chunk(pixel / CHUNK as u64));
        }
        *value += *noise * libm::exp(spread * normal_of(words.1[(pixel % CHUNK as u64) as usize]));
    }
}
