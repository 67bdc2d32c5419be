//! The extended Gaussian image on the sphere: facets as discs whose area is theirs, at their normals.
//!
//! Two hemispheres in Lambert's azimuthal equal-area projection (Snyder 1987, USGS Prof. Paper 1395, eq. 24-3 and 24-4, from the
//! pole): a direction at the angle t from the middle lies at the radius sqrt(2) sin(t/2), the rim at 1. What lies just beyond
//! the rim is drawn again, pale, so that facets near it can be compared.

use super::page::{Anchor, Page, SIDE, SMALL, TITLE, WIDTH, named, number, round_below, width};
use super::palette::COLOURS;
use crate::inversion::sphere::{spacing, tangents};
use crate::object::convex::Facet;
use glam::{DMat2, DVec2, DVec3};
use std::f64::consts::{FRAC_PI_2, TAU};
use std::fmt::Write;

/// Radius of a hemisphere on the page \[px\].
const RADIUS: f64 = 236.0;
/// Height of its middle \[px\].
const MIDDLE: f64 = TITLE + 320.0;
/// Top of the legend \[px\].
const LEGEND: f64 = MIDDLE + RADIUS + 78.0;
/// Angle beyond the rim that is drawn again \[rad\].
const BEYOND: f64 = 0.26;
/// Greatest and least radius of a disc \[px\].
const DISC: [f64; 2] = [40.0, 1.2];
/// Share of the sphere that all discs cover at most, as long as none is too small to be seen.
const COVERED: f64 = 0.3;
/// Most facets with discs, and with errors; the largest are drawn.
const MOST: [usize; 2] = [5000, 400];
/// Most directions of the grid that are used.
const MOST_CELLS: usize = 100_000;
/// Corners of an ellipse of errors.
const CORNERS: usize = 40;
/// Side of the raster of a hemisphere.
const PIXELS: usize = 640;

/// A facet of the image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arrow {
    /// Outward normal, of any length but 0.
    pub normal: DVec3,
    /// Area \[m^2\], or relative.
    pub area: f64,
    /// Half axes of the ellipse of its direction's standard deviations: vectors across the normal, as long as the angle \[rad\];
    /// not finite where the direction is open, which dashes the disc's outline.
    pub half_axes: [DVec3; 2],
    /// Whether it is claimed.
    pub claimed: bool,
}

impl Arrow {
    /// A facet whose direction has one standard deviation \[rad\]: that of the angle between truth and estimate.
    pub fn round(facet: Facet, direction_sd: f64, claimed: bool) -> Self {
        let half_axes = tangents(facet.normal.normalize_or(DVec3::Z)).map(|t| t * direction_sd);
        Self { normal: facet.normal, area: facet.area, half_axes, claimed }
    }

    /// A facet whose moves along [`tangents`] of its normal have a covariance \[rad^2\]; one that is not finite leaves it open.
    pub fn with_covariance(facet: Facet, covariance: DMat2, claimed: bool) -> Self {
        let [a, b, d] =
            [covariance.x_axis.x, 0.5 * (covariance.x_axis.y + covariance.y_axis.x), covariance.y_axis.y];
        if !(a.is_finite() && b.is_finite() && d.is_finite()) {
            return Self { normal: facet.normal, area: facet.area, half_axes: [DVec3::NAN; 2], claimed };
        }
        // eigenvalues and the turn of the first axis
        let (mean, half) = (0.5 * (a + d), (0.5 * (a - d)).hypot(b));
        let (sin, cos) = libm::sincos(0.5 * libm::atan2(b, 0.5 * (a - d)));
        let [e1, e2] = tangents(facet.normal.normalize_or(DVec3::Z));
        let [long, short] = [mean + half, mean - half].map(|v| v.max(0.0).sqrt());
        let half_axes = [(e1 * cos + e2 * sin) * long, (e2 * cos - e1 * sin) * short];
        Self { normal: facet.normal, area: facet.area, half_axes, claimed }
    }

