//! The star catalogue: a compact file, indexed by cells of the sky, read in place.
//!
//! Layout (little-endian). Head of 64 bytes: magic `NGSTARS1`, number of bands u32, number of cells u32, number of
//! stars u32, column bits u32 (1 = colour B-V, 2 = proper motion), epoch of the places f64 (Julian year), name in
//! 24 bytes. Then the columns, one after the other:
//! * first cell of each declination band, u32, bands + 1 values;
//! * first star of each cell, u32, cells + 1 values;
//! * magnitude to which each cell is complete, i16 millimagnitudes;
//! * right ascension u32 (2^32 = 360 deg, 0.3 mas), declination i32 (2^31 = 90 deg... 0.15 mas), V i16 (mmag);
//! * if present: B-V i16 (mmag); proper motion in RA (times cos Dec) and Dec, i32 (0.01 mas/yr).
//!
//! Bands are one degree of declination; a band is cut into equal cells of about one degree in right ascension.
//! Stars of a cell are sorted from bright to faint, so that a query stops at its limiting magnitude.

use super::cells::{BANDS, band_of, cells_before, cells_in};
use super::encode::encode;
use super::layout::{DEC_UNITS, HAS_COLOUR, HAS_MOTION, HEAD, MAGIC, RA_UNITS};
use crate::astro::{angles, direction};
use glam::DVec3;
use std::borrow::Cow;
use std::f64::consts::{PI, TAU};
use std::path::Path;

/// The built-in Tycho-2 catalogue; see `catalogs/README.md` for its origin and licence.
static TYCHO2: &[u8] = include_bytes!("../../catalogs/stars/tycho2.ngc");

/// One star.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CatalogueStar {
    /// Its number in the catalogue.
    pub id: u64,
    /// Astrometric ICRS direction at the catalogue's epoch.
    pub direction: DVec3,
    /// Johnson V \[mag\].
    pub mag_v: f64,
    /// Colour B-V \[mag\], if known.
    pub colour_bv: Option<f64>,
    /// Proper motion in right ascension (times cos Dec) and declination \[rad/yr\], if known.
    pub motion: Option<[f64; 2]>,
}

/// What can be wrong with a catalogue file.
#[derive(Debug, thiserror::Error)]
pub enum CatalogueError {
    /// It cannot be read.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: String,
        /// What the file system says.
        source: std::io::Error,
    },
    /// It is no catalogue of ours.
    #[error("{path}: {reason}")]
    Format {
        /// The file.
        path: String,
        /// What is wrong.
        reason: String,
    },
}

/// A catalogue, read in place.
#[derive(Debug, Clone)]
pub struct Catalogue {
    bytes: Cow<'static, [u8]>,
    columns: Columns,
}

/// Where each column begins in the file.
#[derive(Debug, Clone, Copy)]
struct Columns {
    bands: usize,
    cells: usize,
    stars: usize,
    band_first: usize,
    cell_first: usize,
    complete: usize,
    ra: usize,
    dec: usize,
    mag: usize,
    colour: Option<usize>,
    motion: Option<usize>,
    end: usize,
}

impl Columns {
    fn new(bands: usize, cells: usize, stars: usize, bits: u32) -> Self {
        let band_first = HEAD;
        let cell_first = band_first + 4 * (bands + 1);
        let complete = cell_first + 4 * (cells + 1);
        let ra = complete + 2 * cells;
        let dec = ra + 4 * stars;
        let mag = dec + 4 * stars;
        let mut end = mag + 2 * stars;
        let mut optional = |bit: u32, size: usize| {
            (bits & bit != 0).then(|| {
                let at = end;
                end += size * stars;
                at
            })
        };
        let colour = optional(HAS_COLOUR, 2);
        let motion = optional(HAS_MOTION, 8);
        Self { bands, cells, stars, band_first, cell_first, complete, ra, dec, mag, colour, motion, end }
    }
}

impl Catalogue {
    /// The built-in Tycho-2 catalogue.
    pub fn built_in() -> Self {
        Self::from_bytes(Cow::Borrowed(TYCHO2), "built-in tycho2").unwrap_or_else(|_| Self::empty())
    }

    /// A catalogue without stars.
    pub fn empty() -> Self {
        let bytes = encode("none", 2000.0, &[], |_| f64::INFINITY);
        let columns = Columns::new(BANDS, cells_before(BANDS), 0, 0);
        Self { bytes: Cow::Owned(bytes), columns }
    }

    /// The catalogue in a file.
    ///
    /// # Errors
    /// [`CatalogueError`] if the file cannot be read or is damaged.
    pub fn open(path: &Path) -> Result<Self, CatalogueError> {
        let name = path.display().to_string();
        let bytes = std::fs::read(path).map_err(|source| CatalogueError::Io { path: name.clone(), source })?;
        Self::from_bytes(Cow::Owned(bytes), &name)
    }

