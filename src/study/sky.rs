//! The light of the whole sky: each source towards any direction, in electrons and in magnitudes.

use crate::astro::time::Instant;
use crate::base::ledger::{Verdict, Why};
use crate::base::units::mag_from_flux;
use crate::light::throughput::ThroughputError;
use crate::light::{colour, tables};
use crate::plan::PlanError;
use crate::plan::view::{Circumstances, View};
use crate::simulate::Simulator;
use crate::sky::response::{Integrals, Response};
use crate::sky::{self, Context, Field, Toward};
use crate::stars::drawn::Drawn;
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_2, TAU};

/// Number of sources.
pub const SOURCES: usize = 6;

/// Names of the sources, in order.
pub const NAMES: [&str; SOURCES] = ["airglow", "pollution", "twilight", "starlight", "moonlight", "zodiacal"];

/// Passbands in which brightness is told.
pub const BANDS: [&str; 4] = ["B", "V", "R", "I"];

/// Lowest elevation counted in the extremes of a sky \[rad\]: 10 deg.
const LOWEST: f64 = 10.0 / 180.0 * std::f64::consts::PI;

/// Towards one direction: each source, NaN where it is unknown.
pub type Means = [f64; SOURCES];

/// The sky above a scene's station through one instrument.
pub struct Sky<'a> {
    simulator: &'a Simulator<'a>,
    response: Response,
}

/// One source in the budget.
#[derive(Debug, Clone)]
pub struct BudgetRow {
    /// Name of the source.
    pub name: &'static str,
    /// Model, or why there is none of it.
    pub why: String,
    /// At the zenith \[e-/px/s\].
    pub zenith: f64,
    /// At the frame's centre; NaN below the horizon.
    pub centre: f64,
    /// Least, median and most above 10 deg of elevation.
    pub range: [f64; 3],
    /// At the zenith in B, V, R, I \[mag/arcsec^2\]; NaN where there is none.
    pub bands: [f64; 4],
    /// Relative uncertainty.
    pub uncertainty: f64,
}

/// A zero point: V magnitude of a source that gives 1 e-/s.
#[derive(Debug, Clone)]
pub struct ZeroPoint {
    /// The source's spectrum.
    pub spectrum: String,
    /// Outside the air and through one airmass.
    pub mag_v: [f64; 2],
}

impl<'a> Sky<'a> {
    /// Through the scene's own instrument.
    pub fn new(simulator: &'a Simulator<'a>) -> Self {
        Self { simulator, response: simulator.response.clone() }
    }

    /// Through an ideal detector behind a built-in passband.
    ///
    /// # Errors
    /// [`ThroughputError`] if the scene's tables cannot be used.
    pub fn in_band(simulator: &'a Simulator<'a>, band: &str) -> Result<Self, ThroughputError> {
        let ideal = simulator.response.throughput.ideal(tables::passband(band));
        Ok(Self { simulator, response: Response::new(simulator.scene, ideal)? })
    }

    /// Each source towards a direction \[e-/px/s\]; starlight is that of stars fainter than `stars.limit_mag_v` where the scene
    /// gives it, else of all too faint for the eye.
    pub fn towards(&self, now: &Circumstances, toward: &Toward) -> Means {
        let context = Context::new(self.simulator.scene, &self.response, *now, Field::point(*toward), 1.0);
        let means = sky::sources(&context, &drawn(self.simulator)).into_iter().map(|source| {
            match source.absent(&context.field) {
                Some(why) if why.is_unknown() => f64::NAN,
                Some(_) => 0.0,
                None => source.mean(toward),
            }
        });
        let mut all = [f64::NAN; SOURCES];
        all.iter_mut().zip(means).for_each(|(to, mean)| *to = mean);
        all
    }

    /// Each source towards many directions.
    pub fn map(&self, now: &Circumstances, directions: &[(f64, f64)]) -> Vec<Means> {
        let mean = |(azimuth, zenith_distance): &(f64, f64)| {
            self.towards(now, &Toward::horizontal(&now.observer, *azimuth, *zenith_distance))
        };
        directions.par_iter().map(mean).collect()
    }

    /// Electrons per pixel and second of magnitude 0 a square arcsecond in `band`, where Vega has +0.03.
    fn of_zero_mag(&self, band: &str) -> f64 {
        let vega = tables::vega();
        let flux = crate::base::units::flux_from_mag(tables::magnitude(&vega, &tables::passband(band)));
        let arcsec = self.simulator.scene.stored_scale_arcsec();
        self.response.throughput.electrons_per_s(&vega, 0.0) / flux * arcsec * arcsec
    }
}

/// The stars that do not count as diffuse light.
fn drawn(simulator: &Simulator) -> Drawn {
    simulator.scene.stars.limit_mag_v.map_or(Drawn::None, |limit| Drawn::All { limit })
}

/// The zenith, then directions spread evenly over the sky above 10 deg of elevation: azimuth and zenith distance \[rad\].
pub fn even_directions(number: usize) -> Vec<(f64, f64)> {
    // a spiral of the golden angle, equal in solid angle
    let golden = TAU * (1.0 - 2.0 / (1.0 + 5f64.sqrt()));
    let lowest = LOWEST.sin();
    let direction = |k: usize| {
        let cos_zenith = 1.0 - (1.0 - lowest) * (k as f64 + 0.5) / number as f64;
        ((golden * k as f64).rem_euclid(TAU), cos_zenith.acos())
    };
    std::iter::once((0.0, 0.0)).chain((0..number).map(direction)).collect()
}

