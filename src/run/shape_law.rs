//! The law of the faces found together with their areas and normals: the specular share and the exponent of a lobe.
//!
//! Area and albedo are one number, a (C_d + C_s): the sum C_d + C_s is held, and areas are in units of what it is taken for.

use crate::inversion::egi::{EgiError, Options, Problem, Solution, joint};
use crate::object::matter::{Material, Model};

/// Range of the exponent.
const EXPONENT: (f64, f64) = (1.0, 300.0);
/// An exponent is told if its standard deviation is below this share of it.
const TOLD: f64 = 0.5;

/// A law that was fitted.
#[derive(Debug, Clone)]
pub struct Fitted {
    /// The best.
    pub material: Material,
    /// C_s/(C_d + C_s) and its standard deviation.
    pub specular_fraction: (f64, f64),
    /// Exponent and its standard deviation.
    pub exponent: (f64, f64),
    /// C_d + C_s, which was held.
    pub albedo: f64,
    /// The facets that it was found with.
    pub solution: Solution,
}

impl Fitted {
    /// Whether the light determines the exponent: there is a lobe, and its width is seen.
    pub fn tells_exponent(&self) -> bool {
        let (value, sd) = self.exponent;
        self.specular_fraction.0 > 3.0 * self.specular_fraction.1 && sd < TOLD * value
    }
}

/// Laws with a lobe whose exponent can be sought.
fn has_lobe(model: &Model) -> bool {
    matches!(model, Model::Phong | Model::PhongDraft | Model::BlinnPhong | Model::BlinnPhongDraft)
}

/// Fit the specular share and the exponent of a law with a lobe: that of `start`, or Blinn's and Phong's where it has none.
///
/// # Errors
/// As of [`joint::solve`].
pub fn fit(problem: &Problem, start: &Material) -> Result<Fitted, EgiError> {
    let model = if has_lobe(&start.model) { start.model.clone() } else { Model::BlinnPhong };
    let sum = start.diffuse + start.specular;
    let albedo = if sum > 0.0 { sum } else { 1.0 };
    let law = |values: &[f64]| {
        let (share, log) = (values.first().copied().unwrap_or(0.0), values.get(1).copied().unwrap_or(0.0));
        Material {
            model: model.clone(),
            diffuse: albedo * (1.0 - share),
            specular: albedo * share,
            exponent: libm::exp(log),
            ..start.clone()
        }
    };
    let bounds = [(0.0, 1.0), (libm::log(EXPONENT.0), libm::log(EXPONENT.1))];
    let solution = joint::solve(problem, &bounds, &law, &Options::default())?;
    let value = |k: usize| solution.unknowns.get(k).copied().unwrap_or((f64::NAN, f64::INFINITY));
    let (share, log) = (value(0), value(1));
    let exponent = libm::exp(log.0);
    Ok(Fitted {
        material: law(&[share.0, log.0]),
        specular_fraction: share,
        exponent: (exponent, exponent * log.1),
        albedo,
        solution,
    })
}
