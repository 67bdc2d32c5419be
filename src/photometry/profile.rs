//! Images of a point: radial profiles, and the share of their light inside a circle or a pill.
//!
//! Two families of one width each: Moffat 1969, A&A 3, 455, I ~ (1 + (r/a)^2)^-beta, with the Gaussian as
//! its limit beta -> infinity; and Kolmogorov turbulence in a long exposure (Fried 1966, JOSA 56, 1372), the
//! transform of exp(-3.44 (f lambda/r0)^(5/3)), FWHM = 0.976 lambda/r0, wings r^(-11/3). A profile is blurred by
//! the pixel that collects it and by the pixel weights of the aperture: two unit boxes, averaged over directions
//! and over places within a pixel. A single point takes one place only: its light in each pixel is the profile
//! blurred by one box at the pixel's distance, and its share the sum over the pixels' own weights.
//!
//! For a source spread evenly over a segment of length L and a pill of radius r about the same segment, the
//! light that a point at distance rho and angle phi from its origin brings into the pill is the share of
//! origins that keep it inside, 1 - clamp(x - c, 0, L)/L with x = rho cos phi, c = sqrt(r^2 - y^2), and 0
//! for |y| > r. L -> 0 is the circle. So an enclosed share is a linear functional of the profile's values on a
//! radial grid, whose weights are computed once for each (r, L).

use std::f64::consts::PI;
use std::sync::OnceLock;

/// Shape of a profile.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// Moffat profile.
    Moffat {
        /// 1/beta; 0 = Gaussian, must stay below 1 for the light to be finite.
        inverse_beta: f64,
    },
    /// Long exposure through Kolmogorov turbulence.
    Kolmogorov,
}

/// A shape with its constants worked out, for FWHM = 1 and unit flux.
#[derive(Debug, Clone, Copy)]
enum Ready {
    Gaussian,
    /// Norm, 1/a^2, beta.
    Moffat(f64, f64, f64),
    Kolmogorov,
}

impl Shape {
    /// Intensity at `r`, for FWHM = 1 and unit flux.
    pub fn intensity(self, r: f64) -> f64 {
        self.ready().at(r)
    }

    fn ready(self) -> Ready {
        match self {
            Self::Moffat { inverse_beta } if inverse_beta < 1e-3 => Ready::Gaussian,
            Self::Moffat { inverse_beta } => {
                // 1/a^2 for FWHM = 1
                let k = 4.0 * (2f64.powf(inverse_beta) - 1.0);
                let beta = 1.0 / inverse_beta;
                Ready::Moffat((beta - 1.0) * k / PI, k, beta)
            }
            Self::Kolmogorov => Ready::Kolmogorov,
        }
    }
}

impl Ready {
    fn at(self, r: f64) -> f64 {
        match self {
            Self::Gaussian => {
                const K: f64 = 4.0 * std::f64::consts::LN_2;
                K / PI * (-K * r * r).exp()
            }
            Self::Moffat(norm, k, beta) => norm * (-beta * (k * r * r).ln_1p()).exp(),
            Self::Kolmogorov => kolmogorov(r),
        }
    }

    /// Intensity at `r` and its first three Laplacians, where they have a closed form: with u = r^2 and g(u) the
    /// intensity, nabla^2m = 4^m sum_i binom(m, i) m!/i! u^i g^(m+i).
    fn laplacians(self, r: f64) -> Option<[f64; 4]> {
        const K: f64 = 4.0 * std::f64::consts::LN_2;
        let u = r * r;
        let g = self.at(r);
        let mut d = [g; 7];
        match self {
            Self::Gaussian => (1..7).for_each(|n| d[n] = -K * d[n - 1]),
            Self::Moffat(_, k, beta) => {
                let slope = k / (1.0 + k * u);
                (1..7).for_each(|n| d[n] = -(beta + n as f64 - 1.0) * slope * d[n - 1]);
            }
            Self::Kolmogorov => return None,
        }
        let first = d[1] + u * d[2];
        let second = 2.0 * d[2] + u * (4.0 * d[3] + u * d[4]);
        let third = 6.0 * d[3] + u * (18.0 * d[4] + u * (9.0 * d[5] + u * d[6]));
        Some([g, 4.0 * first, 16.0 * second, 64.0 * third])
    }
}

