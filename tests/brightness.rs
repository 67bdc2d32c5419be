//! The light of targets in exposures: glints, eclipses, streaks, and what plans make of it.

use nightglass::object::shadow::card::Graphics;
use nightglass::plan::brightness::Glow;
use nightglass::plan::planner::Planner;
use nightglass::scene::{Options, Scene, load_str};

/// A flat mirror that turns about the ICRS z axis in geostationary orbit.
const MIRROR: &str = r#"
[station]
preset = "pogs"
[exposures]
start = 2018-01-20T06:00:00Z
count = 40
cadence_s = 5.0
duration_s = 5.0
[[target]]
name = "M"
shape = "box"
shape_size_m = [2.0, 2.0, 0.1]
[target.orbit]
fixed = { ra_deg = 104.0, dec_deg = -5.3, range_km = 37000.0 }
[target.material]
brdf = "mirror"
diffuse = 0.02
specular = 0.9
[target.attitude]
mode = "spin"
axis = [0.3, 0.2, 1.0]
period_s = 61.7
"#;

fn scene(text: &str, sets: &[(&str, &str)]) -> Scene {
    let sets = sets.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect::<Vec<_>>();
    load_str(text, "scene.toml", None, &Options { sets: &sets, seed: None }).expect("a good scene")
}

fn glow<'a>(planner: &'a Planner) -> Glow<'a> {
    planner.glow(0, &Graphics::default()).expect("a target")
}

/// The mirror on an axis halfway between its +z face and the half vector of Sun and observer: the face flashes after half a turn.
fn flashing() -> Scene {
    let first = scene(MIRROR, &[]);
    let light = Planner::new(&first).expect("a planner").sighting(20, 0).expect("a place").light;
    let half = (light.to_sun + light.to_observer).normalize();
    let axis = glam::DVec3::Z + half;
    scene(MIRROR, &[("target.0.attitude.axis", &format!("[{}, {}, {}]", axis.x, axis.y, axis.z))])
}

/// A flash much shorter than an exposure is in one exposure, whole, and in no other: the sum over exposures is that of a million
/// instants. Exposures of 5 s, 0.7 s and 0.05 s cut the same light differently.
#[test]
fn a_glint_shorter_than_the_exposure_is_neither_missed_nor_doubled() {
    let own = flashing();
    let planner = Planner::new(&own).expect("a planner");
    let mut glow = glow(&planner);
    let exposures = (0..40)
        .map(|frame| glow.over(&planner.sighting(frame, 0).expect("a place")).expect("light"))
        .collect::<Vec<_>>();
    let brute = (0..40).map(|frame| {
        let start = planner.sighting(frame, 0).expect("a place").start;
        let steps = 20_000;
        let mean = (0..steps).map(|k| {
            let t = start.plus(5.0 * (f64::from(k) + 0.5) / f64::from(steps));
            glow.at(&t).expect("light").0
        });
        mean.sum::<f64>() / f64::from(steps)
    });
    let brute = brute.collect::<Vec<_>>();
    let total: f64 = brute.iter().sum();
    let largest = brute.iter().copied().fold(0.0, f64::max);
    // it is a flash: one exposure has many times the light of most
    assert!(largest > 5.0 * total / 40.0, "{largest} of {total}");
    for (k, (found, exact)) in exposures.iter().zip(&brute).enumerate() {
        let off = (found.v_flux - exact).abs();
        // the brute force itself errs by the square of its step over the width of a flash
        assert!(off < 2e-3 * exact + 1e-6 * largest, "exposure {k}: {} {exact}", found.v_flux);
    }
    let sum = |duration: f64, count: usize| -> f64 {
        let mut finer = own.clone();
        finer.exposures.duration_s = duration;
        finer.exposures.cadence_s = duration;
        finer.exposures.count = count;
        let planner = Planner::new(&finer).expect("a planner");
        let mut glow = self::glow(&planner);
        let light = (0..count)
            .map(|frame| glow.over(&planner.sighting(frame, 0).expect("a place")).expect("light").v_flux);
        duration * light.sum::<f64>()
    };
    let (whole, parts, fine) = (sum(5.0, 7), sum(0.7, 50), sum(0.05, 700));
    assert!((whole / fine - 1.0).abs() < 2e-4 && (parts / fine - 1.0).abs() < 2e-4, "{whole} {parts} {fine}");
}

