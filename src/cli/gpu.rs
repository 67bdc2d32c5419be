//! `nightglass gpu`, and the graphics processor that other commands may use.

use super::args::Global;
use super::talk::{Failure, Talk, print, print_json};
use crate::object::shadow::card::{Card, Graphics};
use crate::object::way::Way;
use crate::scene::{Brightness, Scene};
use serde_json::json;
use std::fmt::Write;

/// What the light is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Purpose {
    /// Frames are the same on every machine: a graphics processor must be asked for.
    Frames,
    /// Light curves and studies.
    Curves,
}

/// The graphics processor that `--gpu` and the scene's shapes ask for; none is opened where none would be used.
///
/// # Errors
/// [`Failure`] where one is required and there is none.
pub(super) fn graphics(
    scene: &Scene,
    purpose: Purpose,
    global: &Global,
    talk: &Talk,
) -> Result<Graphics, Failure> {
    let relative = scene.accuracy.brightness;
    let would_use = scene.target.iter().any(|target| match &target.brightness {
        Brightness::Shape(shaped) => {
            matches!(Way::with_device(&shaped.built, 0.5 * relative, true), Way::Device { .. })
        }
        Brightness::MagV(_) => false,
    });
    match global.gpu.as_str() {
        "require" => {
            let card = Card::open(false).map_err(|why| Failure::Input(format!("--gpu require: {why}")))?;
            talk.detail(&format!("shadows on {}", card.name()));
            Ok(Graphics { card: Some(card), required: true, why: String::new() })
        }
        "auto" if would_use && purpose == Purpose::Frames => {
            let why = "frames are the same on every machine; --gpu require uses one".into();
            Ok(Graphics { why, ..Graphics::default() })
        }
        "auto" if would_use => match Card::open(true) {
            Ok(card) => {
                talk.detail(&format!("shadows on {}", card.name()));
                Ok(Graphics { card: Some(card), required: false, why: String::new() })
            }
            Err(why) => {
                talk.detail(&format!("no graphics processor: {why}"));
                Ok(Graphics { card: None, required: false, why })
            }
        },
        "off" if would_use => Ok(Graphics { why: "--gpu off".into(), ..Graphics::default() }),
        _ => Ok(Graphics::default()),
    }
}

/// The graphics processors of this machine.
pub(super) fn gpu(global: &Global) -> Result<(), Failure> {
    let all = Card::all();
    if global.json {
        let rows = all.iter().map(|card| {
            json!({
                "name": card.name, "backend": card.backend, "driver": card.driver,
                "software": card.software, "largest_side_px": card.largest_side,
            })
        });
        return print_json(&json!({ "command": "gpu", "rows": rows.collect::<Vec<_>>() }));
    }
    if all.is_empty() {
        let why = Card::open(false).err().unwrap_or_default();
        return print(&format!("no graphics processor: {why}\nshadows are found on the processor\n"));
    }
    let mut text = String::new();
    for card in &all {
        let kind = if card.software { "draws on the processor: used only with --gpu require" } else { "hardware" };
        let _ = writeln!(
            text,
            "{} ({}, {}): maps to {} px, {kind}",
            card.name, card.backend, card.driver, card.largest_side
        );
    }
    print(&text)
}
