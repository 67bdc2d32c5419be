//! Regularities of made things: parts that are parallel, flush or centred on each other, and edges of one length, as conditions of a fit.

use super::part::{PARAMETERS, Part};
use glam::{DMat3, DVec3};

/// A regularity of parts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tie {
    /// Their edges are parallel.
    Parallel {
        /// The parts.
        parts: [usize; 2],
    },
    /// Two faces lie in one plane.
    Flush {
        /// The parts.
        parts: [usize; 2],
        /// Axis of each face.
        axes: [usize; 2],
        /// Whether each is the one on the positive side.
        positive: [bool; 2],
    },
    /// The centre of the second lies in a middle plane of the first.
    Centred {
        /// The parts.
        parts: [usize; 2],
        /// The axis across that plane.
        axis: usize,
    },
    /// Edges are equally long, of two parts or of one.
    Equal {
        /// The parts that they belong to.
        parts: [usize; 2],
        /// Axis of each edge.
        axes: [usize; 2],
    },
}

/// A violation and its derivatives by all parameters of all parts.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Row {
    pub residual: f64,
    pub slope: Vec<f64>,
}

/// The axis of `b` nearest to axis `k` of `a`, and the cosine between them.
pub(super) fn partner(a: &Part, b: &Part, k: usize) -> (usize, f64) {
    let cosines = (b.axes.transpose() * a.axes.col(k)).to_array();
    let best = (0..3).max_by(|i, j| cosines[*i].abs().total_cmp(&cosines[*j].abs())).unwrap_or(0);
    (best, cosines[best])
}

impl Tie {
    /// Violations with slopes: angles \[rad\], lengths in `scale`, log sizes.
    pub(super) fn rows(&self, parts: &[Part], scale: f64) -> Vec<Row> {
        let ([i, j], count) = (self.parts(), parts.len());
        let (Some(a), Some(b)) = (parts.get(i), parts.get(j)) else { return Vec::new() };
        let row = |residual: f64, terms: [(usize, usize, DVec3); 4]| {
            let mut slope = vec![0.0; PARAMETERS * count];
            for (part, first, value) in terms {
                for axis in 0..3 {
                    slope[PARAMETERS * part + first + axis] += value[axis];
                }
            }
            Row { residual, slope }
        };
        let none = (i, 0, DVec3::ZERO);
        match *self {
            Tie::Parallel { .. } => {
                let like = |k: usize| {
                    let (axis, cosine) = partner(b, a, k);
                    a.axes.col(axis) * cosine.signum()
                };
                let turn = b.axes * DMat3::from_cols(like(0), like(1), like(2)).transpose();
                let angle = 0.5
                    * (DVec3::new(turn.y_axis.z, turn.z_axis.x, turn.x_axis.y)
                        - DVec3::new(turn.z_axis.y, turn.x_axis.z, turn.y_axis.x));
                let each = |e: DVec3| row(angle.dot(e), [(j, 3, e), (i, 3, -e), none, none]);
                DVec3::AXES.into_iter().map(each).collect()
            }
            Tie::Flush { axes, positive, .. } => {
                let face = |part: &Part, axis: usize, positive: bool| {
                    part.axes.col(axis) * if positive { part.half[axis] } else { -part.half[axis] }
                };
                let arms = [face(a, axes[0], positive[0]), face(b, axes[1], positive[1])];
                let normal = a.axes.col(axes[0]);
                let apart = a.centre + arms[0] - b.centre - arms[1];
                let size =
                    |part: usize, axis: usize, arm: DVec3| (part, 6, DVec3::AXES[axis] * normal.dot(arm) / scale);
                let turn = (arms[0].cross(normal) + normal.cross(apart)) / scale;
                let mut row = row(
                    normal.dot(apart) / scale,
                    [
                        (i, 0, normal / scale),
                        (j, 0, -normal / scale),
                        size(i, axes[0], arms[0]),
                        size(j, axes[1], -arms[1]),
                    ],
                );
                let other = -arms[1].cross(normal) / scale;
                for axis in 0..3 {
                    row.slope[PARAMETERS * i + 3 + axis] += turn[axis];
                    row.slope[PARAMETERS * j + 3 + axis] += other[axis];
                }
                vec![row]
            }
            Tie::Centred { axis, .. } => {
                let normal = a.axes.col(axis);
                let apart = a.centre - b.centre;
                let turn = normal.cross(apart) / scale;
                let terms = [(i, 0, normal / scale), (j, 0, -normal / scale), (i, 3, turn), none];
                vec![row(normal.dot(apart) / scale, terms)]
            }
            Tie::Equal { axes, .. } => {
                let apart = libm::log(a.half[axes[0]] / b.half[axes[1]]);
                vec![row(apart, [(i, 6, DVec3::AXES[axes[0]]), (j, 6, -DVec3::AXES[axes[1]]), none, none])]
            }
        }
    }

