//! Accelerations of an object in orbit: the Earth's field to degree and order 4, Sun and Moon.
//!
//! Field: EGM2008 (Pavlis et al. 2012, JGR 117, B04406), tide-free, by the recursion of Cunningham 1970 as in
//! Montenbruck & Gill 2000, eqs 3.29-3.33. Sun and Moon as point masses (eq. 3.37) in Battin's form without
//! cancellation. Air drag and sunlight's pressure need the object's area and mass and are left out: below some 600 km
//! drag is the larger, 1e-7 m/s^2 of sunlight moves a geostationary object by 0.4 km in a day.

use super::super::Error;
use super::super::bodies::{EarthState, moon_gcrs};
use super::super::earth::Orientation;
use super::super::time::Instant;
use crate::base::constants::{EARTH_GM, MOON_GM, SUN_GM};
use glam::DVec3;

/// Reference radius of EGM2008 \[m\].
const RADIUS_M: f64 = 6_378_136.3;

/// Fully normalised coefficients of EGM2008: degree, order, C, S.
const FIELD: [(usize, usize, f64, f64); 12] = [
    (2, 0, -4.841_651_437_908_15e-4, 0.0),
    (2, 1, -2.066_155_090_741_76e-10, 1.384_413_891_379_79e-9),
    (2, 2, 2.439_383_573_283_13e-6, -1.400_273_703_859_34e-6),
    (3, 0, 9.571_612_070_934_73e-7, 0.0),
    (3, 1, 2.030_462_010_478_64e-6, 2.482_004_158_568_72e-7),
    (3, 2, 9.047_878_948_095_28e-7, -6.190_054_751_776_18e-7),
    (3, 3, 7.213_217_571_215_68e-7, 1.414_349_261_929_41e-6),
    (4, 0, 5.399_658_666_389_91e-7, 0.0),
    (4, 1, -5.361_573_893_888_67e-7, -4.735_673_465_180_86e-7),
    (4, 2, 3.505_016_239_626_49e-7, 6.624_800_262_758_29e-7),
    (4, 3, 9.908_567_666_723_21e-7, -2.009_567_235_674_52e-7),
    (4, 4, -1.885_196_330_230_33e-7, 3.088_038_821_491_94e-7),
];

/// What acts on an object.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Forces {
    /// Terms of the Earth's field beyond a point mass.
    pub field: Field,
    /// The Sun.
    pub sun: bool,
    /// The Moon.
    pub moon: bool,
}

/// Terms of the Earth's field.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Field {
    /// A point mass.
    Point,
    /// The flattening, J2.
    J2,
    /// Degree and order 4.
    Degree4,
}

impl Forces {
    /// Everything there is.
    pub const ALL: Self = Self { field: Field::Degree4, sun: true, moon: true };

    /// What moves an object, between `perigee_m` and `apogee_m` from the Earth's centre, by more than `tolerance_m` in
    /// `span_s` seconds. A constant acceleration a moves it by at most 3/2 a t^2 (Montenbruck & Gill 2000, sect. 3.1).
    pub fn needed(perigee_m: f64, apogee_m: f64, span_s: f64, tolerance_m: f64) -> Self {
        let matters = |acceleration: f64| 1.5 * acceleration * span_s * span_s > tolerance_m;
        let near = EARTH_GM / perigee_m.powi(2);
        let ratio = (RADIUS_M / perigee_m).min(1.0);
        let field = if matters(near * 1e-5 * ratio.powi(2)) {
            Field::Degree4
        } else if matters(near * 3.3e-3 * ratio.powi(2)) {
            Field::J2
        } else {
            Field::Point
        };
        let tide = |gm: f64, distance: f64| 2.0 * gm * apogee_m / distance.powi(3);
        Self { field, sun: matters(tide(SUN_GM, 1.47e11)), moon: matters(tide(MOON_GM, 3.56e8)) }
    }

    /// In words.
    pub fn describe(&self) -> String {
        let field = match self.field {
            Field::Point => "two bodies",
            Field::J2 => "two bodies, J2",
            Field::Degree4 => "the Earth's field to degree 4",
        };
        let with = |on: bool, name: &str| if on { format!(", {name}") } else { String::new() };
        format!("{field}{}{}", with(self.sun, "Sun"), with(self.moon, "Moon"))
    }

    /// Acceleration \[m/s^2\] at a GCRS position \[m\].
    ///
    /// # Errors
    /// [`Error::EpochOutsideTable`] where the Earth's orientation is unknown and its field asked for.
    pub fn acceleration(&self, t: &Instant, position: DVec3) -> Result<DVec3, Error> {
        let mut sum = -position * (EARTH_GM / position.length().powi(3));
        if self.field > Field::Point {
            let to_itrf = Orientation::at(t)?.gcrs_to_itrf;
            sum += to_itrf.transpose() * field_itrf(to_itrf * position, self.field);
        }
        if self.sun {
            sum += third_body(SUN_GM, EarthState::at(t).to_sun, position);
        }
        if self.moon {
            sum += third_body(MOON_GM, moon_gcrs(t), position);
        }
        Ok(sum)
    }
}

/// Difference of a body's pull at `position` and at the geocentre; Battin 1999, "An Introduction to the Mathematics and
/// Methods of Astrodynamics", eq. 8.61.
fn third_body(gm: f64, body: DVec3, position: DVec3) -> DVec3 {
    let q = position.dot(position - body * 2.0) / body.length_squared();
    let f = q * (3.0 + q * (3.0 + q)) / (1.0 + (1.0 + q).powf(1.5));
    (position + body * f) * (-gm / (body - position).length().powi(3))
}

