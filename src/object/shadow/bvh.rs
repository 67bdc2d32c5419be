//! Boxes in boxes around the faces of a body, so that a ray meets few of them.

use glam::DVec3;

use super::body::Body;
use super::triangle::{Direction, Start, Triangle};

/// Heights and distances below this part of the body's size are rounding.
const FLAT: f64 = 1e-12;
/// Boxes are larger by this part of the body's size, which covers the rounding of a ray against box and face.
const MARGIN: f64 = 1e-14;
/// Most faces in a leaf.
const LEAF: usize = 4;
/// Bins of the split along an axis.
const BINS: usize = 16;
/// Cost of a triangle in units of a box.
const TRIANGLE: f64 = 1.5;
/// Boxes looked into for what is above a face; a face is cast for if these do not tell.
const PATIENCE: usize = 128;
/// Deeper than this the faces are halved whatever the cost, which bounds the recursion.
const DEEP: u32 = 64;

/// The tree, its nodes in the order of a walk that goes down first: a ray that misses a box continues at `skip`, any
/// other at the next node, so that no stack is needed.
#[derive(Debug, Clone, Default)]
pub struct Bvh {
    nodes: Vec<Node>,
    /// Faces in the order of the leaves: neighbours in space are neighbours here.
    pub(super) triangles: Vec<Triangle>,
    /// Of each of `triangles`, whether surely nothing is above its plane: in front, behind.
    pub(super) free: Vec<[bool; 2]>,
    /// Heights up to this are in the plane \[m\].
    least: f64,
    /// Number of faces of the body.
    faces: usize,
}

/// A box; a leaf if it has faces.
#[derive(Debug, Clone, Copy)]
struct Node {
    bounds: Bounds,
    skip: u32,
    first: u32,
    count: u32,
}

#[derive(Debug, Clone, Copy)]
struct Bounds {
    lo: DVec3,
    hi: DVec3,
}

impl Bounds {
    const NONE: Self = Self { lo: DVec3::INFINITY, hi: DVec3::NEG_INFINITY };

    fn of(triangle: &Triangle) -> Self {
        triangle.corners.iter().fold(Self::NONE, |b, &v| b.and(&Self { lo: v, hi: v }))
    }

    fn and(&self, other: &Self) -> Self {
        Self { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi) }
    }

    fn grown(&self, by: f64) -> Self {
        Self { lo: self.lo - by, hi: self.hi + by }
    }

    /// Twice the centre.
    fn middle(&self) -> DVec3 {
        self.lo + self.hi
    }

    /// Half the surface: the chance to be met by a ray, up to a factor.
    fn surface(&self) -> f64 {
        let d = self.hi - self.lo;
        d.x * d.y + d.y * d.z + d.z * d.x
    }
}

/// End of a search.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Found {
    /// A face, by its place in `triangles`.
    Face(usize),
    Nothing,
    Unknown,
}

/// What is sorted: a box and its face.
#[derive(Debug, Clone, Copy)]
struct Item {
    bounds: Bounds,
    face: u32,
}

impl Bvh {
    /// The tree of a body, by the surface area heuristic in bins. A face with a corner that is missing or not finite is
    /// left out: it neither blocks nor gives light.
    #[must_use]
    pub fn new(body: &Body) -> Self {
        let mut items = (0..u32::try_from(body.faces.len()).unwrap_or(u32::MAX))
            .filter_map(|face| Some(Item { bounds: Bounds::of(&Triangle::of(body, face)?), face }))
            .collect::<Vec<_>>();
        let size = size(all(&items));
        items.iter_mut().for_each(|item| item.bounds = item.bounds.grown(MARGIN * size));
        let mut tree = Self { least: FLAT * size, faces: body.faces.len(), ..Self::default() };
        if !items.is_empty() {
            tree.grow(body, &mut items, 0);
        }
        tree.free = tree.find_free(body);
        tree
    }

