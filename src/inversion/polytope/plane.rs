//! Half-spaces whose offsets are the sum of two numbers.
//!
//! An area changes by dh / sin(angle) times a length when a plane moves by dh. On a body of many facets, or of nearly parallel ones, one
//! rounding of an offset would show in the areas; a second number takes it (Dekker 1971, Numer. Math. 18, 224).

use glam::DVec3;

/// A half-space n.x <= h.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// Outward normal.
    pub normal: DVec3,
    /// Distance of the plane from the origin along the normal.
    pub offset: f64,
    /// What rounding took from the offset.
    pub tail: f64,
}

impl Plane {
    /// The half-space of a unit normal and an offset.
    pub fn new(normal: DVec3, offset: f64) -> Self {
        Self { normal, offset, tail: 0.0 }
    }

    /// The plane moved outward.
    #[must_use]
    pub fn moved(self, by: f64) -> Self {
        let (sum, error) = exact_sum(self.offset, by);
        let (offset, tail) = exact_sum(sum, error + self.tail);
        Self { offset, tail, ..self }
    }

    /// The plane with its offset multiplied.
    #[must_use]
    pub fn scaled(self, factor: f64) -> Self {
        let product = self.offset * factor;
        let error = self.offset.mul_add(factor, -product);
        let (offset, tail) = exact_sum(product, error + self.tail * factor);
        Self { offset, tail, ..self }
    }

    /// The half-space of the body moved by `by`.
    #[must_use]
    pub fn translated(self, by: DVec3) -> Self {
        let along = |plane: Self, (n, d): (f64, f64)| {
            let product = n * d;
            plane.moved(product).moved(n.mul_add(d, -product))
        };
        self.normal.to_array().into_iter().zip(by.to_array()).fold(self, along)
    }

    /// Difference of the offsets.
    #[inline(always)]
    pub fn above(&self, other: &Self) -> f64 {
        (self.offset - other.offset) + (self.tail - other.tail)
    }
}

/// The rounded sum and its error (Knuth).
#[inline(always)]
pub fn exact_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let shadow = sum - a;
    (sum, (a - (sum - shadow)) + (b - shadow))
}
