//! How does brightness depend on attitude? Surfaces of equal brightness of a box-wing over all attitudes.
//!
//! ```sh
//! cargo run --release --example how_does_brightness_depend_on_attitude     # -> out/attitudes.png, out/attitudes_*.obj
//! ```
//!
//! Every attitude is a rotation vector: its direction is the axis of the turn from a standard attitude, its length the angle,
//! up to pi. Sun and observer stay where they are, 60 deg apart. Each surface holds the attitudes of one brightness; a glint is
//! a thin sheet. Opposite points of the outer sphere are the same attitude.

use glam::{DQuat, DVec3};
use nightglass::astro::attitude::Surroundings;
use nightglass::io::preview::rgb_png;
use nightglass::object::light::Lamp;
use nightglass::object::matter::{Material, materials};
use nightglass::object::picture::picture;
use nightglass::object::shape::{Choice, Lighting, Shape};
use nightglass::object::surface::mesh::Mesh;
use nightglass::object::surface::{obj, primitives};
use nightglass::object::way::Way;
use std::collections::HashMap;
use std::f64::consts::PI;

const CELLS: usize = 36;
const SUN_RADIUS: f64 = 4.65e-3;
const SIDE: u32 = 400;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let preset = |name: &str| materials::preset(name).ok_or("a preset of this name");
    let groups = vec![("bus".to_owned(), preset("mli")?), ("panel".to_owned(), preset("solar-cell")?)];
    let shape = Shape::new(&primitives::box_wing(), &Choice { groups, ..Choice::default() })?;
    let (sun, observer) = (DVec3::X, DVec3::new((PI / 3.0).cos(), (PI / 3.0).sin(), 0.0));
    let mut lamp = Lamp::new(&shape, Way::Exact, None);
    let mut light = |rotation: DVec3| {
        let to_body = DQuat::from_scaled_axis(rotation).inverse();
        let (earth, velocity) = (DVec3::NAN, DVec3::NAN);
        let around = Surroundings { earth, sun: to_body * sun, velocity, observer: to_body * observer };
        lamp.light(&Lighting { around, sun_radius: SUN_RADIUS }).value
    };
    let at = |k: usize| PI * (2.0 * k as f64 / CELLS as f64 - 1.0);
    let n = CELLS + 1;
    let corner = |k: usize| DVec3::new(at(k % n), at(k / n % n), at(k / (n * n)));
    // outside the ball of attitudes there are none
    let values = (0..n * n * n).map(|k| if corner(k).length() <= PI { light(corner(k)) } else { f64::NAN });
    let values = values.collect::<Vec<_>>();
    let mut known = values.iter().copied().filter(|y| y.is_finite()).collect::<Vec<_>>();
    known.sort_by(f64::total_cmp);
    std::fs::create_dir_all("out")?;
    let mut rgb = Vec::new();
    for share in [0.5, 0.9, 0.99] {
        let level = known[(share * known.len() as f64) as usize];
        let surface = surface(&values, level, corner);
        println!(
            "{:.0} % of all attitudes are fainter than {level:.4} m2/sr: {} triangles",
            100.0 * share,
            surface.faces.len()
        );
        std::fs::write(format!("out/attitudes_{:.0}.obj", 100.0 * share), obj::write(&surface, None))?;
        let own = Shape::new(&surface, &Choice { default: Some(Material::lambert(0.5)), ..Choice::default() })?;
        let observer = DVec3::new(1.0, 0.7, 0.5).normalize();
        let around = Surroundings {
            earth: DVec3::NAN,
            sun: DVec3::new(0.9, 0.1, 0.8).normalize(),
            velocity: DVec3::NAN,
            observer,
        };
        rgb.extend(picture(&own, &Lighting { around, sun_radius: SUN_RADIUS }, DVec3::Z, SIDE));
    }
    std::fs::write("out/attitudes.png", rgb_png(SIDE as usize, 3 * SIDE as usize, &rgb)?)?;
    println!("wrote out/attitudes.png");
    Ok(())
}

/// The surface of equal value by tetrahedra, six to a cell; cells with a corner outside are left out.
fn surface(values: &[f64], level: f64, corner: impl Fn(usize) -> DVec3) -> Mesh {
    const STEPS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    let n = CELLS + 1;
    let stride = [1, n, n * n];
    let (mut vertices, mut faces, mut numbers) = (Vec::new(), Vec::new(), HashMap::new());
    for cell in 0..CELLS * CELLS * CELLS {
        let first = cell % CELLS + n * (cell / CELLS % CELLS) + n * n * (cell / (CELLS * CELLS));
        for axes in STEPS {
            // a tetrahedron along a path from the cell's first corner to its last
            let mut k = first;
            let tetrahedron = [first].into_iter().chain(axes.map(|axis| {
                k += stride[axis];
                k
            }));
            let tetrahedron = tetrahedron.collect::<Vec<_>>();
            if tetrahedron.iter().any(|k| values[*k].is_nan()) {
                continue;
            }
            let (above, below): (Vec<_>, Vec<_>) = tetrahedron.iter().partition(|k| values[**k] > level);
            let mut cut = |a: usize, b: usize| {
                *numbers.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    let t = (level - values[a]) / (values[b] - values[a]);
                    vertices.push(corner(a).lerp(corner(b), t));
                    vertices.len() as u32 - 1
                })
            };
            let mut polygon = match (above.as_slice(), below.as_slice()) {
                ([a], [b, c, d]) | ([b, c, d], [a]) => vec![cut(*a, *b), cut(*a, *c), cut(*a, *d)],
                ([a, b], [c, d]) => vec![cut(*a, *c), cut(*a, *d), cut(*b, *d), cut(*b, *c)],
                _ => continue,
            };
            // the fainter side is outside
            let point = |k: u32| vertices[k as usize];
            let normal = (point(polygon[1]) - point(polygon[0])).cross(point(polygon[2]) - point(polygon[0]));
            if normal.dot(corner(below[0]) - corner(above[0])) < 0.0 {
                polygon.reverse();
            }
            faces.extend((1..polygon.len() - 1).map(|k| [polygon[0], polygon[k], polygon[k + 1]]));
        }
    }
    Mesh::plain(vertices, faces)
}
