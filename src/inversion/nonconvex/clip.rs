//! Convex polygons in a plane, cut by one another, that know on which line each of their edges lies: so the area left of a
//! polygon comes with its derivatives.
//!
//! A region whose edges move changes its area by
//!
//! ```text
//! dA = sum over edges of integral v.n ds        (Reynolds' theorem; n outwards)
//! ```
//!
//! A line through P and Q moves by v = (1 - t) dP + t dQ at P + t (Q - P), so an edge from A to B on it, the region to its
//! left, with N = (dy, -dx) of B - A and t half-way, adds N.[(1 - t) dP + t dQ]. Edges where the region was merely cut in two
//! come twice with opposite signs. Nothing is decided by whether two edges coincide.

use glam::DVec2;

/// Most corners of a polygon.
pub(super) const MOST: usize = 28;
/// Most corners of what covers: a box above a plane has ten.
const COVER: usize = 12;
/// Parts below this share of the whole are dropped.
const SPECK: f64 = 1e-17;

/// A convex polygon, anticlockwise; edge k leads from corner k to the next and lies on line k.
#[derive(Debug, Clone, Copy)]
pub(super) struct Polygon {
    count: usize,
    corners: [DVec2; MOST],
    lines: [u16; MOST],
}

/// A convex polygon that covers: its edges lie on consecutive lines.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cover {
    count: usize,
    corners: [DVec2; COVER],
    first: u16,
}

impl Cover {
    /// Of anticlockwise corners, as many as there is room for; its first edge lies on line `first`.
    pub fn new(points: impl Iterator<Item = DVec2>, first: usize) -> Self {
        let mut cover = Self { count: 0, corners: [DVec2::ZERO; COVER], first: first as u16 };
        for (free, point) in cover.corners.iter_mut().zip(points) {
            *free = point;
            cover.count += 1;
        }
        cover
    }

    fn edges(&self) -> impl Iterator<Item = (DVec2, DVec2, u16)> + '_ {
        let corners = &self.corners[..self.count];
        let next = corners.iter().cycle().skip(1);
        corners.iter().zip(next).enumerate().map(|(k, (a, b))| (*a, *b, self.first + k as u16))
    }

    /// Whether it covers nothing of a polygon: an edge has all of that on its outer side.
    fn is_apart(&self, polygon: &Polygon) -> bool {
        self.count < 3 || self.edges().any(|(a, b, _)| polygon.corners().iter().all(|c| turn(a, b, *c) <= 0.0))
    }
}

/// Twice the area of a triangle, positive if anticlockwise.
fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - a)
}

impl Polygon {
    const EMPTY: Self = Self { count: 0, corners: [DVec2::ZERO; MOST], lines: [0; MOST] };

    /// A rectangle about the origin, its edges on lines 0 to 3, from the corner of least coordinates on.
    pub fn rectangle(half: DVec2) -> Self {
        let mut out = Self::EMPTY;
        for (line, (x, y)) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].into_iter().enumerate() {
            out.push(half * DVec2::new(x, y), line as u16);
        }
        out
    }

    fn push(&mut self, corner: DVec2, line: u16) {
        if let (Some(free), Some(label)) = (self.corners.get_mut(self.count), self.lines.get_mut(self.count)) {
            *free = corner;
            *label = line;
            self.count += 1;
        }
    }

    fn corners(&self) -> &[DVec2] {
        &self.corners[..self.count]
    }

    /// Edges with their lines.
    pub fn edges(&self) -> impl Iterator<Item = (DVec2, DVec2, u16)> + '_ {
        let next = self.corners().iter().cycle().skip(1);
        self.corners().iter().zip(next).zip(&self.lines).map(|((a, b), line)| (*a, *b, *line))
    }

    /// Its area.
    pub fn area(&self) -> f64 {
        let [first, rest @ ..] = self.corners() else { return 0.0 };
        0.5 * rest.windows(2).map(|pair| turn(*first, pair[0], pair[1])).sum::<f64>()
    }

    /// The parts left and right of the line from `a` to `b`.
    fn cut(&self, a: DVec2, b: DVec2, line: u16) -> (Self, Self) {
        let (mut left, mut right) = (Self::EMPTY, Self::EMPTY);
        for (from, to, own) in self.edges() {
            let (here, there) = (turn(a, b, from), turn(a, b, to));
            let inside = here >= 0.0;
            let side = if inside { &mut left } else { &mut right };
            side.push(from, own);
            if inside != (there >= 0.0) {
                let crossing = from + (to - from) * (here / (here - there));
                let (on_left, on_right) = if inside { (line, own) } else { (own, line) };
                left.push(crossing, on_left);
                right.push(crossing, on_right);
            }
        }
        (left, right)
    }
}

