//! Frames drawn for the tests, by another road than the camera's: sub-sampled pixels, origin by origin.

use super::frame::Frame;
use super::profile::Shape;
use super::segment::Segment;
use crate::astro::direction;
use crate::astro::time::Instant;
use crate::base::poisson::draw_poisson;
use crate::base::random::{Address, Stage};
use crate::base::sample::add_normal;
use crate::base::units::ARCSEC;
use crate::plan::wcs::Wcs;
use glam::{DMat2, DVec2};

/// What draws a frame.
#[derive(Debug, Clone)]
pub struct Camera {
    pub shape: Shape,
    pub fwhm: f64,
    pub sky_e: f64,
    pub read_noise_e: f64,
    pub gain: f64,
    pub bias_adu: f64,
}

impl Default for Camera {
    fn default() -> Self {
        let shape = Shape::Moffat { inverse_beta: 0.0 };
        Self { shape, fwhm: 3.0, sky_e: 7.0, read_noise_e: 10.0, gain: 1.5, bias_adu: 1000.0 }
    }
}

/// A source drawn.
#[derive(Debug, Clone, Copy)]
pub struct Source {
    pub segment: Segment,
    pub flux_e: f64,
}

pub const SCALE_ARCSEC: f64 = 0.725;

/// A frame of one value.
pub fn blank(width: usize, height: usize, value: f32) -> Frame {
    let cd = DMat2::from_cols(DVec2::new(-SCALE_ARCSEC * ARCSEC, 0.0), DVec2::new(0.0, SCALE_ARCSEC * ARCSEC));
    let crpix = DVec2::new(width as f64 - 1.0, height as f64 - 1.0) * 0.5;
    Frame {
        width,
        height,
        data: vec![value; width * height],
        wcs: Wcs::new(1.4, 0.1, crpix, cd, None),
        time: Instant::from_utc("2018-01-15T04:00:00").expect("a date"),
        solved: false,
        approximate: false,
        exptime_s: 5.0,
        masters_variance_e2: 0.0,
        masters_flat_rms: 0.0,
        response: None,
        gain_e_adu: 1.5,
        read_noise_e: Some(10.0),
        dark_e: None,
        saturate_adu: 65_535.0,
        bias_adu: Some(1000.0),
        airmass: None,
        aperture_mm: None,
        elevation_m: None,
        pointing: direction(1.4, 0.1),
        track_rad_s: DVec2::ZERO,
        seeing_arcsec: Some(3.0 * SCALE_ARCSEC),
        object: "TEST".to_owned(),
        number: None,
    }
}

/// Mean electrons of sources: each pixel by n x n sub-pixels, each trail by origins 1/2 px apart.
pub fn mean_electrons(camera: &Camera, width: usize, height: usize, sources: &[Source]) -> Vec<f64> {
    let mut mean = vec![camera.sky_e; width * height];
    // the profile against the squared distance [px^2]
    const PER_PX2: f64 = 64.0;
    let knots = (40.0 * camera.fwhm * PER_PX2 * 41.0 * camera.fwhm) as usize;
    let radius = |i: usize| (i as f64 / PER_PX2).sqrt() / camera.fwhm;
    let profile = (0..knots).map(|i| camera.shape.intensity(radius(i))).collect::<Vec<_>>();
    let intensity = |square: f64| {
        let t = square * PER_PX2;
        let i = t as usize;
        if i + 1 < knots { profile[i] + (profile[i + 1] - profile[i]) * (t - i as f64) } else { 0.0 }
    };
    for source in sources {
        let origins = (source.segment.length() * 2.0).ceil().max(1.0) as usize;
        // wings are convex: their pixels are divided too where that matters by 1e-4 of the flux
        let reach = if source.segment.length() > 0.0 { 14.0 } else { 40.0 } * camera.fwhm;
        let s = &source.segment;
        let core = if origins > 1 { 4i32 } else { 7 };
        let sub = |distance: f64| if distance < 2.0 * camera.fwhm { core } else { 3 };
        let extent = s.half.abs() + DVec2::splat(reach);
        let clip = |v: f64, n: usize| (v.max(0.0) as usize).min(n);
        for y in clip(s.centre.y - extent.y, height)..clip(s.centre.y + extent.y + 1.0, height) {
            for x in clip(s.centre.x - extent.x, width)..clip(s.centre.x + extent.x + 1.0, width) {
                let place = DVec2::new(x as f64, y as f64);
                let distance = s.distance(place);
                if distance > reach {
                    continue;
                }
                let n = sub(distance);
                let part = 1.0 / f64::from(n);
                let mut sum = 0.0;
                for k in 0..origins {
                    let t = (k as f64 + 0.5) / origins as f64 * 2.0 - 1.0;
                    let origin = s.centre + s.half * t;
                    if origins > 1 && (place - origin).length() > reach {
                        continue;
                    }
                    for j in 0..n {
                        for i in 0..n {
                            let offset = DVec2::new(f64::from(i) + 0.5, f64::from(j) + 0.5) * part - 0.5;
                            sum += intensity((place + offset - origin).length_squared());
                        }
                    }
                }
                let scale = part * part / (origins as f64 * camera.fwhm * camera.fwhm);
                mean[y * width + x] += source.flux_e * sum * scale;
            }
        }
    }
    mean
}

/// Shot noise, read noise, gain and quantisation.
pub fn develop(camera: &Camera, width: usize, height: usize, seed: u64, mean: &[f64]) -> Frame {
    let mut frame = blank(width, height, 0.0);
    let shot = Address { seed, frame: 1, stage: Stage::Shot };
    let read = Address { seed, frame: 1, stage: Stage::Read };
    let mut electrons = mean.to_vec();
    draw_poisson(&shot, 0, &mut electrons);
    add_normal(&read, 0, camera.read_noise_e, &mut electrons);
    for (value, electrons) in frame.data.iter_mut().zip(electrons) {
        *value = (electrons / camera.gain + camera.bias_adu).round().clamp(0.0, 65_535.0) as f32;
    }
    frame.gain_e_adu = camera.gain;
    frame.bias_adu = Some(camera.bias_adu);
    frame.read_noise_e = Some(camera.read_noise_e);
    frame
}

/// Draw and develop.
pub fn expose(camera: &Camera, width: usize, height: usize, seed: u64, sources: &[Source]) -> Frame {
    develop(camera, width, height, seed, &mean_electrons(camera, width, height, sources))
}
