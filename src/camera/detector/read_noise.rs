//! Read-out noise: Gaussian, independent from pixel to pixel; of active pixels each with its own width.

use super::pattern;
use crate::base::random::{Address, Stage};
use crate::base::sample::add_normal;

/// Add noise of standard deviation `sigma_e` \[e-\]; `first` is the first pixel's number in the whole frame.
pub fn apply(row: &mut [f64], first: u64, address: &Address, sigma_e: f64) {
    if sigma_e > 0.0 {
        add_normal(address, first, sigma_e, row);
    }
}

/// The same with a width of each pixel's own: log-normal about the median `sigma_e`, of relative width `spread`.
pub fn apply_uneven(
    row: &mut [f64],
    [first, in_pattern]: [u64; 2],
    address: &Address,
    sigma_e: f64,
    spread: f64,
    chip_seed: u64,
    scratch: [&mut [f64]; 2],
) {
    let [noise, widths] = scratch;
    noise.fill(0.0);
    widths.fill(0.0);
    add_normal(address, first, sigma_e, noise);
    add_normal(&pattern::address(chip_seed, Stage::ReadSpread), in_pattern, spread, widths);
    for (value, (noise, width)) in row.iter_mut().zip(noise.iter().zip(widths.iter())) {
        *value += noise * libm::exp(*width);
    }
}
