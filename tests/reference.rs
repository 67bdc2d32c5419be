//! Time, Earth, stars, orbits, shadow, Sun, Moon and rotation against numbers that somebody else computed: the tables of
//! `tests/reference`, made by `tests/python/reference_tables.py` with pyerfa, python-sgp4, JPL ephemerides and mpmath.
//!
//! Each test prints what it reached (`cargo nextest run --no-capture`).

use glam::{DMat3, DVec3};
use nightglass::astro::bodies::{EarthState, moon_gcrs};
use nightglass::astro::earth::{Nutation, Orientation, gmst, pole};
use nightglass::astro::eop::{self, Eop};
use nightglass::astro::geodetic::Geodetic;
use nightglass::astro::observer::{Air, Observer, Site};
use nightglass::astro::orbit::Orbit;
use nightglass::astro::orbit::sgp4::{Mode, Sgp4};
use nightglass::astro::orbit::tle::{Tle, checksum};
use nightglass::astro::rotation::Quaternion;
use nightglass::astro::scales::Scale;
use nightglass::astro::shadow::Occultation;
use nightglass::astro::star::Star;
use nightglass::astro::time::Instant;
use nightglass::astro::tumble::Tumble;
use nightglass::astro::{direction, moon, separation};
use nightglass::base::units::ARCSEC;
use nightglass::plan::place::Motion;
use std::collections::HashMap;

/// A table of `tests/reference`: rows of cells by column.
struct Reference(Vec<HashMap<String, String>>);

impl Reference {
    fn read(name: &str) -> Self {
        let path = format!("{}/tests/reference/{name}", env!("CARGO_MANIFEST_DIR"));
        let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{path}: {e}"));
        let mut lines = text.lines().filter(|l| !l.starts_with('#'));
        let header = lines.next().expect("a header").split(',').map(str::to_owned).collect::<Vec<_>>();
        let row = |line: &str| header.iter().cloned().zip(line.split(',').map(str::to_owned)).collect();
        Self(lines.map(row).collect())
    }
}

fn number(row: &HashMap<String, String>, key: &str) -> f64 {
    row[key].parse().unwrap_or_else(|_| panic!("{key} = {}", row[key]))
}

fn vector(row: &HashMap<String, String>, keys: [&str; 3]) -> DVec3 {
    DVec3::from_array(keys.map(|k| number(row, k)))
}

fn utc(row: &HashMap<String, String>) -> Instant {
    Instant::from_utc(&row["utc"]).unwrap_or_else(|e| panic!("{e}"))
}

fn site(row: &HashMap<String, String>, air: bool) -> Site {
    let get = |key: &str| number(row, key);
    let air = if air {
        Air { pressure_hpa: get("pressure_hpa"), temperature_c: get("temperature_c"), humidity: get("humidity") }
    } else {
        Air { pressure_hpa: 0.0, temperature_c: 10.0, humidity: 0.5 }
    };
    Site::new(get("longitude_deg").to_radians(), get("latitude_deg").to_radians(), get("height_m"), &air)
}

/// Keeps the largest of errors, and tells it at the end.
struct Worst(&'static str, &'static str, f64);

impl Worst {
    fn new(what: &'static str, unit: &'static str) -> Self {
        Self(what, unit, 0.0)
    }
    fn see(&mut self, error: f64) {
        assert!(!error.is_nan(), "{}: NaN", self.0);
        self.2 = self.2.max(error.abs());
    }
    fn below(&self, allowed: f64) {
        println!("{}: {:.3e} {} (allowed {allowed:e})", self.0, self.2, self.1);
        assert!(self.2 < allowed, "{}: {:e} {}, allowed {allowed:e}", self.0, self.2, self.1);
    }
}

