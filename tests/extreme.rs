//! Planning at its limits, each case by its name: a right answer, or an error that names the value and what is allowed.

use nightglass::plan::planner::Planner;
use nightglass::scene::{Options, Scene, load};

const GOES: [&str; 2] = [
    "1 35491U 09033A   18019.95817924 -.00000090  00000-0  00000-0 0  9991",
    "2 35491   0.0698 263.4367 0009544 339.3413 117.1094  1.00271818 31371",
];

fn loaded(sets: &[(&str, &str)]) -> Result<Scene, String> {
    let sets = sets.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect::<Vec<_>>();
    load("pogs-geo", &Options { sets: &sets, seed: None }).map_err(|e| e.to_string())
}

/// Elevation of the first target in the first exposure \[deg\], with every number of the view finite; or what is wrong.
fn elevation(sets: &[(&str, &str)]) -> Result<f64, String> {
    let scene = loaded(sets)?;
    let planner = Planner::new(&scene).map_err(|e| e.to_string())?;
    let view = planner.view(0).map_err(|e| e.to_string())?;
    let target = &view.targets[0];
    let numbers =
        [target.apparent.elevation, target.apparent.azimuth, target.airmass, target.rate.x, target.rate.y];
    assert!(numbers.iter().all(|x| x.is_finite()), "{sets:?}: {numbers:?}");
    assert!(view.wcs.mid.cd.is_finite() && view.wcs.mid.centre.is_finite(), "{sets:?}");
    let night = planner.night().map_err(|e| e.to_string())?;
    let windows = planner.windows(0, &night, None).map_err(|e| e.to_string())?;
    let total: f64 = windows.iter().map(|w| w.interval.seconds()).sum();
    assert!((total - night.span.seconds()).abs() < 1e-6, "{sets:?}: windows cover {total} s");
    Ok(target.apparent.elevation.to_degrees())
}

fn two_lines(one: &str, two: &str) -> String {
    format!("[{one:?}, {two:?}]")
}

#[test]
fn stations_at_the_poles_and_on_the_date_line() {
    let star = ("target.0.orbit.fixed", "{ ra_deg = 83.0, dec_deg = 60.0, range_km = 40000.0 }");
    for (latitude, longitude) in
        [("90.0", "0.0"), ("-90.0", "10.0"), ("0.0", "180.0"), ("0.0", "-180.0"), ("45.0", "360.0")]
    {
        let sets = [star, ("station.latitude_deg", latitude), ("station.longitude_deg", longitude)];
        let elevation = elevation(&sets).expect("a place");
        // at a pole the elevation is the declination, but for precession since 2000 and refraction
        match latitude {
            "90.0" => assert!((elevation - 60.0).abs() < 0.1, "{elevation}"),
            "-90.0" => assert!((elevation + 60.0).abs() < 0.5, "{elevation}"),
            _ => {}
        }
    }
    let east = elevation(&[star, ("station.longitude_deg", "180.0")]).expect("a place");
    let west = elevation(&[star, ("station.longitude_deg", "-180.0")]).expect("a place");
    assert!((east - west).abs() < 1e-9);
}

#[test]
fn pointing_at_the_zenith_the_horizon_and_the_celestial_pole() {
    for (az, el) in [("0.0", "90.0"), ("123.0", "89.999999"), ("90.0", "0.0"), ("180.0", "0.001"), ("0.0", "32.9")]
    {
        let sets = [
            ("pointing.at", "azel"),
            ("pointing.az_deg", az),
            ("pointing.el_deg", el),
            ("exposures.track", "sidereal"),
        ];
        elevation(&sets).expect("a view");
    }
    for dec in ["90.0", "-90.0"] {
        let fixed = format!("{{ ra_deg = 0.0, dec_deg = {dec} }}");
        elevation(&[("target.0.orbit.fixed", &fixed)]).expect("a view");
    }
}

#[test]
fn epochs_beyond_the_earth_orientation_table() {
    let early = elevation(&[("exposures.start", "1972-06-01T00:00:00Z")]).expect_err("before the table");
    assert!(early.contains("1972-") && early.contains("1973-01-02"), "{early}");
    let fixed = ("target.0.orbit.fixed", "{ ra_deg = 83.0, dec_deg = 8.0 }");
    for start in ["2031-06-01T03:00:00Z", "2099-12-25T23:59:59Z"] {
        let scene = loaded(&[("exposures.start", start), fixed]).expect("a scene");
        let planner = Planner::new(&scene).expect("a planner");
        let warnings = planner.warnings();
        assert!(warnings.iter().any(|w| w.contains("UT1 is extrapolated and may be off by")), "{warnings:?}");
        elevation(&[("exposures.start", start), fixed]).expect("a view");
    }
    let old = Planner::new(&loaded(&[("exposures.start", "2018-06-01T03:00:00Z")]).expect("a scene"))
        .expect("a planner")
        .warnings();
    assert!(old[0].contains("elements of GOES 14 are 132 days older"), "{old:?}");
}