/// The budget of the sky at an exposure.
///
/// # Errors
/// [`ThroughputError`] if the scene's tables cannot be used.
pub fn budget(simulator: &Simulator, view: &View) -> Result<Vec<BudgetRow>, ThroughputError> {
    let now = view.circumstances();
    let own = Sky::new(simulator);
    let zenith = Toward::horizontal(&now.observer, 0.0, 0.0);
    let at_zenith = own.towards(&now, &zenith);
    let centre = Toward::icrs(&now.observer, view.wcs.mid.centre);
    let up = centre.zenith_distance < FRAC_PI_2;
    let at_centre = if up { own.towards(&now, &centre) } else { [f64::NAN; SOURCES] };
    let everywhere = own.map(&now, &even_directions(600));
    let mut bands = [[f64::NAN; SOURCES]; BANDS.len()];
    for (mags, band) in bands.iter_mut().zip(BANDS) {
        let sky = Sky::in_band(simulator, band)?;
        let zero = sky.of_zero_mag(band);
        *mags = sky.towards(&now, &zenith).map(|mean| mag_from_flux(mean / zero));
    }
    let context = Context::new(simulator.scene, &simulator.response, now, Field::point(zenith), 1.0);
    let sources = sky::sources(&context, &drawn(simulator));
    let row = |k: usize| {
        let verdict = sources[k].assess(&context.field);
        let why = match &verdict {
            Verdict::Needed { .. } => sources[k].basis(),
            Verdict::Absent(why) => Why::to_string(why),
        };
        let mut values = everywhere.iter().map(|m| m[k]).filter(|v| v.is_finite()).collect::<Vec<_>>();
        values.sort_by(f64::total_cmp);
        let of = |share: f64| values.get(((values.len().max(1) - 1) as f64 * share) as usize).copied();
        let uncertainty = match &verdict {
            Verdict::Needed { .. } => sources[k].uncertainty(),
            Verdict::Absent(why) if why.is_unknown() => f64::NAN,
            Verdict::Absent(_) => 0.0,
        };
        BudgetRow {
            name: NAMES[k],
            why,
            zenith: at_zenith[k],
            centre: at_centre[k],
            range: [0.0, 0.5, 1.0].map(|share| of(share).unwrap_or(f64::NAN)),
            bands: bands.map(|b| b[k]),
            uncertainty,
        }
    };
    Ok((0..SOURCES).map(row).collect())
}

/// Brightness of the zenith in B, V, R and I, all sources together \[mag/arcsec^2\]; NaN where one is unknown.
pub fn total_bands(rows: &[BudgetRow]) -> [f64; 4] {
    if rows.iter().any(|r| r.zenith.is_nan()) {
        return [f64::NAN; 4];
    }
    std::array::from_fn(|b| {
        let flux = rows.iter().map(|r| r.bands[b]).filter(|m| m.is_finite());
        mag_from_flux(flux.map(crate::base::units::flux_from_mag).sum())
    })
}

/// Zero points of sunlight, Vega and stars of three colours.
pub fn zero_points(simulator: &Simulator) -> Vec<ZeroPoint> {
    let named = [("sun".to_owned(), tables::sun()), ("vega".to_owned(), tables::vega())];
    let stars = [0.0, 0.65, 1.5].map(|bv| (format!("star B-V {bv}"), colour::star(bv)));
    let zero_point = |(spectrum, curve)| ZeroPoint {
        spectrum,
        mag_v: [0.0, 1.0].map(|airmass| simulator.response.throughput.zero_point(&curve, airmass)),
    };
    named.into_iter().chain(stars).map(zero_point).collect()
}

/// SINT, BINT and AINT outside the air and through one airmass.
pub fn integrals(simulator: &Simulator) -> [Integrals; 2] {
    [0.0, 1.0].map(|airmass| simulator.response.integrals(airmass))
}

/// The zenith over a night: hours from the first instant, and the means there.
///
/// # Errors
/// [`PlanError`] where the Earth's orientation is unknown.
pub fn zenith_curve(
    simulator: &Simulator,
    from: &Instant,
    to: &Instant,
    steps: usize,
) -> Result<Vec<(f64, Means)>, PlanError> {
    let sky = Sky::new(simulator);
    let step = to.since(from) / steps.max(1) as f64;
    let point = |k: usize| {
        let now = simulator.planner.circumstances(&from.plus(k as f64 * step))?;
        let zenith = Toward::horizontal(&now.observer, 0.0, 0.0);
        Ok((k as f64 * step / 3600.0, sky.towards(&now, &zenith)))
    };
    (0..=steps).into_par_iter().map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_even_and_above_the_haze() {
        let all = even_directions(500);
        assert!(all.iter().all(|(_, z)| *z <= FRAC_PI_2 - LOWEST));
        let high = all.iter().filter(|(_, z)| z.cos() > 0.5 * (1.0 + LOWEST.sin())).count();
        assert_eq!(high, 251);
    }
}
