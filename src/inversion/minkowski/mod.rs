//! Minkowski's problem: the convex polytope with given facet normals and areas.
//!
//! Exists and is unique up to translation if the normals surround the origin and sum a_i n_i = 0 (Minkowski 1897, 1903). It minimises
//! sum a_i h_i - log V(h), a convex function. [`solve`] merges equal normals, closes the image ([`closure`]), goes to the affine frame in which it
//! is round (`whiten`), comes near to the solution there by Newton's method (`newton`) with a sparse factorisation (`ldl`), and ends in
//! the image's own frame. Little's and Ikeuchi's methods are in [`baselines`].

pub mod baselines;
mod body;
pub mod cases;
pub mod closure;
mod dense;
mod dissect;
pub mod image;
mod lbfgs;
mod ldl;
mod newton;
pub mod table;
mod whiten;

use glam::DVec3;

use crate::inversion::polytope::plane::Plane;
use crate::inversion::polytope::{self, Polytope};
use body::Target;
use closure::{Closed, Closure};
use newton::Limits;

/// Sine below which normals count as coplanar, root mean square over area: the eigenvalues that tell have its square as rounding.
const FLAT: f64 = 1e-7;

/// Residual below which the image's own frame is as good as the round one: steps are Newton's, which are affinely invariant.
const NEAR: f64 = 1e-4;

/// How to solve Minkowski's problem.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Most Newton steps.
    pub iterations: usize,
    /// Largest |A - a| over the largest a that ends the iteration; it also ends where rounding does.
    pub residual: f64,
    /// Residual above which a result is refused.
    pub acceptable: f64,
    /// Normals closer than this are one facet \[rad\].
    pub merge_rad: f64,
    /// Solve in the affine frame where the image is round.
    pub whiten: bool,
    /// How an open image is closed.
    pub closure: Closure,
}

impl Default for Options {
    fn default() -> Self {
        let closure = Closure::default();
        Self { iterations: 100, residual: 1e-15, acceptable: 1e-6, merge_rad: 1e-7, whiten: true, closure }
    }
}

/// Signs of the eigenvalues of the Hessian of the volume. A convex body has one positive, three zero (translations) and else negative
/// ones (Brunn and Minkowski).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Inertia {
    /// Eigenvalues above zero.
    pub positive: usize,
    /// Eigenvalues zero.
    pub zero: usize,
    /// Eigenvalues below zero.
    pub negative: usize,
}

/// A body with the facets asked for.
#[derive(Debug, Clone)]
pub struct Solution {
    /// The body, its centroid at the origin; its facets are the image's, as closed.
    pub polytope: Polytope,
    /// The image solved for: merged and closed.
    pub image: Closed,
    /// Facet of each normal given.
    pub facet_of: Vec<u32>,
    /// Newton steps.
    pub iterations: usize,
    /// Bodies measured.
    pub evaluations: usize,
    /// Largest |A - a| over the largest a, measured on `polytope`.
    pub residual: f64,
    /// Certificate that the body is a strict minimum: from the signs of the last factorisation's pivots, by Sylvester's law.
    pub inertia: Inertia,
}

impl Solution {
    /// Distances of the facets from the centroid.
    pub fn offsets(&self) -> &[f64] {
        self.polytope.offsets()
    }
}

/// Why an image has no body.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Fault {
    /// As many areas as normals are needed.
    #[error("{normals} normals but {areas} {what}; each facet has one of both")]
    Lengths {
        /// Normals given.
        normals: usize,
        /// Others given.
        areas: usize,
        /// What the others are.
        what: &'static str,
    },
    /// Too few facets, or too many to number.
    #[error("{0} facets with distinct normals; a body has between 4 and 2^29")]
    Count(usize),
    /// A normal without direction.
    #[error("normal {index} is {value}; its length must be between 1e-50 and 1e50")]
    Normal {
        /// Place of the normal.
        index: usize,
        /// The normal.
        value: DVec3,
    },
    /// An area without meaning.
    #[error("area {index} is {value}; it must be positive, below 1e50, and above 1e-18 of the largest")]
    Area {
        /// Place of the area.
        index: usize,
        /// The area.
        value: f64,
    },
    /// A standard deviation without meaning.
    #[error("the standard deviation of area {index} is {value}; it must be positive and below 1e50")]
    Sigma {
        /// Place of the area.
        index: usize,
        /// Its standard deviation.
        value: f64,
    },
    /// The image is too far from closed.
    #[error("the image is open by {defect:.3} of its area; at most {limit} may be closed by changing areas")]
    Open {
        /// |sum a n| / sum a.
        defect: f64,
        /// The limit set.
        limit: f64,
    },
    /// All normals lie in a plane.
    #[error(
        "the normals lie in a plane (root-mean-square sine {sine:.1e}, least 1e-7): the body would be an endless prism"
    )]
    Coplanar {
        /// Root-mean-square sine of the angles to the plane.
        sine: f64,
    },
    /// All normals lie in a half-space.
    #[error(
        "the normals lie in a closed half-space: the body would be unbounded; add a facet on the other side or let one be added"
    )]
    OneSided,
    /// Newton's method did not get there.
    #[error(
        "after {iterations} steps the largest error of an area is {residual:.1e} of the largest area; acceptable is {acceptable:.1e}"
    )]
    NotSolved {
        /// Steps taken.
        iterations: usize,
        /// Largest |A - a| over the largest a.
        residual: f64,
        /// The limit set.
        acceptable: f64,
    },
    /// The offsets found do not make a body.
    #[error("the offsets found make no body: {0}")]
    Body(#[from] polytope::Fault),
}

