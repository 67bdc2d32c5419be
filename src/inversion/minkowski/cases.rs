//! Images on which methods for Minkowski's problem are compared: smooth and rough, round, long and flat, and with areas that
//! spread over many orders of magnitude.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::closure::{self, Closure, Policy};
use super::{Fault, image};
use crate::inversion::polytope::Polytope;

/// An image with a name.
#[derive(Debug, Clone)]
pub struct Case {
    /// What it is.
    pub name: &'static str,
    /// Unit normals.
    pub normals: Vec<DVec3>,
    /// Areas, closed.
    pub areas: Vec<f64>,
}

impl Case {
    /// Least over largest area.
    pub fn area_ratio(&self) -> f64 {
        let ends = |(low, high): (f64, f64), &a: &f64| (low.min(a), high.max(a));
        let (low, high) = self.areas.iter().fold((f64::INFINITY, 0.0), ends);
        low / high
    }
}

/// All cases with at most `most` facets, the same ones each time.
///
/// # Errors
/// [`Fault`] never for these cases; it is what their making may return in general.
pub fn all(most: usize) -> Result<Vec<Case>, Fault> {
    let long = DVec3::new(1.0, 1.0, 100.0);
    let flat = DVec3::new(100.0, 100.0, 1.0);
    let makers: [(&'static str, usize, Maker); 20] = [
        ("random, 12 planes", 12, &|| random(12, 0.3, 1)),
        ("random, 80 planes", 80, &|| random(80, 0.03, 2)),
        ("random, 800 planes", 800, &|| random(800, 0.001, 3)),
        ("random, 4000 planes", 4000, &|| random(4000, 2.5e-4, 4)),
        ("ellipsoid 1:1:1", 1000, &|| ellipsoid(1000, DVec3::ONE)),
        ("ellipsoid 1:3:10", 5000, &|| ellipsoid(5000, DVec3::new(1.0, 3.0, 10.0))),
        ("ellipsoid 1:2:3", 20_000, &|| ellipsoid(20_000, DVec3::new(1.0, 2.0, 3.0))),
        ("ellipsoid 1:10:100", 228, &|| ellipsoid(228, DVec3::new(1.0, 10.0, 100.0))),
        ("box 1:1:100", 6, &|| Ok(cuboid(long))),
        ("box 100:100:1", 6, &|| Ok(cuboid(flat))),
        ("box 1:1:1e4", 6, &|| Ok(cuboid(DVec3::new(1.0, 1.0, 1e4)))),
        ("box 1e4:1e4:1", 6, &|| Ok(cuboid(DVec3::new(1e4, 1e4, 1.0)))),
        ("random needle 1:1:100", 200, &|| Ok(stretched(random(200, 0.01, 6)?, long))),
        ("random pancake 100:100:1", 200, &|| Ok(stretched(random(200, 0.01, 7)?, flat))),
        ("lognormal areas, sigma 2", 1000, &|| lognormal(1000, 2.0, 8)),
        ("lognormal areas, sigma 4", 1000, &|| lognormal(1000, 4.0, 9)),
        ("normals 1e-3, 1e-4 rad apart", 60, &|| near_parallel(40, 10)),
        ("hemisphere and one facet", 197, &|| hemisphere(196)),
        ("octahedron", 8, &|| Ok(octahedron())),
        ("simplex", 4, &|| Ok(simplex())),
    ];
    let chosen = makers.iter().filter(|(_, facets, _)| *facets <= most);
    chosen.map(|(name, _, make)| make().map(|(normals, areas)| Case { name, normals, areas })).collect()
}

type Maker<'a> = &'a dyn Fn() -> Result<Image, Fault>;

/// Normals and areas.
pub type Image = (Vec<DVec3>, Vec<f64>);

/// The image of the polytope of `count` random normals at distances between 1 and 1 + `spread`.
///
/// # Errors
/// [`Fault::Body`] if the normals leave it unbounded.
pub fn random(count: usize, spread: f64, seed: u64) -> Result<Image, Fault> {
    let mut draw = Draw(seed);
    let normals: Vec<DVec3> = (0..count).map(|_| draw.direction()).collect();
    let offsets: Vec<f64> = (0..count).map(|_| 1.0 + spread * draw.uniform()).collect();
    image_of(&normals, &offsets)
}

/// The image of the polytope of `count` planes that touch an ellipsoid of these half-axes.
///
/// # Errors
/// [`Fault::Body`] if there are too few.
pub fn ellipsoid(count: usize, axes: DVec3) -> Result<Image, Fault> {
    let normals: Vec<DVec3> = spiral(count).map(|n| (n / axes).normalize()).collect();
    let offsets: Vec<f64> = normals.iter().map(|&n| (n * axes).length()).collect();
    image_of(&normals, &offsets)
}

/// The image of a box of these edges.
pub fn cuboid(edges: DVec3) -> Image {
    let sides = DVec3::AXES.into_iter().zip((edges.x * edges.y * edges.z / edges).to_array());
    sides.flat_map(|(axis, area)| [(axis, area), (-axis, area)]).unzip()
}

/// Random normals with areas of standard deviation `sigma` in their logarithm, closed.
///
/// # Errors
/// As [`closure::close`].
pub fn lognormal(count: usize, sigma: f64, seed: u64) -> Result<Image, Fault> {
    let mut draw = Draw(seed);
    let normals: Vec<DVec3> = (0..count).map(|_| draw.direction()).collect();
    let areas: Vec<f64> = (0..count).map(|_| (sigma * draw.normal()).exp()).collect();
    closed(normals, areas, Policy::Adjust)
}

/// A random body with twenty facets of 1e-5 of the others' area, at 1e-3 and 1e-4 rad to them, closed.
///
/// # Errors
/// As [`closure::close`].
pub fn near_parallel(count: usize, seed: u64) -> Result<Image, Fault> {
    let (mut normals, mut areas) = random(count, 0.05, seed)?;
    let mut draw = Draw(!seed);
    for i in 0..20.min(normals.len()) {
        let angle = if i % 2 == 0 { 1e-3 } else { 1e-4 };
        let aside = normals[i].cross(draw.direction()).normalize();
        normals.push((normals[i] + angle * aside).normalize());
        areas.push(1e-5 * areas[i]);
    }
    closed(normals, areas, Policy::Adjust)
}

/// The upper hemisphere's normals with equal areas, and one facet that closes them.
///
/// # Errors
/// As [`closure::close`].
pub fn hemisphere(count: usize) -> Result<Image, Fault> {
    let normals: Vec<DVec3> = spiral(count.saturating_mul(2)).filter(|n| n.z > 0.0).collect();
    let areas = vec![1.0; normals.len()];
    closed(normals, areas, Policy::AddFacet)
}

/// The regular octahedron: four facets meet at each vertex.
pub fn octahedron() -> Image {
    let signs = [1.0, -1.0];
    let corners =
        signs.into_iter().flat_map(|x| signs.into_iter().flat_map(move |y| signs.map(|z| DVec3::new(x, y, z))));
    corners.map(|corner| (corner.normalize(), 1.0)).unzip()
}

/// The regular tetrahedron.
pub fn simplex() -> Image {
    let corners = [(1.0, 1.0, 1.0), (-1.0, -1.0, 1.0), (-1.0, 1.0, -1.0), (1.0, -1.0, -1.0)];
    corners.into_iter().map(|(x, y, z)| (DVec3::new(x, y, z).normalize(), 1.0)).unzip()
}

/// The image of the body stretched by these factors along the axes.
pub fn stretched((normals, areas): Image, factors: DVec3) -> Image {
    let vectors = normals.into_iter().zip(areas).map(|(n, a)| n * a / factors);
    vectors.map(|g| (g.normalize(), g.length())).unzip()
}

/// `count` directions along Fibonacci's spiral.
pub fn spiral(count: usize) -> impl Iterator<Item = DVec3> {
    let turn = PI * (3.0 - 5.0_f64.sqrt());
    (0..count).map(move |k| {
        let z = 1.0 - (2.0 * k as f64 + 1.0) / count as f64;
        let (sin, cos) = (turn * k as f64).sin_cos();
        let radius = (1.0 - z * z).sqrt();
        DVec3::new(radius * cos, radius * sin, z)
    })
}

fn image_of(normals: &[DVec3], offsets: &[f64]) -> Result<Image, Fault> {
    let polytope = Polytope::new(normals, offsets)?;
    let facets = polytope.normals().zip(polytope.areas().iter().copied());
    Ok(facets.filter(|(_, area)| *area > 0.0).unzip())
}

fn closed(normals: Vec<DVec3>, areas: Vec<f64>, policy: Policy) -> Result<Image, Fault> {
    let merged = image::merge(&normals, &areas, None, 0.0)?;
    let closed = closure::close(&merged, &Closure { policy, limit: 1.0, ..Closure::default() }, 0.0)?;
    Ok((closed.normals, closed.areas))
}

/// Random numbers (Steele et al. 2014, OOPSLA, SplitMix).
struct Draw(u64);

impl Draw {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 * 2.0_f64.powi(-53)
    }

    fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (TAU * self.uniform()).cos()
    }

    fn direction(&mut self) -> DVec3 {
        let z = 2.0 * self.uniform() - 1.0;
        let (sin, cos) = (TAU * self.uniform()).sin_cos();
        let radius = (1.0 - z * z).sqrt();
        DVec3::new(radius * cos, radius * sin, z)
    }
}
