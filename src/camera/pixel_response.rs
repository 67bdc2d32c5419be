//! What a pixel sees of a point, for offsets on a grid finer than the pixel: the profile integrated over cells by Gauss's rule of two points
//! a side, cells summed over the pixel.

use super::profile::Profile;
use glam::DVec2;

/// Cells of the grid across the FWHM, where the grid may be so fine.
pub const ACROSS: f64 = 14.0;

/// Most parts of a cell's side: enough for [`super::optics`]' narrowest image.
const MOST_PARTS: f64 = 256.0;

/// Offset of the two Gauss points from the middle of a unit interval.
const GAUSS_2: f64 = 0.288_675_134_594_812_9;

/// The profile integrated over the cells of the fine grid.
pub struct Cells {
    fine: usize,
    /// Cells from the point to the rim.
    half: usize,
    /// By rows, 2 `half` of them.
    values: Vec<f64>,
}

impl Cells {
    /// Of a profile, `fine` cells to a pixel, inside the square of a radius \[px\] and half a pixel.
    pub fn new(profile: &Profile, fine: usize, radius: usize) -> Self {
        let half = radius * fine + fine / 2;
        let step = 1.0 / fine as f64;
        let fwhm = profile.fwhm();
        // the core of an image narrower than the grid can follow
        let core = 4.0 * fwhm;
        let parts = (ACROSS * step / fwhm).ceil().clamp(1.0, MOST_PARTS);
        let integral = |i: i64, j: i64| {
            let centre = DVec2::new(i as f64 + 0.5, j as f64 + 0.5) * step;
            let n = if centre.length() < core + step { parts } else { 1.0 };
            let mut sum = 0.0;
            for y in 0..n as usize {
                for x in 0..n as usize {
                    let corner = (DVec2::new(x as f64, y as f64) + 0.5) / n - 0.5;
                    for gy in [-GAUSS_2, GAUSS_2] {
                        for gx in [-GAUSS_2, GAUSS_2] {
                            sum += profile.density(centre + (corner + DVec2::new(gx, gy) / n) * step);
                        }
                    }
                }
            }
            0.25 * sum * step * step / (n * n)
        };
        let side = 2 * half;
        let mut values = vec![0.0; side * side];
        let signed = half as i64;
        if profile.is_circular() {
            for j in 0..half {
                for i in 0..=j {
                    let value = integral(i as i64, j as i64);
                    for (x, y) in [(i, j), (j, i)] {
                        for (x, y) in [(half + x, half + y), (half - 1 - x, half + y)] {
                            values[y * side + x] = value;
                            values[(side - 1 - y) * side + x] = value;
                        }
                    }
                }
            }
        } else {
            for (k, value) in values.iter_mut().enumerate() {
                *value = integral((k % side) as i64 - signed, (k / side) as i64 - signed);
            }
        }
        Self { fine, half, values }
    }

    /// Rows and columns of the cells inside the square of a radius.
    fn inside(&self, radius: usize) -> std::ops::Range<usize> {
        let half = radius * self.fine + self.fine / 2;
        self.half - half..self.half + half
    }

    /// Light inside the square of a radius.
    pub fn sum(&self, radius: usize) -> f64 {
        let inside = self.inside(radius);
        inside.clone().map(|j| self.values[j * 2 * self.half..][inside.clone()].iter().sum::<f64>()).sum()
    }

    /// The response of a pixel to what lies inside the square of a radius, times `scale`, and the largest on the square's rim.
    pub fn response(&self, radius: usize, scale: f64) -> (Response, f64) {
        let grid = Response::half(radius, self.fine);
        let side = 2 * grid + 1;
        let inside = self.inside(radius);
        // sums of the cells under a pixel centred at each grid point, along x, then along y
        let window = |g: usize, line: &dyn Fn(usize) -> f64| {
            let first = (self.half + g) as i64 - grid as i64 - (self.fine / 2) as i64;
            let from = first.max(inside.start as i64);
            let to = (first + self.fine as i64).min(inside.end as i64);
            (from..to).map(|cell| line(cell as usize)).sum::<f64>()
        };
        let rows = 2 * self.half;
        let mut along_x = vec![0.0; rows * side];
        for j in inside.clone() {
            for g in 0..side {
                along_x[j * side + g] = window(g, &|cell| self.values[j * rows + cell]);
            }
        }
        let mut values = vec![0.0; side * side];
        for g in 0..side {
            for i in 0..side {
                values[g * side + i] = scale * window(g, &|cell| along_x[cell * side + i]);
            }
        }
        let response = Response { grid: grid as i64, side, values };
        // a whole pixel inside the rim
        let rim = (radius * self.fine) as i64;
        let on_rim = (-rim..=rim).flat_map(|k| [(k, rim), (k, -rim), (rim, k), (-rim, k)]);
        let rim = on_rim.fold(0.0f64, |most, (x, y)| most.max(response.at(x, y)));
        (response, rim)
    }
}

/// Responses of a pixel at the points of the fine grid about a point.
pub struct Response {
    grid: i64,
    side: usize,
    values: Vec<f64>,
}

impl Response {
    /// Grid points from the point to the last pixel that sees its square.
    pub fn half(radius: usize, fine: usize) -> usize {
        (radius + 1) * fine
    }

    /// The response at a grid point, no farther from the point than [`Response::half`].
    pub fn at(&self, x: i64, y: i64) -> f64 {
        self.values[(y + self.grid) as usize * self.side + (x + self.grid) as usize]
    }
}
