//! The random numbers of a frame against their distributions, and independent of each other.
//!
//! All tests have fixed seeds and a stated significance; `cargo nextest run --release --run-ignored only -E 'test(by_hand)'` draws
//! 1e8 counts of each mean.

use nightglass::base::poisson::draw_poisson;
use nightglass::base::random::{Address, Stage};
use nightglass::base::sample::add_normal;
use rand::distr::Distribution;

/// Forty means over all seams of the sampler, 1e-12 to 1e9 \[e-\].
const MEANS: [f64; 40] = [
    1e-12, 1e-6, 1e-3, 0.01, 0.03, 0.1, 0.2, 0.4, 0.7, 1.0, 1.5, 2.2, 3.0, 4.1, 5.0, 6.3, 8.0, 9.7, 11.0, 11.99,
    12.0, 12.01, 13.5, 16.0, 20.0, 25.5, 32.0, 45.0, 64.3, 100.0, 180.0, 333.3, 700.0, 1500.0, 4096.0, 1e4,
    65_535.5, 1e6, 3e7, 1e9,
];

fn shot(seed: u64, frame: u32) -> Address {
    Address { seed, frame, stage: Stage::Shot }
}

/// Counts of each mean, `n` of them.
fn counts(mean: f64, number: usize, n: usize) -> impl Iterator<Item = f64> {
    const RUN: usize = 1 << 16;
    (0..n.div_ceil(RUN)).flat_map(move |run| {
        let mut counts = vec![mean; RUN.min(n - run * RUN)];
        draw_poisson(&shot(20_180_115, number as u32), (run * RUN) as u64, &mut counts);
        counts
    })
}

/// Sigmas by which mean, variance and third moment of `n` counts are off, and the chi-square of their histogram.
fn deviations(mean: f64, n: usize, counts: impl Iterator<Item = f64>) -> [f64; 4] {
    let width = mean.sqrt();
    let low = (mean - 12.0 * width - 20.0).max(0.0).floor();
    // bins of whole counts, a quarter of a sigma wide at least
    let bin = (0.25 * width).floor().max(1.0);
    let bins = ((24.0 * width + 60.0) / bin) as usize + 1;
    let mut seen = vec![0.0; bins];
    let mut sums = [0.0f64; 3];
    for count in counts {
        let d = count - mean;
        sums[0] += d;
        sums[1] += d * d - mean;
        sums[2] += d * d * d - mean;
        seen[(((count - low) / bin) as usize).min(bins - 1)] += 1.0;
    }
    // variances of (N - m), (N - m)^2 and (N - m)^3 from the central moments of the Poisson distribution
    let m = mean;
    let moments = [m, m + 2.0 * m * m, m + 24.0 * m * m + 15.0 * m * m * m];
    let mut off = [0.0; 4];
    for k in 0..3 {
        off[k] = sums[k] / (n as f64 * moments[k]).sqrt();
    }
    let probability = |k: f64| nightglass::base::poisson_cdf::below_and_from(k.max(1.0), mean);
    let (mut chi2, mut cells, mut rest) = (0.0, 0.0, [n as f64, n as f64]);
    for (b, seen) in seen.iter().enumerate() {
        let first = low + b as f64 * bin;
        let [below, from] = if first > 0.0 { probability(first) } else { [0.0, 1.0] };
        let [below_next, from_next] = probability(first + bin);
        let share = if below < 0.5 { below_next - below } else { from - from_next };
        let expected = share * n as f64;
        if expected >= 20.0 {
            chi2 += (seen - expected).powi(2) / expected;
            cells += 1.0;
            rest = [rest[0] - seen, rest[1] - expected];
        }
    }
    if rest[1] >= 5.0 {
        chi2 += (rest[0] - rest[1]).powi(2) / rest[1];
        cells += 1.0;
    }
    let freedom: f64 = cells - 1.0;
    off[3] = if freedom > 0.0 { (chi2 - freedom) / (2.0 * freedom).sqrt() } else { 0.0 };
    off
}

/// 5 sigma: 40 means, 4 figures, two samplers; a false alarm once in 1e4 seeds. Rare counts are not normal: figures of fewer
/// than 100 expected photons are not judged by higher moments.
fn check(n: usize) {
    for (number, mean) in MEANS.into_iter().enumerate() {
        let off = deviations(mean, n, counts(mean, number, n));
        let judged = match mean * n as f64 {
            photons if photons < 100.0 => &off[..0],
            photons if photons < 1e4 => &off[..1],
            _ => &off[..],
        };
        assert!(
            judged.iter().all(|z| z.abs() < 5.0),
            "mean {mean}: {off:?} sigma in mean, variance, third moment, chi-square"
        );
    }
}

