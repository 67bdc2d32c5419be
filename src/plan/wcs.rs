//! The frame's pixel convention and its world coordinates, stated once.
//!
//! Pixel centres lie at integers; (0, 0) is the centre of the first stored pixel, x along a row. World
//! coordinates are the gnomonic (TAN) projection of Calabretta & Greisen 2002, A&A 395, 1077, with the linear
//! part of everything that bends the field (scale, rotation, differential aberration and refraction) in the
//! CD matrix, and the quadratic and cubic parts as SIP polynomials (Shupe et al. 2005, ASP Conf. 347, 491)
//! where they exceed [`SIP_NEEDED_PX`] in a corner. The frame is drawn through this same mapping.

use super::sip::{CUBIC, SIP_TERMS, Sip};
use crate::astro::{angles, direction};
use glam::{DMat2, DVec2, DVec3};

/// Distortion in a corner above which polynomial terms are kept \[px\].
pub const SIP_NEEDED_PX: f64 = 0.02;

/// World coordinates of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wcs {
    /// Astrometric ICRS direction of the reference pixel.
    pub centre: DVec3,
    /// Reference pixel, 0-based.
    pub crpix: DVec2,
    /// Pixel offset to intermediate world coordinates (xi east, eta north) \[rad/px\].
    pub cd: DMat2,
    /// Distortion of higher order, if it matters.
    pub sip: Option<Sip>,
    /// East and north at the reference pixel.
    east_north: (DVec3, DVec3),
    /// The inverse of `cd` \[px/rad\].
    to_pixels: DMat2,
}

/// East and north unit vectors at a direction; at a pole, those of right ascension 0.
pub fn east_north(centre: DVec3) -> (DVec3, DVec3) {
    let (ra, dec) = angles(centre);
    let north = DVec3::new(-dec.sin() * ra.cos(), -dec.sin() * ra.sin(), dec.cos());
    (DVec3::new(-ra.sin(), ra.cos(), 0.0), north)
}

impl Wcs {
    /// World coordinates from right ascension and declination of the reference pixel \[rad\].
    pub fn new(ra: f64, dec: f64, crpix: DVec2, cd: DMat2, sip: Option<Sip>) -> Self {
        Self::assembled(direction(ra, dec), crpix, cd, sip)
    }

    fn assembled(centre: DVec3, crpix: DVec2, cd: DMat2, sip: Option<Sip>) -> Self {
        Self { centre, crpix, cd, sip, east_north: east_north(centre), to_pixels: cd.inverse() }
    }

    /// The same camera turned to another reference place.
    pub fn turned_to(self, centre: DVec3) -> Self {
        Self::assembled(centre, self.crpix, self.cd, self.sip)
    }

    /// World coordinates of the exact map `sky` from pixel offsets about `crpix` to astrometric directions,
    /// expanded to third order over offsets up to `half_size` \[px\].
    pub fn from_map(crpix: DVec2, half_size: DVec2, sky: impl Fn(DVec2) -> DVec3) -> Self {
        let centre = sky(DVec2::ZERO).normalize();
        let (east, north) = east_north(centre);
        let plane = |p: DVec2| {
            let d = sky(p);
            DVec2::new(d.dot(east), d.dot(north)) / d.dot(centre)
        };
        let h = half_size * 0.5;
        let at = |x: f64, y: f64| plane(DVec2::new(x * h.x, y * h.y));
        // differences over five points along the axes and the four between them, in steps of h
        let d1 = |f: &dyn Fn(f64) -> DVec2| (8.0 * (f(1.0) - f(-1.0)) - (f(2.0) - f(-2.0))) / 12.0;
        let d2 = |f: &dyn Fn(f64) -> DVec2| (16.0 * (f(1.0) + f(-1.0)) - (f(2.0) + f(-2.0))) / 12.0;
        let d3 = |f: &dyn Fn(f64) -> DVec2| (f(2.0) - 2.0 * f(1.0) + 2.0 * f(-1.0) - f(-2.0)) / 2.0;
        let (along_x, along_y) = (|x: f64| at(x, 0.0), |y: f64| at(0.0, y));
        let (pp, pm, mp, mm) = (at(1.0, 1.0), at(1.0, -1.0), at(-1.0, 1.0), at(-1.0, -1.0));
        let dxy = (pp - pm - mp + mm) / 4.0;
        let dxxy = (pp - pm + mp - mm - 2.0 * (at(0.0, 1.0) - at(0.0, -1.0))) / 2.0;
        let dxyy = (pp + pm - mp - mm - 2.0 * (at(1.0, 0.0) - at(-1.0, 0.0))) / 2.0;
        let taylor = [
            d2(&along_x) / 2.0,
            dxy,
            d2(&along_y) / 2.0,
            d3(&along_x) / 6.0,
            dxxy / 2.0,
            dxyy / 2.0,
            d3(&along_y) / 6.0,
        ];
        let cd = DMat2::from_cols(d1(&along_x) / h.x, d1(&along_y) / h.y);
        let to_pixels = cd.inverse();
        let term = |k: usize| {
            let (i, j) = SIP_TERMS[k];
            to_pixels * taylor[k] / (h.x.powi(i) * h.y.powi(j))
        };
        let mut sip = Sip::default();
        for k in 0..CUBIC {
            let term = term(k);
            (sip.a[k], sip.b[k]) = (term.x, term.y);
        }
        let corners = [(1.0, 1.0), (1.0, -1.0)].map(|(x, y)| sip.shift(half_size * DVec2::new(x, y)).length());
        let needed = corners.into_iter().fold(0.0, f64::max) > SIP_NEEDED_PX;
        Self::assembled(centre, crpix, cd, needed.then_some(sip))
    }

