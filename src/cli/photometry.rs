//! `nightglass photometry`, and the measurement that `run` shares.

use super::args::{Global, HeaderArgs, PhotometryArgs};
use super::talk::{Failure, Talk, give, load, print, print_json, write_bytes};
use crate::astro::direction;
use crate::io::ecsv::to_ecsv;
use crate::photometry::header::Overrides;
use crate::photometry::{FieldStar, Frame, Place, Settings};
use crate::run::job::{Job, Row};
use crate::run::lightcurve::{LightCurve, measure_frames, settings};
use crate::run::masters::CalibrationFiles;
use crate::run::{curve_files, find};
use crate::scene::Method;
use crate::simulate::{SimulateError, catalogue};
use crate::stars::catalogue::Catalogue;
use crate::study::finder;
use crate::study::measured_picture::measured;
use glam::DVec2;
use serde_json::json;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

pub(super) fn photometry(args: &PhotometryArgs, global: &Global, talk: &Talk) -> Result<(), Failure> {
    let scene = args.scene.as_deref().map(|s| load(s, global)).transpose()?;
    let catalogue = match (&args.catalog, &scene) {
        (Some(path), _) => Catalogue::open(path).map_err(|e| Failure::Input(e.to_string()))?,
        (None, Some(scene)) => catalogue(scene).map_err(SimulateError::from)?,
        (None, None) => Catalogue::built_in(),
    };
    let place = match (&args.xy, &args.radec) {
        (Some(text), _) => Place::Pixel(DVec2::from_array(pair("--xy", text)?)),
        (None, Some(text)) => {
            let [ra, dec] = pair("--radec", text)?;
            if !(-90.0..=90.0).contains(&dec) {
                return Err(Failure::Input(format!("--radec {text}: declination {dec} must lie in -90..90 deg")));
            }
            Place::Sky(direction(ra.to_radians(), dec.to_radians()))
        }
        (None, None) => Place::Header,
    };
    let settings = scene.as_ref().map_or_else(Settings::default, settings);
    let method = match args.method.as_deref() {
        Some("optimal") => Method::Optimal,
        Some("aperture") => Method::Aperture,
        Some("joint") => Method::Joint,
        _ => settings.method,
    };
    let overrides = overrides(&args.instead)?;
    let files = &args.calibration;
    let files =
        CalibrationFiles { bias: files.biases.clone(), dark: files.darks.clone(), flat: files.flats.clone() };
    let masters = files.masters(&overrides)?;
    let bar = talk.bar(args.frames.len(), "photometry");
    let finders = global.output.as_deref().filter(|_| args.finder).map(|dir| dir.join("finder"));
    let failed: Mutex<Option<Failure>> = Mutex::new(None);
    let mut job = Job {
        place,
        scene: scene.as_ref(),
        errors: args.errors,
        overrides: overrides.clone(),
        masters,
        told: &|path, what, warning| {
            let text = format!("{}: {what}", path.display());
            if warning { talk.say(&text) } else { talk.detail(&text) }
        },
        seen: &|path, frame, stars, rows| {
            let Some(dir) = &finders else { return };
            if let Err(failure) = draw_finders(dir, path, frame, stars, rows, global) {
                failed.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(failure);
            }
        },
        done: &|| bar.inc(1),
        ..Job::new(&args.frames, &catalogue, Settings { method, ..settings })
    };
    if args.find {
        let objects = find::objects(&job)?;
        let names = objects.iter().map(|o| format!("{} in {} frames", o.name, o.seen)).collect::<Vec<_>>();
        if objects.is_empty() {
            talk.say("no object among the stars");
            return if global.json { print_json(&json!({ "command": "photometry", "rows": [] })) } else { Ok(()) };
        }
        talk.say(&format!("found {}", names.join(", ")));
        job.objects = objects;
    }
    let curve = measure(&job, talk)?;
    bar.finish_and_clear();
    if let Some(failure) = failed.lock().unwrap_or_else(PoisonError::into_inner).take() {
        return Err(failure);
    }
    if let Some(dir) = &global.output {
        let station = scene.as_ref().map_or("UNKNOWN", |s| s.station.name.as_str());
        write_all(dir, &curve, station, &args.also, global, talk)?;
    }
    match (global.json, &global.output) {
        (true, _) => print_json(&json!({ "command": "photometry", "rows": curve.table.to_json_rows() })),
        (false, None) => print(&to_ecsv(&curve.table)),
        (false, Some(_)) => Ok(()),
    }
}

