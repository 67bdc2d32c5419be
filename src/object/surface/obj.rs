//! Wavefront OBJ: its polygons, groups and material names. Texture, normals, lines and points are left aside.

use std::fmt::Write;

use glam::DVec3;

use super::error::ReadError;
use super::mesh::{Face, MOST_NAMES, Mesh, Names};
use super::text::{Statement, shown, statements, writable};
use super::triangulate::triangulate;

/// What an OBJ file says.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Obj {
    /// The mesh, in the file's unit of length, which is taken as metres.
    pub mesh: Mesh,
    /// Names of its material files, in order.
    pub mtllibs: Vec<String>,
}

/// Reads an OBJ file. Polygons become triangles, a group is the first name of `g` or else the name of `o`, and only names
/// of faces are kept. A vertex may be defined below the face that uses it.
///
/// # Errors
/// [`ReadError`] with the line of what cannot be read.
pub fn read(text: &str) -> Result<Obj, ReadError> {
    let statements = statements(text);
    let of = |keyword| statements.iter().filter(move |statement| statement.keyword() == keyword);
    let vertex = |statement: &Statement| statement.numbers("x y z").map(DVec3::from_array);
    let vertices = of("v").map(vertex).collect::<Result<Vec<DVec3>, ReadError>>()?;
    let mtllibs = of("mtllib").flat_map(|statement| file_names(statement.rest())).collect();
    Ok(Obj { mesh: Reader::new(vertices).mesh(&statements)?, mtllibs })
}

/// The state that statements leave for the faces below them.
struct Reader<'a> {
    vertices: Vec<DVec3>,
    /// Vertices above the present line.
    above: usize,
    object: &'a str,
    group: &'a str,
    material: &'a str,
    groups: Names,
    materials: Names,
}

impl<'a> Reader<'a> {
    fn new(vertices: Vec<DVec3>) -> Self {
        let (groups, materials) = (Names::default(), Names::new(vec![String::new()]));
        Self { vertices, above: 0, object: "", group: "", material: "", groups, materials }
    }

    fn mesh(mut self, statements: &'a [Statement]) -> Result<Mesh, ReadError> {
        let mut faces = Vec::new();
        for statement in statements {
            match statement.keyword() {
                "v" => self.above += 1,
                "f" | "fo" => self.polygon(statement, &mut faces)?,
                "g" => self.group = statement.words().next().unwrap_or(""),
                // an object begins without a group of its own
                "o" => (self.object, self.group) = (statement.rest(), ""),
                "usemtl" => self.material = statement.rest(),
                _ => {}
            }
        }
        Ok(Mesh { vertices: self.vertices, faces, groups: self.groups.list, materials: self.materials.list })
    }

    fn polygon(&mut self, statement: &Statement, faces: &mut Vec<Face>) -> Result<(), ReadError> {
        let line = statement.line;
        let corners = statement.words().map(|word| self.corner(word, line)).collect::<Result<Vec<u32>, _>>()?;
        if corners.len() < 3 {
            return Err(statement.count(corners.len(), "at least 3 corners"));
        }
        let name = if self.group.is_empty() { self.object } else { self.group };
        let full = |name, what| ReadError::Full { line, name: shown(name), what, limit: MOST_NAMES };
        let group = self.groups.number(name).ok_or_else(|| full(name, "groups"))?;
        let material = self.materials.number(self.material).ok_or_else(|| full(self.material, "materials"))?;
        let at = |corner: &u32| self.vertices.get(*corner as usize).copied();
        let points: Vec<DVec3> = corners.iter().filter_map(at).collect();
        let corner = |place: usize| corners.get(place).copied().unwrap_or(u32::MAX);
        let face = |places: [usize; 3]| Face { corners: places.map(corner), group, material };
        faces.extend(triangulate(&points).into_iter().map(face));
        Ok(())
    }

