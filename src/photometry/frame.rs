//! A frame ready to measure: pixels, and what its header says about them.
//!
//! Only what a real telescope writes is read (FITS Standard 4.0; world coordinates of Calabretta & Greisen
//! 2002, A&A 395, 1077, with SIP terms of orders 2 to 5): the simulation's own knowledge (MAGZERO, SKY*) is not.
//! Essential are the world coordinates, the exposure time, the gain and a date; whatever else is missing is
//! either estimated from the pixels (bias, read noise) or left out (scintillation).

use super::segment::Segment;
use crate::astro::direction;
use crate::astro::time::Instant;
use crate::base::units::ARCSEC;
use crate::io::image::{Image, Keywords};
use crate::plan::sip::{SIP_TERMS, Sip};
use crate::plan::wcs::Wcs;
use glam::{DMat2, DVec2, DVec3};

/// What keeps a frame from being measured.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PhotometryError {
    /// An essential keyword is missing.
    #[error("{path}: keyword {keyword} is missing: {needed_for}")]
    Missing {
        /// The file.
        path: String,
        /// The keyword, or the alternatives.
        keyword: &'static str,
        /// What it is needed for.
        needed_for: &'static str,
    },
    /// A keyword's value cannot be used.
    #[error("{path}: keyword {keyword} = {value}: {reason}")]
    Value {
        /// The file.
        path: String,
        /// The keyword.
        keyword: String,
        /// Its value.
        value: String,
        /// What is allowed.
        reason: &'static str,
    },
}

/// One exposure ready to measure.
#[derive(Debug, Clone)]
pub struct Frame {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Pixels \[adu\], row by row from y = 0.
    pub data: Vec<f32>,
    /// World coordinates at mid-exposure.
    pub wcs: Wcs,
    /// Mid-exposure.
    pub time: Instant,
    /// Exposure time \[s\].
    pub exptime_s: f64,
    /// Gain \[e/adu\].
    pub gain_e_adu: f64,
    /// Read noise \[e\]; none: taken from the pixels' scatter.
    pub read_noise_e: Option<f64>,
    /// Mean dark current of the exposure \[e\], if known.
    pub dark_e: Option<f64>,
    /// Value at and above which a pixel is saturated \[adu\]; infinite if unknown.
    pub saturate_adu: f64,
    /// Bias level \[adu\]; none: the sky's noise is taken from the pixels' scatter.
    pub bias_adu: Option<f64>,
    /// Airmass, if known.
    pub airmass: Option<f64>,
    /// Diameter of the telescope \[mm\], if known.
    pub aperture_mm: Option<f64>,
    /// Elevation of the station above the sea \[m\], if known.
    pub elevation_m: Option<f64>,
    /// Where the target should be (keywords RA, DEC), else the reference direction.
    pub pointing: DVec3,
    /// Rate of the frame's centre among the stars: (dRA/dt cos Dec, dDec/dt) \[rad/s\].
    pub track_rad_s: DVec2,
    /// Width of a point's image as delivered, FWHM \[arcsec\], if known.
    pub seeing_arcsec: Option<f64>,
    /// Name of the target (keyword OBJECT), else empty.
    pub object: String,
    /// Number of the frame: the digits that end the file's stem, if any.
    pub number: Option<u64>,
}

/// Keywords of one file, with errors that name both.
struct Reader<'a> {
    header: &'a Keywords,
    path: String,
}

