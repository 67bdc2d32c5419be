//! Non-negative least squares: min ||G x - y||^2 over x >= 0.
//!
//! The active set of Lawson & Hanson 1974 (Solving Least Squares Problems, ch. 23) on normal equations, as Bro & de Jong
//! 1997 (J. Chemometrics 11, 393), with a factor that grows and shrinks, and with columns generated: one pass over the whole
//! matrix prices all columns by their gradient G'r, the best of the steepest thousand join the support one by one, each only while it
//! still improves the fit, and then comes the next pass. Every step lowers the objective, so no support comes twice.
//!
//! The solution on the support is refined once with the residual of G itself. At the end stands the certificate of
//! Karush, Kuhn and Tucker: the greatest positive gradient off the support and the greatest gradient on it, over max |G'y|.

use super::cholesky::{Cholesky, dot};
use crate::base::simd::Path;

/// A matrix by columns.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Columns {
    rows: usize,
    data: Vec<f64>,
}

/// Why there is no solution.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NnlsError {
    /// An element is no finite number.
    #[error("matrix element {value} in row {row}, column {column} is not finite")]
    Element {
        /// Row.
        row: usize,
        /// Column.
        column: usize,
        /// Its value.
        value: f64,
    },
    /// A datum is no finite number.
    #[error("datum {row} = {value} is not finite")]
    Datum {
        /// Its number.
        row: usize,
        /// Its value.
        value: f64,
    },
    /// Lengths differ.
    #[error("{data} data for a matrix of {rows} rows")]
    Length {
        /// Number of data.
        data: usize,
        /// Rows of the matrix.
        rows: usize,
    },
}

/// A solution with its proof.
#[derive(Debug, Clone, PartialEq)]
pub struct Nnls {
    /// The solution, >= 0.
    pub x: Vec<f64>,
    /// Columns with x > 0, in the order of their coming.
    pub support: Vec<usize>,
    /// y - G x.
    pub residual: Vec<f64>,
    /// 1/2 ||y - G x||^2.
    pub objective: f64,
    /// Greatest breach of the optimality conditions over max |G'y|; 0 where that is 0.
    pub kkt: f64,
    /// Passes over the whole matrix.
    pub passes: usize,
}

/// A gradient counts as zero below this share of the greatest of G'y, columns of unit length.
const TOLERANCE: f64 = 1e-14;
/// Least share of a column of unit length, squared, that the support does not span.
const INDEPENDENT: f64 = 1e-14;
/// Stretches of the matrix whose best column is tried in a pass: neighbours on a grid say the same.
const STRETCHES: usize = 48;
/// Best columns tried besides.
const BEST: usize = 16;
/// Steepest columns of a pass that are priced again by themselves before the next pass.
const POOL: usize = 1000;
/// Rounds within that pool.
const ROUNDS: usize = 8;
/// Most passes; 5 to 15 are usual.
const PASSES: usize = 1000;

