//! `nightglass init`, `check`, `schema`, `scenes`.

use super::args::{Global, InitArgs, SceneArgs};
use super::talk::{Failure, Talk, load, print, print_json};
use crate::io::atomic;
use crate::scene::{self, SCENES, contradictions};
use crate::simulate::{SimulateError, Simulator};
use serde_json::json;

pub(super) fn init(args: &InitArgs, global: &Global, talk: &Talk) -> Result<(), Failure> {
    let text = scene::template(args.name.as_deref())?;
    if global.json {
        return print_json(&json!({ "command": "init", "rows": [{ "name": args.name, "toml": text }] }));
    }
    let Some(path) = &global.output else { return print(&text) };
    if path.exists() && !global.force {
        return Err(Failure::Input(format!("{} exists; --force replaces it", path.display())));
    }
    atomic::write(path, text.as_bytes())?;
    talk.say(&format!("wrote {}; try `nightglass check {}`", path.display(), path.display()));
    Ok(())
}

pub(super) fn check(args: &SceneArgs, global: &Global, talk: &Talk) -> Result<(), Failure> {
    let loaded = scene::load(&args.scene, &scene::Options { sets: &global.set, seed: global.seed });
    if global.json {
        let faults = loaded.as_ref().err().map_or(&[][..], |e| &e.faults);
        let rows = faults
            .iter()
            .map(|f| json!({ "origin": f.origin, "line": f.line, "path": f.path, "message": f.message }))
            .collect::<Vec<_>>();
        print_json(&json!({ "command": "check", "rows": rows }))?;
    }
    let scene = loaded?;
    // what only shows when tables, elements and epochs are used
    let simulator = Simulator::new(&scene)?;
    for frame in [0, scene.exposures.count.saturating_sub(1)] {
        let view = simulator.planner.view(frame).map_err(SimulateError::from)?;
        for (number, target) in scene.target.iter().enumerate() {
            if let Err(why) = simulator.planner.attitude(number, &view) {
                let message = format!("target.{number}.attitude of {}: {why}", target.name);
                return Err(Failure::Input(message));
            }
        }
    }
    contradictions(&scene).iter().for_each(|c| talk.say(&format!("warning: {c}")));
    simulator.planner.warnings().iter().for_each(|w| talk.say(&format!("warning: {w}")));
    talk.say(&format!("{}: no faults, SCENESHA {}", scene.name, scene.sha256()));
    Ok(())
}

pub(super) fn schema() -> Result<(), Failure> {
    print_json(&scene::json_schema())
}

pub(super) fn scenes(global: &Global) -> Result<(), Failure> {
    list("scenes", SCENES, global, |name| {
        let loaded = load(name, global).ok()?;
        Some(format!("{} exposures of {} s", loaded.exposures.count, loaded.exposures.duration_s))
    })
}

/// The first comment line of a text.
pub(super) fn about(text: &str) -> String {
    text.lines().next().unwrap_or_default().trim_start_matches('#').trim().to_owned()
}

/// Names and the first comment line of each text.
fn list(
    command: &str,
    entries: &[(&str, &str)],
    global: &Global,
    more: impl Fn(&str) -> Option<String>,
) -> Result<(), Failure> {
    if global.json {
        let rows =
            entries.iter().map(|(name, text)| json!({ "name": name, "about": about(text) })).collect::<Vec<_>>();
        return print_json(&json!({ "command": command, "rows": rows }));
    }
    let mut out = String::new();
    for (name, text) in entries {
        let more = more(name).map(|m| format!(" ({m})")).unwrap_or_default();
        out.push_str(&format!("{name:16} {}{more}\n", about(text)));
    }
    print(&out)
}
