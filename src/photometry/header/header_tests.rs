//! Facts of real layouts, and what is said of contradictions.

use super::fixtures::*;
use super::*;
use crate::astro::angles;

const SIZE: [usize; 2] = [4096, 4096];

fn read(cards: &Cards) -> Facts {
    Facts::read(cards, SIZE, &Overrides::default())
}

fn facts(text: &str) -> Facts {
    read(&Cards::of(text))
}

/// Notes of a kind about a keyword.
fn noted(f: &Facts, kind: NoteKind, keyword: &str) -> bool {
    f.notes.iter().any(|n| n.kind == kind && n.concerns(keyword))
}

fn count(f: &Facts, kind: NoteKind) -> usize {
    f.notes.iter().filter(|n| n.kind == kind).count()
}

fn lacking(f: &Facts) -> Vec<&'static str> {
    f.missing().into_iter().map(|m| m.option).collect()
}

fn time(f: &Facts) -> (String, &'static str, f64) {
    f.time.as_ref().map(|t| (t.iso.clone(), t.scale.name(), t.plus_s)).expect("a time")
}

fn close(value: Option<f64>, want: f64, tolerance: f64) {
    assert!(value.is_some_and(|v| (v - want).abs() <= tolerance), "{value:?} instead of {want}");
}

fn place(f: &Facts) -> (f64, f64) {
    let (ra, dec) = angles(f.pointing.expect("a pointing"));
    (ra.to_degrees(), dec.to_degrees())
}

#[test]
fn maxim_dl_with_pinpoint() {
    let f = facts(MAXIM_ACP);
    assert_eq!((f.program, f.exptime_s, f.gain_e_adu), (Some("MaxIm DL"), Some(300.0), None));
    assert_eq!(time(&f), ("2018-07-04T14:03:03.000000000".into(), "UTC", 150.0));
    // the pedestal is to be added: the zero level lies 100 adu above 0
    assert_eq!((f.bias_adu, f.saturate_adu), (Some(100.0), Some(65_535.0)));
    close(f.aperture_m, 0.392, 1e-12);
    close(f.elevation_m, 1165.0, 0.0);
    let site = f.site.expect("a site");
    assert!((site.latitude.to_degrees() + 31.273_333).abs() < 1e-5);
    assert!((site.longitude.to_degrees() - 149.064_444).abs() < 1e-5);
    let (ra, dec) = place(&f);
    assert!((ra - 275.2005).abs() < 1e-6 && (dec + 16.183).abs() < 1e-6);
    assert_eq!(lacking(&f), ["--gain"]);
    assert_eq!(count(&f, NoteKind::Contradictory), 0, "{:?}", f.notes);
    let wcs = f.wcs.expect("an approximate one");
    assert!(wcs.approximate);
    // 206264.8 x 7.4 um / 1425 mm
    assert!((wcs.wcs.pixel_scale() / ARCSEC - 1.07113).abs() < 1e-4);
}

#[test]
fn maxim_dl_raw_and_binned() {
    let f = facts(MAXIM_RAW);
    assert_eq!((f.gain_e_adu, f.saturate_adu, f.bias_adu), (Some(1.37), Some(65_000.0), None));
    assert_eq!(f.binning, Some([2, 2]));
    assert!(noted(&f, NoteKind::Ignored, "PEDESTAL") && noted(&f, NoteKind::Assumed, "DATE-OBS"));
    // 18 um is the binned pixel: 1.449 arcsec, not 2.897
    let wcs = f.wcs.expect("an approximate one");
    assert!((wcs.wcs.pixel_scale() / ARCSEC - 1.448_60).abs() < 1e-3);
    // a place of date would be off by 50.3 arcsec x 22.9 years = 19.2 arcmin
    let note = f.notes.iter().find(|n| n.concerns("OBJCTRA")).expect("a note").to_string();
    assert!(note.contains("J2000") && note.contains("19.2 arcmin"), "{note}");
    assert_eq!(lacking(&f), [""; 0]);
}

#[test]
fn theskyx_solved() {
    let f = facts(THESKYX);
    assert_eq!((f.program, f.gain_e_adu), (Some("TheSkyX"), Some(0.92)));
    assert_eq!(time(&f).0, "2019-03-12T03:15:44.213000000");
    let wcs = f.wcs.expect("solved");
    assert!(!wcs.approximate && wcs.wcs.crpix == DVec2::splat(2047.5));
    assert!(noted(&f, NoteKind::Assumed, "SITELONG"));
    assert_eq!(lacking(&f), [""; 0]);
}

