//! The GPU against the CPU.

use super::body::Body;
use super::fixtures::*;
use super::gpu::{Epoch, Gpu, GpuError, Kind, adapters};
use super::raster::{Buffers, flux};
use glam::DVec3;

/// A device. Without one the test ends here, unless one is demanded.
fn gpu() -> Option<Gpu> {
    match Gpu::open(Kind::Any) {
        Ok(gpu) => Some(gpu),
        Err(error) => {
            let demanded = std::env::var("NIGHTGLASS_REQUIRE_GPU").is_ok_and(|value| value == "1");
            assert!(!demanded, "{error}");
            assert!(matches!(error, GpuError::NoAdapter { .. } | GpuError::NoDevice { .. }), "{error}");
            assert!(!error.to_string().is_empty());
            None
        }
    }
}

/// Directions and weights of epochs.
fn epochs(body: &Body, count: usize) -> Vec<([DVec3; 2], Vec<f64>)> {
    geometries(count).into_iter().map(|d| (d, lambert(body, d[0], d[1]))).collect()
}

fn on_gpu(gpu: &mut Gpu, body: &Body, epochs: &[([DVec3; 2], Vec<f64>)], side: u32) -> Vec<f64> {
    let epochs: Vec<Epoch> =
        epochs.iter().map(|([sun, observer], w)| Epoch { sun: *sun, observer: *observer, weight: w }).collect();
    gpu.flux(body, &epochs, side).unwrap()
}

fn on_cpu(body: &Body, epochs: &[([DVec3; 2], Vec<f64>)], side: u32) -> Vec<f64> {
    let mut buffers = Buffers::default();
    epochs.iter().map(|([s, o], weight)| flux(body, *s, *o, weight, side, &mut buffers)).collect()
}

#[test]
fn shaders_are_core_wgsl() {
    use naga::valid::{Capabilities, ValidationFlags, Validator};
    for source in
        [include_str!("../../../shaders/face_map.wgsl"), include_str!("../../../shaders/face_light.wgsl")]
    {
        let module = naga::front::wgsl::parse_str(source).unwrap();
        Validator::new(ValidationFlags::all(), Capabilities::empty()).validate(&module).unwrap();
        assert!(source.starts_with("// ") && source.contains("src/object/shadow/raster.rs"));
    }
}

#[test]
fn the_twins_agree() {
    let Some(mut gpu) = gpu() else { return };
    let plates = union(&[plate([0.0, 0.0], [4.0, 3.0], 0.0), plate([1.0, 0.5], [2.5, 2.0], 0.8)]);
    let bodies = [("satellite", satellite()), ("detailed", detailed()), ("L", ell(3.0)), ("plates", plates)];
    for (name, body) in &bodies {
        let epochs = epochs(body, 40);
        for side in [64, 100, 512] {
            let pairs: Vec<_> =
                on_cpu(body, &epochs, side).into_iter().zip(on_gpu(&mut gpu, body, &epochs, side)).collect();
            let largest = pairs.iter().map(|p| p.0).fold(0.0, f64::max);
            let worst = pairs.iter().map(|(c, g)| (c - g).abs() / c.max(0.05 * largest)).fold(0.0, f64::max);
            // measured: 0.2/side; 1.3e-4 at 512
            assert!(worst < 0.5 / f64::from(side), "{name} {side}: {worst:.1e}");
        }
    }
}

#[test]
fn the_twins_agree_pixel_for_pixel() {
    // a weight of n.o in one face alone counts its lit pixels
    let Some(mut gpu) = gpu() else { return };
    let (body, side) = (satellite(), 512);
    let (mut seen, mut differ) = (0.0, 0.0);
    for [sun, observer] in geometries(10) {
        let one = |i: usize| {
            let mut weight = vec![0.0; body.faces.len()];
            weight[i] = body.normals[i].dot(observer).max(0.0);
            ([sun, observer], weight)
        };
        let epochs: Vec<_> = (0..body.faces.len()).map(one).collect();
        let cpu = on_cpu(&body, &epochs, side);
        let gpu = on_gpu(&mut gpu, &body, &epochs, side);
        let extent = |axis: DVec3| {
            let along = || body.vertices.iter().map(|p| p.dot(axis));
            along().fold(f64::MIN, f64::max) - along().fold(f64::MAX, f64::min)
        };
        let (u, v) = observer.any_orthonormal_pair();
        let pixel = extent(u) * extent(v) / f64::from(side * side);
        for (c, g) in cpu.iter().zip(&gpu) {
            seen += c / pixel;
            differ += (c - g).abs() / pixel;
            let (c, g) = (c / pixel, g / pixel);
            // the sums are whole pixels on both sides
            assert!((c - c.round()).abs() < 1e-3 && (g - g.round()).abs() < 0.1, "{c} {g}");
        }
    }
    // measured: 38 of 751720
    assert!(differ < 3e-4 * seen, "{differ} of {seen}");
}

