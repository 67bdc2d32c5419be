//! Light curves of every form: what other programs wrote, and what is refused.

use super::curve_file::{CurveFile, read};
use crate::astro::time::Instant;
use crate::base::table::Table;
use glam::DVec3;

/// Written by astropy 8.0.2: `Table.write(format="ascii.ecsv")` of masked, quoted and described columns.
const ASTROPY: &str = include_str!("../../tests/reference/lightcurve_astropy.ecsv");
/// The same with `delimiter=","`.
const ASTROPY_COMMA: &str = include_str!("../../tests/reference/lightcurve_astropy_comma.ecsv");

fn good(text: &str) -> CurveFile {
    read("lc", text).unwrap_or_else(|e| panic!("{e}"))
}

/// Line, column and message of the error.
fn bad(text: &str) -> (usize, Option<String>, String) {
    let error = read("lc", text).expect_err(text);
    (error.line, error.column.clone(), error.to_string())
}

#[test]
fn astropy_files_read_with_either_delimiter() {
    let file = good(ASTROPY);
    assert_eq!(format!("{file:?}"), format!("{:?}", good(ASTROPY_COMMA)));
    assert_eq!(file.rows.iter().map(|r| r.target.as_str()).collect::<Vec<_>>(), ["GOES 14", "a \"b\", c", ""]);
    assert_eq!(file.rows.iter().map(|r| r.curve).collect::<Vec<_>>(), [0, 1, 2]);
    assert_eq!(file.rows.iter().map(|r| r.flags).collect::<Vec<_>>(), [0, 1, 64]);
    assert_eq!((file.rows[0].flux, file.rows[1].flux, file.rows[0].flux_err), (1000.5, -3.0, 10.0));
    // masked, and missing altogether
    assert!(file.rows[1].flux_err.is_nan() && file.rows[2].flux.is_nan() && file.rows[0].sun.is_nan());
    let time = Instant::from_utc("2024-01-02T03:04:15.5").unwrap();
    assert_eq!((file.rows[1].time, file.rows[2].range_km), (time, 36_002.0));
    let meta = |key: &str| file.meta.iter().find(|(k, _)| k == key).map(|(_, v)| v.as_str());
    assert_eq!(meta("origin"), Some("measured"));
    assert_eq!(meta("norm_range_km"), Some("36000.0"));
    assert_eq!(meta("comments"), Some(r#"["first line","second: line # with hash","its"]"#));
    assert_eq!((meta("multi"), meta("num"), meta("yes")), (Some("line one\nline two"), Some("12"), Some("true")));
    assert!(
        meta("nested").is_some_and(|n| n.starts_with(r#"{"a":1,"b":{"c":[1,2,{"d":"e"}]}"#)),
        "{:?}",
        meta("nested")
    );
}

/// A table as this project writes it, of which tests change lines.
fn own() -> String {
    let mut table = Table::default();
    table.note("origin", "model");
    let start = Instant::from_utc("2024-06-30T23:59:59.25").unwrap();
    table.ints("frame", 3..5);
    table.texts("time_utc", (0..2).map(|k| start.plus(f64::from(k)).iso_utc()));
    table.floats("exptime_s", "s", [10.0, 10.0].into_iter());
    table.texts("target", ["A".to_owned(), "A".to_owned()].into_iter());
    table.floats("flux_e", "electron", [0.1, -2.0].into_iter());
    table.floats("zeropoint_mag", "mag", [25.0, 25.0].into_iter());
    table.floats("range_km", "km", [36_000.0, f64::NAN].into_iter());
    for (name, value) in [("sun_x", 0.6), ("sun_y", 0.0), ("sun_z", 0.8), ("obs_x", 0.0), ("obs_y", 2.0)] {
        table.floats(name, "", [value, f64::NAN].into_iter());
    }
    table.floats("obs_z", "", [0.0, 0.0].into_iter());
    table.ints("flags", [0, 128].into_iter());
    crate::io::ecsv::to_ecsv(&table)
}

#[test]
fn own_files_read_to_the_bit_in_any_order_of_columns() {
    let file = good(&own());
    let [first, second] = [&file.rows[0], &file.rows[1]];
    assert_eq!((first.frame, first.flux, first.exptime_s, second.flags), (Some(3), 0.1, 10.0, 128));
    assert!((first.sun - DVec3::new(0.6, 0.0, 0.8)).length() < 1e-15);
    // a direction has length 1, and is NaN if any part is
    assert_eq!((first.obs, second.obs.is_nan()), (DVec3::Y, true));
    assert_eq!(second.time.since(&first.time), 1.0);
    assert!(file.calibrated() && file.curves.len() == 1);
    let turned = "flux_e,flags,mjd_utc\n7.5,2,60000.25\n";
    let file = good(turned);
    assert_eq!((file.rows[0].flux, file.rows[0].flags), (7.5, 2));
    assert_eq!(file.rows[0].time, Instant::from_utc("2023-02-25T06:00:00").unwrap());
}

#[test]
fn magnitudes_alone_give_fluxes_that_turn_back() {
    let file =
        good("mag_v,time_utc,mag_err\n# remark\n12.5,2024-01-01T00:00:00Z,0.01\nnan,2024-01-01T00:00:01,\n");
    let row = &file.rows[0];
    assert!((row.zeropoint_mag - 2.5 * row.flux.log10() - 12.5).abs() < 1e-14);
    // d ln f = 0.4 ln 10 dm
    assert!((row.flux_err / row.flux - 0.009_210_340_371_976_184).abs() < 1e-15);
    assert!(file.rows[1].flux.is_nan());
    // in eclipse: no light, and no magnitude of it
    let dark = good("mag_v,time_utc\ninf,2024-01-01T00:00:00\n");
    assert!(dark.rows[0].flux == 0.0 && dark.rows[0].mag.is_nan());
    assert_eq!(bad("mag_v,time_utc\n-inf,2024-01-01T00:00:00\n").0, 2);
}

#[test]
fn damit_curves_are_turned_from_the_ecliptic_to_icrs() {
    let text = "2\n2 1\n2451545.0  1.5   0 2 0   0 0 1\n 2451545.25 0.0  1 0 0  -1 0 0\n\n1 0\n2451546.5 1e-3 1 1 1 0 0 3\n";
    let file = good(text);
    assert_eq!(
        file.curves.iter().map(|c| (c.calibrated, c.reduced)).collect::<Vec<_>>(),
        [(true, true), (false, true)]
    );
    assert!(!file.calibrated());
    assert_eq!(file.rows.iter().map(|r| r.curve).collect::<Vec<_>>(), [0, 0, 1]);
    // the ecliptic's y axis and pole, by hand: cos and sin of 23.4392794 deg
    let (cos, sin) = (0.917_482_143_065_241_8, 0.397_776_969_112_606);
    assert!((file.rows[0].sun - DVec3::new(0.0, cos, sin)).length() < 1e-15);
    assert!((file.rows[0].obs - DVec3::new(0.0, -sin, cos)).length() < 1e-15);
    assert_eq!((file.rows[0].range_km, file.rows[0].flux), (149_597_870.7, 1.5));
    assert_eq!(file.rows[1].time, Instant::from_utc("2000-01-01T18:00:00").unwrap());
    // no light has no magnitude
    assert!(file.rows[1].mag.is_nan());
}

#[test]
fn alcdef_sessions_become_curves() {
    let block = |date: &str, differ: &str| {
        format!(
            "STARTMETADATA\nOBJECTNAME=X\nSESSIONDATE={date}\nFILTER=C\nDIFFERMAGS={differ}\nREDUCEDMAGS=NONE\n\
             EXPOSURE=30\nDELIMITER=PIPE\nENDMETADATA\nDATA=2458850.5|12.5|0.02\nENDDATA\n"
        )
    };
    let file = good(&(block("2020-01-02", "FALSE") + &block("2020-01-03", "TRUE")));
    assert_eq!((file.rows.len(), file.rows[1].curve, file.rows[0].exptime_s), (2, 1, 30.0));
    assert_eq!(
        file.curves.iter().map(|c| (c.calibrated, c.reduced)).collect::<Vec<_>>(),
        [(true, false), (false, false)]
    );
    assert_eq!(file.curves[1].name, "X 2020-01-03 C");
    assert!(file.rows[0].sun.is_nan() && (file.rows[0].flux - 1e-5).abs() < 1e-20);
}

#[test]
fn faults_name_file_line_column_value_and_what_is_allowed() {
    let text = own();
    let lines = text.lines().count();
    let cases = [
        ("0.1 25.0", "0.1x 25.0", lines - 1, "flux_e"),
        ("-2.0 25.0", "inf 25.0", lines, "flux_e"),
        (" 128", " -1", lines, "flags"),
        (" 128", " 4294967296", lines, "flags"),
        (" 128", " 1.5", lines, "flags"),
        ("\n3 ", "\nthree ", lines - 1, "frame"),
        ("2024-06-30", "2024-06-31", lines - 1, "time_utc"),
        ("range_km, unit: km", "range_km, unit: m", 1, "range_km"),
        ("flux_e, unit: electron", "flux_e, unit: adu", 1, "flux_e"),
        ("name: flags,", "name: flags, unit: s,", 1, "flags"),
    ];
    for (old, new, line, column) in cases {
        assert!(text.contains(old), "{old}");
        let (found, name, words) = bad(&text.replacen(old, new, 1));
        assert_eq!((found, name.as_deref()), (line, Some(column)), "{new}: {words}");
        assert!(words.starts_with("lc: line ") && words.contains("allowed: "), "{words}");
    }
    for (text, line) in [
        ("", 1),
        ("time_utc,x\n", 1),
        ("flux_e,x\n", 1),
        ("flux_e,time_utc\n1\n", 2),
        ("flux_e,time_utc\n1,\n", 2),
        ("flux_e,mjd_utc\n1,1e9\n", 2),
        ("1\n1\n", 2),
        ("1\n1 2\n2451545.0 1 1 1 1 1 1 1\n", 2),
        ("1\n1 0\n2451545.0 1 1 1 1 1 1\n", 3),
        ("1\n1 0\n2451545.0 1 1 1 1 1 1 nan\n", 3),
        ("1\n2 0\n2451545.0 1 1 1 1 1 1 1\n", 3),
        ("1\n1 0\n2451545.0 1 1 1 1 1 1 1\n7\n", 4),
        ("18446744073709551615\n", 1),
        ("STARTMETADATA\nx\n", 2),
    ] {
        assert_eq!(bad(text).0, line, "{text}");
    }
}

/// A stream of numbers below `n` (Knuth's MMIX generator) from a fixed seed.
fn stream(mut state: u64) -> impl FnMut(usize) -> usize {
    move |n| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % n.max(1)
    }
}

#[test]
fn damaged_files_give_an_error_or_a_curve_but_no_panic() {
    let damit = "2\n2 1\n2451545.0 1.5 0 2 0 0 0 1\n2451545.2 0.0 1 0 0 -1 0 0\n1 0\n2451546.5 1e-3 1 1 1 0 0 3\n";
    let alcdef = "STARTMETADATA\nOBJECTNAME=X\nSESSIONDATE=2020-01-02\nFILTER=C\nDELIMITER=PIPE\nENDMETADATA\n\
                  DATA=2458850.5|12.5|0.02\nENDDATA\n";
    let mut next = stream(7);
    let pieces =
        ["", "\n", "\"", "'", "{", "[", "é", "\u{0}", "#", "- ", ": ", "-", "9", "1e999", "|", "\t", "nan", "!"];
    let (mut read_well, mut refused) = (0, 0);
    for _ in 0..4000 {
        let whole = [ASTROPY, ASTROPY_COMMA, &own(), damit, alcdef][next(5)].to_owned();
        let mut characters = whole.chars().collect::<Vec<_>>();
        for _ in 0..=next(3) {
            let from = next(characters.len());
            let to = (from + next(4)).min(characters.len());
            characters.splice(from..to, pieces[next(pieces.len())].chars());
        }
        match read("lc", &characters.into_iter().collect::<String>()) {
            Ok(_) => read_well += 1,
            Err(_) => refused += 1,
        }
    }
    // both happen often, so the damage is neither harmless nor total
    assert!(read_well > 400 && refused > 400, "{read_well} {refused}");
}
