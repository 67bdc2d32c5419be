//! Reading CCSDS Tracking Data Messages in keyword-value notation, strictly by CCSDS 503.0-B-2.
//!
//! What is refused beyond the standard: time systems other than UTC, which the standard asks of ground stations.
//! Optional keywords may be absent. Times are read to the nanosecond.

use super::fault::{LONGEST_LINE, TdmError};
use super::keywords::{DATA, Form, HEADER, METADATA, is, number};
use crate::astro::time::Instant;

/// A measurement of a segment.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// What was measured: a keyword of table 3-5.
    pub keyword: String,
    /// Timetag.
    pub time: Instant,
    /// The value, in the unit of the keyword.
    pub value: f64,
}

/// A segment of a message.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Segment {
    /// Comments of the metadata, then of the data.
    pub comments: Vec<String>,
    /// Keywords and values of the metadata, in the file's order.
    pub metadata: Vec<(String, String)>,
    /// The measurements, in the file's order.
    pub records: Vec<Record>,
}

impl Segment {
    /// Value of a keyword of the metadata.
    pub fn get(&self, keyword: &str) -> Option<&str> {
        self.metadata.iter().find(|(k, _)| k == keyword).map(|(_, v)| v.as_str())
    }
}

/// Where a line stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Part {
    Header,
    Metadata,
    /// Between META_STOP and DATA_START.
    Gap,
    Data,
    /// After DATA_STOP.
    After,
}

/// A line of the file: number from 1, text without blanks around.
#[derive(Clone, Copy)]
struct Line<'a> {
    number: usize,
    text: &'a str,
}

impl Line<'_> {
    fn fault<T>(&self, section: &'static str, fault: impl Into<String>) -> Result<T, TdmError> {
        Err(TdmError::Line { line: self.number, text: self.text.to_owned(), fault: fault.into(), section })
    }
}

/// The segments of a message.
///
/// # Errors
/// [`TdmError::Line`] with the number of the first line that breaks the grammar, what is wrong and the section.
pub fn parse_tdm(text: &str) -> Result<Vec<Segment>, TdmError> {
    let mut reader = Reader { part: Part::Header, header: Vec::new(), order: 0, segments: Vec::new() };
    let mut last = Line { number: 1, text: "" };
    for (number, line) in lines(text) {
        last = Line { number, text: line.trim_matches(' ') };
        if let Some(c) = line.chars().find(|c| !(' '..='~').contains(c)) {
            return last.fault("4.2.1", format!("{c:?} is neither a printable ASCII character nor a blank"));
        }
        if line.len() > LONGEST_LINE {
            return last.fault("4.2.1", format!("{} characters; at most {LONGEST_LINE} are allowed", line.len()));
        }
        if !last.text.is_empty() {
            reader.line(last)?;
        }
    }
    if !text.is_empty() && !text.ends_with(['\n', '\r']) {
        return last.fault("4.2.11", "the last line has no end");
    }
    if reader.part != Part::After {
        return last.fault("3.1.3", "the message ends before DATA_STOP of its last segment");
    }
    Ok(reader.segments)
}

/// Lines and their numbers; they end with CR, LF, CR LF or LF CR.
fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut rest = text;
    let mut number = 0;
    std::iter::from_fn(move || {
        if rest.is_empty() {
            return None;
        }
        number += 1;
        let end = rest.find(['\n', '\r']).unwrap_or(rest.len());
        let (line, tail) = rest.split_at(end);
        let pair = tail.starts_with("\r\n") || tail.starts_with("\n\r");
        rest = tail.get(if pair { 2 } else { 1 }..).unwrap_or("");
        Some((number, line))
    })
}

struct Reader {
    part: Part,
    /// Keywords of the header so far.
    header: Vec<String>,
    /// Place in its table of the latest keyword of this section, counted from 1.
    order: usize,
    segments: Vec<Segment>,
}

impl Reader {
    fn line(&mut self, line: Line) -> Result<(), TdmError> {
        if self.header.is_empty() && !line.text.starts_with("CCSDS_TDM_VERS") {
            return line.fault("3.2.1", "the first line that is not blank must be CCSDS_TDM_VERS");
        }
        if line.text == "COMMENT" || line.text.starts_with("COMMENT ") {
            return self.comment(line);
        }
        match line.text {
            "META_START" => self.start_metadata(line),
            "META_STOP" => self.stop_metadata(line),
            "DATA_START" => self.switch(line, Part::Gap, Part::Data),
            "DATA_STOP" => self.stop_data(line),
            _ => self.assignment(line),
        }
    }

