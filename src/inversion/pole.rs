//! Pole and period of a uniformly rotating convex body, from one or more curves.
//!
//! A vector v in inertial axes is R_z(-2 pi t/P) R(p) v in body axes, R(p) taking the pole p to z; where x points is the body's
//! own affair. At a given pole and period the facets are a convex problem, so the poles of an even grid are compared by
//! non-negative least squares (Chng et al. 2022), every local minimum is followed by a pattern search (Hooke & Jeeves
//! 1961, J. ACM 8, 212) and refined with the off-grid solver, pole and period among its unknowns. All that fit within
//! 9 of the least chi^2 (3 sigma) are listed, with the aliases of each tried on purpose.
//!
//! If Sun and observer stay in one plane of normal m, the mirrored body turning about the pole turned by 180 deg about m gives
//! the same curve (Kaasalainen & Lamberg 2006, Inverse Problems 22, 749): that alias is always tried.

use super::egi::{Curve, EgiError, Options, Problem, ProblemError, Solution, Unknowns, View, solve_from};
use super::nnls::{self, Columns};
use super::sphere::{angle, fibonacci, spacing, tangents};
use crate::object::convex::Epochs;
use crate::object::matter::Material;
use faer::{Mat, Side};
use glam::{DMat3, DQuat, DVec3};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Rounds in which free scales and facets follow each other, at most.
const SCALING: usize = 6;
/// Price of a parameter unless told: facets that are merged too readily pull the pole.
const AKAIKE: f64 = 2.0;

/// Curves of a rotating body.
#[derive(Debug, Clone)]
pub struct Spinning {
    /// Data; directions in inertial axes.
    pub curves: Vec<Curve>,
    /// Time of each datum of each curve \[s\], from any one instant.
    pub times: Vec<Vec<f64>>,
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
    /// Local minima that are refined, the best.
    pub refined: usize,
    /// Minima within this of the least chi^2 are listed.
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

struct Task<'a> {
    /// In inertial axes.
    problem: &'a Problem,
    directions: Vec<(DVec3, DVec3)>,
    times: Vec<f64>,
    material: &'a Material,
    normals: Vec<DVec3>,
    data: Vec<f64>,
    /// Greatest time less the least \[s\].
    span: f64,
}

/// A place in the search.
#[derive(Debug, Clone, Copy)]
struct Place {
    pole: DVec3,
    period: f64,
    chi2: f64,
}

