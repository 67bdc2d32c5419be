//! Numbers of the catalogue's layout.

/// First bytes of the file.
pub const MAGIC: &[u8; 8] = b"NGSTARS1";
/// Size of the head \[bytes\].
pub const HEAD: usize = 64;
/// Bit of the columns: colour B-V.
pub const HAS_COLOUR: u32 = 1;
/// Bit of the columns: proper motion.
pub const HAS_MOTION: u32 = 2;
/// Units of right ascension in one turn.
pub const RA_UNITS: f64 = 4_294_967_296.0;
/// Units of declination in half a turn.
pub const DEC_UNITS: f64 = 4_294_967_296.0;
