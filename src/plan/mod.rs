//! Planning: where the frame points, what its pixels see, and whether an exposure is worth taking.

pub mod brightness;
pub mod constraints;
pub mod crossing;
pub mod interval;
pub mod motion;
pub mod pace;
pub mod place;
pub mod planner;
pub mod pointing;
pub mod sight;
pub mod sip;
pub mod table;
pub mod view;
pub mod wcs;
pub mod windows;

use crate::astro;

/// What can go wrong while planning.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// The sky cannot be computed.
    #[error(transparent)]
    Astro(#[from] astro::Error),
    /// The frame has nothing to point at.
    #[error("pointing.at = \"target\" needs a [[target]]")]
    NoTarget,
    /// The optics' distortion cannot be used.
    #[error("telescope.sip: {0}")]
    Distortion(String),
}
