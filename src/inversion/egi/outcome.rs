//! What a fit proves, and how sure it is.
//!
//! Covariance after Laplace: (J'J)^-1 with weights 1/sigma, closure rows in it where they are conditions (Tarantola 2005,
//! Inverse Problem Theory, sect. 3.2). A facet's direction has the standard deviation of its distance on the sphere, the root of
//! the sum of both tangent variances.
//!
//! Facets nearer than the data resolve come out as one; what that does to the errors is in `spread`, and what a finer image would
//! change about a facet is added. A facet more likely several than one is not claimed; nor is one with others near where its own chance
//! to be several is above 3 %, or that of all facets together above 10 %, for such facets share their area with unseen ones and their errors are no Gaussian's.
//!
//! Where least squares on the grid, which may have any number of facets, explains the data better than the sparse image by
//! what two facets are worth, the body is predicted by the mean of both: many small facets are likelier there than any few, and the mean of
//! models is nearer to the truth than its parts (Hoeting et al. 1999, Stat. Sci. 14, 382).
//!
//! Facets of Lambert's law that are lit and seen at every epoch send s'(sum a n n')o: six numbers, however many they are. Two of them
//! can be exchanged for others without any trace in the data; their variances come out infinite.

use super::fit::Fit;
use super::smooth::{self, Smooth};
use super::spread;
use super::support::{Certificate, Grid, NO_FLUX, certificates, extend};
use super::{Options, grid_of, worth};
use crate::inversion::nnls;
use crate::inversion::observability::effective_rank;
use crate::inversion::sphere::{angle, tangents};
use crate::object::convex::Facet;
use glam::DVec3;

/// A facet as far as the data know it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Normal and area \[m^2\]; areas are relative where the solution is not calibrated.
    pub facet: Facet,
    /// Standard deviation of the area \[m^2\].
    pub area_sd: f64,
    /// Standard deviation of the direction \[rad\]: of the angle between truth and estimate, root mean square.
    pub direction_sd: f64,
    /// Probability that it stands for several facets which the data do not tell apart.
    pub split: f64,
    /// Whether the direction is sure enough to be claimed.
    pub claimed: bool,
}

/// What may be said of the body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Verdict {
    /// The facets that are marked as claimed.
    Facets,
    /// No facet can be claimed: a smooth body explains the data at least as well for its number of parameters.
    Smooth {
        /// The smooth body.
        body: Smooth,
        /// chi^2 of the smooth body.
        chi2: f64,
        /// Facets that the data cannot reject.
        facets: usize,
    },
    /// No facet can be claimed: more and more of them fit better and better.
    Endless {
        /// Facets at which the search stopped.
        facets: usize,
    },
    /// No facet can be claimed: each may be several, or its direction is unsure; many small facets or a smooth body do as well.
    Unresolved {
        /// Facets that do as well.
        facets: usize,
    },
    /// No facet can be claimed: there is no light.
    Dark,
}

/// What the data say about facets in one direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Direction {
    /// Normal.
    pub normal: DVec3,
    /// Whether a facet there would send light to any datum.
    pub observed: bool,
    /// Area \[m^2\] of the least facet there that would have been found; infinite where nothing would tell it from others.
    pub least_area: f64,
}

