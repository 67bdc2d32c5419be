//! SGP4/SDP4 in its AFSPC mode (crate `sgp4`; Vallado, Crawford, Hujsak & Kelso 2006, AIAA 2006-6753): mean elements
//! to TEME, carried to GCRS at the same instant.

use super::super::{Error, earth::Orientation, time::Instant};
use super::State;
use super::elements::MeanElements;
use glam::DVec3;
use std::f64::consts::PI;

/// Radius below which an object is taken as decayed \[m\]: that of WGS 72, as in Vallado et al.
const DECAYED_M: f64 = 6_378_135.0;

/// The two ways in which SGP4 is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// As the U.S. Space Force does, who makes the elements.
    Afspc,
    /// With the corrections of Vallado et al. 2006 to sidereal time and to the node at low inclination.
    Improved,
}

/// An object on an orbit given by mean elements.
#[derive(Debug, Clone)]
pub struct Sgp4 {
    mode: Mode,
    name: String,
    constants: sgp4::Constants,
    epoch: Instant,
}

impl Sgp4 {
    /// The object of mean elements, in AFSPC mode.
    ///
    /// # Errors
    /// [`Error::Elements`] for elements that SGP4 cannot use.
    pub fn new(elements: &MeanElements) -> Result<Self, Error> {
        Self::with_mode(elements, Mode::Afspc)
    }

    /// The object of mean elements in a mode.
    ///
    /// # Errors
    /// [`Error::Elements`] for elements that SGP4 cannot use.
    pub fn with_mode(elements: &MeanElements, mode: Mode) -> Result<Self, Error> {
        let fault = |reason: String| Error::Elements { name: elements.title(), reason };
        let model = &sgp4::WGS72;
        let orbit = sgp4::Orbit::from_kozai_elements(
            model,
            elements.inclination_deg * (PI / 180.0),
            elements.raan_deg * (PI / 180.0),
            elements.eccentricity,
            elements.argp_deg * (PI / 180.0),
            elements.mean_anomaly_deg * (PI / 180.0),
            elements.mean_motion_rev_day * (PI / 720.0),
        )
        .map_err(|e| fault(e.to_string()))?;
        // the AFSPC mode's years since J2000, from a Julian date in one number
        let utc = elements.epoch.utc_reading();
        let years = ((utc.mjd as f64 + 2_400_000.5) + utc.ns as f64 / 8.64e13 - 2_451_545.0) / 365.25;
        let sidereal_time = match mode {
            Mode::Afspc => sgp4::afspc_epoch_to_sidereal_time,
            Mode::Improved => sgp4::iau_epoch_to_sidereal_time,
        };
        let constants = sgp4::Constants::new(sgp4::WGS72, sidereal_time, years, elements.bstar, orbit)
            .map_err(|e| fault(e.to_string()))?;
        Ok(Self { mode, name: elements.title(), constants, epoch: elements.epoch })
    }

    /// Epoch of the elements.
    pub fn epoch(&self) -> Instant {
        self.epoch
    }

    /// TEME position \[m\] and velocity \[m/s\] at `minutes` after the epoch.
    ///
    /// # Errors
    /// [`Error::Propagation`] if SGP4 gives up or the object has decayed.
    pub fn teme(&self, minutes: f64) -> Result<State, Error> {
        let fault = |reason: String| Error::Propagation {
            name: self.name.clone(),
            utc: self.epoch.plus(minutes * 60.0).iso_utc(),
            reason,
        };
        let minutes_since = sgp4::MinutesSinceEpoch(minutes);
        let prediction = match self.mode {
            Mode::Afspc => self.constants.propagate_afspc_compatibility_mode(minutes_since),
            Mode::Improved => self.constants.propagate(minutes_since),
        };
        let prediction = prediction.map_err(|e| fault(e.to_string()))?;
        let state = State {
            position: DVec3::from_array(prediction.position) * 1e3,
            velocity: DVec3::from_array(prediction.velocity) * 1e3,
        };
        if !(state.position.is_finite() && state.velocity.is_finite()) {
            return Err(fault(format!("{minutes} minutes after the elements' epoch the position is not finite")));
        }
        let radius = state.position.length();
        if radius < DECAYED_M {
            return Err(fault(format!(
                "decayed: {:.1} km from the Earth's centre, which must be above {} km",
                radius / 1e3,
                DECAYED_M / 1e3
            )));
        }
        Ok(state)
    }

    /// GCRS position and velocity at `t`.
    ///
    /// # Errors
    /// As [`Self::teme`]; [`Error::EpochOutsideTable`] for an epoch without orientation.
    pub fn gcrs(&self, t: &Instant) -> Result<State, Error> {
        let teme = self.teme(t.since(&self.epoch) / 60.0)?;
        let to_gcrs = Orientation::at(t)?.teme_to_gcrs;
        Ok(State { position: to_gcrs * teme.position, velocity: to_gcrs * teme.velocity })
    }
}

#[cfg(test)]
mod tests {
    use super::super::tle::Tle;
    use super::*;

    const GOES_14: [&str; 2] = [
        "1 35491U 09033A   18019.95817924 -.00000090  00000-0  00000-0 0  9991",
        "2 35491   0.0698 263.4367 0009544 339.3413 117.1094  1.00271818 31371",
    ];

    fn goes() -> Sgp4 {
        Sgp4::new(&Tle::from_lines(&GOES_14).expect("two lines").elements().expect("elements")).expect("usable")
    }

    #[test]
    fn a_geostationary_satellite_stays_at_its_longitude_and_radius() {
        for hours in 0..24 {
            let t = goes().epoch().plus(f64::from(hours) * 3600.0);
            let gcrs = goes().gcrs(&t).expect("propagates").position;
            let itrf = Orientation::at(&t).expect("inside").gcrs_to_itrf * gcrs;
            let longitude = itrf.y.atan2(itrf.x).to_degrees();
            assert!((longitude + 104.5).abs() < 0.5, "{longitude}");
            assert!((gcrs.length() - 42.164e6).abs() < 60e3);
        }
    }

    /// SGP4's own velocity leaves out the rates of its periodic terms: it is right to 1e-4.
    #[test]
    fn the_velocity_is_the_derivative_of_the_position() {
        let t = goes().epoch().plus(5000.0);
        let at = |s: f64| goes().gcrs(&t.plus(s)).expect("propagates");
        let slope = (at(0.5).position - at(-0.5).position) / 1.0;
        assert!((slope - at(0.0).velocity).length() < 1e-4 * slope.length());
    }

    #[test]
    fn an_object_that_has_come_down_is_told_so() {
        let iss = Tle::from_lines(&[
            "1 25544U 98067A   18020.89808844  .00002078  00000-0  38550-4 0  9992",
            "2 25544  51.6424  32.9776 0003646  28.7227  39.5332 15.54190080 95614",
        ]);
        let mut elements = iss.expect("lines").elements().expect("elements");
        elements.bstar = 0.5;
        let error = (1..400)
            .find_map(|day| Sgp4::new(&elements).expect("usable").teme(f64::from(day) * 1440.0).err())
            .expect("it must come down");
        assert!(error.to_string().contains("orbit of object 25544 at 2018-"), "{error}");
    }
}
