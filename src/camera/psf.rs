//! The image of a point: a profile integrated over pixels, and its trail along a path.
//!
//! The response of a pixel at offset d, the profile integrated over the unit square about d, is tabulated on a
//! grid finer than a pixel ([`super::planes`]). The profile is cut at a square about the point, so that the cut moves with it: all the
//! light of the square is drawn at every place, and its centroid is that place. Fainter points have smaller squares, scaled to the
//! same light. A trail is the sum of stamps along the path with Gauss-Legendre weights. [`Psf::reference`] is the slow twin: direct
//! quadrature of the profile.
//!
//! The share of light outside the largest square is told by [`Psf::lost`].

use super::path::Path;
use super::pixel_response::{ACROSS, Cells, Response};
use super::planes::Planes;
use super::profile::Profile;
use super::region::Region;
use glam::DVec2;

/// Gauss-Legendre nodes and weights on 0..1, four points (Abramowitz & Stegun 25.4.29).
const GAUSS_4: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];

/// Largest table of a point's image \[values\]: 16 MiB. Fainter wings are cut, and [`Psf::lost`] tells how much.
const LARGEST_TABLE: usize = 2 << 20;
/// Smallest square of a faint point: half its side \[px\], and that over the FWHM.
const SMALLEST: [f64; 2] = [4.0, 1.3];
/// Images wider than this may have a table four times as large: it has few points to a pixel \[px\].
const WIDE: f64 = 32.0;

/// A tabulated point image.
#[derive(Debug, Clone)]
pub struct Psf {
    profile: Profile,
    /// Grid points per pixel.
    fine: usize,
    /// Squares about the point, the smallest first.
    squares: Vec<Square>,
    lost: f64,
}

/// The image cut at a square.
#[derive(Debug, Clone)]
struct Square {
    /// Half the side, less half a pixel \[px\].
    radius: usize,
    planes: Planes,
    /// Largest response on its rim \[1/px\].
    rim: f64,
}

/// A point's light, drawn in a square of its own size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stamp {
    /// Number of the square.
    pub square: usize,
    /// Electrons over an endless plane.
    pub electrons: f64,
}

/// Grid points per pixel for an image of width `fwhm`.
fn fineness(fwhm: f64) -> usize {
    (2 * (0.5 * ACROSS / fwhm).ceil() as usize).clamp(2, 64)
}

/// Half the side of the largest square for an image of width `fwhm` \[px\].
fn largest(fwhm: f64) -> f64 {
    let values = LARGEST_TABLE as f64 * if fwhm > WIDE { 4.0 } else { 1.0 };
    (values.sqrt() / fineness(fwhm) as f64 - 9.0) / 2.0
}

/// How far from the point an image of width `fwhm` is asked for \[px\].
pub fn farthest(fwhm: f64) -> f64 {
    std::f64::consts::SQRT_2 * (largest(fwhm) + 2.0)
}

impl Psf {
    /// The image of `profile` with at most the share `outside` of its light outside the largest square, as far as that fits
    /// into memory.
    pub fn new(profile: Profile, outside: f64) -> Self {
        let fine = fineness(profile.fwhm());
        let radius = profile.radius(outside).ceil().min(largest(profile.fwhm())).max(2.0) as usize;
        let mut radii = vec![radius];
        let smallest = SMALLEST[0].max(SMALLEST[1] * profile.fwhm());
        while let Some(last) = radii.last().filter(|r| (**r / 2) as f64 >= smallest) {
            radii.push(last / 2);
        }
        let cells = Cells::new(&profile, fine, radius);
        let held = cells.sum(radius);
        let share = held.min(1.0);
        let square = |radius: &usize| {
            let (response, rim) = cells.response(*radius, share / cells.sum(*radius));
            let reach = reach(*radius, fine);
            let grid = Response::half(*radius, fine) as i64;
            let planes = Planes::new(fine, [reach; 2], |origin, [width, _], plane| {
                let place = |q: usize, origin: f64| ((q as f64 - origin) * fine as f64).round() as i64;
                for (k, value) in plane.iter_mut().enumerate() {
                    let (gx, gy) = (place(k % width, origin.x), place(k / width, origin.y));
                    let inside = gx.abs() <= grid && gy.abs() <= grid;
                    *value = if inside { response.at(gx, gy) } else { 0.0 };
                }
            });
            Square { radius: *radius, planes, rim }
        };
        let squares = radii.iter().rev().map(square).collect();
        Self { profile, fine, squares, lost: 1.0 - share }
    }

