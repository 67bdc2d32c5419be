//! Headers of ECSV tables: YAML as a JSON tree (crate `yaml-rust2`). Tags are passed over; aliases, which could make a short
//! text long, and nesting deeper than headers have are refused.

use serde_json::{Map, Value as Json};
use yaml_rust2::Yaml;
use yaml_rust2::parser::{Event, Parser};
use yaml_rust2::scanner::{Marker, ScanError, TScalarStyle};

/// Deepest nesting that is read: a header is a handful deep.
const DEEPEST: usize = 32;

/// What is wrong, and in which of the lines, from 0.
pub(super) type Fault = (usize, String);

/// The document in these lines, which is a mapping.
pub(super) fn parse(lines: &[&str]) -> Result<Map<String, Json>, Fault> {
    let text = lines.join("\n");
    let mut reader = Reader { parser: Parser::new_from_str(&text), last: lines.len().saturating_sub(1) };
    loop {
        match reader.next()? {
            (Event::StreamStart | Event::DocumentStart, _) => {}
            (Event::StreamEnd, _) => return Ok(Map::new()),
            (event, line) => {
                return match reader.node(event, line, 0)? {
                    Json::Object(map) => reader.ended().map(|()| map),
                    Json::Null => Ok(Map::new()),
                    _ => Err((line, "a header is a mapping key: value".to_owned())),
                };
            }
        }
    }
}

struct Reader<'a> {
    parser: Parser<std::str::Chars<'a>>,
    /// The last line, from 0: what is missing is missing there.
    last: usize,
}

impl Reader<'_> {
    /// The next event and its line, from 0.
    fn next(&mut self) -> Result<(Event, usize), Fault> {
        let last = self.last;
        let line = |at: &Marker| at.line().saturating_sub(1).min(last);
        let fault = |e: ScanError| (line(e.marker()), e.info().to_owned());
        self.parser.next_token().map(|(event, at)| (event, line(&at))).map_err(fault)
    }

    /// Nothing but the end may follow.
    fn ended(&mut self) -> Result<(), Fault> {
        loop {
            match self.next()? {
                (Event::DocumentEnd, _) => {}
                (Event::StreamEnd, _) => return Ok(()),
                (_, line) => return Err((line, "a header is one document".to_owned())),
            }
        }
    }

    /// What begins with an event.
    fn node(&mut self, event: Event, line: usize, depth: usize) -> Result<Json, Fault> {
        if depth > DEEPEST {
            return Err((line, format!("nested more than {DEEPEST} deep")));
        }
        match event {
            Event::Scalar(text, TScalarStyle::Plain, ..) => Ok(plain(text)),
            Event::Scalar(text, ..) => Ok(Json::String(text)),
            Event::SequenceStart(..) => {
                let mut list = Vec::new();
                loop {
                    match self.next()? {
                        (Event::SequenceEnd, _) => return Ok(Json::Array(list)),
                        (event, line) => list.push(self.node(event, line, depth + 1)?),
                    }
                }
            }
            Event::MappingStart(..) => {
                let mut map = Map::new();
                loop {
                    let key = match self.next()? {
                        (Event::MappingEnd, _) => return Ok(Json::Object(map)),
                        (Event::Scalar(key, ..), _) => key,
                        (_, line) => return Err((line, "a key is a text".to_owned())),
                    };
                    let (event, line) = self.next()?;
                    let value = self.node(event, line, depth + 1)?;
                    map.insert(key, value);
                }
            }
            other => Err((line, format!("{other:?} is not understood in a header"))),
        }
    }
}

/// A number, a truth, nothing, or a text.
fn plain(text: String) -> Json {
    match Yaml::from_str(&text) {
        Yaml::Null => Json::Null,
        Yaml::Boolean(truth) => truth.into(),
        Yaml::Integer(number) => number.into(),
        other @ Yaml::Real(_) => {
            other.as_f64().and_then(serde_json::Number::from_f64).map_or(text.into(), Json::Number)
        }
        _ => Json::String(text),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Json {
        Json::Object(parse(&text.lines().collect::<Vec<_>>()).unwrap_or_else(|e| panic!("{e:?} of {text}")))
    }

    #[test]
    fn blocks_and_flows_mean_the_same() {
        let flow = read("a: {b: [1, -2.5e3, 'it''s', \"q\\\"\\u00e9\"], c: {d: null, e: true}}\nf: x y");
        let block = read(
            "---\na:\n  b:\n  - 1\n  -   -2.5e3\n  - it's\n  - q\"é\n  c:\n    d:\n    e: true\n# remark\nf: x\n  y",
        );
        assert_eq!(flow, block);
        assert_eq!(flow["a"]["b"][1], -2500.0);
    }

    #[test]
    fn scalars_fold_over_lines() {
        let text = "a: 'one\n\n  two\n  three'\nb: {c: 'x\n    y', d: z}\ne: |\n  l1\n  l2: no key\nf: >-\n  g\n  h\ni: ''";
        assert_eq!(
            read(text),
            serde_json::json!({"a": "one\ntwo three", "b": {"c": "x y", "d": "z"}, "e": "l1\nl2: no key\n", "f": "g h", "i": ""})
        );
    }

    #[test]
    fn tags_colons_and_hashes() {
        let text = "a: !!omap\n- {t: 12:30, u: a#b} # remark\n- v: !w {x: y}\n'k: 1': http://x";
        assert_eq!(
            read(text),
            serde_json::json!({"a": [{"t": "12:30", "u": "a#b"}, {"v": {"x": "y"}}], "k: 1": "http://x"})
        );
    }

    #[test]
    fn what_is_no_document_is_refused_without_a_panic() {
        let deep = format!("a: {}", "[".repeat(10_000));
        let steps = (0..200).map(|k| format!("{}a:", " ".repeat(k))).collect::<Vec<_>>().join("\n");
        for text in
            ["a: 'open", "a: {b", "a: [1 2", "- a", "a: *x", "a: 1\n b: 2\nc", &deep, &steps, "a: \"\\", "é"]
        {
            assert!(parse(&text.lines().collect::<Vec<_>>()).is_err(), "{text:.40}");
        }
        assert!(parse(&[]).unwrap().is_empty());
    }
}
