//! A point well inside half-spaces: near the centre of the largest ball in them.
//!
//! Maximises t r + sum log(h_i - n_i.x - r) by Newton's method for growing t (Boyd and Vandenberghe 2004, Convex Optimization, section 11.3);
//! the ball found is smaller than the largest by at most (m + 1) / t.

use glam::{DMat4, DVec3, DVec4, Vec4Swizzles};

use super::Fault;
use super::plane::Plane;

/// Least radius of the largest ball over the size of the offsets.
const LEAST: f64 = 1e-13;

/// Centre of a ball inside all planes that has at least half the radius of the largest.
///
/// # Errors
/// [`Fault::Empty`] when the largest ball is no larger than rounding.
pub fn centre(planes: &[Plane]) -> Result<DVec3, Fault> {
    let size = planes.iter().fold(f64::MIN_POSITIVE, |most, plane| most.max(plane.offset.abs()));
    let scaled: Vec<Plane> = planes.iter().map(|&plane| Plane::new(plane.normal, plane.offset / size)).collect();
    let start = scaled.iter().fold(1.0_f64, |least, plane| least.min(plane.offset));
    let mut at = DVec4::new(0.0, 0.0, 0.0, start - 1.0);
    let mut t = 1.0;
    let bound = (planes.len() + 1) as f64;
    for _ in 0..60 {
        at = climb(&scaled, at, t);
        // the largest radius is between these two
        let (least, most) = (at.w, at.w + bound / t);
        if most < 2.0 * least || most < LEAST || bound / t < 0.1 * LEAST {
            break;
        }
        t *= 8.0;
    }
    if at.w > LEAST { Ok(at.xyz() * size) } else { Err(Fault::Empty { radius: at.w * size, least: LEAST * size }) }
}

/// Newton's method from a feasible point (x, r).
fn climb(planes: &[Plane], mut at: DVec4, t: f64) -> DVec4 {
    // the radius is bounded so that the ball cannot grow for ever
    let roof = 10.0;
    let value = |at: DVec4| {
        let logs = planes.iter().map(|plane| (plane.offset - row(plane.normal).dot(at)).ln());
        t * at.w + (roof - at.w).ln() + logs.sum::<f64>()
    };
    let mut now = value(at);
    for _ in 0..50 {
        let top = 1.0 / (roof - at.w);
        let mut gradient = DVec4::new(0.0, 0.0, 0.0, t - top);
        let mut hessian = DMat4::from_diagonal(DVec4::new(0.0, 0.0, 0.0, top * top));
        for plane in planes {
            let a = row(plane.normal);
            let force = a / (plane.offset - a.dot(at));
            gradient -= force;
            hessian += DMat4::from_cols(force * force.x, force * force.y, force * force.z, force * force.w);
        }
        let step = hessian.inverse() * gradient;
        let decrement = gradient.dot(step);
        if decrement.is_nan() || decrement < 1e-3 {
            break;
        }
        // a failed comparison with NaN is a point outside
        let tried = (0..50).map(|k| at + step * 0.5_f64.powi(k)).map(|next| (next, value(next)));
        let Some((next, then)) = tried.into_iter().find(|(_, then)| *then > now) else { break };
        (at, now) = (next, then);
    }
    at
}

fn row(normal: DVec3) -> DVec4 {
    normal.extend(1.0)
}
