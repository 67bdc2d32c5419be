//! What a period may be mistaken for: its multiples and fractions, and its images by periodicities of the sampling.
//!
//! A sampling whose spectral window |sum w exp(2 pi i f t)|^2 (Deeming 1975, Ap&SS 36, 137) peaks at f_s cannot tell a frequency f from
//! |f + n f_s|. Peaks are sought on the grid of the search, at the median gap, and at the days of Sun and stars.

use super::harmonic::{climb, power_at};
use super::peaks::{highest, vertex};
use super::sample::Sample;
use super::scan::{Grid, Spectrum};
use super::turn::{Complex, turn};
use super::types::{Alias, Candidate, Cause, Relation, Shape, WindowPeak};

/// Mean solar day \[s\].
const SOLAR_DAY_S: f64 = 86_400.0;
/// Mean sidereal day \[s\].
const SIDEREAL_DAY_S: f64 = 86_164.1;
/// A window's peak below this makes no image worth listing: it keeps a tenth of a signal's power.
const WINDOW_PEAK: f64 = 0.1;
/// Peaks taken from the grid.
const PEAKS: usize = 6;
/// Distance in units of 1 / span below which frequencies are the same.
const SAME: f64 = 0.5;
/// Chi-square difference below which two periods are not told apart: three standard errors.
const INDISTINGUISHABLE: f64 = 9.0;
/// Multiples listed, as turns over parts.
const MULTIPLES: [(u32, u32); 8] = [(1, 2), (2, 1), (1, 3), (3, 1), (1, 4), (4, 1), (2, 3), (3, 2)];

/// The spectral window at a frequency.
fn window_at(sample: &Sample, hz: f64) -> f64 {
    let points = sample.t.iter().zip(&sample.w);
    points.fold(Complex::default(), |s, (t, w)| s + turn(hz * t).scale(*w)).norm_sqr()
}

/// Peaks of the spectral window, the highest first.
pub fn window_peaks(sample: &Sample, grid: &Grid, spectrum: &Spectrum) -> Vec<WindowPeak> {
    let resolution = 1.0 / sample.span_s();
    let gap = sample.median_gap_s().map(|gap| (gap, Cause::MedianGap));
    let days = [(SOLAR_DAY_S, Cause::SolarDay), (SIDEREAL_DAY_S, Cause::SiderealDay)];
    let known = gap.into_iter().chain(days.into_iter().filter(|(day, _)| sample.span_s() > *day));
    let named = known.map(|(period, cause)| {
        let near = (-10..=10).map(|i| 1.0 / period + 0.05 * f64::from(i) * resolution);
        let best = near.map(|f| (f, window_at(sample, f))).max_by(|a, b| a.1.total_cmp(&b.1));
        (best.unwrap_or((1.0 / period, 0.0)), cause)
    });
    let apart = (SAME * resolution / grid.step_hz).ceil() as usize;
    let at = |i: usize| spectrum.window.get(i).copied();
    let others = highest(&spectrum.window, PEAKS, apart).into_iter().filter_map(|i| {
        // an edge of the grid is no peak
        let around = [at(i.checked_sub(1)?)?, at(i)?, at(i + 1)?];
        Some(((grid.step_hz.mul_add(vertex(around), grid.frequency(i)), around[1]), Cause::Window))
    });
    let mut peaks: Vec<WindowPeak> = Vec::new();
    for ((hz, power), cause) in named.chain(others) {
        let new = peaks.iter().all(|p| (1.0 / p.period_s - hz).abs() > SAME * resolution);
        if power > WINDOW_PEAK && hz > SAME * resolution && new {
            peaks.push(WindowPeak { period_s: 1.0 / hz, power, cause });
        }
    }
    peaks.sort_by(|a, b| b.power.total_cmp(&a.power));
    peaks
}

/// The aliases of a candidate, by chi-square.
pub fn aliases(sample: &Sample, best: &Candidate, harmonics: usize, window: &[WindowPeak]) -> Vec<Alias> {
    let k = match best.shape {
        Shape::Harmonics(k) => k,
        Shape::Bins(_) => harmonics,
    };
    let most = (sample.points().saturating_sub(2) / 2).max(1);
    let resolution = 1.0 / sample.span_s();
    let chi2_of = |power: f64| (1.0 - power) * sample.yy * sample.chi2_unit;
    let best_chi2 = chi2_of(power_at(sample, best.frequency_hz, k));
    let free = (sample.points() as f64 - 2.0 * k as f64 - 2.0).max(1.0);
    let noise = (best_chi2 / free).max(1.0);

    let multiples = MULTIPLES.iter().map(|(turns, parts)| {
        let ratio = f64::from(*turns) / f64::from(*parts);
        let details = ((k as f64 * ratio).round() as usize).clamp(1, most);
        (best.frequency_hz / ratio, details, Relation::Multiple { turns: *turns, parts: *parts })
    });
    let images = window.iter().flat_map(|peak| {
        let (sampling_s, f) = (peak.period_s, best.frequency_hz);
        [-1, 1, -2, 2].map(|order| {
            let relation = Relation::Sampling { order, sampling_s, cause: peak.cause };
            ((f + f64::from(order) / sampling_s).abs(), k, relation)
        })
    });
    let mut aliases: Vec<Alias> = Vec::new();
    for (hz, details, relation) in multiples.chain(images) {
        let step = (0.1 * resolution).min(0.25 * resolution / details as f64);
        let (top, power) = climb(sample, hz, step, details);
        let near = |f: f64| (f - top).abs() < SAME * resolution;
        let listed = aliases.iter().any(|a| near(1.0 / a.period_s));
        if hz < SAME * resolution || near(best.frequency_hz) || listed {
            continue;
        }
        let chi2 = chi2_of(power);
        let delta_chi2 = (chi2 - best_chi2) / noise;
        let indistinguishable = delta_chi2 < INDISTINGUISHABLE;
        aliases.push(Alias {
            period_s: 1.0 / top,
            relation,
            harmonics: details,
            power,
            chi2,
            delta_chi2,
            indistinguishable,
        });
    }
    aliases.sort_by(|a, b| a.delta_chi2.total_cmp(&b.delta_chi2));
    aliases
}
