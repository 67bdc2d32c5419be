//! World coordinates from pairs of detections and stars.
//!
//! Offsets u from the reference pixel are mapped to the tangent plane by one of a ladder of models: a similarity of the a-priori map;
//! the same with the radial distortion q (1 + k u u) of third order (k complex: a turn growing outwards with it); an affine map;
//! polynomials of second to fifth order. What the a-priori map has in terms beyond a model's order is kept. A model replaces
//! a simpler one if it predicts left-out stars better by more than its added parameters would improve the fit to noise: the
//! leave-one-out sum falls by a share of more than half the number of added parameters per pair.

use super::nested::Nested;
use crate::astro::angles;
use crate::plan::sip::{HIGHEST, SIP_TERMS, Sip};
use crate::plan::wcs::{Wcs, east_north};
use glam::{DMat2, DMat3, DVec2, DVec3};

/// What was fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Model {
    /// Shift, rotation and scale of the a-priori world coordinates: 4 parameters.
    Similarity,
    /// A similarity with radial distortion of third order: 6 parameters.
    Radial,
    /// A CD matrix and the reference place: 6 parameters.
    Linear,
    /// A CD matrix, the reference place and SIP terms up to this order, 2 to 5.
    Sip(i32),
}

impl Model {
    /// Number of complex coefficients, each of two parameters.
    fn terms(self) -> usize {
        match self {
            Self::Similarity => 2,
            Self::Radial | Self::Linear => 3,
            Self::Sip(order) => ((order + 1) * (order + 2) / 2) as usize,
        }
    }

    /// The highest order of its polynomials; 1 where it has none.
    pub(super) fn order(self) -> i32 {
        if let Self::Sip(order) = self { order } else { 1 }
    }

    /// Number of parameters of both axes.
    pub fn parameters(self) -> usize {
        2 * self.terms()
    }
}

/// A detection and its star.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pair {
    /// Place of the detection \[px\].
    pub pixel: DVec2,
    /// Direction of the star.
    pub sky: DVec3,
    /// 1 / variance per axis \[px^-2\]; 0 leaves it out.
    pub weight: f64,
}

/// A fitted model.
#[derive(Debug, Clone)]
pub(super) struct Fitted {
    pub model: Model,
    pub wcs: Wcs,
    /// Standard error per axis at the reference place and the largest at places asked for \[px\].
    pub errors: [f64; 2],
    left_out: f64,
}

/// The shortest turn of the sphere that takes a unit vector to another, not opposite one: 1 + K + K^2 / (1 + cos), K the cross product
/// with `from` x `to` (Rodrigues 1840). It is exact for small angles too, which about a pole turn the meridian by much.
pub(super) fn arc(from: DVec3, to: DVec3) -> DMat3 {
    let axis = from.cross(to);
    let column = |v: DVec3| v + axis.cross(v) + axis.cross(axis.cross(v)) / (1.0 + from.dot(to));
    DMat3::from_cols(column(DVec3::X), column(DVec3::Y), column(DVec3::Z))
}

/// The steps of a camera's pixels, about the direction `from`, after a turn of the sphere.
pub(super) fn carried(cd: DMat2, from: DVec3, turn: DMat3) -> DMat2 {
    let ((east, north), (new_east, new_north)) = (east_north(from), east_north(turn * from));
    let column = |step: DVec2| {
        let step = turn * (east * step.x + north * step.y);
        DVec2::new(step.dot(new_east), step.dot(new_north))
    };
    DMat2::from_cols(column(cd.x_axis), column(cd.y_axis))
}

/// World coordinates about a direction.
pub(super) fn about(centre: DVec3, crpix: DVec2, cd: DMat2, sip: Option<Sip>) -> Wcs {
    let (ra, dec) = angles(centre);
    Wcs::new(ra, dec, crpix, cd, sip.filter(|sip| *sip != Sip::default()))
}

/// Powers (of u, of v) of the terms of a polynomial, by orders: a constant, a linear map and [`SIP_TERMS`].
const POWERS: [(usize, usize); 21] = {
    let mut powers = [(0, 0); 21];
    powers[1] = (1, 0);
    powers[2] = (0, 1);
    let mut k = 0;
    while k < SIP_TERMS.len() {
        powers[3 + k] = (SIP_TERMS[k].0 as usize, SIP_TERMS[k].1 as usize);
        k += 1;
    }
    powers
};

