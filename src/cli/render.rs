//! `nightglass render`, and what it shares with `run`.

use super::args::{Global, PartArgs, RenderArgs};
use super::gpu::{Purpose, graphics};
use super::talk::{Failure, Talk, clock, load, print_json};
use crate::camera::region::Region;
use crate::camera::truth;
use crate::plan::planner::known;
use crate::plan::table::table as plan_table;
use crate::plan::view::View;
use crate::run::frames::{Done, Job, Rendered, cut, render as render_frames};
use crate::run::{OutputDir, RunError, tables};
use crate::scene::Scene;
use crate::simulate::Simulator;
use crate::study::snr::least;
use serde_json::json;
use std::cell::RefCell;
use std::ops::Range;
use std::path::PathBuf;

/// What a rendering produced.
pub(super) struct Output {
    pub dir: OutputDir,
    pub views: Vec<View>,
    pub rendered: Rendered,
}

pub(super) fn render(args: &RenderArgs, global: &Global, talk: &Talk) -> Result<(), Failure> {
    let scene = load(&args.scene, global)?;
    let output = produce(&scene, &args.part, global, talk)?;
    if global.json {
        let rows = output.rendered.ledger.rows().map(tables::ledger_row).collect::<Vec<_>>();
        return print_json(&json!({ "command": "render", "rows": rows, "frames": output.rendered.frames }));
    }
    Ok(())
}

/// Plan, render, and write everything `render` writes.
pub(super) fn produce(scene: &Scene, part: &PartArgs, global: &Global, talk: &Talk) -> Result<Output, Failure> {
    let frames = frame_range(part.frames.as_deref(), scene.exposures.count)?;
    let crop = part.crop.as_deref().map(|text| crop_region(text, scene)).transpose()?;
    let mut simulator = Simulator::new(scene)?;
    simulator.graphics = graphics(scene, Purpose::Frames, global, talk)?;
    let planned = least::planned(&simulator, &|| ())?;
    simulator.planner.warnings().iter().for_each(|w| talk.say(&format!("warning: {w}")));
    let path = global.output.clone().unwrap_or_else(|| PathBuf::from("out").join(&scene.name));
    let dir = OutputDir::prepare(&path, scene, global.force)?;
    tables::write(&dir, "plan.ecsv", &plan_table(&planned))?;
    let unknown = planned.iter().filter(|p| p.view().is_none() && frames.contains(&p.frame()));
    let unknown = unknown.map(|p| (p.frame(), p.why().to_owned())).collect::<Vec<_>>();
    let views = known(planned);

    let bar = talk.bar(frames.len(), "frames");
    let (kept, skipped) = (RefCell::new(0), RefCell::new(Vec::new()));
    let clock = clock();
    let job = Job {
        frames: frames.clone(),
        crop,
        clock: &clock,
        done: &|done| {
            match done {
                Done::Written(_) => {}
                Done::Kept(_) => *kept.borrow_mut() += 1,
                Done::Skipped(number, why) => skipped.borrow_mut().push((*number, why.clone())),
            }
            bar.inc(1);
        },
    };
    let rendered = render_frames(&simulator, &views, &dir, &job)?;
    bar.finish_and_clear();
    tables::write(&dir, "truth.ecsv", &truth::table(&rendered.truth))?;
    tables::write_ledger(&dir, &rendered.ledger, &rendered.frames)?;

    let kept = kept.into_inner();
    let note = if kept > 0 { format!(" ({kept} of them from an earlier run)") } else { String::new() };
    talk.say(&format!("{} frames in {}{note}, {:.1} s", rendered.frames.len(), dir.path().display(), clock()));
    for (number, why) in unknown.into_iter().chain(skipped.into_inner()) {
        talk.say(&format!("frame {number}: not rendered, {why}"));
    }
    for row in rendered.ledger.rows().filter(|row| row.bound.is_nan() && !row.is_needed()) {
        talk.say(&format!("warning: {}: {}", row.name, row.why));
    }
    for row in rendered.ledger.rows() {
        talk.detail(&format!("{:22} {:6} {}", row.name, row.verdict, row.why));
    }
    Ok(Output { dir, views, rendered })
}

/// Frames of `--frames`: A..B, A..=B, A.., ..B or one number; no more than there are.
fn frame_range(text: Option<&str>, count: usize) -> Result<Range<usize>, RunError> {
    let Some(text) = text else { return Ok(0..count) };
    let fault =
        || RunError::Usage(format!("--frames {text}: not A..B, A..=B or a number, with numbers 0..{count}"));
    let number =
        |t: &str, empty: usize| if t.is_empty() { Ok(empty) } else { t.trim().parse().map_err(|_| fault()) };
    let range = match text.split_once("..") {
        None => text.trim().parse().map(|n: usize| n..n.saturating_add(1)).map_err(|_| fault())?,
        Some((a, b)) => match b.strip_prefix('=') {
            Some(last) => number(a, 0)?..number(last, count)?.checked_add(1).ok_or_else(fault)?,
            None => number(a, 0)?..number(b, count)?,
        },
    };
    if range.is_empty() || range.end > count {
        return Err(fault());
    }
    Ok(range)
}

/// Pixels of `--crop`, cut to the frame.
fn crop_region(text: &str, scene: &Scene) -> Result<Region, RunError> {
    let [width, height] = scene.detector.stored_px();
    let fault =
        || RunError::Usage(format!("--crop {text}: not x0,y0,width,height inside {width} x {height} pixels"));
    let numbers =
        text.split(',').map(|t| t.trim().parse::<usize>()).collect::<Result<Vec<_>, _>>().map_err(|_| fault())?;
    let &[x0, y0, width, height] = numbers.as_slice() else { return Err(fault()) };
    let region = cut(scene, Region { x0, y0, width, height });
    if region.is_empty() { Err(fault()) } else { Ok(region) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frame_ranges() {
        let range = |text: &str| frame_range(Some(text), 12).ok();
        assert_eq!(range("3..4"), Some(3..4));
        assert_eq!(range("3..=4"), Some(3..5));
        assert_eq!(range("7"), Some(7..8));
        assert_eq!(range("10.."), Some(10..12));
        assert_eq!(range("..2"), Some(0..2));
        for bad in ["4..4", "0..13", "a..b", "", "12", "-1..3", "0..=18446744073709551615"] {
            assert_eq!(range(bad), None, "{bad}");
        }
    }
}
