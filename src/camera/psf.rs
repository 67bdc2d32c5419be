//! The image of a point: a circular profile integrated over pixels, and its trail along a path.
//!
//! The response of a pixel at offset d, the profile integrated over the unit square about d, is tabulated on a
//! grid finer than a pixel ([`super::planes`]). A trail is the sum of stamps along the path with Gauss-Legendre weights. [`Psf::reference`] is the slow twin: direct quadrature of the profile.
//!
//! Valid for FWHM from 0.7 px; the share of light outside the stamp is told by [`Psf::lost`].

use super::path::Path;
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

/// Largest table of a point's image \[values\]: 64 MiB. Fainter wings are cut, and [`Psf::lost`] tells how much.
const LARGEST_TABLE: usize = 8 << 20;

/// Offset of the two Gauss points from the middle of a unit interval.
const GAUSS_2: f64 = 0.288_675_134_594_812_9;

/// A tabulated point image.
#[derive(Debug, Clone)]
pub struct Psf {
    profile: Profile,
    radius: usize,
    /// Grid points per pixel.
    fine: usize,
    planes: Planes,
    /// Share of a centred point's light within each half-side of a stamp \[px\].
    held: Vec<f64>,
}

/// A point's light, drawn in a stamp of its own size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stamp {
    /// Half the side \[px\].
    pub radius: usize,
    /// Electrons that the endless image must have for the stamp to hold all of the point's.
    pub electrons: f64,
}

impl Psf {
    /// The image of `profile` with at most the share `outside` of its light outside the stamp.
    pub fn new(profile: Profile, outside: f64) -> Self {
        let fwhm = profile.fwhm();
        let fine = ((16.0 / fwhm).ceil() as usize).next_power_of_two().clamp(2, 64);
        let widest = ((LARGEST_TABLE as f64).sqrt() / (fine as f64) - 5.0) / 2.0;
        let radius = profile.radius(outside).ceil().min(widest).max(2.0) as usize;
        let half = (radius + 2) * fine;
        let response = response_quadrant(&profile, fine, half);
        let planes = Planes::new(fine, [radius; 2], |origin, [width, _], plane| {
            let grid = |q: usize, origin: f64| ((q as f64 - origin) * fine as f64).round().abs() as usize;
            for (k, value) in plane.iter_mut().enumerate() {
                let (gx, gy) = (grid(k % width, origin.x), grid(k / width, origin.y));
                *value = if gy <= half && gx <= half { response[gy * (half + 1) + gx] } else { 0.0 };
            }
        });
        let mut psf = Self { profile, radius, fine, planes, held: vec![0.0; radius + 1] };
        let region = Region { x0: 0, y0: 0, width: 2 * radius + 1, height: 2 * radius + 1 };
        let mut image = vec![0.0; region.len()];
        psf.add_point(DVec2::splat(radius as f64), psf.whole(1.0), &region, &mut image);
        for (k, value) in image.iter().enumerate() {
            let ring = (k % region.width).abs_diff(radius).max((k / region.width).abs_diff(radius));
            psf.held[ring] += value;
        }
        for r in 1..=radius {
            psf.held[r] += psf.held[r - 1];
        }
        psf
    }

    /// The profile behind the table.
    pub fn profile(&self) -> &Profile {
        &self.profile
    }

    /// Share of a centred point's light outside its stamp.
    pub fn lost(&self) -> f64 {
        (1.0 - self.held[self.radius]).max(0.0)
    }

    /// The largest stamp, its light as it is.
    pub fn whole(&self, electrons: f64) -> Stamp {
        Stamp { radius: self.radius, electrons }
    }

    /// A stamp of half-side `radius` that holds all of a point's light.
    pub fn stamp_of(&self, electrons: f64, radius: usize) -> Stamp {
        let radius = radius.min(self.radius);
        let held = if radius < self.radius { self.held[radius] } else { 1.0 };
        Stamp { radius, electrons: electrons / held }
    }