#[test]
fn nina_has_a_setting_as_gain() {
    let f = facts(NINA);
    assert_eq!((f.gain_e_adu, f.program), (Some(0.249), Some("N.I.N.A.")));
    assert!(noted(&f, NoteKind::Ignored, "GAIN") && noted(&f, NoteKind::Ignored, "OFFSET"));
    assert_eq!(time(&f), ("2023-03-02T20:19:15.455700000".into(), "UTC", 0.0));
    // 530 mm / f/5
    close(f.aperture_m, 0.106, 1e-12);
    assert_eq!(count(&f, NoteKind::Contradictory), 0, "{:?}", f.notes);
    let without = read(&Cards::of(NINA).without(&["EGAIN"]));
    assert_eq!((without.gain_e_adu, lacking(&without)), (None, vec!["--gain"]));
    let why = &without.missing()[0].because;
    assert!(why.iter().any(|n| n.concerns("GAIN") && n.to_string().contains("setting")), "{why:?}");
    let told = without.missing()[0].to_string();
    let want =
        "no gain (EGAIN, GAIN), needed for counts in electrons; --gain can supply it; ignored: GAIN = 100: ";
    assert!(told.starts_with(want), "{told}");
    // without the program's name, the camera's tells
    let without = read(&Cards::of(NINA).without(&["EGAIN", "SWCREATE"]));
    assert_eq!(without.gain_e_adu, None);
}

#[test]
fn sharpcap_new_and_old() {
    let f = facts(SHARPCAP);
    assert_eq!((f.gain_e_adu, f.exptime_s), (Some(0.45), Some(0.5)));
    assert_eq!(time(&f), ("2024-04-29T20:25:30.071958300".into(), "UTC", 0.0));
    assert_eq!(count(&f, NoteKind::Contradictory), 0, "{:?}", f.notes);
    assert_eq!(lacking(&f), ["--radec and --pixel-scale"]);
    let f = facts(SHARPCAP_SOLVED);
    assert!(noted(&f, NoteKind::Assumed, "DATE-OBS"));
    let wcs = f.wcs.expect("solved");
    assert!(!wcs.approximate);
    assert_eq!(wcs.wcs.sip.map(|s| (s.a[0], s.b[2])), Some((3.75738837922e-7, -9.07325128016e-7)));
    assert_eq!(lacking(&f), ["--gain"]);
}

#[test]
fn firecapture_and_apt() {
    let f = facts(FIRECAPTURE);
    assert_eq!((f.gain_e_adu, f.saturate_adu, f.exptime_s), (None, Some(255.0), Some(0.02)));
    assert_eq!(lacking(&f), ["--gain", "--radec and --pixel-scale"]);
    let f = facts(APT);
    close(f.gain_e_adu, 1.002_242_684, 1e-9);
    // JD agrees to its last digit
    assert_eq!(count(&f, NoteKind::Contradictory), 0, "{:?}", f.notes);
    assert!(f.wcs.is_some_and(|w| w.approximate));
}

#[test]
fn sequence_generator_pro() {
    let f = facts(SGP);
    assert_eq!((f.gain_e_adu, f.exptime_s), (Some(3.99000000953674), Some(30.0)));
    close(f.elevation_m, 10.0, 0.0);
    assert_eq!(time(&f), ("2020-05-30T00:22:49.096882000".into(), "UTC", 15.0));
    assert!(f.wcs.is_some_and(|w| w.approximate));
}

#[test]
fn iraf_and_lco() {
    let f = facts(IRAF);
    assert_eq!((f.gain_e_adu, f.read_noise_e), (Some(2.3), Some(7.5)));
    assert_eq!(time(&f), ("2010-03-04T05:12:33.400000000".into(), "UTC", 30.0));
    assert_eq!(f.trim, Some(Section { x0: 0, y0: 0, width: 2048, height: 2048 }));
    let (ra, dec) = place(&f);
    assert!((ra - 102.933_333).abs() < 1e-5 && (dec + 0.283_333).abs() < 1e-5);
    let f = facts(LCO);
    assert_eq!((f.gain_e_adu, f.read_noise_e, f.saturate_adu), (Some(1.0), Some(8.0), Some(128_000.0)));
    close(f.seeing, 2.05 * ARCSEC, 1e-15);
    close(f.elevation_m, 2198.0, 0.0);
    assert_eq!(time(&f).2, 15.127);
    assert_eq!((count(&f, NoteKind::Contradictory), lacking(&f)), (0, vec![]), "{:?}", f.notes);
}

#[test]
fn a_header_of_the_nineties() {
    let f = facts(OLD);
    assert_eq!(time(&f), ("1993-03-28T07:18:51.000000000".into(), "UTC", 80.0));
    // B1950 place of M81 precessed: 09h55m33s +69d04m (SIMBAD: 148.888, +69.065)
    let (ra, dec) = place(&f);
    assert!((ra - 148.888).abs() < 0.02 && (dec - 69.065).abs() < 0.01, "{ra} {dec}");
    assert!(noted(&f, NoteKind::Assumed, "RA"));
    let wcs = f.wcs.expect("an approximate one");
    assert!(wcs.approximate && (wcs.wcs.pixel_scale() / ARCSEC - 1.2).abs() < 1e-9);
}

