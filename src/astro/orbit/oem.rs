//! Orbit ephemeris messages (CCSDS 502.0-B-3, section 5): KVN and XML, any number of segments.
//!
//! Between lines the ephemeris is interpolated as its segment says: Lagrange or Hermite of the degree given, or linear;
//! Hermite of degree 7 where nothing is said. The window of lines is the one centred on the instant, so a place depends on
//! the instant alone. Frames: GCRF, ICRF, EME2000 (turned by the frame bias, 23 mas), TEME and ITRF of any year; the
//! centre must be the Earth; every time system of [`Scale`].

use super::State;
use super::interpolate::{hermite, neville};
use crate::astro::earth::Orientation;
use crate::astro::scales::Scale;
use crate::astro::time::Instant;
use crate::astro::{Error, matrix};
use crate::base::constants::EARTH_RATE_RAD_S;
use glam::DVec3;
use std::collections::BTreeMap;

/// An object on a tabulated orbit.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Ephemeris {
    name: String,
    segments: Vec<Segment>,
}

/// Axes of a segment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Frame {
    Gcrs,
    Eme2000,
    Teme,
    Itrf,
}

/// How a segment is interpolated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Method {
    Lagrange,
    Hermite,
}

#[derive(Debug, Clone, PartialEq)]
struct Segment {
    frame: Frame,
    method: Method,
    degree: usize,
    usable: [Instant; 2],
    lines: Vec<(Instant, State)>,
}

/// A segment as written: keywords and data lines.
type Written = (BTreeMap<String, String>, Vec<String>);

impl Ephemeris {
    /// The ephemeris of a message.
    ///
    /// # Errors
    /// [`Error::Elements`] with the segment, keyword or line that cannot be used.
    pub fn parse(text: &str, fallback_name: &str) -> Result<Self, Error> {
        let fault = |reason: String| Error::Elements { name: fallback_name.to_owned(), reason };
        let text = text.trim_start_matches('\u{feff}').trim_start();
        let written = if text.starts_with('<') { xml(text).map_err(fault)? } else { kvn(text) };
        if written.is_empty() {
            return Err(fault("the ephemeris message has no segment (META_START ... META_STOP)".into()));
        }
        let name = written[0].0.get("OBJECT_NAME").cloned().unwrap_or_else(|| fallback_name.to_owned());
        let segments = written.iter().enumerate().map(|(i, w)| {
            Segment::of(w).map_err(|why| fault(format!("segment {} of the ephemeris: {why}", i + 1)))
        });
        Ok(Self { name, segments: segments.collect::<Result<_, _>>()? })
    }

    /// Name of the object.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// First and last usable instant.
    pub fn span(&self) -> [Instant; 2] {
        let starts = self.segments.iter().map(|s| s.usable[0]);
        let ends = self.segments.iter().map(|s| s.usable[1]);
        let zero = Instant::from_tai_ns(0);
        [starts.min().unwrap_or(zero), ends.max().unwrap_or(zero)]
    }

    /// First and last usable instant of each segment.
    pub fn usable(&self) -> impl Iterator<Item = [Instant; 2]> + '_ {
        self.segments.iter().map(|s| s.usable)
    }

    /// GCRS position and velocity at `t`.
    ///
    /// # Errors
    /// [`Error::Propagation`] outside the segments' usable times.
    pub fn gcrs(&self, t: &Instant) -> Result<State, Error> {
        let holds = |s: &&Segment| s.usable[0] <= *t && *t <= s.usable[1];
        let segment = self.segments.iter().find(holds).ok_or_else(|| {
            let spans = self.usable().map(|[first, last]| format!("{} to {}", first.iso_utc(), last.iso_utc()));
            let reason = format!("the ephemeris holds from {} UTC", spans.collect::<Vec<_>>().join(", "));
            Error::Propagation { name: self.name.clone(), utc: t.iso_utc(), reason }
        })?;
        segment.frame.to_gcrs(t, segment.interpolate(t))
    }
}

