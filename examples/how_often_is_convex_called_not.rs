//! How often convex bodies are called not convex, and how often an L is found out.
use glam::{DMat3, DQuat, DVec3};
use nightglass::inversion::egi::{Curve, Problem, Scale};
use nightglass::inversion::nonconvex::{Call, Part, Renderer, test};
use nightglass::inversion::synthetic::*;
use nightglass::object::convex::{Epochs, Facet};
use nightglass::object::matter::Material;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let seeds: u64 = std::env::args().nth(1).map_or(Ok(2), |v| v.parse())?;
    let bodies: [(&str, Vec<Facet>); 5] = [
        ("cube", cuboid(DVec3::ONE)),
        ("box 1:2:3", cuboid(DVec3::new(1.0, 2.0, 3.0))),
        ("icosahedron", icosahedron(1.0)),
        ("cylinder", cylinder(0.3, 1.0)),
        ("random 14", random_body(14, 0.4, 5)),
    ];
    let material = Material::lambert(0.5);
    let geometry = |stream: &mut Stream| {
        let mut d = fixed_phase(80, 50f64.to_radians(), stream);
        d.extend(fixed_phase(80, 90f64.to_radians(), stream));
        d
    };
    for (name, body) in &bodies {
        for snr in [30.0, 100.0] {
            let (mut all, mut by_floor, mut by_defect) = (0, 0, 0);
            for seed in 0..seeds {
                let mut stream = Stream::new(1000 + seed);
                let directions = geometry(&mut stream);
                let curve = Epochs::new(directions.clone()).curve(body, &material, 0.0);
                let (y, sigma) = noisy(&curve, snr, &mut stream);
                let problem = Problem::new(&[Curve { y, sigma, directions, scale: Scale::Fixed(1.0) }])?;
                let verdict = test(&problem, &material, 0.02)?;
                all += u32::from(verdict.call == Call::NonConvex);
                by_floor += u32::from(verdict.chi2.0 > verdict.chi2_limit);
                by_defect += u32::from(verdict.defect_sigmas > verdict.defect_limit);
            }
            println!(
                "{name}, SNR {snr}: {all} of {seeds} called not convex ({by_floor} by floor, {by_defect} by defect)"
            );
        }
    }
    let axes = DMat3::from_quat(DQuat::from_xyzw(0.31, -0.52, 0.17, 0.78).normalize());
    let part = |c: [f64; 3], h: [f64; 3]| Part { centre: axes * DVec3::from(c), axes, half: DVec3::from(h) };
    let l = [part([0.0, -0.5, 0.0], [1.0, 0.5, 0.5]), part([-0.5, 0.5, 0.0], [0.5, 0.5, 0.5])];
    for snr in [100.0, 50.0, 30.0, 20.0, 10.0, 5.0] {
        let (mut found, mut floor, mut least) = (0, 0.0, 0.0);
        let count = seeds.min(20);
        for seed in 0..count {
            let mut stream = Stream::new(2000 + seed);
            let directions = geometry(&mut stream);
            let mut renderer = Renderer::default();
            let curve: Vec<f64> = directions.iter().map(|p| renderer.light(&l, &material, *p, None)).collect();
            let (y, sigma) = noisy(&curve, snr, &mut stream);
            let problem = Problem::new(&[Curve { y, sigma, directions, scale: Scale::Fixed(1.0) }])?;
            let verdict = test(&problem, &material, 0.02)?;
            found += u32::from(verdict.call == Call::NonConvex);
            floor += 100.0 * verdict.floor / count as f64;
            least += 100.0 * verdict.floor_found / count as f64;
        }
        println!("L, SNR {snr}: found in {found} of {count}; floor {floor:.2} %, found from {least:.2} %");
    }
    Ok(())
}
