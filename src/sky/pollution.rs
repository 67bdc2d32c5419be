//! Light pollution: artificial light scattered by the air.
//!
//! The station's artificial zenith luminance A \[mcd/m^2\] (the artificial part alone) is
//! -2.5 log10(A / 1.08e8) V mag/arcsec^2 (Falchi et al. 2016, Sci. Adv. 2, e1600377), of solar colour, measured at the
//! ground: the atmosphere does not dim it again. It grows towards the horizon with the path of scattering air, here
//! X = (1 - 0.96 sin^2 z)^(-1/2) (Krisciunas & Schaefer 1991, eq. 3), which stays finite. Domes over towns are left
//! out. Uncertainty: a factor of two.

use super::moonlight::scattering_airmass;
use super::{Context, Source, Toward};
use crate::base::ledger::{Verdict, Why};
use crate::base::surface_brightness::Luminance;

/// Light pollution of a frame.
pub struct Pollution<'a> {
    context: &'a Context<'a>,
    zenith_electrons: f64,
}

impl<'a> Pollution<'a> {
    /// The light pollution of a frame.
    pub fn new(context: &'a Context<'a>) -> Self {
        let artificial = Luminance(context.scene.station.artificial_zenith_mcd_m2);
        Self { context, zenith_electrons: context.electrons_at_ground(artificial.into()) }
    }

    fn electrons(&self, zenith_distance: f64) -> f64 {
        self.zenith_electrons * scattering_airmass(zenith_distance)
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
        let luminance = self.context.scene.station.artificial_zenith_mcd_m2;
        format!("artificial zenith {luminance} mcd/m^2, growing with the scattering path")
    }

    fn assess(&self) -> Verdict {
        if self.context.scene.station.artificial_zenith_mcd_m2 <= 0.0 {
            return Verdict::Absent(Why::NotVisible("station.artificial_zenith_mcd_m2 = 0".into()));
        }
        Verdict::Needed { bound: self.electrons(std::f64::consts::FRAC_PI_2 - self.context.view.centre.elevation) }
    }

    fn mean(&self, toward: &Toward) -> f64 {
        self.electrons(toward.zenith_distance)
    }
}