/// A fit in the making: pairs about the present reference place.
struct Plane<'a> {
    present: &'a Wcs,
    prior: Sip,
    weights: Vec<f64>,
    /// Offsets from the reference pixel \[px\].
    offsets: Vec<DVec2>,
    /// Stars in the tangent plane, in pixels of `scale`.
    targets: Vec<DVec2>,
    /// Side of a pixel \[rad\].
    scale: f64,
    /// Largest offset \[px\].
    reach: f64,
    /// Offsets where the error is asked for \[px\].
    asked: [DVec2; 4],
}

impl<'a> Plane<'a> {
    fn new(pairs: &[Pair], present: &'a Wcs, asked: [DVec2; 4]) -> Option<Self> {
        let (east, north) = east_north(present.centre);
        let scale = present.pixel_scale();
        let targets: Vec<DVec2> = pairs
            .iter()
            .map(|p| DVec2::new(p.sky.dot(east), p.sky.dot(north)) / (p.sky.dot(present.centre) * scale))
            .collect();
        let offsets: Vec<DVec2> = pairs.iter().map(|p| p.pixel - present.crpix).collect();
        let reach = offsets.iter().map(|o| o.length()).fold(0.0, f64::max);
        let weights = pairs.iter().map(|p| p.weight).collect();
        let sound = reach > 0.0 && reach.is_finite() && scale > 0.0 && targets.iter().all(|t| t.is_finite());
        sound.then_some(Self {
            present,
            prior: present.sip.unwrap_or_default(),
            weights,
            offsets,
            targets,
            scale,
            reach,
            asked,
        })
    }

    /// Pixels' steps in the tangent plane, in pixels of `scale`.
    fn steps(&self) -> DMat2 {
        self.present.cd * (1.0 / self.scale)
    }

    /// A model of coefficients found: the place of the reference pixel, steps and distortion.
    fn fitted(&self, model: Model, shift: DVec2, cd: DMat2, sip: Sip, errors: [f64; 2], left_out: f64) -> Fitted {
        let (east, north) = east_north(self.present.centre);
        let shift = shift * self.scale;
        let centre = (self.present.centre + east * shift.x + north * shift.y).normalize();
        let cd = carried(cd * self.scale, self.present.centre, arc(self.present.centre, centre));
        Fitted { model, wcs: about(centre, self.present.crpix, cd, Some(sip)), errors, left_out }
    }

    /// Standard errors at the reference place and the largest where asked for.
    fn errors<const N: usize>(&self, nested: &Nested, terms: usize, row: impl Fn(DVec2) -> [f64; N]) -> [f64; 2] {
        let error = |at: DVec2| nested.error_at(&row(at)[..terms]);
        [error(DVec2::ZERO), self.asked.into_iter().map(error).fold(0.0, f64::max)]
    }

    /// Similarities of the a-priori map: real and imaginary parts are rows of their own.
    fn similarities(&self) -> Vec<Fitted> {
        let steps = self.steps();
        let bent = |at: DVec2| steps * (at + self.prior.shift(at)) / self.reach;
        let radial = |at: DVec2| steps * at / self.reach * (at / self.reach).length_squared();
        let real = |at: DVec2| {
            let (q, r) = (bent(at), radial(at));
            [1.0, 0.0, q.x, -q.y, r.x, -r.y]
        };
        let imaginary = |at: DVec2| {
            let (q, r) = (bent(at), radial(at));
            [0.0, 1.0, q.y, q.x, r.y, r.x]
        };
        let rows: Vec<_> = self.offsets.iter().flat_map(|&at| [real(at), imaginary(at)]).collect();
        let targets: Vec<_> =
            self.targets.iter().flat_map(|t| [DVec2::new(t.x, 0.0), DVec2::new(t.y, 0.0)]).collect();
        let weights: Vec<_> = self.weights.iter().flat_map(|&w| [w, w]).collect();
        let mut nested = Nested::new(&targets, &weights);
        let mut found = Vec::new();
        for (first, model) in [(0, Model::Similarity), (4, Model::Radial)] {
            let terms = 2 * model.terms();
            if !(first..terms).all(|k| nested.push(rows.iter().map(|r| r[k]))) {
                break;
            }
            let c: Vec<f64> = nested.coefficients().iter().map(|c| c.x).collect();
            let matrix =
                |k: usize| DMat2::from_cols_array(&[c[k], c[k + 1], -c[k + 1], c[k]]) * steps * (1.0 / self.reach);
            let cd = matrix(2);
            let mut sip = self.prior;
            if model == Model::Radial {
                // K u |u|^2 in terms of u^3, u^2 v, u v^2, v^3
                let k = cd.inverse() * matrix(4) * self.reach.powi(-2);
                for (term, column) in [k.x_axis, k.y_axis, k.x_axis, k.y_axis].into_iter().enumerate() {
                    sip.a[3 + term] += column.x;
                    sip.b[3 + term] += column.y;
                }
            }
            let errors = self.errors(&nested, terms, real);
            found.push(self.fitted(model, DVec2::new(c[0], c[1]), cd, sip, errors, nested.left_out()));
        }
        found
    }