impl Columns {
    /// From columns of `rows` numbers; shorter ones are filled with zeros, longer ones cut.
    pub fn new(rows: usize, columns: impl IntoIterator<Item = Vec<f64>>) -> Self {
        let mut data = Vec::new();
        for mut column in columns {
            column.resize(rows, 0.0);
            data.extend_from_slice(&column);
        }
        Self { rows, data }
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns.
    pub fn len(&self) -> usize {
        self.data.len().checked_div(self.rows).unwrap_or(0)
    }

    /// Whether there are no columns.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Column number `j`; empty beyond the last.
    pub fn column(&self, j: usize) -> &[f64] {
        self.data.get(j * self.rows..(j + 1) * self.rows).unwrap_or(&[])
    }

    /// All elements, column after column.
    pub fn data(&self) -> &[f64] {
        &self.data
    }

    /// G'v.
    pub fn products(&self, v: &[f64]) -> Vec<f64> {
        Path::best().run(
            #[inline(always)]
            || self.data.chunks_exact(self.rows.max(1)).map(|column| dot(column, v)).collect(),
        )
    }

    /// Length of every column.
    pub fn norms(&self) -> Vec<f64> {
        self.data.chunks_exact(self.rows.max(1)).map(|column| dot(column, column).sqrt()).collect()
    }
}

/// Solve from the support `warm`: any columns, none for a cold start.
///
/// # Errors
/// Numbers that are not finite, and data that do not fit the matrix.
pub fn solve(matrix: &Columns, y: &[f64], warm: &[usize]) -> Result<Nnls, NnlsError> {
    if y.len() != matrix.rows {
        return Err(NnlsError::Length { data: y.len(), rows: matrix.rows });
    }
    if let Some((row, &value)) = y.iter().enumerate().find(|(_, value)| !value.is_finite()) {
        return Err(NnlsError::Datum { row, value });
    }
    if let Some((k, &value)) = matrix.data.iter().enumerate().find(|(_, value)| !value.is_finite()) {
        return Err(NnlsError::Element { row: k % matrix.rows, column: k / matrix.rows, value });
    }
    let mut state = State::new(matrix, y);
    state.warm(warm);
    let start = state.unit_gradient(y);
    let threshold = TOLERANCE * start.iter().fold(0.0, |a: f64, g| a.max(g.abs()));
    let mut passes = 0;
    while passes < PASSES {
        passes += 1;
        let gradient = state.unit_gradient(&state.residual);
        let mut pool: Vec<(f64, usize)> = gradient.iter().enumerate().map(|(j, &g)| (g, j)).collect();
        pool.retain(|&(g, j)| g > threshold && !state.support.contains(&j));
        pool.sort_by(|a, b| b.0.total_cmp(&a.0));
        pool.truncate(POOL);
        let mut grown = false;
        for _ in 0..ROUNDS {
            if !state.grow(promising(&pool, matrix.len()), threshold) {
                break;
            }
            grown = true;
            state.refine();
            state.price(&mut pool, threshold);
        }
        if !grown {
            break;
        }
    }
    Ok(state.finish(passes))
}

/// Columns of a pool, the steepest first, that are worth trying: the best of every stretch of the matrix and the best of all.
fn promising(pool: &[(f64, usize)], columns: usize) -> Vec<usize> {
    let width = columns.div_ceil(STRETCHES).max(1);
    let mut taken = [false; STRETCHES];
    let mut out = Vec::new();
    for (rank, &(_, j)) in pool.iter().enumerate() {
        let first = taken.get_mut(j / width).is_some_and(|taken| !std::mem::replace(taken, true));
        if first || rank < BEST {
            out.push(j);
        }
    }
    out
}

struct State<'a> {
    matrix: &'a Columns,
    y: &'a [f64],
    /// 1/length of every column; 0 of zero columns, which therefore never enter.
    scale: Vec<f64>,
    support: Vec<usize>,
    /// Solution on the support, columns of unit length.
    x: Vec<f64>,
    factor: Cholesky,
    residual: Vec<f64>,
}

impl<'a> State<'a> {
    fn new(matrix: &'a Columns, y: &'a [f64]) -> Self {
        let norms = matrix.norms();
        // squares of columns shorter than 1e-150 underflow: they are zero columns
        let scale = norms.iter().map(|&n| if n > 1e-150 && n.is_finite() { n.recip() } else { 0.0 }).collect();
        let (support, x, factor) = Default::default();
        Self { matrix, y, scale, support, x, factor, residual: y.to_vec() }
    }

    fn unit_gradient(&self, v: &[f64]) -> Vec<f64> {
        self.matrix.products(v).iter().zip(&self.scale).map(|(g, s)| g * s).collect()
    }

    fn push(&mut self, j: usize) -> bool {
        let Some(&scale) = self.scale.get(j) else { return false };
        let column = self.matrix.column(j);
        let product = |&i: &usize| dot(self.matrix.column(i), column) * self.scale[i] * scale;
        let products = self.support.iter().map(product).collect();
        let fits = scale > 0.0 && self.factor.push(products, 1.0, INDEPENDENT);
        if fits {
            self.support.push(j);
            self.x.push(0.0);
        }
        fits
    }

    fn remove(&mut self, k: usize) {
        self.factor.remove(k);
        self.support.remove(k);
        self.x.remove(k);
    }

    /// Least squares on the support, signs free.
    fn unconstrained(&self, v: &[f64]) -> Vec<f64> {
        let right = self.support.iter().map(|&j| dot(self.matrix.column(j), v) * self.scale[j]).collect();
        self.factor.solve(right)
    }

    fn warm(&mut self, support: &[usize]) {
        for &j in support {
            if !self.support.contains(&j) {
                self.push(j);
            }
        }
        let z = self.unconstrained(self.y);
        self.descend(z);
        self.update_residual();
    }

