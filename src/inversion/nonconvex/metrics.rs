//! How much two bodies differ that need not be convex: unions of parts, each a mesh of triangles.
//!
//! Volumes are integrals along columns: where quasi-random lines (the R2 sequence of Roberts 2018, after Niederreiter 1992, SIAM
//! CBMS 63) enter and leave each part is exact, so only the plane across is sampled, and a panel is never missed between points.
//! Distances are those of evenly spread points of one surface, without what lies inside other parts, from the other surface.

use super::part::Triangle;
use glam::{DMat3, DQuat, DVec2, DVec3};
use rayon::prelude::*;

/// A body: parts that may touch, pierce or enclose each other. A part whose triangles close is solid, others are sheets without volume.
pub type Parts = [Vec<Triangle>];

/// Columns that are summed at a time.
const CHUNK: usize = 1 << 12;
/// Area vectors of a closed part add up to less than this share of its area.
const CLOSED: f64 = 1e-9;

/// How far from a surface its outside is looked at, as a share of the diagonal.
const NUDGE: f64 = 1e-7;

/// Volume and centre of mass.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Bulk {
    /// Volume \[m^3\].
    pub volume: f64,
    /// Centre of mass \[m\]; the origin of a body without volume.
    pub centre: DVec3,
}

/// How far apart two surfaces are.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Distance {
    /// Greatest distance of a point of either surface from the other (Hausdorff) over the first body's diagonal.
    pub hausdorff: f64,
    /// Mean distance of points of either surface from the other, averaged over both (Chamfer), over the first body's diagonal.
    pub chamfer: f64,
}

/// A solid part seen along the columns.
struct Solid {
    triangles: Vec<Triangle>,
    low: DVec2,
    high: DVec2,
}

/// The direction of columns: along no edge that a body is likely to have.
fn frame() -> DMat3 {
    DMat3::from_quat(DQuat::from_xyzw(0.37, -0.21, 0.55, 0.72).normalize())
}

fn is_closed(part: &[Triangle]) -> bool {
    let vectors = part.iter().map(|[a, b, c]| (*b - *a).cross(*c - *a));
    let (sum, total) = vectors.fold((DVec3::ZERO, 0.0), |(sum, total), v| (sum + v, total + v.length()));
    total > 0.0 && total.is_finite() && sum.length() < CLOSED * total
}

fn solids(parts: &Parts) -> Vec<Solid> {
    let turn = frame();
    let solid = |part: &Vec<Triangle>| {
        let triangles: Vec<Triangle> = part.iter().map(|t| t.map(|v| turn * v)).collect();
        let start = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        let corners = triangles.iter().flatten().map(|v| v.truncate());
        let (low, high) = corners.fold(start, |(l, h), v| (l.min(v), h.max(v)));
        Solid { triangles, low, high }
    };
    parts.iter().filter(|part| is_closed(part)).map(solid).collect()
}

/// Heights where the column through `at` is inside the union, rising and apart.
fn stretches(solids: &[Solid], at: DVec2, crossings: &mut Vec<f64>, out: &mut Vec<(f64, f64)>) {
    out.clear();
    for solid in solids.iter().filter(|s| at.cmpge(s.low).all() && at.cmple(s.high).all()) {
        crossings.clear();
        crossings.extend(solid.triangles.iter().filter_map(|triangle| height(triangle, at)));
        crossings.sort_unstable_by(f64::total_cmp);
        out.extend(crossings.chunks_exact(2).map(|pair| (pair[0], pair[1])));
    }
    out.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    out.dedup_by(|next, last| {
        let joined = next.0 <= last.1;
        if joined {
            last.1 = last.1.max(next.1);
        }
        joined
    });
}

/// Height of a triangle over a point of the plane across, if it is there.
fn height([a, b, c]: &Triangle, at: DVec2) -> Option<f64> {
    let [p, q, r] = [a, b, c].map(|v| v.truncate() - at);
    let (u, v, w) = (q.perp_dot(r), r.perp_dot(p), p.perp_dot(q));
    let all = (u > 0.0 && v > 0.0 && w > 0.0) || (u < 0.0 && v < 0.0 && w < 0.0);
    all.then(|| (u * a.z + v * b.z + w * c.z) / (u + v + w))
}

/// Sums over columns through the rectangle around all solids of what `value` says of each, times the area of a column.
fn over_columns<const N: usize>(
    solids: [&[Solid]; 2],
    columns: usize,
    value: impl Fn(DVec2, &[(f64, f64)], &[(f64, f64)]) -> [f64; N] + Sync,
) -> [f64; N] {
    let start = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    let (low, high) = solids.iter().copied().flatten().fold(start, |(l, h), s| (l.min(s.low), h.max(s.high)));
    let size = high - low;
    if !(size.is_finite() && size.min_element() > 0.0) {
        return [0.0; N];
    }
    let chunk = |first: usize| {
        let (mut crossings, mut one, mut other) = (Vec::new(), Vec::new(), Vec::new());
        let mut sums = [0.0; N];
        for k in first..(first + CHUNK).min(columns) {
            let at = low + size * r2(k);
            stretches(solids[0], at, &mut crossings, &mut one);
            stretches(solids[1], at, &mut crossings, &mut other);
            sums.iter_mut().zip(value(at, &one, &other)).for_each(|(sum, v)| *sum += v);
        }
        sums
    };
    let firsts: Vec<usize> = (0..columns).step_by(CHUNK).collect();
    let sums: Vec<[f64; N]> = firsts.into_par_iter().map(chunk).collect();
    let each = size.x * size.y / columns.max(1) as f64;
    std::array::from_fn(|k| sums.iter().map(|s| s[k]).sum::<f64>() * each)
}

