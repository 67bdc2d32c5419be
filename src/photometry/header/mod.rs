//! What a frame's header says, in whatever dialect: from keywords to facts in SI units and radians.
//!
//! Cameras and programs write the same quantity under many names, and different ones under the same (`dialect` has
//! the tables). [`Facts::read`] takes what it can, and writes down in [`Facts::notes`] whatever was assumed,
//! passed over, refused or found to contradict something else; it never fails. What photometry cannot do without
//! is listed by [`Facts::missing`].

mod camera;
mod clock;
mod dialect;
mod note;
mod origin;
mod overrides;
mod pointing;
mod reader;
mod site;
mod text;
mod time;
mod wcs;

#[cfg(test)]
pub(crate) mod fixtures;
#[cfg(test)]
mod fixtures_more;
#[cfg(test)]
mod garbage_tests;
#[cfg(test)]
mod header_tests;
#[cfg(test)]
mod wcs_tests;

pub use note::{Note, NoteKind};
pub use origin::{Quantity, is_active_pixel};
pub use overrides::Overrides;
pub use reader::Header;
pub use site::Site;
pub use text::Section;
pub use time::{AGREE_S, Epoch, TimeScale};
pub use wcs::FrameWcs;

use crate::astro::separation;
use crate::base::units::ARCSEC;
use dialect::TEMPERATURE;
use glam::{DVec2, DVec3};
use reader::Reader;
use std::fmt;

/// What a header says; none: not known.
#[derive(Debug, Clone, PartialEq)]
pub struct Facts {
    /// The program that wrote the frame.
    pub program: Option<&'static str>,
    /// Mid-exposure.
    pub time: Option<Epoch>,
    /// Exposure time \[s\].
    pub exptime_s: Option<f64>,
    /// Gain \[e/adu\].
    pub gain_e_adu: Option<f64>,
    /// Read noise \[e\].
    pub read_noise_e: Option<f64>,
    /// Value from which a pixel is saturated \[adu\].
    pub saturate_adu: Option<f64>,
    /// Level of a pixel without light \[adu\].
    pub bias_adu: Option<f64>,
    /// Temperature of the chip \[deg C\].
    pub ccd_temp_c: Option<f64>,
    /// Binning along x and y.
    pub binning: Option<[u32; 2]>,
    /// Airmass, 0.99 or more.
    pub airmass: Option<f64>,
    /// Diameter of the telescope \[m\].
    pub aperture_m: Option<f64>,
    /// Focal length \[m\].
    pub focal_length_m: Option<f64>,
    /// Full width at half maximum of a point's image \[rad\].
    pub seeing: Option<f64>,
    /// Where the telescope stands.
    pub site: Option<Site>,
    /// Height of the site above the sea, or the ellipsoid \[m\].
    pub elevation_m: Option<f64>,
    /// Where the telescope pointed (ICRS); the frame's centre if only world coordinates tell.
    pub pointing: Option<DVec3>,
    /// Rate of the frame's centre among the stars: (dRA/dt cos Dec, dDec/dt) \[rad/s\].
    pub track_rad_s: Option<DVec2>,
    /// World coordinates.
    pub wcs: Option<FrameWcs>,
    /// The part that sees light (TRIMSEC, else DATASEC).
    pub trim: Option<Section>,
    /// Name of the target (OBJECT).
    pub object: Option<String>,
    /// Name of the filter (FILTER).
    pub filter: Option<String>,
    /// Kind of frame (IMAGETYP, OBSTYPE).
    pub image_type: Option<String>,
    /// Remarks, in the order in which they arose.
    pub notes: Vec<Note>,
}

/// Something essential that a header does not tell.
#[derive(Debug, Clone, PartialEq)]
pub struct Missing {
    /// What it is.
    pub what: &'static str,
    /// Keywords that would tell it.
    pub keywords: &'static [&'static str],
    /// What it is needed for.
    pub needed_for: &'static str,
    /// Command line options that can supply it.
    pub option: &'static str,
    /// Remarks on keywords that were there and could not be used.
    pub because: Vec<Note>,
}

impl fmt::Display for Missing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let keywords = self.keywords.join(", ");
        write!(f, "no {} ({keywords}), needed for {}; {} can supply it", self.what, self.needed_for, self.option)?;
        self.because.iter().try_for_each(|note| write!(f, "; {note}"))
    }
}

