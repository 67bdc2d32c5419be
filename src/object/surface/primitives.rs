//! Built-in shapes, centred at the origin, faces outwards. Lengths are in metres; a negative one turns a shape inside out.

use std::collections::HashMap;

use glam::{DMat3, DVec2, DVec3};

use super::mesh::{Mesh, number};
use super::revolve::{allowed, on_circle, revolve};
use super::triangulate::triangulate;

/// Most parts that [`sphere`] divides an edge into: 1.3 million triangles.
pub const FINEST_SPHERE: u32 = 256;

/// A box with edges along the axes: 12 triangles.
pub fn cuboid(size_m: DVec3) -> Mesh {
    // bit 0 of a corner's number is its side in x, bit 1 in y, bit 2 in z
    let side = |bit: bool| if bit { 0.5 } else { -0.5 };
    let corner = |n: u8| DVec3::new(side(n & 1 > 0), side(n & 2 > 0), side(n & 4 > 0)) * size_m;
    let sides: [[u32; 4]; 6] =
        [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let halves = sides.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]);
    Mesh::plain((0..8).map(corner).collect(), halves)
}

/// A closed cylinder about z.
pub fn cylinder(radius_m: f64, height_m: f64, segments: u32) -> Mesh {
    cone(radius_m, radius_m, height_m, segments)
}

/// A closed frustum about z, with its radii at the bottom and at the top; radius 0 is an apex.
pub fn cone(bottom_m: f64, top_m: f64, height_m: f64, segments: u32) -> Mesh {
    let half = 0.5 * height_m;
    let profile = [[0.0, -half], [bottom_m, -half], [top_m, half], [0.0, half]];
    revolve(&profile.map(DVec2::from_array), segments, false)
}

/// A rectangular sheet in the plane of x and y that looks to +z: two triangles.
pub fn plate(x_m: f64, y_m: f64) -> Mesh {
    let corner = |x, y| DVec3::new(x * x_m, y * y_m, 0.0);
    let vertices = vec![corner(-0.5, -0.5), corner(0.5, -0.5), corner(0.5, 0.5), corner(-0.5, 0.5)];
    Mesh::plain(vertices, [[0, 1, 2], [0, 2, 3]])
}

/// The sheet of a paraboloid reflector that opens to +z, to which its faces look; `depth_m` is that of the bowl.
pub fn dish(diameter_m: f64, depth_m: f64, segments: u32) -> Mesh {
    let mut bowl = bowl(diameter_m, depth_m, segments);
    bowl.reverse();
    revolve(&bowl, segments, false)
}

/// The same reflector with a thickness along z, which is added below: a closed body.
pub fn dish_solid(diameter_m: f64, depth_m: f64, thickness_m: f64, segments: u32) -> Mesh {
    let inside = bowl(diameter_m, depth_m, segments);
    let below = inside.iter().map(|point| point - DVec2::Y * thickness_m);
    let profile: Vec<DVec2> = below.chain(inside.iter().rev().copied()).collect();
    revolve(&profile, segments, false)
}

/// Profile of a paraboloid from its vertex to its rim, with bands about as wide as a segment of half the radius.
fn bowl(diameter_m: f64, depth_m: f64, segments: u32) -> Vec<DVec2> {
    let bands = (allowed(segments) / 4).max(2);
    let point = |band: u32| {
        let part = f64::from(band) / f64::from(bands);
        DVec2::new(0.5 * diameter_m * part, depth_m * (part * part - 0.5))
    };
    (0..=bands).map(point).collect()
}

/// A torus about z, from the radius of its middle line and that of its section, in segments around and of the section.
pub fn torus(major_m: f64, minor_m: f64, around: u32, section: u32) -> Mesh {
    let section = allowed(section);
    let point = |step| DVec2::new(major_m, 0.0) + minor_m * on_circle(step, section);
    let profile: Vec<DVec2> = (0..section).map(point).collect();
    revolve(&profile, around, true)
}

/// A sphere from an icosahedron, its edges in `parts` parts: 20 `parts`² triangles of nearly equal size.
pub fn sphere(radius_m: f64, parts: u32) -> Mesh {
    let parts = parts.clamp(1, FINEST_SPHERE);
    let mut lattice = Lattice { radius_m, corners: icosahedron(), numbers: HashMap::new(), vertices: Vec::new() };
    let mut corners = Vec::new();
    for [a, b, c] in ICOSAHEDRON_FACES {
        // a point is the sum of the corners, weighted by parts that sum to all
        let mut point = |i: u32, j: u32| lattice.number([(a, parts - i - j), (b, i), (c, j)]);
        for i in 0..parts {
            for j in 0..parts - i {
                corners.push([point(i, j), point(i + 1, j), point(i, j + 1)]);
                if i + j + 1 < parts {
                    corners.push([point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)]);
                }
            }
        }
    }
    Mesh::plain(lattice.vertices, corners)
}

