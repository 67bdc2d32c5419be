//! Extended Gaussian images: the normals and areas of a surface.

use std::collections::HashMap;

use glam::DVec3;

use super::Fault;

/// Facets with distinct unit normals.
#[derive(Debug, Clone, PartialEq)]
pub struct Merged {
    /// Unit normals.
    pub normals: Vec<DVec3>,
    /// Areas.
    pub areas: Vec<f64>,
    /// Standard deviations of the areas, if known.
    pub sigmas: Option<Vec<f64>>,
    /// Facet of each normal given.
    pub facet_of: Vec<u32>,
}

/// Area vectors of polygons (vertices counter-clockwise from outside), as unit normals and areas. Polygons without area, or with
/// vertices that are not there, are left out.
pub fn of_mesh(vertices: &[DVec3], polygons: &[Vec<u32>]) -> (Vec<DVec3>, Vec<f64>) {
    let vector = |polygon: &Vec<u32>| {
        let at = |v: u32| vertices.get(v as usize).copied().unwrap_or(DVec3::NAN);
        let first = polygon.first().map_or(DVec3::NAN, |&v| at(v));
        let corners = polygon.iter().map(|&v| at(v) - first);
        let pairs = corners.clone().zip(corners.skip(1));
        pairs.map(|(a, b)| 0.5 * a.cross(b - a)).sum::<DVec3>()
    };
    let vectors = polygons.iter().map(vector).filter(|g| g.length() > 0.0);
    vectors.map(|g| (g / g.length(), g.length())).unzip()
}

/// Merges facets whose normals are closer than `angle` \[rad\] to the first of them: their area vectors add, and their variances.
///
/// # Errors
/// [`Fault`] for values out of range.
pub fn merge(normals: &[DVec3], areas: &[f64], sigmas: Option<&[f64]>, angle: f64) -> Result<Merged, Fault> {
    check(normals, areas, sigmas)?;
    let angle = if angle.is_nan() { 1e-9 } else { angle.clamp(1e-9, 0.1) };
    let mut cells: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
    let mut first: Vec<DVec3> = Vec::new();
    let (mut vectors, mut variances): (Vec<DVec3>, Vec<f64>) = (Vec::new(), Vec::new());
    let mut facet_of = Vec::with_capacity(normals.len());
    for (i, (&normal, &area)) in normals.iter().zip(areas).enumerate() {
        let unit = unit(normal);
        let cell = unit.to_array().map(|x| (x / angle).floor() as i64);
        let near = |facet: &u32| (first[*facet as usize] - unit).length() < angle;
        let found = neighbourhood(cell).find_map(|cell| cells.get(&cell)?.iter().copied().find(near));
        let facet = found.unwrap_or_else(|| {
            first.push(unit);
            vectors.push(DVec3::ZERO);
            variances.push(0.0);
            let facet = first.len() as u32 - 1;
            cells.entry(cell).or_default().push(facet);
            facet
        });
        // kept as the difference from the first normal, so that equal normals stay what they are
        vectors[facet as usize] += area * (unit - first[facet as usize]);
        variances[facet as usize] += sigmas.map_or(0.0, |sigmas| sigmas[i] * sigmas[i]);
        facet_of.push(facet);
    }
    let mut sums = vec![0.0; first.len()];
    facet_of.iter().zip(areas).for_each(|(&facet, area)| sums[facet as usize] += area);
    let total = |k: usize| first[k] * sums[k] + vectors[k];
    let direction = |k: usize| if vectors[k] == DVec3::ZERO { first[k] } else { total(k).normalize() };
    let size = |k: usize| if vectors[k] == DVec3::ZERO { sums[k] } else { total(k).length() };
    let sigmas = sigmas.map(|_| variances.iter().map(|v| v.sqrt()).collect());
    let (normals, areas) = ((0..first.len()).map(direction).collect(), (0..first.len()).map(size).collect());
    Ok(Merged { normals, areas, sigmas, facet_of })
}

/// A cell and those around it.
fn neighbourhood(cell: [i64; 3]) -> impl Iterator<Item = [i64; 3]> {
    (0..27).map(move |k| [cell[0] + k % 3 - 1, cell[1] + k / 3 % 3 - 1, cell[2] + k / 9 - 1])
}

fn unit(normal: DVec3) -> DVec3 {
    // scaled first: the square of a length may leave the range of numbers; unit normals stay what they are
    let scaled = normal / normal.abs().max_element();
    if (normal.length_squared() - 1.0).abs() < 4.0 * f64::EPSILON { normal } else { scaled.normalize() }
}

fn check(normals: &[DVec3], areas: &[f64], sigmas: Option<&[f64]>) -> Result<(), Fault> {
    if normals.len() != areas.len() {
        return Err(Fault::Lengths { normals: normals.len(), areas: areas.len(), what: "areas" });
    }
    if let Some(sigmas) = sigmas.filter(|sigmas| sigmas.len() != normals.len()) {
        return Err(Fault::Lengths { normals: normals.len(), areas: sigmas.len(), what: "standard deviations" });
    }
    if normals.is_empty() || normals.len() >= 1 << 29 {
        return Err(Fault::Count(normals.len()));
    }
    let good_normal = |n: &DVec3| n.is_finite() && (1e-50..1e50).contains(&n.abs().max_element());
    if let Some((index, &value)) = normals.iter().enumerate().find(|(_, n)| !good_normal(n)) {
        return Err(Fault::Normal { index, value });
    }
    let least = 1e-18 * areas.iter().copied().fold(1e-50, f64::max);
    if let Some((index, &value)) = areas.iter().enumerate().find(|(_, a)| !(least..1e50).contains(*a)) {
        return Err(Fault::Area { index, value });
    }
    let sigma = sigmas.and_then(|sigmas| sigmas.iter().enumerate().find(|(_, s)| !(1e-50..1e50).contains(*s)));
    sigma.map_or(Ok(()), |(index, &value)| Err(Fault::Sigma { index, value }))
}
