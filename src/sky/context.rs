//! What the sources of one exposure's sky need, and the directions they are asked about.

use super::response::Response;
use crate::astro::observer::{Observer, airmass, azimuth_elevation, enu};
use crate::base::surface_brightness::MagArcsec2;
use crate::base::units::{ARCSEC, ARCSEC_PER_RAD, flux_from_mag};
use crate::plan::view::{Circumstances, View};
use crate::scene::Scene;
use glam::{DVec2, DVec3};
use std::f64::consts::FRAC_PI_2;

/// A direction into the sky.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Toward {
    /// Astrometric ICRS unit vector.
    pub icrs: DVec3,
    /// Azimuth from north, clockwise \[rad\].
    pub azimuth: f64,
    /// Apparent zenith distance \[rad\].
    pub zenith_distance: f64,
    /// Airmass (Pickering 2002).
    pub airmass: f64,
    /// Place in the frame, -1 to 1 along x and y.
    pub in_frame: DVec2,
}

impl Toward {
    /// The direction of an astrometric ICRS unit vector.
    pub fn icrs(observer: &Observer, icrs: DVec3) -> Self {
        let (azimuth, elevation) = azimuth_elevation(observer.observed(icrs));
        Self {
            icrs,
            azimuth,
            zenith_distance: FRAC_PI_2 - elevation,
            airmass: airmass(elevation),
            in_frame: DVec2::ZERO,
        }
    }

    /// The direction of an apparent azimuth and zenith distance \[rad\].
    pub fn horizontal(observer: &Observer, azimuth: f64, zenith_distance: f64) -> Self {
        let elevation = FRAC_PI_2 - zenith_distance;
        let icrs = observer.astrometric(enu(azimuth, elevation));
        Self { icrs, azimuth, zenith_distance, airmass: airmass(elevation), in_frame: DVec2::ZERO }
    }

    /// Unit vector (east, north, up).
    pub fn enu(&self) -> DVec3 {
        enu(self.azimuth, FRAC_PI_2 - self.zenith_distance)
    }
}

/// The part of the sky a frame shows.
#[derive(Debug, Clone)]
pub struct Field {
    /// Its centre, then places at its edges and corners.
    pub samples: Vec<Toward>,
    /// Angle from the centre to the farthest sample \[rad\].
    pub radius: f64,
}

impl Field {
    /// One direction alone.
    pub fn point(toward: Toward) -> Self {
        Self { samples: vec![toward], radius: 0.0 }
    }

    /// Its centre.
    pub fn centre(&self) -> &Toward {
        &self.samples[0]
    }
}

/// What all sources of a frame need.
#[derive(Debug)]
pub struct Context<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// From radiance to electrons; the same for all frames.
    pub response: &'a Response,
    /// The observer, the Sun and the Moon.
    pub now: Circumstances,
    /// The part of the sky looked at.
    pub field: Field,
    /// Exposure time \[s\].
    pub exposure_s: f64,
    /// Solid angle of a pixel \[sr\].
    pub pixel_sr: f64,
}

impl<'a> Context<'a> {
    /// What the sources of one exposure need.
    pub fn of_view(scene: &'a Scene, view: &View, response: &'a Response) -> Self {
        let wcs = &view.wcs.mid;
        let corner = wcs.crpix.max(DVec2::ONE);
        let place = |x: f64, y: f64| toward(view, wcs.crpix + DVec2::new(x, y) * corner);
        let ends = [-1.0, 0.0, 1.0];
        let edges = ends.iter().flat_map(|y| ends.iter().map(|x| (*x, *y))).filter(|at| *at != (0.0, 0.0));
        let samples = std::iter::once(place(0.0, 0.0)).chain(edges.map(|(x, y)| place(x, y))).collect::<Vec<_>>();
        let from_centre = |t: &Toward| crate::astro::separation(samples[0].icrs, t.icrs);
        let radius = samples.iter().map(from_centre).fold(0.0, f64::max);
        Self::new(scene, response, view.circumstances(), Field { samples, radius }, view.exposure_s)
    }

    /// What the sources of any part of the sky need.
    pub fn new(
        scene: &'a Scene,
        response: &'a Response,
        now: Circumstances,
        field: Field,
        exposure_s: f64,
    ) -> Self {
        // on the observed sky; astrometric scales are stretched by differential refraction
        let pixel_rad = scene.stored_scale_arcsec() * ARCSEC;
        Self { scene, response, now, field, exposure_s, pixel_sr: pixel_rad * pixel_rad }
    }

    /// Solid angle of a pixel \[arcsec^2\].
    pub fn pixel_arcsec2(&self) -> f64 {
        self.pixel_sr * ARCSEC_PER_RAD * ARCSEC_PER_RAD
    }

    /// Electrons per pixel in the exposure from 1 electron per second and steradian.
    pub fn per_steradian(&self) -> f64 {
        self.pixel_sr * self.exposure_s
    }

    /// Electrons per pixel in the exposure from a surface brightness (V, solar colour) measured at the ground; 0
    /// for NaN.
    pub fn electrons_at_ground(&self, brightness: MagArcsec2) -> f64 {
        let flux = flux_from_mag(brightness.0);
        if flux.is_nan() {
            return 0.0;
        }
        self.response.solar_at_ground * flux * self.pixel_arcsec2() * self.exposure_s
    }
}

/// The direction of a pixel of an exposure.
pub fn toward(view: &View, pixel: DVec2) -> Toward {
    let centre = view.wcs.mid.crpix;
    let in_frame = (pixel - centre) / centre.max(DVec2::ONE);
    Toward { in_frame, ..Toward::icrs(&view.observer, view.wcs.mid.sky(pixel)) }
}
