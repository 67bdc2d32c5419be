//! What a light curve in a file is to an inversion: normalised irradiance with errors, directions to Sun and observer in body axes, and
//! what the faces are made of.
//!
//! A magnitude V at range r is the normalised irradiance `r^2 10^(-0.4 (V - V_sun))` \[m^2/sr\], V_sun = -26.76 that of the Sun at 1 au,
//! times the square of the Sun's distance in au: what the object would send from 1 au. Attitude and material are the scene's,
//! else those that the file's metadata tell, else body axes along the ICRS' and Lambert's law.

use super::RunError;
use crate::astro::bodies::sun_from;
use crate::astro::time::Instant;
use crate::base::constants::AU_M;
use crate::inversion::egi::{Curve, Scale};
use crate::io::curve_file::{CurveFile, Row};
use crate::object::matter::Material;
use crate::photometry::flag;
use crate::plan::planner::Planner;
use crate::scene::{Brightness, Options, Scene, load_str};
use crate::simulate::SimulateError;
use glam::DVec3;
use serde_json::Value as Json;

/// V magnitude of the Sun at 1 au.
const V_SUN: f64 = -26.76;
/// Points with one of these flags tell nothing of a shape.
const SPOILT: u32 = flag::SATURATED | flag::BLOOMED | flag::EDGE | flag::TRAIL_CROSSING | flag::BAD_PIXEL;
/// Errors are no less than this share of the mean: a computed curve has none, and its light is as exact.
const EXACT: f64 = 1e-4;
/// Speed of light \[km/s\].
const LIGHT_KM_S: f64 = 299_792.458;

/// A curve ready to invert.
#[derive(Debug, Clone)]
pub struct Data {
    /// Time since the first point \[s\].
    pub time_s: Vec<f64>,
    /// The curve: normalised irradiance \[m^2/sr\] if its level is known.
    pub curve: Curve,
    /// What the faces are made of.
    pub material: Material,
    /// Points left out for their flags.
    pub left_out: usize,
    /// Where attitude and material come from, in words.
    pub told: Vec<String>,
}

/// The curve number `curve` of a file; `scene` and the name of a target in it tell attitude and material.
///
/// # Errors
/// [`RunError::Usage`] for a curve without directions, an attitude that needs a scene, or a target that the scene does not have.
pub fn data(file: &CurveFile, curve: usize, scene: Option<&Scene>) -> Result<Data, RunError> {
    let usage = |text: String| RunError::Usage(text);
    let known = file.curves.get(curve).ok_or_else(|| usage(format!("no curve {curve}")))?;
    let all = file.rows.iter().filter(|r| r.curve == curve).collect::<Vec<_>>();
    let rows = all.iter().copied().filter(|r| r.flags & SPOILT == 0 && r.flux.is_finite()).collect::<Vec<_>>();
    let left_out = all.len() - rows.len();
    let Some(first) = rows.first() else { return Err(usage(format!("{}: no usable point", known.name))) };
    if let Some(row) = rows.iter().find(|r| !(r.sun.is_finite() && r.obs.is_finite())) {
        return Err(usage(format!(
            "{}, {} UTC: the directions to Sun and observer are not known; measure with --scene",
            known.name,
            row.time.iso_utc()
        )));
    }
    let mut told = Vec::new();
    let own = match scene {
        Some(scene) => Some(scene.clone()),
        None => stand_in(file, &known.name, &first.time)?,
    };
    let from = if scene.is_some() { "the scene" } else { "the curve's metadata" };
    let target = own
        .as_ref()
        .and_then(|s| s.target.iter().position(|t| t.name == known.name).or((!s.target.is_empty()).then_some(0)));
    let turned = target.zip(own.as_ref()).filter(|(k, s)| s.target[*k].attitude.is_some());
    let directions = match turned {
        Some((target, scene)) => {
            told.push(format!("attitude: from {from}"));
            in_body_axes(&rows, scene, target)?
        }
        None => {
            told.push("attitude: not told; body axes are taken to be the ICRS'".into());
            rows.iter().map(|r| (r.sun, r.obs)).collect()
        }
    };
    let material = material(own.as_ref(), target, from, &mut told);
    let calibrated = known.calibrated && rows.iter().all(|r| known.reduced || r.range_km > 0.0);
    let level = |r: &Row| if calibrated { irradiance(r, known.reduced) } else { 1.0 };
    let y = rows.iter().map(|r| r.flux * level(r)).collect::<Vec<_>>();
    let floor = EXACT * y.iter().sum::<f64>().abs() / y.len() as f64;
    let sigma = rows.iter().map(|r| (r.flux_err * level(r)).max(floor)).collect();
    if !calibrated {
        told.push("level: not known; areas are relative".into());
    }
    let scale = if calibrated { Scale::Fixed(1.0) } else { Scale::Free };
    let time_s = rows.iter().map(|r| r.time.since(&first.time)).collect();
    Ok(Data { time_s, curve: Curve { y, sigma, directions, scale }, material, left_out, told })
}

