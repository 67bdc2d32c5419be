//! From a scene to a light curve to a shape, as a user goes.

use glam::{DMat3, DQuat, DVec3};
use nightglass::inversion::pole::body_axes;
use nightglass::inversion::synthetic::{Stream, cuboid, directions, fixed_phase, noisy, random_body};
use nightglass::inversion::tumble::Motion;
use nightglass::object::convex::{Epochs, Facet};
use nightglass::object::matter::{Material, Model};
use serde_json::Value as Json;
use std::fmt::Write;
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

type Directions = Vec<(DVec3, DVec3)>;

/// A light curve as a file: seconds from MJD 58000, fluxes with errors, directions to Sun and observer. From 1 m away, at the zero point
/// of the Sun: fluxes are normalised irradiances but for the square of the Sun's distance in au, 1.01.
fn csv(seconds: &[f64], y: &[f64], sigma: &[f64], directions: &Directions) -> String {
    let head =
        "mjd_utc,target,flux_e,flux_err_e,zeropoint_mag,range_km,sun_x,sun_y,sun_z,obs_x,obs_y,obs_z,flags\n";
    let mut text = head.to_owned();
    for (((t, y), sigma), (s, o)) in seconds.iter().zip(y).zip(sigma).zip(directions) {
        let mjd = 58_000.0 + t / 86_400.0;
        let _ = writeln!(
            text,
            "{mjd:.12},box,{y},{sigma},-26.76,0.001,{},{},{},{},{},{},0",
            s.x, s.y, s.z, o.x, o.y, o.z
        );
    }
    text
}

fn light(body: &[Facet], material: &Material, directions: &Directions) -> Vec<f64> {
    Epochs::new(directions.clone()).curve(body, material, 0.0)
}

fn steps(count: usize) -> Vec<f64> {
    (0..count).map(|k| 60.0 * k as f64).collect()
}

/// A box 1:2:3 of Lambert's law in 300 random directions, as a file.
fn box_curve(snr: f64, seed: u64) -> String {
    let mut stream = Stream::new(seed);
    let directions = directions(300, &mut stream);
    let clean = light(&cuboid(DVec3::new(1.0, 2.0, 3.0)), &Material::lambert(1.0), &directions);
    let (y, sigma) = noisy(&clean, snr, &mut stream);
    csv(&steps(300), &y, &sigma, &directions)
}

/// What `shape.json` would hold, and what is said.
fn inverted(dir: &Path, arguments: &[&str]) -> (Json, String) {
    let output = nightglass(dir, &[&["invert"], arguments].concat());
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{arguments:?}: {said}");
    (serde_json::from_slice(&output.stdout).expect("JSON"), said)
}

fn claimed(shape: &Json) -> usize {
    shape["facets"].as_array().map_or(0, |all| all.iter().filter(|f| f["claimed"] == true).count())
}

fn number(value: &Json) -> f64 {
    value.as_f64().unwrap_or(f64::NAN)
}

/// Little's, Ikeuchi's and Nicolet's bodies of a box at SNR 100 converge and have its facets; the fixed angle claims none of its own. Each says
/// what it is.
#[test]
fn older_methods_are_there_by_name() {
    let folder = tempfile::tempdir().expect("a folder");
    let dir = folder.path();
    fs::write(dir.join("box.csv"), box_curve(100.0, 3)).expect("written");
    for (model, method) in
        [("little", "Little"), ("ikeuchi", "Ikeuchi"), ("nicolet", "Nicolet"), ("draft", "Little")]
    {
        let (shape, said) = inverted(dir, &["box.csv", "--model", model, "--held-out", "0"]);
        assert_eq!(shape["model"], model);
        let body = &shape["body"];
        assert!(body["method"].as_str().is_some_and(|m| m.contains(method)), "{body}");
        assert!(body["converged"] == true && number(&body["area_residual"]) < 1e-4, "{model}: {body} {said}");
        assert_eq!(
            (shape["facets"].as_array().map(Vec::len), shape["convex"] == true),
            (Some(6), true),
            "{model}"
        );
        assert_eq!(claimed(&shape), if model == "draft" { 0 } else { 6 }, "{model}: {said}");
        assert!(shape["held_out_chi2_reduced"].is_null());
    }
}

