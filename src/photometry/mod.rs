//! Photometry: from a frame's pixels and header to the target's brightness, with honest errors.
//!
//! In: a [`Frame`] and the catalogue stars of its field. Out: one [`Measurement`], and a light curve of many.
//! The steps, in the order of [`measure`]:
//!
//! 1. Stars are predicted at mid-exposure through the world coordinates; each draws a trail by the
//!    frame's rate among the stars. Their common offset is found by matched filtering and applied.
//! 2. The target is the significant source nearest its predicted place, centred by a windowed mean.
//! 3. The point spread function is what the light growing around the bright, lonely stars (pills) and a
//!    bright target (circle or pill) says, as a posterior over profiles ([`growth`]).
//! 4. A flux is the sum within r of a point or segment, less the clipped mean beside it, divided by the
//!    share of light that this collects: `F = (sum(w v) - B sum(w)) / S(r)`. Its variance in electrons is
//!    `(F S + v sum(w^2) + v sum(w)^2 / n_B) / S^2 + (F sigma_S / S)^2`, v = background + RN^2 + gain^2/12.
//! 5. r minimises this variance over a ladder of radii, so a bright target gets a wide aperture, whose
//!    correction is small, and a faint one a narrow aperture. A radius that is asked for is used for target and stars.
//! 6. The zero point is fitted to the stars ([`zeropoint`]); V = zp - 2.5 log10 F. The magnitude's error
//!    adds the zero point's and scintillation (Young 1967, AJ 72, 747):
//!    `0.09 D^(-2/3) X^1.75 exp(-h / 8000 m) / sqrt(2 t)`, D in cm, which the flux of this one exposure includes.

pub mod aperture;
pub mod astrometry;
pub mod background;
pub mod budget;
pub mod calibrate;
pub mod centroid;
pub mod detect;
pub mod detection;
mod elongation;
pub mod extract;
#[cfg(test)]
mod extreme_tests;
pub mod field;
pub mod frame;
pub mod growth;
pub mod header;
mod hidden;
mod least_squares;
pub mod lightcurve;
pub mod master;
pub mod optimal;
#[cfg(test)]
mod optimal_tests;
pub mod period;
pub mod point_image;
pub mod profile;
mod psf_fit;
pub mod reduce;
#[cfg(test)]
mod reduce_tests;
mod response;
pub mod rings;
mod saturated;
pub mod segment;
mod shape;
pub mod single;
pub mod solve;
pub mod stamp;
#[cfg(test)]
pub(crate) mod synthetic;
#[cfg(test)]
mod tests;
mod trend;
mod turbulence;
pub mod zeropoint;

pub use field::FieldStar;
pub use frame::{Frame, PhotometryError};
pub use lightcurve::{Geometry, Origin, add_errors, borrow_zero_points, table};

use crate::astro::time::Instant;
use crate::scene::Method;
use budget::Budget;
use extract::{Choice, Extraction};
use field::Track;
use glam::{DVec2, DVec3};
use segment::Segment;
use single::{Aperture, Flux};
use stamp::Stamp;
use zeropoint::{MAG_PER_SHARE, ZeroPoint};

/// Bits of `flags`.
pub mod flag {
    /// A pixel of the aperture is saturated.
    pub const SATURATED: u32 = 1;
    /// Saturated pixels in a line longer than the image.
    pub const BLOOMED: u32 = 2;
    /// A sharp excess of light, left out of the fit.
    pub const COSMIC_RAY: u32 = 4;
    /// The aperture reaches beyond the frame.
    pub const EDGE: u32 = 8;
    /// A star's trail crosses the aperture.
    pub const TRAIL_CROSSING: u32 = 16;
    /// A catalogue star within the aperture or near it.
    pub const NEIGHBOUR: u32 = 32;
    /// The zero point is that of neighbours in time, or unknown.
    pub const BORROWED_ZERO_POINT: u32 = 64;
    /// Below 3 standard deviations.
    pub const NOT_DETECTED: u32 = 128;
    /// A pixel of the aperture is no number.
    pub const BAD_PIXEL: u32 = 256;
}

