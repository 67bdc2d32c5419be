//! Shares of a point's or a trail's light inside a circle or a pill, from the profile of a point's image on a grid of radii.
//!
//! For a source spread evenly over a segment of length L and a pill of radius r about the same segment, the
//! light that a point at distance rho and angle phi from its origin brings into the pill is the share of
//! origins that keep it inside, 1 - clamp(x - c, 0, L)/L with x = rho cos phi, c = sqrt(r^2 - y^2), and 0
//! for |y| > r. L -> 0 is the circle. So an enclosed share is a linear functional of the profile's values on a
//! radial grid, whose weights are computed once for each (r, L).

use super::shape::{BOXES, blurred};
use crate::base::elementary::ln;
use std::f64::consts::PI;

pub use super::shape::Shape;

/// Radii at which profiles are kept \[px\]: ring edges and the middles between them, 2 n + 1 in all.
#[derive(Debug, Clone)]
pub struct Grid {
    nodes: Vec<f64>,
    /// Width that the even steps in the middle follow \[px\].
    fwhm: f64,
}

/// Steps within a FWHM, and the growth of the rings beyond.
const STEP: f64 = 0.1;

impl Grid {
    /// A grid for images of about this FWHM \[px\], out to at least `reach` \[px\].
    pub fn new(fwhm: f64, reach: f64) -> Self {
        let fwhm = if fwhm.is_finite() { fwhm.clamp(0.5, 100.0) } else { 3.0 };
        let end = reach.clamp(30.0 * fwhm, 5000.0);
        let mut nodes = vec![0.0];
        let mut edge = 0.0;
        while edge < end {
            let step = STEP * edge.max(fwhm);
            nodes.push(edge + 0.5 * step);
            edge += step;
            nodes.push(edge);
        }
        Self { nodes, fwhm }
    }

    /// First node of the ring that holds `r`: by the rule of the grid, up to its rounding.
    fn ring(&self, r: f64) -> usize {
        let t = r / self.fwhm;
        let last = (self.nodes.len() - 3) / 2;
        let even = 1.0 / STEP;
        let ring = if t < 1.0 { even * t } else { even + ln(t) * (1.0 / 0.095_310_179_804_324_87) };
        let ring = (ring as usize).min(last);
        if self.nodes[2 * ring] > r {
            return 2 * ring.saturating_sub(1);
        }
        if ring < last && self.nodes[2 * ring + 2] <= r { 2 * ring + 2 } else { 2 * ring }
    }

    /// Surface brightness \[1/px^2\] at the grid's radii of a profile of `fwhm` \[px\], blurred by one box (what a
    /// pixel collects) and then, as many values again, by two (what weighted pixels sum to on average).
    pub fn profile(&self, shape: Shape, fwhm: f64) -> Vec<f64> {
        self.profile_of(shape, fwhm, [true; 2])
    }

    /// The same for points, for trails, or for both; what is not asked for is 0.
    pub fn profile_of(&self, shape: Shape, fwhm: f64, kinds: [bool; 2]) -> Vec<f64> {
        let mut profile = self.no_weights();
        let n = self.nodes.len();
        for (half, (blur, _)) in BOXES.iter().zip(kinds).enumerate().filter(|(_, (_, asked))| *asked) {
            blurred(shape, fwhm, &self.nodes, blur, &mut profile[half * n..][..n]);
        }
        profile
    }

    /// Weights of nothing.
    pub fn no_weights(&self) -> Vec<f64> {
        vec![0.0; 2 * self.nodes.len()]
    }

    /// The first of three nodes whose values, times these weights, make the value at `distance` \[px\].
    pub fn stencil(&self, distance: f64) -> (usize, [f64; 3]) {
        let start = self.ring(distance);
        (start, quadratic(&self.nodes[start..start + 3], distance))
    }

    /// The light of a point in a pixel `distance` \[px\] from it, for a profile on this grid \[1/px\].
    pub fn light(&self, profile: &[f64], distance: f64) -> f64 {
        let (start, basis) = self.stencil(distance);
        basis.iter().zip(profile.get(start..).unwrap_or_default()).map(|(b, p)| b * p).sum()
    }

    /// Adds to `weights` the light of a point in a pixel `distance` \[px\] from it that counts by `share`.
    pub fn add_pixel(&self, weights: &mut [f64], distance: f64, share: f64) {
        let (start, basis) = self.stencil(distance);
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
    fn the_rule_finds_the_ring_that_a_search_finds() {
        for fwhm in [0.5, 1.3, 3.37, 41.0] {
            let grid = Grid::new(fwhm, 60.0 * fwhm);
            let searched = |r: f64| {
                let above = grid.nodes.partition_point(|n| *n <= r);
                (above.saturating_sub(1) & !1).min(grid.nodes.len() - 3)
            };
            let between = (0..20_000).map(|i| 0.0037 * fwhm * f64::from(i));
            let edges = grid.nodes.iter().flat_map(|n| [n.next_down(), *n, n.next_up()]);
            for r in between.chain(edges).chain([f64::INFINITY]) {
                assert_eq!(grid.ring(r.max(0.0)), searched(r.max(0.0)), "{r} for {fwhm}");
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
        let grid = Grid::new(3.0, 1000.0);
        let inside = share(&grid.share_weights(900.0, 0.0), &grid.profile(Shape::Kolmogorov, 3.0));
        let beyond = 0.0863 * (900.0 / 3.0 * 0.975_54f64).powf(-5.0 / 3.0);
        assert!((inside + beyond - 1.0).abs() < 3e-4, "{inside}");
    }

    /// Against two boxes summed point by point, averaged over directions.
    #[test]
    fn the_boxes_blur_as_they_do_by_brute_force() {
        let moffat = |inverse_beta: f64| Shape::Moffat { inverse_beta };
        let cases =
            [(moffat(0.0), 2.0), (moffat(0.4), 2.0), (moffat(0.0), 2.5), (moffat(0.4), 2.5), (moffat(0.4), 3.0)];
        let turbulent = [2.0, 2.5, 4.0].map(|fwhm| (Shape::Kolmogorov, fwhm));
        for (shape, fwhm) in cases.into_iter().chain(turbulent) {
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
