//! Models of an earlier thesis draft (Robinson, Purdue), kept so that its results can be reproduced; never the default.
//!
//! Their faults in units are mended (steradians for square degrees, the solar constant in the moonlight's factor), their
//! physics is left as it is: 1/cos z without end at the horizon, light measured at the ground dimmed once more, the night
//! sky of 22 mag/arcsec^2 inside pollution and twilight.
//!
//! ```text
//! pollution   -2.5 log10((A + 0.171168) / 1.08e8) mag/arcsec^2, SINT / cos z                 eq. 7.3
//! twilight    11.84 + 1.518 x - 0.057 x^2, held above 95 deg, 22 beyond 105 deg, SINT / cos z  eqs 7.4, 7.5
//! moonlight   f(phase) F_R (1 + 75 (exp(-rho/15 deg) + 0.015 exp(-(180 deg - rho)/50 deg)))     eqs 7.8, 7.9
//! ```
//!
//! with F_R of Daniels 1977, Opt. Eng. 16, 66, Table 4 (linear between its nodes; beyond 75 and 80 deg it falls as
//! exp(10 (limit - z)), z in rad) and f of his Table 3.

use super::{Context, Field, Source, Toward, moonlight};
use crate::astro::separation;
use crate::base::ledger::Why;
use crate::base::nodes::bracket;
use crate::base::surface_brightness::{Luminance, MagArcsec2};
use crate::light::tables;
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::LazyLock;

/// Natural zenith of the World Atlas \[mcd/m^2\]: 22 mag/arcsec^2.
const NATURAL_MCD_M2: f64 = 0.171_168;

/// Electrons per pixel at the zenith of a V surface brightness that is dimmed by one airmass.
fn dimmed(context: &Context, brightness: MagArcsec2) -> f64 {
    let solar = context.response.stars.solar();
    context.electrons_at_ground(brightness) * solar.at(1.0) / context.response.solar_at_ground
}

/// 1/cos z; NaN at and below the horizon.
fn secant(toward: &Toward) -> f64 {
    if toward.zenith_distance < FRAC_PI_2 { 1.0 / toward.zenith_distance.cos() } else { f64::NAN }
}

/// A zenith brightness over cos z: pollution (eq. 7.3) and twilight (eqs 7.4, 7.5).
pub struct OverCosine {
    name: &'static str,
    keyword: &'static str,
    basis: &'static str,
    zenith: f64,
}

/// V of the twilight's zenith \[mag/arcsec^2\], eq. 7.4 with its clamps.
fn draft_twilight(sun_zenith_deg: f64) -> f64 {
    if sun_zenith_deg > 105.0 {
        return 22.0;
    }
    let x = (sun_zenith_deg - 95.0).max(0.0);
    11.84 + 1.518 * x - 0.057 * x * x
}

impl OverCosine {
    /// The pollution of a frame.
    pub fn pollution(context: &Context) -> Self {
        let total = Luminance(context.response.artificial_mcd_m2 + NATURAL_MCD_M2);
        Self {
            name: "sky.pollution",
            keyword: "SKYPOLL",
            basis: "draft: artificial and natural zenith over cos z",
            zenith: dimmed(context, total.into()),
        }
    }

    /// The twilight of a frame.
    pub fn twilight(context: &Context) -> Self {
        let mag = draft_twilight(90.0 - context.now.sun.horizontal.elevation.to_degrees());
        Self {
            name: "sky.twilight",
            keyword: "SKYTWIL",
            basis: "draft: Patat 2006 in V, 22 mag/arcsec^2 beyond 105 deg, over cos z",
            zenith: dimmed(context, MagArcsec2(mag)),
        }
    }
}

impl Source for OverCosine {
    fn name(&self) -> &'static str {
        self.name
    }

    fn keyword(&self) -> &'static str {
        self.keyword
    }

    fn basis(&self) -> String {
        self.basis.into()
    }

    fn absent(&self, _: &Field) -> Option<Why> {
        None
    }

    fn mean(&self, toward: &Toward) -> f64 {
        self.zenith * secant(toward)
    }

    fn uncertainty(&self) -> f64 {
        1.0
    }
}

/// Moonlight, eqs 7.8 to 7.11.
pub struct Moonlight<'a> {
    context: &'a Context<'a>,
    /// Electrons per pixel of 1 W m^-2 m^-1 sr^-1 at 550 nm.
    per_radiance: f64,
    share: f64,
    lit: f64,
}

const MOON_ZENITHS: [f64; 4] = [0.0, 30.0, 60.0, 75.0];
const ZENITHS: [f64; 9] = [0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0];
const AZIMUTHS: [f64; 5] = [0.0, 45.0, 90.0, 135.0, 180.0];

