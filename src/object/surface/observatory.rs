//! A space observatory of many parts, for trials and examples: 11 m across the wings, its telescope along +z, its wings
//! along y with their cells to +x.

use glam::{DMat3, DVec2, DVec3};

use super::mesh::{Mesh, number};
use super::primitives::{cone, cuboid, cylinder, dish_solid, sphere};
use super::repair::repair;
use super::revolve::revolve;

/// Both sides of something symmetrical.
const SIDES: [f64; 2] = [-1.0, 1.0];

#[derive(Clone, Copy)]
enum Group {
    Bus,
    Telescope,
    Panel,
    Yoke,
    Antenna,
    Thruster,
    Tank,
    Radiator,
    Sensor,
}

/// Names of the groups, in their order above.
const GROUPS: [&str; 9] =
    ["bus", "telescope", "panel", "yoke", "antenna", "thruster", "tank", "radiator", "sensor"];

#[derive(Clone, Copy)]
enum Material {
    Mli = 1,
    SolarCell,
    Aluminium,
    WhitePaint,
}

/// Names of the materials, in their order above after the nameless one.
const MATERIALS: [&str; 5] = ["", "mli", "solar-cell", "aluminium", "white-paint"];

/// A space observatory with crinkled blankets, a telescope with baffles and a lid, two wings of cells, a dish antenna,
/// tanks, thrusters and sensors: closed bodies only. The materials are `mli`, `solar-cell`, `aluminium` and `white-paint`.
pub fn observatory() -> Mesh {
    let names = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
    let mut kit = Kit(Mesh { groups: names(&GROUPS), materials: names(&MATERIALS), ..Mesh::default() });
    kit.bus();
    kit.telescope();
    for side in SIDES {
        kit.wing(side);
    }
    kit.antenna();
    kit.propulsion();
    kit.sensors();
    kit.0
}

/// The parts put together so far.
struct Kit(Mesh);

impl Kit {
    fn add(&mut self, part: &Mesh, group: Group, material: Material) {
        self.0.append(part, |_| (group as u16, material as u16));
    }

    /// A part with its own z along `axis` and its origin at `centre`.
    fn aim(&mut self, part: &Mesh, axis: DVec3, centre: DVec3, group: Group, material: Material) {
        self.add(&part.transformed(&along(axis), centre), group, material);
    }

    fn shift(&mut self, part: &Mesh, centre: DVec3, group: Group, material: Material) {
        self.aim(part, DVec3::Z, centre, group, material);
    }

    /// A rod between two points.
    fn rod(&mut self, ends: [DVec3; 2], radius: f64, group: Group, material: Material) {
        let [from, to] = ends;
        let part = cylinder(radius, from.distance(to), 12);
        self.aim(&part, to - from, 0.5 * (from + to), group, material);
    }

    fn bus(&mut self) {
        self.shift(&blanket(DVec3::new(1.8, 1.8, 2.2), 14, 0.012), DVec3::Z * -0.9, Group::Bus, Material::Mli);
        // launch adapter ring below
        let ring = [[0.62, -2.12], [0.66, -2.12], [0.66, -1.98], [0.62, -1.98]].map(DVec2::from_array);
        self.add(&revolve(&ring, 48, true), Group::Bus, Material::Aluminium);
        // radiators on the cold side, held off by their feet
        for y in SIDES.map(|side| 0.42 * side) {
            let centre = DVec3::new(-0.97, y, -0.75);
            self.shift(&cuboid(DVec3::new(0.03, 0.76, 1.5)), centre, Group::Radiator, Material::WhitePaint);
            for z in SIDES.map(|side| 0.5 * side) {
                let foot = centre + DVec3::Z * z;
                let ends = [foot + DVec3::X * 0.12, foot + DVec3::X * 0.01];
                self.rod(ends, 0.03, Group::Radiator, Material::Aluminium);
            }
        }
    }

