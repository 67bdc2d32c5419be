//! From light curves to a shape: the rotation and the material where they are not known, the convex body, then, where the data tell that no
//! convex body sends this light, boxes and panels.
//!
//! Points more than five robust standard deviations from the best convex body are left out if they are few (Huber 1964 weighs them down in the fit
//! that tells); where a convex body cannot explain the rest they are taken back, for they may be the shape's own.

pub use super::shape_fault::InvertError;
pub use super::shape_found::{Found, Model};

use super::shape_data::{Data, Search};
use super::shape_fault::LEAST;
use super::shape_light::{FEWEST, light, stretches};
use super::{shape_law, shape_methods, shape_pole, shape_tumble};
use crate::inversion::egi::{self, Curve, Problem, Scale};
use crate::inversion::nonconvex::{self, Assembly, Call, NonconvexError};
use crate::object::matter::Material;

/// Least share of points that is held out; less is none.
const LEAST_HELD: f64 = 0.01;
/// False alarms of the test for bodies that are not convex.
pub const FALSE_ALARMS: f64 = 0.02;
/// Robust standard deviations beyond which a point is an outlier.
const OUTLIER: f64 = 5.0;
/// Standard deviation over the median of absolute values, of a normal distribution.
const MEDIAN: f64 = 1.4826;
/// Greatest share of outliers.
const FEW: f64 = 0.03;
/// Residuals beyond so many sigma count linearly in the fit that tells outliers.
const HUBER: f64 = 1.5;

/// The shape behind the curves; `held_out` is the share of their points that tests it.
///
/// # Errors
/// [`InvertError`] for data that cannot be, or that show no light.
pub fn invert(data: &Data, model: Model, held_out: f64) -> Result<Found, InvertError> {
    let (mut rotation, mut tumble) = (None, None);
    match data.search {
        Some(Search::Pole { range_s, told_s }) => rotation = Some(shape_pole::search(data, range_s, told_s)?),
        Some(Search::Tumble { range_s, told }) => tumble = Some(shape_tumble::search(data, range_s, told)?),
        None => {}
    }
    let all = match (&rotation, &tumble) {
        (Some(rotation), _) => rotation.in_body_axes(data),
        (None, Some(tumble)) => tumble.in_body_axes(data),
        (None, None) => data.curves.clone(),
    };
    let whole = Problem::new(&all)?;
    if whole.len() < LEAST {
        return Err(InvertError::TooFew { points: whole.len(), all: data.points() + data.left_out.points() });
    }
    let law = data.fits_material.then(|| shape_law::fit(&whole, &data.material)).transpose()?;
    let material = law.as_ref().map_or(&data.material, |l| &l.material);
    let (mut curves, mut outlier, first) = without_outliers(&all, material, law.as_ref().map(|l| &l.solution))?;
    let is_fixed = |c: &&Curve| matches!(c.scale, Scale::Fixed(_));
    let test = |curves: &[Curve]| {
        let fixed = curves.iter().filter(is_fixed).cloned().collect::<Vec<_>>();
        let problem = if fixed.is_empty() { None } else { Some(Problem::new(&fixed)?) };
        Ok::<_, InvertError>(problem.map(|p| nonconvex::test(&p, material, FALSE_ALARMS)).transpose()?)
    };
    let mut verdict = test(&curves)?;
    if outlier.contains(&true) && verdict.is_some_and(|v| v.call == Call::NonConvex) {
        (curves, outlier) = (all, vec![false; data.points()]);
        verdict = test(&curves)?;
    }
    let problem = Problem::new(&curves)?;
    let convex = match outlier.contains(&true) {
        true => egi::solve(&problem, material, &egi::Options::default())?,
        false => first,
    };
    let scales = convex.scales.clone();
    let draft = (model == Model::Draft).then(|| shape_methods::draft(&curves, &scales, material)).transpose()?;
    let body = match &draft {
        Some(draft) => shape_methods::draft_body(&draft.facets),
        None => convex.body().map_err(|why| why.to_string()).and_then(|exact| model.way().body(exact)),
    };
    let fixed = shape_methods::scaled(&curves, &scales)?;
    let convex = convex.doubted(&fixed, material, egi::Options::default().claim);
    let concave = verdict.is_some_and(|v| v.call == Call::NonConvex);
    let folded = draft.as_ref().filter(|_| concave).map(|_| nonconvex::baseline(&fixed, material)).transpose()?;
    let wanted = match model {
        Model::Nonconvex if verdict.is_none() => return Err(InvertError::Relative),
        Model::Nonconvex => true,
        Model::Auto => concave && problem.len() >= FEWEST,
        _ => false,
    };
    let assembly = wanted.then(|| assemble(&curves, material, held_out)).transpose()?;
    // a body that is no box and panel either stays what it is best as
    let worse = assembly.as_ref().is_some_and(|a| a.chi2 / a.dof.max(1.0) > convex.reduced());
    let assembly = assembly.filter(|_| model == Model::Nonconvex || !worse);
    let held = curves.iter().flat_map(|c| stretches(c.y.len(), held_out)).collect::<Vec<_>>();
    let held = if problem.len() < FEWEST || !(LEAST_HELD..=0.9).contains(&held_out) {
        vec![false; held.len()]
    } else {
        held
    };
    let mut found = Found {
        asked: model,
        rotation,
        tumble,
        law: None,
        convex,
        draft,
        body,
        verdict,
        assembly,
        folded,
        held_out_chi2: f64::NAN,
        held_out: held,
        outlier,
        model: Vec::new(),
    };
    light(&mut found, &curves, material);
    found.law = law;
    Ok(found)
}

