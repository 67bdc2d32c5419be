//! The chart of error against run time of all approximations, one panel each.

use super::palette::COLOURS;
use crate::base::accuracy::AccuracyRow;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Size of a panel \[px\].
const PANEL: (u32, u32) = (330, 270);
/// Panels side by side.
const COLUMNS: usize = 4;
/// Height of the legend \[px\].
const LEGEND: u32 = 60;
/// Numbers beyond are drawn at these: an axis of hundreds of decades has no marks that could be read.
const ENDS: [f64; 2] = [1e-18, 1e12];
/// An error of nothing is drawn this far below the least of the others.
const BELOW: f64 = 0.1;

type Drawn = Result<(), Box<dyn std::error::Error>>;

/// The chart as SVG; none without rows whose error is known.
pub fn svg(rows: &[AccuracyRow], title: &str) -> Option<String> {
    let tame = |value: f64| if value > 0.0 { value.clamp(ENDS[0], ENDS[1]) } else { 0.0 };
    let drawn = rows.iter().filter(|r| r.max_err.is_finite() && r.rms_err.is_finite() && r.time_s > 0.0);
    let rows = drawn.map(|row| AccuracyRow {
        max_err: tame(row.max_err),
        rms_err: tame(row.rms_err),
        time_s: tame(row.time_s),
        ..row.clone()
    });
    let rows = rows.collect::<Vec<_>>();
    let mut families: Vec<(String, Vec<&AccuracyRow>)> = Vec::new();
    for row in &rows {
        let name = row.family();
        match families.iter_mut().find(|(known, _)| *known == name) {
            Some((_, members)) => members.push(row),
            None => families.push((name, vec![row])),
        }
    }
    if families.is_empty() {
        return None;
    }
    let columns = families.len().min(COLUMNS);
    let lines = families.len().div_ceil(columns);
    let mut text = String::new();
    let size = (PANEL.0 * columns as u32, PANEL.1 * lines as u32 + LEGEND + 34);
    // drawing into a string fails only where the chart has no room, which its size gives
    let drawn = draw(&mut text, size, &families, (lines, columns), title);
    debug_assert!(drawn.is_ok(), "{drawn:?}");
    Some(text)
}

fn draw(
    text: &mut String,
    size: (u32, u32),
    families: &[(String, Vec<&AccuracyRow>)],
    grid: (usize, usize),
    title: &str,
) -> Drawn {
    let root = SVGBackend::with_string(text, size).into_drawing_area();
    root.fill(&WHITE)?;
    let root = root.titled(title, ("sans-serif", 20))?;
    let (above, below) = root.split_vertically(PANEL.1 * grid.0 as u32);
    for (panel, (name, rows)) in above.split_evenly(grid).iter().zip(families) {
        one(panel, name, rows)?;
    }
    legend(&below)?;
    Ok(root.present()?)
}

fn legend(area: &DrawingArea<SVGBackend, Shift>) -> Drawn {
    let style = TextStyle::from(("sans-serif", 14).into_font()).pos(Pos::new(HPos::Left, VPos::Center));
    let mut x = 30;
    let mut entry = |words: &str, draw: &dyn Fn(i32) -> Drawn| {
        draw(x)?;
        area.draw_text(words, &style, (x + 16, 22))?;
        x += 52 + 7 * words.len() as i32;
        Ok::<_, Box<dyn std::error::Error>>(())
    };
    entry("largest error", &|x| Ok(area.draw(&Circle::new((x, 22), 4, COLOURS[1].filled()))?))?;
    entry("rms", &|x| Ok(area.draw(&Circle::new((x, 22), 3, COLOURS[1].mix(0.35).filled()))?))?;
    entry("none faster and more exact", &|x| {
        Ok(area.draw(&PathElement::new(vec![(x - 8, 22), (x + 8, 22)], COLOURS[1].stroke_width(2)))?)
    })?;
    entry("used by the scene", &|x| Ok(area.draw(&Circle::new((x, 22), 8, COLOURS[0].stroke_width(2)))?))?;
    entry("cheapest that meets the wanted error", &|x| {
        Ok(area.draw(&Cross::new((x, 22), 6, COLOURS[2].stroke_width(3)))?)
    })
}

