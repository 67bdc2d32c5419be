//! The part of YAML 1.1 that headers of ECSV tables use: block and flow mappings and sequences, plain and quoted
//! scalars folded over lines, literal and folded blocks, tags (which are passed over). Anchors, aliases and complex
//! keys are refused.

use serde_json::{Map, Number, Value as Json};

/// Deepest nesting that is read: a header is a handful deep.
const DEEPEST: usize = 32;

/// What is wrong, and in which of the lines, from 0.
pub(super) type Fault = (usize, String);

/// A line: its number from 0, the blanks before it and what follows.
#[derive(Clone)]
struct Line {
    number: usize,
    indent: usize,
    text: String,
}

/// The document in these lines, which is a mapping.
pub(super) fn parse(lines: &[&str]) -> Result<Map<String, Json>, Fault> {
    let lines = lines.iter().enumerate().map(|(number, text)| {
        let bare = text.trim_start_matches(' ');
        Line { number, indent: text.len() - bare.len(), text: bare.trim_end().to_owned() }
    });
    let mut blocks = Blocks { lines: lines.filter(|l| l.text != "---").collect(), at: 0 };
    let value = blocks.node(0, 0)?;
    if let Some(line) = blocks.peek() {
        return Err((line.number, format!("{:?} stands at no place of the structure before", line.text)));
    }
    match value {
        Json::Object(map) => Ok(map),
        Json::Null => Ok(Map::new()),
        _ => Err((0, "a header is a mapping key: value".to_owned())),
    }
}

struct Blocks {
    lines: Vec<Line>,
    at: usize,
}

impl Blocks {
    /// The next line with text, which is not a comment.
    fn peek(&mut self) -> Option<Line> {
        while self.lines.get(self.at).is_some_and(|l| l.text.is_empty() || l.text.starts_with('#')) {
            self.at += 1;
        }
        self.lines.get(self.at).cloned()
    }

    /// The mapping, sequence or scalar that starts at the next line, if that is indented by `least` at least.
    fn node(&mut self, least: usize, depth: usize) -> Result<Json, Fault> {
        let Some(line) = self.peek().filter(|l| l.indent >= least) else { return Ok(Json::Null) };
        if depth > DEEPEST {
            return Err((line.number, format!("nested more than {DEEPEST} deep")));
        }
        if is_item(&line.text) {
            return self.sequence(line.indent, depth);
        }
        if key_of(&line.text).is_some() {
            return self.mapping(line.indent, depth);
        }
        self.at += 1;
        self.value(&line, &line.text, line.indent.saturating_sub(1), depth)
    }

    fn sequence(&mut self, indent: usize, depth: usize) -> Result<Json, Fault> {
        let mut items = Vec::new();
        while let Some(line) = self.peek().filter(|l| l.indent == indent && is_item(&l.text)) {
            let rest = line.text.get(1..).unwrap_or("");
            let inner = rest.trim_start_matches(' ');
            if inner.is_empty() {
                self.at += 1;
                items.push(self.node(indent + 1, depth + 1)?);
                continue;
            }
            // what follows the dash is a line of its own, further in
            let inside = indent + 1 + rest.len() - inner.len();
            if let Some(slot) = self.lines.get_mut(self.at) {
                *slot = Line { number: line.number, indent: inside, text: inner.to_owned() };
            }
            items.push(self.node(inside, depth + 1)?);
        }
        Ok(Json::Array(items))
    }

    fn mapping(&mut self, indent: usize, depth: usize) -> Result<Json, Fault> {
        let mut map = Map::new();
        while let Some(line) = self.peek().filter(|l| l.indent == indent) {
            let Some((key, rest)) = key_of(&line.text) else { break };
            self.at += 1;
            let rest = untagged(rest);
            let value = if rest.is_empty() {
                // a sequence may stand as far out as its key
                let item = self.peek().is_some_and(|l| l.indent == indent && is_item(&l.text));
                if item { self.sequence(indent, depth + 1)? } else { self.node(indent + 1, depth + 1)? }
            } else if rest.starts_with(['|', '>']) {
                Json::String(self.literal(indent, rest))
            } else {
                self.value(&line, rest, indent, depth)?
            };
            map.insert(key, value);
        }
        Ok(Json::Object(map))
    }

