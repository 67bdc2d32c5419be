//! Pole and period of a uniformly rotating convex body, from one or more curves.
//!
//! A vector v in inertial axes is R_z(-2 pi t/P) R(p) v in body axes, R(p) taking the pole p to z; where x points is the body's
//! own affair. At a given pole and period the facets are a convex problem, so the poles of an even grid are compared by
//! non-negative least squares (Chng et al. 2022), every local minimum is followed by a pattern search (Hooke & Jeeves
//! 1961, J. ACM 8, 212) and refined with the off-grid solver, pole and period among its unknowns. All within 9 of the best by
//! their evidence (odds of 90 : 1; Kass & Raftery 1995, JASA 90, 773) are listed, with the aliases of each tried on purpose.
//!
//! If Sun and observer stay in one plane of normal m, the mirrored body turning about the pole turned by 180 deg about m gives
//! the same curve (Kaasalainen & Lamberg 2006, Inverse Problems 22, 749): that alias is always tried.

mod search;

use super::egi::{Curve, EgiError, Options, Problem, ProblemError, Solution};
use super::inner::Inner;
use super::sphere::fibonacci;
use crate::object::convex::Epochs;
use crate::object::matter::Material;
use faer::{Mat, Side};
use glam::{DMat3, DQuat, DVec3};
use rayon::prelude::*;
use search::Task;
use std::f64::consts::TAU;

/// Curves of a rotating body.
#[derive(Debug, Clone)]
pub struct Spinning {
    /// Data; directions in inertial axes.
    pub curves: Vec<Curve>,
    /// Time of each datum of each curve \[s\], from any one instant.
    pub times: Vec<Vec<f64>>,
}

impl Spinning {
    /// Whether every datum has a time.
    pub(super) fn is_timed(&self) -> bool {
        self.times.len() == self.curves.len()
            && self.times.iter().zip(&self.curves).all(|(t, c)| t.len() == c.y.len())
    }
}

/// Where to look.
#[derive(Debug, Clone, PartialEq)]
pub struct Scan {
    /// Poles of the grid, evenly over the sphere.
    pub poles: usize,
    /// Sidereal periods \[s\], each nearer to the next than P^2/(2 span); > 0.
    pub periods: Vec<f64>,
    /// Normals of the inner problem.
    pub normals: usize,
    /// Local minima that are followed, the best; half of them with their aliases.
    pub refined: usize,
    /// Minima whose criterion is within this of the least are listed.
    pub within: f64,
}

impl Default for Scan {
    fn default() -> Self {
        Self { poles: 1000, periods: Vec::new(), normals: 300, refined: 8, within: 9.0 }
    }
}

/// Why there was no scan.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ScanError {
    /// The curve.
    #[error(transparent)]
    Problem(#[from] ProblemError),
    /// The solver.
    #[error(transparent)]
    Solve(#[from] EgiError),
    /// A period or time that cannot be.
    #[error("{what} {number} = {value} s is outside {range}")]
    Value {
        /// Period or time.
        what: &'static str,
        /// Its number.
        number: usize,
        /// Its value.
        value: f64,
        /// The range.
        range: &'static str,
    },
    /// Too little or too much to look at.
    #[error(
        "{poles} poles, {periods} periods, {normals} normals, {times} times for {data} data: a scan needs 10 to 100 000 poles, 1 to 100 000 periods, 50 to 5000 normals and as many times as data"
    )]
    Size {
        /// Poles.
        poles: usize,
        /// Periods.
        periods: usize,
        /// Normals.
        normals: usize,
        /// Times.
        times: usize,
        /// Data.
        data: usize,
    },
}

/// A rotation that the data allow.
#[derive(Debug, Clone)]
pub struct Minimum {
    /// Pole, inertial axes.
    pub pole: DVec3,
    /// Sidereal period \[s\].
    pub period: f64,
    /// Standard deviations: of the pole along two directions \[rad\], of the period \[s\].
    pub sd: [f64; 3],
    /// Facets in body axes, and chi^2.
    pub solution: Solution,
    /// What minima are compared by: chi^2 + ln det(1 + J'J), J the derivatives of the curve over its errors with respect to facets, pole
    /// and period. Half a difference is the logarithm of how much likelier one is than the other.
    pub criterion: f64,
    /// Whether it was found as the alias of another.
    pub alias: bool,
}

/// What a scan found.
#[derive(Debug, Clone)]
pub struct Found {
    /// Poles of the grid with the least chi^2 over all periods, of the inner problem.
    pub map: Vec<(DVec3, f64)>,
    /// Minima within the limit, the best first.
    pub minima: Vec<Minimum>,
    /// Minima that were refined.
    pub refined: usize,
}

/// Directions in body axes at the times given \[s\], from inertial ones.
pub fn body_axes(pole: DVec3, period: f64, times: &[f64], directions: &[(DVec3, DVec3)]) -> Vec<(DVec3, DVec3)> {
    // the shortest way to z has no axis at -z: there half a turn about x
    let to_z = match pole.z < -1.0 + 1e-12 {
        true => DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0)),
        false => DMat3::from_quat(DQuat::from_rotation_arc(pole, DVec3::Z)),
    };
    let turned = |(t, &(s, o)): (&f64, &(DVec3, DVec3))| {
        let angle = -TAU * (t / period).rem_euclid(1.0);
        let (sin, cos) = (libm::sin(angle), libm::cos(angle));
        let spin = |v: DVec3| {
            let v = to_z * v;
            DVec3::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y, v.z).normalize()
        };
        (spin(s), spin(o))
    };
    times.iter().zip(directions).map(turned).collect()
}

