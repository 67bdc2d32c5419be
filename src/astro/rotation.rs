//! Representations of an attitude and every conversion between them.
//!
//! One convention: an attitude turns the inertial axes (ICRS) into the body's. The quaternion (scalar first) takes body
//! components of a vector to inertial ones, v_N = q v_B q*; the direction cosine matrix \[BN\] takes inertial to body
//! components, v_B = \[BN\] v_N; principal axis and angle turn N into B right-handed, so that
//! \[BN\] = I - sin(theta)[l x] + (1 - cos(theta))[l x]^2; the rotation vector is theta l, the modified Rodrigues
//! parameters l tan(theta/4); Euler angles turn N into B about axes i, then j, then k of the moving frame,
//! \[BN\] = R_k R_j R_i (Schaub & Junkins 2018, chapter 3).
//!
//! Conversions go through the quaternion, which has no singular place: matrix by Shepperd 1978, angles by atan2, so that
//! nothing is lost at 0 and pi. Angles come out in 0..pi, parameters with |sigma| <= 1.

use glam::{DMat3, DQuat, DVec3};
use std::f64::consts::FRAC_PI_2;

/// Unit quaternion q0 + q1 i + q2 j + q3 k: body to inertial components.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quaternion(pub DQuat);

/// Direction cosine matrix \[BN\]: inertial to body components.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dcm(pub DMat3);

/// Principal axis (unit, the same components in both frames) and angle \[rad\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prp {
    /// Axis.
    pub axis: DVec3,
    /// Angle \[rad\].
    pub angle: f64,
}

/// Rotation vector: angle times axis \[rad\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RotationVector(pub DVec3);

/// Modified Rodrigues parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mrp(pub DVec3);

/// Axes of three successive turns, 0 = x; neighbours differ.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sequence([usize; 3]);

/// Euler angles \[rad\] of a sequence.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Euler {
    /// The axes.
    pub sequence: Sequence,
    /// First, second and third angle \[rad\].
    pub angles: [f64; 3],
}

impl Sequence {
    /// The sequence of axes 1, 2, 3 as in "3-1-3"; none if neighbours are equal or a number is no axis.
    pub fn new(axes: [usize; 3]) -> Option<Self> {
        let [i, j, k] = axes;
        (axes.iter().all(|a| (1..=3).contains(a)) && i != j && j != k).then(|| Self([i - 1, j - 1, k - 1]))
    }

    /// All twelve.
    pub fn all() -> impl Iterator<Item = Self> {
        (0..27).filter_map(|n| Self::new([n / 9 + 1, n / 3 % 3 + 1, n % 3 + 1]))
    }
}

impl std::fmt::Display for Sequence {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [i, j, k] = self.0.map(|axis| axis + 1);
        write!(f, "{i}-{j}-{k}")
    }
}

fn axis(i: usize) -> DVec3 {
    DVec3::AXES[i.min(2)]
}

impl Quaternion {
    /// Body axes are the inertial ones.
    pub const IDENTITY: Self = Self(DQuat::IDENTITY);

    /// From scalar-first components of any length above 0; normalised.
    pub fn new([q0, q1, q2, q3]: [f64; 4]) -> Option<Self> {
        let q = DQuat::from_xyzw(q1, q2, q3, q0);
        let largest = [q0, q1, q2, q3].iter().fold(0.0f64, |m, x| m.max(x.abs()));
        (q.is_finite() && largest > 0.0).then(|| Self((q * (1.0 / largest)).normalize()))
    }

    /// Scalar-first components.
    pub fn components(&self) -> [f64; 4] {
        let q = self.0;
        [q.w, q.x, q.y, q.z]
    }

    /// Inertial components of a vector given in body components.
    pub fn to_inertial(&self, body: DVec3) -> DVec3 {
        self.0 * body
    }

    /// Body components of a vector given in inertial components.
    pub fn to_body(&self, inertial: DVec3) -> DVec3 {
        self.0.conjugate() * inertial
    }

