//! The stars of a user's table.

use super::columns::{Choice, Columns};
use super::encode::StarRecord;
use super::error::CatalogueError;
use super::table::Table;
use std::path::Path;

/// What a row may say: degrees, magnitudes. Right ascension may be counted to the west of 0 too.
const RA_DEG: [f64; 2] = [-180.0, 360.0];
const DEC_DEG: [f64; 2] = [-90.0, 90.0];
const MAG: [f64; 2] = [-30.0, 32.0];
/// Colours and motions beyond these are no star's: B-V \[mag\], proper motion \[mas/yr\] (Barnard's star: 10,393).
const BV: [f64; 2] = [-2.0, 10.0];
const MOTION: [f64; 2] = [-20_000.0, 20_000.0];
/// Julian years of places.
pub const YEARS: [f64; 2] = [1800.0, 2200.0];

/// Units, without blanks and in lower case, that columns of angles and of motions may have.
const DEGREES: [&str; 4] = ["", "deg", "degree", "degrees"];
const MAS_PER_YEAR: [&str; 7] = ["", "mas/yr", "mas/year", "mas/a", "masyr-1", "mas.yr-1", "masyr**-1"];

/// The stars of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct Listing {
    /// The stars, at [`Listing::epoch`].
    pub stars: Vec<StarRecord>,
    /// Julian year of the places.
    pub epoch: f64,
    /// Rows of the table.
    pub rows: usize,
    /// Why the first row that was skipped was.
    pub first_skipped: Option<String>,
}

impl Listing {
    /// Rows that were skipped.
    pub fn skipped(&self) -> usize {
        self.rows - self.stars.len()
    }
}

/// The stars of the table in a file; `epoch` is that of the places, if the user says it.
///
/// A row whose place or magnitude is not known or out of range is skipped. Rows with epochs of their own are moved to the
/// first row's.
///
/// # Errors
/// [`CatalogueError`] if the file cannot be read, lacks a column or holds no star.
pub fn read(path: &Path, choice: &Choice, epoch: Option<f64>) -> Result<Listing, CatalogueError> {
    of_table(&Table::open(path)?, choice, epoch)
}

fn of_table(table: &Table, choice: &Choice, epoch: Option<f64>) -> Result<Listing, CatalogueError> {
    let columns = Columns::find(&table.names, choice).map_err(|reason| table.fault(reason))?;
    check_units(table, &columns)?;
    let mut stars = Vec::new();
    let (mut rows, mut first_skipped) = (0, None);
    let mut common = epoch;
    table.rows(&columns.wanted(), |row, values| {
        rows += 1;
        match star(table, &columns, values) {
            Ok(star) => {
                let own = columns.epoch.map(|at| values[at]).filter(|year| within(*year, YEARS));
                let own = epoch.or(own).unwrap_or(columns.usual_epoch);
                stars.push(star.moved(*common.get_or_insert(own) - own));
            }
            Err(why) => {
                first_skipped.get_or_insert_with(|| format!("{}: {why}", table.place(row)));
            }
        }
    })?;
    if stars.is_empty() {
        let why = first_skipped.map_or_else(|| "no rows".to_owned(), |why| format!("the first row, {why}"));
        return Err(table.fault(format!("no star in it: {why}")));
    }
    Ok(Listing { stars, epoch: common.unwrap_or(columns.usual_epoch), rows, first_skipped })
}

fn within(value: f64, [low, high]: [f64; 2]) -> bool {
    (low..=high).contains(&value)
}

/// The star of a row, or why there is none.
fn star(table: &Table, columns: &Columns, values: &[f64]) -> Result<StarRecord, String> {
    let checked = |value: f64, range: [f64; 2], what: &str| match value {
        v if within(v, range) => Ok(v),
        v if v.is_nan() => Err(format!("{what} is not known")),
        v => Err(format!("{what} = {v} is outside {} .. {}", range[0], range[1])),
    };
    let [ra, dec] = columns.place;
    let ra = checked(values[ra], RA_DEG, &table.names[ra])?.to_radians();
    let dec = checked(values[dec], DEC_DEG, &table.names[dec])?.to_radians();
    let (mag_v, colour) = columns.light.of(values);
    let mag_v = checked(mag_v, MAG, "V")?;
    let told = columns.bv.map(|at| values[at]).filter(|bv| within(*bv, BV));
    let motion = columns.motion.map(|m| m.map(|at| values[at])).filter(|m| m.iter().all(|m| within(*m, MOTION)));
    Ok(StarRecord { ra, dec, mag_v, colour_bv: told.or(colour), motion_mas_yr: motion })
}

