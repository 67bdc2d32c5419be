//! The stars of a frame: which are drawn, where they move, how much light they give, and what the ledger says of them.

use super::path::{Path, rolled};
use super::point_source::PointSource;
use super::scintillation;
use super::star_limit::{Clumping, sharpness};
use crate::base::ledger::{Row, Verdict, Why};
use crate::base::random::{Address, Stage};
use crate::base::sample::uniform;
use crate::base::units::{flux_from_mag, mag_from_flux};
use crate::plan::view::View;
use crate::scene::{Scene, Table};
use crate::sky::{self, Context};
use crate::stars::catalogue::Catalogue;
use crate::stars::counts::{Counts, DEG2_PER_SR, Galactic};
use crate::stars::drawn::Drawn;
use crate::stars::field::{self, Cone};
use crate::stars::synthetic;
use glam::{DVec2, DVec3};
use rayon::prelude::*;

/// Most stars expected in a frame: of a limit that follows from the noise, and of one that the scene gives.
const MOST_BY_NOISE: f64 = 2e5;
const MOST_ASKED: f64 = 5e6;

/// Pixels of a frame.
pub fn frame_pixels(scene: &Scene) -> f64 {
    (scene.detector.light_px()[0] * scene.detector.light_px()[1]) as f64
}

/// Electrons of `sources` that fall inside the frame, of a trail in parts.
pub fn inside<'s>(scene: &Scene, sources: impl Iterator<Item = &'s PointSource>) -> f64 {
    const PARTS: usize = 8;
    let [width, height] = scene.detector.light_px().map(|n| n as f64 - 0.5);
    let within = |p: DVec2| p.x >= -0.5 && p.y >= -0.5 && p.x < width && p.y < height;
    let share = |path: &Path| {
        let middle = |k: usize| path.at((k as f64 + 0.5) / PARTS as f64);
        (0..PARTS).filter(|k| within(middle(*k))).count() as f64 / PARTS as f64
    };
    sources.map(|s| s.electrons * share(&s.path)).sum()
}

/// The path of an astrometric direction at rest among the stars, if it is in front of the camera.
fn star_path(view: &View, icrs: DVec3) -> Option<Path> {
    let pixel = |wcs: &crate::plan::wcs::Wcs| wcs.pixel(icrs);
    Some(Path { start: pixel(&view.wcs.start)?, mid: pixel(&view.wcs.mid)?, end: pixel(&view.wcs.end)? })
}

/// Which stars are drawn: down to the scene's limit, else until the rest does not matter against a pixel's `noise` \[e-\].
pub fn drawn(context: &Context, view: &View, catalogue: &Catalogue, fwhm_px: f64, noise: f64) -> Drawn {
    let stars = &context.scene.stars;
    if !stars.enabled || stars.random_count > 0 || stars.catalog == Table::Named("none".into()) {
        return Drawn::None;
    }
    let centre = view.wcs.mid.centre;
    if !stars.synthetic {
        return field::catalogue_alone(catalogue, centre, stars.limit_mag_v.unwrap_or(f64::INFINITY));
    }
    let limit = stars.limit_mag_v.unwrap_or_else(|| {
        let trail_px = star_path(view, centre).map_or(0.0, |path| path.length());
        let clumping = Clumping {
            counts: Counts::at(Galactic::of(centre)),
            star_e: context.response.stars.solar().at(view.airmass) * view.exposure_s,
            pixel_sr: context.pixel_sr,
            sharpness: sharpness(fwhm_px, trail_px),
        };
        clumping.limit(context.scene.accuracy.omit, noise)
    });
    let most = if stars.limit_mag_v.is_some() { MOST_ASKED } else { MOST_BY_NOISE };
    Drawn::All { limit: limit.min(synthetic::FAINTEST).min(affordable(context, swept(context, view), most)) }
}

/// How many times more stars are looked at than a frame holds, where the sky moves far during an exposure: those of a cone about all
/// of its path; four frames of a cone about the frame itself are not counted.
fn swept(context: &Context, view: &View) -> f64 {
    let pixels = frame_pixels(context.scene);
    let scale = view.wcs.mid.pixel_scale();
    let drift = view.wcs.start.centre.distance(view.wcs.end.centre);
    let radius = (pixels.sqrt() * scale + drift).min(std::f64::consts::PI);
    let cone_sr = std::f64::consts::TAU * (1.0 - libm::cos(radius));
    let frames = cone_sr / (4.0 * pixels * scale * scale);
    if frames.is_finite() { frames.max(1.0) } else { 1.0 }
}

