//! FITS images as read, of any origin: integers or floats, plain, gzipped or tile-compressed (crate `fitsy`).

use super::plain;
use fitsy::hdu::Hdu;
use fitsy::{FitsError, FitsFile, header::Value};
use std::path::{Path, PathBuf};

/// An image and its header.
#[derive(Debug, Clone)]
pub struct Image {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Physical values (BZERO and BSCALE applied), row by row from y = 0.
    pub data: Vec<f32>,
    /// The header.
    pub header: Keywords,
    /// Where it came from.
    pub path: PathBuf,
}

/// What can go wrong while reading.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The file is no readable FITS file.
    #[error("{path}: {source}")]
    Fits {
        /// The file.
        path: String,
        /// What is wrong with it.
        source: FitsError,
    },
    /// The file holds no image of two axes.
    #[error("{path}: no two-dimensional image in this file")]
    NoImage {
        /// The file.
        path: String,
    },
}

/// The keywords of a header.
#[derive(Debug, Clone)]
pub struct Keywords(fitsy::header::Header);

impl Keywords {
    /// A number, integer or floating; none if the keyword is missing or of another type.
    pub fn number(&self, keyword: &str) -> Option<f64> {
        match self.0.first(keyword)? {
            Value::Integer(i) => Some(i as f64),
            Value::Real(x) => Some(x),
            _ => None,
        }
    }

    /// A logical; none if the keyword is missing or of another type.
    pub fn flag(&self, keyword: &str) -> Option<bool> {
        match self.0.first(keyword)? {
            Value::Logical(b) => Some(b),
            _ => None,
        }
    }

    /// A string without trailing blanks; none if the keyword is missing or of another type.
    pub fn text(&self, keyword: &str) -> Option<String> {
        match self.0.first(keyword)? {
            Value::String(s) => Some(s.trim_end().to_owned()),
            _ => None,
        }
    }
}

/// The keywords of a file's first image, plain or tile-compressed, without touching its pixels.
///
/// # Errors
/// [`ReadError`], with the path.
pub fn keywords(path: &Path) -> Result<Keywords, ReadError> {
    let told = |source| ReadError::Fits { path: path.display().to_string(), source };
    let file = FitsFile::open(path).map_err(told)?;
    let first = Keywords(file.parsed_header(0).map_err(told)?);
    // a compressed image is in the first extension
    match file.parsed_header(1) {
        Ok(second) if first.number("NAXIS") == Some(0.0) => Ok(Keywords(second)),
        _ => Ok(first),
    }
}

impl Image {
    /// Read the first two-dimensional image of a FITS file.
    ///
    /// # Errors
    /// [`ReadError`], with the path.
    pub fn read(path: &Path) -> Result<Self, ReadError> {
        let told = |source| ReadError::Fits { path: path.display().to_string(), source };
        if let Some(plain::Plain { header, width, height, data }) = plain::read(path) {
            return Ok(Self { width, height, data, header: Keywords(header), path: path.to_owned() });
        }
        let file = FitsFile::open(path).map_err(told)?;
        for hdu in file.iter_decompressed() {
            let Hdu::Image(image) = hdu.map_err(told)? else { continue };
            let &[width, height] = image.axes() else { continue };
            let data = image.read_physical_f32().map_err(told)?.into_vec();
            return Ok(Self {
                width: width as usize,
                height: height as usize,
                data,
                header: Keywords(image.header().clone()),
                path: path.to_owned(),
            });
        }
        Err(ReadError::NoImage { path: path.display().to_string() })
    }
}
