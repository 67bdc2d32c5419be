//! Diffuse light of the sky: six sources, each a mean number of electrons per pixel towards a direction.
//!
//! Light from above the atmosphere (starlight, zodiacal light, airglow with its own effective extinction) is dimmed
//! once; light measured at the ground (pollution, twilight, scattered moonlight) is not dimmed again. Twilight and
//! pollution are the excess over the natural sky, so that the dark sky is counted once. All sources of a frame
//! are summed before the one Poisson draw.
//!
//! Each source first says whether it is needed ([`Source::assess`]); what is negligible together is left out
//! together ([`compose`]).

pub mod airglow;
pub mod field;
pub mod moonlight;
pub mod pollution;
pub mod starlight;
pub mod surface;
pub mod twilight;
pub mod zodiacal;

use crate::astro::observer::airmass;
use crate::astro::observer::azimuth_elevation;
use crate::base::ledger::{Row, Verdict, Why};
use crate::base::surface_brightness::MagArcsec2;
use crate::base::units::{ARCSEC, ARCSEC_PER_RAD, flux_from_mag};
use crate::light::tables;
use crate::light::throughput::{RateAtAirmass, Throughput};
use crate::plan::view::View;
use crate::scene::{Scene, Sky, SkyModel};
use crate::stars::catalogue::Catalogue;
use glam::{DVec2, DVec3};

/// A direction into the sky.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Toward {
    /// Astrometric ICRS unit vector.
    pub icrs: DVec3,
    /// Azimuth from north, clockwise \[rad\].
    pub azimuth: f64,
    /// Apparent zenith distance \[rad\].
    pub zenith_distance: f64,
    /// Airmass (Pickering 2002).
    pub airmass: f64,
    /// Place in the frame, -1 to 1 along x and y.
    pub in_frame: DVec2,
}

/// What all sources of a frame need.
#[derive(Debug)]
pub struct Context<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Geometry of the exposure.
    pub view: &'a View,
    /// From photons to electrons.
    pub throughput: &'a Throughput,
    /// The catalogue whose stars are drawn one by one.
    pub catalogue: &'a Catalogue,
    /// Electrons per second of a solar-coloured source of V = 0 above the atmosphere, against airmass.
    pub solar_v_zero: RateAtAirmass,
    /// The same without atmosphere.
    pub solar_v_zero_at_ground: f64,
    /// Solid angle of a pixel \[sr\].
    pub pixel_sr: f64,
}

impl<'a> Context<'a> {
    /// What the sources of one exposure need.
    pub fn new(scene: &'a Scene, view: &'a View, throughput: &'a Throughput, catalogue: &'a Catalogue) -> Self {
        let solar = tables::solar_of_v_zero();
        // on the observed sky; astrometric scales are stretched by differential refraction
        let pixel_rad = scene.telescope.plate_scale_arcsec * ARCSEC;
        Self {
            scene,
            view,
            throughput,
            catalogue,
            solar_v_zero: throughput.rate(&solar),
            solar_v_zero_at_ground: throughput.electrons_per_s(&solar, 0.0),
            pixel_sr: pixel_rad * pixel_rad,
        }
    }

    /// Solid angle of a pixel \[arcsec^2\].
    pub fn pixel_arcsec2(&self) -> f64 {
        self.pixel_sr * ARCSEC_PER_RAD * ARCSEC_PER_RAD
    }

    /// Electrons per pixel in the exposure from a surface brightness (V, solar colour) measured at the ground; 0
    /// for NaN.
    pub fn electrons_at_ground(&self, brightness: MagArcsec2) -> f64 {
        let flux = flux_from_mag(brightness.0);
        if flux.is_nan() {
            return 0.0;
        }
        self.solar_v_zero_at_ground * flux * self.pixel_arcsec2() * self.view.exposure_s
    }

