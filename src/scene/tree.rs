//! A parsed TOML tree whose every node knows where it was written: a built-in or station file, the scene, or
//! `--set`. A later rank outranks an earlier one.

use std::path::PathBuf;
use std::rc::Rc;

use toml::Spanned;
use toml::de::{DeTable, DeValue};
use toml::value::Datetime;

/// How much a source's word counts; later wins.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Rank {
    /// A station file.
    Station,
    /// The scene file.
    Scene,
    /// The command line.
    Set,
}

/// Where a text came from.
#[derive(Debug)]
pub(super) struct Source {
    /// Name to show.
    pub origin: String,
    /// Directory its relative paths refer to.
    pub base: Option<PathBuf>,
    /// How much it counts.
    pub rank: Rank,
}

/// Where a node was written.
#[derive(Clone, Debug)]
pub(super) struct Place {
    /// The file or argument.
    pub source: Rc<Source>,
    /// Line, from 1.
    pub line: Option<usize>,
}

/// A value.
#[derive(Clone, Debug)]
pub(super) enum Value {
    Text(String),
    Int(i64),
    /// An integer beyond 64 bits, or a number that does not parse.
    Odd(String),
    Real(f64),
    Flag(bool),
    Time(Datetime),
    List(Vec<Node>),
    Table(Entries),
}

/// Keys and values of a table, in order.
pub(super) type Entries = Vec<(String, Node)>;

/// A value and where it was written.
#[derive(Clone, Debug)]
pub(super) struct Node {
    pub value: Value,
    pub place: Place,
}

/// The value of a key, if it is there.
pub(super) fn entry<'a>(entries: &'a Entries, name: &str) -> Option<&'a Node> {
    entries.iter().find(|(key, _)| key == name).map(|(_, node)| node)
}

/// Whether the scene has targets, well written or not.
pub(super) fn has_targets(root: &Node) -> bool {
    let target = root.entries().and_then(|all| entry(all, "target"));
    target.is_some_and(|node| !matches!(&node.value, Value::List(items) if items.is_empty()))
}

impl Node {
    /// The entries, if this is a table.
    pub fn entries(&self) -> Option<&Entries> {
        if let Value::Table(entries) = &self.value { Some(entries) } else { None }
    }

    /// The entries, if this is a table.
    pub fn entries_mut(&mut self) -> Option<&mut Entries> {
        if let Value::Table(entries) = &mut self.value { Some(entries) } else { None }
    }

    /// The text, if this is one.
    pub fn text(&self) -> Option<&str> {
        if let Value::Text(text) = &self.value { Some(text) } else { None }
    }

    /// The number, if this is one.
    pub fn number(&self) -> Option<f64> {
        match self.value {
            Value::Int(int) => Some(int as f64),
            Value::Real(real) => Some(real),
            _ => None,
        }
    }

    /// The node at a dotted path, or the last one there is on the way.
    pub fn towards(&self, path: &str) -> &Node {
        let mut node = self;
        for part in path.split('.') {
            let next = match &node.value {
                Value::Table(entries) => entry(entries, part),
                Value::List(items) => part.parse::<usize>().ok().and_then(|index| items.get(index)),
                _ => None,
            };
            match next {
                Some(next) => node = next,
                None => break,
            }
        }
        node
    }

    /// Puts a node at a dotted path; tables on the way are made as needed, list elements must be there.
    pub fn set(&mut self, path: &str, new: Node) -> Result<(), String> {
        let parts: Vec<&str> = path.split('.').map(str::trim).collect();
        if parts.iter().any(|part| part.is_empty()) || parts.len() > 16 {
            return Err(format!("\"{path}\" is no key path; write it as in target.0.brightness.mag_v"));
        }
        let mut node = self;
        for (depth, part) in parts.iter().enumerate() {
            let above = parts[..depth].join(".");
            let fresh = Node { value: Value::Table(Vec::new()), place: new.place.clone() };
            node = match &mut node.value {
                Value::Table(entries) => {
                    let index = entries.iter().position(|(key, _)| key == part).unwrap_or_else(|| {
                        entries.push(((*part).to_string(), fresh));
                        entries.len() - 1
                    });
                    &mut entries[index].1
                }
                Value::List(items) => {
                    let count = items.len();
                    match part.parse::<usize>().ok().and_then(|index| items.get_mut(index)) {
                        Some(item) => item,
                        None => {
                            return Err(format!(
                                "{path}: {above} is a list of {count}, {part} is not an index of it"
                            ));
                        }
                    }
                }
                _ => return Err(format!("{path}: {above} is not a table")),
            };
        }
        *node = new;
        Ok(())
    }
}

/// Shows a value as TOML would, cut at 60 characters.
pub(super) fn show(value: &Value) -> String {
    let text = plain(value).to_string().trim_end().replace('\n', ", ");
    if text.chars().count() <= 60 { text } else { text.chars().take(57).collect::<String>() + "..." }
}