/// The limit, by quarter magnitudes, down to which a frame holds `most` stars by the counts.
fn affordable(context: &Context, swept: f64, most: f64) -> f64 {
    let deg2 = swept * frame_pixels(context.scene) * context.pixel_sr.min(1.0) * DEG2_PER_SR;
    let deg2 = deg2.min(4.0 * std::f64::consts::PI * DEG2_PER_SR);
    let places = context.field.samples.iter().map(|t| Counts::at(Galactic::of(t.icrs))).collect::<Vec<_>>();
    let expected = |limit: f64| {
        deg2 * places.iter().map(|c| c.brighter_than(limit)).sum::<f64>() / places.len().max(1) as f64
    };
    let mut limit = synthetic::FAINTEST;
    while limit > 0.0 && expected(limit) > most {
        limit -= 0.25;
    }
    limit
}

/// Rows of the drawn stars: of the catalogue (or benchmark), and synthetic.
pub fn rows(context: &Context, view: &View, drawn: &Drawn, stars: &[PointSource], ms: f64) -> [Row; 2] {
    let scene = context.scene;
    let pixels = frame_pixels(scene);
    let (synthetic, listed): (Vec<&PointSource>, Vec<&PointSource>) =
        stars.iter().partition(|s| s.id >= synthetic::FIRST_ID);
    let light = |list: &[&PointSource]| list.iter().map(|s| s.electrons).sum::<f64>() / pixels;
    let limit = match drawn {
        Drawn::None => f64::INFINITY,
        Drawn::All { limit } | Drawn::Catalogue { faintest: limit, .. } => *limit,
    };
    let none = Table::Named("none".into());
    let row = |name: &str, list: &[&PointSource], asked: bool, basis: String| {
        let verdict = if !asked {
            Verdict::Absent(Why::NotAsked)
        } else if list.is_empty() && scene.stars.catalog == none && scene.stars.random_count == 0 {
            Verdict::Absent(Why::NotVisible(
                "stars.catalog = \"none\": no star is drawn, of the counts neither".into(),
            ))
        } else if list.is_empty() && limit.is_finite() {
            Verdict::Absent(Why::NotVisible(format!("none brighter than V {limit:.2} in the field")))
        } else if list.is_empty() {
            Verdict::Absent(Why::NotVisible("none in the field".into()))
        } else {
            Verdict::Needed { bound: light(list) }
        };
        let mut row = Row::new(name, &verdict, &basis);
        if verdict.is_needed() {
            row.mean_e_px = light(list);
            row.ms = ms * list.len() as f64 / stars.len().max(1) as f64;
            row.bytes = (list.len() * size_of::<PointSource>()) as u64;
        }
        row
    };
    let (offset, spread) =
        context.response.stars.error_of_solar(FIELD_BV, FIELD_BV_SIGMA, context.field.centre().airmass);
    let unknown = format!(
        "solar colour where unknown: {offset:+.3} mag, rms {spread:.3} mag if B-V is {FIELD_BV} +- {FIELD_BV_SIGMA}"
    );
    let coloured = listed.iter().filter(|s| s.coloured).count();
    let basis = match scene.stars.random_count {
        0 => format!("{} stars, {coloured} with known colour; {unknown}", listed.len()),
        _ => format!("{} stars at random places, solar colour", listed.len()),
    };
    let asked = scene.stars.limit_mag_v.map_or(MOST_BY_NOISE, |_| MOST_ASKED);
    let cut = if limit < synthetic::FAINTEST && limit >= affordable(context, swept(context, view), asked) {
        format!(" (a frame holds {asked:.0} stars at most)")
    } else {
        String::new()
    };
    let counted = format!(
        "{} stars down to V {limit:.2}{cut}, Bahcall & Soneira 1980 beyond the catalogue; solar colour",
        synthetic.len()
    );
    let mut rows = [
        row("stars.drawn", &listed, scene.stars.enabled, basis),
        row(
            "stars.synthetic",
            &synthetic,
            scene.stars.enabled && scene.stars.synthetic && scene.stars.random_count == 0,
            counted,
        ),
    ];
    // of a magnitude, as a share of the light
    let colour = if scene.stars.random_count == 0 { spread * std::f64::consts::LN_10 / 2.5 } else { 0.0 };
    rows[0].uncertainty = if rows[0].is_needed() { colour } else { 0.0 };
    rows[1].uncertainty = if rows[1].is_needed() { colour.hypot(0.2) } else { 0.0 };
    rows
}

