//! Convex polygons of a few corners in a plane: cut by a line, subtracted from one another, measured.
//!
//! A cut parts a polygon into two that share their new corners to the last bit, so that areas add up to round-off
//! however the line lies; nothing is decided by whether two edges coincide.

use glam::DVec2;

/// Room for the corners of a polygon: a piece of [`KEPT`] cut by the edges of a clipped triangle has no more.
const MOST: usize = 16;
/// Most corners of a piece; one that has more is halved.
const KEPT: usize = 8;

/// A convex polygon of at most `N` corners, anticlockwise.
#[derive(Debug, Clone, Copy)]
pub struct Polygon<const N: usize = MOST> {
    count: usize,
    /// Square of the length below which an edge has no direction.
    short: f64,
    corners: [DVec2; N],
}

/// What hides: a triangle, or the part of it above a plane, with the box about it.
#[derive(Debug, Clone, Copy)]
pub struct Cover {
    polygon: Polygon<4>,
    low: DVec2,
    high: DVec2,
}

impl Cover {
    /// Of at most 4 corners, in either sense.
    pub fn new(corners: &[DVec2]) -> Self {
        let polygon = Polygon::new(corners);
        let (low, high) = polygon.bounds();
        Self { polygon, low, high }
    }

    /// Whether all of a cell, with the box `low` to `high` about it, is within.
    pub fn contains(&self, cell: &Polygon, (low, high): (DVec2, DVec2)) -> bool {
        let around = self.low.cmple(low).all() && self.high.cmpge(high).all();
        around && self.polygon.contains(cell)
    }

    /// Whether none of such a cell is within.
    fn is_apart(&self, cell: &Polygon, (low, high): (DVec2, DVec2)) -> bool {
        let beside = self.high.cmple(low).any() || self.low.cmpge(high).any();
        beside || self.polygon.is_apart(cell)
    }
}

/// Square of the length, as a share of that of the largest coordinate, below which an edge has no direction.
const SHORT: f64 = 1e-24;

/// Twice the area of the triangle of `a`, `b` and `c`, positive if they lie anticlockwise.
fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - a)
}

impl<const N: usize> Polygon<N> {
    const EMPTY: Self = Self { count: 0, short: 0.0, corners: [DVec2::ZERO; N] };

    /// Of at most `N` corners, in either sense.
    pub fn new(corners: &[DVec2]) -> Self {
        let mut polygon = Self::EMPTY;
        for corner in corners.iter().take(N) {
            polygon.push(*corner);
        }
        polygon.short = SHORT * polygon.corners().iter().map(|c| c.length_squared()).fold(0.0, f64::max);
        if polygon.area() < 0.0 {
            polygon.corners[..polygon.count].reverse();
        }
        polygon
    }

    fn push(&mut self, corner: DVec2) {
        if let Some(free) = self.corners.get_mut(self.count) {
            *free = corner;
            self.count += 1;
        }
    }

    /// The corners.
    pub fn corners(&self) -> &[DVec2] {
        &self.corners[..self.count]
    }

    /// The edges, from corner to corner, without those too short to have a direction: rounding would turn them.
    pub fn edges(&self) -> impl Iterator<Item = (DVec2, DVec2)> + '_ {
        let corners = self.corners();
        let last = corners.last().copied().unwrap_or_default();
        let pairs =
            corners.iter().scan(last, |before, corner| Some((std::mem::replace(before, *corner), *corner)));
        pairs.filter(move |(a, b)| a.distance_squared(*b) > self.short)
    }

    /// The area, positive.
    pub fn area(&self) -> f64 {
        let [first, rest @ ..] = self.corners() else { return 0.0 };
        0.5 * rest.windows(2).map(|pair| turn(*first, pair[0], pair[1])).sum::<f64>()
    }

    /// Least and largest coordinates.
    pub fn bounds(&self) -> (DVec2, DVec2) {
        let start = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        self.corners().iter().fold(start, |(low, high), corner| (low.min(*corner), high.max(*corner)))
    }

    /// Whether all of `other` lies on the inner side of every edge.
    pub fn contains<const M: usize>(&self, other: &Polygon<M>) -> bool {
        self.edges().all(|(a, b)| other.corners().iter().all(|c| turn(a, b, *c) >= 0.0))
    }

    /// Whether an edge of this polygon has all of `other` on its outer side.
    fn parts_from<const M: usize>(&self, other: &Polygon<M>) -> bool {
        self.edges().any(|(a, b)| other.corners().iter().all(|c| turn(a, b, *c) <= 0.0))
    }

    /// Whether the polygons have no area in common.
    pub fn is_apart<const M: usize>(&self, other: &Polygon<M>) -> bool {
        self.parts_from(other) || other.parts_from(self)
    }
}

