//! What is wrong with a scene: every fault with its place, told all at once.

use std::fmt;

use super::tree::Place;

/// One thing wrong with a scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Key path, such as `target.0.orbit.tle`; empty where there is none.
    pub path: String,
    /// Line in the file of origin, from 1.
    pub line: Option<usize>,
    /// What is wrong, with the key path, the value and what is allowed.
    pub message: String,
    /// The scene file, the station file, `--set` or `--seed`.
    pub origin: String,
}

impl Fault {
    pub(super) fn new(path: impl Into<String>, place: &Place, message: impl Into<String>) -> Self {
        let origin = place.source.origin.clone();
        Self { path: path.into(), line: place.line, message: message.into(), origin }
    }

    pub(super) fn of(origin: &str, path: &str, line: Option<usize>, message: impl Into<String>) -> Self {
        Self { path: path.into(), line, message: message.into(), origin: origin.into() }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            Some(line) => write!(f, "{}:{line}: {}", self.origin, self.message),
            None => write!(f, "{}: {}", self.origin, self.message),
        }
    }
}

/// Everything wrong with a scene; shown as one line a fault.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneError {
    /// The scene file or built-in name.
    pub origin: String,
    /// The faults, in the order of the file's lines.
    pub faults: Vec<Fault>,
}

impl SceneError {
    pub(super) fn new(origin: &str, mut faults: Vec<Fault>) -> Self {
        faults
            .sort_by_key(|fault| (fault.origin != origin, fault.origin.clone(), fault.line.is_none(), fault.line));
        faults.dedup();
        Self { origin: origin.into(), faults }
    }

    pub(super) fn one(origin: &str, message: impl Into<String>) -> Self {
        Self::new(origin, vec![Fault::of(origin, "", None, message)])
    }
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, fault) in self.faults.iter().enumerate() {
            if i > 0 {
                writeln!(f)?;
            }
            write!(f, "{fault}")?;
        }
        Ok(())
    }
}

impl std::error::Error for SceneError {}
