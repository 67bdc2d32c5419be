//! Intervals in which a condition holds, found by walking and root finding.
//!
//! A condition is a margin, above 0 where it holds, and a time within which it cannot change sign: the walk goes as far as
//! that allows, so that nothing is missed however short it is, down to [`LEAST_STEP_S`].

use crate::astro::time::Instant;

/// Least step of a walk through a night \[s\]: what lasts less may be missed.
pub const LEAST_STEP_S: f64 = 1.0;
/// Changes of sign are found to this \[s\].
const ROOT_S: f64 = 1e-4;

/// A stretch of time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// Start.
    pub start: Instant,
    /// End.
    pub end: Instant,
}

impl Interval {
    /// Its length \[s\].
    pub fn seconds(&self) -> f64 {
        self.end.since(&self.start)
    }

    /// What it has in common with another; none if that is nothing.
    pub fn common(&self, other: &Self) -> Option<Self> {
        let (start, end) = (self.start.max(other.start), self.end.min(other.end));
        (start < end).then_some(Self { start, end })
    }
}

/// A margin at an instant: its value, and for how long \[s\] its sign surely stays.
#[derive(Debug, Clone, Copy)]
pub struct Margin {
    /// Above 0 where the condition holds.
    pub value: f64,
    /// How long the sign surely stays \[s\].
    pub safe_s: f64,
}

/// Cuts an interval where a margin changes its sign: pieces in order, and whether the condition holds in each. What lasts
/// less than `least_s` seconds may be missed.
///
/// # Errors
/// Whatever the margin says.
pub fn pieces<E>(
    within: Interval,
    least_s: f64,
    mut margin: impl FnMut(&Instant) -> Result<Margin, E>,
) -> Result<Vec<(Interval, bool)>, E> {
    let mut out: Vec<(Interval, bool)> = Vec::new();
    let mut push = |start: Instant, end: Instant, holds: bool| match out.last_mut() {
        Some((last, before)) if *before == holds => last.end = end,
        _ if start < end => out.push((Interval { start, end }, holds)),
        _ => {}
    };
    let mut t = within.start;
    let mut here = margin(&t)?;
    while t < within.end {
        // a margin that is not a number holds nowhere and says nothing about later
        let safe = if here.safe_s.is_nan() { least_s.max(1.0) } else { here.safe_s.max(least_s) };
        let next = t.plus(safe.min(86_400.0)).min(within.end);
        let there = margin(&next)?;
        let holds = here.value >= 0.0;
        let will = if there.value.is_nan() { holds } else { there.value >= 0.0 };
        if holds == will {
            push(t, next, holds);
        } else {
            let change = root((t, here.value), (next, there.value), |t| Ok(margin(t)?.value))?;
            push(t, change, holds);
            push(change, next, will);
        }
        (t, here) = (next, there);
    }
    Ok(out)
}

/// Where a function changes its sign between two instants, by the Illinois variant of false position, halving where that
/// is slow.
fn root<E>(
    (mut a, mut fa): (Instant, f64),
    (mut b, mut fb): (Instant, f64),
    mut f: impl FnMut(&Instant) -> Result<f64, E>,
) -> Result<Instant, E> {
    let mut side = 0;
    for k in 0..100 {
        let width = b.since(&a);
        if width <= ROOT_S {
            break;
        }
        let share = if k % 4 == 3 { 0.5 } else { fa / (fa - fb) };
        let share = if share.is_finite() { share.clamp(0.01, 0.99) } else { 0.5 };
        let c = a.plus(share * width);
        let fc = f(&c)?;
        if (fc >= 0.0) == (fa >= 0.0) {
            (a, fa) = (c, fc);
            if side == 1 {
                fb *= 0.5;
            }
            side = 1;
        } else {
            (b, fb) = (c, fc);
            if side == -1 {
                fa *= 0.5;
            }
            side = -1;
        }
    }
    Ok(b)
}