    fn switch(&mut self, line: Line, from: Part, to: Part) -> Result<(), TdmError> {
        if self.part != from {
            return line.fault("3.1.3", format!("out of place: the section before is {:?}", self.part));
        }
        (self.part, self.order) = (to, 0);
        Ok(())
    }

    fn comment(&mut self, line: Line) -> Result<(), TdmError> {
        let first = match self.part {
            Part::Header => self.header.len() == 1,
            Part::Metadata => self.order == 0,
            Part::Data => self.segments.last().is_some_and(|s| s.records.is_empty()),
            Part::Gap | Part::After => false,
        };
        if !first {
            return line.fault("4.5.2", "a comment stands only at the beginning of the header or of a section");
        }
        if let (Part::Metadata | Part::Data, Some(segment)) = (self.part, self.segments.last_mut()) {
            let words = line.text.strip_prefix("COMMENT").unwrap_or_default();
            segment.comments.push(words.strip_prefix(' ').unwrap_or(words).to_owned());
        }
        Ok(())
    }

    fn start_metadata(&mut self, line: Line) -> Result<(), TdmError> {
        if self.part == Part::Header {
            let missing = HEADER.iter().take(3).find(|k| !self.header.iter().any(|h| h == *k));
            if let Some(keyword) = missing {
                return line.fault("table 3-2", format!("the header has no {keyword}"));
            }
            self.part = Part::After;
        }
        self.switch(line, Part::After, Part::Metadata)?;
        self.segments.push(Segment::default());
        Ok(())
    }

    fn stop_metadata(&mut self, line: Line) -> Result<(), TdmError> {
        self.switch(line, Part::Metadata, Part::Gap)?;
        match self.segments.last().and_then(wrong_metadata) {
            Some((section, fault)) => line.fault(section, fault),
            None => Ok(()),
        }
    }

    fn stop_data(&mut self, line: Line) -> Result<(), TdmError> {
        if self.part == Part::Data && self.segments.last().is_none_or(|s| s.records.is_empty()) {
            return line.fault("3.1.3", "a data section has at least one record");
        }
        self.switch(line, Part::Data, Part::After)
    }

    fn assignment(&mut self, line: Line) -> Result<(), TdmError> {
        let Some((keyword, value)) = line.text.split_once('=') else {
            return line.fault("4.2.5", "a line is keyword = value");
        };
        let (keyword, value) = (keyword.trim_matches(' '), value.trim_matches(' '));
        if keyword.is_empty()
            || !keyword.bytes().all(|b| b.is_ascii_uppercase() || b.is_ascii_digit() || b == b'_')
        {
            return line.fault("4.2.6", "a keyword has capitals, digits and underscores");
        }
        if value.is_empty() {
            return line.fault("4.3.1", "a keyword needs a value");
        }
        match self.part {
            Part::Header => self.header_value(line, keyword, value),
            Part::Metadata => self.metadata_value(line, keyword, value),
            Part::Data => self.record(line, keyword, value),
            Part::Gap => line.fault("3.3.1.3", "after META_STOP comes DATA_START"),
            Part::After => line.fault("3.1.3", "after DATA_STOP comes META_START or the end"),
        }
    }

    /// That a keyword comes after those before it: `place` counts from 1, equal places are allowed to indexed ones.
    fn in_order(&mut self, line: Line, place: usize, indexed: bool, table: &'static str) -> Result<(), TdmError> {
        if place < self.order || (place == self.order && !indexed) {
            return line.fault(table, "keywords come in the order of the table, each once");
        }
        self.order = place;
        Ok(())
    }

    fn header_value(&mut self, line: Line, keyword: &str, value: &str) -> Result<(), TdmError> {
        let table = "table 3-2";
        let Some(place) = HEADER.iter().position(|k| *k == keyword) else {
            return line
                .fault(table, format!("{keyword} is no keyword of the header; allowed: {}", HEADER.join(", ")));
        };
        self.in_order(line, place + 1, false, table)?;
        let digits = |t: &str| !t.is_empty() && t.bytes().all(|b| b.is_ascii_digit());
        if place == 0 && !value.split_once('.').is_some_and(|(x, y)| digits(x) && digits(y)) {
            return line.fault("3.2.5", "a version has the form x.y");
        }
        if place == 1 {
            epoch(line, value)?;
        }
        self.header.push(keyword.to_owned());
        Ok(())
    }