#[test]
fn batches_sizes_and_broken_input() {
    let Some(mut gpu) = gpu() else { return };
    let body = satellite();
    let many = epochs(&body, 1000);
    let light = on_gpu(&mut gpu, &body, &many, 64);
    // one at a time gives the same bits
    for k in [0, 1, 499, 999] {
        assert_eq!(on_gpu(&mut gpu, &body, &many[k..=k], 64)[0], light[k]);
    }
    let [sun, observer] = geometries(9)[4];
    let weight = lambert(&body, sun, observer);
    let unit = on_gpu(&mut gpu, &body, &[([sun, observer], weight.clone())], 200)[0];
    for size in [1e-6, 1e6] {
        let mut scaled = body.clone();
        scaled.vertices.iter_mut().for_each(|p| *p = (*p + 3.0) * size);
        let weight = weight.iter().map(|w| w * 1e60).collect();
        let flux = on_gpu(&mut gpu, &scaled, &[([sun, observer], weight)], 200)[0] / size.powi(2) / 1e60;
        assert!((flux / unit - 1.0).abs() < 1e-3, "{size:e}: {flux} {unit}");
    }
    let ones = vec![1.0; 36];
    let bad = [DVec3::ZERO, DVec3::NAN, DVec3::INFINITY].map(|bad| ([bad, observer], ones.clone()));
    assert_eq!(on_gpu(&mut gpu, &body, &bad, 64), [0.0; 3]);
    assert_eq!(on_gpu(&mut gpu, &body, &[([sun, -sun], ones.clone())], 64), [0.0]);
    assert_eq!(on_gpu(&mut gpu, &Body::default(), &[([sun, observer], ones.clone())], 64), [0.0]);
    assert!(on_gpu(&mut gpu, &body, &[], 64).is_empty());
    let mut broken = body.clone();
    broken.faces.extend([[0, 1, 9999], [5, 5, 5]]);
    broken.normals.extend([DVec3::Z, DVec3::ZERO]);
    broken.sheet.clear();
    let whole = on_gpu(&mut gpu, &body, &[([sun, observer], weight.clone())], 64);
    assert_eq!(on_gpu(&mut gpu, &broken, &[([sun, observer], weight)], 64), whole);
    let most = gpu.largest_side();
    for side in [0, most + 1, u32::MAX] {
        assert_eq!(gpu.flux(&body, &[], side), Err(GpuError::Side { side, most }));
    }
}

#[test]
fn many_faces_and_coplanar_ones() {
    let Some(mut gpu) = gpu() else { return };
    let body = sphere(130);
    let cases = epochs(&body, 20);
    let exact = unshadowed(&body, &cases[8].1);
    assert!((on_gpu(&mut gpu, &body, &cases[8..9], 1024)[0] / exact - 1.0).abs() < 1e-3);
    let mut body = union(&[plate([0.0, 0.0], [1.0, 1.0], 0.0), plate([0.5, 0.0], [2.0, 1.0], 0.0)]);
    let geometry = [DVec3::new(0.3, 0.2, 1.0), DVec3::new(-0.4, 0.1, 1.0)];
    for (pairs, expected) in [([(0, 2), (1, 2), (0, 3), (1, 3)], 6.0), ([(2, 0), (3, 0), (2, 1), (3, 1)], 8.0)] {
        body.coplanar = pairs.to_vec();
        let flux = on_gpu(&mut gpu, &body, &[(geometry, vec![1.0, 1.0, 5.0, 5.0])], 512)[0];
        assert!((flux / expected - 1.0).abs() < 3e-3, "{flux}");
    }
}

#[test]
fn devices_are_listed_or_refused_with_a_reason() {
    let all = adapters();
    assert!(all.iter().all(|a| !a.name.is_empty() && !a.backend.is_empty() && a.largest_side > 0));
    for (kind, software) in [(Kind::Hardware, false), (Kind::Software, true)] {
        match Gpu::open(kind) {
            Ok(gpu) => assert_eq!(gpu.is_software(), software),
            Err(GpuError::NoAdapter { reason, .. }) => {
                assert!(!reason.is_empty() && all.iter().all(|a| a.software != software));
            }
            Err(error) => assert!(matches!(error, GpuError::NoDevice { .. }), "{error}"),
        }
    }
}