/// Numbers of a table, row after row, its first `skip` columns left out.
fn numbers(text: &str, skip: usize) -> Vec<f64> {
    let lines = text.lines().filter(|l| l.starts_with(|c: char| c.is_ascii_digit()));
    lines.flat_map(|l| l.split(',').skip(skip).map(|v| v.parse().unwrap_or(f64::NAN))).collect()
}

static TABLE_4: LazyLock<Vec<f64>> =
    LazyLock::new(|| numbers(include_str!("../../catalogs/moon/daniels1977_table4.csv"), 2));
static TABLE_3: LazyLock<Vec<f64>> =
    LazyLock::new(|| numbers(include_str!("../../catalogs/moon/daniels1977_table3.csv"), 1));

/// Table 4 between its nodes \[W m^-2 m^-1 sr^-1\]; angles in degrees.
fn rayleigh(moon_zenith: f64, zenith: f64, azimuth: f64) -> f64 {
    let (i, fi) = bracket(&MOON_ZENITHS, moon_zenith);
    let (j, fj) = bracket(&ZENITHS, zenith);
    let (k, fk) = bracket(&AZIMUTHS, azimuth);
    let mut sum = 0.0;
    for (di, wi) in [(0, 1.0 - fi), (1, fi)] {
        for (dj, wj) in [(0, 1.0 - fj), (1, fj)] {
            for (dk, wk) in [(0, 1.0 - fk), (1, fk)] {
                sum += wi * wj * wk * TABLE_4[((i + di) * ZENITHS.len() + j + dj) * AZIMUTHS.len() + k + dk];
            }
        }
    }
    let beyond = |z: f64, limit: f64| (-10.0 * (z - limit).max(0.0).to_radians()).exp();
    sum * beyond(moon_zenith, 75.0) * beyond(zenith, 80.0)
}

/// Share of the full Moon's light at a phase \[deg\].
fn phase_share(phase_deg: f64) -> f64 {
    let step = phase_deg.clamp(0.0, 180.0) / 10.0;
    let i = (step as usize).min(TABLE_3.len() - 2);
    TABLE_3[i] + (step - i as f64) * (TABLE_3[i + 1] - TABLE_3[i])
}

impl<'a> Moonlight<'a> {
    /// The moonlight of a frame.
    pub fn new(context: &'a Context<'a>) -> Self {
        // I_sun / SUN(550 nm), and SINT of sunlight dimmed by one airmass
        let sun = tables::solar_of_v_zero();
        let per_radiance =
            context.response.stars.solar().at(1.0) / (sun.at(550.0) * 1e9) * context.per_steradian();
        let share = phase_share(context.now.moon.phase.to_degrees());
        Self { context, per_radiance, share, lit: moonlight::lit(context) }
    }
}

impl Source for Moonlight<'_> {
    fn name(&self) -> &'static str {
        "sky.moonlight"
    }

    fn keyword(&self) -> &'static str {
        "SKYMOON"
    }

    fn basis(&self) -> String {
        "draft: Daniels 1977, Tables 3 and 4, Mie peak of 75".into()
    }

    fn absent(&self, field: &Field) -> Option<Why> {
        moonlight::absent(self.context, field, self.lit)
    }

    fn mean(&self, toward: &Toward) -> f64 {
        let moon = &self.context.now.moon.body;
        let moon_zenith = FRAC_PI_2 - moon.horizontal.elevation;
        let apart = (toward.azimuth - moon.horizontal.azimuth + PI).rem_euclid(2.0 * PI) - PI;
        let rho = separation(toward.icrs, moon.direction).to_degrees();
        let mie = 75.0 * ((-rho / 15.0).exp() + 0.015 * (-(180.0 - rho) / 50.0).exp());
        let molecules =
            rayleigh(moon_zenith.to_degrees(), toward.zenith_distance.to_degrees(), apart.abs().to_degrees());
        let fade = moonlight::fade(moonlight::elevation(self.context));
        self.per_radiance * self.share * self.lit * fade * molecules * (1.0 + mie)
    }

    fn uncertainty(&self) -> f64 {
        1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_of_the_published_tables_are_met() {
        assert_eq!(rayleigh(0.0, 0.0, 77.0), 22.0);
        assert_eq!(rayleigh(60.0, 70.0, 45.0), 43.0);
        assert_eq!(rayleigh(0.0, 80.0, 180.0), 55.0);
        assert_eq!([phase_share(0.0), phase_share(90.0), phase_share(180.0)], [1.0, 0.089, 0.0]);
        assert!((phase_share(95.0) - 0.075).abs() < 1e-12);
    }

    #[test]
    fn the_drafts_twilight_keeps_its_seam() {
        assert_eq!(draft_twilight(80.0), 11.84);
        assert!((draft_twilight(105.0) - 21.32).abs() < 0.005);
        assert_eq!(draft_twilight(105.001), 22.0);
    }
}
