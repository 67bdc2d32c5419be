//! What is in a scene's frames, what is left out, which noise dominates, what a run costs.
//!
//! The cost is that of one frame made, written, measured and put on the report's page as a run does it, times the number of frames; frames are
//! made one after the other and measured side by side.

use super::report::{MOST_FRAMES, report};
use crate::base::ledger::Ledger;
use crate::camera::scenery::Scenery;
use crate::plan::view::View;
use crate::run::job::Job;
use crate::run::lightcurve::{measure_frames, settings};
use crate::run::{OutputDir, RunError, frames};
use crate::simulate::{SimulateError, Simulator, catalogue};
use std::path::Path;

/// The explanation of a scene.
#[derive(Debug)]
pub struct Explanation {
    /// One row a source or stage, frames folded together.
    pub ledger: Ledger,
    /// The largest part of a pixel's variance at the frame's centre, averaged over the frames.
    pub dominant_noise: String,
    /// Variance parts \[e-^2/px\]: name and mean over the frames.
    pub noise: Vec<(String, f64)>,
    /// Frames a run would take.
    pub frames: usize,
    /// Estimated time of a whole run \[s\]; NaN where no frame could be written.
    pub total_s: f64,
    /// Parts of it \[s\]: preparing all frames, making and writing them, measuring them, the report.
    pub parts_s: [f64; 4],
}

/// Explain a scene. `clock` gives seconds since some moment; one frame is made in the folder `scratch`, which is the caller's to remove.
///
/// # Errors
/// [`SimulateError`] if the scene cannot be simulated.
pub fn explain(
    simulator: &Simulator,
    scratch: &Path,
    clock: &(dyn Fn() -> f64 + Sync),
) -> Result<Explanation, SimulateError> {
    let scene = simulator.scene;
    let mut ledger = Ledger::default();
    let mut noise: Vec<(String, f64)> = Vec::new();
    let (mut count, mut prepare_s) = (0, 0.0);
    let mut sample: Option<View> = None;
    for view in simulator.planner.views()? {
        if frames::refused(scene, &view).is_some() {
            continue;
        }
        let began = clock();
        let scenery = simulator.timed_scenery(&view, clock)?;
        let took = clock() - began;
        prepare_s += took;
        count += 1;
        ledger.fold(&scenery.ledger);
        for (name, variance) in variances(simulator, &scenery) {
            match noise.iter_mut().find(|(known, _)| *known == name) {
                Some((_, sum)) => *sum += variance,
                None => noise.push((name, variance)),
            }
        }
        sample = Some(view);
    }
    noise.iter_mut().for_each(|(_, sum)| *sum /= f64::from(count.max(1)));
    let all = f64::from(count);
    let [make_s, measure_s, page_s] = match &sample {
        // a run prepares a frame while the one before is made
        Some(view) => one_frame(simulator, view, scratch, clock).unwrap_or([f64::NAN; 3]),
        None => [0.0; 3],
    };
    let side_by_side = (rayon::current_num_threads() as f64).min(all).max(1.0);
    let parts_s = [
        prepare_s,
        make_s * all,
        measure_s * (all / side_by_side).ceil(),
        page_s * all.min(MOST_FRAMES[0] as f64),
    ];
    let dominant = noise.iter().max_by(|a, b| a.1.total_cmp(&b.1));
    Ok(Explanation {
        ledger,
        dominant_noise: dominant.map_or_else(|| "none".into(), |(name, _)| name.clone()),
        frames: count as usize,
        total_s: parts_s.iter().sum(),
        parts_s,
        noise,
    })
}

/// Seconds in which a frame is made and written, in which it is measured, and in which it is put on the page.
fn one_frame(
    simulator: &Simulator,
    view: &View,
    scratch: &Path,
    clock: &(dyn Fn() -> f64 + Sync),
) -> Result<[f64; 3], RunError> {
    let scene = simulator.scene;
    let dir = OutputDir::prepare(scratch, scene, true)?;
    let frame = view.frame;
    let job = frames::Job { frames: frame..frame + 1, crop: None, clock, done: &|_| () };
    let scenery_s = {
        let began = clock();
        simulator.scenery(view)?;
        clock() - began
    };
    let began = clock();
    let made = frames::render(simulator, std::slice::from_ref(view), &dir, &job)?;
    let make_s = (clock() - began - scenery_s).max(0.0);
    let page = || {
        let began = clock();
        let made = scene.output.report && report(scratch).is_ok();
        if made { clock() - began } else { 0.0 }
    };
    if scene.target.is_empty() || made.frames.is_empty() {
        return Ok([make_s, 0.0, page()]);
    }
    let catalogue = catalogue(scene).map_err(SimulateError::from)?;
    let began = clock();
    measure_frames(&Job { scene: Some(scene), ..Job::new(&[dir.frame(frame)], &catalogue, settings(scene)) })?;
    let measure_s = clock() - began;
    Ok([make_s, measure_s, page()])
}

/// Parts of a pixel's variance at the frame's centre, target left out \[e-^2\].
fn variances(simulator: &Simulator, scenery: &Scenery) -> Vec<(String, f64)> {
    let detector = &simulator.scene.detector;
    let sky = scenery.sky_means.iter().map(|m| (format!("photon noise of {}", m.keyword), m.mean_e_px));
    sky.chain([
        ("photon noise of dark current".to_owned(), scenery.dark_e),
        ("read noise".to_owned(), detector.read_noise_rms_e().powi(2)),
        ("rounding".to_owned(), detector.gain_e_per_adu.powi(2) / 12.0),
    ])
    .collect()
}
