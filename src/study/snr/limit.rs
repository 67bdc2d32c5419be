//! Limiting magnitudes: of a point, over the sky, and through the night.

use super::ccd::{Estimator, Measured, Pixels};
use crate::astro::observer::airmass;
use crate::astro::time::Instant;
use crate::base::table::Table;
use crate::camera::detector::dark::Dark;
use crate::camera::path::Path;
use crate::plan::PlanError;
use crate::plan::planner::Planner;
use crate::plan::view::Circumstances;
use crate::plan::windows::nights;
use crate::scene::Scene;
use crate::simulate::Simulator;
use crate::sky::Toward;
use crate::study::sky::Sky;
use glam::DVec2;
use rayon::prelude::*;
use std::f64::consts::FRAC_PI_2;

/// Steps of the map in azimuth and elevation \[deg\].
pub const MAP_STEP_DEG: [f64; 2] = [5.0, 2.5];
/// Elevations of the map, from 5 deg to the zenith.
pub const MAP_ROWS: usize = 35;
/// Directions of each.
pub const MAP_COLUMNS: usize = 72;
/// Steps of the night.
const NIGHT_STEPS: usize = 96;
/// Rounds in which electrons are sought; two figures more are gained in each.
const ROUNDS: usize = 60;

/// Electrons at which a measurement reaches an SNR: the variance is a share of the light and a rest, which change little with it.
pub fn limiting_electrons(measure: impl Fn(f64) -> Measured, wanted: f64) -> f64 {
    let mut electrons = wanted * wanted + wanted;
    for _ in 0..ROUNDS {
        let now = measure(electrons);
        let own = now.terms.shot / electrons;
        let (gain, rest) = (now.signal_e / electrons, (now.terms.total() - now.terms.shot).max(0.0));
        // (gain F)^2 = wanted^2 (own F + rest)
        let w2 = wanted * wanted;
        let next = (w2 * own + (w2 * w2 * own * own + 4.0 * gain * gain * w2 * rest).sqrt()) / (2.0 * gain * gain);
        let done = (next / electrons - 1.0).abs() < 1e-9;
        electrons = next;
        if done || !electrons.is_finite() {
            break;
        }
    }
    electrons
}

/// A direction of the map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Toned {
    /// Azimuth from north through east \[deg\].
    pub az_deg: f64,
    /// Apparent elevation \[deg\].
    pub el_deg: f64,
    /// Airmass.
    pub airmass: f64,
    /// Sky in the exposure \[e-/px\]; NaN outside its models.
    pub sky_e_px: f64,
    /// Limiting magnitude; NaN where the sky is unknown.
    pub limiting_mag_v: f64,
}

/// Limiting magnitudes of a followed point with the pixels of one elevation.
struct Ring {
    pixels: Pixels,
    zero_e: f64,
}

impl Ring {
    fn new(simulator: &Simulator, elevation: f64, estimator: Estimator) -> Self {
        let scene = simulator.scene;
        let x = airmass(elevation);
        let (psf, exposure_s) = (simulator.psf(x), scene.exposures.duration_s);
        let dark_e = Dark::new(&scene.detector, exposure_s).mean_e();
        Self {
            pixels: Pixels::lone(&scene.detector, &psf, &Path::still(DVec2::ZERO), [0.0, dark_e], estimator),
            zero_e: simulator.response.stars.solar().at(x) * exposure_s,
        }
    }

    fn limiting_mag(&self, sky_e: f64, estimator: Estimator, wanted: f64) -> f64 {
        if !sky_e.is_finite() || self.zero_e <= 0.0 {
            return f64::NAN;
        }
        let pixels = self.pixels.clone().under(sky_e);
        -2.5 * (limiting_electrons(|e| pixels.measure(e, estimator), wanted) / self.zero_e).log10()
    }
}

/// Limiting magnitudes over the sky at one instant, by elevations from the lowest and azimuths from north: of a point that is
/// followed, stars spread evenly.
pub fn map(simulator: &Simulator, now: &Circumstances, wanted: f64) -> Vec<Toned> {
    let sky = Sky::new(simulator);
    let exposure_s = simulator.scene.exposures.duration_s;
    let estimator = Estimator::of(simulator.scene);
    let row = |row: usize| {
        let el_deg = 5.0 + MAP_STEP_DEG[1] * row as f64;
        let ring = Ring::new(simulator, el_deg.to_radians(), estimator);
        let one = |column: usize| {
            let az_deg = MAP_STEP_DEG[0] * column as f64;
            let toward = Toward::horizontal(&now.observer, az_deg.to_radians(), FRAC_PI_2 - el_deg.to_radians());
            let sky_e_px = sky.towards(now, &toward).iter().sum::<f64>() * exposure_s;
            let limiting_mag_v = ring.limiting_mag(sky_e_px, estimator, wanted);
            Toned { az_deg, el_deg, airmass: toward.airmass, sky_e_px, limiting_mag_v }
        };
        (0..MAP_COLUMNS).map(one).collect::<Vec<_>>()
    };
    let rows = (0..MAP_ROWS).into_par_iter().map(row).collect::<Vec<_>>();
    rows.into_iter().flatten().collect()
}

