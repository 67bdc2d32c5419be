//! `nightglass explain`.

use super::args::{Global, SceneArgs};
use super::gpu::{Purpose, graphics};
use super::talk::{Failure, Talk, clock, finite, give, load, print};
use crate::base::ledger::Row;
use crate::run::tables::ledger_row;
use crate::simulate::{SimulateError, Simulator};
use crate::study::explain::{Explanation, explain as study};
use crate::study::sensitivity::{Sensitivities, sensitivities};
use crate::study::snr::stage::typical_frame;
use serde_json::json;
use std::fmt::Write;
use std::io::IsTerminal;

/// Width of a bar \[characters\].
const BAR: usize = 24;

/// The explanation of a scene, one frame of which is made in a temporary folder to see what it costs.
pub(super) fn explained(simulator: &Simulator) -> Result<Explanation, SimulateError> {
    let scratch = std::env::temp_dir().join(format!("nightglass-explain-{}", std::process::id()));
    let explanation = study(simulator, &scratch, &clock());
    let _ = std::fs::remove_dir_all(&scratch);
    explanation
}

pub(super) fn explain(args: &SceneArgs, global: &Global, talk: &Talk) -> Result<(), Failure> {
    let scene = load(&args.scene, global)?;
    let mut simulator = Simulator::new(&scene)?;
    simulator.graphics = graphics(&scene, Purpose::Frames, global, talk)?;
    let explanation = explained(&simulator)?;
    if explanation.total_s.is_nan() {
        talk.say(&format!("warning: no cost: no frame can be written to {}", std::env::temp_dir().display()));
    }
    let changes = sensitivities(&scene, typical_frame(&scene)?)?;
    if global.json {
        let rows = explanation.ledger.rows().map(ledger_row).collect::<Vec<_>>();
        let noise =
            explanation.noise.iter().map(|(n, v)| json!({ "name": n, "variance_e2_px": v })).collect::<Vec<_>>();
        let slope = |s: &crate::study::sensitivity::Sensitivity| json!({ "name": s.name, "value": finite(s.value), "dlnsnr_dlnp": finite(s.slope) });
        let [prepare_s, frames_s, photometry_s, report_s] = explanation.parts_s.map(finite);
        let whole = json!({
            "command": "explain", "rows": rows, "dominant_noise": explanation.dominant_noise, "noise": noise,
            "cost": {
                "frames": explanation.frames, "total_s": finite(explanation.total_s), "prepare_s": prepare_s,
                "frames_s": frames_s, "photometry_s": photometry_s, "report_s": report_s,
            },
            "snr": { "frame": changes.frame, "mag_v": finite(changes.mag_v), "snr": finite(changes.snr), "why": changes.why },
            "sensitivity": changes.rows.iter().map(slope).collect::<Vec<_>>(),
        });
        let text = format!("{whole:#}\n");
        return match &global.output {
            Some(dir) => give(dir, "explain.json", &text, global, talk),
            None => print(&text),
        };
    }
    let dim = global.output.is_none() && std::io::stdout().is_terminal() && !no_colour();
    let mut text = format!("{}: {} frames, SCENESHA {}\n", scene.name, explanation.frames, simulator.scene_sha());
    ledger(&mut text, &explanation, dim);
    noise(&mut text, &explanation);
    sensitive(&mut text, &changes);
    let [prepare, frames, photometry, report] = explanation.parts_s;
    let _ = writeln!(
        text,
        "\ncost: about {:.1} s for a whole run on this machine: {prepare:.1} s of preparation, {frames:.1} s of frames, \
         {photometry:.1} s of photometry, {report:.1} s of report",
        explanation.total_s
    );
    talk.detail("means are those of the frame's centre, averaged over the frames");
    match &global.output {
        Some(dir) => give(dir, "explain.txt", &text, global, talk),
        None => print(&text),
    }
}

/// Whether the environment asks for no colours (no-color.org).
fn no_colour() -> bool {
    std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty())
}