    /// The smallest stamp outside which a point of so many electrons gives less than `edge` \[e-/px\]; the light beyond is
    /// drawn within, so that none is lost.
    pub fn stamp(&self, electrons: f64, edge: f64) -> Stamp {
        let faint = |r: usize| electrons * self.profile.density((r * r) as f64) < edge;
        // the profile falls outwards
        self.stamp_of(electrons, (2..self.radius).find(|r| faint(*r)).unwrap_or(self.radius))
    }

    /// Half the side of a stamp \[px\].
    pub fn radius(&self) -> usize {
        self.radius
    }

    /// Size of the table \[bytes\].
    pub fn bytes(&self) -> usize {
        self.planes.bytes()
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
        let reach = stamp.radius as f64 + 1.0;
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
        self.planes.add(at, [stamp.radius; 2], stamp.electrons, region, out);
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
                    let d = pixel + DVec2::new(middle(i, n), middle(j, n)) - 0.5 - at;
                    sum += profile.density(d.length_squared());
                }
            }
        }
        sum / (steps * n * n) as f64
    }
}

/// The response of a pixel at offsets (j, i) / fine, for 0 <= i, j <= half, by rows.
fn response_quadrant(profile: &Profile, fine: usize, half: usize) -> Vec<f64> {
    let step = 1.0 / fine as f64;
    // integrals over cells of the fine grid; cell k covers k .. k+1 steps; negative ones by symmetry
    let cells = half + fine;
    let mut cell = vec![0.0; cells * cells];
    for j in 0..cells {
        for i in 0..=j {
            let mut sum = 0.0;
            for y in [-GAUSS_2, GAUSS_2] {
                for x in [-GAUSS_2, GAUSS_2] {
                    let (dy, dx) = ((j as f64 + 0.5 + y) * step, (i as f64 + 0.5 + x) * step);
                    sum += profile.density(dx * dx + dy * dy);
                }
            }
            cell[j * cells + i] = 0.25 * sum * step * step;
            cell[i * cells + j] = cell[j * cells + i];
        }
    }
    // a pixel spans fine / 2 steps to both sides: sums of `fine` cells, along x, then along y
    let span = (fine / 2) as i64;
    let window = |row: &dyn Fn(usize) -> f64, g: usize| {
        (g as i64 - span..g as i64 + span)
            .map(|k| row(if k < 0 { (-1 - k) as usize } else { k as usize }))
            .sum::<f64>()
    };
    let mut along_x = vec![0.0; cells * (half + 1)];
    for j in 0..cells {
        for g in 0..=half {
            along_x[j * (half + 1) + g] = window(&|k| cell[j * cells + k], g);
        }
    }
    let mut response = vec![0.0; (half + 1) * (half + 1)];
    for g in 0..=half {
        for i in 0..=half {
            response[g * (half + 1) + i] = window(&|k| along_x[k * (half + 1) + i], g);
        }
    }
    response
}

#[cfg(test)]
mod tests {
    use super::*;

