//! The light of single stars in a frame's mean, and points and trails at their extremes.

use glam::{DVec2, DVec3};
use nightglass::camera::chip::Incident;
use nightglass::camera::path::Path;
use nightglass::camera::point_source::PointSource;
use nightglass::camera::region::Region;
use nightglass::camera::scenery::Scenery;
use nightglass::scene::{Options, Scene, load};
use nightglass::simulate::Simulator;

const SIZE: usize = 300;

fn scene(more: &[(&str, &str)]) -> Scene {
    let base = [
        ("detector.size_px", "300"),
        ("stars.enabled", "false"),
        ("detector.dark_e_per_s", "0.0"),
        ("sky.airglow", "off"),
        ("sky.pollution", "off"),
        ("sky.twilight", "off"),
        ("sky.starlight", "off"),
        ("sky.moonlight", "off"),
        ("sky.zodiacal", "off"),
    ];
    let sets = base.iter().chain(more).map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect::<Vec<_>>();
    load("pogs-geo", &Options { sets: &sets, seed: None }).expect("a good scene")
}

fn scenery(more: &[(&str, &str)], targets: Vec<PointSource>) -> Scenery {
    let scene = scene(more);
    let simulator = Simulator::new(&scene).expect("a simulator");
    let view = simulator.planner.view(0).expect("geometry");
    let mut scenery = simulator.scenery(&view).expect("light");
    scenery.lost_e_px = 0.0;
    scenery.targets = targets;
    scenery
}

fn source(mid: DVec2, half: DVec2) -> PointSource {
    let path = Path { start: mid - half, mid, end: mid + half };
    PointSource { id: 0, icrs: DVec3::X, mag_v: 10.0, path, electrons: 1e5, coloured: true }
}

/// The mean plane of a frame, and its sum.
fn plane(scenery: &Scenery) -> (Vec<f64>, f64) {
    let region = Region { x0: 0, y0: 0, width: SIZE, height: SIZE };
    let mut out = vec![0.0; region.len()];
    scenery.add(&region, &mut out);
    let sum = out.iter().sum();
    (out, sum)
}

/// Drawn and lost light are all there is, 1e-6 of it, of points and trails, straight and along the frame.
#[test]
fn the_light_of_each_star_is_accounted_for() {
    for psf in ["gaussian", "moffat", "kolmogorov"] {
        for (mid, half) in [
            (DVec2::new(150.0, 150.0), DVec2::ZERO),
            (DVec2::new(149.37, 151.5), DVec2::ZERO),
            (DVec2::new(150.2, 149.9), DVec2::new(30.0, 7.7)),
            (DVec2::new(150.2, 149.9), DVec2::new(0.3, -0.2)),
        ] {
            // a narrow image: the wings of turbulence stay on the frame
            let s = scenery(&[("telescope.psf", psf), ("station.seeing_arcsec", "1.2")], vec![source(mid, half)]);
            let (_, sum) = plane(&s);
            let reaches = s.psf.radius() as f64 + half.length() < 140.0;
            let missing = 1.0 - sum / 1e5 - s.psf.lost();
            assert!(!reaches || missing.abs() < 1e-6, "{psf} at {mid}: {missing:e}");
        }
    }
    // what is lost is put back evenly
    let scene = scene(&[]);
    let simulator = Simulator::new(&scene).expect("a simulator");
    let view = simulator.planner.view(0).expect("geometry");
    let whole = simulator.scenery(&view).expect("light");
    let (_, sum) = plane(&whole);
    assert!((sum / whole.targets[0].electrons - 1.0).abs() < 1e-6, "{sum}");
}

/// A star on the border, on a corner and beyond gives the frame its share: that of a symmetrical image.
#[test]
fn stars_on_the_border_give_their_share() {
    let share = |x: f64, y: f64| {
        let s = scenery(&[("telescope.psf", "gaussian")], vec![source(DVec2::new(x, y), DVec2::ZERO)]);
        plane(&s).1 / 1e5 / (1.0 - s.psf.lost())
    };
    assert!((share(-0.5, 150.0) - 0.5).abs() < 1e-6 && (share(299.5, 40.3) - 0.5).abs() < 1e-6);
    assert!((share(-0.5, -0.5) - 0.25).abs() < 1e-6 && (share(299.5, 299.5) - 0.25).abs() < 1e-6);
    assert!((share(0.0, 20.0) + share(-1.0, 20.0) - 1.0).abs() < 1e-6);
    for far in [-60.0, 360.0, 1e6, -1e6, 1e300, f64::INFINITY, f64::NAN] {
        assert_eq!(share(far, 150.0), 0.0, "{far}");
    }
}

/// Ends and middle of a trail are where the source was: the light is even between them.
#[test]
fn trails_lie_between_their_ends() {
    let (mid, half) = (DVec2::new(150.3, 120.6), DVec2::new(60.0, 0.0));
    let s = scenery(&[("telescope.psf", "gaussian"), ("station.seeing_arcsec", "1.5")], vec![source(mid, half)]);
    let (out, _) = plane(&s);
    let column = |x: usize| (0..SIZE).map(|y| out[y * SIZE + x]).sum::<f64>();
    // half of the light of a full column where the trail ends: interpolated between neighbours
    let full = column(150);
    let at = |x: f64| {
        let (below, t) = (x.floor(), x - x.floor());
        column(below as usize) * (1.0 - t) + column(below as usize + 1) * t
    };
    assert!((full / (1e5 / 120.0 * (1.0 - s.psf.lost())) - 1.0).abs() < 1e-4);
    for end in [mid.x - half.x, mid.x + half.x] {
        assert!((at(end) / full - 0.5).abs() < 0.01, "{end}: {}", at(end) / full);
    }
    let moment = (0..SIZE).map(|x| x as f64 * column(x)).sum::<f64>() / (0..SIZE).map(column).sum::<f64>();
    assert!((moment - mid.x).abs() < 1e-4, "{moment}");
}