/// Factor from a fully normalised coefficient to a plain one.
fn denormalised(n: usize, m: usize) -> f64 {
    let factorial = |k: usize| (1..=k).map(|i| i as f64).product::<f64>();
    let once = if m == 0 { 1.0 } else { 2.0 };
    (once * (2 * n + 1) as f64 * factorial(n - m) / factorial(n + m)).sqrt()
}

/// Acceleration of the field's terms beyond a point mass, ITRF.
fn field_itrf(r: DVec3, field: Field) -> DVec3 {
    const SIZE: usize = 6;
    let degree = if field == Field::J2 { 2 } else { 4 };
    let r2 = r.length_squared();
    let rho = RADIUS_M * RADIUS_M / r2;
    let (x, y, z) = (RADIUS_M * r.x / r2, RADIUS_M * r.y / r2, RADIUS_M * r.z / r2);
    let mut v = [[0.0; SIZE]; SIZE];
    let mut w = [[0.0; SIZE]; SIZE];
    v[0][0] = RADIUS_M / r2.sqrt();
    for m in 0..=degree + 1 {
        if m > 0 {
            let k = (2 * m - 1) as f64;
            v[m][m] = k * (x * v[m - 1][m - 1] - y * w[m - 1][m - 1]);
            w[m][m] = k * (x * w[m - 1][m - 1] + y * v[m - 1][m - 1]);
        }
        for n in m + 1..=degree + 1 {
            let (a, b) = ((2 * n - 1) as f64 / (n - m) as f64, (n + m - 1) as f64 / (n - m) as f64);
            let before = |t: &[[f64; SIZE]; SIZE]| if n > m + 1 { t[n - 2][m] } else { 0.0 };
            v[n][m] = a * z * v[n - 1][m] - b * rho * before(&v);
            w[n][m] = a * z * w[n - 1][m] - b * rho * before(&w);
        }
    }
    let mut sum = DVec3::ZERO;
    for (n, m, c, s) in FIELD {
        if n > degree || (field == Field::J2 && m > 0) {
            continue;
        }
        let scale = denormalised(n, m);
        let (c, s) = (c * scale, s * scale);
        let (vn, wn) = (&v[n + 1], &w[n + 1]);
        sum += if m == 0 {
            DVec3::new(-c * vn[1], -c * wn[1], -((n + 1) as f64) * c * vn[0])
        } else {
            let twice = ((n - m + 2) * (n - m + 1)) as f64;
            DVec3::new(
                0.5 * ((-c * vn[m + 1] - s * wn[m + 1]) + twice * (c * vn[m - 1] + s * wn[m - 1])),
                0.5 * ((-c * wn[m + 1] + s * vn[m + 1]) + twice * (-c * wn[m - 1] + s * vn[m - 1])),
                ((n - m + 1) as f64) * (-c * vn[m] - s * wn[m]),
            )
        };
    }
    sum * (EARTH_GM / (RADIUS_M * RADIUS_M))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The potential itself, by Legendre functions written out (degree 2) for the gradient by differences.
    fn j2_potential(r: DVec3) -> f64 {
        let j2 = 4.841_651_437_908_15e-4 * 5f64.sqrt();
        let (radius, sine) = (r.length(), r.z / r.length());
        -EARTH_GM / radius * j2 * (RADIUS_M / radius).powi(2) * 0.5 * (3.0 * sine * sine - 1.0)
    }

    #[test]
    fn j2_is_the_gradient_of_its_potential() {
        for r in [DVec3::new(7e6, 0.0, 0.0), DVec3::new(1e6, -3e6, 6.5e6), DVec3::new(-2e7, 1e7, -3e7)] {
            let step = 10.0;
            let slope =
                |axis: DVec3| (j2_potential(r + axis * step) - j2_potential(r - axis * step)) / (2.0 * step);
            let gradient = DVec3::new(slope(DVec3::X), slope(DVec3::Y), slope(DVec3::Z));
            let own = field_itrf(r, Field::J2);
            assert!((own - gradient).length() < 1e-6 * own.length(), "{own} {gradient}");
        }
    }

    /// A potential's acceleration has neither curl nor divergence outside the mass.
    #[test]
    fn the_field_has_neither_curl_nor_divergence() {
        let r = DVec3::new(3e6, 5e6, -4.5e6);
        let step = 100.0;
        let slope = |axis: DVec3| {
            (field_itrf(r + axis * step, Field::Degree4) - field_itrf(r - axis * step, Field::Degree4))
                / (2.0 * step)
        };
        let (dx, dy, dz) = (slope(DVec3::X), slope(DVec3::Y), slope(DVec3::Z));
        let size = dx.length() + dy.length() + dz.length();
        assert!((dx.x + dy.y + dz.z).abs() < 1e-6 * size);
        assert!((dy.z - dz.y).abs() + (dz.x - dx.z).abs() + (dx.y - dy.x).abs() < 1e-6 * size);
    }

    #[test]
    fn a_third_body_pulls_as_the_plain_difference_does() {
        let (moon, place) = (DVec3::new(3e8, 1e8, -1e8), DVec3::new(4e7, -1e7, 2e6));
        let to = moon - place;
        let plain = (to / to.length().powi(3) - moon / moon.length().powi(3)) * MOON_GM;
        assert!((third_body(MOON_GM, moon, place) - plain).length() < 1e-12 * plain.length());
    }

    #[test]
    fn what_cannot_matter_is_left_out() {
        let at = |span| Forces::needed(4.2e7, 4.2e7, span, 0.2);
        assert_eq!(at(1.0), Forces { field: Field::Point, sun: false, moon: false });
        assert_eq!(at(86_400.0), Forces::ALL);
        assert_eq!(at(300.0).field, Field::J2);
        assert_eq!(at(300.0).describe(), "two bodies, J2, Sun, Moon");
    }
}
