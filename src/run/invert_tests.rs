use super::super::shape_data::LeftOut;
use super::*;
use crate::astro::time::Instant;
use crate::inversion::synthetic::{Stream, cuboid, directions, noisy};
use crate::object::convex::Epochs;
use crate::object::matter::Material;
use glam::DVec3;

fn box_data(snr: f64) -> Data {
    let mut stream = Stream::new(7);
    let directions = directions(300, &mut stream);
    let material = Material::lambert(0.3);
    let clean = Epochs::new(directions.iter().copied()).curve(&cuboid(DVec3::new(1.0, 2.0, 3.0)), &material, 0.0);
    let (y, sigma) = noisy(&clean, snr, &mut stream);
    let curve = Curve { y, sigma, directions, scale: Scale::Fixed(1.0) };
    Data {
        start: Instant::from_utc_reading(61_000, 0),
        time_s: vec![(0..300).map(f64::from).collect()],
        curves: vec![curve],
        names: vec!["box".into()],
        material,
        fits_material: false,
        search: None,
        absolute: true,
        computed: false,
        left_out: LeftOut::default(),
        told: vec![],
    }
}

/// A box 1:2:3 at SNR 30: six facets, volume within 5 %, not called concave, held-out points as good as their errors (within 4 of
/// chi-square's own).
#[test]
fn a_box_comes_back() {
    let found = invert(&box_data(30.0), Model::Auto, 0.2).expect("a shape");
    assert!(found.is_convex() && found.convex.facets.len() == 6, "{:?}", found.convex.verdict);
    let body = found.body.as_ref().expect("a body");
    assert!((body.polytope.volume() / 6.0 - 1.0).abs() < 0.05, "{}", body.polytope.volume());
    assert!((found.held_out_chi2 - 1.0).abs() < 4.0 * (2.0f64 / 60.0).sqrt(), "{}", found.held_out_chi2);
    assert!(found.certainty(found.convex.facets[0].facet.normal).is_some() && found.is_observed(DVec3::Z));
    assert_eq!(found.model.len(), 300);
}

#[test]
fn relative_curves_make_no_boxes() {
    let mut data = box_data(30.0);
    data.curves[0].scale = Scale::Free;
    assert_eq!(invert(&data, Model::Nonconvex, 0.2).err(), Some(InvertError::Relative));
}

#[test]
fn fewer_points_than_a_body_has_numbers_are_refused() {
    let mut data = box_data(30.0);
    data.left_out.flagged = 5;
    // gaps count as nothing
    data.curves[0].y[8..].fill(f64::NAN);
    assert_eq!(invert(&data, Model::Auto, 0.2).err(), Some(InvertError::TooFew { points: 8, all: 305 }));
    assert!(invert(&box_data(30.0), Model::Convex, 0.2).is_ok());
}
