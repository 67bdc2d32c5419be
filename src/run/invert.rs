//! From a light curve to a shape: convex first, then, where the data tell that no convex body sends this light, boxes and panels.

use super::shape_data::Data;
use crate::inversion::egi::{self, Curve, EgiError, Problem, ProblemError, Scale};
use crate::inversion::minkowski;
use crate::inversion::nonconvex::{self, Assembly, Call, NonconvexError, Renderer, Triangle, Verdict};
use crate::inversion::sphere;
use glam::DVec3;

/// False alarms of the test for bodies that are not convex.
pub const FALSE_ALARMS: f64 = 0.02;
/// Fewer points are inverted without holding any back, or as boxes.
const FEWEST: usize = 60;

/// Which bodies are tried.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Model {
    /// Convex; boxes and panels where the test says that it is not.
    Auto,
    /// Convex alone.
    Convex,
    /// Boxes and panels.
    Nonconvex,
}

/// Why there is no shape.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum InvertError {
    /// Data that cannot be.
    #[error(transparent)]
    Data(#[from] ProblemError),
    /// The convex fit failed.
    #[error(transparent)]
    Convex(#[from] EgiError),
    /// Boxes and panels failed.
    #[error(transparent)]
    Nonconvex(#[from] NonconvexError),
    /// Boxes need a level.
    #[error("boxes and panels need a calibrated curve: this one's level is not known")]
    Relative,
}

/// A shape, and all that was found on the way.
#[derive(Debug, Clone)]
pub struct Found {
    /// The extended Gaussian image.
    pub convex: egi::Solution,
    /// Its body, or why none has these facets.
    pub body: Result<minkowski::Solution, minkowski::Fault>,
    /// Whether a convex body can send this light; none where the level is not known.
    pub verdict: Option<Verdict>,
    /// Boxes and panels, where they were asked for or needed.
    pub assembly: Option<Assembly>,
    /// Reduced chi-square of the convex image at points that it was not fitted to; NaN where too few are there.
    pub held_out: f64,
    /// What each point should be by the shape, in the curve's unit.
    pub model: Vec<f64>,
}

impl Found {
    /// Whether the shape given is the convex one.
    pub fn is_convex(&self) -> bool {
        self.assembly.is_none()
    }

    /// Triangles of the shape, part by part; none if there is no body.
    pub fn triangles(&self) -> Vec<Vec<Triangle>> {
        match (&self.assembly, &self.body) {
            (Some(assembly), _) => assembly.triangles(),
            (None, Ok(body)) => {
                let mesh = body.polytope.mesh();
                let corner = |i: u32| mesh.vertices.get(i as usize).copied().unwrap_or_default();
                vec![mesh.triangles().into_iter().map(|t| t.map(corner)).collect()]
            }
            (None, Err(_)) => Vec::new(),
        }
    }

    /// Chi-square of the shape over its degrees of freedom.
    pub fn chi2_reduced(&self) -> f64 {
        self.assembly.as_ref().map_or(self.convex.chi2 / self.convex.dof, |a| a.chi2 / a.dof)
    }

    /// Standard deviation of the direction of the facet nearest to a normal \[rad\], and of its area, relative; none if no facet within
    /// 10 deg is claimed.
    pub fn certainty(&self, normal: DVec3) -> Option<(f64, f64)> {
        let near = |e: &&egi::Estimate| e.claimed && sphere::angle(e.facet.normal, normal) < 10f64.to_radians();
        let facets = self.convex.facets.iter().filter(near);
        let best = facets.max_by(|a, b| a.facet.normal.dot(normal).total_cmp(&b.facet.normal.dot(normal)))?;
        Some((best.direction_sd, best.area_sd / best.facet.area))
    }

    /// Whether a facet of this normal would send light to any point.
    pub fn is_observed(&self, normal: DVec3) -> bool {
        let near =
            |a: &&egi::Direction, b: &&egi::Direction| a.normal.dot(normal).total_cmp(&b.normal.dot(normal));
        self.convex.map.iter().max_by(near).is_none_or(|d| d.observed)
    }
}

/// The shape behind a curve; `held_out` is the share of its points that test it.
///
/// # Errors
/// [`InvertError`] for data that cannot be, or that show no light.
pub fn invert(data: &Data, model: Model, held_out: f64) -> Result<Found, InvertError> {
    let problem = Problem::new(std::slice::from_ref(&data.curve))?;
    let options = egi::Options::default();
    let convex = egi::solve(&problem, &data.material, &options)?;
    let body = convex.body();
    let calibrated = matches!(data.curve.scale, Scale::Fixed(_));
    let verdict = calibrated.then(|| nonconvex::test(&problem, &data.material, FALSE_ALARMS)).transpose()?;
    let wanted = match model {
        Model::Convex => false,
        Model::Nonconvex if !calibrated => return Err(InvertError::Relative),
        Model::Nonconvex => true,
        Model::Auto => verdict.is_some_and(|v| v.call == Call::NonConvex) && problem.len() >= FEWEST,
    };
    let curve = &data.curve;
    let assembly = wanted.then(|| {
        let options = nonconvex::Options { held_out: held_out.clamp(0.05, 0.5), ..nonconvex::Options::default() };
        nonconvex::assemble(&curve.directions, &curve.y, &curve.sigma, &data.material, &options)
    });
    let assembly = assembly.transpose()?;
    let model = match &assembly {
        Some(assembly) => {
            let parts = assembly.parts.iter().map(|e| e.part).collect::<Vec<_>>();
            let mut renderer = Renderer::default();
            curve.directions.iter().map(|d| renderer.light(&parts, &data.material, *d, None)).collect()
        }
        None => predicted(&convex, data, &curve.directions),
    };
    let held_out = tested(data, held_out);
    Ok(Found { convex, body, verdict, assembly, held_out, model })
}

/// What a solution predicts.
fn predicted(solution: &egi::Solution, data: &Data, directions: &[(DVec3, DVec3)]) -> Vec<f64> {
    let scale = solution.scales.first().copied().unwrap_or(1.0);
    let epochs = crate::object::convex::Epochs::new(directions.iter().copied());
    epochs.curve(&solution.image(), &data.material, 0.0).into_iter().map(|y| scale * y).collect()
}

/// Reduced chi-square at every n-th point of an image fitted to the others.
fn tested(data: &Data, share: f64) -> f64 {
    let curve = &data.curve;
    if curve.y.len() < FEWEST || !(0.01..0.9).contains(&share) {
        return f64::NAN;
    }
    let every = (1.0 / share).round().max(2.0) as usize;
    let part = |held: bool| {
        let kept = (0..curve.y.len()).filter(|i| (i % every == every / 2) == held).collect::<Vec<_>>();
        let pick = |v: &[f64]| kept.iter().map(|i| v[*i]).collect::<Vec<_>>();
        let directions = kept.iter().map(|i| curve.directions[*i]).collect();
        Curve { y: pick(&curve.y), sigma: pick(&curve.sigma), directions, scale: curve.scale }
    };
    let (fitted, held) = (part(false), part(true));
    let solution =
        Problem::new(&[fitted]).ok().and_then(|p| egi::solve(&p, &data.material, &egi::Options::default()).ok());
    let Some(solution) = solution else { return f64::NAN };
    let model = predicted(&solution, data, &held.directions);
    let pulls = held.y.iter().zip(&held.sigma).zip(model).map(|((y, s), m)| ((y - m) / s).powi(2));
    let pulls = pulls.filter(|p| p.is_finite()).collect::<Vec<_>>();
    pulls.iter().sum::<f64>() / pulls.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inversion::synthetic::{Stream, cuboid, directions, noisy};
    use crate::object::convex::Epochs;
    use crate::object::matter::Material;

    fn box_data(snr: f64) -> Data {
        let mut stream = Stream::new(7);
        let directions = directions(300, &mut stream);
        let material = Material::lambert(0.3);
        let clean =
            Epochs::new(directions.iter().copied()).curve(&cuboid(DVec3::new(1.0, 2.0, 3.0)), &material, 0.0);
        let (y, sigma) = noisy(&clean, snr, &mut stream);
        let curve = Curve { y, sigma, directions, scale: Scale::Fixed(1.0) };
        Data { time_s: vec![], curve, material, left_out: 0, told: vec![] }
    }

    /// A box 1:2:3 at SNR 30: six facets, volume within 5 %, not called concave, held-out points as good as their errors (within 4 of
    /// chi-square's own).
    #[test]
    fn a_box_comes_back() {
        let found = invert(&box_data(30.0), Model::Auto, 0.2).expect("a shape");
        assert!(found.is_convex() && found.convex.facets.len() == 6, "{:?}", found.convex.verdict);
        let body = found.body.as_ref().expect("a body");
        assert!((body.polytope.volume() / 6.0 - 1.0).abs() < 0.05, "{}", body.polytope.volume());
        assert!((found.held_out - 1.0).abs() < 4.0 * (2.0f64 / 60.0).sqrt(), "{}", found.held_out);
        assert!(found.certainty(found.convex.facets[0].facet.normal).is_some() && found.is_observed(DVec3::Z));
        assert_eq!(found.model.len(), 300);
    }

    #[test]
    fn relative_curves_make_no_boxes() {
        let mut data = box_data(30.0);
        data.curve.scale = Scale::Free;
        assert_eq!(invert(&data, Model::Nonconvex, 0.2).err(), Some(InvertError::Relative));
    }
}
