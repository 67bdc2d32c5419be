//! One instant of time, and what clocks show.
//!
//! An [`Instant`] is a count of nanoseconds on TAI, exact in sums and differences from 1708 to 2292. A clock's
//! [`Reading`] of it is a day and the time since midnight; UTC has leap seconds, in which the minute has a 61st second.
//! The other scales, and what people write, are in [`super::scales`].

/// Julian date of MJD 0.
pub const MJD_ZERO: f64 = 2_400_000.5;
/// MJD of the instant from which nanoseconds are counted: 2000-01-01 0h TAI.
const MJD_ORIGIN: i64 = 51_544;
/// Nanoseconds in a day without leap second.
pub const DAY_NS: i64 = 86_400_000_000_000;
/// Nanoseconds in a second.
pub const SECOND_NS: i64 = 1_000_000_000;
/// TT - TAI \[ns\].
pub const TT_NS: i64 = 32_184_000_000;

/// An instant of time; by default 2000-01-01 0h TAI.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Instant(i64);

/// What a clock on some scale shows: a day and the time since its midnight.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reading {
    /// Modified Julian day.
    pub mjd: i64,
    /// Time since midnight \[ns\]; in a leap second beyond [`DAY_NS`].
    pub ns: i64,
    /// Length of this day \[ns\].
    pub day_ns: i64,
}

impl Reading {
    /// Fraction of the day, below 1 also during a leap second (SOFA's quasi Julian date).
    pub fn fraction(&self) -> f64 {
        self.ns as f64 / self.day_ns as f64
    }

    /// ISO 8601 with `digits` (0 to 9) decimals of the second, rounded; 23:59:60 in a leap second.
    pub fn iso(&self, digits: u32) -> String {
        let unit = 10i64.pow(9 - digits.min(9));
        let rounded = (self.ns + unit / 2) / unit * unit;
        let (mjd, ns) = if rounded >= self.day_ns { (self.mjd + 1, 0) } else { (self.mjd, rounded) };
        let second = (ns / SECOND_NS).min(86_399);
        let (year, month, day) = date(mjd);
        let (hour, minute) = (second / 3600, second / 60 % 60);
        // what is beyond 23:59:59 belongs to the 61st second of the last minute
        let rest = ns - (hour * 3600 + minute * 60) * SECOND_NS;
        let mut text = format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{:02}", rest / SECOND_NS);
        if digits > 0 {
            text.push_str(&format!(".{:0width$}", rest % SECOND_NS / unit, width = digits.min(9) as usize));
        }
        text
    }

    /// Modified Julian date with 14 decimals, which is finer than a nanosecond.
    pub fn mjd_text(&self) -> String {
        decimal(self.mjd as i128 * 10i128.pow(14) + self.fraction_e14())
    }

    /// Julian date with 14 decimals, which is finer than a nanosecond.
    pub fn jd_text(&self) -> String {
        decimal((self.mjd as i128 * 10 + 24_000_005) * 10i128.pow(13) + self.fraction_e14())
    }

    fn fraction_e14(&self) -> i128 {
        let day = i128::from(self.day_ns);
        (i128::from(self.ns) * 10i128.pow(14) + day / 2) / day
    }
}

fn decimal(e14: i128) -> String {
    let (sign, size) = (if e14 < 0 { "-" } else { "" }, e14.unsigned_abs());
    format!("{sign}{}.{:014}", size / 10u128.pow(14), size % 10u128.pow(14))
}

/// Calendar date (Gregorian) of a modified Julian day.
fn date(mjd: i64) -> (i32, i32, i32) {
    // SOFA refuses only days before -4799
    sofars::cal::jd2cal(MJD_ZERO, mjd as f64).map_or((0, 0, 0), |(y, m, d, _)| (y, m, d))
}

