//! Pictures of limiting magnitudes: over the sky, and through the night.

use super::limit::{MAP_COLUMNS, MAP_ROWS, MAP_STEP_DEG, Moment, Toned};
use crate::plan::view::Circumstances;
use crate::study::page::{Anchor, Page, SIDE, SMALL, TITLE, WIDTH, hex, named, ticks};
use crate::study::palette::COLOURS;
use std::f64::consts::TAU;
use std::fmt::Write;

/// Pixels along a side of the map.
const PIXELS: usize = 300;
/// Side of the map on the page \[px\].
const SQUARE: f64 = 640.0;
/// Lowest elevation of the map \[deg\].
const LOWEST_DEG: f64 = 5.0;
/// From bright to deep limits.
const RAMP: [[f64; 3]; 5] =
    [[68.0, 1.0, 84.0], [59.0, 82.0, 139.0], [33.0, 145.0, 140.0], [94.0, 201.0, 98.0], [253.0, 231.0, 37.0]];

fn colour(share: f64) -> [u8; 3] {
    let at = share.clamp(0.0, 1.0) * (RAMP.len() - 1) as f64;
    let i = (at as usize).min(RAMP.len() - 2);
    let f = at - i as f64;
    [0, 1, 2].map(|c| (RAMP[i][c] * (1.0 - f) + RAMP[i + 1][c] * f).round() as u8)
}

/// Limiting magnitude of any direction, linear between those of the map.
fn between(map: &[Toned], az_deg: f64, el_deg: f64) -> f64 {
    let row = ((el_deg - LOWEST_DEG) / MAP_STEP_DEG[1]).clamp(0.0, (MAP_ROWS - 1) as f64);
    let column = (az_deg / MAP_STEP_DEG[0]).rem_euclid(MAP_COLUMNS as f64);
    let (j, i) = ((row as usize).min(MAP_ROWS - 2), column as usize % MAP_COLUMNS);
    let (fy, fx) = (row - j as f64, column - column.floor());
    let at =
        |j: usize, i: usize| map.get(j * MAP_COLUMNS + i % MAP_COLUMNS).map_or(f64::NAN, |t| t.limiting_mag_v);
    let along = |j: usize| at(j, i) * (1.0 - fx) + at(j, i + 1) * fx;
    along(j) * (1.0 - fy) + along(j + 1) * fy
}

/// The map as SVG: zenith in the middle, north up, east to the left. `target` is azimuth and elevation of the target \[deg\].
pub fn map_svg(title: &str, map: &[Toned], now: &Circumstances, target: Option<[f64; 2]>) -> String {
    let mut page = Page::new(TITLE + SQUARE + 70.0, title);
    let [left, top] = [SIDE + 20.0, TITLE + 24.0];
    let good = map.iter().map(|t| t.limiting_mag_v).filter(|v| v.is_finite());
    let (low, high) = good.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    let known = low.is_finite();
    let (low, high) = if known { (low, high.max(low + 0.1)) } else { (0.0, 1.0) };
    let half = 0.5 * PIXELS as f64;
    let mut rgb = vec![255; 3 * PIXELS * PIXELS];
    for (k, pixel) in rgb.chunks_exact_mut(3).enumerate() {
        let (x, y) = ((k % PIXELS) as f64 + 0.5 - half, half - (k / PIXELS) as f64 - 0.5);
        let el_deg = 90.0 - 90.0 * x.hypot(y) / half;
        if el_deg >= LOWEST_DEG {
            // east is to the left
            let az_deg = (-x).atan2(y).rem_euclid(TAU).to_degrees();
            let value = between(map, az_deg, el_deg);
            pixel.copy_from_slice(&if value.is_finite() {
                colour((value - low) / (high - low))
            } else {
                [225, 225, 225]
            });
        }
    }
    page.raster([left, top], SQUARE, PIXELS, &rgb, "");
    let centre = [left + 0.5 * SQUARE, top + 0.5 * SQUARE];
    let radius = |el_deg: f64| 0.5 * SQUARE * (90.0 - el_deg) / 90.0;
    for el_deg in [0.0, 30.0, 60.0] {
        let stroke = if el_deg > 0.0 { "white\" stroke-opacity=\"0.6" } else { "#444" };
        page.add(format_args!(
            "<circle cx=\"{}\" cy=\"{}\" r=\"{}\" fill=\"none\" stroke=\"{stroke}\"/>",
            centre[0],
            centre[1],
            radius(el_deg)
        ));
    }
    let letters = [
        ("N", [centre[0], top - 6.0]),
        ("S", [centre[0], top + SQUARE + 18.0]),
        ("E", [left - 14.0, centre[1] + 5.0]),
        ("W", [left + SQUARE + 14.0, centre[1] + 5.0]),
    ];
    for (letter, place) in letters {
        page.text(place, 15.0, Anchor::Middle, letter);
    }
    let place = |az_deg: f64, el_deg: f64| {
        let (sin, cos) = az_deg.to_radians().sin_cos();
        [centre[0] - radius(el_deg) * sin, centre[1] - radius(el_deg) * cos]
    };
    let moon = &now.moon.body.horizontal;
    let moon = (moon.elevation > 0.0).then(|| [moon.azimuth.to_degrees(), moon.elevation.to_degrees()]);
    let aside = left + SQUARE + 60.0;
    let mut down = top + 20.0;
    let marks = [(moon, "the Moon", "none"), (target.filter(|at| at[1] > 0.0), "the target", "#d55e00")];
    for (at, name, fill) in marks {
        let Some([az_deg, el_deg]) = at else { continue };
        for [x, y] in [place(az_deg, el_deg), [aside + 8.0, down - 5.0]] {
            page.add(format_args!(
                "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"7\" fill=\"{fill}\" stroke=\"white\" stroke-width=\"4\"/>\
                 <circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"7\" fill=\"{fill}\" stroke=\"black\" stroke-width=\"1.5\"/>"
            ));
        }
        page.text([aside + 26.0, down], 15.0, Anchor::Start, name);
        down += 28.0;
    }
    for text in
        ["zenith in the middle", "circles: elevations of 30 and 60 deg", "grey: outside a model of the sky"]
    {
        page.text([aside, down], 15.0, Anchor::Start, text);
        down += 24.0;
    }
    down += 16.0;
    if !known {
        page.text([aside, down + 14.0], 15.0, Anchor::Start, "no limit is known anywhere");
        return page.finish();
    }
    page.text([aside, down], 15.0, Anchor::Start, "limiting magnitude, V");
    let (bar, tall) = ([aside, down + 14.0], 300.0);
    for k in 0..60 {
        let y = bar[1] + tall * (1.0 - f64::from(k + 1) / 60.0);
        page.rectangle(
            [bar[0], y],
            [26.0, tall / 60.0 + 0.5],
            &format!("fill=\"{}\"", hex(colour(f64::from(k) / 59.0))),
        );
    }
    for (value, label) in ticks(low, high, 6.0) {
        let y = bar[1] + tall * (1.0 - (value - low) / (high - low));
        page.line([bar[0] + 26.0, y], [bar[0] + 32.0, y], "stroke=\"#444\"");
        page.text([bar[0] + 38.0, y + 4.5], SMALL, Anchor::Start, &label);
    }
    page.finish()
}

