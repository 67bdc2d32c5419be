//! What a person reads of a shape.

use super::invert::{Found, Model};
use super::shape_data::{Data, told_left_out};
use super::shape_light::FEWEST;
use super::shape_pole::Rotation;
use super::shape_tumble::Tumbling;
use crate::inversion::egi::Verdict;
use crate::inversion::nonconvex::{self, Call};
use glam::DVec3;

/// How a shape differs from the true one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Errors {
    /// Volume of what both hold over that of what one holds.
    pub iou: f64,
    /// Largest distance of the surfaces over the diagonal.
    pub hausdorff: f64,
    /// Mean distance over the diagonal.
    pub chamfer: f64,
    /// Volume over the true one.
    pub volume_ratio: f64,
    /// Whether it was turned to lie over the true one, and scaled if its size means nothing.
    pub turned: bool,
}

/// What may be said of the shape, sentence by sentence.
pub(super) fn claims(found: &Found, data: &Data) -> Vec<String> {
    let convex = &found.convex;
    let mut said = Vec::new();
    if let Some(tumble) = &found.tumble {
        said.push(tumble.claim());
    }
    said.extend(found.rotation.as_ref().and_then(|r| r.best()).and_then(|best| doubt(best.solution.reduced())));
    if let Some(rivals) = found.rotation.as_ref().map(|r| r.found.minima.len()).filter(|count| *count > 1) {
        said.push(format!(
            "{rivals} rotations explain the light: shape and errors are those of the first, supposed to be true"
        ));
    }
    let claimed = convex.facets.iter().filter(|e| found.claims(e)).count();
    let concave = found.verdict.as_ref().is_some_and(|v| v.call == Call::NonConvex);
    let facets = match convex.verdict {
        Verdict::Facets if concave => "no facet is claimed: the image by convex facets is not the body".into(),
        Verdict::Facets if !found.explains() => "no facet is claimed: the light is not explained".into(),
        Verdict::Facets => format!("{claimed} of {} facets are claimed", convex.facets.len()),
        Verdict::Smooth { .. } => "no facet is claimed: a smooth body explains the light as well".into(),
        Verdict::Endless { .. } | Verdict::Unresolved { .. } => {
            "no facet is claimed: the light does not tell them apart".into()
        }
        Verdict::Dark => "no light".into(),
    };
    match &found.draft {
        Some(draft) => said.push(format!(
            "{} facets by resampling and merging at a fixed angle: none is claimed; errors are not known of them",
            draft.facets.len()
        )),
        None => said.push(facets),
    }
    match &found.body {
        Err(why) => said.push(format!("no convex body: {why}")),
        Ok(body) if !body.converged => said.push(format!(
            "warning: {} did not converge: areas off by up to {:.1} % of the largest after {} steps, {} facets lost; the body is not that of the facets",
            body.method, 100.0 * body.residual, body.iterations, body.lost
        )),
        Ok(_) => {}
    }
    let ratio = found.chi2_reduced();
    let smooth = found.is_convex() && found.verdict.as_ref().is_some_and(|v| v.call == Call::CannotTell);
    if !found.explains() && smooth {
        said.push(format!(
            "warning: chi-square is {ratio:.2} a degree of freedom: these facets are too few for the light, which convex bodies explain"
        ));
    } else if !found.explains() {
        said.push(format!(
            "warning: chi-square is {ratio:.2} a degree of freedom: the errors are {:.1} times too small, or no shape of this kind and law sends this light",
            ratio.sqrt()
        ));
    } else if found.outlier.len() > 20 && ratio < 0.4 && !data.computed && convex.verdict != Verdict::Dark {
        said.push(format!(
            "chi-square is {ratio:.2} a degree of freedom: the errors are {:.1} times too large",
            ratio.sqrt().recip()
        ));
    }
    match &found.verdict {
        Some(v) if v.call == Call::NonConvex => said.push(format!(
            "not convex, if the errors are not too small: no convex body sends this light (residual floor {:.2} %, closure open by {:.1} standard deviations)",
            100.0 * v.floor,
            v.defect_sigmas
        )),
        Some(v) if v.floor_found > 0.5 => {
            said.push("convex bodies explain the light, as they would any: its errors are too large".into());
        }
        Some(v) => said.push(format!(
            "convex bodies explain the light; a concavity that takes {:.1} % of it would have been found",
            100.0 * v.floor_found
        )),
        None => {}
    }
    if let Some(folded) = &found.folded {
        said.push(format!(
            "the draft's family: one concavity with walls at {:.0} deg explains the light best",
            folded.best.angle.to_degrees()
        ));
    }
    if let Some(assembly) = &found.assembly {
        let (count, claimed) = (assembly.parts.len(), found.explains());
        said.push(match (count, claimed) {
            (1, true) => "one box or panel explains it".into(),
            (_, true) => format!("{count} boxes or panels explain it"),
            (_, false) => format!("boxes and panels, here {count}, do not explain it: none is claimed"),
        });
        let without = match assembly.alternatives.iter().any(|a| a.panels.is_empty()) {
            true => "; others that explain the light have none",
            false => "",
        };
        for panel in assembly.parts.iter().filter(|_| claimed).filter_map(|e| e.panel.as_ref()) {
            said.push(format!(
                "a panel of which {:.2} +- {:.2} m2 stand free, its normal known to {:.2} deg{without}",
                panel.exposed,
                panel.area_sd * panel.exposed / panel.area,
                panel.normal_sd.to_degrees()
            ));
        }
        if !assembly.ties.is_empty() {
            said.push(format!(
                "regularities of edges and faces taken for exact, as the light does not speak against them: {}; errors allow for some being none",
                assembly.ties.len()
            ));
        }
        // the first is the one given
        let others = assembly.alternatives.len().saturating_sub(1);
        if others > 0 && claimed {
            let least = if others >= nonconvex::RIVALS { "at least " } else { "" };
            said.push(format!("other assemblies that explain it about as well: {least}{others}"));
        }
    }
    if convex.unobserved > 0.01 {
        said.push(format!("{:.0} % of the directions were never lit and seen", 100.0 * convex.unobserved));
    }
    said
}

