//! From light curves to the extended Gaussian image of a convex body: facet normals and areas.
//!
//! min over non-negative measures mu on the sphere of 1/2 ||W (y - k int g(n) dmu)||^2 + closure (Kaasalainen & Torppa 2001, Icarus
//! 153, 24; the measure is a sum of facets: Robinson & Frueh). A grid would shatter every facet among its neighbours, so it
//! is but the start:
//!
//! ```text
//! start      non-negative least squares on 2000 directions, neighbours merged
//! fit        all areas, normals, scales and unknowns together
//! simplify   fewer facets where the data do not object
//! extend     one more where the dual certificate demands it; again from `fit` until neither changes anything
//! ```
//!
//! On data better than 1:30 this runs at a supposed noise of 1:30 first, then at a tenth of it, down to the true one: facets that
//! only rounding could tell apart never arise. What comes out says how sure it is: covariance, certificate, closure, what no
//! datum has seen, and whether a smooth body would do as well.

mod body;
mod doubt;
mod fit;
pub mod joint;
pub mod matching;
mod outcome;
mod problem;
mod smooth;
mod spread;
mod support;

pub(super) use fit::{Unknowns, View};
pub use outcome::{Direction, Estimate, Solution, Verdict};
pub use problem::{Curve, Problem, ProblemError, Scale};
pub use smooth::Smooth;

use super::nnls::{self, NnlsError};
use crate::object::convex::Facet;
use crate::object::matter::{Material, MaterialError, Model};
use fit::Fit;
use std::sync::Arc;
pub(super) use support::cluster;
use support::{Grid, NO_FLUX};

/// Whether the facets must close, sum a n = 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Closure {
    /// Where the data see every direction.
    Auto,
    /// Always.
    On,
    /// Never.
    Off,
}

/// How to solve.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Directions of the grid, 100 to 20 000.
    pub grid: usize,
    /// Facets of the start nearer than this are merged \[rad\].
    pub merge: f64,
    /// Whether facets must close.
    pub closure: Closure,
    /// Residuals beyond this many sigma count linearly (Huber 1964, Ann. Math. Stat. 35, 73); 1.345 costs 5 % of efficiency.
    pub huber: Option<f64>,
    /// Most facets; a smooth body would need ever more.
    pub most: usize,
    /// What a parameter must lower chi^2 by: none for ln T (Schwarz 1978), which finds the right number of facets; 2 (Akaike 1974,
    /// IEEE Trans. AC 19, 716) predicts the curve better. 0.5 to 100.
    pub price: Option<f64>,
    /// Facets whose direction is less sure than this are not claimed: standard deviation \[rad\].
    pub claim: f64,
}

impl Default for Options {
    fn default() -> Self {
        let claim = 5f64.to_radians();
        Self { grid: 2000, merge: 0.12, closure: Closure::Auto, huber: None, most: 150, price: None, claim }
    }
}

/// Why there is no solution.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum EgiError {
    /// The first stage failed.
    #[error(transparent)]
    Start(#[from] NnlsError),
    /// A material that cannot be.
    #[error(transparent)]
    Material(#[from] MaterialError),
    /// A mirror shows the Sun in one direction only, which no fit can slide into.
    #[error("{model}: glints of a flat mirror cannot be fitted; use a lobe at least 1 deg wide")]
    Mirror {
        /// Model's name.
        model: &'static str,
    },
    /// An option out of its range.
    #[error("{option} = {value} is outside {low} to {high}")]
    Option {
        /// Its name.
        option: &'static str,
        /// Its value.
        value: f64,
        /// Least allowed.
        low: f64,
        /// Greatest allowed.
        high: f64,
    },
    /// An unknown without room.
    #[error("unknown {number} = {value} is outside {low} to {high}, which must be finite and rising")]
    Unknown {
        /// Its number.
        number: usize,
        /// Where it starts.
        value: f64,
        /// Least allowed.
        low: f64,
        /// Greatest allowed.
        high: f64,
    },
}

/// Noise at which facets are first told apart: one part in this many.
const COARSE: f64 = 30.0;
/// Ratio of one supposed noise to the next.
const FINER: f64 = 10.0;
/// Rounds of fitting at one noise.
const ROUNDS: usize = 60;
/// Rounds of robust weights.
const ROBUST: usize = 5;
/// Facets nearer than this are merged where a smooth body fits too \[rad\].
const SMOOTH_MERGE: f64 = 0.35;
/// Times that the total area stands above the noise in a direction that counts as seen.
const SEEN: f64 = 5.0;

/// Facets of one known material.
///
/// # Errors
/// Options and materials out of their ranges.
pub fn solve(problem: &Problem, material: &Material, options: &Options) -> Result<Solution, EgiError> {
    let view = View { epochs: problem.epochs.clone(), material: material.clone() };
    solve_from(problem, view, None, Vec::new(), options)
}

pub(super) fn solve_from(
    problem: &Problem,
    view: View,
    unknowns: Option<&Unknowns>,
    values: Vec<f64>,
    options: &Options,
) -> Result<Solution, EgiError> {
    check(&view.material, options)?;
    let (mut fit, grid) = start(problem, view, unknowns, values, options)?;
    // a smooth body has no end of facets: the search for them would be long, and vain
    if let Some(few) = grid.as_ref().and_then(|grid| smooth_as_well(&fit, grid, options)) {
        return Ok(outcome::conclude(few, grid.as_ref(), options));
    }
    refine(&mut fit, grid.as_ref(), options);
    for _ in 0..options.huber.map_or(0, |_| ROBUST) {
        let before = fit.weights.clone();
        reweigh(&mut fit, options);
        let change = before.iter().zip(fit.weights.iter()).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max);
        if change < 1e-3 {
            break;
        }
        refine(&mut fit, grid.as_ref(), options);
    }
    Ok(outcome::conclude(fit, grid.as_ref(), options))
}

