//! Masters and corrected frames of a simulated camera, against what was put in. Seeds are fixed; each bound is 4
//! to 5 standard errors of the figure that it bounds, unless it says otherwise.

use super::master::{self, Frames};
use super::reduce::*;
use std::cell::RefCell;

const SIZE: [usize; 2] = [100, 80];
const PIXELS: usize = 8000;
const BIAS: f64 = 300.0;
/// Read noise \[adu\].
const READ: f64 = 5.0;
const GAIN: f64 = 2.0;

/// SplitMix64 (Steele et al. 2014) and the polar method for normal numbers.
pub(super) struct Random(pub u64);

impl Random {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn normal(&mut self) -> f64 {
        let (u, v) = (self.uniform(), self.uniform());
        (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    }
}

/// A chip with its patterns.
struct Chip {
    bias: Vec<f64>,
    /// \[adu/s\].
    dark: Vec<f64>,
    response: Vec<f64>,
}

impl Chip {
    /// Bias pattern of 3 adu, dark current of 0.5 adu/s with 30 % of scatter, response scattered by 3 %.
    fn new() -> Self {
        let mut random = Random(1);
        let mut pattern =
            |mean: f64, sigma: f64| (0..PIXELS).map(|_| mean + sigma * random.normal()).collect::<Vec<_>>();
        Self { bias: pattern(BIAS, 3.0), dark: pattern(0.5, 0.15), response: pattern(1.0, 0.03) }
    }

    /// A raw frame of `light` adu of uniform light in `exptime_s`, with shot noise as normal numbers of the same
    /// variance.
    fn frame(&self, random: &mut Random, light: f64, exptime_s: f64) -> Vec<f32> {
        let pixel = |k: usize, random: &mut Random| {
            let signal = self.dark[k] * exptime_s + light * self.response[k];
            let variance = READ * READ + signal.max(0.0) / GAIN;
            (self.bias[k] + signal + variance.sqrt() * random.normal()) as f32
        };
        (0..PIXELS).map(|k| pixel(k, random)).collect()
    }
}

/// Hand `frames` out as a reader of bands, and make something of them.
fn with<T>(frames: &[Vec<f32>], band_rows: usize, make: impl FnOnce(Frames) -> T) -> T {
    let mut read = |frame: usize, rows: std::ops::Range<usize>| {
        let data = frames.get(frame).ok_or("no such frame")?;
        data.get(rows.start * SIZE[0]..rows.end * SIZE[0]).map(<[f32]>::to_vec).ok_or("no such rows".to_owned())
    };
    make(Frames { count: frames.len(), size: SIZE, band_rows, read: &mut read })
}

fn mean_and_variance(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let n = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / n;
    (mean, values.map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0))
}

fn frames(chip: &Chip, seed: u64, count: usize, light: f64, exptime_s: f64) -> Vec<Vec<f32>> {
    let mut random = Random(seed);
    (0..count).map(|_| chip.frame(&mut random, light, exptime_s)).collect()
}

/// The calibration that `n` frames of each kind give.
fn calibration(chip: &Chip, n: usize, seed: u64) -> Calibration {
    let bias = Bias::Master(with(&frames(chip, seed, n, 0.0, 0.0), 7, master::bias).expect("a bias"));
    let darks = frames(chip, seed + 1000, n, 0.0, 60.0);
    let dark = with(&darks, 7, |f| master::dark(f, &bias, 60.0, Some(-20.0))).expect("a dark");
    let flats = frames(chip, seed + 2000, n, 20_000.0, 2.0);
    let flat = with(&flats, 7, |f| master::flat(f, &bias, Some(&dark), 2.0)).expect("a flat");
    Calibration::new(SIZE, bias, Some(dark), Some(flat)).expect("of one size")
}

fn exposure(exptime_s: f64) -> Exposure {
    Exposure { exptime_s, temperature_c: Some(-20.0), saturate_adu: 60_000.0 }
}