    fn metadata_value(&mut self, line: Line, keyword: &str, value: &str) -> Result<(), TdmError> {
        let table = "table 3-3";
        let Some(place) = METADATA.iter().position(|(name, _)| is(keyword, name)) else {
            return line.fault(table, format!("{keyword} is no keyword of a metadata section"));
        };
        let (name, form) = METADATA[place];
        self.in_order(line, place + 1, name.ends_with("_n"), table)?;
        let Some(segment) = self.segments.last_mut() else { return Ok(()) };
        if segment.get(keyword).is_some() {
            return line.fault("3.3.1.9", format!("{keyword} is given twice"));
        }
        let problem = wrong_value(line, form, value)?;
        if let Some(problem) = problem {
            return line.fault(table, problem);
        }
        segment.metadata.push((keyword.to_owned(), value.to_owned()));
        Ok(())
    }

    fn record(&mut self, line: Line, keyword: &str, value: &str) -> Result<(), TdmError> {
        let Some((_, low, high)) = DATA.iter().find(|(name, ..)| is(keyword, name)) else {
            return line.fault("table 3-5", format!("{keyword} is no keyword of a data section"));
        };
        let Some((tag, measured)) = value.split_once(' ') else {
            return line.fault("3.4.4", "a record is keyword = timetag measurement, with a blank between the two");
        };
        let time = epoch(line, tag)?;
        let measured = measured.trim_matches(' ');
        let Some(value) = number(measured, keyword.contains("_PHASE_CT_")) else {
            return line.fault("4.3", format!("{measured:?} is no number of at most 16 digits"));
        };
        if !(*low..=*high).contains(&value) {
            return line.fault("3.5", format!("{value} must lie from {low} to {high}"));
        }
        let Some(segment) = self.segments.last_mut() else { return Ok(()) };
        if let Some((section, fault)) = wrong_record(segment, keyword, time) {
            return line.fault(section, fault);
        }
        segment.records.push(Record { keyword: keyword.to_owned(), time, value });
        Ok(())
    }
}

