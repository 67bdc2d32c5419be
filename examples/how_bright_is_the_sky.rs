//! How bright is the zenith over a station through a night, and what is it that shines?

use nightglass::astro::time::Instant;
use nightglass::scene::{Options, load};
use nightglass::simulate::Simulator;
use nightglass::study::sky::{NAMES, zenith_curve};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let scene = load("pogs-geo", &Options::default())?;
    let simulator = Simulator::new(&scene)?;
    let (from, to) = (Instant::from_utc("2018-01-28T01:00:00")?, Instant::from_utc("2018-01-28T13:00:00")?);
    println!("zenith over the {}, e-/px/s", scene.station.name);
    println!("{:>6} {}", "h", NAMES.map(|name| format!("{name:>10}")).join(" "));
    for (hours, means) in zenith_curve(&simulator, &from, &to, 12)? {
        println!("{hours:6.1} {}", means.map(|mean| format!("{mean:10.4}")).join(" "));
    }
    Ok(())
}