/// A picture of each of a frame's measurements.
fn draw_finders(
    dir: &Path,
    path: &Path,
    frame: &Frame,
    stars: &[FieldStar],
    rows: &[Row],
    global: &Global,
) -> Result<(), Failure> {
    let stem = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let stem = stem.trim_end_matches(".fits");
    for (k, (row, _)) in rows.iter().enumerate() {
        let name = if rows.len() > 1 { format!("{stem}_{k}.png") } else { format!("{stem}.png") };
        let picture = finder::png(frame, stars, row).map_err(|e| Failure::Input(format!("{name}: {e}")))?;
        write_bytes(&dir.join(name), &picture, global)?;
    }
    Ok(())
}

/// The light curve in a directory, in all forms asked for.
fn write_all(
    dir: &Path,
    curve: &LightCurve,
    station: &str,
    also: &[String],
    global: &Global,
    talk: &Talk,
) -> Result<(), Failure> {
    give(dir, "lightcurve.ecsv", &to_ecsv(&curve.table), global, talk)?;
    match curve_files::tdm(curve, station) {
        Ok(Some(text)) => give(dir, "lightcurve.tdm", &text, global, talk)?,
        Ok(None) => talk.say("nothing detected: no lightcurve.tdm"),
        Err(why) => talk.say(&format!("warning: no lightcurve.tdm: {why}")),
    }
    let title = format!("{}, {station}", curve.names.first().map_or("", String::as_str));
    give(dir, "lightcurve.svg", &measured(curve, &title), global, talk)?;
    for format in also {
        match format.as_str() {
            "csv" => {
                let text = curve_files::csv(&curve.table);
                let text = text.map_err(|fault| Failure::Input(format!("lightcurve.csv: {fault}")))?;
                give(dir, "lightcurve.csv", &text, global, talk)?;
            }
            "alcdef" => match curve_files::alcdef(curve, station).map_err(Failure::Input)? {
                Some(text) => give(dir, "lightcurve.alcdef", &text, global, talk)?,
                None => talk.say("no magnitude: no lightcurve.alcdef"),
            },
            #[cfg(feature = "parquet")]
            "parquet" => {
                let bytes = crate::io::parquet::to_parquet(&curve.table);
                let bytes = bytes.map_err(|fault| Failure::Input(format!("lightcurve.parquet: {fault}")))?;
                write_bytes(&dir.join("lightcurve.parquet"), &bytes, global)?;
            }
            _ => {}
        }
    }
    Ok(())
}

/// What counts in place of the headers.
/// What counts in place of the header.
pub(super) fn overrides(args: &HeaderArgs) -> Result<Overrides, Failure> {
    Ok(Overrides {
        gain_e_adu: args.gain,
        read_noise_e: args.read_noise,
        saturate_adu: args.saturate,
        bias_adu: args.bias,
        exptime_s: args.exptime,
        time_utc: args.time.clone(),
        pixel_scale_arcsec: args.pixel_scale,
        rotation_deg: args.rotation,
        mirrored: args.mirrored.then_some(true),
        seeing_arcsec: args.seeing,
        aperture_mm: args.aperture_mm,
        elevation_m: args.elevation,
        pointing_deg: None,
        track_arcsec_s: args.track.as_deref().map(|text| pair("--track", text)).transpose()?,
    })
}

/// Measure, and tell what came out.
pub(super) fn measure(job: &Job, talk: &Talk) -> Result<LightCurve, Failure> {
    let curve = measure_frames(job)?;
    let good = curve.measurements.iter().filter(|m| m.mag_v.is_finite()).collect::<Vec<_>>();
    let mean = |f: &dyn Fn(&crate::photometry::Measurement) -> f64| {
        good.iter().map(|m| f(m)).sum::<f64>() / good.len() as f64
    };
    if good.is_empty() {
        talk.say("light curve: no calibrated magnitude; the flags column tells why");
    } else {
        talk.say(&format!(
            "light curve: {} of {} points calibrated, mean V {:.3}, mean error {:.3} mag, {:.0} stars a frame",
            good.len(),
            curve.measurements.len(),
            mean(&|m| m.mag_v),
            mean(&|m| m.mag_err),
            mean(&|m| m.n_stars as f64),
        ));
    }
    Ok(curve)
}

fn pair(option: &str, text: &str) -> Result<[f64; 2], Failure> {
    let fault = || Failure::Input(format!("{option} {text}: not two finite numbers separated by a comma"));
    let (a, b) = text.split_once(',').ok_or_else(fault)?;
    let number = |t: &str| t.trim().parse::<f64>().ok().filter(|v| v.is_finite()).ok_or_else(fault);
    Ok([number(a)?, number(b)?])
}
