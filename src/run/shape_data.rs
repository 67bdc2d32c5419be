//! What light curves in files are to an inversion: normalised irradiance with errors, directions to Sun and observer in body axes, and
//! what the faces are made of.
//!
//! A magnitude V at range r is the normalised irradiance `r^2 10^(-0.4 (V - V_sun))` \[m^2/sr\], V_sun = -26.76 that of the Sun at 1 au,
//! times the square of the Sun's distance in au: what the object would send from 1 au. Attitude and material are those of the scene's
//! `[inversion]`, else its target's, else those that the file's metadata tell, else body axes along the ICRS' and Lambert's law.
//!
//! Curves known up to a factor keep it free, each its own. Where no error is told it is 1e-4 of the mean for a computed curve, and for any
//! other the scatter of neighbouring points: second differences have the variance 6 sigma^2 (von Neumann et al. 1941, Ann. Math. Stat. 12, 153).

use super::RunError;
use crate::astro::bodies::sun_from;
use crate::astro::rotation::Quaternion;
use crate::astro::time::Instant;
use crate::base::constants::AU_M;
use crate::inversion::egi::{Curve, Scale};
use crate::inversion::tumble::Motion;
use crate::io::curve_file::{Curve as Told, CurveFile, Row};
use crate::object::matter::Material;
use crate::photometry::flag;
use crate::plan::planner::Planner;
use crate::scene::{Attitude, Brightness, Law, Options, Scene, Turning, load_str};
use crate::simulate::SimulateError;
use glam::DVec3;
use serde_json::Value as Json;
use std::f64::consts::LN_10;

/// V magnitude of the Sun at 1 au.
const V_SUN: f64 = -26.76;
/// Points with one of these flags tell nothing of a shape.
const SPOILT: u32 = flag::SATURATED | flag::BLOOMED | flag::EDGE | flag::TRAIL_CROSSING | flag::BAD_PIXEL;
/// Errors are no less than this share of the mean: a computed curve has none, and its light is as exact.
const EXACT: f64 = 1e-4;
/// Speed of light \[km/s\].
const LIGHT_KM_S: f64 = 299_792.458;
/// Standard deviation over the median of absolute values, of a normal distribution.
const MEDIAN: f64 = 1.4826;

/// What is taken for known.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// What the faces are made of.
    pub brdf: Law,
    /// How the object turns.
    pub attitude: Turning,
    /// Least and greatest sidereal period of a search for the pole \[s\]; none: about those that the scene and the light tell. Of a search for
    /// a tumble, least and greatest time of a turn about the angular momentum; none: near the tumble that is told.
    pub period_s: Option<(f64, f64)>,
}

impl Choice {
    /// What a scene's `[inversion]` chooses; as the target is said to be without one.
    pub fn of(scene: Option<&Scene>) -> Self {
        let own = scene.map(|s| (s.inversion.brdf.clone(), s.inversion.attitude.clone()));
        let (brdf, attitude) = own.unwrap_or((Law::AsTarget, Turning::AsTarget));
        Self { brdf, attitude, period_s: None }
    }
}

/// A search for how the object turns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Search {
    /// For pole and period.
    Pole {
        /// Least and greatest period \[s\], where given.
        range_s: Option<(f64, f64)>,
        /// The period that the scene tells \[s\].
        told_s: Option<f64>,
    },
    /// For a motion without torque.
    Tumble {
        /// Least and greatest time of a turn about the angular momentum \[s\], where given.
        range_s: Option<(f64, f64)>,
        /// The motion that the scene tells, at the time 0 of the data.
        told: Option<Motion>,
    },
}

/// Points left out, by reason.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct LeftOut {
    /// For their flags.
    pub flagged: usize,
    /// Without brightness, or without an error, zero point, range or direction that others have.
    pub gaps: usize,
    /// Exactly dark: in the Earth's shadow, or no side lit and seen.
    pub dark: usize,
}

