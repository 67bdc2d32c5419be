//! Station, telescope and detector as the program sees them. A field bears the name and the unit of its key.

use std::path::PathBuf;

/// A curve or catalogue: one that is built in, or a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Table {
    /// A built-in one, by name (`"none"` included).
    Named(String),
    /// A file, existing when the scene was loaded.
    File(PathBuf),
}

/// `[station]`: the site and the air above it.
#[derive(Clone, Debug, PartialEq)]
pub struct Station {
    /// Name of the site.
    pub name: String,
    /// Geodetic latitude on WGS 84, degrees.
    pub latitude_deg: f64,
    /// Longitude, degrees east, -180 to 360.
    pub longitude_deg: f64,
    /// Height above the WGS 84 ellipsoid, metres.
    pub height_m: f64,
    /// Air pressure at the site, hPa; 0 = no refraction.
    pub pressure_hpa: f64,
    /// Air temperature at the site, degrees Celsius.
    pub temperature_c: f64,
    /// Relative humidity, 0 to 1.
    pub humidity: f64,
    /// Full width at half maximum of the seeing at zenith and 550 nm, arcseconds.
    pub seeing_arcsec: f64,
    /// Artificial part of the zenith luminance, mcd/m^2; 0 = none.
    pub artificial_zenith_mcd_m2: f64,
    /// Tile of an atlas of artificial light, or `none`.
    pub light_atlas: Table,
    /// Towns: azimuth in degrees, share of the artificial light.
    pub light_domes: Vec<[f64; 2]>,
    /// Extinction curve: wavelength in nm, magnitudes per airmass.
    pub extinction: Table,
    /// Albedo of the ground around, 0 to 1.
    pub ground_albedo: f64,
    /// Horizon: pairs of azimuth and lowest elevation in degrees, azimuth ascending, linear between.
    pub horizon_deg: Vec<[f64; 2]>,
    /// Whether scintillation is simulated.
    pub scintillation: bool,
    /// Its standard deviation at the site, times Young's.
    pub scintillation_factor: f64,
}

/// `[telescope]`: the optics.
#[derive(Clone, Debug, PartialEq)]
pub struct Telescope {
    /// Diameter of the aperture, metres.
    pub aperture_m: f64,
    /// Diameter of the central obstruction, metres; 0 = none.
    pub obstruction_m: f64,
    /// Arcseconds per unbinned pixel at the centre; follows from the focal length where that is what was given.
    pub plate_scale_arcsec: f64,
    /// Focal length, metres; follows from the plate scale where that is what was given.
    pub focal_length_m: f64,
    /// Share of light that mirrors, glass and losses pass on, without QE, obstruction, atmosphere and filter.
    pub throughput: f64,
    /// Filter: wavelength in nm, transmission.
    pub filter: Table,
    /// Position angle of the +y axis, degrees from north through east.
    pub position_angle_deg: f64,
    /// False: east is to the left when north is up.
    pub mirrored: bool,
    /// Shape of a star's image.
    pub psf: Psf,
    /// Exponent of the Moffat profile; of use with [`Psf::Moffat`] only.
    pub moffat_beta: f64,
    /// Share of light lost in the corner.
    pub vignetting: f64,
    /// Distortion: `none` or a file of SIP coefficients.
    pub sip: Table,
    /// Tilt of the chip about its y and x axes, degrees.
    pub tilt_deg: [f64; 2],
}

/// Shape of a star's image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Psf {
    /// A Gaussian of the seeing's width.
    Gaussian,
    /// A Moffat profile of exponent `moffat_beta`.
    Moffat,
    /// Diffraction by the obstructed aperture.
    Airy,
    /// Long-exposure turbulence.
    Kolmogorov,
    /// An image in a FITS file.
    Image(PathBuf),
}

