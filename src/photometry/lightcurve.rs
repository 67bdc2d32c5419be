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
/// What is borrowed is the zero point of one second, zp - 2.5 log10(exptime), outside the atmosphere as far as the series
/// itself tells the extinction (at least 6 of them over 0.15 airmasses): linear in time between the nearest measured ones before and after,
/// constant beyond the first and last. Its error is the larger of the neighbours' and half their difference, added in
/// quadrature, with that of the extinction over the difference in airmass. Without any neighbour the magnitude stays NaN.
pub fn borrow_zero_points(measurements: &mut [Measurement]) {
    let per_second = |m: &Measurement| m.zeropoint_mag - 2.5 * m.exptime_s.log10();
    let known = measurements.iter().filter(|m| m.zeropoint_mag.is_finite() && m.exptime_s > 0.0);
    let known = known.filter(|m| m.flags & flag::BORROWED_ZERO_POINT == 0);
    let known = known.map(|m| Lent { time: m.time, mag: per_second(m), err: m.zeropoint_err, airmass: m.airmass });
    let mut known = known.collect::<Vec<_>>();
    known.sort_by(|a, b| a.time.since(&b.time).total_cmp(&0.0));
    let extinction = Extinction::of(&known);
    for m in measurements.iter_mut().filter(|m| !m.zeropoint_mag.is_finite()) {
        m.flags |= flag::BORROWED_ZERO_POINT;
        let after = known.iter().find(|k| k.time.since(&m.time) >= 0.0);
        let before = known.iter().rev().find(|k| k.time.since(&m.time) < 0.0);
        let carried = |one: &Lent| extinction.carried(one, m.airmass);
        let (mag, err) = match (before.map(carried), after.map(carried)) {
            (Some(a), Some(b)) => {
                let part = m.time.since(&a.time) / b.time.since(&a.time);
                (a.mag + (b.mag - a.mag) * part, a.err.max(b.err).hypot(0.5 * (b.mag - a.mag)))
            }
            (Some(one), None) | (None, Some(one)) => (one.mag, one.err),
            (None, None) => continue,
        };
        if m.exptime_s > 0.0 {
            m.zeropoint_mag = mag + 2.5 * m.exptime_s.log10();
            m.zeropoint_err = err;
            m.set_magnitude();
        }
    }
}

/// A measured zero point of one second.
#[derive(Debug, Clone, Copy)]
struct Lent {
    time: Instant,
    mag: f64,
    err: f64,
    airmass: f64,
}

/// Extinction in the instrument's band \[mag/airmass\].
#[derive(Debug, Clone, Copy)]
struct Extinction {
    coefficient: f64,
    err: f64,
}

impl Extinction {
    /// Fewer zero points, or a smaller range of airmass, tell no extinction.
    const FEWEST: usize = 6;
    const LEAST_RANGE: f64 = 0.15;
    /// Extinction of a clear night that nothing tells: none is taken off, and this is the error.
    const UNKNOWN: f64 = 0.2;

    /// From zero points over a range of airmasses: zp = z - k X, by least squares with the scatter about the line as error;
    /// unknown where that is no surer, or where k is none of an atmosphere's (0 to 1.5).
    fn of(known: &[Lent]) -> Self {
        let unknown = Self { coefficient: 0.0, err: Self::UNKNOWN };
        let known = known.iter().filter(|k| k.airmass.is_finite() && k.mag.is_finite()).collect::<Vec<_>>();
        let n = known.len() as f64;
        let mean = |f: &dyn Fn(&Lent) -> f64| known.iter().map(|k| f(k)).sum::<f64>() / n;
        let (x, z) = (mean(&|k| k.airmass), mean(&|k| k.mag));
        let range = known.iter().fold((f64::MAX, f64::MIN), |r, k| (r.0.min(k.airmass), r.1.max(k.airmass)));
        if known.len() < Self::FEWEST || range.1 - range.0 < Self::LEAST_RANGE {
            return unknown;
        }
        let square = mean(&|k| (k.airmass - x).powi(2));
        let coefficient = -mean(&|k| (k.airmass - x) * (k.mag - z)) / square;
        let scatter = mean(&|k| (k.mag - z + coefficient * (k.airmass - x)).powi(2)) * n / (n - 2.0);
        let err = (scatter / (n * square)).sqrt();
        if (0.0..1.5).contains(&coefficient) && err < Self::UNKNOWN { Self { coefficient, err } } else { unknown }
    }

    /// A zero point as it would be at another airmass; as it is where one of them is unknown.
    fn carried(&self, one: &Lent, airmass: f64) -> Lent {
        let further = airmass - one.airmass;
        if !further.is_finite() {
            return *one;
        }
        Lent { mag: one.mag - self.coefficient * further, err: one.err.hypot(self.err * further), ..*one }
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

    /// A pass from airmass 1 to 2.5 through 0.3 mag an airmass: frames without stars at its end get the zero point of their own
    /// airmass; where all airmasses are alike, none is assumed and the error grows.
    #[test]
    fn a_borrowed_zero_point_is_that_of_its_own_airmass() {
        let frame = |i: u32, airmass: f64, known: bool| {
            let wiggle = 0.002 * f64::from(i % 3) - 0.002;
            let zp = if known { 22.0 - 0.3 * airmass + wiggle } else { f64::NAN };
            let mut m = measured(10.0 * f64::from(i), zp);
            m.airmass = airmass;
            m
        };
        let mut pass = (0..16).map(|i| frame(i, 1.0 + 0.1 * f64::from(i), i < 10)).collect::<Vec<_>>();
        borrow_zero_points(&mut pass);
        let last = &pass[15];
        assert!((last.zeropoint_mag - (22.0 - 0.3 * 2.5)).abs() < 3.0 * last.zeropoint_err, "{last:?}");
        assert!(last.zeropoint_err < 0.02, "{}", last.zeropoint_err);
        let mut still = (0..8).map(|i| frame(i, if i < 7 { 1.2 } else { 1.7 }, i < 7)).collect::<Vec<_>>();
        borrow_zero_points(&mut still);
        let (mag, err) = (still[7].zeropoint_mag, still[7].zeropoint_err);
        assert!((mag - 21.64).abs() < 0.01 && (err - 0.1).abs() < 0.01, "{mag} {err}");
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
