use super::synthetic::{Case, Dice, Made, world};
use super::*;
use crate::astro::direction;

impl Made {
    fn solve(&self, size: usize) -> Result<Solution, Refusal> {
        solve(&self.detections, &self.stars, &self.header, [size; 2], &Search::default())
    }

    /// Median and largest distance of the stars' places by a map from the true ones \[px\].
    fn errors(&self, wcs: &Wcs) -> [f64; 2] {
        let off = |(place, sky): &(DVec2, DVec3)| wcs.pixel(*sky).map_or(f64::INFINITY, |at| at.distance(*place));
        let mut off: Vec<f64> = self.places.iter().map(off).collect();
        off.sort_by(f64::total_cmp);
        [off[off.len() / 2], off[off.len() - 1]]
    }
}

/// Solves frames of many seeds; the median error at the stars is that of noise in the fit, and 0.05 px of anything else.
/// Noise: the mean variance of a fit of p parameters to n pairs is sigma^2 p / (2 n) per axis; 3.5 times that for its spread
/// from frame to frame, and for stars between the pairs.
fn solved(case: Case, seeds: std::ops::Range<u64>) -> Vec<Solution> {
    let solved = |seed| {
        let made = case.make(seed);
        let solution = made.solve(case.size).unwrap_or_else(|e| panic!("{case:?} {seed}: {e}"));
        let noise =
            case.sigma * (solution.model.parameters() as f64 / (2.0 * solution.matches.len() as f64)).sqrt();
        let [median, _] = made.errors(&solution.wcs);
        assert!(
            median < 0.05 + 3.5 * noise,
            "{case:?} {seed}: {median} px, noise {noise} px, {:?}",
            solution.model
        );
        assert!(solution.log10_false < -5.0 && solution.error_in_corner >= solution.error_at_reference);
        solution
    };
    seeds.map(solved).collect()
}

/// Offsets of 0 to 0.5 deg, rotations of -5 to 5 deg, scales by 2 per cent, half of the detections false.
#[test]
fn frames_of_8_to_2000_stars_are_solved() {
    for (detected, catalogue, bent, seeds) in [
        (8, 8, 0.0, 20),
        (8, 60, 0.0, 20),
        (12, 12, 0.0, 20),
        (12, 100, 1.0, 20),
        (20, 30, 3.0, 20),
        (50, 80, 5.0, 20),
        (300, 500, 5.0, 10),
        (2000, 3000, 8.0, 3),
        (1000, 5000, 8.0, 3),
    ] {
        for k in 0..seeds {
            let [offset, rotation, stretch] =
                [[0.0, 5.0, -0.02], [0.5, -5.0, 0.02], [0.25, 0.0, 0.0], [0.5, 5.0, -0.02]][k as usize % 4];
            solved(Case { detected, catalogue, bent, offset, rotation, stretch, ..Case::default() }, k..k + 1);
        }
    }
}

/// A small camera sees a 56th of the cone, a wide one the projection's curvature (1 px at 0.5 deg of offset).
#[test]
fn small_and_wide_cameras_are_solved() {
    let small = Case { size: 1024, scale: 0.5, offset: 0.5, bent: 0.5, ..Case::default() };
    solved(Case { detected: 8, catalogue: 8, bent: 0.0, ..small }, 0..20);
    solved(Case { detected: 8, catalogue: 40, bent: 0.0, ..small }, 0..20);
    solved(Case { detected: 100, catalogue: 200, ..small }, 0..5);
    let wide = Case { scale: 5.0, offset: 0.5, rotation: 5.0, stretch: -0.02, ..Case::default() };
    solved(Case { detected: 8, catalogue: 20, bent: 0.0, ..wide }, 0..10);
    solved(Case { detected: 300, catalogue: 500, bent: 8.0, ..wide }, 0..10);
}

