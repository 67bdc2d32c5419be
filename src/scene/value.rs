//! One value against the form of its key: type, range, words, files, times and element sets.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};
use toml::Value as Plain;
use toml::value::{Datetime, Offset, Time};

use super::schema::{Content, Key, Kind, nearest};
use super::shaped::beside;
use super::tree::{Node, Value, plain};
use super::types::InputFile;
use crate::astro::attitude::Profile;
use crate::astro::orbit::elements::MeanElements;
use crate::astro::orbit::{oem::Ephemeris, omm, tle::Tle};
use crate::astro::scales::Scale;
use crate::astro::time::Instant;

/// Why a value will not do.
pub(super) enum Wrong {
    /// Not of the form or in the range of its key.
    Form,
    /// No word of the key's; the most similar one.
    Word(Option<&'static str>),
    /// Anything else, in words.
    Other(String),
    /// Several things, each in words.
    Each(Vec<String>),
}

type Words = &'static [&'static str];

/// Reads values, and notes the files they name.
#[derive(Default)]
pub(super) struct Reader {
    /// Files named so far.
    pub inputs: Vec<InputFile>,
    /// Name of the target whose keys are read.
    pub target: String,
}

impl Reader {
    /// The normal form of a value; tables are not for here.
    pub fn value(&mut self, key: &Key, node: &Node, full: &str) -> Result<Plain, Wrong> {
        let value = &node.value;
        match key.kind {
            Kind::Text => match value {
                Value::Text(text) if !text.trim().is_empty() && !text.contains(char::is_control) => {
                    Ok(text.as_str().into())
                }
                _ => Err(Wrong::Form),
            },
            Kind::Path => match value {
                Value::Text(name) if !name.trim().is_empty() => self.file(name, at(node, name), full),
                _ => Err(Wrong::Form),
            },
            Kind::File(content) => match value {
                Value::Text(name) if !name.trim().is_empty() => {
                    let path = at(node, name);
                    self.content(content, &path)?;
                    self.file(name, path, full)
                }
                _ => Err(Wrong::Form),
            },
            Kind::Flag => {
                if let Value::Flag(flag) = value {
                    Ok((*flag).into())
                } else {
                    Err(Wrong::Form)
                }
            }
            Kind::Int(low, high) => match value {
                Value::Int(int) if (low..=high).contains(int) => Ok((*int).into()),
                _ => Err(Wrong::Form),
            },
            Kind::IntOf(numbers) => match value {
                Value::Int(int) if numbers.contains(int) => Ok((*int).into()),
                _ => Err(Wrong::Form),
            },
            Kind::Real(low, high) => real(node, low, high),
            Kind::Above(low, high) => match real(node, low, high)? {
                Plain::Float(x) if x == low => Err(Wrong::Form),
                x => Ok(x),
            },
            Kind::Reals(count, low, high) => match value {
                Value::List(items) if items.len() == count => {
                    items.iter().map(|item| real(item, low, high)).collect::<Result<Vec<_>, _>>().map(Plain::Array)
                }
                _ => Err(Wrong::Form),
            },
            Kind::Size => size(value),
            Kind::Horizon => horizon(value),
            Kind::Domes => domes(value),
            Kind::Time => time(value).map(Plain::Datetime),
            Kind::Tle => self.tle(node),
            Kind::Word(known) => word(known, node),
            Kind::Words(known) => words(known, value),
            Kind::WordOrReal(known, low, high) => match value {
                Value::Text(_) => word(known, node),
                _ => real(node, low, high),
            },
            Kind::WordOrFile(known, _) => match word(known, node) {
                Err(Wrong::Word(near)) => {
                    let name = node.text().unwrap_or_default();
                    let path = at(node, name);
                    if !name.contains(['.', '/', '\\']) && !path.is_file() {
                        Err(Wrong::Word(near))
                    } else {
                        if key.path == "target[].shape" {
                            self.beside_shape(&path, full)?;
                        }
                        self.file(name, path, full)
                    }
                }
                other => other,
            },
            Kind::WordOrTable(known, _) => word(known, node),
            Kind::Crop => match value {
                Value::Text(_) => word(&["none", "target"], node),
                Value::List(items)
                    if items.len() == 4 && items.iter().all(|i| matches!(i.value, Value::Int(0..=65_536))) =>
                {
                    Ok(plain(value))
                }
                _ => Err(Wrong::Form),
            },
            Kind::Section | Kind::Maybe | Kind::Many | Kind::Named | Kind::Preset => Err(Wrong::Form),
        }
    }

