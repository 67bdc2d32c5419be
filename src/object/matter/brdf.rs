//! Bidirectional reflectance of isotropic surfaces.
//!
//! A facet of unit normal n, lit from the unit direction s and seen from the unit direction o, sends
//!
//! ```text
//! radiance = f E cs      flux per facet area = f cs co E      cs = n.s   co = n.o
//! ```
//!
//! where E \[W/m²\] is the irradiance normal to the beam and f \[1/sr\] the bidirectional reflectance
//! distribution function (BRDF; Nicodemus et al. 1977, NBS Monograph 160). A physical f is never negative, is
//! reciprocal, f(s, o) = f(o, s), and conserves energy: the directional albedo, the integral of f co over the
//! hemisphere of o, is at most 1. (Eq 5.2 of the draft lacks that co.)
//!
//! An isotropic f depends on three cosines only, cs, co and c = s.o. With h = (s + o)/|s + o| and r the mirror
//! image of s,
//!
//! ```text
//! n.h = (cs + co)/sqrt(2 + 2c)      h.s = h.o = sqrt((1 + c)/2)      r.o = 2 cs co - c
//! sin ts sin to cos(dphi) = c - cs co
//! ```
//!
//! C_d, C_s, n, w are `diffuse`, `specular`, `exponent`, `roughness`; F(x) = C_s + (1 - C_s)(1 - x)^5 is the
//! Fresnel reflectance of Schlick 1994 (Comput. Graph. Forum 13, 233, eq 15).
//!
//! | model | f |
//! |-------|---|
//! | lambert | C_d/π |
//! | phong | C_d/π + C_s (n+2)/(2π) (r.o)₊^n, Lafortune & Willems 1994 (KU Leuven CW 197, eq 5) |
//! | phong-draft | the same lobe divided by cs, eq 5.5 of the draft: not reciprocal, albedo without bound |
//! | blinn-phong | C_d/π + C_s (n+2)/(8π) (n.h)^n: the lobe of eq 5.6 without its 1/(cs co) |
//! | blinn-phong-draft | C_d/π + C_s (n+2)/(2π) (n.h)^n/(4 cs co), eq 5.6 of the draft: albedo without bound |
//! | cook-torrance | D G F(h.s)/(4 cs co) + K; D and G of Walter et al. 2007 (EGSR, eqs 33, 34) with width w, G height-correlated (Heitz 2014, JCGT 3(2), eq 99) |
//! | oren-nayar | C_d/π (A + B (c - cs co)₊/max(cs, co))/max(1, A + B/2), Oren & Nayar 1994 (SIGGRAPH, eq 30), slopes of rms w \[rad\] |
//! | ashikhmin-shirley | (n+1)/(8π) (n.h)^n F(h.s)/(h.s max(cs, co)) + K, Ashikhmin & Shirley 2000 (J. Graph. Tools 5(2), eq 4, n_u = n_v) |
//! | mirror | C_d/π; its glint is no BRDF but an image of the Sun: [`super::mirror_weight`] |
//! | tabulated | [`super::Table`] |
//!
//! K = 28 C_d/(23π) (1 - (1 - cs/2)^5)(1 - (1 - co/2)^5) is the diffuse light from below a surface that reflects
//! by Fresnel (Ashikhmin & Shirley 2000, eq 5). Its C_d is their product R_d (1 - R_s): so C_d + C_s ≤ 1 is the
//! condition of every model here. K is used for cook-torrance too: whatever C_s, F tends to 1 at grazing, and
//! C_d/π beside it would reach an albedo of 1 + C_d there. K fades as fast as F rises (measured: tests `laws`).
//!
//! The published oren-nayar reaches an albedo of 1.015 C_d at grazing for w = 0.20. The albedo of its second
//! term grows with ts up to B/2 exactly, whence the division, which changes f by no more than those 1.5 %.

use super::{Real, Table, tabulated::reflectance};
use glam::DVec3;
use std::f64::consts::PI;
use std::sync::Arc;

/// A reflectance model; the formulas are at the top of this file.
#[derive(Debug, Clone, PartialEq)]
pub enum Model {
    /// Equal radiance in all directions.
    Lambert,
    /// The cosine lobe about the mirror direction that conserves energy.
    Phong,
    /// Eq 5.5 of the draft. Specular albedo at 0, 60, 75, 85, 89 deg for n = 1: 1.00, 1.22, 1.77, 4.17, 18.7;
    /// and f(s, o)/f(o, s) = co/cs.
    PhongDraft,
    /// The cosine lobe of the half-way vector, reciprocal and conserving.
    BlinnPhong,
    /// Eq 5.6 of the draft. Specular albedo at 0, 60, 75, 85, 89 deg for n = 1: 0.65, 1.02, 1.65, 4.11, 18.7.
    BlinnPhongDraft,
    /// Mirror-like microfacets with GGX slopes.
    CookTorrance,
    /// Lambertian microfacets.
    OrenNayar,
    /// A half-way lobe with Fresnel reflectance.
    AshikhminShirley,
    /// A flat mirror.
    Mirror,
    /// Measured values.
    Tabulated(Arc<Table>),
}

