//! How exact and how fast is Minkowski's problem solved? Prints what the solver's acceptance asks for.
//!
//! `cargo run --release --example minkowski_figures`

use std::time::Instant;

use glam::DVec3;
use nightglass::inversion::minkowski::{Options, cases, image, solve};
use nightglass::inversion::polytope::Polytope;
use nightglass::inversion::polytope::compare::{chamfer, hausdorff, intersection_over_union};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let options = Options::default();
    println!("{:>24} {:>8} {:>9} {:>6} {:>9}  inertia", "image", "facets", "best ms", "steps", "max err");
    for (name, count, spread) in [
        ("ellipsoid 1:3:10", 1000, None),
        ("random", 1000, Some(1e-3)),
        ("ellipsoid 1:3:10", 5000, None),
        ("random", 5000, Some(3e-4)),
        ("ellipsoid 1:3:10", 20_000, None),
        ("random", 20_000, Some(1e-4)),
    ] {
        let (normals, areas) = match spread {
            Some(spread) => cases::random(count, spread, 1)?,
            None => cases::ellipsoid(count, DVec3::new(1.0, 3.0, 10.0))?,
        };
        let mut best = f64::INFINITY;
        let mut last = solve(&normals, &areas, &options)?;
        for _ in 0..5 {
            let start = Instant::now();
            last = solve(&normals, &areas, &options)?;
            best = best.min(1e3 * start.elapsed().as_secs_f64());
        }
        println!(
            "{name:>24} {:8} {best:9.2} {:6} {:9.1e}  {:?}",
            normals.len(),
            last.iterations,
            last.residual,
            last.inertia
        );
    }
    for count in [100, 1000, 5000] {
        let (normals, areas) = cases::random(count, 0.3 / count as f64, 2)?;
        let body = solve(&normals, &areas, &options)?.polytope;
        let mesh = body.mesh();
        // the shortest decimal that reads back as the same number is what a file keeps
        let (again, sizes) = image::of_mesh(&mesh.vertices, &mesh.polygons);
        let second = solve(&again, &sizes, &options)?.polytope;
        println!(
            "round trip, {count} planes: Hausdorff/diagonal {:.1e}, Chamfer/diagonal {:.1e}, 1 - IoU {:.1e}",
            hausdorff(&body, &second) / body.diagonal(),
            chamfer(&body, &second, 1000) / body.diagonal(),
            1.0 - intersection_over_union(&body, &second)?
        );
        let twice = body.hessian_times(body.offsets());
        let error = twice.iter().zip(body.areas()).map(|(t, a)| (t - 2.0 * a).abs()).fold(0.0, f64::max);
        let largest = body.areas().iter().copied().fold(0.0, f64::max);
        println!("H h - 2A, {count} planes: {:.1e} of the largest area", error / largest);
    }
    let (normals, areas) = cases::random(60, 0.05, 3)?;
    let body = solve(&normals, &areas, &options)?.polytope;
    let (mut worst, mut size) = (0.0_f64, 0.0_f64);
    let step = 1e-6;
    for j in 0..body.half_spaces() {
        let moved = |by: f64| {
            let offsets: Vec<f64> =
                body.offsets().iter().enumerate().map(|(i, h)| if i == j { h + by } else { *h }).collect();
            Polytope::new(&normals, &offsets)
        };
        let (above, below) = (moved(step)?, moved(-step)?);
        let unit: Vec<f64> = (0..body.half_spaces()).map(|i| f64::from(u8::from(i == j))).collect();
        for ((h, a), b) in body.hessian_times(&unit).iter().zip(above.areas()).zip(below.areas()) {
            worst = worst.max((h - (a - b) / (2.0 * step)).abs());
            size = size.max(h.abs());
        }
    }
    println!("Hessian against central differences, 60 planes: {:.1e} of its largest entry", worst / size);
    Ok(())
}
