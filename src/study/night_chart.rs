//! The chart of a night: altitude against time, with the twilights, the Moon, the targets and their windows.

use super::palette::COLOURS;
use crate::astro::bodies::moon_from;
use crate::astro::observer::Observer;
use crate::astro::time::Instant;
use crate::plan::PlanError;
use crate::plan::interval::{Interval, LEAST_STEP_S, Margin, pieces};
use crate::plan::place::Motion;
use crate::plan::planner::Planner;
use crate::plan::view::Horizontal;
use crate::plan::windows::{SUN_RATE, Window, sun_elevation};
use crate::scene::Scene;
use plotters::coord::Shift;
use plotters::prelude::*;

/// Most targets that one chart shows.
const MOST_TARGETS: usize = COLOURS.len();
/// Longest time that one chart shows \[s\]; of a longer plan it shows the beginning.
const LONGEST_S: f64 = 3.0 * 86_400.0;
/// Size of the chart \[px\].
const SIZE: (u32, u32) = (1200, 680);
/// Height of a target's strip of windows \[px\].
const STRIP: i32 = 26;
/// Steps of a curve.
const STEPS: usize = 1440;

/// Lowest Sun \[deg\] of each band, its colour and name, from day to night.
const BANDS: [(f64, RGBColor, &str); 5] = [
    (0.0, RGBColor(255, 248, 222), "day"),
    (-6.0, RGBColor(228, 232, 244), "civil"),
    (-12.0, RGBColor(206, 214, 236), "nautical"),
    (-18.0, RGBColor(182, 194, 226), "astronomical"),
    (-90.0, RGBColor(158, 174, 214), "night"),
];

/// The chart as SVG. `windows` holds those of each target of the scene, in its order.
///
/// # Errors
/// [`PlanError`] where the sky cannot be computed.
pub fn svg(
    scene: &Scene,
    planner: &Planner,
    span: Interval,
    windows: &[Vec<Window>],
) -> Result<String, PlanError> {
    let span = Interval { end: span.end.min(span.start.plus(LONGEST_S)), ..span };
    let sky = Sky::of(planner, span, &windows[..windows.len().min(MOST_TARGETS)])?;
    let mut text = String::new();
    // drawing into a string fails only where the chart has no room, which its size gives
    let drawn = draw(&mut text, scene, &sky, windows);
    debug_assert!(drawn.is_ok(), "{drawn:?}");
    Ok(text)
}

/// What the chart shows.
struct Sky {
    span: Interval,
    /// Bands of twilight: from, to \[h\], number of the band.
    bands: Vec<(f64, f64, usize)>,
    /// Hours and degrees of the Moon.
    moon: Vec<(f64, f64)>,
    /// Hours and degrees of each target; NaN where its orbit is not known.
    targets: Vec<Vec<(f64, f64)>>,
}

