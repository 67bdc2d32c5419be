//! Candidate alignments: a pair of detections on a pair of stars fixes turn, scale and shift at once.
//!
//! Each pair of detections, bright ones first and of middle distance, is laid on every pair of stars whose separation and
//! direction the a-priori world coordinates allow, within their tolerances; the other detections then vote for the similarity
//! found (random sample consensus over all samples: Fischler & Bolles 1981, Comm. ACM 24, 381). A raster of the stars answers
//! whether one lies near a place; a candidate with too few votes among its first detections is dropped early.

use super::Search;
use super::chance::ln_binomial_tail;
use super::draw::Draw;
use super::grid::Raster;
use glam::DVec2;

/// The product of two complex numbers.
pub(super) fn times(a: DVec2, b: DVec2) -> DVec2 {
    DVec2::new(a.x * b.x - a.y * b.y, a.x * b.y + a.y * b.x)
}

/// The complex conjugate.
fn conjugate(a: DVec2) -> DVec2 {
    DVec2::new(a.x, -a.y)
}

/// A similarity of the a-priori plane to itself: a place q is moved to `turn` q + `shift`, as complex numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Similarity {
    /// Scale times exp(i angle).
    pub turn: DVec2,
    /// What is added \[px\].
    pub shift: DVec2,
}

impl Similarity {
    /// Where a place is moved to.
    pub fn of(&self, at: DVec2) -> DVec2 {
        times(self.turn, at) + self.shift
    }

    /// The least-squares similarity from places to targets with weights; not finite where the places coincide or are none.
    pub fn fitted(pairs: &[(DVec2, DVec2, f64)]) -> Self {
        let weight: f64 = pairs.iter().map(|p| p.2).sum();
        let place = pairs.iter().map(|p| p.0 * p.2).sum::<DVec2>() / weight;
        let target = pairs.iter().map(|p| p.1 * p.2).sum::<DVec2>() / weight;
        let cross: DVec2 = pairs.iter().map(|p| times(conjugate(p.0 - place), p.1 - target) * p.2).sum();
        let turn = cross / pairs.iter().map(|p| p.0.distance_squared(place) * p.2).sum::<f64>();
        Self { turn, shift: target - times(turn, place) }
    }
}

/// What the search allows, in the plane of the a-priori world coordinates.
#[derive(Debug, Clone, Copy)]
pub(super) struct Limits {
    /// Centre of the frame.
    pub centre: DVec2,
    /// Half the frame's diagonal \[px\].
    pub reach: f64,
    /// Largest shift of the centre \[px\].
    pub offset: f64,
    /// Largest rotation \[rad\].
    pub rotation: f64,
    /// Largest change of scale, a share.
    pub scale: f64,
    /// By how much a star may lie off a similarity \[px\].
    pub tolerance: f64,
}

impl Limits {
    /// Limits of a search in pixels of `scale` \[rad\].
    pub fn new(search: &Search, scale: f64, centre: DVec2, reach: f64) -> Self {
        Self {
            centre,
            reach,
            offset: search.offset / scale,
            rotation: search.rotation,
            scale: search.scale,
            tolerance: search.distortion_px,
        }
    }

    /// Whether a similarity is allowed, to `slack` in rotation \[rad\] and share of scale.
    pub fn allow(&self, found: &Similarity, slack: f64) -> bool {
        let size = found.turn.length();
        (size - 1.0).abs() <= self.scale + slack
            && found.turn.to_angle().abs() <= self.rotation + slack
            && found.of(self.centre).distance(self.centre) <= self.offset + self.tolerance + slack * self.reach
    }

    /// log10 of the number of alignments of pairs of `detections` with pairs of `stars` of this density that are allowed, over all:
    /// the sector of a separation L that scale and rotation allow has the area 4 L^2 scale rotation.
    pub fn log10_trials(&self, detections: &[DVec2], stars: usize, density: f64) -> f64 {
        let count = detections.len() as f64;
        let mean = detections.iter().sum::<DVec2>() / count.max(1.0);
        let square = 2.0 * detections.iter().map(|d| d.distance_squared(mean)).sum::<f64>() / count.max(1.0);
        let slack = 2.0 * self.tolerance / square.sqrt().max(1.0);
        let sector = 4.0 * square * (self.scale + slack) * (self.rotation + slack).min(std::f64::consts::PI);
        let shifts = std::f64::consts::PI * (self.offset + self.tolerance).powi(2) * density;
        let pairs = count * (count - 1.0).max(1.0) / 2.0;
        (pairs * shifts.clamp(1.0, stars.max(1) as f64) * (density * sector).max(1.0)).max(1.0).log10()
    }
}