/// Where a function is largest in an interval, by samples at most `step_s` seconds apart and golden sections; to a
/// millisecond.
///
/// # Errors
/// Whatever the function says.
pub fn highest<E>(
    within: Interval,
    step_s: f64,
    mut f: impl FnMut(&Instant) -> Result<f64, E>,
) -> Result<(Instant, f64), E> {
    const FEWEST: f64 = 32.0;
    let samples = (within.seconds() / step_s).ceil().clamp(FEWEST, 1e6) as usize;
    let step = within.seconds() / samples as f64;
    let mut best = (0, f(&within.start)?);
    for k in 1..=samples {
        let value = f(&within.start.plus(k as f64 * step))?;
        if value > best.1 {
            best = (k, value);
        }
    }
    let golden = 0.5 * (5f64.sqrt() - 1.0);
    let (mut low, mut high) = ((best.0 as f64 - 1.0).max(0.0) * step, ((best.0 + 1).min(samples)) as f64 * step);
    let mut value = |s: f64| f(&within.start.plus(s));
    let mut top = (best.0 as f64 * step, best.1);
    let (mut a, mut b) = (high - golden * (high - low), low + golden * (high - low));
    let (mut fa, mut fb) = (value(a)?, value(b)?);
    while high - low > 1e-3 {
        if fa > fb {
            (high, b, fb) = (b, a, fa);
            a = high - golden * (high - low);
            fa = value(a)?;
        } else {
            (low, a, fa) = (a, b, fb);
            b = low + golden * (high - low);
            fb = value(b)?;
        }
    }
    for (s, v) in [(a, fa), (b, fb)] {
        if v > top.1 {
            top = (s, v);
        }
    }
    Ok((within.start.plus(top.0), top.1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    fn within(seconds: f64) -> Interval {
        Interval { start: Instant::default(), end: Instant::default().plus(seconds) }
    }

    fn sure<T>(result: Result<T, Infallible>) -> T {
        result.unwrap_or_else(|never| match never {})
    }

    /// A sine with one short peak above 0 in its period: found though no step of the walk is as short as the peak.
    #[test]
    fn nothing_is_missed_that_the_bound_allows() {
        let rate = std::f64::consts::TAU / 5000.0;
        let start = Instant::default();
        let mut calls = 0;
        let found = sure(pieces(within(20_000.0), 1.0, |t| {
            calls += 1;
            let value = (rate * t.since(&start)).sin() - 0.9999;
            Ok(Margin { value, safe_s: value.abs() / rate })
        }));
        let up = found.iter().filter(|(_, holds)| *holds).map(|(i, _)| *i).collect::<Vec<_>>();
        assert_eq!(up.len(), 4);
        let half = (0.9999f64).acos() / rate;
        for (k, interval) in up.iter().enumerate() {
            let middle = 1250.0 + 5000.0 * k as f64;
            assert!((interval.start.since(&start) - (middle - half)).abs() < 2e-3);
            assert!((interval.end.since(&start) - (middle + half)).abs() < 2e-3);
        }
        assert!(calls < 700, "{calls}");
        assert_eq!(found.len(), 9);
    }

    #[test]
    fn conditions_that_always_or_never_hold_or_are_not_numbers() {
        for (value, holds) in [(1.0, true), (-1.0, false), (f64::NAN, false)] {
            let found = sure(pieces(within(100.0), 1.0, |_| Ok(Margin { value, safe_s: 10.0 })));
            assert_eq!(found, [(within(100.0), holds)], "{value}");
        }
        assert!(sure(pieces(within(0.0), 1.0, |_| Ok(Margin { value: 1.0, safe_s: 1.0 }))).is_empty());
    }

    #[test]
    fn the_highest_place_of_an_arc() {
        let start = Instant::default();
        let (at, value) = sure(highest(within(600.0), 60.0, |t| Ok(-(t.since(&start) - 237.0).powi(2))));
        assert!((at.since(&start) - 237.0).abs() < 2e-3 && value > -1e-5);
        assert_eq!(sure(highest(within(600.0), 60.0, |t| Ok(t.since(&start)))).1, 600.0);
    }
}
