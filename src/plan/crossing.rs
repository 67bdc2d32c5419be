//! Which objects of a catalogue cross the field while the shutter is open.
//!
//! Two things are asked in turn: whether an object's distance from the frame's centre allows it to reach the field within
//! the exposure at all, and if so, when its path enters and leaves the frame's rectangle, on the frame's own world
//! coordinates at each instant.

use super::PlanError;
use super::interval::{Interval, Margin, pieces};
use super::pace::Pace;
use super::place::{Motion, Place};
use super::planner::Planner;
use super::view::View;
use super::wcs::Wcs;
use crate::astro::separation;
use crate::astro::time::Instant;
use crate::base::table::Table;
use crate::base::units::ARCSEC_PER_RAD;
use glam::DVec2;

/// Shortest crossing that is surely found \[s\].
const LEAST_S: f64 = 1e-3;

/// An object in the field of one exposure.
#[derive(Debug, Clone)]
pub struct Crossing {
    /// Number of the exposure.
    pub frame: usize,
    /// Number of the object in the list given.
    pub object: usize,
    /// When it is in the field while the shutter is open; an instant where the exposure is one.
    pub interval: Interval,
    /// Where it enters and leaves the field, or is at opening and closing \[px\].
    pub pixels: [DVec2; 2],
    /// Its place in the middle of the crossing.
    pub place: Place,
    /// Share of the Sun's light that reaches it then.
    pub sunlit: f64,
    /// Angle Sun - object - observer then \[rad\].
    pub phase: f64,
    /// Its motion among the stars \[rad/s\].
    pub rate: f64,
}

/// The objects that cross the field of an exposure. `paces` bounds the speed of each object.
///
/// # Errors
/// [`PlanError`] where the Earth's orientation is unknown.
pub fn crossings(
    planner: &Planner,
    view: &View,
    objects: &[Motion],
    paces: &[Pace],
    size: [usize; 2],
) -> Result<Vec<Crossing>, PlanError> {
    let wcs = &view.wcs.mid;
    let (width, height) = (size[0] as f64, size[1] as f64);
    let corners = [(0.0, 0.0), (width, 0.0), (0.0, height), (width, height)];
    let radius = corners
        .map(|(x, y)| separation(wcs.sky(DVec2::new(x, y) - 0.5), wcs.centre))
        .into_iter()
        .fold(0.0, f64::max);
    let tracked = separation(view.wcs.start.centre, view.wcs.end.centre);
    let mut found = Vec::new();
    for (number, (motion, pace)) in objects.iter().zip(paces).enumerate() {
        let Ok(place) = motion.place_from(&view.observer, &view.mid) else { continue };
        let beyond = separation(place.astrometric, wcs.centre) - radius - tracked;
        if beyond > 0.0 && pace.safe_s(beyond, place.range_m) > 0.5 * view.exposure_s {
            continue;
        }
        for interval in inside(planner, view, motion, pace, [width, height], wcs.pixel_scale())? {
            let middle = interval.start.plus(0.5 * interval.seconds());
            let observer = planner.observer(&middle)?;
            let Ok(place) = motion.place_from(&observer, &middle) else { continue };
            let light = place.illumination(&observer);
            let at = |t: &Instant| pixel(planner, view, motion, t);
            let (Some(enters), Some(leaves)) = (at(&interval.start)?, at(&interval.end)?) else { continue };
            let later = middle.plus(0.1);
            let moved = motion.place_from(&planner.observer(&later)?, &later).map(|p| p.astrometric);
            let rate = moved.map_or(f64::NAN, |m| separation(m, place.astrometric) / 0.1);
            found.push(Crossing {
                frame: view.frame,
                object: number,
                interval,
                pixels: [enters, leaves],
                place,
                sunlit: light.sunlit,
                phase: light.phase,
                rate,
            });
        }
    }
    Ok(found)
}