/// Curves ready to invert.
#[derive(Debug, Clone)]
pub struct Data {
    /// The first point of all: time 0.
    pub start: Instant,
    /// Time since then, of each curve \[s\]; when the light left the object.
    pub time_s: Vec<Vec<f64>>,
    /// The curves, in body axes, or in ICRS axes where it is sought how these turn: normalised irradiance \[m^2/sr\] where the level is known.
    pub curves: Vec<Curve>,
    /// Their names.
    pub names: Vec<String>,
    /// What the faces are made of, or, where it is sought, where its search begins.
    pub material: Material,
    /// Whether the material is sought too.
    pub fits_material: bool,
    /// How it is sought how the object turns; none where the attitude is known.
    pub search: Option<Search>,
    /// Whether areas are in m^2.
    pub absolute: bool,
    /// Whether all curves are computed ones, whose errors are but a floor.
    pub computed: bool,
    /// Points left out.
    pub left_out: LeftOut,
    /// Where attitude and material come from, in words.
    pub told: Vec<String>,
}

impl LeftOut {
    /// Their number.
    pub fn points(&self) -> usize {
        self.flagged + self.gaps + self.dark
    }
}

impl Data {
    /// Number of points.
    pub fn points(&self) -> usize {
        self.curves.iter().map(|c| c.y.len()).sum()
    }
}

/// The curve number `curve` of a file, with what `scene` chooses.
///
/// # Errors
/// As of [`all`].
pub fn data(file: &CurveFile, curve: usize, scene: Option<&Scene>) -> Result<Data, RunError> {
    all(&[(file, curve)], scene, &Choice::of(scene))
}