    /// Whether the data leave its direction open.
    fn is_open(&self) -> bool {
        !self.half_axes.iter().all(|axis| axis.is_finite())
    }
}

/// What a picture shows.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Image {
    /// Facets found.
    pub facets: Vec<Arrow>,
    /// True facets, if known.
    pub truth: Vec<Facet>,
    /// Directions spread evenly over the sphere, and whether a facet there would be observed; empty if not known.
    pub grid: Vec<(DVec3, bool)>,
    /// Whether areas are relative rather than in m^2.
    pub relative: bool,
}

/// A hemisphere on the page.
struct Hemisphere {
    name: &'static str,
    /// Where its middle lies \[px\].
    middle: [f64; 2],
    /// To the right, and to the observer; y is upwards.
    right: DVec3,
    towards: DVec3,
}

impl Hemisphere {
    fn both() -> [Self; 2] {
        let middle = |share: f64| [share * WIDTH, MIDDLE];
        [
            Self { name: "seen from +z", middle: middle(0.25), right: DVec3::X, towards: DVec3::Z },
            Self { name: "seen from -z", middle: middle(0.75), right: DVec3::NEG_X, towards: DVec3::NEG_Z },
        ]
    }

    /// Place of a unit vector in units of the rim's radius, upwards positive; none opposite to the middle.
    fn place(&self, n: DVec3) -> Option<DVec2> {
        let stretch = 1.0 / (1.0 + n.dot(self.towards)).sqrt();
        let place = DVec2::new(n.dot(self.right), n.y) * stretch;
        place.is_finite().then_some(place)
    }

    /// The unit vector at a place.
    fn direction(&self, place: DVec2) -> DVec3 {
        let square = place.length_squared();
        let stretch = (2.0 - square).max(0.0).sqrt();
        self.right * (place.x * stretch) + DVec3::Y * (place.y * stretch) + self.towards * (1.0 - square)
    }

    /// Place on the page.
    fn on_page(&self, place: DVec2) -> [f64; 2] {
        [self.middle[0] + RADIUS * place.x, self.middle[1] - RADIUS * place.y]
    }

    /// Where a direction is drawn and whether pale; none if it is not.
    fn mark(&self, n: DVec3) -> Option<([f64; 2], bool)> {
        let height = n.dot(self.towards);
        // the equator belongs to both
        let near = height > -BEYOND.sin();
        let pale = height < 0.0 || (height == 0.0 && self.towards.z < 0.0);
        self.place(n).filter(|_| near).map(|place| (self.on_page(place), pale))
    }
}

