//! How faint can it go? Limiting magnitudes of a station against the exposure, for a satellite that is followed and for one that
//! trails, and the shortest exposure that shows V 15.
//!
//! `cargo run --release --example how_faint_can_it_go [scene]`; `pogs-geo` if none is given.

use nightglass::scene::{Options, load};
use nightglass::study::snr::{Study, sweep::parse_all};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let name = std::env::args().nth(1).unwrap_or_else(|| "pogs-geo".into());
    let again = |sets: &[(String, String)]| load(&name, &Options { sets, seed: None });
    let sweeps = ["exposures.duration_s=0.1..30:log:6", "target_rate_arcsec_s=0,15"];
    let sweeps = parse_all(&sweeps.map(str::to_owned))?;
    let mut study = Study { load: &again, sweeps, wanted: 5.0, trials: 0, frame: 0, dead_s: None };
    println!("V at SNR 5 in one exposure\n{:>10} {:>10} {:>14}", "exposure", "followed", "15 arcsec/s");
    let mut rows = Vec::new();
    for group in study.groups() {
        rows.extend(study.rows(&group)?);
    }
    for pair in rows.chunks(2) {
        if let [(_, followed), (_, trailing)] = pair {
            let limit = |row: &nightglass::study::snr::table::Row| row.get("limiting_mag_v");
            println!("{:>8.2} s {:>10.2} {:>14.2}", followed.values[0], limit(followed), limit(trailing));
        }
    }
    study.sweeps = parse_all(&["mag_v=15".to_owned()])?;
    for group in study.groups() {
        for (_, row) in study.rows(&group)? {
            println!("\nV 15 has SNR 5 in {:.2} s", row.get("exposure_wanted_s"));
        }
    }
    Ok(())
}