impl Reader<'_> {
    fn finite(&self, keyword: &str) -> Option<f64> {
        self.header.number(keyword).filter(|x| x.is_finite())
    }

    fn first(&self, keywords: &[&str]) -> Option<f64> {
        keywords.iter().find_map(|k| self.finite(k))
    }

    fn needed(&self, keyword: &'static str, needed_for: &'static str) -> Result<f64, PhotometryError> {
        self.finite(keyword).ok_or_else(|| self.missing(keyword, needed_for))
    }

    fn missing(&self, keyword: &'static str, needed_for: &'static str) -> PhotometryError {
        PhotometryError::Missing { path: self.path.clone(), keyword, needed_for }
    }

    fn refuse(&self, keyword: &str, value: impl ToString, reason: &'static str) -> PhotometryError {
        let (path, keyword, value) = (self.path.clone(), keyword.to_owned(), value.to_string());
        PhotometryError::Value { path, keyword, value, reason }
    }

    fn wcs(&self) -> Result<Wcs, PhotometryError> {
        const WHY: &str = "places on the frame";
        let mut distorted = false;
        for (keyword, plain) in [("CTYPE1", "RA---TAN"), ("CTYPE2", "DEC--TAN")] {
            let text = self.header.text(keyword).ok_or_else(|| self.missing(keyword, WHY))?;
            distorted |= text.ends_with("-SIP");
            if text.trim_end_matches("-SIP") != plain {
                let reason = "only RA---TAN and DEC--TAN, plain or -SIP, are understood";
                return Err(self.refuse(keyword, text, reason));
            }
        }
        let (ra, dec) = (self.needed("CRVAL1", WHY)?, self.needed("CRVAL2", WHY)?);
        let crpix = DVec2::new(self.needed("CRPIX1", WHY)? - 1.0, self.needed("CRPIX2", WHY)? - 1.0);
        let cd = self.matrix().ok_or_else(|| self.missing("CD1_1 (or CDELT1, PC1_1)", WHY))?;
        if cd.determinant().abs() < 1e-30 {
            return Err(self.refuse("CD1_1", cd, "the matrix is singular"));
        }
        let sip = if distorted { Some(self.sip()?) } else { None };
        Ok(Wcs::new(ra.to_radians(), dec.to_radians(), crpix, cd * 1f64.to_radians(), sip))
    }

    /// CD, or PC times CDELT, or CROTA2 with CDELT \[deg/px\].
    fn matrix(&self) -> Option<DMat2> {
        const CD: [&str; 4] = ["CD1_1", "CD1_2", "CD2_1", "CD2_2"];
        const PC: [&str; 4] = ["PC1_1", "PC1_2", "PC2_1", "PC2_2"];
        let by_rows = |m: [f64; 4]| DMat2::from_cols(DVec2::new(m[0], m[2]), DVec2::new(m[1], m[3]));
        if CD.iter().any(|k| self.finite(k).is_some()) {
            return Some(by_rows(CD.map(|k| self.finite(k).unwrap_or(0.0))));
        }
        let delta = DVec2::new(self.finite("CDELT1")?, self.finite("CDELT2")?);
        if let Some(turn) = self.finite("CROTA2") {
            let (sin, cos) = turn.to_radians().sin_cos();
            return Some(by_rows([delta.x * cos, -delta.y * sin, delta.x * sin, delta.y * cos]));
        }
        let [a, b, c, d] = [(0, 1.0), (1, 0.0), (2, 0.0), (3, 1.0)].map(|(i, x)| self.finite(PC[i]).unwrap_or(x));
        Some(by_rows([delta.x * a, delta.x * b, delta.y * c, delta.y * d]))
    }

    fn sip(&self) -> Result<Sip, PhotometryError> {
        for axis in ["A", "B"] {
            for i in 0..=9 {
                for j in 0..=9 {
                    let keyword = format!("{axis}_{i}_{j}");
                    let told = self.finite(&keyword).filter(|c| *c != 0.0 && !SIP_TERMS.contains(&(i, j)));
                    if let Some(value) = told {
                        return Err(self.refuse(
                            &keyword,
                            value,
                            "only SIP terms of orders 2 to 5 are understood",
                        ));
                    }
                }
            }
        }
        let terms = |axis: &str| SIP_TERMS.map(|(i, j)| self.finite(&format!("{axis}_{i}_{j}")).unwrap_or(0.0));
        Ok(Sip { a: terms("A"), b: terms("B") })
    }

    fn mid_exposure(&self, exptime_s: f64) -> Result<Instant, PhotometryError> {
        let date = |keyword: &str| {
            self.header.text(keyword).map(|text| {
                Instant::from_utc(&text).map_err(|_| self.refuse(keyword, text, "ISO 8601 in UTC is understood"))
            })
        };
        let mjd = |keyword: &str| {
            let day = self.finite(keyword).filter(|d| (15_020.0..110_000.0).contains(d))?;
            Some(Instant::from_mjd_utc(day))
        };
        if let Some(middle) = date("DATE-AVG") {
            return middle;
        }
        if let Some(middle) = mjd("MJD-AVG") {
            return Ok(middle);
        }
        if let Some(start) = date("DATE-OBS") {
            return Ok(start?.plus(exptime_s / 2.0));
        }
        let start = mjd("MJD-OBS").ok_or_else(|| self.missing("DATE-AVG or DATE-OBS", "the time of a row"))?;
        Ok(start.plus(exptime_s / 2.0))
    }
}

