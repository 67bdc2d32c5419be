//! A frame as the page stores it: a binned overview of 8 bits, and cut-outs of 16 bits with the pixels' own values.
//!
//! The overview's codes are c = [`ZERO`] + [`GAIN`] asinh((v - median) / (4 sigma)) with the median and the scatter sigma (from
//! quartiles) of the binned pixels v \[ADU\]: the noise spans some ten codes, saturated stars are not clipped. A code is
//! turned back into a value by the inverse, so that the reader's own stretch needs no second picture.

use base64::Engine;
use image::ExtendedColorType;
use image::codecs::jpeg::JpegEncoder;
use rayon::prelude::*;
use serde_json::{Value as Json, json};

/// Code of the median.
const ZERO: f32 = 32.0;
/// Codes a unit of asinh.
const GAIN: f32 = 18.0;
/// Largest side \[px\] and quality of overviews, the best first.
const LADDER: [(usize, u8); 7] = [(1024, 88), (1024, 75), (1024, 60), (720, 70), (512, 70), (360, 60), (256, 50)];
/// Values looked at for a median.
const LOOKED_AT: usize = 100_000;

/// Pixels \[ADU\] by rows, y upwards.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pixels<'p> {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Values.
    pub data: &'p [f32],
}

/// Median and scatter of the finite ones of many values, by a part of them; zeros for none.
pub(super) fn level(values: &[f32]) -> (f32, f32) {
    let step = (values.len() / LOOKED_AT).max(1) | 1;
    let mut some = values.iter().copied().step_by(step).filter(|v| v.is_finite()).collect::<Vec<_>>();
    some.sort_by(f32::total_cmp);
    let at = |share: f64| some.get((share * (some.len().max(1) - 1) as f64) as usize).copied().unwrap_or(0.0);
    (at(0.5), (at(0.75) - at(0.25)) / 1.349)
}

/// The value that a share of the finite ones lies below.
pub(super) fn quantile(values: &[f32], share: f64) -> f32 {
    let mut some = values.iter().copied().filter(|v| v.is_finite()).collect::<Vec<_>>();
    if some.is_empty() {
        return 0.0;
    }
    let at = ((share * (some.len() - 1) as f64) as usize).min(some.len() - 1);
    *some.select_nth_unstable_by(at, f32::total_cmp).1
}

/// A binned frame.
#[derive(Debug)]
pub(super) struct Binned {
    pub bin: usize,
    pub columns: usize,
    pub rows: usize,
    /// Means \[ADU\] by rows, y upwards; NaN where no pixel is a number.
    pub values: Vec<f32>,
}

/// Means over squares, so that no side is longer than `largest` \[px\].
pub(super) fn binned(pixels: Pixels, largest: usize) -> Binned {
    let bin = pixels.width.max(pixels.height).div_ceil(largest.max(1)).max(1);
    let (columns, rows) = (pixels.width.div_ceil(bin), pixels.height.div_ceil(bin));
    let mut values = vec![f32::NAN; columns * rows];
    values.par_chunks_mut(columns.max(1)).enumerate().for_each(|(row, out)| {
        let mut sums = vec![(0.0f64, 0u32); columns];
        for line in pixels.data.chunks_exact(pixels.width.max(1)).skip(row * bin).take(bin) {
            for (sum, values) in sums.iter_mut().zip(line.chunks(bin)) {
                for v in values.iter().filter(|v| v.is_finite()) {
                    *sum = (sum.0 + f64::from(*v), sum.1 + 1);
                }
            }
        }
        out.iter_mut()
            .zip(sums)
            .filter(|(_, (_, n))| *n > 0)
            .for_each(|(v, (sum, n))| *v = (sum / f64::from(n)) as f32);
    });
    Binned { bin, columns, rows, values }
}

/// The overview of a frame in at most `budget` bytes, if any fits: its description and the bytes of a JPEG file, whose first row is the
/// highest.
pub(super) fn overview(pixels: Pixels, budget: usize) -> Option<(Json, Vec<u8>)> {
    let mut last: Option<(usize, Binned, Vec<u8>, [f32; 2])> = None;
    for (largest, quality) in LADDER {
        if last.as_ref().is_none_or(|(side, ..)| *side != largest) {
            let own = binned(pixels, largest);
            let (median, sigma) = level(&own.values);
            let unit = 4.0 * if sigma > 0.0 { sigma } else { 1.0 };
            let code = |v: f32| (ZERO + GAIN * ((v - median) / unit).asinh()).round().clamp(0.0, 255.0) as u8;
            let lines = own.values.chunks_exact(own.columns.max(1)).rev();
            let codes = lines.flatten().map(|v| if v.is_finite() { code(*v) } else { 0 }).collect();
            last = Some((largest, own, codes, [median, unit]));
        }
        let Some((_, own, codes, [median, unit])) = &last else { continue };
        let mut jpeg = Vec::new();
        let (width, height) = (u32::try_from(own.columns).ok()?, u32::try_from(own.rows).ok()?);
        let encoded =
            JpegEncoder::new_with_quality(&mut jpeg, quality).encode(codes, width, height, ExtendedColorType::L8);
        if encoded.is_ok() && jpeg.len() <= budget {
            let told = json!({
                "bin": own.bin, "columns": own.columns, "rows": own.rows, "zero": ZERO, "gain": GAIN, "median": median,
                "unit": unit, "low": median - 0.375 * unit, "high": quantile(&own.values, 0.9995).max(median + 10.0 * unit),
            });
            return Some((told, jpeg));
        }
    }
    None
}

