//! Laws of the light budget and the detector: what must hold whatever the models' values are.

use nightglass::base::units::{ARCSEC, ARCSEC_PER_RAD};
use nightglass::camera::chip::Chip;
use nightglass::camera::detector::{convert::Converter, read_noise, well};
use nightglass::camera::expose;
use nightglass::camera::region::Region;
use nightglass::camera::scenery::Scenery;
use nightglass::light::throughput::Throughput;
use nightglass::scene::{Options, Scene, load};
use nightglass::simulate::{Simulator, whole};
use std::fs;

fn scene(sets: &[(&str, &str)]) -> Scene {
    let small = [("detector.size_px", "256"), ("exposures.count", "1"), ("accuracy.omit", "1e-9")];
    let sets = small.iter().chain(sets).map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect::<Vec<_>>();
    load("pogs-geo", &Options { sets: &sets, seed: None }).expect("a good scene")
}

fn scenery(scene: &Scene) -> Scenery {
    let simulator = Simulator::new(scene).expect("a simulator");
    simulator.scenery(&simulator.planner.view(0).expect("geometry")).expect("light")
}

fn mean(scenery: &Scenery, keyword: &str) -> f64 {
    scenery.sky_means.iter().find(|m| m.keyword == keyword).map_or(0.0, |m| m.mean_e_px)
}

#[test]
fn a_steradian_holds_4_2545e10_square_arcseconds() {
    assert!((ARCSEC_PER_RAD * ARCSEC_PER_RAD / 4.2545e10 - 1.0).abs() < 1e-4);
}

#[test]
fn the_pixel_is_a_solid_angle_in_steradians_and_the_secondary_takes_its_share() {
    let scene = scene(&[]);
    let simulator = Simulator::new(&scene).expect("a simulator");
    let view = simulator.planner.view(0).expect("geometry");
    let context = simulator.sky_context(&view);
    assert!((context.pixel_sr / (0.725447016 * ARCSEC).powi(2) - 1.0).abs() < 1e-12);
    assert!((context.pixel_arcsec2() - 0.725447016f64.powi(2)).abs() < 1e-9);
    let area = Throughput::of(&scene).expect("tables").area_m2;
    assert!((area - 0.07595).abs() < 1e-5, "{area} m^2");
}

/// 22 mag/arcsec^2 measured at the ground with the net area, Krag's QE, no losses: 0.750 e-/px in 1 s.
#[test]
fn a_sky_of_22_mag_gives_the_known_electrons() {
    let s = scene(&[
        ("detector.qe", "krag2003"),
        ("telescope.throughput", "1.0"),
        ("sky.airglow", "22.0"),
        ("exposures.duration_s", "1.0"),
    ]);
    assert!((mean(&scenery(&s), "SKYAIRG") / 0.750 - 1.0).abs() < 0.005);
}

#[test]
fn light_measured_at_the_ground_is_not_dimmed_again() {
    let folder = tempfile::tempdir().expect("a folder");
    let thick = folder.path().join("thick.csv");
    fs::write(&thick, "nm,k\n300,1.5\n1100,1.5\n").expect("written");
    let extinction = format!("\"{}\"", thick.display());
    let bright = [("station.artificial_zenith_mcd_m2", "5.0"), ("exposures.start", "2018-01-20T01:10:00Z")];
    let thin = scenery(&scene(&bright));
    let thick = scenery(&scene(&[&bright[..], &[("station.extinction", &extinction)]].concat()));
    for at_the_ground in ["SKYPOLL", "SKYTWIL"] {
        assert!(mean(&thin, at_the_ground) > 0.0, "{at_the_ground}");
        assert!((mean(&thick, at_the_ground) / mean(&thin, at_the_ground) - 1.0).abs() < 1e-12, "{at_the_ground}");
    }
    for from_above in ["SKYZODI", "SKYSTAR"] {
        assert!(mean(&thick, from_above) < 0.5 * mean(&thin, from_above), "{from_above}");
    }
}