/// The few facets that do as well as a smooth body, where one explains the data and is the simpler explanation.
fn smooth_as_well<'a>(fit: &Fit<'a>, grid: &Grid, options: &Options) -> Option<Fit<'a>> {
    let factor = smooth::noise(fit.problem.snr());
    let bodies = smooth::fits(fit, grid);
    if !bodies.iter().any(|(_, chi2)| smooth::within_noise(chi2 / (factor * factor), fit.problem.len())) {
        return None;
    }
    let mut few = fit.clone();
    support::cluster(&mut few.facets, SMOOTH_MERGE);
    few.descend(0.01 * worth(fit.problem, options, factor), ROUNDS);
    drop_dark(&mut few);
    support::simplify(&mut few, worth(fit.problem, options, factor));
    let facets = few.facets.len();
    smooth::preferred(&bodies, few.chi2(), facets, fit.problem).is_some().then_some(few)
}

fn check(material: &Material, options: &Options) -> Result<(), EgiError> {
    material.check()?;
    if material.model == Model::Mirror && material.specular > 0.0 {
        return Err(EgiError::Mirror { model: material.model.name() });
    }
    let range = |option, value: f64, low, high| match (low..=high).contains(&value) {
        true => Ok(()),
        false => Err(EgiError::Option { option, value, low, high }),
    };
    range("grid", options.grid as f64, 100.0, 20_000.0)?;
    range("merge", options.merge, 0.0, 1.0)?;
    range("huber", options.huber.unwrap_or(1.0), 0.5, 10.0)?;
    range("price", options.price.unwrap_or(2.0), 0.5, 100.0)?;
    range("most", options.most as f64, 1.0, 1000.0)?;
    range("claim", options.claim, 0.0, 3.2)
}

/// What a facet's three parameters must be worth in chi^2, at a noise `factor` times the true one.
fn worth(problem: &Problem, options: &Options, factor: f64) -> f64 {
    let each = options.price.unwrap_or_else(|| libm::log(problem.len().max(2) as f64));
    3.0 * each * factor * factor
}

/// The flux of a grid of directions: made once where nothing beside facets and scales is unknown.
fn grid_of<'g>(fit: &Fit, kept: Option<&'g Grid>, own: &'g mut Option<Grid>, count: usize) -> &'g Grid {
    match kept {
        Some(grid) => grid,
        None => own.insert(Grid::new(fit, count)),
    }
}

