//! Stations and scenes that come with the program.

use super::fault::SceneError;
use super::schema::nearest;

/// Built-in stations: name and text.
pub const STATIONS: &[(&str, &str)] = &[
    ("pogs", include_str!("../../stations/pogs.toml")),
    ("pogs-published", include_str!("../../stations/pogs-published.toml")),
    ("esa-ogs", include_str!("../../stations/esa-ogs.toml")),
    ("zimmerwald", include_str!("../../stations/zimmerwald.toml")),
    ("lmt", include_str!("../../stations/lmt.toml")),
    ("modest", include_str!("../../stations/modest.toml")),
    ("tarot-chile", include_str!("../../stations/tarot-chile.toml")),
    ("tarot-reunion", include_str!("../../stations/tarot-reunion.toml")),
    ("zadko", include_str!("../../stations/zadko.toml")),
    ("dome-a", include_str!("../../stations/dome-a.toml")),
];

/// Built-in scenes: name and text.
pub const SCENES: &[(&str, &str)] = &[("pogs-geo", include_str!("../../examples/pogs-geo.toml"))];

/// The text of that name.
pub(super) fn find(list: &[(&str, &'static str)], name: &str) -> Option<&'static str> {
    list.iter().find(|(own, _)| *own == name).map(|(_, text)| *text)
}

/// What to say about a name that is not in a list.
pub(super) fn hint(what: &str, name: &str, list: &[(&str, &str)]) -> String {
    let names = list.iter().map(|(name, _)| *name);
    let near = nearest(name, names.clone()).map_or(String::new(), |name| format!("; nearest: {name}"));
    format!("no built-in {what} has this name{near}; known: {}", names.collect::<Vec<_>>().join(", "))
}

/// The same as an error.
pub(super) fn unknown(what: &str, name: &str, list: &[(&str, &str)]) -> SceneError {
    SceneError::one(name, hint(what, name, list))
}
