//! The shape of a run, read back from `shape.obj`, `shape.mtl` and `shape.json`.

use crate::io::shape_file::Class;
use glam::DVec3;
use serde_json::{Value as Json, json};
use std::path::Path;

/// Most facets that the page draws, the largest.
const MOST_FACETS: usize = 8000;

/// A facet: its corners and material.
struct Facet {
    corners: Vec<usize>,
    material: usize,
    part: String,
    area: f64,
}

/// What a mesh file holds.
#[derive(Default)]
struct Mesh {
    vertices: Vec<DVec3>,
    facets: Vec<Facet>,
    materials: Vec<String>,
}

/// The shape for the page's program; none if there is no mesh.
///
/// # Errors
/// What is wrong with the files.
pub(super) fn solid(dir: &Path) -> Result<Option<Json>, String> {
    let bytes = match std::fs::read(dir.join("shape.obj")) {
        Ok(bytes) => bytes,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(e) => return Err(format!("shape.obj is left out: {e}")),
    };
    let mut mesh = read(&String::from_utf8_lossy(&bytes));
    if mesh.facets.is_empty() {
        return Err("shape.obj is left out: it holds no facet".into());
    }
    let found = mesh.facets.len();
    mesh.facets.sort_by(|a, b| b.area.total_cmp(&a.area));
    mesh.facets.truncate(MOST_FACETS);
    let used = mesh.facets.iter().flat_map(|f| f.corners.iter().map(|c| mesh.vertices[*c]));
    let ends = (DVec3::splat(f64::INFINITY), DVec3::splat(f64::NEG_INFINITY));
    let (low, high) = used.fold(ends, |(low, high), v| (low.min(v), high.max(v)));
    let half = (0.5 * high - 0.5 * low).length();
    if !(half > 0.0 && half.is_finite()) {
        return Err("shape.obj is left out: it has no extent".into());
    }
    let middle = 0.5 * low + 0.5 * high;
    let round = |v: f64| (v * 1e5).round() / 1e5;
    let vertices = mesh.vertices.iter().map(|v| ((*v - middle) / half).to_array().map(round)).collect::<Vec<_>>();
    let total = mesh.facets.iter().map(|f| f.area).sum::<f64>();
    let materials = mesh.materials.iter().enumerate().map(|(number, name)| {
        let own = || mesh.facets.iter().filter(|f| f.material == number);
        let class = Class::ALL.into_iter().find(|c| c.name() == name);
        json!({
            "name": name, "words": class.map_or_else(|| name.clone(), |c| c.words().to_owned()), "colour": class.map_or([150, 150, 150], Class::colour),
            "facets": own().count(), "share": own().map(|f| f.area).sum::<f64>() / total.max(f64::MIN_POSITIVE),
        })
    });
    let materials = materials.collect::<Vec<_>>();
    let facets = mesh.facets.iter().map(|f| json!([f.material, f.part, f.area, f.corners])).collect::<Vec<_>>();
    Ok(Some(json!({
        "vertices": vertices, "facets": facets, "materials": materials, "found": found, "half": half,
        "relative": String::from_utf8_lossy(&bytes).contains("Lengths are relative"),
    })))
}

/// `shape.json`; none if there is none.
///
/// # Errors
/// What is wrong with the file.
pub(super) fn outcome(dir: &Path) -> Result<Option<Json>, String> {
    match std::fs::read(dir.join("shape.json")) {
        Ok(bytes) => serde_json::from_slice(&bytes).map(Some).map_err(|e| format!("shape.json is left out: {e}")),
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(e) => Err(format!("shape.json is left out: {e}")),
    }
}

fn read(text: &str) -> Mesh {
    let mut mesh = Mesh::default();
    let (mut material, mut part) = (0, String::new());
    for line in text.lines() {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                let mut next = || words.next().and_then(|w| w.parse().ok()).unwrap_or(f64::NAN);
                mesh.vertices.push(DVec3::new(next(), next(), next()));
            }
            Some("g" | "o") => part = words.next().unwrap_or_default().to_owned(),
            Some("usemtl") => {
                let name = words.next().unwrap_or_default();
                material = mesh.materials.iter().position(|m| m == name).unwrap_or_else(|| {
                    mesh.materials.push(name.to_owned());
                    mesh.materials.len() - 1
                });
            }
            Some("f") => {
                let corners = words.map(|w| corner(w, &mesh.vertices)).collect::<Option<Vec<_>>>();
                if let Some(corners) = corners.filter(|c| c.len() > 2) {
                    if mesh.materials.is_empty() {
                        mesh.materials.push("no material".into());
                    }
                    let places = corners.iter().map(|c| mesh.vertices[*c]).collect::<Vec<_>>();
                    let area = crate::io::shape_file::vector_area(&places).length();
                    mesh.facets.push(Facet { corners, material, part: part.clone(), area });
                }
            }
            _ => {}
        }
    }
    mesh
}

/// The vertex of a corner, counted from 1 or backwards from the last; none if it is not there or no place.
fn corner(word: &str, vertices: &[DVec3]) -> Option<usize> {
    let number = word.split('/').next()?.parse::<i64>().ok()?;
    let count = i64::try_from(vertices.len()).ok()?;
    let at = usize::try_from(if number < 0 { count.checked_add(number)? } else { number - 1 }).ok()?;
    vertices.get(at).filter(|v| v.is_finite()).map(|_| at)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn meshes_are_read_and_faulty_facets_left_out() {
        let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv nan 0 0\ng part_1\nusemtl unclaimed\nf 1 2 3\nf -3/1 -2 1\nf 1 2 4\nf 1 2 9\nf 1 2\n\
                    usemtl other\nf 1//1 2//1 3//1\nf 9223372036854775807 -9223372036854775808 0\n";
        let mesh = read(text);
        assert_eq!(mesh.facets.len(), 3);
        assert_eq!((mesh.facets[0].area, mesh.facets[0].material, mesh.facets[2].material), (0.5, 0, 1));
        assert_eq!(mesh.facets[1].corners, [1, 2, 0]);
        assert!(read("f 1 2 3\nv x\n\u{0}").facets.is_empty());
    }
}
