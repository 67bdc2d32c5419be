//! The header of a frame: what a real telescope would know of its own exposure, and what the simulation adds.

use super::header::Header;
use crate::astro::angles;
use crate::astro::observer::Site;
use crate::astro::separation;
use crate::astro::time::Instant;
use crate::base::ledger::Row;
use crate::base::units::ARCSEC_PER_RAD;
use crate::camera::detector::convert::Converter;
use crate::camera::detector::dark;
use crate::camera::region::Region;
use crate::camera::scenery::Scenery;
use crate::plan::sip::SIP_TERMS;
use crate::plan::view::View;
use crate::plan::wcs::Wcs;
use crate::scene::{At, Scene, Table};
use std::f64::consts::PI;

/// Everything a header tells of.
#[derive(Debug, Clone, Copy)]
pub struct Exposure<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// SCENESHA of the scene.
    pub scene_sha: &'a str,
    /// The station.
    pub site: &'a Site,
    /// Geometry.
    pub view: &'a View,
    /// What was in the frame.
    pub scenery: &'a Scenery,
    /// The pixels stored.
    pub region: &'a Region,
    /// The graphics processor that found shadows, if one did.
    pub gpu: Option<&'a str>,
}

/// Twelve significant digits: more than any value here is known to, fewer than where two machines' mathematical
/// functions may differ.
fn rounded(value: f64) -> f64 {
    format!("{value:.11e}").parse().unwrap_or(value)
}

fn number(header: &mut Header, keyword: &str, value: f64, comment: &str) {
    header.push(keyword, rounded(value), comment);
}

/// The cards of a frame.
pub fn frame(e: &Exposure) -> Header {
    let mut header = Header::default();
    times(&mut header, e.view);
    station(&mut header, e.scene, e.site);
    header.push("BUNIT", "adu", "unit of the pixels");
    detector(&mut header, e.scene);
    sections(&mut header, e.scene, e.region);
    pointing(&mut header, e.scene, e.view, e.scenery);
    world(&mut header, &e.view.wcs.mid, e.region);
    sky(&mut header, e.view);
    simulation(&mut header, e);
    history(&mut header, &e.scenery.ledger);
    header
}

/// The charge at which a stored pixel is full, by its well or by the converter \[e-\].
pub fn saturation_e(scene: &Scene) -> f64 {
    let d = &scene.detector;
    Converter::of(d).saturation_e(d.stored_full_well_e())
}

/// The cards of a calibration frame: its kind, exposure and mean light at the centre.
pub fn calibration(scene: &Scene, scene_sha: &str, kind: &str, exposure_s: f64, mean_e: f64) -> Header {
    let mut header = Header::default();
    header.push("IMAGETYP", kind, "");
    header.push("EXPTIME", exposure_s, "[s] shutter open");
    header.push("TELESCOP", scene.station.name.as_str(), "");
    header.push("BUNIT", "adu", "unit of the pixels");
    detector(&mut header, scene);
    sections(
        &mut header,
        scene,
        &Region { x0: 0, y0: 0, width: scene.detector.stored_px()[0], height: scene.detector.stored_px()[1] },
    );
    number(&mut header, "LIGHT", mean_e, "[e] mean light per pixel at the centre");
    header.push("SIMULATD", true, "this frame was computed");
    header.push("CREATOR", concat!("nightglass ", env!("CARGO_PKG_VERSION")), "");
    header.push("SIMSEED", scene.seed as i64, "seed of all random numbers");
    header.push("SCENESHA", scene_sha, "");
    header
}

/// Where light and overscan lie in what is stored, where there is overscan.
fn sections(header: &mut Header, scene: &Scene, region: &Region) {
    let light = scene.detector.light_px()[0].saturating_sub(region.x0).min(region.width);
    if scene.detector.overscan_px == 0 || light == region.width {
        return;
    }
    let section = |from: usize, to: usize| format!("[{}:{to},1:{}]", from + 1, region.height);
    header.push("BIASSEC", section(light, region.width), "overscan");
    if light > 0 {
        header.push("DATASEC", section(0, light), "pixels that see light");
        header.push("TRIMSEC", section(0, light), "pixels that see light");
    }
}

/// The cards of a plane of means or variances, in electrons.
pub fn plane(e: &Exposure, unit: &str) -> Header {
    let mut header = Header::default();
    times(&mut header, e.view);
    header.push("BUNIT", unit, "unit of the pixels");
    world(&mut header, &e.view.wcs.mid, e.region);
    header
}

