//! Which shapes fit a light curve: an L, two T and satellites with two panels, without noise and with it.
//!
//! `cargo run --release --example which_shapes_fit [seeds] [body|all] [SNR|all]`; one seed of the L at SNR 100 if nothing is given.
use glam::{DMat3, DQuat, DVec3};
use nightglass::inversion::egi::{Curve, Problem, Scale};
use nightglass::inversion::nonconvex::{Options, Part, Renderer, Triangle, assemble, baseline, metrics, test};
use nightglass::inversion::sphere::angle;
use nightglass::inversion::synthetic::{Stream, fixed_phase, noisy};
use nightglass::object::matter::Material;
use std::time::Instant;

fn bodies() -> [(&'static str, Vec<Part>); 5] {
    let tilt = DMat3::from_quat(DQuat::from_xyzw(0.31, -0.52, 0.17, 0.78).normalize());
    let part = |c: [f64; 3], h: [f64; 3]| Part { centre: tilt * DVec3::from(c), axes: tilt, half: DVec3::from(h) };
    // panels turned by 35 deg about their long axis
    let turned = tilt * DMat3::from_rotation_y(35f64.to_radians());
    let canted = [0.0, 1.5, -1.5].map(|y| match y {
        0.0 => part([0.0; 3], [0.5, 0.5, 0.65]),
        _ => Part { axes: turned, ..part([0.0, y, 0.0], [0.03, 0.8, 0.5]) },
    });
    let canted = canted.to_vec();
    [
        ("L", vec![part([0.0, -0.5, 0.0], [1.0, 0.5, 0.5]), part([-0.5, 0.5, 0.0], [0.5, 0.5, 0.5])]),
        ("T", vec![part([0.0, 0.0, 0.0], [1.5, 0.5, 0.5]), part([0.0, 0.0, -1.5], [0.5, 0.5, 1.0])]),
        ("slender-T", vec![part([0.0, 0.0, 0.0], [0.4, 0.5, 1.2]), part([0.0, 0.0, 1.5], [1.4, 0.5, 0.3])]),
        (
            "box-wing",
            vec![
                part([0.0, 0.0, 0.0], [0.5, 0.5, 0.65]),
                part([0.0, 1.5, 0.0], [0.03, 0.8, 0.5]),
                part([0.0, -1.5, 0.0], [0.03, 0.8, 0.5]),
            ],
        ),
        ("canted-wing", canted),
    ]
}

fn triangles(parts: &[Part]) -> Vec<Vec<Triangle>> {
    parts.iter().map(|part| part.triangles().to_vec()).collect()
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let seeds: u64 = std::env::args().nth(1).map_or(Ok(1), |v| v.parse())?;
    let only = std::env::args().nth(2).unwrap_or("L".into());
    let at: Option<f64> = std::env::args()
        .nth(3)
        .map_or(Ok(Some(100.0)), |v| if v == "all" { Ok(None) } else { v.parse().map(Some) })?;
    let material = Material::lambert(0.5);
    for (name, parts) in bodies().into_iter().filter(|(name, _)| only == "all" || only == *name) {
        let truth = triangles(&parts);
        // without noise one seed is enough
        let runs = [(1e6, 1), (100.0, seeds), (30.0, seeds)];
        let runs = runs.into_iter().filter(|(snr, _)| at.is_none_or(|at| at == *snr));
        for (snr, seed) in runs.flat_map(|(snr, seeds)| (1..=seeds).map(move |seed| (snr, seed))) {
            let mut stream = Stream::new(seed);
            let mut directions = fixed_phase(80, 50f64.to_radians(), &mut stream);
            directions.extend(fixed_phase(80, 90f64.to_radians(), &mut stream));
            let mut renderer = Renderer::default();
            let curve: Vec<f64> = directions.iter().map(|p| renderer.light(&parts, &material, *p, None)).collect();
            let (y, sigma) = noisy(&curve, snr, &mut stream);
            let scale = Scale::Fixed(1.0);
            let problem = Problem::new(&[Curve {
                y: y.clone(),
                sigma: sigma.clone(),
                directions: directions.clone(),
                scale,
            }])?;
            let verdict = test(&problem, &material, 0.02)?;
            let overlap = |other: &[Vec<Triangle>]| {
                let other = metrics::aligned(&truth, other, 1 << 17);
                (
                    metrics::intersection_over_union(&truth, &other, 1 << 20),
                    metrics::distance(&truth, &other, 4000),
                )
            };
            let old = baseline(&problem, &material)?;
            let ideal: f64 = curve.iter().zip(&y).zip(&sigma).map(|((c, y), s)| ((c - y) / s).powi(2)).sum();
            println!(
                "{name} SNR {snr:.0} seed {seed} (chi2 of the truth {ideal:.1}): {:?}, floor {:.2} % (found from {:.2} %), defect {:.1} sigma",
                verdict.call,
                100.0 * verdict.floor,
                100.0 * verdict.floor_found,
                verdict.defect_sigmas
            );
            println!(
                "  baseline: psi {:.0} deg, chi2 {:.1} (convex {:.1}), IoU {:.3}",
                old.best.angle.to_degrees(),
                old.best.chi2,
                old.scan[0].chi2,
                overlap(&[old.triangles]).0
            );
            let start = Instant::now();
            let found = assemble(&directions, &y, &sigma, &material, &Options { seed, ..Options::default() })?;
            let time = start.elapsed().as_secs_f64();
            for trial in &found.trials {
                let (iou, _) = overlap(&triangles(&trial.parts));
                println!(
                    "  K {}: chi2 {:.1}, BIC {:.1}, held out {:.2}, IoU {iou:.4}",
                    trial.parts.len(),
                    trial.chi2,
                    trial.bic,
                    trial.held_out
                );
            }
            let (iou, far) = overlap(&found.triangles());
            println!(
                "  chosen: {} parts, {} ties, chi2/dof {:.1}/{:.0}, IoU {iou:.4}, Hausdorff {:.4}, Chamfer {:.4}; {time:.1} s",
                found.parts.len(),
                found.ties.len(),
                found.chi2,
                found.dof,
                far.hausdorff,
                far.chamfer
            );
            for estimate in &found.parts {
                let (half, sd) = (estimate.part.half, estimate.half_sd);
                println!(
                    "  half sizes {:.3} +- {:.3}, {:.3} +- {:.3}, {:.3} +- {:.3} m",
                    half.x, sd.x, half.y, sd.y, half.z, sd.z
                );
            }
            let panels: Vec<_> = found.parts.iter().filter_map(|e| e.panel).collect();
            let normal = parts.last().map_or(DVec3::X, |p| p.side().0);
            for panel in &panels {
                let off = angle(panel.normal, normal);
                println!(
                    "  panel: {:.4} +- {:.4} m2, exposed {:.4}; normal off {:.2} +- {:.2} deg",
                    panel.area,
                    panel.area_sd,
                    panel.exposed,
                    off.min(std::f64::consts::PI - off).to_degrees(),
                    panel.normal_sd.to_degrees()
                );
            }
            println!("  panels together {:.4}", panels.iter().fold(0.0, |sum, p| sum + p.exposed));
            let s = found.spread;
            println!(
                "  {} alternatives: volume {:.3}..{:.3}, panels {:.3}..{:.3}, Chamfer mean {:.4} most {:.4}",
                found.alternatives.len(),
                s.volume.0,
                s.volume.1,
                s.panels.0,
                s.panels.1,
                s.chamfer_mean,
                s.chamfer_most
            );
            for rival in found.alternatives.iter().skip(1).take(5) {
                let panels: Vec<String> = rival.panels.iter().map(|p| format!("{:.3}", p.1)).collect();
                println!(
                    "    {} parts, chi2 {:.1}, volume {:.3}, panels [{}], Chamfer {:.4}",
                    rival.parts.len(),
                    rival.chi2,
                    rival.volume,
                    panels.join(" "),
                    rival.chamfer
                );
            }
        }
    }
    Ok(())
}
