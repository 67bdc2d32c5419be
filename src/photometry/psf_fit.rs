//! The point spread function from the growth of light around a frame's bright sources.
//!
//! Around each source the light is summed in rings about its segment (rings around points, pill-shaped ones
//! around trails, [`super::rings`]). A profile of one of the families of [`super::profile`] predicts these sums up
//! to the source's flux and background, which are solved for source by source; chi-square over all sources is the
//! profile's likelihood. Shape and width are not simply set to the best fit: the enclosed share is averaged
//! over the posterior (flat in 1/beta, ln FWHM, and between the two families), so that what the frame
//! does not tell about the wings appears as the share's uncertainty and widens the flux error honestly.
//! Chi-square is scaled to the best fit's when that exceeds its degrees of freedom.

use super::growth::{Component, Psf};
use super::profile::{Grid, Shape};
use super::rings::{Geometry, POINT_PX, Rings};
use super::trend::{OwnWidth, Trend};
use glam::DMat2;

/// Widest wings considered: 1/beta.
const MAX_INVERSE_BETA: f64 = 0.6;
/// Neighbouring shapes of the first search, in 1/beta.
const COARSE: f64 = 0.1;

/// The fit of one frame.
pub struct Fit<'a> {
    grid: Grid,
    sources: Vec<(&'a Rings, usize, Vec<f64>)>,
    geometries: Vec<Geometry>,
    /// Whether there are points, and trails.
    kinds: [bool; 2],
    expected: (f64, f64),
    /// Best width so far \[px\].
    fwhm: f64,
}

/// The best width of a shape.
#[derive(Debug, Clone, Copy)]
struct Width {
    fwhm: f64,
    chi2: f64,
    /// Standard deviation of ln FWHM.
    sigma: f64,
}

fn moffat(inverse_beta: f64) -> Shape {
    Shape::Moffat { inverse_beta: inverse_beta.clamp(0.0, MAX_INVERSE_BETA) }
}

impl<'a> Fit<'a> {
    /// Of the rings of bright sources, to a first width. `expected` is the FWHM \[px\] and the standard deviation of its
    /// logarithm known beforehand; without sources it is all there is.
    pub fn new(sources: &'a [Rings], edges: &[f64], expected: (f64, f64), reach: f64) -> Self {
        let grid = Grid::new(expected.0, reach);
        let mut geometries = Vec::new();
        let mut lengths: Vec<f64> = Vec::new();
        let mut classes = Vec::new();
        for source in sources {
            // trails of a frame differ by field curvature: one length to a part in 200 serves all
            let same = |l: &f64| *l >= POINT_PX && (l - source.length).abs() <= 0.005 * l;
            let known = lengths.iter().position(same);
            classes.push(known.unwrap_or_else(|| {
                lengths.push(source.length);
                geometries.push(Geometry::new(&grid, edges, source));
                lengths.len() - 1
            }));
        }
        let flat = |s: &Rings| s.area_px.iter().map(|a| if *a > 0.0 { 1.0 / a } else { 0.0 }).collect::<Vec<_>>();
        let sources = sources.iter().zip(classes).map(|(s, class)| (s, class, flat(s))).collect();
        let kinds = [lengths.iter().any(|l| *l < POINT_PX), lengths.iter().any(|l| *l >= POINT_PX)];
        let mut fit = Self { grid, sources, geometries, kinds, expected, fwhm: expected.0 };
        let seed = moffat(0.25);
        for (span, steps) in [(3.0f64, 12), (1.5, 4)] {
            fit.reweight(seed, fit.fwhm);
            let half = span.ln();
            let scan =
                (0..=steps).map(|i| fit.fwhm * (half * (2.0 * f64::from(i) / f64::from(steps) - 1.0)).exp());
            let tried = scan.map(|fwhm| (fwhm, fit.chi2(seed, fwhm)));
            let (start, _) = tried.fold((fit.fwhm, f64::INFINITY), |a, b| if b.1 < a.1 { b } else { a });
            fit.fwhm = fit.width(seed, start, half / f64::from(steps)).fwhm;
        }
        fit
    }

    /// The best width so far \[px\].
    pub fn fwhm_px(&self) -> f64 {
        self.fwhm
    }

    fn ring_shares(&self, shape: Shape, fwhm: f64) -> Vec<Vec<f64>> {
        let profile = self.grid.profile_of(shape, fwhm, self.kinds);
        self.geometries.iter().map(|g| g.shares(&profile)).collect()
    }

