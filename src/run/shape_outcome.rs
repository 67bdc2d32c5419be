//! What is written of a shape: the mesh with its uncertainty, `shape.json`, and the summary that a person reads.

use super::invert::{Found, Model};
use super::shape_data::Data;
use crate::inversion::egi::Verdict;
use crate::inversion::nonconvex::metrics::{aligned, bulk, distance, intersection_over_union};
use crate::inversion::nonconvex::{Call, Triangle};
use crate::io::shape_file::{Body, Face, Uncertainty};
use glam::DVec3;
use serde_json::{Value as Json, json};

/// Columns of quasi-random lines for volumes; the third dimension is exact.
const COLUMNS: usize = 1 << 20;
/// Columns by which bodies are laid over each other.
const ALIGNED: usize = 1 << 17;
/// Points on surfaces for distances.
const POINTS: usize = 4000;

/// How a shape differs from the true one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Errors {
    /// Volume of what both hold over that of what one holds.
    pub iou: f64,
    /// Largest distance of the surfaces over the diagonal.
    pub hausdorff: f64,
    /// Mean distance over the diagonal.
    pub chamfer: f64,
    /// Volume over the true one.
    pub volume_ratio: f64,
}

/// Against the true triangles, part by part, after laying one on the other without turning it; none without a shape.
pub fn errors(found: &Found, truth: &[Vec<Triangle>]) -> Option<Errors> {
    let own = found.triangles();
    let volume = |parts: &[Vec<Triangle>]| bulk(parts, COLUMNS).volume;
    if own.is_empty() || truth.is_empty() {
        return None;
    }
    let own = aligned(truth, &own, ALIGNED);
    let apart = distance(truth, &own, POINTS);
    Some(Errors {
        iou: intersection_over_union(truth, &own, COLUMNS),
        hausdorff: apart.hausdorff,
        chamfer: apart.chamfer,
        volume_ratio: volume(&own) / volume(truth),
    })
}

/// The mesh with what is known of each face; none if there is no body.
pub fn body(found: &Found) -> Option<Body> {
    let relative = !found.convex.calibrated;
    if let Some(assembly) = &found.assembly {
        let mesh = assembly.mesh();
        let uncertainty = |part: usize| {
            let estimate = &assembly.parts[part];
            let sizes = estimate.half_sd / estimate.part.half;
            let relative_area_sd = sizes.length();
            Uncertainty::Known { sd_deg: estimate.turn_sd.max_element().to_degrees(), relative_area_sd }
        };
        let face = |f: &crate::object::surface::mesh::Face| {
            let part = usize::from(f.group).min(assembly.parts.len().saturating_sub(1));
            Face { corners: f.corners.map(|c| c as usize).to_vec(), part, uncertainty: uncertainty(part) }
        };
        return Some(Body {
            vertices: mesh.vertices.clone(),
            faces: mesh.faces.iter().map(face).collect(),
            relative,
        });
    }
    let polytope = &found.body.as_ref().ok()?.polytope;
    let face = |(facet, normal): (usize, DVec3)| {
        let corners = polytope.corners_of(facet).into_iter().map(|c| c as usize).collect::<Vec<_>>();
        let uncertainty = match found.certainty(normal) {
            Some((sd, area)) => Uncertainty::Known { sd_deg: sd.to_degrees(), relative_area_sd: area },
            None if found.is_observed(normal) => Uncertainty::Unclaimed,
            None => Uncertainty::Unobserved,
        };
        Face { corners, part: 0, uncertainty }
    };
    let faces = polytope.normals().enumerate().map(face).filter(|f| f.corners.len() > 2).collect();
    Some(Body { vertices: polytope.vertices().to_vec(), faces, relative })
}

