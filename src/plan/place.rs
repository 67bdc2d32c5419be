//! Places of targets as the observer sees them.
//!
//! Light time is solved with the observer at the instant and the object one light time earlier. Seen from the
//! barycentric frame this gives the astrometric ICRS place, among the catalogue's stars; seen from the
//! geocentre's frame it gives the direction in GCRS axes. The two differ by the Earth's motion during the light
//! time, up to 20.6 arcsec. Neither contains aberration, which shifts stars and satellite alike.

use crate::astro::attitude::Surroundings;
use crate::astro::observer::{Observer, Site};
use crate::astro::orbit::{Orbit, State};
use crate::astro::time::Instant;
use crate::astro::{Error, separation, shadow};
use crate::base::constants::{DAY_S, LIGHT_M_S};
use glam::DVec3;

/// How an object moves.
#[derive(Debug, Clone)]
pub enum Motion {
    /// On an orbit.
    Orbit(Orbit),
    /// At an astrometric ICRS direction, at a range \[m\] if one is known.
    Fixed(DVec3, Option<f64>),
}

impl Motion {
    /// Age of the orbital elements at `t` \[days\], if there are any.
    pub fn element_age_days(&self, t: &Instant) -> Option<f64> {
        match self {
            Self::Orbit(orbit) => Some(t.since(&orbit.epoch()?) / DAY_S),
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
                let state =
                    range.map(|r| State { position: observer.gcrs + geocentric * r, velocity: DVec3::NAN });
                Ok(Place { astrometric: *astrometric, geocentric, range_m: range.unwrap_or(f64::NAN), state })
            }
            Self::Orbit(orbit) => {
                let now = orbit.gcrs(t)?;
                let first = (now.position - observer.gcrs).length() / LIGHT_M_S;
                let then = orbit.gcrs(&t.plus(-first))?;
                // one step of Newton's with the velocity leaves a nanometre
                let away = then.position - observer.gcrs;
                let closing = then.velocity.dot(away.normalize()) / LIGHT_M_S;
                let more = (away.length() / LIGHT_M_S - first) / (1.0 + closing);
                let state = State { position: then.position - then.velocity * more, velocity: then.velocity };
                let from_observer = state.position - observer.gcrs;
                // seen from the barycentre the path is longer or shorter by the Earth's motion, 1e-4 of it, and the
                // object is where it was at that light's time
                let geocentric_s = first + more;
                let path = (from_observer - observer.earth.velocity * geocentric_s).length();
                let barycentric_s = path / LIGHT_M_S;
                let barycentric = from_observer
                    - state.velocity * (barycentric_s - geocentric_s)
                    - observer.earth.velocity * barycentric_s;
                Ok(Place {
                    astrometric: barycentric.normalize(),
                    geocentric: from_observer.normalize(),
                    range_m: from_observer.length(),
                    state: Some(state),
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
    /// GCRS position and velocity when the light left, if known.
    pub state: Option<State>,
}

/// Directions of light at a target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Illumination {
    /// Share of the Sun's light that reaches the target, 0..1; 1 if the target's distance is unknown.
    pub sunlit: f64,
    /// Angle Sun - target - observer \[rad\]; from the directions alone if the distance is unknown.
    pub phase: f64,
    /// Unit vector from the target to the Sun, ICRS axes.
    pub to_sun: DVec3,
    /// Unit vector from the target to the observer, ICRS axes.
    pub to_observer: DVec3,
}

impl Place {
    /// The apparent Sun from the geocentre when the light left the target \[m\].
    pub fn sun(&self, observer: &Observer) -> DVec3 {
        let light_time = if self.range_m.is_nan() { 0.0 } else { self.range_m / LIGHT_M_S };
        observer.earth.sun_apparent(light_time)
    }

    /// How the target is lit, seen by `observer`.
    pub fn illumination(&self, observer: &Observer) -> Illumination {
        let sun = self.sun(observer);
        let (to_sun, to_observer, sunlit) = match self.state {
            Some(State { position, .. }) => {
                (sun - position, observer.gcrs - position, shadow::sunlit(position, sun, observer.pole))
            }
            None => (sun, -self.geocentric, 1.0),
        };
        Illumination {
            sunlit,
            phase: separation(to_sun, to_observer),
            to_sun: to_sun.normalize(),
            to_observer: to_observer.normalize(),
        }
    }

    /// What the target may point at; NaN where it is not known.
    pub fn surroundings(&self, light: &Illumination) -> Surroundings {
        let along = |f: fn(&State) -> DVec3| self.state.map_or(DVec3::NAN, |s| f(&s).normalize());
        Surroundings {
            earth: along(|s| -s.position),
            sun: light.to_sun,
            velocity: along(|s| s.velocity),
            observer: light.to_observer,
        }
    }
}
