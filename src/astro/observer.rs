//! The observer: from astrometric directions to the sky above the station, and back.
//!
//! Aberration: the relativistic form of SOFA's `ab` (Explanatory Supplement 2013, eq. 7.40), with the
//! velocity of the observer in the barycentric frame (stars) or the geocentric one (satellites, Moon).
//! Refraction: A tan z + B tan^3 z with SOFA's `refco` constants at 0.55 um, damped below 3 deg elevation as
//! SOFA's `atioq` does. Light deflection by the Sun (4 mas at 90 deg from it) belongs to the apparent place of a star
//! ([`super::star`]) and is left out of the map between a frame's pixels and astrometric places.
//!
//! Nothing but [`Site`] assumes the ground: an [`Observer`] is a position, a velocity and local axes.

use super::bodies::EarthState;
use super::earth::Orientation;
use super::geodetic::Geodetic;
use super::{Error, time::Instant};
use crate::base::constants::{EARTH_RATE_RAD_S, LIGHT_M_S};
use crate::base::units::wrap_two_pi;
use glam::{DMat3, DQuat, DVec3};

/// Effective wavelength of the refraction constants \[um\].
const REFRACTION_UM: f64 = 0.55;

/// A place on the Earth and its air.
#[derive(Debug, Clone, Copy)]
pub struct Site {
    /// ITRF position \[m\].
    pub itrf: DVec3,
    /// ITRF components to east, north, up components; up is the geodetic zenith.
    pub itrf_to_enu: DMat3,
    /// Refraction constants A and B \[rad\]; zero without air.
    pub refraction: [f64; 2],
}

/// Pressure, temperature and humidity at the station.
#[derive(Debug, Clone, Copy)]
pub struct Air {
    /// Pressure \[hPa\]; 0 = no refraction.
    pub pressure_hpa: f64,
    /// Temperature \[deg C\].
    pub temperature_c: f64,
    /// Relative humidity, 0..1.
    pub humidity: f64,
}

impl Site {
    /// The site at geodetic longitude (east +), latitude \[rad\] and height \[m\] (WGS 84).
    pub fn new(longitude: f64, latitude: f64, height_m: f64, air: &Air) -> Self {
        let (sin_lon, cos_lon) = longitude.sin_cos();
        let (sin_lat, cos_lat) = latitude.sin_cos();
        let east = DVec3::new(-sin_lon, cos_lon, 0.0);
        let north = DVec3::new(-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat);
        let up = DVec3::new(cos_lat * cos_lon, cos_lat * sin_lon, sin_lat);
        let (a, b) = if air.pressure_hpa > 0.0 {
            sofars::astro::refco(air.pressure_hpa, air.temperature_c, air.humidity, REFRACTION_UM)
        } else {
            (0.0, 0.0)
        };
        Self {
            itrf: Geodetic { longitude, latitude, height_m }.itrf(),
            itrf_to_enu: DMat3::from_cols(east, north, up).transpose(),
            refraction: [a, b],
        }
    }
}

/// The observer at one instant.
#[derive(Debug, Clone, Copy)]
pub struct Observer {
    /// GCRS position \[m\].
    pub gcrs: DVec3,
    /// Geocentric velocity, GCRS axes \[m/s\].
    pub velocity: DVec3,
    /// The Earth in the barycentric frame.
    pub earth: EarthState,
    /// The Earth's axis (z of the ITRF), GCRS.
    pub pole: DVec3,
    gcrs_to_local: DMat3,
    refraction: [f64; 2],
}

impl Observer {
    /// An observer in space, at a position \[m\] with a velocity \[m/s\] (GCRS): no horizon and no air. The local axes
    /// are those of the GCRS.
    ///
    /// # Errors
    /// [`Error::EpochOutsideTable`] where the Earth's orientation is unknown.
    pub fn in_space(gcrs: DVec3, velocity: DVec3, t: &Instant) -> Result<Self, Error> {
        Ok(Self {
            gcrs,
            velocity,
            earth: EarthState::at(t),
            pole: Orientation::at(t)?.gcrs_to_itrf.row(2),
            gcrs_to_local: DMat3::IDENTITY,
            refraction: [0.0, 0.0],
        })
    }

    /// The observer at `site` at `t`.
    ///
    /// # Errors
    /// [`Error::EpochOutsideTable`] where the Earth's orientation is unknown.
    pub fn at(site: &Site, t: &Instant) -> Result<Self, Error> {
        let orientation = Orientation::at(t)?;
        let to_gcrs = orientation.gcrs_to_itrf.transpose();
        let velocity = DVec3::new(0.0, 0.0, EARTH_RATE_RAD_S).cross(site.itrf);
        Ok(Self {
            gcrs: to_gcrs * site.itrf,
            velocity: to_gcrs * velocity,
            earth: EarthState::at(t),
            pole: orientation.gcrs_to_itrf.row(2),
            gcrs_to_local: site.itrf_to_enu * orientation.gcrs_to_itrf,
            refraction: site.refraction,
        })
    }

