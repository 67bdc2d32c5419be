//! Minimisation from gradients alone: limited-memory BFGS (Nocedal 1980, Math. Comp. 35, 773) with backtracking.

use std::collections::VecDeque;

/// Pairs of steps and gradients kept.
const MEMORY: usize = 20;

/// Halvings of a step.
const HALVINGS: i32 = 40;

/// Where the minimisation ended.
#[derive(Debug, Clone)]
pub struct Minimum {
    /// The point.
    pub at: Vec<f64>,
    /// Steps taken.
    pub iterations: usize,
    /// Values computed.
    pub evaluations: usize,
}

/// Minimises `function`, which gives value and gradient where it is defined, until no step helps, the gradient falls to 1e-14 of the first,
/// or after `most` steps.
pub fn minimise(start: Vec<f64>, most: usize, function: impl Fn(&[f64]) -> Option<(f64, Vec<f64>)>) -> Minimum {
    let mut end = Minimum { at: start, iterations: 0, evaluations: 1 };
    let Some((mut value, mut gradient)) = function(&end.at) else { return end };
    let first = norm(&gradient);
    let mut pairs: VecDeque<(Vec<f64>, Vec<f64>)> = VecDeque::new();
    while end.iterations < most && norm(&gradient) > 1e-14 * first {
        let mut direction = quasi_newton(&pairs, &gradient);
        let mut slope = dot(&direction, &gradient);
        if slope.is_nan() || slope >= 0.0 {
            pairs.clear();
            direction = gradient.iter().map(|g| -g).collect();
            slope = -dot(&gradient, &gradient);
        }
        // without curvature known, a step of a tenth of the point's size
        let unit = if pairs.is_empty() { (0.1 * norm(&end.at) / norm(&direction)).min(1.0) } else { 1.0 };
        let mut accepted = None;
        for halving in 0..HALVINGS {
            let length = unit * 0.5_f64.powi(halving);
            let next: Vec<f64> = end.at.iter().zip(&direction).map(|(x, d)| x + length * d).collect();
            end.evaluations += 1;
            // where the value hangs on rounding, the gradient decides
            let flat = value + 8.0 * f64::EPSILON * value.abs();
            let lower = |then: f64, ahead: &[f64]| {
                then <= value + 1e-4 * length * slope || (then <= flat && norm(ahead) < norm(&gradient))
            };
            if let Some((then, ahead)) = function(&next).filter(|(then, ahead)| lower(*then, ahead)) {
                accepted = Some((next, then, ahead));
                break;
            }
        }
        let Some((next, then, ahead)) = accepted else {
            if pairs.is_empty() {
                break;
            }
            pairs.clear();
            continue;
        };
        end.iterations += 1;
        let step: Vec<f64> = next.iter().zip(&end.at).map(|(n, x)| n - x).collect();
        let turn: Vec<f64> = ahead.iter().zip(&gradient).map(|(n, g)| n - g).collect();
        if dot(&step, &turn) > 1e-12 * norm(&step) * norm(&turn) {
            pairs.push_back((step, turn));
            if pairs.len() > MEMORY {
                pairs.pop_front();
            }
        }
        (end.at, value, gradient) = (next, then, ahead);
    }
    end
}

/// Minus the inverse Hessian of the pairs times the gradient, by the two loops.
fn quasi_newton(pairs: &VecDeque<(Vec<f64>, Vec<f64>)>, gradient: &[f64]) -> Vec<f64> {
    let mut direction: Vec<f64> = gradient.iter().map(|g| -g).collect();
    let mut shares = Vec::with_capacity(pairs.len());
    for (step, turn) in pairs.iter().rev() {
        let share = dot(step, &direction) / dot(step, turn);
        direction.iter_mut().zip(turn).for_each(|(d, t)| *d -= share * t);
        shares.push(share);
    }
    if let Some((step, turn)) = pairs.back() {
        let scale = dot(step, turn) / dot(turn, turn);
        direction.iter_mut().for_each(|d| *d *= scale);
    }
    for ((step, turn), share) in pairs.iter().zip(shares.into_iter().rev()) {
        let back = share - dot(turn, &direction) / dot(step, turn);
        direction.iter_mut().zip(step).for_each(|(d, s)| *d += back * s);
    }
    direction
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rosenbrock_valley_is_followed_to_its_end() {
        let valley = |x: &[f64]| {
            let (a, b) = (1.0 - x[0], x[1] - x[0] * x[0]);
            Some((a * a + 100.0 * b * b, vec![-2.0 * a - 400.0 * x[0] * b, 200.0 * b]))
        };
        let end = minimise(vec![-1.2, 1.0], 200, valley);
        assert!((end.at[0] - 1.0).abs() < 1e-9 && (end.at[1] - 1.0).abs() < 1e-9, "{end:?}");
        assert!(end.iterations < 100);
    }
}
