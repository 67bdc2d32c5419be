//! Directions on the sphere.

use glam::DVec3;
use std::f64::consts::PI;

/// `count` directions evenly spread: Fibonacci's spiral, each for an equal share of the sphere (Gonzalez 2010, Math. Geosci.
/// 42, 49).
pub fn fibonacci(count: usize) -> impl ExactSizeIterator<Item = DVec3> {
    let golden = PI * (3.0 - 5f64.sqrt());
    (0..count).map(move |k| {
        let z = 1.0 - (2.0 * k as f64 + 1.0) / count as f64;
        let r = (1.0 - z * z).sqrt();
        let angle = golden * k as f64;
        DVec3::new(r * libm::cos(angle), r * libm::sin(angle), z)
    })
}

/// Typical distance between neighbours of [`fibonacci`] \[rad\].
pub fn spacing(count: usize) -> f64 {
    (4.0 * PI / count.max(1) as f64).sqrt()
}

/// Angle between two directions \[rad\], exact for small ones too.
pub fn angle(a: DVec3, b: DVec3) -> f64 {
    libm::atan2(a.cross(b).length(), a.dot(b))
}

/// Two unit vectors that complete a unit vector to a right-handed set.
pub fn tangents(n: DVec3) -> [DVec3; 2] {
    let (a, b) = n.any_orthonormal_pair();
    [a, b]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn even_to_second_order_and_spaced_as_told() {
        let n: Vec<DVec3> = fibonacci(1000).collect();
        let mean: DVec3 = n.iter().sum::<DVec3>() / 1000.0;
        let zz: f64 = n.iter().map(|n| n.z * n.z).sum::<f64>() / 1000.0;
        let xx: f64 = n.iter().map(|n| n.x * n.x).sum::<f64>() / 1000.0;
        assert!(mean.length() < 1e-3 && (zz - 1.0 / 3.0).abs() < 1e-3 && (xx - 1.0 / 3.0).abs() < 1e-3);
        let nearest = n[1..].iter().map(|m| angle(*m, n[0])).fold(f64::INFINITY, f64::min);
        assert!(nearest > 0.4 * spacing(1000) && nearest < 1.5 * spacing(1000));
        assert!(fibonacci(1).next().is_some_and(|n| n.is_normalized()) && fibonacci(0).next().is_none());
    }
}
