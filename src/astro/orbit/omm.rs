//! Orbit mean-elements messages (CCSDS 502.0-B-3, section 4): KVN, XML and JSON, one message or many.
//!
//! JSON as Space-Track and CelesTrak give it: an object or a list of objects with the keywords as keys, numbers as
//! numbers or as texts. Only elements for SGP4 in UTC and TEME about the Earth are taken.

use super::super::Error;
use super::super::{scales::Scale, time::Instant};
use super::elements::MeanElements;
use super::tle::catalog_number;
use std::collections::BTreeMap;

/// Keywords and values of one message.
type Message = BTreeMap<String, String>;

/// The elements of every message of a text, or what is wrong with that message; the form is told from its first character.
///
/// # Errors
/// [`Error::Elements`] for a text that holds no message or is not of its form.
pub fn each(text: &str) -> Result<Vec<Result<MeanElements, Error>>, Error> {
    let fault = |reason: String| Error::Elements { name: "orbit mean-elements message".into(), reason };
    let messages = match text.trim_start_matches('\u{feff}').trim_start().chars().next() {
        Some('<') => xml(text.trim_start_matches('\u{feff}').trim()).map_err(fault)?,
        Some('{' | '[') => json(text.trim_start_matches('\u{feff}').trim()).map_err(fault)?,
        _ => kvn(text),
    };
    if messages.is_empty() {
        return Err(fault("there is none: no MEAN_MOTION in the text".into()));
    }
    Ok(messages.iter().map(elements).collect())
}

/// All elements of a text.
///
/// # Errors
/// [`Error::Elements`] with the first message and keyword that cannot be used.
pub fn all(text: &str) -> Result<Vec<MeanElements>, Error> {
    each(text)?.into_iter().collect()
}

/// Whether a text looks like such messages rather than two-line sets.
pub fn looks_like(text: &str) -> bool {
    let text = text.trim_start_matches('\u{feff}').trim_start();
    text.starts_with(['<', '{', '[']) || text.starts_with("CCSDS_OMM_VERS")
}

fn kvn(text: &str) -> Vec<Message> {
    let mut messages = Vec::new();
    let mut message = Message::new();
    for line in text.lines().map(str::trim).filter(|line| !line.starts_with("COMMENT")) {
        let Some((key, value)) = line.split_once('=') else { continue };
        let key = key.trim();
        if key == "CCSDS_OMM_VERS" && !message.is_empty() {
            messages.push(std::mem::take(&mut message));
        }
        // a unit may follow in brackets
        let value = value.split('[').next().unwrap_or_default().trim();
        message.insert(key.to_owned(), value.to_owned());
    }
    messages.push(message);
    messages.retain(|m| m.contains_key("MEAN_MOTION"));
    messages
}

fn xml(text: &str) -> Result<Vec<Message>, String> {
    let options = roxmltree::ParsingOptions { allow_dtd: false, nodes_limit: 5_000_000, ..Default::default() };
    let document = roxmltree::Document::parse_with_options(text, options).map_err(|e| e.to_string())?;
    let bodies = document.descendants().filter(|node| node.has_tag_name("segment"));
    let leaves = |segment: roxmltree::Node| {
        let leaf = |node: roxmltree::Node| {
            let value = node.text().map(str::trim).filter(|t| !t.is_empty())?;
            Some((node.tag_name().name().to_owned(), value.to_owned()))
        };
        segment.descendants().filter(|n| n.is_element()).filter_map(leaf).collect::<Message>()
    };
    Ok(bodies.map(leaves).filter(|m| m.contains_key("MEAN_MOTION")).collect())
}

fn json(text: &str) -> Result<Vec<Message>, String> {
    use serde_json::Value;
    let value: Value = serde_json::from_str(text).map_err(|e| e.to_string())?;
    let objects = match value {
        Value::Array(items) => items,
        one => vec![one],
    };
    let message = |object: Value| match object {
        Value::Object(map) => {
            let pair = |(key, value): (String, Value)| match value {
                Value::String(text) => Some((key, text.trim().to_owned())),
                Value::Number(number) => Some((key, number.to_string())),
                _ => None,
            };
            Some(map.into_iter().filter_map(pair).collect::<Message>())
        }
        _ => None,
    };
    Ok(objects.into_iter().filter_map(message).filter(|m| m.contains_key("MEAN_MOTION")).collect())
}

