//! The detector's steps against theory, their order, and frames that do not depend on how they are computed.

use nightglass::base::simd;
use nightglass::camera::chip::{Chip, Incident};
use nightglass::camera::expose::{self, Rows};
use nightglass::camera::region::Region;
use nightglass::scene::{Options, Scene, load};
use std::convert::Infallible;
use std::ops::Range;
use std::sync::Mutex;

/// Light of a test: the same on all pixels, and some bright ones.
struct Light {
    even: f64,
    spots: Vec<(usize, usize, f64)>,
    width: usize,
}

impl Incident for Light {
    fn add(&self, region: &Region, out: &mut [f64]) {
        out.iter_mut().for_each(|value| *value += self.even);
        for (x, y, electrons) in &self.spots {
            let inside = (region.x0..region.x0 + region.width).contains(x)
                && (region.y0..region.y0 + region.height).contains(y);
            if inside {
                out[(y - region.y0) * region.width + x - region.x0] += electrons;
            }
        }
    }

    fn bright_columns(&self, level_e: f64) -> Vec<Range<usize>> {
        if self.even > level_e {
            return std::iter::once(0..self.width).collect();
        }
        let mut columns = self.spots.iter().filter(|s| s.2 > level_e).map(|s| s.0..s.0 + 1).collect::<Vec<_>>();
        columns.sort_by_key(|c| c.start);
        columns.dedup();
        columns
    }
}

/// A chip of 200 x 150 pixels, gain 1, bias 1000, 32 bits, without noise of its own.
fn scene(more: &[(&str, &str)]) -> Scene {
    let quiet = [
        ("detector.size_px", "[200, 150]"),
        ("detector.gain_e_per_adu", "1.0"),
        ("detector.read_noise_e", "0.0"),
        ("detector.dark_e_per_s", "0.0"),
        ("detector.full_well_e", "1e9"),
        ("detector.bits", "32"),
        ("exposures.duration_s", "10.0"),
    ];
    let sets = quiet.iter().chain(more).map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect::<Vec<_>>();
    load("pogs-geo", &Options { sets: &sets, seed: None }).expect("a good scene")
}

fn stored(scene: &Scene) -> Region {
    let [width, height] = scene.detector.stored_px();
    Region { x0: 0, y0: 0, width, height }
}

/// Numbers less bias of a region of a frame.
fn part(scene: &Scene, light: &Light, frame: usize, region: &Region) -> Vec<f64> {
    let chip = Chip::new(scene, light, frame, scene.exposures.duration_s, region);
    let out = Mutex::new(vec![0.0; region.len()]);
    let Ok(()) = expose::expose(&chip, scene.detector.bits, region, |first, rows| {
        let mut out = out.lock().expect("no panic");
        let rows: Vec<f64> = match rows {
            Rows::U16(rows) => rows.iter().map(|v| f64::from(*v)).collect(),
            Rows::U32(rows) => rows.iter().map(|v| f64::from(*v)).collect(),
        };
        out[first * region.width..][..rows.len()].copy_from_slice(&rows);
        Ok::<(), Infallible>(())
    });
    let bias = scene.detector.bias_adu;
    out.into_inner().expect("no panic").into_iter().map(|v| v - bias).collect()
}

fn frame(scene: &Scene, even: f64, spots: &[(usize, usize, f64)], number: usize) -> Vec<f64> {
    let light = Light { even, spots: spots.to_vec(), width: scene.detector.light_px()[0] };
    part(scene, &light, number, &stored(scene))
}

/// Mean, variance and third central moment.
fn moments(values: &[f64]) -> [f64; 3] {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let central = |k: i32| values.iter().map(|v| (v - mean).powi(k)).sum::<f64>() / n;
    [mean, central(2), central(3)]
}

/// Half the variance of the difference of two frames: what changes from frame to frame.
fn temporal(scene: &Scene, even: f64) -> f64 {
    let (a, b) = (frame(scene, even, &[], 0), frame(scene, even, &[], 1));
    moments(&a.iter().zip(&b).map(|(a, b)| a - b).collect::<Vec<_>>())[1] / 2.0
}