/// The least and the largest of positive numbers; none without any.
fn range(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let (low, high) = values.filter(|v| *v > 0.0).fold((f64::MAX, 0.0f64), |(l, h), v| (l.min(v), h.max(v)));
    (low <= high).then_some((low, high))
}

/// Ends of a logarithmic axis with room at both, over a decade at least.
fn axis((low, high): (f64, f64)) -> std::ops::Range<f64> {
    let (low, high) = (0.6 * low, 1.7 * high);
    let stretch = (10.0 * low / high).max(1.0).sqrt();
    low / stretch..high * stretch
}

fn one(panel: &DrawingArea<SVGBackend, Shift>, name: &str, rows: &[&AccuracyRow]) -> Drawn {
    let Some(times) = range(rows.iter().map(|r| r.time_s * 1e3)) else { return Ok(()) };
    let errors = range(rows.iter().flat_map(|r| [r.max_err, r.rms_err]));
    let (least, most) = errors.unwrap_or((1e-16, 1e-16));
    let nothing = BELOW * least;
    let exact = rows.iter().any(|r| r.max_err == 0.0 || r.rms_err == 0.0);
    let low = if exact { nothing } else { least };
    let power = |v: &f64| format!("1e{:.0}", v.log10());
    let error = |v: &f64| if exact && *v < 0.3 * least { String::new() } else { power(v) };
    let mut chart = ChartBuilder::on(panel)
        .caption(name, ("sans-serif", 15))
        .margin(8)
        .margin_right(16)
        .x_label_area_size(34)
        .y_label_area_size(58)
        .build_cartesian_2d(axis(times).log_scale(), axis((low, most)).log_scale())?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(BLACK.mix(0.12))
        .x_labels(5)
        .y_labels(6)
        .x_label_formatter(&power)
        .y_label_formatter(&error)
        .x_desc("ms")
        .y_desc(rows.first().map_or("", |r| r.unit.as_str()))
        .label_style(("sans-serif", 11))
        .axis_desc_style(("sans-serif", 12))
        .draw()?;
    let at = |row: &AccuracyRow, err: f64| (row.time_s * 1e3, if err > 0.0 { err } else { nothing });
    let mut front = rows.iter().filter(|r| r.pareto).map(|r| at(r, r.max_err)).collect::<Vec<_>>();
    front.sort_by(|a, b| a.0.total_cmp(&b.0));
    chart.draw_series([PathElement::new(front, COLOURS[1].stroke_width(2))])?;
    for row in rows {
        let place = at(row, row.max_err);
        chart.draw_series([Circle::new(at(row, row.rms_err), 3, COLOURS[1].mix(0.35).filled())])?;
        chart.draw_series([Circle::new(place, 4, COLOURS[1].filled())])?;
        if row.default {
            chart.draw_series([Circle::new(place, 8, COLOURS[0].stroke_width(2))])?;
        }
        if row.suggested {
            chart.draw_series([Cross::new(place, 6, COLOURS[2].stroke_width(3))])?;
        }
    }
    if exact {
        let style = TextStyle::from(("sans-serif", 11).into_font()).pos(Pos::new(HPos::Right, VPos::Center));
        let (x, _) = chart.backend_coord(&(axis(times).start, nothing));
        let (_, y) = chart.backend_coord(&(times.0, nothing));
        let (left, top) = panel.get_base_pixel();
        panel.draw_text("none", &style, (x - left - 4, y - top))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::errors::{Errors, row};

    /// Errors of nothing, times of nothing, and what is not known: a chart of what can be drawn, none without any.
    #[test]
    fn charts_of_odd_rows() {
        let of =
            |name: &str, max: f64, time_s: f64| row(name, "x".into(), &Errors { max, rms: max }, "mas", time_s, 0);
        assert_eq!(svg(&[of("a", f64::NAN, 1.0), of("b", 1.0, 0.0)], "t"), None);
        let chart = svg(&[of("a", 0.0, 1.0), of("b", 1e-300, 1e-9), of("b", 1e300, 1e9)], "t").expect("a chart");
        assert!(chart.contains("none") && chart.matches("<circle").count() >= 6, "{chart}");
    }
}
