//! What is measured, and how.

use crate::photometry::header::Overrides;
use crate::photometry::reduce::Calibration;
use crate::photometry::{FieldStar, Frame, Geometry, Measurement, Place, Settings};
use crate::scene::Scene;
use crate::stars::catalogue::Catalogue;
use glam::DVec3;
use std::path::{Path, PathBuf};

/// A measurement, and the geometry that a scene knows.
pub type Row = (Measurement, Option<Geometry>);

/// What is called with a frame's path, the frame, the catalogue's stars in it, and what was measured.
pub type Seen<'s> = dyn Fn(&Path, &Frame, &[FieldStar], &[Row]) + Sync + 's;

/// What to measure.
pub struct Job<'j> {
    /// The frames.
    pub frames: &'j [PathBuf],
    /// Where the target is expected, if no scene tells.
    pub place: Place,
    /// The scene the frames belong to, if known.
    pub scene: Option<&'j Scene>,
    /// Catalogue of the zero point's stars.
    pub catalogue: &'j Catalogue,
    /// How to measure.
    pub settings: Settings,
    /// Whether the table tells what the errors are made of.
    pub errors: bool,
    /// What counts in place of the frames' headers.
    pub overrides: Overrides,
    /// What is measured in place of the scene's targets or the header's.
    pub objects: Vec<Object>,
    /// Masters to calibrate the frames with.
    pub masters: Option<Calibration>,
    /// Called with a remark on a frame, and whether it is a warning.
    pub told: &'j (dyn Fn(&Path, &str, bool) + Sync),
    /// Called with each frame, the catalogue's stars in it, and what was measured.
    pub seen: &'j Seen<'j>,
    /// Called when a frame is read.
    pub done: &'j (dyn Fn() + Sync),
}

impl<'j> Job<'j> {
    /// Measure what the headers of frames name, and tell nobody on the way.
    pub fn new(frames: &'j [PathBuf], catalogue: &'j Catalogue, settings: Settings) -> Self {
        Self {
            frames,
            place: Place::Header,
            scene: None,
            catalogue,
            settings,
            errors: false,
            overrides: Overrides::default(),
            objects: Vec::new(),
            masters: None,
            told: &|_, _, _| {},
            seen: &|_, _, _, _| {},
            done: &|| {},
        }
    }
}

/// An object found in frames, and where it is in each of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Object {
    /// Its name: object-1, ...
    pub name: String,
    /// Directions, astrometric ICRS, frame by frame; none off the frame.
    pub places: Vec<Option<DVec3>>,
    /// Frames that it was seen in.
    pub seen: usize,
}
