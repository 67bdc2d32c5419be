//! Poisson counts from addressed random bits, exact for every mean.
//!
//! A count is the inverse of the cumulative probability at one uniform deviate of 64 bits ([`super::poisson_cdf::count_at`], the
//! slow twin). The pixels of a chunk are drawn side by side in single precision from the first 32 bits; wherever the answer is
//! in doubt (within a measured margin of a step, or far out: below one in a hundred) the twin decides with all 64. A count is therefore the twin's, for
//! every pixel, and does not fall when the mean rises or the deviate does.
//!
//! Means from 12 on: the quantile of the continuous distribution by powers of m^(-1/2), whose whole part is the count
//! (Giles 2016, ACM TOMS 42, 8, eq. 8 to the term m^-1; the next two terms are fitted to the exact quantile), w the normal
//! quantile of the same deviate:
//!
//! ```text
//! x = m + m^(1/2) w + (1/3 + w^2/6) - m^(-1/2) (w/36 + w^3/72) + m^-1 (-8/405 + 7 w^2/810 + w^4/270) + ...
//! ```
//!
//! Smaller means: the number of cumulative probabilities that the deviate exceeds. `rand_distr` is a second twin, of the tests.

use super::poisson_cdf::count_at;
use super::random::{Address, CHUNK};
use super::sample::{by_chunks, each_true, normal_at, quantiles};
use super::simd::Path;

/// From this mean on the expansion is used.
const EXPANDED_FROM: f64 = 12.0;

/// A Poisson count of `mean` \[e-\] for `pixel`; 0 for a mean that is not positive.
pub fn poisson(address: &Address, pixel: u64, mean: f64) -> f64 {
    let mut count = [mean];
    draw_poisson(address, pixel, &mut count);
    count[0]
}

/// The reference twin of [`poisson`]: the cumulative probability inverted with all 64 bits, one pixel at a time.
pub fn poisson_reference(address: &Address, pixel: u64, mean: f64) -> f64 {
    let words = address.chunk(pixel / CHUNK as u64);
    let word = address.extended(pixel, words[(pixel % CHUNK as u64) as usize]);
    if mean > 0.0 { twin(word, mean) } else { 0.0 }
}

/// Replace each of `means` by a count; their pixels are numbered from `first` on. The counts are those of [`poisson`].
pub fn draw_poisson(address: &Address, first: u64, means: &mut [f64]) {
    draw_poisson_on(Path::best(), address, first, means);
}

fn draw_poisson_on(path: Path, address: &Address, first: u64, means: &mut [f64]) {
    path.run(
        #[inline(always)]
        || {
            by_chunks(
                first,
                means,
                #[inline(always)]
                |chunk, offset, means: &mut [f64]| {
                    let words = address.chunk(chunk);
                    let mut all = [0.0; CHUNK];
                    all[offset..offset + means.len()].copy_from_slice(means);
                    let (mut counts, doubt) = side_by_side(&words, &all);
                    each_true(
                        &doubt,
                        #[inline(always)]
                        |i| {
                            let word = address.extended(chunk * CHUNK as u64 + i as u64, words[i]);
                            counts[i] = twin(word, all[i]);
                        },
                    );
                    means.copy_from_slice(&counts[offset..offset + means.len()]);
                },
            );
        },
    );
}

/// The slow twin: the count of `mean` at a word of 64 bits.
fn twin(word: u64, mean: f64) -> f64 {
    let w = normal_at(word);
    let s = mean.sqrt();
    // out by a few hundredths at most from the mean where it is used
    count_at(word, mean, (mean + s * w + (2.0 + w * w) / 6.0 - w * (2.0 + w * w) / (72.0 * s)).floor())
}