#[test]
fn poles_and_the_meridian_of_right_ascension_0_are_places_like_others() {
    for at in [[123.0, 89.5], [10.0, 89.99], [77.0, -90.0], [0.001, -30.0], [359.99, 4.0]] {
        let case = Case { at, offset: 0.5, rotation: 4.0, missing: 0.3, catalogue: 100, ..Case::default() };
        solved(case, 0..6);
    }
}

#[test]
fn a_third_missing_in_the_catalogue_and_half_of_the_detections_false() {
    let case = Case { missing: 0.3, rotation: -5.0, stretch: 0.02, offset: 0.5, ..Case::default() };
    solved(case, 0..20);
    solved(Case { detected: 300, catalogue: 500, ..case }, 0..5);
}

/// Magnitudes off by 1, and the 15 brightest stars not detected.
#[test]
fn passbands_and_saturation_do_no_harm() {
    for [detected, catalogue] in [[30, 60], [200, 400], [500, 2500]] {
        solved(Case { detected, catalogue, colour: 1.0, saturated: 15, ..Case::default() }, 0..8);
    }
}

/// What was wrong with the header is told, with the signs documented.
#[test]
fn offset_rotation_and_scale_are_those_of_the_header() {
    for s in solved(Case { detected: 100, catalogue: 200, stretch: 0.015, ..Case::default() }, 0..10) {
        assert!((s.offset.to_degrees() - 0.3).abs() < 1e-4, "{}", s.offset.to_degrees());
        // the header is turned by 2 deg from east to north against the truth
        assert!((s.rotation.to_degrees() + 2.0).abs() < 5e-3, "{}", s.rotation.to_degrees());
        assert!((s.scale * 1.015 - 1.0).abs() < 1e-4, "{}", s.scale);
    }
}

/// Residuals are noise of the sigma given: chi-square of 10 frames with 14,000 degrees of freedom in all lies within 4 standard
/// deviations of them (less 0.3 per cent that the clipping of the largest takes), and the pairs are true ones.
#[test]
fn residuals_are_the_detections_noise() {
    let case = Case { detected: 700, catalogue: 900, bent: 4.0, tilt: 0.8, spurious: 0.4, ..Case::default() };
    let found = solved(case, 0..10);
    let (chi, free) =
        found.iter().fold((0.0, 0.0), |s, f| (s.0 + f.chi_square, s.1 + f.degrees_of_freedom as f64));
    assert!((chi / free - 0.998).abs() < 4.0 * (2.0 / free).sqrt() + 0.004, "{chi} {free}");
    for (seed, s) in found.iter().enumerate() {
        let made = case.make(seed as u64);
        let right = |m: &&Match| {
            let star = made.stars[m.star].direction;
            made.truth
                .pixel(star)
                .is_some_and(|at| at.distance(made.detections[m.detection].at) < 5.0 * case.sigma)
        };
        assert!(s.matches.iter().filter(right).count() + 3 >= s.matches.len() && s.matches.len() > 680);
        assert!((s.rms_residual - 0.1).abs().max_element() < 0.01 && s.extra_scatter < 0.05);
        // the median of the modulus of a normal number is 0.6745
        assert!((s.median_residual - 0.067).abs().max_element() < 0.01);
    }
}

/// Tilted and sheared plates need second order, strong barrels third, and straight ones neither.
#[test]
fn the_order_is_that_of_the_distortion() {
    let case = Case { detected: 300, catalogue: 400, bent: 0.0, ..Case::default() };
    assert!(solved(Case { tilt: 2.0, ..case }, 0..6).iter().filter(|s| s.model == Model::Sip(2)).count() > 3);
    assert!(solved(Case { bent: 15.0, tilt: 1.0, ..case }, 0..6).iter().all(|s| s.model >= Model::Sip(3)));
    let straight = solved(case, 0..20);
    assert!(straight.iter().filter(|s| s.model == Model::Similarity).count() >= 14);
}

