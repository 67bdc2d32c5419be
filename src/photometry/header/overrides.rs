//! What the user says about a frame in place of its header.

/// Values that win over the header; none: the header counts. A value out of its range is refused with a note.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Overrides {
    /// Gain \[e/adu\], above 0 (`--gain`).
    pub gain_e_adu: Option<f64>,
    /// Read noise \[e\], 0 or more (`--read-noise`).
    pub read_noise_e: Option<f64>,
    /// Level from which a pixel is saturated \[adu\], above 0 (`--saturate`).
    pub saturate_adu: Option<f64>,
    /// Bias level \[adu\] (`--bias`).
    pub bias_adu: Option<f64>,
    /// Exposure time \[s\], 0 to a day (`--exptime`).
    pub exptime_s: Option<f64>,
    /// Start of the exposure in UTC, ISO 8601 (`--time`).
    pub time_utc: Option<String>,
    /// Side of a pixel on the sky \[arcsec\], above 0 (`--pixel-scale`).
    pub pixel_scale_arcsec: Option<f64>,
    /// Position angle of the stored frame's +y direction, from north through east \[deg\] (`--rotation`).
    pub rotation_deg: Option<f64>,
    /// True: with +y to the north, +x goes east (`--mirrored`).
    pub mirrored: Option<bool>,
    /// Full width at half maximum of a point's image \[arcsec\], above 0 (`--seeing`).
    pub seeing_arcsec: Option<f64>,
    /// Diameter of the telescope \[mm\], above 0 (`--aperture-mm`).
    pub aperture_mm: Option<f64>,
    /// Height of the site above the sea \[m\], -500 to 10 000 (`--elevation`).
    pub elevation_m: Option<f64>,
    /// Right ascension and declination of the pointing, ICRS \[deg\] (`--radec`).
    pub pointing_deg: Option<[f64; 2]>,
    /// Rate of the frame's centre among the stars: dRA/dt cos Dec, dDec/dt \[arcsec/s\] (`--track`).
    pub track_arcsec_s: Option<[f64; 2]>,
}