/// What is wrong where no rotation explains the light.
fn doubt(reduced: f64) -> Option<String> {
    (reduced > 3.0).then(|| {
        format!(
            "warning: at the best pole chi-square is {reduced:.1} a degree of freedom: no rotation that was tried explains the light \
             as a convex body's of this law: pole and period may be as wrong as law or body"
        )
    })
}

/// The rotations that the light allows, line by line.
fn minima(rotation: &Rotation) -> Vec<String> {
    let (low, high, count) = rotation.tried;
    let mut lines = vec![format!(
        "rotation: {} poles, {count} periods from {low:.6} to {high:.6} s ({}); {} rotations within {} of the best by chi-square and what their facets cost:",
        rotation.found.map.len(),
        rotation.from,
        rotation.found.minima.len(),
        rotation.within
    )];
    let least = rotation.best().map_or(0.0, |m| m.criterion);
    lines.extend(rotation.found.minima.iter().map(|m| {
        let (ra, dec) = sky(m.pole);
        format!(
            "  pole RA {ra:.2}, Dec {dec:+.2} deg (+- {:.2}), period {:.6} +- {:.1e} s, {} facets, chi-square {:.2} a degree of freedom, criterion +{:.1}{}",
            m.sd[0].hypot(m.sd[1]).to_degrees().min(180.0),
            m.period,
            m.sd[2],
            m.solution.facets.len(),
            m.solution.reduced(),
            m.criterion - least,
            if m.alias { ", met as the mirror of another" } else { "" }
        )
    }));
    lines
}

