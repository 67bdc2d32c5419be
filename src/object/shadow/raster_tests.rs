//! Shadow maps against areas known in closed form.

use super::body::Body;
use super::fixtures::*;
use super::raster::{Buffers, NONE, flux, picture};
use glam::DVec3;

fn light(body: &Body, sun: DVec3, observer: DVec3, weight: &[f64], side: u32) -> f64 {
    flux(body, sun, observer, weight, side, &mut Buffers::default())
}

/// Rms of the relative errors over `cases` of body, directions, weights and exact light.
fn rms(cases: &[(Body, [DVec3; 2], Vec<f64>, f64)], side: u32) -> (f64, f64) {
    let error = |(body, [sun, observer], weight, exact): &(Body, [DVec3; 2], Vec<f64>, f64)| {
        light(body, *sun, *observer, weight, side) / exact - 1.0
    };
    let errors: Vec<f64> = cases.iter().map(error).collect();
    let count = errors.len() as f64;
    ((errors.iter().map(|e| e * e).sum::<f64>() / count).sqrt(), errors.iter().sum::<f64>() / count)
}

fn convex(body: &Body) -> Vec<(Body, [DVec3; 2], Vec<f64>, f64)> {
    let case = |[sun, observer]: [DVec3; 2]| {
        let weight = lambert(body, sun, observer);
        let exact = unshadowed(body, &weight);
        (body.clone(), [sun, observer], weight, exact)
    };
    geometries(40).into_iter().map(case).filter(|(.., exact)| *exact > 0.1).collect()
}

/// Two plates, one above the other: what the upper shades or hides of the lower is a rectangle each.
fn plates(phase: Option<f64>) -> Vec<(Body, [DVec3; 2], Vec<f64>, f64)> {
    let body = union(&[plate([0.0, 0.0], [4.0, 3.0], 0.0), plate([1.0, 0.5], [2.5, 2.0], 0.8)]);
    let case = |[sun, observer]: [DVec3; 2]| {
        // both from above
        let (sun, observer) = (sun.with_z(sun.z.abs()), observer.with_z(observer.z.abs()));
        let near = glam::DQuat::from_axis_angle(sun.any_orthonormal_vector(), phase.unwrap_or(0.0)) * sun;
        let observer = if phase.is_some() { near } else { observer };
        let shadow = |d: DVec3| {
            let (dx, dy) = (-0.8 * d.x / d.z, -0.8 * d.y / d.z);
            [[1.0 + dx, 2.5 + dx], [0.5 + dy, 2.0 + dy]]
        };
        let meet = |a: [f64; 2], b: [f64; 2]| [a[0].max(b[0]), a[1].min(b[1])];
        let area = |[x, y]: [[f64; 2]; 2]| (x[1] - x[0]).max(0.0) * (y[1] - y[0]).max(0.0);
        let [s, o] = [sun, observer].map(shadow).map(|[x, y]| [meet(x, [0.0, 4.0]), meet(y, [0.0, 3.0])]);
        let both = area([meet(s[0], o[0]), meet(s[1], o[1])]);
        let weight = lambert(&body, sun, observer);
        let exact = weight[0] * (12.0 - area(s) - area(o) + both) + weight[2] * 2.25;
        (body.clone(), [sun, observer], weight, exact)
    };
    let steep = |[sun, observer]: &[DVec3; 2]| sun.z.abs() > 0.2 && observer.z.abs() > 0.2;
    geometries(80).into_iter().filter(steep).map(case).collect()
}

/// The same at small phase angles: edges of shadows run along outlines.
#[test]
fn errors_at_small_phase_angles() {
    for phase in [1e-4, 1e-3, 1e-2, 3e-2] {
        let cases = plates(Some(phase));
        for side in [64, 256] {
            let (rms, mean) = rms(&cases, side);
            assert!(rms < 4.0 * f64::from(side).powf(-1.5), "{phase} {side}: {rms:.2e}, mean {mean:.2e}");
        }
    }
}

/// An L with the Sun behind its tall arm and the observer in front: the shadow on the step is a trapezium.
fn ells() -> Vec<(Body, [DVec3; 2], Vec<f64>, f64)> {
    let length = 3.0;
    let body = ell(length);
    let case = |k: usize| {
        let (a, c) = (0.1 + 0.02 * k as f64, 0.013 * k as f64);
        let sun = DVec3::new(-a, c, 1.0).normalize();
        let observer = DVec3::new(0.5, 0.1 + 0.01 * k as f64, 0.8).normalize();
        let weight = lambert(&body, sun, observer);
        let shaded = a * length - a * c / 2.0;
        let step = body
            .normals
            .iter()
            .zip(&body.faces)
            .position(|(n, f)| n.z > 0.9 && f.iter().all(|v| body.vertices[*v as usize].z == 1.0));
        let exact = unshadowed(&body, &weight) - weight[step.unwrap()] * shaded;
        (body.clone(), [sun, observer], weight, exact)
    };
    (0..40).map(case).collect()
}

