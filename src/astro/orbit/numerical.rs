//! Orbits from a state vector, integrated numerically.
//!
//! Steps go outward from the epoch and are kept, so that a place depends on its instant alone, not on what was asked
//! before.

use super::State;
use super::force::Forces;
use super::kepler::Kepler;
use super::radau::{Step, Walk};
use crate::astro::{Error, time::Instant};
use crate::base::constants::{EARTH_GM, EARTH_RADIUS_M};
use std::sync::{Arc, Mutex, PoisonError};

/// Steps kept to either side; a low orbit takes some 300 a day.
const MOST_STEPS: usize = 200_000;

/// An object on an integrated orbit.
#[derive(Debug, Clone)]
pub struct Numerical {
    name: String,
    epoch: Instant,
    forces: Forces,
    sides: Arc<[Mutex<Side>; 2]>,
}

/// The steps to one side of the epoch.
#[derive(Debug)]
struct Side {
    walk: Walk,
    steps: Vec<Step>,
    /// Why there are no more.
    end: Option<String>,
}

impl Numerical {
    /// The object with a GCRS `state` at `epoch`. Forces that move it by less than `tolerance_m` within `span_s` of the
    /// epoch are left out.
    ///
    /// # Errors
    /// [`Error::Elements`] for a state inside the Earth or without finite numbers.
    pub fn new(name: &str, epoch: Instant, state: State, span_s: f64, tolerance_m: f64) -> Result<Self, Error> {
        let fault = |reason: String| Error::Elements { name: name.to_owned(), reason };
        let radius = state.position.length();
        if !(state.position.is_finite() && state.velocity.is_finite()) {
            return Err(fault("position and velocity must be finite numbers".into()));
        }
        if radius < EARTH_RADIUS_M {
            return Err(fault(format!(
                "it is {:.1} km from the Earth's centre at its epoch, which must be above {:.1} km",
                radius / 1e3,
                EARTH_RADIUS_M / 1e3
            )));
        }
        let ellipse = Kepler::of(&state, EARTH_GM);
        let (perigee, apogee) = ellipse.map_or_else(
            || (EARTH_RADIUS_M, radius + state.velocity.length() * span_s.abs()),
            |k| ((k.a * (1.0 - k.e)).max(EARTH_RADIUS_M), k.a * (1.0 + k.e)),
        );
        let forces = Forces::needed(perigee, apogee.max(radius), span_s, tolerance_m);
        // a hundredth of the time in which gravity would turn the motion round
        let first = (0.01 * (radius.powi(3) / EARTH_GM).sqrt()).min(86_400.0);
        let side = |length| Mutex::new(Side { walk: Walk::new(state, length), steps: Vec::new(), end: None });
        Ok(Self { name: name.to_owned(), epoch, forces, sides: Arc::new([side(first), side(-first)]) })
    }

    /// When the state holds.
    pub fn epoch(&self) -> Instant {
        self.epoch
    }

    /// The forces it feels.
    pub fn forces(&self) -> Forces {
        self.forces
    }

    /// GCRS position and velocity at `t`.
    ///
    /// # Errors
    /// [`Error::Propagation`] where the orbit has entered the Earth or is too far from its epoch;
    /// [`Error::EpochOutsideTable`] for an epoch without orientation.
    pub fn gcrs(&self, t: &Instant) -> Result<State, Error> {
        let seconds = t.since(&self.epoch);
        let backwards = seconds < 0.0;
        let side = &self.sides[usize::from(backwards)];
        let mut side = side.lock().unwrap_or_else(PoisonError::into_inner);
        let reached = |step: &Step| if backwards { step.end() <= seconds } else { step.end() >= seconds };
        while !side.steps.last().is_some_and(reached) {
            self.extend(&mut side)?;
            if let Some(reason) = &side.end {
                return Err(Error::Propagation {
                    name: self.name.clone(),
                    utc: t.iso_utc(),
                    reason: reason.clone(),
                });
            }
        }
        let at = side.steps.partition_point(|step| !reached(step));
        // the last step reaches it
        Ok(side.steps[at.min(side.steps.len() - 1)].at(seconds))
    }

