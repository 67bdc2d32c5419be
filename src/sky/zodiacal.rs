//! Zodiacal light: sunlight scattered by interplanetary dust.
//!
//! Brightness at 500 nm against the helioecliptic longitude and the ecliptic latitude: Leinert et al. 1998, A&AS 127,
//! 1, Table 17, bilinear in the logarithm. Spectrum: the Sun's, reddened by 1 + c log10(lambda/500 nm) with c falling
//! from 1.2/0.8 (below/above 500 nm) at 30 deg elongation to 0.9/0.6 at 90 deg (their eq. 22). Extinguished once, as
//! a star's light. Blank cells of the table, within 15 deg of the Sun, are outside the model. Uncertainty: 10 %.

use super::{Context, Source, Toward};
use crate::astro::{angles, separation};
use crate::base::ledger::{Verdict, Why};
use crate::base::nodes::bracket;
use crate::light::tables;
use crate::light::throughput::RateAtAirmass;
use glam::{DMat3, DVec3};

const TABLE: &str = include_str!("../../catalogs/zodiacal/leinert1998_table17.csv");
/// Mean obliquity of the ecliptic at J2000 \[rad\] (IAU 2006).
const OBLIQUITY: f64 = 84_381.406 * crate::base::units::ARCSEC;

/// The table: longitudes, latitudes \[deg\], radiance \[1e-8 W m^-2 sr^-1 um^-1\] by rows, NaN where blank.
struct Grid {
    longitudes: Vec<f64>,
    latitudes: Vec<f64>,
    radiance: Vec<f64>,
}

impl Grid {
    fn built_in() -> Self {
        let mut lines = TABLE.lines().filter(|l| !l.starts_with('#'));
        let names = lines.next().unwrap_or_default().split(',');
        let latitudes = names.filter_map(|n| n.strip_prefix('b')?.parse().ok()).collect::<Vec<f64>>();
        let (mut longitudes, mut radiance) = (vec![], vec![]);
        for line in lines {
            let mut values = line.split(',').map(|v| v.parse::<f64>().unwrap_or(f64::NAN));
            longitudes.push(values.next().unwrap_or(f64::NAN));
            radiance.extend(values.chain(std::iter::repeat(f64::NAN)).take(latitudes.len()));
        }
        Self { longitudes, latitudes, radiance }
    }

    /// Radiance at 500 nm \[W m^-2 sr^-1 nm^-1\]; NaN too near the Sun.
    fn at(&self, longitude_deg: f64, latitude_deg: f64) -> f64 {
        let (i, fi) = bracket(&self.longitudes, longitude_deg);
        let (j, fj) = bracket(&self.latitudes, latitude_deg);
        let log = |di: usize, dj: usize| self.radiance[(i + di) * self.latitudes.len() + j + dj].ln();
        // a blank cell with no weight does not matter
        let weighted = |w: f64, v: f64| if w == 0.0 { 0.0 } else { w * v };
        let sum = weighted((1.0 - fi) * (1.0 - fj), log(0, 0))
            + weighted((1.0 - fi) * fj, log(0, 1))
            + weighted(fi * (1.0 - fj), log(1, 0))
            + weighted(fi * fj, log(1, 1));
        sum.exp() * 1e-8 * 1e-3
    }
}

/// Ecliptic longitude and latitude \[rad\] of an ICRS direction (J2000 ecliptic; the frame bias of 20 mas is left out).
fn ecliptic(icrs: DVec3) -> (f64, f64) {
    angles(DMat3::from_rotation_x(-OBLIQUITY) * icrs)
}

/// Zodiacal light of a frame.
pub struct Zodiacal<'a> {
    context: &'a Context<'a>,
    grid: Grid,
    /// Electrons per second and steradian for a radiance of 1 W m^-2 sr^-1 nm^-1 at 500 nm.
    rate: RateAtAirmass,
    sun_longitude: f64,
}

impl<'a> Zodiacal<'a> {
    /// The zodiacal light of a frame.
    pub fn new(context: &'a Context<'a>) -> Self {
        let sun = context.view.sun.direction;
        let elongation = separation(context.view.wcs.mid.centre, sun).to_degrees();
        let between = ((elongation - 30.0) / 60.0).clamp(0.0, 1.0);
        let (blue, red) = (1.2 - 0.3 * between, 0.8 - 0.2 * between);
        let spectrum = tables::sun();
        let at_500 = spectrum.at(500.0);
        let reddened = spectrum.map(|nm, value| {
            let slope = if nm < 500.0 { blue } else { red };
            value / at_500 * (1.0 + slope * (nm / 500.0).log10())
        });
        Self {
            context,
            grid: Grid::built_in(),
            rate: context.throughput.rate(&reddened),
            sun_longitude: ecliptic(sun).0,
        }
    }

    fn electrons(&self, icrs: DVec3, airmass: f64) -> f64 {
        let (longitude, latitude) = ecliptic(icrs);
        let from_sun = (longitude - self.sun_longitude).to_degrees().rem_euclid(360.0);
        let radiance = self.grid.at(180.0 - (from_sun - 180.0).abs(), latitude.to_degrees().abs());
        radiance * self.rate.at(airmass) * self.context.pixel_sr * self.context.view.exposure_s
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
        "Leinert 1998, Table 17, reddened sunlight".into()
    }

    fn assess(&self) -> Verdict {
        let centre = self.electrons(self.context.view.wcs.mid.centre, self.context.view.airmass);
        if centre.is_nan() {
            return Verdict::Absent(Why::OutsideModel("the field is within 15 deg of the Sun".into()));
        }
        Verdict::Needed { bound: 1.2 * centre }
    }

    fn mean(&self, toward: &Toward) -> f64 {
        let electrons = self.electrons(toward.icrs, toward.airmass);
        // a corner of the frame in a blank cell takes the centre's value
        if electrons.is_nan() {
            self.electrons(self.context.view.wcs.mid.centre, toward.airmass)
        } else {
            electrons
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tabulated_values_are_met_and_blanks_stay_blank() {
        let grid = Grid::built_in();
        assert!((grid.at(90.0, 0.0) - 259e-11).abs() < 1e-15);
        assert!((grid.at(180.0, 90.0) - 77e-11).abs() < 1e-15);
        assert!((grid.at(15.0, 0.0) - 11500e-11).abs() < 1e-12);
        assert!(grid.at(5.0, 3.0).is_nan());
        assert!(grid.at(90.0, 2.5) < 259e-11 && grid.at(90.0, 2.5) > 251e-11);
    }
}
