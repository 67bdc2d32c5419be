//! Where a frame looks, by its stars.
//!
//! The header's world coordinates are checked against the stars that stand where they predict them, up to a common shift
//! ([`super::detect::common_shift`]); that takes a few milliseconds. Only if this tells nothing, or if the header's are rough, is
//! the whole frame searched for sources, and the field recognised among the catalogue's ([`super::astrometry`]).

use super::Settings;
use super::astrometry::{self, Detection, Refusal, Search, Solution};
use super::calibrate;
use super::centroid;
use super::detection::{self, DetectionError, Plane, Source, Sources};
use super::field::{self, FieldStar};
use super::frame::Frame;
use super::saturated;
use super::segment::Segment;
use super::single;
use glam::DVec2;
use rayon::prelude::*;

/// Most stars that the quick check centres.
const CHECK_STARS: usize = 80;
/// Most detections that a field is recognised by.
const MOST_DETECTIONS: usize = 3000;
/// Least signal-to-noise ratio of a star that is centred.
const CHECK_SNR: f64 = 8.0;
/// The header's world coordinates are kept where the stars' differ by no more of their own errors.
const AGREES_SIGMA: f64 = 4.0;
/// Ends of trails that are off by more make a second search worth its time \[px\].
const TURNED_PX: f64 = 0.1;
/// What a map may be off by without harm \[px\].
const AGREES_PX: f64 = 0.1;

/// How a frame's world coordinates came about.
#[derive(Debug, Clone, PartialEq)]
pub enum Solved {
    /// The header's, which the stars confirm.
    Confirmed(Box<Solution>),
    /// Those of the stars.
    Stars(Box<Solution>),
}

impl Solved {
    /// What the stars say.
    pub fn solution(&self) -> &Solution {
        match self {
            Self::Confirmed(solution) | Self::Stars(solution) => solution,
        }
    }
}

/// Checks a frame's world coordinates by its stars, and replaces them where the stars say otherwise.
///
/// # Errors
/// Why the stars tell nothing.
pub fn check(frame: &mut Frame, stars: &[FieldStar], settings: &Settings) -> Result<Solved, Refusal> {
    let fwhm = frame.expected_fwhm_px();
    let detections = centred(frame, stars, fwhm, settings);
    // what the common shift did not find is no business of the quick check
    let reach = (settings.search_px.clamp(1.0, 100.0) + 5.0) * frame.wcs.pixel_scale();
    let search = Search { offset: reach, rotation: 0.02, scale: 0.005, ..Search::default() };
    let solution = astrometry::solve(&detections, stars, &frame.wcs, [frame.width, frame.height], &search)?;
    Ok(adopt(frame, solution))
}

/// Finds a frame's world coordinates by the stars found in all of it: pointings off by up to half a degree, turned by up to 5 deg,
/// scaled by up to 2 %, or mirrored if the header leaves that open. `stars` are those around the field too.
///
/// # Errors
/// Why there is no solution, with the counts.
pub fn search(frame: &mut Frame, stars: &[FieldStar]) -> Result<Solved, Refusal> {
    let (header, size) = (frame.wcs, [frame.width, frame.height]);
    let search = Search { flipped: frame.approximate, ..Search::default() };
    let solve =
        |frame: &Frame| astrometry::solve(&detections(frame).unwrap_or_default(), stars, &header, size, &search);
    let mut solution = solve(frame)?;
    // trails that were taken to run another way were badly centred
    let assumed = frame.star_half();
    frame.wcs = solution.wcs;
    let true_half = frame.star_half();
    if (true_half - assumed).length().min((true_half + assumed).length()) > TURNED_PX {
        solution = solve(frame).unwrap_or(solution);
    }
    frame.wcs = header;
    Ok(adopt(frame, solution))
}