#[test]
fn other_clocks_are_kept_apart() {
    let f = facts(GPS);
    assert_eq!(time(&f), ("2021-01-01T00:00:10.123456700".into(), "GPS", 0.1));
    assert_eq!((f.exptime_s, f.gain_e_adu), (Some(0.2), Some(0.31)));
    let scale = |name: &str| read(&Cards::of(GPS).with(&format!("TIMESYS = '{name}'"))).time.map(|t| t.scale);
    assert_eq!(scale("TT"), Some(TimeScale::Tt));
    assert_eq!(scale("tai"), Some(TimeScale::Tai));
    assert_eq!((scale("UTC(USNO)"), scale("LOCAL"), scale("TCB")), (Some(TimeScale::Utc), None, None));
    let f = read(&Cards::of(IRAF).with("TIMESYS = 'LOCAL'"));
    assert!(noted(&f, NoteKind::Refused, "TIMESYS"));
    assert_eq!(lacking(&f), ["--time"]);
}

#[test]
fn a_number_as_ra_may_be_in_hours() {
    let (ra, dec) = place(&facts(DWARF));
    assert!((ra - 250.5).abs() < 1e-9 && (dec - 36.46).abs() < 1e-9);
    let cards = Cards::of(NINA).with("RA = 18.89303598874\nSWCREATE = ''");
    let f = read(&cards);
    assert!((place(&f).0 - 283.3955398).abs() < 1e-6 && noted(&f, NoteKind::Assumed, "RA"));
}

#[test]
fn our_own_frames_raise_no_note() {
    let f = facts(OURS);
    assert_eq!(f.notes, []);
    assert_eq!(time(&f), ("2018-01-15T04:00:02.500000000".into(), "UTC", 0.0));
    assert_eq!((f.bias_adu, f.saturate_adu, f.airmass), (Some(300.0), Some(65_535.0), Some(1.25)));
    assert_eq!(f.track_rad_s, Some(DVec2::new(15.041, -0.01) * ARCSEC));
    assert!(f.site.is_some_and(|s| (s.latitude.to_degrees() - 40.42).abs() < 0.05));
    // a gain that only a simulation has is still a gain
    let f = read(&Cards::of(OURS).with("GAIN = 40\nEGAIN = 40"));
    assert_eq!(f.gain_e_adu, Some(40.0));
}

#[test]
fn contradictions_are_named() {
    let cases = [
        ("GAIN = 2.5", "GAIN"),
        ("MJD-OBS = 58133.1666688", "MJD-OBS"),
        ("DATE-AVG = '2018-01-15T04:00:00.000000'", "DATE-BEG"),
        ("DATE-END = '2018-01-15T04:00:06.5'", "DATE-END"),
        ("XPOSURE = 4.0", "XPOSURE"),
        ("PIXSCALE = 0.745", "PIXSCALE"),
        ("RA = 82.0", "RA"),
        ("SATURATE = 70000", "SATURATE"),
        ("APTAREA = 200000", "APTAREA"),
        ("FOCRATIO = 10", "FOCRATIO"),
        ("SITELAT = 41.0\nSITELONG = -86.9", "SITELAT"),
        ("TIME-OBS = '04:00:01.5'", "TIME-OBS"),
    ];
    for (cards, keyword) in cases {
        let f = read(&Cards::of(OURS).with(cards));
        assert!(noted(&f, NoteKind::Contradictory, keyword), "{cards}: {:?}", f.notes);
    }
    // within rounding nothing is said
    for cards in ["MJD-OBS = 58133.166667", "PIXSCALE = 0.735", "DATE-OBS = '2018-01-15T04:00:00'", "RA = 80.9"] {
        let f = read(&Cards::of(OURS).with(cards));
        assert_eq!(f.notes, [], "{cards}");
    }
    // a west longitude is recognised as such
    let f = read(&Cards::of(MAXIM_ACP).with("SITELONG = '-149 03 52'"));
    let west = f.notes.iter().any(|n| n.kind == NoteKind::Contradictory && n.what.contains("counted west"));
    assert!(west, "{:?}", f.notes);
    // half an exposure, too
    let f = read(&Cards::of(LCO).with("MJD-OBS = 59366.12801858"));
    assert!(f.notes.iter().any(|n| n.concerns("MJD-OBS") && n.what.contains("half an exposure")), "{:?}", f.notes);
}

