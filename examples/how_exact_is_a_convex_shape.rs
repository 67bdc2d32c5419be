//! How exact is a convex shape? From curves of seven bodies to shapes, against the truth and the fixed-angle baseline.
//!
//! `cargo run --release --example how_exact_is_a_convex_shape [exact|noise|SNR] [seeds] [random|60]`; SNR 100, one seed if nothing is given.
use glam::DVec3;
use nightglass::inversion::baseline_resample::{Resample, resample_and_merge};
use nightglass::inversion::egi::{matching::pairs, *};
use nightglass::inversion::minkowski;
use nightglass::inversion::polytope::Polytope;
use nightglass::inversion::polytope::compare::{aligned, intersection_over_union};
use nightglass::inversion::synthetic::*;
use nightglass::object::convex::*;
use nightglass::object::matter::*;
use std::time::Instant;

pub fn shapes() -> Vec<(&'static str, Vec<Facet>)> {
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

pub fn polytope(facets: &[Facet]) -> Option<Polytope> {
    let (n, a): (Vec<DVec3>, Vec<f64>) = facets.iter().map(|f| (f.normal, f.area)).unzip();
    let closure = minkowski::closure::Closure {
        limit: 1.0,
        policy: minkowski::closure::Policy::Adjust,
        ..Default::default()
    };
    minkowski::solve(&n, &a, &minkowski::Options { closure, ..Default::default() }).ok().map(|s| s.polytope)
}

pub fn iou(truth: &Polytope, found: Option<Polytope>) -> f64 {
    found.and_then(|b| intersection_over_union(truth, &aligned(truth, b)).ok()).unwrap_or(0.0)
}

pub fn curve(truth: &[Facet], kind: &str, snr: f64, seed: u64) -> Problem {
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

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let seeds: u64 = args.get(1).and_then(|s| s.parse().ok()).unwrap_or(1);
    let kind = args.get(2).map_or("random", String::as_str);
    let price = args.get(3).and_then(|s| s.parse().ok());
    let snrs: Vec<f64> = match args.first().map_or("100", String::as_str) {
        "exact" => vec![1e9],
        "noise" => vec![100.0, 30.0, 10.0],
        one => vec![one.parse().unwrap_or(100.0)],
    };
    let material = Material::lambert(1.0);
    for snr in snrs {
        let (mut all, mut base_all) = (0.0, 0.0);
        for (name, truth) in shapes() {
            let body = polytope(&truth).unwrap();
            let (mut sum, mut least, mut base, mut slow) = (0.0, 1.0f64, 0.0, 0.0f64);
            let (mut counts, mut worst) = (Vec::new(), (0.0f64, 0.0f64, 0));
            let seeds = if snr > 1e6 { 1 } else { seeds };
            let mut ious = Vec::new();
            for seed in 0..seeds {
                let problem = curve(&truth, kind, snr, seed);
                let t = Instant::now();
                let s = solve(&problem, &material, &Options { price, ..Default::default() }).unwrap();
                let found = s.body();
                slow = slow.max(t.elapsed().as_secs_f64());
                if let Err(e) = &found {
                    println!("{name} seed {seed}: {e}");
                }
                let v = iou(&body, found.ok().map(|s| s.polytope));
                ious.push(format!(
                    "{v:.4} ({:.2})",
                    s.facets.iter().map(|e| e.split).sum::<f64>() / s.facets.len() as f64
                ));
                sum += v;
                least = least.min(v);
                counts.push(s.facets.len());
                let p = pairs(&truth, &s.image(), 0.02);
                worst.2 = p.len();
                for p in p {
                    worst.0 = worst.0.max(p.angle.to_degrees());
                    worst.1 = worst.1.max(p.area.abs());
                }
                base +=
                    iou(&body, polytope(&resample_and_merge(&problem, &material, &Resample::default()).unwrap()));
            }
            let n = seeds as f64;
            all += sum / n / 7.0;
            base_all += base / n / 7.0;
            print!(
                "{kind} SNR {snr:7.0e} {name:12} K {:2} found {counts:?} IoU {:.5} least {least:.5} baseline {:.4} slowest {slow:.2} s",
                truth.len(),
                sum / n,
                base / n
            );
            if snr > 1e6 {
                print!(
                    " matched {} angle {:.1e} deg area {:.1e} 1-IoU {:.1e}",
                    worst.2,
                    worst.0,
                    worst.1,
                    1.0 - sum
                );
            } else {
                print!(" [{}]", ious.join(" "));
            }
            println!();
        }
        println!("{kind} SNR {snr:7.0e} MEAN IoU {all:.5} baseline {base_all:.4}");
    }
}
