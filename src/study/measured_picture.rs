//! Pictures of measured light curves, and of those that are read from files; the periodogram.

use super::curve_picture::{Abscissa, Picture, Point, Series, svg};
use super::palette::COLOURS;
use crate::io::curve_file::Row;
use crate::photometry::period::{Candidate, Report};
use crate::run::lightcurve::LightCurve;
use plotters::prelude::*;

/// Size of the periodogram \[px\].
const SIZE: (u32, u32) = (1200, 520);

/// A measured light curve against time.
pub fn measured(curve: &LightCurve, title: &str) -> String {
    let mut series: Vec<Series> = Vec::new();
    for (name, m) in curve.names.iter().zip(&curve.measurements) {
        let point = Point { time: m.time, mag: m.mag_v, mag_err: m.mag_err, flags: m.flags };
        match series.iter_mut().find(|s| s.name == *name) {
            Some(known) => known.points.push(point),
            None => series.push(Series { name: name.clone(), points: vec![point], model: Vec::new() }),
        }
    }
    picture(title, "V outside the atmosphere, mag", series, Abscissa::Time)
}

/// Points of a curve and their magnitudes, against the phase of a period that begins with the first of them.
pub fn folded(points: &[(&Row, f64)], name: &str, period_s: f64) -> String {
    let Some(epoch) = points.iter().map(|(r, _)| r.time).min() else { return String::new() };
    let point = |(r, mag): &(&Row, f64)| Point { time: r.time, mag: *mag, mag_err: r.mag_err, flags: r.flags };
    let series =
        vec![Series { name: name.to_owned(), points: points.iter().map(point).collect(), model: Vec::new() }];
    let title = format!("{name}: period {period_s:.6} s");
    picture(&title, "magnitude", series, Abscissa::Phase { period_s, epoch })
}

fn picture(title: &str, ordinate: &str, series: Vec<Series>, abscissa: Abscissa) -> String {
    let (title, ordinate) = (title.to_owned(), ordinate.to_owned());
    let panels = series.len() > 1;
    // only a period that is none fails
    svg(&Picture { title, ordinate, series, abscissa, panels, residuals: false }).unwrap_or_default()
}

/// The periodogram, its candidates marked.
pub fn periodogram(report: &Report, title: &str) -> String {
    let mut text = String::new();
    // drawing into a string fails only where the chart has no room, which its size gives
    let drawn = draw(&mut text, report, title);
    debug_assert!(drawn.is_ok(), "{drawn:?}");
    text
}

fn draw(text: &mut String, report: &Report, title: &str) -> Result<(), Box<dyn std::error::Error>> {
    let root = SVGBackend::with_string(text, SIZE).into_drawing_area();
    root.fill(&WHITE)?;
    let p = &report.periodogram;
    let (first, last) = (p.frequency_hz.first().copied(), p.frequency_hz.last().copied());
    let Some((low, high)) = first.zip(last).filter(|(a, b)| b > a && *a > 0.0) else {
        let style = TextStyle::from(("sans-serif", 22).into_font());
        root.draw_text("nothing was searched", &style, (60, 60))?;
        return Ok(root.present()?);
    };
    let mut chart = ChartBuilder::on(&root)
        .caption(title, ("sans-serif", 20))
        .margin(14)
        .x_label_area_size(44)
        .y_label_area_size(60)
        .build_cartesian_2d((1.0 / high..1.0 / low).log_scale(), 0.0..1.05)?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(BLACK.mix(0.12))
        .x_desc("period, s")
        .y_desc("share of the variance explained")
        .label_style(("sans-serif", 15))
        .draw()?;
    for (values, colour, name) in
        [(&p.power_multi, COLOURS[1], "all harmonics"), (&p.power_single, COLOURS[0], "one harmonic")]
    {
        let line = p.frequency_hz.iter().zip(values).map(|(f, v)| (1.0 / f, *v));
        chart
            .draw_series(LineSeries::new(line, colour.stroke_width(1)))?
            .label(name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2)));
    }
    let marked = report.candidates.iter().take(3).enumerate();
    for (k, Candidate { period_s, .. }) in marked {
        let style = COLOURS[7].mix(if k == 0 { 0.9 } else { 0.35 }).stroke_width(1);
        chart.draw_series(std::iter::once(PathElement::new([(*period_s, 1.0), (*period_s, 1.05)], style)))?;
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperLeft)
        .background_style(WHITE.mix(0.85))
        .label_font(("sans-serif", 15))
        .draw()?;
    Ok(root.present()?)
}
