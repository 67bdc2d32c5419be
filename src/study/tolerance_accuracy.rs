//! Error against run time of what a key of `[accuracy]` decides, by the scene itself made with other values of the key: the tightest is the
//! reference.
//!
//! * `stars.omit`: stars and sources left out (`omit`); the error of pixels' means, in standard deviations of a pixel. The tolerance is
//!   one of the root mean square.
//! * `stars.trail`: stars that share the image of a trail (`trail_px`), against each by its own; in standard deviations of a pixel.
//! * `object.light`: light of shapes over an exposure, shadows and time together (`brightness`).
//! * `orbit.forces`: forces left out of an integrated orbit (`position_mas`).

use super::errors::{Errors, ladder, row, timed};
use crate::astro::separation;
use crate::base::accuracy::{AccuracyRow, Tolerance};
use crate::base::units::ARCSEC;
use crate::camera::expose;
use crate::camera::region::Region;
use crate::plan::planner::Planner;
use crate::plan::view::View;
use crate::scene::{Brightness, Orbit, Scene};
use crate::simulate::{SimulateError, Simulator};

/// Side of the patches of a frame that are compared \[px\].
const PATCH: usize = 160;
/// Tighter tolerances are tried until one takes so long \[s\].
const LONGEST_S: f64 = 4.0;
/// Exposures whose light or places are compared.
const EXPOSURES: usize = 6;

type Clock<'a> = &'a (dyn Fn() -> f64 + Sync);
/// A tolerance, what it gives, the time \[s\] and the memory \[bytes\] it takes.
type Trial<T> = (f64, T, f64, usize);

/// Rows for one exposure of a scene.
///
/// # Errors
/// [`SimulateError`] where the scene cannot be simulated with another tolerance.
pub(super) fn rows(simulator: &Simulator, view: &View, clock: Clock) -> Result<Vec<AccuracyRow>, SimulateError> {
    let mut rows = omit(simulator, view, clock)?;
    rows.extend(trail(simulator, view, clock)?);
    rows.extend(light(simulator, clock)?);
    rows.extend(orbit(simulator.scene, clock)?);
    Ok(rows)
}

/// The scene with another tolerance.
fn with(scene: &Scene, key: &str, value: f64) -> Scene {
    let mut other = scene.clone();
    other.accuracy = scene.accuracy.with(key, value);
    other
}

/// Patches of a frame: a corner, where the field is most distorted, and the centre.
fn patches(scene: &Scene) -> [Region; 2] {
    let [width, height] = scene.detector.light_px();
    let (w, h) = (PATCH.min(width), PATCH.min(height));
    [(0, 0), ((width - w) / 2, (height - h) / 2)].map(|(x0, y0)| Region { x0, y0, width: w, height: h })
}

/// Means \[e-\] of the patches' pixels, then their standard deviations; and the memory of what they were made from.
fn means(simulator: &Simulator, view: &View) -> Result<(Vec<f64>, Vec<f64>, usize), SimulateError> {
    let scenery = simulator.scenery(view)?;
    let (mut means, mut deviations) = (Vec::new(), Vec::new());
    for patch in patches(simulator.scene) {
        let chip = simulator.chip(view, &scenery, &patch);
        let (mean, variance) = expose::planes(&chip, &simulator.scene.detector, &patch);
        means.extend(mean.into_iter().map(f64::from));
        deviations.extend(variance.into_iter().map(|v| f64::from(v).sqrt()));
    }
    let bytes = scenery.ledger.iter().map(|row| row.bytes as usize).sum();
    Ok((means, deviations, bytes))
}

/// Try tolerances from the loosest on; those after one that takes too long are left out.
fn trials<T>(
    scene: &Scene,
    key: &str,
    steps: &[f64],
    mut one: impl FnMut(f64) -> Result<(T, f64, usize), SimulateError>,
) -> Result<Vec<Trial<T>>, SimulateError> {
    let mut trials = Vec::new();
    for value in ladder(steps, scene.accuracy.value(key).unwrap_or(1.0)) {
        let (found, seconds, bytes) = one(value)?;
        trials.push((value, found, seconds, bytes));
        if seconds > LONGEST_S {
            break;
        }
    }
    Ok(trials)
}

