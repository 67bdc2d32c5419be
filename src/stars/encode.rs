//! Writing the catalogue's file; its layout is told in [`super::catalogue`].

use super::cells::{BANDS, cell_of, cells_before};
use super::layout::{
    DEC_UNITS, HAS_COLOUR, HAS_LISTED_MOTION, HAS_MOTION, HEAD, LISTED_AT, LISTED_ENTRY, MAGIC, MOTION_UNITS,
    NAME_AT, NAME_BYTES, NO_COLOUR, NO_MOTION, RA_UNITS,
};
use crate::astro::{angles, direction};
use crate::base::units::ARCSEC;
use crate::plan::wcs::east_north;
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// A star to be stored.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StarRecord {
    /// Right ascension \[rad\].
    pub ra: f64,
    /// Declination \[rad\].
    pub dec: f64,
    /// Johnson V \[mag\].
    pub mag_v: f64,
    /// Colour B-V \[mag\], if known.
    pub colour_bv: Option<f64>,
    /// Proper motion in right ascension (times cos Dec) and declination \[mas/yr\], if known.
    pub motion_mas_yr: Option<[f64; 2]>,
}

impl StarRecord {
    /// Where it is `years` later, along a straight line; where it is now if its motion is not known.
    pub fn direction_after(&self, years: f64) -> DVec3 {
        let here = direction(self.ra, self.dec);
        self.motion_mas_yr.map_or(here, |motion| {
            let [east, north] = motion.map(|m| m * 1e-3 * ARCSEC * years);
            let (to_east, to_north) = east_north(here);
            (here + to_east * east + to_north * north).normalize()
        })
    }

    /// The star as it is `years` later.
    pub fn moved(&self, years: f64) -> Self {
        if self.motion_mas_yr.is_none() || years == 0.0 {
            return *self;
        }
        let (ra, dec) = angles(self.direction_after(years));
        Self { ra, dec, ..*self }
    }
}

/// The bytes of a catalogue of `stars`; `complete_to` gives the magnitude to which a cell is complete.
///
/// Motions are a column if more than two stars in three have one, else a list: whichever is smaller.
pub fn encode(name: &str, epoch: f64, stars: &[StarRecord], complete_to: impl Fn(usize) -> f64) -> Vec<u8> {
    let cells = cells_before(BANDS);
    let mut order = (0..stars.len()).map(|i| (cell_of(stars[i].ra, stars[i].dec), i)).collect::<Vec<_>>();
    order.sort_by(|a, b| a.0.cmp(&b.0).then(stars[a.1].mag_v.total_cmp(&stars[b.1].mag_v)).then(a.1.cmp(&b.1)));
    let sorted = || order.iter().map(|(_, i)| &stars[*i]);
    let moving = stars.iter().filter(|s| s.motion_mas_yr.is_some()).count();
    let as_column = LISTED_ENTRY * moving > 8 * stars.len();
    let motion_bit = [HAS_LISTED_MOTION, HAS_MOTION][usize::from(as_column)];
    let bits = if stars.iter().any(|s| s.colour_bv.is_some()) { HAS_COLOUR } else { 0 }
        | if moving > 0 { motion_bit } else { 0 };

    let mut out = MAGIC.to_vec();
    for value in [BANDS, cells, stars.len(), bits as usize] {
        out.extend((value as u32).to_le_bytes());
    }
    out.extend(epoch.to_le_bytes());
    out.extend(name.bytes().take(NAME_BYTES));
    out.resize(LISTED_AT.max(NAME_AT + NAME_BYTES), 0);
    out.extend((if as_column { 0 } else { moving as u32 }).to_le_bytes());
    out.resize(HEAD, 0);
    (0..=BANDS).for_each(|band| out.extend((cells_before(band) as u32).to_le_bytes()));
    (0..=cells).for_each(|cell| out.extend((order.partition_point(|(c, _)| *c < cell) as u32).to_le_bytes()));
    (0..cells).for_each(|cell| out.extend(milli(complete_to(cell)).to_le_bytes()));
    sorted()
        .for_each(|s| out.extend(((s.ra.rem_euclid(TAU) / TAU * RA_UNITS).round() as u64 as u32).to_le_bytes()));
    sorted().for_each(|s| {
        let units = (s.dec / PI * DEC_UNITS).round().clamp(f64::from(i32::MIN), f64::from(i32::MAX));
        out.extend((units as i32).to_le_bytes());
    });
    sorted().for_each(|s| out.extend(milli(s.mag_v).to_le_bytes()));
    if bits & HAS_COLOUR != 0 {
        sorted().for_each(|s| out.extend(s.colour_bv.map_or(NO_COLOUR, milli).to_le_bytes()));
    }
    for (i, star) in sorted().enumerate() {
        match star.motion_mas_yr {
            Some(motion) => {
                if !as_column {
                    out.extend((i as u32).to_le_bytes());
                }
                motion.iter().for_each(|m| out.extend(motion_units(*m).to_le_bytes()));
            }
            None if as_column => out.extend([NO_MOTION, NO_MOTION].map(i32::to_le_bytes).concat()),
            None => {}
        }
    }
    out
}

/// Millimagnitudes; the least number is left for what is not known.
fn milli(mag: f64) -> i16 {
    (mag * 1000.0).round().clamp(f64::from(i16::MIN) + 1.0, f64::from(i16::MAX)) as i16
}

/// Proper motion in the file's units; the least number is left for what is not known.
fn motion_units(mas_yr: f64) -> i32 {
    (mas_yr * MOTION_UNITS).round().clamp(f64::from(i32::MIN) + 1.0, f64::from(i32::MAX)) as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Barnard's star, Hipparcos 1997: J1991.25 to J2000.0, with its 10.3 arcsec a year.
    #[test]
    fn a_star_moves_along_its_proper_motion() {
        let at = |ra: f64, dec: f64| (ra.to_radians(), dec.to_radians());
        let (ra, dec) = at(269.454_023_05, 4.668_288_15);
        let star = StarRecord { ra, dec, mag_v: 9.54, colour_bv: None, motion_mas_yr: Some([-797.84, 10_326.93]) };
        let (ra, dec) = at(269.452_074_8, 4.693_388_2);
        let moved = star.moved(8.75);
        assert!(crate::astro::separation(direction(moved.ra, moved.dec), direction(ra, dec)) < 0.02 * ARCSEC);
        assert_eq!(StarRecord { motion_mas_yr: None, ..star }.moved(8.75).dec, star.dec);
    }
}
