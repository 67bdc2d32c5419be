//! Finding what is wrong with a mesh.

use std::collections::HashMap;

use glam::DVec3;

use super::fault::Fault;
use super::mesh::{Face, Mesh, area, bounds, signed_volume};
use super::topology::{Topology, is_balanced, welded};

/// A face is without area below this part of its longest edge squared.
const LEAST_AREA: f64 = 1e-12;
/// Vertices are meant to be the same within this part of the size.
const WELD: f64 = 1e-9;
/// A volume is above or below 0 beyond this part of surface times size.
const LEAST_VOLUME: f64 = 1e-12;
/// Diagonals \[m\] between which a body may well be in metres.
const USUAL_M: std::ops::RangeInclusive<f64> = 0.01..=1000.0;

/// Everything wrong with a mesh, by kind and then by number.
pub fn faults(mesh: &Mesh) -> Vec<Fault> {
    let topology = Topology::of(mesh);
    let mut out = out_of_range(mesh);
    out.extend(non_finite(&mesh.vertices));
    out.extend(zero_areas(mesh));
    out.extend(same_places(&mesh.vertices));
    let repeat = |(face, repeat): (usize, &Option<(usize, bool)>)| {
        repeat.map(|(first, alike)| Fault::SameFace { face, first, alike })
    };
    out.extend(topology.repeats.iter().enumerate().filter_map(repeat));
    out.extend(edges(&topology));
    out.extend(inside_out(mesh, &topology));
    out.extend(scale(mesh));
    out.extend(unused(mesh));
    out
}

fn out_of_range(mesh: &Mesh) -> Vec<Fault> {
    let of = |(face, f): (usize, &Face)| {
        let [a, b, c] = f.corners.map(|corner| ("vertex", corner, mesh.vertices.len()));
        let group = ("group", u32::from(f.group), mesh.groups.len());
        let material = ("material", u32::from(f.material), mesh.materials.len());
        let beyond = |(_, number, count): &(&str, u32, usize)| *number as usize >= *count;
        let fault = move |(what, number, count)| Fault::OutOfRange { face, what, number, count };
        [a, b, c, group, material].into_iter().filter(beyond).map(fault)
    };
    mesh.faces.iter().enumerate().flat_map(of).collect()
}

fn non_finite(vertices: &[DVec3]) -> impl Iterator<Item = Fault> {
    let bad = vertices.iter().enumerate().filter(|(_, at)| !at.is_finite());
    bad.map(|(vertex, at)| Fault::NonFinite { vertex, at: *at })
}

fn zero_areas(mesh: &Mesh) -> impl Iterator<Item = Fault> {
    mesh.faces.iter().enumerate().filter_map(|(face, f)| {
        let (area_m2, edge_m) = thin(&mesh.corners(f)?)?;
        Some(Fault::ZeroArea { face, area_m2, edge_m })
    })
}

/// Area \[m²\] and longest edge \[m\] of a triangle that has no area to speak of.
pub(super) fn thin(triangle: &[DVec3; 3]) -> Option<(f64, f64)> {
    let [a, b, c] = triangle;
    let longest = a.distance(*b).max(b.distance(*c)).max(c.distance(*a));
    let area = area(triangle);
    (area <= LEAST_AREA * longest * longest).then_some((area, longest))
}

fn same_places(vertices: &[DVec3]) -> Vec<Fault> {
    let (exactly, nearly) = (welded(vertices), nearly_welded(vertices));
    let mut out = Vec::new();
    for ((vertex, at), (exact, near)) in vertices.iter().enumerate().zip(exactly.iter().zip(&nearly)) {
        let (exact, near) = (*exact as usize, *near as usize);
        if exact != vertex {
            out.push(Fault::SamePlace { vertex, first: exact });
        } else if let Some(first) = vertices.get(near).filter(|_| near != vertex) {
            out.push(Fault::NearlySamePlace { vertex, first: near, distance_m: at.distance(*first) });
        }
    }
    out
}

/// For each vertex the first one that it is meant to be the same as. Those that are kept are farther apart than the
/// tolerance, so that welding twice is welding once.
pub(super) fn nearly_welded(vertices: &[DVec3]) -> Vec<u32> {
    let exactly = welded(vertices);
    let (low, high) = bounds(vertices.iter().copied()).unwrap_or_default();
    let tolerance = WELD * low.distance(high);
    if !(tolerance > 0.0 && tolerance.is_finite()) {
        return exactly;
    }
    // cells as large as the tolerance: what is near enough is in the same cell or in one next to it
    let cell = |at: DVec3| ((at - low) / tolerance).to_array().map(|steps| steps.floor() as i64);
    let mut kept: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
    let mut out = exactly.clone();
    for ((vertex, at), same) in (0_u32..).zip(vertices).zip(&mut out) {
        if *same != vertex || !at.is_finite() {
            continue;
        }
        let [x, y, z] = cell(*at);
        let near =
            |other: &u32| vertices.get(*other as usize).is_some_and(|other| other.distance(*at) <= tolerance);
        let around = (0..27).map(|n| [x + n % 3 - 1, y + n / 3 % 3 - 1, z + n / 9 - 1]);
        match around.filter_map(|cell| kept.get(&cell)).flatten().copied().filter(near).min() {
            Some(first) => *same = first,
            None => kept.entry([x, y, z]).or_default().push(vertex),
        }
    }
    // what is exactly at the place of a vertex goes where that one goes
    exactly.iter().map(|first| out.get(*first as usize).copied().unwrap_or(*first)).collect()
}

