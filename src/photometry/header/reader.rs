//! A header with a notebook: cards as numbers and texts, whatever type they were written in.

use super::dialect::{self, Program, SIGNATURES};
use super::note::{Note, NoteKind};
use super::overrides::Overrides;

/// The cards of a FITS header.
pub trait Header {
    /// A number, integer or floating; none if the card is missing or of another type.
    fn number(&self, keyword: &str) -> Option<f64>;
    /// A string; none if the card is missing or of another type.
    fn text(&self, keyword: &str) -> Option<String>;
    /// A logical; none if the card is missing or of another type.
    fn flag(&self, keyword: &str) -> Option<bool>;
}

/// What reads one header.
pub(super) struct Reader<'h> {
    header: &'h dyn Header,
    /// What the user says instead.
    pub overrides: &'h Overrides,
    /// The program that wrote the frame, if it is known.
    pub program: Option<&'static Program>,
    /// Columns and rows of the frame.
    pub size: [usize; 2],
    /// Remarks so far.
    pub notes: Vec<Note>,
}

impl<'h> Reader<'h> {
    pub fn new(header: &'h dyn Header, size: [usize; 2], overrides: &'h Overrides) -> Self {
        let mut reader = Self { header, overrides, program: None, size, notes: Vec::new() };
        reader.program = SIGNATURES.iter().find_map(|k| dialect::program_of(&reader.text(k)?));
        reader
    }

    /// A finite number, also one written as a string.
    pub fn number(&self, keyword: &str) -> Option<f64> {
        let number = self.header.number(keyword);
        number.or_else(|| self.text(keyword)?.parse().ok()).filter(|x| x.is_finite())
    }

    /// A string that is not blank, without blanks around it.
    pub fn text(&self, keyword: &str) -> Option<String> {
        let text = self.header.text(keyword)?.trim().to_owned();
        (!text.is_empty()).then_some(text)
    }

    /// A logical, also one written as a string or as 0 and 1.
    pub fn flag(&self, keyword: &str) -> Option<bool> {
        self.header.flag(keyword).or_else(|| match self.text(keyword) {
            Some(text) => match text.to_ascii_lowercase().as_str() {
                "t" | "true" | "yes" => Some(true),
                "f" | "false" | "no" => Some(false),
                _ => None,
            },
            None => self.header.number(keyword).map(|x| x != 0.0),
        })
    }

    /// True if the card is there with a value.
    pub fn has(&self, keyword: &str) -> bool {
        self.text(keyword).is_some() || self.header.number(keyword).is_some() || self.flag(keyword).is_some()
    }

    /// The value as it stands in the header, for messages.
    pub fn shown(&self, keyword: &str) -> String {
        self.text(keyword)
            .or_else(|| self.header.number(keyword).map(|x| x.to_string()))
            .or_else(|| self.header.flag(keyword).map(|x| x.to_string()))
            .unwrap_or_else(|| "(missing)".to_owned())
    }

    /// The finite numbers among `keywords`.
    pub fn numbers(&self, keywords: &[&'static str]) -> Vec<(&'static str, f64)> {
        keywords.iter().filter_map(|k| Some((*k, self.number(k)?))).collect()
    }

    /// Remark on cards, with the values they have; those that are missing count only if all are.
    pub fn note(&mut self, kind: NoteKind, keywords: &[&str], what: impl Into<String>) {
        let none = !keywords.iter().any(|k| self.has(k));
        let cards = keywords.iter().filter(|k| none || self.has(k));
        let cards = cards.map(|k| ((*k).to_owned(), self.shown(k))).collect();
        self.notes.push(Note { kind, cards, what: what.into() });
    }

    /// The first of `keywords` with a number that `allowed` takes; numbers it does not take are refused with
    /// `reason`, except a 0, which programs write where they do not know.
    pub fn first(
        &mut self,
        keywords: &[&'static str],
        allowed: impl Fn(f64) -> bool,
        reason: &str,
    ) -> Option<(&'static str, f64)> {
        for (keyword, value) in self.numbers(keywords) {
            if allowed(value) {
                return Some((keyword, value));
            }
            if value == 0.0 {
                self.note(NoteKind::Ignored, &[keyword], "taken as not known");
            } else {
                self.note(NoteKind::Refused, &[keyword], reason);
            }
        }
        None
    }

    /// The user's value if it is given and `allowed`, with a remark; else `header`.
    pub fn overridden(
        &mut self,
        option: &str,
        given: Option<f64>,
        allowed: impl Fn(f64) -> bool,
        header: Option<f64>,
    ) -> Option<f64> {
        let Some(given) = given else { return header };
        let cards = vec![(option.to_owned(), given.to_string())];
        if !allowed(given) {
            self.notes.push(Note {
                kind: NoteKind::Refused,
                cards,
                what: "out of range; the header counts".into(),
            });
            return header;
        }
        let what = header.map_or("the header has none".to_owned(), |h| format!("in place of the header's {h}"));
        self.notes.push(Note { kind: NoteKind::Overridden, cards, what });
        Some(given)
    }
}