/// FWHM of the Kolmogorov profile in units of lambda/r0.
const KOLMOGOROV_FWHM: f64 = 0.975_54;
/// Table in t = asinh(r / 0.3) of ln(intensity), r in FWHM, between whose values runs a cubic.
const TABLE_STEPS: usize = 200;
const TABLE_END: f64 = 20.0;
const TABLE_SOFT: f64 = 0.3;

fn kolmogorov(r: f64) -> f64 {
    static TABLE: OnceLock<Vec<f64>> = OnceLock::new();
    if r >= TABLE_END {
        return kolmogorov_wing(r);
    }
    let table = TABLE.get_or_init(|| {
        let step = (TABLE_END / TABLE_SOFT).asinh() / TABLE_STEPS as f64;
        (0..=TABLE_STEPS + 2).map(|i| kolmogorov_reference((i as f64 * step).sinh() * TABLE_SOFT).ln()).collect()
    });
    let t = (r / TABLE_SOFT).asinh() / (TABLE_END / TABLE_SOFT).asinh() * TABLE_STEPS as f64;
    let i = (t as usize).min(TABLE_STEPS);
    let u = t - i as f64;
    // even about the middle
    let [a, b, c, d] = [table[if i == 0 { 1 } else { i - 1 }], table[i], table[i + 1], table[i + 2]];
    (b + 0.5 * u * (c - a + u * (2.0 * a - 5.0 * b + 4.0 * c - d + u * (3.0 * (b - c) + d - a)))).exp()
}

/// The first two terms of the wings, from the powers f^(5/3) and f^(10/3) of the transfer function.
fn kolmogorov_wing(r: f64) -> f64 {
    let theta = r * KOLMOGOROV_FWHM;
    KOLMOGOROV_FWHM.powi(2) * (0.022_883 * theta.powf(-11.0 / 3.0) + 0.025_89 * theta.powf(-16.0 / 3.0))
}

/// The Hankel transform by Simpson's rule in u = f^(1/3), where the integrand is smooth.
fn kolmogorov_reference(r: f64) -> f64 {
    if r > 8.0 {
        return kolmogorov_wing(r);
    }
    const STEPS: usize = 1200;
    let theta = r * KOLMOGOROV_FWHM;
    let end = 4f64.cbrt();
    let h = end / STEPS as f64;
    let integrand = |u: f64| {
        let f = u * u * u;
        3.0 * u * u * f * libm::j0(2.0 * PI * f * theta) * (-3.44 * u.powi(5)).exp()
    };
    let sum: f64 = (0..=STEPS)
        .map(|i| {
            let weight = if i == 0 || i == STEPS { 1.0 } else { (2 + 2 * (i % 2)) as f64 };
            weight * integrand(i as f64 * h)
        })
        .sum();
    2.0 * PI * KOLMOGOROV_FWHM.powi(2) * sum * h / 3.0
}

/// Radii at which profiles are kept \[px\]: ring edges and the middles between them, 2 n + 1 in all.
#[derive(Debug, Clone)]
pub struct Grid {
    nodes: Vec<f64>,
}

impl Grid {
    /// A grid for images of about this FWHM \[px\], out to at least `reach` \[px\].
    pub fn new(fwhm: f64, reach: f64) -> Self {
        let fwhm = if fwhm.is_finite() { fwhm.clamp(0.5, 100.0) } else { 3.0 };
        let end = reach.clamp(30.0 * fwhm, 5000.0);
        let mut nodes = vec![0.0];
        let mut edge = 0.0;
        while edge < end {
            let step = (0.1 * fwhm).max(0.1 * edge);
            nodes.push(edge + 0.5 * step);
            edge += step;
            nodes.push(edge);
        }
        Self { nodes }
    }

    /// Surface brightness \[1/px^2\] at the grid's radii of a profile of `fwhm` \[px\], blurred by one box (what a
    /// pixel collects) and then, as many values again, by two (what weighted pixels sum to on average).
    pub fn profile(&self, shape: Shape, fwhm: f64) -> Vec<f64> {
        self.profile_of(shape, fwhm, [true; 2])
    }

