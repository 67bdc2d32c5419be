//! The affine frame in which an extended Gaussian image is round.
//!
//! If points transform as x' = M^-T x with det M = 1, area vectors transform as g' = M g. M is the fixed point at which
//! sum |g'| n' n'^T is a multiple of the identity. Newton's method for Minkowski's problem is affinely invariant, its start, the
//! body around a sphere, is not: in this frame it is near.

use glam::{DMat3, DVec3};

/// Most steps of the fixed point: each halves the logarithms of the axes' ratios.
const MOST_STEPS: usize = 60;

/// Axes equal to this fraction end the iteration.
const ROUND: f64 = 1e-6;

/// Root-mean-square sine, weighted by area, of the angles between area vectors and the plane nearest to them.
pub fn flatness(vectors: &[DVec3]) -> f64 {
    let (_, values) = eigen(spread(vectors.iter().copied()));
    (values.min_element().max(0.0) / values.element_sum()).sqrt()
}

/// M for area vectors that are not in a plane.
pub fn whitening(vectors: &[DVec3]) -> DMat3 {
    let mut frame = DMat3::IDENTITY;
    for _ in 0..MOST_STEPS {
        let spread = spread(vectors.iter().map(|&g| frame * g));
        let (axes, values) = eigen(spread);
        let (low, high) = (values.min_element(), values.max_element());
        if low.is_nan() || low <= 0.0 || high <= (1.0 + ROUND) * low {
            break;
        }
        let roots = values.map(|v| v.powf(-0.5));
        let scale = (roots.x * roots.y * roots.z).cbrt();
        frame = axes * DMat3::from_diagonal(roots / scale) * axes.transpose() * frame;
    }
    frame
}

/// Sum of g g^T / |g|.
fn spread(vectors: impl Iterator<Item = DVec3>) -> DMat3 {
    vectors.fold(DMat3::ZERO, |sum, g| {
        let length = g.length();
        if length > 0.0 { sum + DMat3::from_cols(g * g.x, g * g.y, g * g.z) * (1.0 / length) } else { sum }
    })
}

/// Eigenvectors (columns) and eigenvalues of a symmetric matrix, by Jacobi's rotations.
pub fn eigen(matrix: DMat3) -> (DMat3, DVec3) {
    let (mut a, mut axes) = (matrix, DMat3::IDENTITY);
    for _ in 0..20 {
        let off = a.y_axis.x.abs() + a.z_axis.x.abs() + a.z_axis.y.abs();
        if off.is_nan() || off == 0.0 {
            break;
        }
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let (app, aqq, apq) = (a.col(p)[p], a.col(q)[q], a.col(q)[p]);
            if apq == 0.0 {
                continue;
            }
            let theta = 0.5 * (aqq - app) / apq;
            let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
            let c = 1.0 / t.hypot(1.0);
            let mut turn = DMat3::IDENTITY;
            turn.col_mut(p)[p] = c;
            turn.col_mut(q)[q] = c;
            turn.col_mut(q)[p] = t * c;
            turn.col_mut(p)[q] = -t * c;
            a = turn.transpose() * a * turn;
            a.col_mut(p)[q] = 0.0;
            a.col_mut(q)[p] = 0.0;
            axes *= turn;
        }
    }
    (axes, DVec3::new(a.x_axis.x, a.y_axis.y, a.z_axis.z))
}
