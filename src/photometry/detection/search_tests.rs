//! Drawn frames searched: what is found against what was drawn.

use super::drawn::{Shape, Sky, SplitMix};
use super::*;
use glam::DVec2;

const LEVEL: f64 = 500.0;

fn settings() -> Settings {
    Settings { step: 0.0, ..Settings::default() }
}

fn search(size: [usize; 2], data: &[f32], star: DVec2, others: &[DVec2], settings: &Settings) -> Sources {
    let plane = Plane::new(size[0], size[1], data).expect("pixels fill the frame");
    sources(plane, star, others, settings).expect("numbers in range")
}

/// Electrons of a source of a significance above the sky of `sky`.
fn flux(sky: &Sky, half: DVec2, snr: f64) -> f64 {
    snr / sky.norm(half) * sky.noise(LEVEL)
}

struct Drawn {
    place: DVec2,
    snr: f64,
}

/// A field of stars of significances from 8 up, twice as bright ones 2^-0.6 times as often.
fn field(sky: &mut Sky, half: DVec2, count: usize, seed: u64) -> Vec<Drawn> {
    let mut random = SplitMix(seed);
    let size = DVec2::new(sky.width as f64, sky.height as f64);
    let draw = |_| {
        let place = DVec2::new(random.uniform(), random.uniform()) * size - 0.5;
        Drawn { place, snr: 8.0 * random.uniform().powf(-1.0 / 0.6).min(1000.0) }
    };
    let stars = (0..count).map(draw).collect::<Vec<_>>();
    let unit = flux(sky, half, 1.0);
    for star in &stars {
        sky.add(star.place, half, unit * star.snr);
    }
    stars
}

/// Separation along and across a trail.
fn apart(a: DVec2, b: DVec2, half: DVec2) -> (f64, f64) {
    let e = half.try_normalize().unwrap_or(DVec2::X);
    ((a - b).dot(e).abs(), (a - b).perp_dot(e).abs())
}

#[derive(Debug, Default)]
struct Score {
    isolated: usize,
    found: usize,
    false_stars: usize,
    others: usize,
    along: Vec<f64>,
    across: Vec<f64>,
    bright: Vec<f64>,
    flux: Vec<f64>,
}

