//! The frame's point spread function from the growth of light around its bright sources, and the enclosed
//! shares that follow, with their uncertainty.
//!
//! Around each source the light is summed in rings about its segment (rings around points, pill-shaped ones
//! around trails). A profile of one of the families of [`super::profile`] predicts these sums up to the
//! source's flux and background, which are solved for source by source; chi-square over all sources is the
//! profile's likelihood. Shape and width are not simply set to the best fit: the enclosed share is averaged
//! over the posterior (flat in 1/beta, ln FWHM, and between the two families), so that what the frame
//! does not tell about the wings appears as the share's uncertainty and widens the flux error honestly.
//! Chi-square is scaled to the best fit's when that exceeds its degrees of freedom.

use super::aperture;
use super::point_image::{GAUSS, PointImage};
use super::profile::{Grid, Shape, share};
use super::rings::{Geometry, POINT_PX, Rings, pixels_around};
use super::segment::Segment;
use glam::DVec2;
use rayon::prelude::*;

/// Uncertainty of the light outside an aperture that no family describes, as a share of that light.
pub const WING_FLOOR: f64 = 0.01;
/// Widest wings considered: 1/beta.
const MAX_INVERSE_BETA: f64 = 0.6;

/// One profile of the posterior.
#[derive(Debug, Clone)]
struct Component {
    weight: f64,
    profile: Vec<f64>,
}

/// The point spread function as far as the frame tells it.
#[derive(Debug, Clone)]
pub struct Psf {
    grid: Grid,
    components: Vec<Component>,
    /// Full width at half maximum, before pixels blur it \[px\].
    pub fwhm_px: f64,
    /// The likeliest shape.
    pub shape: Shape,
}

/// The light of a source inside an aperture, and its density in an annulus.
#[derive(Debug, Clone)]
pub struct ShareWeights(Vec<f64>);

impl Psf {
    /// A point spread function that is known.
    pub fn known(shape: Shape, fwhm_px: f64) -> Self {
        let grid = Grid::new(fwhm_px, 60.0 * fwhm_px);
        let components = vec![Component { weight: 1.0, profile: grid.profile(shape, fwhm_px) }];
        Self { grid, components, fwhm_px, shape }
    }

    /// Weights of the share that an aperture of `radius` about `source` \[px\] collects beyond the light that
    /// the annulus between `inner` and `outer` takes for background. `placed`: the source's place within its pixel
    /// counts, as it does for one target; the average over places serves many stars.
    pub fn effective_weights(
        &self,
        radius: f64,
        [inner, outer]: [f64; 2],
        source: &Segment,
        placed: bool,
    ) -> ShareWeights {
        let length = source.length();
        let area = |r: f64| std::f64::consts::PI * r * r + 2.0 * r * length;
        let ratio = area(radius) / (area(outer) - area(inner));
        let mut weights = if placed && length < POINT_PX {
            let mut weights = self.grid.no_weights();
            for (place, distance) in pixels_around(source.centre, radius) {
                let inside = aperture::overlap(source, place, distance, radius, aperture::LINES);
                self.grid.add_pixel(&mut weights, distance, inside);
            }
            weights
        } else {
            self.grid.share_weights(radius, length)
        };
        let beside =
            self.grid.share_weights(outer, length).into_iter().zip(self.grid.share_weights(inner, length));
        for (w, (o, i)) in weights.iter_mut().zip(beside) {
            *w -= ratio * (o - i);
        }
        ShareWeights(weights)
    }

    /// The mean image of the posterior, out to `reach` \[px\].
    pub fn image(&self, reach: f64) -> PointImage {
        let mut mean = self.grid.no_weights();
        for c in &self.components {
            mean.iter_mut().zip(&c.profile).for_each(|(m, p)| *m += c.weight * p);
        }
        PointImage::new(&self.grid, &mean, self.fwhm_px, reach)
    }

    /// Weights of nothing.
    pub fn no_weights(&self) -> ShareWeights {
        ShareWeights(self.grid.no_weights())
    }

