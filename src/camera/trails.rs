//! Trails of many stars at once.
//!
//! The stars of a frame trail nearly alike. Those whose trails agree in shape within `accuracy.trail_px` and whose stamps are
//! of about one size share one tabulated image of the whole trail ([`super::planes`]), which is laid down at each star's
//! place: 16 multiplications a pixel of the trail in place of as many for each of the hundreds of stamps along it. Others,
//! and trails too long for a table, are drawn by their own stamps ([`super::psf::Psf::add_stamp`], the reference twin).

use super::path::Path;
use super::planes::Planes;
use super::point_source::PointSource;
use super::psf::Psf;
use super::region::Region;
use glam::DVec2;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Half-sides of stamps that share a table: up to this, twice, four times ... \[px\].
const SMALLEST: usize = 6;
/// Largest table of a trail \[values\]: 64 MiB.
const LARGEST: usize = 8 << 20;
/// A table is worth its making for this many stars per phase of the grid.
const WORTH: f64 = 1.5;

/// The stars of a frame, ready to be drawn.
#[derive(Debug, Clone, Default)]
pub struct Trails {
    kernels: Vec<Kernel>,
    /// Number of the kernel of each star, in the order of the stars.
    of_star: Vec<Option<usize>>,
}

/// The image of a trail that several stars share.
#[derive(Debug, Clone)]
struct Kernel {
    planes: Planes,
}

/// What stars of one kernel have in common: shape by steps of the tolerance, size of stamp.
type Key = ([i64; 4], usize);

impl Trails {
    /// The kernels for `stars`, cut where they fall below `edge` \[e-/px\], their shapes agreeing within `tolerance` px.
    pub fn new(psf: &Psf, stars: &[PointSource], edge: f64, tolerance: f64) -> Self {
        let mut groups: BTreeMap<Key, Vec<usize>> = BTreeMap::new();
        for (number, star) in stars.iter().enumerate() {
            if let Some(key) = key(psf, star, edge, tolerance) {
                groups.entry(key).or_default().push(number);
            }
        }
        let worth = WORTH * (psf.fine() * psf.fine()) as f64;
        let mut trails = Self { kernels: Vec::new(), of_star: vec![None; stars.len()] };
        for ((_, radius), members) in groups.into_iter().filter(|(_, members)| members.len() as f64 > worth) {
            if let Some(kernel) = Kernel::new(psf, &mean_shape(stars, &members), radius) {
                members.iter().for_each(|number| trails.of_star[*number] = Some(trails.kernels.len()));
                trails.kernels.push(kernel);
            }
        }
        trails
    }

    /// Size of the tables \[bytes\].
    pub fn bytes(&self) -> usize {
        self.kernels.iter().map(|k| k.planes.bytes()).sum()
    }

    /// Add star number `number` of the frame to the pixels of `region`.
    pub fn add(&self, psf: &Psf, number: usize, star: &PointSource, edge: f64, region: &Region, out: &mut [f64]) {
        match self.of_star.get(number).copied().flatten() {
            Some(kernel) => {
                let planes = &self.kernels[kernel].planes;
                planes.add(star.path.mid, planes.radius(), star.electrons, region, out);
            }
            None => psf.add_stamp(&star.path, psf.stamp(star.electrons, edge), region, out),
        }
    }
}

/// Half-side of the stamps of a star's class.
fn class(psf: &Psf, star: &PointSource, edge: f64) -> usize {
    let own = psf.stamp(star.electrons, edge).radius;
    let mut radius = SMALLEST;
    while radius < own {
        radius *= 2;
    }
    radius.min(psf.radius())
}

/// The group of a star; none for a point or a place that is no number.
fn key(psf: &Psf, star: &PointSource, edge: f64, tolerance: f64) -> Option<Key> {
    let path = &star.path;
    if path.length() < psf.profile().fwhm() || !path.mid.is_finite() {
        return None;
    }
    let (start, end) = (path.start - path.mid, path.end - path.mid);
    // shifted, for round figures not to lie between two steps
    let step = |x: f64| (x / tolerance + 0.37).floor();
    let steps = [start.x, start.y, end.x, end.y].map(step);
    steps.iter().all(|s| s.abs() < 1e12).then(|| (steps.map(|s| s as i64), class(psf, star, edge)))
}

/// The mean trail of some stars, about its own middle.
fn mean_shape(stars: &[PointSource], members: &[usize]) -> Path {
    let sum = |f: &dyn Fn(&Path) -> DVec2| {
        members.iter().map(|k| f(&stars[*k].path)).fold(DVec2::ZERO, |a, b| a + b) / members.len() as f64
    };
    Path { start: sum(&|p| p.start - p.mid), mid: DVec2::ZERO, end: sum(&|p| p.end - p.mid) }
}