/// The picture as SVG. Facets without a finite direction or a positive area are left out; the picture says so.
pub fn image(image: &Image, title: &str) -> String {
    let sound = |n: DVec3, area: f64| n.try_normalize().filter(|_| area > 0.0 && area.is_finite());
    let arrow = |a: &Arrow| Some(Arrow { normal: sound(a.normal, a.area)?, ..*a });
    let mut facets = image.facets.iter().filter_map(arrow).collect::<Vec<_>>();
    facets.sort_by(|a, b| b.area.total_cmp(&a.area));
    let cross = |f: &Facet| Some(Facet { normal: sound(f.normal, f.area)?, ..*f });
    let mut truth = image.truth.iter().filter_map(cross).collect::<Vec<_>>();
    truth.sort_by(|a, b| b.area.total_cmp(&a.area));
    let found = facets.iter().map(|f| f.area).collect::<Vec<_>>();
    let discs = Discs::of(&found, &truth.iter().map(|f| f.area).collect::<Vec<_>>());
    let left_out = image.facets.len() + image.truth.len() - facets.len() - truth.len();
    let mut page = Page::new(LEGEND + 156.0, title);
    for hemisphere in &Hemisphere::both() {
        background(&mut page, hemisphere, &image.grid);
        for (number, facet) in facets.iter().enumerate().take(MOST[0]) {
            disc(&mut page, hemisphere, facet, &discs, number < MOST[1]);
        }
        for facet in truth.iter().take(MOST[0]) {
            if let Some((at, pale)) = hemisphere.mark(facet.normal) {
                let arm = discs.radius(facet.area).max(4.0);
                page.add(format_args!("{}", crossed(at, arm, pale)));
            }
        }
    }
    if facets.is_empty() {
        page.text([SIDE, TITLE + 8.0], 16.0, Anchor::Start, "no facet");
    }
    legend(&mut page, image, &discs);
    let drawn = facets.len().min(MOST[0]);
    let mut words = format!("{} facet{}", facets.len(), if facets.len() == 1 { "" } else { "s" });
    if drawn < facets.len() || facets.len() > MOST[1] || truth.len() > MOST[0] {
        let _ =
            write!(words, "; the {drawn} largest are drawn, the {} largest with their errors", drawn.min(MOST[1]));
    }
    if truth.len() > MOST[0] {
        let _ = write!(words, "; of {} true ones the {} largest", truth.len(), MOST[0]);
    }
    if left_out > 0 {
        let _ = write!(words, "; {left_out} without a finite normal or a positive area left out");
    }
    page.text([SIDE, LEGEND + 118.0], SMALL, Anchor::Start, &format!("{words}."));
    let projection = "Lambert's equal-area projection, graticule of 30 deg. Pale beyond the rim: drawn again from the other side. \
         Crosses are as wide as discs of their areas.";
    page.text([SIDE, LEGEND + 138.0], SMALL, Anchor::Start, projection);
    page.finish()
}

/// Sizes of discs.
struct Discs {
    /// Area of the largest, and its radius \[px\].
    largest: f64,
    radius: f64,
}

impl Discs {
    /// As large as leaves room between them, for areas sorted from the largest.
    fn of(found: &[f64], truth: &[f64]) -> Self {
        let largest = [found, truth].iter().filter_map(|a| a.first()).copied().fold(0.0, f64::max);
        let sum = |areas: &[f64]| areas.iter().map(|a| a / largest).sum::<f64>();
        let all = sum(found).max(sum(truth));
        Self { largest, radius: (COVERED * 2.0 * RADIUS * RADIUS / all).sqrt().min(DISC[0]) }
    }

    /// Radius of the disc of an area \[px\].
    fn radius(&self, area: f64) -> f64 {
        (self.radius * (area / self.largest).sqrt()).max(DISC[1])
    }
}

fn background(page: &mut Page, hemisphere: &Hemisphere, grid: &[(DVec3, bool)]) {
    let [x, y] = hemisphere.middle;
    if grid.iter().any(|cell| !cell.1) {
        let clip = if hemisphere.towards.z > 0.0 { "north" } else { "south" };
        page.add(format_args!(
            "<clipPath id=\"{clip}\"><circle cx=\"{x}\" cy=\"{y}\" r=\"{RADIUS}\"/></clipPath>"
        ));
        let corner = [x - RADIUS, y - RADIUS];
        page.raster(
            corner,
            2.0 * RADIUS,
            PIXELS,
            &shaded(hemisphere, grid),
            &format!("clip-path=\"url(#{clip})\""),
        );
    }
    let thin = "fill=\"none\" stroke=\"#bbb\" stroke-width=\"0.8\"";
    for angle in [30f64, 60.0] {
        let r = RADIUS * std::f64::consts::SQRT_2 * (0.5 * angle.to_radians()).sin();
        page.add(format_args!("<circle cx=\"{x}\" cy=\"{y}\" r=\"{r:.1}\" {thin}/>"));
    }
    for k in 0..12 {
        let (sin, cos) = (f64::from(k) * TAU / 12.0).sin_cos();
        page.line([x + 0.05 * RADIUS * cos, y + 0.05 * RADIUS * sin], [x + RADIUS * cos, y + RADIUS * sin], thin);
    }
    page.add(format_args!("<circle cx=\"{x}\" cy=\"{y}\" r=\"{RADIUS}\" fill=\"none\" stroke=\"#444\"/>"));
    page.text([x - RADIUS - 20.0, y - RADIUS - 34.0], 15.0, Anchor::Start, hemisphere.name);
    let [left, right] = if hemisphere.right.x > 0.0 { ["-x", "+x"] } else { ["+x", "-x"] };
    let far = RADIUS + 42.0;
    page.text([x - far, y + 5.0], 14.0, Anchor::End, left);
    page.text([x + far, y + 5.0], 14.0, Anchor::Start, right);
    page.text([x, y - far], 14.0, Anchor::Middle, "+y");
    page.text([x, y + far + 10.0], 14.0, Anchor::Middle, "-y");
}

