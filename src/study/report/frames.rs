//! Frames chosen for the page: overview, cut-outs around the targets, and what is drawn over them.

use super::html::escaped;
use super::picture::{Pixels, cut_out, level, overview};
use super::sheet::{Sheet, evenly};
use crate::base::units::ARCSEC;
use crate::io::image::{Image, Keywords};
use crate::photometry::FieldStar;
use crate::photometry::field::tracks;
use crate::photometry::frame::Frame;
use crate::photometry::header::Overrides;
use crate::stars::catalogue::{Catalogue, moved};
use base64::Engine;
use serde_json::{Value as Json, json};
use std::path::{Path, PathBuf};

/// Most bytes of all overviews, and of one of them, before base64.
const OVERVIEWS: usize = 1_900_000;
const OVERVIEW: usize = 240_000;
/// Most bytes of all cut-outs, before base64, and their sides \[px\].
const CUT_OUTS: usize = 700_000;
const SIDES: [usize; 7] = [192, 160, 128, 96, 64, 48, 32];
/// Most targets with a cut-out of their own in each frame.
const MOST_TARGETS: usize = 6;
/// Most targets marked in a frame.
const MOST_NAMES: usize = 40;
/// Most stars marked in a frame, the brightest.
const MOST_STARS: usize = 120;

/// What tells where things are on the frames.
pub(super) struct Places<'p> {
    pub dir: &'p Path,
    pub curve: Option<&'p Sheet>,
    pub truth: Option<&'p Sheet>,
    pub plan: Option<&'p Sheet>,
    /// Stars to look up where the run wrote none; none if the scene has no such stars.
    pub catalogue: Option<&'p Catalogue>,
}

/// The frames of a page.
#[derive(Debug, Default)]
pub(super) struct Frames {
    /// Frames there are.
    pub total: usize,
    /// What the page's program reads, frame by frame.
    pub data: Vec<Json>,
    /// The pictures as HTML.
    pub pictures: String,
    pub notes: Vec<String>,
}

/// Files of frames, one a name: plain ones before compressed ones.
fn files(dir: &Path) -> Vec<(String, PathBuf)> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(dir.join("frames")).into_iter().flatten().flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let endings = [".fits", ".fit", ".fits.fz", ".fits.gz"];
        if let Some(order) = endings.iter().position(|e| name.ends_with(e)) {
            let stem = name.strip_suffix(endings[order]).unwrap_or(&name).to_owned();
            found.push((stem, order, entry.path()));
        }
    }
    found.sort();
    found.dedup_by(|later, first| later.0 == first.0);
    found.into_iter().map(|(stem, _, path)| (stem, path)).collect()
}

/// The frames of a directory, `most` of them at most.
pub(super) fn collect(places: &Places, most: usize) -> Frames {
    let files = files(places.dir);
    let mut out = Frames { total: files.len(), ..Frames::default() };
    let chosen = evenly(files.len(), most);
    let targets = places.targets();
    let wanted = chosen.len() * targets.len().clamp(1, MOST_TARGETS);
    let side = SIDES.into_iter().find(|s| 2 * s * s * wanted <= CUT_OUTS).unwrap_or(SIDES[SIDES.len() - 1]);
    let budget = (OVERVIEWS / chosen.len().max(1)).min(OVERVIEW);
    for k in chosen {
        let (stem, path) = &files[k];
        let name = format!("frames/{}", path.file_name().unwrap_or_default().to_string_lossy());
        // one after the other: a frame takes as much memory as its pixels
        match Image::read(path) {
            Ok(image) => places.add(&mut out, image, (stem, &name, k), (side, budget), &targets),
            Err(e) => out.notes.push(format!("{name} is left out: {e}")),
        }
    }
    out
}

