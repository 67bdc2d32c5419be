//! The last stage of `nightglass run`: the shapes behind the measured light curves.
//!
//! Each target that has a shape is inverted as `nightglass invert lightcurve.ecsv --scene scene.toml --target NAME` would do it. That of the
//! first is written to the directory itself; where there are several, each has a folder `shapes/NAME/` besides. Light that tells no shape is no
//! failure of the run: it is told why, and the light curve stays.

use super::invert::{Outcome, outcome, truth};
use super::talk::{Failure, Talk, clock};
use crate::io::curve_file::{self, CurveFile};
use crate::io::{atomic, ecsv::to_ecsv};
use crate::run::OutputDir;
use crate::run::invert::Model;
use crate::run::lightcurve::LightCurve;
use crate::run::shape_data::data;
use crate::scene::{Brightness, Scene};
use std::path::PathBuf;

/// Invert the targets' light curves; the names of the files written.
pub(super) fn shapes(
    scene: &Scene,
    model: Model,
    curve: &LightCurve,
    dir: &OutputDir,
    talk: &Talk,
) -> Result<Vec<String>, Failure> {
    dir.clear_shapes()?;
    let file = curve_file::read("lightcurve.ecsv", &to_ecsv(&curve.table));
    let file = file.map_err(|e| Failure::Failed(e.to_string()))?;
    let shaped = scene.target.iter().filter(|t| matches!(t.brightness, Brightness::Shape(_)));
    let names = shaped.map(|t| t.name.as_str()).collect::<Vec<_>>();
    if names.is_empty() {
        talk.say("warning: no shape sought: inversion.enabled asks for one, but no [[target]] has a `shape`; `nightglass invert` takes any light curve");
    }
    let mut written = Vec::new();
    for (number, name) in names.iter().enumerate() {
        let clock = clock();
        talk.say(&format!("{name}: shape from its light curve"));
        let outcome = match one(scene, model, &file, name, talk)? {
            Ok(outcome) => outcome,
            Err(why) => {
                talk.say(&format!("warning: {name}: no shape, the light curve stays: {why}"));
                continue;
            }
        };
        if outcome.files.iter().all(|(file, _)| *file != "shape.obj") {
            talk.say(&format!("warning: {name}: no body has these facets, so that there is no shape.obj; shape.json tells what is sure"));
        }
        talk.detail(&format!("{name}: inverted in {:.1} s", clock()));
        let first = (number == 0).then(PathBuf::new);
        let own = (names.len() > 1).then(|| PathBuf::from("shapes").join(folder(&names, number)));
        for place in first.into_iter().chain(own) {
            atomic::create_dir(&dir.path().join(&place))?;
            for (file, text) in &outcome.files {
                let file = place.join(file);
                atomic::write(&dir.path().join(&file), text.as_bytes())?;
                written.push(file.display().to_string());
            }
        }
    }
    Ok(written)
}

/// The shape of one target, or why its light tells none.
fn one(
    scene: &Scene,
    model: Model,
    file: &CurveFile,
    name: &str,
    talk: &Talk,
) -> Result<Result<Outcome, String>, Failure> {
    let Some(curve) = file.curves.iter().position(|c| c.name == name) else {
        return Ok(Err("it is on no frame".into()));
    };
    let data = match data(file, curve, Some(scene)) {
        Ok(data) => data,
        Err(why) => return Ok(Err(why.to_string())),
    };
    let truth = truth(scene.inversion.truth.as_deref(), Some(scene), name)?;
    let outcome = outcome(&data, model, scene.inversion.held_out, &truth, name, talk);
    Ok(outcome.map_err(|why| why.to_string()))
}

/// The name of a target's folder: its own, of characters that every file system takes, and its number where another target's is the same.
fn folder(names: &[&str], number: usize) -> String {
    let plain = |name: &str| {
        let taken = |c: char| if c.is_alphanumeric() || " +-_".contains(c) { c } else { '_' };
        name.trim().chars().map(taken).collect::<String>()
    };
    let own = plain(names[number]);
    let alike = |other: &&str| plain(other).eq_ignore_ascii_case(&own);
    if own.is_empty() || names.iter().filter(|n| alike(n)).count() > 1 { format!("{own}_{number}") } else { own }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_are_names_that_file_systems_take() {
        let names = ["GOES 14", "../a/b", "..", "A", "a", "Č-1"];
        let folders = (0..names.len()).map(|k| folder(&names, k)).collect::<Vec<_>>();
        assert_eq!(folders, ["GOES 14", "___a_b", "__", "A_3", "a_4", "Č-1"]);
    }
}
