//! The report of a run: one page of HTML that holds all it shows and asks the network for nothing.
//!
//! It is made from the files of the run's directory alone, so that its numbers are theirs; only the altitudes of the night and
//! its windows, and the places of stars of which the run wrote no table, are computed anew, from `scene.toml` and the frames'
//! headers. Every picture stands beside a table. The page's program draws the charts; without it summary, tables, the binned
//! frames and static charts are left.

mod collect;
mod frames;
mod html;
mod night;
mod picture;
mod sheet;
mod solid;
mod words;

use crate::simulate::catalogue;
use crate::stars::catalogue::Catalogue;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use collect::Collected;
use frames::{Frames, Places};
use html::{data, escaped, fill, note};
use serde_json::{Value as Json, json};
use sha2::{Digest, Sha256};
use std::path::Path;

/// No page is larger \[bytes\].
pub const LARGEST: usize = 5_000_000;
/// Frames of a page; fewer where it would grow too large.
pub const MOST_FRAMES: [usize; 4] = [12, 6, 2, 0];
/// Rows of a table.
const MOST_ROWS: usize = 100;
/// Longest text shown of a scene, and of a static chart \[bytes\].
const LONGEST_SCENE: usize = 150_000;
const LONGEST_CHART: usize = 200_000;
const PAGE: &str = include_str!("page.html");
const STYLE: &str = include_str!("page.css");
const PROGRAM: &str = concat!(
    include_str!("chart.js"),
    include_str!("page.js"),
    include_str!("viewer.js"),
    include_str!("solid.js")
);

/// Why there is no report.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// Not a directory.
    #[error("{0} is not a directory; give the output directory of `nightglass run`")]
    NoDirectory(String),
    /// Nothing to report of.
    #[error(
        "{0} holds no scene.toml, plan.ecsv, lightcurve.ecsv or frames/; give the output directory of `nightglass run`"
    )]
    Nothing(String),
}

/// A report.
#[derive(Debug)]
pub struct Report {
    /// The page.
    pub html: String,
    /// What could not be shown, and why.
    pub notes: Vec<String>,
}

/// The report of a run's directory: at most [`LARGEST`] bytes.
///
/// # Errors
/// [`ReportError`] where there is nothing to report of; a file that cannot be read is left out, and [`Report::notes`] says so.
pub fn report(dir: &Path) -> Result<Report, ReportError> {
    let c = Collected::of(dir)?;
    let catalogue = stars_of(&c);
    let places = Places {
        dir,
        curve: c.curve.as_ref(),
        truth: c.truth.as_ref(),
        plan: c.plan.as_ref(),
        catalogue: catalogue.as_ref(),
    };
    let night = c.scene.as_ref().map(night::night);
    let mut made = Report { html: String::new(), notes: Vec::new() };
    for most in MOST_FRAMES {
        made = page(&c, &frames::collect(&places, most), night.as_ref());
        if made.html.len() < LARGEST {
            break;
        }
    }
    Ok(made)
}

/// The catalogue whose stars are on the frames; none where the scene has no such stars.
fn stars_of(c: &Collected) -> Option<Catalogue> {
    match &c.scene {
        Some(scene) if !scene.stars.enabled || scene.stars.random_count > 0 => None,
        Some(scene) => catalogue(scene).ok().filter(|stars| !stars.is_empty()),
        None => Some(Catalogue::built_in()),
    }
}

type Night = Result<(Json, String), String>;

fn page(c: &Collected, frames: &Frames, night: Option<&Night>) -> Report {
    let mut notes = c.notes.clone();
    notes.extend(frames.notes.iter().cloned());
    let (sky, chart) = match night {
        Some(Ok((sky, chart))) => (sky.clone(), still(chart, "Altitudes of targets, Sun and Moon over the night")),
        Some(Err(why)) => {
            notes.push(format!("The night's altitudes and windows are left out: {why}."));
            (Json::Null, String::new())
        }
        None => (Json::Null, String::new()),
    };
    let name = c.scene.as_ref().map_or("Observations", |s| s.name.as_str());
    let told = payload(c, frames, &sky);
    let place = |key: &str| match key {
        "title" | "heading" => escaped(name),
        "subtitle" => escaped(&subtitle(c)),
        "policy" => format!("sha256-{}", STANDARD.encode(Sha256::digest(PROGRAM.as_bytes()))),
        "style" => STYLE.to_owned(),
        "program" => PROGRAM.to_owned(),
        "data" => data(&told),
        "summary" => words::summary(c, frames),
        "notes" => notes.iter().map(|text| note(text)).collect(),
        "plan_still" => chart.clone(),
        "plan_table" => plan_table(c, &sky),
        "frames_note" => escaped(&frames_note(frames)),
        "pictures" => frames.pictures.clone(),
        "frames_none" => hidden(frames.data.is_empty()),
        "frames_some" => hidden(!frames.data.is_empty()),
        "budget" => words::budget(c),
        "ledger" => words::ledger(c),
        "curve_still" => curve_still(c),
        "curve_table" => curve_table(c),
        "shape" => shape(c),
        "accuracy" => study(c.accuracy.as_ref(), "accuracy.ecsv", "nightglass accuracy DIR/scene.toml -o DIR"),
        "snr" => study(c.snr.as_ref(), "snr.ecsv", "nightglass snr DIR/scene.toml -o DIR"),
        "provenance" => words::provenance(c),
        "scene" => scene_text(c),
        _ => String::new(),
    };
    Report { html: fill(PAGE, place), notes }
}

