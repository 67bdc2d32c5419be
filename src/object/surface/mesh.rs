//! Triangles with named groups and materials, and what can be said of them without knowing their neighbours.

use std::collections::HashMap;

use glam::{DMat3, DVec3};

use super::error::Full;

/// Most groups, and most materials: their numbers are 16 bits.
pub const MOST_NAMES: usize = 1 << 16;

/// A triangle mesh \[m, body axes\]. Seen from outside, the corners of a face run counter-clockwise.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Positions \[m\].
    pub vertices: Vec<DVec3>,
    /// The triangles.
    pub faces: Vec<Face>,
    /// Names of the groups.
    pub groups: Vec<String>,
    /// Names of the materials; the first is empty: none named.
    pub materials: Vec<String>,
}

/// A triangle.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Face {
    /// Numbers of its vertices, counter-clockwise seen from outside.
    pub corners: [u32; 3],
    /// Number of its group.
    pub group: u16,
    /// Number of its material.
    pub material: u16,
}

impl Face {
    /// The same triangle seen from its other side.
    pub fn flipped(self) -> Self {
        let [a, b, c] = self.corners;
        Self { corners: [a, c, b], ..self }
    }
}

impl Mesh {
    /// A mesh in one nameless group without a named material.
    pub fn plain(vertices: Vec<DVec3>, corners: impl IntoIterator<Item = [u32; 3]>) -> Self {
        let faces = corners.into_iter().map(|corners| Face { corners, group: 0, material: 0 }).collect();
        Self { vertices, faces, groups: vec![String::new()], materials: vec![String::new()] }
    }

    /// Positions of a face's corners \[m\]; none if a number is out of range.
    pub fn corners(&self, face: &Face) -> Option<[DVec3; 3]> {
        let at = |corner: u32| self.vertices.get(corner as usize).copied();
        let [a, b, c] = face.corners;
        Some([at(a)?, at(b)?, at(c)?])
    }

