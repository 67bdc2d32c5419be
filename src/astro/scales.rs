//! Time scales, and epochs as people write them.
//!
//! TT = TAI + 32.184 s; GPS = TAI - 19 s; UTC with its leap seconds, and its rates before 1972; UT1 from the IERS table
//! ([`super::eop`]); TDB differs from TT by less than 2 ms (Fairhead & Bretagnon 1990, A&A 229, 240, as SOFA's `dtdb`
//! sums it) and is told apart only where somebody asks: the Earth moves 50 m in that time, 0.3 microarcseconds for a
//! satellite's place among the stars.

use super::time::{DAY_NS, Instant, Reading, SECOND_NS, TT_NS, seconds_ns, utc_day_ns};
use super::{Error, eop};

/// GPS - TAI \[ns\].
const GPS_NS: i64 = -19 * SECOND_NS;

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

impl Instant {
    /// The instant at which a clock on `scale` shows the day `mjd` and `ns` since its midnight.
    ///
    /// # Errors
    /// [`Error::EpochOutsideTable`] for UT1 where the Earth's rotation is unknown.
    pub fn from_reading(mjd: i64, ns: i64, scale: Scale) -> Result<Self, Error> {
        let with = |offset_ns| Self::from_shifted(mjd, ns, offset_ns);
        Ok(match scale {
            Scale::Tai => with(0),
            Scale::Tt => with(TT_NS),
            Scale::Gps => with(GPS_NS),
            Scale::Utc => Self::from_utc_reading(mjd, ns),
            Scale::Tdb => with(TT_NS + seconds_ns(with(TT_NS).tdb_minus_tt())),
            Scale::Ut1 => {
                // UT1 - TAI changes by less than 1 ns in the 40 s or so by which the first guess is off
                let first = with(seconds_ns(eop::at(&with(0))?.ut1_minus_tai));
                with(seconds_ns(eop::at(&first)?.ut1_minus_tai))
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
            Scale::Tdb => self.shifted(TT_NS + seconds_ns(self.tdb_minus_tt())),
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
}

/// Reading what people write.
impl Instant {
    /// The instant of an ISO 8601 date and time in UTC, with or without Z.
    ///
    /// # Errors
    /// The text, if it is no such date.
    pub fn from_utc(text: &str) -> Result<Self, String> {
        Self::from_iso(text.trim().trim_end_matches(['Z', 'z']), Scale::Utc)
            .map_err(|why| format!("{text:?} is no UTC date: {why}"))
    }

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
        let whole_ns = i64::from(hour * 3600 + minute * 60 + second) * SECOND_NS;
        let ns = whole_ns + (tenths + 5) / 10;
        let day_ns = if scale == Scale::Utc { utc_day_ns(mjd) } else { DAY_NS };
        let last_minute = hour == 23 && minute == 59;
        let second_exists = second < 60 || (last_minute && whole_ns < day_ns);
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
    let length = i128::from(if scale == Scale::Utc { utc_day_ns(mjd) } else { DAY_NS });
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
        for (scale, iso) in
            [(Scale::Tai, "12:00:37.000"), (Scale::Tt, "12:01:09.184"), (Scale::Gps, "12:00:18.000")]
        {
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
    }

    #[test]
    fn epochs_as_people_write_them() {
        let noon = at("2018-01-20T12:00:00Z");
        for text in
            ["2018-01-20 12:00 UTC", "MJD 58138.5", "jd2458139.0", "2458139", "58138.5", "2018-020T12:00:00"]
        {
            assert_eq!(at(text), noon, "{text}");
        }
        for text in [
            "",
            "no date",
            "2018-02-30",
            "2018-01-20T24:00:00",
            "2018-01-20T12:00:00Z TT",
            "MJD x",
            "1e400",
            "2018-01-20T12:00:00+01:00",
            "9999-01-01",
            "JD 99999999999999999999",
            "2018-366T00:00:00",
            "2018-01-20T1é:00",
        ] {
            let message = Instant::parse(text).expect_err(text).to_string();
            assert!(message.contains(text), "{message}");
        }
    }
}
