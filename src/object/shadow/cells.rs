//! Which faces may hide which, along one direction: the boxes about their projections in a grid of cells.

use super::body::Body;
use glam::{DVec2, DVec3};

/// The box about a face's projection, and its reach along the direction.
#[derive(Debug, Clone, Copy)]
struct Shadow {
    low: DVec2,
    high: DVec2,
    near: f64,
    far: f64,
    /// The cells it touches: first column, last column, first row, last row.
    span: [u16; 4],
}

/// Faces sorted by their place across a direction.
#[derive(Debug, Default)]
pub struct Cells {
    projected: Vec<DVec3>,
    shadows: Vec<Shadow>,
    blocks: Vec<bool>,
    /// Cells in a row.
    side: usize,
    corner: DVec2,
    per_cell: DVec2,
    /// Where the faces of each cell begin in `names`.
    starts: Vec<u32>,
    names: Vec<u32>,
}

/// Bodies of fewer faces have one cell.
const SMALL: usize = 100;

impl Cells {
    /// Sort the faces of `body` that can hide something from a light in direction `to`.
    pub fn sort(&mut self, body: &Body, to: DVec3) {
        let (across, up) = to.any_orthonormal_pair();
        self.projected.clear();
        self.projected.extend(body.vertices.iter().map(|v| DVec3::new(across.dot(*v), up.dot(*v), to.dot(*v))));
        self.shadows.clear();
        self.blocks.clear();
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for (i, face) in body.faces.iter().enumerate() {
            let [a, b, c] = face.map(|k| self.projected[k as usize]);
            let (least, most) = (a.min(b).min(c), a.max(b).max(c));
            self.shadows.push(Shadow {
                low: least.truncate(),
                high: most.truncate(),
                near: least.z,
                far: most.z,
                span: [0; 4],
            });
            // a ray leaves a solid where it faces along the ray
            let facing = body.normals[i].dot(to);
            let blocks = facing > 0.0 || (body.sheet[i] && facing < 0.0);
            self.blocks.push(blocks);
            if blocks {
                (low, high) = (low.min(least.truncate()), high.max(most.truncate()));
            }
        }
        let count = self.blocks.iter().filter(|b| **b).count();
        self.side = if count < SMALL { 1 } else { (0.7 * (count as f64).sqrt()).min(4096.0) as usize };
        self.corner = low;
        // a flat body has no width: all of it falls into the first row
        let width = (high - low).max(DVec2::splat(f64::MIN_POSITIVE));
        self.per_cell = DVec2::splat(self.side as f64) / width;
        for i in 0..self.shadows.len() {
            self.shadows[i].span = self.span(&self.shadows[i]);
        }
        self.fill();
    }

    /// The cells that a box touches.
    fn span(&self, shadow: &Shadow) -> [u16; 4] {
        let last = self.side as f64 - 1.0;
        let cell = |at: DVec2| ((at - self.corner) * self.per_cell).clamp(DVec2::ZERO, DVec2::splat(last));
        let (low, high) = (cell(shadow.low), cell(shadow.high));
        // casts take NaN, of a body without width, to 0
        [low.x as u16, high.x as u16, low.y as u16, high.y as u16]
    }

    fn fill(&mut self) {
        let Self { starts, names, shadows, blocks, side, .. } = self;
        let visit = |out: &mut dyn FnMut(usize, usize)| {
            for (face, shadow) in shadows.iter().enumerate().filter(|(face, _)| blocks[*face]) {
                let [x0, x1, y0, y1] = shadow.span.map(usize::from);
                for y in y0..=y1 {
                    for x in x0..=x1 {
                        out(y * *side + x, face);
                    }
                }
            }
        };
        starts.clear();
        starts.resize(*side * *side + 1, 0u32);
        visit(&mut |cell, _| starts[cell + 1] += 1);
        for cell in 1..starts.len() {
            starts[cell] += starts[cell - 1];
        }
        names.clear();
        names.resize(starts.last().map_or(0, |n| *n as usize), 0);
        visit(&mut |cell, face| {
            names[starts[cell] as usize] = face as u32;
            starts[cell] += 1;
        });
        // each start has moved to the next one's place
        starts.rotate_right(1);
        starts[0] = 0;
    }

    /// Hand over each face that may hide part of `face`, once, as long as `hand` asks for more; tells whether it did to the end.
    pub fn candidates(&self, face: usize, mut hand: impl FnMut(usize) -> bool) -> bool {
        let own = &self.shadows[face];
        let [x0, x1, y0, y1] = own.span.map(usize::from);
        for y in y0..=y1 {
            for x in x0..=x1 {
                let cell = y * self.side + x;
                for name in &self.names[self.starts[cell] as usize..self.starts[cell + 1] as usize] {
                    let other = &self.shadows[*name as usize];
                    let meet = other.far > own.near
                        && other.low.x < own.high.x
                        && other.high.x > own.low.x
                        && other.low.y < own.high.y
                        && other.high.y > own.low.y;
                    if !meet || *name as usize == face {
                        continue;
                    }
                    // boxes that share several cells meet first in this one
                    let first = x0.max(other.span[0].into()) == x && y0.max(other.span[2].into()) == y;
                    if first && !hand(*name as usize) {
                        return false;
                    }
                }
            }
        }
        true
    }
}
