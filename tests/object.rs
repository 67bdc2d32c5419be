//! The light of shapes: laws, analytic scenes, and extremes by name.

use glam::{DMat3, DQuat, DVec3};
use nightglass::object::convex::{Epochs, Facet};
use nightglass::object::matter::{Material, Model};
use nightglass::object::shadow::body::Body;
use nightglass::object::shadow::bvh::Bvh;
use nightglass::object::shadow::exact::Exact;
use nightglass::object::shadow::raster::{self, Buffers};
use nightglass::object::shadow::rays::View;
use nightglass::object::shape::{Choice, Shape};
use nightglass::object::surface::mesh::Mesh;
use nightglass::object::surface::primitives::{box_wing, cuboid, dish, l_shape, plate, sphere, torus};
use nightglass::object::way::map_error;
use nightglass::study::object_accuracy::attitudes;
use std::f64::consts::PI;

fn shape(mesh: &Mesh) -> Shape {
    Shape::new(mesh, &Choice::default()).expect("a shape")
}

fn moved(mesh: &Mesh, by: DVec3) -> Mesh {
    mesh.transformed(&DMat3::IDENTITY, by)
}

fn joined(meshes: &[Mesh]) -> Mesh {
    let mut all = Mesh::default();
    meshes.iter().for_each(|mesh| all.merge(mesh).expect("room"));
    all
}

/// Lambert weights of albedo 1 times pi: both cosines, on the lit side of sheets.
fn cosines(body: &Body, sun: DVec3, observer: DVec3) -> Vec<f64> {
    let weight = |(n, sheet): (&DVec3, &bool)| {
        let n = if *sheet && n.dot(sun) < 0.0 { -*n } else { *n };
        n.dot(sun).max(0.0) * n.dot(observer).max(0.0)
    };
    body.normals.iter().zip(&body.sheet).map(weight).collect()
}

fn flux(body: &Body, sun: DVec3, observer: DVec3) -> f64 {
    Exact::default().flux(body, sun, observer, &cosines(body, sun, observer))
}

/// A box with a dish above it, open towards the box's side.
fn box_and_dish() -> Mesh {
    let bowl = dish(1.4, 0.4, 24).transformed(&DMat3::from_rotation_x(0.4), DVec3::new(0.1, -0.2, 0.9));
    joined(&[cuboid(DVec3::ONE), bowl])
}

fn scenes() -> Vec<(&'static str, Body)> {
    [
        ("cube", cuboid(DVec3::ONE)),
        ("L", l_shape()),
        ("box-wing", box_wing()),
        ("box and dish", box_and_dish()),
        ("torus", torus(2.0, 0.7, 40, 20)),
    ]
    .map(|(name, mesh)| (name, shape(&mesh).body))
    .into()
}

fn permuted(body: &Body) -> Body {
    let n = body.faces.len();
    // 7919 is prime and no divisor of the counts here
    let order = (0..n).map(|k| (k * 7919 + 13) % n).collect::<Vec<_>>();
    let faces = order.iter().map(|k| body.faces[*k]).collect();
    Body::new(body.vertices.clone(), faces, order.iter().map(|k| body.sheet[*k]).collect())
}

/// Each face parted into four by the middles of its edges.
fn subdivided(body: &Body) -> Body {
    let (mut vertices, mut faces, mut sheet) = (body.vertices.clone(), Vec::new(), Vec::new());
    for (k, [a, b, c]) in body.faces.iter().enumerate() {
        let corners = body.corners(k);
        let first = vertices.len() as u32;
        for (i, j) in [(0, 1), (1, 2), (2, 0)] {
            vertices.push(0.5 * (corners[i] + corners[j]));
        }
        let [ab, bc, ca] = [first, first + 1, first + 2];
        faces.extend([[*a, ab, ca], [ab, *b, bc], [ca, bc, *c], [ab, bc, ca]]);
        sheet.extend([body.sheet[k]; 4]);
    }
    Body::new(vertices, faces, sheet)
}

/// The light does not depend on the order of faces (1e-13), on how finely flat faces are cut (1e-12), nor on the axes (1e-12): of
/// the light without shadows.
#[test]
fn the_exact_light_is_that_of_the_surface_alone() {
    for (name, body) in scenes() {
        let (other, fine) = (permuted(&body), subdivided(&body));
        let turn = DQuat::from_scaled_axis(DVec3::new(0.3, -1.1, 0.7));
        let mut turned = body.clone();
        turned.move_to(&body.vertices.iter().map(|v| turn * *v).collect::<Vec<_>>());
        for (sun, observer) in attitudes(40) {
            let whole: f64 = cosines(&body, sun, observer).iter().zip(&body.areas).map(|(w, a)| w * a).sum();
            let light = flux(&body, sun, observer);
            let order = flux(&other, sun, observer) - light;
            let cut = flux(&fine, sun, observer) - light;
            let axes = flux(&turned, turn * sun, turn * observer) - light;
            assert!(order.abs() <= 1e-13 * whole, "{name}: order {order:e} of {whole}");
            assert!(cut.abs() <= 1e-12 * whole, "{name}: subdivision {cut:e} of {whole}");
            assert!(axes.abs() <= 1e-12 * whole, "{name}: rotation {axes:e} of {whole}");
            assert!(light <= whole * (1.0 + 1e-13) && light >= 0.0);
        }
    }
}

