//! Tracking Data Messages: what is written reads back, and what breaks the grammar is refused with its line.

use super::*;
use crate::astro::time::Instant;

fn at(text: &str) -> Instant {
    Instant::from_utc(text).unwrap()
}

fn seen(seconds: f64, ra_deg: f64, dec_deg: f64, mag: f64) -> Observation {
    Observation { time: at("2024-02-29T23:59:50.123456").plus(seconds), ra_deg, dec_deg, mag }
}

fn track(observations: Vec<Observation>) -> Track {
    Track {
        station: "POGS".into(),
        target: "2009-033A".into(),
        comments: vec!["exposures of 10 s".into()],
        observations,
    }
}

fn header() -> Header {
    Header { comments: vec!["made up".into()], originator: "PURDUE".into(), ..Default::default() }
}

fn values(segment: &Segment, keyword: &str) -> Vec<f64> {
    segment.records.iter().filter(|r| r.keyword == keyword).map(|r| r.value).collect()
}

/// A message with every part, as lines that tests change.
fn sample() -> Vec<String> {
    let text =
        to_tdm(&header(), &[track(vec![seen(0.0, 10.0, -5.0, 12.0), seen(20.0, 10.5, -5.5, 12.5)])]).unwrap();
    text.lines().map(str::to_owned).collect()
}

fn fault_of(lines: &[String]) -> (usize, &'static str) {
    match parse_tdm(&(lines.join("\n") + "\n")) {
        Err(TdmError::Line { line, section, .. }) => (line, section),
        other => panic!("{other:?} of {lines:#?}"),
    }
}

#[test]
fn what_is_written_reads_back() {
    let nan = f64::NAN;
    let observations = vec![
        seen(20.0, 359.999_999_999_999_97, 89.999_999_999_999, -1.5),
        seen(0.0, -0.25, -1e-13, 12.345_678_901_234_567),
        seen(30.0, nan, 4.0, nan),
        seen(40.0, nan, 4.0, 13.0),
        seen(50.0, 200.0, -30.0, f64::INFINITY),
    ];
    let other = Track { target: "ISS (ZARYA)".into(), ..track(vec![seen(5.0, 1.0, 2.0, 3.0)]) };
    let empty = Track { target: "unseen".into(), ..track(vec![seen(5.0, nan, nan, nan)]) };
    let text = to_tdm(&header(), &[track(observations), empty, other]).unwrap();
    assert!(
        text.starts_with("CCSDS_TDM_VERS = 2.0\nCOMMENT made up\nCREATION_DATE = 2024-03-01T00:00:40.123456\n")
    );
    let segments = parse_tdm(&text).unwrap();
    assert_eq!(segments.len(), 2);
    // rounded to 1e-12, and never 360 or -0
    assert_eq!(values(&segments[0], "ANGLE_1"), [359.75, 0.0, 200.0]);
    assert_eq!(values(&segments[0], "ANGLE_2"), [0.0, 89.999_999_999_999, -30.0]);
    assert_eq!(values(&segments[0], "MAG"), [12.345_678_901_235, -1.5, 13.0]);
    assert_eq!(segments[0].records[0].time, at("2024-02-29T23:59:50.123456"));
    let said = ["TIME_SYSTEM", "START_TIME", "STOP_TIME", "PATH", "ANGLE_TYPE", "REFERENCE_FRAME", "DATA_TYPES"];
    let said = said.map(|k| segments[0].get(k).unwrap_or(""));
    let times = ["2024-02-29T23:59:50.123456", "2024-03-01T00:00:40.123456"];
    assert_eq!(said, ["UTC", times[0], times[1], "2,1", "RADEC", "ICRF", "ANGLE_1,ANGLE_2,MAG"]);
    assert!(segments[0].comments.iter().any(|c| c.contains("aberration")));
    assert_eq!(segments[1].get("PARTICIPANT_2"), Some("ISS (ZARYA)"));
}

#[test]
fn a_segment_without_places_names_no_frame() {
    let text = to_tdm(&header(), &[track(vec![seen(0.0, f64::NAN, f64::NAN, 9.0)])]).unwrap();
    let segments = parse_tdm(&text).unwrap();
    assert_eq!((segments[0].get("ANGLE_TYPE"), segments[0].get("DATA_TYPES")), (None, Some("MAG")));
    assert!(!text.contains("ANGLE") && !text.contains("astrometric"));
}

#[test]
fn a_leap_second_is_written_and_read() {
    let leap = Instant::from_utc("2016-12-31T23:59:60.5").unwrap();
    let text = to_tdm(&header(), &[track(vec![Observation { time: leap, ..seen(0.0, 1.0, 2.0, 3.0) }])]).unwrap();
    assert!(text.contains("ANGLE_1 = 2016-12-31T23:59:60.500000 1.0\n"), "{text}");
    assert_eq!(parse_tdm(&text).unwrap()[0].records[0].time, leap);
}