/// What is left of `cell` outside all of `covers`, as disjoint polygons in `pieces`; `spare` is room.
pub(super) fn subtract(cell: Polygon, covers: &[Cover], pieces: &mut Vec<Polygon>, spare: &mut Vec<Polygon>) {
    let speck = SPECK * cell.area();
    pieces.clear();
    pieces.push(cell);
    for cover in covers {
        spare.clear();
        for piece in pieces.iter() {
            if cover.is_apart(piece) {
                spare.push(*piece);
                continue;
            }
            let mut inside = *piece;
            for (a, b, line) in cover.edges() {
                let (left, right) = inside.cut(a, b, line);
                if right.count > 2 && right.area() > speck {
                    spare.push(right);
                }
                inside = left;
                if inside.count < 3 {
                    break;
                }
            }
        }
        std::mem::swap(pieces, spare);
    }
}

/// The convex hull of named points, anticlockwise (Andrew 1979, Inf. Proc. Lett. 9, 216); points on its edges are left out.
pub(super) fn hull<T: Copy>(points: &mut [(DVec2, T)], out: &mut Vec<(DVec2, T)>) {
    out.clear();
    points.sort_unstable_by(|(a, _), (b, _)| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let mut floor = 0;
    let forth_and_back = points.iter().chain(points.iter().rev().skip(1));
    for (number, point) in forth_and_back.enumerate() {
        // on the way back the lower chain is left as it is
        if number == points.len() {
            floor = out.len().saturating_sub(1);
        }
        while let [.., a, b] = out.as_slice()
            && out.len() >= floor + 2
            && turn(a.0, b.0, point.0) <= 0.0
        {
            out.pop();
        }
        out.push(*point);
    }
    out.pop();
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cover(points: &[(f64, f64)], first: usize) -> Cover {
        Cover::new(points.iter().map(|&(x, y)| DVec2::new(x, y)), first)
    }

    fn left(covers: &[Cover]) -> f64 {
        let (mut pieces, mut spare) = (Vec::new(), Vec::new());
        subtract(Polygon::rectangle(DVec2::ONE), covers, &mut pieces, &mut spare);
        pieces.iter().map(Polygon::area).sum()
    }

    #[test]
    fn what_is_left_of_a_square_does_not_depend_on_order_repetition_or_shared_edges() {
        let corner = cover(&[(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)], 4);
        let strip = cover(&[(-1.0, -1.0), (1.0, -1.0), (1.0, 0.0), (-1.0, 0.0)], 8);
        assert!((left(&[corner]) - 3.0).abs() < 1e-15);
        assert!((left(&[corner, strip, corner]) - 1.0).abs() < 1e-15);
        assert!((left(&[strip, corner]) - 1.0).abs() < 1e-15);
        assert_eq!(left(&[cover(&[(-2.0, -2.0), (2.0, -2.0), (2.0, 2.0), (-2.0, 2.0)], 4)]), 0.0);
        assert_eq!(left(&[cover(&[(1.0, -1.0), (3.0, 0.0), (1.0, 1.0)], 4)]), 4.0);
        assert_eq!(left(&[cover(&[], 4), cover(&[(0.0, 0.0), (0.5, 0.5)], 4)]), 4.0);
    }

    #[test]
    fn a_hull_keeps_its_corners_alone_and_names_them() {
        let at = |x: f64, y: f64, name: usize| (DVec2::new(x, y), name);
        let mut points = vec![at(1.0, 1.0, 0), at(0.0, 0.0, 1), at(2.0, 0.0, 2), at(1.0, 0.0, 3), at(0.0, 2.0, 4)];
        let mut out = Vec::new();
        hull(&mut points, &mut out);
        assert_eq!(out.iter().map(|p| p.1).collect::<Vec<_>>(), [1, 2, 4]);
        hull::<usize>(&mut [], &mut out);
        assert!(out.is_empty());
        hull(&mut [at(1.0, 1.0, 7)], &mut out);
        assert!(out.len() <= 1);
    }
}
