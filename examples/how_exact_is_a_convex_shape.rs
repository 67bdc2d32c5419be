//! How exact is a convex shape? From curves of seven bodies to shapes, against the truth and the fixed-angle baseline.
//!
//! `cargo run --release --example how_exact_is_a_convex_shape [exact|many|noise|SNR] [seeds] [first seed] [random|60] [body]`; SNR 100,
//! one seed, all bodies if nothing is given. `exact` is without noise, `many` without noise and of 35 to 100 facets, `noise` at 100, 30, 10.
//! Widths of pulls, (found - true)/error of claimed facets: 68.3 % of them are smaller; against what a facet stands for, the sum of
//! the true ones nearer to it than to others, and against the one nearest.
use glam::DVec3;
use nightglass::inversion::baseline_resample::{Resample, resample_and_merge};
use nightglass::inversion::egi::{matching::pairs, *};
use nightglass::inversion::minkowski;
use nightglass::inversion::polytope::Polytope;
use nightglass::inversion::polytope::compare::{aligned, intersection_over_union};
use nightglass::inversion::sphere::{angle, tangents};
use nightglass::inversion::synthetic::*;
use nightglass::object::convex::*;
use nightglass::object::matter::*;
use std::time::Instant;

fn shapes() -> Vec<(&'static str, Vec<Facet>)> {
    vec![
        ("cube", cuboid(DVec3::ONE)),
        ("box 1:2:3", cuboid(DVec3::new(1.0, 2.0, 3.0))),
        ("plate", cuboid(DVec3::new(1.0, 10.0, 4.0))),
        ("icosahedron", icosahedron(1.0)),
        ("cylinder 24", cylinder(1.0, 4.0)),
        ("random 14", random_body(14, 0.35, 1)),
        ("random 35", random_body(35, 0.25, 2)),
    ]
}

/// Bodies of many facets, some of them nearer than 0.1 rad.
fn many() -> Vec<(&'static str, Vec<Facet>)> {
    let mut out = Vec::new();
    for seed in 1..4 {
        out.push(("random 35", random_body(35, 0.2, seed)));
        out.push(("random 50", random_body(50, 0.1, seed)));
        out.push(("random 100", random_body(100, 0.07, seed)));
    }
    out
}

fn polytope(facets: &[Facet]) -> Option<Polytope> {
    let (n, a): (Vec<DVec3>, Vec<f64>) = facets.iter().map(|f| (f.normal, f.area)).unzip();
    let closure = minkowski::closure::Closure {
        limit: 1.0,
        policy: minkowski::closure::Policy::Adjust,
        ..Default::default()
    };
    minkowski::solve(&n, &a, &minkowski::Options { closure, ..Default::default() }).ok().map(|s| s.polytope)
}

fn iou(truth: &Polytope, found: Option<Polytope>) -> f64 {
    found.and_then(|b| intersection_over_union(truth, &aligned(truth, b)).ok()).unwrap_or(0.0)
}

fn curve(truth: &[Facet], kind: &str, snr: f64, seed: u64) -> Problem {
    let mut stream = Stream::new(if snr > 1e6 { 11 } else { 100 + seed });
    let directions = match kind {
        "60" => fixed_phase(800, 60f64.to_radians(), &mut stream),
        _ => directions(800, &mut stream),
    };
    let y = Epochs::new(directions.clone()).curve(truth, &Material::lambert(1.0), 0.0);
    let (y, sigma) = match snr > 1e6 {
        true => (y.clone(), vec![y.iter().sum::<f64>() / 800.0 / snr; 800]),
        false => noisy(&y, snr, &mut stream),
    };
    Problem::new(&[Curve { y, sigma, directions, scale: Scale::Fixed(1.0) }]).unwrap()
}

/// Pulls of claimed facets: log area and both moves on the sphere, against their cell's sum and against the nearest true facet.
fn pulls(truth: &[Facet], s: &Solution) -> [Vec<f64>; 2] {
    let far = |a: DVec3, b: DVec3| angle(a, b);
    let mut sums = vec![DVec3::ZERO; s.facets.len()];
    for t in truth {
        let nearest = (0..sums.len()).min_by(|&a, &b| {
            far(s.facets[a].facet.normal, t.normal).total_cmp(&far(s.facets[b].facet.normal, t.normal))
        });
        if let Some(k) = nearest {
            sums[k] += t.normal * t.area;
        }
    }
    let mut out = [Vec::new(), Vec::new()];
    for (i, e) in s.facets.iter().enumerate().filter(|(_, e)| e.claimed) {
        let one =
            truth.iter().min_by(|a, b| far(a.normal, e.facet.normal).total_cmp(&far(b.normal, e.facet.normal)));
        let one = one.map_or(DVec3::ZERO, |f| f.normal * f.area);
        let [a, b] = tangents(e.facet.normal);
        for (out, stands) in out.iter_mut().zip([sums[i], one]) {
            let (size, unit) = (stands.length().max(1e-3 * e.facet.area), stands.normalize_or_zero());
            for (k, error) in [(e.facet.area / size).ln(), unit.dot(a), unit.dot(b)].into_iter().enumerate() {
                out.push(error.abs() / s.covariance[3 * i + k][3 * i + k].sqrt());
            }
        }
    }
    out
}

