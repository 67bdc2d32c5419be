//! Cells of the sky: bands of one degree of declination, cut into equal cells of about one degree.

use std::f64::consts::{PI, TAU};

/// Number of declination bands.
pub const BANDS: usize = 180;

/// The band of a declination \[rad\].
pub fn band_of(dec: f64) -> usize {
    ((dec / PI + 0.5) * BANDS as f64).floor().clamp(0.0, BANDS as f64 - 1.0) as usize
}

/// Cells of a band: about one degree wide at its middle.
pub fn cells_in(band: usize) -> usize {
    let middle = ((band as f64 + 0.5) / BANDS as f64 - 0.5) * PI;
    (360.0 * middle.cos()).ceil().max(1.0) as usize
}

/// Cells in the bands before `band`.
pub fn cells_before(band: usize) -> usize {
    (0..band).map(cells_in).sum()
}

/// The cell of a place.
pub fn cell_of(ra: f64, dec: f64) -> usize {
    let band = band_of(dec);
    let count = cells_in(band);
    let within = (ra.rem_euclid(TAU) / TAU * count as f64) as usize;
    cells_before(band) + within.min(count - 1)
}
