//! Integrated starlight: the stars that are not drawn one by one.
//!
//! S10 of all stars fainter than a limit, from the counts of Bahcall & Soneira 1980, ApJS 44, 73 (|b| >= 20 deg),
//! tabulated against galactic latitude, longitude and limit. The limit is where the catalogue of drawn stars stops
//! being complete in this field; the light of drawn stars fainter than that is taken off, so that no star counts
//! twice. Below 20 deg of latitude the counts are extrapolated with cosec |b| as for a flat disc, no further than
//! to 7 deg: good to a factor of two there, 20 % elsewhere. Solar colour, extinguished once.

use super::{Context, Source, Toward};
use crate::base::ledger::Verdict;
use crate::base::nodes::bracket;
use crate::base::units::flux_from_mag;
use crate::scene::Table;
use glam::DVec3;

const TABLE: &str = include_str!("../../catalogs/starlight/bs80.csv");
/// The lowest latitude of the extrapolation \[deg\].
const FLATTEST_DEG: f64 = 7.0;
/// Side of the cells in which drawn stars are averaged \[rad\]: 2 degrees about the direction.
const AVERAGING: f64 = 2.0 / 180.0 * std::f64::consts::PI;

/// S10 against latitude, longitude and limiting magnitude.
struct Grid {
    limits: Vec<f64>,
    latitudes: Vec<f64>,
    longitudes: Vec<f64>,
    /// By latitude, longitude, limit: log10 S10.
    log_s10: Vec<f64>,
}

impl Grid {
    fn built_in() -> Self {
        let mut lines = TABLE.lines().filter(|l| !l.starts_with('#'));
        let names = lines.next().unwrap_or_default().split(',').collect::<Vec<_>>();
        let columns = names
            .iter()
            .enumerate()
            .filter_map(|(i, name)| Some((i, name.strip_prefix("S10_gt_")?.parse::<f64>().ok()?)))
            .collect::<Vec<_>>();
        let mut grid = Self {
            limits: columns.iter().map(|c| c.1).collect(),
            latitudes: vec![],
            longitudes: vec![],
            log_s10: vec![],
        };
        for line in lines {
            let values = line.split(',').map(|v| v.parse::<f64>().unwrap_or(f64::NAN)).collect::<Vec<_>>();
            let (b, l) = (values[0], values[1]);
            if grid.latitudes.last() != Some(&b) {
                grid.latitudes.push(b);
            }
            if grid.latitudes.len() == 1 {
                grid.longitudes.push(l);
            }
            grid.log_s10.extend(columns.iter().map(|(i, _)| values[*i].log10()));
        }
        grid
    }

    /// S10 of stars fainter than `limit` at galactic latitude and longitude \[deg\].
    fn s10(&self, b: f64, l: f64, limit: f64) -> f64 {
        let latitude = b.abs().max(self.latitudes[0]);
        let longitude = 180.0 - (l.rem_euclid(360.0) - 180.0).abs();
        let (ib, fb) = bracket(&self.latitudes, latitude);
        let (il, fl) = bracket(&self.longitudes, longitude);
        let (im, fm) = bracket(&self.limits, limit);
        let (nl, nm) = (self.longitudes.len(), self.limits.len());
        let mut log = 0.0;
        for (db, wb) in [(0, 1.0 - fb), (1, fb)] {
            for (dl, wl) in [(0, 1.0 - fl), (1, fl)] {
                for (dm, wm) in [(0, 1.0 - fm), (1, fm)] {
                    log += wb * wl * wm * self.log_s10[((ib + db) * nl + il + dl) * nm + im + dm];
                }
            }
        }
        let flat = self.latitudes[0].to_radians().sin()
            / b.abs().clamp(FLATTEST_DEG, self.latitudes[0]).to_radians().sin();
        10f64.powf(log) * flat
    }
}

/// Galactic latitude and longitude \[deg\] of an ICRS direction (Hipparcos catalogue 1997, sect. 1.5.3).
pub fn galactic(icrs: DVec3) -> (f64, f64) {
    let (ra, dec) = crate::astro::angles(icrs);
    let (l, b) = sofars::coords::icrs2g(ra, dec);
    (b.to_degrees(), l.to_degrees())
}