/// Curves by their file and number in it, of one object; a scene's target of the same name, else its first, tells attitude and material.
///
/// # Errors
/// [`RunError::Usage`] for a curve without directions, an attitude that needs a scene, or materials that cannot be.
pub fn all(light: &[(&CurveFile, usize)], scene: Option<&Scene>, choice: &Choice) -> Result<Data, RunError> {
    let usage = |text: String| RunError::Usage(text);
    let mut curves = Vec::new();
    let mut left_out = LeftOut::default();
    for &(file, number) in light {
        let known = file.curves.get(number).ok_or_else(|| usage(format!("no curve {number}")))?;
        let rows = usable(file, known, number, &mut left_out);
        if rows.is_empty() {
            let why = told_left_out(&left_out).unwrap_or_else(|| "it is empty".into());
            return Err(usage(format!("{}: no usable point: {why}", known.name)));
        }
        if let Some(row) = rows.iter().find(|r| !(r.sun.is_finite() && r.obs.is_finite())) {
            return Err(usage(format!(
                "{}, {} UTC: the directions to Sun and observer are not known; measure with --scene",
                known.name,
                row.time.iso_utc()
            )));
        }
        curves.push((file, known, rows));
    }
    let Some((file, known, rows)) = curves.first() else { return Err(usage("no light curve".into())) };
    let start = curves.iter().flat_map(|(.., rows)| rows).map(|r| r.time).min().unwrap_or(rows[0].time);
    let mut told = Vec::new();
    let mut own = match scene {
        Some(scene) => Some(scene.clone()),
        None => stand_in(file, &known.name, &rows[0].time, matches!(choice.attitude, Turning::Given(_)))?,
    };
    let from = if scene.is_some() { "the scene" } else { "the curve's metadata" };
    let target = own
        .as_ref()
        .and_then(|s| s.target.iter().position(|t| t.name == known.name).or((!s.target.is_empty()).then_some(0)));
    let attitude = own.as_ref().zip(target).and_then(|(s, k)| s.target[k].attitude.as_ref());
    let search = sought(choice, attitude, &start);
    let mut from_attitude = from;
    if let (Turning::Given(attitude), Some(scene), Some(k)) = (&choice.attitude, own.as_mut(), target) {
        scene.target[k].attitude = Some((**attitude).clone());
        from_attitude = "inversion.attitude";
    }
    let turned = target.zip(own.as_ref()).filter(|(k, s)| search.is_none() && s.target[*k].attitude.is_some());
    told.push(match (search, turned) {
        (Some(Search::Pole { .. }), _) => "attitude: sought, uniform rotation about a fixed pole".into(),
        (Some(Search::Tumble { .. }), _) => "attitude: sought, a body without torque; EXPERIMENTAL".into(),
        (None, Some(_)) => format!("attitude: from {from_attitude}"),
        (None, None) => "attitude: not told; body axes are taken to be the ICRS'".to_owned(),
    });
    let material = match &choice.brdf {
        Law::Given(keys) => {
            let material = keys.material().map_err(|why| usage(format!("inversion.brdf: {why}")))?;
            told.push(format!("material: {} from inversion.brdf", material.model.name()));
            material
        }
        _ => material(own.as_ref(), target, from, &mut told),
    };
    let fits_material = choice.brdf == Law::Fit;
    let absolute = curves.iter().any(|(_, known, rows)| known.calibrated && !known.reduced && is_ranged(rows));
    let mut data = Data {
        start,
        time_s: Vec::new(),
        curves: Vec::new(),
        names: Vec::new(),
        material,
        fits_material,
        search,
        absolute,
        computed: light.iter().all(|(file, _)| is_computed(file)),
        left_out,
        told,
    };
    for (file, known, rows) in &curves {
        let directions = match turned {
            Some((target, scene)) => in_body_axes(rows, scene, target, known.reduced)?,
            None => rows.iter().map(|r| (r.sun, r.obs)).collect(),
        };
        // reduced intensities agree with each other, but their unit is the file's own
        let calibrated = known.calibrated && if known.reduced { !absolute } else { is_ranged(rows) };
        let level = |r: &Row| if known.reduced { 1.0 } else { irradiance(r) };
        let y = rows.iter().map(|r| r.flux * level(r)).collect::<Vec<_>>();
        let errors = rows.iter().map(|r| error(r) * level(r)).collect::<Vec<_>>();
        let computed = is_computed(file);
        if !computed && y.len() < 3 && !errors.iter().any(|e| *e > 0.0) {
            data.told.push(format!("{}: left out: errors not told, and too few points to see them", known.name));
            data.left_out.gaps += y.len();
            continue;
        }
        let sigma = with_floor(&y, errors, computed, &known.name, &mut data.told);
        let scale = if calibrated { Scale::Fixed(1.0) } else { Scale::Free };
        let light_time_s = |r: &Row| if known.reduced { 0.0 } else { light_time_s(r) };
        data.time_s.push(rows.iter().map(|r| r.time.since(&start) - light_time_s(r)).collect());
        data.curves.push(Curve { y, sigma, directions, scale });
        data.names.push(known.name.clone());
    }
    if data.curves.is_empty() {
        return Err(usage(data.told.pop().unwrap_or_else(|| "no light curve".into())));
    }
    let free = data.curves.iter().filter(|c| c.scale == Scale::Free).count();
    if free > 0 {
        let of = if data.curves.len() > 1 {
            format!(" of {free} of {} curves", data.curves.len())
        } else {
            String::new()
        };
        data.told.push(format!("level{of}: not known, a free factor each"));
    }
    if !data.absolute {
        data.told.push("areas are relative".into());
    }
    if let Some(other) = curves.iter().map(|(_, k, _)| k).find(|k| !k.session && k.name != known.name) {
        data.told.push(format!("warning: {} and {} are taken for one object", known.name, other.name));
    }
    Ok(data)
}

