use super::*;
use crate::inversion::egi::{Curve, Problem, Scale};
use crate::inversion::sphere::angle;
use crate::inversion::synthetic::*;
use crate::object::convex::{Epochs, Facet};
use crate::object::matter::{Material, Model};
use glam::{DMat3, DQuat, DVec3};
use std::f64::consts::PI;

/// Light curves of an L by check/rays.py, which casts rays at 400 x 400 points of each face.
const RAYS: &str = include_str!("../../../tests/reference/rays.csv");

type Pair = (DVec3, DVec3);

fn tilted(parts: &[([f64; 3], [f64; 3])]) -> Vec<Part> {
    let axes = DMat3::from_quat(DQuat::from_xyzw(0.31, -0.52, 0.17, 0.78).normalize());
    let part =
        |(c, h): &([f64; 3], [f64; 3])| Part { centre: axes * DVec3::from(*c), axes, half: DVec3::from(*h) };
    parts.iter().map(part).collect()
}

fn l_body() -> Vec<Part> {
    tilted(&[([0.0, -0.5, 0.0], [1.0, 0.5, 0.5]), ([-0.5, 0.5, 0.0], [0.5, 0.5, 0.5])])
}

fn triangles(parts: &[Part]) -> Vec<Vec<Triangle>> {
    parts.iter().map(|part| part.triangles().to_vec()).collect()
}

/// 160 epochs at phase angles of 50 and 90 deg, any attitude.
fn seen(parts: &[Part], snr: f64, seed: u64) -> (Vec<Pair>, Vec<f64>, Vec<f64>) {
    seen_at(80, parts, snr, seed)
}

/// So many epochs at each of both phase angles.
fn seen_at(count: usize, parts: &[Part], snr: f64, seed: u64) -> (Vec<Pair>, Vec<f64>, Vec<f64>) {
    let mut stream = Stream::new(seed);
    let mut directions = fixed_phase(count, 50f64.to_radians(), &mut stream);
    directions.extend(fixed_phase(count, 90f64.to_radians(), &mut stream));
    let mut renderer = Renderer::default();
    let material = Material::lambert(0.5);
    let curve: Vec<f64> = directions.iter().map(|p| renderer.light(parts, &material, *p, None)).collect();
    let (y, sigma) = noisy(&curve, snr, &mut stream);
    (directions, y, sigma)
}

fn few() -> Options {
    Options { proposals: 60, beam: 2, most: 3, ..Options::default() }
}

fn overlap(truth: &[Part], found: &Assembly) -> f64 {
    let truth = triangles(truth);
    let found = metrics::aligned(&truth, &found.triangles(), 1 << 14);
    metrics::intersection_over_union(&truth, &found, 1 << 16)
}

#[test]
fn an_l_without_noise_is_found_exactly_with_two_parts() {
    let truth = l_body();
    let (directions, y, sigma) = seen(&truth, 1e6, 1);
    let options = Options { most: 2, ..few() };
    let found = assemble(&directions, &y, &sigma, &Material::lambert(0.5), &options).unwrap();
    assert_eq!(found.parts.len(), 2);
    let iou = overlap(&truth, &found);
    assert!(iou > 0.9995, "{iou}");
    // three standard deviations of chi^2
    assert!((found.chi2 - found.dof).abs() < 3.0 * (2.0 * found.dof).sqrt(), "{} {}", found.chi2, found.dof);
    let mesh = found.mesh();
    assert_eq!((mesh.vertices.len(), mesh.faces.len(), mesh.groups.len()), (16, 24, 2));
    // a touching face leaves no hairline gap
    let parts: Vec<Part> = found.parts.iter().map(|e| e.part).collect();
    let violations = found.ties.iter().flat_map(|tie| tie.rows(&parts, 1.0)).map(|row| row.residual.abs());
    assert!(!found.ties.is_empty() && violations.fold(0.0, f64::max) < 1e-11);
    // an edge that hides in the other part is as sure as its tie allows
    assert!(found.parts.iter().all(|e| e.half_sd.max_element() < 0.01), "{:?}", found.parts);
    let volume: f64 = found.parts.iter().map(|e| e.part.volume()).sum();
    assert!((mesh.signed_volume() - volume).abs() < 1e-9 * volume);
}

