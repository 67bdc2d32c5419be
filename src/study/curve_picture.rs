//! The picture of light curves: magnitudes upwards to bright, with errors, flags, models and residuals, against time or
//! against the phase of a period.
//!
//! Days between nights are cut out of the axis of time, at dashed lines. Every point is drawn. An error bar that is shorter than the mark of its point is left out, and one that leaves the
//! panel ends at its edge. Residuals are magnitude minus model, the model taken linear between its epochs.

use super::curve_axis::Axis;
use super::curve_marks::{Area, Drawn, KINDS, Mark, kind, sample, symbol};
use super::palette::COLOURS;
use crate::astro::time::Instant;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

/// Width of the picture \[px\].
const WIDTH: u32 = 1200;
/// Height of a panel of magnitudes that is alone \[px\].
const TALL: u32 = 560;
/// Height of a panel of magnitudes among others \[px\].
const LOW: u32 = 290;
/// Height of a panel of residuals \[px\].
const RESIDUALS: u32 = 190;
/// Height of the title \[px\].
const TITLE: u32 = 40;
/// Height of a row of the legend \[px\].
const ROW: i32 = 26;
/// Margin at the left and right of the legend \[px\].
const SIDE: i32 = 84;
/// A model's epochs farther apart than this many times their median distance are not joined.
const GAP: f64 = 5.0;
/// Points of a curve beyond which the marks are small.
const CROWD: usize = 400;

/// Magnitudes of this size and beyond are not drawn: no light has them, and an axis could not.
const ABSURD: f64 = 1e3;

/// A point of a light curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Middle of the exposure.
    pub time: Instant,
    /// Magnitude; a point is drawn if it is less than 1000 in size.
    pub mag: f64,
    /// Its standard error \[mag\]; NaN if unknown.
    pub mag_err: f64,
    /// Flags of the measurement, as in `lightcurve.ecsv`.
    pub flags: u32,
}

/// The light curve of a target.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Series {
    /// Name of the target.
    pub name: String,
    /// The measurements, in any order.
    pub points: Vec<Point>,
    /// Epochs and magnitudes of a model, in the order of time; empty for none.
    pub model: Vec<(Instant, f64)>,
}

/// What runs to the right.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Abscissa {
    /// Time.
    Time,
    /// Phase of a period, two turns of it.
    Phase {
        /// Period \[s\], positive.
        period_s: f64,
        /// Time of phase 0.
        epoch: Instant,
    },
}

/// What a picture shows.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Title.
    pub title: String,
    /// What the magnitudes are, such as "V outside the atmosphere, mag".
    pub ordinate: String,
    /// The curves; of more than eight the first eight are drawn, and the picture says so.
    pub series: Vec<Series>,
    /// What runs to the right.
    pub abscissa: Abscissa,
    /// Whether each curve has a panel of its own.
    pub panels: bool,
    /// Whether residuals against the models are drawn below.
    pub residuals: bool,
}

/// Why there is no picture.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PictureError {
    /// A period that is none.
    #[error("the period is {0} s; it must be positive and finite")]
    Period(f64),
}

type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<Axis, RangedCoordf64>>;

/// The picture as SVG.
///
/// # Errors
/// [`PictureError::Period`] for a period that is not positive and finite.
pub fn svg(picture: &Picture) -> Result<String, PictureError> {
    if let Abscissa::Phase { period_s, .. } = picture.abscissa
        && !(period_s > 0.0 && period_s.is_finite())
    {
        return Err(PictureError::Period(period_s));
    }
    let mut text = String::new();
    let plan = Plan::of(picture);
    // drawing into a string fails only where the chart has no room, which its size gives
    let drawn = draw(&mut text, &plan);
    debug_assert!(drawn.is_ok(), "{drawn:?}");
    Ok(text)
}

/// What is drawn, in the coordinates of the axes.
struct Plan<'a> {
    picture: &'a Picture,
    series: &'a [Series],
    axis: Axis,
    start: Instant,
    /// Entries of the legend: what mark, and words.
    legend: Vec<(Mark, String)>,
}

