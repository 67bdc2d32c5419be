//! What is written of a shape: the mesh with its uncertainty, `shape.json`, and the summary that a person reads.

use super::invert::Found;
use super::shape_data::Data;
use super::shape_pole::Rotation;
use super::shape_tumble::Tumbling;
pub use super::shape_words::{Errors, summary};
use super::shape_words::{claims, sky};
use crate::inversion::nonconvex::metrics::{aligned, bulk, distance, intersection_over_union};
use crate::inversion::nonconvex::registration::turned_over;
use crate::inversion::nonconvex::{Call, Triangle};
use crate::io::shape_file::{Body, Face, Uncertainty};
use crate::object::surface::mesh::Mesh;
use crate::object::surface::topology;
use glam::DVec3;
use serde_json::{Value as Json, json};

/// Columns of quasi-random lines for volumes; the third dimension is exact.
const COLUMNS: usize = 1 << 20;
/// Columns by which bodies are laid over each other.
const ALIGNED: usize = 1 << 17;
/// Points on surfaces for distances.
const POINTS: usize = 4000;

/// Triangles of a mesh, component by component.
pub fn components(mesh: &Mesh) -> Vec<Vec<Triangle>> {
    let mut parts: Vec<Vec<Triangle>> = Vec::new();
    for (face, number) in mesh.faces.iter().zip(topology::components(mesh)) {
        let number = number as usize;
        parts.resize(parts.len().max(number + 1), Vec::new());
        parts[number].extend(mesh.corners(face));
    }
    parts
}

/// Against the true triangles, part by part, after laying one on the other; it is turned only where it was sought how it turns, as the body's
/// axes are then its own. None without a shape.
pub fn errors(found: &Found, data: &Data, truth: &[Vec<Triangle>]) -> Option<Errors> {
    let relative = is_relative(found, data);
    let own = found.triangles();
    let volume = |parts: &[Vec<Triangle>]| bulk(parts, COLUMNS).volume;
    if own.is_empty() || truth.is_empty() {
        return None;
    }
    let volume_ratio = volume(&own) / volume(truth);
    let turned = found.has_own_axes();
    let own = if turned { turned_over(truth, &own, relative) } else { aligned(truth, &own, ALIGNED) };
    let apart = distance(truth, &own, POINTS);
    Some(Errors {
        iou: intersection_over_union(truth, &own, COLUMNS),
        hausdorff: apart.hausdorff,
        chamfer: apart.chamfer,
        volume_ratio,
        turned,
    })
}

