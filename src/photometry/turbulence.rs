//! The image of a point in a long exposure through Kolmogorov turbulence (Fried 1966, JOSA 56, 1372), for FWHM = 1.
//!
//! The Hankel transform of exp(-3.44 f^(5/3)), whose Laplacians are the transforms of -(2 pi f)^2, its square and its cube
//! times that. Tables over asinh(r / 0.3) hold the logarithm of the intensity and the Laplacians relative to it.

use std::f64::consts::PI;
use std::sync::OnceLock;

/// FWHM of the profile in units of lambda/r0.
const FWHM: f64 = 0.975_54;
/// Steps of the tables, between whose values runs a cubic.
const TABLE_STEPS: usize = 200;
/// Radius at which they end, and where the wings begin \[FWHM\].
const TABLE_END: f64 = 20.0;
const WINGS: f64 = 8.0;
const TABLE_SOFT: f64 = 0.3;

/// Intensity at `r`, unit flux.
pub fn intensity(r: f64) -> f64 {
    laplacians(r * r)[0]
}

/// Intensity at r^2 = `u` and its first three Laplacians.
pub fn laplacians(u: f64) -> [f64; 4] {
    static TABLE: OnceLock<Vec<[f64; 4]>> = OnceLock::new();
    let r = u.sqrt();
    if r.is_nan() || r >= TABLE_END {
        return wing(r);
    }
    let end = asinh(TABLE_END / TABLE_SOFT);
    let table = TABLE.get_or_init(|| {
        let transfer = transfer();
        let node = |i: usize| {
            let [intensity, rest @ ..] =
                reference(&transfer, (i as f64 * end / TABLE_STEPS as f64).sinh() * TABLE_SOFT);
            let [a, b, c] = rest.map(|laplacian| laplacian / intensity);
            [intensity.ln(), a, b, c]
        };
        (0..=TABLE_STEPS + 2).map(node).collect()
    });
    let t = asinh(r / TABLE_SOFT) / end * TABLE_STEPS as f64;
    let i = (t as usize).min(TABLE_STEPS);
    let u = t - i as f64;
    // even about the middle
    let [a, b, c, d] = [table[if i == 0 { 1 } else { i - 1 }], table[i], table[i + 1], table[i + 2]];
    let cubic = |k: usize| {
        let [a, b, c, d] = [a[k], b[k], c[k], d[k]];
        b + 0.5 * u * (c - a + u * (2.0 * a - 5.0 * b + 4.0 * c - d + u * (3.0 * (b - c) + d - a)))
    };
    let intensity = cubic(0).exp();
    [intensity, intensity * cubic(1), intensity * cubic(2), intensity * cubic(3)]
}

/// asinh of a number that is not negative, to 2e-16.
fn asinh(x: f64) -> f64 {
    (x + (x * x + 1.0).sqrt()).ln()
}

/// The first two terms of the wings, from the powers f^(5/3) and f^(10/3) of the transfer function: c theta^-p each, with
/// the Laplacian c p^2 theta^(-p-2).
fn wing(r: f64) -> [f64; 4] {
    let theta = r * FWHM;
    let mut sum = [0.0; 4];
    for (factor, power) in [(0.022_883, 11.0 / 3.0), (0.025_89, 16.0 / 3.0)] {
        let (mut term, mut power): (f64, f64) = (FWHM * FWHM * factor * theta.powf(-power), power);
        for part in &mut sum {
            *part += term;
            term *= power * power / (r * r);
            power += 2.0;
        }
    }
    sum
}

/// Frequencies f and the integrand without its Bessel function, by Simpson's rule in f^(1/3), where it is smooth.
fn transfer() -> Vec<(f64, f64)> {
    const STEPS: usize = 1200;
    let h = 4f64.cbrt() / STEPS as f64;
    let node = |i: usize| {
        let u = i as f64 * h;
        let f = u * u * u;
        let weight = if i == 0 || i == STEPS { 1.0 } else { (2 + 2 * (i % 2)) as f64 };
        (f, weight * h * u * u * f * (-3.44 * u.powi(5)).exp())
    };
    (0..=STEPS).map(node).collect()
}

/// The Hankel transforms.
fn reference(transfer: &[(f64, f64)], r: f64) -> [f64; 4] {
    if r > WINGS {
        return wing(r);
    }
    let theta = r * FWHM;
    let mut sum = [0.0; 4];
    for (f, part) in transfer {
        let mut term = part * libm::j0(2.0 * PI * f * theta);
        for sum in &mut sum {
            *sum += term;
            term *= -(2.0 * PI * f * FWHM).powi(2);
        }
    }
    sum.map(|s| 2.0 * PI * FWHM * FWHM * s)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_the_middle_at_half_the_width_and_no_step_where_the_wings_begin() {
        let half = intensity(0.5) / intensity(0.0);
        assert!((half - 0.5).abs() < 1e-4, "{half}");
        // the wings are an expansion
        let step = reference(&transfer(), WINGS - 0.001)[0] / wing(WINGS + 0.001)[0];
        assert!((step - 1.0).abs() < 0.01, "{step}");
    }

    /// Second differences along two axes, 0.02 apart, to 1 % of the middle's: what the next order leaves of them.
    #[test]
    fn laplacians_are_those_of_the_intensity() {
        let h = 0.02;
        for order in 0..3 {
            for r in [0.0, 0.3, 0.7, 1.3, 2.5, 5.0] {
                let at = |x: f64, y: f64| laplacians(x * x + y * y)[order];
                let around = at(r + h, 0.0) + at(r - h, 0.0) + at(r, h) + at(r, -h);
                let differences = (around - 4.0 * at(r, 0.0)) / (h * h);
                let (found, middle) = (laplacians(r * r)[order + 1], laplacians(0.0)[order + 1]);
                let wrong = (found - differences) / middle;
                assert!(wrong.abs() < 0.01, "{order} at {r}: {found} against {differences}");
            }
        }
    }

    #[test]
    fn tables_are_the_transforms() {
        for r in [0.0, 0.11, 0.52, 1.01, 1.99, 3.3, 6.7] {
            let (table, exact) = (laplacians(r * r), reference(&transfer(), r));
            assert!((table[0] / exact[0] - 1.0).abs() < 1e-5, "{r}: {table:?} against {exact:?}");
        }
    }
}
