//! Directional albedo: the share of a beam that a surface reflects.
//!
//! ```text
//! albedo(ts) = ∫ f(s, o) co dω = 2 ∫₀^π dphi ∫₀^{π/2} f co sin to dto
//! ```
//!
//! A lobe sits at to = ts, dphi = π and may be 1e-3 rad wide or less. Panels of Gauss-Legendre points double in
//! width away from that place, 1e-5 rad the first: every lobe wider than that meets panels of its own size, and
//! none is looked for. The panels end where models have kinks: to = ts (max(cs, co)) and the edge of a lobe.

use super::{Material, Model};
use std::f64::consts::{FRAC_PI_2, PI};

/// Width of the panels at the lobe \[rad\].
const FINEST: f64 = 1e-5;

/// Positive Gauss-Legendre nodes on -1..1 and weights, 8 points (Abramowitz & Stegun 1964, table 25.4).
const GAUSS: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_5),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_3),
];

/// Widest panel \[rad\].
const WIDEST: f64 = 0.2;

/// Directional albedo \[1\] of a material at angle of incidence theta \[rad\], 0 to π/2, to 1e-4; of a mirror,
/// diffuse + specular.
pub fn directional_albedo(material: &Material, theta: f64) -> f64 {
    let (ss, cs) = (libm::sin(theta), libm::cos(theta));
    let mut sum = 0.0;
    let mut ring = |to: f64, weight: f64| {
        let (so, co) = (libm::sin(to), libm::cos(to));
        let mut azimuth = |phi: f64, w: f64| {
            sum += 2.0 * weight * w * material.f(cs, co, ss * so * libm::cos(phi) + cs * co) * co * so;
        };
        // where the lobe about r ends, r.o = 0; oren-nayar's second term ends at 90 deg
        let kink = match material.model {
            Model::Phong | Model::PhongDraft => libm::acos((cs * co / (ss * so)).clamp(0.0, 1.0)),
            _ => FRAC_PI_2,
        };
        graded(PI, kink, &mut azimuth);
        graded(kink, 0.0, &mut azimuth);
    };
    graded(theta, 0.0, &mut ring);
    graded(theta, FRAC_PI_2, &mut ring);
    match material.model {
        Model::Mirror => sum + material.specular,
        _ => sum,
    }
}

/// Visits nodes and weights between two places, panels doubling in width from the first.
fn graded(from: f64, to: f64, mut visit: impl FnMut(f64, f64)) {
    let length = (to - from).abs();
    let (mut done, mut width) = (0.0, FINEST);
    while done < length {
        let end = if length - done < 1.5 * width { length } else { done + width };
        let (centre, half) = (0.5 * (done + end), 0.5 * (end - done));
        for (x, w) in GAUSS.iter().flat_map(|&(x, w)| [(x, w), (-x, w)]) {
            visit(from + (to - from).signum() * (centre + half * x), half * w);
        }
        done = end;
        width = (2.0 * width).min(WIDEST);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lambert_and_mirror() {
        let lambert = Material::lambert(0.7);
        let mirror = Material { model: Model::Mirror, specular: 0.2, ..lambert.clone() };
        for degrees in [0.0, 30.0, 60.0, 85.0, 89.9] {
            let theta = f64::to_radians(degrees);
            assert!((directional_albedo(&lambert, theta) - 0.7).abs() < 1e-8);
            assert!((directional_albedo(&mirror, theta) - 0.9).abs() < 1e-8);
        }
    }

    /// At normal incidence the modified Phong lobe has albedo C_s for every exponent, Ashikhmin-Shirley's a closed
    /// form: ∫ (n+1)/(8π) x^n F/x 4x 2π (2x² - 1) dx over x = n.h.
    #[test]
    fn narrow_lobes_are_found() {
        for exponent in [0.0, 0.5, 1.0, 10.0, 1e3, 1e5] {
            let phong =
                Material { model: Model::Phong, diffuse: 0.0, specular: 1.0, exponent, ..Material::lambert(0.0) };
            assert!((directional_albedo(&phong, 0.0) - 1.0).abs() < 1e-4, "{exponent}");
            let ashikhmin = Material { model: Model::AshikhminShirley, ..phong };
            let primitive = |x: f64| {
                (exponent + 1.0)
                    * (2.0 * libm::pow(x, exponent + 3.0) / (exponent + 3.0)
                        - libm::pow(x, exponent + 1.0) / (exponent + 1.0))
            };
            let exact = primitive(1.0) - primitive(0.5f64.sqrt());
            assert!((directional_albedo(&ashikhmin, 0.0) - exact).abs() < 1e-4, "{exponent}");
        }
    }
}
