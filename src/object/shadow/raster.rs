//! Light of a body by two face maps: which face each pixel sees, from the Sun and from the observer.
//!
//! Each observer pixel sees a point p of a face i, exactly on the plane of i. It is lit unless the Sun's pixel of p sees
//! another face j that is above. The map knows j at the middle of its pixel alone, up to half a pixel off p's ray, where the
//! plane of i has another height: (h/2)(|dz/du| + |dz/dv|) at most, for pixels of size h. That is the bias which a depth map
//! would need. Here it is not bounded but taken out: the plane of i is followed to the middle of the pixel, to a point q,
//! and j hides p if its plane is above both p and q. The first keeps faces that meet in a hollow from hiding each other, the
//! second those that meet in a ridge, and neither depends on the depths that were stored.
//!
//! Error: half a pixel along every outline and every edge of a shadow, without a preferred sign, so 1/side times the length
//! of the outlines at worst and about side^-1.5 in the mean. Surfaces closer together than [`CONTACT`] do not shade each
//! other. The twin on the GPU is `gpu.rs`.

use super::body::Body;
use super::frame::{Frame, Scaled, Scene};
use glam::{DVec2, DVec3};

/// A pixel without a face.
pub const NONE: u32 = u32::MAX;

/// Largest side of a map \[px\].
pub const LARGEST_SIDE: u32 = 8192;

/// Gap below which two surfaces touch \[bounding radii\]: above the rounding of the f32 positions on the GPU, 1e-6.
pub const CONTACT: f64 = 1e-5;

/// Room for points on an edge \[px\]: neighbours that share it leave no pixel between them.
const SLACK: f64 = 1e-9;

/// Memory of the maps, for use again and again.
#[derive(Debug, Clone, Default)]
pub struct Buffers {
    scaled: Scaled,
    sun: FaceMap,
    view: FaceMap,
    glow: Vec<f64>,
}

/// What an observer sees of a body, row by row from the top left.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct View {
    /// Pixels a side.
    pub side: u32,
    /// Size of a pixel \[m\].
    pub pixel: f64,
    /// Face in each pixel; [`NONE`] beside the body.
    pub face: Vec<u32>,
    /// Whether the Sun shines on the side that is seen and nothing is in between.
    pub lit: Vec<bool>,
    /// Distance behind the plane that touches the bounding sphere \[m\]; infinite beside the body.
    pub depth: Vec<f32>,
}

/// The nearest face in each pixel, and its height towards the eye \[radii\].
#[derive(Debug, Clone, Default)]
struct FaceMap {
    face: Vec<u32>,
    height: Vec<f32>,
}

/// Sum of `weight` times the area of each face that `observer` sees and `sun` lights \[unit of weight m^2\].
///
/// `sun` and `observer` point away from the body, in its axes; `weight` is light per area of each face, with both cosines.
/// The maps have `side` pixels a side, 1 to [`LARGEST_SIDE`]. Nothing to see gives 0, as do directions and weights that are
/// no numbers.
pub fn flux(body: &Body, sun: DVec3, observer: DVec3, weight: &[f64], side: u32, buffers: &mut Buffers) -> f64 {
    let side = side.clamp(1, LARGEST_SIDE);
    let (Some(sun), Some(observer)) = (sun.try_normalize(), observer.try_normalize()) else { return 0.0 };
    let Buffers { scaled, sun: sun_map, view: view_map, glow } = buffers;
    if !scaled.set(body) {
        return 0.0;
    }
    let (sun, view) = (Frame::fitted(scaled, sun, side), Frame::fitted(scaled, observer, side));
    let scene = Scene { body, scaled, sun, view };
    glow.clear();
    glow.extend((0..body.faces.len()).map(|i| scene.glow(i, weight)));
    if glow.iter().all(|g| *g == 0.0) {
        return 0.0;
    }
    sun_map.draw(&scene, &scene.sun);
    view_map.draw(&scene, &scene.view);
    let mut sum = 0.0;
    each_pixel(&scene, view_map, |_, receiver, at| {
        let glow = glow.get(receiver.face).copied().unwrap_or(0.0);
        if glow > 0.0 && receiver.is_lit(&scene, sun_map, at) {
            sum += glow;
        }
    });
    let flux = sum * view.pixel_area() * scaled.radius.powi(2);
    if flux.is_finite() { flux } else { 0.0 }
}