    /// Follow vertices that moved. The splits stay, so that a body whose parts moved far past each other is slower, not
    /// wrong. If the faces are others in number or validity, the tree is built anew.
    pub fn refit(&mut self, body: &Body) {
        let moved = self.triangles.iter().map_while(|t| Triangle::of(body, t.face)).collect::<Vec<_>>();
        if moved.len() != self.triangles.len() || body.faces.len() != self.faces || moved.len() != self.faces {
            *self = Self::new(body);
            return;
        }
        self.triangles = moved;
        let size = size(self.triangles.iter().map(Bounds::of).fold(Bounds::NONE, |a, b| a.and(&b)));
        self.least = FLAT * size;
        // children come after their parent: the first next to it, the second where the first is skipped to
        for at in (0..self.nodes.len()).rev() {
            let node = self.nodes[at];
            self.nodes[at].bounds = if node.count > 0 {
                self.held(&node).iter().fold(Bounds::NONE, |b, t| b.and(&Bounds::of(t))).grown(MARGIN * size)
            } else {
                let first = self.nodes[at + 1];
                first.bounds.and(&self.nodes[first.skip as usize].bounds)
            };
        }
        self.free = self.find_free(body);
    }

    /// Number of faces of the body.
    #[must_use]
    pub fn faces(&self) -> usize {
        self.faces
    }

    /// Whether any face blocks the ray.
    #[must_use]
    pub fn blocked(&self, toward: &Direction, start: &Start) -> bool {
        self.any(
            |bounds| toward.meets(start.point, bounds.lo, bounds.hi),
            |triangle| triangle.blocks(toward, start, self.least),
            usize::MAX,
        ) != Found::Nothing
    }

    /// The first face that `hit` holds for, in boxes that `meets` holds for, of which at most `most` are looked into.
    #[inline]
    fn any(&self, meets: impl Fn(&Bounds) -> bool, hit: impl Fn(&Triangle) -> bool, most: usize) -> Found {
        let (mut at, mut looked) = (0, 0);
        while let Some(node) = self.nodes.get(at) {
            if !meets(&node.bounds) {
                at = node.skip as usize;
                continue;
            }
            if let Some(k) = self.held(node).iter().position(&hit) {
                return Found::Face(node.first as usize + k);
            }
            at += 1;
            looked += 1;
            if looked == most {
                return Found::Unknown;
            }
        }
        Found::Nothing
    }

    /// Faces of a leaf; none of another node.
    #[inline]
    fn held(&self, node: &Node) -> &[Triangle] {
        &self.triangles[node.first as usize..(node.first + node.count) as usize]
    }

    /// Add the subtree of `items`, which are not empty.
    fn grow(&mut self, body: &Body, items: &mut [Item], depth: u32) {
        let (at, first) = (self.nodes.len(), self.triangles.len() as u32);
        let bounds = all(items);
        self.nodes.push(Node { bounds, skip: 0, first, count: 0 });
        if let Some(split) = split(items, &bounds, depth) {
            let (mut a, mut b) = items.split_at_mut(split);
            // the larger box first: it is the more likely to end the search
            if all(b).surface() > all(a).surface() {
                (a, b) = (b, a);
            }
            self.grow(body, a, depth + 1);
            self.grow(body, b, depth + 1);
        } else {
            self.triangles.extend(items.iter().filter_map(|item| Triangle::of(body, item.face)));
            self.nodes[at].count = items.len() as u32;
        }
        self.nodes[at].skip = self.nodes.len() as u32;
    }

