//! The light of a point or a trail in single pixels, from a radial profile.
//!
//! With P(r) the light of a point in a pixel at distance r (the profile blurred by one pixel, [`super::profile`]), a source
//! spread evenly over a segment of length 2 l gives a pixel at (s, a) along and across it
//! `(G(s + l, a) - G(s - l, a)) / 2 l`, `G(s, a) = int_0^s P(sqrt(t^2 + a^2)) dt`. G is tabulated once for a profile in
//! asinh coordinates, and serves every length, direction and place.
//!
//! An image that is not round is a round one seen through a matrix M: offsets become M d and densities |det M| as large. A
//! straight trail stays straight. Between nodes cubic interpolation (Catmull & Rom 1974) keeps values and slopes steady.

use super::profile::Grid;
use super::segment::Segment;
use crate::base::elementary::ln;
use glam::{DMat2, DVec2};
use std::sync::OnceLock;

/// Nodes of the tables along each axis.
const NODES: usize = 88;
/// Scale below which nodes are evenly spaced \[FWHM\].
const SOFT: f64 = 0.4;
/// Trails shorter than this \[FWHM\] are points with a quadratic correction of no account.
const SHORT: f64 = 0.02;

/// Gauss-Legendre of order 3 on 0..1.
pub const GAUSS: [(f64, f64); 3] =
    [(0.112_701_665_379_258_3, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];

/// A tabulated image of points and trails.
#[derive(Debug, Clone)]
pub struct PointImage {
    soft: f64,
    step: f64,
    reach: f64,
    /// P at the nodes.
    point: Vec<f64>,
    grid: Grid,
    profile: Vec<f64>,
    /// G at the nodes: rows across, columns along; made for the first trail.
    line: OnceLock<Vec<f64>>,
    lens: DMat2,
    density: f64,
}

impl PointImage {
    /// From a profile on a grid, for images of about `fwhm`, out to `reach` \[px\]; nothing beyond.
    pub fn new(grid: &Grid, profile: &[f64], fwhm: f64, reach: f64) -> Self {
        let soft = SOFT * fwhm;
        let step = (reach / soft).asinh() / (NODES - 3) as f64;
        let point = (0..NODES).map(|i| grid.light(profile, soft * (i as f64 * step).sinh())).collect();
        let (grid, profile, line) = (grid.clone(), profile.to_vec(), OnceLock::new());
        Self { soft, step, reach, point, grid, profile, line, lens: DMat2::IDENTITY, density: 1.0 }
    }

    fn line(&self) -> &[f64] {
        self.line.get_or_init(|| {
            let radii = (0..NODES).map(|i| self.soft * (i as f64 * self.step).sinh()).collect::<Vec<_>>();
            let mut line = Vec::with_capacity(NODES * NODES);
            for across in &radii {
                let mut sum = 0.0;
                line.push(0.0);
                for ends in radii.windows(2) {
                    let light = |t: f64| {
                        let s = ends[0] + t * (ends[1] - ends[0]);
                        self.grid.light(&self.profile, (across * across + s * s).sqrt())
                    };
                    sum += (ends[1] - ends[0]) * GAUSS.map(|(t, w)| w * light(t)).iter().sum::<f64>();
                    line.push(sum);
                }
            }
            line
        })
    }

    /// The same image seen through a matrix.
    #[must_use]
    pub fn through(self, lens: DMat2) -> Self {
        Self { lens, density: lens.determinant().abs(), ..self }
    }

    /// How far from a source it gives light \[px\].
    pub fn reach(&self) -> f64 {
        self.reach
    }

    /// The offset of a pixel and half the trail as the round image sees them, and how much denser the light is.
    pub fn seen(&self, source: &Segment, place: DVec2) -> (DVec2, DVec2, f64) {
        (self.lens * (place - source.centre), self.lens * source.half, self.density)
    }

    /// Share of a source's light in the pixel at `place` \[1/px\].
    pub fn share(&self, source: &Segment, place: DVec2) -> f64 {
        let (offset, half, density) = self.seen(source, place);
        let length = half.length();
        if length < SHORT * self.soft {
            return density * self.of_point(offset.length());
        }
        let along = half / length;
        let (s, across) = (offset.dot(along), offset.perp_dot(along).abs());
        if across > self.reach || s.abs() > length + self.reach {
            return 0.0;
        }
        let rows = self.stencil(across);
        let part = self.integral(s + length, &rows) - self.integral(s - length, &rows);
        density * (part / (2.0 * length)).max(0.0)
    }

    /// The same and its gradient by the source's place \[1/px, 1/px^2\].
    pub fn share_and_slope(&self, source: &Segment, place: DVec2) -> (f64, DVec2) {
        /// Step of the numerical derivative of a trail \[px\].
        const STEP: f64 = 0.05;
        let (offset, half, density) = self.seen(source, place);
        if half.length() < SHORT * self.soft {
            let r = offset.length();
            let towards = offset.normalize_or_zero();
            // the round image falls along the offset, which shrinks as the source moves
            return (density * self.of_point(r), self.lens.transpose() * towards * (-density * self.slope(r)));
        }
        let slope =
            |axis: DVec2| (self.share(source, place - axis) - self.share(source, place + axis)) / (2.0 * STEP);
        (self.share(source, place), DVec2::new(slope(DVec2::X * STEP), slope(DVec2::Y * STEP)))
    }

    /// dP/dr at `r`.
    fn slope(&self, r: f64) -> f64 {
        if r.is_nan() || r > self.reach {
            return 0.0;
        }
        let (node, u) = self.interval(r);
        let weights = [
            0.5 * (u * (4.0 - 3.0 * u) - 1.0),
            0.5 * u * (9.0 * u - 10.0),
            0.5 * (u * (8.0 - 9.0 * u) + 1.0),
            0.5 * u * (3.0 * u - 2.0),
        ];
        let rise =
            weights.iter().enumerate().map(|(k, w)| w * self.point[(node + k as i64 - 1).unsigned_abs() as usize]);
        rise.sum::<f64>() / (self.step * (self.soft * self.soft + r * r).sqrt())
    }

    fn of_point(&self, r: f64) -> f64 {
        if r.is_nan() || r > self.reach {
            return 0.0;
        }
        let stencil = self.stencil(r);
        stencil.iter().map(|(node, weight)| weight * self.point[node.unsigned_abs() as usize]).sum()
    }

    /// G at `s` along the segment, which is odd in it and constant beyond the reach; even across.
    fn integral(&self, s: f64, across: &[(i64, f64); 4]) -> f64 {
        let along = self.stencil(s.abs().min(self.reach));
        let (mut sum, line) = (0.0, self.line());
        for (row, across) in across {
            let row = &line[NODES * row.unsigned_abs() as usize..];
            let value = |(column, weight): &(i64, f64)| {
                let value = weight * row[column.unsigned_abs() as usize];
                if *column < 0 { -value } else { value }
            };
            sum += across * along.iter().map(value).sum::<f64>();
        }
        sum.copysign(sum * s)
    }

    /// The node before `x`, 0..=reach, and the way from there to the next.
    fn interval(&self, x: f64) -> (i64, f64) {
        // asinh of a number that is not negative
        let x = x / self.soft;
        let t = (ln(x + (x * x + 1.0).sqrt()) / self.step).clamp(0.0, (NODES - 3) as f64);
        let node = t as i64;
        (node, t - node as f64)
    }

    /// Nodes and weights of the cubic through `x`, 0..=reach; node -1 is the mirror of node 1.
    fn stencil(&self, x: f64) -> [(i64, f64); 4] {
        let (node, u) = self.interval(x);
        let weights = [
            0.5 * u * (u * (2.0 - u) - 1.0),
            0.5 * (u * u * (3.0 * u - 5.0) + 2.0),
            0.5 * u * (u * (4.0 - 3.0 * u) + 1.0),
            0.5 * u * u * (u - 1.0),
        ];
        let mut stencil = [(0, 0.0); 4];
        for (k, weight) in weights.into_iter().enumerate() {
            stencil[k] = (node + k as i64 - 1, weight);
        }
        stencil
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::photometry::profile::Shape;

    fn shapes() -> [Shape; 3] {
        [Shape::Moffat { inverse_beta: 0.0 }, Shape::Moffat { inverse_beta: 0.4 }, Shape::Kolmogorov]
    }

    fn image(shape: Shape, fwhm: f64) -> PointImage {
        let grid = Grid::new(fwhm, 200.0);
        PointImage::new(&grid, &grid.profile(shape, fwhm), fwhm, 12.0 * fwhm)
    }

    /// Light of a segment in a pixel by sums over the pixel and the segment.
    fn brute_force(shape: Shape, fwhm: f64, source: &Segment, place: DVec2) -> f64 {
        let (n, origins) = (12, 1 + (source.length() * 6.0) as usize);
        let part = |i: usize, n: usize| (i as f64 + 0.5) / n as f64;
        let mut sum = 0.0;
        for k in 0..origins {
            let origin = source.centre + source.half * (2.0 * part(k, origins) - 1.0);
            for i in 0..n * n {
                let at = place + DVec2::new(part(i % n, n), part(i / n, n)) - 0.5;
                sum += shape.intensity((at - origin).length() / fwhm);
            }
        }
        sum / (origins * n * n) as f64 / (fwhm * fwhm)
    }

    /// What is seen as round differs from the square pixel's answer by its fourth order: 1e-3 of the peak at 2 px.
    #[test]
    fn pixels_hold_what_brute_force_says() {
        for shape in shapes() {
            for (fwhm, half) in [
                (2.0, DVec2::ZERO),
                (3.0, DVec2::new(0.3, 0.1)),
                (3.0, DVec2::new(21.0, 8.0)),
                (4.0, DVec2::new(0.0, 3.0)),
            ] {
                let image = image(shape, fwhm);
                let source = Segment { centre: DVec2::new(0.31, -0.22), half };
                let peak = brute_force(shape, fwhm, &source, DVec2::ZERO);
                let mut worst = 0f64;
                for y in -9..=9 {
                    for x in -30..=30 {
                        if (x + y) % 5 == 0 {
                            let place = DVec2::new(f64::from(x), f64::from(y));
                            let wrong = image.share(&source, place) - brute_force(shape, fwhm, &source, place);
                            worst = worst.max(wrong.abs() / peak);
                        }
                    }
                }
                assert!(worst < 4e-3 * (2.0 / fwhm).powi(4) + 4e-4, "{shape:?} {fwhm} {half}: {worst}");
            }
        }
    }

    /// Gradients of points and trails, round and long, are the difference quotients of the light: to 2e-3 of the steepest, what the
    /// step of 0.05 px along a trail leaves.
    #[test]
    fn slopes_are_those_of_the_light() {
        const STEP: f64 = 1e-4;
        for half in [DVec2::ZERO, DVec2::new(2e-3, 0.0), DVec2::new(4.0, -1.7)] {
            for lens in [DMat2::IDENTITY, DMat2::from_cols(DVec2::new(1.2, 0.1), DVec2::new(0.1, 0.85))] {
                let image = image(Shape::Kolmogorov, 3.0).through(lens);
                let source = |centre| Segment { centre: DVec2::new(0.31, -0.22) + centre, half };
                let steepest = image.share(&source(DVec2::ZERO), DVec2::ZERO) / 3.0;
                for i in 0..400 {
                    let place = DVec2::new(f64::from(i % 20) - 9.7, f64::from(i / 20) - 10.1);
                    let (light, slope) = image.share_and_slope(&source(DVec2::ZERO), place);
                    assert_eq!(light, image.share(&source(DVec2::ZERO), place));
                    let quotient = |axis: DVec2| {
                        let at = |d: DVec2| image.share(&source(d), place);
                        (at(axis * STEP) - at(-axis * STEP)) / (2.0 * STEP)
                    };
                    let wrong = slope - DVec2::new(quotient(DVec2::X), quotient(DVec2::Y));
                    assert!(wrong.length() < 2e-3 * steepest, "{half} {place}: {slope} off by {wrong}");
                }
            }
        }
    }

    /// The sum over all pixels is the light within the reach, wherever the source lies and however long it is.
    #[test]
    fn no_light_is_lost_on_the_way() {
        for half in [DVec2::ZERO, DVec2::new(2e-3, 0.0), DVec2::new(0.6, 0.3), DVec2::new(40.0, -17.0)] {
            let image = image(Shape::Moffat { inverse_beta: 0.0 }, 3.0);
            for lens in [DMat2::IDENTITY, DMat2::from_cols(DVec2::new(1.2, 0.1), DVec2::new(0.1, 0.8))] {
                let image = image.clone().through(lens);
                let source = Segment { centre: DVec2::new(100.37, 60.81), half };
                let pixels = (0..200 * 120).map(|i| DVec2::new(f64::from(i % 200), f64::from(i / 200)));
                let sum: f64 = pixels.map(|p| image.share(&source, p)).sum();
                assert!((sum - 1.0).abs() < 5e-4, "{half}: {sum}");
            }
        }
    }

    #[test]
    fn odd_input_gives_no_light_and_no_panic() {
        let image = image(Shape::Kolmogorov, 3.0);
        for place in [DVec2::NAN, DVec2::splat(1e300), DVec2::splat(f64::INFINITY)] {
            for half in [DVec2::ZERO, DVec2::new(1e300, 1.0), DVec2::NAN, DVec2::new(9.0, 0.0)] {
                let share = image.share(&Segment { centre: DVec2::ZERO, half }, place);
                assert!(share == 0.0 || share.is_nan() || share.is_finite());
            }
        }
    }
}
