//! The body of a solution: its facets closed by their standard deviations, and Minkowski's problem solved.

use super::Solution;
use crate::inversion::minkowski::{self, Fault, closure};
use crate::object::convex::Facet;
use glam::DVec3;

/// Standard deviation of an area that is not known, as a multiple of itself.
const UNKNOWN: f64 = 1.0;
/// The least that closure may change any area by, relative: standard deviations of noise-free data are rounding.
const LEAST: f64 = 1e-12;

impl Solution {
    /// The convex body with the facets of [`Solution::shape`], closed by the change of areas that is smallest in units of their standard
    /// deviations, the centroid at the origin. Where the facets were not told to close ([`Solution::closed`]) and are open by more
    /// than 5 sigma, a facet is added and marked in [`closure::Closed::unobserved`].
    ///
    /// # Errors
    /// [`Fault`] where no body has them: fewer than four facets, all to one side, or open by more than a quarter of their area.
    pub fn body(&self) -> Result<minkowski::Solution, Fault> {
        let (normals, areas): (Vec<DVec3>, Vec<f64>) = self.shape.iter().map(|f| (f.normal, f.area)).unzip();
        let sigma = |f: &Facet| {
            let nearest = self
                .facets
                .iter()
                .max_by(|a, b| a.facet.normal.dot(f.normal).total_cmp(&b.facet.normal.dot(f.normal)));
            let relative = nearest.map(|e| e.area_sd / e.facet.area).filter(|r| r.is_finite());
            f.area * relative.unwrap_or(UNKNOWN).max(LEAST)
        };
        let sigmas = self.shape.iter().map(sigma).collect();
        let policy = if self.closed { closure::Policy::Adjust } else { closure::Policy::Significance(5.0) };
        let closure = closure::Closure { policy, sigmas: Some(sigmas), ..closure::Closure::default() };
        minkowski::solve(&normals, &areas, &minkowski::Options { closure, ..minkowski::Options::default() })
    }
}
