//! Light of a union of boxes, exactly, with its derivatives.
//!
//! y = sum over faces of w_i A_i with w = f (n.s)(n.o) and A the part of the face outside all that hides it. What a convex part
//! hides of a face along a direction d, to the Sun or to the observer, is one convex polygon: the projection along d on the
//! face's plane of all of the part that lies above that plane. So a union of K boxes needs but 2 (K - 1) polygons a face.
//! Equal to [`crate::object::shadow::exact`] on the same triangles to round-off, which the tests demand.
//!
//! Derivatives are analytic. With the face's plane through p with normal n, a corner v of a part casts its shadow at
//! X = v - d h/(n.d), h = n.(v - p). Where the part pierces the plane, X = v is a point of its edge and d the edge. In both cases
//!
//! ```text
//! dX = dv - d [n.(dv - dp) + dn.(X - p)]/(n.d)
//! ```
//!
//! (its component along n moves no area). The forces dA/dX come from [`super::clip`]; they act on the two parts as force, torque
//! and stretch along their edges.

use super::clip::{Cover, MOST, Polygon, hull, subtract};
use super::part::{PARAMETERS, Part};
use crate::object::matter::{Material, gradient};
use glam::{DVec2, DVec3};

/// Cosines below this are none: the face is seen edge on and sends nothing.
const EDGE_ON: f64 = 1e-9;
/// Heights over a plane below this share of the largest half size are none; of faces in one plane the first counts.
const LEVEL: f64 = 1e-12;
/// Pairs of corners that an edge joins.
const EDGES: [(usize, usize); 12] =
    [(0, 1), (2, 3), (4, 5), (6, 7), (0, 2), (1, 3), (4, 6), (5, 7), (0, 4), (1, 5), (2, 6), (3, 7)];

/// Derivatives of the light with respect to the nine parameters of a part.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Force {
    /// By the centre \[1/m\].
    pub move_by: DVec3,
    /// By turns about the body axes \[1/rad\].
    pub turn_by: DVec3,
    /// By the logarithms of the half sizes.
    pub stretch_by: DVec3,
}

impl Force {
    /// In the order of [`Part::moved`].
    pub fn to_array(self) -> [f64; PARAMETERS] {
        let [a, b, c] = [self.move_by, self.turn_by, self.stretch_by].map(|v| v.to_array());
        [a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2]]
    }

    /// A force at a point that moves, turns and stretches with the part.
    fn act(&mut self, part: &Part, point: DVec3, force: DVec3) {
        let arm = point - part.centre;
        self.move_by += force;
        self.turn_by += arm.cross(force);
        let axes = part.axes.transpose();
        self.stretch_by += (axes * force) * (axes * arm);
    }
}

/// Where a corner of a polygon comes from.
#[derive(Debug, Clone, Copy)]
struct Origin {
    part: usize,
    /// The point of the part.
    point: DVec3,
    /// Its way to the plane; none of the face's own corners.
    along: Option<DVec3>,
}

/// A line through two corners, and the forces on them so far.
#[derive(Debug, Clone, Copy)]
struct Line {
    ends: [(DVec2, Origin); 2],
    forces: [DVec2; 2],
}

/// Room for the calculation, used again and again.
#[derive(Debug, Default)]
pub struct Renderer {
    corners: Vec<[DVec3; 8]>,
    points: Vec<(DVec2, Origin)>,
    outline: Vec<(DVec2, Origin)>,
    lines: Vec<Line>,
    covers: Vec<Cover>,
    pieces: Vec<Polygon>,
    spare: Vec<Polygon>,
}

/// A face of a part.
struct Face {
    part: usize,
    normal: DVec3,
    centre: DVec3,
    axes: (DVec3, DVec3),
    half: DVec2,
}

impl Face {
    fn new(parts: &[Part], part: usize, axis: usize, positive: bool) -> Self {
        let own = &parts[part];
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let (u, v, sign) = if positive { (u, v, 1.0) } else { (v, u, -1.0) };
        let normal = own.axes.col(axis) * sign;
        let centre = own.centre + normal * own.half[axis];
        let axes = (own.axes.col(u), own.axes.col(v));
        Self { part, normal, centre, axes, half: DVec2::new(own.half[u], own.half[v]) }
    }

    fn flat(&self, point: DVec3) -> DVec2 {
        let from = point - self.centre;
        DVec2::new(self.axes.0.dot(from), self.axes.1.dot(from))
    }

    fn raised(&self, flat: DVec2) -> DVec3 {
        self.axes.0 * flat.x + self.axes.1 * flat.y
    }
}

impl Renderer {
    /// Normalised irradiance \[m^2/sr\] of boxes of one material, from the unit vector `sun` to the unit vector `observer`; its
    /// derivatives are written to `forces`, one for each part, if it has room for them.
    pub fn light(
        &mut self,
        parts: &[Part],
        material: &Material,
        (sun, observer): (DVec3, DVec3),
        mut forces: Option<&mut [Force]>,
    ) -> f64 {
        self.corners.clear();
        self.corners.extend(parts.iter().map(|part| std::array::from_fn(|k| part.corner(k))));
        forces = forces.filter(|forces| forces.len() >= parts.len());
        if let Some(forces) = forces.as_deref_mut() {
            forces.fill(Force::default());
        }
        let cosine = sun.dot(observer);
        let mut light = 0.0;
        for (part, own) in parts.iter().enumerate() {
            for axis in 0..3 {
                let (cs, co) = (own.axes.col(axis).dot(sun), own.axes.col(axis).dot(observer));
                // lit on one side and seen from the other
                if cs * co <= 0.0 || cs.abs() < EDGE_ON || co.abs() < EDGE_ON {
                    continue;
                }
                let face = Face::new(parts, part, axis, cs > 0.0);
                let (cs, co) = (cs.abs(), co.abs());
                let area = self.visible(parts, &face, [sun, observer], forces.is_some());
                let Some(forces) = forces.as_deref_mut() else {
                    light += area * material.f(cs, co, cosine) * cs * co;
                    continue;
                };
                let (weight, by_normal) = gradient(material, face.normal, sun, observer);
                light += area * weight;
                self.push(parts, &face, weight, forces);
                if let Some(force) = forces.get_mut(part) {
                    force.turn_by += face.normal.cross(by_normal) * area;
                }
            }
        }
        light
    }

