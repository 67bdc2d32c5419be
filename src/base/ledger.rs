//! The ledger: every source and stage of a frame, needed or absent and why.
//!
//! Each source of light and each stage of the detector is assessed before anything is computed. What is left
//! out is a row like any other, so that `explain`, `ledger.json` and the FITS HISTORY tell the same story.

use serde::Serialize;
use std::fmt;

/// Whether a source or stage takes part in a frame.
#[derive(Debug, Clone, PartialEq)]
pub enum Verdict {
    /// It takes part; `bound` is an upper estimate of its mean \[e-/px\].
    Needed {
        /// Upper estimate of the mean \[e-/px\].
        bound: f64,
    },
    /// It is left out.
    Absent(Why),
}

impl Verdict {
    /// True if the source or stage takes part.
    pub fn is_needed(&self) -> bool {
        matches!(self, Self::Needed { .. })
    }
}

/// Why a source or stage is left out.
#[derive(Debug, Clone, PartialEq)]
pub enum Why {
    /// The scene switches it off.
    NotAsked,
    /// It cannot reach the frame.
    NotVisible(String),
    /// The geometry lies outside the model's range: unknown, not zero.
    OutsideModel(String),
    /// Its bound is below what the scene allows to omit \[e-/px\].
    Negligible {
        /// Upper estimate of its mean \[e-/px\].
        bound: f64,
        /// What may be omitted \[e-/px\].
        allowed: f64,
    },
    /// Data are missing: unknown, not zero.
    NoData(String),
}

impl Why {
    /// True if the omitted amount is unknown, so that a user must be warned.
    pub fn is_unknown(&self) -> bool {
        matches!(self, Self::OutsideModel(_) | Self::NoData(_))
    }
}

impl fmt::Display for Why {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotAsked => write!(f, "not asked for by the scene"),
            Self::NotVisible(reason) => write!(f, "{reason}"),
            Self::OutsideModel(reason) => write!(f, "outside the model: {reason}; unknown, not zero"),
            Self::Negligible { bound, allowed } => {
                write!(f, "negligible: at most {bound:.3e} e-/px against {allowed:.3e} e-/px allowed")
            }
            Self::NoData(reason) => write!(f, "no data: {reason}; unknown, not zero"),
        }
    }
}

/// One line of the ledger.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// Name of the source or stage, for example `sky.airglow`.
    pub name: String,
    /// `needed` or `absent`.
    pub verdict: &'static str,
    /// Why it is absent, or what it is computed from.
    pub why: String,
    /// Upper estimate of its mean \[e-/px\].
    pub bound: f64,
    /// Mean at the frame's centre, of stars and target over the frame, averaged over the frames \[e-/px\]; 0 if absent.
    pub mean_e_px: f64,
    /// Largest less smallest mean over the field, as a share of the centre's, the largest of all frames; 0 where it is even.
    pub gradient: f64,
    /// Relative uncertainty of the mean (1 sigma): of the model, not of the photons; 0 where nothing is uncertain.
    pub uncertainty: f64,
    /// Time spent on it \[ms\], all frames together; NaN where it is not measured by itself.
    pub ms: f64,
    /// Memory of its representation \[bytes\].
    pub bytes: u64,
}

impl Row {
    /// The row of one source or stage. `basis` says what a needed one is computed from.
    pub fn new(name: &str, verdict: &Verdict, basis: &str) -> Self {
        let (word, why, bound) = match verdict {
            Verdict::Needed { bound } => ("needed", basis.to_owned(), *bound),
            Verdict::Absent(why) => (
                "absent",
                why.to_string(),
                match why {
                    Why::Negligible { bound, .. } => *bound,
                    _ if why.is_unknown() => f64::NAN,
                    _ => 0.0,
                },
            ),
        };
        let ms = if verdict.is_needed() { f64::NAN } else { 0.0 };
        Self {
            name: name.to_owned(),
            verdict: word,
            why,
            bound,
            mean_e_px: 0.0,
            gradient: 0.0,
            uncertainty: 0.0,
            ms,
            bytes: 0,
        }
    }

    /// True if the row is about something that takes part.
    pub fn is_needed(&self) -> bool {
        self.verdict == "needed"
    }
}

/// The ledger of a run: one row a source or stage, frames folded together.
#[derive(Debug, Clone, Default)]
pub struct Ledger {
    rows: Vec<(Row, usize)>,
}

impl Ledger {
    /// Fold the rows of one frame into the run's ledger. A source needed in any frame is needed; means are
    /// averaged over the frames, times are added, bounds and memory are the largest.
    pub fn fold(&mut self, frame: &[Row]) {
        for row in frame {
            match self.rows.iter_mut().find(|(known, _)| known.name == row.name) {
                None => self.rows.push((row.clone(), 1)),
                Some((known, count)) => {
                    let n = *count as f64;
                    known.mean_e_px = (known.mean_e_px * n + row.mean_e_px) / (n + 1.0);
                    known.ms = if row.is_needed() == known.is_needed() {
                        known.ms + row.ms
                    } else if row.is_needed() {
                        row.ms
                    } else {
                        known.ms
                    };
                    known.bytes = known.bytes.max(row.bytes);
                    known.gradient = known.gradient.max(row.gradient);
                    known.uncertainty = known.uncertainty.max(row.uncertainty);
                    known.bound = if known.bound.is_nan() { row.bound } else { known.bound.max(row.bound) };
                    if row.is_needed() && !known.is_needed() {
                        known.verdict = row.verdict;
                        known.why.clone_from(&row.why);
                    }
                    *count += 1;
                }
            }
        }
    }

    /// The rows, in the order in which light meets them.
    pub fn rows(&self) -> impl Iterator<Item = &Row> {
        self.rows.iter().map(|(row, _)| row)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folding_two_frames_averages_means_and_adds_times() {
        let mut needed = Row::new("sky.twilight", &Verdict::Needed { bound: 4.0 }, "Patat 2006");
        needed.mean_e_px = 4.0;
        needed.ms = 1.0;
        let absent = Row::new("sky.twilight", &Verdict::Absent(Why::NotVisible("Sun 30 deg down".into())), "");
        let mut ledger = Ledger::default();
        ledger.fold(&[absent]);
        ledger.fold(&[needed]);
        let row = ledger.rows().next().expect("one row");
        assert_eq!((row.verdict, row.mean_e_px, row.ms, row.bound), ("needed", 2.0, 1.0, 4.0));
        assert_eq!(row.why, "Patat 2006");
    }

    #[test]
    fn an_unknown_omission_has_no_bound() {
        let row = Row::new("sky.twilight", &Verdict::Absent(Why::NoData("no table".into())), "");
        assert!(row.bound.is_nan() && row.why.contains("unknown, not zero"));
    }
}
