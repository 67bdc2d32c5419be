//! What a picture of a fit draws, and where: panels of time, scales of flux, and which points of many.

use std::collections::BTreeMap;

/// A measurement and what the model says of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitPoint {
    /// Time \[s\], from any origin.
    pub time_s: f64,
    /// Flux, in any unit.
    pub flux: f64,
    /// Its standard error, positive, in the same unit.
    pub sigma: f64,
    /// Flux of the model.
    pub model: f64,
    /// Whether it was kept from the fit to test it.
    pub held_out: bool,
    /// Number of the light curve.
    pub curve: usize,
}

/// Gaps longer than this many times a curve's median step begin a new panel.
const GAP: f64 = 20.0;
/// Most panels that are drawn.
pub(super) const MOST_PANELS: usize = 48;
/// Most epochs that are drawn, and most of those beyond 3 sigma among them.
const MOST_POINTS: usize = 3000;
const MOST_OUTLIERS: usize = 500;
/// Residuals beyond this are outliers \[sigma\].
pub(super) const OUTLIER: f64 = 3.0;
/// Values of this size and beyond are not drawn: an axis could not hold them.
const ABSURD: f64 = 1e100;
/// Ratio of the median fluxes of curves beyond which each is drawn in units of its own.
const UNEQUAL: f64 = 5.0;

/// A point with its residual, in units of its panel's flux.
#[derive(Debug, Clone, Copy)]
pub(super) struct Datum {
    pub time_s: f64,
    pub flux: f64,
    pub sigma: f64,
    pub model: f64,
    /// Flux minus model \[sigma\].
    pub z: f64,
    pub held_out: bool,
    /// Whether its mark is drawn.
    pub drawn: bool,
}

/// A stretch of one curve without long gaps.
#[derive(Debug, Clone)]
pub(super) struct Panel {
    pub curve: usize,
    /// Points in the order of time.
    pub data: Vec<Datum>,
}

impl Panel {
    /// First and last time \[s\].
    pub fn ends(&self) -> (f64, f64) {
        let at = |datum: Option<&Datum>| datum.map_or(0.0, |d| d.time_s);
        (at(self.data.first()), at(self.data.last()))
    }

    /// Duration \[s\].
    pub fn span(&self) -> f64 {
        let (first, last) = self.ends();
        last - first
    }
}

/// Everything that is drawn.
#[derive(Debug, Clone, Default)]
pub(super) struct Plan {
    /// By curve, then by time; all of them, drawn or not.
    pub panels: Vec<Panel>,
    /// Points that are left out: a value is not finite or absurd, or the error not positive.
    pub left_out: usize,
    /// One of this many points is drawn; beyond 3 sigma all, or the first so many.
    pub step: usize,
    /// Whether fluxes are in units of the median of their curve.
    pub own_units: bool,
}

impl Plan {
    pub fn of(points: &[FitPoint]) -> Self {
        let mut curves: BTreeMap<usize, Vec<Datum>> = BTreeMap::new();
        let mut plan = Self { step: 1, ..Self::default() };
        for point in points {
            match datum(point) {
                Some(datum) => curves.entry(point.curve).or_default().push(datum),
                None => plan.left_out += 1,
            }
        }
        let scales = curves.values().map(|data| median(data.iter().map(|d| d.flux.abs()))).collect::<Vec<_>>();
        let (low, high) = scales.iter().fold((f64::MAX, 0.0f64), |(l, h), s| (l.min(*s), h.max(*s)));
        plan.own_units = low > 0.0 && high / low > UNEQUAL;
        for ((curve, mut data), scale) in curves.into_iter().zip(scales) {
            data.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
            if plan.own_units {
                for d in &mut data {
                    (d.flux, d.sigma, d.model) = (d.flux / scale, d.sigma / scale, d.model / scale);
                }
            }
            let gap = GAP * median(data.windows(2).map(|w| w[1].time_s - w[0].time_s));
            let parts = data.chunk_by(|a, b| b.time_s - a.time_s <= gap);
            plan.panels.extend(parts.map(|part| Panel { curve, data: part.to_vec() }));
        }
        plan.thin();
        plan
    }

    /// All points.
    pub fn data(&self) -> impl Iterator<Item = &Datum> + Clone {
        self.panels.iter().flat_map(|panel| &panel.data)
    }

    /// Panels that are drawn.
    pub fn shown(&self) -> &[Panel] {
        self.panels.get(..MOST_PANELS).unwrap_or(&self.panels)
    }

    fn thin(&mut self) {
        let count = self.shown().iter().map(|panel| panel.data.len()).sum::<usize>();
        self.step = count.div_ceil(MOST_POINTS).max(1);
        let mut outliers = 0;
        for (k, datum) in self.panels.iter_mut().flat_map(|panel| &mut panel.data).enumerate() {
            let far = datum.z.abs() > OUTLIER && outliers < MOST_OUTLIERS;
            outliers += usize::from(far);
            datum.drawn = k % self.step == 0 || far;
        }
    }
}

fn datum(p: &FitPoint) -> Option<Datum> {
    let z = (p.flux - p.model) / p.sigma;
    let sound = [p.time_s, p.flux, p.sigma, p.model, z].iter().all(|v| v.abs() < ABSURD) && p.sigma > 0.0;
    let FitPoint { time_s, flux, sigma, model, held_out, .. } = *p;
    sound.then_some(Datum { time_s, flux, sigma, model, z, held_out, drawn: true })
}

/// The median; 0 for none.
pub(super) fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values = values.collect::<Vec<_>>();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}