#[test]
fn the_error_of_a_master_falls_with_the_root_of_its_frames() {
    let chip = Chip::new();
    for n in [1, 2, 3, 5, 10, 40] {
        let found = with(&frames(&chip, 10 + n as u64, n, 0.0, 0.0), 16, master::bias).expect("a bias");
        let truth = (0..PIXELS).map(|k| f64::from(found.value[k]) - chip.bias[k]);
        let (mean, variance) = mean_and_variance(truth);
        let want = READ * READ / n as f64;
        // 8000 pixels: 1.6 % (1 sigma) of the variance, 1.1 % of the mean in units of the error
        assert!((variance / want - 1.0).abs() < 0.075, "{n}: {variance} instead of {want}");
        assert!(mean.abs() < 4.5 * (want / PIXELS as f64).sqrt(), "{n}: {mean}");
        if n > 1 {
            let claimed = (0..PIXELS).map(|k| found.error.at(k).powi(2)).sum::<f64>() / PIXELS as f64;
            let noise = (2.0 / ((n - 1) as f64 * PIXELS as f64)).sqrt();
            assert!((claimed / want - 1.0).abs() < 5.0 * noise + 0.002, "{n}: claimed {claimed}, {want}");
        }
    }
}

#[test]
fn cosmic_rays_in_darks_are_rejected() {
    let chip = Chip::new();
    for n in [3, 5, 9, 20] {
        let mut darks = frames(&chip, 77, n, 0.0, 60.0);
        // one value in 30 pixels hit by 10 to 400 sigma, and two in some
        let mut random = Random(5);
        let noise = (READ * READ + 30.0 / GAIN).sqrt();
        let mut hit = vec![false; PIXELS];
        for k in (0..PIXELS).step_by(30) {
            hit[k] = true;
            for frame in 0..if n >= 9 && k % 60 == 0 { 2 } else { 1 } {
                darks[(k + frame) % n][k] += (noise * (10.0 + 390.0 * random.uniform())) as f32;
            }
        }
        let bias = Bias::Level(0.0);
        let dark = with(&darks, 80, |f| master::dark(f, &bias, 60.0, None)).expect("a dark");
        let off = |k: usize| f64::from(dark.master.value[k]) - chip.bias[k] - 60.0 * chip.dark[k];
        let (mean, variance) = mean_and_variance((0..PIXELS).filter(|k| hit[*k]).map(off));
        let hits = hit.iter().filter(|h| **h).count() as f64;
        let want = noise * noise / (n as f64 - 1.3);
        assert!(mean.abs() < 5.0 * (want / hits).sqrt(), "{n}: {mean} adu left of cosmic rays");
        // 267 pixels: 8.7 % (1 sigma) of the variance
        assert!(variance < want * 1.6, "{n}: {variance} instead of {want}");
    }
}

#[test]
fn a_corrected_frame_is_unbiased_and_its_scatter_is_predicted() {
    let chip = Chip::new();
    for (n, exptime_s, light) in [(5, 10.0, 500.0), (5, 120.0, 20_000.0), (20, 60.0, 3000.0)] {
        let calibration = calibration(&chip, n, 31);
        let extra = calibration.extra(exptime_s, Detail::Median).expect("an exposure");
        let mut random = Random(99);
        let mut frame = chip.frame(&mut random, light, exptime_s);
        let applied = calibration.apply(&mut frame, &exposure(exptime_s)).expect("corrected");
        assert_eq!((applied.bad, applied.saturated.len(), applied.warmer_than_dark_k), (0, 0, None));
        let (mean, variance) = mean_and_variance(frame.iter().map(|v| f64::from(*v)));
        // the chip's mean response is that of its median to its error of 3 % / 89
        let level = light * mean_and_variance(chip.response.iter().copied()).0;
        let own = READ * READ + (0.5 * exptime_s + light) / GAIN;
        let want = own + extra.variance(3, 3, light);
        assert!((variance / want - 1.0).abs() < 0.05, "{n}, {exptime_s} s: {variance} instead of {want}");
        let error = (want / PIXELS as f64).sqrt() + 0.0005 * light;
        assert!((mean - level).abs() < 4.5 * error, "{n}, {exptime_s} s: {mean} instead of {level}");
        // without the masters' share the prediction would fail where it matters
        if exptime_s == 120.0 {
            assert!(own < 0.87 * want, "{own} {want}");
        }
    }
}

