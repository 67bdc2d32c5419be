//! Profiles of unit sum: how a point's light spreads.
//!
//! Gaussian: exp(-r^2 / 2 s^2) / (2 pi s^2), FWHM = 2.3548 s. Moffat 1969, A&A 3, 455:
//! (beta - 1) / (pi a^2) (1 + r^2/a^2)^-beta, FWHM = 2 a (2^(1/beta) - 1)^(1/2). Diffraction and turbulence: [`super::radial`].

use super::psf_image::PsfImage;
use super::radial::Radial;
use glam::DVec2;
use std::f64::consts::PI;
use std::sync::Arc;

/// A profile of unit sum.
#[derive(Debug, Clone, PartialEq)]
pub enum Profile {
    /// Gaussian of standard deviation \[px\].
    Gaussian {
        /// Standard deviation \[px\].
        sigma: f64,
    },
    /// Moffat of core radius \[px\] and exponent.
    Moffat {
        /// Core radius a \[px\].
        alpha: f64,
        /// Exponent, above 1.
        beta: f64,
    },
    /// Diffraction or turbulence, tabulated.
    Radial(Arc<Radial>),
    /// Any shape, as an image.
    Image(Arc<PsfImage>),
}

impl Profile {
    /// The Gaussian of full width at half maximum `fwhm` px.
    pub fn gaussian(fwhm: f64) -> Self {
        Self::Gaussian { sigma: fwhm / (8.0 * std::f64::consts::LN_2).sqrt() }
    }

    /// Moffat's profile of full width at half maximum `fwhm` px and exponent `beta`.
    pub fn moffat(fwhm: f64, beta: f64) -> Self {
        Self::Moffat { alpha: 0.5 * fwhm / (libm::exp2(1.0 / beta) - 1.0).sqrt(), beta }
    }

    /// True if it depends on the radius alone.
    pub fn is_circular(&self) -> bool {
        !matches!(self, Self::Image(_))
    }

    /// Surface density at an offset from the point \[1/px^2\].
    pub fn density(&self, offset: DVec2) -> f64 {
        let r2 = offset.length_squared();
        match self {
            Self::Gaussian { sigma } => libm::exp(-0.5 * r2 / (sigma * sigma)) / (2.0 * PI * sigma * sigma),
            Self::Moffat { alpha, beta } => {
                (beta - 1.0) / (PI * alpha * alpha) * libm::pow(1.0 + r2 / (alpha * alpha), -beta)
            }
            Self::Radial(radial) => radial.density(r2),
            Self::Image(image) => image.density(offset),
        }
    }

    /// The radius outside of which lies the share `outside` of the light \[px\]; of an image that of its corner.
    pub fn radius(&self, outside: f64) -> f64 {
        match self {
            Self::Gaussian { sigma } => sigma * (-2.0 * libm::log(outside)).sqrt(),
            Self::Moffat { alpha, beta } => alpha * (libm::pow(outside, -1.0 / (beta - 1.0)) - 1.0).sqrt(),
            Self::Radial(radial) => radial.radius(outside),
            Self::Image(image) => image.radius(),
        }
    }

    /// Full width at half maximum \[px\]; of an image that of the circle as large as what exceeds half its maximum.
    pub fn fwhm(&self) -> f64 {
        match self {
            Self::Gaussian { sigma } => sigma * (8.0 * std::f64::consts::LN_2).sqrt(),
            Self::Moffat { alpha, beta } => 2.0 * alpha * (libm::exp2(1.0 / beta) - 1.0).sqrt(),
            Self::Radial(radial) => radial.fwhm(),
            Self::Image(image) => image.fwhm(),
        }
    }
}
