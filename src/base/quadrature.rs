//! Gauss-Legendre quadrature.

use std::f64::consts::PI;

/// Nodes on -1..1 and weights of the rule with `n` points, exact for polynomials of degree 2 n - 1 (Abramowitz & Stegun
/// 25.4.29); the nodes by Newton's method from cos(pi (k + 3/4) / (n + 1/2)).
pub fn gauss_legendre(n: usize) -> (Vec<f64>, Vec<f64>) {
    let legendre = |x: f64| {
        let (mut before, mut value) = (1.0, x);
        for k in 2..=n {
            let k = k as f64;
            (before, value) = (value, ((2.0 * k - 1.0) * x * value - (k - 1.0) * before) / k);
        }
        let slope = n as f64 * (x * value - before) / (x * x - 1.0);
        (value, slope)
    };
    let node = |k: usize| {
        let first = libm::cos(PI * (k as f64 + 0.75) / (n as f64 + 0.5));
        (0..8).fold(first, |x, _| {
            let (value, slope) = legendre(x);
            x - value / slope
        })
    };
    let nodes = (0..n).map(node).collect::<Vec<_>>();
    let weights = nodes.iter().map(|x| 2.0 / ((1.0 - x * x) * legendre(*x).1.powi(2))).collect();
    (nodes, weights)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_are_integrated_exactly() {
        for n in [2, 4, 16] {
            let (nodes, weights) = gauss_legendre(n);
            for power in 0..2 * n as i32 {
                let sum = nodes.iter().zip(&weights).map(|(x, w)| w * x.powi(power)).sum::<f64>();
                let exact = if power % 2 == 0 { 2.0 / f64::from(power + 1) } else { 0.0 };
                assert!((sum - exact).abs() < 1e-14, "{n} points, power {power}: {sum}");
            }
        }
    }
}
