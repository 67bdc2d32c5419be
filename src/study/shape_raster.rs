//! A shape seen from far along a direction, by samples: scan lines of polygons into a depth buffer.
//!
//! Of facets at one depth the one that faces the observer is seen, or else the first. Edges are where neighbouring samples see
//! different facets.

use crate::io::shape_file::{Body, Class, Face, vector_area};
use glam::DVec3;

/// Samples along each side of a pixel.
const SAMPLES: usize = 2;
/// Facets beyond which only outlines and parts have edges.
const MANY: usize = 3000;
/// Depths nearer than this are one, in halves of the extent.
const ONE_DEPTH: f64 = 1e-6;
/// Steps of depth that have an edge.
const STEP: f64 = 0.03;
/// Normals whose product is above have no edge between them: they are of one plane.
const ONE_PLANE: f64 = 1.0 - 1e-9;
/// Colour of edges, and of the sky.
const EDGE: DVec3 = DVec3::splat(40.0);
const SKY: DVec3 = DVec3::splat(255.0);
/// No facet.
const NONE: u32 = u32::MAX;

/// Axes of a picture: right, up, and towards the observer.
#[derive(Debug, Clone, Copy)]
pub(super) struct View {
    /// To the right.
    pub right: DVec3,
    /// Upwards.
    pub up: DVec3,
    /// Towards the observer.
    pub towards: DVec3,
}

/// A facet to be drawn, in units of half the extent.
struct Facet {
    corners: Vec<DVec3>,
    normal: DVec3,
    part: usize,
    class: Class,
}

/// Facets of a shape, ready to be seen from anywhere.
pub(super) struct Scene(Vec<Facet>);

impl Scene {
    /// The facets that have an area.
    pub fn of(body: &Body) -> Self {
        let facet = |(face, corners): (&Face, Vec<DVec3>)| {
            let normal = vector_area(&corners).try_normalize()?;
            Some(Facet { corners, normal, part: face.part, class: Class::of(face.uncertainty) })
        };
        Self(body.scaled().into_iter().filter_map(facet).collect())
    }

    /// Whether every facet's edges are drawn.
    pub fn has_all_edges(&self) -> bool {
        self.0.len() <= MANY
    }

    /// The picture, `pixels` a side, by rows from the top: red, green and blue. It reaches `reach` halves of the extent from
    /// the middle.
    pub fn seen(&self, view: &View, reach: f64, pixels: usize) -> Vec<u8> {
        let buffer = self.samples(view, reach, SAMPLES * pixels);
        let mut rgb = Vec::with_capacity(3 * pixels * pixels);
        for y in 0..pixels {
            for x in 0..pixels {
                let colour =
                    |k: usize| self.colour(&buffer, view, SAMPLES * x + k % SAMPLES, SAMPLES * y + k / SAMPLES);
                let mean = (0..SAMPLES * SAMPLES).map(colour).sum::<DVec3>() / (SAMPLES * SAMPLES) as f64;
                rgb.extend(mean.to_array().map(|v| v.round().clamp(0.0, 255.0) as u8));
            }
        }
        rgb
    }

    fn samples(&self, view: &View, reach: f64, side: usize) -> Buffer {
        let mut buffer = Buffer { side, seen: vec![(NONE, f64::NEG_INFINITY); side * side] };
        let numbered = || (0u32..NONE).zip(&self.0);
        let faces = |facet: &Facet| facet.normal.dot(view.towards) > 0.0;
        for (number, facet) in numbered().filter(|f| faces(f.1)).chain(numbered().filter(|f| !faces(f.1))) {
            buffer.fill(number, facet, view, reach);
        }
        buffer
    }

    fn colour(&self, buffer: &Buffer, view: &View, x: usize, y: usize) -> DVec3 {
        let here = buffer.at(x, y);
        let beside = [(x + 1, y), (x, y + 1), (x.wrapping_sub(1), y), (x, y.wrapping_sub(1))];
        if beside.iter().any(|(x, y)| self.edge(here, buffer.at(*x, *y))) {
            return EDGE;
        }
        let Some(facet) = self.0.get(here.0 as usize) else { return SKY };
        // a light over the observer's left shoulder
        let light = (view.towards + 0.35 * view.up - 0.25 * view.right).normalize();
        let outside = if facet.normal.dot(view.towards) < 0.0 { -facet.normal } else { facet.normal };
        let shade = 0.6 + 0.4 * outside.dot(light).max(0.0);
        let colour = DVec3::from_array(facet.class.colour().map(f64::from));
        // stripes tell what is not observed even without colours
        let stripe = facet.class == Class::Unobserved && ((x + y) / 6).is_multiple_of(2);
        shade * if stripe { 0.5 * (colour + SKY) } else { colour }
    }

