//! From a scene to the geometry of its exposures, each computed once.

use super::PlanError;
use super::brightness::{Glow, TargetLight};
use super::constraints;
use super::interval::{Interval, Margin};
use super::motion::{self, Need};
use super::place::{Motion, Place};
use super::pointing::{Attitudes, Mount};
use super::sight::sight;
use super::view::{Body, Circumstances, Horizontal, Moon, Observability, Planned, Sighting, TargetView, View};
use super::wcs::{Wcs, east_north};
use super::windows::{Condition, Night, Window, nights};
use crate::astro::attitude::Profile;
use crate::astro::observer::{Air, Observer, Site, airmass};
use crate::astro::rotation::Quaternion;
use crate::astro::time::Instant;
use crate::astro::{self, bodies, eop, separation};
use crate::base::constants::{EARTH_RATE_RAD_S, LIGHT_M_S};
use crate::base::units::{ARCSEC_PER_RAD, flux_from_mag};
use crate::object::shadow::card::Graphics;
use crate::scene::{Brightness, Scene};
use glam::DVec2;
use rayon::prelude::*;
use std::sync::{Mutex, PoisonError};

/// Half the step of the numerical derivative of a place \[s\].
const RATE_STEP_S: f64 = 0.1;

/// Elements farther from the first exposure than this are warned about \[days\].
pub const OLD_ELEMENTS_DAYS: f64 = 14.0;

/// Turn of a shape between two looks at its brightness in the search of windows \[rad\], and the times \[s\] that it takes at
/// least and at most.
const LOOK_RAD: f64 = 0.05;
const SHORTEST_LOOK_S: f64 = 2.0;
const LONGEST_LOOK_S: f64 = 60.0;

/// A scene made ready for planning.
#[derive(Debug, Clone)]
pub struct Planner<'a> {
    scene: &'a Scene,
    /// The station.
    pub site: Site,
    motions: Vec<Motion>,
    profiles: Vec<Option<Profile>>,
    mount: Mount,
}

impl<'a> Planner<'a> {
    /// The planner of a scene.
    ///
    /// # Errors
    /// [`PlanError`] for elements that cannot be used or a frame with nothing to point at.
    pub fn new(scene: &'a Scene) -> Result<Self, PlanError> {
        let s = &scene.station;
        let air = Air { pressure_hpa: s.pressure_hpa, temperature_c: s.temperature_c, humidity: s.humidity };
        let site = Site::new(s.longitude_deg.to_radians(), s.latitude_deg.to_radians(), s.height_m, &air);
        let first = scene.exposures.start;
        let lasting = scene.exposures.cadence_s * scene.exposures.count as f64;
        let need = Need { first, last: first.plus(lasting), position_mas: scene.accuracy.position_mas };
        let motions = scene.target.iter().map(|t| motion::motion(t, &need)).collect::<Result<Vec<_>, _>>()?;
        let profiles = scene.target.iter().map(|t| t.attitude.as_ref().map(motion::profile).transpose());
        let profiles = profiles.collect::<Result<_, _>>()?;
        let mount = Mount::of(scene, &motions)?;
        Ok(Self { scene, site, motions, profiles, mount })
    }

