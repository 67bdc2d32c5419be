//! A station described from a frame's header: what the keywords tell, what the pixels tell, what is assumed, what must be filled in.
//!
//! Pixels alone do not part bias, sky and read noise. Where the gain g is known the scatter V of neighbouring pixels \[adu^2\] about the
//! background B \[adu\] gives the bias b by the photon transfer (Janesick 2001, Scientific Charge-Coupled Devices, SPIE, eq. 2.17) if
//! the read noise r is known or assumed:
//!
//! ```text
//! V = (B - b) / g + (r / g)^2
//! ```

mod detector;
mod list;

use crate::photometry::header::{Facts, Header};
use crate::scene::{Options, SceneError, contradictions, load_str};
use list::List;
use std::fmt::Write;

/// Where a value comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin {
    /// A keyword of the header, or an option of the command line.
    Keyword,
    /// The pixels.
    Pixels,
    /// A usual value.
    Assumed,
    /// Nothing: a stand-in that must be replaced.
    FillIn,
}

impl Origin {
    /// The word for it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Keyword => "keyword",
            Self::Pixels => "pixels",
            Self::Assumed => "assumed",
            Self::FillIn => "to be filled in",
        }
    }
}

/// One key of a station.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// Table and key, as `detector.gain_e_per_adu`.
    pub key: &'static str,
    /// Its value.
    pub value: toml::Value,
    /// Where it comes from.
    pub origin: Origin,
    /// The same in words.
    pub why: String,
}

/// A frame to describe a station from.
pub struct Source<'f> {
    /// What its header says.
    pub facts: &'f Facts,
    /// The header itself.
    pub header: &'f dyn Header,
    /// Columns and rows, overscan included.
    pub size: [usize; 2],
    /// Its pixels \[adu\], by rows.
    pub data: &'f [f32],
}

/// The keys of a station, table by table.
pub fn entries(source: &Source) -> Vec<Entry> {
    let mut list = List::new(source);
    list.site();
    list.telescope();
    list.detector();
    list.entries
}

/// The station file: each value with its origin.
pub fn to_toml(entries: &[Entry], title: &str) -> String {
    let mut out = format!("# {title}\n");
    out.push_str("# Each value with its origin. In a scene: [station] preset = \"THIS FILE\".\n");
    let mut table = "";
    let lines =
        entries.iter().filter_map(|e| e.key.split_once('.').map(|(t, k)| (t, format!("{k} = {}", e.value), e)));
    let lines = lines.collect::<Vec<_>>();
    let widest = lines.iter().map(|(_, line, _)| line.chars().count()).max().unwrap_or(0).min(50);
    for (own, line, entry) in &lines {
        if *own != table {
            table = own;
            let _ = writeln!(out, "\n[{own}]");
        }
        let mark = match entry.origin {
            Origin::Keyword => "",
            Origin::Pixels => "from the pixels: ",
            Origin::Assumed => "assumed: ",
            Origin::FillIn => "TO BE FILLED IN: ",
        };
        let _ = writeln!(out, "{line:widest$}  # {mark}{}", entry.why);
    }
    out
}

/// What looks contradictory among the values of a station's text.
///
/// # Errors
/// [`SceneError`] with all faults of a text that no scene can use.
pub fn check(text: &str) -> Result<Vec<String>, SceneError> {
    let whole = format!(
        "{text}\n[exposures]\nstart = 2018-01-20T03:00:00Z\nduration_s = 0.0\n[pointing]\nat = \"azel\"\naz_deg = 0.0\nel_deg = 90.0\n"
    );
    load_str(&whole, "station", None, &Options::default()).map(|scene| contradictions(&scene))
}

#[cfg(test)]
mod tests;