/// The distortion that a header tells is kept where few stars tell none: 8 stars, 6 px in the corners.
#[test]
fn a_known_distortion_is_kept() {
    let case = Case { detected: 8, catalogue: 30, bent: 6.0, ..Case::default() };
    for seed in 0..10 {
        let mut made = case.make(seed);
        made.header.sip = made.truth.sip;
        let s = made.solve(case.size).expect("solved");
        let [median, _] = made.errors(&s.wcs);
        assert!(median < 0.27, "{seed} {median} {:?}", s.model);
    }
}

/// Of mirrored pixels nothing is made unless that is asked for; then the flip is told.
#[test]
fn flipped_pixels_are_found_if_asked_for() {
    let case = Case { mirrored: true, detected: 30, catalogue: 50, ..Case::default() };
    for seed in 0..3 {
        let made = case.make(seed);
        assert!(matches!(made.solve(case.size), Err(Refusal::NotSignificant { .. })));
        let search = Search { flipped: true, ..Search::default() };
        let s = solve(&made.detections, &made.stars, &made.header, [case.size; 2], &search).expect("solved");
        assert_eq!(s.flip, DVec2::new(-1.0, 1.0));
        assert!(made.errors(&s.wcs)[0] < 0.1);
    }
}

/// Any rotation, if the search allows it.
#[test]
fn a_camera_put_on_the_wrong_way_round_is_found() {
    for (seed, rotation) in [(1, 170.0), (2, -91.0), (3, 45.0)] {
        let made = Case { rotation, detected: 40, catalogue: 60, ..Case::default() }.make(seed);
        let search = Search { rotation: std::f64::consts::PI, ..Search::default() };
        let s = solve(&made.detections, &made.stars, &made.header, [4096; 2], &search).expect("solved");
        assert!((s.rotation.to_degrees() + rotation).abs() < 0.01 && made.errors(&s.wcs)[0] < 0.1);
    }
}

/// Detections strewn at random: 0 of 200 frames are solved, so fewer than 1.5 per cent are at 95 per cent confidence; and as the
/// expected number of alignments is counted, none of 200 comes near 1 in 200.
#[test]
fn random_detections_are_refused() {
    let small = Case { size: 1024, scale: 0.5, detected: 8, catalogue: 40, ..Case::default() };
    let wide = Case { scale: 5.0, detected: 300, catalogue: 500, ..Case::default() };
    let many = Case { detected: 300, catalogue: 500, ..Case::default() };
    let cluster = Case { clustered: 0.5, detected: 100, catalogue: 300, ..Case::default() };
    for (case, trials) in [(Case::default(), 70), (small, 20), (wide, 60), (many, 20), (cluster, 30)] {
        for seed in 0..trials {
            let mut made = case.make(seed);
            let mut dice = Dice(seed + 1000);
            for detection in &mut made.detections {
                let (anywhere, beside) = (DVec2::new(dice.uniform(), dice.uniform()), dice.normal());
                // a cluster stays one, of other stars
                let inside = detection.at.distance(DVec2::new(0.6, 0.45) * 4096.0) < 400.0 && case.clustered > 0.0;
                detection.at = if inside { detection.at + 60.0 * beside } else { anywhere * case.size as f64 };
            }
            match made.solve(case.size) {
                Err(Refusal::NotSignificant { log10_false, .. }) => assert!(log10_false > -1.0, "{log10_false}"),
                other => panic!("{case:?} {seed}: {other:?}"),
            }
        }
    }
}

/// Half of all stars in a crowd of 140 px, which holds nearly all bright ones.
#[test]
fn a_dense_cluster_is_solved() {
    for (detected, catalogue) in [(60, 100), (300, 800)] {
        solved(Case { detected, catalogue, clustered: 0.6, bent: 2.0, ..Case::default() }, 0..10);
    }
}

