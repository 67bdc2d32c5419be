//! Smooth bodies fitted to the same data: where one of them does as well, facets are an artefact of looking for facets.
//!
//! The extended Gaussian image of the ellipsoid x'Q^-1 x = 1 is its area per solid angle, det Q/(n'Q n)^2 (support function
//! sqrt(n'Q n); Schneider 2014, Convex Bodies, sect. 2.5); of a sphere, r^2. Q = L L' with L lower triangular: six unknowns.

use super::fit::Fit;
use super::problem::Problem;
use super::support::Grid;
use crate::inversion::cholesky::{Cholesky, dot};
use glam::{DMat3, DVec3};
use std::f64::consts::PI;

/// A smooth body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Smooth {
    /// Of this radius \[m\].
    Sphere(f64),
    /// Of these semi-axes \[m\], the longest first.
    Ellipsoid([f64; 3]),
}

impl Smooth {
    /// Number of parameters.
    pub fn parameters(self) -> usize {
        match self {
            Smooth::Sphere(_) => 1,
            Smooth::Ellipsoid(_) => 6,
        }
    }
}

/// Relative error of curves summed over a grid of 2000 directions: nothing finer is told apart.
const QUADRATURE: f64 = 1e-3;

/// Noise at which smooth bodies are compared, over the true one.
pub(super) fn noise(snr: f64) -> f64 {
    (QUADRATURE * snr).max(1.0)
}

/// Whether chi^2 of so many data is what noise alone would have it, to 3 sigma.
pub(super) fn within_noise(chi2: f64, data: usize) -> bool {
    let data = data as f64;
    chi2 <= data + 3.0 * (2.0 * data).sqrt()
}

/// The smooth body that explains the data with fewer parameters than the facets do (Schwarz 1978), and its chi^2.
pub(super) fn preferred(
    bodies: &[(Smooth, f64)],
    chi2: f64,
    facets: usize,
    problem: &Problem,
) -> Option<(Smooth, f64)> {
    let price = |parameters: usize| parameters as f64 * libm::log(problem.len().max(2) as f64);
    let variance = noise(problem.snr()).powi(2);
    let cheaper = |(body, smooth): &&(Smooth, f64)| {
        smooth / variance + price(body.parameters()) <= chi2 / variance + price(3 * facets)
    };
    bodies.iter().find(cheaper).copied()
}

/// Rounds of the ellipsoid's fit.
const ROUNDS: usize = 12;

/// The best of each kind with its chi^2, the simplest first.
pub(super) fn fits(fit: &Fit, grid: &Grid) -> Vec<(Smooth, f64)> {
    let columns = grid.weighted(fit);
    let data: Vec<f64> = fit.problem.y.iter().zip(fit.weights.iter()).map(|(y, w)| y * w).collect();
    let share = 4.0 * PI / grid.normals.len().max(1) as f64;
    let curve = |image: &dyn Fn(DVec3) -> f64| {
        let mut out = vec![0.0; data.len()];
        for (j, &n) in grid.normals.iter().enumerate() {
            let area = share * image(n);
            out.iter_mut().zip(columns.column(j)).for_each(|(m, g)| *m += area * g);
        }
        out
    };
    let chi2 = |model: &[f64]| data.iter().zip(model).map(|(y, m)| (y - m).powi(2)).sum::<f64>();
    let unit = curve(&|_| 1.0);
    let square = dot(&unit, &data) / dot(&unit, &unit);
    if !(square > 0.0 && square.is_finite()) {
        return Vec::new();
    }
    let radius = square.sqrt();
    let sphere = chi2(&unit.iter().map(|m| m * square).collect::<Vec<_>>());
    let model = |p: &[f64; 6]| curve(&|n| ellipsoid(p, n));
    let mut p = [radius, 0.0, 0.0, radius, 0.0, radius];
    let (mut cost, mut damping) = (sphere, 1e-2);
    for _ in 0..ROUNDS {
        let now = model(&p);
        let h = 1e-5 * p.iter().map(|v| v.abs()).fold(0.0, f64::max);
        let slopes: [Vec<f64>; 6] = std::array::from_fn(|k| {
            let mut q = p;
            q[k] += h;
            model(&q).iter().zip(&now).map(|(a, b)| (a - b) / h).collect()
        });
        let residual: Vec<f64> = data.iter().zip(&now).map(|(y, m)| y - m).collect();
        let normal = |i: usize, j: usize| dot(&slopes[i], &slopes[j]) * if i == j { 1.0 + damping } else { 1.0 };
        let Some(factor) = Cholesky::of(6, 1e-14, normal) else { break };
        let step = factor.solve(slopes.iter().map(|s| dot(s, &residual)).collect());
        let next: [f64; 6] = std::array::from_fn(|k| p[k] + step[k]);
        let trial = chi2(&model(&next));
        if trial < cost {
            let gain = cost - trial;
            (p, cost, damping) = (next, trial, damping * 0.1);
            if gain < 0.1 {
                break;
            }
        } else {
            damping *= 10.0;
        }
    }
    let axes = semi_axes(&p);
    vec![(Smooth::Sphere(radius), sphere), (Smooth::Ellipsoid(axes), cost)]
}

