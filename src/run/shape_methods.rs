//! The older methods by name: bodies by Little's, Ikeuchi's and Nicolet's ways to Minkowski's problem, facets by resampling and merging at
//! a fixed angle. They are what the methods of this project are measured against, and they say when they fail.

use super::shape_fault::InvertError;
use crate::inversion::baseline_resample::{Resample, resample_and_merge};
use crate::inversion::egi::{Curve, EgiError, Problem, ProblemError, Scale};
use crate::inversion::minkowski::baselines::{FirstOrder, run};
use crate::inversion::minkowski::{self, closure};
use crate::inversion::polytope::Polytope;
use crate::object::convex::Facet;
use crate::object::matter::Material;
use glam::DVec3;

/// Most steps of a method from gradients.
const STEPS: usize = 5000;
/// Strength of Nicolet's smoothing.
const LAMBDA: f64 = 10.0;
/// Largest error of an area over the largest area up to which a method from gradients has converged.
const CONVERGED: f64 = 1e-4;
/// Greatest closure defect of facets that are merged at a fixed angle.
const OPEN: f64 = 1.0;

/// A convex body, and how it was found.
#[derive(Debug, Clone)]
pub struct Solved {
    /// The body.
    pub polytope: Polytope,
    /// Whose method, in words.
    pub method: &'static str,
    /// Steps.
    pub iterations: usize,
    /// Bodies measured.
    pub evaluations: usize,
    /// Largest error of an area over the largest area.
    pub residual: f64,
    /// Facets without area.
    pub lost: usize,
    /// Whether its areas are those wanted.
    pub converged: bool,
}

impl From<minkowski::Solution> for Solved {
    fn from(own: minkowski::Solution) -> Self {
        Self {
            lost: own.polytope.areas().iter().filter(|a| **a <= 0.0).count(),
            polytope: own.polytope,
            method: "Newton in the round frame",
            iterations: own.iterations,
            evaluations: own.evaluations,
            residual: own.residual,
            converged: true,
        }
    }
}

/// Which way leads from areas to a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// Newton's method, this project's.
    Newton,
    /// Little 1983.
    Little,
    /// Ikeuchi 1981.
    Ikeuchi,
    /// Ikeuchi with the smoothing of Nicolet et al. 2021.
    Nicolet,
}

impl Way {
    fn first_order(self) -> Option<(FirstOrder, &'static str)> {
        match self {
            Self::Newton => None,
            Self::Little => Some((FirstOrder::Little, "Little: least support at volume 1")),
            Self::Ikeuchi => Some((FirstOrder::Ikeuchi, "Ikeuchi: least squares of areas")),
            Self::Nicolet => {
                Some((FirstOrder::IkeuchiNicolet { lambda: LAMBDA }, "Ikeuchi, smoothed after Nicolet, lambda 10"))
            }
        }
    }

    /// The body with the image of `exact`, which Newton's method has closed and solved.
    ///
    /// # Errors
    /// Words for offsets that make no body.
    pub fn body(self, exact: minkowski::Solution) -> Result<Solved, String> {
        let Some((order, method)) = self.first_order() else { return Ok(exact.into()) };
        let (normals, areas) = (&exact.image.normals, &exact.image.areas);
        let end = run(normals, areas, order, STEPS).map_err(|why| why.to_string())?;
        let polytope = Polytope::new(normals, &end.offsets).map_err(|why| why.to_string())?;
        let middle = polytope.centroid();
        Ok(Solved {
            polytope: polytope.translated(-middle),
            method,
            iterations: end.iterations,
            evaluations: end.evaluations,
            residual: end.residual,
            lost: end.lost,
            converged: end.residual <= CONVERGED && end.lost == 0,
        })
    }
}

/// Facets by resampling, with their chi^2.
#[derive(Debug, Clone)]
pub struct Draft {
    /// The facets.
    pub facets: Vec<Facet>,
    /// chi^2 of their curve.
    pub chi2: f64,
}

/// The problem of curves of known scales.
///
/// # Errors
/// As of [`Problem::new`].
pub(super) fn scaled(curves: &[Curve], scales: &[f64]) -> Result<Problem, ProblemError> {
    let fixed = |(k, c): (usize, &Curve)| Curve {
        scale: Scale::Fixed(scales.get(k).copied().unwrap_or(1.0)),
        ..c.clone()
    };
    Problem::new(&curves.iter().enumerate().map(fixed).collect::<Vec<_>>())
}

/// Facets by resampling and merging at a fixed angle, with these scales of the curves.
///
/// # Errors
/// As of [`resample_and_merge`].
pub fn draft(curves: &[Curve], scales: &[f64], material: &Material) -> Result<Draft, InvertError> {
    let problem = scaled(curves, scales)?;
    let facets = resample_and_merge(&problem, material, &Resample::default()).map_err(EgiError::from)?;
    let mut residual = problem.weighted_data();
    for facet in &facets {
        let column = problem.weighted_column(facet.normal, material);
        residual.iter_mut().zip(column).for_each(|(r, g)| *r -= facet.area * g);
    }
    Ok(Draft { facets, chi2: residual.iter().map(|r| r * r).sum() })
}

/// Little's body of facets that are closed by the least relative change of their areas.
///
/// # Errors
/// Words for facets that no body has.
pub fn draft_body(facets: &[Facet]) -> Result<Solved, String> {
    let (normals, areas): (Vec<DVec3>, Vec<f64>) = facets.iter().map(|f| (f.normal, f.area)).unzip();
    let closure = closure::Closure { policy: closure::Policy::Adjust, limit: OPEN, ..closure::Closure::default() };
    let options = minkowski::Options { closure, ..minkowski::Options::default() };
    let exact = minkowski::solve(&normals, &areas, &options).map_err(|why| why.to_string())?;
    Way::Little.body(exact)
}
