//! The bias level's fixed structure: an offset of each column and of each row, of equal variances.

use super::pattern;
use crate::base::random::Stage;
use crate::base::sample::normal;
use std::f64::consts::FRAC_1_SQRT_2;

/// The structure of a chip.
#[derive(Debug, Clone)]
pub struct Structure {
    /// Offset of each stored column \[ADU\].
    columns: Vec<f64>,
    rms_adu: f64,
    chip_seed: u64,
}

impl Structure {
    /// Structure of `rms_adu` of a chip with `width` stored columns.
    pub fn new(chip_seed: u64, rms_adu: f64, width: usize) -> Self {
        let address = pattern::address(chip_seed, Stage::BiasColumns);
        let columns = (0..width as u64).map(|x| rms_adu * FRAC_1_SQRT_2 * normal(&address, x)).collect();
        Self { columns, rms_adu, chip_seed }
    }

    /// Offsets \[ADU\] of row `y` from column `x0` on, added to `out`.
    pub fn add(&self, y: usize, x0: usize, out: &mut [f64]) {
        let row =
            self.rms_adu * FRAC_1_SQRT_2 * normal(&pattern::address(self.chip_seed, Stage::BiasRows), y as u64);
        out.iter_mut().zip(&self.columns[x0..]).for_each(|(value, column)| *value += row + column);
    }
}