/// The curves with outliers as gaps, which points these are, and the solution for all points: that of the law's fit where there is one, whose
/// errors are those with the law among the unknowns.
fn without_outliers(
    curves: &[Curve],
    material: &Material,
    known: Option<&egi::Solution>,
) -> Result<(Vec<Curve>, Vec<bool>, egi::Solution), InvertError> {
    let problem = Problem::new(curves)?;
    let count = curves.iter().map(|c| c.y.len()).sum::<usize>();
    let beyond = |residual: &[f64]| {
        let mut sizes = residual.iter().map(|z| z.abs()).collect::<Vec<_>>();
        sizes.sort_by(f64::total_cmp);
        let scale = (MEDIAN * sizes.get(sizes.len() / 2).copied().unwrap_or(1.0)).max(1.0);
        residual.iter().map(|z| z.abs() > OUTLIER * scale).collect::<Vec<_>>()
    };
    let first = match known {
        Some(known) => known.clone(),
        None => egi::solve(&problem, material, &egi::Options::default())?,
    };
    if !beyond(&first.residual).contains(&true) {
        return Ok((curves.to_vec(), vec![false; count], first));
    }
    let robust = egi::Options { huber: Some(HUBER), ..egi::Options::default() };
    let outlier = beyond(&egi::solve(&problem, material, &robust)?.residual);
    let share = outlier.iter().filter(|o| **o).count() as f64 / count.max(1) as f64;
    if outlier.len() != count || share > FEW {
        return Ok((curves.to_vec(), vec![false; count], first));
    }
    let mut mark = outlier.iter();
    let gaps = |curve: &Curve| {
        let y = curve.y.iter().map(|y| if mark.next() == Some(&true) { f64::NAN } else { *y }).collect();
        Curve { y, ..curve.clone() }
    };
    Ok((curves.iter().map(gaps).collect(), outlier, first))
}

/// Boxes and panels by the curves of known level.
fn assemble(curves: &[Curve], material: &Material, held_out: f64) -> Result<Assembly, NonconvexError> {
    let options = nonconvex::Options { held_out: held_out.clamp(0.05, 0.5), ..nonconvex::Options::default() };
    let (mut y, mut sigma, mut directions) = (Vec::new(), Vec::new(), Vec::new());
    for curve in curves {
        let Scale::Fixed(scale) = curve.scale else { continue };
        y.extend(curve.y.iter().map(|v| v / scale));
        sigma.extend(curve.sigma.iter().map(|s| s / scale));
        directions.extend_from_slice(&curve.directions);
    }
    nonconvex::assemble(&directions, &y, &sigma, material, &options)
}

#[cfg(test)]
#[path = "invert_tests.rs"]
mod tests;
