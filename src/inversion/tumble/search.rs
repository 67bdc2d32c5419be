//! From random motions to those that the data allow.
//!
//! ```text
//! draw     symmetric bodies at random, compared by the inner problem in the first window, a few turns with many points
//! follow   the best of them downhill; the best of these again from bodies a little less symmetric
//! widen    the window, again and again, until it holds all data: rates become sharper as phases may not be lost
//! refine   facets and motion together, off the grid
//! ```

use super::motion::UNKNOWNS;
use super::{Found, Minimum, Motion, Scan, TumbleError};
use crate::inversion::cholesky::{Cholesky, dot};
use crate::inversion::egi::{Curve, EgiError, Options, Problem, Unknowns, View};
use crate::inversion::inner::{Body, Inner};
use crate::inversion::pole::Spinning;
use crate::inversion::refine::{Refined, refine};
use crate::inversion::synthetic::Stream;
use crate::object::convex::Epochs;
use crate::object::matter::Material;
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_4, TAU};

/// Normals of the inner problem where motions are drawn, where they are followed, and in the last window: what their spacing costs, 20 of chi^2 a
/// datum at SNR 50 and 200 normals, hides the true motion.
const NORMALS: [usize; 3] = [300, 500, 1000];
/// Turns that the first window holds, points that it has to hold, and how much longer the next is.
const WINDOW: (f64, usize, f64) = (6.0, 80, 2.5);
/// Moments about the axis of the bodies that are drawn, over those across it.
const MOMENT: (f64, f64) = (0.1, 1.9);
/// Of the places followed, those that are made less symmetric, and the share by which.
const LESS: (usize, f64) = (20, 0.5);
/// Of the places followed in a window, one in so many is followed in the next, and no fewer than these.
const KEPT: (usize, usize) = (3, 20);
/// Starts about a motion that is told, and their standard deviation: angles \[rad\], those that rates add by the end of the first
/// window, logarithms of the ratios.
const ABOUT: (usize, f64) = (40, 0.15);
/// chi^2 of a place over the least, from where on it is not followed in the next window, and not refined.
const HOPELESS: (f64, f64) = (9.0, 3.0);
/// Rounds of the descent.
const ROUNDS: usize = 25;
/// Greatest step of the attitude, of the turn that rates add by the end of a window \[rad\], and of the ratios' logarithms.
const STEP: f64 = 0.3;
/// Motions that differ by no more over the window are one \[rad\].
const SAME: f64 = 0.15;
/// Criterion above the best up to which a motion is refined again, and how often.
const SETTLED: f64 = 60.0;
const AGAIN: usize = 5;

/// The data of a window.
struct Window<'a> {
    problem: &'a Problem,
    inner: Inner<'a>,
    material: &'a Material,
    directions: Vec<(glam::DVec3, glam::DVec3)>,
    /// Since the instant of all motions \[s\].
    times: Vec<f64>,
    /// Greatest distance from that instant \[s\].
    reach: f64,
}

/// A motion with its body.
#[derive(Clone)]
struct Place {
    motion: Motion,
    body: Body,
}

impl<'a> Window<'a> {
    fn new(problem: &'a Problem, times: Vec<f64>, material: &'a Material, normals: usize) -> Self {
        let reach = times.iter().map(|t| t.abs()).fold(f64::MIN_POSITIVE, f64::max);
        let directions = (0..problem.len()).map(|t| problem.epochs().at(t)).collect();
        Self { problem, inner: Inner::new(problem, material, normals), material, directions, times, reach }
    }

    fn epochs(&self, motion: &Motion) -> Epochs {
        // moments at the limit of what a body can have are rounded beyond it, once in a while
        Epochs::new(motion.body_axes(&self.times, &self.directions).unwrap_or_else(|| self.directions.clone()))
    }

    fn place(&self, motion: Motion) -> Result<Place, EgiError> {
        Ok(Place { motion, body: self.inner.body(&self.epochs(&motion))? })
    }

    /// What a change of each unknown by 1 is.
    fn units(&self) -> [f64; UNKNOWNS] {
        let rate = self.reach.recip();
        [1.0, 1.0, 1.0, rate, rate, rate, 1.0, 1.0]
    }

