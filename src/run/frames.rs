//! Rendering a scene's frames into its directory.

use super::{OutputDir, RunError};
use crate::base::ledger::Ledger;
use crate::camera::expose::{self, Rows};
use crate::camera::region::Region;
use crate::camera::scenery::Scenery;
use crate::camera::truth::{self, Truth};
use crate::io::ecsv::to_ecsv;
use crate::io::exr_file::{self, Samples};
use crate::io::preview::Preview;
use crate::io::{atomic, checksum, fits, fz, image, labels, regions};
use crate::plan::view::View;
use crate::scene::{Crop, Scene};
use crate::simulate::{Simulator, whole};
use glam::DVec2;
use std::io;
use std::ops::Range;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// Which frames and pixels to render, and how to tell of it.
pub struct Job<'j> {
    /// Frame numbers.
    pub frames: Range<usize>,
    /// The pixels of each frame; none = what the scene's `[output]` says.
    pub crop: Option<Region>,
    /// Seconds since some moment; only differences count. The ledger's times come from here.
    pub clock: &'j (dyn Fn() -> f64 + Sync),
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

/// What is to be done for one view.
struct Task<'v> {
    view: &'v View,
    scenery: Scenery,
    region: Region,
    /// The frame is asked for, not only there from another shard.
    asked: bool,
    /// The frame is there already.
    kept: bool,
}

/// A view's task, or why it has none.
enum Prepared<'v> {
    Task(Box<Task<'v>>),
    Skipped(usize, String),
    Nothing,
}

/// Render the frames of `job` that are not there yet, the next one prepared while one is exposed and written. Truth and ledger
/// cover all frames of the scene that are there afterwards, so that shards written one after the other end with the tables of
/// the whole.
///
/// # Errors
/// [`RunError`]; finished frames stay.
pub fn render(simulator: &Simulator, views: &[View], dir: &OutputDir, job: &Job) -> Result<Rendered, RunError> {
    let mut rendered = Rendered::default();
    // of the job, what may go to another thread
    let (frames, crop, clock) = (job.frames.clone(), job.crop, job.clock);
    let prepare = |number: usize| {
        views.get(number).map_or(Ok(Prepared::Nothing), |v| prepare(simulator, v, dir, &frames, crop, clock))
    };
    let mut next = prepare(0)?;
    for number in 0..views.len() {
        let mut task = match std::mem::replace(&mut next, Prepared::Nothing) {
            Prepared::Task(task) => task,
            other => {
                if let Prepared::Skipped(frame, why) = other {
                    (job.done)(&Done::Skipped(frame, why));
                }
                next = prepare(number + 1)?;
                continue;
            }
        };
        let began = clock();
        let ahead = || prepare(number + 1);
        let (written, prepared) = rayon::join(|| perform(simulator, &task, dir).map(|()| clock()), ahead);
        let took = written? - began;
        let Task { view, scenery, region, asked, kept } = task.as_mut();
        if let Some(row) = scenery.ledger.iter_mut().find(|row| row.name == "detector.shot") {
            // means, draw, the detector's other steps and the file together
            row.ms = took * 1e3;
        }
        rendered.truth.extend(truth::of(simulator.scene, view, scenery, region));
        rendered.ledger.fold(&scenery.ledger);
        rendered.frames.push(view.frame);
        (job.done)(&if *kept || !*asked { Done::Kept(view.frame) } else { Done::Written(view.frame) });
        next = prepared?;
    }
    Ok(rendered)
}

fn prepare<'v>(
    simulator: &Simulator,
    view: &'v View,
    dir: &OutputDir,
    frames: &Range<usize>,
    crop: Option<Region>,
    clock: &(dyn Fn() -> f64 + Sync),
) -> Result<Prepared<'v>, RunError> {
    let asked = frames.contains(&view.frame);
    if let Some(why) = refused(simulator.scene, view) {
        return Ok(if asked { Prepared::Skipped(view.frame, why) } else { Prepared::Nothing });
    }
    let there = dir.frame(view.frame).exists();
    if !asked && !there {
        return Ok(Prepared::Nothing);
    }
    let scenery = simulator.timed_scenery(view, clock)?;
    let region = match (asked, there) {
        // a frame of another shard: taken as it is
        (false, _) => match stored_as(dir, view.frame) {
            Some(region) => region,
            None => return Ok(Prepared::Nothing),
        },
        (true, _) => crop.unwrap_or_else(|| asked_region(simulator.scene, view.frame, &scenery)),
    };
    if region.is_empty() {
        return Ok(Prepared::Skipped(view.frame, "the crop holds no pixel of this frame".into()));
    }
    let kept = there && is_whole(dir, view.frame, simulator);
    if asked && kept && stored_as(dir, view.frame) != Some(region) {
        return Err(RunError::Occupied {
            dir: dir.path().display().to_string(),
            what: format!("frame {} with other pixels than those asked for", view.frame),
        });
    }
    Ok(Prepared::Task(Box::new(Task { view, scenery, region, asked, kept })))
}

