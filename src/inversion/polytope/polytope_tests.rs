use std::f64::consts::PI;

use super::compare::{aligned, chamfer, common_volume, hausdorff, intersection_over_union};
use super::surface::Surface;
use super::*;

fn cuboid(low: DVec3, high: DVec3) -> Polytope {
    let normals: Vec<DVec3> = DVec3::AXES.into_iter().flat_map(|axis| [axis, -axis]).collect();
    let offsets: Vec<f64> = (0..3).flat_map(|k| [high[k], -low[k]]).collect();
    Polytope::new(&normals, &offsets).unwrap()
}

fn cube(half: f64) -> Polytope {
    cuboid(DVec3::splat(-half), DVec3::splat(half))
}

fn octahedron_normals() -> Vec<DVec3> {
    (0..8).map(|k| DVec3::from_array([0, 1, 2].map(|bit| f64::from(1 - 2 * (k >> bit & 1))))).collect()
}

struct Draw(u64);

impl Draw {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 * 2.0_f64.powi(-53)
    }

    fn direction(&mut self) -> DVec3 {
        let z = 2.0 * self.uniform() - 1.0;
        let (sin, cos) = (2.0 * PI * self.uniform()).sin_cos();
        DVec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z)
    }
}

fn random(count: usize, spread: f64, seed: u64) -> Polytope {
    let mut draw = Draw(seed);
    let normals: Vec<DVec3> = (0..count).map(|_| draw.direction()).collect();
    let offsets: Vec<f64> = (0..count).map(|_| 1.0 + spread * draw.uniform()).collect();
    Polytope::new(&normals, &offsets).unwrap()
}

/// Laws that hold for every polytope; lengths to `tolerance` of the diagonal.
fn check_laws(body: &Polytope, tolerance: f64) {
    let (mesh, size) = (body.mesh(), body.diagonal());
    for &v in body.vertices() {
        assert!(body.excess(v) <= tolerance * size, "{v} is outside by {}", body.excess(v));
    }
    let closing: DVec3 = body.normals().zip(body.areas()).map(|(n, a)| n * *a).sum();
    assert!(closing.length() <= tolerance * body.area(), "closure {closing}");
    let centre = body.centroid();
    let volume: f64 = mesh
        .triangles()
        .iter()
        .map(|t| t.map(|v| mesh.vertices[v as usize] - centre))
        .map(|[a, b, c]| a.dot(b.cross(c)) / 6.0)
        .sum();
    assert!((volume / body.volume() - 1.0).abs() <= 10.0 * tolerance, "mesh {volume}, body {}", body.volume());
    // Euler: every vertex has three edges here
    let facets = body.areas().iter().zip(0..).filter(|(_, i)| !body.corners_of(*i).is_empty()).count();
    assert_eq!(body.vertices().len(), 2 * facets - 4);
    assert_eq!(body.edges().len(), 3 * facets - 6);
    for edge in body.edges() {
        let [a, b] = edge.vertices.map(|v| body.vertices()[v as usize]);
        assert!(
            ((a - b).length() - edge.length).abs() <= tolerance * size,
            "edge {edge:?} is {}",
            (a - b).length()
        );
    }
}

#[test]
fn cube_has_the_measures_of_a_cube() {
    let body = cube(0.5);
    check_laws(&body, 1e-15);
    assert_eq!(body.volume(), 1.0);
    assert_eq!(body.areas(), [1.0; 6]);
    let lengths = |length: f64| body.edges().iter().filter(|edge| edge.length == length).count();
    assert_eq!(lengths(1.0), 12);
    let mesh = body.mesh();
    assert_eq!((mesh.vertices.len(), mesh.polygons.len(), mesh.triangles().len()), (8, 6, 12));
    assert!(body.centroid().length() < 1e-16);
}

#[test]
fn octahedron_has_six_vertices_where_four_facets_meet() {
    let body = Polytope::new(&octahedron_normals(), &[1.0; 8]).unwrap();
    check_laws(&body, 1e-15);
    let mesh = body.mesh();
    assert_eq!((mesh.vertices.len(), mesh.polygons.len(), mesh.triangles().len()), (6, 8, 8));
    assert!((body.volume() - 4.0 / 3.0).abs() < 1e-15);
    assert_eq!(body.edges().iter().filter(|edge| edge.length > 1e-15).count(), 12);
}

