//! `nightglass calibrate`.

use super::args::{CalibrateArgs, Global};
use super::talk::{Failure, Talk, clock, print_json};
use crate::run::calibrate::{Job, Kind, calibrate as make};
use crate::scene;
use serde_json::json;
use std::path::PathBuf;

pub(super) fn calibrate(args: &CalibrateArgs, global: &Global, talk: &Talk) -> Result<(), Failure> {
    let preset = toml::Value::String(args.station.clone());
    let text = format!(
        "name = \"calibration\"\n[station]\npreset = {preset}\n[pointing]\nat = \"azel\"\naz_deg = 0.0\nel_deg = 90.0\n\
         [exposures]\nstart = 2018-01-20T03:00:00Z\nduration_s = 1.0\n"
    );
    let here = std::env::current_dir().map_err(|e| Failure::Input(format!("the current directory: {e}")))?;
    let options = scene::Options { sets: &global.set, seed: global.seed };
    let scene = scene::load_str(&text, "calibrate", Some(&here), &options)?;
    let stem = std::path::Path::new(&args.station).file_stem().unwrap_or_default();
    let dir = global
        .output
        .clone()
        .unwrap_or_else(|| PathBuf::from("out").join(format!("calibration-{}", stem.to_string_lossy())));
    let there = Kind::ALL.iter().any(|kind| dir.join(format!("{}_0000.fits", kind.stem())).exists());
    if there && !global.force {
        return Err(Failure::Input(format!("{} holds calibration frames; --force replaces them", dir.display())));
    }
    let bar = talk.bar(3 * usize::from(args.count), "frames");
    let (clock, done) = (clock(), || bar.inc(1));
    let job = Job {
        count: usize::from(args.count),
        dark_s: args.dark,
        flat_s: args.flat,
        level: args.level,
        done: &done,
    };
    let written = make(&scene, &dir, &job)?;
    bar.finish_and_clear();
    talk.say(&format!("{} frames in {}, {:.1} s", written.len(), dir.display(), clock()));
    if global.json {
        let rows = written.iter().map(|path| json!({ "file": path.display().to_string() })).collect::<Vec<_>>();
        return print_json(&json!({ "command": "calibrate", "rows": rows }));
    }
    Ok(())
}
