//! The search on curves whose period is known, and on curves that have none.

use super::false_alarm::false_alarm;
use super::harmonic::{frequency_error, power_at};
use super::sample::Sample;
use super::scan::{Grid, scan};
use super::*;
use std::f64::consts::TAU;

/// Random numbers of a seed: splitmix64 (Steele et al. 2014), normal ones after Box & Muller.
pub struct Noise(pub u64);

impl Noise {
    pub fn even(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ z >> 31) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.even()).ln()).sqrt();
        radius * (TAU * self.even()).cos()
    }

    /// `count` ordered times within `span`.
    pub fn times(&mut self, count: usize, span: f64) -> Vec<f64> {
        let mut times = (0..count).map(|_| span * self.even()).collect::<Vec<_>>();
        times.sort_by(f64::total_cmp);
        times
    }
}

/// A curve of `shape` over phase, with noise of `sigma`.
pub struct Curve {
    pub time: Vec<f64>,
    pub value: Vec<f64>,
    pub sigma: Vec<f64>,
}

impl Curve {
    pub fn new(time: Vec<f64>, period: f64, sigma: f64, seed: u64, shape: impl Fn(f64) -> f64) -> Self {
        let mut noise = Noise(seed);
        let value = time.iter().map(|t| shape((t / period).rem_euclid(1.0)) + sigma * noise.normal()).collect();
        let sigma = vec![sigma; time.len()];
        Self { time, value, sigma }
    }

    pub fn series(&self) -> Series<'_> {
        Series { time_s: &self.time, value: &self.value, sigma: &self.sigma }
    }

    pub fn search(&self, options: &Options) -> Report {
        search(&self.series(), options).expect("a search")
    }
}

/// The best period is `expected` within five of its standard errors, and is claimed.
pub fn assert_period(report: &Report, expected: f64) {
    let best = &report.candidates[0];
    let away = (best.period_s - expected) / best.period_err_s;
    assert!(report.significant && away.abs() < 5.0, "{away} sigma: {best:?}");
    assert!(best.period_err_s < 0.01 * expected, "{best:?}");
}

pub fn sine(phase: f64) -> f64 {
    12.0 + 0.3 * (TAU * phase).sin()
}

/// Two unlike maxima per turn.
pub fn double(phase: f64) -> f64 {
    10.0 + (2.0 * TAU * phase).cos() + 0.3 * (TAU * phase).sin()
}

#[test]
fn sine_with_gaps_has_its_period_amplitude_and_error() {
    let mut time = Noise(1).times(400, 3000.0);
    time.retain(|t| !(500.0..1100.0).contains(t) && !(1900.0..2300.0).contains(t));
    let report = Curve::new(time, 41.7, 0.1, 2, sine).search(&Options::default());
    assert_period(&report, 41.7);
    let best = &report.candidates[0];
    assert_eq!((best.shape, best.maxima), (Shape::Harmonics(1), 1));
    assert!((best.amplitude - 0.6).abs() < 5.0 * best.amplitude_err, "{best:?}");
    assert!((0.7..1.3).contains(&best.reduced_chi2) && best.false_alarm < 1e-20);
    assert!(best.found_by.len() == 3 && best.theta.is_some_and(|t| t < 0.4));
    // 2P holds every curve of period P
    let twice = report.aliases.iter().find(|a| a.relation == Relation::Multiple { turns: 2, parts: 1 });
    assert!(twice.is_some_and(|a| a.indistinguishable && (a.period_s / 83.4 - 1.0).abs() < 0.01));
}

#[test]
fn double_peaked_curve_needs_harmonics() {
    let curve = Curve::new(Noise(3).times(500, 2000.0), 60.0, 0.1, 4, double);
    let alone = curve.search(&Options { harmonics: 1, pdm: false, ..Options::default() });
    assert_period(&alone, 30.0);
    let dispersion = curve.search(&Options { harmonics: 1, ..Options::default() });
    assert_period(&dispersion, 60.0);
    let several = curve.search(&Options::default());
    assert_period(&several, 60.0);
    let best = &several.candidates[0];
    assert_eq!((best.shape, best.maxima), (Shape::Harmonics(2), 2));
    let half = several.aliases.iter().find(|a| a.relation == Relation::Multiple { turns: 1, parts: 2 });
    assert!(half.is_some_and(|a| !a.indistinguishable && a.delta_chi2 > 100.0), "{half:?}");
}

#[test]
fn like_maxima_leave_half_the_period_with_its_double_as_alias() {
    let curve = Curve::new(Noise(5).times(300, 1000.0), 40.0, 0.1, 6, |p| (2.0 * TAU * p).cos());
    let report = curve.search(&Options::default());
    assert_period(&report, 20.0);
    let twice = report.aliases.iter().find(|a| a.relation == Relation::Multiple { turns: 2, parts: 1 });
    assert!(twice.is_some_and(|a| a.indistinguishable));
}

