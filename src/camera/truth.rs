//! What was put into a frame: truth of the targets, table of the stars.
//!
//! The signal-to-noise ratio is the information limit at the known place: with pixel shares p and variances v, flux
//! and local background unknown, the Cramer-Rao variance of the flux is B / (A B - C^2) with A = sum p^2/v,
//! B = sum 1/v, C = sum p/v over the stamp.

use super::detector::convert::Converter;
use super::expose;
use super::point_source::PointSource;
use super::region::Region;
use super::scenery::Scenery;
use crate::astro::angles;
use crate::base::table::{Table, Values};
use crate::plan::view::View;
use crate::scene::Scene;
use glam::DVec2;

/// Rows of a band in which a target's surroundings are summed.
const BAND_ROWS: usize = 64;

/// Truth of one target in one exposure.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// Number of the frame.
    pub frame: usize,
    /// Middle of the exposure, ISO 8601.
    pub time_utc: String,
    /// Name of the target.
    pub target: String,
    /// Place at mid-exposure, opening and closing \[px\]; 0 at the centre of the first stored pixel.
    pub places: [DVec2; 3],
    /// Electrons over an endless plane, scintillation included.
    pub electrons: f64,
    /// Johnson V outside the atmosphere; NaN in the umbra.
    pub mag_v: f64,
    /// Signal-to-noise ratio at the information limit; NaN where the sky is outside its models.
    pub snr: f64,
    /// Everything above bias but the target itself, at its place \[e-/px\]; NaN off the frame or where the sky is
    /// outside its models.
    pub background_e_px: f64,
    /// True if a pixel's mean reaches saturation.
    pub saturated: bool,
}

/// The truth of all targets of an exposure of which the pixels `stored` are kept.
pub fn of(scene: &Scene, view: &View, scenery: &Scenery, stored: &Region) -> Vec<Truth> {
    let corner = corner(stored);
    let truth = |(index, target)| {
        let mut truth = one(scene, view, scenery, index, target);
        truth.places = truth.places.map(|place| place - corner);
        truth
    };
    scenery.targets.iter().enumerate().map(truth).collect()
}

/// The place in the whole frame of the first stored pixel.
fn corner(stored: &Region) -> DVec2 {
    DVec2::new(stored.x0 as f64, stored.y0 as f64)
}

fn one(scene: &Scene, view: &View, scenery: &Scenery, index: usize, target: &PointSource) -> Truth {
    let path = target.path;
    let (low, high) = path.bounds();
    let margin = 0.5 * (high - low).max_element() + scenery.psf.radius().max(15) as f64;
    let size = scene.detector.light_px();
    let region = Region::around((low + high) / 2.0, margin, size);
    let detector = &scene.detector;
    let full = Converter::of(detector).saturation_e(detector.stored_full_well_e());
    let mut truth = Truth {
        frame: view.frame,
        time_utc: view.mid.iso_utc(),
        target: scene.target.get(index).map_or_else(String::new, |t| t.name.clone()),
        places: [path.mid, path.start, path.end],
        electrons: target.electrons,
        mag_v: target.mag_v,
        snr: 0.0,
        background_e_px: f64::NAN,
        saturated: false,
    };
    let Some(region) = region else { return truth };
    let floor = expose::floor(detector);
    let place = (path.mid.x.round(), path.mid.y.round());
    let (mut a, mut b, mut c) = (0.0, 0.0, 0.0);
    for first in (0..region.height).step_by(BAND_ROWS) {
        let height = BAND_ROWS.min(region.height - first);
        let band = Region { y0: region.y0 + first, height, ..region };
        let (mut share, mut background) = (vec![0.0; band.len()], vec![0.0; band.len()]);
        scenery.add_target(index, 1.0, &band, &mut share);
        scenery.evenness.apply(&band, &mut share);
        scenery.mean_without(&band, index, &mut background);
        for (i, (p, rest)) in share.iter().zip(&background).enumerate() {
            let mean = p * target.electrons + rest;
            let variance = mean + floor;
            a += p * p / variance;
            b += 1.0 / variance;
            c += p / variance;
            truth.saturated |= mean >= full;
            if place == ((band.x0 + i % band.width) as f64, (band.y0 + i / band.width) as f64) {
                truth.background_e_px = *rest;
            }
        }
    }
    let information = a - c * c / b;
    if scenery.sky_is_unknown() {
        (truth.snr, truth.background_e_px) = (f64::NAN, f64::NAN);
        return truth;
    }
    if information > 0.0 {
        truth.snr = target.electrons * information.sqrt();
    }
    truth
}

/// The truths as a table; columns, units and meaning are those of `truth.ecsv`.
pub fn table(rows: &[Truth]) -> Table {
    let mut table = Table::default();
    table.ints("frame", rows.iter().map(|r| r.frame as i64));
    table.texts("time_utc", rows.iter().map(|r| r.time_utc.clone()));
    table.texts("target", rows.iter().map(|r| r.target.clone()));
    for (k, [x, y]) in
        [["x_px", "y_px"], ["x_start_px", "y_start_px"], ["x_end_px", "y_end_px"]].into_iter().enumerate()
    {
        table.floats(x, "pix", rows.iter().map(|r| r.places[k].x));
        table.floats(y, "pix", rows.iter().map(|r| r.places[k].y));
    }
    table.floats("electrons", "electron", rows.iter().map(|r| r.electrons));
    table.floats("mag_v", "mag", rows.iter().map(|r| r.mag_v));
    table.floats("snr", "", rows.iter().map(|r| r.snr));
    table.floats("background_e_px", "electron / pix", rows.iter().map(|r| r.background_e_px));
    table.column("saturated", "", Values::Bool(rows.iter().map(|r| r.saturated).collect()));
    table
}

/// The drawn stars of a frame as a table; columns and units are those of `stars_NNNN.ecsv`.
pub fn star_table(frame: usize, stars: &[PointSource], stored: &Region) -> Table {
    let mut table = Table::default();
    let corner = corner(stored);
    let place = |s: &PointSource| angles(s.icrs);
    table.ints("frame", stars.iter().map(|_| frame as i64));
    table.ints("star", stars.iter().map(|s| s.id as i64));
    table.floats("ra_deg", "deg", stars.iter().map(|s| place(s).0.to_degrees()));
    table.floats("dec_deg", "deg", stars.iter().map(|s| place(s).1.to_degrees()));
    table.floats("mag_v", "mag", stars.iter().map(|s| s.mag_v));
    table.floats("x_px", "pix", stars.iter().map(|s| s.path.mid.x - corner.x));
    table.floats("y_px", "pix", stars.iter().map(|s| s.path.mid.y - corner.y));
    table.floats("x_start_px", "pix", stars.iter().map(|s| s.path.start.x - corner.x));
    table.floats("y_start_px", "pix", stars.iter().map(|s| s.path.start.y - corner.y));
    table.floats("x_end_px", "pix", stars.iter().map(|s| s.path.end.x - corner.x));
    table.floats("y_end_px", "pix", stars.iter().map(|s| s.path.end.y - corner.y));
    table.floats("electrons", "electron", stars.iter().map(|s| s.electrons));
    table
}