impl Polygon {
    /// The parts to the left and to the right of the line from `a` to `b`.
    pub fn cut(&self, a: DVec2, b: DVec2) -> (Self, Self) {
        let side = |corner: DVec2| turn(a, b, corner);
        let empty = Self { short: self.short, ..Self::EMPTY };
        let (mut left, mut right) = (empty, empty);
        let Some(last) = self.corners().last() else { return (left, right) };
        let (mut before, mut at_before) = (*last, side(*last));
        for corner in self.corners() {
            let at = side(*corner);
            if (at >= 0.0) != (at_before >= 0.0) {
                let crossing = before + (*corner - before) * (at_before / (at_before - at));
                left.push(crossing);
                right.push(crossing);
            }
            if at >= 0.0 {
                left.push(*corner)
            } else {
                right.push(*corner)
            }
            (before, at_before) = (*corner, at);
        }
        (left, right)
    }

    /// Two halves of a polygon with many corners.
    fn halves(&self) -> (Self, Self) {
        let middle = self.count / 2;
        self.cut(self.corners[0], self.corners[middle])
    }
}

/// More polygons than this over one cell are shared out between its halves.
const CROWD: usize = 100;
/// Halvings of a cell, at most.
const DEEPEST: usize = 24;
/// Parts of a cell below this share of it are dropped.
const SPECK: f64 = 1e-17;

/// Room for the pieces of cells, used again and again.
#[derive(Debug, Default)]
pub struct Workspace {
    pieces: Vec<Polygon>,
    next: Vec<Polygon>,
    lists: Vec<u32>,
}

/// Area of `cell` outside all of `cover`.
pub fn uncovered(cell: &Polygon, cover: &[Cover], work: &mut Workspace) -> f64 {
    work.lists.clear();
    work.lists.extend(0..cover.len() as u32);
    let speck = SPECK * cell.area();
    within(cell, cover, 0, speck, DEEPEST, work)
}

/// The same for the polygons that `work.lists` names from `first` on; these names are taken off the list.
fn within(cell: &Polygon, cover: &[Cover], first: usize, speck: f64, deeper: usize, work: &mut Workspace) -> f64 {
    let mut kept = first;
    let bounds = cell.bounds();
    for at in first..work.lists.len() {
        let name = work.lists[at];
        let own = &cover[name as usize];
        if own.is_apart(cell, bounds) {
            continue;
        }
        if own.contains(cell, bounds) {
            work.lists.truncate(first);
            return 0.0;
        }
        work.lists[kept] = name;
        kept += 1;
    }
    work.lists.truncate(kept);
    let count = kept - first;
    if count == 0 {
        return cell.area();
    }
    if count <= CROWD || deeper == 0 {
        let area = subtract(cell, cover, first, speck, work);
        work.lists.truncate(first);
        return area;
    }
    let (low, high) = bounds;
    let (middle, size) = (0.5 * (low + high), high - low);
    let along = if size.x > size.y { DVec2::Y } else { DVec2::X };
    let (left, right) = cell.cut(middle, middle + along);
    let mut area = 0.0;
    for half in [left, right] {
        let start = work.lists.len();
        work.lists.extend_from_within(first..kept);
        area += within(&half, cover, start, speck, deeper - 1, work);
    }
    work.lists.truncate(first);
    area
}

/// Area left of `cell` when the polygons named from `first` on are taken away one by one.
fn subtract(cell: &Polygon, cover: &[Cover], first: usize, speck: f64, work: &mut Workspace) -> f64 {
    let Workspace { pieces, next, lists } = work;
    pieces.clear();
    pieces.push(*cell);
    for name in &lists[first..] {
        let polygon = &cover[*name as usize].polygon;
        next.clear();
        for piece in pieces.iter() {
            if polygon.is_apart(piece) {
                next.push(*piece);
                continue;
            }
            let mut inside = *piece;
            for (a, b) in polygon.edges() {
                let (left, right) = inside.cut(a, b);
                if right.count > 2 && right.area() > speck {
                    if right.count > KEPT {
                        let (one, other) = right.halves();
                        next.extend([one, other]);
                    } else {
                        next.push(right);
                    }
                }
                inside = left;
                if inside.count < 3 {
                    break;
                }
            }
        }
        std::mem::swap(pieces, next);
        if pieces.is_empty() {
            return 0.0;
        }
    }
    pieces.iter().map(Polygon::area).sum()
}

/// Area of what two polygons have in common.
pub fn common_area(one: &Polygon, other: &Polygon) -> f64 {
    if one.is_apart(other) {
        return 0.0;
    }
    other.edges().fold(*one, |inside, (a, b)| inside.cut(a, b).0).area()
}