fn start<'a>(
    problem: &'a Problem,
    view: View,
    unknowns: Option<&'a Unknowns<'a>>,
    values: Vec<f64>,
    options: &Options,
) -> Result<(Fit<'a>, Option<Grid>), EgiError> {
    let weights = Arc::new(problem.sigma.iter().map(|s| s.recip()).collect());
    let scales = problem.scales.iter().map(|s| s.unwrap_or(1.0)).collect();
    let facets = Vec::new();
    let mut fit = Fit { problem, unknowns, view: Arc::new(view), values, facets, scales, weights, closed: false };
    let grid = Grid::new(&fit, options.grid);
    let mut support = Vec::new();
    // free scales and robust weights follow the facets in turn
    let free = problem.scales.iter().any(Option::is_none);
    let rounds = if free || options.huber.is_some() { 10 } else { 1 };
    for _ in 0..rounds {
        let data: Vec<f64> = problem.y.iter().zip(fit.weights.iter()).map(|(y, w)| y * w).collect();
        let solution = nnls::solve(&grid.weighted(&fit), &data, &support)?;
        support = solution.support;
        fit.facets = support.iter().map(|&j| Facet { normal: grid.normals[j], area: solution.x[j] }).collect();
        if free {
            rescale(&mut fit);
        }
        if options.huber.is_some() {
            reweigh(&mut fit, options);
        }
    }
    let least = 1e-4 * fit.total();
    fit.facets.retain(|f| f.area > least);
    support::cluster(&mut fit.facets, options.merge);
    let norms = grid.weighted(&fit).norms();
    let seen = norms.iter().all(|norm| norm * fit.total() > SEEN);
    fit.closed = options.closure == Closure::On || options.closure == Closure::Auto && seen;
    Ok((fit, unknowns.is_none().then_some(grid)))
}

/// Free scales by least squares, the facets held.
fn rescale(fit: &mut Fit) {
    let model = fit.view.epochs.curve(&fit.facets, &fit.view.material, 0.0);
    for (c, _) in fit.problem.scales.iter().enumerate().filter(|(_, scale)| scale.is_none()) {
        let (mut ym, mut mm) = (0.0, 0.0);
        for (t, m) in model.iter().enumerate().filter(|(t, _)| fit.problem.curve[*t] == c) {
            let w2 = fit.weights[t] * fit.weights[t];
            ym += w2 * fit.problem.y[t] * m;
            mm += w2 * m * m;
        }
        if ym > 0.0 && mm > 0.0 {
            fit.scales[c] = ym / mm;
        }
    }
}

/// Weights of Huber for the residuals as they are.
fn reweigh(fit: &mut Fit, options: &Options) {
    let Some(bound) = options.huber else { return };
    let residual = fit.residual(0.0);
    let weight = |((r, w), sigma): ((&f64, &f64), &f64)| {
        let z = (r / w).abs() / sigma;
        (bound / z.max(bound)).sqrt() / sigma
    };
    let weights = residual.iter().zip(fit.weights.iter()).zip(&fit.problem.sigma).map(weight).collect();
    fit.weights = Arc::new(weights);
}

/// From the start to the fewest facets that the data allow.
fn refine(fit: &mut Fit, kept: Option<&Grid>, options: &Options) {
    let count = fit.problem.len() as f64;
    let excess = |fit: &Fit| (fit.chi2() / count).sqrt();
    let most = options.most.min(fit.problem.len() / 4 + 1);
    fit.descend(0.01 * worth(fit.problem, options, 1.0), ROUNDS);
    let mut factor = (fit.problem.snr() / COARSE).min(excess(fit)).max(1.0);
    loop {
        let worth = worth(fit.problem, options, factor);
        for _ in 0..options.most {
            fit.descend(0.01 * worth, ROUNDS);
            drop_dark(fit);
            support::simplify(fit, worth);
            let mut own = None;
            let grid = grid_of(fit, kept, &mut own, options.grid);
            if fit.facets.len() >= most || !support::extend(fit, grid, worth, support::ANYWHERE) {
                break;
            }
        }
        if factor <= 1.0 {
            break;
        }
        fit.descend(1e-6 * worth, ROUNDS);
        let reached = excess(fit);
        factor = if reached < 1.2 { 1.0 } else { (factor / FINER).min(reached).max(1.0) };
    }
    fit.descend(1e-6, 2 * ROUNDS);
}

/// Facets whose flux reaches no datum have any area at all: none.
fn drop_dark(fit: &mut Fit) {
    let norm =
        |f: &Facet| fit.column(f.normal).iter().zip(fit.weights.iter()).map(|(g, w)| (g * w).powi(2)).sum::<f64>();
    let norms: Vec<f64> = fit.facets.iter().map(norm).collect();
    let greatest = norms.iter().copied().fold(0.0, f64::max);
    let mut keep = norms.iter().map(|&n| n > NO_FLUX * NO_FLUX * greatest);
    fit.facets.retain(|_| keep.next().unwrap_or(false));
}

#[cfg(test)]
#[path = "egi_tests.rs"]
mod tests;

#[cfg(test)]
mod extreme_tests;
