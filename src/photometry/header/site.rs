//! Where the telescope stands: OBSGEO-X/Y/Z (FITS Standard 4.0, sect. 8.4.1), else latitude and longitude, east
//! positive.

use super::dialect::{HEIGHT, SITE};
use super::note::NoteKind;
use super::reader::Reader;
use super::text;
use crate::astro::geodetic::Geodetic;
use crate::base::units::ARCSEC;
use glam::DVec3;

/// Two keywords may put the site this far apart \[rad\]: 1 km on the ground.
const AGREE: f64 = 32.0 * ARCSEC;

/// The site of a telescope.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Site {
    /// East longitude in (-pi, pi] \[rad\].
    pub longitude: f64,
    /// Geodetic latitude, north + \[rad\].
    pub latitude: f64,
}

/// An angle in degrees that lies within `limit`.
fn degrees(r: &mut Reader, keyword: &'static str, limit: f64) -> Option<f64> {
    let value = match r.number(keyword) {
        Some(number) => Some(number),
        None => text::angle(&r.text(keyword)?).map(|w| w.value),
    };
    let value = value.filter(|x| x.abs() <= limit);
    if value.is_none() {
        r.note(NoteKind::Refused, &[keyword], format!("an angle within {limit} deg is understood"));
    }
    value
}

/// The site, if the header tells it, and its height above the sea (or the ellipsoid) \[m\].
pub(super) fn site(r: &mut Reader) -> (Option<Site>, Option<f64>) {
    let mut taken: Option<(&'static str, Site)> = None;
    let mut height = None;
    if let [Some(x), Some(y), Some(z)] = ["OBSGEO-X", "OBSGEO-Y", "OBSGEO-Z"].map(|k| r.number(k)) {
        let place = Geodetic::of(DVec3::new(x, y, z));
        if (-500.0..=10_000.0).contains(&place.height_m) {
            taken = Some(("OBSGEO-X", Site { longitude: place.longitude, latitude: place.latitude }));
            height = Some(place.height_m);
        } else {
            let what = "no place within 10 km above and 500 m below the ellipsoid";
            r.note(NoteKind::Refused, &["OBSGEO-X", "OBSGEO-Y", "OBSGEO-Z"], what);
        }
    }
    for [latitude, longitude] in SITE {
        let (Some(lat), Some(lon)) = (degrees(r, latitude, 90.0), degrees(r, longitude, 360.0)) else { continue };
        if lat == 0.0 && lon == 0.0 {
            r.note(NoteKind::Ignored, &[latitude, longitude], "taken as not known");
            continue;
        }
        let lon = if lon > 180.0 {
            lon - 360.0
        } else if lon <= -180.0 {
            lon + 360.0
        } else {
            lon
        };
        let site = Site { longitude: lon.to_radians(), latitude: lat.to_radians() };
        match taken {
            None => taken = Some((latitude, site)),
            Some((keyword, other)) => compare(r, (keyword, other), ([latitude, longitude], site)),
        }
    }
    if r.program.is_some_and(|p| p.name == "TheSkyX") && taken.is_some_and(|(k, _)| k == "SITELAT") {
        r.note(NoteKind::Assumed, &["SITELONG"], "east is positive");
    }
    let elevation = elevation(r).or(height);
    let given = r.overrides.elevation_m;
    let elevation = r.overridden("--elevation", given, |h| (-500.0..=10_000.0).contains(&h), elevation);
    (taken.map(|(_, site)| site), elevation)
}

fn elevation(r: &mut Reader) -> Option<f64> {
    for (keyword, height) in r.numbers(&HEIGHT) {
        if (-500.0..=10_000.0).contains(&height) {
            return Some(height);
        }
        r.note(NoteKind::Refused, &[keyword], "a height of -500 to 10 000 m is understood");
    }
    None
}

fn compare(r: &mut Reader, taken: (&'static str, Site), other: ([&'static str; 2], Site)) {
    let (keyword, a) = taken;
    let ([latitude, longitude], b) = other;
    let east = (a.longitude - b.longitude).sin() * a.latitude.cos();
    if (a.latitude - b.latitude).abs() <= AGREE && east.abs() <= AGREE && (a.longitude - b.longitude).cos() > 0.0 {
        return;
    }
    let west = (a.latitude - b.latitude).abs() <= AGREE && (a.longitude + b.longitude).sin().abs() <= AGREE;
    let hint = if west { "; the longitude may be counted west" } else { "" };
    let what = format!("another place than by {keyword}, which is taken{hint}");
    r.note(NoteKind::Contradictory, &[keyword, latitude, longitude], what);
}
