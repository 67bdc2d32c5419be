//! When narrow lobes flash: the instants of an exposure that its integral must know of.
//!
//! A facet flashes while the half vector h of Sun and observer, in body axes, passes its normal. The path of h is followed
//! in steps small against its turns; steps that pass a shiny normal within reach of its lobe are halved until they are
//! short against the lobe. The ends of these steps are where the integral starts from.

use super::matter::lobe_width;
use super::shape::Shape;
use glam::DVec3;

/// Steps of the path are no longer than this \[rad\], unless there would be too many.
const STEP: f64 = 0.5;
/// Most steps of a path; twice as many points may be handed to the integral.
const MOST: usize = 4096;
/// Halvings of a step, at most.
const DEEPEST: usize = 40;
/// A lobe reaches so many of its widths.
const REACH: f64 = 5.0;

/// Where an integral starts from.
#[derive(Debug, Clone, PartialEq)]
pub struct Points {
    /// Places in \[0, 1\] in order, 0 and 1 among them.
    pub at: Vec<f64>,
    /// Whether nothing flashes unseen between them; false where the object turns too often to be followed.
    pub complete: bool,
}

/// A normal and the width of its lobe \[rad\].
#[derive(Debug, Clone, Copy)]
pub struct Shiny {
    normal: DVec3,
    two_sided: bool,
    width: f64,
}

/// The normals of rigid part number `part` of a shape whose lobes are narrower than a step.
pub fn shiny(shape: &Shape, part: usize, sun_radius: f64) -> Vec<Shiny> {
    let mut all: Vec<Shiny> = Vec::new();
    for face in shape.faces_of(part) {
        let material = shape.material_of.get(face).and_then(|m| shape.materials.get(usize::from(*m)));
        let Some(width) = material.and_then(|m| lobe_width(m, sun_radius)) else { continue };
        let (normal, two_sided) = (shape.body.normals[face], shape.body.sheet[face]);
        // faces of one plane follow each other in most files
        let known = |own: &Shiny| own.normal.dot(normal) > 1.0 - 1e-12 && own.width == width;
        if width < STEP && normal != DVec3::ZERO && !all.iter().rev().take(64).any(known) {
            all.push(Shiny { normal, two_sided, width });
        }
    }
    all
}

/// The narrowest lobe of a shape \[rad\]; infinite of one that does not shine.
pub fn narrowest(shape: &Shape, sun_radius: f64) -> f64 {
    shape.materials.iter().filter_map(|m| lobe_width(m, sun_radius)).fold(f64::INFINITY, f64::min)
}

/// Points between which nothing flashes unseen. `half` is the half vector in the part's axes at a share of the exposure, `turn`
/// about how far it turns in the whole \[rad\].
///
/// # Errors
/// Whatever `half` says.
pub fn points<E>(shiny: &[Shiny], turn: f64, half: &mut dyn FnMut(f64) -> Result<DVec3, E>) -> Result<Points, E> {
    let wanted = (turn / STEP).ceil();
    let mut complete = wanted <= MOST as f64;
    let steps = if complete { wanted.max(1.0) as usize } else { MOST };
    let mut at = (0..=steps).map(|k| k as f64 / steps as f64).collect::<Vec<_>>();
    if shiny.is_empty() {
        return Ok(Points { at, complete });
    }
    let path = at.iter().map(|t| Ok((*t, half(*t)?))).collect::<Result<Vec<_>, E>>()?;
    for pair in path.windows(2) {
        refine(pair[0], pair[1], shiny, DEEPEST, half, &mut at)?;
    }
    complete &= at.len() < 2 * MOST;
    at.sort_by(f64::total_cmp);
    Ok(Points { at, complete })
}

fn refine<E>(
    from: (f64, DVec3),
    to: (f64, DVec3),
    shiny: &[Shiny],
    deeper: usize,
    half: &mut dyn FnMut(f64) -> Result<DVec3, E>,
    points: &mut Vec<f64>,
) -> Result<(), E> {
    let length = (to.1 - from.1).length();
    // an arc departs from its chord by an eighth of the square of its length, and more if it bends
    let near = |s: &&Shiny| {
        let reach = REACH * s.width + length * length.min(1.0);
        let distance = |n: DVec3| to_chord(n, from.1, to.1);
        distance(s.normal) < reach || (s.two_sided && distance(-s.normal) < reach)
    };
    let close = shiny.iter().filter(near).copied().collect::<Vec<_>>();
    let narrowest = close.iter().map(|s| s.width).fold(f64::INFINITY, f64::min);
    if close.is_empty() || length < narrowest || deeper == 0 || points.len() >= 2 * MOST {
        return Ok(());
    }
    let t = 0.5 * (from.0 + to.0);
    let middle = (t, half(t)?);
    points.push(t);
    refine(from, middle, &close, deeper - 1, half, points)?;
    refine(middle, to, &close, deeper - 1, half, points)
}

/// Distance of a point from a chord.
fn to_chord(point: DVec3, a: DVec3, b: DVec3) -> f64 {
    let along = b - a;
    let share = (point - a).dot(along) / along.length_squared();
    let share = if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 };
    point.distance(a + along * share)
}
