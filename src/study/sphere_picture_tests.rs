use super::sphere_picture::{Arrow, Image, image};
use crate::inversion::sphere::{fibonacci, tangents};
use crate::object::convex::Facet;
use glam::{DMat2, DVec2, DVec3};

fn facet(normal: DVec3, area: f64) -> Facet {
    Facet { normal, area }
}

/// The texts of a picture, which must be XML of less than 3 MB without a number that is none.
fn texts(svg: &str) -> String {
    assert!(svg.len() < 3_000_000, "{} bytes", svg.len());
    let page = roxmltree::Document::parse(svg).expect("XML");
    assert!(!svg.contains("NaN"));
    page.descendants().filter(|n| n.has_tag_name("text")).filter_map(|n| n.text()).collect::<Vec<_>>().join("\n")
}

/// Middles and radii of the discs with a fill opacity or none.
fn discs(svg: &str) -> Vec<(DVec2, f64)> {
    let page = roxmltree::Document::parse(svg).expect("XML");
    let circles = page.descendants().filter(|n| n.has_tag_name("circle") && n.has_attribute("stroke-opacity"));
    let number =
        |n: &roxmltree::Node, name: &str| n.attribute(name).and_then(|v| v.parse().ok()).expect("a number");
    circles.map(|n| (DVec2::new(number(&n, "cx"), number(&n, "cy")), number(&n, "r"))).collect()
}

#[test]
fn discs_have_the_areas_of_facets_and_lie_where_lambert_says() {
    let tilt = 50f64.to_radians();
    let at = DVec3::new(tilt.sin() * 0.6, tilt.sin() * 0.8, tilt.cos());
    let facets = vec![
        Arrow::round(facet(DVec3::Z, 4.0), 0.02, true),
        Arrow::round(facet(at, 1.0), 0.02, false),
        Arrow::round(facet(DVec3::NEG_Z, 0.25), 0.02, true),
    ];
    let svg = image(&Image { facets, ..Image::default() }, "three");
    let discs = discs(&svg);
    assert_eq!(discs.len(), 3);
    // the largest first; radii as roots of areas, to the 0.1 px of the file
    assert!((discs[0].1 / discs[1].1 - 2.0).abs() < 0.02 && (discs[1].1 / discs[2].1 - 2.0).abs() < 0.04);
    // Snyder 1987 eq. 24-3: sqrt(2) sin(t/2) in units of the rim, 236 px
    let offset = discs[1].0 - discs[0].0;
    let expected = DVec2::new(0.6, -0.8) * 236.0 * 2f64.sqrt() * (0.5 * tilt).sin();
    assert!((offset - expected).length() < 0.2, "{offset} {expected}");
    assert!(discs[2].0.x > 600.0);
    // from -z, +x is to the left
    let facets = vec![Arrow::round(facet(DVec3::new(0.3, 0.5, -0.8), 1.0), 0.02, true)];
    let offset = self::discs(&image(&Image { facets, ..Image::default() }, "below"))[0].0 - discs[2].0;
    assert!((offset.x / offset.y - 0.6).abs() < 0.01 && offset.y < 0.0, "{offset}");
}

#[test]
fn facets_near_the_rim_are_in_both_hemispheres() {
    for (z, count) in [(0.0, 2), (0.1, 2), (-0.1, 2), (0.5, 1)] {
        let facets = vec![Arrow::round(facet(DVec3::new(1.0, 0.0, z), 1.0), 0.01, true)];
        assert_eq!(discs(&image(&Image { facets, ..Image::default() }, "rim")).len(), count, "{z}");
    }
}

#[test]
fn half_axes_of_a_covariance_give_it_back() {
    for covariance in [
        DMat2::from_diagonal(DVec2::new(4.0, 1.0)),
        DMat2::from_diagonal(DVec2::new(1.0, 4.0)),
        DMat2::from_cols(DVec2::new(2.0, -0.7), DVec2::new(-0.7, 0.5)),
        DMat2::from_diagonal(DVec2::splat(2.0)),
    ] {
        let normal = DVec3::new(0.3, -0.5, 0.7).normalize();
        let arrow = Arrow::with_covariance(facet(normal, 1.0), covariance, true);
        let [e1, e2] = tangents(normal);
        let flat = arrow.half_axes.map(|a| DVec2::new(a.dot(e1), a.dot(e2)));
        let entry = |i: usize, j: usize| flat.iter().map(|a| a[i] * a[j]).sum::<f64>();
        for (i, j) in [(0, 0), (0, 1), (1, 1)] {
            assert!((entry(i, j) - covariance.col(i)[j]).abs() < 1e-12, "{covariance}");
        }
        assert!(flat[0].dot(flat[1]).abs() < 1e-12);
    }
}

