//! Points of a plane in square cells: neighbours in constant time; and a raster of the places near any of them.

use glam::DVec2;

/// Points sorted by cells.
#[derive(Debug, Clone)]
pub(super) struct Grid {
    low: DVec2,
    per_cell: f64,
    columns: usize,
    rows: usize,
    /// First of a cell's points in `sorted`; one more than the cells.
    starts: Vec<usize>,
    /// Points with their places in the list given, by cells.
    sorted: Vec<(DVec2, usize)>,
}

/// Lowest and highest corner of the box about finite points; a point at the origin if there are none.
fn bounds(points: &[DVec2]) -> (DVec2, DVec2) {
    let low = points.iter().copied().reduce(DVec2::min).unwrap_or_default();
    (low, points.iter().copied().reduce(DVec2::max).unwrap_or_default())
}

impl Grid {
    /// Sorts finite points into cells that hold about two each.
    pub fn new(points: &[DVec2]) -> Self {
        let (low, high) = bounds(points);
        let extent = (high - low).max(DVec2::splat(1e-6));
        let cells = 1.0 + points.len() as f64 / 2.0;
        // a long and narrow box gets a single row of cells, no more than there are points
        let cell = (extent.x * extent.y / cells).sqrt().max(extent.max_element() / cells);
        let [columns, rows] = (extent / cell).to_array().map(|count| count as usize + 1);
        let mut grid = Self {
            low,
            per_cell: 1.0 / cell,
            columns,
            rows,
            starts: vec![0; columns * rows + 1],
            sorted: vec![(DVec2::ZERO, 0); points.len()],
        };
        for &point in points {
            let [x, y] = grid.cell(point);
            grid.starts[y * columns + x + 1] += 1;
        }
        for k in 1..grid.starts.len() {
            grid.starts[k] += grid.starts[k - 1];
        }
        let mut next = grid.starts.clone();
        for (k, &point) in points.iter().enumerate() {
            let [x, y] = grid.cell(point);
            let place = &mut next[y * columns + x];
            grid.sorted[*place] = (point, k);
            *place += 1;
        }
        grid
    }

    /// The cell of a place, or the nearest to it.
    fn cell(&self, at: DVec2) -> [usize; 2] {
        let at = (at - self.low) * self.per_cell;
        // the casts take negative numbers and NaN to 0
        [(at.x as usize).min(self.columns - 1), (at.y as usize).min(self.rows - 1)]
    }

    /// The points within `radius` of a place, each with its place in the list.
    pub fn within(&self, at: DVec2, radius: f64) -> impl Iterator<Item = (DVec2, usize)> + '_ {
        let ([x0, y0], [x1, y1]) = (self.cell(at - radius), self.cell(at + radius));
        (y0..=y1)
            .flat_map(move |y| {
                let row = y * self.columns;
                &self.sorted[self.starts[row + x0]..self.starts[row + x1 + 1]]
            })
            .copied()
            .filter(move |(point, _)| point.distance_squared(at) <= radius * radius)
    }

    /// The nearest point within `radius` of a place: its distance and its place in the list.
    pub fn nearest(&self, at: DVec2, radius: f64) -> Option<(f64, usize)> {
        self.within(at, radius)
            .map(|(point, k)| (point.distance(at), k))
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
    }
}

/// Pairs (place in `points`, place in `others`) of which each is the other's nearest, within `radius`.
pub(super) fn mutual_nearest(points: &[DVec2], others: &[DVec2], radius: f64) -> Vec<(usize, usize)> {
    let (of_points, of_others) = (Grid::new(points), Grid::new(others));
    let mutual = |(k, &point): (usize, &DVec2)| {
        let (_, other) = of_others.nearest(point, radius)?;
        (of_points.nearest(others[other], radius)?.1 == k).then_some((k, other))
    };
    points.iter().enumerate().filter_map(mutual).collect()
}

/// One bit per small cell: whether a point lies in it or in one of the eight around it.
#[derive(Debug, Clone)]
pub(super) struct Raster {
    low: DVec2,
    per_cell: f64,
    columns: usize,
    rows: usize,
    bits: Vec<u64>,
}