    /// Whether a file holds what it should.
    fn content(&self, content: Content, path: &Path) -> Result<(), Wrong> {
        let text = text_of(path)?;
        let fault = |why: crate::astro::Error| Wrong::Other(why.to_string());
        match content {
            Content::Omm => message_for(&text, &self.target).map(|_| ()).map_err(Wrong::Other),
            Content::Oem => Ephemeris::parse(&text, &self.target).map(|_| ()).map_err(fault),
            Content::Attitude => Profile::table(&text).map(|_| ()).map_err(fault),
        }
    }

    /// Notes the files that a shape's file names beside itself; they keep their names, by which it names them.
    fn beside_shape(&mut self, path: &Path, full: &str) -> Result<(), Wrong> {
        for (number, other) in beside(path).map_err(Wrong::Other)?.into_iter().enumerate() {
            let name = other.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
            self.file(&name, other, &format!("{full}.beside.{number}"))?;
            if self.inputs.last().is_some_and(|noted| noted.name != name) {
                let message = format!("another file of the scene is named {name} too; rename one of them");
                return Err(Wrong::Other(message));
            }
        }
        Ok(())
    }

    /// Notes a file the scene names, with the hash of its content.
    fn file(&mut self, written: &str, path: PathBuf, full: &str) -> Result<Plain, Wrong> {
        let sha256 = hash(&path).map_err(|why| cannot_read(&path, &why))?;
        let own = path.file_name().map_or_else(|| "input".into(), |name| name.to_string_lossy().into_owned());
        let taken = |name: &str| self.inputs.iter().any(|other| other.name == name && other.sha256 != sha256);
        let mut name = own.clone();
        for number in 2.. {
            if !taken(&name) {
                break;
            }
            name = format!("{number}-{own}");
        }
        self.inputs.push(InputFile { key: full.into(), path, sha256, name });
        Ok(written.into())
    }

    /// The lines of an element set, from the scene or from the file it names.
    fn tle(&self, node: &Node) -> Result<Plain, Wrong> {
        let set = match &node.value {
            Value::Text(text) if text.contains('\n') => Tle::from_lines(&filled(text.lines())),
            Value::Text(name) => {
                let sets = Tle::all(&text_of(&at(node, name))?);
                chosen(sets, &self.target, "two-line element set", |set| set.name.as_deref())
            }
            Value::List(items) => {
                let lines: Option<Vec<&str>> = items.iter().map(Node::text).collect();
                Tle::from_lines(&lines.ok_or(Wrong::Form)?)
            }
            _ => return Err(Wrong::Form),
        };
        let set = set.map_err(Wrong::Other)?;
        let faults = set.faults();
        if !faults.is_empty() {
            return Err(Wrong::Each(faults));
        }
        set.elements().map_err(|why| Wrong::Other(why.to_string()))?;
        Ok(Plain::Array(set.name.into_iter().chain(set.lines).map(Plain::String).collect()))
    }
}

/// The text of a file.
pub(super) fn text_of(path: &Path) -> Result<String, Wrong> {
    let read = open(path).and_then(|mut file| {
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map(|_| bytes)
    });
    let bytes = read.map_err(|why| cannot_read(path, &why))?;
    let text = String::from_utf8_lossy(&bytes);
    // some editors put a mark of byte order first
    Ok(text.trim_start_matches('\u{feff}').to_owned())
}

