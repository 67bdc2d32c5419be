//! Which stars are drawn one by one, and what is left for the diffuse light.

/// The stars that a frame draws.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Drawn {
    /// None: the diffuse light holds all stars too faint for the eye.
    None,
    /// All stars brighter than V = `limit`: of the catalogue where it is complete, of the counts beyond.
    All {
        /// Faintest V magnitude drawn.
        limit: f64,
    },
    /// Of the catalogue alone, which is complete to V = `limit` here; its fainter stars make up `fainter_s10` already.
    Catalogue {
        /// Where the catalogue is complete, or the scene's limit if that is brighter.
        limit: f64,
        /// Faintest V magnitude drawn.
        faintest: f64,
        /// S10 of drawn stars fainter than `limit`.
        fainter_s10: f64,
    },
}

impl Drawn {
    /// Where the diffuse light begins, V: never among the stars of the naked eye.
    pub fn limit(&self) -> f64 {
        match self {
            Self::None => NAKED_EYE,
            Self::All { limit } | Self::Catalogue { limit, .. } => limit.max(NAKED_EYE),
        }
    }
}

/// Faintest magnitude of the naked eye: brighter stars are never diffuse light.
pub const NAKED_EYE: f64 = 6.5;
