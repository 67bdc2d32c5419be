//! A picture of a frame for people: binned to at most 1024 pixels a side, north-up as stored (first row at the
//! bottom, as DS9 shows it), stretched by asinh between the sky and the 99.9 % point.
//!
//! Value = asinh(s (v - low) / (high - low)) / asinh(s) with s = 20, low = median - 1.5 sigma (from quartiles) and high
//! the 99.9 % point, at least low + 30 sigma.

use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use std::io;
use std::sync::{Mutex, PoisonError};

/// Largest side of a picture \[px\].
const LARGEST: usize = 1024;
/// Strength of the stretch.
const STRETCH: f32 = 20.0;

/// The picture of a frame, whose rows come in any order.
#[derive(Debug)]
pub struct Preview {
    width: usize,
    height: usize,
    bin: usize,
    /// Sums of the binned pixels \[ADU\], by rows.
    sums: Mutex<Vec<u64>>,
}

impl Preview {
    /// An empty picture of a frame of `width` x `height` pixels.
    pub fn new(width: usize, height: usize) -> Self {
        let bin = width.max(height).div_ceil(LARGEST).max(1);
        let sums = Mutex::new(vec![0; width.div_ceil(bin) * height.div_ceil(bin)]);
        Self { width, height, bin, sums }
    }

    /// Take in rows from `first_row` on.
    pub fn rows<N: Copy + Into<u64>>(&self, first_row: usize, adu: &[N]) {
        let columns = self.width.div_ceil(self.bin);
        let mut sums = self.sums.lock().unwrap_or_else(PoisonError::into_inner);
        for (y, row) in (first_row..).zip(adu.chunks_exact(self.width)) {
            let sums = &mut sums[y / self.bin * columns..][..columns];
            for (sum, pixels) in sums.iter_mut().zip(row.chunks(self.bin)) {
                *sum += pixels.iter().map(|v| (*v).into()).sum::<u64>();
            }
        }
    }

    /// The bytes of the PNG file.
    ///
    /// # Errors
    /// Whatever the encoder says.
    pub fn png(self) -> io::Result<Vec<u8>> {
        let (columns, rows) = (self.width.div_ceil(self.bin), self.height.div_ceil(self.bin));
        let sums = self.sums.into_inner().unwrap_or_else(PoisonError::into_inner);
        let within = |at: usize, size: usize| ((at + 1) * self.bin).min(size) - at * self.bin;
        let mean = |x: usize, y: usize| {
            sums[y * columns + x] as f32 / (within(x, self.width) * within(y, self.height)) as f32
        };
        let binned = (0..rows).rev().flat_map(|y| (0..columns).map(move |x| mean(x, y))).collect::<Vec<_>>();
        encoded(columns, rows, &shades(&binned), ExtendedColorType::L8)
    }
}

fn encoded(width: usize, height: usize, bytes: &[u8], colour: ExtendedColorType) -> io::Result<Vec<u8>> {
    let mut out = Vec::new();
    let encoder = PngEncoder::new(&mut out);
    encoder.write_image(bytes, width as u32, height as u32, colour).map_err(io::Error::other)?;
    Ok(out)
}

/// The bytes of a PNG file of red, green and blue, by rows from the top.
///
/// # Errors
/// Whatever the encoder says; also for a number of bytes that does not fit.
pub fn rgb_png(width: usize, height: usize, rgb: &[u8]) -> io::Result<Vec<u8>> {
    if rgb.len() != 3 * width * height {
        return Err(io::Error::other(format!("{} bytes for {width} x {height} pixels", rgb.len())));
    }
    encoded(width, height, rgb, ExtendedColorType::Rgb8)
}

/// Shades of values, by the stretch of all previews; what is no number is black.
pub fn shades(values: &[f32]) -> Vec<u8> {
    let finite = values.iter().copied().filter(|v| v.is_finite()).collect::<Vec<_>>();
    let (low, high) = limits(&finite);
    let shade = |v: &f32| {
        let share = ((v - low) / (high - low)).clamp(0.0, 1.0);
        ((STRETCH * share).asinh() / STRETCH.asinh() * 255.0).round() as u8
    };
    values.iter().map(shade).collect()
}

/// Black and white of the stretch.
fn limits(values: &[f32]) -> (f32, f32) {
    let mut sorted = values.to_vec();
    sorted.sort_by(f32::total_cmp);
    let at = |share: f64| sorted.get((share * (sorted.len().max(1) - 1) as f64) as usize).copied().unwrap_or(0.0);
    let sigma = ((at(0.75) - at(0.25)) / 1.349).max(0.1);
    let low = at(0.5) - 1.5 * sigma;
    (low, at(0.999).max(low + 30.0 * sigma))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_are_png_of_at_most_1024_pixels() {
        for (width, height) in [(1, 1), (30, 20), (2500, 3), (4096, 2), (1, 5000)] {
            let preview = Preview::new(width, height);
            preview.rows(0, &vec![1000u16; width * height]);
            let bytes = preview.png().expect("encodes");
            assert_eq!(&bytes[1..4], b"PNG");
            let side = u32::from_be_bytes([bytes[16], bytes[17], bytes[18], bytes[19]]);
            assert!((1..=1024).contains(&side), "{side}");
        }
    }
}