/// Corners of an icosahedron: in each plane of two axes, a golden rectangle.
fn icosahedron() -> [DVec3; 12] {
    let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
    let mut out = [DVec3::ZERO; 12];
    for (n, corner) in (0_u8..).zip(&mut out) {
        let short = if n & 1 > 0 { 1.0 } else { -1.0 };
        let long = if n & 2 > 0 { golden } else { -golden };
        *corner = match n / 4 {
            0 => DVec3::new(0.0, short, long),
            1 => DVec3::new(long, 0.0, short),
            _ => DVec3::new(short, long, 0.0),
        };
    }
    out
}

const ICOSAHEDRON_FACES: [[usize; 3]; 20] = [
    [0, 4, 1],
    [0, 1, 6],
    [0, 8, 4],
    [0, 6, 9],
    [0, 9, 8],
    [1, 4, 10],
    [1, 11, 6],
    [1, 10, 11],
    [2, 3, 5],
    [2, 7, 3],
    [2, 5, 8],
    [2, 9, 7],
    [2, 8, 9],
    [3, 10, 5],
    [3, 7, 11],
    [3, 11, 10],
    [4, 8, 5],
    [4, 5, 10],
    [6, 7, 9],
    [6, 11, 7],
];

/// Points of a sphere, of which those on the edges of the icosahedron are met from both sides.
struct Lattice {
    radius_m: f64,
    corners: [DVec3; 12],
    numbers: HashMap<[(usize, u32); 3], u32>,
    vertices: Vec<DVec3>,
}

impl Lattice {
    fn number(&mut self, mut weights: [(usize, u32); 3]) -> u32 {
        // the same point has the same key from each face: corners of weight 0 are all the same
        weights.iter_mut().filter(|(_, weight)| *weight == 0).for_each(|(corner, _)| *corner = 0);
        weights.sort_unstable();
        *self.numbers.entry(weights).or_insert_with(|| {
            let term = |(corner, weight): &(usize, u32)| {
                self.corners.get(*corner).copied().unwrap_or_default() * f64::from(*weight)
            };
            let sum: DVec3 = weights.iter().map(term).sum();
            self.vertices.push(self.radius_m * sum.normalize_or_zero());
            number(self.vertices.len() - 1)
        })
    }
}

/// An L of 2 m by 2 m, its arms 1 m wide, and 1 m thick: 20 triangles around a volume of 3 m³.
pub fn l_shape() -> Mesh {
    let outline = [[-1., -1.], [1., -1.], [1., 0.], [0., 0.], [0., 1.], [-1., 1.]].map(DVec2::from_array);
    let count = number(outline.len());
    let level = |z: f64| outline.map(|point| point.extend(z));
    let (bottom, top) = (level(-0.5), level(0.5));
    let cap: Vec<[u32; 3]> = triangulate(&top).into_iter().map(|t| t.map(number)).collect();
    let sides =
        (0..count).map(|a| (a, (a + 1) % count)).flat_map(|(a, b)| [[a, b, b + count], [a, b + count, a + count]]);
    let caps = cap.iter().flat_map(|[a, b, c]| [[*a, *c, *b], [a + count, b + count, c + count]]);
    Mesh::plain([bottom, top].concat(), sides.chain(caps))
}

