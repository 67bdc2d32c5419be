//! A target's flux by the fit of images ([`super::optimal`]): pixels, neighbours, place, flags.

use super::budget::{Budget, PixelNoise};
use super::field::{self, Track};
use super::flag;
use super::frame::Frame;
use super::growth::Psf;
use super::hidden;
use super::optimal::{self, Fit, Fitted, Neighbour};
use super::point_image::PointImage;
use super::segment::Segment;
use super::single;
use super::stamp::Stamp;
use super::zeropoint::ZeroPoint;
use glam::DVec2;

/// Radius of the core \[FWHM\]: what spoils it spoils the flux.
const CORE: f64 = 1.5;
/// Least and largest radius of a stamp \[FWHM\].
const RADII: [f64; 2] = [8.0, 16.0];
/// Background pixels wanted for each pixel of the image: the level then costs 2.5 % of the variance.
const BACKGROUND: f64 = 40.0;
/// Neighbours whose light is a smaller share of the target's noise are left to the background.
const NEGLIGIBLE: f64 = 0.02;
/// Catalogue magnitudes and colours predict a star's flux to this share.
const CATALOGUE: f64 = 0.15;
/// A neighbour's place is its own if known better than this \[px\].
const PLACED_PX: f64 = 0.5;
/// Most stars of no catalogue taken into a fit.
const MOST_HIDDEN: usize = 3;
/// Most neighbours fitted together.
const MOST_NEIGHBOURS: usize = 12;

/// What was measured.
#[derive(Debug, Clone)]
pub struct Extraction {
    /// Middle of the source \[px\].
    pub centre: DVec2,
    /// Its standard deviation along x and y \[px\]; NaN where the place was given.
    pub centre_sigma: DVec2,
    /// Electrons over an endless plane.
    pub flux_e: f64,
    /// What a fitted place added on average, taken off already \[e\].
    pub place_bias_e: f64,
    /// Errors by cause.
    pub budget: Budget,
    /// Background \[e/px\] above bias.
    pub background_e_px: f64,
    /// Share of the target's light by each profile of the posterior.
    pub shares: Vec<f64>,
    /// Chi-square over degrees of freedom of the core.
    pub chi2: f64,
    /// Bits of [`flag`].
    pub flags: u32,
}

impl Extraction {
    /// As a corrected frame counts, of electrons as they arrived.
    fn counted(mut self, response: f64) -> Self {
        self.flux_e /= response;
        self.place_bias_e /= response;
        self.background_e_px /= response;
        self.budget = self.budget.scaled(1.0 / response);
        self
    }
}

/// How the target is to be fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Choice {
    /// Fit the place too.
    pub free: bool,
    /// Fit the stars beside the target too, instead of leaving their pixels out.
    pub joint: bool,
    /// Relative scatter of the pixels' response.
    pub flat_rms: f64,
}

/// Radius of the pixels used for a source of `length`, for images of `fwhm` \[px\].
fn stamp_radius(fwhm: f64, length: f64) -> f64 {
    // effective pixels of a Gaussian image: 4 pi sigma^2, and 2 sqrt(pi) sigma for each pixel of a trail
    let wanted = BACKGROUND * (2.27 * fwhm * fwhm + 1.51 * fwhm * length);
    let pi = std::f64::consts::PI;
    let radius = ((length * length + pi * wanted).sqrt() - length) / pi;
    radius.clamp(RADII[0] * fwhm, RADII[1] * fwhm).max(12.0)
}

/// Measure `target`; none if its pixels do not determine a flux.
pub fn extract(
    frame: &Frame,
    psf: &Psf,
    target: &Segment,
    beside: &[Track],
    zero_point: &ZeroPoint,
    choice: &Choice,
) -> Option<Extraction> {
    // the image as the pixels see it
    let fwhm = psf.fwhm_px.hypot(0.68);
    let (core, radius) = (CORE * fwhm, stamp_radius(fwhm, target.length()));
    let image = psf.image(radius + 2.0 * fwhm);
    let look = single::look(frame, target, fwhm, beside);
    let site = Site { frame, image: &image, look: &look, target, fwhm };
    let noise =
        PixelNoise::divided(look.sky_variance, frame.gain_at(target.centre), frame.read_noise_e, frame.dark_e);
    let mut stars = if choice.joint { site.neighbours(beside, zero_point, radius) } else { vec![] };
    let masked = |p: DVec2| {
        if choice.joint {
            return false;
        }
        target.distance(p) > core && field::covered(beside, p)
    };
    let mut source = *target;
    let first = Stamp::gather(frame, &source, radius, core, masked);
    let mut stamp = &first;
    let fit =
        |stamp, source: &Segment, stars: &[Neighbour]| optimal::fit(stamp, &image, source, stars, &noise, core);
    let mut fitted = fit(stamp, &source, &stars)?;
    let mut flags = 0;
    for _ in 0..MOST_HIDDEN {
        let known = |place| {
            let others = stars.iter().zip(fitted.neighbours()).map(|(s, f)| f * image.share(&s.segment, place));
            let light = fitted.flux_e().max(0.0) * image.share(&source, place) + others.sum::<f64>().max(0.0);
            (fitted.level_e() + light, noise.total() + light)
        };
        let trail = hidden::trail(stamp, &source, frame.star_half(), fwhm, known);
        flags |= if trail.is_some() { flag::TRAIL_CROSSING } else { 0 };
        let point = if trail.is_none() { hidden::point(stamp, &source, fwhm, known) } else { None };
        flags |= if point.is_some() { flag::NEIGHBOUR } else { 0 };
        let Some(segment) = trail.or(point) else { break };
        stars.push(Neighbour { segment, expected: None });
        fitted = fit(stamp, &source, &stars)?;
    }
    let mut centre_sigma = DVec2::NAN;
    let centred;
    if choice.free && fitted.flux_e() > 0.0 {
        let cleaned = without(stamp, &image, &stars, &fitted);
        let near =
            Stamp { pixels: cleaned.pixels.into_iter().filter(|p| p.distance < 3.0 * fwhm).collect(), ..cleaned };
        let (flux_e, level_e) = (fitted.flux_e(), fitted.level_e());
        let placed = optimal::place(&near, &image, &source, flux_e, level_e, noise.total(), 1.5 * fwhm);
        if let Some(placed) = placed {
            source = source.at(placed.centre);
            centre_sigma = placed.sigma;
            centred = Stamp::gather(frame, &source, radius, core, masked);
            stamp = &centred;
            fitted = fit(stamp, &source, &stars)?;
        }
    }
    let mut told = told(stamp, &fitted.told(psf), psf, &source, centre_sigma, choice, frame.masters_flat_rms);
    told.flags |= flags;
    Some(told.counted(frame.response_at(target.centre)))
}