    /// The triangles \[m\], without faces whose numbers are out of range.
    pub fn triangles(&self) -> impl Iterator<Item = [DVec3; 3]> + Clone + '_ {
        self.faces.iter().filter_map(|face| self.corners(face))
    }

    /// Appends another mesh; groups and materials of the same name become one. Nothing is welded.
    ///
    /// # Errors
    /// [`Full`] if there are more vertices or names than can be numbered; the mesh is then as it was.
    pub fn merge(&mut self, other: &Self) -> Result<(), Full> {
        let count = self.vertices.len() + other.vertices.len();
        let limit = u32::MAX as usize;
        if count > limit {
            return Err(Full { what: "vertices", count, limit });
        }
        let mut groups = Names::new(self.groups.clone());
        let mut materials = Names::new(self.materials.clone());
        materials.number("");
        let group = other.groups.iter().map(|name| groups.number(name)).collect::<Option<Vec<u16>>>();
        let material = other.materials.iter().map(|name| materials.number(name)).collect::<Option<Vec<u16>>>();
        let full = |what| Full { what, count: MOST_NAMES + 1, limit: MOST_NAMES };
        let group = group.ok_or_else(|| full("groups"))?;
        let material = material.ok_or_else(|| full("materials"))?;
        (self.groups, self.materials) = (groups.list, materials.list);
        // a number that meant nothing in the other mesh must not come to mean something here
        let renumbered = |numbers: &[u16], old: u16| numbers.get(usize::from(old)).copied().unwrap_or(u16::MAX);
        self.append(other, |face| (renumbered(&group, face.group), renumbered(&material, face.material)));
        Ok(())
    }

    /// Appends the faces of a part, with the numbers of the group and the material each is to have here.
    pub(super) fn append(&mut self, part: &Self, tag: impl Fn(&Face) -> (u16, u16)) {
        let base = number(self.vertices.len());
        self.vertices.extend(&part.vertices);
        self.faces.extend(part.faces.iter().map(|face| {
            let (group, material) = tag(face);
            Face { corners: face.corners.map(|corner| corner.saturating_add(base)), group, material }
        }));
    }

    /// Every position by a matrix, then a shift \[m\]. A matrix that mirrors also turns the faces, so that outside stays
    /// outside.
    #[must_use]
    pub fn transformed(&self, matrix: &DMat3, shift_m: DVec3) -> Self {
        let mut out = self.clone();
        out.vertices.iter_mut().for_each(|vertex| *vertex = *matrix * *vertex + shift_m);
        if matrix.determinant() < 0.0 {
            out.faces.iter_mut().for_each(|face| *face = face.flipped());
        }
        out
    }

    /// Every position times a factor.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        self.transformed(&DMat3::from_diagonal(DVec3::splat(factor)), DVec3::ZERO)
    }

    /// Least and greatest coordinates of the faces \[m\]; none without faces.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        bounds(self.triangles().flatten())
    }

    /// Area of all faces, one side each \[m²\].
    pub fn area(&self) -> f64 {
        self.triangles().map(|triangle| area(&triangle)).sum()
    }

    /// Volume by the divergence theorem \[m³\]: above 0 where faces look outwards. It means something only if the mesh is
    /// closed.
    pub fn signed_volume(&self) -> f64 {
        signed_volume(self.triangles())
    }

    /// Centroid of the surface \[m\]; none without area.
    pub fn centroid(&self) -> Option<DVec3> {
        let total = self.area();
        let moment: DVec3 = self.triangles().map(|t| area(&t) * (t[0] + t[1] + t[2]) / 3.0).sum();
        (total > 0.0).then(|| moment / total)
    }

    /// Centroid of the enclosed volume \[m\]; none without volume. It means something only if the mesh is closed.
    pub fn volume_centroid(&self) -> Option<DVec3> {
        let (low, high) = self.bounds()?;
        let about = 0.5 * (low + high);
        let volume = self.signed_volume();
        let moment = |[a, b, c]: [DVec3; 3]| a.dot(b.cross(c)) / 24.0 * (a + b + c);
        let total: DVec3 = self.triangles().map(|t| moment(t.map(|corner| corner - about))).sum();
        (volume != 0.0).then(|| about + total / volume)
    }
}

/// A count as a vertex number. One beyond 32 bits becomes a number that is out of range, which the check finds.
pub(super) fn number(count: usize) -> u32 {
    u32::try_from(count).unwrap_or(u32::MAX)
}

/// Least and greatest coordinates of the finite points \[m\]; none if there is no such point.
pub(super) fn bounds(points: impl IntoIterator<Item = DVec3>) -> Option<(DVec3, DVec3)> {
    let finite = points.into_iter().filter(|point| point.is_finite());
    finite.map(|point| (point, point)).reduce(|(low, high), (point, _)| (low.min(point), high.max(point)))
}

/// Area of a triangle \[m²\].
pub(super) fn area([a, b, c]: &[DVec3; 3]) -> f64 {
    0.5 * (b - a).cross(c - a).length()
}

/// Volume that triangles enclose \[m³\], above 0 where they look outwards.
pub(super) fn signed_volume(triangles: impl Iterator<Item = [DVec3; 3]> + Clone) -> f64 {
    // about the middle: a body far from the origin would lose its volume in the rounding
    let about = bounds(triangles.clone().flatten()).map_or(DVec3::ZERO, |(low, high)| 0.5 * (low + high));
    let sixfold = |[a, b, c]: [DVec3; 3]| (a - about).dot((b - about).cross(c - about));
    triangles.map(sixfold).sum::<f64>() / 6.0
}

/// Names with their numbers.
#[derive(Default)]
pub(super) struct Names {
    /// The names in the order of their numbers.
    pub list: Vec<String>,
    numbers: HashMap<String, u16>,
}

impl Names {
    pub fn new(list: Vec<String>) -> Self {
        let mut numbers = HashMap::new();
        for (name, number) in list.iter().zip(0..=u16::MAX) {
            numbers.entry(name.clone()).or_insert(number);
        }
        Self { list, numbers }
    }