/// What is the same in all frames: the mean of many corrected frames differs from pixel to pixel by the masters'
/// errors alone.
#[test]
fn the_noise_of_masters_stays_in_the_mean_of_many_frames() {
    let chip = Chip::new();
    let (exptime_s, light, many) = (90.0, 8000.0, 200);
    let calibration = calibration(&chip, 4, 55);
    let mut sum = vec![0.0; PIXELS];
    let mut random = Random(321);
    for _ in 0..many {
        let mut frame = chip.frame(&mut random, light, exptime_s);
        calibration.apply(&mut frame, &exposure(exptime_s)).expect("corrected");
        sum.iter_mut().zip(&frame).for_each(|(s, v)| *s += f64::from(*v) / f64::from(many));
    }
    let (_, variance) = mean_and_variance(sum.iter().copied());
    let own = (READ * READ + (0.5 * exptime_s + light) / GAIN) / f64::from(many);
    let each = calibration.extra(exptime_s, Detail::EachPixel).expect("an exposure");
    let mean_extra =
        (0..PIXELS).map(|k| each.variance(k % SIZE[0], k / SIZE[0], light)).sum::<f64>() / PIXELS as f64;
    assert!((variance / (own + mean_extra) - 1.0).abs() < 0.075, "{variance} instead of {own} + {mean_extra}");
    assert!(mean_extra > 5.0 * own);
    // the median is a fair summary: of four frames, a squared error has the median of chi^2 of 3, 0.79
    let median = calibration.extra(exptime_s, Detail::Median).expect("an exposure").variance(0, 0, light);
    assert!(median > 0.7 * mean_extra && median < mean_extra, "{median} {mean_extra}");
}

#[test]
fn a_flat_removes_the_pattern_of_response() {
    let chip = Chip::new();
    let light = 30_000.0;
    let raw = frames(&chip, 4, 1, light, 1.0).remove(0);
    let scatter = |frame: &[f32]| mean_and_variance(frame.iter().map(|v| f64::from(*v))).1.sqrt();
    let mut corrected = raw.clone();
    calibration(&chip, 40, 17).apply(&mut corrected, &exposure(1.0)).expect("corrected");
    let noise = (READ * READ + light / GAIN).sqrt();
    assert!(scatter(&raw) > 7.0 * noise);
    assert!(scatter(&corrected) < 1.03 * noise, "{} {noise}", scatter(&corrected));
}

#[test]
fn flats_of_different_levels_join() {
    let chip = Chip::new();
    let mut random = Random(8);
    let flats: Vec<_> = (0..12).map(|k| chip.frame(&mut random, 8000.0 + 3000.0 * f64::from(k), 1.0)).collect();
    let bias = Bias::Level(BIAS);
    let flat = with(&flats, 9, |f| master::flat(f, &bias, None, 1.0)).expect("a flat");
    let (mean, variance) = mean_and_variance((0..PIXELS).map(|k| f64::from(flat.value[k]) / chip.response[k]));
    assert!((mean - 1.0).abs() < 0.002, "{mean}");
    // twelve flats of 25 000 adu: 0.7 % shot noise each, 0.2 % of the mean, and what the bias pattern of 3 adu
    // leaves
    assert!(variance.sqrt() < 0.0035, "{}", variance.sqrt());
}

#[test]
fn what_is_no_number_stays_apart() {
    let chip = Chip::new();
    let mut biases = frames(&chip, 3, 6, 0.0, 0.0);
    biases[2][50] = f32::NAN;
    (0..6).for_each(|k| biases[k][51] = f32::INFINITY);
    let bias = with(&biases, 80, master::bias).expect("a bias");
    assert!((f64::from(bias.value[50]) - chip.bias[50]).abs() < 5.0 * READ / 5f64.sqrt());
    assert!(bias.value[51].is_nan());
    let mut flat = Master { size: SIZE, value: vec![1.0; PIXELS], error: Spread::Same(0.01) };
    (flat.value[60], flat.value[61], flat.value[62], flat.value[63]) = (0.05, f32::NAN, -1.0, 0.06);
    let calibration = Calibration::new(SIZE, Bias::Master(bias), None, Some(flat)).expect("of one size");
    let mut frame = chip.frame(&mut Random(1), 100.0, 1.0);
    frame[64] = f32::NAN;
    let applied = calibration.apply(&mut frame, &exposure(1.0)).expect("corrected");
    assert_eq!(applied.bad, 5);
    assert!([51, 60, 61, 62, 64].iter().all(|k| frame[*k].is_nan()) && frame[63].is_finite());
    let extra = calibration.extra(1.0, Detail::EachPixel).expect("an exposure");
    assert!(extra.variance(61, 0, 10.0).is_nan() && extra.variance(63, 0, 10.0) > 0.0);
    assert!(extra.variance(100, 0, 10.0).is_nan() && extra.variance(0, 80, 10.0).is_nan());
    assert!(calibration.extra(1.0, Detail::Median).expect("an exposure").variance(61, 0, 10.0) > 0.0);
}

