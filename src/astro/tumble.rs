//! Torque-free rotation of a rigid body, solved exactly.
//!
//! Body rates by Jacobi's elliptic functions (Landau & Lifshitz, Mechanics, sect. 37), with every difference of energy
//! and momentum written as a sum of squares, so that nearly symmetric bodies and nearly steady turns keep their digits.
//! The attitude follows from the angular momentum L, which stands still in space: turn the body's L onto the axis about
//! which it circulates by the shortest way, then turn about L by an angle psi with
//! d psi/dt = (w.l + w.e)/(1 + l.e) (l, e: unit vectors of L and the axis in the body; follows from dl/dt = l x w).
//! That rate has the period of the nutation and no singular place, and its Fourier series, which converges like the
//! elliptic functions' own, is integrated term by term: one constant rate and a few sines, whatever the time.
//!
//! Error: the phase's rounding, 1e-16 of the angle turned through, times 1/(1 - m) near the separatrix, where the motion
//! itself forgets where it came from. Its twin is a splitting integrator ([`integrated_reference`]).

use super::Error;
use super::elliptic::Elliptic;
use super::rotation::Quaternion;
use glam::{DQuat, DVec3};
use std::f64::consts::PI;

/// Smallest 1 - m that is told from the separatrix.
const LEAST_COMPLEMENT: f64 = 1e-30;

/// A rigid body without torque.
#[derive(Debug, Clone)]
pub struct Tumble {
    start: Quaternion,
    /// Rates at the start, for those that stay as they are.
    rate: DVec3,
    motion: Option<Motion>,
}

/// Rates that change.
#[derive(Debug, Clone)]
struct Motion {
    inertia: DVec3,
    /// Angular momentum \[kg m^2/s\].
    momentum: f64,
    /// Axes: the one with cn, the middle one with sn, the one circulated with dn.
    axes: [usize; 3],
    /// Amplitudes with their signs, in that order \[rad/s\].
    amplitude: [f64; 3],
    /// d tau/dt \[1/s\].
    speed: f64,
    /// Argument of the elliptic functions at the start.
    tau0: f64,
    elliptic: Elliptic,
    /// Mean of d psi/d tau, and the coefficients of its cosines.
    psi_mean: f64,
    psi: Vec<f64>,
    /// From the frame of L at the start to inertial components.
    frame: DQuat,
    psi0: f64,
    /// L in inertial components, unit.
    direction: DVec3,
}

/// Principal moments that a body can have.
///
/// # Errors
/// [`Error::Attitude`] if one is not above 0 or exceeds the sum of the others.
pub fn checked_inertia(inertia: DVec3) -> Result<DVec3, Error> {
    let [a, b, c] = inertia.to_array();
    let positive = inertia.is_finite() && a > 0.0 && b > 0.0 && c > 0.0;
    // the sum's rounding is no reason to refuse a flat body
    let room = 1.0 + 1e-12;
    if positive && a <= (b + c) * room && b <= (c + a) * room && c <= (a + b) * room {
        return Ok(inertia);
    }
    Err(Error::Attitude {
        reason: format!(
            "inertia [{a}, {b}, {c}] kg m^2: each moment must be above 0 and at most the sum of the other two"
        ),
    })
}

impl Tumble {
    /// The body with principal moments `inertia` \[kg m^2\], attitude `start` and body rates `rate` \[rad/s\] at time 0.
    ///
    /// # Errors
    /// [`Error::Attitude`] for moments that no body has or rates that are not finite.
    pub fn new(inertia: DVec3, start: Quaternion, rate: DVec3) -> Result<Self, Error> {
        let inertia = checked_inertia(inertia)?;
        if !rate.is_finite() {
            return Err(Error::Attitude { reason: format!("rates {rate} rad/s must be finite") });
        }
        Ok(Self { start, rate, motion: Motion::new(inertia, start, rate) })
    }

    /// Body rates \[rad/s\] after `seconds`.
    pub fn rate(&self, seconds: f64) -> DVec3 {
        self.motion.as_ref().map_or(self.rate, |m| m.rates(m.tau0 + m.speed * seconds))
    }

    /// A bound of the body's rates \[rad/s\]: its angular momentum over its least moment.
    pub fn fastest(&self) -> f64 {
        self.motion.as_ref().map_or(self.rate.length(), |m| m.momentum / m.inertia.min_element())
    }

