//! Every scene in `examples/` and every built-in scene and station is used as a user would.

use std::path::Path;

#[path = "../examples/error_vs_time.rs"]
#[expect(dead_code, reason = "its main reads the command line")]
mod error_vs_time;
#[path = "../examples/gaia_import.rs"]
#[expect(dead_code, reason = "its main reads the command line")]
mod gaia_import;
#[path = "../examples/snr_vs_moon.rs"]
#[expect(dead_code, reason = "its main reads the command line")]
mod snr_vs_moon;

/// The programs of the gallery tell what they promise, and their charts are charts.
#[test]
fn programs_of_the_gallery_run() {
    let folder = tempfile::tempdir().expect("a folder");
    let charts = [folder.path().join("moon.svg"), folder.path().join("time.svg")];
    snr_vs_moon::run(Some(&charts[0])).expect("nights");
    error_vs_time::run(Some(&charts[1])).expect("rows");
    gaia_import::run(None, [60.0, 50.0]).expect("a frame");
    for chart in charts {
        assert!(std::fs::read_to_string(&chart).is_ok_and(|text| text.contains("<svg")), "{}", chart.display());
    }
}

fn nightglass(dir: &Path, arguments: &[&str]) {
    let mut command = assert_cmd::Command::cargo_bin("nightglass").expect("the program");
    let output = command.current_dir(dir).args(arguments).output().expect("it runs");
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn scenes_in_the_examples_run() {
    let folder = tempfile::tempdir().expect("a folder");
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let folders = [examples.join("bench"), examples];
    let scenes = folders.iter().flat_map(|f| std::fs::read_dir(f).expect("examples").flatten().map(|e| e.path()));
    let scenes = scenes.filter(|p| p.extension().is_some_and(|e| e == "toml")).collect::<Vec<_>>();
    assert!(scenes.len() >= 2);
    for scene in scenes {
        let scene = scene.to_str().expect("a path");
        // a small chip: some of the scenes take a minute
        let small = ["--set", "exposures.count=1", "--set", "detector.size_px=600"];
        nightglass(folder.path(), &[&["explain", scene, "--json"][..], &small].concat());
        nightglass(folder.path(), &[&["run", scene][..], &small].concat());
    }
}

#[test]
fn every_built_in_station_makes_a_frame() {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, _) in nightglass::scene::STATIONS {
        let preset = format!("station.preset={name}");
        let sets = ["--set", &preset, "--set", "detector.size_px=64", "--frames", "0", "-o", name];
        nightglass(folder.path(), &[&["render", "pogs-geo"][..], &sets[..]].concat());
        let calibration = ["calibrate", name, "--count", "1", "--set", "detector.size_px=64"];
        nightglass(folder.path(), &calibration);
        for kind in ["bias", "dark", "flat"] {
            let file = folder.path().join(format!("out/calibration-{name}/{kind}_0000.fits"));
            assert!(file.is_file(), "{}", file.display());
        }
    }
}
