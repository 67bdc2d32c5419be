//! Down to which magnitude stars are drawn one by one.
//!
//! Undrawn stars are an even light; what is lost is their clumping. The variance that stars of counts n(m) per square degree
//! put into a pixel of solid angle w is
//!
//! ```text
//! w int n(m) f(m)^2 dm  sum p^2
//! ```
//!
//! with f(m) a star's electrons and p the shares of its image in the pixels (Poisson statistics of shot noise, Campbell
//! 1909; Condon 1974, ApJ 188, 279). Stars are drawn until the rms of the rest falls below `accuracy.omit` times the
//! pixel's noise, and until one of them, with the noise s of its pixels, has a signal-to-noise ratio f (sum p^2)^(1/2) / s
//! below 1: a rare star is nothing to the mean and yet seen where it is. The limit is rounded up to a quarter magnitude, at
//! most V = 21, where the counts end.

use crate::base::units::{flux_from_mag, mag_from_flux};
use crate::stars::counts::{Counts, DEG2_PER_SR};

/// Step of the limit \[mag\].
const STEP: f64 = 0.25;
/// Range of the limit.
const BRIGHTEST: f64 = -2.0;
const FAINTEST: f64 = 21.0;

/// What the limit depends on.
#[derive(Debug, Clone, Copy)]
pub struct Clumping {
    /// Counts at the frame's centre.
    pub counts: Counts,
    /// Electrons of a star of V = 0 in the exposure.
    pub star_e: f64,
    /// Solid angle of a pixel \[sr\].
    pub pixel_sr: f64,
    /// Sum of the squares of the shares of a star's image.
    pub sharpness: f64,
}

/// Sum of squared shares of an image of `fwhm_px`, drawn out to a trail of `trail_px`: that of a Gaussian across, and along
/// the trail no more than its length allows. Never above 1.
pub fn sharpness(fwhm_px: f64, trail_px: f64) -> f64 {
    // a Gaussian has 1/(4 pi sigma^2) = 0.441 / FWHM^2, and 0.664 / FWHM across a line
    (0.441 / (fwhm_px * fwhm_px)).min(0.664 / (fwhm_px * trail_px.max(1e-9))).min(1.0)
}

impl Clumping {
    /// The limit at which the rms of undrawn stars is `share` of a pixel's noise \[e-\], and none of them stands out of it.
    pub fn limit(&self, share: f64, noise: f64) -> f64 {
        let seen = mag_from_flux(noise / (self.star_e * self.sharpness.sqrt()));
        let seen = (seen / STEP).ceil() * STEP;
        self.by_clumping(share * noise).max(if seen.is_finite() { seen.min(FAINTEST) } else { BRIGHTEST })
    }

    /// The limit at which the rms of undrawn stars is `allowed` \[e-/px\].
    fn by_clumping(&self, allowed: f64) -> f64 {
        let scale = self.pixel_sr * DEG2_PER_SR * self.sharpness * self.star_e * self.star_e;
        let mut limit = FAINTEST;
        // stars beyond V = 21 add a tenth or less of the last magnitude's variance
        let mut variance = 0.0;
        while limit > BRIGHTEST {
            let bright = limit - STEP;
            let number = self.counts.brighter_than(limit) - self.counts.brighter_than(bright);
            variance += scale * number * flux_from_mag(2.0 * (bright + 0.5 * STEP));
            if variance > allowed * allowed {
                break;
            }
            limit = bright;
        }
        limit
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stars::counts::Galactic;

    #[test]
    fn brighter_skies_and_longer_trails_need_fewer_stars() {
        let counts = Counts::at(Galactic { l: 1.0, b: 0.7 });
        let point = Clumping { counts, star_e: 5e9, pixel_sr: 1.2e-11, sharpness: sharpness(3.0, 0.0) };
        let trailed = Clumping { sharpness: sharpness(3.0, 100.0), ..point };
        assert!(point.by_clumping(0.1) > point.by_clumping(1.0));
        assert!(point.limit(0.01, 10.0) > trailed.limit(0.01, 10.0));
        assert_eq!(point.limit(0.0, 10.0), FAINTEST);
        assert_eq!(point.by_clumping(f64::INFINITY), BRIGHTEST);
        // whatever the noise, a star at the limit does not stand out of it
        for noise in [3.0, 30.0, 1e3, 1e6] {
            let limit = point.limit(0.01, noise);
            let hidden = point.star_e * flux_from_mag(limit) * point.sharpness.sqrt() <= noise;
            assert!(hidden || limit == FAINTEST, "{noise}: {limit}");
        }
        let none = Clumping { star_e: 0.0, ..point };
        assert_eq!(none.limit(0.01, 10.0), BRIGHTEST);
    }
}
