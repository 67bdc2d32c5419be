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
        suggested: false,
        by: None,
        by_rms: false,
        noise: None,
    }
}

/// The result of `work` and its time \[s\]: the least of three, where it takes so little that another could disturb it.
pub(super) fn timed<T>(clock: &(dyn Fn() -> f64 + Sync), mut work: impl FnMut() -> T) -> (T, f64) {
    const SHORT_S: f64 = 0.05;
    let mut once = || {
        let began = clock();
        let result = work();
        (result, clock() - began)
    };
    let (mut result, mut took) = once();
    if took < SHORT_S {
        for _ in 0..2 {
            let again;
            (result, again) = once();
            took = took.min(again);
        }
    }
    (result, took)
}

/// Values of a tolerance from the loosest to the tightest, that of the scene among them.
pub(super) fn ladder(steps: &[f64], own: f64) -> Vec<f64> {
    let mut all = steps.iter().copied().filter(|step| *step != own).chain([own]).collect::<Vec<_>>();
    all.sort_by(|a, b| b.total_cmp(a));
    all
}
