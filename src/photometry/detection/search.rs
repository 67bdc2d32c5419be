//! Stars and other sources of a frame.
//!
//! The threshold of each kind is that above which noise alone has the allowed number of maxima in the frame. Where the noise
//! is correlated, or the background errs, the map's scatter is larger than that of white noise: measured as the root mean
//! square of the map's negative values, which no source raises, it divides all significances.
//!
//! The error of a flux is that of the background's noise, and if the gain is known the source's own: the variance
//! `F / gain int k^3 / (int k^2)^2` is 4/3 of the flux for a Gaussian point, and less for a trail.

use super::background::{Mask, Mesh, background};
use super::kernel::Kernel;
use super::measure::measure;
use super::peak::{Peak, Peaks};
use super::resolve::{self, Claim, Kind, Pixels};
use super::{DetectionError, Plane, filter, within};
use crate::photometry::segment::Segment;
use glam::DVec2;

/// Share of the threshold above which maxima are kept until the noise is known.
const KEPT: f64 = 0.7;
/// Kernels this alike cannot be told apart.
const ALIKE: f64 = 0.98;
/// Light left out of the second background \[standard deviations of a pixel\].
const FAINT: f64 = 0.1;
/// Farthest that a source is left out \[px\].
const FARTHEST: f64 = 300.0;
/// Fewer negative samples do not tell the scatter.
const SAMPLES: usize = 100;
/// Error of a place from pixels' phases and images that are no Gaussians \[px\].
const PLACE_FLOOR: f64 = 0.02;
/// Times that the stars are taken out of the background, as long as more are found above it.
const ROUNDS: usize = 4;
/// Error along a trail of length D and significance S beyond that of the curvature, in D / S^2: near the threshold the
/// maximum is a chance one of a flat top.
const FLAT: f64 = 1.0;

/// Noise of a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Noise {
    /// The scatter of the pixels.
    Scatter,
    /// Electrons and read noise.
    Model {
        /// Gain \[e per unit of the pixels\].
        gain: f64,
        /// Value of a pixel without light \[units of the pixels\].
        zero: f64,
        /// Read noise \[units of the pixels\].
        read: f64,
    },
}

/// How to search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Width of images \[px\], 1 to 50.
    pub fwhm_px: f64,
    /// False detections expected in a frame of noise alone, 1e-12 to 1e4.
    pub false_alarms: f64,
    /// Value at and above which a pixel is saturated.
    pub saturate: f64,
    /// Step of quantisation of the pixels; 0: none.
    pub step: f64,
    /// Cells of the background \[px\].
    pub cell_px: usize,
    /// Noise of a pixel.
    pub noise: Noise,
}

impl Default for Settings {
    fn default() -> Self {
        let saturate = f64::INFINITY;
        Self { fwhm_px: 3.0, false_alarms: 0.1, saturate, step: 1.0, cell_px: 64, noise: Noise::Scatter }
    }
}

/// A source found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Source {
    /// Middle \[px\], on the frame.
    pub place: DVec2,
    /// Half of the trail with which it was found \[px\].
    pub half: DVec2,
    /// Light above the background \[units of the pixels\], as of a Gaussian image.
    pub flux: f64,
    /// Its standard deviation.
    pub flux_sigma: f64,
    /// Flux over the noise of the background.
    pub significance: f64,
    /// Standard deviations of the place along the trail and across it \[px\].
    pub place_sigma: [f64; 2],
    /// More than a tenth of the light there is others'.
    pub blended: bool,
    /// Part of the image is off the frame.
    pub edge: bool,
    /// A pixel of the image is saturated: place and flux are off by more than their errors.
    pub saturated: bool,
}

/// What is in a frame.
#[derive(Debug, Clone)]
pub struct Sources {
    /// Sources that drew the stars' trail, the most significant first.
    pub stars: Vec<Source>,
    /// Sources that drew one of the other trails, the most significant first.
    pub others: Vec<Source>,
    /// Background without the stars.
    pub mesh: Mesh,
    /// Least significance of a star, then of each kind of other sources.
    pub thresholds: Vec<f64>,
    /// Scatter of the significance of stars, then of each kind of others, against white noise; at least 1.
    pub noise_scales: Vec<f64>,
}

impl Noise {
    fn checked(self) -> Result<Self, DetectionError> {
        if let Self::Model { gain, zero, read } = self {
            within("gain", gain, 1e-6, 1e9)?;
            within("zero", zero, -1e12, 1e12)?;
            within("read", read, 0.0, 1e12)?;
        }
        Ok(self)
    }

    fn on(self, mesh: Mesh) -> Mesh {
        match self {
            Self::Scatter => mesh,
            Self::Model { gain, zero, read } => {
                mesh.with_sigma(|mean| ((mean - zero).max(0.0) / gain + read * read).sqrt())
            }
        }
    }
}

impl Settings {
    fn mesh(&self, plane: Plane, masks: &[Mask]) -> Result<Mesh, DetectionError> {
        Ok(self.noise.checked()?.on(background(plane, self.cell_px, self.step, masks)?))
    }
}

