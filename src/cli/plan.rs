//! `nightglass plan`.

use super::args::{Global, SceneArgs};
use super::talk::{Failure, Talk, load, print, print_json, write_new};
use crate::io::ecsv::to_ecsv;
use crate::plan::planner::Planner;
use crate::plan::table::table;
use crate::simulate::SimulateError;
use serde_json::json;

pub(super) fn plan(args: &SceneArgs, global: &Global, talk: &Talk) -> Result<(), Failure> {
    let scene = load(&args.scene, global)?;
    let planner = Planner::new(&scene).map_err(SimulateError::from)?;
    let views = planner.views().map_err(SimulateError::from)?;
    planner.warnings().iter().for_each(|w| talk.say(&format!("warning: {w}")));
    let table = table(&views);
    let observable = views.iter().filter(|v| v.observability.observable).count();
    talk.say(&format!("{observable} of {} exposures observable", views.len()));
    if let Some(dir) = &global.output {
        let path = dir.join("plan.ecsv");
        write_new(&path, &to_ecsv(&table), global)?;
        talk.say(&format!("wrote {}", path.display()));
    }
    match (global.json, &global.output) {
        (true, _) => print_json(&json!({ "command": "plan", "rows": table.to_json_rows() })),
        (false, None) => print(&to_ecsv(&table)),
        (false, Some(_)) => Ok(()),
    }
}
