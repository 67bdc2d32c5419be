//! Shapes that are not convex, from light curves of known attitude, albedo and BRDF.
//!
//! ```text
//! test       can a convex body have sent this light? From the floor of its best fit and from its closure
//! baseline   one concavity with one angle in the best convex body (the family of Robinson & Frueh)
//! assemble   boxes and panels, fitted through an exact renderer; how many, how sure, and what else would do
//! metrics    how much two bodies differ
//! ```
//!
//! Light curves do not determine such a shape: Durech & Kaasalainen 2003 (A&A 404, 709) show that concavities leave a trace at
//! large phase angles alone. So [`assemble`] gives all the assemblies that it met whose chi^2 lies within the noise of the best.
//!
//! ```text
//! start     the convex fit; its near-perpendicular pairs of strong normals are attitudes of boxes
//! grow      part by part: random changes, one forward run each, Levenberg-Marquardt on ever fewer of the best
//! choose    as many parts as BIC asks for (Schwarz 1978, Ann. Stat. 6, 461) and held-out epochs do not object to
//! simplify  parts parallel, flush, centred, of one size where the data do not object
//! ```

mod assembly;
mod baseline;
mod clip;
mod doubt;
mod fit;
mod held_out;
pub mod metrics;
mod part;
mod propose;
pub mod registration;
mod render;
mod rivals;
mod search;
mod simplify;
mod tie;
mod verdict;

#[cfg(test)]
mod nonconvex_tests;
#[cfg(test)]
mod render_tests;

pub use assembly::{Assembly, Estimate, Panel, Trial, assemble};
pub use baseline::{Baseline, Folded, baseline};
pub use part::{PARAMETERS, Part, Triangle};
pub use render::{Force, Renderer};
pub use rivals::{Alternative, RIVALS, Spread};
pub use tie::Tie;
pub use verdict::{Call, Verdict, test};

use crate::inversion::egi::{EgiError, ProblemError};
use crate::inversion::minkowski;

/// How to assemble.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Most parts, 1 to 6.
    pub most: usize,
    /// Random changes tried on each assembly that grows, 20 to 100 000.
    pub proposals: usize,
    /// Assemblies of each number of parts that grow, 1 to 100.
    pub beam: usize,
    /// Attitudes taken from the convex fit, 1 to 100.
    pub attitudes: usize,
    /// Share of the epochs that is held out, 0.05 to 0.5.
    pub held_out: f64,
    /// Seed of the random changes.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self { most: 4, proposals: 200, beam: 4, attitudes: 6, held_out: 0.2, seed: 1 }
    }
}

/// Why there is no shape.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NonconvexError {
    /// Data that cannot be.
    #[error(transparent)]
    Data(#[from] ProblemError),
    /// The convex fit failed.
    #[error(transparent)]
    Convex(#[from] EgiError),
    /// The convex body failed.
    #[error(transparent)]
    Body(#[from] minkowski::Fault),
    /// An option out of its range.
    #[error("{option} = {value} is outside {low} to {high}")]
    Option {
        /// Its name.
        option: &'static str,
        /// Its value.
        value: f64,
        /// Least allowed.
        low: f64,
        /// Greatest allowed.
        high: f64,
    },
    /// Too few data.
    #[error("{data} data; {least} are needed at least")]
    Few {
        /// Data.
        data: usize,
        /// Least number.
        least: usize,
    },
    /// No light at all.
    #[error("the curve shows no light above its noise: no facet was found")]
    Dark,
}

impl Options {
    fn check(&self) -> Result<(), NonconvexError> {
        let range = |option, value: f64, low, high| match (low..=high).contains(&value) {
            true => Ok(()),
            false => Err(NonconvexError::Option { option, value, low, high }),
        };
        range("most", self.most as f64, 1.0, 6.0)?;
        range("proposals", self.proposals as f64, 20.0, 1e5)?;
        range("beam", self.beam as f64, 1.0, 100.0)?;
        range("attitudes", self.attitudes as f64, 1.0, 100.0)?;
        range("held_out", self.held_out, 0.05, 0.5)
    }
}