/// Models that have a name, with it.
const NAMES: [(&str, Model); 9] = [
    ("lambert", Model::Lambert),
    ("phong", Model::Phong),
    ("phong-draft", Model::PhongDraft),
    ("blinn-phong", Model::BlinnPhong),
    ("blinn-phong-draft", Model::BlinnPhongDraft),
    ("cook-torrance", Model::CookTorrance),
    ("oren-nayar", Model::OrenNayar),
    ("ashikhmin-shirley", Model::AshikhminShirley),
    ("mirror", Model::Mirror),
];

impl Model {
    /// The model of a name, if there is one.
    pub fn from_name(name: &str) -> Option<Model> {
        NAMES.into_iter().find(|(known, _)| *known == name).map(|(_, model)| model)
    }

    /// Its name in scene files.
    pub fn name(&self) -> &'static str {
        NAMES.iter().find(|(_, model)| model == self).map_or("tabulated", |(name, _)| *name)
    }

    /// Every name that [`Model::from_name`] knows.
    pub fn names() -> impl Iterator<Item = &'static str> {
        NAMES.iter().map(|(name, _)| *name)
    }
}

/// The parameters of a model, with derivatives where T is a dual number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameters<T> {
    /// C_d, share of the light reflected diffusely, 0 to 1.
    pub diffuse: T,
    /// C_s, share reflected specularly; at normal incidence where Fresnel's law applies; 0 to 1.
    pub specular: T,
    /// n, exponent of a cosine lobe, 0 to 1e6.
    pub exponent: T,
    /// w: rms slope angle \[rad\] of oren-nayar, 0 to π/2; GGX width of cook-torrance, 0.001 to 1.
    pub roughness: T,
}

/// What a surface is made of.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// Reflectance model.
    pub model: Model,
    /// C_d, 0 to 1.
    pub diffuse: f64,
    /// C_s, 0 to 1; C_d + C_s ≤ 1.
    pub specular: f64,
    /// n, 0 to 1e6.
    pub exponent: f64,
    /// w, see [`Parameters`].
    pub roughness: f64,
}

/// A parameter that no surface can have.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MaterialError {
    /// Outside its range.
    #[error("{model}: {parameter} = {value} is outside {low} to {high}")]
    Range {
        /// Model's name.
        model: &'static str,
        /// Parameter's name.
        parameter: &'static str,
        /// Its value.
        value: f64,
        /// Least allowed.
        low: f64,
        /// Greatest allowed.
        high: f64,
    },
    /// More light leaves than arrives.
    #[error("{model}: diffuse + specular = {sum} is outside 0 to 1")]
    Sum {
        /// Model's name.
        model: &'static str,
        /// Diffuse + specular.
        sum: f64,
    },
}

impl Material {
    /// A Lambertian surface; the other parameters have harmless values.
    pub fn lambert(diffuse: f64) -> Self {
        Material { model: Model::Lambert, diffuse, specular: 0.0, exponent: 20.0, roughness: 0.3 }
    }

    /// Its parameters.
    pub fn parameters(&self) -> Parameters<f64> {
        let &Material { diffuse, specular, exponent, roughness, .. } = self;
        Parameters { diffuse, specular, exponent, roughness }
    }

    /// BRDF \[1/sr\] at cs = n.s, co = n.o, c = s.o; 0 unless cs > 0 and co > 0.
    pub fn f(&self, cs: f64, co: f64, c: f64) -> f64 {
        reflect(&self.model, &self.parameters(), cs, co, c)
    }

    /// Are the parameters that the model uses in their ranges, and is diffuse + specular ≤ 1?
    pub fn check(&self) -> Result<(), MaterialError> {
        let model = self.model.name();
        let range = |parameter, value: f64, low, high| match (low..=high).contains(&value) {
            true => Ok(()),
            false => Err(MaterialError::Range { model, parameter, value, low, high }),
        };
        if matches!(self.model, Model::Tabulated(_)) {
            return Ok(());
        }
        range("diffuse", self.diffuse, 0.0, 1.0)?;
        match self.model {
            Model::Lambert => return Ok(()),
            Model::OrenNayar => return range("roughness", self.roughness, 0.0, PI / 2.0),
            Model::Mirror => {}
            Model::CookTorrance => range("roughness", self.roughness, 1e-3, 1.0)?,
            _ => range("exponent", self.exponent, 0.0, 1e6)?,
        }
        range("specular", self.specular, 0.0, 1.0)?;
        match self.diffuse + self.specular {
            sum if sum <= 1.0 + 1e-12 => Ok(()),
            sum => Err(MaterialError::Sum { model, sum }),
        }
    }
}

