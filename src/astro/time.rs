//! One instant in the time scales astronomy needs.
//!
//! An [`Instant`] is a count of nanoseconds on TAI, exact in sums and differences from 1708 to 2292. The other
//! scales are readings of it ([`Scale`]): TT = TAI + 32.184 s; GPS = TAI - 19 s; UTC has leap seconds, in which the
//! minute has a 61st second; UT1 comes from the IERS table ([`super::eop`]). TDB differs from TT by less than 2 ms
//! (Fairhead & Bretagnon 1990, A&A 229, 240, as SOFA's `dtdb` sums it) and is told apart only where somebody asks:
//! the Earth moves 50 m in that time, 0.3 microarcseconds for a satellite's place among the stars.

use super::{Error, eop};
use hifitime::{Duration, Epoch, TimeScale};

/// Julian date of MJD 0.
pub const MJD_ZERO: f64 = 2_400_000.5;
/// MJD of the instant from which nanoseconds are counted: 2000-01-01 0h TAI.
const MJD_ORIGIN: i64 = 51_544;
/// Nanoseconds in a day without leap second.
pub const DAY_NS: i64 = 86_400_000_000_000;
const SECOND_NS: i64 = 1_000_000_000;
/// TT - TAI \[ns\].
const TT_NS: i64 = 32_184_000_000;
/// GPS - TAI \[ns\].
const GPS_NS: i64 = -19 * SECOND_NS;

/// An instant of time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Instant(i64);

/// A time scale.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// Coordinated Universal Time.
    Utc,
    /// International Atomic Time.
    Tai,
    /// Terrestrial Time.
    Tt,
    /// Barycentric Dynamical Time.
    Tdb,
    /// Time of the Global Positioning System.
    Gps,
    /// Universal Time: the Earth's rotation.
    Ut1,
}

impl Scale {
    /// All scales.
    pub const ALL: [Self; 6] = [Self::Utc, Self::Ut1, Self::Tai, Self::Gps, Self::Tt, Self::Tdb];

    /// Its usual abbreviation.
    pub fn name(self) -> &'static str {
        match self {
            Self::Utc => "UTC",
            Self::Tai => "TAI",
            Self::Tt => "TT",
            Self::Tdb => "TDB",
            Self::Gps => "GPS",
            Self::Ut1 => "UT1",
        }
    }

    /// The scale of that abbreviation, in capitals or not.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|scale| scale.name().eq_ignore_ascii_case(name))
    }
}

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
    format!("{}.{:014}", e14.div_euclid(10i128.pow(14)), e14.rem_euclid(10i128.pow(14)))
}

/// Calendar date (Gregorian) of a modified Julian day.
fn date(mjd: i64) -> (i32, i32, i32) {
    // SOFA refuses only days before -4799
    sofars::cal::jd2cal(MJD_ZERO, mjd as f64).map_or((0, 0, 0), |(y, m, d, _)| (y, m, d))
}

/// TAI - UTC \[ns\] at the start of a UTC day and the length of that day \[ns\]; rates before 1972 included. Before
/// 1960 there was no UTC: 0.
fn utc_day(mjd: i64) -> (i64, i64) {
    let offset = |mjd: i64| {
        let (year, month, day) = date(mjd);
        sofars::ts::dat(year, month, day, 0.0).map_or(0, |seconds| (seconds * 1e9).round() as i64)
    };
    let (start, next) = (offset(mjd), offset(mjd + 1));
    (start, DAY_NS + next - start)
}

impl Instant {
    /// The instant of a `hifitime` epoch.
    pub fn new(epoch: Epoch) -> Self {
        let since_1900 = epoch.to_time_scale(TimeScale::TAI).to_tai_duration().total_nanoseconds();
        let since_origin = since_1900 - i128::from((MJD_ORIGIN - 15_020) * DAY_NS);
        Self(since_origin.clamp(i64::MIN.into(), i64::MAX.into()) as i64)
    }

    /// The instant of an ISO 8601 date and time in UTC, with or without Z.
    ///
    /// # Errors
    /// The text, if it is no such date.
    pub fn from_utc(text: &str) -> Result<Self, String> {
        Self::from_iso(text.trim().trim_end_matches(['Z', 'z']), Scale::Utc)
            .map_err(|why| format!("{text:?} is no UTC date: {why}"))
    }

