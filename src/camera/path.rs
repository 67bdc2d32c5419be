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
    /// the light.
    pub fn rolled(&self, delay: f64) -> (Self, f64) {
        // a row's opening t = delay y(t): each step gains as many digits as rows pass in an exposure times the delay
        let opening = |shift: f64| (0..60).fold(shift, |t, _| shift + delay * self.at(t).y.clamp(-1e5, 1e5));
        let (from, to) = (opening(0.0), opening(1.0));
        if from.is_finite() && to.is_finite() && (to - from) > 0.0 && (to - from) < 10.0 {
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
