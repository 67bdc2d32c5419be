//! The light of any body, exactly: of every face the part that no other face hides, by clipping polygons.
//!
//! A face j hides from face i, along a direction d, the projection along d on the plane of i of what of j lies above that
//! plane. Of closed solids the faces with n_j.d > 0 are enough: whoever looks along d out of a solid, or through it, leaves
//! it by one of them; so solids may touch, pierce or enclose each other, and their union counts. Sheets hide on both sides.
//! The hidden parts along both directions, to the Sun and to the observer, are taken away from the face as polygons in its
//! plane; what is left is the area that is lit and seen.

use super::body::{Body, LEVEL};
use super::cells::Cells;
use super::polygon::{Cover, Polygon, Workspace, uncovered};
use glam::{DVec2, DVec3};

/// A smaller share of a face than this is none.
const CHINK: f64 = 1e-13;
/// Height of the Sun's limb above a plane on which its centre has set \[rad\], about.
const LIMB: f64 = 1e-3;

/// Room for the calculation, used again and again.
#[derive(Debug, Default)]
pub struct Exact {
    towards: [Cells; 2],
    cover: Vec<Cover>,
    work: Workspace,
}

impl Exact {
    /// Light of `body` from the unit vector `sun` to the unit vector `observer`: the sum of `weight` times the area that is lit
    /// and seen \[weight m^2\].
    pub fn flux(&mut self, body: &Body, sun: DVec3, observer: DVec3, weight: &[f64]) -> f64 {
        let mut sum = 0.0;
        let mut lost = 0.0;
        self.visible(body, sun, observer, weight, |face, area| {
            // Neumaier's sum: the order of faces does not matter
            let term = weight[face] * area;
            let next: f64 = sum + term;
            lost += if sum >= term { (sum - next) + term } else { (term - next) + sum };
            sum = next;
        });
        sum + lost
    }

    /// Hand over the area \[m^2\] of each face of weight that is lit by `sun` and seen by `observer`.
    pub fn visible(
        &mut self,
        body: &Body,
        sun: DVec3,
        observer: DVec3,
        weight: &[f64],
        mut hand: impl FnMut(usize, f64),
    ) {
        let directions = [sun, observer];
        for (cells, to) in self.towards.iter_mut().zip(directions) {
            cells.sort(body, to);
        }
        let mut coplanar = body.coplanar.as_slice();
        for (face, weight) in weight.iter().enumerate().take(body.faces.len()) {
            if *weight == 0.0 {
                continue;
            }
            let plane = Plane::of(body, face, sun);
            self.cover.clear();
            while let Some(((owner, other), rest)) = coplanar.split_first() {
                if *other as usize > face {
                    break;
                }
                coplanar = rest;
                if *other as usize == face {
                    self.cover.push(Cover::new(&plane.flat(&body.corners(*owner as usize))));
                }
            }
            let cell = Polygon::new(&plane.flat(&body.corners(face)));
            let bounds = cell.bounds();
            let open = self.towards.iter().zip(directions).all(|(cells, to)| {
                let view = plane.along(to);
                cells.candidates(face, |other| {
                    let Some(hidden) = view.hidden(&body.corners(other)) else { return true };
                    self.cover.push(hidden);
                    // what hides all of the face makes all others idle
                    !hidden.contains(&cell, bounds)
                })
            });
            let share = match (open, self.cover.is_empty()) {
                (false, _) => 0.0,
                (true, true) => 1.0,
                (true, false) => uncovered(&cell, &self.cover, &mut self.work) / cell.area(),
            };
            // round-off between polygons that meet lets no light through
            if share > CHINK {
                hand(face, share * body.areas[face]);
            }
        }
    }
}

/// The plane of a face, on the side of the Sun, with coordinates in units of the body's size.
struct Plane {
    normal: DVec3,
    origin: DVec3,
    axes: (DVec3, DVec3),
    size: f64,
}

impl Plane {
    fn of(body: &Body, face: usize, sun: DVec3) -> Self {
        let outward = body.normals[face];
        let normal = if body.sheet[face] && outward.dot(sun) < 0.0 { -outward } else { outward };
        let axes = normal.any_orthonormal_pair();
        Self { normal, origin: body.corners(face)[0], axes, size: body.size }
    }

    /// Coordinates of points of the plane.
    fn flat(&self, corners: &[DVec3; 3]) -> [DVec2; 3] {
        corners.map(|v| {
            let from = (v - self.origin) / self.size;
            DVec2::new(self.axes.0.dot(from), self.axes.1.dot(from))
        })
    }

    /// The projection along `to`.
    fn along(&self, to: DVec3) -> View<'_> {
        let slope = self.normal.dot(to);
        // of a Sun whose centre has set on the plane the limb still shines
        let slope = if slope > 0.0 { slope } else { LIMB };
        let skew = |axis: DVec3| axis - self.normal * (axis.dot(to) / slope);
        View { plane: self, axes: (skew(self.axes.0), skew(self.axes.1)) }
    }
}

/// A plane looked at along a direction.
struct View<'a> {
    plane: &'a Plane,
    axes: (DVec3, DVec3),
}

impl View<'_> {
    /// What a face hides of the plane: the projection of its part above.
    fn hidden(&self, corners: &[DVec3; 3]) -> Option<Cover> {
        let plane = self.plane;
        let points = corners.map(|v| {
            let from = (v - plane.origin) / plane.size;
            let height = plane.normal.dot(from);
            let height = if height.abs() < LEVEL { 0.0 } else { height };
            DVec3::new(self.axes.0.dot(from), self.axes.1.dot(from), height)
        });
        if points.iter().all(|p| p.z <= 0.0) {
            return None;
        }
        if points.iter().all(|p| p.z >= 0.0) {
            return Some(Cover::new(&points.map(DVec3::truncate)));
        }
        let mut above = [DVec2::ZERO; 4];
        let mut count = 0;
        let mut push = |point: DVec2| {
            if let Some(free) = above.get_mut(count) {
                *free = point;
                count += 1;
            }
        };
        for (k, point) in points.iter().enumerate() {
            let next = points[(k + 1) % 3];
            if point.z >= 0.0 {
                push(point.truncate());
            }
            if point.z * next.z < 0.0 {
                push(point.lerp(next, point.z / (point.z - next.z)).truncate());
            }
        }
        Some(Cover::new(&above[..count]))
    }
}
