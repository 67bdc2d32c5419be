//! Finder pictures: what was measured in a frame, where, and which stars stand beside it.
//!
//! The surroundings of the target enlarged, first row at the bottom as stored; the place measured is ringed at the aperture's radius,
//! or where its image is fitted at 1.5 FWHM; the catalogue's stars are outlined along their trails. Arrows point north and east,
//! and the bar says its length in seconds of arc.

use super::palette::COLOURS;
use crate::astro::direction;
use crate::base::units::ARCSEC;
use crate::io::preview::{rgb_png, shades};
use crate::photometry::segment::Segment;
use crate::photometry::{FieldStar, Frame, Measurement};
use glam::DVec2;
use std::io;

/// Side of the picture \[its own pixels\].
const SIDE: usize = 720;
/// Side of what it shows \[px of the frame\].
const SHOWN: [f64; 2] = [90.0, 720.0];
/// Width of a line \[pixels of the picture\].
const LINE: f64 = 1.6;
/// Stars outlined, the brightest.
const MOST_STARS: usize = 300;
/// Lengths of the bar \[arcsec\].
const BARS: [u32; 10] = [1, 2, 5, 10, 20, 30, 60, 120, 300, 600];

/// Strokes of a sign within a box 1 wide and 2 high, from its lower left: seven-segment digits and the letters.
fn strokes(sign: char) -> Vec<[[f64; 2]; 2]> {
    let [a, b, c, d, e, f, g] = [
        [[0.0, 2.0], [1.0, 2.0]],
        [[1.0, 2.0], [1.0, 1.0]],
        [[1.0, 1.0], [1.0, 0.0]],
        [[0.0, 0.0], [1.0, 0.0]],
        [[0.0, 0.0], [0.0, 1.0]],
        [[0.0, 1.0], [0.0, 2.0]],
        [[0.0, 1.0], [1.0, 1.0]],
    ];
    match sign {
        '0' => vec![a, b, c, d, e, f],
        '1' => vec![b, c],
        '2' => vec![a, b, g, e, d],
        '3' => vec![a, b, g, c, d],
        '5' => vec![a, f, g, c, d],
        '6' => vec![a, f, g, e, c, d],
        'N' => vec![e, f, [[0.0, 2.0], [1.0, 0.0]], b, c],
        'E' => vec![a, f, g, e, d],
        '"' => vec![[[0.2, 2.0], [0.2, 1.5]], [[0.7, 2.0], [0.7, 1.5]]],
        _ => vec![],
    }
}

/// A picture that is drawn on, origin at the lower left.
struct Canvas {
    rgb: Vec<u8>,
}

impl Canvas {
    /// Covers pixels by the share that `distance` from a line tells, within a box.
    fn stroke(&mut self, low: DVec2, high: DVec2, colour: [u8; 3], distance: impl Fn(DVec2) -> f64) {
        let last = SIDE as f64 - 1.0;
        let (low, high) = ((low - 3.0).clamp(DVec2::ZERO, DVec2::splat(last)), high + 3.0);
        let high = high.clamp(DVec2::ZERO, DVec2::splat(last));
        if !(low.is_finite() && high.is_finite()) {
            return;
        }
        for y in low.y as usize..=high.y as usize {
            for x in low.x as usize..=high.x as usize {
                let cover = (0.5 * LINE + 0.5 - distance(DVec2::new(x as f64, y as f64)).abs()).clamp(0.0, 1.0);
                if cover > 0.0 {
                    let at = 3 * ((SIDE - 1 - y) * SIDE + x);
                    for (byte, c) in self.rgb[at..at + 3].iter_mut().zip(colour) {
                        *byte = (f64::from(*byte) * (1.0 - cover) + f64::from(c) * cover).round() as u8;
                    }
                }
            }
        }
    }

    fn line(&mut self, from: DVec2, to: DVec2, colour: [u8; 3]) {
        let segment = Segment::between(from, to);
        self.stroke(from.min(to), from.max(to), colour, |p| segment.distance(p));
    }

    /// The outline at `radius` about a segment.
    fn pill(&mut self, segment: &Segment, radius: f64, colour: [u8; 3]) {
        let reach = segment.half.abs() + radius;
        self.stroke(segment.centre - reach, segment.centre + reach, colour, |p| segment.distance(p) - radius);
    }

    fn text(&mut self, at: DVec2, text: &str, colour: [u8; 3]) {
        const SIZE: f64 = 9.0;
        for (i, sign) in text.chars().enumerate() {
            let corner = at + DVec2::new(i as f64 * 1.6 * SIZE, 0.0);
            for [from, to] in strokes(sign) {
                self.line(corner + DVec2::from(from) * SIZE, corner + DVec2::from(to) * SIZE, colour);
            }
        }
    }
}

fn colour(index: usize) -> [u8; 3] {
    let c = COLOURS[index % COLOURS.len()];
    [c.0, c.1, c.2]
}

