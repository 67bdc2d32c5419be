//! Sparse LDL' of symmetric matrices on a planar graph, by fronts.
//!
//! Multifrontal method (Duff and Reid 1983, ACM TOMS 9, 302; Liu 1992, SIAM Rev. 34, 82): each part of the nested dissection is a dense matrix of
//! its own rows and of the later rows they touch; what is left after its own rows are eliminated is added to the part above. A few dense border
//! rows, coupled to all others, are eliminated first within the root. No rows are exchanged: the callers' matrices are
//! definite, or quasi-definite with the border (Vanderbei 1995, SIAM J. Optim. 5, 100).

use super::dense::Front;
use super::dissect::Part;

/// A pivot that falls below this fraction of its diagonal entry is held there.
const TINY: f64 = 1e-15;

/// A symmetric matrix on the graph of a polytope's facets, with border.
pub struct Matrix<'a> {
    /// Neighbours of row i are `neighbours[starts[i]..starts[i + 1]]`.
    pub starts: &'a [usize],
    /// Rows next to each other.
    pub neighbours: &'a [u32],
    /// Entry of each neighbour, symmetric.
    pub values: Vec<f64>,
    /// Diagonal entries.
    pub diagonal: Vec<f64>,
    /// Dense rows below the matrix, each with its own diagonal entry.
    pub border: Vec<(Vec<f64>, f64)>,
}

/// The factors.
#[derive(Debug)]
pub struct Ldl {
    panels: Vec<Panel>,
    rows: usize,
    border: usize,
    /// Pivots below zero.
    pub negative: usize,
}

/// Columns of L and D of one part.
#[derive(Debug)]
struct Panel {
    /// Rows of the front, its own first.
    rows: Vec<u32>,
    own: usize,
    values: Vec<f64>,
}

impl Matrix<'_> {
    fn entries(&self, row: u32) -> std::ops::Range<usize> {
        self.starts[row as usize]..self.starts[row as usize + 1]
    }
}

impl Ldl {
    /// Factors `matrix` in the order of `parts`.
    pub fn new(matrix: &Matrix, parts: &[Part]) -> Self {
        let rows = matrix.diagonal.len();
        let mut assembly = Assembly::new(matrix, parts);
        let mut factors =
            Self { panels: Vec::with_capacity(parts.len()), rows, border: matrix.border.len(), negative: 0 };
        for place in 0..parts.len() {
            let (rows, own, mut front) = assembly.front(place);
            front.eliminate(own, TINY);
            factors.negative += (0..own).filter(|&p| front.values[p * front.size + p] < 0.0).count();
            assembly.keep(place, &rows, own, &front);
            front.values.truncate(own * front.size);
            factors.panels.push(Panel { rows, own, values: front.values });
        }
        factors
    }

    /// Solves for a right-hand side with zeros in the border.
    pub fn solve(&self, right: &[f64]) -> Vec<f64> {
        let mut x = right.to_vec();
        x.resize(self.rows + self.border, 0.0);
        let mut local = Vec::new();
        for panel in &self.panels {
            panel.gather(&x, &mut local);
            panel.forward(&mut local);
            panel.scatter(&local, &mut x);
        }
        for panel in self.panels.iter().rev() {
            panel.gather(&x, &mut local);
            panel.backward(&mut local);
            panel.scatter(&local, &mut x);
        }
        x.truncate(self.rows);
        x
    }
}

impl Panel {
    fn gather(&self, x: &[f64], local: &mut Vec<f64>) {
        local.clear();
        local.extend(self.rows.iter().map(|&r| x[r as usize]));
    }

    fn scatter(&self, local: &[f64], x: &mut [f64]) {
        self.rows.iter().zip(local).for_each(|(&r, &value)| x[r as usize] = value);
    }

    fn column(&self, p: usize) -> &[f64] {
        &self.values[p * self.rows.len()..(p + 1) * self.rows.len()]
    }

    fn forward(&self, local: &mut [f64]) {
        for p in 0..self.own {
            let value = local[p];
            local[p + 1..].iter_mut().zip(&self.column(p)[p + 1..]).for_each(|(x, l)| *x -= l * value);
        }
    }

    fn backward(&self, local: &mut [f64]) {
        for p in (0..self.own).rev() {
            let column = self.column(p);
            let rest: f64 = column[p + 1..].iter().zip(&local[p + 1..]).map(|(l, x)| l * x).sum();
            local[p] = local[p] / column[p] - rest;
        }
    }
}