/// Starlight of a frame.
pub struct Starlight<'a> {
    context: &'a Context<'a>,
    grid: Grid,
    limit: f64,
    /// S10 of drawn stars fainter than the limit.
    drawn_s10: f64,
}

impl<'a> Starlight<'a> {
    /// The starlight of a frame.
    pub fn new(context: &'a Context<'a>) -> Self {
        let centre = context.view.wcs.mid.centre;
        let stars = &context.scene.stars;
        let faintest = stars.limit_mag_v.unwrap_or(f64::INFINITY);
        let drawn = stars.enabled && stars.random_count == 0 && stars.catalog != Table::Named("none".into());
        let (limit, drawn_s10) = if drawn {
            let complete = context.catalogue.complete_to(centre, AVERAGING).min(faintest);
            let fainter: f64 = context
                .catalogue
                .cone(centre, AVERAGING, faintest)
                .iter()
                .filter(|s| s.mag_v > complete)
                .map(|s| flux_from_mag(s.mag_v - 10.0))
                .sum();
            let deg2 =
                2.0 * std::f64::consts::PI * (1.0 - AVERAGING.cos()) * (180.0 / std::f64::consts::PI).powi(2);
            (complete, fainter / deg2)
        } else {
            // nothing is drawn: all light fainter than the naked eye's stars, the tables' first limit
            (f64::NEG_INFINITY, 0.0)
        };
        Self { context, grid: Grid::built_in(), limit, drawn_s10 }
    }

    fn electrons(&self, icrs: DVec3, airmass: f64) -> f64 {
        let (b, l) = galactic(icrs);
        let s10 = (self.grid.s10(b, l, self.limit) - self.drawn_s10).max(0.0);
        let per_deg2 = s10 * flux_from_mag(10.0) * self.context.solar_v_zero.at(airmass);
        per_deg2 * self.context.pixel_sr * (180.0 / std::f64::consts::PI).powi(2) * self.context.view.exposure_s
    }
}

impl Source for Starlight<'_> {
    fn name(&self) -> &'static str {
        "sky.starlight"
    }

    fn keyword(&self) -> &'static str {
        "SKYSTAR"
    }

    fn basis(&self) -> String {
        let (b, _) = galactic(self.context.view.wcs.mid.centre);
        let extrapolated = if b.abs() < self.grid.latitudes[0] { ", extrapolated below |b| = 20 deg" } else { "" };
        match self.limit.is_finite() {
            true => format!("stars fainter than V {:.2} (Bahcall & Soneira 1980{extrapolated})", self.limit),
            false => format!("stars fainter than V 6.5 (Bahcall & Soneira 1980{extrapolated})"),
        }
    }

    fn assess(&self) -> Verdict {
        Verdict::Needed {
            bound: 1.2 * self.electrons(self.context.view.wcs.mid.centre, self.context.view.airmass),
        }
    }

    fn mean(&self, toward: &Toward) -> f64 {
        self.electrons(toward.icrs, toward.airmass)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tabulated_values_are_met_and_longitudes_are_symmetric() {
        let grid = Grid::built_in();
        assert!((grid.s10(45.0, 90.0, 11.0) / 9.69952 - 1.0).abs() < 1e-9);
        assert!((grid.s10(-45.0, 270.0, 11.0) / 9.69952 - 1.0).abs() < 1e-9);
        assert!(grid.s10(0.0, 0.0, 11.0).is_finite() && grid.s10(0.0, 0.0, 11.0) < 400.0);
        assert!(grid.s10(30.0, 90.0, 11.5) < grid.s10(30.0, 90.0, 11.0));
    }

    /// The galactic centre (Sgr A*) and the north galactic pole.
    #[test]
    fn galactic_coordinates_of_known_places() {
        let at = |ra: f64, dec: f64| galactic(crate::astro::direction(ra.to_radians(), dec.to_radians()));
        let (b, l) = at(266.4051, -28.93617);
        assert!(b.abs() < 1e-3 && (l.min(360.0 - l)).abs() < 1e-3, "{b} {l}");
        assert!((at(192.85948, 27.12825).0 - 90.0).abs() < 1e-4);
    }
}