    /// Whether an edge lies between two samples. The nearer one bears it.
    fn edge(&self, here: (u32, f64), there: (u32, f64)) -> bool {
        if here.0 == there.0 || here.1 < there.1 - STEP {
            return false;
        }
        match (self.0.get(here.0 as usize), self.0.get(there.0 as usize)) {
            (Some(a), Some(b)) => {
                let bent = a.normal.dot(b.normal) < ONE_PLANE || a.class != b.class;
                a.part != b.part || here.1 > there.1 + STEP || (self.has_all_edges() && bent)
            }
            (Some(_), None) => true,
            _ => false,
        }
    }
}

/// What every sample sees: number of the facet, and its height towards the observer.
struct Buffer {
    side: usize,
    seen: Vec<(u32, f64)>,
}

impl Buffer {
    /// What a sample sees; nothing outside.
    fn at(&self, x: usize, y: usize) -> (u32, f64) {
        let inside = x < self.side && y < self.side;
        let seen = inside.then(|| self.seen.get(y * self.side + x).copied()).flatten();
        seen.unwrap_or((NONE, f64::NEG_INFINITY))
    }

    /// Fills a polygon by the rule of even and odd crossings.
    fn fill(&mut self, number: u32, facet: &Facet, view: &View, reach: f64) {
        let along = facet.normal.dot(view.towards);
        let Some(first) = facet.corners.first().filter(|_| along.abs() > 1e-9) else { return };
        let scale = 0.5 * self.side as f64 / reach;
        let middle = 0.5 * self.side as f64 - 0.5;
        let flat = |v: &DVec3| [middle + scale * v.dot(view.right), middle - scale * v.dot(view.up)];
        let points = facet.corners.iter().map(flat).collect::<Vec<_>>();
        let crossings = crossings(&points, self.side);
        let heights = facet.corners.iter().map(|v| v.dot(view.towards));
        let (low, high) = heights.fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v), h.max(v)));
        let slope = [facet.normal.dot(view.right) / along / scale, -facet.normal.dot(view.up) / along / scale];
        let [x0, y0] = flat(first);
        let height = |x: usize, y: usize| {
            let plane = first.dot(view.towards) - slope[0] * (x as f64 - x0) - slope[1] * (y as f64 - y0);
            // nearly edge on, the plane is not to be trusted beyond its corners
            plane.clamp(low, high)
        };
        for pair in crossings.chunks_exact(2) {
            let [(row, from), (_, to)] = *pair else { continue };
            let column = |at: f64| at.ceil().clamp(0.0, self.side as f64) as usize;
            for x in column(from)..column(to) {
                let height = height(x, row);
                if let Some(seen) = self.seen.get_mut(row * self.side + x)
                    && height > seen.1 + ONE_DEPTH
                {
                    *seen = (number, height);
                }
            }
        }
    }
}

/// Where the outline of a polygon crosses rows of samples: row and column, sorted. An even number in every row.
fn crossings(points: &[[f64; 2]], rows: usize) -> Vec<(usize, f64)> {
    let mut out = Vec::new();
    let next = points.iter().cycle().skip(1);
    for (a, b) in points.iter().zip(next) {
        // an edge crosses at the same places from both of its sides
        let ([x0, y0], [x1, y1]) = if (a[1], a[0]) < (b[1], b[0]) { (*a, *b) } else { (*b, *a) };
        let row = |y: f64| y.ceil().clamp(0.0, rows as f64) as usize;
        let steep = (x1 - x0) / (y1 - y0);
        out.extend((row(y0)..row(y1)).map(|y| (y, x0 + steep * (y as f64 - y0))));
    }
    out.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    out
}

#[cfg(test)]
mod tests {
    use super::super::shape_picture_tests::{both, cuboid};
    use super::*;

