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

impl Accuracy {
    /// Names of the keys.
    pub const KEYS: [&str; 6] = ["omit", "brightness", "sky", "psf", "trail_px", "position_mas"];

    /// The value of a key; none: no such key.
    pub fn value(mut self, key: &str) -> Option<f64> {
        self.slot(key).copied()
    }

    /// The same with another value of a key; a key that is none changes nothing.
    #[must_use]
    pub fn with(mut self, key: &str, value: f64) -> Self {
        if let Some(slot) = self.slot(key) {
            *slot = value;
        }
        self
    }

    fn slot(&mut self, key: &str) -> Option<&mut f64> {
        Some(match key {
            "omit" => &mut self.omit,
            "brightness" => &mut self.brightness,
            "sky" => &mut self.sky,
            "psf" => &mut self.psf,
            "trail_px" => &mut self.trail_px,
            "position_mas" => &mut self.position_mas,
            _ => return None,
        })
    }
}

/// The values of a key of `[accuracy]` that bring a setting.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerance {
    /// The key.
    pub key: &'static str,
    /// Least value that brings the setting.
    pub low: f64,
    /// Values from this one on bring another, unless it is `low`.
    pub high: f64,
}

impl Tolerance {
    /// One value alone.
    pub fn exactly(key: &'static str, value: f64) -> Self {
        Self { key, low: value, high: value }
    }

    /// True if `value` brings the setting.
    pub fn holds(&self, value: f64) -> bool {
        value == self.low || self.low <= value && value < self.high
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
    /// This is the setting that the scene uses.
    pub default: bool,
    /// The cheapest setting that meets the wanted error.
    pub suggested: bool,
    /// What brings this setting; none: no key of `[accuracy]` does.
    #[serde(skip)]
    pub by: Option<Tolerance>,
    /// The wanted error is one of the root mean square, not of the largest.
    #[serde(skip)]
    pub by_rms: bool,
    /// What one exposure of the scene leaves uncertain anyway, in `unit`; none: no such measure.
    #[serde(skip)]
    pub noise: Option<f64>,
}

impl AccuracyRow {
    /// The error that counts where one is wanted, in `unit`.
    pub fn error(&self) -> f64 {
        if self.by_rms { self.rms_err } else { self.max_err }
    }

    /// What the row is compared with: other rows of the same approximation, of shapes the ways to the light of the same shape.
    pub fn family(&self) -> String {
        match self.setting.split_once(": ") {
            Some((shape, _)) if self.approximation.starts_with("object.") => format!("shadows of {shape}"),
            _ => self.approximation.clone(),
        }
    }
}