    /// The same for points, for trails, or for both; what is not asked for is 0.
    pub fn profile_of(&self, shape: Shape, fwhm: f64, kinds: [bool; 2]) -> Vec<f64> {
        let ready = shape.ready();
        let mut profile = self.no_weights();
        let n = self.nodes.len();
        for (half, (blur, _)) in BOXES.iter().zip(kinds).enumerate().filter(|(_, (_, asked))| *asked) {
            let values = profile[half * n..].iter_mut().zip(&self.nodes);
            values.for_each(|(value, r)| *value = blurred(ready, fwhm, *r, blur));
        }
        profile
    }

    /// Weights of nothing.
    pub fn no_weights(&self) -> Vec<f64> {
        vec![0.0; 2 * self.nodes.len()]
    }

    /// The light of a point in a pixel `distance` \[px\] from it, for a profile on this grid \[1/px\].
    pub fn light(&self, profile: &[f64], distance: f64) -> f64 {
        let above = self.nodes.partition_point(|r| *r <= distance);
        let start = (above.saturating_sub(1) & !1).min(self.nodes.len() - 3);
        let basis = quadratic(&self.nodes[start..start + 3], distance);
        basis.iter().zip(profile.get(start..).unwrap_or_default()).map(|(b, p)| b * p).sum()
    }

    /// Adds to `weights` the light of a point in a pixel `distance` \[px\] from it that counts by `share`.
    pub fn add_pixel(&self, weights: &mut [f64], distance: f64, share: f64) {
        let above = self.nodes.partition_point(|r| *r <= distance);
        let start = (above.saturating_sub(1) & !1).min(self.nodes.len() - 3);
        let basis = quadratic(&self.nodes[start..start + 3], distance);
        weights[start..start + 3].iter_mut().zip(basis).for_each(|(w, b)| *w += share * b);
    }

    /// Weights that turn a profile on this grid into the share enclosed by a pill of `radius` about a source
    /// of `length` \[px\].
    pub fn share_weights(&self, radius: f64, length: f64) -> Vec<f64> {
        let mut all = self.no_weights();
        let weights = &mut all[self.nodes.len()..];
        for (ring, edges) in self.nodes.windows(3).enumerate().filter(|(i, _)| i % 2 == 0) {
            let (start, end) = (edges[0], edges[2]);
            if start >= radius && length == 0.0 {
                break;
            }
            let cut = radius.clamp(start, end);
            // quarters of the way from the border resolve the square root with which the pill's share sets in
            let near = cut + (end - cut) * if cut > start || start == radius { 0.1 } else { 0.5 };
            for (a, b) in [(start, cut), (cut, near), (near, end)] {
                if b <= a {
                    continue;
                }
                for (place, weight) in GAUSS3 {
                    let rho = 0.5 * (a + b) + 0.5 * (b - a) * place;
                    let mass = 0.5 * (b - a) * weight * 2.0 * PI * rho * kept(rho, radius, length);
                    let basis = quadratic(edges, rho);
                    weights[ring..ring + 3].iter_mut().zip(basis).for_each(|(w, b)| *w += mass * b);
                }
            }
        }
        all
    }
}

/// What blurs an image: boxes of one pixel.
struct Blur {
    /// Three places an axis and their weights, with the second and the fourth moment.
    rule: [(f64, f64); 3],
    /// Coefficients of the powers of the Laplacian, which are those of the boxes' transform averaged over directions.
    series: [f64; 3],
}

/// One box, sinc(kx/2) sinc(ky/2), and two, its square, to the sixth order.
const BOXES: [Blur; 2] = [
    Blur {
        rule: three_points(0.387_298_334_620_742, 5.0 / 18.0),
        series: [1.0 / 24.0, 0.75 / 1920.0 + 0.125 / 576.0, 0.625 / 322_560.0 + 0.125 / 46_080.0],
    },
    Blur {
        rule: three_points(0.632_455_532_033_676, 5.0 / 24.0),
        series: [1.0 / 12.0, 0.75 / 360.0 + 0.125 / 144.0, 0.625 / 20_160.0 + 0.125 / 4_320.0],
    },
];
/// Below this FWHM the series converges badly \[px\].
const LEAST_SERIES_FWHM: f64 = 2.5;

