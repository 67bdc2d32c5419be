//! The mesh against drawn skies.

use super::drawn::{Sky, SplitMix};
use super::*;
use crate::photometry::segment::Segment;
use glam::DVec2;

fn mesh(sky: &Sky, data: &[f32], masks: &[Mask]) -> Mesh {
    background(Plane::new(sky.width, sky.height, data).expect("fits"), 64, 0.0, masks).expect("in range")
}

/// Places over a frame, borders too.
fn places(sky: &Sky) -> Vec<DVec2> {
    let step = |i: usize, n: usize| (n - 1) as f64 * i as f64 / 20.0;
    (0..21)
        .flat_map(|j| (0..21).map(move |i| (i, j)))
        .map(|(i, j)| DVec2::new(step(i, sky.width), step(j, sky.height)))
        .collect()
}

#[test]
fn the_error_told_is_the_error_made() {
    let sky = Sky::flat(1000, 900, 500.0);
    let sigma = sky.noise(500.0);
    let (mut pulls, mut count) = (0.0, 0.0);
    for seed in 0..10 {
        let mesh = mesh(&sky, &sky.expose(seed), &[]);
        let [columns, rows] = mesh.cells();
        for row in 1..rows - 1 {
            for column in 1..columns - 1 {
                let cell = DVec2::new(1000.0 / columns as f64, 900.0 / rows as f64);
                let place = (DVec2::new(column as f64, row as f64) + 0.5) * cell - 0.5;
                pulls += ((mesh.mean(place) - 500.0) / mesh.error(place)).powi(2);
                count += 1.0;
                assert!((mesh.sigma(place) / sigma - 1.0).abs() < 0.03);
                assert!((mesh.error(place) / (0.405 * sigma / 64.0) - 1.0).abs() < 0.1);
            }
        }
    }
    // 1700 cells, 9 of which share pixels: 5 %
    let pull = f64::sqrt(pulls / count);
    assert!((0.85..1.15).contains(&pull), "{pull}");
}

/// 30 % across the frame, straight, and bent like vignetting: off by less than 0.06 of a pixel's scatter in the middle and
/// 0.16 at the borders. In a frame as small as this one the bend departs from straight lines by 0.043 between middles and by
/// 0.13 in the corners, half a cell beyond the outermost ones.
#[test]
fn gradients_are_followed_up_to_the_borders() {
    for bent in [false, true] {
        let mut sky = Sky::flat(1024, 1024, 0.0);
        let shape = |p: DVec2| {
            let u = p / 1024.0;
            1000.0 * if bent { 1.0 - 0.3 * (u - 0.5).length_squared() * 2.0 } else { 1.0 + 0.3 * u.x - 0.1 * u.y }
        };
        for y in 0..1024 {
            for x in 0..1024 {
                sky.mean[y * 1024 + x] = shape(DVec2::new(x as f64, y as f64));
            }
        }
        let mesh = mesh(&sky, &sky.expose(1), &[]);
        for place in places(&sky) {
            let off = (mesh.mean(place) - shape(place)).abs() / sky.noise(shape(place));
            let inside = place.min_element() > 64.0 && place.max_element() < 960.0;
            assert!(off < if inside { 0.06 } else { 0.16 }, "{bent} {place}: {off}");
        }
    }
}

/// Noise on a slope of 30 %, searched for trails of 100 px: 1 false detection is allowed, and more than 4 have a chance of 0.4 %.
#[test]
fn a_gradient_is_no_source() {
    let mut sky = Sky::flat(1024, 1024, 0.0);
    sky.mean
        .iter_mut()
        .enumerate()
        .for_each(|(i, m)| *m = 1000.0 + 0.3 * (i % 1024) as f64 - 0.1 * (i / 1024) as f64);
    let data = sky.expose(5);
    let plane = Plane::new(1024, 1024, &data).expect("fits");
    let settings = Settings { step: 0.0, false_alarms: 1.0, ..Settings::default() };
    for half in [DVec2::ZERO, DVec2::new(48.0, 14.0), DVec2::new(-7.0, 50.0)] {
        let found = detect(plane, &mesh(&sky, &data, &[]), half, &settings).expect("in range");
        assert!(found.len() <= 4, "{half}: {found:?}");
    }
}

