//! Older methods for Minkowski's problem, to compare with. They start from the body around a sphere in the image's own frame and may fail: a facet
//! that is lost has no gradient, so that the least-squares methods end at bodies without it.
//!
//! - Little 1983, AAAI-83, 247: least sum a_i h_i at volume 1, by projected descent.
//! - Ikeuchi 1981, AI Memo 622: least squares of the areas.
//! - The same in the variables (I + lambda L) h with the graph Laplacian L of the facets (Nicolet et al. 2021, ACM TOG 40, 248).
//! - Minimisation of sum a_i h_i - log V(h) from its gradient.

use glam::DVec3;

use super::body::{Body, Target};
use super::dissect::dissect;
use super::lbfgs::minimise;
use super::ldl::{Ldl, Matrix};
use super::{Fault, area_residual};

/// A method from gradients alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FirstOrder {
    /// Little: constrained descent.
    Little,
    /// Ikeuchi: least squares of areas.
    Ikeuchi,
    /// Ikeuchi with Nicolet's preconditioning of strength lambda.
    IkeuchiNicolet {
        /// Strength of the smoothing; 0 is Ikeuchi's method.
        lambda: f64,
    },
    /// Least sum a_i h_i - log V.
    LogVolume,
}

/// Where a method ended.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Offsets, scaled such that the body's area is the image's.
    pub offsets: Vec<f64>,
    /// Steps.
    pub iterations: usize,
    /// Bodies measured.
    pub evaluations: usize,
    /// Largest |A - a| over the largest a.
    pub residual: f64,
    /// Facets without area.
    pub lost: usize,
    /// Volume.
    pub volume: f64,
}

/// Runs a method for at most `steps` steps on a closed image of distinct unit normals.
///
/// # Errors
/// [`Fault::Lengths`], and [`Fault::OneSided`] for normals that do not surround the origin.
pub fn run(normals: &[DVec3], areas: &[f64], method: FirstOrder, steps: usize) -> Result<Outcome, Fault> {
    if normals.len() != areas.len() {
        return Err(Fault::Lengths { normals: normals.len(), areas: areas.len(), what: "areas" });
    }
    let target = Target::new(normals.to_vec(), areas);
    // around the sphere of area 1
    let radius = (0.25 / std::f64::consts::PI).sqrt();
    let start = vec![radius; normals.len()];
    let first = body_at(&target, &start).ok_or(Fault::OneSided)?;
    let (offsets, iterations, evaluations) = match method {
        FirstOrder::Little => little(&target, &first, steps),
        FirstOrder::Ikeuchi => {
            let end = minimise(start, steps, |h| squares(&target, h));
            (end.at, end.iterations, end.evaluations)
        }
        FirstOrder::IkeuchiNicolet { lambda } => {
            let smoother = smoother(&first, lambda);
            let smooth_squares = |rough: &[f64]| {
                let (value, gradient) = squares(&target, &smoother.solve(rough))?;
                Some((value, smoother.solve(&gradient)))
            };
            // constants are their own smooth image
            let end = minimise(start, steps, smooth_squares);
            (smoother.solve(&end.at), end.iterations, end.evaluations)
        }
        FirstOrder::LogVolume => {
            let end = minimise(start, steps, |h| log_volume(&target, h));
            (end.at, end.iterations, end.evaluations)
        }
    };
    let body = body_at(&target, &offsets).ok_or(Fault::OneSided)?;
    let total: f64 = areas.iter().sum();
    let scale = (total / body.measures.areas.iter().sum::<f64>()).sqrt();
    let measured: Vec<f64> = body.measures.areas.iter().map(|a| a * scale * scale).collect();
    Ok(Outcome {
        offsets: body.planes.iter().map(|plane| plane.offset * scale).collect(),
        iterations,
        evaluations,
        residual: area_residual(&measured, areas),
        lost: body.lost().count(),
        volume: body.measures.volume * scale.powi(3),
    })
}

fn body_at(target: &Target, offsets: &[f64]) -> Option<Body> {
    target.body_of_scale(target.planes(|i| offsets[i]), 1.0)
}

fn offsets_of(body: &Body) -> Vec<f64> {
    body.planes.iter().map(|plane| plane.offset).collect()
}

fn log_volume(target: &Target, offsets: &[f64]) -> Option<(f64, Vec<f64>)> {
    let body = body_at(target, offsets)?;
    let support: f64 = target.areas.iter().zip(offsets).map(|(a, h)| a * h).sum();
    let gradient = target.areas.iter().zip(body.shares()).map(|(a, u)| a - u).collect();
    Some((support - body.measures.volume.ln(), gradient))
}

/// sum (A_i - a_i)^2 and its gradient 2 H (A - a).
fn squares(target: &Target, offsets: &[f64]) -> Option<(f64, Vec<f64>)> {
    let body = body_at(target, offsets)?;
    let errors: Vec<f64> = body.measures.areas.iter().zip(&target.areas).map(|(m, a)| m - a).collect();
    let gradient = body.measures.hessian_times(&body.planes, &errors).into_iter().map(|g| 2.0 * g).collect();
    Some((errors.iter().map(|e| e * e).sum(), gradient))
}

/// Factors of I + lambda L on the facets' graph.
fn smoother(body: &Body, lambda: f64) -> Ldl {
    let measures = &body.measures;
    let range = |i: usize| measures.starts[i]..measures.starts[i + 1];
    let normals: Vec<DVec3> = body.planes.iter().map(|plane| plane.normal).collect();
    let parts = dissect(&normals, |i| &measures.neighbours[range(i as usize)]);
    let matrix = Matrix {
        starts: &measures.starts,
        neighbours: &measures.neighbours,
        values: vec![-lambda; measures.neighbours.len()],
        diagonal: (0..normals.len()).map(|i| 1.0 + lambda * range(i).len() as f64).collect(),
        border: Vec::new(),
    };
    Ldl::new(&matrix, &parts)
}

/// Steps along the areas wanted less their part along the present areas, back to volume 1 by scale; the length doubles after a success.
fn little(target: &Target, first: &Body, steps: usize) -> (Vec<f64>, usize, usize) {
    let support = |h: &[f64]| target.areas.iter().zip(h).map(|(a, h)| a * h).sum::<f64>();
    let unit_volume = |body: Body| {
        let scale = body.measures.volume.cbrt().recip();
        target.body_of_scale(body.planes, scale)
    };
    let Some(mut body) = unit_volume(first.clone()) else { return (offsets_of(first), 0, 1) };
    let (mut length, mut evaluations) = (1.0, 1);
    for iteration in 0..steps {
        let here = offsets_of(&body);
        let areas = &body.measures.areas;
        let along = target.areas.iter().zip(areas).map(|(a, m)| a * m).sum::<f64>()
            / areas.iter().map(|m| m * m).sum::<f64>();
        let direction: Vec<f64> = target.areas.iter().zip(areas).map(|(a, m)| along * m - a).collect();
        let slope = direction.iter().map(|d| d * d).sum::<f64>();
        let value = support(&here);
        let mut next = None;
        for _ in 0..60 {
            let tried: Vec<f64> = here.iter().zip(&direction).map(|(h, d)| h + length * d).collect();
            evaluations += 1;
            let found = body_at(target, &tried).and_then(unit_volume);
            next = found.filter(|body| support(&offsets_of(body)) < value - 0.1 * length * slope);
            if next.is_some() {
                break;
            }
            length *= 0.5;
        }
        let Some(found) = next else { return (here, iteration, evaluations) };
        body = found;
        length *= 2.0;
    }
    (offsets_of(&body), steps, evaluations)
}
