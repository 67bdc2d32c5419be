//! How triangles hang together: edges, connected components and which of them are closed.
//!
//! Vertices at the same place count as one, however they are numbered.

use std::collections::HashMap;

use glam::DVec3;

use super::mesh::{Face, Mesh, number};

/// One side of one face along an edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Use {
    /// The edge: its vertices, the lesser number first.
    pub ends: [u32; 2],
    /// The face.
    pub face: usize,
    /// Whether the face runs from the first end to the second.
    pub forward: bool,
}

/// The edges of a mesh.
pub(super) struct Topology {
    /// For each face an earlier one with the same three vertices, and whether it is wound alike.
    pub repeats: Vec<Option<(usize, bool)>>,
    /// Sorted by edge. A face that repeats an earlier one wound alike is left out: it adds nothing to the surface. A face
    /// with two corners at one place or with a vertex out of range has no edges.
    uses: Vec<Use>,
}

impl Topology {
    pub fn of(mesh: &Mesh) -> Self {
        let welded = welded(&mesh.vertices);
        let at = |corner: u32| welded.get(corner as usize).copied();
        let mut first: HashMap<[u32; 3], usize> = HashMap::new();
        let mut repeats = vec![None; mesh.faces.len()];
        let mut uses = Vec::with_capacity(3 * mesh.faces.len());
        for ((face, repeat), Face { corners, .. }) in repeats.iter_mut().enumerate().zip(&mesh.faces) {
            let [Some(a), Some(b), Some(c)] = corners.map(at) else { continue };
            if a == b || b == c || c == a {
                continue;
            }
            let alike = first.get(&from_least([a, b, c])).map(|earlier| (*earlier, true));
            *repeat = alike.or_else(|| first.get(&from_least([a, c, b])).map(|earlier| (*earlier, false)));
            if alike.is_none() {
                first.insert(from_least([a, b, c]), face);
                let side =
                    |[from, to]: [u32; 2]| Use { ends: [from.min(to), from.max(to)], face, forward: from < to };
                uses.extend([[a, b], [b, c], [c, a]].map(side));
            }
        }
        uses.sort_unstable();
        Self { repeats, uses }
    }

    /// The edges, each with all faces that use it.
    pub fn edges(&self) -> impl Iterator<Item = &[Use]> {
        self.uses.chunk_by(|a, b| a.ends == b.ends)
    }

    /// Number of the component of each face, in the order of their first faces.
    pub fn components(&self) -> Vec<u32> {
        let mut sets = Sets((0..self.repeats.len()).collect());
        for pair in self.edges().flat_map(|edge| edge.windows(2)) {
            if let [a, b] = pair {
                sets.join(a.face, b.face);
            }
        }
        for (face, earlier) in self.repeats.iter().enumerate() {
            sets.join(face, earlier.map_or(face, |(earlier, _)| earlier));
        }
        let mut numbers = HashMap::new();
        let roots = (0..self.repeats.len()).map(|face| sets.root(face));
        roots
            .map(|root| {
                let next = number(numbers.len());
                *numbers.entry(root).or_insert(next)
            })
            .collect()
    }

    /// For each component, whether it is open.
    pub fn open(&self, components: &[u32]) -> Vec<bool> {
        let count = components.iter().max().map_or(0, |last| *last as usize + 1);
        // what has no edges encloses nothing
        let (mut has_edges, mut bordered) = (vec![false; count], vec![false; count]);
        for edge in self.edges() {
            let component = edge.first().and_then(|side| components.get(side.face)).map_or(0, |c| *c as usize);
            let border = edge.len() == 1 || (edge.len() > 2 && !is_balanced(edge));
            has_edges.get_mut(component).into_iter().for_each(|has| *has = true);
            bordered.get_mut(component).into_iter().for_each(|has| *has |= border);
        }
        has_edges.iter().zip(bordered).map(|(has_edges, bordered)| bordered || !has_edges).collect()
    }
}

/// Whether an edge is used as often in each direction.
pub(super) fn is_balanced(edge: &[Use]) -> bool {
    2 * edge.iter().filter(|side| side.forward).count() == edge.len()
}

/// Number of the component of each face. Faces that share an edge are of one component.
pub fn components(mesh: &Mesh) -> Vec<u32> {
    Topology::of(mesh).components()
}

