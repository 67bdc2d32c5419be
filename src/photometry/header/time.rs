//! Mid-exposure, by the keywords of FITS Standard 4.0, sect. 9.5, and what programs wrote before it.
//!
//! In order of preference: DATE-AVG, MIDPOINT and MJD-AVG are the middle; DATE-BEG, DATE-OBS, MJD-BEG, MJD-OBS are
//! the start, DATE-END and MJD-END the end, MJD, JD and JULIAN the start again (SBFITSEXT 1.0). Times of the same
//! part of the exposure must agree to within [`AGREE_S`] and the last digits written; those of other parts, by the
//! exposure time, also to 1 % of that. DATE-LOC is local time and JD-HELIO not the observer's: neither is used.
//! Scales: UTC, TAI, TT, GPS, TDB and UT1 by TIMESYS; others are refused.

use super::clock::{self, Stamp, Written};
use super::dialect::TIME_OF_DAY;
use super::note::{Note, NoteKind};
use super::reader::Reader;

/// Times of one exposure may differ by this \[s\].
pub const AGREE_S: f64 = 0.1;

/// A scale of time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TimeScale {
    /// Coordinated Universal Time.
    Utc,
    /// International Atomic Time.
    Tai,
    /// Terrestrial Time.
    Tt,
    /// Time of the Global Positioning System.
    Gps,
    /// Barycentric Dynamical Time.
    Tdb,
    /// Universal Time of the Earth's rotation.
    Ut1,
}

impl TimeScale {
    /// Its usual abbreviation.
    pub fn name(self) -> &'static str {
        match self {
            Self::Utc => "UTC",
            Self::Tai => "TAI",
            Self::Tt => "TT",
            Self::Gps => "GPS",
            Self::Tdb => "TDB",
            Self::Ut1 => "UT1",
        }
    }

    /// By the values of TIMESYS (FITS Standard 4.0, sect. 9.2.1), what follows the name (`UTC(USNO)`, `UTC
    /// approximate`) left out.
    fn named(text: &str) -> Option<Self> {
        let name = text.trim().split(['(', ' ']).next().unwrap_or_default().to_ascii_uppercase();
        Some(match name.as_str() {
            "UTC" | "UT" | "GMT" | "Z" => Self::Utc,
            "TAI" | "IAT" => Self::Tai,
            "TT" | "TDT" | "ET" => Self::Tt,
            "GPS" => Self::Gps,
            "TDB" => Self::Tdb,
            "UT1" => Self::Ut1,
            _ => return None,
        })
    }
}

/// A moment: a reading of a clock and seconds after it.
#[derive(Debug, Clone, PartialEq)]
pub struct Epoch {
    /// ISO 8601 with nine decimals, no Z.
    pub iso: String,
    /// The scale that the clock shows.
    pub scale: TimeScale,
    /// To be added \[SI s\].
    pub plus_s: f64,
}

/// Where in the exposure a time lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Place {
    Middle,
    Start,
    End,
}

impl Place {
    /// From here to the middle \[s\].
    fn to_middle(self, exptime_s: f64) -> f64 {
        match self {
            Self::Middle => 0.0,
            Self::Start => exptime_s / 2.0,
            Self::End => -exptime_s / 2.0,
        }
    }
}

/// What kind of value a keyword has.
#[derive(Debug, Clone, Copy)]
enum Form {
    Date,
    Mjd,
    Jd,
}

#[rustfmt::skip]
const SOURCES: [(&str, Form, Place); 14] = [
    ("DATE-AVG", Form::Date, Place::Middle),
    ("MIDPOINT", Form::Date, Place::Middle),
    ("MJD-AVG", Form::Mjd, Place::Middle),
    ("MJD-MID", Form::Mjd, Place::Middle),
    ("DATE-BEG", Form::Date, Place::Start),
    ("DATE-OBS", Form::Date, Place::Start),
    ("MJD-BEG", Form::Mjd, Place::Start),
    ("MJD-OBS", Form::Mjd, Place::Start),
    ("DATE-END", Form::Date, Place::End),
    ("MJD-END", Form::Mjd, Place::End),
    ("MJD", Form::Mjd, Place::Start),
    ("JD", Form::Jd, Place::Start),
    ("JD-OBS", Form::Jd, Place::Start),
    ("JULIAN", Form::Jd, Place::Start),
];