/// What of the rotation is sought, of a target that is told to turn so.
fn sought(choice: &Choice, attitude: Option<&Attitude>, start: &Instant) -> Option<Search> {
    let range_s = choice.period_s;
    match (&choice.attitude, attitude) {
        (Turning::ScanPole, Some(Attitude::Spin { period_s, .. })) => {
            Some(Search::Pole { range_s, told_s: Some(*period_s) })
        }
        (Turning::ScanPole, _) => Some(Search::Pole { range_s, told_s: None }),
        (Turning::ScanTumble, Some(Attitude::Tumble { quaternion, inertia_kg_m2, rate_deg_s, epoch })) => {
            let told = Quaternion::new(*quaternion).and_then(|attitude| {
                let rate = DVec3::from_array(rate_deg_s.map(f64::to_radians));
                let inertia = DVec3::from_array(*inertia_kg_m2);
                Motion { attitude: attitude.0, rate, inertia }.after(start.since(&epoch.instant))
            });
            Some(Search::Tumble { range_s, told })
        }
        (Turning::ScanTumble, _) => Some(Search::Tumble { range_s, told: None }),
        _ => None,
    }
}

/// The points of a curve that may tell of a shape; the others are counted.
fn usable<'a>(file: &'a CurveFile, known: &Told, curve: usize, left_out: &mut LeftOut) -> Vec<&'a Row> {
    let all = file.rows.iter().filter(|r| r.curve == curve).collect::<Vec<_>>();
    // what some points have the others lack
    let has_error = |r: &Row| error(r) > 0.0 && error(r).is_finite();
    let has_range = |r: &Row| r.range_km > 0.0 && r.range_km.is_finite();
    let has_zero_point = |r: &Row| r.zeropoint_mag.is_finite();
    let has_directions = |r: &Row| r.sun.is_finite() && r.obs.is_finite();
    let some = |has: &dyn Fn(&Row) -> bool| all.iter().any(|r| has(r));
    let (errors, directions) = (!is_computed(file) && some(&has_error), some(&has_directions));
    let (ranges, zero_points) = (!known.reduced && some(&has_range), !known.reduced && some(&has_zero_point));
    let lacks = |r: &Row| {
        !r.flux.is_finite()
            || errors && r.flux != 0.0 && !has_error(r)
            || ranges && !has_range(r)
            || zero_points && !has_zero_point(r)
            || directions && !has_directions(r)
    };
    let mut kept = Vec::new();
    for row in &all {
        if row.flags & SPOILT != 0 {
            left_out.flagged += 1;
        } else if lacks(row) {
            left_out.gaps += 1;
        } else if row.flux == 0.0 {
            left_out.dark += 1;
        } else {
            kept.push(*row);
        }
    }
    kept
}

/// Whether the range of every point is known.
fn is_ranged(rows: &[&Row]) -> bool {
    rows.iter().all(|r| r.range_km > 0.0)
}

/// Points left out, in words; none if there are none.
pub fn told_left_out(left_out: &LeftOut) -> Option<String> {
    let all = [
        (left_out.flagged, "for their flags"),
        (left_out.gaps, "without brightness, error, zero point, range or direction"),
        (left_out.dark, "exactly dark (in the Earth's shadow, or no side lit and seen)"),
    ];
    let words = all.iter().filter(|(count, _)| *count > 0).map(|(count, why)| format!("{count} {why}"));
    let words = words.collect::<Vec<_>>();
    (!words.is_empty()).then(|| format!("points left out: {}", words.join(", ")))
}

/// Whether a file says that its curves are computed.
fn is_computed(file: &CurveFile) -> bool {
    file.meta.iter().any(|(key, value)| key == "origin" && value == "model")
}

/// Errors with their floor; of a curve without any, those of a computed one or the scatter of neighbours.
fn with_floor(y: &[f64], mut errors: Vec<f64>, computed: bool, name: &str, told: &mut Vec<String>) -> Vec<f64> {
    let floor = EXACT * y.iter().sum::<f64>().abs() / y.len().max(1) as f64;
    let floor = if floor > 0.0 { floor } else { EXACT * y.iter().map(|v| v.abs()).fold(1e-25, f64::max) };
    if !computed && !errors.iter().any(|e| *e > 0.0) {
        let scatter = scatter(y).max(floor);
        told.push(format!("{name}: errors not told; {scatter:.2e} from the scatter of neighbouring points"));
        errors.fill(scatter);
    }
    errors.iter().map(|e| e.max(floor)).collect()
}