/// Most pairs of detections laid on the stars.
const MOST_PAIRS: usize = 200;
/// Most candidates put to the vote.
const MOST_CANDIDATES: usize = 150_000;
/// Most pairs of stars looked at.
const MOST_LOOKED: usize = 4_000_000;
/// Candidates kept besides the convincing ones.
const KEPT: usize = 24;
/// Most convincing candidates that are looked into.
const MOST_CONVINCING: usize = 100;
/// log10 of the expected number of candidates by chance below which one is looked into at once.
const CONVINCING: f64 = -4.0;

/// Pairs of places (i < j), those of middle distance first, and neighbours in brightness before others: each detection has a part
/// in equally many, so that false ones, be they all bright, cannot spoil them all.
fn pairs(detections: &[DVec2], reach: f64, shortest: f64) -> Vec<(usize, usize)> {
    let count = detections.len();
    let mut found: Vec<(bool, usize, usize)> = (0..count)
        .flat_map(|j| (0..j).map(move |i| (i, j)))
        .filter_map(|(i, j)| {
            let length = detections[i].distance(detections[j]);
            let handy = (0.2..0.7).contains(&(length / reach));
            (length >= shortest).then_some((!handy, i, j))
        })
        .collect();
    found.sort_by_key(|&(unhandy, i, j)| (unhandy, j - i, j));
    found.truncate(MOST_PAIRS);
    found.into_iter().map(|(_, i, j)| (i, j)).collect()
}

/// Puts the alignments of a draw to the vote. Convincing ones are handed to `accept` at once, at the end the best of the others;
/// returns what it accepts first.
pub(super) fn vote<T>(draw: &Draw, limits: &Limits, accept: &mut dyn FnMut(Similarity) -> Option<T>) -> Option<T> {
    let places = &draw.detections;
    let count = places.len();
    if count < 3 || draw.stars.len() < 3 {
        return None;
    }
    let raster = Raster::new(&draw.stars, 0.5 * limits.tolerance);
    // nine cells of half the tolerance about each star
    let by_chance = (draw.density * 9.0 * (0.5 * limits.tolerance).powi(2)).min(1.0);
    let log10_trials = limits.log10_trials(places, draw.stars.len(), draw.density);
    let rarity: Vec<f64> = (0..=count)
        .map(|votes| log10_trials + ln_binomial_tail(count - 2, votes, by_chance) / std::f64::consts::LN_10)
        .collect();
    let mut kept: Vec<(usize, Similarity)> = Vec::new();
    let (mut looked, mut candidates, mut convincing) = (0, 0, 0);
    'pairs: for (i, j) in pairs(places, limits.reach, 4.0 * limits.tolerance) {
        let (from, to) = (places[i], places[j] - places[i]);
        let square = to.length_squared();
        let slack = 2.0 * limits.tolerance / square.sqrt();
        let turn_by = (limits.rotation + slack).min(std::f64::consts::PI);
        // the chord of the largest turn, and the change of length
        let around = square.sqrt() * ((2.0 * (0.5 * turn_by).sin()).hypot(limits.scale + slack) + 0.5 * slack);
        let arm = from.distance(limits.centre);
        let shifts = limits.offset + limits.tolerance + arm * (turn_by + limits.scale + slack);
        for (first, _) in draw.by_place.within(from, shifts) {
            if candidates > MOST_CANDIDATES || looked > MOST_LOOKED {
                break 'pairs;
            }
            looked += 1;
            for (second, _) in draw.by_place.within(first + to, around) {
                looked += 1;
                let turn = times(second - first, conjugate(to)) / square;
                let found = Similarity { turn, shift: first - times(turn, from) };
                if !limits.allow(&found, slack) {
                    continue;
                }
                candidates += 1;
                let Some(votes) = votes(places, [i, j], &raster, &found) else { continue };
                if rarity[votes] < CONVINCING && convincing < MOST_CONVINCING {
                    convincing += 1;
                    let accepted = accept(found);
                    if accepted.is_some() {
                        return accepted;
                    }
                } else if kept.len() < KEPT || kept.last().is_some_and(|worst| worst.0 < votes) {
                    let place = kept.partition_point(|other| other.0 >= votes);
                    kept.insert(place, (votes, found));
                    kept.truncate(KEPT);
                }
            }
        }
    }
    kept.into_iter().find_map(|(_, found)| accept(found))
}

/// Detections besides the two of a sample that lie near a star; none if the first of them tell against it. Which are the first depends
/// on the sample: were they always the brightest, false ones among them could hide the truth from all samples.
fn votes(places: &[DVec2], [i, j]: [usize; 2], raster: &Raster, found: &Similarity) -> Option<usize> {
    let mut votes = 0;
    let others = (j + 1..places.len()).chain(0..j).filter(|&k| k != i);
    for (asked, k) in others.enumerate() {
        votes += usize::from(raster.holds(found.of(places[k])));
        // where three in ten are right, or more, each gate loses at most 3 per cent of the true samples
        let gate = match asked {
            10 => 1,
            20 => 3,
            _ => 0,
        };
        if votes < gate {
            return None;
        }
    }
    (votes > 0).then_some(votes)
}