/// BRDF \[1/sr\] of a model at cs = n.s, co = n.o, c = s.o; 0 unless cs > 0 and co > 0.
pub fn reflect<T: Real>(model: &Model, p: &Parameters<T>, cs: T, co: T, c: T) -> T {
    if !(cs.value() > 0.0 && co.value() > 0.0) {
        return T::from(0.0);
    }
    let lambert = p.diffuse / PI;
    match model {
        Model::Lambert | Model::Mirror => lambert,
        Model::Phong => lambert + phong(p, cs, co, c),
        Model::PhongDraft => lambert + phong(p, cs, co, c) / cs,
        Model::BlinnPhong => lambert + blinn(p, cs, co, c),
        Model::BlinnPhongDraft => lambert + blinn(p, cs, co, c) / (cs * co),
        Model::CookTorrance => beneath(p.diffuse, cs, co) + microfacets(p, cs, co, c),
        Model::OrenNayar => lambert * rough(p.roughness, cs, co, c),
        Model::AshikhminShirley => beneath(p.diffuse, cs, co) + ashikhmin(p, cs, co, c),
        Model::Tabulated(table) => reflectance(table, cs, co, c),
    }
}

/// n.h and h.s. Rounding may make |s + o| less than n.(s + o), which no unit n allows: then h is n.
fn half_way<T: Real>(cs: T, co: T, c: T) -> (T, T) {
    let (sum, squared) = (cs + co, c * 2.0 + 2.0);
    let length = if sum.value() * sum.value() > squared.value() * (1.0 + 1e-9) { sum } else { squared.sqrt() };
    (sum / length, length * 0.5)
}

fn phong<T: Real>(p: &Parameters<T>, cs: T, co: T, c: T) -> T {
    let cosine = (cs * co * 2.0 - c).max0();
    let cosine = if cosine.value() > 1.0 + 1e-9 { T::from(1.0) } else { cosine };
    p.specular * (p.exponent + 2.0) / (2.0 * PI) * cosine.powf(p.exponent)
}

fn blinn<T: Real>(p: &Parameters<T>, cs: T, co: T, c: T) -> T {
    let (nh, _) = half_way(cs, co, c);
    p.specular * (p.exponent + 2.0) / (8.0 * PI) * nh.powf(p.exponent)
}

fn schlick<T: Real>(normal: T, cosine: T) -> T {
    normal + (-normal + 1.0) * (-cosine + 1.0).max0().fifth()
}

/// The diffuse light from below a Fresnel surface.
fn beneath<T: Real>(diffuse: T, cs: T, co: T) -> T {
    let passed = |cosine: T| -(-cosine * 0.5 + 1.0).fifth() + 1.0;
    diffuse * (28.0 / (23.0 * PI)) * passed(cs) * passed(co)
}

fn microfacets<T: Real>(p: &Parameters<T>, cs: T, co: T, c: T) -> T {
    let (nh, hs) = half_way(cs, co, c);
    let a2 = p.roughness.square();
    let rest = -a2 + 1.0;
    // D = a²/(π t²) and G/(4 cs co) = 1/(2 shadow)
    let t = -nh.square() * rest + 1.0;
    let side = |cosine: T| (a2 + rest * cosine.square()).sqrt();
    let shadow = cs * side(co) + co * side(cs);
    a2 / (t.square() * shadow * (2.0 * PI)) * schlick(p.specular, hs)
}

fn ashikhmin<T: Real>(p: &Parameters<T>, cs: T, co: T, c: T) -> T {
    let (nh, hs) = half_way(cs, co, c);
    (p.exponent + 1.0) / (8.0 * PI) * nh.powf(p.exponent) * schlick(p.specular, hs) / (hs * cs.greater(co))
}

/// Oren-Nayar over Lambert; sin(alpha) tan(beta) cos(dphi) = (c - cs co)/max(cs, co).
fn rough<T: Real>(sigma: T, cs: T, co: T, c: T) -> T {
    let s2 = sigma.square();
    let a = -s2 / (s2 + 0.33) * 0.5 + 1.0;
    let b = s2 / (s2 + 0.09) * 0.45;
    (a + b * (c - cs * co).max0() / cs.greater(co)) / (a + b * 0.5).greater(T::from(1.0))
}

/// Weight f cs co \[1/sr\] of a facet under a point Sun, and its gradient with respect to n as a free vector:
/// dF/dcs s + dF/dco o. The glint of a mirror is not in it.
pub fn gradient(material: &Material, n: DVec3, s: DVec3, o: DVec3) -> (f64, DVec3) {
    use super::Dual;
    let Parameters { diffuse, specular, exponent, roughness } = material.parameters();
    let p = Parameters {
        diffuse: Dual::<2>::from(diffuse),
        specular: Dual::from(specular),
        exponent: Dual::from(exponent),
        roughness: Dual::from(roughness),
    };
    let (cs, co) = (Dual::variable(n.dot(s), 0), Dual::variable(n.dot(o), 1));
    let weight = reflect(&material.model, &p, cs, co, Dual::from(s.dot(o))) * cs * co;
    (weight.value, s * weight.derivative[0] + o * weight.derivative[1])
}
