//! What an attitude is worth: the least chi^2 of any convex body seen in it, by non-negative least squares over even normals.
//!
//! Every body is closed, sum a n = 0 (Minkowski 1903, Math. Ann. 57, 447), and normals that no datum sees may close it: three rows
//! beside the data say so. Without them a false attitude leaves the body open and fits the better for it.

use super::egi::{EgiError, Problem};
use super::nnls::{self, Columns};
use super::sphere::fibonacci;
use crate::object::convex::{Epochs, Facet};
use crate::object::matter::Material;
use glam::DVec3;

/// Rounds in which free scales and facets follow each other, at most.
const SCALING: usize = 6;
/// Standard deviation of the closure rows, as a share of the total area.
const CLOSURE: f64 = 3e-3;

/// The body that an attitude allows.
#[derive(Debug, Clone)]
pub(super) struct Body {
    pub chi2: f64,
    /// Facets with an area.
    pub facets: Vec<Facet>,
    /// Scale over sigma of every datum.
    pub weights: Vec<f64>,
    /// Weighted residuals, those of closure last.
    pub residual: Vec<f64>,
}

/// The convex problem inside a search for attitudes.
pub(super) struct Inner<'a> {
    problem: &'a Problem,
    material: &'a Material,
    normals: Vec<DVec3>,
    /// y/sigma, and the closure rows.
    data: Vec<f64>,
    /// Weight of a normal in the closure rows.
    closure: f64,
}

impl<'a> Inner<'a> {
    /// Over so many normals.
    pub fn new(problem: &'a Problem, material: &'a Material, normals: usize) -> Self {
        let normals: Vec<DVec3> = fibonacci(normals).collect();
        let mut data = problem.weighted_data();
        // the mean square of a column over the sphere is the same in every attitude
        let square: f64 =
            normals.iter().flat_map(|&n| problem.weighted_column(n, material)).map(|g| g * g).sum::<f64>();
        let length = data.iter().map(|y| y * y).sum::<f64>().sqrt();
        let area = length / (square / normals.len().max(1) as f64).sqrt();
        let closure = if area > 0.0 && area.is_finite() { 1.0 / (CLOSURE * area) } else { 0.0 };
        data.extend([0.0; 3]);
        Self { problem, material, normals, data, closure }
    }

    /// The least chi^2 of directions in body axes.
    pub fn chi2(&self, epochs: &Epochs) -> Result<f64, EgiError> {
        Ok(self.body(epochs)?.chi2)
    }

    /// The body of least chi^2.
    pub fn body(&self, epochs: &Epochs) -> Result<Body, EgiError> {
        let (sigma, curve) = (self.problem.sigma(), self.problem.curve_of());
        let flux: Vec<Vec<f64>> = self.normals.iter().map(|&n| epochs.column(n, self.material, 0.0)).collect();
        let mut scales: Vec<f64> = self.problem.scales().iter().map(|s| s.unwrap_or(1.0)).collect();
        let mut body = Body { chi2: f64::INFINITY, facets: Vec::new(), weights: Vec::new(), residual: Vec::new() };
        let mut support = Vec::new();
        // free scales follow the facets in turn
        let rounds = if self.problem.scales().iter().any(Option::is_none) { SCALING } else { 1 };
        for _ in 0..rounds {
            let weights: Vec<f64> = sigma.iter().zip(curve).map(|(s, &c)| scales[c] / s).collect();
            let column = |(g, n): (&Vec<f64>, &DVec3)| {
                let light = g.iter().zip(&weights).map(|(g, w)| g * w);
                light.chain(self.closing(*n).to_array()).collect()
            };
            let matrix = Columns::new(self.data.len(), flux.iter().zip(&self.normals).map(column));
            let solution = nnls::solve(&matrix, &self.data, &support)?;
            let before = body.chi2;
            support.clone_from(&solution.support);
            let facet = |&j: &usize| Facet { normal: self.normals[j], area: solution.x[j] };
            body = Body {
                chi2: 2.0 * solution.objective,
                facets: solution.support.iter().map(facet).collect(),
                weights,
                residual: solution.residual,
            };
            if before - body.chi2 < 0.01 * body.chi2 {
                break;
            }
            self.rescale(&mut scales, &body.residual);
        }
        Ok(body)
    }

    /// What a facet of this normal and 1 m^2 adds to the closure rows.
    pub fn closing(&self, normal: DVec3) -> DVec3 {
        normal * self.closure
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
}
