//! What is found, with its errors; or why nothing is.

use super::align::Alignment;
use super::fit::{Model, arc, carried};
use super::refine::{Refined, median};
use super::{Detection, holds};
use crate::plan::wcs::Wcs;
use glam::{DVec2, DVec3};

/// A detection and its star.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Match {
    /// Place of the detection in the list given.
    pub detection: usize,
    /// Place of the star in the list given.
    pub star: usize,
    /// Detection less the star's place by the solution \[px\].
    pub residual: DVec2,
}

/// World coordinates found for a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// World coordinates, about the a-priori reference pixel (its mirror image, if `flip` is).
    pub wcs: Wcs,
    /// The model that the stars justify.
    pub model: Model,
    /// Pairs that the model was fitted to, by detections in order of brightness.
    pub matches: Vec<Match>,
    /// Catalogue stars in the frame.
    pub in_field: usize,
    /// Median of the residuals' moduli, per axis \[px\].
    pub median_residual: DVec2,
    /// Root mean square residual, per axis \[px\].
    pub rms_residual: DVec2,
    /// Sum over both axes of squared residuals in units of the detections' own errors.
    pub chi_square: f64,
    /// Residuals of both axes less parameters.
    pub degrees_of_freedom: usize,
    /// Scatter per axis beyond the detections' own errors, which the weights include \[px\].
    pub extra_scatter: f64,
    /// Standard error per axis of the map at the reference pixel, by the model \[px\].
    pub error_at_reference: f64,
    /// The largest at a corner of the frame \[px\].
    pub error_in_corner: f64,
    /// Angle between the a-priori place of the frame's centre and that found \[rad\].
    pub offset: f64,
    /// Turn of the camera against the a-priori one, from east towards north \[rad\].
    pub rotation: f64,
    /// Pixel scale found over the a-priori one.
    pub scale: f64,
    /// -1 for an axis of pixels stored the other way round.
    pub flip: DVec2,
    /// log10 of the expected number of alignments as good in the whole search, if detections were strewn at random: an upper bound of
    /// the probability that chance made the solution. It is that of the few detections by which the alignment was found first;
    /// the others, matched afterwards, are not counted.
    pub log10_false: f64,
}

impl Solution {
    pub(super) fn new(
        detections: &[(usize, Detection)],
        stars: &[(usize, DVec3)],
        prior: &Wcs,
        frame: DVec2,
        flip: DVec2,
        alignment: &Alignment,
        refined: &Refined,
    ) -> Self {
        let wcs = refined.fitted.wcs;
        let matched: Vec<(f64, Match)> = refined
            .pairs
            .iter()
            .filter_map(|&(d, s)| {
                let (detection, found) = detections.get(d)?;
                let (star, direction) = stars.get(s)?;
                let residual = found.at - wcs.pixel(*direction)?;
                Some((found.sigma, Match { detection: *detection, star: *star, residual }))
            })
            .collect();
        let middle =
            |axis: usize| median(matched.iter().map(|m| m.1.residual[axis].abs()).collect()).unwrap_or(0.0);
        let squares: DVec2 = matched.iter().map(|m| m.1.residual * m.1.residual).sum();
        let centre = 0.5 * (frame - 1.0);
        let (from, to) = (prior.sky(centre), wcs.sky(centre));
        let turn = carried(wcs.cd, wcs.centre, arc(wcs.centre, prior.centre)) * prior.cd.inverse();
        Self {
            wcs,
            model: refined.fitted.model,
            in_field: stars.iter().filter(|s| wcs.pixel(s.1).is_some_and(|at| holds(frame, at, 0.0))).count(),
            median_residual: DVec2::new(middle(0), middle(1)),
            rms_residual: (squares / matched.len().max(1) as f64).map(f64::sqrt),
            chi_square: matched.iter().map(|(sigma, m)| m.residual.length_squared() / (sigma * sigma)).sum(),
            degrees_of_freedom: (2 * matched.len()).saturating_sub(refined.fitted.model.parameters()),
            extra_scatter: refined.extra,
            error_at_reference: refined.fitted.errors[0],
            error_in_corner: refined.fitted.errors[1],
            offset: from.cross(to).length().atan2(from.dot(to)),
            rotation: (turn.x_axis.y - turn.y_axis.x).atan2(turn.x_axis.x + turn.y_axis.y),
            scale: wcs.pixel_scale() / prior.pixel_scale(),
            flip,
            log10_false: alignment.evidence.log10_false,
            matches: matched.into_iter().map(|m| m.1).collect(),
        }
    }
}

/// Why a frame has no solution.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Refusal {
    /// A number given is out of range.
    #[error("{of}: {name} is {value}; {} to {} are allowed", allowed[0], allowed[1])]
    Range {
        /// What it belongs to.
        of: &'static str,
        /// Which, with its unit.
        name: &'static str,
        /// The number.
        value: f64,
        /// Its range.
        allowed: [f64; 2],
    },
    /// Too few detections or stars.
    #[error(
        "{detections} detections and {stars_near} catalogue stars near the field ({in_field} in it by the header); \
         at least {needed} of each are needed"
    )]
    TooFew {
        /// Usable detections.
        detections: usize,
        /// Usable stars in reach of the search.
        stars_near: usize,
        /// Stars in the frame by the a-priori world coordinates.
        in_field: usize,
        /// Fewest of each.
        needed: usize,
    },
    /// The best alignment may be one of chance.
    #[error(
        "the best alignment matches {matched} of {tried} detections tried ({detections} in all; {by_chance:.1} expected by chance) \
         with {stars_near} catalogue stars near the field ({in_field} in it by the header): 10^{log10_false:.1} such \
         alignments are expected by chance, at most 10^{allowed} are believed"
    )]
    NotSignificant {
        /// Usable detections.
        detections: usize,
        /// Usable stars in reach of the search.
        stars_near: usize,
        /// Stars in the frame by the a-priori world coordinates.
        in_field: usize,
        /// Detections that the best alignment matches.
        matched: usize,
        /// Detections that it was tried on.
        tried: usize,
        /// Matches expected by chance.
        by_chance: f64,
        /// log10 of the expected number of alignments as good; infinite if none was found at all.
        log10_false: f64,
        /// The largest that is believed.
        allowed: f64,
    },
    /// A significant alignment lost its pairs when it was refined.
    #[error("an alignment of {matched} detections lost its pairs when refined; {needed} are needed")]
    Lost {
        /// Detections that it matched.
        matched: usize,
        /// Fewest pairs of a solution.
        needed: usize,
    },
}