#[test]
fn saturation_is_judged_on_raw_values_and_temperatures_are_told() {
    let flat = Master {
        size: SIZE,
        value: (0..PIXELS).map(|k| if k % 2 == 0 { 0.5 } else { 1.5 }).collect(),
        error: Spread::Same(0.0),
    };
    let zero = Master { size: SIZE, value: vec![0.0; PIXELS], error: Spread::Same(0.0) };
    let dark = Dark { master: zero, exptime_s: 10.0, temperature_c: Some(-20.0), shares_bias: false };
    let calibration = Calibration::new(SIZE, Bias::Level(BIAS), Some(dark), Some(flat)).expect("of one size");
    let mut frame = vec![40_000.0; PIXELS];
    (frame[10], frame[11]) = (60_000.0, 65_535.0);
    let warm = Exposure { temperature_c: Some(-14.5), ..exposure(5.0) };
    let applied = calibration.apply(&mut frame, &warm).expect("corrected");
    assert_eq!((applied.saturated.clone(), applied.warmer_than_dark_k), (vec![10, 11], Some(5.5)));
    // a full pixel of high response is below an unsaturated one of low response now
    assert!(frame[11] < frame[0] && applied.is_saturated(11) && !applied.is_saturated(0));
}

/// s = 1: raw - D, the bias drops out; s = 0: the bias alone.
#[test]
fn a_bias_in_frame_and_dark_is_one_error() {
    let master = |error: f32| Master { size: SIZE, value: vec![0.0; PIXELS], error: Spread::Same(error) };
    let variance = |exptime_s: f64, shares_bias: bool| {
        let dark = Dark { master: master(2.0), exptime_s: 10.0, temperature_c: None, shares_bias };
        let all = Calibration::new(SIZE, Bias::Master(master(1.0)), Some(dark), None).expect("of one size");
        all.extra(exptime_s, Detail::Median).expect("an exposure").variance(0, 0, 1e5)
    };
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-6, "{a} {b}");
    near(variance(10.0, true), 4.0);
    near(variance(0.0, true), 1.0);
    near(variance(30.0, true), 4.0 + 36.0);
    near(variance(10.0, false), 5.0);
}

