//! What does a digit cost? Each approximation of a scene at several settings: error against run time, which settings no other beats, and the
//! cheapest that errs by less than a hundredth of the noise.
//!
//! `cargo run --release --example error_vs_time [CHART.svg]`; of a scene of one's own: `nightglass accuracy SCENE --wanted 0.01`

use nightglass::scene::{Options, load};
use nightglass::simulate::Simulator;
use nightglass::study::suggest::{Wanted, suggest};
use nightglass::study::{accuracy, accuracy_chart};
use std::error::Error;
use std::path::Path;
use std::time::Instant;

fn main() -> Result<(), Box<dyn Error>> {
    run(std::env::args().nth(1).as_deref().map(Path::new))
}

/// The table on stdout, the chart into a file if one is named.
pub fn run(chart: Option<&Path>) -> Result<(), Box<dyn Error>> {
    let sets = [("detector.size_px", "400"), ("exposures.count", "2")].map(|(k, v)| (k.to_owned(), v.to_owned()));
    let scene = load("pogs-geo", &Options { sets: &sets, seed: None })?;
    let simulator = Simulator::new(&scene)?;
    let view = simulator.planner.view(0)?;
    let began = Instant::now();
    let mut rows = accuracy::rows(&simulator, &view, &|| began.elapsed().as_secs_f64())?;
    let suggestion = suggest(&mut rows, &Wanted::parse(["0.01"])?, &scene.accuracy);
    println!("{:16} {:44} {:>9} {:>9}  unit", "approximation", "setting", "error", "time, ms");
    for row in &rows {
        let marks = [(row.pareto, "unbeaten"), (row.default, "used"), (row.suggested, "suggested")];
        let marks = marks.iter().filter(|(yes, _)| *yes).map(|(_, word)| *word).collect::<Vec<_>>().join(", ");
        let (name, setting) = (&row.approximation, &row.setting);
        println!("{name:16} {setting:44} {:>9.1e} {:>9.3}  {}; {marks}", row.max_err, row.time_s * 1e3, row.unit);
    }
    for (key, value) in suggestion.values {
        println!("accuracy.{key} = {value:e}");
    }
    if let Some((path, text)) = chart.zip(accuracy_chart::svg(&rows, "error against run time")) {
        std::fs::write(path, text)?;
    }
    Ok(())
}