/// Time scales and the Earth's orientation at 21 epochs, days with leap seconds among them: 1 us, 0.01 mas.
#[test]
fn time_and_the_earths_orientation() {
    let mut tt = Worst::new("TT", "s");
    let mut tdb = Worst::new("TDB - TT", "s");
    let mut ut1 = Worst::new("UT1 - TAI", "s");
    let mut sidereal = Worst::new("GMST", "arcsec");
    let mut matrix = Worst::new("GCRS to ITRF", "arcsec");
    for row in &Reference::read("orientation.csv").0 {
        let t = utc(row);
        assert_eq!(t.leap_seconds(), number(row, "tai_minus_utc_s"), "{}", row["utc"]);
        let (day, fraction) = t.tt();
        tt.see(((day - number(row, "tt_jd1")) + (fraction - number(row, "tt_jd2"))) * 86_400.0);
        tdb.see(t.tdb_minus_tt() - number(row, "tdb_minus_tt_s"));
        let given = Eop {
            xp: number(row, "xp_arcsec") * ARCSEC,
            yp: number(row, "yp_arcsec") * ARCSEC,
            ut1_minus_tai: number(row, "ut1_minus_tai_s"),
            dx: number(row, "dx_mas") * 1e-3 * ARCSEC,
            dy: number(row, "dy_mas") * 1e-3 * ARCSEC,
            beyond_days: 0.0,
        };
        let own = eop::at(&t).expect("known");
        let rows = [["m11", "m12", "m13"], ["m21", "m22", "m23"], ["m31", "m32", "m33"]];
        let expected = DMat3::from_cols_array_2d(&rows.map(|r| r.map(|k| number(row, k)))).transpose();
        // beyond the table the parameters are the reference's own
        let orientation = if own.beyond_days > 0.0 || given.dx == 0.0 {
            Orientation::with(&t, &given, pole(&t, Nutation::Iau2006A))
        } else {
            ut1.see(own.ut1_minus_tai - given.ut1_minus_tai);
            sidereal.see((gmst(&t).expect("known") - number(row, "gmst06_rad")) / ARCSEC);
            Orientation::at(&t).expect("known")
        };
        let off = (orientation.gcrs_to_itrf - expected).to_cols_array();
        matrix.see(off.iter().fold(0.0f64, |m, x| m.max(x.abs())) / ARCSEC);
    }
    tt.below(1e-9);
    tdb.below(1e-6);
    ut1.below(1e-6);
    sidereal.below(1.5e-5);
    matrix.below(1e-5);
}

/// Apparent places of 50 stars with proper motion and parallax, the poles among the stations: 1 mas.
#[test]
fn apparent_places_of_stars() {
    let mut airless = Worst::new("airless place of a star", "mas");
    let mut refracted = Worst::new("refracted place of a star", "mas");
    let mut astrometric = Worst::new("astrometric place of a star", "mas");
    let rows = Reference::read("stars.csv").0;
    for row in &rows {
        let get = |key: &str| number(row, key);
        let mas = 1e-3 * ARCSEC;
        let star = Star {
            ra: get("ra_deg").to_radians(),
            dec: get("dec_deg").to_radians(),
            pm_ra_cos_dec: get("pm_ra_cosdec_mas_yr") * mas,
            pm_dec: get("pm_dec_mas_yr") * mas,
            parallax: get("parallax_mas") * mas,
            radial_velocity_km_s: get("rv_km_s"),
        };
        let t = utc(row);
        let observer = Observer::at(&site(row, true), &t).expect("known");
        let up = |az: &str, el: &str| nightglass::astro::observer::enu(get(az).to_radians(), get(el).to_radians());
        airless.see(separation(star.airless(&observer, &t), up("az_airless_deg", "el_airless_deg")) / mas);
        refracted.see(separation(star.apparent(&observer, &t), up("az_refracted_deg", "el_refracted_deg")) / mas);
        let place = direction(get("astrometric_ra_deg").to_radians(), get("astrometric_dec_deg").to_radians());
        astrometric.see(separation(star.astrometric(&observer, &t), place) / mas);
    }
    assert!(rows.len() >= 50);
    airless.below(1.0);
    refracted.below(1.0);
    // the reference's origin is the geocentre: 0.02 mas for the nearest star
    astrometric.below(0.1);
}

