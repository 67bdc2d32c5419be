//! What a frame would hold without noise: the mean electrons of every pixel, computed for any region.

use super::chip::Incident;
use super::detector::dark::Dark;
use super::evenness::Evenness;
use super::field_stars;
use super::optics::Optics;
use super::path::{Path, rolled};
use super::point_source::PointSource;
use super::psf::Psf;
use super::region::Region;
use super::scintillation;
use super::trails::Trails;
use crate::base::ledger::{Row, Verdict, Why};
use crate::light::tabulated::Tabulated;
use crate::plan::brightness::TargetLight;
use crate::plan::view::{TargetView, View};
use crate::scene::{Brightness, Scene};
use crate::sky::response::Response;
use crate::sky::{self, Context, Source, field::SkyField};
use crate::stars::catalogue::Catalogue;
use crate::stars::drawn::Drawn;
use glam::{DVec2, DVec3};
use std::ops::Range;

/// Mean at the frame's centre of one sky source.
#[derive(Debug, Clone, PartialEq)]
pub struct SkyMean {
    /// Keyword of the header.
    pub keyword: &'static str,
    /// Mean \[e-/px\].
    pub mean_e_px: f64,
}

/// Everything that is needed to compute any pixel's mean.
#[derive(Debug, Clone)]
pub struct Scenery {
    /// The point image.
    pub psf: Psf,
    /// Stars in the order of their catalogue.
    pub stars: Vec<PointSource>,
    /// Targets in the scene's order.
    pub targets: Vec<PointSource>,
    /// Parts of each target's path with their shares of its light; none where the light is even.
    pub streaks: Vec<Vec<(Path, f64)>>,
    /// Means at the centre of the sky sources present, in the order of the header.
    pub sky_means: Vec<SkyMean>,
    /// Dark charge \[e-/px\].
    pub dark_e: f64,
    /// Electrons per second of a solar-coloured source of V = 0, against airmass.
    pub solar_v_zero: Tabulated,
    /// Full width at half maximum as delivered \[arcsec\].
    pub seeing_arcsec: f64,
    /// What is in the frame and what is not.
    pub ledger: Vec<Row>,
    /// How evenly optics and shutter light the chip.
    pub evenness: Evenness,
    sky: SkyField,
    /// The sources of `sky` one by one, where the scene asks for them.
    parts: Vec<(String, SkyField)>,
    trails: Trails,
    /// Light of stars and targets outside their stamps, spread over the frame \[e-/px\].
    pub lost_e_px: f64,
    /// Stars are cut where they fall below this \[e-/px\].
    edge: f64,
}

/// What a star may leave out of a pixel, as a share of what sources of diffuse light may: many stars overlap.
const EDGE: f64 = 0.1;

/// Number of a target's scintillation: stars are numbered from 0 upwards, targets from the top downwards.
fn target_number(index: usize) -> u64 {
    u64::MAX - index as u64
}

