//! From measurements to a light curve: zero points borrowed in time, and the table.

use super::budget::Budget;
use super::zeropoint::MAG_PER_SHARE;
use super::{Measurement, flag};
use crate::astro::angles;
use crate::astro::time::Instant;
use crate::base::table::{Table, Values};

/// Ranges to which `mag_v_norm` is reduced \[km\]: of low orbits and of all others.
pub const NORM_RANGES_KM: [f64; 2] = [1_000.0, 36_000.0];
/// Nearer than this an orbit counts as low \[km\].
const LOW_ORBIT_KM: f64 = 5_000.0;

/// Geometry of an exposure, known from a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Geometry {
    /// Name of the target.
    pub target: String,
    /// Airmass.
    pub airmass: f64,
    /// Angle Sun, target, observer \[deg\].
    pub phase_deg: f64,
    /// Light-time range \[km\].
    pub range_km: f64,
    /// Unit vector from the target to the Sun, ICRS.
    pub sun: [f64; 3],
    /// Unit vector from the target to the observer, ICRS.
    pub obs: [f64; 3],
}

impl Geometry {
    /// Nothing known.
    fn none() -> Self {
        let nan = f64::NAN;
        let nowhere = [nan; 3];
        Self { target: String::new(), airmass: nan, phase_deg: nan, range_km: nan, sun: nowhere, obs: nowhere }
    }
}

/// Give measurements without a zero point that of their neighbours in time.
///
/// What is borrowed is the zero point of one second, zp - 2.5 log10(exptime), linear in time between the
/// nearest measured ones before and after, constant beyond the first and last. It is not corrected for airmass:
/// the frames of one pass change their airmass slowly, and a coefficient would have to be assumed. Its error is
/// the larger of the neighbours' and half their difference, added in quadrature. Without any neighbour the
/// magnitude stays NaN.
pub fn borrow_zero_points(measurements: &mut [Measurement]) {
    let per_second = |m: &Measurement| m.zeropoint_mag - 2.5 * m.exptime_s.log10();
    let known = measurements.iter().filter(|m| m.zeropoint_mag.is_finite() && m.exptime_s > 0.0);
    let known = known.filter(|m| m.flags & flag::BORROWED_ZERO_POINT == 0);
    let mut known = known.map(|m| (m.time, per_second(m), m.zeropoint_err)).collect::<Vec<_>>();
    known.sort_by(|a, b| a.0.since(&b.0).total_cmp(&0.0));
    let at = |t: &Instant| {
        let after = known.iter().find(|k| k.0.since(t) >= 0.0);
        let before = known.iter().rev().find(|k| k.0.since(t) < 0.0);
        match (before, after) {
            (Some(a), Some(b)) => {
                let part = t.since(&a.0) / b.0.since(&a.0);
                Some((a.1 + (b.1 - a.1) * part, a.2.max(b.2).hypot(0.5 * (b.1 - a.1))))
            }
            (Some(one), None) | (None, Some(one)) => Some((one.1, one.2)),
            (None, None) => None,
        }
    };
    for m in measurements.iter_mut().filter(|m| !m.zeropoint_mag.is_finite()) {
        m.flags |= flag::BORROWED_ZERO_POINT;
        if let Some((mag, err)) = at(&m.time).filter(|_| m.exptime_s > 0.0) {
            m.zeropoint_mag = mag + 2.5 * m.exptime_s.log10();
            m.zeropoint_err = err;
            m.set_magnitude();
        }
    }
}

/// Where a light curve comes from, as its metadata tell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin {
    /// Computed.
    Model,
    /// Measured from frames.
    Measured,
}

/// The light curve as the table `lightcurve.ecsv`; geometry columns are NaN without `geometry`, whose rows
/// go with the measurements'.
pub fn table(origin: Origin, measurements: &[Measurement], geometry: Option<&[Geometry]>) -> Table {
    let n = measurements.len();
    let mut places = (0..n).map(|i| geometry.and_then(|g| g.get(i)).cloned().unwrap_or_else(Geometry::none));
    let places = places.by_ref().collect::<Vec<_>>();
    let rows = || measurements.iter().zip(&places);
    let mut table = Table::default();
    table.note("origin", if origin == Origin::Model { "model" } else { "measured" });
    let nearest = places.iter().map(|g| g.range_km).fold(f64::INFINITY, f64::min);
    let norm_range_km = NORM_RANGES_KM[usize::from(nearest >= LOW_ORBIT_KM)];
    table.note("norm_range_km", norm_range_km);
    table.column("frame", "", Values::Int(measurements.iter().enumerate().map(|(i, m)| m.frame_or(i)).collect()));
    table.texts("time_utc", measurements.iter().map(|m| m.time.iso_utc()));
    {
        let mut floats =
            |name, unit, f: &dyn Fn(&Measurement) -> f64| table.floats(name, unit, measurements.iter().map(f));
        floats("mjd_utc", "d", &|m| m.time.mjd_utc());
        floats("exptime_s", "s", &|m| m.exptime_s);
    }
    let name =
        |m: &Measurement, g: &Geometry| if g.target.is_empty() { m.object.clone() } else { g.target.clone() };
    table.texts("target", rows().map(|(m, g)| name(m, g)));
    let mut floats = |name, unit, f: &dyn Fn(&Measurement, &Geometry) -> f64| {
        table.floats(name, unit, rows().map(|(m, g)| f(m, g)));
    };
    floats("x_px", "pix", &|m, _| m.x_px);
    floats("y_px", "pix", &|m, _| m.y_px);
    floats("ra_deg", "deg", &|m, _| m.ra_deg);
    floats("dec_deg", "deg", &|m, _| m.dec_deg);
    floats("flux_e", "electron", &|m, _| m.flux_e);
    floats("flux_err_e", "electron", &|m, _| m.flux_err_e);
    floats("mag_v", "mag", &|m, _| m.mag_v);
    floats("mag_err", "mag", &|m, _| m.mag_err);
    floats("mag_v_norm", "mag", &|m, g| m.mag_v - 5.0 * (g.range_km / norm_range_km).log10());
    floats("zeropoint_mag", "mag", &|m, _| m.zeropoint_mag);
    floats("background_e_px", "electron / pix", &|m, _| m.background_e_px);
    floats("airmass", "", &|m, g| if g.airmass.is_finite() { g.airmass } else { m.airmass });
    floats("phase_deg", "deg", &|_, g| g.phase_deg);
    floats("range_km", "km", &|_, g| g.range_km);
    for (axis, name) in ["sun_x", "sun_y", "sun_z"].into_iter().enumerate() {
        floats(name, "", &|_, g| g.sun[axis]);
    }
    for (axis, name) in ["obs_x", "obs_y", "obs_z"].into_iter().enumerate() {
        floats(name, "", &|_, g| g.obs[axis]);
    }
    table.ints("flags", measurements.iter().map(|m| i64::from(m.flags)));
    table
}