/// Counts of a chunk, and where they are in doubt.
#[inline(always)]
fn side_by_side(words: &[u32; CHUNK], means: &[f64; CHUNK]) -> ([f64; CHUNK], [bool; CHUNK]) {
    // the largest mean of each kind, as bits: positive numbers are ordered as their bits are
    let (mut largest_small, mut largest) = (0u32, 0u32);
    for mean in means {
        let bits = (*mean as f32).to_bits();
        let positive = if *mean > 0.0 { bits } else { 0 };
        let small = if *mean < EXPANDED_FROM { positive } else { 0 };
        largest_small = if small > largest_small { small } else { largest_small };
        largest = if positive > largest { positive } else { largest };
    }
    let (mut counts, mut doubt) = ([0.0; CHUNK], [false; CHUNK]);
    if largest >= (EXPANDED_FROM as f32).to_bits() {
        expanded(words, means, &mut counts, &mut doubt);
    }
    if largest_small > 0 {
        summed(words, means, f32::from_bits(largest_small), &mut counts, &mut doubt);
    }
    (counts, doubt)
}

/// Counts of the means from [`EXPANDED_FROM`] on.
#[inline(always)]
fn expanded(words: &[u32; CHUNK], means: &[f64; CHUNK], counts: &mut [f64; CHUNK], doubt: &mut [bool; CHUNK]) {
    /// Adding and taking off 1.5 times 2^52 or 2^23 rounds to a whole number.
    const ROUND: f64 = 6_755_399_441_055_744.0;
    const ROUND_F32: f32 = 12_582_912.0;
    let (z, far) = quantiles(words);
    for i in 0..CHUNK {
        let large = means[i] >= EXPANDED_FROM;
        let mean = if large { means[i] } else { EXPANDED_FROM };
        let whole = (mean + ROUND) - ROUND;
        let part = (mean - whole) as f32;
        let s = (mean as f32).sqrt();
        let r = 1.0 / s;
        let w = z[i];
        let w2 = w * w;
        let sixth = 5.584_95e-4 * w2 + 1.653_439_2e-3;
        let fourth = (sixth * w2 - 1.271_066e-2) * w2 - 6.270_821e-4;
        let fifth = ((-1.331_018_5e-3 * w2 - 3.523_662_6e-3) * w2 + 1.725_823e-2) * w;
        let third = (w2 * (1.0 / 270.0) + 7.0 / 810.0) * w2 - 8.0 / 405.0;
        let second = (w2 * (-1.0 / 72.0) - 1.0 / 36.0) * w;
        let first = w2 * (1.0 / 6.0) + 1.0 / 3.0;
        let x = part + s * w + (first + r * (second + r * (third + r * (fifth + r * fourth))));
        let nearest = (x + ROUND_F32) - ROUND_F32;
        let above = x - nearest;
        let floor = if above < 0.0 { nearest - 1.0 } else { nearest };
        let margin = MARGIN[0] * s + MARGIN[1] * (r * r) * (r * r) * r;
        let unsure = (above.abs() <= margin) | far[i] | (mean >= 1e12);
        counts[i] = if large { whole + f64::from(floor) } else { counts[i] };
        doubt[i] |= large & unsure;
    }
}

/// Margin of the expansion: this times m^(1/2), and this times m^(-5/2); twice the largest error seen in 6e5 draws at each of 16 means.
const MARGIN: [f32; 2] = [1e-6, 6.0];

/// Margin of a sum of probabilities.
const MARGIN_OF_SUM: f32 = 3e-6;
/// Deviates above this are in doubt: what lies beyond the terms summed is less.
const NEAR_ONE: f32 = 1.0 - 4e-5;

