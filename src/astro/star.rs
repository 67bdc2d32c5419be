//! Stars: from the catalogue's place to the sky above the station.
//!
//! Space motion and parallax after SOFA's `pmpx` (Explanatory Supplement 2013, section 7.2: light time across the Earth's
//! orbit included, no relativistic Doppler terms), deflection by the Sun after SOFA's `ldsun`, then the observer's
//! aberration, axes and refraction.

use super::observer::Observer;
use super::time::Instant;
use crate::base::constants::AU_M;
use glam::DVec3;

/// A star as a catalogue of epoch J2000.0 has it, ICRS.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Star {
    /// Right ascension \[rad\].
    pub ra: f64,
    /// Declination \[rad\].
    pub dec: f64,
    /// Proper motion (d RA/dt) cos Dec \[rad per Julian year\].
    pub pm_ra_cos_dec: f64,
    /// Proper motion d Dec/dt \[rad per Julian year\].
    pub pm_dec: f64,
    /// Parallax \[rad\].
    pub parallax: f64,
    /// Radial velocity, receding + \[km/s\].
    pub radial_velocity_km_s: f64,
}

impl Star {
    /// Astrometric ICRS direction at `t` for an observer: space motion and parallax, neither aberration nor deflection.
    pub fn astrometric(&self, observer: &Observer, t: &Instant) -> DVec3 {
        let (day, fraction) = t.tt();
        let years = ((day - 2_451_545.0) + fraction) / 365.25;
        let from_barycentre = (observer.earth.position + observer.gcrs) / AU_M;
        // SOFA takes d RA/dt; at a pole the motion in right ascension is none
        let cos_dec = self.dec.cos();
        let pm_ra = if cos_dec > 1e-12 { self.pm_ra_cos_dec / cos_dec } else { 0.0 };
        DVec3::from_array(sofars::astro::pmpx(
            self.ra,
            self.dec,
            pm_ra,
            self.pm_dec,
            self.parallax / crate::base::units::ARCSEC,
            self.radial_velocity_km_s,
            years,
            from_barycentre.to_array(),
        ))
    }

    /// Airless apparent direction in the observer's local axes (east, north, up on the ground).
    pub fn airless(&self, observer: &Observer, t: &Instant) -> DVec3 {
        let from_sun = observer.gcrs - observer.earth.to_sun;
        let distance = from_sun.length();
        let deflected = sofars::astro::ldsun(
            self.astrometric(observer, t).to_array(),
            (from_sun / distance).to_array(),
            distance / AU_M,
        );
        observer.airless(DVec3::from_array(deflected))
    }

    /// Apparent direction in the observer's local axes, refracted.
    pub fn apparent(&self, observer: &Observer, t: &Instant) -> DVec3 {
        observer.refracted(self.airless(observer, t))
    }
}
