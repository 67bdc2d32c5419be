//! Zodiacal light: sunlight scattered by interplanetary dust.
//!
//! Against the Sun's ecliptic longitude and the ecliptic latitude: radiance at 500 nm of Leinert et al. 1998, A&AS 127, 1,
//! Table 17 (`leinert`, the default), or S10 of Roach 1972, AJ 77, 887, Table 1 (`roach`, 1.6 times brighter in the
//! median), interpolated by cubics in the logarithm whose first derivatives are continuous. Spectrum of `leinert`: the Sun's,
//! reddened by 1 + c log10(lambda / 500 nm) with c falling from 1.2 / 0.8 (below / above 500 nm) at 30 deg from the Sun
//! to 0.9 / 0.6 at 90 deg, linear between and held beyond (their eq. 22, valid 220 to 2500 nm); of `roach`: the Sun's.
//! Extinguished once, as a star's light. Blank cells of the tables, within 15 deg of the Sun, are the corona and outside
//! the model. Uncertainty: 10 % (Leinert et al., sect. 8.4); the yearly swing of the dust's plane, 10 %, is left out.

use super::{Context, Field, Source, Toward};
use crate::astro::{angles, separation};
use crate::base::cubic_grid::CubicGrid;
use crate::base::ledger::Why;
use crate::base::units::{ARCSEC, flux_from_mag};
use crate::light::tables;
use crate::light::tabulated::Tabulated;
use crate::light::throughput::Throughput;
use crate::stars::counts::DEG2_PER_SR;
use glam::{DMat3, DVec3};
use std::sync::LazyLock;

/// Mean obliquity of the ecliptic at J2000 \[rad\] (IAU 2006).
const OBLIQUITY: f64 = 84_381.406 * ARCSEC;

/// Wavelength of Leinert's table \[nm\].
const TABLE_NM: f64 = 500.0;

static LEINERT: LazyLock<CubicGrid> =
    LazyLock::new(|| parsed(include_str!("../../catalogs/zodiacal/leinert1998_table17.csv")));
static ROACH: LazyLock<CubicGrid> =
    LazyLock::new(|| parsed(include_str!("../../catalogs/zodiacal/roach1972.csv")));

/// Logarithms of a table whose columns are latitudes (`b30`) and whose rows begin with a longitude \[deg\].
fn parsed(text: &str) -> CubicGrid {
    let mut lines = text.lines().filter(|l| !l.starts_with('#'));
    let names = lines.next().unwrap_or_default().split(',');
    let latitudes = names.filter_map(|n| n.strip_prefix('b')?.parse().ok()).collect::<Vec<f64>>();
    let (mut longitudes, mut logs) = (vec![], vec![]);
    for line in lines {
        let mut values = line.split(',').map(|v| v.parse::<f64>().unwrap_or(f64::NAN));
        longitudes.push(values.next().unwrap_or(f64::NAN));
        logs.extend(values.chain(std::iter::repeat(f64::NAN)).take(latitudes.len()).map(f64::ln));
    }
    CubicGrid::new(longitudes, latitudes, logs)
}

/// Radiance at 500 nm \[W m^-2 sr^-1 nm^-1\] of Leinert's table; NaN in the corona. Longitude from the Sun 0 to 180 deg,
/// latitude 0 to 90 deg.
pub fn leinert(longitude_deg: f64, latitude_deg: f64) -> f64 {
    // 1e-8 W m^-2 sr^-1 um^-1
    LEINERT.at(longitude_deg, latitude_deg).exp() * 1e-11
}

/// S10 of V of Roach's table; NaN in the corona.
pub fn roach(longitude_deg: f64, latitude_deg: f64) -> f64 {
    ROACH.at(longitude_deg, latitude_deg).exp()
}

/// Slopes of the reddening below and above 500 nm at an elongation \[rad\].
fn reddening(elongation: f64) -> (f64, f64) {
    let between = ((elongation.to_degrees() - 30.0) / 60.0).clamp(0.0, 1.0);
    (1.2 - 0.3 * between, 0.8 - 0.2 * between)
}

/// Electrons per second and steradian against airmass.
#[derive(Debug, Clone)]
pub struct Rates {
    /// Of sunlight of 1 W m^-2 sr^-1 nm^-1 at 500 nm.
    sunlight: Tabulated,
    /// The same times -log10(lambda / 500 nm) below 500 nm.
    blue: Tabulated,
    /// The same times log10(lambda / 500 nm) above 500 nm.
    red: Tabulated,
}

impl Rates {
    /// The rates of an instrument.
    pub fn new(throughput: &Throughput) -> Self {
        let sun = tables::sun();
        let scale = 1.0 / sun.at(TABLE_NM);
        let one = |_: f64| scale;
        let blue = |nm: f64| scale * (-(nm / TABLE_NM).log10()).max(0.0);
        let red = |nm: f64| scale * (nm / TABLE_NM).log10().max(0.0);
        let mut rates = throughput.integrand(&sun).tabulate(&[&one, &blue, &red]);
        let (red, blue) = (rates.remove(2), rates.remove(1));
        Self { sunlight: rates.remove(0), blue, red }
    }
}