/// The convex polytope with these facet normals (any length) and areas (any unit).
///
/// # Errors
/// [`Fault`] for values out of range, images that no body has, and where the iteration ends too far from the areas.
pub fn solve(normals: &[DVec3], areas: &[f64], options: &Options) -> Result<Solution, Fault> {
    let sigmas = options.closure.sigmas.as_deref();
    let merged = image::merge(normals, areas, sigmas, options.merge_rad)?;
    if merged.normals.len() < 4 && options.closure.policy != closure::Policy::AddFacet {
        return Err(Fault::Count(merged.normals.len()));
    }
    let sine = whiten::flatness(&vectors(&merged.normals, &merged.areas));
    if sine.is_nan() || sine <= FLAT {
        return Err(Fault::Coplanar { sine });
    }
    let closed = closure::close(&merged, &options.closure, options.merge_rad).map_err(|fault| {
        // the deeper reason first
        if surround(&merged.normals) { fault } else { Fault::OneSided }
    })?;
    let limits = Limits { iterations: options.iterations, residual: options.residual, classical: false };
    let found = descend(&closed.normals, &closed.areas, options.whiten, limits)?;
    let polytope = Polytope::from_planes(found.planes)?;
    let residual = area_residual(polytope.areas(), &closed.areas);
    if residual.is_nan() || residual > options.acceptable {
        let (iterations, acceptable) = (found.iterations, options.acceptable);
        return Err(Fault::NotSolved { iterations, residual, acceptable });
    }
    let (iterations, evaluations) = (found.iterations, found.evaluations);
    let inertia = inertia(closed.normals.len(), found.negative_pivots);
    Ok(Solution { polytope, image: closed, facet_of: merged.facet_of, iterations, evaluations, residual, inertia })
}

/// Largest |A - a| over the largest a.
pub fn area_residual(measured: &[f64], wanted: &[f64]) -> f64 {
    let largest = wanted.iter().copied().fold(0.0, f64::max);
    measured.iter().zip(wanted).map(|(m, w)| (m - w).abs()).fold(0.0, f64::max) / largest
}

fn vectors(normals: &[DVec3], areas: &[f64]) -> Vec<DVec3> {
    normals.iter().zip(areas).map(|(&n, &a)| n * a).collect()
}

/// Whether a body with these normals is bounded.
fn surround(normals: &[DVec3]) -> bool {
    let ones = vec![1.0; normals.len()];
    let target = Target::new(normals.to_vec(), &ones);
    target.body(target.planes(|_| 1.0)).is_some()
}

/// Half-spaces with the areas wanted, the centroid at the origin, and how they were found.
struct Found {
    planes: Vec<Plane>,
    iterations: usize,
    evaluations: usize,
    negative_pivots: usize,
}

/// Goes from the body around a sphere in the round frame to near the solution, and from there in the image's own frame.
fn descend(normals: &[DVec3], areas: &[f64], whiten: bool, limits: Limits) -> Result<Found, Fault> {
    let target = Target::new(normals.to_vec(), areas);
    let mut start = target.planes(|_| 1.0);
    let mut spent = (0, 0);
    if whiten {
        let frame = whiten::whitening(&vectors(normals, areas));
        let stretches: Vec<f64> = normals.iter().map(|&n| (frame * n).length()).collect();
        let normals = normals.iter().zip(&stretches).map(|(&n, s)| frame * n / s).collect();
        let areas: Vec<f64> = areas.iter().zip(&stretches).map(|(a, s)| a * s).collect();
        let round = Target::new(normals, &areas);
        let ball = round.body(round.planes(|_| 1.0)).ok_or(Fault::OneSided)?;
        let near = newton::descend(ball, &round, Limits { residual: limits.residual.max(NEAR), ..limits });
        start = target.planes(|i| near.body.planes[i].offset * stretches[i]);
        spent = (near.iterations, near.evaluations);
    }
    let start = target.body(start).ok_or(Fault::OneSided)?;
    let limits = Limits { iterations: limits.iterations.saturating_sub(spent.0), ..limits };
    let end = newton::descend(start, &target, limits);
    // A = scale^2 V a / sum a
    let scale = (areas.iter().sum::<f64>() / end.body.measures.volume).sqrt();
    let centroid = end.body.centroid();
    Ok(Found {
        planes: end.body.planes.iter().map(|plane| plane.translated(-centroid).scaled(scale)).collect(),
        iterations: spent.0 + end.iterations,
        evaluations: spent.1 + end.evaluations,
        negative_pivots: end.negative_pivots,
    })
}

/// With the border eliminated, Newton's matrix -H/V + u u' + N N' has as many eigenvalues not above zero as pivots are negative beyond
/// the border's four. H has four eigenvalues not below zero in any case: H h = 2A is positive along h, and H n_x = 0 for translations.
fn inertia(facets: usize, negative_pivots: usize) -> Inertia {
    let beyond = negative_pivots.abs_diff(4);
    Inertia { positive: 1 + beyond, zero: 3, negative: facets.saturating_sub(4 + beyond) }
}

#[cfg(test)]
mod minkowski_tests;
