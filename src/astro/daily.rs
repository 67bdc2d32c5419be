//! Slow functions of time by interpolation: Chebyshev series, one for each day of TAI.
//!
//! A series' nodes lie at fixed instants of its day, so a value depends on nothing but the instant asked for. Series are
//! made when first needed and kept. What they approximate (nutation, Earth, Moon) is smooth over days: with
//! [`NODES`] nodes the error is below rounding for the Earth and 1e-12 of the distance for the Moon
//! (`docs/accuracy.md`); the twins without interpolation are named `reference`.

use super::time::{DAY_NS, Instant};
use glam::DVec3;
use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::sync::{Arc, PoisonError, RwLock};

/// Nodes of a series, in a day.
pub const NODES: usize = 10;

/// Days kept; more are forgotten together.
const KEPT: usize = 4096;

/// A vector function of time over one day.
#[derive(Debug, Clone)]
pub struct Series(Vec<DVec3>);

impl Series {
    /// The series with `nodes` nodes of a function over the day number `day`.
    pub fn fit(day: i64, nodes: usize, function: impl Fn(&Instant) -> DVec3) -> Self {
        let angle = |j: usize| PI * (j as f64 + 0.5) / nodes as f64;
        let at = |j: usize| {
            let half = 0.5 * DAY_NS as f64;
            Instant::from_tai_ns(
                day.saturating_mul(DAY_NS).saturating_add((half * (1.0 + angle(j).cos())).round() as i64),
            )
        };
        let values = (0..nodes).map(|j| function(&at(j))).collect::<Vec<_>>();
        let coefficient = |k: usize| {
            let sum = (0..nodes).map(|j| values[j] * (k as f64 * angle(j)).cos()).sum::<DVec3>();
            sum * (if k == 0 { 1.0 } else { 2.0 } / nodes as f64)
        };
        Self((0..nodes).map(coefficient).collect())
    }

    /// The value at an instant of the day, by Clenshaw's recurrence.
    pub fn at(&self, t: &Instant) -> DVec3 {
        let x = 2.0 * t.tai_ns().rem_euclid(DAY_NS) as f64 / DAY_NS as f64 - 1.0;
        let (mut b1, mut b2) = (DVec3::ZERO, DVec3::ZERO);
        for c in self.0.iter().skip(1).rev() {
            (b1, b2) = (b1 * (2.0 * x) - b2 + *c, b1);
        }
        self.0.first().map_or(DVec3::ZERO, |c| b1 * x - b2 + *c)
    }
}

/// Number of the day of TAI that holds an instant.
pub fn number(t: &Instant) -> i64 {
    t.tai_ns().div_euclid(DAY_NS)
}

/// What is known of days, made once each.
#[derive(Debug)]
pub struct Days<T>(RwLock<BTreeMap<i64, Arc<T>>>);

impl<T> Default for Days<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T> Days<T> {
    /// None yet.
    pub const fn new() -> Self {
        Self(RwLock::new(BTreeMap::new()))
    }

    /// The day of that number, made by `make` when it is not there.
    ///
    /// # Errors
    /// Whatever `make` says.
    pub fn get<E>(&self, day: i64, make: impl FnOnce() -> Result<T, E>) -> Result<Arc<T>, E> {
        // a poisoned lock guards nothing half made: days are put in whole
        if let Some(known) = self.0.read().unwrap_or_else(PoisonError::into_inner).get(&day) {
            return Ok(Arc::clone(known));
        }
        let made = Arc::new(make()?);
        let mut days = self.0.write().unwrap_or_else(PoisonError::into_inner);
        if days.len() >= KEPT {
            days.clear();
        }
        days.insert(day, Arc::clone(&made));
        Ok(made)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_series_repeats_a_polynomial_of_its_order_and_days_meet() {
        let cubic = |t: &Instant| {
            let x = t.tai_ns() as f64 / DAY_NS as f64;
            DVec3::new(x.powi(3), 1.0 - x, x * x)
        };
        let (first, second) = (Series::fit(0, 4, cubic), Series::fit(1, 4, cubic));
        for share in [0.0, 0.1, 0.5, 0.999] {
            let t = Instant::from_tai_ns((share * DAY_NS as f64) as i64);
            assert!((first.at(&t) - cubic(&t)).length() < 1e-13, "{share}");
        }
        let (end, start) = (Instant::from_tai_ns(DAY_NS - 1), Instant::from_tai_ns(DAY_NS));
        assert!((first.at(&end) - second.at(&start)).length() < 1e-12);
    }
}