    /// Euler angles of a sequence (Bernardes & Viollet 2022, PLoS ONE 17, e0276302); where the middle angle makes the outer
    /// two one, their sum or difference is right and their shares are free.
    pub fn euler(&self, sequence: Sequence) -> Euler {
        // the formulas are for turns about fixed axes: those of the moving frame are the same in reverse
        let [k, j, i] = sequence.0;
        let proper = i == k;
        let third = if proper { 3 - i - j } else { k };
        let even = (j + 3 - i) % 3 == 1;
        let sign = if even { 1.0 } else { -1.0 };
        let v = self.0.xyz();
        let (w, qi, qj, qk) = (self.0.w, v[i], v[j], v[third] * sign);
        let (a, b, c, d) = if proper { (w, qi, qj, qk) } else { (w - qj, qi + qk, qj + w, qk - qi) };
        let middle = 2.0 * c.hypot(d).atan2(a.hypot(b));
        let (sum, difference) = (b.atan2(a), d.atan2(c));
        let (last, first) = (sum - difference, sum + difference);
        let angles = if proper { [first, middle, last] } else { [sign * first, middle - FRAC_PI_2, last] };
        Euler { sequence, angles: angles.map(wrapped) }
    }

    /// Angle \[rad\] of the turn between two attitudes, 0..pi.
    pub fn angle_to(&self, other: &Self) -> f64 {
        Prp::from(Self(self.0.conjugate() * other.0)).angle
    }
}

/// An angle in (-pi, pi].
fn wrapped(angle: f64) -> f64 {
    let turn = std::f64::consts::TAU;
    let inside = angle.rem_euclid(turn);
    if inside > turn / 2.0 { inside - turn } else { inside }
}

impl From<Dcm> for Quaternion {
    fn from(Dcm(m): Dcm) -> Self {
        // Shepperd: divide by the largest of the four components; rows of [BN] are its columns transposed
        let c = |row: usize, col: usize| m.col(col)[row];
        let trace = c(0, 0) + c(1, 1) + c(2, 2);
        let four_squares =
            [1.0 + trace, 1.0 - trace + 2.0 * c(0, 0), 1.0 - trace + 2.0 * c(1, 1), 1.0 - trace + 2.0 * c(2, 2)];
        let largest = (1..4).fold(0, |best, i| if four_squares[i] > four_squares[best] { i } else { best });
        let [x, y, z] = [c(1, 2) - c(2, 1), c(2, 0) - c(0, 2), c(0, 1) - c(1, 0)];
        let [xy, yz, zx] = [c(0, 1) + c(1, 0), c(1, 2) + c(2, 1), c(2, 0) + c(0, 2)];
        let s = four_squares[largest];
        let [w, i, j, k] = match largest {
            0 => [s, x, y, z],
            1 => [x, s, xy, zx],
            2 => [y, xy, s, yz],
            _ => [z, zx, yz, s],
        };
        Self(DQuat::from_xyzw(i, j, k, w).normalize())
    }
}

impl From<Quaternion> for Dcm {
    fn from(Quaternion(q): Quaternion) -> Self {
        Self(DMat3::from_quat(q.conjugate()))
    }
}

impl From<Prp> for Quaternion {
    fn from(Prp { axis, angle }: Prp) -> Self {
        let (sin, cos) = (0.5 * angle).sin_cos();
        let v = axis * sin;
        Self(DQuat::from_xyzw(v.x, v.y, v.z, cos).normalize())
    }
}

impl From<Quaternion> for Prp {
    fn from(Quaternion(q): Quaternion) -> Self {
        // q and -q are one attitude: the one with q0 >= 0 has the angle in 0..pi
        let q = if q.w < 0.0 { -q } else { q };
        let v = q.xyz();
        let size = v.length();
        // no turn has no axis: any will do
        let axis = if size > 0.0 { v / size } else { DVec3::X };
        Self { axis, angle: 2.0 * size.atan2(q.w) }
    }
}

impl From<RotationVector> for Quaternion {
    fn from(RotationVector(p): RotationVector) -> Self {
        let angle = p.length();
        // sin(x/2)/x; below 1e-8 its series ends with 1/2
        let share = if angle < 1e-8 { 0.5 } else { (0.5 * angle).sin() / angle };
        let v = p * share;
        Self(DQuat::from_xyzw(v.x, v.y, v.z, (0.5 * angle).cos()).normalize())
    }
}