/// An extended Gaussian image with its proof.
#[derive(Debug, Clone)]
pub struct Solution {
    /// Facets, the largest first.
    pub facets: Vec<Estimate>,
    /// Facets that predict the body best: those of `facets`, split where the data speak for it at all, though not enough to claim it;
    /// where the data speak for many more, half of each and half of the image on a grid.
    pub shape: Vec<Facet>,
    /// What may be claimed.
    pub verdict: Verdict,
    /// Sum of squares of (y - model)/sigma, with robust weights where asked for.
    pub chi2: f64,
    /// What the parameters cost beside chi^2 where solutions are compared: ln det(1 + J'J), each parameter's prior of width 1.
    pub occam: f64,
    /// Data less parameters.
    pub dof: f64,
    /// Greatest dual certificate over the sphere \[sigma\]: no facet that would gain more than its square in chi^2 is missing.
    pub certificate: f64,
    /// The same with all other parameters following.
    pub following: f64,
    /// Certificates at which a facet is demanded \[sigma\].
    pub threshold: f64,
    /// Sum of a n over sum of a, fitted without the condition of closure.
    pub defect: DVec3,
    /// Standard deviation of its length.
    pub defect_sd: f64,
    /// Whether closure was a condition of the facets given.
    pub closed: bool,
    /// Covariance of (log a, two moves on the sphere along [`super::super::sphere::tangents`]) of every facet in turn, then of
    /// log scales of free curves, then of unknowns; infinite on the diagonal where the data leave a parameter open.
    pub covariance: Vec<Vec<f64>>,
    /// Singular values of the flux matrix above the noise: as many numbers the data can tell.
    pub rank: usize,
    /// Root mean square of y/sigma.
    pub snr: f64,
    /// The sphere, direction by direction.
    pub map: Vec<Direction>,
    /// Share of the sphere whose facets send no light to any datum.
    pub unobserved: f64,
    /// Scale of every curve.
    pub scales: Vec<f64>,
    /// Whether a curve's scale was known: otherwise areas are relative.
    pub calibrated: bool,
    /// Unknowns, and the standard deviation of each.
    pub unknowns: Vec<(f64, f64)>,
    /// Gaps dropped.
    pub dropped: usize,
    /// Data further than 3 sigma from the model.
    pub outliers: usize,
    /// Residuals y - model in sigma.
    pub residual: Vec<f64>,
}

impl Solution {
    /// Facets alone, claimed or not.
    pub fn image(&self) -> Vec<Facet> {
        self.facets.iter().map(|e| e.facet).collect()
    }

    /// chi^2 over degrees of freedom; 1 where the errors are what they are said to be.
    pub fn reduced(&self) -> f64 {
        self.chi2 / self.dof.max(1.0)
    }
}

/// Beyond this an outlier \[sigma\].
const OUTLIER: f64 = 3.0;
/// Variance over the one with all other parameters held, from where on the former is rounding.
const SINGULAR: f64 = 1e11;
/// Directions of the flux matrix whose rank is told.
const RANK_DIRECTIONS: usize = 500;

/// Probability of being several up to which a facet is claimed.
const RESOLVED: f64 = 0.5;
/// The same where another facet is nearer than [`CROWD`].
const RESOLVED_IN_A_CROWD: f64 = 0.03;
/// Share of all facets expected to be several above which none of a crowd is claimed.
const SUSPECT: f64 = 0.1;
/// Facets nearer than this may have shared a third between them \[rad\].
const CROWD: f64 = 1.05;
/// Facets' worth of chi^2 by which the sparse image must lack for the mean with that of the grid to be taken.
const LACK: f64 = 2.0;
/// Facets expected to be several above which a finer image is looked for.
const SEVERAL: f64 = 2.0;
/// What each of three parameters must lower chi^2 by for a facet to be split in the finer image.
const SPLIT: f64 = 3.0;
/// How far from a facet the other half of a split may arise \[rad\].
const REACH: f64 = 0.35;

