//! Partial LDL' of a dense symmetric matrix: the inner loop of the sparse factorisation.

use crate::base::simd::Path;

/// Columns eliminated before the rest of the matrix is updated by all of them together.
const BLOCK: usize = 8;

/// A symmetric matrix, its lower triangle by columns.
#[derive(Debug, Clone, Default)]
pub struct Front {
    /// Rows.
    pub size: usize,
    /// Entry (row, column) is at `column * size + row`.
    pub values: Vec<f64>,
}

impl Front {
    /// Zeros.
    pub fn new(size: usize) -> Self {
        Self { size, values: vec![0.0; size * size] }
    }

    /// Adds to the entry of two rows, in any order.
    #[inline]
    pub fn add(&mut self, i: usize, j: usize, value: f64) {
        let (row, column) = if i > j { (i, j) } else { (j, i) };
        self.values[column * self.size + row] += value;
    }

    /// Eliminates the first `pivots` rows without exchanges: L (unit diagonal left out) and D stand in their columns afterwards, the
    /// Schur complement in the others. A pivot below `tiny` times its original size is replaced by that.
    pub fn eliminate(&mut self, pivots: usize, tiny: f64) {
        let (n, values) = (self.size, &mut self.values);
        let floors: Vec<f64> = (0..pivots).map(|p| tiny * values[p * n + p].abs()).collect();
        Path::best().run(|| {
            let mut first = 0;
            while first < pivots {
                let last = (first + BLOCK).min(pivots);
                factor_block(values, n, first..last, &floors);
                update_rest(values, n, first..last);
                first = last;
            }
        });
    }
}

/// Eliminates the columns of a block from each other.
#[inline(always)]
fn factor_block(values: &mut [f64], n: usize, block: std::ops::Range<usize>, floors: &[f64]) {
    for p in block.clone() {
        let (head, tail) = values.split_at_mut((p + 1) * n);
        let column = &mut head[p * n..];
        if column[p].abs() <= floors[p] {
            column[p] = if floors[p] > 0.0 { floors[p] } else { f64::MIN_POSITIVE };
        }
        let inverse = 1.0 / column[p];
        for q in p + 1..block.end {
            let factor = column[q] * inverse;
            let target = &mut tail[(q - p - 1) * n..(q - p) * n];
            target[q..].iter_mut().zip(&column[q..]).for_each(|(t, c)| *t -= factor * c);
        }
        column[p + 1..].iter_mut().for_each(|c| *c *= inverse);
    }
}

/// Subtracts the products of a block's columns from all later columns, two at a time.
#[inline(always)]
fn update_rest(values: &mut [f64], n: usize, block: std::ops::Range<usize>) {
    let (first, count) = (block.start, block.len());
    let (head, tail) = values.split_at_mut(block.end * n);
    let columns: [&[f64]; BLOCK] = std::array::from_fn(|k| {
        let p = first + k.min(count - 1);
        &head[p * n..(p + 1) * n]
    });
    for (j, target) in (block.end..n).zip(tail.chunks_exact_mut(n)) {
        let factors: [f64; BLOCK] =
            std::array::from_fn(|k| if k < count { columns[k][j] * columns[k][first + k] } else { 0.0 });
        let target = &mut target[j..];
        let rows: [&[f64]; BLOCK] = columns.map(|column| &column[j..j + target.len()]);
        for r in 0..target.len() {
            let low = (factors[0] * rows[0][r] + factors[1] * rows[1][r])
                + (factors[2] * rows[2][r] + factors[3] * rows[3][r]);
            let high = (factors[4] * rows[4][r] + factors[5] * rows[5][r])
                + (factors[6] * rows[6][r] + factors[7] * rows[7][r]);
            target[r] -= low + high;
        }
    }
}
