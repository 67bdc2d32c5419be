//! Which way to find shadows: the cheapest that is exact enough.
//!
//! What a way costs and how far it errs were measured (docs/accuracy.md); a convex body has no shadows at all. Nothing here
//! looks at a clock: the same scene takes the same way on every machine.

use super::shadow::card::Graphics;
use super::shape::Shape;

/// A way to find the light of a shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Way {
    /// The sum over facets: exact where nothing hides anything.
    Convex,
    /// Clipped polygons: exact.
    Exact,
    /// Rays, as many as bring their error below this share of the unshadowed light.
    Rays {
        /// The share.
        tolerance: f64,
    },
    /// Shadow maps of that many pixels a side on a graphics processor; on its twin if that fails.
    Device {
        /// Pixels.
        side: u32,
    },
}

/// Time of the exact way \[s\] per face, of bodies with many layers.
const EXACT_S: f64 = 5e-6;
/// Time of a point with its two rays \[s\] for each doubling of the faces, and of a face before the first.
const RAY_S: f64 = 4e-8;
const RAY_FACE_S: f64 = 2e-8;
/// Times of a map on a graphics card \[s\] per face, per pixel and per epoch.
const DEVICE_FACE_S: f64 = 2e-9;
const DEVICE_PIXEL_S: f64 = 5e-10;
const DEVICE_EPOCH_S: f64 = 2e-5;
/// Largest map.
const MOST_PIXELS: f64 = 4096.0;

/// Largest error of shadow maps of that many pixels a side, as a share of the unshadowed light.
pub fn map_error(side: u32) -> f64 {
    MAP_ERROR / f64::from(side.max(1))
}

/// Of maps of one pixel: 27 was the worst of six shapes at 40 attitudes, thin panels on edge.
const MAP_ERROR: f64 = 30.0;

/// Pixels a side that bring the error of shadow maps to that share of the light.
fn side_for(tolerance: f64) -> f64 {
    MAP_ERROR / tolerance
}

/// Standard errors of rays that make a bound: all but one in 400 are within.
pub const SIGMAS: f64 = 3.0;

/// Points that bring the error of rays to that share of the light.
fn points_for(tolerance: f64) -> f64 {
    1e3 * (SIGMAS * 1.4e-2 / tolerance).powf(1.0 / 0.72)
}

impl Way {
    /// The cheapest way for `shape` that errs by less than `tolerance` of the light.
    pub fn cheapest(shape: &Shape, tolerance: f64, graphics: &Graphics) -> Self {
        let hardware = graphics.card.as_ref().is_some_and(|card| !card.is_software());
        match (graphics.required, Self::with_device(shape, tolerance, hardware)) {
            (true, way) if way != Self::Convex && graphics.card.is_some() => {
                Self::Device { side: side_for(tolerance).clamp(64.0, MOST_PIXELS) as u32 }
            }
            (_, way) => way,
        }
    }

    /// The cheapest way where there is, or is not, a graphics card.
    pub fn with_device(shape: &Shape, tolerance: f64, device: bool) -> Self {
        if shape.is_convex() {
            return Self::Convex;
        }
        let faces = shape.body.faces.len() as f64;
        let side = side_for(tolerance).max(64.0);
        let ways = [
            (EXACT_S * faces, Self::Exact),
            (points_for(tolerance) * RAY_S * faces.max(2.0).log2() + RAY_FACE_S * faces, Self::Rays { tolerance }),
            (
                DEVICE_EPOCH_S + DEVICE_FACE_S * faces + DEVICE_PIXEL_S * side * side,
                Self::Device { side: side.min(MOST_PIXELS) as u32 },
            ),
        ];
        let usable = |way: &Self| !matches!(way, Self::Device { .. }) || (device && side <= MOST_PIXELS);
        let best = ways.into_iter().filter(|(_, way)| usable(way)).min_by(|a, b| a.0.total_cmp(&b.0));
        best.map_or(Self::Exact, |(_, way)| way)
    }

    /// In words.
    pub fn describe(self) -> String {
        match self {
            Self::Convex => "sum over facets; convex, so that nothing casts a shadow on it".into(),
            Self::Exact => "exact shadows by clipped polygons".into(),
            Self::Rays { tolerance } => format!("shadows by rays to {tolerance:.1e} of the light"),
            Self::Device { side } => format!("shadow maps of {side} px on the graphics processor"),
        }
    }
}