    /// Number of a name, which is added if it is new; none if there is no number left.
    pub fn number(&mut self, name: &str) -> Option<u16> {
        if let Some(number) = self.numbers.get(name) {
            return Some(*number);
        }
        let number = u16::try_from(self.list.len()).ok()?;
        self.list.push(name.to_owned());
        self.numbers.insert(name.to_owned(), number);
        Some(number)
    }
}

#[cfg(test)]
mod tests {
    use super::super::primitives::{cuboid, plate};
    use super::*;

    #[test]
    fn a_box_has_its_area_volume_and_centroids_at_any_size_and_place() {
        for size in [1e-6, 1.0, 1e6] {
            let shift = DVec3::new(30.0, -20.0, 10.0) * size;
            let mesh = cuboid(DVec3::new(1.0, 2.0, 3.0)).scaled(size).transformed(&DMat3::IDENTITY, shift);
            assert!((mesh.area() / (22.0 * size.powi(2)) - 1.0).abs() < 1e-12);
            assert!((mesh.signed_volume() / (6.0 * size.powi(3)) - 1.0).abs() < 1e-12);
            let middle = |point: Option<DVec3>| point.unwrap().distance(shift) / size;
            assert!(middle(mesh.centroid()) < 1e-12 && middle(mesh.volume_centroid()) < 1e-12);
            let (low, high) = mesh.bounds().unwrap();
            assert!((high - low).distance(DVec3::new(1.0, 2.0, 3.0) * size) < 1e-13 * 30.0 * size);
        }
    }

    #[test]
    fn a_mirror_keeps_outside_outside() {
        assert!((cuboid(DVec3::ONE).scaled(-2.0).signed_volume() - 8.0).abs() < 1e-12);
    }

    #[test]
    fn the_centroids_of_an_off_centre_pair_are_weighted() {
        let mut mesh = cuboid(DVec3::ONE);
        mesh.merge(&cuboid(DVec3::splat(2.0)).transformed(&DMat3::IDENTITY, DVec3::X * 9.0)).unwrap();
        assert!((mesh.volume_centroid().unwrap().x - 8.0).abs() < 1e-12);
        assert!((mesh.centroid().unwrap().x - 7.2).abs() < 1e-12);
    }

    #[test]
    fn merging_joins_names() {
        let named = |group: &str, material: &str| Mesh {
            groups: vec![group.into()],
            materials: vec![String::new(), material.into()],
            faces: vec![Face { corners: [0, 1, 2], group: 0, material: 1 }],
            ..plate(1.0, 1.0)
        };
        let mut mesh = Mesh::default();
        for (group, material) in [("bus", "mli"), ("panel", "cell"), ("bus", "cell")] {
            mesh.merge(&named(group, material)).unwrap();
        }
        assert_eq!((mesh.groups.join(" "), mesh.materials.join(" ")), ("bus panel".into(), " mli cell".into()));
        let tags: Vec<_> = mesh.faces.iter().map(|face| (face.corners[0], face.group, face.material)).collect();
        assert_eq!(tags, [(0, 0, 1), (4, 1, 2), (8, 0, 2)]);
    }

    #[test]
    fn too_many_names_are_refused_and_nothing_changes() {
        let many = |letter: &str, count| Mesh {
            groups: (0..count).map(|k| format!("{letter}{k}")).collect(),
            ..Mesh::default()
        };
        let mut mesh = many("a", MOST_NAMES);
        let before = mesh.clone();
        let error = mesh.merge(&many("b", 1)).unwrap_err();
        assert_eq!(error.to_string(), "together the meshes have 65537 groups; one can have 65536");
        assert_eq!(mesh, before);
    }

    #[test]
    fn nothing_has_no_size() {
        let mesh = Mesh::default();
        assert_eq!((mesh.area(), mesh.signed_volume()), (0.0, 0.0));
        assert_eq!((mesh.bounds(), mesh.centroid(), mesh.volume_centroid()), (None, None, None));
        assert_eq!(mesh.scaled(2.0), mesh);
    }
}