    /// The catalogue in `bytes`, named `name` in messages.
    ///
    /// # Errors
    /// [`CatalogueError::Format`] if the bytes are no whole catalogue.
    pub fn from_bytes(bytes: Cow<'static, [u8]>, name: &str) -> Result<Self, CatalogueError> {
        let fault = |reason: String| CatalogueError::Format { path: name.to_owned(), reason };
        if bytes.len() < HEAD || &bytes[..8] != MAGIC {
            return Err(fault("no nightglass star catalogue; make one with `nightglass catalog import`".into()));
        }
        let [bands, cells, stars, bits] = [8, 12, 16, 20].map(|at| u32_at(&bytes, at));
        let columns = Columns::new(bands as usize, cells as usize, stars as usize, bits);
        if columns.end != bytes.len() || columns.bands != BANDS || columns.cells != cells_before(BANDS) {
            return Err(fault(format!("{} bytes where the head announces {}", bytes.len(), columns.end)));
        }
        let catalogue = Self { bytes, columns };
        let ordered = |at: usize, count: usize, last: usize| {
            let value = |i: usize| u32_at(&catalogue.bytes, at + 4 * i) as usize;
            (0..count).all(|i| value(i) <= value(i + 1)) && value(count) == last
        };
        if !ordered(columns.band_first, columns.bands, columns.cells)
            || !ordered(columns.cell_first, columns.cells, columns.stars)
        {
            return Err(fault("its index is damaged".into()));
        }
        Ok(catalogue)
    }

    /// Number of stars.
    pub fn len(&self) -> usize {
        self.columns.stars
    }

    /// True if there is no star.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Size of the catalogue \[bytes\].
    pub fn bytes(&self) -> usize {
        self.bytes.len()
    }

    /// Name of the catalogue.
    pub fn name(&self) -> String {
        String::from_utf8_lossy(&self.bytes[32..56]).trim_end_matches('\0').to_owned()
    }

    /// Epoch of the places (Julian year).
    pub fn epoch(&self) -> f64 {
        f64::from_le_bytes(std::array::from_fn(|i| self.bytes[24 + i]))
    }

    /// True if the catalogue knows colours.
    pub fn has_colour(&self) -> bool {
        self.columns.colour.is_some()
    }

    /// True if the catalogue knows proper motions.
    pub fn has_motion(&self) -> bool {
        self.columns.motion.is_some()
    }

    /// The stars within `radius` \[rad\] of `centre`, brighter than `limit_mag_v`, in the order of the catalogue.
    pub fn cone(&self, centre: DVec3, radius: f64, limit_mag_v: f64) -> Vec<CatalogueStar> {
        let mut found = Vec::new();
        for cell in self.cells_near(centre, radius) {
            for i in self.cell_stars(cell) {
                let star = self.star(i);
                if star.mag_v >= limit_mag_v {
                    break;
                }
                if crate::astro::separation(star.direction, centre) <= radius {
                    found.push(star);
                }
            }
        }
        found
    }

    /// The magnitude to which the catalogue is complete in all cells within `radius` \[rad\] of `centre`.
    pub fn complete_to(&self, centre: DVec3, radius: f64) -> f64 {
        self.cells_near(centre, radius).map(|cell| self.cell_complete_to(cell)).fold(f64::INFINITY, f64::min)
    }

    /// The magnitude to which the catalogue is complete in a cell.
    pub fn cell_complete_to(&self, cell: usize) -> f64 {
        f64::from(i16_at(&self.bytes, self.columns.complete + 2 * cell)) / 1000.0
    }

    /// V magnitudes of a cell's stars, from bright to faint.
    pub fn cell_mags(&self, cell: usize) -> impl Iterator<Item = f64> + '_ {
        self.cell_stars(cell).map(|i| f64::from(i16_at(&self.bytes, self.columns.mag + 2 * i)) / 1000.0)
    }

    fn cell_stars(&self, cell: usize) -> std::ops::Range<usize> {
        let at = |i: usize| u32_at(&self.bytes, self.columns.cell_first + 4 * i) as usize;
        at(cell)..at(cell + 1)
    }

    fn star(&self, i: usize) -> CatalogueStar {
        let c = &self.columns;
        let ra = f64::from(u32_at(&self.bytes, c.ra + 4 * i)) / RA_UNITS * TAU;
        let dec = f64::from(u32_at(&self.bytes, c.dec + 4 * i) as i32) / DEC_UNITS * PI;
        let motion_unit = 0.01e-3 * crate::base::units::ARCSEC;
        CatalogueStar {
            id: i as u64,
            direction: direction(ra, dec),
            mag_v: f64::from(i16_at(&self.bytes, c.mag + 2 * i)) / 1000.0,
            colour_bv: c.colour.map(|at| f64::from(i16_at(&self.bytes, at + 2 * i)) / 1000.0),
            motion: c.motion.map(|at| {
                [0, 4].map(|part| f64::from(u32_at(&self.bytes, at + 8 * i + part) as i32) * motion_unit)
            }),
        }
    }

    /// The cells that a cone can touch.
    pub fn cells_near(&self, centre: DVec3, radius: f64) -> impl Iterator<Item = usize> {
        let (ra, dec) = angles(centre);
        let (low, high) = (dec - radius, dec + radius);
        // half-width in right ascension of a cone that holds no pole (Meeus 1998, ch. 17)
        let half = if low <= -PI / 2.0 || high >= PI / 2.0 {
            PI
        } else {
            (radius.sin() / dec.cos()).clamp(-1.0, 1.0).asin().abs()
        };
        (band_of(low)..=band_of(high)).flat_map(move |band| {
            let (first, count) = (cells_before(band), cells_in(band));
            let width = TAU / count as f64;
            let start = ((ra - half) / width).floor() as i64;
            let stop = ((ra + half) / width).floor() as i64;
            let number = ((stop - start + 1) as usize).min(count);
            (0..number).map(move |k| first + (start + k as i64).rem_euclid(count as i64) as usize)
        })
    }
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}

