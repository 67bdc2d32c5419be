//! World coordinates: all forms of the matrix, what is refused, and what is made up where there are none.

use super::fixtures::*;
use super::*;
use crate::astro::direction;

const SIZE: [usize; 2] = [4144, 2822];

fn wcs(cards: &Cards) -> Option<FrameWcs> {
    Facts::read(cards, SIZE, &Overrides::default()).wcs
}

/// The largest difference of two matrices as a share of the pixel's side.
fn apart(a: &FrameWcs, b: &FrameWcs) -> f64 {
    let scale = a.wcs.pixel_scale();
    (a.wcs.cd - b.wcs.cd).to_cols_array().into_iter().fold(0.0, |m: f64, x| m.max(x.abs() / scale))
}

const PLAIN: [&str; 4] = ["CD1_1", "CD1_2", "CD2_1", "CD2_2"];

#[test]
fn all_forms_of_the_matrix_agree() {
    // 12.5 deg about, east to the left
    let (sin, cos) = 12.5f64.to_radians().sin_cos();
    let s = 2.7140e-4;
    let base = Cards::of(THESKYX).without(&["CROTA1", "CROTA2", "CDELT1", "CDELT2"]);
    let forms = [
        format!("CDELT1 = -{s:e}\nCDELT2 = {s:e}\nCROTA2 = 12.5"),
        format!("CD1_1 = {:e}\nCD1_2 = {:e}\nCD2_1 = {:e}\nCD2_2 = {:e}", -s * cos, -s * sin, -s * sin, s * cos),
        format!(
            "CDELT1 = -{s:e}\nCDELT2 = {s:e}\nPC1_1 = {cos}\nPC1_2 = {}\nPC2_1 = {}\nPC2_2 = {cos}",
            sin, -sin
        ),
        format!("PC1_1 = {:e}\nPC1_2 = {:e}\nPC2_1 = {:e}\nPC2_2 = {:e}", -s * cos, -s * sin, -s * sin, s * cos),
        format!(
            "CUNIT1 = 'arcsec'\nCUNIT2 = 'arcsec'\nCRVAL1 = {}\nCRVAL2 = {}\nCD1_1 = {:e}\nCD1_2 = {:e}\nCD2_1 = {:e}\nCD2_2 = {:e}",
            148.8883 * 3600.0,
            69.0653 * 3600.0,
            -s * cos * 3600.0,
            -s * sin * 3600.0,
            -s * sin * 3600.0,
            s * cos * 3600.0
        ),
        format!(
            "CTYPE1 = 'DEC--TAN'\nCTYPE2 = 'RA---TAN'\nCRVAL1 = 69.0653\nCRVAL2 = 148.8883\nCD2_1 = {:e}\nCD2_2 = {:e}\nCD1_1 = {:e}\nCD1_2 = {:e}",
            -s * cos,
            -s * sin,
            -s * sin,
            s * cos
        ),
    ];
    let all = forms.map(|form| wcs(&base.clone().with(&form)).expect("solved"));
    for other in &all {
        assert!(!other.approximate && apart(&all[0], other) < 1e-12, "{other:?}");
        assert!(separation(all[0].wcs.centre, other.wcs.centre) < 1e-12);
    }
}

#[test]
fn what_cannot_be_used_is_refused_by_name() {
    let refused = |cards: &str, keyword: &str| {
        let cards = Cards::of(THESKYX).with(cards).without(&["FOCALLEN"]);
        let f = Facts::read(&cards, SIZE, &Overrides::default());
        assert_eq!(f.wcs, None, "{keyword}");
        let missing = f.missing();
        let why = missing.iter().find(|m| m.what == "world coordinates").map(|m| m.because.clone());
        assert!(why.is_some_and(|w| w.iter().any(|n| n.concerns(keyword))), "{keyword}: {missing:?}");
    };
    refused("CTYPE1 = 'GLON-TAN'\nCTYPE2 = 'GLAT-TAN'", "CTYPE1");
    refused("CTYPE1 = 'RA---CAR'\nCTYPE2 = 'DEC--CAR'", "CTYPE1");
    refused("RADESYS = 'FK4'", "RADESYS");
    refused("RADESYS = 'FK5'\nEQUINOX = 2019.2", "RADESYS");
    refused("EQUINOX = 1950.0", "EQUINOX");
    refused("RADESYS = 'GAPPT'", "RADESYS");
    refused("LONPOLE = 0.0", "LONPOLE");
    refused("CD1_1 = 1e-4\nCD1_2 = 1e-4\nCD2_1 = 1e-4\nCD2_2 = 1e-4", "CD1_1");
    refused("CRVAL2 = 95.0", "CRVAL1");
}

#[test]
fn unknown_distortion_leaves_an_approximate_linear_part() {
    let f = Facts::read(&Cards::of(TPV), SIZE, &Overrides::default());
    assert!(f.wcs.is_some_and(|w| w.approximate && w.wcs.crpix == DVec2::new(999.0, 1999.0)));
    assert!(f.notes.iter().any(|n| n.kind == NoteKind::Refused && n.concerns("PV1_0")), "{:?}", f.notes);
    let trivial = ["PV1_0", "PV1_2", "PV2_0"];
    let f = wcs(&Cards::of(TPV).without(&trivial).with("PV1_1 = 1.0\nPV2_1 = 1.0"));
    assert!(f.is_some_and(|w| !w.approximate));
    for cards in
        ["CTYPE1 = 'RA---ZPN'\nCTYPE2 = 'DEC--ZPN'", "CTYPE1 = 'RA---TAN'\nCTYPE2 = 'DEC--TAN'\nPV2_5 = 0.1"]
    {
        assert!(wcs(&Cards::of(TPV).with(cards)).is_some_and(|w| w.approximate), "{cards}");
    }
    let sextic = Cards::of(SHARPCAP_SOLVED).with("B_0_6 = 1e-20");
    let f = Facts::read(&sextic, SIZE, &Overrides::default());
    assert!(f.wcs.is_some_and(|w| w.approximate && w.wcs.sip.is_none()));
    assert!(f.notes.iter().any(|n| n.concerns("B_0_6")));
}