    /// The direction of a pixel.
    pub fn toward(&self, pixel: DVec2) -> Toward {
        let icrs = self.view.wcs.mid.sky(pixel);
        let (azimuth, elevation) = azimuth_elevation(self.view.observer.observed(icrs));
        let centre = self.view.wcs.mid.crpix;
        Toward {
            icrs,
            azimuth,
            zenith_distance: std::f64::consts::FRAC_PI_2 - elevation,
            airmass: airmass(elevation),
            in_frame: (pixel - centre) / centre.max(DVec2::ONE),
        }
    }
}

/// One source of diffuse light.
pub trait Source: Sync {
    /// Name in the ledger.
    fn name(&self) -> &'static str;
    /// Keyword of its mean in the header.
    fn keyword(&self) -> &'static str;
    /// Model and reference.
    fn basis(&self) -> String;
    /// Whether it can reach the frame, and at most how much of it.
    fn assess(&self) -> Verdict;
    /// Mean \[e-/px\] in the exposure; called only if needed.
    fn mean(&self, toward: &Toward) -> f64;
}

/// The six sources of a frame, in the order of the header.
pub fn sources<'a>(context: &'a Context<'a>) -> Vec<Box<dyn Source + 'a>> {
    let Sky { airglow, pollution, twilight, starlight, moonlight, zodiacal, .. } = &context.scene.sky;
    let choose = |model: &SkyModel, name, keyword, modelled: &dyn Fn() -> Box<dyn Source + 'a>| match model {
        SkyModel::Auto | SkyModel::Named(_) => modelled(),
        SkyModel::Off => Box::new(surface::Surface::off(context, name, keyword)) as Box<dyn Source>,
        SkyModel::Surface(mag) => Box::new(surface::Surface::new(context, name, keyword, MagArcsec2(*mag))),
    };
    vec![
        choose(airglow, "sky.airglow", "SKYAIRG", &|| Box::new(airglow::Airglow::new(context))),
        choose(pollution, "sky.pollution", "SKYPOLL", &|| Box::new(pollution::Pollution::new(context))),
        choose(twilight, "sky.twilight", "SKYTWIL", &|| Box::new(twilight::Twilight::new(context))),
        choose(starlight, "sky.starlight", "SKYSTAR", &|| Box::new(starlight::Starlight::new(context))),
        choose(moonlight, "sky.moonlight", "SKYMOON", &|| Box::new(moonlight::Moonlight::new(context))),
        choose(zodiacal, "sky.zodiacal", "SKYZODI", &|| Box::new(zodiacal::Zodiacal::new(context))),
    ]
}

/// The sources that take part in a frame, and what the ledger says of all of them. The faintest are left out
/// while the sum of their bounds stays below `allowed` \[e-/px\]; an explicitly named model or number is kept.
pub fn compose<'s, 'a>(
    sources: &'s [Box<dyn Source + 'a>],
    sky: &Sky,
    allowed: f64,
) -> (Vec<&'s (dyn Source + 'a)>, Vec<Row>) {
    let mut verdicts = sources.iter().map(|s| s.assess()).collect::<Vec<_>>();
    let models = [&sky.airglow, &sky.pollution, &sky.twilight, &sky.starlight, &sky.moonlight, &sky.zodiacal];
    let mut faintest_first = (0..sources.len())
        .filter_map(|i| match verdicts[i] {
            Verdict::Needed { bound } if *models[i] == SkyModel::Auto => Some((i, bound)),
            _ => None,
        })
        .collect::<Vec<_>>();
    faintest_first.sort_by(|a, b| a.1.total_cmp(&b.1));
    let mut omitted = 0.0;
    for (i, bound) in faintest_first {
        omitted += bound;
        if omitted > allowed {
            break;
        }
        verdicts[i] = Verdict::Absent(Why::Negligible { bound, allowed });
    }
    let rows = sources.iter().zip(&verdicts).map(|(s, v)| Row::new(s.name(), v, &s.basis())).collect();
    let needed = sources.iter().zip(&verdicts).filter(|(_, v)| v.is_needed()).map(|(s, _)| &**s).collect();
    (needed, rows)
}
