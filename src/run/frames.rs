//! Rendering a scene's frames into its directory.

use super::{OutputDir, RunError};
use crate::base::ledger::Ledger;
use crate::camera::expose;
use crate::camera::psf::Region;
use crate::camera::scenery::Scenery;
use crate::camera::truth::{self, Truth};
use crate::io::ecsv::to_ecsv;
use crate::io::{atomic, fits, image, labels, preview};
use crate::plan::view::View;
use crate::scene::{Crop, Scene};
use crate::simulate::{Simulator, whole};
use glam::DVec2;
use std::ops::Range;

/// Which frames and pixels to render, and how to tell of it.
pub struct Job<'j> {
    /// Frame numbers.
    pub frames: Range<usize>,
    /// The pixels of each frame; none = what the scene's `[output]` says.
    pub crop: Option<Region>,
    /// Seconds since some moment; only differences count. The ledger's times come from here.
    pub clock: &'j dyn Fn() -> f64,
    /// Called when a frame is done.
    pub done: &'j dyn Fn(&Done),
}

/// What became of a frame.
#[derive(Debug, Clone, PartialEq)]
pub enum Done {
    /// Written.
    Written(usize),
    /// An earlier run had written it.
    Kept(usize),
    /// Not rendered, and why.
    Skipped(usize, String),
}

/// What a rendering leaves behind besides the files.
#[derive(Debug, Default)]
pub struct Rendered {
    /// Truth of the targets in all frames that are there.
    pub truth: Vec<Truth>,
    /// The ledger of all frames that are there.
    pub ledger: Ledger,
    /// Numbers of the frames that are there.
    pub frames: Vec<usize>,
}

/// Why a view has no frame, if it has none.
pub fn refused(scene: &Scene, view: &View) -> Option<String> {
    if scene.exposures.duration_s <= 0.0 {
        Some("exposures.duration_s = 0 makes no frame".into())
    } else if view.observability.below_horizon {
        Some(format!("the frame's centre is {:.1} deg below the horizon", -view.centre.elevation.to_degrees()))
    } else if scene.exposures.only_observable && !view.observability.observable {
        Some(view.observability.why.clone())
    } else {
        None
    }
}

/// Render the frames of `job` that are not there yet. Truth and ledger cover all frames of the scene that are
/// there afterwards, so that shards written one after the other end with the tables of the whole.
///
/// # Errors
/// [`RunError`]; finished frames stay.
pub fn render(simulator: &Simulator, views: &[View], dir: &OutputDir, job: &Job) -> Result<Rendered, RunError> {
    let mut rendered = Rendered::default();
    for view in views {
        let asked = job.frames.contains(&view.frame);
        if let Some(why) = refused(simulator.scene, view) {
            if asked {
                (job.done)(&Done::Skipped(view.frame, why));
            }
            continue;
        }
        if !asked && !dir.frame(view.frame).exists() {
            continue;
        }
        let began = (job.clock)();
        let mut scenery = simulator.scenery(view);
        let prepared = (job.clock)();
        let region = job.crop.unwrap_or_else(|| stored_region(simulator.scene, &scenery));
        if region.is_empty() {
            (job.done)(&Done::Skipped(view.frame, "the crop holds no pixel of this frame".into()));
            continue;
        }
        let done = if is_finished(dir, view.frame, simulator.scene_sha(), &region) {
            Done::Kept(view.frame)
        } else {
            write_frame(simulator, view, &scenery, &region, dir)?;
            Done::Written(view.frame)
        };
        note_times(&mut scenery, (prepared - began) * 1e3, ((job.clock)() - prepared) * 1e3);
        rendered.truth.extend(truth::of(simulator.scene, view, &scenery));
        rendered.ledger.fold(&scenery.ledger);
        rendered.frames.push(view.frame);
        (job.done)(&done);
    }
    Ok(rendered)
}

/// The pixels of a frame that are stored.
fn stored_region(scene: &Scene, scenery: &Scenery) -> Region {
    match scene.output.crop {
        Crop::None => whole(scene),
        Crop::Rect([x0, y0, width, height]) => cut(scene, Region { x0, y0, width, height }),
        Crop::Target => {
            let centre = scenery.targets.first().map_or(DVec2::NAN, |t| t.path.mid);
            let side = scene.output.crop_px as f64;
            let low = (centre - side / 2.0).round().max(DVec2::ZERO);
            if !low.is_finite() {
                return whole(scene);
            }
            let side = scene.output.crop_px;
            cut(scene, Region { x0: low.x as usize, y0: low.y as usize, width: side, height: side })
        }
    }
}

/// `region` without what lies outside the frame.
pub fn cut(scene: &Scene, region: Region) -> Region {
    let [width, height] = scene.detector.size_px;
    let (x0, y0) = (region.x0.min(width), region.y0.min(height));
    Region { x0, y0, width: region.width.min(width - x0), height: region.height.min(height - y0) }
}

/// True if the frame is there, whole, and of this scene and region.
fn is_finished(dir: &OutputDir, number: usize, scene_sha: &str, region: &Region) -> bool {
    image::keywords(&dir.frame(number)).is_ok_and(|header| {
        header.text("SCENESHA").as_deref() == Some(scene_sha)
            && header.number("NAXIS1") == Some(region.width as f64)
            && header.number("NAXIS2") == Some(region.height as f64)
    })
}

fn write_frame(
    simulator: &Simulator,
    view: &View,
    scenery: &Scenery,
    region: &Region,
    dir: &OutputDir,
) -> Result<(), RunError> {
    let output = &simulator.scene.output;
    let number = view.frame;
    let (width, height) = (region.width, region.height);
    let asked = |list: &[String], name: &str| list.iter().any(|entry| entry == name);
    let labelled = simulator.labelled(view, scenery, region);
    if asked(&output.planes, "mean") || asked(&output.planes, "variance") {
        let (mean, variance) = expose::planes(simulator.scene, scenery, region);
        for (name, unit, plane) in [("mean", "electron", mean), ("variance", "electron2", variance)] {
            if asked(&output.planes, name) {
                let path = dir.numbered("planes", &format!("{name}_"), number, "fits")?;
                fits::write(&path, width, height, fits::Pixels::F32(&plane), &labels::plane(&labelled, unit))?;
            }
        }
    }
    if output.star_table {
        let path = dir.numbered("stars", "stars_", number, "ecsv")?;
        atomic::write(&path, to_ecsv(&truth::star_table(number, &scenery.stars)).as_bytes())?;
    }
    let adu = simulator.pixels(view, scenery, region);
    if asked(&output.format, "png") {
        let path = dir.numbered("previews", "", number, "png")?;
        atomic::write(&path, &preview::png(width, height, &adu)?)?;
    }
    // the frame itself comes last: where it is, everything of it is
    fits::write(&dir.frame(number), width, height, fits::Pixels::U16(&adu), &labels::frame(&labelled))?;
    Ok(())
}

/// Enter the times \[ms\] of preparing and exposing a frame into its ledger.
fn note_times(scenery: &mut Scenery, prepare_ms: f64, expose_ms: f64) {
    let rows = &mut scenery.ledger;
    let prepared = rows.iter().filter(|r| r.is_needed() && is_prepared(&r.name)).count().max(1) as f64;
    for row in rows.iter_mut().filter(|r| r.is_needed()) {
        if is_prepared(&row.name) {
            row.ms = prepare_ms / prepared;
        } else if row.name == "detector.shot" {
            row.ms = expose_ms;
        }
    }
}

fn is_prepared(name: &str) -> bool {
    name.starts_with("sky.") || name == "optics.psf" || name == "stars.drawn"
}
