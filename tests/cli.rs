//! The command line: streams, exit codes, faults.

use serde_json::Value;
use std::process::Output;

fn nightglass(arguments: &[&str]) -> Output {
    let folder = tempfile::tempdir().expect("a folder");
    let mut command = assert_cmd::Command::cargo_bin("nightglass").expect("the program");
    command.current_dir(folder.path()).args(arguments).output().expect("it runs")
}

fn out(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn err(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn plan_goes_to_stdout_as_ecsv_and_as_json() {
    let ecsv = nightglass(&["plan", "pogs-geo"]);
    assert_eq!(ecsv.status.code(), Some(0));
    let text = out(&ecsv);
    assert!(text.starts_with("# %ECSV 1.0\n"));
    assert_eq!(text.lines().filter(|l| !l.starts_with('#')).count(), 13);
    let json: Value = serde_json::from_str(&out(&nightglass(&["plan", "pogs-geo", "--json"]))).expect("JSON");
    assert_eq!(json["command"], "plan");
    let first = &json["rows"][0];
    // GOES 14 as its elements of January 2018 place it: 52 deg high, south of the station
    assert!((first["el_deg"].as_f64().expect("a number") - 52.0).abs() < 1.0);
    assert!((first["az_deg"].as_f64().expect("a number") - 178.0).abs() < 4.0);
}

#[test]
fn explain_tells_what_is_absent_and_why() {
    let json: Value = serde_json::from_str(&out(&nightglass(&["explain", "pogs-geo", "--json"]))).expect("JSON");
    let row = |name: &str| {
        json["rows"].as_array().expect("rows").iter().find(|r| r["name"] == name).cloned().expect("the row")
    };
    assert_eq!(row("sky.twilight")["verdict"], "absent");
    assert!(row("sky.twilight")["why"].as_str().expect("text").contains("below the horizon"));
    assert_eq!(row("sky.airglow")["verdict"], "needed");
    assert!(row("sky.airglow")["mean_e_px"].as_f64().expect("a number") > 0.1);
    assert_eq!(json["dominant_noise"], "read noise");
    assert!(json["cost"]["total_s"].as_f64().expect("a number") > 0.0);
    assert!(out(&nightglass(&["explain", "pogs-geo"])).contains("dominant noise: read noise"));
}

#[test]
fn all_faults_of_a_scene_are_told_at_once_with_exit_code_2() {
    let broken = nightglass(&[
        "check",
        "pogs-geo",
        "--set",
        "detector.gian_e_per_adu=2.0",
        "--set",
        "station.latitude_deg=95.0",
        "--set",
        "exposures.count=many",
    ]);
    assert_eq!(broken.status.code(), Some(2));
    let text = err(&broken);
    for part in ["gain_e_per_adu", "station.latitude_deg", "95", "-90", "exposures.count", "many"] {
        assert!(text.contains(part), "{part} in {text}");
    }
    assert_eq!(nightglass(&["check", "pogs-geo"]).status.code(), Some(0));
}

#[test]
fn bad_usage_is_exit_code_2_and_names_the_range() {
    for (arguments, part) in [
        (&["frobnicate"][..], "frobnicate"),
        (&["plan"], "SCENE"),
        (&["plan", "no-such-scene"], "no-such-scene"),
        (&["render", "pogs-geo", "-o", "x", "--frames", "40..50"], "0..12"),
        (&["render", "pogs-geo", "-o", "x", "--crop", "5000,0,1,1"], "4096"),
        (&["run", "pogs-geo", "--threads", "0"], "threads"),
        (&["plan", "pogs-geo", "--set", "nonsense"], "KEY=VALUE"),
        (&["photometry", "nowhere.fits", "--xy", "1,nan"], "finite"),
    ] {
        let output = nightglass(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", err(&output));
        assert!(err(&output).contains(part), "{arguments:?}: {}", err(&output));
    }
    assert_eq!(nightglass(&["photometry", "nowhere.fits"]).status.code(), Some(2));
}

#[test]
fn templates_and_lists_are_usable() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("mine.toml");
    let path = path.to_str().expect("a path");
    assert_eq!(nightglass(&["init", "pogs-geo", "-o", path]).status.code(), Some(0));
    assert_eq!(nightglass(&["init", "pogs-geo", "-o", path]).status.code(), Some(2));
    assert_eq!(nightglass(&["check", path]).status.code(), Some(0));
    let schema: Value = serde_json::from_str(&out(&nightglass(&["schema"]))).expect("JSON");
    assert!(schema["properties"]["station"].is_object());
    assert!(out(&nightglass(&["scenes"])).contains("pogs-geo"));
    assert!(out(&nightglass(&["stations"])).contains("pogs"));
    assert!(out(&nightglass(&["catalog", "info"])).contains("1871011 stars"));
    assert!(out(&nightglass(&["completions", "bash"])).contains("nightglass"));
}

#[test]
fn a_frame_below_the_horizon_is_planned_but_not_rendered() {
    let output = nightglass(&[
        "render",
        "pogs-geo",
        "-o",
        "out",
        "--set",
        "target.0.orbit.fixed={ra_deg=0.0, dec_deg=-80.0}",
        "--set",
        "exposures.count=1",
        "--set",
        "detector.size_px=64",
    ]);
    assert_eq!(output.status.code(), Some(0), "{}", err(&output));
    assert!(err(&output).contains("below the horizon"), "{}", err(&output));
}
