//! A sparse extended Gaussian image fitted to data: Levenberg-Marquardt over areas, normals, scales and unknowns together.
//!
//! Model of datum t of curve c: m_t = k_c sum_i a_i g_t(n_i). Unknowns are log a_i, two moves of n_i on the sphere, log k_c of
//! the free curves and what the caller leaves open (material, attitude). Closure, sum a_i n_i = 0 (Minkowski 1903, Math. Ann.
//! 57, 447), is three soft rows of standard deviation [`CLOSURE`] times the total area. Damping follows Nielsen 1999
//! (IMM-REP-1999-05, eq 2.21), scaled by the diagonal (Marquardt 1963, SIAM J. 11, 431).

use super::problem::Problem;
use crate::inversion::cholesky::{Cholesky, dot};
use crate::inversion::sphere::tangents;
use crate::object::convex::{Epochs, Facet};
use crate::object::matter::Material;
use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::{Accum, Mat, Par};
use glam::DVec3;
use std::sync::Arc;

/// Standard deviation of the closure rows, as a share of the total area.
const CLOSURE: f64 = 1e-3;
/// Greatest step of log area and of a normal \[rad\].
const STEP: (f64, f64) = (1.5, 0.2);
/// Ridge on the diagonal, as a share of it: split atoms make the normal matrix singular.
const RIDGE: f64 = 1e-13;

/// What the unknowns beside the facets determine.
#[derive(Debug, Clone)]
pub struct View {
    /// Directions in body axes.
    pub epochs: Epochs,
    /// Material of all facets. The glint of a mirror is not in the model.
    pub material: Material,
}

/// Unknowns beside facets and scales.
pub struct Unknowns<'a> {
    /// Least and greatest value of each.
    pub bounds: Vec<(f64, f64)>,
    /// What values stand for.
    pub view: &'a (dyn Fn(&[f64]) -> View + Sync),
}

/// A state of the fit.
#[derive(Clone)]
pub(super) struct Fit<'a> {
    pub problem: &'a Problem,
    pub unknowns: Option<&'a Unknowns<'a>>,
    pub view: Arc<View>,
    pub values: Vec<f64>,
    pub facets: Vec<Facet>,
    /// Scale of every curve.
    pub scales: Vec<f64>,
    /// 1/sigma, times the root of a robust weight.
    pub weights: Arc<Vec<f64>>,
    pub closed: bool,
}

/// The linearised problem: weighted residuals and derivatives, the closure rows last.
pub(super) struct System {
    pub residual: Vec<f64>,
    pub jacobian: Mat<f64>,
    /// J'J, its lower half.
    pub normal: Mat<f64>,
    /// J'r.
    pub gradient: Vec<f64>,
}

impl System {
    /// Factor of J'J, its diagonal raised by a share `damping`.
    pub fn factor(&self, damping: f64) -> Option<Cholesky> {
        let greatest = (0..self.normal.nrows()).map(|i| self.normal[(i, i)]).fold(0.0, f64::max);
        let floor = greatest * 1e-30 + f64::MIN_POSITIVE;
        Cholesky::of(self.normal.nrows(), 0.0, |i, j| {
            let value = self.normal[(i, j)];
            if i == j { value + damping * value.max(floor) + floor } else { value }
        })
    }

    /// What the parameters cost beside chi^2, ln det(1 + J'J) over the first `count` rows: the logarithm of how much of a prior of width 1
    /// for each the data leave, twice (MacKay 1992, Neural Comput. 4, 415, eq. 2.9). What the data do not tell costs nothing.
    pub fn occam(&self, count: usize) -> f64 {
        let light = self.jacobian.get(..count.min(self.jacobian.nrows()), ..);
        let product = light.transpose() * light;
        let element = |i: usize, j: usize| product[(i, j)] + if i == j { 1.0 } else { 0.0 };
        Cholesky::of(product.nrows(), 0.0, element).map_or(f64::INFINITY, |factor| factor.log_determinant())
    }

