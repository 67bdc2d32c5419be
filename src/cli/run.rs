//! `nightglass run`: the main job.

use super::args::{Global, RunArgs};
use super::invert::model;
use super::photometry::measure;
use super::render::produce;
use super::report;
use super::shapes::shapes;
use super::talk::{Failure, Talk, load, print_json};
use crate::io::atomic;
use crate::run::curve_files;
use crate::run::job::Job;
use crate::run::lightcurve::settings;
use crate::run::tables;
use crate::simulate::{SimulateError, catalogue};
use crate::study::measured_picture::measured;
use serde_json::json;

pub(super) fn run(args: &RunArgs, global: &Global, talk: &Talk) -> Result<(), Failure> {
    let scene = load(&args.scene, global)?;
    let inversion = scene.inversion.enabled.then(|| model(&scene.inversion.model)).transpose()?;
    let output = produce(&scene, &args.part, global, talk)?;
    let frames = output.rendered.frames.iter().map(|n| output.dir.frame(*n)).collect::<Vec<_>>();
    let mut written =
        ["scene.toml", "plan.ecsv", "truth.ecsv", "ledger.json", "frames/"].map(String::from).to_vec();
    if !scene.target.is_empty() && !frames.is_empty() {
        let catalogue = catalogue(&scene).map_err(SimulateError::from)?;
        let bar = talk.bar(frames.len(), "photometry");
        let done = || bar.inc(1);
        let job = Job { scene: Some(&scene), done: &done, ..Job::new(&frames, &catalogue, settings(&scene)) };
        let curve = measure(&job, talk)?;
        bar.finish_and_clear();
        tables::write(&output.dir, "lightcurve.ecsv", &curve.table)?;
        written.push("lightcurve.ecsv".into());
        let station = &scene.station.name;
        match curve_files::tdm(&curve, station) {
            Ok(Some(text)) => {
                atomic::write(&output.dir.path().join("lightcurve.tdm"), text.as_bytes())?;
                written.push("lightcurve.tdm".into());
            }
            Ok(None) => {}
            Err(why) => talk.say(&format!("warning: no lightcurve.tdm: {why}")),
        }
        let title = format!("{}, {station}", scene.name);
        atomic::write(&output.dir.path().join("lightcurve.svg"), measured(&curve, &title).as_bytes())?;
        written.push("lightcurve.svg".into());
        if let Some(model) = inversion {
            written.extend(shapes(&scene, model, &curve, &output.dir, talk)?);
        }
    }
    if scene.output.report {
        report::write(output.dir.path(), output.dir.path(), talk)?;
        written.push("report.html".into());
    }
    let dir = output.dir.path().display();
    talk.say(&format!("wrote {dir}/: {}", written.join(", ")));
    if scene.output.report {
        talk.say(&format!("report: {}", output.dir.file("report.html").display()));
    }
    talk.detail(&format!("{} exposures planned", output.views.len()));
    if global.json {
        let rows = written.iter().map(|name| json!({ "file": format!("{dir}/{name}") })).collect::<Vec<_>>();
        print_json(&json!({ "command": "run", "rows": rows, "frames": output.rendered.frames }))?;
    }
    Ok(())
}
