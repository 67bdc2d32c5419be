//! `nightglass photometry` as a user meets it: pictures, world coordinates lent by neighbours, files that are broken.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

fn nightglass(dir: &Path, arguments: &[&str]) -> Output {
    let mut command = assert_cmd::Command::cargo_bin("nightglass").expect("the program");
    command.current_dir(dir).args(arguments).output().expect("it runs")
}

fn words(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned() + &String::from_utf8_lossy(&output.stdout)
}

/// Two frames of the built-in night.
fn frames(dir: &Path, size: &str) -> Vec<PathBuf> {
    let size = format!("detector.size_px={size}");
    let output = nightglass(dir, &["render", "pogs-geo", "--frames", "0..2", "-o", "night", "-q", "--set", &size]);
    assert!(output.status.success(), "{}", words(&output));
    ["night/frames/0000.fits", "night/frames/0001.fits"].map(|f| dir.join(f)).to_vec()
}

#[test]
fn a_picture_of_each_measurement_is_drawn_on_request() {
    let folder = tempfile::tempdir().expect("a folder");
    let dir = folder.path();
    frames(dir, "512");
    let measure = ["photometry", "night/frames/0000.fits", "night/frames/0001.fits"];
    let output = nightglass(dir, &[&measure[..], &["-o", "out", "--finder", "-q"]].concat());
    assert!(output.status.success(), "{}", words(&output));
    for name in ["0000.png", "0001.png"] {
        let bytes = fs::read(dir.join("out/finder").join(name)).expect("a picture");
        assert_eq!(&bytes[1..4], b"PNG");
    }
    assert!(!nightglass(dir, &[&measure[..], &["--finder"]].concat()).status.success());
}

#[test]
fn broken_files_are_named_with_exit_code_2() {
    let folder = tempfile::tempdir().expect("a folder");
    let dir = folder.path();
    let whole = fs::read(&frames(dir, "256")[0]).expect("a frame");
    for (name, bytes) in [
        ("half.fits", &whole[..whole.len() / 2]),
        ("head.fits", &whole[..2880]),
        ("empty.fits", &[][..]),
        ("text.fits", b"no frame"),
    ] {
        fs::write(dir.join(name), bytes).expect("written");
        let output = nightglass(dir, &["photometry", name]);
        assert_eq!(output.status.code(), Some(2), "{name}: {}", words(&output));
        assert!(words(&output).contains(name), "{name}: {}", words(&output));
    }
}

/// Pointings of both frames 0.1 deg off in the header. One is whole and finds itself by its stars; of the other's only a corner with too few
/// stars is left, which takes the neighbour's correction and so has its target within 2 px of the truth.
#[test]
fn a_frame_without_stars_borrows_its_world_coordinates() {
    let folder = tempfile::tempdir().expect("a folder");
    let dir = folder.path();
    let sets = ["--set", "exposures.cadence_s=10"];
    let crop = ["render", "pogs-geo", "--frames", "0", "-o", "few", "-q", "--crop", "1960,1960,180,180"];
    let all = ["render", "pogs-geo", "--frames", "1", "-o", "many", "-q"];
    for arguments in [&crop[..], &all[..]] {
        let output = nightglass(dir, &[arguments, &sets[..]].concat());
        assert!(output.status.success(), "{}", words(&output));
    }
    let (mut files, mut radec) = (Vec::new(), String::new());
    for name in ["few/frames/0000.fits", "many/frames/0001.fits"] {
        let mut bytes = fs::read(dir.join(name)).expect("a frame");
        if radec.is_empty() {
            radec = format!("{},{}", number(&bytes, "RA      "), number(&bytes, "DEC     "));
        }
        shift(&mut bytes, "CRVAL2", 0.1);
        fs::write(dir.join(name), &bytes).expect("written");
        files.push(name);
    }
    let output = nightglass(dir, &[&["photometry", "-v", "--radec", &radec][..], &files].concat());
    assert!(output.status.success(), "{}", words(&output));
    let told = words(&output);
    assert!(told.contains("borrowed from many/frames/0001.fits"), "{told}");
    let row = told.lines().find(|l| l.starts_with("0 2018")).expect("a row");
    let place = |k: usize| row.split_whitespace().nth(k).and_then(|v| v.parse::<f64>().ok()).expect("a number");
    let columns = told.lines().find(|l| l.starts_with("frame time_utc")).expect("a header");
    let column = |name: &str| columns.split_whitespace().position(|c| c == name).expect("a column");
    let truth = fs::read_to_string(dir.join("few/truth.ecsv")).expect("the truth");
    let line = truth.lines().find(|l| l.starts_with("0 2018")).expect("a row");
    let names = truth.lines().find(|l| l.starts_with("frame time_utc")).expect("a header");
    let at = |name: &str| {
        let k = names.split_whitespace().position(|c| c == name).expect("a column");
        // names of targets hold a space
        let shift = usize::from(line.contains("\"GOES 14\"") && k > 2);
        line.split_whitespace().nth(k + shift).and_then(|v| v.parse::<f64>().ok()).expect("a number")
    };
    let own = |name: &str| place(column(name) + usize::from(row.contains("\"GOES 14\"") && column(name) > 4));
    let off = (own("x_px") - at("x_px")).hypot(own("y_px") - at("y_px"));
    assert!(off < 2.0, "{off} px");
}

/// Where a card of a FITS header starts.
fn card(bytes: &[u8], keyword: &str) -> usize {
    bytes.chunks(80).position(|card| card.starts_with(keyword.as_bytes())).expect("the card") * 80
}

/// A number in a FITS header.
fn number(bytes: &[u8], keyword: &str) -> f64 {
    let start = card(bytes, keyword);
    String::from_utf8_lossy(&bytes[start + 10..start + 30]).trim().parse().expect("a number")
}

/// Adds to a number in a FITS header.
fn shift(bytes: &mut [u8], keyword: &str, by: f64) {
    let start = card(bytes, keyword);
    let text = format!("{keyword:8}= {:>20.12}", number(bytes, keyword) + by);
    bytes[start..start + 30].copy_from_slice(text.as_bytes());
}
