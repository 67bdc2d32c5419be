//! Poisson counts from addressed random bits, exact for every mean up to 1e9.
//!
//! Poisson numbers add: a count of mean m is one of a round mean m0 <= m and one of the small rest m - m0. The first is found in
//! a table of cumulative probabilities that all pixels of that m0 share (inversion with a guide table, Chen & Asau 1974, AIIE
//! Trans. 6, 163), the second by inversion of its few terms, each from a word of its own of the pixel's random bits. Round
//! means are quarters below 32 and whole numbers below 4096. Larger means: transformed rejection with squeeze
//! (Hoermann 1993, Insurance: Mathematics and Economics 12, 39, algorithm PTRS). `rand_distr` is the reference twin of the tests.
//!
//! Only the four operations, square roots and the `libm` crate are used, so that every x86-64 machine draws the same counts.

use super::random::Address;
use super::sample::{BLOCK, uniform};
use std::sync::{LazyLock, OnceLock};

/// From this mean on counts are found by rejection.
const TABLED_BELOW: f64 = 4096.0;
/// Below this round means are quarters.
const QUARTERS_BELOW: f64 = 32.0;
const TABLES_NUMBER: usize = 128 + 4096 - 32;

/// Steps of the guide.
const GUIDE: usize = 256;
/// Terms below this share of the largest are left out: a uniform deviate has 52 bits.
const LEAST_TERM: f64 = 1e-22;

/// Cumulative probabilities of one round mean.
struct Table {
    /// Count of the first entry.
    first: f64,
    /// Probability of a count up to that of each entry; the last is infinite.
    up_to: Vec<f64>,
    /// The first entry to look at, for each 1/256 of the uniform deviate.
    guide: [u16; GUIDE],
}

/// The tables, each made when first wanted.
static TABLES: LazyLock<Vec<OnceLock<Table>>> =
    LazyLock::new(|| (0..TABLES_NUMBER).map(|_| OnceLock::new()).collect());

/// The round mean below a positive `mean` < 4096, and the number of its table.
#[inline(always)]
fn round_mean(mean: f64) -> (f64, usize) {
    if mean < QUARTERS_BELOW {
        let quarters = (mean * 4.0) as usize;
        (quarters as f64 * 0.25, quarters)
    } else {
        let whole = mean as usize;
        (whole as f64, whole + 96)
    }
}

impl Table {
    fn new(mean: f64) -> Self {
        let mode = mean.floor();
        let (mut below, mut above) = (Vec::new(), vec![1.0]);
        let (mut term, mut count) = (1.0, mode);
        while count > 0.0 && term > LEAST_TERM {
            term *= count / mean;
            count -= 1.0;
            below.push(term);
        }
        let first = count;
        (term, count) = (1.0, mode);
        while term > LEAST_TERM && mean > 0.0 {
            count += 1.0;
            term *= mean / count;
            above.push(term);
        }
        let terms = || below.iter().rev().chain(&above);
        let total: f64 = terms().sum();
        let mut sum = 0.0;
        let mut up_to = terms()
            .map(|t| {
                sum += t;
                sum / total
            })
            .collect::<Vec<_>>();
        if let Some(last) = up_to.last_mut() {
            *last = f64::INFINITY;
        }
        let guide = std::array::from_fn(|j| up_to.partition_point(|p| *p < j as f64 / GUIDE as f64) as u16);
        Self { first, up_to, guide }
    }

    #[inline(always)]
    fn count(&self, u: f64) -> f64 {
        let mut at = usize::from(self.guide[(u * GUIDE as f64) as usize]);
        while u > self.up_to[at] {
            at += 1;
        }
        self.first + at as f64
    }
}

/// A Poisson count of `mean` \[e-\] for `pixel`; 0 for a mean that is not positive.
pub fn poisson(address: &Address, pixel: u64, mean: f64) -> f64 {
    let mut count = [mean];
    draw_poisson(address, pixel, &mut count);
    count[0]
}

/// Replace each of `means` by a count; their pixels are numbered from `first` on. The counts are those of [`poisson`].
pub fn draw_poisson(address: &Address, first: u64, means: &mut [f64]) {
    let (mut u, mut v, mut rest, mut none) = ([0.0; BLOCK], [0.0; BLOCK], [0.0; BLOCK], [0.0; BLOCK]);
    for (block, means) in means.chunks_mut(BLOCK).enumerate() {
        let first = first + (block * BLOCK) as u64;
        for (pixel, (u, v)) in (first..).zip(u.iter_mut().zip(&mut v)).take(means.len()) {
            let [one, two] = address.block(pixel, 0);
            (*u, *v) = (uniform(one), uniform(two));
        }
        for (rest, mean) in rest.iter_mut().zip(&*means) {
            let inside = if *mean > 0.0 && *mean < TABLED_BELOW { *mean } else { 0.0 };
            *rest = inside - round_mean(inside).0;
        }
        for (none, rest) in none.iter_mut().zip(&rest) {
            *none = exp_minus(*rest);
        }
        for (i, mean) in means.iter_mut().enumerate() {
            *mean = if *mean > 0.0 && *mean < TABLED_BELOW {
                let (round, number) = round_mean(*mean);
                let table = TABLES[number].get_or_init(|| Table::new(round));
                table.count(u[i]) + inversion(v[i], rest[i], none[i])
            } else if *mean >= TABLED_BELOW {
                rejection(address, first + i as u64, *mean)
            } else {
                0.0
            };
        }
    }
}

