//! Places of saturated sources, from the light around what is saturated.
//!
//! The fit of [`super::optimal::place`] to the pixels that are left, of an image whose width is the expected one. An image that is as wide
//! one way as the other is centred by light on all sides, whatever its width: what is assumed of the wings enters the flux alone.

use super::budget::PixelNoise;
use super::frame::Frame;
use super::growth::Psf;
use super::optimal::{self, Placed};
use super::point_image::PointImage;
use super::profile::Shape;
use super::segment::Segment;
use super::single;
use super::stamp::Stamp;

/// Widest stamp \[px\].
const WIDEST_PX: f64 = 80.0;
/// Pixels that are left for each that is saturated.
const AROUND: usize = 3;

/// The image of a source of about `fwhm` \[px\], as far out as saturated sources are looked at.
pub fn image(fwhm: f64) -> PointImage {
    Psf::known(Shape::Kolmogorov, fwhm).image(WIDEST_PX + 3.0 * fwhm)
}

/// The place of a saturated source near `guess`, for images of `fwhm` \[px\]; none if the light around it does not tell.
pub fn place(frame: &Frame, image: &PointImage, guess: &Segment, fwhm: f64) -> Option<Placed> {
    let mut radius = 3.0 * fwhm;
    let stamp = loop {
        let stamp = Stamp::gather(frame, guess, radius, radius, |_| false);
        if stamp.pixels.len() > AROUND * stamp.saturated {
            break stamp;
        }
        radius *= 1.3;
        if radius > WIDEST_PX {
            return None;
        }
    };
    // the background is that beyond the stamp
    let look = single::look(frame, guess, 0.25 * radius, &[]);
    let gain = frame.gain_at(guess.centre);
    let noise = PixelNoise::divided(look.sky_variance, gain, frame.read_noise_e, frame.dark_e);
    let fitted = optimal::fit(&stamp, image, guess, &[], &noise, radius)?;
    let blob = fwhm + (stamp.saturated as f64 / std::f64::consts::PI).sqrt();
    optimal::place(&stamp, image, guess, fitted.flux_e(), fitted.level_e(), noise.total(), blob)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::photometry::synthetic::{self, Camera, Source};
    use glam::DVec2;

    /// Points and trails, up to a thousand times as bright as saturates one, from a guess that is a pixel off: within 0.05 px or four of the errors told.
    #[test]
    fn what_is_saturated_is_placed_by_its_wings() {
        let camera = Camera { shape: Shape::Moffat { inverse_beta: 0.35 }, ..Camera::default() };
        for (half, flux_e) in
            [(DVec2::ZERO, 3e6), (DVec2::ZERO, 1e8), (DVec2::new(12.0, 5.0), 3e7), (DVec2::new(3.0, -7.0), 3e8)]
        {
            let segment = Segment { centre: DVec2::new(100.37, 89.81), half };
            let mut frame = synthetic::expose(&camera, 201, 181, 4, &[Source { segment, flux_e }]);
            frame.saturate_adu = 40_000.0;
            let saturated = frame.data.iter().filter(|v| f64::from(**v) >= 40_000.0).count();
            assert!(saturated > 10, "{saturated}");
            // a width a tenth too small
            let guess = segment.at(segment.centre + DVec2::new(0.8, -0.6));
            let found = place(&frame, &image(2.8), &guess, 2.8).expect("wings");
            let off = (found.centre - segment.centre).abs();
            assert!(
                off.cmplt((4.0 * found.sigma).max(DVec2::splat(0.05))).all(),
                "{half} {flux_e}: off by {off}, {}",
                found.sigma
            );
        }
    }

    #[test]
    fn nothing_but_saturation_tells_nothing() {
        let mut frame = synthetic::blank(60, 60, 65_535.0);
        frame.saturate_adu = 60_000.0;
        assert!(place(&frame, &image(3.0), &Segment::point(DVec2::splat(30.0)), 3.0).is_none());
    }
}
