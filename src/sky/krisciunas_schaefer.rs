//! Moonlight scattered by the atmosphere: Krisciunas & Schaefer 1991, PASP 103, 1033.
//!
//! B = f(rho) I 10^(-0.4 k X(Zm)) (1 - 10^(-0.4 k X(Z))) nanolambert (eq. 15), with the Moon's illuminance
//! I = 10^(-0.4 (3.84 + 0.026 |alpha| + 4e-9 alpha^4)) (eq. 20), f(rho) = 10^5.36 (1.06 + cos^2 rho) + 10^(6.15 - rho/40)
//! (eq. 21; within 10 deg of the Moon 6.2e7 rho^-2, eq. 19), X(Z) = (1 - 0.96 sin^2 Z)^(-1/2) (eq. 3) and k in V from
//! the station's extinction. Measured at the ground, solar colour. Quoted accuracy 8 to 23 %. A Moon in the
//! penumbra is dimmed by the share of the Sun's disc it sees; one in the umbra, and one within 0.5 deg of the frame, is
//! outside the model.

use super::{Context, Field, Source, Toward, moonlight};
use crate::astro::separation;
use crate::base::ledger::Why;
use crate::base::surface_brightness::Nanolambert;
use std::f64::consts::FRAC_PI_2;

/// Effective wavelength of V \[nm\].
const V_NM: f64 = 550.0;

/// Moonlight of a frame.
pub struct Moonlight<'a> {
    context: &'a Context<'a>,
    extinction: f64,
    illuminance: f64,
    moon_airmass: f64,
    lit: f64,
}

/// Path of scattering air towards zenith distance `z` \[rad\] (Krisciunas & Schaefer 1991, eq. 3); 5 at the horizon.
pub fn scattering_airmass(zenith_distance: f64) -> f64 {
    let s = zenith_distance.min(FRAC_PI_2).sin();
    1.0 / (1.0 - 0.96 * s * s).sqrt()
}

/// Scattering function of air and aerosol at an angle `rho` from the Moon \[rad\], eqs 19 and 21.
fn scattering(rho: f64) -> f64 {
    let degrees = rho.to_degrees().max(0.25);
    let rayleigh = 10f64.powf(5.36) * (1.06 + rho.cos().powi(2));
    let mie = if degrees < 10.0 { 6.2e7 / (degrees * degrees) } else { 10f64.powf(6.15 - degrees / 40.0) };
    rayleigh + mie
}

/// Illuminance of the Moon outside the atmosphere, eq. 20, for a phase angle \[rad\].
fn illuminance(phase: f64) -> f64 {
    let alpha = phase.to_degrees();
    10f64.powf(-0.4 * (3.84 + 0.026 * alpha.abs() + 4e-9 * alpha.powi(4)))
}

/// Brightness of the sky, eq. 15: `rho` from the Moon, which has `phase` and stands at `moon_airmass` \[rad; eq. 3\].
pub fn brightness(rho: f64, phase: f64, extinction: f64, moon_airmass: f64, airmass: f64) -> Nanolambert {
    nanolambert(rho, illuminance(phase), extinction, moon_airmass, airmass)
}

fn nanolambert(rho: f64, illuminance: f64, extinction: f64, moon_airmass: f64, airmass: f64) -> Nanolambert {
    let kept = |x: f64| 10f64.powf(-0.4 * extinction * x);
    Nanolambert(scattering(rho) * illuminance * kept(moon_airmass) * (1.0 - kept(airmass)))
}

impl<'a> Moonlight<'a> {
    /// The moonlight of a frame.
    pub fn new(context: &'a Context<'a>) -> Self {
        let moon = &context.now.moon;
        let (lit, elevation) = (moonlight::lit(context), moonlight::elevation(context));
        Self {
            context,
            extinction: context.response.throughput.atmosphere.extinction().at(V_NM),
            illuminance: lit * moonlight::fade(elevation) * illuminance(moon.phase),
            moon_airmass: scattering_airmass(FRAC_PI_2 - elevation),
            lit,
        }
    }
}

impl Source for Moonlight<'_> {
    fn name(&self) -> &'static str {
        "sky.moonlight"
    }

    fn keyword(&self) -> &'static str {
        "SKYMOON"
    }

    fn basis(&self) -> String {
        format!("Krisciunas & Schaefer 1991, k_V = {:.3} mag/airmass", self.extinction)
    }

    fn absent(&self, field: &Field) -> Option<Why> {
        moonlight::absent(self.context, field, self.lit)
    }

    fn mean(&self, toward: &Toward) -> f64 {
        let rho = separation(toward.icrs, self.context.now.moon.body.direction);
        let airmass = scattering_airmass(toward.zenith_distance);
        let b = nanolambert(rho, self.illuminance, self.extinction, self.moon_airmass, airmass);
        self.context.electrons_at_ground(b.into())
    }

    fn uncertainty(&self) -> f64 {
        0.23
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::surface_brightness::MagArcsec2;

    /// Worked by hand from their equations: k = 0.172, phase 30 deg, Moon and field 45 deg up and 60 deg apart.
    #[test]
    fn brightness_follows_the_published_equations() {
        let x = scattering_airmass(45f64.to_radians());
        assert!((x - 1.3868).abs() < 1e-3);
        let i = illuminance(30f64.to_radians());
        assert!((i / 10f64.powf(-0.4 * (3.84 + 0.78 + 0.00324)) - 1.0).abs() < 1e-9);
        let f = scattering(60f64.to_radians());
        assert!((f / (10f64.powf(5.36) * 1.31 + 10f64.powf(4.65)) - 1.0).abs() < 1e-9);
        let Nanolambert(b) = nanolambert(60f64.to_radians(), i, 0.172, x, x);
        assert!((b - 772.3).abs() < 0.1, "{b} nL");
    }

    /// The zenith of a sky of V = 21.8 by night, the Moon 60 deg from it, k = 0.172: V = 18.85 near full Moon, 20.79 at
    /// a quarter.
    #[test]
    fn the_moonlit_zenith_is_as_bright_as_published() {
        let dark = Nanolambert::from(MagArcsec2(21.8)).0;
        let moon_airmass = scattering_airmass(60f64.to_radians());
        for (phase, published) in [(7.0, 18.85), (90.0, 20.79)] {
            let Nanolambert(moonlit) =
                brightness(60f64.to_radians(), f64::to_radians(phase), 0.172, moon_airmass, 1.0);
            let MagArcsec2(v) = Nanolambert(dark + moonlit).into();
            assert!((v - published).abs() < 0.02, "phase {phase} deg: V {v}");
        }
    }

    #[test]
    fn brightness_stays_finite_at_the_moon_and_falls_with_phase() {
        assert!(scattering(0.0).is_finite());
        assert!(illuminance(0.0) > illuminance(1.0) && illuminance(3.1) > 0.0);
    }
}
