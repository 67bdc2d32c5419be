//! Light curves in the Asteroid Lightcurve Data Exchange Format (ALCDEF standard 2.0, 2014; Warner, Stephens & Harris
//! 2011, Minor Planet Bulletin 38, 172; alcdef.org).
//!
//! A file is blocks, one a target, night and filter: metadata `KEYWORD=value` between STARTMETADATA and ENDMETADATA,
//! then `DATA=JD|MAG|MAGERR|AIRMASS` up to ENDDATA. JD is UTC at mid-exposure.
//!
//! The format is made for asteroids. A satellite has no number, so `OBJECTNUMBER=0`, and its name stands in OBJECTNAME
//! and MPCDESIG. Of the light-time keywords only those that say "not corrected" are true (`LTCAPP=NONE`,
//! `LTCTYPE=NONE`, `LTCDAYS=0`), and `REDUCEDMAGS=NONE`: magnitudes are as seen, at the range of the time. PHASE, PABL
//! and PABB are one value a session and are left out: a satellite's phase angle changes within minutes. Vectors to the
//! Sun and the observer and fluxes at or below zero have no place in this format.

use crate::astro::time::Instant;
use std::fmt::Write;

/// A measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Middle of the exposure.
    pub time: Instant,
    /// Magnitude.
    pub mag: f64,
    /// Its standard error \[mag\]; NaN if unknown.
    pub mag_err: f64,
    /// Airmass; NaN if unknown.
    pub airmass: f64,
}

/// The measurements of a target in a night and a filter.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Session {
    /// Keywords and values of the metadata, in the file's order; a keyword may occur more than once.
    pub metadata: Vec<(String, String)>,
    /// The measurements.
    pub samples: Vec<Sample>,
}

impl Session {
    /// The first value of a keyword, if it is not empty.
    pub fn get(&self, keyword: &str) -> Option<&str> {
        self.metadata.iter().find(|(k, v)| k == keyword && !v.is_empty()).map(|(_, v)| v.as_str())
    }

    /// Name of the object: OBJECTNAME, else MPCDESIG, else OBJECTNUMBER.
    pub fn object(&self) -> &str {
        ["OBJECTNAME", "MPCDESIG", "OBJECTNUMBER"].into_iter().find_map(|k| self.get(k)).unwrap_or("")
    }
}

/// What is the same in every block of a file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct About {
    /// Who to ask.
    pub contact_name: String,
    /// Where to ask.
    pub contact_info: String,
    /// Who observed.
    pub observers: String,
    /// The observatory.
    pub facility: String,
    /// East longitude and geodetic latitude of the station \[deg\], if known.
    pub place_deg: Option<(f64, f64)>,
    /// The filter, as in FILTER.
    pub filter: String,
    /// The band of the magnitudes, as in MAGBAND.
    pub band: String,
    /// Remarks.
    pub comments: Vec<String>,
}

/// Why a file cannot be written or read.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum AlcdefError {
    /// No sample has a finite magnitude.
    #[error("there is nothing to write: a block needs one finite magnitude")]
    Empty,
    /// A line that cannot be read.
    #[error("line {line}: {text:?}: {fault}")]
    Line {
        /// Number of the line, from 1.
        line: usize,
        /// The line.
        text: String,
        /// What is wrong, and what is allowed.
        fault: String,
    },
}

/// Longest time between the samples of a session \[s\]: half a day parts nights.
const NIGHT_S: f64 = 43_200.0;

/// The file of these targets, each a name and its samples in any order: a block a target and night. Samples without a
/// finite magnitude are left out.
///
/// # Errors
/// [`AlcdefError::Empty`] if no sample has a magnitude.
pub fn to_alcdef(about: &About, targets: &[(String, Vec<Sample>)]) -> Result<String, AlcdefError> {
    let mut text = String::new();
    for (name, samples) in targets {
        let mut known = samples.iter().filter(|s| s.mag.is_finite()).copied().collect::<Vec<_>>();
        known.sort_by_key(|s| s.time);
        for night in known.chunk_by(|a, b| b.time.since(&a.time) < NIGHT_S) {
            block(&mut text, about, name, night);
        }
    }
    if text.is_empty() { Err(AlcdefError::Empty) } else { Ok(text) }
}