const N: f64 = 30_000.0;
/// Five standard errors of a variance of normal values, relative.
const VARIANCE: f64 = 5.0 * 0.008_17;

fn near(value: f64, expected: f64, relative: f64, what: &str) {
    assert!((value / expected - 1.0).abs() < relative, "{what}: {value}, expected {expected}");
}

#[test]
fn counts_have_the_moments_of_photons() {
    let [mean, variance, third] = moments(&frame(&scene(&[]), 400.0, &[], 0));
    assert!((mean - 400.0).abs() < 5.0 * (400.0 / N).sqrt(), "{mean}");
    near(variance, 400.0, VARIANCE, "variance");
    // the standard error of a third moment is (15 / n)^(1/2) sigma^3
    assert!((third - 400.0).abs() < 5.0 * (15.0 / N).sqrt() * 8000.0, "{third}");
}

#[test]
fn read_noise_and_rounding_add_to_the_variance() {
    let s = scene(&[("detector.read_noise_e", "7.0"), ("detector.gain_e_per_adu", "2.0")]);
    let [mean, variance, third] = moments(&frame(&s, 400.0, &[], 0));
    assert!((mean - 200.0).abs() < 5.0 * (112.0 / N).sqrt(), "{mean}");
    near(variance, (400.0 + 49.0) / 4.0 + 1.0 / 12.0, VARIANCE, "variance");
    assert!((third - 50.0).abs() < 5.0 * (15.0 / N).sqrt() * 112f64.powf(1.5), "{third}");
    assert!((expose::floor(&s.detector) - (49.0 + 4.0 / 12.0)).abs() < 1e-12);
}

#[test]
fn response_and_dark_patterns_are_fixed_by_the_chip() {
    let s = scene(&[("detector.prnu", "0.1")]);
    let [mean, variance, _] = moments(&frame(&s, 400.0, &[], 0));
    near(mean, 400.0, 5.0 * 0.1 / N.sqrt() + 0.002, "mean");
    near(variance, 400.0 + 1600.0, VARIANCE, "variance");
    near(temporal(&s, 400.0), 400.0, VARIANCE, "variance from frame to frame");
    let other = scene(&[("detector.prnu", "0.1"), ("detector.pattern_seed", "2"), ("seed", "20180120")]);
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - 400.0) * (b - 400.0)).sum::<f64>() / N;
    let (first, second) = (frame(&s, 400.0, &[], 0), frame(&s, 400.0, &[], 1));
    near(product(&first, &second), 1600.0, 0.1, "covariance of two frames of a chip");
    assert!(product(&first, &frame(&other, 400.0, &[], 1)).abs() < 5.0 * 2000.0 / N.sqrt());

    let dark = scene(&[("detector.dark_e_per_s", "40.0"), ("detector.dsnu", "0.2")]);
    let [mean, variance, _] = moments(&frame(&dark, 0.0, &[], 0));
    near(mean, 400.0, 5.0 * 0.2 / N.sqrt() + 0.002, "dark");
    near(variance, 400.0 + 6400.0, 0.08, "dark variance");
    near(temporal(&dark, 0.0), 400.0, VARIANCE, "dark variance from frame to frame");
}

// The order of the steps, each neighbouring pair.

#[test]
fn response_acts_on_light_and_not_on_dark_charge_or_smear() {
    let uneven = ("detector.prnu", "0.5");
    let s = scene(&[uneven, ("detector.dark_e_per_s", "40.0")]);
    near(moments(&frame(&s, 0.0, &[], 0))[1], 400.0, VARIANCE, "dark charge has no response");
    let s = scene(&[uneven, ("detector.frame_transfer_s", "1.0")]);
    // a bright pixel smears its column with 1e7 x 0.1 / 150 e- each
    let smeared = frame(&s, 0.0, &[(50, 70, 1e7)], 0);
    let column = (0..150).filter(|y| *y != 70).map(|y| smeared[y * 200 + 50]).collect::<Vec<_>>();
    let expected = column.iter().sum::<f64>() / 149.0;
    near(moments(&column)[1], expected, 0.7, "smear has photon noise alone");
    assert!((0.3..1.7).contains(&(expected / (1e7 * 0.1 / 150.0))));
    assert!(smeared.iter().enumerate().all(|(i, v)| i % 200 == 50 || *v == 0.0));
}