/// Stars on a line tell shift, rotation and scale, no shear and no distortion across.
#[test]
fn collinear_stars_give_a_similarity() {
    let case = Case { collinear: true, detected: 30, catalogue: 40, bent: 0.0, offset: 0.1, ..Case::default() };
    for seed in 0..10 {
        let made = case.make(seed);
        match made.solve(case.size) {
            Ok(s) => {
                assert_eq!(s.model, Model::Similarity);
                assert!(made.errors(&s.wcs)[0] < 0.1);
            }
            Err(e) => panic!("{e}"),
        }
    }
}

/// The satellite, by far the brightest, a row of hot pixels, and three pieces of each of ten trails.
#[test]
fn a_bright_target_hot_rows_and_broken_trails_do_no_harm() {
    let case = Case { spurious: 0.2, ..Case::default() };
    for seed in 0..10 {
        let mut made = case.make(seed);
        let hot = |k: i32| Detection { at: DVec2::new(700.0, 20.0 * f64::from(k)), flux: 1e3, sigma: 0.1 };
        let pieces: Vec<Detection> = made.detections[..10]
            .iter()
            .flat_map(|d| [-9.0, 9.0].map(|x| Detection { at: d.at + DVec2::new(x, 1.0), ..*d }))
            .collect();
        made.detections.extend((0..20).map(hot).chain(pieces));
        made.detections.push(Detection { at: DVec2::splat(2048.0), flux: 1e9, sigma: 0.01 });
        let s = made.solve(case.size).expect("solved");
        assert!(made.errors(&s.wcs)[0] < 0.15 && s.matches.len() >= 40, "{:?}", made.errors(&s.wcs));
    }
}

#[test]
fn the_order_of_the_lists_does_not_matter() {
    let mut made = Case::default().make(5);
    let first = made.solve(4096).expect("solved");
    assert_eq!(made.solve(4096).expect("solved"), first);
    made.detections.reverse();
    made.stars.reverse();
    let (second, count) = (made.solve(4096).expect("solved"), made.detections.len());
    assert_eq!(second.wcs, first.wcs);
    assert_eq!(count - 1 - second.matches[0].detection, first.matches[0].detection);
}

#[test]
fn numbers_that_are_none_are_passed_over() {
    let mut made = Case::default().make(2);
    let nan = f64::NAN;
    for (at, flux, sigma) in [
        (DVec2::NAN, 1.0, 0.1),
        (DVec2::splat(9.0), nan, nan),
        (DVec2::INFINITY, f64::INFINITY, 0.1),
        (DVec2::splat(-1e300), 1.0, -1.0),
        (DVec2::splat(77.0), f64::INFINITY, f64::INFINITY),
        (DVec2::splat(99.0), f64::NEG_INFINITY, 0.0),
    ] {
        made.detections.push(Detection { at, flux, sigma });
    }
    for direction in [DVec3::NAN, DVec3::ZERO, DVec3::INFINITY, -made.header.centre, made.header.centre * 1e300] {
        made.stars.push(FieldStar { direction, mag_v: nan, colour_bv: f64::NAN });
    }
    let s = made.solve(4096).expect("solved");
    assert!(made.errors(&s.wcs)[0] < 0.1);
    for detection in &mut made.detections {
        (detection.flux, detection.sigma) = (nan, nan);
    }
    assert!(made.solve(4096).is_ok_and(|s| made.errors(&s.wcs)[0] < 0.1));
}

