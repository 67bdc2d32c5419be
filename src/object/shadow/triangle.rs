//! One ray, one triangle. All rays of a call share a direction, so that what depends on it is worked out once.

use super::body::Body;
use glam::{DVec2, DVec3};

/// A direction of many rays: towards the Sun or the observer.
#[derive(Debug, Clone, Copy)]
pub struct Direction {
    /// The two axes across the direction; right-handed with it.
    across: [DVec3; 2],
    /// One over each component; large and finite for those that are zero, so that no product is NaN.
    inverse: DVec3,
}

impl Direction {
    /// Prepare the unit vector `d`. Nothing is hit along a direction that is zero or not finite.
    #[must_use]
    pub fn new(d: DVec3) -> Self {
        let (x, y) = d.any_orthonormal_pair();
        let invert = |x: f64| if x.abs() > 1e-300 { 1.0 / x } else { 1e300 };
        Self { across: [x, y], inverse: DVec3::new(invert(d.x), invert(d.y), invert(d.z)) }
    }

    /// Whether the ray from `p` \[m\] meets the box from `lo` to `hi` \[m\]. A box must be a little larger than what it
    /// holds, 1e-14 of the body's size, as the slopes are rounded.
    #[inline]
    pub(super) fn meets(&self, p: DVec3, lo: DVec3, hi: DVec3) -> bool {
        let (a, b) = ((lo - p) * self.inverse, (hi - p) * self.inverse);
        let (enter, leave) = (a.min(b), a.max(b));
        enter.max_element().max(0.0) <= leave.min_element()
    }

    /// Place of `v` seen along the direction.
    #[inline]
    fn flat(&self, v: DVec3) -> DVec2 {
        DVec2::new(self.across[0].dot(v), self.across[1].dot(v))
    }
}

/// Where a ray starts: a point of a face.
#[derive(Debug, Clone, Copy)]
pub struct Start {
    /// The point \[m\].
    pub point: DVec3,
    /// Unit normal of the face, on the side the ray leaves to.
    pub up: DVec3,
    /// The face, which does not block its own rays; `u32::MAX` for none.
    pub face: u32,
}

/// A face, with all that a ray needs of it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Triangle {
    /// Corners \[m\], anticlockwise seen from outside.
    pub corners: [DVec3; 3],
    /// Its number in the body.
    pub face: u32,
    /// Blocks rays of either side.
    pub sheet: bool,
}

impl Triangle {
    /// A face of the body, if its corners are there and finite.
    pub fn of(body: &Body, face: u32) -> Option<Self> {
        let [a, b, c] = body.faces.get(face as usize)?.map(|v| body.vertices.get(v as usize));
        let corners = [*a?, *b?, *c?];
        let sheet = body.sheet.get(face as usize).is_some_and(|&s| s);
        corners.iter().all(|v| v.is_finite()).then_some(Self { corners, face, sheet })
    }

    /// Whether the face blocks the ray from `start` higher than `least` \[m\] above the plane of the start.
    ///
    /// A solid blocks where the ray leaves it, a sheet wherever it is met. The edges belong to the face. An edge function
    /// is a difference of two rounded products of the same numbers for both faces at the edge: it has the exact sign or is
    /// zero, so that no ray gets through between them (Woop, Benthin and Wald 2013, JCGT 2(1), 65).
    ///
    /// The height is weighted from the heights of the corners: a face that is nowhere above the plane never blocks,
    /// however grazing the ray.
    #[inline]
    pub fn blocks(&self, toward: &Direction, start: &Start, least: f64) -> bool {
        let [a, b, c] = self.corners.map(|v| v - start.point);
        let [fa, fb, fc] = [a, b, c].map(|v| toward.flat(v));
        let (u, v, w) = (fb.perp_dot(fc), fc.perp_dot(fa), fa.perp_dot(fb));
        let leaves = u >= 0.0 && v >= 0.0 && w >= 0.0;
        let enters = self.sheet && u <= 0.0 && v <= 0.0 && w <= 0.0;
        if !(leaves || enters) || self.face == start.face {
            return false;
        }
        // edge on, the sum is zero and the height NaN: nothing is hit
        let height = (u * start.up.dot(a) + v * start.up.dot(b) + w * start.up.dot(c)) / (u + v + w);
        height > least
    }

    /// The point at (x, y) of the unit square, which is mapped on the face with equal areas \[m\].
    #[inline]
    pub fn point(&self, x: f64, y: f64) -> DVec3 {
        let [a, b, c] = self.corners;
        a + x.sqrt() * ((b - a) + y * (c - b))
    }

    /// Whether `p` \[m\], in the plane of the face with this normal, is inside it.
    pub fn holds(&self, p: DVec3, normal: DVec3) -> bool {
        let [a, b, c] = self.corners;
        [(a, b), (b, c), (c, a)].into_iter().all(|(a, b)| normal.dot((b - a).cross(p - a)) >= 0.0)
    }

    /// Whether a corner is higher than `least` \[m\] above the plane through `point` with normal `up`.
    #[inline]
    pub fn above(&self, point: DVec3, up: DVec3, least: f64) -> bool {
        self.corners.iter().any(|&v| up.dot(v - point) > least)
    }
}
