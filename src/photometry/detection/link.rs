//! Unknown moving objects through frames: detections that move steadily, or with a bounded acceleration.
//!
//! Each pair of detections in frames near each other that moves no faster than allowed is grown: frame by frame away from the
//! pair, the detection nearest to the predicted place joins if it is within 4 standard deviations of prediction
//! and detection together.
//!
//! Whether a track is more than chance is decided a contrario (Desolneux, Moisan & Morel 2000, Int. J. Comput.
//! Vision 40, 7): were all detections false and evenly spread, a frame of density rho would hold one in the gate of area A with
//! the probability p = 1 - exp(-rho A), and m of the frames looked at would with the tail of the sum of such trials. This
//! tail times the number of pairs tried and of lengths at which growing may end is the number of such tracks expected;
//! tracks with less than the number allowed are given, the least likely first. Each detection belongs to one track.
//!
//! Detections that are false but no chance (hot pixels of a tracking camera, which stay where the target stays) make tracks.

use super::track::{Fit, Member, Point, Track};
use super::{DetectionError, within};
use glam::DVec2;

/// Gate \[standard deviations\]: 3e-4 of the true detections are outside.
const GATE: f64 = 4.0;
/// Frames between those of a pair.
const FARTHEST: usize = 4;
/// Frames without a detection after which a track ends.
const LOST: usize = 8;
/// Frames in which a pair must find its third.
const THIRD: usize = 6;
/// Pairs tried at most.
const MOST: usize = 3_000_000;
/// Times that the detections left are searched once more.
const ROUNDS: usize = 4;

/// One detection that is no star.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SkyDetection {
    /// Place in a tangent plane common to all frames \[arcsec\].
    pub place: DVec2,
    /// Standard deviation of the place along each axis \[arcsec\], above 0.
    pub sigma: f64,
}

/// The detections of one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameDetections {
    /// Mid-exposure \[s\] after any epoch.
    pub time_s: f64,
    /// Area that the frame covers \[arcsec^2\], above 0.
    pub area: f64,
    /// Detections that are no stars; one that is not finite is passed over.
    pub detections: Vec<SkyDetection>,
}

/// What tracks are looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkSettings {
    /// Rate about which is searched \[arcsec/s\]: zero in the tangent plane of the target's motion.
    pub rate: DVec2,
    /// Largest difference from it \[arcsec/s\], at least 0.
    pub largest_rate: f64,
    /// Acceleration expected at most \[arcsec/s^2\], at least 0.
    pub largest_acceleration: f64,
    /// False tracks expected in all frames, above 0.
    pub false_tracks: f64,
}

/// The tracks found.
#[derive(Debug, Clone, PartialEq)]
pub struct Linked {
    /// Tracks, those that chance makes least likely first.
    pub tracks: Vec<Track>,
    /// Pairs tried.
    pub pairs: usize,
    /// All pairs were tried; else there were too many detections, and only pairs of early frames were.
    pub complete: bool,
}

/// A frame with its detections ordered by x.
struct Sheet {
    time_s: f64,
    density: f64,
    points: Vec<Point>,
    /// The largest standard deviation of its detections.
    widest: f64,
    /// Number in this round of the track that a detection belongs to.
    owners: Vec<Option<usize>>,
}

impl Sheet {
    fn between(&self, from: f64, to: f64) -> std::ops::Range<usize> {
        let first = self.points.partition_point(|p| p.place.x < from);
        let last = self.points.partition_point(|p| p.place.x <= to);
        first..last.max(first)
    }

    /// Detections within `reach` of a column of the plane, less those out of reach along y.
    fn near(&self, place: DVec2, reach: f64) -> impl Iterator<Item = usize> + '_ {
        let range = self.between(place.x - reach, place.x + reach);
        range.filter(move |i| (self.points[*i].place.y - place.y).abs() <= reach)
    }
}

