//! Earth orientation parameters: polar motion, UT1 and the celestial pole offsets.
//!
//! From the IERS finals2000A table (Bulletin B, then A, daily, with predictions of about a year), trimmed and built in;
//! `catalogs/README.md` gives its origin and layout. Values are interpolated linearly between days, UT1 as
//! UT1 - TAI so that leap seconds leave no step. Diurnal and semidiurnal tides (up to 1 mas and 0.09 ms) are left out.
//!
//! After the table's last day UT1 goes on at the mean rate of the table's last year, the pole returns to the IERS
//! secular pole (IERS Conventions 2010, 2018 update, eq. 21) with a time constant of 100 days, and the celestial pole
//! offsets are 0. What that may be wrong by was measured on the table itself ([`Eop::ut1_bound_s`]). Before the table
//! nothing is known.

use super::{Error, time::Instant};
use crate::base::units::ARCSEC;

const TABLE: &str = include_str!("../../catalogs/eop/finals2000A.txt");
/// Last day for which anything is computed: SOFA's Earth ends with the century.
const LAST_MJD: i64 = 88_067;
/// Days over which the rate of UT1 is taken for the time after the table.
const RATE_DAYS: usize = 365;
/// Days in which a departure from the secular pole falls to 1/e after the table.
const POLE_DAYS: f64 = 100.0;
/// Growth of the error of UT1 after the table \[s/d\]: the largest over all horizons from 10 days to 40 years in
/// 1973-2026.
const UT1_BOUND_S_PER_DAY: f64 = 1.6e-3;
/// Largest departure of the pole from the secular pole and of its return from the truth, 1973-2026 \[arcsec\].
const POLE_BOUND_ARCSEC: f64 = 0.35;

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
    /// Days after the table's last; 0 inside it.
    pub beyond_days: f64,
}

impl Eop {
    /// Bound of the error of UT1 that comes from extrapolation \[s\]; 0 inside the table. A second moves a
    /// geostationary satellite by 15 arcsec among the stars.
    pub fn ut1_bound_s(&self) -> f64 {
        UT1_BOUND_S_PER_DAY * self.beyond_days
    }

    /// Bound of the error of the pole that comes from extrapolation \[rad\]; 0 inside the table.
    pub fn pole_bound(&self) -> f64 {
        if self.beyond_days > 0.0 { POLE_BOUND_ARCSEC * ARCSEC } else { 0.0 }
    }
}

/// The parameters at one UTC midnight.
#[derive(Debug, Clone, Copy)]
struct Row {
    tai_ns: i64,
    eop: Eop,
}

/// The table's line of one day: MJD, xp ", yp ", UT1-UTC s, dX mas, dY mas.
fn line(index: usize) -> Option<[f64; 6]> {
    let width = TABLE.find('\n')? + 1;
    let text = TABLE.get(index.checked_mul(width)?..index.checked_add(1)?.checked_mul(width)?)?;
    let mut fields = text.split_ascii_whitespace().map(str::parse);
    let mut values = [0.0; 6];
    for value in &mut values {
        *value = fields.next()?.ok()?;
    }
    Some(values)
}

/// First and last day of the table, MJD.
pub fn span() -> (i64, i64) {
    let width = TABLE.find('\n').map_or(1, |end| end + 1);
    let day = |index| line(index).map_or(0, |values| values[0] as i64);
    (day(0), day((TABLE.len() / width).saturating_sub(1)))
}

fn tabulated(mjd: i64, first: i64) -> Option<Row> {
    let [_, xp, yp, ut1_minus_utc, dx, dy] = line(usize::try_from(mjd - first).ok()?)?;
    let midnight = Instant::from_utc_reading(mjd, 0);
    let eop = Eop {
        xp: xp * ARCSEC,
        yp: yp * ARCSEC,
        ut1_minus_tai: ut1_minus_utc - midnight.leap_seconds(),
        dx: dx * 1e-3 * ARCSEC,
        dy: dy * 1e-3 * ARCSEC,
        beyond_days: 0.0,
    };
    Some(Row { tai_ns: midnight.tai_ns(), eop })
}

/// The parameters `days` after the table's last day.
fn predicted(last_mjd: i64, first: i64, days: i64) -> Option<Row> {
    let midnight = Instant::from_utc_reading(last_mjd + days, 0);
    let (last, before) = (tabulated(last_mjd, first)?.eop, tabulated(last_mjd - RATE_DAYS as i64, first)?.eop);
    let days = days as f64;
    let rate = (last.ut1_minus_tai - before.ut1_minus_tai) / RATE_DAYS as f64;
    let secular = |mjd: f64| {
        let years = (mjd - 51_544.5) / 365.25;
        [(0.055 + 0.001_677 * years) * ARCSEC, (0.3205 + 0.003_46 * years) * ARCSEC]
    };
    let (at_end, then) = (secular(last_mjd as f64), secular(last_mjd as f64 + days));
    let left = (-days / POLE_DAYS).exp();
    let eop = Eop {
        xp: then[0] + left * (last.xp - at_end[0]),
        yp: then[1] + left * (last.yp - at_end[1]),
        ut1_minus_tai: last.ut1_minus_tai + rate * days,
        dx: 0.0,
        dy: 0.0,
        beyond_days: days,
    };
    Some(Row { tai_ns: midnight.tai_ns(), eop })
}

/// The parameters during one day of TAI: the UTC midnights before, in and after it.
#[derive(Debug, Clone, Copy)]
pub struct DayOfEop {
    /// None on the table's first day.
    before: Option<Row>,
    within: Row,
    after: Row,
}