#[test]
fn what_does_not_fit_is_an_error_by_name() {
    let one = |size: [usize; 2], n: usize| Master { size, value: vec![1.0; n], error: Spread::Same(0.0) };
    let told = |result: Result<Calibration, ReduceError>| result.expect_err("refused").to_string();
    let level = || Bias::Level(0.0);
    assert!(told(Calibration::new(SIZE, Bias::Level(f64::NAN), None, None)).contains("bias level"));
    assert!(told(Calibration::new(SIZE, level(), None, Some(one([99, 80], 7920)))).contains("master flat"));
    assert!(told(Calibration::new(SIZE, Bias::Master(one(SIZE, 3)), None, None)).contains("master bias"));
    assert!(
        told(Calibration::new([usize::MAX; 2], Bias::Master(one([usize::MAX; 2], 3)), None, None))
            .contains("master bias")
    );
    let dark = |exptime_s| Dark { master: one(SIZE, PIXELS), exptime_s, temperature_c: None, shares_bias: false };
    for wrong in [0.0, -1.0, f64::NAN] {
        assert!(told(Calibration::new(SIZE, level(), Some(dark(wrong)), None)).contains("exposure of the dark"));
    }
    let good = Calibration::new(SIZE, level(), Some(dark(1.0)), None).expect("good");
    let mut frame = vec![7.0; PIXELS];
    for wrong in [-1.0, f64::NAN, f64::INFINITY] {
        assert!(good.apply(&mut frame, &exposure(wrong)).is_err_and(|e| e.to_string().contains("exposure")));
        assert!(good.extra(wrong, Detail::Median).is_err());
    }
    assert!(frame.iter().all(|v| *v == 7.0));
    assert!(good.apply(&mut [0.0; 5], &exposure(1.0)).is_err_and(|e| e.to_string().contains("frame")));
    // masters
    let empty = with(&[], 1, master::bias);
    assert!(empty.is_err_and(|e| e.to_string().contains("number of frames")));
    assert!(with(&[vec![0.0; PIXELS]], 0, master::bias).is_err_and(|e| e.to_string().contains("rows of a band")));
    let short = with(&[vec![0.0; 500]], 10, master::bias);
    assert!(short.is_err_and(|e| e.to_string().contains("frame 0, rows 0..10: no such rows")));
    let black = with(&[vec![300.0; PIXELS]], 10, |f| master::flat(f, &Bias::Level(300.0), None, 1.0));
    assert!(black.is_err_and(|e| e.to_string().contains("median of a flat")));
    let other = Bias::Master(one([10, 10], 100));
    let flat = with(&[vec![300.0; PIXELS]], 10, |f| master::flat(f, &other, None, 1.0));
    assert!(flat.is_err_and(|e| e.to_string().contains("master bias")));
    let mut wrong = |_: usize, _: std::ops::Range<usize>| Ok(vec![0.0; 3]);
    let frames = Frames { count: 1, size: SIZE, band_rows: 10, read: &mut wrong };
    assert!(master::bias(frames).is_err_and(|e| e.to_string().contains("band of a frame")));
}

#[test]
fn no_more_than_a_band_of_each_frame_is_asked_for() {
    let largest = RefCell::new(0);
    let mut read = |_: usize, rows: std::ops::Range<usize>| {
        let mut most = largest.borrow_mut();
        *most = rows.len().max(*most);
        Ok(vec![1.0; rows.len() * SIZE[0]])
    };
    let frames = Frames { count: 4, size: SIZE, band_rows: 7, read: &mut read };
    let flat = master::flat(frames, &Bias::Level(0.0), None, 1.0).expect("a flat");
    assert_eq!((*largest.borrow(), flat.value.len()), (7, PIXELS));
    assert!(flat.value.iter().all(|v| *v == 1.0));
}

/// One pixel in ten has up to a thousand times the dark signal, so up to twenty times the noise.
#[test]
fn hot_pixels_keep_their_values_and_their_errors() {
    let mut chip = Chip::new();
    (0..PIXELS).step_by(10).for_each(|k| chip.dark[k] *= 10f64.powf(1.0 + 2.0 * k as f64 / PIXELS as f64));
    for n in [3, 5, 10] {
        let darks = frames(&chip, 42, n, 0.0, 60.0);
        let dark = with(&darks, 40, |f| master::dark(f, &Bias::Level(0.0), 60.0, None)).expect("a dark");
        let hot = (0..PIXELS).step_by(10);
        let noise = |k: usize| ((READ * READ + 60.0 * chip.dark[k] / GAIN) / n as f64).sqrt();
        let off = |k: usize| (f64::from(dark.master.value[k]) - chip.bias[k] - 60.0 * chip.dark[k]) / noise(k);
        let (mean, variance) = mean_and_variance(hot.clone().map(off));
        let claimed = hot.map(|k| (dark.master.error.at(k) / noise(k)).powi(2)).sum::<f64>() / 800.0;
        // 800 pixels: 0.035 (1 sigma) of the mean, 0.05 of the variance
        assert!(mean.abs() < 0.16, "{n}: {mean}");
        assert!((variance - 1.0).abs() < 0.25, "{n}: {variance}");
        assert!((claimed - 1.0).abs() < 0.25, "{n}: {claimed}");
    }
}