impl Places<'_> {
    /// Names of the targets, in the order of their first rows.
    fn targets(&self) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for sheet in [self.curve, self.truth].into_iter().flatten() {
            for row in 0..sheet.rows.len().min(1000) {
                let name = sheet.cell(row, "target");
                if names.len() < MOST_NAMES && !names.iter().any(|known| known == name) {
                    names.push(name.to_owned());
                }
            }
        }
        names
    }

    fn add(
        &self,
        out: &mut Frames,
        image: Image,
        (stem, name, index): (&str, &str, usize),
        (side, budget): (usize, usize),
        targets: &[String],
    ) {
        let digits = &stem[stem.trim_end_matches(|c: char| c.is_ascii_digit()).len()..];
        let number = digits.parse().unwrap_or(index as u64);
        let header = image.header.clone();
        let size = [image.width, image.height];
        // geometry first, without the pixels: a frame whose header tells nothing is still a picture
        let known = Frame::assemble(&header, size, Vec::new(), &image.path, &Overrides::default(), None).ok();
        let known = known.map(|(frame, _)| frame);
        let (data, size, geometry) = match known {
            Some(frame) if [frame.width, frame.height] != size => match Frame::from_image(image) {
                Ok(mut trimmed) => {
                    (std::mem::take(&mut trimmed.data), [trimmed.width, trimmed.height], Some(trimmed))
                }
                Err(_) => return,
            },
            known => (image.data, size, known),
        };
        let pixels = Pixels { width: size[0], height: size[1], data: &data };
        let picture = overview(pixels, budget);
        if picture.is_none() {
            out.notes.push(format!("{name}: no overview of it fits into this page"));
        }
        let (view, jpeg) = picture.unzip();
        let jpeg = jpeg.unwrap_or_default();
        let marked = self.marked(number, targets);
        let place = |mark: &Json| Some([mark["x"].as_f64()?, mark["y"].as_f64()?]);
        let mut cuts =
            marked.iter().take(MOST_TARGETS).filter_map(|m| cut_out(pixels, place(m)?, side)).collect::<Vec<_>>();
        if cuts.is_empty() {
            let middle = size.map(|n| (n as f64 - 1.0) / 2.0);
            cuts.extend(cut_out(pixels, middle, side));
        }
        let (stars, origin) = self.stars(number, geometry.as_ref());
        let time = self.time(number, &header);
        out.data.push(json!({
            "number": number, "name": name, "time": time, "width": size[0], "height": size[1],
            "x0": header.number("CROPX0"), "y0": header.number("CROPY0"), "unit": header.text("BUNIT").unwrap_or_else(|| "adu".into()),
            "exptime": header.number("EXPTIME"), "saturate": header.number("SATURATE"),
            "overview": view, "noise": level(&data).1, "cuts": cuts, "targets": marked, "stars": stars, "origin": origin,
            "fwhm": geometry.as_ref().map(Frame::expected_fwhm_px), "wcs": geometry.as_ref().and_then(world),
        }));
        let source = base64::engine::general_purpose::STANDARD.encode(jpeg);
        let label = format!("Frame {number}, {}", if time.is_empty() { name } else { &time });
        out.pictures += &format!(
            "<figure><img class=\"frame\" alt=\"{0}\" src=\"data:image/jpeg;base64,{source}\"><figcaption>{0}</figcaption></figure>",
            escaped(&label)
        );
    }

    /// When a frame was taken, by the tables, else its header.
    fn time(&self, number: u64, header: &Keywords) -> String {
        let row = |sheet: &Sheet| (0..sheet.rows.len()).find(|row| is_frame(sheet, *row, number));
        let told = [self.curve, self.plan].into_iter().flatten();
        let told = told.filter_map(|sheet| Some(sheet.cell(row(sheet)?, "time_utc").to_owned())).next();
        let own = || header.text("DATE-AVG").or_else(|| header.text("DATE-OBS")).unwrap_or_default();
        told.filter(|t| !t.is_empty()).unwrap_or_else(own)
    }

    /// Where the targets are: as measured, else as they truly are, and the true trail.
    fn marked(&self, number: u64, targets: &[String]) -> Vec<Json> {
        let row = |sheet: Option<&Sheet>, target: &str| {
            let sheet = sheet?;
            let own = |row: &usize| is_frame(sheet, *row, number) && sheet.cell(*row, "target") == target;
            (0..sheet.rows.len()).find(own)
        };
        let mark = |target: &String| {
            let (measured, true_row) = (row(self.curve, target), row(self.truth, target));
            let at = |sheet: Option<&Sheet>, row: Option<usize>, name: &str| {
                sheet.zip(row).map_or(f64::NAN, |(sheet, row)| sheet.number(row, name))
            };
            let own = ["x_px", "y_px"].map(|n| at(self.curve, measured, n));
            let truth = ["x_px", "y_px", "x_start_px", "y_start_px", "x_end_px", "y_end_px"];
            let truth = truth.map(|n| at(self.truth, true_row, n));
            let seen = own.iter().all(|v| v.is_finite());
            let [x, y] = if seen { own } else { [truth[0], truth[1]] };
            let trail = truth[2..].iter().all(|v| v.is_finite()).then_some(&truth[2..]);
            let aperture = at(self.curve, measured, "aperture_px");
            (x.is_finite() && y.is_finite()).then(|| {
                json!({ "name": target, "x": x, "y": y, "measured": seen, "trail": trail, "aperture": aperture })
            })
        };
        targets.iter().filter_map(mark).collect()
    }

    /// Paths of stars with their magnitudes, the brightest first, and where they come from.
    fn stars(&self, number: u64, geometry: Option<&Frame>) -> (Vec<Json>, &'static str) {
        let round = |v: f64| (v * 100.0).round() / 100.0;
        let name = format!("stars/stars_{number:04}.ecsv");
        if let Ok(Some(table)) = Sheet::read(self.dir, &name) {
            let mut rows = (0..table.rows.len()).collect::<Vec<_>>();
            rows.sort_by(|a, b| table.number(*a, "mag_v").total_cmp(&table.number(*b, "mag_v")));
            let columns = ["x_start_px", "y_start_px", "x_end_px", "y_end_px", "mag_v"];
            let star = |row: usize| json!(columns.map(|c| round(table.number(row, c))));
            return (rows.into_iter().take(MOST_STARS).map(star).collect(), "the star table");
        }
        let (Some(frame), Some(catalogue)) = (geometry, self.catalogue) else { return (Vec::new(), "") };
        let stars = in_field(frame, catalogue);
        let tracks = tracks(frame, &stars, frame.expected_fwhm_px());
        let star = |t: &crate::photometry::field::Track| {
            let (a, b) = (t.segment.centre - t.segment.half, t.segment.centre + t.segment.half);
            json!([a.x, a.y, b.x, b.y, t.mag_v].map(round))
        };
        let inside = tracks.iter().filter(|t| frame.holds(t.segment.centre, 0.0));
        (inside.take(MOST_STARS).map(star).collect(), "the catalogue")
    }
}

