//! Frames ready to measure: read, calibrated, and with world coordinates that stars have confirmed or made, their own or those of
//! the nearest frame in time that has enough of them.

use super::RunError;
use super::job::Job;
use crate::astro::time::Instant;
use crate::base::units::{ARCSEC, mag_from_flux};
use crate::io::image::Image;
use crate::light::colour::StarLight;
use crate::photometry::astrometry::{Borrowed, Refusal, Solution, borrow};
use crate::photometry::header::{Note, NoteKind, Overrides};
use crate::photometry::solve::{self, Solved};
use crate::photometry::{FieldStar, Frame, PhotometryError, Place};
use crate::plan::wcs::Wcs;
use crate::stars::catalogue::{Catalogue, moved};
use glam::DVec2;
use std::path::Path;

/// How far the pointing of a mount strays from frame to frame where nothing tells \[rad\].
const STRAY: f64 = 5.0 * ARCSEC;

/// What is known of where a frame looks.
pub(super) struct Standing {
    time: Instant,
    /// World coordinates of the header.
    header: Wcs,
    /// Those of the stars.
    pub solution: Option<Solution>,
    /// Whether they differ from the header's.
    moved: bool,
}

/// A frame ready to measure.
pub(super) struct Ready {
    /// The frame.
    pub frame: Frame,
    /// The catalogue's stars in it.
    pub stars: Vec<FieldStar>,
    /// Where it looks.
    pub standing: Standing,
}

/// A frame; one whose header does not tell where it looks is taken to look at the place given.
fn read(path: &Path, job: &Job) -> Result<(Frame, Vec<Note>), RunError> {
    let read = |overrides: &Overrides| -> Result<_, RunError> {
        Ok(Frame::read(Image::read(path)?, overrides, job.masters.as_ref())?)
    };
    match (read(&job.overrides), job.place) {
        (Err(RunError::Photometry(PhotometryError::Missing { .. })), Place::Sky(sky)) => {
            let (ra, dec) = crate::astro::angles(sky);
            let pointing_deg = Some([ra.to_degrees(), dec.to_degrees()]);
            read(&Overrides { pointing_deg, ..job.overrides.clone() })
        }
        (other, _) => other,
    }
}

/// A frame with its world coordinates, and the catalogue's stars in it. `told`: remarks are passed on.
pub(super) fn ready(path: &Path, job: &Job, light: &StarLight, told: bool) -> Result<Ready, RunError> {
    let (mut frame, notes) = read(path, job)?;
    let header = frame.wcs;
    let mut stars = field_stars(&frame, job.catalogue, light, 0.0);
    let mut solved = solve::check(&mut frame, &stars, &job.settings);
    if solved.is_err() && worth_searching(&frame, &stars) {
        let wide = field_stars(&frame, job.catalogue, light, SEARCH_MARGIN);
        solved = solve::search(&mut frame, &wide);
        stars = field_stars(&frame, job.catalogue, light, 0.0);
    }
    if told {
        for note in notes {
            let warning = matches!(note.kind, NoteKind::Contradictory | NoteKind::Refused);
            (job.told)(path, &note.to_string(), warning);
        }
        (job.told)(path, &in_words(&solved), frame.approximate);
    }
    let moved = matches!(solved, Ok(Solved::Stars(_)));
    let solution = solved.ok().map(|s| s.solution().clone());
    let standing = Standing { time: frame.time, header, solution, moved };
    Ok(Ready { frame, stars, standing })
}

/// A frame whose own stars tell nothing, with world coordinates borrowed from the frame nearest in time whose stars do, if
/// these found that one's header wrong; none if it is as its header says, or known by its own stars.
///
/// # Errors
/// [`RunError`] for a frame that cannot be read.
pub(super) fn lent(
    path: &Path,
    number: usize,
    standings: &[Standing],
    job: &Job,
    light: &StarLight,
) -> Result<Option<(Frame, Vec<FieldStar>)>, RunError> {
    let Some(one) = standings.get(number).filter(|s| s.solution.is_none()) else { return Ok(None) };
    let Some((lender, borrowed)) = borrowed(one, standings) else {
        if standings.iter().any(|s| s.solution.is_some() && !s.moved) {
            let what = "world coordinates of the header, as the stars of other frames confirm theirs";
            (job.told)(path, what, false);
        }
        return Ok(None);
    };
    let (mut frame, _) = read(path, job)?;
    let from = job.frames.get(lender).map(|p| p.display().to_string()).unwrap_or_default();
    let (error, minutes) = (borrowed.error / ARCSEC, standings[lender].time.since(&frame.time) / 60.0);
    let what = format!(
        "world coordinates borrowed from {from}, {:.1} min {}, good to {error:.1} arcsec",
        minutes.abs(),
        if minutes > 0.0 { "later" } else { "earlier" }
    );
    (job.told)(path, &what, true);
    frame.wcs = borrowed.wcs;
    frame.approximate = false;
    let stars = field_stars(&frame, job.catalogue, light, 0.0);
    Ok(Some((frame, stars)))
}

