//! The study's own parameters: what no key of a scene says, and how a view of the sky is changed to it.
//!
//! All else of an exposure stays as the scene has it: the stars, the directions to Sun and Moon, the frame's motion. An elevation
//! tilts the horizon below the field; a Moon is put on the vertical circle through the target, where it stands highest.

use crate::astro::observer::{airmass, azimuth_elevation, enu};
use crate::base::units::ARCSEC;
use crate::plan::view::{Horizontal, View};
use crate::scene::Scene;
use glam::DVec2;
use std::f64::consts::FRAC_PI_2;

/// A parameter that is no key of a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameter {
    /// Name, the unit at its end.
    pub name: &'static str,
    /// Unit as tables write it.
    pub unit: &'static str,
    /// Least and largest value.
    pub range: [f64; 2],
    /// How it is realised.
    pub doc: &'static str,
}

const fn parameter(name: &'static str, unit: &'static str, range: [f64; 2], doc: &'static str) -> Parameter {
    Parameter { name, unit, range, doc }
}

/// All of them, in the order of [`Setting`].
pub const OWN: [Parameter; 7] = [
    parameter("mag_v", "mag", [-30.0, 60.0], "V of the target, lit, outside the air"),
    parameter(
        "elevation_deg",
        "deg",
        [-90.0, 90.0],
        "apparent elevation of the target: the horizon is tilted below it; Sun and Moon keep their own elevations and their distances from it",
    ),
    parameter(
        "moon_phase_deg",
        "deg",
        [0.0, 180.0],
        "angle Sun-Moon-observer, 0 = full; a Moon that is not up stands 60 deg from the target",
    ),
    parameter(
        "moon_sep_deg",
        "deg",
        [0.0, 180.0],
        "distance of the Moon from the target, on its vertical circle, where the Moon stands highest",
    ),
    parameter("sun_el_deg", "deg", [-90.0, 90.0], "elevation of the Sun at its own azimuth"),
    parameter(
        "target_rate_arcsec_s",
        "arcsec / s",
        [0.0, 1e6],
        "motion of the target over the frame, along its rows: trailing loss",
    ),
    parameter(
        "tracking_error_arcsec",
        "arcsec",
        [0.0, 600.0],
        "wander of the mount in an exposure, rms of a coordinate: all images as much wider, in quadrature",
    ),
];

/// Names and meanings of [`OWN`] in lines.
pub fn described() -> String {
    let line = |own: &Parameter| format!("\n  {:22} {}", own.name, own.doc);
    let lines = OWN.iter().map(line).collect::<String>();
    format!("Parameters of the study's own, beside all numeric keys of a scene:{lines}")
}

/// Distance from the target of a Moon that is not up, where only its phase is asked for \[rad\].
const MOON_AWAY: f64 = 60.0 / 180.0 * std::f64::consts::PI;

/// Values of the study's own parameters; none where the scene decides. Units are those of [`OWN`].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Setting {
    /// V of the target.
    pub mag_v: Option<f64>,
    /// Its apparent elevation.
    pub elevation_deg: Option<f64>,
    /// Phase of the Moon.
    pub moon_phase_deg: Option<f64>,
    /// Its distance from the target.
    pub moon_sep_deg: Option<f64>,
    /// Elevation of the Sun.
    pub sun_el_deg: Option<f64>,
    /// Motion of the target over the frame.
    pub target_rate_arcsec_s: Option<f64>,
    /// Wander of the mount.
    pub tracking_error_arcsec: Option<f64>,
}

impl Setting {
    /// The value of that parameter of [`OWN`], to be set.
    pub fn slot(&mut self, number: usize) -> Option<&mut Option<f64>> {
        match number {
            0 => Some(&mut self.mag_v),
            1 => Some(&mut self.elevation_deg),
            2 => Some(&mut self.moon_phase_deg),
            3 => Some(&mut self.moon_sep_deg),
            4 => Some(&mut self.sun_el_deg),
            5 => Some(&mut self.target_rate_arcsec_s),
            6 => Some(&mut self.tracking_error_arcsec),
            _ => None,
        }
    }

    /// Seeing at the zenith that makes images as wide as the mount's wander does at this airmass \[arcsec\].
    pub fn seeing_arcsec(&self, scene: &Scene, airmass: f64) -> f64 {
        let per_sigma = 2.0 * (2.0 * std::f64::consts::LN_2).sqrt();
        let wander = per_sigma * self.tracking_error_arcsec.unwrap_or(0.0) / libm::pow(airmass, 0.6);
        scene.station.seeing_arcsec.hypot(wander)
    }

    /// Changes a view to this setting for target number `target`, which is lit.
    pub fn apply(&self, view: &mut View, target: usize) {
        self.tilt(view, target);
        self.shine(view, target);
        if let (Some(rate), Some(seen)) = (self.target_rate_arcsec_s, view.targets.get_mut(target)) {
            let middle = view.wcs.mid.pixel(seen.place.astrometric);
            let half = 0.5 * rate * ARCSEC * view.exposure_s / view.wcs.mid.pixel_scale();
            if let Some(middle) = middle {
                let along = DVec2::new(half, 0.0);
                seen.start_end = [view.wcs.start.sky(middle - along), view.wcs.end.sky(middle + along)];
            }
        }
        if let Some(seen) = view.targets.get_mut(target) {
            seen.sunlit_mean = 1.0;
        }
    }

    /// The horizon below the target.
    fn tilt(&self, view: &mut View, target: usize) {
        let (Some(elevation), Some(seen)) = (self.elevation_deg, view.targets.get_mut(target)) else { return };
        let direction = seen.place.geocentric;
        let from = view.observer.airless_geocentric(direction);
        let to = view.observer.unrefracted(enu(seen.apparent.azimuth, elevation.to_radians()));
        // places at the nadir of each other leave the way open; any will do
        if !(from.is_finite() && to.is_finite()) {
            return;
        }
        view.observer = view.observer.tilted(from, to);
        for seen in &mut view.targets {
            let airless = view.observer.airless_geocentric(seen.place.geocentric);
            seen.apparent = Horizontal::of(view.observer.refracted(airless));
            seen.airmass = airmass(seen.apparent.elevation);
        }
        let (azimuth, elevation) = azimuth_elevation(view.observer.observed(view.wcs.mid.centre));
        view.centre = Horizontal { azimuth, elevation };
        view.airmass = airmass(elevation);
        view.observability.below_horizon = elevation <= 0.0;
    }

    /// Sun and Moon.
    fn shine(&self, view: &mut View, target: usize) {
        if let Some(elevation) = self.sun_el_deg {
            view.sun.horizontal.elevation = elevation.to_radians();
        }
        if let Some(phase) = self.moon_phase_deg {
            view.moon.phase = phase.to_radians();
        }
        let Some(seen) = view.targets.get_mut(target) else { return };
        let up = view.moon.body.horizontal.elevation > 0.0;
        let away = match (self.moon_sep_deg, self.moon_phase_deg) {
            (Some(away), _) => away.to_radians(),
            (None, Some(_)) if !up => MOON_AWAY,
            _ => return,
        };
        let over = seen.apparent.elevation + away;
        let (azimuth, elevation) = if over <= FRAC_PI_2 {
            (seen.apparent.azimuth, over)
        } else {
            (seen.apparent.azimuth + std::f64::consts::PI, std::f64::consts::PI - over)
        };
        view.moon.body.horizontal = Horizontal::of(enu(azimuth, elevation));
        view.moon.body.direction = view.observer.astrometric(enu(azimuth, elevation));
        seen.moon_separation = away;
    }
}
