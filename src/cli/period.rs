//! `nightglass period`.

use super::args::{Global, PeriodArgs};
use super::talk::{Failure, Talk, give, print, print_json};
use crate::base::table::{Table, Values};
use crate::io::curve_file::{self, CurveFile};
use crate::io::ecsv::to_ecsv;
use crate::photometry::flag;
use crate::photometry::period::{Candidate, Note, Options, Report, Series, search};
use crate::study::measured_picture::{folded, periodogram};
use serde_json::json;

/// Points with one of these flags tell nothing of a period.
const SPOILT: u32 = flag::SATURATED | flag::BLOOMED | flag::EDGE | flag::NOT_DETECTED;

/// No magnitude is better than this: added to the errors in quadrature \[mag\].
const LEAST_ERROR: f64 = 1e-3;

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
    let report = searched(&file, curve, args)?;
    tell(&report, talk);
    let table = candidates(&report);
    if let Some(dir) = &global.output {
        give(dir, "period.ecsv", &to_ecsv(&table), global, talk)?;
        give(dir, "periodogram.svg", &periodogram(&report, &file.curves[curve].name), global, talk)?;
        if let Some(best) = report.candidates.first() {
            let title = format!("{}: period {:.6} s", file.curves[curve].name, best.period_s);
            give(dir, "folded.svg", &folded(&file, curve, &title, best.period_s), global, talk)?;
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

/// The search in a curve's magnitudes, reduced to one range where that is known.
fn searched(file: &CurveFile, curve: usize, args: &PeriodArgs) -> Result<Report, Failure> {
    let rows = file.rows.iter().filter(|r| r.curve == curve && r.flags & SPOILT == 0).collect::<Vec<_>>();
    let reduced = file.curves[curve].reduced || rows.iter().any(|r| r.range_km.is_nan());
    let origin = rows.first().map(|r| r.time);
    let time_s = rows.iter().filter_map(|r| Some(r.time.since(&origin?))).collect::<Vec<_>>();
    let range = |km: f64| if reduced { 0.0 } else { 5.0 * (km / 1000.0).log10() };
    let value = rows.iter().map(|r| r.mag - range(r.range_km)).collect::<Vec<_>>();
    // without errors all points count alike
    let known = rows.iter().any(|r| r.mag_err > 0.0);
    let sigma = rows.iter().map(|r| if known { r.mag_err.hypot(LEAST_ERROR) } else { LEAST_ERROR });
    let sigma = sigma.collect::<Vec<_>>();
    let options = Options {
        min_period_s: args.min_period,
        max_period_s: args.max_period,
        harmonics: usize::from(args.harmonics),
        ..Options::default()
    };
    let series = Series { time_s: &time_s, value: &value, sigma: &sigma };
    search(&series, &options).map_err(|fault| Failure::Input(fault.to_string()))
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

/// Candidates and aliases as rows.
fn candidates(report: &Report) -> Table {
    let mut table = Table::default();
    table.note("significant", report.significant);
    table.note("points", report.points);
    table.note("span_s", report.span_s);
    let candidates = || report.candidates.iter();
    let aliases = || report.aliases.iter();
    let kinds = candidates().map(|_| "candidate").chain(aliases().map(|_| "alias of the first"));
    table.texts("kind", kinds.map(str::to_owned));
    let mut floats = |name, unit, of: &dyn Fn(&Candidate) -> f64, alias: &dyn Fn(usize) -> f64| {
        table.floats(name, unit, candidates().map(of).chain((0..report.aliases.len()).map(alias)));
    };
    let unknown = |_| f64::NAN;
    floats("period_s", "s", &|c| c.period_s, &|i| report.aliases[i].period_s);
    floats("period_err_s", "s", &|c| c.period_err_s, &unknown);
    floats("power", "", &|c| c.power_multi, &|i| report.aliases[i].power);
    floats("theta", "", &|c| c.theta.unwrap_or(f64::NAN), &unknown);
    floats("false_alarm", "", &|c| c.false_alarm, &unknown);
    floats("chi2", "", &|c| c.chi2, &|i| report.aliases[i].chi2);
    floats("delta_chi2", "", &|_| f64::NAN, &|i| report.aliases[i].delta_chi2);
    floats("amplitude_mag", "mag", &|c| c.amplitude, &unknown);
    let maxima = candidates().map(|c| c.maxima as i64).chain(aliases().map(|_| -1));
    table.ints("maxima", maxima);
    let told_apart = candidates().map(|_| true).chain(aliases().map(|a| !a.indistinguishable));
    table.column("told_apart", "", Values::Bool(told_apart.collect()));
    table
}