/// A cut-out of a side around a place: its description with the pixels in base64, unsigned 16 bits, little endian, y upwards. A
/// pixel is `offset` + `step` times its number; 65535 is no number where `blank` says so.
pub(super) fn cut_out(pixels: Pixels, [x, y]: [f64; 2], side: usize) -> Option<Json> {
    let first = |at: f64, size: usize| {
        let most = size.saturating_sub(side);
        ((at - side as f64 / 2.0).round().max(0.0) as usize).min(most)
    };
    let inside = |at: f64, size: usize| at >= -0.5 && at < size as f64 - 0.5;
    if !(inside(x, pixels.width) && inside(y, pixels.height)) {
        return None;
    }
    let (x0, y0) = (first(x, pixels.width), first(y, pixels.height));
    let (width, height) = (side.min(pixels.width), side.min(pixels.height));
    let lines = pixels.data.chunks_exact(pixels.width).skip(y0).take(height);
    let values = lines.flat_map(|line| line[x0..x0 + width].iter().copied()).collect::<Vec<_>>();
    let finite = || values.iter().copied().filter(|v| v.is_finite());
    let (low, high) = (finite().fold(f32::INFINITY, f32::min), finite().fold(f32::NEG_INFINITY, f32::max));
    let blank = finite().count() < values.len();
    let most: f64 = if blank { 65_534.0 } else { 65_535.0 };
    let whole = low >= 0.0 && f64::from(high) <= most && finite().all(|v| v.fract() == 0.0);
    let (offset, step) = if whole || low > high {
        (0.0, 1.0)
    } else {
        let span = f64::from(high) - f64::from(low);
        // integers too large for 16 bits keep whole steps, other numbers all the steps there are
        let step = if finite().all(|v| v.fract() == 0.0) { (span / most).ceil().max(1.0) } else { span / most };
        (f64::from(low), if step > 0.0 { step } else { 1.0 })
    };
    let number = |v: f32| if v.is_finite() { ((f64::from(v) - offset) / step).round() as u16 } else { u16::MAX };
    let bytes = values.iter().flat_map(|v| number(*v).to_le_bytes()).collect::<Vec<_>>();
    let data = base64::engine::general_purpose::STANDARD.encode(bytes);
    Some(json!({
        "x0": x0, "y0": y0, "width": width, "height": height, "offset": offset, "step": step, "blank": blank,
        "sigma": level(&values).1, "data": data,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(cut: &Json) -> Vec<f64> {
        let bytes =
            base64::engine::general_purpose::STANDARD.decode(cut["data"].as_str().expect("text")).expect("base64");
        let (offset, step) = (cut["offset"].as_f64().expect("offset"), cut["step"].as_f64().expect("step"));
        bytes.chunks(2).map(|b| offset + step * f64::from(u16::from_le_bytes([b[0], b[1]]))).collect()
    }

    #[test]
    fn cut_outs_hold_the_pixels_themselves() {
        let data = (0..30 * 20).map(|i| (1000 + i) as f32).collect::<Vec<_>>();
        let pixels = Pixels { width: 30, height: 20, data: &data };
        let cut = cut_out(pixels, [29.0, 0.0], 8).expect("inside");
        assert_eq!((cut["x0"].as_u64(), cut["y0"].as_u64()), (Some(22), Some(0)));
        let own = numbers(&cut);
        assert_eq!((own[0], own[7], own[8]), (1022.0, 1029.0, 1052.0));
        for place in [[30.0, 5.0], [-1.0, 5.0], [f64::NAN, 5.0], [1.0, f64::INFINITY]] {
            assert!(cut_out(pixels, place, 8).is_none(), "{place:?}");
        }
        assert_eq!(numbers(&cut_out(pixels, [3.0, 3.0], 64).expect("the whole")).len(), 600);
    }

    #[test]
    fn other_numbers_are_kept_to_a_step() {
        for data in
            [vec![-1.5f32, 0.25, 3e5, 7.0], vec![0.0, 4e9, 17.0, 3.0], vec![f32::NAN, 5.0, 1e6, 2.5], vec![2.5; 4]]
        {
            let cut = cut_out(Pixels { width: 2, height: 2, data: &data }, [0.0, 0.0], 2).expect("inside");
            let step = cut["step"].as_f64().expect("step");
            for (own, v) in numbers(&cut).iter().zip(&data).filter(|(_, v)| v.is_finite()) {
                assert!((own - f64::from(*v)).abs() <= 0.51 * step, "{own} {v} {step}");
            }
        }
        let none = cut_out(Pixels { width: 1, height: 1, data: &[f32::NAN] }, [0.0, 0.0], 4).expect("inside");
        assert_eq!(none["blank"], true);
    }

    #[test]
    fn binning_means_what_is_there() {
        let data = [1.0, 3.0, 5.0, f32::NAN, 3.0, f32::NAN];
        let own = binned(Pixels { width: 3, height: 2, data: &data }, 2);
        assert_eq!((own.bin, own.columns, own.rows), (2, 2, 1));
        assert!((own.values[0] - 7.0 / 3.0).abs() < 1e-6 && own.values[1] == 5.0);
        assert!(binned(Pixels { width: 0, height: 0, data: &[] }, 8).values.is_empty());
    }

    #[test]
    fn overviews_fit_their_budget_or_are_left_out() {
        let data = (0..300 * 200u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 20) as f32).collect::<Vec<_>>();
        let pixels = Pixels { width: 300, height: 200, data: &data };
        for budget in [1 << 20, 20_000] {
            let (told, jpeg) = overview(pixels, budget).expect("one fits");
            assert!(jpeg.len() <= budget && jpeg.starts_with(&[0xff, 0xd8]));
            assert_eq!(told["rows"].as_u64(), Some(200_u64.div_ceil(told["bin"].as_u64().expect("bin"))));
        }
        assert!(overview(pixels, 100).is_none());
        assert!(overview(Pixels { width: 1, height: 1, data: &[f32::NAN] }, 10_000).is_some());
    }
}