/// Counts of the positive means below [`EXPANDED_FROM`], none above `largest`.
#[inline(always)]
fn summed(
    words: &[u32; CHUNK],
    means: &[f64; CHUNK],
    largest: f32,
    counts: &mut [f64; CHUNK],
    doubt: &mut [bool; CHUNK],
) {
    const LANES: usize = 16;
    // enough terms for all but 1e-5 of the probability
    let terms = (largest + 4.5 * largest.sqrt() + 4.0) as usize;
    for group in 0..CHUNK / LANES {
        let at = group * LANES;
        let (mut mean, mut u, mut term) = ([0.0f32; LANES], [0.0f32; LANES], [0.0f32; LANES]);
        for i in 0..LANES {
            let small = means[at + i] > 0.0 && means[at + i] < EXPANDED_FROM;
            mean[i] = if small { means[at + i] as f32 } else { 0.0 };
            u[i] = (words[at + i] ^ 0x8000_0000) as i32 as f32 * (0.5 / 2_147_483_648.0) + 0.5;
            term[i] = exp_minus(mean[i]);
        }
        let (mut sum, mut count, mut nearest) = (term, [0.0f32; LANES], [1.0f32; LANES]);
        for k in 1..=terms {
            let inverse = 1.0 / k as f32;
            for i in 0..LANES {
                let above = u[i] - sum[i];
                count[i] += if above > 0.0 { 1.0 } else { 0.0 };
                nearest[i] = if above.abs() < nearest[i] { above.abs() } else { nearest[i] };
                term[i] *= mean[i] * inverse;
                sum[i] += term[i];
            }
        }
        for i in 0..LANES {
            let small = mean[i] > 0.0;
            counts[at + i] = if small { f64::from(count[i]) } else { counts[at + i] };
            doubt[at + i] |= small & ((nearest[i] < MARGIN_OF_SUM) | (u[i] > NEAR_ONE));
        }
        // a positive mean that single precision rounds to nothing
        for i in 0..LANES {
            doubt[at + i] |= (means[at + i] > 0.0) & (means[at + i] < EXPANDED_FROM) & (mean[i] == 0.0);
        }
    }
}

