//! Sunlight that the Earth reflects on an object: first order, a Lambert sphere without air, clouds or seas.
//!
//! A patch of the Earth lit at the cosine mu has the radiance A E_sun mu / pi. The disc that an object sees is parted into
//! patches of known solid angle; each lights the object like a small Sun.

use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// Bond albedo of the Earth (Stephens et al. 2015, Rev. Geophys. 53, 141: 0.29).
pub const ALBEDO: f64 = 0.29;

/// Rings of patches, and patches in each.
const RINGS: usize = 8;
const AROUND: usize = 12;

/// Directions, from the object, of patches of the Earth's lit face, and the irradiance each makes as a share of the Sun's.
///
/// `earth` is the unit vector to the Earth's centre, `sun` the one to the Sun; `distance` that of the centre in radii of the
/// Earth, above 1. The sum of the shares is within 1 % of the integral over the disc to a phase angle of 90 deg, 6 % to 100 deg and,
/// from far away, 140 deg; a crescent thinner than a patch is lost. The Sun's parallax is left out.
pub fn patches(earth: DVec3, distance: f64, sun: DVec3) -> Vec<(DVec3, f64)> {
    let rim = 1.0 / distance;
    if !(rim > 0.0 && rim < 1.0) {
        return Vec::new();
    }
    let (east, north) = earth.any_orthonormal_pair();
    // equal solid angles: the cosine from the centre is uniform
    let least = (1.0 - rim * rim).sqrt();
    let solid_angle = TAU * (1.0 - least) / (RINGS * AROUND) as f64;
    let patch = |(ring, k): (usize, usize)| {
        let cosine = 1.0 - (1.0 - least) * (ring as f64 + 0.5) / RINGS as f64;
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        let angle = TAU * (k as f64 + 0.5 * (ring % 2) as f64) / AROUND as f64;
        let direction = earth * cosine + (east * angle.cos() + north * angle.sin()) * sine;
        // where the line of sight meets the sphere, the near side
        let reach = distance * cosine - (1.0 - distance * distance * sine * sine).max(0.0).sqrt();
        let normal = direction * reach - earth * distance;
        (direction, ALBEDO / PI * normal.dot(sun).max(0.0) * solid_angle)
    };
    (0..RINGS)
        .flat_map(|ring| (0..AROUND).map(move |k| (ring, k)))
        .map(patch)
        .filter(|(_, share)| *share > 0.0)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn total(distance: f64, phase: f64) -> f64 {
        let sun = DVec3::new(-phase.cos(), phase.sin(), 0.0);
        patches(DVec3::X, distance, sun).iter().map(|(_, share)| share).sum()
    }

    /// A Lambert sphere far away has the irradiance (2/3) A (sin a + (pi - a) cos a) / (pi d^2).
    #[test]
    fn far_away_it_is_the_lambert_sphere() {
        for phase in [0.0f64, 0.5, 1.0, 1.5] {
            let exact = 2.0 / 3.0 * ALBEDO * (phase.sin() + (PI - phase) * phase.cos()) / PI / 60f64.powi(2);
            let own = total(60.0, phase);
            assert!((own / exact - 1.0).abs() < 0.02, "{phase}: {own} {exact}");
        }
    }

    #[test]
    fn near_the_ground_under_a_high_sun_it_is_half_the_sky() {
        // a plate over an endless lit plain gets A E; the sum counts light from all the disc undimmed by slant
        let own = total(1.000_001, 0.0);
        assert!(own > ALBEDO && own < 2.0 * ALBEDO, "{own}");
        assert!(patches(DVec3::X, 0.9, DVec3::X).is_empty() && patches(DVec3::X, f64::NAN, DVec3::X).is_empty());
        assert_eq!(total(1.1, PI), 0.0);
    }
}