impl From<Quaternion> for RotationVector {
    fn from(q: Quaternion) -> Self {
        let Prp { axis, angle } = q.into();
        Self(axis * angle)
    }
}

impl From<Mrp> for Quaternion {
    fn from(Mrp(s): Mrp) -> Self {
        let s2 = s.length_squared();
        let v = s * (2.0 / (1.0 + s2));
        Self(DQuat::from_xyzw(v.x, v.y, v.z, (1.0 - s2) / (1.0 + s2)).normalize())
    }
}

impl From<Quaternion> for Mrp {
    fn from(Quaternion(q): Quaternion) -> Self {
        // of the two sets the one inside the unit sphere
        let q = if q.w < 0.0 { -q } else { q };
        Self(q.xyz() / (1.0 + q.w))
    }
}

impl From<Euler> for Quaternion {
    fn from(Euler { sequence: Sequence([i, j, k]), angles: [a, b, c] }: Euler) -> Self {
        let turn = |i: usize, angle: f64| DQuat::from_axis_angle(axis(i), angle);
        Self((turn(i, a) * turn(j, b) * turn(k, c)).normalize())
    }
}

/// Conversions by way of the quaternion.
macro_rules! by_quaternion {
    ($($from:ident => $($to:ident)+;)+) => {$($(
        impl From<$from> for $to {
            fn from(from: $from) -> Self {
                Quaternion::from(from).into()
            }
        }
    )+)+};
}

