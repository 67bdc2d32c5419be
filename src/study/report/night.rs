//! The night of a plan, computed from the scene: altitudes of targets, Sun and Moon, and windows.

use crate::astro::bodies::moon_from;
use crate::astro::time::Instant;
use crate::plan::PlanError;
use crate::plan::planner::Planner;
use crate::plan::table::why;
use crate::plan::view::Horizontal;
use crate::plan::windows::{Window, sun_elevation};
use crate::scene::{Brightness, Scene};
use crate::study::night_chart;
use serde_json::{Value as Json, json};

/// Longest time that is looked at \[s\].
const LONGEST_S: f64 = 3.0 * 86_400.0;
/// Steps of a curve, of a window or the exposures in it, and how far a straight piece of it may be off \[deg\].
const STEPS: usize = 480;
const CLOSE_STEPS: usize = 40;
const STRAIGHT_DEG: f64 = 0.05;
/// Most targets with a curve.
const MOST_TARGETS: usize = 8;

/// Curves and windows for the page's program, and the chart of the night as SVG.
///
/// # Errors
/// Why there are none.
pub(super) fn night(scene: &Scene) -> Result<(Json, String), String> {
    let planner = Planner::new(scene).map_err(|e| e.to_string())?;
    let span = planner.night().map_err(|e| e.to_string())?.span;
    if span.seconds() > LONGEST_S {
        return Err(format!("the exposures last longer than {:.0} days", LONGEST_S / 86_400.0));
    }
    let targets = scene.target.iter().take(MOST_TARGETS);
    // how bright a shape is all night long takes longer than a report may
    if scene.plan.limit_mag_v.is_some() && targets.clone().any(|t| matches!(t.brightness, Brightness::Shape(_))) {
        return Err("plan.limit_mag_v of a shape; `nightglass plan --windows` finds its windows".into());
    }
    if scene.plan.min_snr.is_some() {
        return Err("plan.min_snr; `nightglass plan --windows` finds its windows".into());
    }
    computed(scene, &planner, targets.len()).map_err(|e| e.to_string())
}

fn computed(scene: &Scene, planner: &Planner, count: usize) -> Result<(Json, String), PlanError> {
    let night = planner.night()?;
    let windows = (0..count).map(|i| planner.windows(i, &night, None)).collect::<Result<Vec<_>, _>>()?;
    let span = night.span;
    let mut times =
        (0..=STEPS).map(|k| span.start.plus(span.seconds() * k as f64 / STEPS as f64)).collect::<Vec<_>>();
    // a low satellite moves far in a step: windows, their highest places and the exposures are looked at closely
    let observable = windows.iter().flatten().filter(|w| w.observable);
    times.extend(observable.clone().map(|w| w.highest.0));
    for close in observable.map(|w| w.interval).chain([planner.exposed()]) {
        let part = close.seconds() / CLOSE_STEPS as f64;
        times.extend((0..=CLOSE_STEPS).map(|k| close.start.plus(part * k as f64)));
    }
    times.retain(|t| (span.start..=span.end).contains(t));
    times.sort();
    let mut curves = vec![Vec::with_capacity(times.len()); count + 2];
    for t in &times {
        let observer = planner.observer(t)?;
        let elevation = |enu| Horizontal::of(enu).elevation.to_degrees();
        let mut put = |k: usize, value: f64| curves[k].push([t.mjd_utc(), value]);
        put(0, sun_elevation(&observer, t).to_degrees());
        put(1, elevation(observer.airless_geocentric(moon_from(t, observer.gcrs))));
        for target in 0..count {
            let place = planner.motion(target).and_then(|m| m.place_from(&observer, t).ok());
            let up = |p: crate::plan::place::Place| {
                elevation(observer.refracted(observer.airless_geocentric(p.geocentric)))
            };
            put(target + 2, place.map_or(f64::NAN, up));
        }
    }
    let curves = curves.iter().map(|c| straightened(c)).collect::<Vec<_>>();
    let mut targets = Vec::new();
    for (number, own) in windows.iter().enumerate() {
        let name = scene.target.get(number).map_or("", |t| t.name.as_str());
        targets.push(json!({
            "name": name, "curve": curves.get(number + 2),
            "windows": own.iter().map(|w| told(w, scene)).collect::<Vec<_>>(),
        }));
    }
    let p = &scene.plan;
    let told = json!({
        "start": span.start.mjd_utc(), "end": span.end.mjd_utc(), "sun": curves.first(), "moon": curves.get(1), "targets": targets,
        "min_el_deg": p.min_el_deg, "max_sun_el_deg": p.max_sun_el_deg, "duration_s": scene.exposures.duration_s,
    });
    Ok((told, night_chart::svg(scene, planner, span, &windows)?))
}

