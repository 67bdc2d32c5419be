//! The zero point of a frame from its catalogue stars: V = zp - 2.5 log10(flux).
//!
//! The fit is made in flux, not in magnitudes: with r = 10^(-0.4 V), the factor k = sum(w r f) / sum(w r^2) is
//! unbiased for faint stars too, where the logarithm of a noisy flux is off by half its relative variance. Weights
//! are 1 / (sigma^2 + (s k r)^2), with s the relative scatter in excess of the errors (catalogue, colours,
//! scintillation, flat field), fitted so that chi-square equals its degrees of freedom. Stars are admitted
//! by their *predicted* signal, which does not favour lucky ones. Stars off by a factor of two (absent, blended)
//! are left out at once, then those beyond 4 standard deviations.
//!
//! Where the stars ask for it the factor varies: with the square of the distance from the frame's middle (vignetting), along
//! its axes (extinction across the field, an uneven flat), and with colour, `k (1 + sum t_j q_j)`. A term enters if it lowers
//! chi-square by more than the Bayesian information criterion allows (Schwarz 1978, Ann. Stat. 6, 461). The zero point is
//! that of a target with the Sun's colour where it lies.

use super::least_squares::Normal;
use glam::DVec2;

/// Signal-to-noise ratio above which a star is used.
const LEAST_SNR: f64 = 10.0;
/// Magnitudes per relative flux error, 2.5 / ln 10.
pub const MAG_PER_SHARE: f64 = 1.085_736_204_758_129_6;
/// B - V of the Sun (Ramirez et al. 2012, ApJ 752, 5).
const SUN_BV: f64 = 0.653;
/// Terms that enter together: vignetting, the two axes, colour.
const GROUPS: [&[usize]; 3] = [&[0], &[1, 2], &[3]];
/// Stars wanted for each term, beyond as many for the factor.
const STARS_PER_TERM: usize = 6;

/// The measured flux of a catalogue star.
#[derive(Debug, Clone, Copy)]
pub struct StarFlux {
    /// Catalogue magnitude, V.
    pub mag_v: f64,
    /// Colour B - V \[mag\]; NaN if unknown, which counts as the Sun's.
    pub colour_bv: f64,
    /// Place on the frame: -1..1 from border to border.
    pub place: DVec2,
    /// Flux \[e\].
    pub flux_e: f64,
    /// Its standard deviation \[e\].
    pub flux_err_e: f64,
}

/// A zero point.
#[derive(Debug, Clone, PartialEq)]
pub struct ZeroPoint {
    /// Magnitude of 1 electron in the exposure, for the Sun's colour in the middle of the frame; NaN without stars.
    pub mag: f64,
    /// Its standard deviation \[mag\].
    pub err: f64,
    /// Stars used.
    pub n_stars: usize,
    /// Fitted relative scatter beyond the errors.
    pub excess: f64,
    /// Terms that were fitted, by number, with their relative values.
    terms: Vec<(usize, f64)>,
    /// Covariance of the relative factor and the terms.
    covariance: Vec<f64>,
}

/// The terms of a star or a place.
fn terms(place: DVec2, colour_bv: f64) -> [f64; 4] {
    let colour = if colour_bv.is_finite() { colour_bv - SUN_BV } else { 0.0 };
    [place.length_squared(), place.x, place.y, colour]
}

impl ZeroPoint {
    /// No zero point.
    pub const NONE: Self =
        Self { mag: f64::NAN, err: f64::NAN, n_stars: 0, excess: 0.0, terms: Vec::new(), covariance: Vec::new() };

    /// A zero point that is known.
    pub fn known(mag: f64, err: f64) -> Self {
        Self { mag, err, ..Self::NONE }
    }

    /// The same with a relative error common to all stars.
    #[must_use]
    pub fn with_common_error(mut self, share: f64) -> Self {
        self.err = self.err.hypot(MAG_PER_SHARE * share);
        if let Some(factor) = self.covariance.first_mut() {
            *factor += share * share;
        }
        self
    }

