//! The WGS 84 ellipsoid: geodetic longitude, latitude and height to ITRF and back.
//!
//! The way back is the foot of the perpendicular on the ellipse by bisection on one convex function (Eberly 2013,
//! "Distance from a point to an ellipse"): it holds at the poles, on the axis, deep inside and far out. Near the centre,
//! inside the evolute (43 km), a place has several perpendiculars; the nearest surface is taken, at the centre a pole.

use crate::base::constants::{EARTH_FLATTENING, EARTH_RADIUS_M};
use glam::DVec3;

/// A place relative to the WGS 84 ellipsoid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Geodetic {
    /// East longitude in (-pi, pi] \[rad\].
    pub longitude: f64,
    /// Geodetic latitude, north + \[rad\].
    pub latitude: f64,
    /// Height above the ellipsoid \[m\].
    pub height_m: f64,
}

impl Geodetic {
    /// ITRF position \[m\].
    pub fn itrf(&self) -> DVec3 {
        let e2 = EARTH_FLATTENING * (2.0 - EARTH_FLATTENING);
        let (sin, cos) = self.latitude.sin_cos();
        let (sin_lon, cos_lon) = self.longitude.sin_cos();
        // radius of curvature in the prime vertical
        let n = EARTH_RADIUS_M / (1.0 - e2 * sin * sin).sqrt();
        let from_axis = (n + self.height_m) * cos;
        DVec3::new(from_axis * cos_lon, from_axis * sin_lon, (n * (1.0 - e2) + self.height_m) * sin)
    }

    /// The place of an ITRF position \[m\]; NaN where the position is not finite.
    pub fn of(itrf: DVec3) -> Self {
        if !itrf.is_finite() {
            return Self { longitude: f64::NAN, latitude: f64::NAN, height_m: f64::NAN };
        }
        let (a, b) = (EARTH_RADIUS_M, EARTH_RADIUS_M * (1.0 - EARTH_FLATTENING));
        let longitude = itrf.y.atan2(itrf.x);
        let (p, z) = (itrf.x.hypot(itrf.y), itrf.z.abs());
        // the foot of the perpendicular, in the quadrant p, z >= 0
        let (foot_p, foot_z) = foot(p / a, z / b, (a / b).powi(2));
        let (foot_p, foot_z) = (a * foot_p, b * foot_z);
        // the normal at the foot
        let latitude = (a / b * foot_z * (a / b)).atan2(foot_p);
        let (sin, cos) = latitude.sin_cos();
        let height_m = (p - foot_p) * cos + (z - foot_z) * sin;
        Self { longitude, latitude: latitude.copysign(itrf.z), height_m }
    }
}

/// Foot of the perpendicular from (`x` a, `y` b) on an ellipse with `r` = (a/b)^2 > 1, in units of a and b.
fn foot(x: f64, y: f64, r: f64) -> (f64, f64) {
    if y == 0.0 {
        // on the equator plane: inside the evolute the nearest surface lies off it
        let limit = 1.0 - 1.0 / r;
        if x >= limit {
            return (1.0, 0.0);
        }
        let foot_x = x / limit;
        return (foot_x, (1.0 - foot_x * foot_x).sqrt());
    }
    // with t in units of b^2 the foot is (r x / (t + r), y / (t + 1)); it lies on the ellipse at the root of g
    let g = |t: f64| (r * x / (t + r)).powi(2) + (y / (t + 1.0)).powi(2) - 1.0;
    let (mut low, mut high) = (y - 1.0, (r * x).hypot(y) - 1.0);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if g(middle) > 0.0 { low = middle } else { high = middle }
    }
    let t = 0.5 * (low + high);
    let (foot_x, foot_y) = (r * x / (t + r), y / (t + 1.0));
    // rounding of t costs digits where the place is far out; on the ellipse it must lie anyway
    let norm = foot_x.hypot(foot_y);
    (foot_x / norm, foot_y / norm)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    /// Hand-worked: the equator at 6378.137 km, the pole at 6356.752 km.
    #[test]
    fn equator_and_pole_are_where_wgs_84_puts_them() {
        let at = |longitude, latitude, height_m| Geodetic { longitude, latitude, height_m }.itrf();
        assert!((at(0.0, 0.0, 100.0) - DVec3::X * 6_378_237.0).length() < 1e-6);
        assert!((at(1.0, FRAC_PI_2, 0.0) - DVec3::Z * 6_356_752.314_245).length() < 1e-5);
    }

    #[test]
    fn there_and_back_from_deep_to_far() {
        for height_m in [-6e6, -1e6, -500.0, -1e-3, 0.0, 1.0, 2225.0, 4e5, 3.6e7, 4e8, 1e12] {
            for latitude in [-FRAC_PI_2, -1.57, -1.0, -1e-9, 0.0, 1e-300, 1e-9, 0.3, 0.8, 1.2, 1.57, FRAC_PI_2] {
                for longitude in [-PI + 1e-9, -1.842, 0.0, 2.0, PI] {
                    let place = Geodetic { longitude, latitude, height_m };
                    let back = Geodetic::of(place.itrf());
                    let tolerance_m = 2e-9 + 4e-16 * height_m.abs();
                    assert!((back.height_m - height_m).abs() < tolerance_m, "{place:?} {back:?}");
                    // an error of latitude that moves the place by less than that on the surface
                    assert!((back.latitude - latitude).abs() * 6.4e6 < 2e-8, "{place:?} {back:?}");
                    assert!((place.itrf() - back.itrf()).length() < 4.0 * tolerance_m, "{place:?} {back:?}");
                }
            }
        }
    }

    /// SOFA's own inversion (Fukushima 2006), whose one step leaves 2e-11 rad at 20,000 km.
    #[test]
    fn agrees_with_sofa() {
        for height_m in [-1000.0, 0.0, 9000.0, 2e7, 4.2e7] {
            for k in -17..=17 {
                let xyz = Geodetic { longitude: 2.0, latitude: f64::from(k) * 0.09, height_m }.itrf();
                let (longitude, latitude, height) = sofars::coords::gc2gd(1, xyz.to_array()).expect("WGS 84");
                let own = Geodetic::of(xyz);
                assert!((own.longitude - longitude).abs() < 1e-15, "{own:?}");
                assert!((own.latitude - latitude).abs() < 3e-11, "{own:?} {latitude}");
                assert!((own.height_m - height).abs() < 5e-8, "{height_m} {k}");
            }
        }
    }

    #[test]
    fn the_centre_the_axis_and_nonsense() {
        let b = EARTH_RADIUS_M * (1.0 - EARTH_FLATTENING);
        let centre = Geodetic::of(DVec3::ZERO);
        assert_eq!((centre.latitude, centre.height_m), (FRAC_PI_2, -b));
        let south = Geodetic::of(DVec3::new(0.0, 0.0, -7e6));
        assert!((south.latitude + FRAC_PI_2).abs() < 1e-15 && (south.height_m - (7e6 - b)).abs() < 1e-8);
        // the nearest surface is never farther than the one at the geocentric latitude
        for k in 0..200 {
            let place = DVec3::new(f64::from(k) * 400.0, 3.0, f64::from((k * 37) % 200) * 300.0);
            let found = Geodetic::of(place);
            assert!(found.height_m < 0.0 && found.height_m >= -b - 1e-6 && (found.itrf() - place).length() < 1e-6);
        }
        assert!(Geodetic::of(DVec3::new(f64::NAN, 0.0, 0.0)).height_m.is_nan());
        assert!(Geodetic::of(DVec3::splat(f64::INFINITY)).latitude.is_nan());
    }
}
