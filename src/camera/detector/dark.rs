//! Dark current: thermal electrons, doubling every few kelvin, uneven from pixel to pixel, with hot pixels.

use super::pattern;
use crate::base::random::{Address, CHUNK, Stage};
use crate::base::sample::{add_normal, uniform};
use crate::scene::Detector;

/// Decades over which the rates of hot pixels are spread evenly, above the usual rate.
const HOT_DECADES: [f64; 2] = [1.0, 3.0];

/// Dark current at the chip's temperature \[e-/s/px\], of an unbinned pixel.
pub fn rate(detector: &Detector) -> f64 {
    let warming = detector.temperature_c - detector.dark_temperature_c;
    detector.dark_e_per_s * libm::exp2(warming / detector.dark_doubling_c)
}

/// Dark charge of the pixels of a chip.
#[derive(Debug, Clone, Copy)]
pub struct Dark {
    mean_e: f64,
    /// Standard deviation of the logarithm, and its mean for a mean of 1.
    log_normal: Option<[f64; 2]>,
    /// Share of hot pixels and what one pixel is of a binned one.
    hot: Option<[f64; 2]>,
    chip_seed: u64,
}

impl Dark {
    /// Dark charge of an exposure of `exposure_s`; a binned pixel holds that of all its pixels.
    pub fn new(detector: &Detector, exposure_s: f64) -> Self {
        let pixels = (detector.binning * detector.binning) as f64;
        let dsnu = detector.dsnu / detector.binning as f64;
        let variance = libm::log1p(dsnu * dsnu);
        let share = 1.0 - libm::pow(1.0 - detector.hot_pixel_fraction, pixels);
        Self {
            mean_e: rate(detector) * exposure_s * pixels,
            log_normal: (dsnu > 0.0).then_some([variance.sqrt(), -0.5 * variance]),
            hot: (share > 0.0).then_some([share, 1.0 / pixels]),
            chip_seed: detector.pattern_seed,
        }
    }

    /// Mean charge of a usual pixel \[e-\].
    pub fn mean_e(&self) -> f64 {
        self.mean_e
    }

    /// Add dark charge \[e-\] to pixels numbered from `first` on; `scratch` is as long as the row.
    pub fn add(&self, row: &mut [f64], first: u64, scratch: &mut [f64]) {
        if self.mean_e <= 0.0 {
            return;
        }
        if self.log_normal.is_none() && self.hot.is_none() {
            return row.iter_mut().for_each(|value| *value += self.mean_e);
        }
        match self.log_normal {
            Some([width, mean]) => {
                scratch.fill(mean);
                add_normal(&pattern::address(self.chip_seed, Stage::Dsnu), first, width, scratch);
                scratch.iter_mut().for_each(|factor| *factor = libm::exp(*factor));
            }
            None => scratch.fill(1.0),
        }
        if let Some(hot_pixels) = self.hot {
            let hot = pattern::address(self.chip_seed, Stage::HotPixels);
            let mut words = (u64::MAX, [0; CHUNK]);
            for (pixel, factor) in (first..).zip(&mut *scratch) {
                let (chunk, lane) = (pixel / CHUNK as u64, (pixel % CHUNK as u64) as usize);
                if words.0 != chunk {
                    words = (chunk, hot.chunk(chunk));
                }
                *factor += self.excess(&hot, pixel, words.1[lane], hot_pixels).unwrap_or(0.0);
            }
        }
        row.iter_mut().zip(scratch).for_each(|(value, factor)| *value += self.mean_e * *factor);
    }

    /// What a hot pixel has more than a usual one, as a multiple; none for a usual one.
    fn excess(&self, address: &Address, pixel: u64, word: u32, [share, part]: [f64; 2]) -> Option<f64> {
        let hot = (f64::from(word) + 0.5) * (1.0 / 4_294_967_296.0) < share;
        hot.then(|| {
            let u = uniform(address.block(pixel, 1)[1]);
            let [low, high] = HOT_DECADES;
            part * (libm::exp10(low + (high - low) * u) - 1.0)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Options, load};

    fn detector(sets: &[(&str, &str)]) -> Detector {
        let sets = sets.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect::<Vec<_>>();
        load("pogs-geo", &Options { sets: &sets, seed: None }).expect("a good scene").detector
    }

    /// Mean, spread and share of hot pixels over 1e6 pixels; doubling with temperature; binning adds up.
    #[test]
    fn charge_has_the_stated_mean_spread_and_hot_pixels() {
        let d = detector(&[("detector.dsnu", "0.3"), ("detector.temperature_c", "-13.7")]);
        assert!((rate(&d) / 0.1 - 1.0).abs() < 1e-12);
        let dark = Dark::new(&d, 100.0);
        let mut row = vec![0.0; 1_000_000];
        dark.add(&mut row, 0, &mut vec![0.0; 1_000_000]);
        let n = row.len() as f64;
        let mean = row.iter().sum::<f64>() / n;
        let spread = (row.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt() / mean;
        // five standard errors
        assert!(
            (mean / 10.0 - 1.0).abs() < 5.0 * 0.3 / n.sqrt() && (spread - 0.3).abs() < 2e-3,
            "{mean} {spread}"
        );

        let hot = Dark::new(&detector(&[("detector.hot_pixel_fraction", "0.001")]), 100.0);
        let mut row = vec![0.0; 1_000_000];
        hot.add(&mut row, 0, &mut vec![0.0; 1_000_000]);
        let found = row.iter().filter(|v| **v > 49.0).count() as f64;
        assert!((found - 1000.0).abs() < 5.0 * 1000f64.sqrt(), "{found}");
        assert!(row.iter().all(|v| *v >= 5.0 && *v <= 5000.0));

        let binned = Dark::new(&detector(&[("detector.binning", "2")]), 100.0);
        assert!((binned.mean_e() - 20.0).abs() < 1e-9);
    }
}
