//! Frames at their limits: whatever happens, a flux is right within its error, or a flag says why not.

use super::synthetic::{self, Camera, SCALE_ARCSEC, Source};
use super::*;
use crate::base::random::{Address, Stage};
use crate::base::sample::uniform;
use crate::base::units::ARCSEC;
use crate::photometry::profile::Shape;

const SIZE: usize = 400;
const ZERO_POINT: f64 = 21.7;
const TARGET_E: f64 = 20_000.0;

/// A field of point stars about a target in the middle.
struct Field {
    camera: Camera,
    stars: Vec<FieldStar>,
    sources: Vec<Source>,
    target: DVec2,
}

impl Field {
    fn new(camera: Camera) -> Self {
        let blank = synthetic::blank(SIZE, SIZE, 0.0);
        let draw = Address { seed: 4, frame: 0, stage: Stage::RandomStars };
        let (mut stars, mut sources) = (Vec::new(), Vec::new());
        for i in 0..16u64 {
            let u = |k: u32| uniform(draw.block(i, k)[0]);
            let cell = DVec2::new((i % 4) as f64, (i / 4) as f64);
            let pixel = cell * 95.0 + DVec2::new(30.0 + 40.0 * u(0), 30.0 + 40.0 * u(1));
            let mag_v = 9.5 + 2.0 * u(2);
            stars.push(FieldStar { direction: blank.wcs.sky(pixel), mag_v, colour_bv: f64::NAN });
            let flux_e = 10f64.powf(0.4 * (ZERO_POINT - mag_v));
            sources.push(Source { segment: Segment::point(pixel), flux_e });
        }
        let target = DVec2::new(199.3, 200.6);
        sources.push(Source { segment: Segment::point(target), flux_e: TARGET_E });
        Self { camera, stars, sources, target }
    }

    fn frame(&self) -> Frame {
        synthetic::expose(&self.camera, SIZE, SIZE, 5, &self.sources)
    }

    fn measure(&self, frame: &Frame) -> Measurement {
        measure(frame, &self.stars, &Place::Pixel(self.target), DVec2::ZERO, &Settings::default())
    }
}

fn camera() -> Camera {
    Camera { shape: Shape::Moffat { inverse_beta: 0.3 }, ..Camera::default() }
}

/// Within 4.5 standard deviations, which chance exceeds once in 150,000 times.
#[track_caller]
fn require_flux(m: &Measurement) {
    let pull = (m.flux_e - TARGET_E) / m.flux_err_e;
    assert!(pull.abs() < 4.5, "{} +- {}, {pull:.1} sigma off; flags {}", m.flux_e, m.flux_err_e, m.flags);
}

#[test]
fn no_stars() {
    let mut field = Field::new(camera());
    field.stars.clear();
    let m = field.measure(&field.frame());
    require_flux(&m);
    assert!(m.mag_v.is_nan() && m.flags == flag::BORROWED_ZERO_POINT, "{}", m.flags);
}

#[test]
fn all_stars_saturated() {
    let mut field = Field::new(camera());
    for (star, source) in field.stars.iter_mut().zip(&mut field.sources) {
        (star.mag_v, source.flux_e) = (4.0, 10f64.powf(0.4 * (ZERO_POINT - 4.0)));
    }
    let m = field.measure(&field.frame());
    assert!(m.n_stars == 0 && m.flags & flag::BORROWED_ZERO_POINT != 0, "{} {}", m.n_stars, m.flags);
}

#[test]
fn a_saturated_target_and_one_that_blooms() {
    let mut field = Field::new(camera());
    field.sources.last_mut().expect("the target").flux_e = 2e6;
    let mut frame = field.frame();
    assert!(field.measure(&frame).flags & flag::SATURATED != 0);
    let x = field.target.x.round() as usize;
    (180..222).for_each(|y| frame.data[y * SIZE + x] = 65_535.0);
    assert!(field.measure(&frame).flags & flag::BLOOMED != 0);
}

#[test]
fn a_bad_column_through_the_target() {
    let field = Field::new(camera());
    let mut frame = field.frame();
    let x = field.target.x.round() as usize;
    (0..SIZE).for_each(|y| frame.data[y * SIZE + x] = f32::NAN);
    let m = field.measure(&frame);
    require_flux(&m);
    assert!(m.flags & flag::BAD_PIXEL != 0);
}

#[test]
fn a_cosmic_ray_on_the_target() {
    let field = Field::new(camera());
    let mut frame = field.frame();
    let at = field.target.round();
    frame.data[(at.y as usize + 2) * SIZE + at.x as usize + 2] += 4000.0;
    let m = field.measure(&frame);
    require_flux(&m);
    assert!(m.flags & flag::COSMIC_RAY != 0, "{}", m.flags);
}