impl Frame {
    fn named(name: &str) -> Option<Self> {
        let name = name.to_uppercase();
        match name.as_str() {
            "GCRF" | "GCRS" | "ICRF" | "ICRS" => Some(Self::Gcrs),
            "EME2000" | "J2000" => Some(Self::Eme2000),
            "TEME" | "TEMEOFDATE" => Some(Self::Teme),
            _ if name.starts_with("ITRF") => Some(Self::Itrf),
            _ => None,
        }
    }

    fn to_gcrs(self, t: &Instant, s: State) -> Result<State, Error> {
        let turned = |m: glam::DMat3, s: State| State { position: m * s.position, velocity: m * s.velocity };
        Ok(match self {
            Self::Gcrs => s,
            Self::Eme2000 => {
                let (bias, _, _) = sofars::pnp::bp00(2_451_545.0, 0.0);
                turned(matrix(bias).transpose(), s)
            }
            Self::Teme => turned(Orientation::at(t)?.teme_to_gcrs, s),
            Self::Itrf => {
                let to_gcrs = Orientation::at(t)?.gcrs_to_itrf.transpose();
                let carried = DVec3::new(0.0, 0.0, EARTH_RATE_RAD_S).cross(s.position);
                turned(to_gcrs, State { velocity: s.velocity + carried, ..s })
            }
        })
    }
}

fn kvn(text: &str) -> Vec<Written> {
    let mut segments: Vec<Written> = Vec::new();
    let (mut in_meta, mut in_covariance) = (false, false);
    for line in text.lines().map(str::trim).filter(|l| !l.is_empty() && !l.starts_with("COMMENT")) {
        match line {
            "META_START" => {
                segments.push(Written::default());
                in_meta = true;
            }
            "META_STOP" => in_meta = false,
            "COVARIANCE_START" => in_covariance = true,
            "COVARIANCE_STOP" => in_covariance = false,
            _ if in_covariance => {}
            _ => {
                let Some((keys, data)) = segments.last_mut() else { continue };
                match (in_meta, line.split_once('=')) {
                    (true, Some((key, value))) => {
                        keys.insert(key.trim().to_owned(), value.trim().to_owned());
                    }
                    (false, None) => data.push(line.to_owned()),
                    _ => {}
                }
            }
        }
    }
    segments
}

fn xml(text: &str) -> Result<Vec<Written>, String> {
    let options = roxmltree::ParsingOptions { allow_dtd: false, nodes_limit: 5_000_000, ..Default::default() };
    let document = roxmltree::Document::parse_with_options(text, options).map_err(|e| e.to_string())?;
    let child_text = |node: roxmltree::Node, name: &str| {
        node.children().find(|c| c.has_tag_name(name)).and_then(|c| c.text()).unwrap_or_default().trim().to_owned()
    };
    let segment = |segment: roxmltree::Node| {
        let named = |name: &'static str| segment.descendants().filter(move |n| n.has_tag_name(name));
        let keys = named("metadata")
            .flat_map(|m| m.children().filter(|c| c.is_element()))
            .map(|c| (c.tag_name().name().to_owned(), c.text().unwrap_or_default().trim().to_owned()));
        let line = |v: roxmltree::Node| {
            ["EPOCH", "X", "Y", "Z", "X_DOT", "Y_DOT", "Z_DOT"].map(|name| child_text(v, name)).join(" ")
        };
        (keys.collect(), named("stateVector").map(line).collect())
    };
    Ok(document.descendants().filter(|n| n.has_tag_name("segment")).map(segment).collect())
}

