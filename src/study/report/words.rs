//! What the page says without its program: summary, budget, ledger, provenance.

use super::collect::Collected;
use super::frames::Frames;
use super::html::{digits, escaped, short};
use super::sheet::Sheet;
use crate::photometry::flag;
use crate::scene::{Brightness, Scene};
use serde_json::Value as Json;

/// Most targets whose light curves have a line.
const MOST_LINES: usize = 8;
/// The bits of `flags` in words.
const FLAGS: [(u32, &str); 9] = [
    (flag::SATURATED, "saturated"),
    (flag::BLOOMED, "bloomed"),
    (flag::COSMIC_RAY, "cosmic ray"),
    (flag::EDGE, "edge"),
    (flag::TRAIL_CROSSING, "trail crossing"),
    (flag::NEIGHBOUR, "neighbour"),
    (flag::BORROWED_ZERO_POINT, "borrowed zero point"),
    (flag::NOT_DETECTED, "not detected"),
    (flag::BAD_PIXEL, "bad pixel"),
];

/// Bits and words for the page's program.
pub(super) fn flags() -> Json {
    FLAGS.iter().map(|(bit, word)| serde_json::json!([bit, word])).collect()
}

fn fact(name: &str, value: &str, more: &str) -> String {
    let more = if more.is_empty() { String::new() } else { format!("<small>{}</small>", escaped(more)) };
    format!("<div><dt>{}</dt><dd>{}{more}</dd></div>", escaped(name), escaped(value))
}

/// The facts at the head of the page.
pub(super) fn summary(c: &Collected, frames: &Frames) -> String {
    let mut out = String::new();
    if let Some(scene) = &c.scene {
        out += &what(scene);
        let s = &scene.station;
        let side = |value: f64, [plus, minus]: [char; 2]| {
            format!("{:.4}° {}", value.abs(), if value < 0.0 { minus } else { plus })
        };
        let (north, east) = (side(s.latitude_deg, ['N', 'S']), side(s.longitude_deg, ['E', 'W']));
        let place = format!("{north}, {east}, {:.0} m", s.height_m);
        let t = &scene.telescope;
        let camera = format!(
            "{} m telescope, {} arcsec/px",
            digits(t.aperture_m, 4),
            digits(scene.stored_scale_arcsec(), 4)
        );
        out += &fact("Where", &s.name, &format!("{place} · {camera}"));
    }
    let clock = c.plan.as_ref().filter(|p| !p.rows.is_empty()).or(c.curve.as_ref()).filter(|s| !s.rows.is_empty());
    if let Some(sheet) = clock {
        let (first, last) = (sheet.cell(0, "time_utc"), sheet.cell(sheet.rows.len() - 1, "time_utc"));
        let second = |t: &str| t.split('.').next().unwrap_or(t).replacen('T', " ", 1);
        let span = if first == last {
            format!("{} UTC", second(first))
        } else {
            format!("{} to {} UTC", second(first), second(last))
        };
        let rhythm = c.scene.as_ref().map_or_else(String::new, |s| {
            let e = &s.exposures;
            format!("{} exposures of {} s, every {} s", e.count, digits(e.duration_s, 5), digits(e.cadence_s, 7))
        });
        out += &fact("When", &span, &rhythm);
    }
    let observable = c.plan.as_ref().map_or_else(String::new, |p| {
        let up = (0..p.rows.len()).filter(|row| p.flag(*row, "observable")).count();
        format!("{up} of {} exposures observable", p.rows.len())
    });
    let count = match frames.total {
        0 => "no frames".to_owned(),
        1 => "1 frame".to_owned(),
        n => format!("{n} frames"),
    };
    out += &fact("Frames", &count, &observable);
    if let Some(curve) = &c.curve {
        for (target, rows) in targets(curve) {
            let (line, flags) = curve_line(curve, &rows);
            out += &fact(&format!("Light curve {target}"), &line, &flags);
        }
    }
    if let Some((name, variance, share)) = dominant(c) {
        let more = format!(
            "{} e⁻² a pixel, {:.0} % of the variance without the target",
            digits(variance, 3),
            100.0 * share
        );
        out += &fact("Dominant noise", &name, &more);
    }
    out
}

