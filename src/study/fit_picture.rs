//! The picture of a fit: measured flux and model over time, residuals in sigma below, their histogram against the standard
//! normal at the right.
//!
//! Long gaps and other curves begin panels of their own. Of many points some are drawn; histogram and figures are of all.

use super::fit_histogram::{GREY, HISTOGRAM, histogram, style};
pub use super::fit_plan::FitPoint;
use super::fit_plan::{Datum, MOST_PANELS, Panel, Plan};
use super::page::{Anchor, Page, SIDE, SMALL, TITLE, named, number, ticks, width};
use super::palette::COLOURS;
use std::fmt::Write;

/// Left and right of the panels of time \[px\].
const TIME: [f64; 2] = [SIDE + 16.0, 850.0];
/// Top and bottom of the panels of flux, and of residuals \[px\].
const FLUX: [f64; 2] = [TITLE + 44.0, 420.0];
const RESIDUAL: [f64; 2] = [440.0, 590.0];
/// Width between panels, and the least of a panel \[px\].
const BETWEEN: f64 = 6.0;
const NARROWEST: f64 = 9.0;
/// Room of a label of time \[px\].
const LABELLED: f64 = 62.0;
/// Height of the page \[px\].
const HEIGHT: f64 = 716.0;
/// Residuals that are drawn at their place reach at least and at most so far \[sigma\].
const REACH: [f64; 2] = [4.0, 6.0];

/// Scales of the axes.
struct Scales {
    flux: (f64, f64),
    residual: f64,
    /// Left and right of every panel that is drawn \[px\].
    panels: Vec<(f64, f64)>,
    /// First time of all \[s\], and the unit of time \[s\] with its name.
    start: f64,
    unit: (f64, &'static str),
}

impl Scales {
    fn of(plan: &Plan) -> Self {
        let shown = plan.shown();
        let data = || shown.iter().flat_map(|panel| &panel.data);
        let mut ends = data().flat_map(|d| [d.flux - d.sigma, d.flux + d.sigma]).collect::<Vec<_>>();
        ends.sort_by(f64::total_cmp);
        // a few outliers must not flatten the curve
        let beyond = ends.len() / 200;
        let low = ends.get(beyond).copied().unwrap_or(0.0);
        let high = ends.get(ends.len().saturating_sub(1 + beyond)).copied().unwrap_or(1.0);
        let (low, high) = data().fold((low, high), |(l, h), d| (l.min(d.model), h.max(d.model)));
        let room = (0.05 * (high - low)).max(1e-9 * high.abs().max(low.abs())).max(1e-300);
        let most = data().map(|d| d.z.abs()).fold(0.0, f64::max);
        let longest = shown.iter().map(Panel::span).fold(0.0, f64::max);
        let start = plan.data().map(|d| d.time_s).fold(f64::INFINITY, f64::min);
        Self {
            flux: (low - room, high + room),
            residual: (1.1 * most).clamp(REACH[0], REACH[1]),
            panels: widths(shown),
            start,
            unit: unit(longest),
        }
    }

    fn flux_y(&self, flux: f64) -> f64 {
        let share = (flux - self.flux.0) / (self.flux.1 - self.flux.0);
        FLUX[1] - share.clamp(0.0, 1.0) * (FLUX[1] - FLUX[0])
    }

