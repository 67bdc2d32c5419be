//! Trials: frames of the target's surroundings, drawn and read out like any frame, and measured by the photometry's own estimators.
//!
//! Every trial draws the pixels anew; stars, sky and target keep their means. The image of a point is taken as known as well as
//! many stars of a whole frame tell it: it is fitted once to a bright star without noise, by the photometry. A bright target is placed
//! by the fit, a faint one (below 3 sigma) is where it is expected; an aperture lies at the expected place. The SNR of N
//! trials, mean over standard deviation, has the relative error (1/(2N) + 1/(N SNR^2))^(1/2).

use super::SnrError;
use super::ccd::{Estimator, pixel_fwhm};
use super::stage::{Exposed, Staged};
use crate::camera::region::Region;
use crate::camera::scenery::Scenery;
use crate::light::colour::StarLight;
use crate::photometry::aperture::annulus_radii;
use crate::photometry::calibrate::{bright_sources, point_spread};
use crate::photometry::extract::{Choice, extract};
use crate::photometry::field::{self, Track};
use crate::photometry::growth::Psf;
use crate::photometry::header::Overrides;
use crate::photometry::segment::Segment;
use crate::photometry::zeropoint::ZeroPoint;
use crate::photometry::{Frame, single};
use crate::plan::view::View;
use crate::run::RunError;
use crate::run::pointing::field_stars;
use crate::scene::Method;
use crate::simulate::{SimulateError, Simulator, catalogue};
use glam::DVec2;
use rayon::prelude::*;
use std::path::Path;

/// Trials of a command that does not say how many.
pub const TRIALS: usize = 200;
/// Most trials.
pub const MOST: usize = 1_000_000;
/// Agreement asked of model and trials.
pub const AGREEMENT: f64 = 0.03;
/// Signals below this SNR, or of fewer electrons than the square of it, are not Gaussian enough to be compared.
const LEAST: f64 = 3.0;
/// First frame number of the trials, beyond those of a scene.
const FIRST: usize = 1 << 31;
/// Peak of the star whose image is fitted, above the sky \[e-\].
const BRIGHT_E: f64 = 1e7;
/// How far from its star the image of a point is fitted \[FWHM\].
const REACH: f64 = 24.0;

/// What the trials gave.
#[derive(Debug, Clone, PartialEq)]
pub struct Trials {
    /// Mean flux over its standard deviation.
    pub snr: f64,
    /// Standard error of it.
    pub error: f64,
    /// Why the model does not apply; empty where it does.
    pub beyond: &'static str,
}

impl Trials {
    /// So many trials of a target of so many electrons.
    ///
    /// # Errors
    /// [`SnrError`] where a frame cannot be read back.
    pub fn of(
        simulator: &Simulator,
        staged: &Staged,
        exposed: &mut Exposed,
        electrons: f64,
        estimator: Estimator,
        count: usize,
    ) -> Result<Self, SnrError> {
        let none = Self { snr: f64::NAN, error: f64::NAN, beyond: "no light" };
        let (Some(pixels), Some(scenery)) = (&exposed.pixels, &mut exposed.scenery) else { return Ok(none) };
        let measured = pixels.measure(electrons, estimator);
        let saturated = measured.peak_e >= exposed.full_e;
        let Some(target) = scenery.targets.get_mut(staged.target) else { return Ok(none) };
        target.electrons = electrons;
        let source = Segment { centre: target.path.mid, half: (target.path.end - target.path.start) / 2.0 };
        let scene = &staged.scene;
        let fwhm = pixel_fwhm(&scenery.psf);
        let psf = known_image(simulator, staged, scenery, &source)?;
        let margin = source.half.abs().max_element() + reach(fwhm, &source, measured.aperture_px);
        let Some(region) = Region::around(source.centre, margin, scene.detector.light_px()) else {
            return Ok(none);
        };
        let template = read(simulator, &staged.view, scenery, &region, vec![0.0; region.len()])?;
        let source = source.at(source.centre - DVec2::new(region.x0 as f64, region.y0 as f64));
        let catalogue = catalogue(scene).map_err(SimulateError::from)?;
        let light = StarLight::new(&simulator.response.throughput);
        let stars = field_stars(&template, &catalogue, &light, 0.0);
        let tracks = field::tracks(&template, &stars, fwhm);
        let beside = field::around(&tracks, &source, margin, None);
        let joint = scene.photometry.method == Method::Joint;
        let job = Job { psf: &psf, source, beside: &beside, joint, radius: measured.aperture_px };
        let scenery: &Scenery = scenery;
        let flux = |number: usize| {
            let view = View { frame: FIRST + number, ..staged.view.clone() };
            let adu = simulator.pixels(&view, scenery, &region);
            let data = adu.into_iter().map(|v| v as f32).collect();
            job.flux(&Frame { data, ..template.clone() })
        };
        let fluxes = (0..count).into_par_iter().map(flux).collect::<Vec<_>>();
        let beyond = if saturated {
            "saturated"
        } else if electrons < LEAST * LEAST || measured.snr < LEAST {
            "too few electrons"
        } else if !beside.is_empty() {
            "crowded"
        } else {
            ""
        };
        let (snr, error) = snr_of(&fluxes);
        Ok(Self { snr, error, beyond })
    }

