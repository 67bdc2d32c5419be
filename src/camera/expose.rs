//! One exposure: means by row bands, one draw, the detector's steps in order.

use super::detector::convert::Converter;
use super::detector::{read_noise, shot, well};
use super::region::Region;
use super::scenery::Scenery;
use crate::base::random::{Address, Stage};
use crate::scene::Scene;
use rayon::prelude::*;

/// Rows of a band: means of a 4096-pixel-wide band fit the cache of one core.
const BAND_ROWS: usize = 32;

/// The numbers \[ADU\] of the pixels of `region` of frame number `frame`, by rows. Bands are computed in parallel; the
/// result does not depend on the number of threads.
pub fn expose(scene: &Scene, scenery: &Scenery, frame: usize, region: &Region) -> Vec<u16> {
    let mut adu = vec![0u16; region.len()];
    if region.is_empty() {
        return adu;
    }
    let detector = &scene.detector;
    let converter = Converter::of(detector);
    let address = |stage| Address { seed: scene.seed, frame: frame as u32, stage };
    let (shot_at, read_at) = (address(Stage::Shot), address(Stage::Read));
    let full_width = detector.size_px[0] as u64;
    adu.par_chunks_mut(BAND_ROWS * region.width).enumerate().for_each(|(band, out)| {
        let y0 = region.y0 + band * BAND_ROWS;
        let band = Region { x0: region.x0, y0, width: region.width, height: out.len() / region.width };
        let mut electrons = vec![0.0; band.len()];
        scenery.mean(&band, &mut electrons);
        for (y, (row, out)) in
            (y0..).zip(electrons.chunks_exact_mut(region.width).zip(out.chunks_exact_mut(region.width)))
        {
            let first = y as u64 * full_width + region.x0 as u64;
            shot::apply(row, first, &shot_at);
            well::apply(row, detector.full_well_e);
            read_noise::apply(row, first, &read_at, detector.read_noise_e);
            converter.apply(row, out);
        }
    });
    adu
}

/// The means \[e-\] and the variances \[e-^2\] (shot, read-out, rounding) of the pixels of `region`.
pub fn planes(scene: &Scene, scenery: &Scenery, region: &Region) -> (Vec<f32>, Vec<f32>) {
    let d = &scene.detector;
    let floor = d.read_noise_e * d.read_noise_e + d.gain_e_per_adu * d.gain_e_per_adu / 12.0;
    let mut mean = vec![0.0f32; region.len()];
    if region.is_empty() {
        return (mean.clone(), mean);
    }
    mean.par_chunks_mut(BAND_ROWS * region.width).enumerate().for_each(|(band, out)| {
        let (y0, height) = (region.y0 + band * BAND_ROWS, out.len() / region.width);
        let band = Region { x0: region.x0, y0, width: region.width, height };
        let mut electrons = vec![0.0; band.len()];
        scenery.mean(&band, &mut electrons);
        out.iter_mut().zip(electrons).for_each(|(plane, value)| *plane = value as f32);
    });
    let variance = mean.iter().map(|m| (f64::from(*m) + floor) as f32).collect();
    (mean, variance)
}
