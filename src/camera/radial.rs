//! Circular profiles by diffraction and turbulence, tabulated against the radius.
//!
//! Diffraction by an aperture D with a central obstruction of the share e of its diameter, v = pi D r / lambda (Born & Wolf 1999,
//! sect. 8.5.2, annular aperture):
//!
//! ```text
//! p(r) = pi D^2 / (4 lambda^2 (1 - e^2)) [2 J1(v)/v - e^2 2 J1(e v)/(e v)]^2
//! ```
//!
//! Long exposures through Kolmogorov turbulence (Fried 1966, JOSA 56, 1372): the transfer function of the aperture (O'Neill 1956,
//! JOSA 46, 285) times exp(-3.44 (lambda f / r0)^(5/3)), the seeing's FWHM being 0.976 lambda / r0; the profile is its
//! Hankel transform p(r) = 2 pi int T(f) J0(2 pi f r) f df.

use crate::base::quadrature::gauss_legendre;
use std::f64::consts::PI;

/// A transfer function's turbulence is cut where it falls below exp(-34).
const CUT: f64 = 3.953;

/// A circular profile of unit sum over the plane.
#[derive(Debug, Clone, PartialEq)]
pub struct Radial {
    scale: Scale,
    /// Density \[1/px^2\] at the nodes, or its logarithm on a graded scale.
    values: Vec<f64>,
    /// Share of the light within each node.
    within: Vec<f64>,
    fwhm: f64,
}

/// Where the nodes lie.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Scale {
    /// r = step k: for rings.
    Even { step: f64 },
    /// r = core sinh(step k): for a smooth core and wings that fall as a power.
    Graded { core: f64, step: f64 },
}

impl Scale {
    fn radius(&self, k: f64) -> f64 {
        match *self {
            Self::Even { step } => step * k,
            Self::Graded { core, step } => core * libm::sinh(step * k),
        }
    }

    fn place(&self, radius: f64) -> f64 {
        match *self {
            Self::Even { step } => radius / step,
            Self::Graded { core, step } => libm::asinh(radius / core) / step,
        }
    }
}

impl Radial {
    /// Diffraction, the light spread over `bands`: lambda / D \[px\] and share. Tabulated out to `reach` px.
    pub fn airy(bands: &[[f64; 2]], obstruction: f64, reach: f64) -> Self {
        let narrowest = bands.iter().fold(f64::INFINITY, |least, [width, _]| least.min(*width));
        let e2 = obstruction * obstruction;
        let somb = |v: f64| if v.abs() < 1e-6 { 1.0 } else { 2.0 * libm::j1(v) / v };
        let density = |r: f64| {
            let one = |[width, share]: &[f64; 2]| {
                let v = PI * r / width;
                let amplitude = somb(v) - e2 * somb(obstruction * v);
                share * PI / (4.0 * width * width * (1.0 - e2)) * amplitude * amplitude
            };
            bands.iter().map(one).sum::<f64>()
        };
        Self::tabulate(Scale::Even { step: narrowest / 24.0 }, reach, density)
    }

    /// Seeing of full width `seeing` px through an aperture of lambda / D = `width` px.
    pub fn kolmogorov(seeing: f64, width: f64, obstruction: f64, reach: f64) -> Self {
        let per_r0 = seeing / 0.976;
        let highest = (CUT * (1.0 / per_r0)).min(1.0 / width);
        let transfer =
            |f: f64| annular(f * width, obstruction) * libm::exp(-3.44 * libm::pow(per_r0 * f, 5.0 / 3.0));
        let (nodes, weights) = gauss_legendre(16);
        let density = |r: f64| {
            // panels of half a period of the Bessel function at most; the first in t^3, for the 5/3 power at the origin
            let panels = (2.0 * r * highest).ceil().max(12.0);
            let panel = highest / panels;
            let sum_over = |map: &dyn Fn(f64) -> [f64; 2]| {
                let term = |(x, w): (&f64, &f64)| {
                    let [f, df] = map(0.5 * (x + 1.0));
                    0.5 * w * df * transfer(f) * libm::j0(2.0 * PI * f * r) * f
                };
                nodes.iter().zip(&weights).map(term).sum::<f64>()
            };
            let mut sum = sum_over(&|t| [panel * t * t * t, panel * 3.0 * t * t]);
            for k in 1..panels as usize {
                sum += sum_over(&|t| [panel * (k as f64 + t), panel]);
            }
            2.0 * PI * sum
        };
        let core = 0.5 * seeing.hypot(width);
        Self::tabulate(Scale::Graded { core, step: 0.03 }, reach, density)
    }

    fn tabulate(scale: Scale, reach: f64, density: impl Fn(f64) -> f64 + Sync) -> Self {
        use rayon::prelude::*;
        let count = scale.place(reach).ceil() as usize + 4;
        let densities = (0..count).into_par_iter().map(|k| density(scale.radius(k as f64))).collect::<Vec<_>>();
        let logarithmic = matches!(scale, Scale::Graded { .. });
        let values = densities.iter().map(|p| if logarithmic { libm::log(p.max(1e-300)) } else { *p }).collect();
        let mut radial = Self { scale, values, within: vec![0.0; count], fwhm: 0.0 };
        let (nodes, weights) = gauss_legendre(4);
        for k in 1..count {
            let (from, to) = (scale.radius(k as f64 - 1.0), scale.radius(k as f64));
            let term = |(x, w): (&f64, &f64)| {
                let r = 0.5 * (from + to) + 0.5 * (to - from) * x;
                0.5 * (to - from) * w * 2.0 * PI * r * radial.density(r * r)
            };
            radial.within[k] = radial.within[k - 1] + nodes.iter().zip(&weights).map(term).sum::<f64>();
        }
        let half = 0.5 * densities[0];
        let below = densities.iter().position(|p| *p < half).unwrap_or(count - 1).max(1);
        let (p, q) = (densities[below - 1], densities[below]);
        let place = (below - 1) as f64 + if p > q { (p - half) / (p - q) } else { 0.0 };
        radial.fwhm = 2.0 * scale.radius(place);
        radial
    }

