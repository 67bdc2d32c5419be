//! Walks a scene's tree against the table of keys, fills in defaults and collects every fault.
//!
//! Out comes a plain TOML table with every key of the format in its place and normal form (numbers as floats
//! where the key is one, times ending in Z, element sets as lines), and the files the scene names.

use super::fault::Fault;
use super::keys::{KEYS, children};
use super::schema::{Given, Key, Kind, ONE_OF, group_of, nearest};
use super::tree::{Entries, Node, Place, Value, entry, has_targets, parse_value, show};
use super::value::{Reader, Wrong};
use crate::astro::observer::standard_pressure_hpa;

/// Walks one scene.
pub(super) struct Checker<'a> {
    /// The whole tree.
    pub root: &'a Node,
    /// Name of the scene unless given.
    pub stem: &'a str,
    /// True where a station preset could not be read: what it would have filled in is not missed.
    pub preset_failed: bool,
    /// Faults so far.
    pub faults: Vec<Fault>,
    /// Reads the values; knows the files they name.
    pub reader: Reader,
}

impl<'a> Checker<'a> {
    /// Ready to walk `root`.
    pub fn new(root: &'a Node, stem: &'a str, preset_failed: bool) -> Self {
        Self { root, stem, preset_failed, faults: Vec::new(), reader: Reader::default() }
    }

    /// Walks the whole tree.
    pub fn scene(&mut self) -> toml::Table {
        let root = self.root;
        self.table(root.entries(), &root.place, "", "")
    }

    /// Walks one table: its form is `schema`, its place in the scene `path`.
    fn table(&mut self, entries: Option<&Entries>, place: &Place, schema: &str, path: &str) -> toml::Table {
        let mut out = toml::Table::new();
        let none = Entries::new();
        let entries = entries.unwrap_or(&none);
        for key in children(schema).filter(|key| key.kind != Kind::Preset) {
            let full = join(path, key.name());
            let value = match entry(entries, key.name()) {
                Some(node) if key.is_table() => self.subtable(key, node, &full),
                None if key.kind == Kind::Section => {
                    Some(toml::Value::Table(self.table(None, place, key.path, &full)))
                }
                None if key.is_table() => None,
                node => self.leaf(key, node, entries, place, &full),
            };
            if let Some(value) = value {
                out.insert(key.name().into(), value);
            }
        }
        self.missing_group(entries, place, schema, path);
        self.unknown(entries, schema, path);
        out
    }

    fn subtable(&mut self, key: &Key, node: &Node, full: &str) -> Option<toml::Value> {
        match (key.kind, &node.value) {
            (Kind::Many, Value::List(items)) => {
                let mut tables = Vec::new();
                for (i, item) in items.iter().enumerate() {
                    let full = format!("{full}.{i}");
                    match &item.value {
                        Value::Table(entries) => {
                            self.reader.target = entry(entries, "name").and_then(Node::text).unwrap_or("").into();
                            tables.push(self.table(Some(entries), &item.place, key.path, &full).into())
                        }
                        _ => self.must(key, item, &full),
                    }
                }
                (!tables.is_empty()).then_some(toml::Value::Array(tables))
            }
            (Kind::Named, Value::Table(groups)) => {
                let form = format!("{}.*", key.path);
                let mut tables = toml::Table::new();
                for (name, group) in groups {
                    let full = join(full, name);
                    match &group.value {
                        Value::Table(entries) => {
                            let table = self.table(Some(entries), &group.place, &form, &full);
                            tables.insert(name.clone(), table.into());
                        }
                        _ => self.fault(
                            &full,
                            &group.place,
                            format!("{full} = {}: must be a table", show(&group.value)),
                        ),
                    }
                }
                Some(tables.into())
            }
            (Kind::Section | Kind::Maybe, Value::Table(entries)) => {
                Some(self.table(Some(entries), &node.place, key.path, full).into())
            }
            _ => {
                self.must(key, node, full);
                None
            }
        }
    }

    /// A table with the keys of `schema` where a word could stand.
    fn stand_in(&mut self, entries: &Entries, place: &Place, schema: &str, path: &str) -> toml::Value {
        self.table(Some(entries), place, schema, path).into()
    }

    fn leaf(
        &mut self,
        key: &Key,
        node: Option<&Node>,
        all: &Entries,
        place: &Place,
        full: &str,
    ) -> Option<toml::Value> {
        if let Some((selector, _)) = key.when
            && !key.applies(self.selected(key.parent(), selector, all).as_deref())
        {
            if let (Some(node), Some(condition)) = (node, key.condition()) {
                self.fault(full, &node.place, format!("{full} = {}: only with {condition}", show(&node.value)));
            }
            return None;
        }
        let Some(node) = node else { return self.default(key, all, place, full) };
        let read = match (key.kind, &node.value) {
            (Kind::WordOrTable(_, schema), Value::Table(entries)) => {
                Ok(self.stand_in(entries, &node.place, schema, full))
            }
            _ => self.reader.value(key, node, full),
        };
        match read {
            Ok(value) => Some(value),
            Err(wrong) => {
                match wrong {
                    Wrong::Form => self.must(key, node, full),
                    Wrong::Word(near) => {
                        let near = near.map_or(String::new(), |word| format!("; nearest: \"{word}\""));
                        let message = format!("{full} = {}: must {}{near}", show(&node.value), key.allowed());
                        self.fault(full, &node.place, message);
                    }
                    Wrong::Each(messages) => {
                        for message in messages {
                            self.fault(full, &node.place, format!("{full}: {message}"));
                        }
                    }
                    Wrong::Other(message) => {
                        self.fault(full, &node.place, format!("{full} = {}: {message}", show(&node.value)));
                    }
                }
                None
            }
        }
    }

