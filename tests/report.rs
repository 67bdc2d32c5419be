//! The page report.html: complete, escaped, small, and true to the files it is made from, whatever these hold.

use nightglass::io::fits::{Pixels, write};
use nightglass::io::header::Header;
use nightglass::study::report::{LARGEST, ReportError, report};
use serde_json::Value as Json;
use std::fs;
use std::path::Path;
use std::process::Output;

/// Three targets in frames of 300 x 260 pixels, one with a name made to break pages.
const SCENE: &str = r#"
schema_version = 1
name = "<b>three & \"more\"</b>"
[station]
preset = "pogs"
[detector]
size_px = [300, 260]
[stars]
synthetic = false
[exposures]
start = 2018-01-20T04:00:00Z
count = 3
cadence_s = 60.0
duration_s = 2.0
[[target]]
name = "</script><script>alert('x')</script>"
brightness.mag_v = 11.0
orbit.fixed = { ra_deg = 80.0, dec_deg = 5.0, range_km = 38000.0 }
[[target]]
name = "Ünïcødé ☄ \u2028 \"quoted\""
brightness.mag_v = 12.0
orbit.fixed = { ra_deg = 80.01, dec_deg = 5.01, range_km = 38000.0 }
[[target]]
name = "25544"
brightness.mag_v = 13.0
orbit.fixed = { ra_deg = 79.99, dec_deg = 4.99, range_km = 38000.0 }
"#;

fn nightglass(dir: &Path, arguments: &[&str]) -> Output {
    let mut command = assert_cmd::Command::cargo_bin("nightglass").expect("the program");
    command.current_dir(dir).args(arguments).output().expect("it runs")
}

fn done(dir: &Path, arguments: &[&str]) -> String {
    let output = nightglass(dir, arguments);
    let words = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{arguments:?}: {words}");
    words
}

/// The page of a directory, checked for what holds of every page.
fn page(dir: &Path) -> String {
    let html = report(dir).expect("a report").html;
    assert!(html.len() < LARGEST, "{} bytes", html.len());
    assert!(html.starts_with("<!doctype html>") && html.trim_end().ends_with("</html>"));
    // nothing left to fill in, nothing fetched
    assert!(!html.contains("{{") && !html.contains("<link") && !html.contains("@import"));
    for attribute in ["src=\"", "href=\""] {
        for (at, _) in html.match_indices(attribute) {
            let value = &html[at + attribute.len()..][..8];
            assert!(value.starts_with("data:") || value.starts_with('#'), "{attribute}{value}");
        }
    }
    for section in ["summary", "plan", "frames", "sky", "curve", "shape", "studies", "provenance"] {
        assert!(html.contains(&format!("<section id=\"{section}\"")), "{section}");
    }
    assert_eq!(html.matches("<script").count(), 2, "the data and the program");
    data(&html);
    html
}

fn data(html: &str) -> Json {
    let rest = html.split("id=\"data\">").nth(1).expect("the data");
    serde_json::from_str(rest.split("</script>").next().expect("their end")).expect("JSON")
}

/// Cells of a column of an ECSV table.
fn column(path: &Path, name: &str) -> Vec<String> {
    let text = fs::read_to_string(path).expect("a table");
    let mut lines = text.lines().filter(|l| !l.starts_with('#'));
    let at = lines.next().and_then(|l| l.split(' ').position(|n| n == name)).expect("the column");
    // quoted cells, none of which holds a blank before the columns asked for here
    lines.map(|l| l.split(' ').nth(at).expect("a cell").to_owned()).collect()
}

