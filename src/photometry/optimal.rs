//! The flux of highest information: a weighted least-squares fit of images and a level to the pixels.
//!
//! With shares p_ik of source k in pixel i, a level B and variances V_i, the model is `m_i = sum_k F_k p_ik + B`, and
//! the estimate solves `sum_i p_ik (d_i - m_i) / V_i = 0`, V from the model itself, iterated. These equations have mean zero
//! at the truth whatever the noise is, so that the weights make no bias, as weights from the data would (Humphrey, Liu &
//! Buote 2009, ApJ 693, 822). The variance is the Cramer-Rao bound of known shares, unknown fluxes and level,
//! `(sum p p' / V)^-1` (for one flux Horne 1986, PASP 98, 609). Neighbours with known magnitudes have their expected flux as
//! a datum of their own.
//!
//! Each flux is a sum of pixels, `F = sum a_i d_i`, and a false image p' in place of p makes `F sum a_i p'_i` of it: this is how
//! the doubt about the point spread function becomes an error.
//!
//! Where the source alone tells the point spread function, that error and the noise of the pixels are not independent: light that noise adds
//! between core and wings makes the image wider and the flux larger. Each profile k of the posterior then gets its own flux F_k, which
//! gives the flux of the joint posterior, sum w_k F_k, with the variance sum w_k (V_k + (F_k - F)^2).
//!
//! A place that is fitted too follows the noise: the fitted flux is too large by half a variance for each coordinate,
//! `sigma^2 / F` in all (the maximum of a random surface; 0.2 sigma at a signal-to-noise ratio of 5), which is taken off.

use super::budget::{Budget, PixelNoise};
use super::growth::Psf;
use super::least_squares::{Normal, dot};
use super::point_image::PointImage;
use super::segment::Segment;
use super::stamp::{Pixel, Stamp};
use glam::DVec2;

/// Rounds of weights from fluxes.
const ROUNDS: usize = 8;
/// Pixels off by more standard deviations are left out.
const CLIP_SIGMA: f64 = 5.0;
/// What images may miss of a source's light in a pixel without being a fault of the pixel, as a share.
const TOLERATED: f64 = 0.1;

/// A source beside the target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Neighbour {
    /// Where it draws.
    pub segment: Segment,
    /// Expected flux and its standard deviation \[e\], if known.
    pub expected: Option<(f64, f64)>,
}

/// A fitted flux.
#[derive(Debug, Clone, PartialEq)]
pub struct Fitted {
    /// Electrons over an endless plane.
    pub flux_e: f64,
    /// Standard deviations by cause; those of share and flat field are left to the caller.
    pub budget: Budget,
    /// Background \[e/px\] above bias.
    pub level_e: f64,
    /// Scatter of the fluxes by the profiles of the posterior, where the source alone tells them \[e\].
    pub doubt_e: Option<f64>,
    /// Share by each profile of the posterior, 1 for their mean.
    pub shares: Vec<f64>,
    /// Chi-square over degrees of freedom within the core.
    pub chi2: f64,
    /// Effective number of pixels: 1 / sum of squared shares.
    pub spread_px: f64,
    /// Sharp excesses left out near the target.
    pub cosmic_rays: usize,
}

/// A fitted place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placed {
    /// Middle of the source \[px\].
    pub centre: DVec2,
    /// Standard deviations along x and y \[px\].
    pub sigma: DVec2,
}

/// One fit: pixels, and the shares of every source in them.
struct Problem<'a> {
    pixels: &'a [Pixel],
    values: Vec<f64>,
    /// Shares of the target, then of each neighbour, pixel by pixel.
    shares: Vec<Vec<f64>>,
    expected: Vec<Option<(f64, f64)>>,
    sky_variance: f64,
    kept: Vec<bool>,
    /// Pixels farther out are not the target's own \[px\].
    core: f64,
}

struct Answer {
    fluxes: Vec<f64>,
    level: f64,
    covariance: Vec<f64>,
}

