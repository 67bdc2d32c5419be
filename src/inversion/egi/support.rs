//! Which facets the data demand: fewer by prediction and refit, more by the dual certificate.
//!
//! With H = J'J at a minimum, chi^2 rises on deletion of facet i by about 1/(H^-1)_ii (of its log area), and on merging i
//! with j by d'(C H^-1 C')^-1 d, d their distance on the sphere and C its derivative (Wald 1943, Trans. AMS 54, 426). Cheap
//! ones are tried and refitted; a change stays if chi^2 rises by less than its three parameters are worth, 3 ln T (Schwarz
//! 1978, Ann. Stat. 6, 461).
//!
//! A new facet at n lowers chi^2 by at least eta(n)^2, eta = g(n)'r/||g(n)||: the dual certificate of a measure on the sphere
//! (Bredies & Pikkarainen 2013, ESAIM COCV 19, 190). When all other parameters follow it is g'r/||(1 - P) g||, P the projector
//! on the columns of J (Rao 1948, Proc. Camb. Phil. Soc. 44, 50): this one sees two facets taken for one. What is added slides to
//! its place (Denoyelle et al. 2020, Inverse Problems 36, 014001).

use super::fit::{Fit, System};
use crate::inversion::cholesky::dot;
use crate::inversion::nnls::Columns;
use crate::inversion::sphere::{angle, fibonacci, tangents};
use crate::object::convex::Facet;
use faer::{Mat, MatRef};
use glam::DVec3;

/// Facets further apart than this are not merged \[rad\].
const MERGE: f64 = 1.0;
/// Trials of one kind before giving up.
const TRIALS: usize = 4;
/// Rounds of a refit.
const ROUNDS: usize = 25;
/// A column shorter than this share of the longest gives no flux.
pub(super) const NO_FLUX: f64 = 1e-6;
/// Changes tried whatever their prediction, on data better than [`SHARP`].
const BLIND: usize = 8;
/// Signal to noise above which predictions are not trusted.
const SHARP: f64 = 1e4;
/// A reach that leaves no direction out \[rad\].
pub(super) const ANYWHERE: f64 = std::f64::consts::PI;
/// Facets nearer than this to one that is there are not new \[rad\].
const SAME: f64 = 1e-3;

/// Directions where facets are looked for, with their flux.
pub(super) struct Grid {
    pub normals: Vec<DVec3>,
    /// Flux of 1 m^2, curves' scales not in it.
    pub columns: Columns,
}

impl Grid {
    pub fn new(fit: &Fit, count: usize) -> Self {
        let normals: Vec<DVec3> = fibonacci(count).collect();
        let column = |&n: &DVec3| fit.view.epochs.column(n, &fit.view.material, 0.0);
        let columns = Columns::new(fit.problem.len(), normals.iter().map(column));
        Self { normals, columns }
    }

    /// Columns times weight and scale.
    pub fn weighted(&self, fit: &Fit) -> Columns {
        let factor = fit.factors();
        let column = |j| self.columns.column(j).iter().zip(&factor).map(|(g, f)| g * f).collect();
        Columns::new(factor.len(), (0..self.normals.len()).map(column))
    }
}

/// The certificate of every grid direction.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Certificate {
    /// Length of the weighted column: significance of 1 m^2.
    pub norm: f64,
    /// The part of it that nothing else in the fit can take over.
    pub own: f64,
    /// eta, all else held.
    pub held: f64,
    /// eta, all else following.
    pub following: f64,
}

/// Share of a column, squared, below which its own part is rounding.
const ROUNDING: f64 = 1e-8;

