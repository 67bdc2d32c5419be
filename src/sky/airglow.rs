//! Airglow: light of the upper atmosphere.
//!
//! Zenith spectrum, default `palace`: continuum of HO2, FeO and O2 from PALACE v1.0 (Noll et al. 2025, Geosci. Model Dev. 18,
//! 4353), continuum beyond 650 nm from Noll et al. 2012 (A&A 543, A92), lines of O, N and Na, bands of O2 and OH
//! (`catalogs/airglow`); 300-1124 nm, the OH bands an estimate to 20 % in the sum. Each emitter follows the solar flux F10.7
//! by its own line (Noll et al. 2012, table 5 and PALACE). `krag`: the table of Krag 2003, 320-800 nm, V 22.29 mag/arcsec^2,
//! one layer at 90 km, no solar activity; what lies beyond 800 nm is missing.
//!
//! Each emitter is a thin layer at its own height h, seen the longer the lower (van Rhijn 1921):
//! V(z) = \[1 - (R sin z / (R + h))^2\]^(-1/2). Scattering removes light from the line of sight and brings as much from
//! elsewhere: with X = (1 - 0.972 sin^2 z)^(-1/2) the depths of molecules and aerosol count X (1.669 log10 X - 0.146) and
//! X (1.732 log10 X - 0.318) times (Noll et al. 2012, eqs 23-25, fitted to 60 deg from the zenith), and ozone absorbs over
//! its path at 25 km. Uncertainty: 0.3 (1 sigma of the night
//! to night variation, Noll et al. 2012).

use super::{Context, Field, Source, Toward};
use crate::base::constants::{LIGHT_M_S, PLANCK_J_S};
use crate::base::ledger::Why;
use crate::light::curve::Curve;
use crate::light::tables;
use crate::light::tabulated::Tabulated;
use crate::light::throughput::Throughput;
use std::f64::consts::{FRAC_PI_2, PI};

/// Mean radius of the Earth \[km\].
const EARTH_KM: f64 = 6371.0;

/// Height of Krag's one layer \[km\].
const KRAG_KM: f64 = 90.0;

/// Height of the ozone \[km\].
pub const OZONE_KM: f64 = 25.0;

/// Photons per second, square metre and steradian of one rayleigh (Hunten et al. 1956: 1e6 / 4 pi per cm^2).
const RAYLEIGH: f64 = 1e10 / (4.0 * PI);

/// Half the width of a feature's edges \[nm\].
const EDGE_NM: f64 = 0.02;

/// Zenith distances at which the rate is tabulated \[rad\].
static NODES: [f64; 19] = {
    const DEG: f64 = PI / 180.0;
    [
        0.0,
        10.0 * DEG,
        20.0 * DEG,
        30.0 * DEG,
        40.0 * DEG,
        45.0 * DEG,
        50.0 * DEG,
        55.0 * DEG,
        60.0 * DEG,
        65.0 * DEG,
        70.0 * DEG,
        74.0 * DEG,
        77.0 * DEG,
        80.0 * DEG,
        82.0 * DEG,
        84.0 * DEG,
        86.0 * DEG,
        88.0 * DEG,
        90.0 * DEG,
    ]
};

/// Effective share of the depth of molecules and of aerosol against log10 X: slope, offset (Noll et al. 2012, eqs 24, 25).
const EFFECTIVE: [(f64, f64); 2] = [(1.6693, 0.1460), (1.7320, 0.3175)];

const CONTINUUM: &str = include_str!("../../catalogs/airglow/palace_continuum.csv");
const FEATURES: &str = include_str!("../../catalogs/airglow/features.csv");

/// Emitters of the continuum: column, layer \[km\], relative change per 100 sfu about the table's flux (PALACE; red: Noll
/// 2012), that flux.
const EMITTERS: [(usize, f64, f64, f64); 4] =
    [(1, 81.0, 0.05, 100.0), (2, 88.0, 0.08, 100.0), (3, 94.0, 0.38, 100.0), (4, 90.0, 0.61, 129.0)];

