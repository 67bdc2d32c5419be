//! Newton's method for A(h)/V(h) = a on the square roots of the areas.
//!
//! The Hessian of the convex function sum a_i h_i - log V(h) is K = u u' - H/V with u = A/V, and du = -K dh. A small facet at a vertex has an area
//! that goes as the square of its depth, so that Newton's method for u = a quarters it at most in a step, and loses it if that
//! is not enough. Here the step is that of Gauss and Newton for sqrt(u) = sqrt(a): du = 2 (sqrt(a u) - u), projected on closed images
//! (sum du_i n_i = 0) with weights u, which is the orthogonal projection for the roots. It reduces the Hellinger distance
//! sum (sqrt(u_i) - sqrt(a_i))^2, whose only stationary point among closed bodies with all facets is the solution; so does the plain step
//! du = a - u, tried when the first needs damping. Facets that a step loses are put back at the vertices
//! they were lost at. Near the solution both steps are Newton's.
//!
//! The classical method, for comparison, takes plain steps alone, halved until all facets keep an area of a quarter of the
//! least wanted or present one and the distance falls (Kitagawa, Merigot and Thibert 2019, JEMS 21, 2603, algorithm 1).

use glam::{DMat3, DVec3};

use super::body::{Body, Target};
use super::ldl::Ldl;

/// Halvings of a step.
const HALVINGS: i32 = 40;

/// Least fraction of the decrease promised.
const ARMIJO: f64 = 0.1;

/// Below this residual a step that does not halve it has met the end of what rounding allows.
const FINE: f64 = 1e-7;

/// Where the descent has come to.
#[derive(Debug, Clone)]
pub struct Descent {
    /// The last body.
    pub body: Body,
    /// Steps taken: factorisations.
    pub iterations: usize,
    /// Bodies measured.
    pub evaluations: usize,
    /// Largest |A/V - a| over the largest a.
    pub residual: f64,
    /// Pivots below zero at the last factorisation: 4 for the border.
    pub negative_pivots: usize,
}

/// How far to go.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// Most steps.
    pub iterations: usize,
    /// Residual that is small enough.
    pub residual: f64,
    /// Plain steps alone.
    pub classical: bool,
}

/// Goes from `start` towards the target.
pub fn descend(start: Body, target: &Target, limits: Limits) -> Descent {
    let residual = residual(&start, target);
    let mut way = Descent { body: start, iterations: 0, evaluations: 1, residual, negative_pivots: 4 };
    if !way.body.is_whole() {
        return way;
    }
    let mut earlier = f64::INFINITY;
    while way.iterations < limits.iterations && way.residual > limits.residual {
        let factors = way.body.factors();
        way.iterations += 1;
        way.negative_pivots = factors.negative;
        let Some(body) = step(&mut way, &factors, target, limits.classical) else { break };
        let (before, after) = (way.residual, self::residual(&body, target));
        if before > FINE || after < before {
            let centred = if before > FINE { recentred(body, target) } else { body };
            (way.body, way.residual) = (centred, after);
        }
        // at the end of the digits: no longer halved, or far above what quadratic convergence promises
        let promised = (before / earlier).powi(2) * before;
        if before < FINE && (after > 0.5 * before || (after < 1e-11 && after > 100.0 * promised)) {
            break;
        }
        earlier = before;
    }
    way
}

/// Largest |A/V - a| over the largest a.
fn residual(body: &Body, target: &Target) -> f64 {
    let errors = body.shares().into_iter().zip(&target.areas).map(|(u, a)| (u - a).abs());
    errors.fold(0.0, f64::max) / target.largest()
}

/// Hellinger's distance squared.
fn distance(body: &Body, target: &Target) -> f64 {
    body.shares().into_iter().zip(&target.areas).map(|(u, a)| (u.sqrt() - a.sqrt()).powi(2)).sum()
}

/// The better of the two damped steps, the second looked at only if the first is damped.
fn step(way: &mut Descent, factors: &Ldl, target: &Target, classical: bool) -> Option<Body> {
    let shares = way.body.shares();
    let changes: [fn(f64, f64) -> f64; 2] = [|u, a| 2.0 * ((u * a).sqrt() - u), |u, a| a - u];
    let mut best: Option<(f64, Body)> = None;
    for change in &changes[usize::from(classical)..] {
        let wanted = shares.iter().zip(&target.areas).map(|(&u, &a)| change(u, a)).collect();
        let direction = factors.solve(&closed(wanted, &shares, &target.normals));
        let Some((length, distance, body)) = search(way, &direction, target, classical) else { continue };
        if best.as_ref().is_none_or(|(least, _)| distance < *least) {
            best = Some((distance, body));
        }
        if length == 1.0 {
            break;
        }
    }
    best.map(|(_, body)| body)
}

/// Halves a step until the body has all facets and is nearer: length, distance, body.
fn search(way: &mut Descent, direction: &[f64], target: &Target, classical: bool) -> Option<(f64, f64, Body)> {
    let here = distance(&way.body, target);
    let shares = way.body.shares();
    let least = |values: &[f64]| values.iter().copied().fold(f64::INFINITY, f64::min);
    let floor = 0.25 * least(&shares).min(least(&target.areas));
    for halving in 0..HALVINGS {
        let length = 0.5_f64.powi(halving);
        let planes = way.body.planes.iter().zip(direction).map(|(plane, d)| plane.moved(-length * d)).collect();
        way.evaluations += 1;
        let body = if classical {
            target.body(planes).filter(|body| least(&body.shares()) >= floor)
        } else {
            let root = |i: usize| shares[i].sqrt() + length * (target.areas[i].sqrt() - shares[i].sqrt());
            target.whole_body(planes, |i| root(i).powi(2), &way.body)
        };
        let Some(body) = body else { continue };
        let there = distance(&body, target);
        // at the end of the digits the distance may hang on small facets while the large ones still gain
        let fine = way.residual < FINE && residual(&body, target) < 0.5 * way.residual;
        if fine || there < (1.0 - ARMIJO * length) * here {
            return Some((length, there, body));
        }
        if way.residual < FINE && halving > 2 {
            break;
        }
    }
    None
}

/// The change of areas nearest to `wanted`, with weights 1/u, that leaves sum a_i n_i as it is.
fn closed(mut wanted: Vec<f64>, shares: &[f64], normals: &[DVec3]) -> Vec<f64> {
    let mut moment = DVec3::ZERO;
    let mut spread = DMat3::ZERO;
    for ((w, u), &n) in wanted.iter().zip(shares).zip(normals) {
        moment += *w * n;
        spread += DMat3::from_cols(n * n.x, n * n.y, n * n.z) * *u;
    }
    let tilt = spread.inverse() * moment;
    wanted.iter_mut().zip(shares).zip(normals).for_each(|((w, u), n)| *w -= u * n.dot(tilt));
    wanted
}

/// The body about the mean of its vertices if the origin is far from it.
fn recentred(body: Body, target: &Target) -> Body {
    let middle = body.middle();
    let nearest = body.planes.iter().map(|plane| plane.offset).fold(f64::INFINITY, f64::min);
    if middle.length() < 0.2 * nearest {
        return body;
    }
    let planes = body.planes.iter().map(|plane| plane.translated(-middle)).collect();
    target.body(planes).filter(Body::is_whole).unwrap_or(body)
}
