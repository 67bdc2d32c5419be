use std::fmt::Write;

use super::baselines::FirstOrder;
use super::body::Body;
use super::cases::Case;
use super::closure::Policy;
use super::*;
use crate::inversion::polytope::compare::hausdorff;
use glam::DMat3;

fn solved(normals: &[DVec3], areas: &[f64]) -> Solution {
    solve(normals, areas, &Options::default()).unwrap()
}

fn with(closure: Closure) -> Options {
    Options { closure, ..Options::default() }
}

fn moment(image: &Closed) -> f64 {
    image.normals.iter().zip(&image.areas).map(|(&n, &a)| n * a).sum::<DVec3>().length()
}

#[test]
fn every_case_is_solved_to_rounding_within_twenty_steps() {
    for Case { name, normals, areas } in cases::all(5000).unwrap() {
        let solution = solved(&normals, &areas);
        let facets = normals.len();
        assert!(solution.residual <= 1e-12, "{name}: {}", solution.residual);
        assert!(solution.iterations <= 20, "{name}: {} steps", solution.iterations);
        assert_eq!(solution.inertia, Inertia { positive: 1, zero: 3, negative: facets - 4 }, "{name}");
        let reach = solution.polytope.centroid().length() / solution.polytope.diagonal();
        assert!(reach < 1e-12, "{name}: centroid at {reach}");
    }
}

#[test]
fn twenty_thousand_facets_are_solved_to_rounding() {
    let (normals, areas) = cases::ellipsoid(20_000, DVec3::new(1.0, 2.0, 3.0)).unwrap();
    let solution = solved(&normals, &areas);
    assert!(
        solution.residual <= 1e-12 && solution.iterations <= 10,
        "{} in {}",
        solution.residual,
        solution.iterations
    );
    assert_eq!(solution.inertia, Inertia { positive: 1, zero: 3, negative: 19_996 });
}

#[test]
fn boxes_of_any_aspect_take_three_steps() {
    for edges in
        [(1.0, 1.0, 1.0), (1.0, 2.0, 3.0), (1.0, 1.0, 1e4), (1e4, 1e4, 1.0), (1.0, 100.0, 1e4), (1e-6, 1e-3, 1.0)]
    {
        let edges = DVec3::from(edges);
        let (normals, areas) = cases::cuboid(edges);
        let solution = solved(&normals, &areas);
        assert!(solution.iterations <= 3, "{edges}: {} steps", solution.iterations);
        for (normal, offset) in normals.iter().zip(solution.offsets()) {
            let half = 0.5 * normal.abs().dot(edges);
            assert!((offset / half - 1.0).abs() < 1e-11, "{edges} along {normal}: {offset}");
        }
    }
}

#[test]
fn areas_far_apart_are_solved_for_every_seed() {
    for seed in 0..100 {
        let (normals, areas) = cases::lognormal(if seed < 95 { 20 } else { 300 }, 4.0, seed).unwrap();
        let solution = solved(&normals, &areas);
        assert!(
            solution.iterations <= 20 && solution.residual < 1e-9,
            "seed {seed}: {} in {}",
            solution.residual,
            solution.iterations
        );
        assert!(solution.polytope.areas().iter().all(|&area| area > 0.0));
    }
}

#[test]
fn a_body_through_a_file_of_polygons_and_back_is_the_same() {
    for (count, spread, seed) in [(14, 0.2, 1), (100, 0.02, 2), (1000, 0.001, 3)] {
        let (normals, areas) = cases::random(count, spread, seed).unwrap();
        let first = solved(&normals, &areas).polytope;
        let mut text = String::new();
        let mesh = first.mesh();
        mesh.vertices.iter().for_each(|v| writeln!(text, "v {} {} {}", v.x, v.y, v.z).unwrap());
        let line = |polygon: &Vec<u32>| polygon.iter().fold("f".to_owned(), |line, v| format!("{line} {}", v + 1));
        mesh.polygons.iter().for_each(|polygon| writeln!(text, "{}", line(polygon)).unwrap());
        let words = |key: &str| -> Vec<Vec<f64>> {
            let lines = text.lines().filter_map(|line| line.strip_prefix(key));
            lines.map(|line| line.split_whitespace().map(|word| word.parse().unwrap()).collect()).collect()
        };
        let vertices: Vec<DVec3> = words("v ").iter().map(|v| DVec3::from_slice(v)).collect();
        let polygons: Vec<Vec<u32>> =
            words("f ").iter().map(|f| f.iter().map(|v| *v as u32 - 1).collect()).collect();
        let (normals, areas) = image::of_mesh(&vertices, &polygons);
        let second = solved(&normals, &areas).polytope;
        let distance = hausdorff(&first, &second) / first.diagonal();
        assert!(distance <= 1e-10, "{count} planes: {distance}");
    }
}

