//! To which magnitude a list of stars is complete, estimated from its own counts.
//!
//! Stars grow more numerous towards the faint until a list begins to miss them. A cell is taken to be complete to the
//! bright edge of the fullest half magnitude among the stars of the cell and its neighbours; where these are fewer than
//! 100, among all stars. That errs to the bright side, by up to half a magnitude where the list ends sharply.
//!
//! A cell without stars is empty or was not looked at. With f stars in a cell on average of the places where stars are,
//! so many rings of neighbours are looked at that 7 stars are expected; a cell all of whose neighbours are empty too was
//! not looked at, and is complete to nothing. Of a list with 7 stars a cell or more every empty cell is such a cell.

use super::cells::{BANDS, Bounds, cell_of, cells_before, cells_near};
use super::encode::StarRecord;
use crate::astro::direction;

/// Completeness of cells that were not looked at: brighter than any star \[mag\].
pub const NOWHERE: f64 = -2.0;

/// Histogram of magnitudes: first bright edge, width, number of bins.
const FIRST: f64 = -4.0;
const BIN: f64 = 0.5;
const BINS: usize = 80;

/// Fewest stars for an estimate of its own.
const ENOUGH: u32 = 100;
/// Stars expected among the neighbours of an empty cell, and most rings of them.
const EXPECTED: f64 = 7.0;
const RINGS: f64 = 5.0;
/// A ring of neighbours \[rad\].
const RING: f64 = std::f64::consts::PI / 180.0;

type Histogram = [u32; BINS];

/// Completeness of every cell; `given`: of the cells that were looked at, if the user says it.
pub fn completeness(stars: &[StarRecord], given: Option<f64>) -> Vec<f64> {
    let cells = cells_before(BANDS);
    let mut counts = vec![[0; BINS]; cells];
    for star in stars {
        let bin = ((star.mag_v - FIRST) / BIN).floor().clamp(0.0, BINS as f64 - 1.0) as usize;
        counts[cell_of(star.ra, star.dec)][bin] += 1;
    }
    let occupied = counts.iter().map(|c| c.iter().any(|n| *n > 0)).collect::<Vec<_>>();
    let around = |cell: usize, rings: f64| {
        let bounds = Bounds::of(cell);
        let [ra, dec] = bounds.place(0.5, 0.5);
        cells_near(direction(ra, dec), rings * RING)
    };
    let all = counts.iter().fold([0; BINS], |sum, c| added(&sum, c));
    let of_all = turnover(&all);
    let rings = rings(&counts, &occupied, &around);
    let of_cell = |cell: usize| {
        if !occupied[cell] && (rings == 0.0 || !around(cell, rings).any(|c| occupied[c])) {
            return NOWHERE;
        }
        given.unwrap_or_else(|| {
            let near = around(cell, 1.0).fold([0; BINS], |sum, c| added(&sum, &counts[c]));
            if near.iter().sum::<u32>() < ENOUGH { of_all } else { turnover(&near) }
        })
    };
    (0..cells).map(of_cell).collect()
}

fn added(a: &Histogram, b: &Histogram) -> Histogram {
    std::array::from_fn(|i| a[i] + b[i])
}

/// Bright edge of the fullest bin, the brightest of several; nothing for no stars.
fn turnover(counts: &Histogram) -> f64 {
    let fullest = counts.iter().max().copied().unwrap_or_default();
    let bin = counts.iter().position(|n| *n == fullest && fullest > 0);
    bin.map_or(NOWHERE, |bin| FIRST + BIN * bin as f64)
}

/// Rings of neighbours among which an empty cell's are looked for; 0: none are.
fn rings<I: Iterator<Item = usize>>(
    counts: &[Histogram],
    occupied: &[bool],
    around: &impl Fn(usize, f64) -> I,
) -> f64 {
    // the other stars about each star, per cell: a star's own presence must not count, or few would seem many
    let (mut stars, mut others, mut cells) = (0.0, 0.0, 0.0);
    let total = |cell: usize| f64::from(counts[cell].iter().sum::<u32>());
    for cell in (0..counts.len()).filter(|cell| occupied[*cell]) {
        let own = total(cell);
        let near = around(cell, 1.0).map(total).collect::<Vec<_>>();
        stars += own;
        others += own * (near.iter().sum::<f64>() - 1.0);
        cells += own * near.len() as f64;
    }
    if stars == 0.0 || others >= EXPECTED * cells {
        return 0.0;
    }
    let density = (others / cells).max(1e-3);
    (0.5 * ((EXPECTED / density).sqrt() - 1.0)).ceil().clamp(1.0, RINGS)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn star(ra_deg: f64, dec_deg: f64, mag_v: f64) -> StarRecord {
        let [ra, dec] = [ra_deg, dec_deg].map(f64::to_radians);
        StarRecord { ra, dec, mag_v, colour_bv: None, motion_mas_yr: None }
    }

    fn at(complete: &[f64], ra_deg: f64, dec_deg: f64) -> f64 {
        complete[cell_of(ra_deg.to_radians(), dec_deg.to_radians())]
    }

    /// A field of 4 by 4 degrees, counts growing to V = 14.5 and dwindling beyond.
    #[test]
    fn counts_turn_over_where_stars_begin_to_be_missed() {
        let mut stars = Vec::new();
        for (k, number) in [10, 30, 90, 270, 600, 200].into_iter().enumerate() {
            for i in 0..number {
                let share = |factor: f64| 4.0 * (f64::from(i) * factor + 0.1 * k as f64).fract();
                stars.push(star(100.0 + share(0.618_034), 10.0 + share(0.754_878), 12.1 + 0.5 * k as f64));
            }
        }
        let complete = completeness(&stars, None);
        assert_eq!(at(&complete, 102.0, 12.0), 14.0);
        assert_eq!(at(&complete, 200.0, -12.0), NOWHERE);
        assert_eq!(at(&complete, 107.0, 12.0), NOWHERE);
        let given = completeness(&stars, Some(13.0));
        assert_eq!((at(&given, 102.0, 12.0), at(&given, 107.0, 12.0)), (13.0, NOWHERE));
    }

    /// 9,000 stars over the whole sky, one in five cells: nearly none of the sky counts as not looked at.
    #[test]
    fn a_sparse_list_of_the_whole_sky_covers_it() {
        let stars = (0..9000).map(|i| {
            let (u, v) = ((f64::from(i) * 0.618_034).fract(), (f64::from(i) * 0.754_878).fract());
            star(360.0 * u, (2.0 * v - 1.0).asin().to_degrees(), 6.2)
        });
        let complete = completeness(&stars.collect::<Vec<_>>(), None);
        let missed = complete.iter().filter(|c| **c == NOWHERE).count();
        assert!(missed * 100 < complete.len(), "{missed} of {}", complete.len());
        assert_eq!(at(&complete, 10.0, 10.0), 6.0);
    }
}