    /// Number of the vertex of a corner, from 0.
    fn corner(&self, word: &str, line: usize) -> Result<u32, ReadError> {
        let malformed = || ReadError::Corner { line, token: shown(word) };
        let mut parts = word.split('/');
        let index: i64 = parts.next().and_then(|part| part.parse().ok()).ok_or_else(malformed)?;
        let others: Vec<&str> = parts.collect();
        if others.len() > 2 || !others.iter().all(|part| part.is_empty() || part.parse::<i64>().is_ok()) {
            return Err(malformed());
        }
        let from_end = index < 0;
        let vertices = if from_end { self.above } else { self.vertices.len() };
        let distance = usize::try_from(index.unsigned_abs()).ok().filter(|d| (1..=vertices).contains(d));
        let place = distance.map(|d| if from_end { vertices - d } else { d - 1 });
        place.and_then(|place| u32::try_from(place).ok()).ok_or(ReadError::Index { line, index, vertices })
    }
}

/// File names in a list parted by blanks. A name may hold blanks itself: it then ends at ".mtl".
fn file_names(list: &str) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    let ends = |name: &str| name.to_ascii_lowercase().ends_with(".mtl");
    for word in list.split_whitespace() {
        match names.last_mut().filter(|last| !ends(last)) {
            Some(last) => last.extend([" ", word]),
            None => names.push(word.to_owned()),
        }
    }
    names
}

/// Writes a mesh as OBJ, with the shortest numbers that read back the same. In names, what an OBJ file cannot hold becomes
/// an underscore.
pub fn write(mesh: &Mesh, mtllib: Option<&str>) -> String {
    let mut lines = Lines::default();
    if let Some(name) = mtllib {
        lines.add(format_args!("mtllib {}", writable(name)));
    }
    for DVec3 { x, y, z } in &mesh.vertices {
        lines.add(format_args!("v {x:?} {y:?} {z:?}"));
    }
    let (mut group, mut material) = (String::new(), String::new());
    for face in &mesh.faces {
        let name = |names: &[String], number: u16| {
            names.get(usize::from(number)).map_or_else(String::new, |n| writable(n))
        };
        // the first word only would be read back
        let next = name(&mesh.groups, face.group).replace(char::is_whitespace, "_");
        if next != group {
            lines.add(format_args!("{}", format!("g {next}").trim_end()));
            group = next;
        }
        let next = name(&mesh.materials, face.material);
        if next != material {
            lines.add(format_args!("{}", format!("usemtl {next}").trim_end()));
            material = next;
        }
        let [a, b, c] = face.corners.map(|corner| u64::from(corner) + 1);
        lines.add(format_args!("f {a} {b} {c}"));
    }
    lines.0
}

/// Text that grows by lines.
#[derive(Default)]
pub(super) struct Lines(pub String);

