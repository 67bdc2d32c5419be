//! `nightglass accuracy`.

use super::args::{Global, SceneArgs};
use super::gpu::{Purpose, graphics};
use super::talk::{Failure, Talk, clock, give, load, print, print_json, write_new};
use crate::base::accuracy::AccuracyRow;
use crate::base::table::{Table, Values};
use crate::io::ecsv::to_ecsv;
use crate::simulate::{SimulateError, Simulator};
use crate::study::accuracy::rows;
use crate::study::shadow_chart;
use serde_json::json;

pub(super) fn accuracy(args: &SceneArgs, global: &Global, talk: &Talk) -> Result<(), Failure> {
    let scene = load(&args.scene, global)?;
    let mut simulator = Simulator::new(&scene)?;
    simulator.graphics = graphics(&scene, Purpose::Curves, global, talk)?;
    let view = simulator.planner.view(0).map_err(SimulateError::from)?;
    let rows = rows(&simulator, &view, &clock())?;
    talk.detail("times are of one run on this machine: compare them with each other only");
    let table = table(&rows);
    if let Some(dir) = &global.output {
        let path = dir.join("accuracy.ecsv");
        write_new(&path, &to_ecsv(&table), global)?;
        talk.say(&format!("wrote {}", path.display()));
        if let Some(chart) = shadow_chart::svg(&rows) {
            give(dir, "accuracy.svg", &chart, global, talk)?;
        }
    }
    match (global.json, &global.output) {
        (true, _) => print_json(&json!({ "command": "accuracy", "rows": table.to_json_rows() })),
        (false, None) => print(&to_ecsv(&table)),
        (false, Some(_)) => Ok(()),
    }
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
    table
}
