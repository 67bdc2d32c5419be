//! A frame ready to measure: pixels, and what its header says about them.
//!
//! Only what a real telescope writes is read (FITS Standard 4.0; world coordinates of Calabretta & Greisen
//! 2002, A&A 395, 1077, with SIP terms of orders 2 to 5): the simulation's own knowledge (MAGZERO, SKY*) is not.
//! Essential are the world coordinates, the exposure time, the gain and a date; whatever else is missing is
//! either estimated from the pixels (bias, read noise) or left out (scintillation).

use super::header::{Facts, Header, Note, NoteKind, Overrides, Section};
use super::reduce::{Calibration, Detail, Exposure, ReduceError};
use super::response::Response;
use super::segment::Segment;
use crate::astro::direction;
use crate::astro::scales::Scale;
use crate::astro::time::Instant;
use crate::base::units::ARCSEC;
use crate::io::header;
use crate::io::image::{Image, Keywords};
use crate::plan::wcs::Wcs;
use glam::{DVec2, DVec3};
use std::path::Path;

impl Header for Keywords {
    fn number(&self, keyword: &str) -> Option<f64> {
        self.number(keyword)
    }

    fn text(&self, keyword: &str) -> Option<String> {
        self.text(keyword)
    }

    fn flag(&self, keyword: &str) -> Option<bool> {
        self.flag(keyword)
    }
}

impl Header for header::Header {
    fn number(&self, keyword: &str) -> Option<f64> {
        match self.value(keyword)? {
            header::Value::Int(i) => Some(*i as f64),
            header::Value::Float(x) => Some(*x),
            _ => None,
        }
    }

    fn text(&self, keyword: &str) -> Option<String> {
        if let header::Value::Text(text) = self.value(keyword)? { Some(text.clone()) } else { None }
    }

    fn flag(&self, keyword: &str) -> Option<bool> {
        if let header::Value::Bool(flag) = self.value(keyword)? { Some(*flag) } else { None }
    }
}

