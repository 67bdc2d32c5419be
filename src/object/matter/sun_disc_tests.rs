//! Tests of the Sun's disc.

use super::*;

const SUN: f64 = 4.65e-3;

fn direction(theta: f64, phi: f64) -> DVec3 {
    DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
}

fn specular(model: Model, exponent: f64, roughness: f64) -> Material {
    Material { model, diffuse: 0.0, specular: 0.5, exponent, roughness }
}

#[test]
fn rules_integrate_polynomials_exactly() {
    // mean of x^(2k) for (1 - x²)^p: Π (2j - 1)/(2j + 2p + 1), j = 1..k
    for (rules, power) in RULES.iter().zip([LIMB / 2.0, (LIMB + 1.0) / 2.0]) {
        for (rule, n) in rules.iter().zip(SIZES) {
            let mut exact = 1.0;
            for k in 0..n.min(30) {
                let j = k as f64;
                exact *= if k == 0 { 1.0 } else { (2.0 * j - 1.0) / (2.0 * j + 2.0 * power + 1.0) };
                let mean: f64 = rule.iter().map(|(x, w)| w * x.powi(2 * k as i32)).sum();
                assert!((mean - exact).abs() < 1e-13, "{n} {k}");
            }
        }
    }
}

/// Mean over 96 x 96 points about axes of no preference.
fn reference(m: &Material, n: DVec3, s: DVec3, o: DVec3, rules: &[Rule; 2]) -> f64 {
    let ey = s.any_orthonormal_vector();
    let (ex, radius) = (ey.cross(s), SUN.sin());
    let mut sum = 0.0;
    for &(y, wy) in &rules[1] {
        for &(u, wu) in &rules[0] {
            let x = (1.0 - y * y).sqrt() * u;
            let cosine = (1.0 - radius * radius * (x * x + y * y)).sqrt();
            let sun = s * cosine + (ex * x + ey * y) * radius;
            sum += wu * wy * m.f(n.dot(sun), n.dot(o), sun.dot(o)) * n.dot(sun) / cosine;
        }
    }
    sum * n.dot(o)
}

/// Greatest error of the weight, and the peak, over directions about the mirror's.
fn error(m: &Material, sigma: f64, theta: f64, rules: &[Rule; 2]) -> f64 {
    let (s, mut peak, mut worst) = (direction(theta, 0.0), 0.0f64, 0.0f64);
    let step = 0.7 * (sigma + 0.5 * SUN);
    let across = if m.model == Model::Phong { 1.0 } else { theta.cos().max(0.05) };
    const NEAR: [f64; 7] = [-4.0, -2.0, -1.0, 0.0, 1.0, 2.0, 4.0];
    const FAR: [f64; 7] = [6.0, 8.0, 11.0, 15.0, 20.0, 40.0, 80.0];
    let offsets = NEAR.into_iter().flat_map(|i| [0.0, 1.0, 2.0, 4.0, 8.0, 16.0].map(|j| (i, j)));
    for (i, j) in offsets.chain(FAR.map(|i| (-i, 0.0))).chain(FAR.map(|i| (-0.5 * i, i))) {
        let o = direction(theta + step * i, PI + step * across * j);
        if o.z > 0.0 {
            let exact = reference(m, DVec3::Z, s, o, rules);
            peak = peak.max(exact);
            worst = worst.max((weight(m, DVec3::Z, s, o, SUN) - exact).abs());
        }
    }
    worst / peak
}

/// Up to 85 deg within 1e-4 of the peak; at 89 deg, where half-way lobes are 57 times narrower across, 5e-3.
#[test]
fn averaged_lobes_are_within_1e_4_of_their_peak() {
    let rules = [gegenbauer(96, LIMB / 2.0), gegenbauer(96, (LIMB + 1.0) / 2.0)];
    let mut cases = Vec::new();
    for n in [10.0, 100.0, 1e3, 1e4, 1e5f64] {
        cases.push((specular(Model::Phong, n, 0.1), 1.0 / n.sqrt()));
        cases.push((specular(Model::BlinnPhong, n, 0.1), 2.0 / n.sqrt()));
        cases.push((specular(Model::AshikhminShirley, n, 0.1), 2.0 / n.sqrt()));
    }
    cases.extend([0.01, 0.02, 0.1, 0.3].map(|w| (specular(Model::CookTorrance, 1.0, w), w)));
    for (material, sigma) in cases {
        for (degrees, bound) in [(0.0, 1e-4), (45.0, 1e-4), (75.0, 1e-4), (85.0, 1e-4), (89.0, 5e-3)] {
            let error = error(&material, sigma, f64::to_radians(degrees), &rules);
            assert!(error < bound, "{material:?} {degrees}: {error:e}");
        }
    }
}

