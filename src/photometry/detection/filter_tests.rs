//! The map against its definition, pixel by pixel.

use super::drawn::Sky;
use super::kernel::{Kernel, line};
use super::*;
use crate::base::simd;
use glam::DVec2;

/// The filter at (x, y) by its definition, for trails longer along y.
fn by_definition(kernel: &Kernel, plane: Plane, mesh: &Mesh, x: i64, y: i64) -> f64 {
    let l = kernel.l as i64;
    let tap = |i: i64| f64::from(kernel.taps[i.unsigned_abs() as usize]);
    let reach = kernel.taps.len() as i64 - 1;
    let mut sum = 0.0;
    for k in -l..=l {
        let column = x + line(kernel.slope, y + k) - line(kernel.slope, y);
        for j in -reach..=reach {
            for i in -reach..=reach {
                let (x, y) = (column + i, y + k + j);
                let place = DVec2::new(x as f64, y as f64);
                let value = plane.pixel(x, y).map_or(f64::NAN, f64::from);
                let z = (value - mesh.mean(place)) / mesh.sigma(place);
                sum += tap(i) * tap(j) * if z.is_finite() { z } else { 0.0 };
            }
        }
    }
    sum / kernel.norm
}

/// Samples of the map are the definition's to the rounding of single numbers, and of unit variance in noise.
#[test]
fn running_sums_are_the_sums() {
    for half in [DVec2::ZERO, DVec2::new(0.0, 12.0), DVec2::new(-7.0, 13.0), DVec2::new(10.0, 10.0)] {
        let mut sky = Sky::flat(230, 170, 500.0);
        sky.add(DVec2::new(100.0, 80.0), half, 1e6);
        let mut data = sky.expose(1);
        data[50 * 230 + 60] = f32::NAN;
        let plane = Plane::new(230, 170, &data).expect("fits");
        let mesh = background(plane, 64, 0.0, &[]).expect("in range");
        let kernel = Kernel::new(3.0, half).expect("in range");
        let peaks = filter::maxima(plane, &mesh, &kernel, 4.0);
        let margin = half.abs() + 8.0;
        let mut compared = 0;
        for sample in &peaks.samples {
            let place = sample.place();
            let room = place.min(DVec2::new(229.0, 169.0) - place) - margin;
            if room.min_element() > 0.0 {
                let expected = by_definition(&kernel, plane, &mesh, place.x as i64, place.y as i64);
                let allowed = 1e-3 + 1e-5 * expected.abs();
                assert!(
                    (f64::from(sample.s) - expected).abs() < allowed,
                    "{half} {place}: {} {expected}",
                    sample.s
                );
                compared += 1;
            }
        }
        assert!(compared > 100);
    }
}

#[test]
fn the_map_of_noise_has_unit_variance() {
    let sky = Sky::flat(900, 800, 500.0);
    let data = sky.expose(11);
    let plane = Plane::new(900, 800, &data).expect("fits");
    let mesh = background(plane, 64, 0.0, &[]).expect("in range");
    // with the samples' correlation 10^4 / 25 to 10^4 independent ones: 1 to 4 %; the background's error adds 2 %
    for (half, allowed) in [(DVec2::ZERO, 0.03), (DVec2::new(3.0, 14.0), 0.06), (DVec2::new(60.0, -10.0), 0.12)] {
        let kernel = Kernel::new(3.0, half).expect("in range");
        let samples = filter::maxima(plane, &mesh, &kernel, 4.0).samples;
        let variance = samples.iter().map(|p| f64::from(p.s).powi(2)).sum::<f64>() / samples.len() as f64;
        assert!((variance.sqrt() - 1.0).abs() < allowed, "{half}: {}", variance.sqrt());
    }
}

/// Every set of instructions gives the same bits.
#[test]
fn all_instructions_give_the_same_maxima() {
    let mut sky = Sky::flat(300, 210, 500.0);
    sky.add(DVec2::new(150.0, 100.0), DVec2::new(5.0, 20.0), 1e5);
    let data = sky.expose(4);
    let plane = Plane::new(300, 210, &data).expect("fits");
    let kernel = Kernel::new(3.0, DVec2::new(5.0, 20.0)).expect("in range");
    let mut first = None;
    for paths in 1..=simd::Path::all().len() {
        simd::hold_to(paths);
        let mesh = background(plane, 64, 0.0, &[]).expect("in range");
        let maxima = filter::maxima(plane, &mesh, &kernel, 3.0).maxima;
        assert_eq!(*first.get_or_insert_with(|| maxima.clone()), maxima);
    }
    simd::hold_to(usize::MAX);
}

/// A frame full of maxima keeps the strongest.
#[test]
fn maxima_beyond_memory_leave_the_weakest_out() {
    let mut peaks = peak::Peaks::new(0.5);
    let low = [0.0f32; 64];
    let mut row = low;
    for round in 0..14_000 {
        row.iter_mut()
            .enumerate()
            .for_each(|(i, v)| *v = if i % 2 == 1 { 1.0 + (round % 97) as f32 } else { 0.0 });
        peaks.search([(&low, 0), (&row, 0), (&low, 0)], |x, dx, dy| DVec2::new(x as f64 + dx, dy));
    }
    assert!(peaks.maxima.len() <= 400_000 && peaks.lowest > 40.0);
    assert!(peaks.maxima.iter().all(|p| p.s >= peaks.lowest));
}