#[test]
fn errors_fall_with_the_side() {
    // measured: rms 3 side^-1.5 at most; mean 0.3 of it, above 0: rows across a convex outline take a bit too much
    let block = block(DVec3::new(0.0, 0.0, 0.0), DVec3::new(1.0, 1.0, 1.0));
    let cases =
        [("cube", convex(&block)), ("sphere", convex(&sphere(8))), ("plates", plates(None)), ("L", ells())];
    for (name, cases) in &cases {
        for side in [16, 32, 64, 128, 256, 512] {
            let (rms, mean) = rms(cases, side);
            let bound = 4.0 * f64::from(side).powf(-1.5);
            assert!(rms < bound, "{name} at {side}: rms {rms:.2e}, mean {mean:.2e}");
        }
    }
}

#[test]
fn a_lit_hollow_has_no_shadow() {
    // faces that meet in a hollow, both lit: no pixel along the edge is dark
    let body = ell(3.0);
    let (sun, observer) = (DVec3::new(0.6, 0.2, 0.7).normalize(), DVec3::new(0.5, -0.3, 0.8).normalize());
    let view = picture(&body, sun, observer, DVec3::Z, 512, &mut Buffers::default());
    let dark = view
        .face
        .iter()
        .zip(&view.lit)
        .filter(|(face, lit)| **face != NONE && !**lit && body.normals[**face as usize].dot(sun) > 0.0);
    assert_eq!(dark.count(), 0);
}

#[test]
fn a_shadow_starts_at_the_foot_of_a_wall() {
    // the Sun behind the tall arm of the L: along the foot of the wall all of the step is dark
    let body = ell(3.0);
    let (sun, observer) = (DVec3::new(-0.3, 0.0, 1.0).normalize(), DVec3::new(0.5, 0.1, 0.8).normalize());
    let view = picture(&body, sun, observer, DVec3::Z, 512, &mut Buffers::default());
    let step =
        |face: u32| face != NONE && body.faces[face as usize].iter().all(|v| body.vertices[*v as usize].z == 1.0);
    let pixels = || view.face.iter().zip(&view.lit).filter(|(face, _)| step(**face));
    let (all, lit) = (pixels().count() as f64, pixels().filter(|(_, lit)| **lit).count() as f64);
    assert!((lit / all - 0.7).abs() < 2e-3, "{}", lit / all);
}

#[test]
fn special_directions() {
    let body = satellite();
    for sun in directions(20) {
        // no shadow is seen from the Sun: what is lit is the outline
        let weight = lambert(&body, sun, sun);
        let view = picture(&body, sun, sun, DVec3::Y, 256, &mut Buffers::default());
        let dark = view.face.iter().zip(&view.lit).filter(|(face, lit)| **face != NONE && !**lit).count();
        // pixels along the outlines, where the two maps differ by half a pixel
        assert!(dark < 256, "{dark}");
        assert!(light(&body, sun, sun, &weight, 256) > 0.0);
        assert_eq!(light(&body, sun, -sun, &vec![1.0; body.faces.len()], 64), 0.0);
    }
    let weight = vec![1.0; body.faces.len()];
    for bad in [DVec3::ZERO, DVec3::NAN, DVec3::INFINITY, DVec3::X * 1e-320] {
        assert_eq!(light(&body, bad, DVec3::Z, &weight, 64), 0.0);
        assert_eq!(light(&body, DVec3::Z, bad, &weight, 64), 0.0);
        assert!(
            picture(&body, bad, DVec3::Z, DVec3::Y, 8, &mut Buffers::default()).face.iter().all(|f| *f == NONE)
        );
        let turned = picture(&body, DVec3::Z, DVec3::Z, bad, 8, &mut Buffers::default());
        assert!(turned.face.iter().any(|f| *f != NONE));
    }
    // the Sun in the plane of a face, and along the axes
    for (sun, observer) in [(DVec3::X, DVec3::Z), (DVec3::X, DVec3::X), (DVec3::Y, DVec3::new(0.0, 0.6, 0.8))] {
        let flux = light(&body, sun, observer, &lambert(&body, sun, observer), 128);
        assert!(flux.is_finite() && flux >= 0.0);
    }
}

