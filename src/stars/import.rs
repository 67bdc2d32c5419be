//! Making a catalogue file: from an index of astrometry.net or from a user's table, with a supplement if there is one.

use super::columns::Choice;
use super::completeness::completeness;
use super::drawn::NAKED_EYE;
use super::encode::encode;
use super::error::CatalogueError;
use super::layout::NAME_BYTES;
use super::listing::{self, Listing};
use super::{index, supplement};
use std::path::{Path, PathBuf};

/// A catalogue of fewer covered cells than this is a patch of sky, whose edge matters.
const FEW_CELLS: usize = 100;

/// What to make a catalogue of.
#[derive(Debug, Clone, Default)]
pub struct Request {
    /// The index or table.
    pub file: PathBuf,
    /// Name to be stored; none: "tycho2" for an index, else the file's.
    pub name: Option<String>,
    /// Columns of a table.
    pub choice: Choice,
    /// Julian year of a table's places, if it does not say itself.
    pub epoch: Option<f64>,
    /// Magnitude to which a table is complete; none: estimated.
    pub complete_to: Option<f64>,
    /// A table of stars that supplement it, see [`super::supplement`].
    pub supplement: Option<PathBuf>,
}

/// A catalogue that was made.
#[derive(Debug, Clone)]
pub struct Imported {
    /// Its bytes.
    pub bytes: Vec<u8>,
    /// Number of stars.
    pub stars: usize,
    /// Julian year of their places.
    pub epoch: f64,
    /// What the user should know of the making.
    pub notes: Vec<String>,
}

/// Make a catalogue.
///
/// # Errors
/// [`CatalogueError`] if a file cannot be read, is damaged, lacks a column or holds no star; if an option does not apply.
pub fn import(request: &Request) -> Result<Imported, CatalogueError> {
    let fault = |reason: String| CatalogueError::Format { path: request.file.display().to_string(), reason };
    let mut notes = Vec::new();
    let (mut stars, complete, epoch, earlier, usual_name) = match index::read(&request.file)? {
        Some(index) => {
            if request.choice != Choice::default() || request.epoch.is_some() || request.complete_to.is_some() {
                return Err(fault(
                    "an astrometry.net index says itself where columns, epoch and completeness are; only --name and \
                     --supplement apply"
                        .into(),
                ));
            }
            let earlier = index::EPOCH - index::EPOCH_OF_BRIGHTEST;
            (index.stars, index.complete, index::EPOCH, Some(earlier), "tycho2".to_owned())
        }
        None => {
            let listing = listing::read(&request.file, &request.choice, request.epoch)?;
            notes.extend(told(&request.file, &listing));
            let complete = completeness(&listing.stars, request.complete_to);
            (listing.stars, complete, listing.epoch, None, stem(&request.file))
        }
    };
    if let Some(path) = &request.supplement {
        let listing = listing::read(path, &Choice::default(), None)?;
        notes.extend(told(path, &listing));
        let years = epoch - listing.epoch;
        let new = listing.stars.iter().map(|star| star.moved(years)).collect::<Vec<_>>();
        let merged = supplement::merge(&mut stars, &new, earlier);
        notes.push(format!(
            "{}: {} stars found in the catalogue, {} added, {} left out beside stars of other brightness",
            path.display(),
            merged.matched,
            merged.added,
            merged.left
        ));
    }
    if stars.len() > u32::MAX as usize {
        return Err(fault(format!("{} stars; a catalogue holds up to {}", stars.len(), u32::MAX)));
    }
    let name = request.name.as_deref().unwrap_or(&usual_name);
    if name.is_empty() || name.len() > NAME_BYTES {
        return Err(fault(format!("the name {name:?} has {} bytes, 1 .. {NAME_BYTES} are allowed", name.len())));
    }
    let bytes = encode(name, epoch, &stars, |cell| complete[cell]);
    let covered = complete.iter().filter(|c| **c >= NAKED_EYE).count();
    if covered < FEW_CELLS {
        notes.push(format!(
            "the stars cover {covered} cells of about a square degree: at the edge of such a patch, a cell counts as a whole, \
             and no synthetic stars fill what the table leaves empty"
        ));
    }
    Ok(Imported { bytes, stars: stars.len(), epoch, notes })
}

/// What the user should know of a table that was read.
fn told(path: &Path, listing: &Listing) -> Vec<String> {
    let path = path.display();
    let mut notes = vec![format!("{path}: {} stars, places taken for J{}", listing.stars.len(), listing.epoch)];
    if let Some(why) = &listing.first_skipped {
        let (skipped, rows) = (listing.skipped(), listing.rows);
        notes.push(format!("{path}: skipped {skipped} of {rows} rows; the first, {why}"));
    }
    notes
}

/// A file's name without its ending, as much of it as fits.
fn stem(path: &Path) -> String {
    let stem = path.file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned());
    let fits = (0..=stem.len().min(NAME_BYTES)).rev().find(|n| stem.is_char_boundary(*n)).unwrap_or(0);
    stem[..fits].to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stars::catalogue::Catalogue;
    use std::borrow::Cow;

    fn request(folder: &Path, text: &str) -> Request {
        let file = folder.join("stars.csv");
        std::fs::write(&file, text).expect("written");
        Request { file, ..Request::default() }
    }

    #[test]
    fn a_table_and_its_supplement_make_a_catalogue() {
        let folder = tempfile::tempdir().expect("a folder");
        let base = request(folder.path(), "ra,dec,Vmag\n10,20,8\n11,20,9\n12,20,nan\n");
        let extra = folder.path().join("extra.csv");
        std::fs::write(&extra, "ra_deg,dec_deg,mag_v,colour_bv,pmra,pmdec\n10,20,8.1,1.2,5,6\n50,20,1,,,\n")
            .expect("written");
        let made = import(&Request { supplement: Some(extra), complete_to: Some(9.5), ..base }).expect("made");
        let catalogue = Catalogue::from_bytes(Cow::Owned(made.bytes), "made").expect("whole");
        assert_eq!((catalogue.len(), catalogue.colours(), catalogue.motions()), (3, 1, 1));
        assert_eq!((catalogue.name().as_str(), catalogue.epoch()), ("stars", 2000.0));
        let all = made.notes.join("\n");
        for part in
            ["2 stars", "skipped 1 of 3 rows; the first, line 4: V is not known", "1 stars found", "1 added"]
        {
            assert!(all.contains(part), "{part} in {all}");
        }
    }

    #[test]
    fn names_that_do_not_fit_are_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let base = request(folder.path(), "ra,dec,Vmag\n10,20,8\n");
        let long = import(&Request { name: Some("a name that is far too long".into()), ..base });
        assert!(long.expect_err("too long").to_string().contains("1 .. 24"));
        assert_eq!(stem(Path::new("x/a_name_that_is_far_too_löng.csv")), "a_name_that_is_far_too_l");
    }

    #[test]
    fn what_is_no_table_is_told() {
        let folder = tempfile::tempdir().expect("a folder");
        let none = import(&Request { file: folder.path().join("none.csv"), ..Request::default() });
        assert!(matches!(none, Err(CatalogueError::Io { .. })));
        let binary = request(folder.path(), "\u{0}\u{1}\u{2}\n\u{3}");
        assert!(import(&binary).expect_err("no table").to_string().contains("right ascension"));
    }
}
