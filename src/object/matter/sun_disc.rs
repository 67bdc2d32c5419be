//! The Sun is a disc, 4.65e-3 rad in radius at 1 au: no glint is sharper than it.
//!
//! Its radiance falls from the centre to the limb, L = L0 mu^a with a = 0.508 (579 nm; Hestroffer & Magnan 1998,
//! A&A 333, 338) and mu = sqrt(1 - (sin delta/sin R)²), delta from the centre, R the angular radius. The
//! irradiance normal to the beam is
//!
//! ```text
//! E = ∫ L cos(delta) dω = 2π L0 sin²R ∫ mu^a r dr = 2π L0 sin²R/(a + 2),   r = sin(delta)/sin R
//! ```
//!
//! **Rough surfaces**: the weight of a facet is the mean over the disc of f(s', o) cs'₊ co₊, each s' counting by
//! its part of E, L cos(delta) dω/E: so a Lambertian facet that sees the whole disc has exactly the weight of a
//! point Sun. In coordinates (x, y) = r (cos, sin) that part is mu^a dx dy, and with x = sqrt(1 - y²) u
//!
//! ```text
//! (1 - x² - y²)^(a/2) dx dy = (1 - u²)^(a/2) du (1 - y²)^((a+1)/2) dy
//! ```
//!
//! so a product of two Gauss-Gegenbauer rules of N points integrates polynomials in x and y of degree 2N - 1
//! exactly. x lies in the plane of s and o, y across it. Across, a lobe of the half-way vector is h.s times as wide
//! as along (|ds| = 2 h.s |dh|), so y may need more points.
//!
//! **Mirrors** show the disc itself: the radiance towards o is C_s L(delta), delta now the angle between the
//! mirror image of o and the Sun's centre. Per facet area and E the flux is
//!
//! ```text
//! C_s co L/E = C_s co (a + 2)/(2π sin²R) mu^a
//! ```

use super::{Material, Model};
use glam::DVec3;
use std::f64::consts::PI;
use std::sync::LazyLock;

/// Exponent of the limb darkening at 579 nm (Hestroffer & Magnan 1998).
const LIMB: f64 = 0.508;
/// Points of the rules.
const SIZES: [usize; 18] = [1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 16, 20, 24, 32, 48, 64, 96, 128];
/// Least points per axis where the integrand has a kink.
const KINK: f64 = 12.0;

/// Nodes on -1..1 and weights summing to 1.
type Rule = Vec<(f64, f64)>;

/// Rules of SIZES points for the weight (1 - x²)^(a/2), then for (1 - x²)^((a+1)/2).
static RULES: LazyLock<[Vec<Rule>; 2]> =
    LazyLock::new(|| [LIMB / 2.0, (LIMB + 1.0) / 2.0].map(|power| SIZES.map(|n| gegenbauer(n, power)).to_vec()));

/// Contribution \[m²/sr per m²\] of a facet of unit normal n, the Sun's centre in the unit direction s, the observer in
/// o: its flux per area and solar irradiance, averaged over the Sun's disc of angular radius `sun_radius` \[rad\].
/// The average of a specular lobe is within 1e-4 of the lobe's peak up to 85 deg of incidence for exponents to 1e5
/// and widths from 0.01 (5e-3 at 89 deg); lower, and for sharper lobes, the peak of a
/// half-way lobe, narrow across, may be wrong by its own size. A point Sun is used where it is that good.
pub fn weight(material: &Material, n: DVec3, s: DVec3, o: DVec3, sun_radius: f64) -> f64 {
    let (cs, co) = (n.dot(s), n.dot(o));
    if !(co > 0.0 && cs > -sun_radius) {
        return 0.0;
    }
    if cs >= sun_radius && matches!(material.model, Model::Lambert) {
        return material.diffuse / PI * cs * co;
    }
    let radius = libm::sin(sun_radius);
    let glint = match material.model {
        Model::Mirror => mirror_weight(material.specular, n, s, o, sun_radius),
        _ => 0.0,
    };
    let c = s.dot(o);
    match rules(material, cs, co, c, radius) {
        (0, 0) => glint + material.f(cs, co, c) * cs * co,
        rules => glint + disc_mean(material, n, s, o, radius, rules),
    }
}

