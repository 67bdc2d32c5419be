//! A measured light curve in the formats of others: CCSDS TDM, ALCDEF, CSV, Parquet.

use super::lightcurve::LightCurve;
use crate::base::table::{Table, Values};
use crate::io::alcdef::{self, About, Sample};
use crate::io::tdm::{self, Header, Observation, Track};
use crate::photometry::{Measurement, flag};

/// Who wrote a file.
const ORIGINATOR: &str = "NIGHTGLASS";

/// Measurements by target, in the order of their first.
fn by_target(curve: &LightCurve) -> Vec<(&str, Vec<&Measurement>)> {
    let mut targets: Vec<(&str, Vec<&Measurement>)> = Vec::new();
    for (name, m) in curve.names.iter().zip(&curve.measurements) {
        match targets.iter_mut().find(|(known, _)| known == name) {
            Some((_, list)) => list.push(m),
            None => targets.push((name, vec![m])),
        }
    }
    targets
}

/// The CCSDS Tracking Data Message of a light curve: places and magnitudes of what was detected. None if nothing was.
///
/// # Errors
/// What the format does not allow, in words.
pub fn tdm(curve: &LightCurve, station: &str) -> Result<Option<String>, String> {
    let seen = |m: &&&Measurement| m.flags & flag::NOT_DETECTED == 0 && m.ra_deg.is_finite();
    let observation =
        |m: &&Measurement| Observation { time: m.time, ra_deg: m.ra_deg, dec_deg: m.dec_deg, mag: m.mag_v };
    let tracks = by_target(curve).into_iter().map(|(target, list)| Track {
        station: station.to_owned(),
        target: target.to_owned(),
        comments: vec!["MAG is Johnson V outside the atmosphere".to_owned()],
        observations: list.iter().filter(seen).map(observation).collect(),
    });
    let tracks = tracks.filter(|t| !t.observations.is_empty()).collect::<Vec<_>>();
    if tracks.is_empty() {
        return Ok(None);
    }
    let header = Header { originator: ORIGINATOR.to_owned(), ..Header::default() };
    tdm::to_tdm(&header, &tracks).map(Some).map_err(|fault| fault.to_string())
}

/// The light curve in the Asteroid Lightcurve Data Exchange Format. None if there is no magnitude.
///
/// # Errors
/// What the format does not allow, in words.
pub fn alcdef(curve: &LightCurve, station: &str) -> Result<Option<String>, String> {
    let sample = |m: &&Measurement| Sample { time: m.time, mag: m.mag_v, mag_err: m.mag_err, airmass: m.airmass };
    let targets = by_target(curve).into_iter().map(|(t, list)| (t.to_owned(), list.iter().map(sample).collect()));
    let targets = targets.collect::<Vec<(String, Vec<Sample>)>>();
    if targets.iter().all(|(_, samples)| samples.iter().all(|s| !s.mag.is_finite())) {
        return Ok(None);
    }
    let about = About {
        contact_name: ORIGINATOR.to_owned(),
        observers: ORIGINATOR.to_owned(),
        facility: station.to_owned(),
        filter: "V".to_owned(),
        band: "V".to_owned(),
        ..About::default()
    };
    alcdef::to_alcdef(&about, &targets).map(Some).map_err(|fault| fault.to_string())
}

/// The columns of a table as plain CSV (RFC 4180), NaN as `nan`.
///
/// # Errors
/// Columns of different lengths.
pub fn csv(table: &Table) -> Result<String, csv::Error> {
    let cell = |values: &Values, row: usize| match values {
        Values::Float(v) => v.get(row).map(|x| if x.is_nan() { "nan".into() } else { x.to_string() }),
        Values::Int(v) => v.get(row).map(ToString::to_string),
        Values::Text(v) => v.get(row).cloned(),
        Values::Bool(v) => v.get(row).map(ToString::to_string),
    };
    let mut text = Vec::new();
    let mut writer = csv::Writer::from_writer(&mut text);
    writer.write_record(table.columns.iter().map(|c| &*c.name))?;
    for row in 0..table.rows() {
        writer.write_record(table.columns.iter().filter_map(|c| cell(&c.values, row)))?;
    }
    writer.flush()?;
    drop(writer);
    Ok(String::from_utf8_lossy(&text).into_owned())
}
