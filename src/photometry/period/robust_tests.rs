//! The search on data in disorder, of extreme size, without a period, and with options that are wrong.

use super::period_tests::{Curve, Noise, assert_period, double, sine};
use super::*;
use std::f64::consts::TAU;

#[test]
fn order_duplicates_and_unusable_points_change_nothing() {
    let curve = Curve::new(Noise(40).times(200, 900.0), 21.0, 0.1, 41, sine);
    let plain = curve.search(&Options::default());
    let Curve { mut time, mut value, mut sigma } = curve;
    for (t, v, s) in [
        (f64::NAN, 12.0, 0.1),
        (5.0, f64::INFINITY, 0.1),
        (5.0, 12.0, 0.0),
        (6.0, 12.0, -1.0),
        (7.0, 12.0, f64::INFINITY),
        (8.0, 12.0, f64::NAN),
    ] {
        time.insert(time.len() / 2, t);
        value.insert(value.len() / 2, v);
        sigma.insert(sigma.len() / 2, s);
    }
    [&mut time, &mut value, &mut sigma].into_iter().for_each(|column| column.rotate_left(77));
    let mut mixed = Curve { time, value, sigma };
    let report = mixed.search(&Options::default());
    assert_eq!((report.points, report.excluded), (200, 6));
    assert!(report.notes.contains(&Note::Excluded(6)));
    assert_eq!(report.candidates, plain.candidates);
    // each point twice with an error larger by 2^(1/2) is the same information
    let twice = |column: &mut Vec<f64>, by: f64| {
        column.iter_mut().for_each(|v| *v *= by);
        column.extend_from_within(..);
    };
    twice(&mut mixed.time, 1.0);
    twice(&mut mixed.value, 1.0);
    twice(&mut mixed.sigma, 2f64.sqrt());
    let doubled = mixed.search(&Options { harmonics: 1, pdm: false, ..Options::default() });
    assert_period(&doubled, 21.0);
    assert!((doubled.candidates[0].period_s / plain.candidates[0].period_s - 1.0).abs() < 1e-6);
}

#[test]
fn scale_and_offset_of_values_change_no_period() {
    let curve = Curve::new(Noise(50).times(150, 400.0), 17.0, 0.1, 51, sine);
    let plain = curve.search(&Options::default());
    for (scale, offset) in [(1e150, 0.0), (1e-150, 0.0), (-3.0, 1e6), (1e307, 0.0)] {
        let change = |v: &f64| v * scale + offset;
        let value = curve.value.iter().map(change).collect();
        let sigma = curve.sigma.iter().map(|s| s * f64::abs(scale)).collect();
        let report = Curve { time: curve.time.clone(), value, sigma }.search(&Options::default());
        let [a, b] = [&report, &plain].map(|r| r.candidates[0].period_s);
        assert!((a / b - 1.0).abs() < 1e-6, "{scale} {offset}: {a} {b}");
    }
}

#[test]
fn constant_few_and_simultaneous_points_have_no_period() {
    let times = |n: usize| (0..n).map(|i| i as f64 * 1.3).collect::<Vec<_>>();
    let of = |time: Vec<f64>, value: Vec<f64>| {
        let sigma = vec![0.1; time.len()];
        let report = Curve { time, value, sigma }.search(&Options::default());
        assert!(!report.significant && report.candidates.is_empty() && report.aliases.is_empty());
        report.notes
    };
    assert_eq!(of(times(100), vec![15.3; 100]), [Note::Constant]);
    assert_eq!(of(times(3), vec![1.0, 2.0, 1.5]), [Note::TooFewPoints(3)]);
    assert_eq!(of(vec![], vec![]), [Note::TooFewPoints(0)]);
    assert_eq!(of(vec![1.7e9; 50], (0..50).map(f64::from).collect()), [Note::NoSpan]);
}

#[test]
fn noiseless_curve_has_its_exact_period() {
    let time = (0..300).map(|i| f64::from(i) + 0.3 * f64::from(i % 7)).collect();
    let mut curve = Curve::new(time, 23.0, 0.0, 60, double);
    curve.sigma.fill(1e-3);
    let report = curve.search(&Options::default());
    assert!((report.candidates[0].period_s / 23.0 - 1.0).abs() < 1e-7, "{:?}", report.candidates[0]);
    assert_eq!(report.candidates[0].false_alarm, 0.0);
}

