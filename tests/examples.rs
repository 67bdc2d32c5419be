//! Every scene in `examples/` and every built-in scene and station is used as a user would.

use std::path::Path;

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
        nightglass(folder.path(), &["explain", scene, "--json"]);
        nightglass(folder.path(), &["run", scene, "--frames", "0", "--crop", "0,0,600,600"]);
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