impl Facts {
    /// The facts of the header of a frame of `size` (columns, rows; overscan included), with the user's
    /// `overrides`.
    pub fn read(header: &dyn Header, size: [usize; 2], overrides: &Overrides) -> Self {
        let mut r = Reader::new(header, size, overrides);
        let exptime_s = camera::exposure(&mut r);
        let time = time::mid_exposure(&mut r, exptime_s);
        let gain_e_adu = camera::gain(&mut r);
        let read_noise_e = camera::read_noise(&mut r);
        let saturate_adu = camera::saturation(&mut r);
        let bias_adu = camera::bias(&mut r);
        let seeing = camera::seeing(&mut r);
        let (aperture_m, focal_length_m) = camera::optics(&mut r);
        let (site, elevation_m) = site::site(&mut r);
        let axes = pointing::Axes::of(&mut r);
        let told = pointing::pointing(&mut r, axes, time.as_ref().map(|(_, years)| *years));
        let solved = wcs::solved(&mut r, axes);
        let pointing = near_the_frame(&mut r, told, solved);
        let wcs = wcs::complete(&mut r, solved, pointing, focal_length_m);
        let binning = ["XBINNING", "YBINNING"].map(|k| r.number(k).filter(|b| (1.0..=64.0).contains(b)));
        let trim = r.text("TRIMSEC").or_else(|| r.text("DATASEC"));
        Self {
            program: r.program.map(|p| p.name),
            time: time.map(|(epoch, _)| epoch),
            exptime_s,
            gain_e_adu,
            read_noise_e,
            saturate_adu,
            bias_adu,
            ccd_temp_c: TEMPERATURE.iter().find_map(|k| r.number(k)).filter(|t| (-273.0..200.0).contains(t)),
            binning: binning[0].map(|x| [x as u32, binning[1].unwrap_or(x) as u32]),
            airmass: r.number("AIRMASS").filter(|x| *x >= 0.99),
            aperture_m,
            focal_length_m,
            seeing,
            site,
            elevation_m,
            pointing,
            track_rad_s: track(&mut r),
            wcs,
            trim: trim.and_then(|t| text::section(&t, size)),
            object: r.text("OBJECT"),
            filter: r.text("FILTER").or_else(|| r.text("FILTERS")),
            image_type: r.text("IMAGETYP").or_else(|| r.text("OBSTYPE")),
            notes: r.notes,
        }
    }

    /// What photometry needs and neither header nor user tells.
    pub fn missing(&self) -> Vec<Missing> {
        let needs = [
            (
                self.exptime_s.is_none(),
                "exposure time",
                &["EXPTIME", "EXPOSURE", "XPOSURE"][..],
                "the time and the star trails",
                "--exptime",
            ),
            (
                self.time.is_none(),
                "time",
                &["DATE-AVG", "DATE-OBS", "MJD-OBS", "TIME-OBS", "TIMESYS", "DATE-LOC"],
                "the time of a row",
                "--time",
            ),
            (self.gain_e_adu.is_none(), "gain", &["EGAIN", "GAIN"], "counts in electrons", "--gain"),
            (
                self.wcs.is_none(),
                "world coordinates",
                &[
                    "CTYPE1", "CRVAL1", "CD1_1", "RA", "OBJCTRA", "PIXSCALE", "FOCALLEN", "XPIXSZ", "RADESYS",
                    "RADECSYS", "EQUINOX", "EPOCH", "LONPOLE",
                ],
                "places on the frame",
                "--radec and --pixel-scale",
            ),
        ];
        let lacking = needs.into_iter().filter(|(missing, ..)| *missing);
        lacking
            .map(|(_, what, keywords, needed_for, option)| Missing {
                what,
                keywords,
                needed_for,
                option,
                because: self.about(keywords),
            })
            .collect()
    }

    /// Remarks on values that were passed over or refused, by keyword.
    fn about(&self, keywords: &[&str]) -> Vec<Note> {
        let unusable = |n: &&Note| matches!(n.kind, NoteKind::Refused | NoteKind::Ignored);
        let about = |n: &&Note| keywords.iter().any(|k| n.concerns(k));
        self.notes.iter().filter(unusable).filter(about).cloned().collect()
    }
}

/// The pointing, or the centre of a solved frame if that lies elsewhere by more than the frame's size.
fn near_the_frame(r: &mut Reader, told: Option<DVec3>, solved: Option<FrameWcs>) -> Option<DVec3> {
    let Some(FrameWcs { wcs, .. }) = solved else { return told };
    let size = DVec2::new(r.size[0] as f64, r.size[1] as f64);
    let centre = wcs.sky((size - 1.0) / 2.0);
    if !centre.is_finite() {
        return told;
    }
    let Some(told) = told else { return Some(centre) };
    let (apart, field) = (separation(told, centre), size.length() * wcs.pixel_scale());
    if r.overrides.pointing_deg.is_some() || apart <= field {
        return Some(told);
    }
    let what = format!("{:.2} deg from the frame's centre, which is taken", apart.to_degrees());
    r.note(NoteKind::Contradictory, &["RA", "DEC", "OBJCTRA", "OBJCTDEC", "CRVAL1", "CRVAL2"], what);
    Some(centre)
}

fn track(r: &mut Reader) -> Option<DVec2> {
    let header = r.number("TRKRA").zip(r.number("TRKDEC")).map(|(ra, dec)| DVec2::new(ra, dec));
    let given = r.overrides.track_arcsec_s.map(DVec2::from_array);
    let Some(given) = given else { return header.map(|h| h * ARCSEC) };
    let cards = vec![("--track".to_owned(), format!("{},{}", given.x, given.y))];
    if !given.is_finite() {
        r.notes.push(Note { kind: NoteKind::Refused, cards, what: "finite rates are allowed".into() });
        return header.map(|h| h * ARCSEC);
    }
    let what = header.map_or("the header has none".to_owned(), |h| format!("in place of {h}"));
    r.notes.push(Note { kind: NoteKind::Overridden, cards, what });
    Some(given * ARCSEC)
}