fn elements(message: &Message) -> Result<MeanElements, Error> {
    let get = |key: &str| message.get(key).map(String::as_str).filter(|v| !v.is_empty());
    let name = get("OBJECT_NAME").filter(|n| !n.eq_ignore_ascii_case("TBA"));
    let mut wrong = Vec::new();
    for (key, allowed) in [
        ("CENTER_NAME", &["EARTH"][..]),
        ("REF_FRAME", &["TEME", "TEMEOFDATE"]),
        ("TIME_SYSTEM", &["UTC"]),
        ("MEAN_ELEMENT_THEORY", &["SGP4", "SGP", "SGP/SGP4"]),
        ("EPHEMERIS_TYPE", &["0", "2"]),
    ] {
        if let Some(value) = get(key).filter(|v| !allowed.contains(&v.to_uppercase().as_str())) {
            wrong.push(format!("{key} = {value}: must be {}", allowed.join(" or ")));
        }
    }
    let mut number = |key: &str, default: Option<f64>| {
        let value = get(key).map_or(default, |text| text.parse::<f64>().ok().filter(|x| x.is_finite()));
        value.unwrap_or_else(|| {
            wrong.push(match get(key) {
                Some(text) => format!("{key} = {text}: must be a number"),
                None => format!("{key} is missing"),
            });
            f64::NAN
        })
    };
    let mean_motion_rev_day = number("MEAN_MOTION", None);
    let eccentricity = number("ECCENTRICITY", None);
    let inclination_deg = number("INCLINATION", None);
    let raan_deg = number("RA_OF_ASC_NODE", None);
    let argp_deg = number("ARG_OF_PERICENTER", None);
    let mean_anomaly_deg = number("MEAN_ANOMALY", None);
    let bstar = number("BSTAR", Some(0.0));
    let catalog = get("NORAD_CAT_ID").map_or(Some(0), catalog_number);
    if catalog.is_none() {
        wrong.push(format!(
            "NORAD_CAT_ID = {}: must be a number or Alpha-5",
            get("NORAD_CAT_ID").unwrap_or_default()
        ));
    }
    let epoch = match get("EPOCH").map(|text| Instant::from_iso(text.trim_end_matches('Z'), Scale::Utc)) {
        Some(Ok(epoch)) => Some(epoch),
        Some(Err(why)) => {
            wrong.push(format!("EPOCH = {}: {why}", get("EPOCH").unwrap_or_default()));
            None
        }
        None => {
            wrong.push("EPOCH is missing".into());
            None
        }
    };
    let (Some(epoch), Some(catalog_number), true) = (epoch, catalog, wrong.is_empty()) else {
        let name = name.map_or_else(|| format!("object {}", get("NORAD_CAT_ID").unwrap_or("?")), str::to_owned);
        return Err(Error::Elements { name, reason: wrong.join("; ") });
    };
    MeanElements {
        name: name.map(str::to_owned),
        catalog_number,
        designator: get("OBJECT_ID").unwrap_or_default().to_owned(),
        epoch,
        mean_motion_rev_day,
        eccentricity,
        inclination_deg,
        raan_deg,
        argp_deg,
        mean_anomaly_deg,
        bstar,
    }
    .checked()
}

#[cfg(test)]
mod tests {
    use super::super::tle::Tle;
    use super::*;

    const KVN: &str = "CCSDS_OMM_VERS = 2.0\nCOMMENT a comment = with a sign\nCREATION_DATE = 2018-01-20T00:00:00\nORIGINATOR = X\n\
        OBJECT_NAME = GOES 14\nOBJECT_ID = 2009-033A\nCENTER_NAME = EARTH\nREF_FRAME = TEME\nTIME_SYSTEM = UTC\n\
        MEAN_ELEMENT_THEORY = SGP4\nEPOCH = 2018-01-19T22:59:46.686336\nMEAN_MOTION = 1.00271818 [rev/day]\n\
        ECCENTRICITY = .0009544\nINCLINATION = .0698\nRA_OF_ASC_NODE = 263.4367\nARG_OF_PERICENTER = 339.3413\n\
        MEAN_ANOMALY = 117.1094\nEPHEMERIS_TYPE = 0\nNORAD_CAT_ID = 35491\nBSTAR = 0\n";