/// How to measure.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Estimator of the target's flux; a radius that is asked for makes it an aperture.
    pub method: Method,
    /// Radius of circles and pills \[px\]; none: the best for each source.
    pub aperture_px: Option<f64>,
    /// Radius in which target and pointing error are searched \[px\]; below 0.5: places are taken as predicted.
    pub search_px: f64,
    /// Cell of the background mesh \[px\].
    pub background_px: usize,
    /// Fewer stars give no zero point.
    pub min_stars: usize,
    /// Relative scatter of the pixels' response that was not flattened out; 0 = flat.
    pub flat_rms: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            method: Method::Optimal,
            aperture_px: None,
            search_px: 50.0,
            background_px: 64,
            min_stars: 5,
            flat_rms: 0.0,
        }
    }
}

/// Where the target is expected.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Place {
    /// At the header's RA, DEC.
    Header,
    /// At a pixel.
    Pixel(DVec2),
    /// At an astrometric ICRS direction.
    Sky(DVec3),
}

/// One target in one exposure.
#[derive(Debug, Clone)]
pub struct Measurement {
    /// Number of the frame, if its name tells.
    pub frame: Option<u64>,
    /// Name of the target (OBJECT).
    pub object: String,
    /// Mid-exposure.
    pub time: Instant,
    /// Exposure time \[s\].
    pub exptime_s: f64,
    /// Column \[px\], 0 at the centre of the first stored pixel.
    pub x_px: f64,
    /// Row \[px\].
    pub y_px: f64,
    /// What the target draws of itself during the exposure \[px\]; zero for one that is followed.
    pub trail_px: DVec2,
    /// Standard deviations of the place along x and y \[px\]; NaN where it was taken as predicted.
    pub place_err_px: DVec2,
    /// Right ascension, astrometric ICRS \[deg\].
    pub ra_deg: f64,
    /// Declination, astrometric ICRS \[deg\].
    pub dec_deg: f64,
    /// Electrons of the whole exposure, over an endless plane.
    pub flux_e: f64,
    /// Their standard deviation \[e\].
    pub flux_err_e: f64,
    /// The same by cause.
    pub budget: Budget,
    /// What fitting the place adds to a flux on average, taken off already \[e\].
    pub place_bias_e: f64,
    /// Chi-square over degrees of freedom of the fit within the core; NaN for apertures.
    pub chi2: f64,
    /// V magnitude outside the atmosphere; NaN for a flux that is not positive.
    pub mag_v: f64,
    /// Its standard deviation \[mag\].
    pub mag_err: f64,
    /// Magnitude of 1 electron in this exposure.
    pub zeropoint_mag: f64,
    /// Its standard deviation \[mag\].
    pub zeropoint_err: f64,
    /// Stars the zero point rests on.
    pub n_stars: usize,
    /// Background beside the target \[e/px\], above bias (above 0 adu if the bias is unknown).
    pub background_e_px: f64,
    /// Airmass by the header.
    pub airmass: f64,
    /// Relative scintillation expected of a point in this exposure; 0 if it cannot be told.
    pub scintillation: f64,
    /// Radius of the target's aperture \[px\].
    pub aperture_px: f64,
    /// Share of the target's light in it, less the light taken for background.
    pub share: f64,
    /// Relative covariance of the target's share with the zero point stars': errors that a magnitude does not
    /// suffer because they dim the stars as well.
    pub share_covariance: f64,
    /// FWHM of a point's image \[px\].
    pub fwhm_px: f64,
    /// Bits of [`flag`].
    pub flags: u32,
}

impl Measurement {
    /// A row with nothing measured.
    pub(crate) fn unmeasured(frame: &Frame) -> Self {
        Self {
            frame: frame.number,
            object: frame.object.clone(),
            exptime_s: frame.exptime_s,
            airmass: frame.airmass.unwrap_or(f64::NAN),
            scintillation: scintillation(frame),
            ..Self::blank(frame.time)
        }
    }

