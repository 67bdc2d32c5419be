//! Periods of light curves: spinning and tumbling objects, unevenly sampled, over minutes to years.
//!
//! 1. Points that cannot be used are left out and counted ([`sample`]).
//! 2. The floating-mean Lomb-Scargle periodogram and its multi-harmonic kin are computed on an even grid of frequencies, from
//!    1 / span to 1 / (2 median gap) unless told otherwise ([`harmonic`], [`mod@scan`], [`nufft`]); phase dispersion is minimised on
//!    the same grid if that is affordable ([`pdm`]).
//! 3. Peaks of all methods, and multiples of the best, are refined, merged and put in order ([`candidates`]), each with its
//!    probability of a false alarm ([`false_alarm`]).
//! 4. What the best may be mistaken for is listed ([`alias`]).
//!
//! A period is that of the light curve as it is seen; what the moving directions to Sun and observer do to it is not taken out.

pub mod alias;
pub mod candidates;
pub mod false_alarm;
pub mod fold;
pub mod harmonic;
pub mod nufft;
pub mod pdm;
pub mod peaks;
#[cfg(test)]
mod period_tests;
#[cfg(test)]
mod robust_tests;
pub mod sample;
pub mod scan;
pub mod turn;
pub mod types;

pub use fold::{FoldedBin, fold, maxima, mean_curve};
pub use types::{
    Alias, Candidate, Cause, Method, Note, Options, PeriodError, Periodogram, Relation, Report, Series, Shape,
    WindowPeak,
};

use candidates::Judge;
use sample::Sample;
use scan::{Grid, scan};
use types::{MAX_FREQUENCIES, MAX_HARMONICS, MIN_POINTS};

/// Longest span that is counted in \[s\].
const MAX_SPAN_S: f64 = 1e15;

/// Search a light curve for periods.
///
/// # Errors
/// [`PeriodError`] if the columns differ in length, an option is out of its range, or the grid would be too large. Data that hold
/// no period are no error: the report then has no candidates, and a note says why.
pub fn search(series: &Series, options: &Options) -> Result<Report, PeriodError> {
    check(options)?;
    let sample = Sample::new(series)?;
    let mut report = Report {
        points: sample.points(),
        excluded: sample.excluded,
        span_s: sample.span_s(),
        mean: sample.mean,
        chi2_constant: (sample.yy * sample.chi2_unit).min(f64::MAX),
        ..Report::default()
    };
    if sample.excluded > 0 {
        report.notes.push(Note::Excluded(sample.excluded));
    }
    let nothing = match sample.median_gap_s() {
        _ if sample.points() < MIN_POINTS => Some(Note::TooFewPoints(sample.points())),
        None => Some(Note::NoSpan),
        Some(_) if sample.is_constant() => Some(Note::Constant),
        Some(_) => None,
    };
    if let Some(note) = nothing {
        report.notes.push(note);
        return Ok(report);
    }
    let grid = grid(&sample, options, &mut report.notes)?;
    let judge = Judge::new(&sample, grid, options);
    if judge.harmonics < options.harmonics {
        report.notes.push(Note::FewerHarmonics(judge.harmonics));
    }
    if judge.pdm.is_some() && !judge.pdm_everywhere() {
        report.notes.push(Note::PdmAtCandidatesOnly);
    }
    let spectrum = scan(&sample, &grid, judge.harmonics);
    report.window = alias::window_peaks(&sample, &grid, &spectrum);
    report.candidates = judge.candidates(&spectrum, &report.window, options.max_candidates);
    report.periodogram = peaks::thin(&grid, &spectrum, options.plot_points);
    (report.min_period_s, report.max_period_s) = (1.0 / grid.last_hz(), 1.0 / grid.first_hz);
    (report.frequencies, report.harmonics) = (grid.count, judge.harmonics);
    report.significant = report.candidates.first().is_some_and(|c| c.false_alarm < options.false_alarm);
    match report.candidates.first().filter(|_| report.significant) {
        None => report.notes.push(Note::NothingSignificant),
        Some(best) => {
            report.aliases = alias::aliases(&sample, best, judge.harmonics, &report.window);
            report.notes.extend(remarks(&sample, &grid, best, &report.window));
        }
    }
    Ok(report)
}

