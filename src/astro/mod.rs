//! Where things are: time scales, the Earth's orientation, the observer, the Sun and Moon, orbits, shadow.
//!
//! Frames: GCRS (geocentric, axes of the ICRS), ITRF (fixed in the crust), TEME (of SGP4), ENU (east, north,
//! up along the geodetic zenith). Positions are metres, angles radians, times [`time::Instant`].

pub mod attitude;
pub mod bodies;
pub mod daily;
pub mod earth;
pub mod elliptic;
pub mod eop;
pub mod geodetic;
pub mod moon;
pub mod observer;
pub mod orbit;
pub mod rotation;
pub mod scales;
pub mod shadow;
pub mod star;
pub mod time;
pub mod tumble;

use glam::{DMat3, DVec3};

/// What can go wrong in this room.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// A text is no epoch.
    #[error("epoch {text:?}: {reason}")]
    Epoch {
        /// The text.
        text: String,
        /// What is wrong with it.
        reason: String,
    },
    /// The epoch lies outside the years for which Earth, Sun and Moon are computed.
    #[error("epoch {utc} UTC: Earth, Sun and Moon are computed from {first} to {last}")]
    EpochOutsideTable {
        /// The epoch, ISO 8601.
        utc: String,
        /// First day, ISO 8601.
        first: String,
        /// Last day, ISO 8601.
        last: String,
    },
    /// Elements, a state or an ephemeris cannot be used.
    #[error("elements of {name}: {reason}")]
    Elements {
        /// Name of the object.
        name: String,
        /// What is wrong with it.
        reason: String,
    },
    /// An attitude is not known or cannot be.
    #[error("attitude: {reason}")]
    Attitude {
        /// What is wrong.
        reason: String,
    },
    /// The orbit cannot be propagated to the epoch.
    #[error("orbit of {name} at {utc} UTC: {reason}")]
    Propagation {
        /// Name of the object.
        name: String,
        /// The epoch, ISO 8601.
        utc: String,
        /// Why.
        reason: String,
    },
}

/// A matrix given by rows.
pub(crate) fn matrix(rows: [[f64; 3]; 3]) -> DMat3 {
    DMat3::from_cols_array_2d(&rows).transpose()
}

/// The unit vector towards right ascension (or east longitude) and declination (or latitude) \[rad\].
pub fn direction(longitude: f64, latitude: f64) -> DVec3 {
    let (sin_lon, cos_lon) = longitude.sin_cos();
    let (sin_lat, cos_lat) = latitude.sin_cos();
    DVec3::new(cos_lat * cos_lon, cos_lat * sin_lon, sin_lat)
}

/// Right ascension in \[0, 2 pi) and declination \[rad\] of a vector of any positive length.
pub fn angles(v: DVec3) -> (f64, f64) {
    (crate::base::units::wrap_two_pi(v.y.atan2(v.x)), v.z.atan2(v.x.hypot(v.y)))
}

/// Angle between two vectors \[rad\], exact near 0 and pi (Kahan's half-angle form by atan2).
pub fn separation(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b))
}