/// Tracks through frames in any order of time: three detections at least, of which every frame may miss some.
///
/// # Errors
/// If a number is beyond its range.
pub fn link(frames: &[FrameDetections], settings: &LinkSettings) -> Result<Linked, DetectionError> {
    const LARGE: f64 = 1e12;
    within("rate.x", settings.rate.x, -LARGE, LARGE)?;
    within("rate.y", settings.rate.y, -LARGE, LARGE)?;
    within("largest_rate", settings.largest_rate, 0.0, LARGE)?;
    within("largest_acceleration", settings.largest_acceleration, 0.0, LARGE)?;
    within("false_tracks", settings.false_tracks, 1e-30, LARGE)?;
    let mut sheets = Vec::with_capacity(frames.len());
    for (frame, of) in frames.iter().enumerate() {
        within("time_s", of.time_s, -LARGE, LARGE)?;
        within("area", of.area, 1e-12, 1e24)?;
        let usable = |d: &SkyDetection| {
            d.place.abs().max_element() <= LARGE && d.place.is_finite() && (1e-9..=LARGE).contains(&d.sigma)
        };
        let point = |(detection, d): (usize, &SkyDetection)| {
            let member = Member { frame, detection };
            usable(d).then_some(Point { member, time_s: of.time_s, place: d.place, sigma: d.sigma })
        };
        let mut points = of.detections.iter().enumerate().filter_map(point).collect::<Vec<_>>();
        points.sort_by(|a, b| a.place.x.total_cmp(&b.place.x));
        let density = points.len() as f64 / of.area;
        let owners = vec![None; points.len()];
        let widest = points.iter().map(|p| p.sigma).fold(0.0, f64::max);
        sheets.push(Sheet { time_s: of.time_s, density, points, widest, owners });
    }
    sheets.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
    let mut linker = Linker { sheets, settings, pairs: 0, complete: true };
    let tracks = linker.tracks();
    Ok(Linked { tracks, pairs: linker.pairs, complete: linker.complete })
}

struct Linker<'a> {
    sheets: Vec<Sheet>,
    settings: &'a LinkSettings,
    pairs: usize,
    complete: bool,
}

/// A grown pair: places of its members (sheet, detection) and the logarithm of its chance.
struct Grown {
    members: Vec<(usize, usize)>,
    log_tail: f64,
}

impl Linker<'_> {
    fn tracks(&mut self) -> Vec<Track> {
        let mut tracks = Vec::new();
        for round in 0..ROUNDS {
            let mut grown = self.round();
            if round == 0 {
                self.pairs = self.pairs.max(1);
            }
            grown.sort_by(|a, b| a.log_tail.total_cmp(&b.log_tail).then_with(|| a.members.cmp(&b.members)));
            let before = tracks.len();
            let mut used = self.sheets.iter().map(|s| vec![false; s.points.len()]).collect::<Vec<_>>();
            for candidate in grown {
                let log_false = candidate.log_tail + self.log_tests();
                let taken = candidate.members.iter().any(|(s, d)| used[*s][*d]);
                if taken || log_false > self.settings.false_tracks.ln() {
                    continue;
                }
                let points = candidate.members.iter().map(|(s, d)| self.sheets[*s].points[*d]).collect::<Vec<_>>();
                if let Some(track) = Track::through(&points, log_false / std::f64::consts::LN_10) {
                    candidate.members.iter().for_each(|(s, d)| used[*s][*d] = true);
                    tracks.push(track);
                }
            }
            if tracks.len() == before {
                break;
            }
            for (sheet, used) in self.sheets.iter_mut().zip(used) {
                let mut used = used.into_iter();
                sheet.points.retain(|_| !used.next().unwrap_or(false));
                sheet.owners = vec![None; sheet.points.len()];
            }
        }
        tracks.sort_by(|a, b| a.log_false.total_cmp(&b.log_false));
        tracks
    }

    /// Logarithm of the number of tests made.
    fn log_tests(&self) -> f64 {
        let lengths = self.sheets.len().saturating_sub(LOST + 1).max(1);
        (self.pairs as f64).ln() + (lengths as f64).ln()
    }

    /// All pairs grown whose chance may be small enough.
    fn round(&mut self) -> Vec<Grown> {
        let mut found = Vec::new();
        let mut tried = 0;
        for i in 0..self.sheets.len() {
            for j in i + 1..(i + 1 + FARTHEST).min(self.sheets.len()) {
                let dt = self.sheets[j].time_s - self.sheets[i].time_s;
                if dt <= 0.0 {
                    continue;
                }
                for a in 0..self.sheets[i].points.len() {
                    let start = self.sheets[i].points[a];
                    let middle = start.place + self.settings.rate * dt;
                    let slack = |p: &Point| GATE * start.sigma.hypot(p.sigma);
                    let widest = GATE * start.sigma.hypot(self.sheets[j].widest);
                    let reach = self.settings.largest_rate * dt;
                    let near = self.sheets[j].near(middle, reach + widest).collect::<Vec<_>>();
                    for b in near {
                        let end = self.sheets[j].points[b];
                        if (end.place - middle).length() > reach + slack(&end) {
                            continue;
                        }
                        if tried >= MOST {
                            self.complete = false;
                            self.pairs = self.pairs.max(tried);
                            return found;
                        }
                        tried += 1;
                        let owner = self.sheets[i].owners[a];
                        if owner.is_some() && owner == self.sheets[j].owners[b] {
                            continue;
                        }
                        let Some(grown) = self.grow([(i, a), (j, b)]) else { continue };
                        // tests counted later make the bar only higher
                        if grown.log_tail + (tried as f64).ln() <= self.settings.false_tracks.ln() {
                            for (s, d) in &grown.members {
                                self.sheets[*s].owners[*d] = Some(found.len());
                            }
                            found.push(grown);
                        }
                    }
                }
            }
        }
        self.pairs = self.pairs.max(tried);
        found
    }

    /// A pair with the detections that follow its motion; none if there is no third.
    fn grow(&self, pair: [(usize, usize); 2]) -> Option<Grown> {
        let times = [self.sheets.first()?.time_s, self.sheets.last()?.time_s];
        let [start, end] = pair.map(|(s, d)| self.sheets[s].points[d]);
        let mut fit = Fit::new(start.time_s, times[1] - times[0], self.settings.largest_acceleration);
        fit.add(&start);
        fit.add(&end);
        let mut motion = fit.solve();
        let middle = 0.5 * (start.time_s + end.time_s);
        let mut members = pair.to_vec();
        let mut chances = Vec::new();
        // frames not yet looked at lie before `low` and from `high` on, besides those between the pair's
        let mut between = pair[0].0 + 1..pair[1].0;
        let (mut low, mut high) = (pair[0].0, pair[1].0 + 1);
        let mut lost = 0;
        loop {
            let next = if let Some(k) = between.next() {
                k
            } else {
                let age = |k: Option<usize>| {
                    k.and_then(|k| self.sheets.get(k)).map_or(f64::INFINITY, |s| (s.time_s - middle).abs())
                };
                let (back, ahead) = (low.checked_sub(1), (high < self.sheets.len()).then_some(high));
                match (back, ahead) {
                    (None, None) => break,
                    (Some(k), _) if age(back) <= age(ahead) => {
                        low = k;
                        k
                    }
                    _ => {
                        high += 1;
                        high - 1
                    }
                }
            };
            let sheet = &self.sheets[next];
            if sheet.time_s == start.time_s || sheet.time_s == end.time_s {
                continue;
            }
            let (chance, found) = look(sheet, motion.at(sheet.time_s)?);
            chances.push(chance);
            if let Some(d) = found {
                members.push((next, d));
                fit.add(&sheet.points[d]);
                motion = fit.solve();
                lost = 0;
            } else {
                lost += 1;
            }
            if lost >= LOST || (lost >= THIRD && members.len() == 2) {
                break;
            }
        }
        if members.len() < 3 {
            return None;
        }
        let log_tail = log_tail(&chances, members.len() - 2);
        members.sort_unstable();
        Some(Grown { members, log_tail })
    }
}

