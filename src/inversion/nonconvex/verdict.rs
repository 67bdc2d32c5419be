//! Can a convex body have sent this light?
//!
//! The best convex fit, closure not demanded, leaves two traces of a body that is not convex: a floor of its residuals, chi^2 above its
//! degrees of freedom, and facets that do not close, sum a n not 0 (Kaasalainen & Torppa 2001, Icarus 153, 24, sect. 3).
//!
//! The floor is that of all convex bodies: non-negative least squares on a grid of normals and on the facets of sparse fits, which alone would
//! not do: they merge what the noise allows, and their chi^2 rises. With k columns in the support chi^2 has T - k degrees of
//! freedom (Stein's estimate of the risk; Meyer & Woodroofe 2000, Ann. Stat. 28, 1083); its limit is that of Wilson & Hilferty 1931
//! (PNAS 17, 684). What closure costs is the chi^2 of the same least squares with sum a n = 0 less that without, of k - k' + 3 degrees of freedom
//! (k' columns in the closed support), 3 at least: images that differ in what the data do not tell are both sides of it, so that few
//! geometries raise no alarms. Facets that nobody sees close a body for nothing. Each test has half the false-alarm rate.
//!
//! The power is that of the first test: the least floor that it would find in nine cases of ten, by the variance 2 (dof + 2 x)
//! of a chi^2 with non-centrality x. Where neither test objects nothing is proven: noise may hide a concavity, or the phase angles
//! may be too small.

use super::NonconvexError;
use crate::inversion::egi::{self, Problem, Solution};
use crate::inversion::nnls::{self, Columns};
use crate::inversion::sphere::fibonacci;
use crate::object::matter::Material;
use glam::DVec3;

/// Standard normal quantile of nine cases of ten.
const POWER: f64 = 1.2816;
/// Normals of the grid.
const GRID: usize = 2000;
/// Standard deviation of closure in units of that of one facet's area: none that counts.
const CLOSED: f64 = 0.05;
/// Standard deviations of chi^2 beyond which a sparse fit is stuck, or its body not convex, which the floor tells.
const STUCK: f64 = 3.0;
/// Range of the false-alarm rate.
const RATES: (f64, f64) = (1e-6, 0.5);

/// What the tests say.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Call {
    /// No convex body of this material sends this light.
    NonConvex,
    /// The data cannot tell: a convex body fits.
    CannotTell,
}

/// The tests in numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Verdict {
    /// What they say.
    pub call: Call,
    /// chi^2 of the best convex fit, facets as many as it takes, and its degrees of freedom.
    pub chi2: (f64, f64),
    /// chi^2 above which it is not noise.
    pub chi2_limit: f64,
    /// Root mean square of the residuals beyond noise, as a share of that of the flux; 0 where there are none.
    pub floor: f64,
    /// Least such floor that would be found in nine cases of ten.
    pub floor_found: f64,
    /// Closure defect, sum a n over sum a.
    pub defect: DVec3,
    /// What closing the facets costs, as a deviate of the standard normal distribution; 0 for less than 0.
    pub defect_sigmas: f64,
    /// Deviate above which it is not noise.
    pub defect_limit: f64,
}