/// A satellite of three boxes, 36 triangles: the group `bus`, and two wings along y of the group `panel` that look to +x.
pub fn box_wing() -> Mesh {
    let names = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
    let mut mesh =
        Mesh { groups: names(&["bus", "panel"]), materials: names(&["", "mli", "solar-cell"]), ..Mesh::default() };
    mesh.append(&cuboid(DVec3::new(1.6, 1.6, 2.0)), |_| (0, 1));
    for side in [-1.0, 1.0] {
        let wing = cuboid(DVec3::new(0.03, 5.0, 1.6));
        // a gap of 0.3 m stands for the yoke
        let centre = DVec3::Y * side * (0.8 + 0.3 + 2.5);
        mesh.append(&wing.transformed(&DMat3::IDENTITY, centre), |_| (1, 2));
    }
    mesh
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::super::check::faults;
    use super::super::fault::Severity;
    use super::super::topology::{components, open};
    use super::*;

    /// Vertices, less edges, plus faces.
    fn euler(mesh: &Mesh) -> i64 {
        let edge = |a: u32, b: u32| (a.min(b), a.max(b));
        let edges: std::collections::HashSet<_> = mesh
            .faces
            .iter()
            .flat_map(|face| {
                let [a, b, c] = face.corners;
                [edge(a, b), edge(b, c), edge(c, a)]
            })
            .collect();
        mesh.vertices.len() as i64 - edges.len() as i64 + mesh.faces.len() as i64
    }

    #[test]
    fn closed_shapes_are_sound_outwards_and_of_their_kind() {
        let shapes = [
            (cuboid(DVec3::new(1.0, 2.0, 3.0)), 2),
            (cylinder(0.5, 2.0, 24), 2),
            (cone(0.5, 0.0, 2.0, 7), 2),
            (cone(0.0, 0.5, 2.0, 3), 2),
            (cone(0.4, 0.5, 2.0, 12), 2),
            (sphere(1.0, 1), 2),
            (sphere(1.0, 7), 2),
            (dish_solid(2.0, 0.4, 0.02, 32), 2),
            (torus(1.0, 0.3, 24, 12), 0),
            (l_shape(), 2),
        ];
        for (mesh, characteristic) in shapes {
            assert_eq!(faults(&mesh), [], "{}", mesh.faces.len());
            assert_eq!(euler(&mesh), characteristic);
            assert_eq!(open(&mesh), [false]);
            assert!(mesh.signed_volume() > 0.0);
            let (low, high) = mesh.bounds().unwrap();
            assert!(low.z + high.z < 0.03 && mesh.centroid().unwrap().length() < 0.9);
        }
    }

    #[test]
    fn sheets_are_open_and_look_up() {
        for mesh in [plate(2.0, 1.0), dish(2.0, 0.4, 32)] {
            assert!(faults(&mesh).iter().all(|fault| fault.severity() == Severity::Note));
            assert_eq!((open(&mesh), euler(&mesh)), (vec![true], 1));
            let up = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a).z > 0.0;
            assert!(mesh.triangles().all(up));
        }
    }

    #[test]
    fn areas_and_volumes_converge_on_their_formulas() {
        let near = |value: f64, formula: f64, within: f64| {
            assert!((value / formula - 1.0).abs() < within, "{value} {formula}")
        };
        for size in [1e-6, 1.0, 1e6_f64] {
            let (area, volume) = (size * size, size * size * size);
            let (r, h, n) = (0.5 * size, 2.0 * size, 256);
            // a polygon falls short of its circle by about 2/3 (π/n)² of its area
            near(cylinder(r, h, n).signed_volume(), PI * 0.25 * 2.0 * volume, 2e-4);
            near(cylinder(r, h, n).area(), PI * (0.5 + 2.0) * area, 2e-4);
            near(cone(r, 0.0, h, n).signed_volume(), PI / 6.0 * volume, 2e-4);
            near(cone(r, 2.0 * r, h, n).signed_volume(), PI * 2.0 / 3.0 * (0.25 + 0.5 + 1.0) * volume, 2e-4);
            near(torus(size, 0.3 * size, n, n).signed_volume(), 2.0 * PI * PI * 0.09 * volume, 4e-4);
            near(torus(size, 0.3 * size, n, n).area(), 4.0 * PI * PI * 0.3 * area, 4e-4);
            near(sphere(size, 40).signed_volume(), 4.0 / 3.0 * PI * volume, 1e-3);
            near(sphere(size, 40).area(), 4.0 * PI * area, 1e-3);
            let (d, focus) = (0.4 * size, 0.625 * size); // radius² / (4 depth)
            let surface = 8.0 / 3.0 * PI * focus * focus * ((1.0 + d / focus).powf(1.5) - 1.0);
            near(dish(2.0 * size, d, n).area(), surface, 2e-4);
            near(dish_solid(2.0 * size, d, 0.01 * size, n).signed_volume(), PI * 0.01 * volume, 2e-4);
        }
        near(l_shape().signed_volume(), 3.0, 1e-12);
        near(l_shape().area(), 14.0, 1e-12);
    }

    #[test]
    fn spheres_converge_with_the_square_of_their_parts() {
        let short = |parts| 1.0 - sphere(1.0, parts).signed_volume() / (4.0 / 3.0 * PI);
        assert!((short(8) / short(16) - 4.0).abs() < 0.1);
        assert!(sphere(2.0, 5).vertices.iter().all(|vertex| (vertex.length() - 2.0).abs() < 1e-15 * 4.0));
        assert_eq!((sphere(1.0, 5).faces.len(), sphere(1.0, 5).vertices.len()), (500, 252));
    }

    #[test]
    fn the_box_wing_is_three_closed_boxes() {
        let mesh = box_wing();
        assert_eq!(mesh.faces.len(), 36);
        assert_eq!(faults(&mesh), []);
        assert_eq!((open(&mesh), components(&mesh)[35]), (vec![false; 3], 2));
        assert!((mesh.signed_volume() - (5.12 + 2.0 * 0.24)).abs() < 1e-12);
        assert!(mesh.centroid().unwrap().length() < 1e-12);
    }

    #[test]
    fn odd_sizes_are_no_harm() {
        for size in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-320, 1e308] {
            for mesh in [sphere(size, 2), torus(size, size, 3, 3), dish(size, size, 3), cone(size, 0.0, size, 0)] {
                let _ = (faults(&mesh), mesh.signed_volume(), mesh.bounds());
            }
        }
    }
}