    /// What a user should know: elements older or younger than a fortnight at the first exposure, and exposures after the
    /// end of the Earth orientation table; doubtful meshes. SGP4 errs by a kilometre or so a day in a low orbit, less farther out (Vallado &
    /// Cefola 2012, IAC-12-A6.6.11).
    pub fn warnings(&self) -> Vec<String> {
        let exposed = self.exposed();
        let ages = self.motions.iter().map(|motion| motion.element_age_days(&exposed.start));
        let old = |(target, age): (&crate::scene::Target, Option<f64>)| {
            let age = age.filter(|days| days.abs() > OLD_ELEMENTS_DAYS)?;
            let side = if age > 0.0 { "older" } else { "younger" };
            Some(format!("elements of {} are {:.0} days {side} than the first exposure", target.name, age.abs()))
        };
        let mut warnings = self.scene.target.iter().zip(ages).filter_map(old).collect::<Vec<_>>();
        for target in &self.scene.target {
            if let Brightness::Shape(shaped) = &target.brightness {
                warnings
                    .extend(shaped.built.doubts.iter().map(|doubt| format!("shape of {}: {doubt}", target.name)));
            }
        }
        if let Ok(eop) = eop::at(&exposed.end)
            && eop.beyond_days > 0.0
        {
            warnings.push(format!(
                "the last exposure is {:.0} days after the Earth orientation table: UT1 is extrapolated and may be off by \
                 {:.2} s, which turns the sky by {:.1} arcsec; renew catalogs/eop",
                eop.beyond_days,
                eop.ut1_bound_s(),
                eop.ut1_bound_s() * EARTH_RATE_RAD_S * ARCSEC_PER_RAD,
            ));
        }
        warnings
    }

    /// Age of each target's elements at the first exposure \[days\], and how its orbit is computed; of those that have one.
    pub fn orbits(&self) -> Vec<(&str, f64, String)> {
        let start = self.exposed().start;
        let told = |(target, motion): (&'a crate::scene::Target, &Motion)| match motion {
            Motion::Orbit(orbit) => {
                let age = motion.element_age_days(&start).unwrap_or(f64::NAN);
                Some((target.name.as_str(), age, orbit.describe()))
            }
            Motion::Fixed(..) => None,
        };
        self.scene.target.iter().zip(&self.motions).filter_map(told).collect()
    }

    /// Attitude of a target at mid-exposure, if the scene tells of one: where it was when its light left.
    ///
    /// # Errors
    /// [`PlanError`] where it is not known.
    pub fn attitude(&self, target: usize, view: &View) -> Result<Option<Quaternion>, PlanError> {
        let (Some(Some(profile)), Some(seen)) = (self.profiles.get(target), view.targets.get(target)) else {
            return Ok(None);
        };
        let light_time = if seen.place.range_m.is_nan() { 0.0 } else { seen.place.range_m / LIGHT_M_S };
        Ok(Some(profile.at(&view.mid.plus(-light_time), &seen.place.surroundings(&seen.light))?))
    }

    /// Attitude of a target at an instant, if the scene tells of one: where it was when the light left that needs `light_time_s`, or as
    /// long as its orbit says if that is longer.
    ///
    /// # Errors
    /// [`PlanError`] where it is not known.
    pub fn attitude_at(
        &self,
        target: usize,
        t: &Instant,
        light_time_s: f64,
    ) -> Result<Option<Quaternion>, PlanError> {
        let Some(Some(profile)) = self.profiles.get(target) else { return Ok(None) };
        let motion = self.motions.get(target).ok_or(PlanError::NoTarget)?;
        let seen = sight(&self.site, motion, &Observer::at(&self.site, t)?, [t, t, t])?;
        let own_s = if seen.place.range_m.is_nan() { 0.0 } else { seen.place.range_m / LIGHT_M_S };
        Ok(Some(profile.at(&t.plus(-own_s.max(light_time_s)), &seen.place.surroundings(&seen.light))?))
    }

    /// The observer at `t`.
    ///
    /// # Errors
    /// [`PlanError`] where the Earth's orientation is unknown.
    pub fn observer(&self, t: &Instant) -> Result<Observer, PlanError> {
        Ok(Observer::at(&self.site, t)?)
    }

    /// World coordinates at any instant of an exposure.
    ///
    /// # Errors
    /// [`PlanError`] where the sky cannot be computed.
    pub fn wcs_at(&self, view: &View, t: &Instant) -> Result<Wcs, PlanError> {
        Ok(self.mount.attitudes(&self.site, [t, &view.mid, &view.end])?.start)
    }