#[test]
fn placeholders_are_not_believed() {
    let f =
        read(&Cards::of(MAXIM_RAW).with("EGAIN = 0\nOBJCTRA = '00 00 00'\nOBJCTDEC = '+00 00 00'\nFOCALLEN = 0"));
    assert_eq!((f.gain_e_adu, f.pointing, f.focal_length_m), (None, None, None));
    for keyword in ["EGAIN", "OBJCTRA", "FOCALLEN"] {
        assert!(noted(&f, NoteKind::Ignored, keyword), "{keyword}");
    }
    assert_eq!(lacking(&f), ["--gain", "--radec and --pixel-scale"]);
    // only local time
    let f = read(&Cards::of(NINA).without(&["DATE-OBS", "DATE-AVG", "MJD-OBS", "MJD-AVG"]));
    assert!(f.missing().iter().any(|m| m.what == "time" && m.because.iter().any(|n| n.concerns("DATE-LOC"))));
    let f = read(&Cards::of(NINA).with("EGAIN = 100"));
    assert!(f.gain_e_adu.is_none() && noted(&f, NoteKind::Refused, "EGAIN"));
}

#[test]
fn pedestals_of_either_sign() {
    let bias = |cards: &str| read(&Cards::of(MAXIM_RAW).with(cards)).bias_adu;
    assert_eq!(bias("PEDESTAL = -100"), Some(100.0));
    assert_eq!(bias("PEDESTAL = 150"), Some(150.0));
    assert_eq!(bias("CALSTAT = 'BDF'"), Some(0.0));
    assert_eq!(bias("CALSTAT = 'F'"), None);
    assert_eq!(bias("BIASLVL = 1020\nPEDESTAL = -100"), Some(1020.0));
}

#[test]
fn metres_are_recognised() {
    let f = read(&Cards::of(OURS).with("APTDIA = 0.3556\nFOCALLEN = 2.563"));
    close(f.aperture_m, 0.3556, 1e-12);
    close(f.focal_length_m, 2.563, 1e-12);
    let f = read(&Cards::of(OURS).with("APTDIA = 0.3556"));
    close(f.focal_length_m, 2.563, 1e-12);
    assert!(noted(&f, NoteKind::Assumed, "APTDIA"));
}

#[test]
fn the_user_wins_and_it_is_noted() {
    let overrides = Overrides {
        gain_e_adu: Some(2.0),
        read_noise_e: Some(3.0),
        saturate_adu: Some(50_000.0),
        bias_adu: Some(1000.0),
        exptime_s: Some(8.0),
        time_utc: Some("2018-01-15T05:00:00".into()),
        seeing_arcsec: Some(3.0),
        aperture_mm: Some(500.0),
        elevation_m: Some(1200.0),
        pointing_deg: Some([81.0, 6.0]),
        track_arcsec_s: Some([1.0, 2.0]),
        ..Overrides::default()
    };
    let f = Facts::read(&Cards::of(OURS), SIZE, &overrides);
    assert_eq!(
        (f.gain_e_adu, f.read_noise_e, f.saturate_adu, f.bias_adu, f.exptime_s),
        (Some(2.0), Some(3.0), Some(50_000.0), Some(1000.0), Some(8.0))
    );
    assert_eq!(time(&f), ("2018-01-15T05:00:00.000000000".into(), "UTC", 4.0));
    close(f.seeing, 3.0 * ARCSEC, 1e-15);
    close(f.aperture_m, 0.5, 1e-12);
    close(f.elevation_m, 1200.0, 0.0);
    assert_eq!(f.track_rad_s, Some(DVec2::new(1.0, 2.0) * ARCSEC));
    assert!((place(&f).0 - 81.0).abs() < 1e-9);
    assert!(f.wcs.is_some_and(|w| !w.approximate));
    assert_eq!(count(&f, NoteKind::Overridden), 11);
    assert_eq!(count(&f, NoteKind::Overridden), f.notes.len());
}

#[test]
fn unusable_wishes_leave_the_header() {
    let overrides = Overrides {
        gain_e_adu: Some(-1.0),
        read_noise_e: Some(f64::NAN),
        saturate_adu: Some(0.0),
        bias_adu: Some(f64::INFINITY),
        exptime_s: Some(-5.0),
        time_utc: Some("yesterday".into()),
        pixel_scale_arcsec: Some(0.0),
        pointing_deg: Some([0.0, 91.0]),
        track_arcsec_s: Some([f64::NAN, 0.0]),
        ..Overrides::default()
    };
    let f = Facts::read(&Cards::of(OURS), SIZE, &overrides);
    let plain = facts(OURS);
    assert_eq!((f.gain_e_adu, f.bias_adu, f.time.clone()), (plain.gain_e_adu, plain.bias_adu, plain.time));
    assert_eq!((f.exptime_s, f.pointing, f.track_rad_s), (plain.exptime_s, plain.pointing, plain.track_rad_s));
    assert_eq!(count(&f, NoteKind::Refused), 9, "{:?}", f.notes);
}