#[test]
fn a_sun_too_high_is_outside_the_model_and_told() {
    let s = scene(&[("exposures.start", "2018-01-20T19:00:00Z")]);
    let scenery = scenery(&s);
    let row = scenery.ledger.iter().find(|r| r.name == "sky.twilight").expect("a row");
    assert!(!row.is_needed() && row.bound.is_nan() && row.why.contains("outside the model"), "{}", row.why);
}

/// Drawing fewer stars moves their light into the sky: the total stays, within what the counts (20 %) and the few
/// stars of a field leave open.
#[test]
fn no_star_counts_twice() {
    let wide =
        [("detector.size_px", "1024"), ("telescope.plate_scale_arcsec", "10.0"), ("exposures.track", "sidereal")];
    let total = |limit: &str| {
        let s = scene(&[&wide[..], &[("stars.limit_mag_v", limit)]].concat());
        let scenery = scenery(&s);
        let pixels = (1024 * 1024) as f64;
        let faint = |m: f64| m > 10.0;
        let drawn: f64 = scenery.stars.iter().filter(|x| faint(x.mag_v)).map(|x| x.electrons).sum();
        drawn / pixels + mean(&scenery, "SKYSTAR")
    };
    let (shallow, deep) = (total("10.0"), total("30.0"));
    assert!((deep / shallow - 1.0).abs() < 0.3, "{deep} e-/px against {shallow} e-/px");
}

#[test]
fn exposure_time_scales_every_mean() {
    let one = scenery(&scene(&[("exposures.duration_s", "1.0"), ("station.scintillation", "false")]));
    let ten = scenery(&scene(&[
        ("exposures.duration_s", "10.0"),
        ("station.scintillation", "false"),
        // the same middle of the exposure
        ("exposures.start", "2018-01-20T02:59:55.5Z"),
    ]));
    for (a, b) in one.sky_means.iter().zip(&ten.sky_means) {
        assert_eq!(a.keyword, b.keyword);
        assert!((b.mean_e_px / a.mean_e_px - 10.0).abs() < 1e-9, "{}", a.keyword);
    }
    assert!((ten.targets[0].electrons / one.targets[0].electrons - 10.0).abs() < 1e-9);
    assert!((ten.dark_e / one.dark_e - 10.0).abs() < 1e-12);
}

#[test]
fn the_mean_plane_holds_the_targets_electrons() {
    let s = scene(&[("stars.enabled", "false")]);
    let with = scenery(&s);
    let region = whole(&s);
    let sum = |scenery: &Scenery| {
        let mut out = vec![0.0; region.len()];
        scenery.mean_without(&region, usize::MAX, &mut out);
        out.iter().sum::<f64>()
    };
    let mut without = with.clone();
    without.targets.clear();
    let light = sum(&with) - sum(&without);
    let expected = with.targets[0].electrons * (1.0 - with.psf.lost());
    assert!((light / expected - 1.0).abs() < 5e-5, "{light} against {expected}");
    // the plane that is written is the same, in single precision
    let chip = Chip::new(&s, &with, 0, s.exposures.duration_s, &region);
    let (plane, variance) = expose::planes(&chip, &s.detector, &region);
    let plane_sum = plane.iter().map(|v| f64::from(*v)).sum::<f64>();
    assert!((plane_sum / sum(&with) - 1.0).abs() < 1e-6);
    let floor = f64::from(variance[0]) - f64::from(plane[0]);
    assert!((floor - (100.0 + 1.5 * 1.5 / 12.0)).abs() < 1e-4);
}

#[test]
fn charge_is_clipped_before_it_is_read_and_numbers_after() {
    let s = scene(&[("detector.full_well_e", "1000.0"), ("detector.bits", "12")]);
    let converter = Converter::of(&s.detector);
    let mut row = [5000.0, 200.0];
    well::clip(&mut row, s.detector.full_well_e);
    assert_eq!(row, [1000.0, 200.0]);
    // read noise may lift a full pixel above the well: the order is well, then noise
    let address =
        nightglass::base::random::Address { seed: 1, frame: 0, stage: nightglass::base::random::Stage::Read };
    let mut many = vec![1000.0; 100];
    read_noise::apply(&mut many, 0, &address, 10.0);
    assert!(many.iter().any(|e| *e > 1000.0));
    let mut adu = [0u16; 3];
    converter.apply(&[1000.0, -1e9, 1e9], &mut adu);
    assert_eq!(adu, [1667, 0, 4095]);
    assert!((converter.saturation_adu(1000.0) - (1000.0 + (1000.0 - 30.0) / 1.5)).abs() < 1e-9);
}