/// Fronts on their way up.
struct Assembly<'a> {
    matrix: &'a Matrix<'a>,
    parts: &'a [Part],
    /// Place of each row in the order of elimination.
    places: Vec<u32>,
    /// Row of the present front of each row.
    local: Vec<u32>,
    /// The part that last listed a row.
    listed: Vec<u32>,
    /// Rows and Schur complement that a part leaves.
    left: Vec<(Vec<u32>, Front)>,
}

impl<'a> Assembly<'a> {
    fn new(matrix: &'a Matrix, parts: &'a [Part]) -> Self {
        let (rows, border) = (matrix.diagonal.len() as u32, matrix.border.len() as u32);
        let mut places = vec![0; (rows + border) as usize];
        let root = parts.len().saturating_sub(1);
        let border_if = |k: usize| if k == root { rows..rows + border } else { 0..0 };
        let order = parts.iter().enumerate().flat_map(|(k, part)| border_if(k).chain(part.own.iter().copied()));
        for (place, row) in (0_u32..).zip(order) {
            places[row as usize] = place;
        }
        let listed = vec![u32::MAX; places.len()];
        let local = vec![0; places.len()];
        Self { matrix, parts, places, local, listed, left: vec![(Vec::new(), Front::default()); parts.len()] }
    }

    /// Rows, number of own rows, and the assembled front of a part.
    fn front(&mut self, place: usize) -> (Vec<u32>, usize, Front) {
        let (part, matrix) = (&self.parts[place], self.matrix);
        let (count, border) = (self.matrix.diagonal.len() as u32, self.matrix.border.len() as u32);
        let is_root = place + 1 == self.parts.len();
        let mut rows: Vec<u32> = if is_root { (count..count + border).collect() } else { Vec::new() };
        rows.extend(&part.own);
        let own = rows.len();
        let last = rows.last().map_or(0, |&row| self.places[row as usize]);
        rows.iter().for_each(|&row| self.listed[row as usize] = place as u32);
        let below = part.children.iter().flat_map(|&child| self.left[child].0.iter().copied());
        let beside = part.own.iter().flat_map(|&row| matrix.neighbours[matrix.entries(row)].iter().copied());
        let listed = &mut self.listed;
        for row in below.chain(beside).chain(count..count + border) {
            if self.places[row as usize] > last && listed[row as usize] != place as u32 {
                listed[row as usize] = place as u32;
                rows.push(row);
            }
        }
        rows[own..].sort_unstable_by_key(|&row| self.places[row as usize]);
        (0_u32..).zip(&rows).for_each(|(k, &row)| self.local[row as usize] = k);
        let mut front = Front::new(rows.len());
        self.add_entries(&mut front, &rows[..own]);
        for &child in &part.children {
            let (child_rows, schur) = std::mem::take(&mut self.left[child]);
            let to: Vec<usize> = child_rows.iter().map(|&row| self.local[row as usize] as usize).collect();
            for (j, column) in schur.values.chunks_exact(schur.size.max(1)).enumerate() {
                let target = &mut front.values[to[j] * front.size..(to[j] + 1) * front.size];
                // both lists are in order of elimination: the lower triangle stays below
                (j..schur.size).for_each(|i| target[to[i]] += column[i]);
            }
        }
        (rows, own, front)
    }

    /// Adds the matrix's entries between own rows and between them and later rows.
    fn add_entries(&self, front: &mut Front, own: &[u32]) {
        let count = self.matrix.diagonal.len();
        for &row in own {
            let (place, k) = (self.places[row as usize], self.local[row as usize] as usize);
            if row as usize >= count {
                front.add(k, k, self.matrix.border[row as usize - count].1);
                continue;
            }
            front.add(k, k, self.matrix.diagonal[row as usize]);
            for e in self.matrix.entries(row) {
                let other = self.matrix.neighbours[e];
                if self.places[other as usize] > place {
                    front.add(k, self.local[other as usize] as usize, self.matrix.values[e]);
                }
            }
            for (b, (entries, _)) in self.matrix.border.iter().enumerate() {
                front.add(k, self.local[count + b] as usize, entries[row as usize]);
            }
        }
    }

    /// Keeps what `front` leaves to the part above.
    fn keep(&mut self, place: usize, rows: &[u32], own: usize, front: &Front) {
        let size = rows.len() - own;
        let mut schur = Front { size, values: Vec::with_capacity(size * size) };
        for column in front.values.chunks_exact(front.size.max(1)).skip(own) {
            schur.values.extend_from_slice(&column[own..]);
        }
        self.left[place] = (rows[own..].to_vec(), schur);
    }
}
