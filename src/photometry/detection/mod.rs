//! Sources in whole frames, and unknown moving objects through frames.
//!
//! During an exposure all stars draw the same trail, known from the tracking rates (a point when the stars are
//! tracked), and satellites another one or a point. [`sources`] finds both:
//!
//! 1. [`Mesh`]: the background and its scatter in cells, interpolated; once with everything in it, once more without
//!    the stars found.
//! 2. [`Kernel`]: the matched filter of each kind of trail, normalised to unit variance where only noise is
//!    (`filter`); its local maxima above a threshold set by the false detections allowed.
//! 3. The strongest maximum of all kinds is a source, and explains what all kernels answer to its light; the next one
//!    that is not explained is the next source, and so on (`resolve`).
//!
//! [`link()`] joins detections of many frames that are no stars into tracks.

mod background;
#[cfg(test)]
mod background_tests;
#[cfg(test)]
mod drawn;
mod filter;
#[cfg(test)]
mod filter_tests;
mod kernel;
#[cfg(test)]
mod kernel_tests;
mod link;
#[cfg(test)]
mod link_tests;
mod measure;
mod peak;
mod resolve;
mod search;
#[cfg(test)]
mod search_tests;
mod track;

pub use background::{Mask, Mesh, background};
pub use kernel::Kernel;
pub use link::{FrameDetections, LinkSettings, Linked, SkyDetection, link};
pub use search::{Noise, Settings, Source, Sources, detect, sources};
pub use track::{Member, Track};

/// What keeps frames from being searched.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum DetectionError {
    /// The pixels do not fill the frame.
    #[error("{pixels} pixels for a frame of {width} x {height}: width times height are needed")]
    Shape {
        /// Pixels given.
        pixels: usize,
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// A number beyond its range.
    #[error("{name} = {value}: must be from {least} to {most}")]
    Range {
        /// What it is.
        name: &'static str,
        /// Its value.
        value: f64,
        /// Least allowed.
        least: f64,
        /// Most allowed.
        most: f64,
    },
}

/// `value`, if it is a number from `least` to `most`.
fn within(name: &'static str, value: f64, least: f64, most: f64) -> Result<f64, DetectionError> {
    // NaN is in no range
    if (least..=most).contains(&value) {
        Ok(value)
    } else {
        Err(DetectionError::Range { name, value, least, most })
    }
}

/// The pixels of a frame, row by row from y = 0; a pixel that is not finite is missing.
#[derive(Debug, Clone, Copy)]
pub struct Plane<'a> {
    width: usize,
    height: usize,
    data: &'a [f32],
}

impl<'a> Plane<'a> {
    /// A frame of `width` columns and `height` rows.
    ///
    /// # Errors
    /// If `data` has not width times height pixels.
    pub fn new(width: usize, height: usize, data: &'a [f32]) -> Result<Self, DetectionError> {
        if width.checked_mul(height) == Some(data.len()) {
            Ok(Self { width, height, data })
        } else {
            Err(DetectionError::Shape { pixels: data.len(), width, height })
        }
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Row `y`; empty beyond the frame.
    fn row(&self, y: usize) -> &'a [f32] {
        let start = y.saturating_mul(self.width);
        self.data.get(start..start.saturating_add(self.width)).unwrap_or(&[])
    }

    /// The pixel at column `x` and row `y`; none beyond the frame.
    fn pixel(&self, x: i64, y: i64) -> Option<f32> {
        let (x, y) = (usize::try_from(x).ok()?, usize::try_from(y).ok()?);
        self.row(y).get(x).copied()
    }
}