#[test]
fn rings_of_coplanar_dual_points_keep_their_topology() {
    // right prisms and a grid of longitude and latitude: many exactly or nearly non-simple vertices
    for sides in [3, 4, 7, 360] {
        let ring = (0..sides).map(|k| (2.0 * PI * f64::from(k) / f64::from(sides)).sin_cos());
        let mut normals: Vec<DVec3> = ring.map(|(sin, cos)| DVec3::new(cos, sin, 0.0)).collect();
        normals.extend([DVec3::Z, -DVec3::Z]);
        let body = Polytope::new(&normals, &vec![1.0; normals.len()]).unwrap();
        check_laws(&body, 1e-13);
        let expected = 2.0 * f64::from(sides) * (PI / f64::from(sides)).tan();
        assert!((body.volume() / expected - 1.0).abs() < 1e-13, "{sides} sides: {}", body.volume());
    }
    let angles = (1..24).flat_map(|i| (0..48).map(move |j| (PI * f64::from(i) / 24.0, PI * f64::from(j) / 24.0)));
    let mut normals: Vec<DVec3> =
        angles.map(|(t, p)| DVec3::new(t.sin() * p.cos(), t.sin() * p.sin(), t.cos())).collect();
    normals.extend([DVec3::Z, -DVec3::Z]);
    let body = Polytope::new(&normals, &vec![1.0; normals.len()]).unwrap();
    check_laws(&body, 1e-12);
    assert!(body.areas().iter().all(|&area| area > 0.0));
}

#[test]
fn lattice_normals_and_offsets_meet_in_many_planes() {
    // small integers: most decisions are exact ties
    let steps = -2..=2;
    let cells = steps
        .clone()
        .flat_map(|x| steps.clone().map(move |y| (x, y)))
        .flat_map(|(x, y)| (-2..=2).map(move |z| (x, y, z)));
    let normals: Vec<DVec3> = cells
        .filter(|c| *c != (0, 0, 0))
        .map(|(x, y, z)| DVec3::new(f64::from(x), f64::from(y), f64::from(z)))
        .collect();
    let offsets: Vec<f64> = normals.iter().map(|n| n.abs().element_sum()).collect();
    let body = Polytope::new(&normals, &offsets).unwrap();
    check_laws(&body, 1e-14);
    // all planes touch the cube of half-width 1
    assert!((body.volume() - 8.0).abs() < 1e-13, "{}", body.volume());
}

#[test]
fn twenty_thousand_planes_around_a_sphere() {
    let body = random(20_000, 0.0, 3);
    check_laws(&body, 1e-10);
    // a circumscribed body has V = A / 3 and is larger than the ball
    assert!((body.volume() / body.area() - 1.0 / 3.0).abs() < 1e-13);
    assert!(body.volume() > 4.0 * PI / 3.0 && body.volume() < 4.2);
}

#[test]
fn needles_and_pancakes_of_aspect_ten_to_the_eight_keep_their_volume() {
    for edges in [DVec3::new(1.0, 1.0, 1e8), DVec3::new(1e8, 1e8, 1.0), DVec3::new(1e-8, 1.0, 1e8)] {
        let body = cuboid(-0.5 * edges, 0.5 * edges);
        assert!((body.volume() / (edges.x * edges.y * edges.z) - 1.0).abs() < 1e-15, "{edges}: {}", body.volume());
    }
}

#[test]
fn nearly_parallel_planes_keep_the_digits_of_their_areas() {
    // the top is cut by a plane at angle e through x = 0: area 1/cos of half of it, for any e
    for angle in [1e-2_f64, 1e-4, 1e-7, 1e-10] {
        let mut normals: Vec<DVec3> = DVec3::AXES.into_iter().flat_map(|axis| [axis, -axis]).collect();
        normals.push(DVec3::new(angle.sin(), 0.0, angle.cos()));
        let offsets = [0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5 * angle.cos()];
        let areas = Polytope::new(&normals, &offsets).unwrap().areas().to_vec();
        // the ridge is where it is to the rounding of the offsets over the angle
        let tolerance = 1e-15 + 3e-16 / angle;
        assert!((areas[6] - 0.5 / angle.cos()).abs() < tolerance, "{angle}: {}", areas[6]);
        assert!((areas[4] - 0.5).abs() < tolerance, "{angle}: {}", areas[4]);
    }
}

#[test]
fn redundant_and_equal_half_spaces_have_no_area() {
    let mut normals: Vec<DVec3> = DVec3::AXES.into_iter().flat_map(|axis| [axis, -axis]).collect();
    normals.extend([DVec3::X, DVec3::ONE, DVec3::X]);
    // the same plane again, one that touches a corner, one that is outside
    let body = Polytope::new(&normals, &[0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 1.5, 0.7]).unwrap();
    assert!((body.volume() - 1.0).abs() < 1e-15);
    // the corner may be cut by the rounding of a normal
    assert!(body.areas()[6..].iter().all(|&area| area < 1e-30));
    assert_eq!(body.corners_of(8), Vec::<u32>::new());
    assert_eq!(body.corners_of(99), Vec::<u32>::new());
}

