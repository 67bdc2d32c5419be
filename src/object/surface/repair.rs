//! Repairing a mesh, for those who ask for it.

use glam::DVec3;

use super::check::{clear_volume, nearly_welded, thin, used};
use super::mesh::{Face, Mesh, number};
use super::topology::{Topology, Use};

/// How many of each thing a repair did.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Done {
    welded: usize,
    broken: usize,
    thin: usize,
    repeated: usize,
    flipped: usize,
    unused: usize,
}

/// A repaired mesh, and in words what was done: vertices closer than 1e-9 of the size are welded; faces without area, with
/// vertices that do not exist or are not finite, and with the vertices of another are dropped; faces are turned as their
/// neighbours and closed bodies outwards; vertices of no face are dropped. Repairing again changes nothing.
pub fn repair(mesh: &Mesh) -> (Mesh, Vec<String>) {
    let mut mesh = mesh.clone();
    let mut total = Done::default();
    // what is dropped can leave more to do; each pass but the last drops something or is followed by one that does not
    loop {
        let done = pass(&mut mesh);
        if done == Done::default() {
            return (mesh, total.words());
        }
        total.add(done);
    }
}

fn pass(mesh: &mut Mesh) -> Done {
    Done {
        welded: weld(mesh),
        broken: drop_faces(mesh, |mesh, _, face| {
            mesh.corners(face).is_none_or(|c| !c.iter().all(|v| v.is_finite()))
        }),
        thin: drop_faces(mesh, |mesh, _, face| mesh.corners(face).is_none_or(|corners| thin(&corners).is_some())),
        repeated: drop_repeated(mesh),
        flipped: turn(mesh),
        unused: drop_unused(mesh),
    }
}

/// Gives faces the first of the vertices that are meant to be the same.
fn weld(mesh: &mut Mesh) -> usize {
    let first = nearly_welded(&mesh.vertices);
    let before = used(mesh);
    for corner in mesh.faces.iter_mut().flat_map(|face| &mut face.corners) {
        *corner = first.get(*corner as usize).copied().unwrap_or(*corner);
    }
    before.iter().zip(used(mesh)).filter(|(before, after)| **before && !after).count()
}

fn drop_faces(mesh: &mut Mesh, is_bad: impl Fn(&Mesh, usize, &Face) -> bool) -> usize {
    let good = mesh.faces.iter().enumerate().filter(|(number, face)| !is_bad(mesh, *number, face));
    let good: Vec<Face> = good.map(|(_, face)| *face).collect();
    let dropped = mesh.faces.len() - good.len();
    mesh.faces = good;
    dropped
}

/// Drops a face with the vertices of an earlier one if both are wound alike, or if its edges are of an odd number of faces.
/// Otherwise the two are the wall between bodies that touch, or the sides of a sheet.
fn drop_repeated(mesh: &mut Mesh) -> usize {
    let topology = Topology::of(mesh);
    let mut odd = vec![false; mesh.faces.len()];
    for side in topology.edges().filter(|edge| edge.len() % 2 == 1).flatten() {
        odd.get_mut(side.face).into_iter().for_each(|odd| *odd = true);
    }
    let repeats = |face: usize| topology.repeats.get(face).copied().flatten();
    drop_faces(mesh, |_, number, _| {
        repeats(number).is_some_and(|(_, alike)| alike || odd.get(number) == Some(&true))
    })
}

/// Turns faces as their neighbours over edges of two faces; a closed patch of them outwards, another as most of it was.
fn turn(mesh: &mut Mesh) -> usize {
    let topology = Topology::of(mesh);
    let mut flips: Vec<Option<bool>> = vec![None; mesh.faces.len()];
    let neighbours = neighbours(&topology, mesh.faces.len());
    for first in 0..mesh.faces.len() {
        if flips.get(first) == Some(&None) {
            let mut patch = patch(first, &neighbours, &mut flips);
            if goes_against(mesh, &patch, &neighbours) {
                patch.iter_mut().for_each(|(_, flip)| *flip = !*flip);
            }
            for (face, flip) in patch {
                flips.get_mut(face).into_iter().for_each(|entry| *entry = Some(flip));
            }
        }
    }
    let flipped = mesh.faces.iter_mut().zip(flips).filter(|(_, flip)| *flip == Some(true));
    flipped.map(|(face, _)| *face = face.flipped()).count()
}

