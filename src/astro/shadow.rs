//! The Earth's shadow: the share of the Sun's light that reaches a satellite.
//!
//! The Earth is the WGS 84 ellipsoid, its outline the cone of lines that touch it; the Sun is a disc of nominal radius,
//! darkened towards its limb (Hestroffer & Magnan 1998, A&A 333, 338: mu^0.508 at 550 nm). Umbra: the disc lies inside the
//! outline; penumbra: they overlap. The distance from the Sun's centre to the outline is taken along the great circle
//! through the Earth's centre, which errs by less than 1 m at the satellite; within the penumbra the outline is a circle
//! through its nearest point. Refraction by the air, which lights the umbra dimly, is left out.

use crate::base::constants::{EARTH_FLATTENING, EARTH_RADIUS_M, SUN_RADIUS_M};
use glam::DVec3;
use std::f64::consts::PI;

/// Exponent of the Sun's limb darkening at 550 nm.
const LIMB_EXPONENT: f64 = 0.508;

/// The Sun behind the Earth's limb, seen from a satellite; angles in radians.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Occultation {
    /// From the limb to the Sun's centre, positive outside the Earth's outline.
    pub margin: f64,
    /// Radius of the Sun's disc.
    pub sun_radius: f64,
    /// Radius of the Earth's outline on the Sun's side.
    pub earth_radius: f64,
}

impl Occultation {
    /// Seen from `satellite` with the Sun at `sun`, both from the geocentre \[m\], and the Earth's axis along the unit
    /// vector `pole`. None inside the Earth.
    pub fn of(satellite: DVec3, sun: DVec3, pole: DVec3) -> Option<Self> {
        let b = EARTH_RADIUS_M * (1.0 - EARTH_FLATTENING);
        let (over_a2, over_b2) = (EARTH_RADIUS_M.powi(-2), b.powi(-2));
        // the ellipsoid is x.M.x = 1
        let form = |x: DVec3, y: DVec3| x.dot(y) * over_a2 + (over_b2 - over_a2) * x.dot(pole) * y.dot(pole);
        let outside = form(satellite, satellite) - 1.0;
        if outside.is_nan() || outside <= 0.0 {
            return None;
        }
        let to_sun = sun - satellite;
        let s = to_sun.normalize();
        // a line along d touches the ellipsoid where cone(d, d) = 0
        let cone = |x: DVec3, y: DVec3| form(satellite, x) * form(satellite, y) - outside * form(x, y);
        let down = -satellite.normalize();
        let apart = super::separation(s, down);
        let across = down - s * down.dot(s);
        // Sun, satellite and Earth in one line: any great circle is one through the centre
        let towards = across.try_normalize().unwrap_or_else(|| s.any_orthonormal_vector());
        // along d = s cos x + towards sin x the form is mean + half cos(2x - phase)
        let (ss, st, tt) = (cone(s, s), cone(s, towards), cone(towards, towards));
        let phase = st.atan2(0.5 * (ss - tt));
        let half_width = 0.5 * (-(0.5 * (ss + tt)) / st.hypot(0.5 * (ss - tt))).clamp(-1.0, 1.0).acos();
        // the form is largest in the middle of the outline, which is near the direction of the centre
        let middle = 0.5 * phase + PI * ((apart - 0.5 * phase) / PI).round();
        Some(Self {
            margin: middle - half_width,
            sun_radius: (SUN_RADIUS_M / to_sun.length()).min(1.0).asin(),
            earth_radius: half_width,
        })
    }

    /// Share of the Sun's light that passes, 0 (umbra) to 1.
    pub fn sunlit(&self) -> f64 {
        if self.margin >= self.sun_radius {
            return 1.0;
        }
        if self.margin <= -self.sun_radius {
            return 0.0;
        }
        // rings of the disc with equal light: w from 0 at the limb to 1 at the centre
        const RINGS: usize = 64;
        let share = 1.0 / (1.0 + 0.5 * LIMB_EXPONENT);
        let between = self.earth_radius + self.margin;
        let open = |w: f64| {
            let ring = self.sun_radius * (1.0 - w.powf(share)).max(0.0).sqrt();
            let cosine = (ring * ring + between * between - self.earth_radius * self.earth_radius)
                / (2.0 * ring * between).max(f64::MIN_POSITIVE);
            1.0 - cosine.clamp(-1.0, 1.0).acos() / PI
        };
        // rings inside |margin| are wholly open or wholly hidden
        let edge = (1.0 - (self.margin / self.sun_radius).powi(2)).max(0.0).powf(1.0 / share);
        let inner = if self.margin > 0.0 { 1.0 - edge } else { 0.0 };
        // nodes crowd where the share of a ring starts like a square root
        let sum = (0..RINGS).map(|k| {
            let angle = PI * (k as f64 + 0.5) / RINGS as f64;
            open(edge * 0.5 * (1.0 - angle.cos())) * angle.sin()
        });
        (inner + edge * sum.sum::<f64>() * 0.5 * PI / RINGS as f64).clamp(0.0, 1.0)
    }
}