    /// The same world seen through optics that distort, by little: the sum of both polynomials is exact to the product of a
    /// distortion and the other's slope.
    pub fn through(self, optics: Option<&Sip>) -> Self {
        let sip = match (self.sip, optics) {
            (Some(sky), Some(optics)) => Some(sky.plus(optics)),
            (sky, optics) => sky.or(optics.copied()),
        };
        Self { sip, ..self }
    }

    /// Largest shift of a corner by the distortion that is kept \[px\]; the reference pixel is the centre of the frame.
    pub fn corner_shift(&self) -> f64 {
        let corner = self.crpix + 0.5;
        let corners = [corner, corner * DVec2::new(-1.0, 1.0), corner * DVec2::new(1.0, -1.0), -corner];
        self.sip.map_or(0.0, |sip| corners.into_iter().map(|c| sip.shift(c).length()).fold(0.0, f64::max))
    }

    /// Right ascension and declination of the reference pixel \[rad\].
    pub fn crval(&self) -> (f64, f64) {
        angles(self.centre)
    }

    /// Side of a pixel at the reference pixel \[rad\]: the square root of its solid angle.
    pub fn pixel_scale(&self) -> f64 {
        self.cd.determinant().abs().sqrt()
    }

    /// Astrometric ICRS unit vector of a pixel.
    pub fn sky(&self, pixel: DVec2) -> DVec3 {
        let offset = pixel - self.crpix;
        let offset = offset + self.sip.map_or(DVec2::ZERO, |sip| sip.shift(offset));
        let plane = self.cd * offset;
        let (east, north) = self.east_north;
        (self.centre + east * plane.x + north * plane.y).normalize()
    }

    /// Pixel of an astrometric ICRS direction; none behind the tangent plane or more than 80 deg off.
    pub fn pixel(&self, sky: DVec3) -> Option<DVec2> {
        let depth = sky.dot(self.centre) / sky.length();
        if depth.is_nan() || depth < 0.17 {
            return None;
        }
        let (east, north) = self.east_north;
        let plane = DVec2::new(sky.dot(east), sky.dot(north)) / sky.dot(self.centre);
        let undistorted = self.to_pixels * plane;
        let mut offset = undistorted;
        if let Some(sip) = self.sip {
            // the distortion is below a tenth of the offset: each step gains at least half a digit
            for _ in 0..24 {
                let last = offset;
                offset = undistorted - sip.shift(offset);
                if (offset - last).length_squared() < 1e-20 {
                    break;
                }
            }
        }
        Some(offset + self.crpix)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::units::ARCSEC;

    fn pixel_map(quadratic: f64) -> Wcs {
        let (east, north) = east_north(direction(1.0, 0.5));
        let scale = 0.725 * ARCSEC;
        Wcs::from_map(DVec2::splat(2047.5), DVec2::splat(2048.0), |p| {
            let q = p + DVec2::new(quadratic * p.x * p.y, -quadratic * p.x * p.x);
            (direction(1.0, 0.5) - east * q.x * scale + north * q.y * scale).normalize()
        })
    }

    #[test]
    fn sky_and_pixel_are_inverse() {
        for wcs in [pixel_map(0.0), pixel_map(1e-7)] {
            for p in [DVec2::ZERO, DVec2::new(4095.0, 17.25), DVec2::splat(2047.5), DVec2::new(-1e3, 5e3)] {
                let back = wcs.pixel(wcs.sky(p)).expect("in front");
                assert!((back - p).length() < 1e-6, "{p} {back}");
            }
        }
    }

    #[test]
    fn quadratic_terms_are_kept_only_where_they_matter() {
        assert!(pixel_map(1e-9).sip.is_none());
        let sip = pixel_map(1e-7).sip.expect("0.4 px in the corner");
        assert!((sip.a[1] - 1e-7).abs() < 1e-10 && (sip.b[0] + 1e-7).abs() < 1e-10);
    }

    #[test]
    fn east_is_left_and_the_scale_is_kept() {
        let wcs = pixel_map(0.0);
        assert!(wcs.cd.x_axis.x < 0.0 && wcs.cd.y_axis.y > 0.0);
        assert!((wcs.pixel_scale() / ARCSEC - 0.725).abs() < 1e-9);
        assert!(wcs.pixel(-wcs.centre).is_none() && wcs.pixel(DVec3::NAN).is_none());
    }
}