    fn telescope(&mut self) {
        let (group, centre) = (Group::Telescope, DVec3::Z);
        self.add(&tube(), group, Material::Mli);
        self.shift(&dish_solid(1.24, 0.1, 0.04, 48), centre * 0.5, group, Material::Aluminium);
        self.shift(&cone(0.2, 0.13, 0.5, 24), centre * 0.72, group, Material::WhitePaint);
        // secondary mirror on its spider
        self.shift(&cylinder(0.14, 0.16, 24), centre * 2.1, group, Material::WhitePaint);
        for arm in [DVec3::X, DVec3::Y, -DVec3::X, -DVec3::Y] {
            let ends = [arm * 0.13 + centre * 2.1, arm * 0.7 + centre * 2.1];
            self.rod(ends, 0.012, group, Material::Aluminium);
        }
        // the lid, open against the sun
        let upwards = DVec3::new(0.45, 0.0, 1.0).normalize();
        let hinge = DVec3::new(0.75, 0.0, 2.72);
        let normal = DVec3::new(-upwards.z, 0.0, upwards.x);
        self.aim(&cylinder(0.76, 0.03, 48), normal, hinge + upwards * 0.78, group, Material::Mli);
        self.rod([hinge - DVec3::Y * 0.2, hinge + DVec3::Y * 0.2], 0.035, group, Material::Aluminium);
    }

    fn wing(&mut self, side: f64) {
        let at = |y: f64, z: f64| DVec3::new(0.0, side * y, z - 0.9);
        let (group, aluminium) = (Group::Yoke, Material::Aluminium);
        self.rod([at(0.86, 0.0), at(1.0, 0.0)], 0.12, group, aluminium);
        self.rod([at(0.9, 0.0), at(1.3, 0.0)], 0.05, group, aluminium);
        for z in SIDES {
            self.rod([at(1.27, 0.02 * z), at(1.86, 0.6 * z)], 0.028, group, aluminium);
        }
        self.rod([at(1.86, -0.75), at(1.86, 0.75)], 0.03, group, aluminium);
        for panel in 0..3 {
            let y = 2.5 + 1.24 * f64::from(panel);
            self.panel(at(y, 0.0));
            for z in SIDES.map(|side| 0.55 * side) {
                // hinges towards the part before
                let ends = [at(y - 0.64, z - 0.06), at(y - 0.64, z + 0.06)];
                self.rod(ends, 0.02, group, aluminium);
            }
        }
    }

    /// A panel of 1.2 m by 1.7 m that looks to +x, with 6 by 8 cells.
    fn panel(&mut self, centre: DVec3) {
        self.shift(&cuboid(DVec3::new(0.024, 1.2, 1.7)), centre, Group::Panel, Material::WhitePaint);
        let cell = cuboid(DVec3::new(0.004, 0.185, 0.2));
        for (row, column) in (0..8).flat_map(|row| (0..6).map(move |column| (row, column))) {
            let (y, z) = ((f64::from(column) - 2.5) * 0.195, (f64::from(row) - 3.5) * 0.21);
            self.shift(&cell, centre + DVec3::new(0.015, y, z), Group::Panel, Material::SolarCell);
        }
    }

    fn antenna(&mut self) {
        let axis = DVec3::new(-0.6, 0.0, -0.8);
        let frame = along(axis);
        let vertex = DVec3::new(-1.5, 0.0, -2.35);
        // positions in the antenna's own frame, its dish around z
        let at = |x: f64, y: f64, z: f64| vertex + frame * DVec3::new(x, y, z);
        let (group, white, aluminium) = (Group::Antenna, Material::WhitePaint, Material::Aluminium);
        self.aim(&dish_solid(1.5, 0.28, 0.02, 48), axis, vertex, group, white);
        self.aim(&cone(0.16, 0.1, 0.12, 24), axis, at(0.0, 0.0, -0.21), group, aluminium);
        // horn and subreflector in front, on three struts
        self.aim(&cone(0.05, 0.1, 0.22, 24), axis, at(0.0, 0.0, -0.02), group, aluminium);
        self.aim(&cone(0.13, 0.05, 0.05, 24), axis, at(0.0, 0.0, 0.46), group, white);
        for (x, y) in [(1.0, 0.0), (-0.5, 0.75_f64.sqrt()), (-0.5, -0.75_f64.sqrt())] {
            let ends = [at(0.66 * x, 0.66 * y, 0.07), at(0.1 * x, 0.1 * y, 0.46)];
            self.rod(ends, 0.014, group, aluminium);
        }
        let elbow = DVec3::new(-1.2, 0.0, -1.92);
        self.rod([DVec3::new(-0.85, 0.0, -1.8), elbow], 0.045, group, aluminium);
        self.shift(&sphere(0.07, 3), elbow, group, aluminium);
        self.rod([elbow.lerp(vertex, 0.05), at(0.0, 0.0, -0.25)], 0.04, group, aluminium);
    }

