//! How fast does it spin? Two nights of a satellite with four unequal glimmers a turn, 0.05 mag of noise: the period, its error,
//! and the periods that the gap between the nights does not rule out.
//!
//! `cargo run --release --example how_fast_does_it_spin`

use nightglass::photometry::period::{Options, Series, search};
use rand::{RngExt, SeedableRng};
use rand_distr::Normal;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    const PERIOD_S: f64 = 97.313;
    let mut random = rand::rngs::StdRng::seed_from_u64(5);
    let noise = Normal::new(0.0, 0.05)?;
    let nights = [0.0, 86_100.0];
    let time_s =
        nights.iter().flat_map(|start| (0..600).map(move |k| start + 5.1 * f64::from(k))).collect::<Vec<_>>();
    let value = time_s.iter().map(|t| {
        let turn = std::f64::consts::TAU * t / PERIOD_S;
        let clean = 11.0 - 0.5 * (2.0 * turn).cos() - 0.2 * (turn + 0.4).cos() - 0.15 * (4.0 * turn).cos();
        clean + random.sample(noise)
    });
    let value = value.collect::<Vec<f64>>();
    let sigma = vec![0.05; value.len()];
    let report = search(&Series { time_s: &time_s, value: &value, sigma: &sigma }, &Options::default())?;
    let best = report.candidates.first().ok_or("no candidate")?;
    println!(
        "true {PERIOD_S} s, found {:.4} +- {:.4} s: {} maxima a turn, {:.2} mag, false-alarm probability {:.0e}",
        best.period_s, best.period_err_s, best.maxima, best.amplitude, best.false_alarm
    );
    for alias in report.aliases.iter().filter(|a| a.indistinguishable) {
        println!("as good: {:.4} s (chi-square {:+.1}), {:?}", alias.period_s, alias.delta_chi2, alias.relation);
    }
    report.notes.iter().for_each(|note| println!("note: {note}"));
    Ok(())
}