type Fault = (&'static str, String);

/// What is wrong with a metadata section as a whole.
fn wrong_metadata(segment: &Segment) -> Option<Fault> {
    let get = |keyword| segment.get(keyword);
    let says = |keyword, word: &str| get(keyword).is_some_and(|v| v.eq_ignore_ascii_case(word));
    let any = |start: &str| segment.metadata.iter().any(|(k, _)| k.starts_with(start));
    let single_diff = says("MODE", "SINGLE_DIFF");
    let paths = ["PATH", "PATH_1", "PATH_2"].map(|k| get(k).is_some());
    let time = |keyword| get(keyword).and_then(|v| Instant::from_utc(v).ok());
    let unnamed = ["PATH", "PATH_1", "PATH_2"].into_iter().filter_map(get).flat_map(|path| path.split(','));
    let unnamed = unnamed.map(|index| format!("PARTICIPANT_{index}")).find(|k| segment.get(k).is_none());
    let cases = [
        (get("TIME_SYSTEM").is_none(), "table 3-3", "TIME_SYSTEM is missing".to_owned()),
        (!any("PARTICIPANT_"), "table 3-3", "PARTICIPANT_n is missing".to_owned()),
        (
            single_diff && paths != [false, true, true],
            "3.3.2.5.3",
            "SINGLE_DIFF needs PATH_1 and PATH_2".to_owned(),
        ),
        (!single_diff && (paths[1] || paths[2]), "table 3-3", "PATH_1 and PATH_2 need SINGLE_DIFF".to_owned()),
        (says("MODE", "SEQUENTIAL") && !paths[0], "table 3-3", "SEQUENTIAL needs PATH".to_owned()),
        (
            unnamed.is_some(),
            "table 3-3",
            format!("a path names {}, which is missing", unnamed.unwrap_or_default()),
        ),
        (
            any("CORRECTION_") && get("CORRECTIONS_APPLIED").is_none(),
            "3.4.15.3",
            "CORRECTION_* needs CORRECTIONS_APPLIED".to_owned(),
        ),
        (
            says("ANGLE_TYPE", "RADEC") != get("REFERENCE_FRAME").is_some(),
            "table 3-3",
            "ANGLE_TYPE = RADEC and REFERENCE_FRAME need each other".to_owned(),
        ),
        (
            get("INTERPOLATION").is_some() && get("INTERPOLATION_DEGREE").is_none(),
            "table 3-3",
            "INTERPOLATION needs INTERPOLATION_DEGREE".to_owned(),
        ),
        (
            time("START_TIME").zip(time("STOP_TIME")).is_some_and(|(start, stop)| start > stop),
            "table 3-3",
            "START_TIME is after STOP_TIME".to_owned(),
        ),
    ];
    cases.into_iter().find(|(wrong, ..)| *wrong).map(|(_, section, fault)| (section, fault))
}

/// What is wrong with a record after those of its segment.
fn wrong_record(segment: &Segment, keyword: &str, time: Instant) -> Option<Fault> {
    let before = segment.records.iter().rev().find(|r| r.keyword == keyword);
    let limit = |keyword| segment.get(keyword).and_then(|v| Instant::from_utc(v).ok());
    let listed = |types: &str| {
        types
            .split(',')
            .map(|t| t.trim_matches(' '))
            .any(|t| t == keyword || (t.ends_with("_n") && is(keyword, t)))
    };
    if before.is_some_and(|r| r.time == time) {
        return Some(("3.4.11", "this timetag of this keyword was there before".to_owned()));
    }
    if before.is_some_and(|r| r.time > time) {
        return Some(("3.4.10", "the records of a keyword come in the order of time".to_owned()));
    }
    // what is sent is sent before the span of what is received, as in the standard's figure E-11
    let outside = limit("START_TIME").is_some_and(|t| time < t) || limit("STOP_TIME").is_some_and(|t| time > t);
    if outside && !keyword.starts_with("TRANSMIT_") {
        return Some(("table 3-3", "the timetag lies outside START_TIME to STOP_TIME".to_owned()));
    }
    if keyword.starts_with("ANGLE_") && segment.get("ANGLE_TYPE").is_none() {
        return Some(("3.5.4.1", "angles need ANGLE_TYPE".to_owned()));
    }
    if segment.get("DATA_TYPES").is_some_and(|types| !listed(types)) {
        return Some(("table 3-3", "DATA_TYPES does not list this keyword".to_owned()));
    }
    None
}

/// What is wrong with the value of a keyword of the metadata.
fn wrong_value(line: Line, form: Form, value: &str) -> Result<Option<String>, TdmError> {
    let real = || number(value, false);
    Ok(match form {
        Form::Text => None,
        Form::Epoch => epoch(line, value).map(|_| None)?,
        Form::Word(words) => {
            let known = words.iter().any(|w| w.eq_ignore_ascii_case(value));
            (!known).then(|| format!("{value:?} is none of {}", words.join(", ")))
        }
        Form::Path => {
            let ok = value.split(',').all(|i| matches!(i, "1" | "2" | "3" | "4" | "5")) && value.contains(',');
            (!ok).then(|| "a path is indices of participants, 1 to 5, with commas and no blanks".to_owned())
        }
        Form::Types => {
            let known = |t: &str| DATA.iter().any(|(name, ..)| *name == t || is(t, name));
            let unknown = value.split(',').map(|t| t.trim_matches(' ')).find(|t| !known(t));
            unknown.map(|t| format!("{t:?} is no keyword of a data section"))
        }
        Form::Integer => value.parse::<i32>().is_err().then(|| "an integer of four bytes is needed".to_owned()),
        Form::Real => real().is_none().then(|| "a number of at most 16 digits is needed".to_owned()),
        Form::Positive => (!real().is_some_and(|v| v > 0.0)).then(|| "a positive number is needed".to_owned()),
        Form::NotNegative => (!real().is_some_and(|v| v >= 0.0)).then(|| "a number from 0 is needed".to_owned()),
    })
}

/// A time of the form YYYY-MM-DDThh:mm:ss\[.d\]\[Z\] or YYYY-DDDThh:mm:ss\[.d\]\[Z\].
fn epoch(line: Line, text: &str) -> Result<Instant, TdmError> {
    let bare = text.strip_suffix('Z').unwrap_or(text);
    let (whole, fraction) = bare.split_once('.').map_or((bare, None), |(w, f)| (w, Some(f)));
    let shape = whole.bytes().map(|b| if b.is_ascii_digit() { 'd' } else { char::from(b) }).collect::<String>();
    let fraction_ok = fraction.is_none_or(|f| !f.is_empty() && f.bytes().all(|b| b.is_ascii_digit()));
    if !matches!(shape.as_str(), "dddd-dd-ddTdd:dd:dd" | "dddd-dddTdd:dd:dd") || !fraction_ok {
        return line
            .fault("4.3.9", format!("{text:?} is not YYYY-MM-DDThh:mm:ss[.d][Z] or YYYY-DDDThh:mm:ss[.d][Z]"));
    }
    Instant::from_utc(text).or_else(|why| line.fault("4.3.9", why))
}