fn edges(topology: &Topology) -> impl Iterator<Item = Fault> {
    topology.edges().filter_map(|edge| match edge {
        [only] => Some(Fault::OpenEdge { face: only.face, edge: only.ends }),
        [a, b] => (a.forward == b.forward).then_some(Fault::Winding { faces: [a.face, b.face], edge: a.ends }),
        [first, ..] => Some(Fault::NonManifold {
            edge: first.ends,
            faces: edge.iter().map(|side| side.face).collect(),
            balanced: is_balanced(edge),
        }),
        [] => None,
    })
}

fn inside_out(mesh: &Mesh, topology: &Topology) -> Vec<Fault> {
    let components = topology.components();
    let mut sound: Vec<bool> = topology.open(&components).iter().map(|open| !open).collect();
    // the volume means nothing where a face is turned over
    for side in topology.edges().filter(|edge| !is_balanced(edge)).filter_map(|edge| edge.first()) {
        let component = components.get(side.face).and_then(|component| sound.get_mut(*component as usize));
        component.into_iter().for_each(|sound| *sound = false);
    }
    let mut members: Vec<Vec<usize>> = vec![Vec::new(); sound.len()];
    for (face, component) in components.iter().enumerate() {
        members.get_mut(*component as usize).into_iter().for_each(|members| members.push(face));
    }
    let fault = |(component, faces): (usize, &Vec<usize>)| {
        let triangles = faces.iter().filter_map(|face| mesh.corners(mesh.faces.get(*face)?));
        let volume_m3 = clear_volume(triangles).filter(|volume| *volume < 0.0)?;
        Some(Fault::InsideOut { component, face: *faces.first()?, volume_m3 })
    };
    members.iter().enumerate().filter(|(c, _)| sound.get(*c) == Some(&true)).filter_map(fault).collect()
}

/// The signed volume \[m³\] that triangles enclose; none if it is 0 but for rounding.
pub(super) fn clear_volume(triangles: impl Iterator<Item = [DVec3; 3]> + Clone) -> Option<f64> {
    let volume = signed_volume(triangles.clone());
    let (low, high) = bounds(triangles.clone().flatten())?;
    let surface: f64 = triangles.map(|triangle| area(&triangle)).sum();
    (volume.abs() > LEAST_VOLUME * surface * low.distance(high)).then_some(volume)
}

fn scale(mesh: &Mesh) -> Option<Fault> {
    let (low, high) = mesh.bounds()?;
    let diagonal_m = low.distance(high);
    let suggested = if diagonal_m < 1.0 { 1000.0 } else { 0.001 };
    (!USUAL_M.contains(&diagonal_m)).then_some(Fault::Scale { diagonal_m, suggested })
}

fn unused(mesh: &Mesh) -> impl Iterator<Item = Fault> {
    let is_used = used(mesh);
    is_used.into_iter().enumerate().filter(|(_, used)| !used).map(|(vertex, _)| Fault::Unused { vertex })
}

/// For each vertex whether a face has it.
pub(super) fn used(mesh: &Mesh) -> Vec<bool> {
    let mut used = vec![false; mesh.vertices.len()];
    for corner in mesh.faces.iter().flat_map(|face| face.corners) {
        used.get_mut(corner as usize).into_iter().for_each(|used| *used = true);
    }
    used
}

#[cfg(test)]
mod tests {
    use glam::DMat3;

    use super::super::fault::Severity;
    use super::super::primitives::{cuboid, plate};
    use super::super::repair::repair;
    use super::*;

    /// The only fault of a unit box after a change, and how severe it is.
    fn only(change: impl Fn(&mut Mesh)) -> (String, Severity) {
        let mut mesh = cuboid(DVec3::ONE);
        change(&mut mesh);
        let faults = faults(&mesh);
        assert_eq!(faults.len(), 1, "{faults:?}");
        (faults[0].to_string(), faults[0].severity())
    }