/// An attribute that hides what does not apply.
fn hidden(shown: bool) -> String {
    if shown { String::new() } else { "hidden".into() }
}

fn subtitle(c: &Collected) -> String {
    let kind = if c.truth.is_some() { "Simulated frames" } else { "Observations" };
    match &c.scene {
        Some(scene) => format!("{kind} from {}", scene.station.name),
        None => kind.into(),
    }
}

/// What the page's program draws from.
fn payload(c: &Collected, frames: &Frames, sky: &Json) -> Json {
    let columns = |sheet: &Option<sheet::Sheet>, names: &[&str]| sheet.as_ref().map(|s| s.json(names));
    let all = |sheet: &Option<sheet::Sheet>| {
        sheet.as_ref().map(|s| {
            let s = s.thinned(2000);
            let names = s.names.iter().take(24).map(String::as_str).collect::<Vec<_>>();
            json!({ "names": names, "units": s.units, "columns": s.json(&names), "meta": s.meta })
        })
    };
    let plan =
        ["frame", "time_utc", "mjd_utc", "az_deg", "el_deg", "sun_el_deg", "moon_el_deg", "observable", "why"];
    let curve = ["frame", "time_utc", "mjd_utc", "target", "flux_e", "flux_err_e", "mag_v", "mag_err", "flags"];
    json!({
        "frames": frames.data, "plan": columns(&c.plan, &plan), "night": sky, "curve": columns(&c.curve, &curve),
        "truth": c.truth_json(), "flags": words::flags(), "solid": c.solid, "facets": c.outcome.as_ref().map(|o| o["facets"].clone()),
        "accuracy": all(&c.accuracy), "snr": all(&c.snr),
    })
}

fn frames_note(frames: &Frames) -> String {
    let (shown, total) = (frames.data.len(), frames.total);
    match total {
        0 => "No frame lies in frames/.".into(),
        _ if shown < total => format!("{shown} of {total} frames, evenly chosen."),
        1 => "The only frame.".into(),
        _ => format!("All {total} frames."),
    }
}

/// A picture for readers without the page's program; nothing if it is long.
fn still(svg: &str, what: &str) -> String {
    if svg.len() > LONGEST_CHART || svg.is_empty() {
        return String::new();
    }
    let source = STANDARD.encode(svg);
    format!(
        "<noscript><img class=\"still\" alt=\"{}\" src=\"data:image/svg+xml;base64,{source}\"></noscript>",
        escaped(what)
    )
}

fn plan_table(c: &Collected, sky: &Json) -> String {
    let mut out = String::new();
    let Some(plan) = &c.plan else { return note("plan.ecsv is not in this directory.") };
    let windows = sky["targets"].as_array().into_iter().flatten();
    let rows = windows.flat_map(|target| {
        let own = target["windows"].as_array().into_iter().flatten();
        own.map(|w| {
            let text = |v: &Json| escaped(v.as_str().unwrap_or("").split('.').next().unwrap_or(""));
            let high = w["max_el_deg"].as_f64().map_or_else(|| "–".into(), |v| html::short(v, "el_deg"));
            format!(
                "<tr><th scope=\"row\">{}</th><td>{}</td><td>{}</td><td>{}</td><td class=\"n\">{high}</td><td>{}</td></tr>",
                escaped(target["name"].as_str().unwrap_or("")),
                text(&w["start_utc"]),
                text(&w["end_utc"]),
                if w["observable"] == true { "observable" } else { "not" },
                escaped(w["why"].as_str().unwrap_or("")),
            )
        })
    });
    let rows = rows.take(MOST_ROWS).collect::<String>();
    if !rows.is_empty() {
        out += &format!(
            "<details><summary>Windows</summary><div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"Windows\"><table>\
             <caption>When each target can be observed, and why not when not; computed from scene.toml</caption><thead><tr>\
             <th scope=\"col\">Target</th><th scope=\"col\">From <small>UTC</small></th><th scope=\"col\">To <small>UTC</small></th>\
             <th scope=\"col\">Verdict</th><th scope=\"col\" class=\"n\">Highest <small>deg</small></th><th scope=\"col\">Why</th></tr>\
             </thead><tbody>{rows}</tbody></table></div></details>"
        );
    }
    let names = [
        "frame",
        "time_utc",
        "el_deg",
        "az_deg",
        "airmass",
        "range_km",
        "phase_deg",
        "sun_el_deg",
        "moon_el_deg",
        "moon_sep_deg",
        "sunlit",
        "observable",
        "why",
    ];
    out += &format!(
        "<details><summary>Exposures</summary>{}</details>",
        plan.html("Exposures of plan.ecsv", &names, MOST_ROWS)
    );
    out
}