fn what(scene: &Scene) -> String {
    let one = |t: &crate::scene::Target| match &t.brightness {
        Brightness::MagV(mag) => format!("{} (V {})", t.name, digits(*mag, 5)),
        Brightness::Shape(_) => format!("{} (a shape)", t.name),
    };
    let shown = scene.target.iter().take(4).map(one).collect::<Vec<_>>().join(", ");
    let more = scene.target.len().saturating_sub(4);
    match scene.target.len() {
        0 => fact("What", "a field without a target", ""),
        _ if more > 0 => fact("What", &shown, &format!("and {more} more targets")),
        _ => fact("What", &shown, ""),
    }
}

/// Names of a light curve's targets and their rows.
fn targets(curve: &Sheet) -> Vec<(String, Vec<usize>)> {
    let mut out: Vec<(String, Vec<usize>)> = Vec::new();
    for row in 0..curve.rows.len() {
        let name = curve.cell(row, "target");
        match out.iter().position(|(known, _)| known == name) {
            Some(k) => out[k].1.push(row),
            None if out.len() < MOST_LINES => out.push((name.to_owned(), vec![row])),
            None => {}
        }
    }
    out
}

/// A light curve in one line, and its flags.
fn curve_line(curve: &Sheet, rows: &[usize]) -> (String, String) {
    let range = |values: Vec<f64>| {
        let finite = values.into_iter().filter(|v| v.is_finite());
        finite.fold(None, |ends: Option<(f64, f64)>, v| Some(ends.map_or((v, v), |(a, b)| (a.min(v), b.max(v)))))
    };
    let mags = range(rows.iter().map(|r| curve.number(*r, "mag_v")).collect());
    let snr = range(rows.iter().map(|r| curve.number(*r, "flux_e") / curve.number(*r, "flux_err_e")).collect());
    let mags = mags.map_or("no calibrated magnitude".into(), |(a, b)| format!("V {a:.3} to {b:.3}"));
    let snr = snr.map_or_else(String::new, |(a, b)| format!(", SNR {} to {}", digits(a, 3), digits(b, 3)));
    let bits = rows.iter().map(|r| curve.cell(*r, "flags").parse::<u32>().unwrap_or(0)).collect::<Vec<_>>();
    let counted = FLAGS.iter().map(|(bit, word)| (bits.iter().filter(|b| *b & bit != 0).count(), word));
    let counted = counted.filter(|(n, _)| *n > 0).map(|(n, word)| format!("{n} {word}")).collect::<Vec<_>>();
    let plural = if rows.len() == 1 { "" } else { "s" };
    let flags = if counted.is_empty() { "none flagged".to_owned() } else { counted.join(", ") };
    (mags + &snr, format!("{} point{plural}: {flags}", rows.len()))
}

/// A row of the ledger: name, mean and whether it takes part.
fn mean(row: &Json) -> f64 {
    row["mean_e_px"].as_f64().unwrap_or(f64::NAN)
}

/// Light whose photons make noise in every pixel.
fn is_diffuse(name: &str) -> bool {
    name.starts_with("sky.") || name == "detector.dark"
}

/// The largest part of a pixel's variance, of the sources of the ledger and the scene's camera: its name, variance \[e-^2\] and share.
fn dominant(c: &Collected) -> Option<(String, f64, f64)> {
    let name = |row: &Json| row["name"].as_str().unwrap_or("").to_owned();
    let diffuse = c.ledger.iter().filter(|row| is_diffuse(&name(row)) && mean(row) > 0.0);
    let mut parts = diffuse.map(|row| (format!("photons of {}", name(row)), mean(row))).collect::<Vec<_>>();
    if let (Some(scene), false) = (&c.scene, c.ledger.is_empty()) {
        let d = &scene.detector;
        parts.push(("read noise".into(), d.read_noise_rms_e().powi(2)));
        parts.push(("rounding to ADU".into(), d.gain_e_per_adu.powi(2) / 12.0));
    }
    let total = parts.iter().map(|p| p.1).sum::<f64>();
    parts.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).map(|(name, v)| (name, v, v / total))
}

