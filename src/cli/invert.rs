//! `nightglass invert`.

use super::args::{Global, InvertArgs};
use super::talk::{Failure, Talk, give, load, print, print_json};
use crate::inversion::nonconvex::Triangle;
use crate::inversion::nonconvex::metrics::bulk;
use crate::io::curve_file::{self, CurveFile};
use crate::io::shape_file;
use crate::object::surface;
use crate::object::surface::mesh::Mesh;
use crate::run::invert::{Found, InvertError, Model, invert as solve};
use crate::run::shape_data::{Choice, Data, all};
use crate::run::shape_outcome;
use crate::scene::{Brightness, Law, Scene, Turning};
use crate::study::fit_picture::{FitPoint, fit};
use crate::study::pole_picture::poles;
use crate::study::shape_picture::three_sides;
use crate::study::sphere_picture::{self, Arrow};
use serde_json::{Value as Json, json};
use std::path::Path;

pub(super) fn invert(args: &InvertArgs, global: &Global, talk: &Talk) -> Result<(), Failure> {
    for (k, path) in args.lightcurves.iter().enumerate() {
        let place = |path: &Path| path.canonicalize().unwrap_or_else(|_| path.to_owned());
        if args.lightcurves[..k].iter().any(|other| place(other) == place(path)) {
            return Err(Failure::Input(format!("{}: given twice: its points would count twice", path.display())));
        }
    }
    let files = args.lightcurves.iter().map(|path| {
        let name = path.display().to_string();
        let text = std::fs::read_to_string(path).map_err(|e| Failure::Input(format!("{name}: {e}")))?;
        let file = curve_file::read(&name, &text).map_err(|e| Failure::Input(e.to_string()))?;
        Ok::<_, Failure>((name, file))
    });
    let files = files.collect::<Result<Vec<_>, _>>()?;
    let scene = args.scene.as_deref().map(|s| load(s, global)).transpose()?;
    let mut light = Vec::new();
    for (name, file) in &files {
        light.extend(chosen(name, file, args.target.as_deref())?.into_iter().map(|curve| (file, curve)));
    }
    let Some((file, curve)) = light.first() else { return Err(Failure::Input("no light curve".into())) };
    let target = file.curves[*curve].name.clone();
    let own = scene.as_ref().map(|s| (s.inversion.model.as_str(), s.inversion.held_out));
    let (asked, held_out) = own.unwrap_or(("auto", 0.2));
    let asked = model(args.model.as_deref().unwrap_or(asked))?;
    let held_out = args.held_out.unwrap_or(held_out);
    if !(0.0..=0.9).contains(&held_out) {
        return Err(Failure::Input(format!("--held-out {held_out}: must be a share from 0 to 0.9")));
    }
    let data = all(&light, scene.as_ref(), &choice(args, scene.as_ref())?)?;
    let named = args.truth.as_deref().or(scene.as_ref().and_then(|s| s.inversion.truth.as_deref()));
    let truth = truth(named, scene.as_ref(), &target)?;
    let outcome = outcome(&data, asked, held_out, &truth, &target, talk);
    let outcome = outcome.map_err(|e| Failure::Input(format!("{}: {e}", files[0].0)))?;
    if let Some(dir) = &global.output {
        outcome.files.iter().try_for_each(|(name, text)| give(dir, name, text, global, talk))?;
    }
    match (global.json, &global.output) {
        (true, _) => print_json(&json!({ "command": "invert", "rows": [outcome.told] })),
        (false, None) => print(&pretty(&outcome.told)),
        (false, Some(_)) => Ok(()),
    }
}

/// The curves of a file that are inverted: the target's, else its only one, or all where each is a session of one object.
fn chosen(name: &str, file: &CurveFile, target: Option<&str>) -> Result<Vec<usize>, Failure> {
    let numbers = 0..file.curves.len();
    let own = match target {
        Some(wanted) => numbers.filter(|k| file.curves[*k].name == wanted).collect::<Vec<_>>(),
        None if file.curves.len() == 1 || file.curves.iter().all(|c| c.session) => numbers.collect(),
        None => Vec::new(),
    };
    if file.curves.is_empty() {
        return Err(Failure::Input(format!("{name} holds no point of a light curve")));
    }
    if own.is_empty() {
        let names = file.curves.iter().map(|c| c.name.as_str()).collect::<Vec<_>>().join(", ");
        return Err(Failure::Input(format!("{name} holds the light curves {names}; --target chooses one")));
    }
    Ok(own)
}

