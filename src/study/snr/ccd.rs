//! The analytic model: what the noise of a measured flux is made of.
//!
//! A target of F electrons gives pixel i the share p_i; all other light and dark charge there is b_i, and the pixel's variance
//! `v_i = F p_i + b_i + r^2 + g^2/12` with the read noise r and the rounding of a converter of gain g (Merline & Howell 1995,
//! Exp. Astron. 6, 163; Howell 2006, Handbook of CCD Astronomy, eq. 4.4). A measurement is a weighted sum of pixels with weights
//! a_i; every cause of noise adds `sum a_i^2 (its part of v_i)`.
//!
//! * `optimal` (and `joint`): the matched filter with flux and local background unknown. With A = sum p^2/v, B = sum 1/v and
//!   C = sum p/v the variance is 1 / (A - C^2/B) (the Cramer-Rao bound, as in the truth of a frame); 1/A of it is the filter's own
//!   over a known background, with the weights `p_i / (v_i A)`, and the rest the background's.
//! * `aperture`: the sum within a radius less its area times the mean of n_B pixels around, with shares w_i of cut pixels:
//!   `F sum w p + sum w^2 (b + r^2 + g^2/12) + (sum w)^2 v_B / n_B`, of a signal `F (sum w p - sum w / n_B sum_B p)`.
//!
//! The equivalent number of pixels is told such that `S / sqrt(S + n (sky + dark + r^2 + g^2/12))` is the SNR: it holds the
//! background's determination.

use crate::camera::evenness::Evenness;
use crate::camera::expose;
use crate::camera::path::Path;
use crate::camera::psf::Psf;
use crate::camera::region::Region;
use crate::camera::scenery::Scenery;
use crate::photometry::aperture::{self, LINES};
use crate::photometry::segment::Segment;
use crate::photometry::single::LADDER;
use crate::scene::{Detector, Method, Scene};
use glam::DVec2;

/// Least radius of an aperture that the photometry tries \[px\].
const LEAST_RADIUS_PX: f64 = 1.8;
/// Variance of a pixel below which it counts as this \[e-^2\]: no noise at all would make the sums infinite.
const LEAST_VARIANCE: f64 = 1e-9;

/// How the flux is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Estimator {
    /// The matched filter.
    Optimal,
    /// An aperture of that radius \[px\]; none: of the photometry's ladder the one of least variance.
    Aperture(Option<f64>),
}

impl Estimator {
    /// That of a scene's `[photometry]`: a radius that is given makes it an aperture.
    pub fn of(scene: &Scene) -> Self {
        match (scene.photometry.method, scene.photometry.aperture_px) {
            (Method::Aperture, radius) | (_, radius @ Some(_)) => Self::Aperture(radius),
            (Method::Optimal | Method::Joint, None) => Self::Optimal,
        }
    }
}

/// Variances of the signal by their cause \[e-^2\].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Terms {
    /// Photons of the target.
    pub shot: f64,
    /// Photons of the sky.
    pub sky: f64,
    /// Photons of stars and other targets.
    pub stars: f64,
    /// Dark charge.
    pub dark: f64,
    /// Read noise.
    pub read: f64,
    /// Rounding to whole numbers.
    pub rounding: f64,
    /// The background's determination.
    pub background: f64,
}

impl Terms {
    /// All together.
    pub fn total(&self) -> f64 {
        self.parts().iter().map(|(_, part)| part).sum()
    }

    /// Names and variances.
    pub fn parts(&self) -> [(&'static str, f64); 7] {
        [
            ("target", self.shot),
            ("sky", self.sky),
            ("stars", self.stars),
            ("dark", self.dark),
            ("read", self.read),
            ("rounding", self.rounding),
            ("background", self.background),
        ]
    }
}

/// A flux measured with the model's noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    /// Signal over its standard deviation.
    pub snr: f64,
    /// Electrons that make the signal: all, or those in the aperture.
    pub signal_e: f64,
    /// Light of sky, stars and other targets in the pixels that count \[e-/px\].
    pub sky_e_px: f64,
    /// That of stars and other targets alone.
    pub stars_e_px: f64,
    /// Equivalent number of pixels.
    pub n_px: f64,
    /// Radius of the aperture \[px\]; NaN for the matched filter.
    pub aperture_px: f64,
    /// Pixels whose mean is the background; NaN for the matched filter.
    pub n_background_px: f64,
    /// The noise.
    pub terms: Terms,
    /// Relative error of the flux by a response of the pixels that is not flattened out: the same in every frame in which the
    /// target keeps its pixels.
    pub flat: f64,
    /// Largest mean of a pixel \[e-\].
    pub peak_e: f64,
}

