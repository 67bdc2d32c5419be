//! Periods that the data may have: peaks of all methods and their multiples, refined, merged, and put in order.
//!
//! At each frequency the folded curve is described by 1..K harmonics and by means in bins of phase. The description chosen is
//! that of the least Bayesian information criterion (Schwarz 1978, Ann. Stat. 6, 461), N ln(chi2 / N) + q ln N with q parameters, and
//! candidates are put in order by it: a curve with two unlike maxima per turn needs more harmonics at P than at P/2, and gets
//! them if they pay; at 2P the same curve costs twice as many and gains nothing.

use super::false_alarm::false_alarm;
use super::fold::{fold, maxima, mean_curve};
use super::harmonic::{Fit, climb, frequency_error, functions};
use super::pdm::{Dispersion, Pdm};
use super::peaks::highest;
use super::sample::Sample;
use super::scan::{Grid, Spectrum};
use super::types::{Candidate, MAX_HARMONICS, Method, Options, Shape, WindowPeak};

/// Peaks taken from each method.
const PEAKS: usize = 8;
/// Multiples of so many of the best are tried.
const MULTIPLIED: usize = 3;
/// The best is replaced by a better image of itself up to so many times: noise, and a grid that is coarse for high harmonics, may have
/// put a neighbour first.
const WALKS: usize = 5;
/// A fraction of the best period is preferred unless the criterion is worse by this: very strong evidence (Kass & Raftery 1995, JASA
/// 90, 773, sect. 3.2). Otherwise noise would double the period in a few curves of a hundred.
const VERY_STRONG: f64 = 10.0;
/// Peaks of the spectral window whose images are tried.
const IMAGES: usize = 3;
/// Frequencies nearer than this over the span are the same.
const SAME: f64 = 0.3;
/// Chi-square below this share of that of a constant is rounding.
const ROUNDING: f64 = 1e-13;
/// Points times frequencies up to which PDM searches all frequencies.
const PDM_WORK: f64 = 3e8;

/// Harmonics up to `most` that `points` allow: three points per parameter, but one harmonic always.
fn harmonics_for(points: usize, most: usize) -> usize {
    most.min((points / 3).saturating_sub(1) / 2).max(1)
}

/// Give a method to the candidate within `reach_hz`, if there is one.
fn merge(found: &mut [Candidate], hz: f64, reach_hz: f64, method: Method) -> bool {
    let same = found.iter_mut().find(|c| (c.frequency_hz - hz).abs() < reach_hz);
    if let Some(same) = same {
        if method != Method::Alias && !same.found_by.contains(&method) {
            same.found_by.push(method);
        }
        return true;
    }
    false
}

/// All that candidates are judged by.
#[derive(Debug, Clone, Copy)]
pub struct Judge<'a> {
    /// The light curve.
    pub sample: &'a Sample,
    /// Frequencies searched.
    pub grid: Grid,
    /// Harmonics of the search.
    pub harmonics: usize,
    /// Phase-dispersion minimisation, if it takes part.
    pub pdm: Option<Pdm>,
    /// False-alarm probability below which a period is claimed.
    pub false_alarm: f64,
}

impl<'a> Judge<'a> {
    /// With as many harmonics and bins as the points allow: three points per parameter of a series, two per bin.
    pub fn new(sample: &'a Sample, grid: Grid, options: &Options) -> Self {
        let n = sample.points();
        let harmonics = harmonics_for(n, options.harmonics);
        let bins = options.pdm_bins.unwrap_or((n / 10).clamp(5, 50)).min((n / 2).max(3));
        let pdm = options.pdm.then_some(Pdm { bins, covers: options.pdm_covers });
        Self { sample, grid, harmonics, pdm, false_alarm: options.false_alarm }
    }

    /// Whether PDM can search all frequencies.
    pub fn pdm_everywhere(&self) -> bool {
        self.sample.points() as f64 * self.grid.count as f64 <= PDM_WORK
    }

    /// The candidates, the best first, at most `count`.
    pub fn candidates(&self, spectrum: &Spectrum, window: &[WindowPeak], count: usize) -> Vec<Candidate> {
        let mut found = Vec::new();
        for (hz, method) in self.peaks(spectrum) {
            self.add(&mut found, hz, method);
        }
        self.sort(&mut found);
        let best = found.iter().take(MULTIPLIED).map(|c| c.frequency_hz).collect::<Vec<_>>();
        for hz in best {
            for ratio in [0.5, 1.0 / 3.0, 0.25, 2.0, 3.0, 4.0] {
                self.add(&mut found, hz * ratio, Method::Alias);
            }
        }
        self.sort(&mut found);
        let mut walked = 0.0;
        for _ in 0..WALKS {
            let Some(hz) = found.first().map(|c| c.frequency_hz).filter(|hz| *hz != walked) else { break };
            walked = hz;
            for peak in window.iter().take(IMAGES) {
                for order in [-1.0, 1.0, -2.0, 2.0] {
                    self.add(&mut found, (hz + order / peak.period_s).abs(), Method::Alias);
                }
            }
            self.sort(&mut found);
        }
        self.prefer_fraction(&mut found);
        found.truncate(count);
        found
    }

