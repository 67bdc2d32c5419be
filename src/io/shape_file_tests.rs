use super::shape_file::{Body, Class, Face, MTL_NAME, Uncertainty, obj};
use crate::object::surface::fault::Severity;
use crate::object::surface::{check, mtl, obj as reader, primitives};
use glam::DVec3;

const SURE: Uncertainty = Uncertainty::Known { sd_deg: 0.2, relative_area_sd: 0.01 };

/// A box from one corner to the opposite one, as six rectangles.
fn cuboid(low: DVec3, high: DVec3, part: usize) -> Body {
    let at = |k: usize, bit: usize, axis: usize| if k >> bit & 1 == 1 { high[axis] } else { low[axis] };
    let vertices = (0..8).map(|k| DVec3::new(at(k, 0, 0), at(k, 1, 1), at(k, 2, 2))).collect();
    let sides = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let face = |corners: [usize; 4]| Face { corners: corners.to_vec(), part, uncertainty: SURE };
    Body { vertices, faces: sides.into_iter().map(face).collect(), relative: false }
}

fn both(mut a: Body, b: Body) -> Body {
    let first = a.vertices.len();
    a.vertices.extend(b.vertices);
    a.faces.extend(b.faces.into_iter().map(|mut face| {
        face.corners.iter_mut().for_each(|corner| *corner += first);
        face
    }));
    a
}

#[test]
fn a_file_reads_back_with_the_same_vertices_and_faces() {
    // thirds and powers of ten have no short binary form
    let mut body = both(
        cuboid(DVec3::new(-1.0 / 3.0, -0.1, -1e-7), DVec3::new(0.7, 1e3 / 7.0, 2.0), 0),
        cuboid(DVec3::splat(0.1), DVec3::splat(4.0 / 3.0), 1),
    );
    for (face, class) in body.faces.iter_mut().zip([0.2, 0.7, 1.5, 4.0, 9.0].map(Some).into_iter().chain([None])) {
        face.uncertainty = class
            .map_or(Uncertainty::Unobserved, |sd_deg| Uncertainty::Known { sd_deg, relative_area_sd: f64::NAN });
    }
    let (text, mtl_text) = obj(&body);
    let back = reader::read(&text).expect("an OBJ");
    assert_eq!(back.mtllibs, [MTL_NAME]);
    assert_eq!(back.mesh.vertices, body.vertices);
    // the reader cuts every rectangle in two triangles, from its first corner
    assert_eq!(back.mesh.faces.len(), 2 * body.faces.len());
    for (pair, face) in back.mesh.faces.chunks(2).zip(&body.faces) {
        let c = face.corners.iter().map(|c| *c as u32).collect::<Vec<_>>();
        assert_eq!(pair[0].corners, [c[0], c[1], c[2]]);
        assert_eq!(pair[1].corners, [c[0], c[2], c[3]]);
        assert_eq!(back.mesh.materials[pair[0].material as usize], Class::of(face.uncertainty).name());
        assert_eq!(back.mesh.groups[pair[0].group as usize], format!("part_{}", face.part));
    }
    let materials = mtl::read(&mtl_text).expect("an MTL");
    assert_eq!(materials.iter().map(|m| m.name.as_str()).collect::<Vec<_>>(), Class::ALL.map(Class::name));
    assert!(materials.iter().all(|m| m.kd.is_some()));
}

#[test]
fn a_closed_body_reads_back_closed_and_an_open_one_open() {
    let mut body = both(cuboid(DVec3::ZERO, DVec3::ONE, 0), cuboid(DVec3::splat(0.5), DVec3::splat(1.5), 1));
    // an open surface is but noted
    let faults = |body: &Body| check::faults(&reader::read(&obj(body).0).expect("an OBJ").mesh);
    assert_eq!(faults(&body), []);
    body.faces.pop();
    assert!(!faults(&body).is_empty());
}