/// Ecliptic longitude and latitude \[rad\] of an ICRS direction (J2000 ecliptic; the frame bias of 20 mas is left out).
fn ecliptic(icrs: DVec3) -> (f64, f64) {
    angles(DMat3::from_rotation_x(-OBLIQUITY) * icrs)
}

/// Zodiacal light of a frame.
pub struct Zodiacal<'a> {
    context: &'a Context<'a>,
    sun_longitude: f64,
    roach: bool,
}

impl<'a> Zodiacal<'a> {
    /// By Leinert's table.
    pub fn leinert(context: &'a Context<'a>) -> Self {
        Self { context, sun_longitude: ecliptic(context.now.sun.direction).0, roach: false }
    }

    /// By Roach's table.
    pub fn roach(context: &'a Context<'a>) -> Self {
        Self { roach: true, ..Self::leinert(context) }
    }
}

impl Source for Zodiacal<'_> {
    fn name(&self) -> &'static str {
        "sky.zodiacal"
    }

    fn keyword(&self) -> &'static str {
        "SKYZODI"
    }

    fn basis(&self) -> String {
        match self.roach {
            true => "Roach 1972, solar colour".into(),
            false => "Leinert 1998, Table 17, reddened sunlight".into(),
        }
    }

    fn absent(&self, field: &Field) -> Option<Why> {
        let elongation = separation(field.centre().icrs, self.context.now.sun.direction).to_degrees();
        field
            .samples
            .iter()
            .any(|t| self.mean(t).is_nan())
            .then(|| Why::OutsideModel(format!("corona, {elongation:.1} deg from the Sun")))
    }

    fn mean(&self, toward: &Toward) -> f64 {
        let (longitude, latitude) = ecliptic(toward.icrs);
        let from_sun = (longitude - self.sun_longitude).to_degrees().rem_euclid(360.0);
        let (longitude, latitude) = (180.0 - (from_sun - 180.0).abs(), latitude.to_degrees().abs());
        let rate = if self.roach {
            let v10_per_sr = roach(longitude, latitude) * DEG2_PER_SR;
            v10_per_sr * flux_from_mag(10.0) * self.context.response.stars.solar().at(toward.airmass)
        } else {
            let rates = &self.context.response.zodiacal;
            let (blue, red) = reddening(separation(toward.icrs, self.context.now.sun.direction));
            let x = toward.airmass;
            let spectrum = rates.sunlight.at(x) - blue * rates.blue.at(x) + red * rates.red.at(x);
            leinert(longitude, latitude) * spectrum
        };
        rate * self.context.per_steradian()
    }

    fn uncertainty(&self) -> f64 {
        if self.roach { 0.5 } else { 0.14 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_node_of_both_tables_is_met_and_blanks_stay_blank() {
        for (text, value) in [
            (
                include_str!("../../catalogs/zodiacal/leinert1998_table17.csv"),
                &(|l, b| leinert(l, b) * 1e11) as &dyn Fn(f64, f64) -> f64,
            ),
            (include_str!("../../catalogs/zodiacal/roach1972.csv"), &roach),
        ] {
            let mut lines = text.lines().filter(|l| !l.starts_with('#')).map(|l| l.split(',').collect::<Vec<_>>());
            let head = lines.next().expect("a head");
            for cells in lines {
                let longitude = cells[0].parse::<f64>().expect("a longitude");
                for (cell, name) in cells.iter().zip(&head).skip(1) {
                    let got = value(longitude, name[1..].parse().expect("a latitude"));
                    match cell.parse::<f64>() {
                        Ok(known) => assert!((got / known - 1.0).abs() < 1e-12, "{longitude} {name}"),
                        Err(_) => assert!(got.is_nan()),
                    }
                }
            }
        }
    }

    /// Between the nodes: no dip below or rise above the four neighbours by more than 4 %.
    #[test]
    fn nothing_overshoots_between_the_nodes() {
        for l in 0..180 {
            for b in 0..90 {
                let near = [(0, 0), (15, 0), (0, 15), (15, 15), (-15, 0), (0, -15), (-15, -15)];
                let around = near.map(|(dl, db)| leinert(f64::from(l + dl), f64::from(b + db).abs()));
                let value = leinert(f64::from(l) + 0.5, f64::from(b) + 0.5);
                if value.is_finite() && around.iter().all(|v| v.is_finite()) {
                    let (low, high) = around.iter().fold((f64::MAX, 0.0f64), |(a, z), v| (a.min(*v), z.max(*v)));
                    assert!(value > 0.96 * low && value < 1.04 * high, "{l} {b}");
                }
            }
        }
    }

    #[test]
    fn reddening_changes_without_a_step() {
        assert_eq!(reddening(10f64.to_radians()), (1.2, 0.8));
        let (blue, red) = reddening(std::f64::consts::PI);
        assert!((blue - 0.9).abs() < 1e-12 && (red - 0.6).abs() < 1e-12);
    }
}
