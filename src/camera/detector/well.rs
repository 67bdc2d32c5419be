//! Full well: a pixel holds so many electrons and no more.

/// Clip charge \[e-\] at `full_well_e`.
pub fn apply(row: &mut [f64], full_well_e: f64) {
    for value in row {
        *value = value.min(full_well_e);
    }
}
