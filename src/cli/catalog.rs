//! `nightglass catalog`.

use super::args::{CatalogAction, Global, ImportArgs, With};
use super::talk::{Failure, Talk, print, print_json};
use crate::io::atomic;
use crate::stars::catalogue::Catalogue;
use crate::stars::columns::Choice;
use crate::stars::import::{Request, import};
use crate::stars::summary::{LATITUDES, Summary, summary};
use serde_json::json;

pub(super) fn catalog(action: &CatalogAction, global: &Global, talk: &Talk) -> Result<(), Failure> {
    match action {
        CatalogAction::Import(With { args, .. }) => {
            let Some(path) = &global.output else {
                return Err(Failure::Input("catalog import: say where to write it with -o FILE".into()));
            };
            if path.exists() && !global.force {
                return Err(Failure::Input(format!("{} exists; --force replaces it", path.display())));
            }
            let made = import(&request(args)).map_err(|e| Failure::Input(e.to_string()))?;
            made.notes.iter().for_each(|note| talk.say(note));
            atomic::write(path, &made.bytes)?;
            let size = made.bytes.len();
            talk.say(&format!("wrote {}, {:.1} MiB", path.display(), size as f64 / 1_048_576.0));
            if global.json {
                let row = json!({ "file": path.display().to_string(), "stars": made.stars, "epoch": made.epoch, "bytes": size });
                return print_json(&json!({ "command": "catalog import", "rows": [row], "notes": made.notes }));
            }
            Ok(())
        }
        CatalogAction::Info(With { args, .. }) => {
            let catalogue = match &args.file {
                Some(path) => Catalogue::open(path).map_err(|e| Failure::Input(e.to_string()))?,
                None => Catalogue::built_in(),
            };
            info(&catalogue, global)
        }
    }
}

fn request(args: &ImportArgs) -> Request {
    let both = |a: &Option<String>, b: &Option<String>| Some([a.clone()?, b.clone()?]);
    Request {
        file: args.file.clone(),
        name: args.name.clone(),
        choice: Choice {
            place: both(&args.ra, &args.dec),
            mag: args.mag.clone(),
            g: args.g.clone(),
            bp_rp: both(&args.bp, &args.rp),
            bv: args.bv.clone(),
            motion: both(&args.pmra, &args.pmdec),
        },
        epoch: args.epoch,
        complete_to: args.complete_to,
        supplement: args.supplement.clone(),
    }
}

fn info(catalogue: &Catalogue, global: &Global) -> Result<(), Failure> {
    let found = summary(catalogue);
    if global.json {
        return print_json(&json!({ "command": "catalog info", "rows": [row(catalogue, &found)] }));
    }
    print(&text(catalogue, &found))
}

/// Shares of stars whose colour, and whose motion is known.
fn shares(catalogue: &Catalogue) -> [f64; 2] {
    let of_all = |known: usize| known as f64 / (catalogue.len() as f64).max(1.0);
    [of_all(catalogue.colours()), of_all(catalogue.motions())]
}

fn row(catalogue: &Catalogue, found: &Summary) -> serde_json::Value {
    let [colours, motions] = shares(catalogue);
    let [least, median, most] = found.complete_to.map_or([None; 3], |c| c.map(Some));
    let zone = |k: usize| format!("per_deg2_b{}_{}", LATITUDES[k], LATITUDES[k + 1]);
    let bins = found.bins.iter().map(|bin| {
        let mut counts = json!({
            "from_mag_v": bin.from_mag_v, "to_mag_v": bin.from_mag_v + 1, "stars": bin.stars, "per_deg2": bin.per_deg2,
        });
        (0..3).for_each(|k| counts[zone(k)] = bin.per_deg2_b[k].into());
        counts
    });
    json!({
        "name": catalogue.name(), "stars": catalogue.len(), "epoch": catalogue.epoch(),
        "colours": catalogue.has_colour(), "proper_motions": catalogue.has_motion(), "bytes": catalogue.bytes(),
        "colour_share": colours, "proper_motion_share": motions,
        "complete_to_min_mag_v": least, "complete_to_median_mag_v": median, "complete_to_max_mag_v": most,
        "sky_share": found.covered, "counts": bins.collect::<Vec<_>>(),
    })
}

fn text(catalogue: &Catalogue, found: &Summary) -> String {
    let known = |yes: bool, share: f64| if yes { format!("{:.1} %", 100.0 * share) } else { "no".into() };
    let [colours, motions] = shares(catalogue);
    let mut text = format!(
        "{}: {} stars, places of J{}, colours: {}, proper motions: {}, {:.1} MiB\n",
        catalogue.name(),
        catalogue.len(),
        catalogue.epoch(),
        known(catalogue.has_colour(), colours),
        known(catalogue.has_motion(), motions),
        catalogue.bytes() as f64 / 1_048_576.0,
    );
    text += &found.complete_to.map_or("complete nowhere\n".into(), |[least, median, most]| {
        let share = 100.0 * found.covered;
        format!("complete to V = {least:.2} .. {most:.2}, median {median:.2}, over {share:.1} % of the sky\n")
    });
    if !found.bins.is_empty() {
        text += &format!("{:>9} {:>9} {:>10}   per square degree\n", "V", "stars", "");
        text += &format!("{:>9} {:>9} {:>10}", "", "", "whole sky");
        (0..3).for_each(|k| text += &format!(" {:>10}", format!("|b| {}-{}", LATITUDES[k], LATITUDES[k + 1])));
        text.push('\n');
    }
    for bin in &found.bins {
        let range = format!("{} .. {}", bin.from_mag_v, bin.from_mag_v + 1);
        text += &format!("{range:>9} {:>9} {:>10.4}", bin.stars, bin.per_deg2);
        bin.per_deg2_b.iter().for_each(|n| text += &format!(" {n:>10.4}"));
        text.push('\n');
    }
    text
}