    /// The light of the target of that number, if there is one.
    pub fn glow(&self, target: usize, graphics: &Graphics) -> Option<Glow<'_>> {
        let own = self.scene.target.get(target)?;
        let motion = self.motions.get(target)?;
        let profile = self.profiles.get(target).and_then(Option::as_ref);
        let relative = self.scene.accuracy.brightness;
        Some(Glow::new(&own.brightness, &self.site, (motion, profile), relative, graphics))
    }

    /// The light of all targets in an exposure.
    ///
    /// # Errors
    /// [`PlanError`] where an attitude is not known.
    pub fn lights(&self, view: &View, graphics: &Graphics) -> Result<Vec<TargetLight>, PlanError> {
        let targets = (0..self.scene.target.len()).filter_map(|k| self.glow(k, graphics).zip(view.sighting(k)));
        targets.map(|(mut glow, seen)| glow.over(&seen)).collect()
    }

    /// How the target of that number moves.
    pub fn motion(&self, target: usize) -> Option<&Motion> {
        self.motions.get(target)
    }

    /// First opening and last closing of the shutter.
    pub fn exposed(&self) -> Interval {
        let exposures = &self.scene.exposures;
        let start = exposures.start;
        let last = exposures.cadence_s * exposures.count.saturating_sub(1) as f64;
        Interval { start, end: start.plus(last + exposures.duration_s) }
    }

    /// The nights in which the exposures lie, from noon to noon.
    ///
    /// # Errors
    /// [`PlanError`] where the Earth's orientation is unknown.
    pub fn night(&self) -> Result<Night<'a>, PlanError> {
        let exposed = self.exposed();
        let longitude = self.scene.station.longitude_deg.to_radians();
        Night::new(self.scene, self.site, nights(&exposed.start, &exposed.end, longitude))
    }

    /// Windows of a target in a night: the scene's limits, its faintest magnitude among them, and a `further` condition.
    ///
    /// # Errors
    /// [`PlanError`] where the Earth's orientation is unknown.
    pub fn windows(
        &self,
        target: usize,
        night: &Night,
        further: Option<&Condition>,
    ) -> Result<Vec<Window>, PlanError> {
        let (Some(motion), Some(own)) = (self.motions.get(target), self.scene.target.get(target)) else {
            return Ok(Vec::new());
        };
        let faintest = self.scene.plan.limit_mag_v;
        let limit = faintest.map_or(0.0, flux_from_mag);
        // a constant magnitude is bright enough for ever or never; a shape is looked at often in every turn
        let glow = Mutex::new(self.glow(target, &Graphics::default()));
        let safe_s = match own.brightness {
            Brightness::MagV(_) => f64::INFINITY,
            Brightness::Shape(_) => {
                let fastest = self.profiles.get(target).and_then(Option::as_ref).map_or(0.0, Profile::fastest);
                (LOOK_RAD / fastest).clamp(SHORTEST_LOOK_S, LONGEST_LOOK_S)
            }
        };
        let bright = |t: &Instant, observer: &Observer, place: &Place| {
            let mut glow = glow.lock().unwrap_or_else(PoisonError::into_inner);
            let value = match (&own.brightness, glow.as_mut()) {
                (Brightness::MagV(mag_v), _) => faintest.map_or(1.0, |faintest| faintest - mag_v),
                (Brightness::Shape(_), Some(glow)) => {
                    glow.at_place(t, place, observer).map_or(f64::NAN, |(v_flux, _)| v_flux - limit)
                }
                (Brightness::Shape(_), None) => 1.0,
            };
            Margin { value, safe_s }
        };
        let conditions = faintest.map(|_| &bright as &Condition).into_iter().chain(further).collect::<Vec<_>>();
        let both = |t: &Instant, observer: &Observer, place: &Place| {
            let mut all = Margin { value: f64::INFINITY, safe_s };
            for one in conditions.iter().map(|condition| condition(t, observer, place)) {
                // what is not a number stays none
                let value = if all.value < one.value { all.value } else { one.value };
                all = Margin { value, safe_s: all.safe_s.min(one.safe_s) };
                if value.is_nan() || value < 0.0 {
                    break;
                }
            }
            all
        };
        night.windows(motion, (!conditions.is_empty()).then_some(&both as &Condition))
    }

    /// The observer, the Sun and the Moon at `instant`.
    ///
    /// # Errors
    /// [`PlanError`] where the Earth's orientation is unknown.
    pub fn circumstances(&self, instant: &Instant) -> Result<Circumstances, PlanError> {
        let observer = Observer::at(&self.site, instant)?;
        let (sun, moon) = (sun(&observer, instant), moon(&observer, instant));
        Ok(Circumstances { instant: *instant, observer, sun, moon })
    }

    /// The geometry of frame number `frame`.
    ///
    /// # Errors
    /// [`PlanError`] where the sky cannot be computed.
    pub fn view(&self, frame: usize) -> Result<View, PlanError> {
        let exposures = &self.scene.exposures;
        let start = exposures.start.plus(frame as f64 * exposures.cadence_s);
        let mut view = View { frame, ..self.view_from(&start)? };
        let first = if self.scene.plan.limit_mag_v.is_some() { self.glow(0, &Graphics::default()) } else { None };
        let light = first.zip(view.sighting(0)).map(|(mut glow, seen)| glow.over(&seen)).transpose()?;
        let mag_v = light.map(|light| light.mag_v());
        view.observability = constraints::assess(&view, self.scene, mag_v);
        Ok(view)
    }

    /// The geometry of an exposure from `start` on, frame number 0, not held against the limits.
    ///
    /// # Errors
    /// [`PlanError`] where the sky cannot be computed.
    pub fn view_from(&self, start: &Instant) -> Result<View, PlanError> {
        let (start, exposures) = (*start, &self.scene.exposures);
        let (mid, end) = (start.plus(0.5 * exposures.duration_s), start.plus(exposures.duration_s));
        let observer = Observer::at(&self.site, &mid)?;
        let wcs = self.mount.attitudes(&self.site, [&start, &mid, &end])?;
        let centre = Horizontal::of(observer.observed(wcs.mid.centre));
        let sun = sun(&observer, &mid);
        let moon = moon(&observer, &mid);
        let targets = self
            .motions
            .iter()
            .map(|motion| self.target(motion, &observer, &moon, [&start, &mid, &end]))
            .collect::<Result<Vec<_>, _>>()?;
        Ok(View {
            frame: 0,
            start,
            mid,
            end,
            exposure_s: exposures.duration_s,
            observer,
            wcs,
            centre,
            airmass: airmass(centre.elevation),
            track_rate: track_rate(&wcs, exposures.duration_s),
            sun,
            moon,
            targets,
            observability: Observability::default(),
        })
    }

    /// Frame number `frame` as planned: one whose target's orbit is not known then is told so.
    ///
    /// # Errors
    /// [`PlanError`] where the sky cannot be computed.
    pub fn planned(&self, frame: usize) -> Result<Planned, PlanError> {
        match self.view(frame) {
            Ok(view) => Ok(Planned::Known(Box::new(view))),
            Err(PlanError::Astro(why @ astro::Error::Propagation { .. })) => {
                let exposures = &self.scene.exposures;
                let mid = exposures.start.plus(frame as f64 * exposures.cadence_s + 0.5 * exposures.duration_s);
                Ok(Planned::Unknown { frame, mid, why: why.to_string() })
            }
            Err(other) => Err(other),
        }
    }

    /// All frames of the scene as planned, computed in parallel; `done` is called after each.
    ///
    /// # Errors
    /// [`PlanError`] where the sky cannot be computed.
    pub fn all(&self, done: &(dyn Fn() + Sync)) -> Result<Vec<Planned>, PlanError> {
        let planned = |frame| {
            let planned = self.planned(frame);
            done();
            planned
        };
        (0..self.scene.exposures.count).into_par_iter().map(planned).collect()
    }

    /// The geometry of all frames of the scene for which it is known.
    ///
    /// # Errors
    /// [`PlanError`] where the sky cannot be computed.
    pub fn views(&self) -> Result<Vec<View>, PlanError> {
        Ok(known(self.all(&|| ())?))
    }

    /// What the light of a target in frame number `frame` depends on, without all the rest of a view.
    ///
    /// # Errors
    /// [`PlanError`] where its place is not known.
    pub fn sighting(&self, frame: usize, target: usize) -> Result<Sighting, PlanError> {
        let exposures = &self.scene.exposures;
        let start = exposures.start.plus(frame as f64 * exposures.cadence_s);
        let (mid, end) = (start.plus(0.5 * exposures.duration_s), start.plus(exposures.duration_s));
        let observer = Observer::at(&self.site, &mid)?;
        let motion = self.motions.get(target).ok_or(PlanError::NoTarget)?;
        Ok(sight(&self.site, motion, &observer, [&start, &mid, &end])?)
    }

    fn target(
        &self,
        motion: &Motion,
        observer: &Observer,
        moon: &Moon,
        [start, mid, end]: [&Instant; 3],
    ) -> Result<TargetView, astro::Error> {
        let seen = sight(&self.site, motion, observer, [start, mid, end])?;
        let place = seen.place;
        let at = |t: &Instant| motion.place(&self.site, t);
        let (first, last) = (at(start)?, at(end)?);
        // at the end of an ephemeris the difference is one-sided
        let (ahead, behind) = (at(&mid.plus(RATE_STEP_S)), at(&mid.plus(-RATE_STEP_S)));
        let sides = f64::from(u8::from(ahead.is_ok()) + u8::from(behind.is_ok())).max(1.0);
        let step = ahead.unwrap_or(place).astrometric - behind.unwrap_or(place).astrometric;
        let (east, north) = east_north(place.astrometric);
        Ok(TargetView {
            place,
            start_end: [first.astrometric, last.astrometric],
            light: seen.light,
            sunlit_mean: seen.sunlit_mean,
            apparent: seen.apparent,
            airmass: seen.airmass,
            rate: DVec2::new(step.dot(east), step.dot(north)) / (sides * RATE_STEP_S),
            moon_separation: separation(place.geocentric, moon.body.direction),
        })
    }
}