impl Scenery {
    /// The scenery of one exposure in which the targets have these `lights`. `clock` gives seconds since some moment; the ledger's times come from it.
    pub fn new(
        scene: &Scene,
        (view, lights): (&View, &[TargetLight]),
        response: &Response,
        optics: &Optics,
        catalogue: &Catalogue,
        clock: &(dyn Fn() -> f64 + Sync),
    ) -> Self {
        let context = Context::of_view(scene, view, response);
        let dark_e = Dark::new(&scene.detector, view.exposure_s).mean_e();
        let profile = optics.profile(scene, view.airmass);
        let fwhm_px = profile.fwhm();
        let seeing_arcsec = fwhm_px * scene.stored_scale_arcsec();

        let noise = noise(&context, dark_e);
        let drawn = field_stars::drawn(&context, view, catalogue, fwhm_px, noise);
        let sources = sky::sources(&context, &drawn);
        let (present, mut ledger) = sky::compose(&context, &sources, scene.accuracy.omit * noise);
        let sky_field = SkyField::new(view, scene, &present, scene.accuracy.sky, clock);
        let centre = context.field.centre();
        let sky_means = present
            .iter()
            .map(|s| SkyMean { keyword: s.keyword(), mean_e_px: s.mean(centre) })
            .collect::<Vec<_>>();
        for (source, seconds) in present.iter().zip(&sky_field.seconds) {
            if let Some(row) = ledger.iter_mut().find(|row| row.name == source.name()) {
                row.ms = seconds * 1e3;
                row.bytes = sky_field.bytes() as u64;
            }
        }

        let parts = if scene.output.format.iter().any(|format| format == "exr") {
            let part = |source: &&dyn Source| {
                (
                    source.name().replace("sky.", "mean."),
                    SkyField::new(view, scene, &[*source], scene.accuracy.sky, clock),
                )
            };
            present.iter().map(part).collect()
        } else {
            Vec::new()
        };

        let began = clock();
        let psf = Psf::new(profile, scene.accuracy.psf);
        let psf_ms = (clock() - began) * 1e3;

        let began = clock();
        let stars = field_stars::stars(&context, view, catalogue, &drawn, psf.radius() as f64);
        let edge = EDGE * scene.accuracy.omit * noise;
        let trails = Trails::new(&psf, &stars, edge, scene.accuracy.trail_px);
        let stars_ms = (clock() - began) * 1e3;
        let targets = targets(scene, view, lights, &context);
        let streaks = lights.iter().zip(&targets).map(|(light, target)| streak(light, target)).collect();
        let sources = field_stars::inside(scene, stars.iter().chain(&targets));
        // of an image wider than the frame the frame has its part
        let square = (2.0 * psf.radius() as f64 + 1.0).powi(2);
        let lost_e_px = psf.lost() * sources / field_stars::frame_pixels(scene).max(square);
        let mean_light = |list: &[PointSource]| {
            list.iter().map(|s| s.electrons).sum::<f64>() / field_stars::frame_pixels(scene)
        };
        let target_verdict = if targets.iter().any(|t| t.electrons > 0.0) {
            Verdict::Needed { bound: mean_light(&targets) }
        } else {
            Verdict::Absent(Why::NotVisible("no target, or none lit".into()))
        };
        ledger.extend(field_stars::rows(&context, view, &drawn, &stars, stars_ms));
        let mut target = Row::new("target", &target_verdict, &target_basis(scene, lights));
        target.mean_e_px = mean_light(&targets);
        ledger.push(target);
        ledger.extend(scene.target.iter().zip(lights).filter_map(|(target, light)| light.row(&target.name)));
        let sigma = scintillation::sigma(scene, view.exposure_s, view.airmass);
        let twinkle = if sigma > 0.0 { Verdict::Needed { bound: sigma } } else { Verdict::Absent(Why::NotAsked) };
        ledger.push(Row::new(
            "optics.scintillation",
            &twinkle,
            &format!("sigma {:.2} %, Young 1967", sigma * 100.0),
        ));
        let asked = |share: f64| {
            if share > 0.0 { Verdict::Needed { bound: share } } else { Verdict::Absent(Why::NotAsked) }
        };
        let corner = scene.telescope.vignetting;
        let basis = format!("the corner loses {:.1} % of the light", 100.0 * corner);
        ledger.push(Row::new("optics.vignetting", &asked(corner), &basis));
        let bend = view.wcs.mid.corner_shift();
        let basis = format!(
            "optics and air together: up to {bend:.2} px from a straight field, in the header's SIP cards"
        );
        ledger.push(Row::new("optics.distortion", &asked(bend), &basis));
        let mut psf_row =
            Row::new("optics.psf", &Verdict::Needed { bound: psf.lost() }, &psf_basis(scene, &psf, seeing_arcsec));
        (psf_row.bytes, psf_row.ms) = (psf.bytes() as u64, psf_ms);
        ledger.push(psf_row);

        let mut scenery = Self {
            psf,
            stars,
            targets,
            streaks,
            sky_means,
            dark_e,
            solar_v_zero: response.stars.solar().clone(),
            seeing_arcsec,
            ledger,
            evenness: Evenness::of(scene, view.exposure_s),
            sky: sky_field,
            parts,
            trails,
            lost_e_px,
            edge,
        };
        let peak = scenery.peak();
        scenery.ledger.extend(super::detector::assess(scene, view.exposure_s, peak));
        scenery
    }

