//! `nightglass snr`.

use super::args::{Global, SnrArgs};
use super::talk::{Failure, Talk, clock, finite, give, load, print, print_json};
use crate::base::table::Table;
use crate::io::atomic;
use crate::io::ecsv::to_ecsv;
use crate::run::OutputDir;
use crate::scene::{self, Options, Scene};
use crate::simulate::Simulator;
use crate::study::snr::limit::{map, map_table, night, night_table};
use crate::study::snr::map_picture::{map_svg, night_svg};
use crate::study::snr::picture;
use crate::study::snr::setting::Setting;
use crate::study::snr::stage::{Staged, typical_frame};
use crate::study::snr::sweep::parse_all;
use crate::study::snr::table::{Row, rows_of, table};
use crate::study::snr::{Group, SnrError, Study};
use rayon::prelude::*;
use serde_json::{Value as Json, json};
use std::path::Path;
use std::sync::Mutex;

/// A study expected to take longer is announced \[s\].
const LONG_S: f64 = 5.0;
/// Rows found are written this often \[s\].
const SAVE_S: f64 = 2.0;

impl From<SnrError> for Failure {
    fn from(e: SnrError) -> Self {
        match e {
            SnrError::Run(e) => e.into(),
            SnrError::Simulate(e) => e.into(),
            SnrError::Scene { .. } | SnrError::Usage(_) => Self::Input(e.to_string()),
        }
    }
}

pub(super) fn snr(args: &SnrArgs, global: &Global, talk: &Talk) -> Result<(), Failure> {
    let sweeps = parse_all(&args.sweep).map_err(Failure::Input)?;
    let scene = load(&args.scene, global)?;
    if args.frame.is_some_and(|frame| frame >= scene.exposures.count) {
        let count = scene.exposures.count;
        return Err(Failure::Input(format!(
            "--frame {}: the scene has frames 0..{count}",
            args.frame.unwrap_or(0)
        )));
    }
    let frame = args.frame.map_or_else(|| typical_frame(&scene), Ok)?;
    let again = |sets: &[(String, String)]| {
        let sets = [&global.set[..], sets].concat();
        scene::load(&args.scene, &Options { sets: &sets, seed: global.seed })
    };
    let trials = args.monte_carlo.unwrap_or(0) as usize;
    let mut study = Study { load: &again, sweeps, wanted: args.wanted, trials, frame, dead_s: args.dead_time };
    if study.sweeps.is_empty() {
        study.sweeps = vec![study.magnitudes()?];
    }
    // the scene as it stands, for the limit beside the rows
    let staged = Staged::new(scene.clone(), &Setting::default(), frame)?;
    let simulator = Simulator::new(&staged.scene)?;
    let exposed = staged.expose(&simulator)?;
    let limit = exposed.limiting_mag(crate::study::snr::ccd::Estimator::of(&staged.scene), study.wanted);
    let meta = meta(&study, &scene, limit);
    if let Some(dir) = &global.output {
        prepare(dir, &scene, &study, &meta, global)?;
    }
    let rows = rows(&study, &meta, global, talk)?;
    let mut result = table(&study.sweeps, &rows);
    result.meta.clone_from(&meta);

    let title = if exposed.why.is_empty() {
        format!("{}, frame {frame}; as the scene stands V {limit:.2} has SNR {}", scene.name, study.wanted)
    } else {
        format!("{}, frame {frame}", scene.name)
    };
    if let Some(dir) = &global.output {
        atomic::write(&dir.join("snr.ecsv"), to_ecsv(&result).as_bytes())?;
        atomic::write(&dir.join("snr.svg"), picture::svg(&title, &study.sweeps, &rows, study.wanted).as_bytes())?;
        talk.say(&format!("wrote {0}/snr.ecsv, {0}/snr.svg", dir.display()));
    }
    let now = staged.view.circumstances();
    let mut more = serde_json::Map::new();
    if args.map {
        let map = map(&simulator, &now, study.wanted);
        let seen = staged.view.targets.get(staged.target).map(|t| t.apparent);
        let target = seen.map(|at| [at.azimuth.to_degrees(), at.elevation.to_degrees()]);
        let title = format!("{}, {} UTC, SNR {}", scene.name, &staged.view.mid.iso_utc()[..19], study.wanted);
        let picture = || map_svg(&title, &map, &now, target);
        further("map", &map_table(&map), picture, &meta, &mut more, global, talk)?;
    }
    if args.night {
        let night = night(&simulator, &staged.view.mid, staged.target, study.wanted)
            .map_err(crate::simulate::SimulateError::from)?;
        let title = format!("{}: SNR {} in {} s", scene.name, study.wanted, scene.exposures.duration_s);
        further("night", &night_table(&night), || night_svg(&title, &night), &meta, &mut more, global, talk)?;
    }
    if !exposed.why.is_empty() {
        talk.say(&format!("frame {frame}: no SNR: {}", exposed.why));
    }
    if global.json {
        let mut whole = json!({
            "command": "snr", "rows": result.to_json_rows(), "limiting_mag_v": finite(limit), "wanted_snr": study.wanted,
            "frame": frame, "why": exposed.why,
        });
        if let Some(object) = whole.as_object_mut() {
            object.extend(more);
        }
        return print_json(&whole);
    }
    if global.output.is_none() && !args.map && !args.night {
        return print(&to_ecsv(&result));
    }
    Ok(())
}