    /// Seconds of a turn about the angular momentum, on average, and of a turn of the angular momentum in the body; none for rates that
    /// stay as they are.
    pub fn periods(&self) -> Option<(f64, f64)> {
        let motion = self.motion.as_ref()?;
        let nutation = 0.5 * PI * motion.speed / motion.elliptic.quarter;
        // psi counts what the body turns about its own axis too: backwards if the axis is that of the largest moment
        let [a, _, c] = motion.axes;
        let own = if motion.inertia[c] > motion.inertia[a] { -nutation } else { nutation };
        Some((2.0 * PI / (motion.psi_mean * motion.speed - own), 2.0 * PI / nutation))
    }

    /// Attitude after `seconds`.
    pub fn attitude(&self, seconds: f64) -> Quaternion {
        match &self.motion {
            Some(motion) => motion.attitude(seconds),
            None => Quaternion((self.start.0 * DQuat::from_scaled_axis(self.rate * seconds)).normalize()),
        }
    }
}

impl Motion {
    /// The motion; none if the rates stay as they are, or are so slow that their squares vanish.
    fn new(inertia: DVec3, start: Quaternion, rate: DVec3) -> Option<Self> {
        if rate.length() < 1e-100 {
            return None;
        }
        let [low, middle, high] = sorted(inertia);
        let i = |k: usize| inertia[k];
        let w2 = |k: usize| rate[k] * rate[k];
        let gap = |j: usize, k: usize| (i(j) - i(k)).abs();
        // L circulates about the axis of the largest or the smallest moment: the sign of L^2 - 2 E I_middle tells
        let towards_high = i(high) * gap(high, middle) * w2(high);
        let towards_low = i(low) * gap(middle, low) * w2(low);
        let (c, a, b) = if towards_high >= towards_low && gap(high, middle) > 0.0 || gap(middle, low) == 0.0 {
            (high, low, middle)
        } else {
            (low, high, middle)
        };
        let cross = i(a) * gap(c, a) * w2(a) + i(b) * gap(c, b) * w2(b);
        let along = i(b) * gap(b, a) * w2(b) + i(c) * gap(c, a) * w2(c);
        let apart = (i(c) * gap(c, b) * w2(c) - i(a) * gap(b, a) * w2(a)).abs();
        let speed = (gap(c, b) * along / (i(a) * i(b) * i(c))).sqrt();
        if !(cross > 0.0 && speed > 0.0) {
            return None;
        }
        let m = (gap(b, a) * cross / (gap(c, b) * along)).min(1.0);
        let complement = (gap(c, a) * apart / (gap(c, b) * along)).clamp(LEAST_COMPLEMENT, 1.0);
        let elliptic = Elliptic::new(m, complement);
        let around = if rate[c] < 0.0 { -1.0 } else { 1.0 };
        let cyclic = (a + 1) % 3 == b;
        let handed = if cyclic == (i(c) > i(b)) { 1.0 } else { -1.0 };
        let amplitude = [
            (cross / (i(a) * gap(c, a))).sqrt(),
            handed * around * (cross / (i(b) * gap(c, b))).sqrt(),
            around * (along / (i(c) * gap(c, a))).sqrt(),
        ];
        let tau0 = elliptic.first_kind((rate[b] / amplitude[1]).atan2(rate[a] / amplitude[0]));
        let l = inertia * rate;
        let momentum = l.length();
        let axis = DVec3::AXES[c] * around;
        let energy_rate = rate.dot(l) / momentum;
        // d psi/d tau as a function of dn alone
        let slope = |dn: f64| {
            let along_axis = amplitude[2].abs() * dn;
            let cosine = (i(c) * along_axis / momentum).min(1.0);
            (energy_rate + along_axis) / (1.0 + cosine) / speed
        };
        let (psi_mean, psi) = elliptic.cosines(slope);
        let direction = start.to_inertial(l / momentum);
        let frame = start.0 * shortest(l / momentum, axis).conjugate();
        let mut motion = Self {
            inertia,
            momentum,
            axes: [a, b, c],
            amplitude,
            speed,
            tau0,
            elliptic,
            psi_mean,
            psi,
            frame,
            psi0: 0.0,
            direction,
        };
        motion.psi0 = motion.psi_sines(tau0);
        Some(motion)
    }