/// A trail of 500 px and a bright point: without masks off by less than 0.1 of a pixel's scatter, with masks by 0.04.
#[test]
fn trails_and_targets_are_not_eaten() {
    let mut sky = Sky::flat(1024, 1024, 500.0);
    let trail = Segment { centre: DVec2::new(500.0, 480.0), half: DVec2::new(240.0, 70.0) };
    let point = Segment::point(DVec2::new(300.0, 800.0));
    sky.add(trail.centre, trail.half, 1.5e5);
    sky.add(point.centre, point.half, 5e5);
    let data = sky.expose(2);
    let masks = [Mask { segment: trail, radius_px: 8.0 }, Mask { segment: point, radius_px: 12.0 }];
    for (masks, allowed) in [(&[][..], 0.1), (&masks[..], 0.04)] {
        let mesh = mesh(&sky, &data, masks);
        for t in 0..=20 {
            let place = trail.centre + trail.half * (f64::from(t) / 10.0 - 1.0);
            let off = (mesh.mean(place) - 500.0) / sky.noise(500.0);
            assert!(off.abs() < allowed, "{place}: {off}");
        }
        assert!(((mesh.mean(point.centre) - 500.0) / sky.noise(500.0)).abs() < allowed);
    }
}

/// Integers of a scatter of half a step: the mean is off by less than 0.02, and the scatter is not that of one step less.
#[test]
fn quantised_pixels_keep_their_mean() {
    let mut random = SplitMix(3);
    let data = (0..256 * 128).map(|_| (100.3 + 0.5 * random.normals()[0]).round() as f32).collect::<Vec<_>>();
    let mesh = background(Plane::new(256, 128, &data).expect("fits"), 64, 1.0, &[]).expect("in range");
    let place = DVec2::new(128.0, 64.0);
    assert!((mesh.mean(place) - 100.3).abs() < 0.02, "{}", mesh.mean(place));
    assert!((mesh.sigma(place) - (0.25f64 + 1.0 / 12.0).sqrt()).abs() < 0.02, "{}", mesh.sigma(place));
}

#[test]
fn missing_and_tiny_frames_give_no_number_and_no_panic() {
    for (width, height, value) in [(0, 0, 0.0), (1, 1, 5.0), (100, 70, f32::NAN), (7, 300, f32::INFINITY)] {
        let data = vec![value; width * height];
        let mesh = background(Plane::new(width, height, &data).expect("fits"), 64, 1.0, &[]).expect("in range");
        assert!(mesh.mean(DVec2::new(1e9, f64::NAN)).is_nan() && mesh.error(DVec2::splat(-1e300)).is_nan());
    }
    // half of the cells are missing: they take the others' level
    let data = (0..128 * 128).map(|i| if i % 128 < 64 { f32::NAN } else { 7.0 }).collect::<Vec<_>>();
    let mesh = background(Plane::new(128, 128, &data).expect("fits"), 64, 1.0, &[]).expect("in range");
    assert_eq!(mesh.mean(DVec2::new(10.0, 64.0)), 7.0);
}

#[test]
fn masks_hide_what_is_within_their_distance() {
    let segment = Segment { centre: DVec2::new(60.3, 50.8), half: DVec2::new(25.0, -11.0) };
    for segment in [segment, Segment::point(segment.centre), Segment { half: DVec2::new(0.0, 30.0), ..segment }] {
        let mask = Mask { segment, radius_px: 6.2 };
        for y in 0..110 {
            let (from, to) = mask.chord(f64::from(y));
            for x in 0..128 {
                let place = DVec2::new(f64::from(x), f64::from(y));
                let inside = (from..=to).contains(&place.x);
                assert!(inside == (segment.distance(place) <= 6.2), "{place}");
            }
        }
    }
}
