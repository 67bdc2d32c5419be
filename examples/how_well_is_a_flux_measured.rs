//! How well is a flux measured? A geostationary satellite of V 15.5 in twelve frames, by each of the three estimators: errors told,
//! and errors made.
//!
//! `cargo run --release --example how_well_is_a_flux_measured`

use nightglass::io::fits::{Pixels, write};
use nightglass::photometry::Settings;
use nightglass::run::job::Job;
use nightglass::run::lightcurve::{measure_frames, settings};
use nightglass::scene::{Method, Options, load};
use nightglass::simulate::catalogue;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let sets = [("detector.size_px", "1024"), ("target.0.brightness.mag_v", "15.5")];
    let sets = sets.map(|(key, value)| (key.to_owned(), value.to_owned()));
    let scene = load("pogs-geo", &Options { sets: &sets, seed: None })?;
    let folder = std::env::temp_dir().join("nightglass-how-well");
    std::fs::create_dir_all(&folder)?;
    let (mut frames, mut truth) = (Vec::new(), Vec::new());
    for (number, frame) in nightglass::simulate(&scene)?.enumerate() {
        let frame = frame?;
        let path = folder.join(format!("{number:04}.fits"));
        let adu = frame.adu.iter().map(|v| u16::try_from(*v)).collect::<Result<Vec<_>, _>>()?;
        write(&path, frame.region.width, frame.region.height, Pixels::U16(&adu), &frame.header)?;
        frames.push(path);
        truth.push(frame.truth[0].electrons);
    }
    println!("method     error told   error made   (electrons, rms of {} frames)", frames.len());
    for (name, method) in [("optimal", Method::Optimal), ("joint", Method::Joint), ("aperture", Method::Aperture)]
    {
        let catalogue = catalogue(&scene)?;
        let how = Settings { method, ..settings(&scene) };
        let job = Job { scene: Some(&scene), ..Job::new(&frames, &catalogue, how) };
        let curve = measure_frames(&job)?;
        let rms = |values: Vec<f64>| (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt();
        let told = rms(curve.measurements.iter().map(|m| m.flux_err_e).collect());
        let made = rms(curve.measurements.iter().zip(&truth).map(|(m, t)| m.flux_e - t).collect());
        println!("{name:10} {told:10.1} {made:12.1}");
    }
    Ok(std::fs::remove_dir_all(&folder)?)
}