    fn rates(&self, tau: f64) -> DVec3 {
        let (sn, cn, dn) = self.elliptic.functions(tau);
        let [a, b, c] = self.axes;
        let mut rate = DVec3::ZERO;
        rate[a] = self.amplitude[0] * cn;
        rate[b] = self.amplitude[1] * sn;
        rate[c] = self.amplitude[2] * dn;
        rate
    }

    /// The periodic part of psi, by Clenshaw's recurrence.
    fn psi_sines(&self, tau: f64) -> f64 {
        let theta = PI * (tau / self.elliptic.quarter).rem_euclid(2.0);
        let twice = 2.0 * theta.cos();
        let (mut b1, mut b2) = (0.0, 0.0);
        for (n, c) in self.psi.iter().enumerate().rev() {
            (b1, b2) = (b1 * twice - b2 + c / (n + 1) as f64, b1);
        }
        b1 * theta.sin() * self.elliptic.quarter / PI
    }

    fn attitude(&self, seconds: f64) -> Quaternion {
        let tau = self.tau0 + self.speed * seconds;
        let psi = self.psi_mean * self.speed * seconds + self.psi_sines(tau) - self.psi0;
        let l = (self.inertia * self.rates(tau) / self.momentum).normalize();
        let axis = DVec3::AXES[self.axes[2]] * self.amplitude[2].signum();
        let turned = DQuat::from_axis_angle(self.direction, psi);
        Quaternion((turned * self.frame * shortest(l, axis)).normalize())
    }
}

/// Indices of the moments from the smallest to the largest.
fn sorted(inertia: DVec3) -> [usize; 3] {
    let mut order = [0, 1, 2];
    order.sort_by(|j, k| inertia[*j].total_cmp(&inertia[*k]));
    order
}

/// The shortest turn from one unit vector to another less than 180 deg away.
fn shortest(from: DVec3, to: DVec3) -> DQuat {
    let v = from.cross(to);
    DQuat::from_xyzw(v.x, v.y, v.z, 1.0 + from.dot(to)).normalize()
}

/// Attitude and body rates after `steps` steps of `step_s` seconds: the twin of [`Tumble`], a splitting of the kinetic
/// energy into turns about the three axes (Reich 1996; composed to order 6 by Yoshida 1990, solution A), which conserves
/// the angular momentum to rounding and the energy without drift.
pub fn integrated_reference(
    inertia: DVec3,
    start: Quaternion,
    rate: DVec3,
    step_s: f64,
    steps: usize,
) -> (Quaternion, DVec3) {
    const W: [f64; 3] = [0.784_513_610_477_560, 0.235_573_213_359_357, -1.177_679_984_178_87];
    let middle = 1.0 - 2.0 * (W[0] + W[1] + W[2]);
    let (mut q, mut l) = (start.0, inertia * rate);
    for _ in 0..steps {
        for w in [W[0], W[1], W[2], middle, W[2], W[1], W[0]] {
            for (k, share) in [(0, 0.5), (1, 0.5), (2, 1.0), (1, 0.5), (0, 0.5)] {
                let turn = DQuat::from_axis_angle(DVec3::AXES[k], w * share * step_s * l[k] / inertia[k]);
                q *= turn;
                l = turn.conjugate() * l;
            }
        }
        q = q.normalize();
    }
    (Quaternion(q), l / inertia)
}

#[cfg(test)]
mod tests {
    use super::*;

    const START: Quaternion = Quaternion(DQuat::IDENTITY);

    fn body(inertia: [f64; 3], rate: [f64; 3]) -> Tumble {
        Tumble::new(DVec3::from_array(inertia), START, DVec3::from_array(rate)).expect("a body")
    }

