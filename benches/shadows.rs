//! Light of shapes: the exact way, the convex sum, and whole light curves, on one core.
//!
//! ```sh
//! cargo bench --bench shadows
//! ```

use glam::DVec3;
use nightglass::object::convex::{Epochs, Facet};
use nightglass::object::matter::Material;
use nightglass::object::shadow::card::Graphics;
use nightglass::object::shadow::exact::Exact;
use nightglass::object::shape::{Choice, Shape};
use nightglass::object::surface::{observatory, primitives};
use nightglass::plan::planner::Planner;
use nightglass::scene::{Options, load};
use nightglass::study::object_accuracy::attitudes;
use std::time::Instant;

/// The best of several runs \[s\].
fn best(mut run: impl FnMut()) -> f64 {
    let one = |_| {
        let start = Instant::now();
        run();
        start.elapsed().as_secs_f64()
    };
    (0..5).map(one).fold(f64::INFINITY, f64::min)
}

fn main() {
    for (name, mesh) in [
        ("box-wing", primitives::box_wing()),
        ("torus", primitives::torus(2.0, 0.7, 80, 30)),
        ("observatory", observatory::observatory()),
    ] {
        let shape = Shape::new(&mesh, &Choice::default()).expect("a shape");
        let directions = attitudes(40);
        let mut exact = Exact::default();
        let mut weight = Vec::new();
        let seconds = best(|| {
            for (sun, observer) in &directions {
                shape.weights(&shape.body, *sun, *observer, 4.65e-3, &mut weight);
                std::hint::black_box(exact.flux(&shape.body, *sun, *observer, &weight));
            }
        });
        println!("exact, {name}, {} faces: {:.4} ms an epoch", mesh.faces.len(), seconds / 40.0 * 1e3);
    }
    let epochs = Epochs::new(attitudes(1000));
    let facets = attitudes(1000).into_iter().map(|(normal, _): (DVec3, _)| Facet { normal, area: 1e-3 });
    let facets = facets.collect::<Vec<_>>();
    for (name, material) in [
        ("lambert", Material::lambert(0.5)),
        ("cook-torrance", nightglass::object::matter::materials::preset("mli").expect("a preset")),
    ] {
        let seconds = best(|| {
            std::hint::black_box(epochs.curve(&facets, &material, 4.65e-3));
        });
        println!("convex, 1000 facets x 1000 epochs, {name}: {:.2} ms", seconds * 1e3);
    }
    let count = 20_000;
    let sets = [
        ("exposures.count", count.to_string()),
        ("exposures.cadence_s", "2.0".into()),
        ("exposures.duration_s", "0.0".into()),
    ];
    let sets = sets.map(|(key, value)| (key.to_owned(), value));
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/box-wing.toml");
    let scene = load(path, &Options { sets: &sets, seed: None }).expect("a scene");
    let planner = Planner::new(&scene).expect("a planner");
    let mut glow = planner.glow(0, &Graphics::default()).expect("a target");
    let seconds = best(|| {
        for frame in 0..count {
            let seen = planner.sighting(frame, 0).expect("a place");
            std::hint::black_box(glow.over(&seen).expect("light"));
        }
    });
    println!("light curve of a box-wing, geometry and shadows: {:.0} epochs a second", count as f64 / seconds);
}
