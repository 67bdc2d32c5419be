//! Stars and targets: what shines through the point spread function.

use super::path::Path;
use glam::DVec3;

/// Something that shines through the PSF: a star or a target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointSource {
    /// Number of the star in its catalogue, or of the target in the scene.
    pub id: u64,
    /// Astrometric ICRS direction at mid-exposure.
    pub icrs: DVec3,
    /// Johnson V of sunlight that gives as many electrons \[mag\].
    pub mag_v: f64,
    /// Where it moves on the frame.
    pub path: Path,
    /// Electrons in the exposure over an endless plane, scintillation included.
    pub electrons: f64,
    /// True if its colour is known; else it has the Sun's spectrum.
    pub coloured: bool,
}