#[test]
fn normals_that_leave_a_direction_free_are_refused() {
    let ring: Vec<DVec3> = (0..5).map(|k| f64::from(k).sin_cos()).map(|(s, c)| DVec3::new(c, s, 0.0)).collect();
    let dome: Vec<DVec3> = octahedron_normals().into_iter().filter(|n| n.z > 0.0).collect();
    let half: Vec<DVec3> = dome.iter().copied().chain(ring.iter().copied()).collect();
    for normals in [vec![], vec![DVec3::X], vec![DVec3::X, -DVec3::X], ring, dome, half] {
        for offset in [1.0, -1.0] {
            let refused = Polytope::new(&normals, &vec![offset; normals.len()]);
            assert_eq!(refused.err(), Some(Fault::Unbounded), "{normals:?}");
        }
    }
}

#[test]
fn values_without_meaning_are_refused_with_their_place() {
    let normals = octahedron_normals();
    let refuse = |k: usize, normal: DVec3, offset: f64| {
        let (mut normals, mut offsets) = (normals.clone(), vec![1.0; 8]);
        (normals[k], offsets[k]) = (normal, offset);
        Polytope::new(&normals, &offsets).err()
    };
    for bad in [DVec3::NAN, DVec3::INFINITY, DVec3::ZERO, DVec3::splat(1e-300)] {
        assert!(matches!(refuse(3, bad, 1.0), Some(Fault::Normal { index: 3, .. })), "{bad}");
    }
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300] {
        assert!(matches!(refuse(5, DVec3::X, bad), Some(Fault::Offset { index: 5, .. })), "{bad}");
    }
    assert_eq!(Polytope::new(&normals, &[1.0]).err(), Some(Fault::Lengths { normals: 8, offsets: 1 }));
}

#[test]
fn half_spaces_without_common_interior_are_refused() {
    let normals: Vec<DVec3> = DVec3::AXES.into_iter().flat_map(|axis| [axis, -axis]).collect();
    for gap in [0.0, 1e-15, 1.0] {
        let refused = Polytope::new(&normals, &[1.0, -1.0 - gap, 1.0, 1.0, 1.0, 1.0]).err();
        assert!(matches!(refused, Some(Fault::Empty { .. })), "gap {gap}: {refused:?}");
    }
    let thin = Polytope::new(&normals, &[1.0, -1.0 + 1e-9, 1.0, 1.0, 1.0, 1.0]).unwrap();
    assert!((thin.volume() / 4e-9 - 1.0).abs() < 1e-6, "{}", thin.volume());
}

#[test]
fn a_body_far_from_the_origin_is_the_same_body() {
    let near = random(40, 0.1, 5);
    let by = DVec3::new(300.0, -200.0, 1000.0);
    let normals: Vec<DVec3> = near.normals().collect();
    let offsets: Vec<f64> = normals.iter().zip(near.offsets()).map(|(n, h)| h + n.dot(by)).collect();
    let far = Polytope::new(&normals, &offsets).unwrap();
    // offsets of 1000 are rounded at 1e-13
    assert!((far.volume() / near.volume() - 1.0).abs() < 1e-12);
    assert!((far.centroid() - near.centroid() - by).length() < 1e-11);
    assert!(hausdorff(&far, &near.translated(by)) < 1e-11);
}

#[test]
fn hessian_of_the_volume_is_the_derivative_of_the_areas() {
    let body = random(40, 0.05, 7);
    let (planes, measures) = (&body.planes, &body.measures);
    let areas = |moved: usize, by: f64| {
        let planes: Vec<Plane> =
            planes.iter().enumerate().map(|(i, p)| if i == moved { p.moved(by) } else { *p }).collect();
        Polytope::from_planes(planes).unwrap().areas().to_vec()
    };
    let step = 1e-6;
    for j in 0..40 {
        let unit: Vec<f64> = (0..40).map(|i| f64::from(u8::from(i == j))).collect();
        let column = measures.hessian_times(planes, &unit);
        let (above, below) = (areas(j, step), areas(j, -step));
        for i in 0..40 {
            let difference = (above[i] - below[i]) / (2.0 * step);
            // areas are quadratic between changes of topology, so the central difference errs by rounding alone
            assert!((column[i] - difference).abs() < 1e-8, "dA_{i}/dh_{j} = {} or {difference}", column[i]);
        }
    }
}

