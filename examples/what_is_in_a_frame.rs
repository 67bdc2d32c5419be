//! What is in a frame? One exposure of a geostationary satellite: its ledger, its truth, its pixels.
//!
//! `cargo run --release --example what_is_in_a_frame`

use nightglass::scene::{Options, load};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let sets = [("detector.size_px", "1024"), ("exposures.count", "1")].map(|(k, v)| (k.to_owned(), v.to_owned()));
    let scene = load("pogs-geo", &Options { sets: &sets, seed: None })?;
    let frame = nightglass::simulate(&scene)?.next().ok_or("the scene has no exposure")??;
    for row in &frame.ledger {
        println!("{:24} {:7} {:10.4} e-/px  {}", row.name, row.verdict, row.mean_e_px, row.why);
    }
    for target in &frame.truth {
        println!(
            "{}: {:.0} electrons at ({:.2}, {:.2}) px, V {:.2}, signal-to-noise ratio {:.0}",
            target.target, target.electrons, target.places[0].x, target.places[0].y, target.mag_v, target.snr
        );
    }
    let mean = frame.adu.iter().map(|adu| f64::from(*adu)).sum::<f64>() / frame.adu.len() as f64;
    println!("mean {mean:.2} ADU over {} pixels", frame.adu.len());
    Ok(())
}
