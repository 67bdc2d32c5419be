//! What would change the SNR most: d ln SNR / d ln p of the analytic model, by central differences.
//!
//! The magnitude's is d ln SNR a magnitude; that of the mount's wander, which the scene does not have, is told at a tenth of the
//! seeing.

use super::snr::SnrError;
use super::snr::ccd::{Estimator, Pixels};
use super::snr::setting::Setting;
use super::snr::stage::Staged;
use crate::base::units::flux_from_mag;
use crate::object::shadow::card::Graphics;
use crate::plan::planner::Planner;
use crate::scene::{Brightness, Detector, Scene};
use crate::simulate::{SimulateError, Simulator};
use rayon::prelude::*;

/// Relative step of the differences, and that of a magnitude.
const STEP: f64 = 0.02;

/// One parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensitivity {
    /// Key of the scene, or what it is.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// d ln SNR / d ln p; of a magnitude d ln SNR a magnitude.
    pub slope: f64,
}

/// The SNR of a scene's own target, and what changes it.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensitivities {
    /// Number of the exposure.
    pub frame: usize,
    /// V of the target.
    pub mag_v: f64,
    /// SNR of one exposure.
    pub snr: f64,
    /// The parameters, that of most effect first; none where there is no SNR.
    pub rows: Vec<Sensitivity>,
    /// Why there is none.
    pub why: String,
}

/// A key of the scene that changes the light of an exposure.
struct Key {
    name: &'static str,
    value: fn(&Scene) -> f64,
    change: fn(&mut Scene, f64),
}

const LIGHT: [Key; 4] = [
    Key {
        name: "exposures.duration_s",
        value: |s| s.exposures.duration_s,
        change: |s, f| s.exposures.duration_s *= f,
    },
    Key {
        name: "telescope.aperture_m",
        value: |s| s.telescope.aperture_m,
        change: |s, f| {
            s.telescope.aperture_m *= f;
            s.telescope.obstruction_m *= f;
        },
    },
    Key {
        name: "station.seeing_arcsec",
        value: |s| s.station.seeing_arcsec,
        change: |s, f| s.station.seeing_arcsec *= f,
    },
    Key {
        name: "telescope.throughput",
        value: |s| s.telescope.throughput,
        change: |s, f| s.telescope.throughput *= f,
    },
];

/// V of a target that has no light.
const DARK_MAG: f64 = 60.0;

/// The scene with a constant magnitude in place of every shape, as bright as it is in exposure number `frame`.
fn of_magnitudes(scene: &Scene, frame: usize) -> Result<Scene, SnrError> {
    let mut still = scene.clone();
    if scene.target.iter().all(|t| matches!(t.brightness, Brightness::MagV(_))) {
        return Ok(still);
    }
    let planner = Planner::new(scene).map_err(SimulateError::from)?;
    let view = planner.view(frame).map_err(SimulateError::from)?;
    let lights = planner.lights(&view, &Graphics::default()).map_err(SimulateError::from)?;
    for (target, light) in still.target.iter_mut().zip(lights) {
        if matches!(target.brightness, Brightness::Shape(_)) {
            let mag = light.mag_v();
            target.brightness = Brightness::MagV(if mag.is_finite() { mag } else { DARK_MAG });
        }
    }
    Ok(still)
}

/// The pixels of a scene's exposure at a setting, V and electrons of its target, and why there are none.
struct Point {
    pixels: Option<Pixels>,
    estimator: Estimator,
    mag_v: f64,
    why: String,
    electrons: f64,
}

impl Point {
    fn new(scene: Scene, setting: &Setting, frame: usize) -> Result<Self, SnrError> {
        let staged = Staged::new(scene, setting, frame)?;
        let simulator = Simulator::new(&staged.scene)?;
        let exposed = staged.expose(&simulator)?;
        let electrons = exposed.electrons(staged.mag_v).unwrap_or(0.0);
        let why = if exposed.pixels.is_some() && electrons <= 0.0 {
            "the target has no light".into()
        } else {
            exposed.why
        };
        let estimator = Estimator::of(&staged.scene);
        Ok(Self { pixels: exposed.pixels, estimator, mag_v: staged.mag_v, why, electrons })
    }

