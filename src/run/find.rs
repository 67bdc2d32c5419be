//! Unknown objects in a series of frames: everything that is no star, linked from frame to frame.
//!
//! Places count from the middle of each frame, in its own tangent plane: an object that moves as the telescope does stands still.
//! In three frames or more an object must be seen along a steady motion, and chance makes fewer than [`FALSE_TRACKS`] such tracks; of one
//! or two frames each detection counts by itself, with 0.1 false ones expected a frame.

use super::RunError;
use super::job::{Job, Object};
use super::lightcurve::star_light;
use super::pointing::{Ready, ready};
use crate::base::units::ARCSEC;
use crate::photometry::detection::{
    DetectionError, FrameDetections, LinkSettings, SkyDetection, Source, Track, link,
};
use crate::photometry::field::{self, FieldStar};
use crate::photometry::frame::Frame;
use crate::photometry::solve::whole;
use glam::{DVec2, DVec3};
use rayon::prelude::*;

/// False tracks expected of a whole series.
pub const FALSE_TRACKS: f64 = 0.1;
/// Fewer frames link nothing.
const FEWEST_FRAMES: usize = 3;
/// Star trails shorter than this are points \[px\].
const SHORT_PX: f64 = 2.0;
/// Detections this near a catalogue star's image are the star \[px\].
const STAR_PX: f64 = 3.0;
/// Largest rate against the frame \[arcsec/s\].
const LARGEST_RATE: f64 = 20.0;
/// A track is a star's if its rate is theirs to this share.
const STARS_RATE: f64 = 0.02;
/// Most objects.
const MOST: usize = 50;

/// What is found in one frame.
struct Sheet {
    frame: Frame,
    found: Vec<Source>,
}

impl Sheet {
    fn middle(&self) -> DVec2 {
        (DVec2::new(self.frame.width as f64, self.frame.height as f64) - 1.0) / 2.0
    }

    /// From the middle of the frame \[arcsec\].
    fn plane(&self, pixel: DVec2) -> DVec2 {
        self.frame.wcs.cd * (pixel - self.middle()) / ARCSEC
    }

    fn sky(&self, plane: DVec2) -> Option<DVec3> {
        let pixel = self.frame.wcs.cd.inverse() * (plane * ARCSEC) + self.middle();
        (pixel.is_finite() && self.frame.holds(pixel, 0.0)).then(|| self.frame.wcs.sky(pixel))
    }
}

/// The objects in a job's frames, the surest first.
///
/// # Errors
/// [`RunError`] for frames that cannot be read or searched.
pub fn objects(job: &Job) -> Result<Vec<Object>, RunError> {
    let light = star_light(job)?;
    let sheets = job.frames.par_iter().map(|path| {
        let Ready { mut frame, stars, .. } = ready(path, job, &light, false)?;
        let found =
            strangers(&frame, &stars).map_err(|fault| RunError::Usage(format!("{}: {fault}", path.display())))?;
        // only the header is needed from here on
        frame.data = Vec::new();
        Ok(Sheet { frame, found })
    });
    let sheets = sheets.collect::<Result<Vec<_>, RunError>>()?;
    if sheets.len() < FEWEST_FRAMES {
        return Ok(singles(&sheets));
    }
    let origin = sheets[0].frame.time;
    let times = sheets.iter().map(|s| s.frame.time.since(&origin)).collect::<Vec<_>>();
    let scale = |sheet: &Sheet| sheet.frame.wcs.pixel_scale() / ARCSEC;
    let detections = sheets.iter().zip(&times).map(|(sheet, time_s)| {
        let one = |s: &Source| SkyDetection {
            place: sheet.plane(s.place),
            sigma: s.place_sigma[0].max(s.place_sigma[1]).max(0.1) * scale(sheet),
        };
        let area = (sheet.frame.width * sheet.frame.height) as f64 * scale(sheet).powi(2);
        FrameDetections { time_s: *time_s, area, detections: sheet.found.iter().map(one).collect() }
    });
    let detections = detections.collect::<Vec<_>>();
    let (first, last) = times.iter().fold((f64::MAX, f64::MIN), |(a, b), t| (a.min(*t), b.max(*t)));
    let gap = (last - first).max(1.0) / (sheets.len() - 1) as f64;
    let field = sheets[0].frame.width.max(sheets[0].frame.height) as f64 * scale(&sheets[0]);
    let largest_rate = (0.25 * field / gap).min(LARGEST_RATE);
    let settings = LinkSettings {
        rate: DVec2::ZERO,
        largest_rate,
        largest_acceleration: largest_rate / (last - first).max(1.0),
        false_tracks: FALSE_TRACKS,
    };
    let linked = link(&detections, &settings).map_err(|fault| RunError::Usage(format!("linking: {fault}")))?;
    // what moves as the stars do is a star that no catalogue lists
    let stars = -sheets.iter().map(|s| s.frame.track_rad_s).sum::<DVec2>() / (sheets.len() as f64 * ARCSEC);
    let moves = |t: &&Track| (t.rate - stars).length() > (5.0 * t.rate_sigma).max(STARS_RATE * stars.length());
    let object = |(k, track): (usize, &Track)| {
        let place = |(sheet, time_s): (&Sheet, &f64)| sheet.sky(at(track, *time_s));
        let places = sheets.iter().zip(&times).map(place).collect();
        Object { name: format!("object-{}", k + 1), places, seen: track.members.len() }
    };
    Ok(linked.tracks.iter().filter(moves).take(MOST).enumerate().map(object).collect())
}

/// Where a track is at a time \[arcsec\].
fn at(track: &Track, time_s: f64) -> DVec2 {
    let t = time_s - track.epoch_s;
    track.place + track.rate * t + track.acceleration * (0.5 * t * t)
}

/// Sources that are no stars: of another trail than theirs, or without a catalogue star where they are.
fn strangers(frame: &Frame, stars: &[FieldStar]) -> Result<Vec<Source>, DetectionError> {
    let half = frame.star_half();
    let trailed = half.length() >= SHORT_PX / 2.0;
    let found = whole(frame, half, if trailed { &[DVec2::ZERO] } else { &[] })?;
    let tracks = field::tracks(frame, stars, frame.expected_fwhm_px());
    let unknown = |s: &Source| !tracks.iter().any(|t| (t.segment.centre - s.place).length() < STAR_PX);
    let list = if trailed { found.others } else { found.stars };
    Ok(list.into_iter().filter(|s| !s.edge && (trailed || unknown(s))).collect())
}

/// Each detection an object of its own.
fn singles(sheets: &[Sheet]) -> Vec<Object> {
    let mut objects = Vec::new();
    for (k, sheet) in sheets.iter().enumerate() {
        for source in sheet.found.iter().take(MOST) {
            let mut places = vec![None; sheets.len()];
            places[k] = Some(sheet.frame.wcs.sky(source.place));
            objects.push(Object { name: format!("object-{}", objects.len() + 1), places, seen: 1 });
        }
    }
    objects
}
