//! Flux and place of a source by least squares on its pixels, within 3 standard deviations of its trail.
//!
//! With the image k about a place, k_s and k_a its derivatives along and across, and d the pixels above background: the
//! flux is `sum k d / sum k^2`, and the place moves by `-sum k_s (d - F k) / F sum k_s^2` along, and so across: one step
//! of Gauss and Newton from the map's maximum. Only pixels on the frame that are not missing are summed.

use super::Plane;
use super::background::{Mask, Mesh};
use super::kernel::{Kernel, gauss, phi};
use crate::photometry::segment::Segment;
use glam::DVec2;

/// Half width of what is summed \[standard deviations of the image\].
const REACH: f64 = 3.0;
/// Longest steps along and across \[standard deviations of the image\].
const LONGEST: [f64; 2] = [2.5, 0.8];
/// Light of a pixel against the brightest, from which its saturation counts.
const CORE: f64 = 0.3;

/// What the pixels of a source say.
#[derive(Debug, Clone, Copy)]
pub(super) struct Measured {
    pub place: DVec2,
    /// Light \[units of the pixels\].
    pub flux: f64,
    /// Its standard deviation where the pixels' is 1.
    pub unit_error: f64,
    /// Part of the image is off the frame.
    pub edge: bool,
    pub saturated: bool,
}

#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    /// Image squared, on the frame and not missing.
    square: f64,
    /// Image squared off the frame.
    off: f64,
    /// Image times pixel.
    light: f64,
    /// Derivatives along and across: times pixel, times image, squared.
    slopes: [[f64; 3]; 2],
    saturated: bool,
}

/// Normal density and distribution at steps of 1 / [`PER_SIGMA`], between which they are straight to 1e-5.
#[derive(Debug, Clone)]
pub(super) struct Normal {
    nodes: Vec<[f64; 2]>,
}

const PER_SIGMA: f64 = 64.0;
/// End of the table \[standard deviations\].
const END: f64 = 6.0;

impl Normal {
    pub fn new() -> Self {
        let node = |i: i32| {
            let x = f64::from(i) / PER_SIGMA - END;
            [gauss(x, 1.0), phi(x)]
        };
        Self { nodes: (0..=(2.0 * END * PER_SIGMA) as i32).map(node).collect() }
    }

    /// Density and distribution at `x` standard deviations.
    fn at(&self, x: f64) -> [f64; 2] {
        let t = (x + END) * PER_SIGMA;
        if t.is_nan() || t <= 0.0 {
            return [0.0, 0.0];
        }
        let i = t as usize;
        let (Some(a), Some(b)) = (self.nodes.get(i), self.nodes.get(i + 1)) else { return [0.0, 1.0] };
        let f = t - i as f64;
        [a[0] + (b[0] - a[0]) * f, a[1] + (b[1] - a[1]) * f]
    }

    /// The image along a trail of half length `l`, and its derivative.
    fn along(&self, s: f64, l: f64, sigma: f64) -> (f64, f64) {
        if l < 0.02 * sigma {
            let value = self.at(s / sigma)[0] / sigma;
            return (value, -s / (sigma * sigma) * value);
        }
        let (a, b) = (self.at((s + l) / sigma), self.at((s - l) / sigma));
        ((a[1] - b[1]) / (2.0 * l), (a[0] - b[0]) / (2.0 * l * sigma))
    }
}

fn sums(plane: Plane, mesh: &Mesh, kernel: &Kernel, place: DVec2, saturate: f64) -> Sums {
    let normal = &kernel.normal;
    let (sigma, half) = (kernel.sigma, kernel.half());
    let (l, e) = (half.length(), half.try_normalize().unwrap_or(DVec2::X));
    let mask = Mask { segment: Segment { centre: place, half }, radius_px: REACH * sigma };
    let reach = half.y.abs() + mask.radius_px;
    let bright = CORE * normal.along(0.0, l, sigma).0 * gauss(0.0, sigma);
    let mut sums = Sums::default();
    for y in (place.y - reach).ceil() as i64..=(place.y + reach).floor() as i64 {
        let (from, to) = mask.chord(y as f64);
        let background = mesh.mean(DVec2::new(0.5 * (from + to), y as f64));
        for x in from.ceil() as i64..=to.floor() as i64 {
            let d = DVec2::new(x as f64, y as f64) - place;
            let (s, a) = (d.dot(e), d.perp_dot(e));
            let ((long, slope), across) = (normal.along(s, l, sigma), normal.at(a / sigma)[0] / sigma);
            let image = long * across;
            let Some(value) = plane.pixel(x, y).map(f64::from) else {
                sums.off += image * image;
                continue;
            };
            sums.saturated |= value >= saturate && image > bright;
            let value = value - background;
            if !value.is_finite() {
                continue;
            }
            sums.square += image * image;
            sums.light += image * value;
            for (sum, derivative) in sums.slopes.iter_mut().zip([slope * across, -a / (sigma * sigma) * image]) {
                sum[0] += derivative * value;
                sum[1] += derivative * image;
                sum[2] += derivative * derivative;
            }
        }
    }
    sums
}

/// The source of `kernel` near `place`, which stays there if it is `blended`; none without pixels.
pub(super) fn measure(
    plane: Plane,
    mesh: &Mesh,
    kernel: &Kernel,
    place: DVec2,
    blended: bool,
    saturate: f64,
) -> Option<Measured> {
    let first = sums(plane, mesh, kernel, place, saturate);
    let flux = first.light / first.square;
    let mut moved = place;
    if !blended && flux > 0.0 {
        let e = kernel.half().try_normalize().unwrap_or(DVec2::X);
        let step = |i: usize| {
            let [light, image, square] = first.slopes[i];
            let limit = LONGEST[i] * kernel.sigma;
            (-(light - flux * image) / (flux * square)).clamp(-limit, limit)
        };
        // (s, a) = (d . e, d x e)
        let change = e * step(0) - e.perp() * step(1);
        if change.is_finite() {
            moved += change;
        }
    }
    let last = sums(plane, mesh, kernel, moved, saturate);
    let unit_error = last.square.sqrt().recip();
    let flux = last.light / last.square;
    let edge = last.off > 0.01 * (last.off + last.square);
    let measured = Measured { place: moved, flux, unit_error, edge, saturated: last.saturated };
    (flux.is_finite() && unit_error.is_finite()).then_some(measured)
}