fn i16_at(bytes: &[u8], at: usize) -> i16 {
    i16::from_le_bytes([bytes[at], bytes[at + 1]])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::units::ARCSEC;
    use crate::stars::encode::StarRecord;

    fn record(ra_deg: f64, dec_deg: f64, mag_v: f64) -> StarRecord {
        StarRecord {
            ra: ra_deg.to_radians(),
            dec: dec_deg.to_radians(),
            mag_v,
            colour_bv: Some(0.65),
            motion_mas_yr: Some([-12.5, 3.25]),
        }
    }

    fn small() -> Catalogue {
        let stars = [
            record(0.001, 0.0, 5.0),
            record(359.999, 0.0, 6.0),
            record(123.0, 89.9, 7.0),
            record(303.0, 89.9, 8.0),
            record(10.0, -90.0, 4.0),
        ];
        let bytes = encode("small", 2000.0, &stars, |_| 11.0);
        Catalogue::from_bytes(Cow::Owned(bytes), "small").expect("a good catalogue")
    }

    #[test]
    fn cones_reach_over_the_seam_and_the_poles() {
        let catalogue = small();
        let mags = |ra: f64, dec: f64, radius: f64| {
            let centre = direction(ra.to_radians(), dec.to_radians());
            let mut found =
                catalogue.cone(centre, radius.to_radians(), 99.0).iter().map(|s| s.mag_v).collect::<Vec<_>>();
            found.sort_by(f64::total_cmp);
            found
        };
        assert_eq!(mags(0.0, 0.0, 0.1), [5.0, 6.0]);
        assert_eq!(mags(0.0, 90.0, 0.2), [7.0, 8.0]);
        assert_eq!(mags(123.0, 89.9, 0.01), [7.0]);
        assert_eq!(mags(200.0, -90.0, 0.01), [4.0]);
        assert_eq!(mags(77.0, 10.0, 180.0).len(), 5);
    }

    #[test]
    fn places_colours_and_motions_survive_storage() {
        let catalogue = small();
        let star = catalogue.cone(direction(0.0, 0.0), 0.01, 5.5)[0];
        let expected = direction(0.001f64.to_radians(), 0.0);
        assert!(crate::astro::separation(star.direction, expected) < 2e-4 * ARCSEC);
        assert_eq!((star.mag_v, star.colour_bv), (5.0, Some(0.65)));
        let motion = star.motion.expect("stored");
        assert!((motion[0] / ARCSEC * 1e3 + 12.5).abs() < 1e-9 && (motion[1] / ARCSEC * 1e3 - 3.25).abs() < 1e-9);
        assert_eq!((catalogue.len(), catalogue.epoch(), catalogue.name().as_str()), (5, 2000.0, "small"));
    }

    #[test]
    fn damaged_files_are_refused() {
        let bytes = encode("small", 2000.0, &[record(1.0, 1.0, 5.0)], |_| 11.0);
        for broken in [bytes[..40].to_vec(), bytes[..bytes.len() - 1].to_vec(), vec![0; 200]] {
            assert!(Catalogue::from_bytes(Cow::Owned(broken), "broken").is_err());
        }
        let mut scrambled = bytes;
        scrambled[HEAD + 5] = 0xFF;
        assert!(Catalogue::from_bytes(Cow::Owned(scrambled), "scrambled").is_err());
    }

    #[test]
    fn the_empty_catalogue_is_whole() {
        let empty = Catalogue::empty();
        assert!(empty.is_empty() && empty.cone(DVec3::X, PI, 99.0).is_empty());
    }

    /// Hipparcos places of bright stars (ESA 1997), epoch J2000 to 1.2 arcsec; V to 0.25 mag of VT - 0.07.
    #[test]
    fn bright_stars_of_the_built_in_catalogue_are_where_they_should_be() {
        let catalogue = Catalogue::built_in();
        assert_eq!(catalogue.len(), 1_871_011);
        for (name, ra, dec, v) in
            [("Spica", 201.298_25, -11.161_32, 0.97), ("Betelgeuse", 88.792_94, 7.407_06, 0.45)]
        {
            let centre = direction(f64::to_radians(ra), f64::to_radians(dec));
            let found = catalogue.cone(centre, 1.2 * ARCSEC, 3.0);
            assert_eq!(found.len(), 1, "{name}");
            assert!((found[0].mag_v - v).abs() < 0.25, "{name} {}", found[0].mag_v);
        }
    }
}