fn block(text: &mut String, about: &About, name: &str, night: &[Sample]) {
    let (Some(first), Some(last)) = (night.first(), night.last()) else { return };
    // the standard asks for the middle of the session
    let middle = first.time.plus(last.time.since(&first.time) / 2.0).utc_reading().iso(0);
    let (date, time) = middle.split_once('T').unwrap_or((&middle, ""));
    let place = about.place_deg.map(|(east, north)| (format!("{east:+.5}"), format!("{north:+.5}")));
    let (longitude, latitude) = place.unwrap_or_default();
    let pairs = [
        ("REVISEDDATA", "FALSE"),
        ("OBJECTNUMBER", "0"),
        ("OBJECTNAME", name),
        ("MPCDESIG", name),
        ("SESSIONDATE", date),
        ("SESSIONTIME", time),
        ("CONTACTNAME", &about.contact_name),
        ("CONTACTINFO", &about.contact_info),
        ("OBSERVERS", &about.observers),
        ("FACILITY", &about.facility),
        ("OBSLONGITUDE", &longitude),
        ("OBSLATITUDE", &latitude),
        ("EXPJD", "MID"),
        ("FILTER", &about.filter),
        ("MAGBAND", &about.band),
        ("DIFFERMAGS", "FALSE"),
        ("STANDARD", "INTERNAL"),
        ("LTCTYPE", "NONE"),
        ("LTCDAYS", "0"),
        ("LTCAPP", "NONE"),
        ("REDUCEDMAGS", "NONE"),
    ];
    text.push_str("STARTMETADATA\n");
    for (keyword, value) in pairs.into_iter().filter(|(k, _)| place_known(about, k)) {
        let _ = writeln!(text, "{keyword}={}", one_line(value));
    }
    for comment in &about.comments {
        let _ = writeln!(text, "COMMENT={}", one_line(comment));
    }
    text.push_str("DELIMITER=PIPE\nENDMETADATA\n");
    let airmass = night.iter().any(|s| s.airmass.is_finite());
    for sample in night {
        let column = |v: f64| if v.is_finite() { format!("{v:.6}") } else { String::new() };
        let _ = write!(text, "DATA={}|{:.6}|{}", jd_text(&sample.time), sample.mag, column(sample.mag_err));
        let _ = if airmass { writeln!(text, "|{}", column(sample.airmass)) } else { writeln!(text) };
    }
    text.push_str("ENDDATA\n");
}

fn place_known(about: &About, keyword: &str) -> bool {
    about.place_deg.is_some() || !matches!(keyword, "OBSLONGITUDE" | "OBSLATITUDE")
}

/// Printable ASCII on one line, as the format asks.
fn one_line(text: &str) -> String {
    text.trim().chars().map(|c| if (' '..='~').contains(&c) { c } else { '?' }).collect()
}

/// Julian date on UTC with eleven decimals, a microsecond.
fn jd_text(time: &Instant) -> String {
    let reading = time.utc_reading();
    let e11 =
        (i128::from(reading.ns) * 10i128.pow(11) + i128::from(reading.day_ns) / 2) / i128::from(reading.day_ns);
    let sum = (i128::from(reading.mjd) * 10 + 24_000_005) * 10i128.pow(10) + e11;
    format!("{}.{:011}", sum.div_euclid(10i128.pow(11)), sum.rem_euclid(10i128.pow(11)))
}