    fn extend(&self, side: &mut Side) -> Result<(), Error> {
        if side.end.is_some() {
            return Ok(());
        }
        if side.steps.len() >= MOST_STEPS {
            let days = side.steps.last().map_or(0.0, |s| s.end() / 86_400.0);
            side.end = Some(format!("farther than {days:.0} days from the epoch of its state"));
            return Ok(());
        }
        let step = side.walk.step(|s, r| self.forces.acceleration(&self.epoch.plus(s), r))?;
        match step {
            Some(step) if step.at(step.end()).position.length() >= EARTH_RADIUS_M => side.steps.push(step),
            step => {
                let end = side.steps.last().map_or(self.epoch, |s| self.epoch.plus(s.end())).iso_utc();
                side.end = Some(match step {
                    Some(_) => format!("it meets the Earth after {end} UTC"),
                    None => format!("it cannot be integrated beyond {end} UTC: steps shrink to nothing"),
                });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn epoch() -> Instant {
        Instant::from_utc("2018-01-20T00:00:00").expect("a date")
    }

    fn ring(a: f64, e: f64, i: f64) -> State {
        Kepler { a, e, i, raan: 0.4, argp: 0.5, mean_anomaly: 0.6 }.state(EARTH_GM)
    }

    fn object(state: State) -> Numerical {
        Numerical::new("X", epoch(), state, 86_400.0, 0.1).expect("a state")
    }

    #[test]
    fn a_place_does_not_depend_on_what_was_asked_before() {
        let (one, other) = (object(ring(7e6, 0.01, 1.0)), object(ring(7e6, 0.01, 1.0)));
        let far = one.gcrs(&epoch().plus(90_000.0)).expect("a place");
        for k in 0..50 {
            other.gcrs(&epoch().plus(f64::from((k * 7919) % 90_001) - 40_000.0)).expect("a place");
        }
        assert_eq!(other.gcrs(&epoch().plus(90_000.0)).expect("a place"), far);
    }

    /// Node and perigee turn as first-order theory says (Vallado 2013, eqs 9.37-9.39), within the second order.
    #[test]
    fn flattening_turns_node_and_perigee() {
        let (a, e, i) = (7.2e6, 0.05, 0.9f64);
        let object = object(ring(a, e, i));
        assert_eq!(object.forces(), Forces::ALL);
        let days = 10.0;
        let then = Kepler::of(&object.gcrs(&epoch().plus(days * 86_400.0)).expect("a place"), EARTH_GM)
            .expect("an ellipse");
        let p = a * (1.0 - e * e);
        let rate = 1.5 * 1.0826e-3 * (6_378_136.3 / p).powi(2) * (EARTH_GM / a.powi(3)).sqrt() * 86_400.0 * days;
        assert!((then.raan - 0.4 + rate * i.cos()).abs() < 0.02 * rate, "{} {rate}", then.raan);
        let expected = 0.5 + rate * (2.0 - 2.5 * i.sin().powi(2));
        let turned = (then.argp - expected + 3.0).rem_euclid(std::f64::consts::TAU) - 3.0;
        assert!(turned.abs() < 0.06 * rate, "{turned} {rate}");
    }

    #[test]
    fn states_that_cannot_be_are_refused_and_falls_end_with_a_time() {
        let refused = |state| Numerical::new("X", epoch(), state, 1.0, 1.0).expect_err("no orbit").to_string();
        assert!(refused(State { position: DVec3::X * 6e6, velocity: DVec3::ZERO }).contains("6000.0 km"));
        assert!(refused(State { position: DVec3::NAN, velocity: DVec3::ZERO }).contains("finite"));
        let falling = object(State { position: DVec3::X * 8e6, velocity: DVec3::Y * 3e3 });
        let error = falling.gcrs(&epoch().plus(1e5)).expect_err("it falls").to_string();
        assert!(error.contains("meets the Earth after 2018-01-20T00:"), "{error}");
        assert!(falling.gcrs(&epoch().plus(60.0)).is_ok());
    }

    #[test]
    fn a_hyperbola_is_an_orbit_like_another() {
        let fast = object(State { position: DVec3::X * 8e6, velocity: DVec3::Y * 12e3 });
        let then = fast.gcrs(&epoch().plus(86_400.0)).expect("a place");
        // energy: v^2/2 - GM/r stays within what Sun and Moon do
        let energy = |s: &State| 0.5 * s.velocity.length_squared() - EARTH_GM / s.position.length();
        let before = 0.5 * 144e6 - EARTH_GM / 8e6;
        assert!((energy(&then) / before - 1.0).abs() < 5e-3 && then.position.length() > 4e8);
    }
}
