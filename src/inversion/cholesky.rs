//! Cholesky factor of a symmetric positive definite matrix that grows and shrinks by one row at a time.
//!
//! L L' = A, row by row. A new last row is one forward substitution; a row taken out leaves a factor with one extra
//! element a row, which plane rotations bring back to triangular form (Golub & Van Loan 2013, Matrix Computations, 4th ed.,
//! sect. 6.5.4). Both cost O(n^2).

use crate::base::simd::Path;
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{Mat, MatMut, Par};

/// A lower triangular factor.
#[derive(Debug, Clone, Default)]
pub struct Cholesky {
    /// Row i holds i + 1 numbers.
    rows: Vec<Vec<f64>>,
}

impl Cholesky {
    /// Of the matrix whose element (i, j <= i) `element` gives; none where it is not positive definite, a pivot being less than
    /// `least` times its diagonal element.
    pub fn of(size: usize, least: f64, mut element: impl FnMut(usize, usize) -> f64) -> Option<Self> {
        let mut factor = Self { rows: Vec::with_capacity(size) };
        for i in 0..size {
            let row = (0..i).map(|j| element(i, j)).collect();
            factor.push(row, element(i, i), least).then_some(())?;
        }
        Some(factor)
    }

    /// Order of the matrix.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether it has no rows.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Logarithm of the determinant of A.
    pub fn log_determinant(&self) -> f64 {
        2.0 * self.rows.iter().filter_map(|row| row.last()).map(|&l| libm::log(l)).sum::<f64>()
    }

    /// Append a row: its products with the rows that are there, and its diagonal. False, and nothing changed, where the new
    /// row depends on the others: a pivot not above `least` times the diagonal.
    pub fn push(&mut self, mut products: Vec<f64>, diagonal: f64, least: f64) -> bool {
        products.resize(self.len(), 0.0);
        self.forward(&mut products);
        let pivot = diagonal - products.iter().map(|l| l * l).sum::<f64>();
        // written so that a pivot that is no number fails too
        if !(pivot > least * diagonal && pivot.is_finite()) {
            return false;
        }
        products.push(pivot.sqrt());
        self.rows.push(products);
        true
    }

    /// Take out row and column number `k`; nothing happens beyond the last.
    pub fn remove(&mut self, k: usize) {
        if k >= self.len() {
            return;
        }
        self.rows.remove(k);
        for j in k..self.len() {
            let (a, b) = (self.rows[j][j], self.rows[j][j + 1]);
            let length = a.hypot(b);
            let (c, s) = (a / length, b / length);
            for row in &mut self.rows[j..] {
                let (a, b) = (row[j], row[j + 1]);
                (row[j], row[j + 1]) = (c * a + s * b, c * b - s * a);
            }
            self.rows[j].truncate(j + 1);
        }
    }

    /// v becomes L^-1 v.
    pub fn forward(&self, v: &mut [f64]) {
        Path::best().run(
            #[inline(always)]
            || {
                for (i, row) in self.rows.iter().enumerate() {
                    let Some((done, rest)) = v.split_at_mut_checked(i) else { return };
                    let Some(first) = rest.first_mut() else { return };
                    *first = (*first - dot(&row[..i], done)) / row[i];
                }
            },
        );
    }

    /// Every column v becomes L^-1 v.
    pub fn forward_all(&self, columns: MatMut<'_, f64>) {
        let factor = Mat::from_fn(self.len(), self.len(), |i, j| self.rows[i].get(j).copied().unwrap_or(0.0));
        solve_lower_triangular_in_place(factor.as_ref(), columns, Par::Seq);
    }

    /// v becomes L'^-1 v.
    pub fn backward(&self, v: &mut [f64]) {
        for (i, row) in self.rows.iter().enumerate().rev() {
            let Some((head, rest)) = v.split_at_mut_checked(i) else { continue };
            let Some(first) = rest.first_mut() else { continue };
            *first /= row[i];
            let x = *first;
            head.iter_mut().zip(row).for_each(|(v, l)| *v -= l * x);
        }
    }

    /// Solution of A x = v.
    pub fn solve(&self, mut v: Vec<f64>) -> Vec<f64> {
        self.forward(&mut v);
        self.backward(&mut v);
        v
    }

    /// The inverse of A, row by row.
    pub fn inverse(&self) -> Vec<Vec<f64>> {
        let mut root = Mat::<f64>::identity(self.len(), self.len());
        self.forward_all(root.as_mut());
        let product = root.transpose() * &root;
        (0..self.len()).map(|i| product.col_as_slice(i).to_vec()).collect()
    }
}

/// Scalar product of the common length, in eight sums side by side: one order on every machine.
#[inline(always)]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (a8, a_rest) = a.as_chunks::<8>();
    let (b8, b_rest) = b.as_chunks::<8>();
    for (a, b) in a8.iter().zip(b8) {
        for k in 0..8 {
            sums[k] += a[k] * b[k];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    ((sums[0] + sums[4]) + (sums[2] + sums[6])) + ((sums[1] + sums[5]) + (sums[3] + sums[7])) + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Hilbert's matrix plus a tenth on the diagonal.
    fn element(i: usize, j: usize) -> f64 {
        1.0 / (i + j + 1) as f64 + if i == j { 0.1 } else { 0.0 }
    }

    #[test]
    fn solution_inverse_and_downdate_fulfil_their_equations_to_round_off() {
        let mut factor = Cholesky::of(9, 0.0, element).unwrap();
        let mut kept: Vec<usize> = (0..9).collect();
        for k in [4, 0, 6, 99] {
            factor.remove(k);
            if k < kept.len() {
                kept.remove(k);
            }
            let x = factor.solve(vec![1.0; kept.len()]);
            let inverse = factor.inverse();
            for (i, &row) in kept.iter().enumerate() {
                let product: f64 = kept.iter().zip(&x).map(|(&col, x)| element(row, col) * x).sum();
                assert!((product - 1.0).abs() < 1e-13, "{product}");
                let unit: f64 = kept.iter().zip(&inverse[i]).map(|(&col, x)| element(row, col) * x).sum();
                assert!((unit - 1.0).abs() < 1e-13);
            }
        }
    }

    #[test]
    fn a_dependent_or_nan_row_is_refused_and_changes_nothing() {
        let mut factor = Cholesky::of(2, 0.0, |i, j| f64::from(u8::from(i == j))).unwrap();
        assert!(!factor.push(vec![1.0, 0.0], 1.0, 1e-14) && !factor.push(vec![f64::NAN, 0.0], 1.0, 1e-14));
        assert_eq!(factor.len(), 2);
        assert!(factor.push(vec![0.6, 0.0], 1.0, 1e-14));
    }
}