/// B-V of field stars of V 7 to 9 and its spread \[mag\]: mean of 41 000 Hipparcos stars (ESA 1997).
const FIELD_BV: f64 = 0.71;
const FIELD_BV_SIGMA: f64 = 0.49;

/// The stars of `drawn` whose images, `margin` px wide, touch the frame, in the order of their catalogue; synthetic ones last.
pub fn stars(
    context: &Context,
    view: &View,
    catalogue: &Catalogue,
    drawn: &Drawn,
    margin: f64,
) -> Vec<PointSource> {
    let scene = context.scene;
    let size = DVec2::new(scene.detector.light_px()[0] as f64, scene.detector.light_px()[1] as f64);
    let touches = |path: &Path| {
        let (low, high) = path.bounds();
        high.cmpge(DVec2::splat(-margin)).all() && low.cmple(size + margin).all()
    };
    let source = |id: u64, icrs: DVec3, mag_v: f64, colour_bv: Option<f64>| {
        let (path, share) = rolled(scene, view, star_path(view, icrs)?);
        if !touches(&path) {
            return None;
        }
        let airmass = sky::context::toward(view, path.mid).airmass;
        let sigma = scintillation::sigma(scene, view.exposure_s, airmass);
        let twinkle = scintillation::factor(scene.seed, view.frame, id, sigma);
        // the magnitude of sunlight that gives these electrons
        let light = &context.response.stars;
        let mag_v = mag_v + mag_from_flux(light.at(colour_bv, airmass) / light.solar().at(airmass));
        let rate = light.solar().at(airmass) * flux_from_mag(mag_v);
        let electrons = rate * view.exposure_s * twinkle * share;
        Some(PointSource { id, icrs, mag_v, path, electrons, coloured: colour_bv.is_some() })
    };
    if !scene.stars.enabled {
        return Vec::new();
    }
    if scene.stars.random_count > 0 {
        let places = random_places(scene, view);
        return places.filter_map(|(id, icrs, mag_v)| source(id, icrs, mag_v, None)).collect();
    }
    let scale = view.wcs.mid.pixel_scale();
    let drift = view.wcs.start.centre.distance(view.wcs.end.centre);
    let cone = Cone {
        centre: view.wcs.mid.centre,
        radius: 1.05 * (0.5 * size.length() + margin) * scale + drift,
        year: view.mid.julian_year(),
    };
    let field = field::stars(catalogue, drawn, &cone);
    field.into_par_iter().filter_map(|s| source(s.id, s.direction, s.mag_v, s.colour_bv)).collect()
}

/// Benchmark stars: uniform over the frame at mid-exposure, dN/dm ~ 10^(0.35 m).
fn random_places(scene: &Scene, view: &View) -> impl IndexedParallelIterator<Item = (u64, DVec3, f64)> {
    let address = Address { seed: scene.stars.random_seed, frame: 0, stage: Stage::RandomStars };
    let [width, height] = scene.detector.light_px().map(|n| n as f64);
    let [bright, faint] = scene.stars.random_mag_v.map(|m| libm::exp10(0.35 * m));
    let wcs = view.wcs.mid;
    (0..scene.stars.random_count).into_par_iter().map(move |number| {
        let id = number as u64;
        let [x, y] = address.block(id, 0).map(uniform);
        let u = uniform(address.block(id, 1)[0]);
        let mag_v = libm::log10(bright + u * (faint - bright)) / 0.35;
        (id, wcs.sky(DVec2::new(x * width - 0.5, y * height - 0.5)), mag_v)
    })
}
