//! The form of a scene file: what a table or key may hold, its unit, range, default and meaning.
//!
//! The list itself is in `keys`. Checks, defaults, the commented template and the JSON
//! Schema all follow from it, so a key is described once.

/// What a key holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    /// A table that is always there; left out, its keys take their defaults.
    Section,
    /// A table that is there only if written.
    Maybe,
    /// An array of tables.
    Many,
    /// A table of tables of free names.
    Named,
    /// Name of a built-in station, or a station file.
    Preset,
    /// Text.
    Text,
    /// Name of a file that is not read.
    Path,
    /// A file of that content.
    File(Content),
    /// True or false.
    Flag,
    /// An integer from, to.
    Int(i64, i64),
    /// One of some integers.
    IntOf(&'static [i64]),
    /// A number from, to.
    Real(f64, f64),
    /// A number above, to.
    Above(f64, f64),
    /// So many numbers, each from, to.
    Reals(usize, f64, f64),
    /// One or two positive integers: width and height.
    Size,
    /// Pairs of azimuth and elevation.
    Horizon,
    /// Pairs of azimuth and share, the shares 1 together at most.
    Domes,
    /// An instant in UTC.
    Time,
    /// Lines of a two-line element set, or the file with it.
    Tle,
    /// One of some words.
    Word(&'static [&'static str]),
    /// A list of such words.
    Words(&'static [&'static str]),
    /// Such a word or a number from, to.
    WordOrReal(&'static [&'static str], f64, f64),
    /// Such a word or a file: what the file is.
    WordOrFile(&'static [&'static str], &'static str),
    /// One of some words, or a table with the keys of that table.
    WordOrTable(&'static [&'static str], &'static str),
    /// A word, or x0, y0, width, height.
    Crop,
}

/// What a file named by a key holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Content {
    /// An orbit mean-elements message.
    Omm,
    /// An orbit ephemeris message.
    Oem,
    /// Quaternions at times.
    Attitude,
}

impl Content {
    /// In words.
    pub fn describe(self) -> &'static str {
        match self {
            Self::Omm => "a file with an orbit mean-elements message: KVN, XML or JSON",
            Self::Oem => "a file with an orbit ephemeris message: KVN or XML",
            Self::Attitude => "a CSV of time_utc, q0, q1, q2, q3",
        }
    }
}

