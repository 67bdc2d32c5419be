//! The baseline: one concavity with one angle in the best convex body, after Robinson & Frueh.
//!
//! Light that a concavity hides is missing on its side of the extended Gaussian image, so the closure defect D = sum a n points away from
//! it. The convex body is closed by the facet -D; the facets whose normals lie near -D are folded inwards, each to a
//! pyramid whose walls stand at one angle psi to it; psi is scanned from 10 to 80 deg in steps of 10, and the best curve through
//! the exact renderer wins. This is the simplest honest form of the family, kept to be compared with [`super::assemble`].

use super::NonconvexError;
use super::part::Triangle;
use crate::inversion::egi::{self, Problem, Solution};
use crate::inversion::minkowski::{self, closure};
use crate::inversion::polytope::Polytope;
use crate::object::matter::{Material, weight};
use crate::object::shadow::body::Body;
use crate::object::shadow::exact::Exact;
use crate::object::surface::mesh::Mesh;
use glam::DVec3;

/// Facets whose normals are nearer than this to the direction are folded \[rad\], the nearest one in any case.
const NEAR: f64 = 0.5;
/// A pyramid reaches at most this share of the way through the body.
const DEEPEST: f64 = 0.9;

/// The body folded at one angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Folded {
    /// psi \[rad\]; 0 is the convex body.
    pub angle: f64,
    /// chi^2.
    pub chi2: f64,
}

/// The best of the family.
#[derive(Debug, Clone, PartialEq)]
pub struct Baseline {
    /// Unit vector out of the concavity; zero where there is no defect.
    pub direction: DVec3,
    /// Every angle tried, that of the convex body first.
    pub scan: Vec<Folded>,
    /// The best of them.
    pub best: Folded,
    /// Its surface.
    pub triangles: Vec<Triangle>,
}

impl Baseline {
    /// Its normalised irradiance \[m^2/sr\] for directions to Sun and observer in body axes.
    pub fn light(&self, material: &Material, directions: &[(DVec3, DVec3)]) -> Vec<f64> {
        light(&self.triangles, material, directions)
    }

    /// Its surface as a mesh.
    pub fn mesh(&self) -> Mesh {
        let corners = (0..self.triangles.len() as u32).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]);
        Mesh::plain(self.triangles.iter().flatten().copied().collect(), corners)
    }
}

/// The best body with one concavity.
///
/// # Errors
/// As of the convex fit and of its body.
pub fn baseline(problem: &Problem, material: &Material) -> Result<Baseline, NonconvexError> {
    let options = egi::Options { closure: egi::Closure::Off, ..egi::Options::default() };
    let fit = egi::solve(problem, material, &options)?;
    let polytope = closed(&fit)?;
    let direction = -fit.defect.normalize_or_zero();
    let angles = (0..=8).map(|k| f64::from(k * 10).to_radians());
    let fold = |angle: f64| {
        let triangles = folded(&polytope, direction, angle);
        (Folded { angle, chi2: chi2(problem, material, &triangles) }, triangles)
    };
    let all: Vec<(Folded, Vec<Triangle>)> = angles.map(fold).collect();
    let scan = all.iter().map(|(folded, _)| *folded).collect();
    let best = all.into_iter().min_by(|a, b| a.0.chi2.total_cmp(&b.0.chi2));
    let (best, triangles) = best.ok_or(NonconvexError::Dark)?;
    Ok(Baseline { direction, scan, best, triangles })
}

/// The convex body, an additional facet closing it.
fn closed(fit: &Solution) -> Result<Polytope, NonconvexError> {
    let image = fit.image();
    if image.is_empty() {
        return Err(NonconvexError::Dark);
    }
    let normals: Vec<DVec3> = image.iter().map(|f| f.normal).collect();
    let areas: Vec<f64> = image.iter().map(|f| f.area).collect();
    let with = |policy| {
        let closure = minkowski::closure::Closure { policy, limit: 1.0, ..Default::default() };
        minkowski::solve(&normals, &areas, &minkowski::Options { closure, ..Default::default() })
    };
    let solution = with(closure::Policy::AddFacet).or_else(|_| with(closure::Policy::Adjust))?;
    Ok(solution.polytope)
}

/// The surface with pyramids in place of the facets near a direction.
fn folded(polytope: &Polytope, direction: DVec3, angle: f64) -> Vec<Triangle> {
    let normals: Vec<DVec3> = polytope.normals().collect();
    let mesh = polytope.mesh();
    let cosine = |facet: u32| normals.get(facet as usize).map_or(-1.0, |n| n.dot(direction));
    let nearest = mesh.facets.iter().map(|f| cosine(*f)).fold(-1.0, f64::max);
    let limit = libm::cos(NEAR).min(nearest);
    let mut out = Vec::new();
    for (polygon, facet) in mesh.polygons.iter().zip(&mesh.facets) {
        let corners: Vec<DVec3> = polygon.iter().filter_map(|k| mesh.vertices.get(*k as usize).copied()).collect();
        let Some(normal) = normals.get(*facet as usize) else { continue };
        let centre = corners.iter().sum::<DVec3>() / corners.len().max(1) as f64;
        let edges = || corners.iter().zip(corners.iter().cycle().skip(1));
        let mut depth = 0.0;
        if angle > 0.0 && direction != DVec3::ZERO && cosine(*facet) >= limit {
            let middle = |(a, b): (&DVec3, &DVec3)| (0.5 * (*a + *b)).distance(centre);
            let radius = edges().map(middle).fold(f64::INFINITY, f64::min);
            let through = mesh.vertices.iter().map(|v| normal.dot(centre - *v)).fold(0.0, f64::max);
            depth = (radius * libm::tan(angle)).min(DEEPEST * through);
        }
        let apex = centre - *normal * depth;
        out.extend(edges().map(|(a, b)| [*a, *b, apex]));
    }
    out
}

/// chi^2 of a closed surface.
fn chi2(problem: &Problem, material: &Material, triangles: &[Triangle]) -> f64 {
    let directions: Vec<(DVec3, DVec3)> = (0..problem.len()).map(|t| problem.epochs().at(t)).collect();
    let data = problem.weighted_data();
    let light = light(triangles, material, &directions);
    data.iter().zip(problem.sigma()).zip(light).map(|((z, sigma), y)| (z - y / sigma).powi(2)).sum()
}

/// Normalised irradiance \[m^2/sr\] of a closed surface.
fn light(triangles: &[Triangle], material: &Material, directions: &[(DVec3, DVec3)]) -> Vec<f64> {
    let faces: Vec<[u32; 3]> = (0..triangles.len() as u32).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
    let sheet = vec![false; faces.len()];
    let body = Body::new(triangles.iter().flatten().copied().collect(), faces, sheet);
    let mut exact = Exact::default();
    let mut weights = Vec::new();
    let one = |&(sun, observer): &(DVec3, DVec3)| {
        weights.clear();
        weights.extend(body.normals.iter().map(|n| weight(material, *n, sun, observer, 0.0)));
        exact.flux(&body, sun, observer, &weights)
    };
    directions.iter().map(one).collect()
}