    /// ln SNR of these pixels of it, the target `fainter` magnitudes fainter.
    fn ln_snr(&self, pixels: &Pixels, fainter: f64) -> f64 {
        pixels.measure(self.electrons * flux_from_mag(fainter), self.estimator).snr.ln()
    }

    /// Its own ln SNR; NaN where there are no pixels.
    fn own(&self) -> f64 {
        self.pixels.as_ref().map_or(f64::NAN, |pixels| self.ln_snr(pixels, 0.0))
    }
}

/// d y / d ln p by central differences.
fn slope(at: impl Fn(f64) -> Result<f64, SnrError>) -> Result<f64, SnrError> {
    Ok((at(1.0 + STEP)? - at(1.0 - STEP)?) / ((1.0 + STEP).ln() - (1.0 - STEP).ln()))
}

/// The sensitivities of a scene's target in exposure number `frame`. Shapes are as bright as they are in that exposure, whatever changes.
///
/// # Errors
/// [`SnrError`] where the scene cannot be simulated.
pub fn sensitivities(scene: &Scene, frame: usize) -> Result<Sensitivities, SnrError> {
    let none = Setting::default();
    let scene = &of_magnitudes(scene, frame)?;
    let here = Point::new(scene.clone(), &none, frame)?;
    let mut all =
        Sensitivities { frame, mag_v: here.mag_v, snr: here.own().exp(), rows: Vec::new(), why: here.why.clone() };
    let Some(pixels) = here.pixels.as_ref().filter(|_| here.own().is_finite()) else { return Ok(all) };
    let of_light = |key: &Key| {
        let at = |factor: f64| {
            let mut scene = scene.clone();
            (key.change)(&mut scene, factor);
            Ok(Point::new(scene, &none, frame)?.own())
        };
        Ok(Sensitivity { name: key.name, value: (key.value)(scene), slope: slope(at)? })
    };
    let mut rows = LIGHT.par_iter().map(of_light).collect::<Result<Vec<_>, SnrError>>()?;
    let mut of_pixels = |name: &'static str, value: f64, change: &dyn Fn(Pixels, f64) -> Pixels| {
        let at = |factor: f64| Ok(here.ln_snr(&change(pixels.clone(), factor), 0.0));
        let row = slope(at).map(|slope| Sensitivity { name, value, slope });
        row.map(|row| rows.push(row))
    };
    let detector = &scene.detector;
    of_pixels("detector.read_noise_e", detector.read_noise_e, &|pixels, factor| {
        pixels.read_by(&Detector { read_noise_e: factor * detector.read_noise_e, ..detector.clone() })
    })?;
    of_pixels("detector.gain_e_per_adu", detector.gain_e_per_adu, &|pixels, factor| {
        pixels.read_by(&Detector { gain_e_per_adu: factor * detector.gain_e_per_adu, ..detector.clone() })
    })?;
    of_pixels("detector.dark_e_per_s", detector.dark_e_per_s, &Pixels::darker)?;
    of_pixels("brightness of the sky", 1.0, &Pixels::brighter)?;
    let of_mag = (here.ln_snr(pixels, STEP) - here.ln_snr(pixels, -STEP)) / (2.0 * STEP);
    rows.push(Sensitivity { name: "target's magnitude", value: here.mag_v, slope: of_mag });
    let wander = 0.1 * scene.station.seeing_arcsec;
    let tracking = |factor: f64| {
        let setting = Setting { tracking_error_arcsec: Some(wander * factor), ..none };
        Ok(Point::new(scene.clone(), &setting, frame)?.own())
    };
    match slope(tracking) {
        Ok(slope) => rows.push(Sensitivity { name: "tracking error [arcsec]", value: wander, slope }),
        // images that no seeing makes are not widened by it
        Err(SnrError::Usage(_)) => {}
        Err(other) => return Err(other),
    }
    rows.sort_by(|a, b| b.slope.abs().total_cmp(&a.slope.abs()));
    all.rows = rows;
    Ok(all)
}
