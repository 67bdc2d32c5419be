//! Surfaces of revolution about z.

use std::f64::consts::TAU;

use glam::DVec2;

use super::mesh::{Mesh, number};

/// Fewest and most segments of a circle; a number outside is taken as the nearer of the two.
pub const SEGMENTS: std::ops::RangeInclusive<u32> = 3..=4096;

/// A number of segments that makes a circle.
pub(super) fn allowed(segments: u32) -> u32 {
    segments.clamp(*SEGMENTS.start(), *SEGMENTS.end())
}

/// Where a circle of radius 1 is after `step` of `steps` equal parts of a turn.
pub(super) fn on_circle(step: u32, steps: u32) -> DVec2 {
    let (sin, cos) = libm::sincos(TAU * f64::from(step) / f64::from(steps));
    DVec2::new(cos, sin)
}

/// The surface that a profile of (radius, z) points \[m\] sweeps about z. Outside is to the right of the profile, going
/// along it with z up and the radius to the right: upwards at the outer side, inwards at the top. `closed` joins the last
/// point to the first. A point on the axis (radius 0) is one vertex.
pub fn revolve(profile: &[DVec2], segments: u32, closed: bool) -> Mesh {
    let segments = allowed(segments);
    let mut profile = profile.to_vec();
    profile.dedup();
    if closed && profile.len() > 1 && profile.first() == profile.last() {
        profile.pop();
    }
    let mut vertices = Vec::new();
    let mut rings: Vec<Ring> = Vec::with_capacity(profile.len() + 1);
    for point in &profile {
        let ring = Ring { first: number(vertices.len()), size: if point.x == 0.0 { 1 } else { segments } };
        let around = (0..ring.size).map(|step| (point.x * on_circle(step, segments)).extend(point.y));
        vertices.extend(around);
        rings.push(ring);
    }
    // two points or fewer have nothing between their last and first that is not there already
    if closed && profile.len() > 2 {
        rings.extend(rings.first().copied());
    }
    let next = rings.iter().skip(1);
    let bands = rings.iter().zip(next).flat_map(|(below, above)| band(*below, *above, segments));
    let corners: Vec<[u32; 3]> = bands.collect();
    Mesh::plain(vertices, corners)
}

/// The vertices of one point of the profile.
#[derive(Clone, Copy)]
struct Ring {
    first: u32,
    size: u32,
}

impl Ring {
    fn at(self, step: u32) -> u32 {
        self.first.saturating_add(step % self.size)
    }
}

/// The triangles between two rings; at a ring that is a point, one of each two has no area and is left out.
fn band(below: Ring, above: Ring, segments: u32) -> impl Iterator<Item = [u32; 3]> {
    let pair = move |step| {
        let (a, b, c, d) = (below.at(step), below.at(step + 1), above.at(step + 1), above.at(step));
        [(below.size > 1).then_some([a, b, c]), (above.size > 1).then_some([a, c, d])]
    };
    (0..segments).flat_map(pair).flatten()
}

#[cfg(test)]
mod tests {
    use super::super::check::faults;
    use super::*;

    #[test]
    fn a_ring_of_square_section_has_its_volume() {
        let profile = [[1.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0]].map(DVec2::from_array);
        let ring = revolve(&profile, 360, true);
        assert!((ring.signed_volume() / (3.0 * std::f64::consts::PI) - 1.0).abs() < 1e-4);
        assert!(faults(&ring).is_empty());
        let twice = [&profile[..], &profile[..1]].concat();
        assert_eq!(revolve(&twice, 360, true), ring);
    }

    #[test]
    fn segments_are_kept_within_limits_and_nothing_makes_nothing() {
        let profile = [DVec2::new(1.0, 0.0), DVec2::new(1.0, 1.0)];
        assert_eq!(revolve(&profile, 0, false).faces.len(), 6);
        assert_eq!(revolve(&profile, u32::MAX, false).faces.len(), 2 * 4096);
        for few in [&profile[..0], &profile[..1]] {
            assert!(revolve(few, 8, true).faces.is_empty() && revolve(few, 8, false).faces.is_empty());
        }
    }
}
