//! Scene files: what loads, what is refused and in which words, and that a resolved scene is the same scene.

use std::fs;
use std::path::Path;

use nightglass::scene::{
    self, At, Brightness, Crop, Options, Orbit, Psf, Scene, SceneError, SkyModel, Table, Track,
};
use proptest::prelude::*;

const BARE: &str = r#"
[station]
preset = "pogs"
[exposures]
start = 2018-01-20T03:00:00Z
duration_s = 5.0
[[target]]
name = "A"
orbit.fixed = { ra_deg = 83.0, dec_deg = 8.0 }
brightness.mag_v = 12.0
"#;

fn load(text: &str, sets: &[(&str, &str)], seed: Option<u64>) -> Result<Scene, SceneError> {
    let sets: Vec<_> = sets.iter().map(|(path, value)| (path.to_string(), value.to_string())).collect();
    scene::load_str(text, "bare.toml", None, &Options { sets: &sets, seed })
}

fn good(text: &str, sets: &[(&str, &str)]) -> Scene {
    load(text, sets, None).unwrap_or_else(|error| panic!("{error}"))
}

fn bad(text: &str, sets: &[(&str, &str)]) -> String {
    load(text, sets, None).expect_err("it should be refused").to_string()
}

/// Every scene of `tests/bad` fails with exactly the words of the text beside it.
#[test]
fn bad_scenes_fail_with_their_messages() {
    let dir = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/bad");
    let mut count = 0;
    for file in fs::read_dir(&dir).unwrap().map(|entry| entry.unwrap().path()) {
        if file.extension().is_none_or(|ext| ext != "toml") {
            continue;
        }
        let text = fs::read_to_string(&file).unwrap();
        let expected = fs::read_to_string(file.with_extension("txt")).unwrap();
        let name = file.file_name().unwrap().to_string_lossy();
        let error = scene::load_str(&text, &name, None, &Options::default()).expect_err(&name);
        assert_eq!(error.to_string().trim(), expected.trim(), "{name}");
        count += 1;
    }
    assert!(count >= 12);
}

#[test]
fn the_built_in_scenes_stations_and_the_template_load() {
    for (name, _) in scene::SCENES {
        scene::load(name, &Options::default()).unwrap();
        scene::template(Some(name)).unwrap();
    }
    for (name, text) in scene::STATIONS {
        good(BARE, &[("station.preset", name)]);
        good(&format!("{text}\n{}", BARE.replace("[station]\npreset = \"pogs\"\n", "")), &[]);
    }
    good(&scene::template(None).unwrap(), &[]);
    assert!(scene::template(Some("pogs-gei")).unwrap_err().to_string().contains("nearest: pogs-geo"));
    assert!(scene::load("pogs-gei", &Options::default()).unwrap_err().to_string().contains("nearest: pogs-geo"));
    assert!(scene::load("no/such.toml", &Options::default()).unwrap_err().to_string().contains("cannot read"));
}

#[test]
fn a_short_scene_takes_every_default() {
    let scene = good(BARE, &[]);
    assert_eq!((scene.name.as_str(), scene.seed, scene.exposures.count), ("bare", 1, 1));
    assert_eq!((scene.pointing.at.clone(), scene.exposures.track.clone()), (At::Target(None), Track::Target));
    assert_eq!(scene.exposures.cadence_s, 5.0);
    assert_eq!(scene.detector.qe, Table::Named("kaf16803".into()));
    assert_eq!((scene.telescope.psf.clone(), scene.telescope.moffat_beta), (Psf::Moffat, 3.0));
    assert_eq!(scene.sky.airglow, SkyModel::Auto);
    assert_eq!((scene.stars.limit_mag_v, scene.photometry.aperture_px), (None, None));
    assert_eq!(scene.accuracy, nightglass::base::accuracy::Accuracy::default());
    assert_eq!(scene.exposures.start_text, "2018-01-20T03:00:00Z");
    // f/7.2: 0.3556 m x 7.2 = 2.560 m
    assert!((scene.telescope.focal_length_m - 2.56).abs() < 0.002);
}

