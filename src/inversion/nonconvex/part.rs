//! A part of an assembly: a box with free centre, attitude and size; a panel is a thin one.
//!
//! Its nine parameters are three moves of the centre along the body axes \[m\], three turns about the body axes \[rad\] and the
//! logarithms of its three half sizes, so that every real number is allowed.

use glam::{DMat3, DQuat, DVec3};

/// Parameters of a part.
pub const PARAMETERS: usize = 9;
/// A box thinner than this share of its middle size is a panel.
const THIN: f64 = 0.2;

/// A box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Part {
    /// Centre \[m, body axes\].
    pub centre: DVec3,
    /// Unit vectors along its edges, as columns; right-handed.
    pub axes: DMat3,
    /// Half its edges \[m\], > 0.
    pub half: DVec3,
}

/// A triangle \[m\], anticlockwise seen from outside.
pub type Triangle = [DVec3; 3];

impl Part {
    /// The corner whose number has a bit for each axis: set where it lies on the positive side.
    pub fn corner(&self, number: usize) -> DVec3 {
        let side = |axis: usize| if number >> axis & 1 == 1 { 1.0 } else { -1.0 };
        self.centre + self.axes * (DVec3::new(side(0), side(1), side(2)) * self.half)
    }

    /// Volume \[m^3\].
    pub fn volume(&self) -> f64 {
        8.0 * self.half.element_product()
    }

    /// The axis along which it is thinnest.
    pub fn thin_axis(&self) -> usize {
        let [x, y, z] = self.half.to_array();
        if x <= y && x <= z { 0 } else { 1 + usize::from(z < y) }
    }

    /// Whether it is thin enough to be a panel.
    pub fn is_panel(&self) -> bool {
        let axis = self.thin_axis();
        let others = self.half[(axis + 1) % 3].min(self.half[(axis + 2) % 3]);
        self.half[axis] < THIN * others
    }

    /// Normal of its largest side, and that side's area \[m^2\].
    pub fn side(&self) -> (DVec3, f64) {
        let axis = self.thin_axis();
        (self.axes.col(axis), 4.0 * self.half[(axis + 1) % 3] * self.half[(axis + 2) % 3])
    }

    /// Whether a point is inside.
    pub fn holds(&self, point: DVec3) -> bool {
        (self.axes.transpose() * (point - self.centre)).abs().cmple(self.half).all()
    }

    /// The smallest box of the same attitude around it and another.
    #[must_use]
    pub fn around(&self, other: &Self) -> Self {
        let corners = (0..8).flat_map(|k| [self.corner(k), other.corner(k)]).map(|v| self.axes.transpose() * v);
        let start = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (low, high) = corners.fold(start, |(l, h), v| (l.min(v), h.max(v)));
        Self { centre: self.axes * (0.5 * (low + high)), axes: self.axes, half: 0.5 * (high - low) }
    }

    /// Moved by its nine parameters.
    #[must_use]
    pub fn moved(&self, step: &[f64; PARAMETERS]) -> Self {
        let [x, y, z, a, b, c, p, q, r] = *step;
        let axes = DMat3::from_quat(DQuat::from_scaled_axis(DVec3::new(a, b, c))) * self.axes;
        // rounding must not add up over many moves
        let first = axes.x_axis.normalize();
        let second = (axes.y_axis - first * first.dot(axes.y_axis)).normalize();
        Self {
            centre: self.centre + DVec3::new(x, y, z),
            axes: DMat3::from_cols(first, second, first.cross(second)),
            half: self.half * DVec3::new(libm::exp(p), libm::exp(q), libm::exp(r)),
        }
    }

    /// The image in a plane through `point` with unit normal `normal`.
    #[must_use]
    pub fn mirrored(&self, point: DVec3, normal: DVec3) -> Self {
        let flip = |v: DVec3| v - normal * (2.0 * normal.dot(v));
        let [x, y] = [flip(self.axes.x_axis), flip(self.axes.y_axis)];
        Self { centre: point + flip(self.centre - point), axes: DMat3::from_cols(x, y, x.cross(y)), ..*self }
    }

    /// Its surface: numbers of corners, as [`Part::corner`] takes them, anticlockwise seen from outside.
    pub fn faces() -> [[usize; 3]; 12] {
        let mut out = [[0; 3]; 12];
        for (number, pair) in out.chunks_exact_mut(2).enumerate() {
            let (axis, positive) = (number / 2, number % 2);
            let (u, v) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
            let base = positive << axis;
            let (u, v) = if positive == 1 { (u, v) } else { (v, u) };
            let [a, b, c, d] = [base, base | u, base | u | v, base | v];
            pair.copy_from_slice(&[[a, b, c], [a, c, d]]);
        }
        out
    }

    /// Its surface.
    pub fn triangles(&self) -> [Triangle; 12] {
        Self::faces().map(|face| face.map(|k| self.corner(k)))
    }
}