    /// Area of the face that nothing hides along the directions; forces on the lines, if they are wanted.
    fn visible(&mut self, parts: &[Part], face: &Face, directions: [DVec3; 2], forces: bool) -> f64 {
        let cell = Polygon::rectangle(face.half);
        self.lines.clear();
        self.covers.clear();
        let own = |flat: DVec2| {
            let point = face.centre + face.raised(flat);
            (flat, Origin { part: face.part, point, along: None })
        };
        for (a, b, _) in cell.edges() {
            self.lines.push(Line { ends: [own(a), own(b)], forces: [DVec2::ZERO; 2] });
        }
        for other in (0..parts.len()).filter(|&other| other != face.part) {
            let size = parts[other].half.max_element().max(parts[face.part].half.max_element());
            let level = if other < face.part { -LEVEL * size } else { LEVEL * size };
            let heights = self.corners[other].map(|v| face.normal.dot(v - face.centre) - level);
            if heights.iter().all(|h| *h <= 0.0) {
                continue;
            }
            for along in directions {
                self.cast(face, other, &heights, along);
            }
        }
        if self.covers.is_empty() && !forces {
            return cell.area();
        }
        subtract(cell, &self.covers, &mut self.pieces, &mut self.spare);
        let area = self.pieces.iter().map(Polygon::area).sum();
        if forces {
            for (a, b, line) in self.pieces.iter().flat_map(Polygon::edges) {
                if let Some(line) = self.lines.get_mut(usize::from(line)) {
                    line.press(a, b);
                }
            }
        }
        area
    }

    /// What a part hides of a face along a direction.
    fn cast(&mut self, face: &Face, part: usize, heights: &[f64; 8], along: DVec3) {
        let corners = &self.corners[part];
        let slope = face.normal.dot(along);
        self.points.clear();
        for (point, height) in corners.iter().zip(heights).filter(|(_, height)| **height > 0.0) {
            let flat = face.flat(*point - along * (height / slope));
            self.points.push((flat, Origin { part, point: *point, along: Some(along) }));
        }
        for (a, b) in EDGES.into_iter().filter(|&(a, b)| (heights[a] > 0.0) != (heights[b] > 0.0)) {
            let edge = corners[b] - corners[a];
            let point = corners[a] + edge * (heights[a] / (heights[a] - heights[b]));
            self.points.push((face.flat(point), Origin { part, point, along: Some(edge) }));
        }
        let start = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        let (least, most) = self.points.iter().fold(start, |(l, m), (p, _)| (l.min(*p), m.max(*p)));
        let meets = least.cmplt(face.half).all() && most.cmpgt(-face.half).all();
        if !meets || self.lines.len() + MOST > usize::from(u16::MAX) {
            return;
        }
        hull(&mut self.points, &mut self.outline);
        if self.outline.len() < 3 {
            return;
        }
        self.covers.push(Cover::new(self.outline.iter().map(|p| p.0), self.lines.len()));
        let next = self.outline.iter().cycle().skip(1);
        let lines = self.outline.iter().zip(next);
        self.lines.extend(lines.map(|(a, b)| Line { ends: [*a, *b], forces: [DVec2::ZERO; 2] }));
    }

    /// The forces on the lines of a face, times its weight, act on the parts.
    fn push(&self, parts: &[Part], face: &Face, weight: f64, forces: &mut [Force]) {
        for line in &self.lines {
            for ((flat, origin), force) in line.ends.iter().zip(line.forces) {
                if force == DVec2::ZERO {
                    continue;
                }
                let force = face.raised(force) * weight;
                let (Some(part), Some(plane)) = (parts.get(origin.part), parts.get(face.part)) else { continue };
                let Some(along) = origin.along else {
                    forces[origin.part].act(part, origin.point, force);
                    continue;
                };
                let slope = face.normal.dot(along);
                if slope == 0.0 {
                    continue;
                }
                let pull = face.normal * (force.dot(along) / slope);
                forces[origin.part].act(part, origin.point, force - pull);
                let own = &mut forces[face.part];
                own.act(plane, face.centre, pull);
                own.turn_by -= pull.cross(face.raised(*flat));
            }
        }
    }
}

impl Line {
    /// An edge from `a` to `b` of the region, which lies to its left.
    fn press(&mut self, a: DVec2, b: DVec2) {
        let (from, to) = (self.ends[0].0, self.ends[1].0);
        let way = to - from;
        let length = way.length_squared();
        if length <= f64::MIN_POSITIVE {
            return;
        }
        let t = (0.5 * (a + b) - from).dot(way) / length;
        let outwards = DVec2::new(b.y - a.y, a.x - b.x);
        self.forces[0] += outwards * (1.0 - t);
        self.forces[1] += outwards * t;
    }
}
