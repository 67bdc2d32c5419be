//! All-sky maps of every source and of their sum, as one SVG page.
//!
//! Zenith in the middle, north up, east to the left as one looks up; the radius is the zenith distance (equidistant). Colour
//! is the logarithm of electrons per pixel and second; white is unknown.

use super::sky::{Means, NAMES, SOURCES, Sky};
use crate::plan::view::Circumstances;
use base64::Engine;
use image::{ImageFormat, Rgba, RgbaImage};
use std::f64::consts::{FRAC_PI_2, TAU};
use std::fmt::Write;

/// Pixels across a map, and its size on the page.
const PIXELS: usize = 180;
const SIDE: f64 = 250.0;
/// Room about a map on the page.
const CELL: [f64; 2] = [300.0, 350.0];

/// Colours from dark to bright: viridis (Smith & van der Walt 2015), nine anchors.
const COLOURS: [[f64; 3]; 9] = [
    [68.0, 1.0, 84.0],
    [71.0, 44.0, 122.0],
    [59.0, 81.0, 139.0],
    [44.0, 113.0, 142.0],
    [33.0, 144.0, 141.0],
    [39.0, 173.0, 129.0],
    [92.0, 200.0, 99.0],
    [170.0, 220.0, 50.0],
    [253.0, 231.0, 37.0],
];

/// The maps of an instant, and the words of their heading.
pub fn svg(sky: &Sky, now: &Circumstances, heading: &str) -> String {
    let places = (0..PIXELS * PIXELS).filter_map(|k| Some((k, place(k)?))).collect::<Vec<_>>();
    let directions = places.iter().map(|(_, d)| *d).collect::<Vec<_>>();
    let means = sky.map(now, &directions);
    let mut page = String::new();
    let (width, height) = (4.0 * CELL[0], 2.0 * CELL[1] + 40.0);
    let _ = write!(
        page,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" \
         font-family=\"sans-serif\" font-size=\"13\"><rect width=\"100%\" height=\"100%\" fill=\"white\"/>\
         <text x=\"24\" y=\"26\" font-size=\"17\">{}</text>",
        escaped(heading)
    );
    for panel in 0..=SOURCES {
        // where a source is unknown, so is the sum
        let value = |m: &Means| if panel == 0 { m.iter().sum() } else { m[panel - 1] };
        let name = if panel == 0 { "all sources" } else { NAMES[panel - 1] };
        let values = places.iter().zip(&means).map(|((k, _), m)| (*k, value(m))).collect::<Vec<_>>();
        let corner = [(panel % 4) as f64 * CELL[0] + 25.0, (panel / 4) as f64 * CELL[1] + 66.0];
        draw(&mut page, name, corner, &values, now);
    }
    let _ = write!(
        page,
        "<g transform=\"translate({},{})\" fill=\"#333\"><text y=\"-22\">zenith in the middle, north up,</text>\
         <text>east to the left</text><text y=\"22\">circles: 30 and 60 deg from the zenith</text><text y=\"44\">ring: the Moon</text>\
         <text y=\"66\">white: outside a model</text><text y=\"88\">colours by the logarithm</text></g>",
        3.0 * CELL[0] + 10.0,
        CELL[1] + 150.0
    );
    page.push_str("</svg>\n");
    page
}

/// Azimuth and zenith distance \[rad\] of a pixel of a map, inside the horizon.
fn place(k: usize) -> Option<(f64, f64)> {
    let half = 0.5 * PIXELS as f64;
    let (x, y) = ((k % PIXELS) as f64 + 0.5 - half, half - (k / PIXELS) as f64 - 0.5);
    let zenith_distance = x.hypot(y) / half * FRAC_PI_2;
    // east is to the left
    ((zenith_distance) < FRAC_PI_2 - 1e-3).then(|| ((-x).atan2(y).rem_euclid(TAU), zenith_distance))
}

/// Where a direction lies on a map whose corner is at the origin.
fn on_map(azimuth: f64, zenith_distance: f64) -> [f64; 2] {
    let r = 0.5 * SIDE * zenith_distance / FRAC_PI_2;
    [0.5 * SIDE - r * azimuth.sin(), 0.5 * SIDE - r * azimuth.cos()]
}

