//! `nightglass campaign`.

use super::args::{CampaignAction, CampaignArgs, CampaignFile, Global, PartArgs, RunArgs, With};
use super::explain::explained;
use super::run::run as run_scene;
use super::talk::{Failure, Talk, finite, print, print_json};
use crate::base::table::Table;
use crate::io::atomic;
use crate::io::ecsv::to_ecsv;
use crate::run::campaign::{Campaign, CampaignError, Entry, Summary};
use crate::scene::{self, Options, Scene};
use crate::simulate::Simulator;
use serde_json::json;
use std::path::{Path, PathBuf};

pub(super) fn campaign(args: &CampaignArgs, talk: &Talk) -> Result<(), Failure> {
    match &args.action {
        CampaignAction::Run(With { args, global }) => run(args, global, talk),
        CampaignAction::Card(With { args, global }) => card(args, global, talk),
    }
}

/// The campaign of a file and its scenes; the faults of all of them at once.
fn read(args: &CampaignFile, global: &Global) -> Result<(Campaign, Vec<Scene>), Failure> {
    let unreadable = |e: std::io::Error| Failure::Input(format!("{}: {e}", args.file.display()));
    let text = std::fs::read_to_string(&args.file).map_err(unreadable)?;
    let campaign = Campaign::parse(&text, &args.file).map_err(input)?;
    let (mut scenes, mut faults) = (Vec::new(), Vec::new());
    for entry in &campaign.entries {
        match campaign.scene(entry, &global.set, global.seed) {
            Ok(scene) => scenes.push(scene),
            Err(CampaignError(own)) => faults.extend(own),
        }
    }
    if faults.is_empty() { Ok((campaign, scenes)) } else { Err(input(CampaignError(faults))) }
}

fn input(error: CampaignError) -> Failure {
    Failure::Input(error.to_string())
}

/// How a scene ended.
struct Ended {
    status: &'static str,
    why: String,
}

fn run(args: &CampaignFile, global: &Global, talk: &Talk) -> Result<(), Failure> {
    let (campaign, scenes) = read(args, global)?;
    let stem = args.file.file_stem().map_or_else(|| "campaign".into(), |s| s.to_string_lossy().into_owned());
    let dir = global.output.clone().unwrap_or_else(|| PathBuf::from("out").join(stem));
    atomic::create_dir(&dir)?;
    let bar = talk.bar(scenes.len(), "scenes");
    let mut ended = Vec::new();
    for (entry, scene) in campaign.entries.iter().zip(&scenes) {
        let own = dir.join(entry.folder());
        let end = if is_done(&own, scene) && !global.force {
            Ended { status: "kept", why: String::new() }
        } else {
            let global = of_one(global, entry, &own);
            let part = PartArgs { frames: None, crop: None };
            let words = RunArgs { scene: campaign.base.clone(), part };
            match run_scene(&words, &global, &Talk::new(&global)) {
                Ok(()) => Ended { status: "done", why: String::new() },
                Err(Failure::BrokenPipe) => return Err(Failure::BrokenPipe),
                Err(failure) => Ended { status: "failed", why: failure.to_string() },
            }
        };
        if end.status == "failed" {
            talk.say(&format!("{}: failed: {}", entry.folder(), end.why));
        } else {
            talk.detail(&format!("{}: {}", entry.folder(), end.status));
        }
        ended.push(end);
        bar.inc(1);
        // told after each scene, so that a campaign that is stopped tells how far it came
        let table = table(&campaign.entries, &ended, &dir);
        atomic::write(&dir.join("campaign.ecsv"), to_ecsv(&table).as_bytes())?;
    }
    bar.finish_and_clear();
    let count = |status: &str| ended.iter().filter(|e| e.status == status).count();
    let (done, kept, failed) = (count("done"), count("kept"), count("failed"));
    let earlier = if kept > 0 { format!(", {kept} kept from an earlier run") } else { String::new() };
    talk.say(&format!(
        "{done} scenes done{earlier}, {failed} failed; wrote {}",
        dir.join("campaign.ecsv").display()
    ));
    if global.json {
        let rows = table(&campaign.entries, &ended, &dir).to_json_rows();
        print_json(&json!({ "command": "campaign run", "rows": rows }))?;
    }
    if failed > 0 {
        let words = "column why of campaign.ecsv tells; the same command takes up what is missing";
        return Err(Failure::Failed(format!("{failed} of {} scenes failed: {words}", ended.len())));
    }
    Ok(())
}

