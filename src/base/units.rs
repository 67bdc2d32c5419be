//! Conversions of angles and of surface brightness.
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

/// Surface brightness \[mag/arcsec^2\] of `s10` stars of 10th magnitude per square degree.
/// 1 S10 = 27.78 mag/arcsec^2 (Leinert et al. 1998, A&AS 127, 1, sect. 2).
pub fn mag_arcsec2_from_s10(s10: f64) -> f64 {
    10.0 + mag_from_flux(s10 / ARCSEC2_PER_DEG2)
}

/// Surface brightness \[mag/arcsec^2\] of a luminance \[mcd/m^2\]: -2.5 log10(L / 1.08e8).
/// Falchi et al. 2016, Sci. Adv. 2, e1600377.
pub fn mag_arcsec2_from_mcd_m2(luminance: f64) -> f64 {
    mag_from_flux(luminance / 1.08e8)
}

/// Radiance of scattered light \[mag/arcsec^2 in V\] from nanolamberts.
/// Krisciunas & Schaefer 1991, PASP 103, 1033, eq. 1 (Garstang 1989).
pub fn mag_arcsec2_from_nanolambert(nanolambert: f64) -> f64 {
    if nanolambert > 0.0 { (20.7233 - (nanolambert / 34.08).ln()) / 0.92104 } else { f64::NAN }
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
    fn one_s10_is_27_78_mag_per_square_arcsecond() {
        assert!((mag_arcsec2_from_s10(1.0) - 27.7816).abs() < 1e-3);
    }

    #[test]
    fn natural_sky_of_the_world_atlas_is_22_mag() {
        assert!((mag_arcsec2_from_mcd_m2(0.171168) - 22.0).abs() < 2e-3);
    }

    #[test]
    fn a_tiny_negative_angle_wraps_below_two_pi() {
        let wrapped = wrap_two_pi(-1e-300);
        assert!((0.0..2.0 * PI).contains(&wrapped));
    }
}