    /// The text of a literal (`|`) or folded (`>`) block, the lines further in than `indent`.
    fn literal(&mut self, indent: usize, mark: &str) -> String {
        let mut parts: Vec<&str> = Vec::new();
        while let Some(line) = self.lines.get(self.at).filter(|l| l.text.is_empty() || l.indent > indent) {
            parts.push(&line.text);
            self.at += 1;
        }
        let join = if mark.starts_with('|') { "\n" } else { " " };
        let end = if mark.contains('-') { "" } else { "\n" };
        parts.join(join).trim_end().to_owned() + end
    }

    /// A flow value or scalar that starts with `text` and may go on in lines further in than `indent`.
    fn value(&mut self, line: &Line, text: &str, indent: usize, depth: usize) -> Result<Json, Fault> {
        let mut whole = text.to_owned();
        let mut blank = false;
        while let Some(next) = self.lines.get(self.at).filter(|l| l.text.is_empty() || l.indent > indent) {
            if next.text.is_empty() && !open(&whole) {
                break;
            }
            // an empty line in a folded scalar is a line's end; other ends are blanks
            match (next.text.is_empty(), blank) {
                (true, _) => whole.push('\n'),
                (false, true) => whole.push_str(&next.text),
                (false, false) => {
                    whole.push(' ');
                    whole.push_str(&next.text);
                }
            }
            blank = next.text.is_empty();
            self.at += 1;
        }
        let mut flow = Flow { rest: whole.trim() };
        let value = flow.value(&[], depth).map_err(|why| (line.number, why))?;
        match flow.rest.trim_start() {
            "" => Ok(value),
            rest if rest.starts_with('#') => Ok(value),
            rest => Err((line.number, format!("{rest:?} is left over"))),
        }
    }
}

fn is_item(text: &str) -> bool {
    text == "-" || text.starts_with("- ")
}

/// The text after a tag such as `!!omap`.
fn untagged(text: &str) -> &str {
    let text = text.trim_start();
    if !text.starts_with('!') {
        return text;
    }
    text.split_once(' ').map_or("", |(_, rest)| rest.trim_start())
}

/// The key of a line `key: value`, and the value.
fn key_of(text: &str) -> Option<(String, &str)> {
    let mut flow = Flow { rest: text };
    let key = if text.starts_with(['\'', '"']) {
        flow.quoted().ok()?
    } else {
        let end = text.find(": ").or_else(|| text.ends_with(':').then(|| text.len() - 1))?;
        flow.rest = text.get(end..)?;
        text.get(..end).filter(|k| !k.starts_with(['{', '[', '!', '&', '*', '?', '|', '>']))?.trim_end().to_owned()
    };
    flow.rest.trim_start().strip_prefix(':').filter(|r| r.is_empty() || r.starts_with(' ')).map(|rest| (key, rest))
}

/// Whether a quotation or a bracket of the text is not closed.
fn open(text: &str) -> bool {
    let (mut depth, mut quote, mut escaped, mut before) = (0i64, None, false, ' ');
    for c in text.chars() {
        match quote {
            Some('"') if escaped => escaped = false,
            Some('"') if c == '\\' => escaped = true,
            Some(q) if c == q => quote = None,
            Some(_) => {}
            None if matches!(c, '\'' | '"') && matches!(before, ' ' | '{' | '[' | ',' | ':' | '\'') => {
                quote = Some(c)
            }
            None if matches!(c, '{' | '[') => depth += 1,
            None if matches!(c, '}' | ']') => depth -= 1,
            None => {}
        }
        before = c;
    }
    quote.is_some() || depth > 0
}

/// A flow value that is being read.
struct Flow<'a> {
    rest: &'a str,
}

