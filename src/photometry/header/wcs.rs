//! World coordinates of a frame: those in its header, else approximate ones from pointing, scale and rotation.
//!
//! Calabretta & Greisen 2002, A&A 395, 1077 (TAN; CD, PC and CDELT, CROTA2); Shupe et al. 2005, ASP Conf. 347, 491
//! (SIP). Of other zenithal projections, and of TAN with terms that are not understood (TPV), the linear part is
//! taken and called approximate: it is right at the reference point. Other projections, FK4 and equinoxes other
//! than J2000 are refused.

use super::dialect::{PIXEL_SCALE, ROTATION};
use super::note::{Note, NoteKind};
use super::pointing::Axes;
use super::reader::Reader;
use super::text;
use crate::astro::angles;
use crate::base::units::ARCSEC;
use crate::plan::sip::{SIP_TERMS, Sip};
use crate::plan::wcs::Wcs;
use glam::{DMat2, DVec2, DVec3};

/// World coordinates, and how good they are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameWcs {
    /// The mapping; pixels are 0-based and those stored, overscan included.
    pub wcs: Wcs,
    /// Made from pointing, scale and rotation, or without terms that are not understood: to be matched with stars.
    pub approximate: bool,
}

/// Scales may differ by this share.
const AGREE: f64 = 0.02;
/// Sides of a pixel that are understood \[rad\]: 1e-4 arcsec to 10 deg.
const SCALES: std::ops::Range<f64> = 1e-4 * ARCSEC..36_000.0 * ARCSEC;
/// A reference pixel is no farther from the first than this \[px\].
const FAR_PX: f64 = 1e6;
/// Zenithal projections, whose linear part is that of TAN.
const ZENITHAL: [&str; 9] = ["TAN", "TPV", "TNX", "ZPN", "ZPX", "ARC", "SIN", "STG", "ZEA"];

/// The world coordinates in the header, if they are complete and can be used.
pub(super) fn solved(r: &mut Reader, axes: Option<Axes>) -> Option<FrameWcs> {
    let matrix = matrix(r);
    let (Some(first), Some(second)) = (r.text("CTYPE1"), r.text("CTYPE2")) else {
        if matrix.is_some() {
            r.note(NoteKind::Refused, &["CTYPE1", "CTYPE2"], "world coordinates without a projection");
        }
        return None;
    };
    let (code, swapped) = projection(r, &first, &second)?;
    let numbers = ["CRVAL1", "CRVAL2", "CRPIX1", "CRPIX2"].map(|k| r.number(k));
    let ([Some(v1), Some(v2), Some(p1), Some(p2)], Some(matrix)) = (numbers, matrix) else {
        let keywords = ["CTYPE1", "CRVAL1", "CRVAL2", "CRPIX1", "CRPIX2"];
        let lacks = if matrix.is_none() { "CD, or CDELT with PC or CROTA2" } else { "CRVAL or CRPIX" };
        r.note(NoteKind::Ignored, &keywords, format!("world coordinates without {lacks}"));
        return None;
    };
    if axes != Some(Axes::Icrs) {
        let what = "world coordinates in the ICRS or FK5 of J2000 are understood";
        r.note(NoteKind::Refused, &["RADESYS", "RADECSYS", "EQUINOX", "EPOCH"], what);
        return None;
    }
    if r.number("LONPOLE").is_some_and(|x| x != 180.0) {
        r.note(NoteKind::Refused, &["LONPOLE"], "180 deg is understood");
        return None;
    }
    let unit = [unit(r, "CUNIT1")?, unit(r, "CUNIT2")?];
    let rows = [matrix[0] * unit[0], matrix[1] * unit[1]];
    let values = [v1 * unit[0], v2 * unit[1]];
    let (rows, [ra, dec]) = if swapped { ([rows[1], rows[0]], [values[1], values[0]]) } else { (rows, values) };
    let cd = DMat2::from_cols(DVec2::new(rows[0].x, rows[1].x), DVec2::new(rows[0].y, rows[1].y));
    if !SCALES.contains(&cd.determinant().abs().sqrt()) {
        r.note(NoteKind::Refused, &["CD1_1", "CD2_2", "CDELT1"], "the matrix is singular or no scale of pixels");
        return None;
    }
    if p1.abs().max(p2.abs()) > FAR_PX {
        r.note(NoteKind::Refused, &["CRPIX1", "CRPIX2"], "a reference pixel within 1e6 px is understood");
        return None;
    }
    if dec.abs() > std::f64::consts::FRAC_PI_2 {
        r.note(NoteKind::Refused, &["CRVAL1", "CRVAL2"], "no right ascension and declination");
        return None;
    }
    let (sip, whole) = distortion(r, &code, first.ends_with("-SIP") || second.ends_with("-SIP"));
    let wcs = Wcs::new(ra, dec, DVec2::new(p1, p2) - 1.0, cd, sip);
    let wcs = FrameWcs { wcs, approximate: !whole };
    scale_agrees(r, &wcs);
    Some(wcs)
}

