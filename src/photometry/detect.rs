//! Sources where they are expected: matched filtering near a predicted place.
//!
//! The pixels above the background are correlated with the expected image, a Gaussian of the seeing drawn along
//! the source's trail, and divided by the scatter of the result. A target is the strongest peak within two widths
//! of its predicted place, else the strongest clear one within the search radius. The common pointing error of the
//! stars is the peak of the sum of their maps, each scaled to at most 10 so that no single source decides.

use super::background::Mesh;
use super::centroid;
use super::frame::Frame;
use super::segment::Segment;
use glam::DVec2;
use rayon::prelude::*;

/// Widest search \[px\].
const WIDEST_PX: f64 = 100.0;
/// Threshold near the predicted place \[standard deviations\].
const NEAR_SIGMA: f64 = 4.5;
/// Threshold anywhere in the search radius: one chance in 1e4 among the 1e4 places.
const FAR_SIGMA: f64 = 6.0;

/// Fewer stars do not tell a pointing that is far off.
const FEWEST_AFAR: usize = 3;

/// Significance of a source centred at the pixels about a predicted place.
struct Map {
    radius: i64,
    sigma: Vec<f64>,
}

impl Map {
    fn new(
        frame: &Frame,
        source: &Segment,
        radius: i64,
        fwhm: f64,
        mesh: &Mesh,
        mask: impl Fn(DVec2) -> bool,
    ) -> Self {
        let sigma = fwhm / 2.354_82;
        let kernel_reach = (3.0 * sigma).ceil() as i64;
        let kernel = (-kernel_reach..=kernel_reach).map(|i| (-0.5 * (i as f64 / sigma).powi(2)).exp());
        let kernel = kernel.collect::<Vec<_>>();
        let extent = source.half.abs().min(DVec2::splat(2000.0)).ceil();
        let (rx, ry) = (radius + extent.x as i64 + 1, radius + extent.y as i64 + 1);
        let (width, height) = (2 * rx + 1, 2 * ry + 1 + 2 * kernel_reach);
        let origin = source.centre.round();
        let (ox, oy) = (origin.x as i64, origin.y as i64);
        // rows first, then columns
        let mut across = vec![0.0; (width * height) as usize];
        let mut line = vec![0.0; (width + 2 * kernel_reach) as usize];
        for j in 0..height {
            let y = oy - ry - kernel_reach + j;
            let first = ox - rx - kernel_reach;
            mesh.mean_row(DVec2::new(first as f64, y as f64), &mut line);
            for (i, value) in line.iter_mut().enumerate() {
                let x = first + i as i64;
                let adu = frame.pixel(x, y);
                let left_out = adu.is_nan() || mask(DVec2::new(x as f64, y as f64));
                *value = if left_out { 0.0 } else { adu - *value };
            }
            let row = &mut across[(j * width) as usize..][..width as usize];
            for (weight, from) in kernel.iter().zip(0..) {
                row.iter_mut().zip(&line[from..]).for_each(|(sum, v)| *sum += weight * v);
            }
        }
        let mut blurred = vec![0.0; (width * (2 * ry + 1)) as usize];
        for (j, row) in blurred.chunks_exact_mut(width as usize).enumerate() {
            for (weight, from) in kernel.iter().zip(across.chunks_exact(width as usize).skip(j)) {
                row.iter_mut().zip(from).for_each(|(sum, v)| *sum += weight * v);
            }
        }
        let samples = ((source.length().min(4000.0) / sigma).ceil() as i64).max(0);
        let steps = (-samples..=samples).step_by(2).map(|i| source.half * (i as f64 / samples.max(1) as f64));
        let steps =
            steps.map(|d| d.clamp(-extent, extent).round()).map(|d| (d.x as i64, d.y as i64)).collect::<Vec<_>>();
        let side = (2 * radius + 1) as usize;
        let mut map = vec![0.0; side * side];
        for (y, row) in (-radius..).zip(map.chunks_exact_mut(side)) {
            for (dx, dy) in &steps {
                let from = &blurred[((y + dy + ry) * width + rx - radius + dx) as usize..];
                row.iter_mut().zip(from).for_each(|(sum, v)| *sum += v);
            }
        }
        let mut seen = map.iter().copied().filter(|v| v.is_finite() && *v != 0.0).collect::<Vec<_>>();
        let mut at = |share: f64| {
            let place = (share * seen.len() as f64) as usize;
            if seen.is_empty() { 0.0 } else { *seen.select_nth_unstable_by(place, f64::total_cmp).1 }
        };
        let (median, low) = (at(0.5), at(0.16));
        let scatter = (median - low).max(1e-30);
        Self { radius, sigma: map.into_iter().map(|v| (v - median) / scatter).collect() }
    }