/// A mirror that turns from 20 to 60,000 times in an exposure has the mean light of its turns, each looked at by itself: within 2e-4.
#[test]
fn glints_of_many_turns_are_all_counted() {
    for (period, duration) in [(1.0, 20.0), (1.0, 60.0), (1.0, 300.3), (0.01, 60.0), (0.001, 60.0)] {
        let mut own = flashing();
        let nightglass::scene::Brightness::Shape(_) = own.target[0].brightness else { panic!("a shape") };
        if let Some(nightglass::scene::Attitude::Spin { period_s, .. }) = &mut own.target[0].attitude {
            *period_s = period;
        }
        (own.exposures.duration_s, own.exposures.cadence_s, own.exposures.count) = (duration, duration, 1);
        let planner = Planner::new(&own).expect("a planner");
        let light = glow(&planner).over(&planner.sighting(0, 0).expect("a place")).expect("light");
        let turns = 40;
        (own.exposures.duration_s, own.exposures.count) = (period, turns);
        own.exposures.cadence_s = ((duration - period) / (turns as f64 - 1.0) / period).floor().max(1.0) * period;
        let planner = Planner::new(&own).expect("a planner");
        let mut glow = glow(&planner);
        let one = |frame| glow.over(&planner.sighting(frame, 0).expect("a place")).expect("light").v_flux;
        let mean = (0..turns).map(one).sum::<f64>() / turns as f64;
        let share = light.v_flux / mean - 1.0;
        // 300.3 s hold 0.3 of a turn more, in which there is no flash
        let rest = if duration == 300.3 { 0.3 / 300.3 } else { 0.0 };
        assert!((share + rest).abs() < 2e-4 + 0.1 * rest, "{period} s, {duration} s: {share:e}");
        assert!(light.inexact().is_none(), "{period} s, {duration} s: {:e}", light.error / light.v_flux);
    }
}

/// Of a tumble too fast to be followed nothing is claimed.
#[test]
fn what_turns_too_fast_has_no_error_bar() {
    let start = MIRROR.find("[target.attitude]").expect("attitude");
    let tumble = "[target.attitude]\nmode = \"tumble\"\ninertia_kg_m2 = [1.0, 2.0, 2.5]\nrate_deg_s = [90000.0, 50000.0, 300.0]\n";
    let own = scene(&format!("{}{tumble}", &MIRROR[..start]), &[("exposures.count", "1")]);
    let planner = Planner::new(&own).expect("a planner");
    let light = glow(&planner).over(&planner.sighting(0, 0).expect("a place")).expect("light");
    assert!(light.error.is_infinite() && light.inexact().is_some());
}

/// The light of a mirror is that of its patch of the Sun: never brighter than its area times the Sun's radiance.
#[test]
fn a_glint_is_no_brighter_than_the_suns_disc() {
    let own = flashing();
    let planner = Planner::new(&own).expect("a planner");
    let mut glow = glow(&planner);
    let seen = planner.sighting(0, 0).expect("a place");
    let brightest = (0..200_000)
        .map(|k| glow.at(&seen.start.plus(f64::from(k) * 0.001)).expect("light").0)
        .fold(0.0, f64::max);
    // y <= specular A / (pi R^2) (a + 2)/2 of the limb-darkened disc, and V = -26.76 is 1361 W/m2
    let y = 0.9 * 4.0 / (std::f64::consts::PI * 4.72e-3f64.powi(2)) * 1.254 + 1.0;
    let limit = y / 37.0e6f64.powi(2) * 10f64.powf(0.4 * 26.76) * 1.04;
    assert!(brightest < limit && brightest > 0.001 * limit, "{brightest:e} {limit:e}");
}

/// Frames hold what the light curve tells: electrons of the truth, streak included.
#[test]
fn the_frame_has_the_light_of_the_curve_along_its_streak() {
    let small = [
        ("detector.size_px", "256"),
        ("exposures.count", "1"),
        ("exposures.track", "rates"),
        ("exposures.rate_arcsec_s", "[12.0, 5.0]"),
        ("station.scintillation", "false"),
        ("target.0.attitude.axis", "[1.0, 0.1, 0.0]"),
    ];
    let spin = MIRROR
        .replace("brdf = \"mirror\"\n", "")
        .replace("specular = 0.9\n", "")
        .replace("period_s = 61.7", "period_s = 14.0");
    let own = scene(&spin, &small);
    let simulator = nightglass::simulate::Simulator::new(&own).expect("a simulator");
    let view = simulator.planner.view(0).expect("geometry");
    let scenery = simulator.scenery(&view).expect("light");
    let light = &simulator.planner.lights(&view, &Graphics::default()).expect("light")[0];
    assert!(!light.shares.is_empty() && !scenery.streaks[0].is_empty());
    let region = nightglass::simulate::whole(&own);
    let mut image = vec![0.0; region.len()];
    scenery.add_target(0, 1.0, &region, &mut image);
    let total: f64 = image.iter().sum();
    assert!((total - 1.0).abs() < 2e-4, "{total}");
    // light along the streak: quarters of its length hold the quarters of the light in time
    let path = scenery.targets[0].path;
    let (start, along) = (path.start, path.end - path.start);
    let mut quarters = [0.0; 4];
    for (k, value) in image.iter().enumerate() {
        let at = glam::DVec2::new((k % region.width) as f64, (k / region.width) as f64);
        let share = (at - start).dot(along) / along.length_squared();
        quarters[(4.0 * share).clamp(0.0, 3.0) as usize] += value;
    }
    let n = light.shares.len() / 4;
    let expected = [0, 1, 2, 3].map(|k| light.shares[k * n..(k + 1) * n].iter().sum::<f64>());
    let spread = expected.iter().copied().fold(0.0, f64::max) - expected.iter().copied().fold(1.0, f64::min);
    assert!(spread > 0.2, "{expected:?}");
    for (k, (quarter, expected)) in quarters.iter().zip(expected).enumerate() {
        // the image is a few pixels wide: light near a limit between quarters is on both sides
        assert!((quarter - expected).abs() < 0.06, "{k}: {quarter} {expected}");
    }
}