#[test]
fn dark_charge_and_smear_come_before_the_count() {
    let s = scene(&[("detector.dark_e_per_s", "40.0")]);
    near(moments(&frame(&s, 100.0, &[], 0))[1], 500.0, VARIANCE, "the sum has one photon noise");
}

#[test]
fn cosmic_rays_come_after_the_count_and_before_the_well() {
    let rays = ("detector.cosmic_rays_per_cm2_s", "500.0");
    let hit = frame(&scene(&[rays]), 0.0, &[], 0);
    let struck = hit.iter().filter(|v| **v > 0.0).collect::<Vec<_>>();
    assert!(struck.len() > 100 && struck.iter().any(|v| **v > 1000.0));
    // their charge is not counted anew: with light it is the same on top, within the light's noise
    let lit = frame(&scene(&[rays]), 25.0, &[], 0);
    let plain = frame(&scene(&[]), 25.0, &[], 0);
    assert!(lit.iter().zip(&plain).zip(&hit).all(|((lit, plain), hit)| lit - plain == *hit));
    let full = frame(&scene(&[rays, ("detector.full_well_e", "500.0")]), 0.0, &[], 0);
    assert!(full.iter().zip(&hit).all(|(full, hit)| *full == hit.min(500.0)));
}

#[test]
fn charge_blooms_after_it_is_counted_and_before_it_moves() {
    let blooming = [("detector.full_well_e", "5000.0"), ("detector.blooming", "true")];
    let s = scene(&blooming);
    let spots = [(50, 70, 200_000.0), (120, 20, 30_000.0)];
    let free = frame(&scene(&[]), 10.0, &spots, 0);
    let bloomed = frame(&s, 10.0, &spots, 0);
    assert!(bloomed.iter().all(|v| *v <= 5000.0));
    for (x, reach) in [(50, 21), (120, 4)] {
        let column = |f: &[f64]| (0..150).map(|y| f[y * 200 + x]).collect::<Vec<_>>();
        // conserved while it stays in the column
        assert_eq!(column(&bloomed).iter().sum::<f64>(), column(&free).iter().sum::<f64>(), "column {x}");
        let full = column(&bloomed).iter().filter(|v| **v == 5000.0).count();
        assert!(full.abs_diff(2 * reach) < 5, "column {x}: {full} full pixels");
    }
    let elsewhere = |i: &usize| ![50, 120].contains(&(i % 200));
    assert!((0..free.len()).filter(elsewhere).all(|i| free[i] == bloomed[i]));
    // with transfer losses: the trail is a share of what the well holds, not of what fell on it
    let moved = scene(&[blooming[0], blooming[1], ("detector.cti", "1e-3")]);
    let trail = frame(&moved, 0.0, &spots, 0);
    assert!(trail.iter().all(|v| *v <= 5000.0 + 1.0));
    let behind = (0..150).map(|y| trail[y * 200 + 51]).fold(0.0, f64::max);
    near(behind, 5000.0 * 51.0 * 1e-3, 0.1, "trail along the register");
    // charge leaves at the end of a column
    let lost = frame(&s, 0.0, &[(10, 0, 100_000.0)], 0);
    let kept = lost.iter().sum::<f64>();
    assert!(kept < 60_000.0 && kept > 45_000.0, "{kept}");
}

#[test]
fn charge_moves_before_the_output_bends_it() {
    // two transfers' trail of a full pixel, bent by half at full well: the trail itself, small, is hardly bent
    let s = scene(&[
        ("detector.cti", "1e-3"),
        ("detector.nonlinearity", "0.5"),
        ("detector.full_well_e", "100000.0"),
        ("detector.overscan_px", "8"),
    ]);
    let f = frame(&s, 0.0, &[(199, 100, 90_000.0)], 0);
    let (held, trail) = (f[100 * 208 + 199], f[100 * 208 + 200]);
    let (down, along) = ((1.0f64 - 1e-3).powi(101), (1.0f64 - 1e-3).powi(200));
    let charge = 90_000.0 * down * along;
    near(held, charge * (1.0 - 0.5 * charge / 1e5), 0.02, "pixel");
    let deferred = charge * 200.0 * 1e-3 / (1.0 - 1e-3);
    near(trail, deferred * (1.0 - 0.5 * deferred / 1e5), 0.03, "trail in the overscan");
}

