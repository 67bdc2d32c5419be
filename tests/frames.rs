//! Frames are the same bytes for any number of threads, crop, subset, resumption or repetition.

use nightglass::camera::region::Region;
use nightglass::scene::{Options, Scene, load};
use nightglass::simulate::{Simulator, whole};
use std::fs;
use std::path::Path;
use std::process::Output;

const SMALL: [(&str, &str); 4] = [
    ("detector.size_px", "[300, 260]"),
    ("telescope.plate_scale_arcsec", "6.0"),
    ("exposures.count", "5"),
    ("exposures.duration_s", "2.0"),
];

fn scene(more: &[(&str, &str)]) -> Scene {
    let sets = SMALL.iter().chain(more).map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect::<Vec<_>>();
    load("pogs-geo", &Options { sets: &sets, seed: None }).expect("a good scene")
}

fn nightglass(dir: &Path, arguments: &[&str]) -> Output {
    let mut command = assert_cmd::Command::cargo_bin("nightglass").expect("the program");
    command.current_dir(dir).args(arguments);
    for (key, value) in SMALL {
        command.arg("--set").arg(format!("{key}={value}"));
    }
    command.output().expect("it runs")
}

fn done(dir: &Path, arguments: &[&str]) {
    let output = nightglass(dir, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
}

fn frames(dir: &Path) -> Vec<Vec<u8>> {
    let mut paths =
        fs::read_dir(dir.join("frames")).expect("frames").flatten().map(|e| e.path()).collect::<Vec<_>>();
    paths.sort();
    paths.iter().map(|p| fs::read(p).expect("a frame")).collect()
}

#[test]
fn threads_crops_and_bands_give_the_pixels_of_the_whole() {
    let scene = scene(&[]);
    let simulator = Simulator::new(&scene).expect("a simulator");
    let view = simulator.planner.view(2).expect("geometry");
    let scenery = simulator.scenery(&view).expect("light");
    let all = whole(&scene);
    let render = |threads: usize, region: &Region| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| simulator.pixels(&view, &scenery, region))
    };
    let expected = render(1, &all);
    assert!(expected.iter().any(|adu| *adu != expected[0]));
    for threads in [2, 4] {
        assert_eq!(render(threads, &all), expected, "{threads} threads");
    }
    for region in [
        Region { x0: 0, y0: 0, width: 1, height: 1 },
        Region { x0: 37, y0: 31, width: 101, height: 77 },
        Region { x0: 299, y0: 259, width: 1, height: 1 },
        Region { x0: 120, y0: 100, width: 60, height: 60 },
    ] {
        let part = render(2, &region);
        for (i, adu) in part.iter().enumerate() {
            let (x, y) = (region.x0 + i % region.width, region.y0 + i / region.width);
            assert_eq!(*adu, expected[y * 300 + x], "pixel {x}, {y} of {region:?}");
        }
    }
}