#[test]
fn an_l_at_snr_100_is_two_parts_its_overlap_above_0_95_and_its_rivals_listed() {
    let truth = l_body();
    let (directions, y, sigma) = seen(&truth, 100.0, 2);
    let found = assemble(&directions, &y, &sigma, &Material::lambert(0.5), &few()).unwrap();
    let iou = overlap(&truth, &found);
    assert!(found.parts.len() == 2 && iou > 0.95, "{} {iou}", found.parts.len());
    assert!(found.trials[0].bic > found.trials[1].bic && found.trials[2].bic > found.trials[1].bic);
    assert!(
        found.trials[0].held_out > 10.0 * found.trials[1].held_out
            && found.held_out.iter().filter(|h| **h).count() == 32
    );
    let best = &found.alternatives[0];
    assert!(best.chi2 == found.chi2 && best.chamfer == 0.0);
    let bound = found.trials[1].chi2 + 3.0 * 320f64.sqrt();
    assert!(found.alternatives.iter().skip(1).all(|a| a.chi2 <= bound && a.chamfer > 0.0));
    assert!(found.spread.volume.0 <= best.volume && best.volume <= found.spread.volume.1);
}

#[test]
fn panel_areas_and_normals_at_snr_100_within_a_tenth_and_two_degrees() {
    let truth = tilted(&[
        ([0.0; 3], [0.5, 0.5, 0.65]),
        ([0.0, 1.5, 0.0], [0.03, 0.8, 0.5]),
        ([0.0, -1.5, 0.0], [0.03, 0.8, 0.5]),
    ]);
    let (directions, y, sigma) = seen_at(50, &truth, 100.0, 1);
    let options = Options { proposals: 80, beam: 2, most: 3, ..Options::default() };
    let found = assemble(&directions, &y, &sigma, &Material::lambert(0.5), &options).unwrap();
    let panels: Vec<Panel> = found.parts.iter().filter_map(|e| e.panel).collect();
    let area: f64 = panels.iter().map(|p| p.exposed).sum();
    assert!((area / 3.2 - 1.0).abs() < 0.1, "{area}");
    for panel in panels {
        let off = angle(panel.normal, truth[1].side().0);
        let off = off.min(PI - off);
        assert!(off < 2f64.to_radians() && off < 5.0 * panel.normal_sd, "{off} {}", panel.normal_sd);
    }
}

#[test]
fn standard_deviations_hold_against_truth() {
    let truth = tilted(&[([0.0; 3], [0.5, 0.7, 1.0])]);
    let mut worst = 0.0f64;
    let mut inside = 0;
    for seed in 0..12 {
        let (directions, y, sigma) = seen(&truth, 50.0, 100 + seed);
        let options = Options { most: 1, proposals: 20, ..Options::default() };
        let found = assemble(&directions, &y, &sigma, &Material::lambert(0.5), &options).unwrap();
        let mut half = found.parts[0].part.half.to_array();
        let mut order = [0, 1, 2];
        order.sort_by(|a, b| half[*a].total_cmp(&half[*b]));
        let sd = order.map(|k| found.parts[0].half_sd[k]);
        half.sort_by(f64::total_cmp);
        for ((found, truth), sd) in half.into_iter().zip([0.5, 0.7, 1.0]).zip(sd) {
            let z = (found - truth).abs() / sd;
            worst = worst.max(z);
            inside += usize::from(z < 1.0);
        }
    }
    // of 36 two thirds within one: 24 +- 3; the probability of 4 sigma among them is 0.2 %
    assert!((15..=33).contains(&inside) && worst < 4.0, "{inside} {worst}");
}

#[test]
fn curves_cast_by_rays_elsewhere_are_fitted_to_their_error() {
    let mut directions = Vec::new();
    let mut flux = Vec::new();
    for line in RAYS.lines().skip(1) {
        let v: Vec<f64> = line.split(',').map(|v| v.parse().unwrap()).collect();
        directions.push((DVec3::new(v[0], v[1], v[2]), DVec3::new(v[3], v[4], v[5])));
        flux.push(v[6]);
    }
    let axes = DMat3::from_quat(DQuat::from_axis_angle(DVec3::new(2.0, -1.0, 2.0) / 3.0, 0.9));
    let part = |c: [f64; 3], h: [f64; 3]| Part { centre: axes * DVec3::from(c), axes, half: DVec3::from(h) };
    let truth = [part([0.0, -0.5, 0.0], [1.0, 0.5, 0.4]), part([-0.5, 0.5, 0.0], [0.5, 0.5, 0.4])];
    let (material, mut renderer) = (Material::lambert(0.5), Renderer::default());
    let mean = flux.iter().sum::<f64>() / flux.len() as f64;
    // a grid of 400 points a side errs at shadow edges by a share of 1/400 of the few points there
    for (pair, flux) in directions.iter().zip(&flux) {
        let light = renderer.light(&truth, &material, *pair, None);
        assert!((light - flux).abs() < 1e-3 * mean, "{light} {flux}");
    }
    let sigma = vec![1e-3 * mean; flux.len()];
    let options = Options { most: 2, ..few() };
    let found = assemble(&directions, &flux, &sigma, &material, &options).unwrap();
    let iou = overlap(&truth, &found);
    assert!(found.parts.len() == 2 && iou > 0.99, "{} {iou}", found.parts.len());
}