/// A trail of 1e5 px crosses the frame with the light of its part there; one that turns within the exposure keeps its own.
#[test]
fn extreme_trails_give_the_light_that_falls_on_the_frame() {
    let s = scenery(&[("telescope.psf", "gaussian")], vec![source(DVec2::splat(149.5), DVec2::new(5e4, 0.0))]);
    let (_, sum) = plane(&s);
    assert!((sum / (1e5 * 300.0 / 1e5) - 1.0).abs() < 1e-4, "{sum}");
    let mut turning = source(DVec2::new(200.0, 150.0), DVec2::ZERO);
    turning.path.start = DVec2::new(100.0, 150.0);
    turning.path.end = DVec2::new(100.0, 150.0);
    let s = scenery(&[("telescope.psf", "gaussian")], vec![turning]);
    let (_, sum) = plane(&s);
    assert!((1.0 - sum / 1e5 - s.psf.lost()).abs() < 1e-6, "{sum}");
    let zero = scenery(&[("telescope.psf", "gaussian")], vec![source(DVec2::splat(150.0), DVec2::splat(1e-9))]);
    let still = scenery(&[("telescope.psf", "gaussian")], vec![source(DVec2::splat(150.0), DVec2::ZERO)]);
    assert_eq!(plane(&zero).0, plane(&still).0);
}

/// A rolling shutter: a source that moves up with the rows is seen for longer, one that moves across leans.
#[test]
fn a_rolling_shutter_shifts_what_moves() {
    let path =
        Path { start: DVec2::new(100.0, 150.0), mid: DVec2::new(110.0, 150.0), end: DVec2::new(120.0, 150.0) };
    // a thousandth of an exposure a row: row 150 opens 0.15 exposures late
    let (rolled, share) = path.rolled(1e-3);
    assert!((share - 1.0).abs() < 1e-9 && rolled.start.distance(DVec2::new(103.0, 150.0)) < 1e-9, "{rolled:?}");
    let up = Path { start: DVec2::new(50.0, 0.0), mid: DVec2::new(50.0, 100.0), end: DVec2::new(50.0, 200.0) };
    let (rolled, share) = up.rolled(1e-3);
    // t = 1e-3 y and y = 200 t: opens at y = 0, closes where y = 200 (1 + 1e-3 y)
    assert!((share - 1.25).abs() < 1e-6 && (rolled.end.y - 250.0).abs() < 1e-6, "{share} {rolled:?}");
    let (still, share) = Path::still(DVec2::splat(7.0)).rolled(0.01);
    assert!(share == 1.0 && still.start.distance(DVec2::splat(7.0)) < 1e-12 && still.length() < 1e-12);
}

/// Images far narrower than a pixel keep their light, and the frame has its part of one far wider than it.
#[test]
fn narrow_and_wide_images_lose_what_they_must() {
    let lost = |sets: &[(&str, &str)]| {
        let scene = scene(sets);
        let simulator = Simulator::new(&scene).expect("a simulator");
        let view = simulator.planner.view(0).expect("geometry");
        let scenery = simulator.scenery(&view).expect("light");
        (scenery.psf.lost(), scenery.lost_e_px / scenery.targets[0].electrons)
    };
    for psf in ["gaussian", "moffat", "kolmogorov"] {
        let (share, _) = lost(&[("telescope.psf", psf), ("telescope.plate_scale_arcsec", "600.0")]);
        assert!(share < 2e-3, "{psf}: {share}");
    }
    let wide =
        [("station.seeing_arcsec", "60.0"), ("telescope.plate_scale_arcsec", "0.12"), ("detector.size_px", "64")];
    let (share, pedestal) = lost(&wide);
    assert!(share > 1e-2 && pedestal * 64.0 * 64.0 < 1e-2 * share, "{share} {pedestal}");
}

/// A frame of one pixel, and images far wider than the frame.
#[test]
fn frames_and_images_of_any_size_are_finite() {
    for sets in [
        &[("detector.size_px", "1"), ("telescope.psf", "airy")][..],
        &[("station.seeing_arcsec", "60.0"), ("telescope.plate_scale_arcsec", "0.12")],
        &[
            ("station.seeing_arcsec", "0.07"),
            ("telescope.aperture_m", "100.0"),
            ("telescope.obstruction_m", "0.0"),
        ],
        &[("telescope.psf", "airy"), ("telescope.obstruction_m", "0.3555")],
    ] {
        let scene = scene(sets);
        let simulator = Simulator::new(&scene).expect("a simulator");
        let view = simulator.planner.view(0).expect("geometry");
        let scenery = simulator.scenery(&view).expect("light");
        let [width, height] = scene.detector.light_px();
        let region = Region { x0: 0, y0: 0, width, height };
        let adu = simulator.pixels(&view, &scenery, &region);
        assert_eq!(adu.len(), width * height, "{sets:?}");
        assert!(scenery.psf.lost().is_finite() && scenery.lost_e_px >= 0.0, "{sets:?}");
    }
}