/// The body as `observer` sees it, with `up` (body axes) upwards as far as it can be, in square pixels.
///
/// Directions, `side` and bodies as in [`flux`]; without anything to see the picture is empty and `side` pixels large.
pub fn picture(body: &Body, sun: DVec3, observer: DVec3, up: DVec3, side: u32, buffers: &mut Buffers) -> View {
    let side = side.clamp(1, LARGEST_SIDE);
    let pixels = side as usize * side as usize;
    let mut picture = View { side, lit: vec![false; pixels], ..View::default() };
    let directions = (sun.try_normalize(), observer.try_normalize());
    let Buffers { scaled, sun: sun_map, view: view_map, .. } = buffers;
    if let (Some(sun), Some(observer)) = directions
        && scaled.set(body)
    {
        let (sun, view) = (Frame::fitted(scaled, sun, side), Frame::upright(scaled, observer, up, side));
        let scene = Scene { body, scaled, sun, view };
        sun_map.draw(&scene, &scene.sun);
        view_map.draw(&scene, &scene.view);
        each_pixel(&scene, view_map, |i, receiver, at| {
            picture.lit[i] = scene.sunward(receiver.face) && receiver.is_lit(&scene, sun_map, at);
        });
        picture.pixel = view.step[0].length() * scaled.radius;
        picture.depth = view_map.height.iter().map(|h| (scaled.radius * (1.0 - f64::from(*h))) as f32).collect();
        picture.face.clone_from(&view_map.face);
    } else {
        picture.face = vec![NONE; pixels];
        picture.depth = vec![f32::INFINITY; pixels];
    }
    picture
}

/// Calls `light` for each pixel with a face: its index, the face and the pixel coordinates of its middle.
fn each_pixel(scene: &Scene, map: &FaceMap, mut light: impl FnMut(usize, &Receiver, DVec2)) {
    let mut receiver = Receiver::new(scene, NONE as usize);
    for (row, faces) in map.face.chunks_exact(scene.view.side as usize).enumerate() {
        for (column, face) in faces.iter().enumerate().filter(|(_, face)| **face != NONE) {
            if receiver.face != *face as usize {
                receiver = Receiver::new(scene, *face as usize);
            }
            let at = DVec2::new(column as f64 + 0.5, row as f64 + 0.5);
            light(row * scene.view.side as usize + column, &receiver, at);
        }
    }
}

/// A face that the observer sees: its points and their places in the Sun's map are linear in the pixel coordinates.
struct Receiver {
    face: usize,
    /// Point of the plane at pixel (0, 0), and its steps along a row and a column \[radii\].
    point: [DVec3; 3],
    /// The same in the Sun's map \[px\].
    place: [DVec2; 3],
    /// Steps of the plane per pixel of the Sun's map \[radii\].
    sunward: [DVec3; 2],
}

impl Receiver {
    fn new(scene: &Scene, face: usize) -> Self {
        let (sun, view) = (&scene.sun, &scene.view);
        let normal = scene.body.normals.get(face).copied().unwrap_or_default();
        let offset = scene.scaled.offset.get(face).copied().unwrap_or(f64::NAN);
        // along the ray to the height where it meets the plane
        let onto = |x: DVec3, eye: DVec3, offset: f64| x + eye * ((offset - normal.dot(x)) / normal.dot(eye));
        let corner = -(view.step[0] * view.origin.x + view.step[1] * view.origin.y);
        let along = |k: usize| onto(view.step[k], view.eye, 0.0);
        let point = [onto(corner, view.eye, offset), along(0), along(1)];
        let place = [sun.pixel(point[0]), sun.pixel(point[1]) - sun.origin, sun.pixel(point[2]) - sun.origin];
        Self { face, point, place, sunward: [0, 1].map(|k| onto(sun.step[k], sun.eye, 0.0)) }
    }