by_quaternion! {
    Dcm => Prp RotationVector Mrp;
    Prp => Dcm RotationVector Mrp;
    RotationVector => Dcm Prp Mrp;
    Mrp => Dcm Prp RotationVector;
    Euler => Dcm Prp RotationVector Mrp;
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// Cells of the table: there by one representation, on to another, and back; the largest turn between start and end.
    fn worst(q: Quaternion) -> f64 {
        let back = [
            Quaternion::from(Dcm::from(q)),
            Quaternion::from(Prp::from(q)),
            Quaternion::from(RotationVector::from(q)),
            Quaternion::from(Mrp::from(q)),
            Quaternion::from(Mrp::from(Dcm::from(q))),
            Quaternion::from(Prp::from(Dcm::from(RotationVector::from(q)))),
            Quaternion::from(RotationVector::from(Mrp::from(Prp::from(q)))),
            Quaternion::from(Dcm::from(Mrp::from(RotationVector::from(Dcm::from(q))))),
            Quaternion::from(RotationVector::from(Dcm::from(Prp::from(Mrp::from(q))))),
            Quaternion::from(Prp::from(RotationVector::from(Dcm::from(Mrp::from(q))))),
            Quaternion::from(Mrp::from(RotationVector::from(Prp::from(q)))),
        ];
        back.into_iter().map(|b| q.angle_to(&b)).fold(0.0, f64::max)
    }

    fn worst_euler(q: Quaternion) -> f64 {
        Sequence::all().map(|s| q.angle_to(&q.euler(s).into())).fold(0.0, f64::max)
    }

    /// A cheap sequence of numbers in 0..1 that fills four dimensions (Weyl).
    fn share(n: u32, k: u32) -> f64 {
        (f64::from(n) * [0.819_172_513_4, 0.671_043_606_7, 0.549_700_477_9, 0.450_301_5][k as usize]).fract()
    }

    #[test]
    fn a_million_rotations_survive_every_conversion() {
        let (mut off, mut off_euler) = (0.0f64, 0.0f64);
        for n in 1..=1_000_000 {
            let components = [0, 1, 2, 3].map(|k| 2.0 * share(n, k) - 1.0);
            let Some(q) = Quaternion::new(components) else { continue };
            off = off.max(worst(q));
            if n % 50 == 0 {
                off_euler = off_euler.max(worst_euler(q));
            }
        }
        assert!(off < 1e-14 && off_euler < 1e-14, "{off:e} {off_euler:e} rad");
    }

    #[test]
    fn no_turn_and_half_turns_survive_too() {
        let axes = [
            DVec3::X,
            DVec3::Y,
            DVec3::Z,
            DVec3::new(1.0, 1.0, 0.0),
            DVec3::new(-1.0, 2.0, 3.0),
            DVec3::new(1e-9, 1.0, -1e-9),
        ];
        let small = [0.0, 1e-300, 1e-200, 1e-16, 1e-12, 1e-8, 1e-4];
        for axis in axes.map(DVec3::normalize) {
            for off in small {
                for (angle, allowed) in
                    [(off, 1e-14), (PI - off, 1e-12), (PI + off, 1e-12), (2.0 * PI - off, 1e-14)]
                {
                    let q = Quaternion::from(Prp { axis, angle });
                    assert!(
                        worst(q) < allowed && worst_euler(q) < allowed,
                        "{axis} {angle} {:e} {:e}",
                        worst(q),
                        worst_euler(q)
                    );
                    // what is small stays small to its last digits
                    if angle < 1e-3 && angle > 1e-150 {
                        let back = RotationVector::from(Dcm::from(q)).0.length();
                        assert!((RotationVector::from(q).0.length() / angle - 1.0).abs() < 1e-14);
                        assert!((back - angle).abs() < 2e-16, "{angle:e} {back:e}");
                    }
                }
            }
        }
    }

    #[test]
    fn euler_angles_where_two_axes_fall_together() {
        for sequence in Sequence::all() {
            for middle in [0.0, FRAC_PI_2, -FRAC_PI_2, PI, 1e-9, FRAC_PI_2 - 1e-9, PI - 1e-12] {
                let q = Quaternion::from(Euler { sequence, angles: [0.7, middle, -1.9] });
                assert!(q.angle_to(&q.euler(sequence).into()) < 1e-14, "{sequence:?} {middle}");
            }
        }
        assert_eq!(Sequence::all().count(), 12);
        assert!(Sequence::new([1, 1, 2]).is_none() && Sequence::new([0, 1, 2]).is_none());
    }

    /// Hand-worked: the body turned 90 deg about z; its x axis points along inertial y.
    #[test]
    fn the_convention() {
        let q = Quaternion::from(Prp { axis: DVec3::Z, angle: FRAC_PI_2 });
        assert!((q.to_inertial(DVec3::X) - DVec3::Y).length() < 1e-15);
        let Dcm(bn) = q.into();
        assert!((bn * DVec3::Y - DVec3::X).length() < 1e-15);
        assert!((q.to_body(DVec3::Y) - DVec3::X).length() < 1e-15);
        // [BN] = I - sin [l x] + (1 - cos) [l x]^2: the draft's plus sign would turn the other way
        let (l, theta) = (DVec3::new(1.0, -2.0, 0.5).normalize(), 1.1f64);
        let cross =
            DMat3::from_cols(DVec3::new(0.0, l.z, -l.y), DVec3::new(-l.z, 0.0, l.x), DVec3::new(l.y, -l.x, 0.0));
        let written = DMat3::IDENTITY - cross * theta.sin() + cross * cross * (1.0 - theta.cos());
        let Dcm(own) = Prp { axis: l, angle: theta }.into();
        assert!((own - written).to_cols_array().iter().all(|x| x.abs() < 1e-15));
        // 3-2-1 angles of an aircraft: yaw, pitch, roll
        let e = Euler { sequence: Sequence::new([3, 2, 1]).expect("a sequence"), angles: [0.3, -0.2, 0.1] };
        let back = Quaternion::from(e).euler(e.sequence);
        assert!(back.angles.iter().zip(e.angles).all(|(x, y)| (x - y).abs() < 1e-15), "{back:?}");
    }

    #[test]
    fn quaternions_of_odd_lengths() {
        assert!(Quaternion::new([0.0; 4]).is_none() && Quaternion::new([f64::NAN, 0.0, 0.0, 1.0]).is_none());
        for scale in [1e-300, 1e-3, 1.0, 1e300] {
            let q = Quaternion::new([scale, 0.0, -scale, 0.0]).expect("a turn");
            assert!((q.0.length() - 1.0).abs() < 1e-15);
        }
    }
}