/// Points held out are stretches of time, about the share asked for, and are explained as well as the others: 60 points have a chi-square
/// of 1 +- 0.18, four times that is allowed.
#[test]
fn stretches_are_held_out_and_marked() {
    let folder = tempfile::tempdir().expect("a folder");
    let dir = folder.path();
    fs::write(dir.join("box.csv"), box_curve(30.0, 4)).expect("written");
    done(dir, &["invert", "box.csv", "--held-out", "0.2", "-o", "shape", "-q"]);
    let shape: Json =
        serde_json::from_slice(&fs::read(dir.join("shape/shape.json")).expect("a shape")).expect("JSON");
    let runs = shape["held_out"]["stretches"].as_array().expect("stretches");
    let points = number(&shape["held_out"]["points"]);
    assert!((50.0..=70.0).contains(&points) && (3..=8).contains(&runs.len()), "{points} {runs:?}");
    assert!((number(&shape["held_out_chi2_reduced"]) - 1.0).abs() < 0.73, "{}", shape["held_out_chi2_reduced"]);
    assert!(fs::read_to_string(dir.join("shape/fit.svg")).expect("a picture").contains("held out of the fit"));
}

/// Spoilt, missing and dark points and a wild one are left out, each counted by its reason, and the box is still there.
#[test]
fn gaps_darkness_flags_and_outliers_are_counted() {
    let folder = tempfile::tempdir().expect("a folder");
    let dir = folder.path();
    let text = box_curve(50.0, 5);
    let change = |(k, line): (usize, &str)| {
        let mut cells = line.split(',').map(str::to_owned).collect::<Vec<_>>();
        match k {
            10..=14 => cells[2] = "nan".into(),
            20..=22 => cells[2] = "0".into(),
            30 | 31 => cells[12] = "1".into(),
            40 => cells[2] = "40".into(),
            50 => cells[3] = "nan".into(),
            _ => {}
        }
        cells.join(",") + "\n"
    };
    fs::write(dir.join("box.csv"), text.lines().enumerate().map(change).collect::<String>()).expect("written");
    let (shape, said) = inverted(dir, &["box.csv"]);
    let left_out = &shape["left_out"];
    let counts = ["gaps", "dark", "flagged", "outliers"].map(|k| number(&left_out[k]));
    assert_eq!(counts, [6.0, 3.0, 2.0, 1.0], "{left_out}");
    assert!(said.contains("outliers left out: 1") && said.contains("3 exactly dark"), "{said}");
    assert!(claimed(&shape) == 6 && number(&shape["chi2_reduced"]) < 1.5, "{said}");
}

/// A constant curve is a sphere's: no facet is claimed.
#[test]
fn a_constant_curve_claims_no_facet() {
    let folder = tempfile::tempdir().expect("a folder");
    let dir = folder.path();
    let mut stream = Stream::new(6);
    let directions = fixed_phase(200, 60f64.to_radians(), &mut stream);
    let (y, sigma) = noisy(&[0.5; 200], 30.0, &mut stream);
    fs::write(dir.join("sphere.csv"), csv(&steps(200), &y, &sigma, &directions)).expect("written");
    let (shape, said) = inverted(dir, &["sphere.csv", "--model", "convex"]);
    assert!(claimed(&shape) == 0 && said.contains("no facet is claimed"), "{said}");
}

/// Errors told three times too small make a chi-square of 9, three times too large 1/9; both are said. 300 points: within 30 %.
#[test]
fn wrong_errors_show_in_chi_square() {
    let folder = tempfile::tempdir().expect("a folder");
    let dir = folder.path();
    let text = box_curve(30.0, 7);
    for (factor, expected, word) in [(1.0 / 3.0, 9.0, "3.0 times too small"), (3.0, 1.0 / 9.0, "times too large")]
    {
        let change = |line: &str| {
            let mut cells = line.split(',').map(str::to_owned).collect::<Vec<_>>();
            if let Ok(sigma) = cells[3].parse::<f64>() {
                cells[3] = (sigma * factor).to_string();
            }
            cells.join(",") + "\n"
        };
        fs::write(dir.join("box.csv"), text.lines().map(change).collect::<String>()).expect("written");
        let (shape, said) = inverted(dir, &["box.csv", "--model", "convex", "--held-out", "0"]);
        let ratio = number(&shape["chi2_reduced"]) / expected;
        assert!((0.7..1.3).contains(&ratio), "{ratio} {said}");
        assert!(said.contains(word) || factor < 1.0 && said.contains("times too small"), "{said}");
    }
}

