//! The map of chi-square over the poles of rotation: the whole sphere in Hammer's equal-area projection (Snyder 1987, USGS Prof. Paper
//! 1395, p. 182), right ascension to the left, and the rotations that the light allows.

use super::page::{Anchor, Page, SIDE, SMALL, TITLE, WIDTH, named, number};
use super::palette::COLOURS;
use crate::inversion::sphere::spacing;
use glam::DVec3;
use std::f64::consts::SQRT_2;

/// Half the width of the map; its height is the same \[px\].
const HALF: f64 = 440.0;
/// Middle of the map \[px\].
const MIDDLE: [f64; 2] = [0.5 * WIDTH, TITLE + 40.0 + 0.5 * HALF];
/// Pixels along the map.
const PIXELS: usize = 600;
/// Colours from the least chi-square to the greatest.
const RAMP: [[f64; 3]; 4] = [[8.0, 29.0, 88.0], [34.0, 94.0, 168.0], [127.0, 205.0, 187.0], [255.0, 255.0, 217.0]];
/// Most minima that are marked.
const MOST: usize = 40;

/// A direction on the map, in units of half its width, upwards positive.
fn place(v: DVec3) -> [f64; 2] {
    let (ra, dec) = (v.y.atan2(v.x), v.z.clamp(-1.0, 1.0).asin());
    let stretch = SQRT_2 / (1.0 + dec.cos() * (0.5 * ra).cos()).sqrt();
    [-stretch * dec.cos() * (0.5 * ra).sin() / SQRT_2, stretch * dec.sin() / (2.0 * SQRT_2)]
}

/// The direction at a place of the map; none outside.
fn direction([x, y]: [f64; 2]) -> Option<DVec3> {
    let (x, y) = (-x * 2.0 * SQRT_2, y * 2.0 * SQRT_2);
    let square = 1.0 - (0.25 * x).powi(2) - (0.5 * y).powi(2);
    let z = square.max(0.0).sqrt();
    let ra = 2.0 * (z * x).atan2(2.0 * (2.0 * square - 1.0));
    let dec = (z * y).clamp(-1.0, 1.0).asin();
    (square >= 0.5).then(|| DVec3::new(dec.cos() * ra.cos(), dec.cos() * ra.sin(), dec.sin()))
}

fn on_page([x, y]: [f64; 2]) -> [f64; 2] {
    [MIDDLE[0] + HALF * x, MIDDLE[1] - HALF * y]
}

/// The picture as SVG: poles of a grid with their least chi-square, and minima with their criterion, the best first.
pub fn poles(map: &[(DVec3, f64)], minima: &[(DVec3, f64)], title: &str) -> String {
    let named_after = if title.is_empty() { String::new() } else { format!(" of {title}") };
    let mut page = Page::new(TITLE + HALF + 250.0, &format!("Poles of rotation{named_after}"));
    let sound = map.iter().filter(|(v, chi2)| v.is_finite() && *chi2 > 0.0 && chi2.is_finite());
    let cells = sound.map(|(v, chi2)| (*v, libm::log10(*chi2))).collect::<Vec<_>>();
    let low = cells.iter().map(|c| c.1).fold(f64::INFINITY, f64::min);
    let high = cells.iter().map(|c| c.1).fold(f64::NEG_INFINITY, f64::max);
    if cells.is_empty() {
        page.text([SIDE, TITLE + 20.0], 16.0, Anchor::Start, "no pole with a finite chi-square");
        return page.finish();
    }
    // the square of the raster reaches beyond the map, over the title
    let [x, y] = MIDDLE;
    page.add(format_args!(
        "<clipPath id=\"map\"><ellipse cx=\"{x}\" cy=\"{y}\" rx=\"{HALF}\" ry=\"{}\"/></clipPath><g clip-path=\"url(#map)\">",
        0.5 * HALF
    ));
    page.raster([x - HALF, y - HALF], 2.0 * HALF, PIXELS, &raster(&cells, low, high), "");
    page.add(format_args!("</g>"));
    graticule(&mut page);
    for (k, (pole, _)) in minima.iter().enumerate().take(MOST) {
        let [x, y] = on_page(place(*pole));
        let colour = named(COLOURS[0]);
        page.add(format_args!(
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"7\" fill=\"none\" stroke=\"#fff\" stroke-width=\"4\"/>\
             <circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"7\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"/>"
        ));
        page.add(format_args!(
            "<g stroke=\"#fff\" stroke-width=\"3\" paint-order=\"stroke\" font-weight=\"bold\">"
        ));
        page.text([x + 11.0, y + 5.0], 14.0, Anchor::Start, &(k + 1).to_string());
        page.add(format_args!("</g>"));
    }
    legend(&mut page, low, high, minima, spacing(cells.len()).to_degrees());
    page.finish()
}

