//! Where the telescope points and how the frame moves among the stars while the shutter is open.
//!
//! The camera maps pixel offsets onto the tangent plane of the observed (aberrated, refracted) sky with its
//! plate scale; world coordinates follow by carrying that plane back to astrometric places ([`super::wcs`]).
//! A tracking mount keeps its camera along observed north (an equatorial mount without field rotation); a
//! mount that stands still keeps it along the horizon.

use super::PlanError;
use super::place::Motion;
use super::sip::Sip;
use super::wcs::{Wcs, east_north};
use crate::astro::observer::{Observer, Site, enu};
use crate::astro::time::Instant;
use crate::astro::{Error, direction};
use crate::base::units::ARCSEC;
use crate::scene::{At, Scene, Track};
use glam::{DVec2, DVec3};

/// What the mount follows while the shutter is open.
#[derive(Debug, Clone)]
enum Follow {
    /// A moving object.
    Object(Motion),
    /// The stars.
    Stars,
    /// Nothing: the mount stands still on the Earth.
    Earth,
    /// Fixed rates (d RA/dt) cos Dec and d Dec/dt \[rad/s\] about the place of mid-exposure.
    Rates(DVec2),
}

/// What the frame's reference place is at mid-exposure.
#[derive(Debug, Clone)]
enum Aim {
    Object(Motion),
    Direction(DVec3),
    Horizontal(DVec3),
}

/// The mount and camera of a scene.
#[derive(Debug, Clone)]
pub struct Mount {
    aim: Aim,
    follow: Follow,
    crpix: DVec2,
    half_size: DVec2,
    offset: DVec2,
    scale: f64,
    /// Of the optics.
    distortion: Option<Sip>,
    /// Directions of +x and +y against observed (east, north).
    axes: [DVec2; 2],
}

/// The camera's axes on the observed sky: centre, +x, +y, in east-north-up components, orthonormal.
#[derive(Debug, Clone, Copy)]
struct Camera {
    centre: DVec3,
    x: DVec3,
    y: DVec3,
}

impl Camera {
    fn observed(&self, offset: DVec2, scale: f64) -> DVec3 {
        (self.centre + (self.x * offset.x + self.y * offset.y) * scale).normalize()
    }
}

/// World coordinates at the start, middle and end of an exposure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Attitudes {
    /// At opening.
    pub start: Wcs,
    /// At mid-exposure: the header's.
    pub mid: Wcs,
    /// At closing.
    pub end: Wcs,
}

impl Mount {
    /// The mount of a scene with the motions of its targets.
    ///
    /// # Errors
    /// [`PlanError::NoTarget`] if it points at a target and there is none.
    pub fn of(scene: &Scene, motions: &[Motion]) -> Result<Self, PlanError> {
        let named = |name: &Option<String>| match name {
            None => motions.first(),
            Some(name) => scene.target.iter().position(|t| &t.name == name).and_then(|i| motions.get(i)),
        };
        let aimed = match &scene.pointing.at {
            At::Target(name) => Some(named(name).ok_or(PlanError::NoTarget)?),
            _ => None,
        };
        let aim = match &scene.pointing.at {
            At::Target(_) => Aim::Object(aimed.ok_or(PlanError::NoTarget)?.clone()),
            At::RaDec { ra_deg, dec_deg } => Aim::Direction(direction(ra_deg.to_radians(), dec_deg.to_radians())),
            At::AzEl { az_deg, el_deg } => Aim::Horizontal(enu(az_deg.to_radians(), el_deg.to_radians())),
        };
        let follow = match &scene.exposures.track {
            Track::Target => Follow::Object(aimed.or(motions.first()).ok_or(PlanError::NoTarget)?.clone()),
            Track::Sidereal => Follow::Stars,
            Track::Fixed => Follow::Earth,
            Track::Rates([ra, dec]) => Follow::Rates(DVec2::new(*ra, *dec) * ARCSEC),
        };
        let size = DVec2::new(scene.detector.light_px()[0] as f64, scene.detector.light_px()[1] as f64);
        let (sin, cos) = scene.telescope.position_angle_deg.to_radians().sin_cos();
        // +y at the position angle from north through east; +x to its right as east lies to the left
        let y = DVec2::new(sin, cos);
        let x = if scene.telescope.mirrored { DVec2::new(cos, -sin) } else { DVec2::new(-cos, sin) };
        Ok(Self {
            aim,
            follow,
            crpix: (size - DVec2::ONE) / 2.0,
            half_size: size / 2.0,
            offset: DVec2::from_array(scene.pointing.offset_px),
            scale: scene.stored_scale_arcsec() * ARCSEC,
            distortion: Sip::of(scene).map_err(PlanError::Distortion)?,
            axes: [x, y],
        })
    }

