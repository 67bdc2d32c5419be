//! How evenly the optics and the shutter light the chip: 1 at the centre, falling with the square (vignetting) and the first
//! power (an iris shutter's travel) of the distance from it.

use super::detector::shutter;
use super::region::Region;
use crate::scene::{Chip, Scene};
use glam::DVec2;

/// Shares of the light that reach pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evenness {
    centre: DVec2,
    /// 1 over the distance of the corner.
    inverse_corner: f64,
    /// Lost in the corner by vignetting.
    vignetting: f64,
    /// Lost in the corner by the shutter.
    shutter: f64,
}

impl Evenness {
    /// Of a chip of `size` pixels, and the shares lost in its corners by vignetting and by the shutter.
    pub fn new(size: [usize; 2], vignetting: f64, shutter: f64) -> Self {
        let size = DVec2::new(size[0] as f64, size[1] as f64);
        let corner = 0.5 * size.length();
        Self { centre: 0.5 * (size - 1.0), inverse_corner: 1.0 / corner, vignetting, shutter }
    }

    /// Of a scene's telescope and shutter, in an exposure of `exposure_s`.
    pub fn of(scene: &Scene, exposure_s: f64) -> Self {
        let d = &scene.detector;
        let iris = if d.kind == Chip::Ccd { shutter::iris_loss(d.shutter_s, exposure_s) } else { 0.0 };
        Self::new(d.light_px(), scene.telescope.vignetting, iris)
    }

    /// True if all pixels get all their light.
    pub fn is_even(&self) -> bool {
        self.vignetting == 0.0 && self.shutter == 0.0
    }

    /// Share of the light that reaches a place \[px\].
    pub fn at(&self, place: DVec2) -> f64 {
        let r = (place - self.centre).length() * self.inverse_corner;
        ((1.0 - self.vignetting * r * r) * (1.0 - self.shutter * r)).max(0.0)
    }

    /// Multiply the light of `region`'s pixels.
    pub fn apply(&self, region: &Region, out: &mut [f64]) {
        if self.is_even() {
            return;
        }
        for (y, row) in (region.y0..).zip(out.chunks_exact_mut(region.width)) {
            for (x, light) in (region.x0..).zip(row) {
                *light *= self.at(DVec2::new(x as f64, y as f64));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_corner_loses_what_is_said() {
        let corner = DVec2::new(-0.5, 99.5);
        assert!((Evenness::new([200, 100], 0.3, 0.0).at(corner) - 0.7).abs() < 1e-12);
        assert!((Evenness::new([200, 100], 0.0, 0.1).at(corner) - 0.9).abs() < 1e-12);
        assert_eq!(Evenness::new([200, 100], 0.3, 0.1).at(DVec2::new(99.5, 49.5)), 1.0);
        assert!(Evenness::new([1, 1], 0.0, 0.0).is_even());
    }
}