#[test]
fn the_page_of_a_run_holds_the_numbers_of_its_files_and_escapes_its_names() {
    let folder = tempfile::tempdir().expect("a folder");
    let dir = folder.path();
    fs::write(dir.join("s.toml"), SCENE).expect("written");
    let said = done(dir, &["run", "s.toml", "-o", "out", "--set", "output.star_table=true"]);
    assert!(said.lines().any(|l| l == "report: out/report.html"), "{said}");
    let out = dir.join("out");
    let html = page(&out);
    assert_eq!(
        fs::read_to_string(out.join("report.html")).expect("the page"),
        html,
        "the same from the same files"
    );
    assert!(!html.contains("<script>alert") && !html.contains("<b>three"));
    assert!(html.contains("&lt;/script&gt;&lt;script&gt;alert('x')&lt;/script&gt;") && html.contains("Ünïcødé ☄"));

    let held = data(&html);
    let names = ["time_utc", "mjd_utc"];
    for name in names {
        let own = held["curve"][name].as_array().expect("a column");
        let text =
            |v: &Json| v.as_str().map_or_else(|| format!("{:?}", v.as_f64().expect("a number")), str::to_owned);
        assert_eq!(own.iter().map(text).collect::<Vec<_>>(), column(&out.join("lightcurve.ecsv"), name), "{name}");
    }
    assert_eq!(held["curve"]["target"][2], "25544");
    assert_eq!(held["truth"]["electrons"].as_array().map(Vec::len), Some(9));
    let ledger = fs::read_to_string(out.join("ledger.json")).expect("the ledger");
    let ledger: Json = serde_json::from_str(&ledger).expect("JSON");
    for row in ledger["rows"].as_array().expect("rows").iter().filter(|r| r["mean_e_px"].as_f64() > Some(0.0)) {
        assert!(html.contains(&format!("<data value=\"{}\">", row["mean_e_px"])), "{row}");
    }
    let sha = nightglass::scene::load(&out.join("scene.toml").display().to_string(), &Default::default());
    assert!(html.contains(&sha.expect("the scene").sha256()));

    // three frames, three cut-outs in each, pixels as in the files
    let frames = held["frames"].as_array().expect("frames");
    assert_eq!(frames.len(), 3);
    let image = nightglass::io::image::Image::read(&out.join("frames/0001.fits")).expect("a frame");
    assert_eq!(frames[1]["cuts"].as_array().map(Vec::len), Some(3));
    for cut in frames[1]["cuts"].as_array().expect("cut-outs") {
        use base64::Engine;
        let bytes =
            base64::engine::general_purpose::STANDARD.decode(cut["data"].as_str().expect("text")).expect("base64");
        let [x0, y0, width] = ["x0", "y0", "width"].map(|k| cut[k].as_u64().expect("a number") as usize);
        for (i, b) in bytes.chunks(2).enumerate() {
            let own = f32::from(u16::from_le_bytes([b[0], b[1]]));
            assert_eq!(own, image.data[(y0 + i / width) * image.width + x0 + i % width]);
        }
    }
    assert_eq!(frames[0]["origin"], "the star table");

    // other forms of the same frames, and a page made elsewhere
    done(
        dir,
        &[
            "run",
            "s.toml",
            "-o",
            "fz",
            "-q",
            "--set",
            "output.format=[\"fits.fz\"]",
            "--set",
            "output.crop=\"target\"",
            "--set",
            "output.crop_px=64",
        ],
    );
    let packed = data(&page(&dir.join("fz")));
    assert_eq!(packed["frames"][0]["width"], 64);
    assert!(packed["frames"][0]["x0"].as_f64().is_some_and(|x| x > 0.0));
    done(dir, &["report", "fz", "-o", "elsewhere", "-q"]);
    assert!(dir.join("elsewhere/report.html").is_file());
}

#[test]
fn reports_are_left_out_or_replaced_as_asked() {
    let folder = tempfile::tempdir().expect("a folder");
    let dir = folder.path();
    fs::write(dir.join("s.toml"), SCENE).expect("written");
    let one = ["run", "s.toml", "-o", "out", "-q", "--set", "exposures.count=1"];
    done(dir, &[&one[..], &["--set", "output.report=false"]].concat());
    assert!(!dir.join("out/report.html").exists());
    done(dir, &one);
    assert!(dir.join("out/report.html").is_file(), "a run taken up again ends with its report");
    done(dir, &[&one[..], &["--seed", "5", "--force", "--set", "output.report=false"]].concat());
    assert!(!dir.join("out/report.html").exists(), "the page of another scene is gone");
    for (bad, word) in [("none", "not a directory"), ("empty", "holds no")] {
        fs::create_dir_all(dir.join("empty")).expect("a folder");
        let output = nightglass(dir, &["report", bad]);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains(word) && said.contains("nightglass run"), "{said}");
    }
}

const HEAD: &str = "# %ECSV 1.0\n# ---\n# datatype:\n# - {name: frame, datatype: int64}\n# - {name: time_utc, datatype: string}\n\
# - {name: mjd_utc, unit: d, datatype: float64}\n# - {name: target, datatype: string}\n# - {name: x_px, datatype: float64}\n\
# - {name: y_px, datatype: float64}\n# - {name: flux_e, datatype: float64}\n# - {name: flux_err_e, datatype: float64}\n\
# - {name: mag_v, datatype: float64}\n# - {name: mag_err, datatype: float64}\n# - {name: flags, datatype: int64}\n# schema: astropy-2.0\n\
frame time_utc mjd_utc target x_px y_px flux_e flux_err_e mag_v mag_err flags\n";