/// Every pixel as the nearest pole.
fn raster(cells: &[(DVec3, f64)], low: f64, high: f64) -> Vec<u8> {
    let half = 0.5 * PIXELS as f64;
    let colour = |k: usize| {
        let (column, row) = ((k % PIXELS) as f64 + 0.5, (k / PIXELS) as f64 + 0.5);
        let Some(v) = direction([column / half - 1.0, 1.0 - row / half]) else { return [255; 3] };
        let nearest = cells.iter().max_by(|a, b| a.0.dot(v).total_cmp(&b.0.dot(v)));
        nearest.map_or([255; 3], |cell| ramp(if high > low { (cell.1 - low) / (high - low) } else { 0.0 }))
    };
    (0..PIXELS * PIXELS).flat_map(colour).collect()
}

/// The colour of a share from 0 to 1.
fn ramp(share: f64) -> [u8; 3] {
    let at = share.clamp(0.0, 1.0) * (RAMP.len() - 1) as f64;
    let first = (at.floor() as usize).min(RAMP.len() - 2);
    let part = at - first as f64;
    std::array::from_fn(|k| (RAMP[first][k] + part * (RAMP[first + 1][k] - RAMP[first][k])).round() as u8)
}

fn graticule(page: &mut Page) {
    let unit = |ra: f64, dec: f64| {
        let (ra, dec) = (ra.to_radians(), dec.to_radians());
        DVec3::new(dec.cos() * ra.cos(), dec.cos() * ra.sin(), dec.sin())
    };
    let mut curve = |points: &mut dyn Iterator<Item = DVec3>, style: &str| {
        let path = points.enumerate().map(|(k, v)| {
            let [x, y] = on_page(place(v));
            format!("{}{x:.1} {y:.1}", if k == 0 { 'M' } else { 'L' })
        });
        page.add(format_args!("<path d=\"{}\" fill=\"none\" {style}/>", path.collect::<String>()));
    };
    let thin = "stroke=\"#fff\" stroke-opacity=\"0.45\" stroke-width=\"0.8\"";
    for dec in [-60.0, -30.0, 0.0, 30.0, 60.0] {
        curve(&mut (0..=90).map(|k| unit(-179.999 + 3.999_97 * f64::from(k), dec)), thin);
    }
    for ra in [-120.0, -60.0, 0.0, 60.0, 120.0] {
        curve(&mut (0..=60).map(|k| unit(ra, -90.0 + 3.0 * f64::from(k))), thin);
    }
    for ra in [-179.999, 179.999] {
        curve(&mut (0..=60).map(|k| unit(ra, -90.0 + 3.0 * f64::from(k))), "stroke=\"#444\"");
    }
    for dec in [-60.0, -30.0, 0.0, 30.0, 60.0] {
        let [x, y] = on_page(place(unit(179.999, dec)));
        page.text([x - 8.0, y + 4.0], 12.0, Anchor::End, &format!("{dec:+}"));
    }
    page.add(format_args!("<g stroke=\"#fff\" stroke-width=\"2.5\" paint-order=\"stroke\">"));
    for ra in [0.0, 60.0, 120.0, 240.0, 300.0] {
        let [x, y] = on_page(place(unit(ra, 0.0)));
        page.text([x + 4.0, y - 4.0], 12.0, Anchor::Start, &format!("{ra}"));
    }
    page.add(format_args!("</g>"));
}

