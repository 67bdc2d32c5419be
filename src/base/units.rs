//! Conversions of angles and of magnitudes.
//!
//! Inside the program angles are radians; degrees and arcseconds appear where people read or write.

use std::f64::consts::PI;

/// Arcseconds in one radian.
pub const ARCSEC_PER_RAD: f64 = 648_000.0 / PI;

/// One arcsecond \[rad\].
pub const ARCSEC: f64 = PI / 648_000.0;

/// Square arcseconds in one square degree.
pub const ARCSEC2_PER_DEG2: f64 = 3600.0 * 3600.0;

/// Flux ratio of a magnitude difference: 10^(-0.4 `mag`).
pub fn flux_from_mag(mag: f64) -> f64 {
    10f64.powf(-0.4 * mag)
}

/// Magnitude of a flux ratio: -2.5 log10(`flux`); NaN for `flux` <= 0.
pub fn mag_from_flux(flux: f64) -> f64 {
    if flux > 0.0 { -2.5 * flux.log10() } else { f64::NAN }
}

/// `angle` \[rad\] wrapped into \[0, 2 pi).
pub fn wrap_two_pi(angle: f64) -> f64 {
    let wrapped = angle.rem_euclid(2.0 * PI);
    if wrapped >= 2.0 * PI { 0.0 } else { wrapped }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tiny_negative_angle_wraps_below_two_pi() {
        let wrapped = wrap_two_pi(-1e-300);
        assert!((0.0..2.0 * PI).contains(&wrapped));
    }
}