#[test]
fn an_open_direction_is_not_drawn_as_a_sure_one() {
    for open in [DMat2::from_diagonal(DVec2::new(f64::INFINITY, 1.0)), DMat2::NAN] {
        let facets = vec![Arrow::with_covariance(facet(DVec3::Z, 1.0), open, false)];
        let svg = image(&Image { facets, ..Image::default() }, "open");
        assert!(svg.contains("stroke-dasharray") && texts(&svg).contains("open direction"));
    }
}

#[test]
fn nothing_and_nan_have_pictures() {
    let words = texts(&image(&Image::default(), "a & <b>"));
    assert!(words.contains("no facet") && words.starts_with("a & <b>"));
    let bad = [DVec3::NAN, DVec3::ZERO, DVec3::Z, DVec3::Z, DVec3::Z];
    let areas = [1.0, 1.0, f64::NAN, -1.0, f64::INFINITY];
    let facets = bad.into_iter().zip(areas).map(|(n, a)| Arrow::round(facet(n, a), 0.1, true));
    let unsure = [f64::NAN, f64::INFINITY, 100.0].map(|sd| Arrow::round(facet(DVec3::X, 1.0), sd, false));
    let facets = facets.chain(unsure).collect();
    let grid = vec![(DVec3::NAN, false), (DVec3::ZERO, false), (DVec3::X, false)];
    let truth = vec![facet(DVec3::NAN, 1.0), facet(DVec3::Y, 1.0)];
    let words = texts(&image(&Image { facets, truth, grid, relative: true }, "bad"));
    assert!(words.contains("open direction"), "{words}");
    assert!(words.contains("3 facets") && words.contains("6 without a finite normal"), "{words}");
}

#[test]
fn many_facets_are_thinned_and_the_picture_says_so() {
    let facets =
        fibonacci(20_000).enumerate().map(|(k, n)| Arrow::round(facet(n, 1.0 + k as f64), 0.05, k % 2 == 0));
    let truth = fibonacci(20_000).map(|n| facet(n, 100.0)).collect();
    let grid = fibonacci(20_000).map(|n| (n, n.x > 0.3)).collect();
    let svg = image(&Image { facets: facets.collect(), truth, grid, relative: false }, &"long <".repeat(999));
    let words = texts(&svg);
    assert!(
        words.contains("20000 facets; the 5000 largest are drawn, the 400 largest with their errors"),
        "{words}"
    );
}

#[test]
fn ellipses_are_as_wide_as_their_errors() {
    let sd = 0.1;
    let facets =
        vec![Arrow::with_covariance(facet(DVec3::Z, 1.0), DMat2::from_diagonal(DVec2::new(sd * sd, 0.0)), true)];
    let svg = image(&Image { facets, ..Image::default() }, "ellipse");
    let path = svg.split("<path d=\"M").nth(1).and_then(|s| s.split('Z').next()).expect("an ellipse");
    let points = path
        .split('L')
        .filter_map(|p| p.split_once(' '))
        .map(|(x, y)| DVec2::new(x.parse().expect("a number"), y.parse().expect("a number")));
    let middle = discs(&svg)[0].0;
    let most = points.map(|p| (p - middle).length()).fold(0.0, f64::max);
    // to the 0.1 px of the file
    assert!((most - 236.0 * 2f64.sqrt() * (0.5 * sd).sin()).abs() < 0.15, "{most}");
}

/// Share of the pixels of a hemisphere's raster that are shaded, inside the rim.
fn shaded(svg: &str, hemisphere: usize) -> f64 {
    use base64::Engine;
    let data = svg.split("data:image/png;base64,").nth(hemisphere + 1).and_then(|s| s.split('"').next());
    let bytes = base64::engine::general_purpose::STANDARD.decode(data.expect("a raster")).expect("base64");
    let raster = image::load_from_memory(&bytes).expect("a PNG").to_rgb8();
    let half = 0.5 * f64::from(raster.width());
    let inside = raster
        .enumerate_pixels()
        .filter(|(x, y, _)| (f64::from(*x) + 0.5 - half).hypot(f64::from(*y) + 0.5 - half) < half);
    let (count, dark) = inside.fold((0, 0), |(n, d), (_, _, p)| (n + 1, d + usize::from(p.0[0] < 255)));
    dark as f64 / f64::from(count)
}

#[test]
fn the_shaded_share_is_that_of_the_directions() {
    // equal areas: a cap of cos > 0.6 about +z is 0.4 of its hemisphere and none of the other
    let grid = fibonacci(3000).map(|n| (n, n.z < 0.6)).collect();
    let svg = image(&Image { grid, ..Image::default() }, "cap");
    // the cap's edge is uncertain by half the spacing of the grid: 0.03 rad over a ring of 2 pi 0.8 of 2 pi
    assert!((shaded(&svg, 0) - 0.4).abs() < 0.01, "{}", shaded(&svg, 0));
    assert_eq!(shaded(&svg, 1), 0.0);
}