    fn propulsion(&mut self) {
        for (x, y) in SIDES.iter().flat_map(|x| SIDES.map(|y| (*x, y))) {
            let tank = DVec3::new(0.3 * x, 0.3 * y, -2.05);
            self.shift(&sphere(0.24, 6), tank, Group::Tank, Material::Aluminium);
            // pairs of thrusters at the corners, downwards and sideways
            let corner = DVec3::new(0.78 * x, 0.78 * y, -2.04);
            self.shift(&cuboid(DVec3::new(0.16, 0.16, 0.12)), corner, Group::Thruster, Material::WhitePaint);
            for axis in [DVec3::NEG_Z, DVec3::Y * y] {
                let centre = corner + axis * 0.15;
                self.aim(&cone(0.025, 0.06, 0.16, 20), axis, centre, Group::Thruster, Material::Aluminium);
            }
        }
        self.shift(&nozzle(), DVec3::Z * -2.2, Group::Thruster, Material::Aluminium);
    }

    fn sensors(&mut self) {
        let (group, white, aluminium) = (Group::Sensor, Material::WhitePaint, Material::Aluminium);
        for y in SIDES {
            // star trackers look up and away from the sun
            let axis = DVec3::new(-1.0, 0.55 * y, 0.8).normalize();
            let foot = DVec3::new(-0.88, 0.62 * y, 0.22);
            self.shift(&cuboid(DVec3::new(0.2, 0.2, 0.16)), foot, group, Material::Mli);
            self.aim(&cylinder(0.07, 0.24, 24), axis, foot + axis * 0.12, group, aluminium);
            self.aim(&cone(0.075, 0.13, 0.2, 24), axis, foot + axis * 0.33, group, white);
            // omnidirectional antennas on the sun side
            let mast = DVec3::new(0.8, 0.7 * y, 0.15);
            self.rod([mast, mast + DVec3::Z * 0.5], 0.015, group, aluminium);
            self.shift(&cone(0.05, 0.02, 0.14, 16), mast + DVec3::Z * 0.56, group, white);
        }
        // magnetometer boom, with the instrument halfway and at its end
        let (root, tip) = (DVec3::new(0.85, 0.0, -1.6), DVec3::new(3.4, 0.0, -2.9));
        self.rod([root, tip], 0.022, group, aluminium);
        for part in [0.55, 1.0] {
            self.shift(&cuboid(DVec3::new(0.16, 0.12, 0.12)), root.lerp(tip, part), group, Material::Mli);
        }
        // sun sensors
        for z in [-1.5, -0.3] {
            self.shift(&cuboid(DVec3::new(0.08, 0.14, 0.14)), DVec3::new(0.92, 0.5, z), group, aluminium);
        }
    }
}

/// A rotation that takes z to an axis; only square roots, so the same on every machine.
fn along(axis: DVec3) -> DMat3 {
    let z = axis.normalize_or(DVec3::Z);
    if z == DVec3::Z {
        return DMat3::IDENTITY;
    }
    let x = z.any_orthonormal_vector();
    DMat3::from_cols(x, z.cross(x), z)
}

/// The tube of the telescope: open at the top, baffles inside, stiffening rings outside.
fn tube() -> Mesh {
    let (inner, outer, floor, top) = (0.7, 0.73, 0.34, 2.7);
    let mut profile = vec![[0.0, 0.22], [0.86, 0.22], [0.86, 0.3], [outer, 0.36]];
    for z in [0.9, 1.7, 2.6] {
        profile.extend([[outer, z], [outer + 0.025, z + 0.01], [outer + 0.025, z + 0.05], [outer, z + 0.06]]);
    }
    profile.extend([[outer, top], [inner, top]]);
    for z in [2.45, 1.85, 1.55, 1.25, 0.95] {
        profile.extend([[inner, z], [inner - 0.05, z - 0.01], [inner - 0.05, z - 0.02], [inner, z - 0.05]]);
    }
    profile.extend([[inner, floor], [0.0, floor]]);
    let profile: Vec<DVec2> = profile.into_iter().map(DVec2::from_array).collect();
    revolve(&profile, 48, false)
}

/// The bell of the main engine, open to -z.
fn nozzle() -> Mesh {
    let inside = [[0.05, 0.0], [0.04, -0.06], [0.1, -0.16], [0.16, -0.3], [0.2, -0.46]];
    let outside = inside.iter().map(|[radius, z]| [radius + 0.012, *z]);
    // down inside and up outside: the metal is between
    let profile: Vec<DVec2> = inside.into_iter().chain(outside.rev()).map(DVec2::from_array).collect();
    revolve(&profile, 32, true)
}

