//! Paths of light over the frame during an exposure.

use crate::plan::view::View;
use crate::scene::{Chip, Scene};
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

    /// The part of the path between two shares of the exposure, which may lie outside 0..1.
    pub fn part(&self, from: f64, to: f64) -> Self {
        Self { start: self.at(from), mid: self.at(0.5 * (from + to)), end: self.at(to) }
    }

    /// The path as a rolling shutter sees it, each row of the frame `delay` of an exposure after the one before; and its share of
    /// the light. A source that the rows never meet is left as it is.
    pub fn rolled(&self, delay: f64) -> (Self, f64) {
        // y = a t^2 + b t + c, and a row opens (or closes, a whole exposure later) at t = shift + delay y(t)
        let [y0, y1, y2] = [self.start.y, self.mid.y, self.end.y];
        let (a, b) = (2.0 * (y0 + y2 - 2.0 * y1), 4.0 * y1 - 3.0 * y0 - y2);
        let meets = |shift: f64| {
            let (a, b, c) = (delay * a, delay * b - 1.0, delay * y0 + shift);
            // the root that is -c/b for uniform motion
            -2.0 * c / (b + (b * b - 4.0 * a * c).sqrt().copysign(b))
        };
        let (one, other) = (meets(0.0), meets(1.0));
        let (from, to) = (one.min(other), one.max(other));
        if one.is_finite() && other.is_finite() && to > from {
            (self.part(from, to), to - from)
        } else {
            (*self, 1.0)
        }
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

/// The path of a source as the chip's shutter sees it, and the share of its light.
pub(super) fn rolled(scene: &Scene, view: &View, path: Path) -> (Path, f64) {
    let d = &scene.detector;
    if d.kind != Chip::Cmos || d.shutter_s <= 0.0 || view.exposure_s <= 0.0 {
        return (path, 1.0);
    }
    path.rolled(d.shutter_s / (view.exposure_s * d.light_px()[1] as f64))
}
