//! The Earth's shadow: the share of the Sun's disc that a satellite sees.
//!
//! Overlap of two discs on the sky (Montenbruck & Gill 2000, "Satellite Orbits", sect. 3.4.2), with a sphere
//! of the equatorial radius for the Earth: the flattening moves the shadow's edge by up to 21 km near the
//! poles, refraction and the Sun's limb darkening are left out.

use crate::base::constants::{EARTH_RADIUS_M, SUN_RADIUS_M};
use glam::DVec3;

/// Share of the Sun's disc, 0 (umbra) to 1 (full sunlight), seen from `satellite` with the Sun at `sun`, both
/// from the geocentre \[m\]. A place inside the Earth sees no Sun.
pub fn sunlit(satellite: DVec3, sun: DVec3) -> f64 {
    let to_sun = sun - satellite;
    let distance = satellite.length();
    if distance <= EARTH_RADIUS_M {
        return 0.0;
    }
    let sun_radius = (SUN_RADIUS_M / to_sun.length()).min(1.0).asin();
    let earth_radius = (EARTH_RADIUS_M / distance).asin();
    let apart = super::separation(to_sun, -satellite);
    1.0 - covered(sun_radius, earth_radius, apart)
}

/// Share of a disc of radius `a` covered by a disc of radius `b` at distance `c` \[rad\].
fn covered(a: f64, b: f64, c: f64) -> f64 {
    if c >= a + b {
        0.0
    } else if c <= b - a {
        1.0
    } else if c <= a - b {
        (b / a).powi(2)
    } else {
        // Montenbruck & Gill, eqs 3.85-3.87
        let x = (c * c + a * a - b * b) / (2.0 * c);
        let y = (a * a - x * x).max(0.0).sqrt();
        let area = a * a * (x / a).clamp(-1.0, 1.0).acos() + b * b * ((c - x) / b).clamp(-1.0, 1.0).acos() - c * y;
        (area / (std::f64::consts::PI * a * a)).clamp(0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::constants::AU_M;

    #[test]
    fn a_geostationary_satellite_behind_the_earth_is_dark_and_beside_it_lit() {
        let sun = DVec3::X * AU_M;
        assert_eq!(sunlit(DVec3::new(-42.164e6, 0.0, 0.0), sun), 0.0);
        assert_eq!(sunlit(DVec3::new(42.164e6, 0.0, 0.0), sun), 1.0);
        assert_eq!(sunlit(DVec3::new(-42.164e6, 8e6, 0.0), sun), 1.0);
        // half the disc where the limb of the Earth crosses the Sun's centre
        let half = sunlit(DVec3::new(-42.164e6, EARTH_RADIUS_M, 0.0), sun);
        assert!((half - 0.5).abs() < 0.05, "{half}");
    }

    #[test]
    fn the_share_falls_without_steps_through_the_penumbra() {
        let sun = DVec3::X * AU_M;
        let shares = (0..=1000)
            .map(|i| sunlit(DVec3::new(-42.164e6, 7e6 - 1e3 * f64::from(i), 0.0), sun))
            .collect::<Vec<_>>();
        assert!(shares.windows(2).all(|w| w[1] <= w[0] && w[0] - w[1] < 0.005));
        assert_eq!((shares[0], shares[1000]), (1.0, 0.0));
    }
}