impl Kernel {
    /// The image of one electron along `shape`, in stamps of half-side `stamp`; none if it would be too large, or no cheaper
    /// than the stamps.
    fn new(psf: &Psf, shape: &Path, stamp: usize) -> Option<Self> {
        let (low, high) = shape.bounds();
        let reach = low.abs().max(high.abs()).ceil() + stamp as f64 + 1.0;
        let radius = [reach.x as usize, reach.y as usize];
        let area = radius.iter().map(|r| 2.0 * *r as f64 + 1.0).product::<f64>();
        let stamps = 4.0 * (shape.length() / psf.profile().fwhm().max(0.25)).max(1.0);
        let of_stamps = stamps * (2.0 * stamp as f64 + 1.0).powi(2);
        if reach.max_element() > 1e5 || Planes::size(psf.fine(), radius) > LARGEST || area > of_stamps {
            return None;
        }
        let moved = |at: DVec2| Path { start: shape.start + at, mid: at, end: shape.end + at };
        let one = psf.stamp_of(1.0, stamp);
        let mut places = Vec::new();
        let mut planes = Planes::new(psf.fine(), radius, |origin, side, _| places.push((origin, side)));
        let draw = |(origin, [width, height]): &(DVec2, [usize; 2])| {
            let region = Region { x0: 0, y0: 0, width: *width, height: *height };
            let mut image = vec![0.0; region.len()];
            psf.add_stamp(&moved(*origin), one, &region, &mut image);
            image
        };
        let mut images = places.par_iter().map(draw).collect::<Vec<_>>().into_iter();
        planes.fill(|plane| {
            if let Some(image) = images.next() {
                plane.copy_from_slice(&image);
            }
        });
        Some(Self { planes })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::profile::Profile;
    use glam::DVec3;

    fn star(number: u64, mid: DVec2, half: DVec2, electrons: f64) -> PointSource {
        let path = Path { start: mid - half, mid, end: mid + half + DVec2::new(0.0, 0.2) };
        PointSource { id: number, icrs: DVec3::X, mag_v: 15.0, path, electrons, coloured: false }
    }

    fn field(psf: &Psf) -> (Vec<PointSource>, Trails) {
        let half = DVec2::new(29.3, 4.1);
        let place = |k: u64| DVec2::new((k * 37 % 300) as f64 + 0.013 * k as f64, (k * 53 % 200) as f64 + 0.37);
        let stars = (0..300).map(|k| star(k, place(k), half, 200.0 + k as f64)).collect::<Vec<_>>();
        let trails = Trails::new(psf, &stars, 0.01, 0.01);
        (stars, trails)
    }

    /// Each star by the shared table against its own stamps: 1e-4 of its brightest pixel, and all its light.
    #[test]
    fn shared_trails_are_the_stars_own() {
        for fwhm in [2.0, 3.3] {
            let alpha = 0.5 * fwhm / (2f64.powf(1.0 / 3.0) - 1.0).sqrt();
            let psf = Psf::new(Profile::Moffat { alpha, beta: 3.0 }, 1e-4);
            let (stars, trails) = field(&psf);
            assert!(!trails.kernels.is_empty() && trails.of_star.iter().filter(|k| k.is_some()).count() > 200);
            let region = Region { x0: 0, y0: 0, width: 420, height: 320 };
            for (number, own) in stars.iter().enumerate().step_by(29) {
                let moved = PointSource {
                    path: Path {
                        start: own.path.start + 60.0,
                        mid: own.path.mid + 60.0,
                        end: own.path.end + 60.0,
                    },
                    ..*own
                };
                let (mut shared, mut exact) = (vec![0.0; region.len()], vec![0.0; region.len()]);
                trails.add(&psf, number, &moved, 0.01, &region, &mut shared);
                psf.add_stamp(
                    &moved.path,
                    psf.stamp_of(moved.electrons, class(&psf, own, 0.01)),
                    &region,
                    &mut exact,
                );
                let peak = exact.iter().fold(0.0f64, |a, b| a.max(*b));
                let worst = shared.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(worst < 2e-4 * peak, "FWHM {fwhm} star {number}: {worst} of {peak}");
                let [a, b] = [&shared, &exact].map(|image| image.iter().sum::<f64>());
                assert!((a / b - 1.0).abs() < 1e-4, "{a} {b}");
            }
        }
    }

    /// A part of the frame has the pixels of the whole.
    #[test]
    fn any_region_gives_the_pixels_of_the_whole() {
        let psf = Psf::new(Profile::Gaussian { sigma: 1.1 }, 1e-4);
        let (stars, trails) = field(&psf);
        let whole = Region { x0: 0, y0: 0, width: 300, height: 200 };
        let part = Region { x0: 91, y0: 64, width: 50, height: 7 };
        let draw = |region: &Region| {
            let mut out = vec![0.0; region.len()];
            stars.iter().enumerate().for_each(|(k, s)| trails.add(&psf, k, s, 0.01, region, &mut out));
            out
        };
        let (all, some) = (draw(&whole), draw(&part));
        for (k, value) in some.iter().enumerate() {
            assert_eq!(*value, all[(part.y0 + k / part.width) * whole.width + part.x0 + k % part.width]);
        }
    }

    #[test]
    fn points_long_trails_and_lost_stars_are_drawn_by_themselves() {
        let psf = Psf::new(Profile::Gaussian { sigma: 1.1 }, 1e-4);
        for half in [DVec2::ZERO, DVec2::splat(3e4), DVec2::splat(f64::NAN), DVec2::splat(1e300)] {
            let stars = (0..300).map(|k| star(k, DVec2::splat(50.0), half, 100.0)).collect::<Vec<_>>();
            let trails = Trails::new(&psf, &stars, 0.01, 0.01);
            assert!(trails.kernels.is_empty() && trails.bytes() == 0, "{half}");
        }
    }
}
