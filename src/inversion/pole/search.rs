//! From a map of all poles to the rotations that the data allow.
//!
//! ```text
//! map      every pole of the grid by the inner problem, its local minima, the alias of each
//! descend  a pattern search from each with the inner problem; those that end far above the best are dropped
//! refine   facets, pole and period together, off the grid
//! settle   again from rings of poles about the best of each basin
//! ```
//!
//! Minima are compared by chi^2 + ln det(1 + J'J), twice the negative logarithm of their evidence (MacKay 1992, Neural Comput. 4, 415):
//! false poles fit with more facets, and each has to be told by the light.
//!
//! The inner problem leads to a pole's neighbourhood, not to the pole: it has more facets than the body and bends them to a false pole, by 3
//! to 8 deg. The sparse fit in turn keeps the facets that its start suggests, so that one start is often stuck; a ring of starts is not.

use super::{Found, Minimum, Scan, Spin};
use crate::inversion::egi::{EgiError, Options, Problem, Unknowns, View};
use crate::inversion::inner::Inner;
use crate::inversion::refine::{Refined, refine};
use crate::inversion::sphere::{angle, fibonacci, spacing, tangents};
use crate::object::matter::Material;
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::{FRAC_1_SQRT_2, TAU};

/// Inner chi^2 over the least, from where on a place is dropped.
const HOPELESS: f64 = 3.0;
/// Criterion above the best up to which a basin is settled.
const SETTLED: f64 = 30.0;
/// Most basins that rings are laid in.
const BASINS: usize = 5;
/// Starts of a ring.
const RING: usize = 6;
/// Radius of each ring about a basin's best \[rad\].
const RADII: [f64; 5] = [0.05, 0.1, 0.05, 0.03, 0.05];
/// Rotations nearer than this \[rad\], and no further apart than so many cycles over the span at least, are one.
const SAME: (f64, f64) = (0.01, 0.05);
/// Solutions of a basin: no further apart than this \[rad\], and than half a cycle over the span.
const BASIN: f64 = 0.18;

/// A search at work.
pub(super) struct Task<'a> {
    /// In inertial axes.
    pub problem: &'a Problem,
    pub material: &'a Material,
    pub inner: Inner<'a>,
    pub spin: Spin,
}

/// A place in the search.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    pub pole: DVec3,
    pub period: f64,
    /// Of the inner problem.
    pub chi2: f64,
}

