//! Error against run time of the inversion of a scene's own light curve.
//!
//! * `inversion.grid`: directions of the grid on which the extended Gaussian image begins (non-negative least squares); the error is that of the
//!   light that the solution predicts, in standard deviations of a datum, against the finest grid.

use super::errors::{Errors, row, timed};
use crate::base::accuracy::AccuracyRow;
use crate::inversion::egi::{self, Problem};
use crate::io::curve_file;
use crate::io::ecsv::to_ecsv;
use crate::plan::planner::Planner;
use crate::run::RunError;
use crate::run::model_curve::{curves, to_table};
use crate::run::shape_data::data;
use crate::run::shape_light::predicted;
use crate::scene::Brightness;
use crate::simulate::{SimulateError, Simulator};

/// Data of the curve at most.
const DATA: usize = 300;
/// Longest time for one grid \[s\]: finer ones are left out.
const LONGEST_S: f64 = 4.0;
/// Signal-to-noise ratio of a datum where the scene tells none.
const SNR: f64 = 100.0;

/// Rows for the first target that has a shape; none where the scene does not invert.
///
/// # Errors
/// [`RunError`] where no light curve can be made.
pub(super) fn rows(
    simulator: &Simulator,
    snr: f64,
    clock: &(dyn Fn() -> f64 + Sync),
) -> Result<Vec<AccuracyRow>, RunError> {
    let mut scene = simulator.scene.clone();
    scene.target.retain(|target| matches!(target.brightness, Brightness::Shape(_)));
    scene.target.truncate(1);
    if !scene.inversion.enabled || scene.target.is_empty() {
        return Ok(Vec::new());
    }
    let count = scene.exposures.count.min(DATA);
    scene.exposures.cadence_s *= (scene.exposures.count.max(2) - 1) as f64 / (count.max(2) - 1) as f64;
    scene.exposures.count = count;
    let planner = Planner::new(&scene).map_err(SimulateError::from)?;
    let table = to_table(&scene, &curves(&scene, &planner, &simulator.graphics, &|| ())?)?;
    let file =
        curve_file::read("lightcurve.ecsv", &to_ecsv(&table)).map_err(|e| RunError::Usage(e.to_string()))?;
    let mut data = data(&file, 0, Some(&scene))?;
    let snr = if snr > 0.0 { snr } else { SNR };
    let Some(curve) = data.curves.first_mut() else { return Ok(Vec::new()) };
    let mean = curve.y.iter().sum::<f64>() / curve.y.len().max(1) as f64;
    curve.sigma = curve.y.iter().map(|y| (y / snr).max(mean / snr * 0.1)).collect();
    let Ok(problem) = Problem::new(&data.curves) else { return Ok(Vec::new()) };
    let curve = &data.curves[0];
    let mut found = Vec::new();
    for grid in [100, 300, 1000, egi::Options::default().grid, 5000] {
        let options = egi::Options { grid, ..egi::Options::default() };
        let (solution, seconds) = timed(clock, || egi::solve(&problem, &data.material, &options));
        let Ok(solution) = solution else { continue };
        found.push((grid, predicted(&solution.image(), &solution.scales, &data.curves, &data.material), seconds));
        if seconds > LONGEST_S {
            break;
        }
    }
    let one = |(grid, model, seconds): &(usize, Vec<f64>, f64)| {
        let errors = model.iter().zip(&curve.y).zip(&curve.sigma).map(|((m, e), s)| (m - e) / s);
        let errors = Errors::of(&errors.collect::<Vec<_>>());
        let bytes = grid * curve.y.len() * size_of::<f64>();
        let default = *grid == egi::Options::default().grid;
        let setting = format!("{grid} directions");
        AccuracyRow { default, ..row("inversion.grid", setting, &errors, "sigma", *seconds, bytes) }
    };
    Ok(found.iter().map(one).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Options, load_str};

    const SCENE: &str = "[station]\npreset = 'pogs'\n[exposures]\nstart = 2018-01-20T06:00:00Z\ncount = 40\ncadence_s = 17.0\nduration_s = 0.0\n\
                         [[target]]\nname = 'box'\nshape = 'box'\nshape_size_m = [1.0, 2.0, 3.0]\n\
                         orbit.fixed = { ra_deg = 103.0, dec_deg = -5.0, range_km = 37000.0 }\n\
                         attitude = { mode = 'spin', axis = [0.3, 0.5, 1.0], period_s = 97.0 }\nmaterial.brdf = 'lambert'\n";

    /// A scene that does not invert has no rows; of one that does the default grid predicts the light of a box within the errors that its data
    /// have (SNR 50).
    #[test]
    fn grids_are_compared_where_the_scene_inverts() {
        let mut scene = load_str(SCENE, "t.toml", None, &Options::default()).expect("a scene");
        // a clock that goes on by a tenth of a second each time it is asked: neither repeats nor breaks off
        let asked = std::sync::atomic::AtomicU32::new(0);
        let clock = || 0.1 * f64::from(asked.fetch_add(1, std::sync::atomic::Ordering::Relaxed));
        assert!(rows(&Simulator::new(&scene).expect("a simulator"), 50.0, &clock).expect("rows").is_empty());
        scene.inversion.enabled = true;
        let found = rows(&Simulator::new(&scene).expect("a simulator"), 50.0, &clock).expect("rows");
        let default = found.iter().find(|r| r.default).expect("the default");
        assert!(default.rms_err < 1.0, "{found:?}");
        assert!(found.iter().all(|r| r.max_err.is_finite() && r.bytes > 0));
    }
}