pub(super) fn conclude(mut fit: Fit, kept: Option<&Grid>, options: &Options) -> Solution {
    fit.facets.sort_by(|a, b| b.area.total_cmp(&a.area));
    let problem = fit.problem;
    let mut own = None;
    let grid = grid_of(&fit, kept, &mut own, options.grid);
    let chi2 = fit.chi2();
    let mut verdict = verdict(&fit, chi2, options, grid);
    let (covariance, split, fine) = covariance(&fit, grid, options);
    let variance =
        |k: usize| covariance.get(k).and_then(|row| row.get(k)).copied().unwrap_or(f64::INFINITY).max(0.0);
    let several: f64 = split.iter().sum();
    let shape = match several > SEVERAL {
        true => predicted(&fit, fine, grid, options),
        false => fine,
    };
    let certificates = certificates(&fit, grid);
    let greatest = |of: fn(&Certificate) -> f64| certificates.iter().map(of).fold(0.0, f64::max);
    let threshold = worth(problem, options, 1.0).sqrt();
    let map = map(grid, &certificates, threshold);
    let unobserved = map.iter().filter(|d| !d.observed).count() as f64 / map.len().max(1) as f64;
    let (defect, defect_sd) = defect(&fit);
    let weighted = fit.residual(0.0);
    let scaled = weighted.iter().zip(fit.weights.iter()).zip(&problem.sigma).map(|((r, w), sigma)| r / w / sigma);
    let residual: Vec<f64> = scaled.collect();
    let suspect = several > SUSPECT * fit.facets.len() as f64;
    let estimate = |(i, &facet): (usize, &Facet)| {
        let direction_sd = (variance(3 * i + 1) + variance(3 * i + 2)).sqrt();
        let area_sd = facet.area * variance(3 * i).sqrt();
        let split = split.get(i).copied().unwrap_or(0.0);
        let crowd = fit.facets.iter().enumerate().any(|(j, f)| j != i && angle(f.normal, facet.normal) < CROWD);
        let resolved = if crowd { !suspect && split <= RESOLVED_IN_A_CROWD } else { split <= RESOLVED };
        let claimed = verdict == Verdict::Facets && direction_sd <= options.claim && resolved;
        Estimate { facet, area_sd, direction_sd, split, claimed }
    };
    let facets: Vec<Estimate> = fit.facets.iter().enumerate().map(estimate).collect();
    if verdict == Verdict::Facets && !facets.iter().any(|e| e.claimed) {
        verdict = Verdict::Unresolved { facets: facets.len() };
    }
    let first = fit.parameters() - fit.values.len();
    Solution {
        facets,
        shape,
        verdict,
        chi2,
        occam: fit.system().occam(problem.len()),
        dof: problem.len() as f64 - fit.parameters() as f64,
        certificate: greatest(|c| c.held),
        following: greatest(|c| c.following),
        threshold,
        defect,
        defect_sd,
        closed: fit.closed,
        rank: effective_rank(&fit.view.epochs, &fit.view.material, RANK_DIRECTIONS, problem.snr()),
        snr: problem.snr(),
        map,
        unobserved,
        scales: fit.scales.clone(),
        calibrated: problem.calibrated,
        unknowns: fit.values.iter().enumerate().map(|(k, &v)| (v, variance(first + k).sqrt())).collect(),
        dropped: problem.dropped,
        outliers: residual.iter().filter(|z| z.abs() > OUTLIER).count(),
        residual,
        covariance,
    }
}

/// Covariance of all parameters with unresolved splits in it, their probabilities, and the finer image; variances that are but
/// rounding are infinite. What the finer image would change about a facet counts as an error of it.
fn covariance(fit: &Fit, grid: &Grid, options: &Options) -> (Vec<Vec<f64>>, Vec<f64>, Vec<Facet>) {
    let system = fit.system();
    let (mut covariance, split) = match spread::covariance(fit, &system) {
        Some(found) => found,
        None => (system.covariance().unwrap_or_default(), Vec::new()),
    };
    let fine = if split.iter().sum::<f64>() > SEVERAL { fine(fit, grid, options) } else { fit.facets.clone() };
    let mut sums = vec![DVec3::ZERO; fit.facets.len()];
    for f in &fine {
        let nearest = (0..sums.len()).min_by(|&a, &b| {
            angle(fit.facets[a].normal, f.normal).total_cmp(&angle(fit.facets[b].normal, f.normal))
        });
        if let Some(sum) = nearest.and_then(|k| sums.get_mut(k)) {
            *sum += f.normal * f.area;
        }
    }
    for (i, (facet, sum)) in fit.facets.iter().zip(sums).enumerate() {
        let length = sum.length();
        let [e1, e2] = tangents(facet.normal);
        let change = match length > 0.0 {
            true => [libm::log(length / facet.area), sum.dot(e1) / length, sum.dot(e2) / length],
            false => [1.0, 0.0, 0.0],
        };
        for (row, a) in covariance.iter_mut().skip(3 * i).zip(change) {
            row.iter_mut().skip(3 * i).zip(change).for_each(|(v, b)| *v += a * b);
        }
    }
    for (k, row) in covariance.iter_mut().enumerate() {
        let known = |v: &f64| *v * system.normal[(k, k)] < SINGULAR;
        if let Some(variance) = row.get_mut(k).filter(|v| !known(v)) {
            *variance = f64::INFINITY;
        }
    }
    (covariance, split, fine)
}

