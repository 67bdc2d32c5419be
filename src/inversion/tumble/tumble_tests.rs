use super::*;
use crate::inversion::egi::{Curve, Scale};
use crate::inversion::sphere::angle;
use crate::inversion::synthetic::{Stream, noisy, random_body};
use crate::object::convex::Epochs;
use glam::DQuat;
use std::f64::consts::TAU;

/// A body of 10 facets, moments 1.3 : 1 : 0.9, seen for 110 points in one pass and 50 in the next, at SNR 30; its motion.
fn observed() -> (Spinning, Motion) {
    let mut stream = Stream::new(3);
    let symmetric = Motion::precessing(stream.direction(), 1.0, 0.5, 120.0, 0.8);
    let truth = Motion { inertia: DVec3::new(1.3, 1.0, 0.9), ..symmetric };
    let (mut times, mut directions) = (Vec::new(), Vec::new());
    for (pass, points) in [(0.0, 110), (2500.0, 50)] {
        let (sun, observer) = (stream.direction(), stream.direction());
        times.extend((0..points).map(|k| pass + 7.0 * f64::from(k)));
        directions.extend(vec![(sun, observer); points as usize]);
    }
    let seen = truth.body_axes(&times, &directions).unwrap();
    let clean = Epochs::new(seen).curve(&random_body(10, 0.5, 3), &Material::lambert(1.0), 0.0);
    let (y, sigma) = noisy(&clean, 30.0, &mut stream);
    (
        Spinning { curves: vec![Curve { y, sigma, directions, scale: Scale::Fixed(1.0) }], times: vec![times] },
        truth,
    )
}

/// A symmetric body turns about its angular momentum at L/I_across (Landau & Lifshitz, Mechanics, sect. 33).
#[test]
fn a_symmetric_body_precesses_as_told() {
    let momentum = DVec3::new(0.6, 0.0, -0.8);
    for (nutation, moment) in [(0.3, 0.5), (1.2, 1.7), (0.7, 0.95)] {
        let start = Motion::precessing(momentum, 0.4, nutation, 50.0, moment);
        assert!(angle(start.momentum(), momentum) < 1e-14);
        let (turn, own) = start.periods().unwrap();
        // d psi/dt = L cos(nutation) (1/I_z - 1/I_across)
        let expected = 50.0 / (libm::cos(nutation) * (1.0 / moment - 1.0)).abs();
        assert!(
            (turn / 50.0 - 1.0).abs() < 1e-12 && (own / expected - 1.0).abs() < 1e-10,
            "{turn} {own} {expected}"
        );
        for t in [1.0, 333.3] {
            let after = start.after(t).unwrap();
            let (axis, was) = (after.attitude * DVec3::Z, start.attitude * DVec3::Z);
            assert!((angle(axis, momentum) - nutation).abs() < 1e-12);
            let turned = DQuat::from_axis_angle(momentum, TAU * t / 50.0) * was;
            assert!(angle(axis, turned) < 1e-11, "{nutation} {t}: {}", angle(axis, turned));
        }
    }
}

#[test]
fn changes_are_of_what_they_say_and_always_a_body() {
    let start = Motion::precessing(DVec3::Z, 0.0, 0.5, 60.0, 0.7);
    let same = start.changed(&[0.0; 8]);
    assert!((same.inertia.x / same.inertia.y - 1.0).abs() < 1e-15);
    assert!((same.inertia.z / same.inertia.x - 0.7).abs() < 1e-14);
    for by in [-6.0, 6.0] {
        let far = start.changed(&[0.1, 0.0, 0.0, 1e-3, 0.0, 0.0, by, -by]);
        assert!(far.after(10.0).is_some() && (far.attitude.angle_between(start.attitude) - 0.1).abs() < 1e-9);
    }
    // axes turned about z are no other motion of a symmetric body
    let times = [0.0, 17.0, 200.0];
    assert!(start.differs(&start.less_symmetric(0.0, 0.6), &times) < 1e-7);
    assert!(start.differs(&start.less_symmetric(0.3, 0.6), &times) > 1e-3);
}