fn legend(page: &mut Page, low: f64, high: f64, minima: &[(DVec3, f64)], spacing_deg: f64) {
    let (left, top, length) = (SIDE + 90.0, MIDDLE[1] + 0.5 * HALF + 40.0, 360.0);
    for k in 0..60 {
        let [r, g, b] = ramp((f64::from(k) + 0.5) / 60.0);
        let x = left + length * f64::from(k) / 60.0;
        page.rectangle([x, top], [length / 60.0 + 0.5, 14.0], &format!("fill=\"rgb({r},{g},{b})\""));
    }
    page.text([left - 8.0, top + 12.0], SMALL, Anchor::End, "chi-square");
    for share in [0.0, 0.5, 1.0] {
        let value = libm::pow(10.0, low + share * (high - low));
        let rounded = format!("{value:.2e}").parse().unwrap_or(value);
        page.text([left + share * length, top + 31.0], SMALL, Anchor::Middle, &number(rounded));
    }
    let best = minima.first().map_or(f64::NAN, |m| m.1);
    for (k, (pole, criterion)) in minima.iter().enumerate().take(9) {
        let ra = pole.y.atan2(pole.x).to_degrees().rem_euclid(360.0);
        let dec = pole.z.clamp(-1.0, 1.0).asin().to_degrees();
        let words = format!("{}: RA {ra:.1}, Dec {dec:+.1} deg, criterion +{:.1}", k + 1, criterion - best);
        let (column, row) = ((k / 3) as f64, (k % 3) as f64);
        page.text([SIDE + 360.0 * column, top + 68.0 + 20.0 * row], SMALL, Anchor::Start, &words);
    }
    let words = format!(
        "Circles: minima refined with the sparse solver{}; criterion: chi-square and what the facets cost, above the best.",
        if minima.len() > 9 { ", the best nine told" } else { "" }
    );
    let map = format!(
        "Map: least chi-square over the periods, of non-negative facets, on poles {spacing_deg:.1} deg apart; right ascension and declination, ICRS."
    );
    page.text([SIDE, top + 132.0], SMALL, Anchor::Start, &map);
    page.text([SIDE, top + 152.0], SMALL, Anchor::Start, &words);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inversion::sphere::fibonacci;

    #[test]
    fn places_and_directions_are_each_others_inverse() {
        for v in fibonacci(500) {
            let back = direction(place(v)).expect("on the map");
            // near the rim right ascensions of 180 deg meet
            assert!((back - v).length() < 1e-6, "{v} {back}");
        }
        assert!(direction([0.9, 0.45]).is_none() && place(DVec3::X) == [0.0, 0.0]);
        // right ascension grows to the left, the pole is at the top
        assert!(place(DVec3::Y)[0] < 0.0 && (place(DVec3::Z)[1] - 0.5).abs() < 1e-12);
    }

    #[test]
    fn the_least_pole_is_dark_and_minima_are_numbered() {
        let map = fibonacci(200).map(|v| (v, 10.0 + 90.0 * (1.0 - v.x))).collect::<Vec<_>>();
        let cells = map.iter().map(|(v, c)| (*v, c.log10())).collect::<Vec<_>>();
        let rgb = raster(&cells, 1.0, 190f64.log10());
        let pixel = |row: usize, column: usize| rgb[3 * (row * PIXELS + column)];
        assert!(pixel(PIXELS / 2, PIXELS / 2) < 20 && pixel(PIXELS / 2, 10) > 230 && pixel(5, 5) == 255);
        let svg = poles(&map, &[(DVec3::X, 10.0), (DVec3::Z, 14.0)], "a & b");
        assert!(svg.contains("a &amp; b") && svg.contains("2: RA 0.0, Dec +90.0 deg, criterion +4.0"));
        assert!(poles(&[(DVec3::X, f64::NAN)], &[], "none").contains("no pole"));
    }
}