impl Lines {
    pub fn add(&mut self, line: std::fmt::Arguments) {
        // writing to a string cannot fail
        let _ = writeln!(self.0, "{line}");
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::observatory::observatory;
    use super::super::primitives::{cuboid, sphere};
    use super::*;

    const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

    fn corners(faces: &str) -> Vec<[u32; 3]> {
        let obj = read(&format!("{SQUARE}{faces}")).unwrap();
        obj.mesh.faces.iter().map(|face| face.corners).collect()
    }

    #[test]
    fn corners_in_all_their_forms() {
        let expected = [[0, 1, 2], [0, 2, 3]];
        for face in ["1 2 3 4", "1/1 2/2 3/3 4/4", "1//1 2//2 3//3 4//4", "1/1/1 2/2/1 3//1 4/", "-4 -3/-1 -2 -1"]
        {
            assert_eq!(corners(&format!("vt 0 0\nf {face}\nl 1 2\np 1\ns off\n")), expected, "{face}");
        }
        assert_eq!(corners("f 1 2 \\\r\n 3 # end\n"), [[0, 1, 2]]);
        assert_eq!(corners("v 5 5 5 1.0\nv 6 6 6 .1 .2 .3\nf -1 -2 1\n"), [[5, 4, 0]]);
    }

    #[test]
    fn a_vertex_may_follow_its_face() {
        let obj = read("f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\n").unwrap();
        assert_eq!(obj.mesh.faces[0].corners, [0, 1, 2]);
    }

    #[test]
    fn groups_objects_and_materials() {
        let text = format!(
            "mtllib a b.mtl c.mtl\n{SQUARE}f 1 2 3\no body\nf 1 2 3\ng left wing\nusemtl white paint\nf 1 2 3\ng\nf 1 2 3\no b\nf 1 2 3\n"
        );
        let obj = read(&text).unwrap();
        assert_eq!(obj.mtllibs, ["a b.mtl", "c.mtl"]);
        assert_eq!(obj.mesh.groups, ["", "body", "left", "b"]);
        assert_eq!(obj.mesh.materials, ["", "white paint"]);
        let tags: Vec<_> = obj.mesh.faces.iter().map(|face| (face.group, face.material)).collect();
        assert_eq!(tags, [(0, 0), (1, 0), (2, 1), (1, 1), (3, 1)]);
    }

    #[test]
    fn faults_tell_value_line_and_what_is_allowed() {
        for (text, message) in [
            ("v 1 2", "line 5: v has 2 values, it takes x y z"),
            ("v 1 inf 2", "line 5: \"inf\" is not a finite number"),
            ("v 1 2 1e999", "line 5: \"1e999\" is not a finite number"),
            ("\nf 1 2", "line 6: f has 2 values, it takes at least 3 corners"),
            (
                "f 1 2 x",
                "line 5: \"x\" is not a corner of a face; v, v/vt, v//vn and v/vt/vn are, in whole numbers",
            ),
            (
                "f 1 2 3/1/1/1",
                "line 5: \"3/1/1/1\" is not a corner of a face; v, v/vt, v//vn and v/vt/vn are, in whole numbers",
            ),
            ("f 1 2 5", "line 5: there is no vertex 5; 4 are defined: numbers run from 1, or back from -1"),
            ("f 0 1 2", "line 5: there is no vertex 0; 4 are defined: numbers run from 1, or back from -1"),
            (
                "f -5 1 2\nv 1 1 1",
                "line 5: there is no vertex -5; 4 are defined: numbers run from 1, or back from -1",
            ),
        ] {
            assert_eq!(read(&format!("{SQUARE}{text}")).unwrap_err().to_string(), message);
        }
    }

    /// A mesh as faces with positions and names, however they are numbered.
    fn spelt(mesh: &Mesh) -> Vec<([u32; 3], &str, &str)> {
        let name = |face: &Face| (&*mesh.groups[face.group as usize], &*mesh.materials[face.material as usize]);
        mesh.faces.iter().map(|face| (face.corners, name(face).0, name(face).1)).collect()
    }

    #[test]
    fn what_is_written_reads_back_the_same() {
        for mesh in
            [observatory(), sphere(1e-6, 3), cuboid(glam::DVec3::splat(1e6)).scaled(1.0 / 3.0), Mesh::default()]
        {
            let text = write(&mesh, Some("a b.mtl"));
            let back = read(&text).unwrap();
            assert_eq!(back.mtllibs, ["a b.mtl"]);
            assert_eq!(back.mesh.vertices, mesh.vertices);
            assert_eq!(spelt(&back.mesh), spelt(&mesh));
            assert_eq!(read(&write(&back.mesh, None)).unwrap().mesh, back.mesh);
        }
    }

    #[test]
    fn names_that_obj_cannot_hold_become_ones_it_can() {
        let mut mesh = cuboid(glam::DVec3::ONE);
        mesh.groups = vec!["my #1\nbody\\".into()];
        mesh.materials.push(" white paint#2\r".into());
        mesh.faces.iter_mut().for_each(|face| face.material = 1);
        let back = read(&write(&mesh, None)).unwrap().mesh;
        assert_eq!(
            (back.groups, back.materials),
            (vec!["my__1_body_".into()], vec!["".into(), "white paint_2".to_owned()])
        );
    }

    proptest! {
        #[test]
        fn no_text_makes_the_reader_panic(text in ".*", lines in "((v|f|g|o|usemtl|mtllib|#)( ?[-0-9./\\\\a#]{0,6}){0,5}\n){0,12}") {
            let _ = read(&text);
            if let Ok(obj) = read(&lines) {
                let back = read(&write(&obj.mesh, None)).unwrap();
                prop_assert_eq!(back.mesh.vertices, obj.mesh.vertices);
                prop_assert_eq!(back.mesh.faces.len(), obj.mesh.faces.len());
            }
        }
    }
}
