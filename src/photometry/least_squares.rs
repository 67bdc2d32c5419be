//! Weighted least squares in a few unknowns.

/// A least-squares problem in few unknowns.
#[derive(Debug, Clone)]
pub struct Normal {
    n: usize,
    /// Matrix, row by row.
    matrix: Vec<f64>,
    right: Vec<f64>,
}

impl Normal {
    /// Of `n` unknowns, without data.
    pub fn new(n: usize) -> Self {
        Self { n, matrix: vec![0.0; n * n], right: vec![0.0; n] }
    }

    /// Of data in columns: one column of derivatives for each unknown, values, and weights 1 / variance.
    pub fn of_columns(columns: &[&[f64]], values: &[f64], weights: &[f64]) -> Self {
        let n = columns.len();
        let mut normal = Self::new(n);
        for (row, column) in columns.iter().enumerate() {
            let weighted = column.iter().zip(weights).map(|(a, w)| a * w).collect::<Vec<_>>();
            normal.right[row] = dot(&weighted, values);
            for (other, b) in columns.iter().enumerate().take(row + 1) {
                let sum = dot(&weighted, b);
                normal.matrix[row * n + other] = sum;
                normal.matrix[other * n + row] = sum;
            }
        }
        normal
    }

    /// Adds `value` with `derivatives` by the unknowns and weight 1 / variance.
    pub fn add(&mut self, derivatives: &[f64], value: f64, weight: f64) {
        for (row, a) in derivatives.iter().enumerate().take(self.n) {
            let wa = weight * a;
            if wa != 0.0 {
                self.right[row] += wa * value;
                let line = &mut self.matrix[row * self.n..(row + 1) * self.n];
                line.iter_mut().zip(derivatives).for_each(|(m, b)| *m += wa * b);
            }
        }
    }

    /// Solution and covariance by Cholesky's method, rows scaled to unit diagonals; none if the unknowns cannot be told apart.
    pub fn solve(&self) -> Option<(Vec<f64>, Vec<f64>)> {
        let n = self.n;
        let scale = (0..n).map(|i| self.matrix[i * n + i].sqrt()).collect::<Vec<_>>();
        if scale.iter().any(|s| !s.is_finite() || *s <= 0.0) {
            return None;
        }
        let mut lower = vec![0.0; n * n];
        for i in 0..n {
            for j in 0..=i {
                let dot: f64 = (0..j).map(|k| lower[i * n + k] * lower[j * n + k]).sum();
                let rest = self.matrix[i * n + j] / (scale[i] * scale[j]) - dot;
                if i == j {
                    if rest.is_nan() || rest < 1e-10 {
                        return None;
                    }
                    lower[i * n + i] = rest.sqrt();
                } else {
                    lower[i * n + j] = rest / lower[j * n + j];
                }
            }
        }
        // columns of the inverse, by forward and backward substitution
        let mut covariance = vec![0.0; n * n];
        for column in 0..n {
            let mut x = vec![0.0; n];
            for i in column..n {
                let dot: f64 = (column..i).map(|k| lower[i * n + k] * x[k]).sum();
                x[i] = (f64::from(u8::from(i == column)) - dot) / lower[i * n + i];
            }
            for i in (0..n).rev() {
                let dot: f64 = (i + 1..n).map(|k| lower[k * n + i] * x[k]).sum();
                x[i] = (x[i] - dot) / lower[i * n + i];
            }
            for (row, x) in x.into_iter().enumerate() {
                covariance[row * n + column] = x / (scale[row] * scale[column]);
            }
        }
        let solution = (0..n).map(|i| (0..n).map(|j| covariance[i * n + j] * self.right[j]).sum()).collect();
        Some((solution, covariance))
    }
}

/// The scalar product, in four sums that do not wait for each other.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (mut sums, n) = ([0.0; 4], a.len().min(b.len()));
    let (a, b) = (&a[..n], &b[..n]);
    for (a, b) in a.chunks_exact(4).zip(b.chunks_exact(4)) {
        for k in 0..4 {
            sums[k] += a[k] * b[k];
        }
    }
    let rest = a.iter().zip(b).skip(n & !3).map(|(a, b)| a * b).sum::<f64>();
    (sums[0] + sums[2]) + (sums[1] + sums[3]) + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_give_the_equations_of_rows() {
        let x = (0..11).map(|i| f64::from(i) * 0.7 - 2.0).collect::<Vec<_>>();
        let square = x.iter().map(|x| x * x).collect::<Vec<_>>();
        let one = vec![1.0; 11];
        let values = x.iter().map(|x| 3.0 - x + 0.2 * x.sin()).collect::<Vec<_>>();
        let weights = (1..12).map(f64::from).collect::<Vec<_>>();
        let columns = Normal::of_columns(&[&one, &x, &square], &values, &weights).solve().expect("three unknowns");
        let mut rows = Normal::new(3);
        (0..11).for_each(|i| rows.add(&[1.0, x[i], square[i]], values[i], weights[i]));
        let rows = rows.solve().expect("three unknowns");
        let off = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off(&columns.0, &rows.0) < 1e-12 && off(&columns.1, &rows.1) < 1e-12);
    }

    #[test]
    fn a_line_is_fitted_with_its_covariance() {
        let mut normal = Normal::new(2);
        for x in 0..5 {
            let x = f64::from(x);
            normal.add(&[1.0, x], 3.0 - 2.0 * x, 4.0);
        }
        let (solution, covariance) = normal.solve().expect("two unknowns, five data");
        assert!((solution[0] - 3.0).abs() < 1e-12 && (solution[1] + 2.0).abs() < 1e-12);
        // sigma^2 / sum (x - mean)^2 = 1/4 / 10
        assert!((covariance[3] - 0.025).abs() < 1e-14 && (covariance[1] - covariance[2]).abs() < 1e-15);
    }

    #[test]
    fn what_cannot_be_told_apart_is_not_solved() {
        let mut normal = Normal::new(2);
        for x in 1..5 {
            normal.add(&[f64::from(x), 2.0 * f64::from(x)], 1.0, 1.0);
        }
        assert!(normal.solve().is_none());
        assert!(Normal::new(1).solve().is_none());
        let mut odd = Normal::new(1);
        odd.add(&[f64::NAN], 1.0, 1.0);
        assert!(odd.solve().is_none());
    }
}
