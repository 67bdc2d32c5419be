//! From electrons to numbers: gain, bias, rounding, clipping.

use crate::scene::Detector;

/// The converter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Converter {
    gain_e_per_adu: f64,
    bias_adu: f64,
    top_adu: f64,
}

impl Converter {
    /// The converter of a detector.
    pub fn of(detector: &Detector) -> Self {
        Self {
            gain_e_per_adu: detector.gain_e_per_adu,
            bias_adu: detector.bias_adu,
            top_adu: f64::from(((1u64 << detector.bits) - 1).min(u64::from(u16::MAX)) as u32),
        }
    }

    /// Numbers \[ADU\] of charges \[e-\].
    pub fn apply(&self, row: &[f64], out: &mut [u16]) {
        for (adu, electrons) in out.iter_mut().zip(row) {
            // a cast from float to integer cuts at the range of u16
            *adu = (electrons / self.gain_e_per_adu + self.bias_adu + 0.5).floor().clamp(0.0, self.top_adu) as u16;
        }
    }

    /// The number that means full: full well or the converter's top, whichever comes first \[ADU\].
    pub fn saturation_adu(&self, full_well_e: f64) -> f64 {
        (full_well_e / self.gain_e_per_adu + self.bias_adu).min(self.top_adu)
    }

    /// The charge at which a pixel is full \[e-\].
    pub fn saturation_e(&self, full_well_e: f64) -> f64 {
        (self.saturation_adu(full_well_e) - self.bias_adu) * self.gain_e_per_adu
    }
}