/// A box in crinkled foil: each side in `parts` by `parts` squares, whose corners are moved in and out by up to `depth_m`.
fn blanket(size_m: DVec3, parts: u8, depth_m: f64) -> Mesh {
    let across = u32::from(parts) + 1;
    let step = |k: u8| (2.0 * f64::from(k) - f64::from(parts)) / f64::from(parts);
    let grid = |count: u8| (0..count).flat_map(move |j| (0..count).map(move |i| (i, j)));
    // each pair of sides in a frame of its own, with the pair across its z
    let turns = [[DVec3::X, DVec3::Y, DVec3::Z], [DVec3::Y, DVec3::Z, DVec3::X], [DVec3::Z, DVec3::X, DVec3::Y]];
    let mut sides = Mesh::plain(vec![], []);
    for (turn, side) in turns.iter().flat_map(|[x, y, z]| SIDES.map(|side| (DMat3::from_cols(*x, *y, *z), side))) {
        let first = number(sides.vertices.len());
        let point = |(n, (i, j)): (u32, (u8, u8))| {
            let is_edge = [i, j].iter().any(|k| *k == 0 || *k == parts);
            let crinkle = if is_edge { 0.0 } else { side * depth_m * chance(first + n) };
            // the far side is mirrored in x too, so that it looks outwards as well
            let unit = DVec3::new(side * step(i), step(j), side);
            0.5 * size_m * (turn * unit) + turn * (DVec3::Z * crinkle)
        };
        let squares = grid(parts).flat_map(|(i, j)| {
            let at = u32::from(i) + across * u32::from(j);
            [[at, at + 1, at + across + 1], [at, at + across + 1, at + across]]
        });
        let vertices = (0..).zip(grid(parts + 1)).map(point).collect();
        sides.append(&Mesh::plain(vertices, squares), |_| (0, 0));
    }
    // the sides become one body where they meet
    repair(&sides).0
}

/// A number from -1 to 1 that looks like chance but is always the same.
fn chance(seed: u32) -> f64 {
    let scrambled = |bits: u32, shift: u32, factor: u32| (bits ^ (bits >> shift)).wrapping_mul(factor);
    let mixed = scrambled(scrambled(seed ^ 0x9e37_79b9, 16, 0x85eb_ca6b), 13, 0xc2b2_ae35);
    2.0 * f64::from(mixed ^ (mixed >> 16)) / f64::from(u32::MAX) - 1.0
}

#[cfg(test)]
mod tests {
    use super::super::check::faults;
    use super::super::topology::open;
    use super::*;

    #[test]
    fn it_is_detailed_closed_and_sound() {
        let mesh = observatory();
        assert!(mesh.faces.len() > 5000, "{}", mesh.faces.len());
        assert_eq!(faults(&mesh), []);
        assert!(open(&mesh).iter().all(|open| !open));
        let (low, high) = mesh.bounds().unwrap();
        assert!((high - low).y > 10.0 && (high - low).length() < 16.0);
    }

    #[test]
    fn every_name_is_of_some_face_and_nothing_is_nameless() {
        let mesh = observatory();
        assert!((0..9).all(|group| mesh.faces.iter().any(|face| face.group == group)));
        assert!((1..5).all(|material| mesh.faces.iter().any(|face| face.material == material)));
        assert!(mesh.faces.iter().all(|face| face.material > 0));
    }

    #[test]
    fn it_is_always_the_same() {
        assert_eq!(observatory(), observatory());
    }

    #[test]
    fn a_blanket_encloses_about_its_box() {
        let size = DVec3::new(1.0, 2.0, 3.0);
        let mesh = blanket(size, 10, 0.01);
        assert_eq!((faults(&mesh), mesh.faces.len()), (vec![], 1200));
        assert!((mesh.signed_volume() - 6.0).abs() < 0.1);
    }

    #[test]
    fn z_goes_to_the_axis_and_nothing_is_mirrored() {
        for axis in [DVec3::X, DVec3::NEG_Z, DVec3::Z, DVec3::new(0.3, -2.0, 0.1), DVec3::ZERO] {
            let frame = along(axis);
            assert!((frame * DVec3::Z).distance(axis.normalize_or(DVec3::Z)) < 1e-15);
            assert!((frame.determinant() - 1.0).abs() < 1e-14);
        }
    }
}