/// Surface brightness at `r` of a profile of `fwhm` \[px\], blurred.
fn blurred(shape: Ready, fwhm: f64, r: f64, blur: &Blur) -> f64 {
    // seen from 22.5 deg, the fourth order of a square is that of its average over directions
    const TOWARDS: (f64, f64) = (0.923_879_532_511_287, 0.382_683_432_365_09);
    let plain = |r: f64| shape.at(r / fwhm) / (fwhm * fwhm);
    if r > 8.0 * fwhm.max(3.0) {
        return plain(r);
    }
    if let Some(u) = shape.laplacians(r / fwhm).filter(|_| fwhm >= LEAST_SERIES_FWHM) {
        let s = 1.0 / (fwhm * fwhm);
        let [a, b, c] = blur.series;
        return s * (u[0] + s * (a * u[1] + s * (b * u[2] + s * c * u[3])));
    }
    let (x, y) = (r * TOWARDS.0, r * TOWARDS.1);
    let row = |dy: f64| blur.rule.iter().map(|(dx, w)| w * plain((x + dx).hypot(y + dy))).sum::<f64>();
    blur.rule.iter().map(|(dy, w)| w * row(*dy)).sum()
}

const fn three_points(node: f64, weight: f64) -> [(f64, f64); 3] {
    [(-node, weight), (0.0, 1.0 - 2.0 * weight), (node, weight)]
}

/// Quadratic interpolation between two ring edges and their middle, at `r`: the weights of the three.
fn quadratic(nodes: &[f64], r: f64) -> [f64; 3] {
    let t = (r - nodes[1]) / (0.5 * (nodes[2] - nodes[0]));
    [0.5 * t * (t - 1.0), 1.0 - t * t, 0.5 * t * (t + 1.0)]
}

/// Gauss-Legendre of order 3 on \[-1, 1\].
const GAUSS3: [(f64, f64); 3] =
    [(-0.774_596_669_241_483, 5.0 / 9.0), (0.0, 8.0 / 9.0), (0.774_596_669_241_483, 5.0 / 9.0)];

/// Share of the light displaced by `rho` in a random direction from its origin that stays within the pill.
fn kept(rho: f64, radius: f64, length: f64) -> f64 {
    if rho <= radius {
        return 1.0;
    }
    if length <= 0.0 {
        return 0.0;
    }
    // y = r sin psi: the angle phi = asin(r sin psi / rho) runs over the first quadrant's part with y < r
    const STEPS: usize = 16;
    let step = 0.5 * PI / STEPS as f64;
    let mut sum = 0.0;
    for i in 0..STEPS {
        let (sin, cos) = ((i as f64 + 0.5) * step).sin_cos();
        let y = radius * sin;
        let x = (rho * rho - y * y).sqrt();
        let lost = ((x - radius * cos) / length).clamp(0.0, 1.0);
        sum += (1.0 - lost) * radius * cos / x;
    }
    sum * step / (0.5 * PI)
}

