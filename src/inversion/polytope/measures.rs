//! Areas, volume and their derivatives for {x: n_i.x <= h_i} with given combinatorics.
//!
//! With W_ij = D(i, j, k, m) / (det(i, j, k) det(j, i, m)), where D is the determinant of the rows (n, h) of the two facets i, j of an edge
//! and of the facets k, m at its ends, the edge is the vector W_ij n_i x n_j, and dA_i/dh_j = W_ij, dA_i/dh_i = -sum_j W_ij n_i.n_j
//! (Minkowski 1903, Math. Ann. 57, 447; Klain 2004, Adv. Math. 185, 270, with W_ij = l_ij / sin th_ij). The determinants are taken
//! from differences of rows, and a facet's area from its own edge vectors, so that small facets far from the origin keep
//! their digits.

use glam::DVec3;

use super::dual::{Dual, NONE};
use super::plane::Plane;
use super::predicate::{fine_quadruple, triple};

/// What a polytope's facets measure.
#[derive(Debug, Clone, Default)]
pub struct Measures {
    /// Area of each facet, 0 for those that do not appear.
    pub areas: Vec<f64>,
    /// Volume.
    pub volume: f64,
    /// Neighbours of facet i are `neighbours[starts[i]..starts[i + 1]]`, counter-clockwise from outside.
    pub starts: Vec<usize>,
    /// Facets across the edges.
    pub neighbours: Vec<u32>,
    /// The triangle around each facet at which its edges begin, [`NONE`] for facets that do not appear.
    pub seats: Vec<u32>,
    /// dA_i/dh_j of each edge: its length over the sine of the angle between the normals.
    pub weights: Vec<f64>,
}

impl Measures {
    /// Measures the polytope of unit normals with combinatorics `dual`.
    pub fn new(planes: &[Plane], dual: &Dual) -> Self {
        let sides = side_weights(planes, dual);
        let seats = dual.seats(planes.len());
        let mut measures = Self { starts: vec![0], ..Self::default() };
        let mut six_volumes = 0.0;
        for (facet, (plane, &seat)) in (0_u32..).zip(planes.iter().zip(&seats)) {
            let area = if seat == NONE { 0.0 } else { measures.walk(planes, dual, &sides, facet, seat) };
            six_volumes += 2.0 * area * plane.offset;
            measures.areas.push(area);
            measures.starts.push(measures.neighbours.len());
        }
        measures.volume = six_volumes / 6.0;
        measures.seats = seats;
        measures
    }

    /// Adds the edges of a facet and returns its area.
    fn walk(&mut self, planes: &[Plane], dual: &Dual, sides: &[[f64; 3]], facet: u32, seat: u32) -> f64 {
        let normal = planes[facet as usize].normal;
        let (mut at, mut twice_area) = (DVec3::ZERO, DVec3::ZERO);
        for (t, k) in dual.around(facet, seat) {
            let neighbour = dual.corners[t as usize][(k + 2) % 3];
            let weight = sides[t as usize][(k + 1) % 3];
            let edge = weight * normal.cross(planes[neighbour as usize].normal - normal);
            twice_area += at.cross(edge);
            at += edge;
            self.neighbours.push(neighbour);
            self.weights.push(weight);
        }
        (0.5 * normal.dot(twice_area)).max(0.0)
    }

    /// The edges of `facet`: neighbours and dA/dh.
    pub fn edges(&self, facet: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let range = self.starts[facet]..self.starts[facet + 1];
        self.neighbours[range.clone()].iter().map(|&j| j as usize).zip(self.weights[range].iter().copied())
    }

    /// dA_i/dh_i.
    pub fn diagonal(&self, planes: &[Plane], facet: usize) -> f64 {
        -self.edges(facet).map(|(j, w)| w * planes[facet].normal.dot(planes[j].normal)).sum::<f64>()
    }

    /// H x, with the Hessian H of the volume by the offsets.
    pub fn hessian_times(&self, planes: &[Plane], x: &[f64]) -> Vec<f64> {
        // x_j - cos x_i without the loss of digits between neighbours
        let term = |i: usize, j: usize| {
            let versine = 0.5 * (planes[j].normal - planes[i].normal).length_squared();
            (x[j] - x[i]) + versine * x[i]
        };
        let row = |i: usize| self.edges(i).map(|(j, w)| w * term(i, j)).sum();
        (0..planes.len()).map(row).collect()
    }
}

/// W of the side opposite to each corner of each triangle.
fn side_weights(planes: &[Plane], dual: &Dual) -> Vec<[f64; 3]> {
    let plane = |c: u32| &planes[c as usize];
    let determinant = |c: &[u32; 3]| triple(plane(c[0]).normal, plane(c[1]).normal, plane(c[2]).normal);
    let triples: Vec<f64> = dual.corners.iter().map(determinant).collect();
    let mut sides = vec![[0.0; 3]; dual.corners.len()];
    for (t, corners) in dual.corners.iter().enumerate() {
        for k in 0..3 {
            let beyond = dual.across[t][k] as usize;
            if beyond < t {
                continue;
            }
            let Some(back) = dual.across[beyond].iter().position(|&b| b as usize == t) else { continue };
            let [m, i, j] = [k, k + 1, k + 2].map(|c| plane(corners[c % 3]));
            let value = fine_quadruple([i, j, m, plane(dual.corners[beyond][back])]);
            let weight = (value / (triples[t] * triples[beyond])).max(0.0);
            sides[t][k] = weight;
            sides[beyond][back] = weight;
        }
    }
    sides
}

/// Where the three planes of each triangle meet.
pub fn vertices(planes: &[Plane], dual: &Dual) -> Vec<DVec3> {
    dual.corners.iter().map(|&corners| corner(planes, corners)).collect()
}

/// Where the planes of one triangle meet.
pub fn corner(planes: &[Plane], corners: [u32; 3]) -> DVec3 {
    let [a, b, c] = corners.map(|c| &planes[c as usize]);
    meet(a, b, c)
}

/// The point on three planes, from differences of rows.
fn meet(a: &Plane, b: &Plane, c: &Plane) -> DVec3 {
    let (b_n, c_n) = (b.normal - a.normal, c.normal - a.normal);
    let (b_h, c_h) = (b.above(a), c.above(a));
    let bc = b_n.cross(c_n);
    (bc * a.offset + c_n.cross(a.normal) * b_h + a.normal.cross(b_n) * c_h) / a.normal.dot(bc)
}

/// Centre of mass of a body with these vertices, the origin inside.
pub fn centroid(dual: &Dual, measures: &Measures, vertices: &[DVec3]) -> DVec3 {
    let (mut moment, mut six_volumes) = (DVec3::ZERO, 0.0);
    for (facet, &seat) in (0_u32..).zip(&measures.seats).filter(|(_, seat)| **seat != NONE) {
        let mut corners = dual.around(facet, seat).map(|(t, _)| vertices[t as usize]);
        let Some(first) = corners.next() else { continue };
        let mut before = corners.next().unwrap_or(first);
        for corner in corners {
            let six = first.dot((before - first).cross(corner - first));
            moment += six * (first + before + corner) / 4.0;
            six_volumes += six;
            before = corner;
        }
    }
    moment / six_volumes
}