    /// Observed direction (east, north, up; aberrated, refracted) of an astrometric ICRS direction.
    pub fn observed(&self, astrometric: DVec3) -> DVec3 {
        self.refracted(self.gcrs_to_local * aberrated(astrometric.normalize(), self.barycentric_velocity()))
    }

    /// Astrometric ICRS direction of an observed one: the inverse of [`Self::observed`].
    pub fn astrometric(&self, observed: DVec3) -> DVec3 {
        let airless = self.unrefracted(observed.normalize());
        let apparent = self.gcrs_to_local.transpose() * airless;
        unaberrated(apparent, self.barycentric_velocity())
    }

    /// Airless direction (east, north, up) of an astrometric direction, aberrated as a star's.
    pub fn airless(&self, astrometric: DVec3) -> DVec3 {
        self.gcrs_to_local * aberrated(astrometric.normalize(), self.barycentric_velocity())
    }

    /// Airless direction (east, north, up) of a vector in GCRS axes from the observer to a body that shares
    /// the Earth's motion (light time taken): only diurnal aberration is applied.
    pub fn airless_geocentric(&self, from_observer: DVec3) -> DVec3 {
        self.gcrs_to_local * aberrated(from_observer.normalize(), self.velocity)
    }

    /// The zenith in ICRS axes.
    pub fn zenith(&self) -> DVec3 {
        self.gcrs_to_local.row(2)
    }

    /// The same observer with the horizon tilted: what was seen airless towards `from` (east, north, up) is seen towards
    /// `to`, along the great circle between them. Nothing else changes.
    #[must_use]
    pub fn tilted(&self, from: DVec3, to: DVec3) -> Self {
        let turn = DMat3::from_quat(DQuat::from_rotation_arc(from.normalize(), to.normalize()));
        Self { gcrs_to_local: turn * self.gcrs_to_local, ..*self }
    }

    /// Velocity in the barycentric frame \[m/s\].
    pub fn barycentric_velocity(&self) -> DVec3 {
        self.earth.velocity + self.velocity
    }

    /// An airless direction lifted by refraction.
    pub fn refracted(&self, airless: DVec3) -> DVec3 {
        // below 3 deg elevation the expansion in tan z fails: SOFA holds the sine there, and so do we
        const MIN_SIN: f64 = 0.05;
        let [a, b] = self.refraction;
        let across = airless.x.hypot(airless.y).max(1e-6);
        let up = airless.z.max(MIN_SIN);
        let tan_z = across / up;
        let w = b * tan_z * tan_z;
        let lift = (a + w) * tan_z / (1.0 + (a + 3.0 * w) / (up * up));
        let (sin, cos) = lift.sin_cos();
        let shrink = cos - sin * airless.z / across;
        DVec3::new(airless.x * shrink, airless.y * shrink, airless.z * cos + across * sin).normalize()
    }

    /// An observed direction without refraction, by fixed-point iteration; bounded, converged to 1e-12 rad in
    /// 4 to 6 steps above 3 deg elevation.
    pub fn unrefracted(&self, observed: DVec3) -> DVec3 {
        let mut airless = observed;
        for _ in 0..20 {
            let step = observed - self.refracted(airless);
            airless = (airless + step).normalize();
            if step.length() < 1e-14 {
                break;
            }
        }
        airless
    }
}

/// Standard pressure \[hPa\] at a height \[m\]: U.S. Standard Atmosphere 1976, troposphere.
pub fn standard_pressure_hpa(height_m: f64) -> f64 {
    1013.25 * libm::pow((1.0 - 2.25577e-5 * height_m).clamp(0.0, 1.01), 5.25588)
}

/// Azimuth from north, clockwise, in \[0, 2 pi), and elevation \[rad\] of an (east, north, up) vector.
pub fn azimuth_elevation(enu: DVec3) -> (f64, f64) {
    (wrap_two_pi(enu.x.atan2(enu.y)), enu.z.atan2(enu.x.hypot(enu.y)))
}

/// The (east, north, up) unit vector of azimuth (from north, clockwise) and elevation \[rad\].
pub fn enu(azimuth: f64, elevation: f64) -> DVec3 {
    let (sin, cos) = azimuth.sin_cos();
    DVec3::new(elevation.cos() * sin, elevation.cos() * cos, elevation.sin())
}

/// Direction seen by an observer moving with `velocity` \[m/s\]; the Sun's potential (0.4 uas) is left out.
fn aberrated(direction: DVec3, velocity: DVec3) -> DVec3 {
    let v = (velocity / LIGHT_M_S).to_array();
    let bm1 = (1.0 - DVec3::from_array(v).length_squared()).sqrt();
    DVec3::from_array(sofars::astro::ab(&direction.to_array(), &v, 1e30, bm1)).normalize()
}

/// The inverse of [`aberrated`], by fixed-point iteration (each step gains four digits).
fn unaberrated(apparent: DVec3, velocity: DVec3) -> DVec3 {
    let mut direction = apparent;
    for _ in 0..8 {
        direction = (direction + apparent - aberrated(direction, velocity)).normalize();
    }
    direction
}