/// The rows of trials whose errors against the last one `errors` gives.
fn told<T>(
    scene: &Scene,
    (name, key, unit): (&str, &'static str, &str),
    trials: &[Trial<T>],
    errors: impl Fn(&T, &T) -> Vec<f64>,
) -> Vec<AccuracyRow> {
    let Some((_, exact, ..)) = trials.last() else { return Vec::new() };
    let own = scene.accuracy.value(key);
    let told = |(value, found, seconds, bytes): &Trial<T>| {
        let mut row =
            row(name, format!("{key} = {value:e}"), &Errors::of(&errors(found, exact)), unit, *seconds, *bytes);
        row.default = own == Some(*value);
        row.by = Some(Tolerance::exactly(key, *value));
        row
    };
    trials.iter().map(told).collect()
}

fn omit(simulator: &Simulator, view: &View, clock: Clock) -> Result<Vec<AccuracyRow>, SimulateError> {
    let scene = simulator.scene;
    let trials = trials(scene, "omit", &[0.3, 0.1, 0.03, 0.01, 3e-3, 1e-3], |value| {
        let other = with(scene, "omit", value);
        let simulator = Simulator::new(&other)?;
        let (found, seconds) = timed(clock, || means(&simulator, view));
        let (mean, deviation, bytes) = found?;
        Ok(((mean, deviation), seconds, bytes))
    })?;
    let mut rows = told(scene, ("stars.omit", "omit", "sigma"), &trials, |(found, _), (exact, deviation)| {
        found.iter().zip(exact).zip(deviation).map(|((f, e), s)| (f - e) / s).collect()
    });
    rows.iter_mut().for_each(|row| row.by_rms = true);
    Ok(rows)
}

/// No rows where no star trails: then each has its own stamp, whatever the tolerance.
fn trail(simulator: &Simulator, view: &View, clock: Clock) -> Result<Vec<AccuracyRow>, SimulateError> {
    let scene = simulator.scene;
    let scenery = simulator.scenery(view)?;
    let narrow = scenery.psf.profile().fwhm();
    if scenery.stars.iter().all(|star| star.path.length() < narrow) {
        return Ok(Vec::new());
    }
    let mut trials = trials(scene, "trail_px", &[3.0, 1.0, 0.3, 0.1, 0.03, 0.01, 1e-3], |value| {
        let other = with(scene, "trail_px", value);
        let simulator = Simulator::new(&other)?;
        let (found, seconds) = timed(clock, || means(&simulator, view));
        let (mean, deviation, bytes) = found?;
        Ok(((mean, deviation), seconds, bytes))
    })?;
    // no two trails agree to nothing: each star by its own stamps
    let apart = with(scene, "trail_px", 0.0);
    let simulator = Simulator::new(&apart)?;
    let (found, seconds) = timed(clock, || means(&simulator, view));
    let (mean, deviation, bytes) = found?;
    trials.push((0.0, (mean, deviation), seconds, bytes));
    let unit = ("stars.trail", "trail_px", "sigma");
    let mut rows = told(scene, unit, &trials, |(found, _), (exact, deviation)| {
        found.iter().zip(exact).zip(deviation).map(|((f, e), s)| (f - e) / s).collect()
    });
    if let Some(row) = rows.last_mut() {
        (row.setting, row.by) = ("each star by its own stamps".into(), None);
    }
    Ok(rows)
}

/// Numbers of some exposures, from the first to the last.
fn some(scene: &Scene) -> Vec<usize> {
    let count = scene.exposures.count.min(EXPOSURES);
    (0..count).map(|k| k * (scene.exposures.count - 1) / (count - 1).max(1)).collect()
}

fn light(simulator: &Simulator, clock: Clock) -> Result<Vec<AccuracyRow>, SimulateError> {
    let scene = simulator.scene;
    if !scene.target.iter().any(|target| matches!(target.brightness, Brightness::Shape(_))) {
        return Ok(Vec::new());
    }
    let views = some(scene).into_iter().map(|k| simulator.planner.view(k)).collect::<Result<Vec<_>, _>>()?;
    let steps = [0.1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6];
    let trials = trials(scene, "brightness", &steps, |value| {
        let other = with(scene, "brightness", value);
        let planner = Planner::new(&other)?;
        let (found, seconds) = timed(clock, || {
            let lights = views.iter().map(|view| planner.lights(view, &simulator.graphics));
            lights.collect::<Result<Vec<_>, _>>()
        });
        let flux = found?.into_iter().flatten().map(|light| light.v_flux).collect::<Vec<_>>();
        Ok((flux, seconds / views.len().max(1) as f64, 0))
    })?;
    Ok(told(scene, ("object.light", "brightness", "relative"), &trials, |found, exact| {
        found.iter().zip(exact).filter(|(_, e)| **e > 0.0).map(|(f, e)| f / e - 1.0).collect()
    }))
}

fn orbit(scene: &Scene, clock: Clock) -> Result<Vec<AccuracyRow>, SimulateError> {
    let integrated = |k: &usize| matches!(scene.target[*k].orbit, Orbit::State { .. } | Orbit::Kepler { .. });
    let targets = (0..scene.target.len()).filter(integrated).collect::<Vec<_>>();
    if targets.is_empty() {
        return Ok(Vec::new());
    }
    let trials = trials(scene, "position_mas", &[1000.0, 100.0, 10.0, 1.0, 0.1, 0.01], |value| {
        let other = with(scene, "position_mas", value);
        let (planner, seconds) = timed(clock, || Planner::new(&other));
        let planner = planner?;
        let mut places = Vec::new();
        for frame in some(scene) {
            let t = scene.exposures.start.plus(frame as f64 * scene.exposures.cadence_s);
            let observer = planner.observer(&t)?;
            let motions = targets.iter().filter_map(|k| planner.motion(*k));
            places.extend(motions.map(|motion| motion.place_from(&observer, &t).ok().map(|p| p.astrometric)));
        }
        Ok((places, seconds, 0))
    })?;
    Ok(told(scene, ("orbit.forces", "position_mas", "mas"), &trials, |found, exact| {
        let both = found.iter().zip(exact).filter_map(|(f, e)| f.zip(*e));
        both.map(|(f, e)| separation(f, e) / ARCSEC * 1e3).collect()
    }))
}