/// Sun and observer change places without changing the light (reciprocity of geometry and of Lambert's law).
#[test]
fn sun_and_observer_may_change_places() {
    for (name, body) in scenes() {
        for (sun, observer) in attitudes(20) {
            let (one, other) = (flux(&body, sun, observer), flux(&body, observer, sun));
            assert!((one - other).abs() < 1e-12 * (one + 1.0), "{name}: {one} {other}");
        }
    }
}

/// A million rays agree with the exact light within 4 of their standard errors, and maps within their stated error.
#[test]
fn rays_and_maps_agree_with_the_exact_light() {
    for (name, body) in scenes() {
        let bvh = Bvh::new(&body);
        for (k, (sun, observer)) in attitudes(6).into_iter().enumerate() {
            let weight = cosines(&body, sun, observer);
            let exact = Exact::default().flux(&body, sun, observer, &weight);
            let estimate = View::new(&body, &bvh, sun, observer, &weight).flux(1_000_000, k as u64);
            let off = (estimate.value - exact).abs();
            assert!(off <= 4.0 * estimate.error + 1e-12 * exact, "{name}: {exact} {estimate:?}");
            let whole: f64 = weight.iter().zip(&body.areas).map(|(w, a)| w * a).sum();
            let map = raster::flux(&body, sun, observer, &weight, 512, &mut Buffers::default());
            assert!((map - exact).abs() < map_error(512) * whole, "{name}: {exact} {map}");
        }
    }
}

/// A plate of side 2 at height 1 over a plate of side 4, Sun at 45 deg in the x-z plane: its shadow is a square of side 2 shifted by
/// 1, all of it on the lower plate, so that the observer overhead sees 16 - 4 - what the upper plate hides beside its shadow.
#[test]
fn a_plate_shades_a_plate_by_the_area_found_by_hand() {
    let body = shape(&joined(&[plate(4.0, 4.0), moved(&plate(2.0, 2.0), DVec3::Z)])).body;
    assert!(body.sheet.iter().all(|s| *s));
    let (sun, observer) = (DVec3::new(1.0, 0.0, 1.0).normalize(), DVec3::Z);
    // shadow: x from -2 to 0; hidden: x from -1 to 1; union 3 x 2 = 6; the upper plate adds its 4
    let by_hand = sun.z * (16.0 - 6.0 + 4.0);
    assert!((flux(&body, sun, observer) - by_hand).abs() < 1e-13 * by_hand);
    // from below: the lower plate hides all, and is lit from above only
    assert_eq!(flux(&body, sun, DVec3::new(0.0, 0.01, -1.0).normalize()), 0.0);
    // lit and seen from below the lower plate alone shows
    let (sun, observer) = (-sun, -observer);
    assert!((flux(&body, sun, observer) + sun.z * 16.0).abs() < 1e-12);
}

/// A panel tilted by 30 deg over a box's lid, hinged at its edge; the Sun overhead, the observer overhead: the lid loses the
/// panel's projection, the panel gives cos^2 of its tilt.
#[test]
fn a_tilted_panel_over_a_box() {
    let tilt = PI / 6.0;
    let panel = plate(1.0, 2.0).transformed(&DMat3::from_rotation_y(-tilt), DVec3::new(0.0, 0.0, 2.0));
    let body = shape(&joined(&[cuboid(DVec3::splat(2.0)), panel])).body;
    let by_hand = (4.0 - 2.0 * tilt.cos()) + 2.0 * tilt.cos().powi(2);
    let light = flux(&body, DVec3::Z, DVec3::Z);
    assert!((light - by_hand).abs() < 1e-13 * by_hand, "{light} {by_hand}");
}