impl Problem<'_> {
    fn sources(&self) -> usize {
        self.shares.len()
    }

    /// Sum of all sources' light in the pixels, each of the flux that `flux` makes of its own \[e\].
    fn light(&self, fluxes: &[f64], flux: impl Fn(f64) -> f64) -> Vec<f64> {
        let mut light = vec![0.0; self.values.len()];
        for (shares, own) in self.shares.iter().zip(fluxes) {
            let own = flux(*own);
            light.iter_mut().zip(shares).for_each(|(l, p)| *l += own * p);
        }
        light
    }

    /// Light of those sources alone that shine \[e\].
    fn shining(&self, fluxes: &[f64]) -> Vec<f64> {
        self.light(fluxes, |f| f.max(0.0))
    }

    /// 1 / variance of the pixels; 0 for those left out.
    fn weights(&self, fluxes: &[f64]) -> Vec<f64> {
        let weight = |(light, kept): (f64, &bool)| f64::from(u8::from(*kept)) / (self.sky_variance + light);
        self.shining(fluxes).into_iter().zip(&self.kept).map(weight).collect()
    }

    /// One weighted solution with variances from `fluxes`.
    fn solve(&self, fluxes: &[f64]) -> Option<Answer> {
        let n = self.sources() + 1;
        let level = vec![1.0; self.values.len()];
        let columns = self.shares.iter().chain([&level]).map(Vec::as_slice).collect::<Vec<_>>();
        let mut normal = Normal::of_columns(&columns, &self.values, &self.weights(fluxes));
        for (k, expected) in self.expected.iter().enumerate() {
            if let Some((flux, sigma)) = expected {
                let unit = (0..n).map(|j| f64::from(u8::from(j == k))).collect::<Vec<_>>();
                normal.add(&unit, *flux, 1.0 / (sigma * sigma).max(1e-12));
            }
        }
        let (mut fluxes, covariance) = normal.solve()?;
        let level = fluxes.pop()?;
        Some(Answer { fluxes, level, covariance })
    }

    /// Solutions and clipping until both stand still.
    fn settle(&mut self) -> Option<(Answer, usize)> {
        let mut fluxes = self.expected.iter().map(|e| e.map_or(0.0, |e| e.0)).collect::<Vec<_>>();
        let mut answer = self.solve(&fluxes)?;
        let mut rays = 0;
        for round in 0..ROUNDS {
            fluxes.clone_from(&answer.fluxes);
            let clipped = round > 0 && self.clip(&answer, &mut rays);
            answer = self.solve(&fluxes)?;
            let sigma = answer.covariance[0].sqrt();
            if round > 1 && !clipped && (answer.fluxes[0] - fluxes[0]).abs() < 1e-4 * sigma {
                break;
            }
        }
        Some((answer, rays))
    }

    /// Leaves out pixels that no image explains: what is far off outside the core, and within it only what is brighter than
    /// its neighbours as no image is. True if anything changed.
    fn clip(&mut self, answer: &Answer, rays: &mut usize) -> bool {
        let (light, model) = (self.shining(&answer.fluxes), self.light(&answer.fluxes, |f| f));
        let residuals = self.values.iter().zip(&model).map(|(v, m)| v - answer.level - m).collect::<Vec<_>>();
        *rays = 0;
        let mut kept = Vec::with_capacity(residuals.len());
        for (i, (residual, light)) in residuals.iter().zip(light).enumerate() {
            let pixel = self.pixels[i];
            let variance = self.sky_variance + light + (TOLERATED * light).powi(2);
            if residual * residual <= CLIP_SIGMA * CLIP_SIGMA * variance {
                kept.push(true);
                continue;
            }
            if pixel.distance > self.core {
                kept.push(false);
                continue;
            }
            // pixels lie row by row: the next of the same row are next in line
            let beside = |j: Option<usize>| {
                j.filter(|j| (self.pixels.get(*j)).is_some_and(|p| (p.place - pixel.place).length() < 1.1))
                    .map_or(0.0, |j| residuals[j])
            };
            let neighbours = beside(i.checked_sub(1)).max(beside(Some(i + 1)));
            let sharp = *residual > 0.0 && *residual > 4.0 * neighbours.max(variance.sqrt());
            *rays += usize::from(sharp);
            kept.push(!sharp);
        }
        let changed = kept != self.kept;
        self.kept = kept;
        changed
    }
}

