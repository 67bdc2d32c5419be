//! Windows: when an object can be observed, and what limits it.
//!
//! Conditions are taken in this order: elevation, horizon mask, Sun, Moon, the Earth's shadow, and whatever a caller adds
//! (a brightness or signal-to-noise limit). Each is looked at only where those before it hold, so that an object below
//! the horizon costs next to nothing. How far a walk may go without missing a change follows from how fast the object can
//! move ([`super::pace`]).

use super::PlanError;
use super::constraints::horizon;
use super::interval::{Interval, LEAST_STEP_S, Margin, highest, pieces};
use super::pace::Pace;
use super::place::{Motion, Place};
use super::view::Horizontal;
use crate::astro::observer::{Observer, Site};
use crate::astro::orbit::Orbit;
use crate::astro::shadow::Occultation;
use crate::astro::time::Instant;
use crate::astro::{self, bodies, separation};
use crate::base::constants::EARTH_RATE_RAD_S;
use crate::scene::{PlanLimits, Scene};
use std::f64::consts::PI;

/// An orbit begins and ceases to be known later than it does by its own clock, by the light time: at most this \[s\].
const LIGHT_TIME_S: f64 = 60.0;
/// Bound of the Sun's motion across the sky \[rad/s\]: the Earth's rotation and a fiftieth.
pub const SUN_RATE: f64 = 1.02 * EARTH_RATE_RAD_S;

/// Why an object cannot be observed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Reason {
    /// Too low.
    Elevation,
    /// Behind the horizon mask.
    Mask,
    /// Too bright a sky.
    Sun,
    /// Too near the Moon.
    Moon,
    /// In the Earth's shadow.
    Shadow,
    /// What the caller adds.
    Limit,
    /// Its orbit is not known then.
    Unknown,
}

impl Reason {
    /// In words, with the limit.
    pub fn words(self, limits: &PlanLimits) -> String {
        match self {
            Self::Elevation => format!("elevation below {} deg", limits.min_el_deg),
            Self::Mask => "below the horizon mask".into(),
            Self::Sun => format!("Sun above {} deg", limits.max_sun_el_deg),
            Self::Moon => format!("Moon nearer than {} deg", limits.min_moon_sep_deg),
            Self::Shadow => "in the Earth's shadow".into(),
            Self::Limit if limits.min_snr.is_some() => "too faint, or its SNR not known".into(),
            Self::Limit => "too faint".into(),
            Self::Unknown => "orbit not known".into(),
        }
    }
}

/// A further condition on an object at an instant: above 0 where it holds, and how long \[s\] its sign stays.
pub type Condition<'c> = dyn Fn(&Instant, &Observer, &Place) -> Margin + Sync + 'c;

/// A stretch of time in which an object can, or cannot, be observed.
#[derive(Debug, Clone, PartialEq)]
pub struct Window {
    /// When.
    pub interval: Interval,
    /// Whether it can be observed.
    pub observable: bool,
    /// Observable: what ends before it and begins after it, if anything. Else: the reasons, and the share of the time for
    /// which each comes first.
    pub limits: Limits,
    /// When it stands highest, and how high \[rad\]; NaN where that is not known.
    pub highest: (Instant, f64),
}

/// What limits a window.
#[derive(Debug, Clone, PartialEq)]
pub enum Limits {
    /// What makes the window open and close.
    Edges {
        /// Before it; none at the start of the search.
        opens: Option<Reason>,
        /// After it; none at the end of the search.
        closes: Option<Reason>,
    },
    /// Reasons and shares of the time, largest first.
    Broken(Vec<(Reason, f64)>),
}

/// Everything about a night at a station that its objects share.
#[derive(Debug, Clone)]
pub struct Night<'a> {
    site: Site,
    limits: PlanLimits,
    mask: &'a [[f64; 2]],
    /// The time searched.
    pub span: Interval,
    sun: Vec<(Interval, bool)>,
}

/// The stretch from the noon before to the noon after some time, by mean solar time at a longitude \[rad\].
pub fn nights(start: &Instant, end: &Instant, longitude: f64) -> Interval {
    let local = longitude / (2.0 * PI);
    let noon = |mjd: f64, round: fn(f64) -> f64| {
        let day = round(mjd + local - 0.5) + 0.5 - local;
        let whole = day.floor();
        Instant::from_utc_reading(whole as i64, ((day - whole) * 8.64e13).round() as i64)
    };
    let (first, mut last) = (noon(start.mjd_utc(), f64::floor), noon(end.mjd_utc(), f64::ceil));
    if last <= first {
        last = first.plus(86_400.0);
    }
    Interval { start: first, end: last }
}