/// Solids count by their union: touching, overlapping and nested boxes are one body.
#[test]
fn touching_and_nested_boxes_are_their_union() {
    let unit = cuboid(DVec3::ONE);
    let long = shape(&moved(&cuboid(DVec3::new(2.0, 1.0, 1.0)), DVec3::new(0.5, 0.0, 0.0))).body;
    let touching = shape(&joined(&[unit.clone(), moved(&unit, DVec3::X)])).body;
    let overlapping = shape(&joined(&[unit.clone(), moved(&unit, DVec3::X), moved(&unit, DVec3::X * 0.3)])).body;
    let large = shape(&cuboid(DVec3::splat(3.0))).body;
    let nested = shape(&joined(&[cuboid(DVec3::splat(3.0)), unit.clone()])).body;
    let twice = shape(&joined(&[unit.clone(), unit])).body;
    let once = shape(&cuboid(DVec3::ONE)).body;
    for (sun, observer) in attitudes(60) {
        for (name, whole, parts) in [
            ("touching", &long, &touching),
            ("overlapping", &long, &overlapping),
            ("nested", &large, &nested),
            ("coplanar duplicates", &once, &twice),
        ] {
            let (one, other) = (flux(whole, sun, observer), flux(parts, sun, observer));
            assert!((one - other).abs() <= 1e-12 * one.max(1.0), "{name}: {one} {other}");
        }
    }
}

/// A body wholly in the shadow of another, seen from where the other is not, is dark to the last bit.
#[test]
fn what_is_wholly_shaded_is_exactly_dark() {
    let screen = moved(&cuboid(DVec3::new(9.0, 9.0, 0.1)), DVec3::Z * 5.0);
    let body = shape(&joined(&[box_wing_small(), screen])).body;
    let weight = cosines(&body, DVec3::Z, DVec3::new(1.0, 0.0, 0.2).normalize());
    let mut seen = 0.0;
    Exact::default().visible(&body, DVec3::Z, DVec3::new(1.0, 0.0, 0.2).normalize(), &weight, |face, area| {
        if body.corners(face).iter().all(|v| v.z < 4.0) {
            seen += area;
        }
    });
    assert_eq!(seen, 0.0);
}

fn box_wing_small() -> Mesh {
    box_wing().scaled(0.3)
}

/// Two thirds of the radius squared times C_d (sin a + (pi - a) cos a)/pi, to 5e-6 with 6400 facets or a little more.
#[test]
fn the_lambert_sphere_is_the_analytic_one() {
    // a Fibonacci polytope, as the design's: facets tangent to the sphere at even directions, areas of their cells about 4 pi/n
    let n = 6400;
    let golden = PI * (3.0 - 5f64.sqrt());
    let facets = (0..n).map(|k| {
        let z = 1.0 - 2.0 * (f64::from(k) + 0.5) / f64::from(n);
        let (r, turn) = ((1.0 - z * z).sqrt(), golden * f64::from(k));
        Facet { normal: DVec3::new(r * turn.cos(), r * turn.sin(), z), area: 4.0 * PI / f64::from(n) }
    });
    let facets = facets.collect::<Vec<_>>();
    for degrees in [0.0f64, 15.0, 30.0, 45.0, 60.0, 75.0, 90.0] {
        let phase = degrees.to_radians();
        let epochs = Epochs::new((0..50).map(|k| {
            let turn = DQuat::from_scaled_axis(DVec3::new(0.7, -0.4, 1.3) * (1.0 + f64::from(k)));
            (turn * DVec3::X, turn * DVec3::new(phase.cos(), phase.sin(), 0.0))
        }));
        let light = epochs.curve(&facets, &Material::lambert(1.0), 0.0);
        let mean = light.iter().sum::<f64>() / light.len() as f64;
        let exact = 2.0 / 3.0 * (phase.sin() + (PI - phase) * phase.cos()) / PI;
        assert!((mean / exact - 1.0).abs() < 5e-6, "{degrees}: {}", mean / exact - 1.0);
    }
}

/// The sum over lanes is that of the facets one by one, and its gradient that of differences.
#[test]
fn the_convex_sum_and_its_gradient() {
    let body = shape(&sphere(1.0, 3)).body;
    let directions = attitudes(77);
    let epochs = Epochs::new(directions.iter().copied());
    let facets =
        body.normals.iter().zip(&body.areas).map(|(n, a)| Facet { normal: *n, area: *a }).collect::<Vec<_>>();
    let light = epochs.curve(&facets, &Material::lambert(PI), 0.0);
    for ((sun, observer), light) in directions.iter().zip(&light) {
        let exact = flux(&body, *sun, *observer);
        assert!((light - exact).abs() < 1e-13 * exact.max(1.0), "{light} {exact}");
    }
    let normal = DVec3::new(0.2, 0.5, -0.8).normalize();
    let step = 1e-6;
    let phong = Material { model: Model::Phong, specular: 0.3, exponent: 5.0, ..Material::lambert(0.5) };
    for material in [Material::lambert(0.5), phong] {
        let column = epochs.column(normal, &material, 0.0);
        let [values, first, second] = epochs.column_slopes(normal, [DVec3::X, DVec3::Z], &material);
        for (axis, slopes) in [(DVec3::X, first), (DVec3::Z, second)] {
            let at = |h: f64| epochs.column(normal + axis * h, &material, 0.0);
            let (above, below) = (at(step), at(-step));
            for (t, (value, slope)) in values.iter().zip(slopes).enumerate() {
                assert!((value - column[t]).abs() < 1e-15);
                let difference = (above[t] - below[t]) / (2.0 * step);
                assert!((difference - slope).abs() < 1e-8 || *value < 1e-6, "{t}: {difference} {slope}");
            }
        }
    }
}