/// Angles in degrees, motions in mas/yr, or no unit told.
fn check_units(table: &Table, columns: &Columns) -> Result<(), CatalogueError> {
    let angles = columns.place.iter().map(|at| (at, &DEGREES[..], "deg"));
    let motions = columns.motion.iter().flatten().map(|at| (at, &MAS_PER_YEAR[..], "mas/yr"));
    for (at, allowed, wanted) in angles.chain(motions) {
        let unit = table.units[*at].to_ascii_lowercase().replace([' ', '^', '"'], "");
        if !allowed.contains(&unit.as_str()) {
            let (name, unit) = (&table.names[*at], &table.units[*at]);
            return Err(table.fault(format!("column {name} is in {unit:?}; {wanted} is wanted")));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn listing(text: &str, epoch: Option<f64>) -> Result<Listing, CatalogueError> {
        of_table(&Table::of_text("t".into(), text.as_bytes())?, &Choice::default(), epoch)
    }

    #[test]
    fn rows_without_place_or_magnitude_are_skipped_and_counted() {
        let text =
            "ra_deg,dec_deg,mag_v,colour_bv\r\n10,20,5,0.5\r\n10,95,5,\r\n10,,5,\r\n10,20,NaN,1\r\n11,20,6,\r\n";
        let found = listing(text, None).expect("two stars");
        assert_eq!((found.stars.len(), found.skipped(), found.epoch), (2, 3, 2000.0));
        assert_eq!(found.first_skipped.as_deref(), Some("line 3: dec_deg = 95 is outside -90 .. 90"));
        assert_eq!((found.stars[0].colour_bv, found.stars[1].colour_bv), (Some(0.5), None));
        let none = listing("ra,dec,Vmag\n1,2,\n", None).expect_err("no star").to_string();
        assert!(none.contains("no star in it: the first row, line 2: V is not known"), "{none}");
    }

    #[test]
    fn epochs_of_rows_are_brought_together() {
        let text =
            "ra,dec,phot_g_mean_mag,bp_rp,pmra,pmdec,ref_epoch\n10,0,9,0.8,0,100,2016\n10,0,9,,0,1000,2015.5\n";
        let found = listing(text, None).expect("two stars");
        assert_eq!(found.epoch, 2016.0);
        assert!((found.stars[1].dec.to_degrees() * 3600.0 - 0.5).abs() < 1e-9 && found.stars[0].dec == 0.0);
        assert!(found.stars[0].colour_bv.is_some() && found.stars[1].colour_bv.is_none());
        let said = listing(text, Some(2010.0)).expect("two stars");
        assert_eq!((said.epoch, said.stars[1].dec), (2010.0, 0.0));
    }

    #[test]
    fn other_units_are_refused() {
        let text = "# - {name: ra, unit: hourangle, datatype: float64}\nra dec Vmag\n1 2 3\n";
        let told = listing(text, None).expect_err("hours").to_string();
        assert!(told.contains("column ra is in \"hourangle\"; deg is wanted"), "{told}");
        let blocks = "# %ECSV 1.0\n# ---\n# datatype:\n# -\n#   name: ra\n#   unit: rad\n# -\n#   name: dec\n#   unit: deg\n\
                      ra dec Vmag\n1 2 3\n";
        let told = listing(blocks, None).expect_err("radians").to_string();
        assert!(told.contains("column ra is in \"rad\"; deg is wanted"), "{told}");
        let folded =
            "# - {name: ra,\n#    unit: deg, datatype: float64}\n# - {name: dec, unit: deg}\nra dec Vmag\n1 2 3\n";
        assert_eq!(listing(folded, None).expect("degrees").stars.len(), 1);
    }
}
