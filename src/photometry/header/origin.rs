//! Which card a fact was read from: the first of those that can tell it whose value it is.

use super::dialect::{
    ELECTRONS_PER_ADU, HEIGHT, READ_NOISE, SATURATION, SEEING, SITE, TEMPERATURE, has_gain_setting,
};
use super::{Facts, Header, NoteKind};
use crate::base::units::ARCSEC;

/// What a card may tell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Gain.
    Gain,
    /// Read noise.
    ReadNoise,
    /// Level from which a pixel is saturated.
    Saturation,
    /// Level of a pixel without light.
    Bias,
    /// Diameter of the telescope.
    Aperture,
    /// Width of a point's image.
    Seeing,
    /// Latitude and longitude.
    Site,
    /// Height.
    Height,
    /// Temperature of the chip.
    Temperature,
}

/// Values agree to this share: what a conversion of units may round.
const SAME: f64 = 1e-9;

impl Facts {
    /// The card, or the command line option, that tells a quantity, with its value as written; none if the header does not tell it.
    pub fn origin(&self, header: &dyn Header, quantity: Quantity) -> Option<String> {
        let shown = |keyword: &str| {
            let number = header.number(keyword).map(|x| x.to_string());
            let value = number.or_else(|| header.text(keyword).map(|t| t.trim().to_owned()))?;
            Some(format!("{keyword} = {value}"))
        };
        let number = |keyword: &str| {
            header.number(keyword).or_else(|| header.text(keyword)?.trim().parse().ok()).filter(|x| x.is_finite())
        };
        let (option, value, keywords, units): (_, _, Vec<&str>, &[f64]) = match quantity {
            Quantity::Gain => ("--gain", self.gain_e_adu?, [&ELECTRONS_PER_ADU[..], &["GAIN"]].concat(), &[1.0]),
            Quantity::ReadNoise => ("--read-noise", self.read_noise_e?, READ_NOISE.to_vec(), &[1.0]),
            Quantity::Saturation => {
                ("--saturate", self.saturate_adu?, [&SATURATION[..], &["DATAMAX"]].concat(), &[1.0])
            }
            Quantity::Bias => ("--bias", self.bias_adu?, vec!["BIASLVL", "PEDESTAL"], &[1.0, -1.0]),
            Quantity::Aperture => ("--aperture-mm", self.aperture_m?, vec!["APTDIA"], &[1e-3, 1.0]),
            Quantity::Seeing => ("--seeing", self.seeing? / ARCSEC, SEEING.to_vec(), &[1.0]),
            Quantity::Height => ("--elevation", self.elevation_m?, HEIGHT.to_vec(), &[1.0]),
            Quantity::Temperature => ("", self.ccd_temp_c?, TEMPERATURE.to_vec(), &[1.0]),
            Quantity::Site => {
                self.site?;
                if ["OBSGEO-X", "OBSGEO-Y", "OBSGEO-Z"].iter().all(|k| number(k).is_some()) {
                    return Some("OBSGEO-X, OBSGEO-Y, OBSGEO-Z".into());
                }
                let both = |[lat, lon]: [&str; 2]| Some(format!("{}, {}", shown(lat)?, shown(lon)?));
                return SITE.iter().find_map(|pair| both(*pair));
            }
        };
        let given = self.notes.iter().any(|note| note.kind == NoteKind::Overridden && note.concerns(option));
        if given {
            return Some(option.to_owned());
        }
        let same = |x: f64| (x - value).abs() <= SAME * value.abs().max(1e-300);
        let tells = |keyword: &&str| number(keyword).is_some_and(|x| units.iter().any(|unit| same(x * unit)));
        keywords.iter().find(|k| tells(k)).and_then(|k| shown(k))
    }
}

/// True if the camera's name is that of a maker of active-pixel (CMOS) cameras, or says so itself.
pub fn is_active_pixel(header: &dyn Header) -> bool {
    header
        .text("INSTRUME")
        .is_some_and(|name| has_gain_setting(&name) || name.to_ascii_lowercase().contains("cmos"))
}