    /// Significant ones first, then by criterion.
    fn sort(&self, found: &mut [Candidate]) {
        let key = |c: &Candidate| (c.false_alarm >= self.false_alarm, c.bic);
        found.sort_by(|a, b| {
            let (a, b) = (key(a), key(b));
            a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
        });
    }

    /// Put the shortest fraction of the best period first that is nearly as good.
    fn prefer_fraction(&self, found: &mut [Candidate]) {
        let Some((hz, bic)) = found.first().map(|best| (best.frequency_hz, best.bic)) else { return };
        let resolution = SAME / self.sample.span_s();
        let is_fraction = |c: &Candidate| {
            let ratio = (c.frequency_hz / hz).round();
            ratio >= 2.0 && (c.frequency_hz - ratio * hz).abs() < ratio * resolution
        };
        let as_good = |c: &Candidate| c.bic < bic + VERY_STRONG && c.false_alarm < self.false_alarm;
        let fractions = found.iter().enumerate().filter(|(_, c)| is_fraction(c) && as_good(c));
        let shortest = fractions.max_by(|a, b| a.1.frequency_hz.total_cmp(&b.1.frequency_hz));
        if let Some((i, _)) = shortest {
            found[..=i].rotate_right(1);
        }
    }

    /// Peaks of all methods.
    fn peaks(&self, spectrum: &Spectrum) -> Vec<(f64, Method)> {
        let apart = (1.0 / (self.grid.step_hz * self.sample.span_s())).ceil() as usize;
        let mut peaks = Vec::new();
        let mut take = |values: &[f64], method| {
            peaks.extend(highest(values, PEAKS, apart).iter().map(|i| (self.grid.frequency(*i), method)));
        };
        take(&spectrum.multi, Method::MultiHarmonic);
        take(&spectrum.single, Method::LombScargle);
        if let Some(pdm) = self.pdm.filter(|_| self.pdm_everywhere()) {
            let mut scratch = Vec::new();
            let at = |i: usize| -pdm.at(self.sample, self.grid.frequency(i), &mut scratch).theta;
            let depth = (0..self.grid.count).map(at).collect::<Vec<_>>();
            take(&depth, Method::PhaseDispersion);
        }
        peaks
    }

    /// Refine and judge a frequency, or give its method to the candidate that is there already.
    fn add(&self, found: &mut Vec<Candidate>, hz: f64, method: Method) {
        let resolution = SAME / self.sample.span_s();
        let (first, last) = (self.grid.first_hz, self.grid.last_hz());
        if !(hz > first - resolution && hz < last + resolution) {
            return;
        }
        if merge(found, hz, 0.5 * resolution, method) {
            return;
        }
        let step = self.grid.step_hz.min(0.25 / (self.sample.span_s() * self.harmonics as f64));
        let details = match method {
            Method::PhaseDispersion | Method::Alias => self.details(),
            Method::LombScargle | Method::MultiHarmonic => self.harmonics,
        };
        let (top, _) = climb(self.sample, hz, step, details);
        let top = top.clamp(first, last);
        if merge(found, top, resolution, method) {
            return;
        }
        found.push(self.judge(top, step, method));
    }

    /// Harmonics by which a period is refined whose curve bins describe: all that the points allow.
    fn details(&self) -> usize {
        self.pdm.map_or(self.harmonics, |_| harmonics_for(self.sample.points(), MAX_HARMONICS))
    }

    /// N ln(chi2 / N) + q ln N, chi-square as a share of the constant's.
    fn criterion(&self, left: f64, parameters: f64) -> f64 {
        let n = self.sample.points() as f64;
        n * left.max(ROUNDING).ln() + parameters * n.ln()
    }

