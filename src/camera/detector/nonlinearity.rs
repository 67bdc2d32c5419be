//! Non-linearity of the output: the charge q is read as q (1 - s q / q_full), s the share missing at full well.

/// Bend charge \[e-\]; `share` is missing at `full_well_e`.
pub fn apply(row: &mut [f64], share: f64, full_well_e: f64) {
    for value in row {
        *value -= share * *value * (*value / full_well_e);
    }
}