fn curve_table(c: &Collected) -> String {
    let Some(curve) = &c.curve else {
        return note(
            "lightcurve.ecsv is not in this directory: `nightglass run` writes it where there are frames and a target.",
        );
    };
    let names = [
        "frame",
        "time_utc",
        "target",
        "mag_v",
        "mag_err",
        "flux_e",
        "flux_err_e",
        "background_e_px",
        "airmass",
        "phase_deg",
        "range_km",
        "flags",
    ];
    let mut out = format!(
        "<details><summary>Measurements</summary>{}</details>",
        curve.html("Points of lightcurve.ecsv", &names, MOST_ROWS)
    );
    if let Some(truth) = &c.truth {
        let names = [
            "frame",
            "time_utc",
            "target",
            "mag_v",
            "electrons",
            "snr",
            "background_e_px",
            "x_px",
            "y_px",
            "saturated",
        ];
        out += &format!(
            "<details><summary>Truth</summary>{}</details>",
            truth.html("Rows of truth.ecsv", &names, MOST_ROWS)
        );
    }
    out
}

/// The light curve's static chart, where the run wrote one.
fn curve_still(c: &Collected) -> String {
    c.chart.as_deref().map_or_else(String::new, |svg| still(svg, "The light curve"))
}

fn shape(c: &Collected) -> String {
    let Some(outcome) = &c.outcome else {
        let line = "No shape here: `nightglass invert DIR/lightcurve.ecsv --scene DIR/scene.toml -o DIR` adds it.";
        return if c.solid.is_some() { String::new() } else { note(line) };
    };
    let mut out = String::from("<dl class=\"facts\">");
    let number = |key: &str| outcome[key].as_f64().map_or_else(|| "–".into(), |v| html::digits(v, 4));
    let convex = if outcome["convex"] == true { "convex" } else { "not convex" };
    let parts = format!("{} part{}", number("n_parts"), if outcome["n_parts"] == 1 { "" } else { "s" });
    for (name, value, source) in [
        ("Body", format!("{convex}, {parts}"), ""),
        ("Reduced chi-square", number("chi2_reduced"), "chi2_reduced"),
        ("Unobserved", number("unobserved_fraction"), "unobserved_fraction"),
        ("Closure defect", number("closure_defect"), "closure_defect"),
    ] {
        let value = outcome[source]
            .as_f64()
            .map_or_else(|| escaped(&value), |v| format!("<data value=\"{v}\">{value}</data>"));
        out += &format!("<div><dt>{name}</dt><dd>{value}</dd></div>");
    }
    out += "</dl><ul class=\"claims\">";
    for claim in outcome["claims"].as_array().into_iter().flatten().take(40) {
        out += &format!("<li>{}</li>", escaped(claim.as_str().unwrap_or("")));
    }
    out += "</ul>";
    if let Some(errors) = outcome["errors"].as_object() {
        let told = errors.iter().filter_map(|(k, v)| Some(format!("{k} {}", html::digits(v.as_f64()?, 4))));
        out += &note(&format!("Against the true shape: {}.", told.collect::<Vec<_>>().join(", ")));
    }
    out
}

/// Table of a study, or how to add it.
fn study(sheet: Option<&sheet::Sheet>, file: &str, command: &str) -> String {
    let Some(sheet) = sheet else {
        return format!(
            "<p class=\"note\">{} is not in this directory: <code>{}</code> adds it.</p>",
            escaped(file),
            escaped(command)
        );
    };
    let names = sheet.names.iter().take(24).map(String::as_str).collect::<Vec<_>>();
    format!(
        "<details><summary>Table</summary>{}</details>",
        sheet.html(&format!("Rows of {file}"), &names, MOST_ROWS)
    )
}

fn scene_text(c: &Collected) -> String {
    if c.scene_text.is_empty() {
        return note("scene.toml is not in this directory.");
    }
    let end = (0..=LONGEST_SCENE.min(c.scene_text.len())).rev().find(|k| c.scene_text.is_char_boundary(*k));
    let text = c.scene_text.get(..end.unwrap_or(0)).unwrap_or_default();
    let cut =
        if text.len() < c.scene_text.len() { note("Cut: the whole is in scene.toml.") } else { String::new() };
    format!("<pre tabindex=\"0\" aria-label=\"scene.toml\"><code>{}</code></pre>{cut}", lines(text))
}

/// A text escaped line by line: line ends stay.
fn lines(text: &str) -> String {
    text.lines().map(escaped).collect::<Vec<_>>().join("\n")
}
