//! Points on a polytope's surface and distances to it.

use glam::DVec3;

use super::Polytope;

/// A polytope's facets as polygons, ready for distances.
#[derive(Debug, Clone)]
pub struct Surface<'a> {
    polytope: &'a Polytope,
    facets: Vec<Facet>,
}

#[derive(Debug, Clone)]
struct Facet {
    normal: DVec3,
    offset: f64,
    corners: Vec<DVec3>,
}

impl<'a> Surface<'a> {
    /// The surface of `polytope`.
    pub fn new(polytope: &'a Polytope) -> Self {
        let facet = |i: usize| {
            let corners: Vec<DVec3> =
                polytope.corners_of(i).iter().map(|&v| polytope.vertices[v as usize] - polytope.centre).collect();
            let plane = polytope.planes[i];
            (corners.len() > 2).then_some(Facet { normal: plane.normal, offset: plane.offset, corners })
        };
        Self { polytope, facets: (0..polytope.half_spaces()).filter_map(facet).collect() }
    }

    /// Distance of `point` from the solid body, 0 inside.
    pub fn distance_outside(&self, point: DVec3) -> f64 {
        self.signed_distance(point).max(0.0)
    }

    /// Distance from the surface, negative inside.
    ///
    /// From outside the nearest point lies on a facet that faces the point, and no facet is nearer than its plane.
    pub fn signed_distance(&self, point: DVec3) -> f64 {
        let local = point - self.polytope.centre;
        let heights = self.facets.iter().map(|facet| facet.normal.dot(local) - facet.offset);
        let most = heights.clone().fold(f64::NEG_INFINITY, f64::max);
        if most.is_nan() || most <= 0.0 {
            return most;
        }
        let mut nearest = f64::INFINITY;
        for (facet, height) in self.facets.iter().zip(heights) {
            if height > 0.0 && height < nearest {
                nearest = nearest.min(facet.distance(local, height));
            }
        }
        nearest
    }

    /// `count` points spread evenly over the surface, by an additive sequence in area and the two coordinates of a triangle (Roberts 2018,
    /// "The unreasonable effectiveness of quasirandom sequences", R3).
    pub fn points(&self, count: usize) -> Vec<DVec3> {
        let mut triangles = Vec::new();
        let mut area = 0.0;
        for facet in &self.facets {
            let [first, rest @ ..] = facet.corners.as_slice() else { continue };
            for pair in rest.windows(2) {
                area += 0.5 * (pair[0] - *first).cross(pair[1] - *first).length();
                triangles.push((area, [*first, pair[0], pair[1]]));
            }
        }
        // the root of x^4 = x + 1 gives three sequences that are jointly even
        let root: f64 = 1.220_744_084_605_759_6;
        let part = |k: usize, power: i32| ((k + 1) as f64 * root.powi(-power)).fract();
        let point = |k: usize| {
            let place = triangles.partition_point(|(up_to, _)| *up_to < part(k, 1) * area);
            let (_, [a, b, c]) = triangles.get(place).or(triangles.last())?;
            let (mut u, mut v) = (part(k, 2), part(k, 3));
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            Some(self.polytope.centre + *a + (*b - *a) * u + (*c - *a) * v)
        };
        (0..count).filter_map(point).collect()
    }
}

impl Facet {
    /// Distance from a point `height` above the plane.
    fn distance(&self, point: DVec3, height: f64) -> f64 {
        let foot = point - height * self.normal;
        let mut inside = true;
        let mut square = f64::INFINITY;
        let last = self.corners.last().copied().unwrap_or(DVec3::ZERO);
        let starts = std::iter::once(&last).chain(&self.corners);
        for (&a, &b) in starts.zip(&self.corners) {
            let (edge, ray) = (b - a, foot - a);
            inside &= self.normal.dot(edge.cross(ray)) >= 0.0;
            let along =
                if edge == DVec3::ZERO { 0.0 } else { (ray.dot(edge) / edge.length_squared()).clamp(0.0, 1.0) };
            square = square.min((ray - along * edge).length_squared());
        }
        if inside { height } else { height.hypot(square.sqrt()) }
    }
}
