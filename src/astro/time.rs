//! One instant in the time scales astronomy needs.
//!
//! An [`Instant`] is kept by `hifitime` to the nanosecond on TAI. TT = TAI + 32.184 s; UTC has leap seconds;
//! UT1 comes from the IERS table ([`super::eop`]). TDB differs from TT by less than 2 ms and is not told apart:
//! the Earth moves 50 m in that time, 0.3 microarcseconds for a satellite's place among the stars.

use hifitime::{Duration, Epoch, TimeScale};

/// An instant of time.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct Instant(Epoch);

/// Julian date of MJD 0.
const MJD_ZERO: f64 = 2_400_000.5;
/// MJD of 1900-01-01, where `hifitime` counts from.
const MJD_1900: i128 = 15_020;
const DAY_NS: i128 = 86_400_000_000_000;

impl Instant {
    /// The instant of a `hifitime` epoch.
    pub fn new(epoch: Epoch) -> Self {
        // differences and sums of UTC epochs would skip leap seconds
        Self(epoch.to_time_scale(TimeScale::TAI))
    }

    /// The instant of an ISO 8601 date and time in UTC, with or without Z.
    ///
    /// # Errors
    /// The text, if it is no such date.
    pub fn from_utc(text: &str) -> Result<Self, String> {
        let text = text.trim().trim_end_matches('Z');
        format!("{text} UTC").parse::<Epoch>().map(Self::new).map_err(|e| format!("{text:?} is no UTC date: {e}"))
    }

    /// The epoch.
    pub fn epoch(&self) -> Epoch {
        self.0
    }

    /// This instant moved by `seconds` of SI time.
    #[must_use]
    pub fn plus(&self, seconds: f64) -> Self {
        Self(self.0 + Duration::from_seconds(seconds))
    }

    /// SI seconds since `other`.
    pub fn since(&self, other: &Self) -> f64 {
        (self.0 - other.0).to_seconds()
    }

    /// MJD on TAI plus `offset_ns`: whole days and the fraction of a day.
    fn tai_mjd(&self, offset_ns: i128) -> (f64, f64) {
        let ns = self.0.to_tai_duration().total_nanoseconds() + offset_ns;
        ((MJD_1900 + ns.div_euclid(DAY_NS)) as f64, ns.rem_euclid(DAY_NS) as f64 / DAY_NS as f64)
    }

    /// Two-part Julian date of Terrestrial Time.
    pub fn tt(&self) -> (f64, f64) {
        let (day, fraction) = self.tai_mjd(32_184_000_000);
        (MJD_ZERO + day, fraction)
    }

    /// Two-part Julian date of UT1, from UT1 - TAI \[s\].
    pub fn ut1(&self, ut1_minus_tai_s: f64) -> (f64, f64) {
        let (day, fraction) = self.tai_mjd((ut1_minus_tai_s * 1e9).round() as i128);
        (MJD_ZERO + day, fraction)
    }

    /// Leap seconds, TAI - UTC \[s\].
    pub fn leap_seconds(&self) -> f64 {
        self.0.leap_seconds(true).unwrap_or(0.0)
    }

    /// Two-part quasi Julian date of UTC: a day with a leap second is longer, as in SOFA.
    fn utc(&self) -> (f64, f64) {
        let (day, fraction) = self.tai_mjd(0);
        sofars::ts::taiutc(MJD_ZERO + day, fraction).unwrap_or((MJD_ZERO + day, fraction))
    }

    /// MJD on UTC: whole days and the fraction of the day, below 1 also during a leap second.
    pub fn utc_mjd(&self) -> (f64, f64) {
        let (first, second) = self.utc();
        let whole = (first - MJD_ZERO).floor();
        let rest = (first - MJD_ZERO - whole) + second;
        (whole + rest.floor(), rest - rest.floor())
    }

    /// MJD on UTC as one number; good to a microsecond.
    pub fn mjd_utc(&self) -> f64 {
        let (day, fraction) = self.utc_mjd();
        day + fraction
    }

    /// ISO 8601 in UTC with six decimals and no Z, rounded to the microsecond; 23:59:60 in a leap second.
    pub fn iso_utc(&self) -> String {
        let (first, second) = self.utc();
        match sofars::ts::d2dtf("UTC", 6, first, second) {
            Ok((y, m, d, [hour, minute, second, micro])) => {
                format!("{y:04}-{m:02}-{d:02}T{hour:02}:{minute:02}:{second:02}.{micro:06}")
            }
            Err(_) => self.0.to_isoformat(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Hand-worked: 2018-01-20 is MJD 58138; TAI - UTC = 37 s, TT - UTC = 69.184 s.
    #[test]
    fn scales_of_a_known_instant() {
        let t = Instant::from_utc("2018-01-20T12:00:00Z").expect("a date");
        assert_eq!(t.mjd_utc(), 58138.5);
        assert_eq!(t.leap_seconds(), 37.0);
        let (day, fraction) = t.tt();
        assert_eq!(day, MJD_ZERO + 58138.0);
        assert!((fraction - (0.5 + 69.184 / 86_400.0)).abs() < 1e-14);
        assert_eq!(t.iso_utc(), "2018-01-20T12:00:00.000000");
    }

    #[test]
    fn the_leap_second_of_2016_is_one_second_long() {
        let before = Instant::from_utc("2016-12-31T23:59:59").expect("a date");
        let after = Instant::from_utc("2017-01-01T00:00:00").expect("a date");
        assert_eq!(after.since(&before), 2.0);
        let inside = before.plus(1.5);
        assert_eq!(inside.utc_mjd().0, 57753.0);
        assert_eq!(inside.iso_utc(), "2016-12-31T23:59:60.500000");
    }

    #[test]
    fn a_second_is_kept_to_the_nanosecond() {
        let t = Instant::from_utc("2018-01-20T03:00:00.123456789").expect("a date");
        assert!((t.plus(1e-9).since(&t) - 1e-9).abs() < 1e-12);
        assert_eq!(t.iso_utc(), "2018-01-20T03:00:00.123457");
        assert!(Instant::from_utc("no date").is_err());
    }
}