/// The item for `target` in a file: the only one, or the one of that name.
fn chosen<T: Clone>(
    mut items: Vec<T>,
    target: &str,
    what: &str,
    name: impl Fn(&T) -> Option<&str>,
) -> Result<T, String> {
    if items.len() == 1 {
        return items.pop().ok_or_else(String::new);
    }
    if let Some(item) = items.iter().find(|item| name(item).is_some_and(|n| n.trim() == target.trim())) {
        return Ok(item.clone());
    }
    let near = nearest(target, items.iter().filter_map(&name));
    let near = near.map_or(String::new(), |name| format!("; nearest: \"{name}\""));
    match items.len() {
        0 => Err(format!("the file holds no {what}")),
        count => Err(format!("none of the {count} in the file is a {what} named \"{target}\"{near}")),
    }
}

/// The mean elements for `target` among a file's messages.
pub(super) fn message_for(text: &str, target: &str) -> Result<MeanElements, String> {
    let all = omm::all(text).map_err(|why| why.to_string())?;
    chosen(all, target, "message", |elements| elements.name.as_deref())
}

fn filled<'a>(lines: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    lines.filter(|line| !line.trim().is_empty()).collect()
}

/// A path as meant by the file it is written in.
pub(super) fn at(node: &Node, written: &str) -> PathBuf {
    node.place.source.base.as_deref().unwrap_or(Path::new("")).join(written)
}

fn cannot_read(path: &Path, why: &std::io::Error) -> Wrong {
    Wrong::Other(format!("cannot read {}: {why}", path.display()))
}

/// Opens a regular file; a directory, pipe or device is refused.
pub(super) fn open(path: &Path) -> std::io::Result<File> {
    if std::fs::metadata(path)?.is_file() { File::open(path) } else { Err(std::io::Error::other("not a file")) }
}

/// SHA-256 of a file, hexadecimal.
fn hash(path: &Path) -> std::io::Result<String> {
    let mut file = open(path)?;
    let mut sha = Sha256::new();
    let mut buffer = vec![0; 1 << 16];
    loop {
        match file.read(&mut buffer)? {
            0 => return Ok(hex(&sha.finalize())),
            count => sha.update(&buffer[..count]),
        }
    }
}

/// Bytes in hexadecimal.
pub(super) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn real(node: &Node, low: f64, high: f64) -> Result<Plain, Wrong> {
    match node.number() {
        Some(x) if low <= x && x <= high => Ok(Plain::Float(x)),
        _ => Err(Wrong::Form),
    }
}

fn word(known: Words, node: &Node) -> Result<Plain, Wrong> {
    let text = node.text().ok_or(Wrong::Form)?;
    if known.contains(&text) { Ok(text.into()) } else { Err(Wrong::Word(nearest(text, known.iter().copied()))) }
}

fn words(known: Words, value: &Value) -> Result<Plain, Wrong> {
    let Value::List(items) = value else { return Err(Wrong::Form) };
    let list = items.iter().map(|item| word(known, item)).collect::<Result<Vec<_>, _>>()?;
    match list.iter().enumerate().find(|(i, word)| list[..*i].contains(word)) {
        Some((_, twice)) => Err(Wrong::Other(format!("{twice} is there twice"))),
        None => Ok(Plain::Array(list)),
    }
}

fn size(value: &Value) -> Result<Plain, Wrong> {
    let side = |value: &Value| match value {
        Value::Int(side @ 1..=65_536) => Ok(Plain::Integer(*side)),
        _ => Err(Wrong::Form),
    };
    match value {
        Value::List(items) if items.len() == 2 => {
            items.iter().map(|item| side(&item.value)).collect::<Result<_, _>>().map(Plain::Array)
        }
        value => side(value).map(|side| Plain::Array(vec![side.clone(), side])),
    }
}

