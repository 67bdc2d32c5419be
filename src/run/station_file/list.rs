//! Site and telescope by a header's keywords.

use super::{Entry, Origin, Source};
use crate::base::units::{ARCSEC, ARCSEC_PER_RAD};
use crate::photometry::header::{NoteKind, Quantity};
use std::f64::consts::PI;

/// Wavelength of the seeing \[m\].
const SEEING_M: f64 = 550e-9;

/// The keys so far.
pub(super) struct List<'s, 'f> {
    pub source: &'s Source<'f>,
    pub entries: Vec<Entry>,
}

impl<'s, 'f> List<'s, 'f> {
    pub fn new(source: &'s Source<'f>) -> Self {
        Self { source, entries: Vec::new() }
    }

    pub fn push(
        &mut self,
        key: &'static str,
        value: impl Into<toml::Value>,
        origin: Origin,
        why: impl Into<String>,
    ) {
        self.entries.push(Entry { key, value: value.into(), origin, why: why.into() });
    }

    pub fn number(&self, keyword: &str) -> Option<f64> {
        let header = self.source.header;
        header.number(keyword).or_else(|| header.text(keyword)?.trim().parse().ok()).filter(|x| x.is_finite())
    }

    /// The first keyword with a number in a range.
    pub fn first(&self, keywords: &[&'static str], low: f64, high: f64) -> Option<(&'static str, f64)> {
        keywords.iter().find_map(|k| Some((*k, self.number(k).filter(|x| (low..=high).contains(x))?)))
    }

    /// A fact in a range and the card that tells it.
    pub fn fact(&self, value: Option<f64>, [low, high]: [f64; 2], quantity: Quantity) -> Option<(f64, String)> {
        let value = value.filter(|x| *x > low && *x <= high)?;
        let told = self.source.facts.origin(self.source.header, quantity);
        Some((value, told.unwrap_or_else(|| self.made_of(quantity))))
    }

    /// The note of the header's reader on a value that no single card tells.
    fn made_of(&self, quantity: Quantity) -> String {
        let keyword = match quantity {
            Quantity::Aperture => "FOCALLEN",
            Quantity::Height => return "OBSGEO-X, OBSGEO-Y, OBSGEO-Z".into(),
            Quantity::Saturation => "BITPIX",
            _ => "CALSTAT",
        };
        let note = self.source.facts.notes.iter().find(|n| n.kind == NoteKind::Assumed && n.concerns(keyword));
        note.map_or_else(|| "the header".into(), |note| note.what.clone())
    }

    pub fn site(&mut self) {
        let facts = self.source.facts;
        let named = ["OBSERVAT", "SITENAME", "TELESCOP"].iter().find_map(|k| {
            let text = self.source.header.text(k)?;
            let text = text.trim().replace(char::is_control, " ");
            (!text.is_empty()).then_some((*k, text))
        });
        match named {
            Some((keyword, name)) => self.push("station.name", name, Origin::Keyword, keyword),
            None => self.push("station.name", "my station", Origin::FillIn, "no TELESCOP"),
        }
        match (facts.site, facts.origin(self.source.header, Quantity::Site)) {
            (Some(site), told) => {
                let told = told.unwrap_or_default();
                let degrees = |x: f64| digits(x.to_degrees(), 7);
                self.push("station.latitude_deg", degrees(site.latitude), Origin::Keyword, told.clone());
                self.push("station.longitude_deg", degrees(site.longitude), Origin::Keyword, told);
            }
            (None, _) => {
                self.push("station.latitude_deg", 0.0, Origin::FillIn, "no SITELAT");
                self.push("station.longitude_deg", 0.0, Origin::FillIn, "no SITELONG");
            }
        }
        match self.fact(facts.elevation_m, [-500.0, 10_000.0], Quantity::Height) {
            Some((height, told)) => self.push("station.height_m", digits(height, 2), Origin::Keyword, told),
            None => self.push("station.height_m", 0.0, Origin::FillIn, "no SITEELEV"),
        }
        for (key, keywords, low, high, unit) in [
            ("station.pressure_hpa", &["AOCBAROM", "PRESSURE", "BAROM"][..], 400.0, 1100.0, 1.0),
            ("station.temperature_c", &["AOCAMBT", "AMBTEMP", "TEMPAMB"], -80.0, 60.0, 1.0),
            ("station.humidity", &["AOCHUM", "HUMIDITY"], 1.0, 100.0, 0.01),
        ] {
            if let Some((keyword, value)) = self.first(keywords, low, high) {
                self.push(key, digits(value * unit, 4), Origin::Keyword, format!("{keyword} = {value}"));
            }
        }
        let seeing = self.fact(facts.seeing.map(|s| s / ARCSEC), [0.0, 60.0], Quantity::Seeing);
        let airmass = facts.airmass.unwrap_or(1.0);
        let diffraction = facts.aperture_m.map_or(0.0, |d| 1.029 * SEEING_M / d * ARCSEC_PER_RAD);
        match seeing.map(|(s, told)| ((s * s - diffraction * diffraction).sqrt(), told)) {
            Some((seeing, told)) if seeing > 0.0 => {
                let zenith = digits(seeing / airmass.powf(0.6), 3).max(0.01);
                let why = format!("{told} at airmass {airmass:.2}, brought to the zenith, without diffraction");
                self.push("station.seeing_arcsec", zenith, Origin::Keyword, why);
            }
            _ => self.push(
                "station.seeing_arcsec",
                2.5,
                Origin::Assumed,
                "no SEEING; a width at the zenith of 2 to 3 arcsec is usual",
            ),
        }
    }

    pub fn telescope(&mut self) {
        let facts = self.source.facts;
        let aperture = self.fact(facts.aperture_m, [0.0, 100.0], Quantity::Aperture);
        match &aperture {
            Some((d, told)) => self.push("telescope.aperture_m", digits(*d, 6), Origin::Keyword, told.clone()),
            None => self.push("telescope.aperture_m", 0.3, Origin::FillIn, "no APTDIA"),
        }
        let net =
            self.number("APTAREA").zip(aperture.as_ref()).map(|(area, (d, _))| (area, d * d - 4e-6 * area / PI));
        match net.filter(|(area, left)| *area > 0.0 && *left >= -1e-6) {
            Some((area, left)) => {
                let why = format!("APTAREA = {area} mm2 net of {:.0}", PI / 4.0 * (left + 4e-6 * area / PI) * 1e6);
                self.push("telescope.obstruction_m", digits(left.max(0.0).sqrt(), 6), Origin::Keyword, why);
            }
            None => self.push(
                "telescope.obstruction_m",
                0.0,
                Origin::Assumed,
                "no APTAREA; diameter of the secondary, 0: none",
            ),
        }
        let (scale, origin, why) = self.scale();
        self.push("telescope.plate_scale_arcsec", scale, origin, why);
        self.push(
            "telescope.throughput",
            0.5,
            Origin::Assumed,
            "no keyword tells it; mirrors, glass and dust, without QE and filter",
        );
        self.filter();
        if let Some(mapped) = facts.wcs.filter(|w| !w.approximate) {
            let y = mapped.wcs.cd.y_axis;
            let angle = digits(y.x.atan2(y.y).to_degrees(), 3);
            self.push("telescope.position_angle_deg", angle, Origin::Keyword, "the header's world coordinates");
            let mirrored = mapped.wcs.cd.determinant() > 0.0;
            self.push("telescope.mirrored", mirrored, Origin::Keyword, "the header's world coordinates");
        }
    }

    pub fn binning(&self) -> f64 {
        f64::from(self.source.facts.binning.map_or(1, |b| b[0]))
    }

    /// Arcseconds of an unbinned pixel.
    fn scale(&self) -> (f64, Origin, String) {
        let facts = self.source.facts;
        let binning = self.binning();
        let of = |stored: f64| digits(stored / binning, 9);
        let binned = if binning > 1.0 { format!(", over a binning of {binning}") } else { String::new() };
        let own = self.first(&["PIXSCALE"], 1e-4, 3600.0).filter(|_| facts.program == Some("nightglass"));
        if let Some((keyword, scale)) = own {
            return (of(scale), Origin::Keyword, format!("{keyword} = {scale}, of the optics{binned}"));
        }
        if let Some(mapped) = facts.wcs {
            let scale = mapped.wcs.pixel_scale() / ARCSEC;
            let why = if !mapped.approximate {
                "the header's world coordinates".to_owned()
            } else if let Some((keyword, told)) =
                self.first(&["PIXSCALE", "SECPIX", "SECPIX1", "SCALE", "CCDSCALE"], 1e-4, 3600.0)
            {
                format!("{keyword} = {told}")
            } else {
                format!("XPIXSZ = {} over FOCALLEN = {}", self.shown("XPIXSZ"), self.shown("FOCALLEN"))
            };
            if (1e-4..=3600.0).contains(&(scale / binning)) {
                return (of(scale), Origin::Keyword, why + &binned);
            }
        }
        let optics = self.number("XPIXSZ").zip(facts.focal_length_m).map(|(um, f)| um * 1e-6 / f * ARCSEC_PER_RAD);
        match optics.filter(|s| (1e-4..=3600.0).contains(&(s / binning))) {
            Some(scale) => {
                let why = format!(
                    "XPIXSZ = {} over FOCALLEN = {}{binned}",
                    self.shown("XPIXSZ"),
                    self.shown("FOCALLEN")
                );
                (of(scale), Origin::Keyword, why)
            }
            None => (1.0, Origin::FillIn, "no world coordinates, PIXSCALE, or XPIXSZ with FOCALLEN".into()),
        }
    }

    fn shown(&self, keyword: &str) -> String {
        self.number(keyword).map_or_else(|| "?".into(), |x| x.to_string())
    }

    fn filter(&mut self) {
        let told = self.source.facts.filter.clone();
        let name = told.as_deref().unwrap_or_default().trim().replace(char::is_control, " ");
        let own = self.source.facts.program == Some("nightglass") && name == "G";
        match name.as_str() {
            "B" | "V" | "R" | "I" => {
                let why = format!(
                    "FILTER = {name}, taken as of Johnson and Cousins; of another kind: a CSV of nm, transmission"
                );
                self.push("telescope.filter", name, Origin::Keyword, why);
            }
            _ if own => self.push("telescope.filter", "G", Origin::Keyword, "FILTER = G"),
            "" => self.push("telescope.filter", "none", Origin::Assumed, "no FILTER"),
            _ if ["none", "clear", "c", "l", "lum", "luminance", "open", "empty"]
                .contains(&name.to_ascii_lowercase().as_str()) =>
            {
                self.push("telescope.filter", "none", Origin::Keyword, format!("FILTER = {name}"));
            }
            _ => self.push(
                "telescope.filter",
                "none",
                Origin::FillIn,
                format!("FILTER = {name} is no built-in one; a CSV of nm, transmission"),
            ),
        }
    }
}

/// A number rounded to so many decimals.
pub(super) fn digits(value: f64, decimals: usize) -> f64 {
    format!("{value:.decimals$}").parse().unwrap_or(value)
}