/// A day of UTC.
struct UtcDay {
    /// TAI - UTC at its start \[ns\].
    ahead_ns: i64,
    /// How much TAI gains on UTC during it, steps left out \[ns\]: not 0 before 1972.
    drift_ns: i64,
    /// Its length on UTC's own clock \[ns\].
    day_ns: i64,
}

/// The day of UTC of that number, with its rate before 1972 as SOFA's `dat` has it. Before 1960 there was no UTC: TAI.
fn utc_day(mjd: i64) -> UtcDay {
    let offset = |mjd: i64, fraction: f64| {
        let (year, month, day) = date(mjd);
        sofars::ts::dat(year, month, day, fraction).map_or(0, |seconds| (seconds * 1e9).round() as i64)
    };
    let (ahead_ns, next) = (offset(mjd, 0.0), offset(mjd + 1, 0.0));
    let drift_ns = 2 * (offset(mjd, 0.5) - ahead_ns);
    UtcDay { ahead_ns, drift_ns, day_ns: DAY_NS + next - ahead_ns - drift_ns }
}

/// `ns` times (1 + `rate_ns` a day), to the nanosecond.
fn stretched(ns: i64, rate_ns: i64) -> i64 {
    ns + (i128::from(ns) * i128::from(rate_ns) / i128::from(DAY_NS)) as i64
}

/// Length of a day on UTC's own clock \[ns\].
pub(super) fn utc_day_ns(mjd: i64) -> i64 {
    utc_day(mjd).day_ns
}

impl Instant {
    /// The instant of a modified Julian date on UTC, good to a microsecond.
    pub fn from_mjd_utc(mjd: f64) -> Self {
        let day = mjd.floor();
        Self::from_utc_reading(day as i64, ((mjd - day) * utc_day_ns(day as i64) as f64).round() as i64)
    }

    /// Nanoseconds of TAI since 2000-01-01 0h TAI.
    pub fn tai_ns(&self) -> i64 {
        self.0
    }

    /// The instant so many nanoseconds of TAI after 2000-01-01 0h TAI.
    pub fn from_tai_ns(ns: i64) -> Self {
        Self(ns)
    }

    /// This instant moved by `seconds` of SI time; NaN moves it nowhere, and beyond 1708 or 2292 it stays there.
    #[must_use]
    pub fn plus(&self, seconds: f64) -> Self {
        Self(self.0.saturating_add(seconds_ns(seconds)))
    }

    /// SI seconds since `other`.
    pub fn since(&self, other: &Self) -> f64 {
        self.0.saturating_sub(other.0) as f64 * 1e-9
    }

    /// The instant at which a clock `offset_ns` ahead of TAI shows the day `mjd` and `ns` since its midnight.
    pub fn from_shifted(mjd: i64, ns: i64, offset_ns: i64) -> Self {
        let on_clock = mjd.saturating_sub(MJD_ORIGIN).checked_mul(DAY_NS).and_then(|day| day.checked_add(ns));
        let on_clock = on_clock.unwrap_or(if mjd < MJD_ORIGIN { i64::MIN / 2 } else { i64::MAX / 2 });
        Self(on_clock.saturating_sub(offset_ns))
    }

    /// The instant at which UTC shows the day `mjd` and `ns` since its midnight.
    pub fn from_utc_reading(mjd: i64, ns: i64) -> Self {
        let day = utc_day(mjd);
        Self::from_shifted(mjd, stretched(ns, day.drift_ns), -day.ahead_ns)
    }

    /// What a clock `offset_ns` ahead of TAI shows.
    pub fn shifted(&self, offset_ns: i64) -> Reading {
        let ns = self.0.saturating_add(offset_ns);
        Reading { mjd: MJD_ORIGIN + ns.div_euclid(DAY_NS), ns: ns.rem_euclid(DAY_NS), day_ns: DAY_NS }
    }

