//! Light in rings about a source: circles about a point, pills about a trail, and what a profile predicts for it.
//!
//! A pixel is shared between rings by area. The light of a trail, which takes all places within a pixel, follows
//! from the radius alone; that of a point is summed over the very pixels it fell on.

use super::aperture;
use super::frame::Frame;
use super::profile::{Grid, share};
use super::segment::Segment;
use glam::DVec2;

/// Share of a ring's light that a perfect profile may still miss: flat field, centring.
const MODEL_FLOOR: f64 = 0.003;
/// Sources shorter than this are points, whose light in each pixel depends on their place in it \[px\].
pub const POINT_PX: f64 = 0.5;

/// Sums of light in rings about a source.
#[derive(Debug, Clone)]
pub struct Rings {
    /// Sums \[e\], background included.
    pub sum_e: Vec<f64>,
    /// Areas \[px\].
    pub area_px: Vec<f64>,
    /// Variance of a background pixel \[e^2\].
    pub sky_variance: f64,
    /// Length of the source \[px\].
    pub length: f64,
    /// Middle of the source \[px\].
    pub centre: DVec2,
}

/// Edges of the rings for images of about `fwhm` \[px\].
pub fn ring_edges(fwhm: f64) -> Vec<f64> {
    let mut edges = vec![0.0];
    let mut edge = 0.0;
    while edge < (8.0 * fwhm).max(12.0) {
        edge += (0.25 * fwhm).max(0.7).max(0.15 * edge);
        edges.push(edge);
    }
    edges
}

impl Rings {
    /// The rings about `segment`, pixels shared between them by area. Pixels for which `masked` holds and
    /// pixels that are no number are left out with their area.
    pub fn gather(
        frame: &Frame,
        segment: &Segment,
        edges: &[f64],
        sky_variance: f64,
        masked: impl Fn(DVec2) -> bool,
    ) -> Self {
        let n = edges.len() - 1;
        let (mut sum_e, mut area_px) = (vec![0.0; n], vec![0.0; n]);
        let reach = edges[n];
        let (bias, gain) = (frame.bias_adu.unwrap_or(0.0), frame.gain_at(segment.centre));
        segment.for_pixels(frame, reach + 0.708, |place, distance, value| {
            if !value.is_finite() || masked(place) {
                return;
            }
            let value_e = (value - bias) * gain;
            share_out(segment, place, distance, edges, |ring, part| {
                sum_e[ring] += part * value_e;
                area_px[ring] += part;
            });
        });
        Self { sum_e, area_px, sky_variance, length: segment.length(), centre: segment.centre }
    }

    /// Weights of the rings, 1 / variance, around a source of `flux` \[e\] with `shares` of light.
    pub fn weights(&self, flux: f64, shares: &[f64]) -> Vec<f64> {
        let light = shares.iter().map(|s| (flux * s).max(0.0));
        let variance = self.area_px.iter().zip(light);
        variance
            .map(|(area, l)| {
                let v = area * self.sky_variance + l + (MODEL_FLOOR * l).powi(2);
                if *area > 0.0 && v > 0.0 { 1.0 / v } else { 0.0 }
            })
            .collect()
    }

    /// Flux and background of the source, for given shares and weights; zero if they are not determined.
    pub fn solve(&self, shares: &[f64], full_area: &[f64], weights: &[f64]) -> [f64; 2] {
        let [mut ss, mut sa, mut aa, mut sy, mut ay] = [0.0; 5];
        for (s, a, y, w) in self.rows(shares, full_area, weights) {
            ss += w * s * s;
            sa += w * s * a;
            aa += w * a * a;
            sy += w * s * y;
            ay += w * a * y;
        }
        let det = ss * aa - sa * sa;
        if det.is_nan() || det <= 1e-12 * ss * aa {
            return [0.0; 2];
        }
        [(sy * aa - ay * sa) / det, (ay * ss - sy * sa) / det]
    }