/// Width of a material's narrowest lobe as the half vector moves \[rad\]: a standard deviation, or half the Sun's radius of a
/// mirror; none of materials without a lobe.
pub fn lobe_width(material: &Material, sun_radius: f64) -> Option<f64> {
    let least = 0.5 * sun_radius;
    let width = match material.model {
        _ if material.specular == 0.0 => return None,
        Model::Mirror => least,
        Model::Phong | Model::PhongDraft => 0.5 / material.exponent.max(1e-9).sqrt(),
        Model::BlinnPhong | Model::BlinnPhongDraft | Model::AshikhminShirley => {
            1.0 / material.exponent.max(1e-9).sqrt()
        }
        Model::CookTorrance => material.roughness,
        _ => return None,
    };
    Some(width.max(least))
}

/// Weight of the mirror image of the Sun \[1/sr\], reflectance `specular`; arguments as [`weight`].
pub fn mirror_weight(specular: f64, n: DVec3, s: DVec3, o: DVec3, sun_radius: f64) -> f64 {
    let (cs, co, radius) = (n.dot(s), n.dot(o), libm::sin(sun_radius));
    // sin² delta from |r - s|² = 2 - 2 cos delta, with r the mirror image of o: no digits cancel
    let gap = (n * (2.0 * co) - o - s).length_squared();
    let mu2 = 1.0 - gap * (1.0 - 0.25 * gap) / (radius * radius);
    // s' = r, so the mirrored point of the disc is above the horizon if o is
    match co > 0.0 && cs > -radius && gap < 2.0 && mu2 > 0.0 {
        true => specular * co * (LIMB + 2.0) / (2.0 * PI * radius * radius) * libm::pow(mu2, 0.5 * LIMB),
        false => 0.0,
    }
}

/// The rules (index into SIZES) along and across the plane of s and o that keep the error below 1e-4 of the peak of the
/// averaged lobe; 0 is the point Sun. They follow x = sin R/σ, σ \[rad\] the lobe's standard deviation as s moves, or
/// cs where that is less.
fn rules(material: &Material, cs: f64, co: f64, c: f64, radius: f64) -> (usize, usize) {
    let whole = cs >= radius;
    let (along, across, u2) = lobe(material, cs, co, c);
    // kinks along cs = co; e^(-25/2) of a lobe is left at u = 5
    let kinked = (cs - co).abs() < radius
        && match material.model {
            Model::OrenNayar => true,
            Model::AshikhminShirley => u2 < 25.0,
            _ => false,
        };
    // of these the weight is linear in s, or nearly
    let linear = matches!(material.model, Model::Lambert | Model::OrenNayar | Model::Mirror | Model::Tabulated(_));
    if linear && whole && !kinked {
        return (0, 0);
    }
    // far out, a point Sun is in error by 2 x²/u⁶ of the peak or less: there the lobe does not matter
    let x = radius * across.sqrt();
    let near = u2 * u2.sqrt() <= 343.0 * x * (1.0 + x).powi(3);
    let (along, across) = if near { (along, across) } else { (0.0, 0.0) };
    let least = if kinked || !whole { KINK } else { 1.0 };
    let tilt = 1.0 / cs.max(radius).powi(2);
    let rule = |sharpness: f64| {
        let count = count(radius * (sharpness + tilt).sqrt()).max(least);
        SIZES.partition_point(|&n| (n as f64) < count).min(SIZES.len() - 1)
    };
    (rule(along), rule(across))
}