/// The smallest count whose cumulative probability exceeds `u`, for `mean` < 1 and `none` = exp(-mean); the sum ends
/// where the next term no longer changes it.
#[inline(always)]
fn inversion(u: f64, mean: f64, none: f64) -> f64 {
    let mut term = none;
    let mut sum = term;
    let mut count = 0.0;
    while u > sum {
        count += 1.0;
        term *= mean / count;
        if sum + term == sum {
            break;
        }
        sum += term;
    }
    count
}

fn rejection(address: &Address, pixel: u64, mean: f64) -> f64 {
    let b = 0.931 + 2.53 * mean.sqrt();
    let a = -0.059 + 0.024_83 * b;
    let v_r = 0.9277 - 3.6224 / (b - 2.0);
    let mut block = 0;
    loop {
        let [first, second] = address.block(pixel, block);
        let u = uniform(first) - 0.5;
        let v = uniform(second);
        let u_s = 0.5 - u.abs();
        let count = ((2.0 * a / u_s + b) * u + mean + 0.43).floor();
        if u_s >= 0.07 && v <= v_r {
            return count;
        }
        if count >= 0.0 && (u_s >= 0.013 || v <= u_s) {
            let inverse_alpha = 1.1239 + 1.1328 / (b - 3.4);
            let left = libm::log(v * inverse_alpha / (a / (u_s * u_s) + b));
            if left <= count * libm::log(mean) - mean - libm::lgamma(count + 1.0) {
                return count;
            }
        }
        // each trial is taken with probability above 0.7: 2^24 blocks never run out
        block += 1;
    }
}

