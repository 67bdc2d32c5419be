//! Bodies and curves of known truth: what tests and studies of inversion measure themselves against.

use super::sphere::tangents;
use crate::base::random::philox4x32;
use crate::object::convex::Facet;
use glam::{DMat3, DQuat, DVec3};
use std::f64::consts::{PI, TAU};

/// Random numbers of a seed, one after the other.
#[derive(Debug, Clone)]
pub struct Stream {
    seed: u64,
    next: u64,
}

impl Stream {
    /// From its start.
    pub fn new(seed: u64) -> Self {
        Self { seed, next: 0 }
    }

    fn words(&mut self) -> [u64; 2] {
        let halves = |v: u64| [v as u32, (v >> 32) as u32];
        let [a, b] = halves(self.next);
        self.next += 1;
        let [w, x, y, z] = philox4x32([a, b, 0, 0], halves(self.seed)).map(u64::from);
        [w << 32 | x, y << 32 | z]
    }

    /// Uniform above 0 and below 1.
    pub fn uniform(&mut self) -> f64 {
        ((self.words()[0] >> 12) as f64 + 0.5) / (1u64 << 52) as f64
    }

    /// Of the standard normal distribution (Box & Muller 1958).
    pub fn normal(&mut self) -> f64 {
        let (u, v) = (self.uniform(), self.uniform());
        (-2.0 * libm::log(u)).sqrt() * libm::cos(TAU * v)
    }

    /// A direction, all equally likely.
    pub fn direction(&mut self) -> DVec3 {
        let z = 2.0 * self.uniform() - 1.0;
        let (r, angle) = ((1.0 - z * z).sqrt(), TAU * self.uniform());
        DVec3::new(r * libm::cos(angle), r * libm::sin(angle), z)
    }
}

/// Random directions to Sun and observer.
pub fn directions(count: usize, stream: &mut Stream) -> Vec<(DVec3, DVec3)> {
    (0..count).map(|_| (stream.direction(), stream.direction())).collect()
}

/// Directions seen from a body in random attitudes, at one phase angle \[rad\].
pub fn fixed_phase(count: usize, phase: f64, stream: &mut Stream) -> Vec<(DVec3, DVec3)> {
    let pair = |_| {
        let s = stream.direction();
        let [a, b] = tangents(s);
        let turn = TAU * stream.uniform();
        let across = a * libm::cos(turn) + b * libm::sin(turn);
        (s, (s * libm::cos(phase) + across * libm::sin(phase)).normalize())
    };
    (0..count).map(pair).collect()
}

/// A rotation that favours no axis, so that no facet lies on a grid.
fn tilt() -> DMat3 {
    DMat3::from_quat(DQuat::from_xyzw(0.31, -0.52, 0.17, 0.78).normalize())
}

/// Facets of a box with edges \[m\], tilted.
pub fn cuboid(edges: DVec3) -> Vec<Facet> {
    let areas = [edges.y * edges.z, edges.z * edges.x, edges.x * edges.y];
    let pairs = DVec3::AXES.into_iter().zip(areas);
    let facet = |(axis, area): (DVec3, f64)| [axis, -axis].map(|n| Facet { normal: tilt() * n, area });
    pairs.flat_map(facet).collect()
}

/// The twenty facets of an icosahedron, of equal area \[m^2\].
pub fn icosahedron(area: f64) -> Vec<Facet> {
    let golden = 0.5 * (1.0 + 5f64.sqrt());
    let mut normals = Vec::new();
    for [a, b, c] in (0..8u8).map(|k| [k & 1, k >> 1 & 1, k >> 2].map(|bit| f64::from(bit) * 2.0 - 1.0)) {
        normals.push(DVec3::new(a, b, c));
        if c > 0.0 {
            let (x, y) = (a / golden, b * golden);
            normals.extend([DVec3::new(0.0, x, y), DVec3::new(x, y, 0.0), DVec3::new(y, 0.0, x)]);
        }
    }
    normals.into_iter().map(|n| Facet { normal: tilt() * n.normalize(), area }).collect()
}

/// A cylinder of 24 sides, 26 facets, with sides and ends of these areas \[m^2\].
pub fn cylinder(side: f64, end: f64) -> Vec<Facet> {
    let sides = (0..24).map(|k| {
        (DVec3::new(libm::cos(PI * f64::from(k) / 12.0), libm::sin(PI * f64::from(k) / 12.0), 0.0), side)
    });
    let ends = [(DVec3::Z, end), (-DVec3::Z, end)];
    sides.chain(ends).map(|(n, area)| Facet { normal: tilt() * n, area }).collect()
}

/// A random closed set of `count` facets, at least `apart` \[rad\] from each other where there is room, areas within a factor of
/// about five: areas are moved as little as closes them.
pub fn random_body(count: usize, apart: f64, seed: u64) -> Vec<Facet> {
    let mut stream = Stream::new(seed);
    for _ in 0..1000 {
        let mut facets: Vec<Facet> = Vec::new();
        for _ in 0..10_000 {
            let normal = stream.direction();
            if facets.len() < count && facets.iter().all(|f| f.normal.dot(normal) < libm::cos(apart)) {
                facets.push(Facet { normal, area: 0.4 + stream.uniform() });
            }
        }
        let outer = |n: DVec3| DMat3::from_cols(n * n.x, n * n.y, n * n.z);
        let matrix = facets.iter().fold(DMat3::ZERO, |m, f| m + outer(f.normal) * f.area);
        let defect: DVec3 = facets.iter().map(|f| f.normal * f.area).sum();
        let shift = matrix.inverse() * defect;
        facets.iter_mut().for_each(|f| f.area *= 1.0 - f.normal.dot(shift));
        if facets.len() == count && facets.iter().all(|f| f.area > 0.2) {
            return facets;
        }
    }
    Vec::new()
}

/// A curve with noise of one standard deviation: the mean over `snr`.
pub fn noisy(curve: &[f64], snr: f64, stream: &mut Stream) -> (Vec<f64>, Vec<f64>) {
    let sigma = curve.iter().sum::<f64>() / curve.len().max(1) as f64 / snr;
    (curve.iter().map(|y| y + sigma * stream.normal()).collect(), vec![sigma; curve.len()])
}
