//! `nightglass plan`.

use super::args::{Global, PlanArgs};
use super::talk::{Failure, Talk, finite, give, load, print, print_json};
use crate::astro::orbit::Orbit;
use crate::astro::orbit::catalogue::Listed;
use crate::astro::orbit::elements::MeanElements;
use crate::astro::orbit::sgp4::Sgp4;
use crate::astro::time::Instant;
use crate::base::constants::DAY_S;
use crate::base::table::Table;
use crate::io::ecsv::to_ecsv;
use crate::plan::PlanError;
use crate::plan::pace::Pace;
use crate::plan::place::Motion;
use crate::plan::planner::{OLD_ELEMENTS_DAYS, Planner, known};
use crate::plan::view::Planned;
use crate::plan::windows::{Night, Window};
use crate::plan::{crossing, table};
use crate::scene::Scene;
use crate::simulate::{SimulateError, Simulator};
use crate::study::night_chart;
use crate::study::snr::least::Least;
use rayon::prelude::*;
use serde_json::{Value as Json, json};
use std::path::Path;

/// Longest plan whose windows are searched \[d\].
const LONGEST_DAYS: f64 = 40.0;

pub(super) fn plan(args: &PlanArgs, global: &Global, talk: &Talk) -> Result<(), Failure> {
    let scene = load(&args.scene, global)?;
    // signal-to-noise ratios need all of a simulator, the rest its geometry alone
    let simulator = scene.plan.min_snr.map(|_| Simulator::new(&scene)).transpose()?;
    let least = simulator.as_ref().and_then(Least::of);
    let planner = Planner::new(&scene).map_err(SimulateError::from)?;
    planner.warnings().iter().for_each(|w| talk.say(&format!("warning: {w}")));
    match &args.catalog {
        Some(file) if args.crossings => crossings(&scene, &planner, file, global, talk),
        Some(file) => catalogue_windows(&scene, &planner, file, global, talk),
        None => of_scene(args, &scene, &planner, least.as_ref(), global, talk),
    }
}

/// Exposures, windows, attitudes and chart of the scene's own targets.
fn of_scene(
    args: &PlanArgs,
    scene: &Scene,
    planner: &Planner,
    least: Option<&Least>,
    global: &Global,
    talk: &Talk,
) -> Result<(), Failure> {
    let planned = exposures(scene, planner, least, talk)?;
    let plan = table::table_of(&planned, planner);
    let observable = planned.iter().filter(|p| p.observable()).count();
    talk.say(&format!("{observable} of {} exposures observable", planned.len()));
    let unknown = planned.iter().filter(|p| p.view().is_none());
    if let Some(first) = unknown.clone().next() {
        talk.say(&format!("warning: {} exposures have no place; the first: {}", unknown.count(), first.why()));
    }
    let wanted = args.windows || global.output.is_some() || global.json;
    let night = if wanted && search_is_short(planner, talk) {
        Some(planner.night().map_err(SimulateError::from)?)
    } else {
        None
    };
    let windows = night.as_ref().map(|night| own_windows(scene, planner, least, night, talk)).transpose()?;
    let named = windows.iter().flatten().zip(&scene.target).map(|(w, t)| (t.name.as_str(), w.as_slice()));
    let window_table = table::windows(&named.collect::<Vec<_>>(), scene);
    let attitudes = table::attitudes(planner, &planned, scene).map_err(SimulateError::from)?;
    if let Some(dir) = &global.output {
        give(dir, "plan.ecsv", &to_ecsv(&plan), global, talk)?;
        if let Some(attitudes) = &attitudes {
            give(dir, "attitude.ecsv", &to_ecsv(attitudes), global, talk)?;
        }
        if let Some((night, windows)) = night.as_ref().zip(windows.as_ref()) {
            give(dir, "windows.ecsv", &to_ecsv(&window_table), global, talk)?;
            let chart = night_chart::svg(scene, planner, night.span, windows).map_err(SimulateError::from)?;
            give(dir, "night.svg", &chart, global, talk)?;
        }
    }
    if global.json {
        let orbits = planner
            .orbits()
            .into_iter()
            .map(|(name, age, method)| json!({ "target": name, "element_age_d": finite(age), "method": method }));
        return print_json(&json!({
            "command": "plan",
            "rows": plan.to_json_rows(),
            "windows": window_table.to_json_rows(),
            "attitudes": attitudes.map_or(Json::Null, |t| t.to_json_rows()),
            "orbits": orbits.collect::<Vec<_>>(),
            "warnings": planner.warnings(),
        }));
    }
    match (&global.output, args.windows) {
        (Some(_), _) => Ok(()),
        (None, true) => print(&to_ecsv(&window_table)),
        (None, false) => print(&to_ecsv(&plan)),
    }
}