/// Everything in a frame that drew the stars' trail, the most significant first.
fn detections(frame: &Frame) -> Result<Vec<Detection>, DetectionError> {
    let found = whole(frame, frame.star_half(), &[])?.stars;
    let usable = found.iter().filter(|s| !s.edge).take(MOST_DETECTIONS).collect::<Vec<_>>();
    let fwhm = frame.expected_fwhm_px();
    let image = saturated::image(fwhm);
    let sigma = |along: f64, across: f64| (along.hypot(across) / std::f64::consts::SQRT_2).max(0.02);
    let placed = |s: &&Source| {
        let by_wings = || saturated::place(frame, &image, &Segment { centre: s.place, half: s.half }, fwhm);
        let (at, sigma) = match Some(s).filter(|s| s.saturated).and_then(|_| by_wings()) {
            Some(placed) => (placed.centre, sigma(placed.sigma.x, placed.sigma.y)),
            None => (s.place, sigma(s.place_sigma[0], s.place_sigma[1])),
        };
        Detection { at, flux: s.flux, sigma }
    };
    Ok(usable.par_iter().map(placed).collect())
}

/// Sources of a whole frame: those that drew the stars' trail, and those that drew others.
///
/// # Errors
/// [`DetectionError`] for trails or images beyond what can be searched.
pub fn whole(frame: &Frame, star_half: DVec2, other_halves: &[DVec2]) -> Result<Sources, DetectionError> {
    let settings = detection::Settings {
        fwhm_px: frame.expected_fwhm_px(),
        saturate: frame.saturate_adu,
        ..detection::Settings::default()
    };
    detection::sources(Plane::new(frame.width, frame.height, &frame.data)?, star_half, other_halves, &settings)
}

/// Takes a solution, unless the header's agrees with it.
pub fn adopt(frame: &mut Frame, solution: Solution) -> Solved {
    let size = DVec2::new(frame.width as f64, frame.height as f64);
    let centre = (size - 1.0) / 2.0;
    let off = |at: DVec2, error: f64| {
        let there = solution.wcs.sky(at);
        let moved = frame.wcs.pixel(there).map_or(f64::INFINITY, |p| (p - at).length());
        moved > (AGREES_SIGMA * error).max(AGREES_PX)
    };
    let corners = [DVec2::ZERO, size - 1.0, DVec2::new(size.x - 1.0, 0.0), DVec2::new(0.0, size.y - 1.0)];
    let differs = off(centre, solution.error_at_reference)
        || corners.into_iter().any(|corner| off(corner, solution.error_in_corner));
    frame.solved = true;
    if frame.approximate || differs {
        frame.wcs = solution.wcs;
        frame.approximate = false;
        Solved::Stars(Box::new(solution))
    } else {
        Solved::Confirmed(Box::new(solution))
    }
}

/// Lonely bright stars, centred where they are.
fn centred(frame: &Frame, stars: &[FieldStar], fwhm: f64, settings: &Settings) -> Vec<Detection> {
    let tracks = field::tracks(frame, stars, fwhm);
    let (tracks, _) = calibrate::shifted(frame, tracks, fwhm, settings);
    let nowhere = Segment::point(DVec2::splat(-1e6));
    let lonely = field::alone(frame, &tracks, &nowhere, 2.0 * fwhm, 4.0 * fwhm);
    let centred = |&index: &usize| {
        let segment = tracks[index].segment;
        let beside = field::around(&tracks, &segment, 10.0 * fwhm, Some(index));
        let look = single::look(frame, &segment, fwhm, &beside);
        if look.saturated || look.snr.is_nan() || look.snr < CHECK_SNR {
            return None;
        }
        let at = centroid::windowed(frame, &segment, fwhm, look.background_adu, 2.0 * fwhm + 3.0)?;
        // a trail's middle is known across it as a point's is, and along it by its ends
        let along = fwhm.hypot(segment.length() * 0.5);
        let sigma = (fwhm / 2.355).hypot(along / 2.355) / std::f64::consts::SQRT_2 / look.snr;
        Some(Detection { at, flux: look.light_e, sigma: sigma.max(0.01) })
    };
    lonely.par_iter().take(CHECK_STARS).filter_map(centred).collect()
}
