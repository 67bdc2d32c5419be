//! The light of a shape at the points of its curves, and at those held out that of a shape which was not fitted to them.

use super::shape_found::Found;
use super::shape_methods;
use crate::inversion::egi::{self, Curve, Problem, Scale};
use crate::inversion::nonconvex::{Assembly, Renderer};
use crate::object::convex::{Epochs, Facet};
use crate::object::matter::Material;

/// Fewer points are inverted without holding any back.
pub(super) const FEWEST: usize = 60;
/// Points in a stretch that is held out, about.
const STRETCH: f64 = 10.0;

/// Whether each of `count` points is held out: about `share` of them, in stretches of time that are spread evenly.
pub(super) fn stretches(count: usize, share: f64) -> Vec<bool> {
    let wanted = share * count as f64;
    let blocks = (wanted / STRETCH).round().clamp(1.0, 8.0);
    let period = count as f64 / blocks;
    let held = |k: usize| {
        let place = (k as f64 + 0.5) % period / period;
        (place - 0.5).abs() < 0.5 * share
    };
    (0..count).map(held).collect()
}

/// What the shape sends at every point, and how well it predicts those held out.
pub(super) fn light(found: &mut Found, curves: &[Curve], material: &Material) {
    if let Some(assembly) = &found.assembly {
        (found.model, found.held_out) = assembled(assembly, curves, material);
    } else {
        found.model = match (&found.folded, &found.draft) {
            (Some(folded), _) if folded.best.angle > 0.0 => {
                let scale = |k: usize| found.convex.scales.get(k).copied().unwrap_or(1.0);
                let one = |(k, c): (usize, &Curve)| {
                    folded
                        .light(material, &c.directions)
                        .into_iter()
                        .map(move |y| y * scale(k))
                        .collect::<Vec<_>>()
                };
                curves.iter().enumerate().flat_map(one).collect()
            }
            (_, Some(draft)) => predicted(&draft.facets, &found.convex.scales, curves, material),
            _ => predicted(&found.convex.image(), &found.convex.scales, curves, material),
        };
    }
    let held = found.held_out.clone();
    let Some(blind) = blind(found, curves, material, &held) else { return };
    let all = curves.iter().flat_map(|c| c.y.iter().zip(&c.sigma));
    let pulls =
        all.zip(&blind).zip(&held).filter(|(_, held)| **held).map(|(((y, s), m), _)| ((y - m) / s).powi(2));
    let pulls = pulls.filter(|p| p.is_finite()).collect::<Vec<_>>();
    found.held_out_chi2 = pulls.iter().sum::<f64>() / pulls.len() as f64;
    if found.is_convex() {
        let tested = found.model.iter_mut().zip(blind).zip(&held).filter(|(_, held)| **held);
        tested.for_each(|((model, blind), _)| *model = blind);
    }
}

/// The light of an image fitted to the points that are not held out; none if none are.
fn blind(found: &Found, curves: &[Curve], material: &Material, held: &[bool]) -> Option<Vec<f64>> {
    if !held.contains(&true) || held.len() < FEWEST {
        return None;
    }
    let mut mark = held.iter();
    let fitted = |curve: &Curve| {
        let y = curve.y.iter().map(|y| if mark.next() == Some(&true) { f64::NAN } else { *y }).collect();
        Curve { y, ..curve.clone() }
    };
    let fitted = curves.iter().map(fitted).collect::<Vec<_>>();
    let problem = Problem::new(&fitted).ok()?;
    let solution = egi::solve(&problem, material, &egi::Options::default()).ok()?;
    if found.draft.is_some() {
        let draft = shape_methods::draft(&fitted, &solution.scales, material).ok()?;
        return Some(predicted(&draft.facets, &solution.scales, curves, material));
    }
    Some(predicted(&solution.image(), &solution.scales, curves, material))
}

/// What facets send at the points of curves, curve after curve, each times its scale; a scale that is not given is 1.
pub fn predicted(facets: &[Facet], scales: &[f64], curves: &[Curve], material: &Material) -> Vec<f64> {
    let one = |(k, curve): (usize, &Curve)| {
        let scale = scales.get(k).copied().unwrap_or(1.0);
        let light = Epochs::new(curve.directions.iter().copied()).curve(facets, material, 0.0);
        light.into_iter().map(move |y| scale * y)
    };
    curves.iter().enumerate().flat_map(one).collect()
}

/// What boxes and panels send, and which points chose their number. A curve of unknown level is scaled to fit.
fn assembled(assembly: &Assembly, curves: &[Curve], material: &Material) -> (Vec<f64>, Vec<bool>) {
    let parts = assembly.parts.iter().map(|e| e.part).collect::<Vec<_>>();
    let mut renderer = Renderer::default();
    let (mut model, mut held) = (Vec::new(), Vec::new());
    let mut mask = assembly.held_out.iter();
    for curve in curves {
        let known = matches!(curve.scale, Scale::Fixed(_));
        let scale = if let Scale::Fixed(scale) = curve.scale { scale } else { 1.0 };
        let mut own = Vec::with_capacity(curve.y.len());
        for (y, d) in curve.y.iter().zip(&curve.directions) {
            let out = known && !y.is_nan() && mask.next() == Some(&true);
            let parts = if out { &assembly.tested } else { &parts };
            own.push(scale * renderer.light(parts, material, *d, None));
            held.push(out);
        }
        if !known {
            let (ym, mm) = curve
                .y
                .iter()
                .zip(&curve.sigma)
                .zip(&own)
                .filter(|((y, _), _)| !y.is_nan())
                .fold((0.0, 0.0), |(ym, mm), ((y, s), m)| (ym + y * m / (s * s), mm + m * m / (s * s)));
            own.iter_mut().for_each(|m| *m *= if mm > 0.0 { ym / mm } else { 1.0 });
        }
        model.extend(own);
    }
    (model, held)
}