/// Write what a task asks for and is not there yet. The frame comes last: where it is, everything of it is.
fn perform(simulator: &Simulator, task: &Task, dir: &OutputDir) -> Result<(), RunError> {
    if !task.asked {
        return Ok(());
    }
    write_companions(simulator, task.view, &task.scenery, &task.region, task.kept, dir)?;
    if task.kept { Ok(()) } else { write_frame(simulator, task.view, &task.scenery, &task.region, dir) }
}

/// The pixels of a frame that the scene's `[output]` asks for.
fn asked_region(scene: &Scene, frame: usize, scenery: &Scenery) -> Region {
    if scene.output.full_every > 0 && frame.is_multiple_of(scene.output.full_every) {
        return whole(scene);
    }
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
    let [width, height] = scene.detector.stored_px();
    let (x0, y0) = (region.x0.min(width), region.y0.min(height));
    Region { x0, y0, width: region.width.min(width - x0), height: region.height.min(height - y0) }
}

/// The pixels that a frame on disk holds, by its header: the reference pixel lies at the whole frame's centre.
fn stored_as(dir: &OutputDir, number: usize) -> Option<Region> {
    let header = image::keywords(&dir.frame(number)).ok()?;
    let whole = |keyword: &str| header.number(keyword).filter(|v| *v >= 0.0).map(|v| v.round() as usize);
    Some(Region {
        x0: whole("CROPX0")?,
        y0: whole("CROPY0")?,
        width: whole("ZNAXIS1").or_else(|| whole("NAXIS1"))?,
        height: whole("ZNAXIS2").or_else(|| whole("NAXIS2"))?,
    })
}

/// True if the frame is of this scene, its bytes are as they were written, and the other forms asked for are there as well.
fn is_whole(dir: &OutputDir, number: usize, simulator: &Simulator) -> bool {
    let path = dir.frame(number);
    let of_scene = image::keywords(&path).is_ok_and(|h| {
        h.text("SCENESHA").as_deref() == Some(simulator.scene_sha())
            && h.text("GPUNAME").as_deref() == simulator.gpu()
    });
    let asked = |form: &str| simulator.scene.output.format.iter().any(|format| format == form);
    let beside = |ending: &str| path.with_file_name(format!("{number:04}.{ending}"));
    of_scene
        && intact(&path)
        && (!asked("fits.fz") || intact(&beside("fits.fz")))
        && (!asked("exr") || beside("exr").exists())
}