    /// The profile behind the table.
    pub fn profile(&self) -> &Profile {
        &self.profile
    }

    /// Share of a point's light that is not drawn.
    pub fn lost(&self) -> f64 {
        self.lost
    }

    /// The largest stamp.
    pub fn whole(&self, electrons: f64) -> Stamp {
        Stamp { square: self.squares.len() - 1, electrons }
    }

    /// The smallest stamp on whose rim a point of so many electrons gives less than `edge` \[e-/px\]; the light beyond is
    /// drawn within.
    pub fn stamp(&self, electrons: f64, edge: f64) -> Stamp {
        let last = self.squares.len() - 1;
        let square = self.squares[..last].iter().position(|s| electrons * s.rim < edge).unwrap_or(last);
        Stamp { square, electrons }
    }

    /// How far a stamp reaches from its point \[px\].
    pub fn reach(&self, stamp: Stamp) -> usize {
        reach(self.squares[stamp.square].radius, self.fine)
    }

    /// How far the largest stamp reaches from its point \[px\].
    pub fn radius(&self) -> usize {
        self.reach(self.whole(1.0))
    }

    /// Size of the tables \[bytes\].
    pub fn bytes(&self) -> usize {
        self.squares.iter().map(|s| s.planes.bytes()).sum()
    }

    /// Add `electrons` moving along `path` to the pixels of `region`.
    pub fn add(&self, path: &Path, electrons: f64, region: &Region, out: &mut [f64]) {
        self.add_stamp(path, self.whole(electrons), region, out);
    }

    /// Add a stamp moving along `path` to the pixels of `region`.
    pub fn add_stamp(&self, path: &Path, stamp: Stamp, region: &Region, out: &mut [f64]) {
        if path.length() < 1e-3 {
            return self.add_point(path.mid, stamp, region, out);
        }
        self.add_arc(path, [0.0, 1.0], stamp, region, out);
    }

    /// Add the light of the share `span` of a path: halved until an arc is no longer than the FWHM, so that its nodes do
    /// not depend on the region; arcs that cannot reach the region are passed over.
    fn add_arc(&self, path: &Path, span: [f64; 2], stamp: Stamp, region: &Region, out: &mut [f64]) {
        let [from, to] = span;
        let middle = 0.5 * (from + to);
        let arc = Path { start: path.at(from), mid: path.at(middle), end: path.at(to) };
        let (low, high) = arc.bounds();
        let reach = self.reach(stamp) as f64 + 1.0;
        let far = DVec2::new((region.x0 + region.width) as f64, (region.y0 + region.height) as f64) + reach;
        let near = DVec2::new(region.x0 as f64, region.y0 as f64) - reach;
        if !(low.cmple(far).all() && high.cmpge(near).all()) {
            return;
        }
        // 2^-40 of an exposure: even a path across the sky has arcs shorter than a pixel by then
        if arc.length() > self.profile.fwhm().max(0.25) && to - from > 1e-12 {
            self.add_arc(path, [from, middle], stamp, region, out);
            self.add_arc(path, [middle, to], stamp, region, out);
            return;
        }
        for (node, weight) in GAUSS_4 {
            let part = Stamp { electrons: stamp.electrons * weight * (to - from), ..stamp };
            self.add_point(path.at(from + node * (to - from)), part, region, out);
        }
    }

    /// Grid points per pixel that this profile needs.
    pub fn fine(&self) -> usize {
        self.fine
    }

