//! A body laid over another one that stands otherwise: turned, moved and, if its size means nothing, scaled.
//!
//! Centres of mass meet, and the turn is the one with most volume in common: evenly spread turns (super-Fibonacci spirals, Alexa 2022,
//! Proc. CVPR, 8291) by few columns, then the best of them by a pattern search (Hooke & Jeeves 1961, J. ACM 8, 212). A mirror image is not
//! tried: a light curve tells one body from its mirror image, unless a pole and its alias fit equally well, and that is told apart.

use super::metrics::{Bulk, Parts, bulk, intersection_over_union};
use super::part::Triangle;
use glam::{DQuat, DVec3};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Turns that are tried: 20 deg from each other.
const TURNS: usize = 1200;
/// Of these, followed.
const FOLLOWED: usize = 8;
/// Columns for centres, for turns that are tried, and for those that are followed.
const COLUMNS: [usize; 3] = [1 << 16, 1 << 9, 1 << 12];
/// First and last step of the search \[rad\].
const STEPS: [f64; 2] = [0.17, 5e-4];

/// Number `k` of `count` evenly spread turns.
fn turn(k: usize, count: usize) -> DQuat {
    // the roots of x^2 = 2 and x^4 = x + 4
    const PHI: f64 = std::f64::consts::SQRT_2;
    const PSI: f64 = 1.533_751_168_755_204_3;
    let s = k as f64 + 0.5;
    let t = s / count.max(1) as f64;
    let (r, q) = (t.sqrt(), (1.0 - t).sqrt());
    let (alpha, beta) = (TAU * (s / PHI).fract(), TAU * (s / PSI).fract());
    DQuat::from_xyzw(r * libm::sin(alpha), r * libm::cos(alpha), q * libm::sin(beta), q * libm::cos(beta))
}

/// `b` turned and moved over `a`, so that they have most volume in common; `scaled`: and made as large. Where a body has no volume
/// nothing changes.
pub fn turned_over(a: &Parts, b: &Parts, scaled: bool) -> Vec<Vec<Triangle>> {
    let (one, other) = (bulk(a, COLUMNS[0]), bulk(b, COLUMNS[0]));
    if !(one.volume > 0.0 && other.volume > 0.0) {
        return b.to_vec();
    }
    let scale = if scaled { (one.volume / other.volume).cbrt() } else { 1.0 };
    let laid = |turn: DQuat| laid(b, other, turn, scale, one.centre);
    let common = |turn: DQuat, columns: usize| intersection_over_union(a, &laid(turn), columns);
    let mut tried = (0..TURNS)
        .into_par_iter()
        .map(|k| turn(k, TURNS))
        .map(|turn| (turn, common(turn, COLUMNS[1])))
        .collect::<Vec<_>>();
    tried.sort_by(|x, y| y.1.total_cmp(&x.1));
    let followed = tried.par_iter().take(FOLLOWED).map(|(turn, _)| follow(*turn, |t| common(t, COLUMNS[2])));
    let best = followed
        .collect::<Vec<_>>()
        .into_iter()
        .fold((DQuat::IDENTITY, -1.0), |best, next| if next.1 > best.1 { next } else { best });
    laid(best.0)
}

fn laid(parts: &Parts, bulk: Bulk, turn: DQuat, scale: f64, centre: DVec3) -> Vec<Vec<Triangle>> {
    let place = |v: DVec3| centre + turn * ((v - bulk.centre) * scale);
    parts.iter().map(|part| part.iter().map(|t| t.map(place)).collect()).collect()
}

/// Uphill from a turn, by steps about three axes that are halved when none helps.
fn follow(start: DQuat, value: impl Fn(DQuat) -> f64) -> (DQuat, f64) {
    let (mut at, mut height, mut step) = (start, value(start), STEPS[0]);
    while step > STEPS[1] {
        let axes = [DVec3::X, DVec3::Y, DVec3::Z].into_iter().flat_map(|axis| [axis, -axis]);
        let tried = axes.map(|axis| (DQuat::from_axis_angle(axis, step) * at).normalize()).map(|t| (t, value(t)));
        let best = tried.fold((at, height), |best, next| if next.1 > best.1 { next } else { best });
        if best.1 > height { (at, height) = best } else { step *= 0.5 }
    }
    (at, height)
}

#[cfg(test)]
mod tests {
    use super::super::part::Part;
    use super::*;
    use glam::DMat3;

    fn cuboid(centre: DVec3, half: DVec3) -> Vec<Triangle> {
        Part { centre, axes: DMat3::IDENTITY, half }.triangles().to_vec()
    }

    fn moved(parts: &Parts, turn: DQuat, scale: f64, by: DVec3) -> Vec<Vec<Triangle>> {
        parts.iter().map(|p| p.iter().map(|t| t.map(|v| by + turn * (v * scale))).collect()).collect()
    }

    /// A box and an L of three sizes each: 1 % of their volume is 0.3 deg of a turn.
    #[test]
    fn bodies_turned_moved_and_scaled_are_found_the_same() {
        let bodies = [
            vec![cuboid(DVec3::ZERO, DVec3::new(1.0, 2.0, 3.0))],
            vec![
                cuboid(DVec3::ZERO, DVec3::new(1.0, 2.0, 0.5)),
                cuboid(DVec3::new(2.0, 1.5, 0.0), DVec3::new(1.0, 0.5, 0.5)),
            ],
        ];
        for (k, body) in bodies.iter().enumerate() {
            for turn in [DQuat::from_xyzw(0.3, -0.2, 0.8, 0.4).normalize(), DQuat::from_rotation_y(3.0)] {
                let other = moved(body, turn, 1.7, DVec3::new(5.0, -2.0, 0.3));
                let iou = intersection_over_union(body, &turned_over(body, &other, true), 1 << 16);
                assert!(iou > 0.99, "body {k}: {iou}");
                // of a body 1.7 times as large that keeps its size a fifth is in the other
                let kept = intersection_over_union(body, &turned_over(body, &other, false), 1 << 16);
                assert!((kept - 1.7f64.powi(-3)).abs() < 0.02, "body {k}: {kept}");
            }
        }
    }

    #[test]
    fn turns_are_spread_and_odd_bodies_stay() {
        let nearest = |k: usize| {
            let others = (0..300).filter(|j| *j != k);
            others.map(|j| turn(k, 300).angle_between(turn(j, 300))).fold(f64::INFINITY, f64::min)
        };
        for k in (0..300).step_by(37) {
            assert!((10f64..60.0).contains(&nearest(k).to_degrees()), "{}", nearest(k).to_degrees());
        }
        let sheet = [vec![[DVec3::ZERO, DVec3::X, DVec3::Y]]];
        assert_eq!(turned_over(&sheet, &sheet, true), sheet.to_vec());
        assert!(turned_over(&sheet, &[], true).is_empty());
    }
}
