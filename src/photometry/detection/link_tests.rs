//! Tracks among drawn detections.

use super::drawn::SplitMix;
use super::*;
use glam::DVec2;

const SIDE: f64 = 2000.0;
const SIGMA: f64 = 0.5;

fn settings() -> LinkSettings {
    LinkSettings { rate: DVec2::ZERO, largest_rate: 2.0, largest_acceleration: 1e-4, false_tracks: 0.1 }
}

/// All pairs of frames near each other are tried.
fn fast(false_tracks: f64) -> LinkSettings {
    LinkSettings { largest_rate: 50.0, false_tracks, ..settings() }
}

/// Frames 20 s apart with `count` false detections each.
fn frames(random: &mut SplitMix, number: usize, count: usize) -> Vec<FrameDetections> {
    let frame = |i: usize| {
        let mut place = || (DVec2::new(random.uniform(), random.uniform()) - 0.5) * SIDE;
        let detections = (0..count).map(|_| SkyDetection { place: place(), sigma: SIGMA }).collect();
        FrameDetections { time_s: 20.0 * i as f64, area: SIDE * SIDE, detections }
    };
    (0..number).map(frame).collect()
}

/// Add an object that is missed in a share of the frames; how often it is there.
fn add(
    frames: &mut [FrameDetections],
    random: &mut SplitMix,
    motion: impl Fn(f64) -> DVec2,
    missed: f64,
) -> usize {
    let mut count = 0;
    for frame in frames {
        let place = motion(frame.time_s) + SIGMA * DVec2::from(random.normals());
        if random.uniform() >= missed {
            frame.detections.push(SkyDetection { place, sigma: SIGMA });
            count += 1;
        }
    }
    count
}

/// 0.1 false tracks are allowed in each of 60 sets, 6 in all; more than 14 have a chance of 1 in 1000.
#[test]
fn random_detections_make_no_more_tracks_than_allowed() {
    for (number, count) in [(3, 5), (5, 30), (20, 20), (60, 10), (8, 40)] {
        let mut found = 0;
        for seed in 0..60 {
            let frames = frames(&mut SplitMix(seed), number, count);
            found += link(&frames, &fast(0.1)).expect("in range").tracks.len();
        }
        assert!(found <= 14, "{number} frames of {count}: {found} of 6 allowed");
    }
}

/// 10 are allowed in each of 20 sets: some are found, for the number is no empty promise, and no more than 200 + 3 sqrt 200.
#[test]
fn chance_tracks_come_when_they_are_allowed() {
    let mut found = 0;
    for seed in 0..20 {
        let frames = frames(&mut SplitMix(seed), 5, 30);
        found += link(&frames, &fast(10.0)).expect("in range").tracks.len();
    }
    assert!((1..=242).contains(&found), "{found}");
}

/// The tail of 10 trials of 1/10 from 3 up is 0.0701908264; a tail too small for sums, 150 of 200 trials of 1/1000, is that of
/// its first term, ln(200! / 150! 50!) + 150 ln 0.001 + 50 ln 0.999 = -926.5, to the factor of Chernoff's bound.
#[test]
fn tails_are_binomial() {
    assert!((link::log_tail(&[0.1; 10], 3) - 0.070_190_826_4f64.ln()).abs() < 1e-8);
    // fewer than expected are no evidence
    assert_eq!(link::log_tail(&[0.2; 10], 1), 0.0);
    assert!((link::log_tail(&[0.1; 10], 10) - 10.0 * 0.1f64.ln()).abs() < 1e-12);
    let far = link::log_tail(&[1e-3; 200], 150);
    assert!((-926.5..-922.0).contains(&far), "{far}");
}

#[test]
fn objects_missed_in_a_fifth_of_the_frames_are_followed() {
    let motions: [fn(f64) -> DVec2; 3] = [
        |t| DVec2::new(-300.0 + 0.7 * t, 200.0 - 0.3 * t),
        |t| DVec2::new(120.0 + 0.002 * t, -70.0),
        |t| DVec2::new(-200.0 + 1.1 * t - 4e-5 * t * t, -300.0 + 0.4 * t + 3e-5 * t * t),
    ];
    for number in [12, 40, 100] {
        let (mut hits, mut extra) = (0, 0);
        for seed in 0..10 {
            let mut random = SplitMix(seed);
            let mut frames = frames(&mut random, number, 15);
            let counts = motions.map(|motion| add(&mut frames, &mut random, motion, 0.2));
            let linked = link(&frames, &settings()).expect("in range");
            assert!(linked.complete);
            let mut left = linked.tracks.clone();
            for (motion, count) in motions.iter().zip(counts) {
                let is_it = |t: &Track| {
                    let rate = (motion(t.epoch_s + 1.0) - motion(t.epoch_s - 1.0)) * 0.5;
                    t.place.distance(motion(t.epoch_s)) < 6.0 * t.place_sigma + 0.1
                        && t.rate.distance(rate) < 6.0 * t.rate_sigma
                        && t.members.len() as f64 >= 0.85 * count as f64
                };
                if let Some(at) = left.iter().position(is_it) {
                    left.remove(at);
                    hits += 1;
                }
            }
            extra += left.len();
        }
        assert!(hits >= 29 && extra <= 4, "{number} frames: {hits} of 30 found, {extra} more");
    }
}