/// When an object lies within the frame.
fn inside(
    planner: &Planner,
    view: &View,
    motion: &Motion,
    pace: &Pace,
    [width, height]: [f64; 2],
    scale: f64,
) -> Result<Vec<Interval>, PlanError> {
    let tracked = separation(view.wcs.start.centre, view.wcs.end.centre) / view.exposure_s.max(LEAST_S);
    let margin = |t: &Instant| -> Result<Margin, PlanError> {
        let observer = planner.observer(t)?;
        let Ok(place) = motion.place_from(&observer, t) else {
            return Ok(Margin { value: f64::NAN, safe_s: 600.0 });
        };
        let Some(p) = wcs_at(planner, view, t)?.pixel(place.astrometric) else {
            return Ok(Margin { value: -1.0, safe_s: pace.safe_s(0.5, place.range_m) });
        };
        let value = (p.x + 0.5).min(width - 0.5 - p.x).min(p.y + 0.5).min(height - 0.5 - p.y);
        // the camera turns and bends the field by less than a hundredth of the motion
        let angle = (value.abs() * scale / 1.01).min(0.5);
        let safe_s = 1.0 / (1.0 / pace.safe_s(angle, place.range_m) + tracked / angle);
        Ok(Margin { value, safe_s })
    };
    if view.exposure_s <= 0.0 {
        let now = Interval { start: view.mid, end: view.mid };
        return Ok(if margin(&view.mid)?.value >= 0.0 { vec![now] } else { Vec::new() });
    }
    let exposure = Interval { start: view.start, end: view.end };
    let cut = pieces(exposure, LEAST_S, margin)?;
    Ok(cut.into_iter().filter_map(|(interval, holds)| holds.then_some(interval)).collect())
}

fn pixel(planner: &Planner, view: &View, motion: &Motion, t: &Instant) -> Result<Option<DVec2>, PlanError> {
    let Ok(place) = motion.place_from(&planner.observer(t)?, t) else { return Ok(None) };
    Ok(wcs_at(planner, view, t)?.pixel(place.astrometric))
}

fn wcs_at(planner: &Planner, view: &View, t: &Instant) -> Result<Wcs, PlanError> {
    Ok(if *t == view.mid { view.wcs.mid } else { planner.wcs_at(view, t)? })
}

/// The crossings as a table, with the objects' names and catalogue numbers and the age of their elements \[d\].
pub fn table(crossings: &[Crossing], describe: &dyn Fn(usize) -> (String, u64, f64), views: &[View]) -> Table {
    let told = crossings.iter().map(|c| describe(c.object)).collect::<Vec<_>>();
    let mut table = Table::default();
    let frame_time = |c: &Crossing| {
        // in the order of their frames
        let at = views.binary_search_by_key(&c.frame, |v| v.frame);
        at.map_or_else(|_| String::new(), |at| views[at].mid.iso_utc())
    };
    table.ints("frame", crossings.iter().map(|c| c.frame as i64));
    table.texts("time_utc", crossings.iter().map(frame_time));
    table.texts("target", told.iter().map(|t| t.0.clone()));
    table.ints("catalog_number", told.iter().map(|t| t.1 as i64));
    table.texts("enter_utc", crossings.iter().map(|c| c.interval.start.iso_utc()));
    table.texts("leave_utc", crossings.iter().map(|c| c.interval.end.iso_utc()));
    table.floats("x_enter_px", "pix", crossings.iter().map(|c| c.pixels[0].x));
    table.floats("y_enter_px", "pix", crossings.iter().map(|c| c.pixels[0].y));
    table.floats("x_leave_px", "pix", crossings.iter().map(|c| c.pixels[1].x));
    table.floats("y_leave_px", "pix", crossings.iter().map(|c| c.pixels[1].y));
    let angles = |c: &Crossing| crate::astro::angles(c.place.astrometric);
    table.floats("ra_deg", "deg", crossings.iter().map(|c| angles(c).0.to_degrees()));
    table.floats("dec_deg", "deg", crossings.iter().map(|c| angles(c).1.to_degrees()));
    table.floats("range_km", "km", crossings.iter().map(|c| c.place.range_m / 1e3));
    table.floats("rate_arcsec_s", "arcsec / s", crossings.iter().map(|c| c.rate * ARCSEC_PER_RAD));
    table.floats("phase_deg", "deg", crossings.iter().map(|c| c.phase.to_degrees()));
    table.floats("sunlit", "", crossings.iter().map(|c| c.sunlit));
    table.floats("element_age_d", "d", told.iter().map(|t| t.2));
    table
}
