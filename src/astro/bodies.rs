//! Sun and Moon.
//!
//! Earth: SOFA's `epv00`, within 12 km of DE405 in 1900-2100 (0.02 arcsec for the Sun). Moon: SOFA's `moon98` (Meeus
//! 1998), to which a table of what it lacks against JPL's DE421 is added in 1973-2053: 0.03 arcsec and 0.05 km. Outside
//! these years the series stands alone: 2.9 arcsec and 6.1 km rms, at worst 18 arcsec and 32 km. Both in ICRS axes, both
//! interpolated ([`super::daily`]).

use super::daily::{self, Days, NODES, Series};
use super::time::{Instant, MJD_ZERO};
use crate::base::constants::{AU_M, DAY_S, LIGHT_M_S};
use glam::DVec3;
use std::convert::Infallible;

/// Earth and Sun at one instant, barycentric, ICRS axes.
#[derive(Debug, Clone, Copy)]
pub struct EarthState {
    /// Barycentric position of the geocentre \[m\].
    pub position: DVec3,
    /// Barycentric velocity of the geocentre \[m/s\].
    pub velocity: DVec3,
    /// Position of the Sun from the geocentre, geometric \[m\].
    pub to_sun: DVec3,
    /// How that position changes \[m/s\].
    pub sun_velocity: DVec3,
}

/// One day of the Earth's motion.
struct EarthDay {
    position: Series,
    velocity: Series,
    to_sun: Series,
    sun_velocity: Series,
}

static EARTH: Days<EarthDay> = Days::new();
static MOON: Days<Series> = Days::new();

/// What cannot fail has its value.
fn sure<T>(result: Result<T, Infallible>) -> T {
    match result {
        Ok(value) => value,
        Err(never) => match never {},
    }
}

impl EarthState {
    /// The state at `t`, interpolated, in the years 1900 to 2099. Outside them it is not a number; the Earth's orientation,
    /// without which nothing is seen from the ground, refuses them.
    pub fn at(t: &Instant) -> Self {
        let number = daily::number(t);
        let day = sure(EARTH.get(number, || {
            let series = |f: fn(Self) -> DVec3| Series::fit(number, NODES, |t| f(Self::reference(t)));
            Ok(EarthDay {
                position: series(|e| e.position),
                velocity: series(|e| e.velocity),
                to_sun: series(|e| e.to_sun),
                sun_velocity: series(|e| e.sun_velocity),
            })
        }));
        Self {
            position: day.position.at(t),
            velocity: day.velocity.at(t),
            to_sun: day.to_sun.at(t),
            sun_velocity: day.sun_velocity.at(t),
        }
    }

    /// The state at `t` without interpolation: the twin of [`Self::at`].
    pub fn reference(t: &Instant) -> Self {
        let (day, fraction) = t.tt();
        let nowhere = [[f64::NAN; 3]; 2];
        let (heliocentric, barycentric) = sofars::eph::epv00(day, fraction).unwrap_or((nowhere, nowhere));
        let vector = |v: [f64; 3]| DVec3::from_array(v);
        Self {
            position: vector(barycentric[0]) * AU_M,
            velocity: vector(barycentric[1]) * (AU_M / DAY_S),
            to_sun: vector(heliocentric[0]) * -AU_M,
            sun_velocity: vector(heliocentric[1]) * (-AU_M / DAY_S),
        }
    }
}

impl EarthState {
    /// Position of the Sun from the geocentre as its light comes in the Earth's frame \[m\]: one light time ago, which is
    /// aberration in other words (20.5 arcsec). What it lights, and the Earth's shadow, follow this one: at a geostationary
    /// distance the shadow lags by the 4 km which the Earth moves while light passes from its limb. `earlier_s` is how long
    /// before this state it is asked for, seconds at most: the light time to something near the Earth.
    pub fn sun_apparent(&self, earlier_s: f64) -> DVec3 {
        self.to_sun - self.sun_velocity * (self.to_sun.length() / LIGHT_M_S + earlier_s)
    }
}

