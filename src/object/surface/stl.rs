//! STL, binary and text: triangles without materials. Their unit of length is taken as metres.

use std::collections::HashMap;

use glam::{DVec3, Vec3};

use super::error::ReadError;
use super::mesh::{Face, MOST_NAMES, Mesh, Names, number};
use super::text::shown;

/// Bytes before the first facet of a binary file: a free text of 80, and the number of facets.
const HEAD: usize = 84;
/// Bytes of a facet: a normal, three corners, two bytes of attributes.
const FACET: usize = 50;
/// Bytes before the corners of a facet: its normal, which the corners tell as well.
const NORMAL: usize = 12;

/// Reads an STL file. Corners at the same place become one vertex. In a text file, each solid is a group.
///
/// # Errors
/// [`ReadError`] with the line or the facet of what cannot be read, or with the length a binary file should have.
pub fn read(bytes: &[u8]) -> Result<Mesh, ReadError> {
    let facets = bytes.get(HEAD - 4..HEAD).and_then(|count| count.try_into().ok()).map(u32::from_le_bytes);
    let expected = facets.map(|facets| HEAD as u64 + FACET as u64 * u64::from(facets));
    let found = bytes.len() as u64;
    // the length decides: the free text of a binary file may begin with "solid" too
    match (facets, expected) {
        (_, Some(expected)) if expected == found => binary(bytes),
        _ if is_text(bytes) => text(&String::from_utf8_lossy(bytes)),
        (Some(facets), Some(expected)) => Err(ReadError::Length { facets, expected, found }),
        _ => Err(ReadError::NoStl { found: bytes.len() }),
    }
}

fn is_text(bytes: &[u8]) -> bool {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    let begins = bytes.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    // a binary file always has zeros: in the count, and in the attributes of each facet
    begins && !bytes.contains(&0)
}

fn binary(bytes: &[u8]) -> Result<Mesh, ReadError> {
    let mut builder = Builder::default();
    let facets = bytes.get(HEAD..).unwrap_or_default().chunks_exact(FACET);
    for (facet, record) in facets.enumerate() {
        let mut values = [0.0_f32; 9];
        let words = record.get(NORMAL..).unwrap_or_default().chunks_exact(4);
        for (place, (value, word)) in values.iter_mut().zip(words).enumerate() {
            *value = f32::from_le_bytes(word.try_into().unwrap_or_default());
            if !value.is_finite() {
                let byte = HEAD + FACET * facet + NORMAL + 4 * place;
                return Err(ReadError::Coordinate { facet, byte, value: value.to_string() });
            }
        }
        let [a, b, c, d, e, f, g, h, i] = values;
        builder.facet([[a, b, c], [d, e, f], [g, h, i]], 0);
    }
    Ok(builder.mesh(if bytes.len() > HEAD { vec![String::new()] } else { vec![] }))
}

fn text(text: &str) -> Result<Mesh, ReadError> {
    let mut builder = Builder::default();
    let mut groups = Names::default();
    let mut solid: Option<String> = None;
    let mut corners: Vec<[f32; 3]> = Vec::new();
    let mut last = 0;
    for (line, raw) in (1..).zip(text.trim_start_matches('\u{feff}').lines()) {
        let raw = raw.trim();
        let (keyword, rest) = raw.split_once(char::is_whitespace).unwrap_or((raw, ""));
        let misplaced = |allowed| ReadError::Misplaced { line, found: shown(raw), allowed };
        last = line;
        match (keyword.to_ascii_lowercase().as_str(), &solid) {
            ("", _) => {}
            ("solid", None) => solid = Some(rest.trim().to_owned()),
            (_, None) => return Err(misplaced("solid")),
            ("endsolid", Some(_)) => solid = None,
            ("facet" | "outer", Some(_)) => corners.clear(),
            ("vertex", Some(_)) => corners.push(vertex(rest, line)?),
            ("endloop", Some(name)) => {
                let found = corners.len();
                let count =
                    |_| ReadError::Count { line, statement: "a facet".into(), found, allowed: "3 vertices" };
                let corners: [[f32; 3]; 3] = std::mem::take(&mut corners).try_into().map_err(count)?;
                let full = || ReadError::Full { line, name: shown(name), what: "groups", limit: MOST_NAMES };
                builder.facet(corners, groups.number(name).ok_or_else(full)?);
            }
            ("endfacet", Some(_)) => {}
            _ => return Err(misplaced("facet, outer loop, vertex, endloop, endfacet or endsolid")),
        }
    }
    match solid {
        None => Ok(builder.mesh(groups.list)),
        Some(_) => {
            Err(ReadError::Misplaced { line: last + 1, found: "end of the file".into(), allowed: "endsolid" })
        }
    }
}

fn vertex(rest: &str, line: usize) -> Result<[f32; 3], ReadError> {
    let number = |word: &str| {
        let value = word.parse().ok().filter(|value: &f32| value.is_finite());
        value.ok_or_else(|| ReadError::Number { line, token: shown(word) })
    };
    let values = rest.split_whitespace().map(number).collect::<Result<Vec<f32>, _>>()?;
    let count = |values: Vec<f32>| ReadError::Count {
        line,
        statement: "vertex".into(),
        found: values.len(),
        allowed: "x y z",
    };
    values.try_into().map_err(count)
}

/// Triangles whose corners become one vertex where they are at the same place.
#[derive(Default)]
struct Builder {
    vertices: Vec<DVec3>,
    faces: Vec<Face>,
    numbers: HashMap<[u32; 3], u32>,
}