/// exp(-x) for 0 <= x <= 80, relative error below 3e-7; without branches.
#[inline(always)]
fn exp_minus(x: f32) -> f32 {
    const ROUND: f32 = 12_582_912.0;
    const SERIES: [f32; 8] = [1.0 / 5040.0, 1.0 / 720.0, 1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 0.5, 1.0, 1.0];
    // x = k ln 2 + r; ln 2 in two parts, the first short enough that k times it is exact
    let shifted = x * std::f32::consts::LOG2_E + ROUND;
    let k = shifted - ROUND;
    let r = -((x - k * 0.693_359_4) - k * -2.121_944_4e-4);
    let mut series = SERIES[0];
    for c in &SERIES[1..] {
        series = series * r + c;
    }
    let exponent = 127 - (shifted.to_bits() as i32 - ROUND.to_bits() as i32);
    series * f32::from_bits((exponent as u32) << 23)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::random::Stage;
    use crate::base::sample::uniform;
    use rand_distr::Distribution;

    const SHOT: Address = Address { seed: 42, frame: 0, stage: Stage::Shot };

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

    /// Words whose deviates cover the centre, both tails and the neighbourhood of a half.
    fn words_and_means(mean: f64, n: u64) -> Vec<(u32, f64)> {
        let address = Address { frame: mean.to_bits() as u32, ..SHOT };
        (0..n)
            .map(|i| {
                let [a, b] = address.block(i, 7);
                let word = match i % 8 {
                    0 => a as u32 & 0xFFFF,
                    1 => !(a as u32 & 0xFFFFF),
                    2 => (1 << 31) ^ (a as u32 & 0xFFF),
                    _ => a as u32,
                };
                // means of a few per cent about the one asked for
                (word, mean * (1.0 + 0.05 * (uniform(b) - 0.5)))
            })
            .collect()
    }

    /// The exactness itself: wherever the fast answer is not in doubt it is the twin's, whatever the further 32 bits are; and
    /// little is in doubt.
    #[test]
    fn counts_without_doubt_are_the_twins() {
        for mean in [
            1e-12, 1e-4, 0.05, 0.9, 2.5, 6.0, 11.5, 11.99, 12.5, 14.0, 20.0, 37.0, 90.0, 400.0, 1500.0, 1e4, 6e4,
            1e6, 1e9,
        ] {
            let cases = words_and_means(mean, 64 * 1500);
            let mut doubtful = 0.0;
            for cases in cases.chunks_exact(CHUNK) {
                let words = std::array::from_fn(|i| cases[i].0);
                let means = std::array::from_fn(|i| cases[i].1);
                let (counts, doubt) = side_by_side(&words, &means);
                for i in 0..CHUNK {
                    if doubt[i] {
                        doubtful += if i % 8 > 2 { 1.0 / (cases.len() * 1500 / 8 * 5) as f64 } else { 0.0 };
                        continue;
                    }
                    for low in [0, u64::from(u32::MAX)] {
                        let exact = twin(u64::from(words[i]) << 32 | low, means[i]);
                        assert_eq!(counts[i], exact, "mean {} word {:#x}", means[i], words[i]);
                    }
                }
            }
            let allowed = if mean > 1e5 { 0.5 } else { 0.03 };
            assert!(doubtful < allowed, "{doubtful} of the counts of mean {mean} are in doubt");
        }
    }

    /// Larger means and larger deviates give no smaller counts, over the seams of the algorithms.
    #[test]
    fn counts_are_monotonous() {
        for pixel in [0, 5, 77, 130] {
            let mut last = 0.0;
            for step in 0..40_000 {
                let mean = 1e-3 * libm::exp2(f64::from(step) * 5e-4);
                let count = poisson(&SHOT, pixel, mean);
                assert!(count >= last, "pixel {pixel} mean {mean}: {count} after {last}");
                last = count;
            }
        }
    }

    #[test]
    fn extreme_means_end_and_stay_finite() {
        for mean in [0.0, -1.0, f64::NAN, 1e-300, 1e-12, f64::MIN_POSITIVE, f64::NEG_INFINITY] {
            assert_eq!(poisson(&SHOT, 7, mean), 0.0, "{mean}");
        }
        for mean in [1e9, 1e12, 1e15, 1e18, 1e300] {
            let count = poisson(&SHOT, 7, mean);
            assert!((count - mean).abs() <= 9.0 * mean.sqrt(), "{mean}: {count}");
        }
        assert_eq!(poisson(&SHOT, 7, f64::INFINITY), f64::INFINITY);
    }

    #[test]
    fn exponentials_agree_with_libm() {
        for i in 0..=12_000 {
            let x = i as f32 * 1e-3;
            let error = f64::from(exp_minus(x)) / libm::exp(-f64::from(x)) - 1.0;
            assert!(error.abs() < 4e-7, "exp(-{x}): {error:e}");
        }
        assert_eq!(exp_minus(0.0), 1.0);
        assert_eq!(exp_minus(1e-30), 1.0);
    }

    /// Runs of pixels draw what each pixel draws, on every path, wherever a run begins.
    #[test]
    fn every_path_and_every_run_draws_the_same() {
        let kinds = [0.0, 1e-3, 0.7, 5.0, 40.3, 1e4, 300.0, f64::NAN, 11.9, 12.1, 1e9];
        let means = (0..20_000).map(|i| kinds[(i / 7 + i * i) % kinds.len()]).collect::<Vec<_>>();
        let mut counts = means.clone();
        draw_poisson_on(Path::Baseline, &SHOT, 0, &mut counts);
        for path in Path::all() {
            for (first, length) in [(0, 20_000), (1, 1), (63, 2), (77, 1000), (64, 64), (129, 63)] {
                let mut part = means[first..first + length].to_vec();
                draw_poisson_on(path, &SHOT, first as u64, &mut part);
                assert_eq!(part, counts[first..first + length], "{path:?} {first}");
            }
        }
        assert!((0..200).all(|i| counts[i] == poisson(&SHOT, i as u64, means[i])));
    }
}
