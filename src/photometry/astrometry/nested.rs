//! Weighted linear least squares of growing models, both axes at once.
//!
//! Columns are made orthogonal to those before them one by one (modified Gram-Schmidt with a second pass: Bjorck 1996, Numerical
//! Methods for Least Squares Problems, sect. 2.4.5), so a model that grows by columns keeps all the work done, and residuals
//! and leverages of each model on the way are at hand.

use glam::DVec2;

/// Share of a column's length that must be independent of the columns before it.
const INDEPENDENT: f64 = 0.02;

/// A model in the making.
#[derive(Debug, Clone)]
pub(super) struct Nested {
    roots: Vec<f64>,
    columns: Vec<Vec<f64>>,
    /// Upper triangle, by columns: the columns given in terms of the orthonormal ones.
    triangle: Vec<Vec<f64>>,
    /// The targets in terms of the orthonormal columns.
    shares: Vec<DVec2>,
    residuals: Vec<DVec2>,
    leverages: Vec<f64>,
}

/// The sum of products, in four sums that a processor adds side by side.
fn product(a: &[f64], b: &[f64]) -> f64 {
    let (a4, b4) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest: f64 = a4.remainder().iter().zip(b4.remainder()).map(|(a, b)| a * b).sum();
    let mut sums = [0.0; 4];
    for (a, b) in a4.zip(b4) {
        for k in 0..4 {
            sums[k] += a[k] * b[k];
        }
    }
    sums.iter().sum::<f64>() + rest
}

impl Nested {
    /// A model without columns for targets with weights >= 0.
    pub fn new(targets: &[DVec2], weights: &[f64]) -> Self {
        let roots: Vec<f64> = weights.iter().map(|w| w.sqrt()).collect();
        Self {
            residuals: targets.iter().zip(&roots).map(|(&t, w)| t * w).collect(),
            leverages: vec![0.0; targets.len()],
            roots,
            columns: Vec::new(),
            triangle: Vec::new(),
            shares: Vec::new(),
        }
    }

    /// Adds a column; returns false, and leaves the model as it is, where the column hardly differs from a combination of others.
    pub fn push(&mut self, column: impl Iterator<Item = f64>) -> bool {
        let mut column: Vec<f64> = column.zip(&self.roots).map(|(c, w)| c * w).collect();
        let length = product(&column, &column).sqrt();
        let mut entries = vec![0.0; self.columns.len()];
        for _ in 0..2 {
            for (other, entry) in self.columns.iter().zip(&mut entries) {
                let share = product(other, &column);
                column.iter_mut().zip(other).for_each(|(c, o)| *c -= share * o);
                *entry += share;
            }
        }
        let left = product(&column, &column).sqrt();
        if !(left > INDEPENDENT * length && left.is_finite()) {
            return false;
        }
        column.iter_mut().for_each(|c| *c /= left);
        entries.push(left);
        let share: DVec2 = column.iter().zip(&self.residuals).map(|(&c, &r)| c * r).sum();
        for ((r, h), &c) in self.residuals.iter_mut().zip(&mut self.leverages).zip(&column) {
            *r -= share * c;
            *h += c * c;
        }
        self.shares.push(share);
        self.columns.push(column);
        self.triangle.push(entries);
        true
    }

    /// Coefficients of the columns, in the order in which they were added.
    pub fn coefficients(&self) -> Vec<DVec2> {
        let mut found = self.shares.clone();
        for k in (0..found.len()).rev() {
            let solved = found[k] / self.triangle[k][k];
            found[k] = solved;
            for (earlier, entry) in found[..k].iter_mut().zip(&self.triangle[k]) {
                *earlier -= solved * entry;
            }
        }
        found
    }

    /// Weighted sum of squared leave-one-out residuals, r / (1 - h) (Allen 1974, Technometrics 16, 125).
    pub fn left_out(&self) -> f64 {
        self.residuals
            .iter()
            .zip(&self.leverages)
            .map(|(r, h)| r.length_squared() / (1.0 - h).max(1e-3).powi(2))
            .sum()
    }

    /// Standard error of an axis of the model where its columns take the values `row`, for weights 1 / sigma^2.
    pub fn error_at(&self, row: &[f64]) -> f64 {
        let mut solved: Vec<f64> = Vec::with_capacity(row.len());
        for (entries, value) in self.triangle.iter().zip(row) {
            let known: f64 = entries.iter().zip(&solved).map(|(e, s)| e * s).sum();
            solved.push((value - known) / entries[solved.len()]);
        }
        product(&solved, &solved).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A straight line by the closed formulas of Press et al. (2007, Numerical Recipes, sect. 15.2), both axes at once.
    #[test]
    fn a_line_is_that_of_the_closed_formulas() {
        let x = [0.0, 1.0, 2.5, 4.0, 5.5];
        let y = [1.0, 2.9, 6.2, 9.1, 11.7];
        let w = [1.0, 4.0, 1.0, 0.25, 2.0];
        let mut model = Nested::new(&y.map(|y| DVec2::new(y, -2.0 * y)), &w);
        assert!(model.push([1.0; 5].into_iter()) && model.push(x.into_iter()));
        let sum = |f: &dyn Fn(usize) -> f64| (0..5).map(|k| w[k] * f(k)).sum::<f64>();
        let (s, sx, sy) = (sum(&|_| 1.0), sum(&|k| x[k]), sum(&|k| y[k]));
        let (sxx, sxy) = (sum(&|k| x[k] * x[k]), sum(&|k| x[k] * y[k]));
        let delta = s * sxx - sx * sx;
        let (a, b) = ((sxx * sy - sx * sxy) / delta, (s * sxy - sx * sy) / delta);
        let found = model.coefficients();
        assert!((found[0] - DVec2::new(a, -2.0 * a)).length() < 1e-12);
        assert!((found[1] - DVec2::new(b, -2.0 * b)).length() < 1e-12);
        let error = ((sxx - 2.0 * 3.0 * sx + 9.0 * s) / delta).sqrt();
        assert!((model.error_at(&[1.0, 3.0]) - error).abs() < 1e-12);
    }

    /// Leaving out each place in turn and predicting it gives the same sum.
    #[test]
    fn left_out_residuals_are_those_of_refitting() {
        let q: Vec<f64> = (0..7).map(|k| f64::from(k * k % 5)).collect();
        let t: Vec<DVec2> = (0..7).map(|k| DVec2::new(f64::from(k * 3 % 7), f64::from(k * k % 4))).collect();
        let fit = |skip: Option<usize>| {
            let w: Vec<f64> = (0..7).map(|k| if Some(k) == skip { 0.0 } else { 1.0 }).collect();
            let mut model = Nested::new(&t, &w);
            assert!(model.push([1.0; 7].into_iter()) && model.push(q.iter().copied()));
            model
        };
        let refitted: f64 = (0..7)
            .map(|k| {
                let c = fit(Some(k)).coefficients();
                (t[k] - c[0] - c[1] * q[k]).length_squared()
            })
            .sum();
        assert!((fit(None).left_out() / refitted - 1.0).abs() < 1e-10);
    }

    #[test]
    fn dependent_and_absurd_columns_are_refused() {
        let mut model = Nested::new(&[DVec2::X; 4], &[1.0; 4]);
        assert!(model.push([1.0; 4].into_iter()));
        assert!(!model.push([-2.0; 4].into_iter()) && !model.push([f64::NAN; 4].into_iter()));
        assert!(!model.push([0.0; 4].into_iter()));
        assert_eq!(model.coefficients(), [DVec2::X]);
    }
}
