//! Kernels against sums over pixels.

use super::drawn::Sky;
use super::kernel::Kernel;
use super::*;
use glam::DVec2;

fn kernel(fwhm: f64, half: DVec2) -> Kernel {
    Kernel::new(fwhm, half).expect("in range")
}

const HALVES: [DVec2; 5] =
    [DVec2::ZERO, DVec2::new(0.0, 2.5), DVec2::new(4.0, 15.0), DVec2::new(-40.0, 33.0), DVec2::new(150.0, -20.0)];

/// The best possible significance of a unit flux is the root of the image's sum of squares; the filter of pixels along a
/// digital line loses less than 2 % of it.
#[test]
fn the_filter_is_nearly_the_best_one() {
    for half in HALVES {
        let best = Sky::flat(1, 1, 0.0).norm(half);
        let ratio = 1.0 / kernel(3.0, half).unit_flux() / best;
        assert!((0.98..1.002).contains(&ratio), "{half}: {ratio}");
    }
}

/// The bound of Cramer and Rao from pixels of images a hundredth of a pixel apart.
#[test]
fn place_errors_are_those_of_the_pixels() {
    for half in HALVES {
        let reach = half.abs() + 20.0;
        let (width, height) = (2 * reach.x as usize, 2 * reach.y as usize);
        let draw = |d: DVec2| {
            let mut sky = Sky::flat(width, height, 0.0);
            sky.add(DVec2::new(width as f64, height as f64) * 0.5 + d, half, 1.0);
            sky.mean
        };
        let e = half.try_normalize().unwrap_or(DVec2::X);
        for (axis, expected) in [e, e.perp()].into_iter().zip(kernel(3.0, half).unit_place_sigma()) {
            let (a, b) = (draw(axis * 0.005), draw(axis * -0.005));
            let slope = a.iter().zip(&b).map(|(a, b)| ((a - b) / 0.01).powi(2)).sum::<f64>();
            let light = a.iter().map(|a| a * a).sum::<f64>();
            assert!((expected / (light / slope).sqrt() - 1.0).abs() < 0.03, "{half}: {expected}");
        }
    }
}

/// Answers of filters to other trails at a distance, from the product of their drawn images.
#[test]
fn answers_are_products_of_images() {
    let place = DVec2::new(200.0, 200.0);
    let draw = |place: DVec2, half: DVec2| {
        let mut sky = Sky::flat(400, 400, 0.0);
        sky.add(place, half, 1.0);
        sky.mean
    };
    for a in &HALVES[..4] {
        for b in &HALVES[..4] {
            for d in [DVec2::ZERO, DVec2::new(1.0, 2.0), DVec2::new(-8.0, 20.0)] {
                let (source, filter) = (draw(place, *a), draw(place + d, *b));
                let dot = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
                let expected = dot(&source, &filter) / (dot(&filter, &filter) * dot(&source, &source)).sqrt();
                let answer = kernel(3.0, *a).answer(&kernel(3.0, *b), d);
                assert!((answer - expected).abs() < 0.02, "{a} {b} {d}: {answer} for {expected}");
            }
        }
    }
}

/// Thresholds fall with what is allowed, are below that of independent pixels, and end where the table does.
#[test]
fn thresholds_are_in_order() {
    let point = kernel(3.0, DVec2::ZERO);
    let thresholds = [1e-9, 1e-3, 0.1, 10.0, 1e4].map(|n| point.threshold(n, 1.6e7));
    assert!(thresholds.windows(2).all(|t| t[0] > t[1]), "{thresholds:?}");
    // 1.6e7 independent pixels exceed 5.77 standard deviations with 0.064 expected, 5.6 with 0.17
    assert!((5.5..5.8).contains(&thresholds[2]));
    assert!(kernel(3.0, DVec2::new(0.0, 50.0)).threshold(0.1, 1.6e7) < thresholds[2]);
    assert_eq!(point.threshold(1e9, 1.0), 2.0);
    assert_eq!(point.threshold(0.0, 1e7), 10.0);
}

#[test]
fn kernels_out_of_range_are_refused() {
    for fwhm in [0.0, 0.9, 51.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(Kernel::new(fwhm, DVec2::ZERO), Err(DetectionError::Range { name: "fwhm_px", .. })));
    }
    assert!(Kernel::new(3.0, DVec2::new(0.0, f64::NAN)).is_err());
    assert!(Kernel::new(3.0, DVec2::new(-1001.0, 0.0)).is_err());
}
