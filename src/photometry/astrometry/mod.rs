//! Astrometry: a frame's world coordinates from its detected sources and the catalogue's stars.
//!
//! 1. The a-priori world coordinates lay detections and stars into one plane. Bright detections and stars, by places (`draw`),
//!    are aligned by pairs that fix turn, scale and shift, and by the votes of the others (`vote`).
//! 2. An alignment is believed if chance would hardly bring it about anywhere in the search (`chance`); none is better than a
//!    wrong one.
//! 3. Pairs of mutual nearest neighbours, models of growing order and clipping lead to the final map (`refine`, `fit`).
//!
//! Magnitudes only decide what is compared first: passbands, saturation and false detections do no harm to the solution.

mod align;
mod borrow;
mod chance;
mod draw;
mod fit;
mod grid;
mod nested;
mod refine;
mod solution;
#[cfg(test)]
mod synthetic;
#[cfg(test)]
mod tests;
mod vote;

pub use borrow::{Borrowed, borrow};
pub use fit::Model;
pub use solution::{Match, Refusal, Solution};

use super::field::FieldStar;
use crate::base::units::ARCSEC;
use crate::plan::sip::{SIP_TERMS, Sip};
use crate::plan::wcs::{Wcs, east_north};
use align::{Alignment, Plane};
use glam::{DMat2, DVec2, DVec3};
use refine::refine;
use vote::Limits;

/// A source found on a frame: a point, or the middle of a trail.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Detection {
    /// Its place; centres of pixels lie at integers \[px\].
    pub at: DVec2,
    /// Its brightness, in any unit; only the order counts.
    pub flux: f64,
    /// Standard error of its place per axis \[px\]; where it is not finite and positive, the median of the others.
    pub sigma: f64,
}

/// How wrong the a-priori world coordinates may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Search {
    /// Largest offset of the frame's centre \[rad\], 0 to 10 deg.
    pub offset: f64,
    /// Largest rotation, either way \[rad\], 0 to pi. About a pole it is the turn of the camera on the sphere, not against the meridian.
    pub rotation: f64,
    /// Largest change of scale, either way, as a share: 0 to 0.3.
    pub scale: f64,
    /// By how much the optics may shift stars off a similarity of the a-priori map \[px\], 2 to 100.
    pub distortion_px: f64,
    /// Whether rows, columns or both may be stored the other way round: mirrored, or turned by half a turn.
    pub flipped: bool,
}

impl Default for Search {
    /// 0.5 deg, 5 deg, 2 per cent, 6 px, pixels stored as the header says.
    fn default() -> Self {
        Self {
            offset: 0.5_f64.to_radians(),
            rotation: 5.0_f64.to_radians(),
            scale: 0.02,
            distortion_px: 6.0,
            flipped: false,
        }
    }
}

impl Search {
    /// The first limit that is out of range.
    fn check(&self) -> Result<(), Refusal> {
        let pi = std::f64::consts::PI;
        let limits = [
            ("offset [rad]", self.offset, [0.0, 10f64.to_radians()]),
            ("rotation [rad]", self.rotation, [0.0, pi]),
            ("scale", self.scale, [0.0, 0.3]),
            ("distortion [px]", self.distortion_px, [2.0, 100.0]),
        ];
        checked("search", &limits)
    }
}

/// The first of some numbers that is not within its range.
fn checked(of: &'static str, numbers: &[(&'static str, f64, [f64; 2])]) -> Result<(), Refusal> {
    match numbers.iter().find(|(_, value, [low, high])| !(low..=high).contains(&value)) {
        Some(&(name, value, allowed)) => Err(Refusal::Range { of, name, value, allowed }),
        None => Ok(()),
    }
}

/// Most stars compared in the search of an alignment, the brightest in its reach; the refinement takes all.
const MOST_STARS: usize = 200_000;

/// Fewest pairs of a solution: two fix a similarity, three confirm it.
pub const FEWEST: usize = 5;

