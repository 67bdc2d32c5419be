//! Error against run time of what the geometry rests on: nutation, the Earth, the Sun and the Moon by interpolation.
//!
//! * `astro.nutation`: GCRS to ITRF with the pole from IAU 2006/2000A in full, from IAU 2000B, and interpolated, against
//!   the full one.
//! * `astro.earth`, `astro.moon`: barycentric Earth and geocentric Moon interpolated, against the series themselves.
//! * `astro.direction`: a whole topocentric place of the first target, its time only.

use super::errors::{Errors, row};
use crate::astro::Error;
use crate::astro::bodies::{EarthState, moon_gcrs, moon_reference};
use crate::astro::daily::{NODES, Series, number};
use crate::astro::earth::{Nutation, Orientation, pole};
use crate::astro::time::Instant;
use crate::base::accuracy::AccuracyRow;
use crate::base::units::ARCSEC;
use crate::plan::planner::Planner;
use glam::{DMat3, DVec3};
use std::hint::black_box;

/// Instants at which errors are taken, over the day of the first exposure.
const SAMPLES: usize = 200;

/// Rows about the day of an instant.
pub(super) fn rows(
    planner: &Planner,
    t: &Instant,
    clock: &(dyn Fn() -> f64 + Sync),
) -> Result<Vec<AccuracyRow>, Error> {
    let times = (0..SAMPLES).map(|k| t.plus((k as f64 - 0.5 * SAMPLES as f64) * 431.7)).collect::<Vec<_>>();
    let mut rows = Vec::new();
    let exact = times.iter().map(Orientation::reference).collect::<Result<Vec<_>, _>>()?;
    let mut nutation = |setting: String,
                        nodes: Option<usize>,
                        default: bool,
                        at: &dyn Fn(&Instant) -> Result<Orientation, Error>| {
        // the first call makes what is kept
        for t in &times {
            at(t)?;
        }
        let began = clock();
        let found = times.iter().map(at).collect::<Result<Vec<_>, _>>()?;
        let took = (clock() - began) / SAMPLES as f64;
        let errors = found.iter().zip(&exact).map(|(f, e)| angle_mas(f, e)).collect::<Vec<_>>();
        let bytes = nodes.map_or(0, |n| n * size_of::<DVec3>());
        let mut row = row("astro.nutation", setting, &Errors::of(&errors), "mas", took, bytes);
        row.default = default;
        rows.push(row);
        Ok::<_, Error>(())
    };
    nutation("IAU 2006/2000A".into(), None, false, &Orientation::reference)?;
    nutation("IAU 2000B".into(), None, false, &|t| {
        Ok(Orientation::with(t, &Orientation::at(t)?.eop, pole(t, Nutation::Iau2000B)))
    })?;
    for nodes in [3, 4, 6, NODES] {
        let days = (0..4).map(|d| number(t) + d - 2);
        let series = days.map(|d| Series::fit(d, nodes, |t| pole(t, Nutation::Iau2006A))).collect::<Vec<_>>();
        let first = number(t) - 2;
        let of = |t: &Instant| &series[(number(t) - first).clamp(0, 3) as usize];
        let setting = format!("2006/2000A, {nodes} nodes a day");
        if nodes == NODES {
            nutation(setting, Some(nodes), true, &Orientation::at)?;
        } else {
            nutation(setting, Some(nodes), false, &|t| {
                Ok(Orientation::with(t, &Orientation::at(t)?.eop, of(t).at(t)))
            })?;
        }
    }
    let bytes = NODES * size_of::<DVec3>();
    let kept = format!("{NODES} nodes a day");
    rows.extend(vectors("astro.earth", &kept, 4 * bytes, &times, clock, &|t| EarthState::at(t).position, &|t| {
        EarthState::reference(t).position
    }));
    rows.extend(vectors("astro.moon", &kept, bytes, &times, clock, &moon_gcrs, &moon_reference));
    if let Some(motion) = planner.motion(0) {
        let began = clock();
        let mut known = 0usize;
        for _ in 0..20 {
            for t in &times {
                known += usize::from(black_box(motion.place(&planner.site, t)).is_ok());
            }
        }
        let took = (clock() - began) / known.max(1) as f64;
        let mut place = row("astro.direction", "default".into(), &Errors::of(&[]), "mas", took, 0);
        (place.max_err, place.rms_err, place.default) = (f64::NAN, f64::NAN, true);
        rows.push(place);
    }
    Ok(rows)
}

/// Largest angle between two orientations \[mas\].
fn angle_mas(a: &Orientation, b: &Orientation) -> f64 {
    let off: DMat3 = a.gcrs_to_itrf * b.gcrs_to_itrf.transpose();
    let turn =
        DVec3::new(off.y_axis.z - off.z_axis.y, off.z_axis.x - off.x_axis.z, off.x_axis.y - off.y_axis.x) * 0.5;
    turn.length() / ARCSEC * 1e3
}

fn vectors(
    name: &str,
    setting: &str,
    bytes: usize,
    times: &[Instant],
    clock: &(dyn Fn() -> f64 + Sync),
    fast: &dyn Fn(&Instant) -> DVec3,
    slow: &dyn Fn(&Instant) -> DVec3,
) -> [AccuracyRow; 2] {
    let timed = |f: &dyn Fn(&Instant) -> DVec3| {
        times.iter().for_each(|t| _ = black_box(f(t)));
        let began = clock();
        let values = times.iter().map(f).collect::<Vec<_>>();
        (values, (clock() - began) / times.len() as f64)
    };
    let ((found, took), (exact, slow_took)) = (timed(fast), timed(slow));
    let errors = found.iter().zip(&exact).map(|(f, e)| (*f - *e).length()).collect::<Vec<_>>();
    let mut own = row(name, setting.into(), &Errors::of(&errors), "m", took, bytes);
    own.default = true;
    [row(name, "the series itself".into(), &Errors::of(&[0.0]), "m", slow_took, 0), own]
}