/// Light of one layer at the zenith \[W m^-2 nm^-1 sr^-1\].
#[derive(Debug, Clone)]
pub struct Layer {
    /// Height \[km\].
    pub height_km: f64,
    /// Spectrum.
    pub spectrum: Curve,
}

/// Path through a thin layer `height_km` high towards zenith distance `z` \[rad\], relative to the zenith. Below the
/// horizon the horizon's value.
pub fn van_rhijn(zenith_distance: f64, height_km: f64) -> f64 {
    let s = zenith_distance.min(FRAC_PI_2).sin() * EARTH_KM / (EARTH_KM + height_km);
    1.0 / (1.0 - s * s).sqrt()
}

/// The layers of the default model at solar flux `f107_sfu`.
pub fn palace(f107_sfu: f64) -> Vec<Layer> {
    let numbers = |text: &'static str| {
        let lines = text.lines().filter(|l| !l.starts_with('#')).skip(1);
        lines.map(|l| l.split(',').map(|v| v.parse::<f64>().unwrap_or(0.0)).collect::<Vec<_>>())
    };
    let mut layers = Vec::new();
    for (column, height_km, per_100_sfu, reference) in EMITTERS {
        let factor = (1.0 + per_100_sfu * (f107_sfu - reference) / 100.0).max(0.0);
        let points = numbers(CONTINUUM).map(|row| (row[0], radiance(row[0], row[column] * factor)));
        layers.push(Layer { height_km, spectrum: Curve::of(points) });
    }
    for row in numbers(FEATURES) {
        let [first, last, rayleigh, height_km, constant, slope, reference] =
            [row[1], row[2], row[3], row[4], row[5], row[6], row[7]];
        let solar = ((constant + slope * f107_sfu) / (constant + slope * reference)).max(0.0);
        let height = rayleigh * solar / (last - first);
        let corners =
            [(first - EDGE_NM, 0.0), (first + EDGE_NM, 1.0), (last - EDGE_NM, 1.0), (last + EDGE_NM, 0.0)];
        let spectrum = Curve::of(corners.map(|(nm, share)| (nm, radiance(nm, height * share))));
        layers.push(Layer { height_km, spectrum });
    }
    layers
}

/// The one layer of Krag's table.
pub fn krag() -> Layer {
    // the table is per metre of wavelength; spectra are per nanometre
    Layer { height_km: KRAG_KM, spectrum: tables::airglow().scaled(1e-9) }
}

/// Radiance \[W m^-2 nm^-1 sr^-1\] of so many rayleigh per nm.
fn radiance(nm: f64, rayleigh_per_nm: f64) -> f64 {
    rayleigh_per_nm * RAYLEIGH * PLANCK_J_S * LIGHT_M_S / (nm * 1e-9)
}

/// The spectra of all layers together.
pub fn sum(layers: &[Layer]) -> Curve {
    let mut grid = layers.iter().flat_map(|l| l.spectrum.wavelengths().iter().copied()).collect::<Vec<_>>();
    grid.sort_by(f64::total_cmp);
    grid.dedup();
    Curve::of(grid.into_iter().map(|nm| (nm, layers.iter().map(|l| l.spectrum.at(nm)).sum())))
}

/// Airglow through one instrument.
#[derive(Debug, Clone)]
pub struct Rates {
    /// Spectrum at the zenith without atmosphere \[W m^-2 nm^-1 sr^-1\].
    pub spectrum: Curve,
    /// Electrons per second and steradian against zenith distance.
    rate: Tabulated,
    basis: String,
}

impl Rates {
    /// Of the default model.
    pub fn palace(throughput: &Throughput, f107_sfu: f64) -> Self {
        let basis = format!("PALACE (Noll 2025) continuum and lines, OH bands estimated, F10.7 = {f107_sfu} sfu");
        Self::of(throughput, &palace(f107_sfu), basis)
    }

    /// Of Krag's table.
    pub fn krag(throughput: &Throughput) -> Self {
        Self::of(throughput, &[krag()], "Krag 2003 spectrum to 800 nm, layer at 90 km".into())
    }