#[test]
fn the_pressure_without_a_value_is_the_standard_atmosphere() {
    let own = scene::STATIONS[0].1.replace("pressure_hpa", "# pressure_hpa");
    let text = format!("{own}\n{}", BARE.replace("[station]\npreset = \"pogs\"\n", ""));
    // 1976 standard atmosphere: 1013.25 hPa at 0 m, 701.1 hPa at 3000 m
    for (height, pressure) in [("0.0", 1013.25), ("3000.0", 701.1)] {
        let found = good(&text, &[("station.height_m", height)]).station.pressure_hpa;
        assert!((found - pressure).abs() < 0.1, "{found}");
    }
    good(&text, &[("station.height_m", "-500.0")]);
    assert_eq!(good(&text, &[("station.height_m", "1e5")]).station.pressure_hpa, 0.0);
}

#[test]
fn set_wins_over_the_scene_and_the_scene_over_the_preset() {
    let text = BARE.replace("[exposures]", "seeing_arcsec = 1.5\n[telescope]\nmoffat_beta = 2.5\n[exposures]");
    let scene = good(&text, &[("target.0.brightness.mag_v", "10.5"), ("detector.size_px", "512")]);
    assert_eq!((scene.station.seeing_arcsec, scene.telescope.moffat_beta), (1.5, 2.5));
    assert_eq!((&scene.target[0].brightness, scene.detector.size_px), (&Brightness::MagV(10.5), [512, 512]));

    let focal = good(BARE, &[("telescope.focal_length_m", "1.0")]).telescope;
    assert_eq!(focal.focal_length_m, 1.0);
    assert!((focal.plate_scale_arcsec - 206_264.806 * 9e-6).abs() < 1e-6);

    let gauss = good(&text, &[("telescope.psf", "gaussian")]);
    assert_eq!(gauss.telescope.psf, Psf::Gaussian);
    let rates = good(BARE, &[("exposures.track", "rates"), ("exposures.rate_arcsec_s", "[15, 0.5]")]);
    assert_eq!(rates.exposures.track, Track::Rates([15.0, 0.5]));
    assert_eq!(good(&rates.to_toml(), &[("exposures.track", "sidereal")]).exposures.track, Track::Sidereal);
    let place = good(BARE, &[("pointing.at", "azel"), ("pointing.az_deg", "10"), ("pointing.el_deg", "60")]);
    assert_eq!(place.pointing.at, At::AzEl { az_deg: 10.0, el_deg: 60.0 });
    assert_eq!(good(BARE, &[("sky.airglow", "21.5")]).sky.airglow, SkyModel::Surface(21.5));
    assert_eq!(good(BARE, &[("output.crop", "[0, 8, 64, 32]")]).output.crop, Crop::Rect([0, 8, 64, 32]));
    let orbit = &[("target.0.orbit.fixed.range_km", "36000")];
    assert_eq!(
        good(BARE, orbit).target[0].orbit,
        Orbit::Fixed { ra_deg: 83.0, dec_deg: 8.0, range_km: Some(36_000.0) }
    );
}

#[test]
fn faults_of_the_command_line_say_so() {
    let shown = bad(BARE, &[("detector.gian", "1"), ("target.1.name", "B"), ("station.latitude_deg", "95")]);
    assert!(shown.contains("--set: unknown key \"gian\" in [detector]; nearest: gain_e_per_adu"), "{shown}");
    assert!(shown.contains("--set: target.1.name: target is a list of 1, 1 is not an index of it"), "{shown}");
    assert!(shown.contains("--set: station.latitude_deg = 95: must lie in -90..90 deg"), "{shown}");
    let shown = load(BARE, &[], Some(u64::MAX)).unwrap_err().to_string();
    assert_eq!(shown, "--seed: seed must lie in 0..9223372036854775807");
    assert_eq!(load(BARE, &[], Some(9)).unwrap().seed, 9);
}

