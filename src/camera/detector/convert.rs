//! From electrons to numbers: gain, bias, rounding, clipping.

use crate::scene::Detector;

/// The converter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Converter {
    gain_e_per_adu: f64,
    /// 1 over the gain: a product costs a fifth of a quotient.
    adu_per_e: f64,
    bias_adu: f64,
    top_adu: f64,
    /// Share missing at full well, and read noise \[e-\]: where saturation is told.
    nonlinearity: f64,
    read_noise_e: f64,
}

/// A number of the converter as stored: 16 or 32 bits, unsigned.
pub trait Number: Copy + Default + Send + Sync {
    /// The lowest bits of a word.
    fn low(bits: u64) -> Self;
}

impl Number for u16 {
    #[inline(always)]
    fn low(bits: u64) -> Self {
        bits as u16
    }
}

impl Number for u32 {
    #[inline(always)]
    fn low(bits: u64) -> Self {
        bits as u32
    }
}

impl Converter {
    /// The converter of a detector.
    pub fn of(detector: &Detector) -> Self {
        Self {
            gain_e_per_adu: detector.gain_e_per_adu,
            adu_per_e: 1.0 / detector.gain_e_per_adu,
            bias_adu: detector.bias_adu,
            top_adu: ((1u64 << detector.bits) - 1) as f64,
            nonlinearity: detector.nonlinearity,
            read_noise_e: detector.read_noise_rms_e(),
        }
    }

    /// The nearest whole number to a level, halves to the even one; cut at 0 and at the top.
    #[inline(always)]
    fn number<N: Number>(&self, level: f64) -> N {
        /// Adding 2^52 rounds to a whole number, which then stands in the lowest bits.
        const ROUND: f64 = 4_503_599_627_370_496.0;
        let level = if level > 0.0 { level } else { 0.0 };
        N::low(((if level < self.top_adu { level } else { self.top_adu }) + ROUND).to_bits())
    }

    /// Numbers \[ADU\] of charges \[e-\].
    #[inline(always)]
    pub fn apply<N: Number>(&self, row: &[f64], out: &mut [N]) {
        for (adu, electrons) in out.iter_mut().zip(row) {
            *adu = self.number(electrons * self.adu_per_e + self.bias_adu);
        }
    }

    /// The same with an offset of each pixel \[ADU\] and a factor of its gain.
    pub fn apply_uneven<N: Number>(&self, row: &[f64], offsets: &[f64], gains: &[f64], out: &mut [N]) {
        for (((adu, electrons), offset), gain) in out.iter_mut().zip(row).zip(offsets).zip(gains) {
            *adu = self.number(electrons / (self.gain_e_per_adu * gain) + self.bias_adu + offset);
        }
    }

    /// The number that means full \[ADU\]: the full well as the output bends it, less three times the read noise, which may hide it,
    /// or the converter's top, whichever comes first.
    pub fn saturation_adu(&self, full_well_e: f64) -> f64 {
        let read_e = full_well_e * (1.0 - self.nonlinearity) - 3.0 * self.read_noise_e;
        (read_e.max(0.0) / self.gain_e_per_adu + self.bias_adu).min(self.top_adu)
    }

    /// The charge at which a pixel is full \[e-\].
    pub fn saturation_e(&self, full_well_e: f64) -> f64 {
        full_well_e.min((self.top_adu - self.bias_adu) * self.gain_e_per_adu)
    }
}