/// The chance that a frame has a false detection in the gate, and the detection nearest to the middle of the gate.
fn look(sheet: &Sheet, (place, variance): (DVec2, f64)) -> (f64, Option<usize>) {
    let gate = |sigma: f64| GATE * (variance + sigma * sigma).sqrt();
    let chance = -(-sheet.density * std::f64::consts::PI * gate(sheet.widest).powi(2)).exp_m1();
    let pull = |i: usize| {
        let point = &sheet.points[i];
        (point.place - place).length() / gate(point.sigma)
    };
    let inside = sheet.near(place, gate(sheet.widest)).filter(|i| pull(*i) <= 1.0);
    (chance, inside.min_by(|a, b| pull(*a).total_cmp(&pull(*b))))
}

/// Logarithm of the probability that at least `m` of independent trials succeed.
pub(super) fn log_tail(chances: &[f64], m: usize) -> f64 {
    // the tail itself underflows: Chernoff's bound, least over the tilt by bisection, where the sum is far from m
    let expected = chances.iter().sum::<f64>();
    if m as f64 <= expected {
        return 0.0;
    }
    if m >= chances.len() {
        return chances.iter().map(|p| p.ln()).sum();
    }
    let exact = exact_tail(chances, m);
    if exact > 1e-200 {
        return exact.ln();
    }
    let tilted = |t: f64| chances.iter().map(|p| p * t.exp() / (1.0 - p + p * t.exp())).sum::<f64>();
    let (mut low, mut high) = (0.0, 700.0);
    for _ in 0..60 {
        let t = 0.5 * (low + high);
        if tilted(t) < m as f64 { low = t } else { high = t }
    }
    let t = 0.5 * (low + high);
    chances.iter().map(|p| (p * t.exp_m1()).ln_1p()).sum::<f64>() - t * m as f64
}

/// The same probability by summing over the trials one by one.
fn exact_tail(chances: &[f64], m: usize) -> f64 {
    // probabilities of 0 to m - 1 successes so far, and of m and more
    let mut some = vec![0.0; m + 1];
    some[0] = 1.0;
    for p in chances {
        let last = some[m];
        for k in (1..=m).rev() {
            some[k] = some[k] * (1.0 - p) + some[k - 1] * p;
        }
        some[m] += last * p;
        some[0] *= 1.0 - p;
    }
    some[m]
}