/// Code of the projection, and true if declination comes first.
fn projection(r: &mut Reader, first: &str, second: &str) -> Option<(String, bool)> {
    let parts = |text: &str| {
        let axis = text.get(..5)?.trim_end_matches('-').to_owned();
        Some((axis, text.get(5..8)?.trim_end_matches('-').to_owned()))
    };
    let found = match (parts(first), parts(second)) {
        (Some((a, code)), Some((b, other))) if code == other && ZENITHAL.contains(&code.as_str()) => {
            match (a.as_str(), b.as_str()) {
                ("RA", "DEC") => Some((code, false)),
                ("DEC", "RA") => Some((code, true)),
                _ => None,
            }
        }
        _ => None,
    };
    if found.is_none() {
        let what = "RA and DEC in TAN or another zenithal projection are understood";
        r.note(NoteKind::Refused, &["CTYPE1", "CTYPE2"], what);
    }
    found
}

/// The unit of an axis \[rad\]; degrees if none is told.
fn unit(r: &mut Reader, keyword: &'static str) -> Option<f64> {
    let text = r.text(keyword).unwrap_or_default().to_ascii_lowercase();
    match text.as_str() {
        "" | "deg" | "degree" | "degrees" => Some(1f64.to_radians()),
        "arcmin" => Some(60.0 * ARCSEC),
        "arcsec" => Some(ARCSEC),
        "rad" => Some(1.0),
        _ => {
            r.note(NoteKind::Refused, &[keyword], "deg, arcmin, arcsec and rad are understood");
            None
        }
    }
}

/// Rows of the linear part, per pixel: CD, or PC times CDELT, or CROTA2 with CDELT.
fn matrix(r: &Reader) -> Option<[DVec2; 2]> {
    let four = |keys: [&str; 4], default: [f64; 4]| {
        let told = keys.map(|k| r.number(k));
        let value = |k: usize| told[k].unwrap_or(default[k]);
        let rows = [DVec2::new(value(0), value(1)), DVec2::new(value(2), value(3))];
        told.iter().any(Option::is_some).then_some(rows)
    };
    if let Some(cd) = four(["CD1_1", "CD1_2", "CD2_1", "CD2_2"], [0.0; 4]) {
        return Some(cd);
    }
    let pc = four(["PC1_1", "PC1_2", "PC2_1", "PC2_2"], [1.0, 0.0, 0.0, 1.0]);
    let delta = match (r.number("CDELT1"), r.number("CDELT2")) {
        (Some(x), Some(y)) => DVec2::new(x, y),
        // the default of CDELT, where there is another sign of world coordinates
        (None, None) if pc.is_some() => DVec2::ONE,
        _ => return None,
    };
    if let Some([a, b]) = pc {
        return Some([a * delta.x, b * delta.y]);
    }
    let (sin, cos) = r.number("CROTA2").unwrap_or(0.0).to_radians().sin_cos();
    Some([DVec2::new(delta.x * cos, -delta.y * sin), DVec2::new(delta.x * sin, delta.y * cos)])
}