    #[test]
    fn each_fault_is_found_alone_and_named() {
        let expect =
            |found: (String, Severity), text: &str, severity| assert_eq!(found, (text.to_owned(), severity));
        expect(
            only(|mesh| mesh.faces[3].material = 4),
            "face 3 has material 4, but there are 1, numbered from 0: correct the number",
            Severity::Fatal,
        );
        expect(
            only(|mesh| mesh.faces[2].group = 1),
            "face 2 has group 1, but there are 1, numbered from 0: correct the number",
            Severity::Fatal,
        );
        expect(
            only(|mesh| mesh.faces.push(Face { corners: [0, 1, 8], ..mesh.faces[0] })),
            "face 12 has vertex 8, but there are 8, numbered from 0: correct the number",
            Severity::Fatal,
        );
        expect(
            only(|mesh| mesh.faces.push(Face { corners: [0, 1, 1], ..mesh.faces[0] })),
            "face 12 has no area to speak of: 0e0 m² along an edge of 1 m; drop it or repair the mesh",
            Severity::Warning,
        );
        expect(
            only(|mesh| {
                mesh.vertices.push(mesh.vertices[7]);
                mesh.faces[11].corners = mesh.faces[11].corners.map(|c| if c == 7 { 8 } else { c });
            }),
            "vertex 8 is at exactly the same place as vertex 7; they count as one",
            Severity::Note,
        );
        expect(
            only(|mesh| mesh.faces.push(mesh.faces[5])),
            "face 12 has the same three vertices as face 5, wound alike; drop one of them or repair the mesh",
            Severity::Warning,
        );
        expect(
            only(|mesh| mesh.faces.iter_mut().for_each(|face| *face = face.flipped())),
            "the closed body 0 from face 0 on is inside out: its volume is -1e0 m³; flip its faces or repair the mesh (unless it is a cavity)",
            Severity::Warning,
        );
        expect(
            only(|mesh| *mesh = mesh.scaled(1e-3)),
            "the mesh is 0.0017320508075688774 m across: is its unit of length another than the metre? If so, set shape_scale = 1000",
            Severity::Warning,
        );
        assert!(only(|mesh| *mesh = mesh.scaled(1e6)).0.ends_with("set shape_scale = 0.001"));
        expect(
            only(|mesh| mesh.vertices.push(DVec3::ZERO)),
            "vertex 8 belongs to no face; drop it, or ignore this",
            Severity::Note,
        );
        expect(
            only(|mesh| {
                let other = cuboid(DVec3::ONE).transformed(&DMat3::IDENTITY, DVec3::new(1.0, 1.0, 0.0));
                mesh.merge(&other).unwrap();
                *mesh = repair(mesh).0;
            }),
            "4 faces meet at the edge between vertices 3 and 7: [2, 7, 12, 17]; they are taken as bodies that touch",
            Severity::Note,
        );
    }

    fn told(mesh: &Mesh, least: Severity) -> Vec<String> {
        faults(mesh).iter().filter(|fault| fault.severity() >= least).map(ToString::to_string).collect()
    }

    #[test]
    fn faults_that_come_in_several() {
        let mut mesh = cuboid(DVec3::ONE);
        mesh.vertices[0].x = f64::NAN;
        assert_eq!(
            told(&mesh, Severity::Fatal),
            ["vertex 0 is at [NaN, -0.5, -0.5]: its coordinates must be finite"]
        );

        let mut mesh = cuboid(DVec3::ONE);
        mesh.faces.pop();
        let open = told(&mesh, Severity::Note);
        assert_eq!(open.len(), 3);
        assert!(open[0].starts_with("face "));
        assert!(open[0].ends_with(": a sheet, lit from both sides"));

        let mut mesh = cuboid(DVec3::ONE);
        mesh.faces[0] = mesh.faces[0].flipped();
        let turned = told(&mesh, Severity::Note);
        assert_eq!(turned.len(), 3);
        assert_eq!(
            turned[0],
            "faces 0 and 5 run the same way along the edge between vertices 0 and 4: flip one of them or repair the mesh"
        );

        let mut mesh = cuboid(DVec3::ONE);
        mesh.vertices.push(mesh.vertices[7] + DVec3::X * 5e-10);
        mesh.faces[11].corners = mesh.faces[11].corners.map(|c| if c == 7 { 8 } else { c });
        let crack = told(&mesh, Severity::Warning);
        assert_eq!(crack.len(), 1);
        assert!(
            crack[0].starts_with("vertex 8 is only 5.0")
                && crack[0].ends_with("e-10 m from vertex 7: a crack; weld them or repair the mesh")
        );

        let mut mesh = cuboid(DVec3::ONE);
        mesh.merge(&plate(1.0, 1.0).transformed(&DMat3::IDENTITY, DVec3::new(1.0, 0.0, 0.5))).unwrap();
        let fin = told(&mesh, Severity::Warning);
        assert_eq!(fin.len(), 1);
        assert!(fin[0].starts_with("3 faces meet at the edge between vertices 5 and 7: "));
        assert!(fin[0].ends_with("; no side of it is inside: part the bodies or drop the faces within"));
    }

    #[test]
    fn slivers_are_told_at_every_size() {
        for size in [1e-6, 1.0, 1e6] {
            let sliver = |height| [DVec3::ZERO, DVec3::X * size, DVec3::new(0.5, height, 0.0) * size];
            assert!(thin(&sliver(1e-13)).is_some() && thin(&sliver(1e-11)).is_none());
        }
    }

    #[test]
    fn nothing_has_no_faults() {
        assert_eq!(faults(&Mesh::default()), []);
    }
}