/// Sharpness 1/σ² \[1/rad²\] of the lobe along and across, and u², the square of the distance from its centre in
/// standard deviations (widths, of GGX).
fn lobe(material: &Material, cs: f64, co: f64, c: f64) -> (f64, f64, f64) {
    let (n, w) = (material.exponent, material.roughness);
    // 1/h.s² and tan² of the angle from n to h
    let spread = 2.0 / (1.0 + c).max(1e-12);
    let tan2 = || ((2.0 + 2.0 * c) / ((cs + co) * (cs + co)) - 1.0).max(0.0);
    match material.model {
        Model::Phong | Model::PhongDraft => (n, n, 2.0 * n * (1.0 - (2.0 * cs * co - c)).max(0.0)),
        Model::BlinnPhong | Model::BlinnPhongDraft | Model::AshikhminShirley => {
            (0.25 * n, 0.25 * n * spread, n * tan2())
        }
        Model::CookTorrance => (1.0 / (w * w), spread / (w * w), tan2() / (w * w)),
        _ => (0.0, 0.0, 0.0),
    }
}

/// Points for a lobe whose standard deviation is the Sun's radius/x; measured on GGX, the hardest: its poles are near.
fn count(x: f64) -> f64 {
    match x {
        x if x < 0.02 => 1.0,
        x if x < 0.2 => 2.0,
        x => 2.5 + 2.5 * x,
    }
}

fn disc_mean(m: &Material, n: DVec3, s: DVec3, o: DVec3, radius: f64, (along, across): (usize, usize)) -> f64 {
    let ey = s.cross(o).try_normalize().unwrap_or_else(|| s.any_orthonormal_vector());
    let ex = ey.cross(s);
    let (cs, co, c) = (n.dot(s), n.dot(o), s.dot(o));
    let (nx, ny, ox) = (radius * n.dot(ex), radius * n.dot(ey), radius * o.dot(ex));
    let [rule_u, rule_y] = &*RULES;
    let (Some(rule_u), Some(rule_y)) = (rule_u.get(along), rule_y.get(across)) else { return 0.0 };
    let mut sum = 0.0;
    for &(y, wy) in rule_y {
        let chord = (1.0 - y * y).sqrt();
        let mut row = 0.0;
        for &(u, wu) in rule_u {
            let x = chord * u;
            let cosine = (1.0 - radius * radius * (x * x + y * y)).max(0.0).sqrt();
            let csun = cosine * cs + nx * x + ny * y;
            row += wu * m.f(csun, co, cosine * c + ox * x) * csun / cosine;
        }
        sum += wy * row;
    }
    sum * co
}

/// Gauss rule of n points for the weight (1 - x²)^power, mass 1, from the recurrence of the orthonormal polynomials
/// (Abramowitz & Stegun 1964, 22.7.3, 25.4): nodes by Newton's method, weights 1/Σ p_k².
fn gegenbauer(n: usize, power: f64) -> Rule {
    let lambda = power + 0.5;
    let root_beta = |k: usize| {
        let k = k as f64;
        (k * (k + 2.0 * lambda - 1.0) / (4.0 * (k + lambda) * (k + lambda - 1.0))).sqrt()
    };
    let node = |i: usize| {
        let mut x = libm::cos((i as f64 + 0.5 + 0.5 * lambda) * PI / (n as f64 + lambda));
        let mut norm = 1.0;
        for _ in 0..20 {
            // p_k and its derivative, k = 0..n; norm = Σ p_k² below n
            let (mut p, mut dp, mut before, mut dbefore, mut beta) = (1.0, 0.0, 0.0, 0.0, 0.0);
            norm = 0.0;
            for k in 0..n {
                norm += p * p;
                let next = root_beta(k + 1);
                let (up, dup) = ((x * p - beta * before) / next, (p + x * dp - beta * dbefore) / next);
                (before, dbefore, p, dp, beta) = (p, dp, up, dup, next);
            }
            x -= p / dp;
        }
        (x, 1.0 / norm)
    };
    (0..n).map(node).collect()
}

#[cfg(test)]
#[path = "sun_disc_tests.rs"]
mod tests;
