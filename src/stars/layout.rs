//! Numbers of the catalogue's layout, and where its columns begin.

/// First bytes of the file.
pub const MAGIC: &[u8; 8] = b"NGSTARS1";
/// Size of the head \[bytes\].
pub const HEAD: usize = 64;
/// Where the head has the name, and its longest length \[bytes\].
pub const NAME_AT: usize = 32;
/// Longest name \[bytes\].
pub const NAME_BYTES: usize = 24;
/// Where the head counts the entries of the list of motions.
pub const LISTED_AT: usize = 56;
/// Bit of the columns: colour B-V.
pub const HAS_COLOUR: u32 = 1;
/// Bit of the columns: proper motion of every star.
pub const HAS_MOTION: u32 = 2;
/// Bit of the columns: a list of the proper motions of some stars.
pub const HAS_LISTED_MOTION: u32 = 4;
/// Colour of a star whose colour is not known.
pub const NO_COLOUR: i16 = i16::MIN;
/// Proper motion of a star whose motion is not known.
pub const NO_MOTION: i32 = i32::MIN;
/// Units of right ascension in one turn.
pub const RA_UNITS: f64 = 4_294_967_296.0;
/// Units of declination in half a turn.
pub const DEC_UNITS: f64 = 4_294_967_296.0;
/// Units of proper motion in 1 mas/yr.
pub const MOTION_UNITS: f64 = 100.0;
/// Size of an entry of the list of motions \[bytes\].
pub const LISTED_ENTRY: usize = 12;

/// Where each column begins in the file.
#[derive(Debug, Clone, Copy)]
pub struct Columns {
    /// Number of bands.
    pub bands: usize,
    /// Number of cells.
    pub cells: usize,
    /// Number of stars.
    pub stars: usize,
    /// First cell of each band.
    pub band_first: usize,
    /// First star of each cell.
    pub cell_first: usize,
    /// Completeness of each cell.
    pub complete: usize,
    /// Right ascensions.
    pub ra: usize,
    /// Declinations.
    pub dec: usize,
    /// V magnitudes.
    pub mag: usize,
    /// Colours.
    pub colour: Option<usize>,
    /// Proper motions, one a star.
    pub motion: Option<usize>,
    /// The list of proper motions, and the number of its entries.
    pub listed: Option<(usize, usize)>,
    /// End of the file.
    pub end: usize,
}

impl Columns {
    /// The columns that the head's numbers announce.
    pub fn new([bands, cells, stars, listed]: [usize; 4], bits: u32) -> Self {
        let band_first = HEAD;
        let cell_first = band_first + 4 * (bands + 1);
        let complete = cell_first + 4 * (cells + 1);
        let ra = complete + 2 * cells;
        let dec = ra + 4 * stars;
        let mag = dec + 4 * stars;
        let mut end = mag + 2 * stars;
        let mut optional = |bit: u32, size: usize| {
            (bits & bit != 0).then(|| {
                let at = end;
                end += size;
                at
            })
        };
        let colour = optional(HAS_COLOUR, 2 * stars);
        let motion = optional(HAS_MOTION, 8 * stars);
        let listed = optional(HAS_LISTED_MOTION, LISTED_ENTRY * listed).map(|at| (at, listed));
        Self { bands, cells, stars, band_first, cell_first, complete, ra, dec, mag, colour, motion, listed, end }
    }
}

/// The u32 that begins at byte `at`.
pub fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}

/// The i16 that begins at byte `at`.
pub fn i16_at(bytes: &[u8], at: usize) -> i16 {
    i16::from_le_bytes([bytes[at], bytes[at + 1]])
}