    fn of(throughput: &Throughput, layers: &[Layer], basis: String) -> Self {
        let mut rate = vec![0.0; NODES.len()];
        let mut heights = layers.iter().map(|l| l.height_km).collect::<Vec<_>>();
        heights.sort_by(f64::total_cmp);
        heights.dedup();
        for height in heights {
            let own = layers.iter().filter(|l| l.height_km == height).cloned().collect::<Vec<_>>();
            let integrand = throughput.integrand(&sum(&own));
            let depths = integrand.nm.iter().map(|nm| throughput.atmosphere.depths(*nm)).collect::<Vec<_>>();
            for (value, z) in rate.iter_mut().zip(NODES) {
                let path = van_rhijn(z, height);
                let x = 1.0 / (1.0 - 0.972 * z.sin().powi(2)).sqrt();
                let [molecules, aerosol] = EFFECTIVE.map(|(slope, offset)| x * (slope * x.log10() - offset));
                let ozone = van_rhijn(z, OZONE_KM);
                let kept = depths
                    .iter()
                    .map(|d| (-(d.rayleigh * molecules + d.aerosol * aerosol + d.ozone * ozone)).exp());
                *value += path * integrand.electrons.iter().zip(kept).map(|(e, k)| e * k).sum::<f64>();
            }
        }
        Self { spectrum: sum(layers), rate: Tabulated::new(&NODES, rate), basis }
    }
}

/// Airglow of a frame.
pub struct Airglow<'a> {
    context: &'a Context<'a>,
}

impl<'a> Airglow<'a> {
    /// The airglow of a frame.
    pub fn new(context: &'a Context<'a>) -> Self {
        Self { context }
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
        format!("{}, effective extinction (Noll 2012)", self.context.response.airglow.basis)
    }

    fn absent(&self, _: &Field) -> Option<Why> {
        None
    }

    fn mean(&self, toward: &Toward) -> f64 {
        self.context.response.airglow.rate.at(toward.zenith_distance.abs()) * self.context.per_steradian()
    }

    fn uncertainty(&self) -> f64 {
        0.3
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::units::ARCSEC_PER_RAD;

    /// van Rhijn factors for 87, 97 and 250 km with R = 6371 km.
    #[test]
    fn the_layer_is_longer_lower_down_but_finite() {
        for (z, expected) in [
            (0.0f64, [1.0, 1.0, 1.0]),
            (30.0, [1.14958, 1.14901, 1.1407]),
            (60.0, [1.92425, 1.91626, 1.80903]),
            (75.0, [3.29768, 3.2485, 2.71048]),
            (85.0, [5.41097, 5.18902, 3.51094]),
            (90.0, [6.11283, 5.79587, 3.6738]),
        ] {
            for (height, known) in [87.0, 97.0, 250.0].into_iter().zip(expected) {
                assert!((van_rhijn(z.to_radians(), height) / known - 1.0).abs() < 1e-5, "{z} {height}");
            }
        }
        assert!(van_rhijn(3.0, 87.0) < 6.2);
    }

    fn surface_brightness(spectrum: &Curve, band: &str) -> f64 {
        tables::magnitude(spectrum, &tables::passband(band)) + 5.0 * ARCSEC_PER_RAD.log10()
    }

    /// V at the zenith without atmosphere: Krag 22.29, PALACE 22.51 at 100 sfu with its own three lines.
    #[test]
    fn published_spectra_have_their_published_brightness() {
        let krag = surface_brightness(&krag().spectrum, "V");
        assert!((krag - 22.29).abs() < 0.005, "{krag}");
        let layers = palace(100.0);
        let published = layers.iter().take(3).chain(layers.iter().skip(4).take(3)).cloned().collect::<Vec<_>>();
        let palace = surface_brightness(&sum(&published), "V");
        assert!((palace - 22.51).abs() < 0.01, "{palace}");
    }

    #[test]
    fn more_sun_is_more_light_and_none_is_not_negative() {
        let v = |f107| surface_brightness(&sum(&palace(f107)), "V");
        assert!(v(200.0) < v(130.0) && v(130.0) < v(70.0));
        assert!(sum(&palace(0.0)).wavelengths().iter().all(|nm| sum(&palace(0.0)).at(*nm) >= 0.0));
    }
}
