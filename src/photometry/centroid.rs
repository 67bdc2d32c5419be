//! Centroids of points and trails: the windowed mean of Bertin & Arnouts' SExtractor (XWIN), iterated.
//!
//! The window is a Gaussian of the distance to the source's segment with the width of the image. A source
//! displaced by d shifts the windowed mean by d/2, across and along, so each step adds twice the mean.
//! Steps are bounded, and a source that leaves its neighbourhood or is no number gives none.

use super::frame::Frame;
use super::segment::Segment;
use crate::base::elementary::exp;
use glam::DVec2;

/// The middle of the source near `guess`, for images of `fwhm` \[px\] above `background_adu`; none if it
/// moves more than `limit` \[px\] or does not settle.
pub fn windowed(frame: &Frame, guess: &Segment, fwhm: f64, background_adu: f64, limit: f64) -> Option<DVec2> {
    let sigma2 = (fwhm / 2.354_82).powi(2) + 1.0 / 12.0;
    let reach = 1.7 * fwhm + 1.0;
    let mut segment = *guess;
    for _ in 0..30 {
        let (mut light, mut moment) = (0.0, DVec2::ZERO);
        segment.for_pixels(frame, reach, |place, distance, value| {
            if value.is_finite() {
                let w = exp(-0.5 * distance * distance / sigma2) * (value - background_adu);
                light += w;
                moment += (place - segment.centre) * w;
            }
        });
        if light.is_nan() || light <= 0.0 {
            return None;
        }
        let mean = moment / light;
        // along a trail the mean is a share of its length: a step as long as the image is wide at most
        let step = (2.0 * mean).clamp_length_max(fwhm.max(1.0));
        segment.centre += step;
        if !segment.centre.is_finite() || (segment.centre - guess.centre).length() > limit {
            return None;
        }
        if step.length() < 1e-3 {
            return Some(segment.centre);
        }
    }
    // a faint trail's ends move slowly: what is left is below its noise
    Some(segment.centre)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::photometry::profile::Shape;
    use crate::photometry::synthetic::{self, Camera, Source};

    #[test]
    fn points_and_trails_are_centred_to_their_noise() {
        let camera = Camera { shape: Shape::Moffat { inverse_beta: 1.0 / 3.0 }, ..Camera::default() };
        for (half, allowed) in [(DVec2::ZERO, 0.02), (DVec2::new(30.0, 7.0), 0.12), (DVec2::new(0.0, 4.0), 0.04)] {
            let truth = Segment { centre: DVec2::new(70.37, 60.81), half };
            let frame = synthetic::expose(&camera, 140, 120, 1, &[Source { segment: truth, flux_e: 2e5 }]);
            let background = camera.bias_adu + camera.sky_e / camera.gain;
            let start = truth.at(truth.centre + DVec2::new(1.2, -0.9));
            let found = windowed(&frame, &start, 3.0, background, 5.0).expect("a bright source");
            assert!((found - truth.centre).length() < allowed, "{half}: off by {}", found - truth.centre);
        }
    }

    #[test]
    fn noise_and_missing_pixels_do_not_run_away() {
        let camera = Camera::default();
        let background = camera.bias_adu + camera.sky_e / camera.gain;
        for seed in 0..50 {
            let frame = synthetic::expose(&camera, 60, 60, seed, &[]);
            let guess = Segment::point(DVec2::splat(30.0));
            if let Some(found) = windowed(&frame, &guess, 3.0, background, 4.0) {
                assert!((found - guess.centre).length() <= 4.0);
            }
        }
        let nothing = synthetic::blank(20, 20, f32::NAN);
        assert_eq!(windowed(&nothing, &Segment::point(DVec2::splat(10.0)), 3.0, 0.0, 4.0), None);
    }
}