    /// Mean electrons of the pixels of `region`, by rows, but of target number `left_out`; of a chip whose pixels are all alike.
    pub fn mean_without(&self, region: &Region, left_out: usize, out: &mut [f64]) {
        self.light_without(region, left_out, out);
        self.evenness.apply(region, out);
        out.iter_mut().for_each(|value| *value += self.dark_e);
    }

    /// Mean light \[e-\] of the pixels of `region`, by rows, but of target number `left_out`.
    fn light_without(&self, region: &Region, left_out: usize, out: &mut [f64]) {
        if region.is_empty() {
            return;
        }
        for (y, row) in (region.y0..).zip(out.chunks_exact_mut(region.width)) {
            self.sky.add_row(y, region.x0, self.lost_e_px, row);
        }
        self.add_stars(region, out);
        self.add_targets(region, left_out, out);
    }

    fn add_stars(&self, region: &Region, out: &mut [f64]) {
        for number in self.trails.touching(region) {
            self.trails.add(&self.psf, number, &self.stars[number], self.edge, region, out);
        }
    }

    fn add_targets(&self, region: &Region, left_out: usize, out: &mut [f64]) {
        for (i, target) in self.targets.iter().enumerate().filter(|(i, _)| *i != left_out) {
            self.add_target(i, target.electrons, region, out);
        }
    }

    /// Add the image of target number `index`, of so many electrons, to the pixels of `region`.
    pub fn add_target(&self, index: usize, electrons: f64, region: &Region, out: &mut [f64]) {
        let (Some(target), parts) = (self.targets.get(index), self.streaks.get(index)) else { return };
        match parts.filter(|parts| !parts.is_empty()) {
            Some(parts) => {
                parts.iter().for_each(|(path, share)| self.psf.add(path, electrons * share, region, out));
            }
            None => self.psf.add(&target.path, electrons, region, out),
        }
    }

    /// Largest mean of a source \[e-/px\], overlaps left out: a point's light in its central pixel, or a trail's per pixel of its length
    /// across the width of the image.
    fn peaks(&self) -> impl Fn(&PointSource) -> f64 {
        let mut central = [0.0];
        let one = Region { x0: 0, y0: 0, width: 1, height: 1 };
        self.psf.add_point(DVec2::ZERO, self.psf.whole(1.0), &one, &mut central);
        // the line profiles of the Gaussian (0.94 / FWHM) and of Moffat's profiles lie below 1.1 / FWHM
        let (point, line) = (central[0], 1.1 / self.psf.profile().fwhm());
        move |s| s.electrons * point.min(line / s.path.length().max(1e-9))
    }

