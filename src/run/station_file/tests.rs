use super::*;
use crate::base::poisson::poisson;
use crate::base::random::{Address, Stage};
use crate::base::sample::add_normal;
use crate::base::units::ARCSEC_PER_RAD;
use crate::photometry::header::Overrides;
use crate::photometry::header::fixtures::{ALL, Cards, IRAF, MAXIM_RAW, NINA, OURS};
use std::f64::consts::PI;

const SIZE: [usize; 2] = [2048, 2048];

fn of(header: &Cards, size: [usize; 2], data: &[f32]) -> Vec<Entry> {
    let facts = Facts::read(header, size, &Overrides::default());
    entries(&Source { facts: &facts, header, size, data })
}

fn value<'e>(found: &'e [Entry], key: &str) -> &'e Entry {
    found.iter().find(|e| e.key == key).unwrap_or_else(|| panic!("{key} is missing"))
}

fn number(found: &[Entry], key: &str) -> f64 {
    let value = &value(found, key).value;
    value.as_float().or(value.as_integer().map(|i| i as f64)).expect("a number")
}

/// Whatever program wrote the header, the station is one that a scene can use, and every value has its origin.
#[test]
fn every_dialect_gives_a_station() {
    for (name, cards) in ALL {
        let found = of(&Cards::of(cards), SIZE, &[]);
        let text = to_toml(&found, name);
        assert!(check(&text).is_ok(), "{name}: {}\n{text}", check(&text).unwrap_err());
        assert!(found.iter().all(|e| !e.why.trim().is_empty()), "{name}: {found:?}");
        assert!(text.lines().filter(|l| l.contains(" = ")).all(|l| l.contains("# ")), "{name}");
    }
}

/// MaxIm DL, binned 2 x 2: sizes and scale are those of unbinned pixels, 9e-6 / 2.563 rad.
#[test]
fn a_binned_frame_of_maxim() {
    let found = of(&Cards::of(MAXIM_RAW), SIZE, &[]);
    assert_eq!(value(&found, "detector.size_px").value, toml::Value::Array(vec![4096.into(), 4096.into()]));
    assert_eq!((number(&found, "detector.pixel_um"), number(&found, "detector.binning")), (9.0, 2.0));
    assert_eq!(number(&found, "detector.gain_e_per_adu"), 1.37);
    assert_eq!(value(&found, "detector.gain_e_per_adu").why, "EGAIN = 1.37");
    let scale = 9e-6 / 2.563 * ARCSEC_PER_RAD;
    assert!((number(&found, "telescope.plate_scale_arcsec") - scale).abs() < 1e-6);
    assert!((number(&found, "station.latitude_deg") - (40.0 + 25.0 / 60.0 + 26.0 / 3600.0)).abs() < 1e-6);
    let hole = (0.3556f64.powi(2) - 4.0 * 0.0887 / PI).sqrt();
    assert!((number(&found, "telescope.obstruction_m") - hole).abs() < 1e-5);
    assert_eq!(value(&found, "detector.qe").value, "kaf16803".into());
    // 65 000 adu with no bias known: the stand-in counts
    assert_eq!(value(&found, "detector.bias_adu").origin, Origin::FillIn);
}

/// A driver's setting is no gain, and the maker's name tells an active-pixel chip.
#[test]
fn a_camera_with_a_setting() {
    let found = of(&Cards::of(NINA), SIZE, &[]);
    assert_eq!(value(&found, "detector.kind").value, "cmos".into());
    let without = Cards::of(NINA).without(&["EGAIN"]);
    let gain = of(&without, SIZE, &[]);
    assert_eq!(value(&gain, "detector.gain_e_per_adu").origin, Origin::FillIn);
    assert_eq!(value(&of(&Cards::of(IRAF), [2080, 2048], &[]), "detector.overscan_px").value, 32.into());
}

/// The frames of this program tell nearly all of their station: only what no keyword has is assumed.
#[test]
fn our_own_header() {
    let found = of(&Cards::of(OURS), [4096, 4096], &[]);
    assert_eq!(number(&found, "telescope.plate_scale_arcsec"), 0.7243);
    assert_eq!((number(&found, "detector.bias_adu"), number(&found, "detector.read_noise_e")), (300.0, 10.0));
    let open = found.iter().filter(|e| e.origin == Origin::FillIn).map(|e| e.key).collect::<Vec<_>>();
    assert_eq!(open, ["station.name", "detector.qe"]);
}

/// 900 e- of sky over a bias of 1000 adu, gain and read noise known: the bias within 10 adu, four standard deviations of the scatter of
/// 260 000 differences. A gradient of 20 adu across the frame counts as sky.
#[test]
fn the_bias_follows_from_the_scatter() {
    let address = Address { seed: 5, frame: 0, stage: Stage::Shot };
    let (width, height, gain) = (512usize, 512usize, 1.5);
    let mut electrons = (0..width * height)
        .map(|k| poisson(&address, k as u64, 885.0 + 30.0 * (k % width) as f64 / width as f64))
        .collect::<Vec<_>>();
    add_normal(&Address { stage: Stage::Read, ..address }, 0, 10.0, &mut electrons);
    let data = electrons.iter().map(|e| (e / gain + 1000.0).round() as f32).collect::<Vec<_>>();
    let header = Cards::of("EGAIN = 1.5\nRDNOISE = 10.0\nBITPIX = 16\nBZERO = 32768");
    let found = of(&header, [width, height], &data);
    assert_eq!(value(&found, "detector.bias_adu").origin, Origin::Pixels);
    let bias = number(&found, "detector.bias_adu");
    assert!((bias - 1000.0).abs() < 10.0, "{bias}");
    // without the read noise a usual one is assumed, no more than the scatter of 31.6 e- allows
    let assumed = of(&header.without(&["RDNOISE"]), [width, height], &data);
    let read = value(&assumed, "detector.read_noise_e");
    assert_eq!((read.origin, number(&assumed, "detector.read_noise_e")), (Origin::Assumed, 10.0));
    assert!(read.why.contains("31.") || read.why.contains("32."), "{}", read.why);
}

/// Nothing, pixels that are no numbers, and values beyond all bounds still give a station that a scene can use.
#[test]
fn headers_of_nothing_and_of_nonsense() {
    let wild = "EGAIN = 1e300\nXPIXSZ = 1e300\nFOCALLEN = 1e-300\nAPTDIA = -5\nAPTAREA = 1e300\nDARKCUR = -1\nXBINNING = 64\nCCD-TEMP = 1e9
SATURATE = 1e300\nBIASLVL = -1e300\nSITELAT = 1e9\nSITELONG = 0\nPIXSCALE = 1e-300\nFILTER = '\"x\\'\nTELESCOP = '\"\\'\nSEEING = 1e300\nAIRMASS = 1e300";
    for (cards, size, data) in [
        ("", [0, 0], vec![]),
        ("", [16, 16], vec![f32::NAN; 256]),
        ("", [16, 16], vec![f32::MAX; 256]),
        ("", [4, 4], vec![1.0; 16]),
        (wild, [70_000, 1], vec![0.0; 70_000]),
    ] {
        let text = to_toml(&of(&Cards::of(cards), size, &data), "odd");
        assert!(check(&text).is_ok(), "{}\n{text}", check(&text).unwrap_err());
    }
}