#[test]
fn glints_are_followed_by_bins() {
    let glint = |p: f64| if p < 0.02 { 5.0 } else { 1.0 };
    let curve = Curve::new(Noise(7).times(3000, 2000.0), 23.456, 0.2, 8, glint);
    for harmonics in [4, 8] {
        let report = curve.search(&Options { harmonics, min_period_s: Some(2.0), ..Options::default() });
        let best = &report.candidates[0];
        // a glint drifts by less than its width over the span
        let drift = 2000.0 * (1.0 / best.period_s - 1.0 / 23.456);
        assert!(report.significant && drift.abs() < 0.02, "{best:?}");
        assert_eq!((best.shape, best.maxima), (Shape::Bins(50), 1));
        // the glint lies in one bin, or in two that share it
        assert!((1.8..4.4).contains(&best.amplitude), "{best:?}");
    }
}

#[test]
fn sixty_thousand_points() {
    let curve = Curve::new(Noise(9).times(60_000, 20_000.0), 7.31, 1.0, 10, |p| 0.2 * sine(p));
    let report = curve.search(&Options { min_period_s: Some(1.0), ..Options::default() });
    assert_period(&report, 7.31);
    assert!(report.notes.contains(&Note::PdmAtCandidatesOnly));
    assert!(report.periodogram.frequency_hz.len() <= 4000);
    let highest = report.periodogram.power_single.iter().fold(0.0f64, |m, p| m.max(*p));
    assert!(highest > 0.9 * report.candidates[0].power_single);
}

#[test]
fn two_nights_have_daily_aliases() {
    let mut time = Noise(11).times(300, 7200.0);
    let second = Noise(12).times(300, 7200.0).into_iter().map(|t| t + 86_400.0);
    time.extend(second);
    let curve = Curve::new(time, 611.0, 0.3, 13, sine);
    let report = curve.search(&Options { min_period_s: Some(60.0), ..Options::default() });
    let day = report.window.iter().find(|p| p.cause == Cause::SolarDay).expect("a day");
    assert!((day.period_s / 86_400.0 - 1.0).abs() < 0.03 && day.power > 0.9, "{day:?}");
    let image =
        |a: &&Alias| matches!(a.relation, Relation::Sampling { order: -1 | 1, cause: Cause::SolarDay, .. });
    let images = report.aliases.iter().filter(image).collect::<Vec<_>>();
    assert_eq!(images.len(), 2);
    for image in &images {
        let apart = (1.0 / image.period_s - report.candidates[0].frequency_hz).abs() * 86_400.0;
        assert!((apart - 1.0).abs() < 0.05, "{image:?}");
    }
    // the truth is the best or said to be no worse: frequencies are apart by far more than their errors
    let best = &report.candidates[0];
    let same = |p: f64| (1.0 / p - 1.0 / 611.0).abs() < 0.2 / 86_400.0;
    assert!(same(best.period_s) || report.aliases.iter().any(|a| a.indistinguishable && same(a.period_s)));
    assert!(images.iter().any(|a| a.indistinguishable), "{images:?}");
}

#[test]
fn even_sampling_cannot_tell_images_beyond_its_limit() {
    let time = (0..400).map(|i| f64::from(i) * 2.0).collect();
    let report = Curve::new(time, 9.7, 0.1, 14, sine).search(&Options::default());
    assert_period(&report, 9.7);
    let image = 1.0 / (1.0 / 2.0 - 1.0 / 9.7);
    let found = report.aliases.iter().find(|a| (a.period_s / image - 1.0).abs() < 1e-3).expect("the image");
    assert!(matches!(found.relation, Relation::Sampling { order: -1, cause: Cause::MedianGap, .. }));
    assert!(found.delta_chi2.abs() < 1e-6 && found.indistinguishable);
}

/// Of 500 trials, the number below 0.01 is Binomial(500, 0.01): above 14 once in 5000. The number below 0.2 shows that the probability is
/// no mere bound: 100 +- 8.9, and the grid misses a little of each peak; six standard deviations.
#[test]
fn false_alarms_are_as_frequent_as_said() {
    for harmonics in [1, 3] {
        let (mut rare, mut common) = (0, 0);
        for seed in 0..500 {
            let mut noise = Noise(1_000_000 + seed);
            let time = noise.times(80, 100.0);
            let curve = Curve::new(time, 1.0, 0.7, 2_000_000 + seed, |_| 3.0);
            let sample = Sample::new(&curve.series()).expect("a sample");
            let grid = Grid { first_hz: 0.01, step_hz: 0.001, count: 400 };
            let spectrum = scan(&sample, &grid, harmonics);
            let highest = spectrum.multi.iter().fold(0.0f64, |m, p| m.max(*p));
            let p = false_alarm(highest, 80, harmonics, 0.399, sample.time_spread_s());
            rare += usize::from(p < 0.01);
            common += usize::from(p < 0.2);
        }
        assert!(rare <= 14, "{harmonics} harmonics: {rare} of 500 below 0.01");
        assert!((47..=153).contains(&common), "{harmonics} harmonics: {common} of 500 below 0.2");
    }
}