    /// Chi-square of each ring at the best flux and background; zero if they are not determined.
    pub fn misfits<'a>(
        &'a self,
        shares: &'a [f64],
        full_area: &'a [f64],
        weights: &'a [f64],
    ) -> impl Iterator<Item = f64> + 'a {
        let [flux, background] = self.solve(shares, full_area, weights);
        let determined = flux != 0.0 || background != 0.0;
        let misfit = move |(s, a, y, w): (f64, f64, f64, f64)| w * (y - flux * s - background * a).powi(2);
        self.rows(shares, full_area, weights).map(move |row| if determined { misfit(row) } else { 0.0 })
    }

    /// Share, area, light and weight of each ring; a masked ring holds its light in proportion.
    fn rows<'a>(
        &'a self,
        shares: &'a [f64],
        full_area: &'a [f64],
        weights: &'a [f64],
    ) -> impl Iterator<Item = (f64, f64, f64, f64)> + 'a {
        let rings = shares.iter().zip(full_area).zip(&self.area_px).zip(&self.sum_e).zip(weights);
        rings.map(|((((s, full), a), y), w)| (if *full > 0.0 { s * a / full } else { 0.0 }, *a, *y, *w))
    }
}

/// A length class of the sources: weights and areas of each ring.
pub struct Geometry {
    /// The part of each ring's weights that is not zero, and where it starts on the profile's grid.
    rings: Vec<(usize, Vec<f64>)>,
    /// Area of each ring \[px\].
    pub area: Vec<f64>,
}

/// Weights without the zeros before and after.
fn trimmed(weights: &[f64]) -> (usize, Vec<f64>) {
    let start = weights.iter().position(|w| *w != 0.0).unwrap_or(0);
    let end = weights.iter().rposition(|w| *w != 0.0).map_or(start, |i| i + 1);
    (start, weights[start..end].to_vec())
}

impl Geometry {
    /// The geometry of a source and of all like it.
    pub fn new(grid: &Grid, edges: &[f64], source: &Rings) -> Self {
        if source.length < POINT_PX {
            return Self::of_point(grid, edges, source.centre);
        }
        let length = source.length;
        let cumulative = edges.iter().map(|r| grid.share_weights(*r, length)).collect::<Vec<_>>();
        let area = |r: f64| std::f64::consts::PI * r * r + 2.0 * r * length;
        let between = |w: &[Vec<f64>]| w[1].iter().zip(&w[0]).map(|(b, a)| b - a).collect::<Vec<_>>();
        Self {
            rings: cumulative.windows(2).map(|w| trimmed(&between(w))).collect(),
            area: edges.windows(2).map(|w| area(w[1]) - area(w[0])).collect(),
        }
    }

    fn of_point(grid: &Grid, edges: &[f64], centre: DVec2) -> Self {
        let n = edges.len() - 1;
        let (mut rings, mut area) = (vec![grid.no_weights(); n], vec![0.0; n]);
        let point = Segment::point(centre);
        for (place, distance) in pixels_around(centre, edges[n]) {
            share_out(&point, place, distance, edges, |ring, part| {
                grid.add_pixel(&mut rings[ring], distance, part);
                area[ring] += part;
            });
        }
        Self { rings: rings.iter().map(|w| trimmed(w)).collect(), area }
    }

    /// Share of the light in each ring, for a profile on the grid.
    pub fn shares(&self, profile: &[f64]) -> Vec<f64> {
        let dot = |(start, weights): &(usize, Vec<f64>)| share(weights, profile.get(*start..).unwrap_or_default());
        self.rings.iter().map(dot).collect()
    }
}

/// Pixels that reach within `radius` of a place: their centres and distances.
pub fn pixels_around(centre: DVec2, radius: f64) -> impl Iterator<Item = (DVec2, f64)> {
    let reach = if radius.is_finite() { radius.clamp(0.0, 1000.0) + 0.708 } else { 0.0 };
    let first = (centre - reach).floor();
    let count = (2.0 * reach).ceil() as usize + 2;
    let place = move |i: usize| first + DVec2::new((i % count) as f64, (i / count) as f64);
    (0..count * count).map(move |i| (place(i), (place(i) - centre).length())).filter(move |p| p.1 <= reach)
}

/// The parts of a pixel in the rings about a segment.
fn share_out(segment: &Segment, place: DVec2, distance: f64, edges: &[f64], mut add: impl FnMut(usize, f64)) {
    let mut ring = edges.partition_point(|e| *e <= distance - 0.708).max(1);
    let mut inside = 0.0;
    while ring < edges.len() && inside < 1.0 {
        let within = aperture::overlap(segment, place, distance, edges[ring], 4);
        add(ring - 1, within - inside);
        (ring, inside) = (ring + 1, within);
    }
}