impl Flow<'_> {
    fn take(&mut self, c: char) -> bool {
        let trimmed = self.rest.trim_start();
        let found = trimmed.strip_prefix(c);
        self.rest = found.unwrap_or(trimmed);
        found.is_some()
    }

    /// A value; plain ones end before one of `ends`.
    fn value(&mut self, ends: &[char], depth: usize) -> Result<Json, String> {
        if depth > DEEPEST {
            return Err(format!("nested more than {DEEPEST} deep"));
        }
        self.rest = untagged(self.rest);
        if self.take('{') {
            let mut map = Map::new();
            while !self.take('}') {
                let key =
                    if self.rest.starts_with(['\'', '"']) { self.quoted()? } else { self.plain(&[':', ',', '}']) };
                let value = if self.take(':') { self.value(&[',', '}'], depth + 1)? } else { Json::Null };
                map.insert(key, value);
                self.next('}')?;
            }
            return Ok(Json::Object(map));
        }
        if self.take('[') {
            let mut items = Vec::new();
            while !self.take(']') {
                items.push(self.value(&[',', ']'], depth + 1)?);
                self.next(']')?;
            }
            return Ok(Json::Array(items));
        }
        match self.rest.chars().next() {
            Some('\'' | '"') => Ok(Json::String(self.quoted()?)),
            Some(c @ ('&' | '*' | '`' | '@' | '%')) => Err(format!("{c:?} starts no value that is read here")),
            _ => Ok(scalar(&self.plain(ends))),
        }
    }

    /// A comma, or that `end` follows.
    fn next(&mut self, end: char) -> Result<(), String> {
        if self.take(',') || self.rest.starts_with(end) {
            return Ok(());
        }
        Err(format!("a comma or {end:?} is missing before {:?}", self.rest))
    }

    fn plain(&mut self, ends: &[char]) -> String {
        // a colon ends a key only before a blank
        let ends_here = |k: usize, c: char| {
            let after = self.rest.get(k + c.len_utf8()..).unwrap_or("");
            let comment = c == '#' && self.rest.get(..k).is_some_and(|b| b.is_empty() || b.ends_with(' '));
            comment || (ends.contains(&c) && (c != ':' || after.is_empty() || after.starts_with(' ')))
        };
        let end = self.rest.char_indices().find(|(k, c)| ends_here(*k, *c)).map_or(self.rest.len(), |(k, _)| k);
        let (text, rest) = self.rest.split_at(end);
        self.rest = rest;
        text.trim().to_owned()
    }

    fn quoted(&mut self) -> Result<String, String> {
        let whole = self.rest;
        let mut chars = whole.char_indices().peekable();
        let quote = chars.next().map_or('"', |(_, c)| c);
        let mut text = String::new();
        while let Some((k, c)) = chars.next() {
            if c == quote {
                if quote == '\'' && chars.next_if(|(_, c)| *c == '\'').is_some() {
                    text.push('\'');
                    continue;
                }
                self.rest = whole.get(k + 1..).unwrap_or("");
                return Ok(text);
            }
            if c != '\\' || quote == '\'' {
                text.push(c);
                continue;
            }
            let (_, escaped) = chars.next().ok_or_else(|| format!("{whole:?} is not closed"))?;
            let digits = match escaped {
                'x' => 2,
                'u' => 4,
                'U' => 8,
                _ => 0,
            };
            let code = chars.by_ref().take(digits).map(|(_, c)| c).collect::<String>();
            text.push(match escaped {
                'n' => '\n',
                't' => '\t',
                'r' => '\r',
                '0' => '\0',
                'x' | 'u' | 'U' => {
                    u32::from_str_radix(&code, 16).ok().and_then(char::from_u32).unwrap_or('\u{fffd}')
                }
                other => other,
            });
        }
        Err(format!("{whole:?} is not closed"))
    }
}

/// A plain scalar as what it means: nothing, a truth value, a number, a text.
fn scalar(text: &str) -> Json {
    match text {
        "" | "~" | "null" | "Null" | "NULL" => return Json::Null,
        "true" | "True" | "TRUE" => return Json::Bool(true),
        "false" | "False" | "FALSE" => return Json::Bool(false),
        _ => {}
    }
    let number = text.starts_with(|c: char| c.is_ascii_digit() || matches!(c, '-' | '+' | '.'));
    let whole = text.parse::<i64>().ok().map(Number::from);
    let real = || text.parse::<f64>().ok().and_then(Number::from_f64);
    number.then(|| whole.or_else(real)).flatten().map_or_else(|| Json::String(text.to_owned()), Json::Number)
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