/// Astrometric vector from a place `observer_gcrs` \[m\] to the Sun \[m\]: the Sun one light time ago, seen
/// from the observer now, both barycentric.
pub fn sun_from(t: &Instant, observer_gcrs: DVec3) -> DVec3 {
    let now = EarthState::at(t);
    let observer = now.position + observer_gcrs;
    let then = EarthState::at(&t.plus(-now.to_sun.length() / LIGHT_M_S));
    then.position + then.to_sun - observer
}

/// Vector from the geocentre to the Moon \[m\], geometric, GCRS.
pub fn moon_gcrs(t: &Instant) -> DVec3 {
    let number = daily::number(t);
    sure(MOON.get(number, || Ok(Series::fit(number, NODES, moon_reference)))).at(t)
}

/// The Moon without interpolation over its day: the twin of [`moon_gcrs`].
pub fn moon_reference(t: &Instant) -> DVec3 {
    let (day, fraction) = t.tt();
    DVec3::from_array(sofars::eph::moon98(day, fraction)[0]) * AU_M + moon_correction(day - MJD_ZERO, fraction)
}

/// DE421 - moon98 at 0 h TT of each day, km, in lines of equal length; `catalogs/README.md` tells of it.
const MOON_TABLE: &str = include_str!("../../catalogs/moon/de421_minus_moon98.txt");
/// Day of the table's first line, MJD.
const MOON_TABLE_FIRST: f64 = 41_650.0;
/// Lines used for one instant.
const MOON_POINTS: usize = 8;

/// What the Moon's series lacks \[m\], by Lagrange's polynomial of degree 7; 0 outside the table.
fn moon_correction(mjd: f64, fraction: f64) -> DVec3 {
    let first = mjd - MOON_TABLE_FIRST - (MOON_POINTS / 2 - 1) as f64;
    if first.is_nan() || first < 0.0 {
        return DVec3::ZERO;
    }
    let x = (MOON_POINTS / 2 - 1) as f64 + fraction;
    let mut sum = DVec3::ZERO;
    for k in 0..MOON_POINTS {
        let Some(line) = moon_line(first as usize + k) else { return DVec3::ZERO };
        let others = (0..MOON_POINTS).filter(|j| *j != k);
        sum += line * others.map(|j| (x - j as f64) / (k as f64 - j as f64)).product::<f64>();
    }
    sum * 1e3
}

/// A line of the Moon's table \[km\].
fn moon_line(index: usize) -> Option<DVec3> {
    const WIDTH: usize = 22;
    let line = MOON_TABLE.get(index.checked_mul(WIDTH)?..index.checked_add(1)?.checked_mul(WIDTH)?)?;
    let number = |at: usize| line.get(at..at + 7)?.trim().parse::<f64>().ok();
    Some(DVec3::new(number(0)?, number(7)?, number(14)?))
}

/// Vector from a place `observer_gcrs` \[m\] to the Moon \[m\], with geocentric light time.
pub fn moon_from(t: &Instant, observer_gcrs: DVec3) -> DVec3 {
    let light_time = moon_gcrs(t).length() / LIGHT_M_S;
    moon_gcrs(&t.plus(-light_time)) - observer_gcrs
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Interpolated against direct, over a century: centimetres for the Earth, 10 m for the Moon.
    #[test]
    fn interpolation_is_far_below_the_series_own_error() {
        let start = Instant::from_utc("1973-03-01T00:00:00").expect("a date");
        let (mut earth, mut speed, mut moon) = (0.0f64, 0.0f64, 0.0f64);
        for k in 0..400 {
            let t = start.plus(f64::from(k) * 9.9e6 + 4321.0);
            let (fast, slow) = (EarthState::at(&t), EarthState::reference(&t));
            earth = earth.max((fast.position - slow.position).length()).max((fast.to_sun - slow.to_sun).length());
            speed = speed.max((fast.velocity - slow.velocity).length());
            moon = moon.max((moon_gcrs(&t) - moon_reference(&t)).length());
        }
        assert!(earth < 0.1 && speed < 1e-6 && moon < 10.0, "{earth:e} m, {speed:e} m/s, {moon:e} m");
    }
}
