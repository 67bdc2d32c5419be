//! Error against run time of the approximations in a frame, each against its reference twin.
//!
//! * `astro.*`: the geometry, in `astro_accuracy`.
//! * `sky.nodes`: the sky's means on a grid of nodes, bilinear between them, against evaluation at the pixel.
//! * `sky.moonlight`: scattered moonlight in bands of wavelength, against bands of 1 nm.
//! * `light.airmass`: the rate of a solar star tabulated over airmass, against the integral over wavelength.
//! * `noise.poisson`: ways to draw counts, in `poisson_accuracy`.
//! * `object.*`: shadows of shapes, in `object_accuracy`.
//! * `stars.omit`, `stars.trail`, `object.light`, `orbit.forces`: what the keys of `[accuracy]` decide, in `tolerance_accuracy`.
//! * `photometry.flux`: estimators of a flux, in `photometry_accuracy`.
//! * `inversion.grid`: the start of the inversion, in `inversion_accuracy`.
//! * `psf.stamp`: a point's image cut at a radius, against the whole; the error is the share of light left out.
//! * `psf.table`: the tabulated response of a pixel against direct quadrature of the profile.
//! * `psf.trail`: a trail as a sum of stamps against direct quadrature along the path.

use super::astro_accuracy;
use super::errors::{Errors, ladder, row, timed};
use super::inversion_accuracy;
use super::noise_accuracy::Noise;
use super::object_accuracy;
use super::photometry_accuracy;
use super::poisson_accuracy;
use super::sky::even_directions;
use super::tolerance_accuracy;
use crate::base::accuracy::{AccuracyRow, Tolerance};
use crate::camera::path::Path;
use crate::camera::psf::Psf;
use crate::camera::region::Region;
use crate::light::tables;
use crate::plan::PlanError;
use crate::plan::view::View;
use crate::run::RunError;
use crate::simulate::{SimulateError, Simulator};
use crate::sky::{self, Source, Toward, field::SkyField, moonlight};
use crate::stars::drawn::Drawn;
use glam::DVec2;

/// Names of what can have rows.
pub const APPROXIMATIONS: [&str; 22] = [
    "astro.nutation",
    "astro.earth",
    "astro.moon",
    "astro.direction",
    "sky.nodes",
    "sky.moonlight",
    "light.airmass",
    "noise.poisson",
    "psf.stamp",
    "psf.table",
    "psf.trail",
    "stars.omit",
    "stars.trail",
    "object.exact",
    "object.no-shadows",
    "object.rays",
    "object.map",
    "object.device",
    "object.light",
    "orbit.forces",
    "photometry.flux",
    "inversion.grid",
];

/// Rows for one exposure of a scene. `clock` gives seconds since some moment.
///
/// # Errors
/// [`RunError`] where the Earth's orientation is unknown or frames cannot be made.
pub fn rows(
    simulator: &Simulator,
    view: &View,
    clock: &(dyn Fn() -> f64 + Sync),
) -> Result<Vec<AccuracyRow>, RunError> {
    let astro = astro_accuracy::rows(&simulator.planner, &view.mid, clock);
    let mut rows = astro.map_err(PlanError::from).map_err(SimulateError::from)?;
    let scenery = simulator.scenery(view)?;
    let noise = Noise::of(simulator, view, &scenery);
    rows.extend(sky_rows(simulator, view, clock));
    rows.extend(moonlight_rows(simulator, view, clock));
    rows.extend(airmass_rows(simulator, clock));
    rows.extend(poisson_accuracy::rows(simulator.scene.seed, noise.mean_e, clock));
    rows.extend(psf_rows(simulator, view, clock)?);
    rows.extend(tolerance_accuracy::rows(simulator, view, clock)?);
    rows.extend(object_accuracy::rows(simulator.scene, &simulator.graphics, clock));
    rows.extend(photometry_accuracy::rows(simulator, clock)?);
    rows.extend(inversion_accuracy::rows(simulator, noise.snr, clock)?);
    noise.mark(&mut rows);
    mark_pareto(&mut rows);
    Ok(rows)
}

