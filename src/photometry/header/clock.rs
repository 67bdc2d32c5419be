//! Dates and times of day as written in headers, exact to a nanosecond, on whatever scale the header's clock
//! shows.
//!
//! FITS Standard 4.0, sect. 9.1 (ISO 8601) and 4.4.2.1 (the old form DD/MM/YY); days are counted by the proleptic
//! Gregorian calendar.

use std::fmt;

/// Nanoseconds in a second.
const SECOND_NS: i64 = 1_000_000_000;
/// Seconds in a day.
const DAY_S: i64 = 86_400;

/// A reading of a clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Stamp {
    /// Modified Julian day.
    day: i64,
    /// Since midnight \[ns\]; in a leap second beyond a day.
    ns: i64,
}

/// A reading and how finely it was written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Written {
    pub stamp: Stamp,
    /// Unit of the last digit \[s\].
    pub unit_s: f64,
    /// Nothing but a day was written.
    pub day_only: bool,
}

impl Stamp {
    /// Seconds since `other`, days of 86 400 s.
    pub fn since(&self, other: &Self) -> f64 {
        ((self.day - other.day) * DAY_S) as f64 + (self.ns - other.ns) as f64 * 1e-9
    }

    /// Julian years since 2000-01-01 12h.
    pub fn years_since_2000(&self) -> f64 {
        ((self.day - 51_544) as f64 - 0.5 + self.ns as f64 * 1e-9 / DAY_S as f64) / 365.25
    }

    /// At a time of day \[ns\] of the same day.
    pub fn at(self, ns: i64) -> Self {
        Self { ns, ..self }
    }

    /// Since midnight \[ns\].
    pub fn ns(&self) -> i64 {
        self.ns
    }

    /// A modified Julian date of the years 1858 to 2201, with the unit of its last digit \[s\].
    pub fn from_mjd(mjd: f64) -> Option<Written> {
        if !(0.0..125_000.0).contains(&mjd) {
            return None;
        }
        let day = mjd.floor();
        let stamp = Self { day: day as i64, ns: ((mjd - day) * DAY_S as f64 * 1e9).round() as i64 };
        Some(Written { stamp, unit_s: days_unit(mjd), day_only: false })
    }

    /// A Julian date of the same years.
    pub fn from_jd(jd: f64) -> Option<Written> {
        let written = Self::from_mjd(jd - 2_400_000.5)?;
        Some(Written { unit_s: days_unit(jd), ..written })
    }
}

/// Unit of the last decimal of a number of days \[s\]: at most that of five decimals, as a time with fewer may be
/// exact, at least that of a double's own last digits.
fn days_unit(days: f64) -> f64 {
    let text = days.to_string();
    let decimals = text.split_once('.').map_or(0, |(_, fraction)| fraction.len());
    let written = 10f64.powi(-(decimals.clamp(5, 17) as i32)) * DAY_S as f64;
    written.max(2.0 * days.abs() * f64::EPSILON * DAY_S as f64)
}

impl fmt::Display for Stamp {
    /// ISO 8601 with nine decimals; 23:59:60 in a leap second.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (year, month, day) = date(self.day);
        let second = (self.ns / SECOND_NS).min(DAY_S - 1);
        let (hour, minute) = (second / 3600, second / 60 % 60);
        let rest = self.ns - (hour * 3600 + minute * 60) * SECOND_NS;
        let (whole, fraction) = (rest / SECOND_NS, rest % SECOND_NS);
        write!(f, "{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{whole:02}.{fraction:09}")
    }
}

/// Modified Julian day of a date; none if there is no such day in the years 1858 to 2201.
fn mjd(year: i64, month: i64, day: i64) -> Option<i64> {
    if !(1858..=2201).contains(&year) || !(1..=12).contains(&month) || day < 1 {
        return None;
    }
    // years from March on put the leap day last
    let (y, m) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
    let count = 365 * y + y / 4 - y / 100 + y / 400 + (153 * m + 2) / 5 + day - 1 - 678_881;
    (date(count) == (year, month, day)).then_some(count)
}

/// Year, month and day of a modified Julian day.
fn date(mjd: i64) -> (i64, i64, i64) {
    let days = mjd + 678_881;
    let era = days.div_euclid(146_097);
    let of_era = days.rem_euclid(146_097);
    let year = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year + year / 4 - year / 100);
    let m = (5 * of_year + 2) / 153;
    let (month, carry) = if m < 10 { (m + 3, 0) } else { (m - 9, 1) };
    (era * 400 + year + carry, month, of_year - (153 * m + 2) / 5 + 1)
}

fn whole(text: &str, digits: std::ops::RangeInclusive<usize>) -> Option<i64> {
    let fits = digits.contains(&text.len()) && text.bytes().all(|b| b.is_ascii_digit());
    fits.then(|| text.parse().ok()).flatten()
}