/// For each component, whether it is open: it has an edge that only one face uses, or one that more than two use, but not
/// as often in each direction. Bodies that touch along an edge are so closed.
pub fn open(mesh: &Mesh) -> Vec<bool> {
    let topology = Topology::of(mesh);
    topology.open(&topology.components())
}

/// For each vertex the first one at exactly the same place.
pub(super) fn welded(vertices: &[DVec3]) -> Vec<u32> {
    let mut first = HashMap::with_capacity(vertices.len());
    let of = |(number, vertex): (u32, &DVec3)| *first.entry(place(*vertex)).or_insert(number);
    (0..).zip(vertices).map(of).collect()
}

fn place(vertex: DVec3) -> [u64; 3] {
    // adding 0 makes -0 the same place as 0
    (vertex + DVec3::ZERO).to_array().map(f64::to_bits)
}

/// The corners in the same order, from the one of least number on.
fn from_least([a, b, c]: [u32; 3]) -> [u32; 3] {
    if a < b && a < c {
        [a, b, c]
    } else if b < c {
        [b, c, a]
    } else {
        [c, a, b]
    }
}

/// Disjoint sets: for each member another of its set, itself if it is the root.
struct Sets(Vec<usize>);

impl Sets {
    fn parent(&self, member: usize) -> usize {
        self.0.get(member).copied().unwrap_or(member)
    }

    fn point(&mut self, member: usize, at: usize) {
        self.0.get_mut(member).into_iter().for_each(|parent| *parent = at);
    }

    fn root(&mut self, mut member: usize) -> usize {
        while self.parent(member) != member {
            let grandparent = self.parent(self.parent(member));
            self.point(member, grandparent);
            member = grandparent;
        }
        member
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.point(a.max(b), a.min(b));
    }
}

#[cfg(test)]
mod tests {
    use glam::DMat3;

    use super::super::primitives::{cuboid, plate};
    use super::*;

    fn boxes(shift: DVec3) -> Mesh {
        let mut mesh = cuboid(DVec3::ONE);
        mesh.merge(&cuboid(DVec3::ONE).transformed(&DMat3::IDENTITY, shift)).unwrap();
        mesh
    }

    #[test]
    fn boxes_that_touch_along_an_edge_or_a_side_are_one_closed_component() {
        for (shift, expected) in [
            (DVec3::new(3.0, 0.0, 0.0), vec![false; 2]),
            (DVec3::ONE, vec![false; 2]), // a corner joins nothing
            (DVec3::new(1.0, 1.0, 0.0), vec![false]),
            (DVec3::X, vec![false]),
        ] {
            assert_eq!(open(&boxes(shift)), expected, "{shift}");
        }
    }

    #[test]
    fn a_box_without_a_face_or_with_a_fin_is_open() {
        let mut mesh = cuboid(DVec3::ONE);
        mesh.faces.pop();
        assert_eq!(open(&mesh), [true]);
        let mut mesh = cuboid(DVec3::ONE);
        let fin = plate(1.0, 1.0).transformed(&DMat3::IDENTITY, DVec3::new(1.0, 0.0, 0.5));
        mesh.merge(&fin).unwrap();
        assert_eq!(open(&mesh), [true]);
    }

    #[test]
    fn faces_that_share_no_vertex_numbers_hang_together_by_place() {
        let mesh = cuboid(DVec3::ONE);
        let apart =
            Mesh::plain(mesh.triangles().flatten().collect(), (0..12).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]));
        assert_eq!((components(&apart), open(&apart)), (vec![0; 12], vec![false]));
    }

    #[test]
    fn a_repeated_face_changes_nothing() {
        let mut mesh = cuboid(DVec3::ONE);
        mesh.faces.push(mesh.faces[5]);
        assert_eq!((components(&mesh), open(&mesh)), (vec![0; 13], vec![false]));
    }

    #[test]
    fn nothing_and_nonsense_have_no_closed_component() {
        assert_eq!((components(&Mesh::default()), open(&Mesh::default())), (vec![], vec![]));
        let mesh = Mesh::plain(vec![DVec3::ZERO; 3], [[0, 1, 2], [7, 8, 9]]);
        assert_eq!(open(&mesh), [true, true]);
    }
}
