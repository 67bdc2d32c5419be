//! What is in a scene's frames, what is left out, which noise dominates, what a run costs.

use crate::base::ledger::Ledger;
use crate::camera::region::Region;
use crate::camera::scenery::Scenery;
use crate::plan::view::View;
use crate::simulate::{SimulateError, Simulator, whole};

/// Rows of the strip whose time is scaled to a frame's.
const STRIP_ROWS: usize = 64;

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
    /// Estimated run time of all frames \[s\], files and photometry not included.
    pub total_s: f64,
}

/// Explain a scene. `clock` gives seconds since some moment; the cost is measured on a strip of one frame.
///
/// # Errors
/// [`SimulateError`] if the scene cannot be simulated.
pub fn explain(simulator: &Simulator, clock: &(dyn Fn() -> f64 + Sync)) -> Result<Explanation, SimulateError> {
    let scene = simulator.scene;
    let mut ledger = Ledger::default();
    let mut noise: Vec<(String, f64)> = Vec::new();
    let (mut frames, mut prepare_s) = (0, 0.0);
    let mut sample: Option<(View, Scenery)> = None;
    for view in simulator.planner.views()? {
        if crate::run::frames::refused(scene, &view).is_some() {
            continue;
        }
        let began = clock();
        let scenery = simulator.timed_scenery(&view, clock)?;
        let took = clock() - began;
        prepare_s += took;
        frames += 1;
        ledger.fold(&scenery.ledger);
        for (name, variance) in variances(simulator, &scenery) {
            match noise.iter_mut().find(|(known, _)| *known == name) {
                Some((_, sum)) => *sum += variance,
                None => noise.push((name, variance)),
            }
        }
        sample = Some((view, scenery));
    }
    noise.iter_mut().for_each(|(_, sum)| *sum /= f64::from(frames.max(1)));
    let expose_s = sample.map_or(0.0, |(view, scenery)| {
        let all = whole(scene);
        let height = STRIP_ROWS.min(all.height);
        let strip = Region { y0: (all.height - height) / 2, height, ..all };
        let began = clock();
        let pixels = simulator.pixels(&view, &scenery, &strip);
        (clock() - began) * all.len() as f64 / pixels.len().max(1) as f64
    });
    let dominant = noise.iter().max_by(|a, b| a.1.total_cmp(&b.1));
    Ok(Explanation {
        ledger,
        dominant_noise: dominant.map_or_else(|| "none".into(), |(name, _)| name.clone()),
        frames: frames as usize,
        total_s: prepare_s + expose_s * f64::from(frames),
        noise,
    })
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
