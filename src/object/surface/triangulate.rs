//! Polygons into triangles: ears cut in the plane that fits best.
//!
//! If every triangle cut and the last one left run counter-clockwise, together they cover the polygon exactly once:
//! the sum of their outlines is its outline. So only the search for ears is heuristic, never the result.

use glam::{DVec2, DVec3};

/// Below this a turn counts as straight, in squares of the polygon's extent.
const STRAIGHT: f64 = 1e-12;
/// An ear this good is taken without looking for a better one: twice its area in squares of its longest side (0.87 if
/// equilateral).
const GOOD: f64 = 0.2;
/// The same where looking on would take long: beyond [`MANY`] corners.
const PASSABLE: f64 = 1e-6;
/// Corners beyond which any passable ear will do.
const MANY: usize = 64;

/// Triangles of a polygon, as places in `points`, wound like the polygon. Corners in a straight line are kept. A degenerate
/// polygon (without area, crossing itself) becomes a fan; fewer than three points become nothing.
pub fn triangulate(points: &[DVec3]) -> Vec<[usize; 3]> {
    if points.len() == 3 {
        return vec![[0, 1, 2]];
    }
    flattened(points).and_then(|flat| ears(&flat)).unwrap_or_else(|| fan(points.len()))
}

fn fan(count: usize) -> Vec<[usize; 3]> {
    (2..count).map(|last| [0, last - 1, last]).collect()
}

/// The points in the plane of Newell's normal, in which they run counter-clockwise; their extent becomes 1.
fn flattened(points: &[DVec3]) -> Option<Vec<DVec2>> {
    let first = points.first()?;
    let extent = points.iter().map(|point| point.distance(*first)).fold(0.0, f64::max);
    if !(extent > 0.0 && extent.is_finite()) {
        return None;
    }
    let relative: Vec<DVec3> = points.iter().map(|point| (point - first) / extent).collect();
    let next = relative.iter().cycle().skip(1);
    let normal = relative.iter().zip(next).map(|(a, b)| a.cross(*b)).sum::<DVec3>().try_normalize()?;
    let right = normal.any_orthonormal_vector();
    let up = normal.cross(right);
    Some(relative.iter().map(|point| DVec2::new(point.dot(right), point.dot(up))).collect())
}

/// A corner of the outline that is left: its place among the points, and where it is.
type Corner = (usize, DVec2);

fn ears(flat: &[DVec2]) -> Option<Vec<[usize; 3]>> {
    let mut ring: Vec<Corner> = flat.iter().copied().enumerate().collect();
    ring.dedup_by_key(|corner| corner.1);
    while ring.len() > 1 && ring.first().map(|corner| corner.1) == ring.last().map(|corner| corner.1) {
        ring.pop();
    }
    let mut triangles = Vec::with_capacity(ring.len());
    let mut start = 1;
    while ring.len() > 3 {
        let tip = best_ear(&ring, start)?;
        triangles.push(around(&ring, tip)?.map(|corner| corner.0));
        ring.remove(tip);
        // one further on, so that ears come from all around and no fan of slivers arises
        start = tip + 1;
    }
    let last: [Corner; 3] = ring.try_into().ok()?;
    triangles.push(last.map(|corner| corner.0));
    (turn(last.map(|corner| corner.1)) > 0.0).then_some(triangles)
}

/// Place in the ring of the first good ear from `start` on, or else of the best.
fn best_ear(ring: &[Corner], start: usize) -> Option<usize> {
    let count = ring.len();
    let blockers: Vec<DVec2> = (0..count)
        .filter_map(|at| around(ring, at))
        .filter(|corners| turn(corners.map(|corner| corner.1)) <= STRAIGHT)
        .map(|[_, tip, _]| tip.1)
        .collect();
    let enough = if count > MANY { PASSABLE } else { GOOD };
    let mut best = None;
    let mut best_quality = 0.0;
    for at in (start..start + count).map(|at| at % count) {
        let corners = around(ring, at)?.map(|corner| corner.1);
        let quality = turn(corners) / longest_squared(corners);
        if quality > best_quality && !blockers.iter().any(|point| covers(corners, *point)) {
            (best, best_quality) = (Some(at), quality);
            if quality >= enough {
                break;
            }
        }
    }
    best
}

/// A corner between its neighbours.
fn around(ring: &[Corner], at: usize) -> Option<[Corner; 3]> {
    let count = ring.len();
    let place = |step: usize| ring.get((at + step) % count).copied();
    Some([place(count - 1)?, place(0)?, place(1)?])
}

