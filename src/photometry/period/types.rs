//! What a period search takes and gives.

use serde::Serialize;
use std::fmt;

/// Largest number of harmonics of the search.
pub const MAX_HARMONICS: usize = 8;
/// Largest number of frequencies that may be asked for.
pub const MAX_FREQUENCIES: usize = 50_000_000;
/// Fewer usable points than these tell nothing of a period.
pub const MIN_POINTS: usize = 8;

/// A light curve: magnitudes or fluxes, in any order of time.
#[derive(Debug, Clone, Copy)]
pub struct Series<'a> {
    /// Times \[s\], from any origin.
    pub time_s: &'a [f64],
    /// Magnitudes or fluxes.
    pub value: &'a [f64],
    /// Standard errors of the values, in their unit, above zero.
    pub sigma: &'a [f64],
}

/// What to search for.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Shortest period \[s\], above zero; without it twice the median gap.
    pub min_period_s: Option<f64>,
    /// Longest period \[s\]; without it the span.
    pub max_period_s: Option<f64>,
    /// Harmonics of the multi-harmonic periodogram, 1 to 8. Short series get fewer.
    pub harmonics: usize,
    /// Frequencies per 1 / span, 2 to 100.
    pub oversampling: f64,
    /// Bins of the phase-dispersion minimisation, 3 to 200; without it a tenth of the points, 5 to 50.
    pub pdm_bins: Option<usize>,
    /// Covers: how often the bins are shifted within their width, 1 to 10.
    pub pdm_covers: usize,
    /// Whether phase-dispersion minimisation takes part.
    pub pdm: bool,
    /// Most frequencies of the grid, up to [`MAX_FREQUENCIES`]; each takes 24 bytes.
    pub max_frequencies: usize,
    /// Most points of the periodogram in the report.
    pub plot_points: usize,
    /// Most candidates in the report, 1 to 50.
    pub max_candidates: usize,
    /// A period is claimed if its false-alarm probability is below this, 0 to 1.
    pub false_alarm: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            min_period_s: None,
            max_period_s: None,
            harmonics: 4,
            oversampling: 10.0,
            pdm_bins: None,
            pdm_covers: 2,
            pdm: true,
            max_frequencies: 10_000_000,
            plot_points: 4_000,
            max_candidates: 10,
            false_alarm: 0.001,
        }
    }
}

/// What a search cannot work with.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PeriodError {
    /// The columns differ in length.
    #[error("columns of {time} times, {value} values and {sigma} errors; all must be of one length")]
    Lengths {
        /// Number of times.
        time: usize,
        /// Number of values.
        value: usize,
        /// Number of errors.
        sigma: usize,
    },
    /// An option is out of its range.
    #[error("{name} = {value}; allowed is {allowed}")]
    Option {
        /// Which.
        name: &'static str,
        /// What was given.
        value: f64,
        /// The range.
        allowed: &'static str,
    },
    /// The periods asked for need too many frequencies.
    #[error(
        "periods from {min_period_s} s on need {needed:.0} frequencies over a span of {span_s} s; \
         allowed is max_frequencies = {limit}"
    )]
    TooManyFrequencies {
        /// Shortest period asked for \[s\].
        min_period_s: f64,
        /// Span of the series \[s\].
        span_s: f64,
        /// Frequencies needed.
        needed: f64,
        /// Frequencies allowed.
        limit: usize,
    },
    /// The span is too long to count time in.
    #[error("the times span {0} s; allowed is below 1e15 s")]
    Span(f64),
}

/// How a candidate was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Peak of the Lomb-Scargle periodogram with floating mean.
    LombScargle,
    /// Peak of the multi-harmonic periodogram.
    MultiHarmonic,
    /// Minimum of the phase dispersion.
    PhaseDispersion,
    /// A multiple or fraction of another's period, or its image by a periodicity of the sampling.
    Alias,
}

/// The model that describes the folded curve best.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Shape {
    /// A Fourier series of so many harmonics.
    Harmonics(usize),
    /// Means in so many bins of phase: sharper than the harmonics can follow.
    Bins(usize),
}

/// A period that the data may have.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Candidate {
    /// Period \[s\].
    pub period_s: f64,
    /// Its standard error \[s\], from the curvature of chi-square at the best frequency.
    pub period_err_s: f64,
    /// Frequency \[Hz\].
    pub frequency_hz: f64,
    /// Methods that found it.
    pub found_by: Vec<Method>,
    /// Power of one harmonic, 0 to 1: the share of chi-square that it takes away.
    pub power_single: f64,
    /// Power of all harmonics of the search, 0 to 1.
    pub power_multi: f64,
    /// PDM's theta, 1 without a period; none if PDM took no part.
    pub theta: Option<f64>,
    /// False-alarm probability of the three together, 0 to 1: over all frequencies, and over the methods used.
    pub false_alarm: f64,
    /// The folded curve's best model, by the Bayesian information criterion.
    pub shape: Shape,
    /// That criterion, N ln(chi-square / N) + parameters ln N; differences matter.
    pub bic: f64,
    /// Chi-square of that model.
    pub chi2: f64,
    /// Chi-square per degree of freedom.
    pub reduced_chi2: f64,
    /// Largest less smallest value of the model over a turn, in the values' unit. What is narrower than a bin is lowered to its mean there.
    pub amplitude: f64,
    /// Its standard error, in the values' unit.
    pub amplitude_err: f64,
    /// Significant maxima of the folded curve per turn.
    pub maxima: usize,
}