/// A source and its neighbours fitted to the pixels of a stamp.
pub struct Fit<'a> {
    problem: Problem<'a>,
    answer: Answer,
    cosmic_rays: usize,
    image: &'a PointImage,
    source: Segment,
    noise: &'a PixelNoise,
}

/// The fit of `source` and its neighbours to a stamp with a core of radius `core` \[px\]; none if the pixels do not determine
/// the flux.
pub fn fit<'a>(
    stamp: &'a Stamp,
    image: &'a PointImage,
    source: &Segment,
    neighbours: &[Neighbour],
    noise: &'a PixelNoise,
    core: f64,
) -> Option<Fit<'a>> {
    let pixels = &stamp.pixels[..];
    let segments = std::iter::once(source).chain(neighbours.iter().map(|n| &n.segment));
    let shares = segments.map(|s| pixels.iter().map(|p| image.share(s, p.place)).collect::<Vec<_>>()).collect();
    let expected = std::iter::once(None).chain(neighbours.iter().map(|n| n.expected)).collect();
    let values = pixels.iter().map(|p| p.value_e).collect();
    let kept = vec![true; pixels.len()];
    let mut problem =
        Problem { pixels, values, shares, expected, sky_variance: noise.total().max(1e-6), kept, core };
    let (answer, cosmic_rays) = problem.settle()?;
    Some(Fit { problem, answer, cosmic_rays, image, source: *source, noise })
}

impl Fit<'_> {
    /// Flux of the source \[e\].
    pub fn flux_e(&self) -> f64 {
        self.answer.fluxes[0]
    }

    /// Background \[e/px\] above bias.
    pub fn level_e(&self) -> f64 {
        self.answer.level
    }

    /// Fluxes of the neighbours \[e\].
    pub fn neighbours(&self) -> &[f64] {
        &self.answer.fluxes[1..]
    }

    /// The flux with its errors, over the profiles of the posterior.
    pub fn told(&self, psf: &Psf) -> Fitted {
        let fitted = self.described(psf);
        match psf.own.then(|| self.averaged(psf)).flatten() {
            Some((flux_e, doubt_e)) => Fitted { flux_e, doubt_e: Some(doubt_e), ..fitted },
            None => fitted,
        }
    }

    fn described(&self, psf: &Psf) -> Fitted {
        let (problem, answer, noise) = (&self.problem, &self.answer, self.noise);
        let n = problem.sources() + 1;
        let own = &problem.shares[0];
        let (light, model) = (problem.shining(&answer.fluxes), problem.light(&answer.fluxes, |f| f));
        let (mut square, mut shot, mut alone, mut chi2, mut freedom, mut spread) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        let mut weights = psf.no_weights();
        for (i, pixel) in problem.pixels.iter().enumerate().filter(|(i, _)| problem.kept[*i]) {
            let (light, variance) = (light[i], problem.sky_variance + light[i]);
            let by_source =
                problem.shares.iter().enumerate().map(|(k, p)| answer.covariance[k] * p[i]).sum::<f64>();
            let a = (by_source + answer.covariance[n - 1]) / variance;
            square += a * a;
            shot += a * a * light;
            alone += own[i] * own[i] / variance;
            spread += own[i] * own[i];
            psf.add_pixel(&mut weights, self.image, &self.source, pixel.place, a);
            if pixel.distance <= problem.core {
                chi2 += (pixel.value_e - model[i] - answer.level).powi(2) / variance;
                freedom += 1.0;
            }
        }
        // a lonely flux over a known level has the variance 1 / alone: the fit of level and neighbours adds the rest
        let (variance, lonely) = (answer.covariance[0], 1.0 / alone);
        let scale = lonely / (square * noise.total() + shot);
        let mut budget = noise.weighted(square * scale, shot * scale);
        budget.background = (variance - lonely).max(0.0).sqrt();
        Fitted {
            flux_e: answer.fluxes[0],
            budget,
            level_e: answer.level,
            doubt_e: None,
            shares: psf.shares(&weights),
            chi2: chi2 / f64::max(freedom - n as f64, 1.0),
            spread_px: 1.0 / spread,
            cosmic_rays: self.cosmic_rays,
        }
    }

    /// Mean and scatter of the fluxes that the profiles of the posterior make of the same pixels, with the same weights.
    fn averaged(&self, psf: &Psf) -> Option<(f64, f64)> {
        let (problem, answer) = (&self.problem, &self.answer);
        let places = problem.pixels.iter().map(|p| p.place).collect::<Vec<_>>();
        let each = psf.each(self.image, &self.source, &places);
        let mut middle = vec![0.0; places.len()];
        each.iter().for_each(|(weight, shares)| middle.iter_mut().zip(shares).for_each(|(m, s)| *m += weight * s));
        let weights = problem.weights(&answer.fluxes);
        // the mean image's own light, that of neighbours left as it is
        let mut light = problem.values.clone();
        for (shares, flux) in problem.shares.iter().zip(&answer.fluxes).skip(1) {
            light.iter_mut().zip(shares).for_each(|(l, s)| *l -= flux * s);
        }
        let level = LevelSums::new(&light, &weights);
        let at_mean = level.flux(&middle);
        let (mut mean, mut square) = (0.0, 0.0);
        for (weight, shares) in &each {
            let off = level.flux(shares) - at_mean;
            if off.is_finite() {
                mean += weight * off;
                square += weight * off * off;
            }
        }
        Some((answer.fluxes[0] + mean, (square - mean * mean).max(0.0).sqrt()))
            .filter(|(flux, _)| flux.is_finite())
    }
}