#[test]
fn without_a_target_a_place_is_enough() {
    let text = BARE.split("[[target]]").next().unwrap();
    let place = [("pointing.at", "radec"), ("pointing.ra_deg", "83.0"), ("pointing.dec_deg", "8.0")];
    let scene = good(text, &place);
    assert_eq!((scene.exposures.track.clone(), scene.target.len()), (Track::Sidereal, 0));
    assert!(
        bad(text, &[place[0], place[1], place[2], ("exposures.track", "target")]).contains("has no [[target]]")
    );
    assert_eq!(good(&scene.to_toml(), &[]), scene);
}

#[test]
fn a_resolved_scene_is_the_same_scene() {
    let changes: &[&[(&str, &str)]] = &[
        &[],
        &[("telescope.focal_length_m", "2.3456789")],
        &[("telescope.psf", "gaussian"), ("plan.limit_mag_v", "16.5"), ("stars.limit_mag_v", "14")],
        &[("exposures.track", "rates"), ("exposures.rate_arcsec_s", "[15.04, 0.1]")],
        &[("pointing.target", "GOES 14"), ("sky.moonlight", "krisciunas-schaefer"), ("sky.twilight", "off")],
        &[("pointing.at", "radec"), ("pointing.ra_deg", "1e-7"), ("pointing.dec_deg", "-0.1")],
        &[
            ("target.0.orbit.fixed", "{ ra_deg = 1, dec_deg = 2, range_km = 3 }"),
            ("exposures.start", "2018-01-20 03:00:00.25"),
        ],
        &[("output.crop", "target"), ("output.planes", "[\"mean\"]"), ("inversion.brdf", "{ diffuse = 0.5 }")],
    ];
    for sets in changes {
        let sets: Vec<_> = sets.iter().map(|(path, value)| (path.to_string(), value.to_string())).collect();
        let scene =
            scene::load("pogs-geo", &Options { sets: &sets, seed: None }).unwrap_or_else(|e| panic!("{e}"));
        let again = good(&scene.to_toml(), &[]);
        assert_eq!(again, scene);
        assert_eq!((again.to_toml(), again.sha256()), (scene.to_toml(), scene.sha256()));
    }
}

#[test]
fn the_hash_follows_what_changes_a_pixel() {
    let hash = |sets: &[(&str, &str)], seed| load(BARE, sets, seed).unwrap().sha256();
    let plain = hash(&[], None);
    assert_eq!(plain.len(), 64);
    assert_eq!(hash(&[("output.crop", "target"), ("output.report", "false")], None), plain);
    assert_eq!(hash(&[("telescope.throughput", "0.5")], None), plain);
    assert_ne!(hash(&[], Some(2)), plain);
    assert_ne!(hash(&[("telescope.throughput", "0.51")], None), plain);
    let mut scene = good(BARE, &[]);
    scene.target[0].brightness = Brightness::MagV(13.0);
    assert_eq!(scene.sha256(), hash(&[("target.0.brightness.mag_v", "13")], None));
}