/// Chi-square of 20 tracks of 40 frames: 1 a degree of freedom, with a scatter of 2.5 %; gates of 4 sigma cost 0.5 %.
#[test]
fn chi_square_is_that_of_the_errors() {
    let (mut sum, mut freedom) = (0.0, 0);
    for seed in 0..20 {
        let mut random = SplitMix(seed);
        let mut frames = frames(&mut random, 40, 0);
        add(&mut frames, &mut random, |t| DVec2::new(0.5 * t, -100.0), 0.1);
        let tracks = link(&frames, &settings()).expect("in range").tracks;
        assert_eq!(tracks.len(), 1);
        sum += tracks[0].chi_square;
        freedom += tracks[0].freedom;
        assert_eq!(tracks[0].acceleration, DVec2::ZERO);
    }
    assert!((sum / freedom as f64 - 1.0).abs() < 0.1, "{}", sum / freedom as f64);
}

#[test]
fn three_clean_frames_are_enough_and_two_are_not() {
    let mut random = SplitMix(1);
    let mut three = frames(&mut random, 3, 2);
    add(&mut three, &mut random, |t| DVec2::new(t, t), 0.0);
    let linked = link(&three, &settings()).expect("in range");
    assert_eq!(linked.tracks.len(), 1);
    assert_eq!(linked.tracks[0].members.iter().map(|m| m.frame).collect::<Vec<_>>(), [0, 1, 2]);
    assert!(link(&three[..2], &settings()).expect("in range").tracks.is_empty());
    assert!(link(&[], &settings()).expect("in range").tracks.is_empty());
}

/// Two objects that meet in one frame are two tracks.
#[test]
fn crossing_objects_stay_apart() {
    let mut random = SplitMix(2);
    let mut frames = frames(&mut random, 21, 3);
    add(&mut frames, &mut random, |t| DVec2::new(t - 200.0, 0.0), 0.0);
    add(&mut frames, &mut random, |t| DVec2::new(0.0, 0.8 * (t - 200.0)), 0.0);
    let tracks = link(&frames, &settings()).expect("in range").tracks;
    assert_eq!(tracks.len(), 2);
    assert!(tracks.iter().all(|t| t.members.len() >= 19), "{tracks:?}");
}

#[test]
fn alien_input_is_refused_or_passed_over() {
    let nan = f64::NAN;
    let detection = |x: f64, sigma: f64| SkyDetection { place: DVec2::new(x, 0.0), sigma };
    let alien = vec![detection(nan, 1.0), detection(f64::INFINITY, 1.0), detection(0.0, nan), detection(0.0, 0.0)];
    let frame = |time_s: f64| FrameDetections { time_s, area: 1.0, detections: alien.clone() };
    let same = vec![frame(1.0), frame(1.0), frame(1.0), frame(2.0)];
    assert!(link(&same, &settings()).expect("passed over").tracks.is_empty());
    assert!(link(&[frame(nan)], &settings()).is_err());
    assert!(link(&same, &LinkSettings { largest_rate: -1.0, ..settings() }).is_err());
    assert!(link(&same, &LinkSettings { false_tracks: 0.0, ..settings() }).is_err());
    let good = |time_s: f64| FrameDetections { time_s, area: 1e6, detections: vec![detection(5.0, 1.0); 3] };
    let all_at_once = vec![good(1.0), good(1.0), good(1.0)];
    assert!(link(&all_at_once, &settings()).expect("in range").tracks.is_empty());
}

/// So many detections that not all pairs are tried: it ends and says so.
#[test]
fn too_many_detections_are_told() {
    let frames = frames(&mut SplitMix(1), 6, 1500);
    let linked = link(&frames, &LinkSettings { largest_rate: 100.0, ..settings() }).expect("in range");
    assert!(!linked.complete);
}