    /// Part that a ray from far along `towards` meets first in boxes that are parallel to the axes.
    fn met(boxes: &[(DVec3, DVec3)], point: DVec3, towards: DVec3) -> Option<usize> {
        let enters = |(low, high): &(DVec3, DVec3)| {
            let (a, b) = ((low - point) / towards, (high - point) / towards);
            let (last, first) = (a.max(b).min_element(), a.min(b).max_element());
            (last > first).then_some(last)
        };
        let met = boxes.iter().enumerate().filter_map(|(k, b)| Some((k, enters(b)?)));
        met.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(k, _)| k)
    }

    #[test]
    fn boxes_in_each_other_hide_each_other_as_rays_say() {
        // three boxes that reach into each other, in units of half the extent
        let boxes = [
            (DVec3::new(-1.0, -0.4, -0.3), DVec3::new(1.0, 0.4, 0.3)),
            (DVec3::new(-0.3, -1.0, -0.5), DVec3::new(0.2, 1.0, 0.1)),
            (DVec3::new(-0.5, -0.6, -1.0), DVec3::new(0.6, 0.1, 1.0)),
        ];
        let body = boxes.iter().enumerate().map(|(k, (l, h))| cuboid(*l, *h, k)).reduce(both).expect("three");
        let scene = Scene::of(&body);
        let (reach, side) = (2.0, 300);
        // in directions of round numbers whole rows of samples lie on edges
        for towards in
            [[0.3137, 0.5291, 0.8173], [-0.9031, 0.2239, -0.1157], [0.1093, -0.7121, 0.4339]].map(DVec3::from)
        {
            let towards = towards.normalize();
            let (right, up) = towards.any_orthonormal_pair();
            let buffer = scene.samples(&View { right, up, towards }, reach, side);
            let (mut wrong, mut covered) = (0, 0);
            for k in 0..side * side {
                let along = |at: usize| ((at as f64 + 0.5) / side as f64 * 2.0 - 1.0) * reach;
                let point = right * along(k % side) - up * along(k / side);
                let seen = scene.0.get(buffer.at(k % side, k / side).0 as usize).map(|f| f.part);
                let expected = met(&boxes, point, towards);
                covered += usize::from(expected.is_some());
                wrong += usize::from(seen != expected);
            }
            assert!(covered > 10_000, "{covered}");
            // samples whose ray passes within rounding of an edge
            assert!(wrong <= 3, "{wrong} of {covered}");
        }
    }

    #[test]
    fn right_and_up_are_where_the_views_say() {
        use super::super::shape_picture::VIEWS;
        use crate::io::shape_file::Uncertainty;
        let mut mark = cuboid(DVec3::splat(0.5), DVec3::splat(1.1), 1);
        mark.faces.iter_mut().for_each(|face| face.uncertainty = Uncertainty::Unclaimed);
        let scene = Scene::of(&both(cuboid(DVec3::splat(-1.0), DVec3::ONE, 0), mark));
        // the corner at +x, +y and +z: +x is to the left where the observer is at +y
        for ((from, _, _, view), left) in VIEWS.iter().zip([false, true, false]) {
            let rgb = scene.seen(view, 1.2, 60);
            let is_grey = |x: usize, y: usize| {
                let at = 3 * (60 * y + x);
                rgb[at] == rgb[at + 1] && rgb[at] < 240
            };
            let corners = [(12, 12), (47, 12), (12, 47), (47, 47)].map(|(x, y)| is_grey(x, y));
            assert_eq!(corners, [left, !left, false, false], "{from}");
            assert_eq!(view.right.cross(view.up), view.towards, "{from}");
        }
    }

    #[test]
    fn of_two_sides_of_a_plate_the_one_that_faces_is_seen() {
        let mut body = cuboid(DVec3::new(-1.0, -1.0, 0.0), DVec3::new(1.0, 1.0, 0.0), 0);
        body.faces.iter_mut().enumerate().for_each(|(k, face)| face.part = k);
        let scene = Scene::of(&body);
        for (towards, part) in [(DVec3::NEG_Z, 4), (DVec3::Z, 5)] {
            let buffer = scene.samples(&View { right: DVec3::X, up: DVec3::Y, towards }, 1.2, 50);
            let seen = scene.0.get(buffer.at(25, 25).0 as usize).map(|f| f.part);
            assert_eq!(seen, Some(part));
        }
    }

    #[test]
    fn facets_beside_each_other_leave_no_cracks() {
        let ball = super::super::shape_picture_tests::ball(24);
        let scene = Scene::of(&ball);
        let view = View { right: DVec3::X, up: DVec3::Y, towards: DVec3::Z };
        let buffer = scene.samples(&view, 1.0, 401);
        // a sphere of 24 segments a side of its cube stays outside of 0.99 of its radius
        for k in 0..401 * 401usize {
            let [x, y] = [k % 401, k / 401].map(|at| (at as f64 - 200.0) / 200.5);
            let (face, height) = buffer.at(k % 401, k / 401);
            let square = x * x + y * y;
            assert!(square > 0.97 || face != NONE, "{x} {y}");
            assert!(square > 0.9 || (height - (1.0 - square).sqrt()).abs() < 0.02, "{x} {y} {height}");
        }
    }

    #[test]
    fn outlines_with_holes_are_filled_by_their_area() {
        let outer = [[5., 5.], [85., 5.], [85., 85.], [5., 85.], [5., 5.]];
        let inner = [[25., 25.], [25., 65.], [65., 65.], [65., 25.], [25., 25.]];
        let crossings = crossings(&[outer, inner].concat(), 100);
        let filled = crossings.chunks_exact(2).map(|p| p[1].1.ceil() - p[0].1.ceil()).sum::<f64>();
        assert_eq!(filled, 80.0 * 80.0 - 40.0 * 40.0);
        assert!(crossings.chunks_exact(2).all(|pair| pair[0].0 == pair[1].0));
    }
}
