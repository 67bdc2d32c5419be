//! `nightglass accuracy`.

use super::args::{AccuracyArgs, Global};
use super::gpu::{Purpose, graphics};
use super::talk::{Failure, Talk, clock, give, load, print, print_json};
use crate::base::accuracy::{Accuracy, AccuracyRow};
use crate::base::table::{Table, Values};
use crate::io::atomic;
use crate::io::ecsv::to_ecsv;
use crate::scene::{SCENES, Scene, with_accuracy};
use crate::simulate::{SimulateError, Simulator};
use crate::study::accuracy::rows;
use crate::study::suggest::{Suggestion, Wanted, suggest};
use crate::study::{accuracy_chart, shadow_chart};
use serde_json::json;
use std::path::Path;

pub(super) fn accuracy(args: &AccuracyArgs, global: &Global, talk: &Talk) -> Result<(), Failure> {
    let wanted = Wanted::parse(args.wanted.iter().map(String::as_str)).map_err(Failure::Input)?;
    if args.apply && !Path::new(&args.scene).is_file() && SCENES.iter().any(|(name, _)| *name == args.scene) {
        let name = &args.scene;
        return Err(Failure::Input(format!(
            "{name} is a built-in scene, which --apply cannot change; `nightglass init {name} -o FILE` gives a file of your own, then \
             `nightglass accuracy FILE --apply`"
        )));
    }
    let scene = load(&args.scene, global)?;
    let mut simulator = Simulator::new(&scene)?;
    simulator.graphics = graphics(&scene, Purpose::Curves, global, talk)?;
    let view = simulator.planner.view(0).map_err(SimulateError::from)?;
    let bar = talk.bar(1, "accuracy");
    let mut rows = rows(&simulator, &view, &clock())?;
    bar.finish_and_clear();
    let suggestion = suggest(&mut rows, &wanted, &scene.accuracy);
    tell(&suggestion, &scene, talk);
    let table = table(&rows);
    if let Some(dir) = &global.output {
        give(dir, "accuracy.ecsv", &to_ecsv(&table), global, talk)?;
        let title = format!("{}: error against run time of one run on this machine", scene.name);
        if let Some(chart) = accuracy_chart::svg(&rows, &title) {
            give(dir, "accuracy.svg", &chart, global, talk)?;
        }
        if let Some(chart) = shadow_chart::svg(&rows) {
            give(dir, "shadows.svg", &chart, global, talk)?;
        }
    }
    if args.apply {
        apply(&args.scene, &suggestion, talk)?;
    }
    match (global.json, &global.output) {
        (true, _) => {
            let values = suggestion.values.iter().map(|(key, value)| ((*key).to_owned(), json!(value)));
            let values = values.collect::<serde_json::Map<_, _>>();
            print_json(&json!({
                "command": "accuracy", "rows": table.to_json_rows(), "suggested": values, "unmet": suggestion.unmet,
            }))
        }
        (false, None) => print(&to_ecsv(&table)),
        (false, Some(_)) => Ok(()),
    }
}

/// What is suggested, and what was not measured and why.
fn tell(suggestion: &Suggestion, scene: &Scene, talk: &Talk) {
    talk.detail("times are of one run on this machine: compare them with each other only");
    if !scene.inversion.enabled {
        talk.detail("inversion.grid is not measured: the scene does not invert (inversion.enabled = false)");
    }
    for (key, value) in &suggestion.values {
        match scene.accuracy.value(key) {
            Some(own) if own != *value => talk.say(&format!("suggested: accuracy.{key} = {value:e}, now {own:e}")),
            _ => talk.detail(&format!("accuracy.{key} = {value:e} stays")),
        }
    }
    suggestion.unmet.iter().for_each(|words| talk.say(&format!("warning: {words}")));
}

/// Write the suggested values into the scene file.
fn apply(name: &str, suggestion: &Suggestion, talk: &Talk) -> Result<(), Failure> {
    let unreadable = |e: std::io::Error| Failure::Input(format!("{name}: {e}"));
    let text = std::fs::read_to_string(name).map_err(unreadable)?;
    let default = |key: &str| Accuracy::default().value(key);
    let (new, changes) = with_accuracy(&text, name, &suggestion.values, default)?;
    if changes.is_empty() {
        talk.say(&format!("{name}: has the suggested values already"));
        return Ok(());
    }
    atomic::write(Path::new(name), new.as_bytes())?;
    for change in changes {
        let from = change.from.unwrap_or_else(|| "the default".into());
        talk.say(&format!("{name}: {} = {}, was {from}", change.key, change.to));
    }
    Ok(())
}

fn table(rows: &[AccuracyRow]) -> Table {
    let mut table = Table::default();
    table.texts("approximation", rows.iter().map(|r| r.approximation.clone()));
    table.texts("setting", rows.iter().map(|r| r.setting.clone()));
    table.floats("max_err", "", rows.iter().map(|r| r.max_err));
    table.floats("rms_err", "", rows.iter().map(|r| r.rms_err));
    table.texts("unit", rows.iter().map(|r| r.unit.clone()));
    table.floats("time_s", "s", rows.iter().map(|r| r.time_s));
    table.ints("bytes", rows.iter().map(|r| r.bytes as i64));
    table.column("pareto", "", Values::Bool(rows.iter().map(|r| r.pareto).collect()));
    table.column("default", "", Values::Bool(rows.iter().map(|r| r.default).collect()));
    table.column("suggested", "", Values::Bool(rows.iter().map(|r| r.suggested).collect()));
    table
}