    /// Means \[e-\] of the pixels of `region` of each kind of light and of dark charge, by name; 0 in the overscan. The sources of the
    /// sky are those of a scene that asks for OpenEXR frames.
    pub fn layers(&self, region: &Region) -> Vec<(String, Vec<f32>)> {
        let light = (region.x0 + region.width).min(self.sky.width()).saturating_sub(region.x0);
        let seen = Region { width: light, ..*region };
        let layer = |name: &str, add: &dyn Fn(&mut [f64]), evenness: bool| {
            let mut mean = vec![0.0; seen.len()];
            if !seen.is_empty() {
                add(&mut mean);
                if evenness {
                    self.evenness.apply(&seen, &mut mean);
                }
            }
            let mut plane = vec![0.0f32; region.len()];
            for (out, row) in plane.chunks_exact_mut(region.width).zip(mean.chunks_exact(light.max(1))) {
                out.iter_mut().zip(row).for_each(|(out, value)| *out = *value as f32);
            }
            (name.to_owned(), plane)
        };
        let sky = self.parts.iter().map(|(name, part)| {
            let add = |out: &mut [f64]| {
                for (y, row) in (seen.y0..).zip(out.chunks_exact_mut(seen.width)) {
                    part.add_row(y, seen.x0, 0.0, row);
                }
            };
            layer(name, &add, true)
        });
        sky.chain([
            layer(
                "mean.stars",
                &|out| {
                    out.fill(self.lost_e_px);
                    self.add_stars(&seen, out);
                },
                true,
            ),
            layer("mean.target", &|out| self.add_targets(&seen, usize::MAX, out), true),
            layer("mean.dark", &|out| out.fill(self.dark_e), false),
        ])
        .collect()
    }

    /// Mean diffuse light of the sky at a pixel, before optics and shutter make it uneven \[e-/px\].
    pub fn sky_at(&self, pixel: DVec2) -> f64 {
        self.sky.at(pixel)
    }

    /// True if a source of sky light is outside its model: the sky is brighter than these means by an unknown amount.
    pub fn sky_is_unknown(&self) -> bool {
        self.ledger.iter().any(|row| row.name.starts_with("sky.") && !row.is_needed() && row.bound.is_nan())
    }

    /// Magnitude `mag_v` of a source that gives one electron in this exposure at `airmass`.
    pub fn zero_point(&self, airmass: f64, exposure_s: f64) -> f64 {
        2.5 * (self.solar_v_zero.at(airmass) * exposure_s).log10()
    }

    /// An upper estimate of the brightest pixel's mean, overlaps left out \[e-\].
    fn peak(&self) -> f64 {
        let sky: f64 = self.sky_means.iter().map(|s| s.mean_e_px).sum::<f64>() + self.dark_e;
        sky + self.stars.iter().chain(&self.targets).map(self.peaks()).fold(0.0, f64::max)
    }
}

impl Incident for Scenery {
    fn add(&self, region: &Region, out: &mut [f64]) {
        self.light_without(region, usize::MAX, out);
    }

    /// Columns within the radius at which each bright source falls to a tenth of what the sky leaves free.
    fn bright_columns(&self, level_e: f64) -> Vec<Range<usize>> {
        let width = self.sky.width();
        let free = level_e - self.sky.largest();
        if free <= 0.0 {
            return std::iter::once(0..width).collect();
        }
        let (peaks, mut columns) = (self.peaks(), Vec::new());
        for source in self.stars.iter().chain(&self.targets) {
            let length = source.path.length();
            let peak = peaks(source);
            if peak.is_nan() || peak <= 0.3 * free {
                continue;
            }
            let (low, high) = source.path.bounds();
            // as a still point of the light that a trail leaves along the width of the image
            let part = source.electrons * (self.psf.profile().fwhm() / length.max(1e-9)).min(1.0);
            let reach = self.psf.reach(self.psf.stamp(part, 0.1 * free)) as f64 + 1.0;
            let from = (low.x - reach).max(0.0) as usize;
            let to = ((high.x + reach).max(-1.0) + 1.0).min(width as f64) as usize;
            if from < to {
                columns.push(from..to);
            }
        }
        columns.sort_by_key(|c| c.start);
        columns.dedup_by(|next, kept| {
            let joined = next.start <= kept.end;
            if joined {
                kept.end = kept.end.max(next.end);
            }
            joined
        });
        columns
    }
}