impl<'a> Plan<'a> {
    fn of(picture: &'a Picture) -> Self {
        let series = picture.series.get(..COLOURS.len()).unwrap_or(&picture.series);
        let drawn = series.iter().flat_map(|s| &s.points).filter(|p| drawable(p.mag));
        let times = drawn.clone().map(|p| p.time).chain(series.iter().flat_map(|s| s.model.iter().map(|m| m.0)));
        let first = times.clone().min().unwrap_or_default();
        let axis = match picture.abscissa {
            Abscissa::Time => {
                let mut seconds = times.map(|t| t.since(&first)).collect::<Vec<_>>();
                seconds.sort_by(f64::total_cmp);
                Axis::of_times(&first, &seconds)
            }
            Abscissa::Phase { period_s, epoch } => Axis::of_phase(period_s, &epoch),
        };
        let names = series.iter().zip(COLOURS).map(|(s, c)| (Mark::Colour(c), s.name.clone()));
        let mut legend = names.collect::<Vec<_>>();
        if series.iter().any(|s| !s.model.is_empty()) {
            legend.push((Mark::Line, "model".to_owned()));
        }
        for (number, (_, words)) in KINDS.iter().enumerate() {
            if drawn.clone().any(|p| kind(p.flags) == Some(number)) {
                legend.push((Mark::Kind(number), (*words).to_owned()));
            }
        }
        let more = picture.series.len() - series.len();
        if more > 0 {
            legend.push((Mark::None, format!("{more} more are not shown")));
        }
        Self { picture, series, axis, start: first, legend }
    }

    /// Places of a time on the axis: one of time, two of phase.
    fn places(&self, time: &Instant) -> Vec<f64> {
        match self.picture.abscissa {
            Abscissa::Time => vec![self.axis.place(time.since(&self.start))],
            Abscissa::Phase { period_s, epoch } => {
                let phase = (time.since(&epoch) / period_s).rem_euclid(1.0);
                vec![phase, phase + 1.0]
            }
        }
    }

    /// Rows of the legend: entries and where they begin \[px\].
    fn rows(&self) -> Vec<Vec<(i32, &(Mark, String))>> {
        let mut rows = vec![Vec::new()];
        let mut at = SIDE;
        for entry in &self.legend {
            let width = 48 + 15 * entry.1.chars().count() as i32 / 2;
            if at + width > WIDTH as i32 - 20 && at > SIDE {
                rows.push(Vec::new());
                at = SIDE;
            }
            rows.last_mut().into_iter().for_each(|row| row.push((at, entry)));
            at += width;
        }
        rows
    }
}

/// A panel: its height, its curves with their numbers, and whether they are residuals.
type Panel<'a> = (u32, Vec<(usize, &'a Series)>, bool);

fn draw(text: &mut String, plan: &Plan) -> Drawn {
    let all = || plan.series.iter().enumerate();
    let panels = if plan.picture.panels && plan.series.len() > 1 {
        all().map(|s| (LOW, vec![s], false)).collect::<Vec<Panel>>()
    } else {
        vec![(TALL, all().collect(), false)]
    };
    let residual = plan.picture.residuals && plan.series.iter().any(|s| s.model.len() > 1);
    let panels =
        panels.into_iter().chain(residual.then(|| (RESIDUALS, all().collect(), true))).collect::<Vec<_>>();
    let rows = plan.rows();
    let strip = ROW as u32 * rows.len() as u32 + 12;
    let height = TITLE + panels.iter().map(|p| p.0).sum::<u32>() + strip;
    let root = SVGBackend::with_string(text, (WIDTH, height)).into_drawing_area();
    root.fill(&WHITE)?;
    let (title, mut rest) = root.split_vertically(TITLE);
    title.draw_text(&plan.picture.title, &TextStyle::from(("sans-serif", 20).into_font()), (SIDE, 14))?;
    for (number, panel) in panels.iter().enumerate() {
        let (area, below) = rest.split_vertically(panel.0);
        one(&area, plan, panel, number + 1 == panels.len())?;
        rest = below;
    }
    for (number, row) in rows.iter().enumerate() {
        for (at, (mark, words)) in row {
            let y = 6 + ROW * number as i32;
            sample(&rest, *mark, (at + 12, y + 6))?;
            rest.draw_text(words, &TextStyle::from(("sans-serif", 15).into_font()), (at + 30, y))?;
        }
    }
    Ok(root.present()?)
}