/// DAMIT's relative curves get a factor each: the second is five times the first here, to 1 % at SNR 100; a calibrated curve beside them sets the
/// level.
#[test]
fn relative_curves_of_two_nights_get_a_factor_each() {
    let folder = tempfile::tempdir().expect("a folder");
    let dir = folder.path();
    let mut stream = Stream::new(8);
    let mut damit = "2\n".to_owned();
    for (night, factor) in [1.0, 5.0].into_iter().enumerate() {
        // a smooth path, so that neighbouring points tell the noise
        let (s, o) = fixed_phase(1, 60f64.to_radians(), &mut stream)[0];
        let turned = |k: u32, v: DVec3| {
            let (a, b) = (0.05 * f64::from(k), 0.013 * f64::from(k));
            DMat3::from_rotation_z(a) * DMat3::from_rotation_x(b) * v
        };
        let directions = (0..240).map(|k| (turned(k, s), turned(k, o))).collect::<Directions>();
        let clean = light(&cuboid(DVec3::new(1.0, 2.0, 3.0)), &Material::lambert(1.0), &directions);
        let (y, _) = noisy(&clean, 100.0, &mut stream);
        let _ = writeln!(damit, "240 0");
        for (k, (y, (s, o))) in y.iter().zip(&directions).enumerate() {
            let jd = 2_458_000.5 + night as f64 + 1e-3 * k as f64;
            let _ = writeln!(damit, "{jd:.6} {} {} {} {} {} {} {}", y * factor, s.x, s.y, s.z, o.x, o.y, o.z);
        }
    }
    fs::write(dir.join("lc.txt"), damit).expect("written");
    let (shape, said) = inverted(dir, &["lc.txt", "--model", "convex", "--held-out", "0"]);
    let scale = |k: usize| number(&shape["curves"][k]["scale"]);
    assert!(
        shape["relative"] == true && said.contains("a free factor each") && said.contains("errors not told"),
        "{said}"
    );
    assert!((scale(1) / scale(0) / 5.0 - 1.0).abs() < 0.01, "{} {}", scale(0), scale(1));
    // the fixed angle takes those factors
    let (draft, said) = inverted(dir, &["lc.txt", "--model", "draft", "--held-out", "0"]);
    assert!(number(&draft["chi2_reduced"]) < 3.0, "{said}");
}

/// A box 1:2:3 half diffuse, half Phong's lobe of exponent 10, at SNR 30, 800 points: exponent within 1 %, share within 0.003, both within four of their
/// standard deviations; area and albedo are told to be one number.
#[test]
fn the_law_comes_back_with_the_shape() {
    let folder = tempfile::tempdir().expect("a folder");
    let dir = folder.path();
    let mut stream = Stream::new(9);
    let directions = directions(800, &mut stream);
    let law = Material { model: Model::Phong, diffuse: 0.5, specular: 0.5, exponent: 10.0, roughness: 1.0 };
    let clean = light(&cuboid(DVec3::new(1.0, 2.0, 3.0)), &law, &directions);
    let (y, sigma) = noisy(&clean, 30.0, &mut stream);
    fs::write(dir.join("box.csv"), csv(&steps(800), &y, &sigma, &directions)).expect("written");
    // which law, and where its search begins; no attitude
    let scene = SCENE.split("[target.attitude]").next().unwrap_or_default();
    let start = "[target.material]\nbrdf = \"phong\"\ndiffuse = 0.7\nspecular = 0.3\nexponent = 6.0\n";
    fs::write(dir.join("phong.toml"), format!("{scene}{start}")).expect("written");
    let (shape, said) = inverted(
        dir,
        &["box.csv", "--scene", "phong.toml", "--brdf", "fit", "--model", "convex", "--held-out", "0"],
    );
    let told = &shape["brdf"];
    let [share, share_sd, exponent, exponent_sd] =
        ["specular_fraction", "specular_fraction_sd", "exponent", "exponent_sd"].map(|k| number(&told[k]));
    assert!((share - 0.5).abs() < 0.003 && (share - 0.5).abs() < 4.0 * share_sd, "{told}");
    assert!((exponent / 10.0 - 1.0).abs() < 0.01 && (exponent - 10.0).abs() < 4.0 * exponent_sd, "{told}");
    assert!(claimed(&shape) == 6 && said.contains("area and albedo are one number"), "{said}");
}

