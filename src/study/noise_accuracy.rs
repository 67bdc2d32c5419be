//! What one exposure of a scene leaves uncertain anyway, in the units of the errors: the measure of errors wanted "relative to the noise".
//!
//! A pixel's standard deviation at the frame's centre; of a flux 1/SNR of the first target; of a place FWHM / (2.355 SNR) (King 1983,
//! PASP 95, 163).

use crate::base::accuracy::AccuracyRow;
use crate::camera::expose;
use crate::camera::scenery::Scenery;
use crate::camera::truth;
use crate::plan::view::View;
use crate::simulate::{Simulator, whole};

/// Full width at half maximum of a Gaussian of unit standard deviation.
const FWHM: f64 = 2.355;

/// The noise of an exposure.
#[derive(Debug, Clone, Copy)]
pub(super) struct Noise {
    /// Electrons of sky and dark current in a pixel.
    pub mean_e: f64,
    /// Standard deviation of a pixel \[e-\].
    pub pixel_e: f64,
    /// Signal-to-noise ratio of the first target; 0: none.
    pub snr: f64,
    /// Electrons of the first target.
    target_e: f64,
    /// Standard deviation of a place \[mas\].
    place_mas: f64,
}

impl Noise {
    pub fn of(simulator: &Simulator, view: &View, scenery: &Scenery) -> Self {
        let mean_e = scenery.dark_e + scenery.sky_means.iter().map(|m| m.mean_e_px).sum::<f64>();
        let pixel_e = (mean_e.max(0.0) + expose::floor(&simulator.scene.detector)).sqrt();
        let truth = truth::of(simulator.scene, view, scenery, &whole(simulator.scene));
        let (snr, target_e) = truth.first().map_or((0.0, 0.0), |t| (t.snr, t.electrons));
        Self { mean_e, pixel_e, snr, target_e, place_mas: scenery.seeing_arcsec * 1e3 / FWHM / snr }
    }

    /// The noise in the unit of a row.
    fn of_row(&self, row: &AccuracyRow) -> Option<f64> {
        let value = match row.unit.as_str() {
            "sigma" => 1.0,
            "mas" => self.place_mas,
            "relative" if row.approximation.starts_with("sky.") => self.pixel_e / self.mean_e,
            "relative" | "share" | "of the rms light" => self.snr.recip(),
            "share of light in a pixel" => self.pixel_e / self.target_e,
            _ => return None,
        };
        (value.is_finite() && value > 0.0).then_some(value)
    }

    /// Tell each row its noise.
    pub fn mark(&self, rows: &mut [AccuracyRow]) {
        rows.iter_mut().for_each(|row| row.noise = self.of_row(row));
    }
}