/// What happens when a key is left out. Values are TOML.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Given {
    /// It may not be; an example.
    Must(&'static str),
    /// This default.
    Is(&'static str),
    /// A default that follows from other keys: an example, and the rule in words.
    From(&'static str, &'static str),
    /// Nothing; an example.
    Optional(&'static str),
    /// For tables.
    Nothing,
}

/// One table or key.
#[derive(Clone, Copy, Debug)]
pub(super) struct Key {
    /// Path; `[]` stands for the index of an array of tables and `*` for a free name.
    pub path: &'static str,
    /// What it holds.
    pub kind: Kind,
    /// Unit, or nothing.
    pub unit: &'static str,
    /// What happens when it is left out.
    pub given: Given,
    /// Meaning, in a line.
    pub doc: &'static str,
    /// Applies only with this sibling at this value, or at one of several between bars.
    pub when: Option<(&'static str, &'static str)>,
}

impl Key {
    /// A key.
    pub const fn new(path: &'static str, kind: Kind, unit: &'static str, given: Given, doc: &'static str) -> Self {
        Self { path, kind, unit, given, doc, when: None }
    }

    /// A table.
    pub const fn table(path: &'static str, kind: Kind, doc: &'static str) -> Self {
        Self::new(path, kind, "", Given::Nothing, doc)
    }

    /// The same, only with a sibling at a value, or at one of several between bars.
    pub const fn when(mut self, selector: &'static str, value: &'static str) -> Self {
        self.when = Some((selector, value));
        self
    }

    /// Whether it applies with its selector at `found`.
    pub fn applies(&self, found: Option<&str>) -> bool {
        self.when
            .is_none_or(|(_, values)| found.is_some_and(|found| values.split('|').any(|value| value == found)))
    }

    /// When it applies, in words: `mode = "spin"`.
    pub fn condition(&self) -> Option<String> {
        let (selector, values) = self.when?;
        Some(format!("{selector} = \"{}\"", values.replace('|', "\" or \"")))
    }

    /// Last part of the path, without `[]`.
    pub fn name(&self) -> &'static str {
        let last = self.path.rsplit('.').next().unwrap_or(self.path);
        last.strip_suffix("[]").unwrap_or(last)
    }

    /// Path of the table it belongs to; empty for the top.
    pub fn parent(&self) -> &'static str {
        self.path.rsplit_once('.').map_or("", |(parent, _)| parent)
    }

    /// Whether it is a table or an array of tables.
    pub fn is_table(&self) -> bool {
        matches!(self.kind, Kind::Section | Kind::Maybe | Kind::Many | Kind::Named)
    }

    /// What it may hold, to follow "must".
    pub fn allowed(&self) -> String {
        let unit = if self.unit.is_empty() { String::new() } else { format!(" {}", self.unit) };
        match self.kind {
            Kind::Section | Kind::Maybe | Kind::Named => "be a table".into(),
            Kind::Many => "be an array of tables".into(),
            Kind::Preset => "be the name of a built-in station, or a station file".into(),
            Kind::Text => "be text".into(),
            Kind::Path => "be the name of a file".into(),
            Kind::File(content) => format!("be {}", content.describe()),
            Kind::Flag => "be true or false".into(),
            Kind::Int(low, high) if low == high => format!("be {low}"),
            Kind::Int(low, i64::MAX) => format!("be an integer in {low}..2^63-1{unit}"),
            Kind::Int(low, high) => format!("be an integer in {low}..{high}{unit}"),
            Kind::IntOf(numbers) => {
                let all: Vec<String> = numbers.iter().map(i64::to_string).collect();
                format!("be one of {}{unit}", all.join(", "))
            }
            Kind::Real(low, high) => format!("lie in {}..{}{unit}", short(low), short(high)),
            Kind::Above(low, high) => format!("lie in {}..{}{unit}, {low} excluded", short(low), short(high)),
            Kind::Reals(count, low, high) => {
                format!("be {count} numbers in {}..{}{unit}", short(low), short(high))
            }
            Kind::Size => "be one integer or [width, height], each in 1..65536 px".into(),
            Kind::Domes => "be pairs [azimuth 0..360 deg, share 0..1], the shares together at most 1".into(),
            Kind::Horizon => "be pairs [azimuth 0..360 deg, elevation -90..90 deg], azimuth ascending".into(),
            Kind::Time => "be a time in UTC in the years 1957..2099, such as 2018-01-15T04:00:00Z".into(),
            Kind::Tle => {
                "be the two lines of an element set, a name line before them if you like, or a file".into()
            }
            Kind::Word([word]) => format!("be \"{word}\""),
            Kind::Word(words) => format!("be one of {}", quoted(words)),
            Kind::Words(words) => format!("be a list of {}", quoted(words)),
            Kind::WordOrReal(words, low, high) => {
                format!("be {} or a number in {}..{}{unit}", quoted(words), short(low), short(high))
            }
            Kind::WordOrFile(words, file) => format!("be {} or {file}", quoted(words)),
            Kind::WordOrTable(words, _) => format!("be {} or a table", quoted(words)),
            Kind::Crop => "be \"none\", \"target\" or [x0, y0, width, height] within the frame".into(),
        }
    }
}

/// A limit: `1e12` rather than a row of zeros.
fn short(limit: f64) -> String {
    if limit.abs() >= 1e6 { format!("{limit:e}") } else { limit.to_string() }
}

fn quoted(words: &[&str]) -> String {
    words.iter().map(|word| format!("\"{word}\"")).collect::<Vec<_>>().join(", ")
}

/// Groups of siblings of which exactly one is written: the table, and the members.
pub(super) const ONE_OF: &[(&str, &[&str])] = &[
    ("telescope", &["plate_scale_arcsec", "focal_length_m"]),
    ("target[]", &["brightness", "shape"]),
    ("target[].orbit", &["tle", "omm", "oem", "state", "kepler", "fixed"]),
];

/// The group of one-of siblings a key belongs to.
pub(super) fn group_of(key: &Key) -> Option<&'static [&'static str]> {
    ONE_OF.iter().find(|(table, members)| *table == key.parent() && members.contains(&key.name())).map(|(_, m)| *m)
}

/// The name most like `word`, if any is at all like it.
pub(super) fn nearest<'a>(word: &str, names: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let likeness = |name: &str| strsim::jaro_winkler(&word.to_lowercase(), &name.to_lowercase());
    names
        .into_iter()
        .map(|name| (likeness(name), name))
        .filter(|(score, _)| *score > 0.6)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, name)| name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_misspelt_name_finds_its_neighbour() {
        let names = ["bias_adu", "gain_e_per_adu", "read_noise_e"];
        assert_eq!(nearest("gian_e_per_adu", names), Some("gain_e_per_adu"));
        assert_eq!(nearest("zzz", ["abc"]), None);
    }
}
