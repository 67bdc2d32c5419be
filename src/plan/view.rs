//! All geometry of one exposure.

use super::place::{Illumination, Place};
use super::pointing::Attitudes;
use crate::astro::observer::{Observer, azimuth_elevation};
use crate::astro::time::Instant;
use glam::{DVec2, DVec3};

/// A direction above the horizon.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Horizontal {
    /// Azimuth from north, clockwise, in \[0, 2 pi) \[rad\].
    pub azimuth: f64,
    /// Elevation \[rad\].
    pub elevation: f64,
}

impl Horizontal {
    /// Of an (east, north, up) vector.
    pub fn of(enu: DVec3) -> Self {
        let (azimuth, elevation) = azimuth_elevation(enu);
        Self { azimuth, elevation }
    }
}

/// Sun or Moon.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Body {
    /// Airless place above the horizon.
    pub horizontal: Horizontal,
    /// Direction from the observer: astrometric ICRS (Sun), GCRS axes (Moon).
    pub direction: DVec3,
}

/// The Moon and its phase.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moon {
    /// Where it is.
    pub body: Body,
    /// Angle Sun - Moon - observer \[rad\]; 0 = full.
    pub phase: f64,
}

/// What the light of the whole sky depends on at one instant: the observer, the Sun and the Moon.
#[derive(Debug, Clone, Copy)]
pub struct Circumstances {
    /// The instant.
    pub instant: Instant,
    /// The observer.
    pub observer: Observer,
    /// The Sun.
    pub sun: Body,
    /// The Moon.
    pub moon: Moon,
}

/// A target in one exposure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TargetView {
    /// Place at mid-exposure.
    pub place: Place,
    /// Astrometric ICRS directions at opening and closing.
    pub start_end: [DVec3; 2],
    /// How it is lit at mid-exposure.
    pub light: Illumination,
    /// Share of sunlight, averaged over the exposure.
    pub sunlit_mean: f64,
    /// Apparent place: light time, diurnal aberration, refraction.
    pub apparent: Horizontal,
    /// Airmass at the apparent place.
    pub airmass: f64,
    /// (d RA/dt) cos Dec and d Dec/dt of the astrometric place \[rad/s\].
    pub rate: DVec2,
    /// Angle to the Moon's centre \[rad\].
    pub moon_separation: f64,
}

/// What the light of a target in one exposure depends on.
#[derive(Debug, Clone, Copy)]
pub struct Sighting {
    /// Shutter opens.
    pub start: Instant,
    /// Middle of the exposure.
    pub mid: Instant,
    /// Exposure time \[s\].
    pub exposure_s: f64,
    /// The observer at mid-exposure.
    pub observer: Observer,
    /// Place at mid-exposure.
    pub place: Place,
    /// How it is lit at mid-exposure.
    pub light: Illumination,
    /// Share of sunlight, averaged over the exposure.
    pub sunlit_mean: f64,
    /// Apparent place: light time, diurnal aberration, refraction.
    pub apparent: Horizontal,
    /// Airmass at the apparent place.
    pub airmass: f64,
}

/// The geometry of one exposure.
#[derive(Debug, Clone)]
pub struct View {
    /// Number of the frame.
    pub frame: usize,
    /// Shutter opens.
    pub start: Instant,
    /// Middle of the exposure.
    pub mid: Instant,
    /// Shutter closes.
    pub end: Instant,
    /// Exposure time \[s\].
    pub exposure_s: f64,
    /// The observer at mid-exposure.
    pub observer: Observer,
    /// World coordinates over the exposure.
    pub wcs: Attitudes,
    /// Apparent place of the frame's centre.
    pub centre: Horizontal,
    /// Airmass of the frame's centre.
    pub airmass: f64,
    /// Motion of the frame's centre among the stars, (d RA/dt) cos Dec and d Dec/dt \[rad/s\].
    pub track_rate: DVec2,
    /// The Sun.
    pub sun: Body,
    /// The Moon.
    pub moon: Moon,
    /// The targets, in the scene's order.
    pub targets: Vec<TargetView>,
    /// Whether the exposure is worth taking.
    pub observability: Observability,
}

impl View {
    /// What the light of target number `target` depends on.
    pub fn sighting(&self, target: usize) -> Option<Sighting> {
        let t = self.targets.get(target)?;
        Some(Sighting {
            start: self.start,
            mid: self.mid,
            exposure_s: self.exposure_s,
            observer: self.observer,
            place: t.place,
            light: t.light,
            sunlit_mean: t.sunlit_mean,
            apparent: t.apparent,
            airmass: t.airmass,
        })
    }

    /// The observer, the Sun and the Moon at mid-exposure.
    pub fn circumstances(&self) -> Circumstances {
        Circumstances { instant: self.mid, observer: self.observer, sun: self.sun, moon: self.moon }
    }
}

/// Whether an exposure is worth taking.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Observability {
    /// True if no constraint is broken.
    pub observable: bool,
    /// The constraints broken, with value and limit; empty if none.
    pub why: String,
    /// True if the frame's centre is below the horizon: no frame can be taken at all.
    pub below_horizon: bool,
}

impl Observability {
    /// One more constraint is broken.
    pub fn refuse(&mut self, why: &str) {
        if !self.why.is_empty() {
            self.why += "; ";
        }
        self.why += why;
        self.observable = false;
    }
}

/// An exposure as planned.
#[derive(Debug, Clone)]
pub enum Planned {
    /// Its geometry.
    Known(Box<View>),
    /// A target's orbit is not known then, so that there is none.
    Unknown {
        /// Number of the frame.
        frame: usize,
        /// Middle of the exposure.
        mid: Instant,
        /// Why.
        why: String,
    },
}

impl Planned {
    /// The geometry, if it is known.
    pub fn view(&self) -> Option<&View> {
        match self {
            Self::Known(view) => Some(view),
            Self::Unknown { .. } => None,
        }
    }

    /// Number of the frame.
    pub fn frame(&self) -> usize {
        match self {
            Self::Known(view) => view.frame,
            Self::Unknown { frame, .. } => *frame,
        }
    }

    /// Middle of the exposure.
    pub fn mid(&self) -> &Instant {
        match self {
            Self::Known(view) => &view.mid,
            Self::Unknown { mid, .. } => mid,
        }
    }

    /// Why it cannot be observed; empty if it can.
    pub fn why(&self) -> &str {
        match self {
            Self::Known(view) => &view.observability.why,
            Self::Unknown { why, .. } => why,
        }
    }

    /// Whether it can be observed.
    pub fn observable(&self) -> bool {
        self.view().is_some_and(|v| v.observability.observable)
    }
}