/// A body of 14 facets seen in four nights at SNR 30: the true pole is among those listed, within 2 deg, and the best goes on to a shape.
#[test]
fn the_pole_is_among_those_listed() {
    let folder = tempfile::tempdir().expect("a folder");
    let dir = folder.path();
    let mut stream = Stream::new(1);
    let pole = stream.direction();
    let (mut times, mut inertial) = (Vec::new(), Vec::new());
    for night in 0..4 {
        let (s, o) = (stream.direction(), stream.direction());
        for k in 0..60 {
            times.push(f64::from(night) * 3000.0 + f64::from(k) * 7.3);
            inertial.push((s, o));
        }
    }
    let clean =
        light(&random_body(14, 0.5, 1), &Material::lambert(1.0), &body_axes(pole, 137.0, &times, &inertial));
    let (y, sigma) = noisy(&clean, 30.0, &mut stream);
    fs::write(dir.join("spin.csv"), csv(&times, &y, &sigma, &inertial)).expect("written");
    let options =
        ["spin.csv", "--attitude", "scan-pole", "--period", "137..137", "--model", "convex", "-o", "out"];
    let said = done(dir, &[&["invert"], &options[..]].concat());
    let shape: Json =
        serde_json::from_slice(&fs::read(dir.join("out/shape.json")).expect("a shape")).expect("JSON");
    let minima = shape["rotation"]["minima"].as_array().expect("minima");
    let apart =
        |m: &Json| DVec3::from_array([0, 1, 2].map(|k| number(&m["pole"][k]))).angle_between(pole).to_degrees();
    assert!(minima.iter().any(|m| apart(m) < 2.0), "{said}");
    assert!(
        minima.iter().all(|m| number(&m["criterion_above_best"]) <= 9.0) && said.contains("pole RA"),
        "{said}"
    );
    assert!(dir.join("out/pole.svg").is_file());
}

/// A body that tumbles, told to within 3 deg and 1 part in 300 of its rates: the motion comes back, says that it is experimental, and told in a scene it
/// explains the light as the attitude of the target. Without a tumble or a range of turns nothing is sought.
#[test]
fn a_tumble_is_found_near_the_one_told() {
    let folder = tempfile::tempdir().expect("a folder");
    let dir = folder.path();
    let mut stream = Stream::new(3);
    let symmetric = Motion::precessing(stream.direction(), 1.0, 0.5, 120.0, 0.8);
    let truth = Motion { inertia: DVec3::new(1.3, 1.0, 0.9), ..symmetric };
    let (mut times, mut inertial) = (Vec::new(), Vec::new());
    for pass in [0.0, 2500.0] {
        let (s, o) = (stream.direction(), stream.direction());
        times.extend((0..90).map(|k| pass + 8.0 * f64::from(k)));
        inertial.extend([(s, o); 90]);
    }
    let seen = truth.body_axes(&times, &inertial).expect("a body");
    let clean = light(&random_body(10, 0.5, 3), &Material::lambert(1.0), &seen);
    let (y, sigma) = noisy(&clean, 30.0, &mut stream);
    fs::write(dir.join("light.csv"), csv(&times, &y, &sigma, &inertial)).expect("written");
    let scene = |motion: &Motion| {
        let (q, rate) = (motion.attitude, motion.rate.to_array().map(f64::to_degrees));
        let own = format!(
            "mode = \"tumble\"\nepoch = 2017-09-04T00:00:00Z\nquaternion = {:?}\ninertia_kg_m2 = {:?}\nrate_deg_s = {rate:?}\n",
            [q.w, q.x, q.y, q.z],
            motion.inertia.to_array()
        );
        SCENE.split("mode = \"tumble\"").next().unwrap_or_default().to_owned() + &own
    };
    let turned = DQuat::from_scaled_axis(DVec3::new(0.03, -0.03, 0.03));
    let told = Motion { attitude: truth.attitude * turned, rate: truth.rate * (1.0 + 1.0 / 300.0), ..truth };
    fs::write(dir.join("told.toml"), scene(&told)).expect("written");
    let options = ["--attitude", "scan-tumble", "--model", "convex", "--held-out", "0"];
    let (shape, said) = inverted(dir, &[&["light.csv", "--scene", "told.toml"], &options[..]].concat());
    let tumble = &shape["tumble"];
    assert!(tumble["experimental"] == true && tumble["epoch"] == "2017-09-04T00:00:00.000000Z", "{tumble}");
    let best = &tumble["minima"][0];
    let three = |key: &str| DVec3::from_array([0, 1, 2].map(|k| number(&best[key][k])));
    let off = three("momentum").angle_between(truth.momentum());
    let turn = number(&best["turn_s"]) / truth.periods().expect("periods").0;
    assert!(off < 0.06 && (turn - 1.0).abs() < 1e-3 && number(&shape["chi2_reduced"]) < 1.5, "{off} {best}");
    assert!(shape["claims"][0].as_str().is_some_and(|c| c.starts_with("EXPERIMENTAL")), "{}", shape["claims"]);
    assert!(said.contains("tumble, EXPERIMENTAL: near the one told"), "{said}");
    let q = [0, 1, 2, 3].map(|k| number(&best["quaternion"][k]));
    let found = Motion {
        attitude: DQuat::from_xyzw(q[1], q[2], q[3], q[0]),
        rate: three("rate_deg_s") * 1f64.to_radians(),
        inertia: three("inertia"),
    };
    assert!(found.differs(&truth, &times) < 0.1, "{} rad", found.differs(&truth, &times));
    fs::write(dir.join("found.toml"), scene(&found)).expect("written");
    let known = ["light.csv", "--scene", "found.toml", "--model", "convex", "--held-out", "0"];
    let (shape, _) = inverted(dir, &known);
    assert!(number(&shape["chi2_reduced"]) < 1.5, "{}", shape["chi2_reduced"]);
    let output = nightglass(dir, &["invert", "light.csv", "--attitude", "scan-tumble"]);
    let words = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success() && words.contains("--period A..B in seconds"), "{words}");
}

