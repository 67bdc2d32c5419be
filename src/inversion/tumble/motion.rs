//! The motion of a body without torque, and how it may be changed.

use crate::astro::rotation::Quaternion;
use crate::astro::tumble::Tumble;
use glam::{DQuat, DVec3};
use std::f64::consts::TAU;

/// Unknowns of a motion.
pub(super) const UNKNOWNS: usize = 8;
/// Least mean square of the mass along an axis, as a share of all.
const FLAT: f64 = 1e-3;

/// A motion without torque, from an instant on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Principal axes to inertial ones, unit.
    pub attitude: DQuat,
    /// Rates in principal axes \[rad/s\].
    pub rate: DVec3,
    /// Principal moments; their ratios count, each above 0 and at most the sum of the others.
    pub inertia: DVec3,
}

impl Motion {
    /// A symmetric body whose axis z stands at the angle `nutation` \[rad\] from the angular momentum, along the inertial direction
    /// `momentum`, and goes about it once in `turn` seconds, from the angle `phase` \[rad\]; `moment` is that about the axis over those across it,
    /// above 0 and at most 2.
    pub fn precessing(momentum: DVec3, phase: f64, nutation: f64, turn: f64, moment: f64) -> Self {
        let frame = DQuat::from_rotation_arc(DVec3::Z, momentum);
        let attitude = (frame * DQuat::from_rotation_z(phase) * DQuat::from_rotation_x(nutation)).normalize();
        let along = attitude.conjugate() * momentum;
        // L is the same number for both: I w across, I_z w_z along
        let rate = DVec3::new(along.x, along.y, along.z / moment) * (TAU / turn);
        Self { attitude, rate, inertia: DVec3::new(1.0, 1.0, moment) }
    }

    /// The direction of the angular momentum, inertial axes.
    pub fn momentum(&self) -> DVec3 {
        (self.attitude * (self.inertia * self.rate)).normalize_or_zero()
    }

    /// Seconds of a turn about the angular momentum, on average, and of a turn of the angular momentum in the body; none for a turn about a
    /// principal axis.
    pub fn periods(&self) -> Option<(f64, f64)> {
        self.tumble()?.periods()
    }

    fn tumble(&self) -> Option<Tumble> {
        Tumble::new(self.inertia, Quaternion(self.attitude), self.rate).ok()
    }

    /// The motion `seconds` later; none for moments that no body has.
    pub fn after(&self, seconds: f64) -> Option<Self> {
        let tumble = self.tumble()?;
        Some(Self { attitude: tumble.attitude(seconds).0, rate: tumble.rate(seconds), inertia: self.inertia })
    }

    /// Directions in principal axes at the times given \[s\], from inertial ones; none for moments that no body has.
    pub fn body_axes(&self, times: &[f64], directions: &[(DVec3, DVec3)]) -> Option<Vec<(DVec3, DVec3)>> {
        let tumble = self.tumble()?;
        let turned = |(t, &(s, o)): (&f64, &(DVec3, DVec3))| {
            let back = tumble.attitude(*t).0.conjugate();
            ((back * s).normalize(), (back * o).normalize())
        };
        Some(times.iter().zip(directions).map(turned).collect())
    }

    /// Logarithms of the ratios of the mass's mean squares along x and y to that along z: every value of them is a body.
    fn ratios(&self) -> [f64; 2] {
        let sum = 0.5 * self.inertia.element_sum();
        let square = (DVec3::splat(sum) - self.inertia).max(DVec3::splat(FLAT * sum));
        [libm::log(square.x / square.z), libm::log(square.y / square.z)]
    }

    /// With its unknowns changed: turns about the principal axes \[rad\], rates \[rad/s\], ratios.
    pub(super) fn changed(&self, by: &[f64]) -> Self {
        let at = |k: usize| by.get(k).copied().unwrap_or(0.0);
        let turn = DQuat::from_scaled_axis(DVec3::new(at(0), at(1), at(2)));
        let ratios = self.ratios();
        let (x, y) = (libm::exp(ratios[0] + at(6)), libm::exp(ratios[1] + at(7)));
        let inertia = DVec3::new(y + 1.0, x + 1.0, x + y) / (x + y + 1.0);
        let rate = self.rate + DVec3::new(at(3), at(4), at(5));
        Self { attitude: (self.attitude * turn).normalize(), rate, inertia }
    }

    /// The same motion of a body whose moments across z differ by a little, in axes turned about z by an angle: two angles 45 deg apart
    /// are all ways a symmetric body can be made less so.
    pub(super) fn less_symmetric(&self, by: f64, angle: f64) -> Self {
        let turn = DQuat::from_rotation_z(angle);
        let turned =
            Self { attitude: (self.attitude * turn).normalize(), rate: turn.conjugate() * self.rate, ..*self };
        turned.changed(&[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, by, -by])
    }

    /// The greatest angle by which two motions turn a body differently from the first of the times on \[rad\]: axes in the body do not matter.
    pub fn differs(&self, other: &Self, times: &[f64]) -> f64 {
        let (Some(a), Some(b), Some(&first)) = (self.tumble(), other.tumble(), times.first()) else {
            return f64::INFINITY;
        };
        let turn = |m: &Tumble, t: f64| m.attitude(t).0 * m.attitude(first).0.conjugate();
        let apart = |&t: &f64| {
            let between = turn(&a, t) * turn(&b, t).conjugate();
            2.0 * between.xyz().length().atan2(between.w.abs())
        };
        times.iter().map(apart).fold(0.0, f64::max)
    }
}
