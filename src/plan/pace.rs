//! How fast an object can move across the sky: what a search may skip.
//!
//! Seen at a distance d, something with speed v turns by at most ln(d/(d - v t)) in a time t: the angle whose rate grows as
//! the distance shrinks. Perigee's escape speed bounds the speed of an ellipse.

use super::place::Motion;
use crate::astro::orbit::kepler::Kepler;
use crate::astro::time::Instant;
use crate::base::constants::{EARTH_GM, EARTH_RADIUS_M, EARTH_RATE_RAD_S};

/// How fast an object can move.
#[derive(Debug, Clone, Copy)]
pub struct Pace {
    /// Greatest speed against the observer \[m/s\]; none for one fixed among the stars.
    speed: Option<f64>,
    /// Greatest rate of the Sun against the Earth's limb, seen from it \[rad/s\].
    pub limb_rate: f64,
    /// Time in which it surely turns by no more than a tenth of a radian about the Earth \[s\].
    pub turn_s: f64,
}

impl Pace {
    /// Of a motion; `t` is a time at which it is likely known.
    pub fn of(motion: &Motion, t: &Instant) -> Self {
        let Motion::Orbit(orbit) = motion else {
            return Self { speed: None, limb_rate: 2.0 * EARTH_RATE_RAD_S, turn_s: 900.0 };
        };
        let state = orbit.gcrs(t).or_else(|e| orbit.epoch().map_or(Err(e), |epoch| orbit.gcrs(&epoch))).ok();
        let lowest = EARTH_RADIUS_M + 1e5;
        // perigee may sink a little under perturbations
        let ellipse = state.and_then(|s| Kepler::of(&s, EARTH_GM));
        let perigee = ellipse.map_or(lowest, |k| 0.98 * (k.a * (1.0 - k.e)).max(lowest));
        // escape speed bounds every ellipse; a hyperbola is faster by its energy
        let energy = state.map_or(0.0, |s| s.velocity.length_squared() - 2.0 * EARTH_GM / s.position.length());
        let fastest = (2.0 * EARTH_GM / perigee + energy.max(0.0)).sqrt();
        let limb = (perigee * perigee - EARTH_RADIUS_M * EARTH_RADIUS_M).max(1e10).sqrt();
        Self {
            speed: Some(1.05 * fastest + 500.0),
            limb_rate: 1.05 * fastest / perigee * (1.0 + EARTH_RADIUS_M / limb) + 1e-6,
            turn_s: 0.1 * perigee / fastest,
        }
    }

    /// How long \[s\] an angle of that size surely stays on its side of 0, for an object at a range \[m\].
    pub fn safe_s(&self, angle: f64, range_m: f64) -> f64 {
        // refraction stretches angles at the horizon by a tenth at most, and the ground turns
        let angle = angle.abs() / 1.1;
        match self.speed {
            None => angle / (1.1 * EARTH_RATE_RAD_S),
            Some(speed) => range_m / (speed + EARTH_RATE_RAD_S * range_m) * -(-angle).exp_m1(),
        }
    }
}
