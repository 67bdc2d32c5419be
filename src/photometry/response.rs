//! How much of the light a part of the chip turned into electrons, as a master flat tells.
//!
//! A frame divided by its flat counts electrons as if the whole chip responded as its median does. What arrived, and so its
//! photon noise, is that times the flat: where the response is 0.8, the noise of the corrected light is 1 / sqrt 0.8 of what
//! its number tells.

use glam::DVec2;
use std::sync::Arc;

/// Side of a cell \[px\]: vignetting is smooth, and single pixels are the noise of their own.
const CELL: usize = 32;
/// Responses are kept within these bounds.
const BOUNDS: [f64; 2] = [0.05, 20.0];

/// Mean response in cells, 1 on the median.
#[derive(Debug, Clone, PartialEq)]
pub struct Response {
    columns: usize,
    cells: Arc<[f32]>,
    origin: DVec2,
}

impl Response {
    /// Of a flat of `width` columns, row by row from y = 0.
    pub fn of(width: usize, flat: &[f32]) -> Self {
        let width = width.max(1);
        let columns = width.div_ceil(CELL);
        let mut cells = Vec::new();
        for band in flat.chunks(width * CELL) {
            for column in 0..columns {
                let part = |row: &[f32]| {
                    let values = row.iter().skip(column * CELL).take(CELL).filter(|v| v.is_finite());
                    values.fold((0.0, 0.0), |(sum, n), v| (sum + f64::from(*v), n + 1.0))
                };
                let (sum, n) = band.chunks(width).map(part).fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
                cells.push(if n > 0.0 { (sum / n) as f32 } else { 1.0 });
            }
        }
        Self { columns, cells: cells.into(), origin: DVec2::ZERO }
    }

    /// The same for a frame whose first pixel is that one of the flat.
    #[must_use]
    pub fn from(&self, first: DVec2) -> Self {
        Self { origin: self.origin + first, ..self.clone() }
    }

    /// At a place \[px\]; 1 off the chip.
    pub fn at(&self, place: DVec2) -> f64 {
        let cell = ((place + self.origin + 0.5) / CELL as f64).floor();
        let (x, y) = (cell.x, cell.y);
        if !(x >= 0.0 && y >= 0.0 && x < self.columns as f64) {
            return 1.0;
        }
        let index = (y as usize).saturating_mul(self.columns).saturating_add(x as usize);
        self.cells.get(index).map_or(1.0, |v| f64::from(*v).clamp(BOUNDS[0], BOUNDS[1]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_response_is_that_of_its_cell() {
        let flat = (0..70 * 50).map(|i| if i % 70 < 32 { 0.8 } else { 1.1 }).collect::<Vec<f32>>();
        let response = Response::of(70, &flat);
        for (x, y, want) in
            [(0.0, 0.0, 0.8), (31.4, 49.0, 0.8), (31.6, 3.0, 1.1), (69.0, 49.0, 1.1), (-9.0, 4.0, 1.0)]
        {
            assert!((response.at(DVec2::new(x, y)) - want).abs() < 1e-6, "{x} {y}");
        }
        assert!((response.from(DVec2::new(20.0, 0.0)).at(DVec2::new(15.0, 3.0)) - 1.1).abs() < 1e-6);
        assert_eq!(response.at(DVec2::NAN), 1.0);
        assert_eq!(response.at(DVec2::new(3.0, 1e300)), 1.0);
        assert_eq!(Response::of(0, &[]).at(DVec2::ZERO), 1.0);
    }
}
