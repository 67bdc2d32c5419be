//! `nightglass invert`.

use super::args::{Global, InvertArgs};
use super::talk::{Failure, Talk, give, load, print, print_json};
use crate::inversion::nonconvex::Triangle;
use crate::io::{curve_file, shape_file};
use crate::object::surface;
use crate::run::invert::{Found, Model, invert as solve};
use crate::run::shape_data::{Data, data};
use crate::run::shape_outcome;
use crate::scene::{Brightness, Scene};
use crate::study::fit_picture::{FitPoint, fit};
use crate::study::shape_picture::three_sides;
use crate::study::sphere_picture::{self, Arrow};
use serde_json::json;
use std::path::Path;

pub(super) fn invert(args: &InvertArgs, global: &Global, talk: &Talk) -> Result<(), Failure> {
    let name = args.lightcurve.display().to_string();
    let text = std::fs::read_to_string(&args.lightcurve).map_err(|e| Failure::Input(format!("{name}: {e}")))?;
    let file = curve_file::read(&name, &text).map_err(|e| Failure::Input(e.to_string()))?;
    let scene = args.scene.as_deref().map(|s| load(s, global)).transpose()?;
    let curve = match &args.target {
        Some(wanted) => file.curves.iter().position(|c| c.name == *wanted),
        None => (file.curves.len() == 1).then_some(0),
    };
    let Some(curve) = curve else {
        let names = file.curves.iter().map(|c| c.name.as_str()).collect::<Vec<_>>().join(", ");
        return Err(Failure::Input(format!("{name} holds the light curves {names}; --target chooses one")));
    };
    let target = file.curves[curve].name.clone();
    let own = scene.as_ref().map(|s| (s.inversion.model.as_str(), s.inversion.held_out));
    let (asked, held_out) = own.unwrap_or(("auto", 0.2));
    let asked = match args.model.as_deref().unwrap_or(asked) {
        "auto" => Model::Auto,
        "convex" => Model::Convex,
        "nonconvex" => Model::Nonconvex,
        other => {
            return Err(Failure::Input(format!(
                "model {other:?}: `invert` has auto, convex, nonconvex; the older methods are compared by the example minkowski_table"
            )));
        }
    };
    let data = data(&file, curve, scene.as_ref())?;
    let bar = talk.bar(1, "inversion");
    let found = solve(&data, asked, held_out).map_err(|e| Failure::Input(format!("{name}: {e}")))?;
    bar.finish_and_clear();
    let truth = truth(args.truth.as_deref(), scene.as_ref(), &target)?;
    let errors = shape_outcome::errors(&found, &truth);
    shape_outcome::summary(&found, &data, asked, errors.as_ref()).iter().for_each(|line| talk.say(line));
    let told = shape_outcome::json(&found, &data, errors.as_ref());
    let pretty = serde_json::to_string_pretty(&told).unwrap_or_default() + "\n";
    if let Some(dir) = &global.output {
        if let Some(body) = shape_outcome::body(&found) {
            let (obj, mtl) = shape_file::obj(&body);
            give(dir, "shape.obj", &obj, global, talk)?;
            give(dir, "shape.mtl", &mtl, global, talk)?;
            give(dir, "shape.svg", &three_sides(&body, &target), global, talk)?;
        }
        give(dir, "shape.json", &pretty, global, talk)?;
        give(dir, "fit.svg", &fit(&points(&found, &data), &target), global, talk)?;
        give(dir, "image.svg", &image(&found, &target), global, talk)?;
    }
    match (global.json, &global.output) {
        (true, _) => print_json(&json!({ "command": "invert", "rows": [told] })),
        (false, None) => print(&pretty),
        (false, Some(_)) => Ok(()),
    }
}

/// Triangles of the true shape: a mesh file's, else those of the scene's target.
fn truth(path: Option<&Path>, scene: Option<&Scene>, target: &str) -> Result<Vec<Vec<Triangle>>, Failure> {
    if let Some(path) = path {
        let read = surface::files::read(path).map_err(|e| Failure::Input(e.to_string()))?;
        return Ok(vec![read.mesh.triangles().collect()]);
    }
    let own = scene.and_then(|s| s.target.iter().find(|t| t.name == target));
    Ok(match own.map(|t| &t.brightness) {
        Some(Brightness::Shape(shaped)) => {
            let body = &shaped.built.body;
            let corner = |c: u32| body.vertices.get(c as usize).copied().unwrap_or_default();
            vec![body.faces.iter().map(|face| face.map(corner)).collect()]
        }
        _ => Vec::new(),
    })
}

fn points(found: &Found, data: &Data) -> Vec<FitPoint> {
    let curve = &data.curve;
    let one = |(i, time_s): (usize, &f64)| FitPoint {
        time_s: *time_s,
        flux: curve.y[i],
        sigma: curve.sigma[i],
        model: found.model.get(i).copied().unwrap_or(f64::NAN),
        held_out: false,
        curve: 0,
    };
    data.time_s.iter().enumerate().map(one).collect()
}

/// The extended Gaussian image.
fn image(found: &Found, title: &str) -> String {
    let convex = &found.convex;
    let arrow = |e: &crate::inversion::egi::Estimate| Arrow::round(e.facet, e.direction_sd, e.claimed);
    let image = sphere_picture::Image {
        facets: convex.facets.iter().map(arrow).collect(),
        truth: Vec::new(),
        grid: convex.map.iter().map(|d| (d.normal, d.observed)).collect(),
        relative: !convex.calibrated,
    };
    sphere_picture::image(&image, title)
}