/// The options under which one scene runs.
fn of_one(global: &Global, entry: &Entry, dir: &Path) -> Global {
    Global {
        output: Some(dir.to_owned()),
        set: [&entry.sets[..], &global.set].concat(),
        seed: global.seed,
        threads: None,
        json: false,
        verbose: false,
        quiet: true,
        force: global.force,
        gpu: global.gpu.clone(),
    }
}

/// True where an earlier run finished this very scene.
fn is_done(dir: &Path, scene: &Scene) -> bool {
    let Ok(text) = std::fs::read_to_string(dir.join("scene.toml")) else { return false };
    let there = scene::load_str(&text, "scene.toml", Some(dir), &Options::default());
    let last = if scene.target.is_empty() { "ledger.json" } else { "lightcurve.svg" };
    there.is_ok_and(|there| there.sha256() == scene.sha256()) && dir.join(last).is_file()
}

fn table(entries: &[Entry], ended: &[Ended], dir: &Path) -> Table {
    let rows = entries.iter().zip(ended).map(|(entry, end)| (entry, end, Summary::of(&dir.join(entry.folder()))));
    let rows = rows.collect::<Vec<_>>();
    let mut table = Table::default();
    table.ints("scene", rows.iter().map(|(entry, ..)| entry.number as i64));
    table.texts("name", rows.iter().map(|(entry, ..)| entry.folder()));
    table.texts("status", rows.iter().map(|(_, end, _)| end.status.to_owned()));
    table.ints("frames", rows.iter().map(|(.., s)| s.frames as i64));
    table.ints("points", rows.iter().map(|(.., s)| s.points as i64));
    table.floats("median_mag_v", "mag", rows.iter().map(|(.., s)| s.median_mag_v));
    table.floats("median_mag_err", "mag", rows.iter().map(|(.., s)| s.median_mag_err));
    table.floats("median_snr", "", rows.iter().map(|(.., s)| s.median_snr));
    table.floats("chi2", "", rows.iter().map(|(.., s)| s.chi2));
    table.texts("set", rows.iter().map(|(entry, ..)| entry.told()));
    table.texts("why", rows.iter().map(|(_, end, _)| end.why.replace('\n', "; ")));
    table
}

/// Bytes of a scene's frames, headers and planes left out.
fn bytes(scene: &Scene) -> f64 {
    let [width, height] = scene.detector.stored_px().map(|n| n as f64);
    let pixel = if scene.detector.bits > 16 { 4.0 } else { 2.0 };
    width * height * pixel * scene.exposures.count as f64
}

fn card(args: &CampaignFile, global: &Global, talk: &Talk) -> Result<(), Failure> {
    let (campaign, scenes) = read(args, global)?;
    // measured on one scene, and carried over by pixels and frames
    let mut per_byte = f64::NAN;
    if let Some(scene) = scenes.first() {
        let found = explained(&Simulator::new(scene)?)?;
        per_byte = found.total_s / bytes(scene).max(1.0);
    }
    let rows = campaign.entries.iter().zip(&scenes).map(|(entry, scene)| (entry, scene, bytes(scene)));
    let rows = rows.collect::<Vec<_>>();
    let total = rows.iter().map(|(.., bytes)| bytes).sum::<f64>();
    talk.detail("times are those of the first scene, carried over by pixels and frames");
    if global.json {
        let row = |(entry, scene, bytes): &(&Entry, &Scene, f64)| {
            json!({
                "scene": entry.number, "name": entry.folder(), "set": entry.told(), "frames": scene.exposures.count,
                "time_s": finite(bytes * per_byte), "bytes": bytes,
            })
        };
        let list = rows.iter().map(row).collect::<Vec<_>>();
        return print_json(&json!({
            "command": "campaign card", "rows": list, "cost": { "total_s": finite(total * per_byte), "bytes": total },
        }));
    }
    let mut text = format!("{:>6} {:>7} {:>9} {:>9}  scene\n", "scene", "frames", "about, s", "MB");
    for (entry, scene, bytes) in &rows {
        text += &format!(
            "{:>6} {:>7} {:>9.1} {:>9.1}  {}: {}\n",
            entry.number,
            scene.exposures.count,
            bytes * per_byte,
            bytes / 1e6,
            entry.folder(),
            entry.told()
        );
    }
    text += &format!(
        "{} scenes, about {:.0} s on this machine, {:.1} MB of frames\n",
        rows.len(),
        total * per_byte,
        total / 1e6
    );
    print(&text)
}