#[test]
fn extreme_directories_have_sensible_pages() {
    let folder = tempfile::tempdir().expect("a folder");
    let dir = folder.path();
    let give = |name: &str, text: &str| fs::write(dir.join(name), text).expect("written");

    // nothing but a light curve without a number
    give(
        "lightcurve.ecsv",
        &format!(
            "{HEAD}0 2020-01-01T00:00:00.0 58849.0 a nan nan nan nan nan nan 192\n1 x nan Inf nan nan nan nan nan nan 0\n"
        ),
    );
    let html = page(dir);
    assert!(
        html.contains("no calibrated magnitude") && html.contains("1 borrowed zero point, 1 not detected"),
        "flags in words"
    );
    assert!(html.contains("Observations") && html.contains("No frame lies in frames/."));
    assert!(
        html.contains("nightglass accuracy")
            && html.contains("nightglass snr")
            && html.contains("nightglass invert")
    );

    // an empty one, and files that are no such files
    give("lightcurve.ecsv", HEAD);
    for name in [
        "plan.ecsv",
        "truth.ecsv",
        "accuracy.ecsv",
        "snr.ecsv",
        "ledger.json",
        "shape.json",
        "shape.obj",
        "scene.toml",
    ] {
        give(name, "# %ECSV 1.0\n\u{0}{<x>\n\"");
    }
    let html = page(dir);
    for name in ["plan.ecsv", "truth.ecsv", "accuracy.ecsv", "snr.ecsv", "ledger.json", "shape.json", "shape.obj"]
    {
        assert!(html.contains(&format!("{name} is left out: ")), "{name}");
    }
    for name in [
        "plan.ecsv",
        "truth.ecsv",
        "accuracy.ecsv",
        "snr.ecsv",
        "ledger.json",
        "shape.json",
        "shape.obj",
        "scene.toml",
    ] {
        fs::remove_file(dir.join(name)).expect("removed");
    }

    // frames of any origin: bare headers, other numbers, broken ones
    fs::create_dir_all(dir.join("frames")).expect("a folder");
    let frame = |name: &str, width: usize, height: usize, pixels: &[f32]| {
        write(&dir.join("frames").join(name), width, height, Pixels::F32(pixels), &Header::default())
            .expect("written");
    };
    frame("0000.fits", 1, 1, &[f32::NAN]);
    frame("0001.fits", 3, 2, &[-1e30, 1e30, f32::INFINITY, 0.5, 2.5, -7.0]);
    frame("night.fits", 40, 2, &[0.0; 80]);
    fs::write(dir.join("frames/0002.fits"), "SIMPLE  = no").expect("written");
    let html = page(dir);
    assert!(html.contains("frames/0002.fits is left out"), "a broken frame is told");
    assert_eq!(data(&html)["frames"].as_array().map(Vec::len), Some(3));

    assert!(matches!(report(Path::new("/nowhere/at/all")), Err(ReportError::NoDirectory(_))));
}

/// Twelve of 200 frames of noise that no compression makes smaller, each 1100 pixels wide, a light curve of 20 000 points of two
/// targets and a mesh of 20 000 facets stay below 5 MB.
#[test]
fn large_runs_have_small_pages() {
    let folder = tempfile::tempdir().expect("a folder");
    let dir = folder.path();
    fs::create_dir_all(dir.join("frames")).expect("a folder");
    let side = 1100;
    let mut state = 1u64;
    let mut noise = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 48) as u16
    };
    let large = (0..side * side).map(|_| noise()).collect::<Vec<_>>();
    let first = dir.join("frames/0000.fits");
    write(&first, side, side, Pixels::U16(&large), &Header::default()).expect("written");
    for k in 1..200 {
        fs::hard_link(&first, dir.join(format!("frames/{k:04}.fits"))).expect("linked");
    }
    let mut curve = HEAD.to_owned();
    for k in 0..20_000 {
        let at = 58849.0 + f64::from(k) / 7e4;
        curve += &format!(
            "{} 2020-01-01T00:00:00.123456 {at:?} {} 500.123456789 500.123456789 12345.678901234567 12.345678901234567 11.123456789012345 0.0012345678901234 0\n",
            k / 2,
            ["one", "two"][k as usize % 2]
        );
    }
    fs::write(dir.join("lightcurve.ecsv"), curve).expect("written");
    let mut mesh = String::new();
    for k in 0..20_000 {
        let (a, r) = (f64::from(k) * 0.37, 1.0 + f64::from(k % 7));
        mesh += &format!(
            "v {:?} {:?} {:?}\nv {r:?} {a:?} 1.5\nv 0.1 {r:?} {a:?}\nf -1 -2 -3\n",
            a.sin() * r,
            a.cos() * r,
            a / 900.0
        );
    }
    fs::write(dir.join("shape.obj"), mesh).expect("written");
    fs::write(dir.join("scene.toml"), "# é\n".repeat(200_000)).expect("written");
    let html = page(dir);
    assert!(html.len() > 1_000_000, "{} bytes: the pictures are there", html.len());
    assert!(html.contains("12 of 200 frames, evenly chosen."));
    let held = data(&html);
    assert_eq!(held["frames"].as_array().map(Vec::len), Some(12));
    assert_eq!(held["frames"][11]["number"], 199);
    let targets = held["curve"]["target"].as_array().expect("targets");
    let of = |name: &str| targets.iter().filter(|t| *t == name).count();
    assert_eq!((of("one"), of("two")), (1500, 1500));
}
