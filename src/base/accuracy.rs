//! Every tolerance of the program in one place: what it bounds, its default, and the measured row behind it.
//!
//! Each approximation keeps a slow reference twin beside it; [`AccuracyRow`] is the one form in which their
//! difference and their run times are told.

use serde::{Deserialize, Serialize};

/// The scene's `[accuracy]` table.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Accuracy {
    /// A source whose mean is below this share of a pixel's noise is left out. The sum of all omissions of a
    /// frame stays below it.
    pub omit: f64,
    /// Relative error of an object's brightness, shape and time integration together.
    pub brightness: f64,
    /// Relative error of the sky's representation over the frame, against evaluation at every pixel.
    pub sky: f64,
    /// Share of a star's light outside its drawn stamp.
    pub psf: f64,
    /// Error of a trail's path against the exact one \[px\].
    pub trail_px: f64,
    /// Error of a computed place \[mas\].
    pub position_mas: f64,
}

impl Default for Accuracy {
    fn default() -> Self {
        Self { omit: 0.01, brightness: 1e-4, sky: 1e-3, psf: 1e-4, trail_px: 0.01, position_mas: 1.0 }
    }
}

/// Error against run time of one setting of one approximation, against its reference twin.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AccuracyRow {
    /// What is approximated, for example `sky.nodes`.
    pub approximation: String,
    /// The setting measured.
    pub setting: String,
    /// Largest error against the reference, in `unit`.
    pub max_err: f64,
    /// Root-mean-square error against the reference, in `unit`.
    pub rms_err: f64,
    /// Unit of the errors.
    pub unit: String,
    /// Run time \[s\].
    pub time_s: f64,
    /// Memory of the representation \[bytes\].
    pub bytes: u64,
    /// No other setting is both faster and more exact.
    pub pareto: bool,
    /// This is the setting used by default.
    pub default: bool,
}