    /// A row with nothing known but its time.
    pub fn blank(time: Instant) -> Self {
        let nan = f64::NAN;
        Self {
            frame: None,
            object: String::new(),
            time,
            exptime_s: nan,
            airmass: nan,
            scintillation: 0.0,
            x_px: nan,
            y_px: nan,
            trail_px: DVec2::ZERO,
            place_err_px: DVec2::NAN,
            ra_deg: nan,
            dec_deg: nan,
            flux_e: nan,
            flux_err_e: nan,
            budget: Budget::default(),
            place_bias_e: 0.0,
            chi2: nan,
            mag_v: nan,
            mag_err: nan,
            zeropoint_mag: nan,
            zeropoint_err: nan,
            n_stars: 0,
            background_e_px: nan,
            aperture_px: nan,
            share: nan,
            share_covariance: 0.0,
            fwhm_px: nan,
            flags: 0,
        }
    }

    /// Magnitude and error from flux and zero point.
    pub fn set_magnitude(&mut self) {
        (self.mag_v, self.mag_err) = (f64::NAN, f64::NAN);
        if self.flux_e > 0.0 && self.zeropoint_mag.is_finite() {
            self.mag_v = self.zeropoint_mag - 2.5 * self.flux_e.log10();
            let relative2 = (self.flux_err_e / self.flux_e).powi(2) + self.scintillation.powi(2);
            let variance2 = (relative2 - 2.0 * self.share_covariance) * MAG_PER_SHARE.powi(2);
            self.mag_err = (variance2 + self.zeropoint_err.powi(2)).max(0.0).sqrt();
        }
    }

    /// Number of the frame, else its place in the table.
    fn frame_or(&self, row: usize) -> i64 {
        self.frame.and_then(|n| i64::try_from(n).ok()).unwrap_or(row as i64)
    }

    fn set_place(&mut self, frame: &Frame, place: DVec2) {
        (self.x_px, self.y_px) = (place.x, place.y);
        (self.ra_deg, self.dec_deg) = lightcurve::degrees(frame.wcs.sky(place));
    }
}

/// Relative scintillation of a point in this exposure (Young 1967); 0 if the header does not tell enough.
fn scintillation(frame: &Frame) -> f64 {
    let (Some(d), Some(h), Some(x)) = (frame.aperture_mm, frame.elevation_m, frame.airmass) else { return 0.0 };
    if frame.exptime_s <= 0.0 {
        return 0.0;
    }
    0.09 * (d / 10.0).powf(-2.0 / 3.0) * x.powf(1.75) * (-h / 8000.0).exp() / (2.0 * frame.exptime_s).sqrt()
}

