//! The chart of error against run time of the ways to find shadows, one panel a shape.

use super::palette::COLOURS;
use crate::base::accuracy::AccuracyRow;
use plotters::coord::Shift;
use plotters::prelude::*;

/// Size of a panel \[px\].
const PANEL: (u32, u32) = (430, 340);
/// Errors below are drawn there: those of the exact way are round-off.
const LEAST_ERROR: f64 = 1e-7;

/// Names of the ways in the rows, and in the legend.
const WAYS: [(&str, &str); 5] = [
    ("object.exact", "exact: clipped polygons (its error is round-off, 1e-13)"),
    ("object.no-shadows", "no shadows"),
    ("object.rays", "rays, 1e2 to 1e6"),
    ("object.map", "shadow maps on the processor, 64 to 4096 px"),
    ("object.device", "shadow maps on the graphics processor"),
];

type Drawn = Result<(), Box<dyn std::error::Error>>;

/// The chart as SVG; none if no row is of a shape.
pub fn svg(rows: &[AccuracyRow]) -> Option<String> {
    let mut shapes: Vec<&str> = Vec::new();
    for (name, _) in rows.iter().filter_map(of_shape) {
        if !shapes.contains(&name) {
            shapes.push(name);
        }
    }
    let columns = shapes.len().clamp(1, 3);
    let lines = shapes.len().div_ceil(columns);
    if shapes.is_empty() {
        return None;
    }
    let mut text = String::new();
    let size = (PANEL.0 * columns as u32, PANEL.1 * lines as u32 + 130);
    // drawing into a string fails only where the chart has no room, which its size gives
    let drawn = draw(&mut text, size, &shapes, (lines, columns), rows);
    debug_assert!(drawn.is_ok(), "{drawn:?}");
    Some(text)
}

/// Name of the shape and the row, of rows of shapes.
fn of_shape(row: &AccuracyRow) -> Option<(&str, &AccuracyRow)> {
    let shape = row.approximation.starts_with("object.");
    row.setting.split_once(": ").filter(|_| shape).map(|(name, _)| (name, row))
}

fn draw(
    text: &mut String,
    size: (u32, u32),
    shapes: &[&str],
    grid: (usize, usize),
    rows: &[AccuracyRow],
) -> Drawn {
    let root = SVGBackend::with_string(text, size).into_drawing_area();
    root.fill(&WHITE)?;
    let (above, below) = root.split_vertically(size.1 as i32 - 130);
    for (panel, name) in above.split_evenly(grid).iter().zip(shapes) {
        let own = rows.iter().filter_map(of_shape).filter(|(shape, _)| shape == name).map(|(_, row)| row);
        one(panel, name, &own.collect::<Vec<_>>())?;
    }
    for (k, ((_, words), colour)) in WAYS.iter().zip(COLOURS).enumerate() {
        let y = 12 + 22 * k as i32;
        below.draw(&Rectangle::new([(60, y), (76, y + 12)], colour.filled()))?;
        below.draw_text(words, &TextStyle::from(("sans-serif", 15).into_font()), (86, y))?;
    }
    Ok(root.present()?)
}

fn one(panel: &DrawingArea<SVGBackend, Shift>, name: &str, rows: &[&AccuracyRow]) -> Drawn {
    let times = rows.iter().map(|r| r.time_s * 1e3).filter(|t| *t > 0.0);
    let (low, high) = times.fold((f64::MAX, f64::MIN), |(l, h), t| (l.min(t), h.max(t)));
    if low > high {
        return Ok(());
    }
    let mut chart = ChartBuilder::on(panel)
        .caption(name, ("sans-serif", 17))
        .margin(10)
        .x_label_area_size(38)
        .y_label_area_size(62)
        .build_cartesian_2d((0.5 * low..2.0 * high).log_scale(), (0.5 * LEAST_ERROR..3.0).log_scale())?;
    let power = |v: &f64| format!("1e{:.0}", v.log10());
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(BLACK.mix(0.12))
        .x_labels(6)
        .y_labels(8)
        .x_label_formatter(&power)
        .y_label_formatter(&power)
        .x_desc("ms an epoch")
        .y_desc("rms error of the light")
        .label_style(("sans-serif", 12))
        .draw()?;
    for ((way, _), colour) in WAYS.iter().zip(COLOURS) {
        let points = rows.iter().filter(|row| row.approximation == *way && row.time_s > 0.0);
        let points = points.map(|row| (row.time_s * 1e3, row.rms_err.max(LEAST_ERROR))).collect::<Vec<_>>();
        chart.draw_series([PathElement::new(points.clone(), colour.stroke_width(2))])?;
        chart.draw_series(points.iter().map(|p| Circle::new(*p, 4, colour.filled())))?;
    }
    Ok(())
}
