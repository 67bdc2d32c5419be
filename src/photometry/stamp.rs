//! Pixels about a source, in electrons.

use super::frame::Frame;
use super::segment::Segment;
use glam::DVec2;

/// A usable pixel.
#[derive(Debug, Clone, Copy)]
pub struct Pixel {
    /// Its centre \[px\].
    pub place: DVec2,
    /// Distance from the source \[px\].
    pub distance: f64,
    /// What it holds above bias, in electrons as they arrived \[e\].
    pub value_e: f64,
}

/// Usable pixels within a radius of a source, and what was not usable near its light.
#[derive(Debug, Clone, Default)]
pub struct Stamp {
    /// Neither masked nor saturated, and numbers.
    pub pixels: Vec<Pixel>,
    /// Pixels of the core that are no number.
    pub bad: usize,
    /// Saturated pixels of the core.
    pub saturated: usize,
    /// Saturated pixels of the core in one line beyond what the image explains.
    pub bloomed: bool,
    /// Part of the core lies off the frame.
    pub cut: bool,
}

impl Stamp {
    /// The pixels within `radius` of `source`; its core reaches out to `core` \[px\]. Pixels for which `masked` holds
    /// are left out.
    pub fn gather(
        frame: &Frame,
        source: &Segment,
        radius: f64,
        core: f64,
        masked: impl Fn(DVec2) -> bool,
    ) -> Self {
        let (bias, gain) = (frame.bias_adu.unwrap_or(0.0), frame.gain_at(source.centre));
        let reach = source.half.abs() + DVec2::splat(core);
        let inside = |place: DVec2| frame.holds(place, 0.0);
        let cut = !(inside(source.centre - reach) && inside(source.centre + reach));
        let mut stamp = Self { cut, ..Self::default() };
        let mut full = Vec::new();
        source.for_pixels(frame, radius, |place, distance, value| {
            let central = distance <= core;
            if value >= frame.saturate_adu {
                stamp.saturated += usize::from(central);
                full.push(place);
            } else if !value.is_finite() {
                stamp.bad += usize::from(central);
            } else if !masked(place) {
                stamp.pixels.push(Pixel { place, distance, value_e: (value - bias) * gain });
            }
        });
        stamp.bloomed = stamp.saturated > 0 && spilt(&full, source);
        stamp
    }
}

/// True if saturated pixels extend along columns or rows more than twice as far as the other way, beyond what the trail
/// itself does.
fn spilt(full: &[DVec2], source: &Segment) -> bool {
    let extent = |axis: usize| {
        let values = full.iter().map(|p| p[axis]);
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        high - low + 1.0 - 2.0 * source.half[axis].abs()
    };
    let (x, y) = (extent(0).max(1.0), extent(1).max(1.0));
    x > 2.0 * y + 4.0 || y > 2.0 * x + 4.0
}