/// Vallado's 33 cases, to the digits printed. They were printed by the improved mode; the operational one, which we use,
/// differs from it for three objects, by as much as python-sgp4's two modes do.
#[test]
fn sgp4_against_the_published_vectors() {
    let mut improved = Worst::new("SGP4, improved mode", "m");
    let mut speed = Worst::new("SGP4 velocity, improved mode", "m/s");
    let mut late = Worst::new("SGP4, improved mode, after 3.5 years", "m");
    let mut afspc = Worst::new("SGP4, AFSPC mode, 30 objects", "m");
    let mut apart = HashMap::<u64, f64>::new();
    let objects = vallado();
    let rows = Reference::read("sgp4_vallado.csv").0;
    for row in &rows {
        let catalog = number(row, "catalog_number") as u64;
        let expected = vector(row, ["x_km", "y_km", "z_km"]) * 1e3;
        let minutes = number(row, "minutes");
        let found = objects.iter().filter(|(n, ..)| *n == catalog).map(|(_, improved, afspc)| (improved, afspc));
        // one object is there with two sets: the right one is the nearer
        let error = |sgp4: &Sgp4| sgp4.teme(minutes).map_or(f64::INFINITY, |s| (s.position - expected).length());
        let (own, other) = found.min_by(|a, b| error(a.0).total_cmp(&error(b.0))).expect("a set");
        if catalog == 20_413 && minutes > 1.8e6 {
            late.see(error(own));
        } else {
            improved.see(error(own));
        }
        let velocity = vector(row, ["vx_km_s", "vy_km_s", "vz_km_s"]) * 1e3;
        speed.see((own.teme(minutes).expect("propagates").velocity - velocity).length());
        if [23_599, 23_333, 20_413].contains(&catalog) {
            let off = apart.entry(catalog).or_default();
            *off = off.max(error(other));
        } else {
            afspc.see(error(other));
        }
    }
    assert!(rows.len() > 600 && objects.len() == 33);
    improved.below(1e-5);
    // python-sgp4 itself is 1.2e-4 m from what is printed there
    late.below(3e-4);
    speed.below(1e-6);
    afspc.below(1e-5);
    println!("AFSPC against improved mode, m: {apart:?}");
    assert!(apart[&23_599] < 1e3 && apart[&23_333] < 1e-2 && apart[&20_413] < 1e-3);
}

/// The cases that must fail do, at the minute at which they must.
#[test]
fn sgp4_fails_where_it_must() {
    let objects = vallado();
    let rows = Reference::read("sgp4_vallado_errors.csv").0;
    assert_eq!(rows.len(), 7);
    for row in &rows {
        let (catalog, minutes) = (number(row, "catalog_number") as u64, number(row, "minutes"));
        let fails = objects.iter().any(|(n, _, afspc)| *n == catalog && afspc.teme(minutes).is_err());
        assert!(fails, "{catalog} at {minutes} min");
    }
}

/// Catalogue number, and the object in improved and AFSPC mode; checksums that were published wrong are renewed.
fn vallado() -> Vec<(u64, Sgp4, Sgp4)> {
    let path = format!("{}/tests/reference/sgp4_vallado.tle", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).expect("the sets");
    let renewed = text.lines().filter(|l| l.len() >= 69).map(|l| format!("{}{}\n", &l[..68], checksum(l)));
    let sets = Tle::all(&renewed.collect::<String>());
    let object = |set: &Tle| {
        let elements = set.elements().unwrap_or_else(|e| panic!("{e}"));
        let of = |mode| Sgp4::with_mode(&elements, mode);
        Some((elements.catalog_number, of(Mode::Improved).ok()?, of(Mode::Afspc).ok()?))
    };
    sets.iter().filter_map(object).collect()
}

