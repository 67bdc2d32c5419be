//! In what direction the point spread function is long.
//!
//! Astigmatism and shaking lengthen images all over the frame: the symmetric matrix of unit determinant that makes them round is fitted to
//! the pixels of points.

use super::frame::Frame;
use super::growth::Psf;
use super::least_squares::Normal;
use super::rings::POINT_PX;
use super::segment::Segment;
use super::stamp::Stamp;
use glam::{DMat2, DVec2};

/// What round images may miss of a source's light in a pixel, as a share.
const TOLERATED: f64 = 0.02;
/// Smaller elongations are of no account.
const LEAST_ELONGATION: f64 = 0.01;
/// Larger ones are something else.
const MOST_ELONGATION: f64 = 0.5;
/// Most points that tell the elongation.
const MOST_POINTS: usize = 12;

/// The matrix through which the images of `points` are round; the identity where they are, or where they do not tell.
pub fn lens(frame: &Frame, psf: &Psf, points: &[(Segment, f64)]) -> DMat2 {
    let fwhm = psf.fwhm_px.hypot(0.68);
    let radius = 2.5 * fwhm;
    let points = points.iter().filter(|(s, variance)| s.length() < POINT_PX && *variance > 0.0).take(MOST_POINTS);
    let stamp = |s: &Segment| Stamp::gather(frame, s, radius, 1.5 * fwhm, |_| false);
    let points = points.map(|(s, v)| (*s, *v, stamp(s))).filter(|p| p.2.saturated == 0 && p.2.bad == 0);
    let points = points.collect::<Vec<_>>();
    let pixels = points.iter().map(|p| p.2.pixels.len()).sum::<usize>();
    if pixels < 20 {
        return DMat2::IDENTITY;
    }
    let round = psf.image(radius + 2.0 * fwhm);
    let chi2 = |e: DVec2| {
        let image = round.clone().through(matrix(e));
        points
            .iter()
            .map(|(source, variance, stamp)| misfit(stamp, *variance, |p| image.share_and_slope(source, p)))
            .sum::<f64>()
    };
    let Some((e, gain)) = summit(chi2) else { return DMat2::IDENTITY };
    // two numbers more; pixels count as far as the round images explain them
    let spare = (pixels.max(4 * points.len()) - 3 * points.len()) as f64;
    let scale = (chi2(e) / spare).max(1.0);
    let told = gain / scale > 2.0 * (pixels as f64).ln() + 10.0;
    if told && (LEAST_ELONGATION..MOST_ELONGATION).contains(&e.length()) { matrix(e) } else { DMat2::IDENTITY }
}

/// Symmetric, of determinant 1: longer by the factor exp(|e|) one way than it is the other.
fn matrix(e: DVec2) -> DMat2 {
    let size = e.length();
    let (sinh, cosh) = ((0.5 * size).sinh(), (0.5 * size).cosh());
    let along = if size > 0.0 { e / size } else { DVec2::ZERO };
    DMat2::from_cols(
        DVec2::new(cosh - along.x * sinh, -along.y * sinh),
        DVec2::new(-along.y * sinh, cosh + along.x * sinh),
    )
}

/// Chi-square of a point over a level, both fitted, its place too to the first order.
fn misfit(stamp: &Stamp, variance: f64, share: impl Fn(DVec2) -> (f64, DVec2)) -> f64 {
    let rows = stamp.pixels.iter().map(|p| {
        let (own, slope) = share(p.place);
        ([own, 1.0, slope.x, slope.y], p.value_e)
    });
    let rows = rows.collect::<Vec<_>>();
    let light =
        rows.iter().map(|(r, v)| r[0] * v).sum::<f64>() / rows.iter().map(|(r, _)| r[0] * r[0]).sum::<f64>();
    let weight = |own: f64| {
        let e = (light * own).max(0.0);
        1.0 / (variance + e + (TOLERATED * e).powi(2))
    };
    let mut normal = Normal::new(4);
    rows.iter().for_each(|(r, v)| normal.add(r, *v, weight(r[0])));
    let Some((x, _)) = normal.solve() else { return 0.0 };
    let model = |r: &[f64; 4]| r.iter().zip(&x).map(|(a, b)| a * b).sum::<f64>();
    rows.iter().map(|(r, v)| (v - model(r)).powi(2) * weight(r[0])).sum()
}

/// The minimum of a smooth function of two numbers near zero, by paraboloids, and how much lower it is than at zero.
fn summit(f: impl Fn(DVec2) -> f64) -> Option<(DVec2, f64)> {
    let start = f(DVec2::ZERO);
    let (mut at, mut value, mut h) = (DVec2::ZERO, start, 0.1);
    for _ in 0..3 {
        let (right, left) = (f(at + DVec2::X * h), f(at - DVec2::X * h));
        let (up, down) = (f(at + DVec2::Y * h), f(at - DVec2::Y * h));
        let corner = f(at + DVec2::splat(h));
        let gradient = DVec2::new(right - left, up - down) / (2.0 * h);
        let (xx, yy) = ((right + left - 2.0 * value) / (h * h), (up + down - 2.0 * value) / (h * h));
        let xy = (corner - right - up + value) / (h * h);
        let hessian = DMat2::from_cols(DVec2::new(xx, xy), DVec2::new(xy, yy));
        if !(xx > 0.0 && hessian.determinant() > 0.0) {
            return None;
        }
        let next = at - (hessian.inverse() * gradient).clamp_length_max(2.0 * h);
        let there = f(next);
        if there < value {
            (at, value) = (next, there);
        }
        h *= 0.4;
    }
    value.is_finite().then_some((at, start - value))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::photometry::profile::Shape;
    use crate::photometry::synthetic;

    /// Points 20 % longer one way: the matrix is found to 0.03 and makes the chi-square that of noise; round points leave the
    /// identity.
    #[test]
    fn long_images_are_made_round() {
        let psf = Psf::known(Shape::Moffat { inverse_beta: 0.2 }, 3.2);
        for (e, seed) in [(DVec2::ZERO, 3), (DVec2::new(0.15, 0.1), 4), (DVec2::new(-0.05, -0.2), 5)] {
            let image = psf.image(40.0).through(matrix(e));
            let centres =
                (0..6).map(|i| DVec2::new(40.3 + 45.0 * f64::from(i % 3), 40.6 + 60.0 * f64::from(i / 3)));
            let points = centres.map(|c| (Segment::point(c), 210.0)).collect::<Vec<_>>();
            let mean = (0..160 * 150).map(|i| {
                let place = DVec2::new(f64::from(i % 160), f64::from(i / 160));
                110.0 + points.iter().map(|(s, _)| 4e4 * image.share(s, place)).sum::<f64>()
            });
            let frame =
                synthetic::develop(&synthetic::Camera::default(), 160, 150, seed, &mean.collect::<Vec<_>>());
            let found = lens(&frame, &psf, &points);
            let off = found - matrix(e);
            assert!(off.x_axis.length().max(off.y_axis.length()) < 0.015, "{e}: {found}");
            assert_eq!(e == DVec2::ZERO, found == DMat2::IDENTITY);
        }
        assert_eq!(
            lens(&synthetic::blank(9, 9, f32::NAN), &psf, &[(Segment::point(DVec2::splat(4.0)), 1.0)]),
            DMat2::IDENTITY
        );
    }
}