fn score(found: &Sources, truth: &[Drawn], sky: &Sky, half: DVec2) -> Score {
    let l = half.length();
    let close = |a: DVec2, b: DVec2, slack: f64| {
        let (along, across) = apart(a, b, half);
        across < 3.0 && along < slack
    };
    let unit = flux(sky, half, 1.0);
    let mut score = Score { others: found.others.len(), ..Score::default() };
    for (i, star) in truth.iter().enumerate() {
        let alone = truth.iter().enumerate().all(|(j, other)| {
            let (along, across) = apart(star.place, other.place, half);
            let reach = 12.0 + 3.0 * (other.snr / star.snr).ln().max(0.0);
            i == j || along > 2.0 * l + reach || across > reach
        });
        let edge = |x: f64, h: f64, n: usize| x - h.abs() < 6.0 || x + h.abs() > n as f64 - 7.0;
        if !alone || edge(star.place.x, half.x, sky.width) || edge(star.place.y, half.y, sky.height) {
            continue;
        }
        score.isolated += 1;
        // 4 standard deviations along a trail of significance 8, 1.5 px at least
        let slack = 1.5 + 4.0 * Kernel::new(sky.fwhm, half).expect("in range").unit_place_sigma()[0] / star.snr;
        if let Some(source) = found.stars.iter().find(|s| close(s.place, star.place, slack)) {
            score.found += 1;
            let (along, across) = apart(source.place, star.place, half);
            score.along.push(along / source.place_sigma[0]);
            score.across.push(across / source.place_sigma[1]);
            if star.snr > 200.0 {
                score.bright.extend([along, across]);
            }
            score.flux.push((source.flux / (unit * star.snr)).ln());
        }
    }
    let is_true = |s: &Source| truth.iter().any(|t| close(s.place, t.place, 2.0 * l + 4.0));
    score.false_stars = found.stars.iter().filter(|s| !is_true(s)).count();
    score
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// 40 frames of noise with 2 false detections allowed in each. Of points 80 are expected, and 30 (3.3 Poisson deviations)
/// about it found; of trails fewer, for several maxima on one flat top count once.
#[test]
fn pure_noise_has_no_more_false_detections_than_allowed() {
    let sky = Sky::flat(700, 600, LEVEL);
    let exposures = (0..40).map(|seed| sky.expose(seed)).collect::<Vec<_>>();
    for (half, fwhm_px, least) in [
        (DVec2::ZERO, 3.0, 50),
        (DVec2::ZERO, 1.6, 50),
        (DVec2::new(0.0, 2.5), 3.0, 50),
        (DVec2::new(3.0, 15.0), 3.0, 25),
        (DVec2::new(-14.0, 5.0), 4.0, 25),
        (DVec2::new(0.0, 50.0), 3.0, 10),
    ] {
        let settings = Settings { fwhm_px, false_alarms: 2.0, ..settings() };
        let count = |data: &Vec<f32>| {
            let plane = Plane::new(700, 600, data).expect("fits");
            let mesh = background(plane, 64, 0.0, &[]).expect("in range");
            detect(plane, &mesh, half, &settings).expect("in range").len()
        };
        let count = exposures.iter().map(count).sum::<usize>();
        assert!((least..=110).contains(&count), "{half}, {fwhm_px} px: {count} of 80 allowed");
    }
}

/// 5000 stars on 4096 x 4096, or as dense on a part of it: points and trails of 5, 30 and 100 px.
#[test]
fn five_thousand_stars_are_found_and_nothing_else() {
    // others: blends of two stars beside each other, which look more like a point than like a trail of 5 px
    for (half, size, others_allowed) in [
        (DVec2::ZERO, 2048, 4),
        (DVec2::new(2.0, 1.5), 2048, 25),
        (DVec2::new(-14.5, 4.0), 4096, 16),
        (DVec2::new(20.0, 45.8), 2048, 3),
    ] {
        let mut sky = Sky::flat(size, size, LEVEL);
        let count = 5000 * size * size / (4096 * 4096);
        let truth = field(&mut sky, half, count, 3);
        let data = sky.expose(4);
        let other = if half == DVec2::ZERO { DVec2::new(0.0, 10.0) } else { DVec2::ZERO };
        let found = search([size, size], &data, half, &[other], &settings());
        let score = score(&found, &truth, &sky, half);
        let share = score.found as f64 / score.isolated as f64;
        assert!(share >= 0.98, "{half}: {share} of {} isolated stars", score.isolated);
        assert!(
            score.false_stars <= 1 && score.others <= others_allowed,
            "{half}: {} {}",
            score.false_stars,
            score.others
        );
        // 165 isolated stars at least: a scatter of 1 to 6 % if all were Gaussian; faint trails' ends are not
        let pulls = [rms(&score.along), rms(&score.across)];
        assert!((0.8..1.5).contains(&pulls[0]) && (0.6..1.15).contains(&pulls[1]), "{half}: {pulls:?}");
        assert!(rms(&score.bright) < 0.04, "{half}: {} px of bright ones", rms(&score.bright));
        assert!(mean(&score.flux).abs() < 0.02, "{half}: fluxes off by {}", mean(&score.flux));
    }
}

/// Moffat wings of beta 2.5: images no Gaussian filter is made for. Others are pairs of stars in a line, 2 % of all at most.
#[test]
fn stars_with_wings_have_no_ghosts() {
    for (half, least) in [(DVec2::ZERO, 0.98), (DVec2::new(-14.5, 4.0), 0.98), (DVec2::new(20.0, 45.8), 0.9)] {
        let mut sky = Sky { shape: Shape::Moffat, ..Sky::flat(1500, 1500, LEVEL) };
        let truth = field(&mut sky, half, 670, 5);
        let other = if half == DVec2::ZERO { DVec2::new(0.0, 10.0) } else { DVec2::ZERO };
        let found = search([1500, 1500], &sky.expose(6), half, &[other], &settings());
        let score = score(&found, &truth, &sky, half);
        let share = score.found as f64 / score.isolated as f64;
        assert!(share >= least, "{half}: {share} of {}", score.isolated);
        assert!(score.false_stars == 0 && score.others <= 13, "{half}: {} {}", score.false_stars, score.others);
    }
}

#[test]
fn constant_empty_and_missing_frames_hold_nothing() {
    for value in [0.0, 1000.0, -3e30, f32::NAN, f32::INFINITY, f32::MAX] {
        for size in [[0, 0], [1, 1], [3, 200], [200, 150]] {
            let data = vec![value; size[0] * size[1]];
            for half in [DVec2::ZERO, DVec2::new(40.0, 3.0), DVec2::new(-3.0, 1000.0)] {
                for step in [0.0, 1.0] {
                    let settings = Settings { step, ..settings() };
                    let found = search(size, &data, half, &[DVec2::ZERO], &settings);
                    assert!(found.stars.is_empty() && found.others.is_empty(), "{value} {size:?} {half}");
                }
            }
        }
    }
}

#[test]
fn numbers_out_of_range_are_refused() {
    let data = [0.0; 12];
    assert!(matches!(Plane::new(3, 5, &data), Err(DetectionError::Shape { pixels: 12, width: 3, height: 5 })));
    assert!(Plane::new(usize::MAX, 2, &data).is_err());
    let plane = Plane::new(3, 4, &data).expect("fits");
    let refused = |half: DVec2, settings: Settings| sources(plane, half, &[], &settings).is_err();
    assert!(refused(DVec2::splat(f64::NAN), settings()));
    assert!(refused(DVec2::new(1e4, 0.0), settings()));
    assert!(refused(DVec2::ZERO, Settings { fwhm_px: f64::NAN, ..settings() }));
    assert!(refused(DVec2::ZERO, Settings { false_alarms: 0.0, ..settings() }));
    assert!(refused(DVec2::ZERO, Settings { cell_px: 0, ..settings() }));
    assert!(refused(DVec2::ZERO, Settings { step: -1.0, ..settings() }));
    let noise = Noise::Model { gain: 0.0, zero: 0.0, read: 1.0 };
    assert!(refused(DVec2::ZERO, Settings { noise, ..settings() }));
}

/// One pixel in a hundred missing takes 0.5 % of the significance and nothing of the flux.
#[test]
fn missing_pixels_cost_no_flux() {
    for half in [DVec2::ZERO, DVec2::new(4.0, 14.5)] {
        let mut sky = Sky::flat(1024, 1024, LEVEL);
        let truth = field(&mut sky, half, 150, 8);
        let mut data = sky.expose(9);
        let mut random = SplitMix(10);
        data.iter_mut().filter(|_| random.uniform() < 0.01).for_each(|v| *v = f32::NAN);
        let found = search([1024, 1024], &data, half, &[], &settings());
        let score = score(&found, &truth, &sky, half);
        assert!(
            score.found as f64 >= 0.97 * score.isolated as f64 && score.false_stars <= 1,
            "{half}: {} {}",
            score.found,
            score.isolated
        );
        assert!(mean(&score.flux).abs() < 0.02, "{half}: {}", mean(&score.flux));
    }
}

#[test]
fn saturated_stars_are_flagged_and_have_no_ghosts() {
    for half in [DVec2::ZERO, DVec2::new(4.0, 14.5)] {
        let mut sky = Sky { shape: Shape::Moffat, ..Sky::flat(600, 600, LEVEL) };
        let places = [DVec2::new(150.3, 200.8), DVec2::new(400.0, 310.5)];
        places.iter().for_each(|p| sky.add(*p, half, flux(&sky, half, 3e4)));
        let limit = 3000.0;
        let data = sky.expose(3).iter().map(|v| v.min(limit)).collect::<Vec<_>>();
        let settings = Settings { saturate: f64::from(limit), ..settings() };
        let other = if half == DVec2::ZERO { DVec2::new(0.0, 10.0) } else { DVec2::ZERO };
        let found = search([600, 600], &data, half, &[other], &settings);
        assert_eq!(
            (found.stars.len(), found.others.len()),
            (2, 0),
            "{half}: {:?} {:?}",
            found.stars,
            found.others
        );
        for place in places {
            let star = found.stars.iter().find(|s| s.place.distance(place) < 1.5).expect("a star");
            assert!(star.saturated && !star.edge);
        }
    }
}

/// A point of significance 8 midway between trails 40 px apart, some of them bright: 8 with a scatter of 1, less the lattice's
/// 5 %, is above the threshold of 5.3 in 99 of 100, so 17 of 20 at least.
#[test]
fn a_faint_point_between_trails_is_found() {
    let half = DVec2::new(40.0, 12.0);
    let mut sky = Sky { shape: Shape::Moffat, ..Sky::flat(500, 400, LEVEL) };
    for (i, snr) in [30.0, 300.0, 2000.0, 100.0, 15.0].into_iter().enumerate() {
        sky.add(DVec2::new(250.0, 100.0 + 40.0 * i as f64), half, flux(&sky, half, snr));
    }
    let place = DVec2::new(251.3, 120.4);
    sky.add(place, DVec2::ZERO, flux(&sky, DVec2::ZERO, 8.0));
    let mut hits = 0;
    for seed in 0..20 {
        let found = search([500, 400], &sky.expose(seed), half, &[DVec2::ZERO], &settings());
        assert!(found.stars.len() == 5, "{:?}", found.stars);
        hits += usize::from(found.others.iter().any(|s| s.place.distance(place) < 1.0));
        assert!(found.others.len() <= 1, "{:?}", found.others);
    }
    assert!(hits >= 17, "{hits} of 20");
}

/// A point on a faint trail, and a trail across: each in its list.
#[test]
fn points_and_trails_across_each_other_are_told_apart() {
    let (star, other) = (DVec2::new(30.0, 4.0), DVec2::new(-5.0, 25.0));
    let mut sky = Sky::flat(500, 400, LEVEL);
    sky.add(DVec2::new(150.0, 200.0), star, flux(&sky, star, 40.0));
    sky.add(DVec2::new(140.0, 198.7), DVec2::ZERO, flux(&sky, DVec2::ZERO, 60.0));
    sky.add(DVec2::new(350.0, 200.0), star, flux(&sky, star, 80.0));
    sky.add(DVec2::new(352.0, 205.0), other, flux(&sky, other, 60.0));
    let found = search([500, 400], &sky.expose(2), star, &[DVec2::ZERO, other], &settings());
    assert_eq!((found.stars.len(), found.others.len()), (2, 2), "{:?} {:?}", found.stars, found.others);
    let has = |list: &[Source], half: DVec2, place: DVec2| {
        list.iter().any(|s| s.half == half && s.place.distance(place) < 1.5)
    };
    assert!(
        has(&found.stars, star, DVec2::new(150.0, 200.0)) && has(&found.stars, star, DVec2::new(350.0, 200.0))
    );
    assert!(has(&found.others, DVec2::ZERO, DVec2::new(140.0, 198.7)));
    assert!(has(&found.others, other, DVec2::new(352.0, 205.0)));
}

/// A header that tells of trails where there are points: all are found, as others.
#[test]
fn trails_that_are_not_there_are_not_seen() {
    let mut sky = Sky::flat(1024, 1024, LEVEL);
    let truth = field(&mut sky, DVec2::ZERO, 100, 12);
    let found = search([1024, 1024], &sky.expose(1), DVec2::new(14.0, 6.0), &[DVec2::ZERO], &settings());
    let hits = truth.iter().filter(|t| found.others.iter().any(|s| s.place.distance(t.place) < 1.5)).count();
    assert!(found.stars.len() <= 2, "{} stars", found.stars.len());
    assert!(hits >= 92 && found.others.len() <= 102, "{hits} of 100, {} others", found.others.len());
}

/// Trails half outside, along the border and in the corner: one source each, where and as bright as it is.
#[test]
fn sources_at_the_border_are_measured_and_flagged() {
    for half in [DVec2::ZERO, DVec2::new(5.0, 20.0), DVec2::new(20.0, -5.0)] {
        let reach = half.abs() * 0.5;
        let places = [
            DVec2::new(150.0, reach.y + 0.4),
            DVec2::new(reach.x + 0.4, 150.0),
            DVec2::new(298.6 - reach.x, 90.0),
            DVec2::new(90.0, 298.6 - reach.y),
        ];
        let mut sky = Sky::flat(300, 300, LEVEL);
        places.iter().for_each(|p| sky.add(*p, half, flux(&sky, half, 100.0)));
        // its middle is outside: it explains its light, but is no source of this frame
        sky.add(DVec2::new(220.0, -2.0) - half * 0.3, half, flux(&sky, half, 60.0));
        let other = if half == DVec2::ZERO { DVec2::new(0.0, 10.0) } else { DVec2::ZERO };
        let found = search([300, 300], &sky.expose(7), half, &[other], &settings());
        for place in places {
            let near = found.stars.iter().filter(|s| s.place.distance(place) < 1.5).collect::<Vec<_>>();
            assert_eq!(near.len(), 1, "{half} at {place}: {:?}", found.stars);
            let ratio = near[0].flux / flux(&sky, half, 100.0);
            assert!(near[0].edge && (0.9..1.1).contains(&ratio), "{half} at {place}: {ratio}");
        }
        assert!(found.stars.len() <= 5 && found.others.is_empty(), "{half}: {:?} {:?}", found.stars, found.others);
    }
}

/// The gain is known: the error of a bright star's flux is what 60 exposures scatter by (9 % is a deviation of it).
#[test]
fn flux_errors_hold_the_source_s_own_noise() {
    let noise = Noise::Model { gain: 1.0, zero: 0.0, read: 5.0 };
    let settings = Settings { noise, ..settings() };
    for half in [DVec2::ZERO, DVec2::new(3.0, 12.0)] {
        let mut sky = Sky::flat(128, 128, LEVEL);
        let truth = flux(&sky, half, 300.0);
        sky.add(DVec2::new(64.2, 63.9), half, truth);
        let pulls = (0..60).map(|seed| {
            let found = search([128, 128], &sky.expose(seed), half, &[], &settings);
            (found.stars[0].flux - truth) / found.stars[0].flux_sigma
        });
        let pull = rms(&pulls.collect::<Vec<_>>());
        assert!((0.7..1.35).contains(&pull), "{half}: {pull}");
    }
}

/// Noise blurred to neighbours, as after resampling: its map scatters more, and no more is found for it.
#[test]
fn correlated_noise_raises_no_false_alarms() {
    let sky = Sky::flat(700, 600, LEVEL);
    let mut count = 0;
    for seed in 0..20 {
        let raw = sky.expose(seed);
        let data = raw.windows(702).map(|w| 0.25 * (w[0] + w[1] + w[700] + w[701])).collect::<Vec<_>>();
        let data = &data[..700 * 598];
        let plane = Plane::new(700, 598, data).expect("fits");
        let mesh = background(plane, 64, 0.0, &[]).expect("in range");
        let settings = Settings { false_alarms: 2.0, ..settings() };
        count += detect(plane, &mesh, DVec2::ZERO, &settings).expect("in range").len();
    }
    assert!(count <= 61, "{count} of 40 allowed");
}

/// All pixels are somebody's; the search ends, and gives no more than there are.
#[test]
fn a_hundred_thousand_stars_come_to_an_end() {
    for half in [DVec2::ZERO, DVec2::new(5.0, 15.0)] {
        let mut sky = Sky::flat(1448, 1448, LEVEL);
        field(&mut sky, half, 12_500, 2);
        let found = search([1448, 1448], &sky.expose(1), half, &[DVec2::new(0.0, 4.0)], &settings());
        assert!(found.stars.len() < 12_500);
        assert!(found.stars.len() > if half == DVec2::ZERO { 7000 } else { 800 }, "{}", found.stars.len());
    }
}

#[test]
fn the_same_frame_gives_the_same_sources_turned() {
    let half = DVec2::new(15.0, 4.0);
    let mut sky = Sky::flat(300, 200, LEVEL);
    field(&mut sky, half, 12, 2);
    let data = sky.expose(3);
    let turned = (0..300).flat_map(|x| (0..200).map(move |y| (x, y))).map(|(x, y)| data[y * 300 + x]);
    let turned = turned.collect::<Vec<_>>();
    let a = search([300, 200], &data, half, &[DVec2::ZERO], &settings());
    let b = search([200, 300], &turned, DVec2::new(half.y, half.x), &[DVec2::ZERO], &settings());
    assert_eq!(a.stars.len(), b.stars.len());
    for (a, b) in a.stars.iter().zip(&b.stars) {
        assert!(a.place.distance(DVec2::new(b.place.y, b.place.x)) < 1e-2, "{} {}", a.place, b.place);
    }
}
