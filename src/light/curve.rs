//! Curves over wavelength: tables read from CSV, linear between their points.

/// What can be wrong with a table.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CurveError {
    /// The file cannot be read.
    #[error("{name}: {reason}")]
    Unreadable {
        /// The file or built-in table.
        name: String,
        /// What the file system says.
        reason: String,
    },
    /// A line is no pair of finite numbers in ascending order.
    #[error("{name}, line {line}: {reason}")]
    Line {
        /// The file or built-in table.
        name: String,
        /// Line number, from 1.
        line: usize,
        /// What is wrong with it.
        reason: String,
    },
}

/// A quantity tabulated over wavelength \[nm\].
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    nm: Vec<f64>,
    value: Vec<f64>,
    /// Outside the table: its end values (extinction) instead of zero (everything else).
    held: bool,
}

impl Curve {
    /// The curve with the same value at every wavelength.
    pub fn constant(value: f64) -> Self {
        Self { nm: vec![0.0], value: vec![value], held: true }
    }

    /// The curve through `points`, ascending in wavelength; zero outside them.
    pub fn of(points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let (nm, value) = points.into_iter().unzip();
        Self { nm, value, held: false }
    }

    /// A curve from a table of two columns, wavelength \[nm\] and value, separated by a comma or blanks. Lines
    /// that begin with `#` and one head line are passed over.
    ///
    /// # Errors
    /// [`CurveError::Line`] names the line that is no pair of finite numbers or out of order.
    pub fn parse(text: &str, name: &str) -> Result<Self, CurveError> {
        let (mut nm, mut value) = (Vec::new(), Vec::new());
        for (index, line) in text.lines().enumerate() {
            let line = line.trim();
            if line.is_empty() || line.starts_with('#') {
                continue;
            }
            let fields = line.split([',', ' ', '\t', ';']).filter(|f| !f.is_empty()).collect::<Vec<_>>();
            let numbers = fields.iter().map(|f| f.parse::<f64>()).collect::<Result<Vec<_>, _>>();
            let fault = |reason: String| CurveError::Line { name: name.to_owned(), line: index + 1, reason };
            match numbers.as_deref() {
                Err(_) if nm.is_empty() => continue,
                Ok(&[x, y]) if x.is_finite() && y.is_finite() => {
                    if nm.last().is_some_and(|last| x <= *last) {
                        return Err(fault(format!("wavelength {x} nm is not above the one before")));
                    }
                    nm.push(x);
                    value.push(y);
                }
                _ => return Err(fault(format!("{line:?} is no pair of finite numbers"))),
            }
        }
        if nm.len() < 2 {
            return Err(CurveError::Line {
                name: name.to_owned(),
                line: 1,
                reason: "fewer than two points".into(),
            });
        }
        Ok(Self { nm, value, held: false })
    }

    /// The same curve, its end values held outside the table instead of zero.
    #[must_use]
    pub fn held(mut self) -> Self {
        self.held = true;
        self
    }

    /// The same curve times `factor`.
    #[must_use]
    pub fn scaled(mut self, factor: f64) -> Self {
        self.value.iter_mut().for_each(|v| *v *= factor);
        self
    }

    /// The curve whose value at each of its points is `f(nm, value)`.
    #[must_use]
    pub fn map(mut self, f: impl Fn(f64, f64) -> f64) -> Self {
        for (nm, value) in self.nm.iter().zip(&mut self.value) {
            *value = f(*nm, *value);
        }
        self
    }

    /// Value at `nm`, linear between the points.
    pub fn at(&self, nm: f64) -> f64 {
        if self.nm.is_empty() {
            return 0.0;
        }
        let (first, last) = (self.nm[0], self.nm[self.nm.len() - 1]);
        if nm < first || nm > last {
            return match (self.held, nm < first) {
                (false, _) => 0.0,
                (true, true) => self.value[0],
                (true, false) => self.value[self.value.len() - 1],
            };
        }
        let above = self.nm.partition_point(|x| *x < nm).max(1).min(self.nm.len() - 1);
        if self.nm.len() == 1 {
            return self.value[0];
        }
        let (x0, x1) = (self.nm[above - 1], self.nm[above]);
        let share = (nm - x0) / (x1 - x0);
        self.value[above - 1] * (1.0 - share) + self.value[above] * share
    }

    /// Wavelengths of the table \[nm\].
    pub fn wavelengths(&self) -> &[f64] {
        &self.nm
    }
}

/// Nodes and weights of Gauss-Legendre quadrature with four points on \[-1, 1\] (Abramowitz & Stegun 25.4.29).
const GAUSS_4: [(f64, f64); 4] = [
    (-0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
    (-0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
    (0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
    (0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
];

/// Nodes and weights that integrate products of these curves exactly (up to degree 7 within an interval): four
/// Gauss points in each interval of the union of their grids, inside the range where none of them is zero.
pub fn quadrature(curves: &[&Curve]) -> Vec<(f64, f64)> {
    let bounded = || curves.iter().filter(|c| !c.held);
    let low = bounded().map(|c| c.nm[0]).fold(f64::NEG_INFINITY, f64::max);
    let high = bounded().map(|c| c.nm[c.nm.len() - 1]).fold(f64::INFINITY, f64::min);
    let inside = |x: &f64| *x >= low && *x <= high;
    let mut grid = curves.iter().flat_map(|c| c.nm.iter().copied()).filter(inside).collect::<Vec<_>>();
    grid.extend([low, high].iter().filter(|x| x.is_finite() && low < high));
    grid.sort_by(f64::total_cmp);
    grid.dedup();
    grid.windows(2)
        .flat_map(|w| {
            let (middle, half) = (0.5 * (w[0] + w[1]), 0.5 * (w[1] - w[0]));
            GAUSS_4.map(|(x, weight)| (middle + half * x, half * weight))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(text: &str) -> Curve {
        Curve::parse(text, "test").expect("a good table")
    }

    #[test]
    fn values_between_at_and_outside_the_points() {
        let c = curve("# head\nnm,qe\n400,0.2\n500,0.4\n");
        assert_eq!([c.at(400.0), c.at(500.0), c.at(399.0), c.at(501.0)], [0.2, 0.4, 0.0, 0.0]);
        assert!((c.at(450.0) - 0.3).abs() < 1e-15);
        assert_eq!(c.held().at(1000.0), 0.4);
        assert_eq!(Curve::constant(0.7).at(555.0), 0.7);
    }

    /// Hand-worked: the product of x and (1 - x) over 0..1 is 1/6.
    #[test]
    fn products_of_linear_curves_are_integrated_exactly() {
        let (a, b) = (curve("0 0\n1 1\n"), curve("0 1\n0.5 0.5\n1 0\n"));
        let sum: f64 = quadrature(&[&a, &b]).iter().map(|(x, w)| w * a.at(*x) * b.at(*x)).sum();
        assert!((sum - 1.0 / 6.0).abs() < 1e-15);
    }

    #[test]
    fn faults_name_the_line() {
        for (text, line) in [("1 2\n1 3\n", 2), ("1 2\n3 x\n", 2), ("1 nan\n2 3\n", 1), ("", 1)] {
            match Curve::parse(text, "bad.csv") {
                Err(CurveError::Line { line: at, .. }) => assert_eq!(at, line, "{text:?}"),
                other => panic!("{text:?}: {other:?}"),
            }
        }
    }

    #[test]
    fn curves_that_do_not_overlap_have_no_nodes() {
        assert!(quadrature(&[&curve("1 1\n2 1\n"), &curve("3 1\n4 1\n")]).is_empty());
    }
}