impl Frame {
    /// The frame of an image, by its header.
    ///
    /// # Errors
    /// [`PhotometryError`] naming the file and the keyword that is missing or cannot be used.
    pub fn from_image(image: Image) -> Result<Self, PhotometryError> {
        let image = trimmed(image);
        let read = Reader { header: &image.header, path: image.path.display().to_string() };
        let wcs = read.wcs()?;
        let exptime_s = read
            .first(&["EXPTIME", "XPOSURE"])
            .ok_or_else(|| read.missing("EXPTIME or XPOSURE", "the time and the star trails"))?;
        if exptime_s < 0.0 {
            return Err(read.refuse("EXPTIME", exptime_s, "0 s or more"));
        }
        let gain_e_adu =
            read.first(&["GAIN", "EGAIN"]).ok_or_else(|| read.missing("GAIN or EGAIN", "counts in electrons"))?;
        if gain_e_adu <= 0.0 {
            return Err(read.refuse("GAIN", gain_e_adu, "above 0 e/adu"));
        }
        let time = read.mid_exposure(exptime_s)?;
        let place = read.finite("RA").zip(read.finite("DEC"));
        let pointing = place.map_or(wcs.centre, |(ra, dec)| direction(ra.to_radians(), dec.to_radians()));
        let rate = |keyword| read.finite(keyword).unwrap_or(0.0) * ARCSEC;
        let stem = image.path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
        let stem = stem.trim_end_matches(".fits");
        let digits = &stem[stem.trim_end_matches(|c: char| c.is_ascii_digit()).len()..];
        Ok(Self {
            wcs,
            time,
            exptime_s,
            gain_e_adu,
            read_noise_e: read.finite("RDNOISE").filter(|x| *x >= 0.0),
            dark_e: read.finite("DARKCUR").filter(|x| *x >= 0.0).map(|rate| rate * exptime_s),
            saturate_adu: read.finite("SATURATE").unwrap_or(f64::INFINITY),
            bias_adu: read.finite("BIASLVL"),
            airmass: read.finite("AIRMASS").filter(|x| *x >= 0.99),
            aperture_mm: read.finite("APTDIA").filter(|x| *x > 0.0),
            elevation_m: read.finite("SITEELEV"),
            pointing,
            track_rad_s: DVec2::new(rate("TRKRA"), rate("TRKDEC")),
            seeing_arcsec: read.finite("SEEING").filter(|x| *x > 0.0),
            object: image.header.text("OBJECT").unwrap_or_default(),
            number: digits.parse().ok(),
            width: image.width,
            height: image.height,
            data: image.data,
        })
    }

    /// Value of a pixel \[adu\]; NaN off the frame.
    pub fn pixel(&self, x: i64, y: i64) -> f64 {
        let inside = x >= 0 && y >= 0 && x < self.width as i64 && y < self.height as i64;
        if inside {
            self.data.get(y as usize * self.width + x as usize).map_or(f64::NAN, |v| f64::from(*v))
        } else {
            f64::NAN
        }
    }

    /// A place from -1 to 1 from border to border.
    pub fn relative(&self, place: DVec2) -> DVec2 {
        let size = DVec2::new(self.width as f64, self.height as f64);
        (place + 0.5) / size * 2.0 - 1.0
    }

    /// True if a place lies on the frame at least `margin` \[px\] inside its border.
    pub fn holds(&self, place: DVec2, margin: f64) -> bool {
        let (w, h) = (self.width as f64 - 0.5 - margin, self.height as f64 - 0.5 - margin);
        place.x >= margin - 0.5 && place.y >= margin - 0.5 && place.x <= w && place.y <= h
    }

    /// Expected FWHM of a point's image \[px\]: SEEING, else 3 px.
    pub fn expected_fwhm_px(&self) -> f64 {
        let scale = self.wcs.pixel_scale() / ARCSEC;
        let fwhm = self.seeing_arcsec.map_or(3.0, |s| (s / scale).hypot(0.68));
        if fwhm.is_finite() { fwhm.clamp(1.2, 25.0) } else { 3.0 }
    }

    /// The segment a star draws: its place at the start and the end of the exposure. The mount turns about
    /// the poles, so that the frame keeps its angle to north while its centre moves.
    pub fn star_segment(&self, star: DVec3) -> Option<Segment> {
        let (ra, dec) = self.wcs.crval();
        let half = self.track_rad_s * (0.5 * self.exptime_s);
        let shifted = |sign: f64| {
            let centre = direction(ra + sign * half.x / dec.cos().max(1e-6), dec + sign * half.y);
            self.wcs.turned_to(centre).pixel(star)
        };
        let (start, end) = if half == DVec2::ZERO {
            let place = self.wcs.pixel(star)?;
            (place, place)
        } else {
            (shifted(-1.0)?, shifted(1.0)?)
        };
        (start.is_finite() && end.is_finite()).then(|| Segment::between(start, end))
    }
}

