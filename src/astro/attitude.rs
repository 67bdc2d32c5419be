//! How an object is turned, as a function of time and of what is around it.
//!
//! Body axes to ICRS, in the convention of [`super::rotation`]. `nadir`: +z to the Earth's centre, +x as near to the
//! velocity as that allows. `sun`: +z to the Sun, +x as near to the velocity. Any other pair of directions: `aligned`.

use super::Error;
use super::rotation::Quaternion;
use super::time::Instant;
use super::tumble::Tumble;
use glam::{DMat3, DQuat, DVec3};
use std::f64::consts::TAU;

/// Unit vectors from an object to what it may point at, ICRS.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surroundings {
    /// To the Earth's centre.
    pub earth: DVec3,
    /// To the Sun.
    pub sun: DVec3,
    /// Along the velocity about the Earth.
    pub velocity: DVec3,
    /// To the observer.
    pub observer: DVec3,
}

/// Something to point at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Towards {
    /// The Earth's centre.
    Earth,
    /// The Sun.
    Sun,
    /// Along the velocity.
    Velocity,
    /// The observer.
    Observer,
}

impl Towards {
    /// The unit vector to it.
    pub fn of(self, around: &Surroundings) -> DVec3 {
        match self {
            Self::Earth => around.earth,
            Self::Sun => around.sun,
            Self::Velocity => around.velocity,
            Self::Observer => around.observer,
        }
    }

    /// Its word in a scene.
    pub fn name(self) -> &'static str {
        match self {
            Self::Earth => "earth",
            Self::Sun => "sun",
            Self::Velocity => "velocity",
            Self::Observer => "observer",
        }
    }
}

/// A motion of attitude.
#[derive(Debug, Clone)]
pub enum Profile {
    /// Fixed among the stars.
    Inertial(Quaternion),
    /// Turning uniformly about an axis fixed among the stars.
    Spin {
        /// Attitude at the epoch, before `phase`.
        start: Quaternion,
        /// Axis, ICRS, right-handed, unit.
        axis: DVec3,
        /// Time of one turn \[s\].
        period_s: f64,
        /// Turn already made at the epoch \[rad\].
        phase: f64,
        /// The epoch.
        epoch: Instant,
    },
    /// One body axis to a direction, another as near to a second direction as that allows.
    Aligned {
        /// Body axis that points exactly, unit.
        point_body: DVec3,
        /// Where to.
        point_to: Towards,
        /// Body axis that follows, unit.
        turn_body: DVec3,
        /// Where to.
        turn_to: Towards,
    },
    /// A rigid body without torque.
    Tumble {
        /// The motion.
        tumble: Box<Tumble>,
        /// Its time 0.
        epoch: Instant,
    },
    /// Quaternions at times, with the shortest turns between them.
    Table(Vec<(Instant, Quaternion)>),
}

impl Profile {
    /// +z to the Earth's centre, +x forwards.
    pub const NADIR: Self = Self::Aligned {
        point_body: DVec3::Z,
        point_to: Towards::Earth,
        turn_body: DVec3::X,
        turn_to: Towards::Velocity,
    };

    /// +z to the Sun, +x forwards.
    pub const SUN: Self = Self::Aligned {
        point_body: DVec3::Z,
        point_to: Towards::Sun,
        turn_body: DVec3::X,
        turn_to: Towards::Velocity,
    };

    /// The attitude at `t`.
    ///
    /// # Errors
    /// [`Error::Attitude`] where directions to point at fall together or are not known, and outside a table.
    pub fn at(&self, t: &Instant, around: &Surroundings) -> Result<Quaternion, Error> {
        match self {
            Self::Inertial(q) => Ok(*q),
            Self::Spin { start, axis, period_s, phase, epoch } => {
                let turns = (t.since(epoch) / period_s).rem_euclid(1.0);
                let turn = DQuat::from_axis_angle(*axis, TAU * turns + phase);
                Ok(Quaternion((turn * start.0).normalize()))
            }
            Self::Aligned { point_body, point_to, turn_body, turn_to } => {
                let (first, second) = (point_to.of(around), turn_to.of(around));
                let inertial = triad(first, second).ok_or_else(|| Error::Attitude {
                    reason: format!(
                        "at {} UTC the directions to {} and {} are unknown or one: they must differ by 1e-9 rad",
                        t.iso_utc(),
                        point_to.name(),
                        turn_to.name()
                    ),
                })?;
                let body = triad(*point_body, *turn_body).ok_or_else(|| Error::Attitude {
                    reason: format!("body axes {point_body} and {turn_body} must not be parallel"),
                })?;
                Ok(Quaternion(DQuat::from_mat3(&(inertial * body.transpose())).normalize()))
            }
            Self::Tumble { tumble, epoch } => Ok(tumble.attitude(t.since(epoch))),
            Self::Table(rows) => interpolated(rows, t),
        }
    }