/// Normalised irradiance of unit flux \[m^2/sr\].
fn irradiance(row: &Row, reduced: bool) -> f64 {
    let range_m = if reduced { 1.0 } else { row.range_km * 1e3 };
    // seen from the Earth's centre: the station's place there changes the Sun's distance by less than 5e-5
    let place = if row.range_km.is_finite() { -row.obs * row.range_km * 1e3 } else { DVec3::ZERO };
    let sun_au = sun_from(&row.time, place).length() / AU_M;
    10f64.powf(-0.4 * (row.zeropoint_mag - V_SUN)) * range_m * range_m * sun_au * sun_au
}

/// Directions as the body sees them, when the light left it.
fn in_body_axes(rows: &[&Row], scene: &Scene, target: usize) -> Result<Vec<(DVec3, DVec3)>, RunError> {
    let planner = Planner::new(scene).map_err(SimulateError::from)?;
    let one = |row: &&Row| {
        let light_time_s = if row.range_km.is_finite() { row.range_km / LIGHT_KM_S } else { 0.0 };
        let attitude = planner.attitude_at(target, &row.time, light_time_s).map_err(SimulateError::from)?;
        let turned = |v: DVec3| attitude.as_ref().map_or(v, |q| q.to_body(v));
        Ok((turned(row.sun), turned(row.obs)))
    };
    rows.iter().map(one).collect()
}

/// A scene of one object that has the attitude and the material of the file's metadata; none if they tell neither.
fn stand_in(file: &CurveFile, name: &str, start: &Instant) -> Result<Option<Scene>, RunError> {
    let of = |key: &str| -> Option<Json> {
        let text = file.meta.iter().find(|(k, _)| k == key).map(|(_, v)| v)?;
        serde_json::from_str::<Json>(text).ok()?.get(name).cloned()
    };
    let (attitude, brdf) = (of("attitude"), of("brdf"));
    if attitude.is_none() && brdf.is_none() {
        return Ok(None);
    }
    let mut text = format!(
        "schema_version = 1\n[station]\npreset = \"pogs\"\n[exposures]\nstart = \"{}Z\"\nduration_s = 0.0\n[[target]]\nname = {name:?}\n\
         shape = \"box\"\n[target.orbit]\nfixed = {{ ra_deg = 0.0, dec_deg = 0.0, range_km = 1.0 }}\n",
        start.iso_utc()
    );
    let mut table = |key: &str, json: &Json| {
        if let Ok(toml::Value::Table(t)) = toml::Value::try_from(json) {
            text.push_str(&format!("[target.{key}]\n{}\n", toml::to_string(&t).unwrap_or_default()));
        }
    };
    if let Some(attitude) = &attitude {
        table("attitude", attitude);
    }
    // one law for all faces: that of the first group
    if let Some(group) = brdf.as_ref().and_then(Json::as_object).and_then(|groups| groups.values().next()) {
        table("material", &of_its_law(group));
    }
    let scene = load_str(&text, "the light curve's metadata", None, &Options { sets: &[], seed: None });
    match scene {
        Ok(scene) => Ok(Some(scene)),
        Err(fault) => Err(RunError::Usage(format!("{fault}; --scene tells attitude and material in their place"))),
    }
}

/// A material's keys without those that its law has not.
fn of_its_law(json: &Json) -> Json {
    let law = json.get("brdf").and_then(Json::as_str).unwrap_or("lambert");
    let keys: &[&str] = match law {
        "lambert" => &["brdf", "diffuse"],
        "cook-torrance" => &["brdf", "diffuse", "specular", "roughness"],
        "oren-nayar" => &["brdf", "diffuse", "roughness"],
        "mirror" => &["brdf", "diffuse", "specular"],
        _ => &["brdf", "diffuse", "specular", "exponent"],
    };
    let object = json.as_object().into_iter().flatten();
    let kept = object.filter(|(k, v)| keys.contains(&k.as_str()) && !v.is_null());
    Json::Object(kept.map(|(k, v)| (k.clone(), v.clone())).collect())
}

/// The law of the scene's faces: the first group's, with a word where others differ.
fn material(scene: Option<&Scene>, target: Option<usize>, from: &str, told: &mut Vec<String>) -> Material {
    let brightness = scene.zip(target).and_then(|(s, k)| s.target.get(k)).map(|t| &t.brightness);
    let Some(Brightness::Shape(shaped)) = brightness else {
        told.push("material: not told; Lambert's law with an albedo of 1: areas are times albedo".into());
        return Material::lambert(1.0);
    };
    let painted = shaped.built.painted().collect::<Vec<_>>();
    match painted.first() {
        Some((group, _, first)) => {
            let several = painted.iter().any(|(_, _, m)| *m != *first);
            let of = if several {
                format!(", that of {group} for all faces, though others differ")
            } else {
                String::new()
            };
            told.push(format!("material: {} from {from}{of}", first.model.name()));
            (*first).clone()
        }
        None => Material::lambert(1.0),
    }
}
