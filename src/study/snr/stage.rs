//! A scene and a view of it set to a point of a study, and the exposure that follows.

use super::SnrError;
use super::ccd::{Estimator, Pixels};
use super::limit::limiting_electrons;
use super::setting::Setting;
use crate::astro::angles;
use crate::base::units::flux_from_mag;
use crate::camera::detector::convert::Converter;
use crate::camera::scenery::Scenery;
use crate::camera::scintillation;
use crate::object::shadow::card::Graphics;
use crate::plan::planner::Planner;
use crate::plan::view::View;
use crate::scene::{At, Brightness, Orbit, Psf, Scene, Target};
use crate::simulate::{SimulateError, Simulator};

/// V of the target that the exposure is computed with; others are scaled from it.
const REFERENCE_MAG: f64 = 10.0;
/// Most exposures looked at for the typical one.
const MOST_EXPOSURES: usize = 200;

/// A scene without scintillation whose target has a reference magnitude, and the view of one of its exposures.
#[derive(Debug)]
pub struct Staged {
    /// The scene.
    pub scene: Scene,
    /// The exposure, changed to the point's setting.
    pub view: View,
    /// Number of the target studied: the one pointed at.
    pub target: usize,
    /// V that the scene gives it in this exposure; NaN where it is dark or not the scene's.
    pub mag_v: f64,
    /// Relative scintillation of the scene's target.
    pub scintillation: f64,
}

/// The target studied; a scene without one gets a point at the frame's centre, fixed among the stars.
fn target(scene: &mut Scene, frame: usize) -> Result<usize, SimulateError> {
    if scene.target.is_empty() {
        let centre = Planner::new(scene)?.view(frame)?.wcs.mid.centre;
        let (ra, dec) = angles(centre);
        scene.target.push(Target {
            name: "point".into(),
            orbit: Orbit::Fixed { ra_deg: ra.to_degrees(), dec_deg: dec.to_degrees(), range_km: None },
            brightness: Brightness::MagV(REFERENCE_MAG),
            attitude: None,
        });
    }
    let At::Target(Some(name)) = &scene.pointing.at else { return Ok(0) };
    Ok(scene.target.iter().position(|target| target.name == *name).unwrap_or(0))
}

impl Staged {
    /// Frame number `frame` of a scene at a setting.
    ///
    /// # Errors
    /// [`SnrError`] where the geometry cannot be computed or the setting does not fit the scene.
    pub fn new(mut scene: Scene, setting: &Setting, frame: usize) -> Result<Self, SnrError> {
        let frame = frame.min(scene.exposures.count.saturating_sub(1));
        let given = !scene.target.is_empty();
        let number = target(&mut scene, frame)?;
        let planner = Planner::new(&scene).map_err(SimulateError::from)?;
        let mut view = planner.view(frame).map_err(SimulateError::from)?;
        let lights = planner.lights(&view, &Graphics::default()).map_err(SimulateError::from)?;
        let mag_v = lights.get(number).filter(|_| given).map_or(f64::NAN, |light| light.mag_v());
        setting.apply(&mut view, number);
        let airmass = view.targets.get(number).map_or(view.airmass, |seen| seen.airmass);
        let scintillation = scintillation::sigma(&scene, view.exposure_s, airmass);
        let seeing = matches!(scene.telescope.psf, Psf::Gaussian | Psf::Moffat | Psf::Kolmogorov);
        if setting.tracking_error_arcsec.is_some() && !seeing {
            return Err(SnrError::Usage(
                "tracking_error_arcsec widens an image of seeing: telescope.psf must be \"gaussian\", \"moffat\" or \
                 \"kolmogorov\""
                    .into(),
            ));
        }
        scene.station.seeing_arcsec = setting.seeing_arcsec(&scene, view.airmass);
        scene.station.scintillation = false;
        scene.output.format = vec!["fits".into()];
        if let Some(target) = scene.target.get_mut(number) {
            target.brightness = Brightness::MagV(REFERENCE_MAG);
        }
        Ok(Self { scene, view, target: number, mag_v, scintillation })
    }

