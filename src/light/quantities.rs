//! Irradiance, radiance, luminance, magnitude and electrons, as types that do not mix.
//!
//! One zero point does not fit all light: each conversion belongs to a spectrum ([`Spectral`]).
//!
//! ```text
//! E  = E0 10^(-0.4 m)            E0 = E(S) / 10^(-0.4 m_V(S))                    irradiance of V = 0
//! L  = E0 10^(-0.4 mu) (648000 / pi)^2                                           radiance of mu mag/arcsec^2
//! Lv = K L                       K = 683 lm/W int S V(l) dl / E(S)               luminance; CIE 170-2:2015
//! N  = SINT E t                  SINT = A int S T QE F 10^(-0.4 k X) l/(hc) dl / E(S)
//! ```
//!
//! E(S) is the irradiance over all wavelengths, which reach beyond the tabulated spectrum: 1366.1 W m^-2 for the Sun at 1 au
//! (ASTM E490-00a).

use super::curve::{Curve, quadrature};
use super::tables;
use super::throughput::Throughput;
use crate::base::surface_brightness::{Luminance, MagArcsec2};
use crate::base::units::{ARCSEC_PER_RAD, flux_from_mag, mag_from_flux};

/// Luminous efficacy at 540 THz \[lm/W\] (SI Brochure, 9th edition, exact).
const LUMEN_PER_WATT: f64 = 683.0;

/// Energy per time and area, all wavelengths of the spectrum \[W m^-2\], >= 0.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct Irradiance(pub f64);

/// Irradiance per solid angle \[W m^-2 sr^-1\], >= 0.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct Radiance(pub f64);

/// Johnson V magnitude; NaN where there is no light.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct MagV(pub f64);

/// Electrons, >= 0.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct Electrons(pub f64);

/// Irradiance of the Sun at 1 au, all wavelengths \[W m^-2\]: ASTM E490-00a, of which [`tables::sun`] is a part.
pub const SOLAR_W_M2: f64 = 1366.1;

/// Conversions for light of one spectrum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spectral {
    /// Irradiance of V = 0 \[W m^-2\].
    zero: f64,
    /// Luminous efficacy \[lm/W\].
    efficacy: f64,
}

/// Electrons an instrument makes of one spectrum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Counted {
    /// Electrons per second from 1 W m^-2 (the draft's SINT) \[e- m^2 J^-1\].
    pub per_irradiance: f64,
}

impl Spectral {
    /// Conversions for sunlight.
    pub fn sunlight() -> Self {
        Self::of(&tables::sun(), SOLAR_W_M2)
    }

    /// Conversions for light of `spectrum` \[W m^-2 nm^-1\], any scale, whose irradiance over all wavelengths is `energy`
    /// \[W m^-2\].
    pub fn of(spectrum: &Curve, energy: f64) -> Self {
        Self {
            zero: energy / flux_from_mag(tables::magnitude_v(spectrum)),
            efficacy: LUMEN_PER_WATT * integral(spectrum, &[&tables::luminous_efficiency()]) / energy,
        }
    }

    /// Irradiance of a V magnitude.
    pub fn irradiance(&self, mag: MagV) -> Irradiance {
        Irradiance(self.zero * flux_from_mag(mag.0))
    }

    /// V magnitude of an irradiance; NaN for none.
    pub fn magnitude(&self, irradiance: Irradiance) -> MagV {
        MagV(mag_from_flux(irradiance.0 / self.zero))
    }

    /// Radiance of a surface brightness in V.
    pub fn radiance(&self, brightness: MagArcsec2) -> Radiance {
        Radiance(self.zero * flux_from_mag(brightness.0) * ARCSEC_PER_RAD * ARCSEC_PER_RAD)
    }

    /// Surface brightness in V of a radiance; NaN for none.
    pub fn brightness(&self, radiance: Radiance) -> MagArcsec2 {
        MagArcsec2(mag_from_flux(radiance.0 / (self.zero * ARCSEC_PER_RAD * ARCSEC_PER_RAD)))
    }

    /// Luminance of a radiance.
    pub fn luminance(&self, radiance: Radiance) -> Luminance {
        Luminance(1e3 * self.efficacy * radiance.0)
    }

    /// Radiance of a luminance.
    pub fn radiance_of(&self, luminance: Luminance) -> Radiance {
        Radiance(luminance.0 / (1e3 * self.efficacy))
    }
}