/// The raster of what is not observed, striped; every pixel is like the nearest direction of the grid.
fn shaded(hemisphere: &Hemisphere, grid: &[(DVec3, bool)]) -> Vec<u8> {
    let step = grid.len().div_ceil(MOST_CELLS).max(1);
    let cells = grid.iter().step_by(step).filter_map(|(n, seen)| Some((n.try_normalize()?, *seen)));
    let reach = 1.5 * spacing(grid.len() / step);
    let scale = 0.5 * PIXELS as f64;
    let mut nearest = vec![(f64::NEG_INFINITY, true); PIXELS * PIXELS];
    let directions = (0..PIXELS * PIXELS).map(|k| {
        let (column, row) = ((k % PIXELS) as f64 + 0.5, (k / PIXELS) as f64 + 0.5);
        hemisphere.direction(DVec2::new(column / scale - 1.0, 1.0 - row / scale))
    });
    let directions = directions.collect::<Vec<_>>();
    for (n, seen) in cells.filter(|(n, _)| n.dot(hemisphere.towards) > -reach) {
        let Some(place) = hemisphere.place(n) else { continue };
        // lengths grow at most by this towards the rim
        let far = reach * 1.05 * scale;
        let range = |at: f64| {
            let end = |v: f64| v.clamp(0.0, PIXELS as f64) as usize;
            end((at - far).floor())..end((at + far).ceil())
        };
        for row in range((1.0 - place.y) * scale) {
            for column in range((1.0 + place.x) * scale) {
                let k = row * PIXELS + column;
                if let (Some(best), Some(direction)) = (nearest.get_mut(k), directions.get(k)) {
                    let product = n.dot(*direction);
                    if product > best.0 && product > reach.min(FRAC_PI_2).cos() {
                        *best = (product, seen);
                    }
                }
            }
        }
    }
    let colour = |(k, (_, seen)): (usize, &(f64, bool))| match (seen, (k % PIXELS + k / PIXELS) / 7 % 2) {
        (true, _) => [255; 3],
        (false, 0) => [222; 3],
        (false, _) => [238; 3],
    };
    nearest.iter().enumerate().flat_map(colour).collect()
}

/// A facet's disc and the ellipse of its direction's errors.
fn disc(page: &mut Page, hemisphere: &Hemisphere, facet: &Arrow, discs: &Discs, errors: bool) {
    let Some(([x, y], pale)) = hemisphere.mark(facet.normal) else { return };
    let r = discs.radius(facet.area);
    let colour = named(COLOURS[1]);
    let opacity = if pale { 0.3 } else { 1.0 };
    let fill = match facet.claimed {
        true => format!("fill=\"{colour}\" fill-opacity=\"{}\"", 0.5 * opacity),
        false => "fill=\"none\"".to_owned(),
    };
    let dashes = if facet.is_open() { "stroke-dasharray=\"4 3\"" } else { "" };
    page.add(format_args!(
        "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{r:.1}\" {fill} stroke=\"{colour}\" stroke-opacity=\"{opacity}\" \
         {dashes}/>"
    ));
    if errors && let Some(path) = ellipse(hemisphere, facet) {
        page.add(format_args!(
            "<path d=\"{path}\" fill=\"none\" stroke=\"#222\" stroke-width=\"1.2\" stroke-opacity=\"{opacity}\"/>"
        ));
    }
}