fn psf_basis(scene: &Scene, psf: &Psf, seeing_arcsec: f64) -> String {
    let name = match scene.telescope.psf {
        crate::scene::Psf::Gaussian => "Gaussian".to_owned(),
        crate::scene::Psf::Moffat => format!("Moffat beta {}", scene.telescope.moffat_beta),
        crate::scene::Psf::Airy => "diffraction by the aperture and its obstruction".to_owned(),
        crate::scene::Psf::Kolmogorov => "Kolmogorov turbulence and diffraction at 550 nm".to_owned(),
        crate::scene::Psf::Image(_) => "the scene's image".to_owned(),
    };
    let more =
        if psf.lost() > scene.accuracy.psf { ", more than accuracy.psf asks: the wings are too wide" } else { "" };
    let (lost, radius) = (psf.lost(), psf.radius());
    format!(
        "{name}, FWHM {seeing_arcsec:.2} arcsec, {lost:.1e} of the light outside {radius} px, spread evenly{more}"
    )
}

/// Noise of a pixel at the frame's centre, all stars taken as diffuse light \[e-\].
fn noise(context: &Context, dark_e: f64) -> f64 {
    let sources = sky::sources(context, &Drawn::None);
    let present = sources.iter().filter(|s| s.assess(&context.field).is_needed());
    let total: f64 = present.map(|s| s.mean(context.field.centre())).sum();
    (total + dark_e + context.scene.detector.read_noise_rms_e().powi(2)).sqrt()
}

fn targets(scene: &Scene, view: &View, lights: &[TargetLight], context: &Context) -> Vec<PointSource> {
    let place = |(index, (light, seen)): (usize, (&TargetLight, &TargetView))| {
        let far = DVec2::splat(f64::NAN);
        let pixel = |wcs: &crate::plan::wcs::Wcs, icrs: DVec3| wcs.pixel(icrs).unwrap_or(far);
        let icrs = seen.place.astrometric;
        let path = Path {
            start: pixel(&view.wcs.start, seen.start_end[0]),
            mid: pixel(&view.wcs.mid, icrs),
            end: pixel(&view.wcs.end, seen.start_end[1]),
        };
        let (path, share) = rolled(scene, view, path);
        let sigma = scintillation::sigma(scene, view.exposure_s, seen.airmass);
        let twinkle = scintillation::factor(scene.seed, view.frame, target_number(index), sigma);
        let above = if seen.apparent.elevation > 0.0 { 1.0 } else { 0.0 };
        let rate = context.response.stars.solar().at(seen.airmass) * light.v_flux;
        let electrons = rate * view.exposure_s * twinkle * above * share;
        PointSource { id: index as u64, icrs, mag_v: light.mag_v(), path, electrons, coloured: true }
    };
    lights.iter().zip(&view.targets).enumerate().map(place).collect()
}

/// A streak is parted where its light changes: stretches of about a pixel, no more than there are shares.
fn streak(light: &TargetLight, target: &PointSource) -> Vec<(Path, f64)> {
    let length = target.path.length();
    if light.shares.is_empty() || length.is_nan() || length <= 0.5 {
        return Vec::new();
    }
    let parts = (length.ceil() as usize).clamp(2, light.shares.len());
    let n = light.shares.len();
    let share = |k: usize| light.shares[k * n / parts..(k + 1) * n / parts].iter().sum();
    let at = |k: usize| (k * n / parts) as f64 / n as f64;
    (0..parts).map(|k| (target.path.part(at(k), at(k + 1)), share(k))).collect()
}

/// What the targets' light is made of.
fn target_basis(scene: &Scene, lights: &[TargetLight]) -> String {
    let shapes = scene.target.iter().zip(lights).filter_map(|(target, light)| match &target.brightness {
        Brightness::Shape(shaped) => Some(format!(
            "{}: {} faces, V {:.2}, {} instants of the exposure",
            target.name,
            shaped.built.body.faces.len(),
            light.mag_v(),
            light.evaluations,
        )),
        Brightness::MagV(_) => None,
    });
    let shapes = shapes.collect::<Vec<_>>();
    if shapes.is_empty() { "constant V magnitude times the share of sunlight".into() } else { shapes.join("; ") }
}