#[test]
fn a_lambertian_facet_sees_the_disc_as_a_point_and_sets_without_a_jump() {
    let material = Material::lambert(0.6);
    let at = |elevation: f64| {
        weight(&material, DVec3::Z, direction(PI / 2.0 - elevation, 0.0), direction(0.5, 1.0), SUN)
    };
    let step = SUN / 500.0;
    for i in -600..600 {
        let elevation = f64::from(i) * step;
        let (here, next) = (at(elevation), at(elevation + step));
        assert!(next >= here - 1e-7 && next - here < 2.0 * step, "{elevation}");
    }
    assert_eq!(at(-SUN * 1.001), 0.0);
    // the disc's mean at cs = 0 is R Γ(b + 3/2)/(2 √π Γ(b + 2)), b = (a + 1)/2: 0.1985 R
    let half = at(0.0) / (0.6 / PI * 0.5f64.cos() * SUN);
    assert!((half - 0.1985).abs() < 1e-3, "{half}");
}

#[test]
fn every_model_is_continuous_through_sunset() {
    for model in Model::names().filter_map(Model::from_name).filter(|m| *m != Model::PhongDraft) {
        let material = Material { model, diffuse: 0.3, specular: 0.3, exponent: 30.0, roughness: 0.3 };
        let o = direction(1.2, 2.8);
        let at = |elevation: f64| weight(&material, DVec3::Z, direction(PI / 2.0 - elevation, 0.0), o, SUN);
        let mut steps = (-1200..1200).map(|i| f64::from(i) * SUN / 1000.0);
        assert!(steps.all(|e| (at(e + SUN / 1000.0) - at(e)).abs() < 1e-3 * at(0.05)), "{material:?}");
    }
}

#[test]
fn the_mirror_conserves_energy() {
    for (theta, radius) in [(0.0, SUN), (0.6, SUN), (1.4, SUN), (1.55, SUN), (0.6, 0.05)] {
        let (s, r) = (direction(theta, 0.0), direction(theta, PI));
        let ex = r.any_orthonormal_vector();
        let ey = r.cross(ex);
        // o about r: sin delta = sin R sqrt(1 - mu²), dω = sin²R mu dmu dphi/cos delta, Gauss over mu by substitution
        let (rings, azimuths) = (4000, 16);
        let mut sum = 0.0;
        for i in 0..rings {
            let mu = (f64::from(i) + 0.5) / f64::from(rings);
            let sine = radius.sin() * (1.0 - mu * mu).sqrt();
            let cosine = (1.0 - sine * sine).sqrt();
            for j in 0..azimuths {
                let phi = 2.0 * PI * f64::from(j) / f64::from(azimuths);
                let o = r * cosine + (ex * phi.cos() + ey * phi.sin()) * sine;
                let solid = radius.sin().powi(2) * mu / cosine * 2.0 * PI / f64::from(rings * azimuths);
                sum += mirror_weight(0.8, DVec3::Z, s, o, radius) * solid;
            }
        }
        assert!((sum / (0.8 * theta.cos()) - 1.0).abs() < 1e-6, "{theta}: {sum}");
    }
}

/// A Sun much wider than the lobe shows itself, with Schlick's reflectance.
#[test]
fn cook_torrance_of_no_roughness_is_a_mirror() {
    let (theta, radius) = (0.7f64, 0.05);
    let (s, o) = (direction(theta, 0.0), direction(theta + 0.01, PI));
    let fresnel = 0.5 + 0.5 * (1.0 - theta.cos()).powi(5);
    let mirror = mirror_weight(fresnel, DVec3::Z, s, o, radius);
    let lobe = weight(&specular(Model::CookTorrance, 1.0, 1e-3), DVec3::Z, s, o, radius);
    assert!((lobe / mirror - 1.0).abs() < 0.01, "{lobe} {mirror}");
}