/// The geometry of those frames for which it is known.
pub fn known(planned: Vec<Planned>) -> Vec<View> {
    let view = |planned| match planned {
        Planned::Known(view) => Some(*view),
        Planned::Unknown { .. } => None,
    };
    planned.into_iter().filter_map(view).collect()
}

fn sun(observer: &Observer, t: &Instant) -> Body {
    let direction = bodies::sun_from(t, observer.gcrs).normalize();
    Body { horizontal: Horizontal::of(observer.airless(direction)), direction }
}

fn moon(observer: &Observer, t: &Instant) -> Moon {
    let vector = bodies::moon_from(t, observer.gcrs);
    let sun_from_moon = observer.earth.to_sun - (observer.gcrs + vector);
    Moon {
        body: Body {
            horizontal: Horizontal::of(observer.airless_geocentric(vector)),
            direction: vector.normalize(),
        },
        phase: separation(sun_from_moon, -vector),
    }
}

/// Motion of the frame's centre among the stars \[rad/s\]; 0 for an instantaneous exposure.
fn track_rate(wcs: &Attitudes, exposure_s: f64) -> DVec2 {
    if exposure_s <= 0.0 {
        return DVec2::ZERO;
    }
    let (east, north) = east_north(wcs.mid.centre);
    let moved = wcs.end.centre - wcs.start.centre;
    DVec2::new(moved.dot(east), moved.dot(north)) / exposure_s
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Options, load};
    use glam::DVec3;

    /// The parabola through three places, at a quarter of the exposure.
    fn at_quarter([start, mid, end]: [DVec2; 3]) -> DVec2 {
        start * 0.375 + mid * 0.75 - end * 0.125
    }

    /// Largest departure \[px\] of the parabola from the exact path of a place at rest among the stars, and of the
    /// target, at a quarter of the exposure.
    fn departure(sets: &[(&str, &str)]) -> (f64, f64) {
        let sets = sets.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect::<Vec<_>>();
        let scene = load("pogs-geo", &Options { sets: &sets, seed: None }).expect("a good scene");
        let planner = Planner::new(&scene).expect("a planner");
        let view = planner.view(0).expect("geometry");
        let quarter = view.start.plus(0.25 * view.exposure_s);
        let exact =
            planner.mount.attitudes(&planner.site, [&quarter, &view.mid, &view.end]).expect("geometry").start;
        let three = |icrs: [DVec3; 3]| {
            let wcs = [view.wcs.start, view.wcs.mid, view.wcs.end];
            [0, 1, 2].map(|k| wcs[k].pixel(icrs[k]).expect("in front"))
        };
        let corner = view.wcs.mid.sky(DVec2::new(10.0, 4000.0));
        let star = (at_quarter(three([corner; 3])) - exact.pixel(corner).expect("in front")).length();
        let seen = &view.targets[0];
        let moving = planner.motions[0].place(&planner.site, &quarter).expect("a place").astrometric;
        let places = three([seen.start_end[0], seen.place.astrometric, seen.start_end[1]]);
        (star, (at_quarter(places) - exact.pixel(moving).expect("in front")).length())
    }

    /// A tolerance of `accuracy.trail_px` = 0.01 px holds with room to spare for geostationary satellites and for the
    /// stars behind them, whatever the mount follows; a tracked low orbit's stars bend more.
    #[test]
    fn parabolas_follow_the_exact_paths() {
        for (track, allowed) in [("target", 1e-4), ("sidereal", 1e-4), ("fixed", 1e-4)] {
            let (star, target) = departure(&[("exposures.track", track)]);
            assert!(star < allowed && target < allowed, "{track}: {star:e} {target:e}");
        }
        let iss = "[\"1 25544U 98067A   18020.89808844  .00002078  00000-0  38550-4 0  9992\", \
                   \"2 25544  51.6424  32.9776 0003646  28.7227  39.5332 15.54190080 95614\"]";
        let (star, target) = departure(&[
            ("target.0.orbit.tle", iss),
            ("exposures.start", "2018-01-21T00:36:00Z"),
            ("exposures.duration_s", "1.0"),
        ]);
        assert!(star < 0.05 && target < 1e-3, "low orbit: {star:e} {target:e}");
    }

    /// The expansion of refraction and aberration over the whole frame, against the exact map: quadratic and cubic
    /// terms are kept where they exceed 0.02 px in a corner.
    #[test]
    fn world_coordinates_follow_the_exact_map_down_to_low_elevation() {
        for (elevation, allowed) in [("80.0", 0.02), ("45.0", 0.02), ("20.0", 0.02), ("10.0", 0.02)] {
            let sets = [
                ("pointing.at", "azel"),
                ("pointing.az_deg", "137.0"),
                ("pointing.el_deg", elevation),
                ("exposures.track", "sidereal"),
            ]
            .map(|(k, v)| (k.to_owned(), v.to_owned()));
            let scene = load("pogs-geo", &Options { sets: &sets, seed: None }).expect("a good scene");
            let planner = Planner::new(&scene).expect("a planner");
            let view = planner.view(0).expect("geometry");
            let exact = planner.mount.exact_sky(&view.observer, view.wcs.mid.centre);
            let corners = [(0.0, 0.0), (4095.0, 0.0), (0.0, 4095.0), (4095.0, 4095.0), (2047.5, 0.0)];
            let largest = corners
                .map(|(x, y)| {
                    let pixel = DVec2::new(x, y);
                    let sky = exact(pixel - view.wcs.mid.crpix);
                    (view.wcs.mid.pixel(sky).expect("in front") - pixel).length()
                })
                .into_iter()
                .fold(0.0, f64::max);
            assert!(largest < allowed, "{elevation} deg: {largest} px");
        }
    }
}