/// For each face its neighbours over edges of two faces, and whether they run the same way along the edge.
fn neighbours(topology: &Topology, faces: usize) -> Vec<Vec<(usize, bool)>> {
    let mut out = vec![Vec::new(); faces];
    for edge in topology.edges() {
        if let [a, b] = edge {
            let mut add = |from: &Use, to: &Use| {
                out.get_mut(from.face).into_iter().for_each(|list| list.push((to.face, a.forward == b.forward)));
            };
            add(a, b);
            add(b, a);
        }
    }
    out
}

/// The faces that hang together with one, and whether each is to be flipped to be wound as that one is.
fn patch(first: usize, neighbours: &[Vec<(usize, bool)>], flips: &mut [Option<bool>]) -> Vec<(usize, bool)> {
    let mut patch = vec![(first, false)];
    flips.get_mut(first).into_iter().for_each(|flip| *flip = Some(false));
    let mut next = 0;
    while let Some((face, flip)) = patch.get(next).copied() {
        for (other, same_way) in neighbours.get(face).into_iter().flatten() {
            if let Some(entry @ None) = flips.get_mut(*other) {
                *entry = Some(flip ^ same_way);
                patch.push((*other, flip ^ same_way));
            }
        }
        next += 1;
    }
    patch
}

/// Whether a patch, once consistent, looks inwards; if it has no inside, whether most of it would be flipped.
fn goes_against(mesh: &Mesh, patch: &[(usize, bool)], neighbours: &[Vec<(usize, bool)>]) -> bool {
    let is_closed = patch.iter().all(|(face, _)| neighbours.get(*face).is_some_and(|list| list.len() == 3));
    let triangles = patch.iter().filter_map(|(face, flip)| {
        let face = mesh.faces.get(*face)?;
        mesh.corners(&if *flip { face.flipped() } else { *face })
    });
    match clear_volume(triangles).filter(|_| is_closed) {
        Some(volume) => volume < 0.0,
        None => 2 * patch.iter().filter(|(_, flip)| *flip).count() > patch.len(),
    }
}

fn drop_unused(mesh: &mut Mesh) -> usize {
    let used = used(mesh);
    let mut kept: Vec<DVec3> = Vec::with_capacity(mesh.vertices.len());
    let mut numbers = Vec::with_capacity(mesh.vertices.len());
    for (vertex, used) in mesh.vertices.iter().zip(used) {
        numbers.push(number(kept.len()));
        kept.extend(used.then_some(*vertex));
    }
    for corner in mesh.faces.iter_mut().flat_map(|face| &mut face.corners) {
        *corner = numbers.get(*corner as usize).copied().unwrap_or(*corner);
    }
    let dropped = mesh.vertices.len() - kept.len();
    mesh.vertices = kept;
    dropped
}

impl Done {
    fn add(&mut self, other: Self) {
        self.welded += other.welded;
        self.broken += other.broken;
        self.thin += other.thin;
        self.repeated += other.repeated;
        self.flipped += other.flipped;
        self.unused += other.unused;
    }

