//! The stars of an index of astrometry.net.
//!
//! A FITS file, such as Debian's `astrometry-data-tycho2-07-littleendian`
//! (Tycho-2, Hoeg et al. 2000, A&A 355, L27). Its table `kdtree_data_stars` holds three little-endian u32 a star,
//! unit vector = u / 2147483647.5 - 1 (J2000; the supplement's brightest stars J1991.25), its column `MAG_VT` the
//! magnitude VT. A cell of 22.5 arcmin holds its ten brightest stars and no more, so that a tenth star tells how
//! deep its neighbourhood goes. The column `sweep` is the star's place in the order (rank in its cell, VT), as a
//! share of all stars in 256 steps; the header card SWEEP10 counts the tenth stars, which are the last of that
//! order. V = VT - 0.07 at mean colour.

use super::cells::{BANDS, cell_of, cells_before};
use super::encode::StarRecord;
use super::error::CatalogueError;
use crate::astro::angles;
use fitsy::hdu::Hdu;
use fitsy::{FitsError, FitsFile, header::Value};
use glam::DVec3;
use std::collections::HashMap;
use std::path::Path;

/// V - VT at mean colour \[mag\].
const V_MINUS_VT: f64 = -0.07;

/// Where Tycho-2 itself stops being complete: 99 % at V = 11.0, 90 % at 11.5 (Hoeg et al. 2000).
const TYCHO2_COMPLETE_V: f64 = 11.5;

/// Epoch of the places, and of those of the brightest stars (Julian year).
pub const EPOCH: f64 = 2000.0;
/// Epoch of the places of the brightest stars.
pub const EPOCH_OF_BRIGHTEST: f64 = 1991.25;

/// The table of places in an index, as its first column is named.
const PLACES: &str = "kdtree_data_stars";

/// The stars of an index, and the magnitude to which each cell is complete.
pub struct Index {
    /// The stars, without colours and motions.
    pub stars: Vec<StarRecord>,
    /// By cell.
    pub complete: Vec<f64>,
}

/// The index in a file; none if it is another file.
///
/// # Errors
/// [`CatalogueError`] if it is an index that is damaged or lacks a table.
pub fn read(path: &Path) -> Result<Option<Index>, CatalogueError> {
    let told = |e: FitsError| CatalogueError::Format { path: path.display().to_string(), reason: e.to_string() };
    let Ok(file) = FitsFile::open(path) else { return Ok(None) };
    let mut tables: HashMap<String, Vec<u8>> = HashMap::new();
    for index in 0..file.len() {
        let Hdu::BinTable(table) = file.hdu(index).map_err(told)? else { continue };
        let Some(column) = table.columns().first().map(|c| c.name.clone()) else { continue };
        if [PLACES, "sweep", "MAG_VT"].contains(&column.as_str()) {
            tables.insert(column, table.data_bytes().to_vec());
        }
    }
    if !tables.contains_key(PLACES) {
        return Ok(None);
    }
    let table = |column: &str| {
        tables.get(column).ok_or_else(|| CatalogueError::Format {
            path: path.display().to_string(),
            reason: format!("no table {column}"),
        })
    };
    let (places, sweeps, mags) = (table(PLACES)?, table("sweep")?, table("MAG_VT")?);
    let count = sweeps.len().min(places.len() / 12).min(mags.len() / 4);

    // columns of floats are big-endian, as FITS demands
    let mag_v = (0..count)
        .map(|i| f64::from(f32::from_be_bytes([mags[4 * i], mags[4 * i + 1], mags[4 * i + 2], mags[4 * i + 3]])))
        .map(|mag_vt| mag_vt + V_MINUS_VT)
        .collect::<Vec<_>>();
    let tenth_stars = (0..file.len())
        .filter_map(|i| file.parsed_header(i).ok()?.first("SWEEP10"))
        .find_map(|value| if let Value::Integer(n) = value { usize::try_from(n).ok() } else { None });
    let tenth_stars = tenth_stars.ok_or_else(|| CatalogueError::Format {
        path: path.display().to_string(),
        reason: "no header card SWEEP10".into(),
    })?;
    let is_tenth = last_of_the_sweeps(sweeps, &mag_v, tenth_stars);

    let mut complete = vec![TYCHO2_COMPLETE_V; cells_before(BANDS)];
    let mut stars = Vec::with_capacity(count);
    for i in 0..count {
        let u = |axis: usize| {
            let at = 12 * i + 4 * axis;
            let value = u32::from_le_bytes([places[at], places[at + 1], places[at + 2], places[at + 3]]);
            f64::from(value) / 2_147_483_647.5 - 1.0
        };
        let (ra, dec) = angles(DVec3::new(u(0), u(1), u(2)));
        if is_tenth[i] {
            let limit = &mut complete[cell_of(ra, dec)];
            *limit = limit.min(mag_v[i]);
        }
        stars.push(StarRecord { ra, dec, mag_v: mag_v[i], colour_bv: None, motion_mas_yr: None });
    }
    Ok(Some(Index { stars, complete }))
}

/// Which stars are among the last `number` in the order of the sweeps; within one step of `sweeps` the end of one
/// sweep is faint and the beginning of the next bright.
fn last_of_the_sweeps(sweeps: &[u8], mag_v: &[f64], number: usize) -> Vec<bool> {
    let mut order = (0..mag_v.len()).collect::<Vec<_>>();
    order.sort_by(|a, b| sweeps[*b].cmp(&sweeps[*a]).then(mag_v[*a].total_cmp(&mag_v[*b])));
    let mut last = vec![false; mag_v.len()];
    order.iter().take(number).for_each(|i| last[*i] = true);
    last
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tenth_stars_are_the_last_and_brightest_of_their_step() {
        let last = last_of_the_sweeps(&[0, 1, 1, 1, 2], &[5.0, 12.0, 9.0, 12.5, 11.0], 2);
        assert_eq!(last, [false, false, true, false, true]);
    }

    #[test]
    fn another_file_is_no_index() {
        assert!(read(Path::new("/nowhere.fits")).expect("no fault").is_none());
    }
}
