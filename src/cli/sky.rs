//! `nightglass sky`.

use super::args::{Global, SkyArgs};
use super::talk::{Failure, Talk, finite, give, load, print, print_json};
use crate::base::table::Table;
use crate::io::ecsv::to_ecsv;
use crate::plan::windows::nights;
use crate::simulate::{SimulateError, Simulator};
use crate::sky::response::Integrals;
use crate::study::sky::{self, BANDS, BudgetRow, Means, NAMES, Sky, ZeroPoint};
use crate::study::{sky_maps, sky_night};
use serde_json::{Value as Json, json};
use std::fmt::Write;

/// Steps of the night's curve.
const STEPS: usize = 288;

pub(super) fn sky(args: &SkyArgs, global: &Global, talk: &Talk) -> Result<(), Failure> {
    let scene = load(&args.scene, global)?;
    if args.frame >= scene.exposures.count {
        return Err(Failure::Input(format!(
            "--frame {}: the scene has frames 0..{}",
            args.frame, scene.exposures.count
        )));
    }
    let simulator = Simulator::new(&scene)?;
    let view = simulator.planner.view(args.frame).map_err(SimulateError::from)?;
    let now = view.circumstances();
    let rows = sky::budget(&simulator, &view).map_err(SimulateError::from)?;
    let (integrals, zero_points) = (sky::integrals(&simulator), sky::zero_points(&simulator));
    let heading = format!(
        "{}, {} UTC: Sun {:.1} deg, Moon {:.1} deg, phase angle {:.0} deg",
        scene.station.name,
        &now.instant.iso_utc()[..19],
        now.sun.horizontal.elevation.to_degrees(),
        now.moon.body.horizontal.elevation.to_degrees(),
        now.moon.phase.to_degrees()
    );
    if let Some(dir) = &global.output {
        let night = nights(&now.instant, &now.instant, scene.station.longitude_deg.to_radians());
        let curve = sky::zenith_curve(&simulator, &night.start, &night.end, STEPS).map_err(SimulateError::from)?;
        let times = (0..=STEPS).map(|k| night.start.plus(k as f64 * night.seconds() / STEPS as f64).iso_utc());
        give(dir, "sky_budget.ecsv", &to_ecsv(&budget_table(&rows, &heading)), global, talk)?;
        give(dir, "sky_night.ecsv", &to_ecsv(&night_table(times, &curve)), global, talk)?;
        give(dir, "sky_night.svg", &sky_night::svg(&scene.station.name, &night.start, &curve), global, talk)?;
        give(dir, "sky_maps.svg", &sky_maps::svg(&Sky::new(&simulator), &now, &heading), global, talk)?;
    }
    match (global.json, &global.output) {
        (true, _) => print_json(&as_json(&rows, &integrals, &zero_points)),
        (false, None) => print(&as_text(&heading, &rows, &integrals, &zero_points)),
        (false, Some(_)) => Ok(()),
    }
}

fn budget_table(rows: &[BudgetRow], heading: &str) -> Table {
    let mut table = Table::default();
    table.note("sky", heading);
    table.texts("source", rows.iter().map(|r| r.name.to_owned()));
    let column = |value: &dyn Fn(&BudgetRow) -> f64| rows.iter().map(value).collect::<Vec<_>>().into_iter();
    table.floats("zenith_e_px_s", "electron / (pix s)", column(&|r| r.zenith));
    table.floats("centre_e_px_s", "electron / (pix s)", column(&|r| r.centre));
    table.floats("least_e_px_s", "electron / (pix s)", column(&|r| r.range[0]));
    table.floats("median_e_px_s", "electron / (pix s)", column(&|r| r.range[1]));
    table.floats("most_e_px_s", "electron / (pix s)", column(&|r| r.range[2]));
    for (k, name) in ["zenith_b", "zenith_v", "zenith_r", "zenith_i"].into_iter().enumerate() {
        table.floats(name, "mag / arcsec2", column(&|r| r.bands[k]));
    }
    table.floats("uncertainty", "", column(&|r| r.uncertainty));
    table.texts("why", rows.iter().map(|r| r.why.clone()));
    table
}

fn night_table(times: impl Iterator<Item = String>, curve: &[(f64, Means)]) -> Table {
    let mut table = Table::default();
    table.texts("time_utc", times);
    for (k, name) in NAMES.into_iter().enumerate() {
        table.floats(name, "electron / (pix s)", curve.iter().map(|(_, m)| m[k]).collect::<Vec<_>>().into_iter());
    }
    table
}

