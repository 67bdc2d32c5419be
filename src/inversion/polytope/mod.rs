//! Convex polytopes from half-spaces: {x: n_i.x <= h_i}.
//!
//! The combinatorics come from the convex hull of the dual points with exact decisions (`dual`), the measures from determinants of
//! neighbouring planes (`measures`). Redundant half-spaces are allowed and get area 0; non-simple vertices (octahedron) become
//! several vertices at one place, joined by edges of no length, which [`Polytope::mesh`] merges.

pub mod compare;
pub(super) mod dual;
mod interior;
pub(super) mod measures;
mod mesh;
pub(super) mod plane;
mod predicate;
pub mod surface;

pub use mesh::Mesh;

use dual::{Dual, NONE, Order};
use glam::DVec3;
use measures::Measures;
use plane::Plane;

/// Largest ratio of sizes, and largest size, that the exact decisions bear.
const MOST: f64 = 1e50;

/// Why half-spaces do not make a polytope.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Fault {
    /// As many offsets as normals are needed.
    #[error("{normals} normals but {offsets} offsets; each half-space has one of both")]
    Lengths {
        /// Normals given.
        normals: usize,
        /// Offsets given.
        offsets: usize,
    },
    /// Too many half-spaces to number.
    #[error("{0} half-spaces; at most 2^30 can be numbered")]
    TooMany(usize),
    /// A normal without direction.
    #[error("normal {index} is {value}; its length must be between 1e-50 and 1e50")]
    Normal {
        /// Place of the normal.
        index: usize,
        /// The normal.
        value: DVec3,
    },
    /// An offset without meaning.
    #[error("offset {index} is {value}; its magnitude must be below 1e50")]
    Offset {
        /// Place of the offset.
        index: usize,
        /// The offset over the length of its normal.
        value: f64,
    },
    /// The normals leave a direction free.
    #[error("the polytope is unbounded: the normals do not surround the origin, they lie in a closed half-space")]
    Unbounded,
    /// Nothing is inside all half-spaces.
    #[error(
        "the half-spaces have no common interior: the largest ball inside them has radius {radius}, which must exceed {least}"
    )]
    Empty {
        /// Radius of the largest ball, negative if it lies outside.
        radius: f64,
        /// Least radius told apart from rounding.
        least: f64,
    },
}

/// An edge of a polytope.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edge {
    /// The facets it joins.
    pub facets: [u32; 2],
    /// The vertices at its ends.
    pub vertices: [u32; 2],
    /// Its length, in the unit of the offsets.
    pub length: f64,
}

/// A bounded convex body with interior, from half-spaces.
#[derive(Debug, Clone)]
pub struct Polytope {
    /// Offsets about the caller's origin.
    offsets: Vec<f64>,
    /// A point inside, the origin of `planes`.
    centre: DVec3,
    planes: Vec<Plane>,
    dual: Dual,
    measures: Measures,
    vertices: Vec<DVec3>,
}

impl Polytope {
    /// The polytope {x: n_i.x <= h_i}. Normals need not have unit length; the offsets are distances times that length, in any unit of
    /// length. The origin may lie anywhere.
    ///
    /// # Errors
    /// [`Fault`] for lengths that differ, values out of range, unbounded or empty polytopes.
    pub fn new(normals: &[DVec3], offsets: &[f64]) -> Result<Self, Fault> {
        Self::from_planes(checked(normals, offsets)?)
    }

    /// The polytope of half-spaces with unit normals.
    pub(super) fn from_planes(mut planes: Vec<Plane>) -> Result<Self, Fault> {
        let offsets: Vec<f64> = planes.iter().map(|plane| plane.offset).collect();
        let order = Order::new(&planes.iter().map(|plane| plane.normal).collect::<Vec<_>>());
        let centre = if offsets.iter().all(|&h| h > 1.0 / MOST) {
            DVec3::ZERO
        } else {
            let round: Vec<Plane> = planes.iter().map(|plane| Plane::new(plane.normal, 1.0)).collect();
            Dual::new(&round, &order).ok_or(Fault::Unbounded)?;
            interior::centre(&planes)?
        };
        planes.iter_mut().for_each(|plane| *plane = plane.translated(-centre));
        let dual = Dual::new(&planes, &order).ok_or(Fault::Unbounded)?;
        let measures = Measures::new(&planes, &dual);
        let vertices = measures::vertices(&planes, &dual).into_iter().map(|v| v + centre).collect();
        Ok(Self { offsets, centre, planes, dual, measures, vertices })
    }

    /// Number of half-spaces, redundant ones included.
    pub fn half_spaces(&self) -> usize {
        self.planes.len()
    }

