//! Shapes by name: files in Wavefront OBJ or STL with the materials beside them, and the built-in ones.

use super::error::ReadError;
use super::mesh::Mesh;
use super::mtl::{self, Mtl};
use super::observatory::observatory;
use super::{obj, primitives, stl};
use glam::{DMat3, DVec3};
use std::path::{Path, PathBuf};

/// What cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// The file system refuses.
    #[error("cannot read {path}: {why}")]
    Io {
        /// The file.
        path: String,
        /// Why.
        why: std::io::Error,
    },
    /// The file holds something else.
    #[error("{path}: {why}")]
    Read {
        /// The file.
        path: String,
        /// Why.
        why: ReadError,
    },
}

/// What a file and those that it names hold.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Read {
    /// The surface \[m\].
    pub mesh: Mesh,
    /// Its materials.
    pub materials: Vec<Mtl>,
    /// Files named in it that are there.
    pub beside: Vec<PathBuf>,
    /// Those that are not.
    pub missing: Vec<String>,
}

/// Most bytes of a file that is read.
const MOST_BYTES: u64 = 1 << 31;

fn bytes(path: &Path) -> Result<Vec<u8>, FileError> {
    let io = |why| FileError::Io { path: path.display().to_string(), why };
    let meta = std::fs::metadata(path).map_err(io)?;
    if !meta.is_file() || meta.len() > MOST_BYTES {
        return Err(io(std::io::Error::other(format!("not a file of at most {MOST_BYTES} bytes"))));
    }
    std::fs::read(path).map_err(io)
}

/// Read an OBJ or STL file, told apart by their content where the name does not tell.
///
/// # Errors
/// [`FileError`] for files that cannot be read, with the line.
pub fn read(path: &Path) -> Result<Read, FileError> {
    let data = bytes(path)?;
    let told = |why| FileError::Read { path: path.display().to_string(), why };
    let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    // an OBJ is text with vertices; "solid" or a count of triangles begin an STL
    let looks_like_obj = || data.split(|b| *b == b'\n').take(1000).any(|line| line.starts_with(b"v "));
    if ending.as_deref() == Some("stl") || (ending.as_deref() != Some("obj") && !looks_like_obj()) {
        return Ok(Read { mesh: stl::read(&data).map_err(told)?, ..Read::default() });
    }
    let file = obj::read(&String::from_utf8_lossy(&data)).map_err(told)?;
    let mut all = Read { mesh: file.mesh, ..Read::default() };
    let folder = path.parent().unwrap_or(Path::new(""));
    for name in file.mtllibs {
        // copied beside each other, files lose their folders
        let own = Path::new(&name).file_name().map(Path::new).unwrap_or(Path::new(""));
        let Some(found) = [Path::new(&name), own].map(|p| folder.join(p)).into_iter().find(|p| p.is_file()) else {
            all.missing.push(name);
            continue;
        };
        let text = bytes(&found)?;
        let materials = mtl::read(&String::from_utf8_lossy(&text))
            .map_err(|why| FileError::Read { path: found.display().to_string(), why })?;
        all.materials.extend(materials);
        all.beside.push(found);
    }
    Ok(all)
}

/// Names of the built-in shapes.
pub const BUILT_IN: [&str; 10] =
    ["box", "sphere", "cylinder", "cone", "torus", "plate", "dish", "l-shape", "box-wing", "observatory"];

/// A built-in shape in its natural size: 1 m, or that of a satellite.
pub fn built_in(name: &str) -> Option<Mesh> {
    Some(match name {
        "box" => primitives::cuboid(DVec3::ONE),
        "sphere" => {
            // as large a surface as the round one's: seen from anywhere it has the same section in the mean
            let inscribed = primitives::sphere(0.5, 16);
            let factor = (std::f64::consts::PI / inscribed.area()).sqrt();
            inscribed.scaled(factor)
        }
        "cylinder" => primitives::cylinder(0.5, 1.0, 128),
        "cone" => primitives::cone(0.5, 0.0, 1.0, 128),
        "torus" => primitives::torus(0.35, 0.15, 96, 48),
        "plate" => primitives::plate(1.0, 1.0),
        "dish" => primitives::dish(1.0, 0.25, 96),
        "l-shape" => primitives::l_shape(),
        "box-wing" => primitives::box_wing(),
        "observatory" => observatory(),
        _ => return None,
    })
}

/// A built-in shape stretched to an extent along x, y and z \[m\], if one is given; a flat one stays flat.
pub fn built_in_sized(name: &str, extent: Option<DVec3>) -> Option<Mesh> {
    let mesh = built_in(name)?;
    let Some((extent, (low, high))) = extent.zip(mesh.bounds()) else { return Some(mesh) };
    // the corners of a sphere stand out of the round one
    let own = if name == "sphere" { DVec3::ONE } else { high - low };
    let factor = DVec3::from_array([0, 1, 2].map(|k| if own[k] > 0.0 { extent[k] / own[k] } else { 1.0 }));
    Some(mesh.transformed(&DMat3::from_diagonal(factor), DVec3::ZERO))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_built_in_shape_is_sound_and_takes_a_size() {
        for name in BUILT_IN {
            let mesh = built_in(name).expect(name);
            let faults = super::super::check::faults(&mesh);
            let bad = faults.iter().filter(|f| f.severity() > super::super::fault::Severity::Note);
            assert_eq!(bad.count(), 0, "{name}");
            let sized = built_in_sized(name, Some(DVec3::new(1.0, 2.0, 3.0))).expect(name);
            let (low, high) = sized.bounds().expect("an extent");
            let size = high - low;
            let flat = size.z == 0.0;
            // the corners of a sphere of the round one's area stand 0.06 % out of it
            let margin = if name == "sphere" { 3e-3 } else { 1e-12 };
            let wanted = DVec3::new(1.0, 2.0, if flat { 0.0 } else { 3.0 });
            assert!((size - wanted).length() < margin, "{name}: {size}");
        }
        assert!(built_in("teapot").is_none());
    }

    #[test]
    fn files_are_told_apart_and_name_what_is_missing() {
        let dir = tempfile::tempdir().expect("a folder");
        let path = dir.path().join("one.obj");
        let text = obj::write(&primitives::box_wing(), Some("one.mtl"));
        std::fs::write(&path, &text).expect("written");
        let read_back = read(&path).expect("an OBJ");
        assert_eq!((read_back.mesh.faces.len(), read_back.missing), (36, vec!["one.mtl".to_owned()]));
        std::fs::write(dir.path().join("one.mtl"), "newmtl mli\nbrdf mli\n").expect("written");
        let read_back = read(&path).expect("an OBJ");
        assert_eq!((read_back.materials.len(), read_back.beside.len()), (1, 1));
        // the same text under another name
        std::fs::write(dir.path().join("one.txt"), &text).expect("written");
        assert_eq!(read(&dir.path().join("one.txt")).expect("an OBJ").mesh.faces.len(), 36);
        assert!(read(dir.path()).expect_err("a folder").to_string().contains("not a file"));
        std::fs::write(dir.path().join("bad.stl"), "solid x\nfacet").expect("written");
        assert!(read(&dir.path().join("bad.stl")).is_err());
    }
}