fn told(window: &Window, scene: &Scene) -> Json {
    let day = |t: &Instant| t.mjd_utc();
    json!({
        "from": day(&window.interval.start), "to": day(&window.interval.end), "start_utc": window.interval.start.iso_utc(),
        "end_utc": window.interval.end.iso_utc(), "observable": window.observable, "why": why(window, &scene.plan),
        "max_el_deg": window.highest.1.to_degrees(),
    })
}

/// A curve without the points that lie on straight lines between others (Ramer 1972, Douglas & Peucker 1973); no number ends a
/// line.
fn straightened(curve: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut keep = vec![false; curve.len()];
    let mut start = 0;
    while start < curve.len() {
        let end = (start..curve.len()).find(|k| curve[*k][1].is_nan()).unwrap_or(curve.len());
        if end > start {
            simplify(curve, start, end - 1, &mut keep);
        }
        if let Some(gap) = keep.get_mut(end) {
            *gap = end > start;
        }
        start = end + 1;
    }
    let round = |[t, v]: [f64; 2]| [(t * 1e6).round() / 1e6, (v * 1e3).round() / 1e3];
    curve.iter().zip(keep).filter(|(_, keep)| *keep).map(|(p, _)| round(*p)).collect()
}

fn simplify(curve: &[[f64; 2]], first: usize, last: usize, keep: &mut [bool]) {
    let mut open = vec![(first, last)];
    while let Some((a, b)) = open.pop() {
        (keep[a], keep[b]) = (true, true);
        let slope = if b > a { (curve[b][1] - curve[a][1]) / (curve[b][0] - curve[a][0]).max(1e-12) } else { 0.0 };
        let off = |k: usize| (curve[k][1] - curve[a][1] - slope * (curve[k][0] - curve[a][0])).abs();
        let worst = (a + 1..b).max_by(|i, k| off(*i).total_cmp(&off(*k)));
        if let Some(k) = worst.filter(|k| off(*k) > STRAIGHT_DEG) {
            open.extend([(a, k), (k, b)]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn straight_pieces_need_their_ends_alone_and_curves_stay_where_they_are() {
        let line = (0..100).map(|k| [f64::from(k), 0.3 * f64::from(k)]).collect::<Vec<_>>();
        assert_eq!(straightened(&line), [[0.0, 0.0], [99.0, 29.7]]);
        let wave = (0..500).map(|k| [0.01 * f64::from(k), 50.0 * (0.01 * f64::from(k)).sin()]).collect::<Vec<_>>();
        let kept = straightened(&wave);
        assert!(kept.len() < 120, "{}", kept.len());
        for [t, v] in &wave {
            let after = kept.iter().position(|p| p[0] >= *t - 1e-9).expect("within");
            let (a, b) = (kept[after.saturating_sub(1)], kept[after]);
            let share = if b[0] > a[0] { (t - a[0]) / (b[0] - a[0]) } else { 1.0 };
            assert!((a[1] + share * (b[1] - a[1]) - v).abs() < 1.5 * STRAIGHT_DEG, "{t}");
        }
    }

    #[test]
    fn gaps_end_a_line() {
        let nan = f64::NAN;
        let curve = [[0.0, nan], [1.0, 5.0], [2.0, 5.0], [3.0, nan], [4.0, nan], [5.0, 9.0]];
        let kept = straightened(&curve);
        let shown = kept.iter().map(|p| p[0]).collect::<Vec<_>>();
        assert_eq!(shown, [1.0, 2.0, 3.0, 5.0]);
        assert!(straightened(&[]).is_empty());
    }
}
