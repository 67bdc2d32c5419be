//! A light curve folded with a period: phases, the mean curve, and its maxima.

use serde::Serialize;

/// How many standard errors a maximum must rise above the minima on both sides. In noise, one of the thousand pairs of fifty
/// bins differs so much once in 2000 curves.
const SIGNIFICANT: f64 = 5.0;

/// A bin of the mean curve.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FoldedBin {
    /// Middle of the bin \[turns\].
    pub phase: f64,
    /// Weighted mean of its points; NaN without points.
    pub mean: f64,
    /// Its standard error: the larger of what the points' errors and their scatter say; NaN without points.
    pub err: f64,
    /// Number of points.
    pub points: usize,
}

/// Phases (t - epoch) / period without the whole turns, 0 <= phase < 1; NaN for what is not finite or a period of zero.
pub fn fold(times_s: &[f64], period_s: f64, epoch_s: f64) -> Vec<f64> {
    let phase = |t: &f64| {
        let turns = (t - epoch_s) / period_s;
        let phase = turns - turns.floor();
        // a tiny negative number of turns rounds to a whole one
        if phase < 1.0 || phase.is_nan() { phase } else { 0.0 }
    };
    times_s.iter().map(phase).collect()
}

/// Weighted means in `bins` (1 to 10,000, clamped) even bins of phase \[turns\]. Points with a phase outside 0 to 1, a value or error
/// that is not finite, or an error not above zero, are left out.
pub fn mean_curve(phases: &[f64], value: &[f64], sigma: &[f64], bins: usize) -> Vec<FoldedBin> {
    let bins = bins.clamp(1, 10_000);
    let place = |phase: f64| ((phase * bins as f64) as usize).min(bins - 1);
    let points = || {
        let all = phases.iter().zip(value).zip(sigma).map(|((p, v), s)| (*p, *v, s.powi(-2)));
        all.filter(|(p, v, w)| (0.0..1.0).contains(p) && v.is_finite() && w.is_finite() && *w > 0.0)
    };
    let mut sums = vec![(0usize, 0.0, 0.0, 0.0); bins];
    for (p, v, w) in points() {
        let sum = &mut sums[place(p)];
        (sum.0, sum.1, sum.2) = (sum.0 + 1, sum.1 + w, sum.2 + w * v);
    }
    for (p, v, w) in points() {
        let sum = &mut sums[place(p)];
        sum.3 += w * (v - sum.2 / sum.1).powi(2);
    }
    let bin = |(i, (points, w, wv, squares)): (usize, (usize, f64, f64, f64))| {
        let excess = if points > 1 { (squares / (points as f64 - 1.0)).max(1.0) } else { 1.0 };
        let err = if points > 0 { (excess / w).sqrt() } else { f64::NAN };
        FoldedBin { phase: (i as f64 + 0.5) / bins as f64, mean: wv / w, err, points }
    };
    sums.into_iter().enumerate().map(bin).collect()
}

/// Number of significant maxima per turn of a mean curve: each is five standard errors above the minima next to it. Maxima
/// and minima alternate, so that there are as many minima; in magnitudes these are the bright ones.
pub fn maxima(curve: &[FoldedBin]) -> usize {
    let filled = curve.iter().filter(|b| b.points > 0).collect::<Vec<_>>();
    let Some(start) = (0..filled.len()).max_by(|a, b| filled[*a].mean.total_cmp(&filled[*b].mean)) else {
        return 0;
    };
    let beyond = |a: &FoldedBin, b: &FoldedBin| a.mean - b.mean > SIGNIFICANT * a.err.hypot(b.err);
    let (mut falling, mut extreme, mut count) = (true, filled[start], 0);
    for i in 1..=filled.len() {
        let bin = filled[(start + i) % filled.len()];
        let turned = if falling { beyond(bin, extreme) } else { beyond(extreme, bin) };
        if turned {
            count += usize::from(!falling);
            falling = !falling;
        }
        if turned || (bin.mean < extreme.mean) == falling {
            extreme = bin;
        }
    }
    // back at the highest bin: its own maximum
    count + usize::from(!falling)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn phases_lie_within_a_turn() {
        let phases = fold(&[10.0, 12.5, 9.0, 10.0 - 1e-18, -1e300, f64::NAN], 2.0, 10.0);
        assert_eq!(phases[..4], [0.0, 0.25, 0.5, 0.0]);
        assert!((0.0..1.0).contains(&phases[4]) && phases[5].is_nan());
        assert_eq!(fold(&[10.0 - 1e-17], 2.0, 10.0), [0.0]);
        assert_eq!(fold(&[-1e-18], 2.0, 0.0), [0.0]);
        assert!(fold(&[1.0], 0.0, 1.0)[0].is_nan());
    }

    #[test]
    fn bins_have_weighted_means_and_honest_errors() {
        let curve =
            mean_curve(&[0.1, 0.2, 0.6, 0.7, 0.3], &[1.0, 2.0, 5.0, 9.0, f64::NAN], &[1.0, 0.5, 0.1, 0.1, 1.0], 2);
        assert_eq!([curve[0].points, curve[1].points], [2, 2]);
        assert!((curve[0].mean - 9.0 / 5.0).abs() < 1e-14 && (curve[0].err - 0.2f64.sqrt()).abs() < 1e-14);
        // two values of 5 and 9: standard error of their mean is 2, however small the errors claimed
        assert!((curve[1].mean - 7.0).abs() < 1e-14 && (curve[1].err - 2.0).abs() < 1e-12);
        assert!(mean_curve(&[], &[], &[], 0)[0].mean.is_nan());
    }

    #[test]
    fn maxima_are_those_above_the_noise() {
        let curve = |height: fn(f64) -> f64| {
            let bin = |i| FoldedBin {
                phase: f64::from(i) / 40.0,
                mean: height(f64::from(i) / 40.0),
                err: 0.05,
                points: 9,
            };
            (0..40).map(bin).collect::<Vec<_>>()
        };
        assert_eq!(maxima(&curve(|p| (TAU * p).sin())), 1);
        assert_eq!(maxima(&curve(|p| (2.0 * TAU * p).sin() + 0.3 * (TAU * p).cos())), 2);
        assert_eq!(maxima(&curve(|p| -(4.0 * TAU * p).cos())), 4);
        assert_eq!(maxima(&curve(|p| 0.1 * (7.0 * TAU * p).sin())), 0);
        assert_eq!(maxima(&curve(|p| if (p - 0.5).abs() < 0.01 { 3.0 } else { 0.0 })), 1);
        assert_eq!(maxima(&[]), 0);
    }
}