    /// World coordinates over an exposure.
    ///
    /// # Errors
    /// Whatever the sky's computation says.
    pub fn attitudes(&self, site: &Site, times: [&Instant; 3]) -> Result<Attitudes, Error> {
        let [start, mid, end] = times;
        let observer = Observer::at(site, mid)?;
        let aimed = match &self.aim {
            Aim::Object(motion) => motion.place_from(&observer, mid)?.astrometric,
            Aim::Direction(direction) => *direction,
            Aim::Horizontal(observed) => observer.astrometric(*observed),
        };
        let camera = self.camera(&observer, aimed);
        let at = |t: &Instant| -> Result<Wcs, Error> {
            let observer = Observer::at(site, t)?;
            let seconds = t.since(mid);
            let followed = match &self.follow {
                Follow::Earth => return Ok(self.wcs(&observer, &camera)),
                Follow::Stars => aimed,
                Follow::Rates(rate) => moved(aimed, *rate * seconds),
                Follow::Object(motion) => {
                    // the object may be another than the one pointed at: follow its motion, keep the aim
                    let shift =
                        motion.place_from(&observer, t)?.astrometric - motion.place(site, mid)?.astrometric;
                    (aimed + shift).normalize()
                }
            };
            Ok(self.wcs(&observer, &self.camera(&observer, followed)))
        };
        Ok(Attitudes { start: at(start)?, mid: self.wcs(&observer, &camera), end: at(end)? })
    }

    /// The camera with the place `aimed` at its offset from the centre and +y along the position angle there.
    fn camera(&self, observer: &Observer, aimed: DVec3) -> Camera {
        let target = observer.observed(aimed);
        let (_, north) = east_north(aimed);
        const STEP: f64 = 1e-6;
        let along = observer.observed((aimed + north * STEP).normalize()) - target;
        let mut centre = target;
        let mut camera = self.oriented(centre, along);
        // shift the centre until the offset pixel sees the place; each step gains as many digits as the first
        for _ in 0..6 {
            centre = (centre + target - camera.observed(self.offset, self.scale)).normalize();
            camera = self.oriented(centre, along);
        }
        camera
    }

    fn oriented(&self, centre: DVec3, along_north: DVec3) -> Camera {
        let north = (along_north - centre * along_north.dot(centre)).normalize();
        // seen from inside, east x north = outward
        let east = north.cross(centre);
        let axis = |a: DVec2| east * a.x + north * a.y;
        Camera { centre, x: axis(self.axes[0]), y: axis(self.axes[1]) }
    }

    /// The exact map from pixel offsets to astrometric places with the place `centre` at the reference pixel: the
    /// reference twin of the expansion in [`Wcs`].
    #[cfg(test)]
    pub(super) fn exact_sky<'m>(&'m self, observer: &'m Observer, centre: DVec3) -> impl Fn(DVec2) -> DVec3 + 'm {
        let unshifted = Self { offset: DVec2::ZERO, ..self.clone() };
        let camera = unshifted.camera(observer, centre);
        move |offset| observer.astrometric(camera.observed(offset, self.scale))
    }

    fn wcs(&self, observer: &Observer, camera: &Camera) -> Wcs {
        Wcs::from_map(self.crpix, self.half_size, |offset| {
            observer.astrometric(camera.observed(offset, self.scale))
        })
        .through(self.distortion.as_ref())
    }
}

/// A direction moved east and north by angles \[rad\] on its tangent plane.
fn moved(from: DVec3, by: DVec2) -> DVec3 {
    let (east, north) = east_north(from);
    (from + east * by.x + north * by.y).normalize()
}
