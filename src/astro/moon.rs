//! The Moon's face: libration, the Sun's place above it, phase.
//!
//! Orientation of the Moon after the IAU Working Group on Cartographic Coordinates and Rotational Elements (Archinal et
//! al. 2018, Celest. Mech. Dyn. Astron. 130, 22, table 2): mean Earth / polar axis, good to 0.01 deg or so.
//! Selenographic longitude is east +, towards the Moon's own east (Mare Crisium), as the moonlight models take it.

use super::bodies::{EarthState, moon_gcrs};
use super::separation;
use super::time::Instant;
use glam::{DMat3, DVec3};
use std::f64::consts::FRAC_PI_2;

/// Arguments E1 ... E13: degrees at J2000.0, degrees a day.
const ARGUMENTS: [(f64, f64); 13] = [
    (125.045, -0.052_992_1),
    (250.089, -0.105_984_2),
    (260.008, 13.012_000_9),
    (176.625, 13.340_715_4),
    (357.529, 0.985_600_3),
    (311.589, 26.405_708_4),
    (134.963, 13.064_993_0),
    (276.617, 0.328_714_6),
    (34.226, 1.748_487_7),
    (15.134, -0.158_976_3),
    (119.743, 0.003_609_6),
    (239.961, 0.164_357_3),
    (25.053, 12.959_008_8),
];
/// Sine coefficients of the pole's right ascension \[deg\].
const RA: [f64; 13] = [-3.8787, -0.1204, 0.0700, -0.0172, 0.0, 0.0072, 0.0, 0.0, 0.0, -0.0052, 0.0, 0.0, 0.0043];
/// Cosine coefficients of the pole's declination \[deg\].
const DEC: [f64; 13] =
    [1.5419, 0.0239, -0.0278, 0.0068, 0.0, -0.0029, 0.0009, 0.0, 0.0, 0.0008, 0.0, 0.0, -0.0009];
/// Sine coefficients of the prime meridian \[deg\].
const W: [f64; 13] =
    [3.5610, 0.1208, -0.0642, 0.0158, 0.0252, -0.0066, -0.0047, -0.0046, 0.0028, 0.0052, 0.0040, 0.0019, -0.0044];

/// How the Moon is seen and lit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MoonFace {
    /// Angle Sun - Moon - observer \[rad\]; 0 = full.
    pub phase: f64,
    /// Selenographic longitude of the observer \[rad\]: libration in longitude.
    pub observer_longitude: f64,
    /// Selenographic latitude of the observer \[rad\]: libration in latitude.
    pub observer_latitude: f64,
    /// Selenographic longitude of the Sun \[rad\].
    pub sun_longitude: f64,
    /// Selenographic latitude of the Sun \[rad\].
    pub sun_latitude: f64,
    /// From the Moon to the observer \[m\].
    pub observer_distance: f64,
    /// From the Moon to the Sun \[m\].
    pub sun_distance: f64,
}

/// A phase this near to the date's is the date's \[rad\]: half a degree.
const SAME_PHASE: f64 = 0.5 / 180.0 * std::f64::consts::PI;

impl MoonFace {
    /// The same Moon at another phase, the Sun in its equator on the side where it is.
    #[must_use]
    pub fn at_phase(self, phase: f64) -> Self {
        if (self.phase - phase).abs() < SAME_PHASE {
            return self;
        }
        let side = if libm::sin(self.sun_longitude - self.observer_longitude) < 0.0 { -1.0 } else { 1.0 };
        Self { phase, sun_longitude: self.observer_longitude + side * phase, sun_latitude: 0.0, ..self }
    }
}

/// Rotation from ICRS to selenographic components at `t`.
pub fn icrs_to_selenographic(t: &Instant) -> DMat3 {
    let (day, fraction) = t.tt();
    let days = (day - 2_451_545.0) + fraction;
    let centuries = days / 36_525.0;
    let angles = ARGUMENTS.map(|(at_zero, rate)| (at_zero + rate * days).to_radians());
    let sum = |terms: &[f64; 13], f: fn(f64) -> f64| terms.iter().zip(angles).map(|(c, a)| c * f(a)).sum::<f64>();
    let ra = 269.9949 + 0.0031 * centuries + sum(&RA, f64::sin);
    let dec = 66.5392 + 0.0130 * centuries + sum(&DEC, f64::cos);
    let w = 38.3213 + 13.176_358_15 * days - 1.4e-12 * days * days + sum(&W, f64::sin);
    DMat3::from_rotation_z(-w.to_radians())
        * DMat3::from_rotation_x(-(FRAC_PI_2 - dec.to_radians()))
        * DMat3::from_rotation_z(-(FRAC_PI_2 + ra.to_radians()))
}

/// The Moon's face at `t` for an observer at `observer_gcrs` \[m\]; positions geometric.
pub fn face(t: &Instant, observer_gcrs: DVec3) -> MoonFace {
    let moon = moon_gcrs(t);
    let (to_observer, to_sun) = (observer_gcrs - moon, EarthState::at(t).to_sun - moon);
    let turn = icrs_to_selenographic(t);
    let place = |v: DVec3| {
        let p = turn * v;
        (p.y.atan2(p.x), p.z.atan2(p.x.hypot(p.y)))
    };
    let ((observer_longitude, observer_latitude), (sun_longitude, sun_latitude)) =
        (place(to_observer), place(to_sun));
    MoonFace {
        phase: separation(to_observer, to_sun),
        observer_longitude,
        observer_latitude,
        sun_longitude,
        sun_latitude,
        observer_distance: to_observer.length(),
        sun_distance: to_sun.length(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::astro::scales::Scale;

    /// Meeus 1998, Astronomical Algorithms, example 53.a: 1992 April 12, 0h TD. Libration -1.23 and +4.20 deg, the Sun at
    /// selenographic longitude 67.90 deg, latitude 1.46 deg.
    #[test]
    fn the_libration_of_a_published_day() {
        let t = Instant::from_iso("1992-04-12T00:00:00", Scale::Tdb).expect("a date");
        let face = face(&t, DVec3::ZERO);
        let degrees = [face.observer_longitude, face.observer_latitude, face.sun_longitude, face.sun_latitude];
        for (own, published) in degrees.map(f64::to_degrees).into_iter().zip([-1.23, 4.20, 67.90, 1.46]) {
            assert!((own - published).abs() < 0.03, "{own} {published}");
        }
        // the Moon was 83 deg from the Sun: phase angle a little less than 97 deg lit 0.68
        let lit = 0.5 * (1.0 + face.phase.cos());
        assert!((lit - 0.6786).abs() < 1e-3, "{lit}");
    }
}