impl Counted {
    /// What `throughput` makes of `spectrum` dimmed by `airmass` airmasses (0: outside the air, or measured at the ground);
    /// the spectrum's irradiance over all wavelengths is `energy` \[W m^-2\].
    pub fn of(throughput: &Throughput, spectrum: &Curve, energy: f64, airmass: f64) -> Self {
        Self { per_irradiance: throughput.electrons_per_s(spectrum, airmass) / energy }
    }

    /// Electrons of an irradiance in an exposure \[s\].
    pub fn electrons(&self, irradiance: Irradiance, exposure_s: f64) -> Electrons {
        Electrons(self.per_irradiance * irradiance.0 * exposure_s)
    }

    /// The irradiance that makes so many electrons in an exposure \[s\].
    pub fn irradiance(&self, electrons: Electrons, exposure_s: f64) -> Irradiance {
        Irradiance(electrons.0 / (self.per_irradiance * exposure_s))
    }
}

/// Integral of a spectrum times curves over wavelength.
fn integral(spectrum: &Curve, curves: &[&Curve]) -> f64 {
    let all = [&[spectrum], curves].concat();
    let product = |nm: f64| curves.iter().map(|c| c.at(nm)).product::<f64>() * spectrum.at(nm);
    quadrature(&all).iter().map(|(nm, w)| w * product(*nm)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::surface_brightness::S10;

    /// The IAU's bolometric zero point (2015 Resolution B2), 2.518e-8 W/m^2, is that of V = 0 for sunlight but for its
    /// bolometric correction of -0.07 to -0.09 mag.
    #[test]
    fn sunlight_has_its_zero_point() {
        let Irradiance(zero) = Spectral::sunlight().irradiance(MagV(0.0));
        let correction = mag_from_flux(zero / 2.518_021_002e-8);
        assert!((correction + 0.08).abs() < 0.02, "{correction} mag");
    }

    /// 133.3 klx of 1366 W/m^2 above the atmosphere (Darula, Kittler & Gueymard 2005) make 97.6 lm/W with the eye of 1924; that
    /// of 2008 sees more blue.
    #[test]
    fn sunlight_has_its_luminous_efficacy() {
        let ratio = Spectral::sunlight().efficacy / 97.6;
        assert!(ratio > 1.0 && ratio < 1.08, "{ratio}");
    }

    /// 22 mag/arcsec^2 is 0.171168 mcd/m^2 by the World Atlas's zero point; sunlight and the eye of 2008 make it brighter.
    #[test]
    fn luminance_through_the_spectrum_is_near_the_world_atlas() {
        let solar = Spectral::sunlight();
        let Luminance(own) = solar.luminance(solar.radiance(MagArcsec2(22.0)));
        assert!((own / 0.171168 - 1.11).abs() < 0.03, "{own} mcd/m^2");
    }

    #[test]
    fn every_conversion_has_its_inverse() {
        for light in [Spectral::sunlight(), Spectral::of(&tables::vega(), 4.6e-8)] {
            for mag in [-27.0, 0.0, 22.0] {
                let MagV(m) = light.magnitude(light.irradiance(MagV(mag)));
                let MagArcsec2(mu) = light.brightness(light.radiance(MagArcsec2(mag)));
                let Radiance(r) = light.radiance_of(light.luminance(Radiance(mag.abs())));
                assert!((m - mag).abs() < 1e-12 && (mu - mag).abs() < 1e-12 && (r - mag.abs()).abs() < 1e-12);
            }
            let counted = Counted { per_irradiance: 4e16 };
            let back = counted.irradiance(counted.electrons(Irradiance(1e-10), 5.0), 5.0);
            assert!((back.0 / 1e-10 - 1.0).abs() < 1e-14);
            assert!(light.magnitude(Irradiance(0.0)).0.is_nan());
        }
    }

    /// 1 S10 of sunlight, spread over a square degree, is one star of V = 10.
    #[test]
    fn a_square_degree_of_one_s10_is_a_star_of_tenth_magnitude() {
        let solar = Spectral::sunlight();
        let Radiance(radiance) = solar.radiance(S10(1.0).into());
        let square_degree = (std::f64::consts::PI / 180.0).powi(2);
        assert!((radiance * square_degree / solar.irradiance(MagV(10.0)).0 - 1.0).abs() < 1e-12);
    }
}