pub(super) fn certificates(fit: &Fit, grid: &Grid) -> Vec<Certificate> {
    let System { residual, mut jacobian, gradient, normal } = fit.system();
    let count = fit.problem.len();
    let factor = fit.factors();
    let closure = fit.closure_weight();
    let system = System { residual, jacobian: Mat::new(), normal, gradient };
    let Some(cholesky) = system.factor(1e-12) else { return vec![Certificate::default(); grid.normals.len()] };
    let closing = jacobian.get(count.., ..).to_owned();
    for j in 0..jacobian.ncols() {
        jacobian.col_as_slice_mut(j).iter_mut().zip(&factor).for_each(|(v, f)| *v *= f);
    }
    let columns = MatRef::from_column_major_slice(grid.columns.data(), count, grid.normals.len());
    let normals = Mat::from_fn(3, grid.normals.len(), |axis, j| closure * grid.normals[j][axis]);
    // what everything else in the fit takes over of each column
    let mut taken = jacobian.get(..count, ..).transpose() * columns + closing.transpose() * normals;
    cholesky.forward_all(taken.as_mut());
    let weighted: Vec<f64> = system.residual.iter().zip(&factor).map(|(r, f)| r * f).collect();
    let along = grid.columns.products(&weighted);
    let squares: Vec<f64> = factor.iter().map(|f| f * f).collect();
    let mut lowered = system.gradient.clone();
    cholesky.forward(&mut lowered);
    let rows = DVec3::from_slice(&[&system.residual[count..], &[0.0; 3]].concat());
    let certificate = |(j, &n): (usize, &DVec3)| {
        let column = grid.columns.column(j);
        let data = column.iter().zip(&squares).map(|(g, f)| g * g * f).sum::<f64>();
        let taken = taken.col_as_slice(j);
        let whole = data + closure * closure;
        let numerator = along[j] + closure * n.dot(rows);
        let own = (whole - dot(taken, taken)).max(0.0).sqrt();
        let seen = own * own > ROUNDING * whole;
        let norm = data.sqrt();
        Certificate {
            norm,
            own: if seen { own } else { 0.0 },
            held: if norm > 0.0 { along[j] / norm } else { 0.0 },
            following: if seen { (numerator - dot(taken, &lowered)) / own } else { 0.0 },
        }
    };
    grid.normals.iter().enumerate().map(certificate).collect()
}

/// Merge facets nearer than `within` \[rad\] by the sum of their vectors, the nearest first: the sum of all stays.
pub(in crate::inversion) fn cluster(facets: &mut Vec<Facet>, within: f64) {
    loop {
        let mut nearest = (within, None);
        for (i, f) in facets.iter().enumerate() {
            for (j, g) in facets.iter().enumerate().skip(i + 1) {
                let distance = angle(f.normal, g.normal);
                if distance < nearest.0 {
                    nearest = (distance, Some((i, j)));
                }
            }
        }
        let Some((i, j)) = nearest.1 else { return };
        facets[i] = merged(facets[i], facets[j]);
        facets.swap_remove(j);
    }
}

fn merged(a: Facet, b: Facet) -> Facet {
    let sum = a.normal * a.area + b.normal * b.area;
    Facet { normal: sum.normalize_or(a.normal), area: sum.length() }
}

/// A facet less.
#[derive(Debug, Clone, Copy)]
enum Change {
    Delete(usize),
    Merge(usize, usize),
}

impl Change {
    fn places(self) -> [usize; 2] {
        match self {
            Change::Delete(i) => [i, i],
            Change::Merge(i, j) => [i, j],
        }
    }

    fn apply(self, facets: &mut [Facet]) {
        let [i, j] = self.places();
        if let Change::Merge(..) = self {
            facets[i] = merged(facets[i], facets[j]);
        }
        facets[j].area = 0.0;
    }
}

/// Changes by their predicted cost, the cheapest first.
fn changes(fit: &Fit) -> Vec<(f64, Change)> {
    let Some(covariance) = fit.system().covariance() else { return Vec::new() };
    let mut out: Vec<(f64, Change)> =
        (0..fit.facets.len()).map(|i| (1.0 / covariance[3 * i][3 * i], Change::Delete(i))).collect();
    let frames: Vec<[DVec3; 2]> = fit.facets.iter().map(|f| tangents(f.normal)).collect();
    for i in 0..fit.facets.len() {
        for j in i + 1..fit.facets.len() {
            let (a, b) = (fit.facets[i].normal, fit.facets[j].normal);
            if a.dot(b) < libm::cos(MERGE) {
                continue;
            }
            let middle = tangents((a + b).normalize_or(a));
            // derivative of the distance in the middle's frame with respect to the moves of i and j
            let row =
                |e: DVec3| [frames[i][0].dot(e), frames[i][1].dot(e), -frames[j][0].dot(e), -frames[j][1].dot(e)];
            let rows = middle.map(row);
            let index = [3 * i + 1, 3 * i + 2, 3 * j + 1, 3 * j + 2];
            let product = |p: &[f64; 4], q: &[f64; 4]| {
                let pairs = (0..4).flat_map(|k| (0..4).map(move |l| (k, l)));
                pairs.map(|(k, l)| p[k] * q[l] * covariance[index[k]][index[l]]).sum::<f64>()
            };
            let (xx, xy, yy) =
                (product(&rows[0], &rows[0]), product(&rows[0], &rows[1]), product(&rows[1], &rows[1]));
            let d = middle.map(|e| (a - b).dot(e));
            let cost = (yy * d[0] * d[0] - 2.0 * xy * d[0] * d[1] + xx * d[1] * d[1]) / (xx * yy - xy * xy);
            out.push((cost, Change::Merge(i, j)));
        }
    }
    out.retain(|(cost, _)| *cost >= 0.0);
    out.sort_by(|a, b| a.0.total_cmp(&b.0));
    out
}

