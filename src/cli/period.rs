//! `nightglass period`.

use super::args::{Global, PeriodArgs};
use super::talk::{Failure, Talk, give, print, print_json};
use crate::io::curve_file;
use crate::io::ecsv::to_ecsv;
use crate::photometry::period::{Note, Options, Report};
use crate::run::periods;
use crate::study::measured_picture::{folded, periodogram};
use serde_json::json;

pub(super) fn period(args: &PeriodArgs, global: &Global, talk: &Talk) -> Result<(), Failure> {
    let name = args.lightcurve.display().to_string();
    let text = std::fs::read_to_string(&args.lightcurve).map_err(|e| Failure::Input(format!("{name}: {e}")))?;
    let file = curve_file::read(&name, &text).map_err(|e| Failure::Input(e.to_string()))?;
    let names = || file.curves.iter().map(|c| c.name.as_str()).collect::<Vec<_>>().join(", ");
    let curve = match &args.target {
        Some(wanted) => file.curves.iter().position(|c| c.name == *wanted),
        None => (file.curves.len() == 1).then_some(0),
    };
    let Some(curve) = curve else {
        return Err(Failure::Input(format!(
            "{name} holds {} light curves: {}; --target chooses one",
            file.curves.len(),
            names()
        )));
    };
    let options = Options {
        min_period_s: args.min_period,
        max_period_s: args.max_period,
        harmonics: usize::from(args.harmonics),
        ..Options::default()
    };
    let points = periods::points(&file, curve);
    let report = periods::of(&points, &options).map_err(|fault| Failure::Input(fault.to_string()))?;
    tell(&report, talk);
    let table = periods::table(&report);
    let name = &file.curves[curve].name;
    if let Some(dir) = &global.output {
        give(dir, "period.ecsv", &to_ecsv(&table), global, talk)?;
        give(dir, "periodogram.svg", &periodogram(&report, name), global, talk)?;
        if let Some(best) = report.candidates.first() {
            give(dir, "folded.svg", &folded(&points, name, best.period_s), global, talk)?;
        }
    }
    match (global.json, &global.output) {
        (true, _) => print_json(&json!({
            "command": "period",
            "rows": table.to_json_rows(),
            "aliases": report.aliases,
            "window": report.window,
            "significant": report.significant,
            "notes": report.notes.iter().map(ToString::to_string).collect::<Vec<_>>(),
        })),
        (false, None) => print(&to_ecsv(&table)),
        (false, Some(_)) => Ok(()),
    }
}

fn tell(report: &Report, talk: &Talk) {
    report.notes.iter().for_each(|note| talk.say(&format!("note: {note}")));
    let claimed = report.significant && !report.notes.contains(&Note::FewerThanTwoTurns);
    let Some(best) = report.candidates.first().filter(|_| claimed) else {
        return talk.say("no period is claimed; the candidates are listed");
    };
    talk.say(&format!(
        "period {:.6} +- {:.6} s, {} maxima a turn, amplitude {:.3} mag, false-alarm probability {:.1e}",
        best.period_s, best.period_err_s, best.maxima, best.amplitude, best.false_alarm
    ));
    let alike = report.aliases.iter().filter(|a| a.indistinguishable).map(|a| format!("{:.6} s", a.period_s));
    let alike = alike.collect::<Vec<_>>();
    if !alike.is_empty() {
        talk.say(&format!("the data do not tell it from {}", alike.join(", ")));
    }
}
