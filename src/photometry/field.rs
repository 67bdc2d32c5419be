//! Catalogue stars on a frame: where they draw, which stand alone, and how much light they give.

use super::frame::Frame;
use super::segment::Segment;
use glam::{DVec2, DVec3};
use std::collections::HashMap;

/// A catalogue star.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FieldStar {
    /// Astrometric ICRS direction, unit vector.
    pub direction: DVec3,
    /// Johnson V magnitude.
    pub mag_v: f64,
    /// Johnson B - V \[mag\]; NaN if unknown.
    pub colour_bv: f64,
}

/// Most stars measured in a frame, the brightest ones.
const MOST_STARS: usize = 300;

/// The image of a catalogue star.
#[derive(Debug, Clone, Copy)]
pub struct Track {
    /// Where it draws.
    pub segment: Segment,
    /// V magnitude.
    pub mag_v: f64,
    /// B - V \[mag\]; NaN if unknown.
    pub colour_bv: f64,
    /// Radius within which it spoils a background \[px\].
    pub reach_px: f64,
}

/// Images of stars that touch the frame, brightest first.
pub fn tracks(frame: &Frame, stars: &[FieldStar], fwhm: f64) -> Vec<Track> {
    let mut tracks = stars
        .iter()
        .filter(|s| s.mag_v.is_finite() && s.direction.is_finite())
        .filter_map(|s| Some((frame.star_segment(s.direction)?, s)))
        .filter(|(segment, _)| {
            let reach = segment.half.abs().max_element() + 8.0 * fwhm;
            reach < 1e5 && frame.holds(segment.centre, -reach)
        })
        .map(|(segment, s)| Track { segment, mag_v: s.mag_v, colour_bv: s.colour_bv, reach_px: 0.0 })
        .collect::<Vec<_>>();
    tracks.sort_by(|a, b| a.mag_v.total_cmp(&b.mag_v));
    let typical = tracks.get(tracks.len() / 2).map_or(0.0, |t| t.mag_v);
    for track in &mut tracks {
        track.reach_px = fwhm * (2.5 + 0.5 * (typical - track.mag_v)).clamp(1.5, 8.0);
    }
    tracks
}

/// Indices of the stars that stand alone: whole on the frame with a border of `margin` \[px\], nothing within
/// `gap` \[px\] that could add half a per cent, nor the target.
pub fn alone(frame: &Frame, tracks: &[Track], target: &Segment, margin: f64, gap: f64) -> Vec<usize> {
    const NEGLIGIBLE_MAG: f64 = 5.75;
    let whole = |s: &Segment| frame.holds(s.centre - s.half, margin) && frame.holds(s.centre + s.half, margin);
    let cells = Cells::new(tracks, gap);
    let clear = |i: usize| {
        let star = &tracks[i];
        let spoilt = |j: usize| {
            let other = &tracks[j];
            j != i && other.mag_v < star.mag_v + NEGLIGIBLE_MAG && near(&star.segment, &other.segment, gap)
        };
        !near(&star.segment, target, gap) && !cells.around(star.segment.centre).any(spoilt)
    };
    (0..tracks.len()).filter(|i| whole(&tracks[*i].segment) && clear(*i)).take(MOST_STARS).collect()
}

/// Tracks by the cell that their middle lies in; all that can be within a gap of each other are in neighbouring cells.
struct Cells {
    side: f64,
    tracks: HashMap<(i64, i64), Vec<usize>>,
}

impl Cells {
    fn new(tracks: &[Track], gap: f64) -> Self {
        let longest = tracks.iter().map(|t| t.segment.length()).fold(0.0, f64::max);
        let mut cells = Self { side: (longest + gap).max(16.0), tracks: HashMap::new() };
        for (i, track) in tracks.iter().enumerate() {
            cells.tracks.entry(cells.cell(track.segment.centre)).or_default().push(i);
        }
        cells
    }

    fn cell(&self, place: DVec2) -> (i64, i64) {
        let cell = (place / self.side).floor();
        (cell.x as i64, cell.y as i64)
    }

    fn around(&self, place: DVec2) -> impl Iterator<Item = usize> + '_ {
        let (x, y) = self.cell(place);
        let cells = (-1..=1).flat_map(move |dy| (-1..=1).map(move |dx| (x + dx, y + dy)));
        cells.filter_map(|cell| self.tracks.get(&cell)).flatten().copied()
    }
}

/// Light of other stars' wings beside star `index`, as a share of its own: wings fall with the distance cubed,
/// as those of the widest profile in use do.
pub fn spoilt(tracks: &[Track], index: usize, fwhm: f64) -> f64 {
    let star = &tracks[index];
    let wing = |other: &Track| {
        let gap = star.segment.gap(&other.segment).max(fwhm);
        10f64.powf(0.4 * (star.mag_v - other.mag_v)) * (fwhm / gap).powi(3)
    };
    tracks.iter().enumerate().filter(|(j, _)| *j != index).map(|(_, t)| wing(t)).sum()
}

/// Stars whose light reaches within `radius` \[px\] of a segment, without star `but`.
pub fn around(tracks: &[Track], segment: &Segment, radius: f64, but: Option<usize>) -> Vec<Track> {
    let others = tracks.iter().enumerate().filter(|(i, _)| Some(*i) != but).map(|(_, t)| *t);
    others.filter(|t| near(segment, &t.segment, radius + t.reach_px)).collect()
}

/// True if a place lies in the light of one of these stars.
pub fn covered(stars: &[Track], place: DVec2) -> bool {
    stars.iter().any(|t| t.segment.distance(place) <= t.reach_px)
}

fn near(a: &Segment, b: &Segment, gap: f64) -> bool {
    // bounding circles first
    let limit = gap + a.half.length() + b.half.length();
    (a.centre - b.centre).length_squared() <= limit * limit && a.gap(b) < gap
}