    /// The zero point at a place of the frame, -1..1 from border to border, and its standard deviation \[mag\].
    pub fn at(&self, place: DVec2) -> (f64, f64) {
        let q = terms(place, SUN_BV);
        let row = std::iter::once(1.0).chain(self.terms.iter().map(|(j, _)| q[*j])).collect::<Vec<_>>();
        let factor = 1.0 + self.terms.iter().map(|(j, t)| t * q[*j]).sum::<f64>();
        let n = row.len();
        let variance: f64 =
            self.covariance.iter().enumerate().map(|(i, c)| c * row[i / n] * row[i % n]).sum::<f64>();
        let usable = factor > 0.2 && self.covariance.len() == n * n;
        if usable {
            (self.mag + 2.5 * factor.log10(), MAG_PER_SHARE * variance.max(0.0).sqrt() / factor)
        } else {
            (self.mag, self.err)
        }
    }
}

/// A star in the fit.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Row {
    /// Expected flux relative to magnitude 10.
    r: f64,
    flux: f64,
    err: f64,
    q: [f64; 4],
}

/// A factor and its terms.
#[derive(Debug, Clone)]
struct Model {
    k: f64,
    terms: Vec<(usize, f64)>,
}

impl Model {
    fn expected(&self, row: &Row) -> f64 {
        self.k * row.r * (1.0 + self.terms.iter().map(|(j, t)| t * row.q[*j]).sum::<f64>())
    }

    fn variance(&self, row: &Row, excess: f64) -> f64 {
        row.err * row.err + (excess * self.expected(row)).powi(2)
    }

    fn chi2(&self, rows: &[Row], excess: f64) -> f64 {
        rows.iter().map(|row| (row.flux - self.expected(row)).powi(2) / self.variance(row, excess)).sum()
    }

    /// The same terms fitted to rows weighted by this model, and the covariance of factor and terms relative to the factor.
    fn fitted(&self, rows: &[Row], excess: f64) -> Option<(Self, Vec<f64>)> {
        let n = self.terms.len() + 1;
        let mut normal = Normal::new(n);
        for row in rows {
            let derivatives = std::iter::once(row.r).chain(self.terms.iter().map(|(j, _)| row.r * row.q[*j]));
            normal.add(&derivatives.collect::<Vec<_>>(), row.flux, 1.0 / self.variance(row, excess));
        }
        let (solution, covariance) = normal.solve()?;
        let k = solution[0];
        let terms = self.terms.iter().zip(&solution[1..]).map(|((j, _), v)| (*j, v / k)).collect();
        (k > 0.0).then(|| (Self { k, terms }, covariance.into_iter().map(|c| c / (k * k)).collect()))
    }
}

