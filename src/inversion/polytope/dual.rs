//! Which facets of {x: n_i.x <= h_i} meet: the convex hull of the dual points n_i / h_i, all h_i > 0.
//!
//! Incremental insertion in biased randomised order (Amenta, Choi and Rote 2003, SoCG, 211): the hull around the origin is a triangulation
//! of the sphere of directions; a walk finds the triangle whose cone holds the new normal; if the new half-space cuts off that
//! triangle's vertex, the triangles it cuts off are a disc, replaced by a fan. All decisions are exact, so the result is a triangulation
//! for any input: non-simple vertices of the polytope become several triangles, redundant half-spaces stay out.
//! Four half-spaces at infinity close the polytope at the start; if any of them is left at the end, it is unbounded.

use glam::DVec3;

use super::plane::Plane;
use super::predicate::{cuts_off, turns_left};

/// Offset of the four half-spaces at infinity: the dual points lie at 1e-60.
const INFINITY: f64 = 1e60;

/// No triangle, no facet.
pub const NONE: u32 = u32::MAX;

/// An order of insertion: rounds of doubling size at random, and along a space-filling curve in each.
#[derive(Debug, Clone)]
pub struct Order(Vec<u32>);

impl Order {
    /// The order for these normals.
    pub fn new(normals: &[DVec3]) -> Self {
        let mut keys: Vec<(u32, u64, u32)> =
            (0_u32..).zip(normals).map(|(i, &n)| (round(i), curve(n), i)).collect();
        keys.sort_unstable_by(|a, b| b.0.cmp(&a.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)));
        Self(keys.into_iter().map(|key| key.2).collect())
    }
}

/// Round k, counted from the last, with probability 2^-k-1, from a mixing of bits of the index (Steele et al. 2014, OOPSLA, SplitMix).
fn round(index: u32) -> u32 {
    let mut z = u64::from(index).wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    (z ^ (z >> 31)).trailing_ones()
}

/// Place on Morton's curve through the cube around the sphere.
fn curve(n: DVec3) -> u64 {
    let cell = |x: f64| ((x + 1.0) * 511.5) as u64;
    let (x, y, z) = (cell(n.x), cell(n.y), cell(n.z));
    (0..10).fold(0, |key, bit| {
        key | ((x >> bit & 1) << (3 * bit)) | ((y >> bit & 1) << (3 * bit + 1)) | ((z >> bit & 1) << (3 * bit + 2))
    })
}

/// The triangulation: a triangle is a vertex of the polytope, its corners are the facets that meet there, counter-clockwise from outside.
#[derive(Debug, Clone, Default)]
pub struct Dual {
    /// Facets of each triangle.
    pub corners: Vec<[u32; 3]>,
    /// Neighbour of each triangle across the side opposite to the corner of the same place.
    pub across: Vec<[u32; 3]>,
}

impl Dual {
    /// The triangulation for `planes`, all offsets positive; `None` if the polytope is unbounded.
    pub fn new(planes: &[Plane], order: &Order) -> Option<Self> {
        let mut build = Build::new(planes);
        for &plane in &order.0 {
            build.insert(plane);
        }
        build.finish(planes.len())
    }

    /// The triangle whose cone holds `normal`, by a walk from `start`. The walk tries sides in an order that changes, so that it cannot
    /// circle for ever at non-simple vertices (Devillers, Pion and Teillaud 2002, IJFCS 13, 181); should it run long, all
    /// triangles are looked at.
    pub fn locate(&self, planes: &[Plane], normal: DVec3, start: u32) -> u32 {
        let outside = |t: u32, k: usize| {
            let c = self.corners[t as usize];
            let [u, v] = [c[(k + 1) % 3], c[(k + 2) % 3]].map(|c| planes[c as usize].normal);
            !turns_left(u, v, normal)
        };
        let (mut t, mut from) = (start, NONE);
        let mut turn = u64::from(start);
        for _ in 0..1000 + self.corners.len() / 4 {
            turn = turn.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let first = ((turn >> 33) % 3) as usize;
            let way = |&k: &usize| self.across[t as usize][k] != from && outside(t, k);
            let Some(k) = [first, (first + 1) % 3, (first + 2) % 3].into_iter().find(way) else { return t };
            (from, t) = (t, self.across[t as usize][k]);
        }
        let alive = |t: &u32| self.corners[*t as usize][0] != NONE;
        let holds = |t: &u32| (0..3).all(|k| !outside(*t, k));
        (0..self.corners.len() as u32).filter(alive).find(holds).unwrap_or(t)
    }

    /// One triangle at each of `facets` facets, [`NONE`] for facets that do not appear.
    pub fn seats(&self, facets: usize) -> Vec<u32> {
        let mut seats = vec![NONE; facets];
        for (t, corners) in (0_u32..).zip(&self.corners) {
            corners.iter().for_each(|&c| seats[c as usize] = t);
        }
        seats
    }

    /// The triangles around `facet` counter-clockwise from `seat`, each with the place of the facet among its corners.
    pub fn around(&self, facet: u32, seat: u32) -> impl Iterator<Item = (u32, usize)> + '_ {
        let place = move |t: u32| self.corners[t as usize].iter().position(|&c| c == facet);
        let mut next = Some(seat);
        std::iter::from_fn(move || {
            let t = next?;
            let k = place(t)?;
            // across the side from the facet to the corner after next, opposite to the next corner
            let ahead = self.across[t as usize][(k + 1) % 3];
            next = (ahead != seat).then_some(ahead);
            Some((t, k))
        })
    }
}