/// The same value without places.
pub(super) fn plain(value: &Value) -> toml::Value {
    match value {
        Value::Text(text) | Value::Odd(text) => toml::Value::String(text.clone()),
        Value::Int(int) => toml::Value::Integer(*int),
        Value::Real(real) => toml::Value::Float(*real),
        Value::Flag(flag) => toml::Value::Boolean(*flag),
        Value::Time(time) => toml::Value::Datetime(*time),
        Value::List(items) => toml::Value::Array(items.iter().map(|item| plain(&item.value)).collect()),
        Value::Table(entries) => {
            toml::Value::Table(entries.iter().map(|(key, node)| (key.clone(), plain(&node.value))).collect())
        }
    }
}

/// Parses a TOML text; a fault is a message and its line.
pub(super) fn parse(text: &str, source: &Rc<Source>) -> Result<Node, (String, Option<usize>)> {
    let lines = Lines::of(text);
    let table = DeTable::parse(text).map_err(|error| {
        let message = error.message().replace('\n', ", ");
        match error.span() {
            Some(span) => {
                let (line, column) = lines.find(text, span.start);
                (format!("not TOML: {message} (column {column})"), Some(line))
            }
            None => (format!("not TOML: {message}"), None),
        }
    })?;
    let place = Place { source: source.clone(), line: None };
    Ok(Node { value: convert_table(table.get_ref(), source, Some(&lines)), place })
}

/// Parses one TOML value; what is none is text.
pub(super) fn parse_value(text: &str, source: &Rc<Source>) -> Node {
    let place = Place { source: source.clone(), line: None };
    match DeValue::parse(text.trim()) {
        Ok(value) => Node { value: convert(value.get_ref(), source, None), place },
        Err(_) => Node { value: Value::Text(text.to_string()), place },
    }
}

fn convert_table(table: &DeTable<'_>, source: &Rc<Source>, lines: Option<&Lines>) -> Value {
    let node = |key: &Spanned<_>, value: &Spanned<DeValue<'_>>| Node {
        value: convert(value.get_ref(), source, lines),
        place: Place { source: source.clone(), line: lines.map(|l| l.line(key.span().start)) },
    };
    Value::Table(table.iter().map(|(key, value)| (key.get_ref().to_string(), node(key, value))).collect())
}

fn convert(value: &DeValue<'_>, source: &Rc<Source>, lines: Option<&Lines>) -> Value {
    match value {
        DeValue::String(text) => Value::Text(text.to_string()),
        DeValue::Integer(int) => match i64::from_str_radix(int.as_str(), int.radix()) {
            Ok(value) => Value::Int(value),
            Err(_) => Value::Odd(int.to_string()),
        },
        DeValue::Float(real) => match real.as_str().parse() {
            Ok(value) => Value::Real(value),
            Err(_) => Value::Odd(real.to_string()),
        },
        DeValue::Boolean(flag) => Value::Flag(*flag),
        DeValue::Datetime(time) => Value::Time(*time),
        DeValue::Array(items) => {
            let node = |item: &Spanned<DeValue<'_>>| Node {
                value: convert(item.get_ref(), source, lines),
                place: Place { source: source.clone(), line: lines.map(|l| l.line(item.span().start)) },
            };
            Value::List(items.iter().map(node).collect())
        }
        DeValue::Table(table) => convert_table(table, source, lines),
    }
}

/// Where the lines of a text begin.
struct Lines(Vec<usize>);

impl Lines {
    fn of(text: &str) -> Self {
        Self(std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect())
    }

    fn line(&self, at: usize) -> usize {
        self.0.partition_point(|start| *start <= at)
    }

    fn find(&self, text: &str, at: usize) -> (usize, usize) {
        let line = self.line(at);
        let start = self.0.get(line.saturating_sub(1)).copied().unwrap_or(0);
        (line, text.get(start..at).map_or(0, |before| before.chars().count()) + 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn source() -> Rc<Source> {
        Rc::new(Source { origin: "t.toml".into(), base: None, rank: Rank::Scene })
    }

    #[test]
    fn nodes_know_their_lines() {
        let node =
            parse("a = 1\n[b]\nc = [\n 1.5,\n 2.5]\n[[d]]\n[[d]]\ne = 2018-01-15T04:00:00Z\n", &source()).unwrap();
        assert_eq!(node.towards("b").place.line, Some(2));
        assert_eq!(node.towards("b.c.1").place.line, Some(5));
        assert_eq!(node.towards("d.1.e").place.line, Some(8));
    }

    #[test]
    fn a_syntax_error_names_line_and_column() {
        let (message, line) = parse("a = 1\nb = = 2\n", &source()).unwrap_err();
        assert_eq!(line, Some(2));
        assert!(message.contains("column 5"), "{message}");
    }

    #[test]
    fn set_reaches_into_lists_and_makes_tables() {
        let mut node = parse("[[t]]\nx = 1\n", &source()).unwrap();
        node.set("t.0.y.z", parse_value("2.5", &source())).unwrap();
        assert_eq!(node.towards("t.0.y.z").number(), Some(2.5));
        assert!(node.set("t.1.x", parse_value("2", &source())).is_err());
        assert!(node.set("t.0.x.y", parse_value("2", &source())).is_err());
        assert!(node.set("a..b", parse_value("2", &source())).is_err());
        assert_eq!(parse_value("GOES 14", &source()).text(), Some("GOES 14"));
    }
}