#[test]
fn hessian_has_the_translations_as_null_space_and_twice_the_areas_along_the_offsets() {
    for (count, tolerance) in [(40, 1e-13), (4000, 1e-12)] {
        let body = random(count, 0.001, 11);
        let (planes, measures) = (&body.planes, &body.measures);
        let size = measures.weights.iter().copied().fold(0.0, f64::max);
        for axis in DVec3::AXES {
            let moved: Vec<f64> = planes.iter().map(|plane| plane.normal.dot(axis)).collect();
            let change = measures.hessian_times(planes, &moved);
            assert!(change.iter().all(|c| c.abs() < tolerance * size), "{count} planes along {axis}");
        }
        let offsets: Vec<f64> = planes.iter().map(|plane| plane.offset).collect();
        let twice = measures.hessian_times(planes, &offsets);
        let errors = twice.iter().zip(&measures.areas).map(|(t, a)| (t - 2.0 * a).abs());
        assert!(errors.fold(0.0, f64::max) < tolerance, "{count} planes");
    }
}

#[test]
fn common_volume_of_shifted_cubes_is_that_of_a_box() {
    let a = cube(0.5);
    for (shift, common) in [
        (DVec3::ZERO, 1.0),
        (DVec3::new(0.25, 0.0, 0.0), 0.75),
        (DVec3::new(0.5, -0.5, 0.25), 0.1875),
        (DVec3::new(1.0, 0.0, 0.0), 0.0),
        (DVec3::new(7.0, 0.0, 0.0), 0.0),
    ] {
        let b = cube(0.5).translated(shift);
        assert!((common_volume(&a, &b).unwrap() - common).abs() < 1e-14, "{shift}");
        assert!((intersection_over_union(&a, &b).unwrap() - common / (2.0 - common)).abs() < 1e-14, "{shift}");
        assert!((intersection_over_union(&a, &aligned(&a, b)).unwrap() - 1.0).abs() < 1e-14, "{shift}");
    }
}

#[test]
fn common_volume_of_cube_and_octahedron_is_the_cuboctahedron() {
    // |x|, |y|, |z| <= 1 and |x| + |y| + |z| <= 2 has volume 20/3
    let octahedron = Polytope::new(&octahedron_normals(), &[2.0; 8]).unwrap();
    let common = common_volume(&cube(1.0), &octahedron).unwrap();
    assert!((common - 20.0 / 3.0).abs() < 1e-14, "{common}");
}

#[test]
fn hausdorff_distance_is_from_the_farthest_vertex() {
    let (small, large) = (cube(0.5), cube(1.0));
    assert!((hausdorff(&small, &large) - 0.75_f64.sqrt()).abs() < 1e-15);
    assert_eq!(hausdorff(&small, &small), 0.0);
    // beyond a face, an edge and a corner
    for (shift, distance) in [((2.0, 0.0, 0.0), 2.0), ((3.0, 4.0, 0.0), 5.0), ((2.0, 3.0, 6.0), 7.0)] {
        let moved = small.clone().translated(shift.into());
        assert!((hausdorff(&small, &moved) - distance).abs() < 1e-14, "{shift:?}");
    }
}

#[test]
fn distances_have_their_sign_and_points_lie_on_the_surface() {
    let body = random(60, 0.1, 13);
    let surface = Surface::new(&body);
    let points = surface.points(2000);
    assert_eq!(points.len(), 2000);
    assert!(points.iter().all(|&p| surface.signed_distance(p).abs() < 1e-14));
    assert!(surface.signed_distance(body.centroid()) < -0.9);
    // evenly spread: the mean of n.x over the surface is 3 V / A; low-discrepancy error about 1/2000
    let mean = points
        .iter()
        .map(|p| {
            body.normals()
                .zip(body.offsets())
                .map(|(n, h)| (h - n.dot(*p), *h))
                .fold((1.0, 0.0), |a: (f64, f64), b| if b.0 < a.0 { b } else { a })
                .1
        })
        .sum::<f64>()
        / 2000.0;
    assert!((mean * body.area() / (3.0 * body.volume()) - 1.0).abs() < 2e-3, "{mean}");
}

#[test]
fn chamfer_distance_of_concentric_cubes() {
    let (small, large) = (cube(0.5), cube(1.0));
    assert!(chamfer(&small, &small, 500) < 1e-15);
    // from the small cube 1/2 everywhere; from the large one the mean over a face of the distance to the small face at height 1/2,
    // by the midpoint rule
    let cells = 400;
    let place = |k: usize| (k as f64 + 0.5) / cells as f64;
    let beyond = |x: f64| (x - 0.5).max(0.0);
    let sum: f64 = (0..cells * cells)
        .map(|k| (place(k % cells), place(k / cells)))
        .map(|(x, y)| beyond(x).hypot(beyond(y)).hypot(0.5))
        .sum();
    let expected = 0.5 * (0.5 + sum / (cells * cells) as f64);
    assert!((chamfer(&small, &large, 20_000) / expected - 1.0).abs() < 1e-3, "{expected}");
}
