//! Read-out noise: Gaussian, independent from pixel to pixel.

use crate::base::random::Address;
use crate::base::sample::add_normal;

/// Add noise of standard deviation `sigma_e` \[e-\]; `first` is the first pixel's number in the whole frame.
pub fn apply(row: &mut [f64], first: u64, address: &Address, sigma_e: f64) {
    if sigma_e > 0.0 {
        add_normal(address, first, sigma_e, row);
    }
}