/// A further table and its picture: to the directory, into the JSON, or to stdout.
fn further(
    name: &'static str,
    table: &Table,
    picture: impl Fn() -> String,
    meta: &[(String, Json)],
    more: &mut serde_json::Map<String, Json>,
    global: &Global,
    talk: &Talk,
) -> Result<(), Failure> {
    let mut table = table.clone();
    table.meta = meta.to_vec();
    if let Some(dir) = &global.output {
        give(dir, &format!("snr_{name}.ecsv"), &to_ecsv(&table), global, talk)?;
        give(dir, &format!("snr_{name}.svg"), &picture(), global, talk)?;
    }
    if global.json {
        more.insert(name.into(), table.to_json_rows());
    } else if global.output.is_none() {
        print(&to_ecsv(&table))?;
    }
    Ok(())
}

/// What tells one study from another.
fn meta(study: &Study, scene: &Scene, limit: f64) -> Vec<(String, Json)> {
    let sweeps = study.sweeps.iter().map(|sweep| sweep.text()).collect::<Vec<_>>().join(" ");
    let pairs = [
        ("scene_sha", json!(scene.sha256())),
        ("sweep", json!(sweeps)),
        ("frame", json!(study.frame)),
        ("wanted_snr", json!(study.wanted)),
        ("monte_carlo", json!(study.trials)),
        ("dead_time_s", study.dead_s.map_or(Json::Null, |s| json!(s))),
        ("limiting_mag_v", finite(limit)),
    ];
    pairs.map(|(key, value)| (key.to_owned(), value)).to_vec()
}

/// The directory made ready: another scene's or another study's output is refused.
fn prepare(
    dir: &Path,
    scene: &Scene,
    study: &Study,
    meta: &[(String, Json)],
    global: &Global,
) -> Result<(), Failure> {
    let path = dir.join("snr.ecsv");
    let there = std::fs::read_to_string(&path).ok();
    let other = there.is_some_and(|text| rows_of(&text, &study.sweeps, meta).is_none());
    if other && !global.force {
        let path = path.display();
        return Err(Failure::Input(format!(
            "{path} is of another scene or sweep; choose another directory with -o, or replace it with --force"
        )));
    }
    let ready = OutputDir::prepare(dir, scene, global.force)?;
    // no frames are kept here; a folder with some stays
    let _ = std::fs::remove_dir(ready.file("frames"));
    if global.force {
        for name in ["snr.ecsv", "snr.svg", "snr_map.ecsv", "snr_map.svg", "snr_night.ecsv", "snr_night.svg"] {
            let _ = std::fs::remove_file(dir.join(name));
        }
    }
    Ok(())
}

/// All rows, those that an earlier study left in the directory kept.
fn rows(study: &Study, meta: &[(String, Json)], global: &Global, talk: &Talk) -> Result<Vec<Row>, Failure> {
    let groups = study.groups();
    // every value is checked before the first is computed
    let faults = groups.iter().filter_map(|group| study.scene(group).err()).map(|e| e.to_string());
    let faults = faults.collect::<Vec<_>>();
    if !faults.is_empty() {
        return Err(Failure::Input(faults.join("\n")));
    }
    let count = groups.iter().flat_map(Group::numbers).count();
    let points = crate::study::snr::sweep::points(&study.sweeps);
    let kept = global.output.as_ref().and_then(|dir| std::fs::read_to_string(dir.join("snr.ecsv")).ok());
    let kept = kept.and_then(|text| rows_of(&text, &study.sweeps, meta)).unwrap_or_default();
    let mut rows: Vec<Option<Row>> = vec![None; count];
    for (row, point) in rows.iter_mut().zip(&points) {
        *row = kept.iter().find(|kept| kept.values == point.values).cloned();
    }
    let kept = rows.iter().flatten().count();
    if kept > 0 {
        talk.say(&format!("{kept} of {count} rows are there from an earlier run"));
    }
    let missing = |group: &&Group| group.numbers().any(|number| rows.get(number).is_some_and(Option::is_none));
    let mut open = groups.iter().filter(missing).collect::<Vec<_>>();
    let bar = talk.bar(count - kept, "snr");
    let clock = clock();
    if open.is_empty() {
        return Ok(rows.into_iter().flatten().collect());
    }
    // the first group tells how long the rest will take
    let first = open.remove(0);
    let found = study.rows(first)?;
    // trials share all cores already
    let side_by_side = if study.trials > 0 { 1 } else { rayon::current_num_threads().clamp(1, open.len().max(1)) };
    let took = clock() * open.len() as f64 / side_by_side as f64;
    bar.inc(found.len() as u64);
    found.into_iter().for_each(|(number, row)| rows[number] = Some(row));
    if took > LONG_S {
        talk.say(&format!("{} rows, about {took:.0} s", count - kept));
    }
    let rows = Mutex::new((rows, clock()));
    let done = |group: &&Group| -> Result<(), Failure> {
        let found = study.rows(group)?;
        bar.inc(found.len() as u64);
        let mut shared = rows.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        found.into_iter().for_each(|(number, row)| shared.0[number] = Some(row));
        if let Some(dir) = global.output.as_ref().filter(|_| clock() - shared.1 > SAVE_S) {
            let so_far = shared.0.iter().flatten().cloned().collect::<Vec<_>>();
            let mut part = table(&study.sweeps, &so_far);
            part.meta = meta.to_vec();
            atomic::write(&dir.join("snr.ecsv"), to_ecsv(&part).as_bytes())?;
            shared.1 = clock();
        }
        Ok(())
    };
    open.par_iter().try_for_each(done)?;
    bar.finish_and_clear();
    let rows = rows.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner).0;
    Ok(rows.into_iter().flatten().collect())
}