/// A bar of a share 0..1, padded to its width; eighths of a character.
fn bar(share: f64) -> String {
    const EIGHTHS: [&str; 8] = ["", "▏", "▎", "▍", "▌", "▋", "▊", "▉"];
    let eighths = (share.clamp(0.0, 1.0) * 8.0 * BAR as f64).round() as usize;
    let text = "█".repeat(eighths / 8) + EIGHTHS[eighths % 8];
    format!("{text:BAR$}")
}

/// A number in four figures or so; a dash for none.
fn figure(value: f64) -> String {
    match value.abs() {
        _ if !value.is_finite() || value == 0.0 => "-".into(),
        size if (1e-3..1e5).contains(&size) => {
            format!("{value:.*}", (3 - size.log10().floor() as i32).clamp(0, 6) as usize)
        }
        _ => format!("{value:.2e}"),
    }
}

/// What is in the frames, the brightest first, and what is not.
fn ledger(text: &mut String, explanation: &Explanation, dim: bool) {
    let (mut there, absent): (Vec<_>, Vec<_>) = explanation.ledger.rows().partition(|row: &&Row| row.is_needed());
    // stable: what has no light stays in the order in which light meets it
    there.sort_by(|a, b| b.mean_e_px.max(0.0).total_cmp(&a.mean_e_px.max(0.0)));
    let most = there.iter().map(|row| row.mean_e_px).fold(0.0, f64::max);
    let broad = explanation.ledger.rows().map(|row| row.name.chars().count()).max().unwrap_or(0);
    let _ = writeln!(text, "\nin the frames\n{:broad$} {:>10} {:BAR$}  how", "source or stage", "mean e-/px", "");
    for row in there {
        let light = if most > 0.0 { bar(row.mean_e_px / most) } else { bar(0.0) };
        let _ = writeln!(text, "{:broad$} {:>10} {light}  {}", row.name, figure(row.mean_e_px), row.why);
    }
    let (faint, full) = if dim { ("\x1b[2m", "\x1b[0m") } else { ("", "") };
    let _ = writeln!(text, "\nleft out");
    for row in absent {
        let _ = writeln!(text, "{faint}{:broad$}  {}{full}", row.name, row.why);
    }
}

/// What a pixel's noise is made of.
fn noise(text: &mut String, explanation: &Explanation) {
    let mut parts = explanation.noise.iter().collect::<Vec<_>>();
    parts.sort_by(|a, b| b.1.total_cmp(&a.1));
    let sum = parts.iter().map(|(_, variance)| variance).sum::<f64>();
    let broad = parts.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
    let _ = writeln!(text, "\nvariance at the frame's centre without the target, e-^2/px: {}", figure(sum));
    for (name, variance) in parts {
        let share = if sum > 0.0 { variance / sum } else { 0.0 };
        let _ = writeln!(text, "{name:broad$} {:>10} {} {:5.1} %", figure(*variance), bar(share), 100.0 * share);
    }
    let _ = writeln!(text, "dominant noise: {}", explanation.dominant_noise);
}

/// What would change the SNR most.
fn sensitive(text: &mut String, changes: &Sensitivities) {
    if changes.rows.is_empty() {
        let _ = writeln!(text, "\nno SNR of the target in frame {}: {}", changes.frame, changes.why);
        return;
    }
    let _ = writeln!(
        text,
        "\nSNR {} of the target of V {:.2} in frame {}; what would change it most (d ln SNR / d ln p):",
        figure(changes.snr),
        changes.mag_v,
        changes.frame
    );
    let most = changes.rows.iter().map(|row| row.slope.abs()).fold(0.0, f64::max);
    let broad = changes.rows.iter().map(|row| row.name.len()).max().unwrap_or(0);
    for row in &changes.rows {
        let size = if most > 0.0 { row.slope.abs() / most } else { 0.0 };
        let effect = if row.name.contains("magnitude") {
            format!("0.1 mag fainter: {:+.1} %", 100.0 * (0.1 * row.slope).exp_m1())
        } else {
            format!("10 % more: {:+.1} %", 100.0 * (row.slope * 1.1f64.ln()).exp_m1())
        };
        let _ = writeln!(
            text,
            "{:broad$} {:>9} {:+8.3} {} {effect}",
            row.name,
            figure(row.value),
            row.slope,
            bar(size)
        );
    }
}