#[test]
fn an_affine_map_of_the_body_is_that_of_its_image() {
    let map = DMat3::from_cols(DVec3::new(2.0, 0.3, -0.1), DVec3::new(0.0, 0.5, 0.2), DVec3::new(0.1, -0.4, 1.5));
    let (normals, areas) = cases::random(60, 0.05, 4).unwrap();
    let body = solved(&normals, &areas).polytope;
    // area vectors go with the cofactors
    let cofactors = map.inverse().transpose() * map.determinant();
    let (there, sizes): (Vec<DVec3>, Vec<f64>) =
        normals.iter().zip(&areas).map(|(&n, &a)| cofactors * n * a).map(|g| (g.normalize(), g.length())).unzip();
    let mapped = solved(&there, &sizes).polytope;
    assert!((mapped.volume() / (body.volume() * map.determinant()) - 1.0).abs() < 1e-13);
    for &v in body.vertices() {
        assert!(mapped.excess(map * v).abs() < 1e-12, "{}", mapped.excess(map * v));
    }
}

#[test]
fn newtons_matrix_solves_for_closed_changes_of_areas() {
    // 80 facets are one dense part, 2000 a tree
    for count in [80, 2000] {
        let (normals, areas) = cases::random(count, 0.001, 5).unwrap();
        let target = Target::new(normals.clone(), &areas);
        let body: Body = target.body(target.planes(|_| 1.0)).unwrap();
        let shares = body.shares();
        let wanted: Vec<f64> = target.areas.iter().zip(&shares).map(|(a, u)| a - u).collect();
        let factors = body.factors();
        let x = factors.solve(&wanted);
        let along: f64 = shares.iter().zip(&x).map(|(u, x)| u * x).sum();
        let bent = body.measures.hessian_times(&body.planes, &x);
        let size = wanted.iter().map(|w| w.abs()).fold(0.0, f64::max);
        for i in 0..normals.len() {
            let product = shares[i] * along - bent[i] / body.measures.volume;
            assert!(
                (product - wanted[i]).abs() < 1e-9 * size,
                "{count} planes, row {i}: {product} for {}",
                wanted[i]
            );
        }
        assert_eq!(factors.negative, 4);
    }
}

#[test]
fn inertia_by_pivots_is_that_of_the_eigenvalues() {
    let (normals, areas) = cases::random(24, 0.2, 6).unwrap();
    let target = Target::new(normals.clone(), &areas);
    let body = target.body(target.planes(|_| 1.0)).unwrap();
    let m = normals.len();
    let unit = |j: usize| (0..m).map(|i| f64::from(u8::from(i == j))).collect::<Vec<f64>>();
    let mut matrix: Vec<Vec<f64>> = (0..m).map(|j| body.measures.hessian_times(&body.planes, &unit(j))).collect();
    // Jacobi's rotations
    for _ in 0..20 {
        for p in 0..m {
            for q in p + 1..m {
                let apq = matrix[p][q];
                if apq.abs() < 1e-300 {
                    continue;
                }
                let theta = 0.5 * (matrix[q][q] - matrix[p][p]) / apq;
                let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
                let (c, s) = (1.0 / t.hypot(1.0), t / t.hypot(1.0));
                let turn = |a: f64, b: f64| (c * a - s * b, s * a + c * b);
                matrix.iter_mut().for_each(|row| (row[p], row[q]) = turn(row[p], row[q]));
                let (upper, lower) = matrix.split_at_mut(q);
                upper[p].iter_mut().zip(&mut lower[0]).for_each(|(a, b)| (*a, *b) = turn(*a, *b));
            }
        }
    }
    let count = |test: fn(f64) -> bool| (0..m).filter(|&i| test(matrix[i][i])).count();
    let (positive, negative) = (count(|e| e > 1e-10), count(|e| e < -1e-10));
    assert_eq!(inertia(m, body.factors().negative), Inertia { positive, zero: m - positive - negative, negative });
    assert_eq!((positive, negative), (1, m - 4));
}