/// The world coordinates of a frame of `size` (columns, rows), from its detections, in any order, and the catalogue's stars, in any
/// order: all that may lie in the frame, its centre being wrong by as much as the search allows. Stars and detections
/// that are no finite numbers are passed over; stars without magnitude count as the faintest.
///
/// # Errors
/// Why there is no solution.
pub fn solve(
    detections: &[Detection],
    stars: &[FieldStar],
    prior: &Wcs,
    size: [usize; 2],
    search: &Search,
) -> Result<Solution, Refusal> {
    search.check()?;
    let frame = DVec2::new(size[0] as f64, size[1] as f64);
    let scale = prior.pixel_scale();
    let farthest = (prior.crpix / frame).abs().max_element();
    checked(
        "a-priori world coordinates",
        &[
            ("columns", frame.x, [16.0, 1e6]),
            ("rows", frame.y, [16.0, 1e6]),
            ("pixel scale [arcsec]", scale / ARCSEC, [1e-3, 3600.0]),
            ("reference pixel [sides of the frame]", farthest, [0.0, 20.0]),
            ("length of the centre's vector", prior.centre.length(), [0.999, 1.001]),
            ("half diagonal [rad]", 0.5 * frame.length() * scale, [0.0, 0.6]),
        ],
    )?;
    let detections = sound_detections(detections, frame);
    let stars = sound_stars(stars, prior, (frame.length() * (1.0 + farthest)) * scale * 1.3 + search.offset);
    let in_field = stars.iter().filter(|s| prior.pixel(s.1).is_some_and(|at| holds(frame, at, 0.0))).count();
    if detections.len() < FEWEST || stars.len() < FEWEST {
        let (detections, stars_near) = (detections.len(), stars.len());
        return Err(Refusal::TooFew { detections, stars_near, in_field, needed: FEWEST });
    }
    let flips: &[DVec2] = if search.flipped {
        &[DVec2::ONE, DVec2::new(-1.0, 1.0), DVec2::new(1.0, -1.0), DVec2::NEG_ONE]
    } else {
        &[DVec2::ONE]
    };
    let found: Vec<Detection> = detections.iter().map(|d| d.1).collect();
    let directions: Vec<DVec3> = stars.iter().map(|s| s.1).collect();
    let mut best: Option<Alignment> = None;
    for &flip in flips {
        let prior = flipped(prior, frame, flip);
        match align_plane(&found, &stars, &prior, frame, search, flips.len()) {
            Ok(alignment) => {
                let refined = refine(&found, &directions, &prior, &alignment, corners(frame))
                    .filter(|refined| refined.pairs.len() >= FEWEST)
                    .ok_or(Refusal::Lost { matched: alignment.evidence.matched, needed: FEWEST })?;
                return Ok(Solution::new(&detections, &stars, &prior, frame, flip, &alignment, &refined));
            }
            Err(tried) => {
                best = [best, tried]
                    .into_iter()
                    .flatten()
                    .min_by(|a, b| a.evidence.log10_false.total_cmp(&b.evidence.log10_false));
            }
        }
    }
    let evidence = best.map(|b| b.evidence);
    Err(Refusal::NotSignificant {
        detections: detections.len(),
        stars_near: stars.len(),
        in_field,
        matched: evidence.map_or(0, |e| e.matched),
        tried: evidence.map_or(0, |e| e.tried),
        by_chance: evidence.map_or(0.0, |e| e.by_chance),
        log10_false: evidence.map_or(f64::INFINITY, |e| e.log10_false),
        allowed: align::SIGNIFICANT,
    })
}

/// Detections with finite places in the frame or by a tenth outside, brightest first, with their places in the list.
fn sound_detections(detections: &[Detection], frame: DVec2) -> Vec<(usize, Detection)> {
    let usable = |sigma: f64| sigma.is_finite() && sigma > 0.0;
    let sigmas = detections.iter().map(|d| d.sigma).filter(|&s| usable(s)).collect();
    let typical = refine::median(sigmas).unwrap_or(0.1);
    let mut sound: Vec<(usize, Detection)> = detections
        .iter()
        .enumerate()
        .filter(|(_, d)| holds(frame, d.at, 0.1))
        .map(|(k, d)| (k, Detection { sigma: if usable(d.sigma) { d.sigma } else { typical }.max(1e-3), ..*d }))
        .collect();
    let brightness = |d: &Detection| if d.flux.is_nan() { f64::NEG_INFINITY } else { d.flux };
    sound.sort_by(|a, b| brightness(&b.1).total_cmp(&brightness(&a.1)).then(a.0.cmp(&b.0)));
    sound
}