fn times(header: &mut Header, view: &View) {
    let date = |t: &Instant| t.iso_utc();
    header.push("DATE-OBS", date(&view.start), "shutter opens, UTC");
    header.push("DATE-BEG", date(&view.start), "shutter opens, UTC");
    header.push("DATE-AVG", date(&view.mid), "middle of the exposure, UTC");
    header.push("DATE-END", date(&view.end), "shutter closes, UTC");
    header.push("MJD-OBS", view.start.mjd_utc(), "[d] of DATE-OBS");
    header.push("MJD-AVG", view.mid.mjd_utc(), "[d] of DATE-AVG");
    header.push("MJD-BEG", view.start.mjd_utc(), "[d] of DATE-BEG");
    header.push("MJD-END", view.end.mjd_utc(), "[d] of DATE-END");
    header.push("TIMESYS", "UTC", "time scale");
    header.push("TREFPOS", "TOPOCENTER", "times are those at the telescope");
    header.push("EXPTIME", view.exposure_s, "[s] shutter open");
    header.push("XPOSURE", view.exposure_s, "[s] effective exposure");
}

fn station(header: &mut Header, scene: &Scene, site: &Site) {
    let s = &scene.station;
    number(header, "OBSGEO-X", site.itrf.x, "[m] ITRF");
    number(header, "OBSGEO-Y", site.itrf.y, "[m] ITRF");
    number(header, "OBSGEO-Z", site.itrf.z, "[m] ITRF");
    header.push("SITELAT", s.latitude_deg, "[deg] WGS 84 geodetic latitude");
    header.push("SITELONG", s.longitude_deg, "[deg] east longitude");
    header.push("SITEELEV", s.height_m, "[m] above the ellipsoid");
    header.push("TELESCOP", s.name.as_str(), "");
    if let Table::Named(chip) = &scene.detector.qe {
        header.push("INSTRUME", chip.as_str(), "detector");
    }
}

fn detector(header: &mut Header, scene: &Scene) {
    let d = &scene.detector;
    header.push("GAIN", d.gain_e_per_adu, "[e/adu]");
    header.push("EGAIN", d.gain_e_per_adu, "[e/adu]");
    number(header, "RDNOISE", d.read_noise_rms_e(), "[e] rms");
    number(header, "DARKCUR", dark::rate(d) * (d.binning * d.binning) as f64, "[e/s] per pixel at CCD-TEMP");
    number(header, "SATURATE", Converter::of(d).saturation_adu(d.stored_full_well_e()), "[adu]");
    header.push("BIASLVL", d.bias_adu, "[adu]");
    header.push("XPIXSZ", rounded(d.pixel_um * d.binning as f64), "[um] of a stored pixel");
    header.push("YPIXSZ", rounded(d.pixel_um * d.binning as f64), "[um] of a stored pixel");
    if d.binning > 1 {
        header.push("XBINNING", d.binning as i64, "");
        header.push("YBINNING", d.binning as i64, "");
    }
    header.push("CCD-TEMP", d.temperature_c, "[deg C]");
    let t = &scene.telescope;
    header.push("APTDIA", rounded(t.aperture_m * 1e3), "[mm] aperture");
    header.push("FOCALLEN", rounded(t.focal_length_m * 1e3), "[mm]");
    let net = PI / 4.0 * (t.aperture_m.powi(2) - t.obstruction_m.powi(2));
    number(header, "APTAREA", net * 1e6, "[mm2] net collecting area");
    if let Table::Named(filter) = &t.filter {
        header.push("FILTER", filter.as_str(), "");
    }
}

fn pointing(header: &mut Header, scene: &Scene, view: &View, scenery: &Scenery) {
    if let At::Target(name) = &scene.pointing.at {
        let name = name.as_deref().or(scene.target.first().map(|t| t.name.as_str()));
        header.push("OBJECT", name.unwrap_or_default(), "");
    }
    // what the mount was told to put at its reference place
    let offset = glam::DVec2::from_array(scene.pointing.offset_px);
    let (ra, dec) = angles(view.wcs.mid.sky(view.wcs.mid.crpix + offset));
    number(header, "RA", ra.to_degrees(), "[deg] ICRS place pointed at, mid-exposure");
    number(header, "DEC", dec.to_degrees(), "[deg] ICRS place pointed at, mid-exposure");
    number(header, "CENTALT", view.centre.elevation.to_degrees(), "[deg] apparent altitude of the centre");
    number(header, "CENTAZ", view.centre.azimuth.to_degrees(), "[deg] from north, clockwise");
    number(header, "AIRMASS", view.airmass, "Pickering 2002");
    number(header, "TRKRA", view.track_rate.x * ARCSEC_PER_RAD, "[arcsec/s] rate of the centre, dRA/dt cos Dec");
    number(header, "TRKDEC", view.track_rate.y * ARCSEC_PER_RAD, "[arcsec/s] rate of the centre, dDec/dt");
    header.push("PIXSCALE", rounded(scene.stored_scale_arcsec()), "[arcsec] of the optics");
    number(header, "SEEING", scenery.seeing_arcsec, "[arcsec] FWHM as delivered");
}