#[test]
fn the_output_bends_charge_before_noise_is_added() {
    // near full well the slope is 1 - 2 x 0.5 x 0.99 = 0.01: photon noise all but vanishes, read noise does not
    let s = scene(&[
        ("detector.nonlinearity", "0.5"),
        ("detector.full_well_e", "1e6"),
        ("detector.read_noise_e", "30.0"),
    ]);
    let [mean, variance, _] = moments(&frame(&s, 1e6 - 1e4, &[], 0));
    near(mean, 0.5e6, 1e-3, "mean");
    near(variance, 900.0 + 1e-4 * 0.99e6, 0.05, "variance");
}

#[test]
fn noise_comes_before_the_converter_and_bias_before_the_cut() {
    // 0.3 ADU is seen on average although no number is 0.3, and half the noise is below the bias
    let s = scene(&[("detector.read_noise_e", "5.0"), ("detector.gain_e_per_adu", "4.0")]);
    let values = frame(&s, 1.2, &[], 0);
    assert!((moments(&values)[0] - 0.3).abs() < 5.0 * (1.7 / N).sqrt());
    assert!(values.iter().any(|v| *v < 0.0));
    let cut = frame(&scene(&[("detector.read_noise_e", "5.0"), ("detector.bias_adu", "0.0")]), 0.0, &[], 0);
    assert!(cut.iter().all(|v| *v >= 0.0) && cut.contains(&0.0));
}

#[test]
fn the_bias_has_its_structure_in_columns_and_rows() {
    let s = scene(&[("detector.bias_structure_adu", "20.0"), ("detector.overscan_px", "20")]);
    let f = frame(&s, 0.0, &[], 0);
    near(moments(&f)[1], 400.0, 0.5, "variance");
    assert_eq!(f, frame(&s, 0.0, &[], 1));
    // less its row and column it is nothing
    let at = |x: usize, y: usize| f[y * 220 + x];
    for (x, y) in [(3, 7), (150, 140), (219, 70)] {
        assert!((at(x, y) - at(x, 0) - at(0, y) + at(0, 0)).abs() <= 2.0);
    }
}

#[test]
fn overscan_sees_no_light_and_trails_show_the_transfer_losses() {
    let s = scene(&[("detector.overscan_px", "16"), ("detector.cti", "1e-5")]);
    let f = frame(&s, 10_000.0, &[], 0);
    let column = |x: usize| (0..150).map(|y| f[y * 216 + x]).sum::<f64>() / 150.0;
    // extended pixel edge response: the first overscan column holds n cti of the last lit one
    near(column(200), 10_000.0 * 200.0 * 1e-5, 0.1, "first overscan column");
    assert!(column(205) < 0.01 && column(215) < 0.01);
}

#[test]
fn binned_pixels_hold_the_charge_of_their_parts() {
    let of = |more: &[(&str, &str)], even: f64| {
        let all = [&[("detector.binning", "2"), ("detector.read_noise_e", "6.0")], more].concat();
        let s = scene(&all);
        assert_eq!(s.detector.stored_px(), [100, 75]);
        moments(&frame(&s, even, &[], 0))
    };
    // relative standard error of a variance of 7500 values: 1.6 %
    near(of(&[], 0.0)[1], 36.0 + 1.0 / 12.0, 0.09, "one read of a binned CCD pixel");
    let cmos = [
        ("detector.kind", "cmos"),
        ("detector.cmos_read_noise_spread", "0.0"),
        ("detector.cmos_gain_spread", "0.0"),
    ];
    near(of(&cmos, 0.0)[1], 4.0 * 36.0 + 1.0 / 12.0, 0.09, "four reads of a binned CMOS pixel");
    let dark = of(&[("detector.dark_e_per_s", "10.0")], 0.0);
    near(dark[0], 400.0, 0.01, "dark charge of four pixels");
    let sharp = scene(&[("detector.binning", "2")]);
    let plain = scene(&[]);
    near(sharp.stored_scale_arcsec(), 2.0 * plain.stored_scale_arcsec(), 1e-12, "scale");
}

