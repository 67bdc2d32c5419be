//! The clear air: how much light a column removes, and what removes it.
//!
//! ```text
//! tau_R = 0.002152 (1.0455996 - 341.29061 l^-2 - 0.9023085 l^2) / (1 + 0.0027059889 l^-2 - 85.968563 l^2)
//!         x p / 1013.25 hPa                                                    l in um
//! tau_O = k_O3(l) x 300 Dobson units
//! tau_A = tau_A(550 nm) (l / 0.55)^-1.3
//! k     = 1.0857 (tau_R + tau_O + tau_A)                                      mag/airmass
//! ```
//!
//! tau_R: Bodhaine et al. 1999, J. Atmos. Oceanic Technol. 16, 1854, eq. 30. The measured curves (`kpno`, `ctio`, `krag2003`, a
//! user's CSV) are kept as they are and split: first the molecules' share from the pressure, then ozone, the rest is aerosol.
//! `computed` builds the curve from the parts, with tau_A(550 nm) = 0.05 at 2 km and 0.15 at sea level, e-folding in
//! 1.8 km: clear continental air (Shettle & Fenn 1979 rural, visibility 50 km); good to a factor of two from night to
//! night. Water and oxygen bands beyond 680 nm are not in any of them.

use super::curve::Curve;
use crate::astro::observer::standard_pressure_hpa;
use crate::scene::Station;

/// Magnitudes in one unit of optical depth: 2.5 log10 e.
pub const MAG_PER_DEPTH: f64 = 1.085_736_204_758_129_6;

/// Column of ozone \[cm at 0 deg C and 1 atm\]: 300 Dobson units, the mean of middle latitudes.
const OZONE_CM: f64 = 0.3;

/// Aerosol optical depth at 550 nm at sea level, and the height in which it falls by e \[m\].
const AEROSOL_AT_SEA: f64 = 0.15;
const AEROSOL_HEIGHT_M: f64 = 1800.0;

/// Exponent of the aerosol's optical depth (Angstrom).
const ANGSTROM: f64 = -1.3;

/// Wavelengths of the computed curve: first, last, step \[nm\].
const COMPUTED_NM: (usize, usize, usize) = (300, 1200, 5);

const OZONE: &str = include_str!("../../catalogs/extinction/ozone.csv");

/// The air above a station.
#[derive(Debug, Clone)]
pub struct Atmosphere {
    extinction: Curve,
    ozone: Curve,
    pressure_hpa: f64,
}

/// Vertical optical depths at one wavelength.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Depths {
    /// Molecules, scattering.
    pub rayleigh: f64,
    /// Aerosol, scattering and a little absorption.
    pub aerosol: f64,
    /// Ozone, absorption.
    pub ozone: f64,
}

impl Depths {
    /// All together.
    pub fn total(&self) -> f64 {
        self.rayleigh + self.aerosol + self.ozone
    }
}

/// Rayleigh optical depth of a column of `pressure_hpa` at `nm`, 200 to 4000 nm.
pub fn rayleigh_depth(nm: f64, pressure_hpa: f64) -> f64 {
    let l2 = (nm * 1e-3).powi(2);
    let depth = 0.002_152_0 * (1.045_599_6 - 341.290_61 / l2 - 0.902_308_50 * l2)
        / (1.0 + 0.002_705_988_9 / l2 - 85.968_563 * l2);
    depth * pressure_hpa / 1013.25
}

/// Absorption coefficient of ozone \[1 / cm at 0 deg C and 1 atm\] against wavelength.
fn ozone() -> Curve {
    Curve::parse(OZONE, "ozone").unwrap_or_else(|_| Curve::constant(0.0))
}

impl Atmosphere {
    /// The air above `station`, with its extinction curve \[mag/airmass\].
    pub fn new(station: &Station, extinction: Curve) -> Self {
        Self::over(pressure(station), extinction)
    }

    /// The air of a pressure at the ground, with its extinction curve \[mag/airmass\].
    pub fn over(pressure_hpa: f64, extinction: Curve) -> Self {
        Self { extinction, ozone: ozone(), pressure_hpa }
    }

