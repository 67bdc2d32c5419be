//! Light curves as CCSDS Tracking Data Messages: places and magnitudes of targets seen from a station.
//!
//! Version 2.0 of the message in keyword-value notation: CCSDS 503.0-B-2 (Blue Book, June 2020, with Corrigendum 1);
//! numbers in brackets below are its sections. [`to_tdm`] writes, [`parse_tdm`] reads and checks.
//!
//! - One segment a target and station, signal path from the target to the station: `MODE = SEQUENTIAL`, `PATH = 2,1`
//!   \[3.3.2.1\].
//! - Timetags are UTC at mid-exposure, to the microsecond, in order and each once \[3.4.10, 3.4.11\].
//! - `ANGLE_TYPE = RADEC` in degrees, `REFERENCE_FRAME = ICRF`: of the customary values (table 3-3) the one whose axes
//!   the star catalogues have. EME2000, the other usual one, differs from it by the frame bias of 23 mas.
//! - The places lie among catalogue stars, so they hold no aberration, annual or diurnal, and no refraction. A
//!   `CORRECTION_*` keyword holds one number for a whole segment, which aberration and refraction are not; what was
//!   taken out that way is to be told otherwise \[3.4.15.6\], so a comment of the segment tells it, as the standard's
//!   own example of optical data does (figure E-16).
//! - MAG is the visual magnitude outside the atmosphere \[3.5.5.1\].
//! - A number has at most 16 digits \[4.3.4\]: angles and magnitudes are rounded to 1e-12.
//! - `CREATION_DATE` is the time of the last observation unless given: a file depends on its data alone, not on a clock.

mod fault;
mod keywords;
mod read;
#[cfg(test)]
mod tests;
mod write;

pub use fault::TdmError;
pub use read::{Record, Segment, parse_tdm};
pub use write::{Header, Observation, Track, to_tdm};