    /// Downhill, the facets' areas following.
    fn follow(&self, motion: Motion) -> Result<Place, EgiError> {
        let mut place = self.place(motion)?;
        let mut damping = 1e-2;
        for _ in 0..ROUNDS {
            let Some(step) = self.step(&place, damping) else { break };
            let next = self.place(place.motion.changed(&step))?;
            let gain = place.body.chi2 - next.body.chi2;
            if gain > 0.0 {
                let small = gain < 1e-3 * place.body.chi2;
                place = next;
                damping = (0.3 * damping).max(1e-6);
                if small {
                    break;
                }
            } else {
                damping *= 5.0;
                if damping > 1e3 {
                    break;
                }
            }
        }
        Ok(place)
    }

    /// A damped step of the motion's unknowns, by Gauss and Newton.
    fn step(&self, place: &Place, damping: f64) -> Option<Vec<f64>> {
        let Body { facets, weights, residual, .. } = &place.body;
        let (epochs, units) = (self.epochs(&place.motion), self.units());
        let h = 1e-5;
        let mut columns: Vec<Vec<f64>> = Vec::with_capacity(UNKNOWNS + facets.len());
        for (k, unit) in units.iter().enumerate() {
            let at = |step: f64| {
                let mut by = [0.0; UNKNOWNS];
                by[k] = step * unit;
                self.epochs(&place.motion.changed(&by)).curve(facets, self.material, 0.0)
            };
            let slope = at(h).into_iter().zip(at(-h)).zip(weights).map(|((a, b), w)| w * (a - b) / (2.0 * h));
            columns.push(slope.chain([0.0; 3]).collect());
        }
        for facet in facets {
            let column = epochs.column(facet.normal, self.material, 0.0);
            let light = column.iter().zip(weights).map(|(g, w)| facet.area * g * w);
            columns.push(light.chain((self.inner.closing(facet.normal) * facet.area).to_array()).collect());
        }
        let factor = Cholesky::of(columns.len(), 0.0, |i, j| {
            let product = dot(&columns[i], &columns[j]);
            let share = if i < UNKNOWNS { damping } else { 1e-6 };
            if i == j { product * (1.0 + share) + 1e-9 } else { product }
        })?;
        let step = factor.solve(columns.iter().map(|c| dot(c, residual)).collect());
        let step = step.iter().zip(units).map(|(s, unit)| s.clamp(-STEP, STEP) * unit).collect::<Vec<_>>();
        step.iter().all(|s| s.is_finite()).then_some(step)
    }

    /// Times at which motions are compared \[s\].
    fn some_times(&self) -> Vec<f64> {
        self.times.iter().copied().step_by(self.times.len() / 12 + 1).collect()
    }

    /// The best of the places, each once.
    fn best(&self, mut places: Vec<Place>, most: usize) -> Vec<Place> {
        places.sort_by(|a, b| a.body.chi2.total_cmp(&b.body.chi2));
        let some = self.some_times();
        let mut out: Vec<Place> = Vec::new();
        for place in places {
            if out.len() >= most {
                break;
            }
            if !out.iter().any(|other| other.motion.differs(&place.motion, &some) < SAME) {
                out.push(place);
            }
        }
        out
    }

    /// Motion and facets together.
    fn refine(&self, motion: Motion, options: &Options) -> Result<Minimum, EgiError> {
        let units = self.units();
        let scaled = |v: &[f64]| v.iter().zip(units).map(|(v, u)| v * u).collect::<Vec<_>>();
        let view =
            |v: &[f64]| View { epochs: self.epochs(&motion.changed(&scaled(v))), material: self.material.clone() };
        let bounds = vec![(-STEP, STEP); UNKNOWNS];
        let Refined { solution, values, sd, criterion } =
            refine(self.problem, &Unknowns { bounds, view: &view }, options)?;
        let sd = scaled(&sd);
        let three = |k: usize| {
            let at = |k: usize| sd.get(k).copied().unwrap_or(f64::INFINITY);
            glam::DVec3::new(at(k), at(k + 1), at(k + 2))
        };
        let motion = motion.changed(&scaled(&values));
        Ok(Minimum { motion, attitude_sd: three(0), rate_sd: three(3), criterion, solution })
    }

    /// Refined again and again until that helps no more.
    fn settle(&self, mut best: Minimum, options: &Options) -> Result<Minimum, EgiError> {
        for _ in 0..AGAIN {
            let next = self.refine(best.motion, options)?;
            let better = best.criterion - next.criterion;
            best = if better > 0.0 { next } else { best };
            if better < 1.0 {
                break;
            }
        }
        Ok(best)
    }
}