    /// The text of a selector, written or by default.
    fn selected(&self, table: &str, selector: &str, all: &Entries) -> Option<String> {
        if let Some(node) = entry(all, selector) {
            return node.text().map(str::to_string);
        }
        let key = children(table).find(|key| key.name() == selector)?;
        match key.given {
            Given::From(..) => self.derived(key.path, all),
            _ => self.given(key),
        }
        .and_then(|value| value.as_str().map(str::to_string))
    }

    /// The fixed default of a key.
    fn given(&self, key: &Key) -> Option<toml::Value> {
        let Given::Is(text) = key.given else { return None };
        let node = parse_value(text, &self.root.place.source);
        Reader::default().value(key, &node, "").ok()
    }

    fn default(&mut self, key: &Key, all: &Entries, place: &Place, full: &str) -> Option<toml::Value> {
        match key.given {
            _ if group_of(key).is_some() => None,
            Given::Is(_) => self.given(key),
            Given::From(..) => {
                let value = self.derived(key.path, all);
                if value.is_none() && key.path == "pointing.at" {
                    let why = "without a [[target]] it must be \"radec\" or \"azel\"";
                    self.fault(full, place, format!("{full} is required: {why}"));
                }
                value
            }
            Given::Must(example) => {
                let from_preset = ["station", "telescope", "detector"].contains(&key.parent());
                if !(from_preset && self.preset_failed) {
                    let preset = if from_preset { ", or give station.preset" } else { "" };
                    let example =
                        if key.kind == Kind::Time { String::new() } else { format!(", such as {example}") };
                    let must = format!("{full} is required: it must {}{example}{preset}", key.allowed());
                    self.fault(full, place, must);
                }
                None
            }
            Given::Optional(_) | Given::Nothing => None,
        }
    }

    /// Defaults that follow from other keys.
    fn derived(&self, path: &str, siblings: &Entries) -> Option<toml::Value> {
        let number = |name| entry(siblings, name).and_then(Node::number).filter(|x| x.is_finite());
        let has_target = has_targets(self.root);
        match path {
            "name" => Some(self.stem.into()),
            "station.pressure_hpa" => {
                // good to 1 % up to 11 km, and air is thin beyond
                let pressure_pa = libm::round(100.0 * standard_pressure_hpa(number("height_m")?));
                Some(toml::Value::Float(pressure_pa / 100.0))
            }
            "pointing.at" => has_target.then(|| "target".into()),
            "target[].attitude.epoch" => {
                let start = self.root.towards("exposures.start");
                let key = KEYS.iter().find(|key| key.path == "exposures.start")?;
                Reader::default().value(key, start, "").ok()
            }
            "exposures.cadence_s" => number("duration_s").map(toml::Value::Float),
            "exposures.track" => Some(if has_target { "target" } else { "sidereal" }.into()),
            _ => None,
        }
    }

    fn missing_group(&mut self, entries: &Entries, place: &Place, schema: &str, path: &str) {
        for (_, members) in ONE_OF.iter().filter(|(table, _)| *table == schema) {
            let absent = members.iter().all(|name| entry(entries, name).is_none());
            if absent && !(self.preset_failed && schema == "telescope") {
                let preset = if schema == "telescope" { ", or give station.preset" } else { "" };
                self.fault(path, place, format!("{path}: one of {} is required{preset}", members.join(", ")));
            }
        }
    }

    fn unknown(&mut self, entries: &Entries, schema: &str, path: &str) {
        for (name, node) in entries.iter().filter(|(name, _)| children(schema).all(|key| key.name() != *name)) {
            let full = join(path, name);
            let near = match nearest(name, children(schema).map(Key::name)) {
                Some(own) if strsim::jaro_winkler(own, name) > 0.9 => Some(own.to_string()),
                own => elsewhere(name).or(own.map(str::to_string)),
            };
            let near = match near {
                Some(name) => format!("; nearest: {name}"),
                None => format!("; known: {}", children(schema).map(Key::name).collect::<Vec<_>>().join(", ")),
            };
            let inside = if path.is_empty() { String::new() } else { format!(" in [{path}]") };
            let what = if node.entries().is_some() { "table" } else { "key" };
            self.fault(&full, &node.place, format!("unknown {what} \"{name}\"{inside}{near}"));
        }
    }

    fn must(&mut self, key: &Key, node: &Node, full: &str) {
        self.fault(full, &node.place, format!("{full} = {}: must {}", show(&node.value), key.allowed()));
    }

    fn fault(&mut self, path: &str, place: &Place, message: String) {
        self.faults.push(Fault::new(path, place, message));
    }
}

/// The same name in another table, as a path.
fn elsewhere(name: &str) -> Option<String> {
    KEYS.iter().find(|key| key.name() == name && !key.path.contains('*')).map(|key| key.path.replace("[]", ".0"))
}

fn join(path: &str, name: &str) -> String {
    if path.is_empty() { name.into() } else { format!("{path}.{name}") }
}