/// The blocks of a file. Keywords may be in angle brackets and in any case.
///
/// # Errors
/// [`AlcdefError::Line`] with the number of the first line that cannot be read: an unknown structure, a number that is
/// none, a Julian date outside the years 1709 to 2291, a block without name, session date, filter or end.
pub fn parse_alcdef(text: &str) -> Result<Vec<Session>, AlcdefError> {
    let mut sessions: Vec<Session> = Vec::new();
    let mut part = Part::Outside;
    let mut delimiter = '|';
    let mut last = (0, "");
    for (number, line) in text.lines().enumerate().map(|(k, l)| (k + 1, l.trim())).filter(|(_, l)| !l.is_empty()) {
        last = (number, line);
        let fault =
            |fault: &str| Err(AlcdefError::Line { line: number, text: line.to_owned(), fault: fault.to_owned() });
        let (keyword, value) = line.split_once('=').unwrap_or((line, ""));
        let keyword = keyword.trim().trim_matches(['<', '>']).to_ascii_uppercase();
        match (part, keyword.as_str()) {
            (Part::Outside, "STARTMETADATA") => {
                sessions.push(Session::default());
                (part, delimiter) = (Part::Metadata, '|');
            }
            (Part::Outside, _) => return fault("a block starts with STARTMETADATA"),
            (Part::Metadata, "ENDMETADATA") => {
                let session = sessions.last();
                let lacks = |k: &str| session.is_none_or(|s| s.get(k).is_none());
                if session.is_none_or(|s| s.object().is_empty()) {
                    return fault("the block names no object: OBJECTNAME, MPCDESIG or OBJECTNUMBER");
                }
                if let Some(missing) = ["SESSIONDATE", "FILTER"].into_iter().find(|k| lacks(k)) {
                    return fault(&format!("the block has no {missing}"));
                }
                part = Part::Data;
            }
            (Part::Metadata, "DELIMITER") => match value.trim().to_ascii_uppercase().as_str() {
                "PIPE" => delimiter = '|',
                "TAB" => delimiter = '\t',
                _ => return fault("a delimiter is PIPE or TAB"),
            },
            (Part::Metadata, "STARTMETADATA" | "DATA" | "ENDDATA") => {
                return fault("ENDMETADATA is missing before");
            }
            (Part::Metadata, _) if !line.contains('=') => return fault("a line is KEYWORD=value"),
            (Part::Metadata, _) => {
                let pair = (keyword, value.trim().to_owned());
                sessions.last_mut().into_iter().for_each(|s| s.metadata.push(pair.clone()));
            }
            (Part::Data, "DATA") => match sample(value, delimiter) {
                Ok(sample) => sessions.last_mut().into_iter().for_each(|s| s.samples.push(sample)),
                Err(why) => return fault(&why),
            },
            (Part::Data, "ENDDATA") => part = Part::Outside,
            (Part::Data, _) => return fault("between ENDMETADATA and ENDDATA stand only lines DATA="),
        }
    }
    if part != Part::Outside || sessions.is_empty() {
        let fault = "the file ends before ENDDATA of its last block".to_owned();
        return Err(AlcdefError::Line { line: last.0, text: last.1.to_owned(), fault });
    }
    Ok(sessions)
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Part {
    Outside,
    Metadata,
    Data,
}

fn sample(value: &str, delimiter: char) -> Result<Sample, String> {
    let cells = value.split(delimiter).map(str::trim).collect::<Vec<_>>();
    if !(2..=4).contains(&cells.len()) {
        return Err(format!("{} values; JD, MAG and perhaps MAGERR and AIRMASS are allowed", cells.len()));
    }
    let cell = |place: usize, name: &str, empty: bool| {
        let text = cells.get(place).copied().unwrap_or("");
        if text.is_empty() && empty {
            return Ok(f64::NAN);
        }
        text.parse::<f64>().ok().filter(|v| v.is_finite()).ok_or_else(|| format!("{name} {text:?} is no number"))
    };
    let jd = cells.first().copied().unwrap_or("");
    let time = Instant::parse(&format!("JD {jd}")).map_err(|e| e.to_string())?;
    Ok(Sample {
        time,
        mag: cell(1, "MAG", false)?,
        mag_err: cell(2, "MAGERR", true)?,
        airmass: cell(3, "AIRMASS", true)?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(seconds: f64, mag: f64) -> Sample {
        let time = Instant::from_utc("2024-05-06T22:00:00").unwrap().plus(seconds);
        Sample { time, mag, mag_err: 0.01, airmass: 1.5 }
    }

    fn about() -> About {
        About { filter: "C".into(), band: "V".into(), place_deg: Some((-105.5, 32.9)), ..Default::default() }
    }

    #[test]
    fn blocks_are_nights_of_targets_and_read_back_to_a_microsecond() {
        let bare = Sample { mag_err: f64::NAN, airmass: f64::NAN, ..at(2.5, 12.25) };
        let night = vec![at(7_200.123_456, 11.0), at(0.0, 10.0), bare, at(3.0, f64::NAN), at(86_400.0, 9.5)];
        let text = to_alcdef(&about(), &[("GOES 14".into(), night), ("Ñu".into(), vec![at(1.0, 8.0)])]).unwrap();
        let sessions = parse_alcdef(&text).unwrap();
        assert_eq!(sessions.iter().map(|s| s.samples.len()).collect::<Vec<_>>(), [3, 1, 1]);
        let said = ["OBJECTNUMBER", "OBJECTNAME", "SESSIONDATE", "SESSIONTIME", "LTCAPP", "OBSLONGITUDE"];
        let said = said.map(|k| sessions[0].get(k).unwrap_or(""));
        // the middle between 22:00 and 24:00
        assert_eq!(said, ["0", "GOES 14", "2024-05-06", "23:00:00", "NONE", "-105.50000"]);
        assert_eq!(sessions[2].object(), "?u");
        let [first, second, third] = [0, 1, 2].map(|k| sessions[0].samples[k]);
        assert_eq!((first.mag, first.mag_err, first.airmass), (10.0, 0.01, 1.5));
        assert!(second.mag_err.is_nan() && second.airmass.is_nan());
        // eleven decimals of a day are 0.9 microseconds
        assert!(third.time.since(&at(7_200.123_456, 0.0).time).abs() < 0.9e-6);
        assert_eq!(to_alcdef(&about(), &[]), Err(AlcdefError::Empty));
    }

    #[test]
    fn a_known_julian_date() {
        let noon = Instant::from_utc("2000-01-01T12:00:00").unwrap();
        assert_eq!(jd_text(&noon), "2451545.00000000000");
        assert_eq!(jd_text(&noon.plus(43_200.0)), "2451545.50000000000");
        assert_eq!(jd_text(&noon.plus(43_199.999_999_9)), "2451545.50000000000");
    }

    #[test]
    fn tabs_brackets_and_small_letters_are_read() {
        let text = "<StartMetadata>\nObjectName=X\nMPCDESIG=\nSESSIONDATE=2020-01-02\nFILTER=R\nCOMMENT=a=b\n\
                    COMMENT=c\nDELIMITER=TAB\n<EndMetadata>\n\nDATA=2458850.5\t+12.5\t0.1\n<EndData>\n";
        let sessions = parse_alcdef(text).unwrap();
        assert_eq!((sessions[0].object(), sessions[0].get("COMMENT")), ("X", Some("a=b")));
        assert_eq!(sessions[0].samples[0].time, Instant::from_utc("2020-01-02T00:00:00").unwrap());
        assert_eq!(sessions[0].samples[0].mag, 12.5);
    }

    #[test]
    fn what_cannot_be_read_is_refused_with_its_line() {
        let good = [
            "STARTMETADATA",
            "OBJECTNAME=X",
            "SESSIONDATE=2020-01-02",
            "FILTER=R",
            "DELIMITER=PIPE",
            "ENDMETADATA",
            "DATA=2458850.5|12|0.1",
            "ENDDATA",
        ];
        assert!(parse_alcdef(&good.join("\n")).is_ok());
        let cases = [
            (0, "OBJECTNAME=Y", 1, "STARTMETADATA"),
            (1, "X", 2, "KEYWORD=value"),
            (1, "OBJECTNAME=", 6, "no object"),
            (2, "COMMENT=", 6, "SESSIONDATE"),
            (4, "DELIMITER=COMMA", 5, "PIPE or TAB"),
            (5, "DATA=1|2", 6, "ENDMETADATA"),
            (6, "DATA=2458850.5|12|0.1|1|2", 7, "5 values"),
            (6, "DATA=2458850.5|twelve", 7, "\"twelve\""),
            (6, "DATA=2458850.5|nan", 7, "\"nan\""),
            (6, "DATA=1e9|12", 7, "1e9"),
            (6, "DATA=|12", 7, "Julian date"),
            (6, "FILTER=V", 7, "DATA="),
            (7, "", 7, "ENDDATA"),
        ];
        for (place, instead, line, words) in cases {
            let mut lines = good;
            lines[place] = instead;
            let Err(AlcdefError::Line { line: found, fault, .. }) = parse_alcdef(&lines.join("\n")) else {
                panic!("{instead}");
            };
            assert_eq!(found, line, "{instead}");
            assert!(fault.contains(words), "{instead}: {fault}");
        }
        assert!(parse_alcdef("").is_err());
    }
}