#[test]
fn runs_subsets_and_resumptions_write_the_same_bytes() {
    let folder = tempfile::tempdir().expect("a folder");
    let dir = folder.path();
    done(dir, &["run", "pogs-geo", "-o", "one", "--threads", "1"]);
    done(dir, &["run", "pogs-geo", "-o", "two", "--threads", "2"]);
    let expected = frames(&dir.join("one"));
    assert_eq!(expected.len(), 5);
    assert_eq!(frames(&dir.join("two")), expected);
    for table in ["plan.ecsv", "truth.ecsv", "lightcurve.ecsv", "scene.toml"] {
        let read = |run: &str| fs::read(dir.join(run).join(table)).expect(table);
        assert_eq!(read("one"), read("two"), "{table}");
    }

    done(dir, &["render", "pogs-geo", "-o", "part", "--frames", "3..4"]);
    assert_eq!(frames(&dir.join("part")), expected[3..4]);
    // an interrupted run: one frame missing, one cut short under its temporary name
    fs::remove_file(dir.join("two/frames/0001.fits")).expect("removed");
    fs::write(dir.join("two/frames/0002.fits.part"), b"half a frame").expect("written");
    fs::remove_file(dir.join("two/truth.ecsv")).expect("removed");
    done(dir, &["run", "pogs-geo", "-o", "two"]);
    fs::remove_file(dir.join("two/frames/0002.fits.part")).ok();
    assert_eq!(frames(&dir.join("two")), expected);
    assert_eq!(
        fs::read(dir.join("two/truth.ecsv")).expect("truth"),
        fs::read(dir.join("one/truth.ecsv")).expect("truth")
    );

    // the resolved scene is complete: run by itself it gives the same bytes
    let mut command = assert_cmd::Command::cargo_bin("nightglass").expect("the program");
    let output =
        command.current_dir(dir).args(["run", "one/scene.toml", "-o", "again"]).output().expect("it runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(frames(&dir.join("again")), expected);
}

#[test]
fn the_output_of_another_scene_is_not_overwritten() {
    let folder = tempfile::tempdir().expect("a folder");
    let dir = folder.path();
    done(dir, &["render", "pogs-geo", "-o", "out", "--frames", "0..1"]);
    let before = frames(&dir.join("out"));
    let refused = nightglass(dir, &["render", "pogs-geo", "-o", "out", "--frames", "0..1", "--seed", "9"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("--force"));
    assert_eq!(frames(&dir.join("out")), before);
    done(dir, &["render", "pogs-geo", "-o", "out", "--frames", "0..1", "--seed", "9", "--force"]);
    assert_ne!(frames(&dir.join("out")), before);

    fs::create_dir(dir.join("mine")).expect("made");
    fs::write(dir.join("mine/thesis.tex"), "precious").expect("written");
    fs::create_dir(dir.join("mine/frames")).expect("made");
    fs::write(dir.join("mine/frames/real.fits"), "observed").expect("written");
    let refused = nightglass(dir, &["render", "pogs-geo", "-o", "mine", "--frames", "0..1"]);
    assert_eq!(refused.status.code(), Some(2));
    done(dir, &["render", "pogs-geo", "-o", "mine", "--frames", "0..1", "--force"]);
    assert_eq!(fs::read_to_string(dir.join("mine/thesis.tex")).expect("still there"), "precious");
    assert_eq!(fs::read_to_string(dir.join("mine/frames/real.fits")).expect("still there"), "observed");
}

#[test]
fn a_scene_with_a_file_is_run_anew_over_its_own_output() {
    let folder = tempfile::tempdir().expect("a folder");
    let dir = folder.path();
    fs::write(dir.join("flat.csv"), "nm,qe\n350,0.5\n1000,0.5\n").expect("written");
    let qe = format!("detector.qe={}", dir.join("flat.csv").display());
    done(dir, &["render", "pogs-geo", "-o", "out", "--frames", "0", "--set", &qe]);
    let before = frames(&dir.join("out"));
    let mut command = assert_cmd::Command::cargo_bin("nightglass").expect("the program");
    command.current_dir(dir).args(["render", "out/scene.toml", "-o", "out", "--frames", "0", "--force"]);
    command.assert().success();
    assert_eq!(frames(&dir.join("out")), before);
}

#[test]
fn a_crop_is_a_part_of_the_frame_with_its_own_reference_pixel() {
    let folder = tempfile::tempdir().expect("a folder");
    let dir = folder.path();
    done(dir, &["render", "pogs-geo", "-o", "whole", "--frames", "1"]);
    done(dir, &["render", "pogs-geo", "-o", "crop", "--frames", "1", "--crop", "100,80,64,32"]);
    let read =
        |run: &str| nightglass::io::image::Image::read(&dir.join(run).join("frames/0001.fits")).expect("a frame");
    let (whole, crop) = (read("whole"), read("crop"));
    assert_eq!((crop.width, crop.height), (64, 32));
    for y in 0..32 {
        for x in 0..64 {
            assert_eq!(crop.data[y * 64 + x], whole.data[(y + 80) * 300 + x + 100]);
        }
    }
    let key = |image: &nightglass::io::image::Image, name: &str| image.header.number(name).expect("present");
    assert_eq!(key(&whole, "CRPIX1") - key(&crop, "CRPIX1"), 100.0);
    assert_eq!(key(&whole, "CRPIX2") - key(&crop, "CRPIX2"), 80.0);
    assert_eq!(key(&whole, "CRPIX1"), 150.5);
}

#[test]
fn resuming_with_other_pixels_is_refused_and_other_products_are_added() {
    let folder = tempfile::tempdir().expect("a folder");
    let dir = folder.path();
    done(dir, &["render", "pogs-geo", "-o", "out", "--frames", "0..2"]);
    let before = frames(&dir.join("out"));
    for crop in ["0,0,64,64", "10,0,300,260"] {
        let refused = nightglass(dir, &["render", "pogs-geo", "-o", "out", "--frames", "0", "--crop", crop]);
        assert_eq!(refused.status.code(), Some(2), "{crop}");
    }
    assert_eq!(frames(&dir.join("out")), before);
    done(
        dir,
        &[
            "render",
            "pogs-geo",
            "-o",
            "out",
            "--frames",
            "1",
            "--set",
            "output.planes=[\"mean\"]",
            "--set",
            "output.star_table=true",
            "--set",
            "output.format=[\"fits\", \"png\"]",
        ],
    );
    assert_eq!(frames(&dir.join("out")), before);
    for name in ["planes/mean_0001.fits", "stars/stars_0001.ecsv", "previews/0001.png"] {
        assert!(dir.join("out").join(name).exists(), "{name}");
    }
    // a frame whose bytes were damaged is made anew
    let path = dir.join("out/frames/0001.fits");
    let mut damaged = before[1].clone();
    let at = damaged.len() - 20_000;
    damaged[at] ^= 0x55;
    fs::write(&path, damaged).expect("written");
    done(dir, &["render", "pogs-geo", "-o", "out", "--frames", "0..2"]);
    assert_eq!(frames(&dir.join("out")), before);
}

#[test]
fn truth_of_a_crop_counts_from_its_first_pixel() {
    let folder = tempfile::tempdir().expect("a folder");
    let dir = folder.path();
    let place = |run: &str, column: &str| {
        let text = fs::read_to_string(dir.join(run).join("truth.ecsv")).expect("truth");
        let mut lines = text.lines().filter(|l| !l.starts_with('#'));
        let index = lines.next().expect("names").split(' ').position(|n| n == column).expect(column);
        // the target's name holds a blank
        let row = lines.next().expect("a row").replace("\"GOES 14\"", "GOES-14");
        row.split(' ').nth(index).expect("a cell").parse::<f64>().expect("a number")
    };
    done(dir, &["render", "pogs-geo", "-o", "whole", "--frames", "0"]);
    done(dir, &["render", "pogs-geo", "-o", "crop", "--frames", "0", "--crop", "100,90,64,64"]);
    assert_eq!(place("whole", "x_px") - place("crop", "x_px"), 100.0);
    assert_eq!(place("whole", "y_px") - place("crop", "y_px"), 90.0);
}

#[test]
fn a_frame_hides_the_target() {
    let bright = scene(&[("target.0.brightness.mag_v", "6.0")]);
    let faint = scene(&[("target.0.brightness.mag_v", "19.0")]);
    let header = |scene: &Scene| {
        let simulator = Simulator::new(scene).expect("a simulator");
        let view = simulator.planner.view(0).expect("geometry");
        let scenery = simulator.scenery(&view).expect("light");
        simulator.header(&view, &scenery, &whole(scene)).lines()
    };
    let sha = |line: &String| line.starts_with("SCENESHA");
    let told = |scene: &Scene| header(scene).into_iter().filter(|l| !sha(l)).collect::<Vec<_>>();
    assert_eq!(told(&bright), told(&faint));
}