/// The scalar product of share weights and a profile.
pub fn share(weights: &[f64], profile: &[f64]) -> f64 {
    weights.iter().zip(profile).map(|(w, p)| w * p).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::photometry::segment::Segment;
    use glam::DVec2;

    /// (r, l) against a midpoint sum over the plane: a source spread over its segment, point by point.
    fn share_reference(shape: Shape, fwhm: f64, radius: f64, length: f64) -> f64 {
        let pill = Segment { centre: DVec2::ZERO, half: DVec2::new(0.5 * length, 0.0) };
        let h = 0.1;
        let (nx, ny) = (((0.5 * length + radius) / h) as i64 + 1, (radius / h) as i64 + 1);
        let origins = if length == 0.0 { 1 } else { (length * 4.0) as usize };
        let mut sum = 0.0;
        for iy in -ny..=ny {
            for ix in -nx..=nx {
                let place = DVec2::new(ix as f64 + 0.31, iy as f64 + 0.47) * h;
                if pill.distance(place) > radius {
                    continue;
                }
                for k in 0..origins {
                    let origin = ((k as f64 + 0.5) / origins as f64 - 0.5) * length;
                    let r = (place - DVec2::new(origin, 0.0)).length() / fwhm;
                    sum += shape.intensity(r) / (fwhm * fwhm) * h * h / origins as f64;
                }
            }
        }
        sum
    }

    #[test]
    fn enclosed_shares_agree_with_brute_force() {
        let unblurred = |grid: &Grid, shape: Shape, fwhm: f64| {
            let nodes = grid.nodes.iter().chain(&grid.nodes);
            nodes.map(|r| shape.intensity(r / fwhm) / (fwhm * fwhm)).collect::<Vec<_>>()
        };
        for shape in [Shape::Moffat { inverse_beta: 0.0 }, Shape::Moffat { inverse_beta: 0.4 }, Shape::Kolmogorov]
        {
            for (fwhm, radius, length) in [(3.0, 4.0, 0.0), (3.0, 4.0, 30.0), (4.0, 5.0, 6.0), (2.0, 7.0, 12.0)] {
                let grid = Grid::new(1.1 * fwhm, 100.0);
                let fast = share(&grid.share_weights(radius, length), &unblurred(&grid, shape, fwhm));
                let slow = share_reference(shape, fwhm, radius, length);
                assert!((fast - slow).abs() < 5e-4, "{shape:?} {fwhm} {radius} {length}: {fast} against {slow}");
            }
        }
    }

    #[test]
    fn every_profile_holds_unit_flux_and_has_its_width() {
        for shape in [0.0, 0.1, 0.3, 0.4].map(|inverse_beta| Shape::Moffat { inverse_beta }) {
            assert!((shape.intensity(0.5) / shape.intensity(0.0) - 0.5).abs() < 1e-12);
            let grid = Grid::new(3.0, 1000.0);
            let total = share(&grid.share_weights(900.0, 0.0), &grid.profile(shape, 3.0));
            assert!((total - 1.0).abs() < 4e-4, "{shape:?}: {total}");
        }
        let half = Shape::Kolmogorov.intensity(0.5) / Shape::Kolmogorov.intensity(0.0);
        assert!((half - 0.5).abs() < 1e-4, "{half}");
        let grid = Grid::new(3.0, 1000.0);
        let inside = share(&grid.share_weights(900.0, 0.0), &grid.profile(Shape::Kolmogorov, 3.0));
        let beyond = 0.0863 * (900.0 / 3.0 * KOLMOGOROV_FWHM).powf(-5.0 / 3.0);
        assert!((inside + beyond - 1.0).abs() < 3e-4, "{inside}");
        // no step where the wing's expansion takes over
        let step = kolmogorov_reference(7.999) / kolmogorov_wing(8.001);
        assert!((step - 1.0).abs() < 0.01, "{step}");
    }

    /// Against two boxes summed point by point, averaged over directions.
    #[test]
    fn the_boxes_blur_as_they_do_by_brute_force() {
        for (shape, fwhm) in [(0.0, 2.0), (0.4, 2.0), (0.0, 2.5), (0.4, 2.5), (0.4, 3.0)] {
            let shape = Shape::Moffat { inverse_beta: shape };
            let grid = Grid::new(fwhm, 50.0);
            let n = 20;
            // the sum of two uniform deviates
            let offset = |i: i32| (f64::from(i) + 0.5) / f64::from(n) - 1.0;
            let weight = |x: f64| (1.0 - x.abs()) / f64::from(n);
            for (r, p) in grid.nodes.iter().zip(&grid.profile(shape, fwhm)[grid.nodes.len()..]).step_by(7).take(12)
            {
                let mut exact = 0.0;
                for turn in 0..8 {
                    let (sin, cos) = (f64::from(turn) * PI / 16.0).sin_cos();
                    for i in 0..2 * n {
                        for j in 0..2 * n {
                            let (dx, dy) = (offset(i), offset(j));
                            let distance = (r * cos + dx).hypot(r * sin + dy) / fwhm;
                            exact += weight(dx) * weight(dy) * shape.intensity(distance) / (8.0 * fwhm * fwhm);
                        }
                    }
                }
                assert!(
                    (p - exact).abs() < 3e-3 * exact.max(1e-3),
                    "{shape:?} {fwhm} at {r}: {p} against {exact}"
                );
            }
        }
    }
}
