//! `nightglass catalog`.

use super::args::{CatalogAction, Global, With};
use super::talk::{Failure, Talk, print, print_json};
use crate::io::atomic;
use crate::simulate::SimulateError;
use crate::stars::catalogue::Catalogue;
use crate::stars::import::from_astrometry_index;
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
            let bytes = from_astrometry_index(&args.file, &args.name).map_err(SimulateError::from)?;
            atomic::write(path, &bytes)?;
            talk.say(&format!("wrote {}, {:.1} MiB", path.display(), bytes.len() as f64 / 1_048_576.0));
            Ok(())
        }
        CatalogAction::Info(With { args, .. }) => {
            let catalogue = match &args.file {
                Some(path) => Catalogue::open(path).map_err(SimulateError::from)?,
                None => Catalogue::built_in(),
            };
            info(&catalogue, global)
        }
    }
}

fn info(catalogue: &Catalogue, global: &Global) -> Result<(), Failure> {
    let row = json!({
        "name": catalogue.name(), "stars": catalogue.len(), "epoch": catalogue.epoch(),
        "colours": catalogue.has_colour(), "proper_motions": catalogue.has_motion(), "bytes": catalogue.bytes(),
    });
    if global.json {
        return print_json(&json!({ "command": "catalog info", "rows": [row] }));
    }
    let known = |yes: bool| if yes { "yes" } else { "no" };
    print(&format!(
        "{}: {} stars, places of J{}, colours: {}, proper motions: {}, {:.1} MiB\n",
        catalogue.name(),
        catalogue.len(),
        catalogue.epoch(),
        known(catalogue.has_colour()),
        known(catalogue.has_motion()),
        catalogue.bytes() as f64 / 1_048_576.0,
    ))
}