/// Adds to a light curve what its errors are made of: those of the flux by cause, of the place, the zero point and
/// scintillation, and what the measurement was made with.
pub fn add_errors(table: &mut Table, measurements: &[Measurement]) {
    let mut floats = |name, unit, f: &dyn Fn(&Measurement) -> f64| {
        table.floats(name, unit, measurements.iter().map(f));
    };
    floats("x_err_px", "pix", &|m| m.place_err_px.x);
    floats("y_err_px", "pix", &|m| m.place_err_px.y);
    for (k, (column, _)) in Budget::default().parts().into_iter().enumerate() {
        floats(column, "electron", &|m| m.budget.parts()[k].1);
    }
    floats("err_zeropoint_mag", "mag", &|m| m.zeropoint_err);
    floats("err_scintillation_mag", "mag", &|m| MAG_PER_SHARE * m.scintillation);
    floats("place_bias_e", "electron", &|m| m.place_bias_e);
    floats("chi2_reduced", "", &|m| m.chi2);
    floats("fwhm_px", "pix", &|m| m.fwhm_px);
    floats("aperture_px", "pix", &|m| m.aperture_px);
    table.ints("zeropoint_stars", measurements.iter().map(|m| i64::try_from(m.n_stars).unwrap_or(i64::MAX)));
}

/// Right ascension and declination of a direction \[deg\].
pub(super) fn degrees(direction: glam::DVec3) -> (f64, f64) {
    let (ra, dec) = angles(direction);
    (ra.to_degrees(), dec.to_degrees())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::photometry::synthetic;

    fn measured(seconds: f64, zeropoint_mag: f64) -> Measurement {
        let mut m = Measurement::unmeasured(&synthetic::blank(4, 4, 0.0));
        m.time = m.time.plus(seconds);
        (m.zeropoint_mag, m.zeropoint_err) = (zeropoint_mag, 0.01);
        (m.flux_e, m.flux_err_e) = (1000.0, 10.0);
        m.set_magnitude();
        m
    }

    #[test]
    fn zero_points_are_interpolated_in_time_per_second_of_exposure() {
        let mut all =
            [measured(0.0, 20.0), measured(30.0, f64::NAN), measured(40.0, 20.4), measured(90.0, f64::NAN)];
        all[1].exptime_s *= 10.0;
        borrow_zero_points(&mut all);
        assert!((all[1].zeropoint_mag - 22.8).abs() < 1e-12, "{}", all[1].zeropoint_mag);
        assert!((all[1].mag_v - (22.8 - 7.5)).abs() < 1e-12);
        assert_eq!(all.map(|m| m.flags & flag::BORROWED_ZERO_POINT), [0, 64, 0, 64]);
        let mut lonely = [measured(0.0, f64::NAN)];
        borrow_zero_points(&mut lonely);
        assert!(lonely[0].mag_v.is_nan() && lonely[0].flags & 64 == 64);
    }

    #[test]
    fn the_columns_are_those_of_the_contract() {
        let text = crate::io::ecsv::to_ecsv(&table(Origin::Measured, &[measured(0.0, 20.0)], None));
        let names = "frame time_utc mjd_utc exptime_s target x_px y_px ra_deg dec_deg flux_e flux_err_e mag_v mag_err \
                     mag_v_norm zeropoint_mag background_e_px airmass phase_deg range_km sun_x sun_y sun_z \
                     obs_x obs_y obs_z flags";
        assert!(text.contains(&format!("\n{names}\n")), "{text}");
        assert!(text.contains("origin: \"measured\"") && text.contains("norm_range_km"));
        assert_eq!(table(Origin::Measured, &[], None).rows(), 0);
    }
}
