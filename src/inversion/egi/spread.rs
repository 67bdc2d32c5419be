//! Facets that may be several: what an unresolved split does to the errors.
//!
//! Two facets nearer than the data resolve are found as one, and the covariance of that one facet knows nothing of it. Two ways of
//! being several are looked at, each a column c of what it would change in the curve, the vectors' sum unchanged:
//!
//! ```text
//! split    a share s of a facet lies in two halves, at angles +-0.2 rad along either tangent
//! between  a share s of the smaller of two neighbours lies in their middle, and half of it went into each
//! ```
//!
//! All else following, the data know s as s' +- e. It is 0, or normal of width w = 1, with odds e/(e^2 + w^2)^(1/2) exp(s'^2 w^2 / (2 e^2
//! (e^2 + w^2))) times those of the body (George & McCulloch 1993, JASA 88, 881), which all its facets together tell (empirical
//! Bayes): facets of a box are single, and the neighbours of a split one are suspect. The mean square of s, times the probability, widens
//! the covariance: along the change (J'J)^-1 J'c of the fit for splits, along the exchange of area for what lies between.

use super::fit::{Fit, System};
use crate::inversion::cholesky::dot;
use crate::inversion::sphere::tangents;
use crate::object::convex::Facet;
use glam::DVec3;

/// Half the angle between the halves of a split facet \[rad\].
const APART: f64 = 0.2;
/// Standard deviation of the share of a facet that is split, where it is at all.
const WIDTH: f64 = 1.0;
/// Facets nearer than this may have a third between them that went into both \[rad\].
const NEAR: f64 = 0.8;
/// Rounds of the odds.
const ROUNDS: usize = 30;
/// Share of a column, squared, below which the part that nothing else takes over is rounding.
const ROUNDING: f64 = 1e-10;
/// Ridge on the diagonal, as a share of it.
const RIDGE: f64 = 1e-13;

/// What the data say about one way in which facets may be several.
struct Chance {
    /// Inverse variance of the share, all else following.
    own: f64,
    /// The share that fits best, not below 0.
    share: f64,
    /// Logarithm of the odds, those of the body apart.
    odds: f64,
}

impl Chance {
    /// Mean square of the share, where there is one.
    fn spread(&self) -> f64 {
        let variance = 1.0 / (self.own + WIDTH.powi(-2));
        variance + (self.share * self.own * variance).powi(2)
    }
}

/// Covariance of the parameters with unresolved splits in it, and the probability that a facet is split or
/// shares another with its neighbour.
pub(super) fn covariance(fit: &Fit, system: &System) -> Option<(Vec<Vec<f64>>, Vec<f64>)> {
    let factor = system.factor(RIDGE)?;
    let mut lowered = system.gradient.clone();
    factor.forward(&mut lowered);
    let chance = |column: &[f64], along: &[f64]| {
        let mut b = along.to_vec();
        factor.forward(&mut b);
        let whole = dot(column, column);
        let own = whole - dot(&b, &b);
        if own.is_nan() || own <= ROUNDING * whole {
            return Chance { own: 0.0, share: 0.0, odds: 0.0 };
        }
        let share = ((dot(column, &system.residual[..column.len()]) - dot(&b, &lowered)) / own).max(0.0);
        let ratio = WIDTH * WIDTH * own;
        let odds = 0.5 * (share * share * own * ratio / (1.0 + ratio) - libm::log1p(ratio));
        Chance { own, share, odds }
    };
    let along = |column: &[f64]| -> Vec<f64> {
        (0..system.jacobian.ncols())
            .map(|j| dot(column, &system.jacobian.col_as_slice(j)[..column.len()]))
            .collect()
    };
    let columns: Vec<Vec<f64>> = fit.facets.iter().flat_map(|f| splits(fit, f)).collect();
    let cross: Vec<Vec<f64>> = columns.iter().map(|c| along(c)).collect();
    let chances: Vec<Chance> = columns.iter().zip(&cross).map(|(c, a)| chance(c, a)).collect();
    let evidence: Vec<f64> = chances.as_chunks::<2>().0.iter().map(|[a, b]| a.odds.max(b.odds)).collect();
    let (mut body, mut split) = (0.5, Vec::new());
    for _ in 0..ROUNDS {
        split = evidence.iter().map(|e| probability(*e, body)).collect::<Vec<f64>>();
        body = (0.5 + split.iter().sum::<f64>()) / (1.0 + split.len() as f64);
    }
    let mut covariance = factor.inverse();
    for (k, (chance, along)) in chances.iter().zip(&cross).enumerate() {
        widen(&mut covariance, &factor.solve(along.clone()), split[k / 2] * chance.spread());
    }
    let mut unresolved = split;
    for (i, j) in neighbours(&fit.facets) {
        let (a, b) = (&fit.facets[i], &fit.facets[j]);
        let (column, area, middle) = between(fit, a, b);
        let chance = chance(&column, &along(&column));
        let shared = probability(chance.odds, body);
        [i, j].into_iter().for_each(|k| unresolved[k] = f64::max(unresolved[k], shared));
        let mut change = vec![0.0; covariance.len()];
        for (k, facet, sign) in [(i, a, 0.5), (j, b, -0.5)] {
            let [e1, e2] = tangents(facet.normal);
            for (change, axis) in change.iter_mut().skip(3 * k).zip([facet.normal, e1, e2]) {
                *change = sign * area / facet.area * middle.dot(axis);
            }
        }
        widen(&mut covariance, &change, shared * chance.spread());
    }
    Some((covariance, unresolved))
}