struct Build {
    planes: Vec<Plane>,
    dual: Dual,
    free: Vec<u32>,
    /// The insertion that last found a triangle to be cut off.
    cut: Vec<u32>,
    /// Triangle of the fan that begins at a facet.
    fan: Vec<u32>,
    last: u32,
    insertions: u32,
    stack: Vec<u32>,
    horizon: Vec<(u32, u32, u32)>,
}

impl Build {
    fn new(planes: &[Plane]) -> Self {
        let m = planes.len() as u32;
        let corner = 1.0 / 3.0_f64.sqrt();
        let mut all = planes.to_vec();
        for (x, y, z) in [(1.0, 1.0, 1.0), (-1.0, -1.0, 1.0), (-1.0, 1.0, -1.0), (1.0, -1.0, -1.0)] {
            all.push(Plane::new(DVec3::new(x, y, z) * corner, INFINITY));
        }
        let corners = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]].map(|t: [u32; 3]| t.map(|c| c + m)).to_vec();
        let across = vec![[3, 1, 2], [3, 2, 0], [3, 0, 1], [2, 1, 0]];
        Self {
            fan: vec![NONE; all.len()],
            planes: all,
            cut: vec![0; corners.len()],
            dual: Dual { corners, across },
            free: Vec::new(),
            last: 0,
            insertions: 0,
            stack: Vec::new(),
            horizon: Vec::new(),
        }
    }

    fn cuts(&self, t: u32, plane: u32) -> bool {
        let [a, b, c] = self.dual.corners[t as usize].map(|c| &self.planes[c as usize]);
        cuts_off(a, b, c, &self.planes[plane as usize])
    }

    fn insert(&mut self, plane: u32) {
        self.insertions += 1;
        let seat = self.dual.locate(&self.planes, self.planes[plane as usize].normal, self.last);
        self.last = seat;
        if !self.cuts(seat, plane) {
            return;
        }
        self.find_disc(seat, plane);
        self.replace_by_fan(plane);
    }

    /// Marks the triangles that `plane` cuts off and lists the sides around them: from facet, to facet, the triangle beyond.
    fn find_disc(&mut self, seat: u32, plane: u32) {
        self.horizon.clear();
        self.stack.clear();
        self.stack.push(seat);
        self.cut[seat as usize] = self.insertions;
        let first_freed = self.free.len();
        while let Some(t) = self.stack.pop() {
            self.free.push(t);
            for k in 0..3 {
                let beyond = self.dual.across[t as usize][k];
                if self.cut[beyond as usize] == self.insertions {
                    continue;
                }
                if self.cuts(beyond, plane) {
                    self.cut[beyond as usize] = self.insertions;
                    self.stack.push(beyond);
                } else {
                    let c = self.dual.corners[t as usize];
                    self.horizon.push((c[(k + 1) % 3], c[(k + 2) % 3], beyond));
                }
            }
        }
        for k in first_freed..self.free.len() {
            self.dual.corners[self.free[k] as usize] = [NONE; 3];
        }
    }

    fn replace_by_fan(&mut self, plane: u32) {
        for k in 0..self.horizon.len() {
            let (from, to, beyond) = self.horizon[k];
            let t = self.free.pop().unwrap_or_else(|| {
                self.dual.corners.push([NONE; 3]);
                self.dual.across.push([NONE; 3]);
                self.cut.push(0);
                self.dual.corners.len() as u32 - 1
            });
            self.dual.corners[t as usize] = [from, to, plane];
            self.dual.across[t as usize] = [NONE, NONE, beyond];
            self.cut[t as usize] = 0;
            self.fan[from as usize] = t;
            // the side of the outer triangle runs the other way
            let outer = self.dual.corners[beyond as usize];
            if let Some(side) = (0..3).find(|&s| outer[(s + 1) % 3] == to && outer[(s + 2) % 3] == from) {
                self.dual.across[beyond as usize][side] = t;
            }
            self.last = t;
        }
        for k in 0..self.horizon.len() {
            let (from, to, _) = self.horizon[k];
            let (t, next) = (self.fan[from as usize], self.fan[to as usize]);
            self.dual.across[t as usize][0] = next;
            self.dual.across[next as usize][1] = t;
        }
    }

    /// Compact arrays, unless a half-space at infinity is left.
    fn finish(self, planes: usize) -> Option<Dual> {
        let mut place = vec![NONE; self.dual.corners.len()];
        let mut corners = Vec::with_capacity(self.dual.corners.len());
        for (t, &c) in self.dual.corners.iter().enumerate() {
            if c[0] == NONE {
                continue;
            }
            if c.iter().any(|&c| c as usize >= planes) {
                return None;
            }
            place[t] = corners.len() as u32;
            corners.push(c);
        }
        let alive = self.dual.across.iter().zip(&self.dual.corners).filter(|(_, c)| c[0] != NONE);
        let across = alive.map(|(across, _)| across.map(|t| place[t as usize])).collect();
        Some(Dual { corners, across })
    }
}
