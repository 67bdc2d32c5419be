//! The flux of a single source: a ladder of apertures, the best of them, and the sum in it.

use super::aperture;
use super::budget::{Budget, PixelNoise};
use super::field::{self, Track};
use super::flag;
use super::frame::Frame;
use super::growth::Psf;
use super::segment::Segment;
use glam::DVec2;

/// Radii tried \[FWHM\].
pub const LADDER: [f64; 12] = [1.1, 1.3, 1.5, 1.7, 2.0, 2.3, 2.6, 3.0, 3.5, 4.0, 5.0, 6.0];
/// Least radius tried \[px\].
const LEAST_RADIUS_PX: f64 = 1.8;

/// An aperture and the share of a source's light that it collects.
#[derive(Debug, Clone)]
pub struct Aperture {
    /// Radius \[px\].
    pub radius: f64,
    /// Inner and outer radius of the background \[px\].
    pub annulus: [f64; 2],
    /// Share of the light, less what is taken for background.
    pub share: f64,
    /// Standard deviation of the share.
    pub doubt: f64,
    /// Share by each profile of the posterior.
    pub shares: Vec<f64>,
    /// Width of the image \[px\].
    pub fwhm: f64,
    area: f64,
    annulus_area: f64,
    /// Pixels that the image spreads over: 1 / sum of squared shares.
    spread_px: f64,
}

/// Apertures for a source: of the radius asked for, or a ladder. `placed`: for this source where it is, not for
/// all of its kind.
pub fn ladder(psf: &Psf, source: &Segment, radius: Option<f64>, placed: bool) -> Vec<Aperture> {
    let length = source.length();
    // the image as the pixels see it
    let fwhm = psf.fwhm_px.hypot(0.68);
    let asked = radius.filter(|r| r.is_finite() && *r > 0.0);
    let radii = asked.map_or_else(|| LADDER.map(|k| (k * fwhm).max(LEAST_RADIUS_PX)).to_vec(), |r| vec![r]);
    let pill = |r: f64| std::f64::consts::PI * r * r + 2.0 * r * length;
    let aperture = |radius: f64| {
        let annulus = aperture::annulus_radii(radius, fwhm);
        let shares = psf.shares(&psf.effective_weights(radius, annulus, source, placed));
        let (share, doubt) = (psf.mean(&shares), psf.covariance(&shares, &shares).sqrt());
        let annulus_area = pill(annulus[1]) - pill(annulus[0]);
        let spread_px = 2.27 * fwhm * fwhm + 1.5 * fwhm * length;
        Aperture { radius, annulus, share, doubt, shares, fwhm, area: pill(radius), annulus_area, spread_px }
    };
    radii.into_iter().map(aperture).collect()
}

impl Aperture {
    /// Variance expected of a flux \[e^2\] over a background of this variance a pixel \[e^2\].
    fn variance(&self, flux: f64, sky_variance: f64) -> f64 {
        let light = flux.max(0.0);
        let sky = sky_variance * self.area * (1.0 + self.area / self.annulus_area);
        (light * self.share + sky) / self.share.powi(2) + (light * self.doubt / self.share).powi(2)
    }
}

/// A first look at a source.
pub struct Look {
    /// Background \[adu\].
    pub background_adu: f64,
    /// Variance of a background pixel \[e^2\].
    pub sky_variance: f64,
    /// Light within 1.5 FWHM \[e\].
    pub light_e: f64,
    /// Signal-to-noise ratio within 1.5 FWHM.
    pub snr: f64,
    /// A pixel is saturated.
    pub saturated: bool,
    /// Part of it is off the frame.
    pub cut: bool,
}

/// Look at a source within 1.5 FWHM; `beside` are the stars that may lie in its background.
pub fn look(frame: &Frame, segment: &Segment, fwhm: f64, beside: &[Track]) -> Look {
    let radius = 1.5 * fwhm;
    let annulus = aperture::annulus_radii(radius, fwhm);
    let local = aperture::local_background(frame, segment, annulus, |p| field::covered(beside, p));
    let sum = aperture::sum(frame, segment, radius);
    let sky_variance = background_variance(frame, &local, segment.centre);
    let light = (sum.adu - local.mean_adu * sum.area_px) * frame.gain_at(segment.centre);
    let snr = light / (light.max(0.0) + sky_variance * sum.square_px).sqrt();
    Look {
        background_adu: local.mean_adu,
        sky_variance,
        light_e: light,
        snr,
        saturated: sum.saturated,
        cut: sum.cut,
    }
}

