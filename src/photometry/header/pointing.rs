//! Where the telescope pointed, as a direction in the ICRS.
//!
//! The axes are those of RADESYS and EQUINOX with the defaults of FITS Standard 4.0, sect. 8.3: none of both =
//! ICRS, an equinox before 1984 = FK4. FK5 of J2000 is taken as the ICRS (they differ by 0.03 arcsec). Places of
//! another equinox are precessed with the angles of Lieske et al. 1977, A&A 58, 1; FK4
//! places likewise, which leaves 2 arcsec. Nutation and aberration of apparent places, below 40 arcsec, stay.

use super::dialect::POINTING;
use super::note::{Note, NoteKind};
use super::reader::Reader;
use super::text;
use crate::astro::{angles, direction};
use crate::base::units::ARCSEC;
use glam::DVec3;

/// The axes of right ascension and declination in a header.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Axes {
    /// ICRS, or FK5 of J2000.
    Icrs,
    /// Mean equator and equinox of that year.
    Mean(f64),
    /// Of the FK4 of that year.
    Fk4(f64),
}

impl Axes {
    /// By RADESYS and EQUINOX, or what older programs call them; none: no known system.
    pub fn of(r: &mut Reader) -> Option<Self> {
        let system = r.text("RADESYS").or_else(|| r.text("RADECSYS")).map(|s| s.to_ascii_uppercase());
        let equinox = ["EQUINOX", "EPOCH"].into_iter().find_map(|k| {
            let text = r.text(k).unwrap_or_default();
            let number = r.number(k).or_else(|| text.trim_start_matches(['J', 'B', 'j', 'b']).parse().ok());
            number.filter(|year| (1800.0..=2200.0).contains(year))
        });
        let of_year = |year: f64| if (year - 2000.0).abs() < 0.01 { Self::Icrs } else { Self::Mean(year) };
        Some(match (system.as_deref(), equinox) {
            (Some("ICRS"), _) | (None, None) => Self::Icrs,
            (Some("FK5"), year) => of_year(year.unwrap_or(2000.0)),
            (Some("FK4" | "FK4-NO-E"), year) => Self::Fk4(year.unwrap_or(1950.0)),
            (None, Some(year)) if year < 1984.0 => Self::Fk4(year),
            (None, Some(year)) => of_year(year),
            (Some(_), _) => {
                let keyword = if r.text("RADESYS").is_some() { "RADESYS" } else { "RADECSYS" };
                r.note(NoteKind::Refused, &[keyword], "ICRS, FK5 and FK4 are understood");
                return None;
            }
        })
    }

    /// A direction on these axes as one in the ICRS.
    fn to_icrs(self, place: DVec3) -> DVec3 {
        match self {
            Self::Icrs => place,
            Self::Mean(year) | Self::Fk4(year) => to_j2000(place, year),
        }
    }
}

/// A direction on the mean equator and equinox of `year` as one of J2000.
fn to_j2000(place: DVec3, year: f64) -> DVec3 {
    let t = (year - 2000.0) / 100.0;
    let zeta = (2306.2181 + (0.30188 + 0.017998 * t) * t) * t * ARCSEC;
    let z = (2306.2181 + (1.09468 + 0.018203 * t) * t) * t * ARCSEC;
    let theta = (2004.3109 - (0.42665 + 0.041833 * t) * t) * t * ARCSEC;
    let (ra, dec) = angles(place);
    let of_date = direction(ra - z, dec);
    let (sin, cos) = theta.sin_cos();
    let turned = DVec3::new(cos * of_date.x + sin * of_date.z, of_date.y, cos * of_date.z - sin * of_date.x);
    let (ra, dec) = angles(turned);
    direction(ra - zeta, dec)
}

/// Right ascension \[deg\] as the header has it: a text with minutes is in hours, a number in degrees.
fn right_ascension(r: &Reader, keyword: &str) -> Option<f64> {
    let hours = r.program.is_some_and(|p| p.ra_in_hours);
    let degrees = match r.number(keyword) {
        Some(number) => number * if hours { 15.0 } else { 1.0 },
        // beyond 24 it can only be degrees
        None => {
            text::angle(&r.text(keyword)?).map(|w| w.value * if w.value.abs() <= 24.0 { 15.0 } else { 1.0 })?
        }
    };
    (-180.0..=360.0).contains(&degrees).then_some(degrees)
}

