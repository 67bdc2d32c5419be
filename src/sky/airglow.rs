//! Airglow: light of the upper atmosphere.
//!
//! Zenith spectrum: the table of Krag 2003 (V 22.3 mag/arcsec^2), 320-800 nm; light beyond 800 nm, where OH bands
//! are strong, is not in the table and not in the frame. It comes from a layer at 90 km, seen the longer the
//! lower (van Rhijn): V(z) = \[1 - (R sin z / (R + h))^2\]^(-1/2). Scattering removes light from the line of sight
//! and brings as much from elsewhere; the effective airmass of the extinction is 1.669 log10 V - 0.146 (Noll et
//! al. 2012, A&A 543, A92, eqs 23-25, Rayleigh). Uncertainty: the airglow itself varies by a factor of two.

use super::{Context, Source, Toward};
use crate::base::ledger::Verdict;
use crate::light::tables;

/// Height of the emitting layer over the radius of the Earth (OH at 87 km, OI 557.7 nm at 97 km; R = 6371 km).
const LAYER: f64 = 90.0 / 6371.0;

/// Airglow of a frame.
pub struct Airglow<'a> {
    context: &'a Context<'a>,
    rate: crate::light::throughput::RateAtAirmass,
}

/// Path through a thin layer towards zenith distance `z` \[rad\], relative to the zenith. Below the horizon the
/// horizon's value, 5.9.
pub fn van_rhijn(zenith_distance: f64) -> f64 {
    let s = zenith_distance.min(std::f64::consts::FRAC_PI_2).sin() / (1.0 + LAYER);
    1.0 / (1.0 - s * s).sqrt()
}

/// Effective airmass of the extinction of a layer whose path is `layer` (Noll et al. 2012, eq. 24).
fn effective_airmass(layer: f64) -> f64 {
    1.669 * layer.log10() - 0.146
}

impl<'a> Airglow<'a> {
    /// The airglow of a frame.
    pub fn new(context: &'a Context<'a>) -> Self {
        // the table is per metre of wavelength; spectra are per nanometre
        let spectrum = tables::airglow().scaled(1e-9);
        Self { context, rate: context.throughput.rate(&spectrum) }
    }

    fn electrons(&self, zenith_distance: f64) -> f64 {
        let layer = van_rhijn(zenith_distance);
        self.rate.at(effective_airmass(layer)) * layer * self.context.pixel_sr * self.context.view.exposure_s
    }
}

impl Source for Airglow<'_> {
    fn name(&self) -> &'static str {
        "sky.airglow"
    }

    fn keyword(&self) -> &'static str {
        "SKYAIRG"
    }

    fn basis(&self) -> String {
        "Krag 2003 spectrum, layer at 90 km, effective extinction (Noll 2012)".into()
    }

    fn assess(&self) -> Verdict {
        Verdict::Needed { bound: self.electrons(std::f64::consts::FRAC_PI_2 - self.context.view.centre.elevation) }
    }

    fn mean(&self, toward: &Toward) -> f64 {
        self.electrons(toward.zenith_distance)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Published layer airmasses for 87 and 97 km bracket the one of 90 km.
    #[test]
    fn the_layer_is_longer_lower_down_but_finite() {
        for (z, low, high) in [(0.0f64, 1.0, 1.0), (60.0, 1.91626, 1.92425), (75.0, 3.2485, 3.29768)] {
            let v = van_rhijn(z.to_radians());
            assert!(v >= low - 1e-9 && v <= high + 1e-9, "{z}: {v}");
        }
        assert!(van_rhijn(1.6) < 6.1 && van_rhijn(3.0) < 6.1);
    }
}
