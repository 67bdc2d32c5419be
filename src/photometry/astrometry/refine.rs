//! From an alignment to the final world coordinates: matching, fitting and clipping in turn.

use super::Detection;
use super::align::Alignment;
use super::fit::{Fitted, Pair, about, arc, carried, justified, ladder};
use super::grid::mutual_nearest;
use super::vote::times;
use crate::plan::sip::HIGHEST;
use crate::plan::wcs::{Wcs, east_north};
use glam::{DMat2, DVec2, DVec3};

/// Passes of matching and fitting.
const PASSES: usize = 10;
/// Passes of clipping within one.
const CLIPS: usize = 4;
/// Residuals are clipped beyond this many standard errors: exp(-k^2 / 2) = 3e-4 of good pairs are lost.
const CLIP: f64 = 4.0;
/// Smallest radius of matching \[px\].
const NARROWEST: f64 = 0.5;
/// Median of the squared length of a vector with normal components of variance 1: 2 ln 2.
const MEDIAN_SQUARE: f64 = 2.0 * std::f64::consts::LN_2;

/// The world coordinates reached.
#[derive(Debug, Clone)]
pub(super) struct Refined {
    pub fitted: Fitted,
    /// Places of detection and of star in their lists.
    pub pairs: Vec<(usize, usize)>,
    /// Scatter beyond the detections' own per axis \[px\].
    pub extra: f64,
}

/// A-priori world coordinates moved by a similarity of their plane.
fn moved(prior: &Wcs, alignment: &Alignment) -> Wcs {
    let found = alignment.similarity;
    let scale = prior.pixel_scale();
    let (east, north) = east_north(prior.centre);
    let centre = (prior.centre + (east * found.shift.x + north * found.shift.y) * scale).normalize();
    let turn = DMat2::from_cols(found.turn, times(found.turn, DVec2::Y));
    about(centre, prior.crpix, carried(turn * prior.cd, prior.centre, arc(prior.centre, centre)), prior.sip)
}

/// Stars and detections in the tangent plane of world coordinates, in pixels.
fn plane(wcs: &Wcs, detections: &[Detection], stars: &[DVec3], reach: f64) -> (Vec<DVec2>, Vec<(DVec2, usize)>) {
    let (east, north) = east_north(wcs.centre);
    let scale = wcs.pixel_scale();
    let places = detections
        .iter()
        .map(|d| {
            let offset = d.at - wcs.crpix;
            wcs.cd * (offset + wcs.sip.map_or(DVec2::ZERO, |sip| sip.shift(offset))) / scale
        })
        .collect();
    let near = stars.iter().enumerate().filter_map(|(k, star)| {
        let depth = star.dot(wcs.centre);
        let at = DVec2::new(star.dot(east), star.dot(north)) / (depth * scale);
        (depth > 0.1 && at.length() < reach).then_some((at, k))
    });
    (places, near.collect())
}

/// The middle of some numbers; none of none.
pub(super) fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

/// The scatter per axis beyond the detections' own that makes the squared residuals' median what it should be.
fn extra_scatter(residuals: &[DVec2], sigmas: &[f64]) -> f64 {
    let excess = residuals.iter().zip(sigmas).map(|(r, s)| r.length_squared() / MEDIAN_SQUARE - s * s).collect();
    median(excess).unwrap_or(0.0).max(0.0).sqrt()
}

/// Refines an alignment with all detections and stars; none if the pairs are lost on the way.
pub(super) fn refine(
    detections: &[Detection],
    stars: &[DVec3],
    prior: &Wcs,
    alignment: &Alignment,
    corners: [DVec2; 4],
) -> Option<Refined> {
    let asked = corners.map(|corner| corner - prior.crpix);
    let reach = 1.2 * asked.into_iter().map(|at| at.length()).fold(0.0, f64::max) + 100.0;
    let start = moved(prior, alignment);
    let mut wcs = start;
    let widest = 2.0 * alignment.evidence.tolerance.max(NARROWEST);
    let mut radius = widest;
    let mut refined: Option<Refined> = None;
    for _ in 0..PASSES {
        let (places, near) = plane(&wcs, detections, stars, reach);
        let near_places: Vec<DVec2> = near.iter().map(|n| n.0).collect();
        let matched: Vec<(usize, usize)> =
            mutual_nearest(&places, &near_places, radius).into_iter().map(|(d, s)| (d, near[s].1)).collect();
        let steps = carried(start.cd, start.centre, arc(start.centre, wcs.centre));
        let present = about(wcs.centre, start.crpix, steps, start.sip);
        let Some(found) = clipped(detections, stars, &matched, &present, asked) else { break };
        wcs = found.fitted.wcs;
        let sigma = median(found.pairs.iter().map(|&(d, _)| detections[d].sigma).collect())?;
        radius = (1.5 * CLIP * sigma.hypot(found.extra)).clamp(NARROWEST, widest);
        let settled = refined.as_ref().is_some_and(|before| before.pairs == found.pairs);
        refined = Some(found);
        if settled {
            break;
        }
    }
    refined
}

/// Fits the justified model to pairs, without those that the most flexible one, and then the model itself, finds far off.
fn clipped(
    detections: &[Detection],
    stars: &[DVec3],
    matched: &[(usize, usize)],
    present: &Wcs,
    asked: [DVec2; 4],
) -> Option<Refined> {
    let sigmas: Vec<f64> = matched.iter().map(|&(d, _)| detections[d].sigma).collect();
    let mut pairs: Vec<Pair> =
        matched.iter().map(|&(d, s)| Pair { pixel: detections[d].at, sky: stars[s], weight: 1.0 }).collect();
    let weigh = |pairs: &mut [Pair], wcs: &Wcs| {
        let residual = |p: &Pair| wcs.pixel(p.sky).map_or(DVec2::INFINITY, |at| p.pixel - at);
        let off: Vec<DVec2> = pairs.iter().map(residual).collect();
        let extra = extra_scatter(&off, &sigmas);
        for ((pair, r), s) in pairs.iter_mut().zip(&off).zip(&sigmas) {
            let variance = s * s + extra * extra;
            pair.weight = if r.length_squared() < CLIP * CLIP * variance { 1.0 / variance } else { 0.0 };
        }
        extra
    };
    for _ in 0..CLIPS {
        let before: Vec<bool> = pairs.iter().map(|p| p.weight > 0.0).collect();
        let flexible = ladder(&pairs, present, asked, HIGHEST).pop()?;
        weigh(&mut pairs, &flexible.wcs);
        if pairs.iter().zip(before).all(|(p, before)| (p.weight > 0.0) == before) {
            break;
        }
    }
    let used = pairs.iter().filter(|p| p.weight > 0.0).count();
    let mut fitted = justified(ladder(&pairs, present, asked, HIGHEST), used)?;
    let mut extra = weigh(&mut pairs, &fitted.wcs);
    for _ in 0..2 {
        let model = fitted.model;
        // a model that clipping left too few pairs for stays as it is
        let again = ladder(&pairs, present, asked, model.order()).into_iter().find(|f| f.model == model);
        let Some(again) = again else { break };
        fitted = again;
        extra = weigh(&mut pairs, &fitted.wcs);
    }
    let kept = matched.iter().zip(&pairs).filter(|(_, p)| p.weight > 0.0).map(|(&m, _)| m).collect();
    Some(Refined { fitted, pairs: kept, extra })
}