    /// What a clock on UTC shows.
    pub fn utc_reading(&self) -> Reading {
        // TAI is ahead of UTC by less than a day, so the UTC day is this or the one before
        let tai = self.shifted(0);
        for mjd in [tai.mjd, tai.mjd - 1] {
            let day = utc_day(mjd);
            let ns = (tai.mjd - mjd) * DAY_NS + tai.ns - day.ahead_ns;
            if ns >= 0 {
                // the inverse of the stretch, whose square is below a nanosecond
                return Reading { mjd, ns: stretched(ns, -day.drift_ns), day_ns: day.day_ns };
            }
        }
        tai
    }

    /// Two-part Julian date of Terrestrial Time.
    pub fn tt(&self) -> (f64, f64) {
        self.shifted(TT_NS).two_part()
    }

    /// Two-part Julian date of UT1, from UT1 - TAI \[s\].
    pub fn ut1(&self, ut1_minus_tai_s: f64) -> (f64, f64) {
        self.shifted(seconds_ns(ut1_minus_tai_s)).two_part()
    }

    /// TDB - TT at the geocentre \[s\].
    pub fn tdb_minus_tt(&self) -> f64 {
        let (day, fraction) = self.tt();
        sofars::ts::dtdb(day, fraction, fraction, 0.0, 0.0, 0.0)
    }

    /// TAI - UTC \[s\]: whole leap seconds from 1972 on.
    pub fn leap_seconds(&self) -> f64 {
        let (tai, utc) = (self.shifted(0), self.utc_reading());
        ((tai.mjd - utc.mjd) * DAY_NS + tai.ns - utc.ns) as f64 * 1e-9
    }

    /// MJD on UTC: whole days and the fraction of the day, below 1 also during a leap second.
    pub fn utc_mjd(&self) -> (f64, f64) {
        let utc = self.utc_reading();
        (utc.mjd as f64, utc.fraction())
    }

    /// Julian year of UTC: 2000.0 at 2000-01-01T12:00.
    pub fn julian_year(&self) -> f64 {
        (self.mjd_utc() - 51_544.5) / 365.25 + 2000.0
    }

    /// MJD on UTC as one number; good to a microsecond.
    pub fn mjd_utc(&self) -> f64 {
        let (day, fraction) = self.utc_mjd();
        day + fraction
    }

    /// ISO 8601 in UTC with six decimals and no Z, rounded to the microsecond; 23:59:60 in a leap second.
    pub fn iso_utc(&self) -> String {
        self.utc_reading().iso(6)
    }
}

impl Reading {
    fn two_part(&self) -> (f64, f64) {
        (MJD_ZERO + self.mjd as f64, self.fraction())
    }
}

pub(super) fn seconds_ns(seconds: f64) -> i64 {
    (seconds * 1e9).round() as i64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Hand-worked: 2018-01-20 is MJD 58138; TAI - UTC = 37 s, TT - UTC = 69.184 s.
    #[test]
    fn a_known_instant() {
        let t = Instant::from_utc_reading(58_138, DAY_NS / 2);
        assert_eq!((t.mjd_utc(), t.leap_seconds()), (58138.5, 37.0));
        let (day, fraction) = t.tt();
        assert_eq!(day, MJD_ZERO + 58138.0);
        assert!((fraction - (0.5 + 69.184 / 86_400.0)).abs() < 1e-14);
        assert_eq!(t.iso_utc(), "2018-01-20T12:00:00.000000");
        assert!(Instant::from_mjd_utc(58_138.5).since(&t).abs() < 1e-6);
        assert!((t.plus(1e-9).since(&t) - 1e-9).abs() < 1e-18);
    }

    #[test]
    fn times_beyond_the_count_of_nanoseconds_stay_at_its_end() {
        let t = Instant::default();
        assert_eq!(t.plus(f64::NAN), t);
        assert!(t.plus(1e300).since(&t) > 8e9 && t.plus(-1e300).since(&t) < -8e9);
        let _ = t.plus(f64::INFINITY).iso_utc();
    }
}
