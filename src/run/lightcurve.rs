//! From frames to a light curve: read, find the stars of the field, measure, borrow, tabulate.
//!
//! A scene only predicts where to look and fills in geometry; the numbers come from pixels and headers.

use super::RunError;
use super::job::{Job, Row};
use super::pointing::{lent, ready};
use crate::base::table::{Table, Values};
use crate::io::image::keywords;
use crate::light::colour::StarLight;
use crate::light::throughput::Throughput;
use crate::photometry::Origin;
use crate::photometry::{
    FieldStar, Frame, Geometry, Measurement, Place, Settings, add_errors, borrow_zero_points, measure, table,
};
use crate::plan::planner::Planner;
use crate::plan::view::View;
use crate::scene::Scene;
use crate::simulate::SimulateError;
use glam::DVec2;
use rayon::prelude::*;
use std::path::Path;

/// A measured light curve.
#[derive(Debug)]
pub struct LightCurve {
    /// One row a target and frame, in the order of time.
    pub measurements: Vec<Measurement>,
    /// Name of each row's target.
    pub names: Vec<String>,
    /// The table of `lightcurve.ecsv`.
    pub table: Table,
}

/// Settings of the scene's `[photometry]`.
pub fn settings(scene: &Scene) -> Settings {
    let p = &scene.photometry;
    Settings {
        method: p.method,
        aperture_px: p.aperture_px,
        search_px: p.search_px,
        background_px: p.background_px,
        min_stars: p.min_stars,
        ..Settings::default()
    }
}

/// Measure frames.
///
/// # Errors
/// [`RunError`] for frames that cannot be read or lack an essential keyword.
pub fn measure_frames(job: &Job) -> Result<LightCurve, RunError> {
    let planner = job.scene.map(Planner::new).transpose().map_err(SimulateError::from)?;
    let light = star_light(job)?;
    let measured = |number: usize, path: &Path, frame: &Frame, stars: &[FieldStar]| {
        let rows = if job.objects.is_empty() {
            measure_frame(frame, stars, job, planner.as_ref())?
        } else {
            measure_objects(frame, stars, number, job)
        };
        (job.seen)(path, frame, stars, &rows);
        Ok::<_, RunError>(rows)
    };
    let first = job.frames.par_iter().enumerate().map(|(number, path)| {
        let ready = ready(path, job, &light, true)?;
        let rows = measured(number, path, &ready.frame, &ready.stars)?;
        (job.done)();
        Ok((ready.standing, rows))
    });
    let (standings, rows): (Vec<_>, Vec<_>) = first.collect::<Result<Vec<_>, RunError>>()?.into_iter().unzip();
    // where another frame's stars know better than the header, the frame is measured again
    let second = rows.into_par_iter().enumerate().map(|(number, rows)| {
        let path = &job.frames[number];
        match lent(path, number, &standings, job, &light)? {
            Some((frame, stars)) => measured(number, path, &frame, &stars),
            None => Ok(rows),
        }
    });
    let mut rows = second.collect::<Result<Vec<_>, RunError>>()?.into_iter().flatten().collect::<Vec<_>>();
    rows.sort_by_key(|row| row.0.time);
    let (mut measurements, geometry): (Vec<_>, Vec<_>) = rows.into_iter().unzip();
    borrow_zero_points(&mut measurements);
    let geometry = geometry.into_iter().collect::<Option<Vec<_>>>();
    let mut table = table(Origin::Measured, &measurements, geometry.as_deref());
    if job.errors {
        add_errors(&mut table, &measurements);
    }
    if let Some(scene) = job.scene {
        super::model_curve::known(scene, &mut table);
    }
    let target = table.columns.iter().find(|c| c.name == "target").map(|c| &c.values);
    let names = if let Some(Values::Text(names)) = target { names.clone() } else { Vec::new() };
    Ok(LightCurve { measurements, names, table })
}

/// A frame belongs to an exposure of the scene if their middles differ by less than this \[s\].
const SAME_TIME_S: f64 = 0.5;

/// The objects that are in a frame.
fn measure_objects(frame: &Frame, stars: &[FieldStar], number: usize, job: &Job) -> Vec<Row> {
    let there = job.objects.iter().filter_map(|o| Some((&o.name, (*o.places.get(number)?)?)));
    there
        .map(|(name, sky)| {
            let row = measure(frame, stars, &Place::Sky(sky), DVec2::ZERO, &job.settings);
            (Measurement { object: name.clone(), ..row }, None)
        })
        .collect()
}

/// How much light the instrument makes of a star's colour: the scene's instrument, else a typical one behind the filter that
/// the first frame names.
pub(super) fn star_light(job: &Job) -> Result<StarLight, RunError> {
    let throughput = match (job.scene, job.frames.first()) {
        (Some(scene), _) => Throughput::of(scene).map_err(SimulateError::from)?,
        (None, first) => {
            let keywords = first.map(|path| keywords(path)).transpose()?;
            Throughput::typical(keywords.and_then(|k| k.text("FILTER")).as_deref().unwrap_or("none"))
        }
    };
    Ok(StarLight::new(&throughput))
}

/// The scene's targets in a frame, or the one at the place given.
///
/// # Errors
/// [`RunError`] for a frame of another time than the scene's.
pub fn measure_frame(
    frame: &Frame,
    stars: &[FieldStar],
    job: &Job,
    planner: Option<&Planner>,
) -> Result<Vec<Row>, RunError> {
    let Some((planner, scene)) = planner.zip(job.scene) else {
        return Ok(vec![(measure(frame, stars, &job.place, DVec2::ZERO, &job.settings), None)]);
    };
    let view = matching_view(planner, scene, frame)?;
    let rows = scene.target.iter().zip(&view.targets).map(|(target, seen)| {
        let place = match job.place {
            Place::Header => Place::Sky(seen.place.astrometric),
            other => other,
        };
        let pixel = |wcs: &crate::plan::wcs::Wcs, icrs| wcs.pixel(icrs);
        let trail = pixel(&view.wcs.end, seen.start_end[1]).zip(pixel(&view.wcs.start, seen.start_end[0]));
        let trail = trail.map_or(DVec2::ZERO, |(end, start)| end - start);
        let geometry = Geometry {
            target: target.name.clone(),
            airmass: seen.airmass,
            phase_deg: seen.light.phase.to_degrees(),
            range_km: seen.place.range_m / 1e3,
            sun: seen.light.to_sun.to_array(),
            obs: seen.light.to_observer.to_array(),
        };
        (measure(frame, stars, &place, trail, &job.settings), Some(geometry))
    });
    Ok(rows.collect())
}

/// The exposure of the scene whose middle is nearest to the frame's.
fn matching_view(planner: &Planner, scene: &Scene, frame: &Frame) -> Result<View, RunError> {
    let exposures = &scene.exposures;
    let first = exposures.start.plus(0.5 * exposures.duration_s);
    let number = (frame.time.since(&first) / exposures.cadence_s.max(1e-9)).round().max(0.0);
    let number = (number as usize).min(exposures.count.saturating_sub(1));
    let view = planner.view(number).map_err(SimulateError::from)?;
    if view.mid.since(&frame.time).abs() > SAME_TIME_S {
        return Err(RunError::Usage(format!(
            "the frame of {} UTC is none of the scene's exposures; the nearest is that of {} UTC",
            frame.time.iso_utc(),
            view.mid.iso_utc()
        )));
    }
    Ok(view)
}