/// Point number `k` of the R2 sequence in the unit square.
fn r2(k: usize) -> DVec2 {
    const STEP: DVec2 = DVec2::new(0.754_877_666_246_692_7, 0.569_840_290_998_053_2);
    (DVec2::splat(0.5) + STEP * (k as f64 + 1.0)).fract()
}

fn length(stretches: &[(f64, f64)]) -> f64 {
    stretches.iter().map(|(a, b)| b - a).sum()
}

/// Length common to two lists of stretches.
fn common(one: &[(f64, f64)], other: &[(f64, f64)]) -> f64 {
    let pairs = one.iter().flat_map(|a| other.iter().map(move |b| a.1.min(b.1) - a.0.max(b.0)));
    pairs.map(|overlap| overlap.max(0.0)).sum()
}

/// Volume and centre of mass of a union by so many columns.
pub fn bulk(parts: &Parts, columns: usize) -> Bulk {
    let solids = solids(parts);
    let sums = over_columns([&solids, &[]], columns, |at, stretches, _| {
        let length = length(stretches);
        let moment = stretches.iter().map(|(a, b)| 0.5 * (b * b - a * a)).sum();
        [length, at.x * length, at.y * length, moment]
    });
    let [volume, x, y, z] = sums;
    let centre = if volume > 0.0 { frame().transpose() * DVec3::new(x, y, z) / volume } else { DVec3::ZERO };
    Bulk { volume, centre }
}

/// Volume of the intersection over that of the union, where the bodies stand, by so many columns; 0 of bodies without volume.
pub fn intersection_over_union(a: &Parts, b: &Parts, columns: usize) -> f64 {
    let (a, b) = (solids(a), solids(b));
    let [common, sum] =
        over_columns([&a, &b], columns, |_, one, other| [common(one, other), length(one) + length(other)]);
    if sum > common { common / (sum - common) } else { 0.0 }
}

/// `b` moved so that its centre of mass is that of `a`; where a body has no volume, nothing moves.
pub fn aligned(a: &Parts, b: &Parts, columns: usize) -> Vec<Vec<Triangle>> {
    let (one, other) = (bulk(a, columns), bulk(b, columns));
    let by = if one.volume > 0.0 && other.volume > 0.0 { one.centre - other.centre } else { DVec3::ZERO };
    b.iter().map(|part| part.iter().map(|t| t.map(|v| v + by)).collect()).collect()
}

/// Distances between two surfaces where they stand, by `count` points of each; 0 where one has no triangles. Points are taken from what
/// no other part of the same body encloses; distances are to all triangles.
pub fn distance(a: &Parts, b: &Parts, count: usize) -> Distance {
    let corners = a.iter().flatten().flatten();
    let start = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (low, high) = corners.fold(start, |(l, h), v| (l.min(*v), h.max(*v)));
    let diagonal = (high - low).length();
    let one_way = |from: &Parts, to: &Parts| {
        let points = points(from, count, diagonal);
        let far: Vec<f64> = points.par_iter().map(|p| nearest(to, *p)).collect();
        let most = far.iter().copied().fold(0.0, f64::max);
        (most, far.iter().sum::<f64>() / far.len().max(1) as f64)
    };
    let (there, back) = (one_way(a, b), one_way(b, a));
    let share = |d: f64| if d.is_finite() && diagonal > 0.0 { d / diagonal } else { 0.0 };
    Distance { hausdorff: share(there.0.max(back.0)), chamfer: share(0.5 * (there.1 + back.1)) }
}

/// Evenly spread points of the surface, without those inside other parts or where two parts touch: just outside of its triangle a point
/// is in no part.
fn points(parts: &Parts, count: usize, diagonal: f64) -> Vec<DVec3> {
    let solids = solids(parts);
    let triangles = parts.iter().flatten().map(|t| (t, (t[1] - t[0]).cross(t[2] - t[0])));
    let total: f64 = triangles.clone().map(|(_, across)| across.length()).sum();
    let turn = frame();
    let (mut crossings, mut inside) = (Vec::new(), Vec::new());
    let (mut out, mut passed, mut number) = (Vec::new(), 0.0, 0);
    for ([a, b, c], across) in triangles {
        passed += across.length();
        let wanted = ((passed / total) * count as f64).min(count as f64) as usize;
        while number < wanted {
            let at = r2(number);
            number += 1;
            let point = *a + at.x.sqrt() * ((*b - *a) + at.y * (*c - *b));
            let outside = turn * (point + across.normalize_or_zero() * (NUDGE * diagonal));
            stretches(&solids, outside.truncate(), &mut crossings, &mut inside);
            if !inside.iter().any(|(low, high)| (*low..=*high).contains(&outside.z)) {
                out.push(point);
            }
        }
    }
    out
}

