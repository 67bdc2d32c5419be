//! The picture of a study: SNR against what was varied, trials beside it, and what the noise is made of.

use super::sweep::Sweep;
use super::table::{Row, VARIANCES};
use crate::study::page::{Anchor, Page, SIDE, SMALL, TITLE, WIDTH, fitting, named, number, ticks};
use crate::study::palette::COLOURS;
use std::fmt::Write;

/// Height of the page \[px\].
const HEIGHT: f64 = 840.0;
/// Left edge and width of the panels \[px\].
const LEFT: f64 = SIDE + 24.0;
const BROAD: f64 = WIDTH - LEFT - 250.0;
/// Top and height of the panels \[px\].
const UPPER: [f64; 2] = [TITLE + 24.0, 420.0];
const LOWER: [f64; 2] = [UPPER[0] + UPPER[1] + 84.0, 180.0];
/// Most curves.
const MOST_CURVES: usize = 8;
/// SNR below this share of the largest is not shown.
const DECADES: f64 = 1e-5;
/// Names of the variances.
const CAUSES: [&str; VARIANCES.len()] =
    ["target's photons", "sky", "stars", "dark charge", "read noise", "rounding", "background level"];

/// An axis: values to pixels.
struct Axis {
    low: f64,
    high: f64,
    log: bool,
    from: f64,
    to: f64,
}

impl Axis {
    fn new(values: impl Iterator<Item = f64>, log: bool, [from, to]: [f64; 2]) -> Self {
        let good = values.filter(|v| v.is_finite() && (!log || *v > 0.0));
        let (low, high) = good.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        let (low, high) = match (low < high, log) {
            (true, _) => (low, high),
            (false, true) if low.is_finite() => (low / 2.0, high * 2.0),
            (false, false) if low.is_finite() => (low - 0.5, high + 0.5),
            (false, _) => (0.1, 1.0),
        };
        Self { low, high, log, from, to }
    }

    fn at(&self, value: f64) -> f64 {
        let scale = |v: f64| if self.log { v.max(1e-300).ln() } else { v };
        let t = (scale(value) - scale(self.low)) / (scale(self.high) - scale(self.low));
        self.from + t * (self.to - self.from)
    }

    fn ticks(&self) -> Vec<(f64, String)> {
        if !self.log {
            return ticks(self.low, self.high, 8.0);
        }
        let decades = (self.high / self.low).log10();
        let factors: &[f64] = if decades < 3.0 { &[1.0, 2.0, 5.0] } else { &[1.0] };
        let first = self.low.log10().floor() as i32;
        let last = self.high.log10().ceil() as i32;
        let every = ((last - first) / 10).max(1) as usize;
        let values = (first..=last).step_by(every).flat_map(|k| factors.iter().map(move |f| f * 10f64.powi(k)));
        let inside = values.filter(|v| *v >= self.low * (1.0 - 1e-9) && *v <= self.high * (1.0 + 1e-9));
        inside.map(|v| (v, number(v))).collect()
    }
}

/// A curve: its name and rows, in the order of the axis.
struct Curve<'a> {
    name: String,
    rows: Vec<(f64, &'a Row)>,
}

/// The sweep that makes the axis, and the curves of the other.
fn curves<'a>(sweeps: &[Sweep], rows: &'a [Row]) -> (usize, Vec<Curve<'a>>) {
    let longest = |a: &(usize, &Sweep), b: &(usize, &Sweep)| a.1.values.len().cmp(&b.1.values.len());
    let axis = sweeps.iter().enumerate().max_by(longest).map_or(0, |(k, _)| k);
    let Some((other, sweep)) = sweeps.iter().enumerate().find(|(k, _)| *k != axis) else {
        let rows = rows.iter().filter_map(|row| Some((*row.values.first()?, row))).collect();
        return (axis, vec![Curve { name: String::new(), rows }]);
    };
    let step = (sweep.values.len().max(2) - 1) as f64 / (MOST_CURVES.min(sweep.values.len()).max(2) - 1) as f64;
    let chosen = (0..MOST_CURVES.min(sweep.values.len())).map(|k| (k as f64 * step).round() as usize);
    let chosen = chosen.filter_map(|k| sweep.values.get(k));
    let curve = |value: &f64| {
        let own = rows.iter().filter(|row| row.values.get(other) == Some(value));
        let rows = own.filter_map(|row| Some((*row.values.get(axis)?, row))).collect();
        Curve { name: short(*value), rows }
    };
    (axis, chosen.map(curve).collect())
}