impl Segment {
    fn of((keys, data): &Written) -> Result<Self, String> {
        let get = |key: &str| keys.get(key).map(String::as_str).filter(|v| !v.is_empty());
        let required = |key: &str| get(key).ok_or_else(|| format!("{key} is missing"));
        let centre = required("CENTER_NAME")?;
        if !centre.eq_ignore_ascii_case("EARTH") {
            return Err(format!("CENTER_NAME = {centre}: must be EARTH"));
        }
        let frame = required("REF_FRAME")?;
        let frame = Frame::named(frame)
            .ok_or_else(|| format!("REF_FRAME = {frame}: must be GCRF, ICRF, EME2000, TEME or ITRF"))?;
        let scale = required("TIME_SYSTEM")?;
        let scale = Scale::named(scale)
            .ok_or_else(|| format!("TIME_SYSTEM = {scale}: must be UTC, TAI, TT, TDB, GPS or UT1"))?;
        let when = |text: &str| {
            Instant::from_iso(text.trim_end_matches('Z'), scale).map_err(|why| format!("{text}: {why}"))
        };
        let degree = get("INTERPOLATION_DEGREE").map_or(Ok(None), |text| {
            text.parse::<usize>()
                .ok()
                .filter(|d| (1..=30).contains(d))
                .map(Some)
                .ok_or_else(|| format!("INTERPOLATION_DEGREE = {text}: must be an integer in 1..30"))
        })?;
        let (method, degree) = match get("INTERPOLATION").map(str::to_uppercase).as_deref() {
            Some("LAGRANGE") => (Method::Lagrange, degree.unwrap_or(7)),
            Some("LINEAR") => (Method::Lagrange, 1),
            Some("HERMITE") | None => (Method::Hermite, degree.unwrap_or(7)),
            Some(other) => return Err(format!("INTERPOLATION = {other}: must be LAGRANGE, HERMITE or LINEAR")),
        };
        let mut lines = Vec::with_capacity(data.len());
        for text in data {
            let mut words = text.split_whitespace();
            let time = when(words.next().unwrap_or_default())?;
            let numbers =
                words.map(|w| w.parse::<f64>().ok().filter(|x| x.is_finite())).collect::<Option<Vec<_>>>();
            let numbers = numbers.filter(|n| n.len() == 6 || n.len() == 9);
            let n = numbers.ok_or_else(|| format!("line {text:?}: must be a time and 6 or 9 numbers"))?;
            let state = State {
                position: DVec3::new(n[0], n[1], n[2]) * 1e3,
                velocity: DVec3::new(n[3], n[4], n[5]) * 1e3,
            };
            if lines.last().is_some_and(|(before, _)| *before >= time) {
                return Err(format!("line {text:?}: times must ascend"));
            }
            lines.push((time, state));
        }
        let (Some(first), Some(last)) = (lines.first(), lines.last()) else {
            return Err("it has no lines".into());
        };
        let points = if method == Method::Lagrange { degree + 1 } else { degree.div_ceil(2) };
        if lines.len() < 2 || lines.len() < points && get("INTERPOLATION").is_some() {
            return Err(format!("it has {} lines; interpolation of degree {degree} needs {points}", lines.len()));
        }
        let bound = |key: &str, default: Instant| get(key).map_or(Ok(default), when);
        // beyond the lines themselves nothing can be interpolated
        let start = bound("USEABLE_START_TIME", first.0)?.max(first.0);
        let stop = bound("USEABLE_STOP_TIME", last.0)?.min(last.0);
        if start > stop {
            return Err(format!(
                "USEABLE_START_TIME {} lies after USEABLE_STOP_TIME {} (UTC, within the lines)",
                start.iso_utc(),
                stop.iso_utc()
            ));
        }
        Ok(Self { frame, method, degree, usable: [start, stop], lines })
    }