/// exp(-x) for 0 <= x <= 700, relative error below 4e-16: x = k ln 2 + r with |r| <= ln 2 / 2, Taylor's series of
/// exp(-r) to the 13th power, scaled by 2^-k.
#[inline(always)]
fn exp_minus(x: f64) -> f64 {
    const INVERSE_FACTORIALS: [f64; 14] = [
        1.0 / 6_227_020_800.0,
        1.0 / 479_001_600.0,
        1.0 / 39_916_800.0,
        1.0 / 3_628_800.0,
        1.0 / 362_880.0,
        1.0 / 40_320.0,
        1.0 / 5_040.0,
        1.0 / 720.0,
        1.0 / 120.0,
        1.0 / 24.0,
        1.0 / 6.0,
        0.5,
        1.0,
        1.0,
    ];
    // ln 2 in two parts, the first short enough that k times it is exact
    const LN_2: [f64; 2] = [0.693_147_180_369_123_8, 1.908_214_929_270_587_7e-10];
    // adding and taking off 1.5 * 2^52 rounds to an integer, which then stands in the low bits
    const ROUND: f64 = 6_755_399_441_055_744.0;
    let shifted = x * std::f64::consts::LOG2_E + ROUND;
    let k = shifted - ROUND;
    let r = -((x - k * LN_2[0]) - k * LN_2[1]);
    let series = INVERSE_FACTORIALS.iter().fold(0.0, |sum, c| sum * r + c);
    let exponent = (1023i64 - (shifted.to_bits() as i64 - ROUND.to_bits() as i64)) as u64;
    series * f64::from_bits(exponent << 52)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::random::Stage;
    use rand_distr::Distribution;

    const SHOT: Address = Address { seed: 42, frame: 0, stage: Stage::Shot };

    /// Tables against the exact probabilities: 1e-13 of each.
    #[test]
    fn tables_hold_the_exact_probabilities() {
        for mean in [0.25, 3.5, 31.75, 32.0, 777.0, 4095.0] {
            let table = Table::new(mean);
            let mut before = 0.0;
            for (k, up_to) in table.up_to[..table.up_to.len() - 1].iter().enumerate() {
                let count = table.first + k as f64;
                let exact = (count * libm::log(mean) - mean - libm::lgamma(count + 1.0)).exp();
                assert!((up_to - before - exact).abs() < 1e-13 + 2e-11 * exact, "{mean}: {count}");
                before = *up_to;
            }
        }
    }

    /// Mean and variance equal the mean, over all algorithms and their seams; 4.5 sigma at a fixed seed.
    #[test]
    fn poisson_counts_have_the_right_mean_and_variance() {
        for (stream, mean) in [1e-3, 0.3, 0.9999, 5.0, 10.2, 31.99, 32.0, 37.5, 1500.3, 4095.9, 4096.0, 1e5, 1e9]
            .into_iter()
            .enumerate()
        {
            let address = Address { frame: stream as u32, ..SHOT };
            let n = 200_000u64;
            let (mut sum, mut square) = (0.0, 0.0);
            let mut counts = vec![mean; n as usize];
            draw_poisson(&address, 0, &mut counts);
            for count in counts {
                let d = count - mean;
                sum += d;
                square += d * d;
            }
            let (n, standard) = (n as f64, mean);
            let mean_error = 4.5 * (standard / n).sqrt();
            let variance_error = 4.5 * ((standard + 2.0 * standard * standard) / n).sqrt();
            assert!((sum / n).abs() < mean_error, "mean {mean}: off by {}", sum / n);
            assert!((square / n - mean).abs() < variance_error, "variance at {mean}: {}", square / n);
        }
    }

    /// Chi-square of 1e6 draws against the exact probabilities, 4.5 sigma of the chi-square distribution;
    /// the reference twin `rand_distr` on the same stream passes the same test.
    #[test]
    fn poisson_counts_follow_the_exact_probabilities() {
        for mean in [0.2, 0.7, 4.0, 9.9, 25.1, 33.7, 400.6, 3000.5] {
            let n = 1_000_000u64;
            let mut own = vec![mean; n as usize];
            draw_poisson(&SHOT, 0, &mut own);
            let reference = rand_distr::Poisson::new(mean).expect("a positive mean");
            let twin = (0..n).map(|pixel| reference.sample(&mut SHOT.stream(pixel))).collect::<Vec<_>>();
            for (name, draws) in [("own", own), ("rand_distr", twin)] {
                let z = chi_square_sigma(&draws, mean);
                assert!(z.abs() < 4.5, "{name} at {mean}: chi-square off by {z} sigma");
            }
        }
    }

    /// (chi^2 - dof) / sqrt(2 dof) over the counts expected at least 20 times.
    fn chi_square_sigma(draws: &[f64], mean: f64) -> f64 {
        let n = draws.len() as f64;
        let top = (mean + 12.0 * mean.sqrt() + 20.0) as usize;
        let mut seen = vec![0.0; top + 1];
        for draw in draws {
            seen[(*draw as usize).min(top)] += 1.0;
        }
        let (mut chi2, mut cells) = (0.0, 0.0);
        let (mut rest_seen, mut rest_expected) = (n, n);
        for (count, seen) in seen.iter().enumerate() {
            let k = count as f64;
            let expected = n * (k * mean.ln() - mean - libm::lgamma(k + 1.0)).exp();
            if expected >= 20.0 {
                chi2 += (seen - expected).powi(2) / expected;
                cells += 1.0;
                rest_seen -= seen;
                rest_expected -= expected;
            }
        }
        if rest_expected >= 5.0 {
            chi2 += (rest_seen - rest_expected).powi(2) / rest_expected;
            cells += 1.0;
        }
        (chi2 - (cells - 1.0)) / (2.0 * (cells - 1.0)).sqrt()
    }

    #[test]
    fn extreme_means_end_and_stay_finite() {
        for mean in [0.0, -1.0, f64::NAN, 1e-300, 1e-12, f64::MIN_POSITIVE] {
            assert_eq!(poisson(&SHOT, 7, mean), 0.0);
        }
        assert!(poisson(&SHOT, 7, 1e9).is_finite());
        for table in [0.0, 0.25, 31.75, 32.0, 4095.0] {
            let counts = [0, u64::MAX / 2, u64::MAX].map(|word| Table::new(table).count(uniform(word)));
            assert!(
                counts[0] >= 0.0 && counts[1] <= table.ceil() && counts[2] <= table + 9.0 * table.sqrt() + 20.0
            );
        }
    }

    #[test]
    fn exponentials_agree_with_libm() {
        for i in 0..=100_000 {
            let x = f64::from(i) * 1e-4;
            let error = exp_minus(x) / libm::exp(-x) - 1.0;
            assert!(error.abs() < 6e-16, "exp(-{x}): {error:e}");
        }
        assert_eq!(exp_minus(0.0), 1.0);
        assert_eq!(exp_minus(1e-300), 1.0);
    }

    #[test]
    fn runs_of_pixels_draw_what_each_pixel_draws() {
        let means =
            (0..1000).map(|i| [0.0, 1e-3, 0.7, 5.0, 40.3, 1e4, 300.0, f64::NAN][i % 8]).collect::<Vec<_>>();
        let mut counts = means.clone();
        draw_poisson(&SHOT, 77, &mut counts);
        for (i, mean) in means.iter().enumerate() {
            assert_eq!(counts[i], poisson(&SHOT, 77 + i as u64, *mean));
        }
    }
}