/// Points of the curves from one time to another, times counted from `instant`.
fn part(spinning: &Spinning, from: f64, to: f64, instant: f64) -> (Vec<Curve>, Vec<f64>) {
    let (mut curves, mut all) = (Vec::new(), Vec::new());
    for (curve, times) in spinning.curves.iter().zip(&spinning.times) {
        let mut own = Curve { y: Vec::new(), sigma: Vec::new(), directions: Vec::new(), scale: curve.scale };
        for (k, t) in times.iter().enumerate().filter(|(_, t)| (from..=to).contains(*t)) {
            if curve.y[k].is_nan() || curve.sigma[k].is_nan() {
                continue;
            }
            own.y.push(curve.y[k]);
            own.sigma.push(curve.sigma[k]);
            own.directions.push(curve.directions[k]);
            all.push(t - instant);
        }
        if !own.y.is_empty() {
            curves.push(own);
        }
    }
    (curves, all)
}

/// First and last time of ever wider windows, the last of which holds all times; sorted times and the longest turn are given.
fn windows(times: &[f64], turn: f64) -> Vec<(f64, f64)> {
    let (Some(&first), Some(&last)) = (times.first(), times.last()) else { return Vec::new() };
    let held = |from: f64, to: f64| times.partition_point(|t| *t <= to) - times.partition_point(|t| *t < from);
    let fullest = |length: f64| {
        let counted = times.iter().map(|&t| (held(t, t + length), t));
        counted.fold((0, first), |best, next| if next.0 > best.0 { next } else { best })
    };
    let mut length = (WINDOW.0 * turn).max(1e-3 * (last - first));
    while fullest(length).0 < WINDOW.1 && length < last - first {
        length *= 1.5;
    }
    let start = fullest(length).1;
    let (mut from, mut to) = (start, start + length);
    let mut out = Vec::new();
    loop {
        if out.last().is_none_or(|&(a, b)| held(from, to) > held(a, b)) {
            out.push((from, to));
        }
        if from <= first && to >= last {
            return out;
        }
        let wider = 0.5 * (WINDOW.2 - 1.0) * (to - from);
        (from, to) = (from - wider, to + wider);
    }
}

fn motions(places: Vec<Place>) -> Vec<Motion> {
    places.into_iter().map(|p| p.motion).collect()
}

/// Places whose chi^2 is at most so many times the least.
fn hopeful(mut places: Vec<Place>, times: f64) -> Vec<Place> {
    let least = places.iter().map(|p| p.body.chi2).fold(f64::INFINITY, f64::min);
    places.retain(|p| p.body.chi2 <= times * least);
    places
}

/// Motions drawn at random.
fn draw(scan: &Scan, low: f64, high: f64) -> Vec<Motion> {
    let mut stream = Stream::new(scan.seed);
    let one = |_| {
        let momentum = stream.direction();
        let phase = TAU * stream.uniform();
        let nutation = libm::acos(stream.uniform());
        let turn = (high.recip() + (low.recip() - high.recip()) * stream.uniform()).recip();
        let moment = MOMENT.0 + (MOMENT.1 - MOMENT.0) * stream.uniform();
        Motion::precessing(momentum, phase, nutation, turn, moment)
    };
    (0..scan.starts).map(one).collect()
}

