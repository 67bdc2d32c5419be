//! Rectangles of pixels.

use glam::DVec2;

/// A rectangle of pixels of the whole frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Region {
    /// First column.
    pub x0: usize,
    /// First row.
    pub y0: usize,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

impl Region {
    /// The region within `margin` pixels of a place, cut to a frame of `size`; none if nothing is left.
    pub fn around(at: DVec2, margin: f64, size: [usize; 2]) -> Option<Self> {
        let cut = |centre: f64, size: usize| {
            let low = (centre - margin).round().max(0.0);
            let high = (centre + margin).round().min(size as f64 - 1.0);
            (low <= high).then_some((low as usize, high as usize - low as usize + 1))
        };
        let ((x0, width), (y0, height)) = (cut(at.x, size[0])?, cut(at.y, size[1])?);
        Some(Self { x0, y0, width, height })
    }

    /// Number of pixels.
    pub fn len(&self) -> usize {
        self.width * self.height
    }

    /// True if there is no pixel.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}