fn declination(r: &Reader, keyword: &str) -> Option<f64> {
    let degrees = r.number(keyword).or_else(|| Some(text::angle(&r.text(keyword)?)?.value))?;
    (-90.0..=90.0).contains(&degrees).then_some(degrees)
}

/// A number under RA that agrees with OBJCTRA only if it is in hours.
fn really_hours(r: &Reader, keyword: &str, degrees: f64) -> bool {
    let Some(other) = right_ascension(r, "OBJCTRA").filter(|_| r.number(keyword).is_some()) else { return false };
    let near = |x: f64| (x - other).abs() < 0.2;
    !near(degrees) && near(15.0 * degrees)
}

/// The place that the user gives, else the first that the header has. `date` is in years since 2000.
pub(super) fn pointing(r: &mut Reader, axes: Option<Axes>, date: Option<f64>) -> Option<DVec3> {
    if let Some([ra, dec]) = r.overrides.pointing_deg {
        let cards = vec![("--radec".to_owned(), format!("{ra},{dec}"))];
        if ra.abs() <= 360.0 && dec.abs() <= 90.0 {
            let what = format!("in place of RA = {}, DEC = {}", r.shown("RA"), r.shown("DEC"));
            r.notes.push(Note { kind: NoteKind::Overridden, cards, what });
            return Some(direction(ra.to_radians(), dec.to_radians()));
        }
        let what = "-360 to 360 and -90 to 90 deg are allowed; the header counts".to_owned();
        r.notes.push(Note { kind: NoteKind::Refused, cards, what });
    }
    let axes = axes?;
    for [ra_key, dec_key] in POINTING {
        if !r.has(ra_key) || !r.has(dec_key) {
            continue;
        }
        let (Some(mut ra), Some(dec)) = (right_ascension(r, ra_key), declination(r, dec_key)) else {
            r.note(NoteKind::Refused, &[ra_key, dec_key], "no right ascension and declination");
            continue;
        };
        if ra == 0.0 && dec == 0.0 {
            r.note(NoteKind::Ignored, &[ra_key, dec_key], "taken as not known");
            continue;
        }
        if really_hours(r, ra_key, ra) {
            ra *= 15.0;
            r.note(NoteKind::Assumed, &[ra_key, "OBJCTRA"], "a number in hours, as both agree then");
        }
        doubt(r, [ra_key, dec_key], axes, date);
        return Some(axes.to_icrs(direction(ra.to_radians(), dec.to_radians())));
    }
    None
}

/// What the choice of axes means for the place.
fn doubt(r: &mut Reader, keywords: [&'static str; 2], axes: Axes, date: Option<f64>) {
    let told = ["RADESYS", "RADECSYS", "EQUINOX", "EPOCH"].iter().any(|k| r.has(k));
    let ours = r.program.is_some_and(|p| p.name == "nightglass");
    match axes {
        Axes::Mean(year) => {
            r.note(NoteKind::Assumed, &keywords, format!("of the equinox {year}: precessed to J2000"));
        }
        Axes::Fk4(year) => {
            r.note(NoteKind::Assumed, &keywords, format!("FK4 of {year}: precessed to J2000, to 2 arcsec"));
        }
        Axes::Icrs if !told && !ours && keywords[0] != "CRVAL1" => {
            // 50.3 arcsec a year
            let off = date.map_or(String::new(), |years| format!(" by up to {:.1} arcmin", 0.84 * years.abs()));
            let what = format!("no EQUINOX: taken as J2000; a mount's place of date would be off{off}");
            r.note(NoteKind::Assumed, &keywords, what);
        }
        Axes::Icrs => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::astro::separation;

    /// Meeus 1998, Astronomical Algorithms, example 21.b: theta Persei, J2000 with proper motion removed to the
    /// epoch 2028 Nov. 13.19: RA 41.547214, Dec +49.348483 of date from 41.054063, +49.227750 at J2000.
    #[test]
    fn a_place_of_date_precesses_to_j2000() {
        let at = |ra: f64, dec: f64| direction(ra.to_radians(), dec.to_radians());
        let year = 2000.0 + (2_462_088.69 - 2_451_545.0) / 365.25;
        let off = separation(to_j2000(at(41.547214, 49.348483), year), at(41.054063, 49.227750));
        assert!(off < 0.02 * ARCSEC, "{} arcsec", off / ARCSEC);
        // at the pole too
        let pole = to_j2000(at(0.0, 90.0), 2050.0);
        assert!((separation(pole, DVec3::Z) / ARCSEC - 1002.0).abs() < 1.0);
    }
}