/// The zero point of `stars`; `least_excess` is the relative scatter known to be there (scintillation).
pub fn fit(stars: &[StarFlux], least_excess: f64) -> ZeroPoint {
    let usable = stars.iter().filter(|s| s.mag_v.is_finite() && s.flux_e.is_finite() && s.flux_err_e > 0.0);
    let row = |s: &StarFlux| Row {
        // relative to magnitude 10 numbers stay near 1
        r: 10f64.powf(-0.4 * (s.mag_v - 10.0)),
        flux: s.flux_e,
        err: s.flux_err_e,
        q: terms(if s.place.is_finite() { s.place } else { DVec2::ZERO }, s.colour_bv),
    };
    let rows = usable.map(row).collect::<Vec<_>>();
    let mut ratios: Vec<f64> = rows
        .iter()
        .filter(|row| row.flux > LEAST_SNR * row.err)
        .map(|row| row.flux / row.r)
        .filter(|k| k.is_finite())
        .collect();
    if ratios.is_empty() {
        return ZeroPoint::NONE;
    }
    ratios.sort_by(f64::total_cmp);
    let mut model = Model { k: ratios[ratios.len() / 2], terms: Vec::new() };
    let Some((mut kept, mut excess)) = settle(&rows, &mut model, least_excess) else { return ZeroPoint::NONE };
    for group in GROUPS {
        let mut richer = model.clone();
        richer.terms.extend(group.iter().map(|j| (*j, 0.0)));
        if kept.len() < STARS_PER_TERM * (richer.terms.len() + 1) {
            continue;
        }
        let allowed = (kept.len() as f64).ln() * group.len() as f64;
        let better = richer.fitted(&kept, excess).map(|(m, _)| m);
        if let Some(better) = better.filter(|m| model.chi2(&kept, excess) - m.chi2(&kept, excess) > 2.0 * allowed)
        {
            model = better;
            match settle(&rows, &mut model, least_excess) {
                Some(settled) => (kept, excess) = settled,
                None => return ZeroPoint::NONE,
            }
        }
    }
    let Some((model, covariance)) = model.fitted(&kept, excess) else { return ZeroPoint::NONE };
    let err = MAG_PER_SHARE * covariance.first().map_or(f64::NAN, |v| v.sqrt());
    let mag = 10.0 + 2.5 * model.k.log10();
    ZeroPoint { mag, err, n_stars: kept.len(), excess, terms: model.terms, covariance }
}

/// Admits stars and fits the model to them until both stand still; the stars and the excess scatter.
fn settle(rows: &[Row], model: &mut Model, least_excess: f64) -> Option<(Vec<Row>, f64)> {
    let mut excess = least_excess.max(0.0);
    let mut kept: Vec<Row> = Vec::new();
    for _ in 0..12 {
        let admitted = rows.iter().copied().filter(|row| {
            let expected = model.expected(row);
            let z = (row.flux - expected) / model.variance(row, excess.max(0.005)).sqrt();
            let gross = row.flux < 0.5 * expected || row.flux > 2.0 * expected;
            expected > LEAST_SNR * row.err && !gross && (z.abs() < 4.0 || kept.is_empty())
        });
        let now = admitted.collect::<Vec<_>>();
        if now.is_empty() {
            return None;
        }
        let settled = now == kept;
        kept = now;
        for _ in 0..5 {
            if let Some((fitted, _)) = model.fitted(&kept, excess) {
                *model = fitted;
            }
            excess = fitted_excess(&kept, model, least_excess);
        }
        if settled {
            break;
        }
    }
    Some((kept, excess))
}

