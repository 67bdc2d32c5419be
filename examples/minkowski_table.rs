//! How near do methods for Minkowski's problem come, and how fast? Prints a row for each case and method.
//!
//! `cargo run --release --example minkowski_table [most facets] [most facets for first-order methods] [their steps]`

use std::time::Instant;

use nightglass::inversion::minkowski::cases;
use nightglass::inversion::minkowski::table::{Method, compare};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let numbers: Vec<usize> = std::env::args().skip(1).filter_map(|word| word.parse().ok()).collect();
    let number = |k: usize, default| numbers.get(k).copied().unwrap_or(default);
    let (most, most_first_order, steps) = (number(0, 20_000), number(1, 300), number(2, 500));
    let start = Instant::now();
    let clock = || start.elapsed().as_secs_f64();
    println!(
        "{:30} {:>6} {:>8}  {:21} {:>5} {:>6} {:>9} {:>5} {:>9} {:>9}",
        "case", "facets", "ratio", "method", "steps", "bodies", "max err", "lost", "vol err", "ms"
    );
    for case in cases::all(most)? {
        let methods = if case.normals.len() <= most_first_order { &Method::ALL[..] } else { &Method::ALL[..3] };
        let rows = compare(&case, methods, steps, Some(&clock));
        let best =
            rows.first().and_then(|row| row.outcome.as_ref().ok()).map_or(f64::NAN, |figures| figures.volume);
        for row in rows {
            print!("{:30} {:6} {:8.1e}  {:21} ", row.case, row.facets, row.area_ratio, row.method.name());
            let ms = 1e3 * row.seconds.unwrap_or(f64::NAN);
            match row.outcome {
                Ok(f) => println!(
                    "{:5} {:6} {:9.1e} {:5} {:9.1e} {ms:9.2}",
                    f.iterations,
                    f.evaluations,
                    f.residual,
                    f.lost,
                    f.volume / best - 1.0
                ),
                Err(fault) => println!("{fault}"),
            }
        }
    }
    Ok(())
}
