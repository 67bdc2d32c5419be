//! EXPERIMENTAL: how a body without torque tumbles, from its light alone.
//!
//! The motion is that of [`crate::astro::tumble`], in principal axes: three unknowns of attitude, three of rate, two of inertia (Kaasalainen
//! 2001, A&A 376, 302, counts eight too). Moments are I_1 = S_2 + S_3 and so on, S the mass's mean squares along the axes: with log(S_1/S_3) and
//! log(S_2/S_3) unknown every value is a body. At a given motion the facets are a convex problem, so that motions are compared by
//! non-negative least squares, as poles are ([`super::pole`]); its facets followed, the motion goes downhill by
//! Gauss and Newton's method with the facets' areas projected out (Golub & Pereyra 1973, SIAM J. Numer. Anal. 10, 413).
//!
//! Near a motion that is told ([`Scan::told`]) this is a fit like others. Without one starts are drawn at random among symmetric bodies, and
//! what was not drawn is not found: **nothing found is no proof**. How a body turns leaves its axes in the body open where its moments are nearly equal: motions are compared by how they turn it.

mod motion;
mod search;

pub use motion::Motion;

use super::egi::{EgiError, Options, Problem, ProblemError, Solution};
use super::pole::Spinning;
use crate::object::matter::Material;
use glam::DVec3;

/// Where to look.
#[derive(Debug, Clone, PartialEq)]
pub struct Scan {
    /// A motion that is told, at the time 0 of the curves.
    pub told: Option<Motion>,
    /// Least and greatest seconds of a turn about the angular momentum of motions drawn at random; none are drawn without.
    pub turn: Option<(f64, f64)>,
    /// How many are drawn, at most 10 000 000.
    pub starts: usize,
    /// Of these are followed downhill, the best.
    pub followed: usize,
    /// Of these are refined, the best.
    pub refined: usize,
    /// Minima whose criterion is within this of the least are listed.
    pub within: f64,
    /// Of the draws.
    pub seed: u64,
}

impl Default for Scan {
    fn default() -> Self {
        Self { told: None, turn: None, starts: 20_000, followed: 300, refined: 6, within: 9.0, seed: 1 }
    }
}

/// Why there was no search.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TumbleError {
    /// The curve.
    #[error(transparent)]
    Problem(#[from] ProblemError),
    /// The solver.
    #[error(transparent)]
    Solve(#[from] EgiError),
    /// Times that are not one a datum, or none.
    #[error(
        "{times} finite times for {data} data: a tumbler needs one for each, within 1e9 s of each other and not all the same"
    )]
    Times {
        /// Finite times.
        times: usize,
        /// Data.
        data: usize,
    },
    /// Turns that cannot be.
    #[error(
        "turns of {low} to {high} s, {starts} starts: both must be above 0 and finite, the second not below the first, starts 1 to 10 000 000"
    )]
    Turns {
        /// Least \[s\].
        low: f64,
        /// Greatest \[s\].
        high: f64,
        /// Starts.
        starts: usize,
    },
    /// Nowhere to begin.
    #[error(
        "neither a tumble nor a range of turns is told: a motion is sought near one, or among those that turn about the angular momentum in a \
         time of some range, --period A..B in seconds"
    )]
    Nowhere,
    /// A motion that no body has.
    #[error(
        "inertia {inertia}, rates {rate} rad/s: moments must be above 0, each at most the sum of the others, rates finite and not all 0"
    )]
    Motion {
        /// Moments.
        inertia: DVec3,
        /// Rates \[rad/s\].
        rate: DVec3,
    },
}

/// A motion that the data allow.
#[derive(Debug, Clone)]
pub struct Minimum {
    /// The motion, at the time 0 of the curves.
    pub motion: Motion,
    /// Standard deviations of the attitude about the principal axes in the middle of the data \[rad\].
    pub attitude_sd: DVec3,
    /// Standard deviations of the rates there \[rad/s\].
    pub rate_sd: DVec3,
    /// Facets in principal axes, and chi^2.
    pub solution: Solution,
    /// chi^2 + ln det(1 + J'J), as of poles ([`super::pole::Minimum::criterion`]).
    pub criterion: f64,
}

/// What a search found.
#[derive(Debug, Clone)]
pub struct Found {
    /// Minima within the limit, the best first.
    pub minima: Vec<Minimum>,
    /// Motions drawn, followed and refined.
    pub tried: [usize; 3],
}

/// Motions near the one that is told, or from random starts, with no claim to be all.
///
/// # Errors
/// Curves, times, turns and motions that cannot be.
pub fn scan(
    spinning: &Spinning,
    material: &Material,
    scan: &Scan,
    options: &Options,
) -> Result<Found, TumbleError> {
    Problem::new(&spinning.curves)?;
    search::search(spinning, material, scan, options)
}

#[cfg(test)]
mod tumble_tests;
