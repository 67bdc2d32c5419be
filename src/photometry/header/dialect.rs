//! What the programs that write frames mean by the same keywords, as tables.
//!
//! SBFITSEXT 1.0 (SBIG) and "FITS File Header Definitions" (MaxIm DL's manual) define EGAIN, PEDESTAL,
//! XPIXSZ, APTDIA and the like; FITS Standard 4.0 the times and world coordinates. Capture programs of CMOS
//! cameras write the driver's setting of the amplifier, a number without unit, as GAIN, and electrons per adu, if
//! known, as EGAIN. Most write the row at the top of the picture first, so that a sky seen the right way round is
//! mirrored in FITS's own axes, where y goes up.

/// A program that writes frames.
#[derive(Debug, PartialEq)]
pub struct Program {
    /// Its name.
    pub name: &'static str,
    /// What in SWCREATE and the like tells it, in lower case.
    marks: &'static [&'static str],
    /// GAIN is the driver's setting, not e/adu.
    pub gain_is_setting: bool,
    /// The first stored row is the top of the picture, unless ROWORDER says otherwise.
    pub top_down: bool,
    /// A number as RA is in hours.
    pub ra_in_hours: bool,
}

const fn program(name: &'static str, marks: &'static [&'static str], gain_is_setting: bool) -> Program {
    Program { name, marks, gain_is_setting, top_down: true, ra_in_hours: false }
}

/// The programs that are known by name; of the marks, the first found counts.
#[rustfmt::skip]
static PROGRAMS: &[Program] = &[
    Program { top_down: false, ..program("nightglass", &["nightglass"], false) },
    program("MaxIm DL", &["maxim dl"], true),
    program("TheSkyX", &["thesky", "ccdsoft", "ccdops"], false),
    program("N.I.N.A.", &["n.i.n.a"], true),
    program("SharpCap", &["sharpcap"], true),
    program("FireCapture", &["firecapture"], true),
    program("APT", &["astro photography tool"], true),
    program("Sequence Generator Pro", &["sequence generator pro"], true),
    program("Voyager", &["voyager"], true),
    program("KStars", &["kstars", "ekos", "indigo"], true),
    Program { ra_in_hours: true, ..program("DWARFLAB", &["dwarf"], true) },
    program("ZWO", &["asiair", "asistudio", "asicap", "seestar", "zwo"], true),
    Program { top_down: false, ..program("PRISM", &["prism"], false) },
];

/// Where programs leave their name.
pub(super) const SIGNATURES: [&str; 6] = ["SWCREATE", "CREATOR", "SOFTWARE", "PROGRAM", "ORIGIN", "SWMODIFY"];

/// Makers of cameras, as in INSTRUME in lower case, whose drivers have a setting of the amplifier in whole
/// numbers.
const SETTING_CAMERAS: [&str; 8] =
    ["zwo", "qhy", "player one", "toupcam", "touptek", "altair", "svbony", "seestar"];

/// The program that a signature tells.
pub(super) fn program_of(signature: &str) -> Option<&'static Program> {
    let signature = signature.to_ascii_lowercase();
    PROGRAMS.iter().find(|p| p.marks.iter().any(|mark| signature.contains(mark)))
}

/// True if cameras of that name have their amplifier's setting in whole numbers as GAIN.
pub(super) fn has_gain_setting(instrument: &str) -> bool {
    let instrument = instrument.to_ascii_lowercase();
    SETTING_CAMERAS.iter().any(|maker| instrument.contains(maker))
}

/// Exposure time \[s\], in order of preference.
pub(super) const EXPOSURE: [&str; 5] = ["EXPTIME", "XPOSURE", "EXPOSURE", "EXPOSED", "EXP"];
/// Gain \[e/adu\] without doubt about the unit.
pub(super) const ELECTRONS_PER_ADU: [&str; 3] = ["EGAIN", "CVF", "CCDGAIN"];
/// Read noise \[e\].
pub(super) const READ_NOISE: [&str; 5] = ["RDNOISE", "READNOIS", "RON", "ENOISE", "CCDNOISE"];
/// Level from which a pixel is saturated \[adu\].
pub(super) const SATURATION: [&str; 4] = ["SATURATE", "SATLEVEL", "SATURATI", "MAXLIN"];
/// Full width at half maximum of a point's image \[arcsec\].
pub(super) const SEEING: [&str; 3] = ["SEEING", "L1FWHM", "AOCFWHM"];
/// Temperature of the chip \[deg C\].
pub(super) const TEMPERATURE: [&str; 4] = ["CCD-TEMP", "CCDTEMP", "DET-TEMP", "TEMPERAT"];
/// Number of exposures combined into the frame.
pub(super) const COMBINED: [&str; 4] = ["SNAPSHOT", "STACKCNT", "NCOMBINE", "NFRAMES"];
/// Side of a stored pixel on the sky \[arcsec\].
pub(super) const PIXEL_SCALE: [&str; 5] = ["PIXSCALE", "SECPIX", "SECPIX1", "SCALE", "CCDSCALE"];
/// Position angle of the picture's upward direction, from north through east \[deg\].
pub(super) const ROTATION: [&str; 5] = ["ROTATANG", "POSANGLE", "ANGLE", "PA", "OBJCTROT"];
/// Right ascension and declination of the pointing, in order of preference.
pub(super) const POINTING: [[&str; 2]; 3] = [["RA", "DEC"], ["OBJCTRA", "OBJCTDEC"], ["CRVAL1", "CRVAL2"]];
/// Latitude (north) and longitude (east) of the site \[deg\].
pub(super) const SITE: [[&str; 2]; 6] = [
    ["SITELAT", "SITELONG"],
    ["LAT-OBS", "LONG-OBS"],
    ["OBSGEO-B", "OBSGEO-L"],
    ["OBSLAT", "OBSLONG"],
    ["LATITUDE", "LONGITUD"],
    ["OBS-LAT", "OBS-LONG"],
];
/// Height of the site \[m\].
pub(super) const HEIGHT: [&str; 8] =
    ["SITEELEV", "ALT-OBS", "OBSGEO-H", "HEIGHT", "OBSALT", "OBSELEV", "OBS-ELEV", "SITEALT"];
/// Time of day where DATE-OBS has only a day.
pub(super) const TIME_OF_DAY: [&str; 8] =
    ["TIME-OBS", "UT", "UTC-OBS", "UT-OBS", "UTSTART", "UTC", "UTCSTART", "TIME-BEG"];
