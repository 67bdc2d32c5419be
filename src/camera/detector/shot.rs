//! The count: one Poisson draw of each pixel's summed mean.
//!
//! The sum of independent Poisson numbers is Poisson with the summed mean, so that sky, stars, target and dark
//! current are drawn together.

use crate::base::poisson::draw_poisson;
use crate::base::random::Address;

/// Replace means \[e-\] by counts; `first` is the first pixel's number in the whole frame.
pub fn apply(row: &mut [f64], first: u64, address: &Address) {
    draw_poisson(address, first, row);
}