fn width(pulls: &mut [f64]) -> f64 {
    pulls.sort_by(f64::total_cmp);
    pulls.get((0.683 * pulls.len() as f64) as usize).copied().unwrap_or(0.0)
}

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let number = |k: usize, default: u64| args.get(k).and_then(|s| s.parse().ok()).unwrap_or(default);
    let (seeds, first) = (number(1, 1), number(2, 0));
    let kind = args.get(3).map_or("random", String::as_str);
    let what = args.first().map_or("100", String::as_str);
    let snrs: Vec<f64> = match what {
        "exact" | "many" => vec![1e9],
        "noise" => vec![100.0, 30.0, 10.0],
        one => vec![one.parse().unwrap_or(100.0)],
    };
    let mut bodies = if what == "many" { many() } else { shapes() };
    bodies.retain(|(name, _)| args.get(4).is_none_or(|only| name.contains(only.as_str())));
    let material = Material::lambert(1.0);
    for snr in snrs {
        let (mut all, mut base_all, mut slowest) = (0.0, 0.0, 0.0f64);
        for (name, truth) in &bodies {
            let body = polytope(truth).unwrap();
            let (mut ious, mut bases, mut slow) = (Vec::new(), Vec::new(), 0.0f64);
            let (mut counts, mut worst, mut claims) = (Vec::new(), (0.0f64, 0.0f64, 0), 0);
            let mut pulled = [Vec::new(), Vec::new()];
            let seeds = if snr > 1e6 { 1 } else { seeds };
            for seed in first..first + seeds {
                let problem = curve(truth, kind, snr, seed);
                let t = Instant::now();
                let s = solve(&problem, &material, &Options::default()).unwrap();
                let found = s.body();
                slow = slow.max(t.elapsed().as_secs_f64());
                if let Err(e) = &found {
                    println!("{name} seed {seed}: {e}");
                }
                ious.push(iou(&body, found.ok().map(|s| s.polytope)));
                counts.push(s.facets.len());
                claims += s.facets.iter().filter(|e| e.claimed).count();
                pulled.iter_mut().zip(pulls(truth, &s)).for_each(|(all, more)| all.extend(more));
                let p = pairs(truth, &s.image(), 0.02);
                worst.2 = p.len();
                for p in p {
                    worst.0 = worst.0.max(p.angle.to_degrees());
                    worst.1 = worst.1.max(p.area.abs());
                }
                let base = resample_and_merge(&problem, &material, &Resample::default()).unwrap();
                bases.push(iou(&body, polytope(&base)));
            }
            let n = seeds as f64;
            let mean = |v: &[f64]| v.iter().sum::<f64>() / n;
            let (ours, base) = (mean(&ious), mean(&bases));
            all += ours / bodies.len() as f64;
            base_all += base / bodies.len() as f64;
            slowest = slowest.max(slow);
            print!(
                "{kind} SNR {snr:.0e} {name:12} K {:2} IoU {ours:.5} baseline {base:.4} slowest {slow:.2} s ",
                truth.len()
            );
            if snr > 1e6 {
                let (angle, area, matched) = worst;
                println!(
                    "found {counts:?} matched {matched} angle {angle:.1e} deg area {area:.1e} 1-IoU {:.1e}",
                    1.0 - ours
                );
                continue;
            }
            let differences: Vec<f64> = ious.iter().zip(&bases).map(|(a, b)| a - b).collect();
            let spread =
                differences.iter().map(|d| (d - mean(&differences)).powi(2)).sum::<f64>() / (n - 1.0).max(1.0) / n;
            let [cells, ones] = pulled.each_mut().map(|p| width(p));
            println!(
                "less baseline {:.4} +- {:.4} least {:.4} claimed {claims} of {} widths {cells:.2} {ones:.2} found {counts:?}",
                mean(&differences),
                spread.sqrt(),
                ious.iter().copied().fold(1.0, f64::min),
                counts.iter().sum::<usize>()
            );
        }
        println!("{kind} SNR {snr:.0e} MEAN IoU {all:.5} baseline {base_all:.4} slowest {slowest:.2} s");
    }
}