    /// Unit outward normals.
    pub fn normals(&self) -> impl Iterator<Item = DVec3> + '_ {
        self.planes.iter().map(|plane| plane.normal)
    }

    /// Distances of the planes from the origin along the unit normals.
    pub fn offsets(&self) -> &[f64] {
        &self.offsets
    }

    /// Areas of the facets, 0 for redundant half-spaces.
    pub fn areas(&self) -> &[f64] {
        &self.measures.areas
    }

    /// Area of the surface.
    pub fn area(&self) -> f64 {
        self.measures.areas.iter().sum()
    }

    /// Volume.
    pub fn volume(&self) -> f64 {
        self.measures.volume
    }

    /// H x with the Hessian H of the volume by the offsets (the derivative of the areas), where `x` has a number for each half-space; those
    /// left out are 0.
    pub fn hessian_times(&self, x: &[f64]) -> Vec<f64> {
        let mut x = x.to_vec();
        x.resize(self.half_spaces(), 0.0);
        self.measures.hessian_times(&self.planes, &x)
    }

    /// Vertices; those of non-simple corners appear several times.
    pub fn vertices(&self) -> &[DVec3] {
        &self.vertices
    }

    /// Edges, those of no length at non-simple vertices included.
    pub fn edges(&self) -> Vec<Edge> {
        let mut edges = Vec::with_capacity(self.dual.corners.len() * 3 / 2);
        for (facet, plane) in self.planes.iter().enumerate() {
            let seats = self.corners_of(facet);
            for (k, (other, weight)) in self.measures.edges(facet).enumerate() {
                if other < facet {
                    continue;
                }
                let ends = [seats[k], seats[(k + 1) % seats.len()]];
                let sine = plane.normal.cross(self.planes[other].normal - plane.normal).length();
                edges.push(Edge { facets: [facet as u32, other as u32], vertices: ends, length: weight * sine });
            }
        }
        edges
    }

    /// Vertices of a facet, counter-clockwise from outside; none for a redundant half-space.
    pub fn corners_of(&self, facet: usize) -> Vec<u32> {
        match self.measures.seats.get(facet) {
            Some(&seat) if seat != NONE => self.dual.around(facet as u32, seat).map(|(t, _)| t).collect(),
            _ => Vec::new(),
        }
    }

    /// Centre of mass of the homogeneous body.
    pub fn centroid(&self) -> DVec3 {
        self.centre + measures::centroid(&self.dual, &self.measures, &measures::vertices(&self.planes, &self.dual))
    }

    /// Corners of the smallest box along the axes around the body.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        let start = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        self.vertices.iter().fold(start, |(low, high), &v| (low.min(v), high.max(v)))
    }

    /// Diagonal of [`Polytope::bounds`].
    pub fn diagonal(&self) -> f64 {
        let (low, high) = self.bounds();
        (high - low).length()
    }

    /// Largest n_i.x - h_i: how far `point` lies beyond a plane, negative inside.
    pub fn excess(&self, point: DVec3) -> f64 {
        let local = point - self.centre;
        self.planes.iter().fold(f64::NEG_INFINITY, |most, plane| most.max(plane.normal.dot(local) - plane.offset))
    }

    /// The same body moved by `by`.
    #[must_use]
    pub fn translated(mut self, by: DVec3) -> Self {
        self.centre += by;
        self.vertices.iter_mut().for_each(|v| *v += by);
        let normals = self.planes.iter().map(|plane| plane.normal);
        self.offsets.iter_mut().zip(normals).for_each(|(h, n)| *h += n.dot(by));
        self
    }
}

/// Unit normals with their offsets, very small components set to zero.
fn checked(normals: &[DVec3], offsets: &[f64]) -> Result<Vec<Plane>, Fault> {
    if normals.len() != offsets.len() {
        return Err(Fault::Lengths { normals: normals.len(), offsets: offsets.len() });
    }
    if normals.len() >= 1 << 30 {
        return Err(Fault::TooMany(normals.len()));
    }
    let plane = |(index, (&value, &offset)): (usize, (&DVec3, &f64))| {
        // scaled first: the square of a length may leave the range of numbers
        let size = value.abs().max_element();
        if !(1.0 / MOST..MOST).contains(&size) || !value.is_finite() {
            return Err(Fault::Normal { index, value });
        }
        let length = (value / size).length() * size;
        let offset = offset / length;
        if offset.is_nan() || offset.abs() >= MOST {
            return Err(Fault::Offset { index, value: offset });
        }
        let tidy = |x: f64| if x.abs() < 1e-60 { 0.0 } else { x };
        let normal = (value / length).to_array().map(tidy);
        Ok(Plane::new(DVec3::from_array(normal), tidy(offset)))
    };
    normals.iter().zip(offsets).enumerate().map(plane).collect()
}

#[cfg(test)]
mod polytope_tests;