/// The image with every split of a facet that lowers chi^2 by more than [`SPLIT`] a parameter.
fn fine(fit: &Fit, grid: &Grid, options: &Options) -> Vec<Facet> {
    let mut fine = fit.clone();
    let most = options.most.min(fit.problem.len() / 4 + 1).min(fit.facets.len() * 5 / 4 + 1);
    while fine.facets.len() < most && extend(&mut fine, grid, 3.0 * SPLIT, REACH) {}
    fine.facets
}

/// The sparse image, or its mean with that of least squares on the grid where it lacks too much.
fn predicted(fit: &Fit, sparse: Vec<Facet>, grid: &Grid, options: &Options) -> Vec<Facet> {
    let data: Vec<f64> = fit.problem.y.iter().zip(fit.weights.iter()).map(|(y, w)| y * w).collect();
    let Ok(dense) = nnls::solve(&grid.weighted(fit), &data, &[]) else { return sparse };
    let mut other = fit.clone();
    other.facets = sparse;
    if other.chi2() - 2.0 * dense.objective <= LACK * worth(fit.problem, options, 1.0) {
        return other.facets;
    }
    other.facets.extend(dense.support.iter().map(|&j| Facet { normal: grid.normals[j], area: dense.x[j] }));
    other.facets.iter_mut().for_each(|f| f.area *= 0.5);
    other.facets
}

fn map(grid: &Grid, certificates: &[Certificate], threshold: f64) -> Vec<Direction> {
    let brightest = certificates.iter().map(|c| c.norm).fold(0.0, f64::max);
    let direction = |(&normal, c): (&DVec3, &Certificate)| {
        let observed = c.norm > NO_FLUX * brightest;
        Direction { normal, observed, least_area: if observed { threshold / c.own } else { f64::INFINITY } }
    };
    grid.normals.iter().zip(certificates).map(direction).collect()
}

/// Closure defect of the same facets refitted without that condition, and its standard deviation.
fn defect(fit: &Fit) -> (DVec3, f64) {
    let mut free = fit.clone();
    free.closed = false;
    free.descend(1e-6, 100);
    let total = free.total();
    let Some(covariance) = free.system().covariance().filter(|_| total > 0.0) else {
        return (DVec3::ZERO, f64::INFINITY);
    };
    let moves: Vec<DVec3> = free
        .facets
        .iter()
        .flat_map(|f| {
            let [e1, e2] = tangents(f.normal);
            [f.normal, e1, e2].map(|v| v * f.area)
        })
        .collect();
    let pairs =
        moves.iter().enumerate().flat_map(|(i, a)| moves.iter().enumerate().map(move |(j, b)| (i, j, a.dot(*b))));
    let variance: f64 = pairs.map(|(i, j, product)| product * covariance[i][j]).sum();
    (free.moment() / total, variance.max(0.0).sqrt() / total)
}

fn verdict(fit: &Fit, chi2: f64, options: &Options, grid: &Grid) -> Verdict {
    let facets = fit.facets.len();
    if facets == 0 {
        return Verdict::Dark;
    }
    if let Some((body, chi2)) = smooth::preferred(&smooth::fits(fit, grid), chi2, facets, fit.problem) {
        return Verdict::Smooth { body, chi2, facets };
    }
    match facets >= options.most.min(fit.problem.len() / 4 + 1) {
        true => Verdict::Endless { facets },
        false => Verdict::Facets,
    }
}