/// Twenty satellites at ten epochs from stations at the poles, the date line and in between: 10 mas, 1 m, 1e-4.
#[test]
fn topocentric_places_of_satellites() {
    let mut place = Worst::new("RA, Dec", "mas");
    let mut geocentric = Worst::new("RA, Dec in GCRS axes", "mas");
    let mut range = Worst::new("range", "m");
    let mut rate = Worst::new("angular rate", "relative");
    let mut range_rate = Worst::new("range rate", "relative to the speed");
    let rows = Reference::read("satellites.csv").0;
    for row in &rows {
        let get = |key: &str| number(row, key);
        let elements = Tle::new(Some(&row["name"]), &row["line1"], &row["line2"]).elements().expect("elements");
        let motion = Motion::Orbit(Orbit::Mean(Box::new(Sgp4::new(&elements).expect("usable"))));
        let (site, t) = (site(row, false), utc(row));
        let at = |seconds: f64| motion.place(&site, &t.plus(seconds)).expect("a place");
        let own = at(0.0);
        let expected = |ra: &str, dec: &str| direction(get(ra).to_radians(), get(dec).to_radians());
        place.see(separation(own.astrometric, expected("ra_deg", "dec_deg")) / ARCSEC * 1e3);
        geocentric.see(separation(own.geocentric, expected("ra_gcrs_deg", "dec_gcrs_deg")) / ARCSEC * 1e3);
        range.see(own.range_m - get("range_km") * 1e3);
        let (before, after) = (at(-0.5), at(0.5));
        let moved = after.astrometric - before.astrometric;
        let (east, north) = nightglass::plan::wcs::east_north(own.astrometric);
        let speed = get("ra_rate_arcsec_s").hypot(get("dec_rate_arcsec_s"));
        rate.see((moved.dot(east) / ARCSEC - get("ra_rate_arcsec_s")) / speed);
        rate.see((moved.dot(north) / ARCSEC - get("dec_rate_arcsec_s")) / speed);
        let orbital = own.state.expect("a state").velocity.length();
        range_rate.see((after.range_m - before.range_m - get("range_rate_km_s") * 1e3) / orbital);
    }
    assert_eq!(rows.len(), 200);
    place.below(10.0);
    geocentric.below(10.0);
    range.below(1.0);
    rate.below(1e-4);
    range_rate.below(1e-4);
}

/// Contacts of the Sun's disc with the ellipsoid's limb: 0.1 s.
#[test]
fn eclipse_contacts() {
    let mut worst = Worst::new("contact", "s");
    let rows = Reference::read("eclipses.csv").0;
    for row in &rows {
        let elements = Tle::new(Some(&row["name"]), &row["line1"], &row["line2"]).elements().expect("elements");
        let sgp4 = Sgp4::new(&elements).expect("usable");
        let umbra = row["contact"].starts_with("umbra");
        // above 0 in sunlight (penumbra contacts) or in any light (umbra contacts)
        let open = |t: &Instant| {
            let pole = Orientation::at(t).expect("known").gcrs_to_itrf.row(2);
            let satellite = sgp4.gcrs(t).expect("propagates").position;
            let seen = Occultation::of(satellite, EarthState::at(t).to_sun, pole).expect("outside the Earth");
            if umbra { seen.margin + seen.sun_radius } else { seen.margin - seen.sun_radius }
        };
        let t = utc(row);
        let (mut low, mut high) = (-2.0, 2.0);
        let sign = open(&t.plus(low)).signum();
        assert!(
            sign != open(&t.plus(high)).signum(),
            "no {} of {} at {}",
            row["contact"],
            row["name"],
            row["utc"]
        );
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if open(&t.plus(middle)).signum() == sign { low = middle } else { high = middle }
        }
        worst.see(low);
    }
    assert!(rows.len() > 100);
    worst.below(0.1);
}

/// Sun and Moon against JPL's DE421: 0.05 and 0.1 arcsec.
#[test]
fn sun_and_moon() {
    let mut sun = Worst::new("Sun", "arcsec");
    let mut moon = Worst::new("Moon", "arcsec");
    let mut distance = Worst::new("Moon's distance", "km");
    for row in &Reference::read("bodies.csv").0 {
        let jd = number(row, "tt_jd");
        let t = Instant::parse(&format!("JD {jd:.12} TT")).expect("an epoch");
        let expected = vector(row, ["sun_x_km", "sun_y_km", "sun_z_km"]);
        sun.see(separation(EarthState::at(&t).to_sun, expected) / ARCSEC);
        let expected = vector(row, ["moon_x_km", "moon_y_km", "moon_z_km"]);
        moon.see(separation(moon_gcrs(&t), expected) / ARCSEC);
        distance.see(moon_gcrs(&t).length() / 1e3 - expected.length());
    }
    sun.below(0.05);
    // seen from the Earth's surface a kilometre is half an arcsecond
    moon.below(0.1);
    distance.below(0.2);
}

