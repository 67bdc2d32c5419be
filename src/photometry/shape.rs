//! Images of a point: radial profiles, plain and as pixels see them.
//!
//! Two families of one width each: Moffat 1969, A&A 3, 455, I ~ (1 + (r/a)^2)^-beta, with the Gaussian as
//! its limit beta -> infinity; and Kolmogorov turbulence in a long exposure (Fried 1966, JOSA 56, 1372), the
//! transform of exp(-3.44 (f lambda/r0)^(5/3)), FWHM = 0.976 lambda/r0, wings r^(-11/3). A profile is blurred by
//! the pixel that collects it and by the pixel weights of the aperture: two unit boxes, averaged over directions
//! and over places within a pixel. A single point takes one place only: its light in each pixel is the profile
//! blurred by one box at the pixel's distance, and its share the sum over the pixels' own weights.
//!
//! A box averaged over directions is a series in powers of the Laplacian, which is used where images are wide enough;
//! narrower ones are summed over places within the box.

use super::turbulence;
use crate::base::elementary::{exp, ln};
use crate::base::simd::Path;
use std::f64::consts::PI;

/// Shape of a profile.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// Moffat profile.
    Moffat {
        /// 1/beta; 0 = Gaussian, must stay below 1 for the light to be finite.
        inverse_beta: f64,
    },
    /// Long exposure through Kolmogorov turbulence.
    Kolmogorov,
}

/// 4 ln 2: a Gaussian of FWHM 1 is exp(-`GAUSS` r^2).
const GAUSS: f64 = 4.0 * std::f64::consts::LN_2;

/// A shape with its constants worked out, for FWHM = 1 and unit flux.
#[derive(Debug, Clone, Copy)]
enum Ready {
    Gaussian,
    /// Norm, 1/a^2, beta.
    Moffat(f64, f64, f64),
    Kolmogorov,
}

impl Shape {
    /// Intensity at `r`, for FWHM = 1 and unit flux.
    pub fn intensity(self, r: f64) -> f64 {
        match self.ready() {
            Ready::Gaussian => gaussian(r * r)[0],
            Ready::Moffat(norm, k, beta) => moffat(norm, k, beta, r * r)[0],
            Ready::Kolmogorov => turbulence::intensity(r),
        }
    }

    fn ready(self) -> Ready {
        match self {
            Self::Moffat { inverse_beta } if inverse_beta < 1e-3 => Ready::Gaussian,
            Self::Moffat { inverse_beta } => {
                // 1/a^2 for FWHM = 1
                let k = 4.0 * (2f64.powf(inverse_beta) - 1.0);
                let beta = 1.0 / inverse_beta;
                Ready::Moffat((beta - 1.0) * k / PI, k, beta)
            }
            Self::Kolmogorov => Ready::Kolmogorov,
        }
    }
}

/// Intensity of the Gaussian at r^2 = `u` and its first three Laplacians.
#[inline(always)]
fn gaussian(u: f64) -> [f64; 4] {
    let g = GAUSS / PI * exp(-GAUSS * u);
    laplacians(u, g, [-GAUSS; 6])
}

/// Intensity of a Moffat profile at r^2 = `u` and its first three Laplacians.
#[inline(always)]
fn moffat(norm: f64, k: f64, beta: f64, u: f64) -> [f64; 4] {
    let y = 1.0 + k * u;
    let slope = -k / y;
    laplacians(u, norm * exp(-beta * ln(y)), [0.0, 1.0, 2.0, 3.0, 4.0, 5.0].map(|n| (beta + n) * slope))
}

/// A profile g(u) and its first three Laplacians: nabla^2m = 4^m sum_i binom(m, i) m!/i! u^i g^(m+i), each derivative
/// being the one before times a ratio.
#[inline(always)]
fn laplacians(u: f64, g: f64, ratios: [f64; 6]) -> [f64; 4] {
    let mut d = [g; 7];
    for n in 1..7 {
        d[n] = ratios[n - 1] * d[n - 1];
    }
    let first = d[1] + u * d[2];
    let second = 2.0 * d[2] + u * (4.0 * d[3] + u * d[4]);
    let third = 6.0 * d[3] + u * (18.0 * d[4] + u * (9.0 * d[5] + u * d[6]));
    [g, 4.0 * first, 16.0 * second, 64.0 * third]
}