/// `[detector]`: the chip and its electronics.
#[derive(Clone, Debug, PartialEq)]
pub struct Detector {
    /// Width and height in unbinned pixels.
    pub size_px: [usize; 2],
    /// Side of an unbinned pixel, micrometres.
    pub pixel_um: f64,
    /// Kind of chip.
    pub kind: Chip,
    /// On-chip binning factor.
    pub binning: usize,
    /// Quantum efficiency: wavelength in nm, electrons per photon.
    pub qe: Table,
    /// Gain, electrons per ADU.
    pub gain_e_per_adu: f64,
    /// Read noise, electrons rms.
    pub read_noise_e: f64,
    /// Dark current per pixel at `dark_temperature_c`, electrons per second.
    pub dark_e_per_s: f64,
    /// Temperature at which `dark_e_per_s` holds, degrees Celsius.
    pub dark_temperature_c: f64,
    /// Temperature of the chip, degrees Celsius.
    pub temperature_c: f64,
    /// Warming that doubles the dark current, kelvin.
    pub dark_doubling_c: f64,
    /// Bias level, ADU.
    pub bias_adu: f64,
    /// Rms of a fixed bias pattern, ADU.
    pub bias_structure_adu: f64,
    /// Full well, electrons.
    pub full_well_e: f64,
    /// Bits of the converter.
    pub bits: u32,
    /// Pixel response non-uniformity, rms share.
    pub prnu: f64,
    /// Dark signal non-uniformity, rms share.
    pub dsnu: f64,
    /// Share of pixels that are hot.
    pub hot_pixel_fraction: f64,
    /// Whether charge above full well runs along the column.
    pub blooming: bool,
    /// Cosmic rays per square centimetre and second.
    pub cosmic_rays_per_cm2_s: f64,
    /// Share of charge lost per transfer.
    pub cti: f64,
    /// Departure from a straight line at full well, share.
    pub nonlinearity: f64,
    /// Overscan columns.
    pub overscan_px: usize,
    /// Travel time of the shutter, seconds; 0 = ideal.
    pub shutter_s: f64,
    /// Time in which a frame is moved under its shield, seconds; 0 = none.
    pub frame_transfer_s: f64,
    /// Relative width of the pixels' read noise; of active pixels only.
    pub cmos_read_noise_spread: Option<f64>,
    /// Relative spread of the pixels' gain; of active pixels only.
    pub cmos_gain_spread: Option<f64>,
    /// Seed of the chip's fixed patterns.
    pub pattern_seed: u64,
}

impl Detector {
    /// Stored pixels that see light: columns and rows.
    pub fn light_px(&self) -> [usize; 2] {
        self.size_px.map(|n| (n / self.binning).max(1))
    }

    /// Stored pixels, overscan included: columns and rows.
    pub fn stored_px(&self) -> [usize; 2] {
        let [width, height] = self.light_px();
        [width + self.overscan_px, height]
    }

    /// Read noise of a stored pixel, electrons: binned active pixels are read one by one. The median, where each has its own.
    pub fn stored_read_noise_e(&self) -> f64 {
        self.read_noise_e * if self.kind == Chip::Cmos { self.binning as f64 } else { 1.0 }
    }

    /// Relative width of the stored pixels' read noise, if they have one each.
    pub fn stored_read_noise_spread(&self) -> Option<f64> {
        self.cmos_read_noise_spread.map(|spread| spread / self.binning as f64).filter(|spread| *spread > 0.0)
    }

    /// Root mean square of the stored pixels' read noise, electrons: exp(s^2) times the median of a log-normal width.
    pub fn read_noise_rms_e(&self) -> f64 {
        let spread = self.stored_read_noise_spread().unwrap_or(0.0);
        self.stored_read_noise_e() * libm::exp(spread * spread)
    }

    /// What a stored pixel holds, electrons: as much as the pixels binned in it.
    pub fn stored_full_well_e(&self) -> f64 {
        self.full_well_e * (self.binning * self.binning) as f64
    }
}

/// Kind of chip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Chip {
    /// Charge-coupled device: one amplifier.
    Ccd,
    /// Active pixels with a rolling shutter.
    Cmos,
}