/// The mesh with what is known of each face; none if there is no body.
pub fn body(found: &Found, data: &Data) -> Option<Body> {
    let relative = is_relative(found, data);
    if let Some(assembly) = &found.assembly {
        let mesh = assembly.mesh();
        let uncertainty = |part: usize| {
            let estimate = &assembly.parts[part];
            let sizes = estimate.half_sd / estimate.part.half;
            // of a panel the thickness counts for nothing
            let relative_area_sd = estimate.panel.as_ref().map_or(sizes.length(), |p| p.area_sd / p.area);
            let sd_deg = estimate.turn_sd.max_element().to_degrees();
            if found.explains() { Uncertainty::Known { sd_deg, relative_area_sd } } else { Uncertainty::Unclaimed }
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
    if !found.is_convex() {
        let triangles = found.triangles();
        let vertices = triangles.iter().flatten().flatten().copied().collect::<Vec<_>>();
        let face = |k: usize| Face {
            corners: vec![3 * k, 3 * k + 1, 3 * k + 2],
            part: 0,
            uncertainty: Uncertainty::Unclaimed,
        };
        return Some(Body { faces: (0..vertices.len() / 3).map(face).collect(), vertices, relative });
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
            "direction_sd_deg": number(e.direction_sd.to_degrees()), "split_probability": e.split, "claimed": found.claims(e),
        })
    };
    let part = |e: &crate::inversion::nonconvex::Estimate| {
        json!({
            "centre_m": e.part.centre.to_array(), "axes": e.part.axes.to_cols_array_2d(), "half_m": e.part.half.to_array(),
            "half_sd_m": e.half_sd.to_array(), "turn_sd_deg": (e.turn_sd * 180.0 / std::f64::consts::PI).to_array(),
            "panel": e.panel.as_ref().map(|p| json!({
                "normal": p.normal.to_array(), "normal_sd_deg": p.normal_sd.to_degrees(), "area_m2": p.area, "area_sd_m2": p.area_sd,
                "exposed_m2": p.exposed,
            })),
        })
    };
    let tie =
        |t: &crate::inversion::nonconvex::Tie| json!({ "kind": t.name(), "parts": t.parts(), "axes": t.axes() });
    let rival = |a: &crate::inversion::nonconvex::Alternative| {
        json!({ "n_parts": a.parts.len(), "chi2": a.chi2, "volume_m3": a.volume, "chamfer": a.chamfer,
            "panels": a.panels.iter().map(|(n, area)| json!({ "normal": n.to_array(), "area_m2": area })).collect::<Vec<_>>() })
    };
    let plain = |f: &crate::object::convex::Facet| {
        json!({ "normal": f.normal.to_array(), "area_m2": f.area, "area_sd_m2": null, "direction_sd_deg": null,
            "split_probability": null, "claimed": false })
    };
    let facets = match &found.draft {
        Some(draft) => draft.facets.iter().map(plain).collect::<Vec<_>>(),
        None => convex.facets.iter().map(facet).collect(),
    };
    let held = found.held_out.iter().filter(|h| **h).count();
    json!({
        "model": found.asked.name(),
        "chi2_reduced": number(found.chi2_reduced()),
        "held_out_chi2_reduced": number(found.held_out_chi2),
        "held_out": { "points": held, "stretches": runs(&found.held_out) },
        "body": match &found.body {
            Ok(b) => json!({ "method": b.method, "converged": b.converged, "iterations": b.iterations, "evaluations": b.evaluations,
                "area_residual": number(b.residual), "facets_lost": b.lost, "fault": null }),
            Err(why) => json!({ "method": null, "converged": false, "fault": why }),
        },
        "rotation": found.rotation.as_ref().map(rotation),
        "tumble": found.tumble.as_ref().map(|t| tumble(t, data)),
        "brdf": brdf(found, data),
        "curves": curves(found, data),
        "convex": found.is_convex(),
        "n_parts": found.assembly.as_ref().map_or(1, |a| a.parts.len()),
        "points": data.points(),
        "left_out": { "flagged": data.left_out.flagged, "gaps": data.left_out.gaps, "dark": data.left_out.dark,
            "outliers": found.outlier.iter().filter(|o| **o).count() },
        "beyond_3_sigma": convex.outliers,
        "snr": number(convex.snr), "effective_rank": convex.rank,
        "relative": is_relative(found, data),
        "facets": facets,
        "claims": claims(found, data),
        "certificate_sigma": number(convex.certificate), "certificate_threshold_sigma": number(convex.threshold),
        "unobserved_fraction": convex.unobserved,
        "closure_defect": convex.defect.length(), "closure_defect_sd": number(convex.defect_sd),
        "nonconvexity": found.verdict.as_ref().map(|v| json!({
            "found": v.call == Call::NonConvex, "floor": v.floor, "floor_found": number(v.floor_found),
            "defect_sigmas": v.defect_sigmas, "defect_limit": v.defect_limit,
        })),
        "parts": found.assembly.as_ref().map(|a| a.parts.iter().map(part).collect::<Vec<_>>()),
        "ties": found.assembly.as_ref().map(|a| a.ties.iter().map(tie).collect::<Vec<_>>()),
        "alternatives": found.assembly.as_ref().map(|a| a.alternatives.iter().map(rival).collect::<Vec<_>>()),
        "concavity": found.folded.as_ref().map(|f| json!({
            "direction": f.direction.to_array(), "angle_deg": f.best.angle.to_degrees(), "chi2": f.best.chi2,
            "scan": f.scan.iter().map(|s| json!({ "angle_deg": s.angle.to_degrees(), "chi2": s.chi2 })).collect::<Vec<_>>(),
        })),
        "errors": errors.map(|e| json!({
            "iou": e.iou, "hausdorff": e.hausdorff, "chamfer": e.chamfer, "volume_ratio": e.volume_ratio, "turned": e.turned,
        })),
        "input": data.told,
    })
}

/// Whether areas are known but for a factor.
pub fn is_relative(found: &Found, data: &Data) -> bool {
    !(found.convex.calibrated && data.absolute)
}

/// First and last number of every run of marked points.
fn runs(marked: &[bool]) -> Vec<[usize; 2]> {
    let mut out: Vec<[usize; 2]> = Vec::new();
    for (k, _) in marked.iter().enumerate().filter(|(_, m)| **m) {
        match out.last_mut().filter(|run| run[1] + 1 == k) {
            Some(run) => run[1] = k,
            None => out.push([k, k]),
        }
    }
    out
}

