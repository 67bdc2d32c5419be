//! EXPERIMENTAL: how an object tumbles, and what its curves are in the axes of a body that moves so.

use super::shape_data::Data;
use super::shape_fault::InvertError;
use crate::inversion::egi::{Curve, Options};
use crate::inversion::pole::Spinning;
use crate::inversion::tumble::{self, Found, Minimum, Motion, Scan};

/// Reduced chi-square of a motion, above which it is no explanation.
const EXPLAINS: f64 = 2.0;

/// A motion without torque sought and found.
#[derive(Debug, Clone)]
pub struct Tumbling {
    /// Minima, the best first.
    pub found: Found,
    /// Whether a motion was told, near which it was sought.
    pub told: bool,
    /// Least and greatest time of a turn about the angular momentum of motions drawn at random \[s\].
    pub range_s: Option<(f64, f64)>,
    /// Motions whose criterion is within this of the least are listed.
    pub within: f64,
}

impl Tumbling {
    /// The motion that explains the light best.
    pub fn best(&self) -> Option<&Minimum> {
        self.found.minima.first()
    }

    /// The curves in the principal axes of a body that moves in the best way.
    pub fn in_body_axes(&self, data: &Data) -> Vec<Curve> {
        let turned = |(curve, times): (&Curve, &Vec<f64>)| {
            let directions = self.best().and_then(|best| best.motion.body_axes(times, &curve.directions));
            Curve { directions: directions.unwrap_or_else(|| curve.directions.clone()), ..curve.clone() }
        };
        data.curves.iter().zip(&data.time_s).map(turned).collect()
    }

    /// What may be said of the motion.
    pub(super) fn claim(&self) -> String {
        let unexplained = self.best().is_none_or(|best| best.solution.reduced() > EXPLAINS);
        if unexplained {
            return "EXPERIMENTAL: no motion that was tried explains the light; that is no proof that none does, and the shape means nothing"
                .into();
        }
        "EXPERIMENTAL: the motion is the best of those that were tried, and no proof that it is the only one; the shape is as good as the motion".into()
    }
}

/// Near the motion told, at the time 0 of the data, and among motions whose turn about the angular momentum takes as long as asked for.
///
/// # Errors
/// As of [`tumble::scan`].
pub fn search(data: &Data, range_s: Option<(f64, f64)>, told: Option<Motion>) -> Result<Tumbling, InvertError> {
    let spinning = Spinning { curves: data.curves.clone(), times: data.time_s.clone() };
    let how = Scan { told, turn: range_s, ..Scan::default() };
    let found = tumble::scan(&spinning, &data.material, &how, &Options::default())?;
    Ok(Tumbling { found, told: told.is_some(), range_s, within: how.within })
}