/// FITS counts pixels from 1; this is the only place that knows.
fn world(header: &mut Header, wcs: &Wcs, region: &Region) {
    let (ra, dec) = wcs.crval();
    let suffix = if wcs.sip.is_some() { "-SIP" } else { "" };
    header.push("CTYPE1", format!("RA---TAN{suffix}"), "gnomonic projection");
    header.push("CTYPE2", format!("DEC--TAN{suffix}"), "gnomonic projection");
    header.push("CUNIT1", "deg", "");
    header.push("CUNIT2", "deg", "");
    number(header, "CRVAL1", ra.to_degrees(), "[deg] right ascension at the reference pixel");
    number(header, "CRVAL2", dec.to_degrees(), "[deg] declination at the reference pixel");
    number(header, "CRPIX1", wcs.crpix.x + 1.0 - region.x0 as f64, "first pixel is 1");
    number(header, "CRPIX2", wcs.crpix.y + 1.0 - region.y0 as f64, "first pixel is 1");
    number(header, "CD1_1", wcs.cd.x_axis.x.to_degrees(), "[deg/pixel]");
    number(header, "CD1_2", wcs.cd.y_axis.x.to_degrees(), "[deg/pixel]");
    number(header, "CD2_1", wcs.cd.x_axis.y.to_degrees(), "[deg/pixel]");
    number(header, "CD2_2", wcs.cd.y_axis.y.to_degrees(), "[deg/pixel]");
    if let Some(sip) = wcs.sip {
        for (axis, terms) in [("A", sip.a), ("B", sip.b)] {
            let order = sip.order();
            header.push(&format!("{axis}_ORDER"), i64::from(order), "optics, refraction and aberration");
            for ((i, j), value) in SIP_TERMS.into_iter().zip(terms).filter(|((i, j), _)| i + j <= order) {
                number(header, &format!("{axis}_{i}_{j}"), value, "");
            }
        }
    }
    // the default is 0 where CRVAL2 is exactly 90
    header.push("LONPOLE", 180.0, "[deg] native longitude of the celestial pole");
    header.push("CROPX0", region.x0 as i64, "first column of the whole frame stored here, from 0");
    header.push("CROPY0", region.y0 as i64, "first row of the whole frame stored here, from 0");
    header.push("RADESYS", "ICRS", "");
    header.push("EQUINOX", 2000.0, "");
}

fn sky(header: &mut Header, view: &View) {
    let moon = &view.moon;
    number(header, "SUNALT", view.sun.horizontal.elevation.to_degrees(), "[deg] airless altitude of the Sun");
    number(header, "MOONALT", moon.body.horizontal.elevation.to_degrees(), "[deg] airless altitude of the Moon");
    let away = separation(view.wcs.mid.centre, moon.body.direction);
    number(header, "MOONSEP", away.to_degrees(), "[deg] Moon from the frame's centre");
    number(header, "MOONILL", 0.5 * (1.0 + moon.phase.cos()), "illuminated share of the Moon's disc");
}

fn simulation(header: &mut Header, e: &Exposure) {
    let zero_point = e.scenery.zero_point(e.view.airmass, e.view.exposure_s);
    let magzero = zero_point - 2.5 * e.scene.detector.gain_e_per_adu.log10();
    number(header, "MAGZERO", magzero, "[mag] V of a source of 1 adu in this exposure");
    header.push("SIMULATD", true, "this frame was computed");
    header.push("CREATOR", concat!("nightglass ", env!("CARGO_PKG_VERSION")), "");
    header.push("SIMSEED", e.scene.seed as i64, "seed of all random numbers");
    header.push("SCENESHA", e.scene_sha, "");
    if let Some(name) = e.gpu {
        header.push("GPUNAME", name, "found the shadows of shapes");
    }
    let means = &e.scenery.sky_means;
    for mean in means {
        number(header, mean.keyword, mean.mean_e_px, "[e] mean per pixel at the centre");
    }
    let dark = e.scenery.dark_e;
    if dark > 0.0 {
        number(header, "SKYDARK", dark, "[e] mean dark charge per pixel");
    }
    if !e.scenery.sky_is_unknown() {
        let sum = dark + means.iter().map(|m| m.mean_e_px).sum::<f64>();
        number(header, "SKYSUM", sum, "[e] sum of the SKY cards");
    }
}

fn history(header: &mut Header, ledger: &[Row]) {
    // rows that depend on the target's brightness would give it away
    let silent = ["target", "detector.full_well"];
    for row in ledger.iter().filter(|row| !row.is_needed() && !silent.contains(&row.name.as_str())) {
        header.history(format!("{}: absent, {}", row.name, row.why));
    }
}
