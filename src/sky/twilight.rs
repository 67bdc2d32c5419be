//! Twilight: sunlight scattered high in the atmosphere, as excess over the night sky.
//!
//! Zenith, V: Patat, Ugolnikov & Postylyakov 2006, A&A 455, 385, Table 1: m = 11.84 + 1.518 x - 0.057 x^2 with x the
//! Sun's zenith distance less 95 deg, for 95-105 deg. The measurement contains the night sky; the excess is its
//! radiance less Patat's own night of V 21.61 mag/arcsec^2 (Patat 2003, A&A 400, 1183). The parabola's difference turns
//! negative near 106 deg, so from 104 deg on the excess goes to zero at 107 deg as a cubic with the same value and
//! slope (C1). Direction: 10^(0.2977 (X - 1)), times 10^(0.3164 cos dAz (X - 1)) within 90 deg of the Sun's azimuth
//! (Yoachim et al. 2016, Proc. SPIE 9910, band G). Both are fits at
//! moderate airmasses: beyond X = 2.5 (23 deg elevation) their value there is held. Solar colour, measured at the ground. A Sun higher than 5 deg
//! below the horizon is outside the model. Uncertainty: 0.2 mag at the zenith.

use super::{Context, Source, Toward};
use crate::base::ledger::{Verdict, Why};
use crate::base::surface_brightness::MagArcsec2;
use crate::base::units::flux_from_mag;

const COEFFICIENTS: [f64; 3] = [11.84, 1.518, -0.057];
const NIGHT_MAG: f64 = 21.61;
/// First Sun zenith distance of the model \[deg\].
const FIRST_DEG: f64 = 95.0;
/// Where the blend to zero begins and ends \[deg\].
const BLEND_DEG: [f64; 2] = [104.0, 107.0];
/// Yoachim et al. 2016, band G: dex per airmass, and towards the Sun.
const PER_AIRMASS_DEX: f64 = 0.297_733;
const TOWARD_SUN_DEX: f64 = 0.316_403;

/// The fit to the sky's direction is not carried beyond this airmass; nearer to the horizon its value is held.
const LONGEST_PATH: f64 = 2.5;

/// Twilight of a frame.
pub struct Twilight<'a> {
    context: &'a Context<'a>,
    sun_zenith_deg: f64,
    zenith_electrons: f64,
}

/// Excess radiance at the zenith in units of V = 0 mag/arcsec^2, for the Sun `sun_zenith_deg` from the zenith; none
/// above the model's range, zero from 107 deg on.
pub fn zenith_excess(sun_zenith_deg: f64) -> Option<f64> {
    let parabola = |z: f64| {
        let x = z - FIRST_DEG;
        let [a, b, c] = COEFFICIENTS;
        let total = flux_from_mag(a + b * x + c * x * x);
        let slope = -0.4 * std::f64::consts::LN_10 * (b + 2.0 * c * x) * total;
        (total - flux_from_mag(NIGHT_MAG), slope)
    };
    let [begin, end] = BLEND_DEG;
    if sun_zenith_deg < FIRST_DEG {
        None
    } else if sun_zenith_deg >= end {
        Some(0.0)
    } else if sun_zenith_deg <= begin {
        Some(parabola(sun_zenith_deg).0)
    } else {
        let (value, slope) = parabola(begin);
        let width = end - begin;
        let t = (sun_zenith_deg - begin) / width;
        // cubic Hermite from (value, slope) to (0, 0); monotonic, as 3 value > -slope width
        let slope = slope * width;
        let (t2, t3) = (t * t, t * t * t);
        Some(value * (2.0 * t3 - 3.0 * t2 + 1.0) + slope * (t3 - 2.0 * t2 + t))
    }
}

impl<'a> Twilight<'a> {
    /// The twilight of a frame.
    pub fn new(context: &'a Context<'a>) -> Self {
        let sun_zenith_deg = 90.0 - context.view.sun.horizontal.elevation.to_degrees();
        let excess = zenith_excess(sun_zenith_deg).unwrap_or(0.0);
        Self { context, sun_zenith_deg, zenith_electrons: context.electrons_at_ground(MagArcsec2(0.0)) * excess }
    }

    fn electrons(&self, azimuth: f64, airmass: f64) -> f64 {
        let path = (airmass.min(LONGEST_PATH) - 1.0).max(0.0);
        let toward_sun = (azimuth - self.context.view.sun.horizontal.azimuth).cos().max(0.0);
        self.zenith_electrons * 10f64.powf(path * (PER_AIRMASS_DEX + TOWARD_SUN_DEX * toward_sun))
    }
}

impl Source for Twilight<'_> {
    fn name(&self) -> &'static str {
        "sky.twilight"
    }

    fn keyword(&self) -> &'static str {
        "SKYTWIL"
    }

    fn basis(&self) -> String {
        "Patat 2006 less its night sky, direction of Yoachim 2016".into()
    }

    fn assess(&self) -> Verdict {
        let below = self.sun_zenith_deg - 90.0;
        if self.sun_zenith_deg < FIRST_DEG {
            return Verdict::Absent(Why::OutsideModel(format!(
                "Sun at {:.1} deg elevation, model below -5 deg",
                -below
            )));
        }
        if self.zenith_electrons <= 0.0 {
            return Verdict::Absent(Why::NotVisible(format!("Sun {below:.1} deg below the horizon")));
        }
        let centre = self.context.view.centre;
        // 1.5 airmasses change the sky by less than a factor of 10: the corners of a wide field
        let bound = 10f64.powf(PER_AIRMASS_DEX + TOWARD_SUN_DEX)
            * self.electrons(centre.azimuth, self.context.view.airmass);
        Verdict::Needed { bound }
    }

    fn mean(&self, toward: &Toward) -> f64 {
        self.electrons(toward.azimuth, toward.airmass)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::units::mag_from_flux;

    /// Hand-worked from Patat's table: 11.84 mag at 95 deg, 17.94 - ... at 100 deg: 11.84 + 7.59 - 1.425 = 18.005.
    #[test]
    fn the_excess_is_patats_less_his_night() {
        assert!((mag_from_flux(zenith_excess(95.0).expect("inside")) - 11.84).abs() < 1e-3);
        let at_100 = mag_from_flux(zenith_excess(100.0).expect("inside") + flux_from_mag(NIGHT_MAG));
        assert!((at_100 - 18.005).abs() < 1e-9);
        assert_eq!(zenith_excess(94.9), None);
        assert_eq!(zenith_excess(107.0), Some(0.0));
    }

    #[test]
    fn the_excess_falls_smoothly_to_zero() {
        let f = |z: f64| zenith_excess(z).expect("inside");
        let (mut before, mut slope_before) = (f(103.0), f64::NAN);
        for i in 1..=450 {
            let now = f(103.0 + 0.01 * f64::from(i));
            let slope = (now - before) / 0.01;
            assert!(now >= 0.0 && now <= before);
            assert!(slope_before.is_nan() || (slope - slope_before).abs() < 0.02 * f(103.0), "step at {i}");
            (before, slope_before) = (now, slope);
        }
    }
}
