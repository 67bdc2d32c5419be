//! Trails of many stars at once.
//!
//! The stars of a frame trail nearly alike. Each trail is halved so often that the arcs of all of them agree in shape within
//! `accuracy.trail_px`; then one tabulated image of an arc ([`super::planes`]) for each size of stamp, laid down at the middle
//! of each arc, serves all: 16 multiplications a pixel of the arc in place of as many for each of the stamps along it.
//! Points, and trails that do not agree, are drawn by their own stamps ([`super::psf::Psf::add_stamp`], the reference twin).

use super::path::Path;
use super::planes::Planes;
use super::point_source::PointSource;
use super::psf::{Psf, Stamp};
use super::region::Region;
use glam::DVec2;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Largest image of an arc \[values\]: 64 MiB.
const LARGEST: usize = 8 << 20;
/// An image is worth its making for this many arcs per phase of its grid.
const WORTH: f64 = 1.5;
/// Rows in whose stars a region looks for its own.
const BUCKET: usize = 64;
/// Rows beyond which all stars are in one bucket.
const MOST_BUCKETS: usize = 1024;
/// Most times that a trail is halved.
const MOST_HALVINGS: u32 = 10;

/// The stars of a frame, ready to be drawn.
#[derive(Debug, Clone, Default)]
pub struct Trails {
    /// Arcs of each trail.
    arcs: usize,
    /// Images of one electron along an arc.
    images: Vec<Planes>,
    /// Number of the image of each star, in the order of the stars.
    of_star: Vec<Option<usize>>,
    /// Numbers of the stars that may reach into each [`BUCKET`] of rows, in order; the last bucket reaches on.
    buckets: Vec<Vec<u32>>,
}

impl Trails {
    /// The images for `stars`, cut where they fall below `edge` \[e-/px\]; arcs agree within `tolerance` px.
    pub fn new(psf: &Psf, stars: &[PointSource], edge: f64, tolerance: f64) -> Self {
        let mut classes: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for (number, star) in stars.iter().enumerate().filter(|(_, star)| trails(psf, star)) {
            classes.entry(psf.stamp(star.electrons, edge).square).or_default().push(number);
        }
        let trailing = || classes.values().flatten().map(|number| &stars[*number].path);
        let mut all =
            Self { arcs: 0, images: Vec::new(), of_star: vec![None; stars.len()], buckets: buckets(psf, stars) };
        let agreed = (0..=MOST_HALVINGS).find_map(|halvings| {
            let arcs = 1usize << halvings;
            let shape = mean_shape(trailing(), arcs)?;
            let agrees = |path: &Path| {
                each_arc(path, arcs).all(|arc| {
                    let apart = |a: DVec2, b: DVec2| a.distance(b) <= tolerance;
                    apart(arc.start - arc.mid, shape.start) && apart(arc.end - arc.mid, shape.end)
                })
            };
            trailing().all(agrees).then_some((arcs, shape))
        });
        let Some((arcs, shape)) = agreed else { return all };
        all.arcs = arcs;
        let worth = WORTH * (psf.fine() * psf.fine()) as f64;
        for (square, members) in classes.into_iter().filter(|(_, members)| (members.len() * arcs) as f64 > worth) {
            if let Some(image) = image(psf, &shape, square) {
                members.iter().for_each(|number| all.of_star[*number] = Some(all.images.len()));
                all.images.push(image);
            }
        }
        all
    }

    /// Size of the images \[bytes\].
    pub fn bytes(&self) -> usize {
        self.images.iter().map(Planes::bytes).sum()
    }

    /// Numbers of the stars that may reach into `region`, in their order.
    pub fn touching(&self, region: &Region) -> Vec<usize> {
        let last = MOST_BUCKETS - 1;
        let of = |row: usize| (row / BUCKET).min(last);
        let end = of(region.y0 + region.height.saturating_sub(1)) + 1;
        let buckets = self.buckets.get(of(region.y0)..end.min(self.buckets.len())).unwrap_or_default();
        let mut numbers = buckets.iter().flatten().map(|number| *number as usize).collect::<Vec<_>>();
        if buckets.len() > 1 {
            numbers.sort_unstable();
            numbers.dedup();
        }
        numbers
    }

    /// Add star number `number` of the frame to the pixels of `region`.
    pub fn add(&self, psf: &Psf, number: usize, star: &PointSource, edge: f64, region: &Region, out: &mut [f64]) {
        let Some(image) = self.of_star.get(number).copied().flatten() else {
            return psf.add_stamp(&star.path, psf.stamp(star.electrons, edge), region, out);
        };
        let (low, high) = star.path.bounds();
        let [x, y] = self.images[image].radius();
        let reach = DVec2::new(x as f64, y as f64) + 1.0;
        let first = DVec2::new(region.x0 as f64, region.y0 as f64) - reach;
        let last = DVec2::new((region.x0 + region.width) as f64, (region.y0 + region.height) as f64) + reach;
        if low.cmpgt(last).any() || high.cmplt(first).any() {
            return;
        }
        let electrons = star.electrons / self.arcs as f64;
        for k in 0..self.arcs {
            let middle = star.path.at((k as f64 + 0.5) / self.arcs as f64);
            self.images[image].add(middle, [x, y], electrons, region, out);
        }
    }
}

/// The stars that may reach into each bucket of rows.
fn buckets(psf: &Psf, stars: &[PointSource]) -> Vec<Vec<u32>> {
    let margin = psf.radius() as f64 + 2.0;
    let mut buckets: Vec<Vec<u32>> = Vec::new();
    for (number, star) in stars.iter().enumerate() {
        let (low, high) = star.path.bounds();
        let (low, high) = (low.y - margin, high.y + margin);
        if low.is_nan() || high.is_nan() || high < 0.0 {
            continue;
        }
        let of = |y: f64| ((y.max(0.0) / BUCKET as f64) as usize).min(MOST_BUCKETS - 1);
        let (first, last) = (of(low), of(high));
        if buckets.len() <= last {
            buckets.resize(last + 1, Vec::new());
        }
        buckets[first..=last].iter_mut().for_each(|bucket| bucket.push(number as u32));
    }
    buckets
}