    /// Add a stamp at a point to the pixels of `region`.
    pub fn add_point(&self, at: DVec2, stamp: Stamp, region: &Region, out: &mut [f64]) {
        let planes = &self.squares[stamp.square].planes;
        planes.add(at, planes.radius(), stamp.electrons, region, out);
    }

    /// The slow twin: the share of a moving point's light in a pixel, by direct quadrature of the profile with `n`
    /// points along each side of the pixel and `steps` along the path.
    pub fn reference(profile: &Profile, path: &Path, pixel: DVec2, n: usize, steps: usize) -> f64 {
        let middle = |i: usize, n: usize| (i as f64 + 0.5) / n as f64;
        let mut sum = 0.0;
        for step in 0..steps {
            let at = path.at(middle(step, steps));
            for j in 0..n {
                for i in 0..n {
                    sum += profile.density(pixel + DVec2::new(middle(i, n), middle(j, n)) - 0.5 - at);
                }
            }
        }
        sum / (steps * n * n) as f64
    }
}

/// Pixels from a point's to the farthest that its square reaches, the stencil of the interpolation included.
fn reach(radius: usize, fine: usize) -> usize {
    radius + if fine < 4 { 2 } else { 1 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::psf_image::PsfImage;
    use crate::camera::radial::Radial;
    use std::sync::Arc;

    fn profiles() -> Vec<Profile> {
        let airy = |width: f64| Radial::airy(&[[width, 0.5], [width * 1.2, 0.5]], 0.4, farthest(width));
        let seeing = Radial::kolmogorov(2.0, 0.5, 0.4, farthest(2.0));
        let square = PsfImage::new([9, 9], (0..81).map(|k| f64::from(k % 9 + 3)).collect(), 4.0);
        vec![
            Profile::gaussian(0.7),
            Profile::gaussian(2.0),
            Profile::gaussian(6.0),
            Profile::moffat(2.0, 3.0),
            Profile::moffat(3.3, 2.5),
            Profile::Radial(Arc::new(airy(2.0))),
            Profile::Radial(Arc::new(seeing)),
            Profile::Image(Arc::new(square.expect("an image"))),
        ]
    }

    const FRAME: Region = Region { x0: 0, y0: 0, width: 256, height: 256 };

    fn drawn(psf: &Psf, path: &Path) -> Vec<f64> {
        let mut out = vec![0.0; FRAME.len()];
        psf.add(path, 1.0, &FRAME, &mut out);
        out
    }

    #[test]
    fn points_agree_with_direct_quadrature_at_every_phase() {
        for profile in profiles() {
            let psf = Psf::new(profile.clone(), 1e-4);
            for (fx, fy) in [(0.0, 0.0), (0.5, 0.5), (0.13, -0.41), (-0.499, 0.251)] {
                let path = Path::still(DVec2::new(128.0 + fx, 127.0 + fy));
                let out = drawn(&psf, &path);
                for (x, y) in [(128, 127), (129, 127), (126, 130), (131, 121)] {
                    let exact = Psf::reference(&profile, &path, DVec2::new(x as f64, y as f64), 200, 1);
                    let error = (out[y * 256 + x] - exact).abs();
                    // the image has corners, which no grid of the point's own follows
                    let allowed = if profile.is_circular() { 1e-5 } else { 1e-3 };
                    assert!(error < allowed, "{profile:?} phase {fx} {fy} pixel {x} {y}: {error:e}");
                }
            }
        }
    }

    /// Sum and centroid of all pixels.
    fn moments(out: &[f64]) -> (f64, DVec2) {
        let sum = out.iter().sum::<f64>();
        let place = |k: usize| DVec2::new((k % 256) as f64, (k / 256) as f64);
        (sum, out.iter().enumerate().map(|(k, v)| place(k) * *v).sum::<DVec2>() / sum)
    }

    /// Photon conservation: what is drawn and what is said to be lost are all there is, 1e-6 of it, in stamps of every size, at
    /// places all round a pixel; and the centroid is the place, 1e-4 px (1e-3 px in small stamps), of images of 2 px or more (pixels themselves move that
    /// of narrower ones).
    #[test]
    fn light_is_conserved_and_centroids_are_kept() {
        for profile in profiles() {
            let psf = Psf::new(profile.clone(), 1e-4);
            let wide = matches!(profile, Profile::Radial(_));
            assert!(psf.lost() >= 0.0 && (wide || psf.lost() <= 1e-4), "{profile:?}: {}", psf.lost());
            for square in 0..psf.squares.len() {
                for k in 0..49 {
                    let at = DVec2::new(127.5 + f64::from(k % 7) / 6.0, 127.5 + f64::from(k / 7) / 6.0);
                    let mut out = vec![0.0; FRAME.len()];
                    psf.add_point(at, Stamp { square, electrons: 1.0 }, &FRAME, &mut out);
                    let (sum, centroid) = moments(&out);
                    assert!((1.0 - sum - psf.lost()).abs() < 1e-6, "{profile:?} at {at}: {}", 1.0 - sum);
                    let sampled = profile.fwhm() >= 1.9 && profile.is_circular();
                    let allowed = if square + 1 == psf.squares.len() { 1e-4 } else { 1e-3 };
                    assert!(!sampled || centroid.distance(at) < allowed, "{profile:?}: {centroid} for {at}");
                }
            }
        }
    }

    #[test]
    fn trails_agree_with_direct_quadrature_and_conserve_light() {
        for profile in profiles() {
            let psf = Psf::new(profile.clone(), 1e-4);
            let straight = Path {
                start: DVec2::new(90.3, 100.1),
                mid: DVec2::new(128.0, 120.0),
                end: DVec2::new(165.7, 139.9),
            };
            let curved = Path { mid: DVec2::new(126.0, 123.0), ..straight };
            for path in [straight, curved] {
                let out = drawn(&psf, &path);
                let (sum, centroid) = moments(&out);
                assert!((1.0 - sum - psf.lost()).abs() < 1e-6, "{profile:?}: {}", 1.0 - sum);
                // Simpson's rule is exact for a parabola
                let middle = (path.start + path.end + 4.0 * path.mid) / 6.0;
                let narrow = profile.fwhm() < 1.9 || !profile.is_circular();
                assert!(narrow || centroid.distance(middle) < 1e-4, "{profile:?}: {centroid} for {middle}");
                let peak = out.iter().fold(0.0f64, |a, b| a.max(*b));
                for (x, y) in [(128, 120), (91, 101), (140, 126), (165, 140), (88, 99)] {
                    let exact = Psf::reference(&profile, &path, DVec2::new(x as f64, y as f64), 24, 4000);
                    let error = (out[y * 256 + x] - exact).abs();
                    let allowed = if !profile.is_circular() {
                        2e-2
                    } else if narrow {
                        2e-3
                    } else {
                        2e-4
                    };
                    assert!(error < allowed * peak, "{profile:?} pixel {x} {y}: {error:e} of {peak:e}");
                }
            }
        }
    }

    /// A trail cut into parts holds the light of the whole, pixel by pixel.
    #[test]
    fn a_trail_in_parts_is_the_whole() {
        let psf = Psf::new(Profile::moffat(2.5, 3.0), 1e-4);
        let path =
            Path { start: DVec2::new(60.2, 130.0), mid: DVec2::new(121.0, 128.4), end: DVec2::new(189.8, 117.0) };
        let whole = drawn(&psf, &path);
        let mut parts = vec![0.0; FRAME.len()];
        for (from, to) in [(0.0, 0.25), (0.25, 0.5), (0.5, 1.0)] {
            psf.add(&path.part(from, to), to - from, &FRAME, &mut parts);
        }
        let peak = whole.iter().fold(0.0f64, |a, b| a.max(*b));
        assert!(whole.iter().zip(&parts).all(|(a, b)| (a - b).abs() < 1e-4 * peak));
        assert!((whole.iter().sum::<f64>() - parts.iter().sum::<f64>()).abs() < 1e-9);
    }

    /// Extremes: a point far narrower than a pixel, and an image wider than the frame.
    #[test]
    fn extreme_widths_keep_their_light() {
        for fwhm in [1e-3, 0.1, 0.3] {
            let psf = Psf::new(Profile::gaussian(fwhm), 1e-4);
            for at in [DVec2::splat(100.0), DVec2::new(100.31, 99.77), DVec2::new(100.5, 100.0)] {
                let (sum, _) = moments(&drawn(&psf, &Path::still(at)));
                assert!((1.0 - sum - psf.lost()).abs() < 1e-6, "{fwhm} at {at}: {sum}");
            }
        }
        for profile in [Profile::gaussian(500.0), Profile::moffat(500.0, 3.0)] {
            let psf = Psf::new(profile, 1e-4);
            let region = Region { x0: 0, y0: 0, width: 1601, height: 1601 };
            let mut out = vec![0.0; region.len()];
            psf.add_point(DVec2::splat(800.3), psf.whole(1.0), &region, &mut out);
            let sum = out.iter().sum::<f64>();
            assert!((1.0 - sum - psf.lost()).abs() < 1e-6 && psf.lost() < 0.25, "{sum} {}", psf.lost());
        }
    }

    #[test]
    fn any_region_gives_the_pixels_of_the_whole() {
        let psf = Psf::new(profiles().swap_remove(3), 1e-4);
        let path =
            Path { start: DVec2::new(100.2, 130.0), mid: DVec2::new(120.0, 128.4), end: DVec2::new(139.8, 127.0) };
        let whole = drawn(&psf, &path);
        let region = Region { x0: 110, y0: 120, width: 37, height: 11 };
        let mut part = vec![0.0; region.len()];
        psf.add(&path, 1.0, &region, &mut part);
        for (i, value) in part.iter().enumerate() {
            let (x, y) = (region.x0 + i % region.width, region.y0 + i / region.width);
            assert_eq!(*value, whole[y * 256 + x]);
        }
    }

    /// A faint star's small stamp differs from the whole image by less than the edge asked for, but for the light beyond
    /// that is drawn within.
    #[test]
    fn small_stamps_are_cut_where_they_are_faint() {
        for profile in profiles() {
            let psf = Psf::new(profile.clone(), 1e-4);
            for (electrons, edge) in [(100.0, 0.01), (1e4, 0.01), (1e4, 1e-12), (1.0, 10.0)] {
                let stamp = psf.stamp(electrons, edge);
                let path = Path::still(DVec2::new(127.7, 128.2));
                let mut out = vec![0.0; FRAME.len()];
                psf.add_stamp(&path, stamp, &FRAME, &mut out);
                let whole = drawn(&psf, &path);
                let worst = out.iter().zip(&whole).map(|(o, w)| o - w * electrons).fold(0.0f64, |a, d| a.max(-d));
                assert!(edge > 1.0 || worst < 3.0 * edge, "{profile:?} {electrons} {edge}: {worst}");
                assert!(edge > 1e-9 || stamp == psf.whole(electrons) || psf.squares[stamp.square].rim < 1e-16);
            }
        }
    }

    #[test]
    fn places_far_outside_and_unknown_add_nothing() {
        let psf = Psf::new(profiles().swap_remove(1), 1e-4);
        for at in [DVec2::splat(1e6), DVec2::splat(-1e6), DVec2::NAN, DVec2::splat(f64::INFINITY)] {
            assert!(drawn(&psf, &Path::still(at)).iter().all(|v| *v == 0.0));
        }
        assert_eq!(Region::around(DVec2::splat(-50.0), 3.0, [10, 10]), None);
        assert_eq!(
            Region::around(DVec2::splat(1.0), 3.0, [10, 10]),
            Some(Region { x0: 0, y0: 0, width: 5, height: 5 })
        );
    }
}
