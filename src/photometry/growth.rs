//! The point spread function as far as a frame tells it: an average over profiles, each with its weight
//! (`psf_fit`), and the shares of a source's light that follow, with their uncertainty.

use super::aperture;
use super::point_image::{GAUSS, PointImage};
use super::profile::{Grid, Shape, share};
use super::rings::{POINT_PX, pixels_around};
use super::segment::Segment;
use super::trend::Trend;
use glam::{DMat2, DVec2};

/// Uncertainty of the light outside an aperture that no family describes, as a share of that light.
pub const WING_FLOOR: f64 = 0.01;

/// One profile of the posterior.
#[derive(Debug, Clone)]
pub(super) struct Component {
    pub weight: f64,
    pub shape: Shape,
    pub fwhm: f64,
    pub profile: Vec<f64>,
}

impl Component {
    pub fn new(grid: &Grid, weight: f64, shape: Shape, fwhm: f64) -> Self {
        Self { weight, shape, fwhm, profile: grid.profile(shape, fwhm) }
    }
}

/// The point spread function as far as the frame tells it.
#[derive(Debug, Clone)]
pub struct Psf {
    pub(super) grid: Grid,
    pub(super) components: Vec<Component>,
    /// Full width at half maximum, before pixels blur it \[px\].
    pub fwhm_px: f64,
    /// The likeliest shape.
    pub shape: Shape,
    /// How its width changes over the frame.
    pub trend: Trend,
    /// What makes it longer one way than the other: offsets are round as this matrix sees them.
    pub lens: DMat2,
    /// Whether the source that is to be measured alone tells it: its noise then is in both.
    pub own: bool,
}

/// The light of a source inside an aperture, and its density in an annulus.
#[derive(Debug, Clone)]
pub struct ShareWeights(Vec<f64>);

impl Psf {
    /// A point spread function that is known.
    pub fn known(shape: Shape, fwhm_px: f64) -> Self {
        let grid = Grid::new(fwhm_px, 60.0 * fwhm_px);
        let components = vec![Component::new(&grid, 1.0, shape, fwhm_px)];
        Self { grid, components, fwhm_px, shape, trend: Trend::NONE, lens: DMat2::IDENTITY, own: false }
    }

    /// What it is at a place, from -1 to 1 from border to border.
    #[must_use]
    pub fn at(&self, place: DVec2) -> Self {
        self.wider(self.trend.factor(place))
    }

    /// The same with all widths multiplied.
    #[must_use]
    pub fn wider(&self, factor: f64) -> Self {
        if factor == 1.0 || !factor.is_finite() {
            return self.clone();
        }
        let wider = |c: &Component| Component::new(&self.grid, c.weight, c.shape, factor * c.fwhm);
        let components = self.components.iter().map(wider).collect();
        let grid = self.grid.clone();
        Self { grid, components, fwhm_px: factor * self.fwhm_px, trend: Trend::NONE, ..*self }
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
        PointImage::new(&self.grid, &mean, self.fwhm_px, reach).through(self.lens)
    }

    /// Each profile's weight and the shares of `source` that it gives the pixels at `places`, out to the reach of `image`.
    pub fn each(&self, image: &PointImage, source: &Segment, places: &[DVec2]) -> Vec<(f64, Vec<f64>)> {
        let still = places.iter().all(|p| image.seen(source, *p).1.length() < 0.01 * self.fwhm_px);
        if !still {
            let of = |c: &Component| {
                let own = PointImage::new(&self.grid, &c.profile, self.fwhm_px, image.reach()).through(self.lens);
                (c.weight, places.iter().map(|p| own.share(source, *p)).collect())
            };
            return self.components.iter().map(of).collect();
        }
        let seen = places.iter().map(|p| {
            let (offset, _, density) = image.seen(source, *p);
            let (start, basis) = self.grid.stencil(offset.length());
            (start, basis.map(|b| if offset.length() > image.reach() { 0.0 } else { density * b }))
        });
        let seen = seen.collect::<Vec<_>>();
        let light = |c: &Component, (start, basis): &(usize, [f64; 3])| {
            c.profile.get(*start..*start + 3).map_or(0.0, |p| p[0] * basis[0] + p[1] * basis[1] + p[2] * basis[2])
        };
        self.components.iter().map(|c| (c.weight, seen.iter().map(|s| light(c, s)).collect())).collect()
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
