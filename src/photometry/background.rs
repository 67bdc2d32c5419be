//! The background over part of a frame: a mesh of clipped means, interpolated bilinearly.
//!
//! Used to find sources; fluxes use the annulus beside the source ([`super::aperture`]). Each cell is the
//! symmetrically clipped mean of its pixels; cells lifted by stars are levelled by a median over 3 x 3 cells
//! (Bertin & Arnouts 1996, A&AS 117, 393, sect. 3). Only the cells asked for are computed.

use super::aperture::clipped_mean;
use super::frame::Frame;
use glam::DVec2;

/// Background and its scatter over a rectangle of a frame.
#[derive(Debug, Clone)]
pub struct Mesh {
    origin: DVec2,
    cell: f64,
    columns: usize,
    rows: usize,
    mean_adu: Vec<f64>,
    sigma_adu: Vec<f64>,
}

impl Mesh {
    /// The mesh over the part of `frame` within `reach` \[px\] of `centre`, of cells `cell_px` wide (8 at least).
    pub fn around(frame: &Frame, centre: DVec2, reach: DVec2, cell_px: usize) -> Self {
        let cell = cell_px.clamp(8, 4096);
        let span = |centre: f64, reach: f64, size: usize| {
            let first = ((centre - reach).floor().max(0.0) as usize).min(size);
            let last = ((centre + reach).ceil().max(0.0) as usize).saturating_add(1).min(size).max(first);
            (first, last, (last - first).div_ceil(cell).max(1))
        };
        let (x0, x1, columns) = span(centre.x, reach.x, frame.width);
        let (y0, y1, rows) = span(centre.y, reach.y, frame.height);
        let (mut mean_adu, mut sigma_adu) = (Vec::new(), Vec::new());
        let mut values = Vec::new();
        for row in 0..rows {
            for column in 0..columns {
                let (xa, ya) = (x0 + column * cell, y0 + row * cell);
                values.clear();
                for y in ya..(ya + cell).min(y1) {
                    let line = &frame.data[y * frame.width + xa..y * frame.width + (xa + cell).min(x1).max(xa)];
                    values.extend(line.iter().filter(|v| v.is_finite()).map(|v| f64::from(*v)));
                }
                let local = clipped_mean(&mut values);
                let usable = local.n * 4 >= cell;
                mean_adu.push(if usable { local.mean_adu } else { f64::NAN });
                sigma_adu.push(if usable { local.sigma_adu } else { f64::NAN });
            }
        }
        let origin = DVec2::new(x0 as f64, y0 as f64) + DVec2::splat(0.5 * (cell - 1) as f64);
        let mesh = Self { origin, cell: cell as f64, columns, rows, mean_adu, sigma_adu };
        Self { mean_adu: mesh.levelled(&mesh.mean_adu), sigma_adu: mesh.levelled(&mesh.sigma_adu), ..mesh }
    }

    /// Each cell's median over itself and its neighbours; cells without value take that of all.
    fn levelled(&self, cells: &[f64]) -> Vec<f64> {
        let median = |mut values: Vec<f64>| {
            values.retain(|v| v.is_finite());
            values.sort_by(f64::total_cmp);
            let n = values.len();
            if n == 0 { f64::NAN } else { 0.5 * (values[(n - 1) / 2] + values[n / 2]) }
        };
        let all = median(cells.to_vec());
        let mut out = Vec::with_capacity(cells.len());
        for row in 0..self.rows {
            for column in 0..self.columns {
                let near = (row.saturating_sub(1)..(row + 2).min(self.rows)).flat_map(|r| {
                    (column.saturating_sub(1)..(column + 2).min(self.columns)).map(move |c| r * self.columns + c)
                });
                let level = median(near.map(|i| cells[i]).collect());
                out.push(if level.is_finite() { level } else { all });
            }
        }
        out
    }

