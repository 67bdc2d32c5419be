//! Exposures and windows held against the least signal-to-noise ratio that a scene asks for (`plan.min_snr`).
//!
//! The SNR is that of photons and detector by the analytic model ([`super::ccd`]). The target has its own light, integrated over the
//! exposure; what it draws is as long as it moves otherwise than the mount; the sky is that towards it, with stars spread evenly. Single
//! stars beside it and an uneven response of the chip are left out: whole frames tell them, at a hundred times the cost.

use super::ccd::{Estimator, Pixels};
use crate::astro::observer::Observer;
use crate::astro::time::Instant;
use crate::base::units::ARCSEC_PER_RAD;
use crate::camera::detector::dark::Dark;
use crate::camera::path::Path;
use crate::camera::psf::Psf;
use crate::object::shadow::card::Graphics;
use crate::plan::PlanError;
use crate::plan::interval::Margin;
use crate::plan::place::Place;
use crate::plan::planner::Planner;
use crate::plan::view::{Planned, View};
use crate::plan::windows::{Night, Window};
use crate::scene::{At, Scene};
use crate::simulate::{SimulateError, Simulator};
use crate::sky::Toward;
use crate::study::sky::Sky;
use glam::DVec2;
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

/// Way of a target over the sky between two looks in a search \[rad\], and the times \[s\] that it takes at least and at most.
const LOOK_RAD: f64 = 0.02;
const SHORTEST_LOOK_S: f64 = 2.0;
const LONGEST_LOOK_S: f64 = 60.0;
/// Direction of a trail: along neither rows nor columns, as most.
const OBLIQUE: DVec2 = DVec2::new(0.8, 0.6);
/// Step in the logarithm of the airmass: images are 0.3 % wider or narrower at most. So many are kept.
const AIRMASS_STEP: f64 = 0.01;
const MOST_PSFS: usize = 64;
/// Longest trail whose pixels are looked at \[px\].
const LONGEST_PX: f64 = 100.0;
/// Bound of a station's speed by the Earth's rotation \[m/s\].
const STATION_M_S: f64 = 500.0;

/// The least SNR of a scene, and what it takes to compute one.
pub struct Least<'a> {
    simulator: &'a Simulator<'a>,
    sky: Sky<'a>,
    wanted: f64,
    /// Images of a point by the number of steps in the logarithm of their airmass.
    psfs: Mutex<HashMap<i32, Arc<Psf>>>,
}

impl<'a> Least<'a> {
    /// That of a simulator's scene; none if it asks for none or has no target.
    pub fn of(simulator: &'a Simulator<'a>) -> Option<Self> {
        let wanted = simulator.scene.plan.min_snr.filter(|_| !simulator.scene.target.is_empty())?;
        Some(Self { simulator, sky: Sky::new(simulator), wanted, psfs: Mutex::default() })
    }

    /// SNR of a target in an exposure: 0 without light or exposure, NaN where the sky is outside its models.
    ///
    /// # Errors
    /// [`PlanError`] where its attitude is not known.
    pub fn snr(&self, view: &View, target: usize) -> Result<f64, PlanError> {
        self.seen(&self.simulator.planner, view, target)
    }

    fn seen(&self, planner: &Planner, view: &View, target: usize) -> Result<f64, PlanError> {
        let Simulator { scene, response, .. } = self.simulator;
        let (Some(seen), Some(sighting)) = (view.targets.get(target), view.sighting(target)) else {
            return Ok(0.0);
        };
        let exposure_s = view.exposure_s;
        if seen.apparent.elevation <= 0.0 || exposure_s <= 0.0 {
            return Ok(0.0);
        }
        let glow = planner.glow(target, &Graphics::default());
        let v_flux = glow.map(|mut glow| glow.over(&sighting)).transpose()?.map_or(0.0, |light| light.v_flux);
        let electrons = response.stars.solar().at(seen.airmass) * v_flux * exposure_s;
        if electrons <= 0.0 {
            return Ok(0.0);
        }
        let toward = Toward::icrs(&view.observer, seen.place.astrometric);
        let sky_e = self.sky.towards(&view.circumstances(), &toward).iter().sum::<f64>() * exposure_s;
        if !sky_e.is_finite() {
            return Ok(f64::NAN);
        }
        let drawn =
            (seen.rate - view.track_rate).length() * exposure_s * ARCSEC_PER_RAD / scene.stored_scale_arcsec();
        // a long trail is so many times one of this length
        let times = (drawn / LONGEST_PX).max(1.0);
        let half = OBLIQUE * (0.5 * drawn / times);
        let path = Path { start: -half, mid: DVec2::ZERO, end: half };
        let dark_e = Dark::new(&scene.detector, exposure_s).mean_e();
        let (psf, estimator) = (self.psf(seen.airmass), Estimator::of(scene));
        let pixels = Pixels::lone(&scene.detector, &psf, &path, [sky_e, dark_e], estimator);
        Ok(pixels.measure(electrons / times, estimator).snr * times.sqrt())
    }

