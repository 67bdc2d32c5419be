//! A body ready for light: triangles with normals and areas. Sun and observer are far away, so that all of a face is lit and
//! seen from the same directions, its BRDF is one number, and the light of the body is
//!
//! ```text
//! y = sum over faces of w_i A_i(s, o)
//! ```
//!
//! with w_i = f_i (n_i.s)+ (n_i.o)+ and A_i the part of the face that nothing hides from the Sun nor from the observer.

use super::polygon::{Polygon, common_area};
use glam::{DVec2, DVec3};

/// Heights above a plane below this share of the body's size count as none.
pub const LEVEL: f64 = 1e-12;

/// Triangles in body axes \[m\].
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Body {
    /// Vertices \[m\].
    pub vertices: Vec<DVec3>,
    /// Corners of each face, anticlockwise seen from outside.
    pub faces: Vec<[u32; 3]>,
    /// Unit normals, outwards; zero of a face without area.
    pub normals: Vec<DVec3>,
    /// Areas \[m^2\].
    pub areas: Vec<f64>,
    /// Whether a face belongs to a part with open edges: a sheet, which has two sides, each lit and seen.
    pub sheet: Vec<bool>,
    /// Faces in the same plane on the same side of matter, that overlap: (owner, other), sorted by other. Where they overlap
    /// the light is the owner's alone.
    pub coplanar: Vec<(u32, u32)>,
    /// Half the diagonal of the box about all vertices \[m\].
    pub size: f64,
}

impl Body {
    /// Of triangles; those that name no vertex are left out, `sheet` tells of each whether it is part of a sheet.
    pub fn new(vertices: Vec<DVec3>, faces: Vec<[u32; 3]>, sheet: Vec<bool>) -> Self {
        let known = |face: &[u32; 3]| face.iter().all(|c| (*c as usize) < vertices.len());
        let (faces, sheet): (Vec<_>, Vec<_>) =
            faces.into_iter().zip(sheet).filter(|(face, _)| known(face)).unzip();
        let mut body = Self { vertices, faces, sheet, ..Self::default() };
        body.measure();
        body.coplanar = coplanar(&body);
        body
    }

    /// The same body with its vertices elsewhere; whole rigid parts were moved.
    pub fn move_to(&mut self, vertices: &[DVec3]) {
        self.vertices.clear();
        self.vertices.extend_from_slice(vertices);
        self.measure();
    }

    fn measure(&mut self) {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for vertex in &self.vertices {
            (low, high) = (low.min(*vertex), high.max(*vertex));
        }
        self.size = if self.vertices.is_empty() { 0.0 } else { 0.5 * (high - low).length() };
        let (vertices, size) = (&self.vertices, self.size);
        let across = |[a, b, c]: &[u32; 3]| {
            let [a, b, c] = [a, b, c].map(|k| vertices[*k as usize] / size);
            (b - a).cross(c - a)
        };
        self.normals.clear();
        self.areas.clear();
        for face in &self.faces {
            let across = across(face);
            self.normals.push(across.normalize_or_zero());
            self.areas.push(0.5 * across.length() * size * size);
        }
    }

    /// The corners of a face \[m\].
    pub fn corners(&self, face: usize) -> [DVec3; 3] {
        self.faces[face].map(|k| self.vertices[k as usize])
    }

    /// Whether no face can ever hide another: one convex solid, or one flat sheet.
    pub fn is_convex(&self) -> bool {
        let level = LEVEL.sqrt() * self.size * 1e-3;
        let mut used = vec![false; self.vertices.len()];
        self.faces.iter().flatten().for_each(|k| used[*k as usize] = true);
        let used = self.vertices.iter().zip(&used).filter(|(_, used)| **used).map(|(v, _)| *v).collect::<Vec<_>>();
        // faces of many a body fail at the first few vertices
        let below = |i: usize| {
            let (normal, at) = (self.normals[i], self.corners(i)[0]);
            let over = |v: &DVec3| normal.dot(*v - at);
            used.iter().all(|v| over(v) <= level && (!self.sheet[i] || over(v) >= -level))
        };
        self.coplanar.is_empty() && (0..self.faces.len()).all(|i| self.areas[i] == 0.0 || below(i))
    }
}

/// Pairs of faces in one plane that overlap: the owner first.
fn coplanar(body: &Body) -> Vec<(u32, u32)> {
    let level = LEVEL * body.size;
    let boxes = (0..body.faces.len())
        .map(|i| {
            let [a, b, c] = body.corners(i);
            (a.min(b).min(c), a.max(b).max(c))
        })
        .collect::<Vec<_>>();
    let (low, high) =
        boxes.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), b| (l.min(b.0), h.max(b.1)));
    let spread = high - low;
    let axis = if spread.x >= spread.y && spread.x >= spread.z { 0 } else { 1 + usize::from(spread.z > spread.y) };
    let mut order = (0..body.faces.len()).filter(|i| body.areas[*i] > 0.0).collect::<Vec<_>>();
    order.sort_by(|i, k| boxes[*i].0[axis].total_cmp(&boxes[*k].0[axis]));
    let mut pairs = Vec::new();
    for (at, i) in order.iter().enumerate() {
        let (own_low, own_high) = boxes[*i];
        for k in &order[at + 1..] {
            let (other_low, other_high) = boxes[*k];
            if other_low[axis] > own_high[axis] {
                break;
            }
            let meet = own_low.cmple(other_high + level).all() && other_low.cmple(own_high + level).all();
            if meet && lie_on_one_another(body, *i, *k, level) {
                // a sheet lies on top of a solid; of two alike the first counts
                let rank = |face: usize| (!body.sheet[face], face);
                let (owner, other) = if rank(*i) < rank(*k) { (*i, *k) } else { (*k, *i) };
                pairs.push((owner as u32, other as u32));
            }
        }
    }
    pairs.sort_by_key(|(owner, other)| (*other, *owner));
    pairs
}

fn lie_on_one_another(body: &Body, i: usize, k: usize, level: f64) -> bool {
    let (normal, other) = (body.normals[i], body.normals[k]);
    let facing = normal.dot(other);
    let two_sided = body.sheet[i] || body.sheet[k];
    if facing.abs() < 0.5 || (facing < 0.0 && !two_sided) {
        return false;
    }
    let (corners, others) = (body.corners(i), body.corners(k));
    if others.iter().any(|v| normal.dot(*v - corners[0]).abs() > level) {
        return false;
    }
    let (e, g) = normal.any_orthonormal_pair();
    let flat = |corners: [DVec3; 3]| {
        Polygon::new(
            &corners.map(|v| DVec2::new(e.dot(v - body.vertices[0]), g.dot(v - body.vertices[0])) / body.size),
        )
    };
    let (one, two): (Polygon, Polygon) = (flat(corners), flat(others));
    common_area(&one, &two) > LEVEL * one.area().min(two.area())
}
