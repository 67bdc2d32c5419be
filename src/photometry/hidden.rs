//! Stars that no catalogue lists, across a target or close beside it: trails, and points on the trail of a target.
//!
//! Where the telescope follows the target all stars draw the same trail, so what a star too faint for the catalogue leaves in a
//! stamp is an excess along the stars' direction at one distance across it. The residuals of a fit, those near
//! the target left out, are averaged along that direction and filtered with the image's width across it.

use super::segment::Segment;
use super::stamp::Stamp;
use glam::DVec2;

/// Significance of a trail: one chance in 2000 among the distances across that are tried.
const SIGMA: f64 = 4.0;
/// Nearer to the target than this what its own image may leave counts \[FWHM\].
const NEAR: f64 = 3.0;
/// Trails farther from the target than this leave it alone \[FWHM\].
const REACH: f64 = 2.5;

/// The trail through a stamp beside the light that is known of, as long as the stamp; none if nothing is significant. `half` is
/// half the trail that stars draw \[px\]; `known` gives the light expected in a pixel and its variance \[e, e^2\].
pub fn trail(
    stamp: &Stamp,
    target: &Segment,
    half: DVec2,
    fwhm: f64,
    known: impl Fn(DVec2) -> (f64, f64),
) -> Option<Segment> {
    let length = half.length();
    if length.is_nan() || length < NEAR * fwhm || fwhm.is_nan() || fwhm <= 0.0 {
        return None;
    }
    let along = half / length;
    let normal = along.perp();
    let reach = (REACH * fwhm + target.half.dot(normal).abs()).min(1000.0).ceil() as i64;
    let wing = (1.3 * fwhm).min(200.0).ceil() as i64;
    let bins = (2 * (reach + wing) + 1) as usize;
    // sums of residual / variance and of 1 / variance at each distance across
    let mut sums = vec![[0.0; 2]; bins];
    let mut extent = 0.0f64;
    for pixel in stamp.pixels.iter().filter(|p| p.distance > NEAR * fwhm) {
        let offset = pixel.place - target.centre;
        let bin = offset.dot(normal).round() + (reach + wing) as f64;
        if offset.dot(along).abs() > 2.0 * length || !(0.0..bins as f64).contains(&bin) {
            continue;
        }
        let (light, variance) = known(pixel.place);
        if variance > 0.0 && pixel.value_e.is_finite() {
            let sum = &mut sums[bin as usize];
            sum[0] += (pixel.value_e - light) / variance;
            sum[1] += 1.0 / variance;
            extent = extent.max(offset.length());
        }
    }
    let sigma = fwhm / 2.354_82;
    let kernel = (-wing..=wing).map(|i| (-0.5 * (i as f64 / sigma).powi(2)).exp()).collect::<Vec<_>>();
    let significance = |at: usize| {
        let terms = kernel.iter().zip(&sums[at..]);
        let (signal, weight) = terms.fold((0.0, 0.0), |(s, w), (k, [r, v])| (s + k * r, w + k * k * v));
        if weight > 0.0 { signal / weight.sqrt() } else { 0.0 }
    };
    let all = (0..=2 * reach as usize).map(significance).collect::<Vec<_>>();
    let (best, height) = all.iter().enumerate().fold((0, 0.0), |a, (i, s)| if *s > a.1 { (i, *s) } else { a });
    if height < SIGMA {
        return None;
    }
    let beside = |i: Option<usize>| i.and_then(|i| all.get(i)).copied().unwrap_or(0.0);
    let (below, above) = (beside(best.checked_sub(1)), beside(Some(best + 1)));
    let curvature = below - 2.0 * height + above;
    let shift = if curvature < 0.0 { (0.5 * (below - above) / curvature).clamp(-0.5, 0.5) } else { 0.0 };
    let across = best as f64 - reach as f64 + shift;
    Some(Segment { centre: target.centre + normal * across, half: along * length.max(extent) })
}

/// Significance of a point: one chance in 3000 among the 1000 places on a long trail.
const POINT_SIGMA: f64 = 5.0;