/// Why a period may stand for another.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Relation {
    /// P' = P times `turns` / `parts`.
    Multiple {
        /// Numerator.
        turns: u32,
        /// Denominator.
        parts: u32,
    },
    /// 1/P' = |1/P + `order` / `sampling_s`|: a periodicity of the sampling.
    Sampling {
        /// How many times the sampling frequency is added.
        order: i32,
        /// Period of the sampling \[s\].
        sampling_s: f64,
        /// What has this period.
        cause: Cause,
    },
}

/// Where a periodicity of the sampling comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Cause {
    /// The median gap between points.
    MedianGap,
    /// The mean solar day, 86400 s.
    SolarDay,
    /// The sidereal day, 86164.1 s.
    SiderealDay,
    /// Another peak of the spectral window.
    Window,
}

/// A period that may be mistaken for the best candidate's.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Alias {
    /// Period of the best fit nearby \[s\].
    pub period_s: f64,
    /// How it comes about.
    pub relation: Relation,
    /// Harmonics of the fit: of a multiple so many more, or fewer, that it follows the same details.
    pub harmonics: usize,
    /// Power of that fit, 0 to 1.
    pub power: f64,
    /// Chi-square of that fit.
    pub chi2: f64,
    /// Chi-square less that of the best candidate's period, where errors that are too small are made larger so that the
    /// best fit has one per degree of freedom.
    pub delta_chi2: f64,
    /// Whether that difference is below 9: the data do not tell the two apart.
    pub indistinguishable: bool,
}

/// A peak of the spectral window: a periodicity of the sampling itself.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct WindowPeak {
    /// Period \[s\].
    pub period_s: f64,
    /// |sum w exp(2 pi i f t)|^2, 0 to 1.
    pub power: f64,
    /// What has this period.
    pub cause: Cause,
}

/// The periodogram, for plotting: thinned out so that every peak keeps its height.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Periodogram {
    /// Frequencies \[Hz\], ascending.
    pub frequency_hz: Vec<f64>,
    /// Power of one harmonic, 0 to 1.
    pub power_single: Vec<f64>,
    /// Power of all harmonics, 0 to 1.
    pub power_multi: Vec<f64>,
}

/// What a user should know of a result.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Note {
    /// Too few usable points; nothing was searched.
    TooFewPoints(usize),
    /// All usable points are of one time; nothing was searched.
    NoSpan,
    /// All usable values are equal; nothing was searched.
    Constant,
    /// Points left out: not finite, or an error that is not above zero.
    Excluded(usize),
    /// Fewer harmonics than asked for, for want of points.
    FewerHarmonics(usize),
    /// The shortest period searched \[s\] is longer than twice the median gap, to limit the number of frequencies.
    ShortPeriodsLeftOut(f64),
    /// PDM was computed at the candidates alone, not at all frequencies.
    PdmAtCandidatesOnly,
    /// No period is significant.
    NothingSignificant,
    /// The best period goes into the span less than twice.
    FewerThanTwoTurns,
    /// The best period is a periodicity of the sampling \[s\].
    PeriodOfSampling(f64),
    /// The best period is at the edge of the range searched.
    EdgeOfRange,
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooFewPoints(n) => write!(f, "{n} usable points; a period needs at least {MIN_POINTS}"),
            Self::NoSpan => write!(f, "all usable points have the same time"),
            Self::Constant => write!(f, "the curve is constant"),
            Self::Excluded(n) => write!(f, "{n} points left out: not finite, or without an error above zero"),
            Self::FewerHarmonics(k) => write!(f, "only {k} harmonics, for want of points"),
            Self::ShortPeriodsLeftOut(p) => write!(f, "periods below {p} s left out, to limit the frequencies"),
            Self::PdmAtCandidatesOnly => write!(f, "phase dispersion computed at the candidates only"),
            Self::NothingSignificant => write!(f, "no period is significant"),
            Self::FewerThanTwoTurns => write!(f, "the series covers less than two turns of the best period"),
            Self::PeriodOfSampling(p) => write!(f, "the best period is one of the sampling, {p} s"),
            Self::EdgeOfRange => write!(f, "the best period is at the edge of the range searched"),
        }
    }
}

/// The result of a period search.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Report {
    /// Points used.
    pub points: usize,
    /// Points left out.
    pub excluded: usize,
    /// Time from the first to the last point \[s\].
    pub span_s: f64,
    /// Weighted mean of the values, in their unit.
    pub mean: f64,
    /// Chi-square of a constant.
    pub chi2_constant: f64,
    /// Shortest period searched \[s\]; zero if nothing was.
    pub min_period_s: f64,
    /// Longest period searched \[s\].
    pub max_period_s: f64,
    /// Frequencies searched.
    pub frequencies: usize,
    /// Harmonics of the multi-harmonic periodogram.
    pub harmonics: usize,
    /// Whether the first candidate is significant.
    pub significant: bool,
    /// Periods, the best first by `bic`.
    pub candidates: Vec<Candidate>,
    /// Periods that may be mistaken for the first candidate's, by `delta_chi2`.
    pub aliases: Vec<Alias>,
    /// Peaks of the spectral window, the highest first.
    pub window: Vec<WindowPeak>,
    /// The periodogram.
    pub periodogram: Periodogram,
    /// What a user should know.
    pub notes: Vec<Note>,
}