/// What keeps a frame from being measured.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PhotometryError {
    /// Essential facts are missing.
    #[error("{path}: {missing}")]
    Missing {
        /// The file.
        path: String,
        /// All that is missing, with the options that can supply it.
        missing: String,
    },
    /// The time cannot be used.
    #[error("{path}: the time {value}: {reason}")]
    Time {
        /// The file.
        path: String,
        /// What was read.
        value: String,
        /// What is wrong.
        reason: String,
    },
    /// The masters do not fit the frame.
    #[error("{path}: {source}")]
    Reduce {
        /// The file.
        path: String,
        /// What does not fit.
        source: ReduceError,
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
    /// True if stars have told that they are right.
    pub solved: bool,
    /// True if they were made up from pointing and scale, or are known to be rough.
    pub approximate: bool,
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
    /// Variance that the masters of a calibration add to each pixel \[e^2\].
    pub masters_variance_e2: f64,
    /// Relative error of the master flat.
    pub masters_flat_rms: f64,
    /// Response that a flat has divided out; none: nothing was.
    pub response: Option<Response>,
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

impl Frame {
    /// The frame of an image, by its header.
    ///
    /// # Errors
    /// [`PhotometryError`] naming the file and what is missing or cannot be used.
    pub fn from_image(image: Image) -> Result<Self, PhotometryError> {
        Self::read(image, &Overrides::default(), None).map(|(frame, _)| frame)
    }

    /// The frame of an image, by its header and what the user says in its place, calibrated if masters are given; and the
    /// remarks that reading it gave rise to.
    ///
    /// # Errors
    /// [`PhotometryError`] naming the file and what is missing or cannot be used.
    pub fn read(
        image: Image,
        overrides: &Overrides,
        masters: Option<&Calibration>,
    ) -> Result<(Self, Vec<Note>), PhotometryError> {
        let size = [image.width, image.height];
        Self::assemble(&image.header, size, image.data, &image.path, overrides, masters)
    }

    /// The same of a header and pixels \[adu\], row by row, of a frame of `size` (columns, rows); `path` is its name.
    ///
    /// # Errors
    /// [`PhotometryError`] naming the file and what is missing or cannot be used.
    pub fn assemble(
        header: &dyn Header,
        size: [usize; 2],
        mut data: Vec<f32>,
        path: &Path,
        overrides: &Overrides,
        masters: Option<&Calibration>,
    ) -> Result<(Self, Vec<Note>), PhotometryError> {
        let file = path;
        let path = file.display().to_string();
        let facts = Facts::read(header, size, overrides);
        let told = facts.wcs.zip(facts.exptime_s).zip(facts.gain_e_adu).zip(facts.time.as_ref());
        let Some((((mapped, exptime_s), gain_e_adu), epoch)) = told else {
            let missing = facts.missing().iter().map(ToString::to_string).collect::<Vec<_>>().join("; ");
            return Err(PhotometryError::Missing { path, missing });
        };
        let scale = Scale::named(epoch.scale.name()).unwrap_or(Scale::Utc);
        let time = Instant::from_iso(&epoch.iso, scale).map_err(|reason| PhotometryError::Time {
            path: path.clone(),
            value: format!("{} {}", epoch.iso, epoch.scale.name()),
            reason,
        })?;
        let mut notes = facts.notes;
        let mut bias_adu = facts.bias_adu;
        let mut saturate_adu = facts.saturate_adu.unwrap_or(f64::INFINITY);
        let mut masters_e = [0.0; 2];
        if let Some(masters) = masters {
            let reduce = |source| PhotometryError::Reduce { path: path.clone(), source };
            let exposure = Exposure { exptime_s, temperature_c: facts.ccd_temp_c, saturate_adu };
            let applied = masters.apply(&mut data, &exposure).map_err(reduce)?;
            for index in &applied.saturated {
                data[*index] = f32::INFINITY;
            }
            let extra = masters.extra(exptime_s, Detail::Median).map_err(reduce)?;
            let (fixed, bright) = (extra.variance(0, 0, 0.0), extra.variance(0, 0, 1.0));
            masters_e = [fixed * gain_e_adu * gain_e_adu, (bright - fixed).max(0.0).sqrt()];
            if !masters_e.iter().all(|v| v.is_finite()) {
                masters_e = [0.0; 2];
                let what = "a master of a single frame tells no errors: none are added for it".to_owned();
                notes.push(Note { kind: NoteKind::Assumed, cards: vec![], what });
            }
            if let Some(warmer) = applied.warmer_than_dark_k {
                let (cards, what) =
                    (vec![], format!("the chip was {warmer:+.1} K warmer than that of the master dark"));
                notes.push(Note { kind: NoteKind::Contradictory, cards, what });
            }
            (bias_adu, saturate_adu) = (Some(0.0), f64::INFINITY);
        }
        let stem = file.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
        let stem = stem.trim_end_matches(".fits").trim_end_matches(".fit");
        let digits = &stem[stem.trim_end_matches(|c: char| c.is_ascii_digit()).len()..];
        let dark_e = header.number("DARKCUR").filter(|x| *x >= 0.0 && x.is_finite());
        let mut frame = Self {
            wcs: mapped.wcs,
            solved: false,
            approximate: mapped.approximate,
            time: time.plus(epoch.plus_s),
            exptime_s,
            gain_e_adu,
            read_noise_e: facts.read_noise_e,
            dark_e: dark_e.map(|rate| rate * exptime_s),
            saturate_adu,
            bias_adu,
            masters_variance_e2: masters_e[0],
            masters_flat_rms: masters_e[1],
            response: masters.and_then(Calibration::response).cloned(),
            airmass: facts.airmass,
            aperture_mm: facts.aperture_m.map(|d| d * 1e3),
            elevation_m: facts.elevation_m,
            pointing: facts.pointing.unwrap_or(mapped.wcs.centre),
            track_rad_s: facts.track_rad_s.unwrap_or(DVec2::ZERO),
            seeing_arcsec: facts.seeing.map(|s| s / ARCSEC),
            object: facts.object.unwrap_or_default(),
            number: digits.parse().ok(),
            width: size[0],
            height: size[1],
            data,
        };
        if let Some(section) = facts.trim {
            frame.trim(&section);
        }
        Ok((frame, notes))
    }

    /// Keeps the part of a frame that sees light.
    fn trim(&mut self, section: &Section) {
        let Section { x0, y0, width, height } = *section;
        let inside = x0 + width <= self.width && y0 + height <= self.height && width > 0 && height > 0;
        if !inside || [width, height] == [self.width, self.height] {
            return;
        }
        let rows = self.data.chunks_exact(self.width).skip(y0).take(height);
        self.data = rows.flat_map(|row| row[x0..x0 + width].iter().copied()).collect();
        (self.width, self.height) = (width, height);
        let first = DVec2::new(x0 as f64, y0 as f64);
        self.wcs.crpix -= first;
        self.response = self.response.as_ref().map(|response| response.from(first));
    }

    /// Electrons that arrived at a place for each that the corrected frame counts there.
    pub fn response_at(&self, place: DVec2) -> f64 {
        self.response.as_ref().map_or(1.0, |response| response.at(place))
    }

    /// Gain there \[e/adu\], for electrons as they arrived.
    pub fn gain_at(&self, place: DVec2) -> f64 {
        self.gain_e_adu * self.response_at(place)
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

    /// Half the trail that stars in the frame's middle draw \[px\]; zero where the stars are tracked.
    pub fn star_half(&self) -> DVec2 {
        self.star_segment(self.wcs.centre).map_or(DVec2::ZERO, |segment| segment.half)
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
        assert_eq!((f.bias_adu, f.airmass, f.saturate_adu), (None, Some(1.25), 65_535.0));
        assert!(f.pixel(10, 0).is_nan() && f.pixel(-1, 3).is_nan());
        // the reference star drifts by 75 arcsec towards the west: right, where east is to the left
        let trail = f.star_segment(f.wcs.centre).expect("in front");
        assert!((trail.half.x * 2.0 - 75.0 / 0.72).abs() < 0.1, "{trail:?}");
        assert!((trail.half.y * 2.0 - 2.5 / 0.72).abs() < 0.6, "{trail:?}");
    }

    #[test]
    fn what_is_missing_or_wrong_is_named() {
        for (keyword, option) in [("EXPTIME", "--exptime"), ("GAIN", "--gain"), ("DATE-OBS", "--time")] {
            let told = frame(&header(keyword)).expect_err("incomplete").to_string();
            let named = [keyword, option, "night_0042.fits"].iter().all(|word| told.contains(word));
            assert!(named, "{told}");
        }
        let mut odd = header("GAIN");
        odd.push("GAIN", -1.0, "");
        let told = frame(&odd).expect_err("no gain").to_string();
        assert!(told.contains("GAIN = -1"), "{told}");
        let mut sextic = header("");
        sextic.push("B_0_6", 1e-20, "");
        assert!(frame(&sextic).expect("the linear part").approximate);
    }

    #[test]
    fn what_the_user_says_wins_and_masters_leave_no_bias() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("light.fits");
        let data = (0..80).map(|i| if i == 7 { 65_535 } else { 1000 + i }).collect::<Vec<u16>>();
        write(&path, 10, 8, Pixels::U16(&data), &header("GAIN")).expect("written");
        let overrides = Overrides { gain_e_adu: Some(2.0), saturate_adu: Some(60_000.0), ..Overrides::default() };
        let masters = Calibration::new([10, 8], crate::photometry::reduce::Bias::Level(990.0), None, None);
        let masters = masters.expect("a calibration");
        let image = Image::read(&path).expect("an image");
        let (frame, notes) = Frame::read(image, &overrides, Some(&masters)).expect("complete");
        assert_eq!((frame.gain_e_adu, frame.bias_adu, frame.pixel(3, 0)), (2.0, Some(0.0), 13.0));
        assert!(frame.pixel(7, 0) >= frame.saturate_adu && frame.pixel(8, 0) < frame.saturate_adu);
        assert!(notes.iter().any(|n| n.to_string().contains("--gain")), "{notes:?}");
    }
}