/// The same frame was solved later: CD by a program that solves, angle and scale by the one that took it. Rows
/// come from the top.
#[test]
fn a_made_up_matrix_is_that_of_the_solved_frame() {
    let made_up = wcs(&Cards::of(SGP)).expect("angle and scale");
    let cards = "CD1_1 = 3.66307430802135E-05\nCD1_2 = 0.000177977827450975
        CD2_1 = -0.00017797782745097\nCD2_2 = 3.66307430802135E-05";
    let solved = wcs(&Cards::of(SGP).with(cards)).expect("solved");
    assert!(made_up.approximate && !solved.approximate);
    assert!(apart(&solved, &made_up) < 1e-3, "{made_up:?} {solved:?}");
}

#[test]
fn rows_flips_and_mirrors_turn_the_made_up_matrix() {
    let cd = |cards: &str| {
        let base = "RA = 10.0\nDEC = 20.0\nEQUINOX = 2000\nPIXSCALE = 2.0\nROTATANG = 30";
        let found = wcs(&Cards::of(base).with(cards)).expect("angle and scale");
        (found.wcs.cd * (1.0 / (2.0 * ARCSEC)), found.wcs.crpix)
    };
    let (plain, crpix) = cd("");
    assert_eq!(crpix, DVec2::new(2071.5, 1410.5));
    // 30 deg from north through east: up is (0.5, 0.866), right, 90 deg clockwise of it on the sky, is (-0.866,
    // 0.5)
    let near = |a: DVec2, b: DVec2| assert!((a - b).length() < 1e-9, "{a} {b}");
    near(plain.y_axis, DVec2::new(0.5, 0.75f64.sqrt()));
    near(plain.x_axis, DVec2::new(-(0.75f64.sqrt()), 0.5));
    for (cards, x, y) in [
        ("ROWORDER = 'TOP-DOWN'", 1.0, -1.0),
        ("ROWORDER = 'BOTTOM-UP'", 1.0, 1.0),
        ("FLIPSTAT = 'Mirror'", -1.0, 1.0),
        ("FLIPSTAT = 'Flip'", 1.0, -1.0),
        ("FLIPSTAT = 'Flip/Mirror'", -1.0, -1.0),
        ("FLIPPED = T", 1.0, -1.0),
        ("ROWORDER = 'TOP-DOWN'\nFLIPPED = T", 1.0, 1.0),
    ] {
        let (turned, _) = cd(cards);
        near(turned.x_axis, plain.x_axis * x);
        near(turned.y_axis, plain.y_axis * y);
    }
}

#[test]
fn the_users_scale_and_angle_make_it_approximate() {
    let overrides = Overrides {
        pixel_scale_arcsec: Some(1.5),
        rotation_deg: Some(90.0),
        mirrored: Some(true),
        ..Overrides::default()
    };
    let f = Facts::read(&Cards::of(OURS), [4096, 4096], &overrides);
    let made = f.wcs.expect("made up");
    assert!(made.approximate && made.wcs.crpix == DVec2::splat(2047.5));
    let cd = made.wcs.cd * (1.0 / (1.5 * ARCSEC));
    // +y goes east; +x would go north, and south if mirrored
    assert!((cd.y_axis - DVec2::X).length() < 1e-9 && (cd.x_axis + DVec2::Y).length() < 1e-9, "{cd}");
    // no header at all but what the user says
    let overrides =
        Overrides { pointing_deg: Some([80.0, 5.0]), pixel_scale_arcsec: Some(1.5), ..Overrides::default() };
    let f = Facts::read(&Cards::default(), [4096, 4096], &overrides);
    let made = f.wcs.expect("made up");
    assert!(separation(made.wcs.centre, direction(80f64.to_radians(), 5f64.to_radians())) < 1e-12);
    let needs: Vec<_> = f.missing().into_iter().map(|m| m.option).collect();
    assert_eq!(needs, ["--exptime", "--time", "--gain"]);
    // the user's scale alone keeps the solved orientation
    let overrides = Overrides { pixel_scale_arcsec: Some(0.7243), ..Overrides::default() };
    let solved = wcs(&Cards::of(OURS)).expect("solved");
    let made = Facts::read(&Cards::of(OURS), [4096, 4096], &overrides).wcs.expect("made up");
    assert!(apart(&solved, &made) < 2e-3);
}

#[test]
fn the_matrix_of_theskyx_is_the_plain_one() {
    assert!(PLAIN.iter().all(|k| Cards::of(THESKYX).number(k).is_none()));
    let found = wcs(&Cards::of(THESKYX)).expect("solved");
    // not mirrored: a positive CROTA2 turns +y from north towards west
    assert!(found.wcs.cd.determinant() < 0.0);
    assert!((found.wcs.cd.y_axis.x / found.wcs.cd.y_axis.y + 12.5f64.to_radians().tan()).abs() < 1e-12);
}