/// The distortion that is understood, and true if that is all of it.
fn distortion(r: &mut Reader, code: &str, sip_told: bool) -> (Option<Sip>, bool) {
    if !matches!(code, "TAN" | "TPV") {
        r.note(NoteKind::Refused, &["CTYPE1"], "not TAN: its linear part is taken, approximate");
        return (None, false);
    }
    // of plain TAN, the first five of axis 1 tell only where the pole is
    let bends = |axis: usize, m: usize, value: f64| match (axis, m) {
        (_, 1) => code == "TPV" && value != 1.0,
        (1, 0..=4) => code == "TPV" && value != 0.0,
        _ => value != 0.0,
    };
    for axis in 1..=2 {
        for m in 0..40 {
            let keyword = format!("PV{axis}_{m}");
            if r.number(&keyword).is_some_and(|value| bends(axis, m, value)) {
                let what = "distortion of TPV is not understood: the linear part is taken, approximate";
                r.note(NoteKind::Refused, &[&keyword], what);
                return (None, false);
            }
        }
    }
    let mut sip = Sip::default();
    for axis in ["A", "B"] {
        for (i, j) in (0..=9).flat_map(|i| (0..=9).map(move |j| (i, j))) {
            let keyword = format!("{axis}_{i}_{j}");
            let Some(value) = r.number(&keyword).filter(|c| *c != 0.0) else { continue };
            let terms = if axis == "A" { &mut sip.a } else { &mut sip.b };
            match SIP_TERMS.iter().position(|term| *term == (i, j)) {
                Some(k) => terms[k] = value,
                None => {
                    let what = "SIP terms of orders 2 to 5 are understood: the linear part is taken, approximate";
                    r.note(NoteKind::Refused, &[&keyword], what);
                    return (None, false);
                }
            }
        }
    }
    if sip == Sip::default() {
        return (None, true);
    }
    if !sip_told {
        r.note(
            NoteKind::Contradictory,
            &["CTYPE1", "A_ORDER"],
            "SIP terms without -SIP in the type; they are used",
        );
    }
    (Some(sip), true)
}

fn scale_agrees(r: &mut Reader, wcs: &FrameWcs) {
    let scale = wcs.wcs.pixel_scale() / ARCSEC;
    for (keyword, told) in r.numbers(&PIXEL_SCALE).into_iter().filter(|(_, x)| *x > 0.0) {
        if (told / scale - 1.0).abs() > AGREE {
            let what = format!("{scale:.4} arcsec by the world coordinates, which are taken");
            r.note(NoteKind::Contradictory, &[keyword], what);
        }
    }
}

/// How a camera lies on the sky.
#[derive(Debug, Clone, Copy)]
struct Camera {
    /// Sides of a pixel \[rad\].
    scale: DVec2,
    /// Position angle of +y \[rad\].
    rotation: f64,
    /// East is where +x goes if +y goes north.
    mirrored: bool,
}

/// World coordinates with the user's scale, rotation and parity, and where they are not given those of `solved` or
/// of the header about the pointing; none if there is nothing to make them of.
pub(super) fn complete(
    r: &mut Reader,
    solved: Option<FrameWcs>,
    pointing: Option<DVec3>,
    focal_m: Option<f64>,
) -> Option<FrameWcs> {
    let o = r.overrides;
    let told = o.pixel_scale_arcsec.is_some() || o.rotation_deg.is_some() || o.mirrored.is_some();
    if let Some(solved) = solved
        && !told
    {
        return Some(solved);
    }
    let middle = DVec2::new(r.size[0] as f64 - 1.0, r.size[1] as f64 - 1.0) / 2.0;
    let (centre, crpix, base) = match solved {
        Some(FrameWcs { wcs, .. }) => {
            let rotation = wcs.cd.y_axis.x.atan2(wcs.cd.y_axis.y);
            let scale = DVec2::splat(wcs.pixel_scale());
            let base = Camera { scale, rotation, mirrored: wcs.cd.determinant() > 0.0 };
            (wcs.centre, wcs.crpix, base)
        }
        None => {
            // without a direction the notes on scale and rotation would only distract
            let centre = pointing?;
            let scale = match o.pixel_scale_arcsec {
                Some(_) => DVec2::splat(ARCSEC),
                None => scale(r, focal_m)?,
            };
            let (rotation, mirrored) = orientation(r);
            (centre, middle, Camera { scale, rotation, mirrored })
        }
    };
    let camera = overridden(r, base)?;
    let (sin, cos) = camera.rotation.sin_cos();
    let x = DVec2::new(-cos, sin) * if camera.mirrored { -1.0 } else { 1.0 };
    let cd = DMat2::from_cols(x * camera.scale.x, DVec2::new(sin, cos) * camera.scale.y);
    let (ra, dec) = angles(centre);
    Some(FrameWcs { wcs: Wcs::new(ra, dec, crpix, cd, None), approximate: true })
}