#[test]
fn dissection_takes_every_vertex_once_and_separates() {
    let (normals, _) = cases::random(3000, 0.0, 7).unwrap();
    let target = Target::new(normals.clone(), &vec![1.0; normals.len()]);
    let measures = target.body(target.planes(|_| 1.0)).unwrap().measures;
    let beside = |i: u32| &measures.neighbours[measures.starts[i as usize]..measures.starts[i as usize + 1]];
    let parts = dissect::dissect(&normals, beside);
    let mut part_of = vec![usize::MAX; normals.len()];
    let mut parent = vec![usize::MAX; parts.len()];
    for (k, part) in parts.iter().enumerate() {
        part.children.iter().for_each(|&child| parent[child] = k);
        for &v in &part.own {
            assert_eq!(part_of[v as usize], usize::MAX, "vertex {v} twice");
            part_of[v as usize] = k;
        }
    }
    let above =
        |low: usize, high: usize| std::iter::successors(Some(low), |&k| parent.get(k).copied()).any(|k| k == high);
    for v in 0..normals.len() as u32 {
        for &u in beside(v) {
            let (a, b) = (part_of[v as usize], part_of[u as usize]);
            assert!(above(a.min(b), a.max(b)), "edge {v}-{u} joins separate parts");
        }
    }
    // George's separators: O(sqrt m) at the root
    assert!(parts.last().unwrap().own.len() < 8 * 55, "{}", parts.last().unwrap().own.len());
}

#[test]
fn open_images_are_closed_by_the_least_change_of_areas() {
    let (normals, mut areas) = cases::random(60, 0.05, 8).unwrap();
    areas.iter_mut().enumerate().for_each(|(i, a)| *a *= 1.0 + 0.3 * (i as f64).sin());
    let sigmas: Vec<f64> = areas.iter().enumerate().map(|(i, a)| a * (0.5 + (i % 3) as f64)).collect();
    let solution =
        solve(&normals, &areas, &with(Closure { sigmas: Some(sigmas.clone()), ..Closure::default() })).unwrap();
    let image = &solution.image;
    assert_eq!((image.normals.as_slice(), image.unobserved), (normals.as_slice(), None));
    assert!(moment(image) < 1e-14 * areas.iter().sum::<f64>());
    assert!(image.defect > 0.005 && image.significance.unwrap() < 5.0 && solution.residual < 1e-12);
    // least: the change over its variance is n.x for one x, which no other closed change orthogonal to it improves
    let change: Vec<f64> = image.areas.iter().zip(&areas).map(|(c, a)| c - a).collect();
    let cost: f64 = change.iter().zip(&sigmas).map(|(d, s)| (d / s).powi(2)).sum();
    let closed = |wanted: Vec<f64>| {
        let spread = normals.iter().fold(DMat3::ZERO, |m, &n| m + DMat3::from_cols(n * n.x, n * n.y, n * n.z));
        let tilt = spread.inverse() * normals.iter().zip(&wanted).map(|(&n, &w)| n * w).sum::<DVec3>();
        normals.iter().zip(wanted).map(|(n, w)| w - n.dot(tilt)).collect::<Vec<f64>>()
    };
    let other = closed(areas.iter().enumerate().map(|(k, a)| (k as f64 * 1.7).cos() * a).collect());
    for size in [1e-3, -1e-3] {
        let worse: f64 =
            change.iter().zip(&other).zip(&sigmas).map(|((d, o), s)| ((d + size * o) / s).powi(2)).sum();
        assert!(worse > cost, "{worse} for {cost}");
    }
}