    /// Time after which the attitude is the same again \[s\], if there is one whatever is around.
    pub fn period_s(&self) -> Option<f64> {
        match self {
            Self::Spin { period_s, .. } => Some(*period_s),
            _ => None,
        }
    }

    /// Fastest turn \[rad/s\] against what is around: an upper bound, but for [`Profile::Aligned`], which turns with the
    /// directions that it follows.
    pub fn fastest(&self) -> f64 {
        match self {
            Self::Inertial(_) | Self::Aligned { .. } => 0.0,
            Self::Spin { period_s, .. } => TAU / period_s,
            Self::Tumble { tumble, .. } => tumble.fastest(),
            Self::Table(rows) => {
                let rate = |pair: &[(Instant, Quaternion)]| {
                    let cosine = pair[0].1.0.dot(pair[1].1.0).abs().min(1.0);
                    2.0 * cosine.acos() / pair[1].0.since(&pair[0].0)
                };
                rows.windows(2).map(rate).fold(0.0, f64::max)
            }
        }
    }

    /// The table of a CSV with the columns time_utc, q0, q1, q2, q3; lines that begin with # are passed over.
    ///
    /// # Errors
    /// [`Error::Attitude`] with the line that cannot be read.
    pub fn table(text: &str) -> Result<Self, Error> {
        let fault = |reason: String| Error::Attitude { reason };
        let mut rows: Vec<(Instant, Quaternion)> = Vec::new();
        let mut header = true;
        for (number, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
            let line = line.trim();
            if line.is_empty() || line.starts_with('#') {
                continue;
            }
            let cells = line.split(',').map(str::trim).collect::<Vec<_>>();
            if header {
                header = false;
                if cells != ["time_utc", "q0", "q1", "q2", "q3"] {
                    return Err(fault(format!("line {}: the header must be time_utc,q0,q1,q2,q3", number + 1)));
                }
                continue;
            }
            let [time, numbers @ ..] = cells.as_slice() else { continue };
            let time = Instant::from_utc(time).map_err(|why| fault(format!("line {}: {why}", number + 1)))?;
            let read = numbers.iter().map(|n| n.parse::<f64>().ok()).collect::<Option<Vec<_>>>();
            let q = read.and_then(|q| <[f64; 4]>::try_from(q).ok()).and_then(Quaternion::new);
            let q =
                q.ok_or_else(|| fault(format!("line {}: it must have four numbers, not all 0", number + 1)))?;
            if rows.last().is_some_and(|(before, _)| *before >= time) {
                return Err(fault(format!("line {}: times must ascend", number + 1)));
            }
            rows.push((time, q));
        }
        if rows.is_empty() { Err(fault("the table holds no attitude".into())) } else { Ok(Self::Table(rows)) }
    }
}

/// Columns: the first direction, the second made perpendicular to it, their cross product; none if they fall together.
fn triad(first: DVec3, second: DVec3) -> Option<DMat3> {
    let across = first.cross(second);
    let size = across.length();
    let apart = size / (first.length() * second.length());
    if apart.is_nan() || apart <= 1e-9 {
        return None;
    }
    let (x, z) = (first.normalize(), across / size);
    Some(DMat3::from_cols(x, z.cross(x), z))
}

