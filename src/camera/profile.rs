//! Circular profiles of unit sum: how a point's light spreads.
//!
//! Gaussian: exp(-r^2 / 2 s^2) / (2 pi s^2), FWHM = 2.3548 s. Moffat 1969, A&A 3, 455:
//! (beta - 1) / (pi a^2) (1 + r^2/a^2)^-beta, FWHM = 2 a (2^(1/beta) - 1)^(1/2).

use crate::scene;
use std::f64::consts::PI;

/// A circular profile of unit sum.
#[derive(Debug, Clone, Copy, PartialEq)]
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
}

impl Profile {
    /// The profile of a telescope's `psf` with full width at half maximum `fwhm_px`.
    pub fn of(telescope: &scene::Telescope, fwhm_px: f64) -> Self {
        match telescope.psf {
            scene::Psf::Gaussian => Self::Gaussian { sigma: fwhm_px / (8.0 * std::f64::consts::LN_2).sqrt() },
            _ => {
                let beta = telescope.moffat_beta;
                Self::Moffat { alpha: 0.5 * fwhm_px / (libm::exp2(1.0 / beta) - 1.0).sqrt(), beta }
            }
        }
    }

    /// Surface density at radius squared `r2` \[1/px^2\].
    pub fn density(&self, r2: f64) -> f64 {
        match *self {
            Self::Gaussian { sigma } => libm::exp(-0.5 * r2 / (sigma * sigma)) / (2.0 * PI * sigma * sigma),
            Self::Moffat { alpha, beta } => {
                (beta - 1.0) / (PI * alpha * alpha) * libm::pow(1.0 + r2 / (alpha * alpha), -beta)
            }
        }
    }

    /// The radius outside of which lies the share `outside` of the light \[px\].
    pub fn radius(&self, outside: f64) -> f64 {
        match *self {
            Self::Gaussian { sigma } => sigma * (-2.0 * libm::log(outside)).sqrt(),
            Self::Moffat { alpha, beta } => alpha * (libm::pow(outside, -1.0 / (beta - 1.0)) - 1.0).sqrt(),
        }
    }

    /// Full width at half maximum \[px\].
    pub fn fwhm(&self) -> f64 {
        match *self {
            Self::Gaussian { sigma } => sigma * (8.0 * std::f64::consts::LN_2).sqrt(),
            Self::Moffat { alpha, beta } => 2.0 * alpha * (libm::exp2(1.0 / beta) - 1.0).sqrt(),
        }
    }
}
