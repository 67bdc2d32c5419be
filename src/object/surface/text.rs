//! Lines of OBJ and MTL text: comments, continuations and numbers.

use std::borrow::Cow;

use super::error::ReadError;

/// Longest piece of a file that an error message repeats \[characters\].
const SHOWN: usize = 40;

/// A statement: one line, or several joined by backslashes.
pub(super) struct Statement<'a> {
    /// Where it begins, from 1.
    pub line: usize,
    text: Cow<'a, str>,
}

impl Statement<'_> {
    /// Its first word.
    pub fn keyword(&self) -> &str {
        self.text.split_whitespace().next().unwrap_or("")
    }

    /// What follows the first word, without blanks around it.
    pub fn rest(&self) -> &str {
        self.text.trim_start().split_once(char::is_whitespace).map_or("", |(_, rest)| rest.trim())
    }

    /// The words after the first.
    pub fn words(&self) -> impl Iterator<Item = &str> {
        self.text.split_whitespace().skip(1)
    }

    /// The first `N` values.
    pub fn numbers<const N: usize>(&self, allowed: &'static str) -> Result<[f64; N], ReadError> {
        let mut values = [0.0; N];
        let mut words = self.words();
        for (found, value) in values.iter_mut().enumerate() {
            let word = words.next().ok_or_else(|| self.count(found, allowed))?;
            *value = number(word, self.line)?;
        }
        Ok(values)
    }

    /// That it has this many values, which is not what it takes.
    pub fn count(&self, found: usize, allowed: &'static str) -> ReadError {
        ReadError::Count { line: self.line, statement: shown(self.keyword()), found, allowed }
    }
}

/// The statements of a text; blank lines and comments are gone, a byte order mark too.
pub(super) fn statements(text: &str) -> Vec<Statement<'_>> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut out: Vec<Statement> = Vec::new();
    let mut continued = false;
    for (line, raw) in (1..).zip(text.lines()) {
        let code = without_comment(raw).trim_end();
        let (code, goes_on) = code.strip_suffix('\\').map_or((code, false), |code| (code, true));
        match out.last_mut().filter(|_| continued) {
            Some(last) => last.text.to_mut().extend([" ", code]),
            None => out.push(Statement { line, text: Cow::Borrowed(code) }),
        }
        continued = goes_on;
    }
    out.retain(|statement| !statement.text.trim().is_empty());
    out
}

/// A line up to its comment, which begins at a # that begins a word.
fn without_comment(line: &str) -> &str {
    let begins = |at: &usize| {
        line.get(..*at).is_none_or(|before| before.is_empty() || before.ends_with(char::is_whitespace))
    };
    let end = line.match_indices('#').map(|(at, _)| at).find(begins);
    end.and_then(|end| line.get(..end)).unwrap_or(line)
}

/// A finite number.
pub(super) fn number(word: &str, line: usize) -> Result<f64, ReadError> {
    let value = word.parse().ok().filter(|value: &f64| value.is_finite());
    value.ok_or_else(|| ReadError::Number { line, token: shown(word) })
}

/// The beginning of a piece of a file, for a message.
pub(super) fn shown(word: &str) -> String {
    word.chars().take(SHOWN).collect()
}

/// A name as it can be written: what would end the line, begin a comment or continue the line becomes an underscore.
pub(super) fn writable(name: &str) -> String {
    let unfit = |c: char| c.is_control() || matches!(c, '#' | '\\' | '\u{feff}');
    name.trim().replace(unfit, "_")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statements_keep_their_lines() {
        let text = "\u{feff}# head \\\r\nv 1 2\\\r\n 3 # three\r\n\r\n  usemtl  a  #b\nusemtl a#b\nf 1 \\";
        let all: Vec<_> =
            statements(text).iter().map(|s| (s.line, s.keyword().to_owned(), s.rest().to_owned())).collect();
        let expected = [(2, "v", "1 2  3"), (5, "usemtl", "a"), (6, "usemtl", "a#b"), (7, "f", "1")]
            .map(|(l, k, r)| (l, k.into(), r.into()));
        assert_eq!(all, expected);
    }

    #[test]
    fn only_finite_numbers_are_numbers() {
        for word in ["inf", "NaN", "1e400", "1,5", "", "0x1"] {
            assert!(number(word, 3).is_err(), "{word}");
        }
        assert_eq!(number("-.5e1", 3), Ok(-5.0));
        assert_eq!(number("x", 3).unwrap_err().to_string(), "line 3: \"x\" is not a finite number");
    }
}
