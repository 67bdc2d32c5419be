//! Facets and material together.
//!
//! The unknown parameters join the off-grid fit, their derivatives by central differences of the whole curve, so that their
//! covariance with the facets comes out too. A coarse grid of non-negative least squares only picks where fits start: as an inner
//! problem of its own it would be biased, for a lobe may be narrowed by widening the facets' cluster. Area and albedo are
//! one number: keep diffuse + specular fixed and free their ratio.

use super::fit::{Fit, Unknowns, View};
use super::support::Grid;
use super::{EgiError, Options, Problem, Solution, solve_from};
use crate::inversion::nnls;
use crate::object::matter::Material;
use std::sync::Arc;

/// Starting points of the grid at most.
const POINTS: usize = 36;
/// Directions of its non-negative least squares.
const DIRECTIONS: usize = 400;
/// Starting points that are followed, at most.
const STARTS: usize = 3;

/// Facets and the parameters of their material, each from its least to its greatest value in `bounds`; the parameters come out as
/// [`Solution::unknowns`].
///
/// # Errors
/// Bounds that do not rise, and materials out of their ranges at the starting points.
pub fn solve(
    problem: &Problem,
    bounds: &[(f64, f64)],
    material: &(dyn Fn(&[f64]) -> Material + Sync),
    options: &Options,
) -> Result<Solution, EgiError> {
    let view = |values: &[f64]| View { epochs: problem.epochs.clone(), material: material(values) };
    let unknowns = Unknowns { bounds: bounds.to_vec(), view: &view };
    let mut starts = Vec::new();
    for values in grid(bounds)? {
        let view = view(&values);
        view.material.check()?;
        starts.push((coarse(problem, view)?, values));
    }
    starts.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut best: Option<(f64, Solution)> = None;
    for (_, values) in starts.into_iter().take(STARTS) {
        let solution = solve_from(problem, view(&values), Some(&unknowns), values, options)?;
        let price = solution.chi2 + solution.facets.len() as f64 * super::worth(problem, options, 1.0);
        if best.as_ref().is_none_or(|(least, _)| price < *least) {
            best = Some((price, solution));
        }
        // chi^2 as noise alone would have it, to 3 sigma: no other start can do better
        if best.as_ref().is_some_and(|(_, s)| s.chi2 < s.dof + 3.0 * (2.0 * s.dof.max(0.0)).sqrt()) {
            break;
        }
    }
    match best {
        Some((_, solution)) => Ok(solution),
        None => super::solve(problem, &material(&[]), options),
    }
}

/// Points inside the bounds, evenly spread, as many along each.
fn grid(bounds: &[(f64, f64)]) -> Result<Vec<Vec<f64>>, EgiError> {
    for (number, &(low, high)) in bounds.iter().enumerate() {
        if !(low < high && low.is_finite() && high.is_finite()) {
            return Err(EgiError::Unknown { number, value: 0.5 * (low + high), low, high });
        }
    }
    let along = libm::floor(libm::pow(POINTS as f64, 1.0 / bounds.len().max(1) as f64) + 1e-9).max(1.0) as usize;
    let mut out = vec![Vec::new()];
    for &(low, high) in bounds.iter().take(6) {
        let value = |k: usize| low + (high - low) * (k as f64 + 0.5) / along.min(8) as f64;
        out = out
            .iter()
            .flat_map(|v: &Vec<f64>| (0..along.min(8)).map(|k| [&v[..], &[value(k)]].concat()))
            .collect();
    }
    // beyond six unknowns the rest start at their middles
    out.iter_mut().for_each(|v| v.extend(bounds.iter().skip(6).map(|(low, high)| 0.5 * (low + high))));
    Ok(out)
}

/// chi^2 of non-negative least squares.
fn coarse(problem: &Problem, view: View) -> Result<f64, EgiError> {
    let weights = Arc::new(problem.sigma.iter().map(|s| s.recip()).collect());
    let scales = problem.scales.iter().map(|s| s.unwrap_or(1.0)).collect();
    let (values, facets) = Default::default();
    let fit =
        Fit { problem, unknowns: None, view: Arc::new(view), values, facets, scales, weights, closed: false };
    let data: Vec<f64> = problem.y.iter().zip(&problem.sigma).map(|(y, s)| y / s).collect();
    Ok(2.0 * nnls::solve(&Grid::new(&fit, DIRECTIONS).weighted(&fit), &data, &[])?.objective)
}