/// Measure the target of a frame. `trail_px` is the target's own motion on the frame during the exposure,
/// zero when it is tracked.
pub fn measure(
    frame: &Frame,
    stars: &[FieldStar],
    place: &Place,
    trail_px: DVec2,
    settings: &Settings,
) -> Measurement {
    let mut row = Measurement::unmeasured(frame);
    let fwhm = frame.expected_fwhm_px();
    let tracks = field::tracks(frame, stars, fwhm);
    let (tracks, shift) = calibrate::shifted(frame, tracks, fwhm, settings);
    let predicted = match place {
        Place::Header => frame.wcs.pixel(frame.pointing).map(|p| p + shift),
        Place::Sky(sky) => frame.wcs.pixel(*sky).map(|p| p + shift),
        Place::Pixel(pixel) => Some(*pixel),
    };
    row.trail_px = if trail_px.is_finite() { trail_px } else { DVec2::ZERO };
    let half = 0.5 * row.trail_px;
    let predicted = predicted.filter(|p| p.is_finite() && frame.holds(*p, 0.0));
    let Some(predicted) = predicted.map(|centre| Segment { centre, half }) else {
        row.flags |= flag::EDGE | flag::NOT_DETECTED | flag::BORROWED_ZERO_POINT;
        return row;
    };
    let near = field::around(&tracks, &predicted, settings.search_px.clamp(0.0, 200.0) + 6.0 * fwhm, None);
    let masked = |p| field::covered(&near, p);
    let found = if masked(predicted.centre) {
        // a star's trail lies on the place: what would be found is something else
        (settings.search_px >= 0.5).then_some(predicted.centre)
    } else {
        detect::target(frame, &predicted, fwhm, settings.search_px, settings.background_px, masked)
    };
    let target = found.map_or(predicted, |p| predicted.at(p));

    let lonely = field::alone(frame, &tracks, &target, 5.0 * fwhm, 4.0 * fwhm);
    let sources = calibrate::bright_sources(frame, &tracks, &lonely, found.map(|_| target), fwhm);
    let mut psf = calibrate::point_spread(frame, &sources, fwhm);
    psf.own = matches!(&sources[..], [(one, ..)] if (one.centre - target.centre).length() < fwhm);
    let (zero_point, star_aperture) =
        calibrate::stars_zero_point(frame, &tracks, &lonely, &psf, row.scintillation, settings);
    let psf = psf.at(frame.relative(target.centre));
    row.fwhm_px = psf.fwhm_px;
    row.n_stars = zero_point.n_stars;
    if zero_point.n_stars >= settings.min_stars.max(1) {
        (row.zeropoint_mag, row.zeropoint_err) = zero_point.at(frame.relative(target.centre));
    } else {
        row.flags |= flag::BORROWED_ZERO_POINT;
    }

    let sources = Sources { frame, psf: &psf, near: &near, tracks: &tracks, zero_point: &zero_point, settings };
    let stars = star_aperture.filter(|_| row.flags & flag::BORROWED_ZERO_POINT == 0);
    let measured = settings.aperture_px.is_none() && settings.method != Method::Aperture;
    let measured = measured && sources.fitted(&mut row, &predicted, found, stars.as_ref());
    if !measured {
        sources.summed(&mut row, &predicted, found, stars.as_ref());
    }
    if row.flux_e.is_nan() || row.flux_e < 3.0 * row.flux_err_e {
        row.flags |= flag::NOT_DETECTED;
    }
    row.set_magnitude();
    row
}

/// What a target is measured with.
struct Sources<'a> {
    frame: &'a Frame,
    psf: &'a growth::Psf,
    near: &'a [Track],
    tracks: &'a [Track],
    zero_point: &'a ZeroPoint,
    settings: &'a Settings,
}