#[test]
fn images_open_by_a_third_are_refused_closed_or_completed_as_asked() {
    // a cube whose top was not seen is open by a fifth; one with a top of three, by a quarter
    let (normals, _) = cases::cuboid(DVec3::ONE);
    let areas = [1.0, 1.0, 1.0, 1.0, 3.5, 0.8];
    let refused = solve(&normals, &areas, &Options::default()).err();
    assert!(
        matches!(refused, Some(Fault::Open { defect, .. }) if (defect - 2.7 / 8.3).abs() < 1e-12),
        "{refused:?}"
    );
    let adjusted = solve(&normals, &areas, &with(Closure { limit: 0.5, ..Closure::default() })).unwrap();
    assert!(moment(&adjusted.image) < 1e-14 && adjusted.image.areas.iter().all(|&a| a > 0.0));
    assert!(adjusted.residual < 1e-13 && adjusted.image.change > 0.1);
    let completed =
        solve(&normals, &areas, &with(Closure { policy: Policy::AddFacet, ..Closure::default() })).unwrap();
    assert_eq!(completed.image.unobserved, Some(5));
    assert!((completed.image.areas[5] - 3.5).abs() < 1e-14);
    // the missing side is told from noise by the standard deviations
    let seen = Closure { sigmas: Some(vec![0.01; 5]), ..Closure::default() };
    let found = solve(&normals[..5], &[1.0; 5], &with(seen)).unwrap();
    assert_eq!((found.image.unobserved, found.image.normals.len()), (Some(5), 6));
    assert!(
        (found.image.significance.unwrap() - 100.0).abs() < 1e-9 && (found.polytope.volume() - 1.0).abs() < 1e-12
    );
}

#[test]
fn areas_stay_positive_where_the_smallest_change_would_not() {
    // a tiny facet on the heavy side would go below zero
    let (mut normals, mut areas) = cases::cuboid(DVec3::ONE);
    normals.push(DVec3::new(0.6, 0.0, 0.8));
    areas.push(1e-3);
    areas[4] = 1.4;
    let closure = Closure { policy: Policy::Adjust, sigmas: Some(vec![0.1; 7]), ..Closure::default() };
    let solution = solve(&normals, &areas, &with(closure)).unwrap();
    assert!((solution.image.areas[6] / 5e-5 - 1.0).abs() < 1e-12, "{:?}", solution.image.areas);
    assert!(moment(&solution.image) < 1e-14 && solution.residual < 1e-12);
}

#[test]
fn images_without_a_body_are_refused() {
    let ring: Vec<DVec3> = (0..7).map(|k| f64::from(k).sin_cos()).map(|(s, c)| DVec3::new(c, s, 0.0)).collect();
    let turn = DMat3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.7);
    let turned: Vec<DVec3> = ring.iter().map(|&n| turn * n).collect();
    let dome: Vec<DVec3> = cases::spiral(40).filter(|n| n.z > 0.1).collect();
    let refuse = |normals: &[DVec3]| solve(normals, &vec![1.0; normals.len()], &Options::default()).err();
    assert!(matches!(refuse(&ring), Some(Fault::Coplanar { .. })), "{:?}", refuse(&ring));
    assert!(matches!(refuse(&turned), Some(Fault::Coplanar { .. })), "{:?}", refuse(&turned));
    assert!(matches!(refuse(&[DVec3::X, -DVec3::X]), Some(Fault::Count(2))));
    assert!(matches!(refuse(&[DVec3::X, -DVec3::X, DVec3::X, -DVec3::X]), Some(Fault::Count(2))));
    assert!(matches!(refuse(&[DVec3::X, -DVec3::X, DVec3::Y, -DVec3::Y]), Some(Fault::Coplanar { .. })));
    assert_eq!(refuse(&dome), Some(Fault::OneSided));
    assert!(matches!(refuse(&[]), Some(Fault::Count(0))));
}

