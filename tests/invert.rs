//! From a scene to a light curve to a shape, as a user goes.

use std::fs;
use std::path::Path;
use std::process::Output;

const SCENE: &str = r#"
schema_version = 1
name = "tumbling-box"
[station]
preset = "pogs"
[exposures]
start = 2018-01-20T03:00:00Z
count = 160
cadence_s = 140.0
duration_s = 0.0
[[target]]
name = "GOES 14"
shape = "box"
[target.orbit]
tle = ["1 35491U 09033A   18019.95817924 -.00000090  00000-0  00000-0 0  9991",
       "2 35491   0.0698 263.4367 0009544 339.3413 117.1094  1.00271818 31371"]
[target.attitude]
mode = "tumble"
inertia_kg_m2 = [900.0, 11000.0, 10800.0]
rate_deg_s = [0.12, 0.05, 0.1]
[target.material]
brdf = "lambert"
diffuse = 0.3
"#;

fn nightglass(dir: &Path, arguments: &[&str]) -> Output {
    let mut command = assert_cmd::Command::cargo_bin("nightglass").expect("the program");
    command.current_dir(dir).args(arguments).output().expect("it runs")
}

fn done(dir: &Path, arguments: &[&str]) -> String {
    let output = nightglass(dir, arguments);
    let words = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{arguments:?}: {words}");
    words + &String::from_utf8_lossy(&output.stdout)
}

/// A cube of 1 m comes back from its computed light, attitude and albedo from the scene or from the curve's own metadata: in common with
/// the true one 0.999 of their volume (the curve is exact to 1e-4).
#[test]
fn a_tumbling_box_comes_back_from_its_light() {
    let folder = tempfile::tempdir().expect("a folder");
    let dir = folder.path();
    fs::write(dir.join("box.toml"), SCENE).expect("written");
    done(dir, &["lightcurve", "box.toml", "-o", "light", "-q"]);
    let said = done(dir, &["invert", "light/lightcurve.ecsv", "--scene", "box.toml", "-o", "shape"]);
    assert!(said.contains("6 of 6 facets are claimed"), "{said}");
    let text = fs::read_to_string(dir.join("shape/shape.json")).expect("shape.json");
    let shape: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(shape["convex"], true);
    assert_eq!(shape["facets"].as_array().map(Vec::len), Some(6));
    assert!(shape["errors"]["iou"].as_f64().is_some_and(|v| v > 0.999), "{}", shape["errors"]);
    assert!(shape["unobserved_fraction"].as_f64().is_some_and(|v| v < 0.2), "{text}");
    for name in ["shape.obj", "shape.mtl", "shape.svg", "fit.svg", "image.svg"] {
        assert!(dir.join("shape").join(name).is_file(), "{name}");
    }
    // the mesh is one that scenes take
    done(dir, &["shape", "shape/shape.obj"]);
    let said = done(dir, &["invert", "light/lightcurve.ecsv", "-o", "own"]);
    assert!(said.contains("attitude: from the curve's metadata"), "{said}");
    assert_eq!(fs::read(dir.join("own/shape.obj")).ok(), fs::read(dir.join("shape/shape.obj")).ok());
}

#[test]
fn curves_that_cannot_be_inverted_are_refused_with_a_reason() {
    let folder = tempfile::tempdir().expect("a folder");
    let dir = folder.path();
    fs::write(dir.join("box.toml"), SCENE).expect("written");
    done(dir, &["lightcurve", "box.toml", "-o", "light", "-q", "--set", "exposures.count=4"]);
    let curve = fs::read_to_string(dir.join("light/lightcurve.ecsv")).expect("a curve");
    fs::write(dir.join("dark.ecsv"), curve.replace("sun_x", "moon_x")).expect("written");
    for (arguments, word) in [(vec!["invert", "none.ecsv"], "none.ecsv"), (vec!["invert", "dark.ecsv"], "Sun")] {
        let output = nightglass(dir, &arguments);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(2) && said.contains(word), "{arguments:?}: {said}");
    }
}