#[test]
fn at_the_border_and_outside() {
    let mut field = Field::new(camera());
    field.target = DVec2::new(1.2, 200.0);
    field.sources.last_mut().expect("the target").segment = Segment::point(field.target);
    let frame = field.frame();
    let m = field.measure(&frame);
    require_flux(&m);
    assert!(m.flags & flag::EDGE != 0);
    for away in [DVec2::new(-30.0, 10.0), DVec2::splat(1e9), DVec2::NAN] {
        let m = measure(&frame, &field.stars, &Place::Pixel(away), DVec2::ZERO, &Settings::default());
        assert!(m.flux_e.is_nan() && m.flags & flag::EDGE != 0 && m.flags & flag::NOT_DETECTED != 0);
    }
}

#[test]
fn no_background_and_a_very_bright_one() {
    for (sky_e, read_noise_e) in [(0.0, 0.0), (0.0, 3.0), (88_000.0, 10.0)] {
        let field = Field::new(Camera { sky_e, read_noise_e, ..camera() });
        let m = field.measure(&field.frame());
        require_flux(&m);
        assert!(m.flux_err_e > 0.9 * TARGET_E.sqrt(), "{sky_e}: {}", m.flux_err_e);
    }
}

/// Twice the gain makes twice the electrons and four times their variance where twice is expected: chi-square of a bright
/// target shows it.
#[test]
fn a_gain_that_is_wrong_by_two_shows() {
    let mut field = Field::new(Camera { sky_e: 200.0, ..camera() });
    field.sources.last_mut().expect("the target").flux_e = 3e5;
    let mut frame = field.frame();
    let right = field.measure(&frame).chi2;
    frame.gain_e_adu *= 2.0;
    let wrong = field.measure(&frame).chi2;
    // 70 pixels: chi-square scatters by 0.17
    assert!((0.5..1.5).contains(&right) && wrong > 1.5 * right, "{right} {wrong}");
}

#[test]
fn one_per_cent_of_the_pixels_missing() {
    let field = Field::new(camera());
    let mut frame = field.frame();
    let draw = Address { seed: 2, frame: 0, stage: Stage::Read };
    for i in 0..frame.data.len() {
        if uniform(draw.block(i as u64, 0)[0]) < 0.01 {
            frame.data[i] = f32::NAN;
        }
    }
    let m = field.measure(&frame);
    require_flux(&m);
    assert!(m.n_stars >= 5 && (m.zeropoint_mag - ZERO_POINT).abs() < 5.0 * m.zeropoint_err, "{}", m.zeropoint_mag);
}

#[test]
fn frames_of_constants() {
    let field = Field::new(camera());
    for value in [0.0, 1000.0, 65_535.0, f32::NAN, f32::INFINITY] {
        let m = field.measure(&synthetic::blank(SIZE, SIZE, value));
        assert!(m.mag_v.is_nan() && m.flags & flag::NOT_DETECTED != 0, "{value}: {m:?}");
    }
}

/// The header's rates say 60 px, the stars are points: the zero point is unknown, or right within its error.
#[test]
fn a_trail_that_is_not_there() {
    let field = Field::new(camera());
    let mut frame = field.frame();
    frame.track_rad_s = DVec2::new(60.0, 0.0) * SCALE_ARCSEC * ARCSEC / frame.exptime_s;
    let m = field.measure(&frame);
    require_flux(&m);
    let unknown = m.flags & flag::BORROWED_ZERO_POINT != 0;
    assert!(
        unknown || (m.zeropoint_mag - ZERO_POINT).abs() < 5.0 * m.zeropoint_err,
        "{} {}",
        m.zeropoint_mag,
        m.flags
    );
}

/// Most of them outside or on top of each other: done within seconds, and the target is flagged.
#[test]
fn a_hundred_thousand_stars() {
    let mut field = Field::new(camera());
    let frame = field.frame();
    let draw = Address { seed: 9, frame: 0, stage: Stage::RandomStars };
    for i in 0..100_000u64 {
        let u = |k: u32| uniform(draw.block(i, k)[0]);
        let direction = frame.wcs.sky(DVec2::new(u(0), u(1)) * SIZE as f64);
        field.stars.push(FieldStar { direction, mag_v: 15.0 + 4.0 * u(2), colour_bv: 0.6 });
    }
    let m = field.measure(&frame);
    assert!(m.flags & flag::NEIGHBOUR != 0, "{}", m.flags);
}
