//! Orbits: where an object is, from its elements, its state or its ephemeris.
//!
//! ```text
//! two-line sets, orbit mean-elements messages -> mean elements -> SGP4/SDP4
//! state vectors, osculating elements          -> numerical integration
//! orbit ephemeris messages                    -> interpolation
//! ```

pub mod catalogue;
pub mod elements;
pub mod force;
pub mod interpolate;
pub mod kepler;
pub mod numerical;
pub mod oem;
pub mod omm;
pub mod radau;
pub mod sgp4;
pub mod tle;

use super::{Error, time::Instant};
use glam::DVec3;

/// Position and velocity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State {
    /// Position \[m\].
    pub position: DVec3,
    /// Velocity \[m/s\].
    pub velocity: DVec3,
}

/// An object on an orbit.
#[derive(Debug, Clone)]
pub enum Orbit {
    /// By mean elements and SGP4.
    Mean(Box<sgp4::Sgp4>),
    /// By numerical integration from a state.
    Numerical(numerical::Numerical),
    /// By a table of states.
    Ephemeris(Box<oem::Ephemeris>),
}

impl Orbit {
    /// GCRS position and velocity at `t`.
    ///
    /// # Errors
    /// [`Error::Propagation`] where the orbit is not known, [`Error::EpochOutsideTable`] for an epoch without orientation.
    pub fn gcrs(&self, t: &Instant) -> Result<State, Error> {
        match self {
            Self::Mean(sgp4) => sgp4.gcrs(t),
            Self::Numerical(numerical) => numerical.gcrs(t),
            Self::Ephemeris(table) => table.gcrs(t),
        }
    }

    /// Epoch of the elements or of the state; none for a table.
    pub fn epoch(&self) -> Option<Instant> {
        match self {
            Self::Mean(sgp4) => Some(sgp4.epoch()),
            Self::Numerical(numerical) => Some(numerical.epoch()),
            Self::Ephemeris(_) => None,
        }
    }

    /// How it is computed, in words.
    pub fn describe(&self) -> String {
        match self {
            Self::Mean(_) => "SGP4".into(),
            Self::Numerical(numerical) => {
                format!("integrated with {}; no drag, no pressure of sunlight", numerical.forces().describe())
            }
            Self::Ephemeris(_) => "ephemeris".into(),
        }
    }
}
