//! The commented template of a scene, and of a station: every key with its unit, range and meaning.

use super::keys::{KEYS, children};
use super::schema::{Given, Key, Kind};

/// A scene that works as it stands, with every other key commented out at its default.
pub(super) fn scene() -> String {
    let mut out = String::from(concat!(
        "# A scene of nightglass. Lines without # are in force; take the # off a line to change its key.\n",
        "# A value is the default unless the line says \"example\".\n",
        "# Angles in degrees east/north positive; times UTC; directions ICRS; px 0-based,\n",
        "# (0, 0) = centre of the first stored pixel. Relative paths are relative to this file.\n",
    ));
    for key in children("") {
        if key.is_table() {
            table(&mut out, key, LIVE);
        } else {
            line(&mut out, key, LIVE);
        }
    }
    out
}

/// A station file: the tables that `station.preset` fills in, with an example at every key it must have.
pub fn station() -> String {
    let mut out = String::from(concat!(
        "# A station of nightglass: copy it, fill it in, and write preset = \"FILE.toml\" in the\n",
        "# [station] of a scene.\n",
        "# Lines without # must be there, with the values of your station; the others show their defaults.\n",
    ));
    for key in children("").filter(|key| ["station", "telescope", "detector"].contains(&key.path)) {
        let must = |path: &str| {
            let key = KEYS.iter().find(|key| key.path == path);
            let example = key.and_then(|key| if let Given::Must(text) = key.given { Some(text) } else { None });
            example.filter(|_| path != "telescope.focal_length_m")
        };
        section(&mut out, key, &must);
    }
    out
}

/// Keys in force in the template, with their values.
const LIVE: &[(&str, &str)] = &[
    ("schema_version", "1"),
    ("seed", "1"),
    ("station.preset", "\"pogs\""),
    ("exposures.start", "2018-01-20T03:00:00Z"),
    ("exposures.count", "12"),
    ("exposures.cadence_s", "2700.0"),
    ("exposures.duration_s", "5.0"),
    ("target[].name", "\"GOES 14\""),
    (
        "target[].orbit.tle",
        concat!(
            "[\"1 35491U 09033A   18019.95817924 -.00000090  00000-0  00000-0 0  9991\",\n",
            "       \"2 35491   0.0698 263.4367 0009544 339.3413 117.1094  1.00271818 31371\"]",
        ),
    ),
    ("target[].brightness.mag_v", "11.8"),
];

type Live<'a> = &'a dyn Fn(&str) -> Option<&'static str>;

fn table(out: &mut String, key: &Key, live: &'static [(&str, &str)]) {
    section(out, key, &|path| live.iter().find(|(own, _)| *own == path).map(|(_, value)| *value));
}

fn line(out: &mut String, key: &Key, live: &'static [(&str, &str)]) {
    entry(out, key, &|path| live.iter().find(|(own, _)| *own == path).map(|(_, value)| *value), false);
}

/// A table, its keys, and the tables in it.
fn section(out: &mut String, key: &Key, live: Live) {
    let name = key.path.replace("[]", "");
    let head = match key.kind {
        Kind::Many => format!("[[{name}]]"),
        Kind::Named => format!("[{name}.NAME]"),
        _ => format!("[{name}]"),
    };
    let inside = if key.kind == Kind::Named { format!("{}.*", key.path) } else { key.path.to_string() };
    let mine = |other: &Key| other.path.starts_with(key.path) && live(other.path).is_some();
    let in_force = key.kind == Kind::Section && !key.path.contains("[]") || KEYS.iter().any(mine);
    let mark = if in_force { "" } else { "# " };
    out.push_str(&format!("\n{mark}{head}  # {}\n", key.doc));
    for child in children(&inside).filter(|child| !child.is_table()) {
        let station = child.kind == Kind::Preset && live(child.path).is_none();
        if !station {
            entry(out, child, live, !in_force);
        }
    }
    for child in children(&inside).filter(|child| child.is_table()) {
        section(out, child, live);
    }
}

/// One key with its value and, behind it, its meaning.
fn entry(out: &mut String, key: &Key, live: Live, commented: bool) {
    let (value, example) = match (live(key.path), key.given) {
        (Some(value), _) => (value, false),
        (None, Given::Is(value)) => (value, false),
        (None, Given::Must(value) | Given::From(value, _) | Given::Optional(value)) => (value, true),
        (None, Given::Nothing) => return,
    };
    let mark = if live(key.path).is_none() || commented { "# " } else { "" };
    let mut note = key.doc.to_string();
    if !matches!(key.kind, Kind::Text | Kind::Flag | Kind::Path | Kind::Preset | Kind::Time) {
        note += &format!("; must {}", key.allowed());
    }
    if let (true, Given::From(_, rule)) = (example, key.given) {
        note += &format!("; default: {rule}");
    }
    if let Some(condition) = key.condition() {
        note += &format!("; only with {condition}");
    }
    if example {
        note += " [example]";
    }
    let text = format!("{mark}{} = {value}", key.name());
    out.push_str(&format!("{text:<40}  # {note}\n"));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_template_names_every_key() {
        let text = scene();
        for key in KEYS.iter().filter(|key| !key.is_table()) {
            let named =
                text.lines().any(|l| l.trim_start_matches("# ").starts_with(&format!("{} = ", key.name())));
            assert!(named, "{}", key.path);
        }
    }

    #[test]
    fn the_station_template_is_the_file_in_the_repository() {
        assert_eq!(
            station(),
            include_str!("../../stations/template.toml"),
            "write station_template() to stations/template.toml"
        );
    }
}