/// Directions of the stars within `reach` \[rad\] of the reference place, brightest first, with their places in the list.
fn sound_stars(stars: &[FieldStar], prior: &Wcs, reach: f64) -> Vec<(usize, DVec3)> {
    let nearest = reach.min(1.3).cos();
    let mut sound: Vec<(usize, DVec3, f64)> = stars
        .iter()
        .enumerate()
        .map(|(k, s)| (k, s.direction.normalize_or_zero(), if s.mag_v.is_nan() { f64::INFINITY } else { s.mag_v }))
        .filter(|(_, direction, _)| direction.dot(prior.centre) >= nearest)
        .collect();
    sound.sort_by(|a, b| a.2.total_cmp(&b.2).then(a.0.cmp(&b.0)));
    sound.into_iter().map(|(k, direction, _)| (k, direction)).collect()
}

/// Whether a pixel lies in a frame or by at most this share of it outside.
fn holds(frame: DVec2, at: DVec2, share: f64) -> bool {
    let margin = share * frame + 0.5;
    at.cmpge(-margin).all() && at.cmple(frame - 1.0 + margin).all()
}

/// Corners of a frame \[px\].
fn corners(frame: DVec2) -> [DVec2; 4] {
    [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::ONE].map(|corner| corner * frame - 0.5)
}

/// World coordinates of the frame whose columns (x = -1) or rows (y = -1) are stored the other way round.
fn flipped(prior: &Wcs, frame: DVec2, flip: DVec2) -> Wcs {
    let crpix = DVec2::select(flip.cmplt(DVec2::ZERO), frame - 1.0 - prior.crpix, prior.crpix);
    let sip = prior.sip.map(|mut sip: Sip| {
        for (k, (i, j)) in SIP_TERMS.into_iter().enumerate() {
            let sign = flip.x.powi(i) * flip.y.powi(j);
            sip.a[k] *= sign * flip.x;
            sip.b[k] *= sign * flip.y;
        }
        sip
    });
    fit::about(prior.centre, crpix, prior.cd * DMat2::from_diagonal(flip), sip)
}

/// Aligns detections and stars in the plane of a-priori world coordinates.
fn align_plane(
    detections: &[Detection],
    stars: &[(usize, DVec3)],
    prior: &Wcs,
    frame: DVec2,
    search: &Search,
    planes: usize,
) -> Result<Alignment, Option<Alignment>> {
    let (east, north) = east_north(prior.centre);
    let scale = prior.pixel_scale();
    let in_plane = |pixel: DVec2| {
        let offset = pixel - prior.crpix;
        prior.cd * (offset + prior.sip.map_or(DVec2::ZERO, |sip| sip.shift(offset))) / scale
    };
    let centre = in_plane(0.5 * (frame - 1.0));
    let limits = Limits::new(search, scale, centre, 0.5 * frame.length());
    let reach = limits.reach * (1.0 + limits.scale) + limits.offset + 2.0 * limits.tolerance;
    let near: Vec<DVec2> = stars
        .iter()
        .map(|(_, star)| DVec2::new(star.dot(east), star.dot(north)) / (star.dot(prior.centre) * scale))
        .filter(|at| at.distance(centre) <= reach)
        .take(MOST_STARS)
        .collect();
    let places: Vec<DVec2> = detections.iter().map(|d| in_plane(d.at)).collect();
    let side = (frame.x * frame.y).sqrt();
    Plane { detections: &places, stars: &near, limits, side, log10_planes: (planes as f64).log10() }.align()
}