    /// Whether the Sun reaches the face at pixel coordinates `at` of the view.
    fn is_lit(&self, scene: &Scene, map: &FaceMap, at: DVec2) -> bool {
        let place = self.place[0] + self.place[1] * at.x + self.place[2] * at.y;
        let last = f64::from(scene.sun.side - 1);
        let texel = place.floor().clamp(DVec2::ZERO, DVec2::splat(last));
        let index = texel.y as usize * scene.sun.side as usize + texel.x as usize;
        let other = map.face.get(index).map_or(self.face, |face| *face as usize);
        if other == self.face || other == NONE as usize {
            return true;
        }
        let normal = scene.body.normals.get(other).copied().unwrap_or_default();
        let offset = scene.scaled.offset.get(other).copied().unwrap_or(f64::NAN);
        let up = normal.dot(scene.sun.eye).signum();
        let hides = |x: DVec3| (offset - normal.dot(x)) * up > CONTACT;
        let p = self.point[0] + self.point[1] * at.x + self.point[2] * at.y;
        let shift = texel + 0.5 - place;
        let q = p + self.sunward[0] * shift.x + self.sunward[1] * shift.y;
        !(hides(p) && hides(q))
    }
}

impl FaceMap {
    /// Draws the body as the eye of `frame` sees it.
    fn draw(&mut self, scene: &Scene, frame: &Frame) {
        let pixels = frame.side as usize * frame.side as usize;
        self.face.clear();
        self.face.resize(pixels, NONE);
        self.height.clear();
        self.height.resize(pixels, f32::NEG_INFINITY);
        for i in (0..scene.body.faces.len()).filter(|i| scene.shows(*i, frame)) {
            let drawable = scene.scaled.offset.get(i).is_some_and(|offset| offset.is_finite());
            if let Some(corners) = scene.scaled.corners(scene.body, i).filter(|_| drawable) {
                let sunk = f64::from(scene.scaled.sunk.get(i).copied().unwrap_or(0.0));
                let corners = corners.map(|p| frame.pixel(p).extend(p.dot(frame.eye) - sunk));
                self.fill(i as u32, corners, frame.side);
            }
        }
    }

    /// Draws a triangle with corners (column, row, height).
    fn fill(&mut self, id: u32, [a, b, c]: [DVec3; 3], side: u32) {
        let (p, q) = (b - a, c - a);
        let area = p.truncate().perp_dot(q.truncate());
        if !area.is_normal() {
            return;
        }
        let slope = DVec2::new(p.z * q.y - q.z * p.y, q.z * p.x - p.z * q.x) / area;
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        for row in span(low.y, high.y, side) {
            let y = row as f64 + 0.5;
            let (mut left, mut right) = (f64::INFINITY, f64::NEG_INFINITY);
            for (from, to) in [(a, b), (b, c), (c, a)] {
                let (top, bottom) = (from.y.min(to.y), from.y.max(to.y));
                // past its ends by the slack at most
                let x = from.x + (to.x - from.x) * ((y - from.y) / (to.y - from.y)).clamp(0.0, 1.0);
                if bottom > top && y >= top - SLACK && y <= bottom + SLACK {
                    (left, right) = (left.min(x), right.max(x));
                }
            }
            let columns = span(left, right, side);
            let start = a.z + slope.x * (columns.start as f64 + 0.5 - a.x) + slope.y * (y - a.y);
            let pixels = row * side as usize + columns.start..row * side as usize + columns.end;
            let (Some(faces), Some(heights)) = (self.face.get_mut(pixels.clone()), self.height.get_mut(pixels))
            else {
                continue;
            };
            let (start, slope) = (start as f32, slope.x as f32);
            for (k, (face, height)) in faces.iter_mut().zip(heights).enumerate() {
                // a steep face is no higher than its corners, whatever the rounding
                let z = (start + slope * k as f32).max(low.z as f32).min(high.z as f32);
                let nearer = z > *height;
                *face = if nearer { id } else { *face };
                *height = if nearer { z } else { *height };
            }
        }
    }
}

/// Pixels whose middles lie between two coordinates.
fn span(from: f64, to: f64, side: u32) -> std::ops::Range<usize> {
    let first = (from - 0.5 - SLACK).ceil().max(0.0) as usize;
    let end = ((to + 0.5 + SLACK).floor().max(0.0) as usize).min(side as usize);
    first.min(end)..end
}
