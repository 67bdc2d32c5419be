//! Assemblies worth trying: what an extended Gaussian image suggests, and random changes of an assembly that fits already.

use super::part::Part;
use crate::inversion::synthetic::Stream;
use crate::object::convex::Facet;
use glam::{DMat3, DQuat, DVec3};

/// Cosine below which two normals count as perpendicular.
const PERPENDICULAR: f64 = 0.26;
/// Cosine above which two axes count as one.
const SAME: f64 = 0.985;
/// Strongest axes that are paired.
const AXES: usize = 8;
/// Least and greatest half size of a new part, in typical ones.
const SIZES: (f64, f64) = (0.12, 2.5);
/// Half thickness of a new panel, in typical half sizes.
const PANEL: f64 = 0.05;

/// Attitudes that near-perpendicular pairs of strong normals suggest, the strongest first, at most `most`; the body axes where there are
/// none.
pub(super) fn frames(facets: &[Facet], most: usize) -> Vec<DMat3> {
    let mut sorted = facets.to_vec();
    sorted.sort_by(|a, b| b.area.total_cmp(&a.area));
    // a box shows each axis twice
    let mut axes: Vec<Facet> = Vec::new();
    for facet in sorted {
        match axes.iter_mut().find(|axis| axis.normal.dot(facet.normal).abs() > SAME) {
            Some(axis) => axis.area += facet.area,
            None => axes.push(facet),
        }
    }
    axes.sort_by(|a, b| b.area.total_cmp(&a.area));
    axes.truncate(AXES);
    let mut pairs = Vec::new();
    for (i, a) in axes.iter().enumerate() {
        for b in axes.iter().skip(i + 1).filter(|b| b.normal.dot(a.normal).abs() < PERPENDICULAR) {
            pairs.push((a.area.min(b.area) + 0.5 * a.area.max(b.area), a.normal, b.normal));
        }
    }
    pairs.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut out: Vec<DMat3> = Vec::new();
    for (_, first, second) in pairs {
        let second = (second - first * first.dot(second)).normalize_or_zero();
        let frame = DMat3::from_cols(first, second, first.cross(second));
        if second != DVec3::ZERO && out.iter().all(|other| !same_up_to_axes(other, &frame)) {
            out.push(frame);
        }
    }
    out.truncate(most);
    if out.is_empty() {
        let first = axes.first().map_or(DVec3::X, |axis| axis.normal);
        let (second, third) = first.any_orthonormal_pair();
        out.push(DMat3::from_cols(first, second, third));
    }
    out
}

fn same_up_to_axes(a: &DMat3, b: &DMat3) -> bool {
    let between = a.transpose() * *b;
    (0..3).all(|k| between.col(k).abs().max_element() > SAME)
}

/// The box of this attitude with the image's projected areas.
pub(super) fn enclosing(frame: &DMat3, facets: &[Facet]) -> Part {
    let seen =
        |axis: usize| facets.iter().map(|f| 0.5 * f.area * f.normal.dot(frame.col(axis)).abs()).sum::<f64>();
    let areas = DVec3::new(seen(0), seen(1), seen(2)).max(DVec3::splat(f64::MIN_POSITIVE.sqrt()));
    let [x, y, z] = areas.to_array();
    // sides of 4 h_y h_z, 4 h_z h_x, 4 h_x h_y
    let half = 0.5 * DVec3::new((y * z / x).sqrt(), (z * x / y).sqrt(), (x * y / z).sqrt());
    Part { centre: DVec3::ZERO, axes: *frame, half }
}

/// Makes random changes.
pub(super) struct Proposer<'a> {
    pub frames: &'a [DMat3],
    /// Typical half size \[m\].
    pub scale: f64,
    pub stream: Stream,
}