    /// The curve built from pressure, ozone and the aerosol of the station's height \[mag/airmass\].
    pub fn computed(station: &Station) -> Curve {
        let (first, last, step) = COMPUTED_NM;
        let (pressure, ozone) = (pressure(station), ozone());
        let aerosol = AEROSOL_AT_SEA * (-station.height_m.max(0.0) / AEROSOL_HEIGHT_M).exp();
        let depth = |nm: f64| {
            rayleigh_depth(nm, pressure) + ozone.at(nm) * OZONE_CM + aerosol * (nm / 550.0).powf(ANGSTROM)
        };
        let points = (first..=last).step_by(step).map(|nm| (nm as f64, MAG_PER_DEPTH * depth(nm as f64)));
        Curve::of(points).held()
    }

    /// Extinction \[mag/airmass\].
    pub fn extinction(&self) -> &Curve {
        &self.extinction
    }

    /// What the extinction at `nm` is made of; the parts are never negative and sum to it.
    pub fn depths(&self, nm: f64) -> Depths {
        let total = (self.extinction.at(nm) / MAG_PER_DEPTH).max(0.0);
        let rayleigh = rayleigh_depth(nm, self.pressure_hpa).min(total);
        let ozone = (self.ozone.at(nm) * OZONE_CM).min(total - rayleigh);
        Depths { rayleigh, ozone, aerosol: total - rayleigh - ozone }
    }
}

/// The station's pressure; where it is 0 to switch refraction off, that of the standard atmosphere at its height.
fn pressure(station: &Station) -> f64 {
    if station.pressure_hpa > 0.0 { station.pressure_hpa } else { standard_pressure_hpa(station.height_m) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::tables::{Kind, curve};
    use crate::scene::{Options, Table, load};

    fn station() -> Station {
        load("pogs-geo", &Options { sets: &[], seed: None }).expect("a scene").station
    }

    /// Bodhaine et al. 1999, J. Atmos. Oceanic Technol. 16, 1854, table 4: optical depth at 1013.25 hPa, 45 deg latitude.
    #[test]
    fn rayleigh_depths_as_tabulated() {
        for (nm, depth) in [(350.0, 0.6303), (400.0, 0.3602), (550.0, 0.0971), (700.0, 0.0364), (1000.0, 0.0086)] {
            assert!((rayleigh_depth(nm, 1013.25) / depth - 1.0).abs() < 0.006, "{nm} nm");
        }
    }

    #[test]
    fn the_parts_sum_to_the_measured_curve() {
        for name in ["kpno", "ctio", "krag2003"] {
            let measured = curve(Kind::Extinction, &Table::Named(name.into())).expect("built in");
            let air = Atmosphere::new(&station(), measured.clone());
            for nm in [320.0, 400.0, 550.0, 600.0, 800.0, 1050.0] {
                let d = air.depths(nm);
                assert!((d.total() * MAG_PER_DEPTH - measured.at(nm)).abs() < 1e-12);
                assert!(d.rayleigh >= 0.0 && d.aerosol >= 0.0 && d.ozone >= 0.0, "{name} {nm}: {d:?}");
            }
        }
    }

    /// Over Kitt Peak the parts explain the measured curve within 0.05 mag from 350 to 800 nm.
    #[test]
    fn the_computed_curve_is_near_the_measured_one() {
        let kitt_peak = Station { height_m: 2096.0, pressure_hpa: 0.0, ..station() };
        let computed = Atmosphere::computed(&kitt_peak);
        let measured = curve(Kind::Extinction, &Table::Named("kpno".into())).expect("built in");
        for nm in [350.0, 400.0, 450.0, 500.0, 550.0, 600.0, 700.0, 800.0] {
            let off = computed.at(nm) - measured.at(nm);
            assert!(off.abs() < 0.05, "{nm} nm: {off} mag");
        }
    }

    #[test]
    fn less_air_removes_less_light() {
        let at = |height_m| Atmosphere::computed(&Station { height_m, pressure_hpa: 0.0, ..station() });
        for nm in [300.0, 450.0, 900.0, 1500.0] {
            assert!(at(0.0).at(nm) > at(2000.0).at(nm) && at(2000.0).at(nm) > at(5000.0).at(nm));
            assert!(at(100_000.0).at(nm) >= 0.0);
        }
    }
}