#[test]
fn ten_seeds_of_convex_bodies_raise_no_alarm_and_an_l_does() {
    let bodies: [Vec<Facet>; 3] = [cuboid(DVec3::new(1.0, 2.0, 3.0)), icosahedron(1.0), cylinder(0.3, 1.0)];
    let material = Material::lambert(0.5);
    let mut alarms = 0;
    for seed in 0..10 {
        let mut stream = Stream::new(seed);
        let directions = directions(200, &mut stream);
        let body = &bodies[seed as usize % 3];
        let curve = Epochs::new(directions.clone()).curve(body, &material, 0.0);
        let (y, sigma) = noisy(&curve, if seed % 2 == 0 { 30.0 } else { 100.0 }, &mut stream);
        let problem = Problem::new(&[Curve { y, sigma, directions, scale: Scale::Fixed(1.0) }]).unwrap();
        alarms += usize::from(test(&problem, &material, 0.02).unwrap().call == Call::NonConvex);
    }
    // at a rate of 2 % two of ten have a probability of 2 %
    assert!(alarms <= 1, "{alarms}");
    let call = |snr: f64| {
        let (directions, y, sigma) = seen(&l_body(), snr, 3);
        let problem = Problem::new(&[Curve { y, sigma, directions, scale: Scale::Fixed(1.0) }]).unwrap();
        test(&problem, &material, 0.02).unwrap()
    };
    let (clear, hidden) = (call(100.0), call(5.0));
    assert!(clear.call == Call::NonConvex && clear.floor > clear.floor_found, "{clear:?}");
    assert!(hidden.call == Call::CannotTell && hidden.floor_found > 0.04, "{hidden:?}");
}

#[test]
fn the_baseline_folds_a_concavity_and_beats_the_convex_body_of_an_l() {
    let (directions, y, sigma) = seen(&l_body(), 100.0, 4);
    let problem = Problem::new(&[Curve { y, sigma, directions, scale: Scale::Fixed(1.0) }]).unwrap();
    let found = baseline(&problem, &Material::lambert(0.5)).unwrap();
    assert_eq!(found.scan.len(), 9);
    assert!(found.best.angle > 0.0 && found.best.chi2 < found.scan[0].chi2);
    // out of the notch, which opens to +x +y of the L
    let notch = l_body()[0].axes * DVec3::new(1.0, 1.0, 0.0).normalize();
    assert!(found.direction.dot(notch) > 0.8, "{}", found.direction);
    assert!(metrics::bulk(&[found.triangles], 4096).volume > 0.0);
}

#[test]
fn bad_input_is_refused_with_its_value() {
    let material = Material::lambert(0.5);
    let (directions, y, sigma) = seen(&l_body(), 100.0, 1);
    let tell = |y: &[f64], sigma: &[f64], options: &Options| {
        assemble(&directions, y, sigma, &material, options).unwrap_err().to_string()
    };
    let usual = Options::default();
    assert!(tell(&y[1..], &sigma, &usual).contains("159 data, 160 errors and 160 directions"));
    assert!(tell(&[f64::INFINITY; 160], &sigma, &usual).contains("y = inf"));
    assert!(tell(&y, &[0.0; 160], &usual).contains("sigma = 0"));
    assert_eq!(tell(&y, &sigma, &Options { most: 0, ..usual }), "most = 0 is outside 1 to 6");
    assert!(tell(&y, &sigma, &Options { held_out: f64::NAN, ..usual }).contains("held_out = NaN"));
    let mut gaps = y.clone();
    gaps.iter_mut().skip(10).for_each(|y| *y = f64::NAN);
    assert_eq!(tell(&gaps, &sigma, &usual), "10 data; 24 are needed at least");
    assert!(matches!(assemble(&directions, &[0.0; 160], &sigma, &material, &usual), Err(NonconvexError::Dark)));
    let problem = Problem::new(&[Curve { y, sigma, directions: directions.clone(), scale: Scale::Fixed(1.0) }]);
    assert!(test(&problem.unwrap(), &material, 0.0).unwrap_err().to_string().contains("rate = 0"));
}