    fn words(self) -> Vec<String> {
        let counted = |count: usize, one: &str, many: &str, rest: &str| {
            (count > 0).then(|| format!("{count} {} {rest}", if count == 1 { one } else { many }))
        };
        let faces = |count, rest| counted(count, "face", "faces", rest);
        let vertices = |count, rest| counted(count, "vertex", "vertices", rest);
        let all = [
            vertices(self.welded, "welded to another at the same place"),
            faces(self.broken, "dropped: a vertex does not exist or is not finite"),
            faces(self.thin, "dropped: no area"),
            faces(self.repeated, "dropped: the same vertices as another"),
            faces(self.flipped, "flipped"),
            vertices(self.unused, "dropped: of no face"),
        ];
        all.into_iter().flatten().collect()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::check::faults;
    use super::super::fault::Fault;
    use super::super::primitives::{box_wing, cuboid, dish, sphere, torus};
    use super::*;

    /// Each face with vertices of its own, moved a little, and some flipped.
    fn scrambled(mesh: &Mesh, flips: &[bool], jitter: f64) -> Mesh {
        let moved = |(k, v): (usize, DVec3)| v + DVec3::splat(jitter * (k % 3) as f64);
        let vertices = mesh.triangles().flatten().enumerate().map(moved).collect();
        let mut out = Mesh::plain(vertices, (0..mesh.faces.len() as u32).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]));
        for (face, flip) in out.faces.iter_mut().zip(flips.iter().cycle()) {
            *face = if *flip { face.flipped() } else { *face };
        }
        out
    }

    #[test]
    fn what_was_done_is_said() {
        let mut mesh = scrambled(&cuboid(DVec3::ONE), &[true, false, true, false, false], 1e-10);
        mesh.faces.push(mesh.faces[4]);
        mesh.faces.push(Face { corners: [0, 1, 1], ..mesh.faces[0] });
        mesh.faces.push(Face { corners: [0, 1, 999], ..mesh.faces[0] });
        let (repaired, words) = repair(&mesh);
        assert_eq!(faults(&repaired), []);
        assert_eq!(
            words,
            [
                "28 vertices welded to another at the same place",
                "1 face dropped: a vertex does not exist or is not finite",
                "1 face dropped: no area",
                "1 face dropped: the same vertices as another",
                "5 faces flipped",
                "28 vertices dropped: of no face"
            ]
        );
    }

    #[test]
    fn sound_meshes_are_left_alone() {
        for mesh in [Mesh::default(), box_wing(), dish(2.0, 0.3, 16), torus(1.0, 0.2, 9, 7)] {
            assert_eq!(repair(&mesh), (mesh, vec![]));
        }
    }

    #[test]
    fn boxes_that_share_a_wall_keep_it() {
        let mut mesh = cuboid(DVec3::ONE);
        mesh.merge(&cuboid(DVec3::ONE).transformed(&glam::DMat3::IDENTITY, DVec3::X)).unwrap();
        assert_eq!(repair(&mesh).0.faces.len(), 24);
    }

    #[test]
    fn most_of_a_sheet_decides_its_side() {
        let sheet = dish(2.0, 0.3, 16);
        let (repaired, _) = repair(&scrambled(&sheet, &[true, false, false], 0.0));
        assert!(repaired.triangles().all(|[a, b, c]| (b - a).cross(c - a).z > 0.0));
    }

    proptest! {
        #[test]
        fn a_scrambled_body_is_restored(flips in prop::collection::vec(any::<bool>(), 1..30), exponent in -6..7) {
            let size = 10.0_f64.powi(exponent);
            for mesh in [cuboid(DVec3::new(1.0, 2.0, 3.0)), sphere(1.0, 3), box_wing()] {
                let mesh = mesh.scaled(size);
                let (repaired, _) = repair(&scrambled(&mesh, &flips, 1e-10 * size));
                prop_assert_eq!(repaired.vertices.len(), mesh.vertices.len());
                prop_assert!((repaired.signed_volume() / mesh.signed_volume() - 1.0).abs() < 1e-8);
                let is_scale = |fault: &Fault| matches!(fault, Fault::Scale { .. });
                prop_assert!(faults(&repaired).iter().all(is_scale));
            }
        }

        #[test]
        fn repairing_again_changes_nothing(
            places in prop::collection::vec(prop::array::uniform3(prop::sample::select(vec![0.0, 1.0, 2.0, 1e-10, 1.000_000_000_9, 3e-9, f64::NAN])), 0..12),
            faces in prop::collection::vec(prop::array::uniform3(0_u32..13), 0..24),
        ) {
            let mesh = Mesh::plain(places.into_iter().map(DVec3::from_array).collect(), faces);
            let _ = faults(&mesh);
            let (once, _) = repair(&mesh);
            prop_assert_eq!(repair(&once), (once.clone(), vec![]));
        }
    }
}