impl Builder {
    fn facet(&mut self, corners: [[f32; 3]; 3], group: u16) {
        let corners = corners.map(|corner| {
            // adding 0 makes -0 the same place as 0
            let position = Vec3::from_array(corner) + Vec3::ZERO;
            *self.numbers.entry(position.to_array().map(f32::to_bits)).or_insert_with(|| {
                self.vertices.push(position.as_dvec3());
                number(self.vertices.len() - 1)
            })
        });
        self.faces.push(Face { corners, group, material: 0 });
    }

    fn mesh(self, groups: Vec<String>) -> Mesh {
        Mesh { vertices: self.vertices, faces: self.faces, groups, materials: vec![String::new()] }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::check::faults;
    use super::super::primitives::cuboid;
    use super::*;

    fn binary_file(mesh: &Mesh, head: &str) -> Vec<u8> {
        let mut bytes = format!("{head:80.80}").into_bytes();
        bytes.extend((mesh.faces.len() as u32).to_le_bytes());
        for triangle in mesh.triangles() {
            bytes.extend([0; 12]);
            let values = triangle.iter().flat_map(|corner| corner.as_vec3().to_array());
            bytes.extend(values.flat_map(f32::to_le_bytes));
            bytes.extend([0; 2]);
        }
        bytes
    }

    fn text_file(mesh: &Mesh, name: &str) -> String {
        let vertex = |p: DVec3| format!("   vertex {} {:e} {}\r\n", p.x, p.y, p.z);
        let facet = |t: [DVec3; 3]| {
            format!("  facet normal nan 0 0\n  outer loop\n{}  endloop\n  endfacet\n", t.map(vertex).concat())
        };
        format!("solid {name}\n{}endsolid {name}\n", mesh.triangles().map(facet).collect::<String>())
    }

    #[test]
    fn both_kinds_give_the_welded_box() {
        for size in [1e-6, 1.0, 1e6] {
            let mesh = cuboid(DVec3::new(1.0, 2.0, 0.5) * size);
            for read in [read(&binary_file(&mesh, "solid but binary")), read(text_file(&mesh, "a b").as_bytes())] {
                let read = read.unwrap();
                assert_eq!((read.vertices.len(), read.faces.len()), (8, 12));
                assert!((read.signed_volume() / mesh.signed_volume() - 1.0).abs() < 1e-6);
                assert!(size != 1.0 || faults(&read).is_empty());
            }
        }
    }

    #[test]
    fn each_solid_is_a_group() {
        let mesh = cuboid(DVec3::ONE);
        let both = [text_file(&mesh, "bus"), text_file(&mesh.scaled(0.5), "panel 2")].concat();
        let read = read(both.as_bytes()).unwrap();
        assert_eq!(
            (read.groups.join("|"), read.faces[0].group, read.faces[12].group),
            ("bus|panel 2".into(), 0, 1)
        );
    }

    #[test]
    fn minus_zero_is_zero() {
        let text =
            "solid\nfacet\nouter loop\nvertex 0 0 0\nvertex -0 0 0\nvertex 1 0 0\nendloop\nendfacet\nendsolid";
        assert_eq!(read(text.as_bytes()).unwrap().vertices.len(), 2);
    }

    #[test]
    fn faults_tell_lengths_facets_and_lines() {
        let mesh = cuboid(DVec3::ONE);
        let fault = |bytes: &[u8]| read(bytes).unwrap_err().to_string();
        for head in ["solid", "x"] {
            let bytes = binary_file(&mesh, head);
            let message = "a binary STL file of 12 facets has 684 bytes, this one has";
            assert_eq!(fault(&bytes[..600]), format!("{message} 600"));
            assert_eq!(fault(&[&bytes[..], b"x"].concat()), format!("{message} 685"));
        }
        let mut bytes = binary_file(&mesh, "x");
        bytes[84 + 50 + 12 + 4..][..4].copy_from_slice(&f32::INFINITY.to_le_bytes());
        assert_eq!(fault(&bytes), "facet 1 (from 0), byte 150: a coordinate is inf, it must be finite");
        assert_eq!(
            fault(b"abc"),
            "3 bytes are no STL file: a text one begins with \"solid\", a binary one has at least 84 bytes"
        );
        for (text, message) in [
            ("vertex 0 0", "line 2: vertex has 2 values, it takes x y z"),
            ("vertex 0 0 1e39", "line 2: \"1e39\" is not a finite number"),
            ("facet\nvertex 0 0 0\nendloop", "line 4: a facet has 1 values, it takes 3 vertices"),
            ("facet", "line 3: \"end of the file\" where endsolid should be"),
            ("endsolid\nfacet", "line 3: \"facet\" where solid should be"),
            (
                "what 1",
                "line 2: \"what 1\" where facet, outer loop, vertex, endloop, endfacet or endsolid should be",
            ),
        ] {
            assert_eq!(fault(format!("solid a\n{text}").as_bytes()), message);
        }
    }

    #[test]
    fn no_facets_are_no_fault() {
        assert_eq!(read(&binary_file(&Mesh::default(), "")).unwrap().faces, []);
        assert_eq!(read(b"solid a\nendsolid a\n").unwrap().faces, []);
    }

    proptest! {
        #[test]
        fn no_bytes_make_the_reader_panic(bytes in prop::collection::vec(any::<u8>(), 0..300), lines in "((solid|endsolid|facet|vertex|outer|endloop)( [-0-9.e]{0,4}){0,4}\n){0,12}") {
            let _ = read(&bytes);
            let _ = read(format!("solid\n{lines}endsolid").as_bytes());
            let count = bytes.len() / 50;
            let mut exact = vec![0; 80];
            exact.extend((count as u32).to_le_bytes());
            exact.extend(&bytes[..count * 50]);
            let _ = read(&exact);
        }
    }
}
