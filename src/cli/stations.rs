//! `nightglass stations`.

use super::args::{FromFitsArgs, Global, StationsAction, StationsArgs};
use super::photometry::overrides;
use super::scenes::about;
use super::talk::{Failure, Talk, print, print_json, write_new};
use crate::io::image::Image;
use crate::photometry::header::{Facts, NoteKind};
use crate::run::RunError;
use crate::run::station_file::{Entry, Origin, Source, check, entries, to_toml};
use crate::scene::{self, STATIONS, contradictions};
use serde_json::json;

pub(super) fn stations(args: &StationsArgs, global: &Global, talk: &Talk) -> Result<(), Failure> {
    match &args.action {
        Some(StationsAction::FromFits(with)) => from_fits(&with.args, global, talk),
        None => list(global),
    }
}

fn from_fits(args: &FromFitsArgs, global: &Global, talk: &Talk) -> Result<(), Failure> {
    let image = Image::read(&args.frame).map_err(RunError::from)?;
    let size = [image.width, image.height];
    let facts = Facts::read(&image.header, size, &overrides(&args.instead)?);
    let found = entries(&Source { facts: &facts, header: &image.header, size, data: &image.data });
    let program = facts.program.map_or(String::new(), |name| format!(", written by {name}"));
    let file = args.frame.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let text = to_toml(&found, &format!("A station from the header of {file}{program}."));
    check(&text)?.iter().for_each(|words| talk.say(&format!("warning: {words}")));
    let doubtful = facts.notes.iter().filter(|n| matches!(n.kind, NoteKind::Contradictory | NoteKind::Refused));
    doubtful.for_each(|note| talk.say(&format!("warning: {note}")));
    facts.notes.iter().for_each(|note| talk.detail(&note.to_string()));
    let of = |origin: Origin| found.iter().filter(move |e| e.origin == origin).map(|e| e.key).collect::<Vec<_>>();
    for (origin, words) in [(Origin::FillIn, "to be filled in"), (Origin::Assumed, "assumed, to be looked at")] {
        if !of(origin).is_empty() {
            talk.say(&format!("{words}: {}", of(origin).join(", ")));
        }
    }
    if let Some(path) = &global.output {
        write_new(path, &text, global)?;
        talk.say(&format!(
            "wrote {}; in a scene: [station] preset = {:?}",
            path.display(),
            path.display().to_string()
        ));
    }
    match (global.json, &global.output) {
        (true, _) => {
            let rows = found.iter().map(row).collect::<Vec<_>>();
            print_json(&json!({ "command": "stations from-fits", "rows": rows, "toml": text }))
        }
        (false, None) => print(&text),
        (false, Some(_)) => Ok(()),
    }
}

fn row(entry: &Entry) -> serde_json::Value {
    let value = serde_json::to_value(&entry.value).unwrap_or_default();
    json!({ "key": entry.key, "value": value, "origin": entry.origin.name(), "why": entry.why })
}

fn list(global: &Global) -> Result<(), Failure> {
    let mut out = format!(
        "{:15} {:>9} {:>10} {:>7} {:>7} {:>8} {:>9}  station\n",
        "name", "lat, deg", "lon, deg", "h, m", "D, m", "field", "arcsec/px"
    );
    let mut rows = Vec::new();
    for (name, text) in STATIONS {
        let loaded = scene::load_station(name)?;
        let (station, telescope) = (&loaded.station, &loaded.telescope);
        let field = loaded.detector.size_px.map(|n| n as f64 * telescope.plate_scale_arcsec / 3600.0);
        let line = (station.latitude_deg, station.longitude_deg, station.height_m, telescope.aperture_m);
        out.push_str(&format!(
            "{name:15} {:>9.4} {:>10.4} {:>7.0} {:>7.3} {:>8.3} {:>9.3}  {}\n",
            line.0,
            line.1,
            line.2,
            line.3,
            field[0],
            telescope.plate_scale_arcsec,
            about(text)
        ));
        rows.push(json!({
            "name": name, "about": about(text), "latitude_deg": line.0, "longitude_deg": line.1, "height_m": line.2,
            "aperture_m": line.3, "plate_scale_arcsec": telescope.plate_scale_arcsec, "field_deg": field,
            "contradictions": contradictions(&loaded),
        }));
    }
    if global.json {
        return print_json(&json!({ "command": "stations", "rows": rows }));
    }
    print(&out)
}
