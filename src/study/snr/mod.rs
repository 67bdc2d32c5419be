//! Signal-to-noise studies: analytic and by trials, against any number of a scene, with limiting magnitudes and best exposures.
//!
//! ```text
//! sweeps -> points -> groups that differ in magnitude alone -> a view of the sky changed to the point's setting
//!        -> pixels about the target -> analytic noise (ccd), limits, best exposures, frames measured (monte_carlo)
//! ```
//!
//! The SNR is that of photons and detector in one exposure. Scintillation and the response of the pixels, which multiply the light,
//! are told beside it.

pub mod best;
pub mod ccd;
pub mod least;
pub mod limit;
pub mod map_picture;
pub mod monte_carlo;
pub mod picture;
pub mod setting;
pub mod stage;
pub mod sweep;
pub mod table;

use crate::run::RunError;
use crate::scene::{Scene, SceneError};
use crate::simulate::{SimulateError, Simulator};
use best::Best;
use ccd::Estimator;
use monte_carlo::Trials;
use setting::Setting;
use stage::{Exposed, Staged};
use sweep::{Key, Point, Sweep};
use table::Row;

/// SNR that a limiting magnitude has unless another is wanted.
pub const WANTED: f64 = 5.0;

/// What keeps a study from being made.
#[derive(Debug, thiserror::Error)]
pub enum SnrError {
    /// The scene's check refuses a value.
    #[error("{at}{source}")]
    Scene {
        /// Which values, or nothing where the scene itself is meant.
        at: String,
        /// The faults.
        source: SceneError,
    },
    /// A value does not fit the scene.
    #[error("{0}")]
    Usage(String),
    /// The simulation fails.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// A frame cannot be measured.
    #[error(transparent)]
    Run(#[from] RunError),
}

/// Loads the scene with further replacements of its keys.
pub type Load<'a> = dyn Fn(&[(String, String)]) -> Result<Scene, SceneError> + Sync + 'a;

/// What is studied.
pub struct Study<'a> {
    /// The scene, with replacements.
    pub load: &'a Load<'a>,
    /// What is varied; none: the magnitude, about the limit.
    pub sweeps: Vec<Sweep>,
    /// SNR of the limiting magnitude and of the exposure sought.
    pub wanted: f64,
    /// Frames measured for each row; 0 = none.
    pub trials: usize,
    /// The exposure whose geometry counts.
    pub frame: usize,
    /// Time between exposures \[s\]; none: what the scene's cadence leaves.
    pub dead_s: Option<f64>,
}

/// Points that differ in their magnitude alone: numbers of the points and their magnitudes.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// What they share.
    point: Point,
    /// Number of each point, its values, and its magnitude, where it is the study's.
    members: Vec<(usize, Vec<f64>, Option<f64>)>,
}

impl Group {
    /// Numbers of its points.
    pub fn numbers(&self) -> impl Iterator<Item = usize> {
        self.members.iter().map(|(number, ..)| *number)
    }
}

