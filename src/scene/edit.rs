//! A scene's text with other values of `[accuracy]`: nothing else of it changes, not a byte.

use super::fault::SceneError;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A value that was changed.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    /// Path of the key.
    pub key: String,
    /// What stood there; none: nothing.
    pub from: Option<String>,
    /// What stands there now.
    pub to: String,
}

/// The text of a scene in which keys of `[accuracy]` have these values, and what was changed. A key that already has its value is left
/// as it is written, as is one that is not there and whose default `default` tells to be that value.
///
/// # Errors
/// [`SceneError`] if the text is no TOML, or writes `accuracy` in a way to which no key can be added.
pub fn with_accuracy(
    text: &str,
    origin: &str,
    values: &[(&str, f64)],
    default: impl Fn(&str) -> Option<f64>,
) -> Result<(String, Vec<Change>), SceneError> {
    let (mut text, mut changes) = (text.to_owned(), Vec::new());
    for (key, value) in values {
        let place = place(&text, key).map_err(|why| SceneError::one(origin, why))?;
        let to = written(*value);
        let from = match place {
            Place::Value(span) => {
                let from = text.get(span.clone()).unwrap_or_default().to_owned();
                if from.replace('_', "").parse::<f64>() == Ok(*value) {
                    continue;
                }
                text.replace_range(span, &to);
                Some(from)
            }
            _ if default(key) == Some(*value) => continue,
            Place::After(at, before) => {
                let end = if text.contains("\r\n") { "\r\n" } else { "\n" };
                let line = format!("{before}{key} = {to}");
                // a last line without an end gets one
                let ends = text.get(..at).is_some_and(|t| t.ends_with('\n'));
                let line = if ends { format!("{line}{end}") } else { format!("{end}{line}") };
                text.insert_str(at, &line);
                None
            }
            Place::Inside(at, empty) => {
                let end = if empty { " " } else { "," };
                text.insert_str(at, &format!(" {key} = {to}{end}"));
                None
            }
            Place::Nowhere => {
                let end = if text.contains("\r\n") { "\r\n" } else { "\n" };
                let gap = if text.is_empty() || text.ends_with('\n') { end.to_owned() } else { end.repeat(2) };
                text.push_str(&format!("{gap}[accuracy]{end}{key} = {to}{end}"));
                None
            }
        };
        changes.push(Change { key: format!("accuracy.{key}"), from, to });
    }
    // the places were found by the text alone: the result must say what it should
    let known = values.iter().all(|(key, value)| match place(&text, key) {
        Ok(Place::Value(span)) => {
            text.get(span).and_then(|t| t.replace('_', "").parse::<f64>().ok()) == Some(*value)
        }
        Ok(_) => default(key) == Some(*value),
        Err(_) => false,
    });
    if known {
        return Ok((text, changes));
    }
    let lines = values.iter().map(|(key, value)| format!("accuracy.{key} = {}", written(*value)));
    let message = format!(
        "`accuracy` is written in a way that cannot be added to; write: {}",
        lines.collect::<Vec<_>>().join(", ")
    );
    Err(SceneError::one(origin, message))
}

/// A number as one would write it: TOML wants a point or an exponent in a real one.
fn written(value: f64) -> String {
    if (1e-2..1e5).contains(&value.abs()) { format!("{value:?}") } else { format!("{value:e}") }
}