/// A number of at most four digits.
fn short(value: f64) -> String {
    number(format!("{value:.3e}").parse().unwrap_or(value))
}

/// The picture as SVG; `wanted` is the SNR of the limit.
pub fn svg(title: &str, sweeps: &[Sweep], rows: &[Row], wanted: f64) -> String {
    let mut page = Page::new(HEIGHT, title);
    let (axis, curves) = curves(sweeps, rows);
    let Some(swept) = sweeps.get(axis) else { return page.finish() };
    let x = Axis::new(swept.values.iter().copied(), swept.log, [LEFT, LEFT + BROAD]);
    let parameter = sweeps.iter().find(|sweep| sweep.key != swept.key).map_or("", |sweep| sweep.key.name());
    let unit = swept.key.unit().replace(' ', "");
    let label =
        if unit.is_empty() { swept.key.name().to_owned() } else { format!("{} [{unit}]", swept.key.name()) };
    ratios(&mut page, &x, &curves, parameter, wanted);
    noise(&mut page, &x, &curves, parameter);
    page.text([LEFT + BROAD / 2.0, LOWER[0] + LOWER[1] + 46.0], 15.0, Anchor::Middle, &label);
    page.finish()
}

/// The box of a panel with the ticks of its axes.
fn frame(page: &mut Page, x: &Axis, y: &Axis, name: &str) {
    let [top, bottom] = [y.to, y.from];
    for (value, label) in x.ticks() {
        let at = x.at(value);
        page.line([at, top], [at, bottom], "stroke=\"#e4e4e4\"");
        page.text([at, bottom + 18.0], SMALL, Anchor::Middle, &label);
    }
    for (value, label) in y.ticks() {
        let at = y.at(value);
        page.line([LEFT, at], [LEFT + BROAD, at], "stroke=\"#e4e4e4\"");
        page.text([LEFT - 8.0, at + 4.5], SMALL, Anchor::End, &label);
    }
    page.rectangle([LEFT, top], [BROAD, bottom - top], "fill=\"none\" stroke=\"#444\"");
    page.upward([SIDE - 34.0, 0.5 * (top + bottom)], 15.0, name);
}

