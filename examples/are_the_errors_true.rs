//! Are the errors true? Exposures of varied scenes, measured, and the pulls (measured - truth) / error: their mean should be 0 and
//! their width 1.
//!
//! `cargo run --release --example are_the_errors_true [exposures a scene]`; 3 if no number is given.

use nightglass::light::colour::StarLight;
use nightglass::photometry::header::Overrides;
use nightglass::photometry::{Frame, flag};
use nightglass::run::job::Job;
use nightglass::run::lightcurve::{measure_frame, settings};
use nightglass::run::pointing::field_stars;
use nightglass::scene::{Options, load};
use nightglass::simulate::{Simulator, catalogue};
use std::path::Path;

/// Scenes: what is varied, and the keys that do it.
const SCENES: [(&str, &[(&str, &str)]); 12] = [
    ("as built in", &[]),
    ("V 14.5", &[("target.0.brightness.mag_v", "14.5")]),
    ("V 16", &[("target.0.brightness.mag_v", "16.0")]),
    ("V 10", &[("target.0.brightness.mag_v", "10.0")]),
    ("seeing 1.2 arcsec", &[("station.seeing_arcsec", "1.2"), ("target.0.brightness.mag_v", "14.0")]),
    ("seeing 4 arcsec", &[("station.seeing_arcsec", "4.0"), ("target.0.brightness.mag_v", "13.0")]),
    ("half a second", &[("exposures.duration_s", "0.5"), ("target.0.brightness.mag_v", "11.0")]),
    ("twenty seconds", &[("exposures.duration_s", "20.0"), ("target.0.brightness.mag_v", "15.0")]),
    ("target trails", &[("exposures.track", "sidereal"), ("target.0.brightness.mag_v", "11.5")]),
    ("faint trails", &[("exposures.track", "sidereal"), ("target.0.brightness.mag_v", "14.0")]),
    ("Moon up", &[("exposures.start", "2018-01-28T02:00:00Z"), ("target.0.brightness.mag_v", "13.0")]),
    ("3 m mirror", &[("station.preset", "lmt"), ("target.0.brightness.mag_v", "15.0")]),
];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let count = std::env::args().nth(1).and_then(|a| a.parse().ok()).unwrap_or(3usize);
    println!(
        "{:18} {:>5} {:>7} {:>7} {:>6} {:>5} {:>5} {:>8} {:>8}  pulls of flux; of V",
        "scene", "n", "mean", "width", "SNR", ">3", ">5", "mean", "width"
    );
    let (mut all, mut all_mag) = (Vec::new(), Vec::new());
    for (number, (name, keys)) in SCENES.into_iter().enumerate() {
        let (pulls, mag, snr) = pulls(keys, count, number as u64)?;
        line(name, &pulls, &mag, snr);
        all.extend(pulls);
        all_mag.extend(mag);
    }
    line("all", &all, &all_mag, f64::NAN);
    Ok(())
}

fn line(name: &str, pulls: &[f64], mag: &[f64], snr: f64) {
    let beyond = |limit: f64| pulls.iter().filter(|p| p.abs() > limit).count();
    let ((mean, width), (mag_mean, mag_width)) = (moments(pulls), moments(mag));
    println!(
        "{name:18} {:5} {mean:7.2} {width:7.2} {snr:6.0} {:5} {:5} {mag_mean:8.2} {mag_width:8.2}",
        pulls.len(),
        beyond(3.0),
        beyond(5.0)
    );
}

fn moments(values: &[f64]) -> (f64, f64) {
    let n = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / n;
    (mean, (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0)).sqrt())
}

/// Pulls of flux, of magnitude, and the mean signal-to-noise ratio.
type Pulls = (Vec<f64>, Vec<f64>, f64);

/// The pulls of the points without a flag that spoils them.
fn pulls(keys: &[(&str, &str)], count: usize, seed: u64) -> Result<Pulls, Box<dyn std::error::Error>> {
    let (number, cadence) = (count.to_string(), (30_000.0 / count as f64).to_string());
    let common = [("detector.size_px", "2048"), ("exposures.count", &number), ("exposures.cadence_s", &cadence)];
    let sets = common.iter().chain(keys).map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect::<Vec<_>>();
    let scene = load("pogs-geo", &Options { sets: &sets, seed: Some(seed) })?;
    let simulator = Simulator::new(&scene)?;
    let (catalogue, light) = (catalogue(&scene)?, StarLight::new(&simulator.response.throughput));
    let job = Job { scene: Some(&scene), ..Job::new(&[], &catalogue, settings(&scene)) };
    let spoilt = flag::SATURATED | flag::BLOOMED | flag::EDGE | flag::TRAIL_CROSSING | flag::NEIGHBOUR;
    let (mut pulls, mut mag, mut snr) = (Vec::new(), Vec::new(), 0.0);
    for number in 0..count {
        let made = simulator.frame(number)?;
        let Some(truth) = made.truth.first() else { continue };
        let data = made.adu.iter().map(|v| *v as f32).collect();
        let size = [made.region.width, made.region.height];
        let path = format!("{number:04}.fits");
        let (frame, _) = Frame::assemble(&made.header, size, data, Path::new(&path), &Overrides::default(), None)?;
        let stars = field_stars(&frame, &catalogue, &light, 0.0);
        for (m, _) in measure_frame(&frame, &stars, &job, Some(&simulator.planner))? {
            if m.flags & spoilt == 0 && truth.electrons > 0.0 {
                pulls.push((m.flux_e - truth.electrons) / m.flux_err_e);
                snr += m.flux_e / m.flux_err_e;
                if m.mag_v.is_finite() && m.flags & flag::BORROWED_ZERO_POINT == 0 {
                    mag.push((m.mag_v - truth.mag_v) / m.mag_err);
                }
            }
        }
    }
    let n = pulls.len().max(1) as f64;
    Ok((pulls, mag, snr / n))
}
