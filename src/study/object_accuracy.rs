//! Error against run time of the ways to find shadows, for a shape at many attitudes, against the exact way.

use super::errors::{Errors, row};
use crate::base::accuracy::AccuracyRow;
use crate::object::shadow::bvh::Bvh;
use crate::object::shadow::card::Graphics;
use crate::object::shadow::exact::Exact;
use crate::object::shadow::raster::{self, Buffers};
use crate::object::shadow::rays;
use crate::object::shape::Shape;
use crate::object::way::Way;
use crate::plan::brightness::Means;
use crate::scene::{Brightness, Scene};
use glam::{DQuat, DVec3};
use std::f64::consts::PI;

/// Attitudes at which the ways are compared.
const ATTITUDES: usize = 40;
/// Angular radius of the Sun at 1 au \[rad\].
const SUN_RADIUS: f64 = 4.6524e-3;
/// Longest time for one setting \[s\]: slower ones are left out.
const LONGEST_S: f64 = 20.0;

/// Directions to Sun and observer at so many attitudes, spread evenly, at phase angles from 0 to 100 deg.
pub fn attitudes(count: usize) -> Vec<(DVec3, DVec3)> {
    let golden = PI * (3.0 - 5f64.sqrt());
    let one = |k: usize| {
        let z = 1.0 - 2.0 * (k as f64 + 0.5) / count as f64;
        let turn = golden * k as f64;
        let sun = DVec3::new((1.0 - z * z).sqrt() * turn.cos(), (1.0 - z * z).sqrt() * turn.sin(), z);
        let phase = (100.0 * ((k * 7) % count) as f64 / count as f64).to_radians();
        let axis = DQuat::from_axis_angle(sun, 2.7 * turn) * sun.any_orthonormal_vector();
        (sun, DQuat::from_axis_angle(axis, phase) * sun)
    };
    (0..count).map(one).collect()
}

/// One way and how it went.
struct Trial<'a> {
    name: &'a str,
    setting: String,
    default: bool,
}

/// Rows of one shape. `clock` gives seconds since some moment; `chosen` is the way of the scene.
pub fn shape_rows(
    name: &str,
    shape: &Shape,
    chosen: Way,
    graphics: &Graphics,
    clock: &(dyn Fn() -> f64 + Sync),
) -> Vec<AccuracyRow> {
    let directions = attitudes(ATTITUDES);
    let mut body = shape.body.clone();
    let weights = directions.iter().map(|(sun, observer)| {
        let mut weight = Vec::new();
        let (earth, velocity) = (DVec3::NAN, DVec3::NAN);
        let around = crate::astro::attitude::Surroundings { earth, sun: *sun, velocity, observer: *observer };
        shape.pose(&around, &mut body);
        shape.weights(&body, *sun, *observer, SUN_RADIUS, &mut weight);
        (body.clone(), weight)
    });
    let epochs = weights.zip(&directions).map(|((b, w), d)| (b, w, *d)).collect::<Vec<_>>();
    let mut rows = Vec::new();
    let mut reference = Vec::new();
    let mut scale = 0.0;
    let mut measure = |trial: Trial, bytes: usize, find: &mut dyn FnMut(usize) -> f64| {
        let began = clock();
        let mut found = Vec::new();
        for k in 0..ATTITUDES {
            found.push(find(k));
            if clock() - began > LONGEST_S {
                return false;
            }
        }
        let took = (clock() - began) / ATTITUDES as f64;
        if reference.is_empty() {
            reference.clone_from(&found);
            scale = (found.iter().map(|y| y * y).sum::<f64>() / ATTITUDES as f64).sqrt();
        }
        let errors = found.iter().zip(&reference).map(|(y, exact)| (y - exact) / scale).collect::<Vec<_>>();
        let full = format!("object.{}", trial.name);
        let setting = format!("{name}: {}", trial.setting);
        let mut row = row(&full, setting, &Errors::of(&errors), "of the rms light", took, bytes);
        row.default = trial.default;
        rows.push(row);
        true
    };
    let trial = |name, setting: String, default| Trial { name, setting, default };
    let mut exact = Exact::default();
    measure(trial("exact", "clipped polygons".into(), chosen == Way::Exact), 0, &mut |k| {
        let (body, weight, (sun, observer)) = &epochs[k];
        exact.flux(body, *sun, *observer, weight)
    });
    measure(trial("no-shadows", "sum over facets".into(), chosen == Way::Convex), 0, &mut |k| {
        let (body, weight, _) = &epochs[k];
        weight.iter().zip(&body.areas).map(|(w, a)| w * a).sum()
    });
    if shape.is_convex() {
        return rows;
    }
    let mut bvh = Bvh::new(&shape.body);
    for rays in [100, 1_000, 10_000, 100_000, 1_000_000] {
        let done = measure(trial("rays", format!("{rays} rays"), false), 0, &mut |k| {
            let (body, weight, (sun, observer)) = &epochs[k];
            if shape.moves() {
                bvh.refit(body);
            }
            rays::View::new(body, &bvh, *sun, *observer, weight).flux(rays, k as u64).value
        });
        if !done {
            break;
        }
    }
    let mut buffers = Buffers::default();
    for side in [64, 128, 256, 512, 1024, 2048, 4096] {
        let bytes = 2 * 8 * side * side;
        let done = measure(trial("map", format!("{side} px"), false), bytes, &mut |k| {
            let (body, weight, (sun, observer)) = &epochs[k];
            raster::flux(body, *sun, *observer, weight, side as u32, &mut buffers)
        });
        if !done {
            break;
        }
    }
    if let Some(card) = &graphics.card {
        let all = epochs.iter().map(|(_, weight, (sun, observer))| (*sun, *observer, weight.as_slice()));
        let all = all.collect::<Vec<_>>();
        for side in [64u32, 128, 256, 512, 1024, 2048, 4096] {
            let mut found = Vec::new();
            let bytes = 2 * 8 * side as usize * side as usize;
            // one submission of all: its time is that of the first
            let done = measure(trial("device", format!("{side} px"), false), bytes, &mut |k| {
                if k == 0 && !shape.moves() {
                    found = card.flux(&shape.body, &all, side).unwrap_or_default();
                } else if shape.moves() {
                    let (body, _, _) = &epochs[k];
                    found.extend(card.flux(body, &all[k..=k], side).unwrap_or_default());
                }
                found.get(k).copied().unwrap_or(f64::NAN)
            });
            if !done {
                break;
            }
        }
    }
    rows
}

/// Rows of all shapes of a scene.
pub fn rows(scene: &Scene, graphics: &Graphics, clock: &(dyn Fn() -> f64 + Sync)) -> Vec<AccuracyRow> {
    let shapes = scene.target.iter().filter_map(|target| match &target.brightness {
        Brightness::Shape(shaped) => Some((target.name.as_str(), shaped)),
        Brightness::MagV(_) => None,
    });
    let rows = shapes.flat_map(|(name, shaped)| {
        let chosen = Means::of(shaped, scene.accuracy.brightness, graphics).way;
        shape_rows(name, &shaped.built, chosen, graphics, clock)
    });
    rows.collect()
}