#[test]
fn the_owner_of_an_overlap_has_its_light() {
    let mut body = union(&[plate([0.0, 0.0], [1.0, 1.0], 0.0), plate([0.5, 0.0], [2.0, 1.0], 0.0)]);
    let sun = DVec3::new(0.3, 0.2, 1.0).normalize();
    let observer = DVec3::new(-0.4, 0.1, 1.0).normalize();
    for (owner, weights, expected) in
        [(0, [1.0, 1.0, 5.0, 5.0], 6.0), (2, [1.0, 1.0, 5.0, 5.0], 8.0), (0, [0.0, 0.0, 5.0, 5.0], 5.0)]
    {
        let pairs = [(0, 2), (0, 3), (1, 2), (1, 3)];
        body.coplanar = pairs.map(|(a, b)| if owner == 0 { (a, b) } else { (b, a) }).to_vec();
        body.coplanar.sort_by_key(|pair| pair.1);
        let flux = light(&body, sun, observer, &weights, 512);
        assert!((flux / expected - 1.0).abs() < 3e-3, "{flux}");
    }
}

#[test]
fn touching_solids_shade_each_other_alone() {
    // a box on a box: the faces in contact are nowhere seen and shade nothing
    let one = DVec3::ONE;
    let body = union(&[block(DVec3::ZERO, one), block(DVec3::Z, one + DVec3::Z)]);
    let tall = block(DVec3::ZERO, DVec3::new(1.0, 1.0, 2.0));
    for [sun, observer] in geometries(20) {
        let [two, one] = [&body, &tall].map(|b| light(b, sun, observer, &lambert(b, sun, observer), 256));
        assert!((two - one).abs() < 1e-3 * (one + 0.01), "{two} {one}");
    }
}

#[test]
fn every_size_gives_the_same_light() {
    let body = satellite();
    let [sun, observer] = geometries(9)[4];
    let weight = lambert(&body, sun, observer);
    let unit = light(&body, sun, observer, &weight, 200);
    for size in [1e-150, 1e-6, 1e6, 1e150] {
        let mut scaled = body.clone();
        scaled.vertices.iter_mut().for_each(|p| *p = (*p + 3.0) * size);
        let flux = light(&scaled, sun, observer, &weight, 200) / size.powi(2);
        assert!((flux / unit - 1.0).abs() < 1e-3, "{size:e}: {flux} {unit}");
    }
}

#[test]
fn broken_bodies_have_the_light_of_what_is_whole() {
    let [sun, observer] = geometries(9)[3];
    assert_eq!(light(&Body::default(), sun, observer, &[1.0], 64), 0.0);
    let mut body = satellite();
    let mut weight = lambert(&body, sun, observer);
    let whole = light(&body, sun, observer, &weight, 64);
    let first = body.vertices.len() as u32;
    body.vertices.extend([DVec3::NAN, DVec3::INFINITY, DVec3::ZERO]);
    // not finite, no such corner, a point, a line
    body.faces.extend([[0, 1, first], [0, first + 1, 2], [0, 1, 9999], [5, 5, 5], [0, 1, 0]]);
    body.normals.extend([DVec3::Z, DVec3::Z, DVec3::Z, DVec3::ZERO, DVec3::ZERO]);
    body.coplanar = vec![(9999, 0), (0, 9999)];
    weight.extend([9.0; 5]);
    assert_eq!(light(&body, sun, observer, &weight, 64), whole);
    // fewer normals, sheets and weights than faces
    body.sheet.clear();
    assert_eq!(light(&body, sun, observer, &weight, 64), whole);
    assert!(light(&body, sun, observer, &weight[..10], 64) <= whole);
    weight.iter_mut().for_each(|w| *w = f64::NAN);
    assert_eq!(light(&body, sun, observer, &weight, 64), 0.0);
    body.normals.clear();
    assert_eq!(light(&body, sun, observer, &[f64::INFINITY; 40], 64), 0.0);
    body.vertices.iter_mut().for_each(|p| *p *= 1e300);
    assert!(light(&body, sun, observer, &[1.0; 40], 64) >= 0.0);
    for vertices in [vec![], vec![DVec3::ONE; 3], vec![DVec3::splat(f64::MAX), DVec3::splat(f64::MIN)]] {
        let body = Body { vertices, ..satellite() };
        assert_eq!(light(&body, sun, observer, &[1.0; 36], 64), 0.0);
    }
}

#[test]
fn every_side_and_many_faces() {
    let body = sphere(130);
    assert!(body.faces.len() > 200_000);
    let [sun, observer] = geometries(9)[4];
    let weight = lambert(&body, sun, observer);
    let exact = unshadowed(&body, &weight);
    assert!((light(&body, sun, observer, &weight, 1024) / exact - 1.0).abs() < 1e-3);
    let body = detailed();
    let weight = lambert(&body, sun, observer);
    let fine = light(&body, sun, observer, &weight, 1500);
    let mut buffers = Buffers::default();
    // out of range is brought into it; buffers of another size do not matter
    for (side, bound) in [(0, 20.0), (1, 20.0), (2, 20.0), (3, 20.0), (100, 0.04), (8192, 5e-4), (101, 0.04)] {
        let flux = flux(&body, sun, observer, &weight, side, &mut buffers);
        assert!((flux / fine - 1.0).abs() < bound, "{side}: {flux} {fine}");
    }
}
