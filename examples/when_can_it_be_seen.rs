//! When can it be seen, and why not when not? Windows of three satellites in a night, and its chart.
//!
//! `cargo run --release --example when_can_it_be_seen`

use nightglass::plan::planner::Planner;
use nightglass::plan::table::why;
use nightglass::scene::{Options, load};
use nightglass::study::night_chart;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let scene = load(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/leo-pass.toml"), &Options::default())?;
    let planner = Planner::new(&scene)?;
    let night = planner.night()?;
    let mut all = Vec::new();
    for (number, target) in scene.target.iter().enumerate() {
        let windows = planner.windows(number, &night, None)?;
        for window in &windows {
            println!(
                "{:22} {} to {}  {:10} {}",
                target.name,
                &window.interval.start.iso_utc()[..19],
                &window.interval.end.iso_utc()[11..19],
                if window.observable { "observable" } else { "not" },
                why(window, &scene.plan)
            );
        }
        all.push(windows);
    }
    let chart = night_chart::svg(&scene, &planner, night.span, &all)?;
    let path = std::env::temp_dir().join("when_can_it_be_seen.svg");
    std::fs::write(&path, chart)?;
    println!("the chart is in {}", path.display());
    Ok(())
}
