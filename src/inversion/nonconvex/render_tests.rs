use super::part::{PARAMETERS, Part};
use super::render::{Force, Renderer};
use crate::inversion::synthetic::{Stream, directions};
use crate::object::matter::{Material, Model, weight};
use crate::object::shadow::body::Body;
use crate::object::shadow::exact::Exact;
use glam::{DMat3, DQuat, DVec3};

fn any(stream: &mut Stream, reach: f64) -> Part {
    let axes = DMat3::from_quat(DQuat::from_rotation_arc(DVec3::Z, stream.direction()));
    let mut size = || 0.2 + stream.uniform();
    let half = DVec3::new(size(), size(), size());
    Part { centre: stream.direction() * reach, axes, half }
}

/// The same light by clipped triangles.
fn reference(parts: &[Part], material: &Material, (sun, observer): (DVec3, DVec3)) -> f64 {
    let corners: Vec<DVec3> = parts.iter().flat_map(Part::triangles).flatten().collect();
    let faces: Vec<[u32; 3]> = (0..corners.len() as u32 / 3).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
    let sheet = vec![false; faces.len()];
    let body = Body::new(corners, faces, sheet);
    let weights: Vec<f64> = body.normals.iter().map(|n| weight(material, *n, sun, observer, 0.0)).collect();
    Exact::default().flux(&body, sun, observer, &weights)
}

#[test]
fn light_is_that_of_clipped_triangles_to_round_off() {
    let mut stream = Stream::new(5);
    let mut renderer = Renderer::default();
    let material = Material { model: Model::Phong, diffuse: 0.4, specular: 0.3, exponent: 6.0, roughness: 0.3 };
    for trial in 0..40 {
        let parts: Vec<Part> = (0..1 + trial % 4).map(|_| any(&mut stream, 0.9)).collect();
        for pair in directions(20, &mut stream) {
            let light = renderer.light(&parts, &material, pair, None);
            let truth = reference(&parts, &material, pair);
            assert!((light - truth).abs() < 1e-11 * (1.0 + truth), "{trial}: {light} {truth}");
        }
    }
}

#[test]
fn faces_in_one_plane_count_once_and_touching_faces_not_at_all() {
    let mut stream = Stream::new(6);
    let material = Material::lambert(0.7);
    let part = |centre, half| Part { centre, axes: DMat3::IDENTITY, half };
    let whole = [part(DVec3::ZERO, DVec3::new(2.0, 1.0, 1.0))];
    let overlapping =
        [part(-DVec3::X * 0.5, DVec3::new(1.5, 1.0, 1.0)), part(DVec3::X * 0.5, DVec3::new(1.5, 1.0, 1.0))];
    let touching = [part(-DVec3::X, DVec3::ONE), part(DVec3::X, DVec3::ONE)];
    let mut renderer = Renderer::default();
    for pair in directions(50, &mut stream) {
        let light = renderer.light(&whole, &material, pair, None);
        for parts in [&overlapping, &touching] {
            let same = renderer.light(parts, &material, pair, None);
            assert!((light - same).abs() < 1e-9, "{light} {same}");
        }
    }
}

#[test]
fn derivatives_are_those_of_differences() {
    let mut stream = Stream::new(7);
    let mut renderer = Renderer::default();
    let material =
        Material { model: Model::BlinnPhong, diffuse: 0.4, specular: 0.3, exponent: 6.0, roughness: 0.3 };
    let mut worst = 0.0f64;
    let (mut rough, mut count) = (0, 0);
    for trial in 0..30 {
        let parts: Vec<Part> = (0..1 + trial % 3).map(|_| any(&mut stream, 0.8)).collect();
        for pair in directions(4, &mut stream) {
            let mut forces = vec![Force::default(); parts.len()];
            renderer.light(&parts, &material, pair, Some(&mut forces));
            for (number, force) in forces.iter().enumerate() {
                for (k, analytic) in force.to_array().into_iter().enumerate() {
                    let mut at = |h: f64| {
                        let mut step = [0.0; PARAMETERS];
                        step[k] = h;
                        let mut moved = parts.clone();
                        moved[number] = parts[number].moved(&step);
                        renderer.light(&moved, &material, pair, None)
                    };
                    let numeric = (at(1e-5) - at(-1e-5)) / 2e-5;
                    let error = (numeric - analytic).abs();
                    count += 1;
                    // a kink within the difference
                    if error > 1e-6 {
                        rough += 1;
                        eprintln!("{trial} {number} {k} {analytic} {numeric}")
                    } else {
                        worst = worst.max(error)
                    }
                }
            }
        }
    }
    assert!(count > 1000 && rough * 200 < count, "{rough} of {count}");
    assert!(worst < 1e-6);
}