    /// Model and trials in words.
    pub fn agreement(&self, snr: f64, electrons: f64) -> String {
        if electrons <= 0.0 || !self.snr.is_finite() || !snr.is_finite() {
            return "no light".into();
        }
        if !self.beyond.is_empty() {
            return self.beyond.into();
        }
        let chance = 2.0 * self.error / self.snr;
        if (self.snr / snr - 1.0).abs() <= AGREEMENT + chance { "agrees".into() } else { "differs".into() }
    }
}

/// Mean over standard deviation of fluxes, and its standard error; NaN of fewer than two.
fn snr_of(fluxes: &[f64]) -> (f64, f64) {
    let fluxes = fluxes.iter().copied().filter(|f| f.is_finite()).collect::<Vec<_>>();
    let n = fluxes.len() as f64;
    if n < 2.0 {
        return (f64::NAN, f64::NAN);
    }
    let mean = fluxes.iter().sum::<f64>() / n;
    let sigma = (fluxes.iter().map(|f| (f - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
    let snr = mean / sigma;
    (snr, snr.abs() * (0.5 / n + 1.0 / (n * snr * snr)).sqrt())
}

/// How far from a source the photometry looks \[px\].
fn reach(fwhm: f64, source: &Segment, aperture_px: f64) -> f64 {
    let beside = if source.length() < 0.5 * fwhm { 9.0 } else { 17.0 };
    let fitted = (beside * fwhm).max(14.0);
    if aperture_px > 0.0 { fitted.max(annulus_radii(aperture_px, fwhm)[1] + 3.0) } else { fitted }
}

/// A frame of a region as the photometry reads it.
fn read(
    simulator: &Simulator,
    view: &View,
    scenery: &Scenery,
    region: &Region,
    data: Vec<f32>,
) -> Result<Frame, SnrError> {
    let header = simulator.header(view, scenery, region);
    let size = [region.width, region.height];
    let (frame, _) = Frame::assemble(&header, size, data, Path::new("trial"), &Overrides::default(), None)
        .map_err(RunError::from)?;
    Ok(frame)
}

/// The image of a point as the photometry finds it in a bright star without noise that moves as the target does.
fn known_image(
    simulator: &Simulator,
    staged: &Staged,
    scenery: &Scenery,
    source: &Segment,
) -> Result<Psf, SnrError> {
    let scene = &staged.scene;
    let fwhm = pixel_fwhm(&scenery.psf);
    let side = (2.0 * (source.half.abs().max_element() + REACH * fwhm)).ceil() as usize | 1;
    let region = Region { x0: 0, y0: 0, width: side, height: side };
    let middle = source.at(DVec2::splat((side / 2) as f64) + source.centre.fract());
    let path = crate::camera::path::Path {
        start: middle.centre - middle.half,
        mid: middle.centre,
        end: middle.centre + middle.half,
    };
    let mut share = vec![0.0; region.len()];
    scenery.psf.add(&path, 1.0, &region, &mut share);
    let most = share.iter().copied().fold(0.0, f64::max);
    let (gain, bias) = (scene.detector.gain_e_per_adu, scene.detector.bias_adu);
    let data = share.iter().map(|p| (p * BRIGHT_E / most / gain + bias) as f32).collect();
    let mut frame = read(simulator, &staged.view, scenery, &region, data)?;
    frame.saturate_adu = f64::INFINITY;
    let found = bright_sources(&frame, &[], &[], Some(middle), fwhm);
    Ok(point_spread(&frame, &found, fwhm))
}

/// How a trial is measured.
struct Job<'a> {
    psf: &'a Psf,
    source: Segment,
    beside: &'a [Track],
    joint: bool,
    /// Radius of the aperture; NaN for the fit.
    radius: f64,
}

impl Job<'_> {
    fn flux(&self, frame: &Frame) -> f64 {
        if self.radius > 0.0 {
            let ladder = single::ladder(self.psf, &self.source, Some(self.radius), true);
            return ladder.first().map_or(f64::NAN, |aperture| {
                single::flux(frame, &self.source, aperture, self.beside, 0.0).flux_e
            });
        }
        let extract = |free: bool| {
            let choice = Choice { free, joint: self.joint, flat_rms: 0.0 };
            extract(frame, self.psf, &self.source, self.beside, &ZeroPoint::NONE, &choice)
        };
        let placed = extract(true).filter(|e| e.flux_e >= LEAST * e.budget.total());
        placed.or_else(|| extract(false)).map_or(f64::NAN, |e| e.flux_e)
    }
}
