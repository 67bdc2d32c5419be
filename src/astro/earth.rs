//! The Earth's orientation in space: GCRS to ITRF, and TEME of SGP4 to ITRF.
//!
//! GCRS to ITRF: IAU 2006/2000A with the observed pole offsets, Earth rotation angle and polar motion (IERS
//! Conventions 2010, chapter 5), evaluated by SOFA's algorithms (crate `sofars`).
//! TEME to ITRF: rotation by Greenwich mean sidereal time of 1982 and polar motion (Vallado, Crawford, Hujsak
//! & Kelso 2006, AIAA 2006-6753, appendix C).

use super::{Error, eop, matrix, time::Instant};
use glam::{DMat3, DVec3};

/// The Earth's orientation at one instant.
#[derive(Debug, Clone, Copy)]
pub struct Orientation {
    /// GCRS components to ITRF components.
    pub gcrs_to_itrf: DMat3,
    /// TEME components to GCRS components.
    pub teme_to_gcrs: DMat3,
}

impl Orientation {
    /// The orientation at `t`.
    ///
    /// # Errors
    /// [`Error::EpochOutsideTable`] where no orientation parameters are known.
    pub fn at(t: &Instant) -> Result<Self, Error> {
        let eop = eop::at(t)?;
        let (tt1, tt2) = t.tt();
        let (ut1, ut2) = t.ut1(eop.ut1_minus_tai);
        let (x, y, s) = sofars::pnp::xys06a(tt1, tt2);
        let celestial = sofars::pnp::c2ixys(x + eop.dx, y + eop.dy, s);
        let polar = sofars::pnp::pom00(eop.xp, eop.yp, sofars::pnp::sp00(tt1, tt2));
        let gcrs_to_itrf = matrix(sofars::pnp::c2tcio(&celestial, sofars::erst::era00(ut1, ut2), &polar));
        // TEME knows nothing of s'
        let polar_teme = matrix(sofars::pnp::pom00(eop.xp, eop.yp, 0.0));
        let teme_to_itrf = polar_teme * DMat3::from_rotation_z(-sofars::erst::gmst82(ut1, ut2));
        Ok(Self { gcrs_to_itrf, teme_to_gcrs: gcrs_to_itrf.transpose() * teme_to_itrf })
    }
}

/// ITRF position \[m\] of WGS 84 geodetic longitude, latitude \[rad\] and height \[m\].
pub fn itrf_from_geodetic(longitude: f64, latitude: f64, height_m: f64) -> DVec3 {
    // SOFA refuses only ellipsoids it does not know and places at the Earth's centre
    sofars::coords::gd2gc(1, longitude, latitude, height_m).map_or(DVec3::NAN, DVec3::from_array)
}

#[cfg(test)]
mod tests {
    use super::*;

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

    /// Hand-worked: the equator at 6378.137 km, the pole at 6356.752 km.
    #[test]
    fn equator_and_pole_are_where_wgs_84_puts_them() {
        assert!((itrf_from_geodetic(0.0, 0.0, 100.0) - DVec3::X * 6_378_237.0).length() < 1e-6);
        let pole = itrf_from_geodetic(1.0, std::f64::consts::FRAC_PI_2, 0.0);
        assert!((pole - DVec3::Z * 6_356_752.314_245).length() < 1e-5);
    }
}
