//! Where a spinning body's pole may point, and how well its law is known: seeds of a body of 14 facets in four nights, and of a box 1:2:3 with a
//! lobe, both at SNR 30.
//!
//! `cargo run --release --example where_does_the_pole_point [poles|law|limit] [seeds] [minima followed] [first seed]`; one seed of both, 8
//! minima, from seed 1 on if nothing is given. `limit` is what the light can tell: least squares from the true pole with the true facets, their number told.
use faer::Mat;
use faer::linalg::solvers::Solve;
use glam::DVec3;
use nightglass::inversion::egi::{Curve, Options, Problem, Scale};
use nightglass::inversion::pole::{Scan, Spinning, body_axes, scan};
use nightglass::inversion::sphere::{angle, tangents};
use nightglass::inversion::synthetic::{Stream, cuboid, directions, noisy, random_body};
use nightglass::object::convex::{Epochs, Facet};
use nightglass::object::matter::{Material, Model};
use nightglass::run::shape_law;
use std::time::Instant;

/// Of the body of 14 facets \[s\].
const PERIOD: f64 = 137.0;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let what = std::env::args().nth(1).unwrap_or("both".into());
    let seeds: u64 = std::env::args().nth(2).map_or(Ok(1), |v| v.parse())?;
    let refined: usize = std::env::args().nth(3).map_or(Ok(Scan::default().refined), |v| v.parse())?;
    let first: u64 = std::env::args().nth(4).map_or(Ok(1), |v| v.parse())?;
    if what == "limit" {
        let off: Vec<f64> = (first..).take(usize::try_from(seeds)?).map(limit).collect();
        let near = off.iter().filter(|off| **off < 2.0).count();
        println!("of {seeds} seeds: the fit from the truth ends within 2 deg in {near}");
        return Ok(());
    }
    let (mut poles, mut laws, mut covered) = (0, 0, [0, 0]);
    for seed in (first..).take(usize::try_from(seeds)?) {
        if what != "law" {
            poles += u64::from(pole(seed, refined)?);
        }
        if what != "poles" {
            let (near, within) = law(seed)?;
            laws += u64::from(near);
            covered.iter_mut().zip(within).for_each(|(sum, within)| *sum += u64::from(within));
        }
    }
    println!("of {seeds} seeds: pole listed within 2 deg in {poles}, law within 1 % and 0.003 in {laws}");
    println!(
        "intervals of one standard deviation: true share within {}, true exponent within {}",
        covered[0], covered[1]
    );
    Ok(())
}

/// Four nights of a body of 14 facets.
struct Nights {
    pole: DVec3,
    body: Vec<Facet>,
    times: Vec<f64>,
    inertial: Vec<(DVec3, DVec3)>,
    y: Vec<f64>,
    sigma: Vec<f64>,
}

fn nights(seed: u64) -> Nights {
    let mut stream = Stream::new(seed);
    let pole = stream.direction();
    let (mut times, mut inertial) = (Vec::new(), Vec::new());
    for night in 0..4 {
        let (s, o) = (stream.direction(), stream.direction());
        for k in 0..60 {
            times.push(f64::from(night) * 3000.0 + f64::from(k) * 7.3);
            inertial.push((s, o));
        }
    }
    let body = random_body(14, 0.5, seed);
    let clean = Epochs::new(body_axes(pole, PERIOD, &times, &inertial)).curve(&body, &Material::lambert(1.0), 0.0);
    let (y, sigma) = noisy(&clean, 30.0, &mut stream);
    Nights { pole, body, times, inertial, y, sigma }
}