    /// See `free`. All of a convex body is free, unless it has so many faces that the search is given up.
    fn find_free(&self, body: &Body) -> Vec<[bool; 2]> {
        // what is above a face is often above the next
        let mut hint = [0; 2];
        let free = |triangle: &Triangle| {
            let point = triangle.corners[0];
            let normal = body.normals.get(triangle.face as usize).copied().unwrap_or_default();
            let side = |up: DVec3, hint: &mut usize| {
                if self.triangles[*hint].above(point, up, self.least) {
                    return false;
                }
                let found = self.any(
                    |b| up.dot(DVec3::select(up.cmpgt(DVec3::ZERO), b.hi, b.lo) - point) > self.least,
                    |t| t.above(point, up, self.least),
                    PATIENCE,
                );
                if let Found::Face(k) = found {
                    *hint = k;
                }
                found == Found::Nothing
            };
            [side(normal, &mut hint[0]), triangle.sheet && side(-normal, &mut hint[1])]
        };
        self.triangles.iter().map(free).collect()
    }
}

/// Diagonal of the box around the body and the origin of its axes, where numbers are rounded \[m\].
fn size(bounds: Bounds) -> f64 {
    bounds.lo.min(DVec3::ZERO).distance(bounds.hi.max(DVec3::ZERO))
}

fn all(items: &[Item]) -> Bounds {
    items.iter().fold(Bounds::NONE, |b, item| b.and(&item.bounds))
}

/// Sort `items` in two parts and return where the second starts; none for a leaf.
fn split(items: &mut [Item], bounds: &Bounds, depth: u32) -> Option<usize> {
    let n = items.len();
    let best = if n > 1 && depth < DEEP { cheapest(items) } else { None };
    let pays = |cut: &Cut| cut.cost / bounds.surface() + 1.0 < TRIANGLE * n as f64;
    if n <= LEAF && !best.as_ref().is_some_and(pays) {
        return None;
    }
    let Some(cut) = best else { return Some(n / 2) };
    let mut first = 0;
    for k in 0..n {
        if cut.bins.of(&items[k]) < cut.bin {
            items.swap(k, first);
            first += 1;
        }
    }
    Some(first)
}

/// Equal bins of the middles of boxes along an axis.
#[derive(Clone, Copy)]
struct Bins {
    axis: DVec3,
    low: f64,
    scale: f64,
}

impl Bins {
    fn of(&self, item: &Item) -> usize {
        (((item.bounds.middle().dot(self.axis) - self.low) * self.scale) as usize).min(BINS - 1)
    }
}

struct Cut {
    bins: Bins,
    /// The first bin of the second part.
    bin: usize,
    /// Surface times cost of the faces, of both parts.
    cost: f64,
}

/// The best cut with faces on both sides, if there is one.
fn cheapest(items: &[Item]) -> Option<Cut> {
    let middles = items.iter().map(|item| item.bounds.middle());
    let (lo, hi) = middles.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), m| (lo.min(m), hi.max(m)));
    let mut best: Option<Cut> = None;
    for axis in DVec3::AXES {
        let bins = Bins { axis, low: lo.dot(axis), scale: BINS as f64 / (hi - lo).dot(axis) };
        if !bins.scale.is_finite() {
            continue;
        }
        let mut held = [(Bounds::NONE, 0_usize); BINS];
        for item in items {
            let (bounds, count) = &mut held[bins.of(item)];
            *bounds = bounds.and(&item.bounds);
            *count += 1;
        }
        let add = |sum: &mut (Bounds, usize), bin: &(Bounds, usize)| {
            *sum = (sum.0.and(&bin.0), sum.1 + bin.1);
            Some(*sum)
        };
        let mut above = [(Bounds::NONE, 0); BINS];
        let sums = held.iter().rev().scan((Bounds::NONE, 0), add);
        above.iter_mut().rev().zip(sums).for_each(|(a, sum)| *a = sum);
        let below = held.iter().scan((Bounds::NONE, 0), add);
        for (bin, (a, b)) in (1..).zip(below.zip(&above[1..])) {
            let cost = TRIANGLE * (a.0.surface() * a.1 as f64 + b.0.surface() * b.1 as f64);
            if a.1 > 0 && b.1 > 0 && cost < best.as_ref().map_or(f64::INFINITY, |cut| cut.cost) {
                best = Some(Cut { bins, bin, cost });
            }
        }
    }
    best
}