    /// Surface density at radius squared `r2` \[1/px^2\]; beyond the table that of its end.
    pub fn density(&self, r2: f64) -> f64 {
        let place = self.scale.place(r2.sqrt()).clamp(0.0, (self.values.len() - 3) as f64);
        let below = (place as usize).max(1);
        let t = place - below as f64;
        let [a, b, c, d] = [below - 1, below, below + 1, below + 2].map(|k| self.values[k]);
        // Lagrange's cubic through the nodes at -1, 0, 1, 2
        let value = -t * (t - 1.0) * (t - 2.0) / 6.0 * a + (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0 * b
            - (t + 1.0) * t * (t - 2.0) / 2.0 * c
            + (t + 1.0) * t * (t - 1.0) / 6.0 * d;
        if matches!(self.scale, Scale::Graded { .. }) { libm::exp(value) } else { value.max(0.0) }
    }

    /// The radius outside of which lies the share `outside` of the light \[px\]; the end of the table if it is farther out.
    pub fn radius(&self, outside: f64) -> f64 {
        let k = self.within.partition_point(|within| 1.0 - within > outside);
        let last = self.within.len() - 1;
        if k == 0 || k > last {
            return self.scale.radius(k.min(last) as f64);
        }
        let (before, after) = (self.within[k - 1], self.within[k]);
        self.scale.radius(k as f64 - (after - (1.0 - outside)) / (after - before).max(1e-300))
    }

    /// Full width at half maximum \[px\].
    pub fn fwhm(&self) -> f64 {
        self.fwhm
    }
}

/// Transfer function of an annular aperture at the share `nu` of its cut-off frequency.
fn annular(nu: f64, obstruction: f64) -> f64 {
    if nu >= 1.0 {
        return 0.0;
    }
    let disc = |nu: f64| {
        if nu < 1.0 { 2.0 / PI * (libm::acos(nu) - nu * (1.0 - nu * nu).sqrt()) } else { 0.0 }
    };
    if obstruction <= 0.0 {
        return disc(nu);
    }
    let e = obstruction;
    let cross = if nu <= 0.5 * (1.0 - e) {
        -2.0 * e * e
    } else if nu < 0.5 * (1.0 + e) {
        let phi = libm::acos(((1.0 + e * e - 4.0 * nu * nu) / (2.0 * e)).clamp(-1.0, 1.0));
        let corner = libm::atan((1.0 + e) / (1.0 - e) * libm::tan(0.5 * phi));
        -2.0 * e * e + 2.0 * e / PI * libm::sin(phi) + (1.0 + e * e) / PI * phi - 2.0 * (1.0 - e * e) / PI * corner
    } else {
        0.0
    };
    (disc(nu) + e * e * disc(nu / e) + cross) / (1.0 - e * e)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Born & Wolf: 83.8 % within the first dark ring at 1.22 lambda / D, 91.0 % within the second; FWHM 1.029 lambda / D.
    #[test]
    fn the_airy_disc_is_the_published_one() {
        let airy = Radial::airy(&[[3.0, 1.0]], 0.0, 60.0);
        assert!((airy.fwhm() / 3.0 - 1.029).abs() < 2e-3, "{}", airy.fwhm());
        for (ring, within) in [(1.2197, 0.8378), (2.2331, 0.9099), (3.2383, 0.9376)] {
            assert!(airy.density((3.0f64 * ring).powi(2)) < 1e-6 * airy.density(0.0));
            let node = airy.scale.place(3.0 * ring).round() as usize;
            assert!((airy.within[node] - within).abs() < 2e-3, "{ring}: {}", airy.within[node]);
        }
    }

    /// Turbulence alone: FWHM 0.976 lambda / r0, half of the light within 0.579 FWHM (HLR / FWHM of GalSim's documentation), wings as r^(-11/3).
    #[test]
    fn kolmogorov_is_the_published_one() {
        let seeing = Radial::kolmogorov(4.0, 1e-3, 0.0, 400.0);
        assert!((seeing.fwhm() / 4.0 - 1.0).abs() < 2e-3, "{}", seeing.fwhm());
        assert!((seeing.radius(0.5) / 4.0 - 0.5787).abs() < 0.02, "{}", seeing.radius(0.5));
        let slope = libm::log(seeing.density(300f64.powi(2)) / seeing.density(150f64.powi(2))) / libm::log(2.0);
        assert!((slope + 11.0 / 3.0).abs() < 0.05, "{slope}");
    }

    /// The Hankel transform of the aperture's transfer function alone is the annular diffraction image.
    #[test]
    fn both_ways_to_diffraction_agree() {
        let (width, e) = (2.0, 0.485);
        let direct = Radial::airy(&[[width, 1.0]], e, 40.0);
        let transform = Radial::kolmogorov(1e-6, width, e, 40.0);
        for r in [0.0, 0.5, 1.0, 1.7, 3.1, 8.3] {
            let (a, b) = (direct.density(r * r), transform.density(r * r));
            assert!((a - b).abs() < 3e-4 * direct.density(0.0), "{r}: {a} {b}");
        }
        assert!((annular(0.0, e) - 1.0).abs() < 1e-12 && annular(1.0, e) == 0.0);
    }
}
