//! A scene's output directory: what is written where, what is kept, what is refused.

pub mod calibrate;
pub mod campaign;
pub mod curve_files;
pub mod find;
pub mod frames;
pub mod invert;
pub mod job;
pub mod lightcurve;
pub mod masters;
pub mod model_curve;
pub mod periods;
pub mod pointing;
pub mod shape_data;
pub mod shape_fault;
pub mod shape_found;
pub mod shape_law;
pub mod shape_light;
pub mod shape_methods;
pub mod shape_outcome;
pub mod shape_pole;
pub mod shape_tumble;
mod shape_words;
pub mod station_file;
pub mod tables;

use crate::io::atomic;
use crate::io::image::ReadError;
use crate::photometry::PhotometryError;
use crate::scene::{self, Options, Scene};
use crate::simulate::SimulateError;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// What can go wrong while writing a scene's output.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The directory holds something else.
    #[error("{dir} holds {what}; choose another directory with -o, or replace it with --force")]
    Occupied {
        /// The directory.
        dir: String,
        /// What it holds.
        what: String,
    },
    /// A value on the command line does not fit the scene.
    #[error("{0}")]
    Usage(String),
    /// The file system refuses.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// The simulation fails.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// A frame cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The measurement fails.
    #[error(transparent)]
    Photometry(#[from] PhotometryError),
}

/// What is written of a shape.
const SHAPE_FILES: [&str; 6] = ["shape.obj", "shape.mtl", "shape.svg", "shape.json", "fit.svg", "image.svg"];

/// A scene's output directory, made ready.
#[derive(Debug, Clone)]
pub struct OutputDir {
    path: PathBuf,
    /// What ends the name of a frame.
    extension: &'static str,
}

impl OutputDir {
    /// Make `path` ready for `scene`: create it, or take up an earlier run of the same scene (same SCENESHA) whose
    /// finished frames are kept. Anything else is refused unless `force`, which removes what an earlier run wrote
    /// here; in a directory that no run wrote to it removes nothing and replaces only files of the same name.
    ///
    /// # Errors
    /// [`RunError::Occupied`], or whatever the file system says.
    pub fn prepare(path: &Path, scene: &Scene, force: bool) -> Result<Self, RunError> {
        let plain = scene.output.format.iter().any(|format| format == "fits");
        let dir = Self { path: path.to_owned(), extension: if plain { "fits" } else { "fits.fz" } };
        if path.is_file() {
            return Err(RunError::Usage(format!("{} is a file, no directory", path.display())));
        }
        // read before anything is removed: a scene may be run anew from its own output
        let inputs =
            scene.inputs().iter().map(|i| Ok((&i.name, fs::read(&i.path)?))).collect::<io::Result<Vec<_>>>()?;
        let empty = fs::read_dir(path).map_or(true, |mut entries| entries.next().is_none());
        if !empty {
            let same = dir.scene_sha().is_some_and(|sha| sha == scene.sha256());
            if !same && !force {
                let what = if dir.scene_file().exists() { "the output of another scene" } else { "other files" };
                return Err(RunError::Occupied { dir: path.display().to_string(), what: what.into() });
            }
            if force && dir.scene_file().exists() {
                dir.clear()?;
            }
        }
        atomic::create_dir(&dir.frames())?;
        for (name, bytes) in inputs {
            atomic::create_dir(&dir.file("inputs"))?;
            atomic::write(&dir.file("inputs").join(name), &bytes)?;
        }
        atomic::write(&dir.scene_file(), scene.to_toml().as_bytes())?;
        Ok(dir)
    }

    /// SCENESHA of the scene that lies here, if one does.
    fn scene_sha(&self) -> Option<String> {
        let text = fs::read_to_string(self.scene_file()).ok()?;
        let scene = scene::load_str(&text, "scene.toml", Some(&self.path), &Options::default()).ok()?;
        Some(scene.sha256())
    }

    /// Remove everything a run writes.
    fn clear(&self) -> io::Result<()> {
        for name in [
            "scene.toml",
            "plan.ecsv",
            "truth.ecsv",
            "ledger.json",
            "lightcurve.ecsv",
            "lightcurve.tdm",
            "lightcurve.svg",
            "report.html",
        ] {
            remove_if_there(fs::remove_file(self.path.join(name)))?;
        }
        for name in ["frames", "planes", "stars", "previews", "regions", "inputs"] {
            remove_if_there(fs::remove_dir_all(self.path.join(name)))?;
        }
        self.clear_shapes()
    }

    /// Remove the shapes of an earlier run, which fewer or other frames may not tell again; of the folders in `shapes/` only what a
    /// run writes there.
    ///
    /// # Errors
    /// Whatever the file system says.
    pub fn clear_shapes(&self) -> io::Result<()> {
        let shapes = self.path.join("shapes");
        let folders = fs::read_dir(&shapes).into_iter().flatten().flatten().map(|entry| entry.path());
        let folders = folders.filter(|path| path.is_dir()).collect::<Vec<_>>();
        for folder in [&self.path].into_iter().chain(&folders) {
            for name in SHAPE_FILES {
                remove_if_there(fs::remove_file(folder.join(name)))?;
            }
        }
        // those that hold something else stay
        for folder in folders.iter().chain([&shapes]) {
            let _ = fs::remove_dir(folder);
        }
        Ok(())
    }

    /// The directory itself.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// A file in the directory.
    pub fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    fn scene_file(&self) -> PathBuf {
        self.file("scene.toml")
    }

    fn frames(&self) -> PathBuf {
        self.file("frames")
    }

    /// The file of one frame.
    pub fn frame(&self, number: usize) -> PathBuf {
        self.frames().join(format!("{number:04}.{}", self.extension))
    }

    /// The file of one plane, preview or star table.
    fn numbered(&self, folder: &str, stem: &str, number: usize, extension: &str) -> io::Result<PathBuf> {
        let folder = self.file(folder);
        atomic::create_dir(&folder)?;
        Ok(folder.join(format!("{stem}{number:04}.{extension}")))
    }
}

fn remove_if_there(result: io::Result<()>) -> io::Result<()> {
    match result {
        Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(()),
        other => other,
    }
}
