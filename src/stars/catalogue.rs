//! The star catalogue: a compact file, indexed by cells of the sky, read in place.
//!
//! Layout (little-endian). Head of 64 bytes: magic `NGSTARS1`, number of bands u32, number of cells u32, number of
//! stars u32, column bits u32 (1 = colour B-V, 2 = column of proper motions, 4 = list of proper motions), epoch of the
//! places f64 (Julian year), name in 24 bytes, entries of the list of motions u32. Then the columns, one after the other:
//! * first cell of each declination band, u32, bands + 1 values;
//! * first star of each cell, u32, cells + 1 values;
//! * magnitude to which each cell is complete, i16 millimagnitudes;
//! * right ascension u32 (2^32 = 360 deg, 0.3 mas), declination i32 (2^31 = 90 deg... 0.15 mas), V i16 (mmag);
//! * if present: B-V i16 (mmag; -32768: not known); proper motion in RA (times cos Dec) and Dec, 2 x i32
//!   (0.01 mas/yr; -2147483648: not known), of every star; or a list of motions, each the star's number u32 and the
//!   two numbers, in ascending order of stars.
//!
//! Bands are one degree of declination; a band is cut into equal cells of about one degree in right ascension.
//! Stars of a cell are sorted from bright to faint, so that a query stops at its limiting magnitude.

use super::cells::{self, BANDS, cells_before};
use super::encode::encode;
pub use super::error::CatalogueError;
use super::layout::{
    Columns, DEC_UNITS, HAS_COLOUR, HAS_LISTED_MOTION, HAS_MOTION, HEAD, LISTED_AT, LISTED_ENTRY, MAGIC,
    MOTION_UNITS, NAME_AT, NAME_BYTES, NO_COLOUR, NO_MOTION, RA_UNITS, i16_at, u32_at,
};
use crate::astro::direction;
use crate::plan::wcs::east_north;
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

/// A catalogue, read in place.
#[derive(Debug, Clone)]
pub struct Catalogue {
    bytes: Cow<'static, [u8]>,
    columns: Columns,
}

impl Catalogue {
    /// The built-in Tycho-2 catalogue.
    pub fn built_in() -> Self {
        Self::from_bytes(Cow::Borrowed(TYCHO2), "built-in tycho2").unwrap_or_else(|_| Self::empty())
    }

    /// A catalogue without stars.
    pub fn empty() -> Self {
        let bytes = encode("none", 2000.0, &[], |_| f64::INFINITY);
        let columns = Columns::new([BANDS, cells_before(BANDS), 0, 0], 0);
        Self { bytes: Cow::Owned(bytes), columns }
    }