#[test]
fn named_files_are_inputs_and_their_content_counts() {
    let dir = tempfile::tempdir().unwrap();
    let write = |path: &str, text: &str| {
        let path = dir.path().join(path);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    };
    let lines = BARE.replace("orbit.fixed = { ra_deg = 83.0, dec_deg = 8.0 }", "orbit.tle = \"elements.txt\"");
    let text = format!("{lines}[detector]\nqe = \"a/curve.csv\"\n[telescope]\nfilter = \"b/curve.csv\"\n");
    let tle = scene::SCENES[0].1.lines().filter_map(|line| line.split('"').nth(1).filter(|l| l.len() == 69));
    write("scene.toml", &text);
    write("elements.txt", &format!("A\n{}\n", tle.collect::<Vec<_>>().join("\n")));
    write("a/curve.csv", "400,0.5\n700,0.6\n");
    write("b/curve.csv", "400,0.9\n700,0.9\n");
    let load =
        |path: &Path| scene::load(&path.to_string_lossy(), &Options::default()).unwrap_or_else(|e| panic!("{e}"));
    let scene = load(&dir.path().join("scene.toml"));
    assert!(matches!(&scene.target[0].orbit, Orbit::Tle { name: Some(name), .. } if name == "A"));
    assert_eq!(scene.detector.qe, Table::File(dir.path().join("a/curve.csv")));
    let names: Vec<_> = scene.inputs().iter().map(|input| (input.key.as_str(), input.name.as_str())).collect();
    assert_eq!(names, [("telescope.filter", "curve.csv"), ("detector.qe", "2-curve.csv")]);

    for input in scene.inputs() {
        write(&format!("out/inputs/{}", input.name), &fs::read_to_string(&input.path).unwrap());
    }
    write("out/scene.toml", &scene.to_toml().replace("name = \"scene\"", "name = \"scene\" # the same"));
    let again = load(&dir.path().join("out/scene.toml"));
    assert_eq!((again.to_toml(), again.sha256()), (scene.to_toml(), scene.sha256()));
    assert_eq!(load(&dir.path().join("out/scene.toml")), again);

    write("a/curve.csv", "400,0.5\n700,0.7\n");
    assert_ne!(load(&dir.path().join("scene.toml")).sha256(), scene.sha256());
}

#[test]
fn a_station_may_be_a_file() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("mine.toml"), scene::station_template()).unwrap();
    let text = BARE.replace("\"pogs\"", "\"mine.toml\"");
    let scene = scene::load_str(&text, "s.toml", Some(dir.path()), &Options::default()).unwrap();
    assert_eq!(scene.station.seeing_arcsec, 2.2);
    fs::write(dir.path().join("mine.toml"), "[station]\nlatitude_deg = 95\npreset = \"pogs\"\n[sky]\n").unwrap();
    let shown = scene::load_str(&text, "s.toml", Some(dir.path()), &Options::default()).unwrap_err().to_string();
    assert!(shown.contains("mine.toml:2: station.latitude_deg = 95: must lie in -90..90 deg"), "{shown}");
    assert!(shown.contains("mine.toml:3: station.preset: a station file cannot name another"), "{shown}");
    assert!(shown.contains("mine.toml:4: \"sky\" has no place in a station file"), "{shown}");
}

/// Keys and values, right and wrong, to put at random places.
const KEYS: &[&str] =
    &["station", "preset", "latitude_deg", "target", "0", "orbit", "tle", "fixed", "psf", "size_px", "x"];
const VALUES: &[&str] =
    &["1", "-1e400", "nan", "\"pogs\"", "[]", "{}", "[[1]]", "true", "2018-01-15", "[1, 2, 3, 4]", "é"];

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// No text makes the loader panic.
    #[test]
    fn any_text_loads_or_is_refused(text in "\\PC{0,200}") {
        let _ = load(&text, &[], None);
    }

    /// Nor does a good scene with something cut out and put elsewhere; what loads resolves to itself.
    #[test]
    fn any_mutation_loads_or_is_refused(cut in 0..1500usize, length in 0..40usize, put in 0..1500usize, value in 0..VALUES.len()) {
        let mut text: Vec<char> = scene::template(Some("pogs-geo")).unwrap().chars().collect();
        let cut = cut.min(text.len());
        text.drain(cut..(cut + length).min(text.len()));
        let put = put.min(text.len());
        text.splice(put..put, VALUES[value].chars());
        if let Ok(scene) = load(&text.into_iter().collect::<String>(), &[], None) {
            prop_assert_eq!(good(&scene.to_toml(), &[]), scene);
        }
    }

    /// Nor does any `--set`.
    #[test]
    fn any_set_loads_or_is_refused(path in prop::collection::vec(0..KEYS.len(), 1..5), value in 0..VALUES.len()) {
        let path = path.into_iter().map(|i| KEYS[i]).collect::<Vec<_>>().join(".");
        let _ = load(BARE, &[(path.as_str(), VALUES[value])], None);
    }
}
