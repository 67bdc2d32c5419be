//! Exposure, gain, noise, levels and optics by their keywords.

use super::dialect::{self, COMBINED, ELECTRONS_PER_ADU, EXPOSURE, READ_NOISE, SATURATION, SEEING};
use super::note::NoteKind;
use super::reader::Reader;
use crate::base::units::ARCSEC;
use std::f64::consts::PI;

/// Largest number taken as electrons per adu: a well of 1.6 million electrons on 16 bits. Beyond, it is a driver's
/// setting.
const MOST_E_ADU: f64 = 25.0;
/// Longest exposure \[s\].
const LONGEST_S: f64 = 86_400.0;
/// Largest diameter and focal length \[mm\].
const LONGEST_MM: f64 = 1e6;
/// Values of one quantity under two keywords may differ by this share.
const AGREE: f64 = 0.01;

fn agree(a: f64, b: f64) -> bool {
    (a - b).abs() <= AGREE * a.abs().max(b.abs())
}

/// Exposure time \[s\].
pub(super) fn exposure(r: &mut Reader) -> Option<f64> {
    let allowed = |t: f64| (0.0..=LONGEST_S).contains(&t);
    let found = r.first(&EXPOSURE, allowed, "an exposure of 0 s to a day is understood");
    if let Some((keyword, taken)) = found {
        for (other, value) in r.numbers(&EXPOSURE) {
            if other != keyword && allowed(value) && !agree(value, taken) {
                r.note(NoteKind::Contradictory, &[keyword, other], format!("{keyword} is taken"));
            }
        }
    }
    for (keyword, count) in r.numbers(&COMBINED) {
        if count > 1.0 {
            let what = "frames were combined; exposure, gain and read noise are taken as they stand";
            r.note(NoteKind::Assumed, &[keyword], what);
        }
    }
    let given = r.overrides.exptime_s;
    r.overridden("--exptime", given, allowed, found.map(|(_, t)| t))
}

/// Gain \[e/adu\]: EGAIN and the like; GAIN only where it is no setting of a driver.
pub(super) fn gain(r: &mut Reader) -> Option<f64> {
    let ours = r.program.is_some_and(|p| p.name == "nightglass");
    let most = if ours { f64::INFINITY } else { MOST_E_ADU };
    let allowed = |g: f64| g > 0.0 && g <= most;
    let reason = format!("a gain above 0 and up to {MOST_E_ADU} e/adu is understood; more is a driver's setting");
    let sure = r.first(&ELECTRONS_PER_ADU, allowed, &reason);
    let gain = gain_keyword(r, sure, allowed, &reason);
    let given = r.overrides.gain_e_adu;
    r.overridden("--gain", given, |g| g > 0.0 && g.is_finite(), gain)
}