impl Task<'_> {
    fn epochs(&self, pole: DVec3, period: f64) -> Epochs {
        Epochs::new(body_axes(pole, period, &self.times, &self.directions))
    }

    fn place(&self, pole: DVec3, period: f64) -> Result<Place, EgiError> {
        let epochs = self.epochs(pole, period);
        let flux: Vec<Vec<f64>> = self.normals.iter().map(|&n| epochs.column(n, self.material, 0.0)).collect();
        let mut scales: Vec<f64> = self.problem.scales().iter().map(|s| s.unwrap_or(1.0)).collect();
        let (mut support, mut chi2) = (Vec::new(), f64::INFINITY);
        // free scales follow the facets in turn
        let rounds = if self.problem.scales().iter().any(Option::is_none) { SCALING } else { 1 };
        for _ in 0..rounds {
            let weights: Vec<f64> =
                self.problem.sigma().iter().zip(self.problem.curve_of()).map(|(s, &c)| scales[c] / s).collect();
            let column = |g: &Vec<f64>| g.iter().zip(&weights).map(|(g, w)| g * w).collect();
            let matrix = Columns::new(self.data.len(), flux.iter().map(column));
            let solution = nnls::solve(&matrix, &self.data, &support)?;
            let before = std::mem::replace(&mut chi2, 2.0 * solution.objective);
            support.clone_from(&solution.support);
            if before - chi2 < 0.01 * chi2 {
                break;
            }
            self.rescale(&mut scales, &solution.residual);
        }
        Ok(Place { pole, period, chi2 })
    }

    /// Free scales by least squares, the facets held.
    fn rescale(&self, scales: &mut [f64], residual: &[f64]) {
        for (c, scale) in scales.iter_mut().enumerate().filter(|(c, _)| self.problem.scales()[*c].is_none()) {
            let own = self.problem.curve_of().iter().enumerate().filter(|(_, curve)| **curve == c);
            let (mut ym, mut mm) = (0.0, 0.0);
            for (t, _) in own {
                let model = self.data[t] - residual[t];
                ym += self.data[t] * model;
                mm += model * model;
            }
            if ym > 0.0 && mm > 0.0 {
                *scale *= ym / mm;
            }
        }
    }

    /// Half the step of periods that keeps in phase over the span.
    fn period_step(&self, period: f64) -> f64 {
        0.25 * period * period / self.span.max(period)
    }

    /// Downhill by single steps of pole and period, halved when none helps.
    fn descend(&self, mut place: Place, step: f64) -> Result<Place, EgiError> {
        let mut share = 1.0;
        for _ in 0..12 {
            let [a, b] = tangents(place.pole);
            let tilt = step * share;
            let pole = |d: DVec3| (place.pole + d * libm::tan(tilt)).normalize();
            let poles = [a, -a, b, -b].map(|d| (pole(d), place.period));
            let change = self.period_step(place.period) * share;
            let periods = [place.period - change, place.period + change].map(|p| (place.pole, p));
            let mut best = place;
            for (pole, period) in poles.into_iter().chain(periods) {
                let next = self.place(pole, period)?;
                best = if next.chi2 < best.chi2 { next } else { best };
            }
            if best.chi2 < place.chi2 {
                place = best;
            } else {
                share *= 0.5;
                if share < 0.1 {
                    break;
                }
            }
        }
        Ok(place)
    }

    /// Pole, period and facets together.
    fn refine(&self, place: Place, reach: f64, options: &Options) -> Result<Minimum, EgiError> {
        let [a, b] = tangents(place.pole);
        let change = 4.0 * self.period_step(place.period);
        let rotation = |v: &[f64]| match v {
            [x, y, p] => ((place.pole + a * *x + b * *y).normalize(), place.period + p * change),
            _ => (place.pole, place.period),
        };
        let view = |v: &[f64]| {
            let (pole, period) = rotation(v);
            View { epochs: self.epochs(pole, period), material: self.material.clone() }
        };
        let bounds = vec![(-reach, reach), (-reach, reach), (-0.9, 0.9)];
        let unknowns = Unknowns { bounds, view: &view };
        let start = vec![0.0; 3];
        let price = options.price.or(Some(AKAIKE));
        let options = Options { price, ..options.clone() };
        let solution = solve_from(self.problem, view(&start), Some(&unknowns), start, &options)?;
        let values: Vec<f64> = solution.unknowns.iter().map(|u| u.0).collect();
        let (pole, period) = rotation(&values);
        let sd = |k: usize| solution.unknowns.get(k).map_or(f64::INFINITY, |u| u.1);
        Ok(Minimum { pole, period, sd: [sd(0), sd(1), sd(2) * change], solution, alias: false })
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
    search(&task(spinning, material, scan, &problem)?, scan, options).map_err(ScanError::from)
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
    let as_many = spinning.times.len() == spinning.curves.len()
        && spinning.times.iter().zip(&spinning.curves).all(|(t, c)| t.len() == c.y.len());
    if !fits || !as_many {
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
    Ok(Task {
        problem,
        directions: (0..problem.len()).map(|t| problem.epochs().at(t)).collect(),
        times,
        material,
        normals: fibonacci(normals).collect(),
        data: problem.weighted_data(),
        span,
    })
}

fn search(task: &Task, scan: &Scan, options: &Options) -> Result<Found, EgiError> {
    let poles: Vec<DVec3> = fibonacci(scan.poles).collect();
    let period_count = scan.periods.len();
    let place = |k: usize| task.place(poles[k / period_count], scan.periods[k % period_count]);
    let places: Vec<Place> =
        (0..poles.len() * period_count).into_par_iter().map(place).collect::<Result<_, _>>()?;
    let least = |row: &[Place]| row.iter().map(|p| p.chi2).fold(f64::INFINITY, f64::min);
    let map = poles.iter().zip(places.chunks(period_count)).map(|(&pole, row)| (pole, least(row))).collect();
    let step = spacing(scan.poles);
    let mut seeds = local_minima(&poles, &places, period_count, 1.6 * step);
    seeds.truncate(scan.refined);
    let aliases: Vec<Place> =
        seeds.iter().take(scan.refined.div_ceil(2)).map(|s| Place { pole: task.alias(s.pole), ..*s }).collect();
    let direct = seeds.len();
    seeds.extend(aliases);
    let follow = |(k, seed): (usize, &Place)| {
        let start = if k < direct { *seed } else { task.place(seed.pole, seed.period)? };
        let minimum = task.refine(task.descend(start, 0.5 * step)?, step, options)?;
        Ok(Minimum { alias: k >= direct, ..minimum })
    };
    let mut all: Vec<Minimum> = seeds.par_iter().enumerate().map(follow).collect::<Result<_, EgiError>>()?;
    let refined = all.len();
    all.sort_by(|a, b| a.solution.chi2.total_cmp(&b.solution.chi2));
    let limit = all.first().map_or(0.0, |best| best.solution.chi2 + scan.within);
    let mut minima: Vec<Minimum> = Vec::new();
    for minimum in all {
        let same = |m: &Minimum| {
            let cycles = (m.period - minimum.period).abs() / (4.0 * task.period_step(m.period));
            angle(m.pole, minimum.pole) < 0.5 * step && cycles < 0.5
        };
        if minimum.solution.chi2 <= limit && !minima.iter().any(same) {
            minima.push(minimum);
        }
    }
    Ok(Found { map, minima, refined })
}

/// Places below all their neighbours in pole and period, the lowest first.
fn local_minima(poles: &[DVec3], places: &[Place], periods: usize, within: f64) -> Vec<Place> {
    let near = libm::cos(within);
    let lowest = |(k, place): (usize, &Place)| {
        let (pole, period) = (k / periods, k % periods);
        let range = period.saturating_sub(1)..(period + 2).min(periods);
        let neighbours = (0..poles.len()).filter(|&j| poles[j].dot(poles[pole]) > near);
        let lower = neighbours.flat_map(|j| range.clone().map(move |p| j * periods + p));
        let beaten = lower.filter(|&j| j != k).any(|j| (places[j].chi2, j) < (place.chi2, k));
        (!beaten).then_some(*place)
    };
    let mut out: Vec<Place> = places.par_iter().enumerate().filter_map(lowest).collect();
    out.sort_by(|a, b| a.chi2.total_cmp(&b.chi2));
    out
}

#[cfg(test)]
#[path = "pole_tests.rs"]
mod tests;
