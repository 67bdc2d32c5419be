//! Paths of light over the frame during an exposure.

use glam::DVec2;

/// Where light moves while the shutter is open: a parabola through three points, at constant pace of time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Path {
    /// At opening \[px\].
    pub start: DVec2,
    /// At mid-exposure \[px\].
    pub mid: DVec2,
    /// At closing \[px\].
    pub end: DVec2,
}

impl Path {
    /// A point that stands still.
    pub fn still(at: DVec2) -> Self {
        Self { start: at, mid: at, end: at }
    }

    /// Place at a share `t` of the exposure, 0..1.
    pub fn at(&self, t: f64) -> DVec2 {
        let (a, b, c) = ((1.0 - t) * (1.0 - 2.0 * t), 4.0 * t * (1.0 - t), t * (2.0 * t - 1.0));
        self.start * a + self.mid * b + self.end * c
    }

    /// Length of the two chords \[px\].
    pub fn length(&self) -> f64 {
        self.start.distance(self.mid) + self.mid.distance(self.end)
    }

    /// Corners of a box about the path.
    pub fn bounds(&self) -> (DVec2, DVec2) {
        // the parabola leaves the box of its three points by at most a quarter of its sagitta
        let bulge = (self.start + self.end - 2.0 * self.mid).abs() * 0.25;
        let low = self.start.min(self.mid).min(self.end) - bulge;
        (low, self.start.max(self.mid).max(self.end) + bulge)
    }
}
