//! How much two convex bodies differ.

use glam::DVec3;

use super::surface::Surface;
use super::{Fault, Polytope};

/// Volume common to two bodies, exact but for rounding: that of the polytope of all half-spaces of both.
///
/// # Errors
/// [`Fault`] as of [`Polytope::new`], which two polytopes do not give in practice; bodies that do not overlap have 0 in common.
pub fn common_volume(a: &Polytope, b: &Polytope) -> Result<f64, Fault> {
    let shift = a.centre;
    let normals: Vec<DVec3> = a.normals().chain(b.normals()).collect();
    let rows =
        a.planes.iter().map(|plane| (plane, a.centre)).chain(b.planes.iter().map(|plane| (plane, b.centre)));
    let offsets: Vec<f64> = rows.map(|(plane, centre)| plane.offset + plane.normal.dot(centre - shift)).collect();
    match Polytope::new(&normals, &offsets) {
        Ok(common) => Ok(common.volume()),
        Err(Fault::Empty { .. }) => Ok(0.0),
        Err(fault) => Err(fault),
    }
}

/// Intersection over union of two bodies where they stand.
///
/// # Errors
/// As [`common_volume`].
pub fn intersection_over_union(a: &Polytope, b: &Polytope) -> Result<f64, Fault> {
    let common = common_volume(a, b)?;
    Ok(common / (a.volume() + b.volume() - common))
}

/// `b` moved so that its centroid is that of `a`.
pub fn aligned(a: &Polytope, b: Polytope) -> Polytope {
    let by = a.centroid() - b.centroid();
    b.translated(by)
}

/// Hausdorff distance of two convex bodies, in their unit of length. Exact: the distance from a convex body is a convex function, so its
/// largest value over the other body is at a vertex.
pub fn hausdorff(a: &Polytope, b: &Polytope) -> f64 {
    let one_way = |from: &Polytope, to: &Polytope| {
        let surface = Surface::new(to);
        from.vertices().iter().map(|&v| surface.distance_outside(v)).fold(0.0, f64::max)
    };
    one_way(a, b).max(one_way(b, a))
}

/// Chamfer distance of two surfaces: mean distance of `count` evenly spread points of either from the other, averaged over
/// both directions, in their unit of length.
pub fn chamfer(a: &Polytope, b: &Polytope, count: usize) -> f64 {
    let (a, b) = (Surface::new(a), Surface::new(b));
    let one_way = |from: &Surface, to: &Surface| {
        let points = from.points(count.max(1));
        points.iter().map(|&p| to.signed_distance(p).abs()).sum::<f64>() / points.len().max(1) as f64
    };
    0.5 * (one_way(&a, &b) + one_way(&b, &a))
}