    /// From x towards the unconstrained solution, columns leaving where they reach zero. Each round loses one at least.
    fn descend(&mut self, mut z: Vec<f64>) {
        while z.iter().any(|&z| z.is_nan() || z <= 0.0) {
            let step = |(x, z): (&f64, &f64)| if *z > 0.0 { 1.0 } else { x / (x - z).max(f64::MIN_POSITIVE) };
            let alpha = self.x.iter().zip(&z).map(step).fold(1.0, f64::min);
            let mut least = (f64::INFINITY, 0);
            for (k, (x, z)) in self.x.iter_mut().zip(&z).enumerate() {
                let blocking = if *z > 0.0 { f64::INFINITY } else { *x / (*x - z).max(f64::MIN_POSITIVE) };
                *x += alpha * (z - *x);
                least = if blocking < least.0 || k == 0 { (blocking, k) } else { least };
            }
            self.x.get_mut(least.1).into_iter().for_each(|x| *x = 0.0);
            for k in (0..self.x.len()).rev().filter(|&k| z[k].is_nan() || z[k] <= 0.0).collect::<Vec<_>>() {
                if self.x[k].is_nan() || self.x[k] <= 0.0 {
                    self.remove(k);
                }
            }
            z = self.unconstrained(self.y);
        }
        self.x = z;
    }

    fn update_residual(&mut self) {
        self.residual.copy_from_slice(self.y);
        for (&j, x) in self.support.iter().zip(&self.x) {
            let amount = x * self.scale[j];
            self.residual.iter_mut().zip(self.matrix.column(j)).for_each(|(r, g)| *r -= amount * g);
        }
    }

    /// Gradients of these columns for the residual as it is.
    fn some_gradients(&self, columns: &[usize]) -> Vec<f64> {
        let gradient = |&j: &usize| dot(self.matrix.column(j), &self.residual) * self.scale[j];
        Path::best().run(
            #[inline(always)]
            || columns.iter().map(gradient).collect(),
        )
    }

    /// Gradients of a pool for the residual as it is, the steepest first; those in the support and those that fall leave it.
    fn price(&self, pool: &mut Vec<(f64, usize)>, threshold: f64) {
        let gradients = self.some_gradients(&pool.iter().map(|p| p.1).collect::<Vec<_>>());
        pool.iter_mut().zip(gradients).for_each(|(p, g)| p.0 = g);
        pool.retain(|&(g, j)| g > threshold && !self.support.contains(&j));
        pool.sort_by(|a, b| b.0.total_cmp(&a.0));
    }

    /// Take in candidates, the steepest first, while they improve the fit; whether any did.
    fn grow(&mut self, mut candidates: Vec<usize>, threshold: f64) -> bool {
        let mut grown = false;
        while !candidates.is_empty() {
            let gradients = self.some_gradients(&candidates);
            let steepest = gradients.into_iter().enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
            let Some((k, _)) = steepest.filter(|(_, gradient)| *gradient > threshold) else { break };
            let j = candidates.swap_remove(k);
            if !self.push(j) {
                continue;
            }
            let z = self.unconstrained(self.y);
            // rounding made the gradient look positive
            if !z.last().is_some_and(|&z| z > 0.0) {
                self.remove(self.support.len() - 1);
                continue;
            }
            self.descend(z);
            self.update_residual();
            grown = true;
        }
        grown
    }

    /// One correction with the residual of the matrix itself: normal equations square its condition.
    fn refine(&mut self) {
        let step = self.unconstrained(&self.residual);
        let refined: Vec<f64> = self.x.iter().zip(step).map(|(x, d)| x + d).collect();
        if refined.iter().all(|&x| x > 0.0) {
            self.x = refined;
            self.update_residual();
        }
    }

    fn finish(self, passes: usize) -> Nnls {
        let mut x = vec![0.0; self.matrix.len()];
        for (&j, value) in self.support.iter().zip(&self.x) {
            x[j] = value * self.scale[j];
        }
        let gradient = self.matrix.products(&self.residual);
        let breach = gradient.iter().zip(&x).map(|(g, &x)| if x > 0.0 { g.abs() } else { g.max(0.0) });
        let worst = breach.fold(0.0, f64::max);
        let greatest = self.matrix.products(self.y).iter().fold(0.0, |a: f64, g| a.max(g.abs()));
        let kkt = if greatest > 0.0 { worst / greatest } else { 0.0 };
        let objective = 0.5 * dot(&self.residual, &self.residual);
        Nnls { x, support: self.support, residual: self.residual, objective, kkt, passes }
    }
}

#[cfg(test)]
#[path = "nnls_tests.rs"]
mod tests;
