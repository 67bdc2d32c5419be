//! DS9 region files: where stars and targets are in a frame.
//!
//! Image coordinates as DS9 counts them, from 1. A point is a circle of 3 px and a trail a line from opening to closing; stars
//! are green with their magnitudes, targets red with their names.

use crate::camera::path::Path;
use crate::camera::point_source::PointSource;
use crate::camera::region::Region;
use std::fmt::Write;

/// Radius of a point's circle \[px\].
const RADIUS: f64 = 3.0;
/// Stars fainter than these have no label: labels of a crowded field hide it.
const LABELLED: usize = 200;

/// The regions of a frame of which the pixels `stored` are kept: its stars, the brightest of them labelled, and its targets with
/// their names.
pub fn ds9(stars: &[PointSource], targets: &[(&str, &PointSource)], stored: &Region) -> String {
    let mut text = String::from(
        "# Region file format: DS9 version 4.1\nglobal color=green width=1 font=\"helvetica 10 normal roman\"\nimage\n",
    );
    let mut by_light = stars.iter().map(|s| s.mag_v).collect::<Vec<_>>();
    by_light.sort_by(f64::total_cmp);
    let faintest = by_light.get(LABELLED).copied().unwrap_or(f64::INFINITY);
    for star in stars {
        let label = if star.mag_v <= faintest { format!("text={{{:.2}}}", star.mag_v) } else { String::new() };
        shape(&mut text, &star.path, &label, stored);
    }
    for (name, target) in targets {
        let name = name.replace(['{', '}'], "");
        shape(&mut text, &target.path, &format!("color=red width=2 text={{{name}}}"), stored);
    }
    text
}

fn shape(text: &mut String, path: &Path, properties: &str, stored: &Region) {
    let one = |p: glam::DVec2| (p.x - stored.x0 as f64 + 1.0, p.y - stored.y0 as f64 + 1.0);
    let ((x, y), (x1, y1), (x2, y2)) = (one(path.mid), one(path.start), one(path.end));
    if !(x.is_finite() && y.is_finite()) {
        return;
    }
    let form = if path.length() > RADIUS {
        format!("line({x1:.3},{y1:.3},{x2:.3},{y2:.3}) # line=0 0")
    } else {
        format!("circle({x:.3},{y:.3},{RADIUS}) #")
    };
    let _ = writeln!(text, "{} {properties}", form.trim_end());
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DVec2, DVec3};

    #[test]
    fn points_are_circles_and_trails_lines_counted_from_one() {
        let source = |half: DVec2| PointSource {
            id: 1,
            icrs: DVec3::X,
            mag_v: 9.5,
            path: Path {
                start: DVec2::splat(20.0) - half,
                mid: DVec2::splat(20.0),
                end: DVec2::splat(20.0) + half,
            },
            electrons: 1.0,
            coloured: false,
        };
        let stored = Region { x0: 10, y0: 0, width: 64, height: 64 };
        let (trail, point) = (source(DVec2::new(5.0, 0.0)), source(DVec2::ZERO));
        let text = ds9(&[trail], &[("GOES {14}", &point)], &stored);
        assert!(text.contains("\nline(6.000,21.000,16.000,21.000) # line=0 0 text={9.50}\n"), "{text}");
        assert!(text.contains("\ncircle(11.000,21.000,3) # color=red width=2 text={GOES 14}\n"), "{text}");
    }
}
