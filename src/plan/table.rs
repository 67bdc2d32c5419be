//! The plan as a table: one row an exposure.

use super::view::View;
use crate::astro::{angles, separation};
use crate::base::table::{Table, Values};
use crate::base::units::ARCSEC_PER_RAD;

/// The plan's table; columns, units and meaning are those of `plan.ecsv`. Without a target the place is the frame's
/// centre and what only a target has is NaN.
pub fn table(views: &[View]) -> Table {
    let mut table = Table::default();
    let astrometric = |v: &View| angles(v.targets.first().map_or(v.wcs.mid.centre, |t| t.place.astrometric));
    let geocentric = |v: &View| v.targets.first().map_or((f64::NAN, f64::NAN), |t| angles(t.place.geocentric));
    let apparent = |v: &View| v.targets.first().map_or(v.centre, |t| t.apparent);
    let of_target = |v: &View, f: fn(&super::view::TargetView) -> f64| v.targets.first().map_or(f64::NAN, f);
    table.ints("frame", views.iter().map(|v| v.frame as i64));
    table.texts("time_utc", views.iter().map(|v| v.mid.iso_utc()));
    table.floats("mjd_utc", "d", views.iter().map(|v| v.mid.mjd_utc()));
    table.floats("ra_deg", "deg", views.iter().map(|v| astrometric(v).0.to_degrees()));
    table.floats("dec_deg", "deg", views.iter().map(|v| astrometric(v).1.to_degrees()));
    table.floats("ra_gcrs_deg", "deg", views.iter().map(|v| geocentric(v).0.to_degrees()));
    table.floats("dec_gcrs_deg", "deg", views.iter().map(|v| geocentric(v).1.to_degrees()));
    table.floats("az_deg", "deg", views.iter().map(|v| apparent(v).azimuth.to_degrees()));
    table.floats("el_deg", "deg", views.iter().map(|v| apparent(v).elevation.to_degrees()));
    table.floats("range_km", "km", views.iter().map(|v| of_target(v, |t| t.place.range_m / 1e3)));
    table.floats(
        "ra_rate_arcsec_s",
        "arcsec / s",
        views.iter().map(|v| of_target(v, |t| t.rate.x * ARCSEC_PER_RAD)),
    );
    table.floats(
        "dec_rate_arcsec_s",
        "arcsec / s",
        views.iter().map(|v| of_target(v, |t| t.rate.y * ARCSEC_PER_RAD)),
    );
    table.floats("phase_deg", "deg", views.iter().map(|v| of_target(v, |t| t.light.phase.to_degrees())));
    table.floats("airmass", "", views.iter().map(|v| v.targets.first().map_or(v.airmass, |t| t.airmass)));
    table.floats("sun_el_deg", "deg", views.iter().map(|v| v.sun.horizontal.elevation.to_degrees()));
    table.floats("moon_el_deg", "deg", views.iter().map(|v| v.moon.body.horizontal.elevation.to_degrees()));
    let moon_sep = |v: &View| {
        v.targets
            .first()
            .map_or_else(|| separation(v.wcs.mid.centre, v.moon.body.direction), |t| t.moon_separation)
    };
    table.floats("moon_sep_deg", "deg", views.iter().map(|v| moon_sep(v).to_degrees()));
    table.floats("moon_phase_deg", "deg", views.iter().map(|v| v.moon.phase.to_degrees()));
    table.floats("sunlit", "", views.iter().map(|v| of_target(v, |t| t.light.sunlit)));
    table.column("observable", "", Values::Bool(views.iter().map(|v| v.observability.observable).collect()));
    table.texts("why", views.iter().map(|v| v.observability.why.clone()));
    table
}
