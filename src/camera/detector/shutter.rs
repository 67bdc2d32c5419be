//! Shutters that take time.
//!
//! An iris in front of the chip opens from the centre and closes towards it: a pixel at the share r of the way to the corner
//! is exposed for t - 2 s r, s being the travel from centre to corner. A rolling shutter exposes row y from s y / H on, as
//! long as any other; s is the time from the first row to the last.

/// Share of the exposure that an iris takes from the corner, of a travel of `shutter_s`; above 1 the corner is never open.
pub fn iris_loss(shutter_s: f64, exposure_s: f64) -> f64 {
    if exposure_s > 0.0 { 2.0 * shutter_s / exposure_s } else { 0.0 }
}
