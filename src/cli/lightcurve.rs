//! `nightglass lightcurve`.

use super::args::{Global, SceneArgs};
use super::gpu::{Purpose, graphics};
use super::talk::{Failure, Talk, give, load, print, print_json};
use crate::io::ecsv::to_ecsv;
use crate::plan::planner::Planner;
use crate::run::model_curve::{Curve, curves, to_table};
use crate::simulate::SimulateError;
use crate::study::curve_chart;
use serde_json::json;

pub(super) fn lightcurve(args: &SceneArgs, global: &Global, talk: &Talk) -> Result<(), Failure> {
    let scene = load(&args.scene, global)?;
    let planner = Planner::new(&scene).map_err(SimulateError::from)?;
    planner.warnings().iter().for_each(|w| talk.say(&format!("warning: {w}")));
    if scene.target.is_empty() {
        talk.say("the scene has no [[target]]: the light curve is empty");
    }
    let bar = talk.bar(scene.exposures.count * scene.target.len(), "light curve");
    let graphics = graphics(&scene, Purpose::Curves, global, talk)?;
    let curves = curves(&scene, &planner, &graphics, &|| bar.inc(1))?;
    bar.finish_and_clear();
    for curve in &curves {
        talk.say(&summary(curve));
        let inexact = curve.epochs.iter().filter_map(|e| e.light.inexact()).collect::<Vec<_>>();
        if !inexact.is_empty() {
            talk.say(&format!(
                "warning: {}: {} epochs err by more than accuracy.brightness, the worst by an estimated {:.1e} of its light; shorter \
                 exposures are integrated better (flux_err_e tells)",
                curve.target,
                inexact.len(),
                inexact.iter().copied().fold(0.0, f64::max)
            ));
        }
    }
    let table = to_table(&scene, &curves)?;
    if let Some(dir) = &global.output {
        give(dir, "lightcurve.ecsv", &to_ecsv(&table), global, talk)?;
        give(dir, "lightcurve.svg", &curve_chart::svg(&scene, &curves), global, talk)?;
    }
    match (global.json, &global.output) {
        (true, _) => print_json(&json!({ "command": "lightcurve", "rows": table.to_json_rows() })),
        (false, None) => print(&to_ecsv(&table)),
        (false, Some(_)) => Ok(()),
    }
}

fn summary(curve: &Curve) -> String {
    let mags = curve.epochs.iter().map(|e| e.light.mag_v()).filter(|m| m.is_finite()).collect::<Vec<_>>();
    let (bright, faint) = mags.iter().fold((f64::MAX, f64::MIN), |(b, f), m| (b.min(*m), f.max(*m)));
    let dark = curve.epochs.len() - mags.len();
    let without = if dark > 0 { format!(", {dark} epochs without light") } else { String::new() };
    if mags.is_empty() {
        return format!("{}: no light in {} epochs", curve.target, curve.epochs.len());
    }
    format!("{}: V {bright:.3} to {faint:.3} in {} epochs{without}; {}", curve.target, mags.len(), curve.way)
}
