//! From frames to a light curve: read, find the stars of the field, measure, borrow, tabulate.
//!
//! A scene only predicts where to look and fills in geometry; the numbers come from pixels and headers.

use super::RunError;
use crate::base::table::{Table, Values};
use crate::base::units::mag_from_flux;
use crate::io::image::{Image, keywords};
use crate::light::colour::StarLight;
use crate::light::throughput::Throughput;
use crate::photometry::Origin;
use crate::photometry::PhotometryError;
use crate::photometry::astrometry::Refusal;
use crate::photometry::header::{Note, NoteKind, Overrides};
use crate::photometry::reduce::Calibration;
use crate::photometry::solve::{self, Solved};
use crate::photometry::{
    FieldStar, Frame, Geometry, Measurement, Place, Settings, add_errors, borrow_zero_points, measure, table,
};
use crate::plan::planner::Planner;
use crate::plan::view::View;
use crate::scene::Scene;
use crate::simulate::SimulateError;
use crate::stars::catalogue::{Catalogue, moved};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// What to measure.
pub struct Job<'j> {
    /// The frames.
    pub frames: &'j [PathBuf],
    /// Where the target is expected, if no scene tells.
    pub place: Place,
    /// The scene the frames belong to, if known.
    pub scene: Option<&'j Scene>,
    /// Catalogue of the zero point's stars.
    pub catalogue: &'j Catalogue,
    /// How to measure.
    pub settings: Settings,
    /// Whether the table tells what the errors are made of.
    pub errors: bool,
    /// What counts in place of the frames' headers.
    pub overrides: Overrides,
    /// What is measured in place of the scene's targets or the header's.
    pub objects: Vec<Object>,
    /// Masters to calibrate the frames with.
    pub masters: Option<Calibration>,
    /// Called with a remark on a frame, and whether it is a warning.
    pub told: &'j (dyn Fn(&Path, &str, bool) + Sync),
    /// Called when a frame is measured.
    pub done: &'j (dyn Fn() + Sync),
}

/// An object found in frames, and where it is in each of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Object {
    /// Its name: object-1, ...
    pub name: String,
    /// Directions, astrometric ICRS, frame by frame; none off the frame.
    pub places: Vec<Option<DVec3>>,
    /// Frames that it was seen in.
    pub seen: usize,
}

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
    let per_frame = job
        .frames
        .par_iter()
        .enumerate()
        .map(|(number, path)| {
            let (frame, stars) = ready(path, job, &light, true)?;
            let rows = if job.objects.is_empty() {
                measure_frame(&frame, &stars, job, planner.as_ref())
            } else {
                Ok(measure_objects(&frame, &stars, number, job))
            };
            (job.done)();
            rows
        })
        .collect::<Result<Vec<_>, RunError>>()?;
    let mut rows = per_frame.into_iter().flatten().collect::<Vec<_>>();
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

/// A measurement, and the geometry that a scene knows.
pub type Row = (Measurement, Option<Geometry>);

/// A frame; one whose header does not tell where it looks is taken to look at the place given.
fn read(path: &Path, job: &Job) -> Result<(Frame, Vec<Note>), RunError> {
    let read = |overrides: &Overrides| -> Result<_, RunError> {
        Ok(Frame::read(Image::read(path)?, overrides, job.masters.as_ref())?)
    };
    match (read(&job.overrides), job.place) {
        (Err(RunError::Photometry(PhotometryError::Missing { .. })), Place::Sky(sky)) => {
            let (ra, dec) = crate::astro::angles(sky);
            let pointing_deg = Some([ra.to_degrees(), dec.to_degrees()]);
            read(&Overrides { pointing_deg, ..job.overrides.clone() })
        }
        (other, _) => other,
    }
}

/// A frame with its world coordinates, and the catalogue's stars in it. `told`: remarks are passed on.
pub(super) fn ready(
    path: &Path,
    job: &Job,
    light: &StarLight,
    told: bool,
) -> Result<(Frame, Vec<FieldStar>), RunError> {
    let (mut frame, notes) = read(path, job)?;
    let mut stars = field_stars(&frame, job.catalogue, light, 0.0);
    let mut solved = solve::check(&mut frame, &stars, &job.settings);
    if solved.is_err() && worth_searching(&frame, &stars) {
        let wide = field_stars(&frame, job.catalogue, light, SEARCH_MARGIN);
        solved = solve::search(&mut frame, &wide);
        stars = field_stars(&frame, job.catalogue, light, 0.0);
    }
    if told {
        for note in notes {
            let warning = matches!(note.kind, NoteKind::Contradictory | NoteKind::Refused);
            (job.told)(path, &note.to_string(), warning);
        }
        (job.told)(path, &in_words(&solved), frame.approximate);
    }
    Ok((frame, stars))
}

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

/// Catalogue stars that can be on the frame or within `margin` \[rad\] of it, at their places of its time. Magnitudes are those of sunlight that gives as many
/// electrons, the light curve's own scale.
pub fn field_stars(frame: &Frame, catalogue: &Catalogue, light: &StarLight, margin: f64) -> Vec<FieldStar> {
    let size = DVec2::new(frame.width as f64, frame.height as f64);
    let centre = frame.wcs.sky((size - 1.0) / 2.0);
    let radius = [DVec2::ZERO, size, DVec2::new(size.x, 0.0), DVec2::new(0.0, size.y)]
        .map(|corner| crate::astro::separation(frame.wcs.sky(corner), centre))
        .into_iter()
        .fold(0.0, f64::max);
    let years = frame.time.julian_year() - catalogue.epoch();
    let star = |s: &crate::stars::catalogue::CatalogueStar| {
        let colour = light.at(s.colour_bv, TYPICAL_AIRMASS) / light.solar().at(TYPICAL_AIRMASS);
        FieldStar {
            direction: moved(s, years),
            mag_v: s.mag_v + mag_from_flux(colour),
            colour_bv: s.colour_bv.unwrap_or(f64::NAN),
        }
    };
    catalogue.cone(centre, 1.1 * radius + margin, f64::INFINITY).iter().map(star).collect()
}

/// How far beyond the field stars are taken where the pointing is in doubt \[rad\].
const SEARCH_MARGIN: f64 = 0.0105;
/// Fewer catalogue stars in the field do not make it known among others.
const FEWEST_STARS: usize = 8;

/// True if the field holds enough stars to be recognised by them.
fn worth_searching(frame: &Frame, stars: &[FieldStar]) -> bool {
    let inside = |s: &&FieldStar| frame.wcs.pixel(s.direction).is_some_and(|p| frame.holds(p, 0.0));
    stars.iter().filter(inside).count() >= FEWEST_STARS
}

/// Airmass of the colour term: it changes by a few thousandths of a magnitude an airmass.
const TYPICAL_AIRMASS: f64 = 1.3;

/// What the stars say of a frame's world coordinates, in words.
fn in_words(solved: &Result<Solved, Refusal>) -> String {
    match solved {
        Ok(solved) => {
            let whose = if matches!(solved, Solved::Stars(_)) { "found by" } else { "confirmed by" };
            let s = solved.solution();
            let (stars, median) = (s.matches.len(), s.median_residual);
            format!("world coordinates {whose} {stars} stars, median residual {:.3}, {:.3} px", median.x, median.y)
        }
        Err(why) => format!("world coordinates of the header: {why}"),
    }
}