fn nearest(parts: &Parts, point: DVec3) -> f64 {
    let squares = parts.iter().flatten().map(|triangle| closest(triangle, point).distance_squared(point));
    squares.fold(f64::INFINITY, f64::min).sqrt()
}

/// The point of a triangle nearest to `p`: on its plane if it is over the triangle, else on an edge.
fn closest([a, b, c]: &Triangle, p: DVec3) -> DVec3 {
    let normal = (*b - *a).cross(*c - *a);
    let over = |from: &DVec3, to: &DVec3| normal.dot((*to - *from).cross(p - *from)) >= 0.0;
    let square = normal.length_squared();
    if square > 0.0 && over(a, b) && over(b, c) && over(c, a) {
        return p - normal * (normal.dot(p - *a) / square);
    }
    let on = |from: &DVec3, to: &DVec3| {
        let way = *to - *from;
        let t = (p - *from).dot(way) / way.length_squared().max(f64::MIN_POSITIVE);
        *from + way * t.clamp(0.0, 1.0)
    };
    let ends = [on(a, b), on(b, c), on(c, a)];
    ends.into_iter().min_by(|x, y| x.distance_squared(p).total_cmp(&y.distance_squared(p))).unwrap_or(*a)
}

#[cfg(test)]
mod tests {
    use super::super::part::Part;
    use super::*;

    fn cuboid(centre: DVec3, half: DVec3) -> Vec<Triangle> {
        Part { centre, axes: DMat3::IDENTITY, half }.triangles().to_vec()
    }

    #[test]
    fn volumes_centres_and_overlaps_of_boxes_are_those_of_arithmetic() {
        let one = [cuboid(DVec3::ZERO, DVec3::ONE)];
        let two = [cuboid(DVec3::X, DVec3::ONE)];
        let both = [one[0].clone(), two[0].clone()];
        let found = bulk(&both, 1 << 17);
        assert!(
            (found.volume - 12.0).abs() < 2e-3 && (found.centre - DVec3::X * 0.5).length() < 1e-3,
            "{found:?}"
        );
        assert!((intersection_over_union(&one, &two, 1 << 17) - 1.0 / 3.0).abs() < 1e-4);
        // a part inside another adds nothing
        let nested = [one[0].clone(), cuboid(DVec3::ZERO, DVec3::splat(0.5))];
        assert!((intersection_over_union(&one, &nested, 1 << 17) - 1.0).abs() < 1e-12);
        let moved = aligned(&one, &two, 1 << 17);
        assert!(intersection_over_union(&one, &moved, 1 << 17) > 0.9999);
        assert_eq!(intersection_over_union(&one, &[], 1000), 0.0);
        assert_eq!(intersection_over_union(&[vec![[DVec3::NAN; 3]]], &one, 1000), 0.0);
    }

    #[test]
    fn a_thin_panel_is_not_missed_between_points() {
        let panel = [cuboid(DVec3::ZERO, DVec3::new(1.0, 1.0, 1e-5))];
        let volume = bulk(&panel, 1 << 14).volume;
        assert!((volume / 8e-5 - 1.0).abs() < 2e-3, "{volume}");
    }

    #[test]
    fn distances_of_shifted_plates_and_of_a_body_from_itself() {
        let plate = |z: f64| {
            vec![vec![
                [DVec3::new(-1.0, -1.0, z), DVec3::new(1.0, -1.0, z), DVec3::new(1.0, 1.0, z)],
                [DVec3::new(-1.0, -1.0, z), DVec3::new(1.0, 1.0, z), DVec3::new(-1.0, 1.0, z)],
            ]]
        };
        let apart = distance(&plate(0.0), &plate(0.3), 500);
        let expected = 0.3 / 8f64.sqrt();
        assert!((apart.hausdorff - expected).abs() < 1e-12 && (apart.chamfer - expected).abs() < 1e-12);
        let body = [cuboid(DVec3::ZERO, DVec3::ONE), cuboid(DVec3::X, DVec3::splat(0.5))];
        assert!(distance(&body, &body, 500).hausdorff < 1e-12);
        assert_eq!(distance(&body, &[], 500), Distance::default());
        // nor does the surface where parts touch
        let whole = [cuboid(DVec3::X, DVec3::new(2.0, 1.0, 1.0))];
        let halves = [cuboid(DVec3::ZERO, DVec3::ONE), cuboid(DVec3::X * 2.0, DVec3::ONE)];
        assert!(distance(&whole, &halves, 500).hausdorff < 1e-12);
        // enclosed surface does not count
        let hidden = [cuboid(DVec3::ZERO, DVec3::ONE), cuboid(DVec3::ZERO, DVec3::splat(0.5))];
        assert!(distance(&hidden, &hidden[..1], 500).hausdorff < 1e-12);
    }
}