/// Where a key's value stands, or would.
enum Place {
    /// The bytes of the value.
    Value(std::ops::Range<usize>),
    /// A line of its own from this byte on, with this before the key.
    After(usize, &'static str),
    /// Inside braces from this byte on; whether there is nothing else.
    Inside(usize, bool),
    /// There is no such table.
    Nowhere,
}

fn place(text: &str, key: &str) -> Result<Place, String> {
    let root = DeTable::parse(text).map_err(|e| format!("not TOML: {}", e.message()))?;
    let find = |table: &DeTable, name: &str| -> Option<(std::ops::Range<usize>, std::ops::Range<usize>)> {
        let (key, value) = table.iter().find(|(key, _)| key.get_ref() == name)?;
        Some((key.span(), value.span()))
    };
    let Some(own) = root.get_ref().iter().find(|(key, _)| key.get_ref() == "accuracy") else {
        return Ok(Place::Nowhere);
    };
    let (name, table): (&Spanned<_>, &Spanned<DeValue>) = own;
    let DeValue::Table(entries) = table.get_ref() else {
        return Err("accuracy: must be a table".into());
    };
    if let Some((_, value)) = find(entries, key) {
        return Ok(Place::Value(value));
    }
    let span = table.span();
    if text.get(span.clone()).is_some_and(|t| t.starts_with('{')) {
        return Ok(Place::Inside(span.start + 1, entries.is_empty()));
    }
    let line_end = |at: usize| text.get(at..).and_then(|t| t.find('\n')).map_or(text.len(), |n| at + n + 1);
    let line_start = text.get(..name.span().start).and_then(|t| t.rfind('\n')).map_or(0, |n| n + 1);
    let header = text.get(line_start..).is_some_and(|t| t.trim_start().starts_with('['));
    let last = entries.iter().map(|(_, value)| value.span().end).max();
    Ok(match (header, last) {
        (true, last) => Place::After(line_end(last.unwrap_or(name.span().end)), ""),
        (false, Some(last)) => Place::After(line_end(last), "accuracy."),
        (false, None) => Place::Nowhere,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::accuracy::Accuracy;

    fn edit(text: &str, values: &[(&str, f64)]) -> (String, usize) {
        let default = |key: &str| Accuracy::default().value(key);
        let (new, changes) = with_accuracy(text, "t.toml", values, default).expect("an edit");
        let read = |text: &str| text.parse::<toml::Table>().expect("TOML");
        let (mut before, after) = (read(text), read(&new));
        for (key, value) in values {
            let found = after.get("accuracy").and_then(|t| t.get(*key)).and_then(toml::Value::as_float);
            assert_eq!(found.or(default(key)), Some(*value), "{key} in {new}");
        }
        // nothing else changed
        before.remove("accuracy");
        let mut rest = after;
        rest.remove("accuracy");
        assert_eq!(before, rest, "{new}");
        (new, changes.len())
    }

    #[test]
    fn only_the_value_changes() {
        let text = "# a scene\n[accuracy]  # mine\nsky   = 1e-3   # why\npsf = 1_0.0e-5\r\n[x]\ny = 1";
        let (new, count) = edit(text, &[("sky", 1e-2), ("psf", 1e-4)]);
        assert_eq!(new, text.replace("1e-3", "0.01"));
        assert_eq!(count, 1);
    }

    #[test]
    fn keys_are_added_where_they_belong() {
        for (text, wanted) in [
            ("", "\n[accuracy]\nsky = 0.05\n"),
            ("a = 1", "a = 1\n\n[accuracy]\nsky = 0.05\n"),
            ("a = 1\r\n", "a = 1\r\n\r\n[accuracy]\r\nsky = 0.05\r\n"),
            ("[accuracy]\n[x]\n", "[accuracy]\nsky = 0.05\n[x]\n"),
            ("[accuracy]", "[accuracy]\nsky = 0.05"),
            ("[accuracy]\npsf = 1e-5 # p\n\n[x]\n", "[accuracy]\npsf = 1e-5 # p\nsky = 0.05\n\n[x]\n"),
            ("accuracy.psf = 1e-5\n[x]\n", "accuracy.psf = 1e-5\naccuracy.sky = 0.05\n[x]\n"),
            ("accuracy = {}\n", "accuracy = { sky = 0.05 }\n"),
            ("accuracy = { psf = 1e-5 }\n", "accuracy = { sky = 0.05, psf = 1e-5 }\n"),
        ] {
            let (new, count) = edit(text, &[("sky", 0.05)]);
            assert_eq!((new.as_str(), count), (wanted, 1), "{text:?}");
        }
    }

    #[test]
    fn what_is_the_default_is_not_written() {
        assert_eq!(edit("a = 1\n", &[("sky", 1e-3), ("psf", 1e-4)]), ("a = 1\n".to_owned(), 0));
    }

    #[test]
    fn several_keys_and_no_table() {
        let (new, count) = edit("a = 1\n", &[("sky", 0.01), ("psf", 1e-5)]);
        assert_eq!((new.as_str(), count), ("a = 1\n\n[accuracy]\nsky = 0.01\npsf = 1e-5\n", 2));
    }

    #[test]
    fn texts_that_cannot_be_edited_are_refused() {
        let none = |_: &str| None;
        for text in ["accuracy = 3\n", "not toml", "[[accuracy]]\nsky = 1.0\n"] {
            assert!(with_accuracy(text, "t.toml", &[("sky", 0.01)], none).is_err(), "{text}");
        }
    }
}
