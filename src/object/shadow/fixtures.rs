//! Bodies and directions of the tests.

use super::body::Body;
use glam::DVec3;

/// Adds triangles to a body.
fn push(body: &mut Body, corners: [DVec3; 3], sheet: bool) {
    let cross = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    let first = body.vertices.len() as u32;
    body.vertices.extend(corners);
    body.faces.push([first, first + 1, first + 2]);
    body.normals.push(cross.normalize_or_zero());
    body.areas.push(0.5 * cross.length());
    body.sheet.push(sheet);
}

fn quad(body: &mut Body, [a, b, c, d]: [DVec3; 4], sheet: bool) {
    push(body, [a, b, c], sheet);
    push(body, [a, c, d], sheet);
}

/// A prism over an anticlockwise polygon in x and z, from y = 0 to `length`; `fan` lists the triangles of its ends.
fn prism(body: &mut Body, outline: &[[f64; 2]], fan: &[[usize; 3]], length: f64) {
    let at = |k: usize, y: f64| {
        let [x, z] = outline[k % outline.len()];
        DVec3::new(x, y, z)
    };
    for k in 0..outline.len() {
        quad(body, [at(k, 0.0), at(k + 1, 0.0), at(k + 1, length), at(k, length)], false);
    }
    for &[a, b, c] in fan {
        push(body, [at(a, 0.0), at(c, 0.0), at(b, 0.0)].map(|p| DVec3::new(p.x, 0.0, p.z)), false);
        push(body, [at(a, length), at(b, length), at(c, length)], false);
    }
    // anticlockwise in x and z is clockwise seen from -y
    for face in &mut body.faces {
        face.swap(1, 2);
    }
    for normal in &mut body.normals {
        *normal = -*normal;
    }
}

/// A box between two corners.
pub fn block(low: DVec3, high: DVec3) -> Body {
    let mut body = Body::default();
    let (w, d) = (high.x - low.x, high.z - low.z);
    prism(&mut body, &[[0.0, 0.0], [w, 0.0], [w, d], [0.0, d]], &[[0, 1, 2], [0, 2, 3]], high.y - low.y);
    body.vertices.iter_mut().for_each(|p| *p += low);
    body
}

/// An L of 2 by 2 with arms of 1, `length` long in y.
pub fn ell(length: f64) -> Body {
    let mut body = Body::default();
    let outline = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
    prism(&mut body, &outline, &[[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]], length);
    body
}

/// A rectangle facing +z.
pub fn plate(low: [f64; 2], high: [f64; 2], z: f64) -> Body {
    let mut body = Body::default();
    let at = |x, y| DVec3::new(x, y, z);
    quad(&mut body, [at(low[0], low[1]), at(high[0], low[1]), at(high[0], high[1]), at(low[0], high[1])], true);
    body
}

/// A sphere of radius 1 by a cube with n x n squares a side: 12 n^2 faces.
pub fn sphere(n: usize) -> Body {
    let mut body = Body::default();
    let at = |i: usize, j: usize, axis: usize, sign: f64| {
        let place = |k: usize| (std::f64::consts::FRAC_PI_4 * (2.0 * k as f64 / n as f64 - 1.0)).tan();
        let (u, v) = if sign > 0.0 { (place(i), place(j)) } else { (place(j), place(i)) };
        let mut p = [0.0; 3];
        (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (sign, u, v);
        DVec3::from_array(p).normalize()
    };
    for (axis, sign) in [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0), (2, 1.0), (2, -1.0)] {
        for (i, j) in (0..n * n).map(|k| (k / n, k % n)) {
            let corner = |di, dj| at(i + di, j + dj, axis, sign);
            let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
            // the diagonal that makes a ridge: the body is convex
            let ridge = (a + c).length() > (b + d).length();
            quad(&mut body, if ridge { [a, b, c, d] } else { [b, c, d, a] }, false);
        }
    }
    body
}

/// Bodies side by side as one.
pub fn union(bodies: &[Body]) -> Body {
    let mut all = Body::default();
    for body in bodies {
        let first = all.vertices.len() as u32;
        all.vertices.extend(&body.vertices);
        all.faces.extend(body.faces.iter().map(|face| face.map(|v| v + first)));
        all.normals.extend(&body.normals);
        all.areas.extend(&body.areas);
        all.sheet.extend(&body.sheet);
    }
    all
}

/// A bus with two wings: 36 faces, none of them sheets.
pub fn satellite() -> Body {
    let block = |low: [f64; 3], high: [f64; 3]| block(low.into(), high.into());
    union(&[
        block([-1.0, -1.0, -1.5], [1.0, 1.0, 1.5]),
        block([-0.9, 1.4, -0.03], [0.9, 6.0, 0.03]),
        block([-0.9, -6.0, -0.03], [0.9, -1.4, 0.03]),
    ])
}

/// Corners at the same place as one vertex.
fn weld(body: &mut Body) {
    let mut places = std::collections::HashMap::new();
    let mut vertices = Vec::new();
    let mut place = |p: DVec3| {
        *places.entry(p.to_array().map(|x| (x * 1e9).round() as i64)).or_insert_with(|| {
            vertices.push(p);
            vertices.len() as u32 - 1
        })
    };
    for face in &mut body.faces {
        *face = face.map(|v| place(body.vertices[v as usize]));
    }
    body.vertices = vertices;
}

/// A satellite with a tank: 4836 faces.
pub fn detailed() -> Body {
    let mut tank = sphere(20);
    tank.vertices.iter_mut().for_each(|p| p.z += 2.0);
    let mut body = union(&[satellite(), tank]);
    weld(&mut body);
    body
}

/// Directions spread evenly.
pub fn directions(count: usize) -> impl Iterator<Item = DVec3> {
    (0..count).map(move |k| {
        let z = 1.0 - (2 * k + 1) as f64 / count as f64;
        let (r, turn) = ((1.0 - z * z).sqrt(), 2.399963229728653 * k as f64);
        DVec3::new(r * turn.cos(), r * turn.sin(), z)
    })
}

/// Pairs of directions with phase angles from 0 to 120 degrees.
pub fn geometries(count: usize) -> Vec<[DVec3; 2]> {
    let pair = |(k, sun): (usize, DVec3)| {
        let phase = 2.1 * k as f64 / count as f64;
        let turn = glam::DQuat::from_axis_angle(sun.any_orthonormal_vector(), phase);
        [sun, glam::DQuat::from_axis_angle(sun, 2.0 * k as f64) * (turn * sun)]
    };
    directions(count).enumerate().map(pair).collect()
}

/// Weights of faces that scatter alike in all directions.
pub fn lambert(body: &Body, sun: DVec3, observer: DVec3) -> Vec<f64> {
    let weight = |(n, sheet): (&DVec3, &bool)| {
        let (s, o) = (n.dot(sun), n.dot(observer));
        if s > 0.0 && o > 0.0 || *sheet && s < 0.0 && o < 0.0 { s * o } else { 0.0 }
    };
    body.normals.iter().zip(&body.sheet).map(weight).collect()
}

/// Light without any shadow.
pub fn unshadowed(body: &Body, weight: &[f64]) -> f64 {
    body.areas.iter().zip(weight).map(|(a, w)| a * w).sum()
}