#[test]
fn a_glossy_box_with_a_boss_is_found_in_its_own_material() {
    let truth = tilted(&[([0.0; 3], [1.0, 0.8, 0.5]), ([0.2, 0.1, 0.9], [0.4, 0.3, 0.4])]);
    let material =
        Material { model: Model::BlinnPhong, diffuse: 0.3, specular: 0.3, exponent: 8.0, roughness: 0.3 };
    let (directions, ..) = seen(&truth, 100.0, 8);
    let mut renderer = Renderer::default();
    let curve: Vec<f64> = directions.iter().map(|p| renderer.light(&truth, &material, *p, None)).collect();
    let (y, sigma) = noisy(&curve, 300.0, &mut Stream::new(3));
    let found = assemble(&directions, &y, &sigma, &material, &Options { most: 2, ..few() }).unwrap();
    let iou = overlap(&truth, &found);
    assert!(found.parts.len() == 2 && iou > 0.97, "{} {iou}", found.parts.len());
}

#[test]
fn stiff_data_end_without_panic_and_the_same_twice() {
    let material = Material::lambert(0.5);
    let options = Options { proposals: 20, beam: 1, most: 2, ..Options::default() };
    let mut stream = Stream::new(9);
    let noise: Vec<f64> = (0..30).map(|_| stream.normal()).collect();
    let opposite: Vec<Pair> = (0..30).map(|_| stream.direction()).map(|s| (s, -s)).collect();
    let same = vec![(DVec3::X, DVec3::X); 30];
    let any = directions(30, &mut stream);
    for directions in [opposite, same, any] {
        for flux in [&noise, &vec![1e20; 30]] {
            for sigma in [1e-12, 1.0] {
                let run = || assemble(&directions, flux, &[sigma; 30], &material, &options);
                let found = run();
                if let Ok(found) = &found {
                    assert!(found.parts.iter().all(|e| e.part.half.is_finite() && e.part.centre.is_finite()));
                }
                if sigma == 1.0 {
                    assert_eq!(format!("{found:?}"), format!("{:?}", run()));
                }
            }
        }
    }
}

/// A body that spins, seen in four nights with Sun and observer at rest: 60 points each.
fn four_nights(stream: &mut Stream) -> Vec<Pair> {
    let turned = |pair: Pair, k: usize| {
        let turn = DQuat::from_rotation_z(-2.0 * PI * (3000.0 * (k / 60) as f64 + 7.3 * (k % 60) as f64) / 137.0);
        (turn * pair.0, turn * pair.1)
    };
    let nights: Vec<Pair> = directions(4, stream);
    (0..240).map(|k| turned(nights[k / 60], k)).collect()
}

/// Few geometries leave images open that fit as well as closed ones: no alarm.
#[test]
fn a_convex_body_in_few_geometries_raises_no_alarm() {
    let material = Material::lambert(1.0);
    let mut alarms = 0;
    for seed in 0..10 {
        let mut stream = Stream::new(3000 + seed);
        let directions = four_nights(&mut stream);
        let curve = Epochs::new(directions.clone()).curve(&random_body(14, 0.4, seed), &material, 0.0);
        let (y, sigma) = noisy(&curve, 30.0, &mut stream);
        let problem = Problem::new(&[Curve { y, sigma, directions, scale: Scale::Fixed(1.0) }]).unwrap();
        alarms += usize::from(test(&problem, &material, 0.02).unwrap().call == Call::NonConvex);
    }
    // at a rate of 2 % two of ten have a probability of 2 %
    assert!(alarms <= 1, "{alarms}");
}

/// Edges of 1.00, 1.03 and 1.06 at SNR 20, which the light hardly tells apart, may be taken for equal; the errors hold nevertheless.
#[test]
fn errors_allow_for_regularities_that_are_none() {
    let truth = tilted(&[([0.0; 3], [1.0, 1.03, 1.06])]);
    let (mut squares, mut count) = (0.0, 0.0);
    for seed in 0..6 {
        let (directions, y, sigma) = seen(&truth, 20.0, 500 + seed);
        let options = Options { most: 1, ..few() };
        let found = assemble(&directions, &y, &sigma, &Material::lambert(0.5), &options).unwrap();
        let own = &found.parts[0];
        for k in 0..3 {
            let (axis, _) = tie::partner(&truth[0], &own.part, k);
            squares += ((own.part.half[axis] - truth[0].half[k]) / own.half_sd[axis]).powi(2);
            count += 1.0;
        }
    }
    // errors that are true have an rms of 1; these are told 1.6 times too small here (20 seeds of a like box, docs/inversion.md)
    let rms = f64::sqrt(squares / count);
    assert!(rms < 1.7, "{rms}");
}