fn horizon(value: &Value) -> Result<Plain, Wrong> {
    let Value::List(items) = value else { return Err(Wrong::Form) };
    let mut before = -1.0;
    let mut pairs = Vec::new();
    for item in items {
        let Value::List(pair) = &item.value else { return Err(Wrong::Form) };
        let [azimuth, elevation] = pair.as_slice() else { return Err(Wrong::Form) };
        let (az, el) = (real(azimuth, 0.0, 360.0)?, real(elevation, -90.0, 90.0)?);
        match az {
            Plain::Float(degrees) if degrees > before => before = degrees,
            _ => return Err(Wrong::Form),
        }
        pairs.push(Plain::Array(vec![az, el]));
    }
    if pairs.is_empty() { Err(Wrong::Form) } else { Ok(Plain::Array(pairs)) }
}

fn domes(value: &Value) -> Result<Plain, Wrong> {
    let Value::List(items) = value else { return Err(Wrong::Form) };
    let (mut pairs, mut sum) = (Vec::new(), 0.0);
    for item in items {
        let Value::List(pair) = &item.value else { return Err(Wrong::Form) };
        let [azimuth, share] = pair.as_slice() else { return Err(Wrong::Form) };
        let (az, share) = (real(azimuth, 0.0, 360.0)?, real(share, 0.0, 1.0)?);
        if let Plain::Float(share) = share {
            sum += share;
        }
        pairs.push(Plain::Array(vec![az, share]));
    }
    if sum > 1.0 + 1e-9 { Err(Wrong::Form) } else { Ok(Plain::Array(pairs)) }
}

/// A time in normal form: date, time to the second, Z.
fn time(value: &Value) -> Result<Datetime, Wrong> {
    let given = match value {
        Value::Time(time) => *time,
        Value::Text(text) => text.trim().parse().map_err(|_| Wrong::Form)?,
        _ => return Err(Wrong::Form),
    };
    if let Some(Offset::Custom { minutes }) = given.offset
        && minutes != 0
    {
        return Err(Wrong::Other("times are UTC; write it with Z, not with a local offset".into()));
    }
    let time = given.time.ok_or(Wrong::Form)?;
    let nanosecond = time.nanosecond.filter(|ns| *ns != 0);
    let time = Time { second: Some(time.second.unwrap_or(0)), nanosecond, ..time };
    let normal = Datetime { date: given.date, time: Some(time), offset: Some(Offset::Z) };
    match normal.date {
        Some(date) if (1957..=2099).contains(&date.year) && epoch(&normal).is_some() => Ok(normal),
        _ => Err(Wrong::Form),
    }
}

/// The instant of a time in normal form.
pub(super) fn epoch(time: &Datetime) -> Option<Instant> {
    let (date, clock) = (time.date?, time.time?);
    let text = format!("{date}T{clock}");
    Instant::from_iso(&text, Scale::Utc).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(text: &str) -> Option<String> {
        time(&Value::Text(text.into())).ok().map(|time| time.to_string())
    }

    #[test]
    fn times_are_utc_in_one_form() {
        for text in
            ["2018-01-15T04:00:00Z", "2018-01-15 04:00:00+00:00", "2018-01-15T04:00:00", "2018-01-15T04:00Z"]
        {
            assert_eq!(shown(text).as_deref(), Some("2018-01-15T04:00:00Z"), "{text}");
        }
        assert_eq!(shown("2016-12-31T23:59:60Z").as_deref(), Some("2016-12-31T23:59:60Z"));
        for text in [
            "2018-01-15T04:00:60Z",
            "2017-12-31T23:59:60Z",
            "2018-01-15",
            "2018-01-15T04:00:00+01:00",
            "1956-12-31T00:00:00Z",
            "2018-02-30T00:00:00Z",
            "x",
        ] {
            assert_eq!(shown(text), None, "{text}");
        }
    }
}