/// Most cells of a raster: 4 MB.
const MOST_CELLS: f64 = 3.2e7;

impl Raster {
    /// Marks finite points in cells of side `cell`, or wider ones where there would be too many.
    pub fn new(points: &[DVec2], cell: f64) -> Self {
        let (low, high) = bounds(points);
        let extent = high - low + 4.0 * cell;
        let cell = cell.max((extent.x * extent.y / MOST_CELLS).sqrt()).max(extent.max_element() / MOST_CELLS);
        let low = low - 1.5 * cell;
        let [columns, rows] = ((high - low) / cell).to_array().map(|count| count as usize + 3);
        let mut bits = vec![0; columns * rows / 64 + 1];
        for &point in points {
            let [x, y] = ((point - low) / cell).to_array().map(|c| c as usize);
            for bit in (y - 1..=y + 1).flat_map(|y| (x - 1..=x + 1).map(move |x| y * columns + x)) {
                bits[bit / 64] |= 1 << (bit % 64);
            }
        }
        Self { low, per_cell: 1.0 / cell, columns, rows, bits }
    }

    /// Whether a point may lie near a place: always within one cell, never beyond 2.9 cells.
    pub fn holds(&self, at: DVec2) -> bool {
        let at = (at - self.low) * self.per_cell;
        if !(at.x >= 0.0 && at.y >= 0.0) {
            return false;
        }
        let (x, y) = (at.x as usize, at.y as usize);
        x < self.columns && y < self.rows && {
            let bit = y * self.columns + x;
            self.bits[bit / 64] >> (bit % 64) & 1 == 1
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::photometry::astrometry::synthetic::Dice;

    /// Every neighbour that a search of all points finds, and no other.
    #[test]
    fn neighbours_are_those_of_a_full_search() {
        let mut dice = Dice(3);
        for count in [0, 1, 2, 50, 700] {
            let points: Vec<DVec2> =
                (0..count).map(|_| DVec2::new(dice.between(-9.0, 400.0), dice.between(0.0, 30.0))).collect();
            let (grid, raster) = (Grid::new(&points), Raster::new(&points, 2.0));
            for _ in 0..200 {
                let (at, radius) =
                    (DVec2::new(dice.between(-30.0, 430.0), dice.between(-20.0, 50.0)), dice.between(0.0, 40.0));
                let mut found: Vec<usize> = grid.within(at, radius).map(|(_, k)| k).collect();
                found.sort_unstable();
                let all: Vec<usize> = (0..count).filter(|&k| points[k].distance(at) <= radius).collect();
                assert_eq!(found, all);
                let nearest = points.iter().map(|p| p.distance(at)).fold(f64::INFINITY, f64::min);
                assert_eq!(grid.nearest(at, radius).map(|n| n.0), (nearest <= radius).then_some(nearest));
                assert!(if raster.holds(at) { nearest < 2.0 * 2.9 } else { nearest > 2.0 }, "{nearest}");
            }
        }
    }

    #[test]
    fn points_in_one_place_and_places_that_are_no_numbers_do_no_harm() {
        let points = [DVec2::splat(1e9); 40];
        assert_eq!(Grid::new(&points).within(DVec2::splat(1e9), 1.0).count(), 40);
        assert_eq!(Grid::new(&points).within(DVec2::NAN, 1.0).count(), 0);
        assert!(!Raster::new(&points, 1.0).holds(DVec2::NAN));
        let far = [DVec2::ZERO, DVec2::new(1e12, 0.0), DVec2::new(0.0, 1e12)];
        assert!(Raster::new(&far, 1.0).holds(far[1]) && Grid::new(&far).nearest(far[2], 1.0).is_some());
    }

    #[test]
    fn a_pair_is_each_others_nearest() {
        let points = [DVec2::ZERO, DVec2::new(1.0, 0.0), DVec2::new(9.0, 9.0)];
        let others = [DVec2::new(0.8, 0.0), DVec2::new(50.0, 0.0)];
        assert_eq!(mutual_nearest(&points, &others, 3.0), [(1, 0)]);
    }
}
