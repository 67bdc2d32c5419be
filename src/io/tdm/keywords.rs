//! Keywords of CCSDS Tracking Data Messages, their order and the form of their values: tables 3-2, 3-3 and 3-5 of
//! CCSDS 503.0-B-2.
//!
//! A name that ends in `_n` has an index from 1 to 5.

/// Keywords of the header in their order, table 3-2.
pub(super) const HEADER: [&str; 4] = ["CCSDS_TDM_VERS", "CREATION_DATE", "ORIGINATOR", "MESSAGE_ID"];

/// Form of a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Form {
    /// Any text.
    Text,
    /// A date.
    Epoch,
    /// One of these words, in capitals or not.
    Word(&'static [&'static str]),
    /// Indices of participants with commas between, no blanks.
    Path,
    /// Names of data types with commas between.
    Types,
    /// An integer of four bytes.
    Integer,
    /// Any real number.
    Real,
    /// A positive number.
    Positive,
    /// A number of at least zero.
    NotNegative,
}

use Form::*;

/// Keywords of a metadata section in their order, table 3-3.
pub(super) const METADATA: [(&str, Form); 43] = [
    ("TRACK_ID", Text),
    ("DATA_TYPES", Types),
    ("TIME_SYSTEM", Word(&["UTC"])),
    ("START_TIME", Epoch),
    ("STOP_TIME", Epoch),
    ("PARTICIPANT_n", Text),
    ("MODE", Word(&["SEQUENTIAL", "SINGLE_DIFF"])),
    ("PATH", Path),
    ("PATH_1", Path),
    ("PATH_2", Path),
    ("EPHEMERIS_NAME_n", Text),
    ("TRANSMIT_BAND", Text),
    ("RECEIVE_BAND", Text),
    ("TURNAROUND_NUMERATOR", Integer),
    ("TURNAROUND_DENOMINATOR", Integer),
    ("TIMETAG_REF", Word(&["TRANSMIT", "RECEIVE"])),
    ("INTEGRATION_INTERVAL", Positive),
    ("INTEGRATION_REF", Word(&["START", "MIDDLE", "END"])),
    ("FREQ_OFFSET", Real),
    ("RANGE_MODE", Word(&["COHERENT", "CONSTANT", "ONE_WAY"])),
    ("RANGE_MODULUS", NotNegative),
    ("RANGE_UNITS", Word(&["km", "s", "RU"])),
    ("ANGLE_TYPE", Word(&["AZEL", "RADEC", "XEYN", "XSYE"])),
    ("REFERENCE_FRAME", Text),
    ("INTERPOLATION", Text),
    ("INTERPOLATION_DEGREE", Integer),
    ("DOPPLER_COUNT_BIAS", Positive),
    ("DOPPLER_COUNT_SCALE", Integer),
    ("DOPPLER_COUNT_ROLLOVER", Word(&["YES", "NO"])),
    ("TRANSMIT_DELAY_n", NotNegative),
    ("RECEIVE_DELAY_n", NotNegative),
    ("DATA_QUALITY", Word(&["RAW", "VALIDATED", "DEGRADED"])),
    ("CORRECTION_ANGLE_1", Real),
    ("CORRECTION_ANGLE_2", Real),
    ("CORRECTION_DOPPLER", Real),
    ("CORRECTION_MAG", Real),
    ("CORRECTION_RANGE", Real),
    ("CORRECTION_RCS", Real),
    ("CORRECTION_RECEIVE", Real),
    ("CORRECTION_TRANSMIT", Real),
    ("CORRECTION_ABERRATION_YEARLY", Real),
    ("CORRECTION_ABERRATION_DIURNAL", Real),
    ("CORRECTIONS_APPLIED", Word(&["YES", "NO"])),
];

/// Keywords of a data section, the least and the greatest value allowed: table 3-5 and the sections it names.
pub(super) const DATA: [(&str, f64, f64); 27] = [
    ("ANGLE_1", -180.0, BELOW_360),
    ("ANGLE_2", -180.0, BELOW_360),
    ("CARRIER_POWER", f64::MIN, f64::MAX),
    ("CLOCK_BIAS", f64::MIN, f64::MAX),
    ("CLOCK_DRIFT", f64::MIN, f64::MAX),
    ("DOPPLER_COUNT", 0.0, f64::MAX),
    ("DOPPLER_INSTANTANEOUS", f64::MIN, f64::MAX),
    ("DOPPLER_INTEGRATED", f64::MIN, f64::MAX),
    ("DOR", f64::MIN, f64::MAX),
    ("MAG", f64::MIN, f64::MAX),
    ("PC_N0", f64::MIN, f64::MAX),
    ("PR_N0", f64::MIN, f64::MAX),
    ("PRESSURE", f64::MIN, f64::MAX),
    ("RANGE", f64::MIN, f64::MAX),
    ("RCS", f64::MIN_POSITIVE, f64::MAX),
    ("RECEIVE_FREQ_n", f64::MIN, f64::MAX),
    ("RECEIVE_FREQ", f64::MIN, f64::MAX),
    ("RECEIVE_PHASE_CT_n", f64::MIN, f64::MAX),
    ("RHUMIDITY", 0.0, 100.0),
    ("STEC", f64::MIN_POSITIVE, f64::MAX),
    ("TEMPERATURE", f64::MIN_POSITIVE, f64::MAX),
    ("TRANSMIT_FREQ_n", f64::MIN_POSITIVE, f64::MAX),
    ("TRANSMIT_FREQ_RATE_n", f64::MIN, f64::MAX),
    ("TRANSMIT_PHASE_CT_n", f64::MIN, f64::MAX),
    ("TROPO_DRY", 0.0, f64::MAX),
    ("TROPO_WET", 0.0, f64::MAX),
    ("VLBI_DELAY", f64::MIN, f64::MAX),
];

/// Largest number below 360.
const BELOW_360: f64 = 360.0 - 5.684_341_886_080_802e-14;

/// Whether `keyword` is `name`, or one of its indexed forms.
pub(super) fn is(keyword: &str, name: &str) -> bool {
    match name.strip_suffix('n') {
        Some(stem) if stem.ends_with('_') => {
            keyword.strip_prefix(stem).is_some_and(|index| matches!(index, "1" | "2" | "3" | "4" | "5"))
        }
        _ => keyword == name,
    }
}

/// A number as sections 4.3.2 to 4.3.5 have it; `endless` ones may have any number of digits, 4.3.11.
pub(super) fn number(text: &str, endless: bool) -> Option<f64> {
    let digits = |t: &str| !t.is_empty() && t.bytes().all(|b| b.is_ascii_digit());
    let unsigned = text.strip_prefix(['+', '-']).unwrap_or(text);
    let (mantissa, exponent) = unsigned.split_once(['E', 'e']).map_or((unsigned, None), |(m, e)| (m, Some(e)));
    let count = mantissa.bytes().filter(u8::is_ascii_digit).count();
    let form = match (mantissa.split_once('.'), exponent) {
        (None, None) => digits(mantissa),
        (Some((whole, part)), None) => digits(whole) && digits(part),
        (Some((whole, part)), Some(e)) => {
            let e = e.strip_prefix(['+', '-']).unwrap_or(e);
            !endless && whole.len() == 1 && digits(whole) && digits(part) && digits(e)
        }
        (None, Some(_)) => false,
    };
    let value = text.parse::<f64>().ok().filter(|v| v.is_finite());
    let negative_zero = value.is_some_and(|v| v == 0.0 && v.is_sign_negative());
    value.filter(|_| form && (endless || count <= 16) && !negative_zero)
}
