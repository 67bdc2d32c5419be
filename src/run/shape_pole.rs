//! Where a light curve's pole of rotation may point: which periods are tried, and what the curves are in the axes of a body that turns so.
//!
//! Periods stand closer than the resolution of the span T: steps of 0.3/T in frequency (Kaasalainen, Torppa & Muinonen 2001, Icarus 153, 37,
//! take 0.5 to 0.8 of P^2/(2 T)). Where they are many, few poles rank them first, and the best go on to the full scan.

use super::shape_data::Data;
use super::shape_fault::InvertError;
use crate::inversion::egi::{Curve, Options, Scale};
use crate::inversion::pole::{self, Found, Minimum, Scan, Spinning, body_axes};
use crate::photometry::period;

/// Step of frequencies, in times of 1/span.
const STEP: f64 = 0.3;
/// Most periods that are tried, and most that are scanned with all poles.
const MOST: usize = 20_000;
const FULL: usize = 4;
/// Poles and normals that rank periods.
const RANKING: (usize, usize) = (80, 100);
/// Share by which a told period may be wrong.
const TOLD: f64 = 0.01;
/// Candidates of a period search that are followed, with their doubles and halves.
const CANDIDATES: usize = 3;

/// Times the typical spacing of points from which on a pause is one between nights, and fewest points of a night that has a mean.
const GAP: f64 = 20.0;
const NIGHT: usize = 8;

/// A rotation sought and found.
#[derive(Debug, Clone)]
pub struct Rotation {
    /// Map of the poles and minima, the best first.
    pub found: Found,
    /// Periods tried \[s\]: the least, the greatest, and how many.
    pub tried: (f64, f64, usize),
    /// Rotations whose criterion is within this of the least are listed.
    pub within: f64,
    /// Where they come from, in words.
    pub from: &'static str,
}

impl Rotation {
    /// The rotation that explains the light best.
    pub fn best(&self) -> Option<&Minimum> {
        self.found.minima.first()
    }

    /// The curves in the axes of a body that turns in the best way.
    pub fn in_body_axes(&self, data: &Data) -> Vec<Curve> {
        let turned = |(curve, times): (&Curve, &Vec<f64>)| match self.best() {
            Some(best) => {
                Curve { directions: body_axes(best.pole, best.period, times, &curve.directions), ..curve.clone() }
            }
            None => curve.clone(),
        };
        data.curves.iter().zip(&data.time_s).map(turned).collect()
    }
}

/// All poles, and the periods asked for, those about the one told, or those seen in the light \[s\].
///
/// # Errors
/// [`InvertError::Periods`] for ranges that are none or hold too many, and as of [`pole::scan`].
pub fn search(data: &Data, range_s: Option<(f64, f64)>, told_s: Option<f64>) -> Result<Rotation, InvertError> {
    let all = || data.time_s.iter().flatten().copied();
    let span = all().fold(f64::MIN, f64::max) - all().fold(f64::MAX, f64::min);
    let (periods, from) = periods(data, range(range_s, told_s), span)?;
    let spinning = Spinning { curves: data.curves.clone(), times: data.time_s.clone() };
    let ends = periods.iter().fold((f64::MAX, f64::MIN), |(low, high), p| (low.min(*p), high.max(*p)));
    let tried = (ends.0, ends.1, periods.len());
    let periods = if periods.len() > FULL { ranked(&spinning, data, &periods)? } else { periods };
    let how = Scan { periods, ..Scan::default() };
    let found = pole::scan(&spinning, &data.material, &how, &Options::default())?;
    Ok(Rotation { found, tried, within: how.within, from })
}