#[test]
fn counts_follow_the_poisson_distribution() {
    check(1_000_000);
}

#[test]
#[ignore = "several minutes"]
fn by_hand_counts_follow_the_poisson_distribution() {
    check(100_000_000);
}

/// The reference twin on the same bits passes the same test.
#[test]
fn the_twin_of_rand_distr_follows_it_too() {
    for (number, mean) in [0.2, 4.1, 11.99, 25.5, 333.3, 1e4].into_iter().enumerate() {
        let twin = rand_distr::Poisson::new(mean).expect("a positive mean");
        let address = shot(7, number as u32);
        let off = deviations(mean, 200_000, (0..200_000).map(|pixel| twin.sample(&mut address.stream(pixel))));
        assert!(off.iter().all(|z| z.abs() < 5.0), "mean {mean}: {off:?}");
    }
}

/// Photons of so rare a mean that one in a million pixels sees any: their number in 6e7 pixels.
#[test]
fn rare_photons_come_at_their_rate() {
    let (mean, n) = (1e-6, 64_000_000);
    let photons: f64 = counts(mean, 3, n).sum();
    assert!((photons - 64.0).abs() < 5.0 * 8.0, "{photons}");
}

#[test]
fn read_noise_has_the_moments_of_a_normal_distribution() {
    let n = 4_000_000;
    let mut z = vec![0.0; n];
    add_normal(&Address { stage: Stage::Read, ..shot(3, 1) }, 0, 1.0, &mut z);
    // E z^k, and the variance of z^k
    for (k, expected, variance) in
        [(1, 0.0, 1.0), (2, 1.0, 2.0), (3, 0.0, 15.0), (4, 3.0, 96.0f64), (6, 15.0, 10_170.0)]
    {
        let moment = z.iter().map(|z| z.powi(k)).sum::<f64>() / n as f64;
        let allowed = 5.0 * (variance / n as f64).sqrt();
        assert!((moment - expected).abs() < allowed, "moment {k}: {moment} against {expected} +- {allowed}");
    }
    // tails: the share beyond 4 sigma is 6.334e-5
    let beyond = z.iter().filter(|z| z.abs() > 4.0).count() as f64;
    assert!((beyond - 253.4).abs() < 5.0 * 253.4f64.sqrt(), "{beyond}");
}

/// Correlations of noise with that of neighbouring pixels, rows, frames, stages and seeds: 5 sigma each.
#[test]
fn noise_of_neighbours_is_independent() {
    const WIDTH: usize = 2048;
    const N: usize = WIDTH * 512;
    let normal = |seed: u64, frame: u32, stage: Stage, first: u64| {
        let mut z = vec![0.0; N];
        add_normal(&Address { seed, frame, stage }, first, 1.0, &mut z);
        z
    };
    let counted = |seed: u64, frame: u32| {
        let mut counts = vec![37.0; N];
        draw_poisson(&shot(seed, frame), 0, &mut counts);
        counts.iter().map(|c| (c - 37.0) / 37f64.sqrt()).collect::<Vec<_>>()
    };
    let base = normal(1, 0, Stage::Read, 0);
    let independent = |what: &str, a: &[f64], b: &[f64]| {
        let pairs = a.len().min(b.len()) as f64;
        let first = a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>() / pairs.sqrt();
        // squares too: a shared width would not show in the product
        let square =
            a.iter().zip(b).map(|(a, b)| (a * a - 1.0) * (b * b - 1.0)).sum::<f64>() / (2.0 * pairs.sqrt());
        assert!(first.abs() < 5.0 && square.abs() < 6.0, "{what}: {first} and {square} sigma");
    };
    for lag in [1, 2, 3, 4, 15, 16, 17, 63, 64, 65, WIDTH - 1, WIDTH, WIDTH + 1, 2 * WIDTH] {
        independent(&format!("pixels {lag} apart"), &base[lag..], &base);
        let shot = counted(1, 0);
        independent(&format!("counts {lag} apart"), &shot[lag..], &shot);
    }
    for (what, other) in [
        ("the next frame", normal(1, 1, Stage::Read, 0)),
        ("a far frame", normal(1, 1 << 20, Stage::Read, 0)),
        ("another stage", normal(1, 0, Stage::Shot, 0)),
        ("counts of the same pixels", counted(1, 0)),
        ("the next seed", normal(2, 0, Stage::Read, 0)),
        ("a seed that differs in a high bit", normal(1 | 1 << 40, 0, Stage::Read, 0)),
    ] {
        independent(what, &base, &other);
    }
    independent("counts of two frames", &counted(1, 0), &counted(1, 1));
    independent("counts of two seeds", &counted(1, 0), &counted(2, 0));
}
