//! `nightglass explain`.

use super::args::{Global, SceneArgs};
use super::gpu::{Purpose, graphics};
use super::talk::{Failure, Talk, clock, load, print, write_new};
use crate::run::tables::ledger_row;
use crate::simulate::Simulator;
use crate::study::explain::explain as study;
use serde_json::json;
use std::fmt::Write;

pub(super) fn explain(args: &SceneArgs, global: &Global, talk: &Talk) -> Result<(), Failure> {
    let scene = load(&args.scene, global)?;
    let mut simulator = Simulator::new(&scene)?;
    simulator.graphics = graphics(&scene, Purpose::Frames, global, talk)?;
    let explanation = study(&simulator, &clock())?;
    if global.json {
        let rows = explanation.ledger.rows().map(ledger_row).collect::<Vec<_>>();
        let noise =
            explanation.noise.iter().map(|(n, v)| json!({ "name": n, "variance_e2_px": v })).collect::<Vec<_>>();
        let whole = json!({
            "command": "explain", "rows": rows, "dominant_noise": explanation.dominant_noise,
            "noise": noise, "cost": { "frames": explanation.frames, "total_s": explanation.total_s },
        });
        return give(&format!("{whole:#}\n"), "explain.json", global, talk);
    }
    let mut text = String::new();
    let _ = writeln!(text, "{}: {} frames, SCENESHA {}", scene.name, explanation.frames, simulator.scene_sha());
    let _ = writeln!(text, "\n{:24} {:7} {:>10}  why", "source or stage", "verdict", "mean e-/px");
    for row in explanation.ledger.rows() {
        let mean = if row.mean_e_px > 0.0 { format!("{:.4}", row.mean_e_px) } else { "-".into() };
        let _ = writeln!(text, "{:24} {:7} {mean:>10}  {}", row.name, row.verdict, row.why);
    }
    let _ = writeln!(text, "\nvariance at the frame's centre, e-^2/px");
    for (name, variance) in &explanation.noise {
        let _ = writeln!(text, "{name:32} {variance:10.3}");
    }
    let _ = writeln!(text, "dominant noise: {}", explanation.dominant_noise);
    let _ = writeln!(text, "cost: about {:.1} s for all frames on this machine", explanation.total_s);
    talk.detail("means are those of the frame's centre, averaged over the frames");
    give(&text, "explain.txt", global, talk)
}

/// To stdout, or to a file of the directory asked for.
fn give(text: &str, name: &str, global: &Global, talk: &Talk) -> Result<(), Failure> {
    let Some(dir) = &global.output else { return print(text) };
    let path = dir.join(name);
    write_new(&path, text, global)?;
    talk.say(&format!("wrote {}", path.display()));
    Ok(())
}
