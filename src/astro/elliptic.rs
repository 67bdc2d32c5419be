//! Jacobi's elliptic functions, the incomplete integral of the first kind, and cosine series of functions of dn.

use std::f64::consts::PI;

/// Jacobi's elliptic functions of one parameter m.
#[derive(Debug, Clone)]
pub struct Elliptic {
    /// 1 - m.
    complement: f64,
    /// Quarter period K.
    pub quarter: f64,
    /// Means a and half differences c of the descending Landen sequence.
    sequence: Vec<(f64, f64)>,
}

impl Elliptic {
    /// Of the parameter `m` and its complement 1 - m, given apart so that neither loses digits.
    pub fn new(m: f64, complement: f64) -> Self {
        let (mut a, mut b, mut c) = (1.0, complement.sqrt(), m.sqrt());
        let mut sequence = vec![(a, c)];
        for _ in 0..40 {
            if c.abs() <= 1e-17 * a {
                break;
            }
            (a, b, c) = (0.5 * (a + b), (a * b).sqrt(), 0.5 * (a - b));
            sequence.push((a, c));
        }
        Self { complement, quarter: 0.5 * PI / a, sequence }
    }

    /// sn, cn and dn (Abramowitz & Stegun 1964, 16.4).
    pub fn functions(&self, u: f64) -> (f64, f64, f64) {
        let u = u.rem_euclid(4.0 * self.quarter);
        let last = self.sequence.len() - 1;
        let mut phi = (1u64 << last) as f64 * self.sequence[last].0 * u;
        for (a, c) in self.sequence.iter().skip(1).rev() {
            phi = 0.5 * (phi + (c / a * phi.sin()).clamp(-1.0, 1.0).asin());
        }
        let (sn, cn) = phi.sin_cos();
        // 1 - m sn^2 without cancellation
        (sn, cn, (cn * cn + self.complement * sn * sn).sqrt())
    }

    /// Incomplete integral of the first kind for an angle in -pi..pi, by Carlson's R_F (Carlson 1995, Numer. Algorithms
    /// 10, 13).
    pub fn first_kind(&self, phi: f64) -> f64 {
        // reflected into -pi/2..pi/2
        let (inside, beyond) = if phi > 0.5 * PI {
            (phi - PI, 2.0 * self.quarter)
        } else if phi < -0.5 * PI {
            (phi + PI, -2.0 * self.quarter)
        } else {
            (phi, 0.0)
        };
        let (sin, cos) = inside.sin_cos();
        let (mut x, mut y, mut z) = (cos * cos, cos * cos + self.complement * sin * sin, 1.0);
        for _ in 0..60 {
            let mean: f64 = (x + y + z) / 3.0;
            if (x - mean).abs().max((y - mean).abs()).max((z - mean).abs()) < 1e-3 * mean {
                break;
            }
            let lambda = (x * y).sqrt() + (y * z).sqrt() + (z * x).sqrt();
            (x, y, z) = (0.25 * (x + lambda), 0.25 * (y + lambda), 0.25 * (z + lambda));
        }
        let mean = (x + y + z) / 3.0;
        let (dx, dy) = (1.0 - x / mean, 1.0 - y / mean);
        let dz = -dx - dy;
        let (e2, e3) = (dx * dy - dz * dz, dx * dy * dz);
        let series =
            1.0 - e2 / 10.0 + e3 / 14.0 + e2 * e2 / 24.0 - 3.0 * e2 * e3 / 44.0 - 5.0 * e2.powi(3) / 208.0
                + 3.0 * e3 * e3 / 104.0
                + e2 * e2 * e3 / 16.0;
        beyond + sin * series / mean.sqrt()
    }

    /// Mean and cosine coefficients of a function of dn over its period 2K: sum c_n cos(n pi tau/K), n from 1.
    pub fn cosines(&self, function: impl Fn(f64) -> f64) -> (f64, Vec<f64>) {
        // sums of departures from one value keep the digits of the mean
        let base = function(1.0);
        let mut points = 16;
        loop {
            // even in tau: half a period and its ends
            let values = (0..=points)
                .map(|j| function(self.functions(self.quarter * j as f64 / points as f64).2) - base)
                .collect::<Vec<_>>();
            let coefficient = |n: usize| {
                let sum = (0..=points).map(|j| {
                    let ends = if j == 0 || j == points { 0.5 } else { 1.0 };
                    let turn = (n * j) % (2 * points);
                    ends * values[j] * (PI * turn as f64 / points as f64).cos()
                });
                2.0 * sum.sum::<f64>() / points as f64
            };
            let coefficients = (1..points).map(coefficient).collect::<Vec<_>>();
            let mean = base + 0.5 * coefficient(0);
            let rest = coefficients.iter().rev().take(points / 4).fold(0.0f64, |m, c| m.max(c.abs()));
            if rest < 1e-15 * mean.abs() || points >= 2048 {
                let kept = coefficients.iter().rposition(|c| c.abs() > 1e-18 * mean.abs()).map_or(0, |at| at + 1);
                return (mean, coefficients[..kept].to_vec());
            }
            points *= 2;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Abramowitz & Stegun 1964, tables 17.1 and 16.1: K(0.5), and sn, cn, dn at half of it, where sn^2 = 1/(1 + k').
    #[test]
    fn published_values() {
        let half = Elliptic::new(0.5, 0.5);
        assert!((half.quarter - 1.854_074_677_301_372).abs() < 1e-15);
        let (sn, cn, dn) = half.functions(0.5 * half.quarter);
        let k = 0.5f64.sqrt();
        assert!((sn * sn - 1.0 / (1.0 + k)).abs() < 1e-15 && (cn * cn - k / (1.0 + k)).abs() < 1e-15);
        assert!((dn * dn - k).abs() < 1e-15);
    }

    #[test]
    fn the_integral_is_the_inverse_of_the_functions() {
        for complement in [1.0, 0.7, 1e-3, 1e-12] {
            let elliptic = Elliptic::new(1.0 - complement, complement);
            for k in -19..=19 {
                let u = f64::from(k) * 0.1 * elliptic.quarter;
                let (sn, cn, _) = elliptic.functions(u);
                let back = elliptic.first_kind(sn.atan2(cn));
                // a rounding of the angle counts 1/dn times, at most 1/k'
                let allowed = 1e-12 + 1e-15 / complement.sqrt();
                assert!((back - u).abs() < allowed * elliptic.quarter, "{complement} {k}: {back} {u}");
            }
        }
    }

    #[test]
    fn a_cosine_series_repeats_its_function() {
        let elliptic = Elliptic::new(0.9, 0.1);
        let function = |dn: f64| 1.0 / (1.0 + 0.8 * dn);
        let (mean, cosines) = elliptic.cosines(function);
        for k in 0..20 {
            let u = f64::from(k) * 0.137;
            let theta = PI * u / elliptic.quarter;
            let sum = cosines.iter().enumerate().map(|(n, c)| c * ((n + 1) as f64 * theta).cos()).sum::<f64>();
            assert!((mean + sum - function(elliptic.functions(u).2)).abs() < 1e-14);
        }
    }
}