/// The SNR of each curve, its trials, and the SNR wanted.
fn ratios(page: &mut Page, x: &Axis, curves: &[Curve], parameter: &str, wanted: f64) {
    let all = || curves.iter().flat_map(|c| &c.rows).flat_map(|(_, row)| [row.get("snr"), row.get("snr_mc")]);
    let most = all().filter(|v| v.is_finite()).fold(0.0, f64::max);
    let shown = all().filter(|v| *v > DECADES * most).chain([wanted]);
    let [top, height] = UPPER;
    let y = Axis::new(shown.flat_map(|v| [v / 1.3, v * 1.3]), true, [top + height, top]);
    frame(page, x, &y, "SNR of one exposure");
    let legend = LEFT + BROAD + 18.0;
    let at = y.at(wanted);
    page.line([LEFT, at], [LEFT + BROAD, at], "stroke=\"#888\" stroke-dasharray=\"5 4\"");
    page.text([legend - 12.0, at + 4.5], SMALL, Anchor::Start, &format!("{} wanted", number(wanted)));
    page.add(format_args!(
        "<clipPath id=\"panel\"><rect x=\"{}\" y=\"{top}\" width=\"{}\" height=\"{height}\"/></clipPath>\
         <g clip-path=\"url(#panel)\">",
        LEFT - 5.0,
        BROAD + 10.0
    ));
    for (curve, colour) in curves.iter().zip(COLOURS) {
        let colour = named(colour);
        let mut line = String::new();
        for (value, row) in &curve.rows {
            let snr = row.get("snr");
            let style = if row.saturated {
                format!("fill=\"white\" stroke=\"{colour}\"")
            } else {
                format!("fill=\"{colour}\"")
            };
            if snr > 0.0 {
                let _ = write!(
                    line,
                    "{}{:.1},{:.1} ",
                    if line.is_empty() { "M" } else { "L" },
                    x.at(*value),
                    y.at(snr)
                );
                if row.get("snr_mc").is_nan() {
                    page.add(format_args!(
                        "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"3\" {style}/>",
                        x.at(*value),
                        y.at(snr)
                    ));
                }
            }
            let (trials, error) = (row.get("snr_mc"), row.get("snr_mc_err"));
            if trials > 0.0 {
                let (cx, ends) = (x.at(*value), [trials - error, trials + error].map(|v| y.at(v.max(y.low))));
                page.line([cx, ends[0]], [cx, ends[1]], &format!("stroke=\"{colour}\""));
                page.add(format_args!(
                    "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"7\" height=\"7\" fill=\"white\" stroke=\"{colour}\" stroke-width=\"1.5\"/>",
                    cx - 3.5,
                    y.at(trials) - 3.5
                ));
            }
        }
        page.add(format_args!("<path d=\"{line}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.8\"/>"));
        let all = curve.rows.iter().map(|(value, row)| (*value, row.get("snr_all"))).filter(|(_, snr)| *snr > 0.0);
        let points = all.map(|(value, snr)| format!("{:.1},{:.1}", x.at(value), y.at(snr))).collect::<Vec<_>>();
        page.add(format_args!(
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-dasharray=\"2 4\"/>",
            points.join(" ")
        ));
    }
    page.add(format_args!("</g>"));
    let mut down = top + 12.0;
    if !parameter.is_empty() {
        page.text([legend, down], SMALL, Anchor::Start, &fitting(parameter, SMALL, 220.0));
        down += 22.0;
    }
    for (curve, colour) in curves.iter().zip(COLOURS).filter(|(curve, _)| !curve.name.is_empty()) {
        let row = down - 4.0;
        page.line(
            [legend, row],
            [legend + 20.0, row],
            &format!("stroke=\"{}\" stroke-width=\"3\"", named(colour)),
        );
        page.text([legend + 28.0, down], SMALL, Anchor::Start, &curve.name);
        down += 20.0;
    }
    let there = |good: &dyn Fn(&Row) -> bool| curves.iter().flat_map(|c| &c.rows).any(|(_, row)| good(row));
    let notes = [
        (there(&|row| row.get("snr_all") < 0.99 * row.get("snr")), "dotted: with scintillation"),
        (there(&|row| row.get("snr_mc").is_finite()), "squares: frames measured"),
        (there(&|row| row.saturated && row.get("snr_mc").is_nan()), "open circles: saturated"),
    ];
    for (_, text) in notes.iter().filter(|(shown, _)| *shown) {
        page.text([legend, down], SMALL, Anchor::Start, text);
        down += 20.0;
    }
}

/// Shares of the variance along the middle curve.
fn noise(page: &mut Page, x: &Axis, curves: &[Curve], parameter: &str) {
    let [top, height] = LOWER;
    let y = Axis { low: 0.0, high: 100.0, log: false, from: top + height, to: top };
    let Some(curve) = curves.get(curves.len() / 2) else { return };
    let shares = curve.rows.iter().filter_map(|(value, row)| {
        let parts = VARIANCES.map(|name| row.get(name));
        let sum = parts.iter().sum::<f64>();
        (sum > 0.0).then(|| (x.at(*value), parts.map(|part| 100.0 * part / sum)))
    });
    let shares = shares.collect::<Vec<_>>();
    let mut below = vec![0.0; shares.len()];
    let (legend, mut down) = (LEFT + BROAD + 18.0, top + 12.0);
    for (k, colour) in COLOURS.into_iter().enumerate().take(VARIANCES.len()) {
        if shares.iter().all(|(_, parts)| parts[k] < 0.5) {
            continue;
        }
        let mut outline = String::new();
        for (i, (at, _)) in shares.iter().enumerate() {
            let _ = write!(outline, "{at:.1},{:.1} ", y.at(below[i]));
        }
        for (i, (at, parts)) in shares.iter().enumerate().rev() {
            below[i] += parts[k];
            let _ = write!(outline, "{at:.1},{:.1} ", y.at(below[i]));
        }
        let colour = named(colour);
        page.add(format_args!("<polygon points=\"{outline}\" fill=\"{colour}\" fill-opacity=\"0.75\"/>"));
        page.rectangle([legend, down - 10.0], [14.0, 11.0], &format!("fill=\"{colour}\" fill-opacity=\"0.75\""));
        page.text([legend + 22.0, down], SMALL, Anchor::Start, CAUSES[k]);
        down += 20.0;
    }
    frame(page, x, &y, "variance [%]");
    if !curve.name.is_empty() {
        page.text([LEFT, top - 8.0], SMALL, Anchor::Start, &format!("{parameter} = {}", curve.name));
    }
}
