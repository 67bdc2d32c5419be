//! From a spectrum to electrons: collecting area, optics, filter, detector, atmosphere.

use super::atlas::AtlasError;
use super::atmosphere::{Atmosphere, MAG_PER_DEPTH};
use super::curve::{Curve, CurveError, quadrature};
use super::integrand::Integrand;
use super::tables::{self, Kind};
use super::tabulated::Tabulated;
use crate::base::constants::{LIGHT_M_S, PLANCK_J_S};
use crate::scene::{Scene, Table};
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
    /// The atlas of artificial light cannot be used.
    #[error("station.light_atlas: {0}")]
    Atlas(#[from] AtlasError),
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
    /// The air above the station.
    pub atmosphere: Atmosphere,
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
        let station = &scene.station;
        let extinction = if station.extinction == Table::Named("computed".into()) {
            Atmosphere::computed(station)
        } else {
            curve("station.extinction", Kind::Extinction, &station.extinction)?
        };
        let throughput = Self {
            area_m2: PI / 4.0 * (outer * outer - inner * inner),
            optics: scene.telescope.throughput,
            filter: curve("telescope.filter", Kind::Filter, &scene.telescope.filter)?,
            qe: curve("detector.qe", Kind::Qe, &scene.detector.qe)?,
            atmosphere: Atmosphere::new(station, extinction),
        };
        if throughput.electrons_per_s(&tables::sun(), 0.0) > 0.0 {
            Ok(throughput)
        } else {
            Err(ThroughputError::Dark)
        }
    }

    /// A typical instrument behind a built-in filter (none for another name): 1 m^2, the KAF-16803 estimate, Kitt Peak air. It
    /// serves colours, not rates.
    pub fn typical(filter: &str) -> Self {
        let named = |kind, name: &str| {
            tables::curve(kind, &Table::Named(name.into())).unwrap_or_else(|_| Curve::constant(1.0))
        };
        Self {
            area_m2: 1.0,
            optics: 1.0,
            filter: named(Kind::Filter, filter),
            qe: named(Kind::Qe, "kaf16803"),
            atmosphere: Atmosphere::over(780.0, named(Kind::Extinction, "kpno")),
        }
    }

    /// A detector of QE 1 and 1 m^2 behind a passband, under the same air: for photon rates and magnitudes in that band.
    #[must_use]
    pub fn ideal(&self, passband: Curve) -> Self {
        Self { area_m2: 1.0, optics: 1.0, filter: passband, qe: Curve::constant(1.0), ..self.clone() }
    }

    /// A spectrum \[W m^-2 nm^-1\] (per steradian for a radiance) through this instrument, made ready for many factors and
    /// airmasses.
    pub fn integrand(&self, spectrum: &Curve) -> Integrand {
        let extinction = self.atmosphere.extinction();
        let photons = self.area_m2 * self.optics * 1e-9 / (PLANCK_J_S * LIGHT_M_S);
        let nodes = quadrature(&[spectrum, &self.filter, &self.qe, extinction]);
        let electrons = nodes
            .iter()
            .map(|(nm, w)| photons * w * nm * spectrum.at(*nm) * self.filter.at(*nm) * self.qe.at(*nm))
            .collect();
        let nm = nodes.iter().map(|(nm, _)| *nm).collect::<Vec<_>>();
        let depth = nm.iter().map(|nm| extinction.at(*nm) / MAG_PER_DEPTH).collect();
        Integrand { nm, electrons, depth }
    }

    /// Electrons per second from a spectrum \[W m^-2 nm^-1\] (per steradian from a radiance), dimmed by
    /// `airmass` airmasses; 0 for light measured at the ground.
    pub fn electrons_per_s(&self, spectrum: &Curve, airmass: f64) -> f64 {
        let extinction = self.atmosphere.extinction();
        self.integrand(spectrum).through(|nm| (-extinction.at(nm) / MAG_PER_DEPTH * airmass).exp())
    }

    /// The rate of a spectrum as a function of airmass.
    pub fn rate(&self, spectrum: &Curve) -> Tabulated {
        self.integrand(spectrum).tabulate(&[&|_| 1.0]).remove(0)
    }

    /// V magnitude of a source of this spectrum that gives one electron per second at `airmass`; negative infinity for a
    /// spectrum that gives none.
    pub fn zero_point(&self, spectrum: &Curve, airmass: f64) -> f64 {
        tables::magnitude_v(spectrum) + 2.5 * self.electrons_per_s(spectrum, airmass).log10()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::units::flux_from_mag;

    fn throughput(qe: &str) -> Throughput {
        let sets = [("telescope.throughput".to_owned(), "1.0".to_owned()), ("detector.qe".into(), qe.into())];
        let scene = crate::scene::load("pogs-geo", &crate::scene::Options { sets: &sets, seed: None });
        Throughput::of(&scene.expect("a scene")).expect("tables")
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