/// A limit on the magnitude is one on the shape's.
#[test]
fn plans_know_how_bright_a_shape_is() {
    let bright = scene(MIRROR, &[("plan.limit_mag_v", "20.0"), ("exposures.count", "1")]);
    let faint = scene(MIRROR, &[("plan.limit_mag_v", "5.0"), ("exposures.count", "1")]);
    let why = |scene: &Scene| Planner::new(scene).expect("a planner").view(0).expect("geometry").observability.why;
    assert!(!why(&bright).contains("fainter") && why(&faint).contains("fainter than 5"), "{}", why(&faint));
}

/// Faults of shapes name their keys.
#[test]
fn shapes_that_cannot_be_are_refused() {
    let fault = |from: &str, to: &str| {
        let text = MIRROR.replace(from, to);
        assert_ne!(text, MIRROR);
        load_str(&text, "scene.toml", None, &Options::default()).expect_err("a fault").to_string()
    };
    for (from, to, told) in [
        (", range_km = 37000.0", "", "range_km is required"),
        ("shape = \"box\"", "shape = \"boxwing\"", "nearest: \"box-wing\""),
        ("specular = 0.9", "specular = 0.99", "diffuse + specular"),
        ("brdf = \"mirror\"", "brdf = \"gold\"", "only with brdf"),
        ("[target.attitude]", "[target.material.group.wing]\n[target.attitude]", "no group or material"),
        (
            "[target.attitude]",
            "[target.part.wing]\nface = [1.0, 0.0, 0.0]\n[target.attitude]",
            "no group or material",
        ),
        ("shape_size_m = [2.0, 2.0, 0.1]", "shape_size_m = [2.0, 2.0, 0.0]", "must be 3 numbers"),
    ] {
        let message = fault(from, to);
        assert!(message.contains(told), "{to}: {message}");
    }
}

/// A graphics processor finds the light that the processor finds, many epochs at once, within `accuracy.brightness`; where there is
/// none the reason is told, and where one is required that is a failure.
#[test]
fn the_graphics_processor_agrees_with_the_processor() {
    use nightglass::object::shadow::card::Card;
    let text =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/box-wing.toml")).expect("read");
    let text = &text[..text.find("[target.part.panel]").expect("parts")];
    let sets = [("exposures.duration_s", "0.0"), ("accuracy.brightness", "0.05")];
    let own = scene(text, &sets);
    let card = match Card::open(false) {
        Ok(card) => card,
        Err(why) => {
            assert!(!why.is_empty() && std::env::var("NIGHTGLASS_REQUIRE_GPU").is_err(), "{why}");
            return;
        }
    };
    let graphics = Graphics { card: Some(card), required: true, why: String::new() };
    let planner = Planner::new(&own).expect("a planner");
    let seen = (0..12).map(|frame| planner.sighting(frame, 0).expect("a place")).collect::<Vec<_>>();
    let mut drawn = planner.glow(0, &graphics).expect("a target");
    assert!(drawn.means().is_some_and(|means| means.way.describe().contains("graphics processor")));
    let drawn = drawn.over_all(&seen).expect("light");
    let exact = glow(&planner).over_all(&seen).expect("light");
    let largest = exact.iter().map(|l| l.v_flux).fold(0.0, f64::max);
    for (a, b) in drawn.iter().zip(&exact) {
        assert!((a.v_flux - b.v_flux).abs() < 0.05 * largest, "{} {}", a.v_flux, b.v_flux);
    }
}