#[test]
fn polygons_that_are_not_convex_keep_their_area() {
    let outline = [[0., 0.], [2., 0.], [2., 1.], [1., 1.], [1., 2.], [0., 2.]];
    let vertices = outline.iter().map(|[x, y]| DVec3::new(*x, *y, 0.25)).collect();
    let face = Face { corners: (0..6).collect(), part: 0, uncertainty: Uncertainty::Unclaimed };
    let body = Body { vertices, faces: vec![face], relative: true };
    let back = reader::read(&obj(&body).0).expect("an OBJ");
    assert!((back.mesh.area() - 3.0).abs() < 1e-12);
    assert!((super::shape_file::vector_area(&body.vertices) - DVec3::Z * 3.0).length() < 1e-12);
}

#[test]
fn classes_part_the_standard_deviations() {
    let of = |sd_deg| Class::of(Uncertainty::Known { sd_deg, relative_area_sd: 0.0 });
    let expected = [
        (0.0, Class::Below05),
        (0.499, Class::Below05),
        (0.5, Class::Below1),
        (1.0, Class::Below2),
        (2.0, Class::Below5),
        (4.999, Class::Below5),
        (5.0, Class::From5),
        (f64::INFINITY, Class::Unclaimed),
        (f64::NAN, Class::Unclaimed),
        (-1.0, Class::Unclaimed),
    ];
    for (sd, class) in expected {
        assert_eq!(of(sd), class, "{sd}");
    }
    assert_eq!(Class::of(Uncertainty::Unobserved), Class::Unobserved);
}

#[test]
fn shares_add_up_to_the_surface_whatever_the_size() {
    for size in [1e-200, 1.0, 1e300] {
        let mut body = cuboid(DVec3::ZERO, DVec3::new(1.0, 2.0, 3.0) * size, 0);
        body.faces[0].uncertainty = Uncertainty::Unobserved;
        let shares = body.shares();
        let share = |class| shares.iter().find(|s| s.class == class).expect("every class");
        // a side of 6 m2 of 22 m2
        assert!((share(Class::Unobserved).surface - 6.0 / 22.0).abs() < 1e-12);
        assert!((share(Class::Below05).surface - 16.0 / 22.0).abs() < 1e-12);
        assert_eq!(share(Class::Below05).faces, 5);
        assert_eq!((share(Class::Below05).sd_deg, share(Class::Below05).relative_area_sd), (0.2, 0.01));
    }
}

#[test]
fn what_is_not_finite_is_left_out_and_the_rest_is_kept() {
    let mut body = cuboid(DVec3::ZERO, DVec3::ONE, 0);
    body.vertices.insert(0, DVec3::new(f64::NAN, 0.0, 0.0));
    body.faces.iter_mut().flat_map(|face| &mut face.corners).for_each(|corner| *corner += 1);
    let bad = |corners: &[usize]| Face { corners: corners.to_vec(), part: 0, uncertainty: SURE };
    body.faces.extend([bad(&[0, 1, 2]), bad(&[1, 2]), bad(&[]), bad(&[1, 2, usize::MAX])]);
    let (text, _) = obj(&body);
    assert!(text.contains("vertices that are not finite: 1; faulty facets: 4."));
    let back = reader::read(&text).expect("an OBJ").mesh;
    assert_eq!(back.vertices, body.vertices[1..]);
    assert!(check::faults(&back).iter().all(|fault| fault.severity() == Severity::Note));
    assert!((back.area() - 6.0).abs() < 1e-12);
}

#[test]
fn empty_and_large_bodies_have_files() {
    let (text, mtl_text) = obj(&Body::default());
    assert!(reader::read(&text).is_ok_and(|o| o.mesh.faces.is_empty()) && mtl::read(&mtl_text).is_ok());
    let sphere = primitives::sphere(1.0, 32);
    let face = |(k, f): (usize, &crate::object::surface::mesh::Face)| Face {
        corners: f.corners.map(|c| c as usize).to_vec(),
        part: if k == 0 { usize::MAX } else { k % 3 },
        uncertainty: SURE,
    };
    let faces = sphere.faces.iter().enumerate().map(face).collect();
    let body = Body { vertices: sphere.vertices.clone(), faces, relative: false };
    assert!(body.faces.len() > 20_000);
    let back = reader::read(&obj(&body).0).expect("an OBJ").mesh;
    assert_eq!(back.vertices, sphere.vertices);
    assert!(back.faces.iter().zip(&sphere.faces).all(|(a, b)| a.corners == b.corners));
}
