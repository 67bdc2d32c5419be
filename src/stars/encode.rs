//! Writing the catalogue's file; its layout is told in [`super::catalogue`].

use super::cells::{BANDS, cell_of, cells_before};
use super::layout::{DEC_UNITS, HAS_COLOUR, HAS_MOTION, HEAD, MAGIC, RA_UNITS};
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
    /// Colour B-V \[mag\].
    pub colour_bv: Option<f64>,
    /// Proper motion in right ascension (times cos Dec) and declination \[mas/yr\].
    pub motion_mas_yr: Option<[f64; 2]>,
}

/// The bytes of a catalogue of `stars`; `complete_to` gives the magnitude to which a cell is complete.
pub fn encode(name: &str, epoch: f64, stars: &[StarRecord], complete_to: impl Fn(usize) -> f64) -> Vec<u8> {
    let cells = cells_before(BANDS);
    let has = |test: fn(&StarRecord) -> bool| !stars.is_empty() && stars.iter().all(test);
    let bits = if has(|s| s.colour_bv.is_some()) { HAS_COLOUR } else { 0 }
        | if has(|s| s.motion_mas_yr.is_some()) { HAS_MOTION } else { 0 };
    let mut order = (0..stars.len()).map(|i| (cell_of(stars[i].ra, stars[i].dec), i)).collect::<Vec<_>>();
    order.sort_by(|a, b| a.0.cmp(&b.0).then(stars[a.1].mag_v.total_cmp(&stars[b.1].mag_v)).then(a.1.cmp(&b.1)));
    let milli = |mag: f64| (mag * 1000.0).round().clamp(-32768.0, 32767.0) as i16;
    let sorted = || order.iter().map(|(_, i)| &stars[*i]);

    let mut out = MAGIC.to_vec();
    for value in [BANDS, cells, stars.len(), bits as usize] {
        out.extend((value as u32).to_le_bytes());
    }
    out.extend(epoch.to_le_bytes());
    out.extend(name.bytes().chain(std::iter::repeat(0)).take(HEAD - 32));
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
        sorted().for_each(|s| out.extend(milli(s.colour_bv.unwrap_or(0.0)).to_le_bytes()));
    }
    if bits & HAS_MOTION != 0 {
        for star in sorted() {
            let motion = star.motion_mas_yr.unwrap_or_default();
            motion.iter().for_each(|m| out.extend(((m * 100.0).round() as i32).to_le_bytes()));
        }
    }
    out
}
