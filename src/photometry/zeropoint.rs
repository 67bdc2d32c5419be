//! The zero point of a frame from its catalogue stars: V = zp - 2.5 log10(flux).
//!
//! The fit is made in flux, not in magnitudes: with r = 10^(-0.4 V), the factor k = sum(w r f) / sum(w r^2) is
//! unbiased for faint stars too, where the logarithm of a noisy flux is off by half its relative variance. Weights
//! are 1 / (sigma^2 + (s k r)^2), with s the relative scatter in excess of the errors (catalogue, colours,
//! scintillation, flat field), fitted so that chi-square equals its degrees of freedom. Stars are admitted
//! by their *predicted* signal, which does not favour lucky ones. Stars off by a factor of two (absent, blended)
//! are left out at once, then those beyond 4 standard deviations.

/// Signal-to-noise ratio above which a star is used.
const LEAST_SNR: f64 = 10.0;
/// Magnitudes per relative flux error, 2.5 / ln 10.
pub const MAG_PER_SHARE: f64 = 1.085_736_204_758_129_6;

/// The measured flux of a catalogue star.
#[derive(Debug, Clone, Copy)]
pub struct StarFlux {
    /// Catalogue magnitude, V.
    pub mag_v: f64,
    /// Flux \[e\].
    pub flux_e: f64,
    /// Its standard deviation \[e\].
    pub flux_err_e: f64,
}

/// A zero point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ZeroPoint {
    /// Magnitude of 1 electron in the exposure; NaN without stars.
    pub mag: f64,
    /// Its standard deviation \[mag\].
    pub err: f64,
    /// Stars used.
    pub n_stars: usize,
    /// Fitted relative scatter beyond the errors.
    pub excess: f64,
}

impl ZeroPoint {
    /// No zero point.
    pub const NONE: Self = Self { mag: f64::NAN, err: f64::NAN, n_stars: 0, excess: 0.0 };
}

/// The zero point of `stars`; `least_excess` is the relative scatter known to be there (scintillation).
pub fn fit(stars: &[StarFlux], least_excess: f64) -> ZeroPoint {
    let usable = stars.iter().filter(|s| s.mag_v.is_finite() && s.flux_e.is_finite() && s.flux_err_e > 0.0);
    // r relative to magnitude 10 keeps numbers near 1
    let rows = usable.map(|s| (10f64.powf(-0.4 * (s.mag_v - 10.0)), s.flux_e, s.flux_err_e)).collect::<Vec<_>>();
    let mut ratios: Vec<f64> = rows
        .iter()
        .filter(|(_, f, e)| *f > LEAST_SNR * e)
        .map(|(r, f, _)| f / r)
        .filter(|k| k.is_finite())
        .collect();
    if ratios.is_empty() {
        return ZeroPoint::NONE;
    }
    ratios.sort_by(f64::total_cmp);
    let mut k = ratios[ratios.len() / 2];
    let mut excess = least_excess.max(0.0);
    let mut kept = Vec::new();
    for _ in 0..12 {
        let admitted = rows.iter().copied().filter(|(r, f, e)| {
            let expected = k * r;
            let z = (f - expected) / (e * e + (excess.max(0.005) * expected).powi(2)).sqrt();
            let gross = *f < 0.5 * expected || *f > 2.0 * expected;
            expected > LEAST_SNR * e && !gross && (z.abs() < 4.0 || kept.is_empty())
        });
        let now = admitted.collect::<Vec<_>>();
        if now.is_empty() {
            return ZeroPoint::NONE;
        }
        let settled = now == kept;
        kept = now;
        for _ in 0..5 {
            k = factor(&kept, k, excess);
            excess = fitted_excess(&kept, k, least_excess);
        }
        if settled {
            break;
        }
    }
    let precision: f64 = kept.iter().map(|(r, _, e)| r * r / (e * e + (excess * k * r).powi(2))).sum();
    let err = MAG_PER_SHARE / (k * precision.sqrt());
    ZeroPoint { mag: 10.0 + 2.5 * k.log10(), err, n_stars: kept.len(), excess }
}

fn factor(rows: &[(f64, f64, f64)], k: f64, excess: f64) -> f64 {
    let (mut above, mut below) = (0.0, 0.0);
    for (r, f, e) in rows {
        let w = 1.0 / (e * e + (excess * k * r).powi(2));
        above += w * r * f;
        below += w * r * r;
    }
    if above > 0.0 && below > 0.0 { above / below } else { k }
}

/// The relative scatter with which chi-square equals n - 1, by bisection up to 0.5.
fn fitted_excess(rows: &[(f64, f64, f64)], k: f64, least: f64) -> f64 {
    let least = least.max(0.0);
    let freedom = rows.len() as f64 - 1.0;
    let chi2 =
        |s: f64| rows.iter().map(|(r, f, e)| (f - k * r).powi(2) / (e * e + (s * k * r).powi(2))).sum::<f64>();
    if rows.len() < 3 || chi2(least) <= freedom {
        return least;
    }
    let (mut low, mut high) = (least, 0.5f64.max(least));
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if chi2(middle) > freedom { low = middle } else { high = middle }
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
            StarFlux { mag_v, flux_e: light + flux_err_e * normal(&noise, 2 * i + 1), flux_err_e }
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

    #[test]
    fn extremes_give_no_zero_point_and_no_panic() {
        assert_eq!(fit(&[], 0.0).n_stars, 0);
        let odd = |mag_v, flux_e, flux_err_e| StarFlux { mag_v, flux_e, flux_err_e };
        let all = [odd(f64::NAN, 1.0, 1.0), odd(10.0, f64::NAN, 1.0), odd(10.0, 1e5, 0.0), odd(10.0, -5.0, 1.0)];
        assert!(fit(&all, f64::NAN).mag.is_nan());
        let one = fit(&[odd(10.0, 1e4, 1.0)], 0.0);
        assert!((one.mag - 20.0).abs() < 1e-12 && one.n_stars == 1);
    }
}
