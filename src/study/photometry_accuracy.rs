//! Error against run time of the estimators of a flux, on the scene's own frames.
//!
//! * `photometry.flux`: the error is that of the flux against the truth, in units of the Cramer-Rao bound at the known place; an ideal
//!   estimator has rms 1.

use super::errors::{Errors, row};
use crate::base::accuracy::AccuracyRow;
use crate::light::colour::StarLight;
use crate::photometry::header::Overrides;
use crate::photometry::{Frame, Settings};
use crate::run::RunError;
use crate::run::job::Job;
use crate::run::lightcurve::{measure_frame, settings};
use crate::run::pointing::field_stars;
use crate::scene::Method;
use crate::simulate::{SimulateError, Simulator, catalogue};
use std::path::Path;

/// Frames that are made and measured.
const FRAMES: usize = 12;

/// Rows for the scene's first target; none without targets, or where none of the frames shows it.
///
/// # Errors
/// [`RunError`] where frames cannot be made.
pub fn rows(simulator: &Simulator, clock: &(dyn Fn() -> f64 + Sync)) -> Result<Vec<AccuracyRow>, RunError> {
    let scene = simulator.scene;
    if scene.target.is_empty() {
        return Ok(Vec::new());
    }
    let catalogue = catalogue(scene).map_err(SimulateError::from)?;
    let light = StarLight::new(&simulator.response.throughput);
    let mut frames = Vec::new();
    for number in 0..scene.exposures.count.min(FRAMES) {
        let made = simulator.frame(number)?;
        let Some(truth) = made.truth.first().filter(|t| t.snr > 3.0 && !t.saturated) else { continue };
        let data = made.adu.iter().map(|v| *v as f32).collect();
        let size = [made.region.width, made.region.height];
        let name = format!("{number:04}.fits");
        let (frame, _) = Frame::assemble(&made.header, size, data, Path::new(&name), &Overrides::default(), None)?;
        let stars = field_stars(&frame, &catalogue, &light, 0.0);
        frames.push((frame, stars, truth.electrons, truth.electrons / truth.snr));
    }
    if frames.is_empty() {
        return Ok(Vec::new());
    }
    let own = settings(scene);
    let wide = 1.5 * frames[0].0.expected_fwhm_px();
    let tried = [
        ("optimal", Method::Optimal, None),
        ("joint", Method::Joint, None),
        ("aperture, best radius", Method::Aperture, None),
        ("aperture, 1.5 FWHM", Method::Aperture, Some(wide)),
    ];
    let mut rows = Vec::new();
    for (name, method, aperture_px) in tried {
        let how = Settings { method, aperture_px, ..own.clone() };
        let job = Job { scene: Some(scene), ..Job::new(&[], &catalogue, how) };
        let began = clock();
        let mut errors = Vec::new();
        for (frame, stars, electrons, bound) in &frames {
            let measured = measure_frame(frame, stars, &job, Some(&simulator.planner))?;
            let flux_e = measured.first().map_or(f64::NAN, |(m, _)| m.flux_e);
            errors.push((flux_e - electrons) / bound);
        }
        let took = (clock() - began) / frames.len() as f64;
        let bytes = frames[0].0.data.len() * size_of::<f32>();
        let mut row = row("photometry.flux", name.into(), &Errors::of(&errors), "bound", took, bytes);
        row.default = method == own.method && own.aperture_px.is_none() && aperture_px.is_none();
        rows.push(row);
    }
    Ok(rows)
}