/// The relative scatter with which chi-square equals its degrees of freedom, by bisection up to 0.5.
fn fitted_excess(rows: &[Row], model: &Model, least: f64) -> f64 {
    let least = least.max(0.0);
    let freedom = rows.len() as f64 - 1.0 - model.terms.len() as f64;
    if freedom < 2.0 || model.chi2(rows, least) <= freedom {
        return least;
    }
    let (mut low, mut high) = (least, 0.5f64.max(least));
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if model.chi2(rows, middle) > freedom { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::random::{Address, Stage};
    use crate::base::sample::{normal, uniform};

    fn stars(seed: u64, n: u64, absent: f64, scatter: f64) -> Vec<StarFlux> {
        let place = Address { seed, frame: 0, stage: Stage::RandomStars };
        let noise = Address { seed, frame: 0, stage: Stage::Read };
        let star = |i: u64| {
            let mag_v = 8.0 + 5.0 * uniform(place.block(i, 0)[0]);
            let there = uniform(place.block(i, 0)[1]) >= absent;
            let flux = if there { 10f64.powf(-0.4 * (mag_v - 22.0)) } else { 0.0 };
            let flux_err_e = (flux + 4e4).sqrt();
            let light = flux * (1.0 + scatter * normal(&noise, 2 * i));
            let flux_e = light + flux_err_e * normal(&noise, 2 * i + 1);
            StarFlux { mag_v, colour_bv: f64::NAN, place: DVec2::ZERO, flux_e, flux_err_e }
        };
        (0..n).map(star).collect()
    }

    /// 400 fields: pulls have mean 0 (4 standard errors) and width 1 (within 15 %), absent stars or not.
    #[test]
    fn zero_points_and_their_errors_are_right_with_a_third_of_the_stars_absent() {
        for (absent, scatter) in [(0.0, 0.0), (0.3, 0.0), (0.0, 0.03), (0.3, 0.03)] {
            let pulls = (0..400).map(|seed| {
                let zp = fit(&stars(seed, 40, absent, scatter), 0.0);
                (zp.mag - 22.0) / zp.err
            });
            let pulls = pulls.collect::<Vec<_>>();
            let mean = pulls.iter().sum::<f64>() / 400.0;
            let width = (pulls.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / 399.0).sqrt();
            assert!(mean.abs() < 0.2, "{absent} {scatter}: mean {mean}");
            assert!((0.85..1.15).contains(&width), "{absent} {scatter}: width {width}");
        }
    }

    /// 300 fields with vignetting of 20 % in the corner, a slope of 3 % and 0.05 mag a magnitude of colour: the zero point at a
    /// corner is right for the Sun's colour, and the terms do not enter where they are not.
    #[test]
    fn terms_are_found_where_they_are() {
        for (corner, slope, colour) in [(0.0, 0.0, 0.0), (0.2, 0.03, 0.05)] {
            let place = Address { seed: 5, frame: 0, stage: Stage::Shot };
            let at = DVec2::new(0.9, -0.8);
            let (mut pulls, mut entered) = (Vec::new(), 0);
            for seed in 0..300 {
                let mut field = stars(seed, 80, 0.1, 0.01);
                for (i, star) in field.iter_mut().enumerate() {
                    let draw = |k: u32| uniform(place.block(seed * 1000 + i as u64, k)[0]);
                    star.place = DVec2::new(2.0 * draw(0) - 1.0, 2.0 * draw(1) - 1.0);
                    star.colour_bv = 0.2 + 1.2 * draw(2);
                    let [r2, x, _, c] = terms(star.place, star.colour_bv);
                    star.flux_e *= 1.0 - 0.5 * corner * r2 + slope * x - colour * c / MAG_PER_SHARE;
                }
                let zp = fit(&field, 0.0);
                entered += usize::from(!zp.terms.is_empty());
                let truth = 22.0 + 2.5 * (1.0 - 0.5 * corner * at.length_squared() + slope * at.x).log10();
                let (mag, err) = zp.at(at);
                pulls.push((mag - truth) / err);
            }
            let mean = pulls.iter().sum::<f64>() / 300.0;
            let width = (pulls.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / 299.0).sqrt();
            assert!(mean.abs() < 0.25 && (0.8..1.3).contains(&width), "{corner}: {mean} +- {width}");
            assert!(if corner > 0.0 { entered == 300 } else { entered < 15 }, "{corner}: {entered}");
        }
    }

    #[test]
    fn extremes_give_no_zero_point_and_no_panic() {
        assert_eq!(fit(&[], 0.0).n_stars, 0);
        let odd = |mag_v, flux_e, flux_err_e| StarFlux {
            mag_v,
            colour_bv: f64::NAN,
            place: DVec2::ZERO,
            flux_e,
            flux_err_e,
        };
        let all = [odd(f64::NAN, 1.0, 1.0), odd(10.0, f64::NAN, 1.0), odd(10.0, 1e5, 0.0), odd(10.0, -5.0, 1.0)];
        assert!(fit(&all, f64::NAN).mag.is_nan());
        let one = fit(&[odd(10.0, 1e4, 1.0)], 0.0);
        assert!((one.mag - 20.0).abs() < 1e-12 && one.n_stars == 1);
    }
}