impl Proposer<'_> {
    /// A number from 0 to `count` - 1; 0 where there is none.
    fn pick(&mut self, count: usize) -> usize {
        ((self.stream.uniform() * count as f64) as usize).min(count.saturating_sub(1))
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.stream.uniform()
    }

    fn attitude(&mut self, base: &[Part]) -> DMat3 {
        let chance = self.stream.uniform();
        let of_base = self.pick(base.len());
        let of_image = self.pick(self.frames.len());
        match (base.get(of_base), self.frames.get(of_image)) {
            (Some(part), _) if chance < 0.55 => part.axes,
            // hinged: turned about one axis of a part
            (Some(part), _) if chance < 0.75 => {
                let axis = part.axes.col(self.pick(3));
                let turn = self.between(0.2, 1.4);
                DMat3::from_quat(DQuat::from_axis_angle(axis, turn)) * part.axes
            }
            (_, Some(frame)) if chance < 0.9 => *frame,
            _ => {
                let turn = self.stream.direction() * self.between(0.0, std::f64::consts::PI);
                DMat3::from_quat(DQuat::from_scaled_axis(turn))
            }
        }
    }

    fn size(&mut self) -> DVec3 {
        let (low, high) = (libm::log(SIZES.0), libm::log(SIZES.1));
        let mut half = DVec3::ZERO;
        for axis in 0..3 {
            half[axis] = self.scale * libm::exp(self.between(low, high));
        }
        if self.stream.uniform() < 0.4 {
            let axis = self.pick(3);
            half[axis] = PANEL * self.scale;
        }
        half
    }

    /// `base` with one part more.
    pub fn grown(&mut self, base: &[Part]) -> Vec<Part> {
        let chance = self.stream.uniform();
        let mut out = base.to_vec();
        let number = self.pick(base.len());
        let Some(host) = base.get(number).copied() else {
            let (axes, half) = (self.attitude(base), self.size());
            return vec![Part { centre: DVec3::ZERO, axes, half }];
        };
        if chance < 0.3 {
            let (one, other) = self.split(&host);
            out[number] = one;
            out.push(other);
        } else if chance < 0.5 && base.len() > 1 {
            let mirror = base[(number + 1 + self.pick(base.len() - 1)) % base.len()];
            let axis = mirror.axes.col(self.pick(3));
            out.push(host.mirrored(mirror.centre, axis));
        } else {
            let part = self.beside(base, &host);
            out.push(part);
        }
        out
    }

    /// `base` with two parts more: one and its image in a middle plane of another.
    pub fn grown_by_pair(&mut self, base: &[Part]) -> Vec<Part> {
        let mut out = base.to_vec();
        let number = self.pick(base.len());
        if let Some(host) = base.get(number).copied() {
            let part = self.beside(base, &host);
            let axis = host.axes.col(self.pick(3));
            out.extend([part, part.mirrored(host.centre, axis)]);
            if let Some(host) = out.get_mut(number) {
                host.half *= 0.5 + 0.5 * self.stream.uniform();
            }
        }
        out
    }

    /// Two boxes in place of one: cut across an axis, the second one smaller across it.
    fn split(&mut self, host: &Part) -> (Part, Part) {
        let axis = self.pick(3);
        let share = self.between(0.2, 0.8);
        let length = host.half[axis];
        let along = host.axes.col(axis);
        let (mut one, mut other) = (*host, *host);
        one.half[axis] = share * length;
        other.half[axis] = (1.0 - share) * length;
        one.centre -= along * (length - one.half[axis]);
        other.centre += along * (length - other.half[axis]);
        for across in (0..3).filter(|k| *k != axis) {
            if self.stream.uniform() < 0.7 {
                let full = other.half[across];
                other.half[across] *= self.between(0.2, 1.0);
                // flush with one side, or in the middle
                let shift = (full - other.half[across]) * (self.pick(3) as f64 - 1.0);
                other.centre += host.axes.col(across) * shift;
            }
        }
        (one, other)
    }

    /// A new part that touches `host`, pierces it or stands a little off.
    fn beside(&mut self, base: &[Part], host: &Part) -> Part {
        let (axes, half) = (self.attitude(base), self.size());
        let axis = self.pick(3);
        let sign = if self.stream.uniform() < 0.5 { -1.0 } else { 1.0 };
        let mut place = DVec3::new(self.between(-1.0, 1.0), self.between(-1.0, 1.0), self.between(-1.0, 1.0));
        if self.stream.uniform() < 0.4 {
            place = DVec3::ZERO;
        }
        place[axis] = sign;
        let outwards = host.axes.col(axis) * sign;
        let reach = (axes.transpose() * outwards).abs().dot(half);
        let centre = host.centre + host.axes * (place * host.half) + outwards * reach * self.between(-0.2, 1.3);
        Part { centre, axes, half }
    }
}
