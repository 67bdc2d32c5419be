//! A body in units of its own size, and the orthographic frame around it along one direction. Both twins of the shadow
//! maps, on the CPU and on the GPU, take their numbers from here.

use super::body::Body;
use glam::{DVec2, DVec3};

/// Shortest side of a frame \[bounding radii\]: a plate seen on its edge still has pixels of some size.
const LEAST_EXTENT: f64 = 1e-3;

/// Step in height between faces that overlap in one plane \[bounding radii\]: above the rounding of an f32 depth, 2e-7, and
/// below all that is seen of a body.
const LAYER: f32 = 4e-6;

/// A body moved to its middle and scaled to the radius 1, so that f32 depths and positions fit bodies of every size.
#[derive(Debug, Clone, Default)]
pub(super) struct Scaled {
    /// Vertices \[radii\].
    pub points: Vec<DVec3>,
    /// n.x of each face's plane \[radii\]; NaN for a face that cannot be drawn.
    pub offset: Vec<f64>,
    /// How far each face is drawn below its plane \[radii\], so that the owner of an overlap is in front.
    pub sunk: Vec<f32>,
    /// Bounding radius \[m\].
    pub radius: f64,
}

impl Scaled {
    /// Takes on the form of `body`. False if it has no extent to draw.
    pub fn set(&mut self, body: &Body) -> bool {
        let finite = || body.vertices.iter().filter(|p| p.is_finite());
        let low = finite().copied().fold(DVec3::INFINITY, DVec3::min);
        let high = finite().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
        let middle = 0.5 * low + 0.5 * high;
        self.radius = finite().map(|p| (*p - middle).length()).fold(0.0, f64::max);
        if !(self.radius.is_normal() && middle.is_finite()) {
            return false;
        }
        self.points.clear();
        self.points.extend(body.vertices.iter().map(|p| (*p - middle) / self.radius));
        self.offset.clear();
        for i in 0..body.faces.len() {
            self.offset.push(self.plane(body, i).unwrap_or(f64::NAN));
        }
        // sorted by other, so that an owner has its layer before what it hides
        self.sunk.clear();
        self.sunk.resize(body.faces.len(), 0.0);
        for &(owner, other) in &body.coplanar {
            let above = self.sunk.get(owner as usize).copied().unwrap_or(0.0);
            if let Some(sunk) = self.sunk.get_mut(other as usize) {
                *sunk = sunk.max(above + LAYER);
            }
        }
        true
    }

    fn plane(&self, body: &Body, i: usize) -> Option<f64> {
        let normal = body.normals.get(i).filter(|n| n.is_normalized())?;
        let corners = self.corners(body, i)?;
        Some(normal.dot((corners[0] + corners[1] + corners[2]) / 3.0))
    }

    /// Corners of face `i` \[radii\], if there are such and all are finite.
    pub fn corners(&self, body: &Body, i: usize) -> Option<[DVec3; 3]> {
        let [a, b, c] = *body.faces.get(i)?;
        let corner = |v: u32| self.points.get(v as usize).copied().filter(|p| p.is_finite());
        Some([corner(a)?, corner(b)?, corner(c)?])
    }
}

/// Pixels of an image of the body: square in number, fitted to its outline in both directions.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frame {
    /// Unit vector towards the eye.
    pub eye: DVec3,
    /// One pixel to the right and one down \[radii\].
    pub step: [DVec3; 2],
    /// Gradients of the column and the row \[px/radius\].
    pub gradient: [DVec3; 2],
    /// Pixel coordinates of the body's middle; pixel (c, r) covers c..c+1, r..r+1.
    pub origin: DVec2,
    /// Pixels a side.
    pub side: u32,
}

impl Frame {
    /// The frame for the axes `right` and `down`, unit and perpendicular to `eye`.
    fn new(points: &[DVec3], eye: DVec3, [right, down]: [DVec3; 2], square: bool, side: u32) -> Self {
        let mut low = DVec2::INFINITY;
        let mut high = DVec2::NEG_INFINITY;
        for point in points.iter().filter(|p| p.is_finite()) {
            let seen = DVec2::new(point.dot(right), point.dot(down));
            (low, high) = (low.min(seen), high.max(seen));
        }
        let fitted = (high - low).max(DVec2::splat(LEAST_EXTENT));
        let extent = if square { DVec2::splat(fitted.max_element()) } else { fitted };
        let pixel = extent / f64::from(side);
        Self {
            eye,
            step: [right * pixel.x, down * pixel.y],
            gradient: [right / pixel.x, down / pixel.y],
            origin: (0.5 * extent - 0.5 * (low + high)) / pixel,
            side,
        }
    }

    /// The frame that fits best. Its axes are at random to the body's, whose edges would else run along rows of pixels.
    pub fn fitted(body: &Scaled, eye: DVec3, side: u32) -> Self {
        let (right, down) = eye.any_orthonormal_pair();
        Self::new(&body.points, eye, [right, down], false, side)
    }

    /// The frame with square pixels and `up` (body axes) upwards.
    pub fn upright(body: &Scaled, eye: DVec3, up: DVec3, side: u32) -> Self {
        let right = up.cross(eye).normalize_or(eye.any_orthonormal_vector());
        Self::new(&body.points, eye, [right, right.cross(eye)], true, side)
    }

    /// Pixel coordinates of a point \[radii\].
    pub fn pixel(&self, point: DVec3) -> DVec2 {
        DVec2::new(self.gradient[0].dot(point), self.gradient[1].dot(point)) + self.origin
    }

    /// Area of a pixel \[radii^2\].
    pub fn pixel_area(&self) -> f64 {
        self.step[0].length() * self.step[1].length()
    }
}

/// A body, where the Sun stands and who looks.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scene<'a> {
    pub body: &'a Body,
    pub scaled: &'a Scaled,
    pub sun: Frame,
    pub view: Frame,
}

impl Scene<'_> {
    /// Whether the eye of `frame` can see face `i`: the faces of a solid turned away are behind those turned to the eye.
    pub fn shows(&self, i: usize, frame: &Frame) -> bool {
        let towards = self.body.normals.get(i).map_or(0.0, |n| n.dot(frame.eye));
        towards > 0.0 || towards < 0.0 && self.is_sheet(i)
    }

    /// Whether the Sun stands on the side of face `i` that the observer sees.
    pub fn sunward(&self, i: usize) -> bool {
        let normal = self.body.normals.get(i).copied().unwrap_or_default();
        let (sun, view) = (normal.dot(self.sun.eye), normal.dot(self.view.eye));
        sun > 0.0 && view > 0.0 || sun < 0.0 && view < 0.0 && self.is_sheet(i)
    }

    /// Light of face `i` per seen area, w/(n.o); 0 where there is none or `weight` is no number above 0.
    pub fn glow(&self, i: usize, weight: &[f64]) -> f64 {
        let normal = self.body.normals.get(i).copied().unwrap_or_default();
        let glow = weight.get(i).copied().unwrap_or(0.0) / normal.dot(self.view.eye).abs();
        if glow > 0.0 && glow.is_finite() && self.sunward(i) { glow } else { 0.0 }
    }

    fn is_sheet(&self, i: usize) -> bool {
        self.body.sheet.get(i).copied().unwrap_or(false)
    }
}