    /// The exposure. `simulator` is that of this scene.
    ///
    /// # Errors
    /// [`SimulateError`] where it cannot be simulated.
    pub fn expose(&self, simulator: &Simulator) -> Result<Exposed, SimulateError> {
        let mut none = Exposed::none();
        if self.view.exposure_s <= 0.0 {
            none.why = "exposures.duration_s = 0 makes no frame".into();
            return Ok(none);
        }
        let Some(seen) = self.view.targets.get(self.target) else { return Ok(none) };
        if self.view.observability.below_horizon || seen.apparent.elevation <= 0.0 {
            none.why = format!("the target is {:.1} deg below the horizon", -seen.apparent.elevation.to_degrees());
            return Ok(none);
        }
        let scenery = simulator.scenery(&self.view)?;
        if scenery.sky_is_unknown() {
            let unknown = scenery.ledger.iter().find(|row| row.name.starts_with("sky.") && row.bound.is_nan());
            none.why = unknown.map_or_else(String::new, |row| format!("{}: {}", row.name, row.why));
            return Ok(none);
        }
        let pixels = Pixels::of(&self.scene, &scenery, self.target, Estimator::of(&self.scene));
        if pixels.is_none() {
            none.why = "the target is off the frame".into();
            return Ok(none);
        }
        let reference = scenery.targets.get(self.target).map_or(0.0, |target| target.electrons);
        let all = scenery.sky_means.iter().map(|mean| mean.mean_e_px).sum::<f64>();
        let share = |value: f64| if all > 0.0 { value / all } else { 0.0 };
        let sky_shares = scenery.ledger.iter().filter_map(|row| {
            let column = super::table::sky_column(&row.name)?;
            Some((column, share(if row.is_needed() { row.mean_e_px } else { 0.0 })))
        });
        let detector = &self.scene.detector;
        Ok(Exposed {
            zero_e: reference / flux_from_mag(REFERENCE_MAG),
            full_e: Converter::of(detector).saturation_e(detector.stored_full_well_e()),
            sky_shares: sky_shares.collect(),
            pixels,
            scenery: Some(scenery),
            why: String::new(),
        })
    }
}

/// An exposure of a target whose magnitude is open.
#[derive(Debug)]
pub struct Exposed {
    /// Electrons of a target of V = 0.
    pub zero_e: f64,
    /// Mean of a pixel that is saturated \[e-\].
    pub full_e: f64,
    /// Column of each source of the sky and its share of the sky's light.
    pub sky_shares: Vec<(&'static str, f64)>,
    /// The pixels about the target; none where there is no frame.
    pub pixels: Option<Pixels>,
    /// Everything in the frame.
    pub scenery: Option<Scenery>,
    /// Why there is none.
    pub why: String,
}

impl Exposed {
    fn none() -> Self {
        Self {
            zero_e: 0.0,
            full_e: f64::NAN,
            sky_shares: Vec::new(),
            pixels: None,
            scenery: None,
            why: "no target".into(),
        }
    }

    /// Electrons of a target of that magnitude, 0 for one without light; none where there is no frame.
    pub fn electrons(&self, mag_v: f64) -> Option<f64> {
        self.pixels.as_ref()?;
        Some(if mag_v.is_nan() { 0.0 } else { self.zero_e * flux_from_mag(mag_v) })
    }

    /// The magnitude that reaches an SNR; NaN where none does.
    pub fn limiting_mag(&self, estimator: Estimator, wanted: f64) -> f64 {
        let Some(pixels) = &self.pixels else { return f64::NAN };
        let electrons = limiting_electrons(|e| pixels.measure(e, estimator), wanted);
        -2.5 * (electrons / self.zero_e).log10()
    }
}

/// The exposure whose target stands nearest to the mean airmass of all that are above the horizon; the first where none is.
///
/// # Errors
/// [`SimulateError`] where the geometry cannot be computed.
pub fn typical_frame(scene: &Scene) -> Result<usize, SimulateError> {
    let planner = Planner::new(scene)?;
    let step = scene.exposures.count.div_ceil(MOST_EXPOSURES).max(1);
    let mut airmass = Vec::new();
    for frame in (0..scene.exposures.count).step_by(step) {
        if let Some(view) = planner.planned(frame)?.view().filter(|view| !view.observability.below_horizon) {
            airmass.push((frame, view.airmass));
        }
    }
    let mean = airmass.iter().map(|(_, x)| x).sum::<f64>() / airmass.len().max(1) as f64;
    let nearest = airmass.iter().min_by(|a, b| (a.1 - mean).abs().total_cmp(&(b.1 - mean).abs()));
    Ok(nearest.map_or(0, |(frame, _)| *frame))
}
