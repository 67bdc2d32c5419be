//! The Moon's light above the atmosphere.
//!
//! ROLO (Kieffer & Stone 2005, AJ 129, 2887): the disc-equivalent reflectance A in 32 bands from phase, libration and the
//! Sun's place above the Moon (their eq. 10, Table 4), smoothed to the spectrum of Apollo soil, linear between bands. Then
//! (their eq. 8)
//!
//! ```text
//! E = A (6.4177e-5 sr) E_sun / pi  (1 au / d_sun)^2 (384400 km / d)^2
//! ```
//!
//! Valid for phase angles of 1.55 to 97 deg. Nearer to full Moon than the Earth's penumbra begins, A is held. Beyond 97 deg
//! the crescent follows V = 0.026 g + 4e-9 g^4 (Allen 1976 as in Krisciunas & Schaefer 1991, eq. 9), joined at 97 deg.
//! Uncertainty 5 to 10 % (their sect. 5), a factor of two for thin crescents.

use crate::astro::moon::MoonFace;
use crate::base::constants::AU_M;
use crate::base::nodes::bracket;
use crate::base::units::flux_from_mag;
use std::sync::LazyLock;

/// Solid angle of the Moon at its mean distance \[sr\], and that distance \[m\] (Kieffer & Stone 2005, eq. 8).
const MOON_SR: f64 = 6.4177e-5;
const MOON_M: f64 = 384_400e3;

/// Range of the model in phase \[deg\].
const PHASES: [f64; 2] = [1.55, 97.0];

/// Coefficients that do not depend on the band.
const C: [f64; 4] = [0.000_341_15, -0.001_342_5, 0.000_959_06, 0.000_662_29];
const P: [f64; 4] = [4.060_54, 12.880_2, -30.585_8, 16.749_8];

const TABLE: &str = include_str!("../../catalogs/moon/rolo2005.csv");

/// A band: wavelength \[nm\], coefficients a0 ... a3, b1 ... b3, d1 ... d3, factor.
type Band = [f64; 12];

static BANDS: LazyLock<Vec<Band>> = LazyLock::new(|| {
    let lines = TABLE.lines().filter(|l| !l.starts_with('#')).skip(1);
    let numbers = lines.map(|l| l.split(',').map(|v| v.parse::<f64>().unwrap_or(f64::NAN)).collect::<Vec<_>>());
    numbers.filter_map(|row| row.try_into().ok()).collect()
});

/// The Moon as a lamp: the factor on the Sun's spectrum.
#[derive(Debug, Clone)]
pub struct Disc {
    nm: Vec<f64>,
    /// E / E_sun in each band.
    ratio: Vec<f64>,
}

/// Disc-equivalent reflectance in the band of coefficients `band`.
fn reflectance(band: &Band, face: &MoonFace, phase_deg: f64) -> f64 {
    let [_, a0, a1, a2, a3, b1, b2, b3, d1, d2, d3, apollo] = *band;
    let g = phase_deg.to_radians();
    let sun = face.sun_longitude;
    let (latitude, longitude) = (face.observer_latitude.to_degrees(), face.observer_longitude.to_degrees());
    let log = a0
        + g * (a1 + g * (a2 + g * a3))
        + sun * (b1 + sun * sun * (b2 + sun * sun * b3))
        + C[0] * latitude
        + C[1] * longitude
        + sun * (C[2] * latitude + C[3] * longitude)
        + d1 * (-phase_deg / P[0]).exp()
        + d2 * (-phase_deg / P[1]).exp()
        + d3 * ((phase_deg - P[2]) / P[3]).cos();
    log.exp() * apollo
}

/// V of a crescent less that of the full Moon (Krisciunas & Schaefer 1991, eq. 9).
fn allen(phase_deg: f64) -> f64 {
    0.026 * phase_deg + 4e-9 * phase_deg.powi(4)
}