fn gain_keyword(
    r: &mut Reader,
    sure: Option<(&'static str, f64)>,
    allowed: impl Fn(f64) -> bool,
    reason: &str,
) -> Option<f64> {
    let Some(gain) = r.number("GAIN") else { return sure.map(|(_, g)| g) };
    let program = r.program.filter(|p| p.gain_is_setting).map(|p| p.name.to_owned());
    let camera = r.text("INSTRUME").filter(|name| gain.fract() == 0.0 && dialect::has_gain_setting(name));
    if let Some(writer) = program.or(camera) {
        r.note(NoteKind::Ignored, &["GAIN"], format!("the setting of a driver, no e/adu, as {writer} writes it"));
        return sure.map(|(_, g)| g);
    }
    match sure {
        Some((keyword, taken)) => {
            if !allowed(gain) {
                r.note(NoteKind::Ignored, &["GAIN"], format!("no gain in e/adu; {keyword} is taken"));
            } else if !agree(gain, taken) {
                let what = format!("{keyword} is taken, whose unit is sure");
                r.note(NoteKind::Contradictory, &["GAIN", keyword], what);
            }
            Some(taken)
        }
        None => r.first(&["GAIN"], allowed, reason).map(|(_, g)| g),
    }
}

/// Read noise \[e\].
pub(super) fn read_noise(r: &mut Reader) -> Option<f64> {
    let found = r.first(&READ_NOISE, |x| x >= 0.0, "0 e or more");
    let given = r.overrides.read_noise_e;
    r.overridden("--read-noise", given, |x| x >= 0.0 && x.is_finite(), found.map(|(_, x)| x))
}

/// Level from which a pixel is saturated \[adu\]: by its keyword, at most the top of the stored integers.
pub(super) fn saturation(r: &mut Reader) -> Option<f64> {
    let mut found = r.first(&SATURATION, |x| x > 0.0, "above 0 adu");
    // elsewhere DATAMAX is the largest value of the pixels (FITS Standard 4.0, sect. 4.4.2.5)
    if found.is_none() && (r.program.is_some_and(|p| p.name == "MaxIm DL") || r.text("SBSTDVER").is_some()) {
        found = r.first(&["DATAMAX"], |x| x > 0.0, "above 0 adu");
    }
    let level = match (found, top(r)) {
        (Some((keyword, level)), Some(top)) if level > top => {
            r.note(NoteKind::Contradictory, &[keyword, "BITPIX", "BZERO"], format!("stored values end at {top}"));
            Some(top)
        }
        (None, Some(top)) => {
            r.note(
                NoteKind::Assumed,
                &["BITPIX", "BZERO"],
                format!("saturated at the top of the range, {top} adu"),
            );
            Some(top)
        }
        (Some((_, level)), _) => Some(level),
        (None, None) => None,
    };
    let given = r.overrides.saturate_adu;
    r.overridden("--saturate", given, |x| x > 0.0 && x.is_finite(), level)
}

/// Largest physical value of a frame of integers \[adu\].
fn top(r: &Reader) -> Option<f64> {
    let bits = r.number("ZBITPIX").or_else(|| r.number("BITPIX"))?;
    let highest = match bits {
        8.0 => 255.0,
        16.0 => 32_767.0,
        32.0 => 2_147_483_647.0,
        _ => return None,
    };
    let top = r.number("BZERO").unwrap_or(0.0) + highest * r.number("BSCALE").unwrap_or(1.0);
    (top > 0.0 && top.is_finite()).then_some(top)
}

/// Bias level \[adu\]: BIASLVL, else the pedestal that was left when bias or dark were subtracted.
///
/// PEDESTAL is what is to be added for a zero level of 0 (SBFITSEXT 1.0), so it is negative: MaxIm DL leaves 100
/// adu and writes -100. A positive one (PixInsight) is what was added. Either way the zero level lies at its size,
/// since a level below 0 would have been pointless.
pub(super) fn bias(r: &mut Reader) -> Option<f64> {
    let calibrated = r.text("CALSTAT").is_some_and(|s| s.contains(['B', 'D', 'b', 'd']));
    let level = match (r.number("BIASLVL"), r.number("PEDESTAL")) {
        (Some(level), _) => Some(level),
        (None, Some(pedestal)) if pedestal < 0.0 => Some(-pedestal),
        (None, Some(pedestal)) if pedestal > 0.0 => {
            let what = "positive: taken as what was added to the pixels, so the zero level";
            r.note(NoteKind::Assumed, &["PEDESTAL"], what);
            Some(pedestal)
        }
        (None, Some(_)) if calibrated => Some(0.0),
        (None, Some(_)) => {
            r.note(NoteKind::Ignored, &["PEDESTAL"], "no level of a frame whose bias was not subtracted");
            None
        }
        (None, None) if calibrated => {
            r.note(NoteKind::Assumed, &["CALSTAT"], "bias or dark subtracted and no pedestal: zero level 0 adu");
            Some(0.0)
        }
        (None, None) => None,
    };
    if level.is_none() && r.number("OFFSET").is_some() {
        r.note(NoteKind::Ignored, &["OFFSET"], "the setting of a driver, no level in adu");
    }
    let given = r.overrides.bias_adu;
    r.overridden("--bias", given, f64::is_finite, level)
}

/// Full width at half maximum of a point's image \[rad\].
pub(super) fn seeing(r: &mut Reader) -> Option<f64> {
    let found = r.first(&SEEING, |x| x > 0.0, "above 0 arcsec");
    let given = r.overrides.seeing_arcsec;
    let seeing = r.overridden("--seeing", given, |x| x > 0.0 && x.is_finite(), found.map(|(_, x)| x));
    seeing.map(|x| x * ARCSEC)
}

/// Diameter and focal length of the telescope \[m\].
pub(super) fn optics(r: &mut Reader) -> (Option<f64>, Option<f64>) {
    let length = |r: &mut Reader, keyword| {
        let found = r.first(&[keyword], |x| x > 0.0 && x <= LONGEST_MM, "above 0 mm and up to 1 km");
        found.map(|(_, mm)| mm * 1e-3)
    };
    let mut diameter = length(r, "APTDIA");
    let mut focal = length(r, "FOCALLEN");
    if let Some(d) = diameter.as_mut().filter(|d| **d < 5e-3) {
        *d *= 1e3;
        r.note(NoteKind::Assumed, &["APTDIA"], "in metres: no telescope of so few millimetres");
        if let Some(f) = focal.as_mut().filter(|f| **f < 0.3 * *d) {
            *f *= 1e3;
            r.note(NoteKind::Assumed, &["FOCALLEN"], "in metres, as the diameter");
        }
    }
    let ratio = r.numbers(&["FOCRATIO", "FRATIO"]).into_iter().find(|(_, x)| (0.2..=200.0).contains(x));
    match (diameter, focal, ratio) {
        (None, Some(f), Some((keyword, ratio))) => {
            diameter = Some(f / ratio);
            r.note(NoteKind::Assumed, &["FOCALLEN", keyword], "the diameter is their quotient");
        }
        (Some(d), Some(f), Some((keyword, ratio))) if (f / d / ratio - 1.0).abs() > 0.1 => {
            let what = "FOCALLEN / APTDIA is another ratio; APTDIA is taken";
            r.note(NoteKind::Contradictory, &["APTDIA", "FOCALLEN", keyword], what);
        }
        _ => {}
    }
    let full = diameter.map(|d| PI / 4.0 * d * d * 1e6);
    if let (Some(full), Some(net)) = (full, r.number("APTAREA"))
        && net > 1.02 * full
    {
        r.note(
            NoteKind::Contradictory,
            &["APTDIA", "APTAREA"],
            "more area than the diameter has; APTDIA is taken",
        );
    }
    let given = r.overrides.aperture_mm;
    let header_mm = diameter.map(|d| d * 1e3);
    let diameter = r.overridden("--aperture-mm", given, |x| x > 0.0 && x.is_finite(), header_mm);
    (diameter.map(|d| d * 1e-3), focal)
}