    fn profiles() -> [Profile; 5] {
        let gaussian = |fwhm: f64| Profile::Gaussian { sigma: fwhm / 2.354_820_045 };
        let moffat = |fwhm: f64, beta: f64| Profile::Moffat {
            alpha: 0.5 * fwhm / (2f64.powf(1.0 / beta) - 1.0).sqrt(),
            beta,
        };
        [gaussian(0.7), gaussian(2.0), gaussian(6.0), moffat(2.0, 3.0), moffat(3.3, 2.5)]
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
            let psf = Psf::new(profile, 1e-4);
            for (fx, fy) in [(0.0, 0.0), (0.5, 0.5), (0.13, -0.41), (-0.499, 0.251)] {
                let path = Path::still(DVec2::new(128.0 + fx, 127.0 + fy));
                let out = drawn(&psf, &path);
                for (x, y) in [(128, 127), (129, 127), (126, 130), (131, 121)] {
                    let exact = Psf::reference(&profile, &path, DVec2::new(x as f64, y as f64), 200, 1);
                    let error = (out[y * 256 + x] - exact).abs();
                    assert!(error < 1e-5, "{profile:?} phase {fx} {fy} pixel {x} {y}: {error:e}");
                }
            }
        }
    }

    #[test]
    fn light_is_conserved_and_centroids_are_kept() {
        for profile in profiles() {
            let psf = Psf::new(profile, 1e-4);
            assert!(psf.lost() <= 1e-4, "{profile:?}: {}", psf.lost());
            for at in [DVec2::new(128.0, 128.0), DVec2::new(127.63, 128.29), DVec2::new(128.5, 127.5)] {
                let out = drawn(&psf, &Path::still(at));
                let sum = out.iter().sum::<f64>();
                // the square stamp moves by whole pixels: half a pixel of its edge is lost or won
                assert!((1.0 - sum - psf.lost()).abs() < 3e-5, "{profile:?} at {at}: {}", 1.0 - sum);
                let moment = |f: fn(usize) -> usize| {
                    out.iter().enumerate().map(|(i, v)| v * f(i) as f64).sum::<f64>() / sum
                };
                let centroid = DVec2::new(moment(|i| i % 256), moment(|i| i / 256));
                // narrower than two pixels the pixel grid itself moves the centroid
                assert!(profile.fwhm() < 1.9 || centroid.distance(at) < 2e-3, "{profile:?}: {centroid} for {at}");
            }
        }
    }

    #[test]
    fn trails_agree_with_direct_quadrature_and_conserve_light() {
        for profile in profiles() {
            let psf = Psf::new(profile, 1e-4);
            let straight = Path {
                start: DVec2::new(90.3, 100.1),
                mid: DVec2::new(128.0, 120.0),
                end: DVec2::new(165.7, 139.9),
            };
            let curved = Path { mid: DVec2::new(126.0, 123.0), ..straight };
            for path in [straight, curved] {
                let out = drawn(&psf, &path);
                let sum = out.iter().sum::<f64>();
                assert!((1.0 - sum - psf.lost()).abs() < 5e-5, "{profile:?}: {}", 1.0 - sum);
                let peak = out.iter().fold(0.0f64, |a, b| a.max(*b));
                for (x, y) in [(128, 120), (91, 101), (140, 126), (165, 140), (88, 99)] {
                    let exact = Psf::reference(&profile, &path, DVec2::new(x as f64, y as f64), 24, 4000);
                    let error = (out[y * 256 + x] - exact).abs();
                    let allowed = if profile.fwhm() < 1.9 { 5e-4 } else { 2e-4 };
                    assert!(error < allowed * peak, "{profile:?} pixel {x} {y}: {error:e} of {peak:e}");
                }
            }
        }
    }

    #[test]
    fn any_region_gives_the_pixels_of_the_whole() {
        let psf = Psf::new(profiles()[3], 1e-4);
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

    /// A faint star's small stamp holds all its light and differs from the whole image by less than the edge asked for, but
    /// for the light beyond that is drawn within.
    #[test]
    fn small_stamps_hold_all_the_light() {
        for profile in profiles() {
            let psf = Psf::new(profile, 1e-4);
            for (electrons, edge) in [(100.0, 0.01), (1e4, 0.01), (1e4, 1e-9), (1.0, 10.0)] {
                let stamp = psf.stamp(electrons, edge);
                let path = Path::still(DVec2::new(127.7, 128.2));
                let mut out = vec![0.0; FRAME.len()];
                psf.add_stamp(&path, stamp, &FRAME, &mut out);
                let (sum, whole) = (out.iter().sum::<f64>(), drawn(&psf, &path));
                assert!((sum / electrons - 1.0).abs() < 0.02, "{profile:?} {electrons}: {sum}");
                let worst = out.iter().zip(&whole).map(|(o, w)| o - w * electrons).fold(0.0f64, |a, d| a.max(-d));
                assert!(edge > 1.0 || worst < 3.0 * edge, "{profile:?} {electrons} {edge}: {worst}");
                assert!(stamp.radius <= psf.radius() && (edge > 1e-6 || stamp == psf.whole(electrons)));
            }
        }
    }

    #[test]
    fn places_far_outside_and_unknown_add_nothing() {
        let psf = Psf::new(profiles()[1], 1e-4);
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
