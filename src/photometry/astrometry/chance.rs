//! How easily an alignment arises by chance: a-contrario significance.
//!
//! Were the detections strewn independently of the catalogue, each would lie within t of a star with probability p, the stars'
//! density times pi t^2. Of n detections k match. Two of them fix a similarity, so the expected number of alignments as good as
//! this one among all N that the search allows is
//! `NFA = N P(X >= k - 2), X ~ Binomial(n - 2, p)`
//! (Desolneux, Moisan & Morel 2000, Int. J. Computer Vision 40, 7; Moisan & Stival 2004, Int. J. Computer Vision 57, 201, sect. 2,
//! whose choice among tolerances multiplies N by their number). For unequal p_i their mean bounds the tail above the mean
//! (Hoeffding 1956, Ann. Math. Stat. 27, 713, theorem 4), so that clusters of stars count with their own density.
//! The tolerance is doubled in p, as a fit to all k lies nearer to them than a similarity through the best two.

use super::grid::Grid;
use glam::DVec2;

/// Tolerances tried \[px\].
pub(super) const TOLERANCES: [f64; 8] = [0.25, 0.5, 1.0, 1.5, 2.5, 4.0, 6.0, 9.0];

/// The most significant reading of an alignment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Evidence {
    /// log10 of the expected number of alignments by chance that are as good.
    pub log10_false: f64,
    /// Detections matched, each to a star of its own.
    pub matched: usize,
    /// Detections tried.
    pub tried: usize,
    /// Matches expected by chance.
    pub by_chance: f64,
    /// The tolerance of this reading \[px\].
    pub tolerance: f64,
}

/// ln P(X >= `k`) for X ~ Binomial(`n`, `p`); 0, its upper bound, for `k` up to the mean.
pub(super) fn ln_binomial_tail(n: usize, k: usize, p: f64) -> f64 {
    if k as f64 <= n as f64 * p || p.is_nan() || p >= 1.0 {
        return 0.0;
    }
    if k > n || p <= 0.0 {
        return f64::NEG_INFINITY;
    }
    let ln_choose: f64 = (1..=k).map(|i| ((n - k + i) as f64 / i as f64).ln()).sum();
    let ln_first = ln_choose + k as f64 * p.ln() + (n - k) as f64 * (-p).ln_1p();
    // terms beyond the mean fall by ever larger factors
    let (mut term, mut sum) = (1.0, 1.0);
    for j in k..n {
        term *= (n - j) as f64 / (j + 1) as f64 * p / (1.0 - p);
        sum += term;
        if term < 1e-12 * sum {
            break;
        }
    }
    (ln_first + f64::ln(sum)).min(0.0)
}

/// The evidence that detections at `places` lie on `stars` of the same plane, for `log10_trials` alignments allowed;
/// `local` is the radius in which the density about a detection is counted, `density` the field's mean \[px^-2\].
pub(super) fn evidence(places: &[DVec2], stars: &Grid, density: f64, local: f64, log10_trials: f64) -> Evidence {
    let widest = TOLERANCES[TOLERANCES.len() - 1];
    let mut near: Vec<(f64, usize)> = places.iter().filter_map(|&at| stars.nearest(at, widest)).collect();
    // of detections on one star the nearest counts
    near.sort_by(|a, b| a.1.cmp(&b.1).then(a.0.total_cmp(&b.0)));
    near.dedup_by_key(|(_, star)| *star);
    let area = std::f64::consts::PI * local * local;
    let densities: Vec<f64> = places
        .iter()
        .map(|&at| density.max(stars.within(at, local).count().saturating_sub(1) as f64 / area))
        .collect();
    let tried = places.len();
    let reading = |tolerance: f64| {
        let matched = near.iter().filter(|(distance, _)| *distance <= tolerance).count();
        let disc = std::f64::consts::PI * (2.0 * tolerance).powi(2);
        let by_chance: f64 = densities.iter().map(|d| (d * disc).min(1.0)).sum();
        let tail =
            ln_binomial_tail(tried.saturating_sub(2), matched.saturating_sub(2), by_chance / tried.max(1) as f64);
        let log10_false = log10_trials + (TOLERANCES.len() as f64).log10() + tail / std::f64::consts::LN_10;
        Evidence { log10_false, matched, tried, by_chance, tolerance }
    };
    let first = reading(TOLERANCES[0]);
    TOLERANCES[1..]
        .iter()
        .map(|&t| reading(t))
        .fold(first, |best, next| if next.log10_false < best.log10_false { next } else { best })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Exact sums of rational numbers, and scipy.stats.binom.logsf to 1e-10 of the logarithm.
    #[test]
    fn tails_are_exact() {
        for (n, k, p, tail) in [
            (3_usize, 2_usize, 0.5, 0.5_f64),
            (10, 10, 0.1, 1e-10),
            (4, 1, 0.2, 1.0 - 0.8_f64.powi(4)),
            (5, 4, 0.25, 16.0 / 1024.0),
        ] {
            assert!((ln_binomial_tail(n, k, p) - tail.ln()).abs() < 1e-12, "{n} {k} {p}");
        }
        for (n, k, p, ln) in [
            (14, 6, 1e-4, -47.255_360_903_262_33),
            (200, 40, 0.05, -30.381_759_208_594_936),
            (2000, 300, 0.03, -261.827_897_112_547_52),
        ] {
            assert!((ln_binomial_tail(n, k, p) / ln - 1.0).abs() < 1e-10, "{n} {k} {p}");
        }
        assert_eq!(ln_binomial_tail(10, 2, 0.5), 0.0);
        assert_eq!(ln_binomial_tail(10, 11, 0.5), f64::NEG_INFINITY);
        assert_eq!(ln_binomial_tail(0, 0, 0.0), 0.0);
        assert_eq!(ln_binomial_tail(5, 3, f64::NAN), 0.0);
    }

    /// A star under each of 20 detections is strong evidence; the same within a crowd of stars is none.
    #[test]
    fn a_crowd_of_stars_weakens_the_evidence() {
        let places: Vec<DVec2> = (0..20).map(|k| DVec2::new(100.0 * f64::from(k), 7.0)).collect();
        let lonely = evidence(&places, &Grid::new(&places), 1e-5, 60.0, 6.0);
        assert!(lonely.matched == 20 && lonely.tolerance == 0.25 && lonely.log10_false < -60.0);
        let crowd: Vec<DVec2> =
            (0..200_000).map(|k| DVec2::new(f64::from(k % 10_000) / 5.0, f64::from(k / 10_000) * 2.0)).collect();
        assert!(evidence(&places, &Grid::new(&crowd), 1e-5, 15.0, 6.0).log10_false > 0.0);
    }
}
