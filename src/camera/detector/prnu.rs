//! Pixel response non-uniformity: each pixel turns a little more or less of the light into charge (Janesick 2001, Scientific
//! CCDs, sect. 4.2.3). Dark current and smear are not touched: they are no light of that pixel.

use super::pattern;
use crate::base::random::Stage;

/// Multiply light \[e-\] by 1 + `rms` z; `first` is the first pixel's number, `scratch` as long as the row.
pub fn apply(row: &mut [f64], first: u64, chip_seed: u64, rms: f64, scratch: &mut [f64]) {
    pattern::factors(chip_seed, Stage::Prnu, first, rms, scratch);
    row.iter_mut().zip(scratch).for_each(|(light, factor)| *light *= *factor);
}