    /// chi-square of a profile, the expectation of its width included.
    fn chi2(&self, shape: Shape, fwhm: f64) -> f64 {
        let shares = self.ring_shares(shape, fwhm);
        let sources = self.sources.iter().map(|(rings, class, weights)| {
            rings.misfits(&shares[*class], &self.geometries[*class].area, weights).sum::<f64>()
        });
        let (expected, width) = self.expected;
        sources.sum::<f64>() + ((fwhm / expected).ln() / width).powi(2)
    }

    /// Best width of a shape near `start`, known to about `step` in ln FWHM.
    fn width(&self, shape: Shape, start: f64, step: f64) -> Width {
        let (x, chi2, curvature) = summit(start.ln(), step, |x| self.chi2(shape, x.exp()));
        let sigma = if curvature > 0.0 { (2.0 / curvature).sqrt() } else { self.expected.1 };
        Width { fwhm: x.exp(), chi2, sigma: sigma.clamp(1e-4, self.expected.1) }
    }

    /// Best width of a shape like one whose width is known.
    fn width_nearby(&self, shape: Shape, start: f64) -> Width {
        self.width(shape, start, 0.03)
    }

    /// Best Moffat profile near 1/beta = `start`, known to about `step`: 1/beta and its width.
    fn best_moffat(&self, start: f64, step: f64) -> (f64, Width) {
        let (q, _, _) = summit(start, step, |q| self.width_nearby(moffat(q), self.fwhm).chi2);
        let q = q.clamp(0.0, MAX_INVERSE_BETA);
        (q, self.width_nearby(moffat(q), self.fwhm))
    }

    /// Weights from a reference profile.
    fn reweight(&mut self, shape: Shape, fwhm: f64) {
        let shares = self.ring_shares(shape, fwhm);
        let geometries = &self.geometries;
        for (rings, class, weights) in &mut self.sources {
            let (shares, area) = (&shares[*class], &geometries[*class].area);
            for _ in 0..2 {
                let [flux, _] = rings.solve(shares, area, weights);
                *weights = rings.weights(flux, shares);
            }
        }
    }

    /// Leaves out rings that the best profile does not explain (a star not in the catalogue), and whole sources (a
    /// blend). The profile must be the best one: rings rejected under another would pull towards it.
    fn reject(&mut self, shape: Shape, fwhm: f64) {
        self.reweight(shape, fwhm);
        let shares = self.ring_shares(shape, fwhm);
        let mut quality = Vec::new();
        for (rings, class, weights) in &mut self.sources {
            let misfits = rings.misfits(&shares[*class], &self.geometries[*class].area, weights);
            let mut chi2 = misfits.collect::<Vec<_>>();
            let typical = (chi2.iter().sum::<f64>() / chi2.len().max(1) as f64).clamp(1.0, 4.0);
            for (w, c) in weights.iter_mut().zip(&mut chi2) {
                if *c > 20.0 * typical {
                    (*w, *c) = (0.0, 0.0);
                }
            }
            quality.push(chi2.iter().sum::<f64>() / chi2.len().max(1) as f64);
        }
        if quality.len() >= 4 {
            let mut sorted = quality.clone();
            sorted.sort_by(f64::total_cmp);
            let limit = (4.0 * sorted[sorted.len() / 2]).max(4.0);
            let mut keep = quality.into_iter().map(|q| q <= limit);
            self.sources.retain(|_| keep.next().unwrap_or(false));
        }
    }

    /// Average over 1/beta around the best Moffat profile, and over the families; and the width of each source by itself.
    pub fn posterior(mut self) -> (Psf, Vec<OwnWidth>) {
        let mut best = (0.25, Width { fwhm: self.fwhm, chi2: f64::INFINITY, sigma: 0.1 });
        let mut fwhm = self.fwhm;
        for i in 0..=6 {
            let q = COARSE * f64::from(i);
            let width = self.width_nearby(moffat(q), fwhm);
            fwhm = width.fwhm;
            if width.chi2 < best.1.chi2 {
                best = (q, width);
            }
        }
        for step in [0.5 * COARSE, 0.2 * COARSE] {
            self.fwhm = best.1.fwhm;
            self.reweight(moffat(best.0), self.fwhm);
            best = self.best_moffat(best.0, step);
        }
        let turbulent = self.width_nearby(Shape::Kolmogorov, best.1.fwhm);
        if turbulent.chi2 < best.1.chi2 {
            self.reject(Shape::Kolmogorov, turbulent.fwhm);
        } else {
            self.reject(moffat(best.0), best.1.fwhm);
        }
        self.fwhm = best.1.fwhm;
        let (q, width) = self.best_moffat(best.0, 0.2 * COARSE);
        let turbulent = self.width_nearby(Shape::Kolmogorov, width.fwhm);
        let own = (0..self.sources.len()).map(|i| self.own_width(i, moffat(q), width.fwhm)).collect();
        (self.average(q, width, turbulent), own)
    }

