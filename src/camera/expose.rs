//! Exposures by bands of rows: numbers, means and variances of the pixels of any region.

use super::chip::{Chip, Scratch, band_rows};
use super::detector::convert::Number;
use super::region::Region;
use crate::scene::Detector;
use rayon::prelude::*;

/// Numbers of some rows of a frame, as stored.
#[derive(Debug, Clone, Copy)]
pub enum Rows<'r> {
    /// Up to 16 bits.
    U16(&'r [u16]),
    /// Up to 32 bits.
    U32(&'r [u32]),
}

/// Compute the numbers \[ADU\] of the pixels of `region` by bands of rows, in parallel, and hand each band to `take` with the
/// number of its first row in the region. The result depends neither on the bands nor on the threads.
///
/// # Errors
/// The first error of `take`.
pub fn expose<E: Send>(
    chip: &Chip,
    bits: u32,
    region: &Region,
    take: impl Fn(usize, Rows) -> Result<(), E> + Sync,
) -> Result<(), E> {
    if bits > 16 {
        bands(chip, region, |row, numbers: &[u32]| take(row, Rows::U32(numbers)))
    } else {
        bands(chip, region, |row, numbers: &[u16]| take(row, Rows::U16(numbers)))
    }
}

fn bands<N: Number, E: Send>(
    chip: &Chip,
    region: &Region,
    take: impl Fn(usize, &[N]) -> Result<(), E> + Sync,
) -> Result<(), E> {
    if region.is_empty() {
        return Ok(());
    }
    let rows = band_rows(region.width);
    (0..region.height.div_ceil(rows)).into_par_iter().try_for_each_init(
        || (Scratch::default(), Vec::new()),
        |(scratch, numbers), band| {
            let first = band * rows;
            let band = Region { y0: region.y0 + first, height: rows.min(region.height - first), ..*region };
            numbers.resize(band.len(), N::default());
            chip.read(&band, numbers, scratch);
            take(first, numbers)
        },
    )
}

/// Variance \[e-^2\] of a pixel's number beyond that of its counted electrons: read-out and rounding.
pub fn floor(d: &Detector) -> f64 {
    d.read_noise_rms_e().powi(2) + d.gain_e_per_adu.powi(2) / 12.0
}

/// The means \[e-\] of the charge that falls on the pixels of `region`, before anything holds or moves it, 0 in the overscan, and the variances \[e-^2\] (shot, read-out, rounding).
pub fn planes(chip: &Chip, detector: &Detector, region: &Region) -> (Vec<f32>, Vec<f32>) {
    let mut mean = vec![0.0f32; region.len()];
    let light = (region.x0 + region.width).min(detector.light_px()[0]).saturating_sub(region.x0);
    if light > 0 && !region.is_empty() {
        let rows = band_rows(region.width);
        mean.par_chunks_mut(rows * region.width).enumerate().for_each(|(band, out)| {
            let height = out.len() / region.width;
            let band = Region { x0: region.x0, y0: region.y0 + band * rows, width: light, height };
            let mut electrons = vec![0.0; band.len()];
            chip.mean(&band, &mut electrons, &mut Vec::new());
            for (out, row) in out.chunks_exact_mut(region.width).zip(electrons.chunks_exact(light)) {
                out.iter_mut().zip(row).for_each(|(plane, value)| *plane = *value as f32);
            }
        });
    }
    let floor = floor(detector);
    let variance = mean.iter().map(|m| (f64::from(*m) + floor) as f32).collect();
    (mean, variance)
}