    fn interpolate(&self, cells: &[f64], place: DVec2) -> f64 {
        let p = (place - self.origin) / self.cell;
        let (x0, x1, fx) = between(p.x, self.columns);
        let (y0, y1, fy) = between(p.y, self.rows);
        let at = |x: usize, y: usize| cells[y * self.columns + x];
        let low = at(x0, y0) * (1.0 - fx) + at(x1, y0) * fx;
        let high = at(x0, y1) * (1.0 - fx) + at(x1, y1) * fx;
        low * (1.0 - fy) + high * fy
    }

    /// Background along a row of pixels that starts at `first` \[adu\].
    pub fn mean_row(&self, first: DVec2, row: &mut [f64]) {
        let (y0, y1, fy) = between((first.y - self.origin.y) / self.cell, self.rows);
        let cells = |y: usize| &self.mean_adu[y * self.columns..][..self.columns];
        let levels =
            cells(y0).iter().zip(cells(y1)).map(|(low, high)| low * (1.0 - fy) + high * fy).collect::<Vec<_>>();
        let (start, step) = ((first.x - self.origin.x) / self.cell, 1.0 / self.cell);
        for (i, value) in row.iter_mut().enumerate() {
            let (x0, x1, fx) = between(start + i as f64 * step, self.columns);
            *value = levels[x0] * (1.0 - fx) + levels[x1] * fx;
        }
    }

    /// Background at a place \[adu\]; NaN if no pixel was usable.
    pub fn mean_adu(&self, place: DVec2) -> f64 {
        self.interpolate(&self.mean_adu, place)
    }

    /// Standard deviation of a pixel at a place \[adu\].
    pub fn sigma_adu(&self, place: DVec2) -> f64 {
        self.interpolate(&self.sigma_adu, place)
    }
}

/// The two of `n` nodes about `x`, and how far it is from the first to the second.
fn between(x: f64, n: usize) -> (usize, usize, f64) {
    let x = x.clamp(0.0, (n - 1) as f64);
    let i = (x as usize).min(n.saturating_sub(2));
    (i, (i + 1).min(n - 1), x - i as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::photometry::synthetic::{self, Camera};

    /// To the rounding of 1e4 adu.
    #[test]
    fn a_row_is_what_its_places_are() {
        let mean = (0..400 * 300).map(|i| 900.0 + 0.3 * f64::from(i % 400) + 2e-5 * f64::from(i / 400).powi(3));
        let frame = synthetic::develop(&Camera::default(), 400, 300, 8, &mean.collect::<Vec<_>>());
        let mesh = Mesh::around(&frame, DVec2::new(180.0, 140.0), DVec2::splat(130.0), 64);
        for y in [-40.0, 31.0, 177.0, 300.0] {
            let mut row = vec![0.0; 500];
            mesh.mean_row(DVec2::new(-50.0, y), &mut row);
            for (i, value) in row.into_iter().enumerate() {
                assert!((value - mesh.mean_adu(DVec2::new(i as f64 - 50.0, y))).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn a_flat_sky_is_found_flat_and_with_its_scatter() {
        let camera = Camera::default();
        let frame = synthetic::expose(&camera, 300, 200, 5, &[]);
        let mesh = Mesh::around(&frame, DVec2::new(150.0, 100.0), DVec2::new(150.0, 100.0), 64);
        let sigma = ((camera.sky_e + camera.read_noise_e.powi(2)) / camera.gain.powi(2) + 1.0 / 12.0).sqrt();
        for place in [DVec2::new(-5.0, 3.0), DVec2::new(150.0, 100.0), DVec2::new(299.0, 199.0)] {
            let level = camera.bias_adu + camera.sky_e / camera.gain;
            assert!((mesh.mean_adu(place) - level).abs() < 5.0 * sigma / 64.0);
            assert!((mesh.sigma_adu(place) / sigma - 1.0).abs() < 0.05);
        }
    }

    #[test]
    fn nothing_usable_gives_nan_and_no_panic() {
        let frame = synthetic::blank(1, 1, f32::NAN);
        let mesh = Mesh::around(&frame, DVec2::splat(1e9), DVec2::splat(f64::NAN), 0);
        assert!(mesh.mean_adu(DVec2::ZERO).is_nan());
    }
}
