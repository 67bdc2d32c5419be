//! `nightglass time`.

use super::args::{Global, TimeArgs};
use super::talk::{Failure, now_utc, print, print_json};
use crate::astro::earth::gmst;
use crate::astro::eop;
use crate::astro::scales::Scale;
use crate::astro::time::Instant;
use crate::base::units::ARCSEC;
use serde_json::json;
use std::fmt::Write;

pub(super) fn time(args: &TimeArgs, global: &Global) -> Result<(), Failure> {
    let text = args.epoch.join(" ");
    let text = if text.trim().eq_ignore_ascii_case("now") { now_utc() } else { text };
    let t = Instant::parse(&text).map_err(|e| Failure::Input(e.to_string()))?;
    let eop = eop::at(&t);
    let mut rows = Vec::new();
    for scale in Scale::ALL {
        // UT1 may not be known; the others always are
        if let (Ok(reading), Ok(offset)) = (t.reading(scale), t.offset_from_tai(scale)) {
            rows.push((scale, offset, reading));
        }
    }
    if global.json {
        let rows = rows.iter().map(|(scale, offset, reading)| {
            json!({
                "scale": scale.name(), "minus_tai_s": offset, "iso": reading.iso(9),
                "jd": reading.jd_text(), "mjd": reading.mjd_text(),
            })
        });
        let orientation = eop.as_ref().ok().map(|e| {
            json!({
                "ut1_minus_utc_s": e.ut1_minus_tai + t.leap_seconds(), "xp_arcsec": e.xp / ARCSEC, "yp_arcsec": e.yp / ARCSEC,
                "dx_mas": e.dx / ARCSEC * 1e3, "dy_mas": e.dy / ARCSEC * 1e3, "days_beyond_table": e.beyond_days,
                "ut1_bound_s": e.ut1_bound_s(), "pole_bound_arcsec": e.pole_bound() / ARCSEC, "gmst_deg": gmst(&t).map_or(f64::NAN, f64::to_degrees),
            })
        });
        return print_json(&json!({
            "command": "time", "rows": rows.collect::<Vec<_>>(), "earth_orientation": orientation,
        }));
    }
    let mut out = format!("{:5} {:>18}  {:30} {:>23} {:>21}\n", "scale", "minus TAI, s", "ISO 8601", "JD", "MJD");
    for (scale, offset, reading) in rows {
        let line = (scale.name(), offset, reading.iso(9), reading.jd_text(), reading.mjd_text());
        let _ = writeln!(out, "{:5} {:>18.9}  {:30} {:>23} {:>21}", line.0, line.1, line.2, line.3, line.4);
    }
    match eop {
        Ok(eop) => {
            let ut1_minus_utc = eop.ut1_minus_tai + t.leap_seconds();
            let _ = writeln!(
                out,
                "\nUT1 - UTC {ut1_minus_utc:+.7} s, pole x {:.6} y {:.6} arcsec",
                eop.xp / ARCSEC,
                eop.yp / ARCSEC
            );
            if eop.beyond_days > 0.0 {
                let _ = writeln!(
                    out,
                    "extrapolated {:.0} days beyond the Earth orientation table: UT1 within {:.2} s, pole within {:.2} arcsec",
                    eop.beyond_days,
                    eop.ut1_bound_s(),
                    eop.pole_bound() / ARCSEC
                );
            }
        }
        Err(why) => {
            let _ = writeln!(out, "\nUT1 unknown: {why}");
        }
    }
    print(&out)
}
