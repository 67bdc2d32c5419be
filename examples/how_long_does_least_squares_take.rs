//! How long does the non-negative least-squares problem of a light curve take, and how optimal is its end? A cube and a body of 35
//! facets, 1000 points, 1000 and 10,000 normals, without noise and at three signal-to-noise ratios; the time is the best of three.
//!
//! `cargo run --release --example how_long_does_least_squares_take`

use glam::DVec3;
use nightglass::inversion::nnls::{Columns, solve};
use nightglass::inversion::sphere::fibonacci;
use nightglass::inversion::synthetic::{Stream, cuboid, directions, noisy, random_body};
use nightglass::object::convex::Epochs;
use nightglass::object::matter::Material;
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let material = Material::lambert(1.0);
    println!(
        "{:>10} {:>8} {:>6} {:>8} {:>8} {:>7} {:>9}",
        "body", "normals", "SNR", "best ms", "support", "passes", "KKT"
    );
    for (name, body) in [("cube", cuboid(DVec3::ONE)), ("35 facets", random_body(35, 0.5, 1))] {
        for normals in [1000, 10_000] {
            for snr in [f64::INFINITY, 100.0, 30.0, 10.0] {
                let mut stream = Stream::new(1);
                let epochs = Epochs::new(directions(1000, &mut stream));
                let clean = epochs.curve(&body, &material, 0.0);
                let (y, _) = if snr.is_finite() { noisy(&clean, snr, &mut stream) } else { (clean, Vec::new()) };
                let matrix = Columns::new(1000, fibonacci(normals).map(|n| epochs.column(n, &material, 0.0)));
                let mut best = f64::INFINITY;
                let mut last = solve(&matrix, &y, &[])?;
                for _ in 0..3 {
                    let start = Instant::now();
                    last = solve(&matrix, &y, &[])?;
                    best = best.min(1e3 * start.elapsed().as_secs_f64());
                }
                println!(
                    "{name:>10} {normals:8} {snr:6} {best:8.1} {:8} {:7} {:9.1e}",
                    last.support.len(),
                    last.passes,
                    last.kkt
                );
            }
        }
    }
    Ok(())
}