impl Sources<'_> {
    /// By the fit of an image, at the place found if there is something, else at the predicted one. False if the pixels do
    /// not determine a flux.
    fn fitted(
        &self,
        row: &mut Measurement,
        predicted: &Segment,
        found: Option<DVec2>,
        stars: Option<&Aperture>,
    ) -> bool {
        let joint = self.settings.method == Method::Joint;
        let extract = |source: &Segment, free: bool| {
            let choice = Choice { free, joint, flat_rms: self.settings.flat_rms };
            extract::extract(self.frame, self.psf, source, self.near, self.zero_point, &choice)
        };
        let there = found.and_then(|place| extract(&predicted.at(place), true));
        let there = there.filter(|e| e.flux_e >= 3.0 * e.budget.total());
        let Some(e) = there.or_else(|| extract(predicted, false)) else { return false };
        // of its own image, the fit leaves out nothing that a sum would know
        if !joint && !self.psf.own && self.aperture_is_surer(&predicted.at(e.centre), &e.budget) {
            return false;
        }
        self.take(row, &e);
        if let Some(star) = stars {
            row.share_covariance = self.psf.covariance(&e.shares, &star.shares) / star.share;
        }
        let fwhm = self.psf.fwhm_px.hypot(0.68);
        let source = predicted.at(e.centre);
        row.flags |= crossings(self.tracks, &source, [2.0 * fwhm, 4.0 * fwhm], self.zero_point, row.flux_err_e);
        true
    }

    /// True if the point spread function is known so little that a wide aperture, which needs less of it, measures better.
    fn aperture_is_surer(&self, source: &Segment, fitted: &Budget) -> bool {
        if fitted.share < 0.5 * fitted.total() {
            return false;
        }
        let apertures = single::ladder(self.psf, source, None, true);
        let (flux, _) = single::best_flux(self.frame, source, &apertures, self.near, self.settings.flat_rms);
        flux.err_e < fitted.total()
    }

    fn take(&self, row: &mut Measurement, e: &Extraction) {
        row.set_place(self.frame, e.centre);
        (row.place_err_px, row.place_bias_e, row.chi2) = (e.centre_sigma, e.place_bias_e, e.chi2);
        (row.flux_e, row.budget, row.background_e_px) = (e.flux_e, e.budget, e.background_e_px);
        row.flux_err_e = e.budget.total();
        row.share = 1.0;
        row.flags |= e.flags;
    }

    /// By the sum in the best aperture.
    fn summed(&self, row: &mut Measurement, predicted: &Segment, found: Option<DVec2>, stars: Option<&Aperture>) {
        let (frame, settings) = (self.frame, self.settings);
        let sum = |source: Segment| {
            let apertures = single::ladder(self.psf, &source, settings.aperture_px, true);
            let (flux, best) = single::best_flux(frame, &source, &apertures, self.near, settings.flat_rms);
            (source, flux, best.clone())
        };
        let there = found.map(|place| sum(predicted.at(place)));
        // what was found may be nothing: then the predicted place is the better one
        let there = there.filter(|(_, flux, _)| flux.flux_e >= 3.0 * flux.err_e);
        let (source, flux, aperture) = there.unwrap_or_else(|| sum(*predicted));
        row.set_place(frame, source.centre);
        row.set_flux(&flux, &aperture);
        if row.flags & flag::SATURATED != 0 {
            let core = 1.5 * aperture.fwhm;
            let stamp = Stamp::gather(frame, &source, 8.0 * aperture.fwhm, core, |_| false);
            row.flags |= if stamp.bloomed { flag::BLOOMED } else { 0 };
        }
        row.flags |= if self.hidden(&source, &flux) { flag::TRAIL_CROSSING } else { 0 };
        if let Some(star) = stars {
            row.share_covariance =
                self.psf.covariance(&aperture.shares, &star.shares) / (aperture.share * star.share);
        }
        let radii = [aperture.radius + 0.5 * aperture.fwhm, aperture.annulus[0]];
        row.flags |= crossings(self.tracks, &source, radii, self.zero_point, flux.err_e);
    }
}

impl Sources<'_> {
    /// True if a trail of no catalogue star crosses a source of this flux.
    fn hidden(&self, source: &Segment, flux: &Flux) -> bool {
        let fwhm = self.psf.fwhm_px.hypot(0.68);
        let radius = 8.0 * fwhm;
        let half = self.frame.star_half();
        if half.length() < fwhm || flux.flux_e.is_nan() {
            return false;
        }
        let stamp = Stamp::gather(self.frame, source, radius, 1.5 * fwhm, |p| field::covered(self.near, p));
        let image = self.psf.image(radius);
        let response = self.frame.response_at(source.centre);
        let known = |place| {
            let light = response * flux.flux_e.max(0.0) * image.share(source, place);
            (response * flux.background_e_px + light, flux.sky_variance() + light)
        };
        hidden::trail(&stamp, source, half, fwhm, known).is_some()
    }
}

impl Measurement {
    fn set_flux(&mut self, flux: &Flux, aperture: &Aperture) {
        (self.flux_e, self.flux_err_e, self.background_e_px) = (flux.flux_e, flux.err_e, flux.background_e_px);
        (self.aperture_px, self.share, self.budget) = (aperture.radius, aperture.share, flux.budget);
        self.flags |= flux.flags;
    }
}

/// Flags of stars across the source and beside it, within two radii, as far as their light matters.
fn crossings(
    tracks: &[Track],
    target: &Segment,
    [across, beside]: [f64; 2],
    zero_point: &ZeroPoint,
    err_e: f64,
) -> u32 {
    let mut flags = 0;
    for track in field::around(tracks, target, beside, None) {
        let light = 10f64.powf(0.4 * (zero_point.mag - track.mag_v));
        if light < 0.1 * err_e {
            continue;
        }
        let gap = track.segment.gap(target);
        if gap < across && track.segment.length() > 1.0 {
            flags |= flag::TRAIL_CROSSING;
        }
        if gap < beside {
            flags |= flag::NEIGHBOUR;
        }
    }
    flags
}