    /// The width of a source by itself, for a shape of `fwhm` on the whole.
    fn own_width(&self, source: usize, shape: Shape, fwhm: f64) -> OwnWidth {
        let (rings, class, weights) = &self.sources[source];
        let geometry = &self.geometries[*class];
        let chi2 = |x: f64| {
            let profile = self.grid.profile_of(shape, fwhm * x.exp(), self.kinds);
            let shares = geometry.shares(&profile);
            rings.misfits(&shares, &geometry.area, weights).sum::<f64>() + (x / self.expected.1).powi(2)
        };
        let (log_ratio, _, curvature) = summit(0.0, 0.03, chi2);
        let sigma = if curvature > 0.0 { (2.0 / curvature).sqrt() } else { f64::INFINITY };
        OwnWidth { centre: rings.centre, log_ratio, sigma }
    }

    /// The average around the best Moffat profile and over the families.
    fn average(self, q: f64, best: Width, turbulent: Width) -> Psf {
        let rows = |weights: &[f64]| weights.iter().filter(|w| **w > 0.0).count() as f64 - 2.0;
        let rows = self.sources.iter().map(|(_, _, w)| rows(w)).sum::<f64>();
        let scale = (best.chi2.min(turbulent.chi2) / (rows - 2.0).max(1.0)).max(1.0);
        // where chi-square has risen by 1, on the side that is open
        let side = if q > 0.25 { -1.0 } else { 1.0 };
        let rise = |d: f64| self.width_nearby(moffat(q + side * d), best.fwhm).chi2 - best.chi2;
        let slope = [0.02, 0.1].map(|d| rise(d).max(1e-3) / scale / (d * d));
        let sigma = (1.0 / slope[0].min(slope[1]).max(1.0)).sqrt().clamp(0.002, 0.3);
        let low = (q - 3.0 * sigma).max(0.0);
        let high = (q + 3.0 * sigma).min(MAX_INVERSE_BETA);
        const NODES: usize = 7;
        let step = (high - low) / (NODES - 1) as f64;
        let mut members = vec![(Shape::Kolmogorov, turbulent, 1.0)];
        for i in 0..NODES {
            let shape = moffat(low + step * i as f64);
            // each node stands for its part of the prior, uniform in 1/beta
            members.push((shape, self.width_nearby(shape, best.fwhm), step / MAX_INVERSE_BETA));
        }
        let least = members.iter().map(|m| m.1.chi2).fold(f64::INFINITY, f64::min);
        let mut components = Vec::new();
        let mut likeliest = (0.0, Shape::Kolmogorov, best.fwhm);
        for (shape, width, prior) in members {
            let weight = prior * (-0.5 * (width.chi2 - least) / scale).exp();
            if weight > likeliest.0 {
                likeliest = (weight, shape, width.fwhm);
            }
            if weight > 1e-4 {
                let sigma = (width.sigma * scale.sqrt()).min(self.expected.1) * std::f64::consts::SQRT_2;
                for (factor, part) in [(-sigma, 0.25), (0.0, 0.5), (sigma, 0.25)] {
                    components.push(Component::new(&self.grid, weight * part, shape, width.fwhm * factor.exp()));
                }
            }
        }
        let used: f64 = components.iter().map(|c| c.weight).sum();
        components.iter_mut().for_each(|c| c.weight /= used.max(1e-300));
        let (fwhm_px, shape) = (likeliest.2, likeliest.1);
        Psf { grid: self.grid, components, fwhm_px, shape, trend: Trend::NONE, lens: DMat2::IDENTITY, own: false }
    }
}