/// The state with changes made and refitted.
fn after<'a>(fit: &Fit<'a>, changes: &[Change], least: f64) -> Fit<'a> {
    let mut next = fit.clone();
    changes.iter().for_each(|change| change.apply(&mut next.facets));
    next.facets.retain(|f| f.area > 0.0);
    next.descend(least, ROUNDS);
    next
}

/// Take away facets while chi^2 rises by less than `worth` for each.
pub(super) fn simplify(fit: &mut Fit, worth: f64) {
    let least = 0.01 * worth;
    let sharp = fit.problem.snr() > SHARP * worth.sqrt();
    while fit.facets.len() > 1 {
        let cost = fit.cost();
        let all = changes(fit);
        let mut taken = vec![false; fit.facets.len()];
        let mut apart = |change: &Change| {
            let free = change.places().iter().all(|&k| !taken[k]);
            change.places().into_iter().for_each(|k| taken[k] |= free);
            free
        };
        // those that cost next to nothing, all at once
        let cheap: Vec<Change> =
            all.iter().take_while(|c| c.0 < 0.1 * worth).map(|c| c.1).filter(|c| apart(c)).collect();
        if cheap.len() > 1 {
            let next = after(fit, &cheap, least);
            if next.cost() - cost < 0.5 * worth * cheap.len() as f64 && !next.facets.is_empty() {
                *fit = next;
                continue;
            }
        }
        // far from a minimum's parabola predictions mislead: without noise the cheapest are tried whatever they promise
        let certain = if sharp { BLIND } else { 0 };
        let hopeful =
            all.iter().enumerate().take_while(|(k, c)| *k < certain || c.0 < 5.0 * worth).map(|(_, c)| c);
        let hopeful = hopeful.take(TRIALS.max(certain));
        let Some(next) = hopeful.map(|c| after(fit, &[c.1], least)).find(|next| next.cost() - cost < worth) else {
            return;
        };
        *fit = next;
    }
}

/// Add the facet that the data demand most, where chi^2 falls by more than `worth`, no further than `reach` \[rad\] from one that is
/// there; whether one was added.
pub(super) fn extend(fit: &mut Fit, grid: &Grid, worth: f64, reach: f64) -> bool {
    let cost = fit.cost();
    let total = fit.total();
    let mut best: Vec<(f64, f64, DVec3)> = certificates(fit, grid)
        .iter()
        .zip(&grid.normals)
        .filter(|(c, _)| c.following * c.following > 0.3 * worth && c.following > 0.0)
        .map(|(c, &n)| (c.following, c.following / c.own, n))
        .collect();
    best.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut tried: Vec<DVec3> = Vec::new();
    for (_, area, normal) in best {
        if tried.len() >= TRIALS {
            break;
        }
        let near = |n: &DVec3, within: f64| angle(*n, normal) < within;
        let far = reach < ANYWHERE && !fit.facets.iter().any(|f| near(&f.normal, reach));
        if far || tried.iter().any(|n| near(n, 0.3)) || fit.facets.iter().any(|f| near(&f.normal, SAME)) {
            continue;
        }
        tried.push(normal);
        let mut next = fit.clone();
        next.facets.push(Facet { normal, area: if total > 0.0 { area.min(0.2 * total) } else { area } });
        next.descend(0.01 * worth, ROUNDS);
        if cost - next.cost() > worth {
            *fit = next;
            return true;
        }
    }
    false
}