fn drawable(mag: f64) -> bool {
    mag.abs() < ABSURD
}

/// Magnitude of the model at a time, between its epochs; none outside.
fn model_at(model: &[(Instant, f64)], time: &Instant) -> Option<f64> {
    let after = model.partition_point(|m| m.0 < *time);
    let right = model.get(after)?;
    if right.0 == *time {
        return Some(right.1);
    }
    let left = model.get(after.checked_sub(1)?)?;
    Some(left.1 + (right.1 - left.1) * time.since(&left.0) / right.0.since(&left.0))
}

/// Points of a curve with what is drawn of them: magnitude, or residual.
fn heights(series: &Series, residual: bool) -> Vec<(Point, f64)> {
    let height =
        |p: &Point| if residual { model_at(&series.model, &p.time).map(|m| p.mag - m) } else { Some(p.mag) };
    let points = series.points.iter().filter(|p| drawable(p.mag));
    points.filter_map(|p| height(p).filter(|h| h.abs() < 2.0 * ABSURD).map(|h| (*p, h))).collect()
}

/// Highest and lowest magnitude of a panel, with room; none if it is empty.
fn span(curves: &[(usize, &Series)], residual: bool) -> Option<(f64, f64)> {
    let points = curves.iter().flat_map(|(_, s)| heights(s, residual)).map(|(_, h)| h);
    let models = curves.iter().flat_map(|(_, s)| &s.model).map(|m| m.1).filter(|m| drawable(*m) && !residual);
    let (low, high) = points.chain(models).fold((f64::MAX, f64::MIN), |(l, h), m| (l.min(m), h.max(m)));
    if low > high {
        return None;
    }
    // a typical error has room, as far as errors do not rule the picture
    let errors =
        curves.iter().flat_map(|(_, s)| &s.points).map(|p| p.mag_err).filter(|e| e.is_finite() && *e > 0.0);
    let mut errors = errors.collect::<Vec<_>>();
    errors.sort_by(f64::total_cmp);
    let error = errors.get(errors.len() / 2).map_or(0.0, |e| e.min((high - low).max(0.5)));
    let room = (0.06 * (high - low)).max(0.02).max(1e-9 * high.abs().max(low.abs())) + error;
    if residual {
        let most = low.abs().max(high.abs()) + room;
        return Some((-most, most));
    }
    Some((low - room, high + room))
}