    /// The state in the segment's own frame.
    fn interpolate(&self, t: &Instant) -> State {
        let points = match self.method {
            Method::Lagrange => self.degree + 1,
            // a point gives position and velocity
            Method::Hermite => self.degree.div_ceil(2).max(2),
        }
        .min(self.lines.len());
        let after = self.lines.partition_point(|(time, _)| time <= t);
        let first = after.saturating_sub(points.div_ceil(2)).min(self.lines.len() - points);
        let window = &self.lines[first..first + points];
        let x = window.iter().map(|(time, _)| time.since(t)).collect::<Vec<_>>();
        match self.method {
            Method::Lagrange => {
                let of = |value: fn(&State) -> DVec3| neville(&x, window.iter().map(|(_, s)| value(s)).collect());
                State { position: of(|s| s.position), velocity: of(|s| s.velocity) }
            }
            Method::Hermite => hermite(&x, window.iter().map(|(_, s)| *s)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::kepler::Kepler;
    use super::*;
    use crate::base::constants::EARTH_GM;

    fn at(seconds: f64) -> State {
        Kepler {
            a: 2.6e7,
            e: 0.1,
            i: 0.9,
            raan: 1.0,
            argp: 2.0,
            mean_anomaly: (EARTH_GM / 2.6e7f64.powi(3)).sqrt() * seconds,
        }
        .state(EARTH_GM)
    }

    fn message(meta: &str, step_s: f64, count: i32) -> String {
        let mut text = format!(
            "CCSDS_OEM_VERS = 2.0\nCREATION_DATE = 2018-01-20T00:00:00\nORIGINATOR = X\nMETA_START\nOBJECT_NAME = TEST\n\
             OBJECT_ID = 2018-001A\nCENTER_NAME = EARTH\nREF_FRAME = GCRF\nTIME_SYSTEM = TAI\n\
             START_TIME = 2018-01-20T00:00:00\nSTOP_TIME = 2018-01-20T10:00:00\n{meta}META_STOP\nCOMMENT data\n"
        );
        for k in 0..count {
            let seconds = f64::from(k) * step_s;
            let (h, m, s) = ((seconds / 3600.0).floor(), (seconds / 60.0 % 60.0).floor(), seconds % 60.0);
            let state = at(seconds);
            let (r, v) = (state.position / 1e3, state.velocity / 1e3);
            text.push_str(&format!(
                "2018-01-20T{h:02}:{m:02}:{s:06.3} {} {} {} {} {} {}\n",
                r.x, r.y, r.z, v.x, v.y, v.z
            ));
        }
        text + "COVARIANCE_START\nEPOCH = 2018-01-20T00:00:00\n1.0\nCOVARIANCE_STOP\n"
    }

    fn start() -> Instant {
        Instant::from_iso("2018-01-20T00:00:00", Scale::Tai).expect("a time")
    }

    /// Every method repeats a smooth orbit to the error its degree has: lines each 5 min, checked between them.
    #[test]
    fn methods_and_degrees() {
        for (meta, allowed_m) in [
            ("", 2.0),
            ("INTERPOLATION = HERMITE\nINTERPOLATION_DEGREE = 7\n", 2.0),
            ("INTERPOLATION = HERMITE\nINTERPOLATION_DEGREE = 11\n", 1e-3),
            ("INTERPOLATION = LAGRANGE\nINTERPOLATION_DEGREE = 9\n", 1e-2),
            ("INTERPOLATION = LINEAR\n", 1e4),
        ] {
            let ephemeris = Ephemeris::parse(&message(meta, 300.0, 60), "fallback").expect("a message");
            let mut worst = 0.0f64;
            for k in 0..1770 {
                let seconds = f64::from(k) * 10.0 + 3.0;
                let own = ephemeris.gcrs(&start().plus(seconds)).expect("inside");
                worst = worst.max((own.position - at(seconds).position).length());
            }
            assert!(worst < allowed_m, "{meta:?}: {worst} m");
            assert!((ephemeris.gcrs(&start()).expect("inside").position - at(0.0).position).length() < 1e-6);
        }
    }

    #[test]
    fn the_xml_form_says_the_same() {
        let vectors = (0..20).map(|k| {
            let s = at(f64::from(k) * 300.0);
            let (r, v) = (s.position / 1e3, s.velocity / 1e3);
            format!(
                "<stateVector><EPOCH>2018-01-20T{:02}:{:02}:00</EPOCH><X units=\"km\">{}</X><Y>{}</Y><Z>{}</Z>\
                 <X_DOT>{}</X_DOT><Y_DOT>{}</Y_DOT><Z_DOT>{}</Z_DOT></stateVector>",
                k / 12,
                k % 12 * 5,
                r.x,
                r.y,
                r.z,
                v.x,
                v.y,
                v.z
            )
        });
        let xml = format!(
            "<?xml version=\"1.0\"?><oem><body><segment><metadata><OBJECT_NAME>TEST</OBJECT_NAME>\
             <CENTER_NAME>EARTH</CENTER_NAME><REF_FRAME>GCRF</REF_FRAME><TIME_SYSTEM>TAI</TIME_SYSTEM></metadata>\
             <data>{}</data></segment></body></oem>",
            vectors.collect::<String>()
        );
        let (one, other) = (
            Ephemeris::parse(&xml, "x").expect("XML"),
            Ephemeris::parse(&message("", 300.0, 20), "x").expect("KVN"),
        );
        let t = start().plus(1234.5);
        assert_eq!(one.gcrs(&t).expect("inside"), other.gcrs(&t).expect("inside"));
        assert_eq!((one.name(), one.span()), ("TEST", other.span()));
    }

    #[test]
    fn frames_are_turned_and_times_read_in_their_system() {
        let gcrs = Ephemeris::parse(&message("", 300.0, 20), "x").expect("a message");
        let t = start().plus(1234.5);
        let own = gcrs.gcrs(&t).expect("inside").position;
        let other = |from: &str, to: &str| {
            let text = message("", 300.0, 20).replace(from, to);
            Ephemeris::parse(&text, "x").expect("a message").gcrs(&t).expect("inside")
        };
        // 23 mas of frame bias at 26,000 km: 3 m
        let bias = (other("= GCRF", "= EME2000").position - own).length();
        assert!(bias > 0.5 && bias < 4.0, "{bias}");
        let turned = other("= GCRF", "= TEME").position;
        assert!((turned.length() - own.length()).abs() < 1e-3 && (turned - own).length() > 1e4);
        // a rotating frame keeps the radius, not the speed
        assert!((other("= GCRF", "= ITRF2014").position.length() - own.length()).abs() < 1e-3);
        let moved = (other("= TAI", "= GPS").position - own).length();
        assert!((moved - 19.0 * at(1234.5).velocity.length()).abs() < 0.01 * moved, "{moved}");
    }

    #[test]
    fn what_cannot_be_used_is_named() {
        let fault = |from: &str, to: &str| {
            Ephemeris::parse(&message("", 300.0, 20).replace(from, to), "x").expect_err(to).to_string()
        };
        assert!(
            fault("= EARTH", "= MARS").contains("segment 1 of the ephemeris: CENTER_NAME = MARS: must be EARTH")
        );
        assert!(fault("= GCRF", "= TOD").contains("REF_FRAME = TOD"));
        assert!(fault("= TAI", "= SCLK").contains("TIME_SYSTEM = SCLK"));
        assert!(fault("T00:05:00.000", "T00:00:00.000").contains("times must ascend"));
        assert!(fault("T00:05:00.000", "T00:65:00.000").contains("there is no time"));
        assert!(Ephemeris::parse("", "x").is_err() && Ephemeris::parse("<a", "x").is_err());
        let short =
            Ephemeris::parse(&message("INTERPOLATION = LAGRANGE\nINTERPOLATION_DEGREE = 9\n", 300.0, 5), "x");
        assert!(
            short.expect_err("too few").to_string().contains("has 5 lines; interpolation of degree 9 needs 10")
        );
        let outside = Ephemeris::parse(&message("", 300.0, 20), "x").expect("a message").gcrs(&start().plus(-1.0));
        assert!(outside.expect_err("outside").to_string().contains("holds from 2018-01-19T23:59:23.000000 to"));
    }
}
