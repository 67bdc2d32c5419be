//! Facets and the unknowns of a motion together, off the grid: the last step of a search for motions.

use super::egi::{EgiError, Options, Problem, Solution, Unknowns, solve_from};

/// Price of a parameter unless told: facets that are merged too readily pull the motion (Akaike 1974, IEEE Trans. AC 19, 716).
const AKAIKE: f64 = 2.0;
/// Directions where the sparse fit looks for facets, at most: many starts are worth more than a fine one.
const GRID: usize = 500;

/// A motion with its facets.
pub(super) struct Refined {
    pub solution: Solution,
    /// Of each unknown, counted from the start.
    pub values: Vec<f64>,
    /// Standard deviations; infinite where the data do not tell.
    pub sd: Vec<f64>,
    /// chi^2 + ln det(1 + J'J), twice the negative logarithm of the evidence (MacKay 1992, Neural Comput. 4, 415).
    pub criterion: f64,
}

/// From all unknowns at 0.
pub(super) fn refine(problem: &Problem, unknowns: &Unknowns, options: &Options) -> Result<Refined, EgiError> {
    let start = vec![0.0; unknowns.bounds.len()];
    let price = options.price.or(Some(AKAIKE));
    let options = Options { price, grid: options.grid.min(GRID), ..options.clone() };
    let solution = solve_from(problem, (unknowns.view)(&start), Some(unknowns), start.clone(), &options)?;
    let told = |k: usize| solution.unknowns.get(k).copied().unwrap_or((0.0, f64::INFINITY));
    let (values, sd) = (0..start.len()).map(told).unzip();
    let criterion = solution.chi2 + solution.occam;
    Ok(Refined { values, sd, criterion, solution })
}
