//! Baseline: resample and merge at a fixed angle (Robinson & Frueh).
//!
//! Non-negative least squares on 500 to 2000 candidate normals; those above 1 % of the total area are kept; a cone about each is
//! filled with 100 new candidates; least squares again; facets nearer than a fixed angle are merged. A facet is found where the
//! nearest candidate lies and takes in its neighbours: the off-grid solver of [`super::egi`] is measured against this.

use super::egi::{Problem, cluster};
use super::nnls::{self, Columns, NnlsError};
use super::sphere::{fibonacci, tangents};
use super::synthetic::Stream;
use crate::object::convex::Facet;
use crate::object::matter::Material;
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// How to resample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resample {
    /// First candidates, 500 to 2000.
    pub candidates: usize,
    /// Whether they are random; else Fibonacci's.
    pub random: bool,
    /// Least share of the total area that is kept.
    pub keep: f64,
    /// Half-angle of the cones \[rad\].
    pub cone: f64,
    /// Candidates in each cone.
    pub per_cone: usize,
    /// Facets nearer than this are merged \[rad\], pi/10 to pi/8.
    pub merge: f64,
    /// Seed of the random directions.
    pub seed: u64,
}

impl Default for Resample {
    fn default() -> Self {
        let (cone, merge) = (PI / 20.0, PI / 10.0);
        Self { candidates: 1000, random: false, keep: 0.01, cone, per_cone: 100, merge, seed: 0 }
    }
}

/// Facets by resampling and merging; curves' scales count as 1 where free.
///
/// # Errors
/// A material that gives columns that are not finite.
pub fn resample_and_merge(
    problem: &Problem,
    material: &Material,
    how: &Resample,
) -> Result<Vec<Facet>, NnlsError> {
    let mut stream = Stream::new(how.seed);
    let first: Vec<DVec3> = match how.random {
        true => (0..how.candidates).map(|_| stream.direction()).collect(),
        false => fibonacci(how.candidates).collect(),
    };
    let kept = least_squares(problem, material, &first, how.keep)?;
    let mut second = Vec::new();
    for facet in &kept {
        second.push(facet.normal);
        second.extend((0..how.per_cone).map(|_| in_cone(facet.normal, how.cone, &mut stream)));
    }
    let mut facets = least_squares(problem, material, &second, 0.0)?;
    cluster(&mut facets, how.merge);
    Ok(facets)
}

/// Even in a cone.
fn in_cone(axis: DVec3, half_angle: f64, stream: &mut Stream) -> DVec3 {
    let z = 1.0 - stream.uniform() * (1.0 - libm::cos(half_angle));
    let (r, angle) = ((1.0 - z * z).max(0.0).sqrt(), TAU * stream.uniform());
    let [a, b] = tangents(axis);
    (axis * z + a * (r * libm::cos(angle)) + b * (r * libm::sin(angle))).normalize()
}

fn least_squares(
    problem: &Problem,
    material: &Material,
    normals: &[DVec3],
    keep: f64,
) -> Result<Vec<Facet>, NnlsError> {
    let matrix = Columns::new(problem.len(), normals.iter().map(|&n| problem.weighted_column(n, material)));
    let solution = nnls::solve(&matrix, &problem.weighted_data(), &[])?;
    let total: f64 = solution.x.iter().sum();
    let facet = |&j: &usize| Facet { normal: normals[j], area: solution.x[j] };
    Ok(solution.support.iter().map(facet).filter(|f| f.area > keep * total).collect())
}

#[cfg(test)]
mod tests {
    use super::super::egi::{Curve, Options, Scale, matching::pairs, solve};
    use super::super::synthetic::{cuboid, directions, noisy};
    use super::*;
    use crate::object::convex::Epochs;

    /// By how much the fixed angle costs on a box at 1:100: the worst area.
    #[test]
    fn the_baseline_finds_a_box_but_less_well_than_the_off_grid_solver() {
        let truth = cuboid(DVec3::new(1.0, 2.0, 3.0));
        let mut stream = Stream::new(4);
        let directions = directions(400, &mut stream);
        let material = Material::lambert(1.0);
        let curve = Epochs::new(directions.clone()).curve(&truth, &material, 0.0);
        let (y, sigma) = noisy(&curve, 100.0, &mut stream);
        let problem = Problem::new(&[Curve { y, sigma, directions, scale: Scale::Fixed(1.0) }]).unwrap();
        let worst = |facets: &[Facet]| {
            let pairs = pairs(&truth, facets, 0.2);
            assert_eq!(pairs.len(), 6);
            pairs.iter().map(|p| p.angle).fold(0.0, f64::max)
        };
        let off_grid = worst(&solve(&problem, &material, &Options::default()).unwrap().image());
        for random in [false, true] {
            let how = Resample { random, ..Resample::default() };
            let facets = resample_and_merge(&problem, &material, &how).unwrap();
            assert!(worst(&facets) > off_grid, "{} {off_grid}", worst(&facets));
            assert_eq!(facets, resample_and_merge(&problem, &material, &how).unwrap());
        }
    }
}