/// The scene's own keys do what the options do: a law, an attitude, a truth beside the scene, no point held out.
#[test]
fn the_scene_tells_how_to_invert() {
    let folder = tempfile::tempdir().expect("a folder");
    let dir = folder.path();
    let keys = "[inversion]\nmodel = \"convex\"\nheld_out = 0.0\ntruth = \"true.obj\"\nbrdf = { brdf = \"lambert\", diffuse = 0.3 }\n";
    let inertia = "inertia_kg_m2 = [900.0, 11000.0, 10800.0]\nrate_deg_s = [0.12, 0.05, 0.1]\n";
    assert!(SCENE.contains(inertia));
    fs::write(dir.join("light.toml"), SCENE).expect("written");
    let body = "[inversion.attitude]\nmode = \"tumble\"\n".to_owned() + inertia;
    // the target itself is said to be at rest and of another law
    let still = SCENE.replace(&format!("mode = \"tumble\"\n{inertia}"), "mode = \"inertial\"\n");
    let still = still.replace("diffuse = 0.3", "diffuse = 0.6");
    fs::write(dir.join("box.toml"), format!("{still}{keys}{body}")).expect("written");
    let corner = |k: usize| [0, 1, 2].map(|axis| if k >> axis & 1 == 1 { "0.5" } else { "-0.5" }).join(" ");
    let corners = (0..8).map(|k| format!("v {}\n", corner(k))).collect::<String>();
    let faces = "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
    fs::write(dir.join("true.obj"), corners + faces).expect("written");
    done(dir, &["lightcurve", "light.toml", "-o", "light", "-q"]);
    let (shape, said) = inverted(dir, &["light/lightcurve.ecsv", "--scene", "box.toml"]);
    assert!(number(&shape["errors"]["iou"]) > 0.999 && shape["model"] == "convex", "{} {said}", shape["errors"]);
    assert!(said.contains("attitude: from inversion.attitude") && said.contains("from inversion.brdf"), "{said}");
    assert_eq!(shape["held_out"]["points"], 0);
    // the file counts, its name does not; a missing one is refused
    let output = nightglass(
        dir,
        &["invert", "light/lightcurve.ecsv", "--scene", "box.toml", "--set", "inversion.truth=none.obj"],
    );
    assert_eq!(output.status.code(), Some(2));
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
