//! Synthetic telescope frames of satellites, and the light curves in them.
//!
//! Data goes one way, down this list; a room uses only rooms above it:
//!
//! ```text
//! base        constants, units, tolerances, ledger, random numbers, tables
//! astro       time, Earth orientation, Sun, Moon, shadow, orbits, attitude, stars, the observer
//! object      meshes, materials, shadows: the light of a shape
//! scene       what the user writes: checked and complete
//! plan        places, pointing, world coordinates, windows, whether an exposure is worth taking
//! light       spectra to electrons
//! stars       catalogue
//! sky         airglow, pollution, twilight, starlight, moonlight, zodiacal light
//! camera      point images and trails, mean electrons, one Poisson draw, the detector's steps
//! io          FITS, ECSV, PNG
//! photometry  pixels and headers to a light curve
//! simulate    a scene's frames
//! run         a scene's output directory
//! study       what is in a frame and what it costs, error against run time, the chart of a night
//! cli         the command line
//! ```
//!
//! ```
//! use nightglass::scene::{Options, load};
//!
//! // one small frame of a geostationary satellite over the Purdue Optical Ground Station
//! let sets = [("detector.size_px", "128"), ("exposures.count", "1")].map(|(k, v)| (k.to_owned(), v.to_owned()));
//! let scene = load("pogs-geo", &Options { sets: &sets, seed: None })?;
//! for frame in nightglass::simulate(&scene)? {
//!     let frame = frame?;
//!     assert_eq!(frame.adu.len(), 128 * 128);
//!     assert!(frame.truth[0].snr > 100.0);
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![warn(missing_docs)]

pub mod astro;
pub mod base;
pub mod camera;
pub mod cli;
pub mod inversion;
pub mod io;
pub mod light;
pub mod object;
pub mod photometry;
pub mod plan;
pub mod run;
pub mod scene;
pub mod simulate;
pub mod sky;
pub mod stars;
pub mod study;

pub use simulate::simulate;

/// The README's example is compiled with the documentation's.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