impl<'a> Night<'a> {
    /// The night of a scene's station over `span`.
    ///
    /// # Errors
    /// [`PlanError`] where the Earth's orientation is unknown.
    pub fn new(scene: &'a Scene, site: Site, span: Interval) -> Result<Self, PlanError> {
        let limit = scene.plan.max_sun_el_deg.to_radians();
        let sun = pieces(span, LEAST_STEP_S, |t| {
            let observer = Observer::at(&site, t)?;
            let value = limit - sun_elevation(&observer, t);
            Ok::<_, astro::Error>(Margin { value, safe_s: value.abs() / SUN_RATE })
        })?;
        Ok(Self { site, limits: scene.plan.clone(), mask: &scene.station.horizon_deg, span, sun })
    }

    /// Pieces of the span in which the Sun is low enough, or not.
    pub fn sun(&self) -> &[(Interval, bool)] {
        &self.sun
    }

    /// Windows of an object: every instant of the span is in one of them.
    ///
    /// # Errors
    /// [`PlanError`] where the Earth's orientation is unknown.
    pub fn windows(&self, motion: &Motion, condition: Option<&Condition>) -> Result<Vec<Window>, PlanError> {
        let pace = Pace::of(motion, &self.span.start);
        let timeline = self.timeline(motion, &pace, condition)?;
        let mut out = Vec::new();
        let mut at = 0;
        while at < timeline.len() {
            let observable = timeline[at].1.is_none();
            let end = timeline[at..]
                .iter()
                .position(|(_, r)| r.is_none() != observable)
                .map_or(timeline.len(), |n| at + n);
            let run = &timeline[at..end];
            let interval = Interval { start: run[0].0.start, end: run[run.len() - 1].0.end };
            let limits = if observable {
                Limits::Edges {
                    opens: at.checked_sub(1).and_then(|i| timeline[i].1),
                    closes: timeline.get(end).and_then(|(_, reason)| *reason),
                }
            } else {
                let mut shares: Vec<(Reason, f64)> = Vec::new();
                for (piece, reason) in run {
                    let Some(reason) = reason else { continue };
                    let share = piece.seconds() / interval.seconds();
                    match shares.iter_mut().find(|(known, _)| known == reason) {
                        Some((_, sum)) => *sum += share,
                        None => shares.push((*reason, share)),
                    }
                }
                shares.sort_by(|a, b| b.1.total_cmp(&a.1));
                Limits::Broken(shares)
            };
            let highest = if observable {
                highest(interval, pace.turn_s, |t| self.elevation(motion, t))?
            } else {
                (interval.start, f64::NAN)
            };
            out.push(Window { interval, observable, limits, highest });
            at = end;
        }
        Ok(out)
    }

    fn elevation(&self, motion: &Motion, t: &Instant) -> Result<f64, astro::Error> {
        let observer = Observer::at(&self.site, t)?;
        match motion.place_from(&observer, t) {
            Ok(place) => Ok(apparent(&observer, &place).elevation),
            // a rounding beyond the end of what is known
            Err(astro::Error::Propagation { .. }) => Ok(f64::NEG_INFINITY),
            Err(other) => Err(other),
        }
    }

    /// The span cut where the orbit begins and ceases to be known: an ephemeris ends, an object comes down. That happens at
    /// the ends of an ephemeris' segments; any other orbit is known from some time before its epoch to some time after.
    fn known(&self, motion: &Motion) -> Result<Vec<(Interval, Option<Reason>)>, PlanError> {
        let marks = match motion {
            Motion::Fixed(..) => return Ok(vec![(self.span, None)]),
            Motion::Orbit(Orbit::Ephemeris(table)) => table.usable().flatten().collect::<Vec<_>>(),
            Motion::Orbit(orbit) => orbit.epoch().into_iter().collect(),
        };
        let steady = |t: &Instant| {
            let next = marks.iter().map(|mark| t.since(mark).abs()).fold(f64::INFINITY, f64::min);
            // an orbit that is no table may end anywhere: an hour at a time
            if matches!(motion, Motion::Orbit(Orbit::Ephemeris(_))) { next } else { next.min(3600.0) }
        };
        let cut = pieces(self.span, LEAST_STEP_S, |t| {
            let observer = Observer::at(&self.site, t)?;
            let safe_s = (steady(t) - LIGHT_TIME_S).max(LEAST_STEP_S);
            match motion.place_from(&observer, t) {
                Ok(_) => Ok(Margin { value: 1.0, safe_s }),
                Err(astro::Error::Propagation { .. }) => Ok(Margin { value: -1.0, safe_s }),
                Err(other) => Err(other),
            }
        })?;
        Ok(first_broken(cut, Reason::Unknown))
    }