/// What a curve of the night shows.
type Value = fn(&Moment) -> f64;

/// The night as SVG.
pub fn night_svg(title: &str, night: &[Moment]) -> String {
    let mut page = Page::new(560.0, title);
    let (left, broad, top, height) = (SIDE + 20.0, WIDTH - SIDE - 260.0, TITLE + 20.0, 400.0);
    let both = night.iter().flat_map(|m| [m.limiting_mag_v, m.zenith_mag_v]).filter(|v| v.is_finite());
    let (low, high) = both.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    let (low, high) = if low.is_finite() { (low - 0.3, high + 0.3) } else { (0.0, 1.0) };
    let dark = night.iter().filter(|m| m.sun_el_deg < 0.0).map(|m| m.hours);
    let (from, to) = dark.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    let (from, to) = if from < to { (from - 0.5, to + 0.5) } else { (0.0, 24.0) };
    let x = |hours: f64| left + broad * (hours - from) / (to - from);
    let y = |mag: f64| top + height * (high - mag) / (high - low);
    for pair in night.windows(2).filter(|pair| pair[0].hours >= from && pair[1].hours <= to) {
        let level = (200.0 + 50.0 * ((pair[0].sun_el_deg + 18.0) / 18.0).clamp(0.0, 1.0)) as u8;
        let shade = hex([level, level, level.saturating_add(20)]);
        page.rectangle(
            [x(pair[0].hours), top],
            [x(pair[1].hours) - x(pair[0].hours) + 0.5, height],
            &format!("fill=\"{shade}\""),
        );
    }
    for (value, label) in ticks(low, high, 8.0) {
        page.line([left, y(value)], [left + broad, y(value)], "stroke=\"white\"");
        page.text([left - 8.0, y(value) + 4.5], SMALL, Anchor::End, &label);
    }
    let mut last = f64::NEG_INFINITY;
    for moment in night.iter().filter(|m| m.hours >= from && m.hours <= to) {
        // steps of a quarter of an hour: every eighth has its time
        if moment.hours - last > 1.9 {
            last = moment.hours;
            let clock = moment.time_utc.get(11..16).unwrap_or("");
            page.line([x(moment.hours), top + height], [x(moment.hours), top + height + 5.0], "stroke=\"#444\"");
            page.text([x(moment.hours), top + height + 20.0], SMALL, Anchor::Middle, clock);
        }
    }
    page.text([left + 0.5 * broad, top + height + 46.0], 15.0, Anchor::Middle, "UTC");
    page.upward([SIDE - 34.0, top + 0.5 * height], 15.0, "limiting magnitude, V");
    let curves: [(&str, Value); 2] =
        [("towards the target", |m| m.limiting_mag_v), ("at the zenith", |m| m.zenith_mag_v)];
    for (k, ((name, value), colour)) in curves.into_iter().zip(COLOURS).enumerate() {
        let mut line = String::new();
        let mut pen = "M";
        for moment in night.iter().filter(|m| m.hours >= from && m.hours <= to) {
            let mag = value(moment);
            if mag.is_finite() {
                let _ = write!(line, "{pen}{:.1},{:.1} ", x(moment.hours), y(mag));
            }
            pen = if mag.is_finite() { "L" } else { "M" };
        }
        let colour = named(colour);
        page.add(format_args!("<path d=\"{line}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2.2\"/>"));
        let down = top + 16.0 + 24.0 * k as f64;
        page.line(
            [left + broad + 18.0, down - 5.0],
            [left + broad + 40.0, down - 5.0],
            &format!("stroke=\"{colour}\" stroke-width=\"3\""),
        );
        page.text([left + broad + 48.0, down], 15.0, Anchor::Start, name);
    }
    page.text([left + broad + 18.0, top + 72.0], SMALL, Anchor::Start, "darker: the Sun lower, to -18 deg");
    page.rectangle([left, top], [broad, height], "fill=\"none\" stroke=\"#444\"");
    page.finish()
}