fn exposures(
    scene: &Scene,
    planner: &Planner,
    least: Option<&Least>,
    talk: &Talk,
) -> Result<Vec<Planned>, Failure> {
    let bar = talk.bar(scene.exposures.count, "exposures");
    let planned = planner.all(&|| bar.inc(1));
    bar.finish_and_clear();
    let mut planned = planned.map_err(SimulateError::from)?;
    if let Some(least) = least {
        let bar = talk.bar(planned.len(), "SNR");
        let held = least.hold(&mut planned, &|| bar.inc(1));
        bar.finish_and_clear();
        held.map_err(SimulateError::from)?;
    }
    Ok(planned)
}

fn own_windows(
    scene: &Scene,
    planner: &Planner,
    least: Option<&Least>,
    night: &Night,
    talk: &Talk,
) -> Result<Vec<Vec<Window>>, Failure> {
    let bar = talk.bar(scene.target.len(), "windows");
    let windows = (0..scene.target.len()).into_par_iter().map(|i| {
        let own = match least {
            Some(least) => least.windows(i, night),
            None => planner.windows(i, night, None),
        };
        bar.inc(1);
        own
    });
    let windows = windows.collect::<Result<Vec<_>, PlanError>>();
    bar.finish_and_clear();
    Ok(windows.map_err(SimulateError::from)?)
}

/// Whether the exposures last for so short that their nights are worth searching; says so if not.
fn search_is_short(planner: &Planner, talk: &Talk) -> bool {
    let days = planner.exposed().seconds() / DAY_S;
    if days > LONGEST_DAYS {
        talk.say(&format!(
            "windows are left out: the exposures last {days:.0} days, more than {LONGEST_DAYS}; set exposures.count lower"
        ));
    }
    days <= LONGEST_DAYS
}

/// The objects of a catalogue file that SGP4 can use.
struct Objects {
    elements: Vec<MeanElements>,
    motions: Vec<Motion>,
    paces: Vec<Pace>,
}

impl Objects {
    fn read(file: &Path, at: &Instant, talk: &Talk) -> Result<Self, Failure> {
        let unreadable = |why: &str| Failure::Input(format!("cannot read {}: {why}", file.display()));
        // a directory, pipe or device is refused: it may never end
        match std::fs::metadata(file) {
            Ok(known) if known.is_file() => {}
            Ok(_) => return Err(unreadable("not a file")),
            Err(e) => return Err(unreadable(&e.to_string())),
        }
        let bytes = std::fs::read(file).map_err(|e| unreadable(&e.to_string()))?;
        let listed = Listed::read(&String::from_utf8_lossy(&bytes))
            .map_err(|e| Failure::Input(format!("{}: {e}", file.display())))?;
        let mut own = Self { elements: Vec::new(), motions: Vec::new(), paces: Vec::new() };
        let mut faults = listed.faults;
        let mut oldest = 0.0f64;
        for elements in listed.objects {
            match Sgp4::new(&elements) {
                Ok(sgp4) => {
                    let motion = Motion::Orbit(Orbit::Mean(Box::new(sgp4)));
                    own.paces.push(Pace::of(&motion, at));
                    oldest = oldest.max(at.since(&elements.epoch).abs() / DAY_S);
                    own.elements.push(elements);
                    own.motions.push(motion);
                }
                Err(fault) => faults.push(fault),
            }
        }
        faults.iter().take(5).for_each(|fault| talk.say(&format!("warning: left out: {fault}")));
        if faults.len() > 5 {
            talk.say(&format!("warning: {} more objects left out", faults.len() - 5));
        }
        let warning = if oldest > OLD_ELEMENTS_DAYS { "warning: " } else { "" };
        talk.say(&format!(
            "{warning}{} objects, elements up to {oldest:.1} days from the exposures",
            own.elements.len()
        ));
        Ok(own)
    }

