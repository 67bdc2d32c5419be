//! The whole measurement on drawn frames.

use super::profile::Shape;
use super::synthetic::{self, Camera, SCALE_ARCSEC, Source};
use super::*;
use crate::base::random::{Address, Stage};
use crate::base::sample::uniform;
use crate::base::units::ARCSEC;

/// Zero point of the drawn frames.
const ZERO_POINT: f64 = 21.7;
const SIZE: usize = 600;

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
    for i in 0..15u64 {
        let draw = |k: u32| uniform(place.block(i, k)[0]);
        // a loose lattice, so that most stand alone
        let (column, row) = ((i % 3) as f64, (i / 3) as f64);
        let pixel = DVec2::new(80.0 + 195.0 * column + 50.0 * draw(0), 40.0 + 115.0 * row + 50.0 * draw(1));
        let mag_v = 8.0 + 3.5 * draw(2);
        let star = FieldStar { direction: frame.wcs.sky(pixel), mag_v, colour_bv: f64::NAN };
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
        for fwhm in [2.0, 3.0, 5.0] {
            for (label, trail) in [("trail", trail), ("point", DVec2::ZERO)] {
                for target_e in [120_000.0, 1_000.0 * fwhm / 3.0] {
                    let camera = Camera { shape, fwhm, ..Camera::default() };
                    let field = field(trail, 0, 3);
                    let p = pulls(&camera, &field, target_e, 100, &Settings::default());
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

/// A full frame with 60 trailed stars.
#[test]
#[ignore = "a figure, not a check: time of one measurement"]
fn time_of_a_full_frame() {
    let camera = Camera::default();
    let size = 4096;
    let mut frame = synthetic::blank(size, size, 0.0);
    let trail = DVec2::new(103.0, 4.0);
    frame.track_rad_s = rate(trail, frame.exptime_s);
    let place = Address { seed: 1, frame: 0, stage: Stage::RandomStars };
    let (mut stars, mut sources) = (Vec::new(), vec![]);
    for i in 0..60u64 {
        let draw = |k: u32| uniform(place.block(i, k)[0]);
        let pixel = DVec2::new(draw(0), draw(1)) * size as f64;
        let mag_v = 7.0 + 4.5 * draw(2);
        stars.push(FieldStar { direction: frame.wcs.sky(pixel), mag_v, colour_bv: f64::NAN });
        let segment = frame.star_segment(stars[i as usize].direction).expect("on the frame");
        sources.push(Source { segment, flux_e: 10f64.powf(0.4 * (ZERO_POINT - mag_v)) });
    }
    sources.push(Source { segment: Segment::point(DVec2::splat(2047.5)), flux_e: 1e5 });
    let track = frame.track_rad_s;
    frame = synthetic::expose(&camera, size, size, 1, &sources);
    frame.track_rad_s = track;
    for _ in 0..3 {
        let start = std::time::Instant::now();
        let m = measure(&frame, &stars, &Place::Header, DVec2::ZERO, &Settings::default());
        println!(
            "{:?}: {} stars, flux {} +- {}, zp {} +- {}",
            start.elapsed(),
            m.n_stars,
            m.flux_e,
            m.flux_err_e,
            m.zeropoint_mag,
            m.zeropoint_err
        );
    }
}

/// Pulls of 100 exposures or more: their mean lies within 0.2 and their width within 0.8..1.25. By chance alone
/// the mean of 100 pulls scatters by 0.1 and the width by 0.07, so the seeds are fixed and the limits those
/// required.
fn require_honest(camera: &Camera, target_e: f64, absent: usize, count: u64) {
    let field = field(DVec2::new(97.0, 6.0), absent, 3);
    let p = pulls(camera, &field, target_e, count, &Settings::default());
    for (what, values) in [("flux", &p.flux), ("magnitude", &p.mag)] {
        let (mean, width) = moments(values);
        let told = format!("{what} of {target_e} e, {:?} FWHM {}: {mean} +- {width}", camera.shape, camera.fwhm);
        println!("{told}");
        assert!(mean.abs() < 0.2 && (0.8..1.25).contains(&width), "{told}");
    }
}

#[test]
fn fluxes_and_errors_are_honest_for_a_bright_target() {
    require_honest(&Camera { shape: moffat(2.5), ..Camera::default() }, 1.5e5, 0, 100);
}

#[test]
fn fluxes_and_errors_are_honest_for_a_faint_target_and_absent_stars() {
    require_honest(&Camera { shape: moffat(3.0), ..Camera::default() }, 1.1e3, 4, 100);
}

#[test]
#[ignore = "minutes: the same for other images, 300 exposures each"]
fn fluxes_and_errors_are_honest_for_other_images() {
    for shape in [Shape::Moffat { inverse_beta: 0.0 }, moffat(3.0), Shape::Kolmogorov] {
        let camera = Camera { shape, ..Camera::default() };
        require_honest(&camera, 1.2e5, 4, 300);
        require_honest(&camera, 1e3, 0, 300);
    }
}

#[test]
fn a_radius_asked_for_is_used_exactly() {
    let camera = Camera { shape: moffat(3.0), ..Camera::default() };
    let field = field(DVec2::new(40.0, 0.0), 0, 4);
    let settings = Settings { aperture_px: Some(4.25), ..Settings::default() };
    let p = pulls(&camera, &field, 1.2e5, 30, &settings);
    assert_eq!(p.radius, 4.25);
    // standard error of 30 pulls 0.18: 3 of them
    let means = [moments(&p.flux).0, moments(&p.mag).0];
    assert!(means.iter().all(|m| m.abs() < 0.55), "{means:?}");
}

#[test]
fn a_trailed_target_among_pointlike_stars_is_measured_as_a_pill() {
    let camera = Camera { shape: moffat(3.0), ..Camera::default() };
    let mut field = field(DVec2::ZERO, 0, 5);
    field.target.half = DVec2::new(14.0, 22.0);
    field.sources.push(Source { segment: field.target, flux_e: 3e5 });
    let mean = synthetic::mean_electrons(&camera, SIZE, SIZE, &field.sources);
    let mut flux = Vec::new();
    for seed in 0..30 {
        let frame = synthetic::develop(&camera, SIZE, SIZE, seed, &mean);
        let m = measure(&frame, &field.stars, &Place::Header, field.target.half * 2.0, &Settings::default());
        assert!(m.n_stars > 8 && m.flags == 0, "{} stars, flags {}", m.n_stars, m.flags);
        flux.push((m.flux_e - 3e5) / m.flux_err_e);
    }
    let (mean, width) = moments(&flux);
    assert!(mean.abs() < 0.55 && (0.6..1.4).contains(&width), "{mean} +- {width}");
}

#[test]
fn extremes_give_flags_and_no_panic() {
    let settings = Settings::default();
    let star =
        |dx: f64| FieldStar { direction: crate::astro::direction(1.4 + dx, 0.1), mag_v: 9.0, colour_bv: f64::NAN };
    let odd = [star(0.0), star(1e-4), star(f64::NAN), star(3.0), FieldStar { mag_v: f64::NAN, ..star(0.0) }];
    for (width, height, value) in
        [(1, 1, 0.0), (3, 2, f32::NAN), (60, 50, f32::INFINITY), (40, 40, 1000.0), (0, 0, 0.0)]
    {
        for exptime_s in [0.0, 5.0] {
            let mut frame = synthetic::blank(width, height, value);
            frame.exptime_s = exptime_s;
            frame.track_rad_s = DVec2::new(7e-5, f64::INFINITY);
            for stars in [&odd[..], &[]] {
                for trail in [DVec2::ZERO, DVec2::new(1e4, f64::NAN), DVec2::splat(3e3)] {
                    let m = measure(&frame, stars, &Place::Header, trail, &settings);
                    assert!(m.mag_v.is_nan() && m.flags & flag::BORROWED_ZERO_POINT != 0);
                    assert!(m.flags & flag::NOT_DETECTED != 0, "{width} x {height} of {value}: {}", m.flux_e);
                }
            }
        }
    }
    let frame = synthetic::expose(&Camera::default(), 80, 80, 1, &[]);
    for place in [Place::Pixel(DVec2::splat(-300.0)), Place::Sky(-frame.pointing), Place::Pixel(DVec2::NAN)] {
        let m = measure(&frame, &[], &place, DVec2::ZERO, &settings);
        assert!(m.flux_e.is_nan() && m.flags & (8 | 128) == 8 | 128);
    }
    // nothing there: measured at the predicted place, at most 3 sigma, flagged
    let m = measure(&frame, &[], &Place::Header, DVec2::ZERO, &settings);
    assert!(m.flux_e.abs() < 4.0 * m.flux_err_e && m.flags & flag::NOT_DETECTED != 0 && m.x_px == 39.5);
}

#[test]
fn saturation_edges_crossings_and_bad_pixels_are_flagged() {
    let camera = Camera::default();
    let middle = Segment::point(DVec2::splat(60.0));
    let bright = Source { segment: middle, flux_e: 5e4 };
    let mut frame = synthetic::expose(&camera, 120, 120, 1, &[bright]);
    let settings = Settings::default();
    let measured = |frame: &Frame, stars: &[FieldStar], at: DVec2| {
        measure(frame, stars, &Place::Pixel(at), DVec2::ZERO, &settings).flags & !flag::BORROWED_ZERO_POINT
    };
    assert_eq!(measured(&frame, &[], middle.centre), 0);
    assert_eq!(measured(&frame, &[], DVec2::new(1.0, 60.0)) & flag::EDGE, flag::EDGE);
    frame.data[60 * 120 + 60] = f32::NAN;
    assert_eq!(measured(&frame, &[], middle.centre) & flag::BAD_PIXEL, flag::BAD_PIXEL);
    frame.data[60 * 120 + 60] = 65_535.0;
    assert_eq!(measured(&frame, &[], middle.centre) & flag::SATURATED, flag::SATURATED);
    let trailed = Frame { track_rad_s: rate(DVec2::new(50.0, 0.0), 5.0), ..frame };
    let star = FieldStar { direction: trailed.wcs.sky(DVec2::new(70.0, 61.0)), mag_v: 8.0, colour_bv: f64::NAN };
    assert_eq!(measured(&trailed, &[star], middle.centre) & 48, flag::TRAIL_CROSSING | flag::NEIGHBOUR);
}

/// A target without a star beside it, V 12 in 2 s: its own light tells its image. 240 exposures each of two images: pulls with a mean within
/// 0.2 and a width within 0.13 of 1, three of their standard deviations (0.065 and 0.046); with the aperture of the mean image's share
/// it was 1.13 to 1.15 on simulated crops.
#[test]
fn errors_are_honest_where_the_target_alone_tells_its_image() {
    const SIDE: usize = 121;
    const TARGET_E: f64 = 2.5e4;
    for shape in [Shape::Kolmogorov, moffat(3.0)] {
        let camera = Camera { shape, sky_e: 4.0, ..Camera::default() };
        let target = Source { segment: Segment::point(DVec2::new(60.2, 59.7)), flux_e: TARGET_E };
        let mean = synthetic::mean_electrons(&camera, SIDE, SIDE, &[target]);
        let pull = |seed: u64| {
            let mut frame = synthetic::develop(&camera, SIDE, SIDE, 3000 + seed, &mean);
            frame.seeing_arcsec = Some(camera.fwhm * SCALE_ARCSEC);
            let m = measure(&frame, &[], &Place::Header, DVec2::ZERO, &Settings::default());
            (m.flux_e - TARGET_E) / m.flux_err_e
        };
        let (mean, width) = moments(&(0..240).map(pull).collect::<Vec<_>>());
        assert!(mean.abs() < 0.2 && (width - 1.0).abs() < 0.13, "{shape:?}: {mean} +- {width}");
    }
}
