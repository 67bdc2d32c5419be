//! The chart of a model light curve: V against time, and against the phase angle where that changes.

use super::palette::COLOURS;
use crate::run::model_curve::Curve;
use crate::scene::Scene;
use plotters::prelude::*;

/// Size of the chart \[px\].
const SIZE: (u32, u32) = (1200, 680);
/// Epochs farther apart than this many cadences are not joined: one has no light.
const GAP: f64 = 1.5;

/// The chart as SVG.
pub fn svg(scene: &Scene, curves: &[Curve]) -> String {
    let mut text = String::new();
    // drawing into a string fails only where the chart has no room, which its size gives
    let drawn = draw(&mut text, scene, &curves[..curves.len().min(COLOURS.len())]);
    debug_assert!(drawn.is_ok(), "{drawn:?}");
    text
}

type Drawn = Result<(), Box<dyn std::error::Error>>;

/// Minutes since the first exposure, V, and the phase angle \[deg\] of epochs with light.
fn points(scene: &Scene, curve: &Curve) -> Vec<(f64, f64, f64)> {
    let start = scene.exposures.start;
    let point = |e: &crate::run::model_curve::Epoch| {
        (e.seen.mid.since(&start) / 60.0, e.light.mag_v(), e.seen.light.phase.to_degrees())
    };
    curve.epochs.iter().map(point).filter(|p| p.1.is_finite()).collect()
}

fn draw(text: &mut String, scene: &Scene, curves: &[Curve]) -> Drawn {
    let root = SVGBackend::with_string(text, SIZE).into_drawing_area();
    root.fill(&WHITE)?;
    let lines = curves.iter().map(|curve| points(scene, curve)).collect::<Vec<_>>();
    let (low, high) = lines.iter().flatten().fold((f64::MAX, f64::MIN), |(l, h), p| (l.min(p.1), h.max(p.1)));
    if low > high {
        let style = TextStyle::from(("sans-serif", 22).into_font());
        root.draw_text(
            "no light in any epoch: the targets are in the Earth's shadow or turned away",
            &style,
            (60, 60),
        )?;
        return Ok(root.present()?);
    }
    let margin = (0.06 * (high - low)).max(0.02);
    let e = &scene.exposures;
    let end = ((e.count.saturating_sub(1)) as f64 * e.cadence_s + e.duration_s).max(1.0) / 60.0;
    let title = format!("{}, {} from {} UTC", scene.name, scene.station.name, e.start.iso_utc());
    let mut chart = ChartBuilder::on(&root)
        .caption(title, ("sans-serif", 20))
        .margin(14)
        .x_label_area_size(44)
        .y_label_area_size(70)
        .build_cartesian_2d(0.0..end, high + margin..low - margin)?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(BLACK.mix(0.12))
        .x_desc("minutes since the first exposure")
        .y_desc("V outside the atmosphere, mag")
        .label_style(("sans-serif", 14))
        .draw()?;
    let apart = GAP * e.cadence_s.max(1e-9) / 60.0;
    for ((curve, line), colour) in curves.iter().zip(&lines).zip(COLOURS) {
        let dots = line.len() <= 400;
        for run in line.chunk_by(|a, b| b.0 - a.0 <= apart) {
            chart.draw_series([PathElement::new(
                run.iter().map(|p| (p.0, p.1)).collect::<Vec<_>>(),
                colour.stroke_width(2),
            )])?;
        }
        let radius = if dots { 3 } else { 1 };
        chart
            .draw_series(line.iter().map(|p| Circle::new((p.0, p.1), radius, colour.filled())))?
            .label(legend(curve, line))
            .legend(move |(x, y)| Rectangle::new([(x, y - 5), (x + 14, y + 5)], colour.filled()));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::LowerRight)
        .background_style(WHITE.mix(0.85))
        .border_style(BLACK.mix(0.3))
        .label_font(("sans-serif", 15))
        .draw()?;
    Ok(root.present()?)
}

/// Name of a target and the range of its phase angle.
fn legend(curve: &Curve, line: &[(f64, f64, f64)]) -> String {
    let (low, high) = line.iter().fold((f64::MAX, f64::MIN), |(l, h), p| (l.min(p.2), h.max(p.2)));
    if low > high {
        return format!("{}: no light", curve.target);
    }
    format!("{}, phase angle {low:.0} to {high:.0} deg", curve.target)
}