    fn get(&self, x: i64, y: i64) -> f64 {
        let inside = x.abs() <= self.radius && y.abs() <= self.radius;
        let index = (y + self.radius) * (2 * self.radius + 1) + x + self.radius;
        if inside { self.sigma[index as usize] } else { f64::NEG_INFINITY }
    }

    /// The strongest local maximum within `reach` of a place: (offset, significance).
    fn peak(&self, about: DVec2, reach: f64) -> Option<(DVec2, f64)> {
        let mut best: Option<(DVec2, f64)> = None;
        for y in -self.radius..=self.radius {
            for x in -self.radius..=self.radius {
                let (offset, value) = (DVec2::new(x as f64, y as f64), self.get(x, y));
                if (offset - about).length() > reach || value.is_nan() || best.is_some_and(|b| value <= b.1) {
                    continue;
                }
                let summit = (-1..=1).all(|j| (-1..=1).all(|i| self.get(x + i, y + j) <= value));
                if summit {
                    best = Some((offset, value));
                }
            }
        }
        best
    }
}

/// Radius of a map for a search: wide enough to hold noise beside a bright source.
fn map_radius(search_px: f64, fwhm: f64) -> i64 {
    search_px.clamp(20.0, WIDEST_PX).max(6.0 * fwhm).ceil() as i64
}

/// The place of a target expected on `predicted`; none if nothing is significant. A search radius below half
/// a pixel means that the place is known, and nothing is searched.
pub fn target(
    frame: &Frame,
    predicted: &Segment,
    fwhm: f64,
    search_px: f64,
    cell_px: usize,
    masked: impl Fn(DVec2) -> bool,
) -> Option<DVec2> {
    if search_px.is_nan() || search_px < 0.5 || !frame.holds(predicted.centre, 0.0) {
        return None;
    }
    let radius = map_radius(search_px, fwhm);
    let reach = DVec2::splat(radius as f64 + 4.0 * fwhm) + predicted.half.abs();
    let mesh = Mesh::around(frame, predicted.centre, reach, cell_px);
    let map = Map::new(frame, predicted, radius, fwhm, &mesh, masked);
    let near = (2.0 * fwhm).max(3.0).min(search_px);
    let found = map.peak(DVec2::ZERO, near).filter(|p| p.1 > NEAR_SIGMA);
    let found = found.or_else(|| map.peak(DVec2::ZERO, search_px.min(WIDEST_PX)).filter(|p| p.1 > FAR_SIGMA));
    let start = predicted.at(predicted.centre.round() + found?.0);
    let level = mesh.mean_adu(start.centre);
    let place = centroid::windowed(frame, &start, fwhm, level, 1.5 * fwhm).unwrap_or(start.centre);
    frame.holds(place, 0.0).then_some(place)
}