impl Task<'_> {
    pub fn place(&self, pole: DVec3, period: f64) -> Result<Place, EgiError> {
        Ok(Place { pole, period, chi2: self.inner.chi2(&self.spin.epochs(pole, period))? })
    }

    /// Downhill by single steps of pole and period, halved when none helps.
    fn descend(&self, mut place: Place, step: f64) -> Result<Place, EgiError> {
        let mut share = 1.0;
        for _ in 0..12 {
            let [a, b] = tangents(place.pole);
            let tilt = step * share;
            let pole = |d: DVec3| (place.pole + d * libm::tan(tilt)).normalize();
            let poles = [a, -a, b, -b].map(|d| (pole(d), place.period));
            let change = self.spin.period_step(place.period) * share;
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
    pub fn refine(&self, pole: DVec3, period: f64, reach: f64, options: &Options) -> Result<Minimum, EgiError> {
        let [a, b] = tangents(pole);
        let change = 4.0 * self.spin.period_step(period);
        let rotation = |v: &[f64]| match v {
            [x, y, p] => ((pole + a * *x + b * *y).normalize(), period + p * change),
            _ => (pole, period),
        };
        let view = |v: &[f64]| {
            let (pole, period) = rotation(v);
            View { epochs: self.spin.epochs(pole, period), material: self.material.clone() }
        };
        let bounds = vec![(-reach, reach), (-reach, reach), (-0.9, 0.9)];
        let Refined { solution, values, sd, criterion } =
            refine(self.problem, &Unknowns { bounds, view: &view }, options)?;
        let (pole, period) = rotation(&values);
        let sd = [0, 1, 2].map(|k| sd.get(k).copied().unwrap_or(f64::INFINITY));
        Ok(Minimum { pole, period, sd: [sd[0], sd[1], sd[2] * change], solution, criterion, alias: false })
    }

    /// Whether two rotations are one.
    fn same(&self, a: &Minimum, b: &Minimum) -> bool {
        let cycles = self.spin.cycles(a.period, b.period).abs();
        let unsure = self.spin.cycles(a.period, a.period + a.sd[2]).abs().clamp(SAME.1, 0.5);
        angle(a.pole, b.pole) < SAME.0 && cycles < unsure
    }

    fn share_a_basin(&self, a: &Minimum, b: &Minimum) -> bool {
        angle(a.pole, b.pole) < BASIN && self.spin.cycles(a.period, b.period).abs() < 0.5
    }

    /// Standard deviations with the scatter of all solutions of the basin in them, each by how likely it is: one fit knows its error with its own facets
    /// only, others explain the light with others (law of total variance).
    fn widened(&self, minimum: &Minimum, all: &[Minimum]) -> [f64; 3] {
        let told = |m: &&Minimum| m.sd.iter().all(|sd| sd.is_finite()) && self.share_a_basin(m, minimum);
        let own = all.iter().filter(told);
        let least = own.clone().map(|m| m.criterion).fold(f64::INFINITY, f64::min);
        let (mut sum, mut square) = (0.0, [0.0; 3]);
        for other in own {
            let weight = libm::exp(0.5 * (least - other.criterion));
            sum += weight;
            let away = [angle(other.pole, minimum.pole) * FRAC_1_SQRT_2; 2];
            let away = [away[0], away[1], other.period - minimum.period];
            for ((square, sd), away) in square.iter_mut().zip(other.sd).zip(away) {
                *square += weight * (sd * sd + away * away);
            }
        }
        if sum > 0.0 { square.map(|square| (square / sum).sqrt()) } else { minimum.sd }
    }
}

/// Rotations that the data allow, from the poles of a grid.
pub(super) fn search(task: &Task, scan: &Scan, options: &Options) -> Result<Found, EgiError> {
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
    let direct = seeds.len();
    let alias = |s: &Place| task.place(task.spin.alias(s.pole), s.period);
    let aliases: Vec<Place> =
        seeds[..direct.min(scan.refined.div_ceil(2))].par_iter().map(alias).collect::<Result<_, _>>()?;
    seeds.extend(aliases);
    let descended: Vec<Place> =
        seeds.par_iter().map(|s| task.descend(*s, 0.5 * step)).collect::<Result<_, _>>()?;
    let hopeless = HOPELESS * least(&descended);
    let mut starts: Vec<(Place, bool)> = Vec::new();
    for (k, place) in descended.into_iter().enumerate().filter(|(_, p)| p.chi2 <= hopeless) {
        let met = |(other, _): &(Place, bool)| {
            angle(other.pole, place.pole) < 0.2 * step && task.spin.cycles(other.period, place.period).abs() < 0.1
        };
        if !starts.iter().any(met) {
            starts.push((place, k >= direct));
        }
    }
    let refine = |(place, alias): &(Place, bool)| {
        Ok(Minimum { alias: *alias, ..task.refine(place.pole, place.period, step, options)? })
    };
    let all: Vec<Minimum> = starts.par_iter().map(refine).collect::<Result<_, EgiError>>()?;
    // the best of the inner problem lead to the true basin more surely than to its bottom
    let mut order: Vec<usize> = (0..starts.len()).collect();
    order.sort_by(|&a, &b| starts[a].0.chi2.total_cmp(&starts[b].0.chi2));
    let promising: Vec<Minimum> = order.into_iter().map(|k| all[k].clone()).collect();
    let all = settle(task, all, &promising, step, options)?;
    let refined = all.len();
    let limit = all.first().map_or(0.0, |best| best.criterion + scan.within);
    let mut minima: Vec<Minimum> = Vec::new();
    for minimum in all.iter().take_while(|m| m.criterion <= limit) {
        if !minima.iter().any(|m| task.same(m, minimum)) {
            minima.push(Minimum { sd: task.widened(minimum, &all), ..minimum.clone() });
        }
    }
    Ok(Found { map, minima, refined })
}

/// All minima with those that rings lead to, the best first: about the most promising at first, then about the best of every basin near the best.
fn settle(
    task: &Task,
    mut all: Vec<Minimum>,
    promising: &[Minimum],
    step: f64,
    options: &Options,
) -> Result<Vec<Minimum>, EgiError> {
    let by_criterion = |a: &Minimum, b: &Minimum| a.criterion.total_cmp(&b.criterion);
    for (ring, radius) in RADII.into_iter().enumerate() {
        all.sort_by(by_criterion);
        let limit = all.first().map_or(f64::INFINITY, |best| best.criterion + SETTLED);
        let near = all.iter().take_while(|m| m.criterion <= limit);
        let first = promising.iter().filter(|_| ring == 0);
        let mut heads: Vec<Minimum> = Vec::new();
        for minimum in first.chain(near) {
            if !heads.iter().any(|h| task.share_a_basin(h, minimum)) {
                heads.push(minimum.clone());
            }
        }
        heads.truncate(BASINS);
        let start = |k: usize| {
            let head = &heads[k / RING];
            let turn = TAU * ((k % RING) as f64 + 0.5 * ring as f64) / RING as f64;
            let [a, b] = tangents(head.pole);
            let pole = head.pole + (a * libm::cos(turn) + b * libm::sin(turn)) * radius;
            Ok(Minimum { alias: head.alias, ..task.refine(pole.normalize(), head.period, step, options)? })
        };
        let found: Vec<Minimum> =
            (0..heads.len() * RING).into_par_iter().map(start).collect::<Result<_, EgiError>>()?;
        all.extend(found);
    }
    all.sort_by(by_criterion);
    Ok(all)
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
