//! Whether an exposure is worth taking, and why not.

use super::view::{Observability, View};
use crate::scene::Scene;

/// Lowest elevation at an azimuth \[both deg\] on a mask of (azimuth, elevation) points, linear between them and
/// round the circle.
pub fn horizon(mask: &[[f64; 2]], azimuth_deg: f64) -> f64 {
    let Some((first, last)) = mask.first().zip(mask.last()) else { return f64::NEG_INFINITY };
    let azimuth = azimuth_deg.rem_euclid(360.0);
    let above = mask.partition_point(|p| p[0] <= azimuth);
    let (a, b) = match (above.checked_sub(1).map(|i| mask[i]), mask.get(above)) {
        (Some(a), Some(b)) => (a, *b),
        (Some(a), None) => (a, [first[0] + 360.0, first[1]]),
        (None, _) => ([last[0] - 360.0, last[1]], *first),
    };
    let width = b[0] - a[0];
    if width <= 0.0 { a[1] } else { a[1] + (b[1] - a[1]) * (azimuth - a[0]) / width }
}

/// Hold an exposure against the scene's `[plan]` and horizon. The place that counts is the first target's, or
/// the frame's centre if there is none; `mag_v` is its magnitude in this exposure, where the scene asks for a limit.
pub fn assess(view: &View, scene: &Scene, mag_v: Option<f64>) -> Observability {
    let limits = &scene.plan;
    let target = view.targets.first();
    let place = target.map_or(view.centre, |t| t.apparent);
    let elevation = place.elevation.to_degrees();
    let mut broken = Vec::new();
    let mask = horizon(&scene.station.horizon_deg, place.azimuth.to_degrees());
    if elevation < limits.min_el_deg {
        broken.push(format!("elevation {elevation:.1} deg below {} deg", limits.min_el_deg));
    } else if elevation < mask {
        broken.push(format!("elevation {elevation:.1} deg below the horizon mask's {mask:.1} deg"));
    }
    let sun = view.sun.horizontal.elevation.to_degrees();
    if sun > limits.max_sun_el_deg {
        broken.push(format!("Sun at {sun:.1} deg above {} deg", limits.max_sun_el_deg));
    }
    let moon_separation = target.map_or_else(
        || crate::astro::separation(view.wcs.mid.centre, view.moon.body.direction),
        |t| t.moon_separation,
    );
    let separation = moon_separation.to_degrees();
    if separation < limits.min_moon_sep_deg {
        broken.push(format!("Moon {separation:.1} deg away, nearer than {} deg", limits.min_moon_sep_deg));
    }
    if let Some(t) = target.filter(|t| limits.sunlit && t.light.sunlit < 1.0) {
        broken.push(format!("in the Earth's shadow, {:.0} % of the Sun's disc visible", t.light.sunlit * 100.0));
    }
    match limits.limit_mag_v.zip(mag_v) {
        Some((limit, mag_v)) if mag_v.is_nan() => broken.push(format!("dark, fainter than V {limit}")),
        Some((limit, mag_v)) if mag_v > limit => broken.push(format!("V {mag_v:.2} fainter than {limit}")),
        _ => {}
    }
    Observability {
        observable: broken.is_empty(),
        why: broken.join("; "),
        below_horizon: view.centre.elevation <= 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_horizon_mask_is_linear_and_goes_round() {
        let mask = [[90.0, 10.0], [180.0, 20.0], [270.0, 10.0]];
        for (azimuth, expected) in [(90.0, 10.0), (135.0, 15.0), (180.0, 20.0), (0.0, 10.0), (359.0, 10.0)] {
            assert!((horizon(&mask, azimuth) - expected).abs() < 1e-12, "{azimuth}");
        }
        assert_eq!(horizon(&[], 10.0), f64::NEG_INFINITY);
        assert_eq!(horizon(&[[0.0, 5.0]], 200.0), 5.0);
    }
}