    /// The span cut where the first condition that is broken changes; none: all hold.
    fn timeline(
        &self,
        motion: &Motion,
        pace: &Pace,
        condition: Option<&Condition>,
    ) -> Result<Vec<(Interval, Option<Reason>)>, PlanError> {
        let mut timeline: Vec<(Interval, Option<Reason>)> = Vec::new();
        let mut push = |interval: Interval, reason: Option<Reason>| match timeline.last_mut() {
            Some((last, before)) if *before == reason => last.end = interval.end,
            _ => timeline.push((interval, reason)),
        };
        let wall = Wall::of(self.mask);
        let min_el = self.limits.min_el_deg.to_radians();
        let mut up = Vec::new();
        for (interval, reason) in self.known(motion)? {
            if reason.is_some() {
                up.push((interval, reason));
                continue;
            }
            let cut = self.cut(interval, motion, |_, observer, place| {
                let value = apparent(observer, place).elevation - min_el;
                Margin { value, safe_s: pace.safe_s(value, place.range_m) }
            })?;
            up.extend(first_broken(cut, Reason::Elevation));
        }
        for (interval, reason) in up {
            let Some(interval) = passes(&mut push, interval, reason) else { continue };
            // the mask asks for a closer look only where it rises above the lowest elevation
            let masked = if self.mask.iter().all(|p| p[1] <= self.limits.min_el_deg) {
                vec![(interval, None)]
            } else {
                let seen = self.cut(interval, motion, |_, observer, place| {
                    let seen = apparent(observer, place);
                    let value = seen.elevation - horizon(self.mask, seen.azimuth.to_degrees()).to_radians();
                    Margin { value, safe_s: pace.safe_s(wall.safe_angle(&seen, value), place.range_m) }
                })?;
                first_broken(seen, Reason::Mask)
            };
            for (interval, reason) in masked {
                let Some(interval) = passes(&mut push, interval, reason) else { continue };
                for (dark, holds) in &self.sun {
                    let Some(interval) = interval.common(dark) else { continue };
                    let reason = (!holds).then_some(Reason::Sun);
                    let Some(interval) = passes(&mut push, interval, reason) else { continue };
                    self.lit_and_clear(interval, motion, pace, condition, &mut push)?;
                }
            }
        }
        Ok(timeline)
    }

    /// Moon, shadow and the caller's condition within an interval.
    fn lit_and_clear(
        &self,
        interval: Interval,
        motion: &Motion,
        pace: &Pace,
        condition: Option<&Condition>,
        push: &mut impl FnMut(Interval, Option<Reason>),
    ) -> Result<(), PlanError> {
        let min_moon = self.limits.min_moon_sep_deg.to_radians();
        let clear = self.cut(interval, motion, |t, observer, place| {
            let moon = bodies::moon_from(t, observer.gcrs);
            let value = separation(place.geocentric, moon) - min_moon;
            Margin { value, safe_s: pace.safe_s(value, place.range_m) }
        })?;
        for (interval, reason) in first_broken(clear, Reason::Moon) {
            let Some(interval) = passes(push, interval, reason) else { continue };
            let lit = if self.limits.sunlit {
                let lit = self.cut(interval, motion, |_, observer, place| {
                    let value = sunlight_margin(observer, place);
                    Margin { value, safe_s: value.abs() / pace.limb_rate }
                })?;
                first_broken(lit, Reason::Shadow)
            } else {
                vec![(interval, None)]
            };
            for (interval, reason) in lit {
                let Some(interval) = passes(push, interval, reason) else { continue };
                match condition {
                    None => push(interval, None),
                    Some(condition) => {
                        let bright =
                            self.cut(interval, motion, |t, observer, place| condition(t, observer, place))?;
                        for (interval, reason) in first_broken(bright, Reason::Limit) {
                            push(interval, reason);
                        }
                    }
                }
            }
        }
        Ok(())
    }

