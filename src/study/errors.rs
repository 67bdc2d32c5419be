//! Errors of an approximation against its reference, and the row that tells them.

use crate::base::accuracy::AccuracyRow;

/// Largest and root-mean-square of errors.
pub(super) struct Errors {
    pub max: f64,
    pub rms: f64,
}

impl Errors {
    pub fn of(errors: &[f64]) -> Self {
        let square = errors.iter().map(|e| e * e).sum::<f64>() / errors.len().max(1) as f64;
        Self { max: errors.iter().fold(0.0, |max, e| e.abs().max(max)), rms: square.sqrt() }
    }
}

/// A row; whether it is the default or on the Pareto front is filled in later.
pub(super) fn row(
    name: &str,
    setting: String,
    errors: &Errors,
    unit: &str,
    time_s: f64,
    bytes: usize,
) -> AccuracyRow {
    AccuracyRow {
        approximation: name.to_owned(),
        setting,
        max_err: errors.max,
        rms_err: errors.rms,
        unit: unit.to_owned(),
        time_s,
        bytes: bytes as u64,
        pareto: false,
        default: false,
    }
}