    /// The catalogue in a file.
    ///
    /// # Errors
    /// [`CatalogueError`] if the file cannot be read or is damaged.
    pub fn open(path: &Path) -> Result<Self, CatalogueError> {
        let name = path.display().to_string();
        let bytes = super::error::read_file(path)?;
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
        let bits = u32_at(&bytes, 20);
        if bits & !(HAS_COLOUR | HAS_MOTION | HAS_LISTED_MOTION) != 0 {
            return Err(fault(format!("column bits {bits}, known are 0 to 7; made by a newer version?")));
        }
        let columns = Columns::new([8, 12, 16, LISTED_AT].map(|at| u32_at(&bytes, at) as usize), bits);
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
        if let Some((at, count)) = columns.listed {
            let star = |k: usize| u32_at(&catalogue.bytes, at + LISTED_ENTRY * k) as usize;
            if (1..count).any(|k| star(k - 1) >= star(k)) || (count > 0 && star(count - 1) >= columns.stars) {
                return Err(fault("its list of proper motions is damaged".into()));
            }
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
        String::from_utf8_lossy(&self.bytes[NAME_AT..NAME_AT + NAME_BYTES]).trim_end_matches('\0').to_owned()
    }

    /// Epoch of the places (Julian year).
    pub fn epoch(&self) -> f64 {
        f64::from_le_bytes(std::array::from_fn(|i| self.bytes[24 + i]))
    }

    /// True if the catalogue knows the colour of any star.
    pub fn has_colour(&self) -> bool {
        self.columns.colour.is_some()
    }

    /// True if the catalogue knows the proper motion of any star.
    pub fn has_motion(&self) -> bool {
        self.columns.motion.is_some() || self.columns.listed.is_some()
    }

    /// Number of stars whose colour is known.
    pub fn colours(&self) -> usize {
        (0..self.len()).filter(|i| self.colour(*i).is_some()).count()
    }

    /// Number of stars whose proper motion is known.
    pub fn motions(&self) -> usize {
        self.columns
            .listed
            .map_or_else(|| (0..self.len()).filter(|i| self.motion(*i).is_some()).count(), |(_, count)| count)
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
        CatalogueStar {
            id: i as u64,
            direction: direction(ra, dec),
            mag_v: f64::from(i16_at(&self.bytes, c.mag + 2 * i)) / 1000.0,
            colour_bv: self.colour(i),
            motion: self.motion(i),
        }
    }

    fn colour(&self, i: usize) -> Option<f64> {
        let milli = i16_at(&self.bytes, self.columns.colour? + 2 * i);
        (milli != NO_COLOUR).then(|| f64::from(milli) / 1000.0)
    }

    /// Proper motion in right ascension and declination \[rad/yr\].
    fn motion(&self, i: usize) -> Option<[f64; 2]> {
        let at = match (self.columns.motion, self.columns.listed) {
            (Some(at), _) => at + 8 * i,
            (None, Some((at, count))) => {
                let star = |k: usize| u32_at(&self.bytes, at + LISTED_ENTRY * k) as usize;
                let k = first_not(count, |k| star(k) < i);
                (k < count && star(k) == i).then_some(at + LISTED_ENTRY * k + 4)?
            }
            (None, None) => return None,
        };
        let parts = [at, at + 4].map(|at| u32_at(&self.bytes, at) as i32);
        let unit = 1e-3 * crate::base::units::ARCSEC / MOTION_UNITS;
        parts.iter().all(|p| *p != NO_MOTION).then(|| parts.map(|p| f64::from(p) * unit))
    }

    /// The cells that a cone of half-angle `radius` \[rad\] about `centre` can touch.
    pub fn cells_near(&self, centre: DVec3, radius: f64) -> impl Iterator<Item = usize> {
        cells::cells_near(centre, radius)
    }
}

/// A star's direction after `years` of proper motion; radial motion and parallax are left out.
pub fn moved(star: &CatalogueStar, years: f64) -> DVec3 {
    star.motion.map_or(star.direction, |[ra, dec]| {
        let (east, north) = east_north(star.direction);
        (star.direction + (east * ra + north * dec) * years).normalize()
    })
}

/// The first of `count` sorted places at which `below` no longer holds.
fn first_not(count: usize, below: impl Fn(usize) -> bool) -> usize {
    let (mut low, mut high) = (0, count);
    while low < high {
        let middle = low + (high - low) / 2;
        if below(middle) { low = middle + 1 } else { high = middle }
    }
    low
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

    /// Few motions make a list, many a column; a star without colour or motion keeps none.
    #[test]
    fn each_star_has_its_own_colour_and_motion_or_none() {
        for with_motion in [1, 9] {
            let stars = (0..10).map(|i| StarRecord {
                colour_bv: (i % 2 == 0).then_some(0.1 * f64::from(i)),
                motion_mas_yr: (i < with_motion).then_some([f64::from(i), -0.5]),
                ..record(40.0 + f64::from(i), -3.5, 5.0 + f64::from(i))
            });
            let bytes = encode("mixed", 2000.0, &stars.collect::<Vec<_>>(), |_| 11.0);
            let catalogue = Catalogue::from_bytes(Cow::Owned(bytes), "mixed").expect("a good catalogue");
            assert_eq!((catalogue.colours(), catalogue.motions()), (5, with_motion as usize));
            assert!(catalogue.has_colour() && catalogue.has_motion());
            for i in 0..10u32 {
                let place = direction(f64::from(40 + i).to_radians(), f64::to_radians(-3.5));
                let star = catalogue.cone(place, 0.001, 99.0)[0];
                assert_eq!(star.colour_bv.is_some(), i % 2 == 0);
                assert_eq!(star.motion.is_some(), (i as i32) < with_motion, "{i}");
                let east = star.motion.map_or(0.0, |m| m[0] / ARCSEC * 1e3);
                assert!((east - if (i as i32) < with_motion { f64::from(i) } else { 0.0 }).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn cells_of_a_cone_hold_its_stars() {
        let catalogue = small();
        let cells = catalogue.cells_near(DVec3::X, 0.01).collect::<Vec<_>>();
        let mags = |limit: f64| {
            let of = |cell: &usize| catalogue.cell_mags(*cell).take_while(|m| *m < limit).sum::<f64>();
            cells.iter().map(of).sum::<f64>()
        };
        assert_eq!((mags(99.0), mags(6.0), mags(5.0)), (11.0, 5.0, 0.0));
        assert!(cells.iter().all(|cell| catalogue.cell_complete_to(*cell) == 11.0));
    }

    #[test]
    fn damaged_files_are_refused() {
        let bytes = encode("small", 2000.0, &[record(1.0, 1.0, 5.0)], |_| 11.0);
        for broken in [bytes[..40].to_vec(), bytes[..bytes.len() - 1].to_vec(), vec![0; 200]] {
            assert!(Catalogue::from_bytes(Cow::Owned(broken), "broken").is_err());
        }
        for at in [HEAD + 5, 20] {
            let mut scrambled = bytes.clone();
            scrambled[at] = 0xFF;
            assert!(Catalogue::from_bytes(Cow::Owned(scrambled), "scrambled").is_err());
        }
        let still = StarRecord { motion_mas_yr: None, ..record(2.0, 1.0, 5.0) };
        let mut list = encode("list", 2000.0, &[record(1.0, 1.0, 5.0), still], |_| 11.0);
        let entry = list.len() - LISTED_ENTRY;
        list[entry] = 7;
        let told = Catalogue::from_bytes(Cow::Owned(list), "list").expect_err("a star that is not there");
        assert!(told.to_string().contains("list of proper motions"), "{told}");
    }

    #[test]
    fn the_empty_catalogue_is_whole() {
        let empty = Catalogue::empty();
        assert!(empty.is_empty() && empty.cone(DVec3::X, PI, 99.0).is_empty());
    }

    /// Places at J2000.0, V, B-V and proper motions \[mas/yr\] of Hipparcos (ESA 1997).
    #[test]
    fn bright_stars_of_the_built_in_catalogue_are_where_they_should_be() {
        let catalogue = Catalogue::built_in();
        assert_eq!((catalogue.len(), catalogue.colours(), catalogue.motions()), (1_872_388, 116_469, 117_578));
        for (name, ra, dec, v, bv, motion) in [
            ("Sirius", 101.287_155, -16.716_116, -1.44, 0.01, [-546.0, -1223.1]),
            ("Canopus", 95.987_958, -52.695_661, -0.62, 0.16, [20.0, 23.7]),
            ("Vega", 279.234_735, 38.783_689, 0.03, 0.0, [201.0, 287.5]),
            ("Polaris", 37.954_561, 89.264_109, 1.97, 0.64, [44.2, -11.7]),
            ("Arcturus", 213.915_300, 19.182_409, -0.05, 1.24, [-1093.4, -1999.4]),
            ("Spica", 201.298_247, -11.161_319, 0.98, -0.23, [-42.5, -31.7]),
            ("Betelgeuse", 88.792_939, 7.407_064, 0.45, 1.50, [27.3, 10.9]),
        ] {
            let centre = direction(f64::to_radians(ra), f64::to_radians(dec));
            let found = catalogue.cone(centre, 0.05 * ARCSEC, 3.0);
            assert_eq!(found.len(), 1, "{name}");
            let star = found[0];
            assert!((star.mag_v - v).abs() < 0.1, "{name} {}", star.mag_v);
            assert!((star.colour_bv.expect(name) - bv).abs() < 0.02, "{name} {:?}", star.colour_bv);
            let found = star.motion.expect(name).map(|m| m / ARCSEC * 1e3);
            assert!((0..2).all(|k| (found[k] - motion[k]).abs() < 2.0), "{name} {found:?}");
        }
    }
}
