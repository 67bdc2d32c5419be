//! Rays against all faces one by one.

use super::body::Body;
use super::bvh::Bvh;
use super::ray_shapes::{body, cuboid, direction, join, l_shape, meets, torus, winged};
use super::triangle::{Direction, Start};
use glam::DVec3;
use proptest::prelude::*;

/// A ray from no face.
fn free(point: DVec3, d: DVec3) -> Start {
    Start { point, up: d, face: u32::MAX }
}

fn blocked(bvh: &Bvh, p: DVec3, d: DVec3) -> bool {
    bvh.blocked(&Direction::new(d), &free(p, d))
}

fn brute(b: &Body, p: DVec3, d: DVec3) -> bool {
    (0..b.faces.len()).any(|j| meets(b, j, p, d, 1e-11))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]
    #[test]
    fn as_all_faces_one_by_one(
        corners in prop::collection::vec(prop::array::uniform9(-1.0..1.0_f64), 0..60),
        size in prop::sample::select(vec![0.1, 0.3, 1.0]),
        grid in prop::bool::ANY,
        sheet in prop::bool::ANY,
        seed in 0_u64..1_000_000,
    ) {
        // on a grid many faces are flat, without area, alike or parallel to the axes
        let round = |x: f64| if grid { (x * 4.0).round() / 4.0 } else { x };
        let soup = corners.iter().flat_map(|c| {
            let v = |k: usize| DVec3::new(c[k], c[k + 1], c[k + 2]);
            [v(0), v(0) + size * v(3), v(0) + size * v(6)].map(|v| DVec3::new(round(v.x), round(v.y), round(v.z)))
        });
        let faces = (0..corners.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let b = body(soup.collect(), faces, sheet);
        let mut bvh = Bvh::new(&b);
        let mut moved = b.clone();
        for refit in [false, true] {
            if refit {
                moved.vertices.iter_mut().for_each(|v| *v = DVec3::new(v.y, v.z, v.x) * 3.0);
                moved = body(moved.vertices, moved.faces, sheet);
                bvh.refit(&moved);
            }
            for k in 0..100 {
                // off the grid, as one by one the edges are not sharp
                let (p, d) = (1.3 * direction(seed + k) * (k as f64 / 100.0), direction(seed * 7 + k + 1_000_000));
                prop_assert_eq!(blocked(&bvh, p, d), brute(&moved, p, d));
            }
        }
    }
}

/// From inside a closed mesh no ray gets out, and along an edge none gets in.
#[test]
fn edges_and_corners_do_not_leak() {
    for b in [cuboid(DVec3::splat(-1.0), DVec3::splat(1.0)), l_shape(), torus(40, 30)] {
        for (shift, size) in [(DVec3::ZERO, 1.0), (DVec3::new(0.3, 10.1, -7.7), 1e-6), (DVec3::ONE, 1e6)] {
            let b = body(b.vertices.iter().map(|v| (v + shift) * size).collect(), b.faces.clone(), false);
            let bvh = Bvh::new(&b);
            let inside =
                b.faces.iter().zip(&b.normals).step_by(1 + b.faces.len() / 12).map(|(f, n)| {
                    f.iter().map(|&v| b.vertices[v as usize]).sum::<DVec3>() / 3.0 - n * (0.05 * size)
                });
            for p in inside {
                assert!(blocked(&bvh, p, DVec3::X) && blocked(&bvh, p, -DVec3::Y) && blocked(&bvh, p, DVec3::Z));
                for f in &b.faces {
                    let v = f.map(|v| b.vertices[v as usize]);
                    for k in 0..20 {
                        let to = v[0] + (v[1] - v[0]) * (f64::from(k) / 10.0).min(1.0);
                        assert!(blocked(&bvh, p, (to - p).normalize()), "from {p} to {to}");
                    }
                }
            }
        }
    }
}

/// Rays parallel to axes exactly through edges and corners of a cube, whose box they run along.
#[test]
fn rays_along_the_axes() {
    let b = cuboid(DVec3::ZERO, DVec3::ONE);
    let bvh = Bvh::new(&b);
    for (x, y) in [(0.5, 0.5), (0.0, 0.5), (0.5, 1.0), (0.0, 0.0), (1.0, 1.0), (0.25, 0.25)] {
        for d in [DVec3::Z, -DVec3::Z, DVec3::new(-0.0, -0.0, 1.0)] {
            assert!(blocked(&bvh, DVec3::new(x, y, 0.5 - 3.0 * d.z), d));
            assert!(!blocked(&bvh, DVec3::new(x, y, 0.5 + 3.0 * d.z), d));
        }
    }
    assert!(!blocked(&bvh, DVec3::new(1.001, 0.5, -1.0), DVec3::Z));
}

#[test]
fn a_face_is_not_blocked_by_itself_nor_by_what_is_in_its_plane() {
    for b in [l_shape(), winged(), cuboid(DVec3::ZERO, DVec3::ONE), torus(100, 50)] {
        let bvh = Bvh::new(&b);
        for (i, n) in b.normals.iter().enumerate() {
            let v = b.faces[i].map(|v| b.vertices[v as usize]);
            for k in 0..50 {
                // grazing, from the edge too
                let d = (direction(k) * (if k % 2 == 0 { 1.0 } else { 1e6 }) + n * 1.001).normalize();
                let p = v[0] + (v[1] - v[0]) * (k as f64 / 49.0);
                let start = Start { point: p, up: *n, face: i as u32 };
                let convex = b.faces.len() == 12;
                if n.dot(d) > 0.0 && convex {
                    assert!(!bvh.blocked(&Direction::new(d), &start));
                }
            }
        }
    }
}

#[test]
fn no_panic_whatever_the_mesh_and_the_ray() {
    let bad = [f64::NAN, f64::INFINITY, 0.0, -0.0, 1e-310, 1e308, 1.0];
    let mut v: Vec<DVec3> = bad.iter().map(|&x| DVec3::new(x, 1.0, -x)).collect();
    v.extend([DVec3::ZERO, DVec3::X, DVec3::Y]);
    let n = v.len() as u32;
    let faces: Vec<[u32; 3]> =
        (0..n + 2).flat_map(|i| [[i, 7, 8], [7, 8, 9], [i, i, i], [u32::MAX, 0, i]]).collect();
    let wild = Body { vertices: v, faces, ..Body::default() };
    let same = Body { vertices: vec![DVec3::ONE; 3], faces: vec![[0, 1, 2]; 5000], ..Body::default() };
    // each middle at half the last: the splits take one face at a time
    let steep = (0..3000).map(|k| DVec3::X * 0.5_f64.powi(k % 1000)).collect();
    let steep = body(steep, (0..1000).map(|k| [k, k + 1000, k + 2000]).collect(), true);
    for b in [Body::default(), wild, same, steep, join(&[])] {
        let mut bvh = Bvh::new(&b);
        for k in 0..2 {
            for d in [DVec3::NAN, DVec3::ZERO, DVec3::INFINITY, DVec3::X, DVec3::splat(1e308), direction(k)] {
                for p in [DVec3::NAN, DVec3::ZERO, DVec3::INFINITY, direction(k)] {
                    let hit = blocked(&bvh, p, d);
                    assert!(!hit || (p.is_finite() && d.is_finite() && d != DVec3::ZERO));
                }
            }
            bvh.refit(&b);
        }
        bvh.refit(&l_shape());
        assert_eq!(bvh.faces(), l_shape().faces.len());
    }
}