/// Bars of the mean of every source.
pub(super) fn budget(c: &Collected) -> String {
    let mut rows = c.ledger.iter().filter(|row| mean(row) > 0.0).collect::<Vec<_>>();
    rows.sort_by(|a, b| mean(b).total_cmp(&mean(a)));
    let most = rows.first().map_or(1.0, |row| mean(row));
    let total = rows.iter().map(|row| mean(row)).sum::<f64>();
    if rows.is_empty() {
        return super::html::note("ledger.json is not in this directory, or holds no light.");
    }
    let mut out = String::from(
        "<table class=\"bars\"><caption>Mean of each source over the frames, e⁻ a pixel: of sky and dark current at the frame's centre, of \
         stars and targets over the frame</caption><thead><tr><th scope=\"col\">Source</th><th scope=\"col\" class=\"n\">e⁻/px</th>\
         <th scope=\"col\">Uncertain by</th><th scope=\"col\">Share</th></tr></thead><tbody>",
    );
    for row in rows {
        let (name, value) = (row["name"].as_str().unwrap_or(""), mean(row));
        let share = 100.0 * value / total;
        let unsure = row["uncertainty"]
            .as_f64()
            .filter(|u| *u > 0.0)
            .map_or_else(String::new, |u| format!("± {:.0} %", 100.0 * u));
        out += &format!(
            "<tr><th scope=\"row\">{}</th><td class=\"n\"><data value=\"{value}\">{}</data></td><td><small>{unsure}</small></td>\
             <td><span class=\"bar\" style=\"--w:{:.2}%\"></span><small>{share:.1} %</small></td></tr>",
            escaped(name),
            short(value, "mean_e_px"),
            100.0 * value / most,
        );
    }
    out + "</tbody></table>"
}

/// The ledger in words.
pub(super) fn ledger(c: &Collected) -> String {
    if c.ledger.is_empty() {
        return String::new();
    }
    let mut out = String::from(
        "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"Ledger\"><table class=\"ledger\"><caption>Every source and step: in the \
         frames or left out, and why</caption><thead><tr><th scope=\"col\">Source or step</th><th scope=\"col\">Verdict</th>\
         <th scope=\"col\" class=\"n\">Mean <small>e⁻/px</small></th><th scope=\"col\" class=\"n\">Bound <small>e⁻/px</small></th>\
         <th scope=\"col\">Why</th></tr></thead><tbody>",
    );
    for row in &c.ledger {
        let text = |key: &str| escaped(row[key].as_str().unwrap_or(""));
        let number = |key: &str| match row[key].as_f64() {
            Some(v) => format!("<data value=\"{v}\">{}</data>", short(v, "bound")),
            None => "unknown".into(),
        };
        let needed = row["verdict"] == "needed";
        out += &format!(
            "<tr class=\"{0}\"><th scope=\"row\">{1}</th><td><span class=\"verdict {0}\">{2}</span></td><td class=\"n\">{3}</td>\
             <td class=\"n\">{4}</td><td>{5}</td></tr>",
            if needed { "needed" } else { "absent" },
            text("name"),
            text("verdict"),
            number("mean_e_px"),
            number("bound"),
            text("why"),
        );
    }
    out + "</tbody></table></div>"
}

/// Where it all comes from.
pub(super) fn provenance(c: &Collected) -> String {
    let mut out = String::from("<dl class=\"facts\">");
    out += &fact("Report by", &format!("nightglass {}", env!("CARGO_PKG_VERSION")), "");
    if let Some(scene) = &c.scene {
        out += &fact("Scene", &scene.name, "");
        out += &fact("Seed", &scene.seed.to_string(), "");
        out += &format!("<div class=\"wide\"><dt>SCENESHA</dt><dd><code>{}</code></dd></div>", scene.sha256());
    }
    out += "</dl><div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"Files\"><table><caption>Files this page is made from</caption>\
            <thead><tr><th scope=\"col\">File</th><th scope=\"col\" class=\"n\">Bytes</th><th scope=\"col\">SHA-256</th></tr></thead><tbody>";
    for source in &c.sources {
        out += &format!(
            "<tr><th scope=\"row\">{}</th><td class=\"n\">{}</td><td><code>{}</code></td></tr>",
            escaped(&source.name),
            source.bytes,
            source.sha256
        );
    }
    out + "</tbody></table></div>"
}
