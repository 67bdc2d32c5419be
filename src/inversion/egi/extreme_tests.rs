use super::tests::*;
use super::*;
use crate::inversion::minkowski;
use crate::inversion::polytope::Polytope;
use crate::inversion::polytope::compare::{aligned, intersection_over_union};
use crate::inversion::sphere::{angle, fibonacci, tangents};
use crate::inversion::synthetic::*;
use glam::DVec3;
use std::f64::consts::PI;

/// Image of a smooth body of this area per solid angle.
fn smooth(density: impl Fn(DVec3) -> f64) -> Vec<Facet> {
    let count = 10_000;
    fibonacci(count).map(|n| Facet { normal: n, area: density(n) * 4.0 * PI / count as f64 }).collect()
}

#[test]
fn a_sphere_in_any_noise_has_no_facet() {
    for snr in [10.0, 30.0] {
        let solution = solved(observed(&smooth(|_| 1.0), 400, snr, 5));
        assert!(
            matches!(solution.verdict, Verdict::Smooth { body: Smooth::Sphere(_), .. }),
            "{:?}",
            solution.verdict
        );
        assert!(solution.facets.iter().all(|e| !e.claimed));
    }
}

/// Degree 3 and degree 2 on a sphere: smooth, and no ellipsoid.
#[test]
fn a_smooth_body_that_is_no_ellipsoid_is_unresolved() {
    let egg = smooth(|n| (1.0 + 0.5 * (3.0 * n.z.powi(3) - 1.8 * n.z) + 0.3 * n.x * n.y).powi(2));
    let defect: DVec3 = egg.iter().map(|f| f.normal * f.area).sum();
    let closed: Vec<Facet> =
        egg.iter().map(|f| Facet { area: f.area - 3.0 / 10_000.0 * f.normal.dot(defect), ..*f }).collect();
    let solution = solved(observed(&closed, 400, 10.0, 1));
    assert!(matches!(solution.verdict, Verdict::Unresolved { .. }), "{:?}", solution.verdict);
    assert!(solution.facets.iter().all(|e| !e.claimed));
}

