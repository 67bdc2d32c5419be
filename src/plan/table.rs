//! The plan as tables: one row an exposure, a window, an attitude.

use super::PlanError;
use super::planner::Planner;
use super::view::{Planned, TargetView, View};
use super::windows::{Limits, Window};
use crate::astro::{angles, separation};
use crate::base::table::{Table, Values};
use crate::base::units::ARCSEC_PER_RAD;
use crate::scene::{Exposures, PlanLimits, Scene};
use glam::DVec3;

/// The plan's table with what is known of the targets' orbits in its metadata: ages of elements, methods, warnings.
pub fn table_of(planned: &[Planned], planner: &Planner) -> Table {
    let mut table = table(planned);
    for (name, age, method) in planner.orbits() {
        let age = match age {
            age if age.is_nan() => String::new(),
            age if age < 0.0 => format!("elements of {:.3} d after the first exposure, ", -age),
            age => format!("elements {age:.3} d old at the first exposure, "),
        };
        table.note(&format!("orbit of {name}"), format!("{age}{method}"));
    }
    for warning in planner.warnings() {
        table.note("warning", warning);
    }
    table
}

/// The plan's table; columns, units and meaning are those of `plan.ecsv`. Without a target the place is the frame's
/// centre and what only a target has is NaN; NaN too is all geometry of an exposure whose target's orbit is not known.
pub fn table(planned: &[Planned]) -> Table {
    let mut table = Table::default();
    let of = |f: fn(&View) -> f64| planned.iter().map(move |p| p.view().map_or(f64::NAN, f));
    let of_target = |f: fn(&TargetView) -> f64| {
        planned.iter().map(move |p| p.view().and_then(|v| v.targets.first()).map_or(f64::NAN, f))
    };
    let astrometric = |v: &View| v.targets.first().map_or(v.wcs.mid.centre, |t| t.place.astrometric);
    let apparent = |v: &View| v.targets.first().map_or(v.centre, |t| t.apparent);
    table.ints("frame", planned.iter().map(|p| p.frame() as i64));
    table.texts("time_utc", planned.iter().map(|p| p.mid().iso_utc()));
    table.floats("mjd_utc", "d", planned.iter().map(|p| p.mid().mjd_utc()));
    let view = |f: &dyn Fn(&View) -> f64| planned.iter().map(|p| p.view().map_or(f64::NAN, f)).collect::<Vec<_>>();
    table.floats("ra_deg", "deg", view(&|v| angles(astrometric(v)).0.to_degrees()).into_iter());
    table.floats("dec_deg", "deg", view(&|v| angles(astrometric(v)).1.to_degrees()).into_iter());
    table.floats("ra_gcrs_deg", "deg", of_target(|t| angles(t.place.geocentric).0.to_degrees()));
    table.floats("dec_gcrs_deg", "deg", of_target(|t| angles(t.place.geocentric).1.to_degrees()));
    table.floats("az_deg", "deg", view(&|v| apparent(v).azimuth.to_degrees()).into_iter());
    table.floats("el_deg", "deg", view(&|v| apparent(v).elevation.to_degrees()).into_iter());
    table.floats("range_km", "km", of_target(|t| t.place.range_m / 1e3));
    table.floats("ra_rate_arcsec_s", "arcsec / s", of_target(|t| t.rate.x * ARCSEC_PER_RAD));
    table.floats("dec_rate_arcsec_s", "arcsec / s", of_target(|t| t.rate.y * ARCSEC_PER_RAD));
    table.floats("phase_deg", "deg", of_target(|t| t.light.phase.to_degrees()));
    table.floats("airmass", "", of(|v| v.targets.first().map_or(v.airmass, |t| t.airmass)));
    table.floats("sun_el_deg", "deg", of(|v| v.sun.horizontal.elevation.to_degrees()));
    table.floats("moon_el_deg", "deg", of(|v| v.moon.body.horizontal.elevation.to_degrees()));
    let moon_sep = |v: &View| {
        let centre = || separation(v.wcs.mid.centre, v.moon.body.direction);
        v.targets.first().map_or_else(centre, |t| t.moon_separation).to_degrees()
    };
    table.floats("moon_sep_deg", "deg", view(&moon_sep).into_iter());
    table.floats("moon_phase_deg", "deg", of(|v| v.moon.phase.to_degrees()));
    table.floats("sunlit", "", of_target(|t| t.light.sunlit));
    table.column("observable", "", Values::Bool(planned.iter().map(Planned::observable).collect()));
    table.texts("why", planned.iter().map(|p| p.why().to_owned()));
    table
}

/// A named object's windows.
pub type Named<'w> = (&'w str, &'w [Window]);