/// Variance of a background pixel \[e^2\]: that of the scatter seen, or if the bias is known at least that of the
/// electrons, the read noise and the quantisation. What is seen beyond these are stars too faint to be seen one by one.
fn background_variance(frame: &Frame, local: &aperture::Local, place: DVec2) -> f64 {
    let gain = frame.gain_at(place);
    let seen = (local.sigma_adu * gain).powi(2);
    let model = frame.bias_adu.zip(frame.read_noise_e).map(|(bias, read_noise)| {
        let light = ((local.mean_adu - bias) * gain).max(0.0);
        light + read_noise * read_noise + gain * gain / 12.0 + frame.masters_variance_e2
    });
    // where nothing was seen the model alone is left
    model.map_or(seen, |model| if model > seen || seen.is_nan() { model } else { seen })
}

/// A measured flux.
#[derive(Debug, Clone, Copy)]
pub struct Flux {
    /// Electrons over an endless plane.
    pub flux_e: f64,
    /// Standard deviation \[e\].
    pub err_e: f64,
    /// The same by cause.
    pub budget: Budget,
    /// Background \[e/px\].
    pub background_e_px: f64,
    /// Bits of [`flag`].
    pub flags: u32,
    sky_variance: f64,
}

impl Flux {
    /// Variance of a background pixel \[e^2\], in electrons as they arrived.
    pub fn sky_variance(&self) -> f64 {
        self.sky_variance
    }
}

/// The flux in one aperture.
pub fn flux(frame: &Frame, segment: &Segment, aperture: &Aperture, beside: &[Track], flat_rms: f64) -> Flux {
    // in electrons as they arrived, whose noise is known, and then as the frame counts them
    let (gain, response) = (frame.gain_at(segment.centre), frame.response_at(segment.centre));
    let local = aperture::local_background(frame, segment, aperture.annulus, |p| field::covered(beside, p));
    let sum = aperture::sum(frame, segment, aperture.radius);
    let sky_variance = background_variance(frame, &local, segment.centre);
    let light = (sum.adu - local.mean_adu * sum.area_px) * gain;
    let share = aperture.share;
    let arrived_e = light / share;
    let noise = PixelNoise::divided(sky_variance, gain, frame.read_noise_e, frame.dark_e);
    let budget = Budget {
        background: sum.area_px * (sky_variance / local.n.max(1) as f64).sqrt() / share,
        share: arrived_e.abs() * aperture.doubt / share,
        flat: arrived_e.abs() * flat_rms.hypot(frame.masters_flat_rms) / aperture.spread_px.sqrt(),
        ..noise.weighted(sum.square_px / (share * share), light.max(0.0) / (share * share))
    };
    let told = [(sum.saturated, flag::SATURATED), (sum.cut, flag::EDGE), (sum.bad > 0, flag::BAD_PIXEL)];
    let flags = told.into_iter().filter(|(there, _)| *there).map(|(_, bit)| bit).sum();
    let background_e_px = (local.mean_adu - frame.bias_adu.unwrap_or(0.0)) * gain / response;
    let (flux_e, budget) = (arrived_e / response, budget.scaled(1.0 / response));
    Flux { flux_e, err_e: budget.total(), budget, background_e_px, flags, sky_variance }
}

/// The flux in the aperture of the ladder that measures it best, judged from a first flux in a middling one.
pub fn best_flux<'a>(
    frame: &Frame,
    segment: &Segment,
    ladder: &'a [Aperture],
    beside: &[Track],
    flat_rms: f64,
) -> (Flux, &'a Aperture) {
    let middling = &ladder[2.min(ladder.len() - 1)];
    let first = flux(frame, segment, middling, beside, flat_rms);
    let expected = if first.flux_e.is_finite() { first.flux_e } else { 0.0 };
    let noise = |a: &Aperture| {
        let v = a.variance(expected, first.sky_variance);
        if v.is_finite() { v } else { f64::INFINITY }
    };
    let best = ladder.iter().min_by(|a, b| noise(a).total_cmp(&noise(b))).unwrap_or(middling);
    if std::ptr::eq(best, middling) {
        (first, middling)
    } else {
        (flux(frame, segment, best, beside, flat_rms), best)
    }
}
