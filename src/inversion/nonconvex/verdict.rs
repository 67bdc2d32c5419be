//! Can a convex body have sent this light?
//!
//! The best convex fit, closure not demanded, leaves two traces of a body that is not convex: a floor of its residuals, chi^2 above its
//! degrees of freedom, and a closure defect, sum a n not 0 (Kaasalainen & Torppa 2001, Icarus 153, 24, sect. 3).
//!
//! The floor is that of all convex bodies: non-negative least squares on a grid of normals and on the facets of the sparse fit. A sparse fit
//! alone would not do: it merges what the noise allows, and its chi^2 rises. With k columns in the support chi^2 has T - k degrees of
//! freedom (Stein's estimate of the risk; Meyer & Woodroofe 2000, Ann. Stat. 28, 1083); its limit is that of Wilson & Hilferty 1931
//! (PNAS 17, 684). The defect is that of the sparse fit, with a tenth of the false-alarm rate, for merged facets shift it a little.
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
/// Share of the sphere that no datum sees, from which on closure says nothing.
const UNSEEN: f64 = 0.02;
/// Normals of the grid.
const GRID: usize = 2000;
/// Share of the false-alarm rate that the defect has.
const BY_DEFECT: f64 = 0.1;
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
    /// Its length in standard deviations; 0 where part of the sphere was not seen, or where the fit knows no error of it.
    pub defect_sigmas: f64,
    /// Number of standard deviations above which it is not noise.
    pub defect_limit: f64,
    /// Least defect that would be found in nine cases of ten; infinite where closure says nothing.
    pub defect_found: f64,
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
    let (chi2, dof) = floor(problem, material, &fit)?;
    let one_sided = quantile((1.0 - BY_DEFECT) * rate);
    let ninth = 2.0 / (9.0 * dof);
    let chi2_limit = dof * (1.0 - ninth + one_sided * ninth.sqrt()).max(0.0).powi(3);
    // x = limit - dof + POWER sqrt(2 (dof + 2 x)), a contraction for dof > 3
    let mut hidden = chi2_limit - dof;
    for _ in 0..50 {
        hidden = chi2_limit - dof + POWER * (2.0 * (dof + 2.0 * hidden)).max(0.0).sqrt();
    }
    let share =
        |excess: f64| (excess.max(0.0) / problem.len().max(1) as f64).sqrt() / fit.snr.max(f64::MIN_POSITIVE);
    // with one dominant direction the square over its mean is chi^2 of one degree of freedom: the widest case
    let defect_limit = quantile(0.5 * BY_DEFECT * rate);
    let tells = fit.unobserved < UNSEEN && fit.defect_sd > 0.0 && fit.defect_sd.is_finite();
    let defect_sigmas = if tells { fit.defect.length() / fit.defect_sd } else { 0.0 };
    let found = chi2 > chi2_limit || defect_sigmas > defect_limit;
    Ok(Verdict {
        call: if found { Call::NonConvex } else { Call::CannotTell },
        chi2: (chi2, dof),
        chi2_limit,
        floor: share(chi2 - dof),
        floor_found: share(hidden),
        defect: fit.defect,
        defect_sigmas,
        defect_limit,
        defect_found: if tells { (defect_limit + POWER) * fit.defect_sd } else { f64::INFINITY },
    })
}

/// chi^2 of the best of all convex bodies, and its degrees of freedom.
fn floor(problem: &Problem, material: &Material, fit: &Solution) -> Result<(f64, f64), NonconvexError> {
    let facets = fit.image();
    let normals = facets.iter().map(|f| f.normal).chain(fibonacci(GRID));
    let columns = Columns::new(problem.len(), normals.map(|n| problem.weighted_column(n, material)));
    let warm: Vec<usize> = (0..facets.len()).collect();
    let best = nnls::solve(&columns, &problem.weighted_data(), &warm).map_err(egi::EgiError::from)?;
    Ok((2.0 * best.objective, (problem.len() as f64 - best.support.len() as f64).max(1.0)))
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
