//! Moonlight scattered by the atmosphere: the Moon's disc ([`super::moon_disc`]) as a lamp above scattering air
//! ([`super::scattering`]).
//!
//! The station's extinction curve is split into molecules, aerosol and ozone ([`crate::light::atmosphere`]); the integral
//! over wavelength is taken in bands of 10 nm. A Moon in the penumbra is dimmed by the share of the Sun's disc it sees;
//! one in the umbra, and one within 0.5 deg of the frame, is outside the model. Measured against the Moon's own place:
//! nearer than 2 deg the aureole is uncertain by a factor of two. Uncertainty: 0.2 (Jones et al. 2013, A&A 560, A91, find
//! such models within 20 % of spectra).

use super::airglow::{OZONE_KM, van_rhijn};
use super::moon_disc::Disc;
use super::scattering::{Paths, Phase, radiance};
use super::{Context, Field, Source, Toward};
use crate::astro::moon::face;
use crate::astro::observer::{airmass, azimuth_elevation, enu};
use crate::astro::{separation, shadow};
use crate::base::ledger::Why;
use crate::base::units::flux_from_mag;
use crate::light::atmosphere::Depths;
use crate::light::integrand::Bin;
use crate::light::tables;
use crate::light::throughput::Throughput;
use std::f64::consts::{FRAC_PI_2, PI};

/// Nearer to the Moon than this the frame would show the Moon itself \[rad\].
const NEAREST: f64 = 0.5 / 180.0 * PI;

/// Below the horizon the Moon still lights high air: its light fades by a magnitude a degree, about as twilight's does (from
/// the sunset's V 7 to Patat's 11.8 mag/arcsec^2 at 5 deg), and is left out from here on \[deg\].
const LOWEST_DEG: f64 = -6.0;
const FADE_MAG_PER_DEG: f64 = 1.0;

/// Width of the bands of wavelength \[nm\].
pub const BAND_NM: f64 = 10.0;

/// Sunlight at 1 au through one instrument, in bands, with the air's optical depths.
#[derive(Debug, Clone)]
pub struct Rates(Vec<(Bin, Depths)>);

impl Rates {
    /// The rates of an instrument.
    pub fn new(throughput: &Throughput) -> Self {
        Self::in_bands(throughput, BAND_NM)
    }

    /// Size of the bands \[bytes\].
    pub fn bytes(&self) -> usize {
        std::mem::size_of_val(self.0.as_slice())
    }

    /// The same in bands of another width; narrow ones are the reference twin.
    pub fn in_bands(throughput: &Throughput, width_nm: f64) -> Self {
        let bins = throughput.integrand(&tables::sun()).bins(width_nm);
        Self(bins.into_iter().map(|bin| (bin, throughput.atmosphere.depths(bin.nm))).collect())
    }
}

/// Moonlight of a frame.
pub struct Moonlight<'a> {
    context: &'a Context<'a>,
    /// Electrons per second of each band from the Moon above the air; optical depths there.
    lamp: Vec<(Bin, Depths)>,
    /// Apparent elevation of the Moon, 0 below the horizon \[rad\].
    elevation: f64,
    /// Share of the Sun's disc that the Moon sees.
    lit: f64,
}

/// Share of the Sun's disc that the Moon sees: below 1 in the Earth's penumbra, 0 in its umbra.
pub(super) fn lit(context: &Context) -> f64 {
    let position = crate::astro::bodies::moon_gcrs(&context.now.instant);
    shadow::sunlit(position, context.now.observer.earth.sun_apparent(0.0), context.now.observer.pole)
}

/// Apparent elevation of the Moon's centre \[rad\].
pub(super) fn elevation(context: &Context) -> f64 {
    let place = context.now.moon.body.horizontal;
    let airless = enu(place.azimuth, place.elevation);
    azimuth_elevation(context.now.observer.refracted(airless)).1
}

/// Share of moonlight at this apparent elevation \[rad\] of what the Moon gives on the horizon; 1 above it.
pub(super) fn fade(elevation: f64) -> f64 {
    let below = -elevation.to_degrees();
    if below > -LOWEST_DEG { 0.0 } else { flux_from_mag(FADE_MAG_PER_DEG * below.max(0.0)) }
}

/// Why scattered moonlight cannot be told for a field: no Moon up, eclipsed, or in the field itself.
pub(super) fn absent(context: &Context, field: &Field, lit: f64) -> Option<Why> {
    let moon = &context.now.moon.body;
    let elevation = elevation(context).to_degrees();
    if elevation < LOWEST_DEG {
        return Some(Why::NotVisible(format!("Moon {:.1} deg below the horizon", -elevation)));
    }
    if lit <= 0.0 {
        return Some(Why::OutsideModel("Moon in the Earth's umbra".into()));
    }
    // the edge of the frame may be nearer to the Moon
    let away = separation(field.centre().icrs, moon.direction);
    (away - field.radius < NEAREST).then(|| {
        Why::OutsideModel(format!("Moon in or beside the field, {:.1} deg from its centre", away.to_degrees()))
    })
}

impl<'a> Moonlight<'a> {
    /// The moonlight of a frame.
    pub fn new(context: &'a Context<'a>) -> Self {
        Self::with_rates(context, &context.response.moonlight)
    }

    /// The same with bands of another width.
    pub fn with_rates(context: &'a Context<'a>, rates: &Rates) -> Self {
        let now = &context.now;
        let disc = Disc::new(&face(&now.instant, now.observer.gcrs).at_phase(now.moon.phase));
        let (lit, elevation) = (lit(context), elevation(context));
        let dimmed = lit * fade(elevation);
        let lamp = |(bin, depths): &(Bin, Depths)| {
            (Bin { nm: bin.nm, electrons: bin.electrons * disc.relative_to_sun(bin.nm) * dimmed }, *depths)
        };
        let lamp = rates.0.iter().map(lamp).collect();
        Self { context, lamp, elevation: elevation.max(0.0), lit }
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
        let phase = self.context.now.moon.phase.to_degrees();
        format!("ROLO disc (Kieffer & Stone 2005) at phase {phase:.1} deg, Rayleigh and Mie scattering")
    }

    fn absent(&self, field: &Field) -> Option<Why> {
        absent(self.context, field, self.lit)
    }

    fn mean(&self, toward: &Toward) -> f64 {
        if toward.zenith_distance > FRAC_PI_2 {
            return 0.0;
        }
        let phase = Phase::at(separation(toward.icrs, self.context.now.moon.body.direction));
        let paths = Paths {
            view: toward.airmass,
            lamp: airmass(self.elevation),
            lamp_ozone: van_rhijn(FRAC_PI_2 - self.elevation, OZONE_KM),
            ground: self.context.scene.station.ground_albedo,
        };
        let band = |(bin, depths): &(Bin, Depths)| bin.electrons * radiance(bin.nm, depths, &phase, paths);
        self.lamp.iter().map(band).sum::<f64>() * self.context.per_steradian()
    }

    fn uncertainty(&self) -> f64 {
        let phase = self.context.now.moon.phase.to_degrees();
        if phase > 97.0 { 0.5 } else { 0.2 }
    }
}