fn one(area: &Area, plan: &Plan, (_, curves, residual): &Panel, last: bool) -> Drawn {
    let Some((low, high)) = span(curves, *residual) else {
        let style = TextStyle::from(("sans-serif", 18).into_font());
        let names = curves.iter().map(|(_, s)| s.name.as_str()).collect::<Vec<_>>().join(", ");
        return Ok(area.draw_text(&format!("{names}: no finite magnitude"), &style, (SIDE, 40))?);
    };
    let mut chart = ChartBuilder::on(area)
        .margin_right(24)
        .margin_top(8)
        .margin_left(10)
        .x_label_area_size(if last { 48 } else { 14 })
        .y_label_area_size(SIDE - 10)
        .build_cartesian_2d(plan.axis.clone(), high..low)?;
    let decimals = (1.3 - (high - low).log10()).ceil().clamp(0.0, 6.0) as usize;
    let alone = curves.first().filter(|_| curves.len() == 1 && plan.series.len() > 1);
    let ordinate = match (residual, alone) {
        (true, _) => "minus model, mag".to_owned(),
        (false, Some((_, series))) => format!("{}, mag", series.name.chars().take(24).collect::<String>()),
        (false, None) => plan.picture.ordinate.clone(),
    };
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(BLACK.mix(0.12))
        .y_labels(if *residual { 5 } else { 9 })
        .x_desc(if last { plan.axis.name.as_str() } else { "" })
        .y_desc(ordinate)
        .x_label_formatter(&|x| if last { plan.axis.label(*x) } else { String::new() })
        .y_label_formatter(&|y| unsigned_zero(format!("{y:.decimals$}")))
        .label_style(("sans-serif", 14))
        .axis_desc_style(("sans-serif", 15))
        .draw()?;
    // where time is cut out
    for cut in &plan.axis.cuts {
        chart.draw_series(DashedLineSeries::new(
            [(*cut, low), (*cut, high)],
            6,
            5,
            BLACK.mix(0.6).stroke_width(1),
        ))?;
    }
    if *residual {
        let zero = vec![(plan.axis.ends.0, 0.0), (plan.axis.ends.1, 0.0)];
        chart.draw_series([PathElement::new(zero, BLACK.mix(0.5))])?;
    }
    for (number, series) in curves {
        let colour = COLOURS.get(*number).copied().unwrap_or(BLACK);
        points(&mut chart, plan, series, colour, (low, high), *residual)?;
        if !residual {
            model(&mut chart, plan, series, colour)?;
        }
    }
    Ok(())
}

/// A number without the sign of a zero.
fn unsigned_zero(text: String) -> String {
    let zero = text.trim_start_matches('-').bytes().all(|b| matches!(b, b'0' | b'.'));
    if zero { text.trim_start_matches('-').to_owned() } else { text }
}

fn points(
    chart: &mut Chart,
    plan: &Plan,
    series: &Series,
    colour: RGBColor,
    (low, high): (f64, f64),
    residual: bool,
) -> Drawn {
    let heights = heights(series, residual);
    let radius = if heights.len() > CROWD { 2 } else { 4 };
    // the height of a mark in magnitudes
    let (top, bottom) = (chart.backend_coord(&(0.0, low)).1, chart.backend_coord(&(0.0, high)).1);
    let mark = f64::from(radius) * (high - low) / f64::from((bottom - top).abs().max(1));
    let plane = chart.plotting_area().strip_coord_spec();
    let origin = plane.get_pixel_range();
    for (point, height) in &heights {
        for x in plan.places(&point.time) {
            if point.mag_err > mark {
                let ends = [height - point.mag_err, height + point.mag_err].map(|m| (x, m.clamp(low, high)));
                chart.draw_series([PathElement::new(ends.to_vec(), colour.mix(0.55))])?;
            }
            let at = chart.backend_coord(&(x, *height));
            let at = (at.0 - origin.0.start, at.1 - origin.1.start);
            symbol(&plane, kind(point.flags), at, radius, colour)?;
        }
    }
    Ok(())
}

/// The model as dark lines on light ones, so that they show among the points; not joined over gaps and turns.
fn model(chart: &mut Chart, plan: &Plan, series: &Series, colour: RGBColor) -> Drawn {
    let mut steps = series.model.windows(2).map(|w| w[1].0.since(&w[0].0)).collect::<Vec<_>>();
    steps.sort_by(f64::total_cmp);
    let gap = steps.get(steps.len() / 2).map_or(0.0, |median| GAP * median);
    let dark = RGBColor(colour.0 / 2, colour.1 / 2, colour.2 / 2);
    for pair in series.model.windows(2) {
        let near = pair[1].0.since(&pair[0].0) <= gap && drawable(pair[0].1) && drawable(pair[1].1);
        for (a, b) in
            plan.places(&pair[0].0).into_iter().zip(plan.places(&pair[1].0)).filter(|(a, b)| near && b >= a)
        {
            let line = vec![(a, pair[0].1), (b, pair[1].1)];
            chart.draw_series([PathElement::new(line, dark.stroke_width(2))])?;
        }
    }
    Ok(())
}