/// Power of `harmonics` (1 to 8) at given frequencies \[Hz\], above zero, by direct sums: the reference of the fast method.
///
/// # Errors
/// [`PeriodError`] if the columns differ in length, or the number of harmonics or a frequency is out of its range.
pub fn power(series: &Series, frequencies_hz: &[f64], harmonics: usize) -> Result<Vec<f64>, PeriodError> {
    check(&Options { harmonics, ..Options::default() })?;
    let sample = Sample::new(series)?;
    let constant = sample.is_constant();
    let one = |f: &f64| match f {
        f if !(*f > 0.0 && f.is_finite()) => {
            Err(PeriodError::Option { name: "frequency", value: *f, allowed: "above zero" })
        }
        _ if constant => Ok(0.0),
        f => Ok(harmonic::power_at(&sample, *f, harmonics)),
    };
    frequencies_hz.iter().map(one).collect()
}

/// All options within their ranges.
fn check(options: &Options) -> Result<(), PeriodError> {
    let count = |name, value: usize, low: usize, high: usize, allowed| {
        let value_f = value as f64;
        if (low..=high).contains(&value) {
            Ok(())
        } else {
            Err(PeriodError::Option { name, value: value_f, allowed })
        }
    };
    count("harmonics", options.harmonics, 1, MAX_HARMONICS, "1 to 8")?;
    count("pdm_bins", options.pdm_bins.unwrap_or(10), 3, 200, "3 to 200")?;
    count("pdm_covers", options.pdm_covers, 1, 10, "1 to 10")?;
    count("max_frequencies", options.max_frequencies, 1, MAX_FREQUENCIES, "1 to 50,000,000")?;
    count("max_candidates", options.max_candidates, 1, 50, "1 to 50")?;
    let real = |name, value: f64, fine: bool, allowed| {
        if fine { Ok(()) } else { Err(PeriodError::Option { name, value, allowed }) }
    };
    let oversampling = options.oversampling;
    real("oversampling", oversampling, (2.0..=100.0).contains(&oversampling), "2 to 100")?;
    real("false_alarm", options.false_alarm, (0.0..=1.0).contains(&options.false_alarm), "0 to 1")?;
    for (name, period) in [("min_period_s", options.min_period_s), ("max_period_s", options.max_period_s)] {
        if let Some(period) = period {
            real(name, period, period > 0.0 && period.is_finite(), "above zero")?;
        }
    }
    match (options.min_period_s, options.max_period_s) {
        (Some(min), Some(max)) => real("max_period_s", max, max > min, "above min_period_s"),
        _ => Ok(()),
    }
}

/// The grid of frequencies: from the span and the median gap, or as asked for.
fn grid(sample: &Sample, options: &Options, notes: &mut Vec<Note>) -> Result<Grid, PeriodError> {
    let span = sample.span_s();
    if span.is_nan() || span >= MAX_SPAN_S {
        return Err(PeriodError::Span(span));
    }
    let step_hz = 1.0 / (options.oversampling * span);
    let min_period = options.min_period_s.or_else(|| sample.median_gap_s().map(|gap| 2.0 * gap)).unwrap_or(span);
    let max_period = options.max_period_s.unwrap_or(span);
    let (first_hz, last_hz) = (1.0 / max_period, 1.0 / min_period);
    if last_hz.is_nan() || last_hz <= first_hz {
        let (name, value) =
            options.min_period_s.map_or(("max_period_s", max_period), |period| ("min_period_s", period));
        return Err(PeriodError::Option {
            name,
            value,
            allowed: "min_period_s (default: twice the median gap) below max_period_s (default: the span)",
        });
    }
    let needed = ((last_hz - first_hz) / step_hz).ceil() + 1.0;
    let limit = options.max_frequencies;
    if needed <= limit as f64 {
        return Ok(Grid { first_hz, step_hz, count: needed as usize });
    }
    if let Some(min_period_s) = options.min_period_s {
        return Err(PeriodError::TooManyFrequencies { min_period_s, span_s: span, needed, limit });
    }
    let grid = Grid { first_hz, step_hz, count: limit };
    notes.push(Note::ShortPeriodsLeftOut(1.0 / grid.last_hz()));
    Ok(grid)
}

/// What a user should know of the best candidate.
fn remarks(sample: &Sample, grid: &Grid, best: &Candidate, window: &[WindowPeak]) -> Vec<Note> {
    let resolution = 1.0 / sample.span_s();
    let mut notes = Vec::new();
    if best.frequency_hz < 2.0 * resolution {
        notes.push(Note::FewerThanTwoTurns);
    }
    if let Some(peak) = window.iter().find(|p| (1.0 / p.period_s - best.frequency_hz).abs() < resolution) {
        notes.push(Note::PeriodOfSampling(peak.period_s));
    }
    let edge = |hz: f64| (hz - best.frequency_hz).abs() < 0.5 * grid.step_hz;
    if edge(grid.first_hz) || edge(grid.last_hz()) {
        notes.push(Note::EdgeOfRange);
    }
    notes
}
