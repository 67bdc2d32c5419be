//! The light of convex bodies at many epochs at once, and its derivatives: what inversion works with.
//!
//! Nothing hides anything on a convex body: y_t = sum over facets of G_ti a_i with G_ti = f (n_i.s_t)+ (n_i.o_t)+ (Kaasalainen &
//! Torppa 2001, Icarus 153, 24, Eq. 1 and 2). Lambert facets are summed over lanes of epochs; others one by one.

use super::matter::{Material, Model, gradient, weight};
use crate::base::simd::Path;
use glam::DVec3;
use std::f64::consts::PI;

/// Directions to the Sun and to the observer at many epochs, in body axes, by components.
#[derive(Debug, Clone, Default)]
pub struct Epochs {
    sun: [Vec<f64>; 3],
    observer: [Vec<f64>; 3],
}

/// A facet: outward unit normal and area \[m^2\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Facet {
    /// Normal.
    pub normal: DVec3,
    /// Area \[m^2\].
    pub area: f64,
}

/// Epochs summed at a time: their directions and sums stay in the nearest cache.
const BLOCK: usize = 256;

impl Epochs {
    /// Of unit vectors to the Sun and to the observer.
    pub fn new(directions: impl IntoIterator<Item = (DVec3, DVec3)>) -> Self {
        let mut epochs = Self::default();
        for (sun, observer) in directions {
            for axis in 0..3 {
                epochs.sun[axis].push(sun[axis]);
                epochs.observer[axis].push(observer[axis]);
            }
        }
        epochs
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.sun[0].len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The directions to Sun and observer at epoch number `t`.
    pub fn at(&self, t: usize) -> (DVec3, DVec3) {
        let vector = |v: &[Vec<f64>; 3]| DVec3::new(v[0][t], v[1][t], v[2][t]);
        (vector(&self.sun), vector(&self.observer))
    }

    /// Normalised irradiance \[m^2/sr\] of facets of one material at every epoch.
    pub fn curve(&self, facets: &[Facet], material: &Material, sun_radius: f64) -> Vec<f64> {
        let mut out = vec![0.0; self.len()];
        for facet in facets {
            self.add(facet, material, sun_radius, &mut out);
        }
        out
    }

    /// Column of the flux matrix: what a facet of this normal and 1 m^2 gives at every epoch \[1/sr\].
    pub fn column(&self, normal: DVec3, material: &Material, sun_radius: f64) -> Vec<f64> {
        self.curve(&[Facet { normal, area: 1.0 }], material, sun_radius)
    }

    fn add(&self, facet: &Facet, material: &Material, sun_radius: f64, out: &mut [f64]) {
        if material.model == Model::Lambert {
            return self.add_lambert(facet.normal, material.diffuse / PI * facet.area, out);
        }
        for (t, out) in out.iter_mut().enumerate() {
            let (sun, observer) = self.at(t);
            *out += facet.area * weight(material, facet.normal, sun, observer, sun_radius);
        }
    }

    fn add_lambert(&self, n: DVec3, factor: f64, out: &mut [f64]) {
        let [sx, sy, sz] = &self.sun;
        let [ox, oy, oz] = &self.observer;
        Path::best().run(
            #[inline(always)]
            || {
                for first in (0..out.len()).step_by(BLOCK) {
                    let last = (first + BLOCK).min(out.len());
                    let [sx, sy, sz, ox, oy, oz] = [sx, sy, sz, ox, oy, oz].map(|v| &v[first..last]);
                    for (k, out) in out[first..last].iter_mut().enumerate() {
                        let to_sun = n.x * sx[k] + n.y * sy[k] + n.z * sz[k];
                        let to_observer = n.x * ox[k] + n.y * oy[k] + n.z * oz[k];
                        *out += factor * to_sun.max(0.0) * to_observer.max(0.0);
                    }
                }
            },
        );
    }

    /// The column of a normal with its derivatives along two directions at every epoch \[1/sr\], the Sun a point; moves along the
    /// normal count, so that those across it are the ones on the sphere.
    pub fn column_slopes(&self, normal: DVec3, along: [DVec3; 2], material: &Material) -> [Vec<f64>; 3] {
        let mut out = [(); 3].map(|()| vec![0.0; self.len()]);
        if material.model == Model::Lambert {
            self.put_lambert(normal, along, material.diffuse / PI, &mut out);
            return out;
        }
        let [value, first, second] = &mut out;
        for (t, ((value, first), second)) in value.iter_mut().zip(first).zip(second).enumerate() {
            let (sun, observer) = self.at(t);
            let (flux, slope) = gradient(material, normal, sun, observer);
            (*value, *first, *second) = (flux, slope.dot(along[0]), slope.dot(along[1]));
        }
        out
    }

    fn put_lambert(&self, n: DVec3, along: [DVec3; 2], factor: f64, out: &mut [Vec<f64>; 3]) {
        let [sx, sy, sz] = self.sun.each_ref().map(|v| &v[..self.len()]);
        let [ox, oy, oz] = self.observer.each_ref().map(|v| &v[..self.len()]);
        let [value, first, second] = out.each_mut().map(|v| &mut v[..self.len()]);
        let [e, f] = along;
        Path::best().run(
            #[inline(always)]
            || {
                for k in 0..self.len() {
                    let sun = |d: DVec3| d.x * sx[k] + d.y * sy[k] + d.z * sz[k];
                    let observer = |d: DVec3| d.x * ox[k] + d.y * oy[k] + d.z * oz[k];
                    let (cs, co) = (sun(n), observer(n));
                    let lit = if cs > 0.0 && co > 0.0 { factor } else { 0.0 };
                    value[k] = lit * (cs * co);
                    first[k] = lit * (sun(e) * co + observer(e) * cs);
                    second[k] = lit * (sun(f) * co + observer(f) * cs);
                }
            },
        );
    }
}
