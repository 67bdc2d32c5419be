//! The body of given normals at one set of offsets, and Newton's matrix there.

use glam::DVec3;

use super::dissect::dissect;
use super::ldl::{Ldl, Matrix};
use crate::inversion::polytope::dual::{Dual, NONE, Order};
use crate::inversion::polytope::measures::{Measures, centroid, corner, vertices};
use crate::inversion::polytope::plane::Plane;

/// Rounds of putting back facets that a step has lost.
const ROUNDS: usize = 4;

/// Normals and the areas that the body shall have, with sum 1.
#[derive(Debug, Clone)]
pub struct Target {
    /// Unit normals.
    pub normals: Vec<DVec3>,
    /// Areas.
    pub areas: Vec<f64>,
    order: Order,
}

/// A body of the target's normals.
#[derive(Debug, Clone)]
pub struct Body {
    /// Half-spaces.
    pub planes: Vec<Plane>,
    dual: Dual,
    /// Areas, volume, edges.
    pub measures: Measures,
}

impl Target {
    /// The target for area vectors.
    pub fn new(normals: Vec<DVec3>, areas: &[f64]) -> Self {
        let sum: f64 = areas.iter().sum();
        let order = Order::new(&normals);
        Self { normals, areas: areas.iter().map(|a| a / sum).collect(), order }
    }

    /// The largest area.
    pub fn largest(&self) -> f64 {
        self.areas.iter().copied().fold(0.0, f64::max)
    }

    /// The half-spaces of these normals, each at the distance that `offset` gives.
    pub fn planes(&self, offset: impl Fn(usize) -> f64) -> Vec<Plane> {
        self.normals.iter().enumerate().map(|(i, &normal)| Plane::new(normal, offset(i))).collect()
    }

    /// The body of these half-spaces, scaled such that sum a_i h_i = 3, where sum a_i h_i - log V is least along the scale; `None` unless
    /// all offsets are positive and it is bounded.
    pub fn body(&self, planes: Vec<Plane>) -> Option<Body> {
        let support: f64 = self.areas.iter().zip(&planes).map(|(a, plane)| a * plane.offset).sum();
        self.body_of_scale(planes, 3.0 / support)
    }

    /// The body of these half-spaces scaled; `None` unless all offsets are positive and it is bounded.
    pub fn body_of_scale(&self, mut planes: Vec<Plane>, scale: f64) -> Option<Body> {
        planes.iter_mut().for_each(|plane| *plane = plane.scaled(scale));
        if !planes.iter().all(|plane| (1e-30..1e30).contains(&plane.offset)) {
            return None;
        }
        let dual = Dual::new(&planes, &self.order)?;
        let measures = Measures::new(&planes, &dual);
        Some(Body { planes, dual, measures })
    }

    /// The body of these half-spaces with all facets. Where a facet has been lost its plane is moved in until it cuts off the nearest vertex with
    /// the area wanted: near a vertex of three facets that is c depth^2. `near` is a body in which the facets have
    /// neighbours.
    pub fn whole_body(&self, planes: Vec<Plane>, wanted: impl Fn(usize) -> f64, near: &Body) -> Option<Body> {
        let mut body = self.body(planes)?;
        for _ in 0..ROUNDS {
            let lost: Vec<usize> = body.lost().collect();
            if lost.is_empty() {
                return Some(body);
            }
            let mut planes = body.planes.clone();
            for i in lost {
                let beside =
                    near.measures.edges(i).map(|(j, _)| body.measures.seats[j]).find(|&seat| seat != NONE);
                let seat = body.dual.locate(&body.planes, self.normals[i], beside.unwrap_or(0));
                planes[i] = Plane::new(self.normals[i], self.cut(&body, seat, i, wanted(i)));
            }
            body = self.body(planes)?;
        }
        body.is_whole().then_some(body)
    }

    /// Offset at which plane `i` cuts the corner `seat` of `body` with `area` of its surface's share.
    fn cut(&self, body: &Body, seat: u32, i: usize, area: f64) -> f64 {
        let normal = self.normals[i];
        let corners = body.dual.corners[seat as usize];
        let [a, b, c] = corners.map(|c| self.normals[c as usize]);
        // along the three edges, to unit depth below the vertex
        let [p, q, r] = [b.cross(c), c.cross(a), a.cross(b)].map(|along| along / normal.dot(along));
        let unit = 0.5 * normal.dot((q - p).cross(r - p)).abs();
        let depth = (area * body.measures.volume / unit).sqrt();
        let support = normal.dot(corner(&body.planes, corners));
        if depth < 0.5 * support { support - depth } else { 0.5 * support }
    }
}

impl Body {
    /// Facets without area.
    pub fn lost(&self) -> impl Iterator<Item = usize> + '_ {
        self.measures.areas.iter().enumerate().filter(|(_, area)| **area <= 0.0).map(|(i, _)| i)
    }

    /// Whether all facets have area.
    pub fn is_whole(&self) -> bool {
        self.lost().next().is_none()
    }

    /// u_i = A_i / V.
    pub fn shares(&self) -> Vec<f64> {
        self.measures.areas.iter().map(|area| area / self.measures.volume).collect()
    }

    /// Centre of mass.
    pub fn centroid(&self) -> DVec3 {
        centroid(&self.dual, &self.measures, &vertices(&self.planes, &self.dual))
    }

    /// Mean of the vertices.
    pub fn middle(&self) -> DVec3 {
        let vertices = vertices(&self.planes, &self.dual);
        vertices.iter().sum::<DVec3>() / vertices.len().max(1) as f64
    }

    /// Factors of the Hessian u u' - H/V of sum a_i h_i - log V, made regular by a multiple of N N' for its null space, the three
    /// translations. Both are border rows: [-H/V, u, N; u', -1, 0; N', 0, -1].
    pub fn factors(&self) -> Ldl {
        let (m, measures) = (self.planes.len(), &self.measures);
        let per_volume = 1.0 / measures.volume;
        let diagonal: Vec<f64> = (0..m).map(|i| -measures.diagonal(&self.planes, i) * per_volume).collect();
        // comparable with the rest: N'N is about m / 3
        let gauge = (3.0 * per_volume * measures.weights.iter().sum::<f64>()).sqrt() / m as f64;
        let axis = |k: usize| (self.planes.iter().map(|plane| gauge * plane.normal[k]).collect(), -1.0);
        let normals: Vec<DVec3> = self.planes.iter().map(|plane| plane.normal).collect();
        let parts = dissect(&normals, |i| {
            &measures.neighbours[measures.starts[i as usize]..measures.starts[i as usize + 1]]
        });
        let matrix = Matrix {
            starts: &measures.starts,
            neighbours: &measures.neighbours,
            values: measures.weights.iter().map(|w| -w * per_volume).collect(),
            diagonal,
            border: vec![(self.shares(), -1.0), axis(0), axis(1), axis(2)],
        };
        Ldl::new(&matrix, &parts)
    }
}
