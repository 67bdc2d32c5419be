//! Bodies for the tests and the measurements, and light by other means.

use super::body::Body;
use glam::DVec3;
use std::f64::consts::TAU;

/// The body of a mesh.
pub fn body(vertices: Vec<DVec3>, faces: Vec<[u32; 3]>, sheet: bool) -> Body {
    let cross = |f: &[u32; 3]| {
        let [a, b, c] = f.map(|v| vertices[v as usize]);
        (b - a).cross(c - a)
    };
    Body {
        normals: faces.iter().map(|f| cross(f).normalize_or_zero()).collect(),
        areas: faces.iter().map(|f| 0.5 * cross(f).length()).collect(),
        sheet: vec![sheet; faces.len()],
        coplanar: vec![],
        vertices,
        faces,
        size: 0.0,
    }
}

/// Both, side by side or through each other.
pub fn join(bodies: &[Body]) -> Body {
    let mut all = Body::default();
    for b in bodies {
        let (v, f) = (all.vertices.len() as u32, all.faces.len() as u32);
        all.vertices.extend(&b.vertices);
        all.faces.extend(b.faces.iter().map(|f| f.map(|i| i + v)));
        all.normals.extend(&b.normals);
        all.areas.extend(&b.areas);
        all.sheet.extend(&b.sheet);
        all.coplanar.extend(b.coplanar.iter().map(|p| (p.0 + f, p.1 + f)));
    }
    all
}

/// A prism over a polygon, of which `caps` are the triangles, from z = 0 to `h`.
fn prism(outline: &[(f64, f64)], caps: &[[u32; 3]], h: f64) -> Body {
    let n = outline.len() as u32;
    let vertices = [0.0, h].iter().flat_map(|&z| outline.iter().map(move |p| DVec3::new(p.0, p.1, z))).collect();
    let mut faces: Vec<[u32; 3]> = caps.iter().flat_map(|&[a, b, c]| [[a, c, b], [a + n, b + n, c + n]]).collect();
    for i in 0..n {
        let j = (i + 1) % n;
        faces.extend([[i, j, j + n], [i, j + n, i + n]]);
    }
    body(vertices, faces, false)
}

pub fn l_shape() -> Body {
    let outline = [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)];
    prism(&outline, &[[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]], 1.0)
}

pub fn cuboid(lo: DVec3, hi: DVec3) -> Body {
    let mut b = prism(&[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)], &[[0, 1, 2], [0, 2, 3]], 1.0);
    b.vertices.iter_mut().for_each(|v| *v = lo + *v * (hi - lo));
    body(b.vertices, b.faces, false)
}

/// A sheet across z, of two triangles.
pub fn plate(lo: DVec3, hi: DVec3) -> Body {
    let v = vec![lo, DVec3::new(hi.x, lo.y, lo.z), DVec3::new(hi.x, hi.y, lo.z), DVec3::new(lo.x, hi.y, lo.z)];
    body(v, vec![[0, 1, 2], [0, 2, 3]], true)
}

/// A torus of radii 1 and 0.4 with 2 m n faces.
pub fn torus(m: u32, n: u32) -> Body {
    let at = |i: u32, j: u32| {
        let (a, b) = (TAU * f64::from(i) / f64::from(m), TAU * f64::from(j) / f64::from(n));
        let r = 1.0 + 0.4 * b.cos();
        DVec3::new(r * a.cos(), r * a.sin(), 0.4 * b.sin())
    };
    let vertices = (0..m * n).map(|k| at(k / n, k % n)).collect();
    let faces = (0..m * n).flat_map(|k| {
        let (i, j, p, q) = (k / n, k % n, (k / n + 1) % m, (k % n + 1) % n);
        [[i * n + j, p * n + j, p * n + q], [i * n + j, p * n + q, i * n + q]]
    });
    body(vertices, faces.collect(), false)
}

/// A box with two panels on arms' length: 36 faces.
pub fn winged() -> Body {
    let wing = |y: f64| cuboid(DVec3::new(-0.4, y, -0.02), DVec3::new(0.4, y + 2.0, 0.02));
    join(&[cuboid(DVec3::splat(-0.5), DVec3::splat(0.5)), wing(0.6), wing(-2.6)])
}

/// Weights of a matt surface: cosines towards both.
pub fn matt(b: &Body, sun: DVec3, observer: DVec3) -> Vec<f64> {
    let weight = |(n, sheet): (&DVec3, &bool)| {
        let (s, o) = (n.dot(sun), n.dot(observer));
        if s > 0.0 && o > 0.0 || *sheet && s < 0.0 && o < 0.0 { s * o } else { 0.0 }
    };
    b.normals.iter().zip(&b.sheet).map(weight).collect()
}

/// The k-th of many directions, anywhere.
pub fn direction(k: u64) -> DVec3 {
    let u = |c: u64| {
        let z = (2 * k + c + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) as f64 / u64::MAX as f64
    };
    let (z, a): (f64, f64) = (2.0 * u(0) - 1.0, TAU * u(1));
    DVec3::new(a.cos() * (1.0 - z * z).sqrt(), a.sin() * (1.0 - z * z).sqrt(), z)
}

/// Whether `d` from `p` hits the triangle farther than `near`, by Moeller and Trumbore.
pub fn meets(b: &Body, j: usize, p: DVec3, d: DVec3, near: f64) -> bool {
    let [v0, v1, v2] = b.faces[j].map(|v| b.vertices[v as usize]);
    let (e1, e2) = (v1 - v0, v2 - v0);
    let h = d.cross(e2);
    let det = e1.dot(h);
    let q = (p - v0).cross(e1);
    let (u, v, t) = ((p - v0).dot(h) / det, d.dot(q) / det, e2.dot(q) / det);
    u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > near && (b.sheet[j] || b.normals[j].dot(d) > 0.0)
}

/// The light by a grid of m^2 small triangles in each face, every one against all faces.
pub fn dense(b: &Body, sun: DVec3, observer: DVec3, weight: &[f64], m: u32) -> f64 {
    let mut light = 0.0;
    for (i, w) in weight.iter().enumerate().filter(|(_, w)| **w > 0.0) {
        let [v0, v1, v2] = b.faces[i].map(|v| b.vertices[v as usize]);
        let mut seen = 0.0;
        for (x, y) in (0..m).flat_map(|x| (0..m - x).map(move |y| (f64::from(x), f64::from(y)))) {
            // the middles of the upright and the upside-down triangle at (x, y)
            for s in if x + y + 1.5 < f64::from(m) { &[1.0 / 3.0, 2.0 / 3.0][..] } else { &[1.0 / 3.0] } {
                let p = v0 + (v1 - v0) * ((x + s) / f64::from(m)) + (v2 - v0) * ((y + s) / f64::from(m));
                let free = |d| !(0..b.faces.len()).any(|j| j != i && meets(b, j, p, d, 1e-9));
                seen += f64::from(u8::from(free(sun) && free(observer)));
            }
        }
        light += w * b.areas[i] * seen / f64::from(m).powi(2);
    }
    light
}