fn sky_rows(simulator: &Simulator, view: &View, clock: &(dyn Fn() -> f64 + Sync)) -> Vec<AccuracyRow> {
    const SAMPLES: usize = 23;
    let context = simulator.sky_context(view);
    let sources = sky::sources(&context, &Drawn::None);
    let present =
        sources.iter().filter(|s| s.assess(&context.field).is_needed()).map(|s| &**s).collect::<Vec<_>>();
    let [width, height] = simulator.scene.detector.light_px().map(|n| n as f64 - 1.0);
    let size = DVec2::new(width + 1.0, height + 1.0);
    let share = |i: usize| (i as f64 + 0.5) / SAMPLES as f64;
    let pixels = (0..SAMPLES * SAMPLES)
        .map(|k| DVec2::new(share(k % SAMPLES) * width, share(k / SAMPLES) * height))
        .collect::<Vec<_>>();
    let exact = pixels.iter().map(|p| SkyField::reference(view, &present, *p)).collect::<Vec<_>>();
    let default = SkyField::new(view, simulator.scene, &present, simulator.scene.accuracy.sky, clock).bytes();
    // the error at the midpoints decides: a grid is taken where it first lies within the tolerance
    let mut reached = f64::INFINITY;
    [2, 4, 8, 16, 32]
        .map(|cells| {
            let (field, took) = timed(clock, || SkyField::with_cells(view, &present, size, cells, clock));
            let errors = pixels.iter().zip(&exact).map(|(p, e)| field.at(*p) / e - 1.0).collect::<Vec<_>>();
            let setting = format!("{cells} x {cells} cells");
            let mut row = row("sky.nodes", setting, &Errors::of(&errors), "relative", took, field.bytes());
            row.default = field.bytes() == default;
            let low = round_up(field.error.max(1e-12));
            row.by = (low < reached).then_some(Tolerance { key: "sky", low, high: reached });
            reached = reached.min(field.error);
            row
        })
        .into()
}

/// The next number above with one digit.
fn round_up(value: f64) -> f64 {
    let power = 10f64.powf(value.log10().floor());
    // through text, so that the digit is all there is to it
    format!("{}e{}", (value / power).ceil(), power.log10().round()).parse().unwrap_or(value)
}

fn moonlight_rows(simulator: &Simulator, view: &View, clock: &(dyn Fn() -> f64 + Sync)) -> Vec<AccuracyRow> {
    if view.moon.body.horizontal.elevation <= 0.0 {
        return Vec::new();
    }
    let context = simulator.sky_context(view);
    let directions = even_directions(50);
    let at = |(azimuth, zenith): &(f64, f64)| Toward::horizontal(&context.now.observer, *azimuth, *zenith);
    let directions = directions.iter().map(at).collect::<Vec<_>>();
    let means = |width_nm: f64| {
        let rates = moonlight::Rates::in_bands(&simulator.response.throughput, width_nm);
        let source = moonlight::Moonlight::with_rates(&context, &rates);
        let (means, took) = timed(clock, || directions.iter().map(|t| source.mean(t)).collect::<Vec<_>>());
        (means, took / directions.len() as f64, rates.bytes())
    };
    let (exact, ..) = means(1.0);
    [5.0, 10.0, 20.0, 50.0]
        .map(|width| {
            let (found, took, bytes) = means(width);
            let errors = found.iter().zip(&exact).map(|(f, e)| f / e - 1.0).collect::<Vec<_>>();
            let setting = format!("bands of {width} nm");
            let mut row = row("sky.moonlight", setting, &Errors::of(&errors), "relative", took, bytes);
            row.default = width == moonlight::BAND_NM;
            row
        })
        .into()
}

fn airmass_rows(simulator: &Simulator, clock: &(dyn Fn() -> f64 + Sync)) -> [AccuracyRow; 2] {
    let (throughput, solar) = (&simulator.response.throughput, tables::solar_of_v_zero());
    let airmasses = (0..60).map(|k| 1.0 + 0.0007 * f64::from(k * k)).collect::<Vec<_>>();
    let rate = simulator.response.stars.solar();
    let count = airmasses.len() as f64;
    let (found, took) = timed(clock, || airmasses.iter().map(|x| rate.at(*x)).collect::<Vec<_>>());
    let (exact, slow) =
        timed(clock, || airmasses.iter().map(|x| throughput.electrons_per_s(&solar, *x)).collect::<Vec<_>>());
    let errors = found.iter().zip(&exact).map(|(f, e)| f / e - 1.0).collect::<Vec<_>>();
    let told = |setting: &str, errors: &[f64], seconds: f64, bytes: usize| {
        row("light.airmass", setting.into(), &Errors::of(errors), "relative", seconds / count, bytes)
    };
    let nodes = told("24 nodes, 1 to 3.4 airmasses", &errors, took, 24 * 8);
    [AccuracyRow { default: true, ..nodes }, told("integral over wavelength", &[0.0], slow, 0)]
}

