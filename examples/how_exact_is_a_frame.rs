//! How exact is a frame? Error against run time of every approximation in it, against its slow reference.
//!
//! `cargo run --release --example how_exact_is_a_frame`

use nightglass::scene::{Options, load};
use nightglass::simulate::Simulator;
use nightglass::study::accuracy;
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let scene = load("pogs-geo", &Options::default())?;
    let simulator = Simulator::new(&scene)?;
    let view = simulator.planner.view(0)?;
    let began = Instant::now();
    let rows = accuracy::rows(&simulator, &view, &|| began.elapsed().as_secs_f64())?;
    println!("| approximation | setting | largest error | rms error | unit | time, ms | bytes | default |");
    println!("|---|---|---|---|---|---|---|---|");
    for row in rows {
        let mark = if row.default { "yes" } else { "" };
        println!(
            "| {} | {} | {:.1e} | {:.1e} | {} | {:.3} | {} | {mark} |",
            row.approximation,
            row.setting,
            row.max_err,
            row.rms_err,
            row.unit,
            row.time_s * 1e3,
            row.bytes
        );
    }
    Ok(())
}