    fn keys() -> impl Iterator<Item = (&'static str, &'static str)> {
        KVN.lines()
            .filter(|l| !l.starts_with("COMMENT"))
            .filter_map(|l| l.split_once(" = "))
            .map(|(k, v)| (k, v.split(" [").next().unwrap_or(v)))
    }

    fn goes() -> MeanElements {
        Tle::from_lines(&[
            "GOES 14",
            "1 35491U 09033A   18019.95817924 -.00000090  00000-0  00000-0 0  9991",
            "2 35491   0.0698 263.4367 0009544 339.3413 117.1094  1.00271818 31371",
        ])
        .and_then(|tle| tle.elements().map_err(|e| e.to_string()))
        .expect("good elements")
    }

    #[test]
    fn every_form_gives_the_elements_of_the_two_lines() {
        assert_eq!(all(KVN).expect("KVN"), [goes()]);
        assert_eq!(all(&format!("{KVN}\r\n{KVN}")).expect("two messages").len(), 2);
        let leaves = keys().map(|(k, v)| format!("<{k}>{v}</{k}>")).collect::<String>();
        let xml = format!(
            "<?xml version=\"1.0\"?><ndm><omm><body><segment><data>{leaves}</data></segment></body></omm></ndm>"
        );
        assert_eq!(all(&xml).expect("XML"), [goes()]);
        let texts = keys().map(|(k, v)| format!("\"{k}\":\"{v}\"")).collect::<Vec<_>>().join(",");
        assert_eq!(all(&format!("[{{{texts}}},{{{texts}}}]")).expect("JSON of texts"), [goes(), goes()]);
        let numbers = texts.replace("\"1.00271818\"", "1.00271818").replace("\".0698\"", "0.0698");
        assert_eq!(all(&format!("{{{numbers}}}")).expect("JSON of numbers"), [goes()]);
    }

    #[test]
    fn what_cannot_be_used_is_named() {
        let fault = |from: &str, to: &str| all(&KVN.replace(from, to)).expect_err(to).to_string();
        assert!(fault("= SGP4", "= SGP4-XP").contains("MEAN_ELEMENT_THEORY = SGP4-XP: must be SGP4"));
        assert!(fault("EPOCH = 2018-01-19T22", "EPOCH = 2018-13-19T22").contains("EPOCH = 2018-13-19T22"));
        assert!(fault("INCLINATION = .0698", "INCLINATION = x").contains("INCLINATION = x: must be a number"));
        assert!(
            fault("ECCENTRICITY = .0009544", "ECCENTRICITY = 1.2").contains("eccentricity 1.2 must lie in 0..1")
        );
        assert!(fault("MEAN_ANOMALY = 117.1094\n", "").contains("MEAN_ANOMALY is missing"));
        assert!(fault("TIME_SYSTEM = UTC", "TIME_SYSTEM = TDB").contains("TIME_SYSTEM = TDB: must be UTC"));
        assert!(fault("NORAD_CAT_ID = 35491", "NORAD_CAT_ID = -5.5").contains("NORAD_CAT_ID = -5.5"));
        assert_eq!(all(&KVN.replace("= 35491", "= T0001")).expect("Alpha-5")[0].catalog_number, 270_001);
        let mixed = each(&format!("{KVN}{}", KVN.replace("= .0009544", "= 1.5"))).expect("two messages");
        assert!(mixed[0].is_ok() && mixed[1].is_err());
        for nonsense in ["", "<a", "{", "[1, 2]", "<a/>", "a = b", "<!DOCTYPE a [<!ENTITY b 'c'>]><a>&b;</a>"] {
            assert!(all(nonsense).is_err(), "{nonsense}");
        }
    }
}