#[test]
fn active_pixels_have_noise_and_gain_of_their_own() {
    let cmos = [("detector.kind", "cmos"), ("detector.read_noise_e", "2.0"), ("detector.gain_e_per_adu", "0.1")];
    let s = scene(&[
        cmos[0],
        cmos[1],
        cmos[2],
        ("detector.cmos_read_noise_spread", "0.4"),
        ("detector.cmos_gain_spread", "0.0"),
    ]);
    let frames = (0..40).map(|k| frame(&s, 0.0, &[], k)).collect::<Vec<_>>();
    let logs = (0..N as usize).map(|i| {
        let variance = frames.iter().map(|f| f[i] * f[i]).sum::<f64>() / 40.0;
        0.5 * variance.ln()
    });
    let [mean, variance, _] = moments(&logs.collect::<Vec<_>>());
    // the logarithm of a standard deviation from 40 values: mean -1/80, variance 1/80
    assert!((mean - 20f64.ln() + 1.0 / 80.0).abs() < 0.02, "{mean}");
    near(variance, 0.16 + 1.0 / 80.0, 0.05, "spread of the read noise");
    let gains = scene(&[cmos[0], ("detector.read_noise_e", "0.0"), ("detector.cmos_gain_spread", "0.02")]);
    let f = frame(&gains, 1e6, &[], 0);
    near(moments(&f)[1], 1e6 + 4e8, 0.05, "spread of the gain");
}

#[test]
fn an_iris_takes_light_from_the_corners_alone() {
    let s = scene(&[("detector.shutter_s", "0.5"), ("detector.dark_e_per_s", "100.0")]);
    let f = frame(&s, 1e6, &[], 0);
    near(f[75 * 200 + 100], 1e6 + 1000.0, 0.01, "centre");
    near(f[0], 0.9 * 1e6 + 1000.0, 0.01, "corner: 2 x 0.5 s of 10 s");
}

/// Everything a chip can do.
const EVERYTHING: [(&str, &str); 18] = [
    ("detector.size_px", "[180, 330]"),
    ("detector.read_noise_e", "8.0"),
    ("detector.prnu", "0.02"),
    ("detector.dark_e_per_s", "3.0"),
    ("detector.dsnu", "0.3"),
    ("detector.hot_pixel_fraction", "0.01"),
    ("detector.cosmic_rays_per_cm2_s", "50.0"),
    ("detector.full_well_e", "20000.0"),
    ("detector.blooming", "true"),
    ("detector.cti", "2e-4"),
    ("detector.nonlinearity", "0.02"),
    ("detector.bias_structure_adu", "4.0"),
    ("detector.overscan_px", "13"),
    ("detector.shutter_s", "0.02"),
    ("detector.frame_transfer_s", "0.01"),
    ("detector.bits", "16"),
    ("detector.gain_e_per_adu", "1.5"),
    ("telescope.vignetting", "0.3"),
];

fn spots() -> Vec<(usize, usize, f64)> {
    vec![(50, 70, 2e6), (120, 20, 30_000.0), (7, 329, 90_000.0), (179, 200, 1e5), (51, 75, 8e4)]
}

