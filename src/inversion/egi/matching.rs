//! Facets found against facets known.

use crate::inversion::sphere::angle;
use crate::object::convex::Facet;

/// A pair.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// Number of the true facet.
    pub truth: usize,
    /// Number of the one found.
    pub found: usize,
    /// Angle between them \[rad\].
    pub angle: f64,
    /// Relative error of the area.
    pub area: f64,
}

/// True and found facets paired, the nearest first, none further apart than `within` \[rad\] and none twice.
pub fn pairs(truth: &[Facet], found: &[Facet], within: f64) -> Vec<Pair> {
    let mut all: Vec<Pair> = Vec::new();
    for (i, t) in truth.iter().enumerate() {
        for (j, f) in found.iter().enumerate() {
            let angle = angle(t.normal, f.normal);
            all.push(Pair { truth: i, found: j, angle, area: f.area / t.area - 1.0 });
        }
    }
    all.retain(|p| p.angle <= within);
    all.sort_by(|a, b| a.angle.total_cmp(&b.angle));
    let mut out: Vec<Pair> = Vec::new();
    for pair in all {
        if out.iter().all(|p| p.truth != pair.truth && p.found != pair.found) {
            out.push(pair);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn the_nearest_pairs_first_and_none_twice() {
        let facet = |x: f64, area| Facet { normal: DVec3::new(x, 0.0, 1.0).normalize(), area };
        let (truth, found) = ([facet(0.0, 1.0), facet(0.1, 2.0)], [facet(0.09, 3.0), facet(0.04, 1.1)]);
        let pairs = pairs(&truth, &found, 0.2);
        assert_eq!(pairs.iter().map(|p| (p.truth, p.found)).collect::<Vec<_>>(), [(1, 0), (0, 1)]);
        assert!((pairs[0].area - 0.5).abs() < 1e-15 && (pairs[1].angle - 0.04f64.atan()).abs() < 1e-15);
    }
}
