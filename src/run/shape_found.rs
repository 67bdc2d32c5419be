//! What an inversion finds, and the ways to seek it.

use super::shape_law::Fitted;
use super::shape_methods::{Draft, Solved, Way};
use super::shape_pole::Rotation;
use super::shape_tumble::Tumbling;
use crate::inversion::nonconvex::{Assembly, Baseline, Call, Triangle, Verdict};
use crate::inversion::{egi, sphere};
use glam::DVec3;

/// Which bodies are tried, and how.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Model {
    /// Convex; boxes and panels where the test says that it is not.
    Auto,
    /// Convex alone.
    Convex,
    /// Boxes and panels.
    Nonconvex,
    /// Convex, the body by Little's method.
    Little,
    /// Convex, the body by Ikeuchi's method.
    Ikeuchi,
    /// Convex, the body by Ikeuchi's method with Nicolet's smoothing.
    Nicolet,
    /// Facets resampled and merged at a fixed angle, Little's body, one concavity of one angle where the test says that it is not convex.
    Draft,
}

impl Model {
    /// Its names in scene files, and the models.
    pub const NAMES: [(&'static str, Self); 7] = [
        ("auto", Self::Auto),
        ("convex", Self::Convex),
        ("nonconvex", Self::Nonconvex),
        ("little", Self::Little),
        ("ikeuchi", Self::Ikeuchi),
        ("nicolet", Self::Nicolet),
        ("draft", Self::Draft),
    ];

    /// The model of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::NAMES.iter().find(|(known, _)| *known == name).map(|(_, model)| *model)
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        Self::NAMES.iter().find(|(_, model)| *model == self).map_or("auto", |(name, _)| name)
    }

    pub(super) fn way(self) -> Way {
        match self {
            Self::Little => Way::Little,
            Self::Ikeuchi => Way::Ikeuchi,
            Self::Nicolet => Way::Nicolet,
            _ => Way::Newton,
        }
    }
}

/// A shape, and all that was found on the way.
#[derive(Debug, Clone)]
pub struct Found {
    /// How it was sought.
    pub asked: Model,
    /// The rotation, where it was sought.
    pub rotation: Option<Rotation>,
    /// The motion without torque, where it was sought.
    pub tumble: Option<Tumbling>,
    /// The law of the faces, where it was sought.
    pub law: Option<Fitted>,
    /// The extended Gaussian image.
    pub convex: egi::Solution,
    /// Facets by resampling, where asked for.
    pub draft: Option<Draft>,
    /// The convex body, or why none has these facets.
    pub body: Result<Solved, String>,
    /// Whether a convex body can send this light; none where the level is not known.
    pub verdict: Option<Verdict>,
    /// Boxes and panels, where they were asked for or needed.
    pub assembly: Option<Assembly>,
    /// The body with one concavity, of the draft's way alone.
    pub folded: Option<Baseline>,
    /// Reduced chi-square of the convex image at points that it was not fitted to; NaN where too few are there.
    pub held_out_chi2: f64,
    /// Whether each point, curve after curve, was held out.
    pub held_out: Vec<bool>,
    /// Whether each point, curve after curve, was left out as an outlier.
    pub outlier: Vec<bool>,
    /// What each point should be by the shape, in its curve's unit; of points held out by a shape that was not fitted to them.
    pub model: Vec<f64>,
}

impl Found {
    /// Whether the body's axes are its own: it was sought how it turns.
    pub fn has_own_axes(&self) -> bool {
        self.rotation.is_some() || self.tumble.is_some()
    }

    /// Whether the shape given is the convex one.
    pub fn is_convex(&self) -> bool {
        self.assembly.is_none() && self.folded.as_ref().is_none_or(|f| f.best.angle == 0.0)
    }

    /// Triangles of the shape, part by part; none if there is no body.
    pub fn triangles(&self) -> Vec<Vec<Triangle>> {
        if let Some(folded) = self.folded.as_ref().filter(|_| !self.is_convex()) {
            return vec![folded.triangles.clone()];
        }
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
        let points = self.outlier.iter().filter(|o| !**o).count() as f64;
        match (&self.assembly, &self.folded, &self.draft) {
            (Some(a), ..) => a.chi2 / a.dof.max(1.0),
            (None, Some(folded), Some(draft)) if !self.is_convex() => {
                folded.best.chi2 / (points - 3.0 * draft.facets.len() as f64 - 1.0).max(1.0)
            }
            (None, _, Some(draft)) => draft.chi2 / (points - 3.0 * draft.facets.len() as f64).max(1.0),
            _ => self.convex.reduced(),
        }
    }

    /// Whether chi-square lets the shape explain the light.
    pub fn explains(&self) -> bool {
        let points = self.outlier.len() as f64;
        self.chi2_reduced() <= 1.5 + 5.0 * (2.0 / points.max(1.0)).sqrt()
    }

    /// Whether a facet is claimed: where it is known well, and the body is convex and explains the light.
    pub fn claims(&self, facet: &egi::Estimate) -> bool {
        let concave = self.verdict.as_ref().is_some_and(|v| v.call == Call::NonConvex);
        facet.claimed && !concave && self.explains()
    }

    /// Standard deviation of the direction of the facet nearest to a normal \[rad\], and of its area, relative; none if no facet within
    /// 10 deg is claimed.
    pub fn certainty(&self, normal: DVec3) -> Option<(f64, f64)> {
        let near =
            |e: &&egi::Estimate| self.claims(e) && sphere::angle(e.facet.normal, normal) < 10f64.to_radians();
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
