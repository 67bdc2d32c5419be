//! Growth of assemblies: part by part, many starts, few kept.
//!
//! Each number of parts starts from the best assemblies with one part less (and, for a part with its mirror image, two less).
//! Random changes are screened by one forward run each; then rounds of Levenberg-Marquardt go to ever fewer of the best. Last,
//! the parts of the best assemblies are taken away one at a time and grown anew, as long as that helps.

use super::fit::{Data, Model, free};
use super::part::Part;
use super::propose::{Proposer, enclosing};
use super::render::Renderer;
use crate::inversion::synthetic::Stream;
use crate::object::convex::Facet;
use glam::{DMat3, DVec3};
use rayon::prelude::*;

/// Rounds of Levenberg-Marquardt and the share of chi^2 below which a round ends them, of each heat.
const HEATS: [(usize, f64); 3] = [(3, 1e-2), (15, 1e-3), (60, 1e-5)];
/// Assemblies that go on: of each base after the first heat, of all after the second.
const SURVIVORS: (usize, usize) = (6, 10);
/// Share of the proposals that the forward run lets pass: one in so many.
const SCREEN: usize = 4;
/// Times that parts are taken away and grown anew.
const EXCHANGES: usize = 4;
/// Assemblies of each number of parts that are remembered.
const REMEMBERED: usize = 24;
/// An exchange that leaves more than this share of chi^2 is the last.
const LITTLE: f64 = 0.9;
/// Corners nearer than this share of the diagonal make assemblies alike.
const ALIKE: f64 = 0.02;

/// How far to search.
#[derive(Debug, Clone, Copy)]
pub(super) struct Effort {
    pub proposals: usize,
    pub beam: usize,
    pub seed: u64,
}

/// A search in one set of data.
pub(super) struct Search<'a> {
    pub data: &'a Data<'a>,
    pub facets: &'a [Facet],
    pub frames: &'a [DMat3],
    pub effort: Effort,
}