/// The Moon's librations and the Sun's place above it, against the IAU's lunar axes with DE421.
#[test]
fn librations_of_the_moon() {
    let mut worst = Worst::new("selenographic place", "deg");
    for row in &Reference::read("libration_iau.csv").0 {
        let face = moon::face(&utc(row), DVec3::ZERO);
        for (own, key) in [
            (face.observer_longitude, "lib_lon_deg"),
            (face.observer_latitude, "lib_lat_deg"),
            (face.sun_longitude, "subsolar_lon_deg"),
            (face.sun_latitude, "subsolar_lat_deg"),
        ] {
            let off = (own.to_degrees() - number(row, key) + 180.0).rem_euclid(360.0) - 180.0;
            worst.see(off);
        }
    }
    worst.below(0.02);
}

/// Torque-free rotation against sixty digits. What doubles can do is bounded by how far one unit in the last place of the
/// rates moves the result: far on the separatrix, so that only the first hundred seconds count there.
#[test]
fn torque_free_rotation() {
    let mut plain = Worst::new("attitude, to 1e4 s", "rad");
    let mut long = Worst::new("attitude, to 1e6 s", "rad");
    let mut fast = Worst::new("attitude after 1e5 revolutions", "rad");
    let mut rates = Worst::new("rates", "relative");
    for row in &Reference::read("tumble.csv").0 {
        let (inertia, rate) = (vector(row, ["i1", "i2", "i3"]), vector(row, ["w1", "w2", "w3"]));
        let start = Quaternion::new([1.0, 0.0, 0.0, 0.0]).expect("a unit");
        let body = Tumble::new(inertia, start, rate).expect("a body");
        let seconds = number(row, "t_s");
        let expected = Quaternion::new(["q0", "q1", "q2", "q3"].map(|k| number(row, k))).expect("a unit");
        let off = body.attitude(seconds).angle_to(&expected);
        let off_rate = (body.rate(seconds) - vector(row, ["w1_t", "w2_t", "w3_t"])).length() / rate.length();
        let separatrix = (rate.x - 0.519_615_242_790_278_4).abs() < 1e-12;
        if separatrix && seconds > 100.0 {
            println!("on the separatrix after {seconds} s: {off:e} rad");
            continue;
        }
        if rate.z > 6.0 && seconds > 1e4 {
            fast.see(off);
        } else if seconds > 1e4 {
            long.see(off);
        } else if separatrix {
            assert!(off < 1e-8, "{off:e}");
        } else {
            plain.see(off);
            rates.see(off_rate);
        }
    }
    plain.below(1e-10);
    long.below(1e-9);
    fast.below(1e-8);
    rates.below(1e-10);
}

/// Stations at both poles and on the date line, targets at the zenith and the horizon.
#[test]
fn stations_and_targets_at_the_ends_of_the_sky() {
    let t = Instant::from_utc("2018-01-20T03:00:00").expect("a date");
    for (latitude, longitude) in [(90.0f64, 0.0f64), (-90.0, 77.0), (12.0, 180.0), (12.0, -180.0)] {
        let air = Air { pressure_hpa: 1000.0, temperature_c: -40.0, humidity: 0.1 };
        let site = Site::new(longitude.to_radians(), latitude.to_radians(), 2800.0, &air);
        let back = Geodetic::of(site.itrf);
        assert!((back.latitude - latitude.to_radians()).abs() < 1e-14 && (back.height_m - 2800.0).abs() < 1e-8);
        let observer = Observer::at(&site, &t).expect("known");
        // straight up is the zenith, and refraction leaves it alone
        let up = observer.observed(observer.astrometric(DVec3::Z));
        assert!(separation(up, DVec3::Z) < 1e-10);
        for elevation in [0.0f64, 1e-9, -1e-9, 1e-3, -0.01] {
            let place = nightglass::astro::observer::enu(1.0, elevation);
            let refracted = observer.refracted(place);
            assert!(refracted.is_finite() && refracted.z > place.z && refracted.z < place.z + 0.02);
        }
    }
    let (east, west) = (180.0f64, -180.0f64);
    let air = Air { pressure_hpa: 0.0, temperature_c: 0.0, humidity: 0.0 };
    let site = |lon: f64| Site::new(lon.to_radians(), 0.2, 0.0, &air).itrf;
    assert!((site(east) - site(west)).length() < 1e-8);
    assert_eq!(Scale::named("utc"), Some(Scale::Utc));
}
