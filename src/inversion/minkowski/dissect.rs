//! Elimination order for a planar graph on the sphere: nested dissection by planes.
//!
//! George 1973, SIAM J. Numer. Anal. 10, 345. A set of vertices is halved at the median of its longest extent; a cover of the edges between
//! the halves is their separator, eliminated after both.
//!
//! The first two cuts go to the root together, and with them every vertex of a quarter that is not, with its neighbours, in the hemisphere
//! around the quarter's mean e. With B minus the Hessian of the volume, whose entries off the diagonal are not positive, and y_i = n_i.e, for
//! which B y = 0, the rest S of the quarter has y_S > 0 and B_SS y_S = -B_SR y_R >= 0: B_SS is an M-matrix, and needs no
//! exchange of rows.

use glam::DVec3;

/// Parts of at most so many vertices are not divided further.
const LEAF: usize = 20;

/// A set of vertices eliminated together.
#[derive(Debug, Clone, Default)]
pub struct Part {
    /// Its vertices.
    pub own: Vec<u32>,
    /// Parts eliminated before it whose remains it collects, by place in the order.
    pub children: Vec<usize>,
}

/// Parts in order of elimination, the root last.
pub fn dissect<'a, N>(points: &'a [DVec3], neighbours: N) -> Vec<Part>
where
    N: Fn(u32) -> &'a [u32],
{
    let mut cutter = Cutter { points, neighbours, side: vec![0; points.len()], mark: 0, parts: Vec::new() };
    let all: Vec<u32> = (0..points.len() as u32).collect();
    let mut root = Part::default();
    if all.len() <= 4 * LEAF {
        root.own = all;
    } else {
        let (left, right, own) = cutter.cut(all);
        root.own = own;
        for half in [left, right] {
            let (mut left, mut right, own) = cutter.cut(half);
            root.own.extend(own);
            root.own.extend(cutter.take_far(&mut left));
            root.own.extend(cutter.take_far(&mut right));
            root.children.extend([cutter.part(left), cutter.part(right)].into_iter().flatten());
        }
    }
    cutter.parts.push(root);
    cutter.parts
}

struct Cutter<'a, N> {
    points: &'a [DVec3],
    neighbours: N,
    /// Twice the number of the cut, plus one on its right.
    side: Vec<u32>,
    mark: u32,
    parts: Vec<Part>,
}

impl<'a, N: Fn(u32) -> &'a [u32]> Cutter<'a, N> {
    fn part(&mut self, set: Vec<u32>) -> Option<usize> {
        if set.is_empty() {
            return None;
        }
        let mut part = Part::default();
        if set.len() <= LEAF {
            part.own = set;
        } else {
            let (left, right, own) = self.cut(set);
            part.own = own;
            part.children.extend([self.part(left), self.part(right)].into_iter().flatten());
        }
        self.parts.push(part);
        Some(self.parts.len() - 1)
    }

    /// Takes out what is not, with its neighbours, in the hemisphere around the mean.
    fn take_far(&self, set: &mut Vec<u32>) -> Vec<u32> {
        let mean: DVec3 = set.iter().map(|&v| self.points[v as usize]).sum();
        let ahead = |v: u32| self.points[v as usize].dot(mean);
        let near = |v: &mut u32| ahead(*v) > 0.0 && (self.neighbours)(*v).iter().all(|&u| ahead(u) >= 0.0);
        set.extract_if(.., |v| !near(v)).collect()
    }

    /// Left, right and separator.
    fn cut(&mut self, mut set: Vec<u32>) -> (Vec<u32>, Vec<u32>, Vec<u32>) {
        let (low, high) = set
            .iter()
            .map(|&v| self.points[v as usize])
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
        let axis = (high - low).max_position();
        let key = |v: &u32| self.points[*v as usize][axis];
        let half = set.len() / 2;
        set.select_nth_unstable_by(half, |a, b| key(a).total_cmp(&key(b)).then(a.cmp(b)));
        let mut right = set.split_off(half);
        let mut left = set;
        self.mark += 2;
        left.iter().for_each(|&v| self.side[v as usize] = self.mark);
        right.iter().for_each(|&v| self.side[v as usize] = self.mark + 1);
        let separator = self.cover(&left);
        left.retain(|&v| self.side[v as usize] == self.mark);
        right.retain(|&v| self.side[v as usize] == self.mark + 1);
        (left, right, separator)
    }

    /// A cover of the edges from left to right: of each bare edge the end with more edges across. Its vertices lose their side.
    fn cover(&mut self, left: &[u32]) -> Vec<u32> {
        let (here, there) = (self.mark, self.mark + 1);
        let across = |side: &[u32], v: u32, to: u32| {
            (self.neighbours)(v).iter().filter(|&&u| side[u as usize] == to).count()
        };
        let mut separator = Vec::new();
        for &v in left {
            let mut ahead = across(&self.side, v, there);
            for &u in (self.neighbours)(v) {
                if ahead == 0 {
                    break;
                }
                if self.side[u as usize] != there {
                    continue;
                }
                let chosen = if across(&self.side, u, here) > ahead { u } else { v };
                self.side[chosen as usize] = 0;
                separator.push(chosen);
                ahead = if chosen == v { 0 } else { ahead - 1 };
            }
        }
        separator
    }
}
