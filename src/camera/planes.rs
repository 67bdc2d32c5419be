//! An image tabulated at sub-pixel phases, to be laid down anywhere.
//!
//! The response of a pixel at an offset from the image's origin is tabulated on a grid finer than a pixel and interpolated by
//! cubic (Lagrange) polynomials. All pixels of an image share their weights, so that it costs 16 multiplications a pixel.

use super::region::Region;
use crate::base::simd::Path;
use glam::DVec2;

/// Pixels of a plane beyond the image's half-size: half a pixel of phase and the stencil of the cubic.
const BEYOND: usize = 2;

/// A tabulated image.
#[derive(Debug, Clone)]
pub struct Planes {
    /// Grid points per pixel.
    fine: usize,
    /// Half the size of the image, along x and y \[px\].
    radius: [usize; 2],
    /// Size of a plane \[px\].
    side: [usize; 2],
    /// One plane for each phase (y, x) of the fine grid, pixels by rows.
    values: Vec<f64>,
}

impl Planes {
    /// Values of an image of `radius` with `fine` grid points per pixel.
    pub fn size(fine: usize, radius: [usize; 2]) -> usize {
        radius.iter().map(|r| fine * (2 * (r + BEYOND) + 1)).product()
    }

    /// An image whose planes `fill` fills: it is handed the place of the image's origin in the plane \[px\], and the plane
    /// with its size.
    pub fn new(fine: usize, radius: [usize; 2], mut fill: impl FnMut(DVec2, [usize; 2], &mut [f64])) -> Self {
        let side = radius.map(|r| 2 * (r + BEYOND) + 1);
        let mut values = vec![0.0; Self::size(fine, radius)];
        for (k, plane) in values.chunks_exact_mut(side[0] * side[1]).enumerate() {
            // pixel q of phase p lies q + p / fine - radius - 2 from the origin
            let origin = |axis: usize, p: usize| (radius[axis] + BEYOND) as f64 - p as f64 / fine as f64;
            fill(DVec2::new(origin(0, k % fine), origin(1, k / fine)), side, plane);
        }
        Self { fine, radius, side, values }
    }

    /// Fill the planes anew, in order.
    pub fn fill(&mut self, mut fill: impl FnMut(&mut [f64])) {
        self.values.chunks_exact_mut(self.side[0] * self.side[1]).for_each(&mut fill);
    }

    /// Half the size of the image \[px\].
    pub fn radius(&self) -> [usize; 2] {
        self.radius
    }

    /// Size of the table \[bytes\].
    pub fn bytes(&self) -> usize {
        self.values.len() * size_of::<f64>()
    }

    /// Add `electrons` times the part of the image within `radius` (no larger than its own) to the pixels of `region`, its
    /// origin at `at`.
    pub fn add(&self, at: DVec2, radius: [usize; 2], electrons: f64, region: &Region, out: &mut [f64]) {
        let far = [region.x0 + region.width, region.y0 + region.height].map(|n| n as f64);
        let near = |at: f64, first: usize, far: f64, radius: usize| {
            let reach = radius as f64 + 0.5;
            at > first as f64 - reach && at < far + reach
        };
        if !near(at.x, region.x0, far[0], radius[0]) || !near(at.y, region.y0, far[1], radius[1]) {
            return;
        }
        let (nearest_x, phase_x, weights_x) = self.stencil(at.x);
        let (nearest_y, phase_y, weights_y) = self.stencil(at.y);
        let pixels = |nearest: i64, radius: usize, first: usize, count: usize| {
            let low = (nearest - radius as i64).max(first as i64);
            let high = (nearest + radius as i64).min((first + count) as i64 - 1);
            (low, (high - low + 1).max(0) as usize)
        };
        let (x_low, x_count) = pixels(nearest_x, radius[0], region.x0, region.width);
        let (y_low, y_count) = pixels(nearest_y, radius[1], region.y0, region.height);
        if x_count == 0 {
            return;
        }
        let scaled = weights_y.map(|weight| weight * electrons);
        Path::best().run(
            #[inline(always)]
            || {
                for y in y_low..y_low + y_count as i64 {
                    let start = (y as usize - region.y0) * region.width + x_low as usize - region.x0;
                    let row = &mut out[start..start + x_count];
                    for (j, wy) in scaled.iter().enumerate() {
                        let source = |i: usize| {
                            self.row(phase_y + j, phase_x + i, y - nearest_y, x_low - nearest_x, x_count)
                        };
                        let [a, b, c, d] = weights_x.map(|wx| wx * wy);
                        let [p, q, r, s] = [source(0), source(1), source(2), source(3)];
                        for k in 0..x_count {
                            row[k] += (a * p[k] + b * q[k]) + (c * r[k] + d * s[k]);
                        }
                    }
                }
            },
        );
    }

    /// The nearest pixel to a coordinate, the first grid point of the cubic stencil about the offset of that pixel
    /// (counted from the table's own pixel 0 at that offset, never negative), and the four weights.
    fn stencil(&self, coordinate: f64) -> (i64, usize, [f64; 4]) {
        let nearest = coordinate.round();
        let fine = self.fine as f64;
        // offset of the pixel from the point, on the grid, shifted by one pixel to stay positive
        let grid = (nearest - coordinate + 1.0) * fine;
        let below = grid.floor();
        let t = grid - below;
        let weights = [
            -t * (t - 1.0) * (t - 2.0) / 6.0,
            (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0,
            -(t + 1.0) * t * (t - 2.0) / 2.0,
            (t + 1.0) * t * (t - 1.0) / 6.0,
        ];
        (nearest as i64, below as usize - 1, weights)
    }

    /// `count` responses of one phase from the offset (`dy`, `dx`) pixels on; `gy`, `gx` are stencil points.
    fn row(&self, gy: usize, gx: usize, dy: i64, dx: i64, count: usize) -> &[f64] {
        // the stencil was shifted by one pixel
        let centre = self.radius.map(|r| (r + BEYOND) as i64 - 1);
        let (py, qy) = (gy % self.fine, (gy / self.fine) as i64 + centre[1] + dy);
        let (px, qx) = (gx % self.fine, (gx / self.fine) as i64 + centre[0] + dx);
        let plane = (py * self.fine + px) * self.side[0] * self.side[1];
        let start = plane + qy as usize * self.side[0] + qx as usize;
        &self.values[start..start + count]
    }
}