pub(super) fn search(
    spinning: &Spinning,
    material: &Material,
    scan: &Scan,
    options: &Options,
) -> Result<Found, TumbleError> {
    let mut times = checked_times(spinning)?;
    let turn = match (scan.turn, &scan.told) {
        (Some((low, high)), _) => {
            if !(low > 0.0 && low <= high && high.is_finite() && (1..=10_000_000).contains(&scan.starts)) {
                return Err(TumbleError::Turns { low, high, starts: scan.starts });
            }
            high
        }
        (None, Some(told)) => TAU / told.rate.length(),
        (None, None) => return Err(TumbleError::Nowhere),
    };
    times.sort_by(f64::total_cmp);
    let windows = windows(&times, turn);
    let Some(&(from, to)) = windows.first() else { return Err(TumbleError::Nowhere) };
    let instant = 0.5 * (from + to);
    let told = match scan.told {
        Some(told) => {
            let fault = TumbleError::Motion { inertia: told.inertia, rate: told.rate };
            let sound = told.rate.length() > 0.0;
            Some(told.after(instant).filter(|m| sound && m.attitude.is_finite()).ok_or(fault)?)
        }
        None => None,
    };
    let drawn = scan.turn.map(|(low, high)| draw(scan, low, high)).unwrap_or_default();
    let mut tried = [drawn.len(), 0, 0];
    let mut kept: Vec<Motion> = Vec::new();
    for (number, &(from, to)) in windows.iter().enumerate() {
        let (curves, since) = part(spinning, from, to, instant);
        let problem = Problem::new(&curves)?;
        let last = number + 1 == windows.len();
        let window = Window::new(&problem, since.clone(), material, NORMALS[if last { 2 } else { 1 }]);
        if number == 0 && !drawn.is_empty() {
            let window = Window::new(&problem, since, material, NORMALS[0]);
            let places = drawn.par_iter().map(|m| window.place(*m)).collect::<Result<Vec<_>, EgiError>>()?;
            kept = motions(window.best(places, scan.followed));
        }
        if let (0, Some(told)) = (number, told) {
            let mut stream = Stream::new(scan.seed);
            let near = |_| told.changed(&window.units().map(|unit| ABOUT.1 * unit * stream.normal()));
            kept.extend((0..ABOUT.0).map(near));
        }
        kept.extend(told);
        let follow = |motions: &[Motion]| {
            motions.par_iter().map(|m| window.follow(*m)).collect::<Result<Vec<_>, EgiError>>()
        };
        tried[1] += kept.len();
        let mut places = window.best(follow(&kept)?, usize::MAX);
        // a motion that is told is no symmetric body's
        if number == 0 && !drawn.is_empty() {
            let less = |p: &Place| {
                let ways = [(LESS.1, 0.0), (-LESS.1, 0.0), (LESS.1, FRAC_PI_4), (-LESS.1, FRAC_PI_4)];
                ways.map(|(by, angle)| p.motion.less_symmetric(by, angle))
            };
            let less: Vec<Motion> = places.iter().take(LESS.0).flat_map(less).collect();
            places.extend(follow(&less)?);
        }
        if !last {
            let most = (kept.len() / KEPT.0).max(KEPT.1);
            kept = motions(window.best(hopeful(places, HOPELESS.0), most));
            continue;
        }
        kept = motions(window.best(hopeful(places, HOPELESS.1), scan.refined));
        tried[2] = kept.len();
        let refine = |m: &Motion| window.refine(*m, options);
        let mut all = kept.par_iter().map(refine).collect::<Result<Vec<_>, EgiError>>()?;
        let least = all.iter().map(|m| m.criterion).fold(f64::INFINITY, f64::min);
        all.retain(|m| m.criterion <= least + SETTLED);
        let settle = |m: Minimum| window.settle(m, options);
        let all = all.into_par_iter().map(settle).collect::<Result<Vec<_>, EgiError>>()?;
        return Ok(Found { minima: listed(all, &window, instant, scan.within), tried });
    }
    Err(TumbleError::Nowhere)
}

/// Those within the limit, each once, the best first, at the time 0 of the curves.
fn listed(mut all: Vec<Minimum>, window: &Window, instant: f64, within: f64) -> Vec<Minimum> {
    all.sort_by(|a, b| a.criterion.total_cmp(&b.criterion));
    let limit = all.first().map_or(0.0, |best| best.criterion + within);
    let some = window.some_times();
    let mut out: Vec<Minimum> = Vec::new();
    for minimum in all.into_iter().take_while(|m| m.criterion <= limit) {
        if !out.iter().any(|m| m.motion.differs(&minimum.motion, &some) < SAME) {
            out.push(minimum);
        }
    }
    for minimum in &mut out {
        minimum.motion = minimum.motion.after(-instant).unwrap_or(minimum.motion);
    }
    out
}

/// The times of all data.
fn checked_times(spinning: &Spinning) -> Result<Vec<f64>, TumbleError> {
    let all: Vec<f64> = spinning.times.iter().flatten().copied().collect();
    let (low, high) = all.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), t| (t.min(l), t.max(h)));
    if spinning.is_timed() && all.iter().all(|t| t.is_finite()) && high > low && high - low <= 1e9 {
        return Ok(all);
    }
    let data = spinning.curves.iter().map(|c| c.y.len()).sum();
    Err(TumbleError::Times { times: all.iter().filter(|t| t.is_finite()).count(), data })
}
