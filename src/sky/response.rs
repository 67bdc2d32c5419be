//! From the sky's light to electrons: every integral over wavelength that all frames of a scene share.
//!
//! [`Integrals`] are the three conversion factors that satellite photometry traditionally uses (Krag 2003):
//!
//! ```text
//! SINT   electrons per second from sunlight of 1 W m^-2
//! BINT   electrons per second from one star of V = 0 and solar colour
//! AINT   electrons per second and steradian from the airglow at the zenith
//! ```

use super::{airglow, moonlight, twilight, zodiacal};
use crate::light::atlas;
use crate::light::colour::StarLight;
use crate::light::quantities::{Counted, SOLAR_W_M2};
use crate::light::tables;
use crate::light::throughput::{Throughput, ThroughputError};
use crate::scene::{Scene, SkyModel, Table};

/// Rates of electrons of every kind of light through one instrument.
#[derive(Debug, Clone)]
pub struct Response {
    /// The instrument and the air.
    pub throughput: Throughput,
    /// Stars of V = 0 above the atmosphere, by colour and airmass.
    pub stars: StarLight,
    /// A solar-coloured source of V = 0 measured at the ground \[e-/s\].
    pub solar_at_ground: f64,
    /// Artificial luminance of the zenith \[mcd/m^2\]: the station's, or its atlas's.
    pub artificial_mcd_m2: f64,
    pub(super) airglow: airglow::Rates,
    pub(super) twilight: twilight::Rates,
    pub(super) moonlight: moonlight::Rates,
    pub(super) zodiacal: zodiacal::Rates,
}

/// The conversion factors of an instrument, at one airmass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Integrals {
    /// From sunlight \[e- m^2 J^-1\].
    pub sint: f64,
    /// From a star of V = 0 and solar colour \[e-/s\].
    pub bint: f64,
    /// From the airglow at the zenith \[e- s^-1 sr^-1\].
    pub aint: f64,
}

impl Response {
    /// The response of a scene's instrument to the models the scene names.
    ///
    /// # Errors
    /// [`ThroughputError::Atlas`] for an atlas of artificial light that cannot be used.
    pub fn new(scene: &Scene, throughput: Throughput) -> Result<Self, ThroughputError> {
        let named = |model: &SkyModel, name: &str| *model == SkyModel::Named(name.into());
        let airglow = if named(&scene.sky.airglow, "krag") {
            airglow::Rates::krag(&throughput)
        } else {
            airglow::Rates::palace(&throughput, scene.sky.f107_sfu)
        };
        let station = &scene.station;
        let artificial_mcd_m2 = match &station.light_atlas {
            Table::File(path) => atlas::luminance(path, station.latitude_deg, station.longitude_deg)?,
            Table::Named(_) => station.artificial_zenith_mcd_m2,
        };
        Ok(Self {
            artificial_mcd_m2,
            stars: StarLight::new(&throughput),
            solar_at_ground: throughput.electrons_per_s(&tables::solar_of_v_zero(), 0.0),
            airglow,
            twilight: twilight::Rates::new(&throughput),
            moonlight: moonlight::Rates::new(&throughput),
            zodiacal: zodiacal::Rates::new(&throughput),
            throughput,
        })
    }

    /// SINT, BINT and AINT through `airmass` airmasses of direct extinction; 0: outside the air.
    pub fn integrals(&self, airmass: f64) -> Integrals {
        Integrals {
            sint: Counted::of(&self.throughput, &tables::sun(), SOLAR_W_M2, airmass).per_irradiance,
            bint: self.stars.at(None, airmass),
            aint: self.throughput.electrons_per_s(&self.airglow.spectrum, airmass),
        }
    }
}