/// The minimum of `f` near `x`, known to about `h`, by parabolas through three points that draw together: place, value and
/// curvature. For a chi-square: to a tenth of the standard deviation that the curvature tells.
fn summit(x: f64, mut h: f64, f: impl Fn(f64) -> f64) -> (f64, f64, f64) {
    let mut best = (x, f(x));
    let mut curvature = 0.0;
    for _ in 0..6 {
        let (below, above) = (f(best.0 - h), f(best.0 + h));
        let second = below - 2.0 * best.1 + above;
        curvature = second / (h * h);
        let step = if second > 0.0 { 0.5 * h * (below - above) / second } else { h.copysign(below - above) };
        let step = step.clamp(-3.0 * h, 3.0 * h);
        let sigma = if curvature > 0.0 { (2.0 / curvature).sqrt() } else { 0.0 };
        if step.abs() < 0.1 * sigma && h < 2.0 * sigma.max(0.005) {
            break;
        }
        let there = best.0 + step;
        let tried = [(best.0 - h, below), (best.0 + h, above), (there, f(there))];
        best = tried.into_iter().fold(best, |a, b| if b.1 < a.1 { b } else { a });
        let found = step.abs() < 3.0 * h;
        h = if found { (0.3 * step.abs()).max(sigma).clamp(0.1 * h, 0.5 * h) } else { 2.0 * h };
    }
    (best.0, best.1, curvature)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::random::{Address, Stage};
    use crate::base::sample::normal;
    use crate::photometry::rings::ring_edges;
    use glam::DVec2;

    /// Rings of `count` points of `flux` \[e\] over `sky` \[e/px\], with their noise.
    fn points(shape: Shape, fwhm: f64, flux: f64, sky: f64, count: u64, seed: u64) -> (Vec<f64>, Vec<Rings>) {
        let edges = ring_edges(fwhm);
        let grid = Grid::new(fwhm, 60.0 * fwhm);
        let profile = grid.profile(shape, fwhm);
        let noise = Address { seed, frame: 0, stage: Stage::Shot };
        let rings = (0..count).map(|i| {
            let centre = DVec2::new(100.0 + 0.37 * i as f64, 50.0 - 0.21 * i as f64);
            let mut rings = Rings { sum_e: vec![], area_px: vec![], sky_variance: sky, length: 0.0, centre };
            let geometry = Geometry::new(&grid, &edges, &rings);
            let light = geometry.shares(&profile).into_iter().zip(&geometry.area).enumerate();
            let sum = light.map(|(k, (share, area))| {
                let mean = flux * share + sky * area;
                mean + mean.sqrt() * normal(&noise, 100 * i + k as u64)
            });
            rings.sum_e = sum.collect();
            rings.area_px = geometry.area;
            rings
        });
        let rings = rings.collect();
        (edges, rings)
    }

    /// The width within four of the errors that its likelihood tells (some 1e-3 here), whatever was expected.
    #[test]
    fn width_and_wings_are_found_from_a_wrong_expectation() {
        for (shape, fwhm) in
            [(moffat(0.05), 2.2), (moffat(0.3), 3.0), (moffat(0.45), 5.0), (Shape::Kolmogorov, 3.0)]
        {
            let (edges, rings) = points(shape, fwhm, 2e5, 200.0, 20, 3);
            for expected in [0.85 * fwhm, fwhm, 1.2 * fwhm] {
                let (psf, _) = Fit::new(&rings, &edges, (expected, 0.25), 60.0 * fwhm).posterior();
                assert!((psf.fwhm_px / fwhm - 1.0).abs() < 0.01, "{shape:?}: {} for {fwhm}", psf.fwhm_px);
                // the light within 1.5 FWHM, as told and as it is
                let weights = |psf: &Psf| {
                    psf.effective_weights(
                        1.5 * fwhm,
                        [8.0 * fwhm, 9.0 * fwhm],
                        &crate::photometry::segment::Segment::point(DVec2::splat(40.2)),
                        true,
                    )
                };
                let told = psf.shares(&weights(&psf));
                let truth = Psf::known(shape, fwhm);
                let true_share = truth.mean(&truth.shares(&weights(&truth)));
                let off = psf.mean(&told) - true_share;
                let sigma = psf.covariance(&told, &told).sqrt();
                assert!(off.abs() < 3.0 * sigma && sigma < 0.01, "{shape:?}: {off} +- {sigma}");
            }
        }
    }

    #[test]
    fn nothing_to_fit_is_what_was_expected() {
        let (psf, _) = Fit::new(&[], &ring_edges(3.0), (3.0, 0.25), 180.0).posterior();
        assert!((psf.fwhm_px / 3.0 - 1.0).abs() < 0.05, "{}", psf.fwhm_px);
    }

    #[test]
    fn a_parabola_has_one_summit() {
        for start in [-3.0, 0.9, 4.0] {
            let (x, y, curvature) = summit(start, 0.5, |x| 2.0 * (x - 1.0).powi(2) + 5.0);
            assert!((x - 1.0).abs() < 0.1 && y < 5.02 && (curvature - 4.0).abs() < 1e-6, "{start}: {x} {y}");
        }
        let flat = summit(0.0, 0.1, |_| f64::NAN);
        assert_eq!(flat.0, 0.0);
    }
}