impl DayOfEop {
    /// The day of TAI that holds `t`.
    ///
    /// # Errors
    /// [`Error::EpochOutsideTable`] before 1973-01-02 and after 2099-12-30.
    pub fn of(t: &Instant) -> Result<Self, Error> {
        let (first, last) = span();
        let outside = || {
            let date = |mjd: i64| Instant::from_utc_reading(mjd, 0).iso_utc()[..10].to_owned();
            Error::EpochOutsideTable { utc: t.iso_utc(), first: date(first), last: date(LAST_MJD) }
        };
        let mjd = t.shifted(0).mjd;
        let row = |mjd: i64| {
            let known = if mjd > LAST_MJD {
                None
            } else if mjd <= last {
                tabulated(mjd, first)
            } else {
                predicted(last, first, mjd - last)
            };
            known.ok_or_else(outside)
        };
        let day = Self { before: row(mjd - 1).ok(), within: row(mjd)?, after: row(mjd + 1)? };
        if day.before.is_none() && t.tai_ns() < day.within.tai_ns { Err(outside()) } else { Ok(day) }
    }

    /// The parameters at `t`, which must lie in this day.
    pub fn at(&self, t: &Instant) -> Eop {
        let (a, b) = match &self.before {
            Some(before) if t.tai_ns() < self.within.tai_ns => (before, &self.within),
            _ => (&self.within, &self.after),
        };
        let share = (t.tai_ns() - a.tai_ns) as f64 / (b.tai_ns - a.tai_ns) as f64;
        let between = |f: fn(&Eop) -> f64| f(&a.eop) + share * (f(&b.eop) - f(&a.eop));
        Eop {
            xp: between(|e| e.xp),
            yp: between(|e| e.yp),
            ut1_minus_tai: between(|e| e.ut1_minus_tai),
            dx: between(|e| e.dx),
            dy: between(|e| e.dy),
            beyond_days: between(|e| e.beyond_days),
        }
    }
}

/// The parameters at `t`.
///
/// # Errors
/// [`Error::EpochOutsideTable`] before 1973-01-02 and after 2099-12-30.
pub fn at(t: &Instant) -> Result<Eop, Error> {
    Ok(DayOfEop::of(t)?.at(t))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn utc(text: &str) -> Instant {
        Instant::from_utc(text).expect("a date")
    }

    /// finals2000A, 2018-01-20 0h, as astropy reads it.
    #[test]
    fn values_of_a_known_day() {
        let eop = at(&utc("2018-01-20T00:00:00")).expect("inside the table");
        assert!((eop.ut1_minus_tai + 37.0 - 0.207_315_2).abs() < 1e-6, "{}", eop.ut1_minus_tai + 37.0);
        assert!((eop.xp / ARCSEC - 0.032_747).abs() < 1e-6 && (eop.yp / ARCSEC - 0.268_633).abs() < 1e-6);
        assert_eq!((eop.beyond_days, eop.ut1_bound_s(), eop.pole_bound()), (0.0, 0.0, 0.0));
    }

    #[test]
    fn ut1_does_not_jump_over_a_leap_second() {
        let t = utc("2016-12-31T23:59:50");
        let (a, b) = (at(&t).expect("inside"), at(&t.plus(20.0)).expect("inside"));
        assert!((a.ut1_minus_tai - b.ut1_minus_tai).abs() < 1e-5);
    }

    #[test]
    fn epochs_before_the_table_are_refused() {
        for text in ["1960-01-01T00:00:00", "1709-01-01T00:00:00", "1973-01-01T23:59:59"] {
            let error = at(&utc(text)).expect_err(text);
            assert!(matches!(&error, Error::EpochOutsideTable { .. }), "{error}");
            assert!(error.to_string().contains(&text[..10]), "{error}");
        }
        assert!(at(&utc("1973-01-02T00:00:00")).is_ok());
    }

    #[test]
    fn nothing_jumps_at_the_end_of_the_table() {
        let end = Instant::from_utc_reading(span().1, 0);
        let values =
            (-20..20).map(|k| at(&end.plus(f64::from(k) * 0.25 * 86_400.0)).expect("known")).collect::<Vec<_>>();
        for pair in values.windows(2) {
            assert!(
                (pair[1].xp - pair[0].xp).abs() < 2e-3 * ARCSEC && (pair[1].yp - pair[0].yp).abs() < 2e-3 * ARCSEC
            );
            assert!((pair[1].ut1_minus_tai - pair[0].ut1_minus_tai).abs() < 1e-3);
        }
    }

    /// The stated bounds, held against the table itself: from any day, the extrapolation of any length.
    #[test]
    fn the_bounds_of_extrapolation_hold_over_half_a_century() {
        let first = span().0;
        let days = usize::try_from(span().1 - first).expect("a long table") - 380;
        let rows = (0..days).map(|i| tabulated(first + i as i64, first).expect("inside").eop).collect::<Vec<_>>();
        let mut reached = 0.0f64;
        for horizon in [10, 30, 100, 365, 1500, 7300] {
            for start in (RATE_DAYS..days - horizon).step_by(53) {
                let rate = (rows[start].ut1_minus_tai - rows[start - RATE_DAYS].ut1_minus_tai) / RATE_DAYS as f64;
                let error =
                    rows[start + horizon].ut1_minus_tai - rows[start].ut1_minus_tai - rate * horizon as f64;
                reached = reached.max(error.abs() / (UT1_BOUND_S_PER_DAY * horizon as f64));
            }
        }
        assert!(reached < 1.0 && reached > 0.6, "{reached}");
    }
}