/// What the command line chooses, else the scene.
fn choice(args: &InvertArgs, scene: Option<&Scene>) -> Result<Choice, Failure> {
    let mut choice = Choice::of(scene);
    match args.brdf.as_deref() {
        Some("fit") => choice.brdf = Law::Fit,
        Some(_) => choice.brdf = Law::AsTarget,
        None => {}
    }
    match args.attitude.as_deref() {
        Some("scan-pole") => choice.attitude = Turning::ScanPole,
        Some("scan-tumble") => choice.attitude = Turning::ScanTumble,
        Some(_) => choice.attitude = Turning::AsTarget,
        None => {}
    }
    if let Some(text) = &args.period {
        let ends =
            text.split_once("..").map(|(low, high)| (low.trim().parse::<f64>(), high.trim().parse::<f64>()));
        match ends {
            Some((Ok(low), Ok(high))) if low > 0.0 && low <= high && high.is_finite() => {
                choice.period_s = Some((low, high));
            }
            _ => {
                return Err(Failure::Input(format!(
                    "--period {text}: must be A..B, two periods in seconds with 0 < A <= B"
                )));
            }
        }
        if !matches!(choice.attitude, Turning::ScanPole | Turning::ScanTumble) {
            return Err(Failure::Input(
                "--period is of the search for a rotation: add --attitude scan-pole or scan-tumble".into(),
            ));
        }
    }
    Ok(choice)
}

/// What is told and written of a shape.
pub(super) struct Outcome {
    /// The object of `shape.json`.
    pub told: Json,
    /// Names and texts of its files.
    pub files: Vec<(&'static str, String)>,
}

/// The bodies that a word of `inversion.model` or `--model` lets be tried.
pub(super) fn model(word: &str) -> Result<Model, Failure> {
    let known = || Model::NAMES.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
    Model::from_name(word).ok_or_else(|| Failure::Input(format!("model {word:?}: must be one of {}", known())))
}

/// The shape behind the light of `target`, told on the way.
pub(super) fn outcome(
    data: &Data,
    asked: Model,
    held_out: f64,
    truth: &[Vec<Triangle>],
    target: &str,
    talk: &Talk,
) -> Result<Outcome, InvertError> {
    let bar = talk.bar(1, "inversion");
    let found = solve(data, asked, held_out)?;
    bar.finish_and_clear();
    let errors = shape_outcome::errors(&found, data, truth);
    shape_outcome::summary(&found, data, errors.as_ref()).iter().for_each(|line| talk.say(line));
    let told = shape_outcome::json(&found, data, errors.as_ref());
    let mut files = Vec::new();
    if let Some(body) = shape_outcome::body(&found, data) {
        let (obj, mtl) = shape_file::obj(&body);
        files.extend([("shape.obj", obj), ("shape.mtl", mtl), ("shape.svg", three_sides(&body, target))]);
    }
    let (fit, image) = (fit(&points(&found, data), target), image(&found, data, target));
    files.extend([("shape.json", pretty(&told)), ("fit.svg", fit), ("image.svg", image)]);
    if let Some(rotation) = &found.rotation {
        let minima = rotation.found.minima.iter().map(|m| (m.pole, m.criterion)).collect::<Vec<_>>();
        files.push(("pole.svg", poles(&rotation.found.map, &minima, target)));
    }
    Ok(Outcome { told, files })
}

fn pretty(told: &Json) -> String {
    serde_json::to_string_pretty(told).unwrap_or_default() + "\n"
}

/// Triangles of the true shape: a mesh file's, else those of the scene's target.
pub(super) fn truth(
    path: Option<&Path>,
    scene: Option<&Scene>,
    target: &str,
) -> Result<Vec<Vec<Triangle>>, Failure> {
    if let Some(path) = path {
        let read = surface::files::read(path).map_err(|e| Failure::Input(e.to_string()))?;
        let parts = shape_outcome::components(&read.mesh);
        let volume = bulk(&parts, 4096).volume;
        if volume.is_nan() || volume <= 0.0 {
            let why = "encloses no volume: a truth is one closed surface or several";
            return Err(Failure::Input(format!("{}: {why}", path.display())));
        }
        return Ok(parts);
    }
    let own = scene.and_then(|s| s.target.iter().find(|t| t.name == target));
    Ok(match own.map(|t| &t.brightness) {
        Some(Brightness::Shape(shaped)) => {
            let body = &shaped.built.body;
            shape_outcome::components(&Mesh::plain(body.vertices.clone(), body.faces.iter().copied()))
        }
        _ => Vec::new(),
    })
}

fn points(found: &Found, data: &Data) -> Vec<FitPoint> {
    let mut points = Vec::new();
    for (number, (curve, times)) in data.curves.iter().zip(&data.time_s).enumerate() {
        for ((time_s, y), sigma) in times.iter().zip(&curve.y).zip(&curve.sigma) {
            let i = points.len();
            points.push(FitPoint {
                time_s: *time_s,
                flux: *y,
                sigma: *sigma,
                model: found.model.get(i).copied().unwrap_or(f64::NAN),
                held_out: found.held_out.get(i) == Some(&true),
                curve: number,
            });
        }
    }
    points
}

/// The extended Gaussian image.
fn image(found: &Found, data: &Data, title: &str) -> String {
    let convex = &found.convex;
    let arrow = |e: &crate::inversion::egi::Estimate| Arrow::round(e.facet, e.direction_sd, e.claimed);
    let image = sphere_picture::Image {
        facets: convex.facets.iter().map(arrow).collect(),
        truth: Vec::new(),
        grid: convex.map.iter().map(|d| (d.normal, d.observed)).collect(),
        relative: shape_outcome::is_relative(found, data),
    };
    sphere_picture::image(&image, title)
}