/// Airmass at an apparent elevation \[rad\]. Pickering 2002, DIO 12, 3; at the horizon 38.7; below it the
/// horizon's value.
pub fn airmass(apparent_elevation: f64) -> f64 {
    let h = apparent_elevation.to_degrees().max(0.0);
    1.0 / (h + 244.0 / (165.0 + 47.0 * h.powf(1.1))).to_radians().sin()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::units::ARCSEC;

    fn pogs() -> Observer {
        let air = Air { pressure_hpa: 780.0, temperature_c: 10.0, humidity: 0.2 };
        let site = Site::new((-105.533333f64).to_radians(), 32.9f64.to_radians(), 2225.0, &air);
        Observer::at(&site, &Instant::from_utc("2018-01-20T03:00:00").expect("a date")).expect("inside")
    }

    #[test]
    fn observed_and_astrometric_are_inverse_to_a_microarcsecond() {
        let observer = pogs();
        for elevation in [5.0f64, 10.0, 30.0, 60.0, 89.9, 90.0] {
            for azimuth in [0.0, 1.0, 4.0] {
                let up = enu(azimuth, elevation.to_radians());
                let back = observer.observed(observer.astrometric(up));
                let error = crate::astro::separation(up, back) / ARCSEC;
                assert!(error < 1e-6, "{elevation} deg: {error} arcsec");
            }
        }
    }

    /// SOFA's own chain of a star (with light deflection) agrees within the deflection left out.
    #[test]
    fn observed_places_agree_with_sofa() {
        let t = Instant::from_utc("2018-01-20T03:00:00").expect("a date");
        let observer = pogs();
        let eop = crate::astro::eop::at(&t).expect("inside");
        let mut astrom = sofars::astro::IauAstrom::default();
        let mut eo = 0.0;
        let (day, fraction) = t.utc_mjd();
        let dut1 = eop.ut1_minus_tai + t.leap_seconds();
        let (lon, lat) = ((-105.533333f64).to_radians(), 32.9f64.to_radians());
        sofars::astro::apco13(
            2_400_000.5 + day,
            fraction,
            dut1,
            lon,
            lat,
            2225.0,
            eop.xp,
            eop.yp,
            780.0,
            10.0,
            0.2,
            0.55,
            &mut astrom,
            &mut eo,
        )
        .expect("a good date");
        for (ra, dec) in [(1.2, 0.3), (0.5, -0.3), (1.0, 0.9)] {
            let (ri, di) = sofars::astro::atciqz(ra, dec, &mut astrom);
            let (az, zd, ..) = sofars::astro::atioq(ri, di, &astrom);
            let expected = enu(az, std::f64::consts::FRAC_PI_2 - zd);
            let error =
                crate::astro::separation(expected, observer.observed(crate::astro::direction(ra, dec))) / ARCSEC;
            assert!(error < 0.008, "{error} arcsec");
        }
    }

    /// Nothing but the local axes and the air tells an observer on the ground from one in space.
    #[test]
    fn an_observer_in_space_sees_the_same_stars_and_satellites() {
        let t = Instant::from_utc("2018-01-20T03:00:00").expect("a date");
        let ground = pogs();
        let space = Observer::in_space(ground.gcrs, ground.velocity, &t).expect("inside");
        assert_eq!((space.gcrs, space.pole), (ground.gcrs, ground.pole));
        for place in [crate::astro::direction(1.2, 0.3), crate::astro::direction(4.0, -1.5)] {
            // aberrated alike: 20 arcsec of the Earth's motion, 0.3 of the ground's
            let turned = ground.gcrs_to_local.transpose() * ground.airless(place);
            assert!(crate::astro::separation(turned, space.observed(place)) < 1e-14);
            assert!(crate::astro::separation(space.astrometric(space.observed(place)), place) < 1e-14);
        }
        // in a low orbit the aberration is that of its own speed
        let low = Observer::in_space(DVec3::X * 7e6, DVec3::Y * 7.5e3, &t).expect("inside");
        let still = Observer::in_space(DVec3::X * 7e6, DVec3::ZERO, &t).expect("inside");
        let shift = crate::astro::separation(low.observed(DVec3::Z), still.observed(DVec3::Z)) / ARCSEC;
        assert!((shift - 7.5e3 / LIGHT_M_S / ARCSEC).abs() < 0.01, "{shift}");
    }

    #[test]
    fn airmass_at_tabulated_elevations() {
        assert!((airmass(90f64.to_radians()) - 1.0).abs() < 1e-4);
        assert!((airmass(30f64.to_radians()) - 1.994).abs() < 2e-3);
        assert!((airmass(0.0) - 38.75).abs() < 0.1);
        assert!(airmass(-1.0).is_finite());
    }

    #[test]
    fn refraction_is_bounded_everywhere() {
        let observer = pogs();
        for elevation in -90..=90 {
            let up = enu(1.0, f64::from(elevation).to_radians());
            let lift = crate::astro::separation(up, observer.refracted(up)).to_degrees();
            assert!(lift < 0.5, "{elevation}: {lift}");
        }
    }
}