/// The pixels about a target.
#[derive(Debug, Clone)]
pub struct Pixels {
    /// Shares of the target's light.
    share: Vec<f64>,
    /// Everything but the target \[e-\].
    rest: Vec<f64>,
    /// Centres \[px\].
    place: Vec<DVec2>,
    /// Sky alone, stars left out \[e-/px\].
    sky_e: f64,
    dark_e: f64,
    read2: f64,
    rounding: f64,
    prnu: f64,
    /// What the target draws.
    segment: Segment,
    /// Width of the image as pixels see it \[px\].
    fwhm: f64,
}

/// How far from its path pixels are looked at \[px\]: for the matched filter as far as the truth of a frame does.
fn margin(psf: &Psf, estimator: Estimator) -> f64 {
    let image = psf.radius().max(15) as f64;
    match estimator {
        Estimator::Optimal => image,
        Estimator::Aperture(radius) => {
            let fwhm = pixel_fwhm(psf);
            let widest = radius.unwrap_or(LADDER[LADDER.len() - 1] * fwhm);
            image.max(aperture::annulus_radii(widest, fwhm)[1] + 1.0)
        }
    }
}

/// Width of a point's image as pixels see it \[px\].
pub fn pixel_fwhm(psf: &Psf) -> f64 {
    psf.profile().fwhm().hypot(0.68)
}

/// The centres of a region's pixels, by rows.
fn places(region: &Region) -> Vec<DVec2> {
    let row = |y: usize| (region.x0..region.x0 + region.width).map(move |x| DVec2::new(x as f64, y as f64));
    (region.y0..region.y0 + region.height).flat_map(row).collect()
}

/// Noise that a detector adds to a pixel: variances of read-out and of rounding \[e-^2\], and the scatter of its response.
fn own_noise(detector: &Detector) -> [f64; 3] {
    let read2 = detector.read_noise_rms_e().powi(2);
    [read2, expose::floor(detector) - read2, detector.prnu / detector.binning as f64]
}

impl Pixels {
    /// About target number `index` of an exposure; none off the frame.
    pub fn of(scene: &Scene, scenery: &Scenery, index: usize, estimator: Estimator) -> Option<Self> {
        let path = scenery.targets.get(index)?.path;
        let (low, high) = path.bounds();
        let reach = 0.5 * (high - low).max_element() + margin(&scenery.psf, estimator);
        let region = Region::around((low + high) / 2.0, reach, scene.detector.light_px())?;
        let (mut share, mut rest) = (vec![0.0; region.len()], vec![0.0; region.len()]);
        scenery.add_target(index, 1.0, &region, &mut share);
        scenery.evenness.apply(&region, &mut share);
        scenery.mean_without(&region, index, &mut rest);
        let sky_e = sky_at(&scenery.evenness, scenery.sky_at(path.mid), path.mid);
        let [read2, rounding, prnu] = own_noise(&scene.detector);
        Some(Self {
            share,
            rest,
            place: places(&region),
            sky_e,
            dark_e: scenery.dark_e,
            read2,
            rounding,
            prnu,
            segment: segment(&path),
            fwhm: pixel_fwhm(&scenery.psf),
        })
    }

    /// The same target alone over an even background, `factor` times as long exposed: its trail, the sky and the dark charge grow
    /// with it.
    pub fn scaled(&self, psf: &Psf, path: &Path, factor: f64, estimator: Estimator) -> Self {
        let part = |place: DVec2| path.mid + (place - path.mid) * factor;
        let path = Path { start: part(path.start), mid: path.mid, end: part(path.end) };
        self.alone(psf, &path, factor, estimator)
    }