/// Share of the Sun's light, 0 (umbra) to 1 (full sunlight), at `satellite` with the Sun at `sun`, both from the
/// geocentre \[m\], the Earth's axis along `pole`. A place inside the Earth sees no Sun.
pub fn sunlit(satellite: DVec3, sun: DVec3, pole: DVec3) -> f64 {
    Occultation::of(satellite, sun, pole).map_or(0.0, |o| o.sunlit())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::constants::AU_M;

    fn lit(x: f64, y: f64, z: f64) -> f64 {
        sunlit(DVec3::new(x, y, z), DVec3::X * AU_M, DVec3::Z)
    }

    #[test]
    fn a_geostationary_satellite_behind_the_earth_is_dark_and_beside_it_lit() {
        assert_eq!(lit(-42.164e6, 0.0, 0.0), 0.0);
        assert_eq!(lit(42.164e6, 0.0, 0.0), 1.0);
        assert_eq!(lit(-42.164e6, 8e6, 0.0), 1.0);
        // half the disc where the limb of the Earth crosses the Sun's centre, a little less as the limb is curved
        let half = lit(-42.164e6, EARTH_RADIUS_M, 0.0);
        assert!((half - 0.5).abs() < 0.02, "{half}");
        assert_eq!(lit(1e6, 0.0, 0.0), 0.0);
        assert!(sunlit(DVec3::NAN, DVec3::X * AU_M, DVec3::Z) == 0.0);
    }

    #[test]
    fn the_share_falls_without_steps_through_the_penumbra() {
        let shares = (0..=4000).map(|i| lit(-42.164e6, 7e6 - 250.0 * f64::from(i), 0.0)).collect::<Vec<_>>();
        assert!(shares.windows(2).all(|w| w[1] <= w[0] + 1e-6 && w[0] - w[1] < 0.002));
        assert_eq!((shares[0], shares[4000]), (1.0, 0.0));
    }

    /// The share by brute force: a fine grid of points of the disc, each by its own line of sight to the ellipsoid.
    #[test]
    fn the_share_agrees_with_points_of_the_disc() {
        let pole = DVec3::new(0.2, -0.3, 0.9).normalize();
        let sun = DVec3::new(1.0, 0.2, -0.1).normalize() * AU_M;
        let (over_a2, over_b2) = (EARTH_RADIUS_M.powi(-2), (EARTH_RADIUS_M * (1.0 - EARTH_FLATTENING)).powi(-2));
        let form = |x: DVec3, y: DVec3| x.dot(y) * over_a2 + (over_b2 - over_a2) * x.dot(pole) * y.dot(pole);
        for (distance, offset, side) in [
            (42.164e6, 6.37e6, pole),
            (42.164e6, 6.5e6, pole),
            (7e6, 6.36e6, DVec3::Y),
            (7e6, 6.39e6, pole),
            (26e6, 6.3e6, DVec3::Z),
        ] {
            let s = sun.normalize();
            let up = (side - s * side.dot(s)).normalize();
            let place = up * offset - s * (distance * distance - offset * offset).sqrt();
            let to_sun = sun - place;
            let radius = (SUN_RADIUS_M / to_sun.length()).asin();
            let s = to_sun.normalize();
            let (u, v) = s.any_orthonormal_pair();
            let (mut seen, mut all) = (0.0, 0.0);
            const N: i32 = 600;
            for i in -N..=N {
                for k in -N..=N {
                    let (x, y) = (f64::from(i) / f64::from(N), f64::from(k) / f64::from(N));
                    let r2 = x * x + y * y;
                    if r2 >= 1.0 {
                        continue;
                    }
                    let light = (1.0 - r2).powf(0.5 * LIMB_EXPONENT);
                    let d = (s + (u * x + v * y) * radius.tan()).normalize();
                    let (rd, dd) = (form(place, d), form(d, d));
                    let blocked = rd < 0.0 && rd * rd > dd * (form(place, place) - 1.0);
                    all += light;
                    seen += if blocked { 0.0 } else { light };
                }
            }
            let own = sunlit(place, sun, pole);
            assert!((own - seen / all).abs() < 2e-3, "{distance} {offset}: {own} {}", seen / all);
        }
    }

    #[test]
    fn flattening_moves_the_edge_by_its_21_km() {
        let edge = |y: bool| {
            let (mut low, mut high) = (6e6, 7e6);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                let share = if y { lit(-7e6, middle, 0.0) } else { lit(-7e6, 0.0, middle) };
                if share > 0.0 { high = middle } else { low = middle }
            }
            high
        };
        let moved = edge(true) - edge(false);
        assert!((moved - 21.385e3).abs() < 200.0, "{moved}");
    }
}