#[test]
fn what_cannot_be_written_is_refused_with_its_value() {
    let one = |o| to_tdm(&header(), &[track(o)]);
    assert_eq!(one(vec![]), Err(TdmError::Empty));
    assert_eq!(one(vec![seen(0.0, f64::NAN, 1.0, f64::NAN)]), Err(TdmError::Empty));
    let range = one(vec![seen(0.0, 1.0, 90.000_001, 1.0)]).unwrap_err().to_string();
    assert!(range.contains("90.000001") && range.contains("-90 to 90") && range.contains("2009-033A"), "{range}");
    assert!(matches!(one(vec![seen(0.0, 1.0, 1.0, 1e300)]), Err(TdmError::Range { keyword: "MAG", .. })));
    // a tenth of a microsecond apart: one timetag
    let twice = one(vec![seen(0.0, 1.0, 1.0, 1.0), seen(1e-7, 1.0, 1.0, 1.0)]);
    assert!(matches!(twice, Err(TdmError::Repeated { .. })), "{twice:?}");
}

#[test]
fn any_name_and_comment_makes_a_message_that_reads() {
    for name in ["", " \t\n", "Ñandú = 7", "a\nDATA_STOP", &"x".repeat(1000), "META_START", "COMMENT"] {
        let mut odd = track(vec![seen(0.0, 1.0, 2.0, 3.0)]);
        (odd.station, odd.target, odd.comments) = (name.to_owned(), name.to_owned(), vec![name.to_owned()]);
        let header = Header {
            comments: vec![name.to_owned()],
            originator: name.to_owned(),
            message_id: Some(name.to_owned()),
            creation: None,
        };
        let text = to_tdm(&header, &[odd]).unwrap();
        let segments = parse_tdm(&text).unwrap_or_else(|e| panic!("{name:?}: {e}"));
        assert_eq!(segments[0].records.len(), 3, "{name:?}");
    }
}

#[test]
fn every_breach_of_the_grammar_is_refused_with_its_line() {
    let good = sample();
    assert_eq!(parse_tdm(&(good.join("\n") + "\n")).unwrap()[0].records.len(), 6);
    let find = |start: &str| good.iter().position(|l| l.starts_with(start)).unwrap_or_else(|| panic!("{start}"));
    // replace the first line that starts so by these lines; the fault is on the line so far after it
    let cases: &[(&str, &[&str], usize, &str)] = &[
        ("CCSDS_TDM_VERS", &["CREATION_DATE = 2024-01-01T00:00:00"], 0, "3.2.1"),
        ("CCSDS_TDM_VERS", &["CCSDS_TDM_VERS = 2"], 0, "3.2.5"),
        ("COMMENT made", &["\tCOMMENT tab"], 0, "4.2.1"),
        ("CREATION_DATE", &["CREATION_DATE = 2024-01-01T20:00"], 0, "4.3.9"),
        ("CREATION_DATE", &["CREATION_DATE = 2024-02-30T20:00:00"], 0, "4.3.9"),
        ("ORIGINATOR", &["originator = X"], 0, "4.2.6"),
        ("ORIGINATOR", &["ORIGINATOR ="], 0, "4.3.1"),
        ("ORIGINATOR", &["ORIGINATOR = A", "ORIGINATOR = B"], 1, "table 3-2"),
        ("ORIGINATOR", &["ORIGINATOR = A", "COMMENT late"], 1, "4.5.2"),
        ("ORIGINATOR", &["ORIGINATOR = A", "TIME_SYSTEM = UTC"], 1, "table 3-2"),
        ("META_START", &["DATA_START"], 0, "3.1.3"),
        ("TIME_SYSTEM", &["TIME_SYSTEM = GPS"], 0, "table 3-3"),
        ("TIME_SYSTEM", &["TIME_SYSTEM = UTC", "TRACK_ID = 7"], 1, "table 3-3"),
        ("TIME_SYSTEM", &["TIME_SYSTEM = UTC", "COLOUR = blue"], 1, "table 3-3"),
        ("START_TIME", &["START_TIME = 2024-060T23:59:51"], 10, "table 3-3"),
        ("STOP_TIME", &["STOP_TIME = 2024-02-29T23:59:49"], 7, "table 3-3"),
        ("PARTICIPANT_1", &["PARTICIPANT_6 = X"], 0, "table 3-3"),
        ("PARTICIPANT_2", &["PARTICIPANT_1 = X"], 0, "3.3.1.9"),
        ("MODE", &["MODE = PARALLEL"], 0, "table 3-3"),
        ("MODE", &["MODE = SINGLE_DIFF"], 4, "3.3.2.5.3"),
        ("PATH", &["PATH = 2, 1"], 0, "table 3-3"),
        ("PATH", &["PATH = 2,3"], 3, "table 3-3"),
        ("REFERENCE_FRAME", &[], 0, "table 3-3"),
        ("META_STOP", &["CORRECTION_MAG = 0.1", "META_STOP"], 1, "3.4.15.3"),
        ("META_STOP", &["INTEGRATION_INTERVAL = 1.0", "META_STOP"], 0, "table 3-3"),
        ("META_STOP", &["CORRECTION_MAG = NaN", "META_STOP"], 0, "table 3-3"),
        ("DATA_START", &["DATA_START", "DATA_STOP"], 1, "3.1.3"),
        ("ANGLE_1", &["ANGLE_1 = 2024-02-29T23:59:50.123456"], 0, "3.4.4"),
        ("ANGLE_1", &["ANGLE_1 = 2024-02-29T23:59:50.123456 360.0"], 0, "3.5"),
        ("ANGLE_1", &["ANGLE_1 = 2024-02-29T23:59:50.123456 nan"], 0, "4.3"),
        ("ANGLE_1", &["ANGLE_1 = 2024-02-29T23:59:50.123456 1.00000000000000001"], 0, "4.3"),
        ("ANGLE_1", &["ANGLE_1 = 2024-02-29T23:59:50.123456 .5"], 0, "4.3"),
        ("ANGLE_1", &["ANGLE_1 = 2024-02-29T23:59:50.123456 1.0 deg"], 0, "4.3"),
        ("ANGLE_1", &["RANGE = 2024-02-29T23:59:50.123456 1.0"], 0, "table 3-3"),
        ("ANGLE_1", &["WARMTH = 2024-02-29T23:59:50.123456 1.0"], 0, "table 3-5"),
        ("ANGLE_1", &["ANGLE_1 = 2024-03-01T00:00:10.123456 1.0"], 3, "3.4.11"),
        ("ANGLE_1", &["ANGLE_1 = 2024-02-29T23:59:55 1.0", "ANGLE_1 = 2024-02-29T23:59:54 1.0"], 1, "3.4.10"),
        ("ANGLE_2", &["COMMENT late"], 0, "4.5.2"),
        ("DATA_STOP", &["META_STOP"], 0, "3.1.3"),
        ("DATA_STOP", &[], 0, "3.1.3"),
        ("DATA_STOP", &["DATA_STOP", "ANGLE_1 = 2024-02-29T23:59:55 1.0"], 1, "3.1.3"),
    ];
    for (start, instead, after, section) in cases {
        let place = find(start);
        let mut lines = good.clone();
        lines.splice(place..=place, instead.iter().map(|l| (*l).to_owned()));
        let expected = if instead.is_empty() && *start == "DATA_STOP" { lines.len() } else { place + 1 + after };
        assert_eq!(fault_of(&lines), (expected, *section), "{start} -> {instead:?}");
    }
    assert!(parse_tdm(&good.join("\n")).is_err(), "the last line has no end");
    assert!(parse_tdm("").is_err() && parse_tdm("\n\n").is_err());
    let long = format!("COMMENT {}", "x".repeat(247));
    assert_eq!(fault_of(&[good[0].clone(), long]), (2, "4.2.1"));
}