#[test]
fn notes_warn_of_long_periods_and_of_those_of_the_sampling() {
    let slow = Curve::new(Noise(70).times(100, 130.0), 100.0, 0.05, 71, sine).search(&Options::default());
    assert!(slow.significant && slow.notes.contains(&Note::FewerThanTwoTurns), "{:?}", slow.notes);
    // twenty nights of an hour, with a daily change of brightness
    let mut noise = Noise(72);
    let nights =
        (0..20).flat_map(|n| noise.times(20, 3600.0).into_iter().map(move |t| t + 86_400.0 * f64::from(n)));
    let daily = Curve::new(nights.collect(), 86_400.0, 0.01, 73, |p| (TAU * p).sin());
    let report = daily.search(&Options { min_period_s: Some(40_000.0), harmonics: 1, ..Options::default() });
    assert!(report.notes.iter().any(|n| matches!(n, Note::PeriodOfSampling(_))), "{:?}", report.candidates[0]);
}

#[test]
fn limits_of_the_grid_are_told() {
    let mut noise = Noise(80);
    let mut time = noise.times(200, 200.0);
    time.extend(noise.times(200, 200.0).iter().map(|t| t + 3e7));
    let curve = Curve::new(time, 20.0, 0.1, 81, sine);
    let small = Options { max_frequencies: 10_000, ..Options::default() };
    let report = curve.search(&small);
    assert_eq!(report.frequencies, 10_000);
    assert!(report.notes.iter().any(|n| matches!(n, Note::ShortPeriodsLeftOut(p) if *p > 10_000.0)));
    let asked = search(&curve.series(), &Options { min_period_s: Some(1.0), ..small });
    assert!(matches!(asked, Err(PeriodError::TooManyFrequencies { limit: 10_000, .. })));
}

#[test]
fn wrong_options_and_columns_are_refused() {
    let curve = Curve::new(Noise(90).times(50, 100.0), 20.0, 0.1, 91, sine);
    let refused = |options: Options, name: &str| match search(&curve.series(), &options) {
        Err(PeriodError::Option { name: found, .. }) => assert_eq!(found, name),
        other => panic!("{name}: {other:?}"),
    };
    let d = Options::default;
    refused(Options { harmonics: 0, ..d() }, "harmonics");
    refused(Options { harmonics: 9, ..d() }, "harmonics");
    refused(Options { oversampling: f64::NAN, ..d() }, "oversampling");
    refused(Options { pdm_bins: Some(1), ..d() }, "pdm_bins");
    refused(Options { pdm_covers: 0, ..d() }, "pdm_covers");
    refused(Options { false_alarm: 2.0, ..d() }, "false_alarm");
    refused(Options { min_period_s: Some(-1.0), ..d() }, "min_period_s");
    refused(Options { min_period_s: Some(1e6), ..d() }, "min_period_s");
    refused(Options { max_period_s: Some(1e-6), ..d() }, "max_period_s");
    refused(Options { min_period_s: Some(9.0), max_period_s: Some(9.0), ..d() }, "max_period_s");
    refused(Options { max_frequencies: 0, ..d() }, "max_frequencies");
    let short = Series { sigma: &curve.sigma[1..], ..curve.series() };
    assert_eq!(search(&short, &d()), Err(PeriodError::Lengths { time: 50, value: 50, sigma: 49 }));
    assert!(power(&curve.series(), &[0.0], 1).is_err() && power(&curve.series(), &[0.1], 0).is_err());
}

#[test]
fn extreme_numbers_end_in_a_report_or_an_error() {
    let tiny = f64::MIN_POSITIVE;
    let extremes = [0.0, -0.0, tiny, -tiny, 1e-300, 1.0, 1e15, 1e300, f64::MAX, f64::MIN, f64::NAN, f64::INFINITY];
    let mut noise = Noise(95);
    for _ in 0..3000 {
        let count = (noise.even() * 30.0) as usize;
        let mut column = |ordinary: f64| {
            let kinds = (noise.even() * 13.0) as usize;
            let mut pick = |i: usize| match extremes.get((noise.even() * extremes.len() as f64) as usize) {
                Some(extreme) if (noise.even() * 13.0) as usize > kinds => *extreme,
                _ => ordinary * i as f64 + noise.even(),
            };
            (0..count).map(&mut pick).collect::<Vec<f64>>()
        };
        let curve = Curve { time: column(1.0), value: column(0.0), sigma: column(0.0) };
        let options = Options { max_frequencies: 2000, ..Options::default() };
        if let Ok(report) = search(&curve.series(), &options) {
            assert!(report.candidates.iter().all(|c| c.period_s > 0.0 && (0.0..=1.0).contains(&c.false_alarm)));
        }
    }
}