    /// Pieces of an interval by a margin; where the orbit is not known the margin is not a number.
    fn cut(
        &self,
        interval: Interval,
        motion: &Motion,
        margin: impl Fn(&Instant, &Observer, &Place) -> Margin,
    ) -> Result<Vec<(Interval, bool)>, PlanError> {
        Ok(pieces(interval, LEAST_STEP_S, |t| {
            let observer = Observer::at(&self.site, t)?;
            match motion.place_from(&observer, t) {
                Ok(place) => Ok(margin(t, &observer, &place)),
                Err(astro::Error::Propagation { .. }) => Ok(Margin { value: f64::NAN, safe_s: 600.0 }),
                Err(other) => Err(other),
            }
        })?)
    }
}

/// A horizon mask's extremes \[rad\] and its steepest slope.
struct Wall {
    lowest: f64,
    highest: f64,
    slope: f64,
}

impl Wall {
    fn of(mask: &[[f64; 2]]) -> Self {
        let heights = || mask.iter().map(|p| p[1].to_radians());
        let round = mask.iter().zip(mask.iter().cycle().skip(1));
        let slope = |(a, b): (&[f64; 2], &[f64; 2])| {
            let width = (b[0] - a[0]).rem_euclid(360.0);
            if width > 0.0 { ((b[1] - a[1]) / width).abs() } else { 0.0 }
        };
        Self {
            lowest: heights().fold(f64::INFINITY, f64::min),
            highest: heights().fold(f64::NEG_INFINITY, f64::max),
            slope: round.map(slope).fold(0.0, f64::max),
        }
    }

    /// How far \[rad\] a direction, `margin` above the mask, may surely move before it crosses it.
    fn safe_angle(&self, seen: &Horizontal, margin: f64) -> f64 {
        let beyond = (seen.elevation - self.highest).max(self.lowest - seen.elevation);
        // azimuth runs faster than the motion by 1/cos of the elevation
        let top = (seen.elevation.abs() + margin.abs()).min(1.55);
        beyond.max(margin.abs() / (1.0 + self.slope / top.cos()))
    }
}

/// Hands on an interval in which nothing is broken; pushes the others.
fn passes(
    push: &mut impl FnMut(Interval, Option<Reason>),
    interval: Interval,
    reason: Option<Reason>,
) -> Option<Interval> {
    match reason {
        None => Some(interval),
        broken => {
            push(interval, broken);
            None
        }
    }
}

fn first_broken(pieces: Vec<(Interval, bool)>, reason: Reason) -> Vec<(Interval, Option<Reason>)> {
    pieces.into_iter().map(|(interval, holds)| (interval, (!holds).then_some(reason))).collect()
}

fn apparent(observer: &Observer, place: &Place) -> Horizontal {
    Horizontal::of(observer.refracted(observer.airless_geocentric(place.geocentric)))
}

/// Airless elevation of the Sun \[rad\].
pub fn sun_elevation(observer: &Observer, t: &Instant) -> f64 {
    Horizontal::of(observer.airless(bodies::sun_from(t, observer.gcrs).normalize())).elevation
}