impl Sky {
    fn of(planner: &Planner, span: Interval, windows: &[Vec<Window>]) -> Result<Self, PlanError> {
        let hours = |t: &Instant| t.since(&span.start) / 3600.0;
        let mut bands = Vec::new();
        for (number, window) in BANDS.windows(2).enumerate() {
            let limit = window[0].0.to_radians();
            let cut = pieces(span, LEAST_STEP_S, |t| {
                let value = sun_elevation(&planner.observer(t)?, t) - limit;
                Ok::<_, PlanError>(Margin { value, safe_s: value.abs() / SUN_RATE })
            })?;
            for (interval, above) in cut {
                // later bands are painted over earlier ones
                if number == 0 || !above {
                    let band = if above { number } else { number + 1 };
                    bands.push((hours(&interval.start), hours(&interval.end), band));
                }
            }
        }
        let step = span.seconds() / STEPS as f64;
        let mut sky = Self { span, bands, moon: Vec::new(), targets: vec![Vec::new(); windows.len()] };
        let elevation = |enu| Horizontal::of(enu).elevation.to_degrees();
        let target = |number: usize, observer: &Observer, t: &Instant| {
            let place = planner.motion(number).and_then(|m: &Motion| m.place_from(observer, t).ok());
            place.map_or(f64::NAN, |p| elevation(observer.refracted(observer.airless_geocentric(p.geocentric))))
        };
        for k in 0..=STEPS {
            let t = span.start.plus(k as f64 * step);
            let observer = planner.observer(&t)?;
            sky.moon.push((hours(&t), elevation(observer.airless_geocentric(moon_from(&t, observer.gcrs)))));
            for (number, curve) in sky.targets.iter_mut().enumerate() {
                curve.push((hours(&t), target(number, &observer, &t)));
            }
        }
        // a low satellite moves far in a step: its windows are drawn from edge to edge, over its highest place
        for (number, (curve, own)) in sky.targets.iter_mut().zip(windows).enumerate() {
            let observable = own.iter().filter(|w| w.observable);
            let turns = observable.flat_map(|w| [w.interval.start, w.highest.0, w.interval.end]);
            for t in turns.filter(|t| (span.start..=span.end).contains(t)) {
                curve.push((hours(&t), target(number, &planner.observer(&t)?, &t)));
            }
            curve.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
        Ok(sky)
    }

    fn hours(&self, interval: &Interval) -> (f64, f64) {
        let at = |t: &Instant| (t.since(&self.span.start) / 3600.0).clamp(0.0, self.span.seconds() / 3600.0);
        (at(&interval.start), at(&interval.end))
    }
}

type Drawn = Result<(), Box<dyn std::error::Error>>;

fn draw(text: &mut String, scene: &Scene, sky: &Sky, windows: &[Vec<Window>]) -> Drawn {
    let root = SVGBackend::with_string(text, SIZE).into_drawing_area();
    root.fill(&WHITE)?;
    let strips = sky.targets.len() as i32 * STRIP + 44;
    let (above, below) = root.split_vertically(SIZE.1 as i32 - strips);
    altitudes(&above, scene, sky, windows)?;
    gantt(&below, scene, sky, windows)?;
    Ok(root.present()?)
}

fn altitudes(area: &DrawingArea<SVGBackend, Shift>, scene: &Scene, sky: &Sky, windows: &[Vec<Window>]) -> Drawn {
    let span_h = sky.span.seconds() / 3600.0;
    let dates = [sky.span.start, sky.span.end].map(|t| t.iso_utc()[..10].to_owned());
    // hours count from midnight, so that marks fall on whole ones
    let first = sky.span.start.mjd_utc().fract() * 24.0;
    let title = format!("{}, {} to {}", scene.station.name, dates[0], dates[1]);
    let mut chart = ChartBuilder::on(area)
        .caption(title, ("sans-serif", 20))
        .margin_right(24)
        .margin_top(8)
        .x_label_area_size(44)
        .y_label_area_size(64)
        .build_cartesian_2d(first..first + span_h, 0.0..90.0)?;
    for (from, to, band) in &sky.bands {
        let area = Rectangle::new([(first + from, 0.0), (first + to, 90.0)], BANDS[*band].1.filled());
        chart.draw_series([area])?;
    }
    let clock = |h: &f64| {
        let minutes = (h * 60.0).round() as i64;
        format!("{:02}:{:02}", minutes / 60 % 24, minutes % 60)
    };
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(BLACK.mix(0.12))
        .x_labels(13)
        .y_labels(10)
        .x_desc("UTC")
        .y_desc("apparent altitude, deg")
        .y_label_formatter(&|el: &f64| format!("{el:.0}"))
        .x_label_formatter(&clock)
        .label_style(("sans-serif", 14))
        .draw()?;
    let lowest = scene.plan.min_el_deg.clamp(0.0, 90.0);
    let limit = PathElement::new(vec![(first, lowest), (first + span_h, lowest)], BLACK.mix(0.45));
    chart.draw_series([limit])?;
    let grey = RGBColor(90, 90, 90);
    for part in above_horizon(&sky.moon, first) {
        chart.draw_series(DashedLineSeries::new(part, 7, 5, grey.stroke_width(2)))?;
    }
    for (number, curve) in sky.targets.iter().enumerate() {
        let colour = COLOURS[number % COLOURS.len()];
        for part in above_horizon(curve, first) {
            chart.draw_series(LineSeries::new(part, colour.stroke_width(2)))?;
        }
        // where it can be observed the line is thick
        for window in windows[number].iter().filter(|w| w.observable) {
            let (from, to) = sky.hours(&window.interval);
            let part = curve.iter().filter(|(h, el)| (from..=to).contains(h) && *el > 0.0);
            let part = part.map(|(h, el)| (first + h, *el));
            chart.draw_series(LineSeries::new(part, colour.stroke_width(6)))?;
        }
    }
    let marks = opening_hours(scene, sky)
        .into_iter()
        .map(|h| PathElement::new(vec![(first + h, 88.0), (first + h, 90.0)], BLACK));
    chart.draw_series(marks)?;
    Ok(())
}

/// Hours at which the shutter opens, as many as can be told apart.
fn opening_hours(scene: &Scene, sky: &Sky) -> Vec<f64> {
    let exposures = &scene.exposures;
    let start = exposures.start.since(&sky.span.start) / 3600.0;
    let stride = (exposures.count / 1000).max(1);
    let hours = (0..exposures.count).step_by(stride).map(|k| start + k as f64 * exposures.cadence_s / 3600.0);
    hours.take_while(|h| *h <= sky.span.seconds() / 3600.0).collect()
}

/// The parts of a curve above the horizon, from rise to set between its points, its hours counted from `first`.
fn above_horizon(curve: &[(f64, f64)], first: f64) -> Vec<Vec<(f64, f64)>> {
    let (mut parts, mut part) = (Vec::new(), Vec::new());
    for (number, (h, el)) in curve.iter().enumerate() {
        let before = number.checked_sub(1).map(|k| curve[k]);
        if let Some((h0, el0)) = before.filter(|(_, el0)| el0 * el < 0.0) {
            part.push((first + h0 + (h - h0) * el0 / (el0 - el), 0.0));
        }
        if *el >= 0.0 {
            part.push((first + h, *el));
        } else {
            parts.push(std::mem::take(&mut part));
        }
    }
    parts.push(part);
    parts.retain(|part| part.len() > 1);
    parts
}

/// A strip a target, with its windows; below it what the lines and shades mean.
fn gantt(area: &DrawingArea<SVGBackend, Shift>, scene: &Scene, sky: &Sky, windows: &[Vec<Window>]) -> Drawn {
    let (left, right) = (64, SIZE.0 as i32 - 24);
    let span_h = sky.span.seconds() / 3600.0;
    let x = |h: f64| left + (h / span_h * f64::from(right - left)).round() as i32;
    let label = |size: i32| TextStyle::from(("sans-serif", size).into_font()).color(&BLACK);
    for (number, own) in windows.iter().take(sky.targets.len()).enumerate() {
        let top = number as i32 * STRIP;
        let frame = Rectangle::new([(left, top), (right, top + STRIP - 6)], RGBColor(238, 238, 238).filled());
        area.draw(&frame)?;
        for window in own.iter().filter(|w| w.observable) {
            let (from, to) = sky.hours(&window.interval);
            if to > from {
                let colour = COLOURS[number % COLOURS.len()].mix(0.75).filled();
                let bar = Rectangle::new([(x(from), top), (x(to).max(x(from) + 1), top + STRIP - 6)], colour);
                area.draw(&bar)?;
            }
        }
        let observable = own.iter().filter(|w| w.observable);
        let total = observable.fold(0.0, |sum, w| sum + w.interval.seconds());
        let name = scene.target.get(number).map_or("", |t| t.name.as_str());
        let words = format!("{name}: observable for {:.1} h", total / 3600.0);
        area.draw(&Text::new(words, (left + 8, top + 3), label(14)))?;
    }
    let base = sky.targets.len() as i32 * STRIP + 6;
    let mut at = left;
    for (_, colour, name) in BANDS {
        area.draw(&Rectangle::new([(at, base), (at + 18, base + 14)], colour.filled()))?;
        area.draw(&Text::new(name, (at + 24, base), label(14)))?;
        at += 60 + 8 * name.len() as i32;
    }
    let left_out = scene.target.len().saturating_sub(sky.targets.len());
    let more = if left_out > 0 { format!("; {left_out} more targets are not shown") } else { String::new() };
    let words = format!("dashed: Moon; thick: observable; marks at the top: exposures{more}");
    area.draw(&Text::new(words, (at + 10, base), label(14)))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_rise_and_set_between_their_points() {
        let curve = [
            (0.0, -1.0),
            (1.0, 1.0),
            (2.0, 3.0),
            (3.0, -1.0),
            (4.0, f64::NAN),
            (5.0, 2.0),
            (6.0, 0.0),
            (7.0, -1.0),
            (8.0, 3.0),
        ];
        let parts = above_horizon(&curve, 10.0);
        assert_eq!(parts[0], [(10.5, 0.0), (11.0, 1.0), (12.0, 3.0), (12.75, 0.0)]);
        assert_eq!(parts[1], [(15.0, 2.0), (16.0, 0.0)]);
        assert_eq!(parts[2], [(17.25, 0.0), (18.0, 3.0)]);
        assert_eq!(parts.len(), 3);
        assert!(above_horizon(&[(0.0, -1.0), (1.0, f64::NAN)], 0.0).is_empty());
    }
}