/// The periods to try, in rising order of frequency.
fn periods(
    data: &Data,
    range: Option<(f64, f64, &'static str)>,
    span: f64,
) -> Result<(Vec<f64>, &'static str), InvertError> {
    let fault = |low, high, count| Err(InvertError::Periods { low, high, count });
    let Some((low, high, from)) = range else {
        let seen = seen(data, span);
        return if seen.is_empty() {
            fault(f64::NAN, f64::NAN, 0)
        } else {
            Ok((seen, "the light's own periodicity"))
        };
    };
    if !(low > 0.0 && low <= high && high.is_finite()) {
        return fault(low, high, 0);
    }
    let (first, last) = (high.recip(), low.recip());
    let count = ((last - first) * span.max(0.0) / STEP).ceil() + 1.0;
    if count > MOST as f64 {
        return fault(low, high, count as usize);
    }
    let count = count as usize;
    if count == 1 {
        return Ok((vec![2.0 / (first + last)], from));
    }
    let one = |k: usize| (first + (last - first) * k as f64 / (count - 1) as f64).recip();
    Ok(((0..count).map(one).collect(), from))
}

fn range(range_s: Option<(f64, f64)>, told_s: Option<f64>) -> Option<(f64, f64, &'static str)> {
    match (range_s, told_s) {
        (Some((low, high)), _) => Some((low, high, "the range given")),
        (None, Some(told)) => Some((told * (1.0 - TOLD), told * (1.0 + TOLD), "the period told, within 1 %")),
        (None, None) => None,
    }
}

/// Periods of the light's best periodicities, of their doubles and halves, with their neighbours: of the light as it is, and of nights each
/// by its mean, which geometry makes brighter or fainter.
fn seen(data: &Data, span: f64) -> Vec<f64> {
    let mut out = periodicities(&levelled(data, usize::MAX), span);
    out.extend(periodicities(&levelled(data, NIGHT), span));
    out.sort_by(|a, b| b.total_cmp(a));
    out.dedup();
    out
}

/// Time, light and error of all points: curves of unknown level by their means, and so stretches of at least `least` points without a gap.
fn levelled(data: &Data, least: usize) -> Vec<[f64; 3]> {
    let mut points = Vec::new();
    for (curve, times) in data.curves.iter().zip(&data.time_s) {
        let mean = |y: &[f64]| y.iter().sum::<f64>() / y.len().max(1) as f64;
        let level = if let Scale::Fixed(scale) = curve.scale { scale } else { mean(&curve.y) };
        let mut steps = times.windows(2).map(|t| t[1] - t[0]).collect::<Vec<_>>();
        steps.sort_by(f64::total_cmp);
        let gap = GAP * steps.get(steps.len() / 2).copied().unwrap_or(f64::INFINITY);
        let mut first = 0;
        for end in 1..=times.len() {
            if end < times.len() && times[end] - times[end - 1] <= gap {
                continue;
            }
            let night = first..end;
            let level = if night.len() >= least { mean(&curve.y[night.clone()]) } else { level };
            points.extend(night.map(|k| [times[k], curve.y[k] / level, curve.sigma[k] / level]));
            first = end;
        }
    }
    points.retain(|p| p.iter().all(|v| v.is_finite()));
    points.sort_by(|a, b| a[0].total_cmp(&b[0]));
    points
}

fn periodicities(points: &[[f64; 3]], span: f64) -> Vec<f64> {
    let column = |k: usize| points.iter().map(|p| p[k]).collect::<Vec<_>>();
    let (time_s, value, sigma) = (column(0), column(1), column(2));
    let series = period::Series { time_s: &time_s, value: &value, sigma: &sigma };
    let Ok(report) = period::search(&series, &period::Options::default()) else { return Vec::new() };
    let mut out = Vec::new();
    for candidate in report.candidates.iter().take(CANDIDATES) {
        for factor in [0.5, 1.0, 2.0] {
            let middle = (candidate.period_s * factor).recip();
            let near = (-2..=2).map(|k| middle + f64::from(k) * STEP / span.max(f64::MIN_POSITIVE));
            // a body that does not turn once in all the data shows no period
            out.extend(near.filter(|f| f * span >= 1.0).map(f64::recip));
        }
    }
    out
}

/// The best periods, each better than its neighbours.
fn ranked(spinning: &Spinning, data: &Data, periods: &[f64]) -> Result<Vec<f64>, InvertError> {
    let scan = Scan { poles: RANKING.0, normals: RANKING.1, periods: periods.to_vec(), ..Scan::default() };
    let chi2 = pole::by_period(spinning, &data.material, &scan)?;
    let beaten = |k: usize| {
        let next = [k.checked_sub(1), Some(k + 1)].into_iter().flatten();
        next.filter_map(|j| chi2.get(j)).any(|other| *other < chi2[k])
    };
    let mut order = (0..periods.len()).filter(|k| !beaten(*k)).collect::<Vec<_>>();
    order.sort_by(|a, b| chi2[*a].total_cmp(&chi2[*b]));
    order.truncate(FULL);
    order.sort_unstable();
    Ok(order.into_iter().map(|k| periods[k]).collect())
}