impl Search<'_> {
    /// Boxes, from those that the image suggests and random ones: the first level.
    pub fn first(&self) -> Vec<Model> {
        let mut starts = self.enclosing(usize::MAX);
        starts.extend(self.proposals(&[], 0, false));
        self.heats(vec![starts])
    }

    /// Assemblies with one part more than the last of `levels`; where that leaves but noise already, less is tried.
    pub fn next(&self, levels: &[Vec<Model>]) -> Vec<Model> {
        let Some(last) = levels.last() else { return self.first() };
        let salt = levels.len() as u64 * 1000;
        let beam = |level: &[Model], count: usize| -> Vec<Vec<Part>> {
            level.iter().take(count).map(|m| m.parts.clone()).collect()
        };
        if self.is_within_noise(last) {
            return self.grow(&beam(last, 2), &[], salt);
        }
        let mut bases = beam(last, self.effort.beam);
        let before = levels.len().checked_sub(2).and_then(|k| levels.get(k));
        let mut pairs = before.map_or_else(Vec::new, |level| beam(level, self.effort.beam.div_ceil(2)));
        // what the image suggests may lead further than what fits best with too few parts
        match levels.len() {
            1 => bases.extend(self.enclosing(2)),
            2 => pairs.extend(self.enclosing(2)),
            _ => {}
        }
        let mut found = self.grow(&bases, &pairs, salt);
        for round in 1..=EXCHANGES {
            let Some(best) = found.first().map(|m| m.chi2).filter(|_| !self.is_within_noise(&found)) else {
                break;
            };
            let without = |model: &Model| {
                let parts = model.parts.clone();
                let rest =
                    move |k: usize| parts.iter().enumerate().filter(|(i, _)| *i != k).map(|(_, p)| *p).collect();
                (0..model.parts.len()).map(rest).collect::<Vec<Vec<Part>>>()
            };
            let bases: Vec<Vec<Part>> = found.iter().take(2).flat_map(without).collect();
            found.extend(self.grow(&bases, &[], salt + 100 * round as u64));
            found = distinct(found);
            if found.first().is_none_or(|m| m.chi2 > LITTLE * best) {
                break;
            }
        }
        found
    }

    /// Boxes that the image suggests.
    fn enclosing(&self, most: usize) -> Vec<Vec<Part>> {
        self.frames.iter().take(most).map(|frame| vec![enclosing(frame, self.facets)]).collect()
    }

    /// Whether the best leaves no more than noise.
    pub fn is_within_noise(&self, found: &[Model]) -> bool {
        let dof = |m: &Model| (self.data.flux.len() as f64 - free(m.parts.len()) as f64).max(1.0);
        found.first().is_some_and(|m| m.chi2 < dof(m) + (2.0 * dof(m)).sqrt())
    }

    /// The best of what grows from `bases` by one part and from `pairs` by two.
    fn grow(&self, bases: &[Vec<Part>], pairs: &[Vec<Part>], salt: u64) -> Vec<Model> {
        let all = bases.iter().map(|base| (base, false)).chain(pairs.iter().map(|base| (base, true)));
        let starts = all.enumerate().map(|(k, (base, pair))| self.proposals(base, salt + k as u64, pair));
        self.heats(starts.collect())
    }

    fn proposals(&self, base: &[Part], salt: u64, pair: bool) -> Vec<Vec<Part>> {
        let seed = self.effort.seed.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(salt);
        let mut proposer = Proposer { frames: self.frames, scale: self.data.scale, stream: Stream::new(seed) };
        let change = |_| if pair { proposer.grown_by_pair(base) } else { proposer.grown(base) };
        (0..self.effort.proposals).map(change).collect()
    }

    /// The best of many starts, given by base, fitted.
    fn heats(&self, groups: Vec<Vec<Vec<Part>>>) -> Vec<Model> {
        let half = self.data.thinned(|k| k % 2 == 0);
        let mut field = Vec::new();
        for starts in groups {
            let count = starts.len().div_ceil(SCREEN);
            let screened = starts.into_par_iter().map_init(Renderer::default, |renderer, parts| {
                let chi2 = half.chi2(&parts, f64::INFINITY, renderer);
                Model { parts, chi2 }
            });
            let screened = best(screened.collect(), count);
            field.extend(best(heat(&half, screened, HEATS[0]), SURVIVORS.0));
        }
        let warm = distinct(heat(self.data, field, HEATS[1]));
        distinct(heat(self.data, best(warm, SURVIVORS.1), HEATS[2]))
    }
}

/// All of a field fitted further.
fn heat(data: &Data, field: Vec<Model>, (rounds, least): (usize, f64)) -> Vec<Model> {
    let fit = |renderer: &mut Renderer, model: Model| data.descend(&model.parts, rounds, least, renderer);
    field.into_par_iter().map_init(Renderer::default, fit).collect()
}

fn best(mut models: Vec<Model>, count: usize) -> Vec<Model> {
    models.sort_by(|a, b| a.chi2.total_cmp(&b.chi2));
    models.truncate(count);
    models
}

/// The best of those that differ.
pub(super) fn distinct(models: Vec<Model>) -> Vec<Model> {
    let mut out: Vec<Model> = Vec::new();
    for model in best(models, usize::MAX) {
        if model.chi2.is_finite() && out.len() < REMEMBERED && out.iter().all(|other| !are_alike(other, &model)) {
            out.push(model);
        }
    }
    out
}

/// Corners about their mean.
fn corners(parts: &[Part]) -> Vec<DVec3> {
    let all: Vec<DVec3> = parts.iter().flat_map(|part| (0..8).map(|k| part.corner(k))).collect();
    let mean = all.iter().sum::<DVec3>() / all.len().max(1) as f64;
    all.into_iter().map(|v| v - mean).collect()
}

/// Whether each corner of either assembly has one of the other nearby.
pub(super) fn are_alike(a: &Model, b: &Model) -> bool {
    if a.parts.len() != b.parts.len() {
        return false;
    }
    let (a, b) = (corners(&a.parts), corners(&b.parts));
    let reach = a.iter().map(|v| v.length_squared()).fold(0.0, f64::max).sqrt();
    let near = |from: &[DVec3], to: &[DVec3]| {
        from.iter().all(|v| to.iter().any(|w| v.distance(*w) < ALIKE * 2.0 * reach))
    };
    near(&a, &b) && near(&b, &a)
}