fn rotation(rotation: &Rotation) -> Json {
    let least = rotation.best().map_or(f64::NAN, |m| m.criterion);
    let minimum = |m: &crate::inversion::pole::Minimum| {
        let (ra, dec) = sky(m.pole);
        json!({
            "pole": m.pole.to_array(), "ra_deg": ra, "dec_deg": dec, "pole_sd_deg": number(m.sd[0].hypot(m.sd[1]).to_degrees()),
            "period_s": m.period, "period_sd_s": number(m.sd[2]), "chi2": number(m.solution.chi2),
            "chi2_reduced": number(m.solution.reduced()),
            "criterion": number(m.criterion), "criterion_above_best": number(m.criterion - least),
            "n_facets": m.solution.facets.len(), "from_alias": m.alias,
        })
    };
    json!({
        "minima": rotation.found.minima.iter().map(minimum).collect::<Vec<_>>(),
        "criterion": "chi2 + ln det(1 + J'J)", "criterion_limit": rotation.within,
        "refined": rotation.found.refined, "poles": rotation.found.map.len(),
        "periods": { "least_s": rotation.tried.0, "greatest_s": rotation.tried.1, "count": rotation.tried.2, "from": rotation.from },
    })
}

fn tumble(tumble: &Tumbling, data: &Data) -> Json {
    let least = tumble.best().map_or(f64::NAN, |m| m.criterion);
    let minimum = |m: &crate::inversion::tumble::Minimum| {
        let (ra, dec) = sky(m.motion.momentum());
        let q = m.motion.attitude;
        let (turn, nutation) = m.motion.periods().unwrap_or((f64::NAN, f64::NAN));
        json!({
            "quaternion": [q.w, q.x, q.y, q.z], "rate_deg_s": m.motion.rate.to_array().map(f64::to_degrees),
            "inertia": m.motion.inertia.to_array(),
            "momentum": m.motion.momentum().to_array(), "ra_deg": ra, "dec_deg": dec,
            "turn_s": number(turn), "nutation_s": number(nutation),
            "attitude_sd_deg": number(m.attitude_sd.length().to_degrees()),
            "rate_sd_deg_s": m.rate_sd.to_array().map(|sd| number(sd.to_degrees())),
            "chi2": number(m.solution.chi2), "chi2_reduced": number(m.solution.reduced()),
            "criterion": number(m.criterion), "criterion_above_best": number(m.criterion - least),
            "n_facets": m.solution.facets.len(),
        })
    };
    json!({
        "experimental": true, "epoch": format!("{}Z", data.start.iso_utc()),
        "minima": tumble.found.minima.iter().map(minimum).collect::<Vec<_>>(),
        "criterion": "chi2 + ln det(1 + J'J)", "criterion_limit": tumble.within,
        "drawn": tumble.found.tried[0], "followed": tumble.found.tried[1], "refined": tumble.found.tried[2],
        "told": tumble.told, "turns_s": tumble.range_s.map(|(low, high)| [low, high]),
    })
}

fn brdf(found: &Found, data: &Data) -> Json {
    match &found.law {
        Some(law) => json!({
            "law": law.material.model.name(), "fitted": true,
            "specular_fraction": law.specular_fraction.0, "specular_fraction_sd": number(law.specular_fraction.1),
            "exponent": law.exponent.0, "exponent_sd": number(law.exponent.1), "exponent_told": law.tells_exponent(),
            "albedo_held": law.albedo,
        }),
        None => json!({
            "law": data.material.model.name(), "fitted": false, "diffuse": data.material.diffuse,
            "specular": data.material.specular, "exponent": data.material.exponent, "roughness": data.material.roughness,
        }),
    }
}

/// Every curve with its scale and its chi-square by the shape.
fn curves(found: &Found, data: &Data) -> Vec<Json> {
    let mut first = 0;
    let one = |(k, (curve, name)): (usize, (&crate::inversion::egi::Curve, &String))| {
        let range = first..first + curve.y.len();
        first = range.end;
        let pulls =
            range.zip(curve.y.iter().zip(&curve.sigma)).filter(|(i, _)| found.outlier.get(*i) != Some(&true));
        let pulls =
            pulls.filter_map(|(i, (y, s))| Some(((y - found.model.get(i)?) / s).powi(2))).collect::<Vec<_>>();
        json!({
            "name": name, "points": curve.y.len(), "scale_free": curve.scale == crate::inversion::egi::Scale::Free,
            "scale": found.convex.scales.get(k).map(|s| number(*s)),
            "chi2_per_point": number(pulls.iter().sum::<f64>() / pulls.len().max(1) as f64),
        })
    };
    data.curves.iter().zip(&data.names).enumerate().map(one).collect()
}

fn number(value: f64) -> Json {
    serde_json::Number::from_f64(value).map_or(Json::Null, Json::Number)
}