/// The object of `shape.json`.
pub fn json(found: &Found, data: &Data, errors: Option<&Errors>) -> Json {
    let convex = &found.convex;
    let facet = |e: &crate::inversion::egi::Estimate| {
        json!({
            "normal": e.facet.normal.to_array(), "area_m2": e.facet.area, "area_sd_m2": number(e.area_sd),
            "direction_sd_deg": number(e.direction_sd.to_degrees()), "split_probability": e.split, "claimed": e.claimed,
        })
    };
    let part = |e: &crate::inversion::nonconvex::Estimate| {
        json!({
            "centre_m": e.part.centre.to_array(), "axes": e.part.axes.to_cols_array_2d(), "half_m": e.part.half.to_array(),
            "half_sd_m": e.half_sd.to_array(), "turn_sd_deg": (e.turn_sd * 180.0 / std::f64::consts::PI).to_array(),
            "panel": e.panel.as_ref().map(|p| json!({
                "normal": p.normal.to_array(), "normal_sd_deg": p.normal_sd.to_degrees(), "area_m2": p.area, "area_sd_m2": p.area_sd,
            })),
        })
    };
    let rival = |a: &crate::inversion::nonconvex::Alternative| {
        json!({ "n_parts": a.parts.len(), "chi2": a.chi2, "volume_m3": a.volume, "chamfer": a.chamfer,
            "panels": a.panels.iter().map(|(n, area)| json!({ "normal": n.to_array(), "area_m2": area })).collect::<Vec<_>>() })
    };
    json!({
        "chi2_reduced": number(found.chi2_reduced()),
        "held_out_chi2_reduced": number(found.held_out),
        "convex": found.is_convex(),
        "n_parts": found.assembly.as_ref().map_or(1, |a| a.parts.len()),
        "points": data.curve.y.len(), "left_out": data.left_out, "outliers": convex.outliers,
        "snr": number(convex.snr), "effective_rank": convex.rank,
        "relative": !convex.calibrated,
        "facets": convex.facets.iter().map(facet).collect::<Vec<_>>(),
        "claims": claims(found),
        "certificate_sigma": number(convex.certificate), "certificate_threshold_sigma": number(convex.threshold),
        "unobserved_fraction": convex.unobserved,
        "closure_defect": convex.defect.length(), "closure_defect_sd": number(convex.defect_sd),
        "nonconvexity": found.verdict.as_ref().map(|v| json!({
            "found": v.call == Call::NonConvex, "floor": v.floor, "floor_found": number(v.floor_found),
            "defect_sigmas": v.defect_sigmas, "defect_limit": v.defect_limit,
        })),
        "parts": found.assembly.as_ref().map(|a| a.parts.iter().map(part).collect::<Vec<_>>()),
        "alternatives": found.assembly.as_ref().map(|a| a.alternatives.iter().map(rival).collect::<Vec<_>>()),
        "errors": errors.map(|e| json!({
            "iou": e.iou, "hausdorff": e.hausdorff, "chamfer": e.chamfer, "volume_ratio": e.volume_ratio,
        })),
        "input": data.told,
    })
}

fn number(value: f64) -> Json {
    serde_json::Number::from_f64(value).map_or(Json::Null, Json::Number)
}

/// What may be said of the shape, sentence by sentence.
fn claims(found: &Found) -> Vec<String> {
    let convex = &found.convex;
    let mut said = Vec::new();
    let claimed = convex.facets.iter().filter(|e| e.claimed).count();
    said.push(match convex.verdict {
        Verdict::Facets => format!("{claimed} of {} facets are claimed", convex.facets.len()),
        Verdict::Smooth { .. } => "no facet is claimed: a smooth body explains the light as well".into(),
        Verdict::Endless { .. } | Verdict::Unresolved { .. } => {
            "no facet is claimed: the light does not tell them apart".into()
        }
        Verdict::Dark => "no light".into(),
    });
    if let Err(why) = &found.body {
        said.push(format!("no convex body: {why}"));
    }
    match &found.verdict {
        Some(v) if v.call == Call::NonConvex => said.push(format!(
            "not convex: no convex body sends this light (residual floor {:.2} %, closure open by {:.1} standard deviations)",
            100.0 * v.floor,
            v.defect_sigmas
        )),
        Some(v) => said.push(format!(
            "convex bodies explain the light; a concavity that takes {:.1} % of it would have been found",
            100.0 * v.floor_found
        )),
        None => {}
    }
    if let Some(assembly) = &found.assembly {
        said.push(format!("{} boxes or panels explain it", assembly.parts.len()));
        for panel in assembly.parts.iter().filter_map(|e| e.panel.as_ref()) {
            said.push(format!(
                "a panel of {:.2} +- {:.2} m2, its normal known to {:.2} deg",
                panel.area,
                panel.area_sd,
                panel.normal_sd.to_degrees()
            ));
        }
        if !assembly.alternatives.is_empty() {
            said.push(format!("{} other assemblies explain it as well", assembly.alternatives.len()));
        }
    }
    if convex.unobserved > 0.01 {
        said.push(format!("{:.0} % of the directions were never lit and seen", 100.0 * convex.unobserved));
    }
    said
}

/// The summary of a shape, line by line.
pub fn summary(found: &Found, data: &Data, asked: Model, errors: Option<&Errors>) -> Vec<String> {
    let mut lines = data.told.clone();
    if data.left_out > 0 {
        lines.push(format!("{} points left out for their flags", data.left_out));
    }
    lines.push(format!(
        "{} points, signal-to-noise ratio {:.0}: the light tells {} numbers",
        data.curve.y.len(),
        found.convex.snr,
        found.convex.rank
    ));
    lines.extend(claims(found));
    let kind = if found.is_convex() { "convex" } else { "boxes and panels" };
    let chi2 = format!("{kind}: chi-square {:.2} a degree of freedom", found.chi2_reduced());
    let held = if found.held_out.is_finite() {
        format!(", {:.2} at points held out", found.held_out)
    } else {
        String::new()
    };
    lines.push(chi2 + &held);
    if asked == Model::Auto && found.is_convex() && found.verdict.is_some_and(|v| v.call == Call::NonConvex) {
        lines.push("too few points for boxes and panels: the shape given is the convex one".into());
    }
    if let Some(e) = errors {
        lines.push(format!(
            "against the truth: volumes in common {:.3}, {:.3} of its volume, surfaces {:.4} of the diagonal apart on average, {:.3} at most",
            e.iou, e.volume_ratio, e.chamfer, e.hausdorff
        ));
    }
    lines
}
