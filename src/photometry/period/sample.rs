//! A light curve made ready: usable points in order of time, counted from the first, weights that sum to one, and values about
//! their weighted mean in units of the largest deviation, so that no square overflows.

use super::types::{PeriodError, Series};

/// Scatter below this share of the largest value is rounding, not light.
const ROUNDING: f64 = 1e-14;

/// Usable points of a light curve.
#[derive(Debug, Clone)]
pub struct Sample {
    /// Seconds since the first, ascending.
    pub t: Vec<f64>,
    /// Values less their weighted mean, in units of `scale`.
    pub y: Vec<f64>,
    /// Weights 1 / sigma^2, of sum one.
    pub w: Vec<f64>,
    /// Time of the first \[s\].
    pub start_s: f64,
    /// Weighted mean of the values, in their unit.
    pub mean: f64,
    /// Unit of `y`, in the values' unit.
    pub scale: f64,
    /// Sum of w y^2: chi-square of the constant model is this times `chi2_unit`.
    pub yy: f64,
    /// Sum of 1 / sigma^2 in units of `scale`.
    pub chi2_unit: f64,
    /// Points left out.
    pub excluded: usize,
}

impl Sample {
    /// Take the usable points of a series: finite time, value and error, and an error above zero.
    ///
    /// # Errors
    /// [`PeriodError::Lengths`] if the columns differ in length.
    pub fn new(series: &Series) -> Result<Self, PeriodError> {
        let [time, value, sigma] = [series.time_s.len(), series.value.len(), series.sigma.len()];
        if time != value || time != sigma {
            return Err(PeriodError::Lengths { time, value, sigma });
        }
        let columns = series.time_s.iter().zip(series.value).zip(series.sigma);
        let usable = columns.filter(|((t, y), s)| t.is_finite() && y.is_finite() && s.is_finite() && **s > 0.0);
        let mut points = usable.map(|((t, y), s)| (*t, *y, *s)).collect::<Vec<_>>();
        points.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.total_cmp(&b.2)));

        let start_s = points.first().map_or(0.0, |p| p.0);
        let least = points.iter().fold(f64::INFINITY, |m, p| m.min(p.2));
        let largest = points.iter().fold(f64::MIN_POSITIVE, |m, p| m.max(p.1.abs()));
        let mut w = points.iter().map(|p| (least / p.2).powi(2)).collect::<Vec<_>>();
        let total = w.iter().sum::<f64>();
        w.iter_mut().for_each(|w| *w /= total);

        let mean = points.iter().zip(&w).map(|(p, w)| w * (p.1 / largest)).sum::<f64>();
        let mut y = points.iter().map(|p| p.1 / largest - mean).collect::<Vec<_>>();
        let spread = y.iter().fold(0.0, |m: f64, y| m.max(y.abs()));
        let constant = spread < ROUNDING;
        y.iter_mut().for_each(|y| *y = if constant { 0.0 } else { *y / spread });
        let yy = y.iter().zip(&w).map(|(y, w)| w * y * y).sum();
        let scale = if constant { 1.0 } else { spread * largest };
        let chi2_unit = (total * (scale / least).powi(2)).min(f64::MAX);
        let t = points.iter().map(|p| p.0 - start_s).collect();
        Ok(Self { t, y, w, start_s, mean: mean * largest, scale, yy, chi2_unit, excluded: time - points.len() })
    }

    /// Number of points.
    pub fn points(&self) -> usize {
        self.t.len()
    }

    /// Time from the first to the last \[s\].
    pub fn span_s(&self) -> f64 {
        self.t.last().copied().unwrap_or(0.0)
    }

    /// Median of the gaps above zero between neighbours \[s\]; none without two different times.
    pub fn median_gap_s(&self) -> Option<f64> {
        let gaps = self.t.iter().zip(self.t.iter().skip(1)).map(|(a, b)| b - a);
        let mut gaps = gaps.filter(|g| *g > 0.0).collect::<Vec<_>>();
        let middle = gaps.len() / 2;
        (!gaps.is_empty()).then(|| *gaps.select_nth_unstable_by(middle, f64::total_cmp).1)
    }

    /// Weighted standard deviation of the times \[s\].
    pub fn time_spread_s(&self) -> f64 {
        let mean = self.t.iter().zip(&self.w).map(|(t, w)| w * t).sum::<f64>();
        self.t.iter().zip(&self.w).map(|(t, w)| w * (t - mean).powi(2)).sum::<f64>().sqrt()
    }

    /// Whether all values are the same to rounding.
    pub fn is_constant(&self) -> bool {
        self.yy <= 0.0
    }
}
