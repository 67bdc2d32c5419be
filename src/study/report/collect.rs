//! What lies in a run's directory, read once.

use super::ReportError;
use super::sheet::{Sheet, evenly};
use super::solid;
use crate::scene::{self, Options, Scene};
use serde_json::{Value as Json, json};
use sha2::{Digest, Sha256};
use std::collections::HashSet;
use std::fmt::Write;
use std::io::Read;
use std::path::Path;

/// Most points of a light curve, and most exposures of a plan, that the page holds.
const MOST_POINTS: usize = 3000;
const MOST_EXPOSURES: usize = 2000;
/// Files whose size and hash the page tells.
const FILES: [&str; 10] = [
    "scene.toml",
    "plan.ecsv",
    "truth.ecsv",
    "ledger.json",
    "lightcurve.ecsv",
    "shape.obj",
    "shape.mtl",
    "shape.json",
    "accuracy.ecsv",
    "snr.ecsv",
];

/// A file that the page is made from.
#[derive(Debug)]
pub(super) struct Source {
    pub name: String,
    pub bytes: usize,
    pub sha256: String,
}

/// Everything but the frames.
#[derive(Debug, Default)]
pub(super) struct Collected {
    pub scene: Option<Scene>,
    pub scene_text: String,
    pub plan: Option<Sheet>,
    pub truth: Option<Sheet>,
    pub curve: Option<Sheet>,
    pub accuracy: Option<Sheet>,
    pub snr: Option<Sheet>,
    pub ledger: Vec<Json>,
    pub solid: Option<Json>,
    pub outcome: Option<Json>,
    /// The static chart of the light curve, as SVG.
    pub chart: Option<String>,
    pub sources: Vec<Source>,
    /// What could not be used, and why.
    pub notes: Vec<String>,
}

impl Collected {
    /// Read a directory.
    ///
    /// # Errors
    /// [`ReportError`] where there is nothing to report of.
    pub fn of(dir: &Path) -> Result<Self, ReportError> {
        if !dir.is_dir() {
            return Err(ReportError::NoDirectory(dir.display().to_string()));
        }
        let mut own = Self { sources: sources(dir), ..Self::default() };
        if own.sources.is_empty() && !dir.join("frames").is_dir() {
            return Err(ReportError::Nothing(dir.display().to_string()));
        }
        let mut notes = Vec::new();
        let mut told = |read: Result<Option<Sheet>, String>| {
            read.unwrap_or_else(|why| {
                notes.push(why);
                None
            })
        };
        own.plan = told(Sheet::read(dir, "plan.ecsv"));
        own.truth = told(Sheet::read(dir, "truth.ecsv")).filter(|t| !t.rows.is_empty());
        own.curve = told(Sheet::read(dir, "lightcurve.ecsv"));
        own.accuracy = told(Sheet::read(dir, "accuracy.ecsv"));
        own.snr = told(Sheet::read(dir, "snr.ecsv"));
        let mut json = |read: Result<Option<Json>, String>| {
            read.unwrap_or_else(|why| {
                notes.push(why);
                None
            })
        };
        own.chart = std::fs::read_to_string(dir.join("lightcurve.svg")).ok();
        own.solid = json(solid::solid(dir));
        own.outcome = json(solid::outcome(dir));
        if let Ok(bytes) = std::fs::read(dir.join("ledger.json")) {
            match serde_json::from_slice::<Json>(&bytes) {
                Ok(whole) => own.ledger = whole["rows"].as_array().cloned().unwrap_or_default(),
                Err(e) => notes.push(format!("ledger.json is left out: {e}")),
            }
        }
        if let Ok(bytes) = std::fs::read(dir.join("scene.toml")) {
            own.scene_text = String::from_utf8_lossy(&bytes).into_owned();
            match scene::load_str(&own.scene_text, "scene.toml", Some(dir), &Options::default()) {
                Ok(scene) => own.scene = Some(scene),
                Err(e) => notes.push(format!("scene.toml is shown as it is, but not used: {e}")),
            }
        }
        if let Some(curve) = own.curve.as_mut() {
            let all = curve.rows.len();
            thin(curve, MOST_POINTS);
            if curve.rows.len() < all {
                notes.push(format!(
                    "The light curve has {all} points; this page holds {} of them, evenly chosen.",
                    curve.rows.len()
                ));
            }
        }
        let all = own.plan.as_ref().map_or(0, |p| p.rows.len());
        if all > MOST_EXPOSURES {
            notes.push(format!(
                "The plan has {all} exposures; this page holds {MOST_EXPOSURES} of them, evenly chosen."
            ));
            own.plan = own.plan.map(|p| p.thinned(MOST_EXPOSURES));
        }
        let curve = own.curve.as_ref();
        own.truth = own.truth.map(|truth| beside(&truth, curve));
        own.notes = notes;
        Ok(own)
    }