#[test]
fn nothing_and_what_is_out_of_range_is_refused() {
    let made = Case::default().make(2);
    let few = |d: usize, s: usize| {
        solve(&made.detections[..d], &made.stars[..s], &made.header, [4096; 2], &Search::default())
    };
    for (d, s) in [(0, 0), (0, 100), (100, 0), (4, 100), (100, 4)] {
        match few(d, s) {
            Err(Refusal::TooFew { detections, stars_near, needed: 5, .. }) => {
                assert!(detections == d && stars_near <= s);
            }
            other => panic!("{other:?}"),
        }
    }
    let one_place = vec![Detection { at: DVec2::splat(5.0), flux: 1.0, sigma: 0.1 }; 50];
    let stars = vec![FieldStar { direction: made.header.centre, mag_v: 5.0, colour_bv: f64::NAN }; 50];
    for (d, s) in [(&one_place, &made.stars), (&made.detections, &stars), (&one_place, &stars)] {
        let refused = solve(d, s, &made.header, [4096; 2], &Search::default()).expect_err("refused");
        assert!(matches!(refused, Refusal::NotSignificant { .. }), "{refused}");
    }
    let out = |change: &dyn Fn(&mut Search, &mut Wcs, &mut [usize; 2])| {
        let (mut search, mut header, mut size) = (Search::default(), made.header, [4096; 2]);
        change(&mut search, &mut header, &mut size);
        let result = solve(&made.detections, &made.stars, &header, size, &search);
        assert!(matches!(result, Err(Refusal::Range { .. })), "{result:?}");
    };
    out(&|search, _, _| search.offset = f64::NAN);
    out(&|search, _, _| search.scale = 0.5);
    out(&|search, _, _| search.rotation = -0.1);
    out(&|search, _, _| search.distortion_px = 0.0);
    out(&|_, header, _| header.cd = DMat2::ZERO);
    out(&|_, header, _| header.cd = DMat2::NAN);
    out(&|_, header, _| header.crpix.x = f64::INFINITY);
    out(&|_, header, _| header.centre = DVec3::NAN);
    out(&|_, _, size| *size = [0, 4096]);
    out(&|_, _, size| *size = [usize::MAX, 4096]);
}

/// The neighbour's camera is turned on its mount; the borrowed map is right to the error stated, and says how far it was carried.
#[test]
fn a_borrowed_solution_is_right_within_its_error() {
    let camera = Case { detected: 200, catalogue: 300, at: [200.0, 40.0], bent: 4.0, ..Case::default() };
    for seed in 0..10 {
        let made = camera.make(seed);
        let lender = made.solve(camera.size).expect("solved");
        // both headers and both truths turned alike
        let turn = glam::DMat3::from_axis_angle(direction(seed as f64, 0.6), 0.05);
        let turned = |wcs: &Wcs| {
            let centre = turn * wcs.centre;
            let cd = fit::carried(wcs.cd, wcs.centre, turn);
            fit::about(centre, wcs.crpix, cd, wcs.sip)
        };
        let (header, truth) = (turned(&made.header), turned(&made.truth));
        let borrowed = borrow(&lender, &made.header, &header, 1e-7).expect("borrowed");
        let at_centre = borrowed.wcs.sky(truth.crpix).distance(truth.centre);
        assert!(at_centre < 3.0 * borrowed.error, "{at_centre} {}", borrowed.error);
        for corner in [DVec2::ZERO, DVec2::splat(4095.0), DVec2::new(4095.0, 0.0)] {
            let off = borrowed.wcs.pixel(truth.sky(corner)).expect("in front").distance(corner);
            assert!(off < 3.0 * borrowed.error_in_corner_px, "{off} {}", borrowed.error_in_corner_px);
        }
        assert!(borrowed.distance <= 0.0501 && borrowed.error >= 1e-7);
        let itself = borrow(&lender, &made.header, &made.header, 0.0).expect("borrowed");
        assert!((itself.wcs.centre - lender.wcs.centre).length() < 1e-15 && itself.distance == 0.0);
    }
}

#[test]
fn other_cameras_do_not_lend() {
    let made = Case::default().make(1);
    let lender = made.solve(4096).expect("solved");
    let other = world(made.header.centre, 4096, 0.8, 30.0, 0.0, false);
    let mirrored = world(made.header.centre, 4096, 0.7272, 30.0, 0.0, true);
    let mut nowhere = made.header;
    nowhere.centre = DVec3::NAN;
    for header in [other, mirrored, nowhere] {
        assert!(matches!(borrow(&lender, &made.header, &header, 0.0), Err(Refusal::Range { .. })));
    }
    assert!(borrow(&lender, &made.header, &made.header, f64::NAN).is_err());
}