fn as_json(rows: &[BudgetRow], integrals: &[Integrals; 2], zero_points: &[ZeroPoint]) -> Json {
    let row = |r: &BudgetRow| {
        json!({
            "source": r.name, "why": r.why, "zenith_e_px_s": finite(r.zenith), "centre_e_px_s": finite(r.centre),
            "least_e_px_s": finite(r.range[0]), "median_e_px_s": finite(r.range[1]), "most_e_px_s": finite(r.range[2]),
            "zenith_b": finite(r.bands[0]), "zenith_v": finite(r.bands[1]),
            "zenith_r": finite(r.bands[2]), "zenith_i": finite(r.bands[3]), "uncertainty": finite(r.uncertainty),
        })
    };
    let factors = |i: &Integrals| json!({ "sint": i.sint, "bint": i.bint, "aint": i.aint });
    let total = sky::total_bands(rows);
    let zero = |z: &ZeroPoint| json!({ "spectrum": z.spectrum, "outside_mag_v": finite(z.mag_v[0]), "in_air_mag_v": finite(z.mag_v[1]) });
    json!({
        "command": "sky",
        "rows": rows.iter().map(row).collect::<Vec<_>>(),
        "total_zenith": { "b": finite(total[0]), "v": finite(total[1]), "r": finite(total[2]), "i": finite(total[3]) },
        "integrals": { "outside": factors(&integrals[0]), "in_air": factors(&integrals[1]) },
        "zero_points": zero_points.iter().map(zero).collect::<Vec<_>>(),
    })
}

fn as_text(heading: &str, rows: &[BudgetRow], integrals: &[Integrals; 2], zero_points: &[ZeroPoint]) -> String {
    let mut text =
        format!("{heading}\n\ne-/px/s; least, median, most above 10 deg; B V R I of the zenith, mag/arcsec^2\n");
    let _ = writeln!(
        text,
        "{:10} {:>9} {:>9} {:>9} {:>9} {:>9}  {:>5} {:>5} {:>5} {:>5}  {:>5}  model",
        "source", "zenith", "centre", "least", "median", "most", BANDS[0], BANDS[1], BANDS[2], BANDS[3], "unc"
    );
    let number = |v: f64| match v {
        v if !v.is_finite() => "-".into(),
        v if v == 0.0 || v.abs() >= 1e-3 => format!("{v:.4}"),
        v => format!("{v:.2e}"),
    };
    let mag = |v: f64| if v.is_finite() { format!("{v:.2}") } else { "-".into() };
    for r in rows {
        let [least, median, most] = r.range.map(number);
        let [b, v, red, i] = r.bands.map(mag);
        let uncertainty = if r.uncertainty > 0.0 { format!("{:.0} %", 100.0 * r.uncertainty) } else { "-".into() };
        let (zenith, centre) = (number(r.zenith), number(r.centre));
        let _ = writeln!(
            text,
            "{:10} {zenith:>9} {centre:>9} {least:>9} {median:>9} {most:>9}  {b:>5} {v:>5} {red:>5} {i:>5}  {uncertainty:>5}  {}",
            r.name, r.why
        );
    }
    // where a source is unknown, so is the sum
    let sum = |value: &dyn Fn(&BudgetRow) -> f64| rows.iter().map(value).sum::<f64>();
    let [b, v, red, i] = sky::total_bands(rows).map(mag);
    let (zenith, centre) = (number(sum(&|r| r.zenith)), number(sum(&|r| r.centre)));
    let _ = writeln!(text, "{:10} {zenith:>9} {centre:>9} {:29}  {b:>5} {v:>5} {red:>5} {i:>5}", "all", "");
    let [outside, in_air] = integrals;
    let _ = writeln!(text, "\n{:40} {:>12} {:>12}", "", "outside air", "1 airmass");
    for (name, a, b) in [
        ("SINT, e- m^2/J of sunlight", outside.sint, in_air.sint),
        ("BINT, e-/s of a solar star of V = 0", outside.bint, in_air.bint),
        ("AINT, e-/s/sr of the zenith's airglow", outside.aint, in_air.aint),
    ] {
        let _ = writeln!(text, "{name:40} {a:>12.4e} {b:>12.4e}");
    }
    for z in zero_points {
        let name = format!("V of 1 e-/s, {}", z.spectrum);
        let _ = writeln!(text, "{name:40} {:>12.4} {:>12.4}", z.mag_v[0], z.mag_v[1]);
    }
    text
}
