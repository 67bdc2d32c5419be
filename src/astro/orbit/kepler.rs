//! Osculating elements of an ellipse and the state they describe.
//!
//! Kepler's equation by Newton's method kept inside a bracket (Danby 1988, "Fundamentals of Celestial Mechanics",
//! section 6.6): it converges for every eccentricity below 1. The state is computed through 1 - e, so that it keeps its
//! digits near perigee of an orbit with e close to 1.

use super::State;
use glam::{DMat3, DVec3};
use std::f64::consts::PI;

/// Osculating elements about the Earth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kepler {
    /// Semi-major axis \[m\], above 0.
    pub a: f64,
    /// Eccentricity, 0 <= e < 1.
    pub e: f64,
    /// Inclination \[rad\].
    pub i: f64,
    /// Right ascension of the ascending node \[rad\].
    pub raan: f64,
    /// Argument of perigee \[rad\].
    pub argp: f64,
    /// Mean anomaly \[rad\].
    pub mean_anomaly: f64,
}

/// Eccentric anomaly \[rad\] in -pi..pi of a mean anomaly \[rad\] and eccentricity 0 <= e < 1.
pub fn eccentric_anomaly(mean_anomaly: f64, e: f64) -> f64 {
    let turned = mean_anomaly.rem_euclid(2.0 * PI);
    let m = if turned > PI { turned - 2.0 * PI } else { turned };
    // the root lies between m and m + e on the side of m
    let (mut low, mut high) = if m >= 0.0 { (m, m + e) } else { (m - e, m) };
    let mut anomaly = m + 0.85 * e * m.signum();
    for _ in 0..80 {
        let residual = anomaly - e * anomaly.sin() - m;
        if residual > 0.0 {
            high = high.min(anomaly)
        } else {
            low = low.max(anomaly)
        }
        let newton = anomaly - residual / (1.0 - e * anomaly.cos());
        let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
        if (next - anomaly).abs() <= 1e-16 * (1.0 + anomaly.abs()) {
            return next;
        }
        anomaly = next;
    }
    anomaly
}

impl Kepler {
    /// The state for a gravitational parameter `gm` \[m^3/s^2\].
    pub fn state(&self, gm: f64) -> State {
        let anomaly = eccentric_anomaly(self.mean_anomaly, self.e);
        let (sin, cos) = anomaly.sin_cos();
        let half = (0.5 * anomaly).sin();
        // 1 - e cos E and cos E - e without cancellation near perigee
        let versine = 2.0 * half * half;
        let near = (1.0 - self.e) + self.e * versine;
        let minor = ((1.0 - self.e) * (1.0 + self.e)).sqrt();
        let speed = (gm / self.a).sqrt() / near;
        let position = DVec3::new((1.0 - self.e) - versine, minor * sin, 0.0) * self.a;
        let velocity = DVec3::new(-sin, minor * cos, 0.0) * speed;
        let turn =
            DMat3::from_rotation_z(self.raan) * DMat3::from_rotation_x(self.i) * DMat3::from_rotation_z(self.argp);
        State { position: turn * position, velocity: turn * velocity }
    }

    /// The ellipse of a state; none if the orbit is not one or the motion is along the radius.
    pub fn of(state: &State, gm: f64) -> Option<Self> {
        let (r, v) = (state.position, state.velocity);
        let radius = r.length();
        let a = 1.0 / (2.0 / radius - v.length_squared() / gm);
        let h = r.cross(v);
        let eccentric = v.cross(h) / gm - r / radius;
        let e = eccentric.length();
        if !(a.is_finite() && a > 0.0 && e < 1.0 && h.length() > 0.0) {
            return None;
        }
        let node = DVec3::Z.cross(h);
        // an orbit in the equator has its node at the x axis, a circle its perigee at the node
        let node = if node.length() > 1e-12 * h.length() { node.normalize() } else { DVec3::X };
        let perigee = if e > 1e-12 { eccentric / e } else { node };
        let pole = h.normalize();
        let angle = |from: DVec3, to: DVec3| from.cross(to).dot(pole).atan2(from.dot(to));
        let (sin_e, cos_e) = (r.dot(v) / (gm * a).sqrt(), 1.0 - radius / a);
        let mean_anomaly = if e > 1e-12 { sin_e.atan2(cos_e) - sin_e } else { angle(perigee, r) };
        Some(Self {
            a,
            e,
            i: pole.x.hypot(pole.y).atan2(pole.z),
            raan: node.y.atan2(node.x),
            argp: angle(node, perigee),
            mean_anomaly,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::constants::EARTH_GM;

    #[test]
    fn keplers_equation_holds_to_rounding_for_every_eccentricity() {
        for e in [0.0, 1e-9, 0.1, 0.7, 0.99, 0.999_999, 1.0 - 1e-12] {
            for k in -400..=400 {
                let m = f64::from(k) * 0.0157;
                let anomaly = eccentric_anomaly(m, e);
                let off = (anomaly - e * anomaly.sin() - m + PI).rem_euclid(2.0 * PI) - PI;
                assert!(off.abs() < 2e-15, "e {e}, M {m}: {off:e}");
            }
            for m in [1e-300, 1e-12, -1e-9] {
                let anomaly = eccentric_anomaly(m, e);
                assert!(anomaly.is_finite() && (anomaly >= 0.0) == (m >= 0.0));
            }
        }
    }

    #[test]
    fn elements_and_states_are_inverse() {
        for e in [1e-3, 0.1, 0.74, 0.97] {
            for i in [0.01, 1.1, 2.0, 3.1] {
                let own = Kepler { a: 2.6e7, e, i, raan: 0.4, argp: -1.3, mean_anomaly: 2.2 };
                let back = Kepler::of(&own.state(EARTH_GM), EARTH_GM).expect("an ellipse");
                for (x, y) in
                    [(back.e, e), (back.i, i), (back.raan, 0.4), (back.argp, -1.3), (back.mean_anomaly, 2.2)]
                {
                    assert!((x - y).abs() < 3e-12, "{own:?} {back:?}");
                }
                assert!((back.a / own.a - 1.0).abs() < 1e-13);
            }
        }
    }

    #[test]
    fn circles_the_equator_and_hyperbolas() {
        let ring = Kepler { a: 4.2e7, e: 0.0, i: 0.0, raan: 0.0, argp: 0.0, mean_anomaly: 1.0 };
        let back = Kepler::of(&ring.state(EARTH_GM), EARTH_GM).expect("a circle");
        let there = (back.state(EARTH_GM).position - ring.state(EARTH_GM).position).length();
        assert!(there < 1e-6, "{there}");
        let fast = State { position: DVec3::X * 7e6, velocity: DVec3::Y * 12e3 };
        assert_eq!(Kepler::of(&fast, EARTH_GM), None);
        assert_eq!(Kepler::of(&State { position: DVec3::ZERO, velocity: DVec3::NAN }, EARTH_GM), None);
    }
}
