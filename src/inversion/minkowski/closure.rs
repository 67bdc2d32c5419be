//! Closing an extended Gaussian image: sum a_i n_i = 0, without turning a normal.
//!
//! The smallest change of areas in the metric sum da_i^2 / sigma_i^2 that closes the image and leaves each area at least a fraction of itself is
//! da_i = max(-sigma_i^2 n_i.x, (f - 1) a_i), where x minimises the convex function whose gradient is -sum (a_i + da_i) n_i: a
//! quadratic programme solved by Newton's method in three unknowns. A defect beyond noise says that a part of the body was not seen:
//! then a facet is added that closes the image exactly, and it is marked.

use glam::{DMat3, DVec3};

use super::Fault;
use super::image::Merged;

/// Relative defect at which an image counts as closed: rounding of its areas.
const CLOSED: f64 = 4.0 * f64::EPSILON;

/// Steps of Newton's method, which ends after a few.
const STEPS: usize = 200;

/// What to do with an open image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Policy {
    /// Change areas; refuse if the defect exceeds the limit.
    Adjust,
    /// Add a facet opposite to the defect.
    AddFacet,
    /// Add a facet if the defect exceeds so many standard deviations, else change areas. Without standard deviations as
    /// [`Policy::Adjust`].
    Significance(f64),
}

/// How an image is closed.
#[derive(Debug, Clone, PartialEq)]
pub struct Closure {
    /// What to do.
    pub policy: Policy,
    /// Standard deviations of the areas; without them variances go as areas.
    pub sigmas: Option<Vec<f64>>,
    /// Largest |sum a n| / sum a that changes of areas may close.
    pub limit: f64,
    /// Least fraction of itself that an area keeps, between 0 and 1.
    pub keep: f64,
}

impl Default for Closure {
    fn default() -> Self {
        Self { policy: Policy::Significance(5.0), sigmas: None, limit: 0.25, keep: 0.05 }
    }
}

/// A closed image.
#[derive(Debug, Clone, PartialEq)]
pub struct Closed {
    /// Unit normals, those given first.
    pub normals: Vec<DVec3>,
    /// Areas.
    pub areas: Vec<f64>,
    /// Facet whose area was not observed, or only in part: it closes the image.
    pub unobserved: Option<usize>,
    /// |sum a n| / sum a before.
    pub defect: f64,
    /// The defect in standard deviations (root of chi squared with three degrees of freedom), if those of the areas are known.
    pub significance: Option<f64>,
    /// Root of the mean square of the relative changes of areas.
    pub change: f64,
}

/// Closes an image.
///
/// # Errors
/// [`Fault::Open`] for a defect above the limit, or where no change of areas closes it.
pub fn close(image: &Merged, closure: &Closure, merge_rad: f64) -> Result<Closed, Fault> {
    let total: f64 = image.areas.iter().sum();
    let gap = moment(&image.normals, &image.areas);
    let defect = gap.length() / total;
    let significance = image.sigmas.as_ref().map(|sigmas| {
        let covariance = spread(&image.normals, sigmas.iter().map(|s| s * s));
        gap.dot(covariance.inverse() * gap).max(0.0).sqrt()
    });
    let mut closed = Closed {
        normals: image.normals.clone(),
        areas: image.areas.clone(),
        unobserved: None,
        defect,
        significance,
        change: 0.0,
    };
    if defect <= CLOSED {
        return Ok(closed);
    }
    let beyond = match (closure.policy, significance) {
        (Policy::Significance(most), Some(sigmas)) => sigmas > most,
        (Policy::AddFacet, _) => true,
        _ => false,
    };
    if beyond {
        closed.add_facet(gap, merge_rad);
        return Ok(closed);
    }
    let open = Fault::Open { defect, limit: closure.limit };
    if defect > closure.limit {
        return Err(open);
    }
    let variances: Vec<f64> = match &image.sigmas {
        Some(sigmas) => sigmas.iter().map(|s| (s / total).powi(2)).collect(),
        None => image.areas.iter().map(|a| a / total).collect(),
    };
    let shares: Vec<f64> = image.areas.iter().map(|a| a / total).collect();
    let keep = if closure.keep.is_nan() { 0.0 } else { closure.keep.clamp(0.0, 1.0) };
    let changes = least_change(&image.normals, &shares, &variances, keep).ok_or(open)?;
    closed.areas = shares.iter().zip(&changes).map(|(a, d)| (a + d) * total).collect();
    let squares: f64 = shares.iter().zip(&changes).map(|(a, d)| (d / a).powi(2)).sum();
    closed.change = (squares / shares.len() as f64).sqrt();
    Ok(closed)
}

impl Closed {
    /// Adds the facet that closes the image, or its area to the facet that is already there.
    fn add_facet(&mut self, gap: DVec3, merge_rad: f64) {
        let (normal, area) = (-gap.normalize(), gap.length());
        match self.normals.iter().position(|n| (*n - normal).length() < merge_rad) {
            Some(place) => {
                self.areas[place] += area;
                self.unobserved = Some(place);
            }
            None => {
                self.unobserved = Some(self.normals.len());
                self.normals.push(normal);
                self.areas.push(area);
            }
        }
    }
}

/// The changes of areas; `None` if none was found that closes the image.
fn least_change(normals: &[DVec3], areas: &[f64], variances: &[f64], keep: f64) -> Option<Vec<f64>> {
    let most = |i: usize| (1.0 - keep) * areas[i];
    let change = |i: usize, x: DVec3| -(variances[i] * normals[i].dot(x)).min(most(i));
    let gap = |x: DVec3| (0..areas.len()).map(|i| (areas[i] + change(i, x)) * normals[i]).sum::<DVec3>();
    // its gradient is minus the gap: quadratic where an area is free, linear where it has met its limit
    let value = |x: DVec3| {
        let term = |i: usize| {
            let (along, d) = (normals[i].dot(x), change(i, x));
            -(areas[i] + d) * along - 0.5 * d * d / variances[i]
        };
        (0..areas.len()).map(term).sum::<f64>()
    };
    let rim = DMat3::IDENTITY * (f64::EPSILON * variances.iter().sum::<f64>());
    let mut x = DVec3::ZERO;
    for _ in 0..STEPS {
        let (open, here) = (gap(x), value(x));
        if open.length() <= CLOSED {
            break;
        }
        let free = (0..areas.len()).filter(|&i| -change(i, x) < most(i));
        let (normals, variances): (Vec<DVec3>, Vec<f64>) = free.map(|i| (normals[i], variances[i])).unzip();
        let step = (spread(&normals, variances.into_iter()) + rim).inverse() * open;
        let tried = (0..60).map(|k| x + step * 0.5_f64.powi(k));
        // at the end of the value's digits the gap decides
        let better = |next: &DVec3| value(*next) < here || gap(*next).length() < 0.5 * open.length();
        let Some(next) = tried.into_iter().find(better) else { break };
        x = next;
    }
    // what is left after rounding has no say in the shape
    (gap(x).length() <= 1e-12).then(|| (0..areas.len()).map(|i| change(i, x)).collect())
}

fn moment(normals: &[DVec3], areas: &[f64]) -> DVec3 {
    normals.iter().zip(areas).map(|(&n, &a)| n * a).sum()
}

fn spread(normals: &[DVec3], weights: impl Iterator<Item = f64>) -> DMat3 {
    let outer = |n: DVec3| DMat3::from_cols(n * n.x, n * n.y, n * n.z);
    normals.iter().zip(weights).fold(DMat3::ZERO, |sum, (&n, w)| sum + outer(n) * w)
}
