//! The zenith over a night: electrons of every source against time.

use super::palette::COLOURS;
use super::sky::{Means, NAMES, SOURCES};
use crate::astro::time::Instant;
use plotters::prelude::*;

/// Size of the chart \[px\].
const SIZE: (u32, u32) = (1200, 620);

/// Number of the twilight among the sources.
const TWILIGHT: usize = 2;

/// Colours of the sources, in order; the Moon is grey.
const OF_SOURCE: [RGBColor; SOURCES] =
    [COLOURS[2], COLOURS[4], COLOURS[0], COLOURS[5], RGBColor(120, 120, 120), COLOURS[1]];

/// The chart as SVG; `curve` holds hours from `from` and the means there.
pub fn svg(station: &str, from: &Instant, curve: &[(f64, Means)]) -> String {
    let mut text = String::new();
    // drawing into a string fails only where the chart has no room, which its size gives
    let drawn = draw(&mut text, station, from, curve);
    debug_assert!(drawn.is_ok(), "{drawn:?}");
    text
}

fn draw(
    text: &mut String,
    station: &str,
    from: &Instant,
    curve: &[(f64, Means)],
) -> Result<(), Box<dyn std::error::Error>> {
    // where a source is unknown, by day, so is the sum
    let total = |m: &Means| m.iter().sum::<f64>();
    // by day twilight is unknown
    let known = |m: &Means| m[TWILIGHT].is_finite();
    let begin = curve.iter().position(|(_, m)| known(m)).unwrap_or(0);
    let end = curve.iter().rposition(|(_, m)| known(m)).map_or(curve.len(), |k| k + 1);
    let curve = &curve[begin..end];
    let values = || curve.iter().flat_map(|(_, m)| m.iter().copied().chain([total(m)])).filter(|v| *v > 0.0);
    let most = values().fold(0.0, f64::max);
    let least = values().fold(most, f64::min);
    if most <= 0.0 {
        let root = SVGBackend::with_string(text, SIZE).into_drawing_area();
        root.fill(&WHITE)?;
        let words = format!("zenith over {station}: no source shines, or none is known");
        root.draw(&Text::new(words, (60, 60), ("sans-serif", 20)))?;
        return Ok(root.present()?);
    }
    let (low, high) = (least.max(most * 1e-7) * 0.7, most * 3.0);
    let midnight = from.mjd_utc().fract() * 24.0;
    let hours = |point: Option<&(f64, Means)>| midnight + point.map_or(0.0, |(h, _)| *h);
    let (first, last) = (hours(curve.first()), hours(curve.last()).max(hours(curve.first()) + 0.1));
    let root = SVGBackend::with_string(text, SIZE).into_drawing_area();
    root.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&root)
        .caption(format!("zenith over {station}, night of {}", &from.iso_utc()[..10]), ("sans-serif", 20))
        .margin_right(24)
        .margin_top(8)
        .x_label_area_size(44)
        .y_label_area_size(84)
        .build_cartesian_2d(first..last, (low..high).log_scale())?;
    let clock = |h: &f64| {
        let minutes = (h * 60.0).round() as i64;
        format!("{:02}:{:02}", minutes / 60 % 24, minutes % 60)
    };
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(BLACK.mix(0.12))
        .x_labels(13)
        .x_desc("UTC")
        .y_desc("e-/px/s")
        .x_label_formatter(&clock)
        .y_label_formatter(&|v: &f64| {
            if (0.01..10_000.0).contains(v) { format!("{v}") } else { format!("{v:.0e}") }
        })
        .label_style(("sans-serif", 14))
        .draw()?;
    let parts = |value: &dyn Fn(&Means) -> f64| {
        let mut parts = vec![Vec::new()];
        for (hours, means) in curve {
            let v = value(means);
            if v >= low {
                if let Some(part) = parts.last_mut() {
                    part.push((midnight + hours, v));
                }
            } else {
                parts.push(Vec::new());
            }
        }
        parts.retain(|part: &Vec<_>| part.len() > 1);
        parts
    };
    let mut place = 0;
    let mut line = |name: &str, colour: RGBColor, width: u32, value: &dyn Fn(&Means) -> f64| {
        let own = parts(value);
        if own.is_empty() {
            return Ok::<_, Box<dyn std::error::Error>>(());
        }
        for part in own {
            chart.draw_series(LineSeries::new(part, colour.stroke_width(width)))?;
        }
        let at = (110 + 150 * place, 44);
        root.draw(&PathElement::new(vec![(at.0, at.1 + 7), (at.0 + 24, at.1 + 7)], colour.stroke_width(width)))?;
        root.draw(&Text::new(name.to_owned(), (at.0 + 30, at.1), ("sans-serif", 14)))?;
        place += 1;
        Ok(())
    };
    line("all sources", BLACK, 3, &total)?;
    for k in 0..SOURCES {
        line(NAMES[k], OF_SOURCE[k], 2, &|m: &Means| m[k])?;
    }
    if curve.iter().any(|(_, m)| total(m).is_nan()) {
        let words = "no sum where a source is outside its model: daylight, an eclipsed Moon";
        root.draw(&Text::new(words, (110, 66), ("sans-serif", 14)))?;
    }
    Ok(root.present()?)
}
