//! How much does the Moon cost? The signal-to-noise ratio of one geostationary satellite at the same hour of sixteen nights, from a young
//! Moon over the full one to its last quarter: the sky at its place, and what is left of the signal.
//!
//! `cargo run --release --example snr_vs_moon [CHART.svg]`

use nightglass::camera::truth;
use nightglass::scene::{Options, load};
use nightglass::simulate::{Simulator, whole};
use plotters::prelude::*;
use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    run(std::env::args().nth(1).as_deref().map(Path::new))
}

/// One night.
struct Night {
    day: f64,
    date: String,
    /// Illuminated share of the Moon if it is up, else 0.
    lit: f64,
    separation_deg: f64,
    sky_e_px: f64,
    snr: f64,
}

/// The table on stdout, the chart into a file if one is named.
pub fn run(chart: Option<&Path>) -> Result<(), Box<dyn Error>> {
    let sets = [
        ("exposures.start", "2018-01-20T06:00:00Z"),
        ("exposures.count", "16"),
        ("exposures.cadence_s", "86400.0"),
        ("target.0.brightness.mag_v", "15.0"),
    ];
    let sets = sets.map(|(key, value)| (key.to_owned(), value.to_owned()));
    let scene = load("pogs-geo", &Options { sets: &sets, seed: None })?;
    let simulator = Simulator::new(&scene)?;
    println!("{:>10} {:>8} {:>8} {:>12} {:>8}", "night", "lit", "Moon at", "sky, e-/px", "SNR");
    let mut nights = Vec::new();
    for number in 0..scene.exposures.count {
        let view = simulator.planner.view(number)?;
        let scenery = simulator.scenery(&view)?;
        let seen = truth::of(&scene, &view, &scenery, &whole(&scene)).swap_remove(0);
        let moon = &view.moon;
        let up = moon.body.horizontal.elevation > 0.0;
        let night = Night {
            day: number as f64,
            date: view.mid.iso_utc()[..10].to_owned(),
            lit: if up { 0.5 * (1.0 + moon.phase.cos()) } else { 0.0 },
            separation_deg: nightglass::astro::separation(view.wcs.mid.centre, moon.body.direction).to_degrees(),
            sky_e_px: scenery.sky_means.iter().map(|mean| mean.mean_e_px).sum(),
            snr: seen.snr,
        };
        let place = if up { format!("{:.0} deg", night.separation_deg) } else { "down".into() };
        println!(
            "{:>10} {:>6.0} % {place:>8} {:>12.1} {:>8.0}",
            night.date,
            100.0 * night.lit,
            night.sky_e_px,
            night.snr
        );
        nights.push(night);
    }
    if let Some(path) = chart {
        std::fs::write(path, draw(&nights)?)?;
    }
    Ok(())
}

fn draw(nights: &[Night]) -> Result<String, Box<dyn Error>> {
    let mut text = String::new();
    let most = nights.iter().fold(0.0f64, |most, night| most.max(night.snr));
    let last = nights.last().map_or(1.0, |night| night.day);
    {
        let root = SVGBackend::with_string(&mut text, (900, 440)).into_drawing_area();
        root.fill(&WHITE)?;
        let title = "a satellite of V = 15 in 5 s, every night at 06:00 UTC";
        let mut chart = ChartBuilder::on(&root)
            .caption(title, ("sans-serif", 18))
            .margin(12)
            .x_label_area_size(40)
            .y_label_area_size(56)
            .build_cartesian_2d(-0.5..last + 0.5, 0.0..1.1 * most)?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .x_labels(nights.len())
            .x_label_formatter(&|day| {
                let night = nights.get(day.round() as usize).filter(|night| (night.day - day).abs() < 0.01);
                night.map_or(String::new(), |night| night.date[5..].to_owned())
            })
            .x_desc("night (2018); grey: share of the Moon that is lit, where it is up")
            .y_desc("signal-to-noise ratio")
            .draw()?;
        let bar = |night: &Night| {
            let top = night.lit * 1.05 * most;
            Rectangle::new([(night.day - 0.35, 0.0), (night.day + 0.35, top)], RGBColor(215, 215, 205).filled())
        };
        chart.draw_series(nights.iter().map(bar))?;
        let points = nights.iter().map(|night| (night.day, night.snr)).collect::<Vec<_>>();
        let blue = RGBColor(0, 114, 178);
        chart.draw_series([PathElement::new(points.clone(), blue.stroke_width(2))])?;
        chart.draw_series(points.into_iter().map(|point| Circle::new(point, 5, blue.filled())))?;
        root.present()?;
    }
    Ok(text)
}