fn interpolated(rows: &[(Instant, Quaternion)], t: &Instant) -> Result<Quaternion, Error> {
    let after = rows.partition_point(|(time, _)| time <= t);
    let outside = || {
        let at = |row: Option<&(Instant, Quaternion)>| row.map_or_else(String::new, |r| r.0.iso_utc());
        Error::Attitude {
            reason: format!(
                "the table holds from {} to {} UTC, {} lies outside",
                at(rows.first()),
                at(rows.last()),
                t.iso_utc()
            ),
        }
    };
    let before = after.checked_sub(1).and_then(|at| rows.get(at)).ok_or_else(outside)?;
    match rows.get(after) {
        Some(next) => {
            let share = t.since(&before.0) / next.0.since(&before.0);
            // glam takes the shorter of the two ways
            Ok(Quaternion(before.1.0.slerp(next.1.0, share).normalize()))
        }
        None if before.0 == *t => Ok(before.1),
        None => Err(outside()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn t(seconds: f64) -> Instant {
        Instant::from_utc("2018-01-20T03:00:00").expect("a date").plus(seconds)
    }

    fn around() -> Surroundings {
        Surroundings {
            earth: DVec3::NEG_X,
            sun: DVec3::new(0.0, 0.6, 0.8),
            velocity: DVec3::new(0.1, 1.0, 0.0).normalize(),
            observer: DVec3::new(-1.0, 0.1, 0.0).normalize(),
        }
    }

    #[test]
    fn a_spin_comes_round_and_goes_right_handed() {
        let spin = Profile::Spin {
            start: Quaternion(DQuat::IDENTITY),
            axis: DVec3::Z,
            period_s: 40.0,
            phase: 0.0,
            epoch: t(0.0),
        };
        let x = |s: f64| spin.at(&t(s), &around()).expect("an attitude").to_inertial(DVec3::X);
        assert!((x(10.0) - DVec3::Y).length() < 1e-14 && (x(-10.0) + DVec3::Y).length() < 1e-14);
        assert!((x(40.0 * 1e7 + 10.0) - DVec3::Y).length() < 1e-7);
    }

    #[test]
    fn aligned_axes_point_where_they_should() {
        let q = Profile::NADIR.at(&t(0.0), &around()).expect("an attitude");
        assert!((q.to_inertial(DVec3::Z) - DVec3::NEG_X).length() < 1e-15);
        assert!((q.to_inertial(DVec3::X) - DVec3::Y).length() < 1e-15);
        let q = Profile::SUN.at(&t(0.0), &around()).expect("an attitude");
        assert!((q.to_inertial(DVec3::Z) - around().sun).length() < 1e-15);
        let own = Profile::Aligned {
            point_body: DVec3::new(1.0, 1.0, 0.0).normalize(),
            point_to: Towards::Observer,
            turn_body: DVec3::Z,
            turn_to: Towards::Sun,
        };
        let q = own.at(&t(0.0), &around()).expect("an attitude");
        assert!((q.to_inertial(DVec3::new(1.0, 1.0, 0.0).normalize()) - around().observer).length() < 1e-15);
        // the second axis lies in the plane of both directions, on the Sun's side
        let z = q.to_inertial(DVec3::Z);
        assert!(z.dot(around().sun) > 0.0 && z.dot(around().observer.cross(around().sun)).abs() < 1e-15);
        let blind = Surroundings { velocity: DVec3::NAN, ..around() };
        assert!(Profile::NADIR.at(&t(0.0), &blind).is_err());
        let same = Surroundings { velocity: DVec3::NEG_X, ..around() };
        let error = Profile::NADIR.at(&t(0.0), &same).expect_err("one direction").to_string();
        assert!(error.contains("earth and velocity"), "{error}");
    }

    #[test]
    fn a_table_turns_uniformly_between_its_rows() {
        let text = "# made by hand\ntime_utc,q0,q1,q2,q3\n2018-01-20T03:00:00,1,0,0,0\n\
                    2018-01-20T03:01:40,-0.7071067811865476,0,0,-0.7071067811865476\n";
        let table = Profile::table(text).expect("a table");
        let x = table.at(&t(50.0), &around()).expect("inside").to_inertial(DVec3::X);
        let eighth = std::f64::consts::FRAC_PI_4;
        assert!((x - DVec3::new(eighth.cos(), eighth.sin(), 0.0)).length() < 1e-14, "{x}");
        assert!(table.at(&t(100.0), &around()).is_ok());
        for (s, text) in [(-1.0, "02:59:59"), (101.0, "03:01:41")] {
            assert!(table.at(&t(s), &around()).expect_err("outside").to_string().contains(text));
        }
        for (bad, what) in [
            ("", "no attitude"),
            ("time,q0\n", "header"),
            ("time_utc,q0,q1,q2,q3\n2018-01-20T03:00:00,0,0,0,0\n", "line 2"),
            ("time_utc,q0,q1,q2,q3\n2018-01-20T03:00:00,1,0,0\n", "four numbers"),
            ("time_utc,q0,q1,q2,q3\nnever,1,0,0,0\n", "line 2"),
        ] {
            assert!(Profile::table(bad).expect_err(bad).to_string().contains(what), "{bad}");
        }
    }
}
