use super::shape_picture::three_sides;
use crate::io::shape_file::{Body, Face, Uncertainty};
use crate::object::surface::primitives;
use glam::DVec3;

/// Most bytes of a picture.
const MOST: usize = 3_000_000;

/// A box from one corner to the opposite one, as six rectangles.
pub(super) fn cuboid(low: DVec3, high: DVec3, part: usize) -> Body {
    let at = |k: usize, axis: usize| if k >> axis & 1 == 1 { high[axis] } else { low[axis] };
    let vertices = (0..8).map(|k| DVec3::new(at(k, 0), at(k, 1), at(k, 2))).collect();
    let sides = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let uncertainty = Uncertainty::Known { sd_deg: 0.3, relative_area_sd: 0.01 };
    let face = |corners: [usize; 4]| Face { corners: corners.to_vec(), part, uncertainty };
    Body { vertices, faces: sides.into_iter().map(face).collect(), relative: false }
}

pub(super) fn both(mut a: Body, b: Body) -> Body {
    let first = a.vertices.len();
    a.vertices.extend(b.vertices);
    a.faces.extend(b.faces.into_iter().map(|mut face| {
        face.corners.iter_mut().for_each(|corner| *corner += first);
        face
    }));
    a
}

/// A sphere of radius 1 in triangles of all classes.
pub(super) fn ball(segments: u32) -> Body {
    let mesh = primitives::sphere(1.0, segments as _);
    let face = |(k, f): (usize, &crate::object::surface::mesh::Face)| Face {
        corners: f.corners.map(|c| c as usize).to_vec(),
        part: 0,
        uncertainty: match k * 7919 % 8 {
            6 => Uncertainty::Unclaimed,
            7 => Uncertainty::Unobserved,
            k => Uncertainty::Known { sd_deg: 0.3 * 2f64.powi(k as i32), relative_area_sd: 0.1 },
        },
    };
    let faces = mesh.faces.iter().enumerate().map(face).collect();
    Body { vertices: mesh.vertices.clone(), faces, relative: false }
}

/// The texts of a picture, which must be XML of no more than [`MOST`] bytes without a number that is none.
fn texts(svg: &str) -> String {
    assert!(svg.len() < MOST, "{} bytes", svg.len());
    let page = roxmltree::Document::parse(svg).expect("XML");
    for node in page.descendants().filter(|n| !n.has_tag_name("text") && !n.has_tag_name("title")) {
        let sound = |v: &str| v.starts_with("data:") || !(v.contains("NaN") || v.contains("inf"));
        assert!(node.attributes().all(|a| sound(a.value())), "{node:?}");
    }
    page.descendants().filter(|n| n.has_tag_name("text")).filter_map(|n| n.text()).collect::<Vec<_>>().join("\n")
}

#[test]
fn a_box_has_three_views_a_scale_bar_and_a_legend() {
    let svg = three_sides(&cuboid(DVec3::ZERO, DVec3::new(2.0, 1.0, 4.0), 0), "Box & wing <1>");
    let words = texts(&svg);
    for expected in
        ["Box & wing <1>", "seen from +x", "seen from +y", "seen from +z", "x, m", "y, m", "z, m", "1 m"]
    {
        assert!(words.lines().any(|line| line == expected), "{expected}: {words}");
    }
    // the class, then its cells
    assert!(words.contains("\n6\n100.0 %\n0.30 deg\n1.00 %\n"), "{words}");
    assert_eq!(svg.matches("data:image/png").count(), 3);
}

#[test]
fn nothing_one_facet_and_nan_have_pictures() {
    assert!(texts(&three_sides(&Body::default(), "")).contains("no facet with an extent"));
    let mut body = cuboid(DVec3::ZERO, DVec3::ONE, 0);
    body.faces.truncate(1);
    assert!(texts(&three_sides(&body, "one")).contains("\n1\n100.0 %\n"));
    body.vertices[0] = DVec3::NAN;
    assert!(texts(&three_sides(&body, "none")).contains("1 facet is left out"));
    let point = cuboid(DVec3::ONE, DVec3::ONE, 0);
    assert!(texts(&three_sides(&point, "a point")).contains("no facet with an extent"));
}

#[test]
fn sizes_from_atoms_to_absurd_have_pictures() {
    for size in [1e-300, 1e-9, 1e9, 1e300, 0.8 * f64::MAX] {
        let body = cuboid(DVec3::splat(-size), DVec3::splat(size), 0);
        texts(&three_sides(&body, "sizes"));
    }
    texts(&three_sides(&cuboid(DVec3::splat(1e9), DVec3::splat(1e9 + 1.0), 0), "far away"));
}

#[test]
fn many_facets_of_all_classes_stay_small_and_say_what_is_not_drawn() {
    let body = ball(32);
    assert!(body.faces.len() > 20_000);
    assert!(texts(&three_sides(&body, "many")).contains("Only outlines"));
}

#[test]
fn long_titles_are_cut_on_the_page() {
    let title = "<&>".repeat(5000);
    let svg = three_sides(&cuboid(DVec3::ZERO, DVec3::ONE, 0), &title);
    let words = texts(&svg);
    let first = words.lines().next().expect("a title");
    assert!(first.starts_with("<&>") && first.ends_with('…') && first.chars().count() < 200);
}

#[test]
fn a_scale_that_is_unknown_is_not_called_metres() {
    let body = Body { relative: true, ..cuboid(DVec3::ZERO, DVec3::ONE, 0) };
    let words = texts(&three_sides(&body, "relative"));
    assert!(words.contains("the scale is unknown") && !words.contains(", m"));
}