fn is_frame(sheet: &Sheet, row: usize, number: u64) -> bool {
    sheet.cell(row, "frame").parse() == Ok(number)
}

/// Catalogue stars that can be on a frame, at their places of its time.
fn in_field(frame: &Frame, catalogue: &Catalogue) -> Vec<FieldStar> {
    let corner = glam::DVec2::new(frame.width as f64, frame.height as f64);
    let middle = frame.wcs.sky((corner - 1.0) / 2.0);
    let ends = [glam::DVec2::ZERO, corner, glam::DVec2::new(corner.x, 0.0), glam::DVec2::new(0.0, corner.y)];
    let away = |end: &glam::DVec2| crate::astro::separation(frame.wcs.sky(*end), middle);
    let radius = ends.iter().map(away).fold(0.0, f64::max);
    if !(radius > 0.0 && radius < 0.8) {
        return Vec::new();
    }
    let years = frame.time.julian_year() - catalogue.epoch();
    let stars = catalogue.cone(middle, 1.1 * radius, f64::INFINITY);
    let star = |s: &crate::stars::catalogue::CatalogueStar| FieldStar {
        direction: moved(s, years),
        mag_v: s.mag_v,
        colour_bv: s.colour_bv.unwrap_or(f64::NAN),
    };
    stars.iter().map(star).collect()
}

/// World coordinates for the cursor: reference place \[deg\], reference pixel, matrix \[deg/px\]; none where the field is bent.
fn world(frame: &Frame) -> Option<Json> {
    let wcs = &frame.wcs;
    let (ra, dec) = wcs.crval();
    let cd = wcs.cd.to_cols_array().map(f64::to_degrees);
    let sound = wcs.sip.is_none() && cd.iter().all(|v| v.is_finite());
    sound.then(|| {
        json!({
            "ra": ra.to_degrees(), "dec": dec.to_degrees(), "x": wcs.crpix.x, "y": wcs.crpix.y, "cd": cd,
            "scale": wcs.pixel_scale() / ARCSEC,
        })
    })
}