    /// The exact solution and the integrator agree, for L about either axis, near the separatrix, for bodies nearly
    /// symmetric.
    #[test]
    fn two_ways_to_the_same_attitude() {
        for (inertia, rate, allowed) in [
            ([1.0, 2.0, 3.0], [0.1, 0.2, 0.9], 1e-10),
            ([1.0, 2.0, 3.0], [0.9, 0.2, -0.1], 1e-10),
            ([3.0, 2.0, 1.0], [-0.3, 0.2, 0.4], 1e-10),
            ([2.0, 1.0, 2.5], [0.01, 0.02, -0.7], 1e-10),
            ([1.0, 2.0, 3.0], [0.01, 0.7, 0.02], 1e-8),
            ([1.0, 1000.0, 1000.0001], [0.1, 0.001, 0.0005], 1e-10),
            ([1.0, 1.0001, 2.0], [0.3, 0.2, 0.1], 1e-10),
            ([1.0, 1.0, 2.0], [0.3, -0.2, -0.1], 1e-10),
            ([1.0, 2.0, 2.0], [0.3, 0.2, 0.1], 1e-10),
            ([2.0, 2.0, 2.0], [0.3, 0.2, 0.1], 1e-10),
            ([1.0, 2.0, 3.0], [0.0, 0.0, 0.5], 1e-12),
            ([1.0, 2.0, 2.0], [0.0, 0.4, 0.3], 1e-10),
        ] {
            let exact = body(inertia, rate);
            let (q, w) =
                integrated_reference(DVec3::from_array(inertia), START, DVec3::from_array(rate), 0.02, 5000);
            let (off, off_rate) = (exact.attitude(100.0).angle_to(&q), (exact.rate(100.0) - w).length());
            assert!(off < allowed && off_rate < allowed, "{inertia:?} {rate:?}: {off:e} rad, {off_rate:e} rad/s");
            assert!(
                exact.attitude(0.0).angle_to(&START) < 1e-14
                    && (exact.rate(0.0) - DVec3::from_array(rate)).length() < 1e-14
            );
        }
    }

    /// Energy and momentum over 1e5 revolutions, for both ways; the bodies and speeds named extreme.
    #[test]
    fn nothing_drifts_in_a_hundred_thousand_revolutions() {
        for inertia in [[1.0, 1000.0, 1000.0001], [1.0, 1.0001, 2.0]] {
            for rpm in [1.0f64, 60.0] {
                let spin = rpm * 2.0 * PI / 60.0;
                for rate in [DVec3::new(0.6, 0.7, 0.2), DVec3::new(0.02, 0.05, 1.0), DVec3::new(1.0, 1e-4, 1e-4)] {
                    let (inertia, rate) = (DVec3::from_array(inertia), rate.normalize() * spin);
                    let body = Tumble::new(inertia, START, rate).expect("a body");
                    let (energy, momentum) = (rate.dot(inertia * rate), inertia * rate);
                    for k in 0..=200 {
                        let t = f64::from(k) * 500.0 * 2.0 * PI / spin + 0.37 * f64::from(k);
                        let (w, q) = (body.rate(t), body.attitude(t));
                        let drift = (w.dot(inertia * w) / energy - 1.0).abs();
                        let turned = (q.to_inertial(inertia * w) - momentum).length() / momentum.length();
                        assert!(drift < 1e-10 && turned < 1e-10, "{inertia} {rpm} {k}: {drift:e} {turned:e}");
                    }
                }
            }
        }
    }

    #[test]
    fn the_integrator_conserves_too() {
        let (inertia, rate) = (DVec3::new(1.0, 1.0001, 2.0), DVec3::new(0.6, 0.7, 0.2));
        let (q, w) = integrated_reference(inertia, START, rate, 0.05, 200_000);
        let drift = (w.dot(inertia * w) / rate.dot(inertia * rate) - 1.0).abs();
        let turned = (q.to_inertial(inertia * w) - inertia * rate).length();
        assert!(drift < 1e-10 && turned < 1e-10, "{drift:e} {turned:e}");
    }

    #[test]
    fn moments_that_no_body_has_are_refused() {
        for inertia in [[1.0, 1.0, 2.5], [0.0, 1.0, 1.0], [-1.0, 2.0, 3.0], [f64::NAN, 1.0, 1.0]] {
            let error = Tumble::new(DVec3::from_array(inertia), START, DVec3::X).expect_err("refused").to_string();
            assert!(error.contains("sum of the other two"), "{error}");
        }
        assert!(Tumble::new(DVec3::ONE, START, DVec3::NAN).is_err());
        assert!(checked_inertia(DVec3::new(1.0, 1000.0, 1000.0001)).is_ok());
        assert!(checked_inertia(DVec3::new(1.0, 1.0, 2.0)).is_ok());
    }

    #[test]
    fn a_body_at_rest_stays() {
        let body = body([1.0, 2.0, 3.0], [0.0, 0.0, 0.0]);
        assert_eq!((body.rate(1e6), body.attitude(1e6)), (DVec3::ZERO, START));
    }
}