    /// The image of a point at an airmass to within half a step.
    fn psf(&self, airmass: f64) -> Arc<Psf> {
        let step = (airmass.ln() / AIRMASS_STEP).round();
        let known = || self.psfs.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(psf) = known().get(&(step as i32)) {
            return psf.clone();
        }
        let psf = Arc::new(self.simulator.psf((step * AIRMASS_STEP).exp()));
        let mut known = known();
        if known.len() >= MOST_PSFS {
            known.clear();
        }
        known.insert(step as i32, psf.clone());
        psf
    }

    /// Refuses those exposures whose first target, the one that counts, has less or is off the frame; `done` is called after each.
    ///
    /// # Errors
    /// [`PlanError`] where an attitude is not known.
    pub fn hold(&self, planned: &mut [Planned], done: &(dyn Fn() + Sync)) -> Result<(), PlanError> {
        planned.par_iter_mut().try_for_each(|planned| {
            if let Planned::Known(view) = planned
                && let Some(seen) = view.targets.first()
            {
                let [width, height] = self.simulator.scene.detector.stored_px().map(|n| n as f64 - 0.5);
                let on_frame = |at: &DVec2| at.x >= -0.5 && at.y >= -0.5 && at.x < width && at.y < height;
                let on_frame = view.wcs.mid.pixel(seen.place.astrometric).as_ref().is_some_and(on_frame);
                let snr = self.snr(view, 0)?;
                if view.exposure_s <= 0.0 {
                    view.observability.refuse("no exposure, no SNR");
                } else if !on_frame {
                    let name = self.simulator.scene.target.first().map_or("the target", |t| t.name.as_str());
                    view.observability.refuse(&format!("{name} is off the frame"));
                } else if snr.is_nan() {
                    view.observability.refuse("SNR unknown, the sky is outside its models");
                } else if snr < self.wanted {
                    view.observability.refuse(&format!("SNR {snr:.1} below {}", self.wanted));
                }
            }
            done();
            Ok(())
        })
    }

    /// Windows of a target in a night, an exposure in the middle of which is a moment: all of the scene's limits. A mount that follows a
    /// target follows this one.
    ///
    /// # Errors
    /// [`PlanError`] where the Earth's orientation is unknown.
    pub fn windows(&self, target: usize, night: &Night) -> Result<Vec<Window>, PlanError> {
        let mut solo: Scene = self.simulator.scene.clone();
        let Some(own) = solo.target.get(target).cloned() else { return Ok(Vec::new()) };
        solo.target = vec![own];
        if let At::Target(_) = solo.pointing.at {
            solo.pointing.at = At::Target(None);
        }
        let alone = Planner::new(&solo)?;
        let half_s = 0.5 * self.simulator.scene.exposures.duration_s;
        let bright = |t: &Instant, _: &Observer, place: &Place| {
            let snr = alone.view_from(&t.plus(-half_s)).and_then(|view| self.seen(&alone, &view, 0));
            let speed = place.state.map_or(0.0, |state| (state.velocity.length() + STATION_M_S) / place.range_m);
            Margin {
                value: snr.map_or(f64::NAN, |snr| snr - self.wanted),
                safe_s: (LOOK_RAD / speed).clamp(SHORTEST_LOOK_S, LONGEST_LOOK_S),
            }
        };
        self.simulator.planner.windows(target, night, Some(&bright))
    }
}

/// All exposures of a scene as planned, its least SNR among the limits; `done` is called after each.
///
/// # Errors
/// [`SimulateError`] where the sky cannot be computed.
pub fn planned(simulator: &Simulator, done: &(dyn Fn() + Sync)) -> Result<Vec<Planned>, SimulateError> {
    let Some(least) = Least::of(simulator) else { return Ok(simulator.planner.all(done)?) };
    let mut planned = simulator.planner.all(&|| ())?;
    least.hold(&mut planned, done)?;
    Ok(planned)
}