#[test]
fn values_without_meaning_are_refused() {
    let (normals, areas) = cases::octahedron();
    let refuse = |k: usize, normal: DVec3, area: f64| {
        let (mut normals, mut areas) = (normals.clone(), areas.clone());
        (normals[k], areas[k]) = (normal, area);
        solve(&normals, &areas, &Options::default()).err()
    };
    for bad in [DVec3::NAN, DVec3::NEG_INFINITY, DVec3::ZERO, DVec3::splat(1e-200)] {
        assert!(matches!(refuse(2, bad, 1.0), Some(Fault::Normal { index: 2, .. })), "{bad}");
    }
    for bad in [f64::NAN, f64::INFINITY, 0.0, -1.0, 1e-30, 1e60] {
        assert!(matches!(refuse(3, normals[3], bad), Some(Fault::Area { .. })), "{bad}");
    }
    assert!(matches!(solve(&normals, &areas[1..], &Options::default()), Err(Fault::Lengths { .. })));
    for bad in [f64::NAN, 0.0, -1.0] {
        let closure = Closure { sigmas: Some(vec![bad; 8]), ..Closure::default() };
        assert!(matches!(solve(&normals, &areas, &with(closure)), Err(Fault::Sigma { index: 0, .. })), "{bad}");
    }
    let hasty = Options { iterations: 1, ..Options::default() };
    let (normals, areas) = cases::lognormal(100, 3.0, 1).unwrap();
    assert!(matches!(solve(&normals, &areas, &hasty), Err(Fault::NotSolved { iterations: 1, .. })));
}

#[test]
fn equal_normals_are_one_facet() {
    let (mut normals, mut areas) = cases::cuboid(DVec3::new(1.0, 2.0, 3.0));
    areas[0] = 2.0;
    normals.extend([DVec3::X * 7.0, (DVec3::X + DVec3::Y * 1e-9).normalize()]);
    areas.extend([3.0, 1.0]);
    let solution = solved(&normals, &areas);
    assert_eq!(solution.facet_of, [0, 1, 2, 3, 4, 5, 0, 0]);
    assert!((solution.polytope.volume() - 6.0).abs() < 1e-8);
}

#[test]
fn scales_of_area_from_microns_to_kilometres_give_the_same_shape() {
    let (normals, areas) = cases::random(30, 0.1, 9).unwrap();
    let volume = solved(&normals, &areas).polytope.volume();
    for scale in [1e-12_f64, 1e6, 1e30] {
        let scaled: Vec<f64> = areas.iter().map(|a| a * scale).collect();
        let ratio = solved(&normals, &scaled).polytope.volume() / (volume * scale.powf(1.5));
        assert!((ratio - 1.0).abs() < 1e-12, "{scale}: {ratio}");
    }
}

#[test]
fn older_methods_agree_on_an_easy_body() {
    let (normals, areas) = cases::random(12, 0.3, 1).unwrap();
    let volume = solved(&normals, &areas).polytope.volume();
    let methods = [
        FirstOrder::Little,
        FirstOrder::Ikeuchi,
        FirstOrder::IkeuchiNicolet { lambda: 10.0 },
        FirstOrder::LogVolume,
    ];
    for method in methods {
        let end = baselines::run(&normals, &areas, method, 1000).unwrap();
        assert!(end.residual < 1e-6 && end.lost == 0, "{method:?}: {}", end.residual);
        assert!((end.volume / volume - 1.0).abs() < 1e-7, "{method:?}: {}", end.volume);
    }
}

#[test]
fn least_squares_of_areas_lose_the_facets_of_a_needle() {
    let (normals, areas) = cases::stretched(cases::random(60, 0.01, 6).unwrap(), DVec3::new(1.0, 1.0, 100.0));
    let end = baselines::run(&normals, &areas, FirstOrder::Ikeuchi, 300).unwrap();
    assert!(end.lost > 0 && end.residual > 0.01, "{} lost, {}", end.lost, end.residual);
    assert!(solved(&normals, &areas).residual < 1e-12);
}

#[test]
fn table_has_a_row_for_each_method_and_times_by_the_callers_clock() {
    let case = cases::all(8).unwrap().remove(0);
    let ticks = std::cell::Cell::new(0.0);
    let clock = || {
        ticks.set(ticks.get() + 1.0);
        ticks.get()
    };
    let rows = table::compare(&case, &table::Method::ALL, 50, Some(&clock));
    assert_eq!(rows.len(), 7);
    assert!(rows.iter().all(|row| row.seconds == Some(1.0) && row.outcome.is_ok()));
    assert!(table::compare(&case, &table::Method::ALL[..1], 50, None)[0].seconds.is_none());
}