impl Study<'_> {
    /// The points, grouped.
    pub fn groups(&self) -> Vec<Group> {
        let mut groups: Vec<Group> = Vec::new();
        let mut places = std::collections::HashMap::new();
        for (number, point) in sweep::points(&self.sweeps).into_iter().enumerate() {
            let setting = Setting { mag_v: None, ..point.setting };
            let member = (number, point.values, point.setting.mag_v);
            let shared = Point { values: Vec::new(), sets: point.sets, setting };
            let place = *places.entry(format!("{shared:?}")).or_insert(groups.len());
            match groups.get_mut(place) {
                Some(group) => group.members.push(member),
                None => groups.push(Group { point: shared, members: vec![member] }),
            }
        }
        groups
    }

    /// The scene of a group.
    ///
    /// # Errors
    /// The faults of the scene's check, with the values it refuses.
    pub fn scene(&self, group: &Group) -> Result<Scene, SnrError> {
        let at = group.point.sets.iter().map(|(key, value)| format!("{key} = {value}")).collect::<Vec<_>>();
        let at = if at.is_empty() { String::new() } else { format!("--sweep at {}: ", at.join(", ")) };
        (self.load)(&group.point.sets).map_err(|source| SnrError::Scene { at, source })
    }

    /// The rows of a group, with the numbers of their points.
    ///
    /// # Errors
    /// [`SnrError`] where the scene is refused or cannot be simulated.
    pub fn rows(&self, group: &Group) -> Result<Vec<(usize, Row)>, SnrError> {
        let staged = Staged::new(self.scene(group)?, &group.point.setting, self.frame)?;
        let simulator = Simulator::new(&staged.scene)?;
        let mut exposed = staged.expose(&simulator)?;
        let estimator = Estimator::of(&staged.scene);
        let limiting_mag_v = exposed.limiting_mag(estimator, self.wanted);
        let dead_s = self.dead_s.unwrap_or(staged.scene.exposures.cadence_s - staged.scene.exposures.duration_s);
        let mut rows = Vec::new();
        for (number, values, mag_v) in &group.members {
            let mag_v = mag_v.unwrap_or(staged.mag_v);
            let mut row = Row { values: values.clone(), why: exposed.why.clone(), ..Row::default() };
            row.set("mag_v", mag_v);
            row.set("limiting_mag_v", limiting_mag_v);
            row.set("read_noise_e", staged.scene.detector.read_noise_rms_e());
            if let Some(electrons) = exposed.electrons(mag_v) {
                fill(&mut row, &exposed, electrons, &staged, estimator);
                let best = Best::of(&exposed, electrons, &staged, estimator, self.wanted, dead_s);
                row.set("exposure_wanted_s", best.wanted_s);
                row.set("exposure_best_s", best.fastest_s);
                row.set("snr_hour", best.snr_hour);
                row.set("saturation_s", best.saturation_s);
                if self.trials > 0 {
                    let trials = Trials::of(&simulator, &staged, &mut exposed, electrons, estimator, self.trials)?;
                    row.set("snr_mc", trials.snr);
                    row.set("snr_mc_err", trials.error);
                    row.agreement = trials.agreement(row.get("snr"), electrons);
                }
            }
            rows.push((*number, row));
        }
        Ok(rows)
    }

    /// Magnitudes about the limiting one, for a study that varies nothing: half magnitudes from 8 above it to 1 below.
    ///
    /// # Errors
    /// [`SnrError`] where the scene is refused or cannot be simulated.
    pub fn magnitudes(&self) -> Result<Sweep, SnrError> {
        let none = Group { point: Point::default(), members: vec![(0, Vec::new(), None)] };
        let staged = Staged::new(self.scene(&none)?, &Setting::default(), self.frame)?;
        let simulator = Simulator::new(&staged.scene)?;
        let limit = staged.expose(&simulator)?.limiting_mag(Estimator::of(&staged.scene), self.wanted);
        let faint = if limit.is_finite() { limit.ceil() + 1.0 } else { 20.0 };
        let values = (0..=20).map(|k| faint - 10.0 + 0.5 * f64::from(k)).collect();
        Ok(Sweep { key: Key::Own(0), values, log: false })
    }
}

/// The analytic columns.
fn fill(row: &mut Row, exposed: &Exposed, electrons: f64, staged: &Staged, estimator: Estimator) {
    let Some(pixels) = &exposed.pixels else { return };
    let measured = pixels.measure(electrons, estimator);
    row.set("snr", measured.snr);
    row.set("signal_e", measured.signal_e);
    row.set("sky_e_px", measured.sky_e_px);
    row.set("stars_e_px", measured.stars_e_px);
    row.set("dark_e_px", pixels.dark_e());
    row.set("n_px", measured.n_px);
    row.set("aperture_px", measured.aperture_px);
    row.set("n_background_px", measured.n_background_px);
    row.set("peak_e", measured.peak_e);
    row.saturated = measured.peak_e >= exposed.full_e;
    for (name, share) in &exposed.sky_shares {
        row.set(name, share * (measured.sky_e_px - measured.stars_e_px));
    }
    let own = measured.terms.total();
    for (column, (_, variance)) in table::VARIANCES.into_iter().zip(measured.terms.parts()) {
        row.set(column, variance);
    }
    let twinkle = (measured.signal_e * staged.scintillation).powi(2);
    let flat = (measured.signal_e * measured.flat).powi(2);
    row.set("var_scintillation_e2", twinkle);
    row.set("var_flat_e2", flat);
    let all = (own + twinkle + flat).sqrt();
    row.set("snr_all", if all > 0.0 { measured.signal_e / all } else { 0.0 });
}