    /// Adds the light of `source` in the pixel at `place`, counted by `share`, as `image` spreads it: exact for a point,
    /// by quadrature along a trail.
    pub fn add_pixel(
        &self,
        weights: &mut ShareWeights,
        image: &PointImage,
        source: &Segment,
        place: DVec2,
        share: f64,
    ) {
        /// Light from farther along a trail is of no account \[FWHM\].
        const FAR: f64 = 6.0;
        let (offset, half, density) = image.seen(source, place);
        let length = half.length();
        if length < 0.01 * self.fwhm_px {
            return self.grid.add_pixel(&mut weights.0, offset.length(), share * density);
        }
        let along = half / length;
        let (s, across) = (offset.dot(along), offset.perp_dot(along));
        let (from, to) = ((s - length).max(-FAR * self.fwhm_px), (s + length).min(FAR * self.fwhm_px));
        if to.is_nan() || to <= from {
            return;
        }
        let panels = ((to - from) / self.fwhm_px).ceil().clamp(1.0, 2.0 * FAR);
        let width = (to - from) / panels;
        for panel in 0..panels as usize {
            for (t, w) in GAUSS {
                let distance = across.hypot(from + width * (panel as f64 + t));
                self.grid.add_pixel(&mut weights.0, distance, share * density * w * width / (2.0 * length));
            }
        }
    }

    /// The share by each profile of the posterior.
    pub fn shares(&self, weights: &ShareWeights) -> Vec<f64> {
        self.components.iter().map(|c| share(&weights.0, &c.profile)).collect()
    }

    /// Mean of a share over the posterior.
    pub fn mean(&self, shares: &[f64]) -> f64 {
        self.components.iter().zip(shares).map(|(c, s)| c.weight * s).sum()
    }

    /// Covariance of two shares over the posterior, with the floor for unmodelled wings.
    pub fn covariance(&self, a: &[f64], b: &[f64]) -> f64 {
        let (mean_a, mean_b) = (self.mean(a), self.mean(b));
        let products = self.components.iter().zip(a).zip(b);
        let spread: f64 = products.map(|((c, a), b)| c.weight * (a - mean_a) * (b - mean_b)).sum();
        spread + WING_FLOOR * WING_FLOOR * (1.0 - mean_a) * (1.0 - mean_b)
    }
}

/// The fit of one frame.
struct Fit<'a> {
    grid: Grid,
    sources: Vec<(&'a Rings, usize, Vec<f64>)>,
    geometries: Vec<Geometry>,
    /// Whether there are points, and trails.
    kinds: [bool; 2],
    expected: (f64, f64),
}

