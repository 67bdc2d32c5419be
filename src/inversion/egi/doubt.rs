//! Errors of facets that allow for images of many facets.
//!
//! The Fisher matrix of a sparse image takes the number of its facets for known. Where the geometries are few (an object that spins, seen in a
//! few nights) other images, with facets elsewhere or merged, explain the light about as well, and its errors are too small. So the mean
//! direction of all light-giving facets nearer to one than to the others is moved in each of four directions by least squares over all
//! non-negative images on a grid, until chi^2 has risen by one (profile likelihood; Murphy & van der Vaart 2000, JASA 95, 449).
//! An image that need not be sparse knows a direction about 2.5 times less well also where the sparse one is right, as it is in directions at
//! random; a facet that may be moved farther has errors larger by as much, and is claimed only if they still allow it.

use super::{Problem, Solution};
use crate::inversion::nnls::{self, Columns};
use crate::inversion::sphere::fibonacci;
use crate::object::convex::Facet;
use crate::object::matter::Material;
use glam::DVec3;
use rayon::prelude::*;

/// Elements of a matrix at most, and normals of the grid.
const ELEMENTS: usize = 2_000_000;
const NORMALS: (usize, usize) = (500, 2000);
/// Times by which images of many facets know a direction less well than sparse ones that are right.
const LESS: f64 = 2.5;
/// First move, in standard deviations, and the greatest that is tried \[rad\].
const FIRST: f64 = 2.0;
const FARTHEST: f64 = 0.35;
/// Standard deviation of a move, in those of the direction.
const STIFF: f64 = 1.0 / 30.0;
/// Least rise of chi^2 that is told from none.
const LEAST: f64 = 1e-3;

impl Solution {
    /// The same with errors that allow for images of many facets; those that become less sure than `limit` \[rad\] are no longer claimed.
    /// The scales of `problem` are fixed.
    #[must_use]
    pub fn doubted(mut self, problem: &Problem, material: &Material, limit: f64) -> Self {
        let count = (ELEMENTS / problem.len().max(1)).clamp(NORMALS.0, NORMALS.1);
        let image: Vec<DVec3> = self.facets.iter().map(|e| e.facet.normal).collect();
        let normals: Vec<DVec3> = image.iter().copied().chain(fibonacci(count)).collect();
        let nearest = |n: &DVec3| (0..image.len()).max_by(|a, b| image[*a].dot(*n).total_cmp(&image[*b].dot(*n)));
        let images = Images {
            columns: normals.iter().map(|n| problem.weighted_column(*n, material)).collect(),
            cell: normals.iter().map(nearest).collect(),
            normals,
            data: problem.weighted_data(),
        };
        let warm: Vec<usize> = (0..image.len()).collect();
        let Some((least, support)) = images.best(None, &warm) else { return self };
        self.facets.par_iter_mut().enumerate().filter(|(_, e)| e.claimed && e.direction_sd > 0.0).for_each(
            |(k, e)| {
                let freedom = images.freedom(k, &e.facet, e.direction_sd, (least, &support));
                let wider = (freedom / (LESS * e.direction_sd)).max(1.0);
                e.direction_sd *= wider;
                e.area_sd *= wider;
                e.claimed = e.direction_sd <= limit;
            },
        );
        self
    }
}

/// All non-negative images on a grid.
struct Images {
    normals: Vec<DVec3>,
    columns: Vec<Vec<f64>>,
    /// The facet of the sparse image that each is nearest to.
    cell: Vec<Option<usize>>,
    data: Vec<f64>,
}

impl Images {
    /// chi^2 and support of the best, with a condition on the areas besides; none where there is none.
    fn best(&self, condition: Option<&dyn Fn(usize) -> f64>, warm: &[usize]) -> Option<(f64, Vec<usize>)> {
        let column = |(j, column): (usize, &Vec<f64>)| {
            let mut column = column.clone();
            column.extend(condition.map(|row| row(j)));
            column
        };
        let mut data = self.data.clone();
        data.resize(data.len() + usize::from(condition.is_some()), 0.0);
        let columns = Columns::new(data.len(), self.columns.iter().enumerate().map(column));
        let best = nnls::solve(&columns, &data, warm).ok()?;
        Some((2.0 * best.objective, best.support))
    }

    /// How far \[rad\] the facet number `k` may be off where chi^2 has risen by one, in the worst of four directions.
    fn freedom(&self, k: usize, facet: &Facet, sd: f64, (least, support): (f64, &[usize])) -> f64 {
        let stiffness = 1.0 / (STIFF * facet.area * sd);
        let towards = |direction: DVec3| {
            let mut shift = FIRST * sd;
            loop {
                let row = |j: usize| match self.cell[j] == Some(k) {
                    true => stiffness * self.normals[j].dot(direction - facet.normal * libm::tan(shift)),
                    false => 0.0,
                };
                let rise = self.best(Some(&row), support).map_or(f64::INFINITY, |(chi2, _)| chi2 - least);
                if rise >= 1.0 || 2.0 * shift > FARTHEST {
                    return shift / rise.max(LEAST).sqrt();
                }
                shift *= 2.0;
            }
        };
        let first = facet.normal.any_orthonormal_vector();
        let second = facet.normal.cross(first);
        [first, -first, second, -second].into_iter().map(towards).fold(0.0, f64::max)
    }
}