    /// Describe the curve at a frequency.
    fn judge(&self, hz: f64, step: f64, method: Method) -> Candidate {
        let sample = self.sample;
        let mut fit = Fit::new(self.harmonics);
        let mut describe = |hz: f64| {
            fit.sum(sample, hz);
            fit.solve();
            let bic = |k: usize| self.criterion(1.0 - fit.power(k, sample), 2.0 * k as f64 + 2.0);
            let best = (1..=self.harmonics).map(|k| (k, bic(k))).min_by(|a, b| a.1.total_cmp(&b.1));
            best.unwrap_or((1, bic(1)))
        };
        let disperse = |hz: f64| self.pdm.map(|pdm| (pdm, pdm.at(sample, hz, &mut Vec::new())));
        let binned = |d: &Dispersion| self.criterion(d.left, d.filled + 1.0);
        let (k, bic) = describe(hz);
        let sharp = disperse(hz).is_some_and(|(_, d)| binned(&d) < bic);
        let details = if sharp { self.details() } else { k };
        let (hz, _) = climb(sample, hz, 0.25 * step, details);
        let hz = hz.clamp(self.grid.first_hz, self.grid.last_hz());
        let (k, mut bic) = describe(hz);

        let mut shape = Shape::Harmonics(k);
        let (mut left, mut parameters) = (1.0 - fit.power(k, sample), 2.0 * k as f64 + 2.0);
        let dispersion = disperse(hz);
        if let Some((pdm, d)) = dispersion.filter(|(_, d)| binned(d) < bic) {
            (shape, bic, left, parameters) = (Shape::Bins(pdm.bins), binned(&d), d.left, d.filled + 1.0);
        }
        let chi2 = left * sample.yy * sample.chi2_unit;
        // the frequency is a parameter, the noise is not
        let reduced_chi2 = chi2 / (sample.points() as f64 - parameters).max(1.0);
        let noise = reduced_chi2.max(1.0);
        let (amplitude, amplitude_err, maxima) = self.curve(hz, &fit, shape, noise);
        let frequency_err = frequency_error(sample, hz, details, noise);
        Candidate {
            period_s: 1.0 / hz,
            period_err_s: (frequency_err / (hz * hz)).min(f64::MAX),
            frequency_hz: hz,
            found_by: vec![method],
            power_single: fit.power(1, sample),
            power_multi: fit.power(self.harmonics, sample),
            theta: dispersion.map(|(_, d)| d.theta),
            false_alarm: self
                .false_alarm(&fit, dispersion.map(|(pdm, d)| pdm.false_alarm(&d, sample.points(), self.turns()))),
            shape,
            bic,
            chi2,
            reduced_chi2,
            amplitude,
            amplitude_err,
            maxima,
        }
    }

    /// Width of the band searched times the span.
    fn turns(&self) -> f64 {
        (self.grid.last_hz() - self.grid.first_hz) * self.sample.span_s()
    }

    /// The least of the methods' probabilities, times their number.
    fn false_alarm(&self, fit: &Fit, pdm: Option<f64>) -> f64 {
        let band = self.grid.last_hz() - self.grid.first_hz;
        let (points, spread) = (self.sample.points(), self.sample.time_spread_s());
        let of = |k: usize| false_alarm(fit.power(k, self.sample), points, k, band, spread);
        let several = (self.harmonics > 1).then(|| of(self.harmonics));
        let all = [Some(of(1)), several, pdm];
        let used = all.iter().flatten().count() as f64;
        all.into_iter().flatten().fold(1.0f64, |least, p| least.min(p * used))
    }

    /// Amplitude and its error in the values' unit, and the number of maxima.
    fn curve(&self, hz: f64, fit: &Fit, shape: Shape, noise: f64) -> (f64, f64, usize) {
        let sample = self.sample;
        let unit = noise.sqrt() / sample.chi2_unit.sqrt();
        let sigma = sample.w.iter().map(|w| unit / w.sqrt()).collect::<Vec<_>>();
        let phases = fold(&sample.t, 1.0 / hz, 0.0);
        let bins = match shape {
            Shape::Bins(bins) => bins,
            Shape::Harmonics(_) => (sample.points() / 10).clamp(6, 50),
        };
        let means = mean_curve(&phases, &sample.y, &sigma, bins);
        let count = maxima(&means);
        let (height, err) = match shape {
            Shape::Bins(_) => {
                let filled = || means.iter().filter(|b| b.points > 0);
                let high = filled().max_by(|a, b| a.mean.total_cmp(&b.mean));
                let low = filled().min_by(|a, b| a.mean.total_cmp(&b.mean));
                high.zip(low).map_or((0.0, 0.0), |(a, b)| (a.mean - b.mean, a.err.hypot(b.err)))
            }
            Shape::Harmonics(k) => {
                let coefficients = fit.coefficients(k);
                let value = |g: &[f64]| g.iter().zip(&coefficients).map(|(g, c)| g * c).sum::<f64>();
                let turn = || (0..90 * k).map(|i| functions(i as f64 / (90 * k) as f64, k));
                let ends = turn().fold(None, |ends: Option<[Vec<f64>; 2]>, g| match ends {
                    None => Some([g.clone(), g]),
                    Some([low, high]) if value(&g) < value(&low) => Some([g, high]),
                    Some([low, high]) if value(&g) > value(&high) => Some([low, g]),
                    same => same,
                });
                ends.map_or((0.0, 0.0), |[low, high]| {
                    let difference = high.iter().zip(&low).map(|(h, l)| h - l).collect::<Vec<_>>();
                    (value(&difference), unit * fit.variance(&difference).sqrt())
                })
            }
        };
        ((height * sample.scale).min(f64::MAX), (err * sample.scale).min(f64::MAX), count)
    }
}
