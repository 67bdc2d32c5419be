//! What was assumed, found contradictory, passed over or refused while a header was read.

use std::fmt;

/// What a note is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoteKind {
    /// The header leaves it open; the usual meaning was taken.
    Assumed,
    /// Two cards cannot both be right.
    Contradictory,
    /// A card was passed over: a placeholder, or of another meaning than its name says.
    Ignored,
    /// A card has a value that cannot be used.
    Refused,
    /// The user's value replaces the header's.
    Overridden,
}

impl NoteKind {
    fn name(self) -> &'static str {
        match self {
            Self::Assumed => "assumed",
            Self::Contradictory => "contradictory",
            Self::Ignored => "ignored",
            Self::Refused => "refused",
            Self::Overridden => "overridden",
        }
    }
}

/// One remark on the reading of a header.
#[derive(Debug, Clone, PartialEq)]
pub struct Note {
    /// What it is about.
    pub kind: NoteKind,
    /// The cards concerned: keyword (or command line option) and value as read.
    pub cards: Vec<(String, String)>,
    /// What was done, and why.
    pub what: String,
}

impl Note {
    /// True if the note is about that keyword.
    pub fn concerns(&self, keyword: &str) -> bool {
        self.cards.iter().any(|(k, _)| k == keyword)
    }
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: ", self.kind.name())?;
        for (k, (keyword, value)) in self.cards.iter().enumerate() {
            let comma = if k > 0 { ", " } else { "" };
            write!(f, "{comma}{keyword} = {value}")?;
        }
        let colon = if self.cards.is_empty() { "" } else { ": " };
        write!(f, "{colon}{}", self.what)
    }
}
