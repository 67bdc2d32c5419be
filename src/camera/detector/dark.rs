//! Dark current: thermal electrons, doubling every few kelvin.

use crate::scene::Detector;

/// Dark current at the chip's temperature \[e-/s/px\].
pub fn rate(detector: &Detector) -> f64 {
    let warming = detector.temperature_c - detector.dark_temperature_c;
    detector.dark_e_per_s * libm::exp2(warming / detector.dark_doubling_c)
}