/// Threads, crops, bands and instruction sets: the same numbers.
#[test]
fn every_step_together_gives_the_same_frame_however_it_is_computed() {
    let cmos = [("detector.kind", "cmos"), ("detector.blooming", "false")];
    for more in [&[][..], &cmos[..], &[("detector.binning", "2"), ("detector.bits", "32")]] {
        let s = scene(&[&EVERYTHING[..], more].concat());
        let size = s.detector.light_px();
        let inside = |s: &(usize, usize, f64)| s.0 < size[0] && s.1 < size[1];
        let light = Light { even: 300.0, spots: spots().into_iter().filter(inside).collect(), width: size[0] };
        let all = stored(&s);
        let expected = part(&s, &light, 3, &all);
        for threads in [1, 2, 4] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            assert_eq!(pool.install(|| part(&s, &light, 3, &all)), expected, "{threads} threads");
        }
        for count in 1..=simd::Path::all().len() {
            simd::hold_to(count);
            assert_eq!(part(&s, &light, 3, &all), expected, "instructions {count}");
        }
        simd::hold_to(usize::MAX);
        for region in [
            Region { x0: 0, y0: 0, width: 1, height: 1 },
            Region { x0: 37, y0: 61, width: 41, height: 77 },
            Region { x0: all.width - 20, y0: all.height - 9, width: 20, height: 9 },
            Region { x0: all.width - 3, y0: 5, width: 3, height: 40 },
            Region { x0: 0, y0: 64, width: all.width, height: 1 },
        ] {
            for (i, value) in part(&s, &light, 3, &region).iter().enumerate() {
                let (x, y) = (region.x0 + i % region.width, region.y0 + i / region.width);
                assert_eq!(*value, expected[y * all.width + x], "pixel {x}, {y} of {region:?}");
            }
        }
    }
}

#[test]
fn extreme_settings_end_in_range() {
    for bits in ["8", "10", "12", "14", "16", "32"] {
        let s = scene(&[("detector.bits", bits), ("detector.bias_adu", "0.0"), ("detector.full_well_e", "1e12")]);
        let top = ((1u64 << s.detector.bits) - 1) as f64;
        let f = frame(&s, 0.0, &[(3, 3, 1e11)], 0);
        assert_eq!((f[3 * 200 + 3], f[0]), (top, 0.0), "{bits} bits");
    }
    for blooming in ["true", "false"] {
        let s = scene(&[
            ("detector.full_well_e", "0.0"),
            ("detector.blooming", blooming),
            ("detector.nonlinearity", "0.1"),
        ]);
        assert!(frame(&s, 500.0, &[(3, 3, 1e6)], 0).iter().all(|v| *v == 0.0), "full well 0");
    }
    let one = scene(&[&EVERYTHING[1..], &[("detector.size_px", "1"), ("detector.overscan_px", "0")]].concat());
    assert_eq!(frame(&one, 300.0, &[], 0).len(), 1);
    for even in [0.0, 1e-300, 1e9, f64::MAX] {
        let s = scene(&[("detector.full_well_e", "1e12")]);
        let f = frame(&s, even, &[], 0);
        assert!(f.iter().all(|v| v.is_finite() && *v >= 0.0 && *v <= u32::MAX as f64), "{even}");
        assert!(even > 1.0 || f.iter().all(|v| *v == 0.0));
    }
    let all = scene(&[
        ("detector.cti", "1.0"),
        ("detector.prnu", "1.0"),
        ("detector.hot_pixel_fraction", "1.0"),
        ("detector.dsnu", "10.0"),
    ]);
    assert!(frame(&all, 300.0, &[], 0).iter().all(|v| v.is_finite()));
}

/// 2^28 pixels pass through in bands: no buffer of the frame's size is held.
#[test]
fn a_frame_of_16384_squared_passes_in_bands() {
    let s = scene(&[("detector.size_px", "16384"), ("detector.bits", "16")]);
    let light = Light { even: 5.0, spots: Vec::new(), width: 16_384 };
    let region = stored(&s);
    let chip = Chip::new(&s, &light, 0, 1.0, &region);
    let sum = Mutex::new((0u64, 0u64));
    let Ok(()) = expose::expose(&chip, 16, &region, |_, rows| {
        if let Rows::U16(rows) = rows {
            let mut total = sum.lock().expect("no panic");
            total.0 += rows.iter().map(|v| u64::from(*v)).sum::<u64>();
            total.1 += rows.len() as u64;
        }
        Ok::<(), Infallible>(())
    });
    let (total, pixels) = sum.into_inner().expect("no panic");
    assert_eq!(pixels, 1 << 28);
    let mean = total as f64 / pixels as f64 - 1000.0;
    assert!((mean - 5.0).abs() < 5.0 * (5.0 / pixels as f64).sqrt(), "{mean}");
}
