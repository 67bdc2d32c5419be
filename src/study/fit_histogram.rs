//! The histogram of residuals against the standard normal, and their figures.

use super::fit_plan::{Datum, OUTLIER, Plan};
use super::page::{Anchor, Page, SMALL, TITLE, WIDTH, named, ticks};
use super::palette::COLOURS;
use std::f64::consts::TAU;
use std::fmt::Write;

/// Left and right of the histogram \[px\].
pub(super) const HISTOGRAM: [f64; 2] = [926.0, WIDTH - 30.0];
/// Its top and bottom \[px\].
const BARS: [f64; 2] = [TITLE + 44.0, 420.0];
/// Its end on either side \[sigma\].
const FAR: f64 = 5.0;
/// Style of lines of axes.
pub(super) const GREY: &str = "stroke=\"#999\" stroke-width=\"1\"";

/// Colour of the outline of marks, and their filling.
pub(super) fn style(held_out: bool) -> (String, String) {
    let colour = named(COLOURS[if held_out { 3 } else { 1 }]);
    if held_out { (colour, "white".to_owned()) } else { (colour.clone(), colour) }
}

/// Density of residuals in bins over +-[`FAR`]; none for no points.
fn densities(plan: &Plan, held_out: bool, bins: usize) -> Vec<f64> {
    let mut counts = vec![0.0; bins];
    let mut total = 0.0;
    let bin = 2.0 * FAR / bins as f64;
    for d in plan.data().filter(|d| d.held_out == held_out) {
        total += 1.0;
        let place = ((d.z + FAR) / bin).floor();
        if place >= 0.0
            && let Some(count) = counts.get_mut(place as usize)
        {
            *count += 1.0;
        }
    }
    if total > 0.0 { counts.iter().map(|c| c / total / bin).collect() } else { Vec::new() }
}

/// The histogram at its place, and the figures below it.
pub(super) fn histogram(page: &mut Page, plan: &Plan) {
    let bins = |held_out| {
        let count = plan.data().filter(|d| d.held_out == held_out).count();
        if count < 100 {
            10
        } else if count < 1000 {
            20
        } else {
            40
        }
    };
    let both = [false, true].map(|held_out| densities(plan, held_out, bins(held_out)));
    let peak = both.iter().flatten().copied().fold(0.4, f64::max) * 1.08;
    let x = |z: f64| HISTOGRAM[0] + (z + FAR) / (2.0 * FAR) * (HISTOGRAM[1] - HISTOGRAM[0]);
    let y = |density: f64| BARS[1] - density / peak * (BARS[1] - BARS[0]);
    page.rectangle(
        [HISTOGRAM[0], BARS[0]],
        [HISTOGRAM[1] - HISTOGRAM[0], BARS[1] - BARS[0]],
        "fill=\"none\" stroke=\"#bbb\"",
    );
    for (held_out, densities) in [false, true].into_iter().zip(&both).filter(|(_, d)| !d.is_empty()) {
        let bin = 2.0 * FAR / densities.len() as f64;
        let mut path = format!("M{:.1} {:.1}", x(-FAR), y(0.0));
        for (k, density) in densities.iter().enumerate() {
            // writing to a string cannot fail
            let _ = write!(path, "V{:.1}H{:.1}", y(*density), x(bin * (k + 1) as f64 - FAR));
        }
        let _ = write!(path, "V{:.1}", y(0.0));
        let (colour, _) = style(held_out);
        let fill = if held_out { "none".to_owned() } else { colour.clone() };
        page.add(format_args!(
            "<path d=\"{path}\" fill=\"{fill}\" fill-opacity=\"0.3\" stroke=\"{colour}\" stroke-width=\"1.3\"/>"
        ));
    }
    let normal = (0..=100).map(|k| {
        let z = FAR * (f64::from(k) / 50.0 - 1.0);
        format!("{:.1},{:.1}", x(z), y((-0.5 * z * z).exp() / TAU.sqrt()))
    });
    let normal = normal.collect::<Vec<_>>().join(" ");
    page.add(format_args!("<polyline points=\"{normal}\" fill=\"none\" stroke=\"#222\" stroke-width=\"1.4\"/>"));
    for (value, label) in ticks(-FAR, FAR, 10.0) {
        page.line([x(value), BARS[1]], [x(value), BARS[1] + 4.0], GREY);
        page.text([x(value), BARS[1] + 17.0], 12.0, Anchor::Middle, &label);
    }
    for (value, label) in ticks(0.0, peak, 6.0) {
        page.line([HISTOGRAM[0] - 4.0, y(value)], [HISTOGRAM[0], y(value)], GREY);
        page.text([HISTOGRAM[0] - 7.0, y(value) + 4.0], 12.0, Anchor::End, &label);
    }
    let middle = 0.5 * (HISTOGRAM[0] + HISTOGRAM[1]);
    page.text([middle, BARS[1] + 37.0], SMALL, Anchor::Middle, "residual, sigma");
    page.text([HISTOGRAM[0], BARS[0] - 7.0], 12.0, Anchor::Start, "density; line: standard normal");
    for (row, held_out) in [false, true].into_iter().filter(|h| plan.data().any(|d| d.held_out == *h)).enumerate()
    {
        let top = BARS[1] + 68.0 + 84.0 * row as f64;
        for (line, words) in figures(plan, held_out).iter().enumerate() {
            page.text([HISTOGRAM[0], top + 18.0 * line as f64], SMALL, Anchor::Start, words);
        }
    }
}

/// Figures of the residuals of points fitted or held out, in lines.
fn figures(plan: &Plan, held_out: bool) -> [String; 4] {
    let data = plan.data().filter(|d| d.held_out == held_out);
    let count = data.clone().count();
    let mean = |of: fn(&Datum) -> f64| data.clone().map(of).sum::<f64>() / count.max(1) as f64;
    let far = data.clone().filter(|d| d.z.abs() > OUTLIER).count();
    let out = data.clone().filter(|d| !(-FAR..FAR).contains(&d.z)).count();
    let name = if held_out { "held out" } else { "fitted" };
    [
        format!("{name}: {count} point{}", if count == 1 { "" } else { "s" }),
        format!("mean {}, rms {} sigma", short(mean(|d| d.z)), short(mean(|d| d.z * d.z).sqrt())),
        format!("beyond 3 sigma: {far} (normal: {:.1})", 0.002_699_8 * count as f64),
        format!("beyond 5, not in the histogram: {out}"),
    ]
}

/// A residual in few letters.
fn short(z: f64) -> String {
    if z.abs() < 1e4 { format!("{z:.2}") } else { format!("{z:.1e}") }
}

#[cfg(test)]
mod tests {
    use super::super::fit_plan::FitPoint;
    use super::*;

    #[test]
    fn densities_are_counts_over_all_points_and_the_bin() {
        let point = |flux: f64| FitPoint { time_s: flux, flux, sigma: 1.0, model: 0.0, held_out: false, curve: 0 };
        // 2 in the bin of -1 to 0, 1 in that of 1 to 2, 1 at the upper end and 1 far out
        let plan = Plan::of(&[-0.5, -1.0, 1.5, 5.0, -40.0].map(point));
        let densities = densities(&plan, false, 10);
        assert_eq!(densities, [0.0, 0.0, 0.0, 0.0, 0.4, 0.0, 0.2, 0.0, 0.0, 0.0]);
        assert!(super::densities(&plan, true, 10).is_empty());
        assert_eq!(figures(&plan, false)[3], "beyond 5, not in the histogram: 2");
    }
}
