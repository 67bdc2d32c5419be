//! Places of targets as the observer sees them.
//!
//! Light time is solved with the observer at the instant and the object one light time earlier. Seen from the
//! barycentric frame this gives the astrometric ICRS place, among the catalogue's stars; seen from the
//! geocentre's frame it gives the direction in GCRS axes. The two differ by the Earth's motion during the light
//! time, up to 20.6 arcsec. Neither contains aberration, which shifts stars and satellite alike.

use crate::astro::observer::{Observer, Site};
use crate::astro::orbit::Satellite;
use crate::astro::time::Instant;
use crate::astro::{Error, bodies, direction, separation, shadow};
use crate::base::constants::LIGHT_M_S;
use crate::scene::{Orbit, Target};
use glam::DVec3;

/// How an object moves.
#[derive(Debug, Clone)]
pub enum Motion {
    /// On an orbit.
    Orbit(Box<Satellite>),
    /// At an astrometric ICRS direction, at a range \[m\] if one is known.
    Fixed(DVec3, Option<f64>),
}

impl Motion {
    /// The motion of a scene's target.
    ///
    /// # Errors
    /// [`Error::Elements`] for element sets that SGP4 cannot use.
    pub fn of(target: &Target) -> Result<Self, Error> {
        Ok(match &target.orbit {
            Orbit::Tle { line1, line2, .. } => {
                Self::Orbit(Box::new(Satellite::from_tle(&target.name, line1, line2)?))
            }
            Orbit::Fixed { ra_deg, dec_deg, range_km } => {
                Self::Fixed(direction(ra_deg.to_radians(), dec_deg.to_radians()), range_km.map(|km| km * 1e3))
            }
        })
    }

    /// Age of the orbital elements at `t` \[days\], if there are any.
    pub fn element_age_days(&self, t: &Instant) -> Option<f64> {
        match self {
            Self::Orbit(satellite) => Some(t.since(&satellite.epoch()) / crate::base::constants::DAY_S),
            Self::Fixed(..) => None,
        }
    }

    /// The place at `t` for an observer at `site`.
    ///
    /// # Errors
    /// Whatever the propagation says.
    pub fn place(&self, site: &Site, t: &Instant) -> Result<Place, Error> {
        self.place_from(&Observer::at(site, t)?, t)
    }

    /// The place at `t` for an observer known at `t`.
    ///
    /// # Errors
    /// Whatever the propagation says.
    pub fn place_from(&self, observer: &Observer, t: &Instant) -> Result<Place, Error> {
        match self {
            Self::Fixed(astrometric, range) => {
                // the geocentric light time undoes the Earth's motion during it, whatever the range
                let geocentric = (*astrometric + observer.earth.velocity / LIGHT_M_S).normalize();
                let position = range.map(|r| observer.gcrs + geocentric * r);
                Ok(Place { astrometric: *astrometric, geocentric, range_m: range.unwrap_or(f64::NAN), position })
            }
            Self::Orbit(satellite) => {
                let mut light_time = 0.13;
                let mut position = DVec3::ZERO;
                // each step gains five digits: the object moves below 1e-4 of the light path
                for _ in 0..3 {
                    position = satellite.gcrs(&t.plus(-light_time))?;
                    light_time = (position - observer.gcrs).length() / LIGHT_M_S;
                }
                let from_observer = position - observer.gcrs;
                let barycentric = from_observer - observer.earth.velocity * light_time;
                Ok(Place {
                    astrometric: barycentric.normalize(),
                    geocentric: from_observer.normalize(),
                    range_m: from_observer.length(),
                    position: Some(position),
                })
            }
        }
    }
}

/// A target's place at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Topocentric astrometric ICRS direction.
    pub astrometric: DVec3,
    /// Topocentric direction in GCRS axes, with geocentric light time.
    pub geocentric: DVec3,
    /// Distance the light has come \[m\]; NaN if unknown.
    pub range_m: f64,
    /// GCRS position when the light left \[m\], if known.
    pub position: Option<DVec3>,
}

/// Directions of light at a target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Illumination {
    /// Share of the Sun's disc seen from the target, 0..1; 1 if the target's distance is unknown.
    pub sunlit: f64,
    /// Angle Sun - target - observer \[rad\]; from the directions alone if the distance is unknown.
    pub phase: f64,
    /// Unit vector from the target to the Sun, ICRS axes.
    pub to_sun: DVec3,
    /// Unit vector from the target to the observer, ICRS axes.
    pub to_observer: DVec3,
}

impl Place {
    /// How the target is lit at `t`, seen by `observer`.
    pub fn illumination(&self, observer: &Observer, t: &Instant) -> Illumination {
        let sun = bodies::EarthState::at(t).to_sun;
        let (to_sun, to_observer, sunlit) = match self.position {
            Some(position) => (sun - position, observer.gcrs - position, shadow::sunlit(position, sun)),
            None => (sun, -self.geocentric, 1.0),
        };
        Illumination {
            sunlit,
            phase: separation(to_sun, to_observer),
            to_sun: to_sun.normalize(),
            to_observer: to_observer.normalize(),
        }
    }
}