    fn alone(&self, psf: &Psf, path: &Path, factor: f64, estimator: Estimator) -> Self {
        let (low, high) = path.bounds();
        let half = (high - low) / 2.0 + margin(psf, estimator) + 1.0;
        let shift = (low - half).floor().min(DVec2::ZERO);
        let size = [(high - shift + half).x as usize + 1, (high - shift + half).y as usize + 1];
        // moved by whole pixels, so that no pixel is below 0
        let moved = Path { start: path.start - shift, mid: path.mid - shift, end: path.end - shift };
        let reach = 0.5 * (high - low).max_element() + margin(psf, estimator);
        let region = Region::around((low + high) / 2.0 - shift, reach, size);
        let region = region.unwrap_or(Region { x0: 0, y0: 0, width: 0, height: 0 });
        let mut share = vec![0.0; region.len()];
        psf.add(&moved, 1.0, &region, &mut share);
        let rest = vec![factor * self.median_rest(); region.len()];
        Self {
            share,
            rest,
            place: places(&region),
            sky_e: factor * self.sky_e,
            dark_e: factor * self.dark_e,
            segment: segment(&moved),
            fwhm: pixel_fwhm(psf),
            ..*self
        }
    }

    /// A point alone that draws a path, over `sky_e` and `dark_e` \[e-/px\].
    pub fn lone(
        detector: &Detector,
        psf: &Psf,
        path: &Path,
        [sky_e, dark_e]: [f64; 2],
        estimator: Estimator,
    ) -> Self {
        let [read2, rounding, prnu] = own_noise(detector);
        let (share, rest, place, segment) =
            (Vec::new(), vec![sky_e + dark_e], Vec::new(), Segment::point(DVec2::ZERO));
        let none =
            Self { share, rest, place, sky_e, dark_e, read2, rounding, prnu, segment, fwhm: pixel_fwhm(psf) };
        none.alone(psf, path, 1.0, estimator)
    }

    /// The same over another sky \[e-/px\].
    #[must_use]
    pub fn under(mut self, sky_e: f64) -> Self {
        self.sky_e = sky_e;
        self.rest.fill(sky_e + self.dark_e);
        self
    }

    /// The same with the diffuse light of the sky `factor` times as bright.
    #[must_use]
    pub fn brighter(mut self, factor: f64) -> Self {
        let more = self.sky_e * (factor - 1.0);
        self.sky_e *= factor;
        self.rest.iter_mut().for_each(|rest| *rest += more);
        self
    }

    /// The same with the dark charge `factor` times as much.
    #[must_use]
    pub fn darker(mut self, factor: f64) -> Self {
        let more = self.dark_e * (factor - 1.0);
        self.dark_e *= factor;
        self.rest.iter_mut().for_each(|rest| *rest += more);
        self
    }

    /// The same read out by a detector that differs in its own noise.
    #[must_use]
    pub fn read_by(mut self, detector: &Detector) -> Self {
        [self.read2, self.rounding, self.prnu] = own_noise(detector);
        self
    }

    fn median_rest(&self) -> f64 {
        let mut rest = self.rest.clone();
        let middle = rest.len() / 2;
        if rest.is_empty() { 0.0 } else { *rest.select_nth_unstable_by(middle, f64::total_cmp).1 }
    }

    /// Dark charge \[e-/px\].
    pub fn dark_e(&self) -> f64 {
        self.dark_e
    }

    /// Length of what the target draws \[px\].
    pub fn length(&self) -> f64 {
        self.segment.length()
    }

    /// Width of a point's image as pixels see it \[px\].
    pub fn fwhm(&self) -> f64 {
        self.fwhm
    }

    /// The largest mean of a pixel with a target of so many electrons \[e-\].
    pub fn peak(&self, electrons: f64) -> f64 {
        self.share.iter().zip(&self.rest).map(|(p, b)| p * electrons + b).fold(0.0, f64::max)
    }

    fn floor(&self) -> f64 {
        self.read2 + self.rounding
    }

    /// A flux of so many electrons over an endless plane, measured.
    pub fn measure(&self, electrons: f64, estimator: Estimator) -> Measured {
        match estimator {
            Estimator::Optimal => self.optimal(electrons),
            Estimator::Aperture(Some(radius)) => self.aperture(electrons, radius),
            Estimator::Aperture(None) => {
                let radii = LADDER.iter().map(|k| (k * self.fwhm).max(LEAST_RADIUS_PX));
                let tried = radii.map(|radius| self.aperture(electrons, radius));
                tried.max_by(|a, b| a.snr.total_cmp(&b.snr)).unwrap_or_else(|| self.optimal(electrons))
            }
        }
    }

