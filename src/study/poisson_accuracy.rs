//! Error against run time of the ways to draw Poisson counts, at the mean of the scene's own pixels.
//!
//! * `noise.poisson`: counts of the same deviates by the ways, against the inverse of the cumulative probability; in standard
//!   deviations of a count. Rounded normal deviates have the wrong skewness: they err by a third of an electron in the middle and more in the tails.

use super::errors::{Errors, row, timed};
use crate::base::accuracy::AccuracyRow;
use crate::base::poisson::{draw_poisson, poisson_reference};
use crate::base::random::{Address, Stage};
use crate::base::sample::add_normal;

/// Pixels drawn.
const PIXELS: usize = 1 << 17;
/// Pixels drawn one by one, which is slow.
const FEW: usize = 1 << 13;

/// Rows for pixels of `mean` electrons; the time is that of a million.
pub(super) fn rows(seed: u64, mean: f64, clock: &(dyn Fn() -> f64 + Sync)) -> Vec<AccuracyRow> {
    let mean = if mean.is_finite() { mean.clamp(0.01, 1e9) } else { 1.0 };
    let address = Address { seed, frame: 0, stage: Stage::Shot };
    let (exact, exact_s) =
        timed(clock, || (0..FEW as u64).map(|pixel| poisson_reference(&address, pixel, mean)).collect::<Vec<_>>());
    let (drawn, drawn_s) = timed(clock, || {
        let mut counts = vec![mean; PIXELS];
        draw_poisson(&address, 0, &mut counts);
        counts
    });
    let (rounded, rounded_s) = timed(clock, || {
        let mut counts = vec![mean; PIXELS];
        add_normal(&address, 0, mean.sqrt(), &mut counts);
        counts.iter_mut().for_each(|count| *count = count.round().max(0.0));
        counts
    });
    let errors = |counts: &[f64]| {
        let off = counts.iter().zip(&exact).map(|(count, exact)| (count - exact) / mean.sqrt());
        Errors::of(&off.collect::<Vec<_>>())
    };
    let one = |setting: &str, counts: &[f64], seconds: f64, pixels: usize, default: bool| {
        let setting = format!("{setting}, mean {mean:.3} e-");
        let time_s = seconds / pixels as f64 * 1e6;
        AccuracyRow { default, ..row("noise.poisson", setting, &errors(counts), "sigma", time_s, 0) }
    };
    vec![
        one("inverse, pixel by pixel", &exact, exact_s, FEW, false),
        one("side by side, inverse where in doubt", &drawn, drawn_s, PIXELS, true),
        one("rounded normal deviates", &rounded, rounded_s, PIXELS, false),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Counts side by side are those of the inverse, to the last; rounded normal deviates err by the skewness of the distribution, at least
    /// the third of an electron by which its median lies off the mean, but for one rounding.
    #[test]
    fn counts_are_exact_and_normal_deviates_are_not() {
        for mean in [0.3, 5.0, 40.0, 3000.0] {
            let rows = rows(7, mean, &|| 0.0);
            assert_eq!(rows[1].max_err, 0.0, "mean {mean}");
            assert!(rows[2].max_err * mean.sqrt() >= 1.0, "mean {mean}: {}", rows[2].max_err);
            assert!(rows[2].rms_err < rows[2].max_err);
        }
        assert!(super::rows(7, f64::NAN, &|| 0.0).iter().all(|r| r.max_err.is_finite()));
    }
}