/// True for a star that moves by more than its width, at a place that is a number.
fn trails(psf: &Psf, star: &PointSource) -> bool {
    let length = star.path.length();
    length >= psf.profile().fwhm() && length < 1e5 && star.path.mid.is_finite()
}

/// The arcs of a path cut into `arcs` of equal time.
fn each_arc(path: &Path, arcs: usize) -> impl Iterator<Item = Path> {
    let (path, step) = (*path, 0.5 / arcs as f64);
    (0..arcs).map(move |k| {
        let middle = (2 * k + 1) as f64 * step;
        Path { start: path.at(middle - step), mid: path.at(middle), end: path.at(middle + step) }
    })
}

/// The mean of all arcs of some trails, about its own middle; none without trails.
fn mean_shape<'p>(paths: impl Iterator<Item = &'p Path>, arcs: usize) -> Option<Path> {
    let (mut start, mut end, mut number) = (DVec2::ZERO, DVec2::ZERO, 0.0);
    for arc in paths.flat_map(|path| each_arc(path, arcs)) {
        start += arc.start - arc.mid;
        end += arc.end - arc.mid;
        number += 1.0;
    }
    (number > 0.0).then(|| Path { start: start / number, mid: DVec2::ZERO, end: end / number })
}

/// The image of one electron along an arc of `shape`, in stamps of a square; none if it would be too large, or no cheaper
/// than the stamps.
fn image(psf: &Psf, shape: &Path, square: usize) -> Option<Planes> {
    let (low, high) = shape.bounds();
    let one = Stamp { square, electrons: 1.0 };
    let stamp = psf.reach(one);
    let reach = low.abs().max(high.abs()).ceil() + stamp as f64 + 1.0;
    let radius = [reach.x as usize, reach.y as usize];
    let area = radius.iter().map(|r| 2.0 * *r as f64 + 1.0).product::<f64>();
    let stamps = 4.0 * (shape.length() / psf.profile().fwhm().max(0.25)).max(1.0);
    let of_stamps = stamps * (2.0 * stamp as f64 + 1.0).powi(2);
    if reach.max_element() > 1e5 || Planes::size(psf.fine(), radius) > LARGEST || area > of_stamps {
        return None;
    }
    let mut places = Vec::new();
    let mut planes = Planes::new(psf.fine(), radius, |origin, side, _| places.push((origin, side)));
    let draw = |(at, [width, height]): &(DVec2, [usize; 2])| {
        let region = Region { x0: 0, y0: 0, width: *width, height: *height };
        let mut drawn = vec![0.0; region.len()];
        let arc = Path { start: shape.start + *at, mid: *at, end: shape.end + *at };
        psf.add_stamp(&arc, one, &region, &mut drawn);
        drawn
    };
    let mut drawn = places.par_iter().map(draw).collect::<Vec<_>>().into_iter();
    planes.fill(|plane| {
        if let Some(own) = drawn.next() {
            plane.copy_from_slice(&own);
        }
    });
    Some(planes)
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

    fn field(psf: &Psf, tolerance: f64) -> (Vec<PointSource>, Trails) {
        let half = DVec2::new(29.3, 4.1);
        let place = |k: u64| DVec2::new((k * 37 % 300) as f64 + 0.013 * k as f64, (k * 53 % 200) as f64 + 0.37);
        // trails that differ by some hundredths of a pixel, as over a field
        let half = |k: u64| half + DVec2::new(0.0001 * k as f64, 0.0);
        let stars = (0..300).map(|k| star(k, place(k), half(k), 200.0 + k as f64)).collect::<Vec<_>>();
        let trails = Trails::new(psf, &stars, 0.01, tolerance);
        (stars, trails)
    }

    /// Each star by the shared images against its own stamps: arcs that differ by 0.01 px leave gaps of that over the width
    /// of the point image, 1e-3 of its brightest pixel; and all its light is there.
    #[test]
    fn shared_trails_are_the_stars_own() {
        // the second tolerance leaves only what the stamps themselves err by
        for (fwhm, tolerance, allowed) in [(2.0, 0.01, 1e-3), (3.3, 0.01, 1e-3), (2.0, 0.001, 2e-4)] {
            let psf = Psf::new(Profile::moffat(fwhm, 3.0), 1e-4);
            let (stars, trails) = field(&psf, tolerance);
            assert!(!trails.images.is_empty() && trails.of_star.iter().filter(|k| k.is_some()).count() > 200);
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
                psf.add_stamp(&moved.path, psf.stamp(moved.electrons, 0.01), &region, &mut exact);
                let peak = exact.iter().fold(0.0f64, |a, b| a.max(*b));
                let worst = shared.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(worst < allowed * peak, "FWHM {fwhm} star {number}: {worst} of {peak}");
                let [a, b] = [&shared, &exact].map(|image| image.iter().sum::<f64>());
                assert!((a / b - 1.0).abs() < 1e-4, "{a} {b}");
            }
        }
    }

    /// A part of the frame has the pixels of the whole.
    #[test]
    fn any_region_gives_the_pixels_of_the_whole() {
        let psf = Psf::new(Profile::Gaussian { sigma: 1.1 }, 1e-4);
        let (stars, trails) = field(&psf, 0.01);
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
            assert!(trails.images.is_empty() && trails.bytes() == 0, "{half}");
        }
    }
}