#[test]
fn noise_alone_claims_nothing_more_often_than_said() {
    let mut claimed = 0;
    for seed in 0..500 {
        let curve = Curve::new(Noise(seed).times(60, 100.0), 1.0, 0.2, 10_000 + seed, |_| 15.0);
        let report = curve.search(&Options { false_alarm: 0.01, ..Options::default() });
        claimed += usize::from(report.significant);
        assert!(report.significant != report.notes.contains(&Note::NothingSignificant));
    }
    assert!(claimed <= 14, "{claimed} of 500");
}

#[test]
fn fast_powers_equal_direct_ones() {
    let mut noise = Noise(20);
    let mut time = noise.times(150, 300.0);
    time.extend(noise.times(150, 300.0).iter().map(|t| t + 5000.0));
    let mut curve = Curve::new(time, 17.0, 0.2, 21, double);
    curve.sigma.iter_mut().enumerate().for_each(|(i, s)| *s *= 1.0 + (i % 7) as f64);
    let sample = Sample::new(&curve.series()).expect("a sample");
    // 40000 frequencies: two bands, the second one not full
    let grid = Grid { first_hz: 2e-3, step_hz: 2e-5, count: 40_000 };
    let spectrum = scan(&sample, &grid, 5);
    assert_eq!(spectrum.single.len(), grid.count);
    for i in (0..grid.count).step_by(97).chain([0, 32_767, 32_768, grid.count - 1]) {
        let hz = grid.frequency(i);
        let [one, five] = [1, 5].map(|k| power_at(&sample, hz, k));
        assert!((spectrum.single[i] - one).abs() < 1e-8, "{hz} Hz: {} {one}", spectrum.single[i]);
        assert!((spectrum.multi[i] - five).abs() < 1e-8, "{hz} Hz: {} {five}", spectrum.multi[i]);
    }
    // eight harmonics of periods longer than the pieces depend on each other
    let grid = Grid { first_hz: 2e-4, step_hz: 2e-5, count: 90 };
    let spectrum = scan(&sample, &grid, 8);
    for (i, fast) in spectrum.multi.iter().enumerate() {
        let direct = power_at(&sample, grid.frequency(i), 8);
        assert!((fast - direct).abs() < 1e-3, "{} Hz: {fast} {direct}", grid.frequency(i));
    }
}

#[test]
fn error_of_a_frequency_is_montgomery_and_odonoghues_on_even_sampling() {
    let time = (0..2000).map(f64::from).collect();
    let curve = Curve::new(time, 37.0, 0.1, 22, sine);
    let sample = Sample::new(&curve.series()).expect("a sample");
    let expected = (6.0f64 / 2000.0).sqrt() * 0.1 / (std::f64::consts::PI * 2000.0 * 0.3);
    let (hz, _) = harmonic::climb(&sample, 1.0 / 37.0, 5e-5, 1);
    let error = frequency_error(&sample, hz, 1, 1.0);
    // noise changes the amplitude fitted by 1 %, cross terms the curvature by as much
    assert!((error / expected - 1.0).abs() < 0.03, "{error} {expected}");
}

#[test]
fn errors_of_periods_are_those_of_repetitions() {
    // 100 normal variates: their rms is 1 +- 0.071, four standard deviations
    let squares = (0..100).map(|seed| {
        let curve = Curve::new(Noise(300 + seed).times(100, 500.0), 33.0, 0.2, 600 + seed, sine);
        let best = curve.search(&Options { harmonics: 2, pdm: false, ..Options::default() }).candidates.remove(0);
        ((best.period_s - 33.0) / best.period_err_s).powi(2)
    });
    let rms = (squares.sum::<f64>() / 100.0).sqrt();
    assert!((rms - 1.0).abs() < 0.29, "{rms}");
}

#[test]
fn fast_spin_in_unix_seconds_keeps_its_precision() {
    let mut noise = Noise(30);
    let offset = 1.7e9;
    let time = noise.times(2000, 60.0).iter().map(|t| t + offset).collect::<Vec<_>>();
    let mut curve = Curve::new(time, 1.0, 0.05, 31, |_| 0.0);
    let spin = |t: f64| (TAU * (t - offset) / 0.1).sin();
    curve.value.iter_mut().zip(&curve.time).for_each(|(v, t)| *v += spin(*t));
    let report = curve.search(&Options { min_period_s: Some(0.05), ..Options::default() });
    assert_period(&report, 0.1);
    assert!(report.candidates[0].period_err_s < 1e-6 && report.candidates[0].reduced_chi2 < 1.2);
}