/// Outline of an ellipse of errors; none if it is not finite. Errors beyond a quarter of a turn are drawn as such.
fn ellipse(hemisphere: &Hemisphere, facet: &Arrow) -> Option<String> {
    let mut path = String::new();
    for k in 0..CORNERS {
        let (sin, cos) = (k as f64 * TAU / CORNERS as f64).sin_cos();
        let step = facet.half_axes[0] * cos + facet.half_axes[1] * sin;
        let angle = step.length();
        if !angle.is_finite() {
            return None;
        }
        let (far, near) = angle.min(FRAC_PI_2).sin_cos();
        let n = facet.normal * near + step.normalize_or_zero() * far;
        let place = hemisphere.place(n.normalize_or(facet.normal))?;
        let [x, y] = hemisphere.on_page(place);
        // writing to a string cannot fail
        let _ = write!(path, "{}{x:.1} {y:.1}", if k == 0 { 'M' } else { 'L' });
    }
    path.push('Z');
    Some(path)
}

fn crossed([x, y]: [f64; 2], arm: f64, pale: bool) -> String {
    let colour = named(COLOURS[0]);
    let opacity = if pale { 0.35 } else { 1.0 };
    format!(
        "<path d=\"M{:.1} {y:.1}h{:.1}M{x:.1} {:.1}v{:.1}\" stroke=\"{colour}\" stroke-width=\"1.8\" stroke-opacity=\"{opacity}\"/>",
        x - arm,
        2.0 * arm,
        y - arm,
        2.0 * arm
    )
}

fn legend(page: &mut Page, image: &Image, discs: &Discs) {
    let blue = named(COLOURS[1]);
    let y = LEGEND;
    let entries = [
        (
            format!("<circle cx=\"0\" cy=\"0\" r=\"9\" fill=\"{blue}\" fill-opacity=\"0.5\" stroke=\"{blue}\"/>"),
            "claimed",
            true,
        ),
        (format!("<circle cx=\"0\" cy=\"0\" r=\"9\" fill=\"none\" stroke=\"{blue}\"/>"), "not claimed", true),
        (
            "<ellipse rx=\"11\" ry=\"7\" fill=\"none\" stroke=\"#222\" stroke-width=\"1.2\"/>".to_owned(),
            "1 sigma of direction",
            true,
        ),
        (
            format!("<circle r=\"9\" fill=\"none\" stroke=\"{blue}\" stroke-dasharray=\"4 3\"/>"),
            "open direction",
            image.facets.iter().any(Arrow::is_open),
        ),
        (crossed([0.0, 0.0], 9.0, false), "true facet", !image.truth.is_empty()),
        (
            "<rect x=\"-11\" y=\"-8\" width=\"22\" height=\"16\" fill=\"#e4e4e4\" stroke=\"#999\"/>".to_owned(),
            "not observed",
            image.grid.iter().any(|cell| !cell.1),
        ),
    ];
    let mut x = SIDE + 12.0;
    for (mark, words, _) in entries.iter().filter(|entry| entry.2) {
        page.add(format_args!("<g transform=\"translate({x:.1},{y:.1})\">{mark}</g>"));
        page.text([x + 20.0, y + 5.0], SMALL, Anchor::Start, words);
        x += 50.0 + width(words, SMALL);
    }
    let unit = if image.relative { "(relative area)" } else { "m²" };
    let mut x = SIDE;
    let first = round_below(discs.largest);
    for area in [first, round_below(0.1 * first)].into_iter().filter(|area| *area > 0.0) {
        let r = discs.radius(area);
        x += r;
        let at = y + 58.0;
        page.add(format_args!(
            "<circle cx=\"{x:.1}\" cy=\"{at:.1}\" r=\"{r:.1}\" fill=\"none\" stroke=\"{blue}\"/>"
        ));
        let words = format!("{} {unit}", number(area));
        page.text([x + r + 8.0, at + 5.0], SMALL, Anchor::Start, &words);
        x += r + 40.0 + width(&words, SMALL);
    }
}