fn told(
    stamp: &Stamp,
    fitted: &Fitted,
    psf: &Psf,
    source: &Segment,
    centre_sigma: DVec2,
    choice: &Choice,
    masters_flat_rms: f64,
) -> Extraction {
    let mut budget = fitted.budget;
    let known = budget.total();
    let place_bias_e = if centre_sigma.is_finite() { optimal::place_bias(fitted.flux_e, known) } else { 0.0 };
    let flux_e = fitted.flux_e - place_bias_e;
    let of_shares = || flux_e.abs() * psf.covariance(&fitted.shares, &fitted.shares).max(0.0).sqrt();
    budget.share = fitted.doubt_e.unwrap_or_else(of_shares);
    budget.flat = flux_e.abs() * choice.flat_rms.hypot(masters_flat_rms) / fitted.spread_px.sqrt();
    let told = [
        (stamp.saturated > 0, flag::SATURATED),
        (stamp.bloomed, flag::BLOOMED),
        (fitted.cosmic_rays > 0, flag::COSMIC_RAY),
        (stamp.cut, flag::EDGE),
        (stamp.bad > 0, flag::BAD_PIXEL),
    ];
    let flags = told.into_iter().filter(|(there, _)| *there).map(|(_, bit)| bit).sum();
    let (shares, chi2) = (fitted.shares.clone(), fitted.chi2);
    let (centre, background_e_px) = (source.centre, fitted.level_e);
    Extraction { centre, centre_sigma, flux_e, place_bias_e, budget, background_e_px, shares, chi2, flags }
}

/// The stamp without the light of the neighbours.
fn without(stamp: &Stamp, image: &PointImage, stars: &[Neighbour], fitted: &Fit) -> Stamp {
    let mut clean = stamp.clone();
    for pixel in &mut clean.pixels {
        let light = stars.iter().zip(fitted.neighbours()).map(|(s, f)| f * image.share(&s.segment, pixel.place));
        pixel.value_e -= light.sum::<f64>();
    }
    clean
}

/// What stars beside a target are judged by.
struct Site<'a> {
    frame: &'a Frame,
    image: &'a PointImage,
    look: &'a single::Look,
    target: &'a Segment,
    fwhm: f64,
}

impl Site<'_> {
    /// The stars whose light matters within `radius`, where they are.
    fn neighbours(&self, beside: &[Track], zero_point: &ZeroPoint, radius: f64) -> Vec<Neighbour> {
        let noise = (self.look.sky_variance * 2.27 * self.fwhm * self.fwhm).sqrt();
        let near = beside.iter().filter(|t| t.segment.gap(self.target) < radius);
        let response = self.frame.response_at(self.target.centre);
        let flux = |track: &Track| response * 10f64.powf(0.4 * (zero_point.mag - track.mag_v));
        let matters = near.filter(|t| flux(t).is_nan() || flux(t) > NEGLIGIBLE * noise).take(MOST_NEIGHBOURS);
        matters
            .map(|track| match flux(track) {
                flux if flux.is_finite() => {
                    let segment = self.placed(&track.segment, flux);
                    Neighbour { segment, expected: Some((flux, CATALOGUE * flux)) }
                }
                _ => Neighbour { segment: track.segment, expected: None },
            })
            .collect()
    }

    /// A star where its own light, away from the target, says that it is; as predicted if it is too faint to tell.
    fn placed(&self, star: &Segment, flux: f64) -> Segment {
        let core = CORE * self.fwhm;
        let hidden = |p: DVec2| self.target.distance(p) < 2.0 * self.fwhm;
        let stamp = Stamp::gather(self.frame, star, 2.0 * core, core, hidden);
        let level =
            (self.look.background_adu - self.frame.bias_adu.unwrap_or(0.0)) * self.frame.gain_at(star.centre);
        let found = optimal::place(&stamp, self.image, star, flux, level, self.look.sky_variance, self.fwhm);
        match found {
            Some(found) if found.sigma.max_element() < PLACED_PX => star.at(found.centre),
            _ => *star,
        }
    }
}
