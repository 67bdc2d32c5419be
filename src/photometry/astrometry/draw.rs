//! Which detections and which stars are compared first: the brightest, but of no place more than its share.
//!
//! A crowd would otherwise take all places, and the brightest of a wide cone would lie outside the frame.

use super::grid::Grid;
use glam::DVec2;
use std::collections::{BTreeMap, BTreeSet};

/// Cells along a side of the frame in which shares are counted.
const CELLS: f64 = 4.0;

/// A choice of detections and stars, in the plane of the a-priori world coordinates \[px\].
#[derive(Debug, Clone)]
pub(super) struct Draw {
    /// Detections where the a-priori world coordinates have them, brightest first.
    pub detections: Vec<DVec2>,
    /// Stars, brightest first.
    pub stars: Vec<DVec2>,
    /// The same stars by place.
    pub by_place: Grid,
    /// Stars per square pixel of the field.
    pub density: f64,
}

/// The square of side `cell` that holds a place.
fn cell_of(at: DVec2, cell: f64) -> [i64; 2] {
    (at / cell).floor().as_i64vec2().to_array()
}

/// The first `most` of `places`, of each square of side `cell` at most `share`.
fn fair_share(places: &[DVec2], cell: f64, share: usize, most: usize) -> Vec<DVec2> {
    let mut taken = BTreeMap::new();
    places
        .iter()
        .filter(|&&at| {
            let taken = taken.entry(cell_of(at, cell)).or_insert(0);
            *taken += 1;
            *taken <= share
        })
        .take(most)
        .copied()
        .collect()
}

impl Draw {
    /// `count` detections and about `depth` stars per field, out of all, brightest first, of a frame of width `side` \[px\].
    pub fn new(detections: &[DVec2], stars: &[DVec2], side: f64, [count, depth]: [usize; 2]) -> Self {
        let cell = side / CELLS;
        let per_cell = |number: usize| number.div_ceil((CELLS * CELLS) as usize);
        let stars = fair_share(stars, cell, per_cell(depth), stars.len());
        Self {
            detections: fair_share(detections, cell, 3 * per_cell(count), count),
            by_place: Grid::new(&stars),
            density: density(&stars, cell),
            stars,
        }
    }
}

/// Stars per area that the cells holding any of them have on average \[px^-2\].
fn density(stars: &[DVec2], cell: f64) -> f64 {
    let cells: BTreeSet<_> = stars.iter().map(|&at| cell_of(at, cell)).collect();
    stars.len() as f64 / (cells.len().max(1) as f64 * cell * cell)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bright crowd of 500 in one corner leaves 9 places in 10 to the rest of the field.
    #[test]
    fn a_crowd_takes_no_more_than_its_share() {
        let crowd = (0..500).map(|k| DVec2::new(f64::from(k % 25), f64::from(k / 25)));
        let field = (0..400).map(|k| DVec2::new(f64::from(k % 20) * 50.0 + 7.0, f64::from(k / 20) * 50.0 + 7.0));
        let all: Vec<DVec2> = crowd.chain(field).collect();
        let draw = Draw::new(&all, &all, 1000.0, [48, 192]);
        assert_eq!((draw.detections.len(), draw.stars.len()), (48, 192));
        let crowded = |points: &[DVec2]| points.iter().filter(|p| p.max_element() < 25.0).count();
        assert_eq!((crowded(&draw.detections), crowded(&draw.stars)), (9, 12));
        assert!((draw.density - 192e-6).abs() < 1e-9);
    }
}
