//! Writing of Tracking Data Messages.

use super::fault::TdmError;
use crate::astro::time::Instant;
use std::fmt::Write;

/// Longest value or piece of a comment that is written \[characters\]; leaves room for the longest keyword.
const LONGEST_TEXT: usize = 200;

/// What a message says first.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Header {
    /// Comments.
    pub comments: Vec<String>,
    /// When the data was made; the time of the last observation if none is given.
    pub creation: Option<Instant>,
    /// Who made it; best an abbreviation from SANA's registry of organizations.
    pub originator: String,
    /// What tells this message from the originator's others, if anything does.
    pub message_id: Option<String>,
}

/// A measurement of one exposure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observation {
    /// Middle of the exposure.
    pub time: Instant,
    /// Astrometric right ascension, ICRS \[deg\], any turn; NaN if unknown.
    pub ra_deg: f64,
    /// Astrometric declination, ICRS \[deg\], -90 to 90; NaN if unknown.
    pub dec_deg: f64,
    /// V outside the atmosphere \[mag\]; NaN if unknown.
    pub mag: f64,
}

/// The measurements of a target from a station.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Track {
    /// Name of the station.
    pub station: String,
    /// Name, COSPAR or catalogue number of the target.
    pub target: String,
    /// Comments.
    pub comments: Vec<String>,
    /// The measurements, in any order.
    pub observations: Vec<Observation>,
}

/// The message of these tracks. Observations without any finite number are left out, then tracks without observations.
///
/// Names and comments may hold only printable ASCII: any other character is written as `?`, and a name without
/// characters as UNKNOWN.
///
/// # Errors
/// [`TdmError::Empty`] if nothing is left, [`TdmError::Range`] for a declination or a magnitude out of range,
/// [`TdmError::Repeated`] if a track has two observations in one microsecond.
pub fn to_tdm(header: &Header, tracks: &[Track]) -> Result<String, TdmError> {
    let written = tracks.iter().map(track).collect::<Result<Vec<_>, _>>()?;
    let written = written.into_iter().flatten().collect::<Vec<_>>();
    let last = written.iter().map(|(_, last)| *last).max().ok_or(TdmError::Empty)?;
    let mut text = String::from("CCSDS_TDM_VERS = 2.0\n");
    comments(&mut text, &header.comments);
    pair(&mut text, "CREATION_DATE", &header.creation.unwrap_or(last).iso_utc());
    pair(&mut text, "ORIGINATOR", &value(&header.originator));
    if let Some(id) = &header.message_id {
        pair(&mut text, "MESSAGE_ID", &value(id));
    }
    for (segment, _) in written {
        text.push('\n');
        text.push_str(&segment);
    }
    Ok(text)
}

/// The segment of a track and its last time; none if nothing is known.
fn track(track: &Track) -> Result<Option<(String, Instant)>, TdmError> {
    let placed = |o: &Observation| o.ra_deg.is_finite() && o.dec_deg.is_finite();
    let bright = |o: &Observation| o.mag.is_finite();
    let known = track.observations.iter().filter(|o| placed(o) || bright(o));
    let mut known = known.copied().collect::<Vec<_>>();
    known.sort_by_key(|o| o.time);
    let (Some(first), Some(last)) = (known.first(), known.last()) else { return Ok(None) };
    if let Some(pair) = known.windows(2).find(|w| w[0].time.iso_utc() == w[1].time.iso_utc()) {
        return Err(TdmError::Repeated { target: track.target.clone(), time: pair[0].time.iso_utc() });
    }
    let (angles, mags) = (known.iter().any(placed), known.iter().any(bright));
    let mut text = String::from("META_START\n");
    if angles {
        comments(
            &mut text,
            &["Angles are astrometric places among catalogue stars: free of annual and diurnal \
                               aberration and of refraction"],
        );
    }
    comments(&mut text, &["Timetags are the middle of the exposure"]);
    comments(&mut text, &track.comments);
    let types = [(angles, "ANGLE_1,ANGLE_2"), (mags, "MAG")];
    let types = types.iter().filter(|(there, _)| *there).map(|(_, name)| *name).collect::<Vec<_>>();
    pair(&mut text, "DATA_TYPES", &types.join(","));
    pair(&mut text, "TIME_SYSTEM", "UTC");
    pair(&mut text, "START_TIME", &first.time.iso_utc());
    pair(&mut text, "STOP_TIME", &last.time.iso_utc());
    pair(&mut text, "PARTICIPANT_1", &value(&track.station));
    pair(&mut text, "PARTICIPANT_2", &value(&track.target));
    pair(&mut text, "MODE", "SEQUENTIAL");
    pair(&mut text, "PATH", "2,1");
    if angles {
        pair(&mut text, "ANGLE_TYPE", "RADEC");
        pair(&mut text, "REFERENCE_FRAME", "ICRF");
    }
    text.push_str("META_STOP\nDATA_START\n");
    for o in &known {
        let time = o.time.iso_utc();
        let checked = |keyword, value: f64, low, high| {
            let inside = (low..=high).contains(&value);
            let fault =
                || TdmError::Range { keyword, target: track.target.clone(), time: time.clone(), value, low, high };
            inside.then(|| fixed(value)).ok_or_else(fault)
        };
        if placed(o) {
            let dec = checked("ANGLE_2", o.dec_deg, -90.0, 90.0)?;
            pair(&mut text, "ANGLE_1", &format!("{time} {}", right_ascension(o.ra_deg)));
            pair(&mut text, "ANGLE_2", &format!("{time} {dec}"));
        }
        if bright(o) {
            pair(&mut text, "MAG", &format!("{time} {}", checked("MAG", o.mag, -999.0, 999.0)?));
        }
    }
    text.push_str("DATA_STOP\n");
    Ok(Some((text, last.time)))
}

fn pair(text: &mut String, keyword: &str, value: &str) {
    let _ = writeln!(text, "{keyword} = {value}");
}

fn comments(text: &mut String, lines: &[impl AsRef<str>]) {
    for line in lines.iter().flat_map(|l| l.as_ref().lines()) {
        let characters = printable(line).chars().collect::<Vec<_>>();
        for piece in characters.chunks(LONGEST_TEXT) {
            let _ = writeln!(text, "COMMENT {}", piece.iter().collect::<String>());
        }
    }
}

fn printable(text: &str) -> String {
    text.chars().map(|c| if (' '..='~').contains(&c) { c } else { '?' }).collect()
}

/// A name as a value: printable, neither empty nor too long.
fn value(text: &str) -> String {
    let short = printable(text).trim().chars().take(LONGEST_TEXT).collect::<String>();
    let short = short.trim_end();
    if short.is_empty() { "UNKNOWN".to_owned() } else { short.to_owned() }
}

/// A number below 1000 in size with at least one and at most twelve decimals, never -0.
fn fixed(value: f64) -> String {
    let long = format!("{value:.12}");
    let short = long.trim_end_matches('0');
    let short = if short.ends_with('.') { format!("{short}0") } else { short.to_owned() };
    if short == "-0.0" { "0.0".to_owned() } else { short }
}

/// A right ascension in \[0, 360) \[deg\], also after rounding.
fn right_ascension(ra_deg: f64) -> String {
    let text = fixed(ra_deg.rem_euclid(360.0));
    if text == "360.0" { "0.0".to_owned() } else { text }
}
