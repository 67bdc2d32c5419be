//! What the standard forbids.

/// Longest line \[characters\], section 4.2.1.
pub(super) const LONGEST_LINE: usize = 254;

/// Why a message cannot be written or read.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TdmError {
    /// No observation of any track has a place or a magnitude.
    #[error("there is nothing to write: a message needs one finite place or magnitude")]
    Empty,
    /// A number that the keyword cannot hold.
    #[error("{keyword} of {target:?} at {time} is {value}; it must lie from {low} to {high}")]
    Range {
        /// Keyword.
        keyword: &'static str,
        /// Target.
        target: String,
        /// Time, UTC.
        time: String,
        /// The value.
        value: f64,
        /// Least value allowed.
        low: f64,
        /// Greatest value allowed.
        high: f64,
    },
    /// Two observations of a track at one time.
    #[error("{target:?} is observed twice at {time}; a timetag may occur once (503.0-B-2, 3.4.11)")]
    Repeated {
        /// Target.
        target: String,
        /// Time, UTC.
        time: String,
    },
    /// A line that breaks the grammar.
    #[error("line {line}: {text:?}: {fault} (503.0-B-2, {section})")]
    Line {
        /// Number of the line, from 1.
        line: usize,
        /// The line, or what of it is wrong.
        text: String,
        /// What is wrong, and what is allowed.
        fault: String,
        /// Section or table of the standard.
        section: &'static str,
    },
}