#[test]
fn seeds_frames_and_stages_are_independent() {
    // correlation of two frames of one mean: 4.5 standard errors of 65536 pixels
    let s = scene(&[("stars.enabled", "false"), ("exposures.count", "2"), ("exposures.cadence_s", "10.0")]);
    let other = load(
        "pogs-geo",
        &Options {
            sets: &[("detector.size_px", "256"), ("stars.enabled", "false")]
                .map(|(k, v)| (k.to_owned(), v.to_owned())),
            seed: Some(s.seed + 1),
        },
    )
    .expect("a good scene");
    let pixels = |scene: &Scene, frame: usize| {
        let simulator = Simulator::new(scene).expect("a simulator");
        let view = simulator.planner.view(frame).expect("geometry");
        let mut scenery = simulator.scenery(&view).expect("light");
        scenery.targets.clear();
        let adu = simulator.pixels(&view, &scenery, &Region { x0: 0, y0: 0, width: 256, height: 256 });
        let mean = adu.iter().map(|v| f64::from(*v)).sum::<f64>() / adu.len() as f64;
        adu.iter().map(|v| f64::from(*v) - mean).collect::<Vec<_>>()
    };
    let correlation = |a: &[f64], b: &[f64]| {
        let dot = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(p, q)| p * q).sum::<f64>();
        dot(a, b) / (dot(a, a) * dot(b, b)).sqrt()
    };
    let (first, second, seed) = (pixels(&s, 0), pixels(&s, 1), pixels(&other, 0));
    let allowed = 4.5 / 256.0;
    assert!(correlation(&first, &second).abs() < allowed);
    assert!(correlation(&first, &seed).abs() < allowed);
    assert!(correlation(&first[1..], &first[..first.len() - 1]).abs() < allowed);
    assert!(correlation(&first[256..], &first[..first.len() - 256]).abs() < allowed);
}

/// A place fixed among the stars has one azimuth and elevation, whatever its range, and that of a star there.
#[test]
fn a_fixed_place_does_not_depend_on_its_range() {
    let at = |range: &str| {
        let orbit = format!("{{ ra_deg = 60.0, dec_deg = 10.0{range} }}");
        let s = scene(&[("target.0.orbit.fixed", &orbit)]);
        let simulator = Simulator::new(&s).expect("a simulator");
        let view = simulator.planner.view(0).expect("geometry");
        let seen = view.targets[0];
        let star = view.observer.observed(seen.place.astrometric);
        let (azimuth, elevation) = nightglass::astro::observer::azimuth_elevation(star);
        // aberration of second order and light deflection: milliarcseconds
        assert!((seen.apparent.elevation - elevation).abs() < 0.01 * ARCSEC);
        assert!((seen.apparent.azimuth - azimuth).abs() * elevation.cos() < 0.01 * ARCSEC);
        seen.apparent
    };
    let far = at("");
    for range in [", range_km = 4e4", ", range_km = 1e9"] {
        assert!((at(range).elevation - far.elevation).abs() < 1e-4 * ARCSEC);
        assert!((at(range).azimuth - far.azimuth).abs() < 1e-4 * ARCSEC);
    }
}

#[test]
fn twilight_stays_finite_down_to_the_horizon() {
    let at = |elevation: &str| {
        mean(
            &scenery(&scene(&[
                ("pointing.at", "azel"),
                ("pointing.az_deg", "250.0"),
                ("pointing.el_deg", elevation),
                ("exposures.track", "sidereal"),
                ("exposures.start", "2018-01-20T01:10:00Z"),
            ])),
            "SKYTWIL",
        )
    };
    let (high, low, horizon) = (at("30.0"), at("10.0"), at("1.0"));
    assert!(high > 0.0 && low > high && horizon < 2.0 * low, "{high} {low} {horizon}");
}
