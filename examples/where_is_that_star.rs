//! Where is that star? Barnard's star from its catalogue place to the sky above a station, step by step.
//!
//! `cargo run --release --example where_is_that_star`

use nightglass::astro::geodetic::Geodetic;
use nightglass::astro::observer::{Air, Observer, Site, azimuth_elevation};
use nightglass::astro::star::Star;
use nightglass::astro::time::Instant;
use nightglass::astro::{angles, separation};
use nightglass::base::units::ARCSEC;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mas = 1e-3 * ARCSEC;
    let barnard = Star {
        ra: 269.452_075f64.to_radians(),
        dec: 4.693_391f64.to_radians(),
        pm_ra_cos_dec: -798.58 * mas,
        pm_dec: 10_328.12 * mas,
        parallax: 548.31 * mas,
        radial_velocity_km_s: -110.51,
    };
    let t = Instant::parse("2018-07-01T06:00:00 UTC")?;
    let air = Air { pressure_hpa: 780.0, temperature_c: 10.0, humidity: 0.2 };
    let site = Site::new((-105.533333f64).to_radians(), 32.9f64.to_radians(), 2225.0, &air);
    let observer = Observer::at(&site, &t)?;
    let catalogue = nightglass::astro::direction(barnard.ra, barnard.dec);
    let astrometric = barnard.astrometric(&observer, &t);
    let (ra, dec) = angles(astrometric);
    println!("station            {:?}", Geodetic::of(site.itrf));
    println!("astrometric ICRS   {:.7} {:+.7} deg", ra.to_degrees(), dec.to_degrees());
    println!("moved since 2000   {:.3} arcsec", separation(catalogue, astrometric) / ARCSEC);
    for (what, place) in
        [("airless", barnard.airless(&observer, &t)), ("refracted", barnard.apparent(&observer, &t))]
    {
        let (azimuth, elevation) = azimuth_elevation(place);
        println!("{what:10} azimuth {:.7}, elevation {:.7} deg", azimuth.to_degrees(), elevation.to_degrees());
    }
    Ok(())
}
