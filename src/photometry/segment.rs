//! Points and straight trails on a frame.

use glam::DVec2;

/// A straight piece of a trail, or a point when its length is zero \[px\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    /// Middle.
    pub centre: DVec2,
    /// From the middle to the end.
    pub half: DVec2,
}

impl Segment {
    /// A point.
    pub fn point(centre: DVec2) -> Self {
        Self { centre, half: DVec2::ZERO }
    }

    /// The segment between two places.
    pub fn between(start: DVec2, end: DVec2) -> Self {
        Self { centre: (start + end) * 0.5, half: (end - start) * 0.5 }
    }

    /// The same segment moved to another middle.
    #[must_use]
    pub fn at(self, centre: DVec2) -> Self {
        Self { centre, ..self }
    }

    /// Length \[px\].
    pub fn length(&self) -> f64 {
        2.0 * self.half.length()
    }

    /// Distance of a place from the segment \[px\].
    pub fn distance(&self, place: DVec2) -> f64 {
        let v = place - self.centre;
        let square = self.half.length_squared();
        let along = if square > 0.0 { (v.dot(self.half) / square).clamp(-1.0, 1.0) } else { 0.0 };
        (v - self.half * along).length()
    }

    /// Smallest distance to another segment \[px\]: exact unless they cross, then 0.
    pub fn gap(&self, other: &Self) -> f64 {
        let (p, q) = (self.half * 2.0, other.half * 2.0);
        let (a, b) = (self.centre - self.half, other.centre - other.half);
        let cross = p.perp_dot(q);
        if cross.abs() > 1e-12 {
            let (s, t) = ((b - a).perp_dot(q) / cross, (b - a).perp_dot(p) / cross);
            if (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t) {
                return 0.0;
            }
        }
        let ends = [self.distance(b), self.distance(b + q), other.distance(a), other.distance(a + p)];
        ends.into_iter().fold(f64::INFINITY, f64::min)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_and_gaps_worked_by_hand() {
        let s = Segment::between(DVec2::ZERO, DVec2::new(10.0, 0.0));
        assert_eq!(s.distance(DVec2::new(5.0, 3.0)), 3.0);
        assert_eq!(s.distance(DVec2::new(13.0, 4.0)), 5.0);
        assert_eq!(s.gap(&s.at(DVec2::new(18.0, 4.0))), 5.0);
        assert_eq!(s.gap(&Segment::between(DVec2::new(5.0, -1.0), DVec2::new(5.0, 9.0))), 0.0);
        assert_eq!(Segment::point(DVec2::ZERO).gap(&Segment::point(DVec2::new(3.0, 4.0))), 5.0);
    }
}