    /// The instant at which a clock on `scale` shows the day `mjd` and `ns` since its midnight.
    ///
    /// # Errors
    /// [`Error::EpochOutsideTable`] for UT1 where the Earth's rotation is unknown.
    pub fn from_reading(mjd: i64, ns: i64, scale: Scale) -> Result<Self, Error> {
        let on_scale =
            (mjd.saturating_sub(MJD_ORIGIN)).checked_mul(DAY_NS).and_then(|day| day.checked_add(ns));
        let on_scale = on_scale.unwrap_or(if mjd < MJD_ORIGIN { i64::MIN / 2 } else { i64::MAX / 2 });
        Ok(match scale {
            Scale::Tai => Self(on_scale),
            Scale::Tt => Self(on_scale - TT_NS),
            Scale::Gps => Self(on_scale - GPS_NS),
            Scale::Utc => Self(on_scale + utc_day(mjd).0),
            Scale::Tdb => Self(on_scale - TT_NS - Self(on_scale - TT_NS).tdb_minus_tt_ns()),
            Scale::Ut1 => {
                // UT1 - TAI changes by less than 1 ns in the 40 s or so by which the first guess is off
                let guess = Self(on_scale);
                let first = Self(on_scale - seconds_ns(eop::at(&guess)?.ut1_minus_tai));
                Self(on_scale - seconds_ns(eop::at(&first)?.ut1_minus_tai))
            }
        })
    }

    /// What a clock on `scale` shows.
    ///
    /// # Errors
    /// [`Error::EpochOutsideTable`] for UT1 where the Earth's rotation is unknown.
    pub fn reading(&self, scale: Scale) -> Result<Reading, Error> {
        Ok(match scale {
            Scale::Tai => self.shifted(0),
            Scale::Tt => self.shifted(TT_NS),
            Scale::Gps => self.shifted(GPS_NS),
            Scale::Tdb => self.shifted(TT_NS + self.tdb_minus_tt_ns()),
            Scale::Ut1 => self.shifted(seconds_ns(eop::at(self)?.ut1_minus_tai)),
            Scale::Utc => self.utc_reading(),
        })
    }

    /// `scale` - TAI \[s\].
    ///
    /// # Errors
    /// [`Error::EpochOutsideTable`] for UT1 where the Earth's rotation is unknown.
    pub fn offset_from_tai(&self, scale: Scale) -> Result<f64, Error> {
        Ok(match scale {
            Scale::Tai => 0.0,
            Scale::Tt => TT_NS as f64 * 1e-9,
            Scale::Gps => GPS_NS as f64 * 1e-9,
            Scale::Tdb => TT_NS as f64 * 1e-9 + self.tdb_minus_tt(),
            Scale::Ut1 => eop::at(self)?.ut1_minus_tai,
            Scale::Utc => -self.leap_seconds(),
        })
    }