    /// Inverse of J'J: the covariance.
    pub fn covariance(&self) -> Option<Vec<Vec<f64>>> {
        self.factor(RIDGE).map(|factor| factor.inverse())
    }
}

impl<'a> Fit<'a> {
    /// Total area.
    pub fn total(&self) -> f64 {
        self.facets.iter().map(|f| f.area).sum()
    }

    /// Model flux of one square metre along n: the curve's scale is in it.
    pub fn column(&self, normal: DVec3) -> Vec<f64> {
        let mut column = self.view.epochs.column(normal, &self.view.material, 0.0);
        column.iter_mut().zip(&self.problem.curve).for_each(|(g, &c)| *g *= self.scales[c]);
        column
    }

    fn model(&self, view: &View) -> Vec<f64> {
        let mut model = view.epochs.curve(&self.facets, &view.material, 0.0);
        model.iter_mut().zip(&self.problem.curve).for_each(|(m, &c)| *m *= self.scales[c]);
        model
    }

    /// Sum of a n.
    pub fn moment(&self) -> DVec3 {
        self.facets.iter().map(|f| f.normal * f.area).sum()
    }

    /// 1 over the standard deviation of the closure rows; 0 where closure is no condition.
    pub fn closure_weight(&self) -> f64 {
        let total = self.total();
        if self.closed && total > 0.0 { 1.0 / (CLOSURE * total) } else { 0.0 }
    }

    /// Weighted residuals, the closure rows last, their weight given: it is held during a step.
    pub fn residual(&self, closure: f64) -> Vec<f64> {
        let model = self.model(&self.view);
        let data = self.problem.y.iter().zip(model).zip(self.weights.iter());
        let mut residual: Vec<f64> = data.map(|((y, m), w)| w * (y - m)).collect();
        residual.extend((self.moment() * -closure).to_array());
        residual
    }

    /// Sum of squares of the data's residuals.
    pub fn chi2(&self) -> f64 {
        let residual = self.residual(0.0);
        dot(&residual, &residual)
    }

    /// With the closure rows.
    pub fn cost(&self) -> f64 {
        let residual = self.residual(self.closure_weight());
        dot(&residual, &residual)
    }

    /// Weight and scale of every datum.
    pub fn factors(&self) -> Vec<f64> {
        self.weights.iter().zip(&self.problem.curve).map(|(w, &c)| w * self.scales[c]).collect()
    }

    fn free_curves(&self) -> impl Iterator<Item = usize> {
        self.problem.scales.iter().enumerate().filter(|(_, scale)| scale.is_none()).map(|(c, _)| c)
    }

    /// Number of parameters.
    pub fn parameters(&self) -> usize {
        3 * self.facets.len() + self.free_curves().count() + self.values.len()
    }

    pub fn system(&self) -> System {
        let closure = self.closure_weight();
        let residual = self.residual(closure);
        let (rows, count) = (residual.len(), self.problem.len());
        let mut jacobian = Mat::<f64>::zeros(rows, self.parameters());
        let factors: Vec<f64> = self.factors();
        for (i, facet) in self.facets.iter().enumerate() {
            let moves = tangents(facet.normal);
            let columns = self.view.epochs.column_slopes(facet.normal, moves, &self.view.material);
            for (k, (column, direction)) in columns.iter().zip([facet.normal, moves[0], moves[1]]).enumerate() {
                let (data, rows) = jacobian.col_as_slice_mut(3 * i + k).split_at_mut(count);
                let all = data.iter_mut().zip(column).zip(&factors);
                all.for_each(|((out, value), factor)| *out = facet.area * factor * value);
                let closing = (direction * (closure * facet.area)).to_array();
                rows.iter_mut().zip(closing).for_each(|(out, value)| *out = value);
            }
        }
        let mut put = |column: usize, t: usize, value: f64| jacobian[(t, column)] = value;
        let model = self.model(&self.view);
        let first = 3 * self.facets.len();
        for (k, curve) in self.free_curves().enumerate() {
            for t in (0..count).filter(|&t| self.problem.curve[t] == curve) {
                put(first + k, t, self.weights[t] * model[t]);
            }
        }
        let first = self.parameters() - self.values.len();
        for k in 0..self.values.len() {
            let Some(unknowns) = self.unknowns else { break };
            let (low, high) = unknowns.bounds[k];
            let h = 1e-5 * (high - low);
            let at = |step: f64| {
                let mut values = self.values.clone();
                values[k] = (values[k] + step).clamp(low, high);
                (values[k], self.model(&(unknowns.view)(&values)))
            };
            let ((x0, below), (x1, above)) = (at(-h), at(h));
            for t in 0..count {
                put(first + k, t, self.weights[t] * (above[t] - below[t]) / (x1 - x0));
            }
        }
        let normal = gram(&jacobian);
        let gradient = (0..jacobian.ncols()).map(|j| dot(jacobian.col_as_slice(j), &residual)).collect();
        System { residual, jacobian, normal, gradient }
    }

