//! Why light tells no shape.

use crate::inversion::egi::{EgiError, ProblemError};
use crate::inversion::nonconvex::NonconvexError;
use crate::inversion::pole::ScanError;
use crate::inversion::tumble::TumbleError;

/// Numbers of a tetrahedron: areas and normals of four facets less what closes them.
pub(super) const LEAST: usize = 9;

/// Why there is no shape.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum InvertError {
    /// Data that cannot be.
    #[error(transparent)]
    Data(#[from] ProblemError),
    /// The convex fit failed.
    #[error(transparent)]
    Convex(#[from] EgiError),
    /// Boxes and panels failed.
    #[error(transparent)]
    Nonconvex(#[from] NonconvexError),
    /// The pole was not found.
    #[error(transparent)]
    Scan(#[from] ScanError),
    /// The motion was not found.
    #[error(transparent)]
    Tumble(#[from] TumbleError),
    /// Fewer points than the simplest body has numbers.
    #[error(
        "{points} usable points of {all}; the simplest body, of four facets that close, has {LEAST} numbers, and several hundred points in \
         all attitudes tell a satellite's: make more exposures, or brighter ones"
    )]
    TooFew {
        /// Points that are left.
        points: usize,
        /// Those of the light curve.
        all: usize,
    },
    /// Boxes need a level.
    #[error("boxes and panels need a calibrated curve: no level is known here")]
    Relative,
    /// Periods that cannot be tried.
    #[error(
        "periods from {low} to {high} s are {count} to try; the least must be above 0, the greatest no less, and at most 20 000 fit the span: \
         --period A..B sets the range in seconds, where neither scene nor light tell one"
    )]
    Periods {
        /// Least \[s\].
        low: f64,
        /// Greatest \[s\].
        high: f64,
        /// Number of periods.
        count: usize,
    },
}