/// The windows' table; every instant of the night is in one row of each object.
///
/// `why` tells of an observable window what opens and closes it, else the reasons and the share of its time for which each
/// comes first. `first_frame` and `last_frame` are the exposures that lie wholly inside, -1 for none; `cut_frames` those
/// that lie across an edge.
pub fn windows(objects: &[Named], scene: &Scene) -> Table {
    let rows =
        objects.iter().flat_map(|(name, windows)| windows.iter().map(move |w| (*name, w))).collect::<Vec<_>>();
    let frames = rows.iter().map(|(_, w)| Frames::of(w, &scene.exposures)).collect::<Vec<_>>();
    let mut table = Table::default();
    table.texts("target", rows.iter().map(|(name, _)| (*name).to_owned()));
    table.texts("start_utc", rows.iter().map(|(_, w)| w.interval.start.iso_utc()));
    table.texts("end_utc", rows.iter().map(|(_, w)| w.interval.end.iso_utc()));
    table.floats("duration_s", "s", rows.iter().map(|(_, w)| w.interval.seconds()));
    table.column("observable", "", Values::Bool(rows.iter().map(|(_, w)| w.observable).collect()));
    table.texts("why", rows.iter().map(|(_, w)| why(w, &scene.plan)));
    table.floats("max_el_deg", "deg", rows.iter().map(|(_, w)| w.highest.1.to_degrees()));
    let highest = |w: &Window| if w.highest.1.is_nan() { String::new() } else { w.highest.0.iso_utc() };
    table.texts("max_el_utc", rows.iter().map(|(_, w)| highest(w)));
    table.ints("first_frame", frames.iter().map(|f| f.inside.map_or(-1, |(first, _)| first)));
    table.ints("last_frame", frames.iter().map(|f| f.inside.map_or(-1, |(_, last)| last)));
    table.ints("cut_frames", frames.iter().map(|f| f.cut));
    table
}

/// What limits a window, in words: the conditions before and after it, or those broken in it with their shares of its time.
pub fn why(window: &Window, limits: &PlanLimits) -> String {
    match &window.limits {
        Limits::Edges { opens, closes } => {
            let edge = |word: &str, reason: &Option<super::windows::Reason>| {
                reason.map(|r| format!("{word}: {}", r.words(limits)))
            };
            [edge("before", opens), edge("after", closes)].into_iter().flatten().collect::<Vec<_>>().join("; ")
        }
        Limits::Broken(reasons) => {
            let share =
                |share: f64| if share > 0.999 { String::new() } else { format!(" ({:.1} %)", share * 100.0) };
            let words = reasons.iter().map(|(r, s)| format!("{}{}", r.words(limits), share(*s)));
            words.collect::<Vec<_>>().join("; ")
        }
    }
}

/// Exposures of a scene and a window.
struct Frames {
    inside: Option<(i64, i64)>,
    cut: i64,
}

impl Frames {
    fn of(window: &Window, exposures: &Exposures) -> Self {
        let start = exposures.start;
        let (opens, closes) = (window.interval.start.since(&start), window.interval.end.since(&start));
        let count = exposures.count as i64;
        // a single exposure may have no cadence
        let cadence = exposures.cadence_s.max(exposures.duration_s).max(1e-6);
        let number =
            |seconds: f64, round: fn(f64) -> f64| round(seconds / cadence).clamp(-1.0, count as f64) as i64;
        let first = number(opens, f64::ceil).max(0);
        let last = number(closes - exposures.duration_s, f64::floor).min(count - 1);
        // those that are open for some of the window
        let touched_first = number(opens - exposures.duration_s, |x| x.floor() + 1.0).max(0);
        let touched_last = number(closes, |x| x.ceil() - 1.0).min(count - 1);
        let inside = (last - first + 1).max(0);
        Self {
            inside: (inside > 0).then_some((first, last)),
            // an instantaneous exposure at an edge is inside and touches nothing
            cut: ((touched_last - touched_first + 1).max(0) - inside).max(0),
        }
    }
}

/// Attitudes of the targets that have one, at every mid-exposure: the quaternion (scalar first, body to ICRS components)
/// and the directions to Sun and observer in body axes; NaN where an attitude is not known. None if no target has one.
///
/// # Errors
/// [`PlanError`] where the sky cannot be computed.
pub fn attitudes(planner: &Planner, planned: &[Planned], scene: &Scene) -> Result<Option<Table>, PlanError> {
    let mut rows = Vec::new();
    for exposure in planned {
        for (i, target) in scene.target.iter().enumerate().filter(|(_, t)| t.attitude.is_some()) {
            let (mut q, mut to_sun, mut to_observer) = ([f64::NAN; 4], DVec3::NAN, DVec3::NAN);
            if let Some(view) = exposure.view() {
                match planner.attitude(i, view) {
                    Ok(Some(attitude)) => {
                        let light = &view.targets[i].light;
                        q = attitude.components();
                        (to_sun, to_observer) =
                            (attitude.to_body(light.to_sun), attitude.to_body(light.to_observer));
                    }
                    Ok(None) | Err(PlanError::Astro(crate::astro::Error::Attitude { .. })) => {}
                    Err(other) => return Err(other),
                }
            }
            rows.push((exposure, &target.name, q, to_sun, to_observer));
        }
    }
    if rows.is_empty() {
        return Ok(None);
    }
    let mut table = Table::default();
    table.ints("frame", rows.iter().map(|r| r.0.frame() as i64));
    table.texts("time_utc", rows.iter().map(|r| r.0.mid().iso_utc()));
    table.texts("target", rows.iter().map(|r| r.1.clone()));
    for (k, name) in ["q0", "q1", "q2", "q3"].into_iter().enumerate() {
        table.floats(name, "", rows.iter().map(move |r| r.2[k]));
    }
    for (k, name) in ["sun_body_x", "sun_body_y", "sun_body_z"].into_iter().enumerate() {
        table.floats(name, "", rows.iter().map(move |r| r.3[k]));
    }
    for (k, name) in ["obs_body_x", "obs_body_y", "obs_body_z"].into_iter().enumerate() {
        table.floats(name, "", rows.iter().map(move |r| r.4[k]));
    }
    Ok(Some(table))
}