/// Sizes from 1e-6 to 1e6 m: the light goes with the square.
#[test]
fn bodies_of_every_size() {
    let body = shape(&box_wing()).body;
    for factor in [1e-6, 1e-3, 1e3, 1e6] {
        let other = shape(&box_wing().scaled(factor)).body;
        for (sun, observer) in attitudes(20) {
            let (one, two) = (flux(&body, sun, observer), flux(&other, sun, observer) / (factor * factor));
            assert!((one - two).abs() <= 1e-12 * one.max(1e-3), "{factor}: {one} {two}");
        }
    }
}

/// Grazing light, directions in planes of faces, phase angles of 0 and 180 deg exactly, slivers, faces without area, an empty mesh.
#[test]
fn extremes_give_finite_light() {
    let body = shape(&l_shape()).body;
    let x = DVec3::X;
    assert!(flux(&body, x, x) > 0.0);
    assert_eq!(flux(&body, x, -x), 0.0);
    let grazing = DVec3::new(1.0, 1e-16, 0.0);
    for (sun, observer) in
        [(grazing, DVec3::Z), (DVec3::Z, grazing), (grazing, grazing), (x, DVec3::Y), (DVec3::Y, DVec3::Z)]
    {
        let light = flux(&body, sun, observer);
        assert!(light.is_finite() && light >= 0.0, "{sun} {observer}: {light}");
    }
    // light grazing one side of a cube at 1e-16 gives that side 1e-16 of its light
    let cube = shape(&cuboid(DVec3::ONE)).body;
    let light = flux(&cube, grazing, DVec3::Y);
    assert!((light - 1e-16).abs() < 1e-28, "{light:e}");
    let empty = Body::default();
    assert_eq!(flux(&empty, x, x), 0.0);
    assert!(empty.is_convex());
    // a sliver of 1e-12 and a face without area beside a triangle
    let vertices = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::new(1.0, 1e-12, 0.0), DVec3::new(0.5, 0.0, 0.0)];
    let faces = vec![[0, 1, 2], [0, 1, 3], [0, 4, 1]];
    let odd = Body::new(vertices, faces, vec![true; 3]);
    let light = flux(&odd, DVec3::Z, DVec3::Z);
    assert!((light - 0.5).abs() < 1e-11, "{light}");
    let nowhere = DVec3::NAN;
    let light = flux(&body, nowhere, x);
    assert!(light.is_nan() || light == 0.0, "{light}");
}

/// A box with its winding turned is dark where the right one is lit, and says so when it is checked.
#[test]
fn flipped_winding_is_told_and_repaired() {
    use nightglass::object::surface::{check, repair};
    let mut mesh = cuboid(DVec3::ONE);
    for face in &mut mesh.faces {
        face.corners.swap(1, 2);
    }
    let told = check::faults(&mesh).iter().map(ToString::to_string).collect::<Vec<_>>().join("\n");
    assert!(told.contains("inside out"), "{told}");
    let (mended, done) = repair::repair(&mesh);
    assert!(!done.is_empty());
    let (sun, observer) = (DVec3::new(1.0, 2.0, 3.0).normalize(), DVec3::new(3.0, 1.0, 2.0).normalize());
    let exact = flux(&shape(&cuboid(DVec3::ONE)).body, sun, observer);
    assert!((flux(&shape(&mended).body, sun, observer) - exact).abs() < 1e-14);
}

/// 200,000 faces: within a few seconds, and the light of the torus that they make.
#[test]
fn two_hundred_thousand_faces() {
    let body = shape(&torus(2.0, 0.7, 500, 200)).body;
    assert_eq!(body.faces.len(), 200_000);
    let (sun, observer) = attitudes(7)[3];
    let coarse = flux(&shape(&torus(2.0, 0.7, 125, 50)).body, sun, observer);
    let light = flux(&body, sun, observer);
    assert!((light / coarse - 1.0).abs() < 0.01, "{light} {coarse}");
}
