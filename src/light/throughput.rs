//! From a spectrum to electrons: collecting area, optics, filter, detector, atmosphere.

use super::curve::{Curve, CurveError, quadrature};
use super::tables::{self, Kind};
use crate::base::constants::{LIGHT_M_S, PLANCK_J_S};
use crate::base::nodes::bracket;
use crate::scene::Scene;
use std::f64::consts::PI;

/// What can be wrong with a throughput.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ThroughputError {
    /// A table cannot be used.
    #[error("{key}: {source}")]
    Table {
        /// The scene's key that names it.
        key: &'static str,
        /// What is wrong.
        source: CurveError,
    },
    /// No light gets through.
    #[error("telescope.filter and detector.qe: together they pass no sunlight between 280 and 1100 nm")]
    Dark,
}

/// Everything between a photon above the atmosphere and an electron in a pixel.
#[derive(Debug, Clone)]
pub struct Throughput {
    /// Net collecting area \[m^2\], the central obstruction taken off.
    pub area_m2: f64,
    optics: f64,
    filter: Curve,
    qe: Curve,
    extinction: Curve,
}

/// The rate of electrons from one spectrum as a function of airmass: cubics in the logarithm between tabulated
/// airmasses, from -0.5 to 40; the values at the ends are held. [`Throughput::electrons_per_s`] is the reference twin.
#[derive(Debug, Clone, PartialEq)]
pub struct RateAtAirmass {
    log_rate: [f64; AIRMASSES.len()],
}

/// Where rates are tabulated: closer where they are curved and where telescopes look.
const AIRMASSES: [f64; 24] = [
    -0.5, -0.25, 0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 8.0, 10.0, 13.0,
    17.0, 22.0, 30.0, 40.0,
];

impl RateAtAirmass {
    /// Electrons per second (and steradian, for a radiance) at `airmass`.
    pub fn at(&self, airmass: f64) -> f64 {
        let (i, share) = bracket(&AIRMASSES, airmass);
        let x = AIRMASSES[i] + share * (AIRMASSES[i + 1] - AIRMASSES[i]);
        // Lagrange's cubic through the four nearest nodes
        let first = i.saturating_sub(1).min(AIRMASSES.len() - 4);
        let nodes = first..first + 4;
        let term = |k: usize| {
            let others = nodes.clone().filter(|j| *j != k);
            self.log_rate[k] * others.map(|j| (x - AIRMASSES[j]) / (AIRMASSES[k] - AIRMASSES[j])).product::<f64>()
        };
        nodes.clone().map(term).sum::<f64>().exp()
    }
}

impl Throughput {
    /// The throughput of a scene's telescope, filter, detector and atmosphere.
    ///
    /// # Errors
    /// [`ThroughputError`] for a table that cannot be used, or tables that let no light through.
    pub fn of(scene: &Scene) -> Result<Self, ThroughputError> {
        let (outer, inner) = (scene.telescope.aperture_m, scene.telescope.obstruction_m);
        let curve =
            |key, kind, table| tables::curve(kind, table).map_err(|source| ThroughputError::Table { key, source });
        let throughput = Self {
            area_m2: PI / 4.0 * (outer * outer - inner * inner),
            optics: scene.telescope.throughput,
            filter: curve("telescope.filter", Kind::Filter, &scene.telescope.filter)?,
            qe: curve("detector.qe", Kind::Qe, &scene.detector.qe)?,
            extinction: curve("station.extinction", Kind::Extinction, &scene.station.extinction)?,
        };
        if throughput.electrons_per_s(&tables::sun(), 0.0) > 0.0 {
            Ok(throughput)
        } else {
            Err(ThroughputError::Dark)
        }
    }

    /// Electrons per second from a spectrum \[W m^-2 nm^-1\] (per steradian from a radiance), dimmed by
    /// `airmass` airmasses; 0 for light measured at the ground.
    pub fn electrons_per_s(&self, spectrum: &Curve, airmass: f64) -> f64 {
        let curves = [spectrum, &self.filter, &self.qe, &self.extinction];
        let sum: f64 = quadrature(&curves)
            .iter()
            .map(|(nm, weight)| {
                let dimmed = (-0.4 * std::f64::consts::LN_10 * self.extinction.at(*nm) * airmass).exp();
                weight * nm * 1e-9 * spectrum.at(*nm) * self.filter.at(*nm) * self.qe.at(*nm) * dimmed
            })
            .sum();
        self.area_m2 * self.optics * sum / (PLANCK_J_S * LIGHT_M_S)
    }

    /// The rate of a spectrum as a function of airmass.
    pub fn rate(&self, spectrum: &Curve) -> RateAtAirmass {
        let log = |airmass| self.electrons_per_s(spectrum, airmass).max(f64::MIN_POSITIVE).ln();
        RateAtAirmass { log_rate: AIRMASSES.map(log) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::units::flux_from_mag;
    use crate::scene::Table;

    fn throughput(qe: &str) -> Throughput {
        let curve = |kind, name: &str| tables::curve(kind, &Table::Named(name.into())).expect("built in");
        Throughput {
            area_m2: 0.0760,
            optics: 1.0,
            filter: Curve::constant(1.0),
            qe: curve(Kind::Qe, qe),
            extinction: curve(Kind::Extinction, "kpno"),
        }
    }

    /// Known answers for the Purdue station: V = 16 gives 331 e-/s with the net area, Krag's QE and KPNO air at
    /// the zenith, V = 8 about 8.7e5 e-/s with the KAF-16803 estimate at 45 deg.
    #[test]
    fn electrons_of_a_solar_star() {
        let star = tables::solar_of_v_zero();
        let krag = throughput("krag2003").electrons_per_s(&star, 1.0) * flux_from_mag(16.0);
        assert!((krag / 331.0 - 1.0).abs() < 0.01, "{krag}");
        let kaf = throughput("kaf16803").electrons_per_s(&star, 2f64.sqrt()) * flux_from_mag(8.0);
        assert!((kaf / 8.7e5 - 1.0).abs() < 0.03, "{kaf}");
    }

    #[test]
    fn the_table_follows_the_integral_down_to_the_horizon() {
        let (t, star) = (throughput("kaf16803"), tables::solar_of_v_zero());
        let rate = t.rate(&star);
        for (airmass, allowed) in [
            (-0.1, 1e-6),
            (0.9, 1e-6),
            (1.13, 1e-6),
            (1.9, 1e-6),
            (2.7, 1e-5),
            (4.4, 1e-5),
            (9.1, 1e-4),
            (26.0, 1e-3),
            (38.7, 1e-3),
        ] {
            let error = rate.at(airmass) / t.electrons_per_s(&star, airmass) - 1.0;
            assert!(error.abs() < allowed, "{airmass}: {error}");
        }
    }
}