/// Angle by which the whole of the Sun's disc stands clear of the Earth's limb \[rad\].
fn sunlight_margin(observer: &Observer, place: &Place) -> f64 {
    let Some(state) = place.state else { return PI };
    Occultation::of(state.position, place.sun(observer), observer.pole).map_or(-1.0, |o| o.margin - o.sun_radius)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::planner::Planner;
    use crate::scene::{Options, load};

    const ISS: &str = "[\"1 25544U 98067A   18020.89808844  .00002078  00000-0  38550-4 0  9992\", \
                       \"2 25544  51.6424  32.9776 0003646  28.7227  39.5332 15.54190080 95614\"]";

    fn scene(sets: &[(&str, &str)]) -> Scene {
        let sets = sets.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect::<Vec<_>>();
        load("pogs-geo", &Options { sets: &sets, seed: None }).expect("a good scene")
    }

    fn windows(scene: &Scene) -> (Vec<Window>, Interval) {
        let planner = Planner::new(scene).expect("a planner");
        let night = planner.night().expect("a night");
        let windows = night.windows(planner.motion(0).expect("a target"), None).expect("windows");
        (windows, night.span)
    }

    /// Windows cover the span without gap or overlap, and at every minute they agree with the constraints as the plan has
    /// them for exposures.
    #[test]
    fn windows_agree_with_the_plan_minute_by_minute() {
        for sets in [
            vec![
                ("exposures.cadence_s", "60"),
                ("exposures.count", "1440"),
                ("exposures.start", "2018-01-20T19:00:00Z"),
            ],
            vec![
                ("exposures.cadence_s", "60"),
                ("exposures.count", "1440"),
                ("exposures.start", "2018-01-20T19:00:00Z"),
                ("target.0.orbit.tle", ISS),
                ("plan.sunlit", "false"),
                ("station.horizon_deg", "[[0, 2], [90, 14], [180, 3], [270, 12]]"),
            ],
        ] {
            let mut sets = sets.clone();
            sets.push(("exposures.duration_s", "0"));
            let scene = scene(&sets);
            let planner = Planner::new(&scene).expect("a planner");
            let (windows, span) = windows(&scene);
            assert_eq!(
                (windows[0].interval.start, windows[windows.len() - 1].interval.end),
                (span.start, span.end)
            );
            assert!(
                windows
                    .windows(2)
                    .all(|w| w[0].interval.end == w[1].interval.start && w[0].observable != w[1].observable)
            );
            let mut seen = 0;
            for frame in 0..1440 {
                let view = planner.view(frame).expect("a view");
                let window = windows.iter().find(|w| w.interval.start <= view.mid && view.mid <= w.interval.end);
                let window = window.expect("inside the span");
                let edge =
                    window.interval.start.since(&view.mid).abs().min(window.interval.end.since(&view.mid).abs());
                assert!(
                    window.observable == view.observability.observable || edge < 0.01,
                    "{} {window:?} {:?}",
                    view.mid.iso_utc(),
                    view.observability
                );
                seen += usize::from(view.observability.observable);
            }
            assert!(seen > 3, "{seen}");
        }
    }

    #[test]
    fn edges_and_reasons_are_told() {
        let (windows, _) = windows(&scene(&[]));
        let open = windows.iter().find(|w| w.observable).expect("a window");
        assert_eq!(open.limits, Limits::Edges { opens: Some(Reason::Sun), closes: Some(Reason::Sun) });
        // GOES 14 stands at 51.8 deg all night
        assert!((open.highest.1.to_degrees() - 51.8).abs() < 0.2);
        let Limits::Broken(reasons) = &windows[0].limits else { panic!("closed by day") };
        assert_eq!((reasons[0].0, reasons.len()), (Reason::Sun, 1));
        assert!((reasons[0].1 - 1.0).abs() < 1e-9);
        assert_eq!(Reason::Sun.words(&scene(&[]).plan), "Sun above -12 deg");
    }

    /// A condition handed in, here a place on the clock, cuts as any other.
    #[test]
    fn a_callers_condition_limits_too() {
        let scene = scene(&[]);
        let planner = Planner::new(&scene).expect("a planner");
        let night = planner.night().expect("a night");
        let middle = Instant::from_utc("2018-01-20T06:00:00").expect("a date");
        let condition = move |t: &Instant, _: &Observer, _: &Place| {
            let value = middle.since(t);
            Margin { value, safe_s: value.abs() }
        };
        let windows = night.windows(planner.motion(0).expect("a target"), Some(&condition)).expect("windows");
        let open = windows.iter().find(|w| w.observable).expect("a window");
        assert!(open.interval.end.since(&middle).abs() < 2e-3);
        assert_eq!(open.limits, Limits::Edges { opens: Some(Reason::Sun), closes: Some(Reason::Limit) });
    }

    #[test]
    fn nights_go_from_noon_to_noon() {
        let t = |text: &str| Instant::from_utc(text).expect("a date");
        let night = nights(&t("2018-01-20T03:00:00"), &t("2018-01-20T11:15:05"), (-105.53f64).to_radians());
        // mean solar noon at 105.53 deg west is 19:02 UTC
        assert_eq!(&night.start.iso_utc()[..16], "2018-01-19T19:02");
        assert_eq!(night.seconds(), 86_400.0);
        let two = nights(&t("2018-01-20T03:00:00"), &t("2018-01-21T03:00:00"), 0.0);
        assert_eq!((&two.start.iso_utc()[..13], two.seconds()), ("2018-01-19T12", 2.0 * 86_400.0));
    }
}