/// Standard normal quantile of an upper tail, by bisection.
fn quantile(tail: f64) -> f64 {
    let (mut low, mut high) = (-10.0, 10.0);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if 0.5 * libm::erfc(middle / std::f64::consts::SQRT_2) > tail {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// The test of calibrated curves at a false-alarm rate from 1e-6 to 0.5; 0.02 is a good choice.
///
/// # Errors
/// As of [`egi::solve`]; a rate out of its range.
pub fn test(problem: &Problem, material: &Material, rate: f64) -> Result<Verdict, NonconvexError> {
    let (low, high) = RATES;
    if !(low..=high).contains(&rate) {
        return Err(NonconvexError::Option { option: "rate", value: rate, low, high });
    }
    let options = egi::Options { closure: egi::Closure::Off, ..egi::Options::default() };
    let fit = egi::solve(problem, material, &options)?;
    let Fits { chi2, dof, closing } = fits(problem, material, &fit)?;
    let limit = quantile(0.5 * rate);
    let ninth = 2.0 / (9.0 * dof);
    let chi2_limit = dof * (1.0 - ninth + limit * ninth.sqrt()).max(0.0).powi(3);
    // x = limit - dof + POWER sqrt(2 (dof + 2 x)), a contraction for dof > 3
    let mut hidden = chi2_limit - dof;
    for _ in 0..50 {
        hidden = chi2_limit - dof + POWER * (2.0 * (dof + 2.0 * hidden)).max(0.0).sqrt();
    }
    let share =
        |excess: f64| (excess.max(0.0) / problem.len().max(1) as f64).sqrt() / fit.snr.max(f64::MIN_POSITIVE);
    let found = chi2 > chi2_limit || closing > limit;
    Ok(Verdict {
        call: if found { Call::NonConvex } else { Call::CannotTell },
        chi2: (chi2, dof),
        chi2_limit,
        floor: share(chi2 - dof),
        floor_found: share(hidden),
        defect: fit.defect,
        defect_sigmas: closing,
        defect_limit: limit,
    })
}

/// The best of all convex images.
struct Fits {
    /// chi^2 of the best, and its degrees of freedom.
    chi2: f64,
    dof: f64,
    /// By how much the best that closes is worse: a standard normal deviate.
    closing: f64,
}

fn fits(problem: &Problem, material: &Material, open: &Solution) -> Result<Fits, NonconvexError> {
    let options = egi::Options { closure: egi::Closure::On, ..egi::Options::default() };
    let closed = egi::solve(problem, material, &options)?;
    let facets: Vec<DVec3> = open.image().iter().chain(&closed.image()).map(|f| f.normal).collect();
    let warm: Vec<usize> = (0..open.image().len()).collect();
    let normals: Vec<DVec3> = facets.into_iter().chain(fibonacci(GRID)).collect();
    let area: f64 = open.image().iter().map(|f| f.area).sum();
    let area = if area > 0.0 { area } else { 1.0 };
    let slack = CLOSED * area / (problem.snr() * (problem.len() as f64).sqrt()).max(1.0);
    let best = |rows: usize| {
        let column = |n: &DVec3| {
            let mut column = problem.weighted_column(*n, material);
            column.extend((*n / slack).to_array().iter().take(rows));
            column
        };
        let mut data = problem.weighted_data();
        data.resize(data.len() + rows, 0.0);
        let columns = Columns::new(data.len(), normals.iter().map(column));
        nnls::solve(&columns, &data, &warm).map_err(egi::EgiError::from)
    };
    let (free, shut) = (best(0)?, best(3)?);
    let (chi2, count) = (2.0 * free.objective, free.support.len() as f64);
    let more = (count - shut.support.len() as f64 + 3.0).max(3.0);
    let ninth = 2.0 / (9.0 * more);
    let rise = (2.0 * shut.objective - chi2).max(0.0);
    // a sparse fit that is stuck says nothing of the facets by which images may close
    if open.chi2 > open.dof.max(1.0) + STUCK * (2.0 * open.dof.max(1.0)).sqrt() {
        return Ok(Fits { chi2, dof: (problem.len() as f64 - count).max(1.0), closing: 0.0 });
    }
    let closing = (((rise / more).cbrt() - 1.0 + ninth) / ninth.sqrt()).max(0.0);
    Ok(Fits { chi2, dof: (problem.len() as f64 - count).max(1.0), closing })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_of_the_normal_distribution() {
        for (tail, z) in [(0.5, 0.0), (0.1, 1.281_551_565_5), (0.01, 2.326_347_874_0), (1e-6, 4.753_424_308_8)] {
            assert!((quantile(tail) - z).abs() < 1e-9, "{tail}");
        }
    }
}
