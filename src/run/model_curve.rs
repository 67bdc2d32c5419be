//! The light curve of a scene without images: what would be measured if nothing disturbed it.

use super::RunError;
use crate::astro::angles;
use crate::base::table::Table;
use crate::light::throughput::Throughput;
use crate::object::shadow::card::Graphics;
use crate::photometry::Measurement;
use crate::photometry::lightcurve::{Geometry, Origin, table};
use crate::plan::brightness::{Glow, TargetLight};
use crate::plan::planner::Planner;
use crate::plan::view::Sighting;
use crate::scene::{Brightness, Scene, Target};
use crate::simulate::SimulateError;
use crate::sky::response::Response;
use rayon::prelude::*;
use serde_json::Value as Json;

/// One epoch of one target.
#[derive(Debug, Clone)]
pub struct Epoch {
    /// Number of the exposure.
    pub frame: usize,
    /// Its geometry.
    pub seen: Sighting,
    /// Its light.
    pub light: TargetLight,
}

/// The light curve of one target.
#[derive(Debug, Clone)]
pub struct Curve {
    /// Name of the target.
    pub target: String,
    /// How its light was found, in words.
    pub way: String,
    /// Its epochs, in order.
    pub epochs: Vec<Epoch>,
}

/// Epochs that a thread takes at a time, and that are drawn together by a graphics processor.
const BATCH: usize = 8;
const CARD_BATCH: usize = 256;

/// The light curves of a scene's targets over all its exposures: horizon and daylight are ignored. `done` is called after each epoch.
///
/// # Errors
/// [`RunError`] where a place or an attitude is not known.
pub fn curves(
    scene: &Scene,
    planner: &Planner,
    graphics: &Graphics,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<Curve>, RunError> {
    let curve = |(target, own): (usize, &crate::scene::Target)| {
        let some = |glow: &mut Option<Glow>, frames: Vec<usize>| {
            let seen =
                frames.iter().map(|frame| planner.sighting(*frame, target)).collect::<Result<Vec<_>, _>>()?;
            let lights = match glow {
                Some(glow) => glow.over_all(&seen)?,
                None => vec![TargetLight::dark(); seen.len()],
            };
            frames.iter().for_each(|_| done());
            let epochs = frames.into_iter().zip(seen).zip(lights);
            Ok(epochs.map(|((frame, seen), light)| Epoch { frame, seen, light }).collect::<Vec<_>>())
        };
        let batch = if graphics.card.is_some() { CARD_BATCH } else { BATCH };
        let epochs = (0..scene.exposures.count)
            .into_par_iter()
            .chunks(batch)
            .map_init(|| planner.glow(target, graphics), some)
            .collect::<Result<Vec<_>, crate::plan::PlanError>>()
            .map_err(SimulateError::from)?;
        let epochs = epochs.into_iter().flatten().collect();
        let means = planner.glow(target, graphics).and_then(|glow| glow.means());
        let way = means.map_or_else(|| "constant V magnitude".into(), |means| means.way.describe());
        Ok(Curve { target: own.name.clone(), way, epochs })
    };
    scene.target.iter().enumerate().map(curve).collect()
}

/// The curves as the table `lightcurve.ecsv`: the columns of a measured one, and the light itself.
///
/// An instantaneous exposure collects nothing; its electrons and zero point are those of one second.
///
/// # Errors
/// [`RunError`] for a table of the scene that cannot be used.
pub fn to_table(scene: &Scene, curves: &[Curve]) -> Result<Table, RunError> {
    let throughput = Throughput::of(scene).map_err(SimulateError::from)?;
    let response = Response::new(scene, throughput).map_err(SimulateError::from)?;
    let exptime = scene.exposures.duration_s;
    let seconds = if exptime > 0.0 { exptime } else { 1.0 };
    let rows = curves.iter().flat_map(|curve| curve.epochs.iter().map(move |epoch| (curve, epoch)));
    let rows = rows.collect::<Vec<_>>();
    let measurement = |(curve, epoch): &(&Curve, &Epoch)| {
        let (seen, light) = (&epoch.seen, &epoch.light);
        let (ra, dec) = angles(seen.place.astrometric);
        let per_v_zero = response.stars.solar().at(seen.airmass) * seconds;
        let mut m = Measurement::blank(seen.mid);
        m.frame = Some(epoch.frame as u64);
        m.object.clone_from(&curve.target);
        m.exptime_s = exptime;
        (m.ra_deg, m.dec_deg) = (ra.to_degrees(), dec.to_degrees());
        (m.flux_e, m.flux_err_e) = (light.v_flux * per_v_zero, light.error * per_v_zero);
        (m.zeropoint_mag, m.zeropoint_err) = (2.5 * per_v_zero.log10(), 0.0);
        m.set_magnitude();
        m
    };
    let geometry = |(curve, epoch): &(&Curve, &Epoch)| {
        let seen = &epoch.seen;
        Geometry {
            target: curve.target.clone(),
            airmass: seen.airmass,
            phase_deg: seen.light.phase.to_degrees(),
            range_km: seen.place.range_m / 1e3,
            sun: seen.light.to_sun.to_array(),
            obs: seen.light.to_observer.to_array(),
        }
    };
    let measurements = rows.iter().map(measurement).collect::<Vec<_>>();
    let geometry = rows.iter().map(geometry).collect::<Vec<_>>();
    let mut table = table(Origin::Model, &measurements, Some(&geometry));
    for (target, curve) in scene.target.iter().zip(curves) {
        table.note(&format!("light of {}", curve.target), curve.way.as_str());
        if let Brightness::Shape(shaped) = &target.brightness {
            table.note(&format!("faces of {}", curve.target), shaped.built.body.faces.len());
        }
    }
    known(scene, &mut table);
    if exptime == 0.0 {
        table.note("instantaneous", "flux_e, flux_err_e and zeropoint_mag are those of one second");
    }
    let irradiance = |(_, epoch): &(&Curve, &Epoch)| epoch.light.irradiance_w_m2();
    table.floats(
        "radiant_intensity_w_sr",
        "W / sr",
        rows.iter().map(|row| irradiance(row) * row.1.seen.place.range_m.powi(2)),
    );
    table.floats("irradiance_w_m2", "W / m2", rows.iter().map(irradiance));
    Ok(table)
}

/// What is known of the targets' attitudes and materials, as metadata: objects of the scene's keys, by target.
pub fn known(scene: &Scene, table: &mut Table) {
    let mut note = |key: &str, of: &dyn Fn(&Target) -> Option<Json>| {
        let all = scene.target.iter().filter_map(|t| Some((t.name.clone(), of(t)?)));
        let all = all.collect::<serde_json::Map<_, _>>();
        if !all.is_empty() {
            table.note(key, all);
        }
    };
    note("attitude", &Target::attitude_keys);
    note("brdf", &Target::material_keys);
}