/// Light and weights of pixels, and their sums, for the flux of images over a level.
struct LevelSums<'a> {
    weights: &'a [f64],
    weighted: Vec<f64>,
    one: f64,
    light: f64,
}

impl<'a> LevelSums<'a> {
    fn new(light: &[f64], weights: &'a [f64]) -> Self {
        let weighted = light.iter().zip(weights).map(|(y, w)| y * w).collect::<Vec<_>>();
        Self { one: weights.iter().sum(), light: weighted.iter().sum(), weights, weighted }
    }

    /// The flux of an image over a level, both fitted; NaN where they are not determined.
    fn flux(&self, shares: &[f64]) -> f64 {
        let squares = shares.iter().map(|s| s * s).collect::<Vec<_>>();
        let (ss, s1, sy) = (dot(self.weights, &squares), dot(self.weights, shares), dot(&self.weighted, shares));
        let determinant = ss * self.one - s1 * s1;
        if determinant > 0.0 { (sy * self.one - s1 * self.light) / determinant } else { f64::NAN }
    }
}

/// The place of `source`, by Fisher's scoring of flux, level and place from a first guess; none if it leaves its
/// neighbourhood of `limit` \[px\] or is not determined.
pub fn place(
    stamp: &Stamp,
    image: &PointImage,
    guess: &Segment,
    flux_e: f64,
    level_e: f64,
    sky_variance: f64,
    limit: f64,
) -> Option<Placed> {
    let mut segment = *guess;
    let (mut flux, mut level) = (flux_e, level_e);
    for _ in 0..20 {
        let mut normal = Normal::new(4);
        for pixel in &stamp.pixels {
            let (own, slope) = image.share_and_slope(&segment, pixel.place);
            let weight = 1.0 / (sky_variance + flux.max(0.0) * own).max(1e-6);
            let row = [own, 1.0, flux * slope.x, flux * slope.y];
            normal.add(&row, pixel.value_e - flux * own - level, weight);
        }
        let (step, covariance) = normal.solve()?;
        flux += step[0];
        level += step[1];
        let moved = DVec2::new(step[2], step[3]).clamp_length_max(0.5 * limit);
        segment.centre += moved;
        let sigma = DVec2::new(covariance[10], covariance[15]).map(f64::sqrt);
        let strayed = (segment.centre - guess.centre).length() > limit;
        if !segment.centre.is_finite() || strayed || flux.is_nan() || flux <= 0.0 {
            return None;
        }
        if moved.length() < 0.01 * sigma.min_element() || moved.length() < 1e-5 {
            return Some(Placed { centre: segment.centre, sigma });
        }
    }
    None
}

/// What a fitted place adds to the flux on average \[e\], for a flux of this standard deviation at a known place.
pub fn place_bias(flux_e: f64, sigma_e: f64) -> f64 {
    if flux_e > sigma_e { sigma_e * sigma_e / flux_e } else { 0.0 }
}