    fn residual_y(&self, z: f64) -> f64 {
        let share = 0.5 + 0.5 * (z / self.residual).clamp(-1.0, 1.0);
        RESIDUAL[1] - share * (RESIDUAL[1] - RESIDUAL[0])
    }
}

/// A fitting unit of time \[s\] and its name.
fn unit(span_s: f64) -> (f64, &'static str) {
    match span_s {
        ..300.0 => (1.0, "s"),
        ..18_000.0 => (60.0, "min"),
        ..172_800.0 => (3600.0, "h"),
        _ => (86_400.0, "d"),
    }
}

/// Left and right of panels: as wide as they are long, but none too narrow.
fn widths(panels: &[Panel]) -> Vec<(f64, f64)> {
    let room = TIME[1] - TIME[0] - BETWEEN * panels.len().saturating_sub(1) as f64;
    let total = panels.iter().map(Panel::span).sum::<f64>();
    let free = room - NARROWEST * panels.len() as f64;
    let mut left = TIME[0];
    let width = |panel: &Panel| {
        let share = if total > 0.0 { panel.span() / total } else { 1.0 / panels.len() as f64 };
        NARROWEST + free * share
    };
    let place = |panel: &Panel| {
        let from = left;
        left = from + width(panel) + BETWEEN;
        (from, left - BETWEEN)
    };
    panels.iter().map(place).collect()
}

/// Place of a time in its panel \[px\].
fn time_x(panel: &Panel, (left, right): (f64, f64), time_s: f64) -> f64 {
    let (first, span) = (panel.ends().0, panel.span());
    let share = if span > 0.0 { (time_s - first) / span } else { 0.5 };
    // marks at the ends stay inside
    left + 4.0 + share * (right - left - 8.0)
}

/// The picture as SVG. A point whose time, flux, error or model is not finite, or whose error is not positive, is left out; the
/// picture says so.
pub fn fit(points: &[FitPoint], title: &str) -> String {
    let plan = Plan::of(points);
    let mut page = Page::new(HEIGHT, title);
    if plan.panels.is_empty() {
        page.text([SIDE, TITLE + 40.0], 16.0, Anchor::Start, "no point with finite flux, error and model");
    } else {
        let scales = Scales::of(&plan);
        frames(&mut page, &plan, &scales);
        for (panel, ends) in plan.shown().iter().zip(&scales.panels) {
            marks(&mut page, &scales, panel, *ends);
            model(&mut page, &scales, panel, *ends, plan.step > 1);
        }
        histogram(&mut page, &plan);
        legend(&mut page, &plan);
    }
    page.text([SIDE, HEIGHT - 16.0], SMALL, Anchor::Start, &remarks(&plan));
    page.finish()
}

fn frames(page: &mut Page, plan: &Plan, scales: &Scales) {
    let (unit, name) = scales.unit;
    let several = plan.panels.windows(2).any(|pair| pair[0].curve != pair[1].curve);
    let labelled = scales.panels.iter().any(|(left, right)| right - left > LABELLED);
    let mut free = 0.0;
    for (panel, &(left, right)) in plan.shown().iter().zip(&scales.panels) {
        for [top, bottom] in [FLUX, RESIDUAL] {
            let style = "fill=\"none\" stroke=\"#bbb\"";
            page.rectangle([left, top], [right - left, bottom - top], style);
        }
        for (z, dash) in [(0.0, ""), (1.0, "3 3"), (-1.0, "3 3"), (3.0, "7 4"), (-3.0, "7 4")] {
            let y = scales.residual_y(z);
            page.line([left, y], [right, y], &format!("{GREY} stroke-dasharray=\"{dash}\""));
        }
        let first = panel.ends().0;
        for (value, label) in ticks(0.0, panel.span() / unit, ((right - left) / LABELLED).floor()) {
            let x = time_x(panel, (left, right), first + value * unit);
            // one label is no scale
            if right - left > LABELLED {
                page.line([x, RESIDUAL[1]], [x, RESIDUAL[1] + 4.0], GREY);
                page.text([x, RESIDUAL[1] + 17.0], 12.0, Anchor::Middle, &label);
            }
        }
        let since = first - scales.start;
        let (far, far_name) = self::unit(since);
        let since = format!("+{} {far_name}", number((since / far * 1e3).round() / 1e3));
        let name = if several { format!("curve {}, {since}", panel.curve) } else { since };
        // the last name may begin before its panel
        let x = left.min(HISTOGRAM[0] - 36.0 - width(&name, 12.0));
        if x >= free && plan.panels.len() > 1 {
            page.text([x, FLUX[0] - 7.0], 12.0, Anchor::Start, &name);
            free = x + width(&name, 12.0) + 8.0;
        }
    }
    for (value, label) in ticks(scales.flux.0, scales.flux.1, 7.0) {
        let y = scales.flux_y(value);
        page.line([TIME[0] - 4.0, y], [TIME[0], y], GREY);
        page.text([TIME[0] - 7.0, y + 4.0], 12.0, Anchor::End, &label);
    }
    for z in [-3.0, -1.0, 1.0, 3.0] {
        page.text([TIME[0] - 7.0, scales.residual_y(z) + 4.0], 12.0, Anchor::End, &format!("{z}"));
    }
    let flux = if plan.own_units { "flux / median of its curve" } else { "flux" };
    page.upward([20.0, 0.5 * (FLUX[0] + FLUX[1])], 14.0, flux);
    page.upward([20.0, 0.5 * (RESIDUAL[0] + RESIDUAL[1])], 14.0, "residual, sigma");
    let words = match plan.panels.len() {
        1 => format!("{name} since the first point"),
        _ if labelled => format!("{name} since the beginning of the panel; above: since the first point of all"),
        _ => {
            let longest = plan.shown().iter().map(Panel::span).fold(0.0, f64::max) / unit;
            format!("panels are at most {longest:.2} {name} long; above: since the first point of all")
        }
    };
    page.text([0.5 * (TIME[0] + TIME[1]), RESIDUAL[1] + 37.0], SMALL, Anchor::Middle, &words);
}

/// Marks of points: of those fitted, and of those held out.
fn marks(page: &mut Page, scales: &Scales, panel: &Panel, ends: (f64, f64)) {
    for held_out in [false, true] {
        let (mut bars, mut fluxes, mut residuals) = (String::new(), String::new(), String::new());
        for d in panel.data.iter().filter(|d| d.drawn && d.held_out == held_out) {
            let x = time_x(panel, ends, d.time_s);
            let [top, bottom] = [d.flux + d.sigma, d.flux - d.sigma].map(|f| scales.flux_y(f));
            // a bar hidden by its mark is left out
            if bottom - top > 4.0 {
                // writing to a string cannot fail
                let _ = write!(bars, "M{x:.1} {top:.1}V{bottom:.1}");
            }
            fluxes += &mark(x, scales.flux_y(d.flux), side(d.flux, scales.flux));
            residuals += &mark(x, scales.residual_y(d.z), side(d.z, (-scales.residual, scales.residual)));
        }
        let (colour, fill) = style(held_out);
        for (path, style) in [
            (&bars, format!("fill=\"none\" stroke=\"{colour}\" stroke-opacity=\"0.45\"")),
            (&fluxes, format!("fill=\"{fill}\" stroke=\"{colour}\" stroke-width=\"1\"")),
            (&residuals, format!("fill=\"{fill}\" stroke=\"{colour}\" stroke-width=\"1\"")),
        ] {
            if !path.is_empty() {
                page.add(format_args!("<path d=\"{path}\" {style}/>"));
            }
        }
    }
}

/// 1 above a range, -1 below, 0 inside.
fn side(value: f64, (low, high): (f64, f64)) -> i32 {
    i32::from(value > high) - i32::from(value < low)
}

/// A small square as a path, or a triangle at the edge that it lies beyond.
fn mark(x: f64, y: f64, side: i32) -> String {
    match side {
        0 => format!("M{:.1} {:.1}h3v3h-3z", x - 1.5, y - 1.5),
        1 => format!("M{:.1} {:.1}h8l-4 -7z", x - 4.0, y + 7.0),
        _ => format!("M{:.1} {:.1}h8l-4 7z", x - 4.0, y - 7.0),
    }
}

/// The model as a line; of the points in one column of pixels the first, the least, the greatest and the last.
fn model(page: &mut Page, scales: &Scales, panel: &Panel, ends: (f64, f64), dense: bool) {
    let mut path = String::new();
    let column = |d: &Datum| time_x(panel, ends, d.time_s).round();
    for chunk in panel.data.chunk_by(|a, b| column(a) == column(b)) {
        let of = |a: &&Datum, b: &&Datum| a.model.total_cmp(&b.model);
        let kept = [chunk.first(), chunk.iter().min_by(of), chunk.iter().max_by(of), chunk.last()];
        let kept = if chunk.len() > 4 { kept.to_vec() } else { chunk.iter().map(Some).collect() };
        for d in kept.into_iter().flatten() {
            let letter = if path.is_empty() { 'M' } else { 'L' };
            let (x, y) = (time_x(panel, ends, d.time_s), scales.flux_y(d.model));
            let _ = write!(path, "{letter}{x:.1} {y:.1}");
        }
    }
    let colour = named(COLOURS[0]);
    // a line that fills the panel must not hide the points
    let [width, opacity] = if dense { [1.0, 0.6] } else { [1.6, 1.0] };
    page.add(format_args!(
        "<path d=\"{path}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\" \
         stroke-opacity=\"{opacity}\" stroke-linejoin=\"round\"/>"
    ));
}

fn legend(page: &mut Page, plan: &Plan) {
    let y = HEIGHT - 52.0;
    let mut x = SIDE;
    for held_out in [false, true] {
        if plan.data().any(|d| d.held_out == held_out) {
            let (colour, fill) = style(held_out);
            page.line(
                [x + 8.0, y - 8.0],
                [x + 8.0, y + 8.0],
                &format!("stroke=\"{colour}\" stroke-opacity=\"0.45\""),
            );
            page.rectangle([x + 5.0, y - 3.0], [6.0, 6.0], &format!("fill=\"{fill}\" stroke=\"{colour}\""));
            let words = if held_out { "measured, held out of the fit" } else { "measured, fitted" };
            page.text([x + 24.0, y + 5.0], SMALL, Anchor::Start, words);
            x += 60.0 + width(words, SMALL);
        }
    }
    let colour = named(COLOURS[0]);
    page.line([x, y], [x + 26.0, y], &format!("stroke=\"{colour}\" stroke-width=\"2\""));
    page.text([x + 34.0, y + 5.0], SMALL, Anchor::Start, "model");
    x += 110.0;
    let dark = "fill=\"none\" stroke=\"#222\"";
    page.add(format_args!("<path d=\"{}\" {dark}/>", mark(x, y - 4.0, 1)));
    page.text([x + 14.0, y + 5.0], SMALL, Anchor::Start, "beyond the edge");
}

fn remarks(plan: &Plan) -> String {
    let count = plan.data().count();
    let mut words = format!("{count} point{}", if count == 1 { "" } else { "s" });
    if plan.step > 1 {
        let _ = write!(
            words,
            "; one of {} is drawn, and those beyond 3 sigma (at most 500); histogram and figures of all",
            plan.step
        );
    }
    if plan.panels.len() > MOST_PANELS {
        let _ = write!(words, "; of {} panels the first {MOST_PANELS} are drawn", plan.panels.len());
    }
    if plan.left_out > 0 {
        let _ = write!(words, "; {} left out: not finite, or without a positive error", plan.left_out);
    }
    words + "."
}
