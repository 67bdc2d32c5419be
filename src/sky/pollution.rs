//! Light pollution: artificial light scattered by the air.
//!
//! The station's artificial zenith luminance A \[mcd/m^2\] (the artificial part alone) is
//! -2.5 log10(A / 1.08e8) V mag/arcsec^2 (Falchi et al. 2016, Sci. Adv. 2, e1600377), of solar colour, measured at the
//! ground: the atmosphere does not dim it again. Away from the zenith it is
//!
//! ```text
//! A [1 + 2.2 (X - 1) D(az)]      X = (1 - 0.96 sin^2 z)^(-1/2)
//! D = 1 - sum s + sum s (1 + cos(az - az_i))^2 / 1.5
//! ```
//!
//! Measured: lines of mercury and sodium over Kitt Peak are 2.8 to 3.2 times stronger 60 deg from the zenith, mean of four
//! azimuths, 4.4 to 5.2 times towards Tucson and 1.7 to 2.4 times away from it (spectra of Neugent & Massey 2010, PASP 122,
//! 1246). The form gives 2.96 at 60 deg and stays finite at the horizon (9.8); single-scattering theory (Kocifaj, Bara &
//! Falchi 2022, MNRAS 513, L25) gives 3.1 to 3.4 and 5 to 6 at 60 and 70 deg. Each dome s of `station.light_domes` is a
//! town's share of the light; D is 1 in the mean over azimuth. Uncertainty: a factor of 1.5.

use super::krisciunas_schaefer::scattering_airmass;
use super::{Context, Field, Source, Toward};
use crate::base::ledger::Why;
use crate::base::surface_brightness::Luminance;

/// Growth with the scattering path.
const PER_AIRMASS: f64 = 2.2;

/// Light pollution of a frame.
pub struct Pollution<'a> {
    context: &'a Context<'a>,
    zenith_electrons: f64,
}

/// Brightness relative to the zenith; `domes` are azimuth \[deg\] and share of towns.
pub fn relative(zenith_distance: f64, azimuth: f64, domes: &[[f64; 2]]) -> f64 {
    let town = |[az, share]: &[f64; 2]| {
        let toward = 1.0 + (azimuth - az.to_radians()).cos();
        share * (toward * toward / 1.5 - 1.0)
    };
    let direction = 1.0 + domes.iter().map(town).sum::<f64>();
    1.0 + PER_AIRMASS * (scattering_airmass(zenith_distance) - 1.0) * direction
}

impl<'a> Pollution<'a> {
    /// The light pollution of a frame.
    pub fn new(context: &'a Context<'a>) -> Self {
        let artificial = Luminance(context.response.artificial_mcd_m2);
        Self { context, zenith_electrons: context.electrons_at_ground(artificial.into()) }
    }
}

impl Source for Pollution<'_> {
    fn name(&self) -> &'static str {
        "sky.pollution"
    }

    fn keyword(&self) -> &'static str {
        "SKYPOLL"
    }

    fn basis(&self) -> String {
        let luminance = self.context.response.artificial_mcd_m2;
        let domes = match self.context.scene.station.light_domes.len() {
            0 => String::new(),
            number => format!(", {number} domes"),
        };
        format!(
            "artificial zenith {luminance} mcd/m^2{domes}, growth measured at Kitt Peak (Neugent & Massey 2010)"
        )
    }

    fn absent(&self, _: &Field) -> Option<Why> {
        let none = self.context.response.artificial_mcd_m2 <= 0.0;
        none.then(|| Why::NotVisible("no artificial light at the station".into()))
    }

    fn mean(&self, toward: &Toward) -> f64 {
        let domes = &self.context.scene.station.light_domes;
        self.zenith_electrons * relative(toward.zenith_distance, toward.azimuth, domes)
    }

    fn uncertainty(&self) -> f64 {
        0.5
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// Mercury and sodium lines in the spectra of Neugent & Massey 2010, 60 deg from the zenith.
    #[test]
    fn growth_is_that_measured_at_kitt_peak() {
        let z = 60f64.to_radians();
        assert!((2.8..3.2).contains(&relative(z, 0.0, &[])));
        let tucson = [[60.0, 0.6]];
        assert!((4.4..5.2).contains(&relative(z, 60f64.to_radians(), &tucson)));
        assert!((1.7..2.4).contains(&relative(z, 240f64.to_radians(), &tucson)));
    }

    #[test]
    fn domes_move_light_about_and_add_none() {
        let domes = [[30.0, 0.5], [200.0, 0.3]];
        for z in [0.0, 0.7, 1.5, 1.57] {
            let mean: f64 = (0..360).map(|k| relative(z, TAU * f64::from(k) / 360.0, &domes)).sum::<f64>() / 360.0;
            assert!((mean / relative(z, 0.0, &[]) - 1.0).abs() < 1e-9, "{z}: {mean}");
            let darkest = (0..360).map(|k| relative(z, TAU * f64::from(k) / 360.0, &[[0.0, 1.0]]));
            assert!(darkest.fold(f64::INFINITY, f64::min) >= 1.0 - 1e-12);
        }
        assert_eq!(relative(0.0, 1.0, &domes), 1.0);
    }
}