/// A kernel, what it found, and the scale of its noise.
struct Pass {
    kernel: Kernel,
    peaks: Peaks,
    threshold: f64,
    scale: f64,
}

impl Pass {
    fn new(plane: Plane, mesh: &Mesh, kernel: Kernel, false_alarms: f64) -> Result<Self, DetectionError> {
        let false_alarms = within("false_alarms", false_alarms, 1e-12, 1e4)?;
        let threshold = kernel.threshold(false_alarms, (plane.width as f64 * plane.height as f64).max(1.0));
        let peaks = filter::maxima(plane, mesh, &kernel, KEPT * threshold);
        Ok(Self { kernel, peaks, threshold, scale: 1.0 })
    }

    /// The same significances above another background.
    fn move_to(&mut self, from: &Mesh, to: &Mesh) {
        let gain = self.kernel.background_gain();
        let moved = |peak: &mut Peak| {
            let place = peak.place();
            let (old, new) = (from.sigma(place), to.sigma(place));
            let lifted = f64::from(peak.s) * old + (from.mean(place) - to.mean(place)) * gain;
            peak.s = (lifted / new) as f32;
        };
        self.peaks.maxima.iter_mut().for_each(moved);
        self.peaks.samples.iter_mut().filter(|p| p.s != 0.0).for_each(moved);
    }

    /// Divide by the noise's scale, as the map's negative values show it.
    fn scale(&mut self) {
        let negative = self.peaks.samples.iter().map(|p| f64::from(p.s)).filter(|s| *s < 0.0);
        let (n, sum) = negative.fold((0, 0.0), |(n, sum), s| (n + 1, sum + s * s));
        if n >= SAMPLES {
            self.scale = (sum / n as f64).sqrt().max(1.0);
        }
        let scale = self.scale as f32;
        self.peaks.maxima.iter_mut().for_each(|p| p.s /= scale);
    }

    fn kind(&self) -> Kind<'_> {
        Kind { kernel: &self.kernel, maxima: &self.peaks.maxima, threshold: self.threshold }
    }

    /// A source measured; none if its middle is off the frame.
    fn source(&self, plane: Plane, mesh: &Mesh, settings: &Settings, claim: &Claim) -> Option<Source> {
        let kernel = &self.kernel;
        let seen = measure(plane, mesh, kernel, claim.place, claim.blended, settings.saturate)?;
        let inside = |x: f64, n: usize| x >= -0.5 && x < n as f64 - 0.5;
        if !(inside(seen.place.x, plane.width) && inside(seen.place.y, plane.height)) {
            return None;
        }
        let flux = seen.flux * claim.own / (claim.own + claim.light);
        let sky = self.scale * mesh.sigma(seen.place) * seen.unit_error;
        let shot2 = match settings.noise {
            Noise::Scatter => 0.0,
            Noise::Model { gain, .. } => 4.0 / 3.0 * flux.max(0.0) / gain,
        };
        let flux_sigma = (sky * sky + shot2).sqrt();
        let snr = (flux / flux_sigma).max(1.0);
        let [along, across] = kernel.unit_place_sigma().map(|s| s / snr);
        let flat = FLAT * 2.0 * kernel.half().length() / (snr * snr);
        Some(Source {
            place: seen.place,
            half: kernel.half(),
            flux,
            flux_sigma,
            significance: flux / sky,
            place_sigma: [along.hypot(flat), across].map(|s| s.hypot(PLACE_FLOOR)),
            blended: claim.blended,
            edge: seen.edge,
            saturated: seen.saturated,
        })
    }
}

/// The pixels of a frame above its background.
struct Above<'a> {
    plane: Plane<'a>,
    mesh: &'a Mesh,
    /// Standard deviation of images \[px\].
    sigma: f64,
    saturate: f64,
}

impl Pixels for Above<'_> {
    fn point(&self, place: DVec2) -> f64 {
        let sigma = self.sigma;
        let reach = (3.0 * sigma).ceil() as i64;
        let middle = place.round();
        let weight = |from: f64, i: i64| (-0.5 * ((i as f64 + from) / sigma).powi(2)).exp();
        let shift = middle - place;
        let columns = (-reach..=reach).map(|i| weight(shift.x, i)).collect::<Vec<_>>();
        let (mean, mut sum, mut square) = (self.mesh.mean(place), 0.0, 0.0);
        for j in -reach..=reach {
            let mut row = (0.0, 0.0);
            for (i, w) in columns.iter().enumerate() {
                let value = self.plane.pixel(middle.x as i64 + i as i64 - reach, middle.y as i64 + j);
                let excess = value.map(|v| f64::from(v) - mean).filter(|v| v.is_finite()).unwrap_or(0.0);
                row = (row.0 + w * excess, row.1 + w * w);
            }
            let w = weight(shift.y, j);
            (sum, square) = (sum + w * row.0, square + w * w * row.1);
        }
        sum / (square.sqrt() * self.mesh.sigma(place))
    }

    fn saturated(&self, place: DVec2) -> f64 {
        let full = |d: DVec2| {
            let at = (place + d).round();
            self.plane.pixel(at.x as i64, at.y as i64).is_some_and(|v| f64::from(v) >= self.saturate)
        };
        let run = |e: DVec2| (0..FARTHEST as usize).take_while(|i| full(e * *i as f64)).count();
        // along a saturated trail it is long: the shortest of the diameters is its width
        let diameters = [DVec2::X, DVec2::Y, DVec2::splat(0.5f64.sqrt()), DVec2::new(1.0, -1.0) * 0.5f64.sqrt()];
        diameters.map(|e| 0.5 * (run(e) + run(-e)) as f64).into_iter().fold(f64::INFINITY, f64::min)
    }
}