    /// The two parts.
    pub fn parts(&self) -> [usize; 2] {
        match *self {
            Tie::Parallel { parts } | Tie::Flush { parts, .. } => parts,
            Tie::Centred { parts, .. } | Tie::Equal { parts, .. } => parts,
        }
    }

    /// Its name.
    pub fn name(&self) -> &'static str {
        match self {
            Tie::Parallel { .. } => "parallel",
            Tie::Flush { .. } => "flush",
            Tie::Centred { .. } => "centred",
            Tie::Equal { .. } => "equal",
        }
    }

    /// Axes of its parts that it is about.
    pub fn axes(&self) -> Vec<usize> {
        match *self {
            Tie::Parallel { .. } => Vec::new(),
            Tie::Centred { axis, .. } => vec![axis],
            Tie::Flush { axes, .. } | Tie::Equal { axes, .. } => axes.to_vec(),
        }
    }

    /// Parameters that it saves.
    pub fn saves(&self) -> usize {
        if matches!(self, Tie::Parallel { .. }) { 3 } else { 1 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    fn pair() -> [Part; 2] {
        let axes = |angle: f64| DMat3::from_quat(DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), angle));
        [
            Part { centre: DVec3::new(0.1, 0.2, 0.3), axes: axes(0.4), half: DVec3::new(1.0, 0.7, 0.5) },
            Part { centre: DVec3::new(1.0, -0.2, 0.5), axes: axes(0.43), half: DVec3::new(0.4, 0.6, 0.8) },
        ]
    }

    #[test]
    fn slopes_of_every_tie_are_those_of_differences() {
        let parts = pair();
        let ties = [
            Tie::Parallel { parts: [0, 1] },
            Tie::Flush { parts: [0, 1], axes: [1, 1], positive: [true, false] },
            Tie::Flush { parts: [0, 1], axes: [2, 2], positive: [false, false] },
            Tie::Centred { parts: [0, 1], axis: 0 },
            Tie::Equal { parts: [0, 1], axes: [0, 2] },
            Tie::Equal { parts: [1, 1], axes: [0, 2] },
        ];
        for tie in ties {
            for (number, row) in tie.rows(&parts, 0.7).iter().enumerate() {
                for k in 0..2 * PARAMETERS {
                    let at = |h: f64| {
                        let mut step = [0.0; PARAMETERS];
                        step[k % PARAMETERS] = h;
                        let mut moved = parts;
                        moved[k / PARAMETERS] = moved[k / PARAMETERS].moved(&step);
                        tie.rows(&moved, 0.7)[number].residual
                    };
                    let numeric = (at(1e-5) - at(-1e-5)) / 2e-5;
                    // turns add up only to half the angle between attitudes, 0.03 rad
                    let tolerance = if matches!(tie, Tie::Parallel { .. }) { 0.016 } else { 1e-9 };
                    assert!((numeric - row.slope[k]).abs() < tolerance, "{tie:?} {k}: {numeric} {}", row.slope[k]);
                }
            }
        }
    }
}
