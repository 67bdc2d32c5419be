//! The period of a light curve in a file: which points count, to which range their magnitudes are reduced, and the table of what is
//! found.

use crate::base::table::{Table, Values};
use crate::io::curve_file::{CurveFile, Row};
use crate::photometry::flag;
use crate::photometry::period::{Candidate, Options, PeriodError, Report, Series, search};

/// Points with one of these flags tell nothing of a period.
const SPOILT: u32 = flag::SATURATED | flag::BLOOMED | flag::EDGE | flag::NOT_DETECTED;
/// No magnitude is better than this: added to the errors in quadrature \[mag\].
const LEAST_ERROR: f64 = 1e-3;
/// Range that magnitudes are reduced to \[km\].
const RANGE_KM: f64 = 1000.0;

/// The usable points of a curve, with their magnitudes at 1000 km if all ranges are known, else as they are.
pub fn points(file: &CurveFile, curve: usize) -> Vec<(&Row, f64)> {
    let rows = file.rows.iter().filter(|r| r.curve == curve && r.flags & SPOILT == 0).collect::<Vec<_>>();
    let reduced = file.curves.get(curve).is_some_and(|c| c.reduced);
    let ranges_known = !reduced && rows.iter().all(|r| r.range_km > 0.0);
    let at_range = |r: &Row| if ranges_known { 5.0 * (r.range_km / RANGE_KM).log10() } else { 0.0 };
    rows.into_iter().map(|r| (r, r.mag - at_range(r))).collect()
}

/// Search the points of a curve for periods.
///
/// # Errors
/// [`PeriodError`] for options out of their range.
pub fn of(points: &[(&Row, f64)], options: &Options) -> Result<Report, PeriodError> {
    let origin = points.first().map(|(r, _)| r.time);
    let time_s = points.iter().filter_map(|(r, _)| Some(r.time.since(&origin?))).collect::<Vec<_>>();
    let value = points.iter().map(|(_, mag)| *mag).collect::<Vec<_>>();
    // without errors all points count alike
    let known = points.iter().any(|(r, _)| r.mag_err > 0.0);
    let sigma = |r: &Row| if known { r.mag_err.hypot(LEAST_ERROR) } else { LEAST_ERROR };
    let sigma = points.iter().map(|(r, _)| sigma(r)).collect::<Vec<_>>();
    search(&Series { time_s: &time_s, value: &value, sigma: &sigma }, options)
}

/// Candidates and aliases as rows.
pub fn table(report: &Report) -> Table {
    let mut table = Table::default();
    table.note("significant", report.significant);
    table.note("points", report.points);
    table.note("span_s", report.span_s);
    let candidates = || report.candidates.iter();
    let aliases = || report.aliases.iter();
    let kinds = candidates().map(|_| "candidate").chain(aliases().map(|_| "alias of the first"));
    table.texts("kind", kinds.map(str::to_owned));
    let mut floats = |name, unit, of: &dyn Fn(&Candidate) -> f64, alias: &dyn Fn(usize) -> f64| {
        table.floats(name, unit, candidates().map(of).chain((0..report.aliases.len()).map(alias)));
    };
    let unknown = |_| f64::NAN;
    floats("period_s", "s", &|c| c.period_s, &|i| report.aliases[i].period_s);
    floats("period_err_s", "s", &|c| c.period_err_s, &unknown);
    floats("power", "", &|c| c.power_multi, &|i| report.aliases[i].power);
    floats("theta", "", &|c| c.theta.unwrap_or(f64::NAN), &unknown);
    floats("false_alarm", "", &|c| c.false_alarm, &unknown);
    floats("chi2", "", &|c| c.chi2, &|i| report.aliases[i].chi2);
    floats("delta_chi2", "", &|_| f64::NAN, &|i| report.aliases[i].delta_chi2);
    floats("amplitude_mag", "mag", &|c| c.amplitude, &unknown);
    let maxima = candidates().map(|c| c.maxima as i64).chain(aliases().map(|_| -1));
    table.ints("maxima", maxima);
    let told_apart = candidates().map(|_| true).chain(aliases().map(|a| !a.indistinguishable));
    table.column("told_apart", "", Values::Bool(told_apart.collect()));
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::astro::time::Instant;
    use crate::io::curve_file::Curve;
    use glam::DVec3;

    /// A pass whose range falls from 2000 to 1000 km, spinning in 20 s: only reduced magnitudes show the spin alone.
    #[test]
    fn magnitudes_are_reduced_to_one_range_and_spoilt_points_left_out() {
        let start = Instant::from_utc("2026-01-20T03:00:00").expect("a date");
        let row = |k: u32| {
            let t = f64::from(k) * 1.3;
            let range_km = 2000.0 - f64::from(k) * 5.0;
            let mag = 9.0 + 0.3 * (std::f64::consts::TAU * t / 20.0).cos() + 5.0 * (range_km / 1000.0).log10();
            Row {
                frame: None,
                time: start.plus(t),
                exptime_s: 0.5,
                target: "A".into(),
                flux: 1.0,
                flux_err: 0.01,
                zeropoint_mag: 20.0,
                mag: if k == 7 { 3.0 } else { mag },
                mag_err: 0.01,
                range_km,
                sun: DVec3::X,
                obs: DVec3::Y,
                flags: if k == 7 { flag::SATURATED } else { 0 },
                curve: 0,
            }
        };
        let curves = vec![Curve { name: "A".into(), calibrated: true, reduced: false, session: false }];
        let mut file = CurveFile { rows: (0..200).map(row).collect(), curves, meta: Vec::new() };
        let counted = points(&file, 0);
        assert_eq!(counted.len(), 199);
        assert!(counted.iter().all(|(_, mag)| (mag - 9.0).abs() < 0.301));
        let report = of(&counted, &Options::default()).expect("options in range");
        assert!((report.candidates[0].period_s - 20.0).abs() < 0.01, "{:?}", report.candidates[0]);
        assert_eq!(table(&report).rows(), report.candidates.len() + report.aliases.len());
        // one unknown range: nothing is reduced
        file.rows[3].range_km = f64::NAN;
        assert!(points(&file, 0).iter().any(|(_, mag)| *mag > 10.0));
    }
}