/// The map as a table.
pub fn map_table(map: &[Toned]) -> Table {
    let mut table = Table::default();
    table.floats("az_deg", "deg", map.iter().map(|t| t.az_deg));
    table.floats("el_deg", "deg", map.iter().map(|t| t.el_deg));
    table.floats("airmass", "", map.iter().map(|t| t.airmass));
    table.floats("sky_e_px", "electron / pix", map.iter().map(|t| t.sky_e_px));
    table.floats("limiting_mag_v", "mag", map.iter().map(|t| t.limiting_mag_v));
    table
}

/// An instant of the night.
#[derive(Debug, Clone, PartialEq)]
pub struct Moment {
    /// Instant, ISO 8601.
    pub time_utc: String,
    /// Hours since the noon before.
    pub hours: f64,
    /// Elevation of the Sun \[deg\].
    pub sun_el_deg: f64,
    /// Elevation of the Moon \[deg\].
    pub moon_el_deg: f64,
    /// Apparent elevation of the target \[deg\]; NaN where its orbit is not known.
    pub el_deg: f64,
    /// Limiting magnitude towards the target; NaN below the horizon and where the sky is unknown.
    pub limiting_mag_v: f64,
    /// Limiting magnitude at the zenith.
    pub zenith_mag_v: f64,
}

/// Limiting magnitudes through the night of an instant, from noon to noon: of a point that is followed, stars spread
/// evenly.
///
/// # Errors
/// [`PlanError`] where the geometry cannot be computed.
pub fn night(simulator: &Simulator, now: &Instant, target: usize, wanted: f64) -> Result<Vec<Moment>, PlanError> {
    let scene = simulator.scene;
    let span = nights(now, now, scene.station.longitude_deg.to_radians());
    let mut nightly: Scene = scene.clone();
    nightly.exposures.start = span.start;
    nightly.exposures.cadence_s = span.seconds() / NIGHT_STEPS as f64;
    nightly.exposures.count = NIGHT_STEPS + 1;
    let planner = Planner::new(&nightly)?;
    let (sky, estimator) = (Sky::new(simulator), Estimator::of(scene));
    let exposure_s = scene.exposures.duration_s;
    let limit = |now: &Circumstances, toward: &Toward| {
        let elevation = FRAC_PI_2 - toward.zenith_distance;
        if elevation <= 0.0 {
            return f64::NAN;
        }
        let sky_e = sky.towards(now, toward).iter().sum::<f64>() * exposure_s;
        Ring::new(simulator, elevation, estimator).limiting_mag(sky_e, estimator, wanted)
    };
    let moment = |frame: usize| {
        let t = span.start.plus(frame as f64 * nightly.exposures.cadence_s);
        let now = planner.circumstances(&t)?;
        let planned = planner.planned(frame)?;
        let seen = planned.view().and_then(|view| view.targets.get(target)).map(|seen| seen.apparent);
        let toward = |azimuth, elevation: f64| Toward::horizontal(&now.observer, azimuth, FRAC_PI_2 - elevation);
        Ok(Moment {
            time_utc: t.iso_utc(),
            hours: frame as f64 * nightly.exposures.cadence_s / 3600.0,
            sun_el_deg: now.sun.horizontal.elevation.to_degrees(),
            moon_el_deg: now.moon.body.horizontal.elevation.to_degrees(),
            el_deg: seen.map_or(f64::NAN, |at| at.elevation.to_degrees()),
            limiting_mag_v: seen.map_or(f64::NAN, |at| limit(&now, &toward(at.azimuth, at.elevation))),
            zenith_mag_v: limit(&now, &toward(0.0, FRAC_PI_2)),
        })
    };
    (0..=NIGHT_STEPS).into_par_iter().map(moment).collect()
}

/// The night as a table.
pub fn night_table(night: &[Moment]) -> Table {
    let mut table = Table::default();
    table.texts("time_utc", night.iter().map(|m| m.time_utc.clone()));
    table.floats("sun_el_deg", "deg", night.iter().map(|m| m.sun_el_deg));
    table.floats("moon_el_deg", "deg", night.iter().map(|m| m.moon_el_deg));
    table.floats("el_deg", "deg", night.iter().map(|m| m.el_deg));
    table.floats("limiting_mag_v", "mag", night.iter().map(|m| m.limiting_mag_v));
    table.floats("zenith_mag_v", "mag", night.iter().map(|m| m.zenith_mag_v));
    table
}