/// What blurs an image: boxes of one pixel.
pub(super) struct Blur {
    /// Three places an axis and their weights, with the second and the fourth moment.
    rule: [(f64, f64); 3],
    /// Coefficients of the powers of the Laplacian, which are those of the boxes' transform averaged over directions.
    series: [f64; 3],
}

/// One box, sinc(kx/2) sinc(ky/2), and two, its square, to the sixth order.
pub(super) const BOXES: [Blur; 2] = [
    Blur {
        rule: three_points(0.387_298_334_620_742, 5.0 / 18.0),
        series: [1.0 / 24.0, 0.75 / 1920.0 + 0.125 / 576.0, 0.625 / 322_560.0 + 0.125 / 46_080.0],
    },
    Blur {
        rule: three_points(0.632_455_532_033_676, 5.0 / 24.0),
        series: [1.0 / 12.0, 0.75 / 360.0 + 0.125 / 144.0, 0.625 / 20_160.0 + 0.125 / 4_320.0],
    },
];
/// Below this FWHM the series converges badly \[px\].
const LEAST_SERIES_FWHM: f64 = 2.5;

const fn three_points(node: f64, weight: f64) -> [(f64, f64); 3] {
    [(-node, weight), (0.0, 1.0 - 2.0 * weight), (node, weight)]
}

/// Surface brightness \[1/px^2\] at each of `radii` \[px\] of a profile of `fwhm` \[px\], blurred.
pub(super) fn blurred(shape: Shape, fwhm: f64, radii: &[f64], blur: &Blur, out: &mut [f64]) {
    let path = Path::best();
    match shape.ready() {
        Ready::Gaussian => path.run(
            #[inline(always)]
            || fill(fwhm, radii, blur, out, gaussian),
        ),
        Ready::Moffat(norm, k, beta) => path.run(
            #[inline(always)]
            || {
                fill(
                    fwhm,
                    radii,
                    blur,
                    out,
                    #[inline(always)]
                    |u| moffat(norm, k, beta, u),
                );
            },
        ),
        Ready::Kolmogorov => fill(fwhm, radii, blur, out, turbulence::laplacians),
    }
}

/// The same for a profile whose intensity and Laplacians at r^2, FWHM = 1, a function tells.
#[inline(always)]
fn fill(fwhm: f64, radii: &[f64], blur: &Blur, out: &mut [f64], at: impl Fn(f64) -> [f64; 4]) {
    // seen from 22.5 deg, the fourth order of a square is that of its average over directions
    const TOWARDS: (f64, f64) = (0.923_879_532_511_287, 0.382_683_432_365_09);
    let s = 1.0 / (fwhm * fwhm);
    // farther out a pixel sees what there is at its middle
    let near = 8.0 * fwhm.max(3.0);
    let inner = radii.partition_point(|r| *r <= near).min(out.len());
    let (inside, outside) = out.split_at_mut(inner);
    outside.iter_mut().zip(&radii[inner..]).for_each(|(o, r)| *o = s * at(r * r * s)[0]);
    if fwhm >= LEAST_SERIES_FWHM {
        let [a, b, c] = blur.series;
        for (o, r) in inside.iter_mut().zip(radii) {
            let u = at(r * r * s);
            *o = s * (u[0] + s * (a * u[1] + s * (b * u[2] + s * c * u[3])));
        }
        return;
    }
    for (o, r) in inside.iter_mut().zip(radii) {
        let (x, y) = (r * TOWARDS.0, r * TOWARDS.1);
        let mut sum = 0.0;
        for (dy, v) in blur.rule {
            for (dx, w) in blur.rule {
                sum += v * w * at(((x + dx) * (x + dx) + (y + dy) * (y + dy)) * s)[0];
            }
        }
        *o = s * sum;
    }
}