/// A time that the header gives.
struct Candidate {
    keyword: &'static str,
    place: Place,
    written: Written,
}

/// Mid-exposure of an exposure of `exptime_s`, and years since 2000 for the Earth's axis; none: no usable time.
pub(super) fn mid_exposure(r: &mut Reader, exptime_s: Option<f64>) -> Option<(Epoch, f64)> {
    let length_s = exptime_s.unwrap_or(0.0);
    if let Some(text) = r.overrides.time_utc.clone() {
        let cards = vec![("--time".to_owned(), text.clone())];
        if let Some(start) = clock::date_time(&text).filter(|w| !w.day_only) {
            let what = format!("start of the exposure, in place of DATE-OBS = {}", r.shown("DATE-OBS"));
            r.notes.push(Note { kind: NoteKind::Overridden, cards, what });
            return Some(epoch(start.stamp, TimeScale::Utc, length_s / 2.0));
        }
        let what = "not of the form YYYY-MM-DDThh:mm:ss.f; the header counts".to_owned();
        r.notes.push(Note { kind: NoteKind::Refused, cards, what });
    }
    let scale = match r.text("TIMESYS") {
        None => TimeScale::Utc,
        Some(text) => match TimeScale::named(&text) {
            Some(scale) => scale,
            None => {
                r.note(NoteKind::Refused, &["TIMESYS"], "UTC, TAI, TT, GPS, TDB and UT1 are understood");
                return None;
            }
        },
    };
    let candidates = candidates(r);
    let Some(taken) = candidates.first() else {
        if r.text("DATE-LOC").is_some() {
            r.note(NoteKind::Ignored, &["DATE-LOC"], "local time of an unknown zone gives no instant");
        }
        return None;
    };
    let started = candidates.iter().any(|c| c.place == Place::Start);
    // an end is held against a start and the exposure time, if there is one
    for other in candidates.iter().filter(|c| !started || c.place != Place::End) {
        let same = candidates.iter().find(|c| c.place == other.place).filter(|c| c.keyword != other.keyword);
        let reference = same.unwrap_or(taken);
        if reference.keyword != other.keyword {
            compare(r, [reference, other], length_s, taken.keyword);
        }
    }
    duration(r, &candidates, exptime_s);
    doubts(r, taken);
    Some(epoch(taken.written.stamp, scale, taken.place.to_middle(length_s)))
}

fn epoch(stamp: Stamp, scale: TimeScale, plus_s: f64) -> (Epoch, f64) {
    (Epoch { iso: stamp.to_string(), scale, plus_s }, stamp.years_since_2000())
}

fn candidates(r: &mut Reader) -> Vec<Candidate> {
    let mut found = Vec::new();
    for (keyword, form, place) in SOURCES {
        let written = match form {
            Form::Date => date(r, keyword),
            Form::Mjd => r.number(keyword).and_then(Stamp::from_mjd),
            Form::Jd => r.number(keyword).and_then(Stamp::from_jd),
        };
        found.extend(written.map(|written| Candidate { keyword, place, written }));
    }
    found
}