/// The brightest point on the trail of a target beside the light that is known of; none if nothing is significant.
pub fn point(stamp: &Stamp, target: &Segment, fwhm: f64, known: impl Fn(DVec2) -> (f64, f64)) -> Option<Segment> {
    if fwhm.is_nan() || fwhm <= 0.0 || target.length().is_nan() || target.length() < NEAR * fwhm {
        return None;
    }
    let near = stamp.pixels.iter().filter(|p| p.distance <= 2.0 * REACH * fwhm);
    let low = near.clone().fold(DVec2::INFINITY, |a, p| a.min(p.place));
    let high = near.clone().fold(DVec2::NEG_INFINITY, |a, p| a.max(p.place));
    let size = high - low + 1.0;
    if !(size.x > 0.0 && size.y > 0.0 && size.x * size.y < 4e6) {
        return None;
    }
    let columns = size.x as usize;
    let at = |place: DVec2| (place.y - low.y) as usize * columns + (place.x - low.x) as usize;
    let mut cells = vec![[0.0; 2]; columns * size.y as usize];
    for pixel in near {
        let (light, variance) = known(pixel.place);
        if variance > 0.0 && light.is_finite() {
            cells[at(pixel.place)] = [(pixel.value_e - light) / variance, 1.0 / variance];
        }
    }
    let sigma = fwhm / 2.354_82;
    let wing = (1.3 * fwhm).min(50.0).ceil() as i64;
    let kernel = (-wing..=wing).map(|i| (-0.5 * (i as f64 / sigma).powi(2)).exp()).collect::<Vec<_>>();
    let significance = |centre: DVec2| {
        let (mut signal, mut weight) = (0.0, 0.0);
        for (dy, ky) in (-wing..=wing).zip(&kernel) {
            for (dx, kx) in (-wing..=wing).zip(&kernel) {
                let place = centre + DVec2::new(dx as f64, dy as f64);
                if place.cmpge(low).all() && place.cmple(high).all() {
                    let [r, v] = cells[at(place)];
                    signal += kx * ky * r;
                    weight += (kx * ky).powi(2) * v;
                }
            }
        }
        if weight > 0.0 { signal / weight.sqrt() } else { 0.0 }
    };
    let places = stamp.pixels.iter().filter(|p| p.distance <= 1.5 * fwhm).map(|p| p.place);
    let all = places.map(|p| (p, significance(p))).collect::<Vec<_>>();
    let best = all.iter().fold((DVec2::ZERO, 0.0), |a, b| if b.1 > a.1 { *b } else { a });
    // what is left along all of the trail is the trail's own
    let mut usual = all.iter().map(|(_, s)| s.abs()).collect::<Vec<_>>();
    usual.sort_by(f64::total_cmp);
    let usual = usual.get(usual.len() * 4 / 5).copied().unwrap_or(0.0);
    (best.1 >= POINT_SIGMA.max(2.5 * usual)).then(|| Segment::point(best.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::photometry::synthetic::{self, Camera, Source};

    fn stamp(seed: u64, across: f64, flux_e: f64) -> (Stamp, Segment, DVec2) {
        let target = Segment::point(DVec2::new(80.3, 75.1));
        let half = DVec2::new(30.0, 12.0);
        let star = Segment { centre: target.centre + half * 0.4 + half.normalize().perp() * across, half };
        let frame = synthetic::expose(&Camera::default(), 160, 150, seed, &[Source { segment: star, flux_e }]);
        (Stamp::gather(&frame, &target, 30.0, 4.6, |_| false), target, half)
    }

    fn level(stamp: &Stamp) -> (f64, f64) {
        let mut values = stamp.pixels.iter().map(|p| p.value_e).collect::<Vec<_>>();
        values.sort_by(f64::total_cmp);
        let at = |share: f64| values[(share * values.len() as f64) as usize];
        (at(0.5), (0.5 * (at(0.84) - at(0.16))).powi(2))
    }

    /// A trail of 8 standard deviations along 40 px is found within a pixel; noise alone makes none in 60 stamps (one in 2000).
    #[test]
    fn a_trail_that_is_in_no_catalogue_is_found() {
        for across in [0.0, 2.0, -5.0] {
            let (stamp, target, half) = stamp(4, across, 9000.0);
            let (mean, variance) = level(&stamp);
            let found = trail(&stamp, &target, half, 3.1, |_| (mean, variance)).expect("a trail");
            let got = (found.centre - target.centre).dot(half.normalize().perp());
            assert!((got - across).abs() < 1.0, "{got} for {across}");
        }
        let alarms = (10..70).filter(|seed| {
            let (stamp, target, half) = stamp(*seed, 0.0, 0.0);
            let (mean, variance) = level(&stamp);
            trail(&stamp, &target, half, 3.1, |_| (mean, variance)).is_some()
        });
        assert_eq!(alarms.count(), 0);
    }

    /// A star of 10 standard deviations on the trail of a target is found within 2 px, and none where there is none.
    #[test]
    fn a_point_on_a_trail_is_found() {
        let target = Segment { centre: DVec2::new(80.3, 75.1), half: DVec2::new(40.0, 9.0) };
        let image = crate::photometry::growth::Psf::known(
            crate::photometry::profile::Shape::Moffat { inverse_beta: 0.0 },
            3.0,
        );
        let image = image.image(30.0);
        for (flux_e, seed) in [(0.0, 21), (0.0, 22), (2500.0, 23), (2500.0, 24)] {
            let star = Segment::point(target.centre + target.half * 0.3 + DVec2::Y);
            let sources = [Source { segment: target, flux_e: 3e4 }, Source { segment: star, flux_e }];
            let frame = synthetic::expose(&Camera::default(), 160, 150, seed, &sources);
            let stamp = Stamp::gather(&frame, &target, 25.0, 4.6, |_| false);
            let far = Stamp {
                pixels: stamp.pixels.iter().filter(|p| p.distance > 15.0).copied().collect(),
                ..stamp.clone()
            };
            let (mean, variance) = level(&far);
            let known = |p| {
                let light = 3e4 * image.share(&target, p);
                (mean + light, variance + light)
            };
            let found = point(&stamp, &target, 3.1, known);
            let off = found.map(|s| (s.centre - star.centre).length());
            assert_eq!(flux_e > 0.0, off.is_some_and(|o| o < 2.0), "{flux_e}: {off:?}");
            assert!(flux_e > 0.0 || off.is_none());
        }
    }

    #[test]
    fn points_and_odd_input_make_no_trail() {
        let (stamp, target, half) = stamp(4, 0.0, 9000.0);
        assert_eq!(trail(&stamp, &target, DVec2::ZERO, 3.1, |_| (0.0, 1.0)), None);
        assert_eq!(trail(&stamp, &target, DVec2::NAN, 3.1, |_| (0.0, 1.0)), None);
        assert_eq!(trail(&stamp, &target, half, f64::NAN, |_| (0.0, 1.0)), None);
        assert_eq!(trail(&stamp, &target, half, 3.1, |_| (f64::NAN, 1.0)), None);
        assert_eq!(trail(&Stamp::default(), &target, half, 3.1, |_| (0.0, 1.0)), None);
    }
}
