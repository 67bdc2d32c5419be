//! A resolved picture of a shape, for looking at: what an observer nearby would see of it in sunlight.

use super::shadow::body::Body;
use super::shadow::raster::{self, Buffers, NONE};
use super::shape::{Lighting, Shape};
use glam::DVec3;

/// Samples along each side of a pixel.
const SAMPLES: u32 = 2;
/// Light of what the Sun does not reach, as a share of a white face's; and of the sky beside the body.
const AMBIENT: f64 = 0.05;
const SKY: f64 = 0.006;
/// Radiance that is white: a perfectly white face under the Sun has 1/pi.
const WHITE: f64 = 0.22;
/// Tints by group, so that parts are told apart: close to grey.
const TINTS: [DVec3; 6] = [
    DVec3::new(1.0, 0.96, 0.88),
    DVec3::new(0.72, 0.84, 1.0),
    DVec3::new(1.0, 0.88, 0.72),
    DVec3::new(0.86, 1.0, 0.88),
    DVec3::new(1.0, 0.84, 0.92),
    DVec3::new(0.92, 0.92, 0.92),
];

/// The picture, `side` pixels a side, by rows from the top: red, green and blue; `up` (body axes) points upwards.
///
/// Shadows are those of maps, finer than the pixels. Brightness is the square root of the radiance, as on a screen.
pub fn picture(shape: &Shape, lighting: &Lighting, up: DVec3, side: u32) -> Vec<u8> {
    let around = &lighting.around;
    let mut body = shape.body.clone();
    shape.pose(around, &mut body);
    let mut weight = Vec::new();
    shape.weights(&body, around.sun, around.observer, lighting.sun_radius, &mut weight);
    let fine = SAMPLES * side.clamp(1, 2048);
    let view = raster::picture(&body, around.sun, around.observer, up, fine, &mut Buffers::default());
    let colour = |pixel: usize| match view.face.get(pixel) {
        Some(face) if *face != NONE => {
            let face = *face as usize;
            let lit = view.lit.get(pixel).copied().unwrap_or(false);
            let tint = shape.group_of.get(face).map_or(DVec3::ONE, |g| TINTS[usize::from(*g) % TINTS.len()]);
            tint * (shade(&body, face, around.observer)
                + if lit { radiance(&body, &weight, face, around) } else { 0.0 })
        }
        _ => DVec3::splat(SKY),
    };
    let (side, samples) = ((fine / SAMPLES) as usize, SAMPLES as usize);
    let mut out = Vec::with_capacity(3 * side * side);
    for y in 0..side {
        for x in 0..side {
            let pixels = (0..samples * samples).map(|k| {
                let (row, column) = (y * samples + k / samples, x * samples + k % samples);
                colour(row * fine as usize + column)
            });
            let mean = pixels.sum::<DVec3>() / (samples * samples) as f64;
            out.extend(mean.to_array().map(|v| (255.0 * v.clamp(0.0, 1.0).sqrt()).round() as u8));
        }
    }
    out
}

/// Radiance of a lit face as a share of white.
fn radiance(body: &Body, weight: &[f64], face: usize, around: &crate::astro::attitude::Surroundings) -> f64 {
    let cosine = body.normals[face].dot(around.observer).abs().max(1e-6);
    weight.get(face).copied().unwrap_or(0.0) / cosine / WHITE
}

/// A little light from the observer's side, so that the form of dark parts is seen.
fn shade(body: &Body, face: usize, observer: DVec3) -> f64 {
    AMBIENT * (0.25 + 0.75 * body.normals[face].dot(observer).abs())
}