fn psf_rows(
    simulator: &Simulator,
    view: &View,
    clock: &(dyn Fn() -> f64 + Sync),
) -> Result<Vec<AccuracyRow>, SimulateError> {
    let scenery = simulator.scenery(view)?;
    let profile = scenery.psf.profile();
    let chosen = simulator.scene.accuracy.psf;
    let region = Region { x0: 0, y0: 0, width: 601, height: 301 };
    let still = Path::still(DVec2::new(300.23, 150.41));
    let slant = DVec2::new(50.0, 8.0);
    let trail = Path { start: still.mid - slant, mid: still.mid, end: still.mid + slant };
    let mut rows = Vec::new();
    for outside in ladder(&[1e-2, 1e-3, 1e-4, 1e-5], chosen) {
        let psf = Psf::new(profile.clone(), outside);
        let draw = |path: &Path| {
            timed(clock, || {
                let mut out = vec![0.0; region.len()];
                psf.add(path, 1.0, &region, &mut out);
                out
            })
        };
        let (out, took) = draw(&trail);
        let mut lost = row(
            "psf.stamp",
            format!("{outside:e} outside"),
            &Errors::of(&[psf.lost()]),
            "share",
            took,
            psf.bytes(),
        );
        lost.default = outside == chosen;
        lost.by = Some(Tolerance::exactly("psf", outside));
        rows.push(lost);
        if outside == chosen {
            rows.push(against_reference("psf.trail", &psf, &trail, &region, &out, took));
            let (out, took) = draw(&still);
            rows.push(against_reference("psf.table", &psf, &still, &region, &out, took));
        }
    }
    Ok(rows)
}

/// Error of the drawn image `out` at pixels along the path, in shares of the light.
fn against_reference(
    name: &str,
    psf: &Psf,
    path: &Path,
    region: &Region,
    out: &[f64],
    time_s: f64,
) -> AccuracyRow {
    let steps = if path.length() > 0.0 { 4000 } else { 1 };
    let errors = (0..40)
        .map(|k| {
            let along = path.at(f64::from(k) / 39.0);
            let pixel =
                DVec2::new((along.x + f64::from(k % 5) - 2.0).round(), (along.y + f64::from(k % 7) - 3.0).round());
            let exact = Psf::reference(psf.profile(), path, pixel, 24, steps);
            out[pixel.y as usize * region.width + pixel.x as usize] - exact
        })
        .collect::<Vec<_>>();
    let mut row =
        row(name, "default".into(), &Errors::of(&errors), "share of light in a pixel", time_s, psf.bytes());
    row.default = true;
    row
}

/// Mark the settings that no other of the same family beats in both error and time.
fn mark_pareto(rows: &mut [AccuracyRow]) {
    let all = rows.to_vec();
    for row in rows {
        row.pareto = row.max_err.is_finite()
            && !all.iter().any(|other| {
                other.family() == row.family()
                    && other.max_err <= row.max_err
                    && other.time_s <= row.time_s
                    && (other.max_err < row.max_err || other.time_s < row.time_s)
            });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tolerances_are_rounded_up_to_a_digit() {
        for (value, rounded) in [(1.67e-5, 2e-5), (2e-3, 2e-3), (9.3e-4, 1e-3), (0.5, 0.5), (1.0, 1.0)] {
            assert_eq!(round_up(value), rounded, "{value}");
            assert!(round_up(value) >= value);
        }
    }

    /// Of three settings the one that another beats in both is not on the front; other approximations and other shapes do not count.
    #[test]
    fn the_front_has_what_nothing_beats() {
        let of = |name: &str, setting: &str, max, time_s| {
            row(name, setting.into(), &Errors { max, rms: max }, "relative", time_s, 0)
        };
        let mut rows = vec![
            of("sky.nodes", "a", 1e-2, 1.0),
            of("sky.nodes", "b", 1e-3, 2.0),
            of("sky.nodes", "c", 1e-2, 2.0),
            of("object.exact", "box: exact", 0.0, 3.0),
            of("object.rays", "box: rays", 0.1, 4.0),
            of("object.rays", "dish: rays", 0.1, 4.0),
            of("psf.stamp", "unknown", f64::NAN, 1.0),
        ];
        mark_pareto(&mut rows);
        let front = rows.iter().map(|r| r.pareto).collect::<Vec<_>>();
        assert_eq!(front, [true, true, false, true, false, true, false]);
    }
}
