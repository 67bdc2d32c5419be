//! Smooth interpolation in a table of two angles.
//!
//! Piecewise cubics with slopes from the neighbouring nodes (Catmull-Rom on uneven nodes, de Boor 1978, ch. IV): the nodes
//! are met exactly and value and first derivatives are continuous. The table is taken to be even about both ends of both
//! axes, as sky maps are about the ecliptic, the Sun's meridian and a pole. Blank cells are NaN, and so is everything
//! between a blank and its neighbours.

use super::nodes::bracket;

/// A table over two ascending axes of three or more nodes each, by rows of the first axis; NaN where blank.
#[derive(Debug, Clone)]
pub struct CubicGrid {
    rows: Vec<f64>,
    columns: Vec<f64>,
    values: Vec<f64>,
}

impl CubicGrid {
    /// The table of `values`, which has `rows` times `columns` entries.
    pub fn new(rows: Vec<f64>, columns: Vec<f64>, values: Vec<f64>) -> Self {
        Self { rows, columns, values }
    }

    /// The value at a place; held beyond the axes, NaN beside a blank cell.
    pub fn at(&self, row: f64, column: f64) -> f64 {
        let (i, share_row) = bracket(&self.rows, row);
        let (j, share_column) = bracket(&self.columns, column);
        let value = |r: usize, c: usize| self.values[r * self.columns.len() + c];
        // a corner with no weight may be blank
        let used = |share: f64, far: bool| if far { share > 0.0 } else { share < 1.0 };
        for (dr, dc) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            if used(share_row, dr == 1) && used(share_column, dc == 1) && value(i + dr, j + dc).is_nan() {
                return f64::NAN;
            }
        }
        let along_columns = |r: usize| cubic(&self.columns, j, share_column, |c| value(r, c));
        cubic(&self.rows, i, share_row, along_columns)
    }
}

/// Cubic Hermite in interval `i` of `nodes`, at the place `share` in it.
fn cubic(nodes: &[f64], i: usize, share: f64, value: impl Fn(usize) -> f64) -> f64 {
    let width = nodes[i + 1] - nodes[i];
    let [from, to] = [i, i + 1].map(|k| (value(k), slope(nodes, k, &value)));
    if share == 0.0 {
        return from.0;
    }
    if share == 1.0 {
        return to.0;
    }
    let (t, t2, t3) = (share, share * share, share * share * share);
    from.0 * (2.0 * t3 - 3.0 * t2 + 1.0)
        + to.0 * (3.0 * t2 - 2.0 * t3)
        + width * (from.1 * (t3 - 2.0 * t2 + t) + to.1 * (t3 - t2))
}

/// Slope at node `k`: that of the parabola through it and its neighbours; 0 at the ends, where the table is even; one-sided
/// beside a blank.
fn slope(nodes: &[f64], k: usize, value: &impl Fn(usize) -> f64) -> f64 {
    if k == 0 || k + 1 == nodes.len() {
        return 0.0;
    }
    let (before, after) = (nodes[k] - nodes[k - 1], nodes[k + 1] - nodes[k]);
    let left = (value(k) - value(k - 1)) / before;
    let right = (value(k + 1) - value(k)) / after;
    match (left.is_nan(), right.is_nan()) {
        (false, false) => (left * after + right * before) / (before + after),
        (true, false) => right,
        (false, true) => left,
        (true, true) => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid() -> CubicGrid {
        let nodes = vec![0.0, 1.0, 2.5, 4.0];
        let values = (0..16).map(|k| f64::from((k * 7) % 5)).collect();
        CubicGrid::new(nodes.clone(), nodes, values)
    }

    #[test]
    fn nodes_are_met_and_ends_are_held() {
        let g = grid();
        for (i, r) in g.rows.iter().enumerate() {
            for (j, c) in g.columns.iter().enumerate() {
                assert_eq!(g.at(*r, *c), g.values[i * 4 + j]);
            }
        }
        assert_eq!(g.at(-1.0, 9.0), g.values[3]);
    }

    #[test]
    fn value_and_slopes_are_continuous_across_nodes() {
        let g = grid();
        let h = 1e-6;
        for at in [1.0, 2.5] {
            for other in [0.3, 1.0, 3.3] {
                for f in [&(|x| g.at(x, other)) as &dyn Fn(f64) -> f64, &|x| g.at(other, x)] {
                    let (below, above) = ((f(at) - f(at - h)) / h, (f(at + h) - f(at)) / h);
                    assert!((below - above).abs() < 1e-4, "{at} {other}: {below} {above}");
                }
            }
        }
        // even about the ends
        assert!((g.at(1e-6, 1.7) - g.at(0.0, 1.7)).abs() < 1e-10);
    }

    #[test]
    fn blanks_spoil_their_neighbourhood_and_nothing_else() {
        let mut g = grid();
        g.values[5] = f64::NAN;
        assert!(g.at(0.5, 0.5).is_nan() && g.at(1.5, 1.5).is_nan() && g.at(1.0, 1.0).is_nan());
        assert!(g.at(3.0, 3.0).is_finite() && g.at(2.5, 2.5).is_finite() && g.at(0.0, 0.5).is_finite());
    }
}