/// Errors of claimed facets, log area and both moves, over their standard deviations: against the sum of the true facets nearer to each
/// than to others.
fn pulls(truth: &[Facet], solution: &Solution) -> Vec<f64> {
    let mut sums = vec![DVec3::ZERO; solution.facets.len()];
    for t in truth {
        let distance = |k: &usize| angle(solution.facets[*k].facet.normal, t.normal);
        let nearest = (0..sums.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap();
        sums[nearest] += t.normal * t.area;
    }
    let mut pulls = Vec::new();
    for (i, (e, sum)) in solution.facets.iter().zip(sums).enumerate().filter(|(_, (e, _))| e.claimed) {
        let [a, b] = tangents(e.facet.normal);
        let unit = sum.normalize_or(e.facet.normal);
        let errors = [(e.facet.area / sum.length()).ln(), unit.dot(a), unit.dot(b)];
        let pull = |(k, error): (usize, f64)| error.abs() / solution.covariance[3 * i + k][3 * i + k].sqrt();
        pulls.extend(errors.into_iter().enumerate().map(pull));
    }
    pulls.sort_by(f64::total_cmp);
    pulls
}

/// Of 35 facets at 1:100, one of them merged, most are claimed, and 68.3 % of their pulls lie within 0.8 to 1.3: about 150 pulls, sure to
/// 0.08. At 1:30 a third are merged, and none is claimed.
#[test]
fn claims_of_a_body_with_merged_facets_are_honest() {
    let truth = random_body(35, 0.25, 2);
    let mut all = Vec::new();
    for seed in 0..2 {
        all.extend(pulls(&truth, &solved(observed(&truth, 800, 100.0, 70 + seed))));
        let coarse = solved(observed(&truth, 600, 30.0, 70 + seed));
        assert!(coarse.facets.len() < truth.len() && coarse.facets.iter().filter(|e| e.claimed).count() <= 2);
    }
    all.sort_by(f64::total_cmp);
    assert!(all.len() > 120, "{}", all.len());
    let width = all[(0.683 * all.len() as f64) as usize];
    assert!((0.8..1.3).contains(&width), "{width} of {}", all.len());
}

/// Of a cylinder of 24 sides at 1:30 about 15 sides are found, each for more than one: only the ends may be claimed, and are.
#[test]
fn of_a_cylinder_whose_sides_merge_the_ends_are_claimed() {
    let truth = cylinder(1.0, 4.0);
    let solution = solved(observed(&truth, 800, 30.0, 1));
    let end = |f: &Facet| truth[24..].iter().any(|t| angle(t.normal, f.normal) < 0.02);
    let claimed: Vec<&Estimate> = solution.facets.iter().filter(|e| e.claimed).collect();
    assert!(claimed.len() <= 4 && claimed.iter().filter(|e| end(&e.facet)).count() == 2, "{claimed:?}");
}

/// 35 facets at 1:10: 17 stand for them, and the body is predicted better with the image on the grid.
#[test]
fn where_facets_are_lost_the_body_is_that_of_the_mean_image() {
    let truth = random_body(35, 0.25, 2);
    let solution = solved(observed(&truth, 800, 10.0, 100));
    let body = |facets: &[Facet]| {
        let (normals, areas): (Vec<DVec3>, Vec<f64>) = facets.iter().map(|f| (f.normal, f.area)).unzip();
        let policy = minkowski::closure::Policy::Adjust;
        let closure = minkowski::closure::Closure { limit: 1.0, policy, ..Default::default() };
        minkowski::solve(&normals, &areas, &minkowski::Options { closure, ..Default::default() }).unwrap().polytope
    };
    let known = body(&truth);
    let overlap = |found: Polytope| intersection_over_union(&known, &aligned(&known, found)).unwrap();
    let (mean, few) = (overlap(solution.body().unwrap().polytope), overlap(body(&solution.image())));
    assert!(solution.shape.len() > 2 * solution.facets.len() && mean > few + 0.02, "{mean} {few}");
}

#[test]
fn the_body_of_noise_free_data_is_exact_and_that_of_a_box_in_noise_close() {
    let truth = cuboid(DVec3::new(1.0, 2.0, 3.0));
    for (snr, least) in [(1e9, 1e-6), (30.0, 0.05)] {
        let body = solved(observed(&truth, 400, snr, 3)).body().unwrap();
        assert!((body.polytope.volume() / 6.0 - 1.0).abs() < least, "{}", body.polytope.volume());
        assert!(body.image.unobserved.is_none() && body.polytope.centroid().length() < 1e-9);
    }
}

/// Light of facets that do not close by 30 %: told by chi^2 and defect; without the condition they are found, and the
/// body gets a facet that is marked.
#[test]
fn thirty_per_cent_of_open_closure_is_told() {
    let mut truth = cube();
    truth.retain(|f| *f != cube()[1]);
    truth.iter_mut().filter(|f| **f == cube()[0]).for_each(|f| f.area = 1.7);
    let moment: DVec3 = truth.iter().map(|f| f.normal * f.area).sum();
    let open = moment / truth.iter().map(|f| f.area).sum::<f64>();
    assert!((open.length() - 0.3).abs() < 0.01);
    let curve = observed(&truth, 400, 50.0, 6);
    let forced = solved(curve.clone());
    assert!(forced.closed && forced.reduced() > 2.0 && forced.defect.length() > 10.0 * forced.defect_sd);
    let free = solved_with(curve, &Options { closure: Closure::Off, ..Options::default() });
    assert_eq!(free.facets.len(), 5);
    assert!((free.defect - open).length() < 4.0 * free.defect_sd && free.reduced() < 1.3);
    let body = free.body().unwrap();
    assert_eq!(body.image.unobserved, Some(5));
}

/// A twentieth of the data 10 sigma off: chi^2 is 1 + 100/20, and they are counted.
#[test]
fn outliers_of_10_sigma_are_counted_and_spoil_chi2() {
    let mut curve = observed(&cube(), 400, 50.0, 2);
    (0..400).step_by(20).for_each(|k| curve.y[k] += 10.0 * curve.sigma[k]);
    let plain = solved(curve.clone());
    assert!(
        (4.0..7.0).contains(&plain.reduced()) && plain.outliers >= 18,
        "{} {}",
        plain.reduced(),
        plain.outliers
    );
    let robust = solved_with(curve, &Options { huber: Some(1.345), ..Options::default() });
    assert_eq!((robust.facets.len(), robust.facets.iter().filter(|e| e.claimed).count()), (6, 6));
    assert!((18..26).contains(&robust.outliers), "{}", robust.outliers);
}