/// An image without its overscan: the part that TRIMSEC names, if it begins at the first pixel.
fn trimmed(mut image: Image) -> Image {
    let section = image.header.text("TRIMSEC").and_then(|text| {
        let inner = text.trim().strip_prefix('[')?.strip_suffix(']')?.replace(',', ":");
        let numbers = inner.split(':').map(|n| n.trim().parse::<usize>().ok()).collect::<Option<Vec<_>>>()?;
        <[usize; 4]>::try_from(numbers).ok()
    });
    if let Some([1, width, 1, height]) = section
        && (1..=image.width).contains(&width)
        && (1..=image.height).contains(&height)
    {
        image.data =
            image.data.chunks_exact(image.width).take(height).flat_map(|row| row[..width].to_vec()).collect();
        (image.width, image.height) = (width, height);
    }
    image
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::fits::{Pixels, write};
    use crate::io::header::Header;

    fn header(without: &str) -> Header {
        let mut header = Header::default();
        let numbers = [
            ("CRVAL1", 80.0),
            ("CRVAL2", 5.0),
            ("CRPIX1", 5.5),
            ("CRPIX2", 4.5),
            ("CD1_1", -2e-4),
            ("CD1_2", 1e-6),
            ("CD2_1", 1e-6),
            ("CD2_2", 2e-4),
            ("EXPTIME", 5.0),
            ("GAIN", 1.5),
            ("RDNOISE", 10.0),
            ("TRKRA", 15.0),
            ("TRKDEC", -0.5),
            ("AIRMASS", 1.25),
            ("RA", 80.001),
            ("DEC", 5.0),
            ("A_2_0", 1e-7),
        ];
        let texts = [("CTYPE1", "RA---TAN-SIP"), ("CTYPE2", "DEC--TAN-SIP"), ("DATE-OBS", "2018-01-15T04:00:00")];
        texts.into_iter().filter(|(k, _)| *k != without).for_each(|(k, v)| header.push(k, v, ""));
        numbers.into_iter().filter(|(k, _)| *k != without).for_each(|(k, v)| header.push(k, v, ""));
        header
    }

    fn frame(header: &Header) -> Result<Frame, PhotometryError> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("night_0042.fits");
        write(&path, 10, 8, Pixels::U16(&[1000; 80]), header).expect("written");
        Frame::from_image(Image::read(&path).expect("an image"))
    }

    #[test]
    fn a_header_is_understood() {
        let f = frame(&header("")).expect("complete");
        assert_eq!((f.width, f.height, f.number, f.pixel(9, 7)), (10, 8, Some(42), 1000.0));
        assert_eq!(f.wcs.crpix, DVec2::new(4.5, 3.5));
        assert_eq!(f.wcs.sip.map(|s| s.a[0]), Some(1e-7));
        assert_eq!(f.time.iso_utc(), "2018-01-15T04:00:02.500000");
        assert_eq!((f.bias_adu, f.airmass, f.saturate_adu), (None, Some(1.25), f64::INFINITY));
        assert!(f.pixel(10, 0).is_nan() && f.pixel(-1, 3).is_nan());
        // the reference star drifts by 75 arcsec towards the west: right, where east is to the left
        let trail = f.star_segment(f.wcs.centre).expect("in front");
        assert!((trail.half.x * 2.0 - 75.0 / 0.72).abs() < 0.1, "{trail:?}");
        assert!((trail.half.y * 2.0 - 2.5 / 0.72).abs() < 0.6, "{trail:?}");
    }

    #[test]
    fn what_is_missing_or_wrong_is_named() {
        for keyword in ["CTYPE1", "CRVAL2", "CRPIX1", "EXPTIME", "GAIN", "DATE-OBS"] {
            let told = frame(&header(keyword)).expect_err("incomplete").to_string();
            assert!(told.contains(keyword) && told.contains("night_0042.fits"), "{told}");
        }
        let mut odd = header("GAIN");
        odd.push("GAIN", -1.0, "");
        let told = frame(&odd).expect_err("no gain").to_string();
        assert!(told.contains("GAIN = -1: above 0 e/adu"), "{told}");
        let mut sextic = header("");
        sextic.push("B_0_6", 1e-20, "");
        assert!(frame(&sextic).expect_err("sixth order").to_string().contains("B_0_6"));
    }
}
