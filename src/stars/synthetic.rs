//! Faint stars that no catalogue lists: as many as the counts say, at random places.
//!
//! A cell of the sky and a bin of magnitude hold a Poisson number of stars, whose mean is the count of
//! [`super::counts`] in that bin beyond the catalogue's completeness, less the stars that the thinned-out catalogue has
//! there; where it has more, the surplus is taken off the next bin: filled, never doubled. Number, places and magnitudes are functions of (catalogue, cell, bin), so that the same
//! sky is there every night, from every station and for every limit: a deeper limit adds stars and moves none.

use super::catalogue::{Catalogue, CatalogueStar};
use super::cells::Bounds;
use super::counts::{Counts, DEG2_PER_SR, Galactic};
use crate::astro::direction;
use crate::base::poisson::poisson;
use crate::base::random::{Address, Stage};
use crate::base::sample::uniform;

/// Width of a bin of magnitude, and the first one's bright end.
const BIN: f64 = 0.25;
const FIRST: f64 = 4.0;

/// Faintest magnitude of synthetic stars: the counts are extrapolated from V = 21 on.
pub const FAINTEST: f64 = 24.0;

/// Numbers of synthetic stars begin here; a catalogue holds fewer stars.
pub const FIRST_ID: u64 = 1 << 48;

/// Bits for the stars of one bin of a cell.
const STAR_BITS: u32 = 24;

/// Key of all random numbers of a catalogue's sky: FNV-1a of its name.
fn seed(catalogue: &Catalogue) -> u64 {
    let mix = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    catalogue.name().bytes().fold(0xcbf2_9ce4_8422_2325, mix)
}

/// The synthetic stars of `cell` brighter than V = `limit`.
pub fn stars(catalogue: &Catalogue, cell: usize, limit: f64) -> Vec<CatalogueStar> {
    let bounds = Bounds::of(cell);
    let [ra, dec] = bounds.place(0.5, 0.5);
    let counts = Counts::at(Galactic::of(direction(ra, dec)));
    let area = bounds.solid_angle() * DEG2_PER_SR;
    let complete = catalogue.cell_complete_to(cell);
    let known = catalogue.cell_mags(cell).filter(|m| *m >= complete).collect::<Vec<_>>();
    let of = |stage| Address { seed: seed(catalogue), frame: 0, stage };
    let (number, place) = (of(Stage::SyntheticCount), of(Stage::SyntheticStars));

    let (mut found, mut surplus) = (Vec::new(), 0.0);
    let bins = ((limit.min(FAINTEST) - FIRST) / BIN).ceil().max(0.0) as u64;
    for bin in 0..bins {
        let [bright, faint] = [bin, bin + 1].map(|k| FIRST + BIN * k as f64);
        let from = bright.max(complete);
        if from >= faint {
            continue;
        }
        let listed = known.iter().filter(|m| (from..faint).contains(*m)).count() as f64;
        let mean = area * (counts.brighter_than(faint) - counts.brighter_than(from)) - listed - surplus;
        surplus = (-mean).max(0.0);
        let key = (cell as u64) << 8 | bin;
        // differential counts at both ends of the bin give its slope
        let growth = (counts.brighter_than(faint + BIN) - counts.brighter_than(faint))
            / (counts.brighter_than(bright) - counts.brighter_than(bright - BIN));
        let slope = 0.5 * growth.ln() / BIN;
        let drawn = poisson(&number, key, mean) as u64;
        for star in 0..drawn.min(1 << STAR_BITS) {
            let id = key << STAR_BITS | star;
            let [u, v] = place.block(id, 0).map(uniform);
            let share = uniform(place.block(id, 1)[0]);
            let mag_v = from + exponential(share, slope, faint - from);
            if mag_v < limit {
                let [ra, dec] = bounds.place(u, v);
                let direction = direction(ra, dec);
                found.push(CatalogueStar { id: FIRST_ID + id, direction, mag_v, colour_bv: None, motion: None });
            }
        }
    }
    found
}

/// The place in 0..`width` below which lies the share `u` of a density exp(`slope` x).
fn exponential(u: f64, slope: f64, width: f64) -> f64 {
    let rise = slope * width;
    if rise.abs() < 1e-6 { u * width } else { (u * rise.exp_m1()).ln_1p() / slope }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_deeper_limit_adds_stars_and_moves_none() {
        let catalogue = Catalogue::built_in();
        let cell = 20_700;
        let (shallow, deep) = (stars(&catalogue, cell, 16.1), stars(&catalogue, cell, 18.0));
        let kept = deep.iter().filter(|s| s.mag_v < 16.1).copied().collect::<Vec<_>>();
        assert_eq!(shallow, kept);
        assert!(deep.len() > shallow.len() && !shallow.is_empty());
    }

    /// Counted over 300 cells of the sky at |b| > 30 deg: as many as the counts less the catalogue, within 4 sigma.
    #[test]
    fn catalogue_and_synthetic_stars_make_up_the_counts() {
        let catalogue = Catalogue::built_in();
        let (mut found, mut expected) = (0.0, 0.0);
        for cell in (0..41_000).step_by(97) {
            let bounds = Bounds::of(cell);
            let [ra, dec] = bounds.place(0.5, 0.5);
            let place = Galactic::of(direction(ra, dec));
            if place.b.abs() < 0.52 {
                continue;
            }
            let counts = Counts::at(place);
            let area = bounds.solid_angle() * DEG2_PER_SR;
            expected += area * (counts.brighter_than(17.0) - counts.brighter_than(14.0));
            found += stars(&catalogue, cell, 17.0).iter().filter(|s| s.mag_v >= 14.0).count() as f64;
        }
        assert!((found - expected).abs() < 4.0 * expected.sqrt(), "{found} of {expected}");
    }

    #[test]
    fn magnitudes_fill_their_bin() {
        assert_eq!(exponential(0.5, 0.0, 0.25), 0.125);
        assert!((exponential(1.0, 1.2, 0.25) - 0.25).abs() < 1e-12 && exponential(0.5, 1.2, 0.25) > 0.125);
    }
}