#[test]
fn forms_that_the_grammar_allows_are_read() {
    let mut lines = sample();
    lines.insert(0, "   ".into());
    let find = |lines: &[String], start: &str| lines.iter().position(|l| l.starts_with(start)).unwrap();
    let place = find(&lines, "MODE");
    lines[place] = "  MODE=sequential  ".into();
    let place = find(&lines, "REFERENCE_FRAME");
    lines.insert(place + 1, "CORRECTION_ANGLE_1 = -3.0e-1".into());
    lines.insert(place + 2, "CORRECTIONS_APPLIED = yes".into());
    let place = find(&lines, "MAG");
    lines[place] = "MAG =   2024-060T23:59:50.123456Z    +1.25E+01".into();
    for end in ["\n", "\r", "\r\n", "\n\r"] {
        let segments = parse_tdm(&(lines.join(end) + end)).unwrap_or_else(|e| panic!("{end:?}: {e}"));
        assert_eq!(values(&segments[0], "MAG"), [12.5, 12.5]);
        assert_eq!(segments[0].get("CORRECTION_ANGLE_1"), Some("-3.0e-1"));
    }
}

#[test]
fn damaged_messages_are_refused_or_read_but_do_not_panic() {
    let text = sample().join("\n") + "\n";
    let pieces = ["", "\n", "=", " ", "é", "\t", "9", "COMMENT ", "\r", "ANGLE_1 = ", "Z", "."];
    let refused = (0..text.len()).flat_map(|from| pieces.map(|piece| (from, piece))).filter(|(from, piece)| {
        // every other time a character is lost
        let to = from + from % 2;
        parse_tdm(&format!("{}{piece}{}", &text[..*from], &text[to..])).is_err()
    });
    let share = refused.count() as f64 / (text.len() * pieces.len()) as f64;
    // most damage is seen; what is not lies in comments, names, blanks and digits
    assert!((0.3..0.9).contains(&share), "{share}");
}