#[test]
fn a_day_with_a_leap_second() {
    let sets =
        [("exposures.start", "2016-12-31T23:59:58Z"), ("exposures.count", "4"), ("exposures.duration_s", "0.5")];
    let sets = [&sets[..], &[("exposures.cadence_s", "1.0")]].concat();
    let scene = loaded(&sets).expect("a scene");
    let times = Planner::new(&scene).expect("a planner").views().expect("views");
    let times = times.iter().map(|v| v.mid.iso_utc()[11..21].to_owned()).collect::<Vec<_>>();
    assert_eq!(times, ["23:59:58.2", "23:59:59.2", "23:59:60.2", "00:00:00.2"]);
}

#[test]
fn two_line_sets_as_people_pass_them_on() {
    let plain = elevation(&[]).expect("a view");
    for (one, two) in [
        (GOES[0].to_lowercase(), GOES[1].to_owned()),
        (format!("{}   ", GOES[0]), format!("  {}\t", GOES[1])),
        (format!("{}\r", GOES[0]), format!("{}\r\n", GOES[1])),
    ] {
        assert_eq!(elevation(&[("target.0.orbit.tle", &two_lines(&one, &two))]).expect("a view"), plain);
    }
    for (one, two, told) in [
        (GOES[0].to_owned(), GOES[1].replace("117.1094", "117.1095"), "checksum is 1, expected 2"),
        (GOES[0][..68].to_owned(), GOES[1].to_owned(), "has 68 characters"),
        (
            GOES[0].to_owned(),
            GOES[1].replace("2 35491", "2 35492").replace("31371", "31372"),
            "different catalogue numbers",
        ),
        (GOES[0].replace("35491U", "3549éU"), GOES[1].to_owned(), "ASCII"),
        (String::new(), String::new(), "has 0 characters"),
    ] {
        let error = elevation(&[("target.0.orbit.tle", &two_lines(&one, &two))]).expect_err(told);
        assert!(error.contains(told), "{error}");
    }
}

#[test]
fn orbits_that_end_or_never_close() {
    let state =
        |r: &str, v: &str| format!("{{ epoch = 2018-01-20T00:00:00Z, position_km = {r}, velocity_km_s = {v} }}");
    // straight down: the orbit ends an hour before the exposure
    let fall = elevation(&[("target.0.orbit.state", &state("[8000.0, 0.0, 0.0]", "[0.0, 1.0, 0.0]"))])
        .expect_err("it falls");
    assert!(fall.contains("GOES 14") && fall.contains("meets the Earth after 2018-01-20T00:"), "{fall}");
    let inside = elevation(&[("target.0.orbit.state", &state("[3000.0, 0.0, 0.0]", "[0.0, 1.0, 0.0]"))])
        .expect_err("inside");
    assert!(inside.contains("3000.0 km from the Earth's centre; it must be above 6378.1 km"), "{inside}");
    // a probe on its way out
    let probe = [("target.0.orbit.state", &*state("[8000.0, 0.0, 0.0]", "[0.0, 11.0, 3.0]"))];
    elevation(&probe).expect("a hyperbola is an orbit");
    let kepler = |e: &str| {
        format!(
            "{{ epoch = 2018-01-20T00:00:00Z, a_km = 42164.0, e = {e}, i_deg = 1.0, raan_deg = 0.0, argp_deg = 0.0, \
             mean_anomaly_deg = 180.0 }}"
        )
    };
    elevation(&[("target.0.orbit.kepler", &kepler("0.84"))]).expect("a long ellipse");
    let parabola = elevation(&[("target.0.orbit.kepler", &kepler("1.0"))]).expect_err("a parabola");
    assert!(parabola.contains("must be below 1"), "{parabola}");
    let beyond = elevation(&[("target.0.orbit.kepler", &kepler("1.2"))]).expect_err("beyond");
    assert!(beyond.contains("1.2: must lie in 0..1"), "{beyond}");
    // a low satellite with a thousand times the drag it has
    let heavy = two_lines(
        "1 25544U 98067A   18020.89808844  .00002078  00000-0  38550-0 0  9998",
        "2 25544  51.6424  32.9776 0003646  28.7227  39.5332 15.54190080 95614",
    );
    let decayed = elevation(&[("target.0.orbit.tle", &heavy), ("exposures.start", "2018-03-20T03:00:00Z")])
        .expect_err("it is gone");
    assert!(decayed.contains("orbit of GOES 14 at 2018-03-20"), "{decayed}");
}

#[test]
fn numbers_that_are_none() {
    for (key, value) in [
        ("station.latitude_deg", "nan"),
        ("station.height_m", "inf"),
        ("target.0.orbit.fixed", "{ ra_deg = nan, dec_deg = 0.0 }"),
        ("target.0.orbit.fixed", "{ ra_deg = 0.0, dec_deg = 0.0, range_km = -1.0 }"),
        ("exposures.cadence_s", "nan"),
        ("exposures.start", "0000-00-00T00:00:00Z"),
    ] {
        let error = loaded(&[(key, value)]).expect_err(key);
        assert!(error.contains(key), "{error}");
    }
}

#[test]
fn ranges_from_a_millimetre_to_a_light_hour() {
    for range in ["1e-6", "1.0", "1e9"] {
        let fixed = format!("{{ ra_deg = 83.0, dec_deg = 8.0, range_km = {range} }}");
        elevation(&[("target.0.orbit.fixed", &fixed)]).expect("a view");
    }
}