/// 3 deg and one part in 300 of the rates off, more than 28 deg at the end: the motion comes back within 5 deg of the whole way.
#[test]
fn a_told_motion_is_mended() {
    let (spinning, truth) = observed();
    let told = Motion {
        attitude: truth.attitude * DQuat::from_scaled_axis(DVec3::new(0.03, -0.03, 0.03)),
        rate: truth.rate * (1.0 + 1.0 / 300.0),
        inertia: truth.inertia,
    };
    let times = &spinning.times[0];
    assert!(told.differs(&truth, times) > 0.5, "{}", told.differs(&truth, times));
    let how = Scan { told: Some(told), refined: 2, ..Scan::default() };
    let found = scan(&spinning, &Material::lambert(1.0), &how, &Options::default()).unwrap();
    let best = &found.minima[0];
    let off = best.motion.differs(&truth, times).to_degrees();
    assert!(off < 5.0 && best.solution.reduced() < 1.5, "{off} deg, {}", best.solution.reduced());
    assert!(angle(best.motion.momentum(), truth.momentum()) < 0.05);
    assert!((best.motion.periods().unwrap().0 / truth.periods().unwrap().0 - 1.0).abs() < 1e-3);
    assert_eq!(found.tried[0], 0);
}

#[test]
fn searches_that_cannot_be_are_refused_by_name() {
    let (spinning, truth) = observed();
    let tell = |spinning: &Spinning, how: &Scan| {
        scan(spinning, &Material::lambert(1.0), how, &Options::default()).unwrap_err().to_string()
    };
    assert!(tell(&spinning, &Scan::default()).starts_with("neither a tumble nor a range of turns"));
    let turns = |low, high| Scan { turn: Some((low, high)), ..Scan::default() };
    for (low, high) in [(0.0, 1.0), (2.0, 1.0), (1.0, f64::INFINITY), (f64::NAN, 1.0)] {
        assert!(tell(&spinning, &turns(low, high)).contains("above 0 and finite"), "{low} {high}");
    }
    assert!(tell(&spinning, &Scan { starts: 0, ..turns(1.0, 2.0) }).contains("0 starts"));
    for (inertia, rate) in [
        (DVec3::new(1.0, 1.0, 3.0), truth.rate),
        (DVec3::NAN, truth.rate),
        (DVec3::ONE, DVec3::ZERO),
        (DVec3::ONE, DVec3::INFINITY),
    ] {
        let told = Some(Motion { inertia, rate, ..truth });
        assert!(
            tell(&spinning, &Scan { told, ..Scan::default() }).contains("moments must be above 0"),
            "{inertia} {rate}"
        );
    }
    let mut late = spinning;
    late.times[0][3] = f64::INFINITY;
    assert!(tell(&late, &turns(100.0, 140.0)).starts_with("159 finite times for 160 data"));
}

/// Few points, one time, a curve without light: no panic, and an answer or a word why not.
#[test]
fn poor_data_are_survived() {
    let (spinning, truth) = observed();
    let few = |n: usize, dark: bool| {
        let curve = &spinning.curves[0];
        let y = curve.y[..n].iter().map(|y| if dark { 0.0 } else { *y }).collect();
        let (sigma, directions) = (curve.sigma[..n].to_vec(), curve.directions[..n].to_vec());
        let curves = vec![Curve { y, sigma, directions, scale: Scale::Free }];
        Spinning { curves, times: vec![spinning.times[0][..n].to_vec()] }
    };
    for (n, dark) in [(1, false), (3, false), (12, false), (12, true)] {
        let how = Scan {
            told: Some(truth),
            turn: Some((119.0, 121.0)),
            starts: 10,
            followed: 3,
            refined: 1,
            ..Scan::default()
        };
        let _ = scan(&few(n, dark), &Material::lambert(1.0), &how, &Options::default());
    }
}