/// True if a FITS file's bytes are as they were written: the sum of each of its parts is -0.
fn intact(path: &Path) -> bool {
    std::fs::read(path)
        .is_ok_and(|bytes| !bytes.is_empty() && checksum::ones_complement_sum(&bytes, 0) == u32::MAX)
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
            if !(kept && intact(&path)) {
                planes.push((name, unit, path));
            }
        }
    }
    if !planes.is_empty() {
        let (mean, variance) =
            expose::planes(&simulator.chip(view, scenery, region), &simulator.scene.detector, region);
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
            let adu = image.data.iter().map(|v| *v as u32).collect::<Vec<_>>();
            let preview = Preview::new(image.width, image.height);
            preview.rows(0, &adu);
            atomic::write(&path, &preview.png()?)?;
        }
    }
    if output.format.iter().any(|format| format == "reg") {
        let path = dir.numbered("regions", "", number, "reg")?;
        if !(kept && path.exists()) {
            let names = simulator.scene.target.iter().map(|t| t.name.as_str());
            let targets = names.zip(&scenery.targets).collect::<Vec<_>>();
            atomic::write(&path, regions::ds9(&scenery.stars, &targets, region).as_bytes())?;
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

/// The forms of a frame, filled band by band as it is computed.
struct Forms {
    fits: Option<fits::Writer>,
    /// Compressed rows.
    fz: Option<Mutex<Vec<Vec<u8>>>>,
    preview: Option<Preview>,
    /// Numbers less bias \[e-\].
    electrons: Option<Mutex<Vec<f32>>>,
}

impl Forms {
    fn rows(&self, scene: &Scene, width: usize, first: usize, rows: Rows) -> io::Result<()> {
        if let Some(fz) = &self.fz {
            let compressed: Vec<Vec<u8>> = match rows {
                Rows::U16(rows) => rows.chunks_exact(width).map(fz::compress_row_u16).collect(),
                Rows::U32(rows) => rows.chunks_exact(width).map(fz::compress_row_u32).collect(),
            };
            let mut all = fz.lock().unwrap_or_else(PoisonError::into_inner);
            all[first..].iter_mut().zip(compressed).for_each(|(row, bytes)| *row = bytes);
        }
        match (&self.preview, rows) {
            (Some(preview), Rows::U16(rows)) => preview.rows(first, rows),
            (Some(preview), Rows::U32(rows)) => preview.rows(first, rows),
            (None, _) => {}
        }
        if let Some(electrons) = &self.electrons {
            let d = &scene.detector;
            let charge = |adu: f64| ((adu - d.bias_adu) * d.gain_e_per_adu) as f32;
            let mut all = electrons.lock().unwrap_or_else(PoisonError::into_inner);
            let out = all[first * width..].iter_mut();
            match rows {
                Rows::U16(rows) => out.zip(rows).for_each(|(e, adu)| *e = charge(f64::from(*adu))),
                Rows::U32(rows) => out.zip(rows).for_each(|(e, adu)| *e = charge(f64::from(*adu))),
            }
        }
        let pixels = match rows {
            Rows::U16(rows) => fits::Pixels::U16(rows),
            Rows::U32(rows) => fits::Pixels::U32(rows),
        };
        self.fits.as_ref().map_or(Ok(()), |file| file.rows(first, pixels))
    }
}

/// Write a frame in all the forms asked for, band by band as they are computed; that of the resumption comes last.
fn write_frame(
    simulator: &Simulator,
    view: &View,
    scenery: &Scenery,
    region: &Region,
    dir: &OutputDir,
) -> Result<(), RunError> {
    let scene = simulator.scene;
    let (width, height, bits) = (region.width, region.height, scene.detector.bits);
    let wide = bits > 16;
    let header = labels::frame(&simulator.labelled(view, scenery, region));
    let asked = |form: &str| scene.output.format.iter().any(|format| format == form);
    let kind = if wide { fits::Kind::U32 } else { fits::Kind::U16 };
    let plain = dir.frame(view.frame);
    let forms = Forms {
        fits: asked("fits").then(|| fits::Writer::create(&plain, width, height, kind, &header)).transpose()?,
        fz: asked("fits.fz").then(|| Mutex::new(vec![Vec::new(); height])),
        preview: asked("png").then(|| Preview::new(width, height)),
        electrons: asked("exr").then(|| Mutex::new(vec![0.0; region.len()])),
    };
    let chip = simulator.chip(view, scenery, region);
    expose::expose(&chip, bits, region, |first, rows| forms.rows(scene, width, first, rows))?;
    if let Some(preview) = forms.preview {
        atomic::write(&dir.numbered("previews", "", view.frame, "png")?, &preview.png()?)?;
    }
    if let Some(electrons) = forms.electrons {
        let electrons = electrons.into_inner().unwrap_or_else(PoisonError::into_inner);
        let mut layers = scenery.layers(region);
        layers.insert(0, ("electrons".into(), electrons));
        let channels = layers.iter().map(|(name, plane)| (name.as_str(), Samples::F32(plane))).collect::<Vec<_>>();
        let bytes = exr_file::encode(width, height, &channels, &header, false)?;
        atomic::write(&dir.numbered("frames", "", view.frame, "exr")?, &bytes)?;
    }
    if let Some(rows) = forms.fz {
        let rows = rows.into_inner().unwrap_or_else(PoisonError::into_inner);
        let depth = if wide { fz::Depth::U32 } else { fz::Depth::U16 };
        let bytes = fz::file(width, height, depth, &rows, &header);
        atomic::write(&dir.numbered("frames", "", view.frame, "fits.fz")?, &bytes)?;
    }
    forms.fits.map_or(Ok(()), |file| Ok(file.finish()?))
}
