//! The Earth's orientation in space: GCRS to ITRF, and TEME of SGP4 to ITRF.
//!
//! GCRS to ITRF: IAU 2006/2000A with the observed pole offsets, Earth rotation angle and polar motion (IERS
//! Conventions 2010, chapter 5), evaluated by SOFA's algorithms (crate `sofars`). The pole's X, Y and the origin's s
//! are interpolated ([`super::daily`]).
//! TEME to ITRF: rotation by Greenwich mean sidereal time of 1982 and polar motion (Vallado, Crawford, Hujsak
//! & Kelso 2006, AIAA 2006-6753, appendix C).

use super::daily::{self, Days, NODES, Series};
use super::eop::{DayOfEop, Eop};
use super::{Error, matrix, time::Instant};
use glam::{DMat3, DVec3};

/// Nutation series by name: what [`Orientation::with`] can take the pole from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Nutation {
    /// IAU 2006/2000A in full: 1365 terms, 0.0003 arcsec of what nature does unforeseen.
    Iau2006A,
    /// IAU 2000B: 77 terms, within 1 mas of 2000A in 1995-2050.
    Iau2000B,
}

/// The Earth's orientation at one instant.
#[derive(Debug, Clone, Copy)]
pub struct Orientation {
    /// GCRS components to ITRF components.
    pub gcrs_to_itrf: DMat3,
    /// TEME components to GCRS components.
    pub teme_to_gcrs: DMat3,
    /// The orientation parameters used.
    pub eop: Eop,
}

/// One day of the pole and of the orientation parameters.
struct Day {
    pole: Series,
    eop: DayOfEop,
}

static DAYS: Days<Day> = Days::new();

impl Orientation {
    /// The orientation at `t`, the pole interpolated: within 0.001 mas of [`Self::reference`].
    ///
    /// # Errors
    /// [`Error::EpochOutsideTable`] where no orientation parameters are known.
    pub fn at(t: &Instant) -> Result<Self, Error> {
        let number = daily::number(t);
        let day = DAYS.get(number, || {
            Ok::<_, Error>(Day {
                eop: DayOfEop::of(t)?,
                pole: Series::fit(number, NODES, |t| pole(t, Nutation::Iau2006A)),
            })
        })?;
        Ok(Self::with(t, &day.eop.at(t), day.pole.at(t)))
    }

    /// The orientation at `t` without interpolation: the twin of [`Self::at`].
    ///
    /// # Errors
    /// [`Error::EpochOutsideTable`] where no orientation parameters are known.
    pub fn reference(t: &Instant) -> Result<Self, Error> {
        Ok(Self::with(t, &super::eop::at(t)?, pole(t, Nutation::Iau2006A)))
    }

    /// The orientation at `t` from given parameters and the model's pole X, Y and origin s \[rad\].
    pub fn with(t: &Instant, eop: &Eop, pole: DVec3) -> Self {
        let (tt1, tt2) = t.tt();
        let (ut1, ut2) = t.ut1(eop.ut1_minus_tai);
        let celestial = sofars::pnp::c2ixys(pole.x + eop.dx, pole.y + eop.dy, pole.z);
        let polar = sofars::pnp::pom00(eop.xp, eop.yp, sofars::pnp::sp00(tt1, tt2));
        let gcrs_to_itrf = matrix(sofars::pnp::c2tcio(&celestial, sofars::erst::era00(ut1, ut2), &polar));
        // TEME knows nothing of s'
        let polar_teme = matrix(sofars::pnp::pom00(eop.xp, eop.yp, 0.0));
        let teme_to_itrf = polar_teme * DMat3::from_rotation_z(-sofars::erst::gmst82(ut1, ut2));
        Self { gcrs_to_itrf, teme_to_gcrs: gcrs_to_itrf.transpose() * teme_to_itrf, eop: *eop }
    }
}

/// X, Y of the celestial pole and s of its origin at `t` \[rad\].
pub fn pole(t: &Instant, nutation: Nutation) -> DVec3 {
    let (tt1, tt2) = t.tt();
    let (x, y, s) = match nutation {
        Nutation::Iau2006A => sofars::pnp::xys06a(tt1, tt2),
        Nutation::Iau2000B => sofars::pnp::xys00b(tt1, tt2),
    };
    DVec3::new(x, y, s)
}

/// Greenwich mean sidereal time \[rad\] in \[0, 2 pi) at `t`, IAU 2006.
///
/// # Errors
/// [`Error::EpochOutsideTable`] where UT1 is unknown.
pub fn gmst(t: &Instant) -> Result<f64, Error> {
    let (tt1, tt2) = t.tt();
    let (ut1, ut2) = t.ut1(super::eop::at(t)?.ut1_minus_tai);
    Ok(sofars::erst::gmst06(ut1, ut2, tt1, tt2))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::units::ARCSEC;

    fn orientation() -> Orientation {
        Orientation::at(&Instant::from_utc("2018-01-20T03:00:00").expect("a date")).expect("inside the table")
    }

    #[test]
    fn rotations_are_orthogonal() {
        for m in [orientation().gcrs_to_itrf, orientation().teme_to_gcrs] {
            assert!((m * m.transpose() - DMat3::IDENTITY).to_cols_array().iter().all(|x| x.abs() < 1e-15));
            assert!((m.determinant() - 1.0).abs() < 1e-15);
        }
    }

    /// TEME and GCRS differ by precession and nutation since 2000: about 18 years of 50.3" a year.
    #[test]
    fn teme_is_turned_by_precession() {
        let equinox = orientation().teme_to_gcrs * DVec3::X;
        let turned = super::super::separation(equinox, DVec3::X).to_degrees() * 3600.0;
        assert!((turned - 18.05 * 50.3).abs() < 25.0, "{turned}");
    }

    /// The interpolated orientation against the direct one, over a century and through a day.
    #[test]
    fn interpolation_is_within_a_microarcsecond() {
        let start = Instant::from_utc("1975-03-01T00:00:00").expect("a date");
        for k in 0..400 {
            let t = start.plus(f64::from(k) * 3.1e6 + 1234.5);
            let (fast, slow) = (Orientation::at(&t).expect("known"), Orientation::reference(&t).expect("known"));
            let off =
                (fast.gcrs_to_itrf - slow.gcrs_to_itrf).to_cols_array().iter().fold(0.0f64, |m, x| m.max(x.abs()));
            assert!(off < 1e-6 * ARCSEC, "{}: {:e} arcsec", t.iso_utc(), off / ARCSEC);
        }
    }
}
