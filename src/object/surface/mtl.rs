//! Wavefront MTL: the statements a reflection law can be made of, and `brdf NAME`, our own, which other programs skip.

use super::error::ReadError;
use super::obj::Lines;
use super::text::{Statement, number, shown, statements, writable};

/// A material; what the file leaves out is none.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mtl {
    /// Its name (`newmtl`).
    pub name: String,
    /// Diffuse reflectance, red, green and blue (`Kd`).
    pub kd: Option<[f64; 3]>,
    /// Specular reflectance, red, green and blue (`Ks`).
    pub ks: Option<[f64; 3]>,
    /// Phong exponent (`Ns`).
    pub ns: Option<f64>,
    /// Roughness, 0 to 1 (`Pr`).
    pub roughness: Option<f64>,
    /// Number of the illumination model (`illum`).
    pub illum: Option<i64>,
    /// Name of a reflection law of ours (`brdf`).
    pub brdf: Option<String>,
}

/// Reads an MTL file. Unknown statements are skipped, and colours given as spectra or CIE XYZ too. Values are as written:
/// nothing is said of their range.
///
/// # Errors
/// [`ReadError`] with the line of what cannot be read.
pub fn read(text: &str) -> Result<Vec<Mtl>, ReadError> {
    let mut materials: Vec<Mtl> = Vec::new();
    for statement in &statements(text) {
        match statement.keyword() {
            "newmtl" if statement.rest().is_empty() => return Err(statement.count(0, "a name")),
            "newmtl" => materials.push(Mtl { name: statement.rest().to_owned(), ..Mtl::default() }),
            known @ ("Kd" | "Ks" | "Ns" | "Pr" | "illum" | "brdf") => {
                let misplaced =
                    || ReadError::Misplaced { line: statement.line, found: known.to_owned(), allowed: "newmtl" };
                set(materials.last_mut().ok_or_else(misplaced)?, statement)?;
            }
            _ => {}
        }
    }
    Ok(materials)
}

fn set(material: &mut Mtl, statement: &Statement) -> Result<(), ReadError> {
    match statement.keyword() {
        "Kd" => material.kd = colour(statement)?,
        "Ks" => material.ks = colour(statement)?,
        "Ns" => material.ns = Some(scalar(statement)?),
        "Pr" => material.roughness = Some(scalar(statement)?),
        "illum" => material.illum = Some(whole(statement)?),
        _ if statement.rest().is_empty() => return Err(statement.count(0, "a name")),
        _ => material.brdf = Some(statement.rest().to_owned()),
    }
    Ok(())
}

/// Red, green and blue; a single value is all three.
fn colour(statement: &Statement) -> Result<Option<[f64; 3]>, ReadError> {
    if matches!(statement.words().next(), Some("spectral" | "xyz")) {
        return Ok(None);
    }
    let allowed = "1 or 3 numbers";
    match statement.words().count() {
        1 => statement.numbers(allowed).map(|[grey]| Some([grey; 3])),
        _ => statement.numbers(allowed).map(Some),
    }
}

fn scalar(statement: &Statement) -> Result<f64, ReadError> {
    statement.numbers("a number").map(|[value]| value)
}

fn whole(statement: &Statement) -> Result<i64, ReadError> {
    let word = statement.words().next().ok_or_else(|| statement.count(0, "a whole number"))?;
    number(word, statement.line)?;
    word.parse().map_err(|_| ReadError::Whole { line: statement.line, token: shown(word) })
}

/// Writes materials as MTL, with the shortest numbers that read back the same.
pub fn write(materials: &[Mtl]) -> String {
    let mut lines = Lines::default();
    for material in materials {
        lines.add(format_args!("newmtl {}", writable(&material.name)));
        for (keyword, colour) in [("Kd", material.kd), ("Ks", material.ks)] {
            if let Some([red, green, blue]) = colour {
                lines.add(format_args!("{keyword} {red:?} {green:?} {blue:?}"));
            }
        }
        for (keyword, value) in [("Ns", material.ns), ("Pr", material.roughness)] {
            if let Some(value) = value {
                lines.add(format_args!("{keyword} {value:?}"));
            }
        }
        if let Some(model) = material.illum {
            lines.add(format_args!("illum {model}"));
        }
        if let Some(name) = &material.brdf {
            lines.add(format_args!("brdf {}", writable(name)));
        }
    }
    lines.0
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn materials_are_read() {
        let text = "# x\r\nnewmtl white paint\r\nKa 0 0 0\r\nKd .8 0.7 1e-1\r\nKs 0.5\r\nNs 96\r\nPr 0.2\r\nillum 2\r\nbrdf cook\r\nmap_Kd a.png\r\nnewmtl b\nKd spectral a.rfl\n";
        let white = Mtl {
            name: "white paint".into(),
            kd: Some([0.8, 0.7, 0.1]),
            ks: Some([0.5; 3]),
            ns: Some(96.0),
            roughness: Some(0.2),
            illum: Some(2),
            brdf: Some("cook".into()),
        };
        let materials = read(text).unwrap();
        assert_eq!(materials, [white, Mtl { name: "b".into(), ..Mtl::default() }]);
        assert_eq!(read(&write(&materials)), Ok(materials));
        assert_eq!(read(""), Ok(vec![]));
    }

    #[test]
    fn faults_tell_value_line_and_what_is_allowed() {
        for (text, message) in [
            ("Kd 1 2", "line 2: Kd has 2 values, it takes 1 or 3 numbers"),
            ("Kd", "line 2: Kd has 0 values, it takes 1 or 3 numbers"),
            ("Ks 1 2 nan", "line 2: \"nan\" is not a finite number"),
            ("Ns", "line 2: Ns has 0 values, it takes a number"),
            ("illum 2.5", "line 2: \"2.5\" is not a whole number"),
            ("illum x", "line 2: \"x\" is not a finite number"),
            ("brdf", "line 2: brdf has 0 values, it takes a name"),
            ("newmtl ", "line 2: newmtl has 0 values, it takes a name"),
        ] {
            assert_eq!(read(&format!("newmtl a\n{text}\n")).unwrap_err().to_string(), message);
        }
        assert_eq!(read("Kd 1").unwrap_err().to_string(), "line 1: \"Kd\" where newmtl should be");
    }

    proptest! {
        #[test]
        fn no_text_makes_the_reader_panic(text in ".*", lines in "((newmtl|Kd|Ks|Ns|Pr|illum|brdf)( [-0-9.a#\\\\]{0,5}){0,4}\n){0,9}") {
            let _ = read(&text);
            if let Ok(materials) = read(&format!("newmtl a\n{lines}")) {
                prop_assert!(read(&write(&materials)).is_ok());
            }
        }
    }
}