/// Noise of a curve whose neighbouring points are alike.
fn scatter(y: &[f64]) -> f64 {
    let mut second = y.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).abs()).collect::<Vec<_>>();
    second.sort_by(f64::total_cmp);
    MEDIAN * second.get(second.len() / 2).copied().unwrap_or(0.0) / 6f64.sqrt()
}

fn light_time_s(row: &Row) -> f64 {
    if row.range_km.is_finite() { row.range_km / LIGHT_KM_S } else { 0.0 }
}

/// Standard error of a point in its flux's unit: the magnitude's, which has the zero point's and scintillation's share besides the flux's own;
/// the flux's own where there is no magnitude.
fn error(row: &Row) -> f64 {
    let of_magnitude = row.flux.abs() * row.mag_err * (LN_10 / 2.5);
    if of_magnitude > 0.0 && of_magnitude.is_finite() { of_magnitude } else { row.flux_err }
}

/// Normalised irradiance of unit flux \[m^2/sr\], in a unit of its own where zero point or range are not known.
fn irradiance(row: &Row) -> f64 {
    let range_m = if row.range_km > 0.0 { row.range_km * 1e3 } else { 1.0 };
    let zero_point = if row.zeropoint_mag.is_finite() { row.zeropoint_mag } else { V_SUN };
    // seen from the Earth's centre: the station's place there changes the Sun's distance by less than 5e-5
    let place = if row.range_km.is_finite() { -row.obs * row.range_km * 1e3 } else { DVec3::ZERO };
    let sun_au = sun_from(&row.time, place).length() / AU_M;
    10f64.powf(-0.4 * (zero_point - V_SUN)) * range_m * range_m * sun_au * sun_au
}

/// Directions as the body sees them, when the light left it.
fn in_body_axes(
    rows: &[&Row],
    scene: &Scene,
    target: usize,
    reduced: bool,
) -> Result<Vec<(DVec3, DVec3)>, RunError> {
    let planner = Planner::new(scene).map_err(SimulateError::from)?;
    let one = |row: &&Row| {
        let light_time_s = if reduced { 0.0 } else { light_time_s(row) };
        let attitude = planner.attitude_at(target, &row.time, light_time_s).map_err(SimulateError::from)?;
        let turned = |v: DVec3| attitude.as_ref().map_or(v, |q| q.to_body(v));
        Ok((turned(row.sun), turned(row.obs)))
    };
    rows.iter().map(one).collect()
}

/// A scene of one object that has the attitude and the material of the file's metadata; none if they tell neither, unless `always`.
fn stand_in(file: &CurveFile, name: &str, start: &Instant, always: bool) -> Result<Option<Scene>, RunError> {
    let of = |key: &str| -> Option<Json> {
        let text = file.meta.iter().find(|(k, _)| k == key).map(|(_, v)| v)?;
        serde_json::from_str::<Json>(text).ok()?.get(name).cloned()
    };
    let (attitude, brdf) = (of("attitude"), of("brdf"));
    if attitude.is_none() && brdf.is_none() && !always {
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
            told.push(format!("material: {} from {from}", first.model.name()));
            if several {
                let groups = painted.len();
                told.push(format!(
                    "warning: the target has {groups} groups of faces that differ, but a shape is found with one law: that of {group}; \
                     areas of the others are off by the ratio of their albedos, and glints by more; [inversion] brdf sets another"
                ));
            }
            (*first).clone()
        }
        None => Material::lambert(1.0),
    }
}

#[cfg(test)]
#[path = "shape_data_tests.rs"]
mod tests;