/// When and from where the body was seen.
struct Spin {
    /// In inertial axes.
    directions: Vec<(DVec3, DVec3)>,
    times: Vec<f64>,
    /// Greatest time less the least \[s\].
    span: f64,
}

impl Spin {
    fn epochs(&self, pole: DVec3, period: f64) -> Epochs {
        Epochs::new(body_axes(pole, period, &self.times, &self.directions))
    }

    /// Half the step of periods that keeps in phase over the span.
    fn period_step(&self, period: f64) -> f64 {
        0.25 * period * period / self.span.max(period)
    }

    /// By how much two periods run apart over the span, in cycles.
    fn cycles(&self, a: f64, b: f64) -> f64 {
        (b - a) / (4.0 * self.period_step(a))
    }

    /// The pole turned by 180 deg about the normal of the plane of Sun and observer.
    fn alias(&self, pole: DVec3) -> DVec3 {
        let outer = |v: DVec3| DMat3::from_cols(v * v.x, v * v.y, v * v.z);
        let sum = self.directions.iter().fold(DMat3::ZERO, |m, (s, o)| m + outer(*s) + outer(*o));
        let matrix = Mat::from_fn(3, 3, |i, j| sum.col(j)[i]);
        let Ok(eigen) = matrix.self_adjoint_eigen(Side::Lower) else { return -pole };
        let m = DVec3::from_array(std::array::from_fn(|k| eigen.U()[(k, 0)]));
        m * (2.0 * pole.dot(m)) - pole
    }
}

/// Search all poles and the periods given. Where no curve's scale is known that of the first counts as 1, and areas are relative.
///
/// # Errors
/// Curves, periods and times out of their ranges.
pub fn scan(spinning: &Spinning, material: &Material, scan: &Scan, options: &Options) -> Result<Found, ScanError> {
    let problem = Problem::new(&spinning.curves)?;
    search::search(&task(spinning, material, scan, &problem)?, scan, options).map_err(ScanError::from)
}

/// The least chi^2 of every period over the poles of the grid, of the inner problem.
///
/// # Errors
/// As of [`scan`].
pub fn by_period(spinning: &Spinning, material: &Material, scan: &Scan) -> Result<Vec<f64>, ScanError> {
    let problem = Problem::new(&spinning.curves)?;
    let task = task(spinning, material, scan, &problem)?;
    let poles: Vec<DVec3> = fibonacci(scan.poles).collect();
    let least = |&period: &f64| {
        let mut chi2 = poles.iter().map(|&pole| Ok(task.place(pole, period)?.chi2));
        chi2.try_fold(f64::INFINITY, |least, chi2: Result<f64, EgiError>| Ok(least.min(chi2?)))
    };
    scan.periods.par_iter().map(least).collect::<Result<_, EgiError>>().map_err(ScanError::from)
}

fn task<'a>(
    spinning: &Spinning,
    material: &'a Material,
    scan: &Scan,
    problem: &'a Problem,
) -> Result<Task<'a>, ScanError> {
    let (poles, periods, normals) = (scan.poles, scan.periods.len(), scan.normals);
    let data = spinning.curves.iter().map(|c| c.y.len()).sum();
    let times = spinning.times.iter().map(Vec::len).sum();
    let fits =
        (10..=100_000).contains(&poles) && (1..=100_000).contains(&periods) && (50..=5000).contains(&normals);
    if !fits || !spinning.is_timed() {
        return Err(ScanError::Size { poles, periods, normals, times, data });
    }
    let value = |what, number, value, range| Err(ScanError::Value { what, number, value, range });
    if let Some((number, &p)) = scan.periods.iter().enumerate().find(|(_, p)| !(1e-6..=1e12).contains(*p)) {
        return value("period", number, p, "1e-6 to 1e12");
    }
    let all = || spinning.times.iter().flatten();
    if let Some((number, &t)) = all().enumerate().find(|(_, t)| !(-1e15..=1e15).contains(*t)) {
        return value("time", number, t, "-1e15 to 1e15");
    }
    let present =
        spinning.curves.iter().flat_map(|c| c.y.iter().zip(&c.sigma).map(|(y, s)| !(y.is_nan() || s.is_nan())));
    let times: Vec<f64> = all().zip(present).filter(|(_, present)| *present).map(|(t, _)| *t).collect();
    let span = times.iter().copied().fold(f64::MIN, f64::max) - times.iter().copied().fold(f64::MAX, f64::min);
    let directions = (0..problem.len()).map(|t| problem.epochs().at(t)).collect();
    let inner = Inner::new(problem, material, normals);
    Ok(Task { problem, material, inner, spin: Spin { directions, times, span } })
}

#[cfg(test)]
#[path = "pole_tests.rs"]
mod tests;