/// The common offset of sources from their predicted places, within `search_px`; zero if it cannot be told.
pub fn common_shift(frame: &Frame, predicted: &[Segment], fwhm: f64, search_px: f64, cell_px: usize) -> DVec2 {
    if predicted.is_empty() || search_px.is_nan() || search_px < 0.5 {
        return DVec2::ZERO;
    }
    let radius = map_radius(search_px, fwhm);
    let mapped = |source: &Segment| {
        let reach = DVec2::splat(radius as f64 + 4.0 * fwhm) + source.half.abs();
        let mesh = Mesh::around(frame, source.centre, reach, cell_px);
        let map = Map::new(frame, source, radius, fwhm, &mesh, |_| false);
        // brighter sources count no more than those of 10 sigma, and keep their summits
        let scale = (10.0 / map.sigma.iter().copied().fold(10.0, f64::max)).min(1.0);
        let capped = map.sigma.into_iter().map(|s| if s.is_nan() { 0.0 } else { (s * scale).max(-5.0) });
        (mesh, capped.collect::<Vec<_>>())
    };
    let (levels, maps): (Vec<_>, Vec<_>) = predicted.par_iter().map(mapped).unzip();
    let mut maps = maps.into_iter();
    let Some(mut sigma) = maps.next() else { return DVec2::ZERO };
    maps.for_each(|map| sigma.iter_mut().zip(map).for_each(|(s, c)| *s += c));
    let stack = Map { radius, sigma };
    let enough = FAR_SIGMA * (predicted.len() as f64).sqrt();
    // one or two stars may be mistaken for others, unless they are where they should be
    let reach = if predicted.len() < FEWEST_AFAR { (2.0 * fwhm).max(3.0) } else { WIDEST_PX };
    let Some((peak, height)) = stack.peak(DVec2::ZERO, search_px.min(reach)) else { return DVec2::ZERO };
    if height < enough {
        return DVec2::ZERO;
    }
    let off = |(source, mesh): (&Segment, &Mesh)| {
        let start = source.at(source.centre + peak);
        let level = mesh.mean_adu(start.centre);
        let place = centroid::windowed(frame, &start, fwhm, level, 2.0 * fwhm + 3.0)?;
        Some((place.x - source.centre.x, place.y - source.centre.y))
    };
    let (mut xs, mut ys): (Vec<_>, Vec<_>) = predicted.par_iter().zip(&levels).filter_map(off).unzip();
    let median = |values: &mut Vec<f64>| {
        values.sort_by(f64::total_cmp);
        let n = values.len();
        if n == 0 { f64::NAN } else { 0.5 * (values[(n - 1) / 2] + values[n / 2]) }
    };
    let shift = DVec2::new(median(&mut xs), median(&mut ys));
    if shift.is_finite() && shift.length() <= search_px + 2.0 * fwhm { shift } else { peak }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::photometry::synthetic::{self, Camera, Source};

    #[test]
    fn a_faint_target_is_found_near_its_place_and_a_bright_one_farther_off() {
        let camera = Camera::default();
        for (offset, flux_e) in [(DVec2::new(1.0, -2.0), 700.0), (DVec2::new(-23.0, 31.0), 2000.0)] {
            let predicted = Segment::point(DVec2::new(80.0, 75.0));
            let truth = predicted.at(predicted.centre + offset);
            let frame = synthetic::expose(&camera, 160, 150, 9, &[Source { segment: truth, flux_e }]);
            let found = target(&frame, &predicted, 3.1, 50.0, 64, |_| false).expect("a source");
            assert!((found - truth.centre).length() < 0.8, "{found}");
        }
        let empty = synthetic::expose(&camera, 160, 150, 10, &[]);
        let found = target(&empty, &Segment::point(DVec2::splat(75.0)), 3.1, 50.0, 64, |_| false);
        assert_eq!(found, None);
    }

    #[test]
    fn the_pointing_error_is_found_although_a_third_of_the_stars_is_absent() {
        let camera = Camera::default();
        let half = DVec2::new(15.0, 3.0);
        let predicted = (0..9).map(|i| {
            let place = DVec2::new(100.0 + 150.0 * f64::from(i % 3), 100.0 + 150.0 * f64::from(i / 3));
            Segment { centre: place, half }
        });
        let predicted = predicted.collect::<Vec<_>>();
        let shift = DVec2::new(17.3, -8.6);
        let sources = predicted.iter().enumerate().filter(|(i, _)| i % 3 != 0);
        let sources =
            sources.map(|(_, s)| Source { segment: s.at(s.centre + shift), flux_e: 3e4 }).collect::<Vec<_>>();
        let frame = synthetic::expose(&camera, 500, 500, 2, &sources);
        let found = common_shift(&frame, &predicted, 3.1, 50.0, 64);
        assert!((found - shift).length() < 0.3, "{found}");
        assert_eq!(common_shift(&frame, &[], 3.1, 50.0, 64), DVec2::ZERO);
    }
}
