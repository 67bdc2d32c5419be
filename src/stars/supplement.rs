//! Stars that supplement a catalogue: colours, motions and magnitudes of stars it has, and stars that it lacks.
//!
//! Two stars are the same if they stand within 3 arcsec of each other at the catalogue's epoch, or at an earlier one at
//! which some of the catalogue's places still are, and differ by less than 0.7 mag in V; the nearest is taken, and each
//! star once. A star of the catalogue then gets the supplement's colour and motion; its V if no other star of the
//! catalogue is within 5 arcsec, of which V might be the sum; its place if the catalogue's was of the earlier epoch (that
//! is where it stands, at half the distance or less). A star of the supplement is added if the catalogue has none within 3
//! arcsec, or only such as are fainter by 1.5 mag or more: its companions.

use super::cells::{cell_of, cells_near};
use super::encode::StarRecord;
use crate::astro::{direction, separation};
use crate::base::units::ARCSEC;
use glam::DVec3;

const SAME_PLACE: f64 = 3.0 * ARCSEC;
const SAME_MAG: f64 = 0.7;
const COMPANION_MAG: f64 = 1.5;
const ALONE: f64 = 5.0 * ARCSEC;

/// What became of a supplement's stars.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Merged {
    /// Found in the catalogue.
    pub matched: usize,
    /// Added to it.
    pub added: usize,
    /// Neither: near a star of other brightness.
    pub left: usize,
}

/// Stars by cell.
struct Finder(Vec<(usize, usize)>);

impl Finder {
    fn new(stars: &[StarRecord]) -> Self {
        let mut order = (0..stars.len()).map(|i| (cell_of(stars[i].ra, stars[i].dec), i)).collect::<Vec<_>>();
        order.sort_unstable();
        Self(order)
    }

    /// The stars within `radius` of `centre`, and how far each is \[rad\].
    fn near<'a>(
        &'a self,
        stars: &'a [StarRecord],
        centre: DVec3,
        radius: f64,
    ) -> impl Iterator<Item = (usize, f64)> + 'a {
        let of_cell = |cell: usize| {
            let from = self.0.partition_point(|(c, _)| *c < cell);
            self.0[from..].iter().take_while(move |(c, _)| *c == cell)
        };
        let far = move |i: usize| separation(direction(stars[i].ra, stars[i].dec), centre);
        cells_near(centre, radius)
            .flat_map(of_cell)
            .map(move |(_, i)| (*i, far(*i)))
            .filter(move |n| n.1 <= radius)
    }
}

/// Merge `supplement` into `stars`, both at one epoch; `earlier`: years back to where some of `stars` still stand.
pub fn merge(stars: &mut Vec<StarRecord>, supplement: &[StarRecord], earlier: Option<f64>) -> Merged {
    let finder = Finder::new(stars);
    let mut order = (0..supplement.len()).collect::<Vec<_>>();
    order.sort_by(|a, b| supplement[*a].mag_v.total_cmp(&supplement[*b].mag_v).then(a.cmp(b)));
    let mut taken = vec![false; stars.len()];
    let mut merged = Merged::default();
    let mut missing = Vec::new();
    for new in order.into_iter().map(|i| &supplement[i]) {
        let now = new.direction_after(0.0);
        let then = earlier.map(|years| new.direction_after(-years));
        let from = |place: DVec3| finder.near(stars, place, SAME_PLACE).collect::<Vec<_>>();
        let near = [Some(now), then].into_iter().flatten().flat_map(from).collect::<Vec<_>>();
        let same = |i: &usize| !taken[*i] && (stars[*i].mag_v - new.mag_v).abs() < SAME_MAG;
        let nearest = near.iter().filter(|(i, _)| same(i)).min_by(|a, b| a.1.total_cmp(&b.1));
        match nearest.map(|(i, _)| *i) {
            Some(i) => {
                taken[i] = true;
                merged.matched += 1;
                let old = direction(stars[i].ra, stars[i].dec);
                let alone = finder.near(stars, old, ALONE).count() == 1;
                let moved = then.is_some_and(|then| 2.0 * separation(old, then) < separation(old, now));
                let star = &mut stars[i];
                star.colour_bv = new.colour_bv.or(star.colour_bv);
                star.motion_mas_yr = new.motion_mas_yr.or(star.motion_mas_yr);
                if alone {
                    star.mag_v = new.mag_v;
                }
                if moved {
                    (star.ra, star.dec) = (new.ra, new.dec);
                }
            }
            None if near.iter().all(|(i, _)| stars[*i].mag_v >= new.mag_v + COMPANION_MAG) => missing.push(*new),
            None => merged.left += 1,
        }
    }
    merged.added = missing.len();
    stars.extend(missing);
    merged
}

#[cfg(test)]
mod tests {
    use super::*;

    fn star(east_arcsec: f64, north_arcsec: f64, mag_v: f64) -> StarRecord {
        let (ra, dec) = (1.0 + east_arcsec * ARCSEC, north_arcsec * ARCSEC);
        StarRecord { ra, dec, mag_v, colour_bv: None, motion_mas_yr: None }
    }

    fn known(east_arcsec: f64, north_arcsec: f64, mag_v: f64) -> StarRecord {
        let motion_mas_yr = Some([0.0, 1000.0]);
        StarRecord { colour_bv: Some(0.6), motion_mas_yr, ..star(east_arcsec, north_arcsec, mag_v) }
    }

    #[test]
    fn a_star_that_is_there_gets_colour_motion_and_magnitude() {
        let mut stars = vec![star(0.0, 0.0, 8.2), star(100.0, 0.0, 8.2), star(104.0, 0.0, 9.9)];
        let merged = merge(&mut stars, &[known(0.5, 0.5, 8.0), known(100.5, 0.0, 8.0)], None);
        assert_eq!(merged, Merged { matched: 2, added: 0, left: 0 });
        assert_eq!(stars[0], StarRecord { ra: 1.0, dec: 0.0, ..known(0.0, 0.0, 8.0) });
        assert_eq!((stars[1].mag_v, stars[1].colour_bv, stars[2].colour_bv), (8.2, Some(0.6), None));
    }

    #[test]
    fn a_place_of_the_earlier_epoch_is_renewed() {
        let mut stars = vec![star(0.0, -10.1, 8.0), star(50.0, 0.1, 8.0)];
        let merged = merge(&mut stars, &[known(0.0, 0.0, 8.1), known(50.0, 0.0, 8.1)], Some(10.0));
        assert_eq!(merged.matched, 2);
        assert!(stars[0].dec.abs() < 1e-12 && (stars[1].dec / ARCSEC - 0.1).abs() < 1e-9);
    }

    #[test]
    fn a_star_that_is_missing_is_added_and_a_doubtful_one_left() {
        let mut stars = vec![star(0.0, 0.0, 8.0), star(60.0, 0.0, 8.0)];
        let new = [known(3.5, 0.0, 8.0), known(0.0, 1.0, 7.0), known(60.0, 1.0, 6.4), known(60.0, 2.0, 8.1)];
        let merged = merge(&mut stars, &new, None);
        assert_eq!(merged, Merged { matched: 1, added: 2, left: 1 });
        assert_eq!(stars.iter().map(|s| s.mag_v).collect::<Vec<_>>(), [8.0, 8.1, 6.4, 8.0]);
    }
}