/// The finder picture of a measurement, as the bytes of a PNG file.
///
/// # Errors
/// Whatever the encoder says.
pub fn png(frame: &Frame, stars: &[FieldStar], row: &Measurement) -> io::Result<Vec<u8>> {
    let fwhm = if row.fwhm_px.is_finite() { row.fwhm_px } else { frame.expected_fwhm_px() };
    let trail = if row.trail_px.is_finite() { row.trail_px } else { DVec2::ZERO };
    let middle = (DVec2::new(frame.width as f64, frame.height as f64) - 1.0) / 2.0;
    let place = DVec2::new(row.x_px, row.y_px);
    let centre = if place.is_finite() { place } else { middle };
    let shown = (3.0 * trail.length() + 50.0 * fwhm).clamp(SHOWN[0], SHOWN[1]);
    let zoom = SIDE as f64 / shown;
    let on_picture = |pixel: DVec2| (pixel - centre + 0.5 * shown) * zoom;
    let value = |x: usize, y: usize| {
        let pixel = (DVec2::new(x as f64, y as f64) + 0.5) / zoom - 0.5 * shown + centre;
        let pixel = pixel.round();
        frame.pixel(pixel.x as i64, pixel.y as i64) as f32
    };
    let values = (0..SIDE).rev().flat_map(|y| (0..SIDE).map(move |x| value(x, y))).collect::<Vec<_>>();
    let mut canvas = Canvas { rgb: shades(&values).into_iter().flat_map(|v| [v; 3]).collect() };
    let scaled = |s: Segment| Segment { centre: on_picture(s.centre), half: s.half * zoom };
    let mut drawn = stars.iter().filter_map(|s| Some((s.mag_v, frame.star_segment(s.direction)?)));
    let mut drawn = drawn.by_ref().filter(|(_, s)| s.gap(&Segment::point(centre)) < shown).collect::<Vec<_>>();
    drawn.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (_, segment) in drawn.into_iter().take(MOST_STARS) {
        canvas.pill(&scaled(segment), 2.0 * fwhm * zoom, colour(5));
    }
    if place.is_finite() {
        let target = scaled(Segment { centre: place, half: 0.5 * trail });
        let radius = if row.aperture_px.is_finite() { row.aperture_px } else { 1.5 * fwhm };
        canvas.pill(&target, radius * zoom, colour(4));
    }
    arrows(&mut canvas, frame, centre);
    bar(&mut canvas, frame.wcs.pixel_scale() / ARCSEC, zoom);
    rgb_png(SIDE, SIDE, &canvas.rgb)
}

/// Arrows to north and east in a corner.
fn arrows(canvas: &mut Canvas, frame: &Frame, centre: DVec2) {
    const LENGTH: f64 = 42.0;
    let from = DVec2::new(SIDE as f64 - 75.0, 75.0);
    let (ra, dec) = crate::astro::angles(frame.wcs.sky(centre));
    let step = 10.0 * frame.wcs.pixel_scale();
    let north = direction(ra, dec + step);
    let east = direction(ra + step / dec.cos().abs().max(1e-6), dec);
    for (sign, towards) in [("N", north), ("E", east)] {
        let along = frame.wcs.pixel(towards).map(|p| (p - centre).normalize_or_zero()).unwrap_or_default();
        let tip = from + along * LENGTH;
        canvas.line(from, tip, colour(1));
        for turn in [2.6, -2.6] {
            canvas.line(tip, tip + DVec2::from_angle(turn).rotate(along) * 9.0, colour(1));
        }
        canvas.text(from + along * (LENGTH + 16.0) - DVec2::new(4.5, 9.0), sign, colour(1));
    }
}

/// A bar of a round number of seconds of arc, about a fifth of the picture.
fn bar(canvas: &mut Canvas, arcsec_px: f64, zoom: f64) {
    let length = |arcsec: u32| f64::from(arcsec) / arcsec_px * zoom;
    let Some(arcsec) = BARS.into_iter().rev().find(|b| length(*b) < 0.3 * SIDE as f64) else { return };
    let from = DVec2::new(24.0, 24.0);
    let to = from + DVec2::new(length(arcsec), 0.0);
    canvas.line(from, to, colour(1));
    for end in [from, to] {
        canvas.line(end - DVec2::Y * 5.0, end + DVec2::Y * 5.0, colour(1));
    }
    canvas.text(from + DVec2::new(0.0, 12.0), &format!("{arcsec}\""), colour(1));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::photometry::synthetic::{self, Camera, Source};

    #[test]
    fn a_picture_shows_the_target_in_a_ring() {
        let target = Segment { centre: DVec2::new(80.0, 75.0), half: DVec2::new(6.0, 2.0) };
        let frame = synthetic::expose(&Camera::default(), 160, 150, 3, &[Source { segment: target, flux_e: 3e4 }]);
        let mut row = Measurement::blank(frame.time);
        (row.x_px, row.y_px, row.fwhm_px) = (80.0, 75.0, 3.1);
        row.trail_px = target.half * 2.0;
        let bytes = png(&frame, &[], &row).expect("a picture");
        let picture = image::load_from_memory(&bytes).expect("PNG").to_rgb8();
        assert_eq!(picture.dimensions(), (SIDE as u32, SIDE as u32));
        let orange = |p: &image::Rgb<u8>| p.0[0] > 200 && p.0[2] < 60;
        let ring = picture.pixels().filter(|p| orange(p)).count();
        assert!((80..20_000).contains(&ring), "{ring}");
        let middle = picture.get_pixel(SIDE as u32 / 2, SIDE as u32 / 2).0;
        assert!(middle[0] > 150 && middle[0] == middle[2], "{middle:?}");
    }

    #[test]
    fn nothing_measured_is_still_a_picture() {
        let frame = synthetic::blank(8, 8, f32::NAN);
        for trail_px in [DVec2::ZERO, DVec2::NAN, DVec2::splat(1e300)] {
            let row = Measurement { trail_px, ..Measurement::blank(frame.time) };
            assert!(png(&frame, &[], &row).is_ok());
        }
    }
}
