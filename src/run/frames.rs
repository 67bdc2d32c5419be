//! Rendering a scene's frames into its directory.

use super::{OutputDir, RunError};
use crate::base::ledger::Ledger;
use crate::camera::expose;
use crate::camera::region::Region;
use crate::camera::scenery::Scenery;
use crate::camera::truth::{self, Truth};
use crate::io::ecsv::to_ecsv;
use crate::io::{atomic, checksum, fits, image, labels, preview};
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
        let there = dir.frame(view.frame).exists();
        if !asked && !there {
            continue;
        }
        let mut scenery = simulator.timed_scenery(view, job.clock);
        let region = match (asked, there) {
            // a frame of another shard: taken as it is
            (false, _) => match stored_as(dir, view.frame) {
                Some(region) => region,
                None => continue,
            },
            (true, _) => job.crop.unwrap_or_else(|| asked_region(simulator.scene, &scenery)),
        };
        if region.is_empty() {
            (job.done)(&Done::Skipped(view.frame, "the crop holds no pixel of this frame".into()));
            continue;
        }
        let kept = there && is_whole(dir, view.frame, simulator.scene_sha());
        if asked && kept && stored_as(dir, view.frame) != Some(region) {
            return Err(RunError::Occupied {
                dir: dir.path().display().to_string(),
                what: format!("frame {} with other pixels than those asked for", view.frame),
            });
        }
        if asked {
            write_companions(simulator, view, &scenery, &region, kept, dir)?;
        }
        let began = (job.clock)();
        let done = if kept || !asked {
            Done::Kept(view.frame)
        } else {
            write_frame(simulator, view, &scenery, &region, dir)?;
            Done::Written(view.frame)
        };
        if let Some(row) = scenery.ledger.iter_mut().find(|row| row.name == "detector.shot") {
            // means, draw, the detector's other steps and the file together
            row.ms = ((job.clock)() - began) * 1e3;
        }
        rendered.truth.extend(truth::of(simulator.scene, view, &scenery, &region));
        rendered.ledger.fold(&scenery.ledger);
        rendered.frames.push(view.frame);
        (job.done)(&done);
    }
    Ok(rendered)
}

/// The pixels of a frame that the scene's `[output]` asks for.
fn asked_region(scene: &Scene, scenery: &Scenery) -> Region {
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

/// The pixels that a frame on disk holds, by its header: the reference pixel lies at the whole frame's centre.
fn stored_as(dir: &OutputDir, number: usize) -> Option<Region> {
    let header = image::keywords(&dir.frame(number)).ok()?;
    let whole = |keyword: &str| header.number(keyword).filter(|v| *v >= 0.0).map(|v| v.round() as usize);
    Some(Region { x0: whole("CROPX0")?, y0: whole("CROPY0")?, width: whole("NAXIS1")?, height: whole("NAXIS2")? })
}

/// True if the frame is of this scene and its bytes are as they were written: the sum of a whole FITS file is -0.
fn is_whole(dir: &OutputDir, number: usize, scene_sha: &str) -> bool {
    let path = dir.frame(number);
    let of_scene = image::keywords(&path).is_ok_and(|h| h.text("SCENESHA").as_deref() == Some(scene_sha));
    of_scene && std::fs::read(&path).is_ok_and(|bytes| checksum::ones_complement_sum(&bytes, 0) == u32::MAX)
}

/// Write the planes, star table and preview of a frame that are asked for; beside a frame that is `kept` only those that
/// are not there yet.
fn write_companions(
    simulator: &Simulator,
    view: &View,
    scenery: &Scenery,
    region: &Region,
    kept: bool,
    dir: &OutputDir,
) -> Result<(), RunError> {
    let output = &simulator.scene.output;
    let number = view.frame;
    let mut planes = Vec::new();
    for (name, unit) in [("mean", "electron"), ("variance", "electron2")] {
        if output.planes.iter().any(|plane| plane == name) {
            let path = dir.numbered("planes", &format!("{name}_"), number, "fits")?;
            if !(kept && path.exists()) {
                planes.push((name, unit, path));
            }
        }
    }
    if !planes.is_empty() {
        let (mean, variance) = expose::planes(simulator.scene, scenery, region);
        let labelled = simulator.labelled(view, scenery, region);
        for (name, unit, path) in planes {
            let plane = if name == "mean" { &mean } else { &variance };
            let header = labels::plane(&labelled, unit);
            fits::write(&path, region.width, region.height, fits::Pixels::F32(plane), &header)?;
        }
    }
    if output.format.iter().any(|format| format == "png") && kept {
        let path = dir.numbered("previews", "", number, "png")?;
        if !path.exists() {
            let image = image::Image::read(&dir.frame(number))?;
            let adu = image.data.iter().map(|v| *v as u16).collect::<Vec<_>>();
            atomic::write(&path, &preview::png(image.width, image.height, &adu)?)?;
        }
    }
    if output.star_table {
        let path = dir.numbered("stars", "stars_", number, "ecsv")?;
        if !(kept && path.exists()) {
            let table = truth::star_table(number, &scenery.stars, region);
            atomic::write(&path, to_ecsv(&table).as_bytes())?;
        }
    }
    Ok(())
}

/// Write a frame and its preview. The frame comes last: where it is, everything of it is.
fn write_frame(
    simulator: &Simulator,
    view: &View,
    scenery: &Scenery,
    region: &Region,
    dir: &OutputDir,
) -> Result<(), RunError> {
    let (width, height) = (region.width, region.height);
    let adu = simulator.pixels(view, scenery, region);
    if simulator.scene.output.format.iter().any(|format| format == "png") {
        let path = dir.numbered("previews", "", view.frame, "png")?;
        atomic::write(&path, &preview::png(width, height, &adu)?)?;
    }
    let header = labels::frame(&simulator.labelled(view, scenery, region));
    fits::write(&dir.frame(view.frame), width, height, fits::Pixels::U16(&adu), &header)?;
    Ok(())
}
