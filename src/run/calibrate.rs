//! Calibration frames of a station's camera: bias, dark, flat.

use super::RunError;
use crate::camera::chip::{Chip, Incident};
use crate::camera::expose::{self, Rows};
use crate::camera::region::Region;
use crate::io::{atomic, fits, labels};
use crate::scene::Scene;
use crate::simulate::whole;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Kind of a calibration frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// No light, no time.
    Bias,
    /// No light.
    Dark,
    /// The same light on every pixel.
    Flat,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Self; 3] = [Self::Bias, Self::Dark, Self::Flat];

    /// The stem of its files.
    pub fn stem(self) -> &'static str {
        match self {
            Self::Bias => "bias",
            Self::Dark => "dark",
            Self::Flat => "flat",
        }
    }

    /// What IMAGETYP says (SBIG and MaxIm DL convention).
    fn image_type(self) -> &'static str {
        match self {
            Self::Bias => "Bias Frame",
            Self::Dark => "Dark Frame",
            Self::Flat => "Flat Field",
        }
    }

    /// Number of a frame in the streams of random numbers, beyond those of a scene's frames.
    fn frame(self, number: usize) -> usize {
        (self as usize + 1) * (1 << 30) + number
    }
}

/// Which frames to make.
pub struct Job<'j> {
    /// Frames of each kind.
    pub count: usize,
    /// Exposure of the darks \[s\].
    pub dark_s: f64,
    /// Exposure of the flats \[s\].
    pub flat_s: f64,
    /// Level of the flats as a share of saturation.
    pub level: f64,
    /// Called when a frame is written.
    pub done: &'j dyn Fn(),
}

/// The same mean light \[e-\] on every pixel.
struct Even {
    mean_e: f64,
    width: usize,
}

impl Incident for Even {
    fn add(&self, _region: &Region, out: &mut [f64]) {
        out.iter_mut().for_each(|value| *value += self.mean_e);
    }

    fn bright_columns(&self, level_e: f64) -> Vec<Range<usize>> {
        let bright = self.mean_e > level_e;
        bright.then_some(0..self.width).into_iter().collect()
    }
}

/// Write the frames of `job` for the camera of `scene` into `dir`; the files written.
///
/// # Errors
/// Whatever the file system says; finished frames stay.
pub fn calibrate(scene: &Scene, dir: &Path, job: &Job) -> Result<Vec<PathBuf>, RunError> {
    atomic::create_dir(dir)?;
    let (region, d, sha) = (whole(scene), &scene.detector, scene.sha256());
    let kind = if d.bits > 16 { fits::Kind::U32 } else { fits::Kind::U16 };
    let full_e = labels::saturation_e(scene);
    let mut written = Vec::new();
    for what in Kind::ALL {
        let (exposure_s, mean_e) = match what {
            Kind::Bias => (0.0, 0.0),
            Kind::Dark => (job.dark_s, 0.0),
            Kind::Flat => (job.flat_s, job.level * full_e),
        };
        let light = Even { mean_e, width: d.light_px()[0] };
        for number in 0..job.count {
            let path = dir.join(format!("{}_{number:04}.fits", what.stem()));
            let header = labels::calibration(scene, &sha, what.image_type(), exposure_s, mean_e);
            let file = fits::Writer::create(&path, region.width, region.height, kind, &header)?;
            let chip = Chip::new(scene, &light, what.frame(number), exposure_s, &region);
            expose::expose(&chip, d.bits, &region, |first, rows| match rows {
                Rows::U16(rows) => file.rows(first, fits::Pixels::U16(rows)),
                Rows::U32(rows) => file.rows(first, fits::Pixels::U32(rows)),
            })?;
            file.finish()?;
            written.push(path);
            (job.done)();
        }
    }
    Ok(written)
}
