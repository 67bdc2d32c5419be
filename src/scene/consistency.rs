//! Contradictions among a station's own figures: what no single key can tell and no fault forbids.

use super::types::Scene;
use crate::astro::observer::standard_pressure_hpa;

/// What looks contradictory in station, telescope and detector, in words with the figures; empty if nothing does.
///
/// Pressure within 8 % of the standard atmosphere at the height (weather and cold columns make 5 %); full well and
/// converter within a factor 4 of each other, and the converter's step below twice the read noise; focal ratio in
/// 0.8..40; the seeing no smaller than diffraction.
pub fn contradictions(scene: &Scene) -> Vec<String> {
    let (station, telescope, detector) = (&scene.station, &scene.telescope, &scene.detector);
    let mut found = Vec::new();
    let standard = standard_pressure_hpa(station.height_m);
    let ratio = station.pressure_hpa / standard;
    if station.pressure_hpa > 0.0 && !(0.92..=1.08).contains(&ratio) {
        found.push(format!(
            "station.pressure_hpa = {} hPa, but the standard atmosphere has {standard:.0} hPa at height_m = {} m",
            station.pressure_hpa, station.height_m
        ));
    }
    let counts = libm::exp2(f64::from(detector.bits)) - 1.0 - detector.bias_adu;
    let converter_e = counts * detector.gain_e_per_adu;
    if !(0.25..=4.0).contains(&(converter_e / detector.full_well_e)) {
        found.push(format!(
            "detector.gain_e_per_adu = {}: the converter ends at {converter_e:.0} e-, the full well is {} e-",
            detector.gain_e_per_adu, detector.full_well_e
        ));
    }
    if detector.read_noise_e > 0.0 && detector.gain_e_per_adu > 2.0 * detector.read_noise_e {
        found.push(format!(
            "detector.gain_e_per_adu = {}: a step of the converter hides the read noise of {} e-",
            detector.gain_e_per_adu, detector.read_noise_e
        ));
    }
    let focal_ratio = telescope.focal_length_m / telescope.aperture_m;
    if !(0.8..=40.0).contains(&focal_ratio) {
        found.push(format!(
            "telescope: a focal length of {:.3} m with an aperture of {} m is f/{focal_ratio:.2}",
            telescope.focal_length_m, telescope.aperture_m
        ));
    }
    let diffraction = (1.03 * 550e-9 / telescope.aperture_m).to_degrees() * 3600.0;
    if station.seeing_arcsec < diffraction {
        found.push(format!(
            "station.seeing_arcsec = {}: the diffraction of {} m is {diffraction:.2} arcsec",
            station.seeing_arcsec, telescope.aperture_m
        ));
    }
    found
}