fn claims(plane: Plane, mesh: &Mesh, settings: &Settings, passes: &[Pass]) -> Vec<Claim> {
    let kinds = passes.iter().map(Pass::kind).collect::<Vec<_>>();
    let sigma = passes.first().map_or(1.0, |p| p.kernel.sigma);
    let pixels = Above { plane, mesh, sigma, saturate: settings.saturate };
    resolve::sources(&kinds, [plane.width, plane.height], &pixels)
}

/// Measured sources of each kind.
fn measured(plane: Plane, mesh: &Mesh, settings: &Settings, passes: &[Pass]) -> Vec<(usize, Source)> {
    let claims = claims(plane, mesh, settings, passes);
    let source = |c: &Claim| Some((c.kind, passes[c.kind].source(plane, mesh, settings, c)?));
    claims.iter().filter_map(source).collect()
}

/// The sources of one kernel in a frame above a background, the most significant first.
///
/// # Errors
/// If a number is beyond its range.
pub fn detect(plane: Plane, mesh: &Mesh, half: DVec2, settings: &Settings) -> Result<Vec<Source>, DetectionError> {
    let mesh = settings.noise.checked()?.on(mesh.clone());
    let kernel = Kernel::new(settings.fwhm_px, half)?;
    let mut pass = Pass::new(plane, &mesh, kernel, settings.false_alarms)?;
    pass.scale();
    Ok(measured(plane, &mesh, settings, &[pass]).into_iter().map(|(_, source)| source).collect())
}

/// Stars, which draw the trail from -`star_half` to `star_half` \[px\], and sources that draw one of the trails
/// `other_halves` (zero: a point). Another trail that cannot be told from the stars' is not searched. The false
/// detections allowed are shared evenly by the kinds.
///
/// # Errors
/// If a number is beyond its range.
pub fn sources(
    plane: Plane,
    star_half: DVec2,
    other_halves: &[DVec2],
    settings: &Settings,
) -> Result<Sources, DetectionError> {
    let star = Kernel::new(settings.fwhm_px, star_half)?;
    let others =
        other_halves.iter().map(|half| Kernel::new(settings.fwhm_px, *half)).collect::<Result<Vec<_>, _>>()?;
    let others = others.into_iter().filter(|k| star.answer(k, DVec2::ZERO) < ALIKE).collect::<Vec<_>>();
    let share = settings.false_alarms / (1 + others.len()) as f64;
    let mut mesh = settings.mesh(plane, &[])?;
    let mut pass = Pass::new(plane, &mesh, star, share)?;
    let mut known = 0;
    for _ in 0..ROUNDS {
        let masks = masks(plane, &mesh, settings, &pass);
        if masks.len() <= known + known / 20 {
            break;
        }
        known = masks.len();
        let next = settings.mesh(plane, &masks)?;
        pass.move_to(&mesh, &next);
        mesh = next;
    }
    let mut passes = vec![pass];
    for kernel in others {
        passes.push(Pass::new(plane, &mesh, kernel, share)?);
    }
    passes.iter_mut().for_each(Pass::scale);
    let (stars, others) =
        measured(plane, &mesh, settings, &passes).into_iter().partition::<Vec<_>, _>(|s| s.0 == 0);
    let ordered = |found: Vec<(usize, Source)>| {
        let mut found = found.into_iter().map(|(_, s)| s).collect::<Vec<_>>();
        found.sort_by(|a, b| b.significance.total_cmp(&a.significance));
        found
    };
    let thresholds = passes.iter().map(|p| p.threshold).collect();
    let noise_scales = passes.iter().map(|p| p.scale).collect();
    Ok(Sources { stars: ordered(stars), others: ordered(others), mesh, thresholds, noise_scales })
}

/// What the stars found cover.
fn masks(plane: Plane, mesh: &Mesh, settings: &Settings, pass: &Pass) -> Vec<Mask> {
    let kernel = &pass.kernel;
    let mask = |claim: &Claim| {
        let reach = kernel.wing_reach(FAINT / (claim.own * kernel.unit_peak()));
        let segment = Segment { centre: claim.place, half: kernel.half() };
        Mask { segment, radius_px: reach.clamp(2.0 * kernel.sigma, FARTHEST) }
    };
    claims(plane, mesh, settings, std::slice::from_ref(pass)).iter().map(mask).collect()
}