/// The motions without torque that the light allows, line by line.
fn motions(tumble: &Tumbling, data: &Data) -> Vec<String> {
    let near = if tumble.told { "near the one told" } else { "none told" };
    let turns = tumble.range_s.map_or_else(String::new, |(low, high)| {
        format!(", {} drawn at random, a turn in {low} to {high} s", tumble.found.tried[0])
    });
    let mut lines = vec![format!(
        "tumble, EXPERIMENTAL: {near}{turns}; {} motions within {} of the best, attitudes and rates at {} UTC:",
        tumble.found.minima.len(),
        tumble.within,
        data.start.iso_utc()
    )];
    let least = tumble.best().map_or(0.0, |m| m.criterion);
    lines.extend(tumble.found.minima.iter().map(|m| {
        let (ra, dec) = sky(m.motion.momentum());
        let periods = m.motion.periods().map_or_else(
            || "about a principal axis".to_owned(),
            |(turn, nutation)| format!("a turn about it in {turn:.4} s, a nutation in {nutation:.4} s"),
        );
        format!(
            "  angular momentum RA {ra:.2}, Dec {dec:+.2} deg, {periods}, attitude +- {:.2} deg, {} facets, chi-square {:.2} a degree of freedom, \
             criterion +{:.1}",
            m.attitude_sd.length().to_degrees(),
            m.solution.facets.len(),
            m.solution.reduced(),
            m.criterion - least
        )
    }));
    lines
}

/// The law that was fitted.
fn law(found: &Found) -> Vec<String> {
    let Some(law) = &found.law else { return Vec::new() };
    let name = law.material.model.name();
    let (share, exponent) = (law.specular_fraction, law.exponent);
    let width = match law.tells_exponent() {
        true => format!("exponent {:.2} +- {:.2}", exponent.0, exponent.1),
        false => "the exponent is not told by the light".into(),
    };
    vec![
        format!("law: {name}, specular share {:.4} +- {:.4} of C_d + C_s, {width}", share.0, share.1),
        format!(
            "areas are for C_d + C_s = {:.3}: area and albedo are one number, the light tells a C_d alone",
            law.albedo
        ),
    ]
}

/// The summary of a shape, line by line.
pub fn summary(found: &Found, data: &Data, errors: Option<&Errors>) -> Vec<String> {
    let mut lines = data.told.clone();
    lines.extend(told_left_out(&data.left_out));
    let outliers = found.outlier.iter().filter(|o| **o).count();
    if outliers > 0 {
        lines.push(format!(
            "outliers left out: {outliers}, more than 5 robust standard deviations from the best convex body"
        ));
    }
    lines.extend(found.rotation.iter().flat_map(minima));
    lines.extend(found.tumble.iter().flat_map(|t| motions(t, data)));
    lines.extend(law(found));
    lines.push(format!(
        "{} points, signal-to-noise ratio {:.0}: the light tells {} numbers",
        data.points(),
        found.convex.snr,
        found.convex.rank
    ));
    lines.extend(claims(found, data));
    let kind = match (found.is_convex(), &found.folded) {
        (true, _) => "convex",
        (false, Some(_)) => "one concavity",
        (false, None) => "boxes and panels",
    };
    let chi2 = format!("{kind}: chi-square {:.2} a degree of freedom", found.chi2_reduced());
    let held = if found.held_out_chi2.is_finite() {
        format!(", {:.2} of the convex image at points held out", found.held_out_chi2)
    } else {
        String::new()
    };
    lines.push(chi2 + &held);
    if found.asked == Model::Auto && found.is_convex() && found.verdict.is_some_and(|v| v.call == Call::NonConvex)
    {
        let used = found.outlier.iter().filter(|o| !**o).count();
        let why = if used < FEWEST {
            "too few points for boxes and panels"
        } else {
            "boxes and panels explain it no better"
        };
        lines.push(format!("{why}: the shape given is the convex one"));
    }
    if let Some(e) = errors {
        lines.push(format!(
            "against the truth{}: volumes in common {:.3}, {:.3} of its volume, surfaces {:.4} of the diagonal apart on average, {:.3} at most",
            if e.turned { ", turned over it" } else { "" },
            e.iou, e.volume_ratio, e.chamfer, e.hausdorff
        ));
    }
    lines
}

/// Right ascension and declination \[deg\].
pub(super) fn sky(v: DVec3) -> (f64, f64) {
    (v.y.atan2(v.x).to_degrees().rem_euclid(360.0), v.z.clamp(-1.0, 1.0).asin().to_degrees())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pole_that_explains_nothing_is_doubted() {
        assert!(doubt(66.8).is_some_and(|said| said.starts_with("warning: at the best pole chi-square is 66.8")));
        assert!(doubt(1.2).is_none() && doubt(f64::NAN).is_none());
    }
}