/// How far from the true pole a fit ends that starts there, with all facets \[deg\]: Levenberg-Marquardt over areas, normals, pole and period, the
/// facets closed to a thousandth of their area.
fn limit(seed: u64) -> f64 {
    let Nights { pole, body, times, inertial, y, sigma } = nights(seed);
    let (count, rows) = (3 * body.len() + 3, y.len() + 3);
    let area: f64 = body.iter().map(|f| f.area).sum();
    let moved = |n: DVec3, x: f64, y: f64| {
        let [a, b] = tangents(n);
        (n + a * x + b * y).normalize()
    };
    let residual = |v: &[f64]| -> Vec<f64> {
        let facets: Vec<Facet> = body
            .iter()
            .zip(v.as_chunks::<3>().0)
            .map(|(f, v)| Facet { normal: moved(f.normal, v[1], v[2]), area: f.area * v[0].exp() })
            .collect();
        let axes = body_axes(moved(pole, v[count - 3], v[count - 2]), PERIOD + v[count - 1], &times, &inertial);
        let model = Epochs::new(axes).curve(&facets, &Material::lambert(1.0), 0.0);
        let open: DVec3 = facets.iter().map(|f| f.normal * f.area).sum();
        let light = y.iter().zip(model).zip(&sigma).map(|((y, m), s)| (y - m) / s);
        light.chain((open * (-1e3 / area)).to_array()).collect()
    };
    let square = |r: &[f64]| r.iter().map(|r| r * r).sum::<f64>();
    let (mut v, mut damping) = (vec![0.0; count], 1e-3);
    let mut now = residual(&v);
    let start = square(&now);
    for _ in 0..300 {
        let slope = |k: usize| {
            let at = |h: f64| {
                residual(&v.iter().enumerate().map(|(j, x)| if j == k { x + h } else { *x }).collect::<Vec<_>>())
            };
            at(-1e-6).into_iter().zip(at(1e-6)).map(|(a, b)| (a - b) / 2e-6).collect::<Vec<f64>>()
        };
        let slopes: Vec<Vec<f64>> = (0..count).map(slope).collect();
        let jacobian = Mat::from_fn(rows, count, |t, k| slopes[k][t]);
        let mut normal = jacobian.transpose() * &jacobian;
        (0..count).for_each(|k| normal[(k, k)] = normal[(k, k)] * (1.0 + damping) + 1e-9);
        let step = normal.full_piv_lu().solve(jacobian.transpose() * Mat::from_fn(rows, 1, |t, _| now[t]));
        let next: Vec<f64> = v.iter().enumerate().map(|(k, x)| x + step[(k, 0)]).collect();
        let then = residual(&next);
        let gain = square(&now) - square(&then);
        if gain > 0.0 {
            (v, now) = (next, then);
            damping = (0.3f64 * damping).max(1e-9);
        } else {
            damping *= 4.0;
        }
        if (0.0..1e-8).contains(&gain) || damping > 1e9 {
            break;
        }
    }
    let off = angle(moved(pole, v[count - 3], v[count - 2]), pole).to_degrees();
    println!("seed {seed}: from the true pole to {off:.2} deg, chi-square {start:.1} to {:.1}", square(&now));
    off
}

fn pole(seed: u64, refined: usize) -> Result<bool, Box<dyn std::error::Error>> {
    let Nights { pole, times, inertial, y, sigma, .. } = nights(seed);
    let curve = Curve { y, sigma, directions: inertial, scale: Scale::Fixed(1.0) };
    let spinning = Spinning { curves: vec![curve], times: vec![times] };
    let began = Instant::now();
    let how = Scan { periods: vec![PERIOD], refined, ..Scan::default() };
    let found = scan(&spinning, &Material::lambert(1.0), &how, &Options::default())?;
    let off = |p: DVec3| angle(p, pole).to_degrees();
    let nearest = found.minima.iter().map(|m| off(m.pole)).fold(f64::INFINITY, f64::min);
    println!(
        "seed {seed}: {} listed, the nearest {nearest:.2} deg from the true pole, the best {:.2} deg (+- {:.2}), chi-square {:.2} a degree of freedom, {:.1} s",
        found.minima.len(),
        found.minima.first().map_or(f64::NAN, |m| off(m.pole)),
        found.minima.first().map_or(f64::NAN, |m| m.sd[0].hypot(m.sd[1]).to_degrees()),
        found.minima.first().map_or(f64::NAN, |m| m.solution.reduced()),
        began.elapsed().as_secs_f64()
    );
    Ok(nearest < 2.0)
}

fn law(seed: u64) -> Result<(bool, [bool; 2]), Box<dyn std::error::Error>> {
    let mut stream = Stream::new(100 + seed);
    let directions = directions(800, &mut stream);
    let truth = Material { model: Model::Phong, diffuse: 0.5, specular: 0.5, exponent: 10.0, roughness: 1.0 };
    let clean = Epochs::new(directions.clone()).curve(&cuboid(DVec3::new(1.0, 2.0, 3.0)), &truth, 0.0);
    let (y, sigma) = noisy(&clean, 30.0, &mut stream);
    let problem = Problem::new(&[Curve { y, sigma, directions, scale: Scale::Fixed(1.0) }])?;
    let began = Instant::now();
    let start = Material { specular: 0.3, diffuse: 0.7, exponent: 6.0, ..truth };
    let found = shape_law::fit(&problem, &start)?;
    let (share, exponent) = (found.specular_fraction, found.exponent);
    println!(
        "seed {seed}: share {:.4} +- {:.4}, exponent {:.3} +- {:.3}, {} facets, {:.1} s",
        share.0,
        share.1,
        exponent.0,
        exponent.1,
        found.solution.facets.len(),
        began.elapsed().as_secs_f64()
    );
    let within = [(share.0 - 0.5).abs() < share.1, (exponent.0 - 10.0).abs() < exponent.1];
    Ok(((share.0 - 0.5).abs() < 0.003 && (exponent.0 / 10.0 - 1.0).abs() < 0.01, within))
}