impl Disc {
    /// The Moon with the face `face`; not eclipsed.
    pub fn new(face: &MoonFace) -> Self {
        let phase_deg = face.phase.to_degrees();
        let [first, last] = PHASES;
        let inside = phase_deg.clamp(first, last);
        // the Sun's longitude goes with the phase: beyond the model's range both stand still
        let face_inside = if phase_deg > last {
            let beyond = (phase_deg - last).to_radians();
            MoonFace { sun_longitude: face.sun_longitude - beyond.copysign(face.sun_longitude), ..*face }
        } else {
            *face
        };
        let crescent = if phase_deg > last { flux_from_mag(allen(phase_deg) - allen(last)) } else { 1.0 };
        let distances = (AU_M / face.sun_distance).powi(2) * (MOON_M / face.observer_distance).powi(2);
        let scale = MOON_SR / std::f64::consts::PI * distances * crescent;
        let ratio = BANDS.iter().map(|band| scale * reflectance(band, &face_inside, inside)).collect();
        Self { nm: BANDS.iter().map(|band| band[0]).collect(), ratio }
    }

    /// Irradiance of the Moon relative to the Sun's at 1 au, at `nm`; held beyond 350 to 2384 nm.
    pub fn relative_to_sun(&self, nm: f64) -> f64 {
        let (i, share) = bracket(&self.nm, nm);
        self.ratio[i] + share * (self.ratio[i + 1] - self.ratio[i])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::tables;

    /// A mean Moon, the observer and the Sun in its equator; waning for negative phases.
    fn face(phase_deg: f64) -> MoonFace {
        MoonFace {
            phase: phase_deg.abs().to_radians(),
            observer_longitude: 0.0,
            observer_latitude: 0.0,
            sun_longitude: phase_deg.to_radians(),
            sun_latitude: 0.0,
            observer_distance: MOON_M,
            sun_distance: AU_M,
        }
    }

    fn mag_v(phase_deg: f64) -> f64 {
        let disc = Disc::new(&face(phase_deg));
        tables::magnitude_v(&tables::sun().map(|nm, sun| sun * disc.relative_to_sun(nm)))
    }

    /// Kieffer & Stone 2005: at 2 deg the disc-equivalent albedo at 550 nm is 0.13; V by their model.
    #[test]
    fn the_disc_is_as_bright_as_published() {
        let near_550 = BANDS.iter().find(|b| b[0] == 549.1).expect("a band");
        let albedo = reflectance(near_550, &face(2.0), 2.0);
        assert!((albedo - 0.130).abs() < 0.002, "{albedo}");
        // between waxing and waning, which differ by the maria
        for (phase, v) in [(2.0, -12.8), (30.0, -11.84), (60.0, -11.00)] {
            let mean = 0.5 * (mag_v(phase) + mag_v(-phase));
            assert!(
                (mean - v).abs() < 0.05,
                "{phase} deg: V {mean}, waxing {} waning {}",
                mag_v(phase),
                mag_v(-phase)
            );
        }
    }

    #[test]
    fn the_crescent_joins_and_fades_to_nothing_new() {
        assert!((mag_v(96.999) - mag_v(97.001)).abs() < 1e-3);
        // with libration the Sun's longitude is not the phase
        let librating = |phase: f64| {
            let sun_longitude = (phase - 7.6).to_radians();
            let disc = Disc::new(&MoonFace { sun_longitude, observer_longitude: -0.13, ..face(phase) });
            disc.relative_to_sun(550.0)
        };
        assert!((librating(96.999) / librating(97.001) - 1.0).abs() < 1e-3);
        for phase in [0.0, 1.0, 50.0, 97.0, 120.0, 150.0, 170.0] {
            assert!(mag_v(phase + 5.0) > mag_v(phase), "{phase}");
        }
        assert!(mag_v(180.0).is_finite() && mag_v(180.0) > -8.0);
    }

    #[test]
    fn a_waning_moon_differs_from_a_waxing_one_by_the_maria() {
        let ratio = Disc::new(&face(-60.0)).relative_to_sun(550.0) / Disc::new(&face(60.0)).relative_to_sun(550.0);
        assert!(ratio < 1.0 && ratio > 0.8, "{ratio}");
    }
}
