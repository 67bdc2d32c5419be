//! An assembly fitted to light curves: Levenberg-Marquardt over all parameters of all parts, with analytic derivatives.
//!
//! The first part's centre is held: a shift of the whole changes no light. Damping follows Nielsen 1999 (IMM-REP-1999-05,
//! eq 2.21), scaled by the diagonal (Marquardt 1963, SIAM J. 11, 431).

use super::part::{PARAMETERS, Part};
use super::render::{Force, Renderer};
use super::tie::{Row, Tie};
use crate::inversion::cholesky::Cholesky;
use crate::object::matter::Material;
use glam::DVec3;

/// Parameters of the first part that are held.
const HELD: usize = 3;
/// Longest steps: of a centre in half sizes, of an attitude \[rad\], of a log size.
const STEP: (f64, f64, f64) = (0.5, 0.25, 0.7);
/// Least and greatest half size, as shares of the typical one.
const SIZES: (f64, f64) = (1e-3, 1e3);
/// Ridge of the covariance, as a share of the diagonal.
const RIDGE: f64 = 1e-12;

/// What is fitted.
#[derive(Debug, Clone)]
pub(super) struct Data<'a> {
    pub directions: Vec<(DVec3, DVec3)>,
    pub flux: Vec<f64>,
    /// 1/sigma.
    pub weight: Vec<f64>,
    pub material: &'a Material,
    /// Typical half size \[m\].
    pub scale: f64,
    /// Regularities that hold.
    pub ties: Vec<Tie>,
    /// Standard deviation of the ties \[rad; typical half sizes\].
    pub slack: f64,
}

/// An assembly and how well it fits.
#[derive(Debug, Clone)]
pub(super) struct Model {
    pub parts: Vec<Part>,
    pub chi2: f64,
}

/// Free parameters of so many parts without ties.
pub(super) fn free(parts: usize) -> usize {
    (PARAMETERS * parts).saturating_sub(HELD)
}

/// The normal equations at one state.
pub(super) struct System {
    /// J'J, lower half row by row.
    normal: Vec<Vec<f64>>,
    /// J'r.
    gradient: Vec<f64>,
    chi2: f64,
}

impl System {
    fn factor(&self, damping: f64) -> Option<Cholesky> {
        let greatest = self.normal.iter().filter_map(|row| row.last()).copied().fold(0.0, f64::max);
        let floor = greatest * 1e-14 + f64::MIN_POSITIVE;
        Cholesky::of(self.normal.len(), 0.0, |i, j| {
            let value = self.normal[i][j];
            if i == j { value + damping * value.max(floor) + floor * 1e-3 } else { value }
        })
    }

    /// The same with conditions that hold to within `sd`.
    #[must_use]
    pub fn with(mut self, rows: &[Row], sd: f64) -> Self {
        for tied in rows {
            let row: Vec<f64> = tied.slope.iter().skip(HELD).map(|d| d / sd).collect();
            for ((i, d), line) in row.iter().enumerate().zip(&mut self.normal) {
                self.gradient[i] -= d * tied.residual / sd;
                line.iter_mut().zip(&row).for_each(|(sum, e)| *sum += d * e);
            }
        }
        self
    }

    /// The step to the least chi^2 of the linearised problem.
    pub fn step(&self) -> Option<Vec<f64>> {
        self.factor(RIDGE).map(|factor| factor.solve(self.gradient.clone()))
    }

    /// Inverse of J'J: the covariance of the free parameters.
    pub fn covariance(&self) -> Option<Vec<Vec<f64>>> {
        self.factor(RIDGE).map(|factor| factor.inverse())
    }
}