/// Pairs nearer than [`NEAR`] with no third facet nearer to their middle (Gabriel & Sokal 1969, Syst. Zool. 18, 259).
fn neighbours(facets: &[Facet]) -> Vec<(usize, usize)> {
    let mut pairs = Vec::new();
    for (i, a) in facets.iter().enumerate() {
        for (j, b) in facets.iter().enumerate().skip(i + 1) {
            let middle = (a.normal + b.normal).normalize_or(a.normal);
            let nearer = |(k, f): (usize, &Facet)| k != i && k != j && f.normal.dot(middle) > a.normal.dot(middle);
            if a.normal.dot(b.normal) > libm::cos(NEAR) && !facets.iter().enumerate().any(nearer) {
                pairs.push((i, j));
            }
        }
    }
    pairs
}

fn probability(odds: f64, body: f64) -> f64 {
    1.0 / (1.0 + (1.0 - body) / body * libm::exp(-odds))
}

/// Add the errors that go along `change`.
fn widen(covariance: &mut [Vec<f64>], change: &[f64], mean_square: f64) {
    for (row, a) in covariance.iter_mut().zip(change).filter(|(_, a)| **a != 0.0) {
        row.iter_mut().zip(change).for_each(|(v, b)| *v += mean_square * a * b);
    }
}

/// Weighted change of the curve on splitting a facet along either tangent.
fn splits(fit: &Fit, facet: &Facet) -> [Vec<f64>; 2] {
    let middle = fit.column(facet.normal);
    let (sin, cos) = (libm::sin(APART), libm::cos(APART));
    tangents(facet.normal).map(|e| {
        let halves = [e, -e].map(|e| fit.column((facet.normal * cos + e * sin).normalize()));
        change(fit, &halves, &middle, facet.area, 0.5 / cos)
    })
}

/// Weighted change of the curve where the smaller of two facets' area lies in their middle, taken from both; that area and the middle.
fn between(fit: &Fit, a: &Facet, b: &Facet) -> (Vec<f64>, f64, DVec3) {
    let sum = a.normal + b.normal;
    let middle = sum.normalize_or(a.normal);
    let area = a.area.min(b.area);
    let ends = [a, b].map(|f| fit.column(f.normal));
    (change(fit, &ends, &fit.column(middle), -area, 1.0 / sum.length()), area, middle)
}

/// Weighted flux of `area` at both ends, `share` at each, less that in the middle.
fn change(fit: &Fit, ends: &[Vec<f64>; 2], middle: &[f64], area: f64, share: f64) -> Vec<f64> {
    let all = ends[0].iter().zip(&ends[1]).zip(middle).zip(fit.weights.iter());
    all.map(|(((a, b), m), w)| area * w * (share * (a + b) - m)).collect()
}