    /// The state after a step, clipped.
    fn moved(&self, step: &[f64]) -> Self {
        let mut next = self.clone();
        for (facet, d) in next.facets.iter_mut().zip(step.as_chunks::<3>().0) {
            let [e1, e2] = tangents(facet.normal);
            let turn = e1 * d[1] + e2 * d[2];
            facet.normal = (facet.normal + turn.clamp_length_max(STEP.1)).normalize();
            facet.area *= libm::exp(d[0].clamp(-STEP.0, STEP.0));
        }
        let mut rest = step.iter().skip(3 * self.facets.len());
        for (curve, d) in self.free_curves().zip(&mut rest) {
            next.scales[curve] *= libm::exp(d.clamp(-STEP.0, STEP.0));
        }
        if let Some(unknowns) = self.unknowns {
            for ((value, &(low, high)), d) in next.values.iter_mut().zip(&unknowns.bounds).zip(rest) {
                let most = 0.2 * (high - low);
                *value = (*value + d.clamp(-most, most)).clamp(low, high);
            }
            next.view = Arc::new((unknowns.view)(&next.values));
        }
        next
    }

    /// Levenberg-Marquardt until a step promises less than `least` of chi^2, or for `rounds` rounds; whether it got there.
    pub fn descend(&mut self, least: f64, rounds: usize) -> bool {
        let (mut damping, mut growth) = (1e-4, 2.0);
        let mut system = self.system();
        for _ in 0..rounds {
            if self.facets.is_empty() {
                return true;
            }
            let cost = dot(&system.residual, &system.residual);
            let Some(factor) = system.factor(RIDGE + damping) else { return false };
            let step = factor.solve(system.gradient.clone());
            let damped = |(i, d): (usize, &f64)| d * (system.gradient[i] + damping * system.normal[(i, i)] * d);
            let promised: f64 = step.iter().enumerate().map(damped).sum();
            if promised.is_nan() || promised <= least.max(1e-15 * cost) {
                return true;
            }
            let next = self.moved(&step);
            let residual = next.residual(self.closure_weight());
            let gain = (cost - dot(&residual, &residual)) / promised;
            if gain > 0.0 {
                *self = next;
                system = self.system();
                damping = (damping * (1.0 - (2.0 * gain - 1.0).powi(3)).max(0.1)).max(1e-14);
                growth = 2.0;
            } else {
                damping *= growth;
                growth *= 2.0;
                if damping > 1e12 {
                    return false;
                }
            }
        }
        false
    }
}

/// Lower half of J'J.
fn gram(jacobian: &Mat<f64>) -> Mat<f64> {
    let mut out = Mat::zeros(jacobian.ncols(), jacobian.ncols());
    let (whole, half) = (BlockStructure::Rectangular, BlockStructure::TriangularLower);
    matmul(&mut out, half, Accum::Replace, jacobian.transpose(), whole, jacobian, whole, 1.0, Par::Seq);
    out
}
