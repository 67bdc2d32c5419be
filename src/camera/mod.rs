//! The camera: light falls on pixels, is counted, and becomes numbers.
//!
//! ```text
//! mean electrons = sky + stars and targets through the PSF along their paths, and what the chip adds   (f64, row bands)
//! counted        = one Poisson draw of the summed mean
//! adu            = what the chip makes of the charge, step by step ([`chip`])
//! ```
//!
//! Any region of a frame can be computed by itself and gives the pixels of the whole: random numbers are
//! functions of (seed, frame, stage, pixel of the whole frame).

pub mod chip;
pub mod detector;
pub mod evenness;
pub mod expose;
pub mod field_stars;
pub mod optics;
pub mod path;
pub mod pixel_response;
pub mod planes;
pub mod point_source;
pub mod profile;
pub mod psf;
pub mod psf_image;
pub mod radial;
pub mod region;
pub mod scenery;
pub mod scintillation;
pub mod star_limit;
pub mod trails;
pub mod truth;