    /// The truth with the modified Julian dates of its frames, by the light curve, else the plan.
    pub fn truth_json(&self) -> Json {
        let Some(truth) = &self.truth else { return Json::Null };
        let mut data = truth.json(&["frame", "time_utc", "target", "electrons", "mag_v", "snr", "saturated"]);
        let mut dates = std::collections::HashMap::new();
        for sheet in [&self.plan, &self.curve].into_iter().flatten() {
            let own = (0..sheet.rows.len()).map(|row| (sheet.cell(row, "frame"), sheet.number(row, "mjd_utc")));
            dates.extend(own);
        }
        let date = |row: usize| dates.get(truth.cell(row, "frame")).copied().unwrap_or(f64::NAN);
        data["mjd_utc"] = json!((0..truth.rows.len()).map(date).collect::<Vec<_>>());
        data
    }
}

/// Keep so many rows at most, of each target evenly.
fn thin(curve: &mut Sheet, most: usize) {
    let mut targets: Vec<(String, Vec<usize>)> = Vec::new();
    for row in 0..curve.rows.len() {
        let name = curve.cell(row, "target");
        match targets.iter_mut().find(|(known, _)| known == name) {
            Some((_, rows)) => rows.push(row),
            None => targets.push((name.to_owned(), vec![row])),
        }
    }
    let each = (most / targets.len().max(1)).max(2);
    let mut kept = targets
        .iter()
        .flat_map(|(_, rows)| evenly(rows.len(), each).into_iter().map(|k| rows[k]))
        .collect::<Vec<_>>();
    kept.sort_unstable();
    kept.truncate(most);
    curve.rows = kept.into_iter().map(|row| std::mem::take(&mut curve.rows[row])).collect();
}

/// The truth of the points that a light curve holds; without one, evenly chosen.
fn beside(truth: &Sheet, curve: Option<&Sheet>) -> Sheet {
    let Some(curve) = curve.filter(|c| !c.rows.is_empty()) else { return truth.thinned(MOST_POINTS) };
    let key =
        |sheet: &Sheet, row: usize| (sheet.cell(row, "frame").to_owned(), sheet.cell(row, "target").to_owned());
    let known = (0..curve.rows.len()).map(|row| key(curve, row)).collect::<HashSet<_>>();
    let rows = (0..truth.rows.len()).filter(|row| known.contains(&key(truth, *row)));
    Sheet { rows: rows.map(|row| truth.rows[row].clone()).collect(), ..truth.clone() }
}

fn sources(dir: &Path) -> Vec<Source> {
    let mut names = FILES.map(str::to_owned).to_vec();
    let mut inputs = std::fs::read_dir(dir.join("inputs"))
        .into_iter()
        .flatten()
        .flatten()
        .map(|e| format!("inputs/{}", e.file_name().to_string_lossy()))
        .collect::<Vec<_>>();
    inputs.sort();
    names.extend(inputs);
    names.into_iter().filter_map(|name| source(dir, name)).collect()
}

fn source(dir: &Path, name: String) -> Option<Source> {
    let path = dir.join(&name);
    if !path.is_file() {
        return None;
    }
    let mut file = std::fs::File::open(path).ok()?;
    let (mut sha, mut bytes, mut part) = (Sha256::new(), 0, vec![0; 1 << 16]);
    loop {
        match file.read(&mut part) {
            Ok(0) => break,
            Ok(count) => {
                sha.update(part.get(..count)?);
                bytes += count;
            }
            Err(_) => return None,
        }
    }
    let mut sha256 = String::new();
    for byte in sha.finalize() {
        // writing to a string cannot fail
        let _ = write!(sha256, "{byte:02x}");
    }
    Some(Source { name, bytes, sha256 })
}
