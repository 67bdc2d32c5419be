//! Words to the user: stderr for talk and progress, stdout for data, exit codes.

use super::args::Global;
use crate::astro::time::Instant;
use crate::io::atomic;
use crate::run::RunError;
use crate::scene::{self, Options, Scene, SceneError};
use crate::simulate::SimulateError;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::fmt;
use std::io::{self, IsTerminal, Write};
use std::path::Path;

/// Why a command ended early.
#[derive(Debug)]
pub(super) enum Failure {
    /// Usage or bad input: exit code 2.
    Input(String),
    /// Everything else: exit code 1.
    Failed(String),
    /// Nobody reads stdout any more.
    BrokenPipe,
}

impl Failure {
    pub fn code(&self) -> u8 {
        match self {
            Self::Input(_) => 2,
            Self::Failed(_) => 1,
            Self::BrokenPipe => 0,
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Input(text) | Self::Failed(text) => f.write_str(text),
            Self::BrokenPipe => Ok(()),
        }
    }
}

impl From<SceneError> for Failure {
    fn from(e: SceneError) -> Self {
        Self::Input(e.to_string())
    }
}

impl From<SimulateError> for Failure {
    fn from(e: SimulateError) -> Self {
        // elements, epochs, tables and catalogues are what the user gave
        Self::Input(e.to_string())
    }
}

impl From<RunError> for Failure {
    fn from(e: RunError) -> Self {
        match e {
            RunError::Simulate(e) => e.into(),
            RunError::Io(_) => Self::Failed(e.to_string()),
            RunError::Occupied { .. } | RunError::Usage(_) | RunError::Read(_) | RunError::Photometry(_) => {
                Self::Input(e.to_string())
            }
        }
    }
}

impl From<io::Error> for Failure {
    fn from(e: io::Error) -> Self {
        if e.kind() == io::ErrorKind::BrokenPipe { Self::BrokenPipe } else { Self::Failed(e.to_string()) }
    }
}

/// How much to say.
pub(super) struct Talk {
    quiet: bool,
    verbose: bool,
}

impl Talk {
    pub fn new(global: &Global) -> Self {
        Self { quiet: global.quiet, verbose: global.verbose }
    }

    /// Something worth knowing.
    pub fn say(&self, text: &str) {
        if !self.quiet {
            note(text);
        }
    }

    /// Something for the curious.
    pub fn detail(&self, text: &str) {
        if self.verbose {
            note(text);
        }
    }

    /// Why it failed; said even when quiet.
    pub fn error(&self, text: &str) {
        note(&format!("error: {text}"));
    }

    /// A progress bar over `total` steps; visible on a terminal only.
    pub fn bar(&self, total: usize, what: &'static str) -> ProgressBar {
        let target = if self.quiet || !io::stderr().is_terminal() {
            ProgressDrawTarget::hidden()
        } else {
            ProgressDrawTarget::stderr()
        };
        let style = ProgressStyle::with_template("{msg:12} [{bar:30}] {pos}/{len} {elapsed}, {eta} left")
            .unwrap_or_else(|_| ProgressStyle::default_bar());
        ProgressBar::with_draw_target(Some(total as u64), target).with_style(style).with_message(what)
    }
}

/// A line on stderr; where stderr cannot be written to, nobody can be told.
fn note(text: &str) {
    let _ = writeln!(io::stderr().lock(), "{text}");
}

/// Write a file that is not there yet, holds the same already, or may be replaced.
pub(super) fn write_new(path: &Path, text: &str, global: &Global) -> Result<(), Failure> {
    write_bytes(path, text.as_bytes(), global)
}

/// The same of bytes.
pub(super) fn write_bytes(path: &Path, new: &[u8], global: &Global) -> Result<(), Failure> {
    let there = std::fs::read(path).ok();
    if there.is_some_and(|bytes| bytes != new) && !global.force {
        return Err(Failure::Input(format!("{} exists and differs; --force replaces it", path.display())));
    }
    if let Some(dir) = path.parent() {
        atomic::create_dir(dir)?;
    }
    Ok(atomic::write(path, new)?)
}

/// Load a scene with the command line's replacements.
pub(super) fn load(scene: &str, global: &Global) -> Result<Scene, Failure> {
    Ok(scene::load(scene, &Options { sets: &global.set, seed: global.seed })?)
}

/// Write data to stdout.
pub(super) fn print(text: &str) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    out.write_all(text.as_bytes())?;
    Ok(out.flush()?)
}

/// Write one JSON object to stdout.
pub(super) fn print_json(value: &serde_json::Value) -> Result<(), Failure> {
    print(&format!("{value:#}\n"))
}

/// The present time in UTC, ISO 8601, as the system's clock has it.
pub(super) fn now_utc() -> String {
    let since_1970 = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap_or_default();
    let (days, ns) = (since_1970.as_secs() / 86_400, since_1970.as_nanos() % 86_400_000_000_000);
    Instant::from_utc_reading(40_587 + days as i64, ns as i64).utc_reading().iso(9)
}

/// Seconds since the program began to ask.
pub(super) fn clock() -> impl Fn() -> f64 + Sync {
    let began = std::time::Instant::now();
    move || began.elapsed().as_secs_f64()
}

/// Write one file of an output directory, and say so.
pub(super) fn give(dir: &Path, name: &str, text: &str, global: &Global, talk: &Talk) -> Result<(), Failure> {
    let path = dir.join(name);
    write_new(&path, text, global)?;
    talk.say(&format!("wrote {}", path.display()));
    Ok(())
}

/// A number as JSON has it: null for NaN and infinities.
pub(super) fn finite(value: f64) -> serde_json::Value {
    serde_json::Number::from_f64(value).map_or(serde_json::Value::Null, serde_json::Value::Number)
}
