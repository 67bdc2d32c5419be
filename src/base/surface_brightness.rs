//! Surface brightness in the units observers use, as types that do not mix.
//!
//! ```text
//! mu = 10 - 2.5 log10(S10 / 3600^2)          stars of 10th magnitude a square degree (Leinert et al. 1998, sect. 2)
//! mu = -2.5 log10(L / 1.08e8)                luminance in mcd/m^2 (Falchi et al. 2016, Sci. Adv. 2, e1600377)
//! B  = 34.08 exp(20.7233 - 0.92104 mu)       nanolambert (Garstang 1989; Krisciunas & Schaefer 1991, eq. 1)
//! ```
//!
//! All are magnitudes in V. The last two rest on zero points 0.5 % apart, each its paper's own; so a luminance goes to
//! nanolambert by definition (1 L = 10^4 / pi cd/m^2) only where no magnitude is meant.

use super::units::{ARCSEC2_PER_DEG2, flux_from_mag, mag_from_flux};
use std::f64::consts::PI;

/// Magnitudes in V of one square arcsecond; NaN where there is no light.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct MagArcsec2(pub f64);

/// Stars of 10th magnitude in V per square degree, >= 0.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct S10(pub f64);

/// Luminance \[mcd/m^2\], >= 0.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct Luminance(pub f64);

/// Luminance \[nL\], >= 0, as the papers on moonlight give it.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct Nanolambert(pub f64);

/// Luminance of magnitude 0 a square arcsecond \[mcd/m^2\].
const ZERO_MCD_M2: f64 = 1.08e8;

impl From<S10> for MagArcsec2 {
    fn from(s10: S10) -> Self {
        Self(10.0 + mag_from_flux(s10.0 / ARCSEC2_PER_DEG2))
    }
}

impl From<MagArcsec2> for S10 {
    fn from(mu: MagArcsec2) -> Self {
        Self(flux_from_mag(mu.0 - 10.0) * ARCSEC2_PER_DEG2)
    }
}

impl From<Luminance> for MagArcsec2 {
    fn from(luminance: Luminance) -> Self {
        Self(mag_from_flux(luminance.0 / ZERO_MCD_M2))
    }
}

impl From<MagArcsec2> for Luminance {
    fn from(mu: MagArcsec2) -> Self {
        Self(flux_from_mag(mu.0) * ZERO_MCD_M2)
    }
}

impl From<Nanolambert> for MagArcsec2 {
    fn from(b: Nanolambert) -> Self {
        Self(if b.0 > 0.0 { (20.7233 - (b.0 / 34.08).ln()) / 0.92104 } else { f64::NAN })
    }
}

impl From<MagArcsec2> for Nanolambert {
    fn from(mu: MagArcsec2) -> Self {
        Self(34.08 * (20.7233 - 0.92104 * mu.0).exp())
    }
}

impl From<Nanolambert> for Luminance {
    fn from(b: Nanolambert) -> Self {
        Self(b.0 * 1e-2 / PI)
    }
}

impl From<Luminance> for Nanolambert {
    fn from(luminance: Luminance) -> Self {
        Self(luminance.0 * 1e2 * PI)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_s10_is_27_78_mag_per_square_arcsecond() {
        assert!((MagArcsec2::from(S10(1.0)).0 - 27.7816).abs() < 1e-3);
    }

    #[test]
    fn natural_sky_of_the_world_atlas_is_22_mag() {
        assert!((Luminance::from(MagArcsec2(22.0)).0 - 0.171168).abs() < 1e-6);
    }

    /// Garstang's zero point and the World Atlas' agree to 0.01 mag.
    #[test]
    fn two_ways_to_nanolambert_agree() {
        for mu in [4.0, 12.0, 18.0, 22.0, 28.0] {
            let luminance = Luminance::from(MagArcsec2(mu));
            let direct = Nanolambert::from(MagArcsec2(mu)).0;
            assert!((Nanolambert::from(luminance).0 / direct - 1.0).abs() < 0.01, "{mu}");
        }
    }

    #[test]
    fn every_conversion_has_its_inverse() {
        for mu in [-10.0, 0.0, 22.0, 40.0] {
            let mu = MagArcsec2(mu);
            let back = [
                MagArcsec2::from(S10::from(mu)),
                MagArcsec2::from(Luminance::from(mu)),
                MagArcsec2::from(Nanolambert::from(mu)),
            ];
            assert!(back.iter().all(|b| (b.0 - mu.0).abs() < 1e-12), "{back:?}");
        }
        assert!((Luminance::from(Nanolambert::from(Luminance(0.3))).0 - 0.3).abs() < 1e-15);
    }

    #[test]
    fn no_light_is_no_magnitude() {
        for mu in [S10(0.0).into(), Luminance(0.0).into(), Nanolambert(0.0).into(), S10(-1.0).into()] {
            let MagArcsec2(mu) = mu;
            assert!(mu.is_nan());
        }
    }
}
