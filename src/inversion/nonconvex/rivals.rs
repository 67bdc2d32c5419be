//! Assemblies that chi^2 alone does not tell from the best, and how far they differ.

use super::fit::{Data, Model};
use super::metrics;
use super::part::{Part, Triangle};
use super::render::Renderer;
use super::search::{are_alike, distinct};
use glam::DVec3;
use rayon::prelude::*;

/// Standard deviations of chi^2 itself within which fits count as equally good.
pub(super) const NOISE: f64 = 3.0;
/// Rounds of the last fits, and the share of chi^2 that ends them.
pub(super) const LAST: (usize, f64) = (100, 1e-7);
/// The same of rivals.
const REFIT: (usize, f64) = (40, 1e-5);
/// Rivals that are listed at most.
pub const RIVALS: usize = 12;
/// Columns and points of the comparison of rivals.
const COMPARE: (usize, usize) = (4096, 800);
/// Points a side of the grid that finds how much of a panel is exposed.
const GRID: usize = 64;

/// An assembly that fits as well.
#[derive(Debug, Clone, PartialEq)]
pub struct Alternative {
    /// Parts.
    pub parts: Vec<Part>,
    /// chi^2 of all data.
    pub chi2: f64,
    /// Volume of the union \[m^3\].
    pub volume: f64,
    /// Normals and exposed areas \[m^2\] of its panels.
    pub panels: Vec<(DVec3, f64)>,
    /// Chamfer distance from the best over the diagonal, centres of mass on each other.
    pub chamfer: f64,
}

/// How far the assemblies that fit differ.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Spread {
    /// Least and greatest volume \[m^3\].
    pub volume: (f64, f64),
    /// Least and greatest sum of exposed panel areas \[m^2\].
    pub panels: (f64, f64),
    /// Mean Chamfer distance of two of them over the diagonal.
    pub chamfer_mean: f64,
    /// The greatest.
    pub chamfer_most: f64,
}

/// Surfaces of parts.
pub(super) fn triangles(parts: &[Part]) -> Vec<Vec<Triangle>> {
    parts.iter().map(|part| part.triangles().to_vec()).collect()
}

/// Simpler assemblies that are asked for: one part less, or one box around two, as a plate through a bus in place of two panels.
fn variants(parts: &[Part]) -> Vec<Vec<Part>> {
    let rest = |out: &[usize]| -> Vec<Part> {
        parts.iter().enumerate().filter(|(k, _)| !out.contains(k)).map(|(_, p)| *p).collect()
    };
    let mut all: Vec<Vec<Part>> = (0..parts.len()).map(|k| rest(&[k])).collect();
    for (i, a) in parts.iter().enumerate() {
        for (j, b) in parts.iter().enumerate().skip(i + 1) {
            let mut joined = rest(&[i, j]);
            joined.push(a.around(b));
            all.push(joined);
        }
    }
    all.retain(|parts| !parts.is_empty());
    all
}

/// Other assemblies met, and variants, that fit all data as well as the chosen one, but for noise: those with no more parts first.
pub(super) fn rivals(data: &Data, chosen: &Model, levels: Vec<Vec<Model>>, trained: usize) -> Vec<Model> {
    let noise = |count: usize| NOISE * (2.0 * count as f64).sqrt();
    let bound = chosen.chi2 + noise(data.flux.len()) * (chosen.chi2 / data.flux.len().max(1) as f64).max(1.0);
    let factor = trained as f64 / data.flux.len().max(1) as f64;
    // on the training data the first sieve is wider
    let near = |m: &Model| m.chi2 <= 1.5 * bound * factor + noise(trained);
    let met = levels.into_iter().flat_map(|level| level.into_iter().filter(near).take(RIVALS));
    let asked = variants(&chosen.parts).into_iter().map(|parts| Model { parts, chi2: f64::INFINITY });
    let all: Vec<Model> = met.chain(asked).collect();
    let refit = |renderer: &mut Renderer, m: Model| data.descend(&m.parts, REFIT.0, REFIT.1, renderer);
    let fitted: Vec<Model> = all.into_par_iter().map_init(Renderer::default, refit).collect();
    let mut out = distinct(fitted.into_iter().filter(|m| m.chi2 <= bound).collect());
    out.retain(|m| !are_alike(m, chosen));
    out.sort_by_key(|m| m.parts.len() > chosen.parts.len());
    out.truncate(RIVALS);
    out
}

/// The list of alternatives, the best first, and how far they differ.
pub(super) fn compared(best: Model, rivals: Vec<Model>) -> (Vec<Alternative>, Spread) {
    let all: Vec<Model> = std::iter::once(best).chain(rivals).collect();
    let meshes: Vec<Vec<Vec<Triangle>>> = all.iter().map(|m| triangles(&m.parts)).collect();
    let apart = |a: &Vec<Vec<Triangle>>, b: &Vec<Vec<Triangle>>| {
        metrics::distance(a, &metrics::aligned(a, b, COMPARE.0), COMPARE.1).chamfer
    };
    let pairs = meshes.iter().enumerate().flat_map(|(k, a)| meshes.iter().skip(k + 1).map(move |b| (a, b)));
    let distances: Vec<f64> = pairs.map(|(a, b)| apart(a, b)).collect();
    let alternative = |(k, model): (usize, &Model)| Alternative {
        parts: model.parts.clone(),
        chi2: model.chi2,
        volume: metrics::bulk(&meshes[k], COMPARE.0).volume,
        panels: panels(&model.parts),
        // the first pairs are those with the best
        chamfer: k.checked_sub(1).and_then(|k| distances.get(k)).copied().unwrap_or(0.0),
    };
    let list: Vec<Alternative> = all.iter().enumerate().map(alternative).collect();
    let range = |of: &dyn Fn(&Alternative) -> f64| {
        list.iter().map(of).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)))
    };
    let spread = Spread {
        volume: range(&|a| a.volume),
        panels: range(&|a| a.panels.iter().map(|p| p.1).fold(0.0, |sum, area| sum + area)),
        chamfer_mean: distances.iter().sum::<f64>() / distances.len().max(1) as f64,
        chamfer_most: distances.iter().copied().fold(0.0, f64::max),
    };
    (list, spread)
}

/// Normal and exposed area of each thin part.
fn panels(parts: &[Part]) -> Vec<(DVec3, f64)> {
    let thin = parts.iter().enumerate().filter(|(_, part)| part.is_panel());
    thin.map(|(k, part)| (part.side().0, exposed(parts, k))).collect()
}

/// Area of the middle plane of a part outside all solid parts, and outside the panels before it.
pub(super) fn exposed(parts: &[Part], number: usize) -> f64 {
    let Some(part) = parts.get(number) else { return 0.0 };
    let axis = part.thin_axis();
    let at = |k: usize| (2.0 * k as f64 + 1.0) / GRID as f64 - 1.0;
    let point = |k: usize| {
        let mut place = DVec3::ZERO;
        place[(axis + 1) % 3] = at(k % GRID);
        place[(axis + 2) % 3] = at(k / GRID);
        part.centre + part.axes * (place * part.half)
    };
    // of panels that lie on one another the first counts
    let hides = |(k, other): (usize, &Part), p: &DVec3| {
        let mut thick = *other;
        thick.half[other.thin_axis()] += if other.is_panel() { part.half[axis] } else { 0.0 };
        k != number && (!other.is_panel() || k < number) && thick.holds(*p)
    };
    let open = |p: &DVec3| !parts.iter().enumerate().any(|other| hides(other, p));
    let free = (0..GRID * GRID).map(point).filter(open).count();
    part.side().1 * free as f64 / (GRID * GRID) as f64
}