    /// The epoch.
    pub fn epoch(&self) -> Epoch {
        Epoch::from_tai_duration(Duration::from_total_nanoseconds(
            i128::from(self.0) + i128::from((MJD_ORIGIN - 15_020) * DAY_NS),
        ))
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

    fn shifted(&self, offset_ns: i64) -> Reading {
        let ns = self.0.saturating_add(offset_ns);
        Reading { mjd: MJD_ORIGIN + ns.div_euclid(DAY_NS), ns: ns.rem_euclid(DAY_NS), day_ns: DAY_NS }
    }

    fn utc_reading(&self) -> Reading {
        // TAI is ahead of UTC by less than a day, so the UTC day is this or the one before
        let tai = self.shifted(0);
        for mjd in [tai.mjd, tai.mjd - 1] {
            let (ahead, day_ns) = utc_day(mjd);
            let ns = (tai.mjd - mjd) * DAY_NS + tai.ns - ahead;
            if ns >= 0 {
                return Reading { mjd, ns, day_ns };
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

    fn tdb_minus_tt_ns(&self) -> i64 {
        seconds_ns(self.tdb_minus_tt())
    }

    /// Leap seconds, TAI - UTC \[s\].
    pub fn leap_seconds(&self) -> f64 {
        utc_day(self.utc_reading().mjd).0 as f64 * 1e-9
    }

    /// MJD on UTC: whole days and the fraction of the day, below 1 also during a leap second.
    pub fn utc_mjd(&self) -> (f64, f64) {
        let utc = self.utc_reading();
        (utc.mjd as f64, utc.fraction())
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

fn seconds_ns(seconds: f64) -> i64 {
    (seconds * 1e9).round() as i64
}

/// Reading what people write.
impl Instant {
    /// The instant of an epoch as people write it: ISO 8601, or `JD` or `MJD` and a number of any length, followed by a
    /// scale (UTC unless given). A bare number above 1e6 is a Julian date, below a modified one.
    ///
    /// # Errors
    /// [`Error::Epoch`] with the text and what is wrong with it; [`Error::EpochOutsideTable`] for UT1.
    pub fn parse(text: &str) -> Result<Self, Error> {
        let fault = |reason: &str| Error::Epoch { text: text.trim().to_owned(), reason: reason.to_owned() };
        let mut words = text.split_whitespace().collect::<Vec<_>>();
        let scale = words.last().and_then(|word| Scale::named(word));
        if scale.is_some() {
            words.pop();
        }
        let scale = scale.unwrap_or(Scale::Utc);
        let rest = words.join(" ");
        let upper = rest.to_ascii_uppercase();
        let number = |digits: &str, julian: bool| {
            let (mjd, ns) = day_and_ns(digits, julian, scale)
                .ok_or_else(|| fault("a Julian date is a decimal number of days in the years 1709 to 2291"))?;
            Self::from_reading(mjd, ns, scale)
        };
        if let Some(digits) = upper.strip_prefix("MJD") {
            return number(digits.trim(), false);
        }
        if let Some(digits) = upper.strip_prefix("JD") {
            return number(digits.trim(), true);
        }
        if let Ok(value) = rest.parse::<f64>() {
            return number(&rest, value > 1e6);
        }
        let iso = rest.trim_end_matches(['Z', 'z']);
        if iso.len() < rest.len() && scale != Scale::Utc {
            return Err(fault("Z means UTC and another scale is named"));
        }
        Self::from_iso(iso, scale).map_err(|why| fault(&why))
    }

    /// The instant at which a clock on `scale` shows an ISO 8601 date and time: `YYYY-MM-DD`, then `T` or a space and
    /// `hh:mm[:ss[.f]]`, no offset. A 61st second is taken where UTC has one.
    ///
    /// # Errors
    /// What is wrong, in words.
    pub fn from_iso(text: &str, scale: Scale) -> Result<Self, String> {
        let form = "ISO 8601 is YYYY-MM-DDThh:mm:ss.f";
        let (date_text, time_text) = text.split_once(['T', 't', ' ']).unwrap_or((text, "00:00"));
        let whole = |text: Option<&str>, lengths: std::ops::RangeInclusive<usize>| {
            text.filter(|t| lengths.contains(&t.len()) && t.bytes().all(|b| b.is_ascii_digit()))
                .and_then(|t| t.parse::<i32>().ok())
                .ok_or(form)
        };
        let mut parts = date_text.split('-');
        let year = whole(parts.next(), 4..=4)?;
        // an ordinal date, as CCSDS messages may have it
        let second_part = parts.next();
        let mjd = if second_part.is_some_and(|p| p.len() == 3) {
            let day_of_year = i64::from(whole(second_part, 3..=3)?);
            let (first, next) = (mjd_of(year, 1, 1)?, mjd_of(year + 1, 1, 1)?);
            if !(1..=next - first).contains(&day_of_year) {
                return Err(format!("the year {year} has no day {day_of_year}"));
            }
            first + day_of_year - 1
        } else {
            mjd_of(year, whole(second_part, 1..=2)?, whole(parts.next(), 1..=2)?)?
        };
        let mut clock = time_text.trim().split(':');
        let (hour, minute) = (whole(clock.next(), 1..=2)?, whole(clock.next(), 2..=2)?);
        let (second, fraction) = clock.next().map_or(("00", ""), |s| s.split_once('.').unwrap_or((s, "")));
        let second = whole(Some(second), 1..=2)?;
        if parts.next().is_some() || clock.next().is_some() || !fraction.bytes().all(|b| b.is_ascii_digit()) {
            return Err(form.to_owned());
        }
        // to the nanosecond, the tenth digit rounds
        let digits = format!("{fraction:0<10}");
        let tenths = digits[..10].parse::<i64>().map_err(|_| form)?;
        let ns = i64::from(hour * 3600 + minute * 60 + second) * SECOND_NS + (tenths + 5) / 10;
        let day_ns = if scale == Scale::Utc { utc_day(mjd).1 } else { DAY_NS };
        let last_minute = hour == 23 && minute == 59;
        let second_exists = second < 60 || (last_minute && ns < day_ns);
        if hour > 23 || minute > 59 || !second_exists {
            return Err(format!("there is no time {} on that day", time_text.trim()));
        }
        Self::from_reading(mjd, ns, scale).map_err(|e| e.to_string())
    }
}

fn mjd_of(year: i32, month: i32, day: i32) -> Result<i64, String> {
    if !(1709..=2291).contains(&year) {
        return Err(format!("the year {year} lies outside 1709 to 2291"));
    }
    let (_, mjd) = sofars::cal::cal2jd(year, month, day)
        .map_err(|_| format!("there is no day {year:04}-{month:02}-{day:02}"))?;
    Ok(mjd as i64)
}

/// Day and nanoseconds of a decimal (modified) Julian date of any number of digits.
fn day_and_ns(text: &str, julian: bool, scale: Scale) -> Option<(i64, i64)> {
    let (sign, text) = text.strip_prefix('-').map_or((1, text), |rest| (-1, rest));
    let (whole, fraction) = text.split_once('.').unwrap_or((text, ""));
    let digits = |t: &str| t.bytes().all(|b| b.is_ascii_digit());
    if whole.is_empty() || whole.len() > 8 || !digits(whole) || !digits(fraction) {
        return None;
    }
    let fraction = &fraction[..fraction.len().min(20)];
    let scale_of = 10i128.pow(fraction.len() as u32);
    // days in units of the last digit, from MJD 0
    let mut days = whole.parse::<i128>().ok()? * scale_of + format!("0{fraction}").parse::<i128>().ok()?;
    days *= sign;
    // half a day in units of a tenth of the last digit keeps the sum whole
    let (days, unit) = if julian { (days * 10 - 24_000_005 * scale_of, scale_of * 10) } else { (days, scale_of) };
    let mjd = i64::try_from(days.div_euclid(unit)).ok()?;
    if !(-54_800..=158_000).contains(&mjd) {
        return None;
    }
    let length = i128::from(if scale == Scale::Utc { utc_day(mjd).1 } else { DAY_NS });
    Some((mjd, i64::try_from((days.rem_euclid(unit) * length + unit / 2) / unit).ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(text: &str) -> Instant {
        Instant::parse(text).expect("an epoch")
    }

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
        for (scale, iso) in [(Scale::Tai, "12:00:37.000"), (Scale::Tt, "12:01:09.184"), (Scale::Gps, "12:00:18.000")] {
            assert_eq!(t.reading(scale).expect("inside").iso(3), format!("2018-01-20T{iso}"), "{}", scale.name());
        }
    }

    #[test]
    fn the_leap_second_of_2016_is_one_second_long() {
        let before = Instant::from_utc("2016-12-31T23:59:59").expect("a date");
        let after = Instant::from_utc("2017-01-01T00:00:00").expect("a date");
        assert_eq!(after.since(&before), 2.0);
        let inside = before.plus(1.5);
        assert_eq!(inside.utc_mjd().0, 57753.0);
        assert_eq!(inside.iso_utc(), "2016-12-31T23:59:60.500000");
        assert_eq!(at("2016-12-31T23:59:60.5"), inside);
        assert_eq!(inside.leap_seconds(), 36.0);
        assert!(Instant::from_utc("2017-12-31T23:59:60").is_err());
        assert!(Instant::from_utc("2016-12-31T23:58:60").is_err());
        // rounding inside the leap second ends at the next day
        assert_eq!(after.plus(-1e-7).iso_utc(), "2017-01-01T00:00:00.000000");
    }

    #[test]
    fn a_nanosecond_is_kept_through_every_form_and_scale() {
        let t = Instant::from_utc("2018-01-20T03:00:00.123456789").expect("a date");
        assert!((t.plus(1e-9).since(&t) - 1e-9).abs() < 1e-18);
        assert_eq!(t.iso_utc(), "2018-01-20T03:00:00.123457");
        for moved in [t, at("2016-12-31T23:59:60.999999999"), at("2016-12-31T12:34:56.000000001")] {
            for scale in Scale::ALL {
                let reading = moved.reading(scale).expect("inside");
                let name = scale.name();
                for text in [
                    format!("{} {name}", reading.iso(9)),
                    format!("MJD {} {name}", reading.mjd_text()),
                    format!("JD {} {name}", reading.jd_text()),
                ] {
                    let back = at(&text);
                    assert!((back.tai_ns() - moved.tai_ns()).abs() <= i64::from(scale == Scale::Ut1), "{text}");
                }
            }
        }
        assert_eq!(Instant::new(t.epoch()), t);
    }

    #[test]
    fn epochs_as_people_write_them() {
        let noon = at("2018-01-20T12:00:00Z");
        for text in ["2018-01-20 12:00 UTC", "MJD 58138.5", "jd2458139.0", "2458139", "58138.5", "2018-020T12:00:00"] {
            assert_eq!(at(text), noon, "{text}");
        }
        for text in
            ["", "no date", "2018-02-30", "2018-01-20T24:00:00", "2018-01-20T12:00:00Z TT", "MJD x", "1e400",
             "2018-01-20T12:00:00+01:00", "9999-01-01", "JD 99999999999999999999", "2018-366T00:00:00", "2018-01-20T1é:00"]
        {
            let message = Instant::parse(text).expect_err(text).to_string();
            assert!(message.contains(text), "{message}");
        }
    }

    #[test]
    fn times_beyond_the_count_of_nanoseconds_stay_at_its_end() {
        let t = at("2018-01-20");
        assert_eq!(t.plus(f64::NAN), t);
        assert!(t.plus(1e300).since(&t) > 8e9 && t.plus(-1e300).since(&t) < -8e9);
        let _ = t.plus(f64::INFINITY).iso_utc();
    }
}