fn overridden(r: &mut Reader, base: Camera) -> Option<Camera> {
    let mut camera = base;
    let o = r.overrides;
    let header = (base.scale.x * base.scale.y).sqrt() / ARCSEC;
    let allowed = |s: f64| SCALES.contains(&(s * ARCSEC));
    if let Some(scale) = r.overridden("--pixel-scale", o.pixel_scale_arcsec, allowed, None) {
        camera.scale = DVec2::splat(scale * ARCSEC);
    } else if !allowed(header) {
        return None;
    }
    let rotation = base.rotation.to_degrees();
    let turned = r.overridden("--rotation", o.rotation_deg, |x| x.abs() <= 360.0, Some(rotation));
    camera.rotation = turned.unwrap_or(rotation).to_radians();
    if let Some(mirrored) = o.mirrored {
        camera.mirrored = mirrored;
        let cards = vec![("--mirrored".to_owned(), mirrored.to_string())];
        let what = format!("in place of {}", base.mirrored);
        r.notes.push(Note { kind: NoteKind::Overridden, cards, what });
    }
    Some(camera)
}

/// Sides of a pixel \[rad\]: as told, else size over focal length. XPIXSZ includes binning (SBFITSEXT 1.0).
fn scale(r: &mut Reader, focal_m: Option<f64>) -> Option<DVec2> {
    let allowed = |s: f64| SCALES.contains(&(s * ARCSEC));
    let told = r.first(&PIXEL_SCALE, allowed, "1e-4 to 36 000 arcsec are understood");
    let x_um = r.number("XPIXSZ").filter(|x| *x > 0.0);
    let y_um = r.number("YPIXSZ").filter(|x| *x > 0.0).or(x_um);
    let optics = x_um.zip(y_um).zip(focal_m).map(|((x, y), f)| DVec2::new(x, y) * 1e-6 / f);
    let optics = optics.filter(|s| SCALES.contains(&s.x) && SCALES.contains(&s.y));
    match (told, optics) {
        (Some((keyword, told)), optics) => {
            let ratio = optics.map_or(1.0, |s| told * ARCSEC / s.x);
            if (ratio - 1.0).abs() > AGREE {
                let what = format!("{ratio:.3} times what pixels and focal length give; {keyword} is taken");
                r.note(NoteKind::Contradictory, &[keyword, "XPIXSZ", "FOCALLEN", "XBINNING"], what);
            }
            Some(DVec2::splat(told * ARCSEC))
        }
        (None, Some(scale)) => {
            let what = format!("{:.4} arcsec a pixel, binning included in its size", scale.x / ARCSEC);
            r.note(NoteKind::Assumed, &["XPIXSZ", "FOCALLEN"], what);
            Some(scale)
        }
        (None, None) => None,
    }
}

/// Position angle of +y \[rad\], and whether the frame is mirrored, from the picture's own up and the order of its
/// rows.
fn orientation(r: &mut Reader) -> (f64, bool) {
    let told = ROTATION.iter().find_map(|k| {
        let degrees = r.number(k).or_else(|| Some(text::angle(&r.text(k)?)?.value));
        degrees.filter(|x| x.abs() <= 360.0).map(|x| (*k, x))
    });
    let (keyword, up) = told.unwrap_or((ROTATION[0], 0.0));
    let order = r.text("ROWORDER").map(|s| s.to_ascii_uppercase());
    let top_down = order.map_or(r.program.is_some_and(|p| p.top_down), |s| s.starts_with("TOP"));
    let flipstat = r.text("FLIPSTAT").unwrap_or_default().to_ascii_lowercase();
    let flip = flipstat.contains("flip") != (r.flag("FLIPPED") == Some(true));
    // rows from the top and a flip both turn y about; a mirror turns x
    let upside_down = top_down != flip;
    let mirrored = upside_down != flipstat.contains("mirror");
    let rotation = if upside_down { up + 180.0 } else { up };
    let what = format!(
        "world coordinates made up: +y at position angle {:.1} deg, {}; half a turn off behind a pier flip",
        rotation.rem_euclid(360.0),
        if mirrored { "mirrored" } else { "not mirrored" }
    );
    r.note(NoteKind::Assumed, &[keyword, "ROWORDER", "FLIPSTAT"], what);
    (rotation.to_radians(), mirrored)
}
