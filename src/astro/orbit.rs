//! Orbits: where an object is, from its elements.
//!
//! Two-line elements are propagated by SGP4/SDP4 in its AFSPC mode (crate `sgp4`; Vallado et al. 2006, AIAA
//! 2006-6753), which gives TEME positions; they are carried to GCRS at the same instant.

use super::{Error, earth::Orientation, time::Instant};
use glam::DVec3;
use hifitime::{Duration, Epoch};

/// An object on an orbit given by two-line elements.
#[derive(Debug, Clone)]
pub struct Satellite {
    name: String,
    constants: sgp4::Constants,
    epoch: Instant,
}

impl Satellite {
    /// The object of a two-line element set.
    ///
    /// # Errors
    /// [`Error::Elements`] for lines that SGP4 cannot use.
    pub fn from_tle(name: &str, line1: &str, line2: &str) -> Result<Self, Error> {
        let fault = |reason: String| Error::Elements { name: name.to_owned(), reason };
        let elements = sgp4::Elements::from_tle(Some(name.to_owned()), line1.as_bytes(), line2.as_bytes())
            .map_err(|e| fault(e.to_string()))?;
        let constants = sgp4::Constants::from_elements_afspc_compatibility_mode(&elements)
            .map_err(|e| fault(e.to_string()))?;
        let unix_ns = elements
            .datetime
            .and_utc()
            .timestamp_nanos_opt()
            .ok_or_else(|| fault(format!("epoch {} is out of range", elements.datetime)))?;
        let epoch = Instant::new(Epoch::from_unix_duration(Duration::from_total_nanoseconds(i128::from(unix_ns))));
        Ok(Self { name: name.to_owned(), constants, epoch })
    }

    /// Epoch of the elements.
    pub fn epoch(&self) -> Instant {
        self.epoch
    }

    /// GCRS position \[m\] at `t`.
    ///
    /// # Errors
    /// [`Error::Propagation`] if SGP4 gives up, [`Error::EpochOutsideTable`] for its epoch.
    pub fn gcrs(&self, t: &Instant) -> Result<DVec3, Error> {
        let fault = |reason: String| Error::Propagation { name: self.name.clone(), utc: t.iso_utc(), reason };
        let minutes = sgp4::MinutesSinceEpoch(t.since(&self.epoch) / 60.0);
        let teme = self.constants.propagate_afspc_compatibility_mode(minutes).map_err(|e| fault(e.to_string()))?;
        let teme = DVec3::from_array(teme.position) * 1e3;
        if !teme.is_finite() {
            return Err(fault("the position is not finite".into()));
        }
        Ok(Orientation::at(t)?.teme_to_gcrs * teme)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOES_14: [&str; 2] = [
        "1 35491U 09033A   18019.95817924 -.00000090  00000-0  00000-0 0  9991",
        "2 35491   0.0698 263.4367 0009544 339.3413 117.1094  1.00271818 31371",
    ];

    #[test]
    fn a_geostationary_satellite_stays_at_its_longitude_and_radius() {
        let goes = Satellite::from_tle("GOES 14", GOES_14[0], GOES_14[1]).expect("good elements");
        for hours in 0..24 {
            let t = goes.epoch().plus(f64::from(hours) * 3600.0);
            let gcrs = goes.gcrs(&t).expect("propagates");
            let itrf = Orientation::at(&t).expect("inside").gcrs_to_itrf * gcrs;
            let longitude = itrf.y.atan2(itrf.x).to_degrees();
            assert!((longitude + 104.5).abs() < 0.5, "{longitude}");
            assert!((gcrs.length() - 42.164e6).abs() < 60e3);
        }
    }

    #[test]
    fn broken_lines_are_refused_with_a_reason() {
        let e = Satellite::from_tle("X", "1 nonsense", GOES_14[1]).expect_err("nonsense");
        assert!(e.to_string().contains("element set of X"));
    }
}
