//! Earth orientation parameters: polar motion, UT1 and the celestial pole offsets.
//!
//! From the IERS finals2000A table (Bulletin A, daily, with predictions of about a year), trimmed and built in;
//! `catalogs/README.md` gives its origin and layout. Values are interpolated linearly between days, UT1 as
//! UT1 - TAI so that leap seconds leave no step. Diurnal and semidiurnal tides (below 0.6 mas and 0.05 ms) are
//! left out.

use super::{Error, time::Instant};
use crate::base::units::ARCSEC;
use hifitime::Epoch;

const TABLE: &str = include_str!("../../catalogs/eop/finals2000A.txt");

/// Orientation parameters of one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Eop {
    /// Polar motion x, towards Greenwich \[rad\].
    pub xp: f64,
    /// Polar motion y, towards 90 deg west \[rad\].
    pub yp: f64,
    /// UT1 - TAI \[s\].
    pub ut1_minus_tai: f64,
    /// Celestial pole offset dX with respect to IAU 2006/2000A \[rad\].
    pub dx: f64,
    /// Celestial pole offset dY with respect to IAU 2006/2000A \[rad\].
    pub dy: f64,
}

/// The line of one day: MJD, xp ", yp ", UT1-UTC s, dX mas, dY mas.
fn line(index: usize) -> Option<[f64; 6]> {
    let width = TABLE.find('\n')? + 1;
    let text = TABLE.get(index * width..(index + 1) * width)?;
    let mut fields = text.split_ascii_whitespace().map(str::parse);
    let mut values = [0.0; 6];
    for value in &mut values {
        *value = fields.next()?.ok()?;
    }
    Some(values)
}

/// First and last day of the table, MJD.
pub fn span() -> (u32, u32) {
    let width = TABLE.find('\n').map_or(1, |end| end + 1);
    let day = |index| line(index).map_or(0, |values| values[0] as u32);
    (day(0), day((TABLE.len() / width).saturating_sub(1)))
}

/// The parameters at `t`.
///
/// # Errors
/// [`Error::EpochOutsideTable`] before 1973-01-02 or after the last prediction.
pub fn at(t: &Instant) -> Result<Eop, Error> {
    let (first, last) = span();
    let (day, fraction) = t.utc_mjd();
    let date = |mjd: u32| Instant::new(Epoch::from_mjd_utc(f64::from(mjd))).iso_utc()[..10].to_owned();
    let outside = || Error::EpochOutsideTable { utc: t.iso_utc(), first: date(first), last: date(last) };
    if day < f64::from(first) || day >= f64::from(last) {
        return Err(outside());
    }
    let index = day as usize - first as usize;
    let (a, b) = (line(index).ok_or_else(outside)?, line(index + 1).ok_or_else(outside)?);
    let ut1_minus_tai = |row: &[f64; 6]| row[3] - Instant::new(Epoch::from_mjd_utc(row[0])).leap_seconds();
    let between = |x: f64, y: f64| x + fraction * (y - x);
    Ok(Eop {
        xp: between(a[1], b[1]) * ARCSEC,
        yp: between(a[2], b[2]) * ARCSEC,
        ut1_minus_tai: between(ut1_minus_tai(&a), ut1_minus_tai(&b)),
        dx: between(a[4], b[4]) * 1e-3 * ARCSEC,
        dy: between(a[5], b[5]) * 1e-3 * ARCSEC,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// finals2000A, 2018-01-20 0h, as astropy reads it.
    #[test]
    fn values_of_a_known_day() {
        let eop = at(&Instant::from_utc("2018-01-20T00:00:00").expect("a date")).expect("inside the table");
        assert!((eop.ut1_minus_tai + 37.0 - 0.207_312_3).abs() < 1e-6, "{}", eop.ut1_minus_tai + 37.0);
        assert!((eop.xp / ARCSEC - 0.032_782).abs() < 1e-6 && (eop.yp / ARCSEC - 0.268_601).abs() < 1e-6);
    }

    #[test]
    fn ut1_does_not_jump_over_a_leap_second() {
        let t = Instant::from_utc("2016-12-31T23:59:50").expect("a date");
        let (a, b) = (at(&t).expect("inside"), at(&t.plus(20.0)).expect("inside"));
        assert!((a.ut1_minus_tai - b.ut1_minus_tai).abs() < 1e-5);
    }

    #[test]
    fn epochs_outside_the_table_are_refused() {
        let t = Instant::from_utc("1960-01-01T00:00:00").expect("a date");
        assert!(matches!(at(&t), Err(Error::EpochOutsideTable { .. })));
    }
}