impl Fit<'_> {
    fn ring_shares(&self, profile: &[f64]) -> Vec<Vec<f64>> {
        self.geometries.iter().map(|g| g.rings.iter().map(|w| share(w, profile)).collect()).collect()
    }

    /// chi-square of a profile, the expectation of its width included.
    fn chi2(&self, shape: Shape, fwhm: f64) -> f64 {
        let shares = self.ring_shares(&self.grid.profile_of(shape, fwhm, self.kinds));
        let sources = self.sources.iter().map(|(rings, class, weights)| {
            rings.solve(&shares[*class], &self.geometries[*class].area, weights).2.iter().sum::<f64>()
        });
        let (expected, width) = self.expected;
        sources.sum::<f64>() + ((fwhm / expected).ln() / width).powi(2)
    }

    /// Best width of a shape near `start`, searched over a factor `span` to both sides: (fwhm, chi-square,
    /// standard deviation of ln fwhm).
    fn width(&self, shape: Shape, start: f64, span: f64) -> (f64, f64, f64) {
        let chi2 = |x: f64| self.chi2(shape, x.exp());
        let (middle, half) = (start.ln(), span.ln());
        let steps = if span > 1.5 { 12 } else { 4 };
        let grid = (0..=steps).map(|i| middle - half + 2.0 * half * f64::from(i) / f64::from(steps));
        let best = grid.map(|x| (x, chi2(x))).fold((middle, f64::INFINITY), |a, b| if b.1 < a.1 { b } else { a });
        let h = 2.0 * half / f64::from(steps);
        let (x, y) = summit(best, h, chi2);
        let d = (0.02 * h).max(1e-3);
        let curvature = (chi2(x + d) - 2.0 * y + chi2(x - d)) / (d * d);
        let sigma = if curvature > 0.0 { (2.0 / curvature).sqrt() } else { self.expected.1 };
        (x.exp(), y, sigma.clamp(1e-4, self.expected.1))
    }

    /// Weights from a reference profile.
    fn reweight(&mut self, shape: Shape, fwhm: f64) {
        let shares = self.ring_shares(&self.grid.profile(shape, fwhm));
        let geometries = &self.geometries;
        for (rings, class, weights) in &mut self.sources {
            let (shares, area) = (&shares[*class], &geometries[*class].area);
            for _ in 0..2 {
                let (flux, _, _) = rings.solve(shares, area, weights);
                *weights = rings.weights(flux, shares);
            }
        }
    }

    /// Leaves out rings that the best profile does not explain (a star not in the catalogue), and whole sources (a
    /// blend). The profile must be the best one: rings rejected under another would pull towards it.
    fn reject(&mut self, shape: Shape, fwhm: f64) {
        self.reweight(shape, fwhm);
        let shares = self.ring_shares(&self.grid.profile(shape, fwhm));
        let mut quality = Vec::new();
        for (rings, class, weights) in &mut self.sources {
            let mut chi2 = rings.solve(&shares[*class], &self.geometries[*class].area, weights).2;
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
}

/// The minimum of `f` near its value at `best`, by parabolas through three points `h` apart, each narrower than the last:
/// (place, value).
fn summit(mut best: (f64, f64), mut h: f64, f: impl Fn(f64) -> f64) -> (f64, f64) {
    let start = best.0;
    let reach = h;
    for _ in 0..3 {
        let (below, above) = (f(best.0 - h), f(best.0 + h));
        let curvature = below - 2.0 * best.1 + above;
        let step = if curvature > 0.0 { 0.5 * h * (below - above) / curvature } else { h.copysign(below - above) };
        let step = step.clamp(-h, h);
        let there = (best.0 + step).clamp(start - reach, start + reach);
        let tried = [(best.0 - h, below), (best.0 + h, above), (there, f(there))];
        let lowest = tried.into_iter().fold(best, |a, b| if b.1 < a.1 { b } else { a });
        best = (lowest.0.clamp(start - reach, start + reach), lowest.1);
        h *= 0.2;
    }
    best
}

/// Golden-section minimum of `f` between `a` and `b` in `steps` steps: (place, value).
fn golden(mut a: f64, mut b: f64, steps: usize, f: impl Fn(f64) -> f64) -> (f64, f64) {
    const G: f64 = 0.618_033_988_749_895;
    let (mut c, mut d) = (b - G * (b - a), a + G * (b - a));
    let (mut fc, mut fd) = (f(c), f(d));
    for _ in 0..steps {
        if fc < fd {
            (b, d, fd) = (d, c, fc);
            c = b - G * (b - a);
            fc = f(c);
        } else {
            (a, c, fc) = (c, d, fd);
            d = a + G * (b - a);
            fd = f(d);
        }
    }
    if fc < fd { (c, fc) } else { (d, fd) }
}

/// The posterior of the point spread function from the rings of bright sources. `expected` is the FWHM \[px\] and
/// the standard deviation of its logarithm known beforehand; without sources it is all there is.
pub fn fit(sources: &[Rings], edges: &[f64], expected: (f64, f64), reach: f64) -> Psf {
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
    let mut fit = Fit { grid, sources, geometries, kinds, expected };
    let seed = Shape::Moffat { inverse_beta: 0.25 };
    let mut fwhm = expected.0;
    for span in [3.0, 1.5] {
        fit.reweight(seed, fwhm);
        fwhm = fit.width(seed, fwhm, span).0;
    }
    posterior(fit, fwhm)
}

/// Average over 1/beta around the best Moffat profile, and over the families.
fn posterior(mut fit: Fit, mut fwhm: f64) -> Psf {
    let moffat = |q: f64| Shape::Moffat { inverse_beta: q.clamp(0.0, MAX_INVERSE_BETA) };
    let coarse = |fit: &Fit, fwhm: f64| {
        let tried = (0..=6).into_par_iter().map(|i| 0.1 * f64::from(i));
        let tried = tried.map(|q| (q, fit.width(moffat(q), fwhm, 1.3))).collect::<Vec<_>>();
        tried.into_iter().fold((0.25, (fwhm, f64::INFINITY, 0.1)), |a, b| if b.1.1 < a.1.1 { b } else { a })
    };
    for _ in 0..2 {
        let (q, (width, ..)) = coarse(&fit, fwhm);
        fwhm = width;
        fit.reweight(moffat(q), fwhm);
    }
    let (mut q, _) = coarse(&fit, fwhm);
    (q, _) =
        golden((q - 0.1).max(0.0), (q + 0.1).min(MAX_INVERSE_BETA), 5, |q| fit.width(moffat(q), fwhm, 1.15).1);
    let (turbulent, fitted) = (fit.width(Shape::Kolmogorov, fwhm, 1.3), fit.width(moffat(q), fwhm, 1.15));
    if turbulent.1 < fitted.1 {
        fit.reject(Shape::Kolmogorov, turbulent.0);
    } else {
        fit.reject(moffat(q), fitted.0);
    }
    fwhm = fitted.0;
    let at = |q: f64| fit.width(moffat(q), fwhm, 1.15).1;
    let (q, best) = golden((q - 0.1).max(0.0), (q + 0.1).min(MAX_INVERSE_BETA), 8, at);
    let rows =
        fit.sources.iter().map(|(_, _, w)| w.iter().filter(|w| **w > 0.0).count() as f64 - 2.0).sum::<f64>();
    let kolmogorov = fit.width(Shape::Kolmogorov, fwhm, 1.3);
    let scale = (best.min(kolmogorov.1) / (rows - 2.0).max(1.0)).max(1.0);
    // where chi-square has risen by 1, on the side that is open
    let side = if q > 0.25 { -1.0 } else { 1.0 };
    let slope = [0.02, 0.1].map(|d| (at(q + side * d) - best).max(1e-3) / scale / (d * d));
    let sigma = (1.0 / slope[0].min(slope[1]).max(1.0)).sqrt().clamp(0.002, 0.3);
    let low = (q - 3.0 * sigma).max(0.0);
    let high = (q + 3.0 * sigma).min(MAX_INVERSE_BETA);
    const NODES: usize = 7;
    let step = (high - low) / (NODES - 1) as f64;
    let member = |i: usize| {
        let shape = moffat(low + step * i as f64);
        // each node stands for its part of the prior, uniform in 1/beta
        (shape, fit.width(shape, fwhm, 1.15), step / MAX_INVERSE_BETA)
    };
    let mut members = (0..NODES).into_par_iter().map(member).collect::<Vec<_>>();
    members.push((Shape::Kolmogorov, kolmogorov, 1.0));
    let least = members.iter().map(|m| m.1.1).fold(f64::INFINITY, f64::min);
    let mut components = Vec::new();
    let (mut total, mut likeliest) = (0.0, (0.0, Shape::Kolmogorov, fwhm));
    for (shape, (width, chi2, sigma), prior) in members {
        let weight = prior * (-0.5 * (chi2 - least) / scale).exp();
        if weight > likeliest.0 {
            likeliest = (weight, shape, width);
        }
        total += weight;
        if weight > 1e-4 {
            let sigma = (sigma * scale.sqrt()).min(fit.expected.1) * std::f64::consts::SQRT_2;
            for (factor, part) in [(-sigma, 0.25), (0.0, 0.5), (sigma, 0.25)] {
                let profile = fit.grid.profile(shape, width * factor.exp());
                components.push(Component { weight: weight * part, profile });
            }
        }
    }
    let used: f64 = components.iter().map(|c| c.weight).sum();
    components.iter_mut().for_each(|c| c.weight /= used.max(1e-300));
    debug_assert!(total >= used);
    Psf { grid: fit.grid, components, fwhm_px: likeliest.2, shape: likeliest.1 }
}
