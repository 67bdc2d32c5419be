//! Masters from a night's bias, dark and flat frames.

use super::RunError;
use crate::io::image::{Image, keywords};
use crate::photometry::header::{Facts, Overrides};
use crate::photometry::master::{self, Frames};
use crate::photometry::reduce::{Bias, Calibration};
use std::ops::Range;
use std::path::PathBuf;

/// Memory for the raw frames of one kind \[bytes\].
const MEMORY: usize = 512 << 20;

/// Raw frames by kind; a single one may be a master already.
#[derive(Debug, Clone, Default)]
pub struct CalibrationFiles {
    /// Without light and time.
    pub bias: Vec<PathBuf>,
    /// Without light.
    pub dark: Vec<PathBuf>,
    /// Of even light.
    pub flat: Vec<PathBuf>,
}

impl CalibrationFiles {
    /// The calibration that they make; none without files. Without bias frames the level that the first dark or flat names
    /// counts, else 0.
    ///
    /// # Errors
    /// [`RunError`] for files that cannot be read, do not fit together, or lack an exposure time.
    pub fn masters(&self, overrides: &Overrides) -> Result<Option<Calibration>, RunError> {
        let Some(first) = self.bias.iter().chain(&self.dark).chain(&self.flat).next() else { return Ok(None) };
        let image = Image::read(first)?;
        let size = [image.width, image.height];
        drop(image);
        let facts = |files: &[PathBuf]| -> Result<Option<Facts>, RunError> {
            let Some(path) = files.first() else { return Ok(None) };
            Ok(Some(Facts::read(&keywords(path)?, size, overrides)))
        };
        let exposure = |facts: &Facts, path: &PathBuf| {
            let why = || RunError::Usage(format!("{}: no exposure time (EXPTIME)", path.display()));
            facts.exptime_s.ok_or_else(why)
        };
        let of_level = |facts: Option<&Facts>| facts.and_then(|f| f.bias_adu).unwrap_or(0.0);
        let (dark_facts, flat_facts) = (facts(&self.dark)?, facts(&self.flat)?);
        let bias = if self.bias.is_empty() {
            Bias::Level(of_level(dark_facts.as_ref().or(flat_facts.as_ref())))
        } else {
            Bias::Master(with_frames(&self.bias, size, master::bias)?)
        };
        let dark = match (&dark_facts, self.dark.first()) {
            (Some(facts), Some(path)) => {
                let seconds = exposure(facts, path)?;
                Some(with_frames(&self.dark, size, |frames| {
                    master::dark(frames, &bias, seconds, facts.ccd_temp_c)
                })?)
            }
            _ => None,
        };
        let flat = match (&flat_facts, self.flat.first()) {
            (Some(facts), Some(path)) => {
                let seconds = exposure(facts, path)?;
                Some(with_frames(&self.flat, size, |frames| master::flat(frames, &bias, dark.as_ref(), seconds))?)
            }
            _ => None,
        };
        let made = Calibration::new(size, bias, dark, flat);
        Ok(Some(made.map_err(|fault| RunError::Usage(format!("calibration frames: {fault}")))?))
    }
}

/// Makes a master of files, as many rows at a time as fit into memory.
fn with_frames<T>(
    files: &[PathBuf],
    size: [usize; 2],
    make: impl FnOnce(Frames) -> Result<T, crate::photometry::reduce::ReduceError>,
) -> Result<T, RunError> {
    let row_bytes = (size[0] * 4 * files.len()).max(1);
    let band_rows = (MEMORY / row_bytes).clamp(1, size[1].max(1));
    let mut read = |number: usize, rows: Range<usize>| -> Result<Vec<f32>, String> {
        let path = files.get(number).ok_or("no such frame")?;
        let image = Image::read(path).map_err(|fault| fault.to_string())?;
        if [image.width, image.height] != size {
            let (found, wanted) = ([image.width, image.height], size);
            return Err(format!(
                "{}: {} x {} pixels, not {} x {}",
                path.display(),
                found[0],
                found[1],
                wanted[0],
                wanted[1]
            ));
        }
        Ok(image.data[rows.start * size[0]..rows.end * size[0]].to_vec())
    };
    let frames = Frames { count: files.len(), size, band_rows, read: &mut read };
    make(frames).map_err(|fault| RunError::Usage(format!("{}: {fault}", files[0].display())))
}