fn lower(p: &[f64; 6]) -> DMat3 {
    DMat3::from_cols(DVec3::new(p[0], p[1], p[2]), DVec3::new(0.0, p[3], p[4]), DVec3::new(0.0, 0.0, p[5]))
}

fn ellipsoid(p: &[f64; 6], n: DVec3) -> f64 {
    let l = lower(p);
    let squared = (l.transpose() * n).length_squared();
    let volume = p[0] * p[3] * p[5];
    if squared > 0.0 { volume * volume / (squared * squared) } else { 0.0 }
}

/// Roots of the eigenvalues of L L', by plane rotations that make the columns of L' orthogonal (Hestenes 1958, J. SIAM 6, 51).
fn semi_axes(p: &[f64; 6]) -> [f64; 3] {
    let mut columns = lower(p).transpose().to_cols_array_2d().map(DVec3::from_array);
    for _ in 0..30 {
        for (i, j) in [(0, 1), (0, 2), (1, 2)] {
            let (a, b) = (columns[i], columns[j]);
            let angle = 0.5 * libm::atan2(2.0 * a.dot(b), a.length_squared() - b.length_squared());
            let (s, c) = (libm::sin(angle), libm::cos(angle));
            (columns[i], columns[j]) = (a * c + b * s, b * c - a * s);
        }
    }
    let mut axes = columns.map(|c| c.length());
    axes.sort_by(|a, b| b.total_cmp(a));
    axes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inversion::sphere::fibonacci;

    #[test]
    fn the_image_of_an_ellipsoid_closes_and_has_its_area() {
        // prolate 1:1:2: area 2 pi (1 + 2/e asin e), e^2 = 3/4
        let p = [1.0, 0.0, 0.0, 1.0, 0.0, 2.0];
        let e = 0.75f64.sqrt();
        let area = 2.0 * PI * (1.0 + 2.0 / e * e.asin());
        let n: Vec<DVec3> = fibonacci(20_000).collect();
        let share = 4.0 * PI / 20_000.0;
        let sum: f64 = n.iter().map(|&n| share * ellipsoid(&p, n)).sum();
        assert!((sum / area - 1.0).abs() < 1e-5, "{sum} {area}");
        let skew = [1.0, 0.3, -0.2, 0.8, 0.4, 2.0];
        let moment: DVec3 = n.iter().map(|&n| n * (share * ellipsoid(&skew, n))).sum();
        assert!(moment.length() < 1e-3);
    }

    #[test]
    fn semi_axes_of_a_turned_ellipsoid() {
        // singular values of L: their product is its determinant, their squares sum to its elements' squares
        let p = [1.0, 0.3, -0.2, 0.8, 0.4, 2.0];
        let [a, b, c] = semi_axes(&p);
        assert!((a * b * c - 1.6).abs() < 1e-12 && a >= b && b >= c);
        assert!((a * a + b * b + c * c - p.iter().map(|v| v * v).sum::<f64>()).abs() < 1e-12);
        assert!(
            semi_axes(&[2.0, 0.0, 0.0, 3.0, 0.0, 1.0])
                .iter()
                .zip([3.0, 2.0, 1.0])
                .all(|(a, b)| (a - b).abs() < 1e-14)
        );
    }
}
