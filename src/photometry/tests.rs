//! The whole measurement on drawn frames.

use super::profile::Shape;
use super::synthetic::{self, Camera, SCALE_ARCSEC, Source};
use super::*;
use crate::base::random::{Address, Stage};
use crate::base::sample::uniform;
use crate::base::units::ARCSEC;

/// Zero point of the drawn frames.
const ZERO_POINT: f64 = 21.7;
const SIZE: usize = 640;

/// A field of trailed stars, some of them absent, and a target at the middle.
struct Field {
    stars: Vec<FieldStar>,
    sources: Vec<Source>,
    target: Segment,
    trail: DVec2,
}

fn field(trail: DVec2, absent: usize, seed: u64) -> Field {
    let mut frame = synthetic::blank(SIZE, SIZE, 0.0);
    frame.track_rad_s = rate(trail, frame.exptime_s);
    let place = Address { seed, frame: 0, stage: Stage::RandomStars };
    let (mut stars, mut sources) = (Vec::new(), Vec::new());
    for i in 0..24u64 {
        let draw = |k: u32| uniform(place.block(i, k)[0]);
        // a loose lattice, so that most stand alone
        let (column, row) = ((i % 4) as f64, (i / 4) as f64);
        let pixel = DVec2::new(20.0 + 150.0 * column + 130.0 * draw(0), 30.0 + 100.0 * row + 70.0 * draw(1));
        let mag_v = 8.0 + 3.5 * draw(2);
        let star = FieldStar { direction: frame.wcs.sky(pixel), mag_v };
        let segment = frame.star_segment(star.direction).expect("on the frame");
        stars.push(star);
        let clear = segment.gap(&Segment::point(DVec2::splat(SIZE as f64 / 2.0))) > 40.0;
        if !clear {
            stars.pop();
        } else if i as usize >= absent {
            sources.push(Source { segment, flux_e: 10f64.powf(0.4 * (ZERO_POINT - mag_v)) });
        }
    }
    let jitter = DVec2::new(uniform(place.block(900, 0)[0]), uniform(place.block(901, 0)[0])) - 0.5;
    Field { stars, sources, target: Segment::point(DVec2::splat(SIZE as f64 / 2.0 - 0.5) + jitter), trail }
}

/// Rate of the frame among the stars \[rad/s\] that draws trails of -`trail` px (east is to the left).
fn rate(trail: DVec2, exptime_s: f64) -> DVec2 {
    DVec2::new(-trail.x, trail.y) * SCALE_ARCSEC * ARCSEC / exptime_s
}

struct Pulls {
    flux: Vec<f64>,
    mag: Vec<f64>,
    bias: Vec<f64>,
    radius: f64,
    share: f64,
    fwhm: f64,
    err: f64,
}

fn pulls(camera: &Camera, field: &Field, target_e: f64, count: u64, settings: &Settings) -> Pulls {
    let mut sources = field.sources.clone();
    sources.push(Source { segment: field.target, flux_e: target_e });
    let mean = synthetic::mean_electrons(camera, SIZE, SIZE, &sources);
    let mag = ZERO_POINT - 2.5 * target_e.log10();
    let mut pulls =
        Pulls { flux: vec![], mag: vec![], bias: vec![], radius: 0.0, share: 0.0, fwhm: 0.0, err: 0.0 };
    for seed in 0..count {
        let mut frame = synthetic::develop(camera, SIZE, SIZE, 1000 + seed, &mean);
        frame.track_rad_s = rate(field.trail, frame.exptime_s);
        frame.seeing_arcsec = Some(camera.fwhm * SCALE_ARCSEC * 1.05);
        let m = measure(&frame, &field.stars, &Place::Header, DVec2::ZERO, settings);
        pulls.flux.push((m.flux_e - target_e) / m.flux_err_e);
        pulls.mag.push((m.mag_v - mag) / m.mag_err);
        pulls.bias.push(m.flux_e / target_e - 1.0);
        (pulls.radius, pulls.share, pulls.fwhm) = (m.aperture_px, m.share, m.fwhm_px);
        pulls.err = m.flux_err_e / target_e;
    }
    pulls
}

fn moments(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (mean, (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt())
}

fn moffat(beta: f64) -> Shape {
    Shape::Moffat { inverse_beta: 1.0 / beta }
}

/// Every profile, bright and faint: see the printed table with --nocapture.
#[test]
#[ignore = "minutes: the table of biases and widths"]
fn table_of_biases_and_widths() {
    let trail = DVec2::new(97.0, 6.0);
    let shapes = [
        ("gauss", Shape::Moffat { inverse_beta: 0.0 }),
        ("b=4.7", moffat(4.7)),
        ("b=3", moffat(3.0)),
        ("b=2.7", moffat(2.7)),
        ("b=2.5", moffat(2.5)),
        ("kolmo", Shape::Kolmogorov),
    ];
    for (name, shape) in shapes {
        for fwhm in [2.0, 3.0, 6.0] {
            for (label, trail) in [("trail", trail), ("point", DVec2::ZERO)] {
                for target_e in [120_000.0, 1_000.0 * fwhm / 3.0] {
                    let camera = Camera { shape, fwhm, ..Camera::default() };
                    let field = field(trail, 0, 3);
                    let p = pulls(&camera, &field, target_e, 60, &Settings::default());
                    let ((fm, fw), (mm, mw)) = (moments(&p.flux), moments(&p.mag));
                    println!(
                        "{name:6} fwhm {fwhm} {label} {target_e:8.0} e: flux {fm:+.2} +- {fw:.2}  mag {mm:+.2} +- {mw:.2}  \
                         mean {:+.5} err {:.4} r {:.1} share {:.4} fwhm {:.3}",
                        moments(&p.bias).0,
                        p.err,
                        p.radius,
                        p.share,
                        p.fwhm
                    );
                }
            }
        }
    }
}