/// Twice the area, above 0 if counter-clockwise.
fn turn([a, b, c]: [DVec2; 3]) -> f64 {
    (b - a).perp_dot(c - b)
}

fn longest_squared([a, b, c]: [DVec2; 3]) -> f64 {
    a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a))
}

/// Whether a point lies in a triangle or on its outline, but not on a corner: outlines that reach a hole along a cut pass
/// some points twice.
fn covers(corners: [DVec2; 3], point: DVec2) -> bool {
    let [a, b, c] = corners;
    !corners.contains(&point)
        && [[a, b, point], [b, c, point], [c, a, point]].iter().all(|t| turn(*t) >= -STRAIGHT)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(outline: &[[f64; 2]], area: f64) {
        let tilt = |[x, y]: [f64; 2]| DVec3::new(x, 0.6 * y, 0.8 * y);
        for size in [1e-6, 1.0, 1e6] {
            for first in 0..outline.len() {
                let mut points: Vec<DVec3> = outline.iter().map(|point| tilt(*point) * size).collect();
                points.rotate_left(first);
                let triangles = triangulate(&points);
                assert_eq!(triangles.len(), outline.len() - 2);
                let normal = DVec3::new(0.0, -0.8, 0.6);
                let double =
                    |t: &[usize; 3]| (points[t[1]] - points[t[0]]).cross(points[t[2]] - points[t[0]]).dot(normal);
                assert!(triangles.iter().all(|t| double(t) > 1e-6 * size * size), "{first}: {triangles:?}");
                let total: f64 = triangles.iter().map(double).sum();
                assert!((total / (2.0 * area * size * size) - 1.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn an_l_in_one_piece() {
        check(&[[0., 0.], [2., 0.], [2., 1.], [1., 1.], [1., 2.], [0., 2.]], 3.0);
    }

    #[test]
    fn a_star() {
        let point = |k: i32| {
            let (sin, cos) = (f64::from(k) * std::f64::consts::PI / 5.0).sin_cos();
            let radius = if k % 2 == 0 { 1.0 } else { 0.4 };
            [radius * cos, radius * sin]
        };
        let outline: Vec<[f64; 2]> = (0..10).map(point).collect();
        check(&outline, 5.0 * 0.4 * (std::f64::consts::PI / 5.0).sin());
    }

    #[test]
    fn corners_in_a_straight_line_are_kept() {
        check(&[[0., 0.], [0.7, 0.], [2., 0.], [2., 1.], [2., 2.], [1., 2.], [0., 2.], [0., 1.]], 4.0);
        check(&[[0., 0.], [0.3, 0.], [1., 0.], [0., 1.]], 0.5);
    }

    #[test]
    fn a_hole_reached_along_a_cut() {
        let outer = [[0., 0.], [4., 0.], [4., 4.], [0., 4.], [0., 0.]];
        let inner = [[1., 1.], [1., 3.], [3., 3.], [3., 1.], [1., 1.]];
        check(&[outer, inner].concat(), 12.0);
    }

    #[test]
    fn a_comb_of_many_teeth() {
        let teeth = 60;
        let mut outline = vec![[0.0, -1.0], [f64::from(teeth), -1.0]];
        for tooth in (0..teeth).rev() {
            let x = f64::from(tooth);
            outline.extend([[x + 1.0, 0.0], [x + 0.5, 3.0]]);
        }
        outline.push([0.0, 0.0]);
        check(&outline[..], f64::from(teeth) * 2.5);
    }

    #[test]
    fn a_quadrilateral_is_cut_from_its_first_corner() {
        let square = [DVec3::ZERO, DVec3::X, DVec3::ONE, DVec3::Y];
        assert_eq!(triangulate(&square), [[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn what_has_no_area_becomes_a_fan() {
        let line: Vec<DVec3> = (0..5).map(|k| DVec3::X * f64::from(k)).collect();
        assert_eq!(triangulate(&line), fan(5));
        assert_eq!(triangulate(&[DVec3::NAN; 4]), fan(4));
        assert_eq!(triangulate(&[DVec3::X * 1e300, DVec3::ZERO, DVec3::Y * 1e300, -DVec3::X * 1e300]).len(), 2);
        assert!(triangulate(&[]).is_empty() && triangulate(&line[..2]).is_empty());
    }
}