/// A time of day `hh:mm[:ss[.f]]`, also with blanks in place of colons: since midnight \[ns\], and the unit of its
/// last digit \[s\].
pub(super) fn time_of_day(text: &str) -> Option<(i64, f64)> {
    let parts = text.trim().split([':', ' ']).filter(|p| !p.is_empty()).collect::<Vec<_>>();
    let (hour, minute, second) = match parts[..] {
        [h, m] => (h, m, "0"),
        [h, m, s] => (h, m, s),
        _ => return None,
    };
    let (hour, minute) = (whole(hour, 1..=2)?, whole(minute, 1..=2)?);
    let (second, fraction) = second.split_once('.').unwrap_or((second, ""));
    let second = whole(second, 1..=2)?;
    let leap = hour == 23 && minute == 59 && second == 60;
    if hour > 23 || minute > 59 || (second > 59 && !leap) {
        return None;
    }
    if !fraction.bytes().all(|b| b.is_ascii_digit()) {
        return None;
    }
    let digits = fraction.len().min(9);
    let fraction = fraction.get(..digits)?.parse::<i64>().unwrap_or(0);
    let ns = fraction * 10i64.pow(9 - digits as u32);
    let unit_s = if parts.len() == 2 { 60.0 } else { 10f64.powi(-(digits as i32)) };
    Some(((hour * 3600 + minute * 60 + second) * SECOND_NS + ns, unit_s))
}

/// A date, with or without a time of day: `2018-01-15T04:00:00.5`, `2018/01/15`, `15/01/98`, `15/01/2018`. Two
/// digits of the year are of the 20th century (FITS Standard), except 00 to 49, which programs of today still
/// write.
pub(super) fn date_time(text: &str) -> Option<Written> {
    let text = text.trim().trim_end_matches(['Z', 'z']);
    let (day_text, time) = match text.split_once(['T', 't', ' ', '_']) {
        Some((day, time)) => (day, Some(time)),
        None => (text, None),
    };
    let parts = day_text.split(['-', '/']).collect::<Vec<_>>();
    let &[first, second, third] = parts.as_slice() else { return None };
    let month = whole(second, 1..=2)?;
    let (year, day) = if first.len() == 4 {
        (whole(first, 4..=4)?, whole(third, 1..=2)?)
    } else {
        let year = match third.len() {
            4 => whole(third, 4..=4)?,
            _ => whole(third, 2..=2).map(|y| if y < 50 { 2000 + y } else { 1900 + y })?,
        };
        (year, whole(first, 1..=2)?)
    };
    let stamp = Stamp { day: mjd(year, month, day)?, ns: 0 };
    let Some(time) = time else { return Some(Written { stamp, unit_s: DAY_S as f64, day_only: true }) };
    let (ns, unit_s) = time_of_day(time)?;
    Some(Written { stamp: stamp.at(ns), unit_s, day_only: false })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn iso(text: &str) -> Option<String> {
        date_time(text).map(|w| w.stamp.to_string())
    }

    #[test]
    fn dates_old_and_new_are_read() {
        let is = |text: &str, want: &str| assert_eq!(iso(text).as_deref(), Some(want), "{text}");
        is("2018-07-04T14:03:03", "2018-07-04T14:03:03.000000000");
        is("2018-07-04t14:03:03.5Z", "2018-07-04T14:03:03.500000000");
        is(" 2019-04-29 20:25:29.8219583 ", "2019-04-29T20:25:29.821958300");
        is("2020-02-29T00:00", "2020-02-29T00:00:00.000000000");
        is("15/01/98", "1998-01-15T00:00:00.000000000");
        is("04/07/18", "2018-07-04T00:00:00.000000000");
        is("2016-12-31T23:59:60.25", "2016-12-31T23:59:60.250000000");
        is("2016-12-31T23:59:59.99999999999", "2016-12-31T23:59:59.999999999");
        for text in [
            "",
            "2018",
            "2018-13-01",
            "2019-02-29",
            "2018-01-15T24:00:00",
            "2018-01-15T12:60",
            "2018-01-15T12:00:60",
            "2018-01-15T12:00:00.x",
            "2018-01-15T12:00:00+02",
            "15/01/1",
            "1/2/3/4",
            "-1-1-1",
            "T",
        ] {
            assert_eq!(iso(text), None, "{text}");
        }
    }

    /// 1858-11-17 is day 0; 2000-01-01 is 51544, 2018-01-20 58138 (Standard's tables).
    #[test]
    fn days_are_counted_as_the_julian_date_does() {
        assert_eq!((mjd(1858, 11, 17), mjd(2000, 1, 1), mjd(2018, 1, 20)), (Some(0), Some(51_544), Some(58_138)));
        for day in (0..125_000).step_by(7) {
            let (y, m, d) = date(day);
            assert_eq!(mjd(y, m, d), Some(day));
        }
        let noon = Stamp::from_jd(2_458_139.0).map(|w| w.stamp.to_string());
        assert_eq!(noon.as_deref(), Some("2018-01-20T12:00:00.000000000"));
        assert_eq!(Stamp::from_mjd(f64::NAN), None);
        assert_eq!(Stamp::from_mjd(-1.0), None);
    }

    #[test]
    fn the_unit_of_the_last_digit_is_kept() {
        let unit = |text: &str| date_time(text).map(|w| w.unit_s);
        assert_eq!((unit("2018-01-15T04:00:00"), unit("2018-01-15T04:00:00.25")), (Some(1.0), Some(0.01)));
        let unit = |mjd: f64| Stamp::from_mjd(mjd).map_or(0.0, |w| w.unit_s);
        assert!((unit(58_134.166_67) - 0.864).abs() < 1e-9);
        // an exact half day is not good to a tenth of a day only
        assert!((unit(58_134.5) - 0.864).abs() < 1e-9);
        assert!(unit(58_134.166_672_345_6) < 1e-5);
    }
}