    /// Polynomial corrections of the present map up to the order that twice as many pairs as terms allow.
    fn polynomials(&self, highest: i32) -> Vec<Fitted> {
        let steps = self.steps();
        let row = |at: DVec2| {
            let mut powers = [DVec2::ONE; HIGHEST as usize + 1];
            for k in 1..powers.len() {
                powers[k] = powers[k - 1] * at / self.reach;
            }
            POWERS.map(|(i, j)| powers[i].x * powers[j].y)
        };
        let rows: Vec<_> = self.offsets.iter().map(|&at| row(at)).collect();
        let present = |at: DVec2| steps * (at + self.prior.shift(at));
        let targets: Vec<_> = self.targets.iter().zip(&self.offsets).map(|(&t, &at)| t - present(at)).collect();
        let mut nested = Nested::new(&targets, &self.weights);
        let mut found = Vec::new();
        let mut first = 0;
        for order in 1..=highest {
            let model = if order == 1 { Model::Linear } else { Model::Sip(order) };
            let terms = model.terms();
            if self.offsets.len() < 2 * terms || !(first..terms).all(|k| nested.push(rows.iter().map(|r| r[k]))) {
                break;
            }
            first = terms;
            let c = nested.coefficients();
            let cd = steps + DMat2::from_cols(c[1], c[2]) * (1.0 / self.reach);
            let to_pixels = cd.inverse();
            let mut sip = Sip::default();
            for (k, (i, j)) in SIP_TERMS.into_iter().enumerate() {
                let prior = steps * DVec2::new(self.prior.a[k], self.prior.b[k]);
                let correction = c.get(3 + k).map_or(DVec2::ZERO, |&c| c / self.reach.powi(i + j));
                let term = to_pixels * (prior + correction);
                (sip.a[k], sip.b[k]) = (term.x, term.y);
            }
            found.push(self.fitted(model, c[0], cd, sip, self.errors(&nested, terms, row), nested.left_out()));
        }
        found
    }
}

/// The models that the pairs allow, simple ones first; `present` has the a-priori steps and distortion, about a reference place
/// that is right to some pixels; `asked` are offsets at which the error is asked for;
/// polynomials have at most the order `highest`.
pub(super) fn ladder(pairs: &[Pair], present: &Wcs, asked: [DVec2; 4], highest: i32) -> Vec<Fitted> {
    let used: Vec<Pair> = pairs.iter().copied().filter(|p| p.weight > 0.0).collect();
    let Some(plane) = Plane::new(&used, present, asked) else { return Vec::new() };
    let mut found = plane.similarities();
    let polynomials = plane.polynomials(highest);
    // stars too few or on one line determine no more than a similarity
    if polynomials.is_empty() {
        found.truncate(1);
    }
    found.extend(polynomials);
    found.retain(|f| f.wcs.cd.is_finite() && f.wcs.pixel_scale() > 0.0 && f.left_out.is_finite());
    found
}

/// Standard error in a corner up to which a model may extrapolate as it likes \[px\].
const EXTRAPOLATED: f64 = 1.0;

/// The model of a ladder, fitted to that many pairs, that is justified: it predicts better, and the corners are not much less certain.
pub(super) fn justified(ladder: Vec<Fitted>, pairs: usize) -> Option<Fitted> {
    ladder.into_iter().reduce(|best, next| {
        let added = 2.0 * next.model.terms().saturating_sub(best.model.terms()) as f64;
        let margin = 1.0 - added / (2.0 * pairs.max(1) as f64);
        let certain = next.errors[1] <= EXTRAPOLATED.max(2.0 * best.errors[1]);
        if certain && next.left_out < best.left_out * margin { next } else { best }
    })
}
