//! Cards of a FITS header, as written.

use std::fmt::Write;

/// Value of a card.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// Logical.
    Bool(bool),
    /// Integer.
    Int(i64),
    /// Floating point; only finite values are written.
    Float(f64),
    /// Character string.
    Text(String),
}

impl From<f64> for Value {
    fn from(value: f64) -> Self {
        Self::Float(value)
    }
}

impl From<i64> for Value {
    fn from(value: i64) -> Self {
        Self::Int(value)
    }
}

impl From<bool> for Value {
    fn from(value: bool) -> Self {
        Self::Bool(value)
    }
}

impl From<&str> for Value {
    fn from(value: &str) -> Self {
        Self::Text(value.to_owned())
    }
}

impl From<String> for Value {
    fn from(value: String) -> Self {
        Self::Text(value)
    }
}

/// One line of a header.
#[derive(Debug, Clone, PartialEq)]
pub enum Card {
    /// Keyword, value, comment (unit in square brackets).
    Keyword(String, Value, String),
    /// One remark; long ones take several lines.
    History(String),
}

/// A header: cards in order.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Header {
    /// The cards.
    pub cards: Vec<Card>,
}

impl Header {
    /// Append a keyword; a value that is not finite is unknown and is not written.
    pub fn push(&mut self, keyword: &str, value: impl Into<Value>, comment: &str) {
        let value = value.into();
        if !matches!(value, Value::Float(x) if !x.is_finite()) {
            self.cards.push(Card::Keyword(keyword.to_owned(), value, comment.to_owned()));
        }
    }

    /// The value of a keyword, the first if it occurs more than once.
    pub fn value(&self, keyword: &str) -> Option<&Value> {
        self.cards.iter().find_map(|card| match card {
            Card::Keyword(name, value, _) if name == keyword => Some(value),
            _ => None,
        })
    }

    /// Append a remark.
    pub fn history(&mut self, text: impl Into<String>) {
        self.cards.push(Card::History(text.into()));
    }

    /// The cards as lines of 80 characters, without END.
    pub fn lines(&self) -> Vec<String> {
        self.cards.iter().flat_map(card_lines).collect()
    }
}

fn card_lines(card: &Card) -> Vec<String> {
    match card {
        Card::Keyword(keyword, value, comment) => vec![keyword_line(keyword, value, comment)],
        Card::History(text) => {
            let text = ascii(text);
            let chunks = text.as_bytes().chunks(70);
            chunks.map(|c| format!("{:<80}", format!("HISTORY   {}", String::from_utf8_lossy(c)))).collect()
        }
    }
}

fn keyword_line(keyword: &str, value: &Value, comment: &str) -> String {
    let mut line = format!("{keyword:<8}= ");
    match value {
        Value::Text(text) => {
            // a quote counts twice; strings are cut to fit one card
            let mut quoted = ascii(text).replace('\'', "''");
            quoted.truncate(68);
            let _ = write!(line, "{:<20}", format!("'{quoted:<8}'"));
        }
        Value::Bool(flag) => {
            let _ = write!(line, "{:>20}", if *flag { "T" } else { "F" });
        }
        Value::Int(number) => {
            let _ = write!(line, "{number:>20}");
        }
        Value::Float(number) => {
            let _ = write!(line, "{:>20}", float(*number));
        }
    }
    if !comment.is_empty() && line.len() + 3 < 80 {
        let _ = write!(line, " / {}", ascii(comment));
        line.truncate(80);
        line.truncate(line.trim_end().len());
    }
    format!("{line:<80}")
}

/// The shortest decimal form that reads back as the same number, with a point and a capital E.
fn float(value: f64) -> String {
    let text = format!("{value:?}");
    match text.split_once('e') {
        None => text,
        Some((digits, exponent)) if digits.contains('.') => format!("{digits}E{exponent}"),
        Some((digits, exponent)) => format!("{digits}.0E{exponent}"),
    }
}

fn ascii(text: &str) -> String {
    text.chars().map(|c| if (' '..='~').contains(&c) { c } else { '?' }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cards_have_eighty_columns_and_aligned_values() {
        let mut header = Header::default();
        header.push("SIMPLE", true, "FITS Standard 4.0");
        header.push("CRVAL1", 1.25e-7, "[deg]");
        header.push("OBSERVER", "O'Neill", "");
        header.push("AIRMASS", f64::NAN, "unknown, so not written");
        header.history("x".repeat(100));
        let lines = header.lines();
        assert_eq!(lines.len(), 5);
        assert!(lines.iter().all(|line| line.len() == 80));
        assert_eq!(&lines[0][..30], "SIMPLE  =                    T");
        assert!(lines[1].contains("1.25E-7 / [deg]"));
        assert!(lines[2].starts_with("OBSERVER= 'O''Neill'"));
    }

    #[test]
    fn floats_read_back_exactly() {
        for value in [0.1, 1e300, -2.5e-12, 1e16, 3.0] {
            assert_eq!(float(value).replace('E', "e").parse::<f64>(), Ok(value));
            assert!(float(value).contains('.'));
        }
    }
}