impl Data<'_> {
    /// The data at the epochs to be kept.
    pub fn thinned(&self, keep: impl Fn(usize) -> bool) -> Self {
        fn pick<T: Copy>(all: &[T], keep: &impl Fn(usize) -> bool) -> Vec<T> {
            all.iter().enumerate().filter(|(k, _)| keep(*k)).map(|(_, v)| *v).collect()
        }
        Self {
            directions: pick(&self.directions, &keep),
            flux: pick(&self.flux, &keep),
            weight: pick(&self.weight, &keep),
            ties: self.ties.clone(),
            ..*self
        }
    }

    /// chi^2 of an assembly, or no less than `enough` once it is that much.
    pub fn chi2(&self, parts: &[Part], enough: f64, renderer: &mut Renderer) -> f64 {
        let rows = self.ties.iter().flat_map(|tie| tie.rows(parts, self.scale));
        let mut sum: f64 = rows.map(|row| (row.residual / self.slack).powi(2)).sum();
        for ((directions, flux), weight) in self.directions.iter().zip(&self.flux).zip(&self.weight) {
            let light = renderer.light(parts, self.material, *directions, None);
            sum += ((flux - light) * weight).powi(2);
            if sum >= enough {
                break;
            }
        }
        if sum.is_finite() { sum } else { f64::INFINITY }
    }

    /// The linearised problem.
    pub fn system(&self, parts: &[Part], renderer: &mut Renderer) -> System {
        let count = free(parts.len());
        let mut normal: Vec<Vec<f64>> = (0..count).map(|i| vec![0.0; i + 1]).collect();
        let mut gradient = vec![0.0; count];
        let mut forces = vec![Force::default(); parts.len()];
        let mut row = Vec::with_capacity(count + HELD);
        let mut chi2 = 0.0;
        let mut add = |row: &[f64], residual: f64| {
            chi2 += residual * residual;
            for ((i, d), line) in row.iter().enumerate().zip(&mut normal) {
                gradient[i] += d * residual;
                line.iter_mut().zip(row).for_each(|(sum, e)| *sum += d * e);
            }
        };
        for ((directions, flux), weight) in self.directions.iter().zip(&self.flux).zip(&self.weight) {
            let light = renderer.light(parts, self.material, *directions, Some(&mut forces));
            row.clear();
            row.extend(forces.iter().flat_map(|force| force.to_array()).skip(HELD).map(|d| d * weight));
            add(&row, (flux - light) * weight);
        }
        for tied in self.ties.iter().flat_map(|tie| tie.rows(parts, self.scale)) {
            row.clear();
            row.extend(tied.slope.iter().skip(HELD).map(|d| d / self.slack));
            add(&row, -tied.residual / self.slack);
        }
        System { normal, gradient, chi2 }
    }

    /// From `parts` downhill for at most `rounds`, until a round lowers chi^2 by less than `least` of it.
    pub fn descend(&self, parts: &[Part], rounds: usize, least: f64, renderer: &mut Renderer) -> Model {
        let mut parts = parts.to_vec();
        let mut system = self.system(&parts, renderer);
        let (mut damping, mut growth) = (1e-2, 2.0);
        for _ in 0..rounds {
            let Some(factor) = system.factor(damping) else { break };
            let step = factor.solve(system.gradient.clone());
            let next = self.stepped(&parts, &step);
            let chi2 = self.chi2(&next, system.chi2, renderer);
            if chi2 < system.chi2 {
                let predicted: f64 = step.iter().zip(&system.gradient).map(|(s, g)| s * g).sum();
                let ratio = (system.chi2 - chi2) / predicted.max(f64::MIN_POSITIVE);
                let slow = system.chi2 - chi2 < least * system.chi2;
                damping = (damping * (1.0 - (2.0 * ratio.min(1.0) - 1.0).powi(3)).max(0.1)).max(1e-12);
                growth = 2.0;
                parts = next;
                system = self.system(&parts, renderer);
                if slow {
                    break;
                }
            } else {
                damping *= growth;
                growth *= 2.0;
                if damping > 1e8 {
                    break;
                }
            }
        }
        let chi2 = if system.chi2.is_finite() { system.chi2 } else { f64::INFINITY };
        Model { parts, chi2 }
    }

    /// A step of the free parameters, each part's as long as it may be.
    pub fn stepped(&self, parts: &[Part], step: &[f64]) -> Vec<Part> {
        let mut all = [0.0; HELD].iter().chain(step).copied();
        let mut out = Vec::with_capacity(parts.len());
        for part in parts {
            let step: [f64; PARAMETERS] = std::array::from_fn(|_| all.next().unwrap_or(0.0));
            let length = |k: usize| DVec3::new(step[k], step[k + 1], step[k + 2]);
            let reach = STEP.0 * part.half.max_element();
            let excess =
                [length(0).length() / reach, length(3).length() / STEP.1, length(6).abs().max_element() / STEP.2];
            let shorter = 1.0 / excess.into_iter().fold(1.0, f64::max);
            let mut moved = part.moved(&step.map(|s| s * shorter));
            let (low, high) = (DVec3::splat(SIZES.0 * self.scale), DVec3::splat(SIZES.1 * self.scale));
            moved.half = moved.half.clamp(low, high);
            out.push(moved);
        }
        out
    }
}