/// A date; one without a time of day is completed by the keywords that have it.
fn date(r: &mut Reader, keyword: &'static str) -> Option<Written> {
    let text = r.text(keyword)?;
    let Some(written) = clock::date_time(&text) else {
        // MIDPOINT is a time of day in some versions of the program that writes it
        let kind = if keyword == "MIDPOINT" { NoteKind::Ignored } else { NoteKind::Refused };
        r.note(kind, &[keyword], "no date of the form YYYY-MM-DDThh:mm:ss.f or DD/MM/YY");
        return None;
    };
    let clocks = TIME_OF_DAY.iter().filter_map(|k| {
        let text = r.text(k)?;
        let time = text.split_once(['T', 't']).map_or(text.as_str(), |(_, time)| time);
        Some((*k, clock::time_of_day(time.trim_end_matches(['Z', 'z']))?))
    });
    let other = (keyword == "DATE-OBS").then(|| clocks.into_iter().next()).flatten();
    match other {
        Some((_, (ns, unit_s))) if written.day_only => {
            Some(Written { stamp: written.stamp.at(ns), unit_s, day_only: false })
        }
        Some((clock_keyword, (ns, unit_s))) => {
            let apart = (ns - written.stamp.ns()).abs() as f64 * 1e-9;
            if apart > AGREE_S + unit_s + written.unit_s {
                let what = format!("{apart:.3} s apart; DATE-OBS is taken");
                r.note(NoteKind::Contradictory, &[keyword, clock_keyword], what);
            }
            Some(written)
        }
        None if written.day_only => {
            r.note(NoteKind::Refused, &[keyword], "a day without a time, and neither TIME-OBS nor UT gives it");
            None
        }
        None => Some(written),
    }
}

/// Hold two times of an exposure against each other; `taken` is the keyword that counts.
fn compare(r: &mut Reader, [a, b]: [&Candidate; 2], length_s: f64, taken: &str) {
    let middle = |c: &Candidate| c.place.to_middle(length_s);
    let apart = b.written.stamp.since(&a.written.stamp) + middle(b) - middle(a);
    // shutter and readout blur where an exposure starts and ends
    let length = if a.place == b.place { 0.0 } else { 0.01 * length_s };
    let tolerance = AGREE_S + a.written.unit_s + b.written.unit_s + length;
    if apart.abs() <= tolerance {
        return;
    }
    let half = (apart.abs() - length_s / 2.0).abs() <= tolerance && length_s > 2.0 * tolerance;
    let hint = if half { ", half an exposure: one of them may be meant for another part of it" } else { "" };
    let what = format!("mid-exposures {apart:.3} s apart{hint}; {taken} is taken");
    r.note(NoteKind::Contradictory, &[a.keyword, b.keyword], what);
}

/// The exposure's length against its start and end.
fn duration(r: &mut Reader, candidates: &[Candidate], exptime_s: Option<f64>) {
    let first = |place: Place| candidates.iter().find(|c| c.place == place);
    let (Some(length_s), Some(start), Some(end)) = (exptime_s, first(Place::Start), first(Place::End)) else {
        return;
    };
    let between = end.written.stamp.since(&start.written.stamp);
    let tolerance = AGREE_S + start.written.unit_s + end.written.unit_s + 0.01 * length_s;
    if (between - length_s).abs() > tolerance {
        let what = format!("{between:.3} s between them, exposure time {length_s} s; the exposure time is taken");
        r.note(NoteKind::Contradictory, &[start.keyword, end.keyword], what);
    }
}

/// What is known of programs that give another part of the exposure than the keyword says.
fn doubts(r: &mut Reader, taken: &Candidate) {
    if taken.keyword != "DATE-OBS" {
        return;
    }
    let name = r.program.map_or("", |p| p.name);
    let maxim = r.text("SWCREATE").and_then(|text| {
        let version = text.split_once("Version ")?.1.split_whitespace().next()?.to_owned();
        version.parse::<f64>().ok()
    });
    let doubt = match name {
        "SharpCap" => "taken as the start; older versions of SharpCap wrote when the frame arrived",
        "MaxIm DL" if maxim.is_some_and(|v| v >= 6.24) => {
            "taken as the start; MaxIm DL from 6.24 on writes mid-exposure for some cameras"
        }
        _ => return,
    };
    r.note(NoteKind::Assumed, &["DATE-OBS"], doubt);
}