/// What the nearest frame with a solution of its own lends, and its number.
fn borrowed(one: &Standing, standings: &[Standing]) -> Option<(usize, Borrowed)> {
    let away = |s: &Standing| s.time.since(&one.time).abs();
    let mut lenders = standings.iter().enumerate().filter(|(_, s)| s.solution.is_some()).collect::<Vec<_>>();
    lenders.sort_by(|a, b| away(a.1).total_cmp(&away(b.1)));
    let (number, nearest) = lenders.first().filter(|(_, s)| s.moved)?;
    let solution = nearest.solution.as_ref()?;
    // what the nearest would have lent to the next one tells how far the mount strays between frames
    let strayed = lenders.get(1).and_then(|(_, next)| {
        let known = next.solution.as_ref()?;
        let lent = borrow(solution, &nearest.header, &next.header, STRAY).ok()?;
        Some(lent.wcs.sky(known.wcs.crpix).distance(known.wcs.centre))
    });
    borrow(solution, &nearest.header, &one.header, strayed.unwrap_or(STRAY)).ok().map(|b| (*number, b))
}

/// Catalogue stars that can be on the frame or within `margin` \[rad\] of it, at their places of its time. Magnitudes are those of sunlight that gives as many
/// electrons, the light curve's own scale.
pub fn field_stars(frame: &Frame, catalogue: &Catalogue, light: &StarLight, margin: f64) -> Vec<FieldStar> {
    let size = DVec2::new(frame.width as f64, frame.height as f64);
    let centre = frame.wcs.sky((size - 1.0) / 2.0);
    let radius = [DVec2::ZERO, size, DVec2::new(size.x, 0.0), DVec2::new(0.0, size.y)]
        .map(|corner| crate::astro::separation(frame.wcs.sky(corner), centre))
        .into_iter()
        .fold(0.0, f64::max);
    let years = frame.time.julian_year() - catalogue.epoch();
    let star = |s: &crate::stars::catalogue::CatalogueStar| {
        let colour = light.at(s.colour_bv, TYPICAL_AIRMASS) / light.solar().at(TYPICAL_AIRMASS);
        FieldStar {
            direction: moved(s, years),
            mag_v: s.mag_v + mag_from_flux(colour),
            colour_bv: s.colour_bv.unwrap_or(f64::NAN),
        }
    };
    catalogue.cone(centre, 1.1 * radius + margin, f64::INFINITY).iter().map(star).collect()
}

/// How far beyond the field stars are taken where the pointing is in doubt \[rad\].
const SEARCH_MARGIN: f64 = 0.0105;
/// Fewer catalogue stars in the field do not make it known among others.
const FEWEST_STARS: usize = 8;

/// True if the field holds enough stars to be recognised by them.
fn worth_searching(frame: &Frame, stars: &[FieldStar]) -> bool {
    let inside = |s: &&FieldStar| frame.wcs.pixel(s.direction).is_some_and(|p| frame.holds(p, 0.0));
    stars.iter().filter(inside).count() >= FEWEST_STARS
}

/// Airmass of the colour term: it changes by a few thousandths of a magnitude an airmass.
const TYPICAL_AIRMASS: f64 = 1.3;

/// What the stars say of a frame's world coordinates, in words.
fn in_words(solved: &Result<Solved, Refusal>) -> String {
    match solved {
        Ok(solved) => {
            let whose = if matches!(solved, Solved::Stars(_)) { "found by" } else { "confirmed by" };
            let s = solved.solution();
            let (stars, median) = (s.matches.len(), s.median_residual);
            format!("world coordinates {whose} {stars} stars, median residual {:.3}, {:.3} px", median.x, median.y)
        }
        Err(why) => format!("world coordinates of the header: {why}"),
    }
}