    fn describe(&self, number: usize, at: &Instant) -> (String, u64, f64) {
        let elements = &self.elements[number];
        (elements.title(), elements.catalog_number, at.since(&elements.epoch) / DAY_S)
    }
}

/// Windows of every object of a catalogue.
fn catalogue_windows(
    scene: &Scene,
    planner: &Planner,
    file: &Path,
    global: &Global,
    talk: &Talk,
) -> Result<(), Failure> {
    if !search_is_short(planner, talk) {
        return Err(Failure::Input("exposures.count: too long a plan for windows".into()));
    }
    let objects = Objects::read(file, &planner.exposed().start, talk)?;
    let night = planner.night().map_err(SimulateError::from)?;
    let bar = talk.bar(objects.motions.len(), "objects");
    let windows = objects.motions.par_iter().map(|motion| {
        let windows = night.windows(motion, None);
        bar.inc(1);
        windows
    });
    let windows = windows.collect::<Result<Vec<_>, PlanError>>();
    bar.finish_and_clear();
    let windows = windows.map_err(SimulateError::from)?;
    let seen = windows.iter().filter(|own| own.iter().any(|w| w.observable)).count();
    talk.say(&format!("{seen} of {} objects can be observed", windows.len()));
    let names = objects.elements.iter().map(MeanElements::title).collect::<Vec<_>>();
    let named = names.iter().zip(&windows).map(|(n, w)| (n.as_str(), w.as_slice())).collect::<Vec<_>>();
    let mut rows = table::windows(&named, scene);
    // names need not be unique
    let numbers = objects.elements.iter().zip(&windows);
    rows.ints("catalog_number", numbers.flat_map(|(e, own)| own.iter().map(|_| e.catalog_number as i64)));
    finish("windows.ecsv", &rows, global, talk)
}

/// Objects of a catalogue in the field while the shutter is open.
fn crossings(scene: &Scene, planner: &Planner, file: &Path, global: &Global, talk: &Talk) -> Result<(), Failure> {
    let start = planner.exposed().start;
    let objects = Objects::read(file, &start, talk)?;
    let views = known(exposures(scene, planner, None, talk)?);
    let bar = talk.bar(views.len(), "exposures");
    let size = scene.detector.light_px();
    let found = views.par_iter().map(|view| {
        let found = crossing::crossings(planner, view, &objects.motions, &objects.paces, size);
        bar.inc(1);
        found
    });
    let found = found.collect::<Result<Vec<_>, PlanError>>();
    bar.finish_and_clear();
    let found = found.map_err(SimulateError::from)?.concat();
    talk.say(&format!("{} crossings of the field in {} exposures", found.len(), views.len()));
    let rows = crossing::table(&found, &|number| objects.describe(number, &start), &views);
    finish("crossings.ecsv", &rows, global, talk)
}

fn finish(name: &str, rows: &Table, global: &Global, talk: &Talk) -> Result<(), Failure> {
    if let Some(dir) = &global.output {
        give(dir, name, &to_ecsv(rows), global, talk)?;
    }
    match (global.json, &global.output) {
        (true, _) => print_json(&json!({ "command": "plan", "rows": rows.to_json_rows() })),
        (false, None) => print(&to_ecsv(rows)),
        (false, Some(_)) => Ok(()),
    }
}