fn draw(page: &mut String, name: &str, [x, y]: [f64; 2], values: &[(usize, f64)], now: &Circumstances) {
    let _ =
        write!(page, "<g transform=\"translate({x},{y})\"><text x=\"0\" y=\"-8\" font-size=\"15\">{name}</text>");
    let mut lit = values.iter().map(|(_, v)| *v).filter(|v| *v > 0.0).collect::<Vec<_>>();
    lit.sort_by(f64::total_cmp);
    let half = 0.5 * SIDE;
    // the few brightest pixels, beside the Moon, would leave no colours for the rest
    let brightest = lit.len().saturating_sub(1 + lit.len() / 200);
    let [Some(low), Some(high)] = [lit.first(), lit.get(brightest)] else {
        let words = if values.iter().all(|(_, v)| v.is_nan()) { "outside its model" } else { "none" };
        let _ = write!(
            page,
            "<circle cx=\"{half}\" cy=\"{half}\" r=\"{half}\" fill=\"#eee\"/>\
             <text x=\"{half}\" y=\"{half}\" text-anchor=\"middle\" fill=\"#555\">{words}</text></g>"
        );
        return;
    };
    let most = lit.last().copied().unwrap_or(*high);
    let high = if most < 2.0 * high { most } else { *high };
    // a range of at least a few per cent, of four decades at most
    let (low, high) = (low.max(high * 1e-4), high.max(low * 1.05));
    let share = |v: f64| (v.max(low) / low).ln() / (high / low).ln();
    let mut raster = RgbaImage::new(PIXELS as u32, PIXELS as u32);
    for (k, value) in values {
        if value.is_finite() {
            raster.put_pixel((k % PIXELS) as u32, (k / PIXELS) as u32, colour(share(*value)));
        }
    }
    let mut png = std::io::Cursor::new(Vec::new());
    // writing to memory fails only for sizes that no image of ours has
    let written = raster.write_to(&mut png, ImageFormat::Png);
    debug_assert!(written.is_ok());
    let data = base64::engine::general_purpose::STANDARD.encode(png.into_inner());
    let _ = write!(
        page,
        "<image width=\"{SIDE}\" height=\"{SIDE}\" preserveAspectRatio=\"none\" href=\"data:image/png;base64,{data}\"/>\
         <circle cx=\"{half}\" cy=\"{half}\" r=\"{half}\" fill=\"none\" stroke=\"black\"/>"
    );
    for zenith_distance in [30, 60] {
        let r = half * f64::from(zenith_distance) / 90.0;
        let _ = write!(
            page,
            "<circle cx=\"{half}\" cy=\"{half}\" r=\"{r}\" fill=\"none\" stroke=\"white\" stroke-opacity=\"0.4\"/>"
        );
    }
    for (letter, left, top) in
        [("N", half, -3.0), ("S", half, SIDE + 14.0), ("E", -9.0, half + 4.0), ("W", SIDE + 9.0, half + 4.0)]
    {
        let _ =
            write!(page, "<text x=\"{left}\" y=\"{top}\" text-anchor=\"middle\" fill=\"#555\">{letter}</text>");
    }
    let moon = &now.moon.body.horizontal;
    if moon.elevation > 0.0 {
        let [mx, my] = on_map(moon.azimuth, FRAC_PI_2 - moon.elevation);
        let _ = write!(
            page,
            "<circle cx=\"{mx:.1}\" cy=\"{my:.1}\" r=\"5\" fill=\"none\" stroke=\"white\" stroke-width=\"1.5\"/>"
        );
    }
    let top = SIDE + 24.0;
    for k in 0..50 {
        let Rgba([r, g, b, _]) = colour(f64::from(k) / 49.0);
        let left = f64::from(k) * SIDE / 50.0;
        let _ = write!(
            page,
            "<rect x=\"{left}\" y=\"{top}\" width=\"{}\" height=\"9\" fill=\"rgb({r},{g},{b})\"/>",
            SIDE / 50.0 + 0.5
        );
    }
    let bottom = top + 23.0;
    let _ = write!(
        page,
        "<text x=\"0\" y=\"{bottom}\">{}</text><text x=\"{SIDE}\" y=\"{bottom}\" text-anchor=\"end\">{}{} e-/px/s</text></g>",
        figure(low),
        if most > high { "&gt; " } else { "" },
        figure(high)
    );
}

/// Three figures, as people write them.
fn figure(value: f64) -> String {
    if (0.01..1000.0).contains(&value) {
        let decimals = (2 - value.log10().floor() as i32).clamp(0, 4) as usize;
        format!("{value:.decimals$}")
    } else {
        format!("{value:.2e}")
    }
}

fn colour(share: f64) -> Rgba<u8> {
    let at = share.clamp(0.0, 1.0) * (COLOURS.len() - 1) as f64;
    let i = (at as usize).min(COLOURS.len() - 2);
    let f = at - i as f64;
    let [r, g, b] = [0, 1, 2].map(|c| (COLOURS[i][c] * (1.0 - f) + COLOURS[i + 1][c] * f).round() as u8);
    Rgba([r, g, b, 255])
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn north_is_up_and_east_to_the_left() {
        let middle = PIXELS / 2;
        let (north, _) = place(10 * PIXELS + middle).expect("inside");
        assert!(north.sin().abs() < 0.02 && north.cos() > 0.0);
        let (east, _) = place(middle * PIXELS + 10).expect("inside");
        assert!((east - FRAC_PI_2).abs() < 0.02);
        assert!(place(0).is_none());
        let [x, _] = on_map(FRAC_PI_2, 0.5);
        assert!(x < 0.5 * SIDE);
    }

    #[test]
    fn figures_are_short() {
        assert_eq!([0.0123, 1.0, 12.34, 999.0].map(figure), ["0.0123", "1.00", "12.3", "999"]);
        assert_eq!(figure(1.0e-5), "1.00e-5");
    }
}
