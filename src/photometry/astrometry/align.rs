//! The a-priori plane laid on the stars: candidates polished, judged, and the first significant one taken.

use super::chance::{Evidence, evidence};
use super::draw::Draw;
use super::vote::{Limits, Similarity, vote};
use glam::DVec2;

/// Detections compared, and stars per field, in turn: few first, as their votes cost least; then deeper, for catalogues that
/// reach much fainter than the frame or frames that miss the bright stars.
const DRAWS: [[usize; 2]; 5] = [[16, 64], [32, 128], [32, 400], [64, 256], [128, 800]];

/// log10 of the expected number of alignments by chance, above which none is believed.
pub(super) const SIGNIFICANT: f64 = -5.0;

/// Radius within which the density of stars about a detection is counted, in sides of the frame.
const LOCAL: f64 = 1.0 / 16.0;

/// A similarity with its evidence.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Alignment {
    /// Moves detections onto stars.
    pub similarity: Similarity,
    /// How many it matches, and how easily chance does.
    pub evidence: Evidence,
}

/// Passes of matching and fitting.
const PASSES: usize = 6;

/// Fits a similarity to the detections that it brings near stars, again and again; none if too few are left.
fn polish(draw: &Draw, limits: &Limits, start: Similarity) -> Option<Similarity> {
    let mut found = start;
    for pass in 0..PASSES {
        let places: Vec<DVec2> = draw.detections.iter().map(|&at| found.of(at)).collect();
        // wide first, as a sample of two is off far from it
        let radius = limits.tolerance * if pass < 2 { 1.5 } else { 1.0 };
        let near: Vec<(DVec2, DVec2, f64)> = places
            .iter()
            .zip(&draw.detections)
            .filter_map(|(&place, &at)| {
                let (distance, star) = draw.by_place.nearest(place, radius)?;
                Some((at, draw.stars[star], distance))
            })
            .collect();
        let mut distances: Vec<f64> = near.iter().map(|n| n.2).collect();
        distances.sort_by(f64::total_cmp);
        let typical = distances.get(distances.len() / 2).copied()?.max(0.1);
        // Cauchy weights: matches by chance lie far off
        let weight = |distance: f64| 1.0 / (1.0 + (distance / typical).powi(2));
        let pairs: Vec<_> = near.iter().map(|&(at, star, distance)| (at, star, weight(distance))).collect();
        let next = Similarity::fitted(&pairs);
        if near.len() < 3 || !limits.allow(&next, 2.0 * limits.tolerance / limits.reach) {
            return None;
        }
        found = next;
    }
    Some(found)
}

/// Everything in the a-priori plane, brightest first.
pub(super) struct Plane<'a> {
    pub detections: &'a [DVec2],
    pub stars: &'a [DVec2],
    pub limits: Limits,
    /// Side of the frame: the square root of its area \[px\].
    pub side: f64,
    /// log10 of the number of planes tried.
    pub log10_planes: f64,
}

impl Plane<'_> {
    /// Evidence that the detections of a draw lie on its stars.
    fn judge(&self, draw: &Draw, found: &Similarity) -> Evidence {
        let places: Vec<DVec2> = draw.detections.iter().map(|&at| found.of(at)).collect();
        let trials = self.limits.log10_trials(&draw.detections, draw.stars.len(), draw.density)
            + self.log10_planes
            + (DRAWS.len() as f64).log10();
        evidence(&places, &draw.by_place, draw.density, LOCAL * self.side, trials)
    }

    /// The first significant alignment, or the best of the others.
    ///
    /// # Errors
    /// The most significant alignment found, if any, where none is significant.
    pub fn align(&self) -> Result<Alignment, Option<Alignment>> {
        let mut best: Option<Alignment> = None;
        let mut last = [0, 0];
        for size in DRAWS {
            let draw = Draw::new(self.detections, self.stars, self.side, size);
            let sizes = [draw.detections.len(), draw.stars.len()];
            // hardly more than before
            if sizes[0] <= last[0] && 10 * sizes[1] <= 11 * last[1] {
                continue;
            }
            last = sizes;
            let accepted = vote(&draw, &self.limits, &mut |start| {
                let similarity = polish(&draw, &self.limits, start)?;
                let found = Alignment { similarity, evidence: self.judge(&draw, &similarity) };
                if best.is_none_or(|b| found.evidence.log10_false < b.evidence.log10_false) {
                    best = Some(found);
                }
                (found.evidence.log10_false < SIGNIFICANT).then_some(found)
            });
            if let Some(found) = accepted {
                return Ok(found);
            }
        }
        Err(best)
    }
}