    fn optimal(&self, electrons: f64) -> Measured {
        let variance = |p: f64, rest: f64| (p * electrons + rest + self.floor()).max(LEAST_VARIANCE);
        let (mut a, mut b, mut c) = (0.0, 0.0, 0.0);
        for (p, rest) in self.share.iter().zip(&self.rest) {
            let v = variance(*p, *rest);
            a += p * p / v;
            b += 1.0 / v;
            c += p / v;
        }
        let information = a - c * c / b;
        let weights = self.share.iter().zip(&self.rest).map(|(p, rest)| p / (variance(*p, *rest) * a));
        let seen = Seen { signal_e: electrons, radius: f64::NAN, n_background: f64::NAN };
        self.told(electrons, weights, &seen, (1.0 / information - 1.0 / a).max(0.0), 1.0 / information)
    }

    fn aperture(&self, electrons: f64, radius: f64) -> Measured {
        let [inner, outer] = aperture::annulus_radii(radius, self.fwhm);
        let mut weights = vec![0.0; self.share.len()];
        let (mut area, mut inside, mut beside, mut n) = (0.0, 0.0, 0.0, 0.0);
        let mut level = Vec::new();
        for (i, place) in self.place.iter().enumerate() {
            let distance = self.segment.distance(*place);
            weights[i] = aperture::overlap(&self.segment, *place, distance, radius, LINES);
            area += weights[i];
            inside += weights[i] * self.share[i];
            if distance >= inner && distance <= outer {
                n += 1.0;
                beside += self.share[i];
                level.push(self.rest[i]);
            }
        }
        // stars in the ring are left out of it by the photometry
        let middle = level.len() / 2;
        let level = if level.is_empty() { 0.0 } else { *level.select_nth_unstable_by(middle, f64::total_cmp).1 };
        let n = f64::max(n, 1.0);
        let signal_e = electrons * (inside - area * beside / n);
        let background = area * area * (level + self.floor()) / n;
        let own = weights.iter().zip(&self.share).zip(&self.rest);
        let own = own.map(|((w, p), rest)| w * w * (p * electrons + rest + self.floor())).sum::<f64>();
        let seen = Seen { signal_e, radius, n_background: n };
        self.told(electrons, weights.iter().copied(), &seen, background, own + background)
    }

    /// The noise by its causes, from the weights of the pixels, the variance of the background's level and that of all.
    fn told(
        &self,
        electrons: f64,
        weights: impl Iterator<Item = f64>,
        seen: &Seen,
        background: f64,
        variance: f64,
    ) -> Measured {
        let (mut square, mut shot, mut rest, mut flat, mut shares) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for ((w, p), level) in weights.zip(&self.share).zip(&self.rest) {
            square += w * w;
            shot += w * w * p * electrons;
            rest += w * w * level;
            flat += w * w * p * p;
            shares += p * p;
        }
        let per_px = if square > 0.0 { rest / square } else { 0.0 };
        let stars_e_px = (per_px - self.sky_e - self.dark_e).max(0.0);
        let terms = Terms {
            shot,
            sky: square * (per_px - self.dark_e - stars_e_px),
            stars: square * stars_e_px,
            dark: square * self.dark_e,
            read: square * self.read2,
            rounding: square * self.rounding,
            background,
        };
        let signal_e = seen.signal_e;
        let snr = if variance > 0.0 { signal_e / variance.sqrt() } else { 0.0 };
        let of_pixel = per_px + self.floor();
        // the variances of bright sources differ from their signals by rounding errors
        let n_px = if of_pixel > 1e-9 { ((variance - signal_e) / of_pixel).max(0.0) } else { 1.0 / shares };
        Measured {
            snr,
            signal_e,
            sky_e_px: per_px - self.dark_e,
            stars_e_px,
            n_px,
            aperture_px: seen.radius,
            n_background_px: seen.n_background,
            terms,
            flat: if signal_e > 0.0 { electrons / signal_e * self.prnu * flat.sqrt() } else { 0.0 },
            peak_e: self.peak(electrons),
        }
    }
}

/// What an estimator makes of a signal.
struct Seen {
    signal_e: f64,
    radius: f64,
    n_background: f64,
}

fn segment(path: &Path) -> Segment {
    Segment { centre: path.mid, half: (path.end - path.start) / 2.0 }
}

/// Light of the sky at a pixel as the chip gets it \[e-/px\].
fn sky_at(evenness: &Evenness, sky_e: f64, place: DVec2) -> f64 {
    let Some(one) = Region::around(place, 0.0, [usize::MAX, usize::MAX]) else { return sky_e };
    let mut value = [sky_e];
    evenness.apply(&one, &mut value);
    value[0]
}
