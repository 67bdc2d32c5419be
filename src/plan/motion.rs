//! From what a scene says of a target to how it moves and turns.

use super::place::Motion;
use crate::astro::attitude::Profile;
use crate::astro::orbit::kepler::Kepler;
use crate::astro::orbit::numerical::Numerical;
use crate::astro::orbit::sgp4::Sgp4;
use crate::astro::orbit::tle::Tle;
use crate::astro::orbit::{Orbit, State};
use crate::astro::rotation::Quaternion;
use crate::astro::time::Instant;
use crate::astro::tumble::Tumble;
use crate::astro::{Error, direction};
use crate::base::constants::{EARTH_GM, EARTH_RADIUS_M};
use crate::base::units::ARCSEC;
use crate::scene::{self, Attitude, Target};
use glam::DVec3;

/// An integrated orbit is made for times up to this much before and after the exposures \[s\]: windows of the nights.
const MARGIN_S: f64 = 86_400.0;

/// Share of `accuracy.position_mas` that each force left out may make.
const SHARE: f64 = 0.1;

/// When a target is looked at, and how exactly it must be known.
#[derive(Debug, Clone, Copy)]
pub struct Need {
    /// First exposure.
    pub first: Instant,
    /// End of the last one.
    pub last: Instant,
    /// Allowed error of a place \[mas\].
    pub position_mas: f64,
}

impl Need {
    fn numerical(&self, name: &str, epoch: Instant, state: State) -> Result<Numerical, Error> {
        let span =
            [self.first, self.last].map(|t| t.since(&epoch).abs()).into_iter().fold(0.0, f64::max) + MARGIN_S;
        // from the ground it is at least that far away
        let distance = (state.position.length() - EARTH_RADIUS_M).max(1e5);
        Numerical::new(name, epoch, state, span, SHARE * self.position_mas * 1e-3 * ARCSEC * distance)
    }
}

/// The motion of a scene's target.
///
/// # Errors
/// [`Error::Elements`] for elements or states that cannot be used.
pub fn motion(target: &Target, need: &Need) -> Result<Motion, Error> {
    let name = &target.name;
    Ok(Motion::Orbit(match &target.orbit {
        scene::Orbit::Fixed { ra_deg, dec_deg, range_km } => {
            let place = direction(ra_deg.to_radians(), dec_deg.to_radians());
            return Ok(Motion::Fixed(place, range_km.map(|km| km * 1e3)));
        }
        scene::Orbit::Tle { line1, line2, .. } => {
            let elements = Tle::new(Some(name), line1, line2).elements()?;
            Orbit::Mean(Box::new(Sgp4::new(&elements)?))
        }
        scene::Orbit::Omm { elements, .. } => Orbit::Mean(Box::new(Sgp4::new(elements)?)),
        scene::Orbit::Oem { ephemeris, .. } => Orbit::Ephemeris(ephemeris.clone()),
        scene::Orbit::State { epoch, position_km, velocity_km_s } => {
            let state = State {
                position: DVec3::from_array(*position_km) * 1e3,
                velocity: DVec3::from_array(*velocity_km_s) * 1e3,
            };
            Orbit::Numerical(need.numerical(name, epoch.instant, state)?)
        }
        scene::Orbit::Kepler { epoch, a_km, e, i_deg, raan_deg, argp_deg, mean_anomaly_deg } => {
            let kepler = Kepler {
                a: a_km * 1e3,
                e: *e,
                i: i_deg.to_radians(),
                raan: raan_deg.to_radians(),
                argp: argp_deg.to_radians(),
                mean_anomaly: mean_anomaly_deg.to_radians(),
            };
            Orbit::Numerical(need.numerical(name, epoch.instant, kepler.state(EARTH_GM))?)
        }
    }))
}

/// The attitude of a scene's target.
///
/// # Errors
/// [`Error::Attitude`] for quaternions of no length and moments that no body has.
pub fn profile(attitude: &Attitude) -> Result<Profile, Error> {
    let turn = |q: &[f64; 4]| {
        Quaternion::new(*q).ok_or_else(|| Error::Attitude { reason: format!("quaternion {q:?} has no length") })
    };
    // by the largest component first: squares of tiny ones vanish
    let unit = |v: &[f64; 3]| {
        let v = DVec3::from_array(*v);
        (v / v.abs().max_element()).normalize_or(DVec3::Z)
    };
    Ok(match attitude {
        Attitude::Inertial { quaternion } => Profile::Inertial(turn(quaternion)?),
        Attitude::Spin { quaternion, axis, period_s, phase_deg, epoch } => Profile::Spin {
            start: turn(quaternion)?,
            axis: unit(axis),
            period_s: *period_s,
            phase: phase_deg.to_radians(),
            epoch: epoch.instant,
        },
        Attitude::Nadir => Profile::NADIR,
        Attitude::Sun => Profile::SUN,
        Attitude::Aligned { point_body, point_to, turn_body, turn_to } => Profile::Aligned {
            point_body: unit(point_body),
            point_to: *point_to,
            turn_body: unit(turn_body),
            turn_to: *turn_to,
        },
        Attitude::Tumble { quaternion, inertia_kg_m2, rate_deg_s, epoch } => {
            let rate = DVec3::from_array(rate_deg_s.map(f64::to_radians));
            let tumble = Tumble::new(DVec3::from_array(*inertia_kg_m2), turn(quaternion)?, rate)?;
            Profile::Tumble { tumble: Box::new(tumble), epoch: epoch.instant }
        }
        Attitude::Table { rows, .. } => Profile::Table(rows.clone()),
    })
}
